
typedef const double* in;
static void call(int (*f)(in*, double**, casadi_int*, double*, int), in x, in m, in h, in p,
                 double* y, double* next, in* arg, double** res, casadi_int* iw, double* w) {
  arg[0] = x; arg[1] = m; arg[2] = h; arg[3] = p; res[0] = y; res[1] = next;
  f(arg, res, iw, w, 0);
}

void forwards(in x, casadi_int n, casadi_int n_m, double* m, double* spare, in h, in p, double* y,
              casadi_int* iw, double* w, in* arg, double** res) {
  for (casadi_int k = 0; k < n; ++k) {
    call(operator_step, x + k, m, h, p, y + k, spare, arg, res, iw, w);
    for (casadi_int i = 0; i < n_m; ++i) m[i] = spare[i];
  }
}

/* Bracket by doubling from the last input, then regula falsi (Illinois) kept honest by bisection.
   Returns the first sample that no input reaches, or n. */
casadi_int backwards(in y, casadi_int n, casadi_int n_m, double* m, double* spare, in h, in p,
                     double start, double first, double tolerance, double* x,
                     casadi_int* iw, double* w, in* arg, double** res) {
  double last = start;
  for (casadi_int k = 0; k < n; ++k) {
    double a = last, fa, b, fb, t, ft, reach = first;
    call(operator_step, &a, m, h, p, &fa, spare, arg, res, iw, w);
    fa -= y[k];
    double up = fa < 0 ? 1.0 : -1.0;
    b = a; fb = fa;
    int tries = 0;
    while (fa * fb > 0 && tries++ < 45) {
      a = b; fa = fb;
      b = last + up * reach; reach *= 2;
      call(operator_step, &b, m, h, p, &fb, spare, arg, res, iw, w);
      fb -= y[k];
      if (!(fb == fb) || b - b != 0) return k;
    }
    if (fa * fb > 0) return k;
    int side = 0;
    for (int i = 0; i < 300; ++i) {
      double wide = b > a ? b - a : a - b;
      double size = (a < 0 ? -a : a) + (b < 0 ? -b : b);
      if (fa == 0 || fb == 0 || wide <= tolerance || wide <= 4.5e-16 * size) break;
      t = fb - fa != 0 ? b - fb * (b - a) / (fb - fa) : 0.5 * (a + b);
      if (i % 3 == 2 || !((t > a && t < b) || (t > b && t < a))) t = 0.5 * (a + b);
      if (t == a || t == b) break;
      call(operator_step, &t, m, h, p, &ft, spare, arg, res, iw, w);
      ft -= y[k];
      if (ft * fb > 0) { b = t; fb = ft; if (side == -1) fa *= 0.5; side = -1; }
      else { a = t; fa = ft; if (side == 1) fb *= 0.5; side = 1; }
    }
    if (fa == 0) last = a;
    else if (fb == 0) last = b;
    else last = fb - fa != 0 ? b - fb * (b - a) / (fb - fa) : b;
    x[k] = last;
    call(operator_step, &last, m, h, p, &ft, spare, arg, res, iw, w);
    for (casadi_int i = 0; i < n_m; ++i) m[i] = spare[i];
  }
  return n;
}
