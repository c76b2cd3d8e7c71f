/* instance.c - initialization, event iteration, cached evaluation, variables by value reference.
 *
 * FMI clauses served: FMI 2.0.4 sections 2.1 (common), 3.1 to 3.2 (Model Exchange), 4.1 to 4.2 (Co-Simulation);
 * FMI 3.0.1 sections 2.3, 3 and 4. Whatever is requested is evaluated lazily at the present point and cached.
 */
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "discrete.h"
#include "explain.h"
#include "solver.h"

enum { MOST_ITERATIONS = 50 };

const char *const category_names[6] = {"logStatusWarning", "logStatusDiscard", "logStatusError",
                                       "logStatusFatal", "logEvents", "logSolver"};

/* Discard, Error and Fatal are always reported; warnings, events and solver notes only on request. */
void instance_log(Instance *c, Status status, Category category, const char *format, ...) {
    char text[512];
    va_list arguments;
    int bit = 0;
    if (!c->emit || (status < DISCARD && !(c->categories & (unsigned)category))) return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (char *p = text; *p; p++)
        if (*p == '%') *p = '?'; /* some importers use the message as a format */
    while (!((unsigned)category >> bit & 1u)) bit++;
    c->emit(c, status, category_names[bit], text);
}

void instance_warn(Instance *c, const char *format, ...) {
    char text[512];
    va_list arguments;
    if (!c->emit) return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (char *p = text; *p; p++)
        if (*p == '%') *p = '?';
    c->emit(c, WARNING, category_names[0], text);
}

Status instance_set_logging(Instance *c, int on, size_t n, const char *const categories[]) {
    unsigned wanted = n ? 0u : (unsigned)LOG_ALL;
    for (size_t i = 0; i < n; i++) {
        const char *name = categories[i] ? categories[i] : "(NULL)";
        unsigned bits = strcmp(name, "logAll") == 0 ? (unsigned)LOG_ALL : 0u;
        for (int k = 0; k < 6; k++)
            if (strcmp(name, category_names[k]) == 0) bits = 1u << k;
        if (!bits) {
            instance_log(c, FAILED, LOG_ERROR, "unknown log category %.60s", name);
            return FAILED;
        }
        wanted |= bits;
    }
    c->categories = on ? c->categories | wanted : c->categories & ~wanted;
    return OK;
}

int instance_allowed(Instance *c, const char *function, int phases, int kind) {
    if (!c) return 0;
    if (kind && (int)c->kind != kind)
        instance_log(c, FAILED, LOG_ERROR, "%s: only for %s", function,
                     kind == CO_SIMULATION ? "Co-Simulation" : "Model Exchange");
    else if (!(c->s.phase & phases))
        instance_log(c, FAILED, LOG_ERROR, "%s: not allowed in this state", function);
    else
        return 1;
    return 0;
}

int instance_given(Instance *c, const char *function, size_t n, const void *first, const void *second) {
    if (n == 0 || (first && second)) return 1;
    instance_log(c, FAILED, LOG_ERROR, "%s: an array is missing (NULL)", function);
    return 0;
}

static Status fail(Instance *c, Status status, const char *why) {
    instance_log(c, status, status == DISCARD ? LOG_DISCARD : LOG_ERROR, "%s at time %.15g", why, c->s.now.time);
    return status;
}

static int all_finite(const double *values, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += values[i] - values[i];
    return sum == 0.0;
}

void instance_changed(Instance *c) {
    c->dx_valid = c->y_valid = c->w_valid = c->g_valid = c->jacobian_valid = 0;
}

void instance_reset(Instance *c) {
    memset(&c->s, 0, sizeof c->s);
    memcpy(c->s.p, model_p_start, sizeof(double) * N_P);
    memcpy(c->s.now.u, model_u_start, sizeof(double) * N_U);
    memcpy(c->s.x_start, model_x_start, sizeof(double) * N_X);
    memcpy(c->s.now.x, model_x_start, sizeof(double) * N_X);
    c->s.tolerance = DEFAULT_TOLERANCE;
    c->s.last_step_end = c->s.start_time;
    c->s.phase = INSTANTIATED;
    c->s.dependent_due = c->s.initial_due = 1;
    c->factors_of = -1;
    c->events = c->steps = c->rejected = 0;
    memset(c->asserted, 0, sizeof c->asserted);
    instance_changed(c);
}

