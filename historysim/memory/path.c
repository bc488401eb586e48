/* Path: where the channels lead on a path, its segments at the friction limit Σ μ P(a), and its
 * integration in one direction where nothing evolves (README.md, a path; theory 2).
 *
 * A request beyond the limit is clipped to the limit, and the contact slides: at each path fraction
 * T = min(|request|, limit), with the displacement nearest to the present one. While all springs
 * slide, the displacement is constant for a falling normal load; for a rising one it increases just
 * enough for new springs to slide. The result does not depend on the number of rows.
 *
 * Requests are linear in the path fraction s, as is the normal load if all loads are prescribed,
 * else the approach. The limit of several groups is linear in neither, and the magnitude of a
 * request in a plane is convex, so a request may cross the limit several times: crossings are found
 * by interval bisection with bounds of the slope. */

#include "path.h"
#include "bracket.h"
#include "state.h"

/* Width in path fraction below which an interval is not bisected; chosen. */
#define MIN_WIDTH 1e-12

/* Evaluations of the limit for one crossing: bounds the search for a request that follows the
 * limit; chosen. */
#define MAX_EVALUATIONS 4096

/* Nested bisections, at most: more than the 40 that lead to the minimum width; chosen. */
#define MAX_HALVINGS 64

/* Point of a request: path fraction, approach, and the friction limit with the slopes of limit and
 * normal load. */
typedef struct request_point {
    double fraction;
    double d;
    hs_limit at;
} request_point;

static double approach_on(const hs_line *memory, const hs_plan *plan, double fraction) {
    double d = hs_toward(plan->approach[0], plan->approach[1], fraction);
    if (!plan->both_loads) return d;
    double load = hs_toward(plan->normal_load[0], plan->normal_load[1], fraction);
    return hs_label_at(hs_all_of(memory->contact), load, d, 0.0, 1.0);
}

static request_point evaluate_at(const hs_line *memory, const hs_plan *plan, double fraction) {
    double d = approach_on(memory, plan, fraction);
    request_point point = {fraction, d, hs_limit_and_slopes(memory, d)};
    point.at.limit += (1.0 - fraction) * plan->limit_drop;
    return point;
}

double hs_limit_on(const hs_line *memory, const hs_plan *plan, double fraction, double d,
                   double load) {
    return hs_friction_limit(memory, d, load) + (1.0 - fraction) * plan->limit_drop;
}

hs_vector hs_request_at(const hs_plan *plan, double fraction) {
    return HS_MADE(hs_vector){hs_toward(plan->request[0], plan->request[1], fraction),
                              hs_toward(plan->request_y[0], plan->request_y[1], fraction)};
}

/* Requested load; its magnitude in a plane, where it has one side. */
static double requested_load(const hs_plan *plan, double fraction) {
    return plan->is_planar ? hs_norm(hs_request_at(plan, fraction))
                           : hs_toward(plan->request[0], plan->request[1], fraction);
}

/* Derivative of the requested load with respect to the path fraction, which in a plane does not
 * decrease; `unknown` times its largest magnitude where it jumps. */
static double request_rate(const hs_plan *plan, double fraction, double unknown) {
    hs_vector change = {plan->request[1] - plan->request[0],
                        plan->request_y[1] - plan->request_y[0]};
    if (!plan->is_planar) return change.x;
    hs_vector load = hs_request_at(plan, fraction);
    double norm = hs_norm(load);
    return norm > 0.0 ? hs_dot(load, change) / norm : unknown * hs_norm(change);
}

/* Excess of a request over the limit with its margin on one side. */
static double excess(const hs_plan *plan, const request_point *point, double side) {
    return side * requested_load(plan, point->fraction) - (1.0 - plan->margin) * point->at.limit;
}

/* Bounds of the derivative of the limit with respect to the path fraction between two points; its
 * derivative with respect to the approach is monotone. */
static void bound_limit_slopes(const hs_line *memory, const hs_plan *plan, const request_point *low,
                               const request_point *high, double *min_rate, double *max_rate) {
    double min_limit_slope = hs_min(low->at.limit_slope, high->at.limit_slope);
    double max_limit_slope = hs_max(low->at.limit_slope, high->at.limit_slope);
    double rate = plan->approach[1] - plan->approach[0], min_slope = min_limit_slope,
           max_slope = max_limit_slope;
    if (plan->both_loads) {
        double min_load_slope = hs_min(low->at.load_slope, high->at.load_slope);
        double max_load_slope = hs_max(low->at.load_slope, high->at.load_slope);
        hs_range friction = hs_friction_range(memory, hs_max(low->d, high->d));
        min_slope = max_load_slope > 0.0 ? hs_max(friction.min, min_limit_slope / max_load_slope)
                                         : friction.min;
        max_slope = min_load_slope > 0.0 ? hs_min(friction.max, max_limit_slope / min_load_slope)
                                         : friction.max;
        rate = plan->normal_load[1] - plan->normal_load[0];
    }
    *min_rate = hs_min(rate * min_slope, rate * max_slope) - plan->limit_drop;
    *max_rate = hs_max(rate * min_slope, rate * max_slope) - plan->limit_drop;
}

