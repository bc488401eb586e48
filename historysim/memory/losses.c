/* Losses: elastic energy of springs, ½ ∫ v² N'' da, and energy dissipated by slip, ∫ slip·drag·N''
 * da, over the segments of a polyline, on which deflection and slip are linear; exact by Gauss and
 * Simpson quadrature (README.md, theory 10). */

#include "losses.h"

/* Inverse of a ramp: iterations, and smallest slope; chosen. */
#define NEWTON_STEPS 3
#define MIN_SLOPE 1e-3

/* ∫ slip·drag·N'' da of one asperity of gap h and weight k over labels from low to high > h.
 *
 * In x = √(a - h) the integrand is a polynomial of fourth degree, for which three Gauss points are
 * exact; all terms are >= 0. */
static inline double asperity_slip_energy(double h, double k, double low, double high,
                                          double slip_low, double slip_slope, double drag_low,
                                          double drag_slope) {
    const double node = 0.7745966692414834; /* √0.6 */
    double base = hs_max(h, low);
    double x_low = sqrt(base - h), x_high = sqrt(high - h);
    double length = (high - base) / (x_high + x_low), middle = 0.5 * (x_high + x_low),
           offset = 0.5 * length * node;
    double x = middle - offset, s = base - low + (x - x_low) * (x + x_low);
    double q = 5.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s);
    s = base - low + (middle - x_low) * (middle + x_low);
    q += 8.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s);
    x = middle + offset;
    s = base - low + (x - x_low) * (x + x_low);
    q += 5.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s);
    return k * length * q * (1.5 / 18.0);
}

const hs_bow *hs_find_bow(hs_losses *losses, double friction, double side) {
    const hs_ramp_curve *curve = losses->curve;
    hs_bow *bow = &losses->bow;
    const double rise = curve->to.d - curve->from.d, change = curve->to.v - curve->from.v;
    if (bow->friction != friction || bow->side != side) {
        const double length = side * change - friction * rise,
                     across = side * curve->friction * rise + friction * change / curve->friction;
        *bow = HS_MADE(hs_bow){friction,
                               side,
                               length,
                               curve->from.d,
                               rise,
                               across / length,
                               rise != 0.0 ? -change / (curve->friction * rise) : 0.0,
                               -change / curve->friction - across / length * rise,
                               {curve->c[0], curve->c[1], curve->c[2]}};
    }
    return bow->length > 0.0 ? bow : NULL;
}

/* Distance w of ramp and chord at a fraction x, and ∫ w dx from 0. */
static inline double bow_distance(const double *c, double x) {
    return x * (1.0 - x) * (c[0] + x * (c[1] + x * c[2]));
}
static inline double bow_integral(const double *c, double x) {
    return x * x *
           (c[0] / 2.0 + x * ((c[1] - c[0]) / 3.0 + x * ((c[2] - c[1]) / 4.0 - x * c[2] / 5.0)));
}

/* Largest fraction x at which x + rate·w is a `value`, by Newton's method from the end. */
static inline double bow_fraction(const double *c, double rate, double value) {
    double x = 1.0;
    for (int k = 0; k < NEWTON_STEPS; ++k) {
        double slope =
            c[0] + x * (2.0 * (c[1] - c[0]) + x * (3.0 * (c[2] - c[1]) - x * 4.0 * c[2]));
        x -= (x + rate * bow_distance(c, x) - value) / hs_max(1.0 + rate * slope, MIN_SLOPE);
    }
    return hs_min(hs_max(x, 0.0), 1.0);
}

/* True if the springs between two labels touch or separate on a path. */
static inline int is_met_by(const hs_bow *bow, const hs_slip *slip) {
    const double edge = hs_min(bow->from, bow->from + bow->rise);
    return 0.5 * (slip->low + slip->high) > edge;
}

/* Energy by which springs with label a dissipate more on a ramp than on its chord: μ times the area
 * between both in (d, g) from where they begin to slip to the end. Springs that touch or separate
 * do so where both are at d = a, which differs in g: the area has a corner there. */
