/* Classes: the rings of all asperities on one rigid body, by gap, that moves in two tangential directions. From the nodes at the start
 * of a path and its target it computes steps of second order (SDIRK2, two problems of rings.c each), halved until load and
 * energy settle, and the energy that each asperity dissipates (README.md, two directions 2 to 4). */

#include "rings.h"
#include "adaptive.h"
#include "lanes.h"
#include "losses.h"

/* first stage of a step of SDIRK2, 1 - 1/√2; and how much of what slips there belongs to the whole step, (1 - γ)/γ */
#define STAGE 0.29289321881345254
#define REST 2.414213562373095
/* share of a cell nearer than which to the edge a node is left out of a stage */
#define NEAREST 0.02
/* cells wider than this are cut, and joined ones are no wider than that */
#define WIDEST_CELL 1.01
#define JOINED_CELL 1.1
/* rings from the edge at which it is looked whether they slip at once, where cells are refined; cells there are no finer than
 * this share of the way over μ, if that is no finer than this of the depth of the class, and grow by a share of their depth;
 * and how many are cut at a time */
#define LOOKED_AT 20
#define FINEST 0.125
#define FINEST_OF_DEPTH 1e-9
#define GROWING 0.15
#define MOST_CUT 32
/* nodes of a class over its rings, up to which legs without slip append some */
#define MOST_NODES 4
/* A node is not missed if the tangential load changes by so little of the friction limit; and by so little of what a step has
 * changed, that small loops stay. */
#define NOT_MISSED 1e-5
#define NOT_MISSED_OF_STEP 1e-5
#define NEVER_MISSED 1e-9
/* A step is accepted without a second estimate where its two stages slide so evenly: the load that differs, over the tolerance
 * of the limit, and of the load that has slid, unless it is next to nothing; and where the approach changes by at most this of
 * the depth. Otherwise it is halved until the load settles, and so does the energy, over the tolerance of itself or of the
 * limit times the way. Two splits may agree by chance: the energy that rests on the curvature of the slip within the halves,
 * in each of them a second estimate, has to be as small a part of the whole, too. */
#define EVEN 1.0
#define EVEN_OF_SLIP 10.0
#define ALWAYS_EVEN 3e-3
#define STEADY 0.1
#define SETTLED_LOAD 0.5
#define SETTLED_LOSS 5.0
#define SETTLED_WORK 5e-3
#define MOST_CURVED 0.05
/* a step of 2^-12 of a path is not halved, which bounds the time of a path */
#define MOST_HALVINGS 12
/* turns of Newton's method, and cuts of each of its steps */
#define MOST_TURNS 100
#define MOST_CUTS 40
/* part of what is asked for that may be left */
#define ARRIVED 1e-12

static const hs_vector nowhere = {0.0, 0.0};

hs_body *hs_body_new(const hs_line *line, int64_t rings, double tolerance) {
    size_t count = (size_t)line->contact->count;
    hs_body *body = (hs_body *)calloc(1, sizeof *body);
    double *numbers = (double *)malloc(3 * count * sizeof *numbers);
    if (!body || !numbers) {
        free(body);
        free(numbers);
        return NULL;
    }
    body->contact = line->contact;
    body->friction = line->friction;
    body->rings = rings;
    body->tolerance = tolerance;
    body->approach = line->approach;
    body->normal_load = line->normal_load;
    body->dissipated = line->dissipated;
    body->each = numbers;
    body->slide_time = numbers + count;
    body->scratch = numbers + 2 * count;
    for (size_t i = 0; i < count; ++i) body->slide_time[i] = NAN;
    memcpy(body->each, line->dissipated_each, count * sizeof *numbers);
    return body;
}

void hs_body_free(hs_body *body) {
    if (!body) return;
    for (int64_t c = 0; c < body->classes; ++c) {
        free(body->parts[c].nodes);
        free(body->parts[c].held);
        free(body->parts[c].problem);
    }
    free(body->parts);
    free(body->each);
    free(body);
}

int hs_class_room(hs_class *part, int64_t count) {
    if (count <= part->room) return HS_OK;
    hs_node *nodes = (hs_node *)realloc(part->nodes, (size_t)(count + 8) * sizeof *nodes);
    if (nodes) part->nodes = nodes;
    hs_held *held = (hs_held *)realloc(part->held, (size_t)(count + 8) * sizeof *held);
    if (held) part->held = held;
    if (!nodes || !held) return HS_OUT_OF_MEMORY;
    part->room = (int32_t)count + 8;
    return HS_OK;
}

/* Have a body be where another one of the same classes is, but for what each asperity has lost. */
static int assign(hs_body *target, const hs_body *source) {
    target->approach = source->approach;
    target->normal_load = source->normal_load;
    target->dissipated = source->dissipated;
    target->time = source->time;
    target->fraction = source->fraction;
    target->displacement = source->displacement;
    target->tangential_load = source->tangential_load;
    for (int64_t c = 0; c < source->classes; ++c) {
        hs_class *to = target->parts + c;
        const hs_class *from = source->parts + c;
        if (hs_class_room(to, from->count) != HS_OK) return HS_OUT_OF_MEMORY;
        to->count = from->count;
        if (from->count) memcpy(to->nodes, from->nodes, (size_t)from->count * sizeof *to->nodes);
    }
    return HS_OK;
}

/* A copy to try a step with, without numbers of each asperity. */
static hs_body *trial_of(const hs_body *body) {
    hs_body *copy = (hs_body *)malloc(sizeof *copy);
    hs_class *parts = (hs_class *)malloc((size_t)(body->classes + 1) * sizeof *parts);
    if (!copy || !parts) {
        free(copy);
        free(parts);
        return NULL;
    }
    *copy = *body;
    copy->each = copy->slide_time = copy->scratch = NULL;
    copy->parts = parts;
    for (int64_t c = 0; c < body->classes; ++c) {
        parts[c] = body->parts[c];
        parts[c].nodes = NULL;
        parts[c].held = NULL;
        parts[c].room = parts[c].slid = 0;
        parts[c].problem = NULL;
    }
    if (assign(copy, body) == HS_OK) return copy;
    hs_body_free(copy);
    return NULL;
}

hs_body *hs_body_copy(const hs_body *body) {
    size_t count = (size_t)body->contact->count;
    hs_body *copy = trial_of(body);
    if (!copy) return NULL;
    copy->each = (double *)malloc(3 * count * sizeof *copy->each);
    if (!copy->each) {
        hs_body_free(copy);
        return NULL;
    }
    copy->slide_time = copy->each + count;
    copy->scratch = copy->each + 2 * count;
    memcpy(copy->each, body->each, 2 * count * sizeof *copy->each);
    return copy;
}

hs_node hs_node_at(const hs_class *part, double label, hs_vector deflection) {
    hs_normal there = hs_normal_at(part->curve, label);
    return HS_MADE(hs_node){label, there.load, there.integral, deflection};
}

/* A node of the straight line between two others, at a share of the way from the inner one. */
static hs_node node_between(const hs_class *part, hs_node inner, hs_node outer, double label, double share) {
    return hs_node_at(part, label, hs_between(inner.deflection, outer.deflection, share));
}

