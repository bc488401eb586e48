/* Chord: one step of a path on which asperities evolve. From the state at its start it computes the
 * friction of each group at stations, which are denser towards first touch, how far asperities
 * slide, and the end of the step, and moves all groups there by the update of a cone that changes
 * linearly (README.md, theory 2 and 7). */

#include "chord.h"
#include "bracket.h"
#include "contact.h"
#include "shape.h"

/* Ratio of the approaches of adjacent stations, less 1, over the length of the substep as a
 * fraction of the path: so twice as many substeps have twice as many stations, and do not agree
 * because both have the same; chosen. The same on a substep from first contact on, with stations
 * that are farther apart there; and a ratio over a substep that needs none. */
#define STATION_SPACING 1.6
#define TOUCH_SPACING 0.2
#define SLIGHT 1.03
#define MAX_EVEN_STATIONS 8
#define MOST_STATIONS 16
/* crossings of the friction limit on one chord, and steps of the search for one */
#define MOST_CROSSINGS 4
#define MOST_TURNS 100
/* stands for a coefficient that a law is asked for */
#define ASKED (-1.0)

hs_line *hs_copy_to_change(const walk *w, const hs_line *memory) {
    hs_line *copy = hs_line_copy(memory);
    if (!copy || !(w->wears || w->yields) || hs_line_unshare_contact(copy) == HS_OK) return copy;
    hs_line_free(copy);
    return NULL;
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
    for (size_t k = 0; k < 4 && w->most; ++k)
        memcpy(asked[k], w->asked[k], 2 * (size_t)w->most * sizeof(double));
    free(w->stations);
    w->stations = grown;
    w->most = (int64_t)most;
    memcpy(w->asked, asked, sizeof asked);
    return HS_OK;
}

/* Ask a law for the coefficient of an asperity at an approach of its own. */
static void ask(walk *w, int64_t number, const hs_contact *contact, double weight, double own,
                double slid) {
    w->asked[0][number] = weight * sqrt(own) * own * contact->units.load;
    w->asked[1][number] = weight * weight * contact->units.radius;
    w->asked[2][number] = slid;
}

int hs_set_stations(walk *w, const hs_line *memory, double d, double load, double share,
                    const double *ahead) {
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
        if (by_law && !evolved->friction_overridden[whose]) {
            double start = starts_at(w, memory, index) - contact->gap[i], end = d - contact->gap[i];
            double weight = contact->weight[i];
            double most = hs_max(start, end), least = hs_max(hs_min(start, end), 0.0),
                   at[MOST_STATIONS];
            double own = start, slid = evolved->slid_distance[whose] + (ahead ? ahead[whose] : 0.0);
            int between = 0, bends = law->depends_on == HS_ON_OWN_LOAD && most > SLIGHT * least;
            double spacing = hs_max(STATION_SPACING * w->substep_length,
                                    (most - least) / (MAX_EVEN_STATIONS * least));
            double ratio = 1.0 + (least > 0.0 ? spacing : TOUCH_SPACING);
            for (double next = most / ratio;
                 bends && next > least && between < MOST_STATIONS - 1;) {
                at[between++] = next;
                next /= between < MAX_EVEN_STATIONS ? ratio : between < 12 ? 4.0 : 64.0;
            }
            /* what begins to slide keeps its friction until then */
            double still = ahead && start > 0.0 && end > 0.0 ? 1.0 - ahead[whose] / w->moved : 0.0;
            if (law->depends_on == HS_ON_SLID_DISTANCE && still > 0.0 && still < 1.0) {
                w->stations[count++] = HS_MADE(station){still, friction, friction};
            }
            for (int k = 0; k <= between; ++k) {
                station *here = w->stations + count++;
                double last = own;
                own = k == between ? end : at[end > start ? between - 1 - k : k];
                here->share = k == between ? 1.0 : (own - start) / (end - start);
                int touches = own > 0.0 && (load > 0.0 || law->depends_on != HS_ON_TOTAL_LOAD);
                here->friction = touches ? ASKED : 0.0;
                here->amid = bends && touches ? ASKED : 0.0;
                if (touches && bends)
                    ask(w, asked++, contact, weight, 0.5 * (hs_max(last, 0.0) + own), slid);
                if (touches) ask(w, asked++, contact, weight, own, slid);
            }
        } else {
            w->stations[count++] = HS_MADE(station){1.0, 0.0, friction};
        }
    }
    w->first_station[contact->groups] = count;
    hs_loaded loaded = {asked, w->asked[0], w->asked[1], w->asked[2], load * contact->units.load};
    int status =
        asked ? hs_coefficients(law, evolution->contact_modulus, &loaded, w->asked[3]) : HS_OK;
    for (int64_t k = 0, answer = 0; k < count && asked; ++k) {
        if (w->stations[k].amid == ASKED) w->stations[k].amid = w->asked[3][answer++];
        if (w->stations[k].friction == ASKED) w->stations[k].friction = w->asked[3][answer++];
    }
    for (int64_t index = 0; index < contact->groups; ++index)
        w->friction[index] = w->stations[w->first_station[index + 1] - 1].friction;
    for (int64_t g = 0; g < contact->groups && w->yield.now; ++g)
        for (int64_t k = w->first_station[g]; k < w->first_station[g + 1]; ++k) {
            double more = (steeper(w, memory, g) - 1.0) * (1.0 - w->stations[k].share);
            w->stations[k].friction *= 1.0 + more;
            w->stations[k].amid *= 1.0 + more;
        }
    return status;
}

