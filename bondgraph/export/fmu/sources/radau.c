/* Radau IIA of order 5: L-stable, three stages, full Newton on all of them at once with the exact
   Jacobian at each stage, error estimate of Hairer and Wanner (Solving Ordinary Differential
   Equations II, section IV.8). Memory stands still within a sub-step; turning points of the
   arguments of its laws end a sub-step. */

static const double NODE[3] = {0.15505102572168219, 0.64494897427831781, 1.0};
static const double WEIGHT[3][3] = {
    {0.19681547722366042, -0.06553542585019839, 0.02377097434822015},
    {0.39442431473908727, 0.29207341166522847, -0.04154875212599793},
    {0.37640306270046727, 0.51248582618842162, 0.11111111111111111}};
#define REAL_ROOT 3.6378342527444957
static const double ESTIMATE[3] = {-10.048809399827416, 1.3821427331607482, -0.33333333333333333};

static double tolerance_of(const Numbers* q, int i, double now, double noise) {
  return q->tolerance * fmax(q->v_size[i], fabs(now)) + noise;
}

/* Matrix of Newton's method; factored again only if a Jacobian or the step has changed. */
static int prepare(Model* c, double h) {
  size_t bytes = sizeof(double) * N_V * N_V;
  int same = c->known_step == h;
  for (int i = 0; i < 3; ++i) same = same && !memcmp(c->known[i], c->jacobian[i], bytes);
  if (same) return 1;
  for (int b = 0; b < 3; ++b)
    for (int col = 0; col < N_V; ++col)
      for (int a = 0; a < 3; ++a)
        for (int row = 0; row < N_V; ++row) {
          double d = c->jacobian[b][row + col * N_V], x;
          if (row < N_X) x = (a == b && row == col ? 1.0 : 0.0) - h * WEIGHT[a][b] * d;
          else x = a == b ? d : 0.0;
          c->matrix[(a * N_V + row) + (b * N_V + col) * N_ALL] = x;
        }
  c->known_step = 0.0;
  if (!factor(N_ALL, c->matrix, c->pivot, c->scale)) return 0;
  for (int i = 0; i < 3; ++i) memcpy(c->known[i], c->jacobian[i], bytes);
  c->known_step = h;
  return 1;
}

static int solve_stages(Model* c, double h) {
  Numbers* q = &c->now;
  if (N_V == 0) return 1;
  for (int i = 0; i < 3; ++i) memcpy(c->stage[i], q->v, sizeof q->v);
  for (int iteration = 0; iteration < 15; ++iteration) {
    int exact = 1;
    double moved = 0.0;
    for (int i = 0; i < 3; ++i) {
      double t = q->time + NODE[i] * h;
      call(c, bg_newton, t, c->stage[i], q->m, since_memory(q, t), c->rate[i], c->jacobian[i],
           c->noise[i]);
      if (!all_finite(N_V, c->rate[i]) || !all_finite(N_V * N_V, c->jacobian[i])) return 0;
    }
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < N_V; ++k) {
        double r = c->rate[i][k], size = c->noise[i][k];
        if (k < N_X) {
          r = c->stage[i][k] - q->v[k];
          size = fabs(c->stage[i][k]) + fabs(h) * c->noise[i][k];
          for (int j = 0; j < 3; ++j) r -= h * WEIGHT[i][j] * c->rate[j][k];
        }
        if (fabs(r) > 4.0 * DBL_EPSILON * size) exact = 0;
        c->right[i * N_V + k] = r;
      }
    if (exact) return 1;
    if (!prepare(c, h)) return 0;
    solve(N_ALL, c->matrix, c->pivot, c->right);
    if (!all_finite(N_ALL, c->right)) return 0;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < N_V; ++k) {
        double d = c->right[i * N_V + k], floor = k < N_X ? 1e-13 * h * c->noise[i][k] : 0.0;
        c->stage[i][k] -= d;
        floor += tolerance_of(q, k, c->stage[i][k], 0.0) + DBL_MIN;
        moved = fmax(moved, fabs(d) / floor);
      }
    if (moved < 1e-4) return 1;
  }
  return 0;
}

/* Error of x in units of what is tolerated. */
static double state_error(Model* c, double h, const double* start) {
  Numbers* q = &c->now;
  double sum = 0.0, e[N_V + 1];
  if (N_X == 0) return 0.0;
  for (int i = 0; i < N_V; ++i)
    for (int j = 0; j < N_V; ++j)
      c->small[i + j * N_V] =
          i < N_X ? (i == j ? REAL_ROOT / h : 0.0) - c->jacobian[2][i + j * N_V]
                  : c->jacobian[2][i + j * N_V];
  if (!factor(N_V, c->small, c->small_pivot, c->small_scale)) return 1e3;
  for (int k = 0; k < N_V; ++k) {
    e[k] = k < N_X ? start[k] : 0.0;
    for (int i = 0; i < 3 && k < N_X; ++i) e[k] += ESTIMATE[i] * (c->stage[i][k] - q->v[k]) / h;
  }
  solve(N_V, c->small, c->small_pivot, e);
  for (int k = 0; k < N_X; ++k) {
    double allowed = tolerance_of(q, k, c->stage[2][k], 1e-13 * h * c->noise[2][k]) + DBL_MIN;
    sum += (e[k] / allowed) * (e[k] / allowed);
  }
  return sqrt(sum / N_X);
}