/* Cut cells that are too wide, which changes nothing. */
static int cut_cells(hs_class *part, double cell) {
    int64_t more = 0;
    for (int32_t k = 1; k < part->count; ++k)
        more += (int64_t)((part->nodes[k - 1].label - part->nodes[k].label) / cell);
    if (more == 0) return HS_OK;
    if (hs_class_room(part, part->count + more) != HS_OK) return HS_OUT_OF_MEMORY;
    hs_node *nodes = part->nodes;
    int64_t at = part->count - 1 + more;
    for (int32_t k = part->count - 1; k >= 1; --k) {
        hs_node inner = nodes[k], outer = nodes[k - 1];
        double width = outer.label - inner.label;
        int64_t cuts = (int64_t)(width / cell);
        nodes[at--] = inner;
        for (int64_t i = 1; i <= cuts; ++i) {
            double share = (double)i / (double)(cuts + 1);
            nodes[at--] = node_between(part, inner, outer, inner.label + share * width, share);
        }
    }
    part->count += (int32_t)more;
    return HS_OK;
}

/* Leave nodes out whose neighbours are near, and between which v is straight but for a change of the load. */
static void join_cells(hs_class *part, double cell, double change) {
    hs_node *nodes = part->nodes;
    int32_t kept = 1;
    for (int32_t k = 1; k + 1 < part->count; ++k) {
        hs_node outer = nodes[kept - 1], here = nodes[k], inner = nodes[k + 1];
        double width = outer.label - inner.label, share = (outer.label - here.label) / width;
        hs_vector straight = hs_between(outer.deflection, inner.deflection, share);
        double mass = (outer.normal - here.normal) / (outer.label - here.label) -
                      (here.normal - inner.normal) / (here.label - inner.label);
        double missed = fabs(mass) * hs_length(hs_plus(here.deflection, -1.0, straight));
        int left_out = width <= JOINED_CELL * cell && missed <= change;
        if (!left_out) nodes[kept++] = here;
    }
    nodes[kept++] = nodes[part->count - 1];
    part->count = kept;
}

/* Nodes where cells are wide, fewer where they are narrow and v is straight but for so small a share of the friction limit,
 * or, where there are too many, for at most `NOT_MISSED` of it: more would be no less on half a step, and never settle. */
static int regrid(hs_class *part, int64_t rings, double friction, double missed) {
    if (part->count < 2) return HS_OK;
    double cell = (part->nodes[0].label - hs_deepest_of(part)) / (double)rings;
    if (cut_cells(part, WIDEST_CELL * cell) != HS_OK) return HS_OUT_OF_MEMORY;
    for (; missed <= NOT_MISSED; missed *= 4.0) {
        join_cells(part, cell, missed * friction * part->nodes[0].normal);
        if (part->count <= 2 * rings + 2) break;
    }
    return HS_OK;
}

/* Cut cells into which springs would slip first on a way, which changes nothing: nodes then stand as near the front as it
 * is near the edge, and a small turn, too, is seen. */
static int refine(hs_class *part, double friction, hs_vector way) {
    const hs_node *nodes = part->nodes;
    int32_t beyond = 0, last = part->count - 1 < LOOKED_AT ? part->count - 1 : LOOKED_AT;
    double least = FINEST * hs_length(way) / friction, fresh[MOST_CUT];
    if (part->count < 2 || friction == 0.0 || least == 0.0) return HS_OK;
    double edge = nodes[0].label, first = edge - nodes[1].label;
    /* a way this short is rounding, and cells as fine as it have no weight */
    if (least < FINEST_OF_DEPTH * (edge - hs_deepest_of(part))) return HS_OK;
    /* labels have to differ */
    least = hs_most(least, 8.0 * HS_TIE * fabs(edge));
    for (int32_t i = 1; i <= last; ++i) {
        double depth = edge - nodes[i].label, share = (sqrt(depth) - sqrt(hs_most(depth - first, 0.0))) / first;
        if (hs_length(hs_plus(hs_ring_traction(nodes, i), share, way)) > friction * sqrt(depth)) beyond = i;
    }
    if (beyond == LOOKED_AT) return HS_OK;
    int32_t count = 0, end = beyond + 2 < part->count ? beyond + 2 : part->count - 1;
    for (int32_t k = beyond; k < end; ++k) {
        double inner = edge - nodes[k + 1].label, at = edge - nodes[k].label;
        for (;;) {
            double cell = hs_most(least, GROWING * at);
            if (at + 1.5 * cell > inner || count == MOST_CUT) break;
            fresh[count++] = edge - (at += cell);
        }
    }
    if (count == 0) return HS_OK;
    if (hs_class_room(part, part->count + count) != HS_OK) return HS_OUT_OF_MEMORY;
    int32_t k = part->count - 1, at = k + count;
    part->count += count;
    while (count > 0) {
        hs_node outer = part->nodes[k];
        if (outer.label < fresh[count - 1]) {
            part->nodes[at--] = outer;
            --k;
            continue;
        }
        hs_node inner = part->nodes[at + 1];
        double label = fresh[--count], share = (label - inner.label) / (outer.label - inner.label);
        part->nodes[at--] = node_between(part, inner, outer, label, share);
    }
    return HS_OK;
}

/* Have a class nodes to touch at, where the approach grows; and place to work in. */
static int prepare(hs_class *part, double from, double to, int64_t rings) {
    double deepest = hs_deepest_of(part), first = hs_most(from, deepest), cell = (to - deepest) / (double)rings;
    if (to > first) {
        int64_t cells = 1 + (int64_t)hs_least((to - first) / cell, (double)rings), fresh = part->count == 0;
        int64_t more = cells - 1 + fresh;
        if (hs_class_room(part, part->count + more + 1) != HS_OK) return HS_OUT_OF_MEMORY;
        memmove(part->nodes + more, part->nodes, (size_t)part->count * sizeof *part->nodes);
        part->count += (int32_t)more;
        for (int64_t k = 0; k + 1 < cells; ++k)
            part->nodes[k] = hs_node_at(part, to - (to - first) * ((double)(k + 1) / (double)cells), nowhere);
        /* a class that does not touch yet begins at its deepest spring */
        if (fresh) part->nodes[more - 1] = hs_node_at(part, deepest, nowhere);
    }
    return hs_ring_room(part, part->count + 1);
}

/* Set the problem of a class up at an edge, on a path that began at another one. */
static void set_up(hs_class *part, double from, double edge, double friction, int64_t rings, int stage) {
    hs_ring_problem *problem = part->problem;
    int second = stage == 2;
    double nearest = NEAREST * (edge - hs_deepest_of(part)) / (double)rings;
    int32_t at = 0, first = 0, stays = edge == from;
    while (stays ? part->nodes[first].label >= edge : part->nodes[first].label > edge - nearest) ++first;
    int same = second && stays;
    problem->label[0] = edge;
    if (!stays) problem->edge[stage] = hs_normal_at(part->curve, edge);
    if (!same) {
        problem->normal[0] = stays ? part->nodes[0].normal : problem->edge[stage].load;
        problem->integral[0] = stays ? part->nodes[0].integral : problem->edge[stage].integral;
    }
    for (int32_t k = first; k < part->count; ++k) {
        const hs_node *node = part->nodes + k;
        ++at;
        problem->label[at] = node->label;
        problem->normal[at] = node->normal;
        problem->integral[at] = node->integral;
        problem->share[at] = node->label > from ? (edge - node->label) / (edge - from) : 1.0;
        problem->base[at] = second ? hs_plus(node->deflection, -REST, problem->slipped[k]) : node->deflection;
    }
    if (!same) hs_ring_nodes(problem, at + 1, friction);
    else if (problem->limit[at] != friction * sqrt(problem->depth[at])) hs_ring_limits(problem, friction);
}

