/* What the files of this library share; nothing of it is seen from outside. */
#ifndef HISTORYSIM_INTERNAL_H
#define HISTORYSIM_INTERNAL_H

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "historysim.h"

#ifdef __cplusplus
#define restrict __restrict
#endif
/* a struct of these values, HS_MADE(hs_load){…}, in the words of C or of C++ */
#ifdef __cplusplus
#define HS_MADE(type) type
#else
#define HS_MADE(type) (type)
#endif

/* two displacements or loads that rounding alone keeps apart; a closed loop is recognised by it */
#define HS_TIE (32.0 * DBL_EPSILON)
/* rounding that a request at the friction limit may carry from its units */
#define HS_LIMIT_SLACK 1e-12
/* A coefficient of friction that is resolved, with which the contact sticks where it would with the one given. */
static inline double hs_usable_friction(double friction) { return friction > HS_MOST_FRICTION ? HS_MOST_FRICTION : friction; }
/* approach over R0, and load in its unit, below which there is no contact that floats could hold */
#define HS_LEAST_APPROACH 1e-150
#define HS_LEAST_LOAD 1e-225
/* sums over asperities go through so many lanes, which are added in a fixed order: the bits are the same everywhere */
#define HS_LANES 8

/* Loops over asperities are vectorised whatever the level of optimisation: gcc's -O2 leaves most of them as they stand. Its
 * attribute may forget options of the command line, so those that keep the bits stand in it again. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__)
#define HS_VECTORISED __attribute__((noinline, optimize("O3", "fp-contract=off", "no-math-errno", "no-trapping-math")))
#else
#define HS_VECTORISED
#endif
/* They are compiled for narrow and for wide processors, and the one that fits is taken: the same bits. Elsewhere than under
 * glibc the choice is not there at load time, and vectors are those of the least processor of the platform. */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GLIBC__)
#define HS_WIDE HS_VECTORISED __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define HS_WIDE HS_VECTORISED
#endif

/* What is called seldom, and shall not take registers where it is called. */
#ifdef __GNUC__
#define HS_APART __attribute__((noinline, cold))
#else
#define HS_APART
#endif

static inline double hs_lanes_sum(const double *lane) {
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}
/* Loops over asperities work on so many items at a time, which are then added to the lanes. */
#define HS_AT_ONCE 256
static inline void hs_add(double *lane, const double *item, int count) {
    int i = 0;
    for (; i + HS_LANES <= count; i += HS_LANES)
        for (int l = 0; l < HS_LANES; ++l) lane[l] += item[i + l];
    for (int l = 0; i + l < count; ++l) lane[l] += item[i + l];
}
static inline int hs_size_of_block(int64_t left) { return left < HS_AT_ONCE ? (int)left : HS_AT_ONCE; }
/* Point a fraction of the way from where a channel is to its target; the target itself at the end. */
static inline double hs_toward(double present, double target, double fraction) {
    return fraction == 1.0 ? target : present + fraction * (target - present);
}

/* A bracket of a root that is narrowed by false position (Illinois): the value of an end that stays twice counts half. */
typedef struct hs_bracket {
    double low, high, at_low, at_high;
    int kept; /* which end was replaced last: 1 the high one, -1 the low one */
} hs_bracket;
static inline double hs_false_position(const hs_bracket *root) {
    double next = root->low + (root->high - root->low) * root->at_low / (root->at_low - root->at_high);
    return root->low < next && next < root->high ? next : 0.5 * (root->low + root->high);
}
static inline void hs_narrow(hs_bracket *root, double place, double value, int replaces_high) {
    double *end = replaces_high ? &root->high : &root->low, *at_end = replaces_high ? &root->at_high : &root->at_low;
    double *at_other = replaces_high ? &root->at_low : &root->at_high;
    *end = place;
    *at_end = value;
    if (root->kept == (replaces_high ? 1 : -1)) *at_other *= 0.5;
    root->kept = replaces_high ? 1 : -1;
}

/* ---- normal.c: the load P(a) of asperities, and the approach at a load ---- */

static inline double hs_least(double a, double b) { return b < a ? b : a; }
static inline double hs_most(double a, double b) { return b > a ? b : a; }
/* Bounded on both sides. */
static inline double hs_within(double value, double bound) { return hs_least(hs_most(value, -bound), bound); }

