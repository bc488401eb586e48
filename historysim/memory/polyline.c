/* Polyline: exact update of the history w(a) of one group on one straight path in (d, V) to a
 * target, in closed form per segment (README.md, theory 7): solved first, then applied.
 *
 * As dw = m da and dT = m dP along the polyline, r w + c T as a function of r a + c P(a) is a
 * polyline with the same slopes m, within the same cone: one update serves a displacement (r = 1, c
 * = 0), a load (r = 0, c = 1) and the displacement of a drive behind a spring of compliance c (r =
 * 1). */

#include "polyline.h"

/* Smallest length of the outer of three segments, over that of the middle one, that are merged to
 * two; chosen. */
#define MIN_NEW_LENGTH 0.25

/* Start the empty stack of a group at first contact on a straight path; returns its depth. */
static int64_t start_stack(const hs_group *group, hs_point from, hs_point to) {
    double h = group->curve.gap[0];
    double anchor = from.v;
    if (h > from.d) anchor += (to.v - from.v) * (h - from.d) / (to.d - from.d);
    group->stack[0] = HS_MADE(hs_vertex){h, anchor, 0.0, anchor, 0.0, 0.0};
    return 1;
}

hs_edge hs_edge_at(const hs_vertex *stack, int64_t depth, double d, double load) {
    const hs_vertex *vertex = stack + depth - 1;
    if (d >= vertex->label)
        return HS_MADE(hs_edge){depth - 1, vertex->label, vertex->anchor, vertex->normal,
                                vertex->tangential};
    const int64_t segment = hs_cut_segment(hs_labels_of(stack), depth, d);
    vertex = stack + segment;
    return HS_MADE(hs_edge){segment, d, vertex->anchor - vertex->slope * (vertex->label - d), load,
                            vertex->tangential - vertex->slope * (vertex->normal - load)};
}

/* Add the losses of the springs between the slip front and the edge d1 on a straight path.
 *
 * While spring a slips by g up to approach d1, its mean deflection is μ (d1 - a - g Δd/(2 G)),
 * where G is the slip of a spring that slips on the full path. */
static void add_slip_losses(const hs_group *group, hs_losses *losses, const hs_point *from,
                            const hs_update *update) {
    const hs_edge *edge = &update->edge;
    const hs_point *to = &update->to;
    double friction = group->friction, sign = update->sign;
    double full_slip = sign * (to->v - from->v) - friction * (to->d - from->d);
    double lag = full_slip > 0.0 ? 0.5 * (to->d - from->d) / full_slip : 0.0;
    hs_slip piece;
    piece.bow = hs_bow_of(losses, friction, sign);
    piece.low = update->front.label;
    piece.slip_low = update->slip;
    piece.drag_low = friction * hs_max(to->d - piece.low - lag * update->slip, 0.0);
    /* the last iteration is for the springs that came into contact on the path and slip immediately
     */
    for (int64_t j = update->inner_count > 1 ? update->inner_count : 1; j <= edge->segment + 1;
         ++j) {
        if (j > edge->segment) {
            piece.high = to->d;
            piece.slip_high = 0.0;
            piece.drag_high = 0.0;
        } else {
            piece.high = j == edge->segment ? edge->label : group->stack[j].label;
            piece.slip_high = piece.slip_low +
                              (friction - sign * group->stack[j].slope) * (piece.high - piece.low);
            piece.drag_high = friction * hs_max(to->d - piece.high - lag * piece.slip_high, 0.0);
        }
        if (piece.high > piece.low) hs_add_loss(group, losses, &piece);
        piece.low = piece.high;
        piece.slip_low = piece.slip_high;
        piece.drag_low = piece.drag_high;
    }
}

/* Compute the vertex at the slip front and the displacement of a group with slipping springs, from
 * the front in x. */
