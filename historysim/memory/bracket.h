/* Bracket of a root and its reduction by regula falsi with the Illinois modification: the function
 * value at a bound that is kept twice in sequence is halved. */
#ifndef HISTORYSIM_BRACKET_H
#define HISTORYSIM_BRACKET_H

#include "numbers.h"

typedef struct hs_bracket {
    double low, high, at_low, at_high;
    int replaced; /* bound replaced by the last iteration: 1 high, -1 low */
} hs_bracket;
/* Intersection of the secant with zero; the midpoint if rounding puts that outside the bracket. */
static inline double hs_false_position(const hs_bracket *root) {
    double estimate =
        root->low + (root->high - root->low) * root->at_low / (root->at_low - root->at_high);
    return root->low < estimate && estimate < root->high ? estimate
                                                         : 0.5 * (root->low + root->high);
}
/* Replace one bound by a trial with its function value. */
static inline void hs_narrow(hs_bracket *root, double trial, double value, int replaces_high) {
    double *bound = replaces_high ? &root->high : &root->low,
           *bound_value = replaces_high ? &root->at_high : &root->at_low;
    double *opposite_value = replaces_high ? &root->at_low : &root->at_high;
    *bound = trial;
    *bound_value = value;
    if (root->replaced == (replaces_high ? 1 : -1)) *opposite_value *= 0.5;
    root->replaced = replaces_high ? 1 : -1;
}

#endif
