/* The filter over a record: values and one tangent after the other, in one call.

   For a linear model the covariance does not depend on the data: once it and its tangents stand
   still, only the means run on. A sample with a missing reading takes the long way. */

#include <math.h>
#include <string.h>

typedef struct {
  long long n_samples, n_sub, n_u, n_y, n_x, n_p, n_roots, n_z, n_m, n_d;
} Sizes;

/* how far the gain has settled: quiet samples so far, settled now, settled first */
typedef struct {
  long long quiet, settled, settled_at;
} Progress;

static int still(const double* now, const double* last, const double* p, long long n,
                 double own) {
  long long i, j, k = 0;
  for (j = 0; j < n; ++j) {
    for (i = j; i < n; ++i, ++k) {
      /* the diagonal of a packed lower triangle */
      double pi = p[i * n - i * (i - 1) / 2], pj = p[j * n - j * (j - 1) / 2];
      double size = sqrt(fabs(pi * pj)) + own * fabs(now[k]);
      if (!(fabs(now[k] - last[k]) <= 1e-12 * size + 1e-28)) return 0;
    }
  }
  return 1;
}

/* u: (n_samples * n_sub, 2, n_u), the first n_sub rows unused; y, mask: (n_samples, n_y)
   z, dz: twice as long as one state (old and new); m0, dm0: a step of no length
   out: (n_samples, 3 n_y + n_x): reading, innovation, variance, filtered mean
   tangents: (n_samples, n_d, 2 n_y): innovation, variance */
