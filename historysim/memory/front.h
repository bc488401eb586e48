/* Front: ramps of both loads of a single group. */
#ifndef HISTORYSIM_FRONT_H
#define HISTORYSIM_FRONT_H

#include "move.h"
#include "state.h"

/* Gauss's quadrature on (0, 1) with two to four nodes */
static const double front_node[3][4] = {
    {0.2113248654051871, 0.7886751345948129},
    {0.1127016653792583, 0.5, 0.8872983346207417},
    {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262}};
static const double front_weight[3][4] = {
    {0.5, 0.5},
    {0.2777777777777778, 0.4444444444444444, 0.2777777777777778},
    {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269}};
/* Iterations of Newton's method, at most; chosen. */
#define MOST_ITERATIONS 20

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
