/* advance.c - the Co-Simulation stepping loop: error control, state events, inputs, failure.
 *
 * Step size: 0.75 h err^(-1/5) (Hairer and Wanner, Solving ODE II, IV.8), remembered across communication points; a
 * step shortened by a communication point or an event never shrinks the remembered one. Proportional-integral control was
 * measured: half as many steps again, as inputs and events bend the solution every few steps.
 * Events: within a step the modes m are frozen. Relation k disagrees with its mode when g[k] has left the dead
 * band on the wrong side. If one disagrees at the end, in the middle, or at the vertex of the parabola through
 * start, middle and end, the earliest bracketed disagreement is located on the dense output, the step is redone
 * until it lands just past it, and the event iteration updates m there (FMI 2.0, 3.1.1; FMI 3.0, 3.1).
 * The dead band (1e-13 of the largest |g| seen) keeps rounding noise at g = 0 from being an event, and a burst
 * of events without progress is crossed by a blind step: the functions are continuous across relations.
 */
#include <float.h>
#include <math.h>
#include <string.h>
#include "discrete.h"
#include "explain.h"
#include "solver.h"

#if N_X > 0

enum { MOST_STEPS = 2000000, MOST_RAPID = 60, MOST_REDONE = 60, MOST_AHEAD = 6 };

/* Largest scaled error of a step that begins where the solution bends, or that was tried before: what estimates it is not
 * yet small there. */
static const double CAREFUL = 0.2;

typedef struct {
    double disagreement[N_G + 1]; /* s*g - dead band, s = +1 where m = 0 and -1 where m = 1; > 0 = disagrees */
    double worst;
} Check;

static Status give_up(Instance *c, const char *why) {
    instance_log(c, DISCARD, LOG_DISCARD, "%s at time %.15g", why, c->s.now.time);
    return DISCARD;
}

static Status not_linearized(Instance *c) {
    return explain_failure(c, DISCARD, "derivatives or Jacobian cannot be computed", STATES, NULL, 0);
}

static double time_grain(const Instance *c, double end) {
    return 16.0 * DBL_EPSILON * fmax(fabs(c->s.now.time), fabs(end));
}

static int judge(const Instance *c, const double *restrict g, Check *restrict out) {
    enum { LANES = 4 };
    double worst[LANES] = {-DBL_MAX, -DBL_MAX, -DBL_MAX, -DBL_MAX}, finite[LANES] = {0.0};
    const double *restrict m = c->s.now.m, *restrict span = c->s.now.span;
    double *restrict away = out->disagreement;
    for (int k = 0; k < N_G; k++) away[k] = (1.0 - 2.0 * m[k]) * g[k] - (1e-13 * span[k] + DBL_MIN);
    if (N_TIMED) { /* as instance_dead_band */
        const double late = 4.0 * discrete_grain(c->s.now.time);
        for (int k = 0; k < N_G; k++) away[k] -= late * fabs(c->slope[k]);
    }
    for (int k = 0; k < N_G; k += LANES)
        for (int i = 0; i < LANES && k + i < N_G; i++) {
            worst[i] = away[k + i] > worst[i] ? away[k + i] : worst[i];
            finite[i] += away[k + i] - away[k + i];
        }
    out->worst = fmax(fmax(worst[0], worst[1]), fmax(worst[2], worst[3]));
    return finite[0] + finite[1] + finite[2] + finite[3] != 0.0;
}

/* Relations at (time + dt, x) with the present modes; nonzero = not computable. */
static int check_at(const Instance *c, double dt, const double *x, double *g, Check *out) {
    const State *s = &c->s;
    double moved[N_U + 1];
    const double *u = s->now.u;
    if (s->inputs_moving) {
        solver_inputs(c, dt, moved);
        u = moved;
    }
    return model_indicators(s->now.time + dt, x, u, s->p, s->d, s->now.m, g) || judge(c, g, out);
}

