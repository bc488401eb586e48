/* Rings: deflections of one class of rings at the end of a step, from the trial deflections v*, at
 * which all rings stick.
 *
 * They minimise ½ Σ M |v - v*|² subject to |Q| ≤ g on every ring, with v = F Q: a strictly convex
 * problem. It is solved for the tractions Q of an active set of outer rings by projected
 * Gauss–Seidel sweeps and Newton's method on the angles of slipping rings (README.md, two
 * directions 1 and 2). */

#include "rings.h"
#include "lanes.h"

/* Largest change of a traction in a Newton step, over its friction limit, after which the solution
 * has converged: the next one would be quadratically smaller; chosen. */
#define NEWTON_TOLERANCE 1e-3
/* Smallest stiffness of a ring over the slope of the normal load outside it; chosen. Where a normal
 * curve is straight no spring touches, and a ring would have no stiffness. */
#define MIN_STIFFNESS_RATIO 1e-12
/* Friction limit below which rings slide without traction; chosen, so that the square of a limit
 * does not underflow. */
#define MIN_LIMIT 1e-150
/* Bound of the tangent of the angle by which a Newton step rotates a traction; chosen. */
#define MAX_ROTATION 0.7

/* Element of a matrix of the problem, by rows. */
#define ELEMENT(matrix, i, j) problem->matrix[(int64_t)(i) * problem->capacity + (j)]

int hs_reserve_rings(hs_ring_class *ring_class, int32_t ring_count) {
    if (ring_class->problem && ring_class->problem->capacity >= ring_count) return HS_OK;
    /* spare rings, so that growing problems are seldom reserved again; chosen */
    ring_count += 8;
    size_t n = (size_t)ring_count + 1, pairs = n * (size_t)ring_count;
    size_t numbers = 10 * n + 3 * pairs + 4 * pairs + 2 * n + 2 * (9 * n + 2 * n);
    hs_ring_problem *problem = (hs_ring_problem *)malloc(
        sizeof *problem + numbers * sizeof(double) + 2 * n * sizeof(int32_t));
    if (!problem) return HS_OUT_OF_MEMORY;
    free(ring_class->problem);
    ring_class->problem = problem;
    problem->capacity = ring_count;
    problem->ring_count = problem->row_count = problem->hessian_count = problem->active_count = 0;
    double *storage = (double *)(problem + 1);
    double **arrays[] = {
        &problem->label,          &problem->normal,        &problem->integral,
        &problem->moved_fraction, &problem->depth,         &problem->stiffness,
        &problem->limit,          &problem->load_gradient, &problem->displacement_gradient,
        &problem->unit_traction};
    for (int k = 0; k < 10; ++k, storage += n) *arrays[k] = storage;
    double **matrices[] = {&problem->traction_matrix, &problem->deflection_matrix,
                           &problem->hessian};
    for (int k = 0; k < 3; ++k, storage += pairs) *matrices[k] = storage;
    problem->cholesky_factor = storage;
    problem->newton_step = storage + 4 * pairs;
    storage = problem->newton_step + 2 * n;
    hs_vector **vectors[] = {
        &problem->stage_slip,  &problem->trial_at_rest, &problem->trial,
        &problem->linear_term, &problem->traction,      &problem->slip,
        &problem->deflection,  &problem->slope,         &problem->rest_traction};
    for (int k = 0; k < 9; ++k, storage += 2 * n) *vectors[k] = (hs_vector *)storage;
    problem->basis = (hs_vector *)storage;
    problem->basis_ring = (int32_t *)(storage + 4 * n);
    return HS_OK;
}

