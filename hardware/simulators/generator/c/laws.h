/* Port laws of the sealed trial, written from textbooks; see laws.py for the numbers of the kinds.
 *
 * Memories are committed at the end of an accepted step only; inside a step every stage of the
 * Runge-Kutta method evaluates a trial from the committed memory. */
#include <math.h>
#include <string.h>

#define MAX_EFFECTS 4
#define MAX_STATES 64
#define MAX_SLOTS 12

typedef struct {
  int kind, slot, z;          /* z: first own state */
  double p[10], mem[64], when; /* when: time of the committed memory */
} Effect;

typedef struct {
  Effect e[MAX_EFFECTS];
  int ne, commit;
  double t, span;
  const double *x;
  double *dx;
  double seen[MAX_SLOTS][2]; /* displacement and flow at each slot */
} Sim;

static double clip(double a, double lo, double hi) { return a < lo ? lo : a > hi ? hi : a; }
static double sgn(double v, double eps) { return v / sqrt(v * v + eps * eps); }
static double power(double v, double n) { return v < 0 ? -pow(-v, n) : pow(v, n); }

/* a reproducible number in [0, 1) from an integer and a seed */
static double dice(long i, double seed) {
  unsigned long long h = (unsigned long long)(i * 2654435761L) ^ (unsigned long long)(seed * 1e6);
  h ^= h >> 33; h *= 0xff51afd7ed558ccdULL; h ^= h >> 33; h *= 0xc4ceb9fe1a85ec53ULL; h ^= h >> 33;
  return (double)(h >> 11) / 9007199254740992.0;
}

/* slow change of a coefficient; own kinds for any slot */
static double vary(Sim *s, int slot, double value) {
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    if (e->slot != slot) continue;
    double r = s->t / s->span;
    if (e->kind == 1) value *= 1 + e->p[0] * r;
    if (e->kind == 2) value *= 1 + e->p[0] * (1 - exp(-r / e->p[1]));
    if (e->kind == 3) value *= 1 + e->p[0] * sin(e->p[1] * s->t + e->p[2]);
    if (e->kind == 4) value *= r > e->p[1] ? 1 + e->p[0] : 1;
  }
  return value;
}

/* Preisach's continuum of relays with uniform density over the triangle of thresholds within
 * [-1, 1], in its classical form: a list of the turning points that are not yet wiped out;
 * m[0]: how many, the last one is where the input stands */
static double relays(double *m, double y, int keep) {
  double w[64], out = 0;
  memcpy(w, m, sizeof w);
  int n = (int)w[0];
  double before = n > 1 ? w[n - 1] : 0;
  if (n && (y - w[n]) * (w[n] - before) >= 0) w[n] = y;
  else if (n < 62) w[++n] = y;
  else w[n] = y;
  while (n > 1) { /* a wider branch wipes out those within it */
    if (n == 2 ? fabs(w[2]) >= fabs(w[1]) : fabs(w[n] - w[n - 1]) >= fabs(w[n - 1] - w[n - 2])) {
      int kept = n == 2 ? 1 : n - 2;
      w[kept] = w[n];
      n = kept;
    } else break;
  }
  w[0] = n;
  for (int k = 1; k <= n; k++) {
    double d = k > 1 ? w[k] - w[k - 1] : w[1];
    out += d * fabs(d) / (k > 1 ? 4 : 2);
  }
  if (keep) memcpy(m, w, sizeof w);
  return out;
}

