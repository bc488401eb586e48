/* Scaled: several friction coefficients at a constant approach as one of 1 (README.md, theory 12).
 */
#ifndef HISTORYSIM_SCALED_H
#define HISTORYSIM_SCALED_H

#include "state.h"

/* True if a path, in dimensionless targets, needs no change of the representation of a memory. */
int hs_is_represented(const hs_line *memory, const hs_path *path);
/* Scale the contact for a path at constant approach, or restore its groups for another one; `line`
 * returns the line on which it goes, and the path becomes one of that. Returns a status. */
int hs_represent(hs_line *memory, hs_path *path, hs_line **line);
/* Copy the scalars of the line of a path to its memory. */
void hs_update_from(hs_line *memory, const hs_line *line);
/* Scale the contact at approach d, with normal load `load`, without its groups if it does not touch
 * or is scaled, and is unstrained at the target; `is_done` returns 0 if it is not. Returns a
 * status.
 */
int hs_press_unstrained(hs_line *memory, double d, double load, hs_target target, int *is_done);
/* Write the polylines of all groups, and remove the scaled line; returns a status. */
int hs_line_restore_groups(hs_line *memory);
/* Allocate the scaled line, with `depth` vertices that are not filled; returns a status. */
int hs_line_add_scaled(hs_line *memory, int64_t depth);

#endif
