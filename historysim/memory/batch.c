/* Many contacts of one asperity each, which share nothing: a straight path in (d, V) of every one, exactly.
 *
 * It is the update of polyline.c where P(a) = a^(3/2) is a closed form, so that one contact takes no longer than to read and
 * to write what it remembers. Labels and anchors are in m, loads in units of (4/3) E* √R. The vertices of all contacts stand
 * in one array, each contact's one after another from its place on; a contact that has no room left moves to the end. A
 * contact that does not touch has no vertex; where it is stands in the place of its first. */

#include "single.h"

static double load_of(double label) { return label * sqrt(label); }

/* Give a contact at least twice its room at the end of the array. */
static int relocate(hs_batch *batch, int64_t i, int64_t least) {
    int64_t twice = 2 * batch->room[i] > least ? 2 * batch->room[i] : least, filled = batch->depth[i] > 1 ? batch->depth[i] : 1;
    if (batch->used + twice > batch->capacity) {
        int64_t capacity = batch->capacity + (batch->capacity / 2 > twice ? batch->capacity / 2 : twice);
        hs_batch_vertex *grown =
            (hs_batch_vertex *)realloc(batch->vertices, (size_t)capacity * sizeof *batch->vertices);
        if (!grown) return HS_OUT_OF_MEMORY;
        batch->vertices = grown;
        batch->capacity = capacity;
    }
    memcpy(batch->vertices + batch->used, batch->vertices + batch->place[i], (size_t)filled * sizeof *batch->vertices);
    batch->place[i] = batch->used;
    batch->room[i] = twice;
    batch->used += twice;
    return HS_OK;
}

/* Carry one contact that touches; returns its depth and the tangential load. */
static int64_t carry_one(hs_batch_vertex *stack, int64_t depth, double mu, double d1, double v1, double load,
                         double *tangential) {
    /* where the polyline ends at d1 before any slip */
    int64_t top = depth - 1;
    double edge = stack[top].label, anchor = stack[top].anchor, force = stack[top].force, edge_load = 0.0;
    if (d1 < edge) {
        while (top > 1 && stack[top - 1].label >= d1) --top;
        double slope = stack[top].slope;
        anchor = stack[top].anchor - slope * (stack[top].label - d1);
        force = stack[top].force - slope * (load_of(stack[top].label) - load);
        edge = d1;
    }
    double change = fabs(v1 - anchor), hold = mu * (d1 - edge);
    double tie = HS_TIE * (fabs(v1) + fabs(anchor) + mu * d1);
    /* all as in polyline.c */
    if (v1 == anchor || (d1 == edge ? change <= tie : change < hold - tie)) {
        *tangential = force;
        if (d1 < stack[depth - 1].label) {
            stack[top] = HS_MADE(hs_batch_vertex){d1, anchor, stack[top].slope, force};
            return top + 1;
        }
        if (d1 == edge) return depth;
        double slope = (v1 - anchor) / (d1 - edge);
        edge_load = load_of(edge);
        *tangential = force + slope * (load - edge_load);
        if (top == 0 || stack[top].slope != slope) ++top;
        stack[top] = HS_MADE(hs_batch_vertex){d1, v1, slope, *tangential};
        return top + 1;
    }
    double sign = v1 >= anchor ? 1.0 : -1.0, slope = sign * mu;
    double slip = sign * (v1 - anchor) - mu * (d1 - edge), front = edge;
    int inside = 0, met = d1 > edge && slip <= tie;
    while (top > 0 && !met && !inside) {
        double inner = stack[top].slope, low = stack[top - 1].label;
        double slip_low = sign * (v1 - stack[top - 1].anchor) - mu * (d1 - low);
        if (slip_low < -tie && inner != slope) {
            front = hs_most(front - slip / (mu - sign * inner), low);
            inside = 1;
        } else {
            --top;
            front = low;
            slip = slip_low;
            met = slip <= tie;
        }
    }
    if (inside) {
        double low = stack[top - 1].label, inner = stack[top].slope;
        force = stack[top - 1].force;
        edge_load = load_of(front);
        if (front != low) {
            force += inner * (edge_load - load_of(low));
            stack[top] = HS_MADE(hs_batch_vertex){front, v1 - slope * (d1 - front), inner, force};
            ++top;
        }
    } else if (met) {
        while (top > 0 && stack[top].slope == slope) --top;
        force = stack[top].force;
        edge_load = load_of(stack[top].label);
        ++top;
    } else {
        /* all of it slides */
        stack[0] = HS_MADE(hs_batch_vertex){0.0, v1 - slope * d1, 0.0, 0.0};
        force = 0.0;
        edge_load = 0.0;
        top = 1;
    }
    *tangential = force + slope * (load - edge_load);
    stack[top] = HS_MADE(hs_batch_vertex){d1, v1, slope, *tangential};
    return top + 1;
}

