/* The unit by FMI 3.0. Where it is linked statically with others, compile with
 * -DFMI3_FUNCTION_PREFIX=<modelIdentifier>_. */
#include "fmi3Functions.h"

#define FMI(name) fmi3##name
#define LOGGER fmi3LogMessageCallback
#define ENVIRONMENT fmi3InstanceEnvironment
#define SEND(its, status, category, message) its->log(its->environment, status, category, message)
#define STATE fmi3FMUState
#define STATE_NAME "FMUState"
#define STATE_CALL(verb) fmi3##verb##FMUState
#define SIZE_CALL fmi3SerializedFMUStateSize
#define READ_CALL fmi3DeserializeFMUState
/* arrays of values have a size of their own */
#define SIZED(size) , size_t size
#define CHECK_SIZES                                                                                \
    if (counted(c, knowns, seeds) != fmi3OK || counted(c, unknowns, sensitivities) != fmi3OK)      \
        return fmi3Error;
typedef fmi3Instance component;
static fmi3Status counted(fmi3Instance c, size_t references, size_t values);
#include "calls.h"

static fmi3Status counted(fmi3Instance c, size_t references, size_t values) {
    if (references == values) return fmi3OK;
    return report(ITS, fmi3Error,
                  "there are other numbers of variables and of values; expected one value each");
}

/* ---- from making to freeing
 * --------------------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t count,
                               const fmi3String categories[]) {
    return c ? fmi3OK : fmi3Error; /* what is refused is always logged; there is nothing else */
}

static fmi3Instance other_kind(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    if (log)
        log(environment, fmi3Error, "logStatusError",
            "the unit is one of co-simulation; expected that");
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String guid, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    return other_kind(environment, log);
}

fmi3Instance
fmi3InstantiateScheduledExecution(fmi3String name, fmi3String guid, fmi3String resources,
                                  fmi3Boolean visible, fmi3Boolean logging,
                                  fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                  fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                  fmi3UnlockPreemptionCallback unlock) {
    return other_kind(environment, log);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String guid, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t requireds,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    char message[400] = "there is no memory left";
    instance *its = (instance *)calloc(1, sizeof *its);
    if (!its) return NULL;
    its->log = log;
    its->environment = environment;
    if (!name || !*name)
        strcpy(message, "the instance has no name; expected one");
    else if (!guid || strcmp(guid, MODEL_TOKEN) != 0)
        snprintf(message, sizeof message,
                 "the token is not %s; expected that of modelDescription.xml", MODEL_TOKEN);
    else if (!resources)
        strcpy(message, "there is no path of resources; expected that of the folder");
    else if (requireds)
        strcpy(message, "there are no intermediate variables; expected none to be required");
    else
        its->unit = hs_unit_new(resources, message, sizeof message);
    return made(its, message);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
    fmi3Status status = enter(c, HS_INSTANTIATED, HS_INITIALIZING, "fmi3EnterInitializationMode");
    if (status == fmi3OK) UNIT->now.time = start;
    return status;
}

/* ---- values
 * ----------------------------------------------------------------------------------------------------------------
 */

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                          fmi3Float64 value[], size_t values) {
    if (c && counted(c, count, values) != fmi3OK) return fmi3Error;
    GET_EACH(HS_REAL, "fmi3GetFloat64", value, found);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                          const fmi3Float64 value[], size_t values) {
    if (c && counted(c, count, values) != fmi3OK) return fmi3Error;
    return set_each(c, vr, count, value, "fmi3SetFloat64");
}

fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                        fmi3Int32 value[], size_t values) {
    if (c && counted(c, count, values) != fmi3OK) return fmi3Error;
    GET_EACH(HS_INTEGER, "fmi3GetInt32", value, (fmi3Int32)found);
}

fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                          fmi3Boolean value[], size_t values) {
    if (c && counted(c, count, values) != fmi3OK) return fmi3Error;
    GET_EACH(HS_BOOLEAN, "fmi3GetBoolean", value, found != 0.0);
}

#define NONE_TO_GET(type)                                                                          \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t count,          \
                             fmi3##type value[], size_t values) {                                  \
        return of_no_type(c, count, "fmi3Get" #type);                                              \
    }
