/* Numbers: tolerances of rounding, and elementary functions of doubles. */
#ifndef HISTORYSIM_NUMBERS_H
#define HISTORYSIM_NUMBERS_H

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "historysim.h"

/* compound literals, HS_MADE(hs_load){…}, in C and in C++ */
#ifdef __cplusplus
#define restrict __restrict
#define HS_MADE(type) type
#else
#define HS_MADE(type) (type)
#endif

/* Functions that are called rarely and must not use registers of their callers. */
#ifdef __GNUC__
#define HS_APART __attribute__((noinline, cold))
#else
#define HS_APART
#endif

/* Functions that are compiled separately for constant arguments of each call. */
#ifdef __GNUC__
#define HS_INLINE inline __attribute__((always_inline))
#else
#define HS_INLINE inline
#endif

/* Relative difference of displacements or loads that rounding alone may cause (chosen); recognises
 * closed loops. */
#define HS_TIE (32.0 * DBL_EPSILON)
/* Relative rounding of a request at the friction limit by the conversion of its units (chosen). */
#define HS_LIMIT_SLACK 1e-12
/* Smallest approach over R0, and load over its unit, (1e-150)^(3/2), of a contact that doubles can
 * represent; chosen. */
#define HS_MIN_APPROACH 1e-150
#define HS_MIN_LOAD 1e-225

static inline double hs_min(double a, double b) { return b < a ? b : a; }
static inline double hs_max(double a, double b) { return b > a ? b : a; }
/* Value clipped to [-bound, bound]. */
static inline double hs_clamp(double value, double bound) {
    return hs_min(hs_max(value, -bound), bound);
}
/* Linear interpolation; the target itself at fraction 1. */
static inline double hs_toward(double present, double target, double fraction) {
    return fraction == 1.0 ? target : present + fraction * (target - present);
}
/* Friction coefficient clipped to HS_MOST_FRICTION, at which a contact sticks as with any larger
 * one. */
static inline double hs_bound_friction(double friction) {
    return friction > HS_MOST_FRICTION ? HS_MOST_FRICTION : friction;
}

#endif