void hs_set_ring_nodes(hs_ring_problem *problem, int32_t node_count) {
    const double *label = problem->label, *normal = problem->normal;
    int32_t n = problem->ring_count = node_count - 1;
    double *depth = problem->depth, outer_slope = 0.0;
    for (int32_t i = 0; i <= n; ++i) depth[i] = label[0] - label[i];
    for (int32_t i = n; i >= 1; --i) {
        double inner_slope = outer_slope;
        outer_slope = (normal[i - 1] - normal[i]) / (label[i - 1] - label[i]);
        problem->stiffness[i] =
            hs_max(outer_slope - inner_slope, MIN_STIFFNESS_RATIO * outer_slope);
    }
    for (int32_t i = 1; i <= n; ++i) {
        double outer_root = sqrt(depth[i]);
        for (int32_t j = 0; j < i; ++j) {
            double inner_root = sqrt(depth[i] - depth[j + 1]);
            ELEMENT(traction_matrix, i, j) = outer_root - inner_root;
            outer_root = inner_root;
        }
    }
    problem->row_count = problem->hessian_count = problem->active_count = 0;
}

hs_vector hs_ring_traction(const hs_node *nodes, int32_t i) {
    hs_vector sum = {0.0, 0.0};
    double outer_root = sqrt(nodes[0].label - nodes[i].label);
    for (int32_t j = 0; j < i; ++j) {
        double inner_root = sqrt(nodes[j + 1].label - nodes[i].label);
        double slope_factor = (outer_root - inner_root) / (nodes[j].label - nodes[j + 1].label);
        sum = hs_add_scaled(hs_add_scaled(sum, slope_factor, nodes[j + 1].deflection),
                            -slope_factor, nodes[j].deflection);
        outer_root = inner_root;
    }
    return sum;
}

static hs_vector clip_to_norm(hs_vector vector, double max_norm) {
    double norm = hs_norm(vector);
    if (norm <= max_norm) return vector;
    return HS_MADE(hs_vector){vector.x * (max_norm / norm), vector.y * (max_norm / norm)};
}

/* target += factor × source, element by element. */
static inline void add_row(double *restrict target, double factor, const double *restrict source,
                           int32_t count) {
    for (int32_t i = 0; i < count; ++i) target[i] += factor * source[i];
}

/* Product of a row and a column of vectors, summed in four lanes. */
static inline hs_vector row_product(const double *restrict row, const hs_vector *restrict vectors,
                                    int32_t count) {
    hs_vector sum[4] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    int32_t i = 0;
    for (; i + 4 <= count; i += 4)
        for (int lane = 0; lane < 4; ++lane)
            sum[lane] = hs_add_scaled(sum[lane], row[i + lane], vectors[i + lane]);
    for (int lane = 0; i < count; ++i, ++lane)
        sum[lane] = hs_add_scaled(sum[lane], row[i], vectors[i]);
    return hs_add_scaled(hs_add_scaled(sum[0], 1.0, sum[1]), 1.0,
                         hs_add_scaled(sum[2], 1.0, sum[3]));
}

HS_WIDE static void set_tractions(hs_ring_problem *problem, double friction) {
    const double *depth = problem->depth, *moved_fraction = problem->moved_fraction;
    const hs_vector *rest = problem->trial_at_rest;
    hs_vector *slope = problem->slope;
    for (int32_t j = 0; j < problem->ring_count; ++j) {
        double width = depth[j + 1] - depth[j];
        slope[j].x = (rest[j + 1].x - rest[j].x) / width;
        slope[j].y = (rest[j + 1].y - rest[j].y) / width;
    }
    for (int32_t i = 1; i <= problem->ring_count; ++i) {
        problem->limit[i] = friction * sqrt(depth[i]);
        problem->rest_traction[i] = row_product(&ELEMENT(traction_matrix, i, 0), slope, i);
        double unit_traction = 0.0;
        for (int32_t j = 0; j < i && (j == 0 || moved_fraction[j] < 1.0); ++j)
            unit_traction += ELEMENT(traction_matrix, i, j) *
                             (moved_fraction[j + 1] - (j > 0 ? moved_fraction[j] : 0.0)) /
                             (depth[j + 1] - depth[j]);
        problem->unit_traction[i] = unit_traction;
    }
}

void hs_set_ring_tractions(hs_ring_problem *problem, double friction) {
    set_tractions(problem, friction);
}

