/* Classes: integration of a contact in two tangential directions. Asperities are grouped by gap
 * into classes, which share rings.
 *
 * Each step is one of SDIRK2, of second order: two stages, each a problem of rings.c per class,
 * coupled by the displacement, which Newton's method finds together with the tractions. Both stages
 * give the error of a step, from which its length is predicted. The energy of a step is ∫T·dV minus
 * the change of the elastic energy ½ ∫|v|² P'' da; it is distributed among the asperities
 * (README.md, two directions 2 to 4). */

#include "rings.h"
#include "adaptive.h"
#include "lanes.h"
#include "losses.h"

/* Fraction of a step at the first stage of SDIRK2, γ = 1 - 1/√2; weight of the slip of that stage
 * in the step, (1 - γ)/γ. */
#define SDIRK2_GAMMA 0.29289321881345254
#define STAGE_SLIP_FACTOR 2.414213562373095
/* Distance from the edge over the mean width of cells below which a stage skips a node; chosen. */
#define MIN_EDGE_CELL 0.02
/* Number of nodes of a class over its rings above which no exact step is appended; chosen. */
#define MAX_NODES_PER_RING 4
/* The same over the change of load of the step, so that small loops are preserved; and the smallest
 * one, over the friction limit. All chosen. */
#define MERGE_ERROR_OF_STEP 1e-5
#define MIN_MERGE_ERROR 1e-9
/* Error of the load of a step over `uneven_load`² / `slid_load`: between 0.07 and 0.3 beside two
 * half steps, on circles, squares, and while the approach changes. */
#define LOAD_ERROR_FACTOR 0.15
/* Tolerances of a step over the tolerance of the body; all chosen. Of the tangential load, over the
 * friction limit; of the energy, over the energy and over the limit times the displacement: */
#define LOAD_TOLERANCE_FACTOR 0.075
#define LOSS_TOLERANCE_FACTOR 1.0
#define WORK_TOLERANCE_FACTOR 1e-3
/* Largest `curvature_energy` of a step over its energy, a second estimate: the error of second
 * order is relative to its square; chosen. */
#define MAX_CURVATURE_LOSS 0.03
/* Shortest step of a segment, which bounds the time of a path; chosen. */
#define MIN_STEP (1.0 / 4096.0)
/* Iterations of Newton's method, and reductions of each of its steps by the line search; chosen. */
#define MAX_ITERATIONS 100
#define MAX_REDUCTIONS 40
/* Residual of the tangential target over the target; chosen, well above rounding. */
#define TARGET_TOLERANCE 1e-12
/* The same of the first stage, over the change of the target on the step; chosen, well below the
 * error of a step. */
#define STAGE_TOLERANCE 1e-5

/* Set up the problem of a class for a stage with its edge at `edge`, on a step from `from`. */
static void set_up_stage(hs_ring_class *ring_class, double from, double edge, double friction,
                         int64_t rings_per_class, int stage) {
    hs_ring_problem *problem = ring_class->problem;
    int is_second_stage = stage == 2;
    double min_width =
        MIN_EDGE_CELL * (edge - hs_deepest_label(ring_class)) / (double)rings_per_class;
    int32_t ring = 0, outermost = 0, is_constant = edge == from;
    while (is_constant ? ring_class->nodes[outermost].label >= edge
                       : ring_class->nodes[outermost].label > edge - min_width)
        ++outermost;
    const int32_t ring_count = ring_class->node_count - outermost;
    hs_normal loads = {ring_class->nodes[0].normal, 0.0, ring_class->nodes[0].integral, 0.0};
    if (!is_constant) loads = problem->edge[stage] = hs_normal_at(ring_class->curve, edge);
    /* matrices of an earlier step serve nodes that are equal */
    int is_reused = problem->ring_count == ring_count && problem->label[0] == edge &&
                    problem->normal[0] == loads.load;
    problem->label[0] = edge;
    problem->normal[0] = loads.load;
    problem->integral[0] = loads.integral;
    problem->trial_at_rest[0] = zero_vector;
    for (int32_t k = outermost; k < ring_class->node_count; ++k) {
        const hs_node *node = ring_class->nodes + k;
        double moved_fraction = node->label > from ? (edge - node->label) / (edge - from) : 1.0;
        ++ring;
        is_reused = is_reused && problem->label[ring] == node->label &&
                    problem->normal[ring] == node->normal &&
                    problem->moved_fraction[ring] == moved_fraction;
        problem->label[ring] = node->label;
        problem->normal[ring] = node->normal;
        problem->integral[ring] = node->integral;
        problem->moved_fraction[ring] = moved_fraction;
        problem->trial_at_rest[ring] =
            is_second_stage
                ? hs_add_scaled(node->deflection, -STAGE_SLIP_FACTOR, problem->stage_slip[k])
                : node->deflection;
    }
    if (!is_reused) hs_set_ring_nodes(problem, ring + 1);
    /* at a constant approach the second stage starts from the tractions of the first one */
    if (!is_second_stage) problem->hessian_count = problem->active_count = 0;
    hs_set_ring_tractions(problem, friction);
}

/* Solve the problems of all classes at an increment of the displacement, in at most
 * `max_iterations`; returns the tangential load. */
static hs_vector solve_classes(hs_body *body, double edge, hs_vector increment, int max_iterations,
                               double stiffness[2][2], int *is_converged) {
    hs_vector load = zero_vector;
    *is_converged = 1;
    if (stiffness) memset(stiffness, 0, 4 * sizeof(double));
    for (int64_t c = 0; c < body->class_count; ++c) {
        hs_ring_class *ring_class = body->classes + c;
        double class_stiffness[2][2];
        if (ring_class->node_count == 0 || edge <= hs_deepest_label(ring_class)) continue;
        *is_converged &=
            hs_solve_rings(ring_class->problem, increment, max_iterations, body->watch);
        load = hs_add_scaled(load, 1.0, hs_ring_load(ring_class->problem));
        if (!stiffness) continue;
        hs_ring_stiffness(ring_class->problem, class_stiffness);
        for (int i = 0; i < 4; ++i) stiffness[i / 2][i % 2] += class_stiffness[i / 2][i % 2];
    }
    return load;
}

static hs_vector tangential_residual(const hs_tangential_target *target, hs_vector displacement,
                                     hs_vector load) {
    return HS_MADE(hs_vector){
        target->value.x - target->rigid.x * displacement.x - target->compliance.x * load.x,
        target->value.y - target->rigid.y * displacement.y - target->compliance.y * load.y};
}

