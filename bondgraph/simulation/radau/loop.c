/* Radau IIA with two stages for  x' = f,  0 = g  with memory, and its exact tangents.
   Written around functions by CasADi, which the file that includes this text defines:
   bondsight_stage, bondsight_seed, bondsight_reading, bondsight_slope, bondsight_advance,
   bondsight_moving, and the sizes and sparsities that the macros below name. Banks of plays stand
   beside the memory, which has their lines; each stage has its own. */

#define N (NX + NZ)
#define K (2 * N)
#define TRIES 12
#define TOLERANCE 1e-9
/* of the sizes that forces of held laws tell: motions, and how contacts share a force */
#define STILL 1e-12
#define SHARE 1e-6
#define ROUNDING (64 * 2.220446049250313e-16)
/* a variable's largest value is forgotten by and by, so that a wild start does not blunt the test */
#define FORGET 0.999
/* how often a step is halved, and the parts of it that are counted */
#define DEPTH 20
#define SHORT 6
#define TOP ((casadi_int)1 << DEPTH)

typedef struct {
  double t, h;
  const double* p;
  double *m, *scale, *size, *a, *weight, *r, *step, *v, *best, *f, *j, *us, *values, *b, *w;
  casadi_int *order, *iw, nd, ndp;
  const casadi_int* dirs;
  const double** arg;
  double** res;
#if NBANKS
  bank_t banks[2][NBANKS];
  double *next, *line;
#endif
} work_t;

static const double nodes[2] = {1.0 / 3.0, 1.0};
/* inverse of the matrix of Butcher */
static const double inverse[2][2] = {{1.5, 0.5}, {-4.5, 2.5}};

static void bind(work_t* q, const double* t, const double* v, const double* u,
                 const double* h) {
  q->arg[0] = t; q->arg[1] = v; q->arg[2] = u; q->arg[3] = q->p; q->arg[4] = q->m; q->arg[5] = h;
}

#if NBANKS
/* Put the lines of one stage, or of the end of the step (1), into the memory. */
static void lines(work_t* q, int s, double t, const double* v, const double* u, double h) {
  int k, off, tries = 0;
  bank_t* b = q->banks[s];
  do {
    for (k = 0; k < NBANKS; ++k) put(b + k, q->m + bank_slot[k]);
    bind(q, &t, v, u, &h);
    q->res[0] = q->next;
    bondsight_advance(q->arg, q->res, q->iw, q->w, 0);
    for (off = k = 0; k < NBANKS; ++k) off |= looked_up(b + k, q->next[bank_slot[k] + 2], tries);
  } while (off && ++tries <= NBANKS); /* one may stand behind another */
  for (k = 0; k < NBANKS; ++k) put(b + k, q->m + bank_slot[k]);
}

/* Their tangents among those of the memory; a row of a bank begins with a place for its value. */
static void moved_lines(work_t* q, int s, double* tm) {
  int i, k;
  for (k = 0; k < NBANKS && q->nd; ++k) {
    const bank_t* b = q->banks[s] + k;
    moved_line(b, (row_block*)q->line);
    for (i = 0; i < 3; ++i)
      memcpy(tm + (bank_slot[k] + i) * q->nd, q->line + i * LANES * b->wide + 1,
             q->nd * sizeof(double));
  }
}

/* Plays at the end of the step, and their tangents from those of the places. */
static void accepted_banks(work_t* q, const double* tnext) {
  int k;
  for (k = 0; k < NBANKS; ++k) {
    bank_t* b = q->banks[1] + k;
    if (q->nd) {
      memcpy(q->line + 1, tnext + (bank_slot[k] + 2) * q->nd, q->nd * sizeof(double));
      moved_rows(b, (const row_block*)q->line);
    }
    accepted(b);
    q->banks[0][k].y = b->y;
    q->banks[0][k].next = b->next;
  }
}
#else
#define lines(q, s, t, v, u, h)
#define moved_lines(q, s, tm)
#define accepted_banks(q, tnext)
#endif

