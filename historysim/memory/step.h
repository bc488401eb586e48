/* Step: one exact update of all groups, with fields that change linearly. */
#ifndef HISTORYSIM_STEP_H
#define HISTORYSIM_STEP_H

#include "fields.h"

/* Solve for the distances that asperities slide on the straight path to the end of a step. In a
 * trial, groups whose friction bends are moved there and restored; otherwise theirs are found when
 * they are moved. */
int hs_solve_slid_distances(hs_fields *ctx, hs_line *memory, const hs_step_end *step_end,
                            int is_trial);
/* Distance [m] of a step while all asperities in contact slide. */
double hs_solve_common_slide(const hs_fields *ctx, const hs_line *memory,
                             const hs_step_end *step_end);
void hs_add_slides(const hs_fields *ctx, hs_line *memory);
/* Advance a memory from one path fraction to another in one step, or several between crossings of
 * the friction limit. */
int hs_advance_step(hs_fields *ctx, hs_line *memory, double start_fraction, double fraction);

#endif
