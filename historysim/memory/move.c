/* Move: exact update of all friction groups on one straight path in (d, V): solves for the common
 * displacement, updates the polyline of each group (README.md, theory 7), records sliding times,
 * and sums loads and losses. */

#include "move.h"
#include "scaled.h"
#include "slides.h"

/* Largest compliance of an instrument over d/P of the contact for which the load is the sum over
 * springs; beyond, the rounding of the sum would move the drive, and the load follows from the
 * drive. Chosen. */
#define MAX_COMPLIANCE_RATIO 1e6

int hs_has_single_group(const hs_line *memory) {
    return memory->contact->groups == 1 && !memory->steep[0];
}

/* A path adds a front and an edge; clipping of a polyline steeper than μ may cut each segment. */
int hs_reserve_vertices(hs_line *memory) {
    int64_t deepest = hs_max_depth(memory),
            needed = hs_has_steep(memory) ? hs_room_to_clip(deepest) : deepest + 2;
    /* little spare room for shallow stacks, so that more of them fit the cache */
    int64_t spare = memory->contact->groups > 1 && needed < 32 ? 2 : needed / 2;
    return needed > memory->capacity ? hs_line_reserve(memory, needed + spare) : HS_OK;
}

int hs_move(hs_line *memory, double d, double load, hs_target target) {
    hs_group_loads loads;
    int is_done, status = hs_press_unstrained(memory, d, load, target, &is_done);
    if (status != HS_OK || is_done) return status;
    status = hs_reserve_vertices(memory);
    if (status == HS_OK) status = hs_loads_of_groups(memory, d, load, &loads);
    if (status != HS_OK) return status;
    hs_target path = target;
    if (target.compliance != 0.0 && !(loads.count > 0 && hs_has_single_group(memory))) {
        hs_fronts fronts;
        path = hs_to_displacement(0.0);
        status = hs_init_fronts(&fronts, loads.count);
        if (status == HS_OK)
            status = hs_solve_displacement_with(memory, &loads, &fronts, d, target, &path.value);
        hs_point to = {d, path.value};
        if (status == HS_OK) status = hs_record_slides_on_ramp(memory, to, &loads, &fronts);
        hs_free_fronts(&fronts);
    }
    if (status == HS_OK) status = hs_move_with_loads(memory, &loads, d, load, target, path, NULL);
    hs_free_group_loads(&loads);
    return status;
}

