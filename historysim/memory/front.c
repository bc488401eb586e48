/* Front: energies of a single group on a straight ramp of both loads, as an integral along the path
 * of its slip front: the total has a closed form, and shares of asperities are Gauss's quadrature
 * of the difference from a chord, halved until their sum is the total (README.md, theory 10). */

#include "front.h"
#include "adaptive.h"
#include "lanes.h"
#include "slides.h"

/* Iterations of Newton's method, at most; chosen. */
#define MAX_ITERATIONS 20

/* Relative size of the correction of a chord up to which two, and three, nodes suffice; chosen. */
static const double enough[2] = {2e-5, 2e-2};

/* Fraction of the tolerance below which a chord is not corrected; chosen. */
#define NEGLIGIBLE 0.01

/* Fraction of the tolerance for one piece; chosen. */
#define PART_OF_PIECE 0.2

/* Halvings of the path of a front, at most; chosen. */
#define MOST_HALVINGS 16

/* Distance of front and edge, relative to the path of the front, up to which they are close;
 * chosen. */
#define CLOSE 0.1

/* Relative change of the approach that Newton's method squares to rounding. */
#define CONVERGED 1e-11

/* Slip front and edge of the contact at one point of a ramp. */
typedef struct front_point {
    double front, edge; /* labels */
    hs_normal at_front, at_edge;
} front_point;

/* Energies that a ramp dissipates. While the front moves along one segment of slope m to label a,
 * all springs between it and the edge d slip by (μ - side·m) da, so that each asperity dissipates
 *
 *     μ (μ - side·m) ∫ [P(d) - P(a) - (d - a) P'(a)] da,
 *
 * where N is linear in P(a). */
typedef struct slip_energy {
    hs_curve curve;
    double friction, tolerance;
    double *each; /* of the asperities */
    double *far;  /* at proxies of clusters; NULL of few asperities */
    double *part; /* on the present piece, 0 before it; NULL of knots and clusters */
    double total; /* on the ramp */
} slip_energy;

/* Correction of the energies of a chord: loads at labels, with factors. */
typedef struct chord_correction {
    int nodes;
    double label[4][3], factor[4][4];
} chord_correction;

static front_point point_at(hs_curve curve, double front, double edge) {
    front_point found = {front, edge, hs_normal_at(curve, front), {0.0, 0.0, 0.0, 0.0}};
    found.at_edge = edge == front ? found.at_front : hs_normal_at(curve, edge);
    return found;
}

/* Energy of front and edge that move in proportion, as on a straight path in (d, V), added to those
 * of asperities, and of clusters, unless NULL; exact for each asperity. */
static double chord_energy(const slip_energy *energy, const front_point *from,
                           const front_point *to, double rate, double *each, double *far) {
    double slip = rate * (from->front - to->front), rise = to->edge - from->edge, total = 0.0;
    double label[4] = {to->front, from->front, hs_min(from->edge, to->edge),
                       hs_max(from->edge, to->edge)};
    if (label[2] < label[1]) {
        label[1] = label[2];
        label[2] = from->front;
    }
    hs_slip piece = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NULL};
    for (int k = 0; k < 4; ++k) {
        double a = label[k], first = 0.0, last = 1.0;
        /* the front passes a spring, or it touches; it leaves */
        if (a < from->front)
            first = (from->front - a) / (from->front - to->front);
        else if (a > from->edge)
            first = hs_min((a - from->edge) / rise, 1.0);
        if (a > to->edge && rise < 0.0) last = (a - from->edge) / rise;
        piece.low = piece.high;
        piece.slip_low = piece.slip_high;
        piece.drag_low = piece.drag_high;
        piece.high = a;
        piece.slip_high = slip * hs_max(last - first, 0.0);
        piece.drag_high =
            energy->friction * hs_max(from->edge + 0.5 * (first + last) * rise - a, 0.0);
        if (k > 0) total += hs_add_energy(energy->curve, each, far, &piece);
    }
    return total;
}

/* Loads P at three labels and the stiffness P' at the last, weighted, added to the energy of each
 * asperity. */
