/* Settle: a path in as many chords as its tolerance needs. */
#ifndef HISTORYSIM_SETTLE_H
#define HISTORYSIM_SETTLE_H

#include "evolving.h"

/* Carry the first of three memories from one share of the path to another, in as many chords as it
 * takes. */
int hs_settle_in_chords(walk *w, hs_line *memory, hs_line *coarse, hs_line *fine, double before,
                        double share);
/* Do the same. Where the clock is known and asperities first slide, the way is walked once more to
 * find when. */
int hs_settle_timed(walk *w, hs_line *memory, double before, double share);

#endif