int hs_batch_takes(const hs_batch *batch, const double *approach, const double *displacement, double largest) {
    int good = 1;
    /* comparisons with what is no number are false */
    for (int64_t i = 0; i < batch->count; ++i) good &= (fabs(approach[i]) <= largest) & (fabs(displacement[i]) <= largest);
    return good;
}

int hs_batch_step(hs_batch *batch, const double *approach, const double *displacement, double *normal_load,
                  double *tangential_load) {
    for (int64_t i = 0; i < batch->count; ++i) {
        double d1 = approach[i], v1 = displacement[i] / batch->displacement_ratio, force;
        hs_batch_vertex *stack = batch->vertices + batch->place[i];
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
            stack = batch->vertices + batch->place[i];
        }
        double mu = batch->friction[batch->frictions > 1 ? i : 0], unit = batch->scale[batch->scales > 1 ? i : 0];
        double load = load_of(d1);
        if (depth == 0) {
            double d0 = stack[0].label, v0 = stack[0].anchor;
            stack[0] = HS_MADE(hs_batch_vertex){0.0, v0 - (v1 - v0) * d0 / (d1 - d0), 0.0, 0.0};
            depth = 1;
        }
        batch->depth[i] = carry_one(stack, depth, mu, d1, v1, load, &force);
        normal_load[i] = unit * load;
        tangential_load[i] = unit * force;
    }
    return HS_OK;
}

/* Vertices that each contact has room for at the beginning: loops have up to five, and a step adds two. Contacts that need
 * more move, so that what neighbours remember is no longer side by side; a power of two would have all of them meet in a few
 * places of the cache. */
#define FIRST_ROOM 7

static hs_batch *blank(int64_t count, int64_t frictions, int64_t scales, int64_t capacity) {
    size_t n = (size_t)count;
    hs_batch *batch = (hs_batch *)malloc(sizeof *batch);
    int64_t *numbers = (int64_t *)malloc(8 * (3 * n + (size_t)frictions + (size_t)scales));
    hs_batch_vertex *vertices = (hs_batch_vertex *)calloc((size_t)capacity, sizeof *vertices);
    if (!batch || !numbers || !vertices) {
        free(batch);
        free(numbers);
        free(vertices);
        return NULL;
    }
    batch->count = count;
    batch->frictions = frictions;
    batch->scales = scales;
    batch->place = numbers;
    batch->depth = numbers + n;
    batch->room = numbers + 2 * n;
    batch->friction = (double *)(numbers + 3 * n);
    batch->scale = batch->friction + frictions;
    batch->vertices = vertices;
    batch->capacity = capacity;
    return batch;
}

hs_batch *hs_batch_new(int64_t count, int64_t frictions, const double *friction, int64_t scales, const double *scale,
                       double displacement_ratio) {
    hs_batch *batch = blank(count, frictions, scales, FIRST_ROOM * (count + 1));
    if (!batch) return NULL;
    batch->displacement_ratio = displacement_ratio;
    batch->used = FIRST_ROOM * count;
    for (int64_t i = 0; i < frictions; ++i) batch->friction[i] = hs_usable_friction(friction[i]);
    memcpy(batch->scale, scale, (size_t)scales * sizeof *scale);
    for (int64_t i = 0; i < count; ++i) {
        batch->place[i] = FIRST_ROOM * i;
        batch->depth[i] = 0;
        batch->room[i] = FIRST_ROOM;
    }
    return batch;
}

hs_batch *hs_batch_copy(const hs_batch *batch) {
    hs_batch *copy = blank(batch->count, batch->frictions, batch->scales, batch->capacity);
    if (!copy) return NULL;
    size_t numbers = 3 * (size_t)batch->count + (size_t)batch->frictions + (size_t)batch->scales;
    copy->displacement_ratio = batch->displacement_ratio;
    copy->used = batch->used;
    memcpy(copy->place, batch->place, 8 * numbers);
    memcpy(copy->vertices, batch->vertices, (size_t)batch->used * sizeof *copy->vertices);
    return copy;
}