static void solve_slip(const hs_group *group, hs_target target, hs_update *update) {
    const hs_vertex *stack = group->stack;
    int64_t inner_count = update->inner_count;
    double rigid = target.rigid, compliance = target.compliance,
           slope = update->sign * group->friction;
    double d1 = update->to.d, load = update->load;
    hs_vertex front = stack[inner_count > 1 ? inner_count - 1 : 0];
    update->makes_vertex =
        inner_count > 0 && update->x != rigid * front.label + compliance * front.normal;
    update->inner_slope = 0.0;
    if (update->makes_vertex) {
        double label = update->x;
        update->inner_slope = stack[inner_count].slope;
        if (compliance > 0.0) {
            double outer =
                inner_count == update->edge.segment ? update->edge.label : stack[inner_count].label;
            double total = update->x - rigid * group->curve.gap[0];
            label = hs_label_at(group->curve, total, outer, rigid, compliance);
            label = hs_min(hs_max(label, front.label), outer);
        }
        hs_load front_load = {update->x, HUGE_VAL};
        if (rigid != 0.0) {
            front_load = hs_load_at(group->curve, label);
            if (group->single) {
                group->single->known_label = label;
                group->single->known_slope = front_load.slope;
            }
        }
        front.anchor += update->inner_slope * (label - front.label);
        front.tangential += update->inner_slope * (front_load.load - front.normal);
        front.label = label;
        front.normal = front_load.load;
        /* computed from the target, so that rounding does not accumulate over nested loops;
         * assigned to anchor or load, whichever changes faster along the polyline */
        double y =
            target.value - slope * (rigid * (d1 - label) + compliance * (load - front_load.load));
        if (rigid >= compliance * front_load.slope)
            front.anchor = y - compliance * front.tangential;
        else
            front.tangential = (y - rigid * front.anchor) / compliance;
    }
    update->to.v = target.value;
    if (compliance != 0.0)
        update->to.v =
            front.anchor + slope * (d1 - front.label) + rigid * update->sign * update->slip;
    if (inner_count == 0) {
        front.anchor = update->to.v - slope * (d1 - front.label);
        front.normal = front.tangential = 0.0;
    }
    update->front = front;
    update->slip_label = front.label;
    update->slope = slope;
    update->force = rigid == 0.0 ? target.value : front.tangential + slope * (load - front.normal);
}

/* Displacement of a group at first contact on a straight path: w(a) has one slope, that of the path
 * or of the cone. */
static double displacement_of_first_contact(const hs_group *group, const hs_point *from, double d1,
                                            double load, hs_target target) {
    if (target.compliance == 0.0) return target.value;
    double slope = (target.value - target.rigid * from->v) /
                   (target.rigid * (d1 - from->d) + target.compliance * load);
    if (target.rigid > 0.0 && fabs(slope) > group->friction)
        return target.value - target.compliance * copysign(group->friction * load, slope);
    return from->v + slope * (d1 - from->d);
}

void hs_solve_update(const hs_group *group, int64_t depth, const hs_point *from, double d1,
                     double load, hs_target target, hs_update *update) {
    const hs_vertex *stack = group->stack;
    double friction = group->friction, y1 = target.value, rigid = target.rigid,
           compliance = target.compliance;
    if (depth == 0) {
        hs_point to = {d1, displacement_of_first_contact(group, from, d1, load, target)};
        depth = start_stack(group, *from, to);
    }
    update->depth = depth;
    update->load = load;
    update->to.d = d1;
    update->edge = hs_edge_at(stack, depth, d1, load);
    const hs_edge edge = update->edge;
    double x1 = rigid * d1 + compliance * load,
           x_edge = rigid * edge.label + compliance * edge.normal;
    double y_edge = rigid * edge.anchor + compliance * edge.tangential;
    const hs_single_path path = hs_single_path_to(x1, y1, friction, x_edge, y_edge, 0);
    double change = fabs(y1 - y_edge), hold = friction * (x1 - x_edge);
    /* at the edge itself rounding is no reason to slip; new springs slip when they tie with the
     * limit */
    update->slips = y1 != y_edge && (x1 == x_edge ? change > path.tie : change >= hold - path.tie);
    if (update->slips) {
        hs_labels labels = hs_labels_of(stack);
        labels.rigid = rigid;
        labels.compliance = compliance;
        const hs_single front = hs_solve_single(labels, edge.segment, &path);
        update->sign = path.sign;
        update->inner_count = front.inner_count;
        update->x = front.label;
        update->slip = front.slip;
        solve_slip(group, target, update);
        return;
    }
    double slope = x1 > x_edge ? (y1 - y_edge) / (x1 - x_edge) : 0.0;
    update->slip_label = HUGE_VAL;
    update->slope = slope;
    update->to.v = compliance == 0.0 ? y1 : edge.anchor + slope * (d1 - edge.label);
    update->force = rigid == 0.0 ? y1 : edge.tangential + slope * (load - edge.normal);
}

