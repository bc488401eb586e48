/* Ramp: a straight path in (N, T), carried out by straight paths in (d, V), its chords, which end
 * in the same state. Energies of a single group are those of front.c; of several groups they are
 * those of a polynomial through points of the ramp (losses.h; README.md, theory 10).
 *
 * A group reaches the same state on the ramp and on its chord, the straight path in (d, V) between
 * the same ends, if side·V - μ d is largest at one of the ends, and if no spring that touches on
 * the way sticks at the end. Otherwise its springs are off by at most the distance of ramp and
 * chord. Steps of the ramp are cut where |dV/dd| = μ of a group, and shortened until that distance
 * is tolerated. */

#include "ramp.h"
#include "adaptive.h"
#include "drive.h"
#include "slides.h"

/* Fractions of a step at which points of the ramp are solved for: the first two, and between them
 * the third if the error needs it. */
static const double inner_fraction[HS_RAMP_TERMS] = {0.25, 0.75, 0.5};
/* Points of a step at which side·V - μ d is compared with its ends; chosen. */
#define SAMPLES 8
/* Tolerances over the caller's: of springs over the displacement at which all slides, and of the
 * energy of a step over itself. Chosen: at the default tolerance the ends of ramps are within 2e-6
 * of full slip (tests/memory/test_ramp.py) */
#define STATE_TOLERANCE 0.6
#define ENERGY_TOLERANCE 60.0
/* Smallest tolerance, above the rounding of energies; chosen. */
#define LEAST_TOLERANCE 1e-11
/* Accuracy of points of the ramp, relative to the length of the chord, to which the last iterate is
 * much closer; chosen. */
#define POINT_ACCURACY 1e-3
/* Rounding of the coefficients of an interpolation; and slip to which the energy of a step is
 * related, relative to the length of the chord, at least. Chosen. */
#define ROUNDING (8.0 * HS_TIE)
#define LEAST_SLIP 1e-3
/* Ratio of successive terms of an interpolation, at least: for small bows, its growth with the bow,
 * and for large ones; chosen. */
#define LEAST_RATIO 0.05
#define GROWTH_OF_RATIO 1.0
#define MOST_RATIO 0.3
/* Part of the slip of a group by which side·V - μ d may first decrease, since its energy hardly
 * changes; chosen. */
#define DIP 3e-3
/* Smallest fraction of the tolerance of a ramp that a short step may use; chosen. */
#define LEAST_PART 0.05
/* Length of the next step over the one predicted; error for which half a step is predicted. Chosen
 */
#define SAFETY 0.9
#define TO_HALVE (4.0 * SAFETY * SAFETY)
/* Steps up to this multiple of the tolerance, as parts of a ramp, have the energy of their chord if
 * the ramp cannot be interpolated. Chosen */
#define SHORT 1.0

typedef struct ramp {
    hs_line *memory;
    double load[2], force[2], times[2];
    double tolerance, reach; /* of the caller; displacement at which all slides */
    const hs_drive *drive;
    int64_t work;
    /* of the present step: its end, and points of the ramp at fractions of the step, which are at
     * fractions u of the chord */
    hs_ramp_curve curve;
    int count;
    hs_point point[HS_RAMP_TERMS];
    hs_group_loads loads;
    double end_load, end_force, end_time;
    double length, whole_length, u[HS_RAMP_TERMS], fraction[HS_RAMP_TERMS];
} ramp;

/* Solve for a point of the ramp at a fraction of a step, from a guess of its displacement. */
static int solve_point(ramp *way, hs_fronts *fronts, double fraction, double guess,
                       hs_point *point) {
    hs_line *memory = way->memory;
    hs_group_loads loads;
    const double load = hs_toward(memory->normal_load, way->end_load, fraction),
                 force = hs_toward(memory->tangential_load, way->end_force, fraction);
    point->d = hs_label_at(hs_all_of(memory->contact), load,
                           hs_toward(way->curve.from.d, way->curve.to.d, fraction), 0.0, 1.0);
    point->v = guess;
    int status = hs_loads_of_groups(memory, point->d, load, &loads);
    if (status != HS_OK) return status;
    status =
        hs_refine_displacement(memory, &loads, fronts, force, POINT_ACCURACY * way->length, point);
    hs_free_group_loads(&loads);
    return status;
}

