/* Rings: state and problem of a contact that moves in two tangential directions. Asperities of one
 * class share a polyline of tangential deflections v(a); Coulomb's law |Q| ≤ μ √(d - a) holds on
 * its rings (README.md, two directions). */
#ifndef HISTORYSIM_RINGS_H
#define HISTORYSIM_RINGS_H

#include "drive.h"
#include "normal.h"
#include "path.h"

/* A node of the polyline v(a), the tangential deflection of the springs that first touched at
 * approach `label`. */
typedef struct hs_node {
    double label;
    double normal;   /* normal load P of the class at an approach of `label` */
    double integral; /* ∫P da up to `label` */
    hs_vector deflection;
} hs_node;

/* Node of the density of dissipation of a class on a step: deflection times slip, linear between
 * labels. */
typedef struct hs_loss_node {
    double label;
    double product;
} hs_loss_node;

/* A class: asperities of one friction coefficient with similar gaps. Node 0 is the edge of contact,
 * the innermost node the deepest spring, which touched at the smallest gap. */
typedef struct hs_ring_class {
    hs_curve curve;
    int64_t offset; /* position in the contact of the asperity with the smallest gap of the class */
    int64_t group;
    int32_t node_count; /* 0 without contact */
    int32_t capacity;   /* of `nodes` and of `loss_nodes` */
    hs_node *nodes;
    double loss;             /* energy dissipated in the latest step */
    int32_t loss_node_count; /* of that step */
    hs_loss_node *loss_nodes;
    struct hs_ring_problem
        *problem; /* workspace, not shared with copies; NULL until it is needed */
} hs_ring_class;

/* Problem of one class on a step: minimise ½ Σ M |v - v*|² subject to |Q| ≤ g on every ring. Arrays
 * have `capacity` rings, counted from 1 at the edge, which is node 0. */
typedef struct hs_ring_problem {
    int32_t capacity;
    int32_t ring_count;
    int32_t row_count;       /* rows of F that are known */
    int32_t hessian_count;   /* rings of A: the active ones of the latest solution on these nodes */
    int32_t active_count;    /* rings with unknown tractions; v = v* inside them */
    int32_t wanted_count;    /* rings that the following iteration makes active */
    double *label;           /* (node) */
    double *normal;          /* (node) normal load P at the label */
    double *integral;        /* (node) ∫P da up to the label */
    double *moved_fraction;  /* (node) fraction of a displacement that deflects the spring: below 1
                                if it touches meanwhile */
    double *depth;           /* (node) r, below the edge */
    double *traction_matrix; /* (ring, interval) D: Q = D m, with the slopes m of v */
    double *deflection_matrix; /* (ring, ring) F: v = F Q */
    double *stiffness;         /* (ring) M: the tangential load is Σ M v */
    double *limit;             /* (ring) g */
    double *unit_traction;     /* (ring) Q of v* = `moved_fraction`, per displacement */
    double *hessian;           /* (ring, ring) A = Fᵀ M F of the active rings */
    double *load_gradient; /* (ring) Fᵀ M 1, derivative of the tangential load with respect to Q */
    double *displacement_gradient; /* (ring) Fᵀ M times `moved_fraction`, derivative of the linear
                                      term */
    double *cholesky_factor;       /* of the matrix of the Newton step */
    double *newton_step;
    hs_vector displacement;   /* of the latest solution */
    hs_vector *stage_slip;    /* (node) slip v* - v in the first stage of a step */
    hs_vector *trial_at_rest; /* (node) v* at zero displacement */
    hs_vector *trial;         /* (node) v* */
    hs_vector *rest_traction; /* (ring) Q of v* at zero displacement */
    hs_vector *linear_term;   /* (ring) Fᵀ M v* */
    hs_vector *traction;      /* (ring) Q */
    hs_vector *slip;       /* (ring) y = Fᵀ M (v* - v), the negative gradient with respect to Q */
    hs_vector *deflection; /* (node) v */
    hs_vector *slope;      /* (interval) m, of v towards the deeper node */
    hs_vector *basis;      /* (unknown) direction of each unknown of the Newton step */
    int32_t *basis_ring;   /* (unknown) its ring; negative if the ring slips */
    int32_t unknown_count; /* of the latest factorisation; 0 if it has failed */
    /* Normal loads at the start of a step, at its first stage and at its end; zero at constant
     * approach. */
    hs_normal edge[3];
    hs_vector relieved_load[2]; /* load if all springs stuck, minus the load, at the first stage and
                                   at the end */
} hs_ring_problem;

