/* Readout: loads, stiffnesses, slopes, tractions, energies and rows of a memory, from its polylines: sums of slope times differences
 * of P and P' (README.md, theory 8). The memory is only read. */

#include "readout.h"
#include "lanes.h"
#include "line.h"
#include "losses.h"

/* places in each segment at which tractions are looked at, before the largest is refined */
#define SAMPLES 16

/* Which springs of a group slide. After a fall of μ an inner disc may slide while the edge sticks. */
static hs_zone slip_zone(const hs_vertex *stack, int64_t depth, double displacement, double friction, int steep) {
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

/* Add dT/dV of a group at a fixed approach when the displacement goes on in a direction, 1 or -1; with 0 that of the springs
 * that stick now, without those that slide either way. Those below a label stick but for inner discs, where it is steep. */
static inline void add_stiffness(const hs_line *memory, int64_t index, double direction, double label, double *stiffness) {
    hs_group group = hs_group_of(memory, index);
    const hs_vertex *stack = group.stack;
    int everywhere = direction == 0.0 || group.friction == 0.0;
    int known = group.single && label == memory->known_label;
    *stiffness += known ? memory->known_slope : hs_load_at(group.curve, label).slope;
    for (int64_t j = memory->steep[index] ? memory->depth[index] - 2 : 0; j > 0; --j) {
        double side = hs_sliding_side(stack, memory->depth[index], j, memory->displacement, group.friction);
        if (side != 0.0 && (everywhere || side == direction))
            *stiffness -= hs_load_at(group.curve, stack[j].label).slope - hs_load_at(group.curve, stack[j - 1].label).slope;
    }
}

double hs_line_stiffness(const hs_line *memory, int direction) {
    double stiffness = 0.0;
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

double hs_line_normal_stiffness(const hs_line *memory) {
    const hs_units *units = &memory->contact->units;
    return hs_load_at(hs_all_of(memory->contact), memory->approach).slope * units->load / units->length;
}

double hs_line_stored_energy(const hs_line *memory) {
    return hs_elastic_energy(memory, NULL) * memory->contact->units.energy;
}

/* Springs that slide lie on the cone, v = ±μ (d - a): they move with the approach alone. Springs that stick move with the
 * displacement alone, but for those that touched on the path: v = (V1 - V0) (d1 - a)/(d1 - d0) moves with both. The loads
 * are ∫ v N'' da, so that each part between labels adds differences of P and P' at its ends. The derivatives are those on
 * the side of the path: where it turned around, those of the way on which it came last. */
hs_slopes hs_line_slopes(const hs_line *memory, double start) {
    const hs_units *units = &memory->contact->units;
    double d0 = start / units->length, d1 = memory->approach, v1 = memory->displacement;
    hs_slopes found = {0.0, 0.0, 0.0};
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index) {
        hs_group group = hs_group_of(memory, index);
        const hs_vertex *stack = group.stack;
        double friction = group.friction;
        int64_t depth = memory->depth[index], top = depth - 1;
        hs_load edge = hs_load_at(group.curve, d1);
        found.normal += edge.slope;
        found.tangential += edge.slope;
        if (d1 > d0 && top > 0 && hs_sliding_side(stack, depth, top, v1, friction) == 0.0) {
            double first = hs_most(d0, group.curve.gap[0]), way = d1 - d0;
            hs_load inner = hs_load_at(group.curve, first);
            double rise = edge.load - inner.load;
            found.tangential += (rise - (d1 - first) * inner.slope) / way - (edge.slope - inner.slope);
            found.coupling += stack[top].slope * (edge.slope - ((first - d0) * inner.slope + rise) / way);
        }
        int64_t last = memory->steep[index] || top < 1 ? 0 : top - 1;
        for (int64_t j = top; j > last; --j) {
            double side = hs_sliding_side(stack, depth, j, v1, friction);
            if (side == 0.0) continue;
            double upper = hs_load_at(group.curve, stack[j].label).slope;
            double lower = hs_load_at(group.curve, stack[j - 1].label).slope;
            found.tangential -= upper - lower;
            found.coupling += side * friction * (upper - lower);
        }
    }
    found.tangential *= units->stiffness;
    found.coupling *= units->load / units->length;
    found.normal *= units->load / units->length;
    return found;
}

/* Where a point of the contact is, by the label from which on it touches: that itself where asperities carry, between knots
 * the stiffness then, in proportion to the radius of an axisymmetric contact (Sneddon 1965). */
static double place_of(hs_curve curve, double label) {
    return curve.load ? hs_load_at(curve, label).slope : label;
}

/* By how much the pressure at a place rises between two approaches, times a factor of its own. Of asperities pressures are
 * Hertz's; between knots they are those of the axisymmetric contact with this curve, whose dp/da is 1/√(P'² - s²). */
static double rise_of_pressure(hs_curve curve, double low, double high, double place) {
    if (!curve.load) return sqrt(hs_most(high - place, 0.0)) - sqrt(hs_most(low - place, 0.0));
    double rise = 0.0;
    int64_t i = hs_count_touching(curve.gap, curve.count, low);
    for (i -= i > 0; i < curve.count && curve.gap[i] < high; ++i) {
        double begin = hs_most(low, curve.gap[i]), end = i + 1 < curve.count ? hs_least(high, curve.gap[i + 1]) : high;
        if (end <= begin) continue;
        double bend = hs_bend_at(curve, i), last = curve.weight[i] + bend * (end - curve.gap[i]);
        double first = hs_most(curve.weight[i] + bend * (begin - curve.gap[i]), place);
        if (last <= place) continue;
        double root = sqrt((last - place) * (last + place));
        /* where the stiffness does not rise the logarithm is rounding */
        rise += last - first > 1e-9 * last
                    ? log((last + root) / (first + sqrt((first - place) * (first + place)))) / bend
                    : (end - begin) / root;
    }
    return rise;
}

/* |τ|/(μ p) at a place. */
static double traction_ratio(const hs_group *group, int64_t depth, double place) {
    const hs_vertex *stack = group->stack;
    double traction = 0.0, pressure = rise_of_pressure(group->curve, stack[0].label, stack[depth - 1].label, place);
    for (int64_t j = depth - 1; j > 0 && place_of(group->curve, stack[j].label) > place; --j)
        traction += stack[j].slope * rise_of_pressure(group->curve, stack[j - 1].label, stack[j].label, place);
    return pressure > 0.0 ? fabs(traction) / (group->friction * pressure) : 0.0;
}

/* The largest |τ|/(μ p) of a group where that exceeds 1, found to about 1e-4. */
static double largest_traction_ratio(const hs_group *group, int64_t depth) {
    const hs_vertex *stack = group->stack;
    if (depth < 2 || group->friction == 0.0) return 0.0;
    double largest = 0.0;
    /* at the edge of a punch, where nothing more comes into contact, all pressures are without end */
    if (place_of(group->curve, stack[depth - 1].label) > place_of(group->curve, stack[depth - 2].label))
        largest = fabs(stack[depth - 1].slope) / group->friction;
    double steepest = 0.0;
    for (int64_t j = depth - 1; j > 0; --j) {
        /* tractions are sums over the segments farther out, so that their largest slope bounds the ratio */
        steepest = hs_most(steepest, fabs(stack[j].slope));
        if (steepest <= group->friction * hs_most(largest, 1.0)) continue;
        /* below a vertex tractions change with the root of the distance to it */
        double high = place_of(group->curve, stack[j].label), best = 0.0, at_best = 0.0;
        double width = sqrt(hs_most(high - place_of(group->curve, stack[j - 1].label), 0.0));
        if (width == 0.0) continue;
        for (int i = 1; i <= SAMPLES; ++i) {
            double x = width * i / SAMPLES, here = traction_ratio(group, depth, high - x * x);
            if (here > best) {
                best = here;
                at_best = i;
            }
        }
        double low_x = width * hs_most(at_best - 1.0, 0.01) / SAMPLES;
        double high_x = width * hs_least(at_best + 1.0, SAMPLES) / SAMPLES;
        for (int turn = 0; turn < 12; ++turn) {
            double third = (high_x - low_x) / 3.0, x_left = low_x + third, x_right = high_x - third;
            double left = traction_ratio(group, depth, high - x_left * x_left);
            double right = traction_ratio(group, depth, high - x_right * x_right);
            best = hs_most(best, hs_most(left, right));
            if (left < right)
                low_x = x_left;
            else
                high_x = x_right;
        }
        largest = hs_most(largest, best);
    }
    return largest;
}

HS_WIDE static void circles(const double *restrict gap, const double *restrict weight, int count, double approach,
                            double *restrict area) {
    for (int i = 0; i < count; ++i) area[i] = weight[i] * weight[i] * (approach - gap[i]);
}

/* Σ k² (a - h), the real contact area over π. */
static double real_area(const hs_contact *contact, int64_t touching, double approach) {
    double area[HS_BLOCK], lane[HS_LANES] = {0};
    int64_t size;
    for (int64_t begin = 0; begin < touching; begin += size) {
        /* linear in the gap, so that a cluster has one proxy at any distance */
        const hs_cluster *cluster = NULL;
        size = hs_size_of_block(touching - begin);
        if (contact->sorted_clusters) cluster = hs_cluster_at(contact->sorted_clusters, begin, touching, HUGE_VAL, &size);
        if (cluster)
            area[0] = cluster->circles * (approach - cluster->circles_gap);
        else
            circles(contact->sorted_gap + begin, contact->sorted_weight + begin, (int)size, approach, area);
        hs_add(lane, area, cluster ? 1 : (int)size);
    }
    return hs_lanes_sum(lane);
}

/* What of the normal load stands on asperities that have yielded, and what that has taken. */
static void record_yielded(const hs_line *memory, hs_totals *totals) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    double on_yielded = 0.0;
    for (int64_t index = 0; index < contact->groups && memory->depth[index] > 0; ++index)
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i) {
            if (contact->gap[i] >= memory->approach) break;
            if (evolved->yielding_load[contact->order[i]] > 0.0)
                on_yielded += hs_load_of_one(contact->gap[i], contact->weight[i], memory->approach).load;
        }
    totals->yielding_energy = evolved->yielded_energy;
    if (memory->normal_load > 0.0) totals->yielded_share = hs_least(on_yielded / memory->normal_load, 1.0);
}

