/* Drains values of `siosifm` in one call: the loop of a program without its overhead.
 *
 * Order of the auxiliary columns: cosine, sine, norm, clock, sample; a null pointer leaves one out.
 * With `recent` the values are read by age, from `oldest` down, and stay in the buffer.
 * Returns the number of values read; *code holds the negative answer that ended it, or 0.
 */
#include <stdint.h>

typedef int32_t (*values_t)(int32_t);
typedef int32_t (*recent_t)(int32_t, int32_t);
typedef double (*length_t)(int32_t, int32_t);
typedef int32_t (*aux_t)(int32_t, int32_t, int32_t);
typedef uint32_t (*status_t)(int32_t, int32_t);

int32_t pump(values_t values, recent_t recent, length_t length, aux_t aux, status_t status,
             int32_t device, int32_t channel, int32_t oldest, int32_t count,
             double *x, uint32_t *state, int32_t **columns, int32_t *code)
{
    static const int32_t kinds[5] = {1, 2, 3, 5, 6};
    *code = 0;
    for (int32_t k = 0; k < count; k++) {
        int32_t answer = recent ? recent(device, oldest - k) : values(device);
        if (answer < 0) {
            *code = answer;
            return k;
        }
        x[k] = length(device, channel);
        state[k] = status(device, channel);
        for (int c = 0; c < 5; c++)
            if (columns[c]) columns[c][k] = aux(device, channel, kinds[c]);
    }
    return count;
}