long long filter_record(const Sizes* s, const double* u, const double* y, const double* mask,
                        double* z, double* dz, const double* m, const double* dm,
                        const double* m0, const double* dm0, double* room, double* out,
                        double* tangents, long long* iw, double* w, const double** arg,
                        double** res) {
  const long long n_x = s->n_x, n_y = s->n_y, n_z = s->n_z, n_d = s->n_d, n_g = n_x * n_y;
  const double h = m[BONDSIGHT_STEP_AT];
  double *roots = room, *last = roots + s->n_roots, *dlast = last + s->n_p,
         *gain = dlast + n_d * s->n_p, *dgain = gain + n_g, *part = dgain + n_d * n_g,
         *variance = part + 3 * n_y, *dvariance = variance + n_y;
  double *new = z + n_z, *dnew = dz + n_d * n_z;
  Progress progress = {0, 0, -1};
  long long k, j, d, i;
  for (k = 0; k < s->n_samples; ++k) {
    const double *ym = y + k * n_y, *mm = mask + k * n_y, *us = u + k * s->n_sub * 2 * s->n_u;
    const double* end = us + (2 * s->n_sub - 1) * s->n_u;
    double *o = out + k * (3 * n_y + n_x), *t = tangents + k * n_d * 2 * n_y;
    int settled = progress.settled;
    for (i = 0; i < n_y; ++i) settled = settled && mm[i] == 1.0;
    progress.settled = settled; /* after a gap the gain has to settle again */
#if BONDSIGHT_LINEAR
    if (settled) {
      for (j = 0; j < s->n_sub; ++j, us += 2 * s->n_u) {
        for (d = 0; d < n_d; ++d) {
          arg[0] = z; arg[1] = us; arg[2] = us + s->n_u; arg[3] = m;
          arg[4] = dz + d * n_z; arg[5] = dm + d * s->n_m;
          res[0] = dnew;
          bondsight_drift_t(arg, res, iw, w, 0);
          memcpy(dz + d * n_z, dnew, n_x * sizeof(double));
        }
        arg[0] = z; arg[1] = us; arg[2] = us + s->n_u; arg[3] = m;
        res[0] = new;
        bondsight_drift(arg, res, iw, w, 0);
        memcpy(z, new, n_x * sizeof(double));
      }
      for (d = 0; d < n_d; ++d) {
        arg[0] = z; arg[1] = gain; arg[2] = ym; arg[3] = end; arg[4] = m;
        arg[5] = dz + d * n_z; arg[6] = dgain + d * n_g; arg[7] = dm + d * s->n_m;
        res[0] = dnew; res[1] = part;
        bondsight_correct_t(arg, res, iw, w, 0);
        memcpy(dz + d * n_z, dnew, n_x * sizeof(double));
        memcpy(t + d * 2 * n_y, part + n_y, n_y * sizeof(double));
        memcpy(t + d * 2 * n_y + n_y, dvariance + d * n_y, n_y * sizeof(double));
      }
      arg[0] = z; arg[1] = gain; arg[2] = ym; arg[3] = end; arg[4] = m;
      res[0] = new; res[1] = o;
      bondsight_correct(arg, res, iw, w, 0);
      memcpy(z, new, n_x * sizeof(double));
      memcpy(o + 2 * n_y, variance, n_y * sizeof(double));
      memcpy(o + 3 * n_y, z, n_x * sizeof(double));
      continue;
    }
#endif
    for (j = 0; j < (k ? s->n_sub : 1); ++j, us += 2 * s->n_u) {
      const double *a = k ? us : end, *b = k ? us + s->n_u : end;
      const double *mk = k ? m : m0, *dmk = k ? dm : dm0;
      /* the memory given belongs to the first sample: no time has passed */
      double elapsed = k > 1 || (k == 1 && j > 0) ? h : 0.0;
#if !BONDSIGHT_LINEAR
      arg[0] = z; arg[1] = a; arg[2] = b; arg[3] = mk; arg[4] = &elapsed;
      res[0] = roots;
      bondsight_roots(arg, res, iw, w, 0);
#endif
      for (d = 0; d < n_d; ++d) {
        arg[0] = z; arg[1] = roots; arg[2] = a; arg[3] = b; arg[4] = mk; arg[5] = &elapsed;
        arg[6] = dz + d * n_z; arg[7] = dmk + d * s->n_m;
        res[0] = dnew + d * n_z;
        bondsight_predict_t(arg, res, iw, w, 0);
      }
      arg[0] = z; arg[1] = roots; arg[2] = a; arg[3] = b; arg[4] = mk; arg[5] = &elapsed;
      res[0] = new;
      bondsight_predict(arg, res, iw, w, 0);
      memcpy(z, new, n_z * sizeof(double));
      memcpy(dz, dnew, n_d * n_z * sizeof(double));
    }
    for (d = 0; d < n_d; ++d) {
      arg[0] = z; arg[1] = ym; arg[2] = mm; arg[3] = end; arg[4] = m;
      arg[5] = dz + d * n_z; arg[6] = dm + d * s->n_m;
      res[0] = dnew + d * n_z; res[1] = part; res[2] = dgain + d * n_g;
      bondsight_update_t(arg, res, iw, w, 0);
      memcpy(t + d * 2 * n_y, part + n_y, 2 * n_y * sizeof(double));
      memcpy(dvariance + d * n_y, part + 2 * n_y, n_y * sizeof(double));
    }
    arg[0] = z; arg[1] = ym; arg[2] = mm; arg[3] = end; arg[4] = m;
    res[0] = new; res[1] = o; res[2] = gain;
    bondsight_update(arg, res, iw, w, 0);
    memcpy(variance, o + 2 * n_y, n_y * sizeof(double));
    memcpy(o + 3 * n_y, new, n_x * sizeof(double));
    memcpy(z, new, n_z * sizeof(double));
    memcpy(dz, dnew, n_d * n_z * sizeof(double));
#if BONDSIGHT_LINEAR
    {
      const double* p = z + n_x;
      int quiet = k > 0 && still(p, last, p, n_x, 0.0);
      for (i = 0; i < n_y; ++i) quiet = quiet && mm[i] == 1.0;
      for (d = 0; quiet && d < n_d; ++d)
        quiet = still(dz + d * n_z + n_x, dlast + d * s->n_p, p, n_x, 1.0);
      progress.quiet = quiet ? progress.quiet + 1 : 0;
      progress.settled = progress.quiet >= 5;
      if (progress.settled && progress.settled_at < 0) progress.settled_at = k;
      memcpy(last, p, s->n_p * sizeof(double));
      for (d = 0; d < n_d; ++d)
        memcpy(dlast + d * s->n_p, dz + d * n_z + n_x, s->n_p * sizeof(double));
    }
#endif
  }
  return progress.settled_at;
}
