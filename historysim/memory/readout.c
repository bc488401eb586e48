/* Readout: loads, stiffnesses, slopes, tractions, energies and rows of a memory, from its
 * polylines: sums of slope times differences of P or P' over segments, exact (README.md, theory 8).
 * The memory is not changed. */

#include "readout.h"
#include "lanes.h"
#include "line.h"
#include "losses.h"
#include "scaled.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

/* Samples of the traction ratio on each segment, before its maximum is refined; chosen. */
#define SAMPLES 16

/* Determine the sliding zone of a group. After a decrease of μ an inner disc may slide while the
 * edge sticks. */
static hs_zone slip_zone(const hs_vertex *stack, int64_t depth, double displacement,
                         double friction, int steep) {
    int64_t top = depth - 1;
    double edge = stack[top].label;
    hs_zone zone = {edge, -HUGE_VAL, friction, stack[top].slope};
    if (hs_sliding_side(stack, depth, top, displacement, friction) != 0.0) {
        zone.boundary = stack[top - 1].label;
        zone.outermost = edge;
        return zone;
    }
    for (int64_t j = top - 1; steep && j > 0; --j)
        if (hs_sliding_side(stack, depth, j, displacement, friction) != 0.0) {
            zone.outermost = stack[j].label;
            break;
        }
    return zone;
}

/* Add dT/dV of a group at constant approach for a displacement in direction 1 or -1; 0: of the
 * springs that stick at present. Springs below `label` stick, except on inner discs of a steep
 * polyline. */
static inline void add_stiffness(const hs_line *memory, int64_t index, double direction,
                                 double label, double *stiffness) {
    hs_group group = hs_group_of(memory, index);
    const hs_vertex *stack = group.stack;
    int everywhere = direction == 0.0 || group.friction == 0.0;
    int is_cached = group.single && label == memory->known_label;
    *stiffness += is_cached ? memory->known_slope : hs_load_at(group.curve, label).slope;
    for (int64_t j = memory->steep[index] ? memory->depth[index] - 2 : 0; j > 0; --j) {
        double side =
            hs_sliding_side(stack, memory->depth[index], j, memory->displacement, group.friction);
        if (side != 0.0 && (everywhere || side == direction))
            *stiffness -= hs_load_at(group.curve, stack[j].label).slope -
                          hs_load_at(group.curve, stack[j - 1].label).slope;
    }
}

double hs_stiffness(const hs_state *state, int direction) {
    const hs_line *memory = hs_active(&state->line);
    double stiffness = 0.0;
    if (state->plane) return NAN;
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index) {
        const hs_vertex *stack = memory->vertices + index * memory->capacity;
        double friction = memory->friction[index];
        int64_t top = memory->depth[index] - 1;
        double side = hs_sliding_side(stack, top + 1, top, memory->displacement, friction);
        int slides = side != 0.0 && (direction == 0 || friction == 0.0 || side == direction);
        add_stiffness(memory, index, direction, stack[top - slides].label, &stiffness);
    }
    return stiffness * memory->contact->units.stiffness;
}

double hs_normal_stiffness(const hs_state *state) {
    const hs_line *memory = &state->line;
    const hs_units *units = &memory->contact->units;
    return hs_load_at(hs_all_of(memory->contact), memory->approach).slope * units->load /
           units->length;
}

double hs_line_stored_energy(const hs_line *memory) {
    return hs_elastic_energy(hs_active(memory), NULL) * memory->contact->units.energy;
}

/* Springs that slide are on the cone, v = ±μ (d - a), which depends on the approach only. Springs
 * that stick move with the displacement only, except those that came into contact on the path: v =
 * (V1 - V0) (d1 - a)/(d1 - d0) depends on both. The loads are ∫ v N'' da, so that each interval of
 * labels adds differences of P and P' at its ends. The derivatives are one-sided, on the side of
 * the last path. */
