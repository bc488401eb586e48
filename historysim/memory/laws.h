/* Laws of friction, wear and first loading, as far as the path functions use them. */
#ifndef HISTORYSIM_LAWS_H
#define HISTORYSIM_LAWS_H

#include "displacement.h"
#include "state.h"

/* Mean of k δ^(3/2) while δ changes linearly from the first value to the last. */
double hs_mean_load(double first, double last, double weight);
/* Remove the waiting volume and a further one from a summit, after `shaped`, while a² changes
 * linearly from the first value to the last [m²]; its radius is `meanwhile` on the way. Returns the
 * volume removed. */
double hs_worn_summit(const hs_wear *wear, double first, double last, double meanwhile,
                      double shaped, double waiting, double volume, double *height, double *radius);

/* Approach up to which no asperity yields, or yields further. */
double hs_next_yield(const hs_line *memory, const hs_yielding *law);
/* Approach at a normal load, with yielding on the way. */
int hs_yielding_approach(const hs_line *memory, const hs_evolution *evolution, double load,
                         double *approach);
/* Approach at which an asperity (in the caller's numbering) yields. */
double hs_yields_at(const hs_line *memory, const hs_yielding *law, int64_t asperity);
/* Normal load at an approach, with yielding on the way. */
int hs_yielding_load(const hs_line *memory, const hs_evolution *evolution, double d, double *load);
/* Flag the asperities (in the caller's numbering) that yield on the way to an approach. */
int hs_flag_yielding(const hs_line *memory, const hs_evolution *evolution, double d,
                     uint8_t *which);
/* Update summits for yielding up to an approach; contact and history are not changed. */
int hs_yield_to(hs_line *memory, const hs_evolution *evolution, double d, uint8_t *changed);

#endif
