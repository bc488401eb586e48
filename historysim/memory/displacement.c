/* Displacement: normal load, tangential load T(d, V) and friction limit Σ μ P(d) of all groups,
 * from their polylines, and the root V of rigid·V + compliance·T(d, V) = value by Halley's method
 * in a bracket (README.md, theory 6 and 8). */

#include "displacement.h"
#include "lanes.h"
#include "state.h"

/* Added to a depth, to avoid division by zero; chosen. */
#define SMALL 1e-30

/* Iterations of the displacement from a guess, at most; chosen. */
#define MAX_REFINEMENTS 8

/* True if each of several asperities is a group. */
static int has_single_groups(const hs_contact *contact) {
    return contact->groups > 1 && contact->groups == contact->count;
}

/* Terms of the friction limit and the slopes for asperities in contact that each form a group. */
HS_WIDE static void limits(const double *restrict gap, const double *restrict weight,
                           const double *restrict friction, int count, double d,
                           double *restrict limit, double *restrict limit_slope,
                           double *restrict load_slope) {
    for (int i = 0; i < count; ++i) {
        double depth = d - gap[i], half_chord = weight[i] * sqrt(depth);
        limit[i] = friction[i] * half_chord * depth;
        limit_slope[i] = friction[i] * half_chord;
        load_slope[i] = half_chord;
    }
}

hs_limit hs_limit_and_slopes(const hs_line *memory, double d) {
    const hs_contact *contact = memory->contact;
    const double *friction = memory->friction;
    if (has_single_groups(contact)) {
        int64_t count = hs_count_touching(contact->gap, contact->count, d);
        double limit[HS_LANES] = {0}, limit_slope[HS_LANES] = {0}, load_slope[HS_LANES] = {0};
        double term[3][HS_BLOCK];
        for (int64_t start = 0; start < count; start += HS_BLOCK) {
            int size = hs_size_of_block(count - start);
            limits(contact->gap + start, contact->weight + start, friction + start, size, d,
                   term[0], term[1], term[2]);
            hs_add(limit, term[0], size);
            hs_add(limit_slope, term[1], size);
            hs_add(load_slope, term[2], size);
        }
        return HS_MADE(hs_limit){hs_lanes_sum(limit), 1.5 * hs_lanes_sum(limit_slope),
                                 1.5 * hs_lanes_sum(load_slope)};
    }
    hs_limit result = {0.0, 0.0, 0.0};
    for (int64_t index = 0; index < contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        if (group.curve.gap[0] >= d) break;
        hs_load group_load = hs_load_at(group.curve, d);
        result.limit += friction[index] * group_load.load;
        result.limit_slope += friction[index] * group_load.slope;
        result.load_slope += group_load.slope;
    }
    return result;
}

double hs_friction_limit(const hs_line *memory, double d, double load) {
    if (memory->contact->groups == 1) return memory->friction[0] * load;
    return hs_limit_and_slopes(memory, d).limit;
}

hs_range hs_friction_range(const hs_line *memory, double d) {
    const hs_contact *contact = memory->contact;
    hs_range range = {memory->friction[0], memory->friction[0]};
    for (int64_t index = 1; index < contact->groups && contact->gap[contact->first[index]] < d;
         ++index) {
        range.min = hs_min(range.min, memory->friction[index]);
        range.max = hs_max(range.max, memory->friction[index]);
    }
    return range;
}

HS_WIDE static void single_loads(const double *restrict gap, const double *restrict weight,
                                 int64_t count, double d, double *restrict load) {
    for (int64_t i = 0; i < count; ++i) {
        double depth = d - gap[i];
        load[i] = weight[i] * sqrt(depth) * depth;
    }
}

int hs_loads_of_groups(const hs_line *memory, double d, double load, hs_group_loads *loads) {
    const hs_contact *contact = memory->contact;
    int64_t count;
    loads->load = loads->single_load;
    loads->from = NULL;
    if (contact->groups == 1) {
        loads->count = d > contact->sorted_gap[0];
        loads->single_load[0] = load;
        return HS_OK;
    }
    if (has_single_groups(contact))
        count = hs_count_touching(contact->gap, contact->count, d);
    else
        for (count = 0; count < contact->groups && contact->gap[contact->first[count]] < d;)
            ++count;
    loads->count = count;
    if (count == 0) return HS_OK;
    loads->load = (double *)malloc((size_t)count * sizeof(double));
    if (!loads->load) return HS_OUT_OF_MEMORY;
    if (has_single_groups(contact)) {
        single_loads(contact->gap, contact->weight, count, d, loads->load);
        return HS_OK;
    }
    for (int64_t index = 0; index < count; ++index)
        loads->load[index] = hs_load_at(hs_group_of(memory, index).curve, d).load;
    return HS_OK;
}

