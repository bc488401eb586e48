/* Integrate: integrates a sequence of paths and records rows at equal path fractions. Where nothing
 * evolves, paths are integrated by moves (straight in d, V) and ramps (straight in N, T), exactly;
 * where fields change, in substeps. Where a load or a drive is controlled and the approach is
 * linear, the displacement at the end is found by a search over the path, so that the path is
 * straight. Worker threads write rows while the main thread integrates. */

#include "contact.h"
#include "drive.h"
#include "laws.h"
#include "line.h"
#include "readout.h"
#include "scaled.h"
#include "substeps.h"

/* Substeps in which crossings of the friction limit are searched that divide a path; and those that
 * are searched again on each step. Chosen. */
#define CROSSING_SUBSTEPS 64

#define CUT_SUBSTEPS 16

/* Displacement by which a target may be missed, over the tolerance of ramps and the displacement at
 * which all springs slide; iterations of the search, at most; and the smallest rate of a secant.
 * Chosen. */
#define TARGET_TOLERANCE_FACTOR 10.0

#define MAX_TARGET_STEPS 12

#define MIN_SECANT_RATE 0.05

/* True if neither friction nor shapes change on a path. */
static int is_unchanging(const hs_fields *ctx, const hs_line *memory) {
    const hs_law *law = &ctx->evolution->law;
    int64_t count = memory->contact->count;
    if (ctx->has_wear) return 0;
    if (ctx->evolution->goal)
        return memcmp(ctx->goals[0], ctx->goals[1], (size_t)count * sizeof(double)) == 0;
    if (law->kind == HS_NO_LAW || law->depends_on == HS_ON_NOTHING) return 1;
    if (!memchr(memory->evolved->friction_overridden, 0, (size_t)count)) return 1;
    return law->depends_on != HS_ON_SLID_DISTANCE && ctx->plan.approach[0] == ctx->plan.approach[1];
}

/* Integrate a path on which nothing evolves, exactly. Slid distances are those of its straight
 * segments or, where both loads change, of substeps. */
static int follow_constant(hs_fields *ctx, hs_line *memory, const hs_plan *constant,
                           double start_fraction, double fraction) {
    const hs_plan *plan = &ctx->plan;
    hs_line *start = ctx->copies[0];
    int bent = plan->both_loads && plan->normal_load[0] != plan->normal_load[1], status = HS_OK;
    if (ctx->only_yields)
        return hs_follow_plan(memory, constant, start_fraction, fraction, ctx->drive);
    for (int k = 0; start_fraction < fraction && status == HS_OK; ++k) {
        double stop = !bent && k < constant->segments.count
                          ? hs_min(constant->segments.end[k], fraction)
                          : fraction;
        if (stop <= start_fraction) continue;
        if (ctx->has_yielding) hs_contact_assign(start->contact, memory->contact);
        status = hs_line_assign(start, memory);
        if (status == HS_OK && bent) {
            hs_line *fine = hs_copy_unshared(ctx, memory);
            status =
                fine ? hs_integrate_substeps(ctx, start, ctx->copies[1], fine, start_fraction, stop)
                     : (int)HS_OUT_OF_MEMORY;
            hs_line_free(fine);
        }
        if (status == HS_OK)
            status = hs_follow_plan(memory, constant, start_fraction, stop, ctx->drive);
        if (status != HS_OK) return status;
        if (bent) {
            memcpy(memory->evolved->slid_distance, start->evolved->slid_distance,
                   (size_t)memory->contact->count * sizeof(double));
            memory->evolved->slid_together = start->evolved->slid_together;
        } else {
            hs_step_end end = {memory->approach,
                               memory->normal_load,
                               memory->displacement,
                               NAN,
                               NAN,
                               NAN,
                               0.0,
                               memory->contact->groups};
            memcpy(ctx->end_friction, memory->friction,
                   (size_t)memory->contact->groups * sizeof(double));
            hs_store_gaps(ctx, memory->contact);
            status = hs_solve_slid_distances(ctx, start, &end, 0);
            ctx->common_slide = hs_solve_common_slide(ctx, start, &end);
            hs_add_slides(ctx, memory);
        }
        start_fraction = stop;
    }
    return status;
}

