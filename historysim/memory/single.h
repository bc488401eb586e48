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

/* Last segment of a polyline that ends at approach d. */
static inline int64_t hs_last_segment(hs_labels stack, int64_t depth, double d) {
    int64_t segment = depth - 1;
    if (d < hs_label_of(stack, segment))
        while (segment > 1 && hs_label_of(stack, segment - 1) >= d) --segment;
    return segment;
}

/* Distances between displacements, and anchors, that rounding alone may cause. */
static inline double hs_tie_of(double d, double v, double anchor, double friction) {
    return HS_TIE * (fabs(v) + fabs(anchor) + friction * d);
}

/* Whether all springs stick on a straight path to displacement v at approach d, where their polyline ends at label `edge` with
 * `anchor` before any slip. At the edge itself rounding is no reason to slip; new springs slip when they tie with the limit. */
static inline int hs_single_sticks(double edge, double anchor, double d, double v, double friction) {
    double change = fabs(v - anchor), tie = hs_tie_of(d, v, anchor, friction);
    return change == 0.0 || (d == edge ? change <= tie : change < friction * (d - edge) - tie);
}

/* Where slip ends that begins at the edge. */
typedef struct hs_single {
    int at_vertex; /* whether that is a vertex, by a tie */
    int64_t kept;  /* vertices below the slip front; 0 if all springs slide */
    double sign;   /* direction of slip */
    double label;  /* of the slip front */
    double slip;   /* there: 0 unless all springs slide */
} hs_single;

/* Find the slip front of springs that do not all stick; `segment` is the last of the polyline. */
static inline hs_single hs_solve_single(hs_labels stack, int64_t segment, double edge, double anchor, double d, double v,
                                        double friction) {
    double sign = v >= anchor ? 1.0 : -1.0, cone = sign * friction, tie = hs_tie_of(d, v, anchor, friction);
    hs_single end = {0, 0, sign, edge, sign * (v - anchor) - friction * (d - edge)};
    end.at_vertex = d > edge && end.slip <= tie;
    while (segment > 0 && !end.at_vertex) {
        double low = hs_label_of(stack, segment - 1), slope = hs_slope_of(stack, segment);
        double slip_low = sign * (v - hs_anchor_of(stack, segment - 1)) - friction * (d - low);
        if (slip_low < -tie && slope != cone) {
            end.kept = segment;
            end.label = hs_most(end.label - end.slip / (friction - sign * slope), low);
            end.slip = 0.0;
            return end;
        }
        --segment;
        end.label = low;
        end.slip = slip_low;
        end.at_vertex = slip_low <= tie;
    }
    if (!end.at_vertex) return end;
    while (segment > 0 && hs_slope_of(stack, segment) == cone) --segment;
    end.kept = segment + 1;
    end.label = hs_label_of(stack, segment);
    end.slip = 0.0;
    return end;
}

#endif
