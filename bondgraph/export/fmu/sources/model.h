/* An instance of the model: its numbers, and the work space of its equations.
   Sizes: N_X states, N_Z algebraic unknowns, N_V = N_X + N_Z, N_U inputs, N_P parameters,
   N_M memory, N_Y outputs, N_S arguments of laws with memory, N_E event
   indicators, N_T of them turns of those arguments. */
#ifndef MODEL_H
#define MODEL_H

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sizes.h"
#include "equations.c"

#define N_V (N_X + N_Z)
#define N_STAGES 3
#define N_ALL (N_STAGES * N_V)

/* Value references: one block for each kind, in this order. */
#define AT_TIME 0
#define AT_U 1
#define AT_Y (AT_U + N_U)
#define AT_P (AT_Y + N_Y)
#define AT_X (AT_P + N_P)
#define AT_DX (AT_X + N_X)
#define AT_Z (AT_DX + N_X)
#define AT_M (AT_Z + N_Z)
#define AT_OPTION (AT_M + N_M)
#define AT_EVENT (AT_OPTION + 2)
#define AT_END (AT_EVENT + N_E)

/* Everything that distinguishes one moment of an instance from another: copied as a whole. */
typedef struct {
  double time, memory_time, slope_time, step;
  double largest_step, tolerance; /* the two options, in the order of their references */
  double u[N_U + 1], slope[N_U + 1], p[N_P + 1];
  double v[N_V + 1]; /* x, then z */
  double m[N_M + 1];
  double v_size[N_V + 1], m_size[N_M + 1], s_size[N_S + 1], turn_size[N_S + 1];
  int direction[N_S + 1];
  int sloped[N_U + 1];
  int mode, jumped;
} Numbers;

typedef struct {
  Numbers now;
  int fresh; /* whether fg and y belong to `now` */
  double fg[N_V + 1], y[N_Y + 1];
  double jacobian[N_STAGES][N_V * N_V + 1], noise[N_STAGES][N_V + 1];
  double stage[N_STAGES][N_V + 1], rate[N_STAGES][N_V + 1];
  double matrix[N_ALL * N_ALL + 1], right[N_ALL + 1], scale[N_ALL + 1];
  double known[N_STAGES][N_V * N_V + 1], known_step; /* what `matrix` was factored from */
  int pivot[N_ALL + 1];
  double small[N_V * N_V + 1], small_scale[N_V + 1];
  int small_pivot[N_V + 1];
  const double* arg[SZ_ARG + 1];
  double* res[SZ_RES + 1];
  long long iw[SZ_IW + 1];
  double w[SZ_W + 1];
  const char* trouble;
} Model;

typedef int Equation(const double**, double**, long long*, double*, int);

#endif
