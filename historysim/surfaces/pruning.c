#include "pruning.h"

#include <math.h>

/* Return the top of the hill that a flooded point belongs to; half of the way is shorter
 * afterwards. */
static int64_t top_of(int64_t point, int64_t *parent) {
    while (parent[point] != point) {
        parent[point] = parent[parent[point]];
        point = parent[point];
    }
    return point;
}

void hs_prominences(int64_t nx, int64_t ny, const double *heights, int64_t points,
                    const int64_t *order, int64_t step_count, const int64_t *steps, bool periodic,
                    double *prominence, int64_t *parent) {
    for (int64_t point = 0; point < nx * ny; point++) {
        parent[point] = -1;
        prominence[point] = 0.0;
    }
    for (int64_t place = 0; place < points; place++) {
        int64_t point = order[place], top = -1;
        parent[point] = point;
        for (int64_t step = 0; step < step_count; step++) {
            int64_t i = point / ny + steps[2 * step], j = point % ny + steps[2 * step + 1];
            if (periodic) {
                i = (i % nx + nx) % nx;
                j = (j % ny + ny) % ny;
            } else if (i < 0 || j < 0 || i >= nx || j >= ny) {
                continue;
            }
            int64_t other = i * ny + j;
            if (parent[other] < 0 || other == point) continue;
            int64_t root = top_of(other, parent);
            if (top < 0) {
                top = root;
                parent[point] = top;
            } else if (root != top) {
                /* the lower top ends here; of two at one height, that which comes later */
                bool above =
                    heights[root] > heights[top] || (heights[root] == heights[top] && root < top);
                int64_t higher = above ? root : top, lower = above ? top : root;
                prominence[lower] = heights[lower] - heights[point];
                parent[lower] = higher;
                top = higher;
            }
        }
        if (top < 0) prominence[point] = HUGE_VAL;
    }
}
