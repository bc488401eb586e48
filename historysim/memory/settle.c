/* Settle: adaptive sub-stepping of a path on which asperities evolve: doubles the chords until state, energy, slid distances and
 * shapes converge (README.md, theory 10). */

#include "settle.h"
#include "chord.h"
#include "contact.h"
#include "drive.h"
#include "slides.h"

/* to begin with, of paths on which the approach changes little, and of others */
#define FEWEST_CHORDS 1
#define FEW_CHORDS 4
#define LITTLE 0.1
#define MOST_CHORDS (1 << 12)
/* walks whose errors fall slower than by this settle slowly; the shortest part of a path that is halved for it */
#define SLOW 0.4
#define PART_OF_HALVES 0.25
#define SHORTEST 1e-12
/* factor by which tolerances are made coarser where a path in halves takes more chords than it may; a status that says so */
#define COARSER_HALVES 16.0
#define TOO_MANY_CHORDS (-1)
/* chords of a whole path in which the instants are found at which asperities first slide */
#define CHORDS_OF_PATH 32
/* how those on which they do are cut: into so many, up to so short ones, so many in all, and so many times asperities */
#define CUTS_OF_CHORD 8
#define SHORTEST_TIMED 1e-7
#define MOST_CHORDS_TIMED 1024
#define MOST_TIMED 200000
/* tolerances over that of ramps of both loads: of loads and displacements; and of what is dissipated, slid and worn,
 * and of changes of shape, as a part of itself */
#define COARSER 100.0
#define COARSEST 1000.0
/* slid distance over what the contact is moved, and energy erased over that dissipated */
#define NEGLIGIBLE 1e-3
/* agreement by chance is not that much closer than asked for */
#define CLOSE 0.5

/* A change over what is tolerated, rounding left out. */
static double part_of(double change, double rounding, double tolerated) {
    change = fabs(change) - rounding;
    return change <= 0.0 ? 0.0 : change / tolerated;
}

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
    return part_of(change, 64.0 * DBL_EPSILON * size, part * made);
}

/* How far a way in chords is from being settled: 1 where it just is. What changes is measured by the whole path, of
 * which this may be a part. */
static double distance_to_settled(walk *w, const hs_memory *start, const hs_memory *coarse, const hs_memory *fine) {
    double part = COARSER * w->drive->tolerance, rough = COARSEST * w->drive->tolerance;
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
    double state[] = {part_of(fine->displacement - coarse->displacement, 0.0, part * size[0]),
                      part_of(fine->tangential_load - coarse->tangential_load, 0.0, part * size[1]),
                      part_of(fine->approach - coarse->approach, 0.0, part * size[2]),
                      part_of(fine->dissipated - coarse->dissipated, 0.0, rough * size[3]),
                      part_of(other->erased_energy - one->erased_energy, 0.0, rough * erased)};
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
        fine->dissipated_each[i] = hs_most(fine->dissipated_each[i] + (fine->dissipated_each[i] - w->shape.energy[whose]) / 3.0, w->before[whose]);
    }
    fine->dissipated = hs_most(fine->dissipated + (fine->dissipated - coarse->dissipated) / 3.0, start->dissipated);
}

/* The next cut after a share of the path, or the end of what is walked. */
static double next_cut(const walk *w, double share, double end) {
    for (int64_t k = 0; k < w->cuts; ++k)
        if (w->cut[k] > share) return hs_least(w->cut[k], end);
    return end;
}

/* Carry a copy of a memory from one share of the path to another, in so many chords from cut to cut. */
static int in_chords(walk *w, const hs_memory *start, hs_memory *memory, double before, double share, int chords) {
    if (w->wears || w->yields) hs_contact_assign(memory->contact, start->contact);
    int status = hs_memory_assign(memory, start);
    for (double here = before; here < share && status == HS_OK;) {
        double next = next_cut(w, here, share);
        for (int k = 1; k <= chords && status == HS_OK; ++k, --w->left) {
            double begin = k == 1 ? here : here + (next - here) * ((double)(k - 1) / chords);
            status = hs_chord(w, memory, begin, k == chords ? next : here + (next - here) * ((double)k / chords));
            if (status == HS_OK) status = hs_count_work(w->drive, &w->work, 8 + memory->contact->count);
        }
        here = next;
    }
    return status;
}

static int settle_from(walk *w, hs_memory *memory, hs_memory *coarse, hs_memory *fine, double before, double share,
                       int fewest);

/* The same where walks settle slowly, as what happens does so close to one place: each half by itself, to a part
 * of what is tolerated, for their errors add up. */
