/* From the rows of all knots of normal curves to those of their patches. */

#include "internal.h"

/* Fill in what the springs that touch between two rows of the table carry, all that is superposed. */
static void gather(const double *knots, int64_t count, const hs_patches *patches, double *target) {
    memset(target, 0, (size_t)patches->rows * sizeof *target);
    for (int64_t k = 0; k < count; ++k) target[patches->row[k]] += knots[k];
}

/* What a patch has of that. */
static double weighted(const double *gains, int64_t rows, const double *weight) {
    double lane[HS_LANES] = {0};
    int64_t r = 0;
    for (; r + HS_LANES <= rows; r += HS_LANES)
        for (int l = 0; l < HS_LANES; ++l) lane[l] += gains[r + l] * weight[r + l];
    for (int l = 0; r + l < rows; ++l) lane[l] += gains[r + l] * weight[r + l];
    return hs_lanes_sum(lane);
}

/* Radii of the circles that have the areas of patches, straight between the rows of their table. */
static void equal_radii(const hs_patches *patches, double approach, double *target) {
    int64_t above = hs_touching(patches->approach, patches->rows + 1, approach);
    if (above < 1) above = 1;
    if (above > patches->rows) above = patches->rows;
    const double *low = patches->area + (above - 1) * patches->count, *high = low + patches->count;
    double begin = patches->approach[above - 1];
    double part = hs_least((approach - begin) / (patches->approach[above] - begin), 1.0);
    for (int64_t i = 0; i < patches->count; ++i)
        target[i] = sqrt(((1.0 - part) * low[i] + part * high[i]) / 3.141592653589793);
}

int hs_record_patches(const hs_patches *patches, const hs_rows *knots, int64_t count, const double *approach,
                      const double *stick, double friction, const hs_rows *rows) {
    double *weights = (double *)malloc(2 * (size_t)patches->rows * sizeof *weights);
    if (!weights) return HS_OUT_OF_MEMORY;
    for (int64_t r = 0; r < count; ++r) {
        int64_t from = r * knots->columns, at = r * patches->count;
        gather(knots->normal_load + from, knots->columns, patches, weights);
        gather(knots->tangential_load + from, knots->columns, patches, weights + patches->rows);
        if (r > 0 && approach[r] == approach[r - 1])
            memcpy(rows->contact_radius + at, rows->contact_radius + at - patches->count,
                   (size_t)patches->count * sizeof(double));
        else
            equal_radii(patches, approach[r], rows->contact_radius + at);
        equal_radii(patches, stick[r], rows->stick_radius + at);
        int whole = knots->slip_state[from] == HS_FULL_STICK;
        for (int64_t i = 0; i < patches->count; ++i) {
            double touch = patches->first_touch[i];
            rows->dissipated_energy[at + i] = 0.0;
            if (approach[r] <= touch) {
                rows->normal_load[at + i] = rows->tangential_load[at + i] = 0.0;
                rows->contact_radius[at + i] = rows->stick_radius[at + i] = 0.0;
                rows->slip_state[at + i] = HS_SEPARATED;
                continue;
            }
            const double *gains = patches->gain + i * patches->rows;
            double normal = hs_most(weighted(gains, patches->rows, weights), 0.0);
            double tangential = weighted(gains, patches->rows, weights + patches->rows);
            rows->normal_load[at + i] = normal;
            rows->tangential_load[at + i] = hs_within(tangential, friction * normal);
            rows->slip_state[at + i] = hs_slip_state_of(1, !whole, stick[r] > touch);
        }
    }
    free(weights);
    return HS_OK;
}
