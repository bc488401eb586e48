/* Lanes: sums over asperities that have the same bits on every processor. Terms are computed in blocks, added to eight lanes,
 * and the lanes are added in one order. */
#ifndef HISTORYSIM_LANES_H
#define HISTORYSIM_LANES_H

#include "numbers.h"

#define HS_LANES 8
/* terms of one block */
#define HS_BLOCK 256

/* Loops over asperities are vectorised at any level of optimisation: gcc's -O2 leaves most of them scalar. The attribute may
 * discard options of the command line, so it repeats those that fix the bits. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__)
#define HS_VECTORISED __attribute__((noinline, optimize("O3", "fp-contract=off", "no-math-errno", "no-trapping-math")))
#else
#define HS_VECTORISED
#endif
/* Compiled for narrow and for wide vectors, chosen at load time, with the same bits. Only glibc can choose; elsewhere vectors
 * are those of the least processor of the platform. */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GLIBC__)
#define HS_WIDE HS_VECTORISED __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define HS_WIDE HS_VECTORISED
#endif

static inline double hs_lanes_sum(const double *lane) {
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}
static inline void hs_add(double *lane, const double *term, int count) {
    int i = 0;
    for (; i + HS_LANES <= count; i += HS_LANES)
        for (int l = 0; l < HS_LANES; ++l) lane[l] += term[i + l];
    for (int l = 0; i + l < count; ++l) lane[l] += term[i + l];
}
static inline int hs_size_of_block(int64_t left) { return left < HS_BLOCK ? (int)left : HS_BLOCK; }

#endif
