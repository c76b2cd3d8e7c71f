/* FMI 2.0 Co-Simulation test FMU: a speed-controlled drive with plain friction at its load.
 *
 *     i = K_p (w_cmd - w) + K_i z,   dz/dt = w_cmd - w,   J dw/dt = k_t i - tau_load - b w - tau_c sgn(w) (or stick),
 *     dphi/dt = w
 *
 * Explicit Euler in steps of 20 us, and stick exactly: where the other torques would turn the load round within a step,
 * and are below tau_c, it stands. EULER: one step per communication step instead.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"

enum { W, PHI, I, W_CMD, LOAD, J, K_T, K_P, K_I, TAU_C, B, COUNT };
typedef struct { double v[COUNT], z; } Model;

static void start(Model* m) {
    memset(m, 0, sizeof *m);
    m->v[J] = 0.02, m->v[K_T] = 0.5, m->v[K_P] = 1.0, m->v[K_I] = 10.0;
}
static double current(const Model* m) { return m->v[K_P] * (m->v[W_CMD] - m->v[W]) + m->v[K_I] * m->z; }
static void step(Model* m, double h) {
    double* v = m->v;
    double w = v[W], drive = v[K_T] * current(m) - v[LOAD] - v[B] * w;
    double free = w + h * drive / v[J], most = h * v[TAU_C] / v[J];
    v[PHI] += h * w;
    m->z += h * (v[W_CMD] - w);
    v[W] = fabs(free) <= most ? 0.0 : free - copysign(most, free);
}

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)callbacks, (void)visible, (void)logging;
    Model* m = malloc(sizeof *m);
    start(m);
    return m;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real t0, fmi2Boolean stops,
                               fmi2Real stop) {
    (void)c, (void)tolerant, (void)tolerance, (void)t0, (void)stops, (void)stop;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { start(c); return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    (void)t, (void)no_set_state;
#ifdef EULER
    int n = 1;
#else
    int n = (int)fmax(1.0, round(h / 20e-6));
#endif
    for (int k = 0; k < n; k++) step(c, h / n);
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= COUNT) return fmi2Error;
        value[k] = vr[k] == I ? current(c) : ((Model*)c)->v[vr[k]];
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) {
        if (vr[k] <= I || vr[k] >= COUNT) return fmi2Error;
        ((Model*)c)->v[vr[k]] = value[k];
    }
    return fmi2OK;
}
