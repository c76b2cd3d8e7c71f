/* discrete.h - what happens at events beyond the relations: discrete variables, time events, assertions. */
#ifndef THSA_DISCRETE_H
#define THSA_DISCRETE_H

#include "solver.h"

Status discrete_update(Instance *c);                /* event iteration at the present point */
void discrete_preset(Instance *c);                  /* z before the initialization */
Status discrete_start(Instance *c, int *changed);   /* one turn of the initialization */
Status discrete_started(Instance *c);               /* ends the initialization; the first event */
void discrete_reset(Instance *c);                   /* m before the initialization */
double discrete_next(Instance *c);                  /* time of the next time event, DBL_MAX = none */
double discrete_grain(double time);                 /* instants closer than this are one */
void discrete_slopes(Instance *c);                  /* fills c->slope */
Status discrete_advance(Instance *c, double end);   /* solver_advance with time events on the way */
Status discrete_assertions(Instance *c);            /* WARNING and a message where one fails for the first time, or: */
/* DISCARD and a message where one fails that ends the run. */
Status discrete_domain(Instance *c, double time, const double *x, const double *u);

#endif