void hs_free_group_loads(hs_group_loads *loads) {
    if (loads->load != loads->single_load) free(loads->load);
}

double hs_approach_at_load(const hs_line *memory, double load) {
    double present = memory->approach;
    if (load == memory->normal_load) return present;
    if (load <= 0.0) return hs_min(present, memory->contact->sorted_gap[0]);
    double approach = hs_label_at(hs_all_of(memory->contact), load, present, 0.0, 1.0);
    for (int64_t j = memory->depth[0] - 1; j > 0; --j) {
        double label = memory->vertices[j].label;
        if (fabs(label - approach) <= 4.0 * DBL_EPSILON * approach) return label;
        if (label < approach) break;
    }
    return approach;
}

int hs_init_fronts(hs_fronts *fronts, int64_t groups) {
    size_t count = (size_t)groups;
    double *memory = fronts->memory = (double *)calloc(11 * (count ? count : 1), sizeof *memory);
    if (!memory) return HS_OUT_OF_MEMORY;
    fronts->groups = groups;
    double **arrays[] = {&fronts->cone, &fronts->below,  &fronts->anchor, &fronts->jump,
                         &fronts->rate, &fronts->force,  &fronts->low,    &fronts->high,
                         &fronts->gap,  &fronts->weight, &fronts->off};
    for (size_t row = 0; row < 11; ++row) *arrays[row] = memory + row * count;
    for (size_t index = 0; index < count; ++index) fronts->low[index] = HUGE_VAL;
    return HS_OK;
}

void hs_free_fronts(hs_fronts *fronts) { free(fronts->memory); }

/* Remove the front of a group: an empty range of labels, and no contribution to sums. */
static void forget_front(hs_fronts *fronts, int64_t index) {
    for (int row = 0; row < 11; ++row) fronts->memory[row * fronts->groups + index] = 0.0;
    fronts->low[index] = HUGE_VAL;
}

/* Loads and derivatives of `count` groups with cached fronts, from group `from` on. */
HS_WIDE static void terms_on_fronts(const hs_fronts *fronts, const double *restrict load,
                                    int64_t from, int count, hs_point to, double *restrict force,
                                    double *restrict stiffness, double *restrict curvature) {
    const double *restrict cone = fronts->cone + from, *restrict below = fronts->below + from;
    const double *restrict anchor = fronts->anchor + from, *restrict rate = fronts->rate + from;
    const double *restrict jump = fronts->jump + from, *restrict held = fronts->force + from;
    const double *restrict low = fronts->low + from, *restrict high = fronts->high + from;
    const double *restrict gap = fronts->gap + from, *restrict weight = fronts->weight + from;
    double *restrict off = fronts->off + from;
    const double d = to.d, v = to.v;
    for (int g = 0; g < count; ++g) {
        /* label of the front on the line of its segment */
        double label = below[g] + ((v - anchor[g]) - cone[g] * (d - below[g])) * rate[g];
        double upper = high[g] < d ? high[g] : d;
        double depth = label - gap[g] > 0.0 ? label - gap[g] : 0.0,
               half_chord = weight[g] * sqrt(depth);
        off[g] = ((low[g] <= label) & (label <= upper)) ? 0.0 : 1.0;
        force[g] = held[g] + cone[g] * load[g] + jump[g] * half_chord * depth;
        stiffness[g] = half_chord;
        curvature[g] = half_chord * rate[g] / (depth + SMALL);
    }
}

/* Tangential load of the groups with cached fronts at the end of a path. Flags each group in `off`
 * whose front is outside its cached segment; returns 1 if there are any. */
static int force_on_fronts(const hs_fronts *fronts, const hs_group_loads *loads, hs_point to,
                           hs_force *result) {
    double force[HS_LANES] = {0}, stiffness[HS_LANES] = {0}, curvature[HS_LANES] = {0},
           misses[HS_LANES] = {0};
    double term[3][HS_BLOCK];
    for (int64_t start = 0; start < loads->count; start += HS_BLOCK) {
        int count = hs_size_of_block(loads->count - start);
        terms_on_fronts(fronts, loads->load + start, start, count, to, term[0], term[1], term[2]);
        hs_add(force, term[0], count);
        hs_add(stiffness, term[1], count);
        hs_add(curvature, term[2], count);
        hs_add(misses, fronts->off + start, count);
    }
    result->force = hs_lanes_sum(force);
    result->stiffness = 1.5 * hs_lanes_sum(stiffness);
    result->curvature = 0.75 * hs_lanes_sum(curvature);
    return hs_lanes_sum(misses) > 0.0;
}