static hs_vector forces(hs_body *body, double edge, hs_vector way, double slopes[2][2]) {
    hs_vector force = nowhere;
    if (slopes) memset(slopes, 0, 4 * sizeof(double));
    for (int64_t c = 0; c < body->classes; ++c) {
        hs_class *part = body->parts + c;
        double own[2][2];
        if (part->count == 0 || edge <= hs_deepest_of(part)) continue;
        hs_ring_solve(part->problem, way, body->watch);
        force = hs_plus(force, 1.0, hs_ring_force(part->problem));
        if (!slopes) continue;
        hs_ring_slopes(part->problem, own);
        for (int i = 0; i < 4; ++i) slopes[i / 2][i % 2] += own[i / 2][i % 2];
    }
    return force;
}

static hs_vector left_of(const hs_plane_aim *aim, hs_vector displacement, hs_vector force) {
    return HS_MADE(hs_vector){aim->value.x - aim->rigid.x * displacement.x - aim->compliance.x * force.x,
                       aim->value.y - aim->rigid.y * displacement.y - aim->compliance.y * force.y};
}

/* Whether an aim prescribes the displacement itself, along x and along y. */
static int fixes_x(const hs_plane_aim *aim) { return aim->rigid.x > 0.0 && aim->compliance.x == 0.0; }
static int fixes_y(const hs_plane_aim *aim) { return aim->rigid.y > 0.0 && aim->compliance.y == 0.0; }

/* Whether the caller wants no more of it. */
static int is_stopped(const hs_body *body) { return body->watch && body->watch->status != HS_OK; }

/* The farthest that any spring can be deflected. */
static double reach_of(const hs_body *body, double edge) {
    double most = 0.0;
    for (int64_t c = 0; c < body->classes; ++c)
        most = hs_most(most, hs_coefficient(body, body->parts[c].group, body->fraction) * (edge - hs_deepest_of(body->parts + c)));
    return most;
}

/* Whether the rest `left` of an aim is negligible; where components are of different units, each by itself. */
static int has_arrived(const hs_plane_aim *aim, hs_vector left, hs_vector force) {
    if (aim->rigid.x == aim->rigid.y) return hs_length(left) <= ARRIVED * hs_length(aim->value);
    double load = hs_length(force);
    return fabs(left.x) <= ARRIVED * (aim->rigid.x > 0.0 ? fabs(aim->value.x) : load) &&
           fabs(left.y) <= ARRIVED * (aim->rigid.y > 0.0 ? fabs(aim->value.y) : load);
}

/* The way from the start at which the tangential channel is where it aims.
 *
 * What is left, over the compliance, is the slope of a concave function of the components that are not fixed. So Newton's method
 * finds its top, if no step goes so far beyond the top along its line that the slope there is larger than half of what it was.
 * A step goes no farther than springs reach, and than twice as far after one that went as far as that. */
static hs_vector way_to(hs_body *body, double edge, hs_vector way, const hs_plane_aim *aim, hs_vector *force) {
    const hs_vector start = body->displacement;
    const int fixed_x = fixes_x(aim), fixed_y = fixes_y(aim);
    double slopes[2][2], reach = reach_of(body, edge);
    if (fixed_x) way.x = aim->value.x - start.x;
    if (fixed_y) way.y = aim->value.y - start.y;
    *force = forces(body, edge, way, fixed_x && fixed_y ? NULL : slopes);
    if (fixed_x && fixed_y) return way;
    /* 1 over the compliances, times both of them */
    const double weight_x = fixed_y ? 1.0 : aim->compliance.y, weight_y = fixed_x ? 1.0 : aim->compliance.x;
    hs_vector left = left_of(aim, hs_plus(start, 1.0, way), *force);
    for (int turn = 0; turn < MOST_TURNS; ++turn) {
        double xx = aim->rigid.x + aim->compliance.x * slopes[0][0], xy = aim->compliance.x * slopes[0][1];
        double yx = aim->compliance.y * slopes[1][0], yy = aim->rigid.y + aim->compliance.y * slopes[1][1];
        double determinant = xx * yy - xy * yx;
        if (fixed_x) left.x = 0.0;
        if (fixed_y) left.y = 0.0;
        if (has_arrived(aim, left, *force) || is_stopped(body)) break;
        hs_vector step = {(yy * left.x - xy * left.y) / determinant, (xx * left.y - yx * left.x) / determinant};
        hs_vector uphill = {weight_x * left.x, weight_y * left.y};
        /* where all slide, the load hardly says where to */
        if (!(determinant > 0.0) || !(hs_dot(step, uphill) > 0.0)) step = left;
        /* without contact nothing bounds a step: the drive alone moves */
        double size = hs_length(step), whole = reach > 0.0 && size > reach ? reach / size : 1.0, share = whole, slope = hs_dot(uphill, step);
        hs_vector next = way;
        for (int cut = 0; cut < MOST_CUTS; ++cut) {
            next = hs_plus(way, share, step);
            *force = forces(body, edge, next, slopes);
            left = left_of(aim, hs_plus(start, 1.0, next), *force);
            double there = weight_x * left.x * step.x + weight_y * left.y * step.y;
            if (there >= -0.5 * slope || is_stopped(body)) break;
            share *= hs_most(slope / (slope - there), 0.1);
        }
        if (share == whole && whole < 1.0) reach *= 2.0;
        if (next.x == way.x && next.y == way.y) break;
        way = next;
    }
    return way;
}

/* A node of the solution of a problem. */
static hs_node node_found(const hs_ring_problem *problem, int32_t k) {
    return HS_MADE(hs_node){problem->label[k], problem->normal[k], problem->integral[k], problem->found[k]};
}

/* ½ ∫ |v|² P'' da over the straight piece between two nodes, but for what cancels between neighbouring pieces. */
static double energy_between(const hs_node *outer, const hs_node *inner) {
    double width = outer->label - inner->label;
    hs_vector rise = hs_plus(outer->deflection, -1.0, inner->deflection);
    hs_vector slope = {rise.x / width, rise.y / width};
    return inner->normal * hs_dot(slope, inner->deflection) - outer->normal * hs_dot(slope, outer->deflection) +
           hs_dot(slope, slope) * (outer->integral - inner->integral);
}

double hs_class_stored(const hs_class *part) {
    double total = 0.0;
    for (int32_t k = 1; k < part->count; ++k) total += energy_between(part->nodes + k - 1, part->nodes + k);
    return total;
}

