/* Normal curve: the load P(a) of asperities, or between knots, and the approach at a load (README.md, theory 8). */
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
    const hs_clusters *clusters; /* of many asperities, in whose array the gaps are; otherwise NULL */
} hs_curve;

/* The normal curve of asperities of one group, from a position on. */
static inline hs_curve hs_curve_of(const hs_contact *contact, int64_t start, int64_t count) {
    const hs_clusters *clusters = count < HS_LEAST_CLUSTERED ? NULL : contact->clusters;
    return HS_MADE(hs_curve){contact->gap + start, contact->weight + start, contact->load, count, clusters};
}

/* Part of a sum over asperities: some of them, or the proxies of a cluster of them. */
typedef struct hs_part {
    const double *gap, *weight;
    int count;
    int64_t size;  /* number of asperities */
    double origin; /* of gaps */
    double proxy_gap[HS_PROXIES];
} hs_part;
/* Find the next part, from position `begin` on, of a sum over asperities below `end` of a function of the gap that is smooth
 * below a label. */
static inline void hs_next_part(hs_curve curve, int64_t begin, int64_t end, double label, hs_part *part) {
    const hs_cluster *cluster = NULL;
    part->gap = curve.gap + begin;
    part->weight = curve.weight + begin;
    part->origin = 0.0;
    if (curve.clusters) {
        int64_t start = curve.gap - curve.clusters->gap;
        cluster = hs_cluster_at(curve.clusters, start + begin, start + end, label, &part->size);
        part->count = (int)part->size;
    } else {
        part->size = part->count = hs_size_of_block(end - begin);
    }
    if (!cluster) return;
    for (int p = 0; p < HS_PROXIES; ++p) part->proxy_gap[p] = cluster->half_width * hs_proxy_point[p];
    part->gap = part->proxy_gap;
    part->weight = cluster->weight;
    part->origin = cluster->centre;
    part->count = HS_PROXIES;
}

int64_t hs_count_touching(const double *gap, int64_t count, double approach);
/* P'' between a knot and the next one, at another approach; 0 beyond the last one. */
static inline double hs_bend_at(hs_curve curve, int64_t i) {
    return i + 1 < curve.count ? (curve.weight[i + 1] - curve.weight[i]) / (curve.gap[i + 1] - curve.gap[i]) : 0.0;
}
hs_load hs_load_between_knots(hs_curve curve, double approach);
hs_load hs_sum_of_loads(hs_curve curve, int64_t touching, double approach);
/* Label a at which rigid·(a - h) + compliance·P(a) is `total`, where h is the smallest gap. */
double hs_label_at(hs_curve curve, double total, double guess, double rigid, double compliance);
double hs_cube_root(double x);

static inline hs_load hs_load_of_one(double gap, double weight, double approach) {
    double depth = hs_most(approach - gap, 0.0), half_chord = weight * sqrt(depth);
    return HS_MADE(hs_load){half_chord * depth, 1.5 * half_chord};
}
/* P(a) and P'(a). */
static inline hs_load hs_load_at(hs_curve curve, double approach) {
    if (curve.load) return hs_load_between_knots(curve, approach);
    if (curve.count == 1) return hs_load_of_one(curve.gap[0], curve.weight[0], approach);
    return hs_sum_of_loads(curve, hs_count_touching(curve.gap, curve.count, approach), approach);
}
/* P(a) with its slope and its integrals over a. */
typedef struct hs_normal {
    double load, slope;
    double integral; /* ∫P da */
    double twice;    /* ∫∫P da da */
} hs_normal;
hs_normal hs_normal_at(hs_curve curve, double approach);
/* The normal curve of all asperities. */
static inline hs_curve hs_all_of(const hs_contact *contact) {
    return HS_MADE(hs_curve){contact->sorted_gap, contact->sorted_weight, contact->load, contact->count, contact->sorted_clusters};
}

#endif
