/* Asperities that evolve along a path: friction that depends on the load or on the distance slid, wear, and yielding.
 *
 * What evolves is followed in chords: on each, approach, displacement, friction and shapes go straight to where they
 * are at its end, which is one exact update of each polyline. There are twice as many of them each time, until state,
 * energy, distances and shapes settle. A path on which nothing evolves is walked as ever, exactly.
 *
 * Each chord is of second order in its length:
 *  - What an asperity slides is told by when the last of its springs begins to slip, on the straight way.
 *  - The volume that it loses goes with the load from there on. From the shape that follows comes a better end of the
 *    chord, from that a better volume: twice. The chord is walked with the mean of both shapes, and ends with the last.
 *  - Where friction depends on the own load, an asperity that touches or leaves, or whose approach changes much, has
 *    stations in the chord, graded towards touch: μ goes with 1/N there, or N^(-1/3).
 *
 * A summit that yields while tractions stand in it, of radius R before a chord and R' at its end, keeps them at their
 * radii √(R b): its springs get the labels b R/R' under the new summit, and keep their deflections, and so the loads and
 * the energy that they hold. With R'/R steeper, μ R'/R is their cone at the start of the chord, and μ at its end: from
 * there on a summit that yields is one whose friction falls. The limit of no spring falls meanwhile, since the approach
 * grows. Where nothing is strained and the contact is not moved, a path is one chord. */

#include "internal.h"

/* to begin with, of paths on which the approach changes little, and of others */
#define FEWEST_CHORDS 1
#define FEW_CHORDS 4
#define LITTLE 0.1
#define MOST_CHORDS (1 << 12)
/* tolerances over that of ramps of both loads: of loads and displacements; and of what is dissipated, slid and worn,
 * and of changes of shape, as a part of itself */
#define COARSER 100.0
#define COARSEST 1000.0
/* slid distance over what the contact is moved */
#define NEGLIGIBLE 1e-3
/* agreement by chance is not that much closer than asked for */
#define CLOSE 0.5
/* approach of one station over that of the next, which are farther apart close to touch; a change of it that needs
 * none; and stations that a chord may have */
#define GRADE 1.41421356
#define SLIGHT 1.03
#define MOST_STATIONS 16
/* stands for a coefficient that a law is asked for */
#define ASKED (-1.0)

/* Where the channels are at the ends of one path, dimensionless. */
typedef struct route {
    int both, by_load, by_force;
    int ends_apart; /* whether a tangential load of 0 ends where nothing touches */
    double d[2], load[2], tangential[2];
    double apart[2]; /* then displacements are straight from the first to the second */
    hs_contact *first; /* contact at its start, where what a normal load is on the way follows from it */
} route;

/* Where the friction of a group is at a share of a chord. */
typedef struct station {
    double share;
    double amid; /* between the station before and this one */
    double friction;
} station;

/* A walk: what makes asperities evolve, and buffers, which are as many as asperities (in the caller's numbering unless
 * they say otherwise), or as groups. */
typedef struct walk {
    const hs_evolution *evolution;
    const hs_drive *drive;
    int wears, yields, yields_now; /* the last on this chord */
    int parted; /* whether groups may have come to remember the same again */
    int alone; /* whether asperities yield and nothing else of them is followed */
    double onset; /* share of the path at which the first of them yields */
    double next;  /* approach at which one does, not a number where it is not known */
    double compliance;
    route course;
    double *goal[2];                   /* friction at both ends of the path */
    double *slid, *ahead, *begun;      /* distances on a chord, as they were foreseen, and before any wear [m] */
    double *first, *last;              /* approaches at which an asperity begins and ends to slide [m] */
    double *mean_load, *energy;        /* meanwhile [N], and what it dissipates [J] */
    double *lost, *taken;              /* volumes, and what of them shapes the summit [m³] */
    double *gap;                       /* at the start of a chord */
    double *mid_height, *mid_radius;   /* summits amid and at the end [m] */
    double *end_height, *end_radius;
    double *before, *nowhere;          /* dissipated at the start of a chord, and on ways that are only tried */
    double *from, *steeper;            /* approach at which the edge of a summit that yields starts a chord, and R'/R */
    uint8_t *changed;                  /* which yield */
    int64_t *place;                    /* positions by ascending gap */
    int64_t *depth;                    /* of the stack of a group, at its first asperity */
    station *stations;                 /* of all groups */
    int64_t most;                      /* of them that there is room for */
    int64_t *first_station;            /* (group + 1) */
    double *load, *friction;           /* (group) at the end of a chord */
    double *asked[4];                  /* loads, radii, distances, coefficients that a law is asked for */
    uint8_t *steep;                    /* (group) */
    int64_t room, kept_room;           /* vertices in `scratch` and `kept` */
    hs_vertex *scratch, *kept;
    void *memory;
} walk;

/* Buffers for memories of so many asperities and groups, which are more where asperities yield. */
static int make_buffers(walk *w, const hs_contact *contact) {
    size_t n = (size_t)contact->count, g = (size_t)(w->yields ? contact->count : contact->groups);
    double **each[] = {&w->goal[0],   &w->goal[1], &w->slid,       &w->ahead,      &w->first,      &w->last,
                       &w->mean_load, &w->energy,  &w->lost,       &w->taken,      &w->gap,        &w->before,
                       &w->mid_height, &w->mid_radius, &w->end_height, &w->end_radius,
                       &w->nowhere,    &w->begun,      &w->from,       &w->steeper,    (double **)&w->depth,
                       (double **)&w->place};
    size_t arrays = sizeof each / sizeof *each;
    double *numbers = (double *)malloc((arrays * n + 4 * g + 1) * sizeof *numbers + n);
    w->memory = numbers;
    w->scratch = w->kept = NULL;
    w->stations = NULL;
    w->room = w->kept_room = w->most = 0;
    if (!numbers) return HS_OUT_OF_MEMORY;
    for (size_t k = 0; k < arrays; ++k, numbers += n) *each[k] = numbers;
    w->load = numbers;
    w->friction = w->load + g;
    w->first_station = (int64_t *)(w->friction + g);
    w->steep = (uint8_t *)(w->first_station + g + 1);
    w->changed = w->steep + g * sizeof(double);
    return HS_OK;
}

static void free_buffers(walk *w) {
    free(w->memory);
    free(w->stations);
    free(w->scratch);
    free(w->kept);
}

/* Have room for so many stations more. */
static int make_stations(walk *w, int64_t count) {
    if (count <= w->most) return HS_OK;
    size_t most = 2 * (size_t)count;
    station *grown = (station *)malloc(most * (sizeof *grown + 8 * sizeof(double)));
    if (!grown) return HS_OUT_OF_MEMORY;
    double *asked[4];
    for (size_t k = 0; k < 4; ++k) asked[k] = (double *)(grown + most) + 2 * k * most;
    if (w->most) memcpy(grown, w->stations, (size_t)w->most * sizeof *grown);
    for (size_t k = 0; k < 4 && w->most; ++k) memcpy(asked[k], w->asked[k], 2 * (size_t)w->most * sizeof(double));
    free(w->stations);
    w->stations = grown;
    w->most = (int64_t)most;
    memcpy(w->asked, asked, sizeof asked);
    return HS_OK;
}

/* ---- shapes ------------------------------------------------------------------------------------------------------ */

static void turn(uint64_t *low, uint64_t *high) {
    for (; low < high; ++low, --high) {
        uint64_t kept = *low;
        *low = *high;
        *high = kept;
    }
}

/* Have two runs of numbers change places that stand beside one another. */
static void exchange(void *numbers, int64_t first, int64_t second, int64_t end) {
    uint64_t *run = (uint64_t *)numbers;
    turn(run + first, run + second - 1);
    turn(run + second, run + end - 1);
    turn(run + first, run + end - 1);
}

/* Have a group and the next one change places, with so many vertices: those of a group that does not touch for a while, too. */
static void exchange_groups(hs_memory *memory, int64_t index, int64_t deepest) {
    const hs_contact *contact = memory->contact;
    int64_t *first = (int64_t *)contact->first + index, middle = first[0] + (first[2] - first[1]);
    void *arrays[] = {(void *)contact->gap, (void *)contact->weight, (void *)contact->order, memory->each};
    for (size_t k = 0; k < 4; ++k) exchange(arrays[k], first[0], first[1], first[2]);
    first[1] = middle;
    exchange(memory->friction, index, index + 1, index + 2);
    exchange(memory->depth, index, index + 1, index + 2);
    uint8_t steep = memory->steep[index];
    memory->steep[index] = memory->steep[index + 1];
    memory->steep[index + 1] = steep;
    hs_vertex *one = memory->vertices + index * memory->capacity, *other = one + memory->capacity;
    for (int64_t j = 0; j < deepest; ++j) {
        hs_vertex kept = one[j];
        one[j] = other[j];
        other[j] = kept;
    }
}