/* Add to each asperity of a class the elastic energy of its springs. */
static void add_stored(const hs_class *part, double *each) {
    for (int32_t k = 1; k < part->count; ++k) {
        const hs_node *inner = part->nodes + k, *outer = inner - 1;
        hs_vector a = inner->deflection, b = outer->deflection;
        hs_slip x = {inner->label, outer->label, a.x, b.x, 0.5 * a.x, 0.5 * b.x};
        hs_slip y = {inner->label, outer->label, a.y, b.y, 0.5 * a.y, 0.5 * b.y};
        hs_add_energy(part->curve, each, &x);
        hs_add_energy(part->curve, each, &y);
    }
}

/* Loads of asperities at a label, times a factor. */
HS_WIDE static void add_node(const double *restrict gap, const double *restrict weight, int64_t count, double label,
                             double factor, double *restrict sum) {
    for (int64_t i = 0; i < count; ++i) {
        double depth = label - gap[i] > 0.0 ? label - gap[i] : 0.0;
        sum[i] += factor * weight[i] * depth * sqrt(depth);
    }
}

/* Spread what a class has dissipated over its asperities, by the elastic energy of their springs, or by the loads that they carry
 * where no spring is strained. */
static void spread_by_stored(hs_body *body, const hs_class *part, double lost) {
    const hs_curve *curve = &part->curve;
    double *own = body->scratch, sum = 0.0;
    memset(own, 0, (size_t)curve->count * sizeof *own);
    add_stored(part, own);
    for (int64_t i = 0; i < curve->count; ++i) sum += own[i];
    if (!(sum > 0.0)) {
        double edge = part->nodes[0].label;
        add_node(curve->gap, curve->weight, hs_count_touching(curve->gap, curve->count, edge), edge, 1.0, own);
        for (int64_t i = 0; i < curve->count; ++i) sum += own[i];
    }
    for (int64_t i = 0; sum > 0.0 && i < curve->count; ++i) body->each[part->start + i] += lost / sum * own[i];
}

/* Spread what a class has dissipated in a step over its asperities, by what its springs held while they slid, or, where it has
 * lifted off or they held nothing, by what they held `before`. */
static void spread_loss(hs_body *body, const hs_class *before, const hs_class *part, double scale) {
    double *own = body->scratch, sum = 0.0, slope = 0.0, lost = scale * part->lost;
    if (part->curve.load || !(lost > 0.0)) return;
    if (part->count == 0) {
        spread_by_stored(body, before, lost);
        return;
    }
    int64_t touching = hs_count_touching(part->curve.gap, part->curve.count, part->held[0].label);
    memset(own, 0, (size_t)touching * sizeof *own);
    for (int32_t k = 0; k < part->slid; ++k) {
        const hs_held *here = part->held + k, *inner = here + 1;
        double next = k + 1 < part->slid ? (inner->product - here->product) / (here->label - inner->label) : 0.0;
        int64_t below = hs_count_touching(part->curve.gap, part->curve.count, here->label);
        if (next != slope) add_node(part->curve.gap, part->curve.weight, below, here->label, next - slope, own);
        slope = next;
    }
    for (int64_t i = 0; i < touching; ++i) sum += own[i] = hs_most(own[i], 0.0);
    if (!(sum > 0.0)) spread_by_stored(body, before->count ? before : part, lost);
    for (int64_t i = 0; sum > 0.0 && i < touching; ++i) body->each[part->start + i] += lost / sum * own[i];
}

/* Spread what the classes have dissipated in a step over their asperities. */
static void spread_losses(hs_body *body, const hs_body *from, const hs_body *to, double scale) {
    for (int64_t c = 0; c < body->classes; ++c)
        if (from->parts[c].count || to->parts[c].count) spread_loss(body, from->parts + c, to->parts + c, scale);
}

/* Begin to note where a class dissipates on a step: at the nodes, and at the edge, which may not be one of them yet. */
static void begin_loss(hs_class *part, double from, double to) {
    const hs_held edge = {hs_most(from, to), 0.0};
    int32_t fresh = part->nodes[0].label < edge.label;
    part->slid = part->count + fresh;
    part->held[0] = edge;
    for (int32_t k = 1; k < part->slid; ++k) {
        part->held[k] = HS_MADE(hs_held){part->nodes[k - fresh].label, 0.0};
    }
}

/* Add where a class has dissipated in a stage. */
static void add_loss(hs_class *part, double weight) {
    const hs_ring_problem *problem = part->problem;
    int32_t left_out = part->slid - problem->rings - 1;
    for (int32_t k = 1; k <= problem->solved; ++k) {
        hs_vector slid = hs_plus(problem->trial[k], -1.0, problem->found[k]);
        part->held[left_out + k].product += weight * hs_dot(problem->found[k], slid);
    }
}

/* Have classes nodes where a step needs them, and place to work in. Nodes are left out here, and not where a step ends: where it
 * ends, tractions are those of its solution. */
static int make_ready(hs_body *body, const hs_plane_target *to) {
    const hs_plane_aim *aim = &to->aim;
    hs_vector way = left_of(aim, body->displacement, body->tangential_load);
    double sticks = hs_load_at(hs_all_of(body->contact), body->approach).slope, limit = hs_body_limit(body, body->approach, body->fraction);
    /* as if all stuck */
    double x = aim->rigid.x + aim->compliance.x * sticks, y = aim->rigid.y + aim->compliance.y * sticks;
    way.x = x > 0.0 ? way.x / x : 0.0;
    way.y = y > 0.0 ? way.y / y : 0.0;
    double missed = limit > 0.0 ? hs_least(NOT_MISSED_OF_STEP * sticks * hs_length(way) / limit, NOT_MISSED) : 0.0;
    missed = hs_most(missed, NEVER_MISSED);
    for (int64_t c = 0; c < body->classes; ++c) {
        hs_class *part = body->parts + c;
        double friction = hs_coefficient(body, part->group, body->fraction);
        if (hs_most(to->approach, body->approach) <= hs_deepest_of(part)) continue;
        if (regrid(part, body->rings, friction, missed) != HS_OK || refine(part, friction, way) != HS_OK ||
            prepare(part, body->approach, to->approach, body->rings) != HS_OK)
            return HS_OUT_OF_MEMORY;
        begin_loss(part, body->approach, to->approach);
        memset(part->problem->edge, 0, sizeof part->problem->edge);
        memset(part->problem->relieved, 0, sizeof part->problem->relieved);
        if (to->approach != body->approach) part->problem->edge[0] = hs_normal_at(part->curve, body->approach);
        memset(part->problem->slipped, 0, (size_t)part->count * sizeof(hs_vector));
    }
    return HS_OK;
}

/* Whether a class takes part in a step. */
static int takes_part(const hs_body *body, const hs_class *part, const hs_plane_target *to) {
    return hs_most(to->approach, body->approach) > hs_deepest_of(part);
}

/* Deflection of a node as if all stuck from one approach to another one: up to where its spring lifts off, or from where it
 * touches. */
static hs_vector stuck_deflection(const hs_node *node, double from, double to, hs_vector way) {
    double share = 1.0;
    if (to > from && node->label > from) share = (to - node->label) / (to - from);
    if (to < from && node->label > to) share = (from - node->label) / (from - to);
    return hs_plus(node->deflection, share, way);
}