/* Path fraction of the single root of `excess` between two points, by regula falsi (Illinois). */
static double find_crossing(const hs_line *memory, const hs_plan *plan, double side,
                            const request_point *start, const request_point *stop) {
    hs_bracket root = {start->fraction, stop->fraction, excess(plan, start, side),
                       excess(plan, stop, side), 0};
    for (int iteration = 0; iteration < 200; ++iteration) {
        double fraction = hs_false_position(&root);
        if (fraction == root.low || fraction == root.high || root.high - root.low <= 1e-15) break;
        request_point point = evaluate_at(memory, plan, fraction);
        double value = excess(plan, &point, side);
        if (value == 0.0) return fraction;
        hs_narrow(&root, fraction, value, (value > 0.0) == (root.at_high > 0.0));
    }
    return root.high;
}

/* Smallest path fraction between two points at which the request crosses the limit on one side,
 * outward (`beyond`) or inward; infinity if there is none. Intervals are bisected until bounds of
 * the slope show that the excess is monotone or has no root. */
static double next_crossing(const hs_line *memory, const hs_plan *plan, double side,
                            const request_point *start, const request_point *stop, int beyond) {
    /* stack of the upper ends of pending intervals, the lowest on top */
    request_point pending[MAX_HALVINGS], low = *start;
    int count = 1, evaluations = 0;
    pending[0] = *stop;
    double sign = beyond ? 1.0 : -1.0;
    while (count > 0) {
        request_point high = pending[count - 1];
        double at_low = sign * excess(plan, &low, side), at_high = sign * excess(plan, &high, side);
        double min_rate, max_rate;
        bound_limit_slopes(memory, plan, &low, &high, &min_rate, &max_rate);
        double from_rate = side * request_rate(plan, low.fraction, -1.0),
               to_rate = side * request_rate(plan, high.fraction, 1.0);
        double min_request_rate = hs_min(from_rate, to_rate),
               max_request_rate = hs_max(from_rate, to_rate);
        double max_excess_rate = beyond ? max_request_rate - min_rate : max_rate - min_request_rate;
        double min_excess_rate = beyond ? min_request_rate - max_rate : min_rate - max_request_rate;
        double width = high.fraction - low.fraction;
        int monotone = min_excess_rate >= 0.0 || max_excess_rate <= 0.0;
        if (monotone && at_high > 0.0)
            return at_low < 0.0 ? find_crossing(memory, plan, side, &low, &high) : low.fraction;
        int is_excluded = monotone || hs_min(at_low + max_excess_rate * width,
                                             at_high - min_excess_rate * width) <= 0.0;
        int is_limit_reached = width <= MIN_WIDTH || evaluations == MAX_EVALUATIONS;
        if (at_high <= 0.0 && (is_excluded || is_limit_reached)) {
            --count;
            low = high;
        } else if (is_limit_reached || count == MAX_HALVINGS) {
            return high.fraction;
        } else {
            ++evaluations;
            pending[count++] = evaluate_at(memory, plan, 0.5 * (low.fraction + high.fraction));
        }
    }
    return HUGE_VAL;
}

/* True if a request reaches a limit on the path, so that it has to be cut. */
static int reaches_limit(const hs_line *memory, const hs_plan *plan) {
    const double held = 1.0 - plan->margin, start_load = fabs(requested_load(plan, 0.0)),
                 end_load = fabs(requested_load(plan, 1.0));
    double end = held * hs_limit_on(memory, plan, 1.0, plan->approach[1], plan->normal_load[1]);
    if (end_load > end) return 1;
    /* a path that is straight in (d, V) prescribes the load at its end only */
    double start = held * hs_limit_on(memory, plan, 0.0, plan->approach[0], plan->normal_load[0]);
    if (!plan->both_loads && !plan->is_planar) return start_load > (1.0 + HS_LIMIT_SLACK) * start;
    if (start_load > start) return 1;
    /* magnitudes of requests are convex, a limit is monotone, and that of one group linear in N */
    if (hs_max(start_load, end_load) <= hs_min(start, end) ||
        (plan->both_loads && memory->contact->groups == 1))
        return 0;
    request_point low = evaluate_at(memory, plan, 0.0), high = evaluate_at(memory, plan, 1.0);
    return next_crossing(memory, plan, 1.0, &low, &high, 1) < 1.0 ||
           next_crossing(memory, plan, -1.0, &low, &high, 1) < 1.0;
}

