/* Lanes: sums over asperities with the same bits on every processor. Terms are computed in blocks
 * and added to eight partial sums (lanes), which are added in a fixed order. */
#ifndef HISTORYSIM_LANES_H
#define HISTORYSIM_LANES_H

#include "numbers.h"

/* Partial sums: doubles of the widest vector, of 512 bits. */
#define HS_LANES 8
/* Terms of one block; chosen. */
#define HS_BLOCK 256

/* Loops over asperities are vectorised at any level of optimisation: gcc's -O2 leaves most of them
 * scalar. The attribute may discard options of the command line, so it repeats those that fix the
 * bits. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__)
#define HS_VECTORISED                                                                              \
    __attribute__((noinline,                                                                       \
                   optimize("O3", "fp-contract=off", "no-math-errno", "no-trapping-math")))
#else
#define HS_VECTORISED
#endif
/* Compiled for narrow and for wide vectors, chosen at load time, with the same bits. Only glibc can
 * choose; elsewhere vectors have the width of the oldest processor of the platform. The linker of
 * zig 0.13 and 0.14 lacks the function that chooses: HS_ONE_WIDTH. */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GLIBC__) && !defined(HS_ONE_WIDTH)
#define HS_WIDE HS_VECTORISED __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define HS_WIDE HS_VECTORISED
#endif

static inline double hs_lanes_sum(const double *lane) {
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) +
           ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}
/* Add terms to the lanes, term i to lane i mod 8. */
static inline void hs_add(double *lane, const double *term, int count) {
    int i = 0;
    for (; i + HS_LANES <= count; i += HS_LANES)
        for (int l = 0; l < HS_LANES; ++l) lane[l] += term[i + l];
    for (int l = 0; i + l < count; ++l) lane[l] += term[i + l];
}
static inline int hs_size_of_block(int64_t remaining) {
    return remaining < HS_BLOCK ? (int)remaining : HS_BLOCK;
}

#endif
