/* Random histories of every kind of event, drawn from integers: the same on every machine.
 *
 *     random_histories FIRST LAST STEPS [FOLDER]
 *
 * walks the histories of the seeds from FIRST to before LAST, each of so many steps, and prints of
 * each its seed, whether its friction calls pow, and a digest of all states' bytes and of all that
 * was read from them. What has to hold after each step is looked at: a state is sound, it survives
 * its bytes and its copies, a refused path changes nothing, what is dissipated does not fall. With
 * a folder, the last state of each history is written to it. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "historysim.h"

#define MOST 24  /* asperities */
#define ROWS 12  /* of a walk */
#define COPIES 4 /* that are kept beside the present state */
#define MET 16   /* targets that are come back to */

static uint64_t seed, step, random_state, digest;
static const char *doing = "";

/* ---- small tools ---- */

static void require(int holds, const char *what) {
    if (holds) return;
    fprintf(stderr, "seed %llu, step %llu, %s: %s\n", (unsigned long long)seed,
            (unsigned long long)step, doing, what);
    abort();
}

static void *there(void *memory) {
    require(memory != NULL, "there is no memory");
    return memory;
}

static uint64_t bits(void) { /* splitmix64 */
    uint64_t z = random_state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}
static int below(int count) { return (int)(bits() % (uint64_t)count); }
static int one_in(int count) { return below(count) == 0; }
static double between(double low, double high) {
    return low + (high - low) * ((double)(bits() >> 11) * 0x1p-53);
}
/* Powers of 10, by products alone. */
static double magnitude(int low, int high) {
    double found = 1.0;
    for (int k = low + below(high - low + 1); k; k += k < 0 ? 1 : -1)
        found = k < 0 ? found / 10.0 : found * 10.0;
    return found;
}

static void note(const void *bytes, size_t size) {
    const unsigned char *at = (const unsigned char *)bytes;
    for (size_t i = 0; i < size; ++i) digest = (digest ^ at[i]) * 1099511628211u;
}

/* The bytes of a memory; the caller frees them. */
static unsigned char *bytes_of(const hs_state *memory, size_t *size) {
    *size = hs_state_size(memory);
    unsigned char *bytes = (unsigned char *)there(malloc(*size));
    require(hs_state_write(memory, bytes, *size) == HS_OK, "is not written");
    return bytes;
}

static void require_alike(const hs_state *one, const hs_state *other, const char *what) {
    size_t size, other_size;
    unsigned char *bytes = bytes_of(one, &size), *others = bytes_of(other, &other_size);
    require(size == other_size && memcmp(bytes, others, size) == 0, what);
    free(bytes);
    free(others);
}

/* ---- one history ---- */

typedef struct history {
    int64_t count;
    int evolves, calls_pow;
    int knots;                              /* a normal curve of knots in place of summits */
    double height[MOST], radius[MOST], top; /* [m] */
    double modulus, reach, deepest;         /* [Pa], [m] of displacements and of approaches */
    double farthest;                        /* displacement so far, dimensionless */
    double heaviest;                        /* normal load at the deepest approach [N] */
    double met[3][MET]; /* loads, approaches and displacements that were targets */
    double distance[3], coefficient[3], goal[MOST];
    hs_state *memory, *copy[COPIES];
    hs_evolution evolution;
    hs_drive drive;
} history;

static double limit_of(const hs_state *memory) {
    hs_totals totals;
    hs_rows rows;
    memset(&rows, 0, sizeof rows);
    rows.totals = &totals;
    require(hs_read(memory, &rows, 0) == HS_OK, "is not read");
    return totals.friction_limit;
}

static int callers_law(void *user, const hs_loaded *loaded, double *friction) {
    for (int64_t i = 0; i < loaded->count; ++i)
        friction[i] =
            0.1 + 0.2 / (1.0 + loaded->normal_load[i] / (1e-3 * loaded->total_normal_load));
    return one_in(*(int *)user);
}

static int callers_wear(void *user, int64_t count, const double *load, const double *slid,
                        const double *energy, double *volume) {
    for (int64_t i = 0; i < count; ++i)
        volume[i] = 1e-15 * load[i] * slid[i] + 1e-16 * fabs(energy[i]);
    return one_in(*(int *)user);
}
static int rarely = 20000;