/* Shares of a way between which a spring slips. */
typedef struct interval {
    double begin, end;
    double slip;
} interval;

/* When a spring slips: from where it meets its limit, until the limit grows faster than the spring
 * is moved.
 *
 * With y = L - s v, what is left of its limit, as a quadratic in the share through start, middle
 * and end, those are the first root of y and the root of y'. Without a change of friction y is
 * linear. */
static interval slipping(const way *on, double label, double anchor) {
    const double *friction = on->friction;
    double d = 0.5 * (on->from.d + on->to.d), v = 0.5 * (on->from.v + on->to.v);
    double first = friction[0] * (on->from.d - label) - on->side * (on->from.v - anchor);
    double amid = friction[1] * (d - label) - on->side * (v - anchor);
    double last = friction[2] * (on->to.d - label) - on->side * (on->to.v - anchor);
    if (friction[0] == friction[2] && friction[1] == friction[2]) {
        interval straight = {HUGE_VAL, 1.0, 0.0};
        if (first > last) straight.begin = hs_max(first, 0.0) / (first - last);
        if (straight.begin < 1.0) straight.slip = (1.0 - straight.begin) * (first - last);
        return straight;
    }
    double linear = 4.0 * amid - 3.0 * first - last, square = 2.0 * (first + last - 2.0 * amid);
    double under = linear * linear - 4.0 * hs_max(first, 0.0) * square;
    interval found = {HUGE_VAL, 1.0, 0.0};
    if (under < 0.0) return found;
    if (linear < 0.0)
        found.begin = 2.0 * hs_max(first, 0.0) / (sqrt(under) - linear);
    else if (square < 0.0)
        found.begin = (linear + sqrt(under)) / (-2.0 * square);
    if (linear < 0.0 && 2.0 * square > -linear) found.end = linear / (-2.0 * square);
    if (found.begin < found.end)
        found.slip = -(found.end - found.begin) * (linear + square * (found.end + found.begin));
    return found;
}

static void forget_sliding(walk *w, int64_t asperity) {
    w->slid[asperity] = 0.0;
    w->slides_from[asperity] = HUGE_VAL;
    w->slides_to[asperity] = -HUGE_VAL;
}

/* Shares of a chord outside which some asperity sticks, or nothing touches: sticking begins or ends
 * there, as a rule. */
typedef struct common_slide {
    double begin, end;
} common_slide;

static void exclude(common_slide *all, double from, double to) {
    if (!(from < to)) return;
    if (from <= all->begin)
        all->begin = hs_max(all->begin, to);
    else if (to >= all->end || all->end - to < from - all->begin)
        all->end = hs_min(all->end, from);
    else
        all->begin = to;
}

double hs_slid_together(const walk *w, const hs_line *memory, const chord_end *end) {
    const hs_contact *contact = memory->contact;
    common_slide all = {0.0, 1.0};
    double touches = HUGE_VAL, leaves = -HUGE_VAL, deepest = hs_max(memory->approach, end->d);
    if (end->v == memory->displacement) return 0.0;
    for (int64_t g = 0; g < contact->groups && all.begin < all.end; ++g) {
        double from = starts_at(w, memory, g), sunk = end->d - from;
        if (contact->gap[contact->first[g]] >= deepest) break;
        for (int64_t k = contact->first[g]; k < contact->first[g + 1]; ++k) {
            int64_t i = contact->order[k];
            double gap = w->gap[i];
            if (gap >= hs_max(from, end->d)) continue;
            double first = gap < from ? 0.0 : (gap - from) / sunk,
                   last = gap < end->d ? 1.0 : (from - gap) / -sunk;
            touches = hs_min(touches, first);
            leaves = hs_max(leaves, last);
            exclude(&all, first, hs_min(w->slides_from[i], last));
            exclude(&all, hs_max(w->slides_to[i], first), last);
        }
    }
    exclude(&all, 0.0, touches);
    exclude(&all, leaves, 1.0);
    double share = touches < leaves ? hs_max(all.end - all.begin, 0.0) : 0.0;
    return fabs(end->v - memory->displacement) * share * contact->units.displacement;
}

