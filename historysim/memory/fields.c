/* Fields: friction of groups at stations of a step, and summits that wear or yield.
 *
 * Where friction depends on the own load, an asperity that touches or separates, or whose approach
 * changes much, has stations within a step, graded towards touch, where mu is proportional to 1/N
 * or N^(-1/3). The volume that an asperity loses is proportional to its load and slid distance; the
 * mean shape and the end shape that follow on a step are predicted.
 *
 * A summit that yields while it bears tractions, of radius R before a step and R' at its end, keeps
 * them at their radii sqrt(R b): its springs have the labels b R/R' under the new summit, and keep
 * their deflections, and so loads and energy. With the ratio R'/R, mu R'/R is their cone at the
 * start of the step, and mu at its end: a summit that yields is one whose friction falls. No limit
 * of a spring falls meanwhile, since the approach grows. */

#include "fields.h"
#include "contact.h"
#include "laws.h"
#include "line.h"

#define MIN_CUT_DISTANCE 1e-9

/* Cuts of a path near first touch where friction depends on the total load, and the ratio of their
 * approaches; chosen. */
#define CUTS_NEAR_TOUCH 3

#define TOUCH_RATIO 4.0

/* Ratio of the approaches of adjacent stations, less 1, over the length of the substep as a
 * fraction of the path, so that twice as many substeps have twice as many stations and do not agree
 * because both have the same; the same on a substep from first contact on, with wider stations
 * there; and a ratio over a substep that needs none. Chosen. */
#define STATION_SPACING 1.6

#define TOUCH_SPACING 0.2

#define MIN_DEPTH_RATIO 1.03

#define MAX_EVEN_STATIONS 8

#define MAX_STATIONS 16

/* Placeholder of a coefficient that a law returns. */
#define QUERIED (-1.0)

/* Allocate buffers by asperity and by group; where asperities yield, for a group of each. */
static int make_buffers(hs_fields *ctx, const hs_contact *contact) {
    size_t n = (size_t)contact->count,
           g = (size_t)(ctx->has_yielding ? contact->count : contact->groups);
    double **arrays_of_asperities[] = {&ctx->goals[0],
                                       &ctx->goals[1],
                                       &ctx->slide,
                                       &ctx->predicted_slide,
                                       &ctx->shape.slide_begin_approach,
                                       &ctx->shape.slide_end_approach,
                                       &ctx->shape.mean_load,
                                       &ctx->shape.energy,
                                       &ctx->shape.lost_volume,
                                       &ctx->shape.shaped_volume,
                                       &ctx->start_gap,
                                       &ctx->start_energy,
                                       &ctx->shape.mid_height,
                                       &ctx->shape.mid_radius,
                                       &ctx->shape.end_height,
                                       &ctx->shape.end_radius,
                                       &ctx->trial_energy,
                                       &ctx->shape.unworn_slide,
                                       &ctx->yield.start_edge,
                                       &ctx->yield.cone_ratio,
                                       (double **)&ctx->start_depth,
                                       (double **)&ctx->yield.positions,
                                       &ctx->slide_begin,
                                       &ctx->slide_end};
    size_t arrays = sizeof arrays_of_asperities / sizeof *arrays_of_asperities;
    double *numbers = (double *)malloc((arrays * n + 5 * g + 1) * sizeof *numbers + n);
    ctx->buffer = numbers;
    if (!numbers) return HS_OUT_OF_MEMORY;
    for (size_t k = 0; k < arrays; ++k, numbers += n) *arrays_of_asperities[k] = numbers;
    ctx->group_load = numbers;
    ctx->end_friction = ctx->group_load + g;
    ctx->start_edge = ctx->end_friction + g;
    ctx->group_stations = (int64_t *)(ctx->start_edge + g);
    ctx->saved_steep = (uint8_t *)(ctx->group_stations + g + 1);
    ctx->yield.has_yielded = ctx->saved_steep + g * sizeof(double);
    return HS_OK;
}

/* True if the friction of asperities depends on loads or slid distances. */
static int has_law(const hs_evolution *evolution) {
    return evolution->law.kind != HS_NO_LAW && evolution->law.depends_on != HS_ON_NOTHING;
}

