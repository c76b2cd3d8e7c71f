/* solver.h - one Rosenbrock-Wanner step with dense output (solver.c) and the stepping loop with events (advance.c). */
#ifndef THSA_SOLVER_H
#define THSA_SOLVER_H

#include "instance.h"

int solver_linearize(Instance *c);             /* c->dx and the Jacobian at the present point; 0 = done */
double solver_step(Instance *c, double h);     /* c->x_new at time + h; scaled error, or -1 if not computable */
void solver_inputs(const Instance *c, double h, double *u);  /* inputs at time + h */
void solver_dense_middle(const Instance *c, double *x);      /* states at time + h/2 of the last solver_step */
void solver_dense_prepare(Instance *c);        /* before solver_dense; the stages are gone then */
void solver_dense(const Instance *c, double theta, double *x);  /* states at time + theta*h */
double solver_tolerance(const Instance *c);    /* tolerance that the step control uses */

Status trajectory_record(Instance *c, double h, double until, int inclusive); /* rows within the step just done */
double trajectory_spacing(const Instance *c);  /* mean distance of rows */
int trajectory_is_spent(Instance *c);          /* counts an attempt at a step; whether the run may take no more */

Status solver_advance(Instance *c, double end);  /* integrate to `end`; logs its reason when it fails */

#endif
