/* Batch: many contacts of one asperity each, which share nothing: the exact update (README.md,
 * theory 7) of each on a straight path in (d, V), by the fast path of single.h with P(a) = a^(3/2).
 *
 * Labels and anchors are in m, loads in units of (4/3) E* √R. The vertices of all contacts are in
 * one array, each contact's in sequence from its offset; a contact without room left moves to the
 * end of the array. A contact that does not touch has no vertex; its first vertex then holds its
 * approach and displacement. */

#include "single.h"

static double load_of(double label) { return label * sqrt(label); }

static const double *friction_of(const hs_batch *batch, int64_t i) {
    return batch->friction + (batch->frictions > 1 ? i : 0);
}
static const double *scale_of(const hs_batch *batch, int64_t i) {
    return batch->scale + (batch->scales > 1 ? i : 0);
}

/* Move the vertices of a contact to the end of the array, with room for at least `min_room`
 * vertices. */
static int relocate(hs_batch *batch, int64_t i, int64_t min_room) {
    const int64_t room = 2 * batch->room[i] > min_room ? 2 * batch->room[i] : min_room,
                  needed = batch->used + room;
    if (needed > batch->capacity) {
        const int64_t capacity = needed + batch->capacity / 2;
        hs_batch_vertex *grown =
            (hs_batch_vertex *)realloc(batch->vertices, (size_t)capacity * sizeof *grown);
        if (!grown) return HS_OUT_OF_MEMORY;
        batch->vertices = grown;
        batch->capacity = capacity;
    }
    memcpy(batch->vertices + batch->used, batch->vertices + batch->offset[i],
           (size_t)batch->room[i] * sizeof *batch->vertices);
    batch->offset[i] = batch->used;
    batch->room[i] = room;
    batch->used = needed;
    return HS_OK;
}

/* Move one contact that touches; returns its depth and the tangential load. */
static int64_t move_contact(hs_batch_vertex *stack, int64_t depth, double friction, double d,
                            double v, double load, double *tangential) {
    const hs_labels labels = {&stack->label, (int64_t)(sizeof *stack / sizeof(double)), 1.0, 0.0};
    int64_t top = depth - 1;
    const int cut = d < stack[top].label;
    if (cut) top = hs_cut_segment(labels, depth, d);
    double edge = stack[top].label, anchor = stack[top].anchor, force = stack[top].force,
           slope = stack[top].slope;
    if (cut) {
        anchor -= slope * (edge - d);
        force -= slope * (load_of(edge) - load);
        edge = d;
    }
    const hs_single_path path = hs_single_path_to(d, v, friction, edge, anchor, 0);
    double front_load;
    if (path.sticks) {
        *tangential = force;
        if (cut) stack[top] = HS_MADE(hs_batch_vertex){d, anchor, slope, force};
        if (d == edge) return top + 1;
        slope = (v - anchor) / (d - edge);
        front_load = load_of(edge);
        top += top == 0 || stack[top].slope != slope;
    } else {
        const hs_single front = hs_solve_single(labels, top, &path);
        slope = path.sign * friction;
        top = front.inner_count;
        force = front_load = 0.0;
        if (top == 0) {
            stack[top++] = HS_MADE(hs_batch_vertex){0.0, v - slope * d, 0.0, 0.0};
        } else {
            front_load = load_of(front.label);
            force = stack[top - 1].force;
            if (front.label != stack[top - 1].label) {
                const double inner = stack[top].slope;
                force += inner * (front_load - load_of(stack[top - 1].label));
                stack[top++] = HS_MADE(hs_batch_vertex){front.label, v - slope * (d - front.label),
                                                        inner, force};
            }
        }
    }
    *tangential = force + slope * (load - front_load);
    stack[top] = HS_MADE(hs_batch_vertex){d, v, slope, *tangential};
    return top + 1;
}

int hs_batch_accepts(const hs_batch *batch, const double *approach, const double *displacement,
                     double largest) {
    int good = 1;
    /* comparisons with NaN are false */
    for (int64_t i = 0; i < batch->count; ++i)
        good &= (fabs(approach[i]) <= largest) & (fabs(displacement[i]) <= largest);
    return good;
}

