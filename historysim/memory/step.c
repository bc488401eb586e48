/* Step: one exact update of all groups, on which approach, displacement, friction and shapes change
 * linearly to their values at its end: |V - w| <= mu(s) (d - a) (README.md, theory 2 and 7). The
 * method is of second order in the length of the step: the distance that an asperity slides follows
 * from the fraction at which the last of its springs begins to slip; shapes at the end are
 * predicted twice, and the update is of the mean shape on the step. A step ends where a saturated
 * request crosses the friction limit. */

#include "step.h"
#include "bracket.h"
#include "contact.h"

/* Crossings of the friction limit on one step, and iterations of the search for one, at most;
 * chosen. */
#define MAX_CROSSINGS 4

#define MAX_ROOT_STEPS 100

/* Straight path of one group: its ends, its coefficients at the start, halfway and at the end, and
 * the side on which its springs slip. */
typedef struct hs_group_path {
    hs_point from, to;
    double friction[3];
    double side;
    double fraction[2]; /* of the step, at both ends */
} hs_group_path;

/* Fractions of a path between which a spring slips, and its slip. */
typedef struct slip_interval {
    double slip_begin, slip_end;
    double slip;
} slip_interval;

/* Solve for the slip of a spring: from where it meets its limit, until the limit grows faster than
 * the displacement.
 *
 * The distance y = L - s v to its limit is quadratic in the fraction through start, middle and end:
 * slip begins at the first root of y and ends at the root of y'. At constant friction y is linear.
 */
static slip_interval find_slip(const hs_group_path *group_path, double label, double anchor) {
    const double *friction = group_path->friction;
    double d = 0.5 * (group_path->from.d + group_path->to.d),
           v = 0.5 * (group_path->from.v + group_path->to.v);
    double first_value = friction[0] * (group_path->from.d - label) -
                         group_path->side * (group_path->from.v - anchor);
    double amid = friction[1] * (d - label) - group_path->side * (v - anchor);
    double last_value =
        friction[2] * (group_path->to.d - label) - group_path->side * (group_path->to.v - anchor);
    if (friction[0] == friction[2] && friction[1] == friction[2]) {
        slip_interval straight = {HUGE_VAL, 1.0, 0.0};
        if (first_value > last_value)
            straight.slip_begin = hs_max(first_value, 0.0) / (first_value - last_value);
        if (straight.slip_begin < 1.0)
            straight.slip = (1.0 - straight.slip_begin) * (first_value - last_value);
        return straight;
    }
    double linear = 4.0 * amid - 3.0 * first_value - last_value,
           square = 2.0 * (first_value + last_value - 2.0 * amid);
    double under = linear * linear - 4.0 * hs_max(first_value, 0.0) * square;
    slip_interval result = {HUGE_VAL, 1.0, 0.0};
    if (under < 0.0) return result;
    if (linear < 0.0)
        result.slip_begin = 2.0 * hs_max(first_value, 0.0) / (sqrt(under) - linear);
    else if (square < 0.0)
        result.slip_begin = (linear + sqrt(under)) / (-2.0 * square);
    if (linear < 0.0 && 2.0 * square > -linear) result.slip_end = linear / (-2.0 * square);
    if (result.slip_begin < result.slip_end)
        result.slip = -(result.slip_end - result.slip_begin) *
                      (linear + square * (result.slip_end + result.slip_begin));
    return result;
}

static void clear_slide(hs_fields *ctx, int64_t asperity) {
    ctx->slide[asperity] = 0.0;
    ctx->slide_begin[asperity] = HUGE_VAL;
    ctx->slide_end[asperity] = -HUGE_VAL;
}

/* Fractions of a step between which all asperities in contact slide. As a rule sticking is at its
 * start or end. */
typedef struct common_slide {
    double slide_begin, slide_end;
} common_slide;

static void exclude_interval(common_slide *all, double from, double to) {
    if (!(from < to)) return;
    if (from <= all->slide_begin)
        all->slide_begin = hs_max(all->slide_begin, to);
    else if (to >= all->slide_end || all->slide_end - to < from - all->slide_begin)
        all->slide_end = hs_min(all->slide_end, from);
    else
        all->slide_begin = to;
}

