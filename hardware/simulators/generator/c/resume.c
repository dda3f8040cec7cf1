/* The same plants and steps as run.c, but the state is the caller's, so that a record can go on.
 * The command is constant between its edges; dead times are made by the caller. Compiled behind
 * run.c, in one unit. */

typedef struct {
  Sim s;
  double x[MAX_STATES], most[MAX_STATES], c[16]; /* most: largest that a state has been */
  int plant, ns, steady; /* steady: nothing changes with time alone */
  long done; /* steps */
} Bench;

long bench_size(void) { return sizeof(Bench); }

/* at rest; effects: rows of 13 numbers as in run.c; span (s): of what changes with time */
void bench_start(Bench *b, int plant, int nc, const double *c, int ne, const double *effects,
                 double span) {
  memset(b, 0, sizeof *b);
  b->plant = plant;
  b->ns = STATES[plant];
  memcpy(b->c, c, nc * sizeof *c);
  b->s.ne = ne;
  b->s.span = span;
  b->steady = 1;
  for (int i = 0; i < ne; i++) {
    const double *r = effects + 13 * i;
    Effect *e = &b->s.e[i];
    e->kind = (int)r[0]; e->slot = (int)r[1]; e->z = b->ns; b->ns += (int)r[2];
    memcpy(e->p, r + 3, sizeof e->p);
    if (e->kind <= 4 || e->kind == 65 || e->kind == 70 || e->kind == 71 || e->kind == 77 ||
        e->kind == 98)
      b->steady = 0;
  }
}

/* whether a step changed nothing by more than rounding */
static int rests(Bench *b, const double *before) {
  int still = b->steady;
  for (int j = 0; j < b->ns; j++) {
    b->most[j] = fmax(b->most[j], fabs(b->x[j]));
    still &= fabs(b->x[j] - before[j]) <= 1e-14 * b->most[j];
  }
  return still;
}

/* what changes with time does so from now on */
void bench_begin(Bench *b, double span) {
  b->done = 0;
  b->s.span = span;
  for (int i = 0; i < b->s.ne; i++) b->s.e[i].when = 0;
}

static void piece(Bench *b, double t, double h, const Input *in) {
  double k1[MAX_STATES] = {0}, k2[MAX_STATES] = {0}, k3[MAX_STATES] = {0}, k4[MAX_STATES] = {0};
  double w[MAX_STATES], end = t + h * (1 - 1e-5), *x = b->x;
  Sim *s = &b->s;
  int ns = b->ns;
  s->commit = 1;
  slope(b->plant, s, b->c, in, t, x, k1);
  s->commit = 0;
  for (int i = 0; i < ns; i++) w[i] = x[i] + h / 2 * k1[i];
  slope(b->plant, s, b->c, in, t + h / 2, w, k2);
  for (int i = 0; i < ns; i++) w[i] = x[i] + h / 2 * k2[i];
  slope(b->plant, s, b->c, in, t + h / 2, w, k3);
  for (int i = 0; i < ns; i++) w[i] = x[i] + h * k3[i];
  slope(b->plant, s, b->c, in, end, w, k4);
  for (int i = 0; i < ns; i++) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
}

/* n steps with edges of the command: positions in steps (rising), commands before the first one
 * and after each; y: readings at the ends of the steps, before an edge there; 0 if the motion grew
 * beyond bounds */
int bench_advance(Bench *b, long n, double step, int sub, long edges, const double *at,
                  const double *u, double *y) {
  int ny = SENSORS[b->plant];
  double h = step / sub, *x = b->x, k1[MAX_STATES] = {0}, before[MAX_STATES];
  Sim *s = &b->s;
  long e = 0;
  for (long k = 0; k < n; k++) {
    double from = k;
    while (e < edges && at[e] <= from) e++;
    long next = e < edges ? (long)floor(at[e]) : n;
    memcpy(before, x, sizeof before);
    while (from < k + 1) {
      while (e < edges && at[e] <= from) e++;
      Input in = {u + e, 1, 0, step};
      double to = e < edges && at[e] < k + 1 ? at[e] : k + 1;
      double start = b->done * step + (from - k) * step;
      int whole = to - from == 1;
      int pieces = whole ? sub : (int)ceil((to - from) * sub - 1e-9);
      if (pieces < 1) pieces = 1;
      double part = whole ? h : (to - from) * step / pieces;
      for (int m = 0; m < pieces; m++) piece(b, start + m * part, part, &in);
      if (!(x[0] * x[0] < 1e30) || !(x[1] * x[1] < 1e30)) return 0;
      from = to;
    }
    b->done++;
    Input in = {u + e, 1, 0, step};
    slope(b->plant, s, b->c, &in, b->done * step - 1e-6 * h, x, k1);
    read_out(b->plant, s, x, y + k * ny);
    if (rests(b, before) && next > k) {
      /* nothing moves until the next edge; what this step did is taken back, so that the answer does
       * not depend on where a record was cut */
      memcpy(x, before, sizeof before);
      slope(b->plant, s, b->c, &in, b->done * step - 1e-6 * h, x, k1);
      read_out(b->plant, s, x, y + k * ny);
      b->done += next - k - 1;
      for (; k + 1 < next; k++) memcpy(y + (k + 1) * ny, y + k * ny, ny * sizeof *y);
      for (int i = 0; i < s->ne; i++) s->e[i].when = b->done * step - h;
    }
  }
  return 1;
}
