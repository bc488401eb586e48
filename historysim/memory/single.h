/* Fast path of the polyline update (README.md, theory 7) for a displacement that is given, as it is for single asperities.
 *
 * It computes where slip ends, from labels, anchors and slopes alone. polyline.c has the general update, of loads and of
 * instruments, too: its `find_slip_front` finds the same front to the bit (tests/memory/test_groups.py compares them). move.c
 * uses the fast path for groups of one asperity, batch.c for contacts of one. */
#ifndef HISTORYSIM_SINGLE_H
#define HISTORYSIM_SINGLE_H

#include "numbers.h"

/* Vertices of any struct that begins with label, anchor and slope, and holds `width` numbers. */
typedef struct hs_labels {
    const double *vertex;
    int64_t width;
} hs_labels;
static inline double hs_label_of(hs_labels stack, int64_t j) { return stack.vertex[j * stack.width]; }
static inline double hs_anchor_of(hs_labels stack, int64_t j) { return stack.vertex[j * stack.width + 1]; }
static inline double hs_slope_of(hs_labels stack, int64_t j) { return stack.vertex[j * stack.width + 2]; }

/* Last segment of a polyline that is cut at approach d, below its last label. */
static HS_INLINE int64_t hs_cut_segment(hs_labels stack, int64_t depth, double d) {
    int64_t segment = depth - 1;
    while (segment > 1 && hs_label_of(stack, segment - 1) >= d) --segment;
    return segment;
}

/* Straight path to displacement v at approach d, and the slip at the edge at its end if only the edge slips. */
typedef struct hs_single_path {
    double d, v, friction;
    double edge;   /* label of the edge before any slip, at most d */
    double sign;   /* direction of slip */
    double slip;   /* at the edge; < 0 if that sticks */
    double tie;    /* slip that rounding alone may cause */
    int grows;     /* whether springs touch on the path beyond the edge */
    int sticks;    /* whether no spring slips */
} hs_single_path;

/* Compare a path with the friction limit; the polyline ends at label `edge` with `anchor`. At a constant approach (`held`)
 * the edge is d. At the edge itself rounding is no reason to slip; new springs slip when they tie with the limit. */
static HS_INLINE hs_single_path hs_single_path_to(double d, double v, double friction, double edge, double anchor, int held) {
    double change = v - anchor, sign = change >= 0.0 ? 1.0 : -1.0, limit = held ? 0.0 : friction * (d - edge);
    double tie = HS_TIE * (fabs(v) + fabs(anchor) + friction * d);
    int grows = !held && d > edge;
    int sticks = grows ? change == 0.0 || fabs(change) < limit - tie : fabs(change) <= tie;
    return HS_MADE(hs_single_path){d, v, friction, edge, sign, sign * change - limit, tie, grows, sticks};
}

/* Slip front of a path on which springs slip. */
typedef struct hs_single {
    int at_vertex; /* whether it is at a vertex, by a tie */
    int64_t kept;  /* vertices below the slip front; 0 if all springs slide */
    double label;  /* of the slip front */
    double slip;   /* there: 0 unless all springs slide */
} hs_single;

/* Find the slip front, from the edge inward; `segment` is the last of the polyline. */
static HS_INLINE hs_single hs_solve_single(hs_labels stack, int64_t segment, const hs_single_path *path) {
    const double d = path->d, v = path->v, friction = path->friction, sign = path->sign, tie = path->tie, cone = sign * friction;
    hs_single end = {path->grows && path->slip <= tie, 0, path->edge, path->slip};
    for (; segment > 0 && !end.at_vertex; --segment) {
        double low = hs_label_of(stack, segment - 1), slope = hs_slope_of(stack, segment);
        double slip = sign * (v - hs_anchor_of(stack, segment - 1)) - friction * (d - low);
        if (slip < -tie && slope != cone)
            return HS_MADE(hs_single){0, segment, hs_most(end.label - end.slip / (friction - sign * slope), low), 0.0};
        end.label = low;
        end.slip = slip;
        end.at_vertex = slip <= tie;
    }
    if (!end.at_vertex) return end;
    while (segment > 0 && hs_slope_of(stack, segment) == cone) --segment;
    return HS_MADE(hs_single){1, segment + 1, hs_label_of(stack, segment), 0.0};
}

#endif
