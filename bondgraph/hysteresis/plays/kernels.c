/* Loops over a record for banks of plays. Compiled for finite numbers: callers refuse NaN first. */

#define TILE (56 / PLAYS)
#define CHUNK 512

/* y += sum_j w[j] play_j[x]; r, w and state hold a whole number of tiles of 56. The tile's states stay
   in registers over a chunk; lanes are added at its end, so no sum waits for another one. */
void play_bank(const double *restrict x, long n, const double *restrict r,
               const double *restrict w, long tiles, double *restrict state,
               double *restrict y) {
  plays_t lanes[CHUNK];
  for (long first = 0; first < n; first += CHUNK) {
    long m = n - first < CHUNK ? n - first : CHUNK;
    for (long k = 0; k < m; ++k) lanes[k] = (plays_t){0};
    for (long t = 0; t < tiles; ++t) {
      const plays_t *width = (const plays_t *)r + t * TILE, *weight = (const plays_t *)w + t * TILE;
      plays_t p[TILE], a[TILE], b[TILE], *kept = (plays_t *)state + t * TILE;
      for (int v = 0; v < TILE; ++v) {
        p[v] = kept[v];
        a[v] = width[v];
        b[v] = weight[v];
      }
      for (long k = 0; k < m; ++k) {
        double at = x[first + k];
        plays_t sum = lanes[k];
        for (int v = 0; v < TILE; ++v) {
          p[v] = moved_plays(at - a[v], at + a[v], p[v]);
          sum += b[v] * p[v];
        }
        lanes[k] = sum;
      }
      for (int v = 0; v < TILE; ++v) kept[v] = p[v];
    }
    for (long k = 0; k < m; ++k) {
      double total = 0.0;
      for (int l = 0; l < PLAYS; ++l) total += lanes[k][l];
      y[first + k] += total;
    }
  }
}

/* The states themselves, row k of out after sample k; r and state hold a whole number of eights. */
void play_states(const double *restrict x, long n, const double *restrict r, long m,
                 double *restrict state, double *restrict out) {
  for (long k = 0; k < n; ++k) {
    double at = x[k];
    for (long j = 0; j < m; j += PLAYS) {
      plays_t a = *(const plays_t *)(r + j), *q = (plays_t *)(state + j);
      *q = moved_plays(at - a, at + a, *q);
    }
    for (long j = 0; j < m; ++j) out[k * m + j] = state[j];
  }
}

/* Turning points: the bank's output is a fixed curve of the distance to the last turning point that
   no later swing wiped out. E holds those points, outermost first, then the present input; Y the
   outputs there; direction is that of the first. The curve has knots (2 r_i, value_i) and slopes;
   start[b] is the first knot of the b-th of equal bins. Returns the depth; kept is the number of
   points that were there before and still are. */
long turning_point_record(const double *restrict x, long n, const double *restrict knot,
                          const double *restrict value, const double *restrict slope, long n_knots,
                          const int *restrict start, double per_bin, long n_bins,
                          double *restrict E, double *restrict Y, long depth, double direction,
                          long *kept, double *restrict y) {
  long top = depth - 1, old = depth;
  double now = E[top], d = top % 2 ? -direction : direction, output = Y[top];
  /* noise turns at random: where it does is computed, not branched upon */
  for (long k = 0; k < n; ++k) {
    double next = x[k];
    int turns = (next - now) * d < 0.0;
    Y[top] = output;
    top += turns;
    d = turns ? -d : d;
    while (top >= 2 && (next - E[top - 2]) * d >= 0.0) top -= 2;
    if (top == 0) {
      output = Y[0] + slope[n_knots - 1] * (next - E[0]);
    } else {
      double s = (next - E[top - 1]) * d, bin = s * per_bin;
      long b = bin < (double)n_bins ? (long)bin : n_bins;
      long low = start[b], high = start[b + 1];
      while (low + 1 < high) {
        long middle = (low + high + 1) / 2;
        if (knot[middle] <= s) low = middle; else high = middle - 1;
      }
      long i = low + ((low < high) & (knot[high] <= s));
      output = Y[top - 1] + d * (value[i] + slope[i] * (s - knot[i]));
    }
    E[top] = now = next;
    old = top < old ? top : old;
    y[k] = output;
  }
  Y[top] = output;
  *kept = old;
  return top + 1;
}
