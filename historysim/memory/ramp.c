/* Straight ramps in (N, T), walked in straight paths in (d, V). */

#include "internal.h"

#define MOST_CHORDS (1 << 14)
/* part by which the changes from one count of chords to the next may miss the order of the error */
#define DISORDER 0.15
/* of Gauss's quadrature on (0, 1) */
#define NODES 5
static const double node[NODES] = {0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319};
static const double node_weight[NODES] = {0.11846344252809454, 0.2393143352496832, 0.28444444444444444,
                                          0.2393143352496832, 0.11846344252809454};
/* a front that passes a summit bends the way; of one summit it does not, and of many each bends it little */
#define FEW_SUMMITS 100
#define FEW_PANELS 6

/* Tangential load on a path at a point of it. */
static int force_on_way(hs_memory *memory, hs_fronts *fronts, double d, double v, double *force) {
    hs_shares shares;
    hs_force found;
    hs_point to = {d, v};
    double load = hs_load_at(hs_all_of(memory->contact), d).load;
    int status = hs_shares_at(memory, d, load, &shares);
    if (status != HS_OK) return status;
    status = hs_force_at(memory, &shares, fronts, to, &found);
    hs_free_shares(&shares);
    *force = found.force;
    return status;
}

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
        int status = force_on_way(memory, fronts, d, v, &reached);
        if (status != HS_OK) return status;
        hs_load carried = hs_load_at(hs_all_of(memory->contact), d);
        d += (memory->normal_load + rate * (reached - memory->tangential_load) - carried.load) / carried.slope;
        status = force_on_way(memory, fronts, d, v, &raised);
        if (status != HS_OK) return status;
        more += node_weight[k % NODES] / panels * (raised - reached);
    }
    *work = more * (v1 - memory->displacement);
    return HS_OK;
}

/* Carry all groups along one chord, and correct its energy for the way of the loads. */
static int corrected_chord(hs_memory *memory, double load, double force) {
    hs_aim aim = hs_to_load(force);
    double d1 = hs_approach_for(memory, load), before = memory->dissipated, more = 0.0;
    int64_t count = memory->contact->count;
    double *each = (double *)malloc((size_t)count * sizeof *each);
    hs_fronts fronts;
    if (!each || hs_no_fronts(&fronts, memory->contact->groups) != HS_OK) {
        free(each);
        return HS_OUT_OF_MEMORY;
    }
    memcpy(each, memory->each, (size_t)count * sizeof *each);
    int status = HS_OK;
    if (hs_is_alone(memory)) {
        hs_memory *start = hs_memory_copy(memory);
        status = start ? hs_move(memory, d1, load, aim) : HS_OUT_OF_MEMORY;
        if (status == HS_OK) status = extra_work(start, &fronts, d1, memory->displacement, load, force, &more);
        hs_memory_free(start);
    } else {
        hs_shares shares;
        double v1 = 0.0;
        status = hs_make_room(memory);
        if (status == HS_OK) status = hs_shares_at(memory, d1, load, &shares);
        if (status == HS_OK) {
            status = hs_displacement_with(memory, &shares, &fronts, d1, aim, &v1);
            if (status == HS_OK) status = extra_work(memory, &fronts, d1, v1, load, force, &more);
            if (status == HS_OK) status = hs_carry(memory, &shares, d1, load, aim, hs_to_displacement(v1));
            hs_free_shares(&shares);
        }
    }
    double lost = memory->dissipated - before;
    if (status == HS_OK && lost > 0.0) {
        double share = hs_most(1.0 + more / lost, 0.0);
        for (int64_t i = 0; i < count; ++i) memory->each[i] = each[i] + share * (memory->each[i] - each[i]);
        memory->dissipated = before + share * lost;
    }
    hs_free_fronts(&fronts);
    free(each);
    return status;
}

static int in_chords(hs_memory *memory, double load, double force, int64_t chords) {
    double load0 = memory->normal_load, force0 = memory->tangential_load;
    for (int64_t k = 1; k <= chords; ++k) {
        double share = (double)k / (double)chords;
        double step_load = hs_toward(load0, load, share), step_force = hs_toward(force0, force, share);
        int status = hs_move(memory, hs_approach_for(memory, step_load), step_load, hs_to_load(step_force));
        if (status != HS_OK) return status;
    }
    return HS_OK;
}

