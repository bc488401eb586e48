/* Adaptive: integration in steps as long, and in as many chords, as a tolerance allows. */
#ifndef HISTORYSIM_ADAPTIVE_H
#define HISTORYSIM_ADAPTIVE_H

#include <limits.h>

#include "numbers.h"

/* Settings of an adaptive integration. Lengths of steps are fractions of the path. Errors are the differences of two results over
 * the tolerance of the caller: an error of 1 is just tolerated. */
typedef struct hs_adaptive {
    double tolerance;     /* relative, by which the caller divides differences */
    double certain;       /* error that is accepted at once; larger ones, up to 1, twice in sequence: results may agree by chance */
    int first_chords;     /* of a step; they are doubled until its error is accepted */
    int most_chords;      /* of a step, which is then accepted whatever its error */
    double slow;          /* a step is shortened if its error exceeds this fraction of the error before; 0: at once; infinity: never */
    double first_length;  /* of a step */
    double least_length;  /* shorter steps are not shortened, and no shorter rest of the path is left */
    double safety;        /* length of the next step over the length at which the error would be 1; 0: steps are halved */
    double least_factor, most_factor; /* length of the next step over the last one, if it is predicted */
    int64_t chords;       /* of all steps; more of them end the integration: HS_TOO_MANY_CHORDS */
    double least_coarser, most_coarser; /* factor by which the tolerance is then enlarged */
} hs_adaptive;

/* Status of an integration whose chords are used up; it is not returned to users. */
#define HS_TOO_MANY_CHORDS (-1)

typedef struct hs_interval {
    double begin, end;
    int level; /* of nested steps: those that end at the same fraction have the same level */
} hs_interval;

/* Integrand: how the present state is integrated over a step. */
typedef struct hs_integrand {
    void *context;
    const hs_adaptive *settings;
    /* Integrate from the present state in a number of chords, without changing it. The error of the first number of chords
     * is infinite if there is nothing to compare with. */
    int (*integrate)(struct hs_integrand *integrand, const hs_interval *step, int chords, double *error);
    /* Make the last result, improved by the one before, the present state. */
    int (*accept)(struct hs_integrand *integrand, const hs_interval *step);
    /* Shorten a step; its level is that of the shorter one. NULL if nothing depends on it. */
    int (*shorten)(struct hs_integrand *integrand, const hs_interval *step);
    int64_t chords_left; /* counted by the integrand */
    double reached;      /* end of the last accepted step */
} hs_integrand;

/* Integrate from a fraction of the path to another one. */
int hs_adapt(hs_integrand *integrand, double begin, double end);
/* Enlarge the tolerance of settings whose chords were used up at a fraction of the path: their number goes with the inverse
 * square root of the tolerance. */
void hs_coarsen(hs_adaptive *settings, double reached);

/* Difference of two results, less its rounding, over what is tolerated. */
static inline double hs_error(double difference, double rounding, double tolerated) {
    difference = fabs(difference) - rounding;
    return difference <= 0.0 ? 0.0 : difference / tolerated;
}
/* Energy of many chords, extrapolated from the energies of n and of 2 n chords by a method of second order; no less than at the
 * start. */
static inline double hs_extrapolate(double start, double coarse, double fine) {
    return hs_most(fine + (fine - coarse) / 3.0, start);
}

#endif
