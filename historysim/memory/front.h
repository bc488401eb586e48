/* Front: ramps of both loads of a single group. */
#ifndef HISTORYSIM_FRONT_H
#define HISTORYSIM_FRONT_H

#include "move.h"
#include "state.h"

/* Let the clock go on to the end of a path that is straight in both loads. */
static inline void hs_begin_ramp(hs_line *memory, double load, double force, double time) {
    hs_tick(memory, time);
    memory->clock.load = load;
    memory->clock.force = force;
}

/* Move a single group along a ramp: to the end by one straight path, which is exact, with the
 * energies of the ramp. */
int hs_ramp_group(hs_line *memory, double load, double force, double time, const hs_drive *drive);

#endif
