/* Displacement: loads and friction limit of all groups, and their common displacement at a
 * tangential target. */
#ifndef HISTORYSIM_DISPLACEMENT_H
#define HISTORYSIM_DISPLACEMENT_H

#include "polyline.h"

/* Allocate an empty table of slip fronts; returns a status. */
int hs_init_fronts(hs_fronts *fronts, int64_t groups);
void hs_free_fronts(hs_fronts *fronts);

/* Normal loads of the groups in contact at an approach: groups 0 to count - 1, by ascending gap. */
typedef struct hs_group_loads {
    int64_t count;
    double *load;
    const double
        *from; /* approaches at the start of their paths; NULL: the approach of the memory */
    double single_load[1]; /* storage for the load of a single group */
} hs_group_loads;
int hs_loads_of_groups(const hs_line *memory, double d, double load, hs_group_loads *loads);
void hs_free_group_loads(hs_group_loads *loads);

/* Friction limit at an approach, and derivatives of limit and normal load with respect to the
 * approach. */
typedef struct hs_limit {
    double limit, limit_slope, load_slope;
} hs_limit;
hs_limit hs_limit_and_slopes(const hs_line *memory, double d);
/* Friction limit Σ μ P at approach d, with normal load `load`. */
double hs_friction_limit(const hs_line *memory, double d, double load);
/* Smallest and largest coefficient of the groups in contact at an approach, which may be HUGE_VAL.
 */
typedef struct hs_range {
    double min, max;
} hs_range;
hs_range hs_friction_range(const hs_line *memory, double d);
/* Approach at a normal load; equal to a label of the polyline if they tie. */
double hs_approach_at_load(const hs_line *memory, double load);

/* Tangential load at the end of a straight path, with derivatives with respect to V; caches slip
 * fronts. Returns a status. */
int hs_force_at(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, hs_point to,
                hs_force *result);
/* Tangential load on a straight path, at approach d and displacement v. */
int hs_force_on_path(hs_line *memory, hs_fronts *fronts, double d, double v, double *force);
/* Solve for the displacement at which a straight path to approach d reaches its target; returns a
 * status. */
int hs_solve_displacement(hs_line *memory, double d, double load, hs_target target,
                          double *displacement);
/* `hs_solve_displacement` with the loads of groups at d and a table of slip fronts. */
int hs_solve_displacement_with(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts,
                               double d, hs_target target, double *displacement);
/* Displacement at approach `point->d` for a tangential load, from a guess in `point->v` and up to
 * an accuracy; NaN if it does not converge. */
int hs_refine_displacement(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts,
                           double force, double accuracy, hs_point *point);
/* `hs_solve_displacement_with` for groups in contact at d, also if the present state meets the
 * target. */
int hs_search_displacement(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts,
                           double d, hs_target target, double *displacement);

#endif
