/* Slip front of a polyline (README.md, theory 7) on a straight path: exact, in closed form per
 * segment, from labels, anchors and slopes alone.
 *
 * For a load, or an instrument, labels and anchors are combined with the loads of vertices
 * (polyline.c). move.c finds fronts for groups of one asperity, batch.c for contacts of one. */
#ifndef HISTORYSIM_SINGLE_H
#define HISTORYSIM_SINGLE_H

#include "numbers.h"

/* Stack of vertices of any struct of `width` doubles that begins with label, anchor and slope. With
 * a compliance, label and anchor stand for rigid·a + compliance·P(a) and rigid·w + compliance·T,
 * of a struct whose fifth and sixth members are P and T. */
typedef struct hs_labels {
    const double *vertex;
    int64_t width;
    double rigid, compliance; /* 1, 0 for a displacement */
} hs_labels;
static HS_INLINE double hs_combined(hs_labels stack, int64_t j, int member) {
    const double *vertex = stack.vertex + j * stack.width + member;
    return stack.compliance == 0.0 ? *vertex : stack.rigid * *vertex + stack.compliance * vertex[4];
}
static inline double hs_label_of(hs_labels stack, int64_t j) { return hs_combined(stack, j, 0); }
static inline double hs_anchor_of(hs_labels stack, int64_t j) { return hs_combined(stack, j, 1); }
static inline double hs_slope_of(hs_labels stack, int64_t j) {
    return stack.vertex[j * stack.width + 2];
}

/* Index of the outermost segment that remains of a polyline cut at approach d, below its outermost
 * label. */
static HS_INLINE int64_t hs_cut_segment(hs_labels stack, int64_t depth, double d) {
    int64_t segment = depth - 1;
    while (segment > 1 && hs_label_of(stack, segment - 1) >= d) --segment;
    return segment;
}

/* Straight path to displacement v at approach d, with the slip at the edge. */
typedef struct hs_single_path {
    double d, v, friction;
    double edge; /* label of the edge of the polyline before slip, at most d */
    double sign; /* direction of slip */
    double slip; /* at the edge; < 0 if the edge sticks */
    double tie;  /* slip that rounding alone may cause */
    int grows;   /* true if springs come into contact on the path */
    int sticks;  /* true if no spring slips */
} hs_single_path;

/* Compare a path with the friction limit; the polyline ends at label `edge` with `anchor`. At a
 * constant approach (`held`) the edge is d. At the edge itself rounding is no reason to slip; new
 * springs slip when they tie with the limit. */
static HS_INLINE hs_single_path hs_single_path_to(double d, double v, double friction, double edge,
                                                  double anchor, int held) {
    double change = v - anchor, sign = change >= 0.0 ? 1.0 : -1.0,
           limit = held ? 0.0 : friction * (d - edge);
    double tie = HS_TIE * (fabs(v) + fabs(anchor) + friction * d);
    int grows = !held && d > edge;
    int sticks = grows ? change == 0.0 || fabs(change) < limit - tie : fabs(change) <= tie;
    return HS_MADE(hs_single_path){d,   v,     friction, edge, sign, sign * change - limit,
                                   tie, grows, sticks};
}

/* Slip front of a path on which springs slip. */
typedef struct hs_single {
    int at_vertex;       /* true if the front is at a vertex, by a tie */
    int64_t inner_count; /* vertices inside the slip front; 0 if all springs slide */
    double label;        /* of the slip front */
    double slip;         /* at the front: 0 unless all springs slide */
} hs_single;

/* Find the slip front, searching from the edge inward; `segment` is the outermost of the polyline.
 */
static HS_INLINE hs_single hs_solve_single(hs_labels stack, int64_t segment,
                                           const hs_single_path *path) {
    const double d = path->d, v = path->v, friction = path->friction, sign = path->sign,
                 tie = path->tie, cone = sign * friction;
    hs_single front = {path->grows && path->slip <= tie, 0, path->edge, path->slip};
    for (; segment > 0 && !front.at_vertex; --segment) {
        double low = hs_label_of(stack, segment - 1), slope = hs_slope_of(stack, segment);
        double slip = sign * (v - hs_anchor_of(stack, segment - 1)) - friction * (d - low);
        if (slip < -tie && slope != cone)
            return HS_MADE(hs_single){
                0, segment, hs_max(front.label - front.slip / (friction - sign * slope), low), 0.0};
        front.label = low;
        front.slip = slip;
        front.at_vertex = slip <= tie;
    }
    if (!front.at_vertex) return front;
    while (segment > 0 && hs_slope_of(stack, segment) == cone) --segment;
    return HS_MADE(hs_single){1, segment + 1, hs_label_of(stack, segment), 0.0};
}

#endif
