/* Plays side by side, for loops over a record and for the steps of a graph alike. */

#if defined(__AVX512F__)
#define PLAYS 8
#elif defined(__AVX__)
#define PLAYS 4
#else
#define PLAYS 2
#endif
typedef double plays_t __attribute__((vector_size(8 * PLAYS), aligned(8), may_alias));
typedef long long which_t __attribute__((vector_size(8 * PLAYS), aligned(8), may_alias));

static inline plays_t chosen(which_t which, plays_t yes, plays_t no) {
  return (plays_t)(((which_t)yes & which) | ((which_t)no & ~which));
}

/* What lies at q in slots that reach from low to high now. */
static inline plays_t moved_plays(plays_t low, plays_t high, plays_t q) {
  for (int l = 0; l < PLAYS; ++l) {
    q[l] = q[l] < high[l] ? q[l] : high[l];
    q[l] = q[l] > low[l] ? q[l] : low[l];
  }
  return q;
}

/* 1 for what is taken up, -1 down, 0 for what rests, half of that for what is just touched. */
static inline plays_t taken_plays(plays_t low, plays_t high, plays_t q) {
  const plays_t none = {0}, half = none + 0.5, one = none + 1.0;
  return chosen(q < low, one, chosen(q <= low, half, none)) -
         chosen(q > high, one, chosen(q >= high, half, none));
}

/* Weighted plays, or less the input if stops is 1, at an input: their sum, its slope there (half for
   one that the input just touches) and what they are next. n is a multiple of eight, and what fills
   up has no weight. */
static inline void sum_of_plays(double at, long n, const double *restrict r,
                                const double *restrict w, const double *restrict y, double stops,
                                double *restrict next, double *sum, double *slope) {
  plays_t s = {0}, t = {0};
  for (long i = 0; i < n; i += PLAYS) {
    plays_t width = *(const plays_t *)(r + i), b = *(const plays_t *)(w + i);
    plays_t q = *(const plays_t *)(y + i), low = at - width, high = at + width;
    plays_t p = moved_plays(low, high, q);
    *(plays_t *)(next + i) = p;
    s += b * (p - stops * at);
    plays_t way = taken_plays(low, high, q);
    t += b * (chosen(way < 0.0, -way, way) - stops);
  }
  *sum = *slope = 0.0;
  for (int l = 0; l < PLAYS; ++l) {
    *sum += s[l];
    *slope += t[l];
  }
}
