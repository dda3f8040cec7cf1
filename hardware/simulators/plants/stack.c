/* The stack bench of plant.py and nonsmooth.py, one law replaced, advanced in equal steps.
 *
 * The voltage is constant within a step. The state is kept by the caller, so that a record can go
 * on. Classical Runge-Kutta steps; switching instants are found as in nonsmooth.py. */
#include <math.h>

#define MOST 16

typedef struct {
  double C, T, k, m, b, R;
  int kind, place, n;
  const double *a;
} Plant;

enum { POLYNOMIAL, LAGGED, CREEPING, SLIPPING, DRY };
enum { DIELECTRIC, SPRING };

static const double BIAS = 50.0;

static int states(const Plant *p) {
  switch (p->kind) {
  case LAGGED: case DRY: return 4;
  case CREEPING: case SLIPPING: return 3 + p->n;
  }
  return 3;
}

/* derivative of the smooth plants; d[0] is the current */
static void rate(const Plant *p, const double *y, double u, double *d) {
  double q = y[0], x1 = y[1] - p->T * y[0], v = y[2];
  double force = p->k * x1, effort = q / p->C, drag = p->b * v;
  d[1] = v;
  if (p->kind == LAGGED) {
    d[3] = (u - y[3]) / p->a[0];
    u = y[3];
  } else if (p->kind == CREEPING) {
    double total = 0, fast;
    for (int j = 0; j < p->n; j++) total += y[3 + j];
    if (p->place == DIELECTRIC) {
      fast = q - total;
      effort = fast / p->C;
    } else {
      fast = x1 - total;
      force = p->k * fast;
    }
    for (int j = 0; j < p->n; j++) d[3 + j] = (p->a[j] * fast - y[3 + j]) / p->a[p->n + j];
  } else {
    double r = q - p->C * BIAS;
    force = x1 * (p->k + x1 * (p->a[2] + x1 * p->a[3]));
    effort += r * r * (p->a[0] + r * p->a[1]);
    drag = v * (p->b + p->a[4] * fabs(v));
  }
  d[0] = (u - effort + p->T * force) / p->R;
  d[2] = -(force + drag) / p->m;
}

static void smooth(const Plant *p, double *y, double h, double u) {
  double k1[MOST], k2[MOST], k3[MOST], k4[MOST], w[MOST];
  int n = states(p);
  rate(p, y, u, k1);
  for (int i = 0; i < n; i++) w[i] = y[i] + h / 2 * k1[i];
  rate(p, w, u, k2);
  for (int i = 0; i < n; i++) w[i] = y[i] + h / 2 * k2[i];
  rate(p, w, u, k3);
  for (int i = 0; i < n; i++) w[i] = y[i] + h * k3[i];
  rate(p, w, u, k4);
  for (int i = 0; i < n; i++) y[i] += h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
}

/* Maxwell slip: a[0..n) slip limits, a[n..2n) stiffness of the stops */

static double clip(double z, double r) { return z > r ? r : z < -r ? -r : z; }

static double stroke(const Plant *p, const double *y) {
  return p->place == DIELECTRIC ? y[0] : y[1] - p->T * y[0];
}

static void slip_rate(const Plant *p, const double *y, const double *z, double s0, double u,
                      double *d) {
  double ds = stroke(p, y) - s0, extra = 0;
  for (int j = 0; j < p->n; j++) extra += p->a[p->n + j] * clip(z[j] + ds, p->a[j]);
  double force = p->k * (y[1] - p->T * y[0]), effort = y[0] / p->C;
  if (p->place == DIELECTRIC) effort += extra; else force += extra;
  d[0] = (u - effort + p->T * force) / p->R;
  d[1] = y[2];
  d[2] = -(force + p->b * y[2]) / p->m;
}