/* Approach over which the stiffness P' is taken for straight, relative to the depth of the class. */
#define STRAIGHT 1e-3

static int is_straight(const hs_class *part, double from, double to) {
    return fabs(to - from) <= STRAIGHT * (hs_most(from, to) - hs_deepest_of(part));
}

/* Deflection of a spring between a node and the next one outside. */
static hs_vector deflection_at(const hs_node *inner, double label) {
    const hs_node *outer = inner - 1;
    return hs_between(inner->deflection, outer->deflection, (label - inner->label) / (outer->label - inner->label));
}

/* Energy of the springs of a class as if all stuck: those that lift off on the way hold what they held there. At a constant
 * approach it is what they hold and the work of the load of the rings, which has no springs at the edge. */
static double stuck_energy(const hs_class *part, double from, double to, hs_vector way) {
    const hs_ring_problem *problem = part->problem;
    const hs_node *nodes = part->nodes;
    hs_node outer = nodes[0];
    int32_t first = 1, left_out = part->count - problem->rings - 1;
    double total = 0.0;
    if (to == from) {
        total = hs_class_stored(part);
        for (int32_t k = 1; k <= problem->rings; ++k)
            total += problem->mass[k] * hs_dot(way, hs_plus(nodes[left_out + k].deflection, 0.5, way));
        return total;
    }
    if (is_straight(part, from, to)) {
        /* springs between both edges, whose deflection goes from that of the inner edge to 0 */
        const hs_normal *inside = problem->edge + (to > from ? 0 : 2), *outside = problem->edge + (to > from ? 2 : 0);
        hs_vector held = way;
        if (to < from) {
            while (nodes[first].label >= to) ++first;
            held = hs_plus(deflection_at(nodes + first, to), 1.0, way);
        }
        total = hs_dot(held, held) * (2.0 * inside->slope + outside->slope) / 6.0;
        outer = HS_MADE(hs_node){hs_least(from, to), inside->load, inside->integral, held};
    } else if (nodes[0].label < to) {
        outer = HS_MADE(hs_node){to, problem->edge[2].load, problem->edge[2].integral, nowhere};
        first = 0;
    }
    for (int32_t k = first; k < part->count; ++k) {
        hs_node inner = nodes[k];
        inner.deflection = stuck_deflection(nodes + k, from, to, way);
        if (to < from && inner.label < to && outer.label > to) {
            /* the outermost spring that still touches */
            hs_vector held = hs_plus(deflection_at(nodes + k, to), 1.0, way);
            hs_node edge = {to, problem->edge[2].load, problem->edge[2].integral, held};
            total += energy_between(&outer, &edge);
            outer = edge;
        }
        total += energy_between(&outer, &inner);
        outer = inner;
    }
    return total;
}

/* Energy of the springs at the solution of a problem. */
static double energy_found(const hs_ring_problem *problem) {
    hs_node outer = node_found(problem, 0);
    double total = 0.0;
    for (int32_t k = 1; k <= problem->rings; ++k) {
        hs_node inner = node_found(problem, k);
        total += energy_between(&outer, &inner);
        outer = inner;
    }
    return total;
}

/* Load that springs would carry if all stuck, less what they carry after a stage. */
static hs_vector relieved_load(const hs_class *part, double from, double edge, hs_vector way, int stage) {
    const hs_ring_problem *problem = part->problem;
    const hs_node *nodes = part->nodes;
    int32_t left_out = part->count - problem->rings - 1;
    hs_vector load = nowhere;
    for (int32_t k = 1; k <= problem->rings; ++k) {
        hs_vector stuck = hs_plus(nodes[left_out + k].deflection, problem->share[k], way);
        load = hs_plus(load, problem->mass[k], hs_plus(stuck, -1.0, problem->found[k]));
    }
    if (edge == from) return load;
    /* from the outermost of these nodes on: by nodes that are left out, and at an edge that falls springs would be strained */
    int32_t k = left_out + 1;
    hs_vector held = stuck_deflection(nodes + k, from, edge, way), outer = nowhere;
    double mean = (problem->normal[0] - problem->normal[1]) / (problem->label[0] - problem->label[1]);
    load = hs_plus(load, -mean, held);
    for (; k > 0 && nodes[k - 1].label < edge; --k, held = outer) {
        outer = stuck_deflection(nodes + k - 1, from, edge, way);
        mean = (nodes[k - 1].normal - nodes[k].normal) / (nodes[k - 1].label - nodes[k].label);
        load = hs_plus(load, mean, hs_plus(held, -1.0, outer));
    }
    outer = edge < from ? hs_plus(deflection_at(nodes + k, edge), 1.0, way) : nowhere;
    mean = (problem->normal[0] - nodes[k].normal) / (edge - nodes[k].label);
    /* of a short way up, loads hardly differ */
    if (nodes[k].label == from && is_straight(part, from, edge)) mean = 0.5 * (problem->edge[0].slope + problem->edge[stage].slope);
    return hs_plus(hs_plus(load, mean, hs_plus(held, -1.0, outer)), problem->edge[stage].slope, outer);
}

/* Energy that the springs of a class dissipate on a step: the work of the tangential load, less what they hold more.
 *
 * If all stuck, the work would be the change of what they hold, which is exact. Of what slip relieves the load by, the share
 * λ = relief/P' is the mean slip: over the way y on which the class touches it goes through 0 and the ends of both stages. */
static double dissipation(const hs_class *part, const hs_plane_target *first, double from, double to, const hs_vector way[2],
                          double *uncertain) {
    const hs_ring_problem *problem = part->problem;
    double deepest = hs_deepest_of(part), begin = hs_most(from, deepest), end = hs_most(to, deepest);
    double span = 1.0, middle = STAGE, once = 0.5, squared = 1.0 / 3.0; /* ∫ y P' dy, ∫ y² P' dy */
    hs_vector relief[2] = {problem->relieved[0], problem->relieved[1]}, bend = nowhere, curved = nowhere;
    if (to != from) {
        const hs_normal *a = problem->edge, *b = problem->edge + 2;
        double width = end - begin;
        span = width / (to - from);
        middle = (first->approach - begin) / width;
        if (!is_straight(part, begin, end)) {
            double mean = (b->integral - a->integral) / width;
            once = (b->load - mean) / width;
            squared = (b->load - 2.0 * (b->integral - (b->twice - a->twice) / width) / width) / width;
        } else {
            once = a->slope / 2.0 + (b->slope - a->slope) / 3.0;
            squared = a->slope / 3.0 + (b->slope - a->slope) / 4.0;
        }
        relief[0] = hs_plus(nowhere, 1.0 / problem->edge[1].slope, relief[0]);
        relief[1] = hs_plus(nowhere, 1.0 / b->slope, relief[1]);
        if (end <= deepest) relief[1] = stuck_deflection(part->nodes + part->count - 1, from, to, way[1]);
    }
    if (middle > 0.01 && middle < 0.99) {
        double share = 1.0 / (middle * (1.0 - middle));
        bend = hs_plus(nowhere, share, hs_plus(relief[0], -middle, relief[1]));
        if (span == 1.0) curved = hs_plus(nowhere, share, hs_plus(way[0], -middle, way[1]));
    }
    *uncertain += fabs(span * hs_dot(way[1], bend) * (once - squared));
    double held = to > deepest ? energy_found(problem) : 0.0;
    double relieved = span * (hs_dot(way[1], relief[1]) * once + hs_dot(way[1], bend) * (once - squared)) +
                      hs_dot(curved, relief[1]) * (once - 2.0 * squared);
    return hs_most(stuck_energy(part, from, to, way[1]) - held - relieved, 0.0);
}