double hs_solve_common_slide(const hs_fields *ctx, const hs_line *memory,
                             const hs_step_end *step_end) {
    const hs_contact *contact = memory->contact;
    common_slide all = {0.0, 1.0};
    double touches = HUGE_VAL, leaves = -HUGE_VAL, deepest = hs_max(memory->approach, step_end->d);
    if (step_end->v == memory->displacement) return 0.0;
    for (int64_t g = 0; g < contact->groups && all.slide_begin < all.slide_end; ++g) {
        double from = hs_start_edge(ctx, memory, g), sunk = step_end->d - from;
        if (contact->gap[contact->first[g]] >= deepest) break;
        for (int64_t k = contact->first[g]; k < contact->first[g + 1]; ++k) {
            int64_t i = contact->order[k];
            double gap = ctx->start_gap[i];
            if (gap >= hs_max(from, step_end->d)) continue;
            double first_value = gap < from ? 0.0 : (gap - from) / sunk,
                   last_value = gap < step_end->d ? 1.0 : (from - gap) / -sunk;
            touches = hs_min(touches, first_value);
            leaves = hs_max(leaves, last_value);
            exclude_interval(&all, first_value, hs_min(ctx->slide_begin[i], last_value));
            exclude_interval(&all, hs_max(ctx->slide_end[i], first_value), last_value);
        }
    }
    exclude_interval(&all, 0.0, touches);
    exclude_interval(&all, leaves, 1.0);
    double fraction = touches < leaves ? hs_max(all.slide_end - all.slide_begin, 0.0) : 0.0;
    return fabs(step_end->v - memory->displacement) * fraction * contact->units.displacement;
}

/* Add the distances ∫|dV| that asperities of a group slide as a whole on a straight part of a step
 * to `slide`, and their fractions.
 *
 * The fraction at which a spring begins to slip is a quotient of functions that are linear in the
 * label between vertices, so that the last spring to slip is at a vertex, or the innermost. New
 * springs slip at first touch or not at all. */
static void add_slide(hs_fields *ctx, const hs_group *group, int64_t depth,
                      hs_group_path group_path, int steep) {
    const hs_contact *contact = group->memory->contact;
    const int64_t *asperity = contact->order + group->start;
    const double *gap = ctx->start_gap, unit = contact->units.displacement;
    /* in a constant cone the innermost spring is the last */
    int inmost_last = !steep && group_path.friction[0] == group_path.friction[2] &&
                      group_path.friction[0] == group_path.friction[1];
    double moved = group_path.to.v - group_path.from.v, sunk = group_path.to.d - group_path.from.d,
           tie = 1e-12 * (fabs(group_path.from.v) + fabs(group_path.to.v));
    if (moved == 0.0) return;
    double edge = hs_min(group_path.from.d, group_path.to.d);
    double fall = group_path.friction[0] * (group_path.from.d - edge) -
                  group_path.friction[2] * (group_path.to.d - edge);
    for (int against = 0; against < 2; ++against) {
        group_path.side = copysign(1.0, against ? -moved : moved);
        slip_interval all = {0.0, 1.0, 0.0};
        int64_t j = depth - 1;
        if (sunk > 0.0 && group_path.side * moved <= group_path.friction[2] * sunk) continue;
        for (int64_t i = group->curve.count - 1; i >= 0; --i) {
            double h = gap[asperity[i]];
            slip_interval own_approach = {(h - group_path.from.d) / sunk, 1.0, HUGE_VAL};
            if (h >= hs_max(group_path.from.d, group_path.to.d)) continue;
            if (h < group_path.from.d) {
                if (depth == 0) continue;
                for (; j >= 0 && group->stack[j].label > h; --j) {
                    if (inmost_last) continue;
                    slip_interval outer =
                        find_slip(&group_path, group->stack[j].label, group->stack[j].anchor);
                    double leaves = (group_path.from.d - group->stack[j].label) / -sunk;
                    /* a spring that separates no longer holds the asperity */
                    int stays = group->stack[j].label <= group_path.to.d;
                    all.slip_begin =
                        hs_max(all.slip_begin,
                               stays ? outer.slip_begin : hs_min(outer.slip_begin, leaves));
                    if (stays) all.slip_end = hs_min(all.slip_end, outer.slip_end);
                }
                const hs_vertex *above = group->stack + (j + 1 < depth ? j + 1 : j);
                own_approach =
                    find_slip(&group_path, h, above->anchor - above->slope * (above->label - h));
                own_approach.slip_begin = hs_max(own_approach.slip_begin, all.slip_begin);
                own_approach.slip_end =
                    hs_min(own_approach.slip_end,
                           h > group_path.to.d ? (group_path.from.d - h) / -sunk : all.slip_end);
            }
            if (!(own_approach.slip_begin < own_approach.slip_end && own_approach.slip > tie))
                continue;
            ctx->slide[asperity[i]] +=
                fabs(moved) * (own_approach.slip_end - own_approach.slip_begin) * unit;
            ctx->slide_begin[asperity[i]] = hs_min(
                ctx->slide_begin[asperity[i]],
                hs_toward(group_path.fraction[0], group_path.fraction[1], own_approach.slip_begin));
            ctx->slide_end[asperity[i]] = hs_max(
                ctx->slide_end[asperity[i]],
                hs_toward(group_path.fraction[0], group_path.fraction[1], own_approach.slip_end));
        }
        /* springs slip backwards only where their limit falls faster than the displacement */
        double inmost = group->curve.gap[0];
        fall = hs_max(fall, group_path.friction[0] * (group_path.from.d - inmost) -
                                group_path.friction[2] * (group_path.to.d - inmost));
        if (fall <= fabs(moved)) return;
    }
}

