#include "reduction.h"

#include <math.h>

int64_t hs_turning_points(int64_t size, const double *values, double dead_band, int64_t *kept) {
    int64_t count = 0, high = 0, low = 0;
    int direction = 0;
    kept[count++] = 0;
    for (int64_t i = 1; i < size; i++) {
        double fall = values[high] - values[i], rise = values[i] - values[low];
        if (direction >= 0 && fall > 0.0 && fall >= dead_band) {
            if (high > 0) kept[count++] = high;
            direction = -1;
            low = i;
        } else if (direction <= 0 && rise > 0.0 && rise >= dead_band) {
            if (low > 0) kept[count++] = low;
            direction = 1;
            high = i;
        } else {
            if (direction >= 0 && fall < 0.0) high = i;
            if (direction <= 0 && rise < 0.0) low = i;
        }
    }
    int64_t last = size - 1, extreme = direction > 0 ? high : direction < 0 ? low : 0;
    if (0 < extreme && extreme < last) kept[count++] = extreme;
    if (last > 0) kept[count++] = last;
    return count;
}

void hs_keep_path(const double *tangential, const double *normal, double dead_band,
                  double normal_dead_band, int64_t kept_size, const int64_t *kept, bool *needed,
                  int64_t *waiting) {
    for (int64_t piece = 0; piece + 1 < kept_size; piece++) {
        int64_t count = 0;
        waiting[count++] = kept[piece];
        waiting[count++] = kept[piece + 1];
        while (count > 0) {
            int64_t end = waiting[--count], start = waiting[--count], farthest = start;
            double p = tangential[end] - tangential[start], q = normal[end] - normal[start];
            double most = fabs(p) * normal_dead_band + fabs(q) * dead_band;
            for (int64_t i = start + 1; i < end; i++) {
                double cross =
                    fabs((tangential[i] - tangential[start]) * q - (normal[i] - normal[start]) * p);
                if (cross > most) {
                    farthest = i;
                    most = cross;
                }
            }
            if (farthest > start) {
                needed[farthest] = true;
                waiting[count++] = start;
                waiting[count++] = farthest;
                waiting[count++] = farthest;
                waiting[count++] = end;
            }
        }
    }
}
