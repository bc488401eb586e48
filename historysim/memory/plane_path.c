/* Plane path: tangential targets of a path in two directions at a fraction s in [0, 1] of it, and
 * its segments, cut at lift-off of the contact and at the friction limit (path.c).
 *
 * With `saturate` the tangential load is the projection of the requested one onto |T| ≤ (1 -
 * margin) limit(s) at every s (README.md, two directions 8). */

#include "rings.h"

/* Smallest difference of the friction limit and a tangential load, over the limit; chosen. At the
 * limit itself the displacement is undetermined. On a sphere this margin changes it by 1e-4 of full
 * slip. */
#define MIN_MARGIN 1e-6
/* Margin over the mean of ½ φ², the deficit of load of springs that are deflected at an angle φ to
 * the load; chosen. Above 1, so that a load that turns at the limit increases the margin up to the
 * tolerance. */
#define MARGIN_FACTOR 4.0
/* Path fraction in which ends of segments are not distinguished; chosen, well above rounding. */
#define FRACTION_TIE 1e-12

static double component(const hs_vector *vector, int k) { return k ? vector->y : vector->x; }

void hs_set_request(hs_plane_path *path, int end, hs_vector value) {
    path->value[end] = value;
    path->plan.request[end] = path->rigid.x > 0.0 ? 0.0 : value.x;
    path->plan.request_y[end] = path->rigid.y > 0.0 ? 0.0 : value.y;
}

double hs_body_limit(const hs_body *body, const hs_plane_path *path) {
    return hs_limit_on(path->line, &path->plan, body->fraction, body->approach, body->normal_load);
}

/* True if no displacement is prescribed to change. */
static int moves_by_loads(const hs_plane_path *path) {
    return (path->rigid.x == 0.0 || path->value[0].x == path->value[1].x) &&
           (path->rigid.y == 0.0 || path->value[0].y == path->value[1].y);
}

hs_plane_target hs_target_at(const hs_plane_path *path, double fraction) {
    const hs_plan *plan = &path->plan;
    hs_plane_target target;
    target.fraction = fraction;
    target.time = hs_toward(plan->times[0], plan->times[1], fraction);
    target.tangential = HS_MADE(hs_tangential_target){
        hs_vector_lerp(path->value[0], path->value[1], fraction), path->rigid, path->compliance};
    hs_channels_at(path->line, plan, fraction, &target.approach, &target.normal_load);
    if (fraction == path->lift_off) {
        target.approach = path->line->contact->sorted_gap[0];
        target.normal_load = 0.0;
    }
    if (!plan->tangential_by_load) return target;
    double request = hs_norm(hs_request_at(plan, fraction)),
           max_load = (1.0 - plan->margin) *
                      hs_limit_on(path->line, plan, fraction, target.approach, target.normal_load);
    double *value[] = {&target.tangential.value.x, &target.tangential.value.y},
           *rigid[] = {&target.tangential.rigid.x, &target.tangential.rigid.y};
    double *compliance[] = {&target.tangential.compliance.x, &target.tangential.compliance.y};
    for (int k = 0; k < 2; ++k) {
        if (*rigid[k] > 0.0) continue;
        if (path->holds_displacement) {
            *value[k] = component(&path->held_displacement, k);
            *rigid[k] = 1.0;
            *compliance[k] = 0.0;
        } else if (request > max_load) {
            *value[k] *= max_load / request;
        }
    }
    return target;
}

hs_vector hs_excess_of(const hs_body *body, const hs_plane_path *path) {
    hs_vector request = hs_request_at(&path->plan, body->fraction), load = body->tangential_load;
    if (!path->plan.tangential_by_load ||
        hs_norm(request) <= hs_body_limit(body, path) * (1.0 + HS_LIMIT_SLACK))
        return zero_vector;
    return HS_MADE(hs_vector){path->rigid.x > 0.0 ? 0.0 : request.x - load.x,
                              path->rigid.y > 0.0 ? 0.0 : request.y - load.y};
}

/* Sine of the angle between two loads; 0 if there is none. */
static double sine_between(hs_vector a, hs_vector b) {
    double size = hs_norm(a) * hs_norm(b);
    return size > 0.0 ? fabs(a.x * b.y - a.y * b.x) / size : 0.0;
}

/* Mean of ½ φ² over the springs, with φ the ratio of their deflection across a load to the largest
 * one that friction holds. */
