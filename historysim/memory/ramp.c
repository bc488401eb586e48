/* Ramp: a straight path in (N, T), carried out by straight paths in (d, V), its chords, which end
 * in the same state. Energies of a single group are those of front.c; of several groups they differ
 * from those of the chord by ∮ T dV of ramp and chord, by Gauss's quadrature (README.md, theory
 * 10).
 */

#include "ramp.h"
#include "adaptive.h"
#include "drive.h"
#include "lanes.h"
#include "slides.h"

/* Several groups.
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

/* Sum over labels of loads that is added to the asperities of a group. */
typedef struct load_sum {
    const hs_group *group;
    double *part;
    int count;
    double label[16], factor[16];
} load_sum;

static void flush_sum(load_sum *sum) {
    const hs_curve *curve = &sum->group->curve;
    hs_add_loads(curve->gap, curve->weight, curve->count, sum->count, sum->label, sum->factor,
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
    memory->is_direct = 1;
    status = hs_init_fronts(&fronts, memory->contact->groups);
    hs_begin_ramp(memory, load, force, time);
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
        return hs_ramp_group(memory, load, force, time, drive);
    const double d = hs_approach_at_load(memory, load);
    /* one straight path is exact where N is constant or nothing slips */
    if (rise == 0.0 || sticks) {
        hs_begin_ramp(memory, load, force, time);
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
    memory->is_direct = 0;
    hs_line_free(way.present);
    hs_line_free(way.trial);
    free(way.ends);
    free(way.rates);
    free(way.scratch);
    free(way.part);
    return status;
}