int hs_force_at(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, hs_point to,
                hs_force *result) {
    hs_point from = {memory->approach, memory->displacement};
    if (!force_on_fronts(fronts, loads, to, result)) return HS_OK;
    hs_force sum = {0.0, 0.0, 0.0};
    hs_vertex *scratch = NULL;
    for (int64_t index = 0; index < loads->count; ++index) {
        if (fronts->off[index] == 0.0) continue;
        forget_front(fronts, index);
        hs_group group = hs_group_of(memory, index);
        int64_t depth = memory->depth[index];
        hs_force contribution = {0.0, 0.0, 0.0};
        if (loads->from) from.d = loads->from[index];
        if (memory->steep[index] && depth > 0) {
            if (!scratch) {
                size_t room = 2 * (size_t)hs_room_to_clip(hs_max_depth(memory));
                scratch = (hs_vertex *)malloc(room * sizeof *scratch);
                if (!scratch) return HS_OUT_OF_MEMORY;
            }
            hs_cone cone = {group.friction, 0.0, 0.0, 0.0};
            int64_t count = hs_move_and_clip(&group, NULL, depth, from, to, loads->load[index],
                                             &cone, scratch, &contribution.stiffness);
            contribution.force = scratch[count - 1].tangential;
        } else {
            contribution =
                hs_force_of_group(&group, depth, from, to, loads->load[index], fronts, index);
        }
        sum.force += contribution.force;
        sum.stiffness += contribution.stiffness;
        sum.curvature += contribution.curvature;
    }
    free(scratch);
    force_on_fronts(fronts, loads, to, result);
    result->force += sum.force;
    result->stiffness += sum.stiffness;
    result->curvature += sum.curvature;
    return HS_OK;
}

int hs_force_on_path(hs_line *memory, hs_fronts *fronts, double d, double v, double *force) {
    hs_group_loads loads;
    hs_force result;
    hs_point to = {d, v};
    double load = hs_load_at(hs_all_of(memory->contact), d).load;
    int status = hs_loads_of_groups(memory, d, load, &loads);
    if (status != HS_OK) return status;
    status = hs_force_at(memory, &loads, fronts, to, &result);
    hs_free_group_loads(&loads);
    *force = result.force;
    return status;
}

static void guess_fronts(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts,
                         double sign) {
    for (int64_t index = 0; index < loads->count; ++index) {
        if (memory->depth[index] > 1 && fronts->low[index] == HUGE_VAL && !memory->steep[index]) {
            hs_group group = hs_group_of(memory, index);
            hs_guess_front(fronts, index, &group, memory->depth[index], sign);
        }
    }
}

/* Displacement nearest to the present one at which every spring slides, on a straight path to
 * approach d1. */
static double sliding_displacement(const hs_line *memory, const hs_group_loads *loads, double d1,
                                   double side) {
    double v0 = memory->displacement, reach = -HUGE_VAL;
    for (int64_t index = 0; index < loads->count; ++index) {
        double friction = memory->friction[index],
               d0 = loads->from ? loads->from[index] : memory->approach;
        const hs_vertex *stack = memory->vertices + index * memory->capacity;
        if (d1 > d0) reach = hs_max(reach, side * v0 + friction * (d1 - d0));
        for (int64_t j = 0; j < memory->depth[index]; ++j) {
            if (stack[j].label > d1 || (j > 0 && !memory->steep[index])) break;
            reach = hs_max(reach, side * stack[j].anchor + friction * (d1 - stack[j].label));
        }
    }
    return side * reach;
}

/* Halley iterate from v, or bisection if it is outside the bracket; at most `stride` from v. */
static double halley_iterate(double v, double residual, double stiffness, double curvature,
                             double low, double high, double stride) {
    double step = stiffness > 0.0 ? residual / stiffness : HUGE_VAL;
    double curvature_term = stiffness > 0.0 ? 0.5 * curvature * step / stiffness : HUGE_VAL;
    if (fabs(curvature_term) < 0.25) step /= 1.0 + curvature_term;
    double trial = v + step;
    if (!(low < trial && trial < high)) trial = 0.5 * (low + high);
    if (!(fabs(trial - v) <= stride)) trial = v + copysign(stride, residual);
    return trial;
}

