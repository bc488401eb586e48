/* When asperities first slide as a whole: at the instant at which the last of their springs meets its limit.
 *
 * On a straight path the limit of a spring and its deflection are straight, so that one division tells when they meet. Within
 * a cone that stays as it is the slip front walks inward, and the last spring is the one in the middle. Where the coefficient
 * changes or the polyline is uneven, the instants of springs between two vertices lie between those at the vertices, so that
 * the last one is there or in the middle. Ramps of both loads are straight in (N, T): so they are the same for one group, with
 * loads in place of approach and displacement; of several groups the point of the ramp is searched for. */

#include "internal.h"

/* part of the way to where an asperity is lifted off, from which on it has stuck until then */
#define LIFTED 1e-8
/* asperities of one group of which loads at their gaps are summed up on one path; between more of them they are interpolated */
#define MOST_SUMS 512
/* groups times asperities, of which forces are asked for on one ramp */
#define MOST_FORCES (1 << 22)
#define MOST_TURNS 100

struct hs_slides *hs_slides_held(struct hs_slides *slides) {
    if (slides) __atomic_add_fetch(&slides->references, 1, __ATOMIC_RELAXED);
    return slides;
}

void hs_slides_let_go(struct hs_slides *slides) {
    if (slides && __atomic_sub_fetch(&slides->references, 1, __ATOMIC_ACQ_REL) == 0) free(slides);
}

/* Have times that no other memory shares; NULL where there is no memory for them. */
static struct hs_slides *own_slides(hs_memory *memory) {
    struct hs_slides *shared = memory->slides;
    if (shared && __atomic_load_n(&shared->references, __ATOMIC_ACQUIRE) == 1) return shared;
    size_t count = (size_t)hs_watched(memory->contact);
    struct hs_slides *own = (struct hs_slides *)malloc(sizeof *own + count * (sizeof(double) + 1));
    if (!own) {
        memory->lost_slides = 1;
        return NULL;
    }
    own->references = 1;
    own->number = shared ? shared->number : 0;
    own->has = (uint8_t *)(own->time + count);
    hs_slide_times(memory, own->time);
    for (size_t i = 0; i < count; ++i) own->has[i] = (uint8_t)!isnan(own->time[i]);
    hs_slides_let_go(shared);
    return memory->slides = own;
}

void hs_slide_times(const hs_memory *memory, double *time) {
    int64_t count = hs_watched(memory->contact);
    if (memory->slides) memcpy(time, memory->slides->time, (size_t)count * sizeof *time);
    for (int64_t i = 0; i < count && !memory->slides; ++i) time[i] = NAN;
}

void hs_forget_slides(hs_memory *memory) {
    hs_slides_let_go(memory->slides);
    memory->slides = NULL;
    memory->slid_labels[0] = memory->slid_labels[1] = 0.0;
}

int hs_slides_assign(hs_memory *memory, const double *time) {
    struct hs_slides *own = own_slides(memory);
    if (!own) return HS_OUT_OF_MEMORY;
    own->number = 0;
    for (int64_t i = 0; time && i < hs_watched(memory->contact); ++i) {
        own->time[i] = time[i];
        own->number += own->has[i] = (uint8_t)!isnan(time[i]);
    }
    return HS_OK;
}

int hs_slides_replace(hs_memory *memory, const hs_memory *start, const hs_memory *other) {
    struct hs_slides *own = own_slides(memory);
    if (!own) return HS_OUT_OF_MEMORY;
    for (int64_t i = 0; i < memory->contact->count; ++i)
        if (!hs_has_slid(start, i) && !isnan(own->time[i]) && hs_has_slid(other, i)) own->time[i] = other->slides->time[i];
    return HS_OK;
}

static int note(hs_memory *memory, int64_t asperity, double share) {
    struct hs_slides *slides = own_slides(memory);
    if (!slides) return HS_OUT_OF_MEMORY;
    slides->time[asperity] = hs_toward(memory->clock.begin, memory->clock.end, share);
    slides->has[asperity] = 1;
    ++slides->number;
    return HS_OK;
}

/* A straight path, in approach and displacement or in both loads, with the coefficients at its ends. */
typedef struct line {
    double x[2], y[2];
    double friction[2];
} line;

/* Share of a path at which a spring that touched at (x, y) meets its limit, the end where it does not; where it `leaves` on
 * the path, negative if it sticks until then. */
