/* FMI 2.0 test FMU, Co-Simulation and Model Exchange: a first-order lag with faults on request.
 *
 *     tau dx/dt = k u - x,   y = x,   feed = u,   steps, above: an Integer and a Boolean output
 *
 * Co-Simulation integrates exactly for inputs that are linear over the step (fmi2SetRealInputDerivatives),
 * so a test can compare with the closed form to rounding. The Real parameter `fault` makes doStep (or the
 * function named below) misbehave at the first step that ends after the time `at`.
 */
#define _GNU_SOURCE
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "fmi2Functions.h"

enum { VR_TAU = 1, VR_K, VR_X, VR_U, VR_FEED, VR_FAULT, VR_AT, VR_DX, VR_TIME };   /* Real */
enum { VR_STEPS = 1, VR_OFFSET };                                                  /* Integer */
enum { VR_ABOVE = 1, VR_INVERT };                                                  /* Boolean */
enum {
    NONE, SEGFAULT, ABORT, EXIT, HANG, INIT_HANG, ERROR, FATAL, DISCARD, NOT_A_NUMBER, INFINITE, SHORT, MEMORY,
    FLOOD, FILES, PENDING, FREE_CRASH, INIT_CRASH, INIT_ERROR, CHILD, SLOW, TERM_ERROR, LEAK, CHDIR, SHUTDOWN
};

typedef struct {
    double tau, k, x, u, slope, before, fault, at, time, last, stop;
    int steps, offset, invert, fell_short, flooded;
    const fmi2CallbackFunctions* callbacks;
} Model;

static volatile double sink;
static char* volatile kept;

static void start(Model* m) {
    const fmi2CallbackFunctions* callbacks = m->callbacks;
    memset(m, 0, sizeof *m);
    m->callbacks = callbacks;
    m->tau = 0.1;
    m->k = 1.0;
    m->at = 0.5;
    m->stop = 1e300;
}

static volatile int* volatile nowhere;
static void crash(void) { *nowhere = 1; }

static void hang(void) {
    for (;;) sink += 1.0;
}

#include "hostile.h"

static fmi2Status refuse(Model* m, double t) {
    m->last = t;
    m->callbacks->logger(NULL, "lag", fmi2Discard, "logStatusDiscard", "step refused at t = %g in %s", t, "lag");
    return fmi2Discard;
}

static fmi2Status misbehave(Model* m, double t, double h) {
    switch ((int)m->fault) {
        case SEGFAULT: crash(); break;
        case ABORT: fprintf(stderr, "lag: assertion failed\n"); abort();
        case EXIT: exit(3);
        case HANG: hang(); break;
        case ERROR:
            m->callbacks->logger(NULL, "lag", fmi2Error, "logStatusError", "solver failed with %d in %s", 42, "lag");
            return fmi2Error;
        case FATAL: return fmi2Fatal;
        case DISCARD: return refuse(m, t);
        case NOT_A_NUMBER: m->x = NAN; break;
        case INFINITE: m->x = INFINITY; break;
        case SHORT: m->fell_short = 1; return refuse(m, t);
        case MEMORY:
            for (;;) {
                size_t n = 1 << 20;
                char* block = malloc(n);
                memset(block, 1, n);
                kept = block;
                usleep(200); /* growth is sampled: nothing real fills memory faster */
            }
        case FLOOD:
            for (int i = 0; i < 20000 && !m->flooded; i++) {
                printf("stdout line %d of a very talkative model ........................................\n", i);
                fprintf(stderr, "stderr line %d of a very talkative model ....................................\n", i);
            }
            m->flooded = 1;
            break;
        case FILES: {
            FILE* file = fopen("left_behind.txt", "a");
            fprintf(file, "step\n");
            fclose(file);
            break;
        }
        case PENDING: return fmi2Pending;
        case CHILD:
            if (fork() == 0) for (;;) sleep(60);
            abort();
        case SLOW: usleep((useconds_t)(1e6 * h)); break;
        case LEAK: {
            char* block = malloc(4 << 20);
            memset(block, 1, 4 << 20);
            kept = block;
            break;
        }
        case SHUTDOWN: kill(getpid(), SIGTERM); break;
        case CHDIR: if (chdir("/")) return fmi2Error; break;
        default: if (m->fault >= 100.0) hostile((int)m->fault - 100); break;
    }
    return fmi2OK;
}

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    (void)c, (void)on, (void)n, (void)names;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)resources, (void)visible, (void)logging;
#ifdef HANG_INSTANTIATE
    hang();
#endif
#ifdef CRASH_INSTANTIATE
    crash();