int64_t hs_apply_update(const hs_group *group, hs_losses *losses, const hs_point *from,
                        const hs_update *update) {
    hs_vertex *stack = group->stack;
    const hs_edge *edge = &update->edge;
    double d1 = update->to.d, v1 = update->to.v;
    int64_t top = edge->segment;
    if (d1 < from->d)
        hs_add_separation_losses(group, losses, update->depth, top, from, &update->to);
    if (update->slips) {
        add_slip_losses(group, losses, from, update);
        const hs_vertex *front = &update->front;
        top = update->inner_count;
        if (top == 0 || update->makes_vertex)
            stack[top++] = HS_MADE(hs_vertex){front->label, front->anchor, update->inner_slope,
                                              v1,           front->normal, front->tangential};
    } else if (d1 < from->d) {
        stack[top] = HS_MADE(hs_vertex){d1, edge->anchor, stack[top].slope,
                                        v1, update->load, edge->tangential};
        return top + 1;
    } else if (d1 > edge->label) {
        top += top == 0 || stack[top].slope != update->slope;
    } else {
        return update->depth;
    }
    stack[top] = HS_MADE(hs_vertex){d1, v1, update->slope, v1, update->load, update->force};
    return top + 1;
}

/* Cache the segment that contains the slip front, above `inner_count` vertices (0 if all springs
 * slide). Returns 1 if cached: for groups of one asperity among several groups. */
static int cache_front(hs_fronts *fronts, int64_t index, const hs_group *group, int64_t depth,
                       int64_t inner_count, double sign) {
    int64_t segment = inner_count > 1 ? inner_count : 1;
    if (group->curve.count > 1 || fronts->groups == 1 || segment >= depth) return 0;
    const hs_vertex *low = group->stack + segment - 1, *high = low + 1;
    double slope = high->slope;
    double jump = -sign * hs_max(group->friction - sign * slope, 0.0);
    if (jump == 0.0 && inner_count > 0) return 0;
    fronts->cone[index] = sign * group->friction;
    fronts->below[index] = low->label;
    fronts->anchor[index] = low->anchor;
    fronts->jump[index] = jump;
    fronts->rate[index] = jump != 0.0 ? 1.0 / jump : -sign * HS_MAX_RATE;
    fronts->force[index] = low->tangential - slope * low->normal;
    fronts->low[index] = segment > 1 ? low->label : -HUGE_VAL;
    fronts->high[index] = high->label;
    fronts->gap[index] = group->curve.gap[0];
    fronts->weight[index] = group->curve.weight[0];
    return 1;
}

void hs_guess_front(hs_fronts *fronts, int64_t index, const hs_group *group, int64_t depth,
                    double sign) {
    int slides = group->stack[depth - 1].slope == sign * group->friction;
    cache_front(fronts, index, group, depth, slides ? depth - 2 : depth - 1, sign);
}