/* Split groups into asperities that evolve apart. */
static int split_evolving_groups(hs_line *memory, const hs_evolution *evolution) {
    const hs_law *law = &evolution->law;
    size_t count = (size_t)memory->contact->count;
    int depends = has_law(evolution), status = HS_OK;
    if (evolution->wear.kind != HS_NO_WEAR || (depends && law->depends_on != HS_ON_TOTAL_LOAD))
        status =
            hs_split_groups(memory, memory->evolved->summit_height, memory->evolved->summit_radius);
    if (status == HS_OK && depends && memchr(memory->evolved->friction_overridden, 1, count)) {
        double *overridden = (double *)malloc(count * sizeof *overridden);
        if (!overridden) return HS_OUT_OF_MEMORY;
        for (size_t i = 0; i < count; ++i) overridden[i] = memory->evolved->friction_overridden[i];
        status = hs_split_groups(memory, overridden, overridden);
        free(overridden);
    }
    if (status == HS_OK && evolution->goal) {
        status = hs_split_groups(memory, evolution->goal, evolution->goal);
        memset(memory->evolved->friction_overridden, 1, count);
    }
    return status;
}

int hs_fields_init(hs_fields *ctx, hs_line *memory, const hs_evolution *evolution,
                   const hs_drive *drive, hs_refusal *refusal) {
    memset(ctx, 0, sizeof *ctx);
    ctx->evolution = evolution;
    ctx->drive = drive;
    ctx->refusal = refusal;
    ctx->has_wear = evolution->wear.kind != HS_NO_WEAR;
    ctx->has_yielding = evolution->yielding.kind != HS_NO_YIELDING;
    ctx->yield.onset = HUGE_VAL;
    ctx->yield.next_onset = NAN;
    ctx->only_yields = ctx->has_yielding && !ctx->has_wear && !has_law(evolution) &&
                       !evolution->goal && !evolution->follow_sliding;
    ctx->compliance = drive->compliance[0] * memory->contact->units.stiffness;
    int status = split_evolving_groups(memory, evolution);
    if (status == HS_OK) status = make_buffers(ctx, memory->contact);
    ctx->has_split = memory->contact->groups > 1;
    return status;
}

void hs_fields_clear(hs_fields *ctx) {
    for (int k = 0; k < 2; ++k) hs_line_free(ctx->copies[k]);
    free(ctx->buffer);
    free(ctx->stations);
    free(ctx->scratch);
    free(ctx->saved_stack);
}

hs_line *hs_copy_unshared(const hs_fields *ctx, const hs_line *memory) {
    hs_line *copy = hs_line_copy(memory);
    if (!copy || !(ctx->has_wear || ctx->has_yielding) || hs_line_unshare_contact(copy) == HS_OK)
        return copy;
    hs_line_free(copy);
    return NULL;
}

int hs_make_copies(hs_fields *ctx, const hs_line *memory) {
    for (int k = 0; k < 2; ++k) {
        if (ctx->copies[k] && ctx->copies[k]->contact->groups == memory->contact->groups) continue;
        hs_line_free(ctx->copies[k]);
        ctx->copies[k] = hs_copy_unshared(ctx, memory);
        if (!ctx->copies[k]) return HS_OUT_OF_MEMORY;
    }
    return HS_OK;
}

static void reverse(uint64_t *low, uint64_t *high) {
    for (; low < high; ++low, --high) {
        uint64_t saved = *low;
        *low = *high;
        *high = saved;
    }
}

/* Swap two adjacent runs of numbers. */
static void swap_runs(void *numbers, int64_t first_run, int64_t second, int64_t step_end) {
    uint64_t *run = (uint64_t *)numbers;
    reverse(run + first_run, run + second - 1);
    reverse(run + second, run + step_end - 1);
    reverse(run + first_run, run + step_end - 1);
}

/* Swap a group and the next one with the given number of vertices, also of a group that does not
 * touch at present. */
