/* A loop over many contacts as a code of discrete elements has it: each contact keeps a history of
 * fixed size, which is sent from processor to processor, and the bound of what did not fit.
 *
 * Prints the largest tangential load, the largest error of it, and the largest bound [N]. Ends with
 * 1 where an error is beyond its bound, or where a history that fits is not kept to the bit. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "historysim.h"

#ifndef CONTACTS
#define CONTACTS 500
#endif
#define STEPS 600
#define FRICTION 0.4
#define RATIO 0.7 /* E* over 4 G* */

/* What is stored with a contact. A vertex is needed for each reversal that is still remembered, for
 * each bend of a path along which the contact grows, for the deepest spring and for the edge: n
 * reversals at a constant approach need n + 2. */
typedef struct history {
    hs_batch_vertex *vertex;
    int64_t depth;
    double lost; /* bound of the error of the tangential load that leaving out has brought so far
                    [N] */
} history;

static uint64_t seed = 88172645463325252u;
static double chance(void) {
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return (double)(seed >> 11) / 9007199254740992.0;
}

int main(int count, char **words) {
    int64_t capacity = count > 1 ? atol(words[1]) : 8;
    double friction = FRICTION, scale = 4.0 / 3.0 * 70e9 * sqrt(1e-3);
    double *approach = (double *)malloc(6 * CONTACTS * sizeof(double)),
           *displacement = approach + CONTACTS;
    double *normal = approach + 2 * CONTACTS, *tangential = approach + 3 * CONTACTS,
           *exact = approach + 4 * CONTACTS;
    double *ignored = approach + 5 * CONTACTS, largest = 0.0, error = 0.0, bound = 0.0;
    history *kept = (history *)calloc(CONTACTS, sizeof *kept);
    hs_batch *whole = hs_batch_new(CONTACTS, 1, &friction, 1, &scale, RATIO);
    hs_batch *here = hs_batch_new(CONTACTS, 1, &friction, 1, &scale, RATIO);
    int fails = 0;
    if (!approach || !kept || !whole || !here) return 2;
    for (int i = 0; i < CONTACTS; ++i) {
        kept[i].vertex = (hs_batch_vertex *)malloc((size_t)(capacity > 1 ? capacity : 1) *
                                                   sizeof(hs_batch_vertex));
        if (!kept[i].vertex) return 2;
    }
    for (int step = 0; step < STEPS; ++step) {
        for (int i = 0; i < CONTACTS; ++i) {
            /* vibration that fades and comes again, on contacts that breathe, and some of which
             * open */
            double swing = 40e-9 * pow(0.97, step % 90) * (chance() < 0.5 ? 1.0 : 0.3 * chance());
            displacement[i] = swing * (2.0 * chance() - 1.0) * ((step & 1) ? 1.0 : -1.0);
            approach[i] = 100e-9 * (1.0 + 0.1 * (chance() < 0.1 ? 2.0 * chance() - 1.0 : 0.0));
            if (chance() < 0.002) approach[i] = -1e-9;
        }
        if (hs_batch_step(whole, approach, displacement, ignored, exact) != HS_OK) return 2;
        if (hs_batch_step(here, approach, displacement, normal, tangential) != HS_OK) return 2;
        for (int i = 0; i < CONTACTS; ++i) {
            /* nothing of before is left of a contact that has opened */
            if (here->depth[i] == 0) kept[i].lost = 0.0;
            double off = fabs(tangential[i] - exact[i]);
            fails |= off > kept[i].lost + 1e-12 * friction * normal[i] || normal[i] != ignored[i];
            error = fmax(error, off);
            largest = fmax(largest, fabs(exact[i]));
            /* the history of fixed size, as it is stored between steps */
            kept[i].lost += hs_batch_shorten(here, i, capacity);
            bound = fmax(bound, kept[i].lost);
            kept[i].depth = hs_batch_take(here, i, kept[i].vertex);
        }
        if (step % 50 == 49) {
            /* another processor takes over */
            hs_batch_free(here);
            here = hs_batch_new(CONTACTS, 1, &friction, 1, &scale, RATIO);
            for (int i = 0; here && i < CONTACTS; ++i)
                fails |= hs_batch_put(here, i, kept[i].vertex, kept[i].depth) != HS_OK;
            if (!here) return 2;
        }
    }
    printf("%.17g %.17g %.17g\n", largest, error, bound);
    for (int i = 0; i < CONTACTS; ++i) free(kept[i].vertex);
    free(kept);
    free(approach);
    hs_batch_free(whole);
    hs_batch_free(here);
    return fails;
}
