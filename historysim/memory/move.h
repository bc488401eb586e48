/* Move: all groups on one straight path in approach and displacement. */
#ifndef HISTORYSIM_MOVE_H
#define HISTORYSIM_MOVE_H

#include "displacement.h"

/* Move a memory on a straight path to approach d, where the normal load is `load`, and to a target within the friction limit. */
int hs_move(hs_line *memory, double d, double load, hs_target target);
/* The same with the groups' loads at d, and with the target of the path in (d, V). */
int hs_move_with_loads(hs_line *memory, const hs_group_loads *loads, double d, double load, hs_target target, hs_target path);
/* Move one group, whose coefficient changes linearly from `friction` to that of `group`, and record what first slides. `scratch`
 * has room for twice `hs_room_to_clip`, of a polyline that is steep or of a coefficient that changes; losses may be NULL. */
int hs_move_group(hs_line *memory, const hs_group *group, hs_losses *losses, int64_t index, double friction, hs_point from,
                   hs_point to, double load, hs_target target, hs_vertex *scratch, double *reached);
/* Flag each group whose polyline is steeper than μ. */
void hs_flag_steep(hs_line *memory);
/* Whether there is a single group, not steep: one update moves it to any target. */
int hs_has_single_group(const hs_line *memory);
/* Ensure room for the vertices that the next path adds. */
int hs_reserve_vertices(hs_line *memory);

#endif