int hs_batch_step(hs_batch *batch, const double *approach, const double *displacement,
                  double *normal_load, double *tangential_load) {
    for (int64_t i = 0; i < batch->count; ++i) {
        double d1 = approach[i], v1 = displacement[i] / batch->displacement_ratio, force;
        hs_batch_vertex *stack = batch->vertices + batch->offset[i];
        int64_t depth = batch->depth[i];
        if (d1 <= 0.0) {
            stack[0].label = d1;
            stack[0].anchor = v1;
            batch->depth[i] = 0;
            normal_load[i] = tangential_load[i] = 0.0;
            continue;
        }
        if (depth + 2 > batch->room[i]) {
            if (relocate(batch, i, depth + 2) != HS_OK) return HS_OUT_OF_MEMORY;
            stack = batch->vertices + batch->offset[i];
        }
        double unit = *scale_of(batch, i), load = load_of(d1);
        if (depth == 0) {
            double d0 = stack[0].label, v0 = stack[0].anchor;
            stack[0] = HS_MADE(hs_batch_vertex){0.0, v0 - (v1 - v0) * d0 / (d1 - d0), 0.0, 0.0};
            depth = 1;
        }
        batch->depth[i] = move_contact(stack, depth, *friction_of(batch, i), d1, v1, load, &force);
        normal_load[i] = unit * load;
        tangential_load[i] = unit * force;
    }
    return HS_OK;
}

/* Initial room of each contact, in vertices: loops have up to five, and a step adds two. A power of
 * two would make contacts compete for the same lines of the cache. */
#define INITIAL_ROOM 7

hs_batch *hs_batch_new(int64_t count, int64_t frictions, const double *friction, int64_t scales,
                       const double *scale, double displacement_ratio) {
    hs_batch *batch = (hs_batch *)calloc(1, sizeof *batch);
    int64_t *numbers = (int64_t *)calloc((size_t)(3 * count + frictions + scales), sizeof *numbers);
    hs_batch_vertex *vertices =
        (hs_batch_vertex *)calloc((size_t)(INITIAL_ROOM * (count + 1)), sizeof *vertices);
    if (!batch || !numbers || !vertices) {
        free(batch);
        free(numbers);
        free(vertices);
        return NULL;
    }
    double *coefficient = (double *)(numbers + 3 * count);
    *batch = HS_MADE(hs_batch){count,
                               frictions,
                               scales,
                               displacement_ratio,
                               numbers,
                               numbers + count,
                               numbers + 2 * count,
                               coefficient,
                               coefficient + frictions,
                               vertices,
                               INITIAL_ROOM * count,
                               INITIAL_ROOM * (count + 1)};
    for (int64_t i = 0; i < frictions; ++i) batch->friction[i] = hs_bound_friction(friction[i]);
    for (int64_t i = 0; i < scales; ++i) batch->scale[i] = scale[i];
    for (int64_t i = 0; i < count; ++i) {
        batch->offset[i] = INITIAL_ROOM * i;
        batch->room[i] = INITIAL_ROOM;
    }
    return batch;
}

hs_batch *hs_batch_copy(const hs_batch *batch) {
    hs_batch *copy = hs_batch_new(batch->count, batch->frictions, batch->friction, batch->scales,
                                  batch->scale, batch->displacement_ratio);
    hs_batch_vertex *vertices =
        copy
            ? (hs_batch_vertex *)realloc(copy->vertices, (size_t)batch->capacity * sizeof *vertices)
            : NULL;
    if (!vertices) {
        hs_batch_free(copy);
        return NULL;
    }
    copy->vertices = vertices;
    copy->used = batch->used;
    copy->capacity = batch->capacity;
    memcpy(copy->offset, batch->offset, 3 * (size_t)batch->count * sizeof *copy->offset);
    memcpy(vertices, batch->vertices, (size_t)batch->used * sizeof *vertices);
    return copy;
}

void hs_batch_free(hs_batch *batch) {
    if (!batch) return;
    free(batch->offset);
    free(batch->vertices);
    free(batch);
}

