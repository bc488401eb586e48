/* Ramp: a straight path in both loads. */
#ifndef HISTORYSIM_RAMP_H
#define HISTORYSIM_RAMP_H

#include "front.h"

/* Move a memory along a straight ramp of both loads that ends at a time. */
int hs_ramp(hs_line *memory, double load, double force, double time, const hs_drive *drive);

#endif
