/* Cells: lifetime of a contact in two directions, and the nodes of its classes: cells are split
 * where slip begins, and merged where nodes hardly matter. */

#include "rings.h"

/* Largest width of cells over their mean width, before they are split and after they are merged;
 * chosen. */
#define MAX_CELL_WIDTH 1.01

#define MAX_MERGED_WIDTH 1.1

/* Refinement of cells at the slip front; all chosen. Rings from the edge that are inspected; cells
 * are not refined if all of these slip: */
#define MAX_INSPECTED_RINGS 20

/* smallest width of a new cell over the displacement increment divided by μ; cells are not refined
 * if that width is smaller than the second factor times the depth of the class: */
#define MIN_CELL_OF_SLIP 0.125

#define MIN_CELL_OF_DEPTH 1e-9

/* width of a new cell over its depth below the edge: */
#define CELL_GROWTH 0.15

/* nodes added to a class before a step: */
#define MAX_NEW_NODES 32

hs_body *hs_body_new(const hs_line *line, int64_t rings_per_class, double tolerance) {
    size_t count = (size_t)line->contact->count;
    hs_body *body = (hs_body *)calloc(1, sizeof *body);
    double *numbers = (double *)malloc(3 * count * sizeof *numbers);
    if (!body || !numbers) {
        free(body);
        free(numbers);
        return NULL;
    }
    body->contact = line->contact;
    body->friction = line->friction;
    body->rings_per_class = rings_per_class;
    body->tolerance = tolerance;
    body->approach = line->approach;
    body->normal_load = line->normal_load;
    body->dissipated = line->dissipated;
    body->asperity_loss = numbers;
    body->slide_time = numbers + count;
    body->scratch = numbers + 2 * count;
    for (size_t i = 0; i < count; ++i) body->slide_time[i] = NAN;
    memcpy(body->asperity_loss, line->dissipated_each, count * sizeof *numbers);
    return body;
}

void hs_body_free(hs_body *body) {
    if (!body) return;
    for (int64_t c = 0; c < body->class_count; ++c) {
        free(body->classes[c].nodes);
        free(body->classes[c].loss_nodes);
        free(body->classes[c].problem);
    }
    free(body->classes);
    free(body->asperity_loss);
    free(body);
}

int hs_reserve_nodes(hs_ring_class *ring_class, int64_t node_count) {
    if (node_count <= ring_class->capacity) return HS_OK;
    /* 8 spare nodes, so that growing classes are seldom reserved again; chosen */
    hs_node *nodes =
        (hs_node *)realloc(ring_class->nodes, (size_t)(node_count + 8) * sizeof *nodes);
    if (nodes) ring_class->nodes = nodes;
    hs_loss_node *loss_nodes = (hs_loss_node *)realloc(
        ring_class->loss_nodes, (size_t)(node_count + 8) * sizeof *loss_nodes);
    if (loss_nodes) ring_class->loss_nodes = loss_nodes;
    if (!nodes || !loss_nodes) return HS_OUT_OF_MEMORY;
    ring_class->capacity = (int32_t)node_count + 8;
    return HS_OK;
}

int hs_assign_body(hs_body *target, const hs_body *source) {
    target->approach = source->approach;
    target->normal_load = source->normal_load;
    target->dissipated = source->dissipated;
    target->time = source->time;
    target->fraction = source->fraction;
    target->displacement = source->displacement;
    target->tangential_load = source->tangential_load;
    target->displacement_rate = source->displacement_rate;
    for (int64_t c = 0; c < source->class_count; ++c) {
        hs_ring_class *target_class = target->classes + c;
        const hs_ring_class *source_class = source->classes + c;
        if (hs_reserve_nodes(target_class, source_class->node_count) != HS_OK)
            return HS_OUT_OF_MEMORY;
        target_class->node_count = source_class->node_count;
        if (source_class->node_count)
            memcpy(target_class->nodes, source_class->nodes,
                   (size_t)source_class->node_count * sizeof *target_class->nodes);
    }
    return HS_OK;
}

hs_body *hs_copy_for_trial(const hs_body *body) {
    hs_body *copy = (hs_body *)malloc(sizeof *copy);
    hs_ring_class *classes =
        (hs_ring_class *)malloc((size_t)(body->class_count + 1) * sizeof *classes);
    if (!copy || !classes) {
        free(copy);
        free(classes);
        return NULL;
    }
    *copy = *body;
    copy->asperity_loss = copy->slide_time = copy->scratch = NULL;
    copy->classes = classes;
    for (int64_t c = 0; c < body->class_count; ++c) {
        classes[c] = body->classes[c];
        classes[c].nodes = NULL;
        classes[c].loss_nodes = NULL;
        classes[c].capacity = classes[c].loss_node_count = 0;
        classes[c].problem = NULL;
    }
    if (hs_assign_body(copy, body) == HS_OK) return copy;
    hs_body_free(copy);
    return NULL;
}

