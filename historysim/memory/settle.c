/* Settle: adaptive sub-stepping of a path on which asperities evolve: doubles the chords until state, energy, slid distances and
 * shapes converge (README.md, theory 10). */

#include "settle.h"
#include "adaptive.h"
#include "chord.h"
#include "contact.h"
#include "drive.h"
#include "slides.h"

/* chords at first, of paths on which the approach changes by at most LITTLE of the depth of contact, and of others */
#define FEWEST_CHORDS 1
#define FEW_CHORDS 4
#define LITTLE 0.1
/* chords of a step at most, which bounds the time of a path */
#define MOST_CHORDS (1 << 12)
/* tolerance of a half over that of the whole */
#define PART_OF_HALVES 0.25

static const hs_adaptive chord_settings = {
    0.0, /* the tolerance is set from the drive's */
    0.5, /* agreement by chance is not that much closer than requested */
    FEW_CHORDS, MOST_CHORDS,
    0.4, /* between the factors by which errors of second order fall, 0.25, and of first order, 0.5 */
    1.0, 1e-12, /* well above the rounding of a fraction of the path */
    0.0, 0.5, 0.5,
    2 * MOST_CHORDS, /* one step may have all of its chords */
    16.0, 16.0, /* for errors of second order a quarter of the chords then suffices */
};
/* chords of a whole path on which instants of first sliding are searched, and on which chords that contain one are cut: so many
 * in all, so many times asperities */
#define CHORDS_OF_PATH 32
#define MOST_CHORDS_TIMED 1024
#define MOST_TIMED 200000
/* parts into which a chord that contains instants is cut, beside the cuts next to its estimates of them: at its squared length,
 * with which the errors of most estimates fall, for friction and displacement are linear on a chord */
#define PARTS_OF_CHORD 4
/* shares of the path up to which a chord is not cut any more: between two such cuts, and elsewhere, as where estimates are bad */
#define SHORTEST_ESTIMATED 1e-5
#define SHORTEST_TIMED 1e-7
/* tolerances over that of ramps of both loads: of loads and displacements; and of what is dissipated, slid and worn,
 * and of changes of shape, as a part of itself */
#define COARSER 100.0
#define COARSEST 1000.0
/* slid distance over what the contact is moved, and energy erased over that dissipated */
#define NEGLIGIBLE 1e-3

/* The largest change of a quantity of asperities from a coarser to a finer way, over a part of the largest that the path
 * makes. */
static double part_of_each(const double *start, const double *coarse, const double *fine, int64_t count, double part,
                           double whole, double *made_by_most) {
    double change = 0.0, made = whole, size = 0.0;
    for (int64_t i = 0; i < count; ++i) {
        change = hs_most(change, fabs(fine[i] - coarse[i]));
        made = hs_most(made, fabs(fine[i] - start[i]));
        size = hs_most(size, fabs(fine[i]));
    }
    *made_by_most = made;
    return hs_error(change, 64.0 * DBL_EPSILON * size, part * made);
}