HS_WIDE static void add_weighted_loads(const double *restrict gap, const double *restrict weight,
                                       int count, const double *restrict label,
                                       const double *restrict factor, double *restrict part) {
    const double a = label[0], b = label[1], c = label[2], of_a = factor[0], of_b = factor[1],
                 of_c = factor[2];
    const double of_stiffness = 1.5 * factor[3];
    for (int i = 0; i < count; ++i) {
        double h = gap[i], in_a = hs_max(a - h, 0.0), in_b = hs_max(b - h, 0.0),
               in_c = hs_max(c - h, 0.0);
        part[i] += weight[i] * (of_a * (in_a * sqrt(in_a)) + of_b * (in_b * sqrt(in_b)) +
                                (of_c * in_c + of_stiffness) * sqrt(in_c));
    }
}

/* Correction of the energy of a chord to that of its ramp, by Gauss's quadrature in √(a - h).
 * Partial integration leaves P(d) + P(a) dd/da, without the stiffness of single asperities, whose
 * kinks are sharper; where the edge follows the front closely, that would be a small difference of
 * large numbers. */
static double curved_energy(const slip_energy *energy, const front_point *from,
                            const front_point *to, double rate, double growth,
                            chord_correction *correction) {
    const int nodes = correction->nodes;
    double (*label)[3] = correction->label, (*factor)[4] = correction->factor;
    hs_curve curve = energy->curve;
    const double h = curve.gap[0], width = to->front - from->front,
                 chord = (to->edge - from->edge) / width;
    const double begin = sqrt(hs_max(from->front - h, 0.0)), end = sqrt(hs_max(to->front - h, 0.0));
    const double slope0 =
        from->at_edge.slope > 0.0 ? growth * from->at_front.slope / from->at_edge.slope : chord;
    const double slope1 =
        to->at_edge.slope > 0.0 ? growth * to->at_front.slope / to->at_edge.slope : chord;
    const int close = hs_max(from->edge - from->front, to->edge - to->front) < CLOSE * fabs(width);
    double total = 0.0, weights = 0.0, mean = 0.0, front_loads = 0.0;
    for (int g = 0; g < nodes; ++g) {
        double x = hs_toward(begin, end, hs_gauss_node[nodes - 2][g]), a = h + x * x,
               t = (a - from->front) / width;
        double straight = from->edge + t * (to->edge - from->edge);
        /* cubic Hermite interpolation, then Newton's method */
        double d = straight +
                   width * t * (1.0 - t) * ((1.0 - t) * (slope0 - chord) - t * (slope1 - chord));
        hs_load front = hs_load_at(curve, a), edge = {0.0, 0.0};
        double load = from->at_edge.load + growth * (front.load - from->at_front.load);
        for (int iteration = 0; iteration < MAX_ITERATIONS; ++iteration) {
            edge = hs_load_at(curve, d);
            double step = edge.slope > 0.0 ? (load - edge.load) / edge.slope : 0.0;
            d = hs_max(d + step, hs_max(a, 0.5 * (d + h)));
            if (fabs(step) <= CONVERGED * (d - h)) break;
        }
        double factor_of_node =
            energy->friction * rate * hs_gauss_weight[nodes - 2][g] * 2.0 * x * (begin - end);
        label[g][0] = d;
        label[g][1] = straight;
        label[g][2] = a;
        factor[g][0] = factor_of_node;
        factor[g][1] = -factor_of_node;
        factor[g][2] = !close && edge.slope > 0.0
                           ? factor_of_node * (growth * front.slope / edge.slope - chord)
                           : 0.0;
        factor[g][3] = close ? -factor_of_node * (d - straight) : 0.0;
        weights += factor_of_node;
        mean += factor[g][2];
        if (!energy->part) {
            total += factor_of_node * (load - hs_load_at(curve, straight).load) +
                     factor[g][2] * front.load + factor[g][3] * front.slope;
            front_loads += factor_of_node * front.load;
        }
    }
    /* the mean of dd/da equals that of the chord, in spite of quadrature errors */
    mean /= weights;
    total -= mean * front_loads;
    for (int g = 0; g < nodes; ++g) factor[g][2] += mean * factor[g][1];
    if (!energy->part) return total;
    double lane[HS_LANES] = {0};
    for (int64_t begin_of_block = 0; begin_of_block < curve.count; begin_of_block += HS_BLOCK) {
        int count = hs_size_of_block(curve.count - begin_of_block);
        double *part = energy->part + begin_of_block;
        for (int g = 0; g < nodes; ++g)
            add_weighted_loads(curve.gap + begin_of_block, curve.weight + begin_of_block, count,
                               label[g], factor[g], part);
        hs_add(lane, part, count);
    }
    return hs_lanes_sum(lane);
}

