/* Polylines steeper than the cone, as a fall of μ leaves them: several zones may slip at once. */

#include "internal.h"

int hs_is_steep(const hs_vertex *stack, int64_t depth, double friction) {
    for (int64_t j = 1; j < depth; ++j)
        if (fabs(stack[j].slope) > friction) return 1;
    return 0;
}

/* Label where v, straight from v_low to v_high, crosses side·(d - a); `high` where that is not inside. */
static double crossing(double low, double high, double v_low, double v_high, double d, double side) {
    double over_low = v_low - side * (d - low), over_high = v_high - side * (d - high);
    double tie = HS_TIE * (fabs(v_low) + fabs(side) * d);
    if (over_low * over_high >= 0.0 || hs_least(fabs(over_low), fabs(over_high)) <= tie) return high;
    return low + (high - low) * over_low / (over_low - over_high);
}

/* Mean deflection of a spring while it slips: it was moved straight, and its limit grew straight. */
static double mean_drag(double limit, double slip, double moved, double growth) {
    /* slip of a spring that slips all the way */
    double whole = moved - growth;
    return whole > 0.0 ? hs_most(limit - 0.5 * growth * slip / whole, 0.0) : limit;
}

/* Carry the polyline of a touching group before any slip to `target`: cut, or extended by new springs; its depth. */
static int64_t carried(const hs_group *group, int64_t depth, hs_point to, double load, hs_vertex *target,
                       int64_t *segment) {
    hs_edge edge = hs_edge_at(group->stack, depth, to.d, load);
    *segment = edge.segment;
    memcpy(target, group->stack, (size_t)(edge.segment + 1) * sizeof *target);
    if (to.d <= edge.label) {
        target[edge.segment] =
            hs_vertex_of(to.d, edge.anchor, target[edge.segment].slope, to.v, load, edge.tangential);
        return edge.segment + 1;
    }
    double slope = (to.v - edge.anchor) / (to.d - edge.label);
    target[edge.segment + 1] =
        hs_vertex_of(to.d, to.v, slope, to.v, load, edge.tangential + slope * (load - edge.normal));
    return edge.segment + 2;
}

/* Clip any polyline to the cone |v| ≤ μ (d - a): both sides may cut, anywhere. */
static int64_t clip(const hs_group *group, hs_losses *losses, const hs_vertex *stack, int64_t depth, hs_point at,
                    const hs_cone *cone, hs_vertex *clipped, double *stiffness) {
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
        double cut[4] = {low, hs_least(lower, upper), hs_most(lower, upper), high};
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
                    hs_slip slip = {a, b, hs_most(side * v_a - limit_a, 0.0), hs_most(side * v_b - limit_b, 0.0), 0.0,
                                    0.0};
                    double moved = side * cone->moved;
                    slip.drag_low = mean_drag(limit_a, slip.slip_low, moved, cone->rise + cone->gain * (d - a));
                    slip.drag_high = mean_drag(limit_b, slip.slip_high, moved, cone->rise + cone->gain * (d - b));
                    hs_lose(group, losses, &slip);
                }
            } else {
                if (stiffness) *stiffness += hs_load_at(group->curve, b).slope - hs_load_at(group->curve, a).slope;
                if (b == high) made_at = stack[j].made_at;
            }
            /* cut off by rounding alone */
            if (count > 1 && b - a <= HS_TIE * d) new_slope = clipped[count - 1].slope;
            if (count > 1 && clipped[count - 1].slope == new_slope) --count;
            double force = clipped[count - 1].tangential + new_slope * (load - clipped[count - 1].normal);
            clipped[count++] = hs_vertex_of(b, at.v - v, new_slope, made_at, load, force);
        }
    }
    return count;
}

int64_t hs_carry_and_clip(const hs_group *group, hs_losses *losses, int64_t depth, hs_point from, hs_point to,
                          double load, const hs_cone *cone, hs_vertex *scratch, double *stiffness) {
    hs_vertex *stack = scratch + hs_room_to_clip(depth);
    int64_t segment, count = carried(group, depth, to, load, stack, &segment);
    if (losses && to.d < from.d) hs_lose_withdrawn(group, losses, depth, segment, &from, &to);
    count = clip(group, losses, stack, count, to, cone, scratch, stiffness);
    if (losses && hs_is_timed(group->memory)) {
        int slides = hs_sliding_side(scratch, count, count - 1, to.v, cone->friction) != 0.0;
        double label = slides ? scratch[count - 2].label : HUGE_VAL;
        hs_find_slides(group, depth, &from, &to, cone->friction - cone->gain, label, 1);
    }
    return count;
}
