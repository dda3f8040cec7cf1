/* Banks of plays within a step: the line on which each is, found by Newton's method around all laws,
   and the derivatives of its plays, a row of NB blocks each; row_block and NB are the caller's. */

#define LOOKS 24
#define CLOSE 1e-14

typedef struct {
  casadi_int n, moving, wide; /* plays in whole eights; whether widths or weights have derivatives */
  const double *width, *weight;
  double *y, *next, *way, *home;
  double stops, size, reach;
  double sum, slope, place; /* the line */
  row_block* rows;          /* derivatives of y */
  const row_block *by_width, *by_weight;
} bank_t;

/* Take a bank from the front of numbers (widths, weights, plays, room for twice as many) and rows. */
static void opened(bank_t* b, int stops, const casadi_int* sizes, casadi_int wide, double** numbers,
                   double** rows) {
  casadi_int i, n = sizes[0];
  b->n = n; b->wide = wide; b->moving = sizes[1]; b->stops = stops;
  b->width = *numbers; b->weight = b->width + n; b->home = b->y = *numbers + 2 * n;
  b->next = b->y + n; b->way = b->y + 2 * n;
  *numbers += 5 * n;
  b->rows = (row_block*)*rows;
  b->by_width = b->rows + n * NB; b->by_weight = b->by_width + n * NB;
  *rows = (double*)(b->moving ? b->by_weight + n * NB : b->by_width);
  b->sum = b->slope = b->place = b->size = b->reach = 0.0;
  for (i = 0; i < n; ++i) { /* as if all would rest */
    b->sum += b->weight[i] * b->y[i];
    b->slope -= b->stops * b->weight[i];
    b->size += fabs(b->weight[i]);
    b->reach = fmax(b->reach, b->width[i]);
  }
}

static inline void put(const bank_t* b, double* line) {
  line[0] = b->sum; line[1] = b->slope; line[2] = b->place;
}

/* Read the bank at a place; whether it lies off the line that led there. */
static inline int looked_up(bank_t* b, double place, int again) {
  double sum, slope, far = place - b->place, size = fabs(place) + fabs(b->place);
  if (again && fabs(far) <= CLOSE * size) return 0;
  sum_of_plays(place, b->n, b->width, b->weight, b->y, b->stops, b->next, &sum, &slope);
  far = fabs(sum - (b->sum + b->slope * far));
  int off = slope != b->slope || !(far <= CLOSE * b->size * (size + b->reach));
  b->sum = sum; b->slope = slope; b->place = place;
  return off;
}

static inline void accepted(bank_t* b) {
  double* y = b->y;
  b->y = b->next;
  b->next = y;
}

static void closed(bank_t* b) {
  if (b->y != b->home) memcpy(b->home, b->y, b->n * sizeof(double));
}

#if SLOPES
/* Derivatives of the sum at its place, then those of slope and place, which stand still. */
static void moved_line(const bank_t* b, row_block* line) {
  const double *width = b->width, *weight = b->weight;
  casadi_int i;
  int v, l;
  for (i = 0; i < b->n; i += PLAYS) {
    plays_t far = *(const plays_t*)(width + i);
    *(plays_t*)(b->way + i) =
        taken_plays(b->place - far, b->place + far, *(const plays_t*)(b->y + i));
  }
  for (v = 0; v < 3 * NB; ++v) line[v] = (row_block){0};
  for (v = 0; v < NB; ++v) {
    row_block some[4] = {0}; /* no sum waits for another one */
    for (i = 0; i < b->n; i += 4)
      for (l = 0; l < 4; ++l)
        some[l] += weight[i + l] * (1.0 - fabs(b->way[i + l])) * b->rows[(i + l) * NB + v];
    line[v] = (some[0] + some[1]) + (some[2] + some[3]);
  }
  for (i = 0; i < b->n && b->moving; ++i) {
    const double each = b->next[i] - b->stops * b->place, push = b->way[i] * weight[i];
    for (v = 0; v < NB; ++v)
      line[v] += each * b->by_weight[i * NB + v] - push * b->by_width[i * NB + v];
  }
}

/* Derivatives of the plays at the end of the step, from those of the place that was asked last. */
static void moved_rows(bank_t* b, const row_block* place) {
  casadi_int i;
  int v;
  for (i = 0; i < b->n; ++i) {
    const double way = b->way[i], share = fabs(way);
    if (way == 0.0) continue;
    for (v = 0; v < NB; ++v) {
      row_block* own = b->rows + i * NB + v;
      *own = share * place[v] + (1.0 - share) * *own;
      if (b->moving) *own -= way * b->by_width[i * NB + v];
    }
  }
}
#endif
