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
int hs_move(hs_memory *memory, double d, double load, hs_target target) {
    hs_group_loads loads;
    int status = hs_make_room(memory);
    if (status == HS_OK) status = hs_loads_of_groups(memory, d, load, &loads);
    if (status != HS_OK) return status;
    hs_target path = target;
    if (target.compliance != 0.0 && !(loads.count > 0 && hs_is_alone(memory))) {
        hs_fronts fronts;
        path = hs_to_displacement(0.0);
        status = hs_no_fronts(&fronts, loads.count);
        if (status == HS_OK) status = hs_displacement_with(memory, &loads, &fronts, d, target, &path.value);
        hs_point to = {d, path.value};
        if (status == HS_OK) status = hs_note_slides_on_ramp(memory, to, &loads, &fronts);
        hs_free_fronts(&fronts);
    }
    if (status == HS_OK) status = hs_carry(memory, &loads, d, load, target, path);
    hs_free_group_loads(&loads);
    return status;
}

int hs_carry_group(hs_memory *memory, const hs_group *group, hs_losses *losses, int64_t index, double friction, hs_point from,
                   hs_point to, double load, hs_target target, hs_vertex *scratch, double *reached) {
    int64_t depth = memory->depth[index];
    if (to.d <= group->curve.gap[0]) {
        if (depth) hs_note_slides(group, depth, &from, &to, friction, HUGE_VAL, memory->steep[index]);
        if (depth) hs_lose_withdrawn(group, losses, depth, 1, &from, &to);
        memory->depth[index] = 0;
        memory->steep[index] = 0;
    } else if (depth > 0 && (memory->steep[index] || friction != group->friction)) {
        hs_cone cone = {group->friction, to.v - from.v, friction * (to.d - from.d), group->friction - friction};
        depth = hs_carry_and_clip(group, losses, depth, from, to, load, &cone, scratch, NULL);
        if (depth > memory->capacity && hs_memory_reserve(memory, 2 * depth) != HS_OK) return HS_OUT_OF_MEMORY;
        memcpy(memory->vertices + index * memory->capacity, scratch, (size_t)depth * sizeof *scratch);
        memory->depth[index] = depth;
        memory->steep[index] = (uint8_t)hs_is_steep(scratch, depth, group->friction);
    } else {
        memory->depth[index] = hs_move_group(group, losses, depth, &from, to.d, load, target, reached);
    }
    return HS_OK;
}

/* Note that all springs of a group of one asperity slide, down to a label. */
HS_APART static void slides_whole(hs_memory *memory, int64_t index, const hs_point *from, const hs_point *to, double low) {
    hs_group group = hs_group_of(memory, index);
    hs_find_slides(&group, memory->depth[index], from, to, group.friction, low, 0);
}

/* Do what `hs_move_group` mostly does to a group of one asperity: the front moves inward on one segment, or all springs slide.
 * Adds to the force, and returns 1; or 0, with nothing changed, where it is something else, such as a vertex wiped out by a
 * tie. The approach mostly is `held`. */
