/* Numbers: tolerances of rounding, and the smallest tools. */
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

/* functions that are called rarely and must not use registers of their callers */
#ifdef __GNUC__
#define HS_APART __attribute__((noinline, cold))
#else
#define HS_APART
#endif

/* functions that are compiled anew for the constants with which each call has them */
#ifdef __GNUC__
#define HS_INLINE inline __attribute__((always_inline))
#else
#define HS_INLINE inline
#endif

/* relative difference of displacements or loads that rounding alone may cause; closed loops are recognised by it */
#define HS_TIE (32.0 * DBL_EPSILON)
/* relative rounding that a request at the friction limit may have from the conversion of its units */
#define HS_LIMIT_SLACK 1e-12
/* smallest approach over R0, and load in its unit, of a contact that doubles can represent */
#define HS_LEAST_APPROACH 1e-150
#define HS_LEAST_LOAD 1e-225

static inline double hs_least(double a, double b) { return b < a ? b : a; }
static inline double hs_most(double a, double b) { return b > a ? b : a; }
/* Bounded on both sides. */
static inline double hs_clamp(double value, double bound) { return hs_least(hs_most(value, -bound), bound); }
/* Linear interpolation; the target itself at fraction 1. */
static inline double hs_toward(double present, double target, double fraction) {
    return fraction == 1.0 ? target : present + fraction * (target - present);
}
/* Friction coefficient bounded to what doubles resolve; the contact sticks as with a larger one. */
static inline double hs_bound_friction(double friction) { return friction > HS_MOST_FRICTION ? HS_MOST_FRICTION : friction; }

#endif
