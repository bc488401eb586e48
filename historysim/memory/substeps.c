/* Substeps: adaptive integration of a path on which fields change, by steps of second order.
 * Substeps are doubled until state, energy, slid distances and shapes converge, and a step is
 * halved where its error falls too slowly (README.md, theory 10). Dissipated energies are compared
 * substep by substep, since sums may agree by coincidence. */

#include "substeps.h"
#include "adaptive.h"
#include "step.h"
#include "contact.h"
#include "drive.h"
#include "slides.h"

/* First number of substeps: if the approach changes by at most SMALL_APPROACH_CHANGE of the depth
 * of contact, and otherwise; chosen. */
#define MIN_SUBSTEPS 1
#define INITIAL_SUBSTEPS 4
#define SMALL_APPROACH_CHANGE 0.1
/* Substeps of each segment between cuts, at most, which bounds the time of a path; chosen. */
#define MAX_SUBSTEPS (1 << 12)
/* Tolerance of a halved step, relative to the path's; chosen. */
#define HALVES_TOLERANCE 0.25

static const hs_adaptive substep_settings = {
    0.0, /* the tolerance is set from the drive's */
    0.5, /* agreement by coincidence is rarely closer than this; chosen */
    INITIAL_SUBSTEPS,
    MAX_SUBSTEPS,
    0.4, /* between the ratios by which errors of second and first order fall, 1/4 and 1/2 */
    1.0,
    1e-12, /* well above the rounding of a fraction of the path */
    0.0,
    0.5,
    0.5,
    2 * MAX_SUBSTEPS, /* one step may use all of its substeps */
    16.0,
    16.0, /* for errors of second order a quarter of the substeps then suffices */
};
/* Substeps of each segment between cuts on which instants of first sliding are searched; and
 * substeps into which those that contain an instant are cut, of each recorded part of a path: at
 * most, and at most over the number of asperities. Chosen. */
#define TIMED_SUBSTEPS 32
#define MAX_TIMED_SUBSTEPS 1024
#define MAX_TIMED_WORK 200000
/* Parts of a substep that contains instants, besides cuts next to its estimates of them at its
 * squared length, with which errors of most estimates fall, since friction and displacement are
 * linear on a substep; chosen. */
#define PARTS_OF_SUBSTEP 4
/* Path fractions below which a substep is not cut: between two such cuts, and elsewhere, where
 * estimates are poor; chosen. */
#define MIN_ESTIMATED_LENGTH 1e-5
#define MIN_TIMED_LENGTH 1e-7
/* Tolerances over the tolerance of ramps of both loads: of loads and displacements; and of
 * energies, slid distances, worn volumes and shapes, relative to themselves. Chosen. */
#define STATE_TOLERANCE_FACTOR 100.0
#define ENERGY_TOLERANCE_FACTOR 1000.0
/* Change of loads and energies by merged vertices, over their tolerances; chosen. */
#define MERGE_TOLERANCE 0.2
/* Slid distance over the displacement of the contact, and erased over dissipated energy, that are
 * negligible; chosen. */
#define NEGLIGIBLE 1e-3

/* Largest change of a quantity of asperities from coarser to finer substeps, over a fraction of its
 * largest change on the path. */
static double relative_change(const double *start, const double *coarse, const double *fine,
                              int64_t count, double tolerance, double min_change,
                              double *made_by_most) {
    double change = 0.0, change_of_path = min_change, size = 0.0;
    for (int64_t i = 0; i < count; ++i) {
        change = hs_max(change, fabs(fine[i] - coarse[i]));
        change_of_path = hs_max(change_of_path, fabs(fine[i] - start[i]));
        size = hs_max(size, fabs(fine[i]));
    }
    *made_by_most = change_of_path;
    return hs_error(change, 64.0 * DBL_EPSILON * size, tolerance * change_of_path);
}

/* A step in substeps: the state at its end, and the energy dissipated up to the end of each
 * substep. */
