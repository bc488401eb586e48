/* Ramps of both loads over five summits of nanometres and three coefficients, held at the friction
 * limit.
 *
 *     ramps FIRST LAST STEPS [PARTS]
 *
 * walks those of the seeds from FIRST to before LAST, and prints the chords of each. With parts,
 * each ramp is walked once more in so many, and in half as many, and printed is how far both
 * displacements are from that of the whole ramp, over the displacement at which the contact slides,
 * and energies, over that of the ramp. Linked with --wrap=hs_solve_displacement_with. */
#include "displacement.h"

#include <stdio.h>

#define SUMMITS 5
#define GROUPS 3

static uint64_t random_state;
static long chords;

int __real_hs_solve_displacement_with(hs_line *memory, const hs_group_loads *loads,
                                      hs_fronts *fronts, double d, hs_target target, double *found);
int __wrap_hs_solve_displacement_with(hs_line *memory, const hs_group_loads *loads,
                                      hs_fronts *fronts, double d, hs_target target, double *found);
int __wrap_hs_solve_displacement_with(hs_line *memory, const hs_group_loads *loads,
                                      hs_fronts *fronts, double d, hs_target target,
                                      double *found) {
    ++chords;
    return __real_hs_solve_displacement_with(memory, loads, fronts, d, target, found);
}

static double between(double low, double high) { /* splitmix64 */
    uint64_t z = random_state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return low + (high - low) * ((double)((z ^ (z >> 31)) >> 11) * 0x1p-53);
}

static void print_distance(const hs_state *start, const hs_state *whole, double normal,
                           double tangential, int64_t parts) {
    hs_state *other = hs_state_copy(start);
    hs_path path = {normal, 1.0,     {tangential, 0.0},  {1.0, 0.0}, parts,
                    0,      HS_LOAD, {HS_LOAD, HS_HELD}, 0,          NAN,
                    NAN};
    hs_drive drive = {1e-6, {0.0, 0.0}, 1, 1, NULL, NULL};
    hs_refusal refusal;
    double top =
        hs_max(start->line.approach, whole->line.approach) - whole->line.contact->sorted_gap[0];
    double reach = hs_friction_range(&whole->line, HUGE_VAL).max * top,
           lost = whole->line.dissipated - start->line.dissipated;
    if (hs_integrate(other, &path, 1, NULL, &drive, 1.0, NULL, &refusal) != HS_OK) abort();
    printf(" %.3e %.3e", (whole->line.displacement - other->line.displacement) / reach,
           lost > 0.0 ? (whole->line.dissipated - other->line.dissipated) / lost : 0.0);
    hs_state_free(other);
}

static hs_state *begun(double *heaviest, double *friction) {
    double height[SUMMITS], radius[SUMMITS], mu[SUMMITS], rough = 1e-9 * between(0.3, 30.0);
    int64_t group[SUMMITS];
    hs_drive drive = {1e-6, {0.0, 0.0}, 1, 1, NULL, NULL};
    *friction = 0.0;
    for (int g = 0; g < GROUPS; ++g) mu[g] = between(0.05, 0.7);
    for (int i = 0; i < SUMMITS; ++i) {
        height[i] = between(-rough, rough);
        radius[i] = 1e-4 * between(0.3, 1.0);
        group[i] = i < GROUPS ? i : (int64_t)between(0.0, GROUPS);
        mu[i] = mu[group[i]];
        *friction += mu[i] / SUMMITS;
    }
    hs_contact *contact =
        hs_contact_new(SUMMITS, height, radius, NULL, group, 50e9, between(0.25, 1.2));
    hs_state *memory = hs_state_new(contact, mu), *pressed = hs_state_copy(memory);
    if (hs_step(pressed, HS_DISPLACED, 3.0 * rough, HS_LOAD, 0.0, &drive, NULL) != HS_OK) abort();
    *heaviest = pressed->line.normal_load * contact->units.load;
    hs_state_free(pressed);
    hs_contact_free(contact);
    return memory;
}

int main(int count, char **words) {
    if (count < 4) return 2;
    int64_t parts = count > 4 ? atoll(words[4]) : 0;
    hs_drive drive = {1e-6, {0.0, 0.0}, 1, 1, NULL, NULL};
    for (long seed = atol(words[1]); seed < atol(words[2]); ++seed) {
        random_state = (uint64_t)seed;
        double heaviest, friction;
        hs_state *memory = begun(&heaviest, &friction);
        for (int step = 0; step < atoi(words[3]); ++step) {
            double normal = between(0.0, 1.0) < 0.1    ? 0.0
                            : between(0.0, 1.0) < 0.25 ? between(0.0, 1e-3)
                                                       : between(0.0, 1.0);
            double tangential = friction * (between(0.0, 1.0) < 0.3 ? between(-1.0, 1.0)
                                                                    : between(-1.5, 1.5) * normal);
            hs_state *start = hs_state_copy(memory);
            chords = 0;
            if (hs_step(memory, HS_LOAD, normal * heaviest, HS_LOAD, tangential * heaviest, &drive,
                        NULL) != HS_OK)
                return 1;
            printf("%ld %d %ld", seed, step, chords);
            for (int64_t k = parts / 2; k > 0 && k <= parts; k *= 2)
                print_distance(start, memory, normal * heaviest, tangential * heaviest, k);
            printf("\n");
            hs_state_free(start);
        }
        hs_state_free(memory);
    }
    return 0;
}
