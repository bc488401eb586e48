/* The memory by itself: loops of one sphere against Cattaneo and Mindlin, and of three against
 * their area. */
#include <math.h>
#include <stdio.h>

#include "historysim.h"

static int failures = 0;
static const hs_drive drive = {1e-9, {0.0, 0.0}, 0, 1, NULL, NULL};

static void expect(const char *what, double found, double wanted, double tolerance) {
    printf("%-30s %.15e, expected %.15e\n", what, found, wanted);
    failures += !(fabs(found - wanted) <= tolerance * fabs(wanted));
}

static void load_to(hs_state *memory, double force) {
    failures += hs_step(memory, HS_LOAD, NAN, HS_LOAD, force, &drive, NULL) != HS_OK;
}

/* What a loop from T to -T and back dissipates [J], against its area in chords, whose error falls
 * with their square. */
static double loop(hs_state *memory, double force) {
    const int chords = 8000;
    double before = memory->line.dissipated, area = 0.0;
    for (int k = 1; k <= chords; ++k) {
        double place = memory->line.displacement, load = memory->line.tangential_load;
        load_to(memory, force * (fabs(4.0 * k / chords - 2.0) - 1.0));
        area += 0.5 * (load + memory->line.tangential_load) * (memory->line.displacement - place);
    }
    expect("area of a loop", area, memory->line.dissipated - before, 1e-6);
    return (memory->line.dissipated - before) * memory->line.contact->units.energy;
}

int main(void) {
    const double E = 70e9, G = 25e9, N = 0.5, height[] = {0.0, -20e-9, 5e-9},
                 radius[] = {1e-3, 0.5e-3, 2e-3};
    const double mu[] = {0.3, 0.2, 0.4}, f = 0.6;
    const int64_t group[] = {0, 1, 2};
    hs_refusal refusal;

    hs_contact *contact = hs_contact_new(1, height, radius, NULL, NULL, E, E / (4.0 * G));
    hs_state *sphere = hs_state_new(contact, mu);
    double a = cbrt(0.75 * N * radius[0] / E), limit = mu[0] * N,
           full = 3.0 * limit / (16.0 * a * G);
    failures += hs_step(sphere, HS_LOAD, N, HS_LOAD, 0.0, &drive, NULL) != HS_OK;
    expect("approach", sphere->line.approach * contact->units.length, a * a / radius[0], 1e-14);
    expect("stiffness", hs_stiffness(sphere, 0), 8.0 * G * a, 1e-14);
    load_to(sphere, f * limit);
    double there = full * (1.0 - pow(1.0 - f, 2.0 / 3.0));
    expect("displacement", sphere->line.displacement * contact->units.displacement, there, 1e-14);
    double bracket =
        1.0 - pow(1.0 - f, 5.0 / 3.0) - 5.0 * f / 6.0 * (1.0 + pow(1.0 - f, 2.0 / 3.0));
    expect("energy of a loop", loop(sphere, f * limit), 0.9 * limit * limit / (a * G) * bracket,
           1e-12);
    load_to(sphere, 0.0);
    double back = full * (2.0 * pow(1.0 - f / 2.0, 2.0 / 3.0) - 1.0) - (full - there);
    expect("residual displacement", sphere->line.displacement * contact->units.displacement, back,
           1e-12);
    failures +=
        hs_step(sphere, HS_LOAD, NAN, HS_LOAD, 1.1 * limit, &drive, &refusal) != HS_BEYOND_LIMIT;
    expect("friction limit", refusal.limit, limit, 1e-14);

    hs_contact *rough = hs_contact_new(3, height, radius, NULL, group, E, E / (4.0 * G));
    hs_state *memory = hs_state_new(rough, mu);
    failures += hs_step(memory, HS_LOAD, N, HS_LOAD, 0.0, &drive, NULL) != HS_OK;
    load_to(memory, 0.16 * N);
    loop(memory, 0.16 * N);
    double d = memory->line.approach * rough->units.length, sum = 0.0, held = 0.0;
    for (int i = 0; i < 3; ++i) {
        double load = 4.0 / 3.0 * E * sqrt(radius[i]) * pow(fmax(d - (5e-9 - height[i]), 0.0), 1.5);
        sum += load;
        held += mu[i] * load;
    }
    expect("load of three", sum, N, 1e-12);
    failures += hs_step(memory, HS_LOAD, NAN, HS_DISPLACED, 1e-3, &drive, NULL) != HS_OK;
    expect("sliding", memory->line.tangential_load * rough->units.load, held, 1e-12);

    hs_state_free(sphere);
    hs_state_free(memory);
    hs_contact_free(contact);
    hs_contact_free(rough);
    return failures > 0;
}