Status instance_setup(Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined,
                      double stop) {
    State *s = &c->s;
    if (!is_finite(start)) return fail(c, FAILED, "the start time is not finite");
    if (stop_defined && !(stop >= start)) return fail(c, FAILED, "the stop time lies before the start time");
    if (tolerance_defined && !(tolerance > 0.0 && is_finite(tolerance)))
        return fail(c, FAILED, "the tolerance is not a positive number");
    s->tolerance_defined = tolerance_defined != 0;
    s->tolerance = tolerance_defined ? fmin(1e-2, fmax(1e-11, tolerance)) : DEFAULT_TOLERANCE;
    s->start_time = s->now.time = s->last_step_end = start;
    s->stop_defined = stop_defined != 0;
    s->stop_time = stop_defined ? stop : 0.0;
    s->initial_due = 1;
    instance_changed(c);
    return OK;
}

double instance_dead_band(const Instance *c, int k) {
    const double late = N_TIMED ? 4.0 * discrete_grain(c->s.now.time) * fabs(c->slope[k]) : 0.0; /* discrete.c steps there */
    return fmax(1e-13 * c->s.now.span[k] + DBL_MIN, c->s.now.band[k]) + late;
}

/* A relation that each branch drives back (sliding along g = 0) changes for ever at the pace of rounding noise. Its dead
 * band grows until it changes at a pace that can be integrated, to a thousandth of the largest |g| at most; where
 * that is not enough to get on, the run ends. The Co-Simulation crosses such bursts itself (advance.c). */
static void widen(Instance *c, int k) {
    enum { PATIENCE = 12, MOST_CAUGHT = 5000 };
    char text[200];
    Motion *now = &c->s.now;
    const double band = instance_dead_band(c, k);
    if (c->kind != MODEL_EXCHANGE) return;
    now->returns[k] = now->reach[k] < 20.0 * band ? now->returns[k] + 1 : 0;
    now->reach[k] = 0.0;
    if (now->returns[k] < PATIENCE) {
        now->caught[k] = 0;
        return;
    }
    if (band >= 1e-3 * now->span[k]) {
        const double whole = c->s.stop_defined ? c->s.stop_time - c->s.start_time : 1.0;
        if (now->caught[k]++ == 0) now->since[k] = now->time;
        if (now->caught[k] < MOST_CAUGHT) return;
        if (now->time - now->since[k] < 1e-3 * whole) now->endless = k + 1;
        now->caught[k] = 0;
        return;
    }
    if (now->band[k] == 0.0)
        instance_warn(c, "%s changes without end from time %.15g on: it gets a dead band",
                      explain_relation(k, text, sizeof text), now->time);
    now->band[k] = fmin(4.0 * band, 1e-3 * now->span[k]);
    now->returns[k] = PATIENCE / 2;
}

double instance_indicator(const Instance *c, int k) {
    const double band = instance_dead_band(c, k);
    return c->g[k] + (c->s.now.m[k] > 0.5 ? band : -band);
}

/* Which states the parameters let move. */
static void update_movers(Instance *c) {
#if N_RESTING
    State *s = &c->s;
    double moves[N_X + 1];
    model_moving(s->p, s->d, moves);
    s->movers = 0;
    for (int k = 0; k < N_X; k++)
        if (moves[k] != 0.0) s->mover[s->movers++] = k;
    c->factors_of = -1;
    memset(c->stage, 0, sizeof c->stage); /* behind the moving states, too: solver.c, add_stages */
#else
    (void)c;
#endif
}

static Status update_dependent(Instance *c) {
    State *s = &c->s;
    if (!s->dependent_due) return OK;
    if (N_D + N_CACHE && (model_dependent(s->p, s->d) || !all_finite(s->d, N_D)))
        return fail(c, s->phase <= INITIALIZATION ? FAILED : DISCARD, "a calculated parameter cannot be computed");
    update_movers(c);
    s->dependent_due = 0;
    instance_changed(c);
    return OK;
}

/* m := (g > 0) where g has come to the far side of the dead band, so that no indicator is 0 afterwards; a time event is met
 * at its very instant. Returns the number of relations that changed. */
int instance_switch_modes(Instance *c, int report) {
    Motion *now = &c->s.now;
    const double grain = discrete_grain(now->time);
    char text[200];
    int changed = 0;
    discrete_slopes(c);
    for (int k = 0; k < N_G; k++) {
        const double band = instance_dead_band(c, k);
        double wanted = c->g[k] >= band ? 1.0 : c->g[k] <= -band || c->g[k] == 0.0 ? 0.0 : now->m[k];
        if (N_TIMED && c->slope[k] != 0.0) wanted = c->g[k] > grain * fabs(c->slope[k]) ? 1.0 : 0.0; /* its instant is met */
        instance_widen_span(now, k, c->g[k]);
        if (wanted == now->m[k]) continue;
        now->m[k] = wanted;
        widen(c, k);
        changed++;
        if (report && c->categories & LOG_EVENTS)
            instance_log(c, OK, LOG_EVENTS, "event at time %.17g: %s becomes %s", now->time,
                         explain_relation(k, text, sizeof text), wanted > 0.5 ? "true" : "false");
    }
    if (changed) instance_changed(c);
    return changed;
}