static int settle_halves(walk *w, hs_memory *memory, hs_memory *coarse, hs_memory *fine, double before, double share) {
    double middle = 0.5 * (before + share), tolerated = w->tolerated;
    int whole = !w->whole_start;
    if (whole && !(w->whole_start = hs_copy_to_change(w, memory))) return HS_OUT_OF_MEMORY;
    w->tolerated = PART_OF_HALVES;
    for (int k = 0; k < SIZES; ++k) w->whole[k] = hs_most(w->whole[k], w->size[k]);
    int status = settle_from(w, memory, coarse, fine, before, middle, FEW_CHORDS);
    if (status == HS_OK) status = settle_from(w, memory, coarse, fine, middle, share, FEW_CHORDS);
    w->tolerated = tolerated;
    if (whole) {
        if (status == TOO_MANY_CHORDS) hs_memory_swap(memory, w->whole_start);
        hs_memory_free(w->whole_start);
        w->whole_start = NULL;
    }
    return status;
}

/* Carry the first of three memories from one share of the path to another, in so many chords from cut to cut or more. */
static int settle_from(walk *w, hs_memory *memory, hs_memory *coarse, hs_memory *fine, double before, double share,
                       int fewest) {
    double last = HUGE_VAL;
    int status = in_chords(w, memory, coarse, before, share, fewest);
    for (int chords = 2 * fewest; status == HS_OK; chords *= 2) {
        status = in_chords(w, memory, fine, before, share, chords);
        if (status != HS_OK) break;
        double now = distance_to_settled(w, memory, coarse, fine) / (w->tolerated * w->coarser);
        if (w->left <= 0 && w->whole_start && now > 1.0) return TOO_MANY_CHORDS;
        if (now <= CLOSE || (now <= 1.0 && last <= 1.0) || w->left <= 0 || chords >= MOST_CHORDS) break;
        if (now > SLOW * last && share - before > SHORTEST)
            return settle_halves(w, memory, coarse, fine, before, share);
        last = now;
        hs_memory_swap(coarse, fine);
    }
    if (status != HS_OK) return status;
    extrapolate(w, memory, coarse, fine);
    hs_memory_swap(memory, fine);
    return HS_OK;
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
    int status = TOO_MANY_CHORDS;
    for (w->coarser = 1.0; status == TOO_MANY_CHORDS; w->coarser *= COARSER_HALVES) {
        w->left = 2 * MOST_CHORDS;
        w->tolerated = 1.0;
        memset(w->whole, 0, sizeof w->whole);
        status = settle_from(w, memory, coarse, fine, before, share, pieces < fewest ? fewest / pieces : 1);
    }
    return status;
}

/* How many asperities have slid as a whole. */
static int64_t have_slid(const hs_memory *memory) {
    int64_t number = 0;
    for (int64_t i = 0; i < memory->contact->count; ++i) number += hs_has_slid(memory, i);
    return number;
}

/* Carry a memory from one share of the path to another in chords, of which those are cut once more on which asperities first slide:
 * within one, nothing is known of how its end is reached. */
static int time_slides(walk *w, hs_memory *memory, double before, double share, int chords, int64_t *left) {
    int status = HS_OK;
    for (double here = before; here < share && status == HS_OK;) {
        double piece = here, next = next_cut(w, here, share);
        for (int k = 1; k <= chords && status == HS_OK; ++k) {
            double end = k == chords ? next : piece + (next - piece) * ((double)k / chords);
            hs_memory *start = hs_copy_to_change(w, memory);
            if (!start) return HS_OUT_OF_MEMORY;
            status = hs_chord(w, memory, here, end);
            if (status == HS_OK) status = hs_count_work(w->drive, &w->work, 8 + memory->contact->count);
            if (status == HS_OK && have_slid(memory) > have_slid(start) && *left > 0 && end - here > SHORTEST_TIMED) {
                *left -= CUTS_OF_CHORD;
                status = time_slides(w, start, here, end, CUTS_OF_CHORD, left);
                hs_memory_swap(memory, start);
            }
            hs_memory_free(start);
            here = end;
        }
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
    int timed = hs_is_timed(memory) && slid < count, chords = (int)(CHORDS_OF_PATH * (share - before)) + 1;
    hs_memory *start = timed ? hs_copy_to_change(w, memory) : NULL, *known = NULL;
    if (timed && !start) return HS_OUT_OF_MEMORY;
    int status = hs_settle_in_chords(w, memory, w->spare[0], w->spare[1], before, share);
    if (status == HS_OK && start && have_slid(memory) > slid) {
        int64_t left = MOST_TIMED / count < MOST_CHORDS_TIMED ? MOST_TIMED / count : MOST_CHORDS_TIMED;
        known = hs_copy_to_change(w, start);
        if (!known)
            status = HS_OUT_OF_MEMORY;
        else if (slides_as_unworn(w))
            status = time_unworn(w, known, memory, share);
        else
            status = time_slides(w, known, before, share, chords, &left);
        if (status == HS_OK) status = hs_slides_replace(memory, start, known);
    }
    hs_memory_free(known);
    hs_memory_free(start);
    return status;
}