hs_slopes hs_line_slopes(const hs_line *memory, double start) {
    const hs_units *units = &memory->contact->units;
    double d0 = start / units->length, d1 = memory->approach, v1 = memory->displacement;
    hs_slopes result = {0.0, 0.0, 0.0};
    if (memory->scaled) {
        hs_line *copy = hs_line_copy(memory);
        result.tangential = result.coupling = result.normal = NAN;
        if (copy && hs_line_restore_groups(copy) == HS_OK) result = hs_line_slopes(copy, start);
        hs_line_free(copy);
        return result;
    }
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index) {
        hs_group group = hs_group_of(memory, index);
        const hs_vertex *stack = group.stack;
        double friction = group.friction;
        int64_t depth = memory->depth[index], top = depth - 1;
        hs_load edge = hs_load_at(group.curve, d1);
        result.normal += edge.slope;
        result.tangential += edge.slope;
        if (d1 > d0 && top > 0 && hs_sliding_side(stack, depth, top, v1, friction) == 0.0) {
            double start_label = hs_max(d0, group.curve.gap[0]), path_length = d1 - d0;
            hs_load inner = hs_load_at(group.curve, start_label);
            double rise = edge.load - inner.load;
            result.tangential += (rise - (d1 - start_label) * inner.slope) / path_length -
                                 (edge.slope - inner.slope);
            result.coupling +=
                stack[top].slope *
                (edge.slope - ((start_label - d0) * inner.slope + rise) / path_length);
        }
        int64_t lowest = memory->steep[index] || top < 1 ? 0 : top - 1;
        for (int64_t j = top; j > lowest; --j) {
            double side = hs_sliding_side(stack, depth, j, v1, friction);
            if (side == 0.0) continue;
            double upper = hs_load_at(group.curve, stack[j].label).slope;
            double lower = hs_load_at(group.curve, stack[j - 1].label).slope;
            result.tangential -= upper - lower;
            result.coupling += side * friction * (upper - lower);
        }
    }
    result.tangential *= units->stiffness;
    result.coupling *= units->load / units->length;
    result.normal *= units->load / units->length;
    return result;
}

/* Coordinate of a point of the contact area that comes into contact at a label: the label itself
 * for asperities; between knots the stiffness at the label, proportional to the radius of an
 * axisymmetric contact (Sneddon 1965). */
static double radial_coordinate(hs_curve curve, double label) {
    return curve.load ? hs_load_at(curve, label).slope : label;
}

/* Increase of the pressure at a coordinate between two approaches, up to a factor that depends on
 * the coordinate. Hertzian for asperities; between knots of the axisymmetric contact with this
 * curve, dp/da = 1/√(P'² - s²). */
static double pressure_rise(hs_curve curve, double low, double high, double coordinate) {
    if (!curve.load)
        return sqrt(hs_max(high - coordinate, 0.0)) - sqrt(hs_max(low - coordinate, 0.0));
    double rise = 0.0;
    int64_t i = hs_count_touching(curve.gap, curve.count, low);
    for (i -= i > 0; i < curve.count && curve.gap[i] < high; ++i) {
        double lower = hs_max(low, curve.gap[i]),
               upper = i + 1 < curve.count ? hs_min(high, curve.gap[i + 1]) : high;
        if (upper <= lower) continue;
        double bend = hs_bend_at(curve, i),
               upper_stiffness = curve.weight[i] + bend * (upper - curve.gap[i]);
        double lower_stiffness =
            hs_max(curve.weight[i] + bend * (lower - curve.gap[i]), coordinate);
        if (upper_stiffness <= coordinate) continue;
        double root = sqrt((upper_stiffness - coordinate) * (upper_stiffness + coordinate));
        /* where the stiffness is constant the logarithm is rounding */
        rise += upper_stiffness - lower_stiffness > 1e-9 * upper_stiffness
                    ? log((upper_stiffness + root) /
                          (lower_stiffness +
                           sqrt((lower_stiffness - coordinate) * (lower_stiffness + coordinate)))) /
                          bend
                    : (upper - lower) / root;
    }
    return rise;
}

/* |τ|/(μ p) at a coordinate. */
static double traction_ratio(const hs_group *group, int64_t depth, double coordinate) {
    const hs_vertex *stack = group->stack;
    double traction = 0.0, pressure = pressure_rise(group->curve, stack[0].label,
                                                    stack[depth - 1].label, coordinate);
    for (int64_t j = depth - 1;
         j > 0 && radial_coordinate(group->curve, stack[j].label) > coordinate; --j)
        traction += stack[j].slope *
                    pressure_rise(group->curve, stack[j - 1].label, stack[j].label, coordinate);
    return pressure > 0.0 ? fabs(traction) / (group->friction * pressure) : 0.0;
}