hs_force hs_force_of_group(const hs_group *group, int64_t depth, hs_point from, hs_point to,
                           double load, hs_fronts *fronts, int64_t index) {
    hs_vertex touch_vertex;
    hs_group touching = *group;
    double friction = group->friction;
    hs_force cached = {0.0, 0.0, 0.0};
    if (depth == 0) {
        touching.stack = &touch_vertex;
        depth = start_stack(&touching, from, to);
    }
    const hs_vertex *stack = touching.stack;
    hs_edge edge = hs_edge_at(stack, depth, to.d, load);
    if (to.d > edge.label && fabs(to.v - edge.anchor) <= friction * (to.d - edge.label)) {
        double slope = (to.v - edge.anchor) / (to.d - edge.label);
        return HS_MADE(hs_force){edge.tangential + slope * (load - edge.normal),
                                 (load - edge.normal) / (to.d - from.d), 0.0};
    }
    if (to.v == edge.anchor) {
        return HS_MADE(hs_force){edge.tangential, hs_load_at(group->curve, edge.label).slope, 0.0};
    }
    hs_single_path path = hs_single_path_to(to.d, to.v, friction, edge.label, edge.anchor, 0);
    hs_single front = hs_solve_single(hs_labels_of(stack), edge.segment, &path);
    if (cache_front(fronts, index, &touching, depth, front.inner_count, path.sign)) return cached;
    double slope = path.sign * friction;
    if (front.inner_count == 0) {
        return HS_MADE(hs_force){slope * load, 0.0, 0.0};
    }
    hs_load front_load = hs_load_at(group->curve, front.label);
    const hs_vertex *low = stack + front.inner_count - 1;
    hs_force result = {low->tangential, front_load.slope, 0.0};
    if (front.label != low->label) {
        double inner_slope = stack[front.inner_count].slope;
        result.force += inner_slope * (front_load.load - low->normal);
        /* P'' is approximated by the deepest asperity alone; affects only the rate of convergence
         */
        result.curvature =
            0.5 * front_load.slope / ((front.label - group->curve.gap[0]) * (inner_slope - slope));
    }
    result.force += slope * (load - front_load.load);
    return result;
}

int hs_is_steep(const hs_vertex *stack, int64_t depth, double friction) {
    for (int64_t j = 1; j < depth; ++j)
        if (fabs(stack[j].slope) > friction) return 1;
    return 0;
}

/* Replace the two inner vertices of four adjacent ones by their midpoint, with the anchor that
 * preserves the load of the outermost; returns 0 if loads between would change by more than the
 * tolerances.
 *
 * With deviations e from the chord of the outer two, and quotients q = ΔP/Δa of segments, the load
 * is that of the chord plus the sum of e (q_below - q_above) over the inner vertices. */