/* Put groups in order whose smallest gaps have changed; what is nearly in order takes little. */
static void put_in_order(hs_memory *memory, const int64_t *depth) {
    const hs_contact *contact = memory->contact;
    const double *gap = contact->gap;
    const int64_t *order = contact->order, *first = contact->first;
    for (int64_t index = 1; index < contact->groups; ++index)
        for (int64_t k = index; k > 0 && gap[first[k - 1]] > gap[first[k]]; --k) {
            int64_t low = depth[order[first[k - 1]]], high = depth[order[first[k]]];
            exchange_groups(memory, k - 1, low > high ? low : high);
        }
}

/* Give the asperities of a contact of its own other summits in its place, of which those of a group are alike; depths
 * are those in `depth` (asperity) where the group still touches. */
static void set_shape(hs_memory *memory, const double *height, const double *radius, const int64_t *depth) {
    const hs_contact *contact = memory->contact;
    const int64_t *order = contact->order, *first = contact->first;
    double *gap = (double *)contact->gap, *weight = (double *)contact->weight;
    double per_length = 1.0 / contact->units.length, datum = contact->datum;
    for (int64_t i = 0; i < contact->count; ++i) {
        gap[i] = (datum - height[order[i]]) * per_length;
        weight[i] = sqrt(radius[order[i]] * per_length);
    }
    for (int64_t index = 0; index < contact->groups; ++index)
        memory->depth[index] = gap[first[index]] < memory->approach ? depth[order[first[index]]] : 0;
    put_in_order(memory, depth);
    if (contact->groups > 1) {
        memcpy((double *)contact->sorted_gap, gap, (size_t)contact->count * sizeof *gap);
        memcpy((double *)contact->sorted_weight, weight, (size_t)contact->count * sizeof *weight);
    }
    memory->normal_load = hs_load_at(hs_all_of(contact), memory->approach).load;
}

/* Where the edge of a group starts a chord, and how much steeper a cone is than μ there. */
static double starts_at(const walk *w, const hs_memory *memory, int64_t g) {
    return w->yields_now ? w->from[memory->contact->order[memory->contact->first[g]]] : memory->approach;
}
static double steeper(const walk *w, const hs_memory *memory, int64_t g) {
    return w->yields_now ? w->steeper[memory->contact->order[memory->contact->first[g]]] : 1.0;
}

/* Forget the springs that have gone with what was worn. */
static void forget_worn(hs_memory *memory) {
    for (int64_t index = 0; index < memory->contact->groups; ++index) {
        hs_vertex *stack = memory->vertices + index * memory->capacity;
        double gap = memory->contact->gap[memory->contact->first[index]];
        int64_t worn = 0, depth = memory->depth[index];
        while (worn + 2 < depth && stack[worn + 1].label <= gap) ++worn;
        /* by rounding of its shape alone */
        if (depth == 0 && gap < memory->approach) hs_touch_unstrained(memory, index);
        if (depth < 2 || stack[worn].label >= gap) continue;
        memmove(stack, stack + worn, (size_t)(depth - worn) * sizeof *stack);
        stack->anchor = stack[1].anchor - stack[1].slope * (stack[1].label - gap);
        stack->label = gap;
        stack->normal = stack->tangential = stack->slope = 0.0;
        memory->depth[index] = depth - worn;
    }
}

/* ---- slid distances ---------------------------------------------------------------------------------------------- */

/* A straight way of one group: its ends, its coefficients at the start, amid and at the end, and the side on which its
 * springs slip. */
typedef struct way {
    hs_point from, to;
    double friction[3];
    double side;
} way;

/* Shares of a way between which a spring slips. */
typedef struct interval {
    double begin, end;
    double slip;
} interval;

/* When a spring slips: from where it meets its limit, until the limit grows faster than the spring is moved.
 *
 * With y = L - s v, what is left of its limit, as a quadratic in the share through start, middle and end, those are
 * the first root of y and the root of y'. Without a change of friction y is linear. */
static interval slipping(const way *on, double label, double anchor) {
    const double *friction = on->friction;
    double d = 0.5 * (on->from.d + on->to.d), v = 0.5 * (on->from.v + on->to.v);
    double first = friction[0] * (on->from.d - label) - on->side * (on->from.v - anchor);
    double amid = friction[1] * (d - label) - on->side * (v - anchor);
    double last = friction[2] * (on->to.d - label) - on->side * (on->to.v - anchor);
    if (friction[0] == friction[2] && friction[1] == friction[2]) {
        interval straight = {HUGE_VAL, 1.0, 0.0};
        if (first > last) straight.begin = hs_most(first, 0.0) / (first - last);
        if (straight.begin < 1.0) straight.slip = (1.0 - straight.begin) * (first - last);
        return straight;
    }
    double linear = 4.0 * amid - 3.0 * first - last, square = 2.0 * (first + last - 2.0 * amid);
    double under = linear * linear - 4.0 * hs_most(first, 0.0) * square;
    interval found = {HUGE_VAL, 1.0, 0.0};
    if (under < 0.0) return found;
    if (linear < 0.0)
        found.begin = 2.0 * hs_most(first, 0.0) / (sqrt(under) - linear);
    else if (square < 0.0)
        found.begin = (linear + sqrt(under)) / (-2.0 * square);
    if (linear < 0.0 && 2.0 * square > -linear) found.end = linear / (-2.0 * square);
    if (found.begin < found.end)
        found.slip = -(found.end - found.begin) * (linear + square * (found.end + found.begin));
    return found;
}

/* How far the asperities of a group slide on a straight way while all their springs slip: ∫|dV|, added to `slid`.
 *
 * When a spring begins to slip is a quotient of functions that are linear in the label between vertices, so that the
 * last to slip is at a vertex, or the innermost. New springs slip at once, if at all. */
static void slide_on(const hs_group *group, int64_t depth, const double *gap, const int64_t *whose, way on, double unit,
                     int steep, double *slid) {
    /* within a cone that stays as it is the innermost is the last */
    int inmost_last = !steep && on.friction[0] == on.friction[2] && on.friction[0] == on.friction[1];
    double moved = on.to.v - on.from.v, sunk = on.to.d - on.from.d, tie = 1e-12 * (fabs(on.from.v) + fabs(on.to.v));
    if (moved == 0.0) return;
    double edge = hs_least(on.from.d, on.to.d);
    double fall = on.friction[0] * (on.from.d - edge) - on.friction[2] * (on.to.d - edge);
    for (int against = 0; against < 2; ++against) {
        on.side = copysign(1.0, against ? -moved : moved);
        interval all = {0.0, 1.0, 0.0};
        int64_t j = depth - 1;
        if (sunk > 0.0 && on.side * moved <= on.friction[2] * sunk) continue;
        for (int64_t i = group->curve.count - 1; i >= 0; --i) {
            double h = gap[whose[i]];
            interval own = {(h - on.from.d) / sunk, 1.0, HUGE_VAL};
            if (h >= hs_most(on.from.d, on.to.d)) continue;
            if (h < on.from.d) {
                if (depth == 0) continue;
                for (; j >= 0 && group->stack[j].label > h; --j) {
                    if (inmost_last) continue;
                    interval outer = slipping(&on, group->stack[j].label, group->stack[j].anchor);
                    double leaves = (on.from.d - group->stack[j].label) / -sunk;
                    /* what leaves holds nothing back afterwards */
                    int stays = group->stack[j].label <= on.to.d;
                    all.begin = hs_most(all.begin, stays ? outer.begin : hs_least(outer.begin, leaves));
                    if (stays) all.end = hs_least(all.end, outer.end);
                }
                const hs_vertex *above = group->stack + (j + 1 < depth ? j + 1 : j);
                own = slipping(&on, h, above->anchor - above->slope * (above->label - h));
                own.begin = hs_most(own.begin, all.begin);
                own.end = hs_least(own.end, h > on.to.d ? (on.from.d - h) / -sunk : all.end);
            }
            if (own.begin < own.end && own.slip > tie) slid[whose[i]] += fabs(moved) * (own.end - own.begin) * unit;
        }
        /* against the way springs slip only where their limit falls faster than they move */
        double inmost = group->curve.gap[0];
        fall = hs_most(fall, on.friction[0] * (on.from.d - inmost) - on.friction[2] * (on.to.d - inmost));
        if (fall <= fabs(moved)) return;
    }
}