/* Integrate yielding up to a path fraction where nothing is strained. */
static int yield_unstrained(hs_fields *ctx, hs_line *memory, double fraction) {
    double d, load;
    int status = hs_yielding_end(ctx, memory, fraction, &d, &load);
    if (status == HS_OK) status = hs_yield_to(memory, ctx->evolution, d, ctx->yield.has_yielded);
    if (status != HS_OK) return status;
    const hs_contact *contact = memory->contact;
    double *gap = ctx->shape.slide_begin_approach, *weight = ctx->shape.slide_end_approach,
           unit = contact->units.length;
    for (int64_t k = 0; k < contact->count; ++k) {
        int64_t i = contact->order[k];
        gap[i] = ctx->yield.has_yielded[i]
                     ? (contact->datum - memory->evolved->summit_height[i]) / unit
                     : contact->gap[k];
        weight[i] = ctx->yield.has_yielded[i] ? sqrt(memory->evolved->summit_radius[i] / unit)
                                              : contact->weight[k];
    }
    hs_tick(memory, hs_toward(ctx->plan.times[0], ctx->plan.times[1], fraction));
    status = hs_join_groups(memory, gap, weight, d, 1);
    if (status == HS_OK && !isnan(load)) memory->normal_load = load;
    return status;
}

/* Split the groups of asperities that yield on the path apart. */
static int prepare_to_yield(hs_fields *ctx, hs_line *memory) {
    const hs_evolved *evolved = memory->evolved;
    int status =
        hs_flag_yielding(memory, ctx->evolution, ctx->plan.approach[1], ctx->yield.has_yielded);
    for (int pass = 0; pass < 2 && status == HS_OK; ++pass) {
        evolved = memory->evolved;
        const double *height = pass ? evolved->summit_height : evolved->virgin_height;
        const double *radius = pass ? evolved->summit_radius : evolved->virgin_radius;
        for (int64_t i = 0; i < memory->contact->count; ++i) {
            ctx->shape.slide_begin_approach[i] = ctx->yield.has_yielded[i] ? height[i] : HUGE_VAL;
            ctx->shape.slide_end_approach[i] = ctx->yield.has_yielded[i] ? radius[i] : 0.0;
        }
        status =
            hs_split_groups(memory, ctx->shape.slide_begin_approach, ctx->shape.slide_end_approach);
    }
    if (status == HS_OK) status = hs_line_unshare_contact(memory);
    ctx->has_split = 1;
    return status == HS_OK ? hs_make_copies(ctx, memory) : status;
}

/* The part of a path before its first summit yields. */
static hs_path path_to_onset(const hs_fields *ctx, const hs_path *path) {
    const hs_plan *plan = &ctx->plan;
    hs_path leg = *path;
    if (plan->both_loads) {
        leg.normal_target = hs_toward(plan->normal_load[0], plan->normal_load[1], ctx->yield.onset);
    } else {
        leg.normal_control = HS_DISPLACED;
        leg.normal_target = hs_toward(plan->approach[0], plan->approach[1], ctx->yield.onset);
    }
    leg.tangential_target[0] = hs_toward(plan->request[0], plan->request[1], ctx->yield.onset);
    leg.normal_fraction = leg.tangential_fraction[0] = 1.0;
    leg.end = hs_toward(leg.begin, leg.end, ctx->yield.onset);
    return leg;
}

/* True if nothing is strained, nor will be on the path. */
static int is_at_rest(const hs_fields *ctx, const hs_line *memory) {
    return ctx->plan.request[0] == ctx->plan.request[1] && hs_unstrained(memory);
}

/* Integrate the elastic part of a path on which summits yield later, straight to the target
 * displacement. */
static int follow_elastic(hs_fields *ctx, hs_line *memory, double start_fraction, double fraction) {
    const hs_plan *plan = &ctx->plan;
    const double begin = plan->segment[0], end = plan->segment[1];
    hs_path path;
    memset(&path, 0, sizeof path);
    path.normal_fraction = path.tangential_fraction[0] = 1.0;
    path.normal_control = path.tangential_control[0] = HS_DISPLACED;
    path.normal_target = hs_toward(plan->approach[0], plan->approach[1], fraction);
    path.tangential_target[0] =
        hs_toward(plan->segment_displacement[0], plan->segment_displacement[1],
                  (fraction - begin) / (end - begin));
    path.begin = hs_toward(plan->times[0], plan->times[1], start_fraction);
    path.end = hs_toward(plan->times[0], plan->times[1], fraction);
    hs_set_targets(memory, &path, 0.0, 0, &ctx->constant);
    return follow_constant(ctx, memory, &ctx->constant, 0.0, 1.0);
}

