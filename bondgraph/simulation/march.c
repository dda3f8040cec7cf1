/* A record in one call: the value and all its derivatives side by side in registers. Laws are other
   libraries, called by pointers, so that this code is compiled once. Before it come the rows, of
   LANES numbers a block, and the banks of plays (banks.c). */

typedef int (*code)(const double**, double**, casadi_int*, double*, int);

/* One law, or all at once, in steps; `most` is 0 where the first one answers. */
typedef struct {
  code begin, step, end;
  casadi_int arguments, most;
} part_t;

/* Laws of a model: how many deviations, memories, parameters and slopes of the memory there are, where
   those belong, and the code: of parts that are swept over, or of one formula; with parts `after` is
   what follows from the deviations, else the formula gives both. */
typedef struct {
  casadi_int n_w, n_m, n_q, n_slopes, n_parts, sweeps, numbers, n_arg, n_res, n_banks;
  const casadi_int *memory_row, *memory_column, *memories, *parameters, *bank_slot, *bank_stops;
  const part_t* parts;
  code after;
} laws_t;

/* whether numbers stand still but for the last digits: after Newton's step, to the last one */
static int still(const double* now, const double* before, casadi_int n) {
  for (casadi_int i = 0; i < n; ++i)
    if (!(fabs(now[i] - before[i]) <= 1e-12 * fabs(now[i]))) return 0;
  return 1;
}

/* Out of line, as is the code of laws: (s_free, gain, memory, q, w, h) -> (w, memory, ...). */
static void __attribute__((noinline)) solved(const laws_t* laws, const double** arg, double** res,
                                             casadi_int* iw, double* work) {
  if (!laws->n_parts) {
    laws->after(arg, res, iw, work, 0);
    return;
  }
  const size_t wide = laws->n_w * sizeof(double);
  const double* given[laws->n_arg + 7];
  double *made[laws->n_res + 1], now[laws->n_w], before[laws->n_w], next[laws->n_w];
  double v[2][laws->numbers + 1];
  memcpy(now, arg[4], wide);
  memcpy(given + 1, arg, 6 * sizeof *given);
  given[5] = now;
  for (casadi_int sweep = 0; sweep < laws->sweeps; ++sweep) {
    memcpy(before, now, wide);
    for (const part_t* p = laws->parts; p < laws->parts + laws->n_parts; ++p) {
      int k = 0;
      made[0] = p->most ? v[0] : next;
      p->begin(given + 1, made, iw, work, 0);
      for (casadi_int i = 0; i < p->most; ++i) {
        given[0] = v[k];
        made[0] = v[1 - k];
        p->step(given, made, iw, work, 0);
        k = 1 - k;
        if (still(v[k], v[1 - k], p->arguments)) break;
      }
      if (p->most) {
        given[0] = v[k];
        made[0] = next;
        p->end(given, made, iw, work, 0);
      }
      memcpy(now, next, wide);
    }
    if (still(now, before, laws->n_w)) break;
  }
  memcpy(res[0], now, wide);
  laws->after(given + 1, res + 1, iw, work, 0);
}

#define PASSES 16
#define VALUE(rows, i) (((const double*)(rows))[(i) * NB * LANES])
/* derivatives of the matrices: one row each, `lead` blocks that are not zero; the first lane of an
   input's entry is the entry itself, so that inputs enter values and derivatives alike */
#define D(entry) d[(entry) * lead + b]

/* whether inputs that act on the laws' arguments have jumped */
static int jumped(const double* u0, const double* before, const double* acting, casadi_int NU,
                  casadi_int NW) {
  for (casadi_int k = 0; k < NU; ++k)
    if (u0[k] != before[k])
      for (casadi_int j = 0; j < NW; ++j)
        if (acting[j + NW * k] != 0.0) return 1;
  return 0;
}

#if LOCATED
/* Steps of one sub-step, halved where a step and its two halves differ: a law that switches is
   followed to where it does. Steps are counted in parts of a sub-step, TOP of them; `moving` holds
   matrices of steps of a half, a quarter and so on, `stride` numbers each. */
#define DEPTH 20
#define TOP ((casadi_int)1 << DEPTH)
typedef struct {
  casadi_int at, level, phase;
} place_t;

static casadi_int deep(const place_t* p) { return p->level + (p->phase > 0); }