/* True if a target prescribes the displacement of the contact along x, along y. */
static int prescribes_x(const hs_tangential_target *target) {
    return target->rigid.x > 0.0 && target->compliance.x == 0.0;
}
static int prescribes_y(const hs_tangential_target *target) {
    return target->rigid.y > 0.0 && target->compliance.y == 0.0;
}

/* True if the caller has cancelled the path. */
static int is_cancelled(const hs_body *body) { return body->watch && body->watch->status != HS_OK; }

/* Largest deflection of a spring that friction permits. */
static double max_deflection(const hs_body *body, double edge) {
    double maximum = 0.0;
    for (int64_t c = 0; c < body->class_count; ++c)
        maximum = hs_max(maximum, hs_friction_at(body, body->classes[c].group, body->fraction) *
                                      (edge - hs_deepest_label(body->classes + c)));
    return maximum;
}

/* True if the residual of a target is negligible, or within `accepted`; component by component if
 * their units differ. */
static int is_on_target(const hs_tangential_target *target, hs_vector residual, hs_vector load,
                        hs_vector accepted) {
    if (target->rigid.x == target->rigid.y)
        return hs_norm(residual) <=
               hs_max(TARGET_TOLERANCE * hs_norm(target->value), hs_norm(accepted));
    double load_norm = hs_norm(load),
           size_x = target->rigid.x > 0.0 ? fabs(target->value.x) : load_norm,
           size_y = target->rigid.y > 0.0 ? fabs(target->value.y) : load_norm;
    return fabs(residual.x) <= hs_max(TARGET_TOLERANCE * size_x, fabs(accepted.x)) &&
           fabs(residual.y) <= hs_max(TARGET_TOLERANCE * size_y, fabs(accepted.y));
}

/* Displacement increment from the start of the step at which the tangential target is met; `load`
 * returns the tangential load.
 *
 * The residual over the compliance is the gradient of a concave function of the components that are
 * not prescribed. Newton's method with a line search finds its maximum: a step is reduced while the
 * slope at its end is negative and larger than half the slope at its start. Steps are limited to
 * the largest deflection; a limited step doubles that bound. */
static hs_vector solve_increment(hs_body *body, double edge, hs_vector increment,
                                 const hs_tangential_target *target, int stage, hs_vector *load) {
    const hs_vector start = body->displacement,
                    change = tangential_residual(target, start, body->tangential_load),
                    accepted =
                        hs_add_scaled(zero_vector, stage == 1 ? STAGE_TOLERANCE : 0.0, change);
    const int is_x_prescribed = prescribes_x(target), is_y_prescribed = prescribes_y(target);
    double stiffness[2][2], max_step = max_deflection(body, edge);
    if (is_x_prescribed) increment.x = target->value.x - start.x;
    if (is_y_prescribed) increment.y = target->value.y - start.y;
    int is_converged;
    const int is_prescribed = is_x_prescribed && is_y_prescribed;
    *load = solve_classes(body, edge, increment, MAX_ITERATIONS, is_prescribed ? NULL : stiffness,
                          &is_converged);
    if (is_prescribed) return increment;
    /* reciprocals of the compliances, times both compliances */
    const double weight_x = is_y_prescribed ? 1.0 : target->compliance.y,
                 weight_y = is_x_prescribed ? 1.0 : target->compliance.x;
    hs_vector residual = tangential_residual(target, hs_add_scaled(start, 1.0, increment), *load);
    for (int iteration = 0; iteration < MAX_ITERATIONS; ++iteration) {
        double xx = target->rigid.x + target->compliance.x * stiffness[0][0],
               xy = target->compliance.x * stiffness[0][1];
        double yx = target->compliance.y * stiffness[1][0],
               yy = target->rigid.y + target->compliance.y * stiffness[1][1];
        double determinant = xx * yy - xy * yx;
        if (is_x_prescribed) residual.x = 0.0;
        if (is_y_prescribed) residual.y = 0.0;
        if ((is_converged && is_on_target(target, residual, *load, accepted)) || is_cancelled(body))
            break;
        hs_vector step = {(yy * residual.x - xy * residual.y) / determinant,
                          (xx * residual.y - yx * residual.x) / determinant};
        hs_vector gradient = {weight_x * residual.x, weight_y * residual.y};
        /* in full slip the matrix is nearly singular: follow the residual */
        if (!(determinant > 0.0) || !(hs_dot(step, gradient) > 0.0)) step = residual;
        /* without contact no step is bounded: only the drive moves */
        double norm = hs_norm(step),
               max_fraction = max_step > 0.0 && norm > max_step ? max_step / norm : 1.0,
               fraction = max_fraction, slope_at_start = hs_dot(gradient, step);
        hs_vector trial = increment;
        for (int reduction = 0; reduction < MAX_REDUCTIONS; ++reduction) {
            trial = hs_add_scaled(increment, fraction, step);
            *load = solve_classes(body, edge, trial, 1, stiffness, &is_converged);
            residual = tangential_residual(target, hs_add_scaled(start, 1.0, trial), *load);
            double slope_at_trial = weight_x * residual.x * step.x + weight_y * residual.y * step.y;
            /* factor chosen */
            if (slope_at_trial >= -0.5 * slope_at_start || is_cancelled(body)) break;
            /* root of the slope by the secant method; smallest factor chosen */
            fraction *= hs_max(slope_at_start / (slope_at_start - slope_at_trial), 0.1);
        }
        if (fraction == max_fraction && max_fraction < 1.0) max_step *= 2.0;
        if (is_converged && trial.x == increment.x && trial.y == increment.y) break;
        increment = trial;
    }
    return increment;
}

/* Node of a polyline from the solution of a problem. */
static hs_node solution_node(const hs_ring_problem *problem, int32_t k) {
    return HS_MADE(hs_node){problem->label[k], problem->normal[k], problem->integral[k],
                            problem->deflection[k]};
}

/* Add the elastic energy of the springs of each asperity of a class. */
static void add_elastic_energy(const hs_ring_class *ring_class, double *asperity_energy) {
    for (int32_t k = 1; k < ring_class->node_count; ++k) {
        const hs_node *inner = ring_class->nodes + k, *outer = inner - 1;
        hs_vector a = inner->deflection, b = outer->deflection;
        hs_slip x = {inner->label, outer->label, a.x, b.x, 0.5 * a.x, 0.5 * b.x, NULL};
        hs_slip y = {inner->label, outer->label, a.y, b.y, 0.5 * a.y, 0.5 * b.y, NULL};
        hs_add_energy(ring_class->curve, asperity_energy, NULL, &x);
        hs_add_energy(ring_class->curve, asperity_energy, NULL, &y);
    }
}

