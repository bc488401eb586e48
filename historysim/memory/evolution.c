/* Evolution: paths on which asperities change: their friction with load or slid distance, their
 * summits by wear and yielding (README.md, theory 10 and a further law).
 *
 * Evolution is integrated in chords: on each, approach, displacement, friction and shapes vary
 * linearly up to their values at its end, which is one exact update of each polyline. Chords are
 * doubled until state, energy, distances and shapes converge (settle.c). A path on which nothing
 * evolves is integrated exactly, without chords.
 *
 * Paths are those of all contacts: straight in both loads where both are controlled, otherwise in
 * approach and displacement. Where a load or a drive is controlled, the displacement at the end is
 * found by a search over whole paths; the last chord meets the request, so that the path is
 * straight within the tolerance. A request beyond the friction limit is followed in pieces as in
 * limit.c. Of two loads each chord is cut where it crosses the limit, which depends on what
 * evolves.
 *
 * Each chord is of second order in its length:
 *  - The distance that an asperity slides follows from the point of the straight path at which the
 * last of its springs begins to slip.
 *  - The volume that it loses from there on is proportional to its load. The shape that follows
 * gives a better end of the chord, which gives a better volume: twice. The chord is integrated with
 * the mean of both shapes, and ends with the last.
 *  - Where friction depends on the own load, an asperity that touches or leaves, or whose approach
 * changes much, has stations in the chord, graded towards touch: μ goes with 1/N there, or
 * N^(-1/3).
 *
 * A summit that yields while tractions stand in it, of radius R before a chord and R' at its end,
 * keeps them at their radii √(R b): its springs get the labels b R/R' under the new summit, and
 * keep their deflections, and so the loads and the energy that they hold. With R'/R steeper, μ R'/R
 * is their cone at the start of the chord, and μ at its end: from there on a summit that yields is
 * one whose friction falls. The limit of no spring falls meanwhile, since the approach grows. Where
 * nothing is strained and the contact is not moved, a path is one chord. */

#include "chord.h"
#include "contact.h"
#include "drive.h"
#include "laws.h"
#include "line.h"
#include "readout.h"
#include "settle.h"
#include "shape.h"
#include "integrate.h"

#define AS_ONE 1e-9
/* cuts of paths next to first touch where friction depends on the total load, and approach of one
 * over the next */
#define CLOSE_TO_TOUCH 3
#define CLOSER 4.0
/* chords in which crossings of the friction limit are found that divide a path, and those that are
 * found anew on each chord */
#define CHORDS_TO_CROSS 64
#define CHORDS_TO_CUT 16
/* displacement by which an aim may be missed, over the tolerance of ramps and the displacement at
 * which all slides; searches for it; and the least rate by which misses fall that is used to find
 * it */
#define AIM 10.0
#define MOST_AIMS 12
#define LEAST_RATE 0.05

/* Buffers for memories of so many asperities and groups, which are more where asperities yield. */
static int make_buffers(walk *w, const hs_contact *contact) {
    size_t n = (size_t)contact->count, g = (size_t)(w->yields ? contact->count : contact->groups);
    double **each[] = {&w->goal[0],
                       &w->goal[1],
                       &w->slid,
                       &w->ahead,
                       &w->shape.first,
                       &w->shape.last,
                       &w->shape.mean_load,
                       &w->shape.energy,
                       &w->shape.lost,
                       &w->shape.taken,
                       &w->gap,
                       &w->before,
                       &w->shape.mid_height,
                       &w->shape.mid_radius,
                       &w->shape.end_height,
                       &w->shape.end_radius,
                       &w->discarded,
                       &w->shape.begun,
                       &w->yield.from,
                       &w->yield.steeper,
                       (double **)&w->depth,
                       (double **)&w->yield.place,
                       &w->slides_from,
                       &w->slides_to};
    size_t arrays = sizeof each / sizeof *each;
    double *numbers = (double *)malloc((arrays * n + 5 * g + 1) * sizeof *numbers + n);
    w->memory = numbers;
    if (!numbers) return HS_OUT_OF_MEMORY;
    for (size_t k = 0; k < arrays; ++k, numbers += n) *each[k] = numbers;
    w->load = numbers;
    w->friction = w->load + g;
    w->edge = w->friction + g;
    w->first_station = (int64_t *)(w->edge + g);
    w->steep = (uint8_t *)(w->first_station + g + 1);
    w->yield.changed = w->steep + g * sizeof(double);
    return HS_OK;
}

static void free_buffers(walk *w) {
    free(w->memory);
    free(w->stations);
    free(w->scratch);
    free(w->kept);
}

/* Where the cut belongs that is made at an approach: its share of the path. */
static int share_at(const walk *w, const hs_line *memory, double d, double *share) {
    const route *c = &w->course;
    double load = 0.0;
    int status = HS_OK;
    *share = (d - c->d[0]) / (c->d[1] - c->d[0]);
    if (!c->both_loads || c->load[0] == c->load[1]) return HS_OK;
    if (w->yields)
        status = hs_yielding_load(memory, w->evolution, d, &load);
    else
        load = hs_load_at(hs_all_of(memory->contact), d).load;
    *share = (load - c->load[0]) / (c->load[1] - c->load[0]);
    return status;
}