static void choose_evolution(history *h) {
    hs_law *law = &h->evolution.law;
    hs_wear *wear = &h->evolution.wear;
    static const int kinds[] = {HS_NO_LAW, HS_SHEAR_STRENGTH, HS_SLID_TABLE, HS_CALLERS_LAW};
    static const int dependence[] = {HS_ON_NOTHING, HS_ON_OWN_LOAD, HS_ON_SLID_DISTANCE,
                                     HS_ON_OWN_LOAD};
    int kind = below(4);
    memset(&h->evolution, 0, sizeof h->evolution);
    h->evolution.contact_modulus = h->modulus;
    h->evolution.count = h->count;
    law->kind = h->calls_pow ? (int)HS_POWER_LAW : kinds[kind];
    law->depends_on = h->calls_pow ? 1 + below(2) : dependence[kind];
    law->coefficient = between(0.05, 0.5);
    law->reference_load = h->heaviest / (double)h->count;
    law->exponent = between(-0.4, 0.2);
    law->work_of_adhesion = one_in(2) ? 0.0 : 1e-3 * h->modulus * h->deepest;
    law->shear_strength = between(0.01, 0.1) * h->modulus * 0.1;
    for (int k = 0; k < 3; ++k) {
        h->distance[k] = k * 10.0 * h->reach;
        h->coefficient[k] = between(0.1, 0.4);
    }
    law->rows = 3;
    law->distance = h->distance;
    law->coefficients = h->coefficient;
    law->function = callers_law;
    law->user = &rarely;
    wear->kind = h->calls_pow ? (int)HS_NO_WEAR : below(4);
    wear->shape = below(2);
    wear->rate = 1e-4 / h->modulus;
    wear->function = callers_wear;
    wear->user = &rarely;
}

static void choose_drive(history *h) {
    const hs_units *units = &h->memory->line.contact->units;
    double soft = magnitude(-2, 2) / (units->stiffness * sqrt(h->deepest / units->length));
    h->drive.tolerance = h->evolves ? (one_in(20) ? 1e-3 : 1e-2) : one_in(20) ? 1e-6 : 1e-3;
    h->drive.compliance[0] = one_in(3) ? soft : 0.0;
    h->drive.saturate = one_in(2);
    h->drive.threads = 1 + below(2);
}

static void begin(history *h) {
    int64_t group[MOST];
    double friction[MOST], each[MOST], stiffness[MOST];
    int kind = below(8);
    memset(h, 0, sizeof *h);
    h->calls_pow = one_in(20);
    h->evolves = h->calls_pow || one_in(10);
    h->knots = one_in(20);
    h->count = kind == 0 ? 1 : 1 + below(h->evolves ? 5 : MOST);
    int64_t groups = kind < 4 ? 1 : kind < 6 ? 1 + below(3) : h->count;
    if (groups > h->count) groups = h->count;
    h->modulus = 1e9 * magnitude(0, 2);
    double size = 1e-6 * magnitude(0, 3), rough = size * magnitude(-5, -1),
           ratio = between(0.25, 1.2);
    for (int64_t g = 0; g < groups; ++g) each[g] = one_in(16) ? 0.0 : between(0.02, 0.9);
    h->top = -HUGE_VAL;
    for (int64_t i = 0; i < h->count; ++i) {
        h->height[i] = one_in(6) && i > 0 ? h->height[i - 1] : between(-rough, rough);
        h->radius[i] = one_in(4) && i > 0 ? h->radius[i - 1] : size * between(0.3, 1.0);
        group[i] = i < groups ? i : below((int)groups);
        friction[i] = each[group[i]];
        if (h->height[i] > h->top) h->top = h->height[i];
    }
    if (groups > 1 || h->evolves) h->knots = 0;
    /* stiffnesses rise with the depth, all at once where two knots are at one place */
    if (h->knots)
        for (int64_t i = 0; i < h->count; ++i) {
            h->height[i] =
                i == 0 ? rough
                       : h->height[i - 1] - (one_in(5) ? 0.0 : between(0.0, 2.0 * rough / MOST));
            stiffness[i] = (i == 0 ? 0.0 : stiffness[i - 1]) +
                           h->modulus * size * (one_in(3) && i > 0 ? 0.0 : between(0.01, 1.0));
            h->top = rough;
        }
    hs_contact *contact = (hs_contact *)there(
        hs_contact_new(h->count, h->height, h->radius, h->knots ? stiffness : NULL,
                       one_in(2) && groups == 1 ? NULL : group, h->modulus, ratio));
    h->memory = (hs_state *)there(hs_state_new(contact, friction));
    hs_contact_free(contact);
    h->deepest = 1.5 * rough;
    h->reach = 0.5 * h->deepest * ratio;
    hs_state *pressed = (hs_state *)there(hs_state_copy(h->memory));
    choose_drive(h);
    require(hs_step(pressed, HS_DISPLACED, h->deepest, HS_LOAD, 0.0, &h->drive, NULL) == HS_OK,
            "is not pressed");
    h->heaviest = pressed->line.normal_load * pressed->line.contact->units.load;
    hs_state_free(pressed);
    choose_evolution(h);
}

