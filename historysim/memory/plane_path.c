/* Plane path: where a path in two tangential directions leads at a fraction s in [0, 1] of it, and its segments, cut where the last
 * spring lifts off and where the tangential load meets the friction limit, or comes back from it.
 *
 * All targets follow from the state at the beginning of the path. Loads, drives, and the approach are straight in s; with all
 * channels controlled by loads the normal load is, instead of the approach. With `saturate` the tangential load is the projection
 * of the requested one onto |T| ≤ (1 - margin) limit(s) at every s (README.md, two directions 7). */

#include "rings.h"
#include "bracket.h"

/* path fractions at which it is looked whether the limit is met; chosen */
#define LOOKS 16
/* segments of one path; the last one may meet the limit more often, which its steps then follow; chosen */
#define MOST_SEGMENTS 64
/* Least part of the friction limit between it and a tangential load: at the limit itself the displacement is open. On a sphere it
 * takes 1e-4 of the displacement at which everything slides; chosen. */
#define LEAST_MARGIN 1e-6
/* Margin over the mean of ½ φ², the part of the limit by which springs miss it that are deflected at an angle φ to the load. Above
 * 1, so that a load which turns at the limit widens the margin up to the tolerance; chosen. */
#define MARGIN_OF_SPREAD 4.0
/* relative difference by which requests and limits are told apart; chosen, well above rounding */
#define LIMIT_TIE 1e-9
/* path fraction next to 1 in which no change of side is looked for; chosen, well above rounding */
#define FRACTION_TIE 1e-12

double hs_body_limit(const hs_body *body, double approach, double fraction) {
    double limit = 0.0;
    for (int64_t c = 0; c < body->classes; ++c) {
        const hs_class *part = body->parts + c;
        if (approach > hs_deepest_of(part))
            limit += hs_coefficient(body, part->group, fraction) * hs_load_at(part->curve, approach).load;
    }
    return limit;
}

/* Components of a vector that are controlled by load, 0 for the others. */
static hs_vector loads_of(const hs_plane_path *path, hs_vector value) {
    return HS_MADE(hs_vector){path->rigid.x > 0.0 ? 0.0 : value.x, path->rigid.y > 0.0 ? 0.0 : value.y};
}

static hs_vector value_at(const hs_plane_path *path, double fraction) {
    return hs_between(path->value[0], path->value[1], fraction);
}

static double requested_load(const hs_plane_path *path, double fraction) {
    return hs_length(loads_of(path, value_at(path, fraction)));
}

static int prescribes_loads(const hs_plane_path *path) { return path->rigid.x == 0.0 || path->rigid.y == 0.0; }

static double approach_for(const hs_body *body, double load) {
    if (load == body->normal_load) return body->approach;
    if (load <= 0.0) return hs_least(body->approach, body->contact->sorted_gap[0]);
    return hs_label_at(hs_all_of(body->contact), load, body->approach, 0.0, 1.0);
}

static void normal_target_at(const hs_body *body, const hs_plane_path *path, double fraction, double *approach, double *load) {
    const double *d = path->approach, *n = path->normal_load;
    *approach = d[1];
    *load = n[1];
    if (fraction == 1.0) return;
    if (fraction == path->lift_off) {
        *approach = body->contact->sorted_gap[0];
        *load = 0.0;
    } else if (path->by_loads && n[0] != n[1]) {
        *load = hs_toward(n[0], n[1], fraction);
        *approach = approach_for(body, *load);
    } else if (d[0] != d[1]) {
        *approach = hs_toward(d[0], d[1], fraction);
        *load = hs_load_at(hs_all_of(body->contact), *approach).load;
    }
}

