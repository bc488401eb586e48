/* Random histories in two tangential directions, with what has to hold after each step.
 *
 *     planar_histories FIRST LAST STEPS
 *
 * walks the histories of the seeds from FIRST up to LAST, and prints of each its seed and a digest
 * of its numbers: one coefficient and two, loads, displacements and drives, lift-off, falls of
 * friction, copies and bytes, coarse rings and fine. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "historysim.h"

#define MOST 12

static uint64_t random_state, digest, seed, step;

static double uniform(double low, double high) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return low + (high - low) * (double)(random_state >> 11) / 9007199254740992.0;
}
static int one_of(int count) { return (int)uniform(0.0, count); }

static void check(int holds, const char *what) {
    if (holds) return;
    fprintf(stderr, "seed %llu, step %llu: %s\n", (unsigned long long)seed,
            (unsigned long long)step, what);
    exit(1);
}

static void note(double number) {
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    digest = (digest ^ bits) * 1099511628211u;
}

typedef struct history {
    int count;
    double friction[MOST];
    hs_contact *contact;
    hs_state *state;
    double lost;
} history;

static void begin(history *h) {
    double height[MOST], radius[MOST];
    int64_t group[MOST];
    int groups = 1 + one_of(2);
    h->count = 1 + one_of(MOST);
    if (groups > h->count) groups = 1;
    for (int i = 0; i < h->count; ++i) {
        height[i] = -uniform(0.0, 0.8);
        radius[i] = uniform(0.5, 2.0);
        group[i] = i % groups;
        h->friction[i] = 0.2 + 0.1 * (double)group[i];
    }
    h->contact = hs_contact_new(h->count, height, radius, NULL, group, 0.75, 1.0);
    h->state = h->contact ? hs_state_new(h->contact, h->friction) : NULL;
    int classes = 1 + one_of(4), rings = 4 + one_of(12);
    check(h->state && hs_state_enter_plane(h->state, classes, rings, 3e-3) == HS_OK, "no memory");
    h->lost = 0.0;
}

/* Read all there is, and look whether it fits together. */
static void look(history *h) {
    double numbers[8][2 * MOST], load[2], displacement[2], sum[2] = {0.0, 0.0}, most = 0.0;
    int64_t asperity[MOST];
    int8_t state[MOST];
    hs_totals totals;
    hs_rows rows;
    memset(&rows, 0, sizeof rows);
    for (int i = 0; i < h->count; ++i) asperity[i] = i;
    rows.columns = h->count;
    rows.asperity = asperity;
    rows.totals = &totals;
    rows.normal_load = numbers[0];
    rows.tangential_load = numbers[1];
    rows.contact_radius = numbers[2];
    rows.stick_radius = numbers[3];
    rows.dissipated_energy = numbers[4];
    rows.friction = numbers[5];
    rows.slip_state = state;
    rows.total_tangential_load = load;
    rows.total_displacement = displacement;
    check(hs_read(h->state, &rows, 0) == HS_OK, "it cannot be read");
    for (int i = 0; i < 2; ++i) {
        check(isfinite(load[i]) && isfinite(displacement[i]), "a number that is not finite");
        note(load[i]);
        note(displacement[i]);
    }
    note(totals.dissipated_energy);
    check(totals.dissipated_energy >= h->lost * (1.0 - 1e-12), "energy falls");
    check(hs_stored_energy(h->state) >= -1e-12, "less than nothing is stored");
    h->lost = totals.dissipated_energy;
    double lost = 0.0;
    for (int i = 0; i < rows.columns; ++i) {
        for (int axis = 0; axis < 2; ++axis) sum[axis] += numbers[1][2 * i + axis];
        most += numbers[5][i] * numbers[0][i];
        lost += numbers[4][i];
        check(numbers[3][i] <= numbers[2][i] * (1.0 + 1e-9), "more sticks than touches");
    }
    check(hypot(load[0], load[1]) <= most * (1.0 + 1e-6) + 1e-12, "a load beyond the limit");
    check(hypot(sum[0] - load[0], sum[1] - load[1]) <= 1e-9 * most + 1e-12,
          "loads of asperities are not the load");
    check(fabs(lost - h->lost) <= 1e-4 * (h->lost + most) + 1e-12,
          "energies of asperities are not the energy");
}