/* Set `c` such that u (1 - u) Σ c u^k is `value` at `count` fractions u. */
static void fit_bow(const double *u, const double *value, int count, double *c) {
    double y[HS_RAMP_TERMS];
    for (int k = 0; k < count; ++k) y[k] = value[k] / (u[k] * (1.0 - u[k]));
    /* Newton's divided differences */
    double first = (y[1] - y[0]) / (u[1] - u[0]);
    c[2] = count > 2 ? ((y[2] - y[1]) / (u[2] - u[1]) - first) / (u[2] - u[0]) : 0.0;
    c[1] = first - c[2] * (u[0] + u[1]);
    c[0] = y[0] - u[0] * (first - c[2] * u[1]);
}

/* Interpolate the ramp from its points; returns an estimate of the error of its distance from the
 * chord, over the length of the chord: of the next term, if terms fall as the known ones do.
 * Infinite if there is no interpolation. */
static double fit_curve(ramp *way) {
    const hs_ramp_curve *curve = &way->curve;
    const double across = way->curve.friction * (curve->to.d - curve->from.d),
                 along = curve->to.v - curve->from.v, square = way->length * way->length;
    double w[HS_RAMP_TERMS], previous = 0.0, *c = way->curve.c;
    for (int k = 0; k < way->count; ++k) {
        double x = way->curve.friction * (way->point[k].d - curve->from.d),
               y = way->point[k].v - curve->from.v;
        way->u[k] = (x * across + y * along) / square;
        w[k] = (y * across - x * along) / square;
        if (!(previous < way->u[k] && way->u[k] < 1.0)) return HUGE_VAL;
        previous = way->u[k];
    }
    fit_bow(way->u, w, way->count, c);
    /* coefficients of Chebyshev polynomials */
    double even = fabs(c[0] + 0.5 * c[1] + 0.375 * c[2]), odd = fabs(0.5 * (c[1] + c[2])),
           last = fabs(0.125 * c[2]);
    /* terms may be small by coincidence */
    const double ratio = hs_min(LEAST_RATIO + GROWTH_OF_RATIO * even, MOST_RATIO);
    odd = hs_max(odd, ratio * even);
    if (way->count == 2) return odd * hs_max(ratio, hs_min(even > 0.0 ? odd / even : 1.0, 1.0));
    last = hs_max(last, ratio * odd);
    return last * hs_max(ratio, hs_min(odd > 0.0 ? hs_max(odd / even, last / odd) : 1.0, 1.0));
}

/* Distance of the ramp from its chord, over the length of the chord. */
static double distance_at(const ramp *way, double u) {
    return u * (1.0 - u) * (way->curve.c[0] + u * (way->curve.c[1] + u * way->curve.c[2]));
}

static hs_point point_on(const ramp *way, double u) {
    const hs_ramp_curve *curve = &way->curve;
    double rise = curve->to.d - curve->from.d, change = curve->to.v - curve->from.v;
    double w = distance_at(way, u);
    return HS_MADE(hs_point){curve->from.d + u * rise - w * change / way->curve.friction,
                             curve->from.v + u * change + w * way->curve.friction * rise};
}

/* Fraction of a step at a fraction u of its chord, by linear interpolation between points. */
static double fraction_at(const ramp *way, double u) {
    double from = 0.0, start = 0.0;
    for (int k = 0; k < way->count && way->u[k] < u; ++k) {
        from = way->u[k];
        start = way->fraction[k];
    }
    for (int k = 0; k < way->count; ++k)
        if (way->u[k] >= u)
            return hs_toward(start, way->fraction[k], (u - from) / (way->u[k] - from));
    return hs_toward(start, 1.0, (u - from) / (1.0 - from));
}

