/* Shape: summits that wear or yield on a chord. */
#ifndef HISTORYSIM_SHAPE_H
#define HISTORYSIM_SHAPE_H

#include "evolving.h"

/* Give the asperities of a contact of its own other summits in its place, of which those of a group
 * are alike; depths are those in `depth` (asperity) where the group still touches. */
void hs_set_shape(hs_line *memory, const double *height, const double *radius,
                  const int64_t *depth);
/* Forget the springs that have gone with what was worn. */
void hs_forget_worn(hs_line *memory);
void hs_store_gaps(walk *w, const hs_contact *contact);
void hs_store_depths(walk *w, const hs_line *memory);
/* Reshape a memory, and return the elastic energy that is lost by it. */
double hs_wear_to(walk *w, hs_line *memory, const double *height, const double *radius,
                  double stored);
/* Have summits lose what they do on a chord as it is foreseen: volumes, and the shapes amid it and
 * at its end. */
int hs_predict_wear(walk *w, const hs_line *memory, const chord_end *end);
/* Where the channels are at a share of a path on which summits yield; a load that follows from the
 * approach is not known before they have. */
int hs_yielding_end(const walk *w, const hs_line *memory, double share, double *d, double *load);
int hs_apply_yielding(walk *w, hs_line *memory, double d);

#endif