/* Distribute the energy that a class dissipated among its asperities in proportion to the elastic
 * energy of their springs, or to their normal loads if no spring is strained. */
static void distribute_by_elastic_energy(hs_body *body, const hs_ring_class *ring_class,
                                         double loss) {
    const hs_curve *curve = &ring_class->curve;
    double *weight = body->scratch, sum = 0.0;
    memset(weight, 0, (size_t)curve->count * sizeof *weight);
    add_elastic_energy(ring_class, weight);
    for (int64_t i = 0; i < curve->count; ++i) sum += weight[i];
    if (!(sum > 0.0)) {
        const double edge = ring_class->nodes[0].label, unit = 1.0;
        hs_add_loads(curve->gap, curve->weight, hs_count_touching(curve->gap, curve->count, edge),
                     1, &edge, &unit, weight);
        for (int64_t i = 0; i < curve->count; ++i) sum += weight[i];
    }
    for (int64_t i = 0; sum > 0.0 && i < curve->count; ++i)
        body->asperity_loss[ring_class->offset + i] += loss / sum * weight[i];
}

/* Distribute the energy that a class dissipated in a step among its asperities by the density of
 * dissipation, or, after lift-off or without such density, by the elastic energy at the start of
 * the step. */
static void distribute_class_loss(hs_body *body, const hs_ring_class *start_class,
                                  const hs_ring_class *ring_class) {
    double *weight = body->scratch, sum = 0.0, slope = 0.0, loss = ring_class->loss;
    if (ring_class->curve.load || !(loss > 0.0)) return;
    if (ring_class->node_count == 0) {
        distribute_by_elastic_energy(body, start_class, loss);
        return;
    }
    int64_t touching = hs_count_touching(ring_class->curve.gap, ring_class->curve.count,
                                         ring_class->loss_nodes[0].label);
    memset(weight, 0, (size_t)touching * sizeof *weight);
    for (int32_t k = 0; k < ring_class->loss_node_count; ++k) {
        const hs_loss_node *outer = ring_class->loss_nodes + k, *inner = outer + 1;
        double inner_slope = k + 1 < ring_class->loss_node_count
                                 ? (inner->product - outer->product) / (outer->label - inner->label)
                                 : 0.0;
        int64_t outer_count =
            hs_count_touching(ring_class->curve.gap, ring_class->curve.count, outer->label);
        double factor = inner_slope - slope;
        if (factor != 0.0)
            hs_add_loads(ring_class->curve.gap, ring_class->curve.weight, outer_count, 1,
                         &outer->label, &factor, weight);
        slope = inner_slope;
    }
    for (int64_t i = 0; i < touching; ++i) sum += weight[i] = hs_max(weight[i], 0.0);
    if (!(sum > 0.0))
        distribute_by_elastic_energy(body, start_class->node_count ? start_class : ring_class,
                                     loss);
    for (int64_t i = 0; sum > 0.0 && i < touching; ++i)
        body->asperity_loss[ring_class->offset + i] += loss / sum * weight[i];
}

/* Reset the density of dissipation of a class: labels are those of the nodes and of the outer edge
 * of the step. */
static void reset_loss_nodes(hs_ring_class *ring_class, double from, double to) {
    const hs_loss_node edge = {hs_max(from, to), 0.0};
    int32_t has_new_edge = ring_class->nodes[0].label < edge.label;
    ring_class->loss_node_count = ring_class->node_count + has_new_edge;
    ring_class->loss_nodes[0] = edge;
    for (int32_t k = 1; k < ring_class->loss_node_count; ++k) {
        ring_class->loss_nodes[k] =
            HS_MADE(hs_loss_node){ring_class->nodes[k - has_new_edge].label, 0.0};
    }
}

/* Add the density of dissipation of a stage. */
static void add_stage_loss(hs_ring_class *ring_class, double weight) {
    const hs_ring_problem *problem = ring_class->problem;
    int32_t skipped = ring_class->loss_node_count - problem->ring_count - 1;
    for (int32_t k = 1; k <= problem->active_count; ++k) {
        hs_vector slip = hs_add_scaled(problem->trial[k], -1.0, problem->deflection[k]);
        ring_class->loss_nodes[skipped + k].product +=
            weight * hs_dot(problem->deflection[k], slip);
    }
}

/* Prepare nodes and problems of all classes for a step; returns a status. Cells are merged at the
 * start of a step and not at its end, where tractions are those of the solution. */
static int prepare_step(hs_body *body, const hs_plane_path *path, const hs_plane_target *target) {
    const hs_tangential_target *tangential = &target->tangential;
    hs_vector increment =
        tangential_residual(tangential, body->displacement, body->tangential_load);
    double stuck_stiffness = hs_load_at(hs_all_of(body->contact), body->approach).slope,
           limit = hs_body_limit(body, path);
    /* increment if all springs stuck */
    double factor_x = tangential->rigid.x + tangential->compliance.x * stuck_stiffness,
           factor_y = tangential->rigid.y + tangential->compliance.y * stuck_stiffness;
    increment.x = factor_x > 0.0 ? increment.x / factor_x : 0.0;
    increment.y = factor_y > 0.0 ? increment.y / factor_y : 0.0;
    double merge_error =
        limit > 0.0 ? hs_min(MERGE_ERROR_OF_STEP * stuck_stiffness * hs_norm(increment) / limit,
                             MAX_MERGE_ERROR)
                    : 0.0;
    merge_error = hs_max(merge_error, MIN_MERGE_ERROR);
    for (int64_t c = 0; c < body->class_count; ++c) {
        hs_ring_class *ring_class = body->classes + c;
        double friction = hs_friction_at(body, ring_class->group, body->fraction);
        if (hs_max(target->approach, body->approach) <= hs_deepest_label(ring_class)) continue;
        if (hs_regrid(ring_class, body->rings_per_class, friction, merge_error) != HS_OK ||
            hs_refine_front(ring_class, friction, increment) != HS_OK ||
            hs_add_touching_nodes(ring_class, body->approach, target->approach,
                                  body->rings_per_class) != HS_OK)
            return HS_OUT_OF_MEMORY;
        reset_loss_nodes(ring_class, body->approach, target->approach);
        memset(ring_class->problem->edge, 0, sizeof ring_class->problem->edge);
        memset(ring_class->problem->relieved_load, 0, sizeof ring_class->problem->relieved_load);
        if (target->approach != body->approach)
            ring_class->problem->edge[0] = hs_normal_at(ring_class->curve, body->approach);
        memset(ring_class->problem->stage_slip, 0,
               (size_t)ring_class->node_count * sizeof(hs_vector));
    }
    return HS_OK;
}