/* ---- friction ---------------------------------------------------------------------------------------------------- */

/* Ask a law for the coefficient of an asperity at an approach of its own. */
static void ask(walk *w, int64_t number, const hs_contact *contact, double weight, double own, double slid) {
    w->asked[0][number] = weight * sqrt(own) * own * contact->units.load;
    w->asked[1][number] = weight * weight * contact->units.radius;
    w->asked[2][number] = slid;
}

/* Put down where the friction of each group is on a chord to approach d, where all carry `load`; asperities slide so
 * far meanwhile. What does not touch holds no friction by a law. */
static int put_stations(walk *w, const hs_memory *memory, double d, double load, double share, const double *ahead) {
    const hs_evolution *evolution = w->evolution;
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_law *law = &evolution->law;
    int by_goal = evolution->goal != NULL;
    int by_law = !by_goal && law->kind != HS_NO_LAW && law->depends_on != HS_ON_NOTHING;
    int64_t count = 0, asked = 0;
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t i = contact->first[index], whose = contact->order[i];
        double friction = memory->friction[index];
        if (make_stations(w, count + MOST_STATIONS) != HS_OK) return HS_OUT_OF_MEMORY;
        w->first_station[index] = count;
        if (by_goal) friction = hs_toward(w->goal[0][whose], w->goal[1][whose], share);
        if (by_law && !evolved->given[whose]) {
            double start = starts_at(w, memory, index) - contact->gap[i], end = d - contact->gap[i];
            double weight = contact->weight[i];
            double most = hs_most(start, end), least = hs_most(hs_least(start, end), 0.0), at[MOST_STATIONS];
            double own = start, slid = evolved->slid_distance[whose] + (ahead ? ahead[whose] : 0.0);
            int between = 0, bends = law->depends_on == HS_ON_OWN_LOAD && most > SLIGHT * least;
            for (double next = most / GRADE; bends && next > least && between < MOST_STATIONS - 1;) {
                at[between++] = next;
                next /= between < 8 ? GRADE : between < 12 ? 4.0 : 64.0;
            }
            for (int k = 0; k <= between; ++k) {
                station *here = w->stations + count++;
                double last = own;
                own = k == between ? end : at[end > start ? between - 1 - k : k];
                here->share = k == between ? 1.0 : (own - start) / (end - start);
                int touches = own > 0.0 && (load > 0.0 || law->depends_on != HS_ON_TOTAL_LOAD);
                here->friction = touches ? ASKED : 0.0;
                here->amid = bends && touches ? ASKED : 0.0;
                if (touches && bends) ask(w, asked++, contact, weight, 0.5 * (hs_most(last, 0.0) + own), slid);
                if (touches) ask(w, asked++, contact, weight, own, slid);
            }
        } else {
            station only = {1.0, 0.0, friction};
            w->stations[count++] = only;
        }
    }
    w->first_station[contact->groups] = count;
    hs_loaded loaded = {asked, w->asked[0], w->asked[1], w->asked[2], load * contact->units.load};
    int status = asked ? hs_coefficients(law, evolution->contact_modulus, &loaded, w->asked[3]) : HS_OK;
    for (int64_t k = 0, answer = 0; k < count && asked; ++k) {
        if (w->stations[k].amid == ASKED) w->stations[k].amid = w->asked[3][answer++];
        if (w->stations[k].friction == ASKED) w->stations[k].friction = w->asked[3][answer++];
    }
    for (int64_t index = 0; index < contact->groups; ++index)
        w->friction[index] = w->stations[w->first_station[index + 1] - 1].friction;
    for (int64_t g = 0; g < contact->groups && w->yields_now; ++g)
        for (int64_t k = w->first_station[g]; k < w->first_station[g + 1]; ++k) {
            double more = (steeper(w, memory, g) - 1.0) * (1.0 - w->stations[k].share);
            w->stations[k].friction *= 1.0 + more;
            w->stations[k].amid *= 1.0 + more;
        }
    return status;
}

/* ---- one chord --------------------------------------------------------------------------------------------------- */

/* Approach and normal load at a share of the path.
 *
 * Of two loads both go straight. Otherwise the approach does, as the contact at the start has it; where wear has
 * changed that, a normal load keeps the values that it had then. */
static void normal_at(const walk *w, const hs_memory *memory, double share, double *d, double *load) {
    const route *c = &w->course;
    if (c->both) {
        *load = hs_toward(c->load[0], c->load[1], share);
        *d = hs_approach_for(memory, *load);
        return;
    }
    *d = hs_toward(c->d[0], c->d[1], share);
    if (c->by_load) {
        *load = share == 1.0 ? c->load[1] : hs_load_at(hs_all_of(c->first ? c->first : memory->contact), *d).load;
        if (w->wears) *d = hs_approach_for(memory, *load);
    } else {
        *load = hs_load_at(hs_all_of(memory->contact), *d).load;
    }
}

/* The end of a chord. */
typedef struct target {
    double d, load, v;
    double force;  /* tangential, where it is controlled */
    double excess; /* that is asked for beyond the friction limit */
    int64_t touching;
} target;

/* Find the displacement at which a chord ends. */
static int find_end(walk *w, hs_memory *memory, double share, target *end, hs_refusal *refusal) {
    const route *c = &w->course;
    const hs_contact *contact = memory->contact;
    double value = hs_toward(c->tangential[0], c->tangential[1], share), limit = 0.0;
    /* where asperities wear, the loads are known when they have their shapes */
    int changes = 0, weighs = !w->wears || c->by_force || w->compliance > 0.0;
    hs_shares shares;
    shares.load = w->load;
    shares.count = 0;
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < end->d; ++g, ++shares.count) {
        changes |= w->friction[g] != memory->friction[g] || steeper(w, memory, g) != 1.0;
        if (!weighs) continue;
        w->load[g] = contact->groups == 1 ? end->load : hs_load_at(hs_group_of(memory, g).curve, end->d).load;
        limit += w->friction[g] * w->load[g];
    }
    end->touching = shares.count;
    end->excess = 0.0;
    end->force = value;
    if (c->ends_apart || (!c->by_force && w->compliance == 0.0)) {
        end->v = c->ends_apart ? hs_toward(c->apart[0], c->apart[1], share) : value;
        return HS_OK;
    }
    hs_aim aim = {value, 1.0, w->compliance};
    if (c->by_force) {
        if (fabs(value) - limit > HS_LIMIT_SLACK * limit) {
            if (!w->drive->saturate) {
                refusal->request = value * contact->units.load;
                refusal->limit = limit * contact->units.load;
                return HS_BEYOND_LIMIT;
            }
            end->force = copysign(limit, value);
            end->excess = value - end->force;
        }
        aim = hs_to_load(end->force);
    }
    hs_fronts fronts;
    int status = hs_no_fronts(&fronts, shares.count);
    if (status != HS_OK) return status;
    if (!changes || shares.count == 0) {
        status = hs_displacement_with(memory, &shares, &fronts, end->d, aim, &end->v);
    } else {
        /* any cone may cut any polyline */
        double *kept = memory->friction;
        memcpy(w->steep, memory->steep, (size_t)contact->groups);
        memset(memory->steep, 1, (size_t)contact->groups);
        memory->friction = w->friction;
        status = hs_found_displacement(memory, &shares, &fronts, end->d, aim, &end->v);
        memory->friction = kept;
        memcpy(memory->steep, w->steep, (size_t)contact->groups);
    }
    hs_free_fronts(&fronts);
    /* what slides already while its limit falls stays where it is */
    double side = copysign(1.0, end->force);
    int at_limit = c->by_force && fabs(end->force) >= (1.0 - HS_TIE) * limit;
    if (shares.count == 0 && end->excess == 0.0) at_limit = 0;
    if (at_limit && (shares.count == 0 || side * end->v < side * memory->displacement)) end->v = memory->displacement;
    return status;
}

