/* Test FMU with texts, FMI 1.0 (Co-Simulation and Model Exchange), 2.0 or 3.0 (Co-Simulation) by -DFMI=...:
 *
 *     y = k u
 *
 * k is 1 for the curve "flat", otherwise the number in the file "<curve>.txt" of the resources, or, where `curve` begins
 * with "/", in that file. Any other curve ends the initialization with an error. The text input `mode` doubles y while it
 * is "twice". FMI 1.0 gives no place of the resources: there k is the length of the text in bytes. FMI 2.0 forgets its
 * start values in fmi2SetupExperiment, as 20-sim's do.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if FMI == 2
#include "fmi2Functions.h"
#elif FMI == 3
#include "fmi3Functions.h"
#endif

typedef struct { double u, k, gain; char curve[512], mode[64], resources[2048]; } Model;

static void start(Model* m) {
    m->u = 0.0, m->k = 1.0, m->gain = 1.0;
    strcpy(m->curve, "flat");
    strcpy(m->mode, "once");
}
static Model* create(const char* token, const char* resources) {
    if (strcmp(token, "{texts}")) return NULL;
    Model* m = calloc(1, sizeof *m);
    start(m);
    snprintf(m->resources, sizeof m->resources, "%s", resources ? resources : "");
    return m;
}
static double output(const Model* m) { return m->gain * m->k * m->u * (strcmp(m->mode, "twice") ? 1.0 : 2.0); }
static int initialize(Model* m) { /* 1 where the curve cannot be read */
    if (!strcmp(m->curve, "flat")) return 0;
#if FMI == 1
    m->k = (double)strlen(m->curve);
    return 0;
#else
    char path[3000];
    if (*m->curve == '/') snprintf(path, sizeof path, "%s", m->curve);
    else snprintf(path, sizeof path, "%s/%s.txt", m->resources, m->curve);
    FILE* file = fopen(path, "r");
    if (!file) return 1;
    int read = fscanf(file, "%lf", &m->k);
    fclose(file);
    return read != 1;
#endif
}
static void set(Model* m, unsigned reference, const char* text) {
    /* the importer's text lives as long as the call */
    if (reference % 2 == 0) snprintf(m->curve, sizeof m->curve, "%s", text);
    else snprintf(m->mode, sizeof m->mode, "%s", text);
}