static void end(history *h) {
    hs_state_free(h->memory);
    for (int k = 0; k < COPIES; ++k) hs_state_free(h->copy[k]);
}

/* Where a channel goes: held, to a place it has been to, a little on its way, or anywhere. */
static double target(history *h, int quantity, double least, double most, double present) {
    double *met = h->met[quantity], found;
    switch (below(8)) {
    case 0:
        return NAN;
    case 1:
        found = met[below(MET)];
        break;
    case 2:
        found = present;
        break;
    case 3:
        found = present + (most - least) * magnitude(-9, -2) * (one_in(2) ? 1.0 : -1.0);
        break;
    case 4:
        found = one_in(4) ? 0.0 : between(least, most);
        break;
    default:
        found = between(least, most);
    }
    met[below(MET)] = found;
    return found;
}

static void choose_goals(history *h, hs_path *path) {
    const hs_units *units = &h->memory->line.contact->units;
    memset(path, 0, sizeof *path);
    path->normal_control = below(2);
    path->tangential_control[0] = below(2);
    path->tangential_control[1] = HS_HELD;
    /* ramps of both loads are long walks in chords */
    if (path->normal_control == HS_LOAD && path->tangential_control[0] == HS_LOAD && !one_in(4))
        path->normal_control = HS_DISPLACED;
    if (path->normal_control == HS_LOAD) {
        path->normal_target =
            target(h, 0, 0.0, h->heaviest, h->memory->line.normal_load * units->load);
        if (path->normal_target < 0.0) path->normal_target = 0.0;
    } else {
        path->normal_target =
            target(h, 1, -0.1 * h->deepest, h->deepest, h->memory->line.approach * units->length);
    }
    if (path->tangential_control[0] == HS_LOAD) {
        double limit = one_in(8) ? h->heaviest : limit_of(h->memory), far = one_in(4) ? 1.5 : 1.0;
        path->tangential_target[0] = limit * between(-far, far);
        if (one_in(8)) path->tangential_target[0] = copysign(limit, path->tangential_target[0]);
        if (one_in(8)) path->tangential_target[0] = one_in(2) ? 0.0 : NAN;
    } else {
        double stiffness = units->stiffness * sqrt(h->deepest / units->length);
        double far =
            h->reach * (1.0 + h->drive.compliance[0] * stiffness) * (one_in(8) ? 10.0 : 1.0);
        path->tangential_target[0] =
            target(h, 2, -far, far, h->memory->line.displacement * units->displacement);
    }
    path->normal_fraction = one_in(4) ? between(0.0, 1.0) : 1.0;
    path->tangential_fraction[0] = one_in(4) ? between(0.0, 1.0) : 1.0;
    if (isnan(path->normal_target)) path->normal_target = path->normal_fraction = 0.0;
    if (isnan(path->tangential_target[0]))
        path->tangential_target[0] = path->tangential_fraction[0] = 0.0;
    path->parts = one_in(3) ? 1 + below(4) : 1;
    path->recorded = !one_in(4);
    path->begin = one_in(2) ? between(0.0, 1.0) : NAN;
    path->end = path->begin + 1.0;
}