int hs_refine_displacement(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts,
                           double force, double accuracy, hs_point *point) {
    for (int iteration = 0; iteration < MAX_REFINEMENTS; ++iteration) {
        hs_force found;
        double previous = point->v;
        int status = hs_force_at(memory, loads, fronts, *point, &found);
        if (status != HS_OK) return status;
        if (!(found.stiffness > 0.0)) break;
        point->v = halley_iterate(previous, force - found.force, found.stiffness, found.curvature,
                                  -HUGE_VAL, HUGE_VAL, HUGE_VAL);
        if (fabs(point->v - previous) <= accuracy) return HS_OK;
    }
    point->v = NAN;
    return HS_OK;
}

int hs_solve_displacement(hs_line *memory, double d, double load, hs_target target,
                          double *displacement) {
    hs_group_loads loads;
    hs_fronts fronts;
    fronts.memory = NULL;
    int status = hs_loads_of_groups(memory, d, load, &loads);
    if (status == HS_OK) status = hs_init_fronts(&fronts, loads.count);
    if (status == HS_OK)
        status = hs_solve_displacement_with(memory, &loads, &fronts, d, target, displacement);
    hs_free_fronts(&fronts);
    hs_free_group_loads(&loads);
    return status;
}

/* Friction limit from the loads of groups. */
static double limit_of(const hs_line *memory, const hs_group_loads *loads) {
    double limit = 0.0;
    for (int64_t index = 0; index < loads->count; ++index)
        limit += memory->friction[index] * loads->load[index];
    return limit;
}

/* If nothing is in contact at d, the displacement for a load is the anchor of the last spring to
 * separate, of the highest summit. */
int hs_solve_displacement_with(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts,
                               double d, hs_target target, double *displacement) {
    if (loads->count == 0) {
        *displacement = target.rigid > 0.0     ? target.value
                        : memory->depth[0] > 0 ? memory->vertices[0].anchor
                                               : memory->displacement;
        return HS_OK;
    }
    if (d == memory->approach) {
        double v = memory->displacement;
        double residual =
            target.value - target.rigid * v - target.compliance * hs_total_force(memory);
        if (fabs(residual) <= HS_TIE * (target.rigid * fabs(target.value) +
                                        target.compliance * limit_of(memory, loads))) {
            /* within rounding of the target */
            *displacement = v;
            return HS_OK;
        }
    }
    return hs_search_displacement(memory, loads, fronts, d, target, displacement);
}

/* A load at the friction limit is reached at the displacement at which the last spring begins to
 * slide. */
int hs_search_displacement(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts,
                           double d, hs_target target, double *displacement) {
    double target_value = target.value, rigid = target.rigid, compliance = target.compliance;
    double limit = limit_of(memory, loads);
    double reach = hs_friction_range(memory, HUGE_VAL).max * (d - memory->contact->sorted_gap[0]),
           stride = HUGE_VAL;
    if (rigid == 0.0) {
        if (fabs(target_value) >= (1.0 - HS_TIE) * limit) {
            *displacement = sliding_displacement(memory, loads, d, copysign(1.0, target_value));
            return HS_OK;
        }
        /* a sliding contact has no stiffness, so steps are bounded */
        stride = reach;
    }
    double accuracy = 4.0 * DBL_EPSILON * (rigid * fabs(target_value) + compliance * limit);
    double low = -HUGE_VAL, high = HUGE_VAL, v = memory->displacement;
    double change = target_value - rigid * v - compliance * memory->tangential_load;
    /* a small initial offset, so that the first stiffness is the one-sided derivative in the
     * direction of motion */
    if (change != 0.0) v += copysign(1e-9 * reach, change);
    /* at the first iterate new springs still stick, so that fronts are only guessed for the
     * following one */
    int guess_iteration = d > memory->approach ? 1 : 0;
    for (int iteration = 0; iteration < 200; ++iteration) {
        if (iteration == guess_iteration)
            guess_fronts(memory, loads, fronts, copysign(1.0, change));
        hs_point to = {d, v};
        hs_force force;
        int status = hs_force_at(memory, loads, fronts, to, &force);
        if (status != HS_OK) return status;
        double residual = target_value - rigid * v - compliance * force.force;
        if (fabs(residual) <= accuracy) break;
        if (residual > 0.0)
            low = v;
        else
            high = v;
        double trial = halley_iterate(v, residual, rigid + compliance * force.stiffness,
                                      compliance * force.curvature, low, high, stride);
        if (trial == low || trial == high || trial == v) break;
        v = trial;
    }
    *displacement = v;
    return HS_OK;
}