/* Have room for a stack to be clipped, and for what is added to it otherwise. */
static int make_room(walk *w, hs_memory *memory, int64_t depth) {
    int64_t room = 2 * hs_room_to_clip(depth);
    if (room > w->room) {
        free(w->scratch);
        w->scratch = (hs_vertex *)malloc(2 * (size_t)room * sizeof *w->scratch);
        w->room = w->scratch ? 2 * room : 0;
    }
    if (!w->scratch) return HS_OUT_OF_MEMORY;
    return depth + 2 > memory->capacity ? hs_memory_reserve(memory, 2 * (depth + 2)) : HS_OK;
}

/* Carry one group on a straight way, with its coefficient going straight, too; what it loses goes to `each`, position
 * 0. */
static int carry_group(walk *w, hs_memory *memory, int64_t index, const way *on, double load, double *each,
                       hs_losses *losses) {
    int64_t depth = memory->depth[index];
    if (make_room(w, memory, depth) != HS_OK) return HS_OUT_OF_MEMORY;
    hs_group group = hs_group_of(memory, index);
    double reached;
    group.each = each + group.start;
    group.friction = on->friction[2];
    if (on->to.d <= group.curve.gap[0]) {
        group.friction = on->friction[0];
        if (depth) hs_lose_withdrawn(&group, losses, depth, 1, &on->from, &on->to);
        memory->depth[index] = 0;
        memory->steep[index] = 0;
    } else if (depth > 0 && (memory->steep[index] || on->friction[0] != on->friction[2])) {
        hs_cone cone = {on->friction[2], on->to.v - on->from.v, on->friction[0] * (on->to.d - on->from.d),
                        on->friction[2] - on->friction[0]};
        depth = hs_carry_and_clip(&group, losses, depth, on->from, on->to, load, &cone, w->scratch, NULL);
        if (depth > memory->capacity && hs_memory_reserve(memory, 2 * depth) != HS_OK) return HS_OUT_OF_MEMORY;
        memcpy(memory->vertices + index * memory->capacity, w->scratch, (size_t)depth * sizeof *w->scratch);
        memory->depth[index] = depth;
        memory->steep[index] = (uint8_t)hs_is_steep(w->scratch, depth, group.friction);
    } else {
        memory->depth[index] = hs_move_group(&group, losses, depth, &on->from, on->to.d, load,
                                             hs_to_displacement(on->to.v), &reached);
    }
    return HS_OK;
}

/* Carry one group to the end of a chord from station to station; where its friction bends it is told what it slides. */
static int carry_by_stations(walk *w, hs_memory *memory, int64_t g, const target *end, double *each,
                             hs_losses *losses) {
    const hs_contact *contact = memory->contact;
    hs_point from = {starts_at(w, memory, g), memory->displacement}, to = {end->d, end->v};
    int64_t stations = w->first_station[g + 1] - w->first_station[g], first = contact->first[g];
    const station *at = w->stations + w->first_station[g];
    way on = {from, from, {memory->friction[g] * steeper(w, memory, g), 0.0, 0.0}, 1.0};
    int bends = at->amid > 0.0;
    if (bends) w->slid[contact->order[first]] = 0.0;
    for (int64_t k = 0; k < stations; ++k) {
        hs_group group = hs_group_of(memory, g);
        int last = k + 1 == stations;
        on.to.d = last ? to.d : hs_toward(from.d, to.d, at[k].share);
        on.to.v = last ? to.v : hs_toward(from.v, to.v, at[k].share);
        on.friction[2] = at[k].friction;
        if (memory->depth[g] == 0) on.friction[0] = on.friction[2];
        if (on.to.d <= group.curve.gap[0]) on.friction[2] = on.friction[0];
        on.friction[1] = at[k].amid > 0.0 ? at[k].amid : 0.5 * (on.friction[0] + on.friction[2]);
        double load = last && g < end->touching ? w->load[g] : hs_load_at(group.curve, on.to.d).load;
        if (bends)
            slide_on(&group, memory->depth[g], w->gap, contact->order + first, on, contact->units.displacement,
                     memory->steep[g], w->slid);
        int status = carry_group(w, memory, g, &on, load, each, losses);
        if (status != HS_OK) return status;
        on.from = on.to;
        on.friction[0] = on.friction[2];
    }
    return HS_OK;
}

/* Carry all groups to the end of a chord. */
static int carry(walk *w, hs_memory *memory, const target *end, double share) {
    const hs_contact *contact = memory->contact;
    double deepest = hs_most(memory->approach, end->d);
    hs_losses losses;
    hs_no_losses(&losses, contact->groups);
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < deepest; ++g) {
        int status = carry_by_stations(w, memory, g, end, memory->each, &losses);
        if (status != HS_OK) return status;
    }
    /* what was foreseen has shaped the summits */
    if (w->wears) memcpy(w->slid, w->ahead, (size_t)contact->count * sizeof *w->slid);
    memcpy(memory->friction, w->friction, (size_t)contact->groups * sizeof(double));
    hs_settle(&losses, memory);
    memory->approach = end->d;
    memory->displacement = end->v;
    memory->normal_load = end->load;
    memory->excess = end->excess;
    memory->tangential_load = hs_total_force(memory);
    if (w->course.by_force && (!w->course.ends_apart || share == 1.0)) memory->tangential_load = end->force;
    return HS_OK;
}

/* Tell how far asperities slide on the straight way to the end of a chord. Those whose friction bends are carried there
 * and put back, if `ahead`; otherwise they are told when they are carried. */
static int slide_all(walk *w, hs_memory *memory, const target *end, int ahead) {
    const hs_contact *contact = memory->contact;
    way on = {{memory->approach, memory->displacement}, {end->d, end->v}, {0.0, 0.0, 0.0}, 1.0};
    memset(w->slid, 0, (size_t)contact->count * sizeof *w->slid);
    for (int64_t g = 0; g < contact->groups; ++g) {
        hs_group group = hs_group_of(memory, g);
        int64_t depth = memory->depth[g];
        if (group.curve.gap[0] >= hs_most(on.from.d, on.to.d)) break;
        on.from.d = starts_at(w, memory, g);
        on.friction[0] = group.friction * steeper(w, memory, g);
        on.friction[2] = g < end->touching ? w->friction[g] : group.friction;
        if (depth == 0) on.friction[0] = on.friction[2];
        on.friction[1] = 0.5 * (on.friction[0] + on.friction[2]);
        if (!ahead || w->stations[w->first_station[g]].amid <= 0.0) {
            slide_on(&group, depth, w->gap, contact->order + group.start, on, contact->units.displacement,
                     memory->steep[g], w->slid);
            continue;
        }
        hs_losses losses;
        uint8_t steep = memory->steep[g];
        if (depth + 1 > w->kept_room) {
            free(w->kept);
            w->kept_room = 2 * (depth + 1);
            w->kept = (hs_vertex *)malloc((size_t)w->kept_room * sizeof *w->kept);
            if (!w->kept) return HS_OUT_OF_MEMORY;
        }
        memcpy(w->kept, group.stack, (size_t)depth * sizeof *w->kept);
        hs_no_losses(&losses, contact->groups);
        int status = carry_by_stations(w, memory, g, end, w->nowhere, &losses);
        if (status != HS_OK) return status;
        memcpy(memory->vertices + g * memory->capacity, w->kept, (size_t)depth * sizeof *w->kept);
        memory->depth[g] = depth;
        memory->steep[g] = steep;
    }
    return HS_OK;
}

static void add_slides(const walk *w, hs_memory *memory) {
    hs_evolved *evolved = memory->evolved;
    double together = HUGE_VAL;
    for (int64_t i = 0; i < memory->contact->count; ++i) {
        evolved->slid_distance[i] += w->slid[i];
        if (w->gap[i] < memory->approach) together = hs_least(together, w->slid[i]);
    }
    if (together < HUGE_VAL) evolved->slid_together += together;
}