/* Add to `w->slid` how far the asperities of a group slide as a whole on a straight part of a
 * chord, ∫|dV|, and note between which shares of the chord they do.
 *
 * When a spring begins to slip is a quotient of functions that are linear in the label between
 * vertices, so that the last to slip is at a vertex, or the innermost. New springs slip at once, if
 * at all. */
static void slide_on(walk *w, const hs_group *group, int64_t depth, way on, int steep) {
    const hs_contact *contact = group->memory->contact;
    const int64_t *whose = contact->order + group->start;
    const double *gap = w->gap, unit = contact->units.displacement;
    /* within a cone that stays as it is the innermost is the last */
    int inmost_last =
        !steep && on.friction[0] == on.friction[2] && on.friction[0] == on.friction[1];
    double moved = on.to.v - on.from.v, sunk = on.to.d - on.from.d,
           tie = 1e-12 * (fabs(on.from.v) + fabs(on.to.v));
    if (moved == 0.0) return;
    double edge = hs_min(on.from.d, on.to.d);
    double fall = on.friction[0] * (on.from.d - edge) - on.friction[2] * (on.to.d - edge);
    for (int against = 0; against < 2; ++against) {
        on.side = copysign(1.0, against ? -moved : moved);
        interval all = {0.0, 1.0, 0.0};
        int64_t j = depth - 1;
        if (sunk > 0.0 && on.side * moved <= on.friction[2] * sunk) continue;
        for (int64_t i = group->curve.count - 1; i >= 0; --i) {
            double h = gap[whose[i]];
            interval own = {(h - on.from.d) / sunk, 1.0, HUGE_VAL};
            if (h >= hs_max(on.from.d, on.to.d)) continue;
            if (h < on.from.d) {
                if (depth == 0) continue;
                for (; j >= 0 && group->stack[j].label > h; --j) {
                    if (inmost_last) continue;
                    interval outer = slipping(&on, group->stack[j].label, group->stack[j].anchor);
                    double leaves = (on.from.d - group->stack[j].label) / -sunk;
                    /* what leaves holds nothing back afterwards */
                    int stays = group->stack[j].label <= on.to.d;
                    all.begin =
                        hs_max(all.begin, stays ? outer.begin : hs_min(outer.begin, leaves));
                    if (stays) all.end = hs_min(all.end, outer.end);
                }
                const hs_vertex *above = group->stack + (j + 1 < depth ? j + 1 : j);
                own = slipping(&on, h, above->anchor - above->slope * (above->label - h));
                own.begin = hs_max(own.begin, all.begin);
                own.end = hs_min(own.end, h > on.to.d ? (on.from.d - h) / -sunk : all.end);
            }
            if (!(own.begin < own.end && own.slip > tie)) continue;
            w->slid[whose[i]] += fabs(moved) * (own.end - own.begin) * unit;
            w->slides_from[whose[i]] =
                hs_min(w->slides_from[whose[i]], hs_toward(on.share[0], on.share[1], own.begin));
            w->slides_to[whose[i]] =
                hs_max(w->slides_to[whose[i]], hs_toward(on.share[0], on.share[1], own.end));
        }
        /* against the way springs slip only where their limit falls faster than they move */
        double inmost = group->curve.gap[0];
        fall = hs_max(fall,
                      on.friction[0] * (on.from.d - inmost) - on.friction[2] * (on.to.d - inmost));
        if (fall <= fabs(moved)) return;
    }
}

/* Approach and normal load at a share of the path.
 *
 * Of two loads both go straight. Otherwise the approach does, as the contact at the start has it;
 * where wear has changed that, a normal load keeps the values that it had then. */