/* Cut a path where summits first touch, leave or begin to yield, what is before the first of them
 * yields left out; where these are many, where as many of them lie between one cut and the next;
 * and close to the first touch. */
static int cut_path(walk *w, const hs_line *memory, int touches, int graded) {
    const route *c = &w->course;
    const hs_contact *contact = memory->contact;
    int rises = c->d[1] > c->d[0];
    int64_t count = 0, apart = 0, each = contact->count, sets = w->yield.onset < 1.0 ? 2 : touches;
    int64_t events = sets * each + (graded ? CLOSE_TO_TOUCH : 0);
    double *at = (double *)malloc((size_t)events * 2 * sizeof *at);
    double low = hs_min(c->d[0], c->d[1]), high = hs_max(c->d[0], c->d[1]);
    int64_t *place = (int64_t *)(at + events);
    if (!at) return HS_OUT_OF_MEMORY;
    if (w->yield.onset < 1.0) low = hs_max(low, w->yield.next);
    double least = AS_ONE * (high - low), closer = high - contact->gap[0];
    for (int64_t k = 0; k < events; ++k) {
        double d = k >= sets * each ? contact->gap[0] + (closer /= CLOSER)
                   : k < each       ? contact->gap[k]
                                    : hs_yields_at(memory, &w->evolution->yielding, k - each);
        if (!(d > low + least && d < high - least)) continue;
        place[count] = count;
        at[count++] = d;
    }
    int status = hs_sort_by(at, place, count);
    for (int64_t k = 0; k < count; ++k)
        if (apart == 0 || at[place[k]] - at[place[apart - 1]] > least) place[apart++] = place[k];
    int64_t stride = (apart + MOST_CUTS - 1) / MOST_CUTS;
    for (int64_t k = 0; k < apart && status == HS_OK; k += stride)
        status = share_at(w, memory, at[place[rises ? k : apart - 1 - k]], w->cut + w->cuts++);
    free(at);
    return status;
}

/* Put down where a path goes from where the memory is. */
static int begin_course(walk *w, const hs_line *memory, const hs_path *path) {
    const hs_evolution *evolution = w->evolution;
    const hs_contact *contact = memory->contact;
    route *c = &w->course;
    hs_target target;
    double request = memory->tangential_load + (w->drive->saturate ? memory->excess : 0.0);
    hs_path_targets(memory, path, w->compliance, request, &c->d[1], &c->load[1], &target);
    c->times[0] = path->begin;
    c->times[1] = path->end;
    c->d[0] = memory->approach;
    c->load[0] = memory->normal_load;
    c->normal_by_load = path->normal_control == HS_LOAD;
    c->tangential_by_load = path->tangential_control[0] == HS_LOAD;
    c->both_loads = c->normal_by_load && c->tangential_by_load;
    c->tangential[0] = c->tangential_by_load
                           ? request
                           : memory->displacement + w->compliance * memory->tangential_load;
    c->tangential[1] = target.value;
    c->ends_separated = c->tangential_by_load && !c->both_loads && target.value == 0.0 &&
                        c->d[1] <= contact->sorted_gap[0];
    c->straight = c->ends_at_limit = 0;
    c->apart[0] = memory->displacement;
    c->apart[1] = memory->depth[0] > 0 ? memory->vertices[0].anchor : memory->displacement;
    c->first = NULL;
    w->yield.onset = HUGE_VAL;
    w->cuts = 0;
    if (w->yields) {
        if (isnan(w->yield.next)) w->yield.next = hs_next_yield(memory, &evolution->yielding);
        /* what is elastic now is so up to where it is */
        double next = hs_max(w->yield.next, memory->approach);
        if (c->d[1] > next + HS_TIE * fabs(next)) {
            int status = HS_OK;
            if (c->normal_by_load)
                status = hs_yielding_approach(memory, evolution, c->load[1], &c->d[1]);
            if (status != HS_OK) return status;
            w->yield.onset = (next - c->d[0]) / (c->d[1] - c->d[0]);
            if (c->both_loads)
                w->yield.onset = (hs_load_at(hs_all_of(contact), next).load - c->load[0]) /
                                 (c->load[1] - c->load[0]);
            w->yield.onset = hs_min(hs_max(w->yield.onset, 0.0), 1.0);
        }
    }
    if (w->wears && c->normal_by_load && !c->both_loads && !(c->first = hs_contact_copy(contact)))
        return HS_OUT_OF_MEMORY;
    for (int64_t g = 0; g < contact->groups && evolution->goal; ++g)
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i) {
            int64_t whose = contact->order[i];
            w->goal[0][whose] = memory->friction[g];
            w->goal[1][whose] =
                hs_toward(memory->friction[g], hs_bound_friction(evolution->goal[whose]),
                          evolution->goal_fraction);
        }
    return HS_OK;
}