/* ---- events ---- */

static int stepped(hs_state *memory, const hs_path *path, const hs_drive *drive,
                   hs_refusal *refusal) {
    return hs_step(
        memory, path->normal_control, path->normal_fraction == 0.0 ? NAN : path->normal_target,
        path->tangential_control[0],
        path->tangential_fraction[0] == 0.0 ? NAN : path->tangential_target[0], drive, refusal);
}

static void do_step(history *h) {
    hs_path path;
    hs_refusal refusal;
    double before = h->memory->line.dissipated;
    doing = "step";
    choose_goals(h, &path);
    hs_state *start = one_in(4) ? (hs_state *)there(hs_state_copy(h->memory)) : NULL;
    int status = stepped(h->memory, &path, &h->drive, &refusal);
    require(status == HS_OK || status == HS_BEYOND_LIMIT, "fails");
    require(status == refusal.status, "does not say why it is refused");
    require(h->memory->line.dissipated >= before, "what is dissipated falls");
    if (!start) return;
    if (status == HS_BEYOND_LIMIT) {
        require(fabs(refusal.request) > refusal.limit, "a load within the limit is refused");
        require_alike(start, h->memory, "a refused path changes the state");
    }
    hs_state *after = hs_advance(
        start, path.normal_control, path.normal_fraction == 0.0 ? NAN : path.normal_target,
        path.tangential_control[0],
        path.tangential_fraction[0] == 0.0 ? NAN : path.tangential_target[0], &h->drive, NULL);
    require((after != NULL) == (status == HS_OK), "a new state is refused what a step is not");
    if (after) require_alike(after, h->memory, "a new state is another than that of a step");
    hs_state_free(start);
    hs_state_free(after);
}

/* Swings that become smaller: each is remembered, what lies deep is shared by copies. */
static void do_spiral(history *h) {
    double size = h->reach * between(0.1, 1.0), sign = 1.0;
    hs_drive drive = {1e-3, {0.0, 0.0}, 1, 1, NULL, NULL};
    doing = "spiral";
    for (int k = 50 + below(200); k > 0; --k, sign = -sign) {
        size *= 0.99;
        hs_state *next = (hs_state *)there(
            hs_advance(h->memory, HS_LOAD, NAN, HS_DISPLACED, sign * size, &drive, NULL));
        int kept = below(8);
        if (kept < COPIES) {
            hs_state *other = h->copy[kept];
            h->copy[kept] = h->memory;
            h->memory = other;
        }
        hs_state_free(h->memory);
        h->memory = next;
    }
}

static void do_set_friction(history *h) {
    double friction[MOST], all = between(0.02, 0.9), falls = one_in(2) ? 1.0 : between(0.3, 1.0);
    const hs_contact *contact = h->memory->line.contact;
    int kind = h->knots ? 0 : below(4);
    doing = "friction";
    for (int64_t g = 0; g < contact->groups; ++g)
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i)
            friction[contact->order[i]] = kind == 0 ? all : falls * h->memory->line.friction[g];
    for (int64_t i = 0; i < h->count && kind > 1; ++i)
        if (one_in(3)) friction[i] = one_in(9) ? 0.0 : one_in(3) ? 0.3 : between(0.02, 0.9);
    double before = h->memory->line.dissipated;
    require(hs_set_friction(h->memory, friction, &h->drive) == HS_OK, "fails");
    require(h->memory->line.dissipated >= before, "what is dissipated falls");
}

