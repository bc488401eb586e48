/* Rings: the slip of one class of rings on one step, from the trial deflections at which all stick and the friction limits of the
 * rings: the minimum of a convex function, by Gauss–Seidel and Newton's method (README.md, two directions 1 and 2). */

#include "rings.h"
#include "lanes.h"

/* share of the limit by which rings may still move where a solution is settled */
#define SETTLED 1e-7
#define MOST_ROUNDS 100
/* Where a normal curve is straight nothing touches, and a ring would have no stiffness: it has this share of what is outside. */
#define LEAST_MASS 1e-12
/* limit of a ring below which it slides without traction: the square of a limit has to be a number */
#define LEAST_LIMIT 1e-150
/* farthest that Newton's step turns a traction [rad] */
#define FARTHEST_TURN 0.7

#define AT(matrix, i, j) problem->matrix[(int64_t)(i) * problem->room + (j)]

int hs_ring_room(hs_class *rings, int32_t room) {
    if (rings->problem && rings->problem->room >= room) return HS_OK;
    room += 8;
    size_t n = (size_t)room + 1, pairs = n * (size_t)room;
    size_t numbers = 9 * n + 3 * pairs + 4 * pairs + 2 * n + 2 * (8 * n + 2 * n);
    hs_ring_problem *problem = (hs_ring_problem *)malloc(sizeof *problem + numbers * sizeof(double) + 2 * n * sizeof(int32_t));
    if (!problem) return HS_OUT_OF_MEMORY;
    free(rings->problem);
    rings->problem = problem;
    problem->room = room;
    problem->rings = problem->active = problem->unknowns = 0;
    double *at = (double *)(problem + 1);
    double **arrays[] = {&problem->label, &problem->normal, &problem->integral, &problem->share, &problem->depth,
                         &problem->mass,  &problem->limit,  &problem->sum,      &problem->push};
    for (int k = 0; k < 9; ++k, at += n) *arrays[k] = at;
    double **matrices[] = {&problem->traction_of, &problem->deflection_of, &problem->matrix};
    for (int k = 0; k < 3; ++k, at += pairs) *matrices[k] = at;
    problem->factor = at;
    problem->step = at + 4 * pairs;
    at = problem->step + 2 * n;
    hs_vector **vectors[] = {&problem->slipped, &problem->base, &problem->trial, &problem->load, &problem->traction, &problem->slip, &problem->found, &problem->slope};
    for (int k = 0; k < 8; ++k, at += 2 * n) *vectors[k] = (hs_vector *)at;
    problem->basis = (hs_vector *)at;
    problem->ring = (int32_t *)(at + 4 * n);
    return HS_OK;
}

void hs_ring_limits(hs_ring_problem *problem, double friction) {
    for (int32_t i = 0; i <= problem->rings; ++i) problem->limit[i] = friction * sqrt(problem->depth[i]);
}

void hs_ring_nodes(hs_ring_problem *problem, int32_t count, double friction) {
    const double *label = problem->label, *normal = problem->normal;
    int32_t n = problem->rings = count - 1;
    double *r = problem->depth, outer = 0.0;
    for (int32_t i = 0; i <= n; ++i) r[i] = label[0] - label[i];
    hs_ring_limits(problem, friction);
    for (int32_t i = n; i >= 1; --i) {
        double inner = outer;
        outer = (normal[i - 1] - normal[i]) / (label[i - 1] - label[i]);
        problem->mass[i] = hs_most(outer - inner, LEAST_MASS * outer);
    }
    for (int32_t i = 1; i <= n; ++i) {
        double before = sqrt(r[i]);
        for (int32_t j = 0; j < i; ++j) {
            double next = sqrt(r[i] - r[j + 1]);
            AT(traction_of, i, j) = before - next;
            before = next;
        }
    }
    problem->active = problem->solved = 0;
}

hs_vector hs_ring_traction(const hs_node *nodes, int32_t i) {
    hs_vector sum = {0.0, 0.0};
    double before = sqrt(nodes[0].label - nodes[i].label);
    for (int32_t j = 0; j < i; ++j) {
        double next = sqrt(nodes[j + 1].label - nodes[i].label);
        double share = (before - next) / (nodes[j].label - nodes[j + 1].label);
        sum = hs_plus(hs_plus(sum, share, nodes[j + 1].deflection), -share, nodes[j].deflection);
        before = next;
    }
    return sum;
}

