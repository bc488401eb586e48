/* The loops of reduction.py. Arrays are in a row; sizes count their numbers. */
#ifndef HS_REDUCTION_H
#define HS_REDUCTION_H

#include <stdbool.h>
#include <stdint.h>

#include "../basics/api.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Write the indices of the turning points of 1 or more values, of which there may be as many as
   values; return how many there are. */
HS_API int64_t hs_turning_points(int64_t size, const double *values, double dead_band,
                                 int64_t *kept);

/* Mark the samples that the straight path between needed ones passes by more than the dead bands.

   The distance of (u, n) from a line along (p, q), largest over the channels, is |uq - np| / (|p| +
   |q|) with all of them over their dead bands. It need not be taken to the ends of the line:
   between turning points nothing goes beyond them by as much as the dead bands.

   kept (kept_size): where the path is cut beforehand, ascending, and needed already.
   waiting: room for two numbers more than twice as many as there are samples. */
HS_API void hs_keep_path(const double *tangential, const double *normal, double dead_band,
                         double normal_dead_band, int64_t kept_size, const int64_t *kept,
                         bool *needed, int64_t *waiting);

#ifdef __cplusplus
}
#endif
#endif