/* Integrate a part of a path within one segment. */
static int follow_part(hs_fields *ctx, hs_line *memory, double start_fraction, double fraction) {
    const hs_plan *plan = &ctx->plan;
    double end = hs_min(fraction, ctx->elastic_end);
    int status = HS_OK;
    if (ctx->has_target) status = hs_make_copies(ctx, memory);
    if (start_fraction < end && status == HS_OK) {
        /* nothing slides: friction and shapes at the end are those of one step */
        if (!ctx->is_constant && is_at_rest(ctx, memory))
            status = hs_advance_step(ctx, memory, start_fraction, end);
        else if (!ctx->is_constant ||
                 (ctx->has_target && !(plan->is_straight && end < plan->segment[1])))
            status = hs_integrate_timed(ctx, memory, start_fraction, end);
        else if (ctx->has_target)
            status = follow_elastic(ctx, memory, start_fraction, end);
        else
            status = follow_constant(ctx, memory, &ctx->constant, start_fraction / ctx->elastic_end,
                                     end / ctx->elastic_end);
        start_fraction = end;
    }
    if (status != HS_OK || fraction <= ctx->elastic_end) return status;
    if (start_fraction == ctx->elastic_end) {
        /* summits yield to the end of the path in one step where nothing is or will be strained */
        ctx->yield.is_at_rest = ctx->only_yields && is_at_rest(ctx, memory);
        if (!ctx->yield.is_at_rest) status = prepare_to_yield(ctx, memory);
    }
    if (status != HS_OK) return status;
    return ctx->yield.is_at_rest ? yield_unstrained(ctx, memory, fraction)
                                 : hs_integrate_timed(ctx, memory, start_fraction, fraction);
}

/* Estimate the displacement at the end of the present segment: by one step; elastic if summits
 * yield. */
static int guess_displacement(hs_fields *ctx, const hs_line *memory, hs_line *trial,
                              double *displacement) {
    const hs_plan *plan = &ctx->plan;
    double end = plan->segment[1], d = hs_toward(plan->approach[0], plan->approach[1], end);
    if (!(ctx->yield.onset < end)) {
        int status = hs_advance_step(ctx, trial, plan->segment[0], end);
        *displacement = trial->displacement;
        return status;
    }
    hs_target target = {hs_toward(plan->request[0], plan->request[1], end), 1.0, ctx->compliance};
    if (plan->tangential_by_load) target = hs_to_load(target.value);
    return hs_solve_displacement(
        (hs_line *)memory, d, hs_load_at(hs_all_of(memory->contact), d).load, target, displacement);
}

/* Solve for the displacement to which the present segment is straight, by a secant over the path:
 * its last substep meets the request. Returns the memory at the end in `reached`. */
static int solve_target(hs_fields *ctx, const hs_line *memory, hs_line **reached) {
    hs_plan *plan = &ctx->plan;
    double touch = memory->contact->sorted_gap[0], aimed = NAN, missed = NAN;
    hs_line *trial = NULL;
    plan->is_straight = 1;
    plan->segment_displacement[0] = memory->displacement;
    for (int turn = 0;; ++turn) {
        hs_line_free(trial);
        trial = hs_copy_unshared(ctx, memory);
        if (!trial) return HS_OUT_OF_MEMORY;
        hs_set_clock(trial, NAN);
        int status = turn ? follow_part(ctx, trial, plan->segment[0], plan->segment[1])
                          : guess_displacement(ctx, memory, trial, plan->segment_displacement + 1);
        if (status != HS_OK) {
            hs_line_free(trial);
            return status;
        }
        if (turn == 0) continue;
        double gap = trial->displacement - plan->segment_displacement[1],
               rate = (gap - missed) / (plan->segment_displacement[1] - aimed);
        double top = hs_max(hs_max(memory->approach, trial->approach) - touch, 0.0);
        double tolerated = TARGET_TOLERANCE_FACTOR * ctx->drive->tolerance *
                           hs_friction_range(trial, HUGE_VAL).max * top;
        if (fabs(gap) <= tolerated || turn == MAX_TARGET_STEPS) break;
        aimed = plan->segment_displacement[1];
        missed = gap;
        plan->segment_displacement[1] +=
            rate < -MIN_SECANT_RATE && rate > -1.0 / MIN_SECANT_RATE ? -gap / rate : gap;
    }
    *reached = trial;
    return HS_OK;
}

/* Find the fractions at which a request crosses the friction limit, in a number of substeps;
 * HS_BEYOND_LIMIT unless it may `saturate`. */
