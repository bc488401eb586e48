/* Adaptive: step size control for one-step methods of second order, by step doubling (README.md,
 * theory 10).
 *
 * A step is integrated in a few substeps, and from its start again in twice as many, until two
 * results agree. If the error falls too slowly, the step is shortened: by bisection, or to the
 * length predicted from the error, h' = safety h / sqrt(error). */

#include "adaptive.h"

/* Nested halves of a step, at most: chosen, as no settings have a minimum length below 2^-63. */
#define MAX_LEVELS 64

/* Integrate a step in 1, 2, 4, … times the initial number of substeps. Sets `accepted` to 1 if the
 * result can be used, leaves it 0 if the step has to be shortened. */
static int refine(hs_integrand *integrand, const hs_interval *step, int is_full_path, int *accepted,
                  double *error) {
    const hs_adaptive *settings = integrand->settings;
    const int can_shorten =
        step->end - step->begin > settings->min_length && step->level + 1 < MAX_LEVELS;
    double previous_error = HUGE_VAL;
    for (int substeps = settings->initial_substeps;; substeps *= 2, previous_error = *error) {
        int status = integrand->integrate(integrand, step, substeps, error);
        if (status != HS_OK) return status;
        const int compared = substeps > settings->initial_substeps || *error != HUGE_VAL;
        const int is_used_up = compared && integrand->substep_budget <= 0;
        *accepted = *error <= settings->accepted_error || (*error <= 1.0 && previous_error <= 1.0);
        if (is_used_up && !is_full_path && *error > 1.0) return HS_TOO_MANY_SUBSTEPS;
        if (*accepted || is_used_up || substeps >= settings->max_substeps ||
            (settings->slow_convergence_ratio == 0.0 && !can_shorten))
            break;
        if (can_shorten && compared &&
            (settings->slow_convergence_ratio == 0.0 ||
             *error > settings->slow_convergence_ratio * previous_error))
            return HS_OK;
    }
    *accepted = 1;
    return HS_OK;
}

int hs_adapt(hs_integrand *integrand, double start, double stop) {
    const hs_adaptive *settings = integrand->settings;
    double targets[MAX_LEVELS] = {stop};
    hs_interval step = {start, stop, 0};
    integrand->substep_budget = settings->total_substeps;
    integrand->reached = start;
    if (settings->initial_length < 1.0)
        targets[++step.level] = start + settings->initial_length * (stop - start);
    while (step.begin < stop) {
        int accepted = 0;
        double error, target;
        if (integrand->substep_budget <= 0 && step.begin > start) return HS_TOO_MANY_SUBSTEPS;
        step.end = targets[step.level];
        int status =
            refine(integrand, &step, step.begin == start && step.end == stop, &accepted, &error);
        if (status == HS_OK && accepted) status = integrand->accept(integrand, &step);
        if (status != HS_OK) return status;
        const double length = step.end - step.begin;
        if (accepted) {
            step.begin = integrand->reached = step.end;
            if (step.level > 0) --step.level;
        }
        if (settings->safety > 0.0) {
            double factor = error > 0.0 ? settings->safety / sqrt(error) : settings->max_factor;
            factor = hs_min(hs_max(factor, settings->min_factor), settings->max_factor);
            target = step.begin + hs_max(length * factor, settings->min_length);
            /* a rejected step becomes shorter, even if it leaves a short rest */
            step.level = stop - target > (accepted ? settings->min_length : 0.0);
        } else {
            if (accepted) continue;
            target = 0.5 * (step.begin + step.end);
            ++step.level;
        }
        if (step.level > 0) targets[step.level] = target;
        step.end = targets[step.level];
        if (!accepted && integrand->shorten) status = integrand->shorten(integrand, &step);
        if (status != HS_OK) return status;
    }
    return HS_OK;
}

void hs_coarsen(hs_adaptive *settings, double reached) {
    double factor = 2.0 / (reached * reached);
    settings->tolerance *=
        hs_min(hs_max(factor, settings->min_coarsening), settings->max_coarsening);
}