typedef struct substeps {
    hs_line *state;
    double *dissipated; /* (capacity + 1), at the start of the step first */
    int64_t count, capacity;
} substeps;

/* Sum over substeps of the difference in dissipated energy between one and the two that halve it.
 * The sum at the end alone may agree by coincidence, where sticking turns into sliding in one
 * substep; the sum of magnitudes does not. */
static double energy_difference(const substeps *coarse, const substeps *fine) {
    const double *coarse_evolved = coarse->dissipated, *two = fine->dissipated;
    double sum = 0.0;
    for (int64_t k = 1; k <= coarse->count; ++k)
        sum += fabs((coarse_evolved[k] - coarse_evolved[k - 1]) - (two[2 * k] - two[2 * k - 2]));
    return sum;
}

/* Error of substeps, compared with half of their number. Changes are measured by those of the whole
 * path, of which a step may be a part. */
static double error_of_substeps(hs_fields *ctx, const hs_adaptive *settings, const hs_line *start,
                                const substeps *half_as_many, const substeps *substeps) {
    const hs_line *coarse = half_as_many->state, *fine = substeps->state;
    double tolerance = STATE_TOLERANCE_FACTOR * settings->tolerance,
           rough = ENERGY_TOLERANCE_FACTOR * settings->tolerance;
    double top = hs_max(coarse->approach, start->approach) - fine->contact->sorted_gap[0];
    hs_evolved none;
    memset(&none, 0, sizeof none);
    const hs_evolved *from = start->evolved ? start->evolved : &none,
                     *coarse_evolved = from == &none ? from : coarse->evolved,
                     *fine_evolved = from == &none ? from : fine->evolved;
    int64_t count = from == &none ? 0 : fine->contact->count;
    double sizes[] = {hs_max(hs_friction_range(fine, HUGE_VAL).max, 1e-300) * hs_max(top, 0.0),
                      hs_friction_limit(fine, fine->approach, fine->normal_load), top,
                      /* energy relative to itself or to the stored energy */
                      hs_max(fine->dissipated - start->dissipated, hs_elastic_energy(fine, NULL)),
                      fabs(fine->displacement - start->displacement) *
                          fine->contact->units.displacement,
                      fabs(fine_evolved->erased_energy - from->erased_energy)};
    double *size = ctx->scale;
    for (int k = 0; k < 6; ++k) size[k] = hs_max(sizes[k], ctx->min_scale[k]);
    double unit = fine->contact->units.energy,
           erased = hs_max(size[5], NEGLIGIBLE * size[3] * unit);
    double state[] = {
        hs_error(fine->displacement - coarse->displacement, 0.0, tolerance * size[0]),
        hs_error(fine->tangential_load - coarse->tangential_load, 0.0, tolerance * size[1]),
        hs_error(fine->approach - coarse->approach, 0.0, tolerance * size[2]),
        hs_error(energy_difference(half_as_many, substeps), 0.0, rough * size[3]),
        hs_error(fine_evolved->erased_energy - coarse_evolved->erased_energy, 0.0, rough * erased)};
    double error = 0.0;
    for (size_t k = 0; k < sizeof state / sizeof *state; ++k) error = hs_max(error, state[k]);
    double slid =
        relative_change(from->slid_distance, coarse_evolved->slid_distance,
                        fine_evolved->slid_distance, count, rough, ctx->min_scale[6], size + 6);
    /* asperities that slide for a moment only, as they separate, need no relative accuracy */
    double fraction =
        size[6] > 0.0 && size[6] < NEGLIGIBLE * size[4] ? size[6] / (NEGLIGIBLE * size[4]) : 1.0;
    const double *start_fraction[] = {from->worn_volume, from->summit_height, from->summit_radius};
    const double *coarse_values[] = {coarse_evolved->worn_volume, coarse_evolved->summit_height,
                                     coarse_evolved->summit_radius};
    const double *fine_values[] = {fine_evolved->worn_volume, fine_evolved->summit_height,
                                   fine_evolved->summit_radius};
    error = hs_max(error, fraction * slid);
    for (int k = 0; k < 3 && ctx->has_wear; ++k)
        error = hs_max(error, fraction * relative_change(start_fraction[k], coarse_values[k],
                                                         fine_values[k], count, rough,
                                                         ctx->min_scale[7 + k], size + 7 + k));
    return error;
}

