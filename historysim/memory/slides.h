/* Slides: the times at which asperities first slide in gross slip. */
#ifndef HISTORYSIM_SLIDES_H
#define HISTORYSIM_SLIDES_H

#include "displacement.h"
#include "state.h"

/* Replace the times of asperities that have slid since `start` by times of another memory, if it
 * has any; returns a status. */
int hs_slides_replace(hs_line *memory, const hs_line *start, const hs_line *source);
/* Record which asperities of a group first slide on a straight path, on which its coefficient
 * changes linearly from `friction` to its present one: those all of whose springs slip at the end,
 * i.e. the springs from `label` to the edge, and those that separate. The stack is the one before
 * the path. If it is `uneven`, springs may reach the limit in any order. */
void hs_find_slides(const hs_group *group, int64_t depth, const hs_point *from, const hs_point *to,
                    double friction, double label, int uneven);
/* Do the same if any asperity can first slide on the path. */
static inline void hs_record_slides(const hs_group *group, int64_t depth, const hs_point *from,
                                    const hs_point *to, double friction, double label, int uneven) {
    const hs_line *memory = group->memory;
    const hs_contact *contact = memory->contact;
    const int64_t highest = group->curve.count - 1;
    /* without friction, springs are at their limit as soon as they are in contact */
    if (group->friction == 0.0) label = group->curve.gap[0];
    const double top = hs_max(from->d, to->d), low = to->d < from->d ? hs_min(label, to->d) : label;
    if (!hs_is_timed(memory) || (low >= memory->slid_labels[0] && top <= memory->slid_labels[1]))
        return;
    if (!contact->query_count &&
        (group->curve.gap[highest] < low ||
         (highest == 0 && hs_has_slid(memory, contact->order[group->start]))))
        return;
    hs_find_slides(group, depth, from, to, friction, label, uneven);
}
/* Record which asperities of several groups first slide on a path to a point on which both loads
 * are linear, as the clock states; with the loads of the groups and the slip fronts there. */
int hs_record_slides_on_ramp(hs_line *memory, hs_point to, const hs_group_loads *loads,
                             hs_fronts *fronts);

#endif