static void normal_at(const walk *w, const hs_line *memory, double share, double *d, double *load) {
    const route *c = &w->course;
    if (c->both_loads) {
        *load = hs_toward(c->load[0], c->load[1], share);
        *d = hs_approach_at_load(memory, *load);
        return;
    }
    *d = hs_toward(c->d[0], c->d[1], share);
    if (c->normal_by_load) {
        *load = share == 1.0
                    ? c->load[1]
                    : hs_load_at(hs_all_of(c->first ? c->first : memory->contact), *d).load;
        /* a gap is closed on the straight path, on which nothing wears */
        if (w->wears && (*load > 0.0 || memory->normal_load > 0.0))
            *d = hs_approach_at_load(memory, *load);
    } else {
        *load = hs_load_at(hs_all_of(memory->contact), *d).load;
    }
}

/* Find the displacement at which a chord ends. */
static int find_end(walk *w, hs_line *memory, double share, chord_end *end) {
    const route *c = &w->course;
    const hs_contact *contact = memory->contact;
    double value = hs_toward(c->tangential[0], c->tangential[1], share), limit = 0.0;
    /* where asperities wear, the loads are known when they have their shapes */
    int changes = 0, weighs = !w->wears || c->tangential_by_load || w->compliance > 0.0;
    hs_group_loads loads;
    loads.load = w->load;
    loads.from = w->yield.now ? w->edge : NULL;
    loads.count = 0;
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < end->d;
         ++g, ++loads.count) {
        w->edge[g] = starts_at(w, memory, g);
        changes |= w->friction[g] != memory->friction[g] || steeper(w, memory, g) != 1.0;
        if (!weighs) continue;
        w->load[g] = contact->groups == 1 ? end->load
                                          : hs_load_at(hs_group_of(memory, g).curve, end->d).load;
        limit += w->friction[g] * w->load[g];
    }
    int by_load = c->tangential_by_load && !(c->straight && share < c->piece[1]);
    end->touching = loads.count;
    end->excess = 0.0;
    end->request = value;
    end->limit = limit;
    end->force = by_load && (!c->ends_separated || share == 1.0) ? value : NAN;
    if (c->ends_separated || (!c->tangential_by_load && w->compliance == 0.0)) {
        end->v = c->ends_separated ? hs_toward(c->apart[0], c->apart[1], share) : value;
        return HS_OK;
    }
    if (c->straight && share < c->piece[1]) {
        end->v =
            hs_toward(c->aim[0], c->aim[1], (share - c->piece[0]) / (c->piece[1] - c->piece[0]));
        return HS_OK;
    }
    if (by_load && c->straight && c->ends_at_limit) end->force = value = c->ends_at_limit * limit;
    hs_target target = {value, 1.0, w->compliance};
    if (c->tangential_by_load) {
        if (fabs(value) >= (1.0 - HS_LIMIT_SLACK) * limit && !c->straight)
            end->force = copysign(limit, value);
        if (fabs(value) - limit > HS_LIMIT_SLACK * limit) {
            if (!w->drive->saturate) {
                w->refusal->request = value * contact->units.load;
                w->refusal->limit = limit * contact->units.load;
                return HS_BEYOND_LIMIT;
            }
            end->force = copysign(limit, value);
            end->excess = value - end->force;
        }
        target = hs_to_load(end->force);
    }
    hs_fronts fronts;
    int status = hs_init_fronts(&fronts, loads.count);
    if (status != HS_OK) return status;
    if (!changes || loads.count == 0) {
        status = hs_solve_displacement_with(memory, &loads, &fronts, end->d, target, &end->v);
    } else {
        /* any cone may cut any polyline */
        double *kept = memory->friction;
        memcpy(w->steep, memory->steep, (size_t)contact->groups);
        memset(memory->steep, 1, (size_t)contact->groups);
        memory->friction = w->friction;
        status = hs_search_displacement(memory, &loads, &fronts, end->d, target, &end->v);
        memory->friction = kept;
        memcpy(memory->steep, w->steep, (size_t)contact->groups);
    }
    hs_free_fronts(&fronts);
    /* what slides already while its limit falls stays where it is */
    double side = copysign(1.0, end->force);
    int at_limit = c->tangential_by_load && fabs(end->force) >= (1.0 - HS_TIE) * limit;
    if (loads.count == 0 && end->excess == 0.0) at_limit = 0;
    if (at_limit && (loads.count == 0 || side * end->v < side * memory->displacement))
        end->v = memory->displacement;
    return status;
}

