/* The unit by FMI 2.0. Where it is linked statically with others, compile with -DFMI2_FUNCTION_PREFIX=<modelIdentifier>_. */
#include "fmi2Functions.h"
#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct instance {
    hs_unit *unit;
    char *name;
    fmi2CallbackLogger log;
    fmi2ComponentEnvironment environment;
    int failed; /* whether it is of no use any more */
} instance;

/* ---- messages -------------------------------------------------------------------------------------------------------------- */

static fmi2Status told(instance *its, fmi2Status status, const char *message) {
    const char *category = status == fmi2Discard ? "logStatusDiscard" : status == fmi2Fatal ? "logStatusFatal" : "logStatusError";
    if (its->log) its->log(its->environment, its->name, status, category, "%s", message);
    if (status == fmi2Error || status == fmi2Fatal) its->failed = 1;
    return status;
}

static fmi2Status answered(instance *its, int answer) {
    if (answer == HS_DONE) return fmi2OK;
    return told(its, answer == HS_REFUSED ? fmi2Discard : fmi2Error, its->unit->message);
}

/* Whether a call comes in one of the modes (bits); tells where it does not. */
#define IN(mode) (1 << (mode))
#define ANY (IN(HS_INSTANTIATED) | IN(HS_INITIALIZING) | IN(HS_STEPPING) | IN(HS_TERMINATED))
static int comes(fmi2Component c, int modes, const char *call) {
    instance *its = (instance *)c;
    char message[200];
    if (!its) return 0;
    if (!its->failed && (IN(its->unit->now.mode) & modes)) return 1;
    snprintf(message, sizeof message, "%s came %s", call,
             its->failed ? "after an error; expected fmi2FreeInstance or fmi2Reset" : "in a mode in which it must not");
    told(its, fmi2Error, message);
    return 0;
}
#define EXPECT(modes, call) \
    if (!comes(c, modes, call)) return fmi2Error
#define UNIT (((instance *)c)->unit)

/* ---- from making to freeing --------------------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]) {
    (void)on;
    (void)count;
    (void)categories;
    return c ? fmi2OK : fmi2Error; /* what is refused is always told; there is nothing else */
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
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    char message[400] = "there is no memory left";
    instance *its = (instance *)calloc(1, sizeof *its);
    (void)visible;
    (void)logging;
    if (!its) return NULL;
    its->log = functions ? functions->logger : NULL;
    its->environment = functions ? functions->componentEnvironment : NULL;
    its->name = (char *)calloc(1, (name ? strlen(name) : 0) + 1);
    if (its->name && name) strcpy(its->name, name);
    char *path = resources ? path_of(resources) : NULL;
    if (!name || !*name)
        strcpy(message, "the instance has no name; expected one");
    else if (type != fmi2CoSimulation)
        strcpy(message, "the unit is one of co-simulation; expected fmi2CoSimulation");
    else if (!guid || strcmp(guid, MODEL_TOKEN) != 0)
        snprintf(message, sizeof message, "the GUID is not %s; expected that of modelDescription.xml", MODEL_TOKEN);
    else if (!resources)
        strcpy(message, "there is no location of resources; expected the URI of the folder");
    else if (path && its->name)
        its->unit = hs_unit_new(path, message, sizeof message);
    free(path);
    if (its->unit) return its;
    if (its->name) told(its, fmi2Error, message);
    free(its->name);
    free(its);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) {
    if (!c) return;
    hs_unit_free(UNIT);
    free(((instance *)c)->name);
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
    EXPECT(IN(HS_INSTANTIATED), "fmi2SetupExperiment");
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    UNIT->now.time = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    EXPECT(IN(HS_INSTANTIATED), "fmi2EnterInitializationMode");
    UNIT->now.mode = HS_INITIALIZING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    EXPECT(IN(HS_INITIALIZING), "fmi2ExitInitializationMode");
    UNIT->now.mode = HS_STEPPING;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    EXPECT(IN(HS_STEPPING), "fmi2Terminate");
    UNIT->now.mode = HS_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    if (!c) return fmi2Error;
    ((instance *)c)->failed = 0;
    return answered((instance *)c, hs_unit_reset(UNIT));
}

/* ---- values ---------------------------------------------------------------------------------------------------------------- */

