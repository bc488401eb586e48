/* Plane path: targets of a path in two tangential directions at a fraction s in [0, 1] of it, and
 * its segments, cut at lift-off of the contact and where the requested tangential load crosses the
 * friction limit.
 *
 * All targets follow from the state at the beginning of the path. Loads, drives, and the approach
 * are straight in s; with all channels controlled by loads the normal load is, instead of the
 * approach. With `saturate` the tangential load is the projection of the requested one onto |T| ≤
 * (1 - margin) limit(s) at every s (README.md, two directions 7). */

#include "rings.h"
#include "bracket.h"

/* Path fractions at which the request is compared with the limit; chosen. */
#define LIMIT_SAMPLES 16
/* Segments of one path; chosen. The final one may cross the limit more often, which its steps then
 * follow. */
#define MAX_SEGMENTS 64
/* Smallest difference of the friction limit and a tangential load, over the limit; chosen. At the
 * limit itself the displacement is undetermined. On a sphere this margin changes it by 1e-4 of full
 * slip. */
#define MIN_MARGIN 1e-6
/* Margin over the mean of ½ φ², the deficit of load of springs that are deflected at an angle φ to
 * the load; chosen. Above 1, so that a load that turns at the limit increases the margin up to the
 * tolerance. */
#define MARGIN_FACTOR 4.0
/* Relative difference at which a request and the limit are distinguished; chosen, well above
 * rounding. */
#define LIMIT_TIE 1e-9
/* Path fraction before 1 in which crossings of the limit are ignored; chosen, well above rounding.
 */
#define FRACTION_TIE 1e-12

double hs_body_limit(const hs_body *body, double approach, double fraction) {
    double limit = 0.0;
    for (int64_t c = 0; c < body->class_count; ++c) {
        const hs_ring_class *ring_class = body->classes + c;
        if (approach > hs_deepest_label(ring_class))
            limit += hs_friction_at(body, ring_class->group, fraction) *
                     hs_load_at(ring_class->curve, approach).load;
    }
    return limit;
}

/* Components controlled by load; 0 for components controlled by displacement. */
static hs_vector controlled_loads(const hs_plane_path *path, hs_vector value) {
    return HS_MADE(hs_vector){path->rigid.x > 0.0 ? 0.0 : value.x,
                              path->rigid.y > 0.0 ? 0.0 : value.y};
}

static hs_vector request_at(const hs_plane_path *path, double fraction) {
    return hs_vector_lerp(path->value[0], path->value[1], fraction);
}

static double requested_load(const hs_plane_path *path, double fraction) {
    return hs_norm(controlled_loads(path, request_at(path, fraction)));
}

static int prescribes_loads(const hs_plane_path *path) {
    return path->rigid.x == 0.0 || path->rigid.y == 0.0;
}

static double approach_at_load(const hs_body *body, double load) {
    if (load == body->normal_load) return body->approach;
    if (load <= 0.0) return hs_min(body->approach, body->contact->sorted_gap[0]);
    return hs_label_at(hs_all_of(body->contact), load, body->approach, 0.0, 1.0);
}

static void normal_target_at(const hs_body *body, const hs_plane_path *path, double fraction,
                             double *approach, double *load) {
    const double *approach_range = path->approach, *load_range = path->normal_load;
    *approach = approach_range[1];
    *load = load_range[1];
    if (fraction == 1.0) return;
    if (fraction == path->lift_off) {
        *approach = body->contact->sorted_gap[0];
        *load = 0.0;
    } else if (path->is_load_controlled && load_range[0] != load_range[1]) {
        *load = hs_toward(load_range[0], load_range[1], fraction);
        *approach = approach_at_load(body, *load);
    } else if (approach_range[0] != approach_range[1]) {
        *approach = hs_toward(approach_range[0], approach_range[1], fraction);
        *load = hs_load_at(hs_all_of(body->contact), *approach).load;
    }
}