static int find_crossings(hs_fields *ctx, const hs_line *memory, int chords, int saturate) {
    const hs_plan *plan = &ctx->plan;
    hs_line *trial = hs_copy_unshared(ctx, memory);
    int status = trial ? HS_OK : HS_OUT_OF_MEMORY;
    double start_fraction = 0.0, excess = 0.0;
    ctx->plan.segments.count = 1;
    ctx->plan.segments.end[0] = 1.0;
    ctx->plan.segments.side[0] = 0;
    ctx->crossings = &ctx->plan.segments;
    ctx->plan.is_straight = 0;
    for (int k = 1; start_fraction < 1.0 && status == HS_OK;) {
        double fraction = (double)k / chords;
        if (start_fraction == ctx->elastic_end) status = prepare_to_yield(ctx, trial);
        if (start_fraction < ctx->elastic_end && ctx->elastic_end < fraction)
            fraction = ctx->elastic_end;
        else
            ++k;
        if (status == HS_OK) status = hs_advance_step(ctx, trial, start_fraction, fraction);
        if (status == HS_OK)
            status = hs_count_work(ctx->drive, &ctx->work, 8 + memory->contact->count);
        if (status == HS_OK && !saturate && fabs(trial->excess) > excess) {
            excess = fabs(trial->excess);
            ctx->refusal->request = hs_toward(plan->request[0], plan->request[1], fraction) *
                                    memory->contact->units.load;
            ctx->refusal->limit = fabs(trial->tangential_load) * memory->contact->units.load;
        }
        start_fraction = fraction;
    }
    ctx->crossings = NULL;
    hs_line_free(trial);
    return status == HS_OK && excess > 0.0 ? (int)HS_BEYOND_LIMIT : status;
}

/* Find the segments of a path whose tangential load is controlled while its approach is linear. A
 * request within the friction limit at both ends is one segment, since no load is prescribed in
 * between. */
static int find_segments(hs_fields *ctx, const hs_line *memory) {
    hs_plan *plan = &ctx->plan;
    const hs_drive *drive = ctx->drive;
    hs_drive held = *drive;
    const double slack = 1.0 + HS_LIMIT_SLACK;
    int status = HS_OK;
    ctx->plan.segments.count = 1;
    ctx->plan.segments.end[0] = 1.0;
    ctx->plan.segments.side[0] = 0;
    if (!plan->tangential_by_load) return HS_OK;
    held.saturate = 1;
    ctx->drive = &held;
    int crosses = fabs(plan->request[0]) >
                  slack * hs_friction_limit(memory, memory->approach, memory->normal_load);
    if (!crosses) {
        hs_line *reached = NULL;
        plan->segment[0] = 0.0;
        plan->segment[1] = 1.0;
        status = solve_target(ctx, memory, &reached);
        if (status == HS_OK)
            crosses = slack * fabs(plan->request[1]) >=
                      hs_friction_limit(reached, reached->approach, reached->normal_load);
        hs_line_free(reached);
    }
    if (status == HS_OK && crosses)
        status = find_crossings(ctx, memory, CROSSING_SUBSTEPS, drive->saturate);
    ctx->drive = drive;
    return status;
}

/* Cut a path at the ends of segments, from which substeps count. */
static void cut_at_segments(hs_fields *ctx, const hs_segments *segments) {
    for (int k = 0; k + 1 < segments->count; ++k) {
        int64_t position = ctx->cut_count++;
        for (; position > 0 && ctx->cut[position - 1] > segments->end[k]; --position)
            ctx->cut[position] = ctx->cut[position - 1];
        ctx->cut[position] = segments->end[k];
    }
}

/* Integrate a part of a path, segment by segment. */
static int follow_segments(hs_fields *ctx, hs_line *memory, double start_fraction,
                           double fraction) {
    hs_plan *plan = &ctx->plan;
    int status = HS_OK;
    if (!ctx->has_target) return follow_part(ctx, memory, start_fraction, fraction);
    for (int k = 0; k < ctx->plan.segments.count && start_fraction < fraction && status == HS_OK;
         ++k) {
        double end = ctx->plan.segments.end[k], stop = hs_min(end, fraction);
        hs_line *reached = NULL;
        if (end <= start_fraction) continue;
        if (ctx->plan.segments.side[k] != 0) {
            plan->is_straight = 0;
        } else if (!plan->is_straight || plan->segment[1] != end ||
                   plan->segment[0] > start_fraction) {
            plan->segment[0] = start_fraction;
            plan->segment[1] = end;
            plan->ends_at_limit =
                k + 1 < ctx->plan.segments.count ? ctx->plan.segments.side[k + 1] : 0;
            status = solve_target(ctx, memory, &reached);
        }
        if (reached && status == HS_OK && stop == end && !hs_is_timed(memory))
            hs_line_swap(memory, reached);
        else if (status == HS_OK)
            status = follow_part(ctx, memory, start_fraction, stop);
        hs_line_free(reached);
        start_fraction = stop;
    }
    return status;
}

