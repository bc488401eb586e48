/* Path: the definition of a path in one direction (README.md, a path): targets, segments at the
 * friction limit, and its integration where nothing evolves. */
#ifndef HISTORYSIM_PATH_H
#define HISTORYSIM_PATH_H

#include "ramp.h"

/* Segments of a path between crossings of the friction limit: path fraction of the end, and the
 * limit followed (1, -1, or 0). At most HS_MAX_SEGMENTS; chosen. */
#define HS_MAX_SEGMENTS 64
typedef struct hs_segments {
    int count;
    double end[HS_MAX_SEGMENTS];
    int side[HS_MAX_SEGMENTS];
} hs_segments;
/* Plan of one path, dimensionless: both channels at its beginning and its end. The normal load is
 * linear in the path fraction if both channels are loads, else the approach. */
typedef struct hs_plan {
    int both_loads, normal_by_load, tangential_by_load; /* channels that are controlled by load */
    int ends_separated; /* true if a tangential load ends on a separated contact */
    double approach[2], normal_load[2];
    double request[2];      /* tangential load, which may exceed the friction limit, or drive */
    double displacement[2]; /* linear in between if it is prescribed */
    double times[2];        /* [s] */
    hs_target target;
    hs_segments segments; /* none if the tangential load stays within the friction limit */
    /* Of contacts that evolve, on the present segment: true if displacements are linear between
     * the two values of `segment_displacement`; and the limit at which it ends, 1, -1 or 0. */
    int is_straight, ends_at_limit;
    double segment[2], segment_displacement[2];
    hs_contact *start_contact; /* from which a normal load on the path follows, or NULL */
} hs_plan;
/* Make the targets of a path dimensionless. */
hs_path hs_scale_path(const hs_units *units, const hs_path *path);
/* Set the targets of a path of dimensionless targets from the present state; no segments. */
void hs_set_targets(const hs_line *memory, const hs_path *path, double compliance, int saturate,
                    hs_plan *plan);
/* Plan a path on which nothing evolves; `direct` if no row is recorded within it. Returns
 * HS_BEYOND_LIMIT, with `refusal` filled, if it exceeds the limit and does not `saturate`. */
int hs_plan_path(const hs_line *memory, const hs_path *path, double compliance, int saturate,
                 int direct, hs_plan *plan, hs_refusal *refusal);
/* Integrate a plan between two path fractions; returns a status. */
int hs_follow_plan(hs_line *memory, const hs_plan *plan, double from, double to,
                   const hs_drive *drive);

#endif