static void save_and_read(history *h) {
    size_t size = hs_state_size(h->state);
    unsigned char *bytes = (unsigned char *)malloc(size);
    const char *why = NULL;
    hs_state *again = NULL, *copy = hs_state_copy(h->state);
    check(bytes && copy && hs_state_write(h->state, bytes, size) == HS_OK, "it cannot be written");
    check(hs_state_read(bytes, size, h->state, &again, &why) == HS_OK,
          why ? why : "it cannot be read again");
    bytes[one_of((int)size)] ^= (unsigned char)(1 << one_of(8));
    hs_state *damaged = NULL;
    check(hs_state_read(bytes, size, h->state, &damaged, &why) != HS_OK, "damaged bytes are read");
    free(bytes);
    hs_state_free(copy);
    hs_state_free(h->state);
    h->state = again;
}

static void one_event(history *h) {
    double stiffness[4], towards[2] = {uniform(-1, 1), uniform(-1, 1)};
    hs_drive drive = {1e-6, {0.0, 0.0}, 1, 1, NULL, NULL};
    hs_refusal refusal;
    hs_path path;
    memset(&path, 0, sizeof path);
    memset(&refusal, 0, sizeof refusal);
    int kind = one_of(20);
    if (kind == 0) save_and_read(h);
    if (kind == 1) {
        double share = uniform(0.7, 1.2);
        for (int i = 0; i < h->count; ++i) h->friction[i] *= share;
        check(hs_set_friction(h->state, h->friction, &drive) == HS_OK, "friction is refused");
    }
    if (kind == 2)
        check(hs_stiffness_matrix(h->state, towards, stiffness) == HS_OK, "it has no stiffness");
    path.parts = 1;
    path.begin = path.end = NAN;
    path.normal_control = one_of(2) ? HS_LOAD : HS_DISPLACED;
    path.normal_fraction = one_of(2);
    path.normal_target = path.normal_control == HS_LOAD ? uniform(0.05, 1.0) : uniform(0.05, 0.9);
    if (one_of(40) == 0) path.normal_target = path.normal_control == HS_LOAD ? 0.0 : -0.1;
    for (int i = 0; i < 2; ++i) {
        path.tangential_control[i] = one_of(4) ? HS_DISPLACED : HS_LOAD;
        path.tangential_fraction[i] = one_of(6) ? 1.0 : uniform(0, 1);
    }
    double size = one_of(3) ? 0.2 : 0.01;
    for (int i = 0; i < 2; ++i) path.tangential_target[i] = one_of(8) ? uniform(-size, size) : 0.0;
    if (!one_of(6)) drive.compliance[0] = 0.3, drive.compliance[1] = 0.1;
    int status = hs_integrate(h->state, &path, 1, NULL, &drive, 1.0, NULL, &refusal);
    check(status == HS_OK, "a path is refused");
    look(h);
}

int main(int count, char **words) {
    static history h;
    if (count < 4) return 2;
    uint64_t last = strtoull(words[2], NULL, 10), steps = strtoull(words[3], NULL, 10);
    for (seed = strtoull(words[1], NULL, 10); seed < last; ++seed) {
        random_state = seed * 0x2545F4914F6CDD1Du + 88172645463325252u;
        digest = 14695981039346656037u;
        begin(&h);
        for (step = 1; step <= steps; ++step) one_event(&h);
        printf("%llu exact %016llx\n", (unsigned long long)seed, (unsigned long long)digest);
        hs_state_free(h.state);
        hs_contact_free(h.contact);
    }
    return 0;
}