/* Error of a number of chords next to half of it. What changes is measured by the whole path, of which a step may be a part. */
static double error_of_chords(walk *w, const hs_adaptive *settings, const hs_memory *start, const hs_memory *coarse,
                              const hs_memory *fine) {
    double part = COARSER * settings->tolerance, rough = COARSEST * settings->tolerance;
    double top = hs_most(coarse->approach, start->approach) - fine->contact->sorted_gap[0];
    const hs_evolved *from = start->evolved, *one = coarse->evolved, *other = fine->evolved;
    int64_t count = fine->contact->count;
    double sizes[] = {hs_most(hs_friction_range(fine, HUGE_VAL).most, 1e-300) * hs_most(top, 0.0),
                      hs_friction_limit(fine, fine->approach, fine->normal_load), top,
                      /* what is lost is told to a part of itself, or of what is stored */
                      hs_most(fine->dissipated - start->dissipated, hs_elastic_energy(fine, NULL)),
                      fabs(fine->displacement - start->displacement) * fine->contact->units.displacement,
                      fabs(other->erased_energy - from->erased_energy)};
    double *size = w->size;
    for (int k = 0; k < 6; ++k) size[k] = hs_most(sizes[k], w->whole[k]);
    double unit = fine->contact->units.energy, erased = hs_most(size[5], NEGLIGIBLE * size[3] * unit);
    double state[] = {hs_error(fine->displacement - coarse->displacement, 0.0, part * size[0]),
                      hs_error(fine->tangential_load - coarse->tangential_load, 0.0, part * size[1]),
                      hs_error(fine->approach - coarse->approach, 0.0, part * size[2]),
                      hs_error(fine->dissipated - coarse->dissipated, 0.0, rough * size[3]),
                      hs_error(other->erased_energy - one->erased_energy, 0.0, rough * erased)};
    double most = 0.0;
    for (size_t k = 0; k < sizeof state / sizeof *state; ++k) most = hs_most(most, state[k]);
    double slid = part_of_each(from->slid_distance, one->slid_distance, other->slid_distance, count, rough, w->whole[6],
                               size + 6);
    /* of asperities that slide for a moment only, as they leave, nothing is told to a part of itself */
    double share = size[6] > 0.0 && size[6] < NEGLIGIBLE * size[4] ? size[6] / (NEGLIGIBLE * size[4]) : 1.0;
    const double *before[] = {from->worn_volume, from->summit_height, from->summit_radius};
    const double *first[] = {one->worn_volume, one->summit_height, one->summit_radius};
    const double *last[] = {other->worn_volume, other->summit_height, other->summit_radius};
    most = hs_most(most, share * slid);
    for (int k = 0; k < 3 && w->wears; ++k)
        most = hs_most(most, share * part_of_each(before[k], first[k], last[k], count, rough, w->whole[7 + k],
                                                  size + 7 + k));
    return most;
}

/* Extrapolate the energy of the finer way: its error falls with the square of the chords. */
static void extrapolate(walk *w, const hs_memory *start, const hs_memory *coarse, hs_memory *fine) {
    int64_t count = fine->contact->count;
    for (int64_t i = 0; i < count; ++i) w->shape.energy[coarse->contact->order[i]] = coarse->dissipated_each[i];
    for (int64_t i = 0; i < count; ++i) w->before[start->contact->order[i]] = start->dissipated_each[i];
    for (int64_t i = 0; i < count; ++i) {
        int64_t whose = fine->contact->order[i];
        fine->dissipated_each[i] = hs_extrapolate(w->before[whose], w->shape.energy[whose], fine->dissipated_each[i]);
    }
    fine->dissipated = hs_extrapolate(start->dissipated, coarse->dissipated, fine->dissipated);
}

/* The next cut after a share of the path, or the end of what is walked. */
static double next_cut(const walk *w, double share, double end) {
    for (int64_t k = 0; k < w->cuts; ++k)
        if (w->cut[k] > share) return hs_least(w->cut[k], end);
    return end;
}

/* Carry a copy of a memory from one share of the path to another, in so many chords from cut to cut. */
static int in_chords(walk *w, const hs_memory *start, hs_memory *memory, double before, double share, int chords,
                     int64_t *left) {
    if (w->wears || w->yields) hs_contact_assign(memory->contact, start->contact);
    int status = hs_memory_assign(memory, start);
    for (double here = before; here < share && status == HS_OK;) {
        double next = next_cut(w, here, share);
        for (int k = 1; k <= chords && status == HS_OK; ++k, --*left) {
            double begin = k == 1 ? here : here + (next - here) * ((double)(k - 1) / chords);
            status = hs_chord(w, memory, begin, k == chords ? next : here + (next - here) * ((double)k / chords));
            if (status == HS_OK) status = hs_count_work(w->drive, &w->work, 8 + memory->contact->count);
        }
        here = next;
    }
    return status;
}

/* A part of a path that is integrated in chords. */
typedef struct chords_of_path {
    walk *w;
    hs_memory *memory, *coarse, *fine;
    hs_memory *start; /* where a path began that is integrated in halves; NULL until it is */
    hs_adaptive settings;
} chords_of_path;

static int integrate_chords(hs_integrand *integrand, const hs_interval *step, int chords, double *error) {
    chords_of_path *path = (chords_of_path *)integrand->context;
    int first = chords == path->settings.first_chords;
    if (chords > 2 * path->settings.first_chords) hs_memory_swap(path->coarse, path->fine);
    int status = in_chords(path->w, path->memory, first ? path->coarse : path->fine, step->begin, step->end, chords,
                           &integrand->chords_left);
    *error = HUGE_VAL;
    if (!first && status == HS_OK) *error = error_of_chords(path->w, &path->settings, path->memory, path->coarse, path->fine);
    return status;
}