/* Extrapolate the energy of the finer substeps, whose error falls with the square of their number.
 */
static void extrapolate(hs_fields *ctx, const hs_line *start, const hs_line *coarse,
                        hs_line *fine) {
    int64_t count = fine->contact->count;
    for (int64_t i = 0; i < count; ++i)
        ctx->shape.energy[coarse->contact->order[i]] = coarse->dissipated_each[i];
    for (int64_t i = 0; i < count; ++i)
        ctx->start_energy[start->contact->order[i]] = start->dissipated_each[i];
    for (int64_t i = 0; i < count; ++i) {
        int64_t asperity = fine->contact->order[i];
        fine->dissipated_each[i] = hs_extrapolate(
            ctx->start_energy[asperity], ctx->shape.energy[asperity], fine->dissipated_each[i]);
    }
    fine->dissipated = hs_extrapolate(start->dissipated, coarse->dissipated, fine->dissipated);
}

/* Next cut after a path fraction, or the end. */
static double next_cut(const hs_fields *ctx, double fraction, double end) {
    for (int64_t k = 0; k < ctx->cut_count; ++k)
        if (ctx->cut[k] > fraction) return hs_min(ctx->cut[k], end);
    return end;
}

static int append_energy(substeps *substeps) {
    if (substeps->count == substeps->capacity) {
        int64_t capacity = 2 * substeps->capacity + 17;
        double *grown =
            (double *)realloc(substeps->dissipated, (size_t)(capacity + 1) * sizeof *grown);
        if (!grown) return HS_OUT_OF_MEMORY;
        substeps->dissipated = grown;
        substeps->capacity = capacity;
    }
    substeps->dissipated[++substeps->count] = substeps->state->dissipated;
    return HS_OK;
}

/* Integrate a copy of a memory between two path fractions, in a number of substeps from cut to cut.
 */
static int integrate_substeps(hs_fields *ctx, const hs_line *start, substeps *substeps,
                              double start_fraction, double fraction, int substeps_per_cut,
                              int64_t *budget) {
    hs_line *memory = substeps->state;
    if (ctx->has_wear || ctx->has_yielding) hs_contact_assign(memory->contact, start->contact);
    int status = hs_line_assign(memory, start);
    substeps->count = -1;
    if (status == HS_OK) status = append_energy(substeps);
    for (double begin_fraction = start_fraction; begin_fraction < fraction && status == HS_OK;) {
        double stop = next_cut(ctx, begin_fraction, fraction);
        for (int k = 1; k <= substeps_per_cut && status == HS_OK; ++k, --*budget) {
            double substep_begin = k == 1
                                       ? begin_fraction
                                       : begin_fraction + (stop - begin_fraction) *
                                                              ((double)(k - 1) / substeps_per_cut);
            status = hs_advance_step(ctx, memory, substep_begin,
                                     k == substeps_per_cut
                                         ? stop
                                         : begin_fraction + (stop - begin_fraction) *
                                                                ((double)k / substeps_per_cut));
            if (status == HS_OK) status = append_energy(substeps);
            if (status == HS_OK)
                status = hs_count_work(ctx->drive, &ctx->work, 8 + memory->contact->count);
        }
        begin_fraction = stop;
    }
    return status;
}

/* Part of a path, as an integrand. */
typedef struct path_integral {
    hs_fields *ctx;
    hs_line *present;
    substeps coarse, fine;
    hs_line *start; /* start of a path that is integrated in halves, else NULL */
    hs_adaptive settings;
} path_integral;