#endif
    if (strcmp(guid, "{lag}")) {
        functions->logger(NULL, "lag", fmi2Error, "logStatusError", "wrong GUID %s", guid);
        return NULL;
    }
    Model* m = functions->allocateMemory(1, sizeof(Model));
    m->callbacks = functions;
    start(m);
    return m;
}

void fmi2FreeInstance(fmi2Component c) {
    Model* m = c;
    if ((int)m->fault == FREE_CRASH) crash();
    m->callbacks->freeMemory(m);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real t0,
                               fmi2Boolean stops, fmi2Real stop) {
    Model* m = c;
    (void)tolerant, (void)tolerance;
#ifdef RESET_IN_SETUP /* as 20-sim does */
    start(m);
#endif
    m->time = m->last = t0;
    if (stops) m->stop = stop;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Model* m = c;
    if ((int)m->fault == INIT_HANG) hang();
    if ((int)m->fault == INIT_CRASH) crash();
    return (int)m->fault == INIT_ERROR ? fmi2Error : fmi2OK;
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return (int)((Model*)c)->fault == TERM_ERROR ? fmi2Error : fmi2OK; }

fmi2Status fmi2Reset(fmi2Component c) {
#ifdef WRONG_RESET
    double kept = ((Model*)c)->x;
    start(c);
    ((Model*)c)->x = kept;
#else
    start(c);
#endif
    return fmi2OK;
}

static double* real(Model* m, fmi2ValueReference vr) {
    switch (vr) {
        case VR_TAU: return &m->tau;
        case VR_K: return &m->k;
        case VR_X: return &m->x;
        case VR_U: return &m->u;
        case VR_FAULT: return &m->fault;
        case VR_AT: return &m->at;
        case VR_TIME: return &m->time;
        default: return NULL;
    }
}
static double derivative(const Model* m) { return (m->k * m->u - m->x) / m->tau; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == VR_FEED) value[i] = m->u;
        else if (vr[i] == VR_DX) value[i] = derivative(m);
        else if (real(m, vr[i])) value[i] = *real(m, vr[i]);
        else return fmi2Error;
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        double* target = real(c, vr[i]);
        if (!target) return fmi2Error;
        *target = value[i];
        if (vr[i] == VR_U) ((Model*)c)->slope = 0.0;
    }
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) value[i] = vr[i] == VR_STEPS ? m->steps + m->offset : m->offset;
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != VR_OFFSET) return fmi2Error;
        ((Model*)c)->offset = value[i];
    }
    return fmi2OK;
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) value[i] = vr[i] == VR_ABOVE ? (m->x > 0.5) != (m->invert != 0) : m->invert;
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != VR_INVERT) return fmi2Error;
        ((Model*)c)->invert = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != VR_U || order[i] != 1) return fmi2Error;
#ifdef WRONG_SLOPE /* a kink sends it off, as it does Dymola's solver */
        if (value[i] != ((Model*)c)->before) ((Model*)c)->x += 0.3;
        ((Model*)c)->before = value[i];
#endif
        ((Model*)c)->slope = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    Model* m = c;
    (void)no_set_state;
#ifdef NO_STEPS
    return fmi2Error;
#endif
    if (fabs(t - m->last) > 1e-9 || t + h > m->stop + 1e-9) return fmi2Error;
    if (t + h > m->at) {
        fmi2Status status = misbehave(m, t, h);
        if (status != fmi2OK) return status;
    }
    /* exact for u(t) = u + slope t */
    double a = -h / m->tau, ramp = m->k * m->slope;
    double particular = m->k * m->u - ramp * m->tau;
    m->x = (m->x - particular) * exp(a) + particular + ramp * h;
    m->u += m->slope * h;
    m->time = m->last = t + h;
    m->steps++;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value) {
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Model*)c)->last;
    return fmi2OK;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean* value) {
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = ((Model*)c)->fell_short;
    return fmi2OK;
}

/* Model Exchange */
fmi2Status fmi2EnterEventMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo* info) {
    (void)c;
    memset(info, 0, sizeof *info);
    return fmi2OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean* event, fmi2Boolean* end) {
    (void)c, (void)no_set;
    *event = *end = 0;
    return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { ((Model*)c)->time = t; return fmi2OK; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    if (n != 1) return fmi2Error;
    ((Model*)c)->x = x[0];
    return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    if (n != 1) return fmi2Error;
    x[0] = ((Model*)c)->x;
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    Model* m = c;
    if (n != 1) return fmi2Error;
    if (m->time > m->at) {
        fmi2Status status = misbehave(m, m->time, 0.0);
        if (status != fmi2OK) return status;
    }
    dx[0] = derivative(m);
    return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { (void)c, (void)z, (void)n; return fmi2OK; }
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi2OK;
}