/* The product of `times` for the parameters, whose tangents are unit vectors. */
static void pick(const double* nz, const casadi_int* colind, const casadi_int* row,
                 const work_t* q, double* out, casadi_int flip) {
  casadi_int d, k;
  for (d = 0; d < q->ndp; ++d)
    for (k = colind[q->dirs[d]]; k < colind[q->dirs[d] + 1]; ++k)
      out[row[k] * q->nd + d] += row[k] >= flip ? -nz[k] : nz[k];
}

/* Residual r (K) of the stages v and its matrix a (K, K); 1 if it is at the level of rounding. */
static int stages(work_t* q, const double* x, const double* v, double* merit) {
  int s, i, j, quiet = 1;
  *merit = 0.0;
  for (s = 0; s < 2; ++s) {
    double late = nodes[s] * q->h, t = q->t + late;
    lines(q, s, t, v + s * N, q->us + s * NU, late);
    bind(q, &t, v + s * N, q->us + s * NU, &late);
    q->res[0] = q->f; q->res[1] = q->j;
    bondsight_stage(q->arg, q->res, q->iw, q->w, 0);
    for (i = 0; i < N; ++i) {
      double *row = q->a + (s * N + i) * K, sum, size = fabs(q->f[i]);
      for (j = 0; j < K; ++j) row[j] = 0.0;
      for (j = 0; j < N; ++j) {
        double c = q->j[j * N + i];
        row[s * N + j] = i < NX ? -c : c;
        size += fabs(c * v[s * N + j]);
      }
      if (i < NX) {
        double a0 = inverse[s][0] / q->h, a1 = inverse[s][1] / q->h;
        row[i] += a0;
        row[N + i] += a1;
        sum = a0 * (v[i] - x[i]) + a1 * (v[N + i] - x[i]) - q->f[i];
        size += (fabs(v[i]) + fabs(x[i])) / q->h;
      } else {
        sum = q->f[i];
        if (i >= N - HELD) row[s * N + i] += SHARED;
      }
      q->r[s * N + i] = sum;
      if (!(fabs(sum) <= ROUNDING * size)) quiet = 0;
      if (size > 0.0) *merit += (sum / size) * (sum / size);
    }
  }
  return quiet;
}

#if HELD
/* Sizes of the variables, in q->size, by what the forces v of held laws would make of them within
   the step: what sticks never moves, so that nothing else tells what is rounding. Each is reached
   once, on the shortest way, for a size that went round a stiff loop would grow. */
static void sizes(work_t* q, const double* v) {
  int i, k, found = 1;
  double *size = q->size, *next = q->size + N;
  for (i = 0; i < N; ++i) size[i] = next[i] = i < N - HELD ? 0.0 : LARGER(q->scale[i], fabs(v[i]));
  while (found) {
    for (found = i = 0; i < N - HELD; ++i) {
      double own = i < NX ? 1.0 / q->h : fabs(q->j[i * N + i]), sum = 0.0;
      if (size[i] > 0.0 || !(own > 0.0)) continue;
      for (k = 0; k < N; ++k) if (k != i) sum += fabs(q->j[k * N + i]) * size[k];
      next[i] = sum / own;
      if (sum > 0.0) found = 1;
    }
    for (i = 0; i < N; ++i) size[i] = next[i];
  }
  for (i = N - HELD; i < N; ++i) /* and what others make of the motion that a law is to hold */
    for (k = 0; k < N - HELD; ++k) size[i] += fabs(q->j[k * N + i]) * next[k];
}

/* Whether a step of Newton's method is none. Contacts may share a force in many ways, which needs
   to settle no further than they are told; that their laws hold is read off the residual. */
static int small(const work_t* q, int i, double step) {
  const double least = q->size[i % N];
  if (i % N >= N - HELD) return fabs(step) <= SHARE * least && fabs(q->r[i]) <= STILL * least;
  return fabs(step) <= LARGER(STILL * least, TOLERANCE * LARGER(q->scale[i % N], fabs(q->v[i])));
}