/* Fraction of a step at which samples, times a sign, have a maximum that exceeds both ends by more
 * than tolerated, by a parabola through three samples; 1 if there is none. */
static double find_top(const ramp *way, const double *sample, double sign, double tolerated) {
    double farthest = hs_max(sign * sample[0], sign * sample[SAMPLES]) + tolerated;
    int at = 0;
    for (int j = 1; j < SAMPLES; ++j) {
        if (sign * sample[j] <= farthest) continue;
        farthest = sign * sample[j];
        at = j;
    }
    if (at == 0) return 1.0;
    double before = sample[at] - sample[at - 1], after = sample[at] - sample[at + 1];
    double top = before + after != 0.0 ? 0.5 * (before - after) / (before + after) : 0.0;
    return fraction_at(way, (at + top) / SAMPLES);
}

/* Difference of the states at the ends of ramp and chord, over the tolerance; `crossing` is the
 * first fraction at which |dV/dd| crosses the coefficient of a group that would be too far off,
 * or 1. */
static double state_error(const ramp *way, double *crossing) {
    const hs_line *memory = way->memory;
    const hs_point *from = &way->curve.from, *to = &way->curve.to;
    const double tolerated = STATE_TOLERANCE * way->tolerance * way->reach, rise = to->d - from->d,
                 change = fabs(to->v - from->v);
    double most = 0.0, bow = 0.0, lowest = HUGE_VAL, highest = -HUGE_VAL;
    hs_point point[SAMPLES + 1];
    *crossing = 1.0;
    for (int j = 0; j <= SAMPLES; ++j) {
        double u = (double)j / SAMPLES;
        bow = hs_max(bow, fabs(distance_at(way, u)) * way->length);
        point[j] = point_on(way, u);
        /* the range of dV/dd, unbounded where the approach turns */
        if (j == 0) continue;
        const double deeper = point[j].d - point[j - 1].d, moved = point[j].v - point[j - 1].v;
        const int turns = !(deeper * rise > 0.0);
        lowest = hs_min(lowest, turns ? -HUGE_VAL : moved / deeper);
        highest = hs_max(highest, turns ? HUGE_VAL : moved / deeper);
    }
    for (int64_t index = 0; index < memory->contact->groups; ++index) {
        const double friction = memory->friction[index];
        if (memory->contact->gap[memory->contact->first[index]] >= hs_max(from->d, to->d)) break;
        if (rise > 0.0 && change < friction * rise) most = bow;
        const int crosses = (lowest <= friction && friction <= highest) ||
                            (lowest <= -friction && -friction <= highest);
        if (bow <= tolerated || !crosses) continue;
        for (int side = -1; side <= 1; side += 2) {
            double reached[SAMPLES + 1];
            for (int j = 0; j <= SAMPLES; ++j)
                reached[j] = side * point[j].v - friction * point[j].d;
            const double slip = reached[SAMPLES] - reached[0];
            *crossing = hs_min(*crossing, find_top(way, reached, 1.0, tolerated));
            if (slip > 0.0)
                *crossing =
                    hs_min(*crossing, find_top(way, reached, -1.0, hs_max(tolerated, DIP * slip)));
        }
    }
    return most / tolerated;
}

static const hs_adaptive ramp_settings = {
    0.0, /* the tolerance is set from the drive's */
    1.0, /* accepted at once: the error is compared with points of the ramp itself */
    1,       INT_MAX, 0.0, /* shortened at once: the error predicts a length that fits */
    1.0,     1e-9,         /* well above the rounding of a fraction of the ramp */
    SAFETY,                /* errors of the next step may be somewhat larger */
    0.02,    4.0, /* a cut is found within this part of a step; behind it the whole rest is tried */
    1 << 13,      /* bounds the time of a ramp */
    4.0,     1e4, /* the rest of the ramp may be easier or harder than the part that was integrated
                   */
};

