/* Polyline: the exact update of one group's w(a) on one straight path (README.md, theory 7), and its tangential load as a
 * function of the end of the path. */
#ifndef HISTORYSIM_POLYLINE_H
#define HISTORYSIM_POLYLINE_H

#include "losses.h"
#include "single.h"

static inline hs_labels hs_labels_of(const hs_vertex *stack) {
    return HS_MADE(hs_labels){&stack->label, (int64_t)(sizeof *stack / sizeof(double))};
}

/* End of a polyline at an approach, before any slip: its last segment, and the values there. */
typedef struct hs_edge {
    int64_t segment;
    double label, anchor, normal, tangential;
} hs_edge;
hs_edge hs_edge_at(const hs_vertex *stack, int64_t depth, double d, double load);

/* Update of a group on a straight path: solved first, then applied, so that the caller can read the stack as it was before. */
typedef struct hs_update {
    int64_t depth;     /* of the stack before; 1 if the group first touches */
    hs_point to;       /* end of the path */
    double load;       /* P of the group there */
    double force;      /* T of the group there */
    double slope;      /* of the polyline at its new edge */
    double slip_label; /* springs between this label and the edge slip at the end of the path; infinity if all stick */
    hs_edge edge;
    int slips;
    /* if springs slip */
    int64_t kept;        /* vertices below the slip front; 0 if all springs slide */
    double x;            /* rigid·a + compliance·P(a) at the slip front */
    double sign, slip;   /* direction of slip; slip at the front, 0 unless all springs slide */
    int makes_vertex;    /* whether the front is not at the last vertex kept */
    double inner_slope;  /* of the segment on which the front is */
    hs_vertex front;
} hs_update;
/* Solve for the update of a group that touches at approach `d`, where it supports the normal load `load`. The stack has `depth`
 * vertices; if that is 0, its first one is written. */
void hs_solve_update(const hs_group *group, int64_t depth, const hs_point *from, double d, double load, hs_target target,
                     hs_update *update);
/* Write the vertices of an update and add its losses; returns the depth of the stack. */
int64_t hs_apply_update(const hs_group *group, hs_losses *losses, const hs_point *from, const hs_update *update);

/* Direction, 1 or -1, in which the springs of segment j slide; 0 if they stick. */
static inline double hs_sliding_side(const hs_vertex *stack, int64_t depth, int64_t j, double displacement, double friction) {
    double slope = stack[j].slope;
    if (fabs(slope) != friction) return 0.0;
    double side = copysign(1.0, slope), reach = stack[depth - 1].label - stack[j].label;
    double over = side * (displacement - stack[j].anchor) - friction * reach;
    double tie = HS_TIE * (fabs(displacement) + fabs(stack[j].anchor) + friction * reach);
    return fabs(over) <= tie ? side : 0.0;
}
/* Label from which on, up to the edge, springs slide; infinity if the edge sticks. */
static inline double hs_slip_label(const hs_vertex *stack, int64_t depth, double displacement, double friction) {
    return hs_sliding_side(stack, depth, depth - 1, displacement, friction) != 0.0 ? stack[depth - 2].label : HUGE_VAL;
}

/* Whether a polyline is steeper than μ, as a fall of friction leaves it: then several zones may slip at once. */
int hs_is_steep(const hs_vertex *stack, int64_t depth, double friction);
/* Merge vertices of a smooth polyline, as many substeps leave it, and return the depth that is left. Displacement and load of
 * all other vertices stay as they are, and so does the outermost segment. The load of any part of the polyline changes by at
 * most some `limit_tolerance` of its friction limit, and some `variation_tolerance` of its total variation, however often this is
 * called. */
int64_t hs_merge_vertices(const hs_group *group, int64_t depth, double limit_tolerance, double variation_tolerance);
/* Vertices that a clipped polyline of a depth may have. */
static inline int64_t hs_room_to_clip(int64_t depth) { return 3 * depth + 6; }
/* Cone |v| ≤ μ (d - a) at the end of a straight path, and its change on the path: `moved` is the change of displacement, and
 * the limit of spring a grows by rise + gain·(d - a). */
typedef struct hs_cone {
    double friction;
    double moved;
    double rise;
    double gain;
} hs_cone;
/* Move a touching group on a straight path and clip any polyline to a cone; `scratch` has room for twice `hs_room_to_clip`.
 * Losses may be NULL. Returns the depth of the polyline in `scratch`; adds dT/dV to its stiffness unless that is NULL. */
int64_t hs_move_and_clip(const hs_group *group, hs_losses *losses, int64_t depth, hs_point from, hs_point to,
                          double load, const hs_cone *cone, hs_vertex *scratch, double *stiffness);

/* Slip fronts of groups of one asperity, cached. While the front of a group stays on one segment of its polyline, it is linear in
 * the end (d, V) of the path: between label a_j, where the anchor is w_j, and the next vertex the slope is m, on the side
 * s of slip it is sμ, so that
 *
 *     a = a_j + ((V - w_j) - sμ (d - a_j)) / (m - sμ),    T = T_j - m P(a_j) + sμ P(d) + (m - sμ) P(a)
 *
 * which also holds while the whole group slides, where a is below its gap and P(a) is 0. So several groups are summed at a
 * time, without a search along each polyline. One array a quantity. */
typedef struct hs_fronts {
    int64_t groups;
    double *memory; /* block of all arrays */
    double *cone;   /* sμ */
    double *below, *anchor; /* label and anchor of the vertex below the front */
    double *jump, *rate;    /* m - sμ, and its reciprocal */
    double *force;          /* tangential load less m P of that vertex */
    double *low, *high;     /* labels between which this holds */
    double *gap, *weight;   /* of the one asperity */
    double *off;            /* whether the front was found to be off the segment */
} hs_fronts;
/* stands for 1/0 in sums of several groups, which have no branches */
#define HS_STEEPEST 1e100

/* Tangential load at the end of a path, with its first and second derivative in V. */
typedef struct hs_force {
    double force, stiffness, curvature;
} hs_force;

/* Cache the first segment on which slip of a sign may end, as it does on short paths: the outermost, or, if that is on the
 * cone of this side already, the one below. */
void hs_guess_front(hs_fronts *fronts, int64_t index, const hs_group *group, int64_t depth, double sign);
/* Tangential load at the end of a straight path; the state is not changed. If its slip front can be cached, that is done
 * instead, and the result is 0: the cache then gives the load. */
hs_force hs_force_of_group(const hs_group *group, int64_t depth, hs_point from, hs_point to, double load,
                           hs_fronts *fronts, int64_t index);

#endif
