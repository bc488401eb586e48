/* Displacement: the normal and tangential load and the friction limit of all groups together, from their polylines, and the
 * displacement that they share at a tangential load, by Newton's method (README.md, theory 6 and 8). */

#include "displacement.h"
#include "lanes.h"
#include "state.h"

/* avoids division by zero */
#define SMALL 1e-30

static int one_each(const hs_contact *contact) { return contact->groups > 1 && contact->groups == contact->count; }

/* Terms of the limit and of the slopes, of asperities that touch and are groups of their own. */
HS_WIDE static void limits(const double *restrict gap, const double *restrict weight, const double *restrict friction,
                           int count, double d, double *restrict limit, double *restrict limit_slope,
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
    if (one_each(contact)) {
        int64_t count = hs_count_touching(contact->gap, contact->count, d);
        double limit[HS_LANES] = {0}, limit_slope[HS_LANES] = {0}, load_slope[HS_LANES] = {0};
        double term[3][HS_BLOCK];
        for (int64_t begin = 0; begin < count; begin += HS_BLOCK) {
            int size = hs_size_of_block(count - begin);
            limits(contact->gap + begin, contact->weight + begin, friction + begin, size, d, term[0], term[1], term[2]);
            hs_add(limit, term[0], size);
            hs_add(limit_slope, term[1], size);
            hs_add(load_slope, term[2], size);
        }
        return HS_MADE(hs_limit){hs_lanes_sum(limit), 1.5 * hs_lanes_sum(limit_slope), 1.5 * hs_lanes_sum(load_slope)};
    }
    hs_limit found = {0.0, 0.0, 0.0};
    for (int64_t index = 0; index < contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        if (group.curve.gap[0] >= d) break;
        hs_load here = hs_load_at(group.curve, d);
        found.limit += friction[index] * here.load;
        found.limit_slope += friction[index] * here.slope;
        found.load_slope += here.slope;
    }
    return found;
}

double hs_friction_limit(const hs_line *memory, double d, double load) {
    if (memory->contact->groups == 1) return memory->friction[0] * load;
    return hs_limit_and_slopes(memory, d).limit;
}

hs_range hs_friction_range(const hs_line *memory, double d) {
    const hs_contact *contact = memory->contact;
    hs_range found = {memory->friction[0], memory->friction[0]};
    for (int64_t index = 1; index < contact->groups && contact->gap[contact->first[index]] < d; ++index) {
        found.least = hs_least(found.least, memory->friction[index]);
        found.most = hs_most(found.most, memory->friction[index]);
    }
    return found;
}

HS_WIDE static void loads_of_ones(const double *restrict gap, const double *restrict weight, int64_t count, double d,
                          double *restrict load) {
    for (int64_t i = 0; i < count; ++i) {
        double depth = d - gap[i];
        load[i] = weight[i] * sqrt(depth) * depth;
    }
}

/* Normal loads of the groups that touch at d, where they carry `load` together. */
int hs_loads_of_groups(const hs_line *memory, double d, double load, hs_group_loads *loads) {
    const hs_contact *contact = memory->contact;
    int64_t count;
    loads->load = loads->one;
    loads->from = NULL;
    if (contact->groups == 1) {
        loads->count = d > contact->sorted_gap[0];
        loads->one[0] = load;
        return HS_OK;
    }
    if (one_each(contact))
        count = hs_count_touching(contact->gap, contact->count, d);
    else
        for (count = 0; count < contact->groups && contact->gap[contact->first[count]] < d;) ++count;
    loads->count = count;
    if (count == 0) return HS_OK;
    loads->load = (double *)malloc((size_t)count * sizeof(double));
    if (!loads->load) return HS_OUT_OF_MEMORY;
    if (one_each(contact)) {
        loads_of_ones(contact->gap, contact->weight, count, d, loads->load);
        return HS_OK;
    }
    for (int64_t index = 0; index < count; ++index)
        loads->load[index] = hs_load_at(hs_group_of(memory, index).curve, d).load;
    return HS_OK;
}

