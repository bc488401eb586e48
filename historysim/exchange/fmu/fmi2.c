/* The unit by FMI 2.0. Where it is linked statically with others, compile with
 * -DFMI2_FUNCTION_PREFIX=<modelIdentifier>_. */
#include "fmi2Functions.h"

#define FMI(name) fmi2##name
#define LOGGER fmi2CallbackLogger
#define ENVIRONMENT fmi2ComponentEnvironment
#define SEND(its, status, category, message)                                                       \
    its->log(its->environment, its->name, status, category, "%s", message)
#define STATE fmi2FMUstate
#define STATE_NAME "FMUstate"
#define STATE_CALL(verb) fmi2##verb##FMUstate
#define SIZE_CALL fmi2SerializedFMUstateSize
#define READ_CALL fmi2DeSerializeFMUstate
/* arrays have no second size */
#define SIZED(size)
#define CHECK_SIZES
typedef fmi2Component component;
#include "calls.h"

/* ---- from making to freeing
 * --------------------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                               const fmi2String categories[]) {
    return c ? fmi2OK : fmi2Error; /* what is refused is always logged; there is nothing else */
}

static int digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/* The path of a folder that a URI such as file:///home/me/a%20b names. */
static char *path_of(const char *uri) {
    char *path = (char *)malloc(strlen(uri) + 1), *to = path;
    if (!path) return NULL;
    if (strncmp(uri, "file:", 5) == 0) {
        uri += 5;
        if (strncmp(uri, "//", 2) == 0) {
            const char *slash = strchr(uri + 2, '/');
            if (slash && (slash == uri + 2 || strncmp(uri + 2, "localhost/", 10) == 0)) uri = slash;
        }
#if defined(_WIN32)
        if (uri[0] == '/' && uri[1] != '/' && uri[1] && uri[2] == ':') ++uri;
#endif
        for (; *uri; ++uri) {
            int high = *uri == '%' ? digit(uri[1]) : -1, low = high >= 0 ? digit(uri[2]) : -1;
            *to++ = low >= 0 ? (char)(16 * high + low) : *uri;
            if (low >= 0) uri += 2;
        }
        *to = 0;
    } else {
        strcpy(path, uri);
    }
    return path;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging) {
    char message[400] = "there is no memory left";
    instance *its = (instance *)calloc(1, sizeof *its);
    if (!its) return NULL;
    its->log = functions ? functions->logger : NULL;
    its->environment = functions ? functions->componentEnvironment : NULL;
    its->name = (char *)calloc(1, (name ? strlen(name) : 0) + 1);
    if (!its->name) its->log = NULL; /* it cannot say of whom it speaks */
    if (its->name && name) strcpy(its->name, name);
    char *path = resources ? path_of(resources) : NULL;
    if (!name || !*name)
        strcpy(message, "the instance has no name; expected one");
    else if (type != fmi2CoSimulation)
        strcpy(message, "the unit is one of co-simulation; expected fmi2CoSimulation");
    else if (!guid || strcmp(guid, MODEL_TOKEN) != 0)
        snprintf(message, sizeof message,
                 "the GUID is not %s; expected that of modelDescription.xml", MODEL_TOKEN);
    else if (!resources)
        strcpy(message, "there is no location of resources; expected the URI of the folder");
    else if (path && its->name)
        its->unit = hs_unit_new(path, message, sizeof message);
    free(path);
    return made(its, message);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop) {
    EXPECT(IN(HS_INSTANTIATED), "fmi2SetupExperiment");
    UNIT->now.time = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return enter(c, HS_INSTANTIATED, HS_INITIALIZING, "fmi2EnterInitializationMode");
}

/* ---- values
 * ----------------------------------------------------------------------------------------------------------------
 */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                       fmi2Real value[]) {
    GET_EACH(HS_REAL, "fmi2GetReal", value, found);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                          fmi2Integer value[]) {
    GET_EACH(HS_INTEGER, "fmi2GetInteger", value, (fmi2Integer)found);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                          fmi2Boolean value[]) {
    GET_EACH(HS_BOOLEAN, "fmi2GetBoolean", value, found != 0.0 ? fmi2True : fmi2False);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                       const fmi2Real value[]) {
    return set_each(c, vr, count, value, "fmi2SetReal");
}

#define NONE(call, of)                                                                             \
    fmi2Status fmi2##call(fmi2Component c, const fmi2ValueReference vr[], size_t count,            \
                          of value[]) {                                                            \
        return of_no_type(c, count, "fmi2" #call);                                                 \
    }
NONE(GetString, fmi2String)
NONE(SetInteger, const fmi2Integer)
NONE(SetBoolean, const fmi2Boolean)
NONE(SetString, const fmi2String)

/* ---- steps
 * -----------------------------------------------------------------------------------------------------------------
 */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    EXPECT(IN(HS_INITIALIZING) | IN(HS_STEPPING), "fmi2SetRealInputDerivatives");
    for (size_t i = 0; i < count; ++i) {
        fmi2Status status = order[i] == 1
                                ? answered(ITS, hs_unit_set_rate(UNIT, vr[i], value[i]))
                                : report(ITS, fmi2Error, "expected first derivatives of inputs");
        if (status != fmi2OK) return status;
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[],
                                        size_t count, const fmi2Integer order[], fmi2Real value[]) {
    return of_no_type(c, count, "fmi2GetRealOutputDerivatives");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real length, fmi2Boolean final) {
    EXPECT(IN(HS_STEPPING), "fmi2DoStep");
    return answered(ITS, hs_unit_step(UNIT, time, length));
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    EXPECT(ANY, "fmi2CancelStep");
    return report(ITS, fmi2Error, "no step is under way that could be cancelled");
}

/* No step is ever pending. */
#define NO_STATUS(call, type)                                                                      \
    fmi2Status fmi2##call(fmi2Component c, const fmi2StatusKind kind, type *value) {               \
        return c ? fmi2Discard : fmi2Error;                                                        \
    }
NO_STATUS(GetStatus, fmi2Status)
NO_STATUS(GetIntegerStatus, fmi2Integer)
NO_STATUS(GetStringStatus, fmi2String)

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (!c) return fmi2Error;
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = UNIT->now.time;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (!c) return fmi2Error;
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = fmi2False;
    return fmi2OK;
}
