#include "internal.h"
int hs_walk_evolving(hs_memory *memory, const hs_path *paths, int64_t count, const hs_rows *rows, const hs_drive *drive, double until, const hs_evolution *evolution, hs_refusal *refusal) {
    (void)evolution;
    return hs_walk(memory, paths, count, rows, drive, until, refusal);
}
int hs_set_summits(hs_memory *memory, const double *summit_height, const double *summit_radius, const uint8_t *fresh, const hs_evolution *evolution) {
    (void)memory; (void)summit_height; (void)summit_radius; (void)fresh; (void)evolution; return HS_OK;
}
