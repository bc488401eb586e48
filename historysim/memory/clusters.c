/* Clusters: computes proxies from gaps and weights by Chebyshev moments: those of the smallest
 * clusters from asperities, those of larger ones from the proxies of their two halves. */

#include "clusters.h"

/* cos((2 p + 1) π/32), tabulated because cosines of libm differ between machines */
const double hs_proxy_point[HS_PROXIES] = {
    0.9951847266721969,   0.9569403357322089,   0.8819212643483550,   0.773010453362737,
    0.6343932841636455,   0.47139673682599786,  0.29028467725446233,  0.09801714032956077,
    -0.09801714032956077, -0.29028467725446233, -0.47139673682599786, -0.6343932841636455,
    -0.773010453362737,   -0.8819212643483549,  -0.9569403357322089,  -0.9951847266721969};
const double hs_proxy_unit[HS_PROXIES] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0,
                                          1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};

int64_t hs_count_clusters(int64_t count) {
    int64_t clusters = 0, width = HS_BLOCK;
    do {
        clusters += (count + width - 1) / width;
        width *= 2;
    } while (width < 2 * count);
    return clusters;
}

hs_clusters *hs_clusters_new(const double *gap, const double *weight, int64_t count) {
    int64_t total = hs_count_clusters(count), width = HS_BLOCK;
    hs_clusters *result =
        (hs_clusters *)malloc(sizeof *result + (size_t)total * sizeof(hs_cluster));
    if (!result) return NULL;
    result->gap = gap;
    result->weight = weight;
    result->count = count;
    result->total = total;
    result->levels = 0;
    for (hs_cluster *at = result->memory; at < result->memory + total; width *= 2) {
        result->level[result->levels++] = at;
        at += (count + width - 1) / width;
    }
    return result;
}

/* Compute the weights of proxies from at most HS_BLOCK asperities or proxies of smaller clusters,
 * at offsets from the centre. */
HS_WIDE static void fill_proxies(hs_cluster *cluster, const double *restrict offset,
                                 const double *restrict weight, int count) {
    double x[HS_BLOCK], previous[HS_BLOCK], current[HS_BLOCK], term[HS_BLOCK], moment[HS_PROXIES];
    const double scale = cluster->half_width > 0.0 ? 1.0 / cluster->half_width : 0.0;
    for (int i = 0; i < count; ++i) {
        x[i] = offset[i] * scale;
        previous[i] = x[i];
        current[i] = 1.0;
    }
    /* moments Σ k T_j(x) of Chebyshev polynomials, by their recurrence */
    for (int j = 0; j < HS_PROXIES; ++j) {
        double lane[HS_LANES] = {0};
        for (int i = 0; i < count; ++i) term[i] = weight[i] * current[i];
        hs_add(lane, term, count);
        moment[j] = hs_lanes_sum(lane);
        for (int i = 0; i < count; ++i) {
            double successor = 2.0 * x[i] * current[i] - previous[i];
            previous[i] = current[i];
            current[i] = successor;
        }
    }
    for (int p = 0; p < HS_PROXIES; ++p) {
        double y = hs_proxy_point[p], previous_y = y, current_y = 1.0, sum = 0.5 * moment[0];
        for (int j = 1; j < HS_PROXIES; ++j) {
            double successor = 2.0 * y * current_y - previous_y;
            previous_y = current_y;
            current_y = successor;
            sum += moment[j] * current_y;
        }
        cluster->weight[p] = 2.0 / HS_PROXIES * sum;
    }
}