/* Largest |τ|/(μ p) of a group, to about 1e-4 where it exceeds 1; samples, then ternary search. */
static double largest_traction_ratio(const hs_group *group, int64_t depth) {
    const hs_vertex *stack = group->stack;
    if (depth < 2 || group->friction == 0.0) return 0.0;
    double largest = 0.0;
    /* at the edge of a punch, where the contact area does not grow, all pressures are singular */
    if (radial_coordinate(group->curve, stack[depth - 1].label) >
        radial_coordinate(group->curve, stack[depth - 2].label))
        largest = fabs(stack[depth - 1].slope) / group->friction;
    double steepest = 0.0;
    for (int64_t j = depth - 1; j > 0; --j) {
        /* tractions are sums over the segments farther out, so that their largest slope bounds the
         * ratio */
        steepest = hs_max(steepest, fabs(stack[j].slope));
        if (steepest <= group->friction * hs_max(largest, 1.0)) continue;
        /* below a vertex tractions change with the square root of the distance */
        double high = radial_coordinate(group->curve, stack[j].label), best = 0.0, at_best = 0.0;
        double width =
            sqrt(hs_max(high - radial_coordinate(group->curve, stack[j - 1].label), 0.0));
        if (width == 0.0) continue;
        for (int i = 1; i <= SAMPLES; ++i) {
            double x = width * i / SAMPLES, ratio = traction_ratio(group, depth, high - x * x);
            if (ratio > best) {
                best = ratio;
                at_best = i;
            }
        }
        double low_x = width * hs_max(at_best - 1.0, 0.01) / SAMPLES;
        double high_x = width * hs_min(at_best + 1.0, SAMPLES) / SAMPLES;
        for (int iteration = 0; iteration < 12; ++iteration) {
            double third = (high_x - low_x) / 3.0, x_lower = low_x + third,
                   x_upper = high_x - third;
            double lower_ratio = traction_ratio(group, depth, high - x_lower * x_lower);
            double upper_ratio = traction_ratio(group, depth, high - x_upper * x_upper);
            best = hs_max(best, hs_max(lower_ratio, upper_ratio));
            if (lower_ratio < upper_ratio)
                low_x = x_lower;
            else
                high_x = x_upper;
        }
        largest = hs_max(largest, best);
    }
    return largest;
}

HS_WIDE static void circles(const double *restrict gap, const double *restrict weight, int count,
                            double approach, double *restrict area) {
    for (int i = 0; i < count; ++i) area[i] = weight[i] * weight[i] * (approach - gap[i]);
}

/* Σ k² (a - h), the real contact area over π. */
static double real_area(const hs_contact *contact, int64_t touching, double approach) {
    double area[HS_BLOCK], lane[HS_LANES] = {0};
    int64_t size;
    for (int64_t start = 0; start < touching; start += size) {
        /* the terms are linear in the gap, so that one proxy per cluster is exact at any distance
         */
        const hs_cluster *cluster = NULL;
        size = hs_size_of_block(touching - start);
        if (contact->sorted_clusters)
            cluster = hs_cluster_at(contact->sorted_clusters, start, touching, HUGE_VAL, &size);
        if (cluster)
            area[0] = cluster->circles * (approach - cluster->circles_gap);
        else
            circles(contact->sorted_gap + start, contact->sorted_weight + start, (int)size,
                    approach, area);
        hs_add(lane, area, cluster ? 1 : (int)size);
    }
    return hs_lanes_sum(lane);
}

/* Record the share of the normal load on asperities that have yielded, and the energy of yielding.
 */
static void record_yielded(const hs_line *memory, hs_totals *totals) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    double on_yielded = 0.0;
    for (int64_t index = 0; index < contact->groups && memory->depth[index] > 0; ++index)
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i) {
            if (contact->gap[i] >= memory->approach) break;
            if (evolved->yielding_load[contact->order[i]] > 0.0)
                on_yielded +=
                    hs_load_of_asperity(contact->gap[i], contact->weight[i], memory->approach).load;
        }
    totals->yielding_energy = evolved->yielded_energy;
    if (memory->normal_load > 0.0)
        totals->yielded_share = hs_min(on_yielded / memory->normal_load, 1.0);
}