/* A motion that is held, and what follows it, stand still to the last digit, whatever moves. */
static void rested(const work_t* q, const double* x, double* end, const double* tx, double* tend) {
  int i;
  casadi_int d;
  for (i = 0; i < NX; ++i) {
    const double least = STILL * q->size[i];
    const int none = fabs(end[i]) <= least;
    if (!none && !(fabs(end[i] - x[i]) <= least)) continue;
    end[i] = none ? 0.0 : x[i];
    for (d = i * q->nd; d < (i + 1) * q->nd; ++d) tend[d] = none ? 0.0 : tx[d];
  }
}
#else
#define sizes(q, v)
#define small(q, i, step) \
  (fabs(step) <= TOLERANCE * LARGER((q)->scale[(i) % N], fabs((q)->v[i])))
#define rested(q, x, end, tx, tend)
#endif

/* Newton's method from the stages in q->v; damped halves a step that does not reduce r. */
static int newton(work_t* q, const double* x, int damped) {
  int tries, i;
  double merit, *step = q->step;
  int quiet = stages(q, x, q->v, &merit);
  for (tries = 0; tries < (damped ? 4 : 1) * TRIES; ++tries) {
    int done = 1;
    if (!factor(q->a, q->order, q->weight, q->weight + K, K)) return 0;
    backsolve(q->a, q->order, q->r, step, K, 1);
    sizes(q, q->v + N);
    for (i = 0; i < K; ++i) {
      q->best[i] = q->v[i];
      q->v[i] -= step[i];
      if (!small(q, i, step[i])) done = 0;
      if (!(fabs(q->v[i]) < 1e300)) return 0;
    }
    if (done || quiet) return 1;
    double before = merit, share = 1.0;
    quiet = stages(q, x, q->v, &merit);
    while (damped && !quiet && !(merit < before) && share > 1e-3) {
      share *= 0.5;
      for (i = 0; i < K; ++i) q->v[i] = q->best[i] - share * step[i];
      quiet = stages(q, x, q->v, &merit);
    }
  }
  return 0;
}

/* Right side of one direction after the other: b (K, nd) by rows, stage after stage. */
static void seeds(work_t* q, const double* tx, double* tm) {
  int s, i;
  casadi_int d;
  for (s = 0; s < 2; ++s) {
    double late = nodes[s] * q->h, t = q->t + late, *b = q->b + s * N * q->nd;
    double sum = (inverse[s][0] + inverse[s][1]) / q->h;
    for (i = 0; i < NX; ++i)
      for (d = 0; d < q->nd; ++d) b[i * q->nd + d] = sum * tx[i * q->nd + d];
    for (i = NX; i < N; ++i)
      for (d = 0; d < q->nd; ++d) b[i * q->nd + d] = 0.0;
    lines(q, s, t, q->v + s * N, q->us + s * NU, late);
    moved_lines(q, s, tm);
    bind(q, &t, q->v + s * N, q->us + s * NU, &late);
    q->res[0] = q->values; q->res[1] = q->values + SEED_P_NZ;
    bondsight_seed(q->arg, q->res, q->iw, q->w, 0);
    pick(q->values, seed_p_colind, seed_p_row, q, b, NX);
    times(q->values + SEED_P_NZ, seed_m_colind, seed_m_row, NM, tm, b, q->nd, NX);
  }
}