hs_plane_target hs_target_at(const hs_body *body, const hs_plane_path *path, double fraction) {
    hs_plane_target found;
    found.fraction = fraction;
    found.time = hs_toward(path->time[0], path->time[1], fraction);
    found.by_loads = path->by_loads;
    found.aim = HS_MADE(hs_plane_aim){value_at(path, fraction), path->rigid, path->compliance};
    normal_target_at(body, path, fraction, &found.approach, &found.normal_load);
    if (!prescribes_loads(path)) return found;
    double *value[] = {&found.aim.value.x, &found.aim.value.y}, *rigid[] = {&found.aim.rigid.x, &found.aim.rigid.y};
    double *compliance[] = {&found.aim.compliance.x, &found.aim.compliance.y}, held[] = {path->held.x, path->held.y};
    double most = (1.0 - path->margin) * hs_body_limit(body, found.approach, fraction), size = requested_load(path, fraction);
    for (int k = 0; k < 2; ++k) {
        if (*rigid[k] > 0.0) continue;
        if (path->is_held) {
            *value[k] = held[k];
            *rigid[k] = 1.0;
            *compliance[k] = 0.0;
        } else if (size > most) {
            *value[k] *= most / size;
        }
    }
    return found;
}

/* Requested load beyond the friction limit less its margin; negative within it. */
static double overload(const hs_body *body, const hs_plane_path *path, double fraction) {
    double approach, load;
    normal_target_at(body, path, fraction, &approach, &load);
    return requested_load(path, fraction) - (1.0 - path->margin) * hs_body_limit(body, approach, fraction);
}

/* True if the request stays within the limit less its margin: its ends do, where a straight request is largest, even if the limit,
 * which is monotonic, is the lower one of both ends. */
static int stays_within(const hs_body *body, const hs_plane_path *path) {
    double size = hs_most(requested_load(path, 0.0), requested_load(path, 1.0));
    double limit = hs_least(hs_body_limit(body, path->approach[0], 0.0), hs_body_limit(body, path->approach[1], 1.0));
    return size <= (1.0 - path->margin) * limit;
}

int hs_exceeds_limit(const hs_body *body, const hs_plane_path *path, double *request, double *limit) {
    if (!prescribes_loads(path) || stays_within(body, path)) return 0;
    for (int k = 1; k <= LOOKS; ++k) {
        double approach, load, fraction = (double)k / LOOKS;
        normal_target_at(body, path, fraction, &approach, &load);
        *request = requested_load(path, fraction);
        *limit = hs_body_limit(body, approach, fraction);
        if (*request > *limit * (1.0 + LIMIT_TIE)) return 1;
    }
    return 0;
}

hs_vector hs_excess_at(const hs_body *body, const hs_plane_path *path, double fraction) {
    const hs_vector none = {0.0, 0.0};
    if (!prescribes_loads(path)) return none;
    double limit = hs_body_limit(body, body->approach, fraction);
    if (requested_load(path, fraction) <= limit * (1.0 + HS_LIMIT_SLACK)) return none;
    return loads_of(path, hs_plus(value_at(path, fraction), -1.0, body->tangential_load));
}