/* Fill the totals of a row; if there are columns, also the sliding zones of all groups. */
static void record_totals(hs_recorder *recorder, const hs_line *memory, hs_totals *totals,
                          int saturated) {
    const hs_line *line = hs_active(memory);
    const hs_contact *contact = line->contact;
    const hs_units *units = &contact->units;
    double limit = 0.0, ratio = 1.0, stiffness = 0.0;
    int64_t index = 0;
    for (; index < contact->groups && line->depth[index] > 0; ++index) {
        const hs_vertex *stack = line->vertices + index * line->capacity;
        int64_t depth = line->depth[index];
        hs_zone zone =
            slip_zone(stack, depth, line->displacement, line->friction[index], line->steep[index]);
        if (recorder->zones) recorder->zones[index] = zone;
        add_stiffness(line, index, 0.0, zone.boundary, &stiffness);
        if (line->steep[index]) {
            hs_group group = hs_group_of(line, index);
            ratio = hs_max(ratio, largest_traction_ratio(&group, depth));
        }
        limit += line->friction[index] * stack[depth - 1].normal;
    }
    hs_zone none = {-HUGE_VAL, -HUGE_VAL, 0.0, 0.0};
    for (; recorder->zones && index < contact->groups; ++index) recorder->zones[index] = none;
    int64_t touching = hs_line_contact_count(memory);
    totals->normal_load = memory->normal_load * units->load;
    totals->tangential_load = memory->tangential_load * units->load;
    totals->approach = memory->approach * units->length;
    totals->displacement = memory->displacement * units->displacement;
    totals->contact_count = (double)touching;
    totals->real_contact_area =
        contact->load ? 0.0 : real_area(memory->contact, touching, memory->approach) * units->area;
    totals->tangential_stiffness = stiffness * units->stiffness;
    totals->dissipated_energy = memory->dissipated * units->energy;
    totals->friction_limit = limit * units->load;
    totals->saturated = saturated ? 1.0 : 0.0;
    totals->friction = memory->friction[0];
    totals->traction_ratio = ratio;
    totals->slid_together = totals->erased_memories = totals->erased_energy = 0.0;
    totals->yielded_share = totals->yielding_energy = 0.0;
    if (memory->evolved) {
        totals->slid_together = memory->evolved->slid_together;
        totals->erased_memories = memory->evolved->erased_memories;
        totals->erased_energy = memory->evolved->erased_energy;
    }
    if (hs_evolves(memory) > 1) record_yielded(memory, totals);
}

/* Add the contributions of vertices `from` to `to` of a group to the tangential loads of
 * asperities: the jump of slope times the normal load at the label. */
HS_WIDE static void add_inner_forces(const hs_vertex *stack, int64_t from, int64_t to,
                                     const double *restrict gap, const double *restrict weight,
                                     int64_t count, int ascending, double *restrict force) {
    for (int64_t j = from; j <= to; ++j) {
        double label = stack[j].label, jump = stack[j].slope - stack[j + 1].slope;
        int64_t touching = ascending ? hs_count_touching(gap, count, label) : count;
        for (int64_t i = 0; i < touching; ++i) {
            double penetration = label - gap[i] > 0.0 ? label - gap[i] : 0.0;
            force[i] += jump * weight[i] * penetration * sqrt(penetration);
        }
    }
}

/* Compare the stack of a single group with that of the previous row. The sum of deep vertices,
 * unchanged between rows, is kept by column, so that the cost of a row is that of the changes:
 * vertices from `summed` on are added to the sum up to `unchanged`, and for this row beyond. */
static int compare_stacks(hs_recorder *recorder, const hs_vertex *stack, int64_t depth) {
    const hs_vertex *previous = recorder->stack;
    int64_t unchanged = 0;
    while (unchanged < recorder->depth && unchanged < depth &&
           previous[unchanged].label == stack[unchanged].label &&
           previous[unchanged].slope == stack[unchanged].slope)
        ++unchanged;
    /* the contribution of a vertex depends on the slope of the segment above it, too */
    recorder->unchanged = unchanged > 2 ? unchanged - 2 : 0;
    if (recorder->unchanged < recorder->summed) recorder->summed = 0;
    hs_vertex *grown = (hs_vertex *)realloc(recorder->stack, (size_t)depth * sizeof *grown);
    if (!grown) return HS_OUT_OF_MEMORY;
    recorder->stack = grown;
    recorder->depth = depth;
    memcpy(grown, stack, (size_t)depth * sizeof *stack);
    return HS_OK;
}

/* Contributions of the inner vertices of a single group to a block of columns, in the order of
 * vertices, for equal bits. */
static void add_block(const hs_recorder *recorder, int64_t start, int count, double *force) {
    const double *gap = recorder->columns.gap + start, *weight = recorder->columns.weight + start;
    const size_t size = (size_t)count * sizeof *force;
    double *sum = recorder->inner + start;
    if (recorder->summed == 0) memset(sum, 0, size);
    if (recorder->summed < recorder->unchanged)
        add_inner_forces(recorder->stack, recorder->summed + 1, recorder->unchanged, gap, weight,
                         count, 0, sum);
    memcpy(force, sum, size);
    if (recorder->unchanged < recorder->depth - 2)
        add_inner_forces(recorder->stack, recorder->unchanged + 1, recorder->depth - 2, gap, weight,
                         count, 0, force);
}

/* Project a block of asperities in any order to normal and tangential loads [N], radii of contact
 * and stick [m] and slip states. `zone` holds their zones as arrays, `value` returns the four
 * quantities; the tangential load begins with the contributions of inner vertices, dimensionless,
 * and is clipped to the friction limit. Stick is found from gaps and weights that may be scaled. */
