
typedef struct {
  double t, h, weight;
  const double *x, *u, *p, *m, *base;
} @_problem;

typedef void (*@_system)(const @_problem *q, const double *y, double *r, double *matrix);

static double @_merit(int n, const double *r, const double *terms)
{
  double worst = 0.0;
  int i;
  for (i = 0; i < n; i++) {
    if (!isfinite(r[i])) return INFINITY;
    worst = fmax(worst, fabs(r[i]) / terms[i]);
  }
  return worst;
}

/* Newton's method. A row is solved when its residual is 1e-12 of its own terms, so units do not
 * matter; steps are halved up to four times and the best of them is taken. */
static int @_newton(int n, @_system system, const @_problem *q, double *y)
{
  double r[@_SIZE_XZ], tried[@_SIZE_XZ], change[@_SIZE_XZ], terms[@_SIZE_XZ];
  double matrix[@_SIZE_XZ * @_SIZE_XZ], factors[@_SIZE_XZ * @_SIZE_XZ], scale[@_SIZE_XZ];
  double merit = INFINITY;
  int pivot[@_SIZE_XZ], i, j, round;
  if (n == 0) return 1;
  for (round = 0; round < 60; round++) {
    double best = INFINITY, chosen = 0.0, share = 1.0;
    system(q, y, r, matrix);
    for (i = 0; i < n; i++) change[i] = -r[i];
    for (i = 0; i < n * n; i++) factors[i] = matrix[i];
    if (!factor(n, factors, pivot, scale)) break;
    solve(n, factors, pivot, change);
    if (!all_finite(n, change)) break;
    for (i = 0; i < n; i++) {
      terms[i] = 0.0;
      for (j = 0; j < n; j++)
        terms[i] += fabs(matrix[i + j * n]) * fmax(fabs(y[j]), fabs(change[j]));
      if (terms[i] == 0.0) terms[i] = 1.0;
    }
    merit = @_merit(n, r, terms);
    if (merit <= 1e-12) {
      for (i = 0; i < n; i++) y[i] += change[i];
      return 1;
    }
    for (j = 0; j < 5; j++, share *= 0.5) {
      double value;
      for (i = 0; i < n; i++) tried[i] = y[i] + share * change[i];
      system(q, tried, r, NULL);
      value = @_merit(n, r, terms);
      if (value < best) {
        best = value;
        chosen = share;
      }
      if (value <= (1.0 - 0.5 * share) * merit) break;
    }
    if (!(best < INFINITY)) break;
    for (i = 0; i < n; i++) y[i] += chosen * change[i];
  }
  return merit <= 1e-8;
}

/* Residuals of the algebraic unknowns at a fixed state. */
static void @_at_state(const @_problem *q, const double *z, double *r, double *matrix)
{
  @_call_residual(q->t, q->x, z, q->u, q->p, q->m, q->h, r);
  if (matrix) @_call_slope(q->t, q->x, z, q->u, q->p, q->m, q->h, matrix);
}

/* Residuals of one stage of a step, y = (x, z). */
static void @_at_stage(const @_problem *q, const double *y, double *r, double *matrix)
{
  const int n_x = @_N_STATES, n = @_N_STATES + @_N_ALGEBRAIC;
  double dx[@_SIZE_X], readings[@_SIZE_Y];
  int i, j;
  @_call_rhs(q->t, y, y + n_x, q->u, q->p, q->m, q->h, dx, readings);
  @_call_residual(q->t, y, y + n_x, q->u, q->p, q->m, q->h, r + n_x);
  for (i = 0; i < n_x; i++) r[i] = y[i] - q->base[i] - q->weight * dx[i];
  if (matrix) {
    @_call_linearised(q->t, y, y + n_x, q->u, q->p, q->m, q->h, matrix);
    for (j = 0; j < n; j++)
      for (i = 0; i < n_x; i++)
        matrix[i + j * n] = (i == j ? 1.0 : 0.0) - q->weight * matrix[i + j * n];
  }
}

int @_unknowns(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z)
{
  @_problem q = {t, h, 0.0, x, u, p, m, NULL};
  double found[@_SIZE_XZ];
  int i;
  for (i = 0; i < @_N_ALGEBRAIC; i++) found[i] = z[i];
  if (!@_newton(@_N_ALGEBRAIC, @_at_state, &q, found)) return @_NO_CONVERGENCE;
  for (i = 0; i < @_N_ALGEBRAIC; i++) z[i] = found[i];
  return @_OK;
}

int @_rates(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z, double *dx)
{
  double y[@_SIZE_Y];
  if (@_unknowns(t, x, u, p, m, h, z)) return @_NO_CONVERGENCE;
  @_call_rhs(t, x, z, u, p, m, h, dx, y);
  return @_OK;
}

int @_outputs(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z, double *y)
{
  double dx[@_SIZE_X];
  if (@_unknowns(t, x, u, p, m, h, z)) return @_NO_CONVERGENCE;
  @_call_rhs(t, x, z, u, p, m, h, dx, y);
  return @_OK;
}

int @_advance(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z, double *m_next)
{
  double next[@_SIZE_M];
  int i;
  if (@_unknowns(t, x, u, p, m, h, z)) return @_NO_CONVERGENCE;
  @_call_advance(t, x, z, u, p, m, h, next);
  for (i = 0; i < @_N_MEMORY; i++) m_next[i] = next[i];
  return @_OK;
}

int @_step(double t, double h, const double *u0, const double *u1, const double *p, double *x,
    double *z, double *m)
{
  static const double g = 0.43586652150845899942;
  const double weights[3][3] = {
    {g, 0.0, 0.0},
    {0.5 * (1.0 - g), g, 0.0},
    {-0.25 * (6.0 * g * g - 16.0 * g + 1.0), 0.25 * (6.0 * g * g - 20.0 * g + 5.0), g}};
  const double ends[3] = {g, 0.5 * (1.0 + g), 1.0};
  double slopes[3][@_SIZE_X], base[@_SIZE_X], u[@_SIZE_U], y[@_SIZE_XZ], next[@_SIZE_M];
  @_problem q;
  int i, stage, before;
  for (i = 0; i < @_N_STATES; i++) y[i] = x[i];
  for (i = 0; i < @_N_ALGEBRAIC; i++) y[@_N_STATES + i] = z[i];
  q.x = NULL;
  q.u = u;
  q.p = p;
  q.m = m;
  q.base = base;
  q.weight = h * g;
  for (stage = 0; stage < 3; stage++) {
    q.t = t + ends[stage] * h;
    q.h = ends[stage] * h;
    for (i = 0; i < @_N_INPUTS; i++) u[i] = u0[i] + ends[stage] * (u1[i] - u0[i]);
    for (i = 0; i < @_N_STATES; i++) {
      base[i] = x[i];
      for (before = 0; before < stage; before++)
        base[i] += h * weights[stage][before] * slopes[before][i];
    }
    if (!@_newton(@_N_STATES + @_N_ALGEBRAIC, @_at_stage, &q, y)) return @_NO_CONVERGENCE;
    for (i = 0; i < @_N_STATES; i++) slopes[stage][i] = (y[i] - base[i]) / (h * g);
  }
  @_call_advance(t + h, y, y + @_N_STATES, u1, p, m, h, next);
  for (i = 0; i < @_N_STATES; i++) x[i] = y[i];
  for (i = 0; i < @_N_ALGEBRAIC; i++) z[i] = y[@_N_STATES + i];
  for (i = 0; i < @_N_MEMORY; i++) m[i] = next[i];
  return @_OK;
}
