/* fmi3.c - the FMI 3.0 interface (FMI 3.0.1): Co-Simulation and Model Exchange.
 *
 * Every function checks the instance, its state (section 2.3 and the state machines of 3.2 and 4.2) and its
 * pointers; a call that is not allowed returns fmi3Error with a logged reason and leaves the instance as it was.
 * A communication step that cannot be done returns fmi3Discard and leaves the instance at its last communication
 * point, from where a shorter step may be tried.
 * Inputs within a communication step: FMI 3 has no input derivatives. If the importer names inputs among its
 * required intermediate variables, it is asked for them at the end of each internal step before that step is
 * done, and they are interpolated linearly; otherwise inputs are constant over the communication step.
 * An importer that allows early return may end a communication step at any intermediate update that follows an internal
 * step, by asking for a return at a time that has been reached.
 * Event Mode in Co-Simulation is optional: with eventModeUsed the importer may announce jumps of inputs; the
 * model's own events are handled inside fmi3DoStep in both cases. Scheduled Execution and clocks do not exist.
 */
#include <float.h>
#include <stdlib.h>
#include <string.h>
#include "fmi3Functions.h"
#include "discrete.h"
#include "instance.h"
#include "trajectory.h"

typedef struct {
    Instance core; /* first member: an Instance * is a Component * */
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log_message;
    fmi3IntermediateUpdateCallback intermediate_update;
    int may_set, may_get; /* in intermediate update */
    int event_mode_used;  /* survives a reset, as does: */
    int may_return;       /* early, after an intermediate update */
} Component;

enum {
    READABLE = INITIALIZATION | EVENT_MODE | CONTINUOUS | STEP_MODE | TERMINATED | IN_ERROR | INTERMEDIATE,
    STATE_SETTABLE = INSTANTIATED | (READABLE & ~INTERMEDIATE),
    DERIVATIVES = INITIALIZATION | EVENT_MODE | CONTINUOUS | STEP_MODE | TERMINATED,
    CONTINUOUS_READABLE = INITIALIZATION | EVENT_MODE | CONTINUOUS | TERMINATED
};

#define REQUIRE(phases, kind) \
    do { if (!instance_allowed(instance, __func__, phases, kind)) return fmi3Error; } while (0)
#define REQUIRE_ARRAYS(n, first, second) \
    do { if (!instance_given(instance, __func__, n, first, second)) return fmi3Error; } while (0)
#define CORE (&((Component *)instance)->core)

static void emit(Instance *c, Status status, const char *category, const char *message) {
    const Component *self = (const Component *)c;
    if (self->log_message) self->log_message(self->environment, (fmi3Status)status, category, message);
}

static fmi3Status refuse(fmi3Instance instance, const char *function, const char *why) {
    instance_log(instance, FAILED, LOG_ERROR, "%s: %s", function, why);
    return fmi3Error;
}

static void call_back(Component *self, double time, int set, int get, int finished) {
    fmi3Boolean early = fmi3False;
    fmi3Float64 early_time = time;
    const int can_return = finished && self->may_return;
    self->may_set = set;
    self->may_get = get;
    self->core.s.phase = INTERMEDIATE;
    self->intermediate_update(self->environment, time, set != 0, get != 0, finished != 0, can_return != 0,
                              &early, &early_time);
    self->core.s.phase = IN_STEP;
    if (can_return && early && early_time <= time) self->core.return_early = 1;
}

/* Ask for the inputs at the end of the internal step and interpolate linearly from the present ones. */
static void before_step(Instance *c, double time) {
    double now[N_U + 1];
    State *s = &c->s;
    memcpy(now, s->now.u, sizeof now);
    call_back((Component *)c, time, 1, 0, 0);
    s->inputs_moving = 0;
    for (int k = 0; k < N_U; k++) {
        s->du[k] = (s->now.u[k] - now[k]) / (time - s->now.time);
        s->inputs_moving |= s->du[k] != 0.0;
    }
    memcpy(s->now.u, now, sizeof now);
    c->jacobian_valid = 0;
}