static int slide_one(hs_memory *memory, int64_t index, hs_losses *losses, const hs_point *from, const hs_point *to,
                        double load, int held, double *force) {
    const int64_t place = memory->contact->first[index], depth = memory->depth[index];
    const double friction = memory->friction[index], gap = memory->contact->gap[place], weight = memory->contact->weight[place];
    const double d = to->d, v = to->v;
    hs_vertex *stack = memory->vertices + index * memory->capacity, front;
    if (memory->contact->first[index + 1] > place + 1 || depth < 2) return 0;
    hs_edge edge = {depth - 1, stack[depth - 1].label, stack[depth - 1].anchor, 0.0, 0.0};
    if (held && d != edge.label) return 0;
    if (!held && d < edge.label) edge = hs_edge_at(stack, depth, d, load);
    int grows = !held && d > edge.label;
    double change = v - edge.anchor, sign = change >= 0.0 ? 1.0 : -1.0, slope = sign * friction;
    double hold = held ? 0.0 : friction * (d - edge.label), tie = HS_TIE * (fabs(v) + fabs(edge.anchor) + friction * d);
    if (grows ? fabs(change) < hold - tie : fabs(change) <= tie) {
        *force += held ? stack[depth - 1].tangential : 0.0;
        return held;
    }
    hs_slip piece = {edge.label, d, sign * change - hold, 0.0, 0.0, 0.0};
    if (grows && piece.slip_low <= tie) return 0;
    int64_t kept = edge.segment;
    for (; kept > 0; --kept) {
        double slip = sign * (v - stack[kept - 1].anchor) - friction * (d - stack[kept - 1].label);
        if (slip < -tie && stack[kept].slope != slope) break;
        if (slip <= tie) return 0;
        piece.low = stack[kept - 1].label;
        piece.slip_low = slip;
    }
    double inner_slope = stack[kept].slope;
    if (kept > 0) {
        front = stack[kept - 1];
        piece.low = hs_most(piece.low - piece.slip_low / (friction - sign * inner_slope), front.label);
        piece.slip_low = 0.0;
        if (piece.low == front.label) return 0;
        double there = hs_load_of_one(gap, weight, piece.low).load;
        front.tangential += inner_slope * (there - front.normal);
        front.normal = there;
    } else {
        inner_slope = front.normal = front.tangential = 0.0;
    }
    front = HS_MADE(hs_vertex){piece.low, v - slope * (d - piece.low), inner_slope, v, front.normal, front.tangential};
    if (piece.low <= gap && hs_is_timed(memory) && !hs_has_slid(memory, memory->contact->order[place]))
        slides_whole(memory, index, from, to, piece.low);
    double lag = 0.0;
    if (!held) {
        double whole = sign * (v - from->v) - friction * (d - from->d);
        if (whole > 0.0) lag = 0.5 * (d - from->d) / whole;
    }
    if (!held && d < from->d) {
        hs_group group = hs_group_of(memory, index);
        hs_lose_withdrawn(&group, losses, depth, edge.segment, from, to);
    }
    piece.drag_low = friction * (held ? d - piece.low : hs_most(d - piece.low - lag * piece.slip_low, 0.0));
    for (int64_t j = kept > 0 ? kept : 1; j <= edge.segment; ++j) {
        piece.high = j == edge.segment ? edge.label : stack[j].label;
        piece.slip_high = piece.slip_low + (friction - sign * stack[j].slope) * (piece.high - piece.low);
        piece.drag_high = friction * (held ? d - piece.high : hs_most(d - piece.high - lag * piece.slip_high, 0.0));
        hs_put_off(losses, gap, weight, place, memory->each, &piece);
        piece.low = piece.high;
        piece.slip_low = piece.slip_high;
        piece.drag_low = piece.drag_high;
    }
    if (grows) {
        piece.high = d;
        piece.slip_high = piece.drag_high = 0.0;
        hs_put_off(losses, gap, weight, place, memory->each, &piece);
    }
    double reached = front.tangential + slope * (load - front.normal);
    stack[kept] = front;
    stack[kept + 1] = HS_MADE(hs_vertex){d, v, slope, v, load, reached};
    memory->depth[index] = kept + 2;
    *force += reached;
    return 1;
}

int hs_carry(hs_memory *memory, const hs_group_loads *loads, double d, double load, hs_target target, hs_target path) {
    hs_point from = {memory->approach, memory->displacement};
    double reached = path.value, force = 0.0;
    int still = d == from.d && path.value == from.v && path.compliance == 0.0;
    int64_t groups = memory->contact->groups;
    int given = path.compliance == 0.0 && groups > 1;
    const hs_point to = {d, path.value};
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
        if (index >= loads->count && depth == 0) break;
        if (given && index < loads->count && !memory->steep[index]) {
            double own = loads->load[index];
            if (slide_one(memory, index, &losses, &from, &to, own, d == from.d, &force)) continue;
        }
        hs_group group = hs_group_of(memory, index);
        double own = index < loads->count ? loads->load[index] : 0.0;
        /* there is room for all that is added */
        hs_carry_group(memory, &group, &losses, index, group.friction, from, to, own, path, scratch, &reached);
        depth = memory->depth[index];
        if (depth) force += group.stack[depth - 1].tangential;
    }
    free(scratch);
    hs_settle(&losses, memory);
    memory->approach = d;
    memory->displacement = reached;
    memory->normal_load = load;
    memory->tangential_load = target.rigid == 0.0 ? target.value : force;
    if (target.rigid > 0.0 && target.compliance * load > MUCH_SOFTER * d && d > 0.0) {
        /* the drive of so soft an instrument tells the load better than the sum over the springs does, unless the contact
         * has slid so far that its displacement is rounded by more than it can be strained */
        double limit = hs_friction_limit(memory, d, load);
        memory->tangential_load = hs_within((target.value - target.rigid * reached) / target.compliance, limit);
    }
    return HS_OK;
}

void hs_note_steep(hs_memory *memory) {
    for (int64_t index = 0; index < memory->contact->groups; ++index)
        memory->steep[index] = (uint8_t)hs_is_steep(memory->vertices + index * memory->capacity, memory->depth[index],
                                                    memory->friction[index]);
}