/* Whether neither friction nor geometry evolves on a path. */
static int is_still(const walk *w, const hs_line *memory) {
    const hs_law *law = &w->evolution->law;
    int64_t count = memory->contact->count;
    if (w->wears) return 0;
    if (w->evolution->goal)
        return memcmp(w->goal[0], w->goal[1], (size_t)count * sizeof(double)) == 0;
    if (law->kind == HS_NO_LAW || law->depends_on == HS_ON_NOTHING) return 1;
    if (!memchr(memory->evolved->friction_overridden, 0, (size_t)count)) return 1;
    return law->depends_on != HS_ON_SLID_DISTANCE && w->course.d[0] == w->course.d[1];
}

/* Integrate a path on which nothing evolves, exactly. Slid distances are those of its straight
 * pieces, or, where both loads change, followed in chords. */
static int walk_still(walk *w, hs_line *memory, const hs_plan *plan, double before, double share) {
    const route *c = &w->course;
    hs_line *start = w->spare[0];
    int bent = c->both_loads && c->load[0] != c->load[1], status = HS_OK;
    for (int k = 0; before < share && status == HS_OK; ++k) {
        double stop = !bent && k < plan->pieces.count ? hs_min(plan->pieces.end[k], share) : share;
        if (stop <= before) continue;
        if (w->yields) hs_contact_assign(start->contact, memory->contact);
        status = hs_line_assign(start, memory);
        if (status == HS_OK && bent) {
            hs_line *fine = hs_copy_to_change(w, memory);
            status = fine ? hs_settle_in_chords(w, start, w->spare[1], fine, before, stop)
                          : (int)HS_OUT_OF_MEMORY;
            hs_line_free(fine);
        }
        if (status == HS_OK) status = hs_follow_plan(memory, plan, before, stop, w->drive);
        if (status != HS_OK) return status;
        if (bent) {
            memcpy(memory->evolved->slid_distance, start->evolved->slid_distance,
                   (size_t)memory->contact->count * sizeof(double));
            memory->evolved->slid_together = start->evolved->slid_together;
        } else {
            chord_end end = {memory->approach,
                             memory->normal_load,
                             memory->displacement,
                             NAN,
                             NAN,
                             NAN,
                             0.0,
                             memory->contact->groups};
            memcpy(w->friction, memory->friction, (size_t)memory->contact->groups * sizeof(double));
            hs_store_gaps(w, memory->contact);
            status = hs_solve_slid_distances(w, start, &end, 0);
            w->together = hs_slid_together(w, start, &end);
            hs_add_slides(w, memory);
        }
        before = stop;
    }
    return status;
}

/* Have asperities stand alone whose friction or shape comes to differ from that of others. */
static int part_as_they_evolve(hs_line *memory, const hs_evolution *evolution) {
    const hs_law *law = &evolution->law;
    size_t count = (size_t)memory->contact->count;
    int depends = law->kind != HS_NO_LAW && law->depends_on != HS_ON_NOTHING, status = HS_OK;
    if (evolution->wear.kind != HS_NO_WEAR || (depends && law->depends_on != HS_ON_TOTAL_LOAD))
        status =
            hs_split_groups(memory, memory->evolved->summit_height, memory->evolved->summit_radius);
    if (status == HS_OK && depends && memchr(memory->evolved->friction_overridden, 1, count)) {
        double *given = (double *)malloc(count * sizeof *given);
        if (!given) return HS_OUT_OF_MEMORY;
        for (size_t i = 0; i < count; ++i) given[i] = memory->evolved->friction_overridden[i];
        status = hs_split_groups(memory, given, given);
        free(given);
    }
    if (status == HS_OK && evolution->goal) {
        status = hs_split_groups(memory, evolution->goal, evolution->goal);
        memset(memory->evolved->friction_overridden, 1, count);
    }
    return status;
}

/* Have copies of a memory to walk on, of the same groups. */
static int make_spares(walk *w, const hs_line *memory) {
    for (int k = 0; k < 2; ++k) {
        if (w->spare[k] && w->spare[k]->contact->groups == memory->contact->groups) continue;
        hs_line_free(w->spare[k]);
        w->spare[k] = hs_copy_to_change(w, memory);
        if (!w->spare[k]) return HS_OUT_OF_MEMORY;
    }
    return HS_OK;
}

/* Have summits yield where nothing is strained, to a share of the path. */
static int yield_at_rest(walk *w, hs_line *memory, double share) {
    double d, load;
    int status = hs_yielding_end(w, memory, share, &d, &load);
    if (status == HS_OK) status = hs_yield_to(memory, w->evolution, d, w->yield.changed);
    if (status != HS_OK) return status;
    const hs_contact *contact = memory->contact;
    double *gap = w->shape.first, *weight = w->shape.last, unit = contact->units.length;
    for (int64_t k = 0; k < contact->count; ++k) {
        int64_t i = contact->order[k];
        gap[i] = w->yield.changed[i] ? (contact->datum - memory->evolved->summit_height[i]) / unit
                                     : contact->gap[k];
        weight[i] = w->yield.changed[i] ? sqrt(memory->evolved->summit_radius[i] / unit)
                                        : contact->weight[k];
    }
    hs_tick(memory, hs_toward(w->course.times[0], w->course.times[1], share));
    status = hs_join_groups(memory, gap, weight, d, 1);
    if (status == HS_OK && !isnan(load)) memory->normal_load = load;
    return status;
}

