/* Ramp: a straight path in (N, T) as straight paths in (d, V), as few as the tolerance of its energy allows (README.md, theory
 * 10). */

#include "ramp.h"
#include "drive.h"
#include "slides.h"

/* chords of one ramp; a tolerance that takes more is made coarser, by a factor between two */
#define MOST_CHORDS (1 << 13)
#define LEAST_COARSER 4.0
#define MOST_COARSER 1e4
/* share of a ramp where its loads or groups turn a corner: so many steps together may miss the whole tolerance */
#define CORNERS 64
/* of Gauss's quadrature on (0, 1) */
#define NODES 5
static const double node[NODES] = {0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319};
static const double node_weight[NODES] = {0.11846344252809454, 0.2393143352496832, 0.28444444444444444,
                                          0.2393143352496832, 0.11846344252809454};
/* a front that passes a summit bends the way; of one summit it does not, and of many each bends it little */
#define FEW_SUMMITS 100
#define FEW_PANELS 6

/* Work that the way of the loads takes beyond that of a chord, to (d1, v1) where they are `load` and `force`.
 *
 * The way of the loads is straight in (N, T) and not in (d, V). Both lead from one state to the other, so what it
 * dissipates more is the work of the tangential load that it has more at each displacement. To first order in the change of
 * N that load is the one at its approach. */
static int extra_work(hs_memory *memory, hs_fronts *fronts, double d1, double v1, double load, double force,
                      double *work) {
    double rate = (load - memory->normal_load) / (force - memory->tangential_load), more = 0.0;
    int64_t count = memory->contact->count;
    int panels = 1 < count && count <= FEW_SUMMITS ? FEW_PANELS : 1;
    for (int k = 0; k < panels * NODES; ++k) {
        double share = (k / NODES + node[k % NODES]) / panels, reached, raised;
        double d = hs_toward(memory->approach, d1, share), v = hs_toward(memory->displacement, v1, share);
        int status = hs_force_on_path(memory, fronts, d, v, &reached);
        if (status != HS_OK) return status;
        hs_load carried = hs_load_at(hs_all_of(memory->contact), d);
        d += (memory->normal_load + rate * (reached - memory->tangential_load) - carried.load) / carried.slope;
        status = hs_force_on_path(memory, fronts, d, v, &raised);
        if (status != HS_OK) return status;
        more += node_weight[k % NODES] / panels * (raised - reached);
    }
    *work = more * (v1 - memory->displacement);
    return HS_OK;
}

/* Carry all groups along one chord, and correct its energy for the way of the loads. */
static int corrected_chord(hs_memory *memory, double load, double force) {
    hs_target target = hs_to_load(force);
    double d1 = hs_approach_at_load(memory, load), before = memory->dissipated, more = 0.0;
    int64_t count = memory->contact->count;
    double *each = (double *)malloc((size_t)count * sizeof *each);
    hs_fronts fronts;
    if (!each || hs_init_fronts(&fronts, memory->contact->groups) != HS_OK) {
        free(each);
        return HS_OUT_OF_MEMORY;
    }
    memcpy(each, memory->dissipated_each, (size_t)count * sizeof *each);
    int status = HS_OK;
    if (hs_has_single_group(memory)) {
        hs_memory *start = hs_memory_copy(memory);
        status = start ? hs_move(memory, d1, load, target) : HS_OUT_OF_MEMORY;
        if (status == HS_OK) status = extra_work(start, &fronts, d1, memory->displacement, load, force, &more);
        hs_memory_free(start);
    } else {
        hs_group_loads loads;
        double v1 = 0.0;
        status = hs_reserve_vertices(memory);
        if (status == HS_OK) status = hs_loads_of_groups(memory, d1, load, &loads);
        if (status == HS_OK) {
            status = hs_solve_displacement_with(memory, &loads, &fronts, d1, target, &v1);
            hs_point to = {d1, v1};
            if (status == HS_OK) status = hs_record_slides_on_ramp(memory, to, &loads, &fronts);
            if (status == HS_OK) status = extra_work(memory, &fronts, d1, v1, load, force, &more);
            if (status == HS_OK) status = hs_move_with_loads(memory, &loads, d1, load, target, hs_to_displacement(v1));
            hs_free_group_loads(&loads);
        }
    }
    double lost = memory->dissipated - before;
    if (status == HS_OK && lost > 0.0) {
        double share = hs_most(1.0 + more / lost, 0.0);
        for (int64_t i = 0; i < count; ++i) memory->dissipated_each[i] = each[i] + share * (memory->dissipated_each[i] - each[i]);
        memory->dissipated = before + share * lost;
    }
    hs_free_fronts(&fronts);
    free(each);
    return status;
}