/* Have summits lose what they do on a chord as it is foreseen: volumes, and the shapes amid it and at its end. */
static int foresee_wear(walk *w, const hs_memory *memory, const target *end) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_wear *wear = &w->evolution->wear;
    double unit = contact->units.length, moved = fabs(end->v - memory->displacement) * contact->units.displacement;
    double modulus = 4.0 / 3.0 * w->evolution->contact_modulus;
    for (int64_t g = 0; g < contact->groups; ++g)
        for (int64_t k = contact->first[g]; k < contact->first[g + 1]; ++k) {
            int64_t i = contact->order[k];
            if (w->begun[i] + w->slid[i] == 0.0) {
                w->mean_load[i] = w->energy[i] = 0.0;
                continue;
            }
            double start = (memory->approach - w->gap[i]) * unit, slid = w->slid[i];
            double stop = end->d * unit - (contact->datum - w->end_height[i]);
            /* an asperity slides to the end, or until it leaves */
            double leaves = stop < 0.0 && slid > 0.0 ? start / (start - stop) : 1.0;
            /* what is held may have slid farther than the contact is moved now */
            double begins = slid > 0.0 ? hs_most(leaves - slid / moved, 0.0) : 0.0;
            w->first[i] = hs_most(start + begins * (stop - start), 0.0);
            w->last[i] = hs_most(stop, 0.0);
            w->mean_load[i] = 0.0;
            if (slid > 0.0)
                w->mean_load[i] = hs_mean_load(
                    w->first[i], w->last[i], modulus * sqrt(0.5 * (evolved->summit_radius[i] + w->end_radius[i])));
            w->energy[i] = w->friction[g] * w->mean_load[i] * slid;
        }
    int status = hs_lost_volumes(wear, contact->count, w->mean_load, w->slid, w->energy, w->lost);
    for (int64_t i = 0; i < contact->count; ++i) {
        double height = evolved->summit_height[i], radius = evolved->summit_radius[i], guess = w->end_radius[i];
        w->end_height[i] = height;
        w->end_radius[i] = radius;
        w->taken[i] = 0.0;
        if (w->begun[i] + w->slid[i] > 0.0 && w->first[i] + w->last[i] > 0.0) {
            double waiting = hs_most(evolved->waiting_volume[i], -w->lost[i]);
            w->taken[i] = hs_worn_summit(wear, radius * w->first[i], guess * w->last[i], 0.5 * (radius + guess),
                                         evolved->shaped_volume[i], waiting, w->lost[i], w->end_height + i,
                                         w->end_radius + i);
        }
        w->mid_height[i] = 0.5 * (height + w->end_height[i]);
        w->mid_radius[i] = 0.5 * (radius + w->end_radius[i]);
    }
    return status;
}

static void note_gaps(walk *w, const hs_contact *contact) {
    for (int64_t i = 0; i < contact->count; ++i) w->gap[contact->order[i]] = contact->gap[i];
}

static void note_depths(walk *w, const hs_memory *memory) {
    const hs_contact *contact = memory->contact;
    for (int64_t g = 0; g < contact->groups; ++g) w->depth[contact->order[contact->first[g]]] = memory->depth[g];
}

/* Reshape a memory, and return the elastic energy that is lost by it. */
static double reshape(walk *w, hs_memory *memory, const double *height, const double *radius, double stored) {
    set_shape(memory, height, radius, w->depth);
    hs_refresh_loads(memory);
    return stored - hs_stored(memory, NULL);
}

/* Where the channels are at a share of a path on which summits yield; a load that follows from the approach is not known
 * before they have. */
static int yielding_end(const walk *w, const hs_memory *memory, double share, double *d, double *load) {
    const route *c = &w->course;
    *d = hs_toward(c->d[0], c->d[1], share);
    *load = c->by_load && share == 1.0 ? c->load[1] : NAN;
    if (!c->both || share == 1.0) return HS_OK;
    *load = hs_toward(c->load[0], c->load[1], share);
    return hs_yielding_approach(memory, w->evolution, *load, d);
}

/* Have summits become what they are at the end of a chord to approach d, each group of those that yield being alike. */
static int yield_on(walk *w, hs_memory *memory, double d) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const double unit = contact->units.length;
    double *gap = (double *)contact->gap, *weight = (double *)contact->weight;
    for (int64_t i = 0; i < contact->count; ++i) {
        w->from[i] = memory->approach;
        w->steeper[i] = evolved->summit_radius[i];
    }
    int status = hs_yield_to(memory, w->evolution, d, w->changed);
    if (status != HS_OK) return status;
    note_depths(w, memory);
    for (int64_t i = 0; i < contact->count; ++i)
        w->steeper[i] = w->changed[i] ? evolved->summit_radius[i] / w->steeper[i] : 1.0;
    for (int64_t g = 0; g < contact->groups; ++g) {
        int64_t first = contact->first[g], leader = contact->order[first];
        if (!w->changed[leader]) continue;
        hs_vertex *stack = memory->vertices + g * memory->capacity;
        double old = gap[first], now = (contact->datum - evolved->summit_height[leader]) / unit;
        double ratio = w->steeper[leader];
        for (int64_t k = first; k < contact->first[g + 1]; ++k) {
            gap[k] = now;
            weight[k] = sqrt(evolved->summit_radius[leader] / unit);
        }
        for (int64_t j = 0; j < memory->depth[g]; ++j) {
            stack[j].label = now + (stack[j].label - old) / ratio;
            stack[j].slope *= ratio;
            stack[j].normal /= ratio;
        }
        for (int64_t k = first; k < contact->first[g + 1] && memory->depth[g]; ++k)
            w->from[contact->order[k]] = stack[memory->depth[g] - 1].label;
    }
    put_in_order(memory, w->depth);
    if (contact->groups > 1) {
        for (int64_t i = 0; i < contact->count; ++i) w->place[i] = i;
        if (hs_sort_by(gap, w->place, contact->count) != HS_OK) return HS_OUT_OF_MEMORY;
        for (int64_t i = 0; i < contact->count; ++i) {
            ((double *)contact->sorted_gap)[i] = gap[w->place[i]];
            ((double *)contact->sorted_weight)[i] = weight[w->place[i]];
        }
    }
    memory->known_label = NAN;
    return HS_OK;
}

/* Carry a memory along one chord, to a share of the path. */
static int chord(walk *w, hs_memory *memory, double share, hs_refusal *refusal) {
    hs_evolved *evolved = memory->evolved;
    const hs_contact *contact = memory->contact;
    const hs_law *law = &w->evolution->law;
    size_t size = (size_t)contact->count * sizeof(double);
    int64_t count = contact->count;
    int by_distance = !w->evolution->goal && law->kind != HS_NO_LAW && law->depends_on == HS_ON_SLID_DISTANCE;
    int passes = w->wears ? 2 : by_distance, slides = 0, searches = w->course.by_force || w->compliance > 0.0;
    double stored = w->wears ? hs_stored(memory, NULL) : 0.0, erased = 0.0;
    target end;
    w->yields_now = w->yields && share > w->onset;
    if (w->yields_now) {
        int status = yielding_end(w, memory, share, &end.d, &end.load);
        if (status == HS_OK) status = yield_on(w, memory, end.d);
        if (status != HS_OK) return status;
        if (isnan(end.load)) end.load = hs_load_at(hs_all_of(contact), end.d).load;
    }
    note_gaps(w, contact);
    if (w->wears) {
        for (int64_t i = 0; i < count; ++i) w->before[contact->order[i]] = memory->each[i];
        memcpy(w->end_height, evolved->summit_height, size);
        memcpy(w->end_radius, evolved->summit_radius, size);
        note_depths(w, memory);
    }
    for (int pass = 0;; ++pass) {
        if (!w->yields_now) normal_at(w, memory, share, &end.d, &end.load);
        int status = put_stations(w, memory, end.d, end.load, share, pass ? w->ahead : NULL);
        if (status == HS_OK) status = find_end(w, memory, share, &end, refusal);
        if (status != HS_OK) return status;
        status = slide_all(w, memory, &end, w->wears && pass < passes);
        if (status != HS_OK) return status;
        for (int64_t i = 0; i < count && !slides; ++i) slides = w->slid[i] > 0.0;
        if (pass == passes) break;
        if (pass == 0) memcpy(w->begun, w->slid, size);
        /* what wears may be held by it: it goes in small jerks then, and slides half the way */
        for (int64_t i = 0; i < count; ++i) w->slid[i] = hs_most(w->slid[i], w->wears ? 0.5 * w->begun[i] : 0.0);
        memcpy(w->ahead, w->slid, size);
        if (!slides) break;
        if (w->wears) {
            status = foresee_wear(w, memory, &end);
            if (status != HS_OK) return status;
            set_shape(memory, w->end_height, w->end_radius, w->depth);
            if (searches) hs_refresh_loads(memory);
        }
    }
    int wears = w->wears && slides;
    if (wears) erased = reshape(w, memory, w->mid_height, w->mid_radius, stored);
    if (w->wears) {
        /* groups may stand in another order than that of the end */
        int status = put_stations(w, memory, end.d, end.load, share, w->ahead);
        if (status != HS_OK) return status;
        for (end.touching = 0; end.touching < contact->groups; ++end.touching) {
            hs_curve curve = hs_group_of(memory, end.touching).curve;
            if (curve.gap[0] >= end.d) break;
            w->load[end.touching] = hs_load_at(curve, end.d).load;
        }
    }
    int status = carry(w, memory, &end, share);
    if (status != HS_OK) return status;
    if (wears) {
        note_depths(w, memory);
        erased += reshape(w, memory, w->end_height, w->end_radius, hs_stored(memory, NULL));
        forget_worn(memory);
        memory->normal_load = end.load;
        if (!w->course.by_force) memory->tangential_load = hs_total_force(memory);
        memcpy(evolved->summit_height, w->end_height, size);
        memcpy(evolved->summit_radius, w->end_radius, size);
        evolved->erased_energy += erased * contact->units.energy;
    }
    if (w->wears) {
        for (int64_t i = 0; i < count; ++i)
            w->energy[contact->order[i]] = (memory->each[i] - w->before[contact->order[i]]) * contact->units.energy;
        if (!wears) {
            memset(w->mean_load, 0, size);
            memset(w->taken, 0, size);
        }
        status = hs_lost_volumes(&w->evolution->wear, count, w->mean_load, w->slid, w->energy, w->lost);
        for (int64_t i = 0; i < count; ++i) {
            evolved->worn_volume[i] += w->lost[i];
            evolved->waiting_volume[i] += w->lost[i] - w->taken[i];
            evolved->shaped_volume[i] += w->taken[i];
        }
    }
    add_slides(w, memory);
    return status;
}