/* effort of a storage: stiffness k, displacement q, flow v, another displacement of the plant */
static double storage(Sim *s, int slot, double k, double q, double v, double other) {
  s->seen[slot][0] = q; s->seen[slot][1] = v;
  k = vary(s, slot, k);
  double f = k * q;
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    const double *p = e->p;
    if (e->slot != slot) continue;
    switch (e->kind) {
    case 10: f += p[0] * q * q + p[1] * q * q * q; break;
    case 11: f += p[0] * fmax(q - p[1], 0); break;
    case 12: f += p[0] * (fmax(q - p[1], 0) - fmax(-q - p[2], 0)); break;
    case 13: f -= k * clip(q, -p[0], p[0]); break;
    case 14: f = fmax(f + p[0], 0) - p[0]; break;
    case 15: /* sliders in series with springs, in parallel; yield points r (j/n)^a */
      for (int j = 0, n = (int)p[2]; j < n; j++) {
        double r = p[1] * pow((j + 1.0) / n, p[3]);
        double slid = clip(e->mem[j], q - r, q + r);
        f += p[0] / n * (q - slid);
        if (s->commit) e->mem[j] = slid;
      }
      break;
    case 16: { /* Bouc, Wen: state in units of the yield displacement */
      double z = s->x[e->z], a = fabs(z);
      s->dx[e->z] = v / p[1] * (1 - pow(a, p[2]) * (p[3] + (1 - p[3]) * (v * z > 0 ? 1 : -1)));
      f += p[0] * p[1] * z;
      break;
    }
    case 17: { /* retarded strains in series; p[0] compliance ratio each, times geometric */
      int n = (int)p[1];
      double c = 0;
      for (int j = 0; j < n; j++) c += s->x[e->z + j];
      double force = k * (q - c);
      f -= k * c;
      for (int j = 0; j < n; j++)
        s->dx[e->z + j] = (p[0] * force / k - s->x[e->z + j]) / (p[2] * pow(p[3], j));
      break;
    }
    case 19: f += p[0] * pow(q / p[1], 5); break;
    case 20: f += p[0] * (sinh(q / p[1]) - q / p[1]); break;
    case 21: f += p[0] * (power(q / p[1], p[2])); break;
    case 22: { /* contact of round bodies */
      double a = fmax(q - p[1], 0), b = fmax(-q - p[2], 0);
      f += p[0] * (a * sqrt(a) - b * sqrt(b));
      break;
    }
    case 23: f -= k * p[0] * (q >= 0 ? tanh(q / p[0]) : p[1] * tanh(q / p[0] / p[1])); break;
    case 24: { /* one side stiffer, passing smoothly */
      double w = p[2], a = (q - p[1]) / w;
      f += p[0] * w * (a > 30 ? a : log1p(exp(a)));
      break;
    }
    case 25: f += k * q * (1 / sqrt(1 + q * q / p[0] / p[0]) - 1); break;
    case 26: f -= k * clip(q, -p[0], p[0]); break; /* its damper lets go as well, see dissipate */
    case 27: { /* as 17, a unit each p[4] times as compliant as the one before */
      int n = (int)p[1];
      double c = 0;
      for (int j = 0; j < n; j++) c += s->x[e->z + j];
      double force = k * (q - c);
      f -= k * c;
      for (int j = 0; j < n; j++)
        s->dx[e->z + j] =
            (p[0] * pow(p[4], j) * force / k - s->x[e->z + j]) / (p[2] * pow(p[3], j));
      break;
    }
    case 28: { /* continuum of relays behind a saturating input */
      double y = tanh(q / p[1]);
      f += p[0] * (y - relays(e->mem, y, s->commit));
      break;
    }
    case 29: { /* magnet at the distance p[1]; p[2]: another one on the other side */
      double r = clip(q / p[1], -0.95, 0.95);
      f += p[0] * (1 / (1 - r) / (1 - r) - 1 - p[2] * (1 / (1 + r) / (1 + r) - 1));
      break;
    }
    case 36: { /* Hunt and Crossley's contact: the damping grows with the depth */
      double a = fmax(q - p[1], 0), b = fmax(-q - p[2], 0);
      f += p[0] * (a * sqrt(a) * fmax(1 + p[3] * v, 0) - b * sqrt(b) * fmax(1 - p[3] * v, 0));
      break;
    }
    case 37: { /* Coleman and Hodgdon's loop: slopes p[0] at turns, p[2] far away, length p[1] */
      double z = s->x[e->z];
      s->dx[e->z] = fabs(v) / p[1] * (p[2] * q - z) + p[0] * v;
      f += z;
      break;
    }
    case 50: f += k * q * p[0] * other * other; break;
    }
  }
  return f;
}

/* flow that leaves a storage of effort e beside the bonds */
static double escape(Sim *s, int slot, double effort) {
  double out = 0;
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    const double *p = e->p;
    if (e->slot != slot) continue;
    if (e->kind == 30) out += p[0] * effort;
    if (e->kind == 31) out += p[0] * fmax(effort - p[1], 0);
    if (e->kind == 32) out += p[0] * effort * fabs(effort / p[1]);
    if (e->kind == 33) { double h = fmax(effort - p[1], 0); out += p[0] * h * sqrt(h / p[2]); }
    if (e->kind == 35) out += p[0] * effort / pow(effort * effort + p[1] * p[1], 0.25);
    if (e->kind == 34) { /* siphon: starts above one level, breaks below another */
      double on = effort > p[1] ? 1 : effort < p[2] ? 0 : e->mem[0];
      out += on * p[0] * sqrt(fmax(effort - p[3], 0));
      if (s->commit) e->mem[0] = on;
    }
  }
  return out;
}