#define NONE_TO_SET(type)                                                                          \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t count,          \
                             const fmi3##type value[], size_t values) {                            \
        return of_no_type(c, count, "fmi3Set" #type);                                              \
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

/* ---- steps
 * -----------------------------------------------------------------------------------------------------------------
 */

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 length, fmi3Boolean final,
                      fmi3Boolean *events, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *last) {
    EXPECT(IN(HS_STEPPING), "fmi3DoStep");
    fmi3Status status = answered(ITS, hs_unit_step(UNIT, time, length));
    *events = *terminate = *early = fmi3False;
    *last = UNIT->now.time;
    return status;
}

/* ---- what the unit has not: event mode, clocks, intermediate values, model exchange
 * ------------------------------------------- */

/* Functions without a use here. */
#define MODE(name)                                                                                 \
    fmi3Status name(fmi3Instance c) { return without(c, #name); }
#define WITHOUT(name, ...)                                                                         \
    fmi3Status name(fmi3Instance c, __VA_ARGS__) { return without(c, #name); }
static fmi3Status without(fmi3Instance c, const char *call) {
    char message[200];
    EXPECT(ANY, call);
    snprintf(message, sizeof message,
             "%s is of no use with this unit, as modelDescription.xml says", call);
    return report(ITS, fmi3Error, message);
}
MODE(fmi3EnterEventMode)
MODE(fmi3EnterStepMode)
MODE(fmi3EnterConfigurationMode)
MODE(fmi3ExitConfigurationMode)
MODE(fmi3EvaluateDiscreteStates)
MODE(fmi3EnterContinuousTimeMode)
WITHOUT(fmi3GetBinary, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary value[],
        size_t m)
WITHOUT(fmi3GetClock, const fmi3ValueReference vr[], size_t n, fmi3Clock value[])
WITHOUT(fmi3SetBinary, const fmi3ValueReference vr[], size_t n, const size_t sizes[],
        const fmi3Binary value[], size_t m)
WITHOUT(fmi3SetClock, const fmi3ValueReference vr[], size_t n, const fmi3Clock value[])
WITHOUT(fmi3GetNumberOfVariableDependencies, fmi3ValueReference r, size_t *n)
WITHOUT(fmi3GetVariableDependencies, fmi3ValueReference r, size_t of[], fmi3ValueReference others[],
        size_t ofs[], fmi3DependencyKind kinds[], size_t n)
WITHOUT(fmi3GetAdjointDerivative, const fmi3ValueReference u[], size_t nu,
        const fmi3ValueReference k[], size_t nk, const fmi3Float64 seed[], size_t ns,
        fmi3Float64 out[], size_t no)
WITHOUT(fmi3GetIntervalDecimal, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[],
        fmi3IntervalQualifier q[])
WITHOUT(fmi3GetIntervalFraction, const fmi3ValueReference vr[], size_t n, fmi3UInt64 count[],
        fmi3UInt64 per[], fmi3IntervalQualifier q[])
WITHOUT(fmi3GetShiftDecimal, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[])
WITHOUT(fmi3GetShiftFraction, const fmi3ValueReference vr[], size_t n, fmi3UInt64 count[],
        fmi3UInt64 per[])
WITHOUT(fmi3SetIntervalDecimal, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[])
WITHOUT(fmi3SetIntervalFraction, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 count[],
        const fmi3UInt64 per[])
WITHOUT(fmi3SetShiftDecimal, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[])
WITHOUT(fmi3SetShiftFraction, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 count[],
        const fmi3UInt64 per[])
WITHOUT(fmi3UpdateDiscreteStates, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
        fmi3Boolean *value, fmi3Boolean *defined, fmi3Float64 *next)
WITHOUT(fmi3CompletedIntegratorStep, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *end)
WITHOUT(fmi3SetTime, fmi3Float64 time)
WITHOUT(fmi3SetContinuousStates, const fmi3Float64 x[], size_t n)
WITHOUT(fmi3GetContinuousStateDerivatives, fmi3Float64 d[], size_t n)
WITHOUT(fmi3GetEventIndicators, fmi3Float64 z[], size_t n)
WITHOUT(fmi3GetContinuousStates, fmi3Float64 x[], size_t n)
WITHOUT(fmi3GetNominalsOfContinuousStates, fmi3Float64 x[], size_t n)
WITHOUT(fmi3GetNumberOfEventIndicators, size_t *n)
WITHOUT(fmi3GetNumberOfContinuousStates, size_t *n)
WITHOUT(fmi3GetOutputDerivatives, const fmi3ValueReference vr[], size_t n, const fmi3Int32 order[],
        fmi3Float64 value[], size_t m)
WITHOUT(fmi3ActivateModelPartition, fmi3ValueReference r, fmi3Float64 time)
