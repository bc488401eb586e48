/* Clusters: sums of loads and energies of many asperities in logarithmic time, by a hierarchy of
 * Chebyshev interpolants (the black-box fast multipole method in one dimension).
 *
 * For gaps h far from a, Σ k f(a - h) over asperities equals, to rounding, a sum over a few proxies
 * with other weights, as f is smooth and is interpolated at the Chebyshev points of the interval of
 * gaps. Clusters of 256, 512, 1024, … asperities have 16 proxies each; a cluster is used at labels
 * at least twice its width from its centre, where the interpolation error of √(a - h) is below
 * 1e-16. A sum runs over proxies of each level, and over the asperities next to the label. */
#ifndef HISTORYSIM_CLUSTERS_H
#define HISTORYSIM_CLUSTERS_H

#include "lanes.h"

/* Proxies of a cluster: Chebyshev points, for an interpolation error below 1e-16 (above). */
#define HS_PROXIES 16
/* Smallest number of asperities of a curve with clusters; sums over fewer take no longer than sums
 * over proxies. */
#define HS_MIN_CLUSTERED 16384

typedef struct hs_cluster {
    double centre, half_width;   /* of the interval of gaps */
    double circles, circles_gap; /* Σ k², and its centre */
    double weight[HS_PROXIES];
} hs_cluster;

/* Binary hierarchy of clusters of asperities in ascending gap: clusters of level n have
 * HS_BLOCK·2^n asperities. */
typedef struct hs_clusters {
    const double *gap, *weight; /* of the asperities */
    int64_t count;
    int64_t total; /* clusters of all levels */
    int levels;
    hs_cluster *level[48];
    hs_cluster memory[1];
} hs_clusters;

/* Allocate clusters that are not filled; NULL if out of memory. */
hs_clusters *hs_clusters_new(const double *gap, const double *weight, int64_t count);
/* Compute the proxies; a range of asperities may be summed by clusters only if its gaps ascend. */
void hs_fill_clusters(hs_clusters *clusters);
/* Number of clusters of all levels. */
int64_t hs_count_clusters(int64_t count);
/* Add to the energies of asperities `start` to `stop` - 1 their weights times functions of the gap,
 * given at the proxies of all clusters (cluster, proxy), of which each is summed up in its
 * asperities: the transpose of a sum over proxies. */
void hs_interpolate_far(const hs_clusters *clusters, const double *far, int64_t start, int64_t stop,
                        double *energy);
/* Chebyshev points in [-1, 1], and weights of 1. */
extern const double hs_proxy_point[HS_PROXIES], hs_proxy_unit[HS_PROXIES];

/* Largest cluster that begins with asperity `start`, is within `stop` and far enough below a label;
 * NULL if there is none. Sets its number of asperities, or, without a cluster, the number of
 * asperities to sum one by one. */
static inline const hs_cluster *hs_cluster_at(const hs_clusters *clusters, int64_t start,
                                              int64_t stop, double label, int64_t *size) {
    int64_t block = start / HS_BLOCK, width = HS_BLOCK;
    *size = HS_BLOCK - start % HS_BLOCK;
    if (*size > stop - start) *size = stop - start;
    if (start % HS_BLOCK) return NULL;
    int level = 0;
    while (level + 1 < clusters->levels && block % 2 == 0 &&
           (start + 2 * width <= stop || stop == clusters->count)) {
        block /= 2;
        width *= 2;
        ++level;
    }
    for (; level >= 0; --level, block *= 2, width /= 2) {
        if (start + width > stop && stop < clusters->count) continue;
        const hs_cluster *cluster = clusters->level[level] + block;
        if (label - cluster->centre < 4.0 * cluster->half_width) continue;
        *size = width < stop - start ? width : stop - start;
        return cluster;
    }
    return NULL;
}

#endif
