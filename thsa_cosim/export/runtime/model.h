/* model.h - what generated model.c and model_start.c provide to the runtime (see also model_config.h).
 *
 * Between events every relation k is frozen at its mode m[k] (0.0 or 1.0); relation k is true iff g[k] > 0.
 * With m frozen the functions are smooth, so each branch is used beyond its border until the event is located.
 * Every function returns 0, or nonzero when it cannot compute; the runtime also checks for non-finite results.
 * Arrays are column-major; a pointer to an empty array may be passed where the length is 0.
 */
#ifndef THSA_MODEL_H
#define THSA_MODEL_H

#include "model_config.h"

#ifndef N_CACHE
#define N_CACHE 0 /* doubles behind d[N_D] in which the model keeps what only slow inputs change */
#endif

/* What few models have; N_EVENTS = discrete variables, time events or initial() are used. */
#ifndef N_EVENTS
#define N_EVENTS 0
#define N_Z 0 /* discrete variables */
#define N_L 0 /* of these the left limits of continuous ones */
#define N_T 0 /* samples */
#define N_R 0 /* 1: states are reinitialized */
#define N_A 0 /* assertions */
#define N_ENDS 0 /* those of them, the last ones, that end a run */
#define N_GUESS 0 /* 1: the initial values depend on relations */
#define N_IMPLICIT 0 /* unknowns of implicit equations, kept in the cache */
#endif
#ifndef N_TEXTS
#define N_TEXTS 0 /* entries of model_text: one each for states, relations, discrete variables and loops */
#define N_LOOPS 0 /* loops of the running model, then of its initialization, then all of the running model at once; the
                   * last double of the cache is the number (from 1) of the one that has no solution, else 0 */
#define N_PIVOTS 0 /* expressions that the model divides by; their texts follow on those of the loops */
#endif
#ifndef N_TIMED
#define N_TIMED 0 /* relations of time alone, linear in it: time events */
#endif
#ifndef N_RESTING
#define N_RESTING 0 /* 1: parameters may hold states at rest */
#endif
#define N_M (N_G + (N_EVENTS ? 2 * N_Z + N_T + 1 : 0)) /* modes, z, pre(z), ticks, initial */

#if N_X < 0 || N_U < 0 || N_P < 0 || N_D < 0 || N_W < 0 || N_Y > N_W || N_G < 0
#error "model_config.h: inconsistent sizes"
#endif

/* model_start.c: what exports of one model with other values differ in, so that a compiler's cache keeps all the rest */
extern const double model_p_start[], model_u_start[], model_x_start[];
extern const char model_guid[]; /* guid (FMI 2.0), instantiation token (FMI 3.0) */

extern const double model_x_nominal[];
extern const unsigned char model_p_tunable[]; /* 1: may be set while simulating; 0: fixed */

#define MODEL_POINT double t, const double *x, const double *u, const double *p, const double *d, const double *m

int model_dependent(const double *p, double *d);  /* calculated parameters */
int model_moving(const double *p, const double *d, double *a); /* 0: the state is at rest, its dx is 0 whatever x, u, t are */
int model_initial(double t, const double *u, const double *p, const double *d, const double *m,
                  const double *x_start, double *x);  /* initial equations for given modes */
int model_rhs(MODEL_POINT, double *dx);
int model_algebraic(MODEL_POINT, double *w);   /* all N_W */
int model_outputs(MODEL_POINT, double *y);     /* the first N_Y of w */
int model_indicators(MODEL_POINT, double *g);  /* N_G */
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft);  /* df/dx, df/du, partial df/dt; A and B come with 0 where
                                                                      * they always are 0: that need not be written */
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp,
                      double *ddx, double *dw);  /* exact directional derivatives of dx and w */

int model_discrete(MODEL_POINT, double *z);         /* new values of the discrete variables */
int model_discrete_start(MODEL_POINT, const double *x_start, double *z); /* their values before the first event */
int model_first_indicators(double t, const double *u, const double *p, const double *d, const double *m,
                           const double *x_start, double *g); /* relations at the start values */
int model_reinit(MODEL_POINT, double *x_new);         /* states after an event */
int model_time_slopes(MODEL_POINT, double *s);        /* dg/dt of relations that are time events, 0 of the others */
int model_samples(const double *p, const double *d, const double *m, double *s); /* start and interval of each sample */
int model_assertions(MODEL_POINT, double *a);       /* nonzero where violated */
extern const char *const model_assertion_text[];
int model_pivots(MODEL_POINT, double *a);           /* 0 where something cannot be solved */
extern const char *const model_text[];

#endif