/* True if displacements are linear up to the solution for a load or a drive. */
static int is_target_solved(const hs_fields *ctx, const hs_line *memory, int still) {
    const hs_plan *plan = &ctx->plan;
    if (still && !(ctx->yield.onset < 1.0)) return 0;
    if (plan->both_loads || plan->ends_separated ||
        !(plan->tangential_by_load || ctx->compliance > 0.0))
        return 0;
    return !is_at_rest(ctx, memory);
}

/* Plan a path on which asperities may evolve, from the present state. */
static int plan_evolving(hs_fields *ctx, hs_line *memory, const hs_path *path, double until) {
    hs_set_clock(memory, path->begin);
    int status = HS_OK;
    if (ctx->only_yields && ctx->has_split && hs_slides_alike(memory)) {
        /* groups that were split as they yielded have equal histories again */
        status = hs_join_groups(memory, NULL, NULL, memory->approach, 0);
        ctx->has_split = 0;
    }
    if (status == HS_OK) status = hs_set_fields(ctx, memory, path);
    if (status != HS_OK) return status;
    const hs_plan *plan = &ctx->plan;
    const int yields = ctx->yield.onset < 1.0, is_constant = is_unchanging(ctx, memory);
    ctx->is_constant = is_constant;
    ctx->elastic_end = yields ? ctx->yield.onset : 1.0;
    ctx->has_target = is_target_solved(ctx, memory, is_constant);
    /* laws of friction have stations where asperities touch; where displacements are solved for,
     * substeps end there, too */
    int cuts = yields || (!is_constant &&
                          (ctx->has_wear || plan->tangential_by_load || ctx->compliance > 0.0));
    int by_load = !is_constant && ctx->evolution->law.kind != HS_NO_LAW &&
                  ctx->evolution->law.depends_on == HS_ON_TOTAL_LOAD;
    if (cuts || by_load) status = hs_cut_at_events(ctx, memory, cuts, by_load);
    if (status == HS_OK && is_constant && !ctx->has_target && ctx->elastic_end > 0.0) {
        hs_path elastic = yields ? path_to_onset(ctx, path) : *path;
        int direct = yields ? until / (double)path->parts >= ctx->elastic_end
                            : path->parts == 1 && until == 1.0;
        status = hs_plan_path(memory, &elastic, ctx->compliance, ctx->drive->saturate, direct,
                              &ctx->constant, ctx->refusal);
    }
    if (status != HS_OK) return status;
    if (ctx->has_target) {
        if (ctx->only_yields) status = hs_line_unshare_contact(memory);
        return status == HS_OK ? find_segments(ctx, memory) : status;
    }
    if (!ctx->drive->saturate || !plan->tangential_by_load || is_at_rest(ctx, memory)) return HS_OK;
    if (!is_constant || yields) {
        status = find_crossings(ctx, memory, CUT_SUBSTEPS, 1);
        cut_at_segments(ctx, &plan->segments);
    } else if (!ctx->only_yields) {
        cut_at_segments(ctx, &ctx->constant.segments);
    }
    return status;
}

/* Scale the energies dissipated since `start` to the balance of elastic energy and work, by a load
 * that is linear in the displacement. */
static void balance_energies(hs_line *memory, const hs_line *start) {
    const double lost = memory->dissipated - start->dissipated,
                 work = 0.5 * (start->tangential_load + hs_total_force(memory)) *
                        (memory->displacement - start->displacement);
    const double balance =
        hs_max(work + hs_elastic_energy(start, NULL) - hs_elastic_energy(memory, NULL), 0.0);
    if (!(lost > 0.0)) return;
    for (int64_t i = 0; i < memory->contact->count; ++i) {
        double start_fraction = start->dissipated_each[i];
        memory->dissipated_each[i] =
            start_fraction + balance / lost * (memory->dissipated_each[i] - start_fraction);
    }
    memory->dissipated = start->dissipated + balance;
}

/* Change friction linearly up to the second of `goals` at a constant approach. The tangential load,
 * or the drive, is constant up to the fraction at which friction no longer holds the load; from
 * there on the displacement is. */