/* Fraction at which the request leaves a side of the limit next, after another one; infinite if it does not. */
static double next_change(const hs_body *body, const hs_plane_path *path, double from, int is_beyond) {
    const double sign = is_beyond ? -1.0 : 1.0;
    hs_bracket root = {from, from, sign * overload(body, path, from), 0.0, 0};
    if (root.at_low > 0.0) return from;
    for (int k = 1; k <= LOOKS; ++k, root.low = root.high, root.at_low = root.at_high) {
        root.high = k == LOOKS ? 1.0 : from + (1.0 - from) * ((double)k / LOOKS);
        root.at_high = sign * overload(body, path, root.high);
        if (root.at_high <= 0.0) continue;
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
    double size = hs_length(a) * hs_length(b);
    return size > 0.0 ? fabs(a.x * b.y - a.y * b.x) / size : 0.0;
}

/* Mean of ½ φ² over the springs, with φ the ratio of their deflection across a load to the largest one that friction holds. */
static double spread_across(const hs_body *body, hs_vector load) {
    double size = hs_length(load), missed = 0.0, limit = 0.0;
    for (int64_t c = 0; c < body->classes && size > 0.0; ++c) {
        const hs_class *part = body->parts + c;
        const hs_node *nodes = part->nodes;
        double outer = 0.0, friction = hs_coefficient(body, part->group, 0.0);
        for (int32_t k = part->count - 1; k >= 1 && friction > 0.0; --k) {
            double inner = outer, held = friction * (nodes[0].label - nodes[k].label);
            outer = (nodes[k - 1].normal - nodes[k].normal) / (nodes[k - 1].label - nodes[k].label);
            double across = (nodes[k].deflection.x * load.y - nodes[k].deflection.y * load.x) / size;
            missed += 0.5 * (outer - inner) * across * across / held;
            limit += (outer - inner) * held;
        }
    }
    return limit > 0.0 ? missed / limit : 0.0;
}

/* Part of the limit that is left to a load beyond it. A load whose direction, and that of all springs, stays is held at the limit
 * but for rounding, as in one direction. To turn at the limit itself takes an infinite displacement: the tolerance is left. */
static double margin_of(const hs_body *body, const hs_plane_path *path, int is_beyond) {
    double meets = is_beyond ? 0.0 : next_change(body, path, 0.0, 0);
    if (meets > 1.0 || (path->rigid.x > 0.0 && path->value[0].x != path->value[1].x) ||
        (path->rigid.y > 0.0 && path->value[0].y != path->value[1].y))
        return body->tolerance;
    hs_vector load = loads_of(path, value_at(path, meets));
    double turn = sine_between(load, loads_of(path, path->value[1]));
    double margin = hs_most(turn, MARGIN_OF_SPREAD * spread_across(body, load));
    return hs_least(hs_most(margin, LEAST_MARGIN), body->tolerance);
}

void hs_begin_segments(const hs_body *body, hs_plane_path *path) {
    const double *d = path->approach, touch = body->contact->sorted_gap[0];
    path->lift_off = d[0] > touch && d[1] < touch ? (d[0] - touch) / (d[0] - d[1]) : HUGE_VAL;
    path->margin = LEAST_MARGIN;
    path->segments_left = path->is_held = path->is_beyond = 0;
    if (!path->saturate || !prescribes_loads(path)) return;
    path->margin = body->tolerance;
    if (stays_within(body, path)) return;
    path->segments_left = MOST_SEGMENTS;
    double begin = overload(body, path, 0.0), limit = hs_body_limit(body, d[0], 0.0);
    path->is_beyond = (fabs(begin) > LIMIT_TIE * limit ? begin : overload(body, path, 1.0 / LOOKS)) > 0.0;
    path->margin = margin_of(body, path, path->is_beyond);
}

/* True if a request beyond the limit keeps its direction from a fraction to another one, but for what the least margin hides. */
static int keeps_direction(const hs_plane_path *path, double begin, double end) {
    hs_vector from = loads_of(path, value_at(path, begin)), to = loads_of(path, value_at(path, end));
    return hs_dot(from, to) > 0.0 && sine_between(from, to) <= LEAST_MARGIN;
}

double hs_next_cut(const hs_body *body, hs_plane_path *path, int *is_straight) {
    double begin = body->fraction, end = 1.0;
    int is_beyond = path->is_beyond;
    if (path->segments_left > 0) {
        --path->segments_left;
        double change = next_change(body, path, begin, is_beyond);
        if (change <= begin) change = next_change(body, path, begin, is_beyond = !is_beyond);
        path->is_beyond = change < 1.0 ? !is_beyond : is_beyond;
        end = hs_least(change, 1.0);
    }
    if (begin < path->lift_off && path->lift_off < end) {
        end = path->lift_off;
        path->is_beyond = is_beyond;
    }
    *is_straight = !is_beyond || keeps_direction(path, begin, end);
    double from, to, load;
    normal_target_at(body, path, end, &to, &load);
    normal_target_at(body, path, begin, &from, &load);
    /* as in one direction: the limit falls, nothing else moves, and everything slides already */
    path->is_held = is_beyond && *is_straight && hs_body_limit(body, to, end) < hs_body_limit(body, from, begin) &&
                    (path->rigid.x == 0.0 || path->value[0].x == path->value[1].x) &&
                    (path->rigid.y == 0.0 || path->value[0].y == path->value[1].y);
    path->held = body->displacement;
    return end;
}