/* Cut a request at its crossings of the limit. */
static void cut_request(const hs_line *memory, hs_plan *plan) {
    request_point low = evaluate_at(memory, plan, 0.0), stop = evaluate_at(memory, plan, 1.0);
    int side = excess(plan, &low, 1.0) > 0.0 ? 1 : excess(plan, &low, -1.0) > 0.0 ? -1 : 0;
    for (int count = 0; count < HS_MAX_SEGMENTS; ++count) {
        plan->segments.side[count] = side;
        plan->segments.end[count] = 1.0;
        plan->segments.count = count + 1;
        double fraction;
        int following_side = 0;
        if (side != 0) {
            fraction = next_crossing(memory, plan, side, &low, &stop, 0);
        } else {
            double above = next_crossing(memory, plan, 1.0, &low, &stop, 1);
            double below = next_crossing(memory, plan, -1.0, &low, &stop, 1);
            fraction = hs_min(above, below);
            following_side = above < below ? 1 : -1;
        }
        if (fraction >= 1.0 || count + 1 == HS_MAX_SEGMENTS) return;
        plan->segments.end[count] = fraction;
        side = following_side;
        low = evaluate_at(memory, plan, fraction);
    }
}

/* True if a request exceeds the limit: at its end, or at the middle of the first segment beyond the
 * limit. Returns the request and the limit at this point. */
static int is_overload(const hs_line *memory, const hs_plan *plan, double *requested,
                       double *limit) {
    double start = 0.0;
    *requested = requested_load(plan, 1.0);
    *limit = hs_friction_limit(memory, plan->approach[1], plan->normal_load[1]);
    for (int k = 0; k < plan->segments.count; ++k) {
        if (plan->segments.side[k] != 0 && fabs(*requested) <= *limit * (1.0 + HS_LIMIT_SLACK)) {
            double fraction = 0.5 * (start + plan->segments.end[k]);
            *requested = requested_load(plan, fraction);
            *limit = hs_limit_and_slopes(memory, approach_on(memory, plan, fraction)).limit;
        }
        start = plan->segments.end[k];
    }
    return fabs(*requested) > *limit * (1.0 + HS_LIMIT_SLACK);
}

int hs_cut_at_limit(const hs_line *memory, hs_plan *plan, int saturate, hs_refusal *refusal) {
    double requested, limit;
    plan->segments.count = 0;
    if (!reaches_limit(memory, plan)) return HS_OK;
    cut_request(memory, plan);
    if (saturate || !is_overload(memory, plan, &requested, &limit)) return HS_OK;
    refusal->request = requested * memory->contact->units.load;
    refusal->limit = limit * memory->contact->units.load;
    return HS_BEYOND_LIMIT;
}

void hs_channels_at(const hs_line *memory, const hs_plan *plan, double fraction, double *d,
                    double *load) {
    if (fraction == 1.0) {
        *d = plan->approach[1];
        *load = plan->normal_load[1];
    } else if (plan->both_loads) {
        *load = hs_toward(plan->normal_load[0], plan->normal_load[1], fraction);
        *d = hs_approach_at_load(memory, *load);
    } else {
        *d = hs_toward(plan->approach[0], plan->approach[1], fraction);
        *load = *d == plan->approach[1] ? plan->normal_load[1]
                                        : hs_load_at(hs_all_of(memory->contact), *d).load;
    }
}

/* Tangential load at a path fraction, clipped to the limits; exactly a limit where a segment ends
 * at it. */
static double limited_request(const hs_line *memory, const hs_plan *plan, int piece,
                              double fraction, double d, double load) {
    double limit = hs_friction_limit(memory, d, load);
    if (fraction == plan->segments.end[piece] && piece + 1 < plan->segments.count)
        return plan->segments.side[piece + 1] * limit;
    return hs_clamp(hs_toward(plan->request[0], plan->request[1], fraction), limit);
}

/* Advance the clock along the limit; loads are linear in time if both are prescribed. */
static void tick_along_limit(hs_line *memory, int both, double load, double side, double time) {
    hs_tick(memory, time);
    if (!both) return;
    memory->clock.load = load;
    memory->clock.force = side * memory->friction[0] * load;
}