/* Solve for points of the ramp between the ends of a step; returns a status. The error is that of
 * the energy, 1 if it is just tolerated. */
static int solve_curve(ramp *way, hs_fronts *fronts, double part, double *error) {
    hs_ramp_curve *curve = &way->curve;
    const hs_point from = curve->from, to = curve->to;
    const double change = fabs(to.v - from.v),
                 friction = hs_friction_range(way->memory, hs_max(from.d, to.d)).min;
    const double slip =
        hs_max(change - friction * hs_max(to.d - from.d, 0.0), LEAST_SLIP * way->length);
    const double rounding = ROUNDING * (way->reach + fabs(from.v) + fabs(to.v)) / way->length;
    for (way->count = 0; way->count < HS_RAMP_TERMS;) {
        double fraction = inner_fraction[way->count], u = fraction, offset = 0.0;
        int at = way->count;
        if (at == 1) {
            /* the curvature of the displacement over the fraction of the ramp */
            double early = way->fraction[0];
            offset = (way->point[0].v - hs_toward(from.v, to.v, early)) *
                     (u * (1.0 - u) / (early * (1.0 - early)));
        } else if (at == 2) {
            double mean = 0.0;
            for (int k = 0; k < 2; ++k)
                mean += 0.5 * (way->point[k].v - hs_toward(from.v, to.v, way->fraction[k]));
            offset = mean * (0.25 / 0.1875);
            way->point[2] = way->point[1];
            way->fraction[2] = way->fraction[1];
            at = 1;
        }
        int status = solve_point(way, fronts, fraction, hs_toward(from.v, to.v, u) + offset,
                                 way->point + at);
        if (status != HS_OK) return status;
        way->fraction[at] = fraction;
        ++way->count;
        if (way->count < 2) continue;
        double missed = fit_curve(way), ratio = way->length / slip;
        double tolerated = ENERGY_TOLERANCE * way->tolerance * hs_max(part, LEAST_PART) *
                           way->whole_length / (way->length * ratio);
        /* of fourth order at least */
        *error = sqrt(hs_error(missed, rounding, tolerated));
        if (*error <= 0.3) break;
    }
    return HS_OK;
}

/* Integrate a step of a ramp: its end, and points of the ramp. */
static int integrate_step(hs_integrand *integrand, const hs_interval *step, int chords,
                          double *error) {
    ramp *way = (ramp *)integrand->context;
    hs_line *memory = way->memory;
    hs_ramp_curve *curve = &way->curve;
    hs_fronts fronts;
    (void)chords;
    --integrand->substep_budget;
    way->end_load = hs_toward(way->load[0], way->load[1], step->end);
    way->end_force = hs_toward(way->force[0], way->force[1], step->end);
    way->end_time = hs_toward(way->times[0], way->times[1], step->end);
    curve->from = HS_MADE(hs_point){memory->approach, memory->displacement};
    curve->to.d = hs_approach_at_load(memory, way->end_load);
    way->count = 0;
    hs_free_group_loads(&way->loads);
    way->loads.load = way->loads.single_load;
    int status = hs_count_work(way->drive, &way->work, 2 + memory->contact->count / 16);
    if (status == HS_OK)
        status = hs_loads_of_groups(memory, curve->to.d, way->end_load, &way->loads);
    if (status != HS_OK) return status;
    status = hs_init_fronts(&fronts, memory->contact->groups);
    if (status == HS_OK)
        status = hs_solve_displacement_with(memory, &way->loads, &fronts, curve->to.d,
                                            hs_to_load(way->end_force), &curve->to.v);
    const double across = way->curve.friction * (curve->to.d - curve->from.d),
                 along = curve->to.v - curve->from.v;
    double crossing = 1.0;
    way->length = sqrt(across * across + along * along);
    const double part = step->end - step->begin;
    way->whole_length = hs_max(way->whole_length, way->length);
    *error = 0.0;
    if (status == HS_OK && way->length > 0.0) {
        status = solve_curve(way, &fronts, part, error);
        if (*error < HUGE_VAL) {
            *error = hs_max(*error, state_error(way, &crossing));
            if (crossing < 1.0) *error = hs_max(SAFETY * SAFETY / (crossing * crossing), *error);
        } else {
            *error = TO_HALVE;
            if (part <= SHORT * way->tolerance) *error = way->count = 0;
        }
        if (part <= 2.0 * ramp_settings.min_length) *error = 0.0;
    }
    hs_free_fronts(&fronts);
    return status;
}

