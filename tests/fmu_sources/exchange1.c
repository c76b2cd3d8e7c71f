/* FMI 1.0 Model Exchange test FMU: a lag tau dy/dt = k u - y, a ball that falls from 1 m and bounces (state events),
 * and a time event at `at`, from which on `late` (Boolean) is true and k counts twice. */
#include <stdlib.h>
#include <string.h>

typedef void* fmiComponent;
typedef unsigned int fmiValueReference;
typedef char fmiBoolean;
typedef enum { fmiOK, fmiWarning, fmiDiscard, fmiError, fmiFatal } fmiStatus;
typedef struct {
    void (*logger)(fmiComponent, const char*, fmiStatus, const char*, const char*, ...);
    void* (*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void*);
} fmiCallbackFunctions;
typedef struct {
    fmiBoolean iterationConverged, stateValueReferencesChanged, stateValuesChanged, terminateSimulation, upcomingTimeEvent;
    double nextEventTime;
} fmiEventInfo;
#define F(name) exchange1_fmi##name

typedef struct {
    double time, tau, k, u, at, y, h, v;
    int bounces;
    fmiBoolean late, initialized;
    fmiCallbackFunctions functions;
} Model;
const char* F(GetModelTypesPlatform)(void) { return "standard32"; }
const char* F(GetVersion)(void) { return "1.0"; }
fmiComponent F(InstantiateModel)(const char* name, const char* guid, fmiCallbackFunctions functions, fmiBoolean logging) {
    (void)logging;
    if (strcmp(guid, "{exchange1}")) {
        functions.logger(NULL, name, fmiError, "error", "The GUID %s is wrong.", guid);
        return NULL;
    }
    Model* m = functions.allocateMemory(1, sizeof *m);
    m->functions = functions;
    m->tau = 0.1, m->k = 1.0, m->at = 1e9, m->h = 1.0;
    return m;
}
void F(FreeModelInstance)(fmiComponent c) { ((Model*)c)->functions.freeMemory(c); }
fmiStatus F(SetDebugLogging)(fmiComponent c, fmiBoolean on) { (void)c, (void)on; return fmiOK; }
fmiStatus F(SetTime)(fmiComponent c, double t) { ((Model*)c)->time = t; return fmiOK; }
fmiStatus F(SetContinuousStates)(fmiComponent c, const double x[], size_t n) {
    Model* m = c;
    if (n != 3 || !m->initialized) return fmiError;
    m->y = x[0], m->h = x[1], m->v = x[2];
    return fmiOK;
}
fmiStatus F(CompletedIntegratorStep)(fmiComponent c, fmiBoolean* event) { (void)c; *event = 0; return fmiOK; }
static void tell(Model* m, fmiEventInfo* info) {
    memset(info, 0, sizeof *info);
    info->iterationConverged = 1;
    info->upcomingTimeEvent = !m->late;
    info->nextEventTime = m->at;
}
fmiStatus F(Initialize)(fmiComponent c, fmiBoolean controlled, double tolerance, fmiEventInfo* info) {
    Model* m = c;
    (void)controlled, (void)tolerance;
    m->initialized = 1;
    tell(m, info);
    return fmiOK;
}
fmiStatus F(EventUpdate)(fmiComponent c, fmiBoolean intermediate, fmiEventInfo* info) {
    Model* m = c;
    (void)intermediate;
    if (!m->late && m->time >= m->at) m->late = 1;
    int bounces = m->h <= 0.0 && m->v < 0.0;
    if (bounces) m->h = 0.0, m->v *= -0.7, m->bounces++;
    tell(m, info);
    info->stateValuesChanged = bounces;
    return fmiOK;
}
fmiStatus F(GetContinuousStates)(fmiComponent c, double x[], size_t n) {
    Model* m = c;
    if (n != 3) return fmiError;
    x[0] = m->y, x[1] = m->h, x[2] = m->v;
    return fmiOK;
}
fmiStatus F(GetNominalContinuousStates)(fmiComponent c, double x[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmiOK;
}
fmiStatus F(GetDerivatives)(fmiComponent c, double dx[], size_t n) {
    Model* m = c;
    if (n != 3) return fmiError;
    dx[0] = ((m->late ? 2.0 : 1.0) * m->k * m->u - m->y) / m->tau, dx[1] = m->v, dx[2] = -9.81;
    return fmiOK;
}
fmiStatus F(GetEventIndicators)(fmiComponent c, double z[], size_t n) {
    if (n == 1) z[0] = ((Model*)c)->h;
    return n == 1 ? fmiOK : fmiError;
}
fmiStatus F(GetStateValueReferences)(fmiComponent c, fmiValueReference r[], size_t n) { (void)c, (void)r, (void)n; return fmiOK; }
fmiStatus F(Terminate)(fmiComponent c) { (void)c; return fmiOK; }
static double* real(Model* m, fmiValueReference r) {
    double* all[] = {&m->tau, &m->k, &m->u, &m->at, &m->y, &m->h, &m->v};
    return r < 7 ? all[r] : NULL;
}
fmiStatus F(GetReal)(fmiComponent c, const fmiValueReference r[], size_t n, double v[]) {
    for (size_t i = 0; i < n; i++)
        if (!real(c, r[i])) return fmiError; else v[i] = *real(c, r[i]);
    return fmiOK;
}
fmiStatus F(SetReal)(fmiComponent c, const fmiValueReference r[], size_t n, const double v[]) {
    for (size_t i = 0; i < n; i++)
        if (r[i] > 3 || (((Model*)c)->initialized && r[i] != 2)) return fmiError; else *real(c, r[i]) = v[i];
    return fmiOK;
}
fmiStatus F(GetInteger)(fmiComponent c, const fmiValueReference r[], size_t n, int v[]) {
    (void)r;
    for (size_t i = 0; i < n; i++) v[i] = ((Model*)c)->bounces;
    return fmiOK;
}
fmiStatus F(GetBoolean)(fmiComponent c, const fmiValueReference r[], size_t n, fmiBoolean v[]) {
    (void)r;
    for (size_t i = 0; i < n; i++) v[i] = ((Model*)c)->late;
    return fmiOK;
}
#define STUB(name) fmiStatus F(name)(void) { return fmiError; }
STUB(SetInteger) STUB(SetBoolean) STUB(GetString) STUB(SetString)
