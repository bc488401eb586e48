/* Move: all friction groups on one straight path in (d, V), from the targets of both channels: solves for the displacement that
 * the groups share, moves each by its own update (README.md, theory 7), records what first slides, and sums loads and losses. */

#include "move.h"
#include "slides.h"

/* how many times softer than the contact an instrument is for which rounding of the load would be felt at its drive */
#define MUCH_SOFTER 1e6

int hs_has_single_group(const hs_line *memory) { return memory->contact->groups == 1 && !memory->steep[0]; }

/* Have stacks hold what the next path adds: a front and an edge; a polyline steeper than μ may be cut in every segment. */
int hs_reserve_vertices(hs_line *memory) {
    int64_t deepest = hs_max_depth(memory), needed = hs_has_steep(memory) ? hs_room_to_clip(deepest) : deepest + 2;
    /* the less room there is above many shallow stacks, the more of them a cache holds */
    int64_t spare = memory->contact->groups > 1 && needed < 32 ? 2 : needed / 2;
    return needed > memory->capacity ? hs_line_reserve(memory, needed + spare) : HS_OK;
}

/* A tangential load has to be within the friction limit. */
int hs_move(hs_line *memory, double d, double load, hs_target target) {
    hs_group_loads loads;
    int status = hs_reserve_vertices(memory);
    if (status == HS_OK) status = hs_loads_of_groups(memory, d, load, &loads);
    if (status != HS_OK) return status;
    hs_target path = target;
    if (target.compliance != 0.0 && !(loads.count > 0 && hs_has_single_group(memory))) {
        hs_fronts fronts;
        path = hs_to_displacement(0.0);
        status = hs_init_fronts(&fronts, loads.count);
        if (status == HS_OK) status = hs_solve_displacement_with(memory, &loads, &fronts, d, target, &path.value);
        hs_point to = {d, path.value};
        if (status == HS_OK) status = hs_record_slides_on_ramp(memory, to, &loads, &fronts);
        hs_free_fronts(&fronts);
    }
    if (status == HS_OK) status = hs_move_with_loads(memory, &loads, d, load, target, path);
    hs_free_group_loads(&loads);
    return status;
}

int hs_move_group(hs_line *memory, const hs_group *group, hs_losses *losses, int64_t index, double friction, hs_point from,
                   hs_point to, double load, hs_target target, hs_vertex *scratch, double *reached) {
    int64_t depth = memory->depth[index];
    if (to.d <= group->curve.gap[0]) {
        if (depth) hs_record_slides(group, depth, &from, &to, friction, HUGE_VAL, memory->steep[index]);
        if (depth) hs_add_separation_losses(group, losses, depth, 1, &from, &to);
        memory->depth[index] = 0;
        memory->steep[index] = 0;
    } else if (depth > 0 && (memory->steep[index] || friction != group->friction)) {
        hs_cone cone = {group->friction, to.v - from.v, friction * (to.d - from.d), group->friction - friction};
        int64_t clipped = hs_move_and_clip(group, losses, depth, from, to, load, &cone, scratch, NULL);
        if (hs_is_timed(memory)) {
            double label = hs_slip_label(scratch, clipped, to.v, cone.friction);
            hs_find_slides(group, depth, &from, &to, cone.friction - cone.gain, label, 1);
        }
        if (clipped > memory->capacity && hs_line_reserve(memory, 2 * clipped) != HS_OK) return HS_OUT_OF_MEMORY;
        memcpy(memory->vertices + index * memory->capacity, scratch, (size_t)clipped * sizeof *scratch);
        memory->depth[index] = clipped;
        memory->steep[index] = (uint8_t)hs_is_steep(scratch, clipped, group->friction);
    } else {
        hs_update update;
        hs_solve_update(group, depth, &from, to.d, load, target, &update);
        hs_record_slides(group, update.depth, &from, &update.to, friction, update.slip_label, 0);
        memory->depth[index] = hs_apply_update(group, losses, &from, &update);
        *reached = update.to.v;
    }
    return HS_OK;
}

/* Note that all springs of a group of one asperity slide, down to a label. */
HS_APART static void slides_whole(hs_line *memory, int64_t index, const hs_point *from, const hs_point *to, double low) {
    hs_group group = hs_group_of(memory, index);
    hs_find_slides(&group, memory->depth[index], from, to, group.friction, low, 0);
}

/* Move a group of one asperity to a displacement by the fast path: the slip front moves inward on one segment, or all springs
 * slide. Add its load to `force` and return 1; return 0, with nothing changed, for all other cases, such as a tie, which
 * `hs_solve_update` handles. Compiled for a constant approach (`held`), which is the most frequent, and for others. */