/* Add by how much of the load a class has slid, and by how much more it would have, had it gone on as in the first stage. */
static void add_unevenness(hs_body *body, const hs_class *part) {
    const hs_ring_problem *problem = part->problem;
    int32_t left_out = part->count - problem->rings - 1;
    for (int32_t k = 1; k <= problem->rings; ++k) {
        hs_vector before = problem->slipped[left_out + k], slid = hs_plus(problem->trial[k], -1.0, problem->found[k]);
        body->uneven += problem->mass[k] * hs_length(hs_plus(slid, -1.0, before));
        body->slid_load += problem->mass[k] * hs_length(hs_plus(slid, REST, before));
    }
}

/* One step of SDIRK2, in place: two problems, the second of which begins with what has slipped in the first. */
static int step_to(hs_body *body, const hs_plane_path *path, const hs_plane_target *to) {
    const double from = body->approach;
    hs_plane_target first = hs_target_at(body, path, hs_toward(body->fraction, to->fraction, STAGE));
    hs_vector way[2] = {nowhere, nowhere}, force = nowhere;
    if (make_ready(body, to) != HS_OK) return HS_OUT_OF_MEMORY;
    for (int stage = 1; stage <= 2; ++stage) {
        const hs_plane_target *at = stage == 1 ? &first : to;
        double edge = at->approach;
        for (int64_t c = 0; c < body->classes; ++c) {
            hs_class *part = body->parts + c;
            if (takes_part(body, part, to) && edge > hs_deepest_of(part))
                set_up(part, from, edge, hs_coefficient(body, part->group, at->fraction), body->rings, stage);
        }
        hs_vector guess = stage == 1 ? nowhere : hs_plus(nowhere, 1.0 / STAGE, way[0]);
        way[stage - 1] = way_to(body, edge, guess, &at->aim, &force);
        if (is_stopped(body)) return HS_INTERRUPTED;
        for (int64_t c = 0; c < body->classes; ++c) {
            hs_class *part = body->parts + c;
            hs_ring_problem *problem = part->problem;
            if (!takes_part(body, part, to) || edge <= hs_deepest_of(part)) continue;
            problem->relieved[stage - 1] = relieved_load(part, from, edge, way[stage - 1], stage);
            add_loss(part, stage == 1 ? REST : 1.0);
            int32_t before = part->count - problem->rings - 1;
            for (int32_t k = 1; stage == 1 && k <= problem->rings; ++k)
                problem->slipped[before + k] = hs_plus(problem->trial[k], -1.0, problem->found[k]);
        }
    }
    body->uneven = body->slid_load = body->curved = 0.0;
    for (int64_t c = 0; c < body->classes; ++c) {
        hs_class *part = body->parts + c;
        const hs_ring_problem *problem = part->problem;
        if (!takes_part(body, part, to)) continue;
        part->lost = dissipation(part, &first, from, to->approach, way, &body->curved);
        body->dissipated += part->lost;
        if (to->approach <= hs_deepest_of(part)) {
            part->count = 0;
            continue;
        }
        add_unevenness(body, part);
        if (hs_class_room(part, problem->rings + 1) != HS_OK) return HS_OUT_OF_MEMORY;
        part->count = problem->rings + 1;
        for (int32_t k = 0; k < part->count; ++k)
            part->nodes[k] = node_found(problem, k);
    }
    body->approach = to->approach;
    body->normal_load = to->normal_load;
    body->time = to->time;
    body->fraction = to->fraction;
    body->displacement = hs_plus(body->displacement, 1.0, way[1]);
    if (fixes_x(&to->aim)) body->displacement.x = to->aim.value.x;
    if (fixes_y(&to->aim)) body->displacement.y = to->aim.value.y;
    body->tangential_load = force;
    return HS_OK;
}

/* Step with the place to work in of another body of the same classes. */
static int step_with(hs_body *body, hs_body *owner, const hs_plane_path *path, const hs_plane_target *to) {
    for (int64_t c = 0; c < body->classes; ++c) body->parts[c].problem = owner->parts[c].problem;
    int status = step_to(body, path, to);
    for (int64_t c = 0; c < body->classes; ++c) {
        owner->parts[c].problem = body->parts[c].problem;
        if (body != owner) body->parts[c].problem = NULL;
    }
    return status;
}

/* Error of two half steps next to a whole one: halving leaves a third of the difference. */
static double error_of_halves(const hs_body *body, const hs_body *one, const hs_body *first, const hs_body *two) {
    double limit = hs_most(hs_body_limit(body, body->approach, body->fraction), hs_body_limit(one, one->approach, one->fraction));
    double force = hs_length(hs_plus(one->tangential_load, -1.0, two->tangential_load));
    double way = hs_length(hs_plus(two->displacement, -1.0, body->displacement));
    /* springs slip so far where their limits fall, without any motion */
    if (body->first_friction) way += hs_most(reach_of(body, body->approach) - reach_of(one, body->approach), 0.0);
    double change = one->dissipated - two->dissipated, lost = two->dissipated - body->dissipated;
    double curved = hs_error(first->curved + two->curved, 0.0, MOST_CURVED * hs_most(lost, limit * way * body->tolerance));
    double load = hs_error(force, 0.0, SETTLED_LOAD * body->tolerance * limit);
    double energy = hs_error(change, 0.0, hs_most(SETTLED_LOSS * lost, SETTLED_WORK * limit * way) * body->tolerance);
    return hs_most(curved, hs_most(load, energy));
}

/* Whether a step has slid so evenly that it need not be halved. */
static int is_even(const hs_body *body, const hs_body *one) {
    double limit = hs_body_limit(one, one->approach, one->fraction), most = hs_least(EVEN * limit, EVEN_OF_SLIP * one->slid_load);
    double depth = hs_most(body->approach, one->approach) - body->contact->sorted_gap[0];
    int slides = one->slid_load > 0.0 || one->approach < body->approach;
    if (slides && fabs(one->approach - body->approach) > STEADY * depth) return 0;
    return one->uneven <= hs_most(most, ALWAYS_EVEN * limit) * body->tolerance;
}

/* Note when asperities first slide as a whole on a settled step: the front goes straight. */
static void note_slides(hs_body *body, const hs_body *after) {
    if (isnan(body->time) || isnan(after->time)) return;
    for (int64_t c = 0; c < body->classes; ++c) {
        const hs_class *part = body->parts + c, *then = after->parts + c;
        if (then->count == 0) continue;
        double deepest = hs_deepest_of(part), from = hs_least(hs_class_front(body, part), body->approach);
        double to = hs_least(hs_class_front(after, then), after->approach);
        for (int64_t i = hs_count_touching(part->curve.gap, part->curve.count, after->approach) - 1; i >= 0; --i) {
            double gap = part->curve.gap[i], *time = body->slide_time + part->start + i;
            if (gap < to) break;
            if (!isnan(*time)) continue;
            double way = from - hs_most(to, deepest), share = way > 0.0 ? hs_clamp((from - gap) / way, 1.0) : 0.0;
            *time = hs_toward(body->time, after->time, hs_most(share, 0.0));
            body->slid = 1;
        }
    }
}