/* Add a correction to the energies of asperities, or of the proxies of clusters that are far from
 * all labels. */
static void add_correction(const slip_energy *energy, const chord_correction *correction) {
    const hs_curve curve = energy->curve;
    const int count = 3 * correction->nodes;
    double labels[12];
    int64_t start = 0;
    hs_chunk chunk;
    for (int k = 0; k < count; ++k) {
        double label = correction->label[k / 3][k % 3];
        int at = k;
        for (; at > 0 && labels[at - 1] > label; --at) labels[at] = labels[at - 1];
        labels[at] = label;
    }
    for (int k = 0; k < count; ++k) {
        int64_t stop = hs_count_touching(curve.gap, curve.count, labels[k]);
        for (; start < stop; start += chunk.size) {
            hs_next_chunk(curve, start, stop, labels[k], &chunk);
            double *sum = energy->each + start;
            if (chunk.cluster)
                sum = energy->far + (chunk.cluster - curve.clusters->memory) * HS_PROXIES;
            for (int g = 0; g < correction->nodes; ++g) {
                const double *label = correction->label[g];
                double shifted[3] = {label[0] - chunk.origin, label[1] - chunk.origin,
                                     label[2] - chunk.origin};
                add_weighted_loads(chunk.gap, chunk.cluster ? hs_proxy_unit : chunk.weight,
                                   chunk.count, shifted, correction->factor[g], sum);
            }
        }
    }
}

/* Add the energies of a piece to the asperities, and clear them; returns their sum. No asperity
 * gains energy. */
HS_WIDE static double accept_parts(double *restrict part, double *restrict each, int64_t count) {
    double lane[HS_LANES] = {0};
    for (int64_t begin = 0; begin < count; begin += HS_BLOCK) {
        int size = hs_size_of_block(count - begin);
        for (int i = 0; i < size; ++i) part[begin + i] = hs_max(part[begin + i], 0.0);
        hs_add(lane, part + begin, size);
        for (int i = 0; i < size; ++i) {
            each[begin + i] += part[begin + i];
            part[begin + i] = 0.0;
        }
    }
    return hs_lanes_sum(lane);
}

/* A piece of the path of a slip front; the front ends its nested halves at `to`. */
typedef struct front_piece {
    slip_energy *energy;
    front_point from, to[MOST_HALVINGS + 1];
    double rate, growth; /* dissipated per slip of the front: μ - side·m; dN/dP(a) */
    double total;        /* energy of the present half */
    chord_correction correction;
} front_piece;

static const hs_adaptive front_settings = {
    0.0, /* the tolerance is set from the drive's */
    1.0, /* accepted at once: the error is the difference from a closed form */
    1,   INT_MAX,
    0.0, /* halved at once: each piece has the most nodes that it needs */
    1.0, 1.0 / (1 << MOST_HALVINGS),
    0.0, 0.5,
    0.5, INT_MAX,
    1.0, 1.0, /* halvings bound the number of pieces */
};

/* Energies of a piece of a ramp: from its chord, corrected. Their sum is compared with the closed
 * form,
 *
 *     ∫ P(d) da = A Δa + B ∫ P da,   ∫ (d - a) dP(a) = ΔG(d) / B - ΔG(a),   N = A + B P(a),   G(a)
 * = ∫ a dP = a P - ∫ P da,
 *
 * as far as rounding lets it be. */
