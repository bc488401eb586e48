/* Losses: the elastic energy of springs, ½ ∫ v² N'' da, and the energy that they dissipate where they slip, from deflection and slip
 * at the ends of the straight pieces of a polyline; in closed form (README.md, theory 10). */

#include "losses.h"

/* ∫ slip·drag·N'' da of one asperity of gap h and weight k over labels from low to high > h.
 *
 * The integrand over x = √(a - h) is a polynomial of fourth degree, so three Gauss points are exact; no term is negative. */
static inline double part_of_one(double h, double k, double low, double high, double slip_low, double slip_slope,
                                 double drag_low, double drag_slope) {
    const double node = 0.7745966692414834; /* √0.6 */
    double base = hs_most(h, low);
    double x_low = sqrt(base - h), x_high = sqrt(high - h);
    double length = (high - base) / (x_high + x_low), middle = 0.5 * (x_high + x_low), offset = 0.5 * length * node;
    double x = middle - offset, s = base - low + (x - x_low) * (x + x_low);
    double q = 5.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s);
    s = base - low + (middle - x_low) * (middle + x_low);
    q += 8.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s);
    x = middle + offset;
    s = base - low + (x - x_low) * (x + x_low);
    q += 5.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s);
    return k * length * q * (1.5 / 18.0);
}

/* Energies of asperities between two labels. */
HS_WIDE static void parts(const double *restrict gap, const double *restrict weight, int count, const hs_slip *slip,
                          double *restrict part) {
    const double low = slip->low, high = slip->high, width = high - low;
    const double slip_low = slip->slip_low, drag_low = slip->drag_low;
    const double slip_slope = (slip->slip_high - slip_low) / width, drag_slope = (slip->drag_high - drag_low) / width;
    for (int i = 0; i < count; ++i)
        part[i] = part_of_one(gap[i], weight[i], low, high, slip_low, slip_slope, drag_low, drag_slope);
}

/* Energy of the springs of a curve with knots. Those that touch at once, where the stiffness jumps, are at its knots; of the
 * others there are as many on each stretch between two of them, so that Simpson's rule is exact. */
static double between_knots(hs_curve curve, const hs_slip *slip) {
    const double rate = 1.0 / (slip->high - slip->low);
    const double slip_slope = (slip->slip_high - slip->slip_low) * rate, drag_slope = (slip->drag_high - slip->drag_low) * rate;
    int64_t i = hs_count_touching(curve.gap, curve.count, slip->low);
    double total = 0.0, before = i > 0 ? curve.weight[i - 1] : 0.0;
    if (i > 0) --i;
    for (; i < curve.count && curve.gap[i] < slip->high; ++i) {
        double s = curve.gap[i] - slip->low;
        if (s >= 0.0 && curve.weight[i] > before && (i == 0 || curve.gap[i] == curve.gap[i - 1]))
            total += (curve.weight[i] - before) * (slip->slip_low + slip_slope * s) * (slip->drag_low + drag_slope * s);
        before = curve.weight[i];
        if (i + 1 == curve.count || curve.gap[i + 1] <= hs_most(curve.gap[i], slip->low)) continue;
        double first = hs_most(curve.gap[i], slip->low), sum = 0.0;
        double width = hs_least(curve.gap[i + 1], slip->high) - first;
        for (int k = 0; k < 3; ++k) {
            double at = first - slip->low + 0.5 * k * width;
            sum += (k == 1 ? 4.0 : 1.0) * (slip->slip_low + slip_slope * at) * (slip->drag_low + drag_slope * at);
        }
        total += hs_bend_at(curve, i) * width * sum / 6.0;
    }
    return total;
}

/* Add to each asperity its part of a slip, unless `each` is NULL; return the sum. */
double hs_add_energy(hs_curve curve, double *each, const hs_slip *slip) {
    double part[HS_BLOCK], lane[HS_LANES] = {0};
    if (slip->high <= slip->low) return 0.0;
    /* knots are nothing that loses energy of its own */
    if (curve.load) return between_knots(curve, slip);
    if (curve.count == 1) {
        if (curve.gap[0] >= slip->high) return 0.0;
        parts(curve.gap, curve.weight, 1, slip, part);
        if (each) each[0] += part[0];
        return part[0];
    }
    int64_t count = hs_count_touching(curve.gap, curve.count, slip->high);
    hs_part some;
    if (each) curve.clusters = NULL;
    for (int64_t begin = 0; begin < count; begin += some.size) {
        hs_next_part(curve, begin, count, slip->low, &some);
        hs_slip shifted = *slip;
        shifted.low -= some.origin;
        shifted.high -= some.origin;
        parts(some.gap, some.weight, some.count, &shifted, part);
        hs_add(lane, part, some.count);
        for (int i = 0; each && i < some.count; ++i) each[begin + i] += part[i];
    }
    return hs_lanes_sum(lane);
}