static Status settle_relations(Instance *c) {
    for (int i = 0; N_G && i < MOST_ITERATIONS; i++) {
        explain_watch(c, i, MOST_ITERATIONS);
        if (instance_indicators(c) != OK) return DISCARD;
        if (!instance_switch_modes(c, 1)) return OK;
        c->events++;
    }
    return N_G ? explain_unsettled(c, DISCARD, "the event iteration does not settle") : OK;
}

Status instance_update_modes(Instance *c) {
    if (update_dependent(c) != OK) return DISCARD;
    c->s.modes_due = 0;
    c->events += N_EVENTS;
    const Status status = N_EVENTS ? discrete_update(c) : settle_relations(c);
    if (status != OK || !c->s.now.endless) return status;
    char text[200], why[300];
    snprintf(why, sizeof why, "%s changes without end, faster than the run gets on,",
             explain_relation(c->s.now.endless - 1, text, sizeof text));
    c->s.now.endless = 0;
    return fail(c, DISCARD, why);
}

static Status not_initialized(Instance *c, const char *why) {
    if (why) explain_failure(c, FAILED, why, STATES, c->s.now.x, N_X);
    memcpy(c->s.now.x, c->s.x_start, sizeof c->s.now.x);
    instance_changed(c);
    return FAILED;
}

Status instance_initialize(Instance *c) {
    State *s = &c->s;
    Status status = update_dependent(c);
    if (status != OK) return status;
    if (!s->initial_due) return OK;
    memset(s->now.m, 0, sizeof s->now.m);
    memset(s->now.span, 0, sizeof s->now.span);
    memset(s->now.band, 0, sizeof s->now.band);
    memset(s->now.returns, 0, sizeof s->now.returns);
    memset(s->now.caught, 0, sizeof s->now.caught);
    s->now.endless = 0;
#if N_EVENTS
    discrete_reset(c);
#endif
#if N_GUESS
    if (model_first_indicators(s->now.time, s->now.u, s->p, s->d, s->now.m, s->x_start, c->g) == 0)
        for (int k = 0; k < N_G; k++) s->now.m[k] = c->g[k] > 0.0;
#endif
    for (int i = 0; i < MOST_ITERATIONS; i++) {
        explain_watch(c, i, MOST_ITERATIONS);
        instance_changed(c);
        if (model_initial(s->now.time, s->now.u, s->p, s->d, s->now.m, s->x_start, s->now.x) ||
            !all_finite(s->now.x, N_X))
            return not_initialized(c, "the initial equations have no solution");
#if N_EVENTS
        if (i == 0) discrete_preset(c);
#endif
        if (instance_indicators(c) != OK) return not_initialized(c, "a relation cannot be evaluated");
        int changed = instance_switch_modes(c, 0);
#if N_EVENTS
        if (discrete_start(c, &changed) != OK) return not_initialized(c, "the discrete variables have no start value");
#endif
        if (!changed) {
            s->initial_due = 0;
#if N_EVENTS
            return discrete_started(c);
#else
            return OK;
#endif
        }
    }
    explain_unsettled(c, FAILED, "the initial equations and relations do not settle");
    return not_initialized(c, NULL);
}

Status instance_settle(Instance *c) {
    State *s = &c->s;
    if (s->phase == INITIALIZATION) return instance_initialize(c);
    if (s->modes_due && s->phase == STEP_MODE) return instance_update_modes(c);
    return update_dependent(c);
}

#define POINT s->now.time, s->now.x, s->now.u, s->p, s->d, s->now.m

Status instance_derivatives(Instance *c) {
    const State *s = &c->s;
    if (c->dx_valid) return OK;
    if (N_X && (model_rhs(POINT, c->dx) || !all_finite(c->dx, N_X)))
        return explain_failure(c, DISCARD, "derivatives cannot be computed", DERIVATIVES, c->dx, N_X);
    c->dx_valid = 1;
    return OK;
}

Status instance_indicators(Instance *c) {
    const State *s = &c->s;
    if (c->g_valid) return OK;
    if (N_G && (model_indicators(POINT, c->g) || !all_finite(c->g, N_G)))
        return explain_failure(c, DISCARD, "event indicators cannot be computed", RELATIONS, c->g, N_G);
    c->g_valid = 1;
    return OK;
}

