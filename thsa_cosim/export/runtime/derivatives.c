/* derivatives.c - input and output derivatives (Co-Simulation), directional and adjoint derivatives.
 *
 * FMI 2.0.4: 2.1.9 fmi2GetDirectionalDerivative, 4.2.1 input and output derivatives. FMI 3.0.1: 2.2.11.
 * Directional derivatives are exact partial derivatives with the relations frozen at their present modes and the
 * continuous states held fixed; knowns are states, inputs and parameters, unknowns are state derivatives,
 * outputs and local variables. The adjoint is assembled from one forward sweep per known.
 */
#include <math.h>
#include <string.h>
#include "instance.h"

#define POINT s->now.time, s->now.x, s->now.u, s->p, s->d, s->now.m

typedef struct {
    double x[N_X + 1], u[N_U + 1], p[N_P + 1]; /* seeds */
    double dx[N_X + 1], w[N_W + 1];            /* results */
} Sweep;

static int within(unsigned vr, unsigned first, int n) { return vr - first < (unsigned)n ? (int)(vr - first) : -1; }

static double *known_seed(Sweep *sweep, unsigned vr) {
    int k;
    if ((k = within(vr, VR_X, N_X)) >= 0) return sweep->x + k;
    if ((k = within(vr, VR_U, N_U)) >= 0) return sweep->u + k;
    if ((k = within(vr, VR_P, N_P)) >= 0) return sweep->p + k;
    return NULL;
}

static const double *unknown_result(const Sweep *sweep, unsigned vr) {
    int k;
    if ((k = within(vr, VR_DX, N_X)) >= 0) return sweep->dx + k;
    if ((k = within(vr, VR_W, N_W)) >= 0) return sweep->w + k;
    return NULL;
}

static Status check_references(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known,
                               size_t n_known) {
    Sweep any;
    for (size_t i = 0; i < n_known; i++)
        if (!known_seed(&any, known[i])) {
            instance_log(c, FAILED, LOG_ERROR, "value reference %u cannot be a known of a derivative", known[i]);
            return FAILED;
        }
    for (size_t i = 0; i < n_unknown; i++)
        if (!unknown_result(&any, unknown[i])) {
            instance_log(c, FAILED, LOG_ERROR, "value reference %u cannot be an unknown of a derivative", unknown[i]);
            return FAILED;
        }
    return instance_settle(c);
}

static Status run(Instance *c, Sweep *sweep) {
    const State *s = &c->s;
    double finite = 0.0;
    int failed = model_directional(POINT, sweep->x, sweep->u, sweep->p, sweep->dx, sweep->w);
    for (int k = 0; k < N_X; k++) finite += sweep->dx[k] - sweep->dx[k];
    for (int k = 0; k < N_W; k++) finite += sweep->w[k] - sweep->w[k];
    if (!failed && finite == 0.0) return OK;
    instance_log(c, DISCARD, LOG_DISCARD, "a directional derivative cannot be computed at time %.15g", s->now.time);
    return DISCARD;
}

Status instance_directional(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known,
                            size_t n_known, const double *seed, double *sensitivity) {
    Sweep sweep;
    Status status = check_references(c, unknown, n_unknown, known, n_known);
    if (status != OK) return status;
    memset(&sweep, 0, sizeof sweep);
    for (size_t i = 0; i < n_known; i++) *known_seed(&sweep, known[i]) += seed[i];
    if ((status = run(c, &sweep)) != OK) return status;
    for (size_t i = 0; i < n_unknown; i++) sensitivity[i] = *unknown_result(&sweep, unknown[i]);
    return OK;
}

Status instance_adjoint(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known,
                        size_t n_known, const double *seed, double *sensitivity) {
    Sweep sweep;
    Status status = check_references(c, unknown, n_unknown, known, n_known);
    for (size_t j = 0; status == OK && j < n_known; j++) {
        double sum = 0.0;
        memset(&sweep, 0, sizeof sweep);
        *known_seed(&sweep, known[j]) = 1.0;
        if ((status = run(c, &sweep)) != OK) break;
        for (size_t i = 0; i < n_unknown; i++) sum += seed[i] * *unknown_result(&sweep, unknown[i]);
        sensitivity[j] = sum;
    }
    return status;
}

Status instance_set_input_derivatives(Instance *c, const unsigned *vr, size_t n, const int *order,
                                      const double *values) {
    State *s = &c->s;
    for (size_t i = 0; i < n; i++) {
        const char *reason = within(vr[i], VR_U, N_U) < 0 ? "is not an input"
                             : order[i] != 1             ? "has input derivatives of order 1 only"
                             : !is_finite(values[i])     ? "is given a derivative that is not finite"
                                                         : NULL;
        if (!reason) continue;
        instance_log(c, FAILED, LOG_ERROR, "value reference %u %s", vr[i], reason);
        return FAILED;
    }
    if (n == 0) return OK;
    if (s->derivatives_used) memset(s->du, 0, sizeof s->du);
    s->derivatives_used = 0;
    for (size_t i = 0; i < n; i++) s->du[vr[i] - VR_U] = values[i];
    s->inputs_moving = 0;
    for (int k = 0; k < N_U; k++) s->inputs_moving |= s->du[k] != 0.0;
    c->jacobian_valid = 0; /* f_t contains them */
    return OK;
}

/* dw/dt = w_x f + w_u u' + w_t; the explicit time dependence, where there is one, by central difference. */
Status instance_output_derivatives(Instance *c, const unsigned *vr, size_t n, const int *order, double *values) {
    const State *s = &c->s;
    double early[N_W + 1], late[N_W + 1];
    Sweep sweep;
    Status status;
    for (size_t i = 0; i < n; i++) {
        const char *reason = within(vr[i], VR_W, N_Y) < 0 ? "is not an output"
                             : order[i] != 1             ? "has output derivatives of order 1 only"
                                                         : NULL;
        if (!reason) continue;
        instance_log(c, FAILED, LOG_ERROR, "value reference %u %s", vr[i], reason);
        return FAILED;
    }
    if (n == 0) return OK;
    if ((status = instance_settle(c)) != OK || (status = instance_derivatives(c)) != OK) return status;
    memset(&sweep, 0, sizeof sweep);
    memcpy(sweep.x, c->dx, sizeof(double) * N_X);
    memcpy(sweep.u, s->du, sizeof(double) * N_U);
    if ((status = run(c, &sweep)) != OK) return status;
    const double dt = 1e-6 * fmax(1.0, fabs(s->now.time));
    const int failed = model_outputs(s->now.time - dt, s->now.x, s->now.u, s->p, s->d, s->now.m, early) ||
                       model_outputs(s->now.time + dt, s->now.x, s->now.u, s->p, s->d, s->now.m, late);
    for (size_t i = 0; i < n; i++) {
        const int k = within(vr[i], VR_W, N_Y);
        const double value = sweep.w[k] + (failed ? 0.0 : (late[k] - early[k]) / (2.0 * dt));
        if (failed || !is_finite(value)) {
            instance_log(c, DISCARD, LOG_DISCARD, "an output derivative cannot be computed at time %.15g",
                         s->now.time);
            return DISCARD;
        }
        values[i] = value;
    }
    return OK;
}
