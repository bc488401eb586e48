/* Contact: summits sorted by friction group and gap, from their heights and radii, or a normal
 * curve from its knots; all lengths and loads dimensionless (README.md, layout). */

#include "contact.h"

/* Shifts of an insertion sort after the distribution to buckets, of each key, before a merge sort
 * is faster; chosen. */
#define MAX_SHIFTS 8

/* Distribute positions to as many buckets of equal width as there are keys, in stable order;
 * without effect if keys are not finite. `buffer` has room for twice as many numbers, and one. */
static void distribute(const double *key, int64_t *position, int64_t count, int64_t *buffer) {
    double low = key[position[0]], high = low;
    for (int64_t i = 1; i < count; ++i) {
        double value = key[position[i]];
        low = value < low ? value : low;
        high = value > high ? value : high;
        if (!(fabs(value) <= DBL_MAX)) return;
    }
    double scale = (double)(count - 1) / (high - low);
    int64_t *start = buffer + count;
    if (!(fabs(low) <= DBL_MAX && high - low <= DBL_MAX && scale <= DBL_MAX)) return;
    memset(start, 0, (size_t)(count + 1) * sizeof *start);
    for (int64_t i = 0; i < count; ++i) ++start[(int64_t)((key[position[i]] - low) * scale) + 1];
    for (int64_t i = 0; i < count; ++i) start[i + 1] += start[i];
    memcpy(buffer, position, (size_t)count * sizeof *buffer);
    for (int64_t i = 0; i < count; ++i)
        position[start[(int64_t)((key[buffer[i]] - low) * scale)]++] = buffer[i];
}

/* Bucket sort with an insertion sort; merge sort, bottom-up, if keys are clustered. Linear time if
 * sorted. */
int hs_sort_by(const double *key, int64_t *position, int64_t count) {
    int64_t sorted = 1, shifts = 0;
    while (sorted < count && key[position[sorted - 1]] <= key[position[sorted]]) ++sorted;
    if (sorted >= count) return HS_OK;
    int64_t *buffer = (int64_t *)malloc((size_t)(2 * count + 1) * sizeof *buffer),
            *source = position, *target = buffer;
    if (!buffer) return HS_OUT_OF_MEMORY;
    distribute(key, position, count, buffer);
    for (sorted = 1; sorted < count && shifts <= MAX_SHIFTS * count; ++sorted) {
        int64_t moved = position[sorted], i = sorted;
        for (; i > 0 && key[moved] < key[position[i - 1]]; --i) position[i] = position[i - 1];
        position[i] = moved;
        shifts += sorted - i;
    }
    for (int64_t width = 1; width < count && sorted < count; width *= 2) {
        for (int64_t start = 0; start < count; start += 2 * width) {
            int64_t middle = start + width < count ? start + width : count;
            int64_t stop = start + 2 * width < count ? start + 2 * width : count;
            int64_t i = start, j = middle, k = start;
            while (i < middle && j < stop)
                target[k++] = key[source[j]] < key[source[i]] ? source[j++] : source[i++];
            while (i < middle) target[k++] = source[i++];
            while (j < stop) target[k++] = source[j++];
        }
        int64_t *swap = source;
        source = target;
        target = swap;
    }
    if (source != position) memcpy(position, source, (size_t)count * sizeof *position);
    free(buffer);
    return HS_OK;
}

/* Fill the arrays of a contact from gaps and weights in the caller's numbering and the group of
 * each asperity; returns a status. */
static int put_in_order(hs_contact *contact, const double *gap, const double *weight,
                        const int64_t *group) {
    int64_t count = contact->count, groups = contact->groups;
    double *sorted_gap = (double *)contact->sorted_gap,
           *sorted_weight = (double *)contact->sorted_weight;
    double *group_gap = (double *)contact->gap, *group_weight = (double *)contact->weight;
    int64_t *order = (int64_t *)contact->order, *group_start = (int64_t *)contact->first;
    for (int64_t i = 0; i < count; ++i) order[i] = i;
    if (hs_sort_by(gap, order, count) != HS_OK) return HS_OUT_OF_MEMORY;
    for (int64_t i = 0; i < count; ++i) {
        sorted_gap[i] = gap[order[i]];
        sorted_weight[i] = weight[order[i]];
    }
    group_start[0] = 0;
    group_start[1] = count;
    if (groups > 1) {
        /* groups are numbered in the order of their smallest gaps */
        int64_t *rank = (int64_t *)malloc((size_t)(groups + count) * sizeof *rank),
                *ascending = rank + groups, met = 0;
        if (!rank) return HS_OUT_OF_MEMORY;
        memcpy(ascending, order, (size_t)count * sizeof *ascending);
        for (int64_t g = 0; g < groups; ++g) rank[g] = -1;
        for (int64_t g = 0; g <= groups; ++g) group_start[g] = 0;
        for (int64_t i = 0; i < count; ++i) {
            int64_t g = group[ascending[i]];
            if (rank[g] < 0) rank[g] = met++;
            ++group_start[rank[g] + 1];
        }
        for (int64_t g = 0; g < groups; ++g) group_start[g + 1] += group_start[g];
        for (int64_t i = 0; i < count; ++i)
            order[group_start[rank[group[ascending[i]]]]++] = ascending[i];
        for (int64_t g = groups; g > 0; --g) group_start[g] = group_start[g - 1];
        group_start[0] = 0;
        free(rank);
    }
    if (group_gap != sorted_gap)
        for (int64_t i = 0; i < count; ++i) {
            group_gap[i] = gap[order[i]];
            group_weight[i] = weight[order[i]];
        }
    double *load = (double *)contact->load;
    if (load) load[0] = 0.0;
    for (int64_t i = 1; load && i < count; ++i)
        load[i] = load[i - 1] +
                  0.5 * (group_weight[i - 1] + group_weight[i]) * (group_gap[i] - group_gap[i - 1]);
    return HS_OK;
}