/* True if a class touches during a step. */
static int is_involved(const hs_body *body, const hs_ring_class *ring_class,
                       const hs_plane_target *target) {
    return hs_max(target->approach, body->approach) > hs_deepest_label(ring_class);
}

/* Deflection of a node if its spring sticks between two approaches: until it lifts off, or after it
 * touches. */
static hs_vector stuck_deflection(const hs_node *node, double from, double to,
                                  hs_vector increment) {
    double fraction = 1.0;
    if (to > from && node->label > from) fraction = (to - node->label) / (to - from);
    if (to < from && node->label > to) fraction = (from - node->label) / (from - to);
    return hs_add_scaled(node->deflection, fraction, increment);
}

/* Change of approach over the depth of the class up to which the stiffness P' is taken as linear;
 * chosen. */
#define MAX_LINEAR_CHANGE 1e-3

static int is_nearly_linear(const hs_ring_class *ring_class, double from, double to) {
    return fabs(to - from) <= MAX_LINEAR_CHANGE * (hs_max(from, to) - hs_deepest_label(ring_class));
}

/* Deflection of a spring between a node and its outer neighbour. */
static hs_vector deflection_at(const hs_node *inner, double label) {
    const hs_node *outer = inner - 1;
    return hs_vector_lerp(inner->deflection, outer->deflection,
                          (label - inner->label) / (outer->label - inner->label));
}

/* Energy of the springs of a class if all stuck; springs that lift off keep their energy at that
 * instant. At a constant approach it is the elastic energy plus the work of the load of the rings.
 */
static double stuck_energy(const hs_ring_class *ring_class, double from, double to,
                           hs_vector increment) {
    const hs_ring_problem *problem = ring_class->problem;
    const hs_node *nodes = ring_class->nodes;
    hs_node outer = nodes[0];
    int32_t outermost = 1, skipped = ring_class->node_count - problem->ring_count - 1;
    double total = 0.0;
    if (to == from) {
        total = hs_class_elastic_energy(ring_class);
        for (int32_t k = 1; k <= problem->ring_count; ++k)
            total +=
                problem->stiffness[k] *
                hs_dot(increment, hs_add_scaled(nodes[skipped + k].deflection, 0.5, increment));
        return total;
    }
    if (is_nearly_linear(ring_class, from, to)) {
        /* springs between both edges, with deflections from that at the inner edge to 0 */
        const hs_normal *inner_edge = problem->edge + (to > from ? 0 : 2),
                        *outer_edge = problem->edge + (to > from ? 2 : 0);
        hs_vector edge_deflection = increment;
        if (to < from) {
            while (nodes[outermost].label >= to) ++outermost;
            edge_deflection = hs_add_scaled(deflection_at(nodes + outermost, to), 1.0, increment);
        }
        total = hs_dot(edge_deflection, edge_deflection) *
                (2.0 * inner_edge->slope + outer_edge->slope) / 6.0;
        outer = HS_MADE(hs_node){hs_min(from, to), inner_edge->load, inner_edge->integral,
                                 edge_deflection};
    } else if (nodes[0].label < to) {
        outer = HS_MADE(hs_node){to, problem->edge[2].load, problem->edge[2].integral, zero_vector};
        outermost = 0;
    }
    for (int32_t k = outermost; k < ring_class->node_count; ++k) {
        hs_node inner = nodes[k];
        inner.deflection = stuck_deflection(nodes + k, from, to, increment);
        if (to < from && inner.label < to && outer.label > to) {
            /* the outermost spring in contact */
            hs_vector edge_deflection = hs_add_scaled(deflection_at(nodes + k, to), 1.0, increment);
            hs_node edge = {to, problem->edge[2].load, problem->edge[2].integral, edge_deflection};
            total += hs_interval_energy(&outer, &edge);
            outer = edge;
        }
        total += hs_interval_energy(&outer, &inner);
        outer = inner;
    }
    return total;
}

/* Elastic energy of the springs at the solution of a problem. */
static double solution_energy(const hs_ring_problem *problem) {
    hs_node outer = solution_node(problem, 0);
    double total = 0.0;
    for (int32_t k = 1; k <= problem->ring_count; ++k) {
        hs_node inner = solution_node(problem, k);
        total += hs_interval_energy(&outer, &inner);
        outer = inner;
    }
    return total;
}

/* Load of the springs of a class if all stuck, minus their load after a stage. */
static hs_vector compute_relieved_load(const hs_ring_class *ring_class, double from, double edge,
                                       hs_vector increment, int stage) {
    const hs_ring_problem *problem = ring_class->problem;
    const hs_node *nodes = ring_class->nodes;
    int32_t skipped = ring_class->node_count - problem->ring_count - 1;
    hs_vector load = zero_vector;
    for (int32_t k = 1; k <= problem->ring_count; ++k) {
        hs_vector stuck =
            hs_add_scaled(nodes[skipped + k].deflection, problem->moved_fraction[k], increment);
        load = hs_add_scaled(load, problem->stiffness[k],
                             hs_add_scaled(stuck, -1.0, problem->deflection[k]));
    }
    if (edge == from) return load;
    /* outside ring 1, by the skipped nodes; at a falling edge springs would be strained if all
     * stuck */
    int32_t k = skipped + 1;
    hs_vector inner_deflection = stuck_deflection(nodes + k, from, edge, increment),
              outer_deflection = zero_vector;
    double mean_stiffness =
        (problem->normal[0] - problem->normal[1]) / (problem->label[0] - problem->label[1]);
    load = hs_add_scaled(load, -mean_stiffness, inner_deflection);
    for (; k > 0 && nodes[k - 1].label < edge; --k, inner_deflection = outer_deflection) {
        outer_deflection = stuck_deflection(nodes + k - 1, from, edge, increment);
        mean_stiffness =
            (nodes[k - 1].normal - nodes[k].normal) / (nodes[k - 1].label - nodes[k].label);
        load = hs_add_scaled(load, mean_stiffness,
                             hs_add_scaled(inner_deflection, -1.0, outer_deflection));
    }
    outer_deflection =
        edge < from ? hs_add_scaled(deflection_at(nodes + k, edge), 1.0, increment) : zero_vector;
    mean_stiffness = (problem->normal[0] - nodes[k].normal) / (edge - nodes[k].label);
    /* over a small rise the difference of loads is mostly rounding */
    if (nodes[k].label == from && is_nearly_linear(ring_class, from, edge))
        mean_stiffness = 0.5 * (problem->edge[0].slope + problem->edge[stage].slope);
    return hs_add_scaled(hs_add_scaled(load, mean_stiffness,
                                       hs_add_scaled(inner_deflection, -1.0, outer_deflection)),
                         problem->edge[stage].slope, outer_deflection);
}