static int merge_pair(const hs_group *group, hs_vertex *vertex, double limit_tolerance,
                      double variation_tolerance) {
    const hs_vertex *low = vertex, *high = vertex + 3;
    const double length = high->label - low->label,
                 chord_slope = (high->anchor - low->anchor) / length;
    double deviation[2], stiffness[3], variation = 0.0, max_slope = 0.0;
    /* repeated merges lengthen segments by a constant factor, so that errors form a geometric
     * series */
    if (high->label - vertex[2].label < MIN_NEW_LENGTH * (vertex[2].label - low->label)) return 0;
    for (int k = 0; k < 3; ++k) {
        double load = vertex[k + 1].normal - vertex[k].normal;
        stiffness[k] = load / (vertex[k + 1].label - vertex[k].label);
        variation += fabs(vertex[k + 1].slope) * load;
        max_slope = hs_max(max_slope, fabs(vertex[k + 1].slope));
    }
    for (int k = 0; k < 2; ++k)
        deviation[k] =
            vertex[k + 1].anchor - low->anchor - chord_slope * (vertex[k + 1].label - low->label);
    const double limit = group->friction * (high->normal - low->normal),
                 stiffness_rise = stiffness[2] - stiffness[0];
    const double max_load_error =
        0.5 * hs_min(limit_tolerance * limit, variation_tolerance * variation);
    if (fabs(deviation[0] - deviation[1]) * stiffness_rise > max_load_error) return 0;
    hs_vertex merged = vertex[2];
    merged.label = 0.5 * (vertex[1].label + vertex[2].label);
    merged.normal = hs_load_at(group->curve, merged.label).load;
    const double below = merged.label - low->label, above = high->label - merged.label;
    const double jump =
        (merged.normal - low->normal) / below - (high->normal - merged.normal) / above;
    double load_moment =
        deviation[0] * (stiffness[0] - stiffness[1]) + deviation[1] * (stiffness[1] - stiffness[2]);
    if (!(jump < 0.0)) return 0;
    const double deviation_at_merged = load_moment / jump;
    double difference = fabs(deviation_at_merged - 0.5 * (deviation[0] + deviation[1]));
    difference =
        hs_max(difference,
               fabs(deviation_at_merged * (vertex[1].label - low->label) / below - deviation[0]));
    difference =
        hs_max(difference,
               fabs(deviation_at_merged * (high->label - vertex[2].label) / above - deviation[1]));
    if (!(difference * stiffness_rise <= max_load_error)) return 0;
    const double inner_slope = chord_slope + deviation_at_merged / below,
                 outer_slope = chord_slope - deviation_at_merged / above;
    /* slopes of a convex part stay within the previous bounds, except for the rounding of anchors
     */
    const double rounding =
        HS_TIE * (fabs(low->anchor) + fabs(high->anchor)) / hs_min(below, above);
    if (hs_max(fabs(inner_slope), fabs(outer_slope)) > max_slope + rounding) return 0;
    merged.slope = hs_clamp(inner_slope, max_slope);
    merged.anchor = low->anchor + chord_slope * below + deviation_at_merged;
    merged.tangential = low->tangential + merged.slope * (merged.normal - low->normal);
    vertex[1] = merged;
    vertex[2] = *high;
    vertex[2].slope = hs_clamp(outer_slope, max_slope);
    return 1;
}

int64_t hs_merge_vertices(const hs_group *group, int64_t depth, double limit_tolerance,
                          double variation_tolerance) {
    hs_vertex *stack = group->stack;
    int64_t count = 0;
    for (int64_t j = 0; j + 1 < depth; ++j) {
        stack[count++] = stack[j];
        while (count > 3 &&
               merge_pair(group, stack + count - 4, limit_tolerance, variation_tolerance))
            --count;
    }
    if (depth > 0) stack[count++] = stack[depth - 1];
    return count;
}

/* Label at which v, linear from v_low to v_high, crosses side·(d - a); `high` if there is no
 * crossing inside. */
static double crossing(double low, double high, double v_low, double v_high, double d,
                       double side) {
    double over_low = v_low - side * (d - low), over_high = v_high - side * (d - high);
    double tie = HS_TIE * (fabs(v_low) + fabs(side) * d);
    if (over_low * over_high >= 0.0 || hs_min(fabs(over_low), fabs(over_high)) <= tie) return high;
    return low + (high - low) * over_low / (over_low - over_high);
}

/* Mean deflection of a spring while it slips; displacement and limit are linear on the path. */
static double mean_drag(double limit, double slip, double moved, double growth) {
    /* slip of a spring that slips on the full path */
    double full_slip = moved - growth;
    return full_slip > 0.0 ? hs_max(limit - 0.5 * growth * slip / full_slip, 0.0) : limit;
}

/* Copy the polyline of a group in contact to `target`, cut or extended by new springs, before slip;
 * returns its depth. */
static int64_t extend_polyline(const hs_group *group, int64_t depth, hs_point to, double load,
                               hs_vertex *target, int64_t *segment) {
    hs_edge edge = hs_edge_at(group->stack, depth, to.d, load);
    *segment = edge.segment;
    memcpy(target, group->stack, (size_t)(edge.segment + 1) * sizeof *target);
    if (to.d <= edge.label) {
        target[edge.segment] = HS_MADE(hs_vertex){to.d, edge.anchor, target[edge.segment].slope,
                                                  to.v, load,        edge.tangential};
        return edge.segment + 1;
    }
    double slope = (to.v - edge.anchor) / (to.d - edge.label);
    target[edge.segment + 1] = HS_MADE(hs_vertex){
        to.d, to.v, slope, to.v, load, edge.tangential + slope * (load - edge.normal)};
    return edge.segment + 2;
}

