/* Substeps: adaptive integration of a part of a path on which fields change. */
#ifndef HISTORYSIM_SUBSTEPS_H
#define HISTORYSIM_SUBSTEPS_H

#include "step.h"

/* Integrate from one path fraction to another in as many substeps as the tolerance needs; with two
 * copies as scratch. */
int hs_integrate_substeps(hs_fields *ctx, hs_line *memory, hs_line *coarse, hs_line *fine,
                          double start_fraction, double fraction);
/* The same, with the instants of first sliding if the memory is timed. */
int hs_integrate_timed(hs_fields *ctx, hs_line *memory, double start_fraction, double fraction);

#endif
