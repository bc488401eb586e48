/* Move: exact update of all groups on one straight path in approach and displacement. */
#ifndef HISTORYSIM_MOVE_H
#define HISTORYSIM_MOVE_H

#include "displacement.h"

/* Move a memory on a straight path to approach d, with normal load `load`, and to a target within
 * the friction limit; returns a status. */
int hs_move(hs_line *memory, double d, double load, hs_target target);
/* `hs_move` with the loads of groups at d, and with the `path` target of the groups' updates; with
 * the energies of a ramp, unless its curve is NULL. */
int hs_move_with_loads(hs_line *memory, const hs_group_loads *loads, double d, double load,
                       hs_target target, hs_target path, const hs_ramp_curve *curve);
/* Move one group, whose coefficient changes linearly from `friction` to that of `group`, and record
 * sliding times. `scratch` has room for twice `hs_room_to_clip` vertices, needed for a steep
 * polyline or a changing coefficient; losses may be NULL. */
int hs_move_group(hs_line *memory, const hs_group *group, hs_losses *losses, int64_t index,
                  double friction, hs_point from, hs_point to, double load, hs_target target,
                  hs_vertex *scratch, double *reached);
/* Flag each group whose polyline is steeper than μ. */
void hs_flag_steep(hs_line *memory);
/* True if there is a single group, not steep, so that one update reaches any target. */
int hs_has_single_group(const hs_line *memory);
/* Reserve the vertices that one path may add; returns a status. */
int hs_reserve_vertices(hs_line *memory);

#endif
