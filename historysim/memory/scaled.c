/* Scaled: a contact of several friction coefficients at a constant approach d is a contact of
 * friction 1 (README.md, theory 12). In ξ = μ (d - a), the limit of spring a, all groups have the
 * cone |v| ≤ ξ, and after the same displacements the same polyline w(ξ). An asperity of depth δ and
 * weight k becomes one of depth μδ and weight k/√μ; its normal load is μP, and tangential loads,
 * radii, slip states and energies are equal. Labels are α = ξ_max - ξ, ξ_max the scaled approach.
 */

#include "scaled.h"
#include "contact.h"

/* Coefficients below this are not scaled, as weights are divided by their roots; chosen. */
#define MIN_SCALED_FRICTION 1e-12

/* Largest friction limit ξ of a spring, and the group that has it; 0 if the polylines of all groups
 * in contact cannot be scaled. */
static double largest_limit(const hs_line *memory, int64_t *group) {
    const hs_contact *contact = memory->contact;
    double span = 0.0;
    for (int64_t index = 0; index < contact->groups; ++index) {
        double depth = memory->approach - contact->gap[contact->first[index]],
               friction = memory->friction[index];
        if (depth <= 0.0) break;
        if (memory->steep[index] || friction < MIN_SCALED_FRICTION) return 0.0;
        if (friction * depth <= span) continue;
        span = friction * depth;
        *group = index;
    }
    return span > HS_MIN_APPROACH ? span : 0.0;
}

/* True if the polyline of a group is, in ξ, the outer part of that of a group with a limit at least
 * as large, ξ_max or less. */
static int agrees(const hs_line *memory, int64_t index, int64_t leader, double span) {
    const double d = memory->approach, friction = memory->friction[index],
                 scale = memory->friction[leader], ratio = friction / scale;
    const double limit_tie = HS_TIE * (span + friction * d), slope_tie = HS_TIE * friction,
                 tie = limit_tie + HS_TIE * fabs(memory->displacement);
    int64_t j = memory->depth[index] - 1, k = memory->depth[leader] - 1;
    const hs_vertex *vertex = memory->vertices + index * memory->capacity + j,
                    *other = memory->vertices + leader * memory->capacity + k;
    if (j < 1) return 0;
    /* labels and anchors at the edge are equal */
    while (fabs(vertex->slope - ratio * other->slope) <= slope_tie) {
        --vertex;
        --other;
        double excess = friction * (d - vertex->label) - scale * (d - other->label);
        if (--j == 0) return excess <= limit_tie;
        if (--k == 0 || fabs(excess) > limit_tie || fabs(vertex->anchor - other->anchor) > tie)
            return 0;
    }
    return 0;
}

/* Copy the energies of asperities from the order of one contact to the order of another. */
static void reorder_energies(hs_line *from, hs_line *to, double *scratch) {
    hs_settle_energies(from);
    for (int64_t i = 0; i < from->contact->count; ++i)
        scratch[from->contact->order[i]] = from->dissipated_each[i];
    for (int64_t i = 0; i < from->contact->count; ++i)
        to->dissipated_each[i] = scratch[to->contact->order[i]];
    if (to->far_energy) memset(to->far_energy, 0, hs_far_count(to->contact) * sizeof(double));
}

/* Give the sliding times of a memory to another. */
static void pass_slides(hs_line *from, hs_line *to) {
    to->slides = from->slides;
    from->slides = NULL;
}