/* Jacobian of a function of (v, p, m) times the tangents: out (rows, nd). */
#define TANGENT(name, NAME, rows, tv, tm, out) do { \
    casadi_int d_; \
    for (d_ = 0; d_ < (rows) * q->nd; ++d_) (out)[d_] = 0.0; \
    q->res[0] = q->values; q->res[1] = q->values + NAME##_V_NZ; \
    q->res[2] = q->values + NAME##_V_NZ + NAME##_P_NZ; \
    bondsight_##name(q->arg, q->res, q->iw, q->w, 0); \
    times(q->values, name##_v_colind, name##_v_row, N, tv, out, q->nd, rows); \
    pick(q->values + NAME##_V_NZ, name##_p_colind, name##_p_row, q, out, rows); \
    times(q->values + NAME##_V_NZ + NAME##_P_NZ, name##_m_colind, name##_m_row, NM, tm, out, \
          q->nd, rows); \
  } while (0)

/* Outputs (NY) and their tangents (NY, nd) at v, tangent tv (N, nd), on the lines there. */
static void reading(work_t* q, double t, const double* v, const double* u, double late,
                    const double* tv, const double* tm, double* out) {
  bind(q, &t, v, u, &late);
  q->res[0] = out;
  bondsight_reading(q->arg, q->res, q->iw, q->w, 0);
  if (q->nd) TANGENT(slope, SLOPE, NY, tv, tm, out + NY);
}

/* Algebraic unknowns that belong to the state in q->v; their tangents follow those of x in tv. */
static int start(work_t* q, const double* u, double* tv, double* tm) {
  int tries, i, j, done = NZ == 0;
  double late = 0.0, *right = q->r, *step = q->step;
  casadi_int d;
  for (tries = 0; tries < 4 * TRIES && !done; ++tries) {
    lines(q, 1, q->t, q->v, u, late);
    bind(q, &q->t, q->v, u, &late);
    q->res[0] = q->f; q->res[1] = q->j;
    bondsight_stage(q->arg, q->res, q->iw, q->w, 0);
    int quiet = 1;
    done = 1;
    for (i = 0; i < NZ; ++i) {
      double size = 0.0;
      right[i] = q->f[NX + i];
      for (j = 0; j < N; ++j) size += fabs(q->j[j * N + NX + i] * q->v[j]);
      for (j = 0; j < NZ; ++j) q->a[i * NZ + j] = q->j[(NX + j) * N + NX + i];
      if (!(fabs(right[i]) <= ROUNDING * size)) quiet = 0;
    }
    if (!factor(q->a, q->order, q->weight, q->weight + K, NZ)) return 0;
    backsolve(q->a, q->order, right, step, NZ, 1);
    for (i = 0; i < NZ; ++i) {
      q->v[NX + i] -= step[i];
      if (!(fabs(step[i]) <= TOLERANCE * fabs(q->v[NX + i]))) done = 0;
      if (!(fabs(q->v[NX + i]) < 1e300)) return 0;
    }
    done = done || quiet;
  }
  if (!done || !q->nd || !NZ) return done;
  lines(q, 1, q->t, q->v, u, late);
  moved_lines(q, 1, tm);
  bind(q, &q->t, q->v, u, &late);
  q->res[0] = q->values; q->res[1] = q->values + SEED_P_NZ;
  for (d = 0; d < N * q->nd; ++d) q->b[d] = 0.0;
  bondsight_seed(q->arg, q->res, q->iw, q->w, 0);
  pick(q->values, seed_p_colind, seed_p_row, q, q->b, NX);
  times(q->values + SEED_P_NZ, seed_m_colind, seed_m_row, NM, tm, q->b, q->nd, NX);
  for (i = NX; i < N; ++i)
    for (j = 0; j < NX; ++j)
      for (d = 0; d < q->nd; ++d) q->b[i * q->nd + d] -= q->j[j * N + i] * tv[j * q->nd + d];
  backsolve(q->a, q->order, q->b + NX * q->nd, tv + NX * q->nd, NZ, q->nd);
  return 1;
}

/* Let the memory follow what stands at v, tangent tv, on the lines there; room in next, tnext. */
static void accept(work_t* q, double t, const double* v, const double* u, double late,
                   const double* tv, double* tm, double* next, double* tnext) {
  casadi_int i;
  bind(q, &t, v, u, &late);
  q->res[0] = next;
  bondsight_advance(q->arg, q->res, q->iw, q->w, 0);
  if (q->nd) {
    TANGENT(moving, MOVING, NM, tv, tm, tnext);
    for (i = 0; i < NM * q->nd; ++i) tm[i] = tnext[i];
  }
  for (i = 0; i < NM; ++i) q->m[i] = next[i];
  accepted_banks(q, tnext);
}

/* Inputs that jump to u, as at the start, take the memory with them, in no time; without a solution
   there the next step has to find its own way. */
static void jump(work_t* q, double* x, const double* u, double* tv, double* tm, double* next,
                 double* tnext) {
  int i;
  for (i = 0; i < N; ++i) q->v[i] = x[i];
  if (!start(q, u, tv, tm)) return;
  for (i = NX; i < N; ++i) x[i] = q->v[i];
  lines(q, 1, q->t, x, u, 0.0);
  moved_lines(q, 1, tm);
  accept(q, q->t, x, u, 0.0, tv, tm, next, tnext);
}

/* The stages at the end of the step that begins at x; past holds the ends and the middle of the
   last step, through which a polynomial foretells them. Failing that they start from rest. */
static int step(work_t* q, const double* x, const double* past) {
  int i, again;
  const double *before = past, *middle = past + N;
  for (i = 0; i < N; ++i) {
    q->v[i] = before[i] - 2.0 * middle[i] + 2.0 * x[i];
    q->v[N + i] = 5.0 * before[i] - 9.0 * middle[i] + 5.0 * x[i];
  }
  if (newton(q, x, 0)) return 1;
  for (again = 0; again < 2; ++again) {
    for (i = 0; i < K; ++i) q->v[i] = x[i % N];
    if (newton(q, x, again)) return 1;
  }
  return 0;
}

/* Take a step from x under inputs u at both ends; outputs go to `out`, if there is any. */
static int taken(work_t* q, double* x, const double* u, double* past, double* tv, double* tm,
                 double* tk, double* next, double* tnext, double* out) {
  casadi_int i;
  const double* end = q->v + N;
  for (i = 0; i < NU; ++i) {
    q->us[i] = u[i] + nodes[0] * (u[NU + i] - u[i]);
    q->us[NU + i] = u[NU + i];
  }
  if (!step(q, x, past)) return 0;
  if (q->nd) {
    seeds(q, tv, tm);
    backsolve(q->a, q->order, q->b, tk, K, q->nd);
  }
  rested(q, x, q->v + N, tv, tk + N * q->nd);
  for (i = 0; i < N; ++i) {
    past[i] = x[i];
    past[N + i] = q->v[i];
    x[i] = end[i];
    q->scale[i] = LARGER(FORGET * q->scale[i], fabs(x[i]));
  }
  for (i = 0; i < N * q->nd; ++i) tv[i] = tk[N * q->nd + i];
  double late = q->h, t = q->t + q->h;
  lines(q, 1, t, x, u + NU, late);
  moved_lines(q, 1, tm);
  if (out) reading(q, t, x, u + NU, late, tv, tm, out);
  if (NM) accept(q, t, x, u + NU, late, tv, tm, next, tnext);
  return 1;
}

/* What a step begins with: state, foretold course, sizes and memory; kept, and put back. */
static void keep(const work_t* q, const double* x, const double* past, double* kept) {
  memcpy(kept, x, N * sizeof(double));
  memcpy(kept + N, past, 2 * N * sizeof(double));
  memcpy(kept + 3 * N, q->scale, N * sizeof(double));
  memcpy(kept + 4 * N, q->m, NM * sizeof(double));
}

static void put_back(work_t* q, double* x, double* past, const double* kept) {
  memcpy(x, kept, N * sizeof(double));
  memcpy(past, kept + N, 2 * N * sizeof(double));
  memcpy(q->scale, kept + 3 * N, N * sizeof(double));
  memcpy(q->m, kept + 4 * N, NM * sizeof(double));
}

/* The part of a sub-step of length h, begun at a time, from and to shares of it; without tangents. */
static int part(work_t* q, double* x, const double* u, double* past, double* next, double* out,
                double begun, double h, casadi_int from, casadi_int to) {
  const double a = (double)from / TOP, b = (double)to / TOP;
  double now[2 * NU + 1];
  casadi_int i;
  for (i = 0; i < NU; ++i) {
    now[i] = u[i] + a * (u[NU + i] - u[i]);
    now[NU + i] = u[i] + b * (u[NU + i] - u[i]);
  }
  q->t = begun + a * h;
  q->h = (b - a) * h;
  return taken(q, x, now, past, NULL, NULL, NULL, next, NULL, to < TOP ? NULL : out);
}

/* What a law that has switched early in the last step adds to states, over what is allowed: no stage
   of a step lies before its first third. There the rates of the step, foretold from its stages, are
   not those with which the step before it ended, `rates`; these become those of its end. */
static double early(const work_t* q, const double* past, double* rates, const double* allowed) {
  double found = 0.0;
  casadi_int i;
  for (i = 0; i < NX; ++i) {
    const double d1 = (q->v[i] - past[i]) / q->h, d2 = (q->v[N + i] - past[i]) / q->h;
    const double first = inverse[0][0] * d1 + inverse[0][1] * d2;
    const double last = inverse[1][0] * d1 + inverse[1][1] * d2;
    const double off = nodes[0] * q->h * fabs(rates[i] - (1.5 * first - 0.5 * last));
    if (allowed[i] > 0.0 && !(off <= found * allowed[i])) found = off / allowed[i];
    rates[i] = last;
  }
  return found;
}

/* A sub-step in halves where a step and its two halves differ by more than `allowed` of the states
   and memories (0: anything), or where a step has no solution. `left` counts the steps that may be
   taken. Where inputs jump its beginning is taken in short steps, for no `rates` tell of it. */
static int halved(work_t* q, double* x, const double* u, double* past, double* next, double* out,
                  const double* allowed, casadi_int* left, double* rates, int jumped) {
  const double begun = q->t, h = q->h;
  double kept[4 * N + NM + 1], whole[N + NM + 1], course[NX + 1];
  casadi_int at = 0, level = jumped ? SHORT : 0, i;
  int good = 1;
  while (at < TOP && good) {
    const casadi_int size = TOP >> level;
    double off = 0.0, first, second;
    keep(q, x, past, kept);
    memcpy(course, rates, NX * sizeof(double));
    good = part(q, x, u, past, next, out, begun, h, at, at + size);
    memcpy(whole, x, N * sizeof(double));
    memcpy(whole + N, q->m, NM * sizeof(double));
    put_back(q, x, past, kept);
    good = good && part(q, x, u, past, next, out, begun, h, at, at + size / 2);
    first = early(q, past, rates, allowed);
    good = good && part(q, x, u, past, next, out, begun, h, at + size / 2, at + size);
    second = early(q, past, rates, allowed);
    off = jumped && at == 0 ? second : LARGER(first, second);
    *left -= 3;
    for (i = 0; i < N + NM; ++i) {
      const double apart = fabs((i < N ? x[i] : q->m[i - N]) - whole[i]);
      if (allowed[i] > 0.0 && !(apart <= off * allowed[i])) off = apart / allowed[i];
    }
    if (!(good && off <= 1.0) && level + 2 < DEPTH && *left > 0) {
      put_back(q, x, past, kept);
      memcpy(rates, course, NX * sizeof(double));
      ++level;
      good = 1;
      continue;
    }
    at += size;
    if (level > 0 && (off < 0.1 || *left <= 0) && at % (2 * size) == 0) --level;
  }
  q->t = begun;
  q->h = h;
  return good;
}

/* Run over a record. Returns how many samples are done, the first included; 0: no start.
   state: v (N), m (NM), tv (N, nd), tm (NM, nd), in and out; out: samples x (NY, then NY x nd);
   numbers: time, sub-step, whether the unknowns in v are solved already; sizes: samples less one,
   sub-steps, nd, of these parameters. With `allowed` sub-steps are `halved`; `ends` are the least
   and the largest of all numbers. */
casadi_int bondsight_record(const double* numbers, const casadi_int* sizes, const double* u_first,
                            const double* u, const double* p, const casadi_int* dirs, double* state,
                            double* out, double* work, casadi_int* order, casadi_int* iw, double* w,
                            const double** arg, double** res, const casadi_int* plays,
                            double* plays_numbers, double* plays_rows, const double* allowed,
                            casadi_int* left, double* ends) {
  const casadi_int n_samples = sizes[0], n_sub = sizes[1], nd = sizes[2];
  work_t data, *q = &data;
  double *x = state, *m = x + N, *tv = m + NM, *tm = tv + N * nd;
  double *past, *tk, *next, *tnext, rates[NX + 1] = {0.0};
  casadi_int i, k, sub, at = 0;
  q->t = numbers[0]; q->h = numbers[1];
  q->p = p; q->m = m; q->nd = nd; q->ndp = sizes[3]; q->dirs = dirs; q->order = order;
  q->iw = iw; q->w = w; q->arg = arg; q->res = res;
  q->scale = work; work += N;
  q->size = work; work += K;
  q->a = work; work += K * K;
  q->weight = work; work += 2 * K;
  q->r = work; work += K;
  q->step = work; work += K;
  q->v = work; work += K;
  q->best = work; work += K;
  q->f = work; work += N;
  q->j = work; work += N * N;
  q->us = work; work += 2 * NU;
  q->values = work; work += VALUES;
  q->b = work; work += K * nd;
  tk = work; work += K * nd;
  next = work; work += NM;
  tnext = work; work += NM * nd;
  past = work;
#if NBANKS
  q->next = next;
  q->line = past + 2 * N;
  for (i = 0; i < NBANKS; ++i) {
    bank_t* b = q->banks[1] + i;
    opened(b, bank_stops[i], plays + 2 * i, nd / LANES + 1, &plays_numbers, &plays_rows);
    q->banks[0][i] = *b;
  }
#endif
  for (i = 0; i < N; ++i) q->v[i] = x[i];
  if (numbers[2] == 0.0 && !start(q, u_first, tv, tm)) return 0;
  for (i = 0; i < N; ++i) {
    x[i] = past[i] = past[N + i] = q->v[i];
    q->scale[i] = fabs(x[i]);
  }
  lines(q, 1, q->t, x, u_first, 0.0);
  moved_lines(q, 1, tm);
  reading(q, q->t, x, u_first, 0.0, tv, tm, out);
  for (k = 0; k < n_samples; ++k) {
    out += NY * (1 + nd);
    if (JUMPS && (!k || memcmp(u, u - NU, NU * sizeof(double)))) {
      q->t = numbers[0] + (double)at * q->h;
      jump(q, x, u, tv, tm, next, tnext);
    }
    for (sub = 0; sub < n_sub; ++sub, ++at, u += 2 * NU) {
      double* read = sub == n_sub - 1 ? out : NULL;
      q->t = numbers[0] + (double)at * q->h;
      const int jumped = !at || (!sub && memcmp(u, u - NU, NU * sizeof(double)));
      if (!(allowed ? halved(q, x, u, past, next, read, allowed, left, rates, jumped)
                    : taken(q, x, u, past, tv, tm, tk, next, tnext, read)))
        return k + 1;
      for (i = 0; ends && i < N + NM; ++i) {
        const double now = i < N ? x[i] : q->m[i - N];
        ends[i] = now < ends[i] ? now : ends[i];
        ends[N + NM + i] = now > ends[N + NM + i] ? now : ends[N + NM + i];
      }
    }
  }
#if NBANKS
  for (i = 0; i < NBANKS; ++i) closed(q->banks[1] + i);
#endif
  return n_samples + 1;
}