hs_body *hs_body_copy(const hs_body *body) {
    size_t count = (size_t)body->contact->count;
    hs_body *copy = hs_copy_for_trial(body);
    if (!copy) return NULL;
    copy->asperity_loss = (double *)malloc(3 * count * sizeof *copy->asperity_loss);
    if (!copy->asperity_loss) {
        hs_body_free(copy);
        return NULL;
    }
    copy->slide_time = copy->asperity_loss + count;
    copy->scratch = copy->asperity_loss + 2 * count;
    memcpy(copy->asperity_loss, body->asperity_loss, 2 * count * sizeof *copy->asperity_loss);
    return copy;
}

hs_node hs_node_at(const hs_ring_class *ring_class, double label, hs_vector deflection) {
    hs_normal loads = hs_normal_at(ring_class->curve, label);
    return HS_MADE(hs_node){label, loads.load, loads.integral, deflection};
}

/* Node on the straight line between two nodes; fraction 0 is the inner one. */
static hs_node interpolate_node(const hs_ring_class *ring_class, hs_node inner, hs_node outer,
                                double label, double fraction) {
    return hs_node_at(ring_class, label,
                      hs_vector_lerp(inner.deflection, outer.deflection, fraction));
}

/* Split cells wider than `cell_width`, without effect on v; returns a status. */
static int split_cells(hs_ring_class *ring_class, double cell_width) {
    int64_t added = 0;
    for (int32_t k = 1; k < ring_class->node_count; ++k)
        added +=
            (int64_t)((ring_class->nodes[k - 1].label - ring_class->nodes[k].label) / cell_width);
    if (added == 0) return HS_OK;
    if (hs_reserve_nodes(ring_class, ring_class->node_count + added) != HS_OK)
        return HS_OUT_OF_MEMORY;
    hs_node *nodes = ring_class->nodes;
    int64_t write = ring_class->node_count - 1 + added;
    for (int32_t k = ring_class->node_count - 1; k >= 1; --k) {
        hs_node inner = nodes[k], outer = nodes[k - 1];
        double width = outer.label - inner.label;
        int64_t cuts = (int64_t)(width / cell_width);
        nodes[write--] = inner;
        for (int64_t i = 1; i <= cuts; ++i) {
            double fraction = (double)i / (double)(cuts + 1);
            nodes[write--] = interpolate_node(ring_class, inner, outer,
                                              inner.label + fraction * width, fraction);
        }
    }
    ring_class->node_count += (int32_t)added;
    return HS_OK;
}

/* Remove nodes whose neighbours are close, if that changes the tangential load by at most
 * `max_load_error`. */
static void merge_cells(hs_ring_class *ring_class, double cell_width, double max_load_error) {
    hs_node *nodes = ring_class->nodes;
    int32_t write = 1;
    for (int32_t k = 1; k + 1 < ring_class->node_count; ++k) {
        hs_node outer = nodes[write - 1], middle = nodes[k], inner = nodes[k + 1];
        double width = outer.label - inner.label, fraction = (outer.label - middle.label) / width;
        hs_vector interpolated = hs_vector_lerp(outer.deflection, inner.deflection, fraction);
        double stiffness_jump = (outer.normal - middle.normal) / (outer.label - middle.label) -
                                (middle.normal - inner.normal) / (middle.label - inner.label);
        double load_error =
            fabs(stiffness_jump) * hs_norm(hs_add_scaled(middle.deflection, -1.0, interpolated));
        int is_redundant = width <= MAX_MERGED_WIDTH * cell_width && load_error <= max_load_error;
        if (!is_redundant) nodes[write++] = middle;
    }
    nodes[write++] = nodes[ring_class->node_count - 1];
    ring_class->node_count = write;
}

int hs_regrid(hs_ring_class *ring_class, int64_t rings_per_class, double friction,
              double merge_error) {
    if (ring_class->node_count < 2) return HS_OK;
    double cell_width =
        (ring_class->nodes[0].label - hs_deepest_label(ring_class)) / (double)rings_per_class;
    if (split_cells(ring_class, MAX_CELL_WIDTH * cell_width) != HS_OK) return HS_OUT_OF_MEMORY;
    /* factor, and number of nodes that are enough; chosen */
    for (; merge_error <= MAX_MERGE_ERROR; merge_error *= 4.0) {
        merge_cells(ring_class, cell_width, merge_error * friction * ring_class->nodes[0].normal);
        if (ring_class->node_count <= 2 * rings_per_class + 2) break;
    }
    return HS_OK;
}