static int integrate_step(hs_integrand *integrand, const hs_interval *step, int substeps_per_cut,
                          double *error) {
    path_integral *path = (path_integral *)integrand->context;
    int coarse_values = substeps_per_cut == path->settings.initial_substeps;
    if (substeps_per_cut > 2 * path->settings.initial_substeps) {
        substeps coarse = path->coarse;
        path->coarse = path->fine;
        path->fine = coarse;
    }
    int status =
        integrate_substeps(path->ctx, path->present, coarse_values ? &path->coarse : &path->fine,
                           step->begin, step->end, substeps_per_cut, &integrand->substep_budget);
    *error = HUGE_VAL;
    if (!coarse_values && status == HS_OK)
        *error = error_of_substeps(path->ctx, &path->settings, path->present, &path->coarse,
                                   &path->fine);
    return status;
}

static void merge_vertices(hs_line *memory, double tolerance) {
    const double load_tolerance = MERGE_TOLERANCE * STATE_TOLERANCE_FACTOR * tolerance,
                 energy_tolerance = MERGE_TOLERANCE * ENERGY_TOLERANCE_FACTOR * tolerance;
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index) {
        hs_group group = hs_group_of(memory, index);
        memory->depth[index] =
            hs_merge_vertices(&group, memory->depth[index], load_tolerance, energy_tolerance);
        if (memory->steep[index])
            memory->steep[index] =
                (uint8_t)hs_is_steep(group.stack, memory->depth[index], group.friction);
    }
}

static int accept_step(hs_integrand *integrand, const hs_interval *step) {
    path_integral *path = (path_integral *)integrand->context;
    (void)step;
    extrapolate(path->ctx, path->present, path->coarse.state, path->fine.state);
    hs_line_swap(path->present, path->fine.state);
    merge_vertices(path->present, path->ctx->drive->tolerance);
    return HS_OK;
}

/* Shorten a step whose error falls slowly because of one instant: to a fraction of the tolerance,
 * since errors of halves add up. */
static int shorten_step(hs_integrand *integrand, const hs_interval *step) {
    path_integral *path = (path_integral *)integrand->context;
    hs_fields *ctx = path->ctx;
    (void)step;
    for (int k = 0; k < SCALES; ++k) ctx->min_scale[k] = hs_max(ctx->min_scale[k], ctx->scale[k]);
    if (path->start) return HS_OK;
    path->settings.tolerance *= HALVES_TOLERANCE;
    path->settings.initial_substeps = INITIAL_SUBSTEPS;
    path->start = hs_copy_unshared(ctx, path->present);
    return path->start ? HS_OK : HS_OUT_OF_MEMORY;
}

int hs_integrate_substeps(hs_fields *ctx, hs_line *memory, hs_line *coarse, hs_line *fine,
                          double start_fraction, double fraction) {
    const hs_plan *plan = &ctx->plan;
    double touch = memory->contact->sorted_gap[0];
    /* a gap is crossed without load, before the ramp begins */
    if (plan->both_loads && plan->approach[0] < touch)
        memory->approach = hs_max(memory->approach, hs_min(touch, plan->approach[1]));
    double top = hs_max(plan->approach[0], plan->approach[1]) - touch;
    int little = fabs(plan->approach[1] - plan->approach[0]) * (fraction - start_fraction) <=
                     SMALL_APPROACH_CHANGE * top &&
                 !ctx->evolution->goal;
    if (ctx->evolution->law.kind != HS_NO_LAW &&
        ctx->evolution->law.depends_on == HS_ON_SLID_DISTANCE)
        little = 0;
    int fewest = little ? MIN_SUBSTEPS : INITIAL_SUBSTEPS, pieces = 1;
    for (double cut = next_cut(ctx, start_fraction, fraction); cut < fraction;
         cut = next_cut(ctx, cut, fraction))
        ++pieces;
    hs_adaptive settings = substep_settings;
    settings.tolerance = ctx->drive->tolerance;
    settings.initial_substeps = pieces < fewest ? fewest / pieces : 1;
    for (;;) {
        path_integral path = {ctx,  memory,  {coarse, NULL, -1, -1}, {fine, NULL, -1, -1},
                              NULL, settings};
        hs_integrand integrand = {
            &path, &path.settings, integrate_step, accept_step, shorten_step, 0, 0.0};
        memset(ctx->min_scale, 0, sizeof ctx->min_scale);
        int status = hs_adapt(&integrand, start_fraction, fraction);
        if (status == HS_TOO_MANY_SUBSTEPS) hs_line_swap(memory, path.start);
        hs_line_free(path.start);
        free(path.coarse.dissipated);
        free(path.fine.dissipated);
        if (status != HS_TOO_MANY_SUBSTEPS) return status;
        hs_coarsen(&settings, integrand.reached);
    }
}

