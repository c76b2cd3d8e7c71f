/* FMI 2.0 Co-Simulation test FMU that breaks one promise per compiler flag: tau dx/dt = -x, y = x, x(0) = 1.
 *
 * EULER          doStep is one forward Euler step: the result depends on the communication step
 * KEEPS_VALUES   fmi2Reset forgets the state but not the start values that were set
 * SHARED         a static counter leaks from one instance into the next
 * PER_PROCESS    the result depends on the process
 * LEAKS          an instance leaves 64 KiB behind
 * AT_REST        x(0) = 0: nothing moves
 * HANDLES        an instance leaves a file open
 */
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "fmi2Functions.h"

typedef struct {
    double x, tau;
} Model;

#ifdef SHARED
static int instances;
#endif
#ifdef LEAKS
static char* volatile behind; /* else the compiler drops the allocation */
#endif

static double start_value(void) {
    double x = 1.0;
#ifdef AT_REST
    x = 0.0;
#endif
#ifdef SHARED
    x += 1e-3 * instances++;
#endif
#ifdef PER_PROCESS
    x += 1e-6 * getpid();
#endif
    return x;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)functions, (void)visible, (void)logging;
    Model* m = calloc(1, sizeof *m);
    m->x = start_value();
    m->tau = 0.5;
#ifdef LEAKS
    char* left = malloc(1 << 16);
    memset(left, 1, 1 << 16);
    behind = left;
#endif
#ifdef HANDLES
    if (open("/dev/null", O_RDONLY) < 0) return NULL;
#endif
    return m;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real t0,
                               fmi2Boolean stops, fmi2Real stop) {
    (void)c, (void)tolerant, (void)tolerance, (void)t0, (void)stops, (void)stop;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2Reset(fmi2Component c) {
    Model* m = c;
    m->x = start_value();
#ifndef KEEPS_VALUES
    m->tau = 0.5;
#endif
    return fmi2OK;
}

static double* real(Model* m, fmi2ValueReference vr) { return vr == 1 ? &m->tau : &m->x; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) value[k] = *real(c, vr[k]);
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) *real(c, vr[k]) = value[k];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean final) {
    Model* m = c;
    (void)t, (void)final;
#ifdef EULER
    m->x -= h * m->x / m->tau;
#else
    m->x *= exp(-h / m->tau);
#endif
    return fmi2OK;
}
