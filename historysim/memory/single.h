/* Fast path of the polyline update (README.md, theory 7) for a prescribed displacement: exact, in
 * closed form per segment.
 *
 * It computes the label of the slip front from labels, anchors and slopes alone. `find_slip_front`
 * in polyline.c, for loads and instruments as well, computes the same front to the bit
 * (tests/memory/test_groups.py compares them). move.c uses the fast path for groups of one
 * asperity, batch.c for contacts of one asperity. */
#ifndef HISTORYSIM_SINGLE_H
#define HISTORYSIM_SINGLE_H

#include "numbers.h"

/* Stack of vertices of any struct of `width` doubles that begins with label, anchor and slope. */
typedef struct hs_labels {
    const double *vertex;
    int64_t width;
} hs_labels;
static inline double hs_label_of(hs_labels stack, int64_t j) {
    return stack.vertex[j * stack.width];
}
static inline double hs_anchor_of(hs_labels stack, int64_t j) {
    return stack.vertex[j * stack.width + 1];
}
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