/* Arrays of rows for some asperities, each as long as it says. */
static hs_rows new_rows(int64_t *asperity, int64_t count, int64_t rows) {
    hs_rows made;
    double **each[] = {&made.normal_load, &made.tangential_load, &made.contact_radius,
                       &made.stick_radius};
    double **more[] = {&made.dissipated_energy, &made.friction,      &made.slid_distance,
                       &made.worn_volume,       &made.summit_height, &made.summit_radius};
    memset(&made, 0, sizeof made);
    made.columns = below((int)count + 1);
    for (int64_t c = 0; c < made.columns; ++c) asperity[c] = below((int)count);
    made.asperity = asperity;
    made.totals = (hs_totals *)there(calloc((size_t)rows + 1, sizeof *made.totals));
    size_t size = (size_t)(rows * made.columns);
    int projects = !one_in(4);
    for (int k = 0; k < 4 && projects; ++k)
        *each[k] = (double *)there(calloc(size + 1, sizeof(double)));
    if (projects) made.slip_state = (int8_t *)there(calloc(size + 1, 1));
    for (int k = 0; k < 6; ++k)
        if (!one_in(4)) *more[k] = (double *)there(calloc(size + 1, sizeof(double)));
    return made;
}

static void note_rows(hs_rows *rows, int64_t count) {
    size_t size = (size_t)(count * rows->columns);
    double *each[] = {rows->normal_load,   rows->tangential_load,   rows->contact_radius,
                      rows->stick_radius,  rows->dissipated_energy, rows->friction,
                      rows->slid_distance, rows->worn_volume,       rows->summit_height,
                      rows->summit_radius};
    note(rows->totals, (size_t)count * sizeof *rows->totals);
    for (int k = 0; k < 10; ++k)
        if (each[k]) note(each[k], size * sizeof(double));
    if (rows->slip_state) note(rows->slip_state, size);
    free(rows->totals);
    for (int k = 0; k < 10; ++k) free(each[k]);
    free(rows->slip_state);
}

/* Walk some paths, of which rows are recorded; where one is refused, the history goes on from the
 * start. */
static void do_walk(history *h, int evolving) {
    hs_path paths[3];
    int64_t count = 1 + below(3), rows = 0, asperity[MOST];
    hs_refusal refusal;
    memset(&refusal, 0, sizeof refusal);
    doing = evolving ? "walk that evolves" : "walk";
    hs_state *walked = (hs_state *)there(hs_state_copy(h->memory));
    h->evolution.goal = NULL;
    h->evolution.goal_fraction = 1.0;
    if (evolving && one_in(4)) {
        double all = between(0.05, 0.6);
        for (int64_t i = 0; i < h->count; ++i) h->goal[i] = one_in(3) ? between(0.05, 0.6) : all;
        h->evolution.goal = h->goal;
        h->evolution.goal_fraction = one_in(2) ? 1.0 : between(0.0, 1.0);
        count = 1;
    }
    for (int64_t p = 0; p < count; ++p) {
        choose_goals(h, paths + p);
        paths[p].first_row = rows;
        rows += paths[p].parts - 1 + paths[p].recorded;
    }
    hs_rows recorded = new_rows(asperity, h->count, rows);
    const hs_rows *handed = one_in(4) ? NULL : &recorded;
    double until = one_in(6) ? between(0.1, 1.0) : 1.0;
    int status = hs_integrate(walked, paths, count, handed, &h->drive, until,
                              evolving ? &h->evolution : NULL, &refusal);
    require(status == HS_OK || status == HS_BEYOND_LIMIT || (evolving && status == HS_LAW_FAILED),
            "fails");
    note_rows(&recorded, rows);
    hs_state_free(status == HS_OK ? h->memory : walked);
    if (status == HS_OK) h->memory = walked;
}

/* Whether summits have become so much flatter or lower that nothing is left of them. */
static int worn_out(const history *h) {
    for (int64_t i = 0; i < h->count; ++i)
        if (h->memory->line.evolved->summit_radius[i] > 10.0 * h->radius[i] ||
            h->memory->line.evolved->summit_height[i] < h->top - 10.0 * h->deepest)
            return 1;
    return 0;
}

/* Give some asperities other summits, all of them those of the beginning where they are worn out.
 */