typedef struct hs_load {
    double load;
    double slope; /* dP/da */
} hs_load;

/* Asperities in ascending gap, or knots, which have loads. */
typedef struct hs_curve {
    const double *gap;
    const double *weight;
    const double *load;
    int64_t count;
} hs_curve;

int64_t hs_touching(const double *gap, int64_t count, double approach);
/* P'' between a knot and the next one, which are not at one place; 0 beyond the last one. */
static inline double hs_bend_at(hs_curve curve, int64_t i) {
    return i + 1 < curve.count ? (curve.weight[i + 1] - curve.weight[i]) / (curve.gap[i + 1] - curve.gap[i]) : 0.0;
}
hs_load hs_load_between_knots(hs_curve curve, double approach);
hs_load hs_sum_of_loads(const double *gap, const double *weight, int64_t touching, double approach);
double hs_label_at(hs_curve curve, double total, double guess, double rigid, double compliance);
double hs_cube_root(double x);

static inline hs_load hs_load_of_one(double gap, double weight, double approach) {
    double depth = hs_most(approach - gap, 0.0), half_chord = weight * sqrt(depth);
    return HS_MADE(hs_load){half_chord * depth, 1.5 * half_chord};
}
/* P(a) and P'(a). */
static inline hs_load hs_load_at(hs_curve curve, double approach) {
    if (curve.load) return hs_load_between_knots(curve, approach);
    if (curve.count == 1) return hs_load_of_one(curve.gap[0], curve.weight[0], approach);
    return hs_sum_of_loads(curve.gap, curve.weight, hs_touching(curve.gap, curve.count, approach), approach);
}
/* P(a) with its slope and its integrals over a. */
typedef struct hs_normal {
    double load, slope;
    double integral; /* ∫P da */
    double twice;    /* ∫∫P da da */
} hs_normal;
hs_normal hs_normal_at(hs_curve curve, double approach);
static inline hs_curve hs_all_of(const hs_contact *contact) {
    return HS_MADE(hs_curve){contact->sorted_gap, contact->sorted_weight, contact->load, contact->count};
}

/* ---- groups ---- */

/* One friction group: its summits, what they have dissipated, and its vertices. */
typedef struct hs_group {
    hs_curve curve;
    double *each;
    hs_vertex *stack;
    double friction;
    int64_t start;     /* position of its first asperity */
    hs_memory *memory;
    hs_memory *single; /* the memory where there is no other group, which notes what it knows; otherwise NULL */
} hs_group;

static inline hs_group hs_group_of(const hs_memory *memory, int64_t index) {
    const hs_contact *contact = memory->contact;
    int64_t start = contact->first[index];
    return HS_MADE(hs_group){{contact->gap + start, contact->weight + start, contact->load, contact->first[index + 1] - start},
                      memory->each + start, memory->vertices + index * memory->capacity, memory->friction[index], start,
                      (hs_memory *)memory, contact->groups == 1 ? (hs_memory *)memory : NULL};
}
/* ---- paths in (d, V) ---- */

/* Approach and displacement, dimensionless. */
typedef struct hs_point {
    double d;
    double v;
} hs_point;
/* Where the tangential channel goes: rigid·V + compliance·T = value. A displacement has (1, 0), a load (0, 1), the
 * displacement of a drive behind a spring (1, c). */
typedef struct hs_target {
    double value;
    double rigid;
    double compliance;
} hs_target;

static inline hs_target hs_to_displacement(double value) {
    return HS_MADE(hs_target){value, 1.0, 0.0};
}
static inline hs_target hs_to_load(double value) {
    return HS_MADE(hs_target){value, 0.0, 1.0};
}

/* ---- contact.c, memory.c ---- */

/* Sort positions by a key, equals in the order in which they come. */
int hs_sort_by(const double *key, int64_t *place, int64_t count);
/* Make a contact with the units of another; gaps and weights are in the caller's numbering, of asperities or of knots. */
hs_contact *hs_contact_of(int64_t count, int64_t groups, const double *gap, const double *weight, const int64_t *group,
                          int knots, const hs_units *units, double datum);