/* Energy that a class dissipates on a step: the work of the tangential load minus the change of the
 * elastic energy.
 *
 * If all springs stuck, the work would be exactly that change. The load relieved by slip is λ P'
 * with the mean slip λ, a parabola in the fraction y of the step in contact, through 0 and both
 * stages. At constant approach `relief` is that load, with P' = 1; otherwise it is λ. The energy
 * that results from the curvature of λ is added to `curvature_energy`. */
static double class_dissipation(const hs_ring_class *ring_class,
                                const hs_plane_target *stage_target, double from, double to,
                                const hs_vector increment[2], double *curvature_energy) {
    const hs_ring_problem *problem = ring_class->problem;
    double deepest = hs_deepest_label(ring_class), from_label = hs_max(from, deepest),
           to_label = hs_max(to, deepest);
    double touching_fraction = 1.0, stage_fraction = SDIRK2_GAMMA, linear_moment = 0.5,
           quadratic_moment = 1.0 / 3.0; /* ∫ y P' dy, ∫ y² P' dy */
    hs_vector relief[2] = {problem->relieved_load[0], problem->relieved_load[1]},
              relief_curvature = zero_vector, increment_curvature = zero_vector;
    if (to != from) {
        const hs_normal *edge_from = problem->edge, *edge_to = problem->edge + 2;
        double width = to_label - from_label;
        touching_fraction = width / (to - from);
        stage_fraction = (stage_target->approach - from_label) / width;
        if (!is_nearly_linear(ring_class, from_label, to_label)) {
            double mean_load = (edge_to->integral - edge_from->integral) / width;
            linear_moment = (edge_to->load - mean_load) / width;
            quadratic_moment =
                (edge_to->load -
                 2.0 * (edge_to->integral - (edge_to->twice - edge_from->twice) / width) / width) /
                width;
        } else {
            linear_moment = edge_from->slope / 2.0 + (edge_to->slope - edge_from->slope) / 3.0;
            quadratic_moment = edge_from->slope / 3.0 + (edge_to->slope - edge_from->slope) / 4.0;
        }
        relief[0] = hs_add_scaled(zero_vector, 1.0 / problem->edge[1].slope, relief[0]);
        relief[1] = hs_add_scaled(zero_vector, 1.0 / edge_to->slope, relief[1]);
        if (to_label <= deepest)
            relief[1] = stuck_deflection(ring_class->nodes + ring_class->node_count - 1, from, to,
                                         increment[1]);
    }
    /* otherwise the parabola is undetermined; bounds chosen */
    if (stage_fraction > 0.01 && stage_fraction < 0.99) {
        double curvature_factor = 1.0 / (stage_fraction * (1.0 - stage_fraction));
        relief_curvature = hs_add_scaled(zero_vector, curvature_factor,
                                         hs_add_scaled(relief[0], -stage_fraction, relief[1]));
        if (touching_fraction == 1.0)
            increment_curvature =
                hs_add_scaled(zero_vector, curvature_factor,
                              hs_add_scaled(increment[0], -stage_fraction, increment[1]));
    }
    *curvature_energy += fabs(touching_fraction * hs_dot(increment[1], relief_curvature) *
                              (linear_moment - quadratic_moment));
    double elastic_energy = to > deepest ? solution_energy(problem) : 0.0;
    double relief_work =
        touching_fraction *
            (hs_dot(increment[1], relief[1]) * linear_moment +
             hs_dot(increment[1], relief_curvature) * (linear_moment - quadratic_moment)) +
        hs_dot(increment_curvature, relief[1]) * (linear_moment - 2.0 * quadratic_moment);
    return hs_max(stuck_energy(ring_class, from, to, increment[1]) - elastic_energy - relief_work,
                  0.0);
}

/* Add the load relieved by slip of a class, and its difference from an extrapolation of the first
 * stage. */
static void add_unevenness(hs_body *body, const hs_ring_class *ring_class) {
    const hs_ring_problem *problem = ring_class->problem;
    int32_t skipped = ring_class->node_count - problem->ring_count - 1;
    for (int32_t k = 1; k <= problem->ring_count; ++k) {
        hs_vector stage_slip = problem->stage_slip[skipped + k],
                  slip = hs_add_scaled(problem->trial[k], -1.0, problem->deflection[k]);
        body->uneven_load += problem->stiffness[k] * hs_norm(hs_add_scaled(slip, -1.0, stage_slip));
        body->slid_load +=
            problem->stiffness[k] * hs_norm(hs_add_scaled(slip, STAGE_SLIP_FACTOR, stage_slip));
    }
}

/* Advance a body by one step of SDIRK2; the second stage starts with the slip of the first one.
 * Returns a status. */