static int accept_step(hs_integrand *integrand, const hs_interval *step) {
    ramp *way = (ramp *)integrand->context;
    hs_line *memory = way->memory;
    const hs_ramp_curve *curve = &way->curve;
    (void)step;
    int status = hs_reserve_vertices(memory);
    hs_begin_ramp(memory, way->end_load, way->end_force, way->end_time);
    if (status == HS_OK && hs_is_timed(memory)) {
        hs_fronts fronts;
        status = hs_init_fronts(&fronts, memory->contact->groups);
        if (status == HS_OK)
            status = hs_record_slides_on_ramp(memory, curve->to, &way->loads, &fronts);
        hs_free_fronts(&fronts);
    }
    if (status != HS_OK) return status;
    return hs_move_with_loads(memory, &way->loads, curve->to.d, way->end_load,
                              hs_to_load(way->end_force), hs_to_displacement(curve->to.v),
                              way->count ? &way->curve : NULL);
}

/* Move all groups along the straight ramp in (N, T) to (load, force), which ends at a time. */
int hs_ramp(hs_line *memory, double load, double force, double time, const hs_drive *drive) {
    const hs_contact *contact = memory->contact;
    const double touch = contact->sorted_gap[0];
    if (memory->approach < touch && load > 0.0) memory->approach = touch;
    const double rise = load - memory->normal_load;
    const hs_range friction = hs_friction_range(memory, HUGE_VAL);
    int sticks = fabs(force - memory->tangential_load) <= friction.min * rise;
    if (hs_has_single_group(memory) && rise != 0.0 && !sticks)
        return hs_ramp_group(memory, load, force, time, drive);
    const double d = hs_approach_at_load(memory, load);
    /* one straight path is exact where N is constant or nothing slips */
    if (rise == 0.0 || sticks) {
        hs_begin_ramp(memory, load, force, time);
        return hs_move(memory, d, load, hs_to_load(force));
    }
    ramp way;
    memset(&way, 0, sizeof way);
    way.memory = memory;
    way.load[0] = memory->normal_load;
    way.load[1] = load;
    way.force[0] = memory->tangential_load;
    way.force[1] = force;
    way.times[0] = memory->clock.end;
    way.times[1] = time;
    way.tolerance = hs_max(drive->tolerance, LEAST_TOLERANCE);
    way.curve.friction = friction.max;
    way.reach = friction.max * (hs_max(memory->approach, d) - touch);
    way.drive = drive;
    way.loads.load = way.loads.single_load;
    hs_adaptive settings = ramp_settings;
    settings.tolerance = way.tolerance;
    hs_integrand integrand = {&way, &settings, integrate_step, accept_step, NULL, 0, 0.0};
    int status = HS_TOO_MANY_SUBSTEPS;
    memory->is_direct = 1;
    for (double start = 0.0; status == HS_TOO_MANY_SUBSTEPS; start = integrand.reached) {
        status = hs_adapt(&integrand, start, 1.0);
        hs_coarsen(&settings, integrand.reached);
        way.tolerance = settings.tolerance;
    }
    memory->is_direct = 0;
    hs_free_group_loads(&way.loads);
    return status;
}
