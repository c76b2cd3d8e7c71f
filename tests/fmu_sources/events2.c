/* FMI 2.0 Model Exchange test FMU with every kind of event.
 *
 * A ball falls on a floor (state event: h <= 0 while falling, velocity reversed times e). At the time `kick`
 * (time event) its velocity is increased by `dv`. Above height `ceiling` the FMU asks for a step event, which
 * counts it. At the time `end` it terminates. The Boolean input `off` switches gravity off (input event).
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"

enum { VR_H = 1, VR_V, VR_A, VR_E, VR_KICK, VR_DV, VR_CEILING, VR_END, VR_DH };
enum { VR_BOUNCES = 1, VR_STEPS };
enum { VR_OFF = 1 };

typedef struct {
    double h, v, g, e, kick, dv, ceiling, end, time;
    int bounces, steps, off, falls, kicked, in_events;
    const fmi2CallbackFunctions* callbacks;
} Model;

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)guid, (void)resources, (void)visible, (void)logging;
    if (type != fmi2ModelExchange) return NULL;
    Model* m = functions->allocateMemory(1, sizeof *m);
    m->callbacks = functions;
    m->h = 1.0;
    m->g = 9.81;
    m->e = 0.7;
    m->kick = m->end = m->ceiling = 1e300;
    return m;
}
void fmi2FreeInstance(fmi2Component c) { ((Model*)c)->callbacks->freeMemory(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real t0,
                               fmi2Boolean stops, fmi2Real stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    ((Model*)c)->time = t0;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { ((Model*)c)->in_events = 1; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }

static double* real(Model* m, fmi2ValueReference vr) {
    double* all[] = {NULL, &m->h, &m->v, NULL, &m->e, &m->kick, &m->dv, &m->ceiling, &m->end};
    return vr < sizeof all / sizeof *all ? all[vr] : NULL;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == VR_A) value[i] = m->off ? 0.0 : -m->g;
        else if (vr[i] == VR_DH) value[i] = m->v;
        else value[i] = *real(m, vr[i]);
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) *real(c, vr[i]) = value[i];
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) value[i] = vr[i] == VR_BOUNCES ? m->bounces : m->steps;
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
    Model* m = c;
    /* a discrete input must not change in Continuous-Time Mode */
    if (n != 1 || vr[0] != VR_OFF || (!m->in_events && m->time > 0.0 && m->off != value[0])) return fmi2Error;
    m->off = value[0];
    return fmi2OK;
}
fmi2Status fmi2EnterEventMode(fmi2Component c) { ((Model*)c)->in_events = 1; return fmi2OK; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { ((Model*)c)->in_events = 0; return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo* info) {
    Model* m = c;
    memset(info, 0, sizeof *info);
    if (m->h <= 0.0 && m->v < 0.0) {
        m->v *= -m->e;
        m->h = 0.0;
        m->bounces++;
        info->valuesOfContinuousStatesChanged = 1;
    }
    if (!m->kicked && m->time >= m->kick - 1e-12) {
        m->kicked = 1;
        m->v += m->dv;
        info->valuesOfContinuousStatesChanged = 1;
    }
    if (m->h > m->ceiling) m->steps++;
    info->terminateSimulation = m->time >= m->end - 1e-12;
    double next = m->kicked ? m->end : fmin(m->kick, m->end);
    info->nextEventTimeDefined = next < 1e299;
    info->nextEventTime = next;
    return fmi2OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean* event, fmi2Boolean* end) {
    Model* m = c;
    (void)no_set;
    *event = m->h > m->ceiling && m->steps == 0;
    *end = 0;
    return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { ((Model*)c)->time = t; return fmi2OK; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    Model* m = c;
    if (n != 2) return fmi2Error;
    m->h = x[0];
    m->v = x[1];
    return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    Model* m = c;
    if (n != 2) return fmi2Error;
    x[0] = m->h;
    x[1] = m->v;
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    Model* m = c;
    if (n != 2) return fmi2Error;
    dx[0] = m->v;
    dx[1] = m->off ? 0.0 : -m->g;
    return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    if (n != 1) return fmi2Error;
    z[0] = ((Model*)c)->h;
    return fmi2OK;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi2OK;
}