/* Extend the matrices to a number of rings. */
HS_WIDE static void extend_matrices(hs_ring_problem *problem, int32_t count) {
    const double *depth = problem->depth;
    double *remainder = problem->newton_step;
    for (int32_t k = problem->row_count + 1; k <= count; ++k) {
        double *row = &ELEMENT(deflection_matrix, k, 0);
        /* F D is the matrix that sums slopes: F by back substitution, row by row */
        for (int32_t j = 0; j < k; ++j) remainder[j] = depth[j + 1] - depth[j];
        for (int32_t j = k; j >= 1; --j) {
            row[j] = remainder[j - 1] / ELEMENT(traction_matrix, j, j - 1);
            add_row(remainder, -row[j], &ELEMENT(traction_matrix, j, 0), j - 1);
        }
        problem->row_count = k;
    }
    for (int32_t k = problem->hessian_count + 1; k <= count; ++k) {
        const double *row = &ELEMENT(deflection_matrix, k, 0);
        for (int32_t i = 1; i <= k; ++i) ELEMENT(hessian, k, i) = 0.0;
        problem->load_gradient[k] = problem->displacement_gradient[k] = 0.0;
        for (int32_t i = 1; i <= k; ++i) {
            double weight = problem->stiffness[k] * row[i];
            add_row(&ELEMENT(hessian, i, 1), weight, row + 1, i);
            problem->load_gradient[i] += weight;
            problem->displacement_gradient[i] += weight * problem->moved_fraction[k];
        }
    }
    for (int32_t i = 1; i <= count; ++i)
        for (int32_t j = 1; j < i; ++j) ELEMENT(hessian, j, i) = ELEMENT(hessian, i, j);
    problem->hessian_count = count;
}

/* Add the stiffness of rings from `first` to `last` to the linear term Fᵀ M v*. */
HS_WIDE static void extend_linear_term(hs_ring_problem *problem, int32_t first, int32_t last) {
    hs_vector *restrict linear_term = problem->linear_term;
    for (int32_t k = first; k <= last; ++k) {
        const double *restrict row = &ELEMENT(deflection_matrix, k, 0);
        const double stiffness = problem->stiffness[k];
        const hs_vector trial = problem->trial[k];
        linear_term[k].x = linear_term[k].y = 0.0;
        for (int32_t i = 1; i <= k; ++i)
            linear_term[i] = hs_add_scaled(linear_term[i], stiffness * row[i], trial);
    }
}

/* Subtract the effect of the traction of a ring, A Q, from the slip of all active rings. */
static inline void subtract_traction(hs_ring_problem *problem, int32_t i, hs_vector traction) {
    const double *restrict row = &ELEMENT(hessian, i, 0);
    hs_vector *restrict slip = problem->slip;
    for (int32_t j = 1; j <= problem->active_count; ++j) {
        slip[j].x -= row[j] * traction.x;
        slip[j].y -= row[j] * traction.y;
    }
}

/* Compute the slip of all active rings: Fᵀ M v* - A Q. */
HS_WIDE static void compute_slip(hs_ring_problem *problem) {
    memcpy(problem->slip + 1, problem->linear_term + 1,
           (size_t)problem->active_count * sizeof *problem->slip);
    for (int32_t i = 1; i <= problem->active_count; ++i)
        subtract_traction(problem, i, problem->traction[i]);
}

/* Projected Gauss–Seidel sweep: move each traction to its minimum while all others are constant. */
HS_WIDE static void sweep_gauss_seidel(hs_ring_problem *problem) {
    for (int32_t i = 1; i <= problem->active_count; ++i) {
        hs_vector old_traction = problem->traction[i],
                  unlimited =
                      hs_add_scaled(old_traction, 1.0 / ELEMENT(hessian, i, i), problem->slip[i]);
        hs_vector new_traction = clip_to_norm(unlimited, problem->limit[i]),
                  change = hs_add_scaled(new_traction, -1.0, old_traction);
        problem->traction[i] = new_traction;
        subtract_traction(problem, i, change);
    }
}