/* Have those stand alone that yield on the path, and all be ready to follow them in chords. */
static int prepare_to_yield(walk *w, hs_line *memory) {
    const hs_evolved *evolved = memory->evolved;
    int status = hs_flag_yielding(memory, w->evolution, w->course.d[1], w->yield.changed);
    for (int pass = 0; pass < 2 && status == HS_OK; ++pass) {
        evolved = memory->evolved;
        const double *height = pass ? evolved->summit_height : evolved->virgin_height;
        const double *radius = pass ? evolved->summit_radius : evolved->virgin_radius;
        for (int64_t i = 0; i < memory->contact->count; ++i) {
            w->shape.first[i] = w->yield.changed[i] ? height[i] : HUGE_VAL;
            w->shape.last[i] = w->yield.changed[i] ? radius[i] : 0.0;
        }
        status = hs_split_groups(memory, w->shape.first, w->shape.last);
    }
    if (status == HS_OK) status = hs_line_unshare_contact(memory);
    w->parted = 1;
    return status == HS_OK ? make_spares(w, memory) : status;
}

/* The part of a path before its first summit yields. */
static hs_path path_to_onset(const walk *w, const hs_path *path) {
    const route *c = &w->course;
    hs_path leg = *path;
    if (c->both_loads) {
        leg.normal_target = hs_toward(c->load[0], c->load[1], w->yield.onset);
    } else {
        leg.normal_control = HS_DISPLACED;
        leg.normal_target = hs_toward(c->d[0], c->d[1], w->yield.onset);
    }
    leg.tangential_target[0] = hs_toward(c->tangential[0], c->tangential[1], w->yield.onset);
    leg.normal_fraction = leg.tangential_fraction[0] = 1.0;
    leg.end = hs_toward(leg.begin, leg.end, w->yield.onset);
    return leg;
}

/* Whether nothing is strained, nor will be on a path. */
static int is_at_rest(const walk *w, const hs_line *memory) {
    return w->course.tangential[0] == w->course.tangential[1] && hs_unstrained(memory);
}

/* One path as it is integrated. `aims`: a load or a drive is controlled while the approach is
 * straight, so displacements go straight to where that leads; `pieces` are those between which the
 * request crosses the friction limit. */
typedef struct leg {
    hs_plan plan;   /* where nothing evolves */
    double elastic; /* share of the path at which summits begin to yield, or 1 */
    int still, aims;
    hs_pieces pieces;
} leg;

/* Integrate the elastic part of a path on which summits yield later, straight to the displacement
 * aimed at. */
static int walk_elastic(walk *w, hs_line *memory, double before, double share) {
    const route *c = &w->course;
    hs_plan plan;
    double reached =
        hs_toward(c->aim[0], c->aim[1], (share - c->piece[0]) / (c->piece[1] - c->piece[0]));
    hs_path path = {hs_toward(c->d[0], c->d[1], share),
                    1.0,
                    {reached, 0.0},
                    {1.0, 0.0},
                    1,
                    0,
                    HS_DISPLACED,
                    {HS_DISPLACED, HS_HELD},
                    0,
                    hs_toward(c->times[0], c->times[1], before),
                    hs_toward(c->times[0], c->times[1], share)};
    int status = hs_plan_path(memory, &path, 0.0, 0, 1, &plan, w->refusal);
    if (status != HS_OK) return status;
    return w->alone ? hs_follow_plan(memory, &plan, 0.0, 1.0, w->drive)
                    : walk_still(w, memory, &plan, 0.0, 1.0);
}

/* Integrate a part of a path within one piece of its request. */
static int walk_part(walk *w, hs_line *memory, const leg *on, double before, double share) {
    const route *c = &w->course;
    double end = hs_min(share, on->elastic);
    int status = HS_OK;
    if (on->aims) status = make_spares(w, memory);
    if (before < end && status == HS_OK) {
        if (!on->still || (on->aims && !(c->straight && end < c->piece[1])))
            status = hs_settle_timed(w, memory, before, end);
        else if (on->aims)
            status = walk_elastic(w, memory, before, end);
        else if (w->alone)
            status = hs_follow_plan(memory, &on->plan, before / on->elastic, end / on->elastic,
                                    w->drive);
        else
            status = walk_still(w, memory, &on->plan, before / on->elastic, end / on->elastic);
        before = end;
    }
    if (status != HS_OK || share <= on->elastic) return status;
    if (before == on->elastic) {
        /* summits yield to the end of the path at once where nothing is strained, nor will be */
        w->yield.at_rest = w->alone && is_at_rest(w, memory);
        if (!w->yield.at_rest) status = prepare_to_yield(w, memory);
    }
    if (status != HS_OK) return status;
    return w->yield.at_rest ? yield_at_rest(w, memory, share)
                            : hs_settle_timed(w, memory, before, share);
}