static int change_friction(hs_fields *ctx, hs_line *memory, double held) {
    hs_plan *plan = &ctx->plan;
    int by_load = memory->tangential_control == HS_LOAD, status = HS_OK;
    double drive = memory->displacement + ctx->compliance * memory->tangential_load;
    plan->approach[0] = plan->approach[1] = memory->approach;
    plan->normal_load[0] = plan->normal_load[1] = memory->normal_load;
    plan->tangential_by_load = plan->both_loads = plan->normal_by_load = by_load;
    plan->request[0] = plan->request[1] = by_load ? memory->tangential_load : drive;
    plan->times[0] = plan->times[1] = memory->clock.end;
    if (!by_load && ctx->compliance == 0.0) held = 0.0;
    if (held > 0.0) {
        hs_line *start = hs_line_copy(memory);
        status = start ? hs_make_copies(ctx, memory) : (int)HS_OUT_OF_MEMORY;
        if (status == HS_OK)
            status = hs_integrate_substeps(ctx, memory, ctx->copies[0], ctx->copies[1], 0.0, held);
        if (status == HS_OK) balance_energies(memory, start);
        hs_line_free(start);
    }
    if (status != HS_OK || held == 1.0) return status;
    plan->tangential_by_load = plan->both_loads = plan->normal_by_load = 0;
    ctx->compliance = 0.0;
    plan->request[0] = plan->request[1] = memory->displacement;
    return hs_advance_step(ctx, memory, held, 1.0);
}

int hs_line_set_friction(hs_line *memory, const double *friction, const hs_drive *drive) {
    hs_evolution evolution;
    hs_fields ctx;
    hs_refusal unread;
    /* up to the limit the load is held in spite of rounding */
    hs_drive saturating = *drive;
    saturating.saturate = 1;
    memset(&evolution, 0, sizeof evolution);
    int status = hs_line_restore_groups(memory), falls = 0;
    hs_settle_energies(memory);
    if (status == HS_OK) status = hs_split_groups(memory, friction, friction);
    if (status == HS_OK) status = hs_fields_init(&ctx, memory, &evolution, &saturating, &unread);
    if (status != HS_OK) return status;
    const hs_contact *contact = memory->contact;
    const double load = memory->tangential_load;
    double before = hs_friction_limit(memory, memory->approach, memory->normal_load), held = 1.0;
    evolution.goal = ctx.goals[1];
    for (int64_t g = 0; g < contact->groups; ++g) {
        double changed = hs_bound_friction(friction[contact->order[contact->first[g]]]);
        falls |= memory->depth[g] > 0 && changed < memory->friction[g];
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i) {
            ctx.goals[0][contact->order[i]] = memory->friction[g];
            ctx.goals[1][contact->order[i]] = changed;
        }
        memory->friction[g] = changed;
    }
    double after = hs_friction_limit(memory, memory->approach, memory->normal_load);
    if (falls && memory->tangential_control == HS_LOAD && fabs(load) > after)
        held = hs_min(hs_max((before - fabs(load)) / (before - after), 0.0), 1.0);
    hs_flag_steep(memory);
    if (falls) {
        for (int64_t g = 0; g < contact->groups; ++g)
            memory->friction[g] = ctx.goals[0][contact->order[contact->first[g]]];
        memory->is_direct = 1;
        status = change_friction(&ctx, memory, held);
        memory->is_direct = 0;
        memory->excess = 0.0;
        if (memory->tangential_control == HS_LOAD) memory->tangential_load = load;
    }
    hs_fields_clear(&ctx);
    return status;
}

int hs_line_step(hs_line *memory, int normal_control, double normal_target, int tangential_control,
                 double tangential_target, const hs_drive *drive, hs_refusal *refusal) {
    const hs_units *units = &memory->contact->units;
    /* NaN keeps the previous control of a channel */
    int presses = !isnan(normal_target), moves = !isnan(tangential_target);
    hs_path path = {presses ? normal_target : 0.0,
                    (double)presses,
                    {moves ? tangential_target : 0.0, 0.0},
                    {(double)moves, 0.0},
                    1,
                    0,
                    presses ? normal_control : memory->normal_control,
                    {moves ? tangential_control : memory->tangential_control, HS_HELD},
                    1,
                    NAN,
                    NAN};
    hs_plan plan;
    hs_refusal unread;
    if (!refusal) refusal = &unread;
    refusal->path = 0;
    path = hs_scale_path(units, &path);
    hs_set_clock(memory, NAN);
    /* a refused step leaves the representation */
    hs_line *copy = hs_is_represented(memory, &path) ? NULL : hs_line_copy(memory);
    hs_line *changed = copy ? copy : memory, *line;
    int status = hs_represent(changed, &path, &line);
    hs_set_clock(line, NAN);
    if (status == HS_OK)
        status = hs_plan_path(line, &path, drive->compliance[0] * units->stiffness, drive->saturate,
                              1, &plan, refusal);
    if (status == HS_OK) status = hs_follow_plan(line, &plan, 0.0, 1.0, drive);
    hs_update_from(changed, line);
    if (copy && status == HS_OK)
        hs_line_take(memory, copy);
    else
        hs_line_free(copy);
    refusal->status = status;
    if (status != HS_OK) return status;
    memory->normal_control = path.normal_control;
    memory->tangential_control = path.tangential_control[0];
    return HS_OK;
}

