/* fmi2.c - the FMI 2.0 interface (FMI 2.0.4): Co-Simulation and Model Exchange.
 *
 * Every function checks the instance, its state (state machines of sections 3.2.3 and 4.2.4) and its pointers; a
 * call that is not allowed returns fmi2Error with a logged reason and leaves the instance as it was. Only a failed
 * initialization puts it into the error state. A communication step that cannot be done returns fmi2Discard; the
 * instance is then back at its last communication point (fmi2LastSuccessfulTime) and waits for fmi2SetFMUstate,
 * fmi2Reset or fmi2Terminate.
 */
#include <float.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"
#include "discrete.h"
#include "instance.h"
#include "trajectory.h"

typedef struct {
    Instance core; /* first member: an Instance * is a Component * */
    fmi2CallbackFunctions callbacks;
    char *name;
} Component;

enum {
    INITIALIZED = EVENT_MODE | CONTINUOUS | STEP_MODE | STEP_FAILED | TERMINATED | IN_ERROR,
    READABLE = INITIALIZATION | INITIALIZED,
    ANY = INSTANTIATED | READABLE
};

static void emit(Instance *c, Status status, const char *category, const char *message) {
    const Component *self = (const Component *)c;
    if (self->callbacks.logger)
        self->callbacks.logger(self->callbacks.componentEnvironment, self->name, (fmi2Status)status, category, message);
}

#define REQUIRE(phases, kind) \
    do { if (!instance_allowed(c, __func__, phases, kind)) return fmi2Error; } while (0)
#define REQUIRE_ARRAYS(n, first, second) \
    do { if (!instance_given(c, __func__, n, first, second)) return fmi2Error; } while (0)
#define CORE (&((Component *)c)->core)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    REQUIRE(ANY, 0);
    REQUIRE_ARRAYS(nCategories, categories, categories);
    return (fmi2Status)instance_set_logging(CORE, loggingOn, nCategories, categories);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn) {
    Component *self;
    const char *why = NULL;
    (void)fmuResourceLocation;
    (void)visible;
    if (!functions) return NULL;
    if (!instanceName || !*instanceName) why = "fmi2Instantiate: the instance name is missing";
    else if (!fmuGUID || strcmp(fmuGUID, model_guid) != 0) why = "fmi2Instantiate: the GUID is that of another FMU";
    else if (fmuType != fmi2CoSimulation && fmuType != fmi2ModelExchange) why = "fmi2Instantiate: unknown FMU type";
    if (why) {
        if (functions->logger)
            functions->logger(functions->componentEnvironment, instanceName ? instanceName : "?", fmi2Error,
                              "logStatusError", why);
        return NULL;
    }
    self = calloc(1, sizeof *self);
    if (self) self->name = malloc(strlen(instanceName) + 1);
    if (!self || !self->name) {
        free(self);
        return NULL;
    }
    strcpy(self->name, instanceName);
    self->callbacks = *functions;
    self->core.kind = fmuType == fmi2CoSimulation ? CO_SIMULATION : MODEL_EXCHANGE;
    self->core.emit = emit;
    self->core.categories = loggingOn ? LOG_ALL : 0u;
    instance_reset(&self->core);
    return self;
}