HS_WIDE static void project(const double *restrict gap, const double *restrict weight,
                            const double *restrict stick_gap, const double *restrict stick_weight,
                            int count, double approach, double stick_approach,
                            double (*restrict zone)[HS_BLOCK], const hs_units *units,
                            double (*restrict value)[HS_BLOCK], int8_t *restrict state) {
    const double load_unit = units->load, radius_unit = units->radius;
    for (int i = 0; i < count; ++i) {
        double penetration = approach - gap[i] > 0.0 ? approach - gap[i] : 0.0;
        double x = sqrt(penetration), load = x * penetration * weight[i];
        double boundary = zone[0][i], outermost = zone[1][i], friction = zone[2][i],
               slope = zone[3][i];
        double inner = boundary - stick_gap[i] > 0.0 ? boundary - stick_gap[i] : 0.0,
               limit = friction * fabs(load);
        double tangential = value[1][i] + slope * load;
        tangential = tangential > -limit ? tangential : -limit;
        tangential = tangential < limit ? tangential : limit;
        int touches = stick_gap[i] < stick_approach;
        value[0][i] = load * load_unit;
        value[1][i] = touches ? tangential * load_unit : 0.0;
        value[2][i] = weight[i] * x * radius_unit;
        value[3][i] = stick_weight[i] * sqrt(inner) * radius_unit;
        state[i] = hs_slip_state_of(touches, outermost > stick_gap[i], boundary > stick_gap[i]);
    }
}

/* Recorded asperities from which rows bypass the cache, from which they would displace all else;
 * chosen. */
#define MIN_STREAMED 32768

/* Write a block of values to a row of `columns`. */
static void put(double *target, const double *value, int count, int64_t columns) {
    int i = 0;
#ifdef __SSE2__
    if (columns >= MIN_STREAMED) {
        if ((uintptr_t)target % sizeof(__m128d) && count > 0) {
            target[0] = value[0];
            i = 1;
        }
        for (; i + 2 <= count; i += 2) _mm_stream_pd(target + i, _mm_loadu_pd(value + i));
    }
#else
    (void)columns;
#endif
    memcpy(target + i, value + i, (size_t)(count - i) * sizeof *value);
}

/* Fill the columns of a curve with knots: the loads of the springs with labels from each knot to
 * the following one. Radii represent labels: their squares are proportional to the approach beyond
 * the knot. */
static void record_knots(const hs_recorder *recorder, const hs_line *memory, int64_t row) {
    const hs_rows *rows = recorder->rows;
    hs_curve curve = hs_all_of(memory->contact);
    const hs_vertex *stack = memory->vertices;
    const hs_units *units = &memory->contact->units;
    int64_t depth = memory->depth[0], columns = rows->columns;
    double boundary = recorder->zones[0].boundary, outermost = recorder->zones[0].outermost;
    for (int64_t c = 0; c < columns; ++c) {
        int64_t i = recorder->columns.position[c], at = row * columns + c, j = 1;
        double label = curve.gap[i], force[2], load[2];
        for (int side = 0; side < 2; ++side) {
            double upper_label = side == 0             ? label
                                 : i + 1 < curve.count ? curve.gap[i + 1]
                                                       : HUGE_VAL;
            while (j < depth - 1 && stack[j].label < upper_label) ++j;
            int covers_segment = upper_label >= stack[j].label;
            load[side] = covers_segment ? stack[j].normal
                         : side == 0    ? curve.load[i]
                                        : curve.load[i + 1];
            force[side] = stack[j].tangential -
                          (covers_segment ? 0.0 : stack[j].slope * (stack[j].normal - load[side]));
        }
        int touches = label < memory->approach;
        double normal = touches ? hs_max(load[1] - load[0], 0.0) : 0.0;
        double limit = memory->steep[0] ? HUGE_VAL : memory->friction[0] * normal;
        rows->normal_load[at] = normal * units->load;
        rows->tangential_load[at] =
            touches ? hs_clamp(force[1] - force[0], limit) * units->load : 0.0;
        rows->contact_radius[at] = touches ? sqrt(memory->approach - label) * units->radius : 0.0;
        rows->stick_radius[at] =
            touches ? sqrt(hs_max(boundary - label, 0.0)) * units->radius : 0.0;
        rows->slip_state[at] = hs_slip_state_of(touches, outermost > label, boundary > label);
    }
}