/* Have room for a stack to be clipped, and for what is added to it otherwise. */
static int make_room(walk *w, hs_line *memory, int64_t depth) {
    int64_t room = 2 * hs_room_to_clip(depth);
    if (room > w->room) {
        free(w->scratch);
        w->scratch = (hs_vertex *)malloc(2 * (size_t)room * sizeof *w->scratch);
        w->room = w->scratch ? 2 * room : 0;
    }
    if (!w->scratch) return HS_OUT_OF_MEMORY;
    return depth + 2 > memory->capacity ? hs_line_reserve(memory, 2 * (depth + 2)) : HS_OK;
}

/* Carry one group on a straight way, with its coefficient going straight, too; what it loses goes
 * to `each`, position 0. */
static int carry_group(walk *w, hs_line *memory, int64_t index, const way *on, double load,
                       double *each, hs_losses *losses) {
    double reached;
    if (make_room(w, memory, memory->depth[index]) != HS_OK) return HS_OUT_OF_MEMORY;
    hs_group group = hs_group_of(memory, index);
    group.asperity_energy = each + group.start;
    group.friction = on->to.d <= group.curve.gap[0] ? on->friction[0] : on->friction[2];
    return hs_move_group(memory, &group, losses, index, on->friction[0], on->from, on->to, load,
                         hs_to_displacement(on->to.v), w->scratch, &reached);
}

/* Carry one group to the end of a chord from station to station; where its friction bends, what it
 * slides is found, too. */
static int carry_by_stations(walk *w, hs_line *memory, int64_t g, const chord_end *end,
                             double *each, hs_losses *losses) {
    const hs_contact *contact = memory->contact;
    hs_point from = {starts_at(w, memory, g), memory->displacement}, to = {end->d, end->v};
    int64_t stations = w->first_station[g + 1] - w->first_station[g], first = contact->first[g];
    const station *at = w->stations + w->first_station[g];
    way on = {from, from, {memory->friction[g] * steeper(w, memory, g), 0.0, 0.0}, 1.0, {0.0, 0.0}};
    const hs_clock clock = memory->clock;
    int bends = at->amid > 0.0, status = HS_OK;
    for (int64_t k = first; bends && k < contact->first[g + 1]; ++k)
        forget_sliding(w, contact->order[k]);
    memory->clock.end = clock.begin;
    for (int64_t k = 0; k < stations && status == HS_OK; ++k) {
        hs_group group = hs_group_of(memory, g);
        hs_tick(memory, hs_toward(clock.begin, clock.end, at[k].share));
        int last = k + 1 == stations;
        on.to.d = last ? to.d : hs_toward(from.d, to.d, at[k].share);
        on.to.v = last ? to.v : hs_toward(from.v, to.v, at[k].share);
        on.friction[2] = at[k].friction;
        if (memory->depth[g] == 0) on.friction[0] = on.friction[2];
        if (on.to.d <= group.curve.gap[0]) on.friction[2] = on.friction[0];
        on.friction[1] = at[k].amid > 0.0 ? at[k].amid : 0.5 * (on.friction[0] + on.friction[2]);
        double load =
            last && g < end->touching ? w->load[g] : hs_load_at(group.curve, on.to.d).load;
        on.share[1] = at[k].share;
        if (bends) slide_on(w, &group, memory->depth[g], on, memory->steep[g]);
        status = carry_group(w, memory, g, &on, load, each, losses);
        on.from = on.to;
        on.share[0] = on.share[1];
        on.friction[0] = on.friction[2];
    }
    memory->clock = clock;
    return status;
}