int hs_move_group(hs_line *memory, const hs_group *group, hs_losses *losses, int64_t index,
                  double friction, hs_point from, hs_point to, double load, hs_target target,
                  hs_vertex *scratch, double *reached) {
    int64_t depth = memory->depth[index];
    if (to.d <= group->curve.gap[0]) {
        if (depth)
            hs_record_slides(group, depth, &from, &to, friction, HUGE_VAL, memory->steep[index]);
        if (depth) hs_add_separation_losses(group, losses, depth, 1, &from, &to);
        memory->depth[index] = 0;
        memory->steep[index] = 0;
    } else if (depth > 0 && (memory->steep[index] || friction != group->friction)) {
        hs_cone cone = {group->friction, to.v - from.v, friction * (to.d - from.d),
                        group->friction - friction};
        int64_t clipped =
            hs_move_and_clip(group, losses, depth, from, to, load, &cone, scratch, NULL);
        if (hs_is_timed(memory)) {
            double label = hs_slip_label(scratch, clipped, to.v, cone.friction);
            hs_find_slides(group, depth, &from, &to, cone.friction - cone.gain, label, 1);
        }
        if (clipped > memory->capacity && hs_line_reserve(memory, 2 * clipped) != HS_OK)
            return HS_OUT_OF_MEMORY;
        memcpy(memory->vertices + index * memory->capacity, scratch,
               (size_t)clipped * sizeof *scratch);
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

/* Record the sliding time of a group of one asperity, whose springs slide from label `low` to the
 * edge. */
HS_APART static void record_gross_slip(hs_line *memory, int64_t index, const hs_point *from,
                                       const hs_point *to, double low) {
    hs_group group = hs_group_of(memory, index);
    hs_find_slides(&group, memory->depth[index], from, to, group.friction, low, 0);
}

/* Move a group of one asperity to a displacement by the fast path, if the slip front is inside a
 * segment or all springs slide. Adds its load to `force` and returns 1; returns 0 without changes
 * in all other cases, such as ties, for `hs_solve_update`. Compiled separately for a constant
 * approach (`held`), the most frequent case. */
static HS_INLINE int slide_single(hs_line *memory, int64_t index, hs_losses *losses,
                                  const hs_point *from, const hs_point *to, double load, int held,
                                  int bowed, double *force) {
    const int64_t position = memory->contact->first[index], depth = memory->depth[index];
    const double friction = memory->friction[index], gap = memory->contact->gap[position],
                 weight = memory->contact->weight[position];
    const double d = to->d, v = to->v;
    hs_vertex *stack = memory->vertices + index * memory->capacity, front;
    if (memory->contact->first[index + 1] > position + 1 || depth < 2) return 0;
    const hs_vertex *vertex = stack + depth - 1;
    if (held && d != vertex->label) return 0;
    hs_edge edge = {depth - 1, held ? d : vertex->label, vertex->anchor, 0.0, 0.0};
    if (!held && d < edge.label) edge = hs_edge_at(stack, depth, d, load);
    const hs_single_path path = hs_single_path_to(d, v, friction, edge.label, edge.anchor, held);
    if (path.sticks) {
        *force += held ? vertex->tangential : 0.0;
        return held;
    }
    const hs_single slip_end = hs_solve_single(hs_labels_of(stack), edge.segment, &path);
    const int64_t inner_count = slip_end.inner_count;
    if (slip_end.at_vertex || (inner_count > 0 && slip_end.label == stack[inner_count - 1].label))
        return 0;
    const double sign = path.sign, slope = sign * friction;
    double inner_slope = 0.0;
    hs_slip piece = {slip_end.label, d, slip_end.slip, 0.0, 0.0, 0.0, NULL};
    hs_group group;
    if (bowed) {
        group = hs_group_of(memory, index);
        piece.bow = hs_bow_of(losses, friction, path.sign);
    }
    front.normal = front.tangential = 0.0;
    if (inner_count > 0) {
        inner_slope = stack[inner_count].slope;
        front.normal = hs_load_of_asperity(gap, weight, slip_end.label).load;
        front.tangential = stack[inner_count - 1].tangential +
                           inner_slope * (front.normal - stack[inner_count - 1].normal);
    }
    front = HS_MADE(hs_vertex){slip_end.label, v - slope * (d - slip_end.label),
                               inner_slope,    v,
                               front.normal,   front.tangential};
    if (piece.low <= gap && hs_is_timed(memory) &&
        !hs_has_slid(memory, memory->contact->order[position]))
        record_gross_slip(memory, index, from, to, piece.low);
    double lag = 0.0;
    if (!held) {
        double full_slip = sign * (v - from->v) - friction * (d - from->d);
        if (full_slip > 0.0) lag = 0.5 * (d - from->d) / full_slip;
    }
    if (!held && d < from->d) {
        hs_group separating = hs_group_of(memory, index);
        hs_add_separation_losses(&separating, losses, depth, edge.segment, from, to);
    }
    piece.drag_low =
        friction * (held ? d - piece.low : hs_max(d - piece.low - lag * piece.slip_low, 0.0));
    /* the last iteration is for springs that came into contact on the path */
    for (int64_t j = inner_count > 0 ? inner_count : 1; j <= edge.segment + path.grows; ++j) {
        piece.high = d;
        piece.slip_high = piece.drag_high = 0.0;
        if (j <= edge.segment) {
            piece.high = j == edge.segment ? edge.label : stack[j].label;
            piece.slip_high =
                piece.slip_low + (friction - sign * stack[j].slope) * (piece.high - piece.low);
            piece.drag_high =
                friction *
                (held ? d - piece.high : hs_max(d - piece.high - lag * piece.slip_high, 0.0));
        }
        if (bowed)
            hs_add_loss(&group, losses, &piece);
        else
            hs_queue_loss(losses, gap, weight, position, memory->dissipated_each, &piece);
        piece.low = piece.high;
        piece.slip_low = piece.slip_high;
        piece.drag_low = piece.drag_high;
    }
    double reached = front.tangential + slope * (load - front.normal);
    stack[inner_count] = front;
    stack[inner_count + 1] = HS_MADE(hs_vertex){d, v, slope, v, load, reached};
    memory->depth[index] = inner_count + 2;
    *force += reached;
    return 1;
}

int hs_move_with_loads(hs_line *memory, const hs_group_loads *loads, double d, double load,
                       hs_target target, hs_target path, const hs_ramp_curve *curve) {
    hs_point from = {memory->approach, memory->displacement};
    double reached = path.value, force = 0.0;
    int is_at_rest = d == from.d && path.value == from.v && path.compliance == 0.0;
    int64_t groups = memory->contact->groups;
    int is_prescribed = path.compliance == 0.0 && groups > 1;
    const hs_point to = {d, path.value};
    hs_losses losses;
    hs_vertex *scratch = NULL;
    hs_init_losses(&losses, groups, curve);
    if (is_at_rest) force = hs_total_force(memory);
    if (!is_at_rest && hs_has_steep(memory)) {
        scratch = (hs_vertex *)malloc(2 * (size_t)hs_room_to_clip(hs_max_depth(memory)) *
                                      sizeof *scratch);
        if (!scratch) return HS_OUT_OF_MEMORY;
    }
    for (int64_t index = 0; index < groups && !is_at_rest; ++index) {
        int64_t depth = memory->depth[index];
        if (index >= loads->count && depth == 0) break;
        if (is_prescribed && index < loads->count && !memory->steep[index]) {
            double group_load = loads->load[index];
            if (curve ? slide_single(memory, index, &losses, &from, &to, group_load, 0, 1, &force)
                : d == from.d
                    ? slide_single(memory, index, &losses, &from, &to, group_load, 1, 0, &force)
                    : slide_single(memory, index, &losses, &from, &to, group_load, 0, 0, &force))
                continue;
        }
        hs_group group = hs_group_of(memory, index);
        double group_load = index < loads->count ? loads->load[index] : 0.0;
        /* room is reserved, so that this cannot fail */
        hs_move_group(memory, &group, &losses, index, group.friction, from, to, group_load, path,
                      scratch, &reached);
        depth = memory->depth[index];
        if (depth) force += group.stack[depth - 1].tangential;
    }
    free(scratch);
    hs_commit_losses(&losses, memory);
    memory->approach = d;
    memory->displacement = reached;
    memory->normal_load = load;
    memory->tangential_load = target.rigid == 0.0 ? target.value : force;
    if (target.rigid > 0.0 && target.compliance * load > MAX_COMPLIANCE_RATIO * d && d > 0.0) {
        /* for so soft an instrument the load from the drive is more exact than the sum over
         * springs, unless the rounding of the displacement exceeds the elastic deflection */
        double limit = hs_friction_limit(memory, d, load);
        memory->tangential_load =
            hs_clamp((target.value - target.rigid * reached) / target.compliance, limit);
    }
    return HS_OK;
}

void hs_flag_steep(hs_line *memory) {
    for (int64_t index = 0; index < memory->contact->groups; ++index)
        memory->steep[index] = (uint8_t)hs_is_steep(memory->vertices + index * memory->capacity,
                                                    memory->depth[index], memory->friction[index]);
}
