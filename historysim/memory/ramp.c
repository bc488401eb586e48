/* Ramp: a straight path in (N, T), carried out by straight paths in (d, V), its chords, which end
 * in the same state. Of a single group the energy is an integral along the path of its slip front,
 * whose total has a closed form; of several groups it differs from that of the chord by ∮ T dV of
 * ramp and chord, by Gauss's quadrature (README.md, theory 10). */

#include "ramp.h"
#include "adaptive.h"
#include "drive.h"
#include "lanes.h"
#include "slides.h"

/* Let the clock go on to the end of a path that is straight in both loads. */
static void begin_chord(hs_line *memory, double load, double force, double time) {
    hs_tick(memory, time);
    memory->clock.load = load;
    memory->clock.force = force;
}

/* ---- one group: the energy along the path of its slip front
 * ------------------------------------------------------------ */

/* Gauss's quadrature on (0, 1) with two to four nodes */
static const double front_node[3][4] = {
    {0.2113248654051871, 0.7886751345948129},
    {0.1127016653792583, 0.5, 0.8872983346207417},
    {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262}};
static const double front_weight[3][4] = {
    {0.5, 0.5},
    {0.2777777777777778, 0.4444444444444444, 0.2777777777777778},
    {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269}};
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
#define MOST_ITERATIONS 20

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
    double *part; /* on the present piece, 0 before it; NULL of knots */
    double total; /* on the ramp */
} slip_energy;

static front_point point_at(hs_curve curve, double front, double edge) {
    front_point found = {front, edge, hs_normal_at(curve, front), {0.0, 0.0, 0.0, 0.0}};
    found.at_edge = edge == front ? found.at_front : hs_normal_at(curve, edge);
    return found;
}

/* Energy of front and edge that move in proportion, as on a straight path in (d, V); exact for each
 * asperity. */
