/* Friction: a change of the coefficients of a stationary contact, from the old values and the new ones (README.md, theory 2 and 7).
 *
 * Where a coefficient falls, springs beyond the new limit slip. Under a tangential load, or behind an instrument, the
 * displacement follows while it falls, so that a jump is what many small falls are: the coefficients go straight from the
 * old values to the new ones. Where friction no longer holds the load, everything slides and the displacement stays. */

#include "line.h"
#include "move.h"

#define MOST_PARTS (1 << 10)

/* Change the coefficients, and the displacement to where it aims, straight together. */
static int fall(hs_memory *memory, const double *friction, hs_target target) {
    int64_t groups = memory->contact->groups, touching = 0, room = hs_room_to_clip(hs_max_depth(memory));
    double d = memory->approach, v0 = memory->displacement, v1 = target.value;
    hs_point from = {d, v0};
    hs_tick(memory, memory->clock.end);
    hs_vertex *scratch = (hs_vertex *)malloc(2 * (size_t)room * sizeof *scratch);
    double *before = (double *)malloc(2 * (size_t)groups * sizeof *before);
    int status = scratch && before ? hs_memory_reserve(memory, room) : HS_OUT_OF_MEMORY;
    if (status == HS_OK) {
        /* the very loads that the edges have */
        hs_group_loads loads;
        loads.load = before + groups;
        loads.from = NULL;
        while (touching < groups && memory->depth[touching] > 0) ++touching;
        loads.count = touching;
        for (int64_t index = 0; index < touching; ++index)
            loads.load[index] = memory->vertices[index * memory->capacity + memory->depth[index] - 1].normal;
        memcpy(before, memory->friction, (size_t)groups * sizeof *before);
        memcpy(memory->friction, friction, (size_t)groups * sizeof *before);
        if (target.compliance > 0.0) {
            hs_fronts fronts;
            /* any cone may cut any polyline */
            memset(memory->steep, 1, (size_t)groups);
            status = hs_init_fronts(&fronts, touching);
            if (status == HS_OK) {
                status = hs_search_displacement(memory, &loads, &fronts, d, target, &v1);
                hs_free_fronts(&fronts);
            }
        }
        hs_point to = {d, v1};
        hs_losses losses;
        hs_init_losses(&losses, groups);
        for (int64_t index = 0; index < touching && status == HS_OK; ++index) {
            if (v1 == v0 && friction[index] >= before[index]) continue;
            hs_group group = hs_group_of(memory, index);
            status = hs_move_group(memory, &group, &losses, index, before[index], from, to, loads.load[index],
                                    hs_to_displacement(v1), scratch, &v1);
        }
        hs_commit_losses(&losses, memory);
        memory->displacement = v1;
        memory->tangential_load = hs_total_force(memory);
    }
    free(scratch);
    free(before);
    return status;
}

static void mix(const double *first, const double *last, double share, double *target, int64_t count) {
    for (int64_t i = 0; i < count; ++i) target[i] = first[i] + share * (last[i] - first[i]);
}

/* Change the coefficients in equal parts, more of them each time, until it makes no difference.
 *
 * What is dissipated is the work of the tangential load, less what is stored, which is exact; the parts say how the
 * asperities share it. */
