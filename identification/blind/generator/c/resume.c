/* The same plants and steps as run.c, but the state is the caller's, so that a record can go on.
 * The command is constant within a step; dead times are made by the caller. */
#include "run.c"

typedef struct {
  Sim s;
  double x[MAX_STATES], c[16];
  int plant, ns;
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
  for (int i = 0; i < ne; i++) {
    const double *r = effects + 13 * i;
    Effect *e = &b->s.e[i];
    e->kind = (int)r[0]; e->slot = (int)r[1]; e->z = b->ns; b->ns += (int)r[2];
    memcpy(e->p, r + 3, sizeof e->p);
  }
}

/* n steps; y: readings at their ends, before the command changes; 0 if it grew beyond bounds */
int bench_advance(Bench *b, long n, double step, int sub, const double *u, double *y) {
  double k1[MAX_STATES] = {0}, k2[MAX_STATES] = {0}, k3[MAX_STATES] = {0}, k4[MAX_STATES] = {0};
  double w[MAX_STATES], h = step / sub, *x = b->x;
  int ns = b->ns, ny = SENSORS[b->plant];
  Sim *s = &b->s;
  for (long k = 0; k < n; k++) {
    Input in = {u + k, 1, 0, step};
    for (int m = 0; m < sub; m++) {
      double t = b->done * step + m * h, end = t + h * (1 - 1e-5);
      s->commit = 1;
      slope(b->plant, s, b->c, &in, t, x, k1);
      s->commit = 0;
      for (int i = 0; i < ns; i++) w[i] = x[i] + h / 2 * k1[i];
      slope(b->plant, s, b->c, &in, t + h / 2, w, k2);
      for (int i = 0; i < ns; i++) w[i] = x[i] + h / 2 * k2[i];
      slope(b->plant, s, b->c, &in, t + h / 2, w, k3);
      for (int i = 0; i < ns; i++) w[i] = x[i] + h * k3[i];
      slope(b->plant, s, b->c, &in, end, w, k4);
      for (int i = 0; i < ns; i++) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
      if (!(x[0] * x[0] < 1e30) || !(x[1] * x[1] < 1e30)) return 0;
    }
    b->done++;
    slope(b->plant, s, b->c, &in, b->done * step - 1e-6 * h, x, k1);
    read_out(b->plant, s, x, y + k * ny);
  }
  return 1;
}
