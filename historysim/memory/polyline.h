/* Polyline: exact update of the history w(a) of one group on a straight path (README.md, theory 7),
 * and its tangential load as a function of the end of the path. */
#ifndef HISTORYSIM_POLYLINE_H
#define HISTORYSIM_POLYLINE_H

#include "losses.h"
#include "single.h"

static inline hs_labels hs_labels_of(const hs_vertex *stack) {
    return HS_MADE(hs_labels){&stack->label, (int64_t)(sizeof *stack / sizeof(double)), 1.0, 0.0};
}

/* Edge of a polyline at an approach, before slip: index of its outermost segment, and the values at
 * the edge. */
typedef struct hs_edge {
    int64_t segment;
    double label, anchor, normal, tangential;
} hs_edge;
hs_edge hs_edge_at(const hs_vertex *stack, int64_t depth, double d, double load);

/* Update of a group on a straight path: solved first, then applied, so that the caller can read the
 * previous stack. */
typedef struct hs_update {
    int64_t depth;     /* of the previous stack; 1 at first contact of the group */
    hs_point to;       /* end of the path */
    double load;       /* P of the group at the end */
    double force;      /* T of the group at the end */
    double slope;      /* of the polyline at its new edge */
    double slip_label; /* springs between this label and the edge slip at the end of the path;
                          infinity if all stick */
    hs_edge edge;
    int slips;
    /* if springs slip: */
    int64_t inner_count; /* vertices inside the slip front; 0 if all springs slide */
    double x;            /* rigid·a + compliance·P(a) at the slip front */
    double sign, slip;   /* direction of slip; slip at the front, 0 unless all springs slide */
    int makes_vertex;    /* true if the front is inside a segment, not at a vertex */
    double inner_slope;  /* of the segment that contains the front */
    hs_vertex front;
} hs_update;
/* Solve for the update of a group that is in contact at approach `d`, with normal load `load`. The
 * stack has `depth` vertices; if 0, its first vertex is written. */
void hs_solve_update(const hs_group *group, int64_t depth, const hs_point *from, double d,
                     double load, hs_target target, hs_update *update);
/* Write the vertices of an update and add its losses; returns the new depth of the stack. */
int64_t hs_apply_update(const hs_group *group, hs_losses *losses, const hs_point *from,
                        const hs_update *update);

/* Direction, 1 or -1, in which the springs of segment j slide; 0 if they stick. */
static inline double hs_sliding_side(const hs_vertex *stack, int64_t depth, int64_t j,
                                     double displacement, double friction) {
    double slope = stack[j].slope;
    if (fabs(slope) != friction) return 0.0;
    double side = copysign(1.0, slope), reach = stack[depth - 1].label - stack[j].label;
    double over = side * (displacement - stack[j].anchor) - friction * reach;
    double tie = HS_TIE * (fabs(displacement) + fabs(stack[j].anchor) + friction * reach);
    return fabs(over) <= tie ? side : 0.0;
}
/* Inner label of the sliding springs at the edge; infinity if the edge sticks. */
static inline double hs_slip_label(const hs_vertex *stack, int64_t depth, double displacement,
                                   double friction) {
    return hs_sliding_side(stack, depth, depth - 1, displacement, friction) != 0.0
               ? stack[depth - 2].label
               : HUGE_VAL;
}

/* True if a polyline is steeper than μ, as after a decrease of friction: then several zones may
 * slip. */
int hs_is_steep(const hs_vertex *stack, int64_t depth, double friction);
/* Merge vertices of a smooth polyline, created by many substeps; returns the new depth. All other
 * vertices and the outermost segment are unchanged. The load of any part of the polyline changes by
 * at most about `limit_tolerance` of its friction limit and `variation_tolerance` of its total
 * variation, for any number of calls. */
int64_t hs_merge_vertices(const hs_group *group, int64_t depth, double limit_tolerance,
                          double variation_tolerance);
/* Largest number of vertices of a clipped polyline of a given depth. */
static inline int64_t hs_room_to_clip(int64_t depth) { return 3 * depth + 6; }
/* Cone |v| ≤ μ (d - a) at the end of a straight path, and its change on the path: `moved` is the
 * change of displacement, and the limit of spring a grows by rise + gain·(d - a). */
typedef struct hs_cone {
    double friction;
    double moved;
    double rise;
    double gain;
} hs_cone;
/* Move a group in contact on a straight path and clip its polyline, of any slopes, to a cone;
 * `scratch` has room for twice `hs_room_to_clip` vertices. Losses may be NULL. Returns the depth of
 * the polyline in `scratch`; adds dT/dV to `stiffness` unless NULL. */
int64_t hs_move_and_clip(const hs_group *group, hs_losses *losses, int64_t depth, hs_point from,
                         hs_point to, double load, const hs_cone *cone, hs_vertex *scratch,
                         double *stiffness);

/* Slip fronts of groups of one asperity, cached. While the front of a group stays on one segment of
 * its polyline, it is linear in the end (d, V) of the path: between label a_j, where the anchor is
 * w_j, and the next vertex the slope is m, on the side s of slip it is sμ, so that
 *
 *     a = a_j + ((V - w_j) - sμ (d - a_j)) / (m - sμ),    T = T_j - m P(a_j) + sμ P(d) + (m - sμ)
 * P(a)
 *
 * which also holds while the whole group slides, where a is below its gap and P(a) is 0. So sums
 * over groups are vectorised, without a search along each polyline. One array per quantity. */
typedef struct hs_fronts {
    int64_t groups;
    double *memory;         /* block of all arrays */
    double *cone;           /* sμ */
    double *below, *anchor; /* label and anchor of the vertex below the front */
    double *jump, *rate;    /* m - sμ, and its reciprocal */
    double *force;          /* tangential load less m P of that vertex */
    double *low, *high;     /* range of labels of the segment */
    double *gap, *weight;   /* of the asperity */
    double *off;            /* 1 if the front is outside the segment, else 0 */
} hs_fronts;
/* Replaces 1/0 in sums over groups, which have no branches; chosen. */
#define HS_MAX_RATE 1e100

/* Tangential load at the end of a path, with first and second derivative with respect to V. */
typedef struct hs_force {
    double force, stiffness, curvature;
} hs_force;

/* Cache the segment that contains the front on a short path in one direction: the outermost one, or
 * the one below if the outermost already slides in this direction. */
void hs_guess_front(hs_fronts *fronts, int64_t index, const hs_group *group, int64_t depth,
                    double sign);
/* Tangential load at the end of a straight path, without changes of the state. If the slip front
 * can be cached, it is, and the result is 0, as the cache contributes the load. */
hs_force hs_force_of_group(const hs_group *group, int64_t depth, hs_point from, hs_point to,
                           double load, hs_fronts *fronts, int64_t index);

#endif