/* Cholesky factor U of a matrix UᵀU with `count` rows, in place; the upper half is given. Rows are
 * eliminated by four, so that others are read and written once for four. Returns 0 if the matrix is
 * not positive definite. */
HS_WIDE static int factorise_cholesky(double *factor, int64_t stride, int32_t count) {
    for (int32_t first = 0; first < count; first += 4) {
        int32_t stop = first + 4 < count ? first + 4 : count;
        for (int32_t k = first; k < stop; ++k) {
            double *row = factor + k * stride;
            for (int32_t i = first; i < k; ++i)
                add_row(row + k, -factor[i * stride + k], factor + i * stride + k, count - k);
            if (!(row[k] > 0.0)) return 0;
            double root = sqrt(row[k]);
            for (int32_t j = k; j < count; ++j) row[j] /= root;
        }
        for (int32_t i = stop; i < count; ++i) {
            const double *restrict a = factor + first * stride, *restrict b = a + stride,
                                   *restrict c = b + stride, *restrict d = c + stride;
            double *restrict row = factor + i * stride;
            const double at_a = a[i], at_b = b[i], at_c = c[i], at_d = d[i];
            for (int32_t j = i; j < count; ++j)
                row[j] = row[j] - at_a * a[j] - at_b * b[j] - at_c * c[j] - at_d * d[j];
        }
    }
    return 1;
}

/* Solve UᵀU x = b; x holds b on entry. */
HS_WIDE static void solve_cholesky(const double *factor, int64_t stride, int32_t count, double *x) {
    for (int32_t i = 0; i < count; ++i) {
        x[i] /= factor[i * stride + i];
        add_row(x + i + 1, -x[i], factor + i * stride + i + 1, count - i - 1);
    }
    for (int32_t i = count - 1; i >= 0; --i) {
        for (int32_t k = i + 1; k < count; ++k) x[i] -= factor[i * stride + k] * x[k];
        x[i] /= factor[i * stride + i];
    }
}

/* Factorise the matrix of a Newton step. A ring that slips has one unknown, along the tangent of
 * its friction limit; a ring that sticks has two. Returns the number of unknowns, 0 if the matrix
 * is not positive definite. */
HS_WIDE static int factorise_newton_matrix(hs_ring_problem *problem) {
    const int64_t stride = 2 * problem->capacity;
    int32_t count = 0, slipping = 0; /* unknowns; outer rings that all slip */
    for (int32_t i = 1; i <= problem->active_count; ++i) {
        hs_vector traction = problem->traction[i];
        double limit = problem->limit[i], norm = hs_norm(traction);
        int is_slipping = hs_norm(hs_add_scaled(traction, 1.0 / ELEMENT(hessian, i, i),
                                                problem->slip[i])) > limit &&
                          norm > 0.0;
        hs_vector axis_x = {1.0, 0.0}, axis_y = {0.0, 1.0},
                  tangent = {-traction.y / norm, traction.x / norm};
        problem->basis_ring[count] = is_slipping ? -i : i;
        problem->basis[count++] = is_slipping ? tangent : axis_x;
        if (is_slipping) {
            slipping += slipping == i - 1;
            continue;
        }
        problem->basis_ring[count] = i;
        problem->basis[count++] = axis_y;
    }
    for (int32_t a = 0; a < count; ++a) {
        int32_t i = abs(problem->basis_ring[a]), b = a;
        const double *restrict hessian = &ELEMENT(hessian, i, 0);
        const hs_vector *restrict basis = problem->basis, direction = basis[a];
        double *restrict row = problem->cholesky_factor + a * stride;
        for (; b < slipping; ++b) row[b] = hessian[b + 1] * hs_dot(direction, basis[b]);
        for (; b < count; ++b)
            row[b] = hessian[abs(problem->basis_ring[b])] * hs_dot(direction, basis[b]);
        if (problem->basis_ring[a] < 0) {
            double limit = problem->limit[i];
            problem->cholesky_factor[a * stride + a] +=
                hs_max(hs_dot(problem->traction[i], problem->slip[i]), 0.0) / (limit * limit);
        }
    }
    problem->unknown_count =
        factorise_cholesky(problem->cholesky_factor, stride, count) ? count : 0;
    return problem->unknown_count;
}