/* theta of a vertex in (0, 1) where the parabola through three agreeing points disagrees; 0 = none. */
static double suspected_dip(const Check *start, const Check *middle, const Check *end) {
    double found = 0.0, highest = 0.0;
    for (int k = 0; k < N_G; k++) {
        const double q0 = start->disagreement[k], qm = middle->disagreement[k], q1 = end->disagreement[k];
        const double bend = 2.0 * (q0 - 2.0 * qm + q1), slope = 4.0 * qm - 3.0 * q0 - q1;
        if (!(slope > 0.0 && 0.5 * slope < -bend && 0.25 * slope * slope > q0 * bend)) continue;
        const double theta = -0.5 * slope / bend, top = q0 + 0.5 * slope * theta;
        if (top > highest) {
            highest = top;
            found = theta;
        }
    }
    return found;
}

/* The share of (a, b) after which a relation first disagrees on a straight line between both ends. */
static double false_position(const Check *low, const Check *high) {
    double first = 1.0;
    for (int k = 0; k < N_G; k++) {
        const double before = low->disagreement[k], after = high->disagreement[k];
        if (after > 0.0 && -before < first * (after - before)) first = fmax(0.0, -before / (after - before));
    }
    return first;
}

/* The first change in (a, b] of the relations that disagree at b; returns theta just past it. ITP on all of them at once
 * (I. Oliveira and R. Takahashi, ACM Trans. Math. Softw. 47 (2020) 5): one turn more than bisection at most, mostly a few. */
static double locate(Instance *c, double h, double a, const Check *at_a, double b, const Check *at_b, double grain) {
    const double whole = b - a, half = 0.5 * grain / h;
    double x[N_X], g[N_G + 1], reach = half;
    Check low = *at_a, high = *at_b, at;
    int computable = 1;
    solver_dense_prepare(c);
    while (reach < whole) reach *= 2.0;
    for (int i = 0; i < 100 && b - a > 2.0 * half; i++, reach *= 0.5) {
        const double width = b - a, middle = 0.5 * (a + b), room = fmax(0.0, reach - 0.5 * width);
        const double off = (computable ? a + width * false_position(&low, &high) : middle) - middle;
        const double nearer = fmin(fmax(0.0, fabs(off) - 0.2 * width * width / whole), room);
        const double theta = fmin(fmax(middle + copysign(nearer, off), a + 0.5 * half), b - 0.5 * half);
        solver_dense(c, theta, x);
        if (check_at(c, theta * h, x, g, &at)) {
            b = theta, computable = 0; /* not computable there: the change must come before */
        } else if (at.worst > 0.0) {
            b = theta, high = at, computable = 1;
        } else {
            a = theta, low = at;
        }
    }
    return b;
}

/* A step that was to land on an event has fallen short of it: theta > 1 where the event shows, a little further on, on the
 * dense output continued; 0 = it does not. */
static double ahead(Instance *c, double h, const Check *end, double grain) {
    double x[N_X], g[N_G + 1];
    Check at;
    solver_dense_prepare(c);
    for (double beyond = fmax(1e-6, 2.0 * grain / h); beyond < 0.05; beyond *= 8.0) {
        solver_dense(c, 1.0 + beyond, x);
        if (check_at(c, (1.0 + beyond) * h, x, g, &at)) return 0.0;
        if (at.worst > 0.0) return locate(c, h, 1.0, end, 1.0 + beyond, &at, grain);
    }
    return 0.0;
}

/* Where the step of size h just computed meets an event: theta in (0, 1]; 0 = nowhere, -1 = not computable. */
static double find_event(Instance *c, double h, const Check *start, Check *end, double *g_end, double grain) {
    double x[N_X], g[N_G + 1];
    Check middle, dip;
    if (check_at(c, h, c->x_new, g_end, end)) return -1.0;
    solver_dense_middle(c, x);
    if (check_at(c, 0.5 * h, x, g, &middle)) return -1.0;
    if (middle.worst > 0.0) return locate(c, h, 0.0, start, 0.5, &middle, grain);
    if (end->worst > 0.0) return locate(c, h, 0.5, &middle, 1.0, end, grain);
    const double theta = suspected_dip(start, &middle, end);
    if (theta <= 0.0) return 0.0;
    solver_dense_prepare(c);
    solver_dense(c, theta, x);
    if (check_at(c, theta * h, x, g, &dip)) return -1.0;
    return dip.worst > 0.0 ? locate(c, h, 0.0, start, theta, &dip, grain) : 0.0;
}