/* ---- as many chords as it takes ---------------------------------------------------------------------------------- */

/* A change over what is tolerated, rounding left out. */
static double part_of(double change, double rounding, double tolerated) {
    change = fabs(change) - rounding;
    return change <= 0.0 ? 0.0 : change / tolerated;
}

/* The largest change of a quantity of asperities from a coarser to a finer way, over a part of the largest that it
 * made. */
static double part_of_each(const double *start, const double *coarse, const double *fine, int64_t count, double part,
                           double *made_by_most) {
    double change = 0.0, made = 0.0, size = 0.0;
    for (int64_t i = 0; i < count; ++i) {
        change = hs_most(change, fabs(fine[i] - coarse[i]));
        made = hs_most(made, fabs(fine[i] - start[i]));
        size = hs_most(size, fabs(fine[i]));
    }
    *made_by_most = made;
    return part_of(change, 64.0 * DBL_EPSILON * size, part * made);
}

/* How far a way in chords is from being settled: 1 where it just is. */
static double distance_to_settled(const walk *w, const hs_memory *start, const hs_memory *coarse,
                                  const hs_memory *fine) {
    double part = COARSER * w->drive->tolerance, rough = COARSEST * w->drive->tolerance;
    double top = hs_most(coarse->approach, start->approach) - fine->contact->sorted_gap[0];
    double reach = hs_most(hs_largest_friction(fine), 1e-300) * hs_most(top, 0.0);
    double lost = fine->dissipated - start->dissipated;
    const hs_evolved *from = start->evolved, *one = coarse->evolved, *other = fine->evolved;
    int64_t count = fine->contact->count;
    double most = 0.0, made, moved = fabs(fine->displacement - start->displacement) * fine->contact->units.displacement;
    double state[] = {
        part_of(fine->displacement - coarse->displacement, 0.0, part * reach),
        part_of(fine->tangential_load - coarse->tangential_load, 0.0,
                part * hs_friction_limit(fine, fine->approach, fine->normal_load)),
        part_of(fine->approach - coarse->approach, 0.0, part * top),
        /* what is lost is told to a part of itself, or of what is stored */
        part_of(fine->dissipated - coarse->dissipated, 0.0, rough * hs_most(lost, hs_stored(fine, NULL)))};
    for (size_t k = 0; k < sizeof state / sizeof *state; ++k) most = hs_most(most, state[k]);
    double slid = part_of_each(from->slid_distance, one->slid_distance, other->slid_distance, count, rough, &made);
    /* of asperities that slide for a moment only, as they leave, nothing is told to a part of itself */
    double share = made > 0.0 && made < NEGLIGIBLE * moved ? made / (NEGLIGIBLE * moved) : 1.0;
    const double *before[] = {from->worn_volume, from->summit_height, from->summit_radius};
    const double *first[] = {one->worn_volume, one->summit_height, one->summit_radius};
    const double *last[] = {other->worn_volume, other->summit_height, other->summit_radius};
    most = hs_most(most, share * slid);
    for (int k = 0; k < 3 && w->wears; ++k)
        most = hs_most(most, share * part_of_each(before[k], first[k], last[k], count, rough, &made));
    return most;
}

/* Extrapolate the energy of the finer way: its error falls with the square of the chords. */
static void extrapolate(walk *w, const hs_memory *start, const hs_memory *coarse, hs_memory *fine) {
    int64_t count = fine->contact->count;
    for (int64_t i = 0; i < count; ++i) w->energy[coarse->contact->order[i]] = coarse->each[i];
    for (int64_t i = 0; i < count; ++i) w->before[start->contact->order[i]] = start->each[i];
    for (int64_t i = 0; i < count; ++i) {
        int64_t whose = fine->contact->order[i];
        fine->each[i] = hs_most(fine->each[i] + (fine->each[i] - w->energy[whose]) / 3.0, w->before[whose]);
    }
    fine->dissipated = hs_most(fine->dissipated + (fine->dissipated - coarse->dissipated) / 3.0, start->dissipated);
}

/* Have a memory hold a contact that it shares with nobody, so that it can be changed where it is. */
static int own_contact(hs_memory *memory) {
    hs_contact *own = hs_contact_copy(memory->contact);
    if (!own) return HS_OUT_OF_MEMORY;
    hs_contact_free(memory->contact);
    memory->contact = own;
    return HS_OK;
}

/* Carry a copy of a memory from one share of the path to another in chords. */
static int in_chords(walk *w, const hs_memory *start, hs_memory *memory, double before, double share, int chords,
                     hs_refusal *refusal) {
    if (w->wears || w->yields) hs_contact_assign(memory->contact, start->contact);
    int status = hs_memory_assign(memory, start);
    for (int k = 1; k <= chords && status == HS_OK; ++k)
        status = chord(w, memory, k == chords ? share : before + (share - before) * ((double)k / chords), refusal);
    return status;
}

static void swap(hs_memory *one, hs_memory *other) {
    hs_memory kept = *one;
    *one = *other;
    *other = kept;
}

/* Carry the first of three memories from one share of the path to another, in as many chords as it takes. */
static int settle(walk *w, hs_memory *memory, hs_memory *coarse, hs_memory *fine, double before, double share,
                  hs_refusal *refusal) {
    const route *c = &w->course;
    double touch = memory->contact->sorted_gap[0], last = HUGE_VAL;
    /* a gap is crossed without load, before the ramp begins */
    if (c->both && c->d[0] < touch) memory->approach = hs_most(memory->approach, hs_least(touch, c->d[1]));
    double top = hs_most(c->d[0], c->d[1]) - touch;
    int little = fabs(c->d[1] - c->d[0]) * (share - before) <= LITTLE * top && !w->evolution->goal;
    if (w->evolution->law.kind != HS_NO_LAW && w->evolution->law.depends_on == HS_ON_SLID_DISTANCE) little = 0;
    int fewest = little ? FEWEST_CHORDS : FEW_CHORDS;
    int status = in_chords(w, memory, coarse, before, share, fewest, refusal);
    for (int chords = 2 * fewest; status == HS_OK; chords *= 2) {
        status = in_chords(w, memory, fine, before, share, chords, refusal);
        if (status != HS_OK) break;
        double now = distance_to_settled(w, memory, coarse, fine);
        if (now <= CLOSE || (now <= 1.0 && last <= 1.0) || chords >= MOST_CHORDS) break;
        last = now;
        swap(coarse, fine);
    }
    if (status != HS_OK) return status;
    extrapolate(w, memory, coarse, fine);
    swap(memory, fine);
    return HS_OK;
}

/* ---- paths ------------------------------------------------------------------------------------------------------- */

