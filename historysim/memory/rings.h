/* Rings: asperities that share one polyline of vectors, and move in two directions; see "Two directions" in README.md. */
#ifndef HISTORYSIM_RINGS_H
#define HISTORYSIM_RINGS_H

#include "drive.h"
#include "normal.h"

/* A node of the polyline v(a), the tangential deflection of the springs that first touched at approach `label`. */
typedef struct hs_node {
    double label;
    double normal;   /* P there, of the class */
    double integral; /* ∫P da up to there */
    hs_vector deflection;
} hs_node;

/* A product of deflection and slip, by label. */
typedef struct hs_held {
    double label;
    double product;
} hs_held;

/* A class of asperities: those of one coefficient whose gaps lie close together. The first node is the edge, the last one the
 * deepest spring of all, which touched at the smallest gap. */
typedef struct hs_class {
    hs_curve curve;
    int64_t start; /* position of its first asperity */
    int64_t group;
    int32_t count; /* nodes; 0 where nothing touches */
    int32_t room;
    hs_node *nodes;
    double lost;        /* energy that its springs dissipated in the last step */
    int32_t slid;       /* labels between which they slid */
    hs_held *held;      /* what they held times how far they slid, linear in between; room for `room` of it */
    struct hs_ring_problem *problem; /* place to work in, which copies do not share; NULL until it is needed */
} hs_class;

/* ½ Σ M |v - v*|² over the nodes of one class, to be made least where |Q| ≤ g on every ring; all of it has room for
 * `room` rings, counted from 1 at the edge. */
typedef struct hs_ring_problem {
    int32_t room;
    int32_t rings;
    int32_t active;      /* rings from the edge inward that the matrices are of */
    int32_t solved;      /* that are unknown: all of these, or none; below them v = v* */
    double *label;       /* of the nodes, the edge first */
    double *normal;      /* P there */
    double *integral;    /* ∫P da up to there */
    double *share;       /* of a displacement of the contact that moves the springs: less where they touch on the way */
    double *depth;       /* r, below the edge */
    double *traction_of; /* (ring, interval) D: Q = D m, with the slopes m of v */
    double *deflection_of; /* (ring, ring) F: v = F Q */
    double *mass;        /* M: the tangential load is Σ M v */
    double *limit;       /* g */
    double *matrix;      /* A = Fᵀ M F of the active rings */
    double *sum;         /* Fᵀ M 1 */
    double *push;        /* Fᵀ M times the shares */
    double *factor;      /* Cholesky factor of Newton's step */
    double *step;
    hs_vector *slipped;  /* (node) what slid in the first stage of a step */
    hs_vector *base;     /* v* but for what the displacement adds */
    hs_vector *trial;    /* v* */
    hs_vector *load;     /* Fᵀ M v* */
    hs_vector *traction; /* Q */
    hs_vector *slip;     /* y = Fᵀ M (v* - v) */
    hs_vector *found;    /* v */
    hs_vector *slope;    /* of v, towards the deeper node */
    hs_vector *basis;    /* directions in which the unknowns of Newton's step go */
    int32_t *ring;       /* whose they are */
    int32_t unknowns;    /* of the last factor; 0 where nothing slips */
    hs_normal edge[3];   /* at the start of a step, its first stage and its end; of the approach that does not change, the slope alone */
    hs_vector relieved[2]; /* load of the springs if all stuck, less their load, at the first stage and at the end */
} hs_ring_problem;

static inline hs_vector hs_plus(hs_vector a, double scale, hs_vector b) {
    return HS_MADE(hs_vector){a.x + scale * b.x, a.y + scale * b.y};
}
/* A share of the way from one to another; the other itself at the end. */
static inline hs_vector hs_between(hs_vector from, hs_vector to, double share) {
    return share == 1.0 ? to : hs_plus(from, share, hs_plus(to, -1.0, from));
}
static inline double hs_dot(hs_vector a, hs_vector b) { return a.x * b.x + a.y * b.y; }
static inline double hs_length(hs_vector a) { return sqrt(hs_dot(a, a)); }

/* Whether the caller still wants a result: work since the last look, and HS_INTERRUPTED once it does not. */
typedef struct hs_watch {
    const hs_drive *drive;
    int64_t work;
    int status;
} hs_watch;

/* All classes of a contact, and where it is. */
typedef struct hs_body {
    hs_contact *contact;    /* of the line, which outlives it */
    const double *friction; /* (group) of the line */
    const double *first_friction; /* (group) at the beginning of a path on which it changes; NULL of others */
    double fraction;        /* of the path, at which the body is */
    int64_t rings;
    double tolerance;
    double approach, normal_load, dissipated, time;
    hs_vector displacement, tangential_load;
    double curved;            /* energy of the last step that rests on the curvature of its slip */
    double slid_load, uneven; /* tangential load that has slid in the last step, and by which its two stages slid differently */
    double *each;  /* (count) energy that each asperity has dissipated, by its position; NULL of steps that are tried */
    int64_t classes;
    hs_class *parts;
    double *slide_time; /* (count) when asperities have first slid as a whole since the first turn [s], by position; or NaN */
    int slid;           /* whether some have that the line does not know of */
    double *scratch;    /* (count) */
    hs_watch *watch;    /* of the present walk, which copies share; NULL where nobody may stop it */
} hs_body;