hs_contact *hs_contact_held(hs_contact *contact);
void hs_contact_assign(hs_contact *contact, const hs_contact *from);
hs_contact *hs_contact_copy(const hs_contact *contact);
int hs_contact_alike(const hs_contact *one, const hs_contact *other);

/* How asperities of a memory evolve: not, 1, or 2 where they may yield; and arrays of numbers that this takes. */
static inline int hs_evolves(const hs_memory *memory) {
    return !memory->evolved ? 0 : memory->evolved->virgin_height ? 2 : 1;
}
static inline size_t hs_evolved_arrays(int yields) { return yields ? 11 : 6; }
/* Sum up what yielding has taken. */
void hs_sum_yielded(hs_evolved *evolved, int64_t count);
/* A memory with its arrays, of which nothing is filled in. */
hs_memory *hs_memory_blank(hs_contact *contact, int64_t capacity, int evolves);
/* Have stacks hold so many vertices each. */
int hs_memory_reserve(hs_memory *memory, int64_t capacity);
/* Copy all from a memory of the same contact and groups. */
int hs_memory_assign(hs_memory *memory, const hs_memory *from);
/* Put another memory in the place of this one; the other is no longer there. */
void hs_memory_swap(hs_memory *one, hs_memory *other);
void hs_memory_take(hs_memory *memory, hs_memory *other);
/* Whether a memory can evolve so: it is followed, and arrays are of its asperities. */
int hs_can_evolve(const hs_memory *memory, const hs_evolution *evolution);
/* Recompute the loads kept with the vertices. */
void hs_refresh_loads(hs_memory *memory);
/* Have a group remember nothing: where it touches, no spring is strained. */
void hs_touch_unstrained(hs_memory *memory, int64_t index);
int hs_part_ways(hs_memory *memory, const double *first_key, const double *second_key);
int hs_reshape(hs_memory *memory, const double *gap, const double *weight, const uint8_t *fresh);
/* Whether no spring is strained. */
int hs_unstrained(const hs_memory *memory);
/* Whether all springs slide one way, as far as each group remembers. */
int hs_slides_alike(const hs_memory *memory);
int hs_join_groups(hs_memory *memory, const double *gap, const double *weight, double approach, int unstrained);
/* Vertices of the deepest stack. */
int64_t hs_deepest(const hs_memory *memory);
int hs_any_steep(const hs_memory *memory);
double hs_total_force(const hs_memory *memory);

/* ---- slides.c: when asperities first slide as a whole ---- */

/* Times by asperity, in the caller's numbering, NaN for those that have not slid; copies of a memory share them. */
struct hs_slides {
    int64_t references;
    double time[1];
};
struct hs_slides *hs_slides_held(struct hs_slides *slides);
void hs_slides_let_go(struct hs_slides *slides);
/* How many times there are. */
static inline int64_t hs_watched(const hs_contact *contact) { return contact->watched ? contact->watched : contact->count; }
/* Give a memory times of its own that have been read, or a place for them where there are none; returns a status. */
int hs_slides_assign(hs_memory *memory, const double *time);
/* Of asperities that have slid since a start, take the times from another memory that knows them; returns a status. */
int hs_slides_replace(hs_memory *memory, const hs_memory *start, const hs_memory *other);

static inline int hs_has_slid(const hs_memory *memory, int64_t asperity) {
    return memory->slides && !isnan(memory->slides->time[asperity]);
}
/* Let the clock go on to a time, on a path that is straight in approach and displacement. */
static inline void hs_tick(hs_memory *memory, double time) {
    memory->clock = HS_MADE(hs_clock){memory->clock.end, isnan(memory->clock.end) ? memory->clock.end : time, NAN, NAN};
}
/* Set the clock to a time, from which on paths are timed; NaN where they are not. */
static inline void hs_set_clock(hs_memory *memory, double time) {
    memory->clock = HS_MADE(hs_clock){time, time, NAN, NAN};
}
static inline int hs_is_timed(const hs_memory *memory) { return !isnan(memory->clock.end); }
/* Note which asperities of a group first slide on a straight path, on which its coefficient goes straight from `friction` to its
 * own: those whose springs all slip at the end, which are those from a label on, and those that are lifted off. The stack is
 * the one before the path. Where it is `uneven`, springs may reach the limit in any order. */
