/* Chord: one step of a path on which asperities evolve. */
#ifndef HISTORYSIM_CHORD_H
#define HISTORYSIM_CHORD_H

#include "evolving.h"

/* A copy to walk on; where summits change, it has a contact of its own. */
hs_line *hs_copy_to_change(const walk *w, const hs_line *memory);
/* Put down where the friction of each group is on a chord to approach d, where all carry `load`;
 * asperities slide so far meanwhile. What does not touch holds no friction by a law. */
int hs_set_stations(walk *w, const hs_line *memory, double d, double load, double share,
                    const double *ahead);
/* Find how far asperities slide on the straight way to the end of a chord. Those whose friction
 * bends are carried there and put back, if `ahead`; otherwise that is found when they are carried.
 */
int hs_solve_slid_distances(walk *w, hs_line *memory, const chord_end *end, int ahead);
/* How far the contact is moved on a chord while all asperities in contact slide [m]. */
double hs_slid_together(const walk *w, const hs_line *memory, const chord_end *end);
void hs_add_slides(const walk *w, hs_line *memory);
/* Integrate from one share of the path to another in one chord, or several between crossings of the
 * friction limit. */
int hs_chord(walk *w, hs_line *memory, double before, double share);

#endif
