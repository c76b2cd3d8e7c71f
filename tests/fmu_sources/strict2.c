/* FMI 2.0 Co-Simulation test FMU that is a stickler: tau dx/dt = gain u - x, exact for an input held over the step.
 *
 * It returns fmi2Error for every call that FMI 2.0.4 does not allow in its present state, for a step of another size
 * than 10 ms, a step from another time than its own or beyond the stop time, a second live instance, and fmi2Reset.
 * What it does not offer (states, derivatives, asynchronous steps, texts) it does not export either.
 * It takes its gain's factor from resources/factor.txt, its memory from the importer, and logs with arguments.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"

typedef enum { INSTANTIATED = 1, INITIALIZATION = 2, STEPPING = 4, TERMINATED = 8 } State;
typedef struct {
    State state;
    double x, u, tau, gain, factor, time, stop;
    int order, ready;
    fmi2Boolean on;
    char* text;
    const fmi2CallbackFunctions* host;
} Model;
static int alive;

static fmi2Status wrong(Model* m, const char* what) {
    m->host->logger(m->host->componentEnvironment, "plant", fmi2Error, "logStatusError", "%s in state %d at %.3f s", what,
                    (int)m->state, m->time);
    return fmi2Error;
}
#define ALLOWED(states, what) Model* m = c; if (!(m->state & (states))) return wrong(m, what)

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
static double read_factor(const char* uri) {
    char path[4096] = "";
    size_t n = 0;
    if (strncmp(uri, "file:///", 8)) return NAN;
    for (const char* c = uri + 7; *c && n < sizeof path - 20; c++) { /* decode %20 and the like */
        unsigned code;
        if (*c == '%' && sscanf(c + 1, "%2x", &code) == 1) path[n++] = (char)code, c += 2;
        else path[n++] = *c;
    }
    strcat(path, "/factor.txt");
    double factor = NAN;
    FILE* file = fopen(path, "r");
    if (file) {
        if (fscanf(file, "%lf", &factor) != 1) factor = NAN;
        fclose(file);
    }
    return factor;
}
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
    (void)visible, (void)logging;
    double factor = resources ? read_factor(resources) : NAN;
    if (!name || !*name || type != fmi2CoSimulation || strcmp(guid, "{strict}") || isnan(factor) || alive) {
        host->logger(host->componentEnvironment, name, fmi2Error, "logStatusError", "cannot live: %d instances, %s", alive,
                     resources ? resources : "no resources");
        return NULL;
    }
    Model* m = host->allocateMemory(1, sizeof *m);
    m->text = host->allocateMemory(16, 1);
    alive++;
    m->state = INSTANTIATED, m->host = host, m->tau = 0.5, m->gain = 1.0, m->factor = factor, m->order = 1;
    return m;
}
void fmi2FreeInstance(fmi2Component c) {
    Model* m = c;
    m->host->freeMemory(m->text);
    m->host->freeMemory(m);
    alive--;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean controlled, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stops, fmi2Real stop) {
    ALLOWED(INSTANTIATED, "SetupExperiment");
    if (!stops || stop <= start || (controlled && !(tolerance > 0))) return wrong(m, "SetupExperiment without stop time");
    m->time = start, m->stop = stop, m->ready = 1;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    ALLOWED(INSTANTIATED, "EnterInitializationMode");
    if (!m->ready) return wrong(m, "EnterInitializationMode before SetupExperiment");
    m->state = INITIALIZATION;
    return fmi2OK;
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    ALLOWED(INITIALIZATION, "ExitInitializationMode");
    m->state = STEPPING;
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) {
    ALLOWED(STEPPING, "Terminate");
    m->state = TERMINATED;
    return fmi2OK;
}
fmi2Status fmi2Reset(fmi2Component c) { return wrong(c, "Reset"); }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_return) {
    (void)no_return;
    ALLOWED(STEPPING, "DoStep");
    if (fabs(time - m->time) > 1e-9) return wrong(m, "DoStep from another time");
    if (fabs(step - 0.01) > 1e-9) return wrong(m, "DoStep of another size than 10 ms");
    if (time + step > m->stop + 1e-9) return wrong(m, "DoStep beyond the stop time");
    double goal = m->factor * m->gain * (m->on ? 2.0 : 1.0) * m->order * m->u;
    m->x = goal + (m->x - goal) * exp(-step / m->tau);
    m->time += step;
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    ALLOWED(INITIALIZATION | STEPPING | TERMINATED, "GetReal");
    double all[] = {m->x, m->u, m->tau, m->gain, m->time};
    for (size_t i = 0; i < n; i++)
        if (r[i] > 4) return wrong(m, "GetReal"); else v[i] = all[r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    ALLOWED(INSTANTIATED | INITIALIZATION | STEPPING, "SetReal");
    for (size_t i = 0; i < n; i++) {
        if (r[i] == 1) m->u = v[i];
        else if (r[i] == 3) m->gain = v[i]; /* tunable */
        else if (r[i] == 2 && m->state == INSTANTIATED) m->tau = v[i]; /* fixed */
        else return wrong(m, "SetReal of a fixed parameter or an output");
    }
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) {
    ALLOWED(INITIALIZATION | STEPPING | TERMINATED, "GetInteger");
    (void)r;
    for (size_t i = 0; i < n; i++) v[i] = m->order;
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[]) {
    ALLOWED(INSTANTIATED, "SetInteger");
    (void)r;
    for (size_t i = 0; i < n; i++)
        if (v[i] < 1 || v[i] > 3) return wrong(m, "SetInteger out of its enumeration"); else m->order = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[]) {
    ALLOWED(INITIALIZATION | STEPPING | TERMINATED, "GetBoolean");
    (void)r;
    for (size_t i = 0; i < n; i++) v[i] = m->on;
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean v[]) {
    ALLOWED(INSTANTIATED, "SetBoolean");
    (void)r;
    for (size_t i = 0; i < n; i++)
        if (v[i] != fmi2True && v[i] != fmi2False) return wrong(m, "SetBoolean"); else m->on = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) {
    ALLOWED(INITIALIZATION | STEPPING | TERMINATED, "GetString");
    (void)r;
    for (size_t i = 0; i < n; i++) v[i] = m->text;
    return fmi2OK;
}
