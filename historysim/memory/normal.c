/* Normal curve: the load P(a) at an approach, and the approach at a load, from the gaps and weights of asperities,
 * P = Σ k (a - h)^(3/2), or from knots, between which P is a parabola (README.md, theory 8). */

#include "normal.h"

/* Count asperities, in ascending gap, whose gap is below an approach. */
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

/* k √(a - h) and its product with a - h, of asperities that touch. */
static inline void half_chords(const double *restrict gap, const double *restrict weight, int count, double approach,
                               double *restrict load, double *restrict half_chord) {
    for (int i = 0; i < count; ++i) {
        double depth = approach - gap[i];
        half_chord[i] = weight[i] * sqrt(depth);
        load[i] = half_chord[i] * depth;
    }
}

/* P(a) and P'(a) of the first asperities, all of which touch. */
static HS_WIDE hs_load sum_of_loads(hs_curve curve, int64_t touching, double approach) {
    double load[HS_BLOCK], half_chord[HS_BLOCK], loads[HS_LANES] = {0}, slopes[HS_LANES] = {0};
    hs_part part;
    for (int64_t begin = 0; begin < touching; begin += part.size) {
        hs_next_part(curve, begin, touching, approach, &part);
        half_chords(part.gap, part.weight, part.count, approach - part.origin, load, half_chord);
        hs_add(loads, load, part.count);
        hs_add(slopes, half_chord, part.count);
    }
    return HS_MADE(hs_load){hs_lanes_sum(loads), 1.5 * hs_lanes_sum(slopes)};
}

/* The same of few asperities, for which vectors do not pay. */
static hs_load sum_of_few(hs_curve curve, int64_t touching, double approach) {
    double loads[HS_LANES] = {0}, slopes[HS_LANES] = {0};
    for (int64_t i = 0; i < touching; ++i) {
        double depth = approach - curve.gap[i], half_chord = curve.weight[i] * sqrt(depth);
        loads[i % HS_LANES] += half_chord * depth;
        slopes[i % HS_LANES] += half_chord;
    }
    return HS_MADE(hs_load){hs_lanes_sum(loads), 1.5 * hs_lanes_sum(slopes)};
}

/* The versions for several processors cannot be hidden from programs that link the library, unless they are static. */
hs_load hs_sum_of_loads(hs_curve curve, int64_t touching, double approach) {
    return touching <= 2 * HS_LANES && !curve.clusters ? sum_of_few(curve, touching, approach) : sum_of_loads(curve, touching, approach);
}

/* P(a) and P'(a) of a curve with knots; beyond the last one it goes on straight. */
hs_load hs_load_between_knots(hs_curve curve, double approach) {
    int64_t i = hs_count_touching(curve.gap, curve.count, approach) - 1;
    hs_load found = {0.0, 0.0};
    if (i < 0) return found;
    double x = approach - curve.gap[i], half = 0.5 * hs_bend_at(curve, i) * x;
    found.load = curve.load[i] + x * (curve.weight[i] + half);
    found.slope = curve.weight[i] + 2.0 * half;
    return found;
}

/* k (a - h)^(n/2) for n = 1, 3, 5 and 7, of asperities that touch. */
static inline void half_powers(const double *restrict gap, const double *restrict weight, int count, double approach,
                               double (*restrict power)[HS_BLOCK]) {
    for (int i = 0; i < count; ++i) {
        double depth = approach - gap[i];
        power[0][i] = weight[i] * sqrt(depth);
        power[1][i] = power[0][i] * depth;
        power[2][i] = power[1][i] * depth;
        power[3][i] = power[2][i] * depth;
    }
}

static hs_normal normal_between_knots(hs_curve curve, double approach) {
    hs_load there = hs_load_between_knots(curve, approach);
    hs_normal found = {there.load, there.slope, 0.0, 0.0};
    for (int64_t i = 0; i < curve.count && curve.gap[i] < approach; ++i) {
        double width = (i + 1 < curve.count ? hs_least(curve.gap[i + 1], approach) : approach) - curve.gap[i];
        if (width <= 0.0) continue;
        double load = curve.load[i], slope = curve.weight[i], bend = hs_bend_at(curve, i);
        found.twice += width * (found.integral + width * (load / 2.0 + width * (slope / 6.0 + width * bend / 24.0)));
        found.integral += width * (load + width * (slope / 2.0 + width * bend / 6.0));
    }
    return found;
}