/* A ramp that is walked in chords: where it leads, and by how much energy and displacement may be off in all. */
typedef struct ramp {
    double load[2], force[2];
    double energy, displacement;
    double times[2];
    const hs_drive *drive;
    int64_t chords, work;
} ramp;

/* Let the clock go on to the end of a path that is straight in both loads. */
static void begin_chord(hs_memory *memory, double load, double force, double time) {
    hs_tick(memory, time);
    memory->clock.load = load;
    memory->clock.force = force;
}

static int chord(hs_memory *memory, ramp *way, double share) {
    double load = hs_toward(way->load[0], way->load[1], share), force = hs_toward(way->force[0], way->force[1], share);
    ++way->chords;
    begin_chord(memory, load, force, hs_toward(way->times[0], way->times[1], share));
    int status = hs_move(memory, hs_approach_at_load(memory, load), load, hs_to_load(force));
    return status == HS_OK ? hs_count_work(way->drive, &way->work, 2 + memory->contact->count / 16) : status;
}

/* Walk from a share of a ramp to another in one chord, and from the same state in two; tell how much they are apart. */
static int step(const hs_memory *memory, ramp *way, double from, double to, hs_memory *coarse, hs_memory *fine,
                double *apart) {
    int status = hs_memory_assign(coarse, memory);
    if (status == HS_OK) status = hs_memory_assign(fine, memory);
    coarse->clock.end = NAN;
    if (status == HS_OK) status = chord(coarse, way, to);
    if (status == HS_OK) status = chord(fine, way, 0.5 * (from + to));
    if (status == HS_OK) status = chord(fine, way, to);
    double energy = fabs(fine->dissipated - coarse->dissipated) / way->energy;
    *apart = hs_most(energy, fabs(fine->displacement - coarse->displacement) / way->displacement);
    return status;
}

/* Energies of two chords and of one, extrapolated to those of many; none is gained. */
static void extrapolate(const hs_memory *start, const hs_memory *coarse, hs_memory *fine) {
    for (int64_t i = 0; i < start->contact->count; ++i)
        fine->dissipated_each[i] = hs_most(fine->dissipated_each[i] + (fine->dissipated_each[i] - coarse->dissipated_each[i]) / 3.0, start->dissipated_each[i]);
    fine->dissipated = hs_most(fine->dissipated + (fine->dissipated - coarse->dissipated) / 3.0, start->dissipated);
}

/* Integrate a ramp in steps that are as long as its tolerances allow. The error of two chords is a third of their
 * difference from one where the path is smooth; it is all of it where the path turns a corner, as where a group begins to
 * slide, or at the friction limit. `reached` is 1, or the share at which the chords were used up. */
static int in_steps(hs_memory *memory, ramp *way, hs_memory *coarse, hs_memory *fine, double *reached) {
    double share = 0.0, length = 0.125;
    for (way->chords = 0; share < 1.0 && way->chords <= MOST_CHORDS;) {
        double end = hs_least(share + length, 1.0), apart;
        length = end - share;
        int status = step(memory, way, share, end, coarse, fine, &apart);
        if (status != HS_OK) return status;
        double allowed = hs_most(3.0 * length, 1.0 / CORNERS);
        if (apart <= allowed) {
            extrapolate(memory, coarse, fine);
            hs_memory_swap(memory, fine);
            share = end;
        }
        double factor = apart > 0.0 ? 0.9 * sqrt(allowed / apart) : 4.0;
        length *= hs_least(hs_most(factor, 0.1), 4.0);
    }
    *reached = share;
    return HS_OK;
}

