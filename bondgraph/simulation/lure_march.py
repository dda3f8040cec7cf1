"""A record in one compiled call: the value and all its derivatives side by side in registers.

A row holds a number and its derivatives. The linear part of a step multiplies rows by numbers, so
that one instruction serves several directions; only the laws are code of their own.
"""

from __future__ import annotations

from casadi import Function

from bondgraph.simulation.banks import PlacedBank, bank_source
from bondgraph.simulation.lure_closing import ClosedLaws
from bondgraph.simulation.lure_layout import KernelLayout
from bondgraph.support.native import c_source, vector_length


def lanes_of(lay: KernelLayout) -> int:
    """Return how many directions one instruction serves."""
    return vector_length() if lay.n_d else 1


def blocks_of(lay: KernelLayout) -> int:
    """Return in how many blocks of lanes a row is cut."""
    return -(-(1 + lay.n_d) // lanes_of(lay))


def march_source(lay: KernelLayout, laws: ClosedLaws, banks: tuple[PlacedBank, ...] = ()) -> str:
    """Return C source of ``run_record`` for a model with `lay` and `laws`.

    It is the same for all numbers of outputs, of directions that fill as many blocks, and of plays
    in a bank: few are compiled.
    """
    v = lay.n_u + lay.n_w
    lengths = [r * c for r, c in lay.pieces]
    sizes = {
        "NX": lay.n_x, "NU": lay.n_u, "NW": lay.n_w, "NM": lay.n_m, "NQ": lay.n_q,
        "SLOPES": int(lay.n_d > 0), "NB": blocks_of(lay), "LANES": lanes_of(lay), "NV": v,
        **{n: sum(lengths[:i]) for i, n in enumerate(PIECES)},
        "NJ": len(laws.rows), "NBANKS": len(banks),
    }  # fmt: skip
    head = "".join(f"#define {name} {value}\n" for name, value in sizes.items())
    where = "".join(
        f"static const int {name}[] = {{{', '.join(map(str, values)) or '0'}}};\n"
        for name, values in (
            ("memory_row", laws.rows), ("memory_column", laws.columns),
            ("memories", laws.memories), ("parameters", laws.parameters),
            ("bank_slot", [b.slot for b in banks]),
            ("bank_stops", [int(b.bank.stops) for b in banks]),
        )
    )  # fmt: skip
    made = c_source(*native_functions(laws)) if lay.n_w else "#define casadi_int long long int\n"
    solving = _solving(laws) if lay.n_w else ""
    return made + head + where + solving + _ROWS + (bank_source() if banks else "") + _MARCH


def native_functions(laws: ClosedLaws) -> tuple[Function, ...]:
    """Return the functions that the source is made of."""
    each = (f for part in laws.parts for f in (part.begin, part.step, part.end) if f is not None)
    return (*each, laws.after) if laws.parts else (laws.function,)


def _solving(laws: ClosedLaws) -> str:
    """Return C source of ``solved``, which takes and gives what ``bondsight_laws`` does."""
    if not laws.parts:
        return _FORMULA
    used = native_functions(laws)
    rows = "".join(
        f"  {{{', '.join(f.name() if f is not None else '0' for f in (p.begin, p.step, p.end))}, "
        f"{p.arguments}, {p.most}}},\n"
        for p in laws.parts
    )
    sizes = {
        "SWEEPS": laws.sweeps, "NPARTS": len(laws.parts),
        "NUMBERS": max([1, *(p.size for p in laws.parts)]),
        "NARG": max(f.sz_arg() for f in used) + 1, "NRES": max(f.sz_res() for f in used) + 1,
    }  # fmt: skip
    head = "".join(f"#define {name} {value}\n" for name, value in sizes.items())
    return head + _STEPS.replace("ROWS_OF_PARTS", rows)


_FORMULA = r"""
/* out of line: copies of large laws would take gcc twice the time */
static void __attribute__((noinline)) solved(const double** arg, double** res, casadi_int* iw,
                                             double* work) {
  bondsight_laws(arg, res, iw, work, 0);
}
"""

_STEPS = r"""
#include <math.h>
#include <string.h>
typedef int (*piece)(const double**, double**, casadi_int*, double*, int);
static const struct {
  piece begin, step, end;
  int arguments, most;
} parts[NPARTS] = {
ROWS_OF_PARTS};

/* whether numbers stand still but for the last digits: after Newton's step, to the last one */
static int still(const double* now, const double* before, int n) {
  for (int i = 0; i < n; ++i)
    if (!(fabs(now[i] - before[i]) <= 1e-12 * fabs(now[i]))) return 0;
  return 1;
}

static void __attribute__((noinline)) solved(const double** arg, double** res, casadi_int* iw,
                                             double* work) {
  const double* given[NARG];
  double *made[NRES], now[NW], before[NW], v[2][NUMBERS];
  memcpy(now, arg[4], sizeof now);
  memcpy(given + 1, arg, 6 * sizeof *given);
  given[5] = now;
  for (int sweep = 0; sweep < SWEEPS; ++sweep) {
    memcpy(before, now, sizeof now);
    for (int p = 0; p < NPARTS; ++p) {
      int k = 0;
      double next[NW];
      made[0] = parts[p].most ? v[0] : next;
      parts[p].begin(given + 1, made, iw, work, 0);
      for (int i = 0; i < parts[p].most; ++i) {
        given[0] = v[k];
        made[0] = v[1 - k];
        parts[p].step(given, made, iw, work, 0);
        k = 1 - k;
        if (still(v[k], v[1 - k], parts[p].arguments)) break;
      }
      if (parts[p].most) {
        given[0] = v[k];
        made[0] = next;
        parts[p].end(given, made, iw, work, 0);
      }
      memcpy(now, next, sizeof now);
    }
    if (still(now, before, NW)) break;
  }
  memcpy(res[0], now, sizeof now);
  bondsight_after(given + 1, res + 1, iw, work, 0);
}
"""

PIECES = ("PHI", "G0", "G1", "CS", "DS", "GAIN", "CY")

_ROWS = r"""
#include <math.h>
#include <string.h>
#if LANES > 1
typedef double row_block __attribute__((vector_size(8 * LANES), aligned(8), may_alias));
#define FIRST(block, value) (block)[0] = (value)
#else
typedef double row_block;
#define FIRST(block, value) (block) = (value)
#endif
"""

_MARCH = r"""
#define PASSES 16
#define SOME(n) ((n) ? (n) : 1)
#define VALUE(rows, i) (((const double*)(rows))[(i) * NB * LANES])
/* derivatives of the matrices: one row each, `lead` blocks that are not zero; the first lane of an
   input's entry is the entry itself, so that inputs enter values and derivatives alike */
#define D(entry) d[(entry) * lead + b]

/* whether inputs that act on the laws' arguments have jumped */
static int jumped(const double* u0, const double* before, const double* m) {
  for (int k = 0; k < NU; ++k)
    if (u0[k] != before[k])
      for (int j = 0; j < NW; ++j)
        if (m[DS + j + NW * k] != 0.0) return 1;
  return 0;
}

/* `standing` are the matrices of a step of no length; with `begin` the first sample is such a step
   under the inputs `before` */
void run_record(const double* u, const double* before, casadi_int begin, casadi_int n_samples,
                casadi_int n_sub, casadi_int n_y, casadi_int width, casadi_int lead,
                const casadi_int* live, double* carried,
                const double* moving, const double* standing, const double* q,
                const double* slopes_of_moving, const double* slopes_of_standing,
                const double* by_parameters, double* y, double* seen, casadi_int* iw,
                double* work, const double** arg, double** res, const casadi_int* plays,
                double* numbers, double* rows) {
  const casadi_int DY = CY + n_y * NX, STEP = DY + n_y * NV;
  row_block* z = (row_block*)carried;
  const double* m = moving;
  const row_block* d = (const row_block*)slopes_of_moving;
  const row_block* dq = (const row_block*)by_parameters;
  row_block x1[SOME(NX) * NB];
#if NW
  row_block s[NW * NB], w1[NW * NB], m1[SOME(NM) * NB], alone[NW];
  double free_[NW], w[NW], w_new[NW], memory[SOME(NM)], memory_new[SOME(NM)];
  double resolvent[NW * NW], by_free[NW], by_gain[NW], by_memory[SOME(NM)], by_q[SOME(NQ)];
  double slopes[SOME(NJ)];
#endif
#if NBANKS
  bank_t banks[NBANKS];
  for (int i = 0; i < NBANKS; ++i)
    opened(banks + i, bank_stops[i], plays + 2 * i, NB, &numbers, &rows);
#endif
  double x[SOME(NX)];
  row_block out[NB];
  casadi_int sample, sub;
  int b, i, j, k;
  for (sample = 0; sample < n_samples; ++sample) {
    /* a jump is a step of its own, of no length: laws begin the next one with what it makes */
    const int first = begin && !sample, jump = first || (NW && jumped(u, before, moving));
    for (sub = -jump; sub < (first ? 0 : n_sub); ++sub) {
      const double *u0 = first ? before : u, *u1 = sub < 0 ? u0 : u + NU;
      m = sub < 0 ? standing : moving;
      d = (const row_block*)(sub < 0 ? slopes_of_standing : slopes_of_moving);
      for (j = 0; j < NX; ++j) x[j] = VALUE(z, j);
#if NW
      for (k = 0; k < NW; ++k) w[k] = VALUE(z, NX + k);
      for (k = 0; k < NM; ++k) memory[k] = VALUE(z, NX + NW + k);
#endif
      for (b = 0; b < NB; ++b)
        for (i = 0; i < NX; ++i) {
          row_block a = {0};
          for (j = 0; j < NX; ++j) a += m[PHI + i + NX * j] * z[j * NB + b];
#if NW
          for (k = 0; k < NW; ++k) a += m[G0 + i + NX * (NU + k)] * z[(NX + k) * NB + b];
#endif
          if (b < lead) {
            for (k = 0; k < NU; ++k) a += D(G0 + i + NX * k) * u0[k] + D(G1 + i + NX * k) * u1[k];
            if (live[0]) for (j = 0; j < NX; ++j) a += D(PHI + i + NX * j) * x[j];
#if NW
            if (live[1]) for (k = 0; k < NW; ++k) a += D(G0 + i + NX * (NU + k)) * w[k];
#endif
          }
          x1[i * NB + b] = a;
        }
#if NW
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
#if NBANKS
        int tries = 0;
        do {
          for (k = 0; k < NBANKS; ++k) put(banks + k, memory + bank_slot[k]);
          solved(arg, res, iw, work);
          for (k = j = 0; k < NBANKS; ++k)
            j |= looked_up(banks + k, memory_new[bank_slot[k] + 2], tries);
        } while (j && ++tries < LOOKS);
#else
        solved(arg, res, iw, work);
#endif
        /* a step of no length, a start or a jump, begins Newton's method from far */
        for (j = again = 0; sub < 0 && j < NW; ++j) {
          again |= fabs(w_new[j] - w[j]) > 1e-12 * fabs(w_new[j]);
          w[j] = w_new[j];
        }
      } while (again && ++passes < PASSES);
#if NBANKS && SLOPES
      for (k = 0; k < NBANKS; ++k) moved_line(banks + k, z + (NX + NW + bank_slot[k]) * NB);
#endif
      for (b = 0; b < NB; ++b) {
#if SLOPES
        int from = 0, to;
        for (j = 0, i = 0, to = 0; j < NW; ++j) {
          row_block a = by_free[j] * s[j * NB + b];
          if (b < lead && live[5])
            for (k = 0; k < NW; ++k)
              a += D(GAIN + j + NW * k) * (k == j ? by_gain[j] : by_free[j] * w_new[k]);
          for (to += memories[j]; i < to; ++i) a += by_memory[i] * z[(NX + NW + i) * NB + b];
          for (k = 0; k < parameters[j]; ++k, ++from) a += by_q[from] * dq[from * NB + b];
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
#if NM
        for (i = 0; i < NM; ++i) m1[i * NB + b] = (row_block){0};
#if SLOPES
        for (k = 0; k < NJ; ++k) {
          const int c = memory_column[k];
          const row_block r = c < NW ? s[c * NB + b]
                            : c < NW + NM ? z[(NX + c) * NB + b] : dq[(c - NW - NM) * NB + b];
          m1[memory_row[k] * NB + b] += slopes[k] * r;
        }
#endif
        if (b == 0) for (i = 0; i < NM; ++i) FIRST(m1[i * NB], memory_new[i]);
#endif
      }
#if NBANKS
      for (k = 0; k < NBANKS; ++k) {
#if SLOPES
        moved_rows(banks + k, m1 + (bank_slot[k] + 2) * NB);
#endif
        accepted(banks + k);
      }
#endif
      memcpy(z + NX * NB, w1, sizeof w1);
#if NM
      memcpy(z + (NX + NW) * NB, m1, sizeof m1);
#endif
#endif
      memcpy(z, x1, NX * NB * sizeof(row_block));
      if (sub >= 0) u += 2 * NU;
    }
    if (!first) before = u - NU;
    const double* u1 = before;
    for (i = 0; i < NX; ++i) x[i] = VALUE(z, i);
    for (i = 0; i < n_y; ++i) {
      for (b = 0; b < NB; ++b) {
        row_block a = {0};
        for (j = 0; j < NX; ++j) a += m[CY + i + n_y * j] * z[j * NB + b];
#if NW
        for (k = 0; k < NW; ++k) a += m[DY + i + n_y * (NU + k)] * w1[k * NB + b];
#endif
        if (b < lead) {
          for (k = 0; k < NU; ++k) a += D(DY + i + n_y * k) * u1[k];
          if (live[6]) for (j = 0; j < NX; ++j) a += D(CY + i + n_y * j) * x[j];
#if NW
          if (live[7]) for (k = 0; k < NW; ++k) a += D(DY + i + n_y * (NU + k)) * w_new[k];
#endif
        }
        out[b] = a;
      }
      memcpy(y, out, width * sizeof(double));
      y += width;
    }
#if NW
    for (j = 0; j < NW; ++j) seen[j] = VALUE(s, j);
    for (j = 0; j < NW; ++j) seen[NW + j] = w_new[j];
    seen += 2 * NW;
#endif
  }
#if NBANKS
  for (k = 0; k < NBANKS; ++k) closed(banks + k);
#endif
}
"""