/* Cancellation by the caller: it is polled as work is counted; `status` becomes HS_INTERRUPTED. */
typedef struct hs_watch {
    const hs_drive *drive;
    int64_t work_since_poll;
    int status;
} hs_watch;

/* State of a contact in two directions: its classes, displacements and loads. */
typedef struct hs_body {
    hs_contact *contact;            /* of the line, which outlives it */
    const double *friction;         /* (group) of the line */
    const double *initial_friction; /* (group) at fraction 0 of a path on which friction changes;
                                       otherwise NULL */
    double fraction;                /* path fraction of this state */
    int64_t rings_per_class;
    double tolerance;
    double approach, normal_load, dissipated, time;
    hs_vector displacement, tangential_load;
    hs_vector displacement_rate; /* mean change on the latest step over that of the path fraction */
    double curvature_energy;     /* energy of the latest step that results from the curvature of its
                                    slip */
    double slid_load;            /* tangential load relieved by slip in the latest step */
    double uneven_load;    /* difference of that load from an extrapolation of the first stage */
    double *asperity_loss; /* (position) energy dissipated by each asperity; NULL in a trial step */
    int64_t class_count;
    hs_ring_class *classes;
    /* (position) time at which each asperity first slid as a whole since the first turn [s]; NaN if
     * it has not */
    double *slide_time;
    int has_new_slide_times; /* true if the line does not have all of them */
    double *scratch;         /* (position) */
    hs_watch *watch; /* of the present path, shared with copies; NULL if it cannot be cancelled */
} hs_body;

/* Reserve a problem of `ring_count` rings; returns a status. */
int hs_reserve_rings(hs_ring_class *ring_class, int32_t ring_count);
/* Compute depths, stiffnesses and D from the labels and normal loads of the nodes; no ring is
 * active. */
void hs_set_ring_nodes(hs_ring_problem *problem, int32_t node_count);
/* Compute the friction limits of the rings, and tractions from `trial_at_rest`, `moved_fraction`.
 */
void hs_set_ring_tractions(hs_ring_problem *problem, double friction);
/* Solve the problem at a displacement from the start of the step by iterations from the tractions
 * of the active rings, each a sweep and a Newton step. True if they have converged. `watch` may be
 * NULL. */
int hs_solve_rings(hs_ring_problem *problem, hs_vector displacement, int max_iterations,
                   hs_watch *watch);
/* Tangential load Σ M v, and its derivatives with respect to the displacement: stiffness[i][j] =
 * dT_i/dV_j. */
hs_vector hs_ring_load(const hs_ring_problem *problem);
void hs_ring_stiffness(hs_ring_problem *problem, double stiffness[2][2]);
/* Traction Q at node `i` of a polyline; zero at the edge, node 0. */
hs_vector hs_ring_traction(const hs_node *nodes, int32_t i);

static inline double hs_deepest_label(const hs_ring_class *ring_class) {
    return ring_class->curve.gap[0];
}
/* Friction coefficient of a group at a path fraction. */
static inline double hs_friction_at(const hs_body *body, int64_t group, double fraction) {
    if (!body->initial_friction) return body->friction[group];
    return hs_toward(body->initial_friction[group], body->friction[group], fraction);
}

/* ---- cells.c ---- */

/* New body at the state of a line, without classes; NULL if out of memory. */
hs_body *hs_body_new(const hs_line *line, int64_t rings_per_class, double tolerance);
hs_body *hs_body_copy(const hs_body *body);
void hs_body_free(hs_body *body);
/* Reserve nodes of a class; returns a status. */
int hs_reserve_nodes(hs_ring_class *ring_class, int64_t node_count);
hs_node hs_node_at(const hs_ring_class *ring_class, double label, hs_vector deflection);
/* Copy state and nodes to a body with the same classes, without data of asperities; returns a
 * status. */
int hs_assign_body(hs_body *target, const hs_body *source);
/* Copy a body for a trial step, without data of asperities; NULL if out of memory. */
hs_body *hs_copy_for_trial(const hs_body *body);
/* Split wide cells and merge narrow ones, with an error of at most `merge_error` of the friction
 * limit. The error is increased up to MAX_MERGE_ERROR while there are too many nodes: a larger one
 * would not decrease with the length of steps. Returns a status. */
int hs_regrid(hs_ring_class *ring_class, int64_t rings_per_class, double friction,
              double merge_error);
