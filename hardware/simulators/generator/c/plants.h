/* State equations of the plants, each by Newton's, Kirchhoff's and Pascal's laws.
 *
 * Slots are the places of the parameters in parameters.py; the source has slot 100. */

/* force of added things on an inertia at displacement x, speed v */
static double added(Sim *s, int slot, double x, double v) {
  double f = 0;
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    const double *p = e->p;
    if (e->slot != slot) continue;
    switch (e->kind) {
    case 70: f += p[0] * sin(p[1] * s->t + p[2]); break;
    case 71: f += s->t > p[1] && s->t < p[2] ? p[0] : 0; break;
    case 72: f += p[0] * sin(p[1] * x + p[2]); break;
    case 73: { /* mass p[0] on stiffness p[1], damping p[2]; p[3] cubic stiffness */
      double a = s->x[e->z], w = s->x[e->z + 1];
      double force = p[1] * a + p[3] * a * a * a + p[2] * (w - v);
      s->dx[e->z] = w - v;
      s->dx[e->z + 1] = -force / p[0];
      f += force;
      break;
    }
    case 75: f += p[0] * sin(p[1] * x + p[2]) * v * v; break;
    case 76: f += p[0] * (sin(p[1] * x + p[2]) + .5 * sin(3 * (p[1] * x + p[2]))); break;
    case 77: { /* filtered random bursts */
      double d = dice((long)floor(s->t / p[1]), p[2]);
      f += p[0] * (d > 0.8 ? sin(6.2831853 * s->t / p[1]) : 0);
      break;
    }
    }
  }
  return f;
}

/* acceleration; kind 74: mass m (1 + a x^2), Lagrange's equation of a point on a bent path; kind 78:
 * a pendulum of mass p[0], length p[1], rate p[2] and damping p[3] hangs on it, by Lagrange too */
static double accelerate(Sim *s, int slot, double m, double x, double v, double force) {
  s->seen[slot][0] = x; s->seen[slot][1] = v;
  force += added(s, slot, x, v);
  m = vary(s, slot, m);
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    if (e->slot != slot || e->kind != 74) continue;
    double a = e->p[0];
    force -= m * a * x * v * v;
    m *= 1 + a * x * x;
  }
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    if (e->slot != slot || e->kind != 78) continue;
    const double *p = e->p;
    double angle = s->x[e->z], rate = s->x[e->z + 1], sn = sin(angle), cs = cos(angle);
    double pull = p[1] * (p[2] * p[2] * sn + p[3] * rate);
    double a = (force + p[0] * (cs * pull + p[1] * rate * rate * sn)) / (m + p[0] * sn * sn);
    s->dx[e->z] = rate;
    s->dx[e->z + 1] = -(pull + a * cs) / p[1];
    return a;
  }
  return force / m;
}

/* ratio of a transformer or gyrator that depends on position or current a */
static double ratio(Sim *s, int slot, double n, double a) {
  s->seen[slot][0] = a;
  n = vary(s, slot, n);
  for (int i = 0; i < s->ne; i++) {
    Effect *e = &s->e[i];
    const double *p = e->p;
    if (e->slot != slot) continue;
    double r = a / p[1];
    if (e->kind == 80) n *= 1 + p[0] * r * (p[2] + r);
    if (e->kind == 81) n /= 1 + p[0] * r * r;
    if (e->kind == 82) n *= 1 - p[0] * r * r / (1 + r * r);
    if (e->kind == 83) { /* iron that answers late: square of the current through a lag */
      double z = s->x[e->z];
      s->dx[e->z] = (r * r - z) / p[2];
      n /= 1 + p[0] * z;
    }
  }
  return n;
}

