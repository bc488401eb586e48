/* What all friction groups carry together, and at which approach they carry it. */

#include "internal.h"

static int one_each(const hs_contact *contact) { return contact->groups > 1 && contact->groups == contact->count; }

/* Terms of the limit and of the slopes, of asperities that touch and are groups of their own. */
HS_WIDE static void limits(const double *restrict gap, const double *restrict weight, const double *restrict friction,
                           int count, double d, double *restrict limit, double *restrict limit_slope,
                           double *restrict load_slope) {
    for (int i = 0; i < count; ++i) {
        double depth = d - gap[i], half_chord = weight[i] * sqrt(depth);
        limit[i] = friction[i] * half_chord * depth;
        limit_slope[i] = friction[i] * half_chord;
        load_slope[i] = half_chord;
    }
}

hs_limit hs_limit_and_slopes(const hs_memory *memory, double d) {
    const hs_contact *contact = memory->contact;
    const double *friction = memory->friction;
    if (one_each(contact)) {
        int64_t count = hs_touching(contact->gap, contact->count, d);
        double limit[HS_LANES] = {0}, limit_slope[HS_LANES] = {0}, load_slope[HS_LANES] = {0};
        double term[3][HS_AT_ONCE];
        for (int64_t begin = 0; begin < count; begin += HS_AT_ONCE) {
            int size = hs_size_of_block(count - begin);
            limits(contact->gap + begin, contact->weight + begin, friction + begin, size, d, term[0], term[1], term[2]);
            hs_add(limit, term[0], size);
            hs_add(limit_slope, term[1], size);
            hs_add(load_slope, term[2], size);
        }
        return (hs_limit){hs_lanes_sum(limit), 1.5 * hs_lanes_sum(limit_slope), 1.5 * hs_lanes_sum(load_slope)};
    }
    hs_limit found = {0.0, 0.0, 0.0};
    for (int64_t index = 0; index < contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        if (group.curve.gap[0] >= d) break;
        hs_load here = hs_load_at(group.curve, d);
        found.limit += friction[index] * here.load;
        found.limit_slope += friction[index] * here.slope;
        found.load_slope += here.slope;
    }
    return found;
}

double hs_friction_limit(const hs_memory *memory, double d, double load) {
    if (memory->contact->groups == 1) return memory->friction[0] * load;
    return hs_limit_and_slopes(memory, d).limit;
}

double hs_total_force(const hs_memory *memory) {
    double force = 0.0;
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index)
        force += memory->vertices[index * memory->capacity + memory->depth[index] - 1].tangential;
    return force;
}

double hs_least_friction(const hs_memory *memory) {
    double least = memory->friction[0];
    for (int64_t index = 1; index < memory->contact->groups; ++index) least = hs_least(least, memory->friction[index]);
    return least;
}

double hs_largest_friction(const hs_memory *memory) {
    double most = memory->friction[0];
    for (int64_t index = 1; index < memory->contact->groups; ++index) most = hs_most(most, memory->friction[index]);
    return most;
}

HS_WIDE static void loads_of_ones(const double *restrict gap, const double *restrict weight, int64_t count, double d,
                          double *restrict load) {
    for (int64_t i = 0; i < count; ++i) {
        double depth = d - gap[i];
        load[i] = weight[i] * sqrt(depth) * depth;
    }
}

/* Normal loads of the groups that touch at d, where they carry `load` together. */
int hs_loads_of_groups(const hs_memory *memory, double d, double load, hs_group_loads *loads) {
    const hs_contact *contact = memory->contact;
    int64_t count;
    loads->load = loads->one;
    loads->from = NULL;
    if (contact->groups == 1) {
        loads->count = d > contact->sorted_gap[0];
        loads->one[0] = load;
        return HS_OK;
    }
    if (one_each(contact))
        count = hs_touching(contact->gap, contact->count, d);
    else
        for (count = 0; count < contact->groups && contact->gap[contact->first[count]] < d;) ++count;
    loads->count = count;
    if (count == 0) return HS_OK;
    loads->load = (double *)malloc((size_t)count * sizeof(double));
    if (!loads->load) return HS_OUT_OF_MEMORY;
    if (one_each(contact)) {
        loads_of_ones(contact->gap, contact->weight, count, d, loads->load);
        return HS_OK;
    }
    for (int64_t index = 0; index < count; ++index)
        loads->load[index] = hs_load_at(hs_group_of(memory, index).curve, d).load;
    return HS_OK;
}

void hs_free_group_loads(hs_group_loads *loads) {
    if (loads->load != loads->one) free(loads->load);
}

double hs_approach_for(const hs_memory *memory, double load) {
    double present = memory->approach;
    if (load == memory->normal_load) return present;
    if (load <= 0.0) return hs_least(present, memory->contact->sorted_gap[0]);
    double approach = hs_label_at(hs_all_of(memory->contact), load, present, 0.0, 1.0);
    for (int64_t j = memory->depth[0] - 1; j > 0; --j) {
        double label = memory->vertices[j].label;
        if (fabs(label - approach) <= 4.0 * DBL_EPSILON * approach) return label;
        if (label < approach) break;
    }
    return approach;
}
