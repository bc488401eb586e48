/* Adaptive: integrates a path in steps, from the settings and the integrand of the caller (README.md, theory 10).
 *
 * A step is integrated in a few chords, and again from its start in twice as many, until the results agree. If its errors fall
 * too slowly it is shortened: to a half, after which the other half follows, or to the length that the error of a method of
 * second order predicts. */

#include "adaptive.h"

/* nested halves: no settings have a least length below 2^-63 */
#define MOST_LEVELS 64

/* Integrate a step in more and more chords until its error is accepted or it has to be shortened, which `accepted` tells. */
static int refine(hs_integrand *integrand, const hs_interval *step, int is_whole_path, int *accepted, double *error) {
    const hs_adaptive *s = integrand->settings;
    const int can_shorten = step->end - step->begin > s->least_length && step->level + 1 < MOST_LEVELS;
    double before = HUGE_VAL;
    for (int chords = s->first_chords;; chords *= 2, before = *error) {
        int status = integrand->integrate(integrand, step, chords, error);
        if (status != HS_OK) return status;
        const int compared = chords > s->first_chords || *error != HUGE_VAL, used_up = compared && integrand->chords_left <= 0;
        *accepted = *error <= s->certain || (*error <= 1.0 && before <= 1.0);
        if (used_up && !is_whole_path && *error > 1.0) return HS_TOO_MANY_CHORDS;
        if (*accepted || used_up || chords >= s->most_chords || (s->slow == 0.0 && !can_shorten)) break;
        if (can_shorten && compared && (s->slow == 0.0 || *error > s->slow * before)) return HS_OK;
    }
    *accepted = 1;
    return HS_OK;
}

int hs_adapt(hs_integrand *integrand, double begin, double end) {
    const hs_adaptive *s = integrand->settings;
    double ends[MOST_LEVELS] = {end};
    hs_interval step = {begin, end, 0};
    integrand->chords_left = s->chords;
    integrand->reached = begin;
    if (s->first_length < 1.0) ends[++step.level] = begin + s->first_length * (end - begin);
    while (step.begin < end) {
        int accepted = 0;
        double error, next;
        if (integrand->chords_left <= 0 && step.begin > begin) return HS_TOO_MANY_CHORDS;
        step.end = ends[step.level];
        int status = refine(integrand, &step, step.begin == begin && step.end == end, &accepted, &error);
        if (status == HS_OK && accepted) status = integrand->accept(integrand, &step);
        if (status != HS_OK) return status;
        const double length = step.end - step.begin;
        if (accepted) {
            step.begin = integrand->reached = step.end;
            if (step.level > 0) --step.level;
        }
        if (s->safety > 0.0) {
            double factor = error > 0.0 ? s->safety / sqrt(error) : s->most_factor;
            factor = hs_least(hs_most(factor, s->least_factor), s->most_factor);
            next = step.begin + hs_most(length * factor, s->least_length);
            step.level = end - next > s->least_length;
        } else {
            if (accepted) continue;
            next = 0.5 * (step.begin + step.end);
            ++step.level;
        }
        if (step.level > 0) ends[step.level] = next;
        step.end = ends[step.level];
        if (!accepted && integrand->shorten) status = integrand->shorten(integrand, &step);
        if (status != HS_OK) return status;
    }
    return HS_OK;
}

void hs_coarsen(hs_adaptive *settings, double reached) {
    double factor = 2.0 / (reached * reached);
    settings->tolerance *= hs_least(hs_most(factor, settings->least_coarser), settings->most_coarser);
}