/* Solve for approach and normal load at a path fraction.
 *
 * Of two loads both are linear. Otherwise the approach is, in the contact of the beginning; if wear
 * changes that, a normal load keeps the values of the beginning. */
static void solve_normal(const hs_fields *ctx, const hs_line *memory, double fraction, double *d,
                         double *load) {
    const hs_plan *plan = &ctx->plan;
    if (plan->both_loads) {
        *load = hs_toward(plan->normal_load[0], plan->normal_load[1], fraction);
        *d = hs_approach_at_load(memory, *load);
        return;
    }
    *d = hs_toward(plan->approach[0], plan->approach[1], fraction);
    if (plan->normal_by_load) {
        *load =
            fraction == 1.0
                ? plan->normal_load[1]
                : hs_load_at(hs_all_of(plan->start_contact ? plan->start_contact : memory->contact),
                             *d)
                      .load;
        /* a gap is closed on the linear approach, without wear */
        if (ctx->has_wear && (*load > 0.0 || memory->normal_load > 0.0))
            *d = hs_approach_at_load(memory, *load);
    } else {
        *load = hs_load_at(hs_all_of(memory->contact), *d).load;
    }
}

/* Solve for the displacement at the end of a step. */
static int solve_end(hs_fields *ctx, hs_line *memory, double fraction, hs_step_end *step_end) {
    const hs_plan *plan = &ctx->plan;
    const hs_contact *contact = memory->contact;
    double value = hs_toward(plan->request[0], plan->request[1], fraction), limit = 0.0;
    /* where asperities wear, loads follow from their shapes later */
    int changes = 0, weighs = !ctx->has_wear || plan->tangential_by_load || ctx->compliance > 0.0;
    hs_group_loads loads;
    loads.load = ctx->group_load;
    loads.from = ctx->yield.is_active ? ctx->start_edge : NULL;
    loads.count = 0;
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < step_end->d;
         ++g, ++loads.count) {
        ctx->start_edge[g] = hs_start_edge(ctx, memory, g);
        changes |=
            ctx->end_friction[g] != memory->friction[g] || hs_cone_ratio(ctx, memory, g) != 1.0;
        if (!weighs) continue;
        ctx->group_load[g] = contact->groups == 1
                                 ? step_end->load
                                 : hs_load_at(hs_group_of(memory, g).curve, step_end->d).load;
        limit += ctx->end_friction[g] * ctx->group_load[g];
    }
    int by_load = plan->tangential_by_load && !(plan->is_straight && fraction < plan->segment[1]);
    step_end->touching = loads.count;
    step_end->excess = 0.0;
    step_end->request = value;
    step_end->limit = limit;
    step_end->force = by_load && (!plan->ends_separated || fraction == 1.0) ? value : NAN;
    if (plan->ends_separated || (!plan->tangential_by_load && ctx->compliance == 0.0)) {
        step_end->v = plan->ends_separated
                          ? hs_toward(plan->displacement[0], plan->displacement[1], fraction)
                          : value;
        return HS_OK;
    }
    if (plan->is_straight && fraction < plan->segment[1]) {
        step_end->v =
            hs_toward(plan->segment_displacement[0], plan->segment_displacement[1],
                      (fraction - plan->segment[0]) / (plan->segment[1] - plan->segment[0]));
        return HS_OK;
    }
    if (by_load && plan->is_straight && plan->ends_at_limit)
        step_end->force = value = plan->ends_at_limit * limit;
    hs_target target = {value, 1.0, ctx->compliance};
    if (plan->tangential_by_load) {
        if (fabs(value) >= (1.0 - HS_LIMIT_SLACK) * limit && !plan->is_straight)
            step_end->force = copysign(limit, value);
        if (fabs(value) - limit > HS_LIMIT_SLACK * limit) {
            if (!ctx->drive->saturate) {
                ctx->refusal->request = value * contact->units.load;
                ctx->refusal->limit = limit * contact->units.load;
                return HS_BEYOND_LIMIT;
            }
            step_end->force = copysign(limit, value);
            step_end->excess = value - step_end->force;
        }
        target = hs_to_load(step_end->force);
    }
    hs_fronts fronts;
    int status = hs_init_fronts(&fronts, loads.count);
    if (status != HS_OK) return status;
    if (!changes || loads.count == 0) {
        status =
            hs_solve_displacement_with(memory, &loads, &fronts, step_end->d, target, &step_end->v);
    } else {
        /* any cone may cut any polyline */
        double *saved_friction = memory->friction;
        memcpy(ctx->saved_steep, memory->steep, (size_t)contact->groups);
        memset(memory->steep, 1, (size_t)contact->groups);
        memory->friction = ctx->end_friction;
        status = hs_search_displacement(memory, &loads, &fronts, step_end->d, target, &step_end->v);
        memory->friction = saved_friction;
        memcpy(memory->steep, ctx->saved_steep, (size_t)contact->groups);
    }
    hs_free_fronts(&fronts);
    /* a contact that slides while its limit falls keeps its displacement */
    double side = copysign(1.0, step_end->force);
    int at_limit = plan->tangential_by_load && fabs(step_end->force) >= (1.0 - HS_TIE) * limit;
    if (loads.count == 0 && step_end->excess == 0.0) at_limit = 0;
    if (at_limit && (loads.count == 0 || side * step_end->v < side * memory->displacement))
        step_end->v = memory->displacement;
    return status;
}