/* Bytes of the block of gaps, weights, order, first positions and loads of knots. */
static size_t size_of_arrays(int64_t count, int64_t groups, int knots) {
    return ((size_t)count * (groups > 1 ? 5 : 3) + (size_t)groups + 1 +
            (knots ? (size_t)count : 0)) *
           8;
}

/* Allocate a contact with arrays that are not filled; NULL if out of memory. */
static hs_contact *blank(int64_t count, int64_t groups, int knots, const hs_units *units,
                         double datum) {
    /* a single group has the sorted order, so that it needs no second pair of arrays */
    size_t n = (size_t)count, arrays = groups > 1 ? 4 : 2;
    hs_contact *contact =
        (hs_contact *)malloc(sizeof(hs_contact) + size_of_arrays(count, groups, knots));
    if (!contact) return NULL;
    double *numbers = (double *)(contact + 1);
    contact->count = count;
    contact->groups = groups;
    contact->gap = numbers;
    contact->weight = numbers + n;
    contact->sorted_gap = groups > 1 ? numbers + 2 * n : numbers;
    contact->sorted_weight = groups > 1 ? numbers + 3 * n : numbers + n;
    contact->order = (int64_t *)(numbers + arrays * n);
    contact->first = contact->order + n;
    contact->load = knots ? (const double *)(contact->first + groups + 1) : NULL;
    contact->units = *units;
    contact->datum = datum;
    contact->references = 1;
    contact->query_count = 0;
    contact->query_label = NULL;
    contact->clusters = contact->sorted_clusters = NULL;
    contact->columns = NULL;
    return contact;
}

void hs_contact_changed(hs_contact *contact) {
    hs_fill_clusters(contact->clusters);
    if (contact->sorted_clusters != contact->clusters) hs_fill_clusters(contact->sorted_clusters);
    free(contact->columns);
    contact->columns = NULL;
}

const hs_columns *hs_contact_columns(hs_contact *contact) {
    hs_columns *columns = __atomic_load_n(&contact->columns, __ATOMIC_ACQUIRE), *present = NULL;
    if (columns) return columns;
    size_t count = (size_t)contact->count;
    columns = (hs_columns *)malloc(sizeof *columns + 4 * count * sizeof(double));
    if (!columns) return NULL;
    columns->gap = (double *)(columns + 1);
    columns->weight = columns->gap + count;
    columns->position = (int64_t *)(columns->weight + count);
    columns->group = columns->position + count;
    for (int64_t index = 0; index < contact->groups; ++index)
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i) {
            int64_t asperity = contact->order[i];
            columns->gap[asperity] = contact->gap[i];
            columns->weight[asperity] = contact->weight[i];
            columns->position[asperity] = i;
            columns->group[asperity] = index;
        }
    /* another thread may have created them in the meantime */
    if (__atomic_compare_exchange_n(&contact->columns, &present, columns, 0, __ATOMIC_ACQ_REL,
                                    __ATOMIC_ACQUIRE))
        return columns;
    free(columns);
    return present;
}

/* Create clusters for groups of many asperities, and for all asperities if they are many; returns a
 * status. */