/* Displacement at the end of the present piece of a path, were it one chord; where summits yield,
 * were it elastic. */
static int guess_displacement(walk *w, const hs_line *memory, hs_line *tried, double *found) {
    const route *c = &w->course;
    double end = c->piece[1], d = hs_toward(c->d[0], c->d[1], end);
    if (!(w->yield.onset < end)) {
        int status = hs_chord(w, tried, c->piece[0], end);
        *found = tried->displacement;
        return status;
    }
    hs_target target = {hs_toward(c->tangential[0], c->tangential[1], end), 1.0, w->compliance};
    if (c->tangential_by_load) target = hs_to_load(target.value);
    return hs_solve_displacement((hs_line *)memory, d,
                                 hs_load_at(hs_all_of(memory->contact), d).load, target, found);
}

/* Find the displacement to which the present piece of a path is straight: where its last chord
 * meets the request. `reached` is the memory there. */
static int aim(walk *w, const hs_line *memory, const leg *on, hs_line **reached) {
    route *c = &w->course;
    double touch = memory->contact->sorted_gap[0], aimed = NAN, missed = NAN;
    hs_line *tried = NULL;
    c->straight = 1;
    c->aim[0] = memory->displacement;
    for (int turn = 0;; ++turn) {
        hs_line_free(tried);
        tried = hs_copy_to_change(w, memory);
        if (!tried) return HS_OUT_OF_MEMORY;
        hs_set_clock(tried, NAN);
        int status = turn ? walk_part(w, tried, on, c->piece[0], c->piece[1])
                          : guess_displacement(w, memory, tried, c->aim + 1);
        if (status != HS_OK) {
            hs_line_free(tried);
            return status;
        }
        if (turn == 0) continue;
        double gap = tried->displacement - c->aim[1], rate = (gap - missed) / (c->aim[1] - aimed);
        double top = hs_max(hs_max(memory->approach, tried->approach) - touch, 0.0);
        double tolerated = AIM * w->drive->tolerance * hs_friction_range(tried, HUGE_VAL).max * top;
        if (fabs(gap) <= tolerated || turn == MOST_AIMS) break;
        aimed = c->aim[1];
        missed = gap;
        c->aim[1] += rate < -LEAST_RATE && rate > -1.0 / LEAST_RATE ? -gap / rate : gap;
    }
    *reached = tried;
    return HS_OK;
}

/* Find where a request that is straight on a path crosses the friction limit, in so many chords;
 * refuse it where it may not. */
static int find_crossings(walk *w, const hs_line *memory, leg *on, int chords, int saturate) {
    const route *c = &w->course;
    hs_line *tried = hs_copy_to_change(w, memory);
    int status = tried ? HS_OK : HS_OUT_OF_MEMORY;
    double before = 0.0, excess = 0.0;
    on->pieces.count = 1;
    on->pieces.end[0] = 1.0;
    on->pieces.side[0] = 0;
    w->crossings = &on->pieces;
    w->course.straight = 0;
    for (int k = 1; before < 1.0 && status == HS_OK;) {
        double share = (double)k / chords;
        if (before == on->elastic) status = prepare_to_yield(w, tried);
        if (before < on->elastic && on->elastic < share)
            share = on->elastic;
        else
            ++k;
        if (status == HS_OK) status = hs_chord(w, tried, before, share);
        if (status == HS_OK) status = hs_count_work(w->drive, &w->work, 8 + memory->contact->count);
        if (status == HS_OK && !saturate && fabs(tried->excess) > excess) {
            excess = fabs(tried->excess);
            w->refusal->request =
                hs_toward(c->tangential[0], c->tangential[1], share) * memory->contact->units.load;
            w->refusal->limit = fabs(tried->tangential_load) * memory->contact->units.load;
        }
        before = share;
    }
    w->crossings = NULL;
    hs_line_free(tried);
    return status == HS_OK && excess > 0.0 ? (int)HS_BEYOND_LIMIT : status;
}

/* Find the pieces of a path whose tangential load is controlled while its approach is straight. A
 * request that is within the friction limit at both ends is one piece: no load is prescribed in
 * between. */
static int find_pieces(walk *w, const hs_line *memory, leg *on) {
    route *c = &w->course;
    const hs_drive *drive = w->drive;
    hs_drive held = *drive;
    const double slack = 1.0 + HS_LIMIT_SLACK;
    int status = HS_OK;
    on->pieces.count = 1;
    on->pieces.end[0] = 1.0;
    on->pieces.side[0] = 0;
    if (!c->tangential_by_load) return HS_OK;
    held.saturate = 1;
    w->drive = &held;
    int crosses = fabs(c->tangential[0]) >
                  slack * hs_friction_limit(memory, memory->approach, memory->normal_load);
    if (!crosses) {
        hs_line *reached = NULL;
        c->piece[0] = 0.0;
        c->piece[1] = 1.0;
        status = aim(w, memory, on, &reached);
        if (status == HS_OK)
            crosses = slack * fabs(c->tangential[1]) >=
                      hs_friction_limit(reached, reached->approach, reached->normal_load);
        hs_line_free(reached);
    }
    if (status == HS_OK && crosses)
        status = find_crossings(w, memory, on, CHORDS_TO_CROSS, drive->saturate);
    w->drive = drive;
    return status;
}

