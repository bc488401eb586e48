/* The unit by FMI 3.0. Where it is linked statically with others, compile with -DFMI3_FUNCTION_PREFIX=<modelIdentifier>_. */
#include "fmi3Functions.h"
#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct instance {
    hs_unit *unit;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
    int failed; /* whether it is of no use any more */
} instance;

/* ---- messages -------------------------------------------------------------------------------------------------------------- */

static fmi3Status told(instance *its, fmi3Status status, const char *message) {
    const char *category = status == fmi3Discard ? "logStatusDiscard" : status == fmi3Fatal ? "logStatusFatal" : "logStatusError";
    if (its->log) its->log(its->environment, status, category, message);
    if (status == fmi3Error || status == fmi3Fatal) its->failed = 1;
    return status;
}

static fmi3Status answered(instance *its, int answer) {
    if (answer == HS_DONE) return fmi3OK;
    return told(its, answer == HS_REFUSED ? fmi3Discard : fmi3Error, its->unit->message);
}

/* Whether a call comes in one of the modes (bits); tells where it does not. */
#define IN(mode) (1 << (mode))
#define ANY (IN(HS_INSTANTIATED) | IN(HS_INITIALIZING) | IN(HS_STEPPING) | IN(HS_TERMINATED))
static int comes(fmi3Instance c, int modes, const char *call) {
    instance *its = (instance *)c;
    char message[200];
    if (!its) return 0;
    if (!its->failed && (IN(its->unit->now.mode) & modes)) return 1;
    snprintf(message, sizeof message, "%s came %s", call,
             its->failed ? "after an error; expected fmi3FreeInstance or fmi3Reset" : "in a mode in which it must not");
    told(its, fmi3Error, message);
    return 0;
}
#define EXPECT(modes, call) \
    if (!comes(c, modes, call)) return fmi3Error
#define UNIT (((instance *)c)->unit)

/* ---- from making to freeing --------------------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t count, const fmi3String categories[]) {
    (void)on;
    (void)count;
    (void)categories;
    return c ? fmi3OK : fmi3Error; /* what is refused is always told; there is nothing else */
}

static fmi3Instance other_kind(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    if (log) log(environment, fmi3Error, "logStatusError", "the unit is one of co-simulation; expected that");
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String guid, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    (void)name;
    (void)guid;
    (void)resources;
    (void)visible;
    (void)logging;
    return other_kind(environment, log);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String guid, fmi3String resources, fmi3Boolean visible,
                                               fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    (void)name;
    (void)guid;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)update;
    (void)lock;
    (void)unlock;
    return other_kind(environment, log);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String guid, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t requireds,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    char message[400] = "there is no memory left";
    instance *its = (instance *)calloc(1, sizeof *its);
    (void)visible;
    (void)logging;
    (void)events;
    (void)early;
    (void)required;
    (void)update;
    if (!its) return NULL;
    its->log = log;
    its->environment = environment;
    if (!name || !*name)
        strcpy(message, "the instance has no name; expected one");
    else if (!guid || strcmp(guid, MODEL_TOKEN) != 0)
        snprintf(message, sizeof message, "the token is not %s; expected that of modelDescription.xml", MODEL_TOKEN);
    else if (!resources)
        strcpy(message, "there is no path of resources; expected that of the folder");
    else if (requireds)
        strcpy(message, "there are no intermediate variables; expected none to be required");
    else
        its->unit = hs_unit_new(resources, message, sizeof message);
    if (its->unit) return its;
    told(its, fmi3Error, message);
    free(its);
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c) {
    if (!c) return;
    hs_unit_free(UNIT);
    free(c);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
    EXPECT(IN(HS_INSTANTIATED), "fmi3EnterInitializationMode");
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    UNIT->now.time = start;
    UNIT->now.mode = HS_INITIALIZING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    EXPECT(IN(HS_INITIALIZING), "fmi3ExitInitializationMode");
    UNIT->now.mode = HS_STEPPING;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance c) {
    EXPECT(IN(HS_STEPPING), "fmi3Terminate");
    UNIT->now.mode = HS_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c) {
    if (!c) return fmi3Error;
    ((instance *)c)->failed = 0;
    return answered((instance *)c, hs_unit_reset(UNIT));
}

/* ---- values ---------------------------------------------------------------------------------------------------------------- */