static void slip_raw(const Plant *p, const double *y, double h, double u, double *end) {
  double k1[3], k2[3], k3[3], k4[3], w[3], s0 = stroke(p, y);
  const double *z = y + 3;
  slip_rate(p, y, z, s0, u, k1);
  for (int i = 0; i < 3; i++) w[i] = y[i] + h / 2 * k1[i];
  slip_rate(p, w, z, s0, u, k2);
  for (int i = 0; i < 3; i++) w[i] = y[i] + h / 2 * k2[i];
  slip_rate(p, w, z, s0, u, k3);
  for (int i = 0; i < 3; i++) w[i] = y[i] + h * k3[i];
  slip_rate(p, w, z, s0, u, k4);
  for (int i = 0; i < 3; i++) end[i] = y[i] + h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
  double ds = stroke(p, end) - s0;
  for (int j = 0; j < p->n; j++) end[3 + j] = clip(z[j] + ds, p->a[j]);
}

static double pace(const Plant *p, const double *y, double u) {
  double d[3];
  slip_rate(p, y, y + 3, stroke(p, y), u, d);
  return p->place == DIELECTRIC ? d[0] : y[2] - p->T * d[0];
}

static void slip(const Plant *p, double *y, double h, double u, int depth) {
  double end[MOST];
  slip_raw(p, y, h, u, end);
  int switches = 0;
  if (depth) {
    for (int j = 0; j < p->n; j++)
      switches |= (fabs(y[3 + j]) >= p->a[j]) != (fabs(end[3 + j]) >= p->a[j]);
    if (!switches) {
      /* a reversal; at rest the pace is rounding noise, which needs no instant */
      double before = pace(p, y, u), after = pace(p, end, u), least = p->a[0];
      for (int j = 1; j < p->n; j++) least = fmin(least, p->a[j]);
      switches = before * after < 0 && fmax(fabs(before), fabs(after)) * h > 1e-7 * least;
    }
  }
  if (switches) {
    slip(p, y, h / 2, u, depth - 1);
    slip(p, y, h / 2, u, depth - 1);
  } else {
    for (int i = 0; i < 3 + p->n; i++) y[i] = end[i];
  }
}

/* dry friction: a = F_c, F_s, v_s; y[3] is -1, 0 or 1 */

static void dry_rate(const Plant *p, const double *y, double mode, double u, double *d) {
  double force = p->k * (y[1] - p->T * y[0]), peak = p->a[1] - p->a[0];
  d[0] = (u - y[0] / p->C + p->T * force) / p->R;
  if (mode == 0) { d[1] = d[2] = 0; return; }
  double w = y[2] / p->a[2], dry = p->a[0] + (peak != 0 ? peak * exp(-w * w) : 0);
  d[1] = y[2];
  d[2] = -(force + p->b * y[2] + mode * dry) / p->m;
}

static void glide(const Plant *p, const double *y, double h, double u, double *end) {
  double k1[3], k2[3], k3[3], k4[3], w[3], mode = y[3];
  dry_rate(p, y, mode, u, k1);
  for (int i = 0; i < 3; i++) w[i] = y[i] + h / 2 * k1[i];
  dry_rate(p, w, mode, u, k2);
  for (int i = 0; i < 3; i++) w[i] = y[i] + h / 2 * k2[i];
  dry_rate(p, w, mode, u, k3);
  for (int i = 0; i < 3; i++) w[i] = y[i] + h * k3[i];
  dry_rate(p, w, mode, u, k4);
  for (int i = 0; i < 3; i++) end[i] = y[i] + h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
  if (mode == 0) { end[1] = y[1]; end[2] = 0; }
  end[3] = mode;
}

static double guard(const Plant *p, const double *y) {
  if (y[3] == 0) return 1 - fabs(p->k * (y[1] - p->T * y[0])) / p->a[1];
  return y[3] * y[2];
}

static double guard_at(const Plant *p, const double *y, double h, double u) {
  double end[4];
  glide(p, y, h, u, end);
  return guard(p, end);
}

static double first_zero(const Plant *p, const double *y, double h, double u, double at_end) {
  double low = 0, high = 1, g_low = fmax(guard_at(p, y, 0, u), 0), g_high = at_end;
  int side = 0;
  for (int n = 0; n < 60; n++) {
    double middle = g_low > 0 ? (low * g_high - high * g_low) / (g_high - g_low) : (low + high) / 2;
    double value = guard_at(p, y, middle * h, u);
    if (value < 0) {
      high = middle; g_high = value;
      if (side < 0) g_low /= 2;
      side = -1;
    } else {
      low = middle; g_low = value;
      if (side > 0) g_high /= 2;
      side = 1;
    }
    if (fabs(value) < 1e-13) return middle;
    if (high - low < 1e-12) break;
  }
  return high;
}

