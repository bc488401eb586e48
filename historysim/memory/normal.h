/* Normal curve: the load P(a) of asperities, or between knots, and the approach at a load
 * (README.md, theory 8). */
#ifndef HISTORYSIM_NORMAL_H
#define HISTORYSIM_NORMAL_H

#include "clusters.h"

typedef struct hs_load {
    double load;
    double slope; /* dP/da */
} hs_load;

/* Asperities in ascending gap; or knots, which have loads. */
typedef struct hs_curve {
    const double *gap;
    const double *weight;
    const double *load;
    int64_t count;
    const hs_clusters
        *clusters; /* clusters of the array that contains the gaps; NULL for few asperities */
} hs_curve;

/* Normal curve of `count` asperities of one group, from position `start` on. */
static inline hs_curve hs_curve_of(const hs_contact *contact, int64_t start, int64_t count) {
    const hs_clusters *clusters = count < HS_MIN_CLUSTERED ? NULL : contact->clusters;
    return HS_MADE(hs_curve){contact->gap + start, contact->weight + start, contact->load, count,
                             clusters};
}

/* Terms of a sum over asperities: asperities, or the proxies of a cluster. */
typedef struct hs_chunk {
    const double *gap, *weight;
    int count;
    int64_t size;              /* number of asperities */
    double origin;             /* of gaps */
    const hs_cluster *cluster; /* NULL of asperities */
    double proxy_gap[HS_PROXIES];
} hs_chunk;
/* Set the chunk that starts at position `start` of a sum over asperities below `stop`, of a
 * function of the gap that is smooth below a label. */
static inline void hs_next_chunk(hs_curve curve, int64_t start, int64_t stop, double label,
                                 hs_chunk *chunk) {
    const hs_cluster *cluster = NULL;
    chunk->gap = curve.gap + start;
    chunk->weight = curve.weight + start;
    chunk->origin = 0.0;
    if (curve.clusters) {
        int64_t offset = curve.gap - curve.clusters->gap;
        cluster = hs_cluster_at(curve.clusters, offset + start, offset + stop, label, &chunk->size);
        chunk->count = (int)chunk->size;
    } else {
        chunk->size = chunk->count = hs_size_of_block(stop - start);
    }
    chunk->cluster = cluster;
    if (!cluster) return;
    for (int p = 0; p < HS_PROXIES; ++p)
        chunk->proxy_gap[p] = cluster->half_width * hs_proxy_point[p];
    chunk->gap = chunk->proxy_gap;
    chunk->weight = cluster->weight;
    chunk->origin = cluster->centre;
    chunk->count = HS_PROXIES;
}

/* Number of asperities, in ascending gap, with a gap below an approach. */
int64_t hs_count_touching(const double *gap, int64_t count, double approach);
/* P'' between knots i and i + 1; 0 beyond the outermost one. */
static inline double hs_bend_at(hs_curve curve, int64_t i) {
    return i + 1 < curve.count
               ? (curve.weight[i + 1] - curve.weight[i]) / (curve.gap[i + 1] - curve.gap[i])
               : 0.0;
}
hs_load hs_load_between_knots(hs_curve curve, double approach);
hs_load hs_sum_of_loads(hs_curve curve, int64_t touching, double approach);
/* Solve rigid·(a - h) + compliance·P(a) = total for the label a, with the smallest gap h. */
double hs_label_at(hs_curve curve, double total, double guess, double rigid, double compliance);
/* Cube root of x > 0, with equal bits on all machines. */
double hs_cube_root(double x);

static inline hs_load hs_load_of_asperity(double gap, double weight, double approach) {
    double depth = hs_max(approach - gap, 0.0), half_chord = weight * sqrt(depth);
    return HS_MADE(hs_load){half_chord * depth, 1.5 * half_chord};
}
/* P(a) and P'(a) at an approach. */
static inline hs_load hs_load_at(hs_curve curve, double approach) {
    if (curve.load) return hs_load_between_knots(curve, approach);
    if (curve.count == 1) return hs_load_of_asperity(curve.gap[0], curve.weight[0], approach);
    return hs_sum_of_loads(curve, hs_count_touching(curve.gap, curve.count, approach), approach);
}
/* P(a) with its slope and its integrals over a. */
typedef struct hs_normal {
    double load, slope;
    double integral; /* ∫P da */
    double twice;    /* ∫∫P da da */
} hs_normal;
hs_normal hs_normal_at(hs_curve curve, double approach);
/* Normal curve of all asperities. */
static inline hs_curve hs_all_of(const hs_contact *contact) {
    return HS_MADE(hs_curve){contact->sorted_gap, contact->sorted_weight, contact->load,
                             contact->count, contact->sorted_clusters};
}

#endif