Status instance_missed_event(Instance *c, int *missed) {
    *missed = 0;
    if (instance_indicators(c) != OK) return DISCARD;
    for (int k = 0; k < N_G; k++) c->s.now.reach[k] = fmax(c->s.now.reach[k], fabs(c->g[k]));
    for (int k = 0; k < N_G; k++) {
        const double indicator = instance_indicator(c, k);
        *missed |= c->s.now.m[k] > 0.5 ? indicator <= 0.0 : indicator >= 0.0;
    }
    return OK;
}

Status instance_copy(Instance *c, Copy what, double *out, size_t n) {
    Status status = what == COPY_NOMINALS ? OK : instance_settle(c);
    if (n != (what == COPY_INDICATORS ? N_G : N_X)) return fail(c, FAILED, "an array has the wrong length");
    if (status == OK && what == COPY_DERIVATIVES) status = instance_derivatives(c);
    if (status == OK && what == COPY_INDICATORS) status = instance_indicators(c);
    if (status != OK) return status;
    for (size_t k = 0; k < n; k++)
        out[k] = what == COPY_STATES        ? c->s.now.x[k]
                 : what == COPY_DERIVATIVES ? c->dx[k]
                 : what == COPY_INDICATORS  ? instance_indicator(c, (int)k)
                                            : model_x_nominal[k];
    return OK;
}

static Status evaluate_outputs(Instance *c) {
    const State *s = &c->s;
    if (c->w_valid || c->y_valid) return OK;
    if (N_Y && model_outputs(POINT, c->w)) return explain_failure(c, DISCARD, "outputs cannot be computed", STATES, NULL, 0);
    c->y_valid = 1;
    return OK;
}

static Status evaluate_algebraic(Instance *c) {
    const State *s = &c->s;
    if (c->w_valid) return OK;
    if (N_W && model_algebraic(POINT, c->w)) return explain_failure(c, DISCARD, "variables cannot be computed", STATES, NULL, 0);
    c->w_valid = c->y_valid = 1;
    return OK;
}

/* Index of vr within a group of n variables that starts at first, or -1. */
static int within(unsigned vr, unsigned first, int n) { return vr - first < (unsigned)n ? (int)(vr - first) : -1; }

Status instance_get(Instance *c, const unsigned *vr, size_t n, double *values) {
    State *s = &c->s;
    const int unsolved = s->phase == INSTANTIATED; /* FMI 3 may read start values here */
    Status status;
    if (!unsolved && (status = instance_settle(c)) != OK) return status;
    for (size_t i = 0; i < n; i++) {
        const unsigned v = vr[i];
        int k;
        if ((k = within(v, VR_W, N_W)) >= 0) {
            if (unsolved) return fail(c, FAILED, "an output or local variable is read before initialization");
            if ((status = k < N_Y ? evaluate_outputs(c) : evaluate_algebraic(c)) != OK) return status;
            values[i] = c->w[k];
        } else if ((k = within(v, VR_X, N_X)) >= 0) {
            values[i] = unsolved ? s->x_start[k] : s->now.x[k];
        } else if ((k = within(v, VR_U, N_U)) >= 0) {
            values[i] = s->now.u[k];
        } else if ((k = within(v, VR_P, N_P)) >= 0) {
            values[i] = s->p[k];
        } else if ((k = within(v, VR_D, N_D)) >= 0) {
            if ((status = update_dependent(c)) != OK) return status;
            values[i] = s->d[k];
        } else if (v == 0) {
            values[i] = s->now.time;
        } else if ((k = within(v, VR_DX, N_X)) >= 0) {
            if (unsolved) return fail(c, FAILED, "a derivative is read before initialization");
            if ((status = instance_derivatives(c)) != OK) return status;
            values[i] = c->dx[k];
#ifdef VR_G
        } else if ((k = within(v, VR_G, N_G)) >= 0) {
            if (unsolved) return fail(c, FAILED, "an event indicator is read before initialization");
            if ((status = instance_indicators(c)) != OK) return status;
            values[i] = instance_indicator(c, k);
#endif
        } else {
            instance_log(c, FAILED, LOG_ERROR, "value reference %u is not a Real variable of this model", v);
            return FAILED;
        }
        if (is_finite(values[i])) continue;
        instance_log(c, DISCARD, LOG_DISCARD, "value reference %u is not finite at time %.15g", v, s->now.time);
        values[i] = 0.0;
        return DISCARD;
    }
    return OK;
}

int instance_is_input(unsigned vr) { return within(vr, VR_U, N_U) >= 0; }