static HS_INLINE double bow_density(const hs_bow *bow, double label, double slip, int met_by) {
    const double *c = bow->c;
    double begin, end = 1.0, w = 0.0, corner = 0.0;
    if (met_by != 0) {
        double of_chord = (label - bow->from) / bow->rise,
               met = bow_fraction(c, bow->d_rate, of_chord), w_met = bow_distance(c, met);
        double off = met + bow->g_rate * w_met - of_chord;
        corner = -0.5 * fabs(bow->rise) * off * off;
        begin = end = met;
        if (met_by > 0) end = 1.0;
        if (met_by < 0) {
            w = w_met;
            begin = bow_fraction(c, bow->g_rate, hs_max(of_chord - slip / bow->length, 0.0));
        }
    } else {
        begin = bow_fraction(c, bow->g_rate, hs_max(1.0 - slip / bow->length, 0.0));
    }
    double w_begin = bow_distance(c, begin);
    double area = bow->off * (bow_integral(c, end) - bow_integral(c, begin) +
                              0.5 * bow->g_rate * (w * w - w_begin * w_begin));
    return bow->friction * bow->length * (area + corner);
}

/* Energies of several asperities between two labels on a bowed ramp, by Gauss's quadrature in
 * √(a - h); no asperity gains energy. */
static HS_INLINE void bowed_energies_of(const double *restrict gap, const double *restrict weight,
                                        int count, const hs_slip *slip, const hs_bow bow, int met,
                                        double *restrict energy) {
    const double *node = hs_gauss_node[2], *node_weight = hs_gauss_weight[2];
    const double low = slip->low, high = slip->high, width = high - low;
    const double slip_low = slip->slip_low, drag_low = slip->drag_low;
    const double slip_slope = (slip->slip_high - slip_low) / width,
                 drag_slope = (slip->drag_high - drag_low) / width;
    for (int i = 0; i < count; ++i) {
        double h = gap[i], base = hs_max(h, low), x_low = sqrt(base - h), x_high = sqrt(high - h);
        double length = (high - base) / (x_high + x_low), sum = 0.0;
        for (int k = 0; k < 4; ++k) {
            double x = x_low + node[k] * length, s = h + x * x - low;
            double slipped = slip_low + slip_slope * s;
            double density =
                slipped * (drag_low + drag_slope * s) + bow_density(&bow, low + s, slipped, met);
            sum += node_weight[k] * hs_max(density, 0.0);
        }
        energy[i] = 1.5 * weight[i] * length * sum;
    }
}
/* The same, compiled for springs that separate (-1), touch (1) or do neither (0). */
HS_WIDE static void bowed_energies(const double *restrict gap, const double *restrict weight,
                                   int count, const hs_slip *slip, double *restrict energy) {
    const hs_bow bow = *slip->bow;
    if (!is_met_by(&bow, slip))
        bowed_energies_of(gap, weight, count, slip, bow, 0, energy);
    else if (bow.rise > 0.0)
        bowed_energies_of(gap, weight, count, slip, bow, 1, energy);
    else
        bowed_energies_of(gap, weight, count, slip, bow, -1, energy);
}

/* Energies of several asperities between two labels. */
HS_WIDE static void slip_energies(const double *restrict gap, const double *restrict weight,
                                  int count, const hs_slip *slip, double *restrict energy) {
    const double low = slip->low, high = slip->high, width = high - low;
    const double slip_low = slip->slip_low, drag_low = slip->drag_low;
    const double slip_slope = (slip->slip_high - slip_low) / width,
                 drag_slope = (slip->drag_high - drag_low) / width;
    for (int i = 0; i < count; ++i)
        energy[i] = asperity_slip_energy(gap[i], weight[i], low, high, slip_low, slip_slope,
                                         drag_low, drag_slope);
}

/* Energy of the springs of a curve with knots. A jump of the stiffness at a knot is a finite number
 * of springs at one label. Between knots the density of springs is constant, so that the integrand
 * is quadratic and Simpson's rule exact. */