static double slips_at(const line *on, double x, double y, int leaves) {
    double end = leaves && on->x[0] > on->x[1] ? hs_least((on->x[0] - x) / (on->x[0] - on->x[1]), 1.0) : 1.0;
    double moved = hs_toward(on->y[0], on->y[1], end) - y, side = copysign(1.0, moved);
    double first = on->friction[0] * (on->x[0] - x) - side * (on->y[0] - y);
    double last = on->friction[1] * (on->x[1] - x) - side * (on->y[1] - y);
    double tie = HS_TIE * (fabs(on->y[0]) + fabs(on->y[1]) + fabs(y) + on->friction[0] * (on->x[0] - x));
    double share = first <= tie ? 0.0 : first > last ? hs_least(first / (first - last), end) : end;
    return leaves && (fabs(moved) <= tie || share >= (1.0 - LIFTED) * end) ? -1.0 : share;
}

/* Loads at the gaps of the asperities of a group: interpolated between those of some of them, with their slopes. */
typedef struct loads_at_gaps {
    hs_curve curve;
    const double *gap;
    int64_t count;
    int64_t stride, low; /* one in so many is summed up; the one that was so last, -1 for none */
    hs_load at[2];
} loads_at_gaps;

static double load_at_gap(loads_at_gaps *loads, int64_t i) {
    const double *gap = loads->gap;
    if (loads->stride == 1) return hs_load_at(loads->curve, gap[i]).load;
    int64_t low = i - i % loads->stride, high = low + loads->stride;
    if (high >= loads->count) high = loads->count - 1;
    if (low != loads->low) {
        loads->at[0] = hs_load_at(loads->curve, gap[low]);
        loads->at[1] = hs_load_at(loads->curve, gap[high]);
        loads->low = low;
    }
    double width = gap[high] - gap[low], t = width > 0.0 ? (gap[i] - gap[low]) / width : 0.0, u = 1.0 - t;
    const hs_load *a = loads->at, *b = loads->at + 1;
    return u * u * ((1.0 + 2.0 * t) * a->load + t * width * a->slope) +
           t * t * ((1.0 + 2.0 * u) * b->load - u * width * b->slope);
}

static double anchor_at(const hs_vertex *above, double label) { return above->anchor - above->slope * (above->label - label); }

void hs_find_slides(const hs_group *group, int64_t depth, const hs_point *from, const hs_point *to, double friction, double label,
                    int uneven) {
    hs_memory *memory = group->memory;
    const hs_contact *contact = memory->contact;
    const double *gap = contact->watched ? contact->watch : group->curve.gap;
    const int64_t count = contact->watched ? contact->watched : group->curve.count;
    const hs_vertex *stack = group->stack;
    double top = hs_most(from->d, to->d), low = to->d < from->d ? hs_least(label, to->d) : label;
    double *slid = memory->slid_labels, latest = 0.0;
    int alone = contact->groups == 1, runs = alone && !memory->evolved, all = 1;
    if (low >= top) return;
    int by_load = !isnan(memory->clock.load), in_loads = by_load && alone;
    line path = {{from->d, to->d}, {from->v, to->v}, {friction, group->friction}};
    line ramp = {{memory->normal_load, memory->clock.load}, {memory->tangential_load, memory->clock.force},
                 {friction, group->friction}};
    int64_t i = hs_touching(gap, count, top) - 1, j = depth - 1, lowest = hs_touching(gap, count, low);
    int64_t stride = contact->load ? 1 : 1 + (i - lowest) / MOST_SUMS;
    loads_at_gaps loads = {group->curve, gap, count, stride, -1, {{0.0, 0.0}, {0.0, 0.0}}};
    for (; i >= lowest; --i) {
        double h = gap[i], share;
        int64_t asperity = contact->watched ? i : contact->order[group->start + i];
        if (runs && slid[0] <= h && h < slid[1]) {
            i = hs_touching(gap, count, slid[0]);
            continue;
        }
        if (hs_has_slid(memory, asperity)) continue;
        if (h > from->d) {
            /* new springs slip at once */
            double reached = by_load ? hs_load_at(hs_all_of(contact), h).load : h;
            const double *x = by_load ? ramp.x : path.x;
            share = hs_least(hs_most((reached - x[0]) / (x[1] - x[0]), 0.0), 1.0);
        } else {
            int leaves = h >= to->d;
            for (; j >= 0 && stack[j].label > h; --j)
                if (uneven)
                    latest = hs_most(latest, slips_at(&path, stack[j].label, stack[j].anchor, stack[j].label >= to->d));
            const hs_vertex *above = depth ? stack + (j + 1 < depth ? j + 1 : j) : NULL;
            if (in_loads && above) {
                double x = load_at_gap(&loads, i);
                share = slips_at(&ramp, x, above->tangential - above->slope * (above->normal - x), leaves);
            } else {
                share = slips_at(&path, h, above ? anchor_at(above, h) : from->v, leaves);
            }
            if (uneven && share >= 0.0) share = hs_most(share, latest);
        }
        if (share < 0.0)
            all = 0;
        else if (note(memory, asperity, share) != HS_OK)
            return;
    }
    if (!runs || !all) return;
    int joins = low <= slid[1] && top >= slid[0] && slid[0] < slid[1];
    slid[0] = joins ? hs_least(low, slid[0]) : low;
    slid[1] = joins ? hs_most(top, slid[1]) : top;
}

