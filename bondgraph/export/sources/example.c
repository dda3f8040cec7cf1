/* Reads lines "time input input ..." in SI units and writes "time output output ..." for each.
 * Usage: program [steps between two lines] [hold] < inputs > outputs
 * Inputs run straight from line to line, or stay as they are up to the next one with "hold".
 * Build: cc -std=c99 -O2 @.c @_example.c -lm */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "@.h"

static int read_row(double *t, double *u)
{
  int i;
  if (scanf("%lf", t) != 1) return 0;
  for (i = 0; i < @_N_INPUTS; i++)
    if (scanf("%lf", &u[i]) != 1) return 0;
  return 1;
}

int main(int argc, char **argv)
{
  const int steps = argc > 1 ? atoi(argv[1]) : 1;
  const int held = argc > 2 && strcmp(argv[2], "hold") == 0;
  double x[@_SIZE_X], z[@_SIZE_Z], p[@_SIZE_P], m[@_SIZE_M], y[@_SIZE_Y];
  double last[@_SIZE_U], next[@_SIZE_U], from[@_SIZE_U], to[@_SIZE_U], t, t_next, begin;
  int i, k, first = 1, status;
  @_start(x, z, p, m);
  if (steps < 1 || !read_row(&t, last)) {
    fprintf(stderr, "usage: %s [steps between two lines] [hold] < inputs > outputs\n"
                    "each line of inputs: time in s, then %d inputs in SI units; at least one line\n",
            argv[0], @_N_INPUTS);
    return 2;
  }
  begin = t; /* the model counts from its start */
  do {
    if (first) {
      /* the memory settles at the first sample before time runs */
      status = @_outputs(0.0, x, last, p, m, 0.0, z, y);
      if (status == @_OK) status = @_advance(0.0, x, last, p, m, 0.0, z, m);
      first = 0;
    } else {
      const double h = (t_next - t) / steps;
      status = @_OK;
      for (k = 0; k < steps && status == @_OK; k++) {
        double before[@_SIZE_M];
        for (i = 0; i < @_N_INPUTS; i++) {
          const double change = held ? 0.0 : next[i] - last[i];
          from[i] = last[i] + change * k / steps;
          to[i] = last[i] + change * (k + 1) / steps;
        }
        for (i = 0; i < @_N_MEMORY; i++) before[i] = m[i];
        status = @_step(t - begin + k * h, h, from, to, p, x, z, m);
        /* outputs belong to the memory before the step, h ago */
        if (status == @_OK)
          status = @_outputs(t - begin + (k + 1) * h, x, to, p, before, h, z, y);
      }
      t = t_next;
      for (i = 0; i < @_N_INPUTS; i++) last[i] = next[i];
    }
    if (status != @_OK) {
      fprintf(stderr, "no solution found at t = %g s; take more steps\n", t);
      return 1;
    }
    printf("%.17g", t);
    for (i = 0; i < @_N_OUTPUTS; i++) printf(" %.17g", y[i]);
    printf("\n");
  } while (read_row(&t_next, next));
  return 0;
}