static void do_summits(history *h) {
    int replaced = worn_out(h);
    uint8_t fresh[MOST];
    double height[MOST], radius[MOST],
        load = h->memory->line.normal_load * h->memory->line.contact->units.load;
    doing = "summits";
    h->evolution.goal = NULL;
    memcpy(height, h->memory->line.evolved->summit_height, (size_t)h->count * sizeof *height);
    memcpy(radius, h->memory->line.evolved->summit_radius, (size_t)h->count * sizeof *radius);
    for (int64_t i = 0; i < h->count; ++i) {
        fresh[i] = replaced || one_in(2);
        if (replaced) height[i] = h->height[i], radius[i] = h->radius[i];
        if (fresh[i] && one_in(2)) height[i] = h->top - between(0.0, h->deepest);
        if (fresh[i] && one_in(2)) radius[i] = h->radius[i] * between(0.5, 1.5);
    }
    int status = hs_set_summits(h->memory, height, radius, fresh, &h->evolution);
    require(status == HS_OK || status == HS_LAW_FAILED, "fails");
    const char *wrong = hs_state_check(h->memory);
    require(!wrong, wrong ? wrong : "");
    hs_path back = {load, 1.0, {0.0, 0.0}, {0.0, 0.0}, 1, 0, HS_LOAD, {HS_DISPLACED, HS_HELD},
                    0,    NAN, NAN};
    hs_refusal refusal;
    hs_drive drive = {1e-3, {0.0, 0.0}, 1, 1, NULL, NULL};
    status = hs_integrate(h->memory, &back, 1, NULL, &drive, 1.0, &h->evolution, &refusal);
    require(status == HS_OK || status == HS_LAW_FAILED, "is not pressed again");
}

/* Read a state in all ways. */
static void do_read(history *h) {
    int64_t asperity[MOST];
    const hs_state *memory = h->memory;
    doing = "read";
    hs_rows rows = new_rows(asperity, h->count, 1);
    require(hs_read(memory, &rows, 0) == HS_OK, "fails");
    note_rows(&rows, 1);
    hs_slopes slopes = hs_slopes_of(memory, h->deepest * between(0.0, 1.0));
    double numbers[] = {
        slopes.tangential,           slopes.coupling,          slopes.normal,
        hs_stiffness(memory, -1),    hs_stiffness(memory, 0),  hs_stiffness(memory, 1),
        hs_normal_stiffness(memory), hs_stored_energy(memory), (double)hs_contact_count(memory)};
    note(numbers, sizeof numbers);
    for (int64_t i = 0; i < h->count; ++i) {
        hs_state *one = (hs_state *)there(hs_state_of_one(memory, i));
        size_t size;
        unsigned char *bytes = bytes_of(one, &size);
        note(bytes, size);
        free(bytes);
        hs_state_free(one);
    }
}

static void do_copy(history *h) {
    int k = below(COPIES);
    doing = "copy";
    if (h->copy[k] && one_in(2)) {
        hs_state *other = h->copy[k];
        h->copy[k] = h->memory;
        h->memory = other;
        return;
    }
    hs_state_free(h->copy[k]);
    h->copy[k] = (hs_state *)there(hs_state_copy(h->memory));
    require_alike(h->copy[k], h->memory, "a copy is another state");
}

static void do_bytes(history *h) {
    hs_state *again;
    const char *why;
    size_t size;
    doing = "bytes";
    unsigned char *bytes = bytes_of(h->memory, &size);
    int status = hs_state_read(bytes, size, one_in(2) ? h->memory : NULL, &again, &why);
    require(status == HS_OK, why ? why : "is not read");
    require_alike(again, h->memory, "what is read is another state");
    hs_state_free(h->memory);
    h->memory = again;
    /* one bit more or less is no state */
    bytes[bits() % size] ^= (unsigned char)(1 << below(8));
    require(hs_state_read(bytes, size, NULL, &again, &why) == HS_NOT_A_STATE && why,
            "damage is not seen");
    require(hs_state_read(bytes, bits() % size, NULL, &again, &why) == HS_NOT_A_STATE && why,
            "a cut is not seen");
    free(bytes);
}