void hs_find_slides(const hs_group *group, int64_t depth, const hs_point *from, const hs_point *to, double friction, double label,
                    int uneven);
static inline void hs_note_slides(const hs_group *group, int64_t depth, const hs_point *from, const hs_point *to,
                                  double friction, double label, int uneven) {
    const hs_memory *memory = group->memory;
    const hs_contact *contact = memory->contact;
    const int64_t last = group->curve.count - 1;
    const double top = hs_most(from->d, to->d), low = to->d < from->d ? hs_least(label, to->d) : label;
    if (!hs_is_timed(memory) || (low >= memory->slid_labels[0] && top <= memory->slid_labels[1])) return;
    if (!contact->watched && (group->curve.gap[last] < low || (last == 0 && hs_has_slid(memory, contact->order[group->start]))))
        return;
    hs_find_slides(group, depth, from, to, friction, label, uneven);
}

/* ---- losses.c: energies ---- */

/* What springs between two labels slip, and their mean deflection while they do; both are linear in the label. */
typedef struct hs_slip {
    double low, high;
    double slip_low, slip_high;
    double drag_low, drag_high;
} hs_slip;

/* What was lost on a path. Pieces of asperities that are groups of their own wait until there are many, for each is a
 * chain of roots and quotients that wait for one another: several at a time take no longer than one. */
#define HS_MOST_PIECES 128
typedef struct hs_losses {
    int waits; /* whether pieces are put off */
    int number;
    int64_t whose[HS_MOST_PIECES];
    double gap[HS_MOST_PIECES], weight[HS_MOST_PIECES];
    double low[HS_MOST_PIECES], high[HS_MOST_PIECES];
    double slip_low[HS_MOST_PIECES], slip_high[HS_MOST_PIECES];
    double drag_low[HS_MOST_PIECES], drag_high[HS_MOST_PIECES];
    double energy[HS_MOST_PIECES];
    double total; /* of what was not put off */
} hs_losses;

/* ∫ slip·drag·N'' da over labels: added to each asperity unless that is NULL; returns the sum. */
double hs_spread(hs_curve curve, double *each, const hs_slip *slip);
void hs_no_losses(hs_losses *losses, int64_t groups);
/* Add what waits to the array of all asperities. */
void hs_work_out(hs_losses *losses, double *each);
/* Put off what an asperity loses, which stands at a position of the array of all. */
static inline void hs_put_off(hs_losses *losses, double gap, double weight, int64_t position, double *each,
                              const hs_slip *slip) {
    if (!(slip->low < slip->high && slip->high > gap)) return;
    if (losses->number == HS_MOST_PIECES) hs_work_out(losses, each);
    int p = losses->number++;
    losses->whose[p] = position;
    losses->gap[p] = gap;
    losses->weight[p] = weight;
    losses->low[p] = slip->low;
    losses->high[p] = slip->high;
    losses->slip_low[p] = slip->slip_low;
    losses->slip_high[p] = slip->slip_high;
    losses->drag_low[p] = slip->drag_low;
    losses->drag_high[p] = slip->drag_high;
}
/* Spread over a group what it loses. */
void hs_lose(const hs_group *group, hs_losses *losses, const hs_slip *slip);
/* Add all of it to what the asperities, and all together, have dissipated. */
void hs_settle(hs_losses *losses, hs_memory *memory);
/* Of springs that leave contact between the approaches of a straight path, down to a segment. */
void hs_lose_withdrawn(const hs_group *group, hs_losses *losses, int64_t depth, int64_t segment, const hs_point *from,
                       const hs_point *to);
/* Of a memory: ½ ∫ v² N'' da, added per asperity (position) to `each` unless that is NULL. */
double hs_stored(const hs_memory *memory, double *each);

/* ---- polyline.c: one group on one straight path ---- */

/* Where a polyline ends at an approach before any slip: its last segment, and what stands there. */
typedef struct hs_edge {
    int64_t segment;
    double label, anchor, normal, tangential;
} hs_edge;

hs_edge hs_edge_at(const hs_vertex *stack, int64_t depth, double d, double load);
/* Carry a group that touches at the end, where it carries `load`, straight to approach `d` and to where it aims. Its
 * stack has `depth` vertices, or none at `from` where that is 0. Returns the depth, and the displacement reached. */
