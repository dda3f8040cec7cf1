
/* Every function that solves equations returns @_OK or @_NO_CONVERGENCE and then leaves its
 * results untouched. Everything is in SI units; t is the time since the start, s. x, z, u, p, m
 * are arrays in the order of the enumerations below; h is the time since the memory m was advanced,
 * s. z holds a guess for the algebraic unknowns before and the solution after a call; it may be
 * NULL if there are none. */
enum { @_OK = 0, @_NO_CONVERGENCE = 1 };

/* Fill the values to start from; any pointer may be NULL. */
void @_start(double *x, double *z, double *p, double *m);

/* Solve the algebraic unknowns. */
int @_unknowns(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z);

/* dx/dt. */
int @_rates(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z, double *dx);

/* Outputs. */
int @_outputs(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z, double *y);

/* Memory after a step that ended here, h after m, has been accepted; m_next may be m. */
int @_advance(double t, const double *x, const double *u, const double *p, const double *m,
    double h, double *z, double *m_next);

/* One step of h seconds: an L-stable third-order implicit method (R. Alexander, SIAM J. Numer.
 * Anal. 14 (1977) 1006); the inputs run straight from u0 to u1. x, z and then m are replaced if
 * the step is accepted; otherwise try a smaller h. A step should end at every turning point of
 * an input. */
int @_step(double t, double h, const double *u0, const double *u1, const double *p, double *x,
    double *z, double *m);
