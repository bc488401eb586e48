/* Normal curve: load P(a) with derivative and integrals, P = Σ k (a - h)^(3/2) over asperities in
 * contact, or piecewise quadratic between knots; and its inverse, by Newton's method in a bracket
 * (README.md, theory 8). */

#include "normal.h"

/* By bisection. */
int64_t hs_count_touching(const double *gap, int64_t count, double approach) {
    int64_t low = 0, high = count;
    if (count == 0 || gap[count - 1] < approach) return count;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (gap[middle] < approach)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* k √(a - h) and k (a - h)^(3/2) of asperities in contact. */
static inline void half_chords(const double *restrict gap, const double *restrict weight, int count,
                               double approach, double *restrict load,
                               double *restrict half_chord) {
    for (int i = 0; i < count; ++i) {
        double depth = approach - gap[i];
        half_chord[i] = weight[i] * sqrt(depth);
        load[i] = half_chord[i] * depth;
    }
}

/* P(a) and P'(a) of asperities 0 to touching - 1, all in contact. */
static HS_WIDE hs_load sum_of_loads(hs_curve curve, int64_t touching, double approach) {
    double load[HS_BLOCK], half_chord[HS_BLOCK], loads[HS_LANES] = {0}, slopes[HS_LANES] = {0};
    hs_chunk chunk;
    for (int64_t start = 0; start < touching; start += chunk.size) {
        hs_next_chunk(curve, start, touching, approach, &chunk);
        half_chords(chunk.gap, chunk.weight, chunk.count, approach - chunk.origin, load,
                    half_chord);
        hs_add(loads, load, chunk.count);
        hs_add(slopes, half_chord, chunk.count);
    }
    return HS_MADE(hs_load){hs_lanes_sum(loads), 1.5 * hs_lanes_sum(slopes)};
}

/* Load and stiffness of few asperities, without vectors. */
static hs_load sum_of_few(hs_curve curve, int64_t touching, double approach) {
    double loads[HS_LANES] = {0}, slopes[HS_LANES] = {0};
    for (int64_t i = 0; i < touching; ++i) {
        double depth = approach - curve.gap[i], half_chord = curve.weight[i] * sqrt(depth);
        loads[i % HS_LANES] += half_chord * depth;
        slopes[i % HS_LANES] += half_chord;
    }
    return HS_MADE(hs_load){hs_lanes_sum(loads), 1.5 * hs_lanes_sum(slopes)};
}

/* A function with versions for several processors is only hidden from programs that link the
 * library if it is static. */
hs_load hs_sum_of_loads(hs_curve curve, int64_t touching, double approach) {
    return touching <= 2 * HS_LANES && !curve.clusters ? sum_of_few(curve, touching, approach)
                                                       : sum_of_loads(curve, touching, approach);
}

/* P(a) and P'(a) of a curve with knots; linear beyond the outermost one. */
hs_load hs_load_between_knots(hs_curve curve, double approach) {
    int64_t i = hs_count_touching(curve.gap, curve.count, approach) - 1;
    hs_load result = {0.0, 0.0};
    if (i < 0) return result;
    double x = approach - curve.gap[i], half = 0.5 * hs_bend_at(curve, i) * x;
    result.load = curve.load[i] + x * (curve.weight[i] + half);
    result.slope = curve.weight[i] + 2.0 * half;
    return result;
}

/* k (a - h)^(n/2) for n = 1, 3, 5 and 7 of asperities in contact. */
static inline void half_powers(const double *restrict gap, const double *restrict weight, int count,
                               double approach, double (*restrict power)[HS_BLOCK]) {
    for (int i = 0; i < count; ++i) {
        double depth = approach - gap[i];
        power[0][i] = weight[i] * sqrt(depth);
        power[1][i] = power[0][i] * depth;
        power[2][i] = power[1][i] * depth;
        power[3][i] = power[2][i] * depth;
    }
}

static hs_normal normal_between_knots(hs_curve curve, double approach) {
    hs_load knot_load = hs_load_between_knots(curve, approach);
    hs_normal result = {knot_load.load, knot_load.slope, 0.0, 0.0};
    for (int64_t i = 0; i < curve.count && curve.gap[i] < approach; ++i) {
        double width =
            (i + 1 < curve.count ? hs_min(curve.gap[i + 1], approach) : approach) - curve.gap[i];
        if (width <= 0.0) continue;
        double load = curve.load[i], slope = curve.weight[i], bend = hs_bend_at(curve, i);
        result.twice +=
            width *
            (result.integral + width * (load / 2.0 + width * (slope / 6.0 + width * bend / 24.0)));
        result.integral += width * (load + width * (slope / 2.0 + width * bend / 6.0));
    }
    return result;
}

/* P(a), P'(a) and both integrals of asperities 0 to touching - 1, all in contact. */
HS_WIDE static hs_normal sum_of_normals(hs_curve curve, int64_t touching, double approach) {
    double power[4][HS_BLOCK], lane[4][HS_LANES] = {{0}}, sum[4];
    hs_chunk chunk;
    for (int64_t start = 0; start < touching; start += chunk.size) {
        hs_next_chunk(curve, start, touching, approach, &chunk);
        half_powers(chunk.gap, chunk.weight, chunk.count, approach - chunk.origin, power);
        for (int n = 0; n < 4; ++n) hs_add(lane[n], power[n], chunk.count);
    }
    for (int n = 0; n < 4; ++n) sum[n] = hs_lanes_sum(lane[n]);
    return HS_MADE(hs_normal){sum[1], 1.5 * sum[0], sum[2] / 2.5, sum[3] / (2.5 * 3.5)};
}

hs_normal hs_normal_at(hs_curve curve, double approach) {
    if (curve.load) return normal_between_knots(curve, approach);
    return sum_of_normals(curve, hs_count_touching(curve.gap, curve.count, approach), approach);
}

/* `hs_label_at` for a curve with knots: bisection for the interval, then a quadratic equation. */
static double label_between_knots(hs_curve curve, double total, double rigid, double compliance) {
    int64_t low = 0, high = curve.count;
    while (high - low > 1) {
        int64_t middle = (low + high) / 2;
        if (rigid * (curve.gap[middle] - curve.gap[0]) + compliance * curve.load[middle] < total)
            low = middle;
        else
            high = middle;
    }
    double remaining =
        total - (rigid * (curve.gap[low] - curve.gap[0]) + compliance * curve.load[low]);
    double slope = rigid + compliance * curve.weight[low],
           bend = compliance * hs_bend_at(curve, low);
    double label =
        curve.gap[low] + 2.0 * remaining / (slope + sqrt(slope * slope + 2.0 * bend * remaining));
    return high < curve.count ? hs_min(label, curve.gap[high]) : label;
}

/* Halley's method, of third order, and one Newton iteration; the cube root of libm differs between
 * machines. */
double hs_cube_root(double x) {
    int exponent;
    double mantissa = frexp(x, &exponent);
    while (exponent % 3 != 0) {
        mantissa *= 0.5;
        ++exponent;
    }
    double root = 0.47 + 0.55 * mantissa;
    for (int i = 0; i < 3; ++i) {
        double cube = root * root * root;
        root *= (cube + 2.0 * mantissa) / (2.0 * cube + mantissa);
    }
    root -= (root * root * root - mantissa) / (3.0 * root * root);
    return ldexp(root, exponent / 3);
}

/* For asperities by Newton's method for the power 2/3 of the equation, in a bracket. */
double hs_label_at(hs_curve curve, double total, double guess, double rigid, double compliance) {
    double gap = curve.gap[0], low = gap;
    if (total <= 0.0) return low;
    if (curve.load) return label_between_knots(curve, total, rigid, compliance);
    /* upper bound: the deepest asperity carries the total alone */
    double root = hs_cube_root(total / (compliance * curve.weight[0])), high = low + root * root;
    if (rigid > 0.0)
        high = hs_min(high, low + total / rigid);
    else if (curve.count == 1)
        return high;
    double approach = low < guess && guess <= high ? guess : high;
    for (int iteration = 0; iteration < 100; ++iteration) {
        hs_load current = hs_load_at(curve, approach);
        double present = rigid * (approach - gap) + compliance * current.load,
               slope = rigid + compliance * current.slope;
        if (present == total) return approach;
        if (present < total)
            low = approach;
        else
            high = approach;
        /* (total/present)^(2/3) - 1 without loss of digits near 1: with c³ = total/present it is (c
         * - 1)(c + 1), and c - 1 = (c³ - 1)/(c² + c + 1) */
        double ratio = total / present, c = hs_cube_root(ratio);
        double step =
            1.5 * present / slope * ((total - present) / present / (c * c + c + 1.0) * (c + 1.0));
        double trial = approach + step;
        if (!(low <= trial && trial <= high)) {
            trial = 0.5 * (low + high);
            if (trial == low || trial == high) return trial;
        } else if (fabs(step) <= 1e-10 * (trial - gap)) {
            /* quadratic convergence: the error of `trial` is below rounding */
            return trial;
        }
        approach = trial;
    }
    return approach;
}

double hs_approach_at(const hs_contact *contact, double normal_load) {
    double load = normal_load / contact->units.load;
    return hs_label_at(hs_all_of(contact), load, 0.0, 0.0, 1.0) * contact->units.length;
}
