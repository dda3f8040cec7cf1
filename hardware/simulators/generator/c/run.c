/* Classical Runge-Kutta method with fixed sub-steps; a controller that samples; a fine record. */
#include "laws.h"
#include "plants.h"

typedef struct { const double *u; long n; int hold; double dt; } Input;

static double input(const Input *in, double t) {
  double r = t / in->dt;
  if (r < -1e-9) return 0;
  long k = (long)floor(r + 1e-9);
  if (k >= in->n - 1) return in->u[in->n - 1];
  if (!in->hold) return in->u[k];
  double w = r - k;
  return in->u[k] * (1 - w) + in->u[k + 1] * w;
}

static double drive(Sim *s, const Input *in) {
  double t = s->t;
  for (int i = 0; i < s->ne; i++) if (s->e[i].kind == 90) t -= s->e[i].p[0];
  double u = input(in, t);
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    const double *p = e->p;
    if (e->slot != 100) continue;
    double r = fabs(u) / p[0], h = fmax(s->t - e->when, 0);
    switch (e->kind) {
    case 91: u = clip(u, -p[0], p[0]); break;
    case 92: u /= pow(1 + pow(r, p[1]), 1 / p[1]); break;
    case 93: u = p[0] * tanh(u / p[0]); break;
    case 94: u = u > p[0] ? u - p[0] : u < -p[1] ? u + p[1] : 0; break;
    case 95: s->dx[e->z] = (u - s->x[e->z]) / p[0]; u = s->x[e->z]; break;
    case 96: /* two equal lags */
      s->dx[e->z] = (u - s->x[e->z]) / p[0];
      s->dx[e->z + 1] = (s->x[e->z] - s->x[e->z + 1]) / p[0];
      u = s->x[e->z + 1];
      break;
    case 97: { /* rates p[0] up, p[1] down */
      double v = e->mem[0] + clip(u - e->mem[0], -p[1] * h, p[0] * h);
      if (s->commit) e->mem[0] = v;
      u = v;
      break;
    }
    case 98: u *= dice((long)floor(s->t / p[1]), p[2]) > 0.8 ? 1 - p[0] : 1; break;
    case 99: /* gain that follows the energy given out */
      s->dx[e->z] = (u * u / p[1] - s->x[e->z]) / p[2];
      u /= 1 + p[0] * s->x[e->z];
      break;
    case 105: { /* amplifier: slew p[2], then second order with rate p[0] and damping p[1] */
      double v = e->mem[0] + clip(u - e->mem[0], -p[2] * h, p[2] * h);
      if (s->commit) e->mem[0] = v;
      s->dx[e->z] = s->x[e->z + 1];
      s->dx[e->z + 1] = p[0] * p[0] * (v - s->x[e->z]) - 2 * p[1] * p[0] * s->x[e->z + 1];
      u = s->x[e->z];
      break;
    }
    case 101: { /* spool that sticks; it lets go at random differences */
      double held = e->mem[0], need = p[0] * (0.2 + 1.6 * dice((long)e->mem[1], p[1]));
      double v = fabs(u - held) > need ? u : held;
      if (s->commit && v != held) { e->mem[0] = v; e->mem[1] += 1; }
      u = v;
      break;
    }
    case 102: u = u - p[0] * u / sqrt(1 + u * u / p[0] / p[0]); break;
    case 106: u = p[0] * atan(u / p[0]); break;
    case 103: u *= vary(s, 100, 1); break;
    case 104: { /* gain error that depends on how fast the command moves */
      s->dx[e->z] = (u - s->x[e->z]) / p[1];
      double fast = (u - s->x[e->z]) / p[2];
      u /= 1 + p[0] * fast * fast;
      break;
    }
    }
    if (s->commit) e->when = s->t;
  }
  return u;
}

static void slope(int plant, Sim *s, const double *c, const Input *in, double t, const double *x,
                  double *dx) {
  s->t = t; s->x = x; s->dx = dx;
  PLANT[plant](s, c, drive(s, in));
}

/* loop: on, sensor, proportional, integral, differential gain; effects: rows of 13 numbers
 * (kind, slot, own states, p[10]); u: reference, then the applied command; seen: rms and largest
 * displacement and flow of each slot; returns the number of samples done */
long simulate(int plant, const double *c, int ne, const double *effects, const double *loop,
              const double *noise, long n, double dt, int sub, int over, int hold, double *u,
              double *y, double *seen) {
  Sim s;
  double x[MAX_STATES] = {0}, k1[MAX_STATES] = {0}, k2[MAX_STATES], k3[MAX_STATES];
  double k4[MAX_STATES], w[MAX_STATES], sum = 0, last = 0;
  int ns = STATES[plant], ny = SENSORS[plant];
  memset(&s, 0, sizeof s);
  memset(k2, 0, sizeof k2); memset(k3, 0, sizeof k3); memset(k4, 0, sizeof k4);
  memset(seen, 0, sizeof(double) * MAX_SLOTS * 4);
  s.ne = ne; s.span = n * dt;
  for (int i = 0; i < ne; i++) {
    const double *r = effects + 13 * i;
    s.e[i].kind = (int)r[0]; s.e[i].slot = (int)r[1]; s.e[i].z = ns; ns += (int)r[2];
    memcpy(s.e[i].p, r + 3, sizeof s.e[i].p);
  }
  Input in = {u, n, hold, dt};
  double h = dt / (sub * over);
  for (long k = 0; k < n; k++) {
    if (loop[0] > 0) {
      double now[3];
      in.n = k + 1;
      slope(plant, &s, c, &in, k * dt, x, k1);
      read_out(plant, &s, x, now);
      double err = now[(int)loop[1]] + noise[k];
      sum += err * dt;
      u[k] -= loop[2] * err + loop[3] * sum + loop[4] * (k ? (err - last) / dt : 0);
      last = err;
      in.n = k + 2 > n ? n : k + 2;
    }
    for (int o = 0; o < over; o++) {
      for (int m = 0; m < sub; m++) {
        double t = k * dt + (o * sub + m) * h, end = t + h * (1 - 1e-5);
        if (m == 0) {
          /* converters read before the command changes */
          slope(plant, &s, c, &in, !hold && k && !o ? t - 1e-6 * dt : t, x, k1);
          read_out(plant, &s, x, y + (k * over + o) * ny);
        }
        s.commit = 1;
        slope(plant, &s, c, &in, t, x, k1);
        s.commit = 0;
        if (m == 0) {
          if (o == 0)
            for (int j = 0; j < MAX_SLOTS; j++)
              for (int a = 0; a < 2; a++) {
                double q = s.seen[j][a];
                seen[4 * j + 2 * a] += q * q / n;
                seen[4 * j + 2 * a + 1] = fmax(seen[4 * j + 2 * a + 1], fabs(q));
              }
        }
        for (int i = 0; i < ns; i++) w[i] = x[i] + h / 2 * k1[i];
        slope(plant, &s, c, &in, t + h / 2, w, k2);
        for (int i = 0; i < ns; i++) w[i] = x[i] + h / 2 * k2[i];
        slope(plant, &s, c, &in, t + h / 2, w, k3);
        for (int i = 0; i < ns; i++) w[i] = x[i] + h * k3[i];
        slope(plant, &s, c, &in, end, w, k4);
        for (int i = 0; i < ns; i++) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
        if (!(x[0] * x[0] < 1e30) || !(x[1] * x[1] < 1e30)) return k;
      }
    }
  }
  return n;
}
