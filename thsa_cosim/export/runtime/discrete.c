/* discrete.c - discrete variables, time events, reinitialization and assertions.
 *
 * Behind the modes, m holds z (discrete variables), pre(z), one tick a sample, and a 1 while the initial values are
 * found. At an event (FMI 2.0.4, 3.2.2; Modelica Language Specification 3.6, 8.6) relations and z are evaluated until
 * they agree, with pre(z) held; states are reinitialized; pre(z) becomes z; and all of it again until nothing changes.
 * The first N_L of z keep the left limits of continuous variables: they are taken when the event begins.
 */
#include <float.h>
#include <math.h>
#include <string.h>
#include "discrete.h"
#include "explain.h"

#define POINT s->now.time, s->now.x, s->now.u, s->p, s->d, s->now.m

double discrete_grain(double time) { return 1e-12 * fmax(1.0, fabs(time)); }

#if N_EVENTS

enum { MOST_ITERATIONS = 1000 };

static double *z_of(Instance *c) { return c->s.now.m + N_G; }
static double *before_of(Instance *c) { return c->s.now.m + N_G + N_Z; }
static double *ticks_of(Instance *c) { return c->s.now.m + N_G + 2 * N_Z; }
static double *initial_of(Instance *c) { return c->s.now.m + N_G + 2 * N_Z + N_T; }

static Status give_up(Instance *c, const char *why) {
    instance_log(c, DISCARD, LOG_DISCARD, "%s at time %.15g", why, c->s.now.time);
    return DISCARD;
}

static Status not_computed(Instance *c) {
    return explain_failure(c, DISCARD, "discrete variables cannot be computed", DISCRETES, NULL, 0);
}

/* The update of z from the present z; counts what changed beyond the left limits. */
static Status refresh(Instance *c, int *changed) {
    const State *s = &c->s;
    double fresh[N_Z + 1], *z = z_of(c);
    int count = 0;
    if (!N_Z) return OK;
    if (model_discrete(POINT, fresh)) return not_computed(c);
    for (int k = N_L; k < N_Z; k++) {
        if (!is_finite(fresh[k]))
            return explain_failure(c, DISCARD, "discrete variables cannot be computed", DISCRETES, fresh, N_Z);
        count += z[k] != fresh[k];
        z[k] = fresh[k];
    }
    if (count) instance_changed(c);
    *changed += count;
    return OK;
}

static Status take_left_limits(Instance *c) {
    const State *s = &c->s;
    double fresh[N_Z + 1];
    if (!N_L) return OK;
    if (model_discrete(POINT, fresh)) return not_computed(c);
    for (int k = 0; k < N_L; k++) z_of(c)[k] = before_of(c)[k] = fresh[k];
    return OK;
}

/* Relations and z with pre(z) held. */
static Status agree(Instance *c) {
    for (int i = 0; i < MOST_ITERATIONS; i++) {
        int changed = 0;
        explain_watch(c, i, MOST_ITERATIONS);
        if (instance_indicators(c) != OK) return DISCARD;
        changed += instance_switch_modes(c, 1);
        if (refresh(c, &changed) != OK) return DISCARD;
        if (!changed) return OK;
    }
    return explain_unsettled(c, DISCARD, "the event iteration does not settle");
}

static int reinitialize(Instance *c) {
    State *s = &c->s;
#if N_R
    double fresh[N_X + 1];
    int changed = 0;
    if (model_reinit(POINT, fresh)) return -1;
    for (int k = 0; k < N_X; k++) changed += fresh[k] != s->now.x[k];
    if (changed) {
        memcpy(s->now.x, fresh, sizeof(double) * N_X);
        instance_changed(c);
    }
    return changed;
#else
    (void)s;
    return 0;
#endif
}

static Status iterate(Instance *c, int *jumped) {
    for (int i = 0; i < MOST_ITERATIONS; i++) {
        int changed = 0;
        explain_watch(c, i, MOST_ITERATIONS);
        if (agree(c) != OK) return DISCARD;
        const int moved = reinitialize(c);
        if (moved < 0) return give_up(c, "a state cannot be reinitialized");
        *jumped |= moved;
        for (int k = N_L; k < N_Z; k++) {
            changed += before_of(c)[k] != z_of(c)[k];
            before_of(c)[k] = z_of(c)[k];
        }
        for (int k = 0; k < N_T; k++) {
            changed += ticks_of(c)[k] != 0.0;
            ticks_of(c)[k] = 0.0;
        }
        if (changed || moved) instance_changed(c);
        if (!changed && !moved) return OK;
    }
    return explain_unsettled(c, DISCARD, "the event iteration does not settle");
}

/* Sets the ticks of the samples that are due and moves their next time on. */
static int tick(Instance *c) {
    State *s = &c->s;
    int due = 0;
    if (!N_T) return 0;
    double table[2 * N_T + 2];
    model_samples(s->p, s->d, s->now.m, table);
    for (int k = 0; k < N_T; k++) {
        const double start = table[2 * k], interval = table[2 * k + 1];
        if (s->now.next[k] > s->now.time + discrete_grain(s->now.time)) continue;
        ticks_of(c)[k] = 1.0;
        due++;
        const double count = interval > 0.0 ? floor((s->now.time - start) / interval + 1e-6) + 1.0 : 0.0;
        s->now.next[k] = interval > 0.0 ? start + count * interval : DBL_MAX;
    }
    if (due) instance_changed(c);
    return due;
}

