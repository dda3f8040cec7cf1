/* Dense LU with scaled partial pivoting, columns one after the other. Returns 0 if singular. */
static int factor(int n, double* a, int* pivot, double* scale) {
  for (int i = 0; i < n; ++i) {
    scale[i] = 0.0;
    for (int j = 0; j < n; ++j) scale[i] = fmax(scale[i], fabs(a[i + j * n]));
    if (!(scale[i] > 0.0) || !isfinite(scale[i])) return 0;
  }
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i)
      if (fabs(a[i + k * n]) * scale[best] > fabs(a[best + k * n]) * scale[i]) best = i;
    pivot[k] = best;
    if (a[best + k * n] == 0.0 || !isfinite(a[best + k * n])) return 0;
    if (best != k) {
      double s = scale[k];
      scale[k] = scale[best];
      scale[best] = s;
      for (int j = 0; j < n; ++j) {
        double x = a[k + j * n];
        a[k + j * n] = a[best + j * n];
        a[best + j * n] = x;
      }
    }
    for (int i = k + 1; i < n; ++i) a[i + k * n] /= a[k + k * n];
    for (int j = k + 1; j < n; ++j)
      for (int i = k + 1; i < n; ++i) a[i + j * n] -= a[i + k * n] * a[k + j * n];
  }
  return 1;
}

static void solve(int n, const double* a, const int* pivot, double* b) {
  for (int k = 0; k < n; ++k) {
    double x = b[pivot[k]];
    b[pivot[k]] = b[k];
    b[k] = x;
  }
  for (int k = 0; k < n; ++k)
    for (int i = k + 1; i < n; ++i) b[i] -= a[i + k * n] * b[k];
  for (int k = n - 1; k >= 0; --k) {
    b[k] /= a[k + k * n];
    for (int i = 0; i < k; ++i) b[i] -= a[i + k * n] * b[k];
  }
}

static int all_finite(int n, const double* a) {
  for (int i = 0; i < n; ++i)
    if (!isfinite(a[i])) return 0;
  return 1;
}