/* Fill the dissipated energies of the columns. */
static void record_energies(const hs_recorder *recorder, const hs_line *line, int64_t at) {
    const double unit = line->contact->units.energy;
    const int64_t *position = recorder->columns.position, columns = recorder->rows->columns;
    const double *energy = recorder->energy ? recorder->energy : line->dissipated_each;
    double *target = recorder->rows->dissipated_energy, block[HS_BLOCK];
    if (!target) return;
    if (recorder->energy) hs_dissipated_energies(line, 0, line->contact->count, recorder->energy);
    for (int64_t start = 0; start < columns; start += HS_BLOCK) {
        const int count = hs_size_of_block(columns - start);
        for (int i = 0; i < count; ++i) block[i] = energy[position[start + i]] * unit;
        for (int i = 0; i < count && line->far_energy && !recorder->energy; ++i) {
            hs_dissipated_energies(line, position[start + i], 1, block + i);
            block[i] *= unit;
        }
        put(target + at + start, block, count, columns);
    }
}

/* Bound values by at least `least`, and by at most an array. */
HS_WIDE static void bound(double *restrict value, const double *restrict most, double least,
                          int count) {
    for (int i = 0; i < count; ++i) {
        double bounded = value[i] > least ? value[i] : least;
        value[i] = bounded < most[i] ? bounded : most[i];
    }
}

/* Fill loads, radii and slip states of the columns, in blocks that fit the cache. */
static void record_columns(const hs_recorder *recorder, const hs_line *memory, int64_t at) {
    const hs_rows *rows = recorder->rows;
    const hs_line *line = hs_active(memory);
    const hs_columns *columns = &recorder->columns,
                     *unscaled = memory->scaled ? &recorder->unscaled : columns;
    double *target[] = {rows->normal_load, rows->tangential_load, rows->contact_radius,
                        rows->stick_radius};
    double zone[4][HS_BLOCK], value[4][HS_BLOCK];
    const int is_single = line->contact->groups == 1;
    for (int64_t start = 0; start < rows->columns; start += HS_BLOCK) {
        int count = hs_size_of_block(rows->columns - start);
        /* values of separated asperities may be outdated; they are not used */
        if (is_single)
            add_block(recorder, start, count, value[1]);
        else
            for (int i = 0; i < count; ++i)
                value[1][i] = recorder->inner[columns->position[start + i]];
        /* a single group has one zone, filled for the first block */
        for (int i = 0; i < count && (start == 0 || !is_single); ++i) {
            const hs_zone *group_zone = recorder->zones + columns->group[start + i];
            zone[0][i] = group_zone->boundary;
            zone[1][i] = group_zone->outermost;
            zone[2][i] = group_zone->friction;
            zone[3][i] = group_zone->slope;
        }
        for (int i = 0; i < count && memory->scaled; ++i) {
            zone[2][i] = recorder->friction[start + i];
            zone[3][i] = recorder->zones->slope * zone[2][i];
        }
        project(unscaled->gap + start, unscaled->weight + start, columns->gap + start,
                columns->weight + start, count, memory->approach, line->approach, zone,
                &line->contact->units, value, rows->slip_state + at + start);
        /* radii in ξ differ by rounding from those in labels */
        if (memory->scaled)
            bound(value[3], value[2], zone[0][0] >= line->approach ? HUGE_VAL : 0.0, count);
        for (int k = 0; k < 4; ++k) put(target[k] + at + start, value[k], count, rows->columns);
    }
}

static int record_asperities(hs_recorder *recorder, const hs_line *memory, int64_t row) {
    const hs_line *line = hs_active(memory);
    const hs_contact *contact = line->contact;
    if (contact->load && line->depth[0] > 0) {
        record_knots(recorder, line, row);
        return HS_OK;
    }
    if (contact->groups == 1 && line->depth[0] > 0 &&
        compare_stacks(recorder, line->vertices, line->depth[0]) != HS_OK)
        return HS_OUT_OF_MEMORY;
    for (int64_t index = 0;
         contact->groups > 1 && index < contact->groups && line->depth[index] > 0; ++index) {
        hs_group group = hs_group_of(line, index);
        memset(recorder->inner + group.start, 0, (size_t)group.curve.count * sizeof(double));
        add_inner_forces(group.stack, 1, line->depth[index] - 2, group.curve.gap,
                         group.curve.weight, group.curve.count, 1, recorder->inner + group.start);
    }
    record_columns(recorder, memory, row * recorder->rows->columns);
    recorder->summed = recorder->unchanged;
    return HS_OK;
}