static void swap_groups(hs_line *memory, int64_t index, int64_t deepest) {
    const hs_contact *contact = memory->contact;
    int64_t *first_run = (int64_t *)contact->first + index,
            middle = first_run[0] + (first_run[2] - first_run[1]);
    void *arrays[] = {(void *)contact->gap, (void *)contact->weight, (void *)contact->order,
                      memory->dissipated_each};
    for (size_t k = 0; k < 4; ++k) swap_runs(arrays[k], first_run[0], first_run[1], first_run[2]);
    first_run[1] = middle;
    swap_runs(memory->friction, index, index + 1, index + 2);
    swap_runs(memory->depth, index, index + 1, index + 2);
    uint8_t steep = memory->steep[index];
    memory->steep[index] = memory->steep[index + 1];
    memory->steep[index + 1] = steep;
    hs_vertex *group_stack = memory->vertices + index * memory->capacity,
              *next_stack = group_stack + memory->capacity;
    for (int64_t j = 0; j < deepest; ++j) {
        hs_vertex saved = group_stack[j];
        group_stack[j] = next_stack[j];
        next_stack[j] = saved;
    }
}

/* True if the group at `index` precedes the previous one: by smallest gap, then by number of its
 * first asperity, as in a new contact. */
static int is_before_previous(const hs_contact *contact, int64_t index) {
    int64_t previous = contact->first[index - 1], own = contact->first[index];
    if (contact->gap[previous] != contact->gap[own])
        return contact->gap[own] < contact->gap[previous];
    return contact->order[own] < contact->order[previous];
}

/* Insertion sort of groups whose smallest gaps have changed, which are nearly in order. */
static void sort_groups(hs_line *memory, const int64_t *depth) {
    const hs_contact *contact = memory->contact;
    const int64_t *order = contact->order, *first_run = contact->first;
    for (int64_t index = 1; index < contact->groups; ++index)
        for (int64_t k = index; k > 0 && is_before_previous(contact, k); --k) {
            int64_t low = depth[order[first_run[k - 1]]], high = depth[order[first_run[k]]];
            swap_groups(memory, k - 1, low > high ? low : high);
        }
}

void hs_set_summit_shapes(hs_line *memory, const double *height, const double *radius,
                          const int64_t *depth) {
    const hs_contact *contact = memory->contact;
    const int64_t *order = contact->order, *first_run = contact->first;
    double *gap = (double *)contact->gap, *weight = (double *)contact->weight;
    double per_length = 1.0 / contact->units.length, datum = contact->datum;
    for (int64_t i = 0; i < contact->count; ++i) {
        gap[i] = (datum - height[order[i]]) * per_length;
        weight[i] = sqrt(radius[order[i]] * per_length);
    }
    for (int64_t index = 0; index < contact->groups; ++index)
        memory->depth[index] =
            gap[first_run[index]] < memory->approach ? depth[order[first_run[index]]] : 0;
    sort_groups(memory, depth);
    if (contact->groups > 1) {
        memcpy((double *)contact->sorted_gap, gap, (size_t)contact->count * sizeof *gap);
        memcpy((double *)contact->sorted_weight, weight, (size_t)contact->count * sizeof *weight);
    }
    hs_contact_changed(memory->contact);
    memory->normal_load = hs_load_at(hs_all_of(contact), memory->approach).load;
}

void hs_remove_worn_springs(hs_line *memory) {
    for (int64_t index = 0; index < memory->contact->groups; ++index) {
        hs_vertex *stack = memory->vertices + index * memory->capacity;
        double gap = memory->contact->gap[memory->contact->first[index]];
        int64_t worn = 0, depth = memory->depth[index];
        while (worn + 2 < depth && stack[worn + 1].label <= gap) ++worn;
        /* by rounding of its shape alone */
        if (depth == 0 && gap < memory->approach) hs_touch_unstrained(memory, index);
        if (depth < 2 || stack[worn].label >= gap) continue;
        memmove(stack, stack + worn, (size_t)(depth - worn) * sizeof *stack);
        stack->anchor = stack[1].anchor - stack[1].slope * (stack[1].label - gap);
        stack->label = gap;
        stack->normal = stack->tangential = stack->slope = 0.0;
        memory->depth[index] = depth - worn;
    }
}

void hs_store_gaps(hs_fields *ctx, const hs_contact *contact) {
    for (int64_t i = 0; i < contact->count; ++i)
        ctx->start_gap[contact->order[i]] = contact->gap[i];
}

void hs_store_depths(hs_fields *ctx, const hs_line *memory) {
    const hs_contact *contact = memory->contact;
    for (int64_t g = 0; g < contact->groups; ++g)
        ctx->start_depth[contact->order[contact->first[g]]] = memory->depth[g];
}