static void first_ticks(Instance *c) {
    State *s = &c->s;
    if (!N_T) return;
    double table[2 * N_T + 2];
    model_samples(s->p, s->d, s->now.m, table);
    for (int k = 0; k < N_T; k++) {
        const double start = table[2 * k], interval = table[2 * k + 1], behind = s->now.time - start;
        s->now.next[k] = start;
        if (behind > discrete_grain(s->now.time) && interval > 0.0)
            s->now.next[k] = start + ceil(behind / interval - 1e-9) * interval;
    }
}

static double next_tick(const Instance *c) {
    double next = DBL_MAX;
    for (int k = 0; k < N_T; k++) next = fmin(next, c->s.now.next[k]);
    return next;
}

Status discrete_update(Instance *c) {
    int jumped = 0;
    if (take_left_limits(c) != OK) return DISCARD;
    tick(c);
    const Status status = iterate(c, &jumped);
    c->s.states_jumped |= jumped;
    return status;
}

void discrete_reset(Instance *c) {
    double *m = c->s.now.m;
    memset(m, 0, sizeof c->s.now.m);
    *initial_of(c) = 1.0;
    c->s.states_jumped = 0;
}

/* Before the first turn z is pre(z), which the equations may need: a parameter that the initial equations determine. */
void discrete_preset(Instance *c) {
    const State *s = &c->s;
    double start[N_Z + 1];
    if (!N_Z || model_discrete_start(POINT, s->x_start, start)) return;
    for (int k = 0; k < N_Z; k++)
        if (is_finite(start[k])) z_of(c)[k] = before_of(c)[k] = start[k];
    instance_changed(c);
}

/* One turn of the initialization: pre(z) from its start values, then z. */
Status discrete_start(Instance *c, int *changed) {
    State *s = &c->s;
    double start[N_Z + 1];
    if (!N_Z) return OK;
    if (model_discrete_start(POINT, s->x_start, start)) return give_up(c, "discrete start values cannot be computed");
    for (int k = 0; k < N_Z; k++) {
        if (!is_finite(start[k])) return give_up(c, "a discrete start value is not finite");
        *changed += before_of(c)[k] != start[k];
        before_of(c)[k] = start[k];
        if (k < N_L) z_of(c)[k] = start[k];
    }
    if (*changed) instance_changed(c);
    return refresh(c, changed);
}

Status discrete_started(Instance *c) {
    int jumped = 0;
    *initial_of(c) = 0.0;
    for (int k = 0; k < N_Z; k++) before_of(c)[k] = z_of(c)[k];
    instance_changed(c);
    first_ticks(c);
    tick(c);
    return iterate(c, &jumped);
}

#else

static double next_tick(const Instance *c) {
    (void)c;
    return DBL_MAX;
}

Status discrete_update(Instance *c) {
    (void)c;
    return OK;
}

#endif

void discrete_slopes(Instance *c) {
#if N_TIMED
    const State *s = &c->s;
    const int failed = model_time_slopes(POINT, c->slope);
    for (int k = 0; k < N_G; k++)
        if (failed || !is_finite(c->slope[k])) c->slope[k] = 0.0;
#else
    (void)c;
#endif
}

/* The first instant at which a relation of time alone changes: g > 0 ends where g is 0 and begins just behind it. */
static double next_relation(Instance *c) {
    double next = DBL_MAX;
    if (!N_TIMED || instance_indicators(c) != OK) return next;
    const double time = c->s.now.time, grain = discrete_grain(time);
    discrete_slopes(c);
    for (int k = 0; k < N_G; k++) {
        const int holds = c->s.now.m[k] > 0.5;
        if (!(holds ? c->slope[k] < 0.0 : c->slope[k] > 0.0)) continue;
        const double zero = time - c->g[k] / c->slope[k], at = holds ? zero : zero + 2.0 * discrete_grain(zero);
        if (at > time + grain) next = fmin(next, at);
    }
    return next;
}

double discrete_next(Instance *c) { return fmin(next_tick(c), next_relation(c)); }

Status discrete_advance(Instance *c, double end) {
    State *s = &c->s;
    while (s->now.time < end && !c->return_early) {
        c->due = discrete_next(c);
        const Status status = solver_advance(c, fmin(c->due, end));
        if (status != OK) return status;
        if (c->due > s->now.time + discrete_grain(s->now.time)) continue;
        s->now.bends = 1;
        if (instance_update_modes(c) != OK) return DISCARD;
    }
    return OK;
}

Status discrete_domain(Instance *c, double time, const double *x, const double *u) {
#if N_ENDS
    const State *s = &c->s;
    double violated[N_A];
    if (model_assertions(time, x, u, s->p, s->d, s->now.m, violated)) return OK;
    for (int k = N_A - N_ENDS; k < N_A; k++) {
        if (!(violated[k] != 0.0)) continue;
        instance_log(c, DISCARD, LOG_DISCARD, "at time %.15g: %s", time, model_assertion_text[k]);
        return DISCARD;
    }
#else
    (void)c, (void)time, (void)x, (void)u;
#endif
    return OK;
}

Status discrete_assertions(Instance *c) {
    Status status = OK;
#if N_A
    const State *s = &c->s;
    double violated[N_A];
    if (model_assertions(POINT, violated)) return OK;
    for (int k = 0; k < N_A - N_ENDS; k++) {
        if (!(violated[k] != 0.0) || c->asserted[k]) continue;
        c->asserted[k] = 1;
        status = WARNING;
        instance_warn(c, "at time %.15g: %s", s->now.time, model_assertion_text[k]);
    }
#endif
    return discrete_domain(c, c->s.now.time, c->s.now.x, c->s.now.u) == OK ? status : DISCARD;
}