static int step_sdirk2(hs_body *body, const hs_plane_path *path, const hs_plane_target *target) {
    const double from = body->approach;
    hs_plane_target stage_target =
        hs_target_at(path, hs_toward(body->fraction, target->fraction, SDIRK2_GAMMA));
    hs_vector increment[2] = {zero_vector, zero_vector}, load = zero_vector;
    if (prepare_step(body, path, target) != HS_OK) return HS_OUT_OF_MEMORY;
    for (int stage = 1; stage <= 2; ++stage) {
        const hs_plane_target *current = stage == 1 ? &stage_target : target;
        double edge = current->approach;
        for (int64_t c = 0; c < body->class_count; ++c) {
            hs_ring_class *ring_class = body->classes + c;
            if (is_involved(body, ring_class, target) && edge > hs_deepest_label(ring_class))
                set_up_stage(ring_class, from, edge,
                             hs_friction_at(body, ring_class->group, current->fraction),
                             body->rings_per_class, stage);
        }
        hs_vector guess =
            hs_add_scaled(zero_vector, current->fraction - body->fraction, body->displacement_rate);
        if (stage == 2) guess = hs_add_scaled(zero_vector, 1.0 / SDIRK2_GAMMA, increment[0]);
        increment[stage - 1] =
            solve_increment(body, edge, guess, &current->tangential, stage, &load);
        if (is_cancelled(body)) return HS_INTERRUPTED;
        for (int64_t c = 0; c < body->class_count; ++c) {
            hs_ring_class *ring_class = body->classes + c;
            hs_ring_problem *problem = ring_class->problem;
            if (!is_involved(body, ring_class, target) || edge <= hs_deepest_label(ring_class))
                continue;
            problem->relieved_load[stage - 1] =
                compute_relieved_load(ring_class, from, edge, increment[stage - 1], stage);
            add_stage_loss(ring_class, stage == 1 ? STAGE_SLIP_FACTOR : 1.0);
            int32_t skipped = ring_class->node_count - problem->ring_count - 1;
            for (int32_t k = 1; stage == 1 && k <= problem->ring_count; ++k)
                problem->stage_slip[skipped + k] =
                    hs_add_scaled(problem->trial[k], -1.0, problem->deflection[k]);
        }
    }
    body->uneven_load = body->slid_load = body->curvature_energy = 0.0;
    for (int64_t c = 0; c < body->class_count; ++c) {
        hs_ring_class *ring_class = body->classes + c;
        const hs_ring_problem *problem = ring_class->problem;
        if (!is_involved(body, ring_class, target)) continue;
        ring_class->loss = class_dissipation(ring_class, &stage_target, from, target->approach,
                                             increment, &body->curvature_energy);
        body->dissipated += ring_class->loss;
        if (target->approach <= hs_deepest_label(ring_class)) {
            ring_class->node_count = 0;
            continue;
        }
        add_unevenness(body, ring_class);
        if (hs_reserve_nodes(ring_class, problem->ring_count + 1) != HS_OK) return HS_OUT_OF_MEMORY;
        ring_class->node_count = problem->ring_count + 1;
        for (int32_t k = 0; k < ring_class->node_count; ++k)
            ring_class->nodes[k] = solution_node(problem, k);
    }
    body->approach = target->approach;
    body->normal_load = target->normal_load;
    body->time = target->time;
    body->displacement_rate =
        hs_add_scaled(zero_vector, 1.0 / (target->fraction - body->fraction), increment[1]);
    body->fraction = target->fraction;
    body->displacement = hs_add_scaled(body->displacement, 1.0, increment[1]);
    if (prescribes_x(&target->tangential)) body->displacement.x = target->tangential.value.x;
    if (prescribes_y(&target->tangential)) body->displacement.y = target->tangential.value.y;
    body->tangential_load = load;
    return HS_OK;
}

/* Advance a body by one step in the workspace of another body with the same classes; returns a
 * status. */
static int step_with_workspace(hs_body *body, hs_body *owner, const hs_plane_path *path,
                               const hs_plane_target *target) {
    for (int64_t c = 0; c < body->class_count; ++c)
        body->classes[c].problem = owner->classes[c].problem;
    int status = step_sdirk2(body, path, target);
    for (int64_t c = 0; c < body->class_count; ++c) {
        owner->classes[c].problem = body->classes[c].problem;
        if (body != owner) body->classes[c].problem = NULL;
    }
    return status;
}

/* Error of a step over the tolerance, to the power with which step lengths are predicted.
 *
 * `uneven_load` is the difference of the step from one of first order, of relative size ε =
 * `uneven_load` / `slid_load`; the error of second order is of relative size ε². The error of the
 * energy is the work of that of the load; it is compared with the energy of the step, and with its
 * share in `segment_loss`, for steps after a turn dissipate next to nothing. */
static double step_error(const hs_body *body, const hs_body *result, const hs_plane_path *path,
                         double segment_loss) {
    double limit = hs_max(hs_body_limit(body, path), hs_body_limit(result, path));
    double displacement_change =
        hs_norm(hs_add_scaled(result->displacement, -1.0, body->displacement));
    /* slip of springs by a fall of their limits, without displacement */
    if (body->initial_friction)
        displacement_change += hs_max(
            max_deflection(body, body->approach) - max_deflection(result, body->approach), 0.0);
    double load_error = 0.0;
    if (result->slid_load > 0.0)
        load_error =
            LOAD_ERROR_FACTOR * result->uneven_load * (result->uneven_load / result->slid_load);
    double loss = hs_max(result->dissipated - body->dissipated, segment_loss);
    double energy_error =
        hs_error(load_error * displacement_change, 0.0,
                 body->tolerance * hs_max(LOSS_TOLERANCE_FACTOR * loss,
                                          WORK_TOLERANCE_FACTOR * limit * displacement_change));
    double curvature_error =
        hs_error(result->curvature_energy, 0.0,
                 MAX_CURVATURE_LOSS * hs_max(loss, limit * displacement_change * body->tolerance));
    double error =
        hs_max(hs_max(energy_error, curvature_error * curvature_error),
               hs_error(load_error, 0.0, LOAD_TOLERANCE_FACTOR * body->tolerance * limit));
    /* it is of third order, adaptive.h expects second order; of powers only roots are exact.
     * Rounded up to 4 bits, so that lengths of steps do not depend on rounding. */
    int exponent;
    double mantissa = frexp(sqrt(error) * sqrt(sqrt(error)), &exponent);
    return ldexp(ceil(16.0 * mantissa) / 16.0, exponent);
}

/* Record the times at which asperities first slide as a whole on an accepted step, for a slip front
 * that is linear in time. */
static void record_slide_times(hs_body *body, const hs_body *result) {
    if (isnan(body->time) || isnan(result->time)) return;
    for (int64_t c = 0; c < body->class_count; ++c) {
        const hs_ring_class *ring_class = body->classes + c, *result_class = result->classes + c;
        if (result_class->node_count == 0) continue;
        double deepest = hs_deepest_label(ring_class),
               from = hs_min(hs_slip_front(body, ring_class), body->approach);
        double to = hs_min(hs_slip_front(result, result_class), result->approach);
        for (int64_t i = hs_count_touching(ring_class->curve.gap, ring_class->curve.count,
                                           result->approach) -
                         1;
             i >= 0; --i) {
            double gap = ring_class->curve.gap[i],
                   *time = body->slide_time + ring_class->offset + i;
            if (gap < to) break;
            if (!isnan(*time)) continue;
            double front_change = from - hs_max(to, deepest),
                   fraction = front_change > 0.0 ? hs_clamp((from - gap) / front_change, 1.0) : 0.0;
            *time = hs_toward(body->time, result->time, hs_max(fraction, 0.0));
            body->has_new_slide_times = 1;
        }
    }
}

/* Move a body to the result of a step; returns a status. */
static int commit(hs_body *body, const hs_body *result) {
    for (int64_t c = 0; c < body->class_count; ++c)
        if (body->classes[c].node_count || result->classes[c].node_count)
            distribute_class_loss(body, body->classes + c, result->classes + c);
    record_slide_times(body, result);
    return hs_assign_body(body, result);
}