/* Carry all groups along the straight ramp in (N, T) to (load, force).
 *
 * One straight path in (d, V) ends in the exact state where there is one friction group, and its energy is exact where N is
 * constant or nothing slips. Where N changes little, the energy of that one chord is corrected for what the ramp departs
 * from it. Otherwise the ramp is walked in chords whose ends lie on it, more of them each time, until the energy,
 * extrapolated, and with several groups the displacement too, change by less than `tolerance` (relative to what the ramp
 * dissipates, and to the displacement at which the contact slides). */
int hs_ramp(hs_memory *memory, double load, double force, double tolerance) {
    const double touch = memory->contact->sorted_gap[0];
    if (memory->approach < touch && load > 0.0) memory->approach = touch;
    double load0 = memory->normal_load, force0 = memory->tangential_load, start = memory->dissipated;
    double rise = load - load0, part = rise != 0.0 ? rise / hs_most(load, load0) : 0.0;
    int sticks = fabs(force - force0) <= hs_least_friction(memory) * rise;
    /* the error of a corrected chord is a small multiple of the square of the relative change */
    int small = rise == 0.0 || part * part <= tolerance;
    int corrects = small && rise != 0.0 && fabs(force - force0) > hs_largest_friction(memory) * fabs(rise);
    if (corrects && !sticks) return corrected_chord(memory, load, force);
    if (small || sticks) return in_chords(memory, load, force, 1);
    /* then the state does not depend on the chords */
    int single = hs_is_alone(memory);
    /* with several groups the error falls in steps, as groups slip earlier or later */
    int64_t ratio = single ? 2 : 3;
    double square = (double)(ratio * ratio), weight = 1.0 / (square - 1.0);
    double energy = 0.0, last_change = 0.0;
    int fell = 1, agreed = 0, status = HS_OK;
    hs_memory *whole = NULL, *coarse = NULL, *fine = NULL;
    for (int64_t chords = 1;; chords *= ratio) {
        fine = hs_memory_copy(memory);
        status = fine ? in_chords(fine, load, force, chords) : HS_OUT_OF_MEMORY;
        if (status != HS_OK) break;
        if (chords == 1) {
            whole = hs_memory_copy(fine);
            if (!whole) {
                status = HS_OUT_OF_MEMORY;
                break;
            }
        } else {
            double extrapolated = fine->dissipated + weight * (fine->dissipated - coarse->dissipated);
            double drift = fabs(fine->displacement - coarse->displacement);
            double reach = hs_largest_friction(memory) * (hs_most(memory->approach, fine->approach) - touch);
            double change = fabs(fine->dissipated - coarse->dissipated);
            /* beside much that was dissipated before, little is told no better than by rounding */
            double told = hs_most(tolerance * (extrapolated - start), HS_TIE * start);
            int settled = fabs(extrapolated - energy) <= told;
            /* while the changes do not fall by ratio², as they have to, two extrapolations may agree by chance */
            int falls = fabs(last_change - square * change) <= DISORDER * last_change || chords == ratio;
            int needed = single && falls && fell ? 1 : 2;
            last_change = change;
            fell = falls;
            agreed = settled && (single || drift <= tolerance * reach) ? agreed + 1 : 0;
            if (agreed >= needed || chords > MOST_CHORDS) break;
            energy = extrapolated;
        }
        hs_memory_free(coarse);
        coarse = fine;
        fine = NULL;
    }
    hs_memory *kept = single ? whole : fine, *spare = single ? fine : whole;
    if (status == HS_OK) {
        for (int64_t i = 0; i < memory->contact->count; ++i) {
            double extrapolated = fine->each[i] + weight * (fine->each[i] - coarse->each[i]);
            kept->each[i] = hs_most(extrapolated, memory->each[i]);
        }
        kept->dissipated = hs_most(fine->dissipated + weight * (fine->dissipated - coarse->dissipated), start);
        hs_memory_take(memory, kept);
        kept = NULL;
    }
    hs_memory_free(kept);
    hs_memory_free(spare);
    hs_memory_free(coarse);
    return status;
}