/* Cut a path at the inner ends of pieces: numbers of chords count from there. */
static void cut_at_crossings(walk *w, const hs_pieces *pieces) {
    for (int k = 0; k + 1 < pieces->count; ++k) {
        int64_t place = w->cuts++;
        for (; place > 0 && w->cut[place - 1] > pieces->end[k]; --place)
            w->cut[place] = w->cut[place - 1];
        w->cut[place] = pieces->end[k];
    }
}

/* Integrate a part of a path, piece by piece of its request. */
static int walk_pieces(walk *w, hs_line *memory, leg *on, double before, double share) {
    route *c = &w->course;
    int status = HS_OK;
    if (!on->aims) return walk_part(w, memory, on, before, share);
    for (int k = 0; k < on->pieces.count && before < share && status == HS_OK; ++k) {
        double end = on->pieces.end[k], stop = hs_min(end, share);
        hs_line *reached = NULL;
        if (end <= before) continue;
        if (on->pieces.side[k] != 0) {
            c->straight = 0;
        } else if (!c->straight || c->piece[1] != end || c->piece[0] > before) {
            c->piece[0] = before;
            c->piece[1] = end;
            c->ends_at_limit = k + 1 < on->pieces.count ? on->pieces.side[k + 1] : 0;
            status = aim(w, memory, on, &reached);
        }
        if (reached && status == HS_OK && stop == end && !hs_is_timed(memory))
            hs_line_swap(memory, reached);
        else if (status == HS_OK)
            status = walk_part(w, memory, on, before, stop);
        hs_line_free(reached);
        before = stop;
    }
    return status;
}

/* Whether displacements are straight on a path that is not integrated at once: to where a load or a
 * drive leads. */
static int has_aim(const walk *w, const hs_line *memory, int still) {
    const route *c = &w->course;
    if (still && !(w->yield.onset < 1.0)) return 0;
    if (c->both_loads || c->ends_separated || !(c->tangential_by_load || w->compliance > 0.0))
        return 0;
    return !is_at_rest(w, memory);
}

/* Integrate one path, of which rows are recorded. */
static int walk_path(walk *w, hs_line *memory, const hs_path *path, double until,
                     hs_recorder *recorder, int *flag) {
    leg on;
    int status = HS_OK;
    w->course.first = NULL;
    w->yield.onset = HUGE_VAL;
    hs_set_clock(memory, path->begin);
    if (w->alone && w->parted && hs_slides_alike(memory)) {
        /* groups are one again that have parted as they yielded */
        status = hs_join_groups(memory, NULL, NULL, memory->approach, 0);
        w->parted = 0;
        recorder->contact = NULL;
    }
    if (status == HS_OK) status = begin_course(w, memory, path);
    on.still = status == HS_OK && is_still(w, memory);
    int yields = w->yield.onset < 1.0;
    double before = 0.0, first = until / (double)path->parts;
    on.elastic = yields ? w->yield.onset : 1.0;
    on.aims = status == HS_OK && has_aim(w, memory, on.still);
    /* laws of friction have stations where asperities touch, but where displacements are found
     * chords end there, too */
    int cuts =
        yields || (!on.still && (w->wears || w->course.tangential_by_load || w->compliance > 0.0));
    int by_load = !on.still && w->evolution->law.kind != HS_NO_LAW &&
                  w->evolution->law.depends_on == HS_ON_TOTAL_LOAD;
    if (status == HS_OK && (cuts || by_load)) status = cut_path(w, memory, cuts, by_load);
    if (status == HS_OK && on.still && !on.aims && on.elastic > 0.0) {
        hs_path leg = yields ? path_to_onset(w, path) : *path;
        int direct = yields ? first >= on.elastic : path->parts == 1 && until == 1.0;
        status = hs_plan_path(memory, &leg, w->compliance, w->drive->saturate, direct, &on.plan,
                              w->refusal);
    }
    if (status == HS_OK && on.aims && w->alone) status = hs_line_unshare_contact(memory);
    if (status == HS_OK && on.aims) status = find_pieces(w, memory, &on);
    if (status == HS_OK && !on.aims && w->drive->saturate && w->course.tangential_by_load &&
        !is_at_rest(w, memory)) {
        if (!on.still || yields) {
            status = find_crossings(w, memory, &on, CHORDS_TO_CUT, 1);
            cut_at_crossings(w, &on.pieces);
        } else if (!w->alone) {
            cut_at_crossings(w, &on.plan.pieces);
        }
    }
    for (int64_t part = 1; part <= path->parts && status == HS_OK; ++part) {
        double share = until * ((double)part / (double)path->parts);
        status = walk_pieces(w, memory, &on, before, share);
        before = share;
        if (status == HS_OK)
            status = hs_count_work(w->drive, &w->work, 1 + memory->contact->count / 8);
        if (status == HS_OK && memory->lost_slides) status = HS_OUT_OF_MEMORY;
        if (status != HS_OK) break;
        *flag |= memory->excess != 0.0;
        if (recorder->rows && (part < path->parts || path->recorded)) {
            /* its asperities may stand in another order now */
            if (!w->alone || on.aims || share > on.elastic) recorder->contact = NULL;
            status = hs_record(recorder, memory, path->first_row + part - 1, *flag);
            *flag = 0;
        }
    }
    if (on.aims) recorder->contact = NULL;
    hs_contact_free(w->course.first);
    if (yields) {
        recorder->contact = NULL;
        w->yield.next = NAN;
    }
    memory->normal_control = path->normal_control;
    memory->tangential_control = path->tangential_control[0];
    return status;
}