void hs_free_group_loads(hs_group_loads *loads) {
    if (loads->load != loads->one) free(loads->load);
}

double hs_approach_at_load(const hs_line *memory, double load) {
    double present = memory->approach;
    if (load == memory->normal_load) return present;
    if (load <= 0.0) return hs_least(present, memory->contact->sorted_gap[0]);
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
    double **each[] = {&fronts->cone, &fronts->below, &fronts->anchor, &fronts->jump,   &fronts->rate, &fronts->force,
                       &fronts->low,  &fronts->high,  &fronts->gap,    &fronts->weight, &fronts->off};
    for (size_t row = 0; row < 11; ++row) *each[row] = memory + row * count;
    for (size_t index = 0; index < count; ++index) fronts->low[index] = HUGE_VAL;
    return HS_OK;
}

void hs_free_fronts(hs_fronts *fronts) { free(fronts->memory); }

/* Leave a group without a front: nothing is between its labels, and it adds nothing to a sum. */
static void forget_front(hs_fronts *fronts, int64_t index) {
    for (int row = 0; row < 11; ++row) fronts->memory[row * fronts->groups + index] = 0.0;
    fronts->low[index] = HUGE_VAL;
}

/* The terms of the sums below, of groups from one on. */
HS_WIDE static void terms_on_fronts(const hs_fronts *fronts, const double *restrict load, int64_t from, int count,
                                    hs_point to, double *restrict force, double *restrict stiffness,
                                    double *restrict curvature) {
    const double *restrict cone = fronts->cone + from, *restrict below = fronts->below + from;
    const double *restrict anchor = fronts->anchor + from, *restrict rate = fronts->rate + from;
    const double *restrict jump = fronts->jump + from, *restrict held = fronts->force + from;
    const double *restrict low = fronts->low + from, *restrict high = fronts->high + from;
    const double *restrict gap = fronts->gap + from, *restrict weight = fronts->weight + from;
    double *restrict off = fronts->off + from;
    const double d = to.d, v = to.v;
    for (int g = 0; g < count; ++g) {
        /* the label of the front on the segment, or beyond its ends */
        double label = below[g] + ((v - anchor[g]) - cone[g] * (d - below[g])) * rate[g];
        double last = high[g] < d ? high[g] : d;
        double depth = label - gap[g] > 0.0 ? label - gap[g] : 0.0, half_chord = weight[g] * sqrt(depth);
        off[g] = ((low[g] <= label) & (label <= last)) ? 0.0 : 1.0;
        force[g] = held[g] + cone[g] * load[g] + jump[g] * half_chord * depth;
        stiffness[g] = half_chord;
        curvature[g] = half_chord * rate[g] / (depth + SMALL);
    }
}

/* Tangential load of the groups with fronts at the end of a path. Tells of each group whether its front is not on the
 * segment noted; returns whether that is so of any: they are to be found once more. */
static int force_on_fronts(const hs_fronts *fronts, const hs_group_loads *loads, hs_point to, hs_force *found) {
    double force[HS_LANES] = {0}, stiffness[HS_LANES] = {0}, curvature[HS_LANES] = {0}, misses[HS_LANES] = {0};
    double term[3][HS_BLOCK];
    for (int64_t begin = 0; begin < loads->count; begin += HS_BLOCK) {
        int count = hs_size_of_block(loads->count - begin);
        terms_on_fronts(fronts, loads->load + begin, begin, count, to, term[0], term[1], term[2]);
        hs_add(force, term[0], count);
        hs_add(stiffness, term[1], count);
        hs_add(curvature, term[2], count);
        hs_add(misses, fronts->off + begin, count);
    }
    found->force = hs_lanes_sum(force);
    found->stiffness = 1.5 * hs_lanes_sum(stiffness);
    found->curvature = 0.75 * hs_lanes_sum(curvature);
    return hs_lanes_sum(misses) > 0.0;
}