static int fall_in_parts(hs_memory *memory, const double *friction, hs_target target, double tolerance) {
    int64_t groups = memory->contact->groups;
    double before = hs_elastic_energy(memory, NULL), lost = memory->dissipated, reached = HUGE_VAL, balance = 0.0, told = 0.0;
    double reach = hs_friction_range(memory, HUGE_VAL).most * (memory->approach - memory->contact->sorted_gap[0]);
    double *first = (double *)malloc(2 * (size_t)groups * sizeof *first), *there = first + groups;
    hs_memory *fine = NULL;
    int status = first ? HS_OK : HS_OUT_OF_MEMORY;
    if (first) memcpy(first, memory->friction, (size_t)groups * sizeof *first);
    for (int parts = 4; status == HS_OK; parts *= 2) {
        fine = hs_memory_copy(memory);
        if (!fine) status = HS_OUT_OF_MEMORY;
        for (int k = 1; k <= parts && status == HS_OK; ++k) {
            mix(first, friction, (double)k / parts, there, groups);
            status = fall(fine, there, target);
        }
        if (status != HS_OK) break;
        double moved = fine->displacement - memory->displacement;
        double work = 0.5 * (memory->tangential_load + hs_total_force(fine)) * moved;
        balance = work + before - hs_elastic_energy(fine, NULL);
        told = fine->dissipated - lost;
        int settled = fabs(fine->displacement - reached) <= tolerance * reach;
        if (parts >= MOST_PARTS || (settled && fabs(told - balance) <= 1e-3 * told + tolerance * tolerance * before))
            break;
        reached = fine->displacement;
        hs_memory_free(fine);
        fine = NULL;
    }
    if (status == HS_OK) {
        double share = told > 0.0 ? hs_most(balance, 0.0) / told : 1.0;
        for (int64_t i = 0; i < memory->contact->count; ++i)
            fine->dissipated_each[i] = memory->dissipated_each[i] + share * (fine->dissipated_each[i] - memory->dissipated_each[i]);
        fine->dissipated = lost + share * told;
        hs_memory_take(memory, fine);
        fine = NULL;
    }
    hs_memory_free(fine);
    free(first);
    return status;
}

/* Replace the groups' coefficients while the tangential channel holds what it aims at. A load beyond the new limit stays
 * with the memory as what is asked for. */
static int change(hs_memory *memory, const double *friction, hs_target target, double tolerance) {
    size_t groups = (size_t)memory->contact->groups;
    double held = 1.0, force = memory->tangential_load;
    int falls = 0, status = HS_OK;
    for (size_t index = 0; index < groups; ++index)
        falls |= memory->depth[index] > 0 && friction[index] < memory->friction[index];
    if (!falls) {
        memcpy(memory->friction, friction, groups * sizeof *friction);
        hs_flag_steep(memory);
        return HS_OK;
    }
    double *there = (double *)malloc(2 * groups * sizeof *there), *first = there + groups;
    if (!there) return HS_OUT_OF_MEMORY;
    memcpy(first, memory->friction, groups * sizeof *first);
    double before = hs_friction_limit(memory, memory->approach, memory->normal_load);
    memcpy(memory->friction, friction, groups * sizeof *first);
    double after = hs_friction_limit(memory, memory->approach, memory->normal_load);
    hs_flag_steep(memory);
    memcpy(memory->friction, first, groups * sizeof *first);
    if (target.rigid == 0.0 && fabs(force) > after)
        held = hs_least(hs_most((before - fabs(force)) / (before - after), 0.0), 1.0);
    if (target.compliance > 0.0 && held > 0.0) {
        mix(first, friction, held, there, (int64_t)groups);
        status = fall_in_parts(memory, there, target, tolerance);
    }
    if (status == HS_OK && (target.compliance == 0.0 || held < 1.0))
        status = fall(memory, friction, hs_to_displacement(memory->displacement));
    if (status == HS_OK) {
        memcpy(memory->friction, friction, groups * sizeof *friction);
        hs_flag_steep(memory);
        memory->tangential_load = target.rigid == 0.0 ? force : hs_total_force(memory);
    }
    free(there);
    return status;
}

int hs_line_set_friction(hs_memory *memory, const double *friction, const hs_drive *drive) {
    const hs_contact *contact = memory->contact;
    double compliance = drive->compliance[0] * contact->units.stiffness;
    hs_target target = hs_to_load(memory->tangential_load);
    int status = hs_split_groups(memory, friction, friction);
    if (status != HS_OK) return status;
    contact = memory->contact;
    if (memory->tangential_control != HS_LOAD) {
        target.value = memory->displacement + compliance * memory->tangential_load;
        target.rigid = 1.0;
        target.compliance = compliance;
    }
    double *leading = (double *)malloc((size_t)contact->groups * sizeof *leading);
    if (!leading) return HS_OUT_OF_MEMORY;
    for (int64_t index = 0; index < contact->groups; ++index)
        leading[index] = hs_bound_friction(friction[contact->order[contact->first[index]]]);
    status = change(memory, leading, target, drive->tolerance);
    free(leading);
    return status;
}
