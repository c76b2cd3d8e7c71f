/* trajectory.c - a whole run in one call: solver steps cross samples, rows come from the dense output.
 *
 * Inputs are linear in time over a segment. At the start of a segment every input takes its value there: a jump is an
 * event, a kink only ends a step. Row i belongs to times[i] with the inputs of the segment that starts there or before,
 * so that variables with direct feed-through show an input that jumps at a sample with its new value.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "discrete.h"
#include "solver.h"
#include "trajectory.h"

/* Where rows are written to, and what has to be evaluated for one. */
struct Recorder {
    Trajectory *run;
    const double **source;   /* (n_outputs) into the point below or the instance's parameters */
    size_t most, attempts;   /* at steps; most is 0 without a limit */
    int outputs, algebraic, derivatives, indicators; /* which functions the rows need */
    double from;             /* start of the present segment */
    double u_from[N_U + 1];  /* inputs there */
    double time, x[N_X + 1], u[N_U + 1], w[N_W + 1], dx[N_X + 1], g[N_G + 1]; /* one row's point */
};

static int within(unsigned vr, unsigned first, int n) { return vr - first < (unsigned)n ? (int)(vr - first) : -1; }

static const double *source_of(Instance *c, Recorder *r, unsigned vr) {
    int k;
    if ((k = within(vr, VR_W, N_W)) >= 0) {
        if (k < N_Y) r->outputs = 1;
        else r->algebraic = 1;
        return r->w + k;
    }
    if ((k = within(vr, VR_X, N_X)) >= 0) return r->x + k;
    if ((k = within(vr, VR_U, N_U)) >= 0) return r->u + k;
    if ((k = within(vr, VR_P, N_P)) >= 0) return c->s.p + k;
    if ((k = within(vr, VR_D, N_D)) >= 0) return c->s.d + k;
    if (vr == 0) return &r->time;
    if ((k = within(vr, VR_DX, N_X)) >= 0) return r->derivatives = 1, r->dx + k;
#ifdef VR_G
    if ((k = within(vr, VR_G, N_G)) >= 0) return r->indicators = 1, r->g + k;
#endif
    return NULL;
}

/* The next row at the point (r->time, r->x, r->u). */
static Status write_row(Instance *c, Recorder *r) {
    const State *s = &c->s;
    Trajectory *run = r->run;
    double *to = run->results + run->done, finite = 0.0;
    int failed = 0;
    if (N_ENDS && discrete_domain(c, r->time, r->x, r->u) != OK) {
        run->reached = r->time;
        return DISCARD;
    }
    if (r->algebraic) failed = model_algebraic(r->time, r->x, r->u, s->p, s->d, s->now.m, r->w);
    else if (r->outputs) failed = model_outputs(r->time, r->x, r->u, s->p, s->d, s->now.m, r->w);
    if (r->derivatives) failed |= model_rhs(r->time, r->x, r->u, s->p, s->d, s->now.m, r->dx);
    if (r->indicators) {
        failed |= model_indicators(r->time, r->x, r->u, s->p, s->d, s->now.m, r->g);
        for (int k = 0; k < N_G; k++) r->g[k] += s->now.m[k] > 0.5 ? instance_dead_band(c, k) : -instance_dead_band(c, k);
    }
    for (size_t k = 0; k < run->n_outputs; k++) {
        const double value = *r->source[k];
        finite += value - value;
        to[k * run->n_times] = value;
    }
    if (!failed && finite == 0.0) {
        run->done++;
        return OK;
    }
    run->reached = r->time;
    if (failed) instance_log(c, DISCARD, LOG_DISCARD, "variables cannot be computed at time %.15g", r->time);
    for (size_t k = 0; !failed && k < run->n_outputs; k++)
        if (!is_finite(*r->source[k])) {
            instance_log(c, DISCARD, LOG_DISCARD, "value reference %u is not finite at time %.15g", run->outputs[k],
                         r->time);
            break;
        }
    return DISCARD;
}

static void inputs_at(const Instance *c, Recorder *r, double time) {
    r->time = time;
    for (int k = 0; k < N_U; k++) r->u[k] = r->u_from[k] + (time - r->from) * c->s.du[k];
}

/* The row at the present point. */
static Status write_here(Instance *c, Recorder *r) {
    r->time = c->s.now.time;
    memcpy(r->x, c->s.now.x, sizeof r->x);
    memcpy(r->u, c->s.now.u, sizeof r->u);
    return write_row(c, r);
}

#if N_X > 0
Status trajectory_record(Instance *c, double h, double until, int inclusive) {
    Recorder *r = c->recorder;
    Trajectory *run = r->run;
    const double begin = c->s.now.time, per_h = 1.0 / h, late = until - discrete_grain(until); /* shows the event there */
    while (run->done < run->n_times) {
        const double time = run->times[run->done];
        if (inclusive ? time > until : time >= late) break;
        solver_dense_prepare(c);
        solver_dense(c, fmin(1.0, (time - begin) * per_h), r->x);
        inputs_at(c, r, time);
        const Status status = write_row(c, r);
        if (status != OK) return status;
    }
    if (run->progress) *run->progress = until;
    return OK;
}

double trajectory_spacing(const Instance *c) {
    const Trajectory *run = c->recorder->run;
    return (run->times[run->n_times - 1] - run->times[0]) / (double)(run->n_times - 1);
}

int trajectory_is_spent(Instance *c) {
    Recorder *r = c->recorder;
    return ++r->attempts > r->most && r->most;
}

static Status cross(Instance *c, double end) { return discrete_advance(c, end); }