void fmi2FreeInstance(fmi2Component c) {
    Component *self = c;
    if (!self) return;
    free(self->name);
    free(self);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    REQUIRE(INSTANTIATED, 0);
    return (fmi2Status)instance_setup(CORE, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    REQUIRE(INSTANTIATED, 0);
    CORE->s.phase = INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    REQUIRE(INITIALIZATION, 0);
    const Status status = instance_initialize(CORE);
    if (status != OK) {
        CORE->s.phase = IN_ERROR;
        return (fmi2Status)status;
    }
    CORE->s.modes_due = 0;
    CORE->s.phase = CORE->kind == CO_SIMULATION ? STEP_MODE : EVENT_MODE;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    REQUIRE(EVENT_MODE | CONTINUOUS | STEP_MODE | STEP_FAILED, 0);
    CORE->s.phase = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    REQUIRE(ANY, 0);
    instance_reset(CORE);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    REQUIRE(READABLE, 0);
    REQUIRE_ARRAYS(nvr, vr, value);
    return (fmi2Status)instance_get(CORE, vr, nvr, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    REQUIRE(INSTANTIATED | INITIALIZATION | EVENT_MODE | CONTINUOUS | STEP_MODE, 0);
    REQUIRE_ARRAYS(nvr, vr, value);
    return (fmi2Status)instance_set(CORE, vr, nvr, value);
}

/* The model has Real variables only: empty requests are fine, any value reference is an error. */
static fmi2Status no_such_type(fmi2Component c, const char *function, int phases, size_t nvr) {
    if (!instance_allowed(c, function, phases, 0)) return fmi2Error;
    if (nvr == 0) return fmi2OK;
    instance_log(c, FAILED, LOG_ERROR, "%s: this model has Real variables only", function);
    return fmi2Error;
}

#define SETTABLE (INSTANTIATED | INITIALIZATION | EVENT_MODE | STEP_MODE)
#define OTHER_TYPE(Name)                                                                                        \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2##Name value[]) {  \
        (void)vr;                                                                                               \
        (void)value;                                                                                            \
        return no_such_type(c, __func__, READABLE, nvr);                                                        \
    }                                                                                                           \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,                        \
                             const fmi2##Name value[]) {                                                        \
        (void)vr;                                                                                               \
        (void)value;                                                                                            \
        return no_such_type(c, __func__, SETTABLE, nvr);                                                        \
    }
