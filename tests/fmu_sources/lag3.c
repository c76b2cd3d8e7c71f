/* FMI 3.0 test FMU, Co-Simulation and Model Exchange: tau dx/dt = k u - x, y = x, with intermediate update.
 *
 * Every communication step is done in SUBSTEPS; before each the input is requested through the callback,
 * and it is taken as linear over the substep, so the result is exact for inputs that are linear over the
 * communication step. Model Exchange has a state event: `count` counts passages of x through 0.5.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi3Functions.h"

enum { VR_TIME = 0, VR_TAU, VR_K, VR_X, VR_U, VR_FEED, VR_DX, VR_STOP_AT, VR_COUNT, VR_FLAG, VR_SINGLE, VR_Z, VR_FAULT };
#define SUBSTEPS 3

typedef struct {
    double tau, k, x, u, time, stop_at;
    int count, above, fault, stepping;
    float single;
    bool flag;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    fmi3IntermediateUpdateCallback update;
} Model;

#define FORBIDDEN(name, ...) fmi3Status name(__VA_ARGS__) { return fmi3Error; }

static void start(Model* m) {
    m->tau = 0.1;
    m->k = 1.0;
    m->x = m->u = m->time = 0.0;
    m->stop_at = 1e300;
    m->count = m->above = m->fault = m->stepping = 0;
    m->single = 0.0f;
    m->flag = false;
}
static Model* create(fmi3String token, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    if (strcmp(token, "{lag3}")) {
        log(environment, fmi3Error, "logStatusError", "wrong instantiation token");
        return NULL;
    }
    Model* m = calloc(1, sizeof *m);
    start(m);
    m->environment = environment;
    m->log = log;
    return m;
}

const char* fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)required, (void)n;
    if (event_mode || early_return) return NULL;
    Model* m = create(token, environment, log);
    if (m) m->update = update;
    return m;
}
fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    (void)name, (void)resources, (void)visible, (void)logging;
    return create(token, environment, log);
}
void fmi3FreeInstance(fmi3Instance instance) { free(instance); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerant, fmi3Float64 tolerance,
                                       fmi3Float64 t0, fmi3Boolean stops, fmi3Float64 stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    ((Model*)instance)->time = t0;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    Model* m = instance;
    m->above = m->x > 0.5;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance instance) { (void)instance; return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance instance) { start(instance); return fmi3OK; }

static double* real(Model* m, fmi3ValueReference vr) {
    switch (vr) {
        case VR_TIME: return &m->time;
        case VR_TAU: return &m->tau;
        case VR_K: return &m->k;
        case VR_X: return &m->x;
        case VR_U: case VR_FEED: return &m->u;
        case VR_STOP_AT: return &m->stop_at;
        default: return NULL;
    }
}
static double derivative(const Model* m) { return (m->k * m->u - m->x) / m->tau; }

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[], size_t nv) {
    Model* m = instance;
    if (nv != n) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == VR_DX) v[i] = derivative(m);
        else if (vr[i] == VR_Z) v[i] = m->x - 0.5;
        else if (real(m, vr[i])) v[i] = *real(m, vr[i]);
        else return fmi3Error;
    }
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const fmi3Float64 v[], size_t nv) {
    if (nv != n) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        double* target = real(instance, vr[i]);
        if (!target) return fmi3Error;
        *target = v[i];
    }
    return fmi3OK;
}
fmi3Status fmi3GetFloat32(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Float32 v[], size_t nv) {
    for (size_t i = 0; i < n && nv == n; i++) v[i] = vr[i] == VR_SINGLE ? ((Model*)instance)->single : NAN;
    return fmi3OK;
}
fmi3Status fmi3SetFloat32(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const fmi3Float32 v[], size_t nv) {
    if (n != 1 || nv != 1 || vr[0] != VR_SINGLE) return fmi3Error;
    ((Model*)instance)->single = v[0];
    return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Int32 v[], size_t nv) {
    if (n != 1 || nv != 1) return fmi3Error;
    v[0] = vr[0] == VR_COUNT ? ((Model*)instance)->count : ((Model*)instance)->fault;
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const fmi3Int32 v[], size_t nv) {
    if (n != 1 || nv != 1 || vr[0] != VR_FAULT) return fmi3Error;
    ((Model*)instance)->fault = v[0];
    return fmi3OK;
}
fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, bool v[], size_t nv) {
    if (n != 1 || nv != 1 || vr[0] != VR_FLAG) return fmi3Error;
    v[0] = ((Model*)instance)->flag;
    return fmi3OK;
}
fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const bool v[], size_t nv) {
    if (n != 1 || nv != 1 || vr[0] != VR_FLAG) return fmi3Error;
    ((Model*)instance)->flag = v[0];
    return fmi3OK;
}

static void request(Model* m, double t) {
    bool early = true;
    double early_time = 0.0;
    if (m->update) m->update(m->environment, t, true, true, false, false, &early, &early_time);
    if (early && m->update) abort();
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
    Model* m = instance;
    (void)no_set;
    *event = *terminate = *early = false;
    *last = t;
    if (fabs(t - m->time) > 1e-9) return fmi3Error;
    if (m->fault == 1) return fmi3Discard;
    if (m->fault == 2) return fmi3OK; /* falls short */
    double s = h / SUBSTEPS, u0 = m->u;
    for (int i = 0; i < SUBSTEPS; i++) {
        request(m, t + (i + 1) * s);
        double slope = (m->u - u0) / s, a = -s / m->tau, ramp = m->k * slope;
        double particular = m->k * u0 - ramp * m->tau;
        m->x = (m->x - particular) * exp(a) + particular + ramp * s;
        u0 = m->u;
    }
    m->time = *last = t + h;
    if (m->time > m->stop_at) *terminate = true;
    return fmi3OK;
}

/* Model Exchange */
fmi3Status fmi3EnterEventMode(fmi3Instance instance) { (void)instance; return fmi3OK; }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) { (void)instance; return fmi3OK; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean* again, fmi3Boolean* terminate,
                                    fmi3Boolean* nominals, fmi3Boolean* values, fmi3Boolean* defined, fmi3Float64* next) {
    Model* m = instance;
    *again = *terminate = *nominals = *values = *defined = false;
    *next = 0.0;
    if ((m->x > 0.5) != m->above) {
        m->above = !m->above;
        m->count++;
    }
    return fmi3OK;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_set, fmi3Boolean* event, fmi3Boolean* terminate) {
    Model* m = instance;
    (void)no_set;
    *event = false;
    *terminate = m->time > m->stop_at;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 t) { ((Model*)instance)->time = t; return fmi3OK; }
fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 x[], size_t n) {
    if (n != 1) return fmi3Error;
    ((Model*)instance)->x = x[0];
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n) {
    if (n != 1) return fmi3Error;
    x[0] = ((Model*)instance)->x;
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 dx[], size_t n) {
    if (n != 1) return fmi3Error;
    dx[0] = derivative(instance);
    return fmi3OK;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 z[], size_t n) {
    if (n != 1) return fmi3Error;
    z[0] = ((Model*)instance)->x - 0.5;
    return fmi3OK;
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n) {
    (void)instance;
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi3OK;
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t n,
                                        const fmi3ValueReference knowns[], size_t m, const fmi3Float64 seed[],
                                        size_t ns, fmi3Float64 out[], size_t no) {
    if (n != 1 || m != 1 || ns != 1 || no != 1 || unknowns[0] != VR_DX || knowns[0] != VR_X) return fmi3Error;
    out[0] = -seed[0] / ((Model*)instance)->tau;
    return fmi3OK;
}
