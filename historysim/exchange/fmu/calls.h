/* What both versions of the standard do alike, included by fmi2.c and fmi3.c after their own
 * definitions: FMI(name) is the name in that version, `component` its handle, SEND(its, status,
 * category, message) its log. */
#ifndef HS_CALLS_H
#define HS_CALLS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unit.h"

#if defined(__GNUC__)
/* the standard has arguments that this unit does not need */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

typedef FMI(Status) answer;

typedef struct instance {
    hs_unit *unit;
    char *name;
    LOGGER log;
    ENVIRONMENT environment;
    int failed; /* whether it is of no use any more */
} instance;

/* ---- messages
 * --------------------------------------------------------------------------------------------------------------
 */

static answer report(instance *its, answer status, const char *message) {
    const char *category = status == FMI(Discard) ? "logStatusDiscard"
                           : status == FMI(Fatal) ? "logStatusFatal"
                                                  : "logStatusError";
    if (its->log) SEND(its, status, category, message);
    if (status == FMI(Error) || status == FMI(Fatal)) its->failed = 1;
    return status;
}

static answer answered(instance *its, int done) {
    if (done == HS_DONE) return FMI(OK);
    return report(its, done == HS_REFUSED ? FMI(Discard) : FMI(Error), its->unit->message);
}

/* Whether a call is allowed in the mode of the instance, one of `modes` (bits); reports where it is
 * not. */
#define IN(mode) (1 << (mode))
#define ANY (IN(HS_INSTANTIATED) | IN(HS_INITIALIZING) | IN(HS_STEPPING) | IN(HS_TERMINATED))
static int is_allowed(component c, int modes, const char *call) {
    instance *its = (instance *)c;
    char message[200];
    if (!its) return 0;
    if (!its->failed && (IN(its->unit->now.mode) & modes)) return 1;
    snprintf(message, sizeof message, "%s is called %s", call,
             its->failed ? "after an error; expected that the instance is freed or reset"
                         : "in a mode that does not allow it");
    report(its, FMI(Error), message);
    return 0;
}
#define EXPECT(modes, call)                                                                        \
    if (!is_allowed(c, modes, call)) return FMI(Error)
#define ITS ((instance *)c)
#define UNIT (ITS->unit)

/* ---- modes
 * -----------------------------------------------------------------------------------------------------------------
 */

/* Keep the unit of a new instance, or report why there is none and free it. */
static component made(instance *its, const char *message) {
    if (its->unit) return (component)its;
    report(its, FMI(Error), message);
    free(its->name);
    free(its);
    return NULL;
}

void FMI(FreeInstance)(component c) {
    if (!c) return;
    hs_unit_free(UNIT);
    free(ITS->name);
    free(c);
}

static answer enter(component c, int from, int to, const char *call) {
    EXPECT(IN(from), call);
    UNIT->now.mode = to;
    return FMI(OK);
}

answer FMI(ExitInitializationMode)(component c) {
    return enter(c, HS_INITIALIZING, HS_STEPPING, "ExitInitializationMode");
}
answer FMI(Terminate)(component c) { return enter(c, HS_STEPPING, HS_TERMINATED, "Terminate"); }

answer FMI(Reset)(component c) {
    if (!c) return FMI(Error);
    ITS->failed = 0;
    return answered(ITS, hs_unit_reset(UNIT));
}

/* ---- values
 * ----------------------------------------------------------------------------------------------------------------
 */

/* The value of a variable, which has to be of a type. */
static answer value_of(component c, unsigned reference, enum hs_type type, double *value) {
    if (hs_unit_type(reference) != type)
        return report(ITS, FMI(Error), "a variable is of another type");
    return answered(ITS, hs_unit_get(UNIT, reference, value));
}

/* Get `count` values of a type: `found` is one of them, a double. */
#define GET_EACH(type, call, value, found_as)                                                      \
    EXPECT(ANY, call);                                                                             \
    for (size_t i = 0; i < count; ++i) {                                                           \
        double found;                                                                              \
        answer status = value_of(c, vr[i], type, &found);                                          \
        if (status != FMI(OK)) return status;                                                      \
        (value)[i] = (found_as);                                                                   \
    }                                                                                              \
    return FMI(OK)

static answer set_each(component c, const FMI(ValueReference) vr[], size_t count,
                       const double value[], const char *call) {
    EXPECT(ANY & ~IN(HS_TERMINATED), call);
    for (size_t i = 0; i < count; ++i) {
        answer status = answered(ITS, hs_unit_set(UNIT, vr[i], value[i]));
        if (status != FMI(OK)) return status;
    }
    return FMI(OK);
}

/* Of types that no variable has, or that none can be set of. */
static answer of_no_type(component c, size_t count, const char *call) {
    EXPECT(ANY, call);
    return count == 0 ? FMI(OK)
                      : report(ITS, FMI(Error),
                               "the unit has no variable of this type that can be read or set so");
}

answer FMI(GetDirectionalDerivative)(component c, const FMI(ValueReference) unknown[],
                                     size_t unknowns, const FMI(ValueReference) known[],
                                     size_t knowns, const double seed[] SIZED(seeds),
                                     double sensitivity[] SIZED(sensitivities)) {
    EXPECT(IN(HS_INITIALIZING) | IN(HS_STEPPING) | IN(HS_TERMINATED), "GetDirectionalDerivative");
    CHECK_SIZES
    for (size_t i = 0; i < unknowns; ++i) {
        double sum = 0.0, one;
        for (size_t k = 0; k < knowns; ++k) {
            answer status = answered(ITS, hs_unit_derivative(UNIT, unknown[i], known[k], &one));
            if (status != FMI(OK)) return status;
            sum += one * seed[k];
        }
        sensitivity[i] = sum;
    }
    return FMI(OK);
}

/* ---- states
 * ----------------------------------------------------------------------------------------------------------------
 */

#define NEEDS_STATE                                                                                \
    if (!state)                                                                                    \
    return report(ITS, FMI(Error), "there is no state; expected one that the unit has given")

answer STATE_CALL(Get)(component c, STATE *state) {
    EXPECT(ANY, "Get" STATE_NAME);
    return answered(ITS, hs_unit_save(UNIT, (hs_moment **)state));
}

answer STATE_CALL(Set)(component c, STATE state) {
    EXPECT(ANY, "Set" STATE_NAME);
    NEEDS_STATE;
    return answered(ITS, hs_unit_restore(UNIT, (const hs_moment *)state));
}

answer STATE_CALL(Free)(component c, STATE *state) {
    if (!c || !state) return FMI(Error);
    hs_moment_free((hs_moment *)*state);
    *state = NULL;
    return FMI(OK);
}

answer SIZE_CALL(component c, STATE state, size_t *size) {
    EXPECT(ANY, "Serialized" STATE_NAME "Size");
    NEEDS_STATE;
    *size = hs_moment_size((const hs_moment *)state);
    return FMI(OK);
}

answer STATE_CALL(Serialize)(component c, STATE state, FMI(Byte) bytes[], size_t size) {
    EXPECT(ANY, "Serialize" STATE_NAME);
    NEEDS_STATE;
    return answered(ITS, hs_moment_write(UNIT, (const hs_moment *)state, bytes, size));
}

answer READ_CALL(component c, const FMI(Byte) bytes[], size_t size, STATE *state) {
    EXPECT(ANY, "Deserialize" STATE_NAME);
    return answered(ITS, hs_moment_read(UNIT, bytes, size, (hs_moment **)state));
}

#endif
