/* The equations at one point: inputs, algebraic unknowns, rates, outputs, memory. */

static void set_up(Model* c) {
  Numbers* q = &c->now;
  memset(q, 0, sizeof *q);
  memcpy(q->u, START_U, sizeof q->u);
  memcpy(q->p, START_P, sizeof q->p);
  memcpy(q->v, START_V, sizeof q->v);
  memcpy(q->m, START_M, sizeof q->m);
  q->largest_step = LARGEST_STEP;
  q->tolerance = TOLERANCE;
  for (int j = 0; j < N_S; ++j) q->direction[j] = 1;
  c->fresh = 0;
  c->known_step = 0.0;
  c->trouble = "";
}

/* A rate input follows the slope given for the input that it is the derivative of. */
static void inputs_at(const Numbers* q, double t, double* u) {
  for (int i = 0; i < N_U; ++i) {
    int of = RATE_OF[i];
    u[i] = q->u[i] + q->slope[i] * (t - q->slope_time);
    if (of >= 0 && q->sloped[of]) u[i] = q->slope[of];
  }
}

/* Where a point is evaluated: time, x and z, memory, time since the memory. */
static void call(Model* c, Equation* f, double t, const double* v, const double* m, double h,
                 double* first, double* second, double* third) {
  double u[N_U + 1];
  if (h < 0.0) h = 0.0;
  inputs_at(&c->now, t, u);
  c->arg[0] = &t;
  c->arg[1] = v;
  c->arg[2] = u;
  c->arg[3] = c->now.p;
  c->arg[4] = m;
  c->arg[5] = &h;
  c->res[0] = first;
  c->res[1] = second;
  c->res[2] = third;
  f(c->arg, c->res, c->iw, c->w, 0);
}

static double since_memory(const Numbers* q, double t) { return t - q->memory_time; }

/* Size of the residuals of the algebraic equations in units of their own coefficients. */
static double imbalance(Model* c, const double* fg) {
  double worst = 0.0;
  for (int i = 0; i < N_Z; ++i) {
    double of = 0.0;
    for (int j = 0; j < N_Z; ++j)
      of = fmax(of, fabs(c->jacobian[0][(N_X + i) + (N_X + j) * N_V]));
    worst = fmax(worst, fabs(fg[N_X + i]) / (of > 0.0 ? of : 1.0));
  }
  return worst;
}

static int newton_for_z(Model* c, double t, double* v, double h) {
  double fg[N_V + 1], trial[N_V + 1];
  memcpy(trial, v, sizeof trial);
  for (int iteration = 0; iteration < 60; ++iteration) {
    int done = 1;
    call(c, bg_newton, t, v, c->now.m, h, fg, c->jacobian[0], c->noise[0]);
    if (!all_finite(N_V, fg)) return 0;
    for (int i = N_X; i < N_V; ++i)
      if (fabs(fg[i]) > 4.0 * DBL_EPSILON * c->noise[0][i]) done = 0;
    if (done) return 1;
    for (int j = 0; j < N_Z; ++j)
      for (int i = 0; i < N_Z; ++i)
        c->small[i + j * N_Z] = c->jacobian[0][(N_X + i) + (N_X + j) * N_V];
    if (!factor(N_Z, c->small, c->small_pivot, c->small_scale)) return 0;
    double step[N_Z + 1], before = imbalance(c, fg), part = 1.0, moved = 0.0;
    int halved = 0;
    for (int i = 0; i < N_Z; ++i) step[i] = fg[N_X + i];
    solve(N_Z, c->small, c->small_pivot, step);
    if (!all_finite(N_Z, step)) return 0;
    for (; halved < 30; ++halved, part *= 0.5) {
      for (int i = 0; i < N_Z; ++i) trial[N_X + i] = v[N_X + i] - part * step[i];
      call(c, bg_rates, t, trial, c->now.m, h, fg, 0, 0);
      if (all_finite(N_V, fg) && imbalance(c, fg) <= before) break;
    }
    for (int i = 0; i < N_Z; ++i) {
      double size = fmax(c->now.v_size[N_X + i], fabs(v[N_X + i]));
      moved = fmax(moved, fabs(step[i]) / (size + DBL_MIN));
    }
    if (halved == 30) return moved < 1e-8; /* nothing but rounding is left, or no way on */
    memcpy(v, trial, sizeof trial);
    if (part == 1.0 && moved < 1e-10) return 1;
  }
  return 0;
}

