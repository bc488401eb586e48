/* How far asperities slide on a straight way: while all of their springs slip. */

#include "chord.h"

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
void hs_slide_on(const hs_group *group, int64_t depth, const double *gap, const int64_t *whose, way on, double unit,
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

int hs_slide_all(walk *w, hs_memory *memory, const chord_end *end, int ahead) {
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
            hs_slide_on(&group, depth, w->gap, contact->order + group.start, on, contact->units.displacement,
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
        /* it is only tried */
        const hs_clock clock = memory->clock;
        hs_set_clock(memory, NAN);
        int status = hs_carry_by_stations(w, memory, g, end, w->discarded, &losses);
        memory->clock = clock;
        if (status != HS_OK) return status;
        memcpy(memory->vertices + g * memory->capacity, w->kept, (size_t)depth * sizeof *w->kept);
        memory->depth[g] = depth;
        memory->steep[g] = steep;
    }
    return HS_OK;
}

void hs_add_slides(const walk *w, hs_memory *memory) {
    hs_evolved *evolved = memory->evolved;
    double together = HUGE_VAL;
    for (int64_t i = 0; i < memory->contact->count; ++i) {
        evolved->slid_distance[i] += w->slid[i];
        if (w->gap[i] < memory->approach) together = hs_least(together, w->slid[i]);
    }
    if (together < HUGE_VAL) evolved->slid_together += together;
}