static hs_vector shortened(hs_vector vector, double limit) {
    double size = hs_length(vector);
    if (size <= limit) return vector;
    return HS_MADE(hs_vector){vector.x * (limit / size), vector.y * (limit / size)};
}

/* to += factor × from, of so many numbers. */
static inline void add_row(double *restrict to, double factor, const double *restrict from, int32_t count) {
    for (int32_t i = 0; i < count; ++i) to[i] += factor * from[i];
}

/* A row times vectors, in four lanes. */
static inline hs_vector product(const double *restrict row, const hs_vector *restrict v, int32_t count) {
    hs_vector sum[4] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    int32_t i = 0;
    for (; i + 4 <= count; i += 4)
        for (int lane = 0; lane < 4; ++lane) sum[lane] = hs_plus(sum[lane], row[i + lane], v[i + lane]);
    for (int lane = 0; i < count; ++i, ++lane) sum[lane] = hs_plus(sum[lane], row[i], v[i]);
    return hs_plus(hs_plus(sum[0], 1.0, sum[1]), 1.0, hs_plus(sum[2], 1.0, sum[3]));
}

/* Have so many rings be unknown. */
HS_WIDE static void activate(hs_ring_problem *problem, int32_t active) {
    const double *r = problem->depth;
    double *left = problem->step;
    for (int32_t k = problem->active + 1; k <= active; ++k) {
        double *row = &AT(deflection_of, k, 0);
        /* F D = the matrix that sums slopes up, row by row from its end */
        for (int32_t j = 0; j < k; ++j) left[j] = r[j + 1] - r[j];
        for (int32_t j = k; j >= 1; --j) {
            row[j] = left[j - 1] / AT(traction_of, j, j - 1);
            add_row(left, -row[j], &AT(traction_of, j, 0), j - 1);
        }
        for (int32_t i = 1; i <= k; ++i) AT(matrix, k, i) = 0.0;
        problem->sum[k] = problem->push[k] = 0.0;
        for (int32_t i = 1; i <= k; ++i) {
            double share = problem->mass[k] * row[i];
            add_row(&AT(matrix, i, 1), share, row + 1, i);
            problem->sum[i] += share;
            problem->push[i] += share * problem->share[k];
        }
    }
    for (int32_t i = 1; i <= active; ++i)
        for (int32_t j = 1; j < i; ++j) AT(matrix, j, i) = AT(matrix, i, j);
    problem->active = active;
}

/* Add what more rings are pulled with. */
HS_WIDE static void pull(hs_ring_problem *problem, int32_t active) {
    hs_vector *restrict load = problem->load;
    for (int32_t k = problem->solved + 1; k <= active; ++k) {
        const double *restrict row = &AT(deflection_of, k, 0);
        const double mass = problem->mass[k];
        const hs_vector trial = problem->trial[k];
        load[k].x = load[k].y = 0.0;
        for (int32_t i = 1; i <= k; ++i) load[i] = hs_plus(load[i], mass * row[i], trial);
    }
    problem->solved = active;
}

/* Take what a traction does to the slip of all rings off. */
static inline void take_off(hs_ring_problem *problem, int32_t i, hs_vector traction) {
    const double *restrict row = &AT(matrix, i, 0);
    hs_vector *restrict slip = problem->slip;
    for (int32_t j = 1; j <= problem->active; ++j) {
        slip[j].x -= row[j] * traction.x;
        slip[j].y -= row[j] * traction.y;
    }
}

/* Work the slip of all rings out. */
HS_WIDE static void slide(hs_ring_problem *problem) {
    memcpy(problem->slip + 1, problem->load + 1, (size_t)problem->active * sizeof *problem->slip);
    for (int32_t i = 1; i <= problem->active; ++i) take_off(problem, i, problem->traction[i]);
}

/* Move each traction to where it is best while the others stay; returns the farthest way, over its limit. */
HS_WIDE static double sweep(hs_ring_problem *problem) {
    double farthest = 0.0;
    for (int32_t i = 1; i <= problem->active; ++i) {
        hs_vector before = problem->traction[i], free = hs_plus(before, 1.0 / AT(matrix, i, i), problem->slip[i]);
        hs_vector after = shortened(free, problem->limit[i]), way = hs_plus(after, -1.0, before);
        problem->traction[i] = after;
        take_off(problem, i, way);
        farthest = hs_most(farthest, hs_length(way) / problem->limit[i]);
    }
    return farthest;
}