double hs_apply_wear(hs_fields *ctx, hs_line *memory, const double *height, const double *radius,
                     double stored) {
    hs_set_summit_shapes(memory, height, radius, ctx->start_depth);
    hs_refresh_loads(memory);
    return stored - hs_elastic_energy(memory, NULL);
}

int hs_predict_wear(hs_fields *ctx, const hs_line *memory, const hs_step_end *step_end) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_wear *wear = &ctx->evolution->wear;
    double unit = contact->units.length;
    double modulus = 4.0 / 3.0 * ctx->evolution->contact_modulus;
    for (int64_t g = 0; g < contact->groups; ++g)
        for (int64_t k = contact->first[g]; k < contact->first[g + 1]; ++k) {
            int64_t i = contact->order[k];
            if (ctx->shape.unworn_slide[i] + ctx->slide[i] == 0.0) {
                ctx->shape.mean_load[i] = ctx->shape.energy[i] = 0.0;
                continue;
            }
            double start = (memory->approach - ctx->start_gap[i]) * unit, slid = ctx->slide[i];
            double stop = step_end->d * unit - (contact->datum - ctx->shape.end_height[i]);
            /* an asperity slides to the end, or until it leaves */
            double leaves = stop < 0.0 && slid > 0.0 ? start / (start - stop) : 1.0;
            /* with a held load, the predicted distance may exceed the displacement of this
             * iteration */
            double begins =
                slid > 0.0 ? hs_max(leaves - slid / ctx->displacement_change, 0.0) : 0.0;
            ctx->shape.slide_begin_approach[i] = hs_max(start + begins * (stop - start), 0.0);
            ctx->shape.slide_end_approach[i] = hs_max(stop, 0.0);
            ctx->shape.mean_load[i] = 0.0;
            if (slid > 0.0)
                ctx->shape.mean_load[i] = hs_mean_load(
                    ctx->shape.slide_begin_approach[i], ctx->shape.slide_end_approach[i],
                    modulus * sqrt(0.5 * (evolved->summit_radius[i] + ctx->shape.end_radius[i])));
            ctx->shape.energy[i] = ctx->end_friction[g] * ctx->shape.mean_load[i] * slid;
        }
    int status = hs_lost_volumes(wear, contact->count, ctx->shape.mean_load, ctx->slide,
                                 ctx->shape.energy, ctx->shape.lost_volume);
    for (int64_t i = 0; i < contact->count; ++i) {
        double height = evolved->summit_height[i], radius = evolved->summit_radius[i],
               guess = ctx->shape.end_radius[i];
        ctx->shape.end_height[i] = height;
        ctx->shape.end_radius[i] = radius;
        ctx->shape.shaped_volume[i] = 0.0;
        if (ctx->shape.unworn_slide[i] + ctx->slide[i] > 0.0 &&
            ctx->shape.slide_begin_approach[i] + ctx->shape.slide_end_approach[i] > 0.0) {
            double waiting = hs_max(evolved->waiting_volume[i], -ctx->shape.lost_volume[i]);
            ctx->shape.shaped_volume[i] =
                hs_worn_summit(wear, radius * ctx->shape.slide_begin_approach[i],
                               guess * ctx->shape.slide_end_approach[i], 0.5 * (radius + guess),
                               evolved->shaped_volume[i], waiting, ctx->shape.lost_volume[i],
                               ctx->shape.end_height + i, ctx->shape.end_radius + i);
        }
        /* a shape changes while its asperity slides: its mean over the step */
        double changed = ctx->slide_begin[i] < ctx->slide_end[i]
                             ? 1.0 - 0.5 * (ctx->slide_begin[i] + ctx->slide_end[i])
                             : 0.5;
        ctx->shape.mid_height[i] = hs_toward(height, ctx->shape.end_height[i], changed);
        ctx->shape.mid_radius[i] = hs_toward(radius, ctx->shape.end_radius[i], changed);
    }
    return status;
}

int hs_yielding_end(const hs_fields *ctx, const hs_line *memory, double fraction, double *d,
                    double *load) {
    const hs_plan *plan = &ctx->plan;
    *d = hs_toward(plan->approach[0], plan->approach[1], fraction);
    *load = plan->normal_by_load && fraction == 1.0 ? plan->normal_load[1] : NAN;
    if (!plan->both_loads || fraction == 1.0) return HS_OK;
    *load = hs_toward(plan->normal_load[0], plan->normal_load[1], fraction);
    return hs_yielding_approach(memory, ctx->evolution, *load, d);
}

