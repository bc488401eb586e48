/* The load P(a) of asperities, and the approach at a load. */
#ifndef HISTORYSIM_NORMAL_H
#define HISTORYSIM_NORMAL_H

#include <math.h>

#include "historysim.h"

static inline double hs_least(double a, double b) { return b < a ? b : a; }
static inline double hs_most(double a, double b) { return b > a ? b : a; }
/* Bounded on both sides. */
static inline double hs_within(double value, double bound) { return hs_least(hs_most(value, -bound), bound); }

typedef struct hs_load {
    double load;
    double slope; /* dP/da */
} hs_load;

/* Asperities in ascending gap, or knots, which have loads. */
typedef struct hs_curve {
    const double *gap;
    const double *weight;
    const double *load;
    int64_t count;
} hs_curve;

int64_t hs_touching(const double *gap, int64_t count, double approach);
/* P'' between a knot and the next one, which are not at one place; 0 beyond the last one. */
static inline double hs_bend_at(hs_curve curve, int64_t i) {
    return i + 1 < curve.count ? (curve.weight[i + 1] - curve.weight[i]) / (curve.gap[i + 1] - curve.gap[i]) : 0.0;
}
hs_load hs_load_between_knots(hs_curve curve, double approach);
hs_load hs_sum_of_loads(const double *gap, const double *weight, int64_t touching, double approach);
double hs_label_at(hs_curve curve, double total, double guess, double rigid, double compliance);
double hs_cube_root(double x);

static inline hs_load hs_load_of_one(double gap, double weight, double approach) {
    double depth = hs_most(approach - gap, 0.0), half_chord = weight * sqrt(depth);
    return (hs_load){half_chord * depth, 1.5 * half_chord};
}
/* P(a) and P'(a). */
static inline hs_load hs_load_at(hs_curve curve, double approach) {
    if (curve.load) return hs_load_between_knots(curve, approach);
    if (curve.count == 1) return hs_load_of_one(curve.gap[0], curve.weight[0], approach);
    return hs_sum_of_loads(curve.gap, curve.weight, hs_touching(curve.gap, curve.count, approach), approach);
}
static inline hs_curve hs_all_of(const hs_contact *contact) {
    return (hs_curve){contact->sorted_gap, contact->sorted_weight, contact->load, contact->count};
}

#endif
