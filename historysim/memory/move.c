/* All friction groups together on one straight path in (d, V). */

#include "internal.h"

/* how many times softer than the contact an instrument is for which rounding of the load would be felt at its drive */
#define MUCH_SOFTER 1e6

int hs_is_alone(const hs_memory *memory) { return memory->contact->groups == 1 && !memory->steep[0]; }

/* Have stacks hold what the next path adds: a front and an edge; a polyline steeper than μ may be cut in every segment. */
int hs_make_room(hs_memory *memory) {
    int64_t deepest = hs_deepest(memory), needed = hs_any_steep(memory) ? hs_room_to_clip(deepest) : deepest + 2;
    /* the less room there is above many shallow stacks, the more of them a cache holds */
    int64_t spare = memory->contact->groups > 1 && needed < 32 ? 2 : needed / 2;
    return needed > memory->capacity ? hs_memory_reserve(memory, needed + spare) : HS_OK;
}

/* A tangential load has to be within the friction limit. */
int hs_move(hs_memory *memory, double d, double load, hs_aim aim) {
    hs_shares shares;
    int status = hs_make_room(memory);
    if (status == HS_OK) status = hs_shares_at(memory, d, load, &shares);
    if (status != HS_OK) return status;
    hs_aim path = aim;
    if (aim.compliance != 0.0 && !(shares.count > 0 && hs_is_alone(memory))) {
        path = hs_to_displacement(0.0);
        status = hs_displacement_at(memory, &shares, d, aim, &path.value);
    }
    if (status == HS_OK) status = hs_carry(memory, &shares, d, load, aim, path);
    hs_free_shares(&shares);
    return status;
}

/* Replace the stack of a group by what was clipped. */
static void put_back(hs_memory *memory, int64_t index, const hs_vertex *clipped, int64_t depth) {
    memcpy(memory->vertices + index * memory->capacity, clipped, (size_t)depth * sizeof *clipped);
    memory->depth[index] = depth;
}

int hs_carry(hs_memory *memory, const hs_shares *shares, double d, double load, hs_aim aim, hs_aim path) {
    hs_point from = {memory->approach, memory->displacement};
    double reached = path.value, force = 0.0;
    int still = d == from.d && path.value == from.v && path.compliance == 0.0;
    int64_t groups = memory->contact->groups;
    hs_losses losses;
    hs_vertex *scratch = NULL;
    hs_no_losses(&losses, groups);
    if (still) force = hs_total_force(memory);
    if (!still && hs_any_steep(memory)) {
        scratch = (hs_vertex *)malloc(2 * (size_t)hs_room_to_clip(hs_deepest(memory)) * sizeof *scratch);
        if (!scratch) return HS_OUT_OF_MEMORY;
    }
    for (int64_t index = 0; index < groups && !still; ++index) {
        int64_t depth = memory->depth[index];
        if (index >= shares->count && depth == 0) break;
        hs_fetch_ahead(memory, index);
        hs_group group = hs_group_of(memory, index);
        if (index >= shares->count) {
            hs_point to = {d, reached};
            hs_lose_withdrawn(&group, &losses, depth, 1, &from, &to);
            memory->depth[index] = 0;
            memory->steep[index] = 0;
            continue;
        }
        if (memory->steep[index]) {
            hs_point to = {d, reached};
            hs_cone cone = {group.friction, to.v - from.v, group.friction * (d - from.d), 0.0};
            depth = hs_carry_and_clip(&group, &losses, depth, from, to, shares->load[index], &cone, scratch, NULL);
            put_back(memory, index, scratch, depth);
            memory->steep[index] = (uint8_t)hs_is_steep(scratch, depth, group.friction);
        } else {
            depth = hs_move_group(&group, &losses, depth, &from, d, shares->load[index], path, &reached);
            memory->depth[index] = depth;
        }
        force += group.stack[depth - 1].tangential;
    }
    free(scratch);
    hs_settle(&losses, memory);
    memory->approach = d;
    memory->displacement = reached;
    memory->normal_load = load;
    memory->tangential_load = aim.rigid == 0.0 ? aim.value : force;
    if (aim.rigid > 0.0 && aim.compliance * load > MUCH_SOFTER * d && d > 0.0) {
        /* the drive of so soft an instrument tells the load better than the sum over the springs does, unless the contact
         * has slid so far that its displacement is rounded by more than it can be strained */
        double limit = hs_friction_limit(memory, d, load);
        memory->tangential_load = hs_within((aim.value - aim.rigid * reached) / aim.compliance, limit);
    }
    return HS_OK;
}

void hs_tell_steep(hs_memory *memory) {
    for (int64_t index = 0; index < memory->contact->groups; ++index)
        memory->steep[index] = (uint8_t)hs_is_steep(memory->vertices + index * memory->capacity, memory->depth[index],
                                                    memory->friction[index]);
}
