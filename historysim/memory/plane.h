/* Plane: motion in two tangential directions, along one line or by rings; what handle.c and serial.c call of it. Functions do what
 * those of `historysim.h` with the same endings do for a state. */
#ifndef HISTORYSIM_PLANE_H
#define HISTORYSIM_PLANE_H

#include "line.h"
#include "rings.h"

void hs_plane_free(hs_plane *plane);
/* Add a class of asperities at positions from `start` up to `end`, without nodes. */
hs_class *hs_add_class(hs_state *state, int64_t group, int64_t start, int64_t end);
int hs_plane_integrate(hs_state *state, const hs_path *paths, int64_t count, const hs_rows *rows, const hs_drive *drive,
                       double until, hs_refusal *refusal);
int hs_plane_read(const hs_state *state, const hs_rows *rows, int64_t row);
double hs_plane_stored_energy(const hs_state *state);
int hs_plane_set_friction(hs_state *state, const double *friction, const hs_drive *drive);

#endif