/* Threads that write rows during the integration.
 *
 * The integration is sequential, in one thread, which passes copies of the memory to writers. Rows
 * are independent, and no sum runs over several rows, so the bits do not depend on the number of
 * threads. If all writers are busy, the main thread writes the row. */
typedef struct row_writers row_writers;

#if defined(_WIN32) || defined(HS_ONE_THREAD)

static row_writers *start_writers(int threads, const hs_line *memory, const hs_rows *rows) {
    return (void)threads, (void)memory, (void)rows, (row_writers *)NULL;
}

static int pass_to_writer(row_writers *writers, const hs_line *memory, int64_t row, int saturated) {
    return (void)writers, (void)memory, (void)row, (void)saturated, 0;
}

static int stop_writers(row_writers *writers) { return (void)writers, (int)HS_OK; }

#else

#include <pthread.h>

/* Writer threads, at most; chosen. */
#define MAX_THREADS 64

/* Copies of rows for each thread, so that one may wait while one is written; chosen. */
#define WAITING 2

enum { FREE, FILLED, TAKEN };

/* Copy of a memory at a row. */
typedef struct copy_of_row {
    hs_line *memory;
    int64_t row;
    int saturated;
    int state;
} copy_of_row;

struct row_writers {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    pthread_t thread[MAX_THREADS];
    copy_of_row copies[WAITING * MAX_THREADS];
    const hs_rows *rows;
    hs_contact *contact;
    int threads;
    int count;  /* of copies */
    int ends;   /* true if no more rows follow */
    int status; /* error of a thread, else HS_OK */
};

static copy_of_row *find_copy(row_writers *writers, int state) {
    for (int i = 0; i < writers->count; ++i)
        if (writers->copies[i].state == state) return writers->copies + i;
    return NULL;
}

static void *write_rows(void *argument) {
    row_writers *writers = (row_writers *)argument;
    hs_recorder recorder;
    int status = hs_recorder_init(&recorder, writers->contact, writers->rows);
    pthread_mutex_lock(&writers->lock);
    for (;;) {
        copy_of_row *copy = find_copy(writers, FILLED);
        if (!copy && writers->ends) break;
        if (!copy) {
            pthread_cond_wait(&writers->changed, &writers->lock);
            continue;
        }
        copy->state = TAKEN;
        pthread_mutex_unlock(&writers->lock);
        if (status == HS_OK)
            status = hs_record(&recorder, copy->memory, copy->row, copy->saturated);
        pthread_mutex_lock(&writers->lock);
        copy->state = FREE;
        if (status != HS_OK) writers->status = status;
    }
    pthread_mutex_unlock(&writers->lock);
    hs_recorder_clear(&recorder);
    return NULL;
}

static int stop_writers(row_writers *writers) {
    if (!writers) return HS_OK;
    pthread_mutex_lock(&writers->lock);
    writers->ends = 1;
    pthread_cond_broadcast(&writers->changed);
    pthread_mutex_unlock(&writers->lock);
    for (int i = 0; i < writers->threads; ++i) pthread_join(writers->thread[i], NULL);
    int status = writers->status;
    for (int i = 0; i < writers->count; ++i) hs_line_free(writers->copies[i].memory);
    pthread_cond_destroy(&writers->changed);
    pthread_mutex_destroy(&writers->lock);
    free(writers);
    return status;
}

static row_writers *start_writers(int threads, const hs_line *memory, const hs_rows *rows) {
    if (threads < 2) return NULL;
    row_writers *writers = (row_writers *)calloc(1, sizeof *writers);
    if (!writers) return NULL;
    writers->rows = rows;
    writers->contact = memory->contact;
    if (threads - 1 > MAX_THREADS) threads = MAX_THREADS + 1;
    pthread_mutex_init(&writers->lock, NULL);
    pthread_cond_init(&writers->changed, NULL);
    while (writers->count < WAITING * (threads - 1)) {
        hs_line *copy = hs_line_copy(memory);
        if (!copy) break;
        writers->copies[writers->count++].memory = copy;
    }
    while (writers->count && writers->threads < threads - 1) {
        if (pthread_create(writers->thread + writers->threads, NULL, write_rows, writers) != 0)
            break;
        ++writers->threads;
    }
    if (writers->threads) return writers;
    stop_writers(writers);
    return NULL;
}

