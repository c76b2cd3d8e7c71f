/* FMI 2.0 test FMU, Co-Simulation: a first-order lag with habits of tools, chosen by -D.
 *
 *     tau dy/dt = gain u - y
 *
 * ONCE: one instance per process, and never another. FIXED_STEP: steps of 0.01 s only. FIRST_VALUE=x: the output is
 * x before the first step. OTHER_START: the parameters start elsewhere than the model description says. PARTS: no step is
 * done further than 4 ms; what is left is for the next call. LICENCE=t: lost after so many seconds. JUMPS: y jumps by 1
 * after 0.2345 s. EULER: one explicit step per communication step. SLOW=t: each step takes so many microseconds,
 * from SLOW_FROM on.
 * OWN_STEP: whole steps of 10 ms, as many as it takes to reach the end, as 20-sim does.
 * NAN_ABOVE=u: y is no number where the input is above u. ALONE: no other instance of any such FMU lives in the process.
 * FIRST_WINS: every instance of a process has the parameters of the first one.
 * KEEPS: each instance of a process starts 0.01 higher than the one before.
 * SETUP_FORGETS: fmi2SetupExperiment overwrites start values.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "fmi2Functions.h"

typedef struct {
    double y, u, tau, gain;
    int steps;
    double time;
    const fmi2CallbackFunctions* callbacks;
} Model;

static void start(Model* m) {
    m->y = m->u = 0.0;
    m->tau = 0.1;
    m->gain = 1.0;
    m->steps = 0;
    m->time = 0.0;
#ifdef OTHER_START
    m->gain = 7.0;
#endif
}

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    (void)c, (void)on, (void)n, (void)names;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)visible, (void)logging;
#ifdef ONCE
    static int count;
    if (count++) {
        callbacks->logger(NULL, "habits", fmi2Error, "logStatusError", "only one instance per process");
        return NULL;
    }
#endif
#ifdef ALONE
    char here[32];
    const char* lives = getenv("HABITS_LIVES"); /* one environment for all libraries of a process */
    snprintf(here, sizeof here, "%d", (int)getpid());
    if (lives && !strcmp(lives, here)) return NULL;
    setenv("HABITS_LIVES", here, 1);
#endif
    Model* m = callbacks->allocateMemory(1, sizeof(Model));
    m->callbacks = callbacks;
    start(m);
#ifdef KEEPS
    static int before;
    m->y = 0.01 * before++;
#endif
    return m;
}
void fmi2FreeInstance(fmi2Component c) {
#ifdef ALONE
    unsetenv("HABITS_LIVES");
#endif
    ((Model*)c)->callbacks->freeMemory(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real t0,
                               fmi2Boolean stops, fmi2Real stop) {
    (void)c, (void)tolerant, (void)tolerance, (void)t0, (void)stops, (void)stop;
#ifdef SETUP_FORGETS
    start(c);
#endif
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
#ifdef FIRST_WINS
    static Model first;
    Model* m = c;
    if (!first.tau) first = *m;
    m->tau = first.tau;
    m->gain = first.gain;
#endif
    (void)c;
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { start(c); return fmi2OK; }

static double* real(Model* m, fmi2ValueReference vr) {
    double* all[] = {&m->y, &m->u, &m->tau, &m->gain};
    return vr < 4 ? all[vr] : NULL;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (!real(c, vr[i])) return fmi2Error;
        value[i] = *real(c, vr[i]);
#ifdef FIRST_VALUE
        if (vr[i] == 0 && !((Model*)c)->steps) value[i] = FIRST_VALUE;
#endif
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (!real(c, vr[i])) return fmi2Error;
        *real(c, vr[i]) = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    Model* m = c;
    (void)t, (void)no_set_state;
#ifdef FIXED_STEP
    if (fabs(h - 0.01) > 1e-9) return fmi2Error;
#endif
#ifdef SLOW
#ifndef SLOW_FROM
#define SLOW_FROM 0.0
#endif
    if (t >= SLOW_FROM) usleep(SLOW);
#endif
#ifdef LICENCE
    if (t + h > LICENCE) {
        m->callbacks->logger(NULL, "habits", fmi2Error, "logStatusError", "the licence was lost");
        return fmi2Error;
    }
#endif
#ifdef PARTS
    if (fabs(t - m->time) > 1e-9) return fmi2Error;
    int whole = h <= 0.004 + 1e-12;
    h = whole ? h : 0.004;
    m->time += h;
#endif
#ifdef JUMPS
    if (t < 0.2345 && t + h >= 0.2345) m->y += 1.0;
#endif
#ifdef NAN_ABOVE
    if (m->u > NAN_ABOVE) m->y = NAN;
#endif
#ifdef OWN_STEP
    for (; m->time < t + h; m->time += 0.01) m->y += (m->gain * m->u - m->y) * (1.0 - exp(-0.01 / m->tau));
    return fmi2OK;
#endif
#ifdef EULER
    m->y += (m->gain * m->u - m->y) * h / m->tau;
#else
    m->y += (m->gain * m->u - m->y) * (1.0 - exp(-h / m->tau));
#endif
    m->steps++;
#ifdef PARTS
    if (!whole) return fmi2Discard;
#endif
    return fmi2OK;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value) {
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Model*)c)->time;
    return fmi2OK;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean* value) {
    (void)c;
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = fmi2False;
    return fmi2OK;
}