void hs_batch_free(hs_batch *batch) {
    if (!batch) return;
    free(batch->place);
    free(batch->vertices);
    free(batch);
}

static int is_there(const hs_batch *batch, int64_t contact) { return contact >= 0 && contact < batch->count; }

void hs_batch_forget(hs_batch *batch, int64_t contact) {
    if (!is_there(batch, contact)) return;
    memset(batch->vertices + batch->place[contact], 0, sizeof *batch->vertices);
    batch->depth[contact] = 0;
}

int64_t hs_batch_take(const hs_batch *batch, int64_t contact, hs_batch_vertex *vertices) {
    if (!is_there(batch, contact)) return -1;
    int64_t depth = batch->depth[contact], filled = depth > 1 ? depth : 1;
    memcpy(vertices, batch->vertices + batch->place[contact], (size_t)filled * sizeof *vertices);
    return depth;
}

/* Whether a contact of a coefficient could remember vertices. */
static int could_be(const hs_batch_vertex *vertices, int64_t depth, double mu) {
    if (depth < 0 || depth == 1 || !isfinite(vertices[0].label) || !isfinite(vertices[0].anchor)) return 0;
    for (int64_t j = 1; j < depth; ++j) {
        const hs_batch_vertex *here = vertices + j;
        if (!(isfinite(here->label) && isfinite(here->anchor) && isfinite(here->force))) return 0;
        if (!(here->label >= here[-1].label && fabs(here->slope) <= mu)) return 0;
    }
    return depth > 0 ? vertices[0].label == 0.0 && vertices[0].force == 0.0 : vertices[0].label <= 0.0;
}

int hs_batch_put(hs_batch *batch, int64_t contact, const hs_batch_vertex *vertices, int64_t depth) {
    int64_t filled = depth > 1 ? depth : 1;
    if (!is_there(batch, contact)) return HS_FOREIGN;
    if (!could_be(vertices, depth, batch->friction[batch->frictions > 1 ? contact : 0])) return HS_NOT_A_STATE;
    if (filled > batch->room[contact] && relocate(batch, contact, filled + 2) != HS_OK) return HS_OUT_OF_MEMORY;
    memcpy(batch->vertices + batch->place[contact], vertices, (size_t)filled * sizeof *vertices);
    batch->depth[contact] = depth;
    return HS_OK;
}

/* By how much the load changes where a vertex is left out, and its neighbours are joined by a straight line. */
static double change_without(const hs_batch_vertex *vertex) {
    double low = load_of(vertex[-1].label), here = load_of(vertex->label), high = load_of(vertex[1].label);
    double slope = (vertex[1].anchor - vertex[-1].anchor) / (vertex[1].label - vertex[-1].label);
    return slope * (high - low) - vertex->slope * (here - low) - vertex[1].slope * (high - here);
}

/* Anchors then differ on one side of zero between the neighbours. Springs that are moved alike come no further apart, and
 * T = ∫ v P'' da, so that no later load differs by more than the present one. */
double hs_batch_shorten(hs_batch *batch, int64_t contact, int64_t most) {
    if (!is_there(batch, contact)) return NAN;
    hs_batch_vertex *stack = batch->vertices + batch->place[contact];
    double mu = batch->friction[batch->frictions > 1 ? contact : 0], lost = 0.0;
    int64_t depth = batch->depth[contact];
    for (; depth > (most > 3 ? most : 3); --depth) {
        int64_t best = 1;
        double least = HUGE_VAL;
        for (int64_t j = 1; j < depth - 1; ++j) {
            double change = fabs(change_without(stack + j));
            if (change < least) {
                least = change;
                best = j;
            }
        }
        double change = change_without(stack + best);
        double slope = (stack[best + 1].anchor - stack[best - 1].anchor) / (stack[best + 1].label - stack[best - 1].label);
        for (int64_t j = best; j < depth - 1; ++j) {
            stack[j] = stack[j + 1];
            stack[j].force += change;
        }
        /* chords of a polyline are no steeper than it is, but for rounding */
        stack[best].slope = hs_within(slope, mu);
        lost += fabs(change);
    }
    batch->depth[contact] = depth;
    return lost * batch->scale[batch->scales > 1 ? contact : 0];
}