/* inputs where a step begins and ends, on the line between those of the sub-step */
static void between(const place_t* p, const double* u, casadi_int NU, double* now) {
  const casadi_int size = TOP >> deep(p), at = p->at + (p->phase == 2) * size;
  for (casadi_int end = 0; end < 2; ++end) {
    const double share = (double)(at + end * size) / TOP;
    for (casadi_int k = 0; k < NU; ++k) now[k + end * NU] = u[k] + (u[NU + k] - u[k]) * share;
  }
}

/* the largest difference of numbers, over what is allowed of each; 0 allows all */
static double apart(const row_block* z, const row_block* whole, casadi_int n, casadi_int NB,
                    const double* allowed) {
  double found = 0.0;
  for (casadi_int i = 0; i < n; ++i) {
    const double off = fabs(VALUE(z, i) - VALUE(whole, i));
    if (allowed[i] > 0.0 && !(off <= found * allowed[i])) found = off / allowed[i];
  }
  return found;
}

/* What laws that jump make of states when they jump within a step, over what is allowed: a step and
   its halves agree on a law's end value, whenever it jumped. What sticks all along does not jump:
   arguments below `quiet`, which is negative of other laws. `late` is what a deviation adds. */
static double jumping(const row_block* z, const row_block* kept, const double* late, casadi_int NX,
                      casadi_int NW, casadi_int NB, const row_block* s, const double* began,
                      const double* quiet, const double* allowed) {
  double found = 0.0;
  for (casadi_int k = 0; k < NW; ++k) {
    if (quiet[k] < 0.0 || (fabs(VALUE(s, k)) <= quiet[k] && fabs(began[k]) <= quiet[k])) continue;
    const double by = fabs(VALUE(z, NX + k) - VALUE(kept, NX + k));
    for (casadi_int i = 0; i < NX; ++i) {
      const double off = fabs(late[i + NX * k]) * by;
      if (allowed[i] > 0.0 && off > found * allowed[i]) found = off / allowed[i];
    }
  }
  return found;
}

/* Go on after a step; returns whether a sub-step is done. `kept` are the numbers where the step began
   and what it made of them in one piece; `jumped` is what `jumping` gives. */
static int gone_on(place_t* p, row_block* z, row_block* kept, casadi_int n, casadi_int NB,
                   const double* allowed, double jumped, casadi_int* left) {
  const size_t all = n * NB * sizeof(row_block);
  row_block* whole = kept + n * NB;
  --*left;
  if (p->phase == 0) {
    memcpy(whole, z, all);
    memcpy(z, kept, all);
  }
  if (p->phase < 2) {
    ++p->phase;
    return 0;
  }
  const double off = fmax(apart(z, whole, n, NB, allowed), jumped);
  p->phase = 0;
  if (!(off <= 1.0) && p->level + 2 < DEPTH && *left > 0) {
    memcpy(z, kept, all);
    ++p->level;
    return 0;
  }
  p->at += TOP >> p->level;
  const casadi_int wider = p->level > 0 ? TOP >> (p->level - 1) : 0;
  /* without steps left nothing comes of the run: it ends in steps as wide as may be */
  if (wider && (off < 0.1 || *left <= 0) && p->at % wider == 0) --p->level;
  if (p->at < TOP) return 0;
  p->at = 0;
  return 1;
}
#endif

/* whether any input is another one */
static int differ(const double* one, const double* other, casadi_int n) {
  casadi_int k;
  for (k = 0; k < n; ++k)
    if (one[k] != other[k]) return 1;
  return 0;
}

/* what readings are made of: matrices behind CY of a step, their slopes, which of these are live */
typedef struct {
  const double *m, *u, *x, *w;
  const row_block *d, *z, *w1;
  const casadi_int* live;
  casadi_int NX, NU, NW, NB, n_y, lead, width;
} readings_t;

/* readings of a sample under inputs u, with their slopes */
static void readings(readings_t r, double* y) {
  const casadi_int NX = r.NX, NU = r.NU, NB = r.NB, n_y = r.n_y, DY = n_y * NX;
  const row_block* d = r.d;
  const casadi_int lead = r.lead;
  row_block out[NB];
  casadi_int b, i, j, k;
  for (i = 0; i < n_y; ++i) {
    for (b = 0; b < NB; ++b) {
      row_block a = {0};
      for (j = 0; j < NX; ++j) a += r.m[i + n_y * j] * r.z[j * NB + b];
      for (k = 0; k < r.NW; ++k) a += r.m[DY + i + n_y * (NU + k)] * r.w1[k * NB + b];
      if (b < lead) {
        for (k = 0; k < NU; ++k) a += D(DY + i + n_y * k) * r.u[k];
        if (r.live[6]) for (j = 0; j < NX; ++j) a += D(i + n_y * j) * r.x[j];
        if (r.live[7]) for (k = 0; k < r.NW; ++k) a += D(DY + i + n_y * (NU + k)) * r.w[k];
      }
      out[b] = a;
    }
    memcpy(y, out, r.width * sizeof(double));
    y += r.width;
  }
}

