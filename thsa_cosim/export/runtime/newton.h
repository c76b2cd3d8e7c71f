/* newton.h - implicit equations of a model: Newton's method with exact Jacobians. */
#ifndef THSA_NEWTON_H
#define THSA_NEWTON_H

#include "model.h"

typedef struct {
    double t;
    const double *x, *u, *p, *d, *m;
    double *y; /* unknowns of all blocks */
} Point;

/* Residual f and its Jacobian (column-major, n by n; not filled where it is NULL) at the unknowns in at->y. */
typedef int (*Residual)(const Point *at, double *f, double *jacobian);

/* Solve for n unknowns y, a part of at->y; work holds n * (n + 4) doubles. Nonzero = no solution; y is then as before. */
int newton_solve(int n, double *y, Residual residual, const Point *at, double *work, int *pivot);

/* Solve matrix * X = b for several columns; both are overwritten. Nonzero = singular. */
int newton_linear(int n, int columns, double *matrix, double *b, int *pivot);

#endif