int hs_refine_front(hs_ring_class *ring_class, double friction, hs_vector increment) {
    const hs_node *nodes = ring_class->nodes;
    int32_t slipping_ring = 0, inspected = ring_class->node_count - 1 < MAX_INSPECTED_RINGS
                                               ? ring_class->node_count - 1
                                               : MAX_INSPECTED_RINGS;
    double min_width = MIN_CELL_OF_SLIP * hs_norm(increment) / friction, new_label[MAX_NEW_NODES];
    if (ring_class->node_count < 2 || friction == 0.0 || min_width == 0.0) return HS_OK;
    double edge = nodes[0].label, edge_width = edge - nodes[1].label;
    /* so small an increment is rounding */
    if (min_width < MIN_CELL_OF_DEPTH * (edge - hs_deepest_label(ring_class))) return HS_OK;
    /* labels must differ; factor chosen */
    min_width = hs_max(min_width, 8.0 * HS_TIE * fabs(edge));
    for (int32_t i = 1; i <= inspected; ++i) {
        double depth = edge - nodes[i].label,
               traction_factor = (sqrt(depth) - sqrt(hs_max(depth - edge_width, 0.0))) / edge_width;
        if (hs_norm(hs_add_scaled(hs_ring_traction(nodes, i), traction_factor, increment)) >
            friction * sqrt(depth))
            slipping_ring = i;
    }
    if (slipping_ring == MAX_INSPECTED_RINGS) return HS_OK;
    int32_t added = 0, stop = slipping_ring + 2 < ring_class->node_count
                                  ? slipping_ring + 2
                                  : ring_class->node_count - 1;
    for (int32_t k = slipping_ring; k < stop; ++k) {
        double inner_depth = edge - nodes[k + 1].label, depth = edge - nodes[k].label;
        for (;;) {
            double width = hs_max(min_width, CELL_GROWTH * depth);
            /* so that the innermost cell is no smaller than half a width; chosen */
            if (depth + 1.5 * width > inner_depth || added == MAX_NEW_NODES) break;
            new_label[added++] = edge - (depth += width);
        }
    }
    if (added == 0) return HS_OK;
    if (hs_reserve_nodes(ring_class, ring_class->node_count + added) != HS_OK)
        return HS_OUT_OF_MEMORY;
    int32_t k = ring_class->node_count - 1, write = k + added;
    ring_class->node_count += added;
    while (added > 0) {
        hs_node outer = ring_class->nodes[k];
        if (outer.label < new_label[added - 1]) {
            ring_class->nodes[write--] = outer;
            --k;
            continue;
        }
        hs_node inner = ring_class->nodes[write + 1];
        double label = new_label[--added],
               fraction = (label - inner.label) / (outer.label - inner.label);
        ring_class->nodes[write--] = interpolate_node(ring_class, inner, outer, label, fraction);
    }
    return HS_OK;
}

int hs_add_touching_nodes(hs_ring_class *ring_class, double from, double to,
                          int64_t rings_per_class) {
    double deepest = hs_deepest_label(ring_class), old_edge = hs_max(from, deepest),
           cell_width = (to - deepest) / (double)rings_per_class;
    if (to > old_edge) {
        int64_t cell_count =
                    1 + (int64_t)hs_min((to - old_edge) / cell_width, (double)rings_per_class),
                is_new = ring_class->node_count == 0;
        int64_t added = cell_count - 1 + is_new;
        if (hs_reserve_nodes(ring_class, ring_class->node_count + added + 1) != HS_OK)
            return HS_OUT_OF_MEMORY;
        memmove(ring_class->nodes + added, ring_class->nodes,
                (size_t)ring_class->node_count * sizeof *ring_class->nodes);
        ring_class->node_count += (int32_t)added;
        for (int64_t k = 0; k + 1 < cell_count; ++k)
            ring_class->nodes[k] = hs_node_at(
                ring_class, to - (to - old_edge) * ((double)(k + 1) / (double)cell_count),
                zero_vector);
        /* a class without contact starts at its deepest spring */
        if (is_new) ring_class->nodes[added - 1] = hs_node_at(ring_class, deepest, zero_vector);
    }
    return hs_reserve_rings(ring_class, ring_class->node_count + 1);
}

/* Traction over its friction limit from which a ring slips; chosen. */
#define SLIP_THRESHOLD (1.0 - 1e-6)

double hs_slip_front(const hs_body *body, const hs_ring_class *ring_class) {
    const hs_node *nodes = ring_class->nodes;
    double friction = hs_friction_at(body, ring_class->group, body->fraction);
    int32_t slipping_ring = 0;
    for (int32_t i = 1; i < ring_class->node_count; slipping_ring = i++)
        if (hs_norm(hs_ring_traction(nodes, i)) <
            SLIP_THRESHOLD * friction * sqrt(nodes[0].label - nodes[i].label))
            break;
    if (ring_class->node_count == 0 || slipping_ring == 0) return HUGE_VAL;
    /* halfway between the innermost ring that slips and the outermost ring that sticks */
    return slipping_ring + 1 < ring_class->node_count
               ? 0.5 * (nodes[slipping_ring].label + nodes[slipping_ring + 1].label)
               : -HUGE_VAL;
}

double hs_interval_energy(const hs_node *outer, const hs_node *inner) {
    double width = outer->label - inner->label;
    hs_vector rise = hs_add_scaled(outer->deflection, -1.0, inner->deflection);
    hs_vector slope = {rise.x / width, rise.y / width};
    return inner->normal * hs_dot(slope, inner->deflection) -
           outer->normal * hs_dot(slope, outer->deflection) +
           hs_dot(slope, slope) * (outer->integral - inner->integral);
}

double hs_class_elastic_energy(const hs_ring_class *ring_class) {
    double total = 0.0;
    for (int32_t k = 1; k < ring_class->node_count; ++k)
        total += hs_interval_energy(ring_class->nodes + k - 1, ring_class->nodes + k);
    return total;
}