int hs_line_evolve(hs_line *memory, const hs_path *paths, int64_t count, const hs_rows *rows,
                   const hs_drive *drive, double until, const hs_evolution *evolution,
                   hs_refusal *refusal) {
    hs_recorder recorder;
    const hs_law *law = &evolution->law;
    hs_refusal unread;
    walk w;
    if (!refusal) refusal = &unread;
    int flag = 0, status = hs_can_evolve(memory, evolution) ? HS_OK : HS_FOREIGN;
    if (status == HS_OK) status = part_as_they_evolve(memory, evolution);
    if (status != HS_OK) return status;
    memset(&w, 0, sizeof w);
    w.evolution = evolution;
    w.drive = drive;
    w.refusal = refusal;
    w.wears = evolution->wear.kind != HS_NO_WEAR;
    w.yields = evolution->yielding.kind != HS_NO_YIELDING;
    w.yield.next = NAN;
    w.parted = memory->contact->groups > 1;
    w.alone = w.yields && !w.wears &&
              (law->kind == HS_NO_LAW || law->depends_on == HS_ON_NOTHING) && !evolution->goal &&
              !evolution->follow_sliding;
    w.compliance = drive->compliance[0] * memory->contact->units.stiffness;
    if (make_buffers(&w, memory->contact) != HS_OK) return HS_OUT_OF_MEMORY;
    status = hs_recorder_init(&recorder, memory->contact, rows);
    if (status == HS_OK && !w.alone) {
        /* it changes places with copies whose summits change */
        if (w.wears || w.yields) status = hs_line_unshare_contact(memory);
        if (status == HS_OK) status = make_spares(&w, memory);
    }
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        hs_path path = hs_scale_path(&memory->contact->units, paths + p);
        refusal->path = p;
        status = walk_path(&w, memory, &path, until, &recorder, &flag);
    }
    for (int k = 0; k < 2; ++k) hs_line_free(w.spare[k]);
    hs_recorder_clear(&recorder);
    free_buffers(&w);
    return status;
}

int hs_line_set_summits(hs_line *memory, const double *summit_height, const double *summit_radius,
                        const uint8_t *fresh, const hs_evolution *evolution) {
    int64_t count = memory->contact->count;
    size_t size = (size_t)count * sizeof(double);
    if (!hs_can_evolve(memory, evolution)) return HS_FOREIGN;
    int status = HS_OK;
    hs_evolved *evolved = memory->evolved;
    double stored = hs_elastic_energy(memory, NULL), erased = 0.0;
    for (int64_t i = 0; i < count; ++i)
        erased += fresh[memory->contact->order[i]] && memory->contact->gap[i] < memory->approach;
    /* they may be the memory's own, which moves when groups part */
    memmove(evolved->summit_height, summit_height, size);
    memmove(evolved->summit_radius, summit_radius, size);
    for (int64_t i = 0; i < count; ++i)
        if (fresh[i]) evolved->shaped_volume[i] = evolved->waiting_volume[i] = 0.0;
    walk w;
    memset(&w, 0, sizeof w);
    w.evolution = evolution;
    w.yields = evolution->yielding.kind != HS_NO_YIELDING;
    for (int64_t i = 0; i < count && w.yields; ++i)
        if (fresh[i]) {
            evolved->virgin_height[i] = evolved->summit_height[i];
            evolved->virgin_radius[i] = evolved->summit_radius[i];
            evolved->yielded_to[i] = evolved->yielding_load[i] = 0.0;
        }
    if (w.yields) status = hs_yield_to(memory, evolution, memory->approach, NULL);
    if (status == HS_OK) status = part_as_they_evolve(memory, evolution);
    double *gap = (double *)malloc(2 * size), *weight = gap + count;
    if (!gap) return HS_OUT_OF_MEMORY;
    evolved = memory->evolved;
    for (int64_t i = 0; i < count; ++i) {
        gap[i] =
            (memory->contact->datum - evolved->summit_height[i]) / memory->contact->units.length;
        weight[i] = sqrt(evolved->summit_radius[i] / memory->contact->units.radius);
    }
    if (status == HS_OK) status = hs_reshape(memory, gap, weight, fresh);
    free(gap);
    if (status != HS_OK) return status;
    memory->evolved->erased_memories += erased;
    memory->evolved->erased_energy +=
        (stored - hs_elastic_energy(memory, NULL)) * memory->contact->units.energy;
    if (make_buffers(&w, memory->contact) != HS_OK) return HS_OUT_OF_MEMORY;
    status = hs_set_stations(&w, memory, memory->approach, memory->normal_load, 1.0, NULL);
    if (status == HS_OK) {
        memcpy(memory->friction, w.friction, (size_t)memory->contact->groups * sizeof(double));
        hs_flag_steep(memory);
    }
    free_buffers(&w);
    return status;
}