/* Tangential load at the end of a straight path, with its derivatives; fronts are looked up, or found and noted. */
int hs_force_at(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, hs_point to, hs_force *found) {
    hs_point from = {memory->approach, memory->displacement};
    if (!force_on_fronts(fronts, loads, to, found)) return HS_OK;
    hs_force sum = {0.0, 0.0, 0.0};
    hs_vertex *scratch = NULL;
    for (int64_t index = 0; index < loads->count; ++index) {
        if (fronts->off[index] == 0.0) continue;
        forget_front(fronts, index);
        hs_group group = hs_group_of(memory, index);
        int64_t depth = memory->depth[index];
        hs_force part = {0.0, 0.0, 0.0};
        if (loads->from) from.d = loads->from[index];
        if (memory->steep[index] && depth > 0) {
            if (!scratch) {
                size_t room = 2 * (size_t)hs_room_to_clip(hs_max_depth(memory));
                scratch = (hs_vertex *)malloc(room * sizeof *scratch);
                if (!scratch) return HS_OUT_OF_MEMORY;
            }
            hs_cone cone = {group.friction, 0.0, 0.0, 0.0};
            int64_t count = hs_move_and_clip(&group, NULL, depth, from, to, loads->load[index], &cone, scratch,
                                              &part.stiffness);
            part.force = scratch[count - 1].tangential;
        } else {
            part = hs_force_of_group(&group, depth, from, to, loads->load[index], fronts, index);
        }
        sum.force += part.force;
        sum.stiffness += part.stiffness;
        sum.curvature += part.curvature;
    }
    free(scratch);
    force_on_fronts(fronts, loads, to, found);
    found->force += sum.force;
    found->stiffness += sum.stiffness;
    found->curvature += sum.curvature;
    return HS_OK;
}

int hs_force_on_path(hs_line *memory, hs_fronts *fronts, double d, double v, double *force) {
    hs_group_loads loads;
    hs_force found;
    hs_point to = {d, v};
    double load = hs_load_at(hs_all_of(memory->contact), d).load;
    int status = hs_loads_of_groups(memory, d, load, &loads);
    if (status != HS_OK) return status;
    status = hs_force_at(memory, &loads, fronts, to, &found);
    hs_free_group_loads(&loads);
    *force = found.force;
    return status;
}

static void guess_fronts(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, double sign) {
    for (int64_t index = 0; index < loads->count; ++index) {
        if (memory->depth[index] > 1 && fronts->low[index] == HUGE_VAL && !memory->steep[index]) {
            hs_group group = hs_group_of(memory, index);
            hs_guess_front(fronts, index, &group, memory->depth[index], sign);
        }
    }
}

/* Displacement nearest to the present one at which, on a straight path to approach d1, every spring slides. */
static double sliding_displacement(const hs_line *memory, const hs_group_loads *loads, double d1, double side) {
    double v0 = memory->displacement, reach = -HUGE_VAL;
    for (int64_t index = 0; index < loads->count; ++index) {
        double friction = memory->friction[index], d0 = loads->from ? loads->from[index] : memory->approach;
        const hs_vertex *stack = memory->vertices + index * memory->capacity;
        if (d1 > d0) reach = hs_most(reach, side * v0 + friction * (d1 - d0));
        for (int64_t j = 0; j < memory->depth[index]; ++j) {
            if (stack[j].label > d1 || (j > 0 && !memory->steep[index])) break;
            reach = hs_most(reach, side * stack[j].anchor + friction * (d1 - stack[j].label));
        }
    }
    return side * reach;
}

/* Newton's step from v, corrected for curvature (Halley), inside the bracket and no longer than a stride. */
static double next_guess(double v, double missing, double stiffness, double curvature, double low, double high,
                         double stride) {
    double step = stiffness > 0.0 ? missing / stiffness : HUGE_VAL;
    double bend = stiffness > 0.0 ? 0.5 * curvature * step / stiffness : HUGE_VAL;
    if (fabs(bend) < 0.25) step /= 1.0 + bend;
    double next = v + step;
    if (!(low < next && next < high)) next = 0.5 * (low + high);
    if (!(fabs(next - v) <= stride)) next = v + copysign(stride, missing);
    return next;
}

