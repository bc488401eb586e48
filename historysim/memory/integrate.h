/* Integrate: plan of one path, and its integration between two path fractions. */
#ifndef HISTORYSIM_INTEGRATE_H
#define HISTORYSIM_INTEGRATE_H

#include "limit.h"

/* Planned path: its request, its target, and the segments between crossings of the friction limit.
 */
typedef struct hs_plan {
    hs_request request;
    hs_target target;
    hs_pieces pieces;   /* none if the tangential load stays within the friction limit */
    double times[2];    /* at both ends of the path [s] */
    double v[2];        /* displacements at both ends; linear in between */
    int ends_separated; /* true if a tangential load ends on a separated contact */
} hs_plan;
/* Make the targets of a path dimensionless. */
hs_path hs_scale_path(const hs_units *units, const hs_path *path);
/* Compute approach, normal load and tangential target at the end of a path; `request` is the
 * requested load at its start. */
void hs_path_targets(const hs_line *memory, const hs_path *path, double compliance, double request,
                     double *d, double *load, hs_target *target);
/* Plan a path of dimensionless targets and compliance; `direct` if no row is recorded within it.
 * Returns a status. */
int hs_plan_path(hs_line *memory, const hs_path *path, double compliance, int saturate, int direct,
                 hs_plan *plan, hs_refusal *refusal);
/* Integrate a plan between two path fractions; returns a status. */
int hs_follow_plan(hs_line *memory, const hs_plan *plan, double from, double to,
                   const hs_drive *drive);

#endif