/* Put down where a path goes from where the memory is. */
static int begin_course(walk *w, const hs_memory *memory, const hs_path *path) {
    const hs_evolution *evolution = w->evolution;
    const hs_contact *contact = memory->contact;
    route *c = &w->course;
    hs_aim aim;
    double request = memory->tangential_load + (w->drive->saturate ? memory->excess : 0.0);
    hs_destination(memory, path, w->compliance, request, &c->d[1], &c->load[1], &aim);
    c->d[0] = memory->approach;
    c->load[0] = memory->normal_load;
    c->by_load = path->normal_control == HS_LOAD;
    c->by_force = path->tangential_control == HS_LOAD;
    c->both = c->by_load && c->by_force;
    c->tangential[0] = c->by_force ? request : memory->displacement + w->compliance * memory->tangential_load;
    c->tangential[1] = aim.value;
    c->ends_apart = c->by_force && !c->both && aim.value == 0.0 && c->d[1] <= contact->sorted_gap[0];
    c->apart[0] = memory->displacement;
    c->apart[1] = memory->depth[0] > 0 ? memory->vertices[0].anchor : memory->displacement;
    c->first = NULL;
    w->onset = HUGE_VAL;
    if (w->yields) {
        if (isnan(w->next)) w->next = hs_next_yield(memory, &evolution->yielding);
        /* what is elastic now is so up to where it is */
        double next = hs_most(w->next, memory->approach);
        if (c->d[1] > next + HS_TIE * fabs(next)) {
            int status = HS_OK;
            if (c->by_load) status = hs_yielding_approach(memory, evolution, c->load[1], &c->d[1]);
            if (status != HS_OK) return status;
            w->onset = (next - c->d[0]) / (c->d[1] - c->d[0]);
            if (c->both) w->onset = (hs_load_at(hs_all_of(contact), next).load - c->load[0]) / (c->load[1] - c->load[0]);
            w->onset = hs_least(hs_most(w->onset, 0.0), 1.0);
        }
    }
    if (w->wears && c->by_load && !c->both && !(c->first = hs_contact_copy(contact))) return HS_OUT_OF_MEMORY;
    for (int64_t g = 0; g < contact->groups && evolution->goal; ++g)
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i) {
            int64_t whose = contact->order[i];
            w->goal[0][whose] = memory->friction[g];
            w->goal[1][whose] = hs_toward(memory->friction[g], evolution->goal[whose], evolution->goal_fraction);
        }
    return HS_OK;
}

/* Whether neither friction nor geometry evolves on a path. */
static int is_still(const walk *w, const hs_memory *memory) {
    const hs_law *law = &w->evolution->law;
    int64_t count = memory->contact->count;
    if (w->wears) return 0;
    if (w->evolution->goal) return memcmp(w->goal[0], w->goal[1], (size_t)count * sizeof(double)) == 0;
    if (law->kind == HS_NO_LAW || law->depends_on == HS_ON_NOTHING) return 1;
    if (!memchr(memory->evolved->given, 0, (size_t)count)) return 1;
    return law->depends_on != HS_ON_SLID_DISTANCE && w->course.d[0] == w->course.d[1];
}

/* Walk on along a path on which nothing evolves, exactly; slid distances are those of the straight way, or, where that
 * is bent, followed in chords. */
static int walk_still(walk *w, hs_memory *memory, hs_memory *spare[2], const hs_plan *plan, double before, double share,
                      hs_refusal *refusal, int *held) {
    const route *c = &w->course;
    hs_memory *start = spare[0];
    int bent = plan->meets || (c->both && c->load[0] != c->load[1]);
    if (w->yields) hs_contact_assign(start->contact, memory->contact);
    int status = hs_memory_assign(start, memory);
    if (status == HS_OK && bent) {
        hs_memory *fine = hs_memory_copy(memory);
        status = fine && w->yields ? own_contact(fine) : HS_OK;
        if (status == HS_OK) status = fine ? settle(w, start, spare[1], fine, before, share, refusal) : HS_OUT_OF_MEMORY;
        hs_memory_free(fine);
    }
    if (status == HS_OK) status = hs_walk_on(memory, plan, before, share, w->drive->tolerance, held);
    if (status != HS_OK) return status;
    if (bent) {
        memcpy(memory->evolved->slid_distance, start->evolved->slid_distance,
               (size_t)memory->contact->count * sizeof(double));
        memory->evolved->slid_together = start->evolved->slid_together;
        return HS_OK;
    }
    target end = {memory->approach, memory->normal_load, memory->displacement, 0.0, 0.0, memory->contact->groups};
    memcpy(w->friction, memory->friction, (size_t)memory->contact->groups * sizeof(double));
    note_gaps(w, memory->contact);
    status = slide_all(w, start, &end, 0);
    add_slides(w, memory);
    return status;
}

/* Have asperities stand alone whose friction or shape comes to differ from that of others. */
static int part_as_they_evolve(hs_memory *memory, const hs_evolution *evolution) {
    const hs_law *law = &evolution->law;
    size_t count = (size_t)memory->contact->count;
    int depends = law->kind != HS_NO_LAW && law->depends_on != HS_ON_NOTHING, status = HS_OK;
    if (evolution->wear.kind != HS_NO_WEAR || (depends && law->depends_on != HS_ON_TOTAL_LOAD))
        status = hs_part_ways(memory, memory->evolved->summit_height, memory->evolved->summit_radius);
    if (status == HS_OK && depends && memchr(memory->evolved->given, 1, count)) {
        double *given = (double *)malloc(count * sizeof *given);
        if (!given) return HS_OUT_OF_MEMORY;
        for (size_t i = 0; i < count; ++i) given[i] = memory->evolved->given[i];
        status = hs_part_ways(memory, given, given);
        free(given);
    }
    if (status == HS_OK && evolution->goal) {
        status = hs_part_ways(memory, evolution->goal, evolution->goal);
        memset(memory->evolved->given, 1, count);
    }
    return status;
}

/* Have copies of a memory to walk on, of the same groups; where summits change, each has a contact of its own. */
static int make_spares(const walk *w, const hs_memory *memory, hs_memory *spare[2]) {
    for (int k = 0; k < 2; ++k) {
        if (spare[k] && spare[k]->contact->groups == memory->contact->groups) continue;
        hs_memory_free(spare[k]);
        spare[k] = hs_memory_copy(memory);
        if (!spare[k]) return HS_OUT_OF_MEMORY;
        if ((w->wears || w->yields) && own_contact(spare[k]) != HS_OK) return HS_OUT_OF_MEMORY;
    }
    return HS_OK;
}

/* Whether summits can yield to the end of the path at once: nothing is strained, nor will be. */
static int yields_at_rest(const walk *w, const hs_memory *memory) {
    return w->alone && w->course.tangential[0] == w->course.tangential[1] && hs_unstrained(memory);
}

/* Have summits yield where nothing is strained, to a share of the path. */
static int yield_at_rest(walk *w, hs_memory *memory, double share) {
    double d, load;
    int status = yielding_end(w, memory, share, &d, &load);
    if (status == HS_OK) status = hs_yield_to(memory, w->evolution, d, w->changed);
    if (status != HS_OK) return status;
    const hs_contact *contact = memory->contact;
    double *gap = w->first, *weight = w->last, unit = contact->units.length;
    for (int64_t k = 0; k < contact->count; ++k) {
        int64_t i = contact->order[k];
        gap[i] = w->changed[i] ? (contact->datum - memory->evolved->summit_height[i]) / unit : contact->gap[k];
        weight[i] = w->changed[i] ? sqrt(memory->evolved->summit_radius[i] / unit) : contact->weight[k];
    }
    status = hs_join_groups(memory, gap, weight, d, 1);
    if (status == HS_OK && !isnan(load)) memory->normal_load = load;
    return status;
}

/* Have those stand alone that yield on the path, and all be ready to follow them in chords. */
static int prepare_to_yield(walk *w, hs_memory *memory, hs_memory *spare[2]) {
    const hs_evolved *evolved = memory->evolved;
    int status = hs_those_to_yield(memory, w->evolution, w->course.d[1], w->changed);
    for (int pass = 0; pass < 2 && status == HS_OK; ++pass) {
        evolved = memory->evolved;
        const double *height = pass ? evolved->summit_height : evolved->virgin_height;
        const double *radius = pass ? evolved->summit_radius : evolved->virgin_radius;
        for (int64_t i = 0; i < memory->contact->count; ++i) {
            w->first[i] = w->changed[i] ? height[i] : HUGE_VAL;
            w->last[i] = w->changed[i] ? radius[i] : 0.0;
        }
        status = hs_part_ways(memory, w->first, w->last);
    }
    if (status == HS_OK) status = own_contact(memory);
    w->parted = 1;
    return status == HS_OK ? make_spares(w, memory, spare) : status;
}