static int accept_chords(hs_integrand *integrand, const hs_interval *step) {
    chords_of_path *path = (chords_of_path *)integrand->context;
    (void)step;
    extrapolate(path->w, path->memory, path->coarse, path->fine);
    hs_memory_swap(path->memory, path->fine);
    return HS_OK;
}

/* Integrate a step in halves whose errors fall slowly, since the cause is so close to one place: to a part of the tolerance,
 * for the errors of halves add up. */
static int halve_chords(hs_integrand *integrand, const hs_interval *step) {
    chords_of_path *path = (chords_of_path *)integrand->context;
    walk *w = path->w;
    (void)step;
    for (int k = 0; k < SIZES; ++k) w->whole[k] = hs_most(w->whole[k], w->size[k]);
    if (path->start) return HS_OK;
    path->settings.tolerance *= PART_OF_HALVES;
    path->settings.first_chords = FEW_CHORDS;
    path->start = hs_copy_to_change(w, path->memory);
    return path->start ? HS_OK : HS_OUT_OF_MEMORY;
}

int hs_settle_in_chords(walk *w, hs_memory *memory, hs_memory *coarse, hs_memory *fine, double before, double share) {
    const route *c = &w->course;
    double touch = memory->contact->sorted_gap[0];
    /* a gap is crossed without load, before the ramp begins */
    if (c->both_loads && c->d[0] < touch) memory->approach = hs_most(memory->approach, hs_least(touch, c->d[1]));
    double top = hs_most(c->d[0], c->d[1]) - touch;
    int little = fabs(c->d[1] - c->d[0]) * (share - before) <= LITTLE * top && !w->evolution->goal;
    if (w->evolution->law.kind != HS_NO_LAW && w->evolution->law.depends_on == HS_ON_SLID_DISTANCE) little = 0;
    int fewest = little ? FEWEST_CHORDS : FEW_CHORDS, pieces = 1;
    for (double cut = next_cut(w, before, share); cut < share; cut = next_cut(w, cut, share)) ++pieces;
    hs_adaptive settings = chord_settings;
    settings.tolerance = w->drive->tolerance;
    settings.first_chords = pieces < fewest ? fewest / pieces : 1;
    for (;;) {
        chords_of_path path = {w, memory, coarse, fine, NULL, settings};
        hs_integrand integrand = {&path, &path.settings, integrate_chords, accept_chords, halve_chords, 0, 0.0};
        memset(w->whole, 0, sizeof w->whole);
        int status = hs_adapt(&integrand, before, share);
        if (status == HS_TOO_MANY_CHORDS) hs_memory_swap(memory, path.start);
        hs_memory_free(path.start);
        if (status != HS_TOO_MANY_CHORDS) return status;
        hs_coarsen(&settings, integrand.reached);
    }
}

/* How many asperities have slid as a whole. */
static int64_t have_slid(const hs_memory *memory) {
    int64_t number = 0;
    for (int64_t i = 0; i < memory->contact->count; ++i) number += hs_has_slid(memory, i);
    return number;
}

static int compare_shares(const void *one, const void *other) {
    double a = *(const double *)one, b = *(const double *)other;
    return (a > b) - (a < b);
}

/* Fill in the shares at which to cut a chord on which asperities first slide, and its end. Returns how many there are. */
static int64_t cuts_around_slides(const walk *w, const hs_memory *start, const hs_memory *memory, double before, double end,
                                  double margin, double *cut) {
    const double *times = w->course.times, apart = 0.25 * SHORTEST_TIMED;
    int64_t count = 0, kept = 0;
    for (int part = 1; part < PARTS_OF_CHORD; ++part) cut[count++] = hs_toward(before, end, (double)part / PARTS_OF_CHORD);
    for (int64_t i = 0; i < memory->contact->count; ++i) {
        if (!hs_has_slid(memory, i) || hs_has_slid(start, i)) continue;
        double instant = (memory->slides->time[i] - times[0]) / (times[1] - times[0]);
        cut[count++] = instant - margin;
        cut[count++] = instant + margin;
    }
    qsort(cut, (size_t)count, sizeof *cut, compare_shares);
    for (int64_t k = 0; k < count; ++k)
        if (cut[k] > (kept ? cut[kept - 1] : before) + apart && cut[k] < end - apart) cut[kept++] = cut[k];
    cut[kept++] = end;
    return kept;
}