/* Find the positions of the recorded asperities in a contact. */
static int locate(const hs_rows *rows, hs_contact *contact, int all, hs_columns *columns,
                  double *chosen) {
    const hs_columns *every = hs_contact_columns(contact);
    if (!every) return HS_OUT_OF_MEMORY;
    if (all) *columns = *every;
    if (all) return HS_OK;
    columns->gap = chosen;
    columns->weight = chosen + rows->columns;
    columns->position = (int64_t *)(chosen + 2 * rows->columns);
    columns->group = columns->position + rows->columns;
    for (int64_t c = 0; c < rows->columns; ++c) {
        int64_t asperity = rows->asperity[c];
        columns->gap[c] = every->gap[asperity];
        columns->weight[c] = every->weight[asperity];
        columns->position[c] = every->position[asperity];
        columns->group[c] = every->group[asperity];
    }
    return HS_OK;
}

/* Find the columns of the contact of a row, and of the same contact without scales, unless they are
 * known. */
static int locate_columns(hs_recorder *recorder, const hs_line *memory) {
    const hs_rows *rows = recorder->rows;
    hs_contact *contact = hs_active(memory)->contact;
    if (contact == recorder->contact) return HS_OK;
    hs_recorder_forget(recorder);
    recorder->depth = recorder->summed = recorder->unchanged = 0;
    int status = locate(rows, contact, recorder->all, &recorder->columns, recorder->chosen);
    if (status == HS_OK && memory->scaled)
        status = locate(rows, memory->contact, recorder->all, &recorder->unscaled,
                        recorder->chosen + 4 * rows->columns);
    for (int64_t c = 0; c < rows->columns && memory->scaled && status == HS_OK; ++c)
        recorder->friction[c] = memory->friction[recorder->unscaled.group[c]];
    /* kept, so that its address is not that of another one */
    if (status == HS_OK) recorder->contact = hs_contact_retain(contact);
    return status;
}

int hs_recorder_init(hs_recorder *recorder, hs_contact *contact, const hs_rows *rows) {
    memset(recorder, 0, sizeof *recorder);
    recorder->rows = rows;
    if (!rows || rows->columns == 0) return HS_OK;
    size_t count = (size_t)contact->count, columns = (size_t)rows->columns,
           capacity = count > columns ? count : columns;
    recorder->all = columns == count;
    for (int64_t c = 0; c < rows->columns; ++c) {
        if (rows->asperity[c] < 0 || rows->asperity[c] >= contact->count) return HS_FOREIGN;
        recorder->all &= rows->asperity[c] == c;
    }
    recorder->inner = (double *)calloc(2 * capacity, sizeof(double));
    recorder->zones = (hs_zone *)malloc(count * sizeof *recorder->zones);
    recorder->chosen = (double *)malloc(recorder->all ? 1 : 8 * columns * sizeof(double));
    int interpolates = rows->dissipated_energy && count >= HS_MIN_CLUSTERED && columns > count / 64;
    if (interpolates) recorder->energy = (double *)malloc(count * sizeof(double));
    if (!recorder->inner || !recorder->zones || !recorder->chosen ||
        (interpolates && !recorder->energy)) {
        hs_recorder_clear(recorder);
        return HS_OUT_OF_MEMORY;
    }
    recorder->friction = recorder->inner + capacity;
    return HS_OK;
}

void hs_recorder_forget(hs_recorder *recorder) {
    hs_contact_free(recorder->contact);
    recorder->contact = NULL;
}

void hs_recorder_clear(hs_recorder *recorder) {
    hs_recorder_forget(recorder);
    free(recorder->chosen);
    free(recorder->energy);
    free(recorder->inner);
    free(recorder->zones);
    free(recorder->stack);
}

int hs_record(hs_recorder *recorder, const hs_line *memory, int64_t row, int saturated) {
    const hs_rows *rows = recorder->rows;
    const hs_evolved *evolved = memory->evolved;
    int64_t columns = rows->columns, at = row * columns;
    if (columns && locate_columns(recorder, memory) != HS_OK) return HS_OUT_OF_MEMORY;
    record_totals(recorder, memory, rows->totals + row, saturated);
    if (columns == 0) return HS_OK;
    if (rows->normal_load && record_asperities(recorder, memory, row) != HS_OK)
        return HS_OUT_OF_MEMORY;
    record_energies(recorder, hs_active(memory), at);
#ifdef __SSE2__
    _mm_sfence();
#endif
    const int64_t *group = memory->scaled ? recorder->unscaled.group : recorder->columns.group;
    for (int64_t c = 0; c < columns && rows->friction; ++c)
        rows->friction[at + c] = memory->friction[group[c]];
    if (!evolved) return HS_OK;
    double *target[] = {rows->slid_distance, rows->worn_volume, rows->summit_height,
                        rows->summit_radius};
    const double *source[] = {evolved->slid_distance, evolved->worn_volume, evolved->summit_height,
                              evolved->summit_radius};
    for (int k = 0; k < 4; ++k)
        for (int64_t c = 0; c < columns && target[k]; ++c)
            target[k][at + c] = source[k][rows->asperity[c]];
    for (int64_t c = 0; c < columns && rows->yielded_depth && evolved->virgin_height; ++c) {
        int64_t i = rows->asperity[c];
        rows->yielded_depth[at + c] = evolved->virgin_height[i] - evolved->summit_height[i];
        rows->yielding_load[at + c] = evolved->yielding_load[i];
        rows->yielding_energy[at + c] = evolved->yielding_energy[i];
    }
    return HS_OK;
}

