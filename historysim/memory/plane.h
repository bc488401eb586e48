/* Plane: interface of motion in two tangential directions, along one line or by rings, for handle.c
 * and serial.c. Functions correspond to those of `historysim.h` with the same endings. */
#ifndef HISTORYSIM_PLANE_H
#define HISTORYSIM_PLANE_H

#include "line.h"
#include "rings.h"

void hs_plane_free(hs_plane *plane);
/* Add a class of asperities at positions from `offset` up to, but without `stop`. It has no nodes;
 * NULL if out of memory. */
hs_ring_class *hs_add_class(hs_state *state, int64_t group, int64_t offset, int64_t stop);
int hs_plane_integrate(hs_state *state, const hs_path *paths, int64_t count, const hs_rows *rows,
                       const hs_drive *drive, double stop_fraction, hs_refusal *refusal);
/* Integrate one path without a copy of the state if its approach grows and no spring slips. Returns
 * a status; `sticks` false if springs may slip, and the state is unchanged. */
int hs_plane_stick(hs_state *state, const hs_path *requested, const hs_drive *drive, int *sticks);
int hs_plane_read(const hs_state *state, const hs_rows *rows, int64_t row);
double hs_plane_stored_energy(const hs_state *state);
int hs_plane_set_friction(hs_state *state, const double *friction, const hs_drive *drive);

#endif
