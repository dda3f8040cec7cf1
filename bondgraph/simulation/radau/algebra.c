/* Small dense systems and sparse products for the general kernel. */

#define LARGER(x, y) ((x) > (y) ? (x) : (y))
#define SMALL static inline __attribute__((always_inline))

/* LU with partial pivoting; rows compete at the scale they have once columns are of equal size. */
SMALL int factor(double* a, casadi_int* order, double* weight, double* column, int n) {
  int i, j, k;
  for (i = 0; i < n; ++i) {
    double most = 0.0;
    for (j = 0; j < n; ++j) most = LARGER(most, fabs(a[i * n + j]));
    weight[i] = most > 0.0 ? 1.0 / most : 0.0;
  }
  for (j = 0; j < n; ++j) {
    double most = 0.0;
    for (i = 0; i < n; ++i) most = LARGER(most, weight[i] * fabs(a[i * n + j]));
    if (!(most > 0.0)) return 0;
    column[j] = 1.0 / most;
  }
  for (i = 0; i < n; ++i) {
    double most = 0.0;
    for (j = 0; j < n; ++j) most = LARGER(most, column[j] * fabs(a[i * n + j]));
    if (!(most > 0.0) || !(most < 1e300)) return 0;
    weight[i] = 1.0 / most;
    order[i] = i;
  }
  for (k = 0; k < n; ++k) {
    double most = -1.0;
    int at = k;
    for (i = k; i < n; ++i) {
      double size = weight[i] * fabs(a[i * n + k]);
      if (size > most) { most = size; at = i; }
    }
    if (!(most > 0.0)) return 0;
    if (at != k) {
      casadi_int o = order[k];
      double s = weight[k];
      order[k] = order[at]; order[at] = o;
      weight[k] = weight[at]; weight[at] = s;
      for (j = 0; j < n; ++j) {
        s = a[k * n + j]; a[k * n + j] = a[at * n + j]; a[at * n + j] = s;
      }
    }
    double one = 1.0 / a[k * n + k];
    a[k * n + k] = one;
    for (i = k + 1; i < n; ++i) {
      double s = a[i * n + k] * one;
      a[i * n + k] = s;
      if (s != 0.0) for (j = k + 1; j < n; ++j) a[i * n + j] -= s * a[k * n + j];
    }
  }
  return 1;
}

/* Solve for the columns of b, shape (n, width) by rows; y of the same shape is overwritten. */
SMALL void backsolve(const double* a, const casadi_int* order, const double* b, double* y,
                             int n, casadi_int width) {
  int i, j;
  casadi_int d;
  for (i = 0; i < n; ++i) {
    double* yi = y + i * width;
    const double* bi = b + order[i] * width;
    for (d = 0; d < width; ++d) yi[d] = bi[d];
    for (j = 0; j < i; ++j) {
      double s = a[i * n + j];
      const double* yj = y + j * width;
      if (s != 0.0) for (d = 0; d < width; ++d) yi[d] -= s * yj[d];
    }
  }
  for (i = n - 1; i >= 0; --i) {
    double* yi = y + i * width;
    for (j = i + 1; j < n; ++j) {
      double s = a[i * n + j];
      const double* yj = y + j * width;
      if (s != 0.0) for (d = 0; d < width; ++d) yi[d] -= s * yj[d];
    }
    double s = a[i * n + i];
    for (d = 0; d < width; ++d) yi[d] *= s;
  }
}

/* out += sign * J t, J sparse by columns, t and out by rows of the given width */
static void times(const double* nz, const casadi_int* colind, const casadi_int* row,
                  casadi_int columns, const double* t, double* out, casadi_int width,
                  casadi_int flip) {
  casadi_int c, k, d;
  for (c = 0; c < columns; ++c)
    for (k = colind[c]; k < colind[c + 1]; ++k) {
      double s = row[k] >= flip ? -nz[k] : nz[k], *o = out + row[k] * width;
      const double* tc = t + c * width;
      if (s != 0.0) for (d = 0; d < width; ++d) o[d] += s * tc[d];
    }
}