/* Clip a polyline of any slopes to the cone |v| ≤ μ (d - a), which both sides may cut in every
 * segment. */
static int64_t clip(const hs_group *group, hs_losses *losses, const hs_vertex *stack, int64_t depth,
                    hs_point at, const hs_cone *cone, hs_vertex *clipped, double *stiffness) {
    double d = at.d, friction = cone->friction;
    clipped[0] = stack[0];
    double limit = friction * (d - stack[0].label), v = at.v - stack[0].anchor;
    if (fabs(v) > limit) clipped[0].anchor = at.v - copysign(limit, v);
    int64_t count = 1;
    for (int64_t j = 1; j < depth; ++j) {
        double slope = stack[j].slope, low = stack[j - 1].label, high = stack[j].label;
        double v_low = at.v - stack[j - 1].anchor, v_high = at.v - stack[j].anchor;
        double lower = crossing(low, high, v_low, v_high, d, -friction);
        double upper = crossing(low, high, v_low, v_high, d, friction);
        double cut[4] = {low, hs_min(lower, upper), hs_max(lower, upper), high};
        for (int piece = 0; piece < 3; ++piece) {
            double a = cut[piece], b = cut[piece + 1];
            if (b <= a) continue;
            double v_a = v_low - slope * (a - low), v_b = v_low - slope * (b - low);
            double limit_a = friction * (d - a), limit_b = friction * (d - b);
            double load = b == high ? stack[j].normal : hs_load_at(group->curve, b).load;
            double made_at = at.v, new_slope = slope;
            v = v_b;
            if (fabs(v_a + v_b) > limit_a + limit_b) {
                double side = copysign(1.0, v_a + v_b);
                new_slope = side * friction;
                v = side * limit_b;
                if (losses) {
                    hs_slip slip = {a,
                                    b,
                                    hs_max(side * v_a - limit_a, 0.0),
                                    hs_max(side * v_b - limit_b, 0.0),
                                    0.0,
                                    0.0,
                                    hs_bow_of(losses, friction, side)};
                    double moved = side * cone->moved;
                    slip.drag_low =
                        mean_drag(limit_a, slip.slip_low, moved, cone->rise + cone->gain * (d - a));
                    slip.drag_high = mean_drag(limit_b, slip.slip_high, moved,
                                               cone->rise + cone->gain * (d - b));
                    hs_add_loss(group, losses, &slip);
                }
            } else {
                if (stiffness)
                    *stiffness +=
                        hs_load_at(group->curve, b).slope - hs_load_at(group->curve, a).slope;
                if (b == high) made_at = stack[j].made_at;
            }
            /* a segment of the width of rounding */
            if (count > 1 && b - a <= HS_TIE * d) new_slope = clipped[count - 1].slope;
            if (count > 1 && clipped[count - 1].slope == new_slope) --count;
            double force =
                clipped[count - 1].tangential + new_slope * (load - clipped[count - 1].normal);
            clipped[count++] = HS_MADE(hs_vertex){b, at.v - v, new_slope, made_at, load, force};
        }
    }
    return count;
}

int64_t hs_move_and_clip(const hs_group *group, hs_losses *losses, int64_t depth, hs_point from,
                         hs_point to, double load, const hs_cone *cone, hs_vertex *scratch,
                         double *stiffness) {
    hs_vertex *stack = scratch + hs_room_to_clip(depth);
    int64_t segment, count = extend_polyline(group, depth, to, load, stack, &segment);
    if (losses && to.d < from.d)
        hs_add_separation_losses(group, losses, depth, segment, &from, &to);
    return clip(group, losses, stack, count, to, cone, scratch, stiffness);
}
