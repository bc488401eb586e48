/* Adaptive: step size control for one-step methods of second order. */
#ifndef HISTORYSIM_ADAPTIVE_H
#define HISTORYSIM_ADAPTIVE_H

#include <limits.h>

#include "numbers.h"

/* Settings of an adaptive integration. Lengths of steps are fractions of the path. An error is the
 * difference of two results over the tolerance of the caller: 1 is just tolerated. */
typedef struct hs_adaptive {
    /* Relative tolerance, by which the caller divides differences. */
    double tolerance;
    /* Error accepted after one comparison; larger errors up to 1 need two in sequence, as results
     * may agree by chance. */
    double accepted_error;
    /* Substeps of a step: the first number, doubled until the error is accepted, and the largest,
     * accepted with any error. */
    int initial_substeps;
    int max_substeps;
    /* A step is shortened if its error exceeds this fraction of the previous one; 0: at once;
     * infinity: never. */
    double slow_convergence_ratio;
    /* Length of the first step; and the minimum length, below which no step is shortened and no
     * rest of the path is left. */
    double initial_length;
    double min_length;
    /* Length of the next step over the length of error 1; 0: steps are bisected. */
    double safety;
    /* Bounds of the ratio of successive predicted lengths. */
    double min_factor, max_factor;
    /* Substeps of all steps; more end the integration with HS_TOO_MANY_SUBSTEPS. */
    int64_t total_substeps;
    /* Bounds of the factor by which `hs_coarsen` then enlarges the tolerance. */
    double min_coarsening, max_coarsening;
} hs_adaptive;

/* Status of an integration whose substeps are used up; internal, never returned to users. */
#define HS_TOO_MANY_SUBSTEPS (-1)

typedef struct hs_interval {
    double begin, end;
    int level; /* of nested steps: those that end at the same fraction have the same level */
} hs_interval;

/* Integrand: the present state and the functions that integrate it over a step. */
typedef struct hs_integrand {
    void *context;
    const hs_adaptive *settings;
    /* Integrate from the present state in a number of substeps, without changing it. The error is
     * infinite if there is no result of fewer substeps to compare with. */
    int (*integrate)(struct hs_integrand *integrand, const hs_interval *step, int substeps,
                     double *error);
    /* Make the finest result, extrapolated from the two finest, the present state. */
    int (*accept)(struct hs_integrand *integrand, const hs_interval *step);
    /* Called with each shortened step, which has its new level; may be NULL. */
    int (*shorten)(struct hs_integrand *integrand, const hs_interval *step);
    int64_t substep_budget; /* counted down by the integrand */
    double reached;         /* end of the last accepted step */
} hs_integrand;

/* Integrate between two path fractions; returns a status. */
int hs_adapt(hs_integrand *integrand, double start, double stop);
/* Enlarge the tolerance of settings whose substeps were used up at a path fraction: the number of
 * substeps of a method of second order is proportional to the inverse square root of the tolerance.
 */
void hs_coarsen(hs_adaptive *settings, double reached);

/* Difference of two results beyond its rounding, over the tolerance. */
static inline double hs_error(double difference, double rounding, double tolerated) {
    difference = fabs(difference) - rounding;
    return difference <= 0.0 ? 0.0 : difference / tolerated;
}
/* Richardson extrapolation of an energy from n and 2 n substeps of a method of second order;
 * bounded below by its start. */
static inline double hs_extrapolate(double start, double coarse, double fine) {
    return hs_max(fine + (fine - coarse) / 3.0, start);
}

#endif