/* NX states, NU inputs, rows of NB blocks; `standing` are the matrices of a step of no length; with
   `begin` the first sample is such a step under the inputs `before`; with inputs `last`, those
   after all samples, readings are taken after what jumps at their samples */
void run_record(const laws_t* laws, const double* u, const double* before, const double* last,
                casadi_int NX,
                casadi_int NU, casadi_int NB, casadi_int begin, casadi_int n_samples,
                casadi_int n_sub, casadi_int n_y, casadi_int width, casadi_int lead,
                const casadi_int* live, double* carried, const double* moving,
                const double* standing, const double* q, const double* slopes_of_moving,
                const double* slopes_of_standing, const double* by_parameters, double* y,
                double* seen, casadi_int* iw, double* work, const double** arg, double** res,
                const casadi_int* plays, double* numbers, double* rows
#if LOCATED
                , casadi_int stride, const double* quiet, const double* allowed, casadi_int* left,
                double* ends
#endif
) {
  const casadi_int NW = laws->n_w, NM = laws->n_m, NBANKS = laws->n_banks, NV = NU + NW;
  const casadi_int PHI = 0, G0 = NX * NX, G1 = G0 + NX * NV, CS = G1 + NX * NV;
  const casadi_int DS = CS + NW * NX, GAIN = DS + NW * NU, CY = GAIN + NW * NW;
  const casadi_int DY = CY + n_y * NX, STEP = DY + n_y * NV;
  row_block* z = (row_block*)carried;
  const double* m = moving;
  const row_block* d = (const row_block*)slopes_of_moving;
  row_block x1[(NX + 1) * NB], s[(NW + 1) * NB], w1[(NW + 1) * NB], m1[(NM + 1) * NB];
  double x[NX + 1], free_[NW + 1], w[NW + 1], w_new[NW + 1], memory[NM + 1], memory_new[NM + 1];
  bank_t banks[NBANKS + 1];
#if SLOPES
  const row_block* dq = (const row_block*)by_parameters;
  double resolvent[NW * NW + 1], by_free[NW + 1], by_gain[NW + 1], by_memory[NM + 1];
  double by_q[laws->n_q + 1], slopes[laws->n_slopes + 1];
  row_block alone[NW + 1];
#endif
  casadi_int sample, sub, b, i, j, k;
#define READ(inputs, to) do { \
    for (i = 0; i < NX; ++i) x[i] = VALUE(z, i); \
    readings((readings_t){m + CY, inputs, x, w_new, d + CY * lead, z, w1, live, NX, NU, NW, NB, \
                          n_y, lead, width}, to); \
  } while (0)
#if LOCATED
  const casadi_int NZ = NX + NW + NM;
  row_block kept[2 * NZ * NB];
  double now[2 * NU + 1], began[NW + 1];
  place_t place = {0, 0, 0};