/* For messages: the relation that disagrees most at the end of a step has an event. */
static void note_event(Instance *c, const Check *end) {
    int most = 0;
    for (int k = 1; k < N_G; k++) most = end->disagreement[k] > end->disagreement[most] ? k : most;
    c->sought[most]++;
}

/* A first step over which an Euler step would move 100 tolerances: the controller finds its way from there. */
static double first_step(const Instance *c, double most) {
    double rate = 0.0;
    for (int n = 0; n < N_X; n++) {
        const double scale = solver_tolerance(c) * (model_x_nominal[n] + fabs(c->s.now.x[n]));
        rate = fmax(rate, fabs(c->dx[n]) / scale);
    }
    return rate * most > 100.0 ? 100.0 / rate : most;
}

/* The remembered step after one of size h was accepted with the scaled error given. */
static void control(Motion *now, double h, double error, int was_rejected) {
    const int shortened = h < 0.999 * now->step;
    if (shortened && error < 0.3 && 8.0 * h <= now->step) return;
    const double e = fmax(error, 1e-6);
    double factor = 0.75 * pow(e, -0.2);
    factor = fmin(was_rejected ? 1.0 : 8.0, fmax(0.2, factor));
    if (shortened && error < 0.3)
        now->step = fmax(now->step, h * factor);
    else
        now->step = h * factor;
}

static void commit(Instance *c, double time, const double *g_end, double from, const double *u_from) {
    Motion *now = &c->s.now;
    now->time = time;
    memcpy(now->x, c->x_new, sizeof(double) * N_X);
    if (c->s.inputs_moving)
        for (int k = 0; k < N_U; k++) now->u[k] = u_from[k] + (time - from) * c->s.du[k];
    if (g_end)
        for (int k = 0; k < N_G; k++) instance_widen_span(now, k, g_end[k]);
    instance_changed(c);
}

/* The event iteration, and whether it changes anything. */
static Status update_modes(Instance *c, int *changed) {
    const Motion *now = &c->s.now;
    double m[N_M + 1], x[N_X];
    memcpy(m, now->m, sizeof m);
    memcpy(x, now->x, sizeof x);
    const Status status = instance_update_modes(c);
    *changed = memcmp(m, now->m, sizeof m) != 0 || memcmp(x, now->x, sizeof x) != 0;
    return status;
}