/* Number of asperities that have slid as a whole. */
static int64_t count_slid(const hs_line *memory) {
    int64_t number = 0;
    for (int64_t i = 0; i < memory->contact->count; ++i) number += hs_has_slid(memory, i);
    return number;
}

static int compare_fractions(const void *coarse_evolved, const void *fine_evolved) {
    double a = *(const double *)coarse_evolved, b = *(const double *)fine_evolved;
    return (a > b) - (a < b);
}

/* Write the fractions at which to cut a substep on which asperities first slide, and its end;
 * returns their number. */
static int64_t cuts_around_slides(const hs_fields *ctx, const hs_line *start, const hs_line *memory,
                                  double start_fraction, double end, double margin, double *cut) {
    const double *times = ctx->plan.times, apart = 0.25 * MIN_TIMED_LENGTH;
    int64_t count = 0, kept_count = 0;
    for (int tolerance = 1; tolerance < PARTS_OF_SUBSTEP; ++tolerance)
        cut[count++] = hs_toward(start_fraction, end, (double)tolerance / PARTS_OF_SUBSTEP);
    for (int64_t i = 0; i < memory->contact->count; ++i) {
        if (!hs_has_slid(memory, i) || hs_has_slid(start, i)) continue;
        double instant = (memory->slides->time[i] - times[0]) / (times[1] - times[0]);
        cut[count++] = instant - margin;
        cut[count++] = instant + margin;
    }
    qsort(cut, (size_t)count, sizeof *cut, compare_fractions);
    for (int64_t k = 0; k < count; ++k)
        if (cut[k] > (kept_count ? cut[kept_count - 1] : start_fraction) + apart &&
            cut[k] < end - apart)
            cut[kept_count++] = cut[k];
    cut[kept_count++] = end;
    return kept_count;
}

/* Integrate a memory in substeps with given ends. Substeps on which asperities first slide are cut
 * and repeated, down to the `shortest`. */
static int time_slides(hs_fields *ctx, hs_line *memory, double start_fraction, const double *end,
                       int64_t substeps_per_cut, double shortest, int64_t *budget) {
    int status = HS_OK;
    for (int64_t k = 0; k < substeps_per_cut && status == HS_OK; start_fraction = end[k++]) {
        double length = end[k] - start_fraction;
        hs_line *start = hs_copy_unshared(ctx, memory);
        if (!start) return HS_OUT_OF_MEMORY;
        status = hs_advance_step(ctx, memory, start_fraction, end[k]);
        if (status == HS_OK)
            status = hs_count_work(ctx->drive, &ctx->work, 8 + memory->contact->count);
        int64_t fresh = status == HS_OK ? count_slid(memory) - count_slid(start) : 0;
        if (fresh > 0 && *budget > 0 && length > shortest) {
            double margin = hs_max(length * length, 0.25 * MIN_TIMED_LENGTH),
                   apart = 2.0 * margin + HS_TIE;
            double *cut = (double *)malloc((size_t)(2 * fresh + PARTS_OF_SUBSTEP) * sizeof *cut);
            if (!cut) status = HS_OUT_OF_MEMORY;
            int64_t cuts =
                cut ? cuts_around_slides(ctx, start, memory, start_fraction, end[k], margin, cut)
                    : 0;
            *budget -= cuts;
            if (cut)
                status =
                    time_slides(ctx, start, start_fraction, cut, cuts,
                                apart <= MIN_ESTIMATED_LENGTH ? apart : MIN_TIMED_LENGTH, budget);
            free(cut);
            hs_line_swap(memory, start);
        }
        hs_line_free(start);
    }
    return status;
}