/* Split cells in which slip begins on a displacement increment, without effect on v. Cells at the
 * slip front then are as small as its distance from the edge, so that small turns are resolved.
 * Returns a status. */
int hs_refine_front(hs_ring_class *ring_class, double friction, hs_vector increment);
/* Add nodes that touch as the approach grows, and reserve the problem; returns a status. */
int hs_add_touching_nodes(hs_ring_class *ring_class, double from, double to,
                          int64_t rings_per_class);
/* ½ ∫ |v|² P'' da between two nodes, without boundary terms that cancel in the sum over intervals.
 */
double hs_interval_energy(const hs_node *outer, const hs_node *inner);
/* Elastic energy of the springs of a class. */
double hs_class_elastic_energy(const hs_ring_class *ring_class);
/* Label to which slip extends from the edge inward: -HUGE_VAL if all springs slip, HUGE_VAL if none
 * does. */
double hs_slip_front(const hs_body *body, const hs_ring_class *ring_class);
/* Largest error of the tangential load by merging cells, over the friction limit; chosen. */
#define MAX_MERGE_ERROR 1e-5
static const hs_vector zero_vector = {0.0, 0.0};

/* ---- plane_path.c ---- */

/* Target of the tangential channel: rigid V + compliance T = value, component by component. A load
 * has rigid = 0, compliance = 1, the displacement of a drive has rigid = 1. */
typedef struct hs_tangential_target {
    hs_vector value, rigid, compliance;
} hs_tangential_target;
/* Targets of a path at one fraction of it. */
typedef struct hs_plane_target {
    double fraction, approach, normal_load, time;
    hs_tangential_target tangential;
} hs_plane_target;
/* A path in a plane: its plan, and tangential targets at its fractions 0 and 1. */
typedef struct hs_plane_path {
    const hs_line *line; /* contact and friction, at fraction 0 */
    hs_plan plan;        /* requests of the components that are loads, 0 of others */
    int saturate;
    hs_vector value[2], rigid, compliance; /* as in hs_tangential_target */
    /* Set by hs_begin_segments and hs_next_cut: */
    double lift_off; /* path fraction at which the contact separates; infinite if it does not */
    int segment;     /* of the plan, present or following one */
    int holds_displacement; /* true if the displacement is constant on the present segment, which is
                               beyond the limit */
    hs_vector held_displacement;
} hs_plane_path;
/* Set the tangential targets of a path at its fraction 0 or 1. */
void hs_set_request(hs_plane_path *path, int end, hs_vector value);
/* Targets at a path fraction; loads beyond the friction limit are projected onto it. */
hs_plane_target hs_target_at(const hs_plane_path *path, double fraction);
/* Friction limit of the state of a body. */
double hs_body_limit(const hs_body *body, const hs_plane_path *path);
/* Requested load minus the load of a body; 0 within the friction limit. */
hs_vector hs_excess_of(const hs_body *body, const hs_plane_path *path);
/* Prepare the segments of a path that starts at the state of the body. */
void hs_begin_segments(const hs_body *body, hs_plane_path *path);
/* Path fraction at which the segment ends that starts at the state of the body; `is_straight`: true
 * if its loads are straight. */
double hs_next_cut(const hs_body *body, hs_plane_path *path, int *is_straight);

/* ---- classes.c ---- */

/* Path fractions at which the state is read; they do not change the state at the end of the path.
 */
typedef struct hs_stops {
    double next_fraction; /* below `stop_fraction`; infinite if no more states are read */
    double stop_fraction; /* at which the path is abandoned */
    /* Read the state at `next_fraction` and advance it; returns a status. */
    int (*visit)(struct hs_stops *stops, hs_body *body);
} hs_stops;
/* Move a body along a path, in steps as long as the tolerance permits; returns a status. `stops`
 * may be NULL. */
int hs_body_integrate(hs_body *body, hs_plane_path *path, hs_stops *stops);
/* Move a body along a whole path if its approach grows and no spring slips: exactly, with nothing
 * solved. Returns a status; `sticks` false if springs may slip, and the body is unchanged. */
int hs_body_stick(hs_body *body, hs_plane_path *path, int *sticks);
/* Tangential stiffness dT/dV if the displacement continues in a direction; (0, 0): stiffness of
 * sticking springs. */
int hs_body_stiffness(hs_body *body, hs_vector direction, double stiffness[2][2]);

#endif