/* Algebraic unknowns at (t, x): from the last ones, then from the declared guess. */
static int settle(Model* c, double t, double* v, double h) {
  double kept[N_V + 1];
  if (N_Z == 0) return 1;
  memcpy(kept, v, sizeof kept);
  if (newton_for_z(c, t, v, h)) return 1;
  memcpy(v, kept, sizeof kept);
  for (int i = N_X; i < N_V; ++i) v[i] = START_V[i];
  if (newton_for_z(c, t, v, h)) return 1;
  memcpy(v, kept, sizeof kept);
  c->trouble = "Newton found no values for the algebraic unknowns";
  return 0;
}

/* Rates, unknowns and outputs of the present point. */
static int refresh(Model* c) {
  Numbers* q = &c->now;
  double h = since_memory(q, q->time);
  if (c->fresh) return 1;
  if (!settle(c, q->time, q->v, h)) return 0;
  call(c, bg_rates, q->time, q->v, q->m, h, c->fg, 0, 0);
  call(c, bg_readings, q->time, q->v, q->m, h, c->y, 0, 0);
  c->fresh = 1;
  return 1;
}

static void note_sizes(Model* c) {
  Numbers* q = &c->now;
  for (int i = 0; i < N_V; ++i) q->v_size[i] = fmax(q->v_size[i], fabs(q->v[i]));
  for (int i = 0; i < N_M; ++i) q->m_size[i] = fmax(q->m_size[i], fabs(q->m[i]));
}

/* Accept the present point: the only place, with the integrator, where memory moves. */
static void remember(Model* c) {
  Numbers* q = &c->now;
  if (N_M > 0) {
    double after[N_M + 1];
    call(c, bg_advance, q->time, q->v, q->m, since_memory(q, q->time), after, 0, 0);
    memcpy(q->m, after, N_M * sizeof(double));
  }
  q->memory_time = q->time;
  note_sizes(c);
}

/* A jump of the inputs is a step of no duration; a timed law has no answer to that and waits. */
static int take_jump(Model* c) {
  Numbers* q = &c->now;
  if (q->jumped && N_M > 0 && !TIMED) {
    if (!settle(c, q->time, q->v, since_memory(q, q->time))) return 0;
    remember(c);
    c->fresh = 0;
  }
  q->jumped = 0;
  return 1;
}

static int begin(Model* c) {
  Numbers* q = &c->now;
  q->memory_time = q->slope_time = q->time;
  if (!settle(c, q->time, q->v, 0.0)) return 0;
  remember(c);
  c->fresh = 0;
  q->jumped = 0;
  if (!refresh(c)) return 0;
  if (!all_finite(N_X, c->fg) || !all_finite(N_Y, c->y)) {
    c->trouble = "a rate or an output is not finite at the start";
    return 0;
  }
  return 1;
}

/* What crosses zero where a law without memory changes its piece. */
static int switches(Model* c, double* values) {
  Numbers* q = &c->now;
  if (!refresh(c)) return 0;
  call(c, bg_switches, q->time, q->v, q->m, since_memory(q, q->time), values, 0, 0);
  return 1;
}

/* Rates of the arguments of the laws with memory; their signs change at turning points. */
static int argument_rates(Model* c, double* rates) {
  Numbers* q = &c->now;
  double s[N_S + 1], by_v[N_S * N_V + 1], dv[N_V + 1], fg[N_V + 1], h = since_memory(q, q->time);
  if (N_S == 0) return 1;
  if (!refresh(c)) return 0;
  call(c, bg_newton, q->time, q->v, q->m, h, fg, c->jacobian[0], c->noise[0]);
  call(c, bg_arguments, q->time, q->v, q->m, h, s, by_v, 0);
  memcpy(dv, fg, N_X * sizeof(double));
  if (N_Z > 0) {
    for (int i = 0; i < N_Z; ++i) {
      double along = 0.0;
      for (int j = 0; j < N_X; ++j) along += c->jacobian[0][(N_X + i) + j * N_V] * fg[j];
      dv[N_X + i] = -along;
      for (int j = 0; j < N_Z; ++j)
        c->small[i + j * N_Z] = c->jacobian[0][(N_X + i) + (N_X + j) * N_V];
    }
    if (!factor(N_Z, c->small, c->small_pivot, c->small_scale)) return 0;
    solve(N_Z, c->small, c->small_pivot, dv + N_X);
  }
  for (int i = 0; i < N_S; ++i) {
    rates[i] = 0.0;
    for (int j = 0; j < N_V; ++j) rates[i] += by_v[i + j * N_S] * dv[j];
  }
  return 1;
}