/* Reserve vertices for a clipped stack, or for those that a step adds. */
static int reserve_scratch(hs_fields *ctx, hs_line *memory, int64_t depth) {
    int64_t room = 2 * hs_room_to_clip(depth);
    if (room > ctx->scratch_capacity) {
        free(ctx->scratch);
        ctx->scratch = (hs_vertex *)malloc(2 * (size_t)room * sizeof *ctx->scratch);
        ctx->scratch_capacity = ctx->scratch ? 2 * room : 0;
    }
    if (!ctx->scratch) return HS_OUT_OF_MEMORY;
    return depth + 2 > memory->capacity ? hs_line_reserve(memory, 2 * (depth + 2)) : HS_OK;
}

/* Move one group on a straight path with a coefficient that changes linearly; losses are added to
 * `each`, by position. */
static int move_group(hs_fields *ctx, hs_line *memory, int64_t index,
                      const hs_group_path *group_path, double load, double *each,
                      hs_losses *losses) {
    double reached;
    if (reserve_scratch(ctx, memory, memory->depth[index]) != HS_OK) return HS_OUT_OF_MEMORY;
    hs_group group = hs_group_of(memory, index);
    group.asperity_energy = each + group.start;
    group.friction =
        group_path->to.d <= group.curve.gap[0] ? group_path->friction[0] : group_path->friction[2];
    return hs_move_group(memory, &group, losses, index, group_path->friction[0], group_path->from,
                         group_path->to, load, hs_to_displacement(group_path->to.v), ctx->scratch,
                         &reached);
}

/* Move one group to the end of a step from station to station; where its friction bends, slid
 * distances are found, too. */
static int move_by_stations(hs_fields *ctx, hs_line *memory, int64_t g, const hs_step_end *step_end,
                            double *each, hs_losses *losses) {
    const hs_contact *contact = memory->contact;
    hs_point from = {hs_start_edge(ctx, memory, g), memory->displacement},
             to = {step_end->d, step_end->v};
    int64_t stations = ctx->group_stations[g + 1] - ctx->group_stations[g],
            first_value = contact->first[g];
    const hs_station *at = ctx->stations + ctx->group_stations[g];
    hs_group_path group_path = {from,
                                from,
                                {memory->friction[g] * hs_cone_ratio(ctx, memory, g), 0.0, 0.0},
                                1.0,
                                {0.0, 0.0}};
    const hs_clock clock = memory->clock;
    int bends = at->mid_friction > 0.0, status = HS_OK;
    for (int64_t k = first_value; bends && k < contact->first[g + 1]; ++k)
        clear_slide(ctx, contact->order[k]);
    memory->clock.end = clock.begin;
    for (int64_t k = 0; k < stations && status == HS_OK; ++k) {
        hs_group group = hs_group_of(memory, g);
        hs_tick(memory, hs_toward(clock.begin, clock.end, at[k].fraction));
        int last_value = k + 1 == stations;
        group_path.to.d = last_value ? to.d : hs_toward(from.d, to.d, at[k].fraction);
        group_path.to.v = last_value ? to.v : hs_toward(from.v, to.v, at[k].fraction);
        group_path.friction[2] = at[k].friction;
        if (memory->depth[g] == 0) group_path.friction[0] = group_path.friction[2];
        if (group_path.to.d <= group.curve.gap[0]) group_path.friction[2] = group_path.friction[0];
        group_path.friction[1] = at[k].mid_friction > 0.0
                                     ? at[k].mid_friction
                                     : 0.5 * (group_path.friction[0] + group_path.friction[2]);
        double load = last_value && g < step_end->touching
                          ? ctx->group_load[g]
                          : hs_load_at(group.curve, group_path.to.d).load;
        group_path.fraction[1] = at[k].fraction;
        if (bends) add_slide(ctx, &group, memory->depth[g], group_path, memory->steep[g]);
        status = move_group(ctx, memory, g, &group_path, load, each, losses);
        group_path.from = group_path.to;
        group_path.fraction[0] = group_path.fraction[1];
        group_path.friction[0] = group_path.friction[2];
    }
    memory->clock = clock;
    return status;
}

