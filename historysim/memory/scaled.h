/* Scaled: several friction coefficients at a constant approach as one of 1 (README.md, theory 12).
 */
#ifndef HISTORYSIM_SCALED_H
#define HISTORYSIM_SCALED_H

#include "state.h"

/* True if a path, in dimensionless targets, needs no change of the representation of a memory. */
int hs_is_represented(const hs_line *memory, const hs_path *path);
/* Scale the contact for a path at constant approach, or restore its groups for another one, and
 * make the path one of the active line; returns a status. */
int hs_represent(hs_line *memory, hs_path *path);
/* Copy the scalars of the scaled line, after a path, to its memory. */
void hs_update_from_scaled(hs_line *memory);
/* Write the polylines of all groups, and remove the scaled line; returns a status. */
int hs_line_restore_groups(hs_line *memory);
/* Allocate the scaled line, with `depth` vertices that are not filled; returns a status. */
int hs_line_add_scaled(hs_line *memory, int64_t depth);

#endif