#endif
  for (i = 0; i < NBANKS; ++i)
    opened(banks + i, laws->bank_stops[i], plays + 2 * i, NB, &numbers, &rows);
  for (sample = 0; sample < n_samples + (last != NULL); ++sample) {
    /* a jump is a step of its own, of no length: laws begin the next one with what it makes */
    const int first = begin && !sample, over = sample == n_samples;
    if (over) u = last;
    int late = last && sample && differ(u, before, NU);
    const double* begun = u;
    const int jump = first || (NW && jumped(u, before, moving + DS, NU, NW));
    for (sub = -jump; sub < (first || over ? 0 : n_sub); ++sub) {
      if (late && !sub) {
        READ(begun, y - n_y * width);
        late = 0;
      }
      const double *u0 = first ? before : u, *u1 = sub < 0 ? u0 : u + NU;
      m = sub < 0 ? standing : moving;
      d = (const row_block*)(sub < 0 ? slopes_of_standing : slopes_of_moving);
#if LOCATED
      if (sub >= 0) {
        if (place.phase == 0) {
          memcpy(kept, z, NZ * NB * sizeof(row_block));
          for (j = 0; j < NW; ++j) began[j] = VALUE(s, j);
        }
        m += deep(&place) * stride;
        d += deep(&place) * stride * lead;
        between(&place, u, NU, now);
        u0 = now;
        u1 = now + NU;
      }
#endif
      for (j = 0; j < NX; ++j) x[j] = VALUE(z, j);
      for (k = 0; k < NW; ++k) w[k] = VALUE(z, NX + k);
      for (k = 0; k < NM; ++k) memory[k] = VALUE(z, NX + NW + k);
      for (b = 0; b < NB; ++b)
        for (i = 0; i < NX; ++i) {
          row_block a = {0};
          for (j = 0; j < NX; ++j) a += m[PHI + i + NX * j] * z[j * NB + b];
          for (k = 0; k < NW; ++k) a += m[G0 + i + NX * (NU + k)] * z[(NX + k) * NB + b];
          if (b < lead) {
            for (k = 0; k < NU; ++k) a += D(G0 + i + NX * k) * u0[k] + D(G1 + i + NX * k) * u1[k];
            if (live[0]) for (j = 0; j < NX; ++j) a += D(PHI + i + NX * j) * x[j];
            if (live[1]) for (k = 0; k < NW; ++k) a += D(G0 + i + NX * (NU + k)) * w[k];
          }
          x1[i * NB + b] = a;
        }
      if (!NW) {
        memcpy(z, x1, NX * NB * sizeof(row_block));
        if (sub >= 0) u += 2 * NU;
        continue;
      }
      for (i = 0; i < NX; ++i) x[i] = VALUE(x1, i);
      for (b = 0; b < NB; ++b)
        for (j = 0; j < NW; ++j) {
          row_block a = {0};
          for (i = 0; i < NX; ++i) a += m[CS + j + NW * i] * x1[i * NB + b];
          if (b < lead) {
            for (k = 0; k < NU; ++k) a += D(DS + j + NW * k) * u1[k];
            if (live[3]) for (i = 0; i < NX; ++i) a += D(CS + j + NW * i) * x[i];
          }
          s[j * NB + b] = a;
        }
      for (j = 0; j < NW; ++j) free_[j] = VALUE(s, j);
      arg[0] = free_; arg[1] = m + GAIN; arg[2] = memory; arg[3] = q; arg[4] = w; arg[5] = m + STEP;
      res[0] = w_new; res[1] = memory_new;
#if SLOPES
      res[2] = resolvent; res[3] = by_free; res[4] = by_gain; res[5] = by_memory; res[6] = by_q;
      res[7] = slopes;
#endif
      int again, passes = 0;
      do {
        int off, tries = 0;
        do {
          for (k = 0; k < NBANKS; ++k) put(banks + k, memory + laws->bank_slot[k]);
          solved(laws, arg, res, iw, work);
          for (k = off = 0; k < NBANKS; ++k)
            off |= looked_up(banks + k, memory_new[laws->bank_slot[k] + 2], tries);
        } while (off && ++tries < LOOKS);
        /* a step of no length, a start or a jump, begins Newton's method from far */
        for (j = again = 0; sub < 0 && j < NW; ++j) {
          again |= fabs(w_new[j] - w[j]) > 1e-12 * fabs(w_new[j]);
          w[j] = w_new[j];
        }
      } while (again && ++passes < PASSES);
#if SLOPES
      for (k = 0; k < NBANKS; ++k) moved_line(banks + k, z + (NX + NW + laws->bank_slot[k]) * NB);
#endif
      for (b = 0; b < NB; ++b) {
#if SLOPES
        casadi_int from = 0, to = 0;
        for (i = j = 0; j < NW; ++j) {
          row_block a = by_free[j] * s[j * NB + b];
          if (b < lead && live[5])
            for (k = 0; k < NW; ++k)
              a += D(GAIN + j + NW * k) * (k == j ? by_gain[j] : by_free[j] * w_new[k]);
          for (to += laws->memories[j]; i < to; ++i) a += by_memory[i] * z[(NX + NW + i) * NB + b];
          for (k = 0; k < laws->parameters[j]; ++k, ++from) a += by_q[from] * dq[from * NB + b];
          alone[j] = a;
        }
        for (j = 0; j < NW; ++j) {
          row_block a = {0};
          for (k = 0; k < NW; ++k) a += resolvent[j + NW * k] * alone[k];
          w1[j * NB + b] = a;
        }
#endif
        if (b == 0) for (j = 0; j < NW; ++j) FIRST(w1[j * NB], w_new[j]);
        for (i = 0; i < NX; ++i) {
          row_block a = x1[i * NB + b];
          for (k = 0; k < NW; ++k) a += m[G1 + i + NX * (NU + k)] * w1[k * NB + b];
          if (b < lead && live[2])
            for (k = 0; k < NW; ++k) a += D(G1 + i + NX * (NU + k)) * w_new[k];
          x1[i * NB + b] = a;
        }
        for (j = 0; j < NW; ++j) {
          row_block a = s[j * NB + b];
          for (k = 0; k < NW; ++k) a += m[GAIN + j + NW * k] * w1[k * NB + b];
          if (b < lead && live[5]) for (k = 0; k < NW; ++k) a += D(GAIN + j + NW * k) * w_new[k];
          s[j * NB + b] = a;
        }
        for (i = 0; i < NM; ++i) m1[i * NB + b] = (row_block){0};
#if SLOPES
        for (k = 0; k < laws->n_slopes; ++k) {
          const casadi_int c = laws->memory_column[k];
          const row_block r = c < NW ? s[c * NB + b]
                            : c < NW + NM ? z[(NX + c) * NB + b] : dq[(c - NW - NM) * NB + b];
          m1[laws->memory_row[k] * NB + b] += slopes[k] * r;
        }
#endif
        if (b == 0) for (i = 0; i < NM; ++i) FIRST(m1[i * NB], memory_new[i]);
      }
      for (k = 0; k < NBANKS; ++k) {
#if SLOPES
        moved_rows(banks + k, m1 + (laws->bank_slot[k] + 2) * NB);
#endif
        accepted(banks + k);
      }
      memcpy(z, x1, NX * NB * sizeof(row_block));
      memcpy(z + NX * NB, w1, NW * NB * sizeof(row_block));
      memcpy(z + (NX + NW) * NB, m1, NM * NB * sizeof(row_block));
#if LOCATED
      if (sub >= 0) {
        const double jump_by = place.phase < 2 ? 0.0
                             : jumping(z, kept, m + G1 + NX * NU, NX, NW, NB, s, began, quiet, allowed);
        const casadi_int level = place.level;
        if (!gone_on(&place, z, kept, NZ, NB, allowed, jump_by, left)) {
          /* a step that is taken back begins again with the arguments that it began with */
          if (place.level > level)
            for (j = 0; j < NW; ++j) FIRST(s[j * NB], began[j]);
          --sub;
          continue;
        }
      }
      for (i = 0; i < NZ; ++i) {
        ends[i] = fmin(ends[i], VALUE(z, i));
        ends[NZ + i] = fmax(ends[NZ + i], VALUE(z, i));
      }
#endif
      if (sub >= 0) u += 2 * NU;
    }
    if (over) {
      if (late) READ(begun, y - n_y * width);
      break;
    }
    if (!first) before = u - NU;
    READ(before, y);
    y += n_y * width;
    for (j = 0; j < NW; ++j) seen[j] = VALUE(s, j);
    for (j = 0; j < NW; ++j) seen[NW + j] = w_new[j];
    seen += 2 * NW;
  }
  for (k = 0; k < NBANKS; ++k) closed(banks + k);
}