/* Move the tractions by a Newton step; those of slipping rings remain at their limits. Returns the
 * largest change, over the friction limit; infinite if a traction exceeds its limit. */
static double apply_newton_step(hs_ring_problem *problem) {
    int32_t count = factorise_newton_matrix(problem);
    const hs_vector zero = {0.0, 0.0};
    double max_change = count == 0 ? HUGE_VAL : 0.0;
    for (int32_t a = 0; a < count; ++a)
        problem->newton_step[a] =
            hs_dot(problem->basis[a], problem->slip[abs(problem->basis_ring[a])]);
    if (count > 0)
        solve_cholesky(problem->cholesky_factor, 2 * problem->capacity, count,
                       problem->newton_step);
    for (int32_t a = 0; a < count; ++a) {
        int32_t i = abs(problem->basis_ring[a]);
        const double limit = problem->limit[i], *step = problem->newton_step + a;
        hs_vector *traction = problem->traction + i;
        if (problem->basis_ring[a] > 0) {
            hs_vector change = {step[0], step[1]};
            *traction = hs_add_scaled(*traction, 1.0, change);
            max_change = hs_max(max_change, hs_norm(change) / limit);
            if (hs_norm(*traction) > limit) max_change = HUGE_VAL;
            ++a;
            continue;
        }
        max_change = hs_max(max_change, fabs(*step) / limit);
        *traction =
            hs_add_scaled(*traction, hs_clamp(*step, MAX_ROTATION * limit), problem->basis[a]);
        *traction = hs_add_scaled(zero, limit / hs_norm(*traction), *traction);
    }
    return max_change;
}

/* Compute tractions of rings that are not active, up to ring `last`. Returns the innermost one
 * beyond its limit, or 0. */
HS_WIDE static int32_t find_innermost_violation(hs_ring_problem *problem, int32_t last) {
    const int32_t active = problem->active_count;
    const double *depth = problem->depth;
    hs_vector *slope = problem->slope, outer_slip = {0.0, 0.0};
    int32_t innermost = 0;
    /* slopes of v - v*, which is zero inside the active rings */
    for (int32_t j = 0; active > 0 && j <= active && j < problem->ring_count; ++j) {
        hs_vector slip = hs_add_scaled(problem->deflection[j + 1], -1.0, problem->trial[j + 1]);
        double width = depth[j + 1] - depth[j];
        slope[j].x = (slip.x - outer_slip.x) / width;
        slope[j].y = (slip.y - outer_slip.y) / width;
        outer_slip = slip;
    }
    for (int32_t i = active + 1; i <= last; ++i) {
        problem->traction[i] = hs_add_scaled(problem->rest_traction[i], problem->unit_traction[i],
                                             problem->displacement);
        if (active > 0)
            problem->traction[i] =
                hs_add_scaled(problem->traction[i], 1.0,
                              row_product(&ELEMENT(traction_matrix, i, 0), slope, active + 1));
        /* beyond rounding; chosen */
        if (hs_norm(problem->traction[i]) > problem->limit[i] * (1.0 + 1e-12)) innermost = i;
    }
    return innermost;
}

/* Compute deflections of the active rings from their tractions: v = F Q. */
HS_WIDE static void compute_deflections(hs_ring_problem *problem) {
    for (int32_t k = 1; k <= problem->active_count; ++k)
        problem->deflection[k] =
            row_product(&ELEMENT(deflection_matrix, k, 1), problem->traction + 1, k);
}

/* True if the limits of all rings are too small to hold a traction. */
static int is_frictionless(const hs_ring_problem *problem) {
    return problem->limit[problem->ring_count] < MIN_LIMIT;
}

/* Approximate time of an iteration [µs], cubic in the number of active rings; factor chosen. */
static int64_t iteration_work(const hs_ring_problem *problem) {
    int64_t active = problem->active_count;
    return 1 + active * active * active / 400;
}