/* Be where a step has led, of one half or of two, of which the first one ends at `first`; and spread `scale` times its loss. */
static int commit(hs_body *body, const hs_body *first, const hs_body *last, double scale) {
    double end = body->dissipated + scale * (last->dissipated - body->dissipated);
    spread_losses(body, body, first ? first : last, scale);
    if (first) spread_losses(body, first, last, scale);
    note_slides(body, last);
    int status = assign(body, last);
    body->dissipated = end;
    return status;
}

/* Displacement on a leg on which the approach grows and no spring slips; returns whether it is such a leg.
 *
 * The polyline grows by one segment of slope m = ΔV/Δd, so that Q grows on each ring by m (√(d₁ - a) - √(d₀ - a)), and the
 * limit by μ times the same: nothing slips where |ΔV| ≤ μ Δd, and the loads then grow in proportion, ΔT = m ΔN. */
static int is_stick_leg(const hs_body *body, const hs_plane_target *to, hs_vector *way) {
    const hs_plane_aim *aim = &to->aim;
    double rise = to->approach - body->approach, least = HUGE_VAL;
    if (rise <= 0.0 || body->approach <= body->contact->sorted_gap[0]) return 0;
    int by_load = to->by_loads && aim->rigid.x == 0.0 && aim->rigid.y == 0.0;
    if (!by_load && (to->by_loads || !fixes_x(aim) || !fixes_y(aim))) return 0;
    hs_vector left = left_of(aim, body->displacement, body->tangential_load);
    *way = by_load ? hs_plus(nowhere, rise / (to->normal_load - body->normal_load), left) : left;
    for (int64_t c = 0; c < body->classes; ++c) {
        const hs_class *part = body->parts + c;
        if (to->approach <= hs_deepest_of(part)) continue;
        least = hs_least(least, hs_coefficient(body, part->group, body->fraction));
        /* nodes are joined where springs slip */
        if (part->count > MOST_NODES * body->rings) return 0;
    }
    return hs_length(*way) <= least * rise;
}

/* Append a leg on which no spring slips, which is exact. */
static int append_stick_leg(hs_body *body, const hs_plane_target *to, hs_vector way) {
    const double rise = to->approach - body->approach;
    hs_vector slope = hs_plus(nowhere, 1.0 / rise, way), force = body->tangential_load;
    for (int64_t c = 0; c < body->classes; ++c) {
        hs_class *part = body->parts + c;
        double deepest = hs_deepest_of(part);
        if (to->approach <= deepest) continue;
        if (hs_class_room(part, part->count + 2) != HS_OK) return HS_OUT_OF_MEMORY;
        hs_node edge = hs_node_at(part, to->approach, nowhere), *nodes = part->nodes;
        force = hs_plus(force, edge.normal - (part->count ? nodes[0].normal : 0.0), slope);
        for (int32_t k = 0; k < part->count; ++k) nodes[k].deflection = hs_plus(nodes[k].deflection, 1.0, way);
        if (part->count == 0) nodes[part->count++] = hs_node_at(part, deepest, hs_plus(nowhere, to->approach - deepest, slope));
        memmove(nodes + 1, nodes, (size_t)part->count * sizeof *nodes);
        nodes[0] = edge;
        ++part->count;
    }
    body->approach = to->approach;
    body->normal_load = to->normal_load;
    body->time = to->time;
    body->fraction = to->fraction;
    body->displacement = fixes_x(&to->aim) ? to->aim.value : hs_plus(body->displacement, 1.0, way);
    body->tangential_load = fixes_x(&to->aim) ? force : to->aim.value;
    return HS_OK;
}

/* A segment of a path, integrated in whole steps and halves. */
typedef struct travel {
    hs_body *body;
    const hs_plane_path *path;
    hs_stops *stops;                       /* NULL: none */
    hs_plane_target to[MOST_HALVINGS + 1]; /* ends of nested halves */
    hs_body *whole[MOST_HALVINGS + 1];     /* body at the end of one step to each, NULL if it is not known */
    hs_body *first, *two;                  /* amid the present step and at its end, by two half steps */
    hs_plane_target middle;
    int is_straight; /* whether loads are straight on the segment */
    int sticks;      /* whether the present step is a leg without slip, by `way` */
    hs_vector way;
} travel;

static const hs_adaptive step_settings = {
    0.0, /* the tolerance is the body's */
    1.0, /* accepted at once: `curved` is a second estimate of the energy */
    1, INT_MAX,
    0.0, /* halved at once: the first half step is the whole step of the first half */
    1.0, 1.0 / (1 << MOST_HALVINGS),
    0.0, 0.5, 0.5,
    INT_MAX, 1.0, 1.0, /* halvings bound the number of steps */
};

/* Status of a segment that was left at `until`; it is not returned to users. */
#define REACHED (-2)

static void free_trials(travel *t, int level) {
    hs_body_free(t->whole[level]);
    hs_body_free(t->first);
    hs_body_free(t->two);
    t->whole[level] = t->first = t->two = NULL;
}

/* Try a step: exactly if no spring slips, otherwise as a whole and, unless it slides evenly, in halves. */
static int try_step(hs_integrand *integrand, const hs_interval *step, int chords, double *error) {
    travel *t = (travel *)integrand->context;
    hs_body *body = t->body, **whole = t->whole + step->level;
    const hs_plane_target *to = t->to + step->level;
    int status = HS_OK;
    *error = 0.0;
    if (chords == 1) {
        t->sticks = !*whole && t->is_straight && is_stick_leg(body, to, &t->way);
        if (t->sticks) return HS_OK;
        if (!*whole) {
            *whole = trial_of(body);
            status = *whole ? step_with(*whole, body, t->path, to) : HS_OUT_OF_MEMORY;
        }
        if (status == HS_OK && !is_even(body, *whole)) *error = HUGE_VAL;
        return status;
    }
    t->middle = hs_target_at(body, t->path, 0.5 * (body->fraction + to->fraction));
    t->first = trial_of(body);
    status = t->first ? step_with(t->first, body, t->path, &t->middle) : HS_OUT_OF_MEMORY;
    if (status == HS_OK) t->two = trial_of(t->first);
    if (status == HS_OK) status = t->two ? step_with(t->two, body, t->path, to) : HS_OUT_OF_MEMORY;
    if (status == HS_OK) *error = error_of_halves(body, *whole, t->first, t->two);
    return status;
}

/* Ratio of the energy of the present step to that of its halves, extrapolated as if these were of no error of second order. */
static double energy_scale(const travel *t, const hs_body *whole) {
    if (!t->two) return 1.0;
    double lost = t->two->dissipated - t->body->dissipated, more = (t->two->dissipated - whole->dissipated) / 3.0;
    return lost > 0.0 ? 1.0 + hs_clamp(more / lost, 0.2) : 1.0;
}

