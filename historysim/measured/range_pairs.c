#include "range_pairs.h"

#include <math.h>

int64_t hs_range_pairs(int64_t size, const double *points, int64_t *start, int64_t *end, bool *full, int64_t *left) {
    /* what is left stands in left[first] to left[stop - 1] */
    int64_t first = 0, stop = 0, cycles = 0;
    for (int64_t point = 0; point < size; point++) {
        left[stop++] = point;
        while (stop - first >= 3) {
            int64_t before = left[stop - 3], peak = left[stop - 2], last = left[stop - 1];
            if (fabs(points[last] - points[peak]) < fabs(points[peak] - points[before])) break;
            start[cycles] = before;
            end[cycles] = peak;
            full[cycles] = stop - first > 3;
            if (full[cycles]) {
                left[stop - 3] = last;
                stop -= 2;
            } else {
                first++;
            }
            cycles++;
        }
    }
    for (int64_t i = first; i + 1 < stop; i++) {
        start[cycles] = left[i];
        end[cycles] = left[i + 1];
        full[cycles++] = false;
    }
    return cycles;
}