static HS_INLINE int slide_one(hs_line *memory, int64_t index, hs_losses *losses, const hs_point *from, const hs_point *to,
                     double load, int held, double *force) {
    const int64_t place = memory->contact->first[index], depth = memory->depth[index];
    const double friction = memory->friction[index], gap = memory->contact->gap[place], weight = memory->contact->weight[place];
    const double d = to->d, v = to->v;
    hs_vertex *stack = memory->vertices + index * memory->capacity, front;
    if (memory->contact->first[index + 1] > place + 1 || depth < 2) return 0;
    const hs_vertex *last = stack + depth - 1;
    if (held && d != last->label) return 0;
    hs_edge edge = {depth - 1, held ? d : last->label, last->anchor, 0.0, 0.0};
    if (!held && d < edge.label) edge = hs_edge_at(stack, depth, d, load);
    const hs_single_path path = hs_single_path_to(d, v, friction, edge.label, edge.anchor, held);
    if (path.sticks) {
        *force += held ? last->tangential : 0.0;
        return held;
    }
    const hs_single end = hs_solve_single(hs_labels_of(stack), edge.segment, &path);
    const int64_t kept = end.kept;
    if (end.at_vertex || (kept > 0 && end.label == stack[kept - 1].label)) return 0;
    const double sign = path.sign, slope = sign * friction;
    double inner_slope = 0.0;
    hs_slip piece = {end.label, d, end.slip, 0.0, 0.0, 0.0};
    front.normal = front.tangential = 0.0;
    if (kept > 0) {
        inner_slope = stack[kept].slope;
        front.normal = hs_load_of_one(gap, weight, end.label).load;
        front.tangential = stack[kept - 1].tangential + inner_slope * (front.normal - stack[kept - 1].normal);
    }
    front = HS_MADE(hs_vertex){end.label, v - slope * (d - end.label), inner_slope, v, front.normal, front.tangential};
    if (piece.low <= gap && hs_is_timed(memory) && !hs_has_slid(memory, memory->contact->order[place]))
        slides_whole(memory, index, from, to, piece.low);
    double lag = 0.0;
    if (!held) {
        double whole = sign * (v - from->v) - friction * (d - from->d);
        if (whole > 0.0) lag = 0.5 * (d - from->d) / whole;
    }
    if (!held && d < from->d) {
        hs_group group = hs_group_of(memory, index);
        hs_add_separation_losses(&group, losses, depth, edge.segment, from, to);
    }
    piece.drag_low = friction * (held ? d - piece.low : hs_most(d - piece.low - lag * piece.slip_low, 0.0));
    for (int64_t j = kept > 0 ? kept : 1; j <= edge.segment; ++j) {
        piece.high = j == edge.segment ? edge.label : stack[j].label;
        piece.slip_high = piece.slip_low + (friction - sign * stack[j].slope) * (piece.high - piece.low);
        piece.drag_high = friction * (held ? d - piece.high : hs_most(d - piece.high - lag * piece.slip_high, 0.0));
        hs_queue_loss(losses, gap, weight, place, memory->dissipated_each, &piece);
        piece.low = piece.high;
        piece.slip_low = piece.slip_high;
        piece.drag_low = piece.drag_high;
    }
    if (path.grows) {
        piece.high = d;
        piece.slip_high = piece.drag_high = 0.0;
        hs_queue_loss(losses, gap, weight, place, memory->dissipated_each, &piece);
    }
    double reached = front.tangential + slope * (load - front.normal);
    stack[kept] = front;
    stack[kept + 1] = HS_MADE(hs_vertex){d, v, slope, v, load, reached};
    memory->depth[index] = kept + 2;
    *force += reached;
    return 1;
}

int hs_move_with_loads(hs_line *memory, const hs_group_loads *loads, double d, double load, hs_target target, hs_target path) {
    hs_point from = {memory->approach, memory->displacement};
    double reached = path.value, force = 0.0;
    int still = d == from.d && path.value == from.v && path.compliance == 0.0;
    int64_t groups = memory->contact->groups;
    int given = path.compliance == 0.0 && groups > 1;
    const hs_point to = {d, path.value};
    hs_losses losses;
    hs_vertex *scratch = NULL;
    hs_init_losses(&losses, groups);
    if (still) force = hs_total_force(memory);
    if (!still && hs_has_steep(memory)) {
        scratch = (hs_vertex *)malloc(2 * (size_t)hs_room_to_clip(hs_max_depth(memory)) * sizeof *scratch);
        if (!scratch) return HS_OUT_OF_MEMORY;
    }
    for (int64_t index = 0; index < groups && !still; ++index) {
        int64_t depth = memory->depth[index];
        if (index >= loads->count && depth == 0) break;
        if (given && index < loads->count && !memory->steep[index]) {
            double own = loads->load[index];
            if (d == from.d ? slide_one(memory, index, &losses, &from, &to, own, 1, &force)
                            : slide_one(memory, index, &losses, &from, &to, own, 0, &force))
                continue;
        }
        hs_group group = hs_group_of(memory, index);
        double own = index < loads->count ? loads->load[index] : 0.0;
        /* there is room for all that is added */
        hs_move_group(memory, &group, &losses, index, group.friction, from, to, own, path, scratch, &reached);
        depth = memory->depth[index];
        if (depth) force += group.stack[depth - 1].tangential;
    }
    free(scratch);
    hs_commit_losses(&losses, memory);
    memory->approach = d;
    memory->displacement = reached;
    memory->normal_load = load;
    memory->tangential_load = target.rigid == 0.0 ? target.value : force;
    if (target.rigid > 0.0 && target.compliance * load > MUCH_SOFTER * d && d > 0.0) {
        /* the drive of so soft an instrument tells the load better than the sum over the springs does, unless the contact
         * has slid so far that its displacement is rounded by more than it can be strained */
        double limit = hs_friction_limit(memory, d, load);
        memory->tangential_load = hs_clamp((target.value - target.rigid * reached) / target.compliance, limit);
    }
    return HS_OK;
}

void hs_flag_steep(hs_line *memory) {
    for (int64_t index = 0; index < memory->contact->groups; ++index)
        memory->steep[index] = (uint8_t)hs_is_steep(memory->vertices + index * memory->capacity, memory->depth[index],
                                                    memory->friction[index]);
}