int hs_solve_slid_distances(hs_fields *ctx, hs_line *memory, const hs_step_end *step_end,
                            int predicted_slide) {
    const hs_contact *contact = memory->contact;
    hs_group_path group_path = {{memory->approach, memory->displacement},
                                {step_end->d, step_end->v},
                                {0.0, 0.0, 0.0},
                                1.0,
                                {0.0, 1.0}};
    for (int64_t i = 0; i < contact->count; ++i) clear_slide(ctx, i);
    for (int64_t g = 0; g < contact->groups; ++g) {
        hs_group group = hs_group_of(memory, g);
        int64_t depth = memory->depth[g];
        if (group.curve.gap[0] >= hs_max(group_path.from.d, group_path.to.d)) break;
        group_path.from.d = hs_start_edge(ctx, memory, g);
        group_path.friction[0] = group.friction * hs_cone_ratio(ctx, memory, g);
        group_path.friction[2] = g < step_end->touching ? ctx->end_friction[g] : group.friction;
        if (depth == 0) group_path.friction[0] = group_path.friction[2];
        group_path.friction[1] = 0.5 * (group_path.friction[0] + group_path.friction[2]);
        if (!predicted_slide || ctx->stations[ctx->group_stations[g]].mid_friction <= 0.0) {
            add_slide(ctx, &group, depth, group_path, memory->steep[g]);
            continue;
        }
        hs_losses losses;
        uint8_t steep = memory->steep[g];
        if (depth + 1 > ctx->stack_capacity) {
            free(ctx->saved_stack);
            ctx->stack_capacity = 2 * (depth + 1);
            ctx->saved_stack =
                (hs_vertex *)malloc((size_t)ctx->stack_capacity * sizeof *ctx->saved_stack);
            if (!ctx->saved_stack) return HS_OUT_OF_MEMORY;
        }
        memcpy(ctx->saved_stack, group.stack, (size_t)depth * sizeof *ctx->saved_stack);
        hs_init_losses(&losses, contact->groups, NULL);
        /* it is only tried */
        const hs_clock clock = memory->clock;
        hs_set_clock(memory, NAN);
        int status = move_by_stations(ctx, memory, g, step_end, ctx->trial_energy, &losses);
        memory->clock = clock;
        if (status != HS_OK) return status;
        memcpy(memory->vertices + g * memory->capacity, ctx->saved_stack,
               (size_t)depth * sizeof *ctx->saved_stack);
        memory->depth[g] = depth;
        memory->steep[g] = steep;
    }
    return HS_OK;
}

void hs_add_slides(const hs_fields *ctx, hs_line *memory) {
    hs_evolved *evolved = memory->evolved;
    if (!evolved) return;
    for (int64_t i = 0; i < memory->contact->count; ++i) evolved->slid_distance[i] += ctx->slide[i];
    evolved->slid_together += ctx->common_slide;
}

/* Move all groups to the end of a step. */
static int move_groups(hs_fields *ctx, hs_line *memory, const hs_step_end *step_end) {
    const hs_contact *contact = memory->contact;
    double deepest = hs_max(memory->approach, step_end->d);
    hs_losses losses;
    hs_init_losses(&losses, contact->groups, NULL);
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < deepest; ++g) {
        int status = move_by_stations(ctx, memory, g, step_end, memory->dissipated_each, &losses);
        if (status != HS_OK) return status;
    }
    /* summits have the shapes of the predicted distances */
    if (ctx->has_wear)
        memcpy(ctx->slide, ctx->predicted_slide, (size_t)contact->count * sizeof *ctx->slide);
    if (memory->evolved)
        ctx->common_slide = ctx->has_wear ? ctx->predicted_common_slide
                                          : hs_solve_common_slide(ctx, memory, step_end);
    memcpy(memory->friction, ctx->end_friction, (size_t)contact->groups * sizeof(double));
    hs_commit_losses(&losses, memory);
    memory->approach = step_end->d;
    memory->displacement = step_end->v;
    memory->normal_load = step_end->load;
    memory->excess = step_end->excess;
    memory->tangential_load = hs_total_force(memory);
    if (!isnan(step_end->force)) memory->tangential_load = step_end->force;
    return HS_OK;
}