int hs_solve_slid_distances(walk *w, hs_line *memory, const chord_end *end, int ahead) {
    const hs_contact *contact = memory->contact;
    way on = {{memory->approach, memory->displacement},
              {end->d, end->v},
              {0.0, 0.0, 0.0},
              1.0,
              {0.0, 1.0}};
    for (int64_t i = 0; i < contact->count; ++i) forget_sliding(w, i);
    for (int64_t g = 0; g < contact->groups; ++g) {
        hs_group group = hs_group_of(memory, g);
        int64_t depth = memory->depth[g];
        if (group.curve.gap[0] >= hs_max(on.from.d, on.to.d)) break;
        on.from.d = starts_at(w, memory, g);
        on.friction[0] = group.friction * steeper(w, memory, g);
        on.friction[2] = g < end->touching ? w->friction[g] : group.friction;
        if (depth == 0) on.friction[0] = on.friction[2];
        on.friction[1] = 0.5 * (on.friction[0] + on.friction[2]);
        if (!ahead || w->stations[w->first_station[g]].amid <= 0.0) {
            slide_on(w, &group, depth, on, memory->steep[g]);
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
        hs_init_losses(&losses, contact->groups);
        /* it is only tried */
        const hs_clock clock = memory->clock;
        hs_set_clock(memory, NAN);
        int status = carry_by_stations(w, memory, g, end, w->discarded, &losses);
        memory->clock = clock;
        if (status != HS_OK) return status;
        memcpy(memory->vertices + g * memory->capacity, w->kept, (size_t)depth * sizeof *w->kept);
        memory->depth[g] = depth;
        memory->steep[g] = steep;
    }
    return HS_OK;
}

void hs_add_slides(const walk *w, hs_line *memory) {
    hs_evolved *evolved = memory->evolved;
    if (!evolved) return;
    for (int64_t i = 0; i < memory->contact->count; ++i) evolved->slid_distance[i] += w->slid[i];
    evolved->slid_together += w->together;
}

/* Carry all groups to the end of a chord. */
static int carry(walk *w, hs_line *memory, const chord_end *end) {
    const hs_contact *contact = memory->contact;
    double deepest = hs_max(memory->approach, end->d);
    hs_losses losses;
    hs_init_losses(&losses, contact->groups);
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < deepest; ++g) {
        int status = carry_by_stations(w, memory, g, end, memory->dissipated_each, &losses);
        if (status != HS_OK) return status;
    }
    /* what was foreseen has shaped the summits */
    if (w->wears) memcpy(w->slid, w->ahead, (size_t)contact->count * sizeof *w->slid);
    w->together = w->wears ? w->together_ahead : hs_slid_together(w, memory, end);
    memcpy(memory->friction, w->friction, (size_t)contact->groups * sizeof(double));
    hs_commit_losses(&losses, memory);
    memory->approach = end->d;
    memory->displacement = end->v;
    memory->normal_load = end->load;
    memory->excess = end->excess;
    memory->tangential_load = hs_total_force(memory);
    if (!isnan(end->force)) memory->tangential_load = end->force;
    return HS_OK;
}

/* Find where a chord ends, and how far asperities slide to there; where they wear, with the shapes
 * that follow: twice. */
static int find_sliding(walk *w, hs_line *memory, double share, chord_end *end, int *slides) {
    const hs_contact *contact = memory->contact;
    const hs_law *law = &w->evolution->law;
    const size_t size = (size_t)contact->count * sizeof(double);
    int by_distance =
        !w->evolution->goal && law->kind != HS_NO_LAW && law->depends_on == HS_ON_SLID_DISTANCE;
    int passes = w->wears ? 2 : by_distance,
        searches = w->course.tangential_by_load || w->compliance > 0.0;
    for (int pass = 0;; ++pass) {
        if (!w->yield.now) normal_at(w, memory, share, &end->d, &end->load);
        int status = hs_set_stations(w, memory, end->d, end->load, share, pass ? w->ahead : NULL);
        if (status == HS_OK) status = find_end(w, memory, share, end);
        if (status != HS_OK) return status;
        w->moved = fabs(end->v - memory->displacement) * contact->units.displacement;
        status = hs_solve_slid_distances(w, memory, end, w->wears && pass < passes);
        if (status != HS_OK) return status;
        for (int64_t i = 0; i < contact->count && !*slides; ++i) *slides = w->slid[i] > 0.0;
        if (pass == passes) return HS_OK;
        if (w->wears) w->together = hs_slid_together(w, memory, end);
        if (pass == 0) {
            memcpy(w->shape.begun, w->slid, size);
            w->together_begun = w->together;
        }
        /* what wears may be held by it: it goes in small jerks then, and slides half the way */
        for (int64_t i = 0; i < contact->count; ++i)
            w->slid[i] = hs_max(w->slid[i], w->wears ? 0.5 * w->shape.begun[i] : 0.0);
        memcpy(w->ahead, w->slid, size);
        w->together_ahead = hs_max(w->together, 0.5 * w->together_begun);
        if (!*slides) return HS_OK;
        if (!w->wears) continue;
        status = hs_predict_wear(w, memory, end);
        if (status != HS_OK) return status;
        hs_set_shape(memory, w->shape.end_height, w->shape.end_radius, w->depth);
        if (searches) hs_refresh_loads(memory);
    }
}

/* Put down friction and loads at the end of a chord on which summits wear: groups may stand in
 * another order there. */
