/* Clusters: proxies of many asperities, with which sums of their loads and energies take a time that hardly grows with their
 * number.
 *
 * A sum Σ k f(a - h) over asperities whose gaps h are far from a is the sum over a few proxies of other weights, as exact as
 * doubles are: f is smooth there, so its interpolation between Chebyshev's points of the interval of gaps is. Clusters of 256,
 * 512, 1024, … asperities have 16 proxies each; a cluster may be used at labels at least twice its width from its centre, where
 * the interpolation of √(a - h) is within 1e-16. So a sum is over some proxies of each level, and over the asperities next to
 * the label. */
#ifndef HISTORYSIM_CLUSTERS_H
#define HISTORYSIM_CLUSTERS_H

#include "lanes.h"

#define HS_PROXIES 16
/* Asperities from which on a curve has clusters: sums over fewer take no longer than sums over proxies. */
#define HS_LEAST_CLUSTERED 16384

typedef struct hs_cluster {
    double centre, half_width; /* of the interval of gaps */
    double circles, circles_gap; /* Σ k², and its centre */
    double weight[HS_PROXIES];
} hs_cluster;

/* Clusters of asperities in ascending gap, in levels: those of one level have twice as many asperities as those of the one below. */
typedef struct hs_clusters {
    const double *gap, *weight; /* of the asperities */
    int64_t count;
    int levels;
    hs_cluster *level[48];
    hs_cluster memory[1];
} hs_clusters;

/* Make clusters, which are not filled in; NULL if out of memory. */
hs_clusters *hs_clusters_new(const double *gap, const double *weight, int64_t count);
/* Compute the proxies; a range of asperities is summed by clusters only where its gaps ascend. */
void hs_fill_clusters(hs_clusters *clusters);
/* Points in [-1, 1] at which proxies are placed. */
extern const double hs_proxy_point[HS_PROXIES];

/* Largest cluster that begins with asperity `begin`, ends before `end`, and is far enough below a label; NULL if there is none.
 * Sets its number of asperities, or how many come before the next cluster. */
static inline const hs_cluster *hs_cluster_at(const hs_clusters *clusters, int64_t begin, int64_t end, double label, int64_t *size) {
    int64_t block = begin / HS_BLOCK, width = HS_BLOCK;
    *size = HS_BLOCK - begin % HS_BLOCK;
    if (*size > end - begin) *size = end - begin;
    if (begin % HS_BLOCK) return NULL;
    int level = 0;
    while (level + 1 < clusters->levels && block % 2 == 0 && (begin + 2 * width <= end || end == clusters->count)) {
        block /= 2;
        width *= 2;
        ++level;
    }
    for (; level >= 0; --level, block *= 2, width /= 2) {
        if (begin + width > end && end < clusters->count) continue;
        const hs_cluster *cluster = clusters->level[level] + block;
        if (label - cluster->centre < 4.0 * cluster->half_width) continue;
        *size = width < end - begin ? width : end - begin;
        return cluster;
    }
    return NULL;
}

#endif
