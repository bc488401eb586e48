/* Path: the definition of a path (README.md, a path): targets and segments at the friction limit in
 * one direction and in a plane, and its integration in one direction where nothing evolves. */
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
/* Plan of one path, dimensionless: its channels at its beginning and its end. The normal load is
 * linear in the path fraction if all channels are loads, else the approach. */
typedef struct hs_plan {
    int is_planar; /* true if loads have two components and follow the request at every fraction */
    int both_loads, normal_by_load, tangential_by_load; /* channels that are controlled by load */
    int ends_separated; /* true if a tangential load ends on a separated contact */
    double approach[2], normal_load[2];
    double request[2];   /* tangential load, which may exceed the friction limit, or drive */
    double request_y[2]; /* of a path in a plane, whose requests here are loads */
    double margin;       /* fraction of the friction limit by which loads beyond it are below it */
    double limit_drop;   /* fall of the friction limit by falls of friction on the path */
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
/* a + factor b. */
static inline hs_vector hs_add_scaled(hs_vector a, double factor, hs_vector b) {
    return HS_MADE(hs_vector){a.x + factor * b.x, a.y + factor * b.y};
}
/* Linear interpolation; exactly `to` at fraction 1. */
static inline hs_vector hs_vector_lerp(hs_vector from, hs_vector to, double fraction) {
    return fraction == 1.0 ? to : hs_add_scaled(from, fraction, hs_add_scaled(to, -1.0, from));
}
static inline double hs_dot(hs_vector a, hs_vector b) { return a.x * b.x + a.y * b.y; }
static inline double hs_norm(hs_vector a) { return sqrt(hs_dot(a, a)); }
/* Make the targets of a path dimensionless. */
hs_path hs_scale_path(const hs_units *units, const hs_path *path);
/* Set the targets of a path of dimensionless targets from the present state; no segments. */
void hs_set_targets(const hs_line *memory, const hs_path *path, double compliance, int saturate,
                    hs_plan *plan);
/* Set the targets of the normal channel of a plan whose types of control are set, and its times. */
void hs_set_normal_targets(const hs_line *memory, const hs_path *path, hs_plan *plan);
/* Approach and normal load at a path fraction. */
void hs_channels_at(const hs_line *memory, const hs_plan *plan, double fraction, double *d,
                    double *load);
/* Friction limit at a path fraction, an approach and its normal load. */
double hs_limit_on(const hs_line *memory, const hs_plan *plan, double fraction, double d,
                   double load);
/* Requested tangential load at a path fraction. */
hs_vector hs_request_at(const hs_plan *plan, double fraction);
/* Cut a plan at crossings of the friction limit. Returns HS_BEYOND_LIMIT, with `refusal` filled, if
 * the request exceeds the limit and does not `saturate`. */
int hs_cut_at_limit(const hs_line *memory, hs_plan *plan, int saturate, hs_refusal *refusal);
/* Plan a path on which nothing evolves; `direct` if no row is recorded within it. Returns
 * HS_BEYOND_LIMIT, with `refusal` filled, if it exceeds the limit and does not `saturate`. */
int hs_plan_path(const hs_line *memory, const hs_path *path, double compliance, int saturate,
                 int direct, hs_plan *plan, hs_refusal *refusal);
/* Integrate a plan between two path fractions; returns a status. */
int hs_follow_plan(hs_line *memory, const hs_plan *plan, double from, double to,
                   const hs_drive *drive);

#endif