static int weigh_worn(walk *w, const hs_line *memory, double share, chord_end *end) {
    int status = hs_set_stations(w, memory, end->d, end->load, share, w->ahead);
    for (end->touching = 0; end->touching < memory->contact->groups && status == HS_OK;
         ++end->touching) {
        hs_curve curve = hs_group_of(memory, end->touching).curve;
        if (curve.gap[0] >= end->d) break;
        w->load[end->touching] = hs_load_at(curve, end->d).load;
    }
    return status;
}

/* Put down the volumes that asperities have lost on a chord, on which their summits took another
 * shape or not. */
static int lose_volumes(walk *w, hs_line *memory, int shaped) {
    const hs_contact *contact = memory->contact;
    hs_evolved *evolved = memory->evolved;
    const size_t size = (size_t)contact->count * sizeof(double);
    for (int64_t i = 0; i < contact->count; ++i)
        w->shape.energy[contact->order[i]] =
            (memory->dissipated_each[i] - w->before[contact->order[i]]) * contact->units.energy;
    if (!shaped) {
        memset(w->shape.mean_load, 0, size);
        memset(w->shape.taken, 0, size);
    }
    int status = hs_lost_volumes(&w->evolution->wear, contact->count, w->shape.mean_load, w->slid,
                                 w->shape.energy, w->shape.lost);
    for (int64_t i = 0; i < contact->count; ++i) {
        evolved->worn_volume[i] += w->shape.lost[i];
        evolved->waiting_volume[i] += w->shape.lost[i] - w->shape.taken[i];
        evolved->shaped_volume[i] += w->shape.taken[i];
    }
    return status;
}

/* Prepare a chord, and find where it ends and how far asperities slide. */
static int foresee(walk *w, hs_line *memory, double share, chord_end *end, int *slides) {
    const hs_evolved *evolved = memory->evolved;
    const hs_contact *contact = memory->contact;
    const size_t size = (size_t)contact->count * sizeof(double);
    *slides = 0;
    w->yield.now = w->yields && share > w->yield.onset;
    if (w->yield.now) {
        int status = hs_yielding_end(w, memory, share, &end->d, &end->load);
        if (status == HS_OK) status = hs_apply_yielding(w, memory, end->d);
        if (status != HS_OK) return status;
        if (isnan(end->load)) end->load = hs_load_at(hs_all_of(contact), end->d).load;
    }
    hs_store_gaps(w, contact);
    if (w->wears) {
        for (int64_t i = 0; i < contact->count; ++i)
            w->before[contact->order[i]] = memory->dissipated_each[i];
        memcpy(w->shape.end_height, evolved->summit_height, size);
        memcpy(w->shape.end_radius, evolved->summit_radius, size);
        hs_store_depths(w, memory);
    }
    return find_sliding(w, memory, share, end, slides);
}

/* Undo what was foreseen of summits that wear. */
static void forget_foreseen(walk *w, hs_line *memory, double load) {
    if (!w->wears) return;
    hs_set_shape(memory, memory->evolved->summit_height, memory->evolved->summit_radius, w->depth);
    hs_refresh_loads(memory);
    memory->normal_load = load;
}

/* Integrate one chord that was foreseen; `stored` is the elastic energy at its start. */
static int follow(walk *w, hs_line *memory, double share, double stored, chord_end *end,
                  int slides) {
    hs_evolved *evolved = memory->evolved;
    const hs_contact *contact = memory->contact;
    const size_t size = (size_t)contact->count * sizeof(double);
    double erased = 0.0;
    int status = HS_OK, shaped = w->wears && slides;
    hs_tick(memory, hs_toward(w->course.times[0], w->course.times[1], share));
    if (shaped) erased = hs_wear_to(w, memory, w->shape.mid_height, w->shape.mid_radius, stored);
    if (w->wears) status = weigh_worn(w, memory, share, end);
    if (status == HS_OK) status = carry(w, memory, end);
    if (status != HS_OK) return status;
    if (shaped) {
        hs_store_depths(w, memory);
        erased += hs_wear_to(w, memory, w->shape.end_height, w->shape.end_radius,
                             hs_elastic_energy(memory, NULL));
        hs_forget_worn(memory);
        memory->normal_load = end->load;
        if (isnan(end->force)) memory->tangential_load = hs_total_force(memory);
        memcpy(evolved->summit_height, w->shape.end_height, size);
        memcpy(evolved->summit_radius, w->shape.end_radius, size);
        evolved->erased_energy += erased * contact->units.energy;
    }
    if (w->wears) status = lose_volumes(w, memory, shaped);
    hs_add_slides(w, memory);
    return status;
}