int64_t hs_move_group(const hs_group *group, hs_losses *losses, int64_t depth, const hs_point *from, double d, double load,
                      hs_target target, double *reached);

int hs_is_steep(const hs_vertex *stack, int64_t depth, double friction);
/* Vertices that a clipped polyline of a depth may have. */
static inline int64_t hs_room_to_clip(int64_t depth) { return 3 * depth + 6; }
/* The straight way on which springs are clipped: what they were moved by, and how the limit of spring a grew, by
 * rise + gain·(d - a); the coefficient at its end. */
typedef struct hs_cone {
    double friction;
    double moved;
    double rise;
    double gain;
} hs_cone;
/* Carry a touching group straight and clip it to a cone; `scratch` has room for twice `hs_room_to_clip`. Without `losses`
 * nothing is lost. Returns the depth of what then stands in `scratch`; adds to its stiffness dT/dV unless that is NULL. */
int64_t hs_carry_and_clip(const hs_group *group, hs_losses *losses, int64_t depth, hs_point from, hs_point to,
                          double load, const hs_cone *cone, hs_vertex *scratch, double *stiffness);

/* ---- search.c: the displacement that all groups share ---- */

/* Slip fronts that were found before. While the front of a group stays on one segment of its polyline, it is straight in
 * the end (d, V) of the path: between label a_j, where the anchor is w_j, and the next vertex the slope is m, on the side
 * s of slip it is sμ, so that
 *
 *     a = a_j + ((V - w_j) - sμ (d - a_j)) / (m - sμ),    T = T_j - m P(a_j) + sμ P(d) + (m - sμ) P(a)
 *
 * which also holds while the whole group slides, where a is below its gap and P(a) is 0. For groups of one asperity P is
 * known at once, and several groups are summed at a time, without a walk along each polyline. One array a quantity. */
typedef struct hs_fronts {
    int64_t groups;
    double *memory; /* that all arrays stand in */
    double *cone;   /* sμ */
    double *below, *anchor; /* label and anchor of the vertex below the front */
    double *jump, *rate;    /* m - sμ, and its reciprocal */
    double *force;          /* tangential load less m P of that vertex */
    double *low, *high;     /* labels between which this holds */
    double *gap, *weight;   /* of the one asperity */
    double *off;            /* whether the front was found to be off the segment */
} hs_fronts;

/* what stands for 1/0 where several groups at a time leave no room for cases */
#define HS_STEEPEST 1e100
int hs_no_fronts(hs_fronts *fronts, int64_t groups);
void hs_free_fronts(hs_fronts *fronts);

/* Tangential load at the end of a path, with its first and second derivative in V. */
typedef struct hs_force {
    double force, stiffness, curvature;
} hs_force;

/* Normal loads of the groups that touch at an approach, which are the first ones. */
typedef struct hs_group_loads {
    int64_t count;
    double *load;
    const double *from; /* where their ways begin; NULL where that is the approach */
    double one[1];      /* place for the load of a single group */
} hs_group_loads;

/* Note the first segment on which slip of a sign may end, which for small paths it does: the outermost, or, where that lies
 * on the cone of this side already, the one below. */
void hs_guess_front(hs_fronts *fronts, int64_t index, const hs_group *group, int64_t depth, double sign);
/* Tangential load that `hs_move_group` would reach; nothing is changed. A slip front that can be is noted instead, and gives
 * the force from then on. */
hs_force hs_force_of_group(const hs_group *group, int64_t depth, hs_point from, hs_point to, double load,
                           hs_fronts *fronts, int64_t index);
int hs_force_at(hs_memory *memory, const hs_group_loads *loads, hs_fronts *fronts, hs_point to, hs_force *found);
/* Tangential load on a straight path at a point of it. */
int hs_force_on_way(hs_memory *memory, hs_fronts *fronts, double d, double v, double *force);
int hs_displacement_at(hs_memory *memory, double d, double load, hs_target target, double *found);
int hs_displacement_with(hs_memory *memory, const hs_group_loads *loads, hs_fronts *fronts, double d, hs_target target, double *found);
int hs_found_displacement(hs_memory *memory, const hs_group_loads *loads, hs_fronts *fronts, double d, hs_target target, double *found);

