/* The loop of summits.py. */
#ifndef HS_PRUNING_H
#define HS_PRUNING_H

#include <stdbool.h>
#include <stdint.h>

#include "../basics/api.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Write the prominence of each point of a map: how far it rises above the highest saddle on the way
   to a higher top.

   heights, prominence, parent (nx, ny); parent is for the function's own use.
   order (points): the points to be flooded, from the highest down; the others are in no way.
   steps (step_count, 2): from a point to its neighbours. */
HS_API void hs_prominences(int64_t nx, int64_t ny, const double *heights, int64_t points,
                           const int64_t *order, int64_t step_count, const int64_t *steps,
                           bool periodic, double *prominence, int64_t *parent);

#ifdef __cplusplus
}
#endif
#endif