/* How far a request is beyond the friction limit on one side, 0 within rounding. */
static double beyond(double request, double limit, double side) {
    double more = side * request - limit;
    return fabs(more) <= HS_LIMIT_SLACK * limit ? 0.0 : more;
}

static double side_beyond(double request, double limit) {
    return beyond(request, limit, 1.0) > 0.0    ? 1.0
           : beyond(request, limit, -1.0) > 0.0 ? -1.0
                                                : 0.0;
}

/* A chord that is foreseen: where it starts, and a copy of that to change where summits yield,
 * otherwise the same. */
typedef struct chord_start {
    const hs_line *memory;
    hs_line *tried;
    double share, request, limit, normal_load;
} chord_start;

/* Foresee a chord that was foreseen to end elsewhere. */
static int try_chord(walk *w, const chord_start *at, double share, chord_end *end, int *slides) {
    hs_line *tried = at->tried;
    const hs_line *start = at->memory;
    int status = HS_OK;
    if (tried != start) {
        hs_contact_assign(tried->contact, start->contact);
        status = hs_line_assign(tried, start);
    } else {
        forget_foreseen(w, tried, at->normal_load);
    }
    return status == HS_OK ? foresee(w, tried, share, end, slides) : status;
}

/* Shorten a chord that was foreseen to end at a share so that it ends where the request first
 * crosses the friction limit. */
static int end_at_crossing(walk *w, const chord_start *at, double *share, chord_end *end,
                           int *slides) {
    double from = side_beyond(at->request, at->limit), to = side_beyond(end->request, end->limit);
    double side = from != 0.0 ? from : to;
    int status = HS_OK;
    hs_bracket root = {at->share, *share, beyond(at->request, at->limit, side),
                       beyond(end->request, end->limit, side), 0};
    if (from == to || root.at_low == 0.0 || root.at_high == 0.0) return HS_OK;
    for (int turn = 0; turn < MOST_TURNS && root.high - root.low > DBL_EPSILON; ++turn) {
        double next = hs_false_position(&root);
        if (next == root.low || next == root.high) break;
        status = try_chord(w, at, next, end, slides);
        if (status != HS_OK) return status;
        *share = next;
        double here = beyond(end->request, end->limit, side);
        if (here == 0.0) return HS_OK;
        hs_narrow(&root, next, here, (here > 0.0) == (root.at_high > 0.0));
    }
    *share = root.high;
    return try_chord(w, at, root.high, end, slides);
}

/* Note from which share on a request is beyond the limit on a side, or within it. */
static void note_side(hs_pieces *pieces, double share, double side) {
    int last = pieces->count - 1;
    if (pieces->side[last] == (int)side) return;
    if (share > (last > 0 ? pieces->end[last - 1] : 0.0)) {
        if (pieces->count == HS_MAX_PIECES) return;
        pieces->end[last] = share;
        pieces->end[++last] = 1.0;
        ++pieces->count;
    }
    pieces->side[last] = (int)side;
}

int hs_chord(walk *w, hs_line *memory, double before, double share) {
    const route *c = &w->course;
    const int crosses =
        w->drive->saturate && c->tangential_by_load && !c->straight && !c->ends_separated;
    for (int turn = 0; before < share; ++turn) {
        w->substep_length = share - before;
        double stored = w->wears ? hs_elastic_energy(memory, NULL) : 0.0, stop = share;
        int slides = 0, copies = crosses && w->yields && share > w->yield.onset;
        chord_start at = {memory, copies ? hs_copy_to_change(w, memory) : memory,
                          before, hs_toward(c->tangential[0], c->tangential[1], before),
                          0.0,    memory->normal_load};
        chord_end end;
        if (!at.tried) return HS_OUT_OF_MEMORY;
        if (crosses) at.limit = hs_friction_limit(memory, memory->approach, memory->normal_load);
        int status = foresee(w, at.tried, stop, &end, &slides);
        if (status == HS_OK && crosses && turn < MOST_CROSSINGS)
            status = end_at_crossing(w, &at, &stop, &end, &slides);
        if (copies) {
            hs_line_swap(memory, at.tried);
            hs_line_free(at.tried);
        }
        if (status == HS_OK) status = follow(w, memory, stop, stored, &end, slides);
        if (status != HS_OK) return status;
        if (w->crossings) {
            double side = side_beyond(at.request, at.limit);
            note_side(w->crossings, before,
                      side != 0.0 ? side : side_beyond(end.request, end.limit));
        }
        before = stop;
    }
    return HS_OK;
}