/* Carry a memory along the path in chords that end at shares of it. Those on which asperities first slide, and that are longer
 * than the `shortest`, are cut and carried again. */
static int time_slides(walk *w, hs_memory *memory, double before, const double *end, int64_t chords, double shortest, int64_t *left) {
    int status = HS_OK;
    for (int64_t k = 0; k < chords && status == HS_OK; before = end[k++]) {
        double length = end[k] - before;
        hs_memory *start = hs_copy_to_change(w, memory);
        if (!start) return HS_OUT_OF_MEMORY;
        status = hs_chord(w, memory, before, end[k]);
        if (status == HS_OK) status = hs_count_work(w->drive, &w->work, 8 + memory->contact->count);
        int64_t fresh = status == HS_OK ? have_slid(memory) - have_slid(start) : 0;
        if (fresh > 0 && *left > 0 && length > shortest) {
            double margin = hs_most(length * length, 0.25 * SHORTEST_TIMED), apart = 2.0 * margin + HS_TIE;
            double *cut = (double *)malloc((size_t)(2 * fresh + PARTS_OF_CHORD) * sizeof *cut);
            if (!cut) status = HS_OUT_OF_MEMORY;
            int64_t cuts = cut ? cuts_around_slides(w, start, memory, before, end[k], margin, cut) : 0;
            *left -= cuts;
            if (cut) status = time_slides(w, start, before, cut, cuts, apart <= SHORTEST_ESTIMATED ? apart : SHORTEST_TIMED, left);
            free(cut);
            hs_memory_swap(memory, start);
        }
        hs_memory_free(start);
    }
    return status;
}

/* Record the instants at which asperities first slide on a part of the path. */
static int time_part(walk *w, hs_memory *memory, double before, double share) {
    const int64_t count = memory->contact->count;
    int64_t left = MOST_TIMED / count < MOST_CHORDS_TIMED ? MOST_TIMED / count : MOST_CHORDS_TIMED;
    const int chords = (int)(CHORDS_OF_PATH * (share - before)) + 1;
    double end[CHORDS_OF_PATH + 1];
    int status = HS_OK;
    for (double here = before; here < share && status == HS_OK;) {
        double next = next_cut(w, here, share);
        for (int k = 1; k <= chords; ++k) end[k - 1] = k == chords ? next : here + (next - here) * ((double)k / chords);
        status = time_slides(w, memory, here, end, chords, SHORTEST_TIMED, &left);
        here = next;
    }
    return status;
}

/* Whether asperities first slide when they would without wear: those that have not slid have kept their shape, and where both
 * displacements are prescribed they depend on no other. */
static int slides_as_unworn(const walk *w) {
    const route *c = &w->course;
    const hs_law *law = &w->evolution->law;
    if (w->yields || w->evolution->goal || (law->kind != HS_NO_LAW && law->depends_on != HS_ON_NOTHING)) return 0;
    return !c->normal_by_load && (c->straight || !(c->tangential_by_load || w->compliance > 0.0));
}

/* Have a memory know when asperities first slide on a straight path to the displacements of another one, were there no wear. */
static int time_unworn(const walk *w, hs_memory *known, const hs_memory *memory, double share) {
    double load = hs_load_at(hs_all_of(known->contact), memory->approach).load;
    hs_tick(known, hs_toward(w->course.times[0], w->course.times[1], share));
    return hs_move(known, memory->approach, load, hs_to_displacement(memory->displacement));
}

int hs_settle_timed(walk *w, hs_memory *memory, double before, double share) {
    int64_t slid = have_slid(memory), count = memory->contact->count;
    int timed = hs_is_timed(memory) && slid < count;
    hs_memory *start = timed ? hs_copy_to_change(w, memory) : NULL, *known = NULL;
    if (timed && !start) return HS_OUT_OF_MEMORY;
    int status = hs_settle_in_chords(w, memory, w->spare[0], w->spare[1], before, share);
    if (status == HS_OK && start && have_slid(memory) > slid) {
        known = hs_copy_to_change(w, start);
        if (!known)
            status = HS_OUT_OF_MEMORY;
        else if (slides_as_unworn(w))
            status = time_unworn(w, known, memory, share);
        else
            status = time_part(w, known, before, share);
        if (status == HS_OK) status = hs_slides_replace(memory, start, known);
    }
    hs_memory_free(known);
    hs_memory_free(start);
    return status;
}
