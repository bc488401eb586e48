/* Integrate: one path, planned and integrated. */
#ifndef HISTORYSIM_INTEGRATE_H
#define HISTORYSIM_INTEGRATE_H

#include "limit.h"

/* A planned path: its request, and how it is followed. */
typedef struct hs_plan {
    hs_request request;
    hs_target target;
    hs_pieces pieces; /* none if the tangential load stays within the friction limit */
    double times[2]; /* at which it begins and ends [s] */
    double v[2];    /* displacements at its ends; linear in between */
    int ends_separated; /* whether a tangential load ends where nothing touches */
} hs_plan;
hs_path hs_scale_path(const hs_units *units, const hs_path *path);
/* End of a path: approach, normal load, and the tangential target, which is `request` at its end. */
void hs_path_end(const hs_line *memory, const hs_path *path, double compliance, double request, double *d,
                    double *load, hs_target *target);
/* Plan a path, whose targets are dimensionless here, as is the compliance. It is `direct` if nothing is recorded on the way. */
int hs_plan_path(hs_line *memory, const hs_path *path, double compliance, int saturate, int direct, hs_plan *plan,
               hs_refusal *refusal);
int hs_integrate_part(hs_line *memory, const hs_plan *plan, double before, double share, const hs_drive *drive);

#endif