hs_plane_target hs_target_at(const hs_body *body, const hs_plane_path *path, double fraction) {
    hs_plane_target target;
    target.fraction = fraction;
    target.time = hs_toward(path->time[0], path->time[1], fraction);
    target.is_load_controlled = path->is_load_controlled;
    target.tangential =
        HS_MADE(hs_tangential_target){request_at(path, fraction), path->rigid, path->compliance};
    normal_target_at(body, path, fraction, &target.approach, &target.normal_load);
    if (!prescribes_loads(path)) return target;
    double *value[] = {&target.tangential.value.x, &target.tangential.value.y},
           *rigid[] = {&target.tangential.rigid.x, &target.tangential.rigid.y};
    double *compliance[] = {&target.tangential.compliance.x, &target.tangential.compliance.y},
           held_value[] = {path->held_displacement.x, path->held_displacement.y};
    double max_load = (1.0 - path->margin) * hs_body_limit(body, target.approach, fraction),
           request = requested_load(path, fraction);
    for (int k = 0; k < 2; ++k) {
        if (*rigid[k] > 0.0) continue;
        if (path->holds_displacement) {
            *value[k] = held_value[k];
            *rigid[k] = 1.0;
            *compliance[k] = 0.0;
        } else if (request > max_load) {
            *value[k] *= max_load / request;
        }
    }
    return target;
}

/* Requested load minus the friction limit with its margin; negative within the limit. */
static double overload(const hs_body *body, const hs_plane_path *path, double fraction) {
    double approach, load;
    normal_target_at(body, path, fraction, &approach, &load);
    return requested_load(path, fraction) -
           (1.0 - path->margin) * hs_body_limit(body, approach, fraction);
}

/* True if the request remains within the limit with its margin. A straight request is largest at
 * fraction 0 or 1, and the limit, which is monotonic, smallest there: both extremes are compared.
 */
static int stays_within(const hs_body *body, const hs_plane_path *path) {
    double request = hs_max(requested_load(path, 0.0), requested_load(path, 1.0));
    double limit = hs_min(hs_body_limit(body, path->approach[0], 0.0),
                          hs_body_limit(body, path->approach[1], 1.0));
    return request <= (1.0 - path->margin) * limit;
}

int hs_exceeds_limit(const hs_body *body, const hs_plane_path *path, double *request,
                     double *limit) {
    if (!prescribes_loads(path) || stays_within(body, path)) return 0;
    for (int k = 1; k <= LIMIT_SAMPLES; ++k) {
        double approach, load, fraction = (double)k / LIMIT_SAMPLES;
        normal_target_at(body, path, fraction, &approach, &load);
        *request = requested_load(path, fraction);
        *limit = hs_body_limit(body, approach, fraction);
        if (*request > *limit * (1.0 + LIMIT_TIE)) return 1;
    }
    return 0;
}

hs_vector hs_excess_at(const hs_body *body, const hs_plane_path *path, double fraction) {
    const hs_vector zero = {0.0, 0.0};
    if (!prescribes_loads(path)) return zero;
    double limit = hs_body_limit(body, body->approach, fraction);
    if (requested_load(path, fraction) <= limit * (1.0 + HS_LIMIT_SLACK)) return zero;
    return controlled_loads(path,
                            hs_add_scaled(request_at(path, fraction), -1.0, body->tangential_load));
}

/* Path fraction, after `from`, at which the request crosses the limit to the side that is not
 * `is_beyond`; infinite if it does not. False position on sampled intervals. */
