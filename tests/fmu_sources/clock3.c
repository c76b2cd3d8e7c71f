/* FMI 3.0 test FMU, Co-Simulation with Event Mode and Model Exchange: clocks that the importer has to tick.
 *
 *     dx/dt = s - x;  at a tick of `sample`: s += gain order u (its sign turned where `turn`);
 *     `wait` counts down 0.05 s from each tick of `sample`: n counts its ticks.
 *
 * It refuses what FMI 3.0.2 does not allow: no Event Mode, a step across a tick, a discrete input outside of Event Mode,
 * a structural parameter outside of Configuration Mode. It returns early where x passes 1.
 */
#include <math.h>
#include <stdlib.h>
#include "fmi3Functions.h"

enum { VR_X = 1, VR_S, VR_U, VR_GAIN, VR_DX, VR_N, VR_TURN, VR_ORDER, VR_SAMPLE, VR_WAIT, VR_EARLY, VR_Z };
enum { INSTANTIATED, CONFIGURATION, INITIALIZATION, EVENT, STEP };
#define PERIOD 0.2
#define SHIFT 0.1
#define WAIT 0.05

typedef struct {
    double x, s, u, gain, time, next, wait;
    uint64_t order;
    int mode, n, early, exchange, above;
    bool turn, ticked, waited, changed;
} Model;

static void start(Model* m) {
    int exchange = m->exchange;
    *m = (Model){.gain = 1.0, .next = SHIFT, .wait = HUGE_VAL, .order = 1, .exchange = exchange};
}
static Model* create(int exchange) {
    Model* m = calloc(1, sizeof *m);
    m->exchange = exchange;
    start(m);
    return m;
}
const char* fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)required, (void)n, (void)update;
    if (event_mode && early_return) return create(0);
    log(environment, fmi3Error, "logStatusError", "it has clocks: event mode is needed");
    return NULL;
}
fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    return create(1);
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }

static fmi3Status go(Model* m, int from, int to) {
    if (m->mode != from) return fmi3Error;
    m->mode = to;
    return fmi3OK;
}
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return go(c, INSTANTIATED, CONFIGURATION); }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return go(c, CONFIGURATION, INSTANTIATED); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance, fmi3Float64 t0,
                                       fmi3Boolean stops, fmi3Float64 stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    ((Model*)c)->time = t0;
    return go(c, INSTANTIATED, INITIALIZATION);
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return go(c, INITIALIZATION, EVENT); }
fmi3Status fmi3EnterEventMode(fmi3Instance c) { return go(c, STEP, EVENT); }
fmi3Status fmi3EnterStepMode(fmi3Instance c) { return go(c, EVENT, STEP); }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return go(c, EVENT, STEP); }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { start(c); return fmi3OK; }

static double* real(Model* m, fmi3ValueReference vr) {
    switch (vr) {
        case VR_X: return &m->x;
        case VR_S: return &m->s;
        case VR_U: return &m->u;
        case VR_GAIN: return &m->gain;
        default: return NULL;
    }
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[], size_t nv) {
    Model* m = c;
    for (size_t i = 0; i < n && nv == n; i++) v[i] = vr[i] == VR_DX ? m->s - m->x : *real(m, vr[i]);
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 v[], size_t nv) {
    for (size_t i = 0; i < n && nv == n; i++) *real(c, vr[i]) = v[i];
    return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Int32 v[], size_t nv) {
    for (size_t i = 0; i < n && nv == n; i++) v[i] = vr[i] == VR_EARLY ? ((Model*)c)->early : ((Model*)c)->n;
    return fmi3OK;
}
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, bool v[], size_t nv) {
    for (size_t i = 0; i < n && nv == n; i++) v[i] = ((Model*)c)->turn;
    (void)vr;
    return fmi3OK;
}
fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const bool v[], size_t nv) {
    if (((Model*)c)->mode == STEP) return fmi3Error;
    for (size_t i = 0; i < n && nv == n; i++) ((Model*)c)->turn = v[i];
    (void)vr;
    return fmi3OK;
}
fmi3Status fmi3SetUInt64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 v[], size_t nv) {
    if (n != 1 || nv != 1 || vr[0] != VR_ORDER || ((Model*)c)->mode != CONFIGURATION) return fmi3Error;
    ((Model*)c)->order = v[0];
    return fmi3OK;
}
fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock v[]) {
    Model* m = c;
    if (m->mode != EVENT) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        double at = vr[i] == VR_SAMPLE ? m->next : m->wait;
        if (!v[i] || fabs(m->time - at) > 1e-9) return fmi3Error;
        if (vr[i] == VR_SAMPLE) m->ticked = true;
        else m->waited = true;
    }
    return fmi3OK;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 interval[],
                                  fmi3IntervalQualifier qualifier[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != VR_WAIT) return fmi3Error;
        interval[i] = WAIT;
        qualifier[i] = m->changed ? fmi3IntervalChanged : fmi3IntervalUnchanged;
        m->changed = false;
    }
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* again, fmi3Boolean* terminate, fmi3Boolean* nominals,
                                    fmi3Boolean* values, fmi3Boolean* defined, fmi3Float64* next) {
    Model* m = c;
    *again = *terminate = *nominals = *values = *defined = false;
    *next = 0.0;
    if (m->ticked) {
        m->s += m->gain * (double)m->order * (m->turn ? -m->u : m->u);
        m->next += PERIOD;
        m->wait = m->time + WAIT;
        m->changed = true;
    }
    if (m->waited) m->n++, m->wait = HUGE_VAL;
    m->ticked = m->waited = false;
    m->above = m->x > 1.0;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
    Model* m = c;
    (void)no_set;
    *event = *terminate = *early = false;
    if (m->mode != STEP || fabs(t - m->time) > 1e-9) return fmi3Error;
    if (t + h > fmin(m->next, m->wait) + 1e-9) return fmi3Error;
    double x = m->s + (m->x - m->s) * exp(-h), end = t + h;
    if (!m->above && x > 1.0) { /* up to where it passes 1, and not a bit further */
        end = t + log((m->s - m->x) / (m->s - 1.0)) + 1e-9;
        x = 1.0 + 1e-9 * (m->s - 1.0);
        m->above = 1;
        m->early++;
        *event = *early = true;
    }
    m->x = x;
    m->time = *last = end;
    return fmi3OK;
}

/* Model Exchange */
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set, fmi3Boolean* event, fmi3Boolean* terminate) {
    (void)c, (void)no_set;
    *event = *terminate = false;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { ((Model*)c)->time = t; return fmi3OK; }
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) { ((Model*)c)->x = x[n - 1]; return fmi3OK; }
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { x[n - 1] = ((Model*)c)->x; return fmi3OK; }
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
    dx[n - 1] = ((Model*)c)->s - ((Model*)c)->x;
    return fmi3OK;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) { (void)c, (void)z, (void)n; return fmi3OK; }
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    (void)c;
    x[n - 1] = 1.0;
    return fmi3OK;
}
