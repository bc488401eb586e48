/* Line: public functions of `historysim.h` for a memory in one direction, with the same suffixes.
 * The first tangential component of a path is along the line. */
#ifndef HISTORYSIM_LINE_H
#define HISTORYSIM_LINE_H

#include "state.h"

/* ---- readout.c ---- */

int hs_line_read(const hs_line *memory, const hs_rows *rows, int64_t row);
hs_slopes hs_line_slopes(const hs_line *memory, double start);
double hs_line_stored_energy(const hs_line *memory);

/* ---- integrate.c ---- */

int hs_line_step(hs_line *memory, int normal_control, double normal_target, int tangential_control,
                 double tangential_target, const hs_drive *drive, hs_refusal *refusal);
int hs_line_integrate(hs_line *memory, const hs_path *paths, int64_t count, const hs_rows *rows,
                      const hs_drive *drive, double until, const hs_evolution *evolution,
                      hs_refusal *refusal);
int hs_line_set_friction(hs_line *memory, const double *friction, const hs_drive *drive);

/* ---- fields.c ---- */

int hs_line_set_summits(hs_line *memory, const double *summit_height, const double *summit_radius,
                        const uint8_t *fresh, const hs_evolution *evolution);

#endif