/* Have a class its problem, with room for so many rings; returns a status. */
int hs_ring_room(hs_class *rings, int32_t room);
/* Fill in what follows from where the rings are and which loads they carry: labels and loads of so many nodes. */
void hs_ring_nodes(hs_ring_problem *problem, int32_t count, double friction);
/* Set the limits of the rings of such nodes. */
void hs_ring_limits(hs_ring_problem *problem, double friction);
/* Find v where the contact is displaced. */
void hs_ring_solve(hs_ring_problem *problem, hs_vector displacement, hs_watch *watch);
/* Σ M v, and its slopes in the displacement: of component by component. */
hs_vector hs_ring_force(const hs_ring_problem *problem);
void hs_ring_slopes(hs_ring_problem *problem, double slopes[2][2]);
/* Q of a node of a polyline; the edge, which is the first, has none. */
hs_vector hs_ring_traction(const hs_node *nodes, int32_t i);

static inline double hs_deepest_of(const hs_class *part) { return part->curve.gap[0]; }
/* Friction coefficient of a group at a fraction of the path. */
static inline double hs_coefficient(const hs_body *body, int64_t group, double fraction) {
    if (!body->first_friction) return body->friction[group];
    return hs_toward(body->first_friction[group], body->friction[group], fraction);
}

/* ---- plane_path.c ---- */

/* Target of the tangential channel: rigid V + compliance T = value, component by component. A load has rigid = 0, compliance = 1,
 * the displacement of a drive has rigid = 1. */
typedef struct hs_plane_aim {
    hs_vector value, rigid, compliance;
} hs_plane_aim;
/* Where a path leads at a fraction of it. */
typedef struct hs_plane_target {
    int by_loads; /* whether both loads go straight, otherwise the approach does */
    double fraction, approach, normal_load, time;
    hs_plane_aim aim;
} hs_plane_target;
/* A path: what is requested at its beginning and at its end. */
typedef struct hs_plane_path {
    int by_loads, saturate;
    double approach[2], normal_load[2], time[2];
    hs_vector value[2], rigid, compliance; /* of aims */
    /* what follows is filled in where a body travels */
    double margin;     /* part of the friction limit that is left to loads beyond it */
    double lift_off;   /* fraction at which the last spring lifts off; infinite if none does */
    int segments_left; /* that may be cut at the friction limit; 0 of paths that do not meet it */
    int is_beyond;     /* whether the next segment is beyond the friction limit */
    int is_held;       /* whether the displacement stays on the present segment, beyond the limit; and where */
    hs_vector held;
} hs_plane_path;
/* Target at a fraction; loads beyond the friction limit are projected onto it. */
hs_plane_target hs_target_at(const hs_body *body, const hs_plane_path *path, double fraction);
/* Friction limit at an approach, and at a fraction of the path. */
double hs_body_limit(const hs_body *body, double approach, double fraction);
/* True if loads exceed the friction limit, which are returned with it. */
int hs_exceeds_limit(const hs_body *body, const hs_plane_path *path, double *request, double *limit);
/* Load that a path requests beyond the friction limit from a body that is at a fraction of it. */
hs_vector hs_excess_at(const hs_body *body, const hs_plane_path *path, double fraction);
/* Begin to cut a path into segments, from the state at its beginning. */
void hs_begin_segments(const hs_body *body, hs_plane_path *path);
/* Fraction at which the segment ends that begins where a body is; whether its loads are straight. */
double hs_next_cut(const hs_body *body, hs_plane_path *path, int *is_straight);

/* ---- classes.c ---- */

/* A body where a line is, without classes yet. */
hs_body *hs_body_new(const hs_line *line, int64_t rings, double tolerance);
hs_body *hs_body_copy(const hs_body *body);
void hs_body_free(hs_body *body);
int hs_class_room(hs_class *part, int64_t count);
hs_node hs_node_at(const hs_class *part, double label, hs_vector deflection);
/* Elastic energy of the springs of a class. */
double hs_class_stored(const hs_class *part);
/* Label down to which the springs of a class slip from the edge on: -HUGE_VAL where all do, HUGE_VAL where none does. */
double hs_class_front(const hs_body *body, const hs_class *part);
/* Fractions of a path at which its state is read; they do not change the state at its end. */
typedef struct hs_stops {
    double next;  /* the next fraction, below `until`; infinite if none is left */
    double until; /* at which the path is left */
    /* Read a body that is there, and advance `next`; returns a status. */
    int (*visit)(struct hs_stops *stops, hs_body *there);
} hs_stops;
/* Move a body along a path, in steps that are halved until they settle. */
int hs_body_travel(hs_body *body, hs_plane_path *path, hs_stops *stops);
/* dT/dV when the displacement goes on in a direction; (0, 0): of springs that stick. */
int hs_body_slopes(hs_body *body, hs_vector direction, double slopes[2][2]);

#endif
