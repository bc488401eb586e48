/* The loop of range_pairs.py. */
#ifndef HS_RANGE_PAIRS_H
#define HS_RANGE_PAIRS_H

#include <stdbool.h>
#include <stdint.h>

#include "../basics/api.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Write where each cycle of a sequence of turning points starts and ends, and whether it is full; return how many there
   are. There is room for as many as points in each array, and in `left`, which is for the function's own use. */
HS_API int64_t hs_range_pairs(int64_t size, const double *points, int64_t *start, int64_t *end, bool *full,
                              int64_t *left);

#ifdef __cplusplus
}
#endif
#endif