static int pass_to_writer(row_writers *writers, const hs_line *memory, int64_t row, int saturated) {
    pthread_mutex_lock(&writers->lock);
    copy_of_row *copy = find_copy(writers, FREE);
    if (copy) copy->state = TAKEN;
    pthread_mutex_unlock(&writers->lock);
    if (!copy) return 0;
    int copied = hs_line_assign(copy->memory, memory) == HS_OK;
    copy->row = row;
    copy->saturated = saturated;
    pthread_mutex_lock(&writers->lock);
    copy->state = copied ? FILLED : FREE;
    pthread_cond_signal(&writers->changed);
    pthread_mutex_unlock(&writers->lock);
    return copied;
}

#endif

/* Product of paths and recorded asperities from which threads are faster in spite of their start;
 * chosen. */
#define MIN_SHARED_WORK (1 << 19)

int hs_line_integrate(hs_line *memory, const hs_path *paths, int64_t count, const hs_rows *rows,
                      const hs_drive *drive, double until, const hs_evolution *evolution,
                      hs_refusal *refusal) {
    const hs_units *units = &memory->contact->units;
    double compliance = drive->compliance[0] * units->stiffness;
    hs_recorder recorder;
    hs_fields ctx;
    hs_plan plan;
    hs_refusal unread;
    row_writers *writers = NULL;
    int flag = 0, status = HS_OK;
    if (!refusal) refusal = &unread;
    if (evolution && !hs_can_evolve(memory, evolution)) return HS_FOREIGN;
    int64_t work = 0, work_per_row = 1 + (memory->contact->count + (rows ? rows->columns : 0)) / 16;
    if (evolution) {
        status = hs_fields_init(&ctx, memory, evolution, drive, refusal);
        /* it changes places with copies whose summits change */
        if (status == HS_OK && !ctx.only_yields && (ctx.has_wear || ctx.has_yielding))
            status = hs_line_unshare_contact(memory);
        if (status == HS_OK && !ctx.only_yields) status = hs_make_copies(&ctx, memory);
    }
    int recorded = hs_recorder_init(&recorder, memory->contact, rows);
    if (status == HS_OK) status = recorded;
    if (status == HS_OK && !evolution && count * (rows ? rows->columns : 0) >= MIN_SHARED_WORK)
        writers = start_writers(drive->threads, memory, rows);
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        hs_path path = hs_scale_path(&memory->contact->units, paths + p);
        double previous_fraction = 0.0;
        hs_line *line = memory;
        refusal->path = p;
        if (evolution) {
            const int has_split = ctx.has_split;
            status = plan_evolving(&ctx, memory, &path, until);
            if (has_split != ctx.has_split) hs_recorder_forget(&recorder);
        } else {
            status = hs_represent(memory, &path, &line);
            hs_set_clock(line, path.begin);
            if (status == HS_OK)
                status = hs_plan_path(line, &path, compliance, drive->saturate,
                                      path.parts == 1 && until == 1.0, &plan, refusal);
        }
        for (int64_t division = 1; division <= path.parts && status == HS_OK; ++division) {
            double fraction = until * ((double)division / (double)path.parts);
            status = evolution ? follow_segments(&ctx, memory, previous_fraction, fraction)
                               : hs_follow_plan(line, &plan, previous_fraction, fraction, drive);
            hs_update_from(memory, line);
            previous_fraction = fraction;
            if (status == HS_OK) status = hs_count_work(drive, &work, work_per_row);
            if (status == HS_OK && memory->lost_slides) status = HS_OUT_OF_MEMORY;
            if (status != HS_OK) break;
            /* several paths may share one row */
            flag |= memory->excess != 0.0;
            if (rows && (division < path.parts || path.recorded)) {
                int64_t row = path.first_row + division - 1;
                /* asperities may have another order now */
                if (evolution && (!ctx.only_yields || ctx.has_target || fraction > ctx.elastic_end))
                    hs_recorder_forget(&recorder);
                if (!(writers && pass_to_writer(writers, memory, row, flag)))
                    status = hs_record(&recorder, memory, row, flag);
                flag = 0;
            }
        }
        if (evolution) {
            hs_contact_free(ctx.plan.start_contact);
            ctx.plan.start_contact = NULL;
            if (ctx.elastic_end < 1.0) ctx.yield.next_onset = NAN;
            if (ctx.elastic_end < 1.0 || ctx.has_target) hs_recorder_forget(&recorder);
        }
        memory->normal_control = path.normal_control;
        memory->tangential_control = path.tangential_control[0];
    }
    int written = stop_writers(writers);
    if (status == HS_OK) status = written;
    hs_recorder_clear(&recorder);
    if (evolution) hs_fields_clear(&ctx);
    refusal->status = status;
    return status;
}