static int make_clusters(hs_contact *contact) {
    int64_t max_size = 0;
    if (contact->load || contact->count < HS_MIN_CLUSTERED) return HS_OK;
    for (int64_t g = 0; g < contact->groups; ++g)
        if (contact->first[g + 1] - contact->first[g] > max_size)
            max_size = contact->first[g + 1] - contact->first[g];
    if (max_size >= HS_MIN_CLUSTERED) {
        contact->clusters = hs_clusters_new(contact->gap, contact->weight, contact->count);
        if (!contact->clusters) return HS_OUT_OF_MEMORY;
    }
    contact->sorted_clusters =
        contact->groups == 1
            ? contact->clusters
            : hs_clusters_new(contact->sorted_gap, contact->sorted_weight, contact->count);
    if (!contact->sorted_clusters) return HS_OUT_OF_MEMORY;
    hs_contact_changed(contact);
    return HS_OK;
}

hs_contact *hs_contact_of(int64_t count, int64_t groups, const double *gap, const double *weight,
                          const int64_t *group, int knots, const hs_units *units, double datum) {
    hs_contact *contact = blank(count, groups, knots, units, datum);
    if (!contact ||
        (put_in_order(contact, gap, weight, group) == HS_OK && make_clusters(contact) == HS_OK))
        return contact;
    hs_contact_free(contact);
    return NULL;
}

void hs_contact_assign(hs_contact *contact, const hs_contact *from) {
    memcpy((double *)contact->gap, from->gap,
           size_of_arrays(from->count, from->groups, from->load != NULL));
    hs_contact_changed(contact);
}

hs_contact *hs_contact_copy(const hs_contact *contact) {
    hs_contact *copy = blank(contact->count, contact->groups, contact->load != NULL,
                             &contact->units, contact->datum);
    if (!copy) return NULL;
    hs_contact_assign(copy, contact);
    if (make_clusters(copy) == HS_OK) return copy;
    hs_contact_free(copy);
    return NULL;
}

int hs_contact_alike(const hs_contact *contact, const hs_contact *reference) {
    return contact->count == reference->count && contact->groups == reference->groups &&
           !contact->load == !reference->load &&
           memcmp(&contact->units, &reference->units, sizeof contact->units) == 0 &&
           contact->datum == reference->datum &&
           memcmp(contact->gap, reference->gap,
                  size_of_arrays(contact->count, contact->groups, contact->load != NULL)) == 0 &&
           contact->query_count == reference->query_count &&
           (!contact->query_count ||
            memcmp(contact->query_label, reference->query_label,
                   (size_t)contact->query_count * sizeof *contact->query_label) == 0);
}

hs_contact *hs_contact_new(int64_t count, const double *summit_height, const double *summit_radius,
                           const double *stiffness, const int64_t *group, double contact_modulus,
                           double displacement_ratio) {
    double highest = summit_height[0], largest = summit_radius[0];
    int64_t groups = 1;
    for (int64_t i = 0; i < count; ++i) {
        highest = hs_max(highest, summit_height[i]);
        largest = hs_max(largest, summit_radius[i]);
        if (group && group[i] >= groups) groups = group[i] + 1;
    }
    hs_units units;
    units.length = units.radius = largest;
    units.load = 4.0 / 3.0 * contact_modulus * (largest * largest);
    units.displacement = displacement_ratio * largest;
    units.energy = units.load * units.displacement;
    units.area = 3.141592653589793 * largest * largest;
    units.stiffness = units.load / units.displacement;
    double *gap = (double *)malloc(2 * (size_t)count * sizeof *gap), *weight = gap + count;
    if (!gap) return NULL;
    for (int64_t i = 0; i < count; ++i) {
        gap[i] = (highest - summit_height[i]) / largest;
        weight[i] = stiffness ? stiffness[i] / (units.load / units.length)
                              : sqrt(summit_radius[i] / largest);
    }
    hs_contact *contact =
        hs_contact_of(count, groups, gap, weight, group, stiffness != NULL, &units, highest);
    free(gap);
    return contact;
}

hs_contact *hs_contact_retain(hs_contact *contact) {
    __atomic_add_fetch(&contact->references, 1, __ATOMIC_RELAXED);
    return contact;
}

void hs_contact_free(hs_contact *contact) {
    if (!contact || __atomic_sub_fetch(&contact->references, 1, __ATOMIC_ACQ_REL) > 0) return;
    free(contact->query_label);
    if (contact->sorted_clusters != contact->clusters) free(contact->sorted_clusters);
    free(contact->clusters);
    free(contact->columns);
    free(contact);
}

int hs_contact_watch(hs_contact *contact, int64_t count, const double *approach) {
    double *watch = (double *)malloc((size_t)count * sizeof *watch);
    if (!watch || contact->groups > 1 || contact->query_label) {
        free(watch);
        return watch ? HS_FOREIGN : HS_OUT_OF_MEMORY;
    }
    for (int64_t i = 0; i < count; ++i) watch[i] = approach[i] / contact->units.length;
    contact->query_count = count;
    contact->query_label = watch;
    return HS_OK;
}