static void after_step(Instance *c) { call_back((Component *)c, c->s.now.time, 0, 1, 1); }

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    REQUIRE(STATE_SETTABLE, 0);
    REQUIRE_ARRAYS(nCategories, categories, categories);
    return (fmi3Status)instance_set_logging(CORE, loggingOn, nCategories, categories);
}

static Component *create(Kind kind, fmi3String name, fmi3String token, fmi3Boolean logging,
                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log_message) {
    Component *self;
    const char *why = !name || !*name                           ? "the instance name is missing"
                      : !token || strcmp(token, model_guid) != 0 ? "the instantiation token is that of another FMU"
                                                                 : NULL;
    if (why) {
        if (log_message) log_message(environment, fmi3Error, "logStatusError", why);
        return NULL;
    }
    self = calloc(1, sizeof *self);
    if (!self) return NULL;
    self->environment = environment;
    self->log_message = log_message;
    self->core.kind = kind;
    self->core.emit = emit;
    self->core.categories = logging ? LOG_ALL : 0u;
    instance_reset(&self->core);
    return self;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)resourcePath;
    (void)visible;
    return create(MODEL_EXCHANGE, instanceName, instantiationToken, loggingOn, instanceEnvironment, logMessage);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate) {
    Component *self;
    (void)resourcePath;
    (void)visible;
    self = create(CO_SIMULATION, instanceName, instantiationToken, loggingOn, instanceEnvironment, logMessage);
    if (!self) return NULL;
    self->event_mode_used = eventModeUsed;
    self->may_return = earlyReturnAllowed;
    self->intermediate_update = intermediateUpdate;
    if (!intermediateUpdate) return self;
    for (size_t i = 0; requiredIntermediateVariables && i < nRequiredIntermediateVariables; i++) {
        if (instance_is_input(requiredIntermediateVariables[i])) self->core.before_step = before_step;
        else self->core.after_step = after_step;
    }
    return self;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage,
                                               fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    if (logMessage)
        logMessage(instanceEnvironment, fmi3Error, "logStatusError", "this FMU has no Scheduled Execution");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) { free(instance); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    REQUIRE(INSTANTIATED, 0);
    const Status status = instance_setup(CORE, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime);
    if (status == OK) CORE->s.phase = INITIALIZATION;
    return (fmi3Status)status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    REQUIRE(INITIALIZATION, 0);
    const Component *self = instance;
    const Status status = instance_initialize(CORE);
    if (status != OK) {
        CORE->s.phase = IN_ERROR;
        return (fmi3Status)status;
    }
    CORE->s.modes_due = 0;
    CORE->s.phase = CORE->kind == MODEL_EXCHANGE || self->event_mode_used ? EVENT_MODE : STEP_MODE;
    return fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    const Component *self = instance;
    REQUIRE(CONTINUOUS | STEP_MODE, 0);
    if (CORE->kind == CO_SIMULATION && !self->event_mode_used)
        return refuse(instance, __func__, "the instance was created with eventModeUsed = false");
    CORE->s.phase = EVENT_MODE;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    REQUIRE(EVENT_MODE | CONTINUOUS | STEP_MODE, 0);
    CORE->s.phase = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    REQUIRE(STATE_SETTABLE, 0);
    instance_reset(CORE);
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    REQUIRE(READABLE | INSTANTIATED, 0);
    REQUIRE_ARRAYS(nValueReferences, valueReferences, values);
    if (nValues != nValueReferences) return refuse(instance, __func__, "all variables are scalars: nValues is wrong");
    if (CORE->s.phase == INTERMEDIATE && !((Component *)instance)->may_get)
        return refuse(instance, __func__, "variables cannot be read in this intermediate update");
    return (fmi3Status)instance_get(CORE, valueReferences, nValueReferences, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    REQUIRE(INSTANTIATED | INITIALIZATION | EVENT_MODE | CONTINUOUS | STEP_MODE | INTERMEDIATE, 0);
    REQUIRE_ARRAYS(nValueReferences, valueReferences, values);
    if (nValues != nValueReferences) return refuse(instance, __func__, "all variables are scalars: nValues is wrong");
    if (CORE->s.phase == INTERMEDIATE && !((Component *)instance)->may_set)
        return refuse(instance, __func__, "variables cannot be set in this intermediate update");
    return (fmi3Status)instance_set(CORE, valueReferences, nValueReferences, values);
}

/* The model has Float64 variables only: empty requests are fine, any value reference is an error. */
static fmi3Status no_such_type(fmi3Instance instance, const char *function, int phases, size_t n) {
    if (!instance_allowed(instance, function, phases, 0)) return fmi3Error;
    return n == 0 ? fmi3OK : refuse(instance, function, "this model has Float64 variables only");
}

#define OTHER_TYPE(Name)                                                                                         \
    fmi3Status fmi3Get##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[],                  \
                             size_t nValueReferences, fmi3##Name values[], size_t nValues) {                     \
        (void)valueReferences, (void)values, (void)nValues;                                                      \
        return no_such_type(instance, __func__, READABLE | INSTANTIATED, nValueReferences);                      \
    }                                                                                                            \
    fmi3Status fmi3Set##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[],                  \
                             size_t nValueReferences, const fmi3##Name values[], size_t nValues) {               \
        (void)valueReferences, (void)values, (void)nValues;                                                      \
        return no_such_type(instance, __func__, INSTANTIATED | INITIALIZATION | EVENT_MODE | STEP_MODE,          \
                            nValueReferences);                                                                   \
    }
