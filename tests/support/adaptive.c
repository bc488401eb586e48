/* Adaptive integration of x' = f(s) by the midpoint rule, whose error is of second order: ∫ √s ds, ∫ s² ds.
 *
 *     adaptive RULE FUNCTION TOLERANCE
 *
 * integrates from 0 to 1 by "doubled" chords, "halved" or "predicted" steps; prints the status, the integral, the chords, the
 * accepted steps and where they end. */
#include "adaptive.h"

#include <stdio.h>

typedef struct integral {
    int root;
    double value, coarse, fine; /* at the begin of a step, and at its end by the last two numbers of chords */
    int64_t chords, steps;
    double end;
} integral;

static int integrate(hs_integrand *integrand, const hs_interval *step, int chords, double *error) {
    integral *x = (integral *)integrand->context;
    double length = (step->end - step->begin) / chords;
    x->coarse = x->fine;
    x->fine = x->value;
    for (int k = 0; k < chords; ++k) {
        double s = step->begin + (k + 0.5) * length;
        x->fine += length * (x->root ? sqrt(s) : s * s);
    }
    x->chords += chords;
    integrand->substep_budget -= chords;
    *error = HUGE_VAL;
    if (chords > integrand->settings->initial_substeps)
        *error = hs_error(x->fine - x->coarse, 0.0, integrand->settings->tolerance * (step->end - step->begin));
    return HS_OK;
}

static int accept(hs_integrand *integrand, const hs_interval *step) {
    integral *x = (integral *)integrand->context;
    if (step->begin != x->end) return HS_NOT_A_STATE;
    x->value = hs_extrapolate(x->value, x->coarse, x->fine);
    x->end = step->end;
    ++x->steps;
    return HS_OK;
}

int main(int count, char **words) {
    if (count < 4) return 2;
    hs_adaptive settings = {0.0, 1.0, 1, INT_MAX, 0.0, 1.0, 1e-9, 0.0, 0.1, 4.0, 100000, 4.0, 1e4};
    integral x = {words[2][0] == 'r', 0.0, 0.0, 0.0, 0, 0, 0.0};
    settings.tolerance = atof(words[3]);
    if (words[1][0] == 'd') settings.slow_convergence_ratio = HUGE_VAL;
    if (words[1][0] == 'p') {
        settings.safety = 0.9;
        settings.initial_length = 0.125;
    }
    hs_integrand integrand = {&x, &settings, integrate, accept, NULL, 0, 0.0};
    int status = hs_adapt(&integrand, 0.0, 1.0);
    printf("%d %.17g %lld %lld %.17g %.17g\n", status, x.value, (long long)x.chords, (long long)x.steps, x.end, integrand.reached);
    return 0;
}
