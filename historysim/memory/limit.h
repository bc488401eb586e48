/* Limit: requests of tangential load that meet the friction limit. */
#ifndef HISTORYSIM_LIMIT_H
#define HISTORYSIM_LIMIT_H

#include "ramp.h"

/* Request along one path: both channels at its ends. If both are loads, the normal load is linear in the path fraction,
 * otherwise the approach is. Forces are the requested ones, also beyond the friction limit. */
typedef struct hs_request {
    int both_loads;
    double d[2];
    double load[2];
    double force[2];
} hs_request;
/* Pieces of a request, cut where it crosses the friction limit: the fraction at which each ends, and the limit it follows. */
#define HS_MOST_PIECES_OF_REQUEST 64
typedef struct hs_pieces {
    int count;
    double end[HS_MOST_PIECES_OF_REQUEST];
    int side[HS_MOST_PIECES_OF_REQUEST];
} hs_pieces;
/* Cut a request at the friction limit; no pieces if it stays within it. */
int hs_cut_at_limit(const hs_line *memory, const hs_request *request, int saturate, hs_pieces *pieces,
                    hs_refusal *refusal);
int hs_follow_limit(hs_line *memory, const hs_request *request, const hs_pieces *pieces, double before, double share,
              const double *times, const hs_drive *drive, int *side);

#endif