static int integrate_front(hs_integrand *integrand, const hs_interval *step, int chords,
                           double *error) {
    front_piece *piece = (front_piece *)integrand->context;
    slip_energy *energy = piece->energy;
    const front_point *from = &piece->from, *to = piece->to + step->level;
    const hs_curve curve = energy->curve;
    const double rate = piece->rate, growth = piece->growth;
    const double width = from->front - to->front, scale = energy->friction * rate;
    (void)chords;
    *error = piece->total = 0.0;
    piece->correction.nodes = 0;
    if (width <= 0.0) return HS_OK;
    double total = piece->total = chord_energy(energy, from, to, rate, energy->part, NULL);
    if (from->edge == to->edge) return HS_OK;
    const hs_normal *f0 = &from->at_front, *f1 = &to->at_front, *e0 = &from->at_edge,
                    *e1 = &to->at_edge;
    double bend = e0->slope > 0.0 && e1->slope > 0.0
                      ? fabs(growth * (f0->slope / e0->slope - f1->slope / e1->slope))
                      : fabs((to->edge - from->edge) / width);
    double stiffer = hs_max(e0->slope - f0->slope, e1->slope - f1->slope);
    double correction = total > 0.0 ? 0.125 * scale * stiffer * bend * width * width / total : 0.0;
    if (!(correction > NEGLIGIBLE * energy->tolerance)) return HS_OK;
    piece->correction.nodes = correction <= enough[0] ? 2 : correction <= enough[1] ? 3 : 4;
    double curved = curved_energy(energy, from, to, rate, growth, &piece->correction);
    total = energy->part ? curved : total + curved;
    double integral = f0->integral - f1->integral,
           moment = from->front * f0->load - to->front * f1->load - integral;
    double d_moment = (from->edge * e0->load - e0->integral) - (to->edge * e1->load - e1->integral);
    double offset = e0->load - growth * f0->load;
    double closed =
        scale * (offset * width + (growth - 1.0) * integral - d_moment / growth + moment);
    double most = hs_max(from->edge * e0->load, to->edge * e1->load);
    double rounding = HS_TIE * scale * most * (1.0 + 1.0 / fabs(growth));
    double allowed = PART_OF_PIECE * energy->tolerance * hs_max(total, energy->total) + rounding;
    if (!(fabs(total - closed) <= allowed) && curve.load && rounding <= energy->tolerance * closed)
        total = closed;
    *error = hs_error(total - closed, 0.0, allowed);
    piece->total = total;
    return HS_OK;
}

static int accept_front(hs_integrand *integrand, const hs_interval *step) {
    front_piece *piece = (front_piece *)integrand->context;
    slip_energy *energy = piece->energy;
    const front_point *to = piece->to + step->level;
    energy->total +=
        energy->part ? accept_parts(energy->part, energy->each, energy->curve.count) : piece->total;
    if (energy->far && piece->from.front > to->front) {
        chord_energy(energy, &piece->from, to, piece->rate, energy->each, energy->far);
        add_correction(energy, &piece->correction);
    }
    piece->from = *to;
    return HS_OK;
}

/* Shorten a piece to its first half in √(a - h). */
static int halve_front(hs_integrand *integrand, const hs_interval *step) {
    front_piece *piece = (front_piece *)integrand->context;
    const hs_curve curve = piece->energy->curve;
    const front_point *from = &piece->from, *to = piece->to + step->level - 1;
    double h = curve.gap[0],
           x = 0.5 * (sqrt(hs_max(from->front - h, 0.0)) + sqrt(hs_max(to->front - h, 0.0)));
    double front = h + x * x;
    double load =
        from->at_edge.load + piece->growth * (hs_load_at(curve, front).load - from->at_front.load);
    double edge = hs_label_at(curve, load, 0.5 * (from->edge + to->edge), 0.0, 1.0);
    piece->to[step->level] = point_at(curve, front, hs_max(edge, front));
    if (piece->energy->part)
        memset(piece->energy->part, 0, (size_t)curve.count * sizeof *piece->energy->part);
    return HS_OK;
}

/* Add the energies of a piece of a ramp. */
static void add_piece(slip_energy *energy, const front_point *from, const front_point *to,
                      double rate, double growth) {
    front_piece piece;
    hs_integrand integrand = {
        &piece, &front_settings, integrate_front, accept_front, halve_front, 0, 0.0};
    if (from->front <= to->front || rate <= 0.0) return;
    piece.energy = energy;
    piece.from = *from;
    piece.to[0] = *to;
    piece.rate = rate;
    piece.growth = growth;
    hs_adapt(&integrand, 0.0, 1.0);
}

/* Follow the slip front of a group along a ramp, from segment to segment of its polyline before the
 * ramp, and add up energies; with a guess of the label where it ends.
 *
 * The front is where side·(T - T(a)) = μ (N - P(a)), so that P(a) is linear along the ramp on each
 * segment. Where N falls, the edge may reach the front: then all that has slipped has left, and
 * slip begins anew, on either side. */