/* Record the instants at which asperities first slide on a part of the path. */
static int time_path(hs_fields *ctx, hs_line *memory, double start_fraction, double fraction) {
    const int64_t count = memory->contact->count;
    int64_t budget =
        MAX_TIMED_WORK / count < MAX_TIMED_SUBSTEPS ? MAX_TIMED_WORK / count : MAX_TIMED_SUBSTEPS;
    const int substeps_per_cut = (int)(TIMED_SUBSTEPS * (fraction - start_fraction)) + 1;
    double end[TIMED_SUBSTEPS + 1];
    int status = HS_OK;
    for (double begin_fraction = start_fraction; begin_fraction < fraction && status == HS_OK;) {
        double stop = next_cut(ctx, begin_fraction, fraction);
        for (int k = 1; k <= substeps_per_cut; ++k)
            end[k - 1] =
                k == substeps_per_cut
                    ? stop
                    : begin_fraction + (stop - begin_fraction) * ((double)k / substeps_per_cut);
        status = time_slides(ctx, memory, begin_fraction, end, substeps_per_cut, MIN_TIMED_LENGTH,
                             &budget);
        begin_fraction = stop;
    }
    return status;
}

/* True if asperities first slide at the instants of a contact without wear: they keep their shapes
 * until they slide, and depend on no other where both displacements are prescribed. */
static int has_unworn_times(const hs_fields *ctx) {
    const hs_plan *plan = &ctx->plan;
    const hs_law *law = &ctx->evolution->law;
    if (ctx->has_yielding || ctx->evolution->goal ||
        (law->kind != HS_NO_LAW && law->depends_on != HS_ON_NOTHING))
        return 0;
    return !plan->normal_by_load &&
           (plan->is_straight || !(plan->tangential_by_load || ctx->compliance > 0.0));
}

/* Record the instants of first sliding on a straight path to the displacements of another memory,
 * without wear. */
static int time_unworn(const hs_fields *ctx, hs_line *timed, const hs_line *memory,
                       double fraction) {
    double load = hs_load_at(hs_all_of(timed->contact), memory->approach).load;
    hs_tick(timed, hs_toward(ctx->plan.times[0], ctx->plan.times[1], fraction));
    return hs_move(timed, memory->approach, load, hs_to_displacement(memory->displacement));
}

int hs_integrate_timed(hs_fields *ctx, hs_line *memory, double start_fraction, double fraction) {
    int64_t slid = count_slid(memory), count = memory->contact->count;
    int timed = hs_is_timed(memory) && slid < count;
    hs_line *start = timed ? hs_copy_unshared(ctx, memory) : NULL, *timed_state = NULL;
    if (timed && !start) return HS_OUT_OF_MEMORY;
    int status = hs_integrate_substeps(ctx, memory, ctx->copies[0], ctx->copies[1], start_fraction,
                                       fraction);
    if (status == HS_OK && start && count_slid(memory) > slid) {
        timed_state = hs_copy_unshared(ctx, start);
        if (!timed_state)
            status = HS_OUT_OF_MEMORY;
        else if (has_unworn_times(ctx))
            status = time_unworn(ctx, timed_state, memory, fraction);
        else
            status = time_path(ctx, timed_state, start_fraction, fraction);
        if (status == HS_OK) status = hs_slides_replace(memory, start, timed_state);
    }
    hs_line_free(timed_state);
    hs_line_free(start);
    return status;
}