/* Scale the energies dissipated since a state to the balance of work, with a load that is linear in
 * the displacement, and elastic energy. */
static void balance_energies(hs_line *memory, const hs_line *start) {
    const double lost = memory->dissipated - start->dissipated,
                 work = 0.5 * (start->tangential_load + hs_total_force(memory)) *
                        (memory->displacement - start->displacement);
    const double balance =
        hs_max(work + hs_elastic_energy(start, NULL) - hs_elastic_energy(memory, NULL), 0.0);
    if (!(lost > 0.0)) return;
    for (int64_t i = 0; i < memory->contact->count; ++i) {
        double before = start->dissipated_each[i];
        memory->dissipated_each[i] =
            before + balance / lost * (memory->dissipated_each[i] - before);
    }
    memory->dissipated = start->dissipated + balance;
}

/* Change the coefficients linearly up to `w->goal` at constant approach. The tangential load, or
 * the drive, is constant up to the fraction at which friction no longer holds the load; from there
 * the displacement is. */
static int change_friction(walk *w, hs_line *memory, double held) {
    route *c = &w->course;
    int by_load = memory->tangential_control == HS_LOAD, status = HS_OK;
    double drive = memory->displacement + w->compliance * memory->tangential_load;
    c->d[0] = c->d[1] = memory->approach;
    c->load[0] = c->load[1] = memory->normal_load;
    c->tangential_by_load = c->both_loads = c->normal_by_load = by_load;
    c->tangential[0] = c->tangential[1] = by_load ? memory->tangential_load : drive;
    c->times[0] = c->times[1] = memory->clock.end;
    if (!by_load && w->compliance == 0.0) held = 0.0;
    if (held > 0.0) {
        hs_line *start = hs_line_copy(memory);
        status = start ? make_spares(w, memory) : (int)HS_OUT_OF_MEMORY;
        if (status == HS_OK)
            status = hs_settle_in_chords(w, memory, w->spare[0], w->spare[1], 0.0, held);
        if (status == HS_OK) balance_energies(memory, start);
        hs_line_free(start);
    }
    if (status != HS_OK || held == 1.0) return status;
    c->tangential_by_load = c->both_loads = c->normal_by_load = 0;
    w->compliance = 0.0;
    c->tangential[0] = c->tangential[1] = memory->displacement;
    return hs_chord(w, memory, held, 1.0);
}

int hs_line_set_friction(hs_line *memory, const double *friction, const hs_drive *drive) {
    int status = hs_split_groups(memory, friction, friction), falls = 0;
    if (status != HS_OK) return status;
    const hs_contact *contact = memory->contact;
    const double load = memory->tangential_load;
    double before = hs_friction_limit(memory, memory->approach, memory->normal_load), held = 1.0;
    hs_evolution evolution;
    hs_refusal unread;
    walk w;
    memset(&evolution, 0, sizeof evolution);
    memset(&w, 0, sizeof w);
    w.evolution = &evolution;
    w.drive = drive;
    w.refusal = &unread;
    w.yield.onset = HUGE_VAL;
    w.compliance = drive->compliance[0] * contact->units.stiffness;
    if (make_buffers(&w, contact) != HS_OK) return HS_OUT_OF_MEMORY;
    evolution.goal = w.goal[1];
    for (int64_t g = 0; g < contact->groups; ++g) {
        double changed = hs_bound_friction(friction[contact->order[contact->first[g]]]);
        falls |= memory->depth[g] > 0 && changed < memory->friction[g];
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i) {
            w.goal[0][contact->order[i]] = memory->friction[g];
            w.goal[1][contact->order[i]] = changed;
        }
        memory->friction[g] = changed;
    }
    double after = hs_friction_limit(memory, memory->approach, memory->normal_load);
    if (falls && memory->tangential_control == HS_LOAD && fabs(load) > after)
        held = hs_min(hs_max((before - fabs(load)) / (before - after), 0.0), 1.0);
    hs_flag_steep(memory);
    if (falls) {
        for (int64_t g = 0; g < contact->groups; ++g)
            memory->friction[g] = w.goal[0][contact->order[contact->first[g]]];
        status = change_friction(&w, memory, held);
        memory->excess = 0.0;
        if (memory->tangential_control == HS_LOAD) memory->tangential_load = load;
    }
    for (int k = 0; k < 2; ++k) hs_line_free(w.spare[k]);
    free_buffers(&w);
    return status;
}