/* Advance a body that equals the start of an accepted step to a fraction within it, by a step of the same method from the start
 * or from the middle. So results are continuous up to the end of the step, and do not depend on the fractions that are read. */
static int advance_within(travel *t, const hs_body *whole, double fraction, hs_body *body) {
    if (fraction == body->fraction) return HS_OK;
    hs_plane_target target = hs_target_at(body, t->path, fraction);
    if (t->sticks) {
        hs_vector way;
        is_stick_leg(t->body, &target, &way);
        return append_stick_leg(body, &target, way);
    }
    hs_body *first = t->two && fraction > t->middle.fraction ? t->first : NULL;
    hs_body *last = trial_of(first ? first : t->body);
    double scale = energy_scale(t, whole);
    int status = last ? step_with(last, t->body, t->path, &target) : HS_OUT_OF_MEMORY;
    if (status == HS_OK) status = commit(body, first, last, scale);
    hs_body_free(last);
    return status;
}

/* Visit the stops within an accepted step. */
static int visit_stops(travel *t, const hs_body *whole, double end) {
    hs_stops *stops = t->stops;
    int status = HS_OK;
    while (stops && status == HS_OK && stops->next <= end && stops->next < stops->until) {
        hs_body *there = hs_body_copy(t->body);
        status = there ? advance_within(t, whole, stops->next, there) : HS_OUT_OF_MEMORY;
        if (status == HS_OK) status = stops->visit(stops, there);
        hs_body_free(there);
    }
    if (status != HS_OK || !stops || stops->until > end || stops->until == 1.0) return status;
    status = advance_within(t, whole, stops->until, t->body);
    return status == HS_OK ? REACHED : status;
}

static int accept_step(hs_integrand *integrand, const hs_interval *step) {
    travel *t = (travel *)integrand->context;
    hs_body *body = t->body, *whole = t->whole[step->level];
    const hs_plane_target *to = t->to + step->level;
    int status = visit_stops(t, whole, to->fraction);
    if (status == HS_OK)
        status = t->sticks ? append_stick_leg(body, to, t->way)
                           : commit(body, t->two ? t->first : NULL, t->two ? t->two : whole, energy_scale(t, whole));
    free_trials(t, step->level);
    return status;
}

/* The first half of a step is known already. */
static int halve_step(hs_integrand *integrand, const hs_interval *step) {
    travel *t = (travel *)integrand->context;
    t->to[step->level] = t->middle;
    t->whole[step->level] = t->first;
    t->first = NULL;
    free_trials(t, step->level - 1);
    return HS_OK;
}

static int integrate_segment(hs_body *body, const hs_plane_path *path, double end, int is_straight, hs_stops *stops) {
    travel t;
    memset(&t, 0, sizeof t);
    t.body = body;
    t.path = path;
    t.is_straight = is_straight;
    t.stops = stops;
    t.to[0] = hs_target_at(body, path, end);
    hs_integrand integrand = {&t, &step_settings, try_step, accept_step, halve_step, 0, 0.0};
    int status = hs_adapt(&integrand, 0.0, 1.0);
    for (int level = 0; level <= MOST_HALVINGS; ++level) free_trials(&t, level);
    return status;
}

/* Bring loads to where a path begins, if they are not there: a load that was beyond the limit, which has risen. */
static int begin_path(hs_body *body, const hs_plane_path *path) {
    hs_plane_path at_once = *path;
    const hs_vector t = body->tangential_load, rigid = path->rigid;
    hs_plane_target begin = hs_target_at(body, path, 0.0);
    hs_vector miss = hs_plus(begin.aim.value, -1.0, t);
    if (rigid.x > 0.0) miss.x = 0.0;
    if (rigid.y > 0.0) miss.y = 0.0;
    if (hs_length(miss) <= body->tolerance * hs_body_limit(body, body->approach, 0.0)) return HS_OK;
    at_once.value[0] = HS_MADE(hs_vector){rigid.x > 0.0 ? path->value[0].x : t.x, rigid.y > 0.0 ? path->value[0].y : t.y};
    at_once.value[1] = path->value[0];
    at_once.approach[1] = path->approach[0];
    at_once.normal_load[1] = path->normal_load[0];
    at_once.time[1] = path->time[0];
    const double *friction = body->friction, *first = body->first_friction;
    if (first) body->friction = first;
    body->first_friction = NULL;
    int status = integrate_segment(body, &at_once, 1.0, 0, NULL);
    body->friction = friction;
    body->first_friction = first;
    body->fraction = 0.0;
    return status;
}

int hs_body_travel(hs_body *body, hs_plane_path *path, hs_stops *stops) {
    double touch = body->contact->sorted_gap[0];
    /* loads are 0 in a gap, where the displacement stays: the path begins at the first touch */
    if (path->by_loads && path->approach[0] < touch && path->approach[1] > touch) body->approach = path->approach[0] = touch;
    body->fraction = 0.0;
    hs_begin_segments(body, path);
    int status = path->saturate ? begin_path(body, path) : HS_OK;
    while (status == HS_OK && body->fraction < 1.0) {
        int is_straight;
        double end = hs_next_cut(body, path, &is_straight);
        status = integrate_segment(body, path, end, is_straight, stops);
    }
    return status == REACHED ? HS_OK : status;
}

/* Relative to its limit, a traction that slips. */
#define AT_LIMIT (1.0 - 1e-6)

double hs_class_front(const hs_body *body, const hs_class *part) {
    const hs_node *nodes = part->nodes;
    double friction = hs_coefficient(body, part->group, body->fraction);
    int32_t slips = 0;
    for (int32_t i = 1; i < part->count; slips = i++)
        if (hs_length(hs_ring_traction(nodes, i)) < AT_LIMIT * friction * sqrt(nodes[0].label - nodes[i].label)) break;
    if (part->count == 0 || slips == 0) return HUGE_VAL;
    /* between the last ring that slips and the first that sticks */
    return slips + 1 < part->count ? 0.5 * (nodes[slips].label + nodes[slips + 1].label) : -HUGE_VAL;
}

int hs_body_slopes(hs_body *body, hs_vector direction, double slopes[2][2]) {
    double edge = body->approach, size = hs_length(direction), least = 0.0;
    memset(slopes, 0, 4 * sizeof(double));
    for (int64_t c = 0; c < body->classes; ++c) {
        hs_class *part = body->parts + c;
        if (edge <= hs_deepest_of(part)) continue;
        if (hs_ring_room(part, part->count + 1) != HS_OK) return HS_OUT_OF_MEMORY;
        const double friction = hs_coefficient(body, part->group, body->fraction);
        set_up(part, edge, edge, friction, body->rings, 1);
        least = hs_most(least, friction * (edge - hs_deepest_of(part)));
        if (size > 0.0) continue;
        double label = hs_most(hs_least(hs_class_front(body, part), edge), hs_deepest_of(part));
        slopes[0][0] += hs_load_at(part->curve, label).slope;
        slopes[1][1] = slopes[0][0];
    }
    /* a way so short that fronts stay in their cells */
    if (size > 0.0) forces(body, edge, hs_plus(nowhere, 1e-9 * least / size, direction), slopes);
    return HS_OK;
}
