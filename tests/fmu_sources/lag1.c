/* FMI 1.0 Co-Simulation test FMU: tau dx/dt = u - x, exact for an input held over the step. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#define MODEL_IDENTIFIER lag1

typedef void* fmiComponent;
typedef unsigned int fmiValueReference;
typedef enum { fmiOK, fmiWarning, fmiDiscard, fmiError, fmiFatal, fmiPending } fmiStatus;
#define F(name) lag1_fmi##name

typedef struct { double tau, x, u; int steps; } Model;
const char* F(GetTypesPlatform)(void) { return "standard32"; }
const char* F(GetVersion)(void) { return "1.0"; }
fmiComponent F(InstantiateSlave)(const char* name, const char* guid, const char* location, const char* mime,
                                 double timeout, char visible, char interactive, void* functions, char logging) {
    (void)name, (void)location, (void)mime, (void)timeout, (void)visible, (void)interactive, (void)functions, (void)logging;
    if (strcmp(guid, "{lag1}")) return NULL;
    Model* m = calloc(1, sizeof *m);
    m->tau = 0.1;
    return m;
}
void F(FreeSlaveInstance)(fmiComponent c) { free(c); }
fmiStatus F(InitializeSlave)(fmiComponent c, double t0, char stops, double stop) { (void)c, (void)t0, (void)stops, (void)stop; return fmiOK; }
fmiStatus F(TerminateSlave)(fmiComponent c) { (void)c; return fmiOK; }
fmiStatus F(ResetSlave)(fmiComponent c) { (void)c; return fmiOK; }
fmiStatus F(SetDebugLogging)(fmiComponent c, char on) { (void)c, (void)on; return fmiOK; }
fmiStatus F(DoStep)(fmiComponent c, double t, double h, char is_new) {
    Model* m = c;
    (void)t, (void)is_new;
    if (m->u > 1e3) return fmiDiscard;
    m->x = (m->x - m->u) * exp(-h / m->tau) + m->u;
    m->steps++;
    return fmiOK;
}
static double* real(Model* m, fmiValueReference vr) { return vr == 1 ? &m->tau : vr == 2 ? &m->x : &m->u; }
fmiStatus F(GetReal)(fmiComponent c, const fmiValueReference vr[], size_t n, double v[]) {
    for (size_t i = 0; i < n; i++) v[i] = *real(c, vr[i]);
    return fmiOK;
}
fmiStatus F(SetReal)(fmiComponent c, const fmiValueReference vr[], size_t n, const double v[]) {
    for (size_t i = 0; i < n; i++) *real(c, vr[i]) = v[i];
    return fmiOK;
}
fmiStatus F(GetInteger)(fmiComponent c, const fmiValueReference vr[], size_t n, int v[]) {
    (void)vr;
    for (size_t i = 0; i < n; i++) v[i] = ((Model*)c)->steps;
    return fmiOK;
}
#define STUB(name) fmiStatus F(name)(void) { return fmiError; }
STUB(SetInteger) STUB(GetBoolean) STUB(SetBoolean) STUB(GetString) STUB(SetString)
STUB(SetRealInputDerivatives) STUB(GetRealOutputDerivatives) STUB(CancelStep) STUB(GetStatus)
STUB(GetRealStatus) STUB(GetIntegerStatus) STUB(GetBooleanStatus) STUB(GetStringStatus)
