/* explain.h - why something cannot be computed, in the words of the model. */
#ifndef THSA_EXPLAIN_H
#define THSA_EXPLAIN_H

#include "instance.h"

typedef enum { STATES, DERIVATIVES, RELATIONS, DISCRETES } Group;

/* Logs why and returns status: the loop without a solution, or the first of n values of the group that is no number. */
Status explain_failure(Instance *c, Status status, const char *why, Group group, const double *values, int n);

/* An iteration of at most `most` turns tells before each turn where it is: what still changes at its end is kept. */
void explain_watch(Instance *c, int turn, int most);
Status explain_unsettled(Instance *c, Status status, const char *why); /* logs what was seen to change; returns status */

/* Logs why, the relation with the most events since the step began and the state that limits the step size. */
Status explain_slowness(Instance *c, const char *why);

const char *explain_relation(int k, char *text, size_t size); /* "v > v_r", or "relation 3" where no text is known */

#endif