/* P(a), P'(a) and both integrals of the first asperities, all of which touch. */
HS_WIDE static hs_normal sum_of_normals(hs_curve curve, int64_t touching, double approach) {
    double power[4][HS_BLOCK], lane[4][HS_LANES] = {{0}}, sum[4];
    hs_part part;
    for (int64_t begin = 0; begin < touching; begin += part.size) {
        hs_next_part(curve, begin, touching, approach, &part);
        half_powers(part.gap, part.weight, part.count, approach - part.origin, power);
        for (int n = 0; n < 4; ++n) hs_add(lane[n], power[n], part.count);
    }
    for (int n = 0; n < 4; ++n) sum[n] = hs_lanes_sum(lane[n]);
    return HS_MADE(hs_normal){sum[1], 1.5 * sum[0], sum[2] / 2.5, sum[3] / (2.5 * 3.5)};
}

hs_normal hs_normal_at(hs_curve curve, double approach) {
    if (curve.load) return normal_between_knots(curve, approach);
    return sum_of_normals(curve, hs_count_touching(curve.gap, curve.count, approach), approach);
}

/* Label a at which rigid·(a - h) + compliance·P(a) is a total, with the first knot h. */
static double label_between_knots(hs_curve curve, double total, double rigid, double compliance) {
    int64_t low = 0, high = curve.count;
    while (high - low > 1) {
        int64_t middle = (low + high) / 2;
        if (rigid * (curve.gap[middle] - curve.gap[0]) + compliance * curve.load[middle] < total)
            low = middle;
        else
            high = middle;
    }
    double left = total - (rigid * (curve.gap[low] - curve.gap[0]) + compliance * curve.load[low]);
    double slope = rigid + compliance * curve.weight[low], bend = compliance * hs_bend_at(curve, low);
    double label = curve.gap[low] + 2.0 * left / (slope + sqrt(slope * slope + 2.0 * bend * left));
    return high < curve.count ? hs_least(label, curve.gap[high]) : label;
}

/* Cube root for x > 0 by Halley's method, which triples the digits each time: libm's differs from machine to machine. */
double hs_cube_root(double x) {
    int exponent;
    double part = frexp(x, &exponent);
    while (exponent % 3 != 0) {
        part *= 0.5;
        ++exponent;
    }
    double root = 0.47 + 0.55 * part;
    for (int i = 0; i < 3; ++i) {
        double cube = root * root * root;
        root *= (cube + 2.0 * part) / (2.0 * cube + part);
    }
    root -= (root * root * root - part) / (3.0 * root * root);
    return ldexp(root, exponent / 3);
}

/* Label a at which rigid·(a - h) + compliance·P(a), with the smallest gap h, is a total.
 *
 * Of asperities by Newton on the power 2/3, bracketed. */
double hs_label_at(hs_curve curve, double total, double guess, double rigid, double compliance) {
    double gap = curve.gap[0], low = gap;
    if (total <= 0.0) return low;
    if (curve.load) return label_between_knots(curve, total, rigid, compliance);
    /* the deepest asperity alone would carry it here */
    double root = hs_cube_root(total / (compliance * curve.weight[0])), high = low + root * root;
    if (rigid > 0.0)
        high = hs_least(high, low + total / rigid);
    else if (curve.count == 1)
        return high;
    double approach = low < guess && guess <= high ? guess : high;
    for (int turn = 0; turn < 100; ++turn) {
        hs_load here = hs_load_at(curve, approach);
        double present = rigid * (approach - gap) + compliance * here.load, slope = rigid + compliance * here.slope;
        if (present == total) return approach;
        if (present < total)
            low = approach;
        else
            high = approach;
        /* (total/present)^(2/3) - 1 without loss of digits near 1: with c³ = total/present it is (c - 1)(c + 1), and
         * c - 1 = (c³ - 1)/(c² + c + 1) */
        double ratio = total / present, c = hs_cube_root(ratio);
        double step = 1.5 * present / slope * ((total - present) / present / (c * c + c + 1.0) * (c + 1.0));
        double next = approach + step;
        if (!(low <= next && next <= high)) {
            next = 0.5 * (low + high);
            if (next == low || next == high) return next;
        } else if (fabs(step) <= 1e-10 * (next - gap)) {
            /* Newton squares the error, so this step was the last that matters */
            return next;
        }
        approach = next;
    }
    return approach;
}

double hs_approach_at(const hs_contact *contact, double normal_load) {
    double load = normal_load / contact->units.load;
    return hs_label_at(hs_all_of(contact), load, 0.0, 0.0, 1.0) * contact->units.length;
}