static double transverse_deficit(const hs_body *body, hs_vector load) {
    double norm = hs_norm(load), deficit = 0.0, limit = 0.0;
    for (int64_t c = 0; c < body->class_count && norm > 0.0; ++c) {
        const hs_ring_class *ring_class = body->classes + c;
        const hs_node *nodes = ring_class->nodes;
        double outer_slope = 0.0, friction = hs_friction_at(body, ring_class->group, 0.0);
        for (int32_t k = ring_class->node_count - 1; k >= 1 && friction > 0.0; --k) {
            double inner_slope = outer_slope,
                   max_deflection = friction * (nodes[0].label - nodes[k].label);
            outer_slope =
                (nodes[k - 1].normal - nodes[k].normal) / (nodes[k - 1].label - nodes[k].label);
            double transverse =
                (nodes[k].deflection.x * load.y - nodes[k].deflection.y * load.x) / norm;
            deficit += 0.5 * (outer_slope - inner_slope) * transverse * transverse / max_deflection;
            limit += (outer_slope - inner_slope) * max_deflection;
        }
    }
    return limit > 0.0 ? deficit / limit : 0.0;
}

/* Segment that begins or continues at a path fraction; the number of segments if there is none. */
static int segment_at(const hs_segments *segments, int segment, double fraction) {
    while (segment < segments->count && segments->end[segment] <= fraction + FRACTION_TIE)
        ++segment;
    return segment;
}

/* Margin of the friction limit for a load beyond it: minimal if the directions of the load and of
 * all springs are constant, as in one direction. A turn at the limit itself would need an infinite
 * displacement: the margin is then up to the tolerance. */
static double choose_margin(const hs_body *body, const hs_plane_path *path) {
    const hs_segments *segments = &path->plan.segments;
    int first = segment_at(segments, 0, 0.0);
    double meeting_fraction = segments->side[first] ? 0.0 : segments->end[first];
    if (meeting_fraction >= 1.0 - FRACTION_TIE || !moves_by_loads(path)) return body->tolerance;
    hs_vector load = hs_request_at(&path->plan, meeting_fraction);
    double turn_sine = sine_between(load, hs_request_at(&path->plan, 1.0));
    double margin = hs_max(turn_sine, MARGIN_FACTOR * transverse_deficit(body, load));
    return hs_min(hs_max(margin, MIN_MARGIN), body->tolerance);
}

void hs_begin_segments(const hs_body *body, hs_plane_path *path) {
    hs_plan *plan = &path->plan;
    const double *approach = plan->approach, touch = path->line->contact->sorted_gap[0];
    path->lift_off = approach[0] > touch && approach[1] < touch
                         ? (approach[0] - touch) / (approach[0] - approach[1])
                         : HUGE_VAL;
    path->segment = path->holds_displacement = plan->segments.count = 0;
    plan->margin = MIN_MARGIN;
    if (!path->saturate || !plan->tangential_by_load) return;
    plan->margin = body->tolerance;
    hs_cut_at_limit(path->line, plan, 1, NULL);
    if (plan->segments.count == 0) return;
    plan->margin = choose_margin(body, path);
    hs_cut_at_limit(path->line, plan, 1, NULL);
}

/* True if a request beyond the limit has a constant direction between two fractions, within the
 * smallest margin. */
static int keeps_direction(const hs_plane_path *path, double from_fraction, double to_fraction) {
    hs_vector from = hs_request_at(&path->plan, from_fraction),
              to = hs_request_at(&path->plan, to_fraction);
    return hs_dot(from, to) > 0.0 && sine_between(from, to) <= MIN_MARGIN;
}

double hs_next_cut(const hs_body *body, hs_plane_path *path, int *is_straight) {
    const hs_segments *segments = &path->plan.segments;
    double from_fraction = body->fraction, to_fraction = 1.0;
    int is_beyond = 0;
    path->segment = segment_at(segments, path->segment, from_fraction);
    if (path->segment < segments->count) {
        is_beyond = segments->side[path->segment] != 0;
        if (segments->end[path->segment] < 1.0 - FRACTION_TIE)
            to_fraction = segments->end[path->segment];
    }
    if (from_fraction < path->lift_off && path->lift_off < to_fraction)
        to_fraction = path->lift_off;
    *is_straight = !is_beyond || keeps_direction(path, from_fraction, to_fraction);
    path->holds_displacement = 0;
    hs_plane_target end = hs_target_at(path, to_fraction);
    /* as in one direction: the limit falls, no displacement is prescribed to change, and the
     * contact slides */
    path->holds_displacement = is_beyond && *is_straight && moves_by_loads(path) &&
                               hs_limit_on(path->line, &path->plan, to_fraction, end.approach,
                                           end.normal_load) < hs_body_limit(body, path);
    path->held_displacement = body->displacement;
    return to_fraction;
}