static void follow_front(const hs_line *memory, slip_energy *energy, double d1, double guess,
                         double load1, double force1) {
    const hs_vertex *stack = memory->vertices;
    const hs_curve curve = energy->curve;
    const double friction = energy->friction, load0 = memory->normal_load;
    const double rise = load1 - load0, change = force1 - memory->tangential_load;
    const double tie = HS_TIE * (fabs(change) + friction * fabs(rise));
    int64_t j = memory->depth[0] - 1;
    double share = 0.0, front_load = load0, load = load0;
    front_point from = point_at(curve, memory->approach, memory->approach);
    while (share < 1.0 && j > 0) {
        /* nothing slips here */
        double over = rise < 0.0 ? change - stack[j].slope * rise : change;
        if (fabs(over) <= tie) {
            if (rise >= 0.0 || stack[j - 1].normal <= load1) return;
            --j;
            share = (stack[j].normal - load0) / rise;
            load = front_load = stack[j].normal;
            from = point_at(curve, stack[j].label, stack[j].label);
            continue;
        }
        double side = copysign(1.0, over), speed = side * change - friction * rise;
        if (speed <= 0.0) return;
        for (int meets = 0; share < 1.0 && j > 0 && !meets;) {
            double rate = friction - side * stack[j].slope;
            if (rate <= HS_TIE * friction) {
                /* slides already */
                --j;
                front_load = stack[j].normal;
                from.front = stack[j].label;
                from.at_front = hs_normal_at(curve, from.front);
                continue;
            }
            double to_vertex = (front_load - stack[j - 1].normal) * rate / speed,
                   closing = -(rise + speed / rate);
            double to_edge = closing > 0.0 && load > front_load ? (load - front_load) / closing
                                                                : HUGE_VAL,
                   left = 1.0 - share;
            double step = hs_min(hs_min(to_vertex, to_edge), left);
            int ends = step >= left, passes = !ends && step >= to_vertex;
            meets = !ends && !passes;
            share = ends ? 1.0 : share + step;
            double edge = d1, front;
            load = ends ? load1 : load0 + share * rise;
            if (!ends) edge = hs_label_at(curve, load, from.edge, 0.0, 1.0);
            front_load = passes  ? stack[j - 1].normal
                         : meets ? load
                                 : hs_max(front_load - step * speed / rate, stack[j - 1].normal);
            front = passes  ? stack[j - 1].label
                    : meets ? edge
                            : hs_label_at(curve, front_load, guess, 0.0, 1.0);
            front_point to = point_at(curve, hs_min(front, edge), edge);
            add_piece(energy, &from, &to, rate, -rise * rate / speed);
            from = to;
            j -= passes;
        }
    }
}

int hs_ramp_group(hs_line *memory, double load, double force, double time, const hs_drive *drive) {
    const double d = hs_approach_at_load(memory, load);
    int status = hs_reserve_vertices(memory);
    if (status != HS_OK) return status;
    hs_group group = hs_group_of(memory, 0);
    slip_energy energy = {
        group.curve, group.friction, drive->tolerance, group.asperity_energy, NULL, NULL, 0.0};
    if (group.curve.clusters) energy.far = group.far_energy;
    if (!group.curve.load && !energy.far &&
        !(energy.part = (double *)calloc((size_t)group.curve.count, sizeof(double))))
        return HS_OUT_OF_MEMORY;
    const hs_point from = {memory->approach, memory->displacement};
    hs_begin_ramp(memory, load, force, time);
    if (d > group.curve.gap[0]) {
        hs_update update;
        hs_solve_update(&group, memory->depth[0], &from, d, load, hs_to_load(force), &update);
        follow_front(memory, &energy, d, update.slips ? update.front.label : d, load, force);
        hs_record_slides(&group, update.depth, &from, &update.to, group.friction, update.slip_label,
                         0);
        memory->depth[0] = hs_apply_update(&group, NULL, &from, &update);
        memory->displacement = update.to.v;
    } else {
        /* where nothing touches, the displacement is the anchor of the last spring */
        const hs_point to = {d, group.stack[0].anchor};
        follow_front(memory, &energy, d, d, load, force);
        status = hs_move_group(memory, &group, NULL, 0, group.friction, from, to, load,
                               hs_to_displacement(to.v), NULL, &memory->displacement);
        memory->displacement = to.v;
    }
    memory->approach = d;
    memory->normal_load = load;
    memory->tangential_load = force;
    memory->dissipated += energy.total;
    free(energy.part);
    return status;
}