/* NULL = may be set now; otherwise the reason why not. */
static const char *not_settable(const State *s, unsigned vr) {
    const int starting = s->phase & (INSTANTIATED | INITIALIZATION);
    int k;
    if (within(vr, VR_U, N_U) >= 0) return NULL;
    if ((k = within(vr, VR_P, N_P)) >= 0) {
        if (starting || (model_p_tunable[k] && s->phase & (EVENT_MODE | STEP_MODE))) return NULL;
        return model_p_tunable[k] ? "is a tunable parameter and cannot be set in this state"
                                  : "is a fixed parameter and cannot be set after initialization";
    }
    if (within(vr, VR_X, N_X) >= 0)
        return starting ? NULL : "is a state, whose start value cannot be set after initialization";
    if (vr == 0 || within(vr, VR_DX, N_X) >= 0 || within(vr, VR_D, N_D) >= 0 || within(vr, VR_W, N_W) >= 0)
        return "is calculated and cannot be set";
    return "is not a Real variable of this model";
}

Status instance_set(Instance *c, const unsigned *vr, size_t n, const double *values) {
    State *s = &c->s;
    int parameters = 0;
    for (size_t i = 0; i < n; i++) { /* check all before touching any */
        const char *reason = within(vr[i], VR_U, N_U) >= 0 ? NULL : not_settable(s, vr[i]);
        if (reason) {
            instance_log(c, FAILED, LOG_ERROR, "value reference %u %s", vr[i], reason);
            return FAILED;
        }
        if (!is_finite(values[i])) {
            instance_log(c, DISCARD, LOG_DISCARD, "the value for value reference %u is not finite", vr[i]);
            return DISCARD;
        }
    }
    for (size_t i = 0; i < n; i++) {
        int k;
        if ((k = within(vr[i], VR_U, N_U)) >= 0) {
            s->now.u[k] = values[i];
        } else if ((k = within(vr[i], VR_P, N_P)) >= 0) {
            s->p[k] = values[i];
            parameters = 1;
        } else if ((k = within(vr[i], VR_X, N_X)) >= 0) {
            s->x_start[k] = values[i];
        }
    }
    if (n == 0) return OK;
    if (parameters) s->dependent_due = 1;
    if (s->phase & (INSTANTIATED | INITIALIZATION)) s->initial_due = 1;
    s->modes_due = 1;
    instance_changed(c);
    return OK;
}

Status instance_set_states(Instance *c, const double *x, size_t n) {
    if (n != N_X) return fail(c, FAILED, "wrong number of continuous states");
    if (!all_finite(x, N_X)) return fail(c, DISCARD, "a continuous state is not finite");
    memcpy(c->s.now.x, x, sizeof(double) * N_X);
    instance_changed(c);
    return OK;
}

Status instance_set_time(Instance *c, double time) {
    if (!is_finite(time)) return fail(c, FAILED, "the time is not finite");
    c->s.now.time = time;
    instance_changed(c);
    return OK;
}

Status instance_do_step(Instance *c, double from, double size) {
    State *s = &c->s;
    const double end = from + size;
    const double grain = 1e-9 * fmax(fabs(s->now.time), fabs(end)) + 1e-6 * size;
    if (!is_finite(end) || !(size >= 0.0)) return fail(c, FAILED, "the communication step is negative or not finite");
    if (!(fabs(from - s->now.time) <= grain)) {
        instance_log(c, FAILED, LOG_ERROR, "the communication point %.15g is not the present time %.15g", from,
                     s->now.time);
        return FAILED;
    }
    if (s->stop_defined && end > s->stop_time + 1e-9 * fabs(s->stop_time) + 1e-6 * size) {
        instance_log(c, FAILED, LOG_ERROR, "the step to %.15g goes beyond the stop time %.15g", end, s->stop_time);
        return FAILED;
    }
    if (s->derivatives_used && s->inputs_moving) { /* input derivatives hold for one communication step */
        memset(s->du, 0, sizeof s->du);
        s->inputs_moving = 0;
        c->jacobian_valid = 0;
    }
    if (instance_settle(c) != OK) return DISCARD;
    const Motion before = s->now;
    if (end > s->now.time) {
        s->derivatives_used = 1;
        s->phase = IN_STEP;
        c->return_early = 0;
        const Status status = discrete_advance(c, end);
        s->phase = STEP_MODE;
        if (status != OK) {
            s->now = before;
            instance_changed(c);
            return status;
        }
    }
    const Status asserted = discrete_assertions(c);
    if (asserted == DISCARD) {
        s->now = before;
        instance_changed(c);
        return asserted;
    }
    s->last_step_end = s->now.time;
    return asserted;
}