OTHER_TYPE(Integer)
OTHER_TYPE(Boolean)
OTHER_TYPE(String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY, 0);
    REQUIRE_ARRAYS(1, FMUstate, FMUstate);
    return (fmi2Status)snapshot_take(CORE, (Snapshot **)FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    REQUIRE(ANY, 0);
    REQUIRE_ARRAYS(1, FMUstate, FMUstate);
    return (fmi2Status)snapshot_restore(CORE, FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY, 0);
    if (FMUstate) snapshot_free((Snapshot **)FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    REQUIRE(ANY, 0);
    REQUIRE_ARRAYS(1, FMUstate, size);
    *size = snapshot_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    REQUIRE(ANY, 0);
    REQUIRE_ARRAYS(1, FMUstate, serializedState);
    if (size < snapshot_size()) {
        instance_log(CORE, FAILED, LOG_ERROR, "fmi2SerializeFMUstate: the buffer is too small");
        return fmi2Error;
    }
    snapshot_write(FMUstate, (unsigned char *)serializedState);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    REQUIRE(ANY, 0);
    REQUIRE_ARRAYS(1, serializedState, FMUstate);
    return (fmi2Status)snapshot_read(CORE, (const unsigned char *)serializedState, size, (Snapshot **)FMUstate);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[]) {
    REQUIRE(READABLE & ~IN_ERROR, 0);
    REQUIRE_ARRAYS(nUnknown, vUnknown_ref, dvUnknown);
    REQUIRE_ARRAYS(nKnown, vKnown_ref, dvKnown);
    return (fmi2Status)instance_directional(CORE, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown);
}

/* Model Exchange */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    REQUIRE(CONTINUOUS | EVENT_MODE, MODEL_EXCHANGE);
    CORE->s.phase = EVENT_MODE;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    REQUIRE(EVENT_MODE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(1, eventInfo, eventInfo);
    memset(eventInfo, 0, sizeof *eventInfo);
    const Status status = instance_update_modes(CORE); /* settles all at once: no further update is needed */
    const double next = discrete_next(CORE);
    eventInfo->valuesOfContinuousStatesChanged = CORE->s.states_jumped;
    CORE->s.states_jumped = 0;
    eventInfo->nextEventTimeDefined = next < DBL_MAX;
    eventInfo->nextEventTime = next < DBL_MAX ? next : 0.0;
    return (fmi2Status)(status == OK ? discrete_assertions(CORE) : status);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    REQUIRE(EVENT_MODE, MODEL_EXCHANGE);
    CORE->s.phase = CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation) {
    int missed;
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(CONTINUOUS, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(1, enterEventMode, terminateSimulation);
    *terminateSimulation = fmi2False;
    *enterEventMode = fmi2False;
    if (instance_missed_event(CORE, &missed) != OK) return fmi2Discard;
    if (missed) *enterEventMode = fmi2True;
    return (fmi2Status)discrete_assertions(CORE);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    REQUIRE(EVENT_MODE | CONTINUOUS, MODEL_EXCHANGE);
    return (fmi2Status)instance_set_time(CORE, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    REQUIRE(CONTINUOUS, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nx, x, x);
    return (fmi2Status)instance_set_states(CORE, x, nx);
}

#define CONTINUOUS_READABLE (INITIALIZATION | EVENT_MODE | CONTINUOUS | TERMINATED | IN_ERROR)

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    REQUIRE(CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nx, derivatives, derivatives);
    return (fmi2Status)instance_copy(CORE, COPY_DERIVATIVES, derivatives, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    REQUIRE(CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(ni, eventIndicators, eventIndicators);
    return (fmi2Status)instance_copy(CORE, COPY_INDICATORS, eventIndicators, ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    REQUIRE(CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nx, x, x);
    return (fmi2Status)instance_copy(CORE, COPY_STATES, x, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    REQUIRE(INSTANTIATED | CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nx, x_nominal, x_nominal);
    return (fmi2Status)instance_copy(CORE, COPY_NOMINALS, x_nominal, nx);
}

/* Co-Simulation */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    REQUIRE(INSTANTIATED | INITIALIZATION | STEP_MODE, CO_SIMULATION);
    REQUIRE_ARRAYS(nvr, vr, value);
    REQUIRE_ARRAYS(nvr, order, value);
    return (fmi2Status)instance_set_input_derivatives(CORE, vr, nvr, order, value);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    REQUIRE(STEP_MODE | STEP_FAILED | TERMINATED, CO_SIMULATION);
    REQUIRE_ARRAYS(nvr, vr, value);
    REQUIRE_ARRAYS(nvr, order, value);
    return (fmi2Status)instance_output_derivatives(CORE, vr, nvr, order, value);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint; /* one-step method: going back needs no memory of the past */
    REQUIRE(STEP_MODE, CO_SIMULATION);
    const Status status = instance_do_step(CORE, currentCommunicationPoint, communicationStepSize);
    if (status == DISCARD) CORE->s.phase = STEP_FAILED;
    return (fmi2Status)status;
}

/* Beside the FMI: a whole run in one call (trajectory.h). */
#define thsaTrajectory1 fmi2FullName(thsaTrajectory1)

FMI2_Export fmi2Status thsaTrajectory1(fmi2Component c, Trajectory *run);

fmi2Status thsaTrajectory1(fmi2Component c, Trajectory *run) {
    REQUIRE(STEP_MODE, CO_SIMULATION);
    REQUIRE_ARRAYS(1, run, run);
    const Status status = trajectory_run(CORE, run);
    if (status == DISCARD) CORE->s.phase = STEP_FAILED;
    return (fmi2Status)status;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    REQUIRE(IN_STEP, CO_SIMULATION); /* steps are never pending */
    return fmi2Error;
}

#define STATUS_PHASES (STEP_MODE | STEP_FAILED | TERMINATED)

static fmi2Status no_status(fmi2Component c, const char *function) {
    instance_log(c, DISCARD, LOG_DISCARD, "%s: this status is not available", function);
    return fmi2Discard;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    REQUIRE(STATUS_PHASES, CO_SIMULATION);
    REQUIRE_ARRAYS(1, value, value);
    if (s != fmi2DoStepStatus) return no_status(c, __func__);
    *value = CORE->s.phase == STEP_FAILED ? fmi2Discard : fmi2OK;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    REQUIRE(STATUS_PHASES, CO_SIMULATION);
    REQUIRE_ARRAYS(1, value, value);
    if (s != fmi2LastSuccessfulTime) return no_status(c, __func__);
    *value = CORE->s.last_step_end;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    REQUIRE(STATUS_PHASES, CO_SIMULATION);
    REQUIRE_ARRAYS(1, value, value);
    return no_status(c, __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    REQUIRE(STATUS_PHASES, CO_SIMULATION);
    REQUIRE_ARRAYS(1, value, value);
    if (s != fmi2Terminated) return no_status(c, __func__);
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    REQUIRE(STATUS_PHASES, CO_SIMULATION);
    REQUIRE_ARRAYS(1, value, value);
    if (s != fmi2PendingStatus) return no_status(c, __func__);
    *value = "";
    return fmi2OK;
}