static fmi3Status counted(fmi3Instance c, size_t references, size_t values) {
    if (references == values) return fmi3OK;
    return told((instance *)c, fmi3Error, "there are other numbers of variables and of values; expected one value each");
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count, fmi3Float64 value[], size_t values) {
    EXPECT(ANY, "fmi3GetFloat64");
    if (counted(c, count, values) != fmi3OK) return fmi3Error;
    for (size_t i = 0; i < count; ++i) {
        fmi3Status status = hs_unit_is_real(vr[i]) ? answered((instance *)c, hs_unit_get(UNIT, vr[i], value + i))
                                                   : told((instance *)c, fmi3Error, "a variable is of another type");
        if (status != fmi3OK) return status;
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count, const fmi3Float64 value[],
                          size_t values) {
    EXPECT(ANY & ~IN(HS_TERMINATED), "fmi3SetFloat64");
    if (counted(c, count, values) != fmi3OK) return fmi3Error;
    for (size_t i = 0; i < count; ++i) {
        fmi3Status status = answered((instance *)c, hs_unit_set(UNIT, vr[i], value[i]));
        if (status != fmi3OK) return status;
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t count, fmi3Int32 value[], size_t values) {
    EXPECT(ANY, "fmi3GetInt32");
    if (counted(c, count, values) != fmi3OK) return fmi3Error;
    for (size_t i = 0; i < count; ++i) {
        double found;
        if (vr[i] != V_CONTACT_COUNT) return told((instance *)c, fmi3Error, "a variable is of another type");
        fmi3Status status = answered((instance *)c, hs_unit_get(UNIT, vr[i], &found));
        if (status != fmi3OK) return status;
        value[i] = (fmi3Int32)found;
    }
    return fmi3OK;
}

fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t count, fmi3Boolean value[], size_t values) {
    EXPECT(ANY, "fmi3GetBoolean");
    if (counted(c, count, values) != fmi3OK) return fmi3Error;
    for (size_t i = 0; i < count; ++i) {
        double found;
        if (vr[i] != V_SATURATED) return told((instance *)c, fmi3Error, "a variable is of another type");
        fmi3Status status = answered((instance *)c, hs_unit_get(UNIT, vr[i], &found));
        if (status != fmi3OK) return status;
        value[i] = found != 0.0;
    }
    return fmi3OK;
}

/* Of types that no variable has, or that none can be set of. */
static fmi3Status of_no_type(fmi3Instance c, size_t count, const char *call) {
    EXPECT(ANY, call);
    return count == 0 ? fmi3OK : told((instance *)c, fmi3Error, "the unit has no variable of this type that is got or set so");
}

#define NONE_TO_GET(type) \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t count, fmi3##type value[], size_t values) { \
        (void)vr; \
        (void)value; \
        (void)values; \
        return of_no_type(c, count, "fmi3Get" #type); \
    }
#define NONE_TO_SET(type) \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t count, const fmi3##type value[], \
                             size_t values) { \
        (void)vr; \
        (void)value; \
        (void)values; \
        return of_no_type(c, count, "fmi3Set" #type); \
    }
NONE_TO_GET(Float32)
NONE_TO_GET(Int8)
NONE_TO_GET(UInt8)
NONE_TO_GET(Int16)
NONE_TO_GET(UInt16)
NONE_TO_GET(UInt32)
NONE_TO_GET(Int64)
NONE_TO_GET(UInt64)
NONE_TO_GET(String)
NONE_TO_SET(Float32)
NONE_TO_SET(Int8)
NONE_TO_SET(UInt8)
NONE_TO_SET(Int16)
NONE_TO_SET(UInt16)
NONE_TO_SET(Int32)
NONE_TO_SET(UInt32)
NONE_TO_SET(Int64)
NONE_TO_SET(UInt64)
NONE_TO_SET(Boolean)
NONE_TO_SET(String)

/* ---- states ---------------------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    EXPECT(ANY, "fmi3GetFMUState");
    return answered((instance *)c, hs_unit_save(UNIT, (hs_moment **)state));
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    EXPECT(ANY, "fmi3SetFMUState");
    if (!state) return told((instance *)c, fmi3Error, "no state came; expected one of fmi3GetFMUState");
    return answered((instance *)c, hs_unit_restore(UNIT, (const hs_moment *)state));
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!c || !state) return fmi3Error;
    hs_moment_free((hs_moment *)*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    EXPECT(ANY, "fmi3SerializedFMUStateSize");
    if (!state) return told((instance *)c, fmi3Error, "no state came; expected one of fmi3GetFMUState");
    *size = hs_moment_size((const hs_moment *)state);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    EXPECT(ANY, "fmi3SerializeFMUState");
    if (!state) return told((instance *)c, fmi3Error, "no state came; expected one of fmi3GetFMUState");
    return answered((instance *)c, hs_moment_write(UNIT, (const hs_moment *)state, bytes, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    EXPECT(ANY, "fmi3DeserializeFMUState");
    return answered((instance *)c, hs_moment_read(UNIT, bytes, size, (hs_moment **)state));
}

/* ---- steps ----------------------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t unknowns,
                                        const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[],
                                        size_t seeds, fmi3Float64 sensitivity[], size_t sensitivities) {
    EXPECT(IN(HS_INITIALIZING) | IN(HS_STEPPING) | IN(HS_TERMINATED), "fmi3GetDirectionalDerivative");
    if (counted(c, knowns, seeds) != fmi3OK || counted(c, unknowns, sensitivities) != fmi3OK) return fmi3Error;
    for (size_t i = 0; i < unknowns; ++i) {
        double sum = 0.0, one;
        for (size_t k = 0; k < knowns; ++k) {
            fmi3Status status = answered((instance *)c, hs_unit_derivative(UNIT, unknown[i], known[k], &one));
            if (status != fmi3OK) return status;
            sum += one * seed[k];
        }
        sensitivity[i] = sum;
    }
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 length, fmi3Boolean final, fmi3Boolean *events,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    EXPECT(IN(HS_STEPPING), "fmi3DoStep");
    (void)final;
    fmi3Status status = answered((instance *)c, hs_unit_step(UNIT, time, length));
    *events = *terminate = *early = fmi3False;
    *last = UNIT->now.time;
    return status;
}

/* ---- what the unit has not: event mode, clocks, intermediate values, model exchange ------------------------------------------- */

/* A function without a use here. */
#define WITHOUT(name, ...) \
    fmi3Status name(fmi3Instance c, __VA_ARGS__) { return without(c, #name); }
static fmi3Status without(fmi3Instance c, const char *call) {
    char message[200];
    EXPECT(ANY, call);
    snprintf(message, sizeof message, "%s is of no use with this unit, as modelDescription.xml says", call);
    return told((instance *)c, fmi3Error, message);
}
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
fmi3Status fmi3EnterEventMode(fmi3Instance c) { return without(c, "fmi3EnterEventMode"); }
fmi3Status fmi3EnterStepMode(fmi3Instance c) { return without(c, "fmi3EnterStepMode"); }
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return without(c, "fmi3EnterConfigurationMode"); }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return without(c, "fmi3ExitConfigurationMode"); }
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { return without(c, "fmi3EvaluateDiscreteStates"); }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return without(c, "fmi3EnterContinuousTimeMode"); }
WITHOUT(fmi3GetBinary, const fmi3ValueReference valueReferences[], size_t nValueReferences, size_t valueSizes[],
        fmi3Binary values[], size_t nValues)