static double knot_slip_energy(hs_curve curve, const hs_slip *slip) {
    const double rate = 1.0 / (slip->high - slip->low);
    const double slip_slope = (slip->slip_high - slip->slip_low) * rate,
                 drag_slope = (slip->drag_high - slip->drag_low) * rate;
    int64_t i = hs_count_touching(curve.gap, curve.count, slip->low);
    double total = 0.0, stiffness_below = i > 0 ? curve.weight[i - 1] : 0.0;
    if (i > 0) --i;
    for (; i < curve.count && curve.gap[i] < slip->high; ++i) {
        double s = curve.gap[i] - slip->low;
        if (s >= 0.0 && curve.weight[i] > stiffness_below &&
            (i == 0 || curve.gap[i] == curve.gap[i - 1]))
            total += (curve.weight[i] - stiffness_below) * (slip->slip_low + slip_slope * s) *
                     (slip->drag_low + drag_slope * s);
        stiffness_below = curve.weight[i];
        if (i + 1 == curve.count || curve.gap[i + 1] <= hs_max(curve.gap[i], slip->low)) continue;
        double start = hs_max(curve.gap[i], slip->low), sum = 0.0;
        double width = hs_min(curve.gap[i + 1], slip->high) - start;
        for (int k = 0; k < 3; ++k) {
            double offset = start - slip->low + 0.5 * k * width;
            sum += (k == 1 ? 4.0 : 1.0) * (slip->slip_low + slip_slope * offset) *
                   (slip->drag_low + drag_slope * offset);
        }
        total += hs_bend_at(curve, i) * width * sum / 6.0;
    }
    return total;
}

HS_WIDE static void add_terms(double *restrict sum, const double *restrict term, int count) {
    for (int i = 0; i < count; ++i) sum[i] += term[i];
}

double hs_add_energy(hs_curve curve, double *asperity_energy, double *far_energy,
                     const hs_slip *slip) {
    double energy[HS_BLOCK], lane[HS_LANES] = {0};
    if (slip->high <= slip->low) return 0.0;
    /* knots have no energies of asperities, and one coefficient, so that no path is bowed */
    if (curve.load) return knot_slip_energy(curve, slip);
    if (curve.count == 1) {
        if (curve.gap[0] >= slip->high) return 0.0;
        (slip->bow ? bowed_energies : slip_energies)(curve.gap, curve.weight, 1, slip, energy);
        if (asperity_energy) asperity_energy[0] += energy[0];
        return energy[0];
    }
    int64_t count = hs_count_touching(curve.gap, curve.count, slip->high), inner = count;
    hs_chunk chunk;
    if (slip->bow || (asperity_energy && !far_energy)) curve.clusters = NULL;
    /* the energy is smooth in the gap below `low`, and between both labels */
    if (curve.clusters) inner = hs_count_touching(curve.gap, count, slip->low);
    for (int64_t start = 0; start < count; start += chunk.size) {
        int below = start < inner;
        hs_next_chunk(curve, start, below ? inner : count, below ? slip->low : slip->high, &chunk);
        hs_slip shifted = *slip;
        shifted.low -= chunk.origin;
        shifted.high -= chunk.origin;
        const int is_far = asperity_energy && chunk.cluster;
        (slip->bow ? bowed_energies : slip_energies)(
            chunk.gap, is_far ? hs_proxy_unit : chunk.weight, chunk.count, &shifted, energy);
        if (is_far) {
            double *far = far_energy + (chunk.cluster - curve.clusters->memory) * HS_PROXIES;
            add_terms(far, energy, HS_PROXIES);
            for (int p = 0; p < HS_PROXIES; ++p) energy[p] *= chunk.weight[p];
        } else if (asperity_energy) {
            add_terms(asperity_energy + start, energy, chunk.count);
        }
        hs_add(lane, energy, chunk.count);
    }
    return hs_lanes_sum(lane);
}

void hs_init_losses(hs_losses *losses, int64_t groups, const hs_ramp_curve *curve) {
    losses->curve = curve;
    losses->bow.side = 0.0;
    losses->queues = groups > 1;
    losses->number = 0;
    losses->total = 0.0;
}

HS_WIDE static void compute_queued(hs_losses *losses) {
    for (int p = 0; p < losses->number; ++p) {
        double low = losses->low[p], slip = losses->slip_low[p], drag = losses->drag_low[p];
        double rate = 1.0 / (losses->high[p] - low);
        double slip_slope = (losses->slip_high[p] - slip) * rate,
               drag_slope = (losses->drag_high[p] - drag) * rate;
        losses->energy[p] =
            asperity_slip_energy(losses->gap[p], losses->weight[p], low, losses->high[p], slip,
                                 slip_slope, drag, drag_slope);
    }
}

void hs_flush_losses(hs_losses *losses, double *asperity_energy) {
    double lane[HS_LANES] = {0};
    compute_queued(losses);
    hs_add(lane, losses->energy, losses->number);
    for (int p = 0; p < losses->number; ++p)
        asperity_energy[losses->position[p]] += losses->energy[p];
    losses->total += hs_lanes_sum(lane);
    losses->number = 0;
}