/* The factor U of a matrix UᵀU of so many rows, of which the upper half is given; whether it is positive definite. */
HS_WIDE static int factorise(double *factor, int64_t stride, int32_t count) {
    for (int32_t k = 0; k < count; ++k) {
        double *row = factor + k * stride;
        if (!(row[k] > 0.0)) return 0;
        double root = sqrt(row[k]);
        for (int32_t j = k; j < count; ++j) row[j] /= root;
        for (int32_t i = k + 1; i < count; ++i) add_row(factor + i * stride + i, -row[i], row + i, count - i);
    }
    return 1;
}

HS_WIDE static void substitute(const double *factor, int64_t stride, int32_t count, double *x) {
    for (int32_t i = 0; i < count; ++i) {
        x[i] /= factor[i * stride + i];
        add_row(x + i + 1, -x[i], factor + i * stride + i + 1, count - i - 1);
    }
    for (int32_t i = count - 1; i >= 0; --i) {
        for (int32_t k = i + 1; k < count; ++k) x[i] -= factor[i * stride + k] * x[k];
        x[i] /= factor[i * stride + i];
    }
}

/* The matrix of Newton's step, factorised: a ring that slips turns, one that sticks goes anywhere. */
HS_WIDE static int linearise(hs_ring_problem *problem) {
    const int64_t stride = 2 * problem->room;
    int32_t count = 0;
    for (int32_t i = 1; i <= problem->active; ++i) {
        hs_vector q = problem->traction[i];
        double limit = problem->limit[i], size = hs_length(q);
        int slips = hs_length(hs_plus(q, 1.0 / AT(matrix, i, i), problem->slip[i])) > limit && size > 0.0;
        hs_vector first = {1.0, 0.0}, second = {0.0, 1.0}, across = {-q.y / size, q.x / size};
        problem->ring[count] = slips ? -i : i;
        problem->basis[count++] = slips ? across : first;
        if (slips) continue;
        problem->ring[count] = i;
        problem->basis[count++] = second;
    }
    for (int32_t a = 0; a < count; ++a) {
        int32_t i = abs(problem->ring[a]);
        for (int32_t b = a; b < count; ++b)
            problem->factor[a * stride + b] = AT(matrix, i, abs(problem->ring[b])) * hs_dot(problem->basis[a], problem->basis[b]);
        if (problem->ring[a] < 0) {
            double limit = problem->limit[i];
            problem->factor[a * stride + a] += hs_most(hs_dot(problem->traction[i], problem->slip[i]), 0.0) / (limit * limit);
        }
    }
    problem->unknowns = factorise(problem->factor, stride, count) ? count : 0;
    return problem->unknowns;
}

static void newton(hs_ring_problem *problem) {
    int32_t count = linearise(problem);
    if (count == 0) return;
    for (int32_t a = 0; a < count; ++a) problem->step[a] = hs_dot(problem->basis[a], problem->slip[abs(problem->ring[a])]);
    substitute(problem->factor, 2 * problem->room, count, problem->step);
    for (int32_t a = 0; a < count; ++a) {
        int32_t i = abs(problem->ring[a]);
        double limit = problem->limit[i], step = problem->step[a];
        if (problem->ring[a] > 0) {
            problem->traction[i] = hs_plus(problem->traction[i], step, problem->basis[a]);
            continue;
        }
        hs_vector turned = hs_plus(problem->traction[i], hs_clamp(step, FARTHEST_TURN * limit), problem->basis[a]);
        double size = hs_length(turned);
        problem->traction[i].x = turned.x * (limit / size);
        problem->traction[i].y = turned.y * (limit / size);
    }
}