int hs_line_add_scaled(hs_line *memory, int64_t depth) {
    const hs_contact *contact = memory->contact;
    const double d = memory->approach;
    int64_t leader;
    double span = largest_limit(memory, &leader), *gap, *weight;
    if (span == 0.0) return HS_NOT_A_STATE;
    gap = (double *)malloc(2 * (size_t)contact->count * sizeof *gap);
    if (!gap) return HS_OUT_OF_MEMORY;
    weight = gap + contact->count;
    for (int64_t index = 0; index < contact->groups; ++index) {
        /* asperities that do not touch may have no friction */
        double friction = hs_max(memory->friction[index], MIN_SCALED_FRICTION),
               divisor = sqrt(friction);
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i) {
            gap[contact->order[i]] = span - friction * (d - contact->gap[i]);
            weight[contact->order[i]] = contact->weight[i] / divisor;
        }
    }
    hs_contact *shaped =
        hs_contact_of(contact->count, 1, gap, weight, NULL, 0, &contact->units, contact->datum);
    hs_line *scaled = shaped ? hs_line_blank(shaped, depth + 4, 0) : NULL;
    hs_contact_free(shaped);
    if (scaled) {
        scaled->friction[0] = 1.0;
        scaled->steep[0] = 0;
        scaled->depth[0] = depth;
        scaled->approach = span;
        scaled->normal_load = hs_load_at(hs_all_of(shaped), span).load;
        scaled->displacement = memory->displacement;
        scaled->tangential_load = memory->tangential_load;
        scaled->dissipated = memory->dissipated;
        scaled->excess = memory->excess;
        scaled->clock = memory->clock;
        reorder_energies(memory, scaled, gap);
        pass_slides(memory, scaled);
        if (memory->depth[0])
            memset(memory->depth, 0, (size_t)contact->groups * sizeof *memory->depth);
    }
    memory->scaled = scaled;
    free(gap);
    return scaled ? HS_OK : HS_OUT_OF_MEMORY;
}

/* Largest limit ξ, and the group that has it, if the polylines of all groups in contact agree; else
 * 0. */
static double common_limit(const hs_line *memory, int64_t *leader) {
    const hs_contact *contact = memory->contact;
    const double d = memory->approach;
    double limit[2], span;
    for (int64_t index = 0; index < 2; ++index)
        limit[index] = memory->friction[index] * (d - contact->gap[contact->first[index]]);
    /* most histories differ in the first two groups */
    if (limit[1] > 0.0 &&
        !agrees(memory, limit[0] > limit[1], limit[0] <= limit[1], hs_max(limit[0], limit[1])))
        return 0.0;
    span = largest_limit(memory, leader);
    for (int64_t index = 0;
         span > 0.0 && index < contact->groups && contact->gap[contact->first[index]] < d; ++index)
        if (!agrees(memory, index, *leader, span)) span = 0.0;
    return span;
}

/* Add the scaled line of polylines that agree with that of a group; returns a status. */
static int scale_contact(hs_line *memory, int64_t leader, double span) {
    const double d = memory->approach, friction = memory->friction[leader];
    const hs_vertex *stack = memory->vertices + leader * memory->capacity;
    int64_t depth = memory->depth[leader];
    if (hs_line_add_scaled(memory, depth) != HS_OK) return HS_OUT_OF_MEMORY;
    hs_vertex *vertex = memory->scaled->vertices;
    for (int64_t j = 0; j < depth; ++j) {
        vertex[j] = stack[j];
        vertex[j].label = j == depth - 1 ? span : span - friction * (d - stack[j].label);
        vertex[j].slope = hs_clamp(stack[j].slope / friction, 1.0);
    }
    vertex[0].label = 0.0;
    hs_refresh_loads(memory->scaled);
    return HS_OK;
}

int hs_line_restore_groups(hs_line *memory) {
    const hs_contact *contact = memory->contact;
    hs_line *scaled = memory->scaled;
    if (!scaled) return HS_OK;
    const int64_t top = scaled->depth[0] - 1;
    const double d = memory->approach, span = scaled->approach;
    double *scratch = (double *)malloc((size_t)contact->count * sizeof *scratch);
    if (!scratch || hs_line_reserve(memory, top + 3) != HS_OK) {
        free(scratch);
        return HS_OUT_OF_MEMORY;
    }
    for (int64_t index = 0; index < contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        const double friction = group.friction, h = group.curve.gap[0];
        const hs_vertex *from = scaled->vertices + top;
        if (h >= d) break;
        /* outermost segment that contains the innermost spring of the group */
        while (from > scaled->vertices + 1 && d - (span - from[-1].label) / friction > h) --from;
        double anchor = from->anchor - from->slope * (from->label - (span - friction * (d - h)));
        hs_vertex *last = group.stack;
        *last = HS_MADE(hs_vertex){h, anchor, 0.0, from[-1].made_at, 0.0, 0.0};
        for (; from <= scaled->vertices + top; ++from) {
            hs_vertex vertex = *from;
            vertex.label = from == scaled->vertices + top ? d : d - (span - from->label) / friction;
            if (vertex.label <= last->label) continue;
            vertex.slope *= friction;
            vertex.normal = hs_load_at(group.curve, vertex.label).load;
            vertex.tangential = last->tangential + vertex.slope * (vertex.normal - last->normal);
            *++last = vertex;
        }
        memory->depth[index] = last - group.stack + 1;
    }
    reorder_energies(scaled, memory, scratch);
    free(scratch);
    pass_slides(scaled, memory);
    memory->scaled = NULL;
    hs_line_free(scaled);
    return HS_OK;
}

