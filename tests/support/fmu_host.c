/* Random calls of a unit of co-simulation, right and wrong ones, for sanitizers: fmu_host
 * URI-OF-RESOURCES GUID CALLS.
 *
 * Prints the digests of states that were saved, and how many calls were answered in each way. Ends
 * with 1 where a unit that was put back gives other bytes. */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "model.h"

#define STATES 8
#define REFERENCES 22
#ifdef DIRECTIONS
#define INPUTS 3
#else
#define INPUTS 2
#endif

static uint64_t seed = 88172645463325252u;
static double chance(void) {
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return (double)(seed >> 11) / 9007199254740992.0;
}
static int one_of(int count) { return (int)(chance() * count); }

static char said[1000];
static void log_message(void *environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String format, ...) {
    va_list values;
    (void)environment;
    (void)status;
    if (!name || !category || !format) exit(3);
    va_start(values, format);
    vsnprintf(said, sizeof said, format, values);
    va_end(values);
    if (!strlen(said)) exit(4);
}

static double number(void) {
    static const double odd[] = {NAN, INFINITY, -INFINITY, -1.0, 0.0, 1e300, -1e300, 5e-324};
    return chance() < 0.05 ? odd[one_of(8)] : (chance() - 0.3) * 0.05;
}

static char *bytes_of(fmi2Component c, size_t *size) {
    fmi2FMUstate state = NULL;
    if (fmi2GetFMUstate(c, &state) != fmi2OK ||
        fmi2SerializedFMUstateSize(c, state, size) != fmi2OK)
        exit(5);
    char *bytes = (char *)malloc(*size);
    if (fmi2SerializeFMUstate(c, state, bytes, *size) != fmi2OK) exit(6);
    if (fmi2SerializeFMUstate(c, state, bytes, *size - 1) == fmi2OK) exit(7);
    fmi2FreeFMUstate(c, &state);
    return bytes;
}

int main(int count, char **words) {
    if (count != 4) return 2;
    fmi2CallbackFunctions functions = {log_message, NULL, NULL, NULL, NULL};
    fmi2CallbackFunctions silent = {NULL, NULL, NULL, NULL, NULL};
    fmi2FMUstate state[STATES] = {0};
    long answers[6] = {0};
    fmi2Component c =
        fmi2Instantiate("one", fmi2CoSimulation, words[2], words[1], &functions, 0, 0);
    if (!c) {
        puts(said);
        return 2;
    }
    if (fmi2Instantiate("one", fmi2ModelExchange, words[2], words[1], &functions, 0, 0)) return 8;
    if (fmi2Instantiate("one", fmi2CoSimulation, "{other}", words[1], &functions, 0, 0)) return 8;
    if (fmi2Instantiate("one", fmi2CoSimulation, words[2], "file:///nowhere%", &functions, 0, 0))
        return 8;
    if (fmi2Instantiate(NULL, fmi2CoSimulation, words[2], words[1], &silent, 0, 0)) return 8;
    if (fmi2Instantiate("one", fmi2CoSimulation, words[2], NULL, NULL, 0, 0)) return 8;
    for (long call = atol(words[3]); call > 0; --call) {
        fmi2ValueReference vr[2] = {(fmi2ValueReference)one_of(chance() < 0.02 ? 2000 : REFERENCES),
                                    0};
        /* one after the other: compilers differ in the order within a list */
        double first = number(), second = number() * 1e-6, time = chance(),
               length = chance() < 0.95 ? chance() : number();
        fmi2Real value[3] = {first, second, INPUTS == 3 ? number() * 1e-6 : 0.0};
        fmi2Integer whole[2] = {chance() < 0.95 ? 1 : one_of(4), 1};
        int slot = one_of(STATES), kind = one_of(24);
        fmi2Status status = fmi2OK;
        size_t size = 0;
        if (kind < 4) {
            status = fmi2EnterInitializationMode(c);
            if (kind < 2) status = fmi2Reset(c);
            status = fmi2EnterInitializationMode(c);
            status = fmi2ExitInitializationMode(c);
        } else if (kind < 12) {
            fmi2ValueReference all[3] = {0, 1, 2};
            status = fmi2SetReal(c, all, INPUTS, value);
            if (status == fmi2OK) status = fmi2DoStep(c, time, length, fmi2True);
        } else if (kind == 12) {
            status = fmi2GetReal(c, vr, 1, value);
        } else if (kind == 13) {
            status =
                chance() < 0.5 ? fmi2GetInteger(c, vr, 1, whole) : fmi2GetBoolean(c, vr, 1, whole);
        } else if (kind == 14) {
            status = fmi2SetReal(c, vr, 1, value);
        } else if (kind == 15) {
            fmi2ValueReference factor = INPUTS;
            value[0] = 2.0 * chance();
            status = fmi2SetReal(c, &factor, 1, value);
        } else if (kind == 16) {
            status = fmi2GetFMUstate(c, state + slot);
        } else if (kind == 17 && state[slot]) {
            status = fmi2SetFMUstate(c, state[slot]);
        } else if (kind == 18) {
            status = fmi2FreeFMUstate(c, state + slot);
        } else if (kind == 19) {
            status = fmi2GetDirectionalDerivative(c, vr, 1, vr + 1, 1, value, value + 1);
        } else if (kind == 20) {
            status = fmi2SetRealInputDerivatives(c, vr + 1, 1, whole, value);
        } else if (kind == 21) {
            fmi2Reset(c);
            fmi2EnterInitializationMode(c);
            fmi2ExitInitializationMode(c);
            if (state[slot]) fmi2SetFMUstate(c, state[slot]);
            char *bytes = bytes_of(c, &size), *again;
            size_t same;
            fmi2FMUstate made = NULL;
            int place = one_of((int)size), bit = one_of(8);
            if (chance() < 0.5) bytes[place] ^= (char)(1 << bit);
            status = fmi2DeSerializeFMUstate(c, bytes, size, &made);
            if (status == fmi2OK) {
                fmi2SetFMUstate(c, made);
                again = bytes_of(c, &same);
                if (same != size || memcmp(bytes, again, size) != 0) return 1;
                free(again);
            }
            fmi2FreeFMUstate(c, &made);
            free(bytes);
        } else if (kind == 22) {
            fmi2Real last;
            fmi2Boolean ended;
            status = fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &last);
            if (chance() < 0.1) status = fmi2Terminate(c);
            if (chance() < 0.1) status = fmi2CancelStep(c);
            fmi2GetBooleanStatus(c, fmi2Terminated, &ended);
        } else if (kind == 23 && chance() < 0.2) {
            fmi2String text;
            status = fmi2GetString(c, vr, 1, &text);
        }
        ++answers[status];
    }
    fmi2Reset(c);
    for (int k = 0; k < STATES; ++k)
        if (state[k]) {
            size_t size;
            uint64_t sum = 14695981039346656037u;
            if (fmi2SetFMUstate(c, state[k]) != fmi2OK) return 9;
            char *bytes = bytes_of(c, &size);
            for (size_t i = 0; i < size; ++i)
                sum = (sum ^ (unsigned char)bytes[i]) * 1099511628211u;
            free(bytes);
            printf("state %d %llx\n", k, (unsigned long long)sum);
        }
    for (int k = 0; k < STATES; ++k) fmi2FreeFMUstate(c, state + k);
    fmi2FreeInstance(c);
    fmi2FreeInstance(NULL);
    printf("%ld %ld %ld %ld %ld\n", answers[0], answers[1], answers[2], answers[3], answers[4]);
    return 0;
}