static void chain(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx;
  double a = x[1] - x[0], b = x[2] - x[1], va = x[4] - x[3], vb = x[5] - x[4];
  double f1 = storage(s, 3, c[3], x[0], x[3], x[2]) + dissipate(s, 6, c[6], x[3], x[0], x[5]);
  double f2 = storage(s, 4, c[4], a, va, x[0]) + dissipate(s, 7, c[7], va, a, x[3]);
  double f3 = storage(s, 5, c[5], b, vb, x[0]) + dissipate(s, 8, c[8], vb, b, x[3]);
  d[0] = x[3]; d[1] = x[4]; d[2] = x[5];
  d[3] = accelerate(s, 0, c[0], x[0], x[3], u - f1 + f2);
  d[4] = accelerate(s, 1, c[1], x[1], x[4], f3 - f2);
  d[5] = accelerate(s, 2, c[2], x[2], x[5], -f3);
}

static void stack(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* charge, displacement, velocity */
  double v = storage(s, 1, 1 / c[1], x[0], d[0], x[1]);
  double i = conduct(s, 0, c[0], u - v, x[0], x[2]);
  double n = ratio(s, 2, c[2], x[1]);
  d[0] = i - n * x[2] - escape(s, 1, v);
  d[1] = x[2];
  double f = storage(s, 4, c[4], x[1], x[2], x[0]) + dissipate(s, 5, c[5], x[2], x[1], i);
  d[2] = accelerate(s, 3, c[3], x[1], x[2], n * v - f);
  s->seen[11][0] = i;
}

static void motor(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* current, speeds, angles, charge passed */
  double k = ratio(s, 2, c[2], x[0]);
  double twist = x[3] / c[5] - x[4], rate = x[1] / c[5] - x[2];
  double t = storage(s, 6, c[6], twist, rate, x[0]) + dissipate(s, 7, c[7], rate, twist, x[0]);
  d[0] = (u - dissipate(s, 0, c[0], x[0], x[5], x[1]) - k * x[1]) / c[1];
  double f1 = dissipate(s, 4, c[4], x[1], x[3], x[0]);
  double f2 = dissipate(s, 9, c[9], x[2], x[4], x[0]);
  d[1] = accelerate(s, 3, c[3], x[3], x[1], k * x[0] - f1 - t / c[5]);
  d[2] = accelerate(s, 8, c[8], x[4], x[2], t - f2);
  d[3] = x[1]; d[4] = x[2]; d[5] = x[0];
}

static void corner(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* tyre, stroke, v_u, v_b, positions */
  double vt = u - x[2], vs = x[2] - x[3];
  double ft = storage(s, 0, c[0], x[0], vt, x[1]) + dissipate(s, 1, c[1], vt, x[0], vs);
  double fs = storage(s, 3, c[3], x[1], vs, x[0]) + dissipate(s, 4, c[4], vs, x[1], vt);
  d[0] = vt; d[1] = vs;
  d[2] = accelerate(s, 2, c[2], x[4], x[2], ft - fs);
  d[3] = accelerate(s, 5, c[5], x[5], x[3], fs);
  d[4] = x[2]; d[5] = x[3];
}

static void tanks(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* volumes, volumes passed */
  double p1 = storage(s, 0, 1 / c[0], x[0], d[0], x[2]);
  double p2 = storage(s, 1, 1 / c[1], x[1], d[1], x[0]);
  double p3 = storage(s, 2, 1 / c[2], x[2], d[2], x[0]);
  double a = conduct(s, 3, c[3], p1 - p2, x[3], p3);
  double b = conduct(s, 4, c[4], p2 - p3, x[4], p1);
  double e = conduct(s, 5, c[5], p3, x[5], p1);
  d[0] = u + added(s, 0, x[0], 0) - a - escape(s, 0, p1);
  d[1] = a + added(s, 1, x[1], 0) - b - escape(s, 1, p2);
  d[2] = b + added(s, 2, x[2], 0) - e - escape(s, 2, p3);
  d[3] = a; d[4] = b; d[5] = e;
  s->seen[6][0] = p1; s->seen[7][0] = p2; s->seen[8][0] = p3;
}