static double chord_energy(const slip_energy *energy, const front_point *from,
                           const front_point *to, double rate) {
    double slip = rate * (from->front - to->front), rise = to->edge - from->edge, total = 0.0;
    double label[4] = {to->front, from->front, hs_min(from->edge, to->edge),
                       hs_max(from->edge, to->edge)};
    if (label[2] < label[1]) {
        label[1] = label[2];
        label[2] = from->front;
    }
    hs_slip piece = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
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
        if (k > 0) total += hs_add_energy(energy->curve, energy->part, &piece);
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
                            const front_point *to, double rate, double growth, int nodes) {
    hs_curve curve = energy->curve;
    const double h = curve.gap[0], width = to->front - from->front,
                 chord = (to->edge - from->edge) / width;
    const double begin = sqrt(hs_max(from->front - h, 0.0)), end = sqrt(hs_max(to->front - h, 0.0));
    const double slope0 =
        from->at_edge.slope > 0.0 ? growth * from->at_front.slope / from->at_edge.slope : chord;
    const double slope1 =
        to->at_edge.slope > 0.0 ? growth * to->at_front.slope / to->at_edge.slope : chord;
    const int close = hs_max(from->edge - from->front, to->edge - to->front) < CLOSE * fabs(width);
    double label[4][3], factor[4][4], total = 0.0, weights = 0.0, mean = 0.0, front_loads = 0.0;
    for (int g = 0; g < nodes; ++g) {
        double x = hs_toward(begin, end, front_node[nodes - 2][g]), a = h + x * x,
               t = (a - from->front) / width;
        double straight = from->edge + t * (to->edge - from->edge);
        /* cubic Hermite interpolation, then Newton's method */
        double d = straight +
                   width * t * (1.0 - t) * ((1.0 - t) * (slope0 - chord) - t * (slope1 - chord));
        hs_load front = hs_load_at(curve, a), edge = {0.0, 0.0};
        double load = from->at_edge.load + growth * (front.load - from->at_front.load);
        for (int iteration = 0; iteration < MOST_ITERATIONS; ++iteration) {
            edge = hs_load_at(curve, d);
            double step = edge.slope > 0.0 ? (load - edge.load) / edge.slope : 0.0;
            d = hs_max(d + step, hs_max(a, 0.5 * (d + h)));
            if (fabs(step) <= CONVERGED * (d - h)) break;
        }
        double factor_of_node =
            energy->friction * rate * front_weight[nodes - 2][g] * 2.0 * x * (begin - end);
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
        if (curve.load) {
            total += factor_of_node * (load - hs_load_at(curve, straight).load) +
                     factor[g][2] * front.load + factor[g][3] * front.slope;
            front_loads += factor_of_node * front.load;
        }
    }
    /* the mean of dd/da equals that of the chord, in spite of quadrature errors */
    mean /= weights;
    total -= mean * front_loads;
    for (int g = 0; g < nodes; ++g) factor[g][2] += mean * factor[g][1];
    if (curve.load) return total;
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
    if (width <= 0.0) return HS_OK;
    double total = piece->total = chord_energy(energy, from, to, rate);
    if (from->edge == to->edge) return HS_OK;
    const hs_normal *f0 = &from->at_front, *f1 = &to->at_front, *e0 = &from->at_edge,
                    *e1 = &to->at_edge;
    double bend = e0->slope > 0.0 && e1->slope > 0.0
                      ? fabs(growth * (f0->slope / e0->slope - f1->slope / e1->slope))
                      : fabs((to->edge - from->edge) / width);
    double stiffer = hs_max(e0->slope - f0->slope, e1->slope - f1->slope);
    double correction = total > 0.0 ? 0.125 * scale * stiffer * bend * width * width / total : 0.0;
    if (!(correction > NEGLIGIBLE * energy->tolerance)) return HS_OK;
    int nodes = correction <= enough[0] ? 2 : correction <= enough[1] ? 3 : 4;
    double curved = curved_energy(energy, from, to, rate, growth, nodes);
    total = curve.load ? total + curved : curved;
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
    energy->total +=
        energy->part ? accept_parts(energy->part, energy->each, energy->curve.count) : piece->total;
    piece->from = piece->to[step->level];
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

/* Move a single group along a ramp: to the end by one straight path, which is exact, with the
 * energies of the ramp. */
static int exact_ramp(hs_line *memory, double load, double force, double time,
                      const hs_drive *drive) {
    const double d = hs_approach_at_load(memory, load);
    int status = hs_reserve_vertices(memory);
    if (status != HS_OK) return status;
    hs_group group = hs_group_of(memory, 0);
    slip_energy energy = {group.curve,           group.friction, drive->tolerance,
                          group.asperity_energy, NULL,           0.0};
    if (!group.curve.load &&
        !(energy.part = (double *)calloc((size_t)group.curve.count, sizeof(double))))
        return HS_OUT_OF_MEMORY;
    const hs_point from = {memory->approach, memory->displacement};
    begin_chord(memory, load, force, time);
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

/* ---- several groups: straight paths in (d, V)
 * ------------------------------------------------------------------------------
 *
 * A group reaches the same state on the ramp and on its chord, the straight path in (d, V) between
 * the same ends, if side·V - μ d is largest at one of the ends, and if no spring that touches on
 * the way sticks at the end. Otherwise its springs are off by at most the distance of ramp and
 * chord. Steps of the ramp are cut where |dV/dd| = μ of a group, and shortened until that distance
 * is tolerated.
 *
 * Ramp and chord begin and end in the same states, so their energies differ by ∮ T dV of each
 * asperity: Gauss's quadrature, at points of the ramp, which Newton's method finds across the
 * chord. */

/* Gauss's quadrature on a step */
#define NODES 3
/* Points of a step at which side·V - μ d is compared with its ends; chosen. */
#define SAMPLES 8
/* tolerances over the caller's: of springs over the displacement at which all slides, of the energy
 * over that of the ramp. Chosen: at the default tolerance the ends of ramps are within 2e-6 of full
 * slip (tests/memory/test_ramp.py) */
#define STATE_TOLERANCE 1.0
#define ENERGY_TOLERANCE 10.0
/* Smallest tolerance, above the rounding of energies; chosen. */
#define LEAST_TOLERANCE 1e-11
/* Smallest fraction of the tolerance of a ramp that a short step may use; chosen. */
#define LEAST_PART 0.05
/* Change of the distance of ramp and chord, relative to the largest one, at which Newton's method
 * ends; chosen. */
#define DISTANCE_CONVERGED 1e-5
/* inclination of ramp and chord above which they are not interpolated; length of the next step over
 * the one predicted; error for which half a step is predicted. Chosen */
#define STEEP 4.0
#define SAFETY 0.9
/* steps up to this multiple of the tolerance, as parts of a ramp, have the energy of their chord if
 * they cannot be interpolated. Chosen */
#define SHORT 1.0
#define TO_HALVE (4.0 * SAFETY * SAFETY)

/* End of a straight path of one group: its polyline is kept up to a label; from there on springs
 * have one slope up to the edge. */
typedef struct group_end {
    int64_t kept; /* vertices; -1 of a polyline that is steep */
    double label, inner_slope, slope;
} group_end;

/* Loads of a group or of all, and their derivatives while the slip of the springs goes on. */
typedef struct ramp_rates {
    double load, load_slope;        /* P, dP/dd */
    double force, stiffness, drift; /* T, ∂T/∂V, ∂T/∂d */
} ramp_rates;

typedef struct ramp {
    double load[2], force[2];
    double times[2];
    double tolerance, reach; /* of the caller; displacement at which all slides */
    double energy; /* dissipated by the whole ramp, as its first chord tells; 0 if not known */
    const hs_drive *drive;
    int64_t work;
    hs_line *present, *trial; /* at the start of a step, and at its end */
    hs_point heading[2];      /* direction of the ramp in (d, V) there */
    group_end *ends;          /* of all groups: at each node on the ramp and on the chord */
    ramp_rates *rates;        /* of all groups, at one point */
    hs_vertex *scratch;       /* to clip polylines that are steep */
    double *part;             /* of one group's asperities */
} ramp;

/* Rates of a steep group: zones on the cone slip, others stick. */
static ramp_rates rates_of_steep(const hs_group *group, const hs_vertex *stack, int64_t depth,
                                 hs_point to, ramp_rates found) {
    double slope_low = 0.0;
    found.force = stack[depth - 1].tangential;
    for (int64_t j = 1; j < depth; ++j) {
        double slope =
            j + 1 < depth ? hs_load_at(group->curve, stack[j].label).slope : found.load_slope;
        double side = hs_sliding_side(stack, depth, j, to.v, group->friction);
        if (side != 0.0)
            found.drift += side * group->friction * (slope - slope_low);
        else
            found.stiffness += slope - slope_low;
        slope_low = slope;
    }
    return found;
}

/* Solve for the end of a straight path of a group from the present state; its rates only if it
 * `has_loads`. */
static ramp_rates solve_end(const ramp *way, int64_t index, hs_point to, int has_loads,
                            group_end *end) {
    const hs_line *memory = way->present;
    const hs_group group = hs_group_of(memory, index);
    const hs_point from = {memory->approach, memory->displacement};
    const double friction = group.friction, gap = group.curve.gap[0];
    const int64_t depth = memory->depth[index];
    const hs_vertex *stack = group.stack, *last = stack + depth - 1;
    ramp_rates found = {0.0, 0.0, 0.0, 0.0, 0.0};
    *end = HS_MADE(group_end){0, gap, 0.0, 0.0};
    if (to.d <= gap) return found;
    hs_load at_edge = {0.0, 0.0};
    if (has_loads) at_edge = hs_load_at(group.curve, to.d);
    double load = found.load = at_edge.load, slip_slope = found.load_slope = at_edge.slope;
    if (depth == 0) {
        double touch =
            hs_toward(from.v, to.v, gap > from.d ? (gap - from.d) / (to.d - from.d) : 0.0);
        double slope = (to.v - touch) / (to.d - gap);
        end->slope = hs_clamp(slope, friction);
        found.force = end->slope * load;
        if (fabs(slope) < friction)
            found.stiffness = at_edge.slope;
        else
            found.drift = end->slope * at_edge.slope;
        return found;
    }
    if (memory->steep[index]) {
        hs_cone cone = {friction, to.v - from.v, friction * (to.d - from.d), 0.0};
        int64_t count =
            hs_move_and_clip(&group, NULL, depth, from, to, load, &cone, way->scratch, NULL);
        end->kept = -1;
        return rates_of_steep(&group, way->scratch, count, to, found);
    }
    hs_edge edge = hs_edge_at(stack, depth, to.d, load);
    double change = to.v - edge.anchor, rise = to.d - edge.label, sign = 0.0;
    if (fabs(change) <= friction * rise) {
        int is_cut = to.d < last->label;
        end->kept = edge.segment + !is_cut;
        end->label = edge.label;
        end->inner_slope = is_cut ? stack[edge.segment].slope : 0.0;
        end->slope = rise > 0.0 ? change / rise : 0.0;
        found.force = edge.tangential + end->slope * (load - edge.normal);
        if (rise == 0.0 && !is_cut && fabs(last->slope) == friction) {
            sign = copysign(1.0, last->slope);
            slip_slope = hs_load_at(group.curve, last[-1].label).slope;
        }
    } else {
        hs_single_path path = hs_single_path_to(to.d, to.v, friction, edge.label, edge.anchor, 0);
        hs_single at = hs_solve_single(hs_labels_of(stack), edge.segment, &path);
        hs_load front = {0.0, 0.0};
        sign = path.sign;
        end->kept = at.inner_count;
        end->slope = sign * friction;
        if (at.inner_count > 0) {
            const hs_vertex *low = stack + at.inner_count - 1;
            if (has_loads) front = hs_load_at(group.curve, at.label);
            end->label = at.label;
            found.force = low->tangential;
            if (at.label != low->label) {
                end->inner_slope = stack[at.inner_count].slope;
                found.force += end->inner_slope * (front.load - low->normal);
            }
        }
        found.force += end->slope * (load - front.load);
        slip_slope = front.slope;
    }
    found.stiffness = slip_slope;
    found.drift = sign * friction * (at_edge.slope - slip_slope);
    return found;
}

static ramp_rates solve_ends(ramp *way, hs_point to, group_end *ends) {
    const hs_line *memory = way->present;
    ramp_rates sum = {0.0, 0.0, 0.0, 0.0, 0.0};
    for (int64_t index = 0; index < memory->contact->groups; ++index) {
        ramp_rates own = way->rates[index] = solve_end(way, index, to, 1, ends + index);
        sum.load += own.load;
        sum.load_slope += own.load_slope;
        sum.force += own.force;
        sum.stiffness += own.stiffness;
        sum.drift += own.drift;
    }
    return sum;
}

/* Direction in (d, V) in which a ramp goes on, from rates on which springs go on to slip; a group
 * that would not slip further sticks. */
static hs_point heading_of(const ramp *way, ramp_rates sum) {
    const double rise = way->load[1] - way->load[0], change = way->force[1] - way->force[0];
    const int64_t groups = way->present->contact->groups;
    const double *friction = way->present->friction;
    hs_point found = {0.0, 0.0};
    for (int iteration = 0; iteration < MOST_ITERATIONS; ++iteration) {
        hs_point before = found;
        found = HS_MADE(hs_point){sum.stiffness * rise, sum.load_slope * change - sum.drift * rise};
        if (found.d == before.d && found.v == before.v) break;
        ramp_rates next = {sum.load, sum.load_slope, sum.force, 0.0, 0.0};
        for (int64_t index = 0; index < groups; ++index) {
            const ramp_rates *own = way->rates + index;
            int slips = own->drift == 0.0 ||
                        copysign(1.0, own->drift) * found.v > friction[index] * found.d;
            next.stiffness += slips ? own->stiffness : own->load_slope;
            next.drift += slips ? own->drift : 0.0;
        }
        sum = next;
    }
    return found;
}

/* Chord of a step, and the ramp beside it: at fraction u, at a distance w across, over the length
 * of the chord. */
typedef struct ramp_chord {
    hs_point from, to;
    double friction, length; /* lengths are (μ² Δd² + ΔV²)^½ */
    double inclination[2];   /* dw/du at both ends */
} ramp_chord;

static hs_point point_beside(const ramp_chord *chord, double u, double w) {
    double rise = chord->to.d - chord->from.d, change = chord->to.v - chord->from.v;
    return HS_MADE(hs_point){chord->from.d + u * rise - w * change / chord->friction,
                             chord->from.v + u * change + w * chord->friction * rise};
}

/* Distance of ramp and chord that rounding alone may cause. */
static double rounding_of(const ramp *way, const ramp_chord *chord) {
    return HS_TIE * (way->reach + fabs(chord->from.v) + fabs(chord->to.v)) / chord->length;
}

/* dw/du of a direction; infinite if it goes back. */
static double inclination_of(const ramp_chord *chord, hs_point heading) {
    double rise = chord->friction * (chord->to.d - chord->from.d),
           change = chord->to.v - chord->from.v;
    double across = rise * heading.v - change * chord->friction * heading.d;
    double along = rise * chord->friction * heading.d + change * heading.v;
    return across == 0.0 ? 0.0 : along > 0.0 ? across / along : HUGE_VAL;
}

/* Cubic Hermite interpolation. */
static double distance_at(const ramp_chord *chord, double u) {
    return u * (1.0 - u) * ((1.0 - u) * chord->inclination[0] - u * chord->inclination[1]);
}

/* Difference of the states at the ends of ramp and chord, over the tolerance; `crossing` is the
 * first fraction at which |dV/dd| crosses the coefficient of a group that would be too far off,
 * or 1. */
static double state_error(const ramp *way, const ramp_chord *chord, double *crossing) {
    const hs_line *memory = way->present;
    const double tolerated = STATE_TOLERANCE * way->tolerance * way->reach,
                 rise = chord->to.d - chord->from.d;
    const double change = fabs(chord->to.v - chord->from.v);
    double most = 0.0, bow = 0.0;
    hs_point point[SAMPLES + 1];
    for (int j = 0; j <= SAMPLES; ++j) {
        double u = (double)j / SAMPLES, w = distance_at(chord, u);
        point[j] = point_beside(chord, u, w);
        bow = hs_max(bow, fabs(w) * chord->length);
    }
    *crossing = 1.0;
    if (bow <= tolerated) return bow / tolerated;
    for (int64_t index = 0; index < memory->contact->groups; ++index) {
        const double friction = memory->friction[index];
        if (memory->contact->gap[memory->contact->first[index]] >=
            hs_max(chord->from.d, chord->to.d))
            break;
        if (rise > 0.0 && change < friction * rise) most = hs_max(most, bow);
        for (int side = -1; side <= 1; side += 2) {
            const hs_point *last = point + SAMPLES;
            double farthest = hs_max(side * point[0].v - friction * point[0].d,
                                     side * last->v - friction * last->d);
            int at = 0;
            for (int j = 1; j < SAMPLES; ++j) {
                double reached = side * point[j].v - friction * point[j].d;
                if (reached > farthest + tolerated) {
                    farthest = reached;
                    at = j;
                }
            }
            if (at > 0) *crossing = hs_min(*crossing, (double)at / SAMPLES);
        }
    }
    return most / tolerated;
}

/* Add factors times P of each asperity at labels. */
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

/* Sum over labels of loads that is added to the asperities of a group. */
typedef struct load_sum {
    const hs_group *group;
    double *part;
    int count;
    double label[16], factor[16];
} load_sum;

static void flush_sum(load_sum *sum) {
    const hs_curve *curve = &sum->group->curve;
    add_loads(curve->gap, curve->weight, curve->count, sum->count, sum->label, sum->factor,
              sum->part);
    sum->count = 0;
}

static void add_term(load_sum *sum, double label, double factor) {
    if (factor == 0.0) return;
    if (sum->count == 16) flush_sum(sum);
    sum->label[sum->count] = label;
    sum->factor[sum->count++] = factor;
}

/* Add a multiple of the loads T of asperities at the end of a path, less those at a vertex. */
static void add_forces(const ramp *way, load_sum *sum, int64_t index, hs_point to,
                       const group_end *end, int64_t base, double factor) {
    const hs_vertex *stack = sum->group->stack;
    int64_t kept = end->kept;
    if (kept < 0) {
        const hs_point from = {way->present->approach, way->present->displacement};
        hs_cone cone = {sum->group->friction, 0.0, 0.0, 0.0};
        kept = hs_move_and_clip(sum->group, NULL, way->present->depth[index], from, to, 0.0, &cone,
                                way->scratch, NULL);
        stack = way->scratch;
        base = 0;
    }
    for (int64_t j = base + 1; j < kept; ++j) {
        add_term(sum, stack[j].label, factor * stack[j].slope);
        add_term(sum, stack[j - 1].label, -factor * stack[j].slope);
    }
    if (end->kept < 0) return;
    add_term(sum, end->label, factor * (end->inner_slope - end->slope));
    if (kept > 0) add_term(sum, stack[kept - 1].label, -factor * end->inner_slope);
    add_term(sum, to.d, factor * end->slope);
}

/* Nodes of a step: ∮ T dV is Σ factor·T over points on the ramp and on the chord. */
typedef struct quadrature {
    hs_point point[2 * NODES];
    double factor[2 * NODES];
    double error; /* difference of the ramp from its interpolation, over its largest distance from
                     the chord */
} quadrature;

/* Have ∮ dV and ∮ V dV vanish, so that springs that stick lose nothing. */
static void close_path(quadrature *nodes, double origin) {
    double integral = 0.0, mean = 0.0, square = 0.0;
    for (int k = 0; k < NODES; ++k) mean += front_weight[NODES - 2][k] * nodes->point[k].v;
    for (int k = 0; k < NODES; ++k)
        square +=
            front_weight[NODES - 2][k] * (nodes->point[k].v - mean) * (nodes->point[k].v - mean);
    for (int k = 0; k < 2 * NODES; ++k) integral += nodes->factor[k] * (nodes->point[k].v - origin);
    for (int k = 0; k < NODES && square > 0.0; ++k)
        nodes->factor[k] -=
            integral * front_weight[NODES - 2][k] * (nodes->point[k].v - mean) / square;
}

static int find_nodes(ramp *way, const ramp_chord *chord, quadrature *nodes) {
    const hs_line *memory = way->present;
    const int64_t groups = memory->contact->groups;
    const double rise = chord->to.d - chord->from.d, change = chord->to.v - chord->from.v;
    const double load_rise = way->load[1] - way->load[0],
                 load_change = way->force[1] - way->force[0];
    double w[NODES], inclination[NODES], most = 0.0, missed = 0.0, mean = 0.0;
    for (int k = 0; k < NODES; ++k)
        most = hs_max(most, fabs(distance_at(chord, front_node[NODES - 2][k])));
    for (int k = 0; k < NODES; ++k) {
        const double u = front_node[NODES - 2][k], guess = w[k] = distance_at(chord, u);
        ramp_rates here;
        for (int iteration = 0;; ++iteration) {
            nodes->point[k] = point_beside(chord, u, w[k]);
            here = solve_ends(way, nodes->point[k], way->ends + k * groups);
            double over = (here.force - memory->tangential_load) * load_rise -
                          (here.load - memory->normal_load) * load_change;
            double slope =
                chord->friction * rise * here.stiffness * load_rise -
                change / chord->friction * (here.drift * load_rise - here.load_slope * load_change);
            double step = slope != 0.0 ? -over / slope : 0.0;
            if (fabs(step) <= DISTANCE_CONVERGED * most + rounding_of(way, chord)) break;
            if (iteration == MOST_ITERATIONS || !(fabs(step) < 1.0)) return 0;
            w[k] += step;
            most = hs_max(most, fabs(w[k]));
        }
        missed = hs_max(missed, fabs(w[k] - guess));
        inclination[k] = inclination_of(chord, heading_of(way, here));
        if (!(fabs(inclination[k]) < HUGE_VAL)) return 0;
        mean += front_weight[NODES - 2][k] * inclination[k];
        nodes->point[NODES + k] = point_beside(chord, u, 0.0);
        for (int64_t index = 0; index < groups; ++index)
            solve_end(way, index, nodes->point[NODES + k], 0,
                      way->ends + (NODES + k) * groups + index);
    }
    for (int k = 0; k < NODES; ++k) {
        const double weight = front_weight[NODES - 2][k];
        nodes->factor[k] = weight * (change + (inclination[k] - mean) * chord->friction * rise);
        nodes->factor[NODES + k] = -weight * change;
    }
    close_path(nodes, chord->from.v);
    nodes->error = most > 0.0 ? missed / most : 0.0;
    return 1;
}

/* Correct the energies of a step from its chord to the ramp; returns the sum of corrections. No
 * asperity gains energy. */
static double correct_energies(ramp *way, const quadrature *nodes) {
    const hs_line *start = way->present;
    const int64_t groups = start->contact->groups;
    double total = 0.0;
    for (int64_t index = 0; index < groups; ++index) {
        const hs_group group = hs_group_of(start, index);
        load_sum sum = {&group, way->part, 0, {0.0}, {0.0}};
        int64_t base = INT64_MAX;
        for (int k = 0; k < 2 * NODES; ++k) {
            int64_t kept = way->ends[k * groups + index].kept;
            base = kept < base ? kept : base;
        }
        base = base > 0 ? base - 1 : 0;
        memset(way->part, 0, (size_t)group.curve.count * sizeof *way->part);
        for (int k = 0; k < 2 * NODES; ++k)
            add_forces(way, &sum, index, nodes->point[k], way->ends + k * groups + index, base,
                       nodes->factor[k]);
        flush_sum(&sum);
        for (int64_t i = 0; i < group.curve.count; ++i) {
            double *each = way->trial->dissipated_each + group.start + i;
            double corrected = hs_max(*each + way->part[i], group.asperity_energy[i]);
            total += corrected - *each;
            *each = corrected;
        }
    }
    return total;
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

/* Move all groups along the chord of a step, and record sliding times on the ramp. */
static int move_along_chord(ramp *way, hs_point to, const hs_group_loads *loads, double load,
                            double force, double time) {
    hs_line *memory = way->trial;
    hs_fronts fronts;
    int status = hs_line_assign(memory, way->present);
    if (status == HS_OK) status = hs_reserve_vertices(memory);
    if (status != HS_OK) return status;
    status = hs_init_fronts(&fronts, memory->contact->groups);
    begin_chord(memory, load, force, time);
    if (status == HS_OK) status = hs_record_slides_on_ramp(memory, to, loads, &fronts);
    if (status == HS_OK)
        status = hs_move_with_loads(memory, loads, to.d, load, hs_to_load(force),
                                    hs_to_displacement(to.v));
    hs_free_fronts(&fronts);
    return status;
}

static int make_room_to_clip(ramp *way) {
    if (!hs_has_steep(way->present)) return HS_OK;
    free(way->scratch);
    way->scratch = (hs_vertex *)malloc(2 * (size_t)hs_room_to_clip(hs_max_depth(way->present)) *
                                       sizeof *way->scratch);
    return way->scratch ? HS_OK : HS_OUT_OF_MEMORY;
}

/* Integrate a step of a ramp along its chord. */
static int integrate_step(hs_integrand *integrand, const hs_interval *step, int chords,
                          double *error) {
    ramp *way = (ramp *)integrand->context;
    hs_line *start = way->present;
    double load = hs_toward(way->load[0], way->load[1], step->end);
    double force = hs_toward(way->force[0], way->force[1], step->end);
    hs_point to = {hs_approach_at_load(start, load), start->displacement};
    hs_group_loads loads;
    (void)chords;
    --integrand->substep_budget;
    int status = make_room_to_clip(way);
    if (status == HS_OK)
        status = hs_count_work(way->drive, &way->work, 2 + start->contact->count / 16);
    if (status == HS_OK) status = hs_loads_of_groups(start, to.d, load, &loads);
    if (status != HS_OK) return status;
    hs_fronts fronts;
    status = hs_init_fronts(&fronts, loads.count);
    if (status == HS_OK)
        status = hs_solve_displacement_with(start, &loads, &fronts, to.d, hs_to_load(force), &to.v);
    hs_free_fronts(&fronts);
    const double friction = hs_friction_range(start, HUGE_VAL).max;
    ramp_chord chord = {{start->approach, start->displacement}, to, friction, 0.0, {0.0, 0.0}};
    const double across = friction * (to.d - chord.from.d), along = to.v - chord.from.v;
    chord.length = sqrt(across * across + along * along);
    double crossing = 1.0, lost = 0.0;
    quadrature nodes;
    *error = 0.0;
    int is_bent = 0;
    if (status == HS_OK && chord.length > 0.0) {
        way->heading[1] = heading_of(way, solve_ends(way, to, way->ends));
        for (int end = 0; end < 2; ++end)
            chord.inclination[end] = inclination_of(&chord, way->heading[end]);
        const double inclination = hs_max(fabs(chord.inclination[0]), fabs(chord.inclination[1]));
        is_bent = inclination > rounding_of(way, &chord);
        if (inclination < STEEP)
            *error = state_error(way, &chord, &crossing);
        else
            *error = TO_HALVE;
        if (crossing < 1.0) *error = hs_max(SAFETY * SAFETY / (crossing * crossing), *error);
        if (is_bent && *error <= 1.0 && !find_nodes(way, &chord, &nodes)) *error = TO_HALVE;
        if (*error == TO_HALVE && step->end - step->begin <= SHORT * way->tolerance)
            *error = is_bent = 0;
    }
    const int is_last = step->end - step->begin <= ramp_settings.min_length;
    if (status == HS_OK && (*error <= 1.0 || way->energy == 0.0 || is_last)) {
        status = move_along_chord(way, to, &loads, load, force,
                                  hs_toward(way->times[0], way->times[1], step->end));
        lost = way->trial->dissipated - start->dissipated;
        way->energy = hs_max(way->energy, lost);
    }
    if (status == HS_OK && is_bent && *error <= 1.0) {
        double more = correct_energies(way, &nodes),
               part = hs_max(step->end - step->begin, LEAST_PART);
        way->trial->dissipated += more;
        double rounding =
            HS_TIE * (start->dissipated + way->reach * hs_max(way->load[0], way->load[1]));
        double tolerated = ENERGY_TOLERANCE * way->tolerance * way->energy * part;
        /* of fourth order at least */
        *error = hs_max(*error, sqrt(hs_error(more * nodes.error, rounding, tolerated)));
    }
    hs_free_group_loads(&loads);
    return status;
}

static int accept_step(hs_integrand *integrand, const hs_interval *step) {
    ramp *way = (ramp *)integrand->context;
    (void)step;
    hs_line_swap(way->present, way->trial);
    way->heading[0] = way->heading[1];
    return HS_OK;
}

static int integrate_ramp(hs_line *memory, ramp *way) {
    hs_adaptive settings = ramp_settings;
    hs_integrand integrand = {way, &settings, integrate_step, accept_step, NULL, 0, 0.0};
    for (;;) {
        way->tolerance = settings.tolerance =
            hs_max(settings.tolerance, hs_max(way->drive->tolerance, LEAST_TOLERANCE));
        int status = hs_line_assign(way->present, memory);
        const hs_point from = {memory->approach, memory->displacement};
        if (status == HS_OK) status = make_room_to_clip(way);
        if (status != HS_OK) return status;
        way->heading[0] = heading_of(way, solve_ends(way, from, way->ends));
        status = hs_adapt(&integrand, 0.0, 1.0);
        if (status != HS_TOO_MANY_SUBSTEPS) return status;
        hs_coarsen(&settings, integrand.reached);
    }
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
        return exact_ramp(memory, load, force, time, drive);
    const double d = hs_approach_at_load(memory, load);
    /* one straight path is exact where N is constant or nothing slips */
    if (rise == 0.0 || sticks) {
        begin_chord(memory, load, force, time);
        return hs_move(memory, d, load, hs_to_load(force));
    }
    ramp way = {{memory->normal_load, load},
                {memory->tangential_load, force},
                {memory->clock.end, time},
                drive->tolerance,
                friction.max * (hs_max(memory->approach, d) - touch),
                0.0,
                drive,
                0,
                NULL,
                NULL,
                {{0.0, 0.0}, {0.0, 0.0}},
                NULL,
                NULL,
                NULL,
                NULL};
    const size_t groups = (size_t)contact->groups;
    way.present = hs_line_copy(memory);
    way.trial = hs_line_copy(memory);
    way.ends = (group_end *)malloc(2 * NODES * groups * sizeof *way.ends);
    way.rates = (ramp_rates *)malloc(groups * sizeof *way.rates);
    way.part = (double *)malloc((size_t)contact->count * sizeof *way.part);
    const int has_room = way.present && way.trial && way.ends && way.rates && way.part;
    int status = has_room ? integrate_ramp(memory, &way) : (int)HS_OUT_OF_MEMORY;
    if (status == HS_OK) hs_line_swap(memory, way.present);
    hs_line_free(way.present);
    hs_line_free(way.trial);
    free(way.ends);
    free(way.rates);
    free(way.scratch);
    free(way.part);
    return status;
}