#if !LOCATED
/* many short records one after the other, each from inputs and carried numbers of its own */
void run_records(const laws_t* laws, const double* u, const double* before, casadi_int n_records,
                 const casadi_int* samples, casadi_int NX, casadi_int NU, casadi_int NB,
                 casadi_int n_sub, casadi_int n_y, casadi_int width, casadi_int lead,
                 const casadi_int* live, double* carried, const double* moving,
                 const double* standing, const double* q, const double* slopes_of_moving,
                 const double* slopes_of_standing, const double* by_parameters, double* y,
                 double* seen, casadi_int* iw, double* work, const double** arg, double** res) {
  const casadi_int NZ = NX + laws->n_w + laws->n_m;
  casadi_int r;
  for (r = 0; r < n_records; ++r) {
    run_record(laws, u, before, NULL, NX, NU, NB, 1, samples[r], n_sub, n_y, width, lead, live,
               carried, moving, standing, q, slopes_of_moving, slopes_of_standing, by_parameters,
               y, seen, iw, work, arg, res, NULL, NULL, NULL);
    u += 2 * NU * n_sub * (samples[r] - 1);
    before += NU;
    carried += NZ * NB * LANES;
    y += samples[r] * n_y * width;
    seen += samples[r] * 2 * laws->n_w;
  }
}
#endif