/* Solve for the end of a step and the slid distances; where asperities wear, with the shapes that
 * follow, in two iterations. */
static int solve_step(hs_fields *ctx, hs_line *memory, double fraction, hs_step_end *step_end,
                      int *slides) {
    const hs_contact *contact = memory->contact;
    const hs_law *law = &ctx->evolution->law;
    const size_t size = (size_t)contact->count * sizeof(double);
    int by_distance =
        !ctx->evolution->goal && law->kind != HS_NO_LAW && law->depends_on == HS_ON_SLID_DISTANCE;
    int passes = ctx->has_wear ? 2 : by_distance,
        searches = ctx->plan.tangential_by_load || ctx->compliance > 0.0;
    for (int pass = 0;; ++pass) {
        if (!ctx->yield.is_active)
            solve_normal(ctx, memory, fraction, &step_end->d, &step_end->load);
        int status = hs_set_friction_field(ctx, memory, step_end->d, step_end->load, fraction,
                                           pass ? ctx->predicted_slide : NULL);
        if (status == HS_OK) status = solve_end(ctx, memory, fraction, step_end);
        /* distances belong to asperities that evolve */
        if (status != HS_OK || !memory->evolved) return status;
        ctx->displacement_change =
            fabs(step_end->v - memory->displacement) * contact->units.displacement;
        status = hs_solve_slid_distances(ctx, memory, step_end, ctx->has_wear && pass < passes);
        if (status != HS_OK) return status;
        for (int64_t i = 0; i < contact->count && !*slides; ++i) *slides = ctx->slide[i] > 0.0;
        if (pass == passes) return HS_OK;
        if (ctx->has_wear) ctx->common_slide = hs_solve_common_slide(ctx, memory, step_end);
        if (pass == 0) {
            memcpy(ctx->shape.unworn_slide, ctx->slide, size);
            ctx->unworn_common_slide = ctx->common_slide;
        }
        /* asperities whose wear holds the contact move in small jerks, and slide half of the
         * distance */
        for (int64_t i = 0; i < contact->count; ++i)
            ctx->slide[i] =
                hs_max(ctx->slide[i], ctx->has_wear ? 0.5 * ctx->shape.unworn_slide[i] : 0.0);
        memcpy(ctx->predicted_slide, ctx->slide, size);
        ctx->predicted_common_slide = hs_max(ctx->common_slide, 0.5 * ctx->unworn_common_slide);
        if (!*slides) return HS_OK;
        if (!ctx->has_wear) continue;
        status = hs_predict_wear(ctx, memory, step_end);
        if (status != HS_OK) return status;
        hs_set_summit_shapes(memory, ctx->shape.end_height, ctx->shape.end_radius,
                             ctx->start_depth);
        if (searches) hs_refresh_loads(memory);
    }
}

/* Set friction and loads at the end of a step on which summits wear, where groups may have another
 * order. */
static int set_worn_loads(hs_fields *ctx, const hs_line *memory, double fraction,
                          hs_step_end *step_end) {
    int status = hs_set_friction_field(ctx, memory, step_end->d, step_end->load, fraction,
                                       ctx->predicted_slide);
    for (step_end->touching = 0; step_end->touching < memory->contact->groups && status == HS_OK;
         ++step_end->touching) {
        hs_curve curve = hs_group_of(memory, step_end->touching).curve;
        if (curve.gap[0] >= step_end->d) break;
        ctx->group_load[step_end->touching] = hs_load_at(curve, step_end->d).load;
    }
    return status;
}