/* Have groups be one again that have parted as they yielded, once all of them slide. */
static int join(walk *w, hs_memory *memory) {
    const hs_contact *contact = memory->contact;
    for (int64_t k = 0; k < contact->count; ++k) {
        w->first[contact->order[k]] = contact->gap[k];
        w->last[contact->order[k]] = contact->weight[k];
    }
    w->parted = 0;
    return hs_join_groups(memory, w->first, w->last, memory->approach, 0);
}

/* The part of a path before its first summit yields. */
static hs_path path_to_onset(const walk *w, const hs_path *path) {
    const route *c = &w->course;
    hs_path leg = *path;
    if (c->both) {
        leg.normal_target = hs_toward(c->load[0], c->load[1], w->onset);
    } else {
        leg.normal_control = HS_DISPLACED;
        leg.normal_target = hs_toward(c->d[0], c->d[1], w->onset);
    }
    leg.tangential_target = hs_toward(c->tangential[0], c->tangential[1], w->onset);
    leg.normal_fraction = leg.tangential_fraction = 1.0;
    return leg;
}

/* Carry a memory along one path, of which rows are recorded. */
static int walk_path(walk *w, hs_memory *memory, hs_memory *spare[2], const hs_path *path, double until,
                     hs_recorder *recorder, int *flag, hs_refusal *refusal) {
    hs_plan plan;
    int status = HS_OK;
    w->course.first = NULL;
    w->onset = HUGE_VAL;
    if (w->alone && w->parted && hs_slides_alike(memory)) {
        status = join(w, memory);
        recorder->contact = NULL;
    }
    if (status == HS_OK) status = begin_course(w, memory, path);
    int still = status == HS_OK && is_still(w, memory), held = 0;
    int yields = w->onset < 1.0, at_rest = 0;
    double before = 0.0, elastic = yields ? w->onset : 1.0, first = until / (double)path->parts;
    if (status == HS_OK && still && elastic > 0.0) {
        hs_path leg = yields ? path_to_onset(w, path) : *path;
        int direct = yields ? first >= elastic : path->parts == 1 && until == 1.0;
        status = hs_planned(memory, &leg, w->compliance, w->drive->saturate, direct, &plan, refusal);
    }
    for (int64_t part = 1; part <= path->parts && status == HS_OK; ++part) {
        double share = until * ((double)part / (double)path->parts), end = hs_least(share, elastic);
        if (before < end) {
            if (!still)
                status = settle(w, memory, spare[0], spare[1], before, end, refusal);
            else if (w->alone)
                status = hs_walk_on(memory, &plan, before / elastic, end / elastic, w->drive->tolerance, &held);
            else
                status = walk_still(w, memory, spare, &plan, before / elastic, end / elastic, refusal, &held);
            before = end;
        }
        if (status == HS_OK && share > elastic) {
            if (before == elastic) {
                at_rest = yields_at_rest(w, memory);
                if (!at_rest) status = prepare_to_yield(w, memory, spare);
            }
            if (status != HS_OK) break;
            status = at_rest ? yield_at_rest(w, memory, share)
                             : settle(w, memory, spare[0], spare[1], before, share, refusal);
            before = share;
        }
        if (status != HS_OK) break;
        *flag |= memory->excess != 0.0;
        if (recorder->rows && (part < path->parts || path->recorded)) {
            /* its asperities may stand in another order now */
            if (!w->alone || share > elastic) recorder->contact = NULL;
            status = hs_record(recorder, memory, path->first_row + part - 1, *flag);
            *flag = 0;
        }
    }
    hs_contact_free(w->course.first);
    if (yields) {
        recorder->contact = NULL;
        w->next = NAN;
    }
    memory->normal_control = path->normal_control;
    memory->tangential_control = path->tangential_control;
    return status;
}

int hs_walk_evolving(hs_memory *memory, const hs_path *paths, int64_t count, const hs_rows *rows, const hs_drive *drive,
                     double until, const hs_evolution *evolution, hs_refusal *refusal) {
    hs_memory *spare[2] = {NULL, NULL};
    hs_recorder recorder;
    const hs_law *law = &evolution->law;
    walk w;
    int flag = 0, status = hs_memory_join(memory);
    if (status == HS_OK) status = part_as_they_evolve(memory, evolution);
    if (status != HS_OK) return status;
    w.evolution = evolution;
    w.drive = drive;
    w.wears = evolution->wear.kind != HS_NO_WEAR;
    w.yields = evolution->yielding.kind != HS_NO_YIELDING;
    w.yields_now = 0;
    w.onset = HUGE_VAL;
    w.next = NAN;
    w.parted = memory->contact->groups > 1;
    w.alone = w.yields && !w.wears && (law->kind == HS_NO_LAW || law->depends_on == HS_ON_NOTHING) &&
              !evolution->goal && !evolution->follow_sliding;
    w.compliance = drive->compliance * memory->contact->units.stiffness;
    if (make_buffers(&w, memory->contact) != HS_OK) return HS_OUT_OF_MEMORY;
    status = hs_begin_recording(&recorder, memory->contact, rows);
    if (status == HS_OK && !w.alone) {
        /* it changes places with copies whose summits change */
        if (w.wears || w.yields) status = own_contact(memory);
        if (status == HS_OK) status = make_spares(&w, memory, spare);
    }
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        hs_path path = hs_without_dimension(&memory->contact->units, paths + p);
        refusal->path = p;
        status = walk_path(&w, memory, spare, &path, until, &recorder, &flag, refusal);
    }
    for (int k = 0; k < 2; ++k) hs_memory_free(spare[k]);
    hs_end_recording(&recorder);
    free_buffers(&w);
    return status;
}

int hs_set_summits(hs_memory *memory, const double *summit_height, const double *summit_radius, const uint8_t *fresh,
                   const hs_evolution *evolution) {
    int64_t count = memory->contact->count;
    size_t size = (size_t)count * sizeof(double);
    int status = hs_memory_join(memory);
    if (status != HS_OK) return status;
    hs_evolved *evolved = memory->evolved;
    double stored = hs_stored(memory, NULL), erased = 0.0;
    for (int64_t i = 0; i < count; ++i)
        erased += fresh[memory->contact->order[i]] && memory->contact->gap[i] < memory->approach;
    /* they may be the memory's own, which moves when groups part */
    memmove(evolved->summit_height, summit_height, size);
    memmove(evolved->summit_radius, summit_radius, size);
    for (int64_t i = 0; i < count; ++i)
        if (fresh[i]) evolved->shaped_volume[i] = evolved->waiting_volume[i] = 0.0;
    walk w;
    w.evolution = evolution;
    w.yields = evolution->yielding.kind != HS_NO_YIELDING;
    w.yields_now = 0;
    if (make_buffers(&w, memory->contact) != HS_OK) return HS_OUT_OF_MEMORY;
    for (int64_t i = 0; i < count && w.yields; ++i)
        if (fresh[i]) {
            evolved->virgin_height[i] = evolved->summit_height[i];
            evolved->virgin_radius[i] = evolved->summit_radius[i];
            evolved->yielded_to[i] = evolved->yielding_load[i] = 0.0;
        }
    if (w.yields) status = hs_yield_to(memory, evolution, memory->approach, w.changed);
    free_buffers(&w);
    if (status == HS_OK) status = part_as_they_evolve(memory, evolution);
    double *gap = (double *)malloc(2 * size), *weight = gap + count;
    if (!gap) return HS_OUT_OF_MEMORY;
    evolved = memory->evolved;
    for (int64_t i = 0; i < count; ++i) {
        gap[i] = (memory->contact->datum - evolved->summit_height[i]) / memory->contact->units.length;
        weight[i] = sqrt(evolved->summit_radius[i] / memory->contact->units.radius);
    }
    if (status == HS_OK) status = hs_reshape(memory, gap, weight, fresh);
    free(gap);
    if (status != HS_OK) return status;
    memory->evolved->erased_memories += erased;
    memory->evolved->erased_energy += (stored - hs_stored(memory, NULL)) * memory->contact->units.energy;
    if (make_buffers(&w, memory->contact) != HS_OK) return HS_OUT_OF_MEMORY;
    status = put_stations(&w, memory, memory->approach, memory->normal_load, 1.0, NULL);
    if (status == HS_OK) {
        memcpy(memory->friction, w.friction, (size_t)memory->contact->groups * sizeof(double));
        hs_tell_steep(memory);
    }
    free_buffers(&w);
    return status;
}