/* An asperity that slides on a ramp: its innermost spring, and when it meets its limit. */
typedef struct slider {
    int64_t asperity;
    double gap, anchor, friction, side;
    double latest; /* share at which it leaves, or the end */
} slider;

/* A ramp on which asperities slide: forces at its points are asked for with these fronts, and where its normal load stays,
 * with these loads of the groups. */
typedef struct search {
    hs_memory *memory;
    hs_fronts *fronts;
    const hs_group_loads *held;
} search;

/* How far the tangential load at which an asperity slides, when the normal load is that of a share of the ramp, is beyond
 * that of the share. */
static int beyond(const search *on, const slider *one, double share, double *found) {
    hs_memory *memory = on->memory;
    const hs_clock *clock = &memory->clock;
    double load = hs_toward(memory->normal_load, clock->load, share), d = memory->approach;
    if (load != memory->normal_load) d = hs_label_at(hs_all_of(memory->contact), load, d, 0.0, 1.0);
    hs_point at = {d, one->anchor + one->side * one->friction * (d - one->gap)};
    hs_force force = {0.0, 0.0, 0.0};
    int status = on->held ? hs_force_at(memory, on->held, on->fronts, at, &force)
                          : hs_force_on_way(memory, on->fronts, at.d, at.v, &force.force);
    *found = one->side * (force.force - hs_toward(memory->tangential_load, clock->force, share));
    return status;
}

/* Share of a ramp at which an asperity slides: by false position (Illinois), or at once where the normal load stays. */
static int slides_at(const search *on, const slider *one, double *share) {
    hs_bracket root = {0.0, one->latest, 0.0, 0.0, 0};
    int status = beyond(on, one, root.low, &root.at_low);
    if (status == HS_OK && on->held) {
        double rise = one->side * (on->memory->clock.force - on->memory->tangential_load);
        *share = root.at_low <= 0.0 ? 0.0 : rise > root.at_low ? root.at_low / rise : 1.0;
        return status;
    }
    if (status == HS_OK) status = beyond(on, one, root.high, &root.at_high);
    *share = status == HS_OK && root.at_low <= 0.0 ? root.low : root.high;
    if (status != HS_OK || root.at_low <= 0.0 || root.at_high >= 0.0) return status;
    for (int turn = 0; turn < MOST_TURNS && root.high - root.low > DBL_EPSILON && status == HS_OK; ++turn) {
        double next = hs_false_position(&root), here;
        status = beyond(on, one, next, &here);
        if (status == HS_OK) hs_narrow(&root, next, here, !(here > 0.0));
    }
    *share = root.high;
    return status;
}

/* Anchor of the spring of a stack at the gap of an asperity. */
static double innermost_anchor(const hs_vertex *stack, int64_t depth, double h) {
    int64_t j = 0;
    while (j + 1 < depth && stack[j].label < h) ++j;
    return anchor_at(stack + j, h);
}

/* Put down an asperity of a group that slides on the way to a point; returns the share at which it does on a way that is
 * straight in approach and displacement, and is negative where it does not. */