/* Each group of asperities that yield is equal. An asperity that first touches on the step does so
 * under its virgin summit: its path under the new one begins where it touches at the same fraction.
 */
int hs_apply_yielding(hs_fields *ctx, hs_line *memory, double d) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const double unit = contact->units.length;
    double *gap = (double *)contact->gap, *weight = (double *)contact->weight;
    for (int64_t i = 0; i < contact->count; ++i) {
        ctx->yield.start_edge[i] = memory->approach;
        ctx->yield.cone_ratio[i] = evolved->summit_radius[i];
    }
    int status = hs_yield_to(memory, ctx->evolution, d, ctx->yield.has_yielded);
    if (status != HS_OK) return status;
    hs_store_depths(ctx, memory);
    for (int64_t i = 0; i < contact->count; ++i)
        ctx->yield.cone_ratio[i] =
            ctx->yield.has_yielded[i] ? evolved->summit_radius[i] / ctx->yield.cone_ratio[i] : 1.0;
    for (int64_t g = 0; g < contact->groups; ++g) {
        int64_t first_run = contact->first[g], leader = contact->order[first_run];
        if (!ctx->yield.has_yielded[leader]) continue;
        hs_vertex *stack = memory->vertices + g * memory->capacity;
        double old = gap[first_run],
               new_gap = (contact->datum - evolved->summit_height[leader]) / unit;
        double ratio = ctx->yield.cone_ratio[leader];
        for (int64_t k = first_run; k < contact->first[g + 1]; ++k) {
            gap[k] = new_gap;
            weight[k] = sqrt(evolved->summit_radius[leader] / unit);
        }
        for (int64_t j = 0; j < memory->depth[g]; ++j) {
            stack[j].label = new_gap + (stack[j].label - old) / ratio;
            stack[j].slope *= ratio;
            stack[j].normal /= ratio;
        }
        double edge = memory->depth[g] ? stack[memory->depth[g] - 1].label
                                       : d - (d - new_gap) * ((d - memory->approach) / (d - old));
        for (int64_t k = first_run; k < contact->first[g + 1]; ++k) {
            ctx->yield.start_edge[contact->order[k]] = edge;
            if (memory->depth[g] == 0) ctx->yield.cone_ratio[contact->order[k]] = 1.0;
        }
    }
    sort_groups(memory, ctx->start_depth);
    if (contact->groups > 1) {
        for (int64_t i = 0; i < contact->count; ++i) ctx->yield.positions[i] = i;
        if (hs_sort_by(gap, ctx->yield.positions, contact->count) != HS_OK) return HS_OUT_OF_MEMORY;
        for (int64_t i = 0; i < contact->count; ++i) {
            ((double *)contact->sorted_gap)[i] = gap[ctx->yield.positions[i]];
            ((double *)contact->sorted_weight)[i] = weight[ctx->yield.positions[i]];
        }
    }
    hs_contact_changed(memory->contact);
    memory->known_label = NAN;
    return HS_OK;
}

/* Have room for so many stations more. */
static int reserve_stations(hs_fields *ctx, int64_t count) {
    if (count <= ctx->station_capacity) return HS_OK;
    size_t deep = 2 * (size_t)count;
    hs_station *grown = (hs_station *)malloc(deep * (sizeof *grown + 8 * sizeof(double)));
    if (!grown) return HS_OUT_OF_MEMORY;
    double *asked[4];
    for (size_t k = 0; k < 4; ++k) asked[k] = (double *)(grown + deep) + 2 * k * deep;
    if (ctx->station_capacity)
        memcpy(grown, ctx->stations, (size_t)ctx->station_capacity * sizeof *grown);
    for (size_t k = 0; k < 4 && ctx->station_capacity; ++k)
        memcpy(asked[k], ctx->query[k], 2 * (size_t)ctx->station_capacity * sizeof(double));
    free(ctx->stations);
    ctx->stations = grown;
    ctx->station_capacity = (int64_t)deep;
    memcpy(ctx->query, asked, sizeof asked);
    return HS_OK;
}