OTHER_TYPE(Float32)
OTHER_TYPE(Int8)
OTHER_TYPE(UInt8)
OTHER_TYPE(Int16)
OTHER_TYPE(UInt16)
OTHER_TYPE(Int32)
OTHER_TYPE(UInt32)
OTHER_TYPE(Int64)
OTHER_TYPE(UInt64)
OTHER_TYPE(Boolean)
OTHER_TYPE(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues) {
    (void)valueReferences, (void)valueSizes, (void)values, (void)nValues;
    return no_such_type(instance, __func__, READABLE | INSTANTIATED, nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues) {
    (void)valueReferences, (void)valueSizes, (void)values, (void)nValues;
    return no_such_type(instance, __func__, INSTANTIATED | INITIALIZATION | EVENT_MODE | STEP_MODE, nValueReferences);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[]) {
    (void)valueReferences, (void)values;
    return no_such_type(instance, __func__, READABLE | INSTANTIATED, nValueReferences);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[]) {
    (void)valueReferences, (void)values;
    return no_such_type(instance, __func__, INSTANTIATED | INITIALIZATION | EVENT_MODE | STEP_MODE, nValueReferences);
}

/* Dependencies are in the model description; the run-time queries serve changed dimensions, which do not exist. */
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies) {
    (void)valueReference, (void)nDependencies;
    REQUIRE(STATE_SETTABLE, 0);
    return refuse(instance, __func__, "providesPerElementDependencies is false");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies) {
    (void)dependent, (void)elementIndicesOfDependent, (void)independents, (void)elementIndicesOfIndependents;
    (void)dependencyKinds, (void)nDependencies;
    REQUIRE(STATE_SETTABLE, 0);
    return refuse(instance, __func__, "providesPerElementDependencies is false");
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(STATE_SETTABLE, 0);
    REQUIRE_ARRAYS(1, FMUState, FMUState);
    return (fmi3Status)snapshot_take(CORE, (Snapshot **)FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    REQUIRE(STATE_SETTABLE, 0);
    REQUIRE_ARRAYS(1, FMUState, FMUState);
    return (fmi3Status)snapshot_restore(CORE, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(STATE_SETTABLE, 0);
    if (FMUState) snapshot_free((Snapshot **)FMUState);
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    REQUIRE(STATE_SETTABLE, 0);
    REQUIRE_ARRAYS(1, FMUState, size);
    *size = snapshot_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size) {
    REQUIRE(STATE_SETTABLE, 0);
    REQUIRE_ARRAYS(1, FMUState, serializedState);
    if (size < snapshot_size()) return refuse(instance, __func__, "the buffer is too small");
    snapshot_write(FMUState, serializedState);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    REQUIRE(STATE_SETTABLE, 0);
    REQUIRE_ARRAYS(1, serializedState, FMUState);
    return (fmi3Status)snapshot_read(CORE, serializedState, size, (Snapshot **)FMUState);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    REQUIRE(DERIVATIVES, 0);
    REQUIRE_ARRAYS(nUnknowns, unknowns, sensitivity);
    REQUIRE_ARRAYS(nKnowns, knowns, seed);
    if (nSeed != nKnowns || nSensitivity != nUnknowns) return refuse(instance, __func__, "array sizes do not match");
    return (fmi3Status)instance_directional(CORE, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    REQUIRE(DERIVATIVES, 0);
    REQUIRE_ARRAYS(nUnknowns, unknowns, seed);
    REQUIRE_ARRAYS(nKnowns, knowns, sensitivity);
    if (nSeed != nUnknowns || nSensitivity != nKnowns) return refuse(instance, __func__, "array sizes do not match");
    return (fmi3Status)instance_adjoint(CORE, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    REQUIRE(STATE_SETTABLE, 0);
    return refuse(instance, __func__, "the model has no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    REQUIRE(STATE_SETTABLE, 0);
    return refuse(instance, __func__, "the instance is not in Configuration Mode");
}

/* Clocks: none. */
#define CLOCK_ARGUMENTS fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences
#define NO_CLOCKS(unused)                                                \
    do {                                                                 \
        (void)valueReferences, (void)nValueReferences, (void)(unused);   \
        REQUIRE(STATE_SETTABLE, 0);                                      \
        return refuse(instance, __func__, "the model has no clocks");    \
    } while (0)

fmi3Status fmi3GetIntervalDecimal(CLOCK_ARGUMENTS, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]) {
    (void)qualifiers;
    NO_CLOCKS(intervals);
}

fmi3Status fmi3GetIntervalFraction(CLOCK_ARGUMENTS, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[]) {
    (void)resolutions, (void)qualifiers;
    NO_CLOCKS(counters);
}

fmi3Status fmi3GetShiftDecimal(CLOCK_ARGUMENTS, fmi3Float64 shifts[]) { NO_CLOCKS(shifts); }

fmi3Status fmi3GetShiftFraction(CLOCK_ARGUMENTS, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)resolutions;
    NO_CLOCKS(counters);
}

fmi3Status fmi3SetIntervalDecimal(CLOCK_ARGUMENTS, const fmi3Float64 intervals[]) { NO_CLOCKS(intervals); }

fmi3Status fmi3SetIntervalFraction(CLOCK_ARGUMENTS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    (void)resolutions;
    NO_CLOCKS(counters);
}

fmi3Status fmi3SetShiftDecimal(CLOCK_ARGUMENTS, const fmi3Float64 shifts[]) { NO_CLOCKS(shifts); }

fmi3Status fmi3SetShiftFraction(CLOCK_ARGUMENTS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    (void)resolutions;
    NO_CLOCKS(counters);
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    REQUIRE(INITIALIZATION | EVENT_MODE, 0);
    return (fmi3Status)instance_settle(CORE);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    REQUIRE(EVENT_MODE, 0);
    REQUIRE_ARRAYS(1, discreteStatesNeedUpdate, terminateSimulation);
    REQUIRE_ARRAYS(1, nominalsOfContinuousStatesChanged, valuesOfContinuousStatesChanged);
    REQUIRE_ARRAYS(1, nextEventTimeDefined, nextEventTime);
    *discreteStatesNeedUpdate = *terminateSimulation = *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = *nextEventTimeDefined = fmi3False;
    *nextEventTime = 0.0;
    const Status status = instance_update_modes(CORE); /* settles all at once: no further update is needed */
    const double next = discrete_next(CORE);
    *valuesOfContinuousStatesChanged = CORE->s.states_jumped;
    CORE->s.states_jumped = 0;
    *nextEventTimeDefined = next < DBL_MAX;
    *nextEventTime = next < DBL_MAX ? next : 0.0;
    return (fmi3Status)(status == OK ? discrete_assertions(CORE) : status);
}

/* Model Exchange */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    REQUIRE(EVENT_MODE, MODEL_EXCHANGE);
    CORE->s.phase = CONTINUOUS;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    int missed;
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(CONTINUOUS, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(1, enterEventMode, terminateSimulation);
    *terminateSimulation = *enterEventMode = fmi3False;
    if (instance_missed_event(CORE, &missed) != OK) return fmi3Discard;
    *enterEventMode = missed != 0;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    REQUIRE(EVENT_MODE | CONTINUOUS, MODEL_EXCHANGE);
    return (fmi3Status)instance_set_time(CORE, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    REQUIRE(CONTINUOUS, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nContinuousStates, continuousStates, continuousStates);
    return (fmi3Status)instance_set_states(CORE, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates) {
    REQUIRE(CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nContinuousStates, derivatives, derivatives);
    return (fmi3Status)instance_copy(CORE, COPY_DERIVATIVES, derivatives, nContinuousStates);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators) {
    REQUIRE(CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nEventIndicators, eventIndicators, eventIndicators);
    return (fmi3Status)instance_copy(CORE, COPY_INDICATORS, eventIndicators, nEventIndicators);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates) {
    REQUIRE(CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nContinuousStates, continuousStates, continuousStates);
    return (fmi3Status)instance_copy(CORE, COPY_STATES, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nContinuousStates) {
    REQUIRE(CONTINUOUS_READABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(nContinuousStates, nominals, nominals);
    return (fmi3Status)instance_copy(CORE, COPY_NOMINALS, nominals, nContinuousStates);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    REQUIRE(STATE_SETTABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(1, nEventIndicators, nEventIndicators);
    *nEventIndicators = N_G;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    REQUIRE(STATE_SETTABLE, MODEL_EXCHANGE);
    REQUIRE_ARRAYS(1, nContinuousStates, nContinuousStates);
    *nContinuousStates = N_X;
    return fmi3OK;
}

/* Co-Simulation */

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    REQUIRE(EVENT_MODE, CO_SIMULATION);
    CORE->s.phase = STEP_MODE;
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues) {
    REQUIRE(STEP_MODE | TERMINATED, CO_SIMULATION);
    REQUIRE_ARRAYS(nValueReferences, valueReferences, values);
    REQUIRE_ARRAYS(nValueReferences, orders, values);
    if (nValues != nValueReferences) return refuse(instance, __func__, "all variables are scalars: nValues is wrong");
    return (fmi3Status)instance_output_derivatives(CORE, valueReferences, nValueReferences, orders, values);
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                      fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint; /* one-step method: going back needs no memory of the past */
    REQUIRE(STEP_MODE, CO_SIMULATION);
    REQUIRE_ARRAYS(1, eventHandlingNeeded, terminateSimulation);
    REQUIRE_ARRAYS(1, earlyReturn, lastSuccessfulTime);
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    const Status status = instance_do_step(CORE, currentCommunicationPoint, communicationStepSize);
    *lastSuccessfulTime = CORE->s.now.time;
    *earlyReturn = status == OK && CORE->return_early && CORE->s.now.time < currentCommunicationPoint + communicationStepSize;
    return (fmi3Status)status;
}

/* Beside the FMI: a whole run in one call (trajectory.h). */
#define thsaTrajectory1 fmi3FullName(thsaTrajectory1)

FMI3_Export fmi3Status thsaTrajectory1(fmi3Instance instance, Trajectory *run);

fmi3Status thsaTrajectory1(fmi3Instance instance, Trajectory *run) {
    REQUIRE(STEP_MODE, CO_SIMULATION);
    REQUIRE_ARRAYS(1, run, run);
    const Status status = trajectory_run(CORE, run);
    return (fmi3Status)status;
}

/* Scheduled Execution: none. */
fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime) {
    (void)clockReference, (void)activationTime;
    REQUIRE(STATE_SETTABLE, 0);
    return refuse(instance, __func__, "this FMU has no Scheduled Execution");
}
