/* Bracket of a root, narrowed by false position (Illinois): the value of an end that stays twice is halved. */
#ifndef HISTORYSIM_BRACKET_H
#define HISTORYSIM_BRACKET_H

#include "numbers.h"

typedef struct hs_bracket {
    double low, high, at_low, at_high;
    int replaced; /* the end replaced last: 1 the high one, -1 the low one */
} hs_bracket;
static inline double hs_false_position(const hs_bracket *root) {
    double next = root->low + (root->high - root->low) * root->at_low / (root->at_low - root->at_high);
    return root->low < next && next < root->high ? next : 0.5 * (root->low + root->high);
}
static inline void hs_narrow(hs_bracket *root, double trial, double value, int replaces_high) {
    double *end = replaces_high ? &root->high : &root->low, *at_end = replaces_high ? &root->at_high : &root->at_low;
    double *at_other = replaces_high ? &root->at_low : &root->at_high;
    *end = trial;
    *at_end = value;
    if (root->replaced == (replaces_high ? 1 : -1)) *at_other *= 0.5;
    root->replaced = replaces_high ? 1 : -1;
}

#endif