/* Set centre and half width of the interval of ascending gaps. */
static void set_interval(hs_cluster *cluster, const double *gap, int64_t count) {
    cluster->centre = 0.5 * (gap[0] + gap[count - 1]);
    cluster->half_width = hs_max(cluster->centre - gap[0], gap[count - 1] - cluster->centre);
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

/* Compute a cluster from its one or two children. */
static void join(hs_cluster *cluster, const hs_cluster *child, int child_count, const double *gap,
                 int64_t count) {
    double offset[2 * HS_PROXIES], weight[2 * HS_PROXIES], circles = 0.0, moment = 0.0;
    set_interval(cluster, gap, count);
    for (int k = 0; k < child_count; ++k) {
        double shift = child[k].centre - cluster->centre;
        for (int p = 0; p < HS_PROXIES; ++p) {
            offset[k * HS_PROXIES + p] = shift + child[k].half_width * hs_proxy_point[p];
            weight[k * HS_PROXIES + p] = child[k].weight[p];
        }
        circles += child[k].circles;
        moment += child[k].circles * (child[k].circles_gap - cluster->centre);
    }
    cluster->circles = circles;
    cluster->circles_gap = cluster->centre + (circles > 0.0 ? moment / circles : 0.0);
    fill_proxies(cluster, offset, weight, child_count * HS_PROXIES);
}

void hs_fill_clusters(hs_clusters *clusters) {
    if (!clusters) return;
    int64_t width = HS_BLOCK, number = 0;
    for (int level = 0; level < clusters->levels; ++level, width *= 2) {
        int64_t below = number;
        number = (clusters->count + width - 1) / width;
        for (int64_t index = 0; index < number; ++index) {
            int64_t start = index * width,
                    count = clusters->count - start < width ? clusters->count - start : width;
            hs_cluster *cluster = clusters->level[level] + index;
            if (level == 0)
                fill_smallest(cluster, clusters->gap + start, clusters->weight + start, (int)count);
            else
                join(cluster, clusters->level[level - 1] + 2 * index,
                     2 * index + 2 <= below ? 2 : 1, clusters->gap + start, count);
        }
    }
}

/* Compute the Chebyshev coefficients of a function from its values at the proxies. */
static void coefficients_of(const double *value, double *coefficient) {
    for (int j = 0; j < HS_PROXIES; ++j) coefficient[j] = 0.0;
    for (int p = 0; p < HS_PROXIES; ++p) {
        double y = hs_proxy_point[p], previous = y, current = 1.0;
        for (int j = 0; j < HS_PROXIES; ++j) {
            coefficient[j] += (j ? 2.0 : 1.0) / HS_PROXIES * value[p] * current;
            double successor = 2.0 * y * current - previous;
            previous = current;
            current = successor;
        }
    }
}

/* Add weight times the series of a cluster, by Clenshaw's recurrence, at gaps above `origin`. */
HS_WIDE static void add_series(const hs_cluster *cluster, const double *coefficient, double origin,
                               const double *restrict gap, double stretch,
                               const double *restrict weight, int count, double *restrict sum) {
    const double scale = cluster->half_width > 0.0 ? 1.0 / cluster->half_width : 0.0;
    double x[HS_BLOCK], outer[HS_BLOCK], inner[HS_BLOCK];
    for (int i = 0; i < count; ++i) {
        x[i] = (gap[i] * stretch + (origin - cluster->centre)) * scale;
        outer[i] = inner[i] = 0.0;
    }
    for (int j = HS_PROXIES - 1; j > 0; --j)
        for (int i = 0; i < count; ++i) {
            double successor = coefficient[j] + 2.0 * x[i] * inner[i] - outer[i];
            outer[i] = inner[i];
            inner[i] = successor;
        }
    for (int i = 0; i < count; ++i)
        sum[i] += (weight ? weight[i] : 1.0) * (coefficient[0] + x[i] * inner[i] - outer[i]);
}

/* Interpolate in one cluster and in those within it, `value` the sum of those that contain it. */
static void descend(const hs_clusters *clusters, const double *far, int level, int64_t index,
                    const double *outer, int64_t start, int64_t stop, double *energy) {
    const int64_t width = (int64_t)HS_BLOCK << level, block_start = index * width;
    const hs_cluster *cluster = clusters->level[level] + index;
    const double *far_value = far + (cluster - clusters->memory) * HS_PROXIES;
    double value[HS_PROXIES], coefficient[HS_PROXIES];
    int is_zero = 1;
    if (block_start >= stop || block_start + width <= start || block_start >= clusters->count)
        return;
    for (int p = 0; p < HS_PROXIES; ++p) {
        value[p] = outer[p] + far_value[p];
        is_zero &= value[p] == 0.0;
    }
    if (!is_zero) coefficients_of(value, coefficient);
    if (level == 0) {
        int64_t from = start > block_start ? start : block_start, block_stop = block_start + width;
        if (block_stop > stop) block_stop = stop;
        if (!is_zero)
            add_series(cluster, coefficient, 0.0, clusters->gap + from, 1.0,
                       clusters->weight + from, (int)(block_stop - from), energy + (from - start));
        return;
    }
    for (int64_t child = 2 * index; child < 2 * index + 2; ++child) {
        const hs_cluster *inner = clusters->level[level - 1] + child;
        double at_child[HS_PROXIES] = {0};
        if (!is_zero && child * (width / 2) < clusters->count)
            add_series(cluster, coefficient, inner->centre, hs_proxy_point, inner->half_width, NULL,
                       HS_PROXIES, at_child);
        descend(clusters, far, level - 1, child, at_child, start, stop, energy);
    }
}

void hs_interpolate_far(const hs_clusters *clusters, const double *far, int64_t start, int64_t stop,
                        double *energy) {
    const double none[HS_PROXIES] = {0};
    if (stop > clusters->count) stop = clusters->count;
    descend(clusters, far, clusters->levels - 1, 0, none, start, stop, energy);
}
