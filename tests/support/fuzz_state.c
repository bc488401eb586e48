/* Serialised states for libFuzzer: whatever is read as one has to be stepped, read and written
 * without harm.
 *
 * The checksum at the end is made to fit, so that it keeps nothing out. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "historysim.h"

static void require(int holds) {
    if (!holds) abort();
}

static void read_all(const hs_state *memory) {
    int64_t count = memory->line.contact->count;
    int64_t *asperity = (int64_t *)malloc((size_t)count * sizeof *asperity);
    double *numbers = (double *)malloc(12 * (size_t)count * sizeof *numbers);
    int8_t *states = (int8_t *)malloc((size_t)count);
    double vectors[4];
    hs_totals totals;
    hs_rows rows = {count,
                    asperity,
                    &totals,
                    numbers,
                    numbers + 10 * count,
                    numbers + 2 * count,
                    numbers + 3 * count,
                    states,
                    numbers + 4 * count,
                    numbers + 5 * count,
                    numbers + 6 * count,
                    numbers + 7 * count,
                    numbers + 8 * count,
                    numbers + 9 * count,
                    NULL,
                    NULL,
                    NULL,
                    vectors,
                    vectors + 2};
    for (int64_t i = 0; i < count; ++i) asperity[i] = i;
    require(hs_read(memory, &rows, 0) == HS_OK);
    hs_slopes_of(memory, 0.0);
    hs_stiffness(memory, 1);
    hs_stored_energy(memory);
    hs_contact_count(memory);
    hs_state_free(hs_state_of_one(memory, count - 1));
    free(asperity);
    free(numbers);
    free(states);
}

/* New states, each by another step; what is refused is as welcome as what is not. */
static void step_all(const hs_state *memory) {
    const hs_units *units = &memory->line.contact->units;
    const hs_drive drives[] = {{1e-2, {0.0, 0.0}, 0, 1, NULL, NULL},
                               {1e-2, {1.0 / units->stiffness, 0.0}, 1, 1, NULL, NULL}};
    double near = memory->line.approach * units->length,
           load = memory->line.normal_load * units->load;
    double place = memory->line.displacement * units->displacement,
           force = memory->line.tangential_load * units->load;
    const double approaches[] = {NAN, 1.5 * near, 0.5 * near, -1e-9, near};
    const double loads[] = {NAN, fabs(1.01 * load), fabs(0.9 * load), 0.0, fabs(load)};
    const double places[] = {NAN, 2.0 * place + 1e-9, -place, 0.0, place};
    const double forces[] = {NAN, 0.5 * force, -force, 0.0, 2.0 * force};
    for (int k = 0; k < 40; ++k) {
        int by_load = k / 5 % 2, by_force = k / 10 % 2, from = k % 5, to = (k / 5 + k) % 5;
        hs_state_free(hs_advance(memory, by_load ? HS_LOAD : HS_DISPLACED,
                                 by_load ? loads[from] : approaches[from],
                                 by_force ? HS_LOAD : HS_DISPLACED,
                                 by_force ? forces[to] : places[to], drives + k / 20, NULL));
    }
}

/* Other coefficients, evolution, and other summits. */
static void change_all(hs_state *memory) {
    int64_t count = memory->line.contact->count;
    double *friction = (double *)malloc((size_t)count * sizeof *friction);
    uint8_t *fresh = (uint8_t *)calloc((size_t)count, 1);
    const hs_drive drive = {1e-2, {0.0, 0.0}, 1, 1, NULL, NULL};
    hs_evolution evolution;
    hs_refusal refusal;
    memset(&evolution, 0, sizeof evolution);
    evolution.contact_modulus = 1e9;
    evolution.wear.kind = HS_ARCHARD;
    evolution.wear.rate = 1e-13;
    for (int64_t i = 0; i < count; ++i) friction[i] = i % 3 ? 0.2 : 0.5 * memory->line.friction[0];
    fresh[0] = 1;
    int status = hs_set_friction(memory, friction, &drive);
    if (status == HS_OK) status = hs_state_evolve(memory);
    hs_path path = {
        0.0,
        0.0,
        {0.9 * memory->line.displacement * memory->line.contact->units.displacement, 0.0},
        {1.0, 0.0},
        1,
        0,
        HS_DISPLACED,
        {HS_DISPLACED, HS_HELD},
        0,
        0.0,
        1.0};
    if (status == HS_OK)
        status = hs_integrate(memory, &path, 1, NULL, &drive, 1.0, &evolution, &refusal);
    if (status == HS_OK) {
        for (int64_t i = 0; i < count; ++i)
            friction[i] = fabs(memory->line.evolved->summit_radius[i]) + 1e-9;
        hs_set_summits(memory, memory->line.evolved->worn_volume, friction, fresh, &evolution);
    }
    free(friction);
    free(fresh);
}

int LLVMFuzzerTestOneInput(const uint8_t *given, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *given, size_t size) {
    unsigned char *bytes = (unsigned char *)malloc(size ? size : 1);
    const char *why = NULL;
    hs_state *memory, *again;
    memcpy(bytes, given, size);
    if (size > sizeof(uint64_t)) {
        uint64_t sum = hs_digest(0, bytes, size - sizeof sum);
        memcpy(bytes + size - sizeof sum, &sum, sizeof sum);
    }
    if (hs_state_read(bytes, size, NULL, &memory, &why) == HS_OK) {
        /* what was read is written as it was, and is shared with what is alike */
        unsigned char *written = (unsigned char *)malloc(size);
        require(hs_state_size(memory) == size && hs_state_write(memory, written, size) == HS_OK);
        require(memcmp(bytes, written, size) == 0);
        require(hs_state_read(written, size, memory, &again, &why) == HS_OK);
        require(again->line.contact == memory->line.contact);
        free(written);
        read_all(memory);
        step_all(memory);
        change_all(again);
        hs_state_free(memory);
        hs_state_free(again);
    } else {
        require(why != NULL);
    }
    free(bytes);
    return 0;
}