/* First vertex of a contact; NULL if there is no such contact. */
static hs_batch_vertex *stack_of(const hs_batch *batch, int64_t contact) {
    return contact >= 0 && contact < batch->count ? batch->vertices + batch->offset[contact] : NULL;
}
/* A contact that does not touch fills its first vertex, too. */
static size_t bytes_of(int64_t depth) {
    return (size_t)(depth > 1 ? depth : 1) * sizeof(hs_batch_vertex);
}

void hs_batch_forget(hs_batch *batch, int64_t contact) {
    hs_batch_vertex *stack = stack_of(batch, contact);
    if (!stack) return;
    memset(stack, 0, sizeof *stack);
    batch->depth[contact] = 0;
}

int64_t hs_batch_take(const hs_batch *batch, int64_t contact, hs_batch_vertex *vertices) {
    const hs_batch_vertex *stack = stack_of(batch, contact);
    if (!stack) return -1;
    memcpy(vertices, stack, bytes_of(batch->depth[contact]));
    return batch->depth[contact];
}

/* True if vertices are valid for a friction coefficient: ascending labels, slopes within ±μ. */
static int is_possible(const hs_batch_vertex *vertices, int64_t depth, double friction) {
    int good =
        depth >= 0 && depth != 1 && isfinite(vertices[0].label) && isfinite(vertices[0].anchor);
    for (int64_t j = 1; good && j < depth; ++j) {
        const hs_batch_vertex *vertex = vertices + j;
        good = isfinite(vertex->label) && isfinite(vertex->anchor) && isfinite(vertex->force) &&
               vertex->label >= vertex[-1].label && fabs(vertex->slope) <= friction;
    }
    return good && (depth > 0 ? vertices[0].label == 0.0 && vertices[0].force == 0.0
                              : vertices[0].label <= 0.0);
}

int hs_batch_put(hs_batch *batch, int64_t contact, const hs_batch_vertex *vertices, int64_t depth) {
    if (!stack_of(batch, contact)) return HS_FOREIGN;
    if (!is_possible(vertices, depth, *friction_of(batch, contact))) return HS_NOT_A_STATE;
    if (depth > batch->room[contact] && relocate(batch, contact, depth + 2) != HS_OK)
        return HS_OUT_OF_MEMORY;
    memcpy(stack_of(batch, contact), vertices, bytes_of(depth));
    batch->depth[contact] = depth;
    return HS_OK;
}

/* Slope of the chord between the neighbours of a vertex; and change of the tangential load if the
 * vertex is removed. */
static double slope_across(const hs_batch_vertex *vertex) {
    return (vertex[1].anchor - vertex[-1].anchor) / (vertex[1].label - vertex[-1].label);
}
static double change_without(const hs_batch_vertex *vertex) {
    double low = load_of(vertex[-1].label), middle = load_of(vertex->label),
           high = load_of(vertex[1].label);
    return slope_across(vertex) * (high - low) - vertex->slope * (middle - low) -
           vertex[1].slope * (high - middle);
}

/* Removes vertices in the order of the load changes. Anchors then change with one sign between the
 * neighbours. Springs with equal motion do not move apart, and T = ∫ v P'' da, so that no later
 * load differs by more than the present one. */
double hs_batch_shorten(hs_batch *batch, int64_t contact, int64_t max_vertices) {
    hs_batch_vertex *stack = stack_of(batch, contact);
    double lost = 0.0;
    if (!stack) return NAN;
    int64_t depth = batch->depth[contact];
    for (; depth > (max_vertices > 3 ? max_vertices : 3); --depth) {
        int64_t best = 1;
        for (int64_t j = 2; j < depth - 1; ++j)
            if (fabs(change_without(stack + j)) < fabs(change_without(stack + best))) best = j;
        const double change = change_without(stack + best), slope = slope_across(stack + best);
        memmove(stack + best, stack + best + 1, (size_t)(depth - 1 - best) * sizeof *stack);
        for (int64_t j = best; j < depth - 1; ++j) stack[j].force += change;
        /* chords of a polyline are no steeper than the polyline, but for rounding */
        stack[best].slope = hs_clamp(slope, *friction_of(batch, contact));
        lost += fabs(change);
    }
    batch->depth[contact] = depth;
    return lost * *scale_of(batch, contact);
}