/* The innermost ring beyond its limit, 0 where there is none; v is known, tractions from a ring on are worked out. */
HS_WIDE static int32_t innermost_beyond(hs_ring_problem *problem, int32_t from) {
    const double *r = problem->depth;
    const hs_vector *v = problem->found;
    hs_vector *slope = problem->slope;
    int32_t found = 0;
    for (int32_t j = 0; j < problem->rings; ++j) {
        double width = r[j + 1] - r[j];
        slope[j].x = (v[j + 1].x - v[j].x) / width;
        slope[j].y = (v[j + 1].y - v[j].y) / width;
    }
    for (int32_t i = from; i <= problem->rings; ++i) {
        problem->traction[i] = product(&AT(traction_of, i, 0), slope, i);
        if (hs_length(problem->traction[i]) > problem->limit[i] * (1.0 + 1e-12)) found = i;
    }
    return found;
}

/* Compute v of the unknown rings from their tractions. */
HS_WIDE static void deflect(hs_ring_problem *problem) {
    for (int32_t k = 1; k <= problem->active; ++k)
        problem->found[k] = product(&AT(deflection_of, k, 1), problem->traction + 1, k);
}

/* Whether no ring holds a traction that floats could tell from 0. */
static int has_no_friction(const hs_ring_problem *problem) { return problem->limit[problem->rings] < LEAST_LIMIT; }

/* Time that a round takes, about [µs]. */
static int64_t work_of_round(const hs_ring_problem *problem) {
    int64_t active = problem->active;
    return 1 + active * active * active / 400;
}

void hs_ring_solve(hs_ring_problem *problem, hs_vector displacement, hs_watch *watch) {
    const int32_t n = problem->rings;
    const hs_vector none = {0.0, 0.0};
    problem->unknowns = problem->solved = 0;
    problem->trial[0] = none;
    for (int32_t k = 1; k <= n; ++k) problem->trial[k] = hs_plus(problem->base[k], problem->share[k], displacement);
    memcpy(problem->found, problem->trial, (size_t)(n + 1) * sizeof *problem->found);
    if (has_no_friction(problem)) {
        memset(problem->found, 0, (size_t)(n + 1) * sizeof *problem->found);
        return;
    }
    int32_t beyond = innermost_beyond(problem, 1);
    if (beyond == 0) return;
    for (int round = 0; round < MOST_ROUNDS; ++round) {
        if (watch && watch->status == HS_OK) watch->status = hs_count_work(watch->drive, &watch->work, work_of_round(problem));
        if (watch && watch->status != HS_OK) return;
        if (beyond) {
            /* rings that have been unknown stay it, for the sake of their matrix */
            if (beyond > problem->active) activate(problem, beyond);
            for (int32_t i = problem->solved + 1; i <= problem->active; ++i)
                problem->traction[i] = shortened(problem->traction[i], problem->limit[i]);
            pull(problem, problem->active);
        }
        slide(problem);
        int settled = sweep(problem) <= SETTLED;
        if (!settled) newton(problem);
        deflect(problem);
        beyond = innermost_beyond(problem, problem->active + 1);
        if (settled && !beyond) break;
        /* one more ring at once: what slips deeper mostly spreads */
        if (beyond && beyond < n) ++beyond;
    }
}

hs_vector hs_ring_force(const hs_ring_problem *problem) {
    hs_vector force = {0.0, 0.0};
    for (int32_t k = 1; k <= problem->rings; ++k) force = hs_plus(force, problem->mass[k], problem->found[k]);
    return force;
}

void hs_ring_slopes(hs_ring_problem *problem, double slopes[2][2]) {
    double stuck = 0.0;
    for (int32_t k = problem->solved + 1; k <= problem->rings; ++k) stuck += problem->mass[k] * problem->share[k];
    slopes[0][0] = slopes[1][1] = stuck;
    slopes[0][1] = slopes[1][0] = 0.0;
    if (has_no_friction(problem)) slopes[0][0] = slopes[1][1] = 0.0;
    if (problem->solved == 0) return;
    int32_t count = linearise(problem);
    double *x = problem->step;
    for (int axis = 0; axis < 2; ++axis) {
        for (int32_t a = 0; a < count; ++a)
            x[a] = problem->push[abs(problem->ring[a])] * (axis ? problem->basis[a].y : problem->basis[a].x);
        substitute(problem->factor, 2 * problem->room, count, x);
        for (int32_t a = 0; a < count; ++a) {
            double share = problem->sum[abs(problem->ring[a])] * x[a];
            slopes[0][axis] += share * problem->basis[a].x;
            slopes[1][axis] += share * problem->basis[a].y;
        }
    }
}
