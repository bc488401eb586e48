/* Clusters: proxies of many asperities, from their gaps and weights: the smallest clusters from asperities, larger ones from the
 * proxies of the two in them. */

#include "clusters.h"

/* cos((2 p + 1) π/32): libm's cosine may differ from machine to machine */
const double hs_proxy_point[HS_PROXIES] = {
    0.9951847266721969,  0.9569403357322089,  0.8819212643483550,  0.773010453362737,
    0.6343932841636455,  0.47139673682599786, 0.29028467725446233, 0.09801714032956077,
    -0.09801714032956077, -0.29028467725446233, -0.47139673682599786, -0.6343932841636455,
    -0.773010453362737,  -0.8819212643483549, -0.9569403357322089, -0.9951847266721969};

hs_clusters *hs_clusters_new(const double *gap, const double *weight, int64_t count) {
    int64_t clusters = 0, width = HS_BLOCK;
    int levels = 0;
    do {
        clusters += (count + width - 1) / width;
        ++levels;
        width *= 2;
    } while (width < 2 * count);
    hs_clusters *made = (hs_clusters *)malloc(sizeof *made + (size_t)clusters * sizeof(hs_cluster));
    if (!made) return NULL;
    made->gap = gap;
    made->weight = weight;
    made->count = count;
    made->levels = levels;
    hs_cluster *at = made->memory;
    width = HS_BLOCK;
    for (int level = 0; level < levels; ++level, width *= 2) {
        made->level[level] = at;
        at += (count + width - 1) / width;
    }
    return made;
}

/* Compute the weights of proxies from at most HS_BLOCK asperities, or proxies of smaller clusters, at offsets from the centre. */
HS_WIDE static void fill_proxies(hs_cluster *cluster, const double *restrict offset, const double *restrict weight, int count) {
    double x[HS_BLOCK], before[HS_BLOCK], here[HS_BLOCK], term[HS_BLOCK], moment[HS_PROXIES];
    const double scale = cluster->half_width > 0.0 ? 1.0 / cluster->half_width : 0.0;
    for (int i = 0; i < count; ++i) {
        x[i] = offset[i] * scale;
        before[i] = x[i];
        here[i] = 1.0;
    }
    /* moments Σ k T_j(x) of Chebyshev's polynomials */
    for (int j = 0; j < HS_PROXIES; ++j) {
        double lane[HS_LANES] = {0};
        for (int i = 0; i < count; ++i) term[i] = weight[i] * here[i];
        hs_add(lane, term, count);
        moment[j] = hs_lanes_sum(lane);
        for (int i = 0; i < count; ++i) {
            double next = 2.0 * x[i] * here[i] - before[i];
            before[i] = here[i];
            here[i] = next;
        }
    }
    for (int p = 0; p < HS_PROXIES; ++p) {
        double y = hs_proxy_point[p], last = y, present = 1.0, sum = 0.5 * moment[0];
        for (int j = 1; j < HS_PROXIES; ++j) {
            double next = 2.0 * y * present - last;
            last = present;
            present = next;
            sum += moment[j] * present;
        }
        cluster->weight[p] = 2.0 / HS_PROXIES * sum;
    }
}

/* Set the interval of gaps of asperities in ascending gap. */
static void set_interval(hs_cluster *cluster, const double *gap, int64_t count) {
    cluster->centre = 0.5 * (gap[0] + gap[count - 1]);
    cluster->half_width = hs_most(cluster->centre - gap[0], gap[count - 1] - cluster->centre);
}

static void fill_smallest(hs_cluster *cluster, const double *gap, const double *weight, int count) {
    double offset[HS_BLOCK], circles = 0.0, moment = 0.0;
    set_interval(cluster, gap, count);
    for (int i = 0; i < count; ++i) {
        offset[i] = gap[i] - cluster->centre;
        circles += weight[i] * weight[i];
        moment += weight[i] * weight[i] * offset[i];
    }
    cluster->circles = circles;
    cluster->circles_gap = cluster->centre + (circles > 0.0 ? moment / circles : 0.0);
    fill_proxies(cluster, offset, weight, count);
}

/* Fill in a cluster from the one or two in it. */
static void join(hs_cluster *cluster, const hs_cluster *part, int parts, const double *gap, int64_t count) {
    double offset[2 * HS_PROXIES], weight[2 * HS_PROXIES], circles = 0.0, moment = 0.0;
    set_interval(cluster, gap, count);
    for (int k = 0; k < parts; ++k) {
        double shift = part[k].centre - cluster->centre;
        for (int p = 0; p < HS_PROXIES; ++p) {
            offset[k * HS_PROXIES + p] = shift + part[k].half_width * hs_proxy_point[p];
            weight[k * HS_PROXIES + p] = part[k].weight[p];
        }
        circles += part[k].circles;
        moment += part[k].circles * (part[k].circles_gap - cluster->centre);
    }
    cluster->circles = circles;
    cluster->circles_gap = cluster->centre + (circles > 0.0 ? moment / circles : 0.0);
    fill_proxies(cluster, offset, weight, parts * HS_PROXIES);
}

void hs_fill_clusters(hs_clusters *clusters) {
    if (!clusters) return;
    int64_t width = HS_BLOCK, number = 0;
    for (int level = 0; level < clusters->levels; ++level, width *= 2) {
        int64_t below = number;
        number = (clusters->count + width - 1) / width;
        for (int64_t index = 0; index < number; ++index) {
            int64_t begin = index * width, count = clusters->count - begin < width ? clusters->count - begin : width;
            hs_cluster *cluster = clusters->level[level] + index;
            if (level == 0)
                fill_smallest(cluster, clusters->gap + begin, clusters->weight + begin, (int)count);
            else
                join(cluster, clusters->level[level - 1] + 2 * index, 2 * index + 2 <= below ? 2 : 1, clusters->gap + begin, count);
        }
    }
}
