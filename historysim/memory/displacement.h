/* Displacement: what all groups support together, and the displacement that they share at a tangential load. */
#ifndef HISTORYSIM_DISPLACEMENT_H
#define HISTORYSIM_DISPLACEMENT_H

#include "polyline.h"

/* Make a table of slip fronts without entries. */
int hs_init_fronts(hs_fronts *fronts, int64_t groups);
void hs_free_fronts(hs_fronts *fronts);

/* Normal loads of the groups that touch at an approach, which are the first ones. */
typedef struct hs_group_loads {
    int64_t count;
    double *load;
    const double *from; /* approaches at which their paths begin; NULL if that is the approach of the memory */
    double one[1];      /* storage for the load of a single group */
} hs_group_loads;
int hs_loads_of_groups(const hs_line *memory, double d, double load, hs_group_loads *loads);
void hs_free_group_loads(hs_group_loads *loads);

/* Friction limit at an approach, and the slopes in the approach of the limit and of the normal load. */
typedef struct hs_limit {
    double limit, limit_slope, load_slope;
} hs_limit;
hs_limit hs_limit_and_slopes(const hs_line *memory, double d);
/* Σ μ P(a) at an approach, at which the normal load is `load`. */
double hs_friction_limit(const hs_line *memory, double d, double load);
/* Least and largest coefficient of the groups that touch at an approach, which may be HUGE_VAL. */
typedef struct hs_range {
    double least, most;
} hs_range;
hs_range hs_friction_range(const hs_line *memory, double d);
/* Approach at a normal load; exactly a label of the polyline if they tie. */
double hs_approach_at_load(const hs_line *memory, double load);

/* Tangential load at the end of a straight path, with its derivatives; slip fronts are cached. */
int hs_force_at(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, hs_point to, hs_force *found);
/* Tangential load on a straight path, at approach d and displacement v. */
int hs_force_on_path(hs_line *memory, hs_fronts *fronts, double d, double v, double *force);
/* Displacement at which a straight path to approach d reaches its target. */
int hs_solve_displacement(hs_line *memory, double d, double load, hs_target target, double *found);
/* The same with the groups' loads at d, and with slip fronts, which are cached. */
int hs_solve_displacement_with(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, double d, hs_target target, double *found);
/* The same for groups that touch at d, also if the present state meets the target already. */
int hs_search_displacement(hs_line *memory, const hs_group_loads *loads, hs_fronts *fronts, double d, hs_target target, double *found);

#endif