/* True if the approach is constant on a path. */
static int is_held(const hs_line *memory, const hs_path *path) {
    double present = path->normal_control == HS_LOAD ? memory->normal_load : memory->approach;
    return hs_toward(present, path->normal_target, path->normal_fraction) == present;
}

/* True if a contact is scaled and no spring is strained. */
static int is_unstrained(const hs_line *memory) {
    const hs_line *scaled = memory->scaled;
    return scaled && scaled->depth[0] == 2 && scaled->vertices[0].anchor == memory->displacement &&
           scaled->vertices[1].anchor == memory->displacement;
}

/* True if no spring is strained on a path at any approach. */
static int stays_unstrained(const hs_line *memory, const hs_path *path) {
    const int by_load = path->tangential_control[0] == HS_LOAD;
    double present = by_load ? 0.0 : memory->displacement;
    /* ramps of both loads that fall are integrated by groups */
    int falls = by_load && path->normal_control == HS_LOAD &&
                hs_toward(memory->normal_load, path->normal_target, path->normal_fraction) <
                    memory->normal_load;
    return is_unstrained(memory) && !falls && memory->excess == 0.0 &&
           hs_toward(present, path->tangential_target[0], path->tangential_fraction[0]) == present;
}

int hs_press_unstrained(hs_line *memory, double d, double load, hs_target target, int *is_done) {
    const double touch = memory->contact->sorted_gap[0], v = memory->displacement,
                 before = memory->approach;
    *is_done = 0;
    if (memory->contact->groups == 1 || memory->evolved || memory->is_direct) return HS_OK;
    int unstrained = before <= touch || is_unstrained(memory),
        status = hs_line_restore_groups(memory);
    if (status != HS_OK || !unstrained || d <= touch || target.value != target.rigid * v)
        return status;
    memory->approach = d;
    status = hs_line_add_scaled(memory, 2);
    if (status != HS_OK) {
        memory->approach = before;
        return status == HS_NOT_A_STATE ? (int)HS_OK : status;
    }
    *is_done = 1;
    memory->normal_load = load;
    memory->tangential_load = memory->scaled->tangential_load = 0.0;
    hs_vertex *stack = memory->scaled->vertices;
    stack[0] = HS_MADE(hs_vertex){0.0, v, 0.0, v, 0.0, 0.0};
    stack[1] =
        HS_MADE(hs_vertex){memory->scaled->approach, v, 0.0, v, memory->scaled->normal_load, 0.0};
    return status;
}

int hs_is_represented(const hs_line *memory, const hs_path *path) {
    int64_t leader;
    if (memory->contact->groups == 1 || memory->evolved) return 1;
    int held = is_held(memory, path);
    return memory->scaled ? held || stays_unstrained(memory, path)
                          : !(held && common_limit(memory, &leader) > 0.0);
}

int hs_represent(hs_line *memory, hs_path *path, hs_line **line) {
    int64_t leader = 0;
    int status = HS_OK;
    *line = memory;
    if (memory->contact->groups == 1 || memory->evolved) return status;
    if (!is_held(memory, path))
        return stays_unstrained(memory, path) ? status : hs_line_restore_groups(memory);
    double span = memory->scaled ? 0.0 : common_limit(memory, &leader);
    if (span > 0.0) status = scale_contact(memory, leader, span);
    if (!memory->scaled) return status;
    /* the normal target is of the contact without scales */
    path->normal_fraction = 0.0;
    *line = memory->scaled;
    return status;
}

void hs_update_from(hs_line *memory, const hs_line *scaled) {
    if (scaled == memory) return;
    memory->displacement = scaled->displacement;
    memory->tangential_load = scaled->tangential_load;
    memory->dissipated = scaled->dissipated;
    memory->excess = scaled->excess;
    memory->clock = scaled->clock;
    memory->lost_slides = scaled->lost_slides;
}