/* Where in (0, 1) the first argument turns, from the cubic through start and stages; else 1. */
static double turning_point(Model* c, double h, double s_end[]) {
  Numbers* q = &c->now;
  double s[4][N_S + 1], first = 1.0, knot[4] = {0.0, NODE[0], NODE[1], 1.0};
  if (N_S == 0) return 1.0;
  call(c, bg_arguments, q->time, q->v, q->m, since_memory(q, q->time), s[0], 0, 0);
  for (int i = 0; i < 3; ++i) {
    double t = q->time + NODE[i] * h;
    call(c, bg_arguments, t, c->stage[i], q->m, since_memory(q, t), s[i + 1], 0, 0);
  }
  for (int j = 0; j < N_S; ++j) {
    double d[4], a1, a2, a3, low = fmin(s[0][j], s[3][j]), high = fmax(s[0][j], s[3][j]);
    double size = fmax(q->s_size[j], fmax(fabs(low), fabs(high)));
    s_end[j] = s[3][j];
    for (int i = 0; i < 4; ++i) d[i] = s[i][j];
    for (int order = 1; order < 4; ++order)
      for (int i = 3; i >= order; --i) d[i] = (d[i] - d[i - 1]) / (knot[i] - knot[i - order]);
    a3 = d[3];
    a2 = d[2] - d[3] * (knot[1] + knot[2]);
    a1 = d[1] - d[2] * knot[1] + d[3] * knot[1] * knot[2];
    double root = a2 * a2 - 3.0 * a1 * a3;
    if (root < 0.0) continue;
    double sum = -(a2 + (a2 < 0.0 ? -sqrt(root) : sqrt(root)));
    double at[2] = {a3 != 0.0 ? sum / (3.0 * a3) : 2.0, sum != 0.0 ? a1 / sum : 2.0};
    for (int i = 0; i < 2; ++i) {
      double r = at[i], value = d[0] + r * (a1 + r * (a2 + r * a3));
      if (!(r > 0.0 && r < 1.0)) continue;
      if (fmax(value - high, low - value) > TURN_TOLERANCE * q->tolerance * size)
        first = fmin(first, r);
    }
  }
  return first;
}

/* Memory after one step, and how far three shorter ones differ in units of what is tolerated. */
static double memory_error(Model* c, double h, double* after) {
  Numbers* q = &c->now;
  double worst = 0.0, other[N_M + 1], next[N_M + 1], last = 0.0;
  if (N_M == 0) return 0.0;
  call(c, bg_advance, q->time + h, c->stage[2], q->m, since_memory(q, q->time + h), after, 0, 0);
  if (!TIMED) return 0.0;
  memcpy(other, q->m, sizeof other);
  for (int i = 0; i < 3; ++i) {
    double t = q->time + NODE[i] * h, waited = (NODE[i] - last) * h;
    if (i == 0) waited += since_memory(q, q->time);
    call(c, bg_advance, t, c->stage[i], other, waited, next, 0, 0);
    memcpy(other, next, sizeof other);
    last = NODE[i];
  }
  for (int i = 0; i < N_M; ++i) {
    double size = fmax(q->m_size[i], fabs(after[i]));
    if (size > 0.0)
      worst = fmax(worst, fabs(after[i] - other[i]) / (TURN_TOLERANCE * q->tolerance * size));
  }
  return worst;
}

/* Integrate from the present time to `end`; 0 if that fails. */
static int integrate(Model* c, double end) {
  Numbers* q = &c->now;
  double whole = end - q->time, least = 1e-12 * whole, rough = whole / 4096.0;
  double start[N_V + 1];
  int rejected = 0;
  if (!take_jump(c)) return 0;
  if (!(q->step > 0.0)) q->step = N_X > 0 ? 0.01 * whole : whole;
  while (q->time < end) {
    double rest = end - q->time, h = q->step, err, turn, wrong, after[N_M + 1], s_end[N_S + 1];
    double wanted;
    int last = 0;
    if (q->largest_step > 0.0) h = fmin(h, q->largest_step);
    if (h >= rest * (1.0 - 1e-9)) {
      h = rest;
      last = 1;
    } else if (h > 0.5 * rest) {
      h = 0.5 * rest;
    }
    if (!rejected) {
      if (!settle(c, q->time, q->v, since_memory(q, q->time))) return 0;
      call(c, bg_rates, q->time, q->v, q->m, since_memory(q, q->time), start, 0, 0);
    }
    if (!solve_stages(c, h)) {
      if (h <= least || q->time + 0.25 * h == q->time) {
        c->trouble = "Newton failed even in the smallest sub-step";
        return 0;
      }
      q->step = 0.25 * h;
      rejected = 1;
      continue;
    }
    err = state_error(c, h, start);
    turn = turning_point(c, h, s_end);
    wrong = memory_error(c, h, after);
    wanted = h * fmin(5.0, fmax(0.2, err > 0.0 ? 0.9 * pow(err, -0.25) : 5.0));
    if (wrong > 0.0) wanted = fmin(wanted, h * fmax(0.2, 0.9 / sqrt(wrong)));
    if (h > least && err > 1.0) {
      q->step = fmin(wanted, 0.9 * h);
      rejected = 1;
      continue;
    }
    if (h > rough && (turn < 1.0 || wrong > 1.0)) {
      q->step = fmax(0.5 * rough, fmin(fmin(wanted, 0.98 * h), turn * h));
      rejected = 1;
      continue;
    }
    q->time = last ? end : q->time + h;
    if (N_V > 0) memcpy(q->v, c->stage[2], N_V * sizeof(double));
    if (N_M > 0) memcpy(q->m, after, N_M * sizeof(double));
    q->memory_time = q->time;
    for (int j = 0; j < N_S; ++j) q->s_size[j] = fmax(q->s_size[j], fabs(s_end[j]));
    note_sizes(c);
    if (rejected) wanted = fmin(wanted, fmax(h, 0.98 * q->step));
    /* a step cut short by the end says nothing about how long the next may be */
    q->step = last && !rejected && wanted >= h ? fmax(q->step, wanted) : wanted;
    rejected = 0;
  }
  c->fresh = 0;
  return 1;
}