/* ---- groups.c: what all groups carry together ---- */

int hs_loads_of_groups(const hs_memory *memory, double d, double load, hs_group_loads *loads);
void hs_free_group_loads(hs_group_loads *loads);
/* Friction limit at an approach, and the slopes in the approach of the limit and of the normal load. */
typedef struct hs_limit {
    double limit, limit_slope, load_slope;
} hs_limit;
hs_limit hs_limit_and_slopes(const hs_memory *memory, double d);
/* Σ μ P(a), where the contact carries a normal load. */
double hs_friction_limit(const hs_memory *memory, double d, double load);
/* The least and the largest coefficient of the groups that touch at an approach, which may be HUGE_VAL. */
typedef struct hs_range {
    double least, most;
} hs_range;
hs_range hs_frictions_at(const hs_memory *memory, double d);
/* Approach at which all carry a normal load; the very bits of a label met before where they tie. */
double hs_approach_for(const hs_memory *memory, double load);

/* ---- move.c: all groups on one straight path ---- */

int hs_move(hs_memory *memory, double d, double load, hs_target target);
/* Note which asperities of several groups first slide on the way to a point where both loads go straight, as the clock says;
 * with the loads of the groups and the fronts there. */
int hs_note_slides_on_ramp(hs_memory *memory, hs_point to, const hs_group_loads *loads, hs_fronts *fronts);
/* The same as `hs_move` where the loads of the groups at d, and the target of the path in (d, V), are known. */
int hs_carry(hs_memory *memory, const hs_group_loads *loads, double d, double load, hs_target target, hs_target path);
/* Tell of each group whether its polyline is steeper than μ. */
void hs_note_steep(hs_memory *memory);
/* Which springs slide: the side of the cone on which those of segment j do, 1 or -1; 0 where they stick. */
double hs_sliding_side(const hs_vertex *stack, int64_t depth, int64_t j, double displacement, double friction);
/* Whether there is one group, which any target moves by one update. */
int hs_is_alone(const hs_memory *memory);
/* Carry one group straight, to where it aims, with its coefficient going straight from `friction` to that of `group`, too.
 * `scratch` has room for twice `hs_room_to_clip`. */
int hs_carry_group(hs_memory *memory, const hs_group *group, hs_losses *losses, int64_t index, double friction, hs_point from,
                   hs_point to, double load, hs_target target, hs_vertex *scratch, double *reached);
int hs_make_room(hs_memory *memory);

/* ---- ramp.c, limit.c, walk.c ---- */

/* Count work, a unit of which takes about a microsecond, and ask at times whether the caller wants no more of it. */
static inline int hs_goes_on(const hs_drive *drive, int64_t *work, int64_t more) {
    *work += more;
    if (*work < 4096 || !drive->interrupted) return HS_OK;
    *work = 0;
    return drive->interrupted(drive->user) ? HS_INTERRUPTED : HS_OK;
}

/* Carry a memory along a straight ramp of both loads, which ends at a time. */
int hs_ramp(hs_memory *memory, double load, double force, double time, const hs_drive *drive);

/* What is asked of the contact along one path: both channels at its ends. Where `both` are loads the normal load is
 * straight in the share, otherwise the approach is. Forces are those asked for, whether friction holds them or not. */
typedef struct hs_request {
    int both_loads;
    double d[2];
    double load[2];
    double force[2];
} hs_request;
/* Pieces that a request is cut into where it meets the friction limit: where each ends, and which limit it follows. */
#define HS_MOST_PIECES_OF_REQUEST 64
typedef struct hs_pieces {
    int count;
    double end[HS_MOST_PIECES_OF_REQUEST];
    int side[HS_MOST_PIECES_OF_REQUEST];
} hs_pieces;
/* Cut a request where it meets the limit; there are no pieces where it does not. */
int hs_cut_at_limit(const hs_memory *memory, const hs_request *request, int saturate, hs_pieces *pieces,
                    hs_refusal *refusal);
int hs_follow(hs_memory *memory, const hs_request *request, const hs_pieces *pieces, double before, double share,
              const double *times, const hs_drive *drive, int *side);