/* True if the approach grows on a step and no spring slips; `increment` returns its displacement.
 *
 * The polyline grows by one interval of slope m = ΔV/Δd, so that Q grows on each ring by m (√(d₁ -
 * a) - √(d₀ - a)), and the limit by μ times the same: no spring slips if |ΔV| ≤ μ Δd, and the loads
 * then grow in proportion, ΔT = m ΔN. */
static int is_stick_step(const hs_body *body, const hs_plane_path *path,
                         const hs_plane_target *target, hs_vector *increment) {
    const hs_tangential_target *tangential = &target->tangential;
    double approach_change = target->approach - body->approach, min_friction = HUGE_VAL;
    if (approach_change <= 0.0 || body->approach <= body->contact->sorted_gap[0]) return 0;
    int both_loads = path->plan.both_loads,
        by_load = both_loads && tangential->rigid.x == 0.0 && tangential->rigid.y == 0.0;
    if (!by_load && (both_loads || !prescribes_x(tangential) || !prescribes_y(tangential)))
        return 0;
    hs_vector residual = tangential_residual(tangential, body->displacement, body->tangential_load);
    *increment =
        by_load
            ? hs_add_scaled(zero_vector,
                            approach_change / (target->normal_load - body->normal_load), residual)
            : residual;
    for (int64_t c = 0; c < body->class_count; ++c) {
        const hs_ring_class *ring_class = body->classes + c;
        if (target->approach <= hs_deepest_label(ring_class)) continue;
        min_friction =
            hs_min(min_friction, hs_friction_at(body, ring_class->group, body->fraction));
        /* cells are merged by steps with slip only */
        if (ring_class->node_count > MAX_NODES_PER_RING * body->rings_per_class) return 0;
    }
    return hs_norm(*increment) <= min_friction * approach_change;
}

/* Append an exact step on which no spring slips; returns a status, on failure without a change. */
static int append_stick_step(hs_body *body, const hs_plane_target *target, hs_vector increment) {
    const double approach_change = target->approach - body->approach;
    hs_vector slope = hs_add_scaled(zero_vector, 1.0 / approach_change, increment),
              load = body->tangential_load;
    double rounding = HS_TIE * (hs_norm(body->displacement) + hs_norm(increment));
    for (int64_t c = 0; c < body->class_count; ++c)
        if (hs_reserve_nodes(body->classes + c, body->classes[c].node_count + 2) != HS_OK)
            return HS_OUT_OF_MEMORY;
    for (int64_t c = 0; c < body->class_count; ++c) {
        hs_ring_class *ring_class = body->classes + c;
        double deepest = hs_deepest_label(ring_class);
        if (target->approach <= deepest) continue;
        hs_node edge = hs_node_at(ring_class, target->approach, zero_vector),
                *nodes = ring_class->nodes;
        load = hs_add_scaled(load, edge.normal - (ring_class->node_count ? nodes[0].normal : 0.0),
                             slope);
        for (int32_t k = 0; k < ring_class->node_count; ++k)
            nodes[k].deflection = hs_add_scaled(nodes[k].deflection, 1.0, increment);
        if (ring_class->node_count == 0)
            nodes[ring_class->node_count++] = hs_node_at(
                ring_class, deepest, hs_add_scaled(zero_vector, target->approach - deepest, slope));
        /* a straight continuation of the polyline replaces its edge, others get a node */
        hs_vector bend = nodes[0].deflection;
        if (ring_class->node_count > 1)
            bend =
                hs_add_scaled(bend, -(edge.label - nodes[0].label) / (edge.label - nodes[1].label),
                              nodes[1].deflection);
        if (ring_class->node_count == 1 || hs_norm(bend) > rounding) {
            memmove(nodes + 1, nodes, (size_t)ring_class->node_count * sizeof *nodes);
            ++ring_class->node_count;
        }
        nodes[0] = edge;
    }
    body->approach = target->approach;
    body->normal_load = target->normal_load;
    body->time = target->time;
    body->fraction = target->fraction;
    body->displacement = prescribes_x(&target->tangential)
                             ? target->tangential.value
                             : hs_add_scaled(body->displacement, 1.0, increment);
    body->tangential_load = prescribes_x(&target->tangential) ? load : target->tangential.value;
    return HS_OK;
}

/* Context of the adaptive integrator (adaptive.h) on one segment of a path. */
typedef struct segment_run {
    hs_body *body;
    const hs_plane_path *path;
    hs_stops *stops; /* NULL: none */
    double begin, end;
    double loss;            /* estimate of the energy dissipated on the segment, by one step */
    hs_plane_target target; /* at the end of the present step, and the result of that step: */
    hs_body *trial;
    int is_straight; /* true if loads are straight on the segment */
    int is_sticking; /* true if no spring slips on the present step, with `increment` */
    hs_vector increment;
} segment_run;

static const hs_adaptive step_settings = {
    0.0,                    /* errors are over the tolerances of T and energy */
    1.0,                    /* chosen */
    1,       INT_MAX,  0.0, /* shortened at once */
    1.0,     MIN_STEP,      /* of the segment */
    0.85,                   /* chosen */
    0.1,     5.0,           /* chosen */
    INT_MAX,                /* the shortest step bounds their number */
    1.0,     1.0,           /* never coarsened */
};

/* Status of a segment abandoned at `stop_fraction`, distinct from HS_TOO_MANY_SUBSTEPS; it is not
 * returned to users. */
#define SEGMENT_ABANDONED (-2)

/* Try a step: exactly if no spring slips, otherwise by SDIRK2. */
static int try_step(hs_integrand *integrand, const hs_interval *step, int substeps, double *error) {
    segment_run *run = (segment_run *)integrand->context;
    hs_body *body = run->body;
    (void)substeps;
    *error = 0.0;
    run->target = hs_target_at(run->path, hs_toward(run->begin, run->end, step->end));
    run->is_sticking =
        run->is_straight && is_stick_step(body, run->path, &run->target, &run->increment);
    if (run->is_sticking) return HS_OK;
    int status = HS_OK;
    if (run->trial)
        status = hs_assign_body(run->trial, body);
    else
        run->trial = hs_copy_for_trial(body);
    if (!run->trial) status = HS_OUT_OF_MEMORY;
    if (status == HS_OK) status = step_with_workspace(run->trial, body, run->path, &run->target);
    if (status != HS_OK) return status;
    if (step->begin == 0.0 && step->end == 1.0)
        run->loss = run->trial->dissipated - body->dissipated;
    *error = step_error(body, run->trial, run->path, run->loss * (step->end - step->begin));
    return HS_OK;
}