/* Add an asperity at an approach of its own to the queries of a law. */
static void add_query(hs_fields *ctx, int64_t number, const hs_contact *contact, double weight,
                      double own_approach, double slid) {
    ctx->query[0][number] = weight * sqrt(own_approach) * own_approach * contact->units.load;
    ctx->query[1][number] = weight * weight * contact->units.radius;
    ctx->query[2][number] = slid;
}

int hs_set_friction_field(hs_fields *ctx, const hs_line *memory, double d, double load,
                          double fraction, const double *predicted_slide) {
    const hs_evolution *evolution = ctx->evolution;
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_law *law = &evolution->law;
    int by_goal = evolution->goal != NULL;
    int by_law = !by_goal && law->kind != HS_NO_LAW && law->depends_on != HS_ON_NOTHING;
    int64_t count = 0, asked = 0;
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t i = contact->first[index], asperity = contact->order[i];
        double friction = memory->friction[index];
        if (reserve_stations(ctx, count + MAX_STATIONS) != HS_OK) return HS_OUT_OF_MEMORY;
        ctx->group_stations[index] = count;
        if (by_goal)
            friction = hs_toward(ctx->goals[0][asperity], ctx->goals[1][asperity], fraction);
        if (by_law && !evolved->friction_overridden[asperity]) {
            double start = hs_start_edge(ctx, memory, index) - contact->gap[i],
                   step_end = d - contact->gap[i];
            double weight = contact->weight[i];
            double deep = hs_max(start, step_end), shallow = hs_max(hs_min(start, step_end), 0.0),
                   at[MAX_STATIONS];
            double own_approach = start, slid = evolved->slid_distance[asperity] +
                                                (predicted_slide ? predicted_slide[asperity] : 0.0);
            int between = 0,
                bends = law->depends_on == HS_ON_OWN_LOAD && deep > MIN_DEPTH_RATIO * shallow;
            double spacing = hs_max(STATION_SPACING * ctx->step_length,
                                    (deep - shallow) / (MAX_EVEN_STATIONS * shallow));
            double ratio = 1.0 + (shallow > 0.0 ? spacing : TOUCH_SPACING);
            for (double next = deep / ratio;
                 bends && next > shallow && between < MAX_STATIONS - 1;) {
                at[between++] = next;
                next /= between < MAX_EVEN_STATIONS ? ratio : between < 12 ? 4.0 : 64.0;
            }
            /* an asperity keeps its friction until it begins to slide */
            double still = predicted_slide && start > 0.0 && step_end > 0.0
                               ? 1.0 - predicted_slide[asperity] / ctx->displacement_change
                               : 0.0;
            if (law->depends_on == HS_ON_SLID_DISTANCE && still > 0.0 && still < 1.0) {
                ctx->stations[count++] = HS_MADE(hs_station){still, friction, friction};
            }
            for (int k = 0; k <= between; ++k) {
                hs_station *crossing_value = ctx->stations + count++;
                double last_value = own_approach;
                own_approach = k == between ? step_end : at[step_end > start ? between - 1 - k : k];
                crossing_value->fraction =
                    k == between ? 1.0 : (own_approach - start) / (step_end - start);
                int touches =
                    own_approach > 0.0 && (load > 0.0 || law->depends_on != HS_ON_TOTAL_LOAD);
                crossing_value->friction = touches ? QUERIED : 0.0;
                crossing_value->mid_friction = bends && touches ? QUERIED : 0.0;
                if (touches && bends)
                    add_query(ctx, asked++, contact, weight,
                              0.5 * (hs_max(last_value, 0.0) + own_approach), slid);
                if (touches) add_query(ctx, asked++, contact, weight, own_approach, slid);
            }
        } else {
            ctx->stations[count++] = HS_MADE(hs_station){1.0, 0.0, friction};
        }
    }
    ctx->group_stations[contact->groups] = count;
    hs_loaded loaded = {asked, ctx->query[0], ctx->query[1], ctx->query[2],
                        load * contact->units.load};
    int status =
        asked ? hs_coefficients(law, evolution->contact_modulus, &loaded, ctx->query[3]) : HS_OK;
    for (int64_t k = 0, answer = 0; k < count && asked; ++k) {
        if (ctx->stations[k].mid_friction == QUERIED)
            ctx->stations[k].mid_friction = ctx->query[3][answer++];
        if (ctx->stations[k].friction == QUERIED)
            ctx->stations[k].friction = ctx->query[3][answer++];
    }
    for (int64_t index = 0; index < contact->groups; ++index)
        ctx->end_friction[index] = ctx->stations[ctx->group_stations[index + 1] - 1].friction;
    for (int64_t g = 0; g < contact->groups && ctx->yield.is_active; ++g)
        for (int64_t k = ctx->group_stations[g]; k < ctx->group_stations[g + 1]; ++k) {
            double more = (hs_cone_ratio(ctx, memory, g) - 1.0) * (1.0 - ctx->stations[k].fraction);
            ctx->stations[k].friction *= 1.0 + more;
            ctx->stations[k].mid_friction *= 1.0 + more;
        }
    return status;
}