static void probe(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* displacement, velocity, charge */
  double k = ratio(s, 3, c[3], x[0]);
  double e = storage(s, 5, 1 / c[5], x[2], d[2], x[0]);
  double i = conduct(s, 4, c[4], k * x[1] - e, x[2], x[1]);
  double f = storage(s, 1, c[1], x[0], x[1], x[2]) + dissipate(s, 2, c[2], x[1], x[0], i);
  d[0] = x[1];
  d[1] = accelerate(s, 0, c[0], x[0], x[1], u - f - k * i);
  d[2] = i - escape(s, 5, e);
  s->seen[11][0] = e;
}

static void cylinder(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* volume taken up by pressure, position, speed, leaked */
  double p = storage(s, 0, 1 / c[0], x[0], d[0], x[1]);
  double leak = conduct(s, 1, c[1], p, x[3], x[2]);
  double a = ratio(s, 2, c[2], x[1]);
  d[0] = u - a * x[2] - leak - escape(s, 0, p);
  d[1] = x[2];
  d[2] = accelerate(s, 3, c[3], x[1], x[2], a * p - dissipate(s, 4, c[4], x[2], x[1], leak));
  d[3] = leak;
  s->seen[11][0] = p;
}

static void servo(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* angles, speeds */
  double twist = x[0] - x[1], rate = x[2] - x[3];
  double t = storage(s, 2, c[2], twist, rate, x[0]) + dissipate(s, 3, c[3], rate, twist, x[2]);
  d[0] = x[2]; d[1] = x[3];
  d[2] = accelerate(s, 0, c[0], x[0], x[2], u - t - dissipate(s, 1, c[1], x[2], x[0], x[3]));
  d[3] = accelerate(s, 4, c[4], x[1], x[3], t - dissipate(s, 5, c[5], x[3], x[1], x[2]));
}

static void oven(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* heats, heats passed */
  double t1 = storage(s, 0, 1 / c[0], x[0], d[0], x[1]);
  double t2 = storage(s, 2, 1 / c[2], x[1], d[1], x[0]);
  double a = conduct(s, 1, c[1], t1 - t2, x[2], t2);
  double e = conduct(s, 3, c[3], t2, x[3], t1);
  d[0] = u + added(s, 0, x[0], 0) - a - escape(s, 0, t1);
  d[1] = a + added(s, 2, x[1], 0) - e - escape(s, 2, t2);
  d[2] = a; d[3] = e;
  s->seen[10][0] = t1; s->seen[11][0] = t2;
}

/* declared hardening of a spring: a newtons at a millimetre, by the third power */
static double hardening(double a, double q) { return a * 1e9 * q * q * q; }

static void frame(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* displacements, speeds */
  double a = x[1] - x[0], va = x[3] - x[2];
  double f1 = storage(s, 1, c[1], x[0], x[2], x[1]) + dissipate(s, 2, c[2], x[2], x[0], x[3]);
  double f2 = storage(s, 4, c[4], a, va, x[0]) + dissipate(s, 5, c[5], va, a, x[2]);
  d[0] = x[2]; d[1] = x[3];
  d[2] = accelerate(s, 0, c[0], x[0], x[2], u - f1 + f2);
  d[3] = accelerate(s, 3, c[3], x[1], x[3], -f2);
  s->seen[11][0] = f1;
}

static void press(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* displacements, speeds */
  double a = x[1] - x[0], va = x[3] - x[2];
  double f1 = storage(s, 1, c[1], x[0], x[2], x[1]) + dissipate(s, 3, c[3], x[2], x[0], x[3]);
  double f2 = storage(s, 5, c[5], a, va, x[0]) + dissipate(s, 6, c[6], va, a, x[2]);
  f1 += hardening(c[2], x[0]);
  d[0] = x[2]; d[1] = x[3];
  d[2] = accelerate(s, 0, c[0], x[0], x[2], u - f1 + f2);
  d[3] = accelerate(s, 4, c[4], x[1], x[3], -f2);
  s->seen[11][0] = f2;
}