static void dry(const Plant *p, double *y, double h, double u) {
  double done = 0, end[4];
  for (int n = 0; n < 40; n++) {
    double rest = h - done;
    glide(p, y, rest, u, end);
    double g = guard(p, end);
    if (g >= 0) {
      for (int i = 0; i < 4; i++) y[i] = end[i];
      return;
    }
    double part = first_zero(p, y, rest, u, g) * rest;
    glide(p, y, part, u, end);
    double force = p->k * (end[1] - p->T * end[0]);
    int sticks = y[3] != 0 && fabs(force) <= p->a[1];
    y[0] = end[0]; y[1] = end[1]; y[2] = 0;
    y[3] = sticks ? 0 : -copysign(1, force);
    done += part;
    if (h - done <= 1e-12 * h) return;
  }
  y[2] = y[3] = 0;
  glide(p, y, h - done, u, end);
  y[0] = end[0];
}

static double current(const Plant *p, const double *y, double u) {
  double d[MOST];
  if (p->kind == SLIPPING) slip_rate(p, y, y + 3, stroke(p, y), u, d);
  else if (p->kind == DRY) dry_rate(p, y, y[3], u, d);
  else rate(p, y, u, d);
  return d[0];
}

static void go(const Plant *p, double *y, double h, double u) {
  if (p->kind == SLIPPING) slip(p, y, h, u, 6);
  else if (p->kind == DRY) dry(p, y, h, u);
  else smooth(p, y, h, u);
}

static int rests(const double *a, const double *b, double step) {
  const double part = 1e-14;
  if (fabs(b[2] - a[2]) * step > part * fabs(a[1])) return 0;
  for (int j = 0; j < MOST; j++)
    if (j != 2 && fabs(b[j] - a[j]) > part * fabs(a[j])) return 0;
  return 1;
}

/* six parameters, numbers of the law, state (changed); edges: positions in steps (rising) and
 * voltages before the first one and after each; displacement and current at the ends of the steps,
 * before an edge there */
void stack_advance(int kind, int place, int n, const double *six, const double *a, double *y,
                   long count, int sub, double step, long edges, const double *at,
                   const double *volts, double *x, double *i) {
  Plant p = {six[0], six[1], six[2], six[3], six[4], six[5], kind, place, n, a};
  long e = 0;
  double u = volts[0], before[MOST];
  for (long k = 0; k < count; k++) {
    double from = k;
    while (e < edges && at[e] <= from) u = volts[++e];
    long next = e < edges ? (long)floor(at[e]) : count;
    for (int j = 0; j < MOST; j++) before[j] = y[j];
    while (from < k + 1) {
      while (e < edges && at[e] <= from) u = volts[++e];
      double to = e < edges && at[e] < k + 1 ? at[e] : k + 1;
      int pieces = (int)ceil((to - from) * sub - 1e-9);
      if (pieces < 1) pieces = 1;
      for (int s = 0; s < pieces; s++) go(&p, y, (to - from) * step / pieces, u);
      from = to;
    }
    x[k] = y[1];
    i[k] = current(&p, y, u);
    if (next > k && rests(before, y, step)) {
      /* nothing more than rounding moves until the next edge; what it did is taken back, so that
       * the answer does not depend on where a record was cut */
      for (int j = 0; j < MOST; j++) y[j] = before[j];
      for (double held = current(&p, y, u); k < next; k++) { x[k] = y[1]; i[k] = held; }
      k--;
    }
  }
}

/* lags in parallel: z_j' = (ratio_j u - z_j) / tau_j, exact for u constant in a step; out = u + sum */
void creep_advance(int n, const double *ratio, const double *decay, double *z, long count,
                   const double *u, double *out) {
  for (long k = 0; k < count; k++) {
    double sum = u[k];
    for (int j = 0; j < n; j++) {
      z[j] = ratio[j] * u[k] + (z[j] - ratio[j] * u[k]) * decay[j];
      sum += z[j];
    }
    out[k] = sum;
  }
}