/* effort of a resistor: coefficient b, flow v, displacement q belonging to it, another flow */
static double dissipate(Sim *s, int slot, double b, double v, double q, double other) {
  s->seen[slot][0] = q; s->seen[slot][1] = v;
  b = vary(s, slot, b);
  double f = b * v;
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    const double *p = e->p;
    if (e->kind == 26 && (int)p[1] == slot) /* grips again over the depth p[2] behind the gap */
      f -= b * v * (1 - clip((fabs(q) - p[0]) / p[2], 0, 1));
    if (e->slot != slot) continue;
    switch (e->kind) {
    case 40: f += p[0] * sgn(v, p[9]); break;
    case 41: f += (p[0] + p[1] * exp(-v * v / p[2] / p[2])) * sgn(v, p[9]); break;
    case 42: { /* bristle: Dahl (p[3] = 0), Canudas de Wit with p[2], p[3] */
      double z = s->x[e->z], level = p[0] + p[3] * exp(-v * v / p[4] / p[4]);
      double dz = v - p[1] * fabs(v) / level * z;
      s->dx[e->z] = dz;
      f += p[1] * z + p[2] * dz;
      break;
    }
    case 43: f += p[0] * v * fabs(v); break;
    case 44: f += p[0] * fabs(v); break;
    case 45: f += p[0] * power(v / p[1], p[2]); break;
    case 46: f += (p[0] + p[1] / (1 + v * v / p[2] / p[2])) * sgn(v, p[9]); break;
    case 47: f += p[0] * v * v + p[1] * v * v * v; break;
    case 48: { /* own temperature th, in units of the relative rise; p[2] = 1: rise that levels */
      double th = s->x[e->z];
      s->dx[e->z] = (p[0] * v * v * b - th) / p[1];
      f += b * v * (p[2] > 0 ? -expm1(-th) : th);
      break;
    }
    case 49: f += p[0] * (v + p[1] * sqrt(v * v + p[2] * p[2]) - p[1] * p[2]); break;
    case 60: { /* diffusion into a solid: ladder of lags, half an octave of order */
      for (int j = 0; j < 7; j++) {
        double tau = p[1] * pow(4.0, -j);
        double z = s->x[e->z + j];
        s->dx[e->z + j] = (v - z) / tau;
        f += p[0] * (v - z) * pow(2.0, j);
      }
      break;
    }
    case 61: f += p[0] * q * q * v; break;
    case 62: { /* plate valve with inertia: opens late, hits nothing, p[1] period, p[2] damping */
      double w = s->x[e->z], r = s->x[e->z + 1];
      s->dx[e->z] = r;
      s->dx[e->z + 1] = (sgn(v, p[9]) * .5 + .5 - w - 2 * p[2] * p[1] * r) / (p[1] * p[1]);
      f += p[0] * v * w;
      break;
    }
    case 63: f += p[0] * v * other * other; break;
    case 64: { /* structure of a fluid: broken by shear, heals */
      double z = s->x[e->z];
      s->dx[e->z] = fabs(v) / p[1] * (1 - z) - z / p[2];
      f -= p[0] * v * z;
      break;
    }
    case 66: { /* bristle of Canudas de Wit: Stribeck curve, damping that fades with speed */
      double z = s->x[e->z], level = p[0] + p[3] * exp(-fabs(v) / p[4]);
      double dz = v - p[1] * fabs(v) / level * z;
      s->dx[e->z] = dz;
      f += p[1] * z + p[2] * exp(-v * v / p[5] / p[5]) * dz;
      break;
    }
    case 67: /* many bristles in parallel, each slips at a displacement of its own */
      for (int j = 0, n = (int)p[2]; j < n; j++) {
        double r = p[1] * (j + 1.0) / n;
        double slid = clip(e->mem[j], q - r, q + r);
        f += p[0] / n * (q - slid);
        if (s->commit) e->mem[j] = slid;
      }
      break;
    case 68: f += (p[0] + p[1] * exp(-fabs(v) / p[2])) * tanh(v / p[9]); break;
    case 69: { /* film that is squeezed: Stefan's damping by the third power of the gap p[1] */
      double gap = 1 - clip(q / p[1], -2, 0.8);
      f += p[0] * v * (1 / (gap * gap * gap) - 1);
      break;
    }
    case 65: { /* seal that sticks at random: coefficient jumps at random moments */
      double d = dice((long)floor(s->t / p[1]), p[2]);
      f += d > 0.7 ? p[0] * v : 0;
      break;
    }
    }
  }
  return f;
}

/* flow of a resistor from its effort, by Newton's method on the law above */
static double conduct(Sim *s, int slot, double r, double effort, double q, double other) {
  double f = effort / r, kept = f;
  int any = 0;
  for (int i = 0; i < s->ne; i++) any |= s->e[i].slot == slot;
  if (!any) { s->seen[slot][0] = q; s->seen[slot][1] = f; return f; }
  int commit = s->commit;
  s->commit = 0;
  for (int k = 0; k < 40; k++) {
    double h = 1e-6 * (fabs(f) + 1e-3 * fabs(kept) + 1e-30);
    double g = dissipate(s, slot, r, f, q, other) - effort;
    double a = dissipate(s, slot, r, f + h, q, other), c = dissipate(s, slot, r, f - h, q, other);
    double step = g / fmax((a - c) / (2 * h), 0.2 * r);
    f -= step;
    if (fabs(step) <= 1e-11 * (fabs(f) + fabs(kept))) break;
  }
  s->commit = commit;
  dissipate(s, slot, r, f, q, other);
  return f;
}