static void table(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* current, displacements, speeds, charge passed */
  double k = ratio(s, 2, c[2], x[0]), a = x[1] - x[2], va = x[3] - x[4];
  double f = storage(s, 5, c[5], a, va, x[1]) + dissipate(s, 6, c[6], va, a, x[3]);
  d[0] = (u - dissipate(s, 0, c[0], x[0], x[5], x[3]) - k * x[3]) / c[1];
  d[1] = x[3]; d[2] = x[4]; d[5] = x[0];
  d[3] = accelerate(s, 3, c[3], x[1], x[3], k * x[0] - f - dissipate(s, 4, c[4], x[3], x[1], x[0]));
  d[4] = accelerate(s, 7, c[7], x[2], x[4], f - dissipate(s, 8, c[8], x[4], x[2], x[3]));
}

static void speaker(Sim *s, const double *c, double u) {
  const double *x = s->x; double *d = s->dx; /* current, cone, speed, air pressed in, passed: q, V */
  double k = ratio(s, 2, c[2], x[1]), area = ratio(s, 7, c[7], x[1]);
  double p = storage(s, 8, 1 / c[8], x[3], area * x[2], x[1]);
  double leak = conduct(s, 9, c[9], p, x[5], x[2]);
  double f = storage(s, 4, c[4], x[1], x[2], x[3]) + dissipate(s, 6, c[6], x[2], x[1], x[0]);
  f += hardening(c[5], x[1]);
  d[0] = (u - dissipate(s, 0, c[0], x[0], x[4], x[2]) - k * x[2]) / c[1];
  d[1] = x[2];
  d[2] = accelerate(s, 3, c[3], x[1], x[2], k * x[0] - f - area * p);
  d[3] = area * x[2] - leak - escape(s, 8, p);
  d[4] = x[0]; d[5] = leak;
  s->seen[11][0] = p;
}

typedef void (*Plant)(Sim *, const double *, double);
static const Plant PLANT[13] = {chain, stack, motor, corner, tanks, probe, cylinder, servo, oven,
                                frame, press, table, speaker};
static const int STATES[13] = {6, 3, 6, 6, 6, 3, 4, 4, 4, 4, 4, 6, 6};
static const int SENSORS[13] = {3, 2, 3, 3, 3, 2, 2, 2, 2, 3, 3, 3, 3};

static void read_out(int plant, const Sim *s, const double *x, double *y) {
  switch (plant) {
  case 0: y[0] = x[0]; y[1] = x[1]; y[2] = x[2]; break;
  case 1: y[0] = s->seen[11][0]; y[1] = x[1]; break;
  case 2: y[0] = x[0]; y[1] = x[1]; y[2] = x[2]; break;
  case 3: y[0] = x[2]; y[1] = x[3]; y[2] = x[1]; break;
  case 4: y[0] = s->seen[6][0]; y[1] = s->seen[7][0]; y[2] = s->seen[8][0]; break;
  case 5: y[0] = x[0]; y[1] = s->seen[11][0]; break;
  case 6: y[0] = s->seen[11][0]; y[1] = x[1]; break;
  case 7: y[0] = x[0]; y[1] = x[3]; break;
  case 8: y[0] = s->seen[10][0]; y[1] = s->seen[11][0]; break;
  case 9: y[0] = s->dx[2]; y[1] = s->dx[3]; y[2] = s->seen[11][0]; break;
  case 10: y[0] = x[0]; y[1] = s->dx[3]; y[2] = -s->seen[11][0]; break;
  case 11: y[0] = x[0]; y[1] = x[1]; y[2] = s->dx[4]; break;
  case 12: y[0] = x[0]; y[1] = s->dx[2]; y[2] = s->seen[11][0]; break;
  }
}