#if FMI == 1
typedef unsigned int Reference;
typedef int Status;
#define F(name) texts_fmi##name
const char* F(GetTypesPlatform)(void) { return "standard32"; }
const char* F(GetModelTypesPlatform)(void) { return "standard32"; }
const char* F(GetVersion)(void) { return "1.0"; }
void* F(InstantiateSlave)(const char* name, const char* guid, const char* location, const char* mime, double timeout,
                          char visible, char interactive, void* functions, char logging) {
    (void)name, (void)location, (void)mime, (void)timeout, (void)visible, (void)interactive, (void)functions, (void)logging;
    return create(guid, NULL);
}
typedef struct { void *log, *allocate, *free; } Callbacks;
void* F(InstantiateModel)(const char* name, const char* guid, Callbacks callbacks, char logging) {
    (void)name, (void)callbacks, (void)logging;
    return create(guid, NULL);
}
void F(FreeSlaveInstance)(void* c) { free(c); }
void F(FreeModelInstance)(void* c) { free(c); }
Status F(InitializeSlave)(void* c, double t0, char stops, double stop) {
    (void)t0, (void)stops, (void)stop;
    return initialize(c) ? 3 : 0;
}
typedef struct { char converged, references, values, terminate, upcoming; double next; } EventInfo;
Status F(Initialize)(void* c, char controlled, double tolerance, EventInfo* info) {
    (void)controlled, (void)tolerance;
    *info = (EventInfo){.converged = 1};
    return initialize(c) ? 3 : 0;
}
Status F(EventUpdate)(void* c, char intermediate, EventInfo* info) {
    (void)c, (void)intermediate;
    *info = (EventInfo){.converged = 1};
    return 0;
}
Status F(SetTime)(void* c, double t) { (void)c, (void)t; return 0; }
Status F(CompletedIntegratorStep)(void* c, char* event) { (void)c; *event = 0; return 0; }
Status F(GetDerivatives)(void* c, double dx[], size_t n) { (void)c, (void)dx, (void)n; return 0; }
Status F(GetContinuousStates)(void* c, double x[], size_t n) { (void)c, (void)x, (void)n; return 0; }
Status F(SetContinuousStates)(void* c, const double x[], size_t n) { (void)c, (void)x, (void)n; return 0; }
Status F(GetNominalContinuousStates)(void* c, double x[], size_t n) { (void)c, (void)x, (void)n; return 0; }
Status F(GetEventIndicators)(void* c, double z[], size_t n) { (void)c, (void)z, (void)n; return 0; }
Status F(Terminate)(void* c) { (void)c; return 0; }
Status F(TerminateSlave)(void* c) { (void)c; return 0; }
Status F(ResetSlave)(void* c) { start(c); return 0; }
Status F(SetDebugLogging)(void* c, char on) { (void)c, (void)on; return 0; }
Status F(DoStep)(void* c, double t, double h, char is_new) { (void)c, (void)t, (void)h, (void)is_new; return 0; }
Status F(GetReal)(void* c, const Reference vr[], size_t n, double v[]) {
    for (size_t i = 0; i < n; i++) v[i] = vr[i] ? ((Model*)c)->u : output(c);
    return 0;
}
Status F(SetReal)(void* c, const Reference vr[], size_t n, const double v[]) {
    for (size_t i = 0; i < n; i++) if (vr[i] == 1) ((Model*)c)->u = v[i];
    return 0;
}
Status F(SetString)(void* c, const Reference vr[], size_t n, const char* const v[]) {
    for (size_t i = 0; i < n; i++) set(c, vr[i], v[i]);
    return 0;
}
#define STUB(name) Status F(name)(void) { return 3; }
STUB(GetInteger) STUB(SetInteger) STUB(GetBoolean) STUB(SetBoolean) STUB(GetString) STUB(SetRealInputDerivatives)
STUB(GetRealOutputDerivatives) STUB(CancelStep) STUB(GetStatus) STUB(GetRealStatus) STUB(GetIntegerStatus)
STUB(GetBooleanStatus) STUB(GetStringStatus) STUB(GetStateValueReferences)
#endif

#if FMI == 2
const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)callbacks, (void)visible, (void)logging;
    return create(guid, strncmp(resources, "file://", 7) ? NULL : resources + 7);
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real t0, fmi2Boolean stops,
                               fmi2Real stop) {
    (void)tolerant, (void)tolerance, (void)t0, (void)stops, (void)stop;
    start(c);
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return initialize(c) ? fmi2Error : fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { start(c); return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    (void)c, (void)t, (void)h, (void)no_set_state;
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real v[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) v[i] = vr[i] == 0 ? output(m) : vr[i] == 1 ? m->u : m->gain;
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real v[]) {
    Model* m = c;
    for (size_t i = 0; i < n; i++) *(vr[i] == 1 ? &m->u : &m->gain) = v[i];
    return fmi2OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String v[]) {
    for (size_t i = 0; i < n; i++) set(c, vr[i], v[i]);
    return fmi2OK;
}
#endif

#if FMI == 3
const char* fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)visible, (void)logging, (void)event_mode, (void)early_return, (void)required, (void)n;
    (void)environment, (void)log, (void)update;
    return create(token, resources);
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance, fmi3Float64 t0,
                                       fmi3Boolean stops, fmi3Float64 stop) {
    (void)tolerant, (void)tolerance, (void)t0, (void)stops, (void)stop;
    return initialize(c) ? fmi3Error : fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { start(c); return fmi3OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
    (void)c, (void)no_set_state;
    *event = *terminate = *early = false;
    *last = t + h;
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[], size_t values) {
    (void)values;
    for (size_t i = 0; i < n; i++) v[i] = vr[i] == 0 ? output(c) : ((Model*)c)->u;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 v[], size_t values) {
    (void)values;
    for (size_t i = 0; i < n; i++) if (vr[i] == 1) ((Model*)c)->u = v[i];
    return fmi3OK;
}
fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3String v[], size_t values) {
    if (values != n) return fmi3Error;
    for (size_t i = 0; i < n; i++) set(c, vr[i], v[i]);
    return fmi3OK;
}
#endif