WITHOUT(fmi3GetClock, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3Clock values[])
WITHOUT(fmi3SetBinary, const fmi3ValueReference valueReferences[], size_t nValueReferences, const size_t valueSizes[],
        const fmi3Binary values[], size_t nValues)
WITHOUT(fmi3SetClock, const fmi3ValueReference valueReferences[], size_t nValueReferences, const fmi3Clock values[])
WITHOUT(fmi3GetNumberOfVariableDependencies, fmi3ValueReference valueReference, size_t* nDependencies)
WITHOUT(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
        fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
        fmi3DependencyKind dependencyKinds[], size_t nDependencies)
WITHOUT(fmi3GetAdjointDerivative, const fmi3ValueReference unknowns[], size_t nUnknowns,
        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
        fmi3Float64 sensitivity[], size_t nSensitivity)
WITHOUT(fmi3GetIntervalDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
WITHOUT(fmi3GetIntervalFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
WITHOUT(fmi3GetShiftDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        fmi3Float64 shifts[])
WITHOUT(fmi3GetShiftFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        fmi3UInt64 counters[], fmi3UInt64 resolutions[])
WITHOUT(fmi3SetIntervalDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        const fmi3Float64 intervals[])
WITHOUT(fmi3SetIntervalFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
WITHOUT(fmi3SetShiftDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        const fmi3Float64 shifts[])
WITHOUT(fmi3SetShiftFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
WITHOUT(fmi3UpdateDiscreteStates, fmi3Boolean* discreteStatesNeedUpdate, fmi3Boolean* terminateSimulation,
        fmi3Boolean* nominalsOfContinuousStatesChanged, fmi3Boolean* valuesOfContinuousStatesChanged,
        fmi3Boolean* nextEventTimeDefined, fmi3Float64* nextEventTime)
WITHOUT(fmi3CompletedIntegratorStep, fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean* enterEventMode,
        fmi3Boolean* terminateSimulation)
WITHOUT(fmi3SetTime, fmi3Float64 time)
WITHOUT(fmi3SetContinuousStates, const fmi3Float64 continuousStates[], size_t nContinuousStates)
WITHOUT(fmi3GetContinuousStateDerivatives, fmi3Float64 derivatives[], size_t nContinuousStates)
WITHOUT(fmi3GetEventIndicators, fmi3Float64 eventIndicators[], size_t nEventIndicators)
WITHOUT(fmi3GetContinuousStates, fmi3Float64 continuousStates[], size_t nContinuousStates)
WITHOUT(fmi3GetNominalsOfContinuousStates, fmi3Float64 nominals[], size_t nContinuousStates)
WITHOUT(fmi3GetNumberOfEventIndicators, size_t* nEventIndicators)
WITHOUT(fmi3GetNumberOfContinuousStates, size_t* nContinuousStates)
WITHOUT(fmi3GetOutputDerivatives, const fmi3ValueReference valueReferences[], size_t nValueReferences,
        const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
WITHOUT(fmi3ActivateModelPartition, fmi3ValueReference clockReference, fmi3Float64 activationTime)