/* A path that is planned: what it asks for, and how it goes there. */
typedef struct hs_plan {
    hs_request request;
    hs_target target;
    hs_pieces pieces; /* none where no load meets the friction limit on the way */
    double times[2]; /* at which it begins and ends [s] */
    double v[2];    /* displacements in between are straight from the first to the second */
    int ends_separated; /* whether a tangential load ends where nothing touches */
} hs_plan;
hs_path hs_without_dimension(const hs_units *units, const hs_path *path);
/* Where a path goes: approach, normal load, and the target of the tangential channel, which now asks for a request. */
void hs_destination(const hs_memory *memory, const hs_path *path, double compliance, double request, double *d,
                    double *load, hs_target *target);
/* Targets of `path` are dimensionless here, and so is the compliance. `direct` where nothing is recorded on the way. */
int hs_planned(hs_memory *memory, const hs_path *path, double compliance, int saturate, int direct, hs_plan *plan,
               hs_refusal *refusal);
int hs_walk_on(hs_memory *memory, const hs_plan *plan, double before, double share, const hs_drive *drive);

/* ---- laws.c ---- */

/* Mean of k δ^(3/2) while δ goes straight from the first to the last. */
double hs_mean_load(double first, double last, double weight);
/* Have a summit lose what has waited and a volume, after that which has shaped it, while a² goes straight from the first to
 * the last [m²]; its radius is `meanwhile` on the way. Returns what it takes. */
double hs_worn_summit(const hs_wear *wear, double first, double last, double meanwhile, double shaped, double waiting,
                      double volume, double *height, double *radius);

/* ---- yielding.c ---- */

/* Approach up to which no asperity yields, or yields on; and one of them (in the caller's numbering). */
double hs_next_yield(const hs_memory *memory, const hs_yielding *law);
/* Approach at which all carry a normal load that lets some of them yield on the way. */
int hs_yielding_approach(const hs_memory *memory, const hs_evolution *evolution, double load, double *approach);
double hs_yields_at(const hs_memory *memory, const hs_yielding *law, int64_t asperity);
/* Load of all at an approach, which some of them may yield on the way to. */
int hs_yielding_load(const hs_memory *memory, const hs_evolution *evolution, double d, double *load);
/* Tell which asperities (in the caller's numbering) yield on the way to an approach; and have them become what they are
 * there, but for the contact and what is remembered. */
int hs_those_to_yield(const hs_memory *memory, const hs_evolution *evolution, double d, uint8_t *which);
int hs_yield_to(hs_memory *memory, const hs_evolution *evolution, double d, uint8_t *changed);

/* ---- readout.c ---- */

static inline int8_t hs_slip_state_of(int touches, int slides, int sticks_inside) {
    int slip = sticks_inside ? HS_PARTIAL_SLIP : HS_GROSS_SLIP;
    slip = slides ? slip : HS_FULL_STICK;
    return (int8_t)(touches ? slip : HS_SEPARATED);
}

/* Which springs of a group slide: labels where the slip annulus at the edge ends, which is the edge where it sticks, and of
 * the outermost spring that slides, minus infinity where nothing does; and what the edge says. */
typedef struct hs_zone {
    double boundary, outermost;
    double friction, slope;
} hs_zone;

/* Rows that are written, and what it takes to write them. */
typedef struct hs_recorder {
    const hs_rows *rows;
    hs_contact *contact; /* whose order the columns are known in; NULL where that has changed */
    int64_t *place;      /* (column) position of each recorded asperity */
    int64_t *group;      /* (column) */
    double *gap;         /* (column) */
    double *weight;      /* (column) */
    double *load;        /* (column) dimensionless normal loads */
    double *inner;       /* (count) shares of tangential loads that inner vertices have */
    double *kept;        /* (count) of the `summed` deepest of them, which stay from row to row of a single group */
    hs_vertex *stack;    /* (depth) as it was at the row before */
    int64_t depth, summed;
    hs_zone *zones;      /* (group) of this row, room for as many as asperities; NULL where there are no columns */
} hs_recorder;
int hs_begin_recording(hs_recorder *recorder, hs_contact *contact, const hs_rows *rows);
int hs_record(hs_recorder *recorder, const hs_memory *memory, int64_t row, int saturated);
void hs_end_recording(hs_recorder *recorder);

#endif