int hs_solve_rings(hs_ring_problem *problem, hs_vector displacement, int max_iterations,
                   hs_watch *watch) {
    const int32_t n = problem->ring_count;
    const hs_vector zero = {0.0, 0.0};
    problem->trial[0] = zero;
    problem->displacement = displacement;
    for (int32_t k = 1; k <= n; ++k)
        problem->trial[k] =
            hs_add_scaled(problem->trial_at_rest[k], problem->moved_fraction[k], displacement);
    memcpy(problem->deflection, problem->trial, (size_t)(n + 1) * sizeof *problem->deflection);
    if (is_frictionless(problem)) {
        memset(problem->deflection, 0, (size_t)(n + 1) * sizeof *problem->deflection);
        problem->active_count = 0;
        return 1;
    }
    int32_t wanted = problem->wanted_count;
    if (problem->active_count == 0) wanted = find_innermost_violation(problem, n);
    if (wanted == 0) return 1;
    /* the active set only grows, since its matrices are extended ring by ring */
    problem->active_count = 0;
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
        if (wanted) {
            if (wanted > problem->hessian_count) extend_matrices(problem, wanted);
            for (int32_t i = problem->active_count + 1; i <= wanted; ++i)
                problem->traction[i] = clip_to_norm(problem->traction[i], problem->limit[i]);
            extend_linear_term(problem, problem->active_count + 1, wanted);
            problem->active_count = wanted;
        }
        if (watch && watch->status == HS_OK)
            watch->status =
                hs_count_work(watch->drive, &watch->work_since_poll, iteration_work(problem));
        if (watch && watch->status != HS_OK) return 1;
        compute_slip(problem);
        sweep_gauss_seidel(problem);
        double change = apply_newton_step(problem);
        compute_deflections(problem);
        /* before it converges, only as far as slip spreads in an iteration; chosen */
        int32_t near = problem->active_count + problem->active_count / 2 + 4;
        wanted =
            find_innermost_violation(problem, change <= NEWTON_TOLERANCE || near > n ? n : near);
        /* activate one more ring in advance: slip that spreads inward mostly continues */
        if (wanted && wanted < n) ++wanted;
        problem->wanted_count = wanted ? wanted : problem->active_count;
        if (change <= NEWTON_TOLERANCE && !wanted) return 1;
    }
    return 0;
}

hs_vector hs_ring_load(const hs_ring_problem *problem) {
    hs_vector load = {0.0, 0.0};
    for (int32_t k = 1; k <= problem->ring_count; ++k)
        load = hs_add_scaled(load, problem->stiffness[k], problem->deflection[k]);
    return load;
}

void hs_ring_stiffness(hs_ring_problem *problem, double stiffness[2][2]) {
    double stuck_stiffness = 0.0;
    for (int32_t k = problem->active_count + 1; k <= problem->ring_count; ++k)
        stuck_stiffness += problem->stiffness[k] * problem->moved_fraction[k];
    stiffness[0][0] = stiffness[1][1] = stuck_stiffness;
    stiffness[0][1] = stiffness[1][0] = 0.0;
    if (is_frictionless(problem)) stiffness[0][0] = stiffness[1][1] = 0.0;
    if (problem->active_count == 0) return;
    const int32_t count = problem->unknown_count;
    double *solution = problem->newton_step;
    for (int axis = 0; axis < 2; ++axis) {
        for (int32_t a = 0; a < count; ++a)
            solution[a] = problem->displacement_gradient[abs(problem->basis_ring[a])] *
                          (axis ? problem->basis[a].y : problem->basis[a].x);
        solve_cholesky(problem->cholesky_factor, 2 * problem->capacity, count, solution);
        for (int32_t a = 0; a < count; ++a) {
            double contribution = problem->load_gradient[abs(problem->basis_ring[a])] * solution[a];
            stiffness[0][axis] += contribution * problem->basis[a].x;
            stiffness[1][axis] += contribution * problem->basis[a].y;
        }
    }
}