void hs_add_loss(const hs_group *group, hs_losses *losses, const hs_slip *slip) {
    if (!losses) return;
    if (!losses->queues || group->curve.count > 1 || slip->bow) {
        losses->total +=
            hs_add_energy(group->curve, group->asperity_energy, group->far_energy, slip);
        return;
    }
    hs_queue_loss(losses, group->curve.gap[0], group->curve.weight[0], group->start,
                  group->asperity_energy - group->start, slip);
}

void hs_commit_losses(hs_losses *losses, hs_line *memory) {
    if (losses->number) hs_flush_losses(losses, memory->dissipated_each);
    memory->dissipated += losses->total;
    losses->total = 0.0;
}

/* Add the loss of separating springs that slip in one direction: the drag falls to 0 in proportion
 * to the remaining slip. Its mean is bounded by half the limit at the start of the path, which
 * matters only if friction changes on the path. */
static void add_one_way_loss(const hs_group *group, hs_losses *losses, double start, double low,
                             double high, double slip_low, double slip_high, double rate) {
    double sign = slip_low + slip_high > 0.0 ? 1.0 : -1.0;
    /* slip per decrease of the approach; 0 if springs follow the limit without slip */
    double ratio = group->friction - sign * rate;
    if (ratio <= 0.0) return;
    double drag = 0.5 * group->friction / ratio;
    slip_low = fabs(slip_low);
    slip_high = fabs(slip_high);
    double max_drag_rate = 0.5 * group->friction * (1.0 + 1e-9);
    hs_slip slip = {low,
                    high,
                    slip_low,
                    slip_high,
                    hs_min(drag * slip_low, max_drag_rate * (start - low)),
                    hs_min(drag * slip_high, max_drag_rate * (start - high)),
                    hs_bow_of(losses, group->friction, sign)};
    hs_add_loss(group, losses, &slip);
}

/* Spring a separates at V(a) = v0 + (a - d0) ΔV/Δd. If it slips, then in the direction of V(a) -
 * w(a). */
void hs_add_separation_losses(const hs_group *group, hs_losses *losses, int64_t depth,
                              int64_t segment, const hs_point *from, const hs_point *to) {
    double rate = (to->v - from->v) / (to->d - from->d);
    double high = from->d, slip_high = 0.0;
    for (int64_t j = depth - 1; j >= segment;) {
        double low = hs_max(group->stack[j - 1].label, to->d);
        double change = rate - group->stack[j].slope;
        double slip_low = slip_high - change * (high - low);
        int turns = slip_high * slip_low < 0.0;
        if (turns) {
            /* split where the direction of slip changes */
            low = hs_max(low, high - slip_high / change);
            slip_low = 0.0;
        }
        if (slip_high != 0.0 || slip_low != 0.0)
            add_one_way_loss(group, losses, from->d, low, high, slip_low, slip_high, rate);
        high = low;
        slip_high = slip_low;
        if (!turns) --j;
    }
}

double hs_elastic_energy(const hs_line *memory, double *asperity_energy) {
    const hs_contact *contact = memory->contact;
    double total = 0.0;
    for (int64_t index = 0; index < contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        const hs_vertex *stack = group.stack;
        for (int64_t j = 1; j < memory->depth[index]; ++j) {
            double v_low = memory->displacement - stack[j - 1].anchor,
                   v_high = memory->displacement - stack[j].anchor;
            hs_slip held = {stack[j - 1].label, stack[j].label, v_low, v_high,
                            0.5 * v_low,        0.5 * v_high,   NULL};
            total += hs_add_energy(
                group.curve, asperity_energy ? asperity_energy + group.start : NULL, NULL, &held);
        }
    }
    return total;
}

HS_WIDE static void add_loads(const double *restrict gap, const double *restrict weight,
                              int64_t count, int labels, const double *restrict label,
                              const double *restrict factor, double *restrict part) {
    for (int k = 0; k < labels; ++k) {
        const double a = label[k], f = factor[k];
        for (int64_t i = 0; i < count; ++i) {
            double depth = hs_max(a - gap[i], 0.0);
            part[i] += weight[i] * (f * (depth * sqrt(depth)));
        }
    }
}

void hs_add_loads(const double *gap, const double *weight, int64_t count, int labels,
                  const double *label, const double *factor, double *part) {
    add_loads(gap, weight, count, labels, label, factor, part);
}