/* Add the volumes that asperities lose on a step; `shaped` if summits changed. */
static int add_lost_volumes(hs_fields *ctx, hs_line *memory, int shaped) {
    const hs_contact *contact = memory->contact;
    hs_evolved *evolved = memory->evolved;
    const size_t size = (size_t)contact->count * sizeof(double);
    for (int64_t i = 0; i < contact->count; ++i)
        ctx->shape.energy[contact->order[i]] =
            (memory->dissipated_each[i] - ctx->start_energy[contact->order[i]]) *
            contact->units.energy;
    if (!shaped) {
        memset(ctx->shape.mean_load, 0, size);
        memset(ctx->shape.shaped_volume, 0, size);
    }
    int status = hs_lost_volumes(&ctx->evolution->wear, contact->count, ctx->shape.mean_load,
                                 ctx->slide, ctx->shape.energy, ctx->shape.lost_volume);
    for (int64_t i = 0; i < contact->count; ++i) {
        evolved->worn_volume[i] += ctx->shape.lost_volume[i];
        evolved->waiting_volume[i] += ctx->shape.lost_volume[i] - ctx->shape.shaped_volume[i];
        evolved->shaped_volume[i] += ctx->shape.shaped_volume[i];
    }
    return status;
}

/* Predict the end of a step and the slid distances. */
static int predict_step(hs_fields *ctx, hs_line *memory, double fraction, hs_step_end *step_end,
                        int *slides) {
    const hs_evolved *evolved = memory->evolved;
    const hs_contact *contact = memory->contact;
    const size_t size = (size_t)contact->count * sizeof(double);
    *slides = 0;
    ctx->yield.is_active = ctx->has_yielding && fraction > ctx->yield.onset;
    if (ctx->yield.is_active) {
        int status = hs_yielding_end(ctx, memory, fraction, &step_end->d, &step_end->load);
        if (status == HS_OK) status = hs_apply_yielding(ctx, memory, step_end->d);
        if (status != HS_OK) return status;
        if (isnan(step_end->load))
            step_end->load = hs_load_at(hs_all_of(contact), step_end->d).load;
    }
    hs_store_gaps(ctx, contact);
    if (ctx->has_wear) {
        for (int64_t i = 0; i < contact->count; ++i)
            ctx->start_energy[contact->order[i]] = memory->dissipated_each[i];
        memcpy(ctx->shape.end_height, evolved->summit_height, size);
        memcpy(ctx->shape.end_radius, evolved->summit_radius, size);
        hs_store_depths(ctx, memory);
    }
    return solve_step(ctx, memory, fraction, step_end, slides);
}

/* Undo the predicted shapes of summits that wear. */
static void undo_prediction(hs_fields *ctx, hs_line *memory, double load) {
    if (!ctx->has_wear) return;
    hs_set_summit_shapes(memory, memory->evolved->summit_height, memory->evolved->summit_radius,
                         ctx->start_depth);
    hs_refresh_loads(memory);
    memory->normal_load = load;
}

/* Integrate a predicted step; `stored` is the elastic energy at its start. */
static int finish_step(hs_fields *ctx, hs_line *memory, double fraction, double stored,
                       hs_step_end *step_end, int slides) {
    hs_evolved *evolved = memory->evolved;
    const hs_contact *contact = memory->contact;
    const size_t size = (size_t)contact->count * sizeof(double);
    double erased = 0.0;
    int status = HS_OK, shaped = ctx->has_wear && slides;
    hs_tick(memory, hs_toward(ctx->plan.times[0], ctx->plan.times[1], fraction));
    if (shaped)
        erased = hs_apply_wear(ctx, memory, ctx->shape.mid_height, ctx->shape.mid_radius, stored);
    if (ctx->has_wear) status = set_worn_loads(ctx, memory, fraction, step_end);
    if (status == HS_OK) status = move_groups(ctx, memory, step_end);
    if (status != HS_OK) return status;
    if (shaped) {
        hs_store_depths(ctx, memory);
        erased += hs_apply_wear(ctx, memory, ctx->shape.end_height, ctx->shape.end_radius,
                                hs_elastic_energy(memory, NULL));
        hs_remove_worn_springs(memory);
        memory->normal_load = step_end->load;
        if (isnan(step_end->force)) memory->tangential_load = hs_total_force(memory);
        memcpy(evolved->summit_height, ctx->shape.end_height, size);
        memcpy(evolved->summit_radius, ctx->shape.end_radius, size);
        evolved->erased_energy += erased * contact->units.energy;
    }
    if (ctx->has_wear) status = add_lost_volumes(ctx, memory, shaped);
    hs_add_slides(ctx, memory);
    return status;
}

/* Excess of a request over the friction limit on one side, 0 within rounding. */
static double excess_over(double request, double limit, double side) {
    double more = side * request - limit;
    return fabs(more) <= HS_LIMIT_SLACK * limit ? 0.0 : more;
}

static double side_of_excess(double request, double limit) {
    return excess_over(request, limit, 1.0) > 0.0    ? 1.0
           : excess_over(request, limit, -1.0) > 0.0 ? -1.0
                                                     : 0.0;
}