/* Patches whose normal curves the elements carry, all of it drawn at random. */
static void do_patches(history *h) {
    enum { TABLE = 5, PATCHES = 3 };
    double gain[PATCHES * TABLE], approach[TABLE + 1], area[(TABLE + 1) * PATCHES];
    double touch[PATCHES], at[2], stick[2];
    int64_t asperity[MOST], row[MOST], patch[PATCHES] = {0, 1, 2}, n = h->count;
    if (h->memory->line.contact->groups > 1) return;
    doing = "patches";
    for (int64_t k = 0; k < n; ++k) row[k] = below(TABLE);
    for (int k = 0; k < PATCHES * TABLE; ++k) gain[k] = between(0.0, 1.0);
    for (int k = 0; k <= TABLE; ++k) approach[k] = k * h->deepest / TABLE;
    for (int k = 0; k < (TABLE + 1) * PATCHES; ++k) area[k] = between(0.0, 1e-12) * (k / PATCHES);
    for (int k = 0; k < PATCHES; ++k) touch[k] = k * h->deepest / 4.0;
    for (int64_t i = 0; i < n; ++i) asperity[i] = i;
    size_t size = (size_t)(2 * (n + PATCHES));
    double *numbers = (double *)there(calloc(5 * size, sizeof *numbers));
    int8_t *states = (int8_t *)there(calloc(size, 1));
    hs_totals totals[2];
    hs_rows elements, rows;
    memset(&elements, 0, sizeof elements);
    memset(&rows, 0, sizeof rows);
    double **each[] = {&elements.normal_load, &elements.tangential_load, &elements.contact_radius,
                       &elements.stick_radius, &elements.dissipated_energy};
    double **target[] = {&rows.normal_load, &rows.tangential_load, &rows.contact_radius,
                         &rows.stick_radius, &rows.dissipated_energy};
    for (size_t k = 0; k < 5; ++k) {
        *each[k] = numbers + k * size;
        *target[k] = numbers + k * size + 2 * n;
    }
    elements.columns = n;
    elements.asperity = asperity;
    elements.totals = totals;
    elements.slip_state = states;
    rows.columns = PATCHES;
    rows.asperity = patch;
    rows.slip_state = states + 2 * n;
    for (int k = 0; k < 2; ++k) {
        require(hs_read(h->memory, &elements, k) == HS_OK, "is not read");
        at[k] = h->memory->line.approach * h->memory->line.contact->units.length;
        stick[k] = at[k] * between(0.0, 1.0);
    }
    hs_patches patches = {PATCHES, TABLE, row, gain, approach, area, touch};
    require(hs_record_patches(&patches, &elements, 2, at, stick, h->memory->line.friction[0],
                              &rows) == HS_OK,
            "fails");
    note(numbers, 5 * size * sizeof *numbers);
    note(states, size);
    free(numbers);
    free(states);
}

/* A batch, beside memories of one asperity each. */
static void do_batch(void) {
    enum { CONTACTS = 7 };
    double friction[CONTACTS], scale[CONTACTS], d[CONTACTS], u[CONTACTS], normal[CONTACTS],
        force[CONTACTS];
    int each = one_in(2);
    doing = "batch";
    for (int i = 0; i < CONTACTS; ++i) {
        friction[i] = one_in(9) ? 0.0 : between(0.1, 0.8);
        scale[i] = between(1.0, 2.0);
    }
    hs_batch *batch = (hs_batch *)there(
        hs_batch_new(CONTACTS, each ? CONTACTS : 1, friction, each ? CONTACTS : 1, scale, 0.5));
    double shrink = 1.0;
    for (int k = 5 + below(60); k > 0; --k) {
        shrink *= 0.97;
        for (int i = 0; i < CONTACTS; ++i) {
            d[i] = one_in(9) ? -1e-9 : k % 5 ? 1e-8 : between(0.0, 2e-8);
            u[i] = (k % 2 ? 1e-8 : -1e-8) * shrink * (one_in(9) ? between(0.0, 1.0) : 1.0);
        }
        if (one_in(20)) hs_batch_forget(batch, below(CONTACTS));
        require(hs_batch_step(batch, d, u, normal, force) == HS_OK, "fails");
        note(normal, sizeof normal);
        note(force, sizeof force);
        for (int i = 0; i < CONTACTS; ++i)
            require(fabs(force[i]) <= friction[each ? i : 0] * normal[i] * (1.0 + 1e-9),
                    "a load is beyond the limit");
        if (!one_in(10)) continue;
        hs_batch *copy = (hs_batch *)there(hs_batch_copy(batch));
        hs_batch_free(batch);
        batch = copy;
    }
    hs_batch_free(batch);
}

