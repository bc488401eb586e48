/* Limit: requested tangential loads at the friction limit. */
#ifndef HISTORYSIM_LIMIT_H
#define HISTORYSIM_LIMIT_H

#include "ramp.h"

/* Request of one path: both channels at its ends, dimensionless. The normal load is linear in the
 * path fraction if both channels are loads, else the approach. Forces are requested loads, which
 * may exceed the friction limit. */
typedef struct hs_request {
    int both_loads;
    double d[2];
    double load[2];
    double force[2];
} hs_request;
/* Segments of a request between its crossings of the friction limit: path fraction of the end, and
 * the limit followed (1, -1, or 0). At most HS_MAX_PIECES segments; chosen. */
#define HS_MAX_PIECES 64
typedef struct hs_pieces {
    int count;
    double end[HS_MAX_PIECES];
    int side[HS_MAX_PIECES];
} hs_pieces;
/* Cut a request at the friction limit; no segments if it stays within. Returns HS_BEYOND_LIMIT,
 * with `refusal` filled, if it exceeds the limit and does not `saturate`. */
int hs_cut_at_limit(const hs_line *memory, const hs_request *request, int saturate,
                    hs_pieces *pieces, hs_refusal *refusal);
/* Integrate a request, cut into segments, between two path fractions; `side` returns the limit
 * followed at `to`. Returns a status. */
int hs_follow_limit(hs_line *memory, const hs_request *request, const hs_pieces *pieces,
                    double from, double to, const double *times, const hs_drive *drive, int *side);

#endif