/* Where there are columns, note the zones of all groups for them. */
static void record_totals(hs_recorder *recorder, const hs_line *memory, hs_totals *totals, int saturated) {
    const hs_contact *contact = memory->contact;
    const hs_units *units = &contact->units;
    double limit = 0.0, ratio = 1.0, stiffness = 0.0;
    int64_t index = 0;
    for (; index < contact->groups && memory->depth[index] > 0; ++index) {
        const hs_vertex *stack = memory->vertices + index * memory->capacity;
        int64_t depth = memory->depth[index];
        hs_zone zone = slip_zone(stack, depth, memory->displacement, memory->friction[index], memory->steep[index]);
        if (recorder->zones) recorder->zones[index] = zone;
        add_stiffness(memory, index, 0.0, zone.boundary, &stiffness);
        if (memory->steep[index]) {
            hs_group group = hs_group_of(memory, index);
            ratio = hs_most(ratio, largest_traction_ratio(&group, depth));
        }
        limit += memory->friction[index] * stack[depth - 1].normal;
    }
    hs_zone none = {-HUGE_VAL, -HUGE_VAL, 0.0, 0.0};
    for (; recorder->zones && index < contact->groups; ++index) recorder->zones[index] = none;
    int64_t touching = hs_line_contact_count(memory);
    totals->normal_load = memory->normal_load * units->load;
    totals->tangential_load = memory->tangential_load * units->load;
    totals->approach = memory->approach * units->length;
    totals->displacement = memory->displacement * units->displacement;
    totals->contact_count = (double)touching;
    totals->real_contact_area = contact->load ? 0.0 : real_area(contact, touching, memory->approach) * units->area;
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

/* Add the contributions of the vertices from `first` up to `last` of a group to the tangential loads of asperities: what the
 * label and the jump of slope of each say. */
HS_WIDE static void add_inner_forces(const hs_vertex *stack, int64_t first, int64_t last, const double *restrict gap,
                                     const double *restrict weight, int64_t count, int ascending, double *restrict force) {
    for (int64_t j = first; j <= last; ++j) {
        double label = stack[j].label, jump = stack[j].slope - stack[j + 1].slope;
        int64_t touching = ascending ? hs_count_touching(gap, count, label) : count;
        for (int64_t i = 0; i < touching; ++i) {
            double depth_there = label - gap[i] > 0.0 ? label - gap[i] : 0.0;
            force[i] += jump * weight[i] * depth_there * sqrt(depth_there);
        }
    }
}

/* The same of all inner vertices of a single group, in the order of columns. Deep ones stay from row to row: their sum is kept, so
 * that a row costs what has changed. The order of the sum is that of the vertices, and so are its bits. */
static int single_inner_forces(hs_recorder *recorder, const hs_vertex *stack, int64_t depth, const double **inner) {
    const hs_vertex *before = recorder->stack;
    const hs_columns *columns = &recorder->columns;
    const int64_t count = recorder->rows->columns;
    const size_t size = (size_t)count * sizeof(double);
    int64_t same = 0;
    while (same < recorder->depth && same < depth && before[same].label == stack[same].label &&
           before[same].slope == stack[same].slope)
        ++same;
    /* what a vertex adds depends on the slope above it, too */
    int64_t stays = same > 2 ? same - 2 : 0;
    if (stays < recorder->summed || recorder->summed == 0) {
        recorder->summed = 0;
        memset(recorder->kept, 0, size);
    }
    add_inner_forces(stack, recorder->summed + 1, stays, columns->gap, columns->weight, count, 0, recorder->kept);
    recorder->summed = stays;
    *inner = recorder->kept;
    if (stays < depth - 2) {
        memcpy(recorder->inner, recorder->kept, size);
        add_inner_forces(stack, stays + 1, depth - 2, columns->gap, columns->weight, count, 0, recorder->inner);
        *inner = recorder->inner;
    }
    hs_vertex *more = (hs_vertex *)realloc(recorder->stack, (size_t)depth * sizeof *more);
    if (!more) return HS_OUT_OF_MEMORY;
    recorder->stack = more;
    recorder->depth = depth;
    memcpy(more, stack, (size_t)depth * sizeof *stack);
    return HS_OK;
}

/* Fill in normal loads, also without dimension, and contact radii of asperities in any order. */
HS_WIDE static void project_normal(const double *restrict gap, const double *restrict weight, int64_t count,
                                   double approach, const hs_units *units, double *restrict load,
                                   double *restrict normal, double *restrict radius) {
    const double load_unit = units->load, radius_unit = units->radius;
    for (int64_t i = 0; i < count; ++i) {
        double own = approach - gap[i] > 0.0 ? approach - gap[i] : 0.0, x = sqrt(own);
        load[i] = x * own * weight[i];
        normal[i] = load[i] * load_unit;
        radius[i] = weight[i] * x * radius_unit;
    }
}

/* Fill in tangential loads, stick radii and slip states of asperities in any order, with the numbers of their zones one after
 * the other. `force` holds the shares of the tangential load that the inner vertices have, dimensionless, and gets that of the
 * edge; rounding does not carry it beyond the limit. */
HS_WIDE static void project_tangential(const double *restrict gap, const double *restrict weight, const double *restrict load,
                                       int64_t count, double approach, double (*restrict zone)[HS_BLOCK],
                                       const hs_units *units, double *restrict force, double *restrict stick,
                                       int8_t *restrict state) {
    const double load_unit = units->load, radius_unit = units->radius;
    for (int64_t i = 0; i < count; ++i) {
        double boundary = zone[0][i], outermost = zone[1][i], friction = zone[2][i], slope = zone[3][i];
        double inner = boundary - gap[i] > 0.0 ? boundary - gap[i] : 0.0, limit = friction * fabs(load[i]);
        double share = force[i] + slope * load[i];
        share = share > -limit ? share : -limit;
        share = share < limit ? share : limit;
        int touches = gap[i] < approach;
        force[i] = touches ? share * load_unit : 0.0;
        stick[i] = weight[i] * sqrt(inner) * radius_unit;
        state[i] = hs_slip_state_of(touches, outermost > gap[i], boundary > gap[i]);
    }
}

/* Fill in the columns of a curve with knots: what the springs of each knot carry, those that touch from its label up to that of
 * the next one. Radii stand for labels: their squares are in proportion to approaches from the knot on. */
static void record_knots(const hs_recorder *recorder, const hs_line *memory, int64_t row) {
    const hs_rows *rows = recorder->rows;
    hs_curve curve = hs_all_of(memory->contact);
    const hs_vertex *stack = memory->vertices;
    const hs_units *units = &memory->contact->units;
    int64_t depth = memory->depth[0], columns = rows->columns;
    double boundary = recorder->zones[0].boundary, outermost = recorder->zones[0].outermost;
    for (int64_t c = 0; c < columns; ++c) {
        int64_t i = recorder->columns.place[c], at = row * columns + c, j = 1;
        double label = curve.gap[i], force[2], load[2];
        for (int side = 0; side < 2; ++side) {
            double end = side == 0 ? label : i + 1 < curve.count ? curve.gap[i + 1] : HUGE_VAL;
            while (j < depth - 1 && stack[j].label < end) ++j;
            int whole = end >= stack[j].label;
            load[side] = whole ? stack[j].normal : side == 0 ? curve.load[i] : curve.load[i + 1];
            force[side] = stack[j].tangential - (whole ? 0.0 : stack[j].slope * (stack[j].normal - load[side]));
        }
        int touches = label < memory->approach;
        double normal = touches ? hs_most(load[1] - load[0], 0.0) : 0.0;
        double limit = memory->steep[0] ? HUGE_VAL : memory->friction[0] * normal;
        rows->normal_load[at] = normal * units->load;
        rows->tangential_load[at] = touches ? hs_clamp(force[1] - force[0], limit) * units->load : 0.0;
        rows->contact_radius[at] = touches ? sqrt(memory->approach - label) * units->radius : 0.0;
        rows->stick_radius[at] = touches ? sqrt(hs_most(boundary - label, 0.0)) * units->radius : 0.0;
        rows->slip_state[at] = hs_slip_state_of(touches, outermost > label, boundary > label);
    }
}

/* Fill in the dissipated energies of the columns. */
static void record_energies(const hs_recorder *recorder, const hs_line *memory, int64_t at) {
    const double unit = memory->contact->units.energy;
    double *target = recorder->rows->dissipated_energy;
    for (int64_t c = 0; target && c < recorder->rows->columns; ++c)
        target[at + c] = memory->dissipated_each[recorder->columns.place[c]] * unit;
}

/* Fill in loads, radii and slip states of the columns, block by block, so that each is computed where the processor caches it;
 * `inner` holds the contributions of inner vertices to tangential loads, by column or by position. */
static void record_columns(const hs_recorder *recorder, const hs_line *memory, int64_t at, const double *inner, int by_column) {
    const hs_rows *rows = recorder->rows;
    const hs_contact *contact = memory->contact;
    const hs_columns *columns = &recorder->columns;
    double zone[4][HS_BLOCK], load[HS_BLOCK];
    for (int64_t begin = 0; begin < rows->columns; begin += HS_BLOCK) {
        int count = hs_size_of_block(rows->columns - begin);
        const double *gap = columns->gap + begin, *weight = columns->weight + begin;
        double *force = rows->tangential_load + at + begin;
        /* of an asperity that does not touch it may be an old one, which is not used */
        if (by_column)
            memcpy(force, inner + begin, (size_t)count * sizeof *force);
        else
            for (int i = 0; i < count; ++i) force[i] = inner[columns->place[begin + i]];
        /* of a single group all zones are the same */
        for (int i = 0; i < count && (begin == 0 || contact->groups > 1); ++i) {
            const hs_zone *own = recorder->zones + columns->group[begin + i];
            zone[0][i] = own->boundary;
            zone[1][i] = own->outermost;
            zone[2][i] = own->friction;
            zone[3][i] = own->slope;
        }
        project_normal(gap, weight, count, memory->approach, &contact->units, load, rows->normal_load + at + begin,
                       rows->contact_radius + at + begin);
        project_tangential(gap, weight, load, count, memory->approach, zone, &contact->units, force,
                           rows->stick_radius + at + begin, rows->slip_state + at + begin);
    }
}

static int record_asperities(hs_recorder *recorder, const hs_line *memory, int64_t row) {
    const hs_contact *contact = memory->contact;
    const double *inner = recorder->inner;
    int single = contact->groups == 1, status = HS_OK;
    if (contact->load && memory->depth[0] > 0) {
        record_knots(recorder, memory, row);
        return status;
    }
    if (single && memory->depth[0] > 0) status = single_inner_forces(recorder, memory->vertices, memory->depth[0], &inner);
    for (int64_t index = 0; !single && index < contact->groups && memory->depth[index] > 0; ++index) {
        hs_group group = hs_group_of(memory, index);
        memset(recorder->inner + group.start, 0, (size_t)group.curve.count * sizeof(double));
        add_inner_forces(group.stack, 1, memory->depth[index] - 2, group.curve.gap, group.curve.weight, group.curve.count, 1,
                         recorder->inner + group.start);
    }
    record_columns(recorder, memory, row * recorder->rows->columns, inner, single);
    return status;
}

/* Find where the recorded asperities are in the order of a contact. */
static int place_columns(hs_recorder *recorder, hs_contact *contact) {
    const hs_columns *all = hs_contact_columns(contact);
    const hs_rows *rows = recorder->rows;
    hs_columns *columns = &recorder->columns;
    if (!all) return HS_OUT_OF_MEMORY;
    if (recorder->all) *columns = *all;
    for (int64_t c = 0; !recorder->all && contact != recorder->contact && c < rows->columns; ++c) {
        int64_t asperity = rows->asperity[c];
        columns->gap[c] = all->gap[asperity];
        columns->weight[c] = all->weight[asperity];
        columns->place[c] = all->place[asperity];
        columns->group[c] = all->group[asperity];
    }
    if (contact != recorder->contact) recorder->depth = recorder->summed = 0;
    recorder->contact = contact;
    return HS_OK;
}

int hs_begin_recording(hs_recorder *recorder, hs_contact *contact, const hs_rows *rows) {
    memset(recorder, 0, sizeof *recorder);
    recorder->rows = rows;
    if (!rows || rows->columns == 0) return HS_OK;
    size_t count = (size_t)contact->count, columns = (size_t)rows->columns, most = count > columns ? count : columns;
    recorder->all = columns == count;
    for (int64_t c = 0; c < rows->columns; ++c) {
        if (rows->asperity[c] < 0 || rows->asperity[c] >= contact->count) return HS_FOREIGN;
        recorder->all &= rows->asperity[c] == c;
    }
    recorder->inner = (double *)calloc(2 * most, sizeof(double));
    recorder->zones = (hs_zone *)malloc(count * sizeof *recorder->zones);
    recorder->chosen = recorder->all ? NULL : (double *)malloc(4 * columns * sizeof(double));
    if (!recorder->inner || !recorder->zones || !(recorder->all || recorder->chosen)) {
        hs_end_recording(recorder);
        return HS_OUT_OF_MEMORY;
    }
    recorder->kept = recorder->inner + most;
    if (recorder->all) return HS_OK;
    recorder->columns.gap = recorder->chosen;
    recorder->columns.weight = recorder->chosen + columns;
    recorder->columns.place = (int64_t *)(recorder->chosen + 2 * columns);
    recorder->columns.group = recorder->columns.place + columns;
    return HS_OK;
}

void hs_end_recording(hs_recorder *recorder) {
    free(recorder->chosen);
    free(recorder->inner);
    free(recorder->zones);
    free(recorder->stack);
}

int hs_record(hs_recorder *recorder, const hs_line *memory, int64_t row, int saturated) {
    const hs_rows *rows = recorder->rows;
    const hs_evolved *evolved = memory->evolved;
    int64_t columns = rows->columns, at = row * columns;
    if (columns && place_columns(recorder, memory->contact) != HS_OK) return HS_OUT_OF_MEMORY;
    record_totals(recorder, memory, rows->totals + row, saturated);
    if (columns == 0) return HS_OK;
    if (rows->normal_load && record_asperities(recorder, memory, row) != HS_OK) return HS_OUT_OF_MEMORY;
    record_energies(recorder, memory, at);
    for (int64_t c = 0; c < columns && rows->friction; ++c)
        rows->friction[at + c] = memory->friction[recorder->columns.group[c]];
    if (!evolved) return HS_OK;
    double *target[] = {rows->slid_distance, rows->worn_volume, rows->summit_height, rows->summit_radius};
    const double *source[] = {evolved->slid_distance, evolved->worn_volume, evolved->summit_height,
                              evolved->summit_radius};
    for (int k = 0; k < 4; ++k)
        for (int64_t c = 0; c < columns && target[k]; ++c) target[k][at + c] = source[k][rows->asperity[c]];
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
    int status = hs_begin_recording(&recorder, memory->contact, rows);
    if (status != HS_OK) return status;
    status = hs_record(&recorder, memory, row, memory->excess != 0.0);
    hs_end_recording(&recorder);
    return status;
}

/* Fill in what the springs that touch between two rows of the table carry, all that is superposed. */
static void gather(const double *knots, int64_t count, const hs_patches *patches, double *target) {
    memset(target, 0, (size_t)patches->rows * sizeof *target);
    for (int64_t k = 0; k < count; ++k) target[patches->row[k]] += knots[k];
}

/* What a patch has of that. */
static double weighted(const double *gains, int64_t rows, const double *weight) {
    double lane[HS_LANES] = {0};
    int64_t r = 0;
    for (; r + HS_LANES <= rows; r += HS_LANES)
        for (int l = 0; l < HS_LANES; ++l) lane[l] += gains[r + l] * weight[r + l];
    for (int l = 0; r + l < rows; ++l) lane[l] += gains[r + l] * weight[r + l];
    return hs_lanes_sum(lane);
}

/* Radii of the circles that have the areas of patches, straight between the rows of their table. */
static void equal_radii(const hs_patches *patches, double approach, double *target) {
    int64_t above = hs_count_touching(patches->approach, patches->rows + 1, approach);
    if (above < 1) above = 1;
    if (above > patches->rows) above = patches->rows;
    const double *low = patches->area + (above - 1) * patches->count, *high = low + patches->count;
    double begin = patches->approach[above - 1];
    double part = hs_least((approach - begin) / (patches->approach[above] - begin), 1.0);
    for (int64_t i = 0; i < patches->count; ++i)
        target[i] = sqrt(((1.0 - part) * low[i] + part * high[i]) / 3.141592653589793);
}

int hs_record_patches(const hs_patches *patches, const hs_rows *knots, int64_t count, const double *approach,
                      const double *stick, double friction, const hs_rows *rows) {
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
        int whole = knots->slip_state[from] == HS_FULL_STICK;
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
            double normal = hs_most(weighted(gains, patches->rows, weights), 0.0);
            double tangential = weighted(gains, patches->rows, weights + patches->rows);
            rows->normal_load[at + i] = normal;
            rows->tangential_load[at + i] = hs_clamp(tangential, friction * normal);
            rows->slip_state[at + i] = hs_slip_state_of(1, !whole, stick[r] > touch);
        }
    }
    free(weights);
    return HS_OK;
}