Status solver_advance(Instance *c, double end) {
    Motion *now = &c->s.now;
    const double whole = c->recorder ? trajectory_spacing(c) : end - now->time;
    double from = now->time, u_from[N_U + 1], g[N_G + 1], last_event = -DBL_MAX, blind = 0.0;
    long attempts = 0;
    int rapid = 0, restarted = now->bends;
    Check start = {{0.0}, -DBL_MAX}, finish = start;
    memcpy(u_from, now->u, sizeof u_from);
    now->bends = 0;
    memset(c->sought, 0, sizeof c->sought);
    if (N_G && (instance_indicators(c) != OK || judge(c, c->g, &start)))
        return give_up(c, "event indicators cannot be computed");

    while (now->time < end && !c->return_early) {
        const double remaining = end - now->time, grain = time_grain(c, end);
        int landing = 0, was_rejected = 0, last;
        double h, error, accepted = restarted ? CAREFUL : 1.0;
        if (N_ENDS && discrete_domain(c, now->time, now->x, now->u) != OK) return DISCARD;
        if (solver_linearize(c)) return not_linearized(c);
        if (!(now->step > 0.0)) now->step = first_step(c, remaining);
        h = 1.25 * now->step >= remaining ? remaining : now->step > 0.5 * remaining ? 0.5 * remaining : now->step;
        if (rapid > MOST_RAPID) {
            blind = fmin(blind > 0.0 ? 8.0 * blind : 64.0 * grain, 1e-3 * whole);
            h = fmin(h, fmax(blind, grain));
        }
        for (;;) { /* attempts at one step */
            if (++attempts > MOST_STEPS) return explain_slowness(c, "too many internal steps in one communication step");
            if (c->recorder && trajectory_is_spent(c)) return explain_slowness(c, "more internal steps than the run may take");
            if (c->before_step && !landing) {
                c->before_step(c, now->time + h);
                from = now->time;
                memcpy(u_from, now->u, sizeof u_from);
                if (solver_linearize(c)) return not_linearized(c);
            }
            error = solver_step(c, h);
            if (error >= 0.0 && error <= accepted) {
                if (!N_G || rapid > MOST_RAPID) break;
                const double theta = find_event(c, h, &start, &finish, g, grain);
                if (theta == 0.0) {
                    const double further = landing && landing < MOST_AHEAD ? ahead(c, h, &finish, grain) : 0.0;
                    if (!(further * h > h && further * h < remaining)) break;
                    landing++;
                    h *= further;
                    continue;
                }
                if (theta > 0.0) { /* redo to land there, until the shorter step agrees about where it is */
                    const double short_of_end = (1.0 - theta) * h;
                    if (!landing) note_event(c, &finish);
                    landing++;
                    if (theta >= 1.0 || landing > MOST_REDONE) break;
                    if (landing > 1 && (short_of_end < 1e-3 * h || short_of_end <= 4.0 * grain)) break;
                    h = fmax(theta * h, grain);
                    continue;
                }
                error = -1.0;
            }
            c->rejected++;
            was_rejected = 1;
            if (c->categories & LOG_SOLVER)
                instance_log(c, OK, LOG_SOLVER, "a step of %.3g at time %.15g is rejected: scaled error %.3g", h,
                             now->time, error);
            landing = 0;
            h *= error < 0.0 ? 0.1 : fmax(0.05, 0.8 * pow(error / accepted, -0.25)); /* it met what no polynomial follows */
            accepted = CAREFUL;
            now->step = h;
            if (h < grain)
                return error < 0.0 ? explain_failure(c, DISCARD, "the model cannot be evaluated", STATES, c->x_new, N_X)
                                   : explain_slowness(c, "the step size became too small");
        }
        c->steps++;
        restarted = 0;
        last = h >= remaining;
        if (!landing && rapid <= MOST_RAPID) control(now, h, error, was_rejected);
        if (c->recorder && trajectory_record(c, h, last ? end : now->time + h, !last) != OK) return DISCARD;
        commit(c, last ? end : now->time + h, N_G && !landing && rapid <= MOST_RAPID ? g : NULL, from, u_from);
        if (c->after_step) c->after_step(c);
        if (!N_G) continue;
        if (!landing && rapid <= MOST_RAPID) {
            start = finish;
            continue;
        }
        if (update_modes(c, &restarted) != OK) return DISCARD;
        if (!restarted && !landing) rapid = MOST_RAPID - 4; /* a blind step without an event: the burst may be over */
        if (restarted || landing) { /* a landing without a change: g may be rounding noise there */
            if (now->time - last_event > fmax(1e-6 * now->step, 4.0 * blind)) rapid = 0, blind = 0.0;
            last_event = now->time;
            if (++rapid == MOST_RAPID)
                instance_log(c, WARNING, LOG_WARNING, "burst of events at time %.15g is crossed blindly", now->time);
        }
        if (N_TIMED && restarted) end = fmin(end, c->due = discrete_next(c)); /* an event may set a timer */
        if (instance_indicators(c) != OK || judge(c, c->g, &start))
            return give_up(c, "event indicators cannot be computed");
    }
    return OK;
}

#else

Status solver_advance(Instance *c, double end) {
    State *s = &c->s;
    if (c->before_step) c->before_step(c, end);
    for (int k = 0; k < N_U; k++) s->now.u[k] += (end - s->now.time) * s->du[k];
    s->now.time = end;
    instance_changed(c);
    const Status status = instance_update_modes(c);
    if (status == OK && c->after_step) c->after_step(c);
    return status;
}

#endif