/* Look whether a memory is sound: of each group the vertices begin where it touches, and lie on
 * lines of their slopes, but for what was rounded at the largest displacements. */
static void require_sound(history *h) {
    const hs_state *memory = h->memory;
    const hs_contact *contact = memory->line.contact;
    const char *wrong = hs_state_check(memory);
    require(!wrong, wrong ? wrong : "");
    double size = h->deepest / contact->units.length, v = fabs(memory->line.displacement);
    h->farthest = h->farthest > v ? h->farthest : v;
    hs_state *copy = hs_state_copy(memory);
    require(copy && hs_restore_groups(copy) == HS_OK, "has no vertices");
    memory = copy;
    for (int64_t g = 0; g < contact->groups; ++g) {
        const hs_vertex *stack = memory->line.vertices + g * memory->line.capacity;
        if (memory->line.depth[g] == 0) continue;
        /* what chords foresee of wear may be taken back, within their tolerance */
        double slack = (memory->line.evolved ? h->drive.tolerance : 1e-9) * size;
        require(stack[0].label <= contact->gap[contact->first[g]] + slack, "begins beyond its gap");
        double steepest = memory->line.friction[g], rounded = 1e-12 * (size + h->farthest);
        for (int64_t j = 1; j < memory->line.depth[g]; ++j)
            if (fabs(stack[j].slope) > steepest) steepest = fabs(stack[j].slope);
        for (int64_t j = 1; j < memory->line.depth[g]; ++j) {
            double rise = stack[j].anchor - stack[j - 1].anchor,
                   width = stack[j].label - stack[j - 1].label;
            require(fabs(rise - stack[j].slope * width) <=
                        rounded + 1e-14 * steepest * stack[j].label,
                    "anchors are off their slopes");
        }
    }
    hs_state_free(copy);
}

static void one_event(history *h) {
    int kind = below(h->evolves ? 100 : 64);
    if (one_in(8)) choose_drive(h);
    if (kind >= 64) require(hs_state_evolve(h->memory) == HS_OK, "does not evolve");
    if (kind >= 64)
        kind < 96 && !worn_out(h) ? do_walk(h, 1) : do_summits(h);
    else if (kind < 34)
        do_step(h);
    else if (kind < 42)
        do_walk(h, 0);
    else if (kind < 48)
        do_read(h);
    else if (kind < 53)
        do_copy(h);
    else if (kind < 57)
        do_bytes(h);
    else if (kind < 60)
        do_set_friction(h);
    else if (kind < 61)
        do_patches(h);
    else if (kind < 62)
        do_batch();
    else if (kind < 63 && one_in(h->evolves ? 16 : 4))
        do_spiral(h);
    else
        do_step(h);
    require_sound(h);
    /* what one state has other bits in, later ones have, too */
    if (!one_in(4)) return;
    size_t size;
    unsigned char *bytes = bytes_of(h->memory, &size);
    note(bytes, size);
    free(bytes);
}

static void save(const history *h, const char *folder) {
    char name[4096];
    size_t size;
    unsigned char *bytes = bytes_of(h->memory, &size);
    snprintf(name, sizeof name, "%s/%llu.state", folder, (unsigned long long)seed);
    FILE *file = fopen(name, "wb");
    require(file && fwrite(bytes, 1, size, file) == size && fclose(file) == 0, "is not saved");
    free(bytes);
}

int main(int count, char **words) {
    static history h;
    if (count < 4) return 2;
    uint64_t last = strtoull(words[2], NULL, 10), steps = strtoull(words[3], NULL, 10);
    for (seed = strtoull(words[1], NULL, 10); seed < last; ++seed) {
        random_state = seed * 0x2545F4914F6CDD1Du + 1;
        digest = 14695981039346656037u;
        doing = "beginning";
        step = 0;
        begin(&h);
        for (step = 1; step <= steps; ++step) one_event(&h);
        printf("%llu %s %016llx\n", (unsigned long long)seed, h.calls_pow ? "pow" : "exact",
               (unsigned long long)digest);
        if (count > 4) save(&h, words[4]);
        end(&h);
    }
    return 0;
}