/* Start of a predicted step, and a trial copy if summits yield, otherwise the same memory. */
typedef struct chord_start {
    const hs_line *start;
    hs_line *trial;
    double fraction, request, limit, normal_load;
} chord_start;

/* Predict a step with another end. */
static int retry_step(hs_fields *ctx, const chord_start *at, double fraction, hs_step_end *step_end,
                      int *slides) {
    hs_line *trial = at->trial;
    const hs_line *start = at->start;
    int status = HS_OK;
    if (trial != start) {
        hs_contact_assign(trial->contact, start->contact);
        status = hs_line_assign(trial, start);
    } else {
        undo_prediction(ctx, trial, at->normal_load);
    }
    return status == HS_OK ? predict_step(ctx, trial, fraction, step_end, slides) : status;
}

/* Shorten a predicted step to the fraction at which the request first crosses the friction limit.
 */
static int shorten_to_crossing(hs_fields *ctx, const chord_start *at, double *fraction,
                               hs_step_end *step_end, int *slides) {
    double from = side_of_excess(at->request, at->limit),
           to = side_of_excess(step_end->request, step_end->limit);
    double side = from != 0.0 ? from : to;
    int status = HS_OK;
    hs_bracket root = {at->fraction, *fraction, excess_over(at->request, at->limit, side),
                       excess_over(step_end->request, step_end->limit, side), 0};
    if (from == to || root.at_low == 0.0 || root.at_high == 0.0) return HS_OK;
    for (int turn = 0; turn < MAX_ROOT_STEPS && root.high - root.low > DBL_EPSILON; ++turn) {
        double next = hs_false_position(&root);
        if (next == root.low || next == root.high) break;
        status = retry_step(ctx, at, next, step_end, slides);
        if (status != HS_OK) return status;
        *fraction = next;
        double crossing_value = excess_over(step_end->request, step_end->limit, side);
        if (crossing_value == 0.0) return HS_OK;
        hs_narrow(&root, next, crossing_value, (crossing_value > 0.0) == (root.at_high > 0.0));
    }
    *fraction = root.high;
    return retry_step(ctx, at, root.high, step_end, slides);
}

/* Record the side of the limit on which a request is from a fraction on. */
static void add_segment(hs_segments *segments, double fraction, double side) {
    int last = segments->count - 1;
    if (segments->side[last] == (int)side) return;
    if (fraction > (last > 0 ? segments->end[last - 1] : 0.0)) {
        if (segments->count == HS_MAX_SEGMENTS) return;
        segments->end[last] = fraction;
        segments->end[++last] = 1.0;
        ++segments->count;
    }
    segments->side[last] = (int)side;
}

int hs_advance_step(hs_fields *ctx, hs_line *memory, double start_fraction, double fraction) {
    const hs_plan *plan = &ctx->plan;
    const int crosses = ctx->drive->saturate && plan->tangential_by_load && !plan->is_straight &&
                        !plan->ends_separated;
    for (int turn = 0; start_fraction < fraction; ++turn) {
        ctx->step_length = fraction - start_fraction;
        double stored = ctx->has_wear ? hs_elastic_energy(memory, NULL) : 0.0, stop = fraction;
        int slides = 0, copies = crosses && ctx->has_yielding && fraction > ctx->yield.onset;
        chord_start at = {memory,
                          copies ? hs_copy_unshared(ctx, memory) : memory,
                          start_fraction,
                          hs_toward(plan->request[0], plan->request[1], start_fraction),
                          0.0,
                          memory->normal_load};
        hs_step_end step_end;
        if (!at.trial) return HS_OUT_OF_MEMORY;
        if (crosses) at.limit = hs_friction_limit(memory, memory->approach, memory->normal_load);
        int status = predict_step(ctx, at.trial, stop, &step_end, &slides);
        if (status == HS_OK && crosses && turn < MAX_CROSSINGS)
            status = shorten_to_crossing(ctx, &at, &stop, &step_end, &slides);
        if (copies) {
            hs_line_swap(memory, at.trial);
            hs_line_free(at.trial);
        }
        if (status == HS_OK) status = finish_step(ctx, memory, stop, stored, &step_end, slides);
        if (status != HS_OK) return status;
        if (ctx->crossings) {
            double side = side_of_excess(at.request, at.limit);
            add_segment(ctx->crossings, start_fraction,
                        side != 0.0 ? side : side_of_excess(step_end.request, step_end.limit));
        }
        start_fraction = stop;
    }
    return HS_OK;
}