int hs_solve_displacement(hs_line *memory, double d, double load, hs_target target, double *found) {
    hs_group_loads loads;
    hs_fronts fronts;
    fronts.memory = NULL;
    int status = hs_loads_of_groups(memory, d, load, &loads);
    if (status == HS_OK) status = hs_init_fronts(&fronts, loads.count);
    if (status == HS_OK) status = hs_solve_displacement_with(memory, &loads, &fronts, d, target, found);
    hs_free_fronts(&fronts);
    hs_free_group_loads(&loads);
    return status;
}

static double limit_of(const hs_line *memory, const hs_group_loads *loads) {
    double limit = 0.0;
    for (int64_t index = 0; index < loads->count; ++index) limit += memory->friction[index] * loads->load[index];
    return limit;
}

/* Displacement at which a straight path in (d, V) to approach d ends where it aims; the fronts met stay in their table.
 *
 * Where nothing touches at d, a load leaves V at the anchor of the last spring to leave, which is one of the highest
 * summit. */
int hs_solve_displacement_with(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, double d, hs_target target, double *found) {
    if (loads->count == 0) {
        *found = target.rigid > 0.0 ? target.value : memory->depth[0] > 0 ? memory->vertices[0].anchor : memory->displacement;
        return HS_OK;
    }
    if (d == memory->approach) {
        double v = memory->displacement;
        double missing = target.value - target.rigid * v - target.compliance * hs_total_force(memory);
        if (fabs(missing) <= HS_TIE * (target.rigid * fabs(target.value) + target.compliance * limit_of(memory, loads))) {
            /* held: rounding is no reason to move */
            *found = v;
            return HS_OK;
        }
    }
    return hs_search_displacement(memory, loads, fronts, d, target, found);
}

/* The same where something touches at d, whatever the contact carries now. A load at the friction limit is met by the
 * displacement at which the last spring begins to slide. */
int hs_search_displacement(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, double d, hs_target target, double *found) {
    double goal = target.value, rigid = target.rigid, compliance = target.compliance;
    double limit = limit_of(memory, loads);
    double reach = hs_friction_range(memory, HUGE_VAL).most * (d - memory->contact->sorted_gap[0]), stride = HUGE_VAL;
    if (rigid == 0.0) {
        if (fabs(goal) >= (1.0 - HS_TIE) * limit) {
            *found = sliding_displacement(memory, loads, d, copysign(1.0, goal));
            return HS_OK;
        }
        /* what slides has no stiffness to tell how far */
        stride = reach;
    }
    double accuracy = 4.0 * DBL_EPSILON * (rigid * fabs(goal) + compliance * limit);
    double low = -HUGE_VAL, high = HUGE_VAL, v = memory->displacement;
    double change = goal - rigid * v - compliance * memory->tangential_load;
    /* a little on the way, so that the first stiffness is that of the direction in which it goes */
    if (change != 0.0) v += copysign(1e-9 * reach, change);
    /* so near the start springs that touched on the way all stick, and no front is met yet */
    int unmet = d > memory->approach ? 1 : 0;
    for (int turn = 0; turn < 200; ++turn) {
        if (turn == unmet) guess_fronts(memory, loads, fronts, copysign(1.0, change));
        hs_point to = {d, v};
        hs_force here;
        int status = hs_force_at(memory, loads, fronts, to, &here);
        if (status != HS_OK) return status;
        double missing = goal - rigid * v - compliance * here.force;
        if (fabs(missing) <= accuracy) break;
        if (missing > 0.0)
            low = v;
        else
            high = v;
        double next = next_guess(v, missing, rigid + compliance * here.stiffness, compliance * here.curvature, low, high,
                                 stride);
        if (next == low || next == high || next == v) break;
        v = next;
    }
    *found = v;
    return HS_OK;
}