static double find_limit_crossing(const hs_body *body, const hs_plane_path *path, double from,
                                  int is_beyond) {
    const double sign = is_beyond ? -1.0 : 1.0;
    hs_bracket root = {from, from, sign * overload(body, path, from), 0.0, 0};
    if (root.at_low > 0.0) return from;
    for (int k = 1; k <= LIMIT_SAMPLES; ++k, root.low = root.high, root.at_low = root.at_high) {
        root.high = k == LIMIT_SAMPLES ? 1.0 : from + (1.0 - from) * ((double)k / LIMIT_SAMPLES);
        root.at_high = sign * overload(body, path, root.high);
        if (root.at_high <= 0.0) continue;
        /* path fraction; chosen, above rounding */
        while (root.high - root.low > 1e-14) {
            double trial = hs_false_position(&root), value;
            if (trial == root.low || trial == root.high) break;
            value = sign * overload(body, path, trial);
            hs_narrow(&root, trial, value, value > 0.0);
        }
        return root.high < 1.0 - FRACTION_TIE ? root.high : HUGE_VAL;
    }
    return HUGE_VAL;
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

/* Margin of the friction limit for a load beyond it: minimal if the directions of the load and of
 * all springs are constant, as in one direction. A turn at the limit itself would need an infinite
 * displacement: the margin is then up to the tolerance. */
static double choose_margin(const hs_body *body, const hs_plane_path *path, int is_beyond) {
    double meeting_fraction = is_beyond ? 0.0 : find_limit_crossing(body, path, 0.0, 0);
    if (meeting_fraction > 1.0 || (path->rigid.x > 0.0 && path->value[0].x != path->value[1].x) ||
        (path->rigid.y > 0.0 && path->value[0].y != path->value[1].y))
        return body->tolerance;
    hs_vector load = controlled_loads(path, request_at(path, meeting_fraction));
    double turn_sine = sine_between(load, controlled_loads(path, path->value[1]));
    double margin = hs_max(turn_sine, MARGIN_FACTOR * transverse_deficit(body, load));
    return hs_min(hs_max(margin, MIN_MARGIN), body->tolerance);
}

void hs_begin_segments(const hs_body *body, hs_plane_path *path) {
    const double *approach_range = path->approach, touch = body->contact->sorted_gap[0];
    path->lift_off = approach_range[0] > touch && approach_range[1] < touch
                         ? (approach_range[0] - touch) / (approach_range[0] - approach_range[1])
                         : HUGE_VAL;
    path->margin = MIN_MARGIN;
    path->remaining_segments = path->holds_displacement = path->is_beyond = 0;
    if (!path->saturate || !prescribes_loads(path)) return;
    path->margin = body->tolerance;
    if (stays_within(body, path)) return;
    path->remaining_segments = MAX_SEGMENTS;
    double initial_overload = overload(body, path, 0.0),
           limit = hs_body_limit(body, approach_range[0], 0.0);
    path->is_beyond = (fabs(initial_overload) > LIMIT_TIE * limit
                           ? initial_overload
                           : overload(body, path, 1.0 / LIMIT_SAMPLES)) > 0.0;
    path->margin = choose_margin(body, path, path->is_beyond);
}

/* True if a request beyond the limit has a constant direction between two fractions, within the
 * smallest margin. */
static int keeps_direction(const hs_plane_path *path, double from_fraction, double to_fraction) {
    hs_vector from = controlled_loads(path, request_at(path, from_fraction)),
              to = controlled_loads(path, request_at(path, to_fraction));
    return hs_dot(from, to) > 0.0 && sine_between(from, to) <= MIN_MARGIN;
}

double hs_next_cut(const hs_body *body, hs_plane_path *path, int *is_straight) {
    double from_fraction = body->fraction, to_fraction = 1.0;
    int is_beyond = path->is_beyond;
    if (path->remaining_segments > 0) {
        --path->remaining_segments;
        double crossing = find_limit_crossing(body, path, from_fraction, is_beyond);
        if (crossing <= from_fraction)
            crossing = find_limit_crossing(body, path, from_fraction, is_beyond = !is_beyond);
        path->is_beyond = crossing < 1.0 ? !is_beyond : is_beyond;
        to_fraction = hs_min(crossing, 1.0);
    }
    if (from_fraction < path->lift_off && path->lift_off < to_fraction) {
        to_fraction = path->lift_off;
        path->is_beyond = is_beyond;
    }
    *is_straight = !is_beyond || keeps_direction(path, from_fraction, to_fraction);
    double approach_from, approach_to, load;
    normal_target_at(body, path, to_fraction, &approach_to, &load);
    normal_target_at(body, path, from_fraction, &approach_from, &load);
    /* as in one direction: the limit falls, no displacement is prescribed to change, and the
     * contact slides */
    path->holds_displacement = is_beyond && *is_straight &&
                               hs_body_limit(body, approach_to, to_fraction) <
                                   hs_body_limit(body, approach_from, from_fraction) &&
                               (path->rigid.x == 0.0 || path->value[0].x == path->value[1].x) &&
                               (path->rigid.y == 0.0 || path->value[0].y == path->value[1].y);
    path->held_displacement = body->displacement;
    return to_fraction;
}