static fmi2Status of_no_type(fmi2Component c, size_t count, const char *call) {
    EXPECT(ANY, call);
    return count == 0 ? fmi2OK : told((instance *)c, fmi2Error, "the unit has no variable of this type that is got or set so");
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Real value[]) {
    EXPECT(ANY, "fmi2GetReal");
    for (size_t i = 0; i < count; ++i) {
        fmi2Status status = hs_unit_is_real(vr[i]) ? answered((instance *)c, hs_unit_get(UNIT, vr[i], value + i))
                                                   : told((instance *)c, fmi2Error, "a variable is of another type");
        if (status != fmi2OK) return status;
    }
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Integer value[]) {
    EXPECT(ANY, "fmi2GetInteger");
    for (size_t i = 0; i < count; ++i) {
        double found;
        if (vr[i] != V_CONTACT_COUNT) return told((instance *)c, fmi2Error, "a variable is of another type");
        fmi2Status status = answered((instance *)c, hs_unit_get(UNIT, vr[i], &found));
        if (status != fmi2OK) return status;
        value[i] = (fmi2Integer)found;
    }
    return fmi2OK;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Boolean value[]) {
    EXPECT(ANY, "fmi2GetBoolean");
    for (size_t i = 0; i < count; ++i) {
        double found;
        if (vr[i] != V_SATURATED) return told((instance *)c, fmi2Error, "a variable is of another type");
        fmi2Status status = answered((instance *)c, hs_unit_get(UNIT, vr[i], &found));
        if (status != fmi2OK) return status;
        value[i] = found != 0.0 ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2String value[]) {
    (void)vr;
    (void)value;
    return of_no_type(c, count, "fmi2GetString");
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Real value[]) {
    EXPECT(ANY & ~IN(HS_TERMINATED), "fmi2SetReal");
    for (size_t i = 0; i < count; ++i) {
        fmi2Status status = answered((instance *)c, hs_unit_set(UNIT, vr[i], value[i]));
        if (status != fmi2OK) return status;
    }
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return of_no_type(c, count, "fmi2SetInteger");
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Boolean value[]) {
    (void)vr;
    (void)value;
    return of_no_type(c, count, "fmi2SetBoolean");
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2String value[]) {
    (void)vr;
    (void)value;
    return of_no_type(c, count, "fmi2SetString");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                        const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
    EXPECT(IN(HS_INITIALIZING) | IN(HS_STEPPING) | IN(HS_TERMINATED), "fmi2GetDirectionalDerivative");
    for (size_t i = 0; i < unknowns; ++i) {
        double sum = 0.0, one;
        for (size_t k = 0; k < knowns; ++k) {
            fmi2Status status = answered((instance *)c, hs_unit_derivative(UNIT, unknown[i], known[k], &one));
            if (status != fmi2OK) return status;
            sum += one * seed[k];
        }
        sensitivity[i] = sum;
    }
    return fmi2OK;
}

/* ---- states ---------------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    EXPECT(ANY, "fmi2GetFMUstate");
    return answered((instance *)c, hs_unit_save(UNIT, (hs_moment **)state));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    EXPECT(ANY, "fmi2SetFMUstate");
    if (!state) return told((instance *)c, fmi2Error, "no state came; expected one of fmi2GetFMUstate");
    return answered((instance *)c, hs_unit_restore(UNIT, (const hs_moment *)state));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!c || !state) return fmi2Error;
    hs_moment_free((hs_moment *)*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    EXPECT(ANY, "fmi2SerializedFMUstateSize");
    if (!state) return told((instance *)c, fmi2Error, "no state came; expected one of fmi2GetFMUstate");
    *size = hs_moment_size((const hs_moment *)state);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    EXPECT(ANY, "fmi2SerializeFMUstate");
    if (!state) return told((instance *)c, fmi2Error, "no state came; expected one of fmi2GetFMUstate");
    return answered((instance *)c, hs_moment_write(UNIT, (const hs_moment *)state, bytes, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    EXPECT(ANY, "fmi2DeSerializeFMUstate");
    return answered((instance *)c, hs_moment_read(UNIT, bytes, size, (hs_moment **)state));
}

/* ---- steps ----------------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    EXPECT(IN(HS_INITIALIZING) | IN(HS_STEPPING), "fmi2SetRealInputDerivatives");
    for (size_t i = 0; i < count; ++i) {
        fmi2Status status = order[i] == 1 ? answered((instance *)c, hs_unit_set_rate(UNIT, vr[i], value[i]))
                                          : told((instance *)c, fmi2Error, "expected first derivatives of inputs");
        if (status != fmi2OK) return status;
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr;
    (void)order;
    (void)value;
    return of_no_type(c, count, "fmi2GetRealOutputDerivatives");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real length, fmi2Boolean final) {
    EXPECT(IN(HS_STEPPING), "fmi2DoStep");
    (void)final;
    return answered((instance *)c, hs_unit_step(UNIT, time, length));
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    EXPECT(ANY, "fmi2CancelStep");
    return told((instance *)c, fmi2Error, "no step is under way that could be cancelled");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind;
    (void)value;
    return c ? fmi2Discard : fmi2Error; /* no step is ever pending */
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (!c) return fmi2Error;
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = UNIT->now.time;
    return fmi2OK;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind;
    (void)value;
    return c ? fmi2Discard : fmi2Error;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (!c) return fmi2Error;
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind;
    (void)value;
    return c ? fmi2Discard : fmi2Error;
}