/* Path fraction of an approach. */
static int fraction_at(const hs_fields *ctx, const hs_line *memory, double d, double *fraction) {
    const hs_plan *plan = &ctx->plan;
    double load = 0.0;
    int status = HS_OK;
    *fraction = (d - plan->approach[0]) / (plan->approach[1] - plan->approach[0]);
    if (!plan->both_loads || plan->normal_load[0] == plan->normal_load[1]) return HS_OK;
    if (ctx->has_yielding)
        status = hs_yielding_load(memory, ctx->evolution, d, &load);
    else
        load = hs_load_at(hs_all_of(memory->contact), d).load;
    *fraction = (load - plan->normal_load[0]) / (plan->normal_load[1] - plan->normal_load[0]);
    return status;
}

int hs_cut_at_events(hs_fields *ctx, const hs_line *memory, int touches, int graded) {
    const hs_plan *plan = &ctx->plan;
    const hs_contact *contact = memory->contact;
    int rises = plan->approach[1] > plan->approach[0];
    int64_t count = 0, apart = 0, arrays_of_asperities = contact->count,
            sets = ctx->yield.onset < 1.0 ? 2 : touches;
    int64_t events = sets * arrays_of_asperities + (graded ? CUTS_NEAR_TOUCH : 0);
    double *at = (double *)calloc((size_t)events * 2, sizeof *at);
    double low = hs_min(plan->approach[0], plan->approach[1]),
           high = hs_max(plan->approach[0], plan->approach[1]);
    int64_t *position = (int64_t *)(at + events);
    if (!at) return HS_OUT_OF_MEMORY;
    if (ctx->yield.onset < 1.0) low = hs_max(low, ctx->yield.next_onset);
    double min_distance = MIN_CUT_DISTANCE * (high - low), closer = high - contact->gap[0];
    for (int64_t k = 0; k < events; ++k) {
        double d = k >= sets * arrays_of_asperities ? contact->gap[0] + (closer /= TOUCH_RATIO)
                   : k < arrays_of_asperities
                       ? contact->gap[k]
                       : hs_yields_at(memory, &ctx->evolution->yielding, k - arrays_of_asperities);
        if (!(d > low + min_distance && d < high - min_distance)) continue;
        position[count] = count;
        at[count++] = d;
    }
    int status = hs_sort_by(at, position, count);
    for (int64_t k = 0; k < count; ++k)
        if (apart == 0 || at[position[k]] - at[position[apart - 1]] > min_distance)
            position[apart++] = position[k];
    int64_t stride = (apart + MAX_CUTS - 1) / MAX_CUTS;
    for (int64_t k = 0; k < apart && status == HS_OK; k += stride)
        status = fraction_at(ctx, memory, at[position[rises ? k : apart - 1 - k]],
                             ctx->cut + ctx->cut_count++);
    free(at);
    return status;
}