/* Advance a body from the start of an accepted step to a path fraction within it, by the same
 * method. So results are continuous up to the end of the step, and independent of other fractions
 * that are read. Returns a status. */
static int advance_within(const segment_run *run, double fraction, hs_body *body) {
    if (fraction == body->fraction) return HS_OK;
    hs_plane_target target = hs_target_at(run->path, fraction);
    if (run->is_sticking) {
        hs_vector increment;
        is_stick_step(run->body, run->path, &target, &increment);
        return append_stick_step(body, &target, increment);
    }
    hs_body *trial = hs_copy_for_trial(run->body);
    int status =
        trial ? step_with_workspace(trial, run->body, run->path, &target) : HS_OUT_OF_MEMORY;
    if (status == HS_OK) status = commit(body, trial);
    hs_body_free(trial);
    return status;
}

/* Read the states at all stops within an accepted step; returns a status. */
static int visit_stops(segment_run *run) {
    hs_stops *stops = run->stops;
    const double step_end = run->target.fraction;
    int status = HS_OK;
    while (stops && status == HS_OK && stops->next_fraction <= step_end &&
           stops->next_fraction < stops->stop_fraction) {
        hs_body *reading = hs_body_copy(run->body);
        status = reading ? advance_within(run, stops->next_fraction, reading) : HS_OUT_OF_MEMORY;
        if (status == HS_OK) status = stops->visit(stops, reading);
        hs_body_free(reading);
    }
    if (status != HS_OK || !stops || stops->stop_fraction > step_end || stops->stop_fraction == 1.0)
        return status;
    status = advance_within(run, stops->stop_fraction, run->body);
    return status == HS_OK ? SEGMENT_ABANDONED : status;
}

static int accept_step(hs_integrand *integrand, const hs_interval *step) {
    segment_run *run = (segment_run *)integrand->context;
    (void)step;
    int status = visit_stops(run);
    if (status != HS_OK) return status;
    return run->is_sticking ? append_stick_step(run->body, &run->target, run->increment)
                            : commit(run->body, run->trial);
}

static int integrate_segment(hs_body *body, const hs_plane_path *path, double segment_end,
                             int is_straight, hs_stops *stops) {
    segment_run run;
    memset(&run, 0, sizeof run);
    run.body = body;
    run.path = path;
    run.begin = body->fraction;
    run.end = segment_end;
    run.is_straight = is_straight;
    run.stops = stops;
    hs_integrand integrand = {&run, &step_settings, try_step, accept_step, NULL, 0, 0.0};
    int status = hs_adapt(&integrand, 0.0, 1.0);
    hs_body_free(run.trial);
    return status;
}

/* Bring loads to the request at fraction 0 of a path, from which they differ if the displacement
 * was held beyond the limit. Returns a status. */
static int correct_initial_load(hs_body *body, const hs_plane_path *path) {
    hs_plane_path correction = *path;
    hs_vector load = body->tangential_load, request = path->value[0];
    hs_plane_target initial_target = hs_target_at(path, 0.0);
    hs_vector load_error = hs_add_scaled(initial_target.tangential.value, -1.0, load);
    if (path->rigid.x > 0.0) {
        load_error.x = 0.0;
        load.x = request.x;
    }
    if (path->rigid.y > 0.0) {
        load_error.y = 0.0;
        load.y = request.y;
    }
    if (hs_norm(load_error) <= body->tolerance * hs_body_limit(body, path)) return HS_OK;
    hs_set_request(&correction, 0, load);
    hs_set_request(&correction, 1, request);
    correction.plan.approach[1] = path->plan.approach[0];
    correction.plan.normal_load[1] = path->plan.normal_load[0];
    correction.plan.times[1] = path->plan.times[0];
    int status = integrate_segment(body, &correction, 1.0, 0, NULL);
    body->fraction = 0.0;
    return status;
}

int hs_body_integrate(hs_body *body, hs_plane_path *path, hs_stops *stops) {
    body->approach = path->plan.approach[0];
    body->fraction = 0.0;
    body->displacement_rate = zero_vector;
    hs_begin_segments(body, path);
    int status = path->saturate ? correct_initial_load(body, path) : HS_OK;
    while (status == HS_OK && body->fraction < 1.0) {
        int is_straight;
        double segment_end = hs_next_cut(body, path, &is_straight);
        status = integrate_segment(body, path, segment_end, is_straight, stops);
    }
    return status == SEGMENT_ABANDONED ? HS_OK : status;
}

int hs_body_stick(hs_body *body, hs_plane_path *path, int *sticks) {
    hs_vector increment;
    hs_begin_segments(body, path);
    hs_plane_target target = hs_target_at(path, 1.0);
    const hs_vector *value = &target.tangential.value;
    *sticks = path->plan.segments.count == 0 && value->x == path->value[1].x &&
              value->y == path->value[1].y && is_stick_step(body, path, &target, &increment);
    return *sticks ? append_stick_step(body, &target, increment) : HS_OK;
}

int hs_body_stiffness(hs_body *body, hs_vector direction, double stiffness[2][2]) {
    double edge = body->approach, norm = hs_norm(direction), full_slip = 0.0;
    int is_converged;
    memset(stiffness, 0, 4 * sizeof(double));
    for (int64_t c = 0; c < body->class_count; ++c) {
        hs_ring_class *ring_class = body->classes + c;
        const double deepest = hs_deepest_label(ring_class);
        if (edge <= deepest) continue;
        if (norm == 0.0) {
            double label = hs_max(hs_min(hs_slip_front(body, ring_class), edge), deepest);
            stiffness[0][0] += hs_load_at(ring_class->curve, label).slope;
            stiffness[1][1] = stiffness[0][0];
            continue;
        }
        if (hs_reserve_rings(ring_class, ring_class->node_count + 1) != HS_OK)
            return HS_OUT_OF_MEMORY;
        const double friction = hs_friction_at(body, ring_class->group, body->fraction);
        set_up_stage(ring_class, edge, edge, friction, body->rings_per_class, 1);
        full_slip = hs_max(full_slip, friction * (edge - deepest));
    }
    /* so small an increment that slip fronts remain in their cells; chosen */
    if (norm > 0.0)
        solve_classes(body, edge, hs_add_scaled(zero_vector, 1e-9 * full_slip / norm, direction),
                      MAX_ITERATIONS, stiffness, &is_converged);
    return HS_OK;
}