HS_APART static double find_slider(const hs_memory *memory, int64_t index, int64_t i, hs_point to, slider *found) {
    const hs_contact *contact = memory->contact;
    double h = contact->gap[i], friction = memory->friction[index], moved = to.v;
    double anchor = innermost_anchor(memory->vertices + index * memory->capacity, memory->depth[index], h);
    int leaves = h >= to.d;
    line path = {{memory->approach, to.d}, {memory->displacement, to.v}, {friction, friction}};
    slider one = {contact->order[i], h, anchor, friction, 0.0, 1.0};
    if (leaves) {
        double rise = memory->clock.load - memory->normal_load;
        one.latest = hs_least((hs_load_at(hs_all_of(contact), h).load - memory->normal_load) / rise, 1.0);
        moved = hs_toward(path.y[0], path.y[1], (path.x[0] - h) / (path.x[0] - path.x[1]));
    }
    one.side = copysign(1.0, moved - anchor);
    *found = one;
    return slips_at(&path, h, anchor, leaves);
}

/* Note when asperities slide: so many are searched for as is worth it; those in between are interpolated. */
static int note_sliders(const search *on, const slider *sliders, const double *guess, int64_t *place, int64_t count) {
    int64_t most = MOST_FORCES / on->memory->contact->groups, stride = most > 16 ? 1 + count / most : 1 + count / 16;
    int status = hs_sort_by(guess, place, count);
    double low = 0.0, low_guess = 0.0;
    for (int64_t k = 0; k < count && status == HS_OK; k += stride) {
        int64_t last = k + stride <= count ? k + stride - 1 : count - 1;
        double high, high_guess = guess[place[last]];
        status = slides_at(on, sliders + place[last], &high);
        for (int64_t m = k; m <= last && status == HS_OK; ++m) {
            double part = high_guess > low_guess ? (guess[place[m]] - low_guess) / (high_guess - low_guess) : 1.0;
            status = note(on->memory, sliders[place[m]].asperity, m == last ? high : low + part * (high - low));
        }
        low = high;
        low_guess = high_guess;
    }
    return status;
}

/* The group of the next asperity from a position on, of this group or a later one, that may begin to slide on the way to a
 * point; the number of groups where there is none. */
static int64_t next_slider(const hs_memory *memory, hs_point to, int64_t index, int64_t *position) {
    const hs_contact *contact = memory->contact;
    const int64_t groups = contact->groups, *first = contact->first, *depth = memory->depth;
    const double *gap = contact->gap, *friction = memory->friction, d = memory->approach;
    const hs_vertex *stack = memory->vertices + index * memory->capacity;
    int64_t i = *position;
    for (; index < groups && depth[index] > 0; ++index, stack += memory->capacity) {
        for (const int64_t end = first[index + 1]; i < end && gap[i] < d; ++i) {
            double moved = fabs(to.v - (stack->label == gap[i] ? stack->anchor : innermost_anchor(stack, depth[index], gap[i])));
            if (gap[i] < to.d && moved < friction[index] * (to.d - gap[i])) continue;
            if (memory->steep[index] || hs_has_slid(memory, contact->order[i])) continue;
            *position = i;
            return index;
        }
        i = first[index + 1];
    }
    return groups;
}

int hs_note_slides_on_ramp(hs_memory *memory, hs_point to, const hs_group_loads *loads, hs_fronts *fronts) {
    const hs_contact *contact = memory->contact;
    if (!hs_is_timed(memory) || isnan(memory->clock.load) || contact->groups == 1) return HS_OK;
    int64_t i = 0, count = 0, index = next_slider(memory, to, 0, &i);
    if (index == contact->groups) return HS_OK;
    size_t most = (size_t)hs_contact_count(memory);
    slider *sliders = (slider *)malloc(most * (sizeof *sliders + 2 * sizeof(double)));
    if (!sliders) return HS_OUT_OF_MEMORY;
    double *guess = (double *)(sliders + most);
    int64_t *place = (int64_t *)(guess + most);
    for (; index < contact->groups; ++i, index = next_slider(memory, to, index, &i)) {
        place[count] = count;
        guess[count] = find_slider(memory, index, i, to, sliders + count);
        if (guess[count] >= 0.0) ++count;
    }
    hs_fronts own;
    own.memory = NULL;
    search on = {memory, fronts, memory->clock.load == memory->normal_load ? loads : NULL};
    int status = HS_OK;
    if (count > 0 && !on.held && fronts->groups < contact->groups) {
        status = hs_no_fronts(&own, contact->groups);
        on.fronts = &own;
    }
    if (status == HS_OK) status = note_sliders(&on, sliders, guess, place, count);
    hs_free_fronts(&own);
    free(sliders);
    return status;
}