/* Integrate a ramp until its energy is known to a tolerance of the energy it dissipates, which is found meanwhile. Where
 * that takes too many chords, to the tolerance that they are enough for: their number goes with its inverse square root. */
static int settled(const hs_memory *memory, ramp *way, hs_memory *walked, hs_memory *coarse, hs_memory *fine) {
    const double touch = memory->contact->sorted_gap[0], friction = hs_friction_range(memory, HUGE_VAL).most;
    double highest = hs_most(memory->approach, hs_approach_at_load(memory, way->load[1]));
    double reach = friction * (highest - touch), start = memory->dissipated;
    /* little beside much is told no better than by rounding */
    double rounding = HS_TIE * (start + friction * hs_most(way->load[0], way->load[1]) * reach);
    double energy = HUGE_VAL, tolerance = way->drive->tolerance, accuracy = sqrt(tolerance), reached;
    for (;;) {
        way->energy = hs_most(accuracy * energy, rounding);
        /* the state does not depend on the chords of a single group */
        way->displacement = hs_has_single_group(memory) ? HUGE_VAL : hs_most(0.1 * accuracy, HS_TIE) * reach;
        int status = hs_memory_assign(walked, memory);
        if (hs_has_single_group(memory)) walked->clock.end = NAN;
        if (status == HS_OK) status = in_steps(walked, way, coarse, fine, &reached);
        if (status != HS_OK) return status;
        if (reached < 1.0) {
            accuracy = tolerance = accuracy * hs_least(hs_most(2.0 / (reached * reached), LEAST_COARSER), MOST_COARSER);
            continue;
        }
        double lost = walked->dissipated - start;
        int known = 2.0 * lost >= energy;
        if (known && accuracy == tolerance) return status;
        energy = lost;
        if (known) accuracy = tolerance;
    }
}

/* Carry all groups along the straight ramp in (N, T) to (load, force).
 *
 * One straight path in (d, V) ends in the exact state where there is one friction group, and its energy is exact where N is
 * constant or nothing slips. Where N changes little, the energy of that one chord is corrected for what the ramp departs
 * from it. Otherwise the ramp is walked in chords whose ends lie on it, short where the way bends much, until the energy,
 * extrapolated, and with several groups the displacement too, are known to the tolerance of the drive (relative to what the ramp
 * dissipates, and to the displacement at which the contact slides). */
int hs_ramp(hs_memory *memory, double load, double force, double time, const hs_drive *drive) {
    const double touch = memory->contact->sorted_gap[0];
    if (memory->approach < touch && load > 0.0) memory->approach = touch;
    double load0 = memory->normal_load, force0 = memory->tangential_load;
    double rise = load - load0, part = rise / hs_most(load, load0);
    ramp way = {{load0, load}, {force0, force}, HUGE_VAL, HUGE_VAL, {memory->clock.end, time}, drive, 0, 0};
    if (rise == 0.0) return chord(memory, &way, 1.0);
    int sticks = fabs(force - force0) <= hs_friction_range(memory, HUGE_VAL).least * rise;
    /* the error of a corrected chord is a small multiple of the square of the relative change */
    int small = part * part <= drive->tolerance;
    if (small && !sticks && fabs(force - force0) > hs_friction_range(memory, HUGE_VAL).most * fabs(rise)) {
        begin_chord(memory, load, force, time);
        return corrected_chord(memory, load, force);
    }
    if (small || sticks) return chord(memory, &way, 1.0);
    hs_memory *walked = hs_memory_copy(memory), *coarse = hs_memory_copy(memory), *fine = hs_memory_copy(memory);
    int status = walked && coarse && fine ? settled(memory, &way, walked, coarse, fine) : HS_OUT_OF_MEMORY;
    if (status == HS_OK && hs_has_single_group(memory)) {
        status = chord(memory, &way, 1.0);
        memcpy(memory->dissipated_each, walked->dissipated_each, (size_t)memory->contact->count * sizeof *memory->dissipated_each);
        memory->dissipated = walked->dissipated;
    } else if (status == HS_OK) {
        hs_memory_take(memory, walked);
        walked = NULL;
    }
    hs_memory_free(walked);
    hs_memory_free(coarse);
    hs_memory_free(fine);
    return status;
}