/* Move along the friction limit to approach d with normal load `load`.
 *
 * The displacement is constant for a falling approach. For a rising one it increases by μ Δd with
 * the largest μ of the groups in contact, so that all new springs slide. */
static int slide_along_limit(hs_line *memory, const hs_plan *plan, double d, double load,
                             double side, double time) {
    const hs_contact *contact = memory->contact;
    double limit = hs_friction_limit(memory, memory->approach, memory->normal_load), steepest = 0.0;
    if (side * memory->tangential_load < (1.0 - HS_TIE) * limit) {
        /* reach the limit at the present approach */
        hs_tick(memory, memory->clock.end);
        int status =
            hs_move(memory, memory->approach, memory->normal_load, hs_to_load(side * limit));
        if (status != HS_OK) return status;
    }
    const double from = memory->approach, load0 = memory->normal_load,
                 start_time = memory->clock.end;
    if (d <= from) {
        tick_along_limit(memory, plan->both_loads, load, side, time);
        return hs_move(memory, d, load, hs_to_displacement(memory->displacement));
    }
    for (int64_t index = 0; index < contact->groups; ++index) {
        double touch = contact->gap[contact->first[index]];
        if (touch >= d) break;
        if (memory->friction[index] <= steepest) continue;
        if (touch > memory->approach) {
            double reached = memory->displacement + side * steepest * (touch - memory->approach);
            double touch_load = hs_load_at(hs_all_of(contact), touch).load;
            double fraction = plan->both_loads ? (touch_load - load0) / (load - load0)
                                               : (touch - from) / (d - from);
            tick_along_limit(memory, plan->both_loads, touch_load, side,
                             hs_toward(start_time, time, fraction));
            int status = hs_move(memory, touch, touch_load, hs_to_displacement(reached));
            if (status != HS_OK) return status;
        }
        steepest = memory->friction[index];
    }
    tick_along_limit(memory, plan->both_loads, load, side, time);
    return hs_move(
        memory, d, load,
        hs_to_displacement(memory->displacement + side * steepest * (d - memory->approach)));
}

/* Integrate a path, cut into segments, between two path fractions; `side` returns the limit
 * followed at `to`. */
static int follow_limit(hs_line *memory, const hs_plan *plan, double from, double to,
                        const hs_drive *drive, int *side) {
    *side = 0;
    for (int k = 0; k < plan->segments.count; ++k) {
        double segment_fraction = plan->segments.end[k], stop = hs_min(segment_fraction, to), d,
               load;
        int status;
        if (segment_fraction <= from && k < plan->segments.count - 1) continue;
        *side = plan->segments.side[k];
        hs_channels_at(memory, plan, stop, &d, &load);
        double time = hs_toward(plan->times[0], plan->times[1], stop);
        if (*side != 0) {
            status = slide_along_limit(memory, plan, d, load, *side, time);
        } else if (plan->both_loads) {
            status =
                hs_ramp(memory, load, limited_request(memory, plan, k, stop, d, load), time, drive);
        } else {
            double d1, load1;
            hs_channels_at(memory, plan, segment_fraction, &d1, &load1);
            hs_target target =
                hs_to_load(limited_request(memory, plan, k, segment_fraction, d1, load1));
            status = HS_OK;
            if (stop < segment_fraction) {
                double reached = 0.0;
                status = hs_solve_displacement(memory, d1, load1, target, &reached);
                target = hs_to_displacement(hs_toward(memory->displacement, reached,
                                                      (stop - from) / (segment_fraction - from)));
            }
            hs_tick(memory, time);
            if (status == HS_OK) status = hs_move(memory, d, load, target);
        }
        if (status != HS_OK) return status;
        from = stop;
        if (stop == to) break;
    }
    return HS_OK;
}

/* Scale a target by a unit; magnitudes below `smallest` are 0, because the stiffness of so small a
 * contact rounds to 0. */
static double scale_target(double target, double unit, double smallest) {
    double result = target / unit;
    return fabs(result) < smallest ? 0.0 : result;
}

hs_path hs_scale_path(const hs_units *units, const hs_path *path) {
    hs_path scaled = *path;
    int by_load = path->normal_control == HS_LOAD;
    scaled.normal_target = scale_target(path->normal_target, by_load ? units->load : units->length,
                                        by_load ? HS_MIN_LOAD : HS_MIN_APPROACH);
    for (int k = 0; k < 2; ++k)
        scaled.tangential_target[k] /=
            path->tangential_control[k] == HS_LOAD ? units->load : units->displacement;
    return scaled;
}