void hs_init_losses(hs_losses *losses, int64_t groups) {
    losses->queues = groups > 1;
    losses->number = 0;
    losses->total = 0.0;
}

HS_WIDE static void energies(hs_losses *losses) {
    for (int p = 0; p < losses->number; ++p) {
        double low = losses->low[p], slip = losses->slip_low[p], drag = losses->drag_low[p];
        double rate = 1.0 / (losses->high[p] - low);
        double slip_slope = (losses->slip_high[p] - slip) * rate, drag_slope = (losses->drag_high[p] - drag) * rate;
        losses->energy[p] = part_of_one(losses->gap[p], losses->weight[p], low, losses->high[p], slip, slip_slope, drag,
                                        drag_slope);
    }
}

void hs_flush_losses(hs_losses *losses, double *each) {
    double lane[HS_LANES] = {0};
    energies(losses);
    hs_add(lane, losses->energy, losses->number);
    for (int p = 0; p < losses->number; ++p) each[losses->position[p]] += losses->energy[p];
    losses->total += hs_lanes_sum(lane);
    losses->number = 0;
}

void hs_add_loss(const hs_group *group, hs_losses *losses, const hs_slip *slip) {
    if (!losses) return;
    if (!losses->queues || group->curve.count > 1) {
        losses->total += hs_add_energy(group->curve, group->each, slip);
        return;
    }
    hs_queue_loss(losses, group->curve.gap[0], group->curve.weight[0], group->start, group->each - group->start, slip);
}

void hs_commit_losses(hs_losses *losses, hs_line *memory) {
    if (losses->number) hs_flush_losses(losses, memory->dissipated_each);
    memory->dissipated += losses->total;
    losses->total = 0.0;
}

/* Of leaving springs that slip one way: the drag falls to 0 in proportion to the slip left. They do from the start on at
 * most, which says something only where friction has changed on the way. */
static void lose_one_way(const hs_group *group, hs_losses *losses, double start, double low, double high, double slip_low,
                         double slip_high, double rate) {
    double sign = slip_low + slip_high > 0.0 ? 1.0 : -1.0;
    /* slip per withdrawal; 0 where the springs ride along the limit */
    double ratio = group->friction - sign * rate;
    if (ratio <= 0.0) return;
    double drag = 0.5 * group->friction / ratio;
    slip_low = fabs(slip_low);
    slip_high = fabs(slip_high);
    double most = 0.5 * group->friction * (1.0 + 1e-9);
    hs_slip slip = {low, high, slip_low, slip_high, hs_least(drag * slip_low, most * (start - low)),
                    hs_least(drag * slip_high, most * (start - high))};
    hs_add_loss(group, losses, &slip);
}

/* Spring a leaves at V(a) = v0 + (a - d0) ΔV/Δd. It slips, if at all, one way: that of V(a) - w(a). */
void hs_add_separation_losses(const hs_group *group, hs_losses *losses, int64_t depth, int64_t segment, const hs_point *from,
                       const hs_point *to) {
    double rate = (to->v - from->v) / (to->d - from->d);
    double high = from->d, slip_high = 0.0;
    for (int64_t j = depth - 1; j >= segment;) {
        double low = hs_most(group->stack[j - 1].label, to->d);
        double change = rate - group->stack[j].slope;
        double slip_low = slip_high - change * (high - low);
        int turns = slip_high * slip_low < 0.0;
        if (turns) {
            /* first up to where the springs slip the other way */
            low = hs_most(low, high - slip_high / change);
            slip_low = 0.0;
        }
        if (slip_high != 0.0 || slip_low != 0.0) lose_one_way(group, losses, from->d, low, high, slip_low, slip_high, rate);
        high = low;
        slip_high = slip_low;
        if (!turns) --j;
    }
}

double hs_elastic_energy(const hs_line *memory, double *each) {
    const hs_contact *contact = memory->contact;
    double total = 0.0;
    for (int64_t index = 0; index < contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        const hs_vertex *stack = group.stack;
        for (int64_t j = 1; j < memory->depth[index]; ++j) {
            double v_low = memory->displacement - stack[j - 1].anchor, v_high = memory->displacement - stack[j].anchor;
            hs_slip held = {stack[j - 1].label, stack[j].label, v_low, v_high, 0.5 * v_low, 0.5 * v_high};
            total += hs_add_energy(group.curve, each ? each + group.start : NULL, &held);
        }
    }
    return total;
}