#else
/* No states: every row is a point of its own, whose relations have to be settled, after the time events before it. */
static Status settle_at(Instance *c, double time) {
    for (double next = discrete_next(c); next < time - discrete_grain(time); next = discrete_next(c))
        if (discrete_advance(c, next) != OK) return DISCARD;
    inputs_at(c, c->recorder, time);
    memcpy(c->s.now.u, c->recorder->u, sizeof c->s.now.u);
    c->s.now.time = time;
    instance_changed(c);
    return instance_update_modes(c);
}

static Status cross(Instance *c, double end) {
    Recorder *r = c->recorder;
    Trajectory *run = r->run;
    Status status = OK;
    while (status == OK && run->done < run->n_times && run->times[run->done] < end)
        if ((status = settle_at(c, run->times[run->done])) == OK) status = write_here(c, r);
    if (run->progress) *run->progress = c->s.now.time;
    return status == OK ? settle_at(c, end) : status;
}
#endif

/* Inputs as segment j begins; whether one jumps there is what the new values differ from the present ones by. */
static Status enter_segment(Instance *c, Recorder *r, size_t j) {
    State *s = &c->s;
    const Trajectory *run = r->run;
    int jumps = 0;
    s->inputs_moving = 0;
    memset(s->du, 0, sizeof s->du);
    for (size_t i = 0; i < run->n_inputs; i++) {
        const int k = (int)(run->inputs[i] - VR_U);
        const double value = run->values[j * run->n_inputs + i], slope = run->slopes[j * run->n_inputs + i];
        jumps |= s->now.u[k] != value;
        s->now.u[k] = value;
        s->du[k] = slope;
        s->inputs_moving |= slope != 0.0;
    }
    r->from = s->now.time;
    memcpy(r->u_from, s->now.u, sizeof r->u_from);
    instance_changed(c);
    return jumps || s->modes_due ? instance_update_modes(c) : OK;
}

static Status check(Instance *c, Recorder *r) {
    Trajectory *run = r->run;
    const char *why = NULL;
    if (!run->n_times || !run->n_segments) why = "a trajectory needs a time and a segment";
    for (size_t i = 0; !why && i < run->n_inputs; i++)
        if (!instance_is_input(run->inputs[i])) why = "a trajectory drives what is no input";
    for (size_t i = 0; !why && i + 1 < run->n_times; i++)
        if (!(run->times[i] < run->times[i + 1])) why = "the times of a trajectory do not increase";
    for (size_t i = 0; !why && i + 1 < run->n_segments; i++)
        if (!(run->starts[i] < run->starts[i + 1])) why = "the segments of a trajectory do not follow each other";
    for (size_t i = 0; !why && i < run->n_segments * run->n_inputs; i++)
        if (!is_finite(run->values[i]) || !is_finite(run->slopes[i])) why = "an input of a trajectory is not finite";
    if (!why && !(run->times[0] == c->s.now.time && run->starts[0] <= run->times[0] &&
                  is_finite(run->times[run->n_times - 1])))
        why = "a trajectory does not begin at the present time";
    for (size_t k = 0; !why && k < run->n_outputs; k++)
        if (!(r->source[k] = source_of(c, r, run->outputs[k]))) why = "a trajectory reads what is no variable";
    if (why) instance_log(c, FAILED, LOG_ERROR, "%s", why);
    return why ? FAILED : OK;
}

static Status follow(Instance *c, Recorder *r) {
    Trajectory *run = r->run;
    const double stop = run->times[run->n_times - 1];
    Status status = instance_settle(c);
    for (size_t j = 0; status == OK && j < run->n_segments; j++) {
        if (run->starts[j] > stop) break;
        const double end = j + 1 < run->n_segments ? fmin(stop, run->starts[j + 1]) : stop;
        if ((status = enter_segment(c, r, j)) != OK) break;
        if (run->done < run->n_times && run->times[run->done] == c->s.now.time && (status = write_here(c, r)) != OK) break;
        if (end > c->s.now.time) status = cross(c, end);
    }
    if (status == OK && run->done < run->n_times) status = write_here(c, r);
    if (status == OK && N_ENDS) status = discrete_domain(c, c->s.now.time, c->s.now.x, c->s.now.u);
    return status;
}

Status trajectory_run(Instance *c, Trajectory *run) {
    Recorder *r = calloc(1, sizeof *r);
    const size_t steps = (size_t)c->steps, rejected = (size_t)c->rejected, events = (size_t)c->events;
    Status status = FAILED;
    if (r) r->source = malloc((run->n_outputs + 1) * sizeof *r->source);
    if (!r || !r->source) {
        instance_log(c, FAILED, LOG_ERROR, "out of memory for a trajectory");
        free(r);
        return FAILED;
    }
    r->run = run;
    r->most = run->steps;
    run->done = 0;
    run->reached = c->s.now.time;
    if ((status = check(c, r)) == OK) {
        void (*const before_step)(Instance *, double) = c->before_step;
        void (*const after_step)(Instance *) = c->after_step;
        c->recorder = r;
        c->before_step = NULL, c->after_step = NULL; /* nobody has to be asked for inputs */
        c->s.phase = IN_STEP;
        status = follow(c, r);
        c->s.phase = STEP_MODE;
        c->before_step = before_step, c->after_step = after_step;
        c->recorder = NULL;
        c->s.inputs_moving = 0;
        memset(c->s.du, 0, sizeof c->s.du);
        instance_changed(c);
        if (status == OK) c->s.last_step_end = run->reached = c->s.now.time;
        else if (run->reached < c->s.now.time) run->reached = c->s.now.time;
    }
    run->steps = (size_t)c->steps - steps;
    run->rejected = (size_t)c->rejected - rejected;
    run->events = (size_t)c->events - events;
    free(r->source);
    free(r);
    return status;
}