void hs_set_normal_targets(const hs_line *memory, const hs_path *path, hs_plan *plan) {
    double *approach = plan->approach, *load = plan->normal_load;
    plan->times[0] = path->begin;
    plan->times[1] = path->end;
    approach[0] = memory->approach;
    load[0] = memory->normal_load;
    if (plan->normal_by_load) {
        load[1] = hs_toward(load[0], path->normal_target, path->normal_fraction);
        approach[1] = hs_approach_at_load(memory, load[1]);
        /* a gap is closed without load, before the loads change */
        if (plan->both_loads && load[1] > 0.0)
            approach[0] = hs_max(approach[0], memory->contact->sorted_gap[0]);
    } else {
        approach[1] = hs_toward(approach[0], path->normal_target, path->normal_fraction);
        load[1] = approach[1] == approach[0]
                      ? load[0]
                      : hs_load_at(hs_all_of(memory->contact), approach[1]).load;
    }
}

void hs_set_targets(const hs_line *memory, const hs_path *path, double compliance, int saturate,
                    hs_plan *plan) {
    double *request = plan->request;
    plan->normal_by_load = path->normal_control == HS_LOAD;
    plan->tangential_by_load = path->tangential_control[0] == HS_LOAD;
    plan->both_loads = plan->normal_by_load && plan->tangential_by_load;
    plan->segments.count = plan->is_straight = plan->ends_at_limit = plan->is_planar = 0;
    plan->start_contact = NULL;
    plan->request_y[0] = plan->request_y[1] = plan->limit_drop = 0.0;
    plan->margin = HS_TIE;
    hs_set_normal_targets(memory, path, plan);
    request[0] = plan->tangential_by_load
                     ? memory->tangential_load + (saturate ? memory->excess : 0.0)
                     : memory->displacement + compliance * memory->tangential_load;
    request[1] = hs_toward(request[0], path->tangential_target[0], path->tangential_fraction[0]);
    plan->target = HS_MADE(hs_target){request[1], 1.0, compliance};
    if (plan->tangential_by_load) plan->target = hs_to_load(request[1]);
    plan->displacement[0] = memory->displacement;
    plan->displacement[1] = request[1];
    plan->ends_separated = plan->tangential_by_load && !plan->both_loads && request[1] == 0.0 &&
                           plan->approach[1] <= memory->contact->sorted_gap[0];
}

int hs_plan_path(const hs_line *memory, const hs_path *path, double compliance, int saturate,
                 int direct, hs_plan *plan, hs_refusal *refusal) {
    hs_set_targets(memory, path, compliance, saturate, plan);
    if (plan->tangential_by_load && hs_cut_at_limit(memory, plan, saturate, refusal) != HS_OK)
        return HS_BEYOND_LIMIT;
    if (!(plan->target.compliance > 0.0) || plan->both_loads || plan->segments.count || direct)
        return HS_OK;
    return hs_solve_displacement((hs_line *)memory, plan->approach[1], plan->normal_load[1],
                                 plan->target, &plan->displacement[1]);
}

int hs_follow_plan(hs_line *memory, const hs_plan *plan, double from, double to,
                   const hs_drive *drive) {
    double request = hs_toward(plan->request[0], plan->request[1], to), d, load;
    double time = hs_toward(plan->times[0], plan->times[1], to);
    int side = 0, status;
    if (plan->segments.count) {
        status = follow_limit(memory, plan, from, to, drive, &side);
    } else if (plan->both_loads) {
        load = hs_toward(plan->normal_load[0], plan->normal_load[1], to);
        status = hs_ramp(memory, load, request, time, drive);
    } else {
        hs_target target =
            hs_to_displacement(hs_toward(plan->displacement[0], plan->displacement[1], to));
        hs_channels_at(memory, plan, to, &d, &load);
        /* a tangential load that ends on a separated contact is no target after the first row: the
         * path stays straight in V */
        if (to == 1.0 && !(plan->ends_separated && from > 0.0)) target = plan->target;
        hs_tick(memory, time);
        status = hs_move(memory, d, load, target);
        if (status == HS_OK && plan->ends_separated && to == 1.0)
            memory->tangential_load = plan->target.value;
    }
    if (status != HS_OK) return status;
    /* excess of the request over the friction limit, unless it is rounding */
    double excess = side != 0 ? request - memory->tangential_load : 0.0;
    memory->excess = fabs(excess) > HS_LIMIT_SLACK * fabs(memory->tangential_load) ? excess : 0.0;
    return HS_OK;
}