int hs_line_read(const hs_line *memory, const hs_rows *rows, int64_t row) {
    hs_recorder recorder;
    int status = hs_recorder_init(&recorder, memory->contact, rows);
    if (status != HS_OK) return status;
    status = hs_record(&recorder, memory, row, memory->excess != 0.0);
    hs_recorder_clear(&recorder);
    return status;
}

/* Sum the loads of knots by row of the table of patches. */
static void gather(const double *knots, int64_t count, const hs_patches *patches, double *target) {
    memset(target, 0, (size_t)patches->rows * sizeof *target);
    for (int64_t k = 0; k < count; ++k) target[patches->row[k]] += knots[k];
}

/* Weighted sum of the gains of a patch over the rows of the table, in lanes. */
static double weighted_sum(const double *gains, int64_t rows, const double *weight) {
    double lane[HS_LANES] = {0};
    int64_t r = 0;
    for (; r + HS_LANES <= rows; r += HS_LANES)
        for (int l = 0; l < HS_LANES; ++l) lane[l] += gains[r + l] * weight[r + l];
    for (int l = 0; r + l < rows; ++l) lane[l] += gains[r + l] * weight[r + l];
    return hs_lanes_sum(lane);
}

/* Radii of the circles with the areas of patches, which are linear in the approach between the rows
 * of the table. */
static void equal_radii(const hs_patches *patches, double approach, double *target) {
    int64_t above = hs_count_touching(patches->approach, patches->rows + 1, approach);
    if (above < 1) above = 1;
    if (above > patches->rows) above = patches->rows;
    const double *low = patches->area + (above - 1) * patches->count, *high = low + patches->count;
    double lower = patches->approach[above - 1];
    double fraction = hs_min((approach - lower) / (patches->approach[above] - lower), 1.0);
    for (int64_t i = 0; i < patches->count; ++i)
        target[i] = sqrt(((1.0 - fraction) * low[i] + fraction * high[i]) / 3.141592653589793);
}

int hs_record_patches(const hs_patches *patches, const hs_rows *knots, int64_t count,
                      const double *approach, const double *stick, double friction,
                      const hs_rows *rows) {
    double *weights = (double *)malloc(2 * (size_t)patches->rows * sizeof *weights);
    if (!weights) return HS_OUT_OF_MEMORY;
    for (int64_t r = 0; r < count; ++r) {
        int64_t from = r * knots->columns, at = r * patches->count;
        gather(knots->normal_load + from, knots->columns, patches, weights);
        gather(knots->tangential_load + from, knots->columns, patches, weights + patches->rows);
        if (r > 0 && approach[r] == approach[r - 1])
            memcpy(rows->contact_radius + at, rows->contact_radius + at - patches->count,
                   (size_t)patches->count * sizeof(double));
        else
            equal_radii(patches, approach[r], rows->contact_radius + at);
        equal_radii(patches, stick[r], rows->stick_radius + at);
        int is_sticking = knots->slip_state[from] == HS_FULL_STICK;
        for (int64_t i = 0; i < patches->count; ++i) {
            double touch = patches->first_touch[i];
            rows->dissipated_energy[at + i] = 0.0;
            if (approach[r] <= touch) {
                rows->normal_load[at + i] = rows->tangential_load[at + i] = 0.0;
                rows->contact_radius[at + i] = rows->stick_radius[at + i] = 0.0;
                rows->slip_state[at + i] = HS_SEPARATED;
                continue;
            }
            const double *gains = patches->gain + i * patches->rows;
            double normal = hs_max(weighted_sum(gains, patches->rows, weights), 0.0);
            double tangential = weighted_sum(gains, patches->rows, weights + patches->rows);
            rows->normal_load[at + i] = normal;
            rows->tangential_load[at + i] = hs_clamp(tangential, friction * normal);
            rows->slip_state[at + i] = hs_slip_state_of(1, !is_sticking, stick[r] > touch);
        }
    }
    free(weights);
    return HS_OK;
}