int hs_set_fields(hs_fields *ctx, const hs_line *memory, const hs_path *path) {
    const hs_evolution *evolution = ctx->evolution;
    const hs_contact *contact = memory->contact;
    hs_plan *plan = &ctx->plan;
    hs_set_targets(memory, path, ctx->compliance, ctx->drive->saturate, plan);
    /* of a path that ends separated: the anchor of the last spring */
    plan->displacement[1] =
        memory->depth[0] > 0 ? memory->vertices[0].anchor : memory->displacement;
    ctx->yield.onset = HUGE_VAL;
    ctx->cut_count = 0;
    if (ctx->has_yielding) {
        if (isnan(ctx->yield.next_onset))
            ctx->yield.next_onset = hs_next_yield(memory, &evolution->yielding);
        /* the contact is elastic at least up to the present approach */
        double next = hs_max(ctx->yield.next_onset, memory->approach);
        if (plan->approach[1] > next + HS_TIE * fabs(next)) {
            int status = HS_OK;
            if (plan->normal_by_load)
                status = hs_yielding_approach(memory, evolution, plan->normal_load[1],
                                              &plan->approach[1]);
            if (status != HS_OK) return status;
            ctx->yield.onset = (next - plan->approach[0]) / (plan->approach[1] - plan->approach[0]);
            if (plan->both_loads)
                ctx->yield.onset =
                    (hs_load_at(hs_all_of(contact), next).load - plan->normal_load[0]) /
                    (plan->normal_load[1] - plan->normal_load[0]);
            ctx->yield.onset = hs_min(hs_max(ctx->yield.onset, 0.0), 1.0);
        }
    }
    if (ctx->has_wear && plan->normal_by_load && !plan->both_loads &&
        !(plan->start_contact = hs_contact_copy(contact)))
        return HS_OUT_OF_MEMORY;
    for (int64_t g = 0; g < contact->groups && evolution->goal; ++g)
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i) {
            int64_t asperity = contact->order[i];
            ctx->goals[0][asperity] = memory->friction[g];
            ctx->goals[1][asperity] =
                hs_toward(memory->friction[g], hs_bound_friction(evolution->goal[asperity]),
                          evolution->goal_fraction);
        }
    return HS_OK;
}

int hs_line_set_summits(hs_line *memory, const double *summit_height, const double *summit_radius,
                        const uint8_t *fresh, const hs_evolution *evolution) {
    int64_t count = memory->contact->count;
    size_t size = (size_t)count * sizeof(double);
    if (!hs_can_evolve(memory, evolution)) return HS_FOREIGN;
    hs_drive drive;
    memset(&drive, 0, sizeof drive);
    hs_evolved *evolved = memory->evolved;
    int status = HS_OK, has_yielding = evolution->yielding.kind != HS_NO_YIELDING;
    double stored = hs_elastic_energy(memory, NULL), erased = 0.0;
    for (int64_t i = 0; i < count; ++i)
        erased += fresh[memory->contact->order[i]] && memory->contact->gap[i] < memory->approach;
    /* the arguments may be the arrays of the memory, which move when groups are split */
    memmove(evolved->summit_height, summit_height, size);
    memmove(evolved->summit_radius, summit_radius, size);
    for (int64_t i = 0; i < count; ++i) {
        if (!fresh[i]) continue;
        evolved->shaped_volume[i] = evolved->waiting_volume[i] = 0.0;
        if (!has_yielding) continue;
        evolved->virgin_height[i] = evolved->summit_height[i];
        evolved->virgin_radius[i] = evolved->summit_radius[i];
        evolved->yielded_to[i] = evolved->yielding_load[i] = 0.0;
    }
    hs_fields ctx;
    if (has_yielding) status = hs_yield_to(memory, evolution, memory->approach, NULL);
    if (status != HS_OK) return status;
    status = hs_fields_init(&ctx, memory, evolution, &drive, NULL);
    if (status == HS_OK) {
        const hs_contact *contact = memory->contact;
        double *gap = ctx.start_gap, *weight = ctx.slide;
        evolved = memory->evolved;
        for (int64_t i = 0; i < count; ++i) {
            gap[i] = (contact->datum - evolved->summit_height[i]) / contact->units.length;
            weight[i] = sqrt(evolved->summit_radius[i] / contact->units.radius);
        }
        status = hs_reshape(memory, gap, weight, fresh);
    }
    hs_fields_clear(&ctx);
    if (status != HS_OK) return status;
    evolved = memory->evolved;
    evolved->erased_memories += erased;
    evolved->erased_energy +=
        (stored - hs_elastic_energy(memory, NULL)) * memory->contact->units.energy;
    /* groups of fresh asperities may have been added */
    status = hs_fields_init(&ctx, memory, evolution, &drive, NULL);
    if (status == HS_OK)
        status =
            hs_set_friction_field(&ctx, memory, memory->approach, memory->normal_load, 1.0, NULL);
    if (status == HS_OK) {
        memcpy(memory->friction, ctx.end_friction,
               (size_t)memory->contact->groups * sizeof(double));
        hs_flag_steep(memory);
    }
    hs_fields_clear(&ctx);
    return status;
}
