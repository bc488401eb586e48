/* Memory: allocates, copies and compares traction memories, and regroups their asperities: splits
 * and joins groups, and replaces gaps and weights. Polylines w(a) are copied unchanged; loads of
 * their vertices are recomputed (README.md, theory 6 and 9). Sliding times are shared by copies,
 * copied on write. */

#include "state.h"
#include "contact.h"

struct hs_slides *hs_slides_retain(struct hs_slides *slides) {
    if (slides) __atomic_add_fetch(&slides->references, 1, __ATOMIC_RELAXED);
    return slides;
}

void hs_slides_release(struct hs_slides *slides) {
    if (slides && __atomic_sub_fetch(&slides->references, 1, __ATOMIC_ACQ_REL) == 0) free(slides);
}

struct hs_slides *hs_slides_unshare(hs_line *memory) {
    struct hs_slides *shared = memory->slides;
    if (shared && __atomic_load_n(&shared->references, __ATOMIC_ACQUIRE) == 1) return shared;
    size_t count = (size_t)hs_slide_count(memory->contact);
    struct hs_slides *copy = (struct hs_slides *)malloc(sizeof *copy + count * sizeof(double));
    if (!copy) {
        memory->lost_slides = 1;
        return NULL;
    }
    copy->references = 1;
    hs_line_slide_times(memory, copy->time);
    hs_slides_release(shared);
    return memory->slides = copy;
}

void hs_line_slide_times(const hs_line *memory, double *time) {
    int64_t count = hs_slide_count(memory->contact);
    memory = hs_active(memory);
    if (memory->slides) memcpy(time, memory->slides->time, (size_t)count * sizeof *time);
    for (int64_t i = 0; i < count && !memory->slides; ++i) time[i] = NAN;
}

void hs_line_forget_slides(hs_line *memory) {
    memory = hs_active(memory);
    hs_slides_release(memory->slides);
    memory->slides = NULL;
    memory->slid_labels[0] = memory->slid_labels[1] = 0.0;
}

int hs_slides_assign(hs_line *memory, const double *time) {
    struct hs_slides *slides = hs_slides_unshare(memory);
    if (!slides) return HS_OUT_OF_MEMORY;
    if (time) memcpy(slides->time, time, (size_t)hs_slide_count(memory->contact) * sizeof *time);
    return HS_OK;
}

static hs_evolved *new_evolved(int64_t count, int yields) {
    size_t n = (size_t)count, array_count = hs_evolved_arrays(yields);
    hs_evolved *evolved =
        (hs_evolved *)calloc(1, sizeof *evolved + array_count * n * sizeof(double) + n);
    if (!evolved) return NULL;
    double *numbers = (double *)(evolved + 1);
    double **arrays[] = {&evolved->summit_height, &evolved->summit_radius,  &evolved->slid_distance,
                         &evolved->worn_volume,   &evolved->waiting_volume, &evolved->shaped_volume,
                         &evolved->virgin_height, &evolved->virgin_radius,  &evolved->yielded_to,
                         &evolved->yielding_load, &evolved->yielding_energy};
    for (size_t k = 0; k < array_count; ++k) *arrays[k] = numbers + k * n;
    evolved->friction_overridden = (uint8_t *)(numbers + array_count * n);
    return evolved;
}

/* Copy evolved summits; the target may have arrays of yielding that the source has not. */
static void copy_evolved(hs_evolved *target, const hs_evolved *source, int64_t count) {
    size_t n = (size_t)count, arrays = hs_evolved_arrays(source->virgin_height != NULL);
    memcpy(target->summit_height, source->summit_height, arrays * n * sizeof(double));
    memcpy(target->friction_overridden, source->friction_overridden, n);
    target->slid_together = source->slid_together;
    target->erased_memories = source->erased_memories;
    target->erased_energy = source->erased_energy;
    target->yielded_energy = source->yielded_energy;
}

size_t hs_far_count(const hs_contact *contact) {
    return contact->clusters ? (size_t)contact->clusters->total * HS_PROXIES : 0;
}

/* Bytes of the block of friction, dissipated energies, depths and steep flags. */
static size_t size_of_numbers(const hs_contact *contact) {
    return (size_t)contact->groups * 17 + ((size_t)contact->count + hs_far_count(contact)) * 8;
}

int hs_line_init(hs_line *memory, hs_contact *contact, int64_t capacity, int evolves) {
    size_t groups = (size_t)contact->groups, count = (size_t)contact->count;
    memory->contact = hs_contact_retain(contact);
    memory->friction = (double *)malloc(size_of_numbers(contact));
    memory->vertices = (hs_vertex *)malloc(groups * (size_t)capacity * sizeof *memory->vertices);
    memory->evolved = evolves ? new_evolved(contact->count, evolves > 1) : NULL;
    if (!memory->friction || !memory->vertices || (evolves && !memory->evolved)) {
        hs_line_clear(memory);
        return HS_OUT_OF_MEMORY;
    }
    memory->dissipated_each = memory->friction + groups;
    memory->far_energy = contact->clusters ? memory->dissipated_each + count : NULL;
    memory->depth = (int64_t *)(memory->dissipated_each + count + hs_far_count(contact));
    memory->steep = (uint8_t *)(memory->depth + groups);
    memory->capacity = capacity;
    memory->normal_control = memory->tangential_control = HS_LOAD;
    memory->known_label = memory->known_slope = NAN;
    hs_set_clock(memory, NAN);
    return HS_OK;
}

hs_line *hs_line_blank(hs_contact *contact, int64_t capacity, int evolves) {
    hs_line *memory = (hs_line *)calloc(1, sizeof *memory);
    if (memory && hs_line_init(memory, contact, capacity, evolves) == HS_OK) return memory;
    free(memory);
    return NULL;
}

/* FNV-1a hash of words of 8 bytes, with a shift after each word that spreads its upper bits. */
uint64_t hs_digest(uint64_t digest, const void *bytes, size_t size) {
    const unsigned char *data = (const unsigned char *)bytes;
    for (size_t done = 0; done < size; done += 8) {
        uint64_t word = 0;
        memcpy(&word, data + done, size - done < 8 ? size - done : 8);
        digest = (digest ^ word) * 1099511628211u;
        digest ^= digest >> 32;
    }
    return digest;
}

/* Hash of the units, datum, arrays and initial friction coefficients of a contact. */
static uint64_t identity_of(const hs_contact *contact, const double *friction) {
    size_t size = (size_t)contact->count * sizeof(double);
    uint64_t digest = hs_digest((uint64_t)contact->count, &contact->units, sizeof contact->units);
    digest = hs_digest(digest, &contact->datum, sizeof contact->datum);
    const void *arrays[] = {contact->gap, contact->weight, contact->order, friction};
    for (int k = 0; k < 4; ++k) digest = hs_digest(digest, arrays[k], size);
    return hs_digest(digest, contact->first,
                     (size_t)(contact->groups + 1) * sizeof *contact->first);
}

int hs_line_belongs(const hs_line *memory, const hs_line *like) {
    const hs_contact *contact = memory->contact, *reference = like->contact;
    /* the identity implies all other conditions, except in forged bytes */
    return memory->identity == like->identity && contact->count == reference->count &&
           !contact->load == !reference->load &&
           memcmp(&contact->units, &reference->units, sizeof contact->units) == 0 &&
           contact->datum == reference->datum && (hs_evolves(memory) > 1) == (hs_evolves(like) > 1);
}

int hs_can_evolve(const hs_line *memory, const hs_evolution *evolution) {
    int yields = evolution->yielding.kind != HS_NO_YIELDING;
    return hs_evolves(memory) > yields &&
           ((!yields && !evolution->goal) || evolution->count == memory->contact->count);
}

int hs_line_start(hs_line *memory, hs_contact *contact, const double *friction) {
    if (hs_line_init(memory, contact, 4, 0) != HS_OK) return HS_OUT_OF_MEMORY;
    memory->identity = identity_of(contact, friction);
    memset(memory->friction, 0, size_of_numbers(contact));
    for (int64_t index = 0; index < contact->groups; ++index)
        memory->friction[index] =
            hs_bound_friction(friction[contact->order[contact->first[index]]]);
    return HS_OK;
}

int hs_line_add_evolved(hs_line *memory) {
    const hs_contact *contact = memory->contact;
    if (memory->evolved) return HS_OK;
    memory->evolved = new_evolved(contact->count, 0);
    if (!memory->evolved) return HS_OUT_OF_MEMORY;
    hs_settle_energies(memory);
    for (int64_t i = 0; i < contact->count; ++i) {
        double weight = contact->weight[i];
        memory->evolved->summit_height[contact->order[i]] =
            contact->datum - contact->gap[i] * contact->units.length;
        memory->evolved->summit_radius[contact->order[i]] = weight * weight * contact->units.radius;
    }
    return HS_OK;
}

void hs_sum_yielded(hs_evolved *evolved, int64_t count) {
    evolved->yielded_energy = 0.0;
    for (int64_t i = 0; i < count; ++i) evolved->yielded_energy += evolved->yielding_energy[i];
}

int hs_line_add_yielded(hs_line *memory) {
    size_t count = (size_t)memory->contact->count;
    if (memory->evolved && memory->evolved->virgin_height) return HS_OK;
    int status = hs_line_add_evolved(memory);
    hs_evolved *evolved = status == HS_OK ? new_evolved(memory->contact->count, 1) : NULL;
    if (!evolved) return HS_OUT_OF_MEMORY;
    copy_evolved(evolved, memory->evolved, memory->contact->count);
    memcpy(evolved->virgin_height, evolved->summit_height, count * sizeof(double));
    memcpy(evolved->virgin_radius, evolved->summit_radius, count * sizeof(double));
    free(memory->evolved);
    memory->evolved = evolved;
    return HS_OK;
}

void hs_line_clear(hs_line *memory) {
    hs_slides_release(memory->slides);
    hs_contact_free(memory->contact);
    free(memory->friction);
    free(memory->vertices);
    free(memory->evolved);
    hs_line_free(memory->scaled);
}

void hs_line_free(hs_line *memory) {
    if (!memory) return;
    hs_line_clear(memory);
    free(memory);
}

void hs_line_swap(hs_line *memory, hs_line *counterpart) {
    hs_line copy = *memory;
    *memory = *counterpart;
    *counterpart = copy;
}

void hs_line_take(hs_line *memory, hs_line *replacement) {
    hs_line_swap(memory, replacement);
    hs_line_free(replacement);
}

static void copy_scalars(hs_line *target, const hs_line *source) {
    if (target->slides != source->slides) {
        hs_slides_release(target->slides);
        target->slides = hs_slides_retain(source->slides);
    }
    memcpy(&target->approach, &source->approach, sizeof *target - offsetof(hs_line, approach));
}

static void copy_numbers(hs_line *target, const hs_line *source) {
    copy_scalars(target, source);
    memcpy(target->friction, source->friction, size_of_numbers(source->contact));
    if (target->evolved) copy_evolved(target->evolved, source->evolved, source->contact->count);
}

static void copy_stacks(hs_line *target, const hs_line *source) {
    for (int64_t index = 0; index < source->contact->groups; ++index)
        memcpy(target->vertices + index * target->capacity,
               source->vertices + index * source->capacity,
               (size_t)source->depth[index] * sizeof *target->vertices);
}

int64_t hs_max_depth(const hs_line *memory) {
    int64_t max_depth = 0;
    /* within a substep, groups without vertices may stand before others that have some: summits
     * that yield */
    for (int64_t index = 0; index < memory->contact->groups; ++index)
        if (memory->depth[index] > max_depth) max_depth = memory->depth[index];
    return max_depth;
}

int hs_has_steep(const hs_line *memory) {
    return memchr(memory->steep, 1, (size_t)memory->contact->groups) != NULL;
}

int hs_line_init_copy(hs_line *memory, const hs_line *from) {
    if (hs_line_init(memory, from->contact, hs_max_depth(from) + 4, hs_evolves(from)) != HS_OK)
        return HS_OUT_OF_MEMORY;
    if (from->scaled && !(memory->scaled = hs_line_copy(from->scaled))) {
        hs_line_clear(memory);
        return HS_OUT_OF_MEMORY;
    }
    copy_numbers(memory, from);
    copy_stacks(memory, from);
    return HS_OK;
}

hs_line *hs_line_copy(const hs_line *memory) {
    hs_line *copy = (hs_line *)calloc(1, sizeof *copy);
    if (copy && hs_line_init_copy(copy, memory) == HS_OK) return copy;
    free(copy);
    return NULL;
}

int hs_line_unshare_contact(hs_line *memory) {
    hs_contact *copy = hs_contact_copy(memory->contact);
    if (!copy) return HS_OUT_OF_MEMORY;
    hs_contact_free(memory->contact);
    memory->contact = copy;
    return HS_OK;
}

int hs_line_reserve(hs_line *memory, int64_t capacity) {
    if (capacity <= memory->capacity) return HS_OK;
    hs_line grown = *memory;
    grown.vertices = (hs_vertex *)malloc((size_t)memory->contact->groups * (size_t)capacity *
                                         sizeof *grown.vertices);
    if (!grown.vertices) return HS_OUT_OF_MEMORY;
    grown.capacity = capacity;
    copy_stacks(&grown, memory);
    free(memory->vertices);
    memory->vertices = grown.vertices;
    memory->capacity = capacity;
    return HS_OK;
}

int hs_line_assign(hs_line *memory, const hs_line *from) {
    if (memory->contact->groups != from->contact->groups || !hs_line_belongs(memory, from))
        return HS_FOREIGN;
    if (hs_line_reserve(memory, hs_max_depth(from) + 2) != HS_OK) return HS_OUT_OF_MEMORY;
    if (memory->scaled && from->scaled && memory->scaled->contact == from->scaled->contact) {
        if (hs_line_assign(memory->scaled, from->scaled) != HS_OK) return HS_OUT_OF_MEMORY;
    } else {
        hs_line_free(memory->scaled);
        memory->scaled = from->scaled ? hs_line_copy(from->scaled) : NULL;
        if (from->scaled && !memory->scaled) return HS_OUT_OF_MEMORY;
    }
    copy_numbers(memory, from);
    copy_stacks(memory, from);
    return HS_OK;
}

void hs_dissipated_energies(const hs_line *memory, int64_t start, int64_t count, double *energy) {
    memcpy(energy, memory->dissipated_each + start, (size_t)count * sizeof *energy);
    if (memory->far_energy)
        hs_interpolate_far(memory->contact->clusters, memory->far_energy, start, start + count,
                           energy);
}

void hs_settle_energies(hs_line *memory) {
    const hs_contact *contact = memory->contact;
    if (!memory->far_energy) return;
    hs_interpolate_far(contact->clusters, memory->far_energy, 0, contact->count,
                       memory->dissipated_each);
    memset(memory->far_energy, 0, hs_far_count(contact) * sizeof(double));
}

int64_t hs_line_contact_count(const hs_line *memory) {
    return hs_count_touching(memory->contact->sorted_gap, memory->contact->count, memory->approach);
}

double hs_total_force(const hs_line *memory) {
    double force = 0.0;
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index)
        force += memory->vertices[index * memory->capacity + memory->depth[index] - 1].tangential;
    return force;
}

void hs_refresh_loads(hs_line *memory) {
    memory->known_label = NAN;
    for (int64_t index = 0; index < memory->contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        for (int64_t j = 0; j < memory->depth[index]; ++j) {
            hs_vertex *vertex = group.stack + j;
            vertex->normal = hs_load_at(group.curve, vertex->label).load;
            vertex->tangential =
                j ? vertex[-1].tangential + vertex->slope * (vertex->normal - vertex[-1].normal)
                  : 0.0;
        }
    }
}

void hs_touch_unstrained(hs_line *memory, int64_t index) {
    hs_vertex *stack = memory->vertices + index * memory->capacity;
    double gap = memory->contact->gap[memory->contact->first[index]], v = memory->displacement;
    stack[0] = HS_MADE(hs_vertex){gap, v, 0.0, v, 0.0, 0.0};
    stack[1] =
        HS_MADE(hs_vertex){memory->approach,
                           v,
                           0.0,
                           v,
                           hs_load_at(hs_group_of(memory, index).curve, memory->approach).load,
                           0.0};
    memory->depth[index] = gap < memory->approach ? 2 : 0;
    memory->steep[index] = 0;
}

/* Create the memory of a contact whose groups are subsets of the groups of another. Each subset
 * keeps the polyline of its group
 * (`parent`), unless its asperities are `fresh`: their springs are unstrained. `position` holds the
 * previous positions. Arrays are in the caller's numbering. NULL if out of memory. */
static hs_line *subdivide(const hs_line *memory, hs_contact *contact, const int64_t *parent,
                          const int64_t *position, const uint8_t *fresh, int evolves) {
    hs_line *result = hs_line_blank(contact, hs_max_depth(memory) + 2, evolves);
    if (!result) return NULL;
    copy_scalars(result, memory);
    result->slid_labels[0] = result->slid_labels[1] = 0.0;
    if (result->evolved) copy_evolved(result->evolved, memory->evolved, contact->count);
    for (int64_t i = 0; i < contact->count; ++i)
        hs_dissipated_energies(memory, position[contact->order[i]], 1, result->dissipated_each + i);
    if (result->far_energy) memset(result->far_energy, 0, hs_far_count(contact) * sizeof(double));
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t leader = contact->order[contact->first[index]], from = parent[leader];
        int touches = contact->gap[contact->first[index]] < memory->approach;
        result->friction[index] = memory->friction[from];
        result->depth[index] = touches ? memory->depth[from] : 0;
        result->steep[index] = touches && memory->steep[from];
        if ((fresh && fresh[leader]) || result->depth[index] == 0)
            hs_touch_unstrained(result, index);
        else
            memcpy(result->vertices + index * result->capacity,
                   memory->vertices + from * memory->capacity,
                   (size_t)result->depth[index] * sizeof *result->vertices);
    }
    hs_refresh_loads(result);
    return result;
}

/* Assign asperities to other groups, with other gaps and weights unless these are NULL; arrays are
 * in the caller's numbering. */
static int regroup(hs_line *memory, int64_t groups, const int64_t *group, const double *gap,
                   const double *weight, const uint8_t *fresh) {
    const hs_contact *contact = memory->contact;
    hs_settle_energies(memory);
    int64_t count = contact->count, *parent = (int64_t *)malloc(4 * (size_t)count * sizeof *parent),
            *position = parent + count;
    if (!parent) return HS_OUT_OF_MEMORY;
    double *present_gap = (double *)(position + count), *present_weight = present_gap + count;
    for (int64_t index = 0; index < contact->groups; ++index)
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i) {
            parent[contact->order[i]] = index;
            position[contact->order[i]] = i;
            present_gap[contact->order[i]] = contact->gap[i];
            present_weight[contact->order[i]] = contact->weight[i];
        }
    hs_contact *shaped =
        hs_contact_of(count, groups, gap ? gap : present_gap, weight ? weight : present_weight,
                      group, 0, &contact->units, contact->datum);
    hs_line *result =
        shaped ? subdivide(memory, shaped, parent, position, fresh, hs_evolves(memory)) : NULL;
    if (result && fresh) {
        result->normal_load = hs_load_at(hs_all_of(shaped), result->approach).load;
        result->tangential_load = hs_total_force(result);
    }
    if (result) hs_line_take(memory, result);
    hs_contact_free(shaped);
    free(parent);
    return result ? HS_OK : HS_OUT_OF_MEMORY;
}

/* Number subsets of groups by pairs of keys, given by asperity: asperities of one group with equal
 * keys form one subset. */
static int number_subgroups(const hs_contact *contact, const double *primary_key,
                            const double *secondary_key, int64_t *group, int64_t *groups) {
    int64_t *position = (int64_t *)malloc((size_t)contact->count * sizeof *position), number = 0;
    if (!position) return HS_OUT_OF_MEMORY;
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t start = contact->first[index], size = contact->first[index + 1] - start;
        memcpy(position, contact->order + start, (size_t)size * sizeof *position);
        if (hs_sort_by(secondary_key, position, size) != HS_OK ||
            hs_sort_by(primary_key, position, size) != HS_OK) {
            free(position);
            return HS_OUT_OF_MEMORY;
        }
        for (int64_t i = 0; i < size; ++i) {
            int alike = i > 0 && primary_key[position[i]] == primary_key[position[i - 1]] &&
                        secondary_key[position[i]] == secondary_key[position[i - 1]];
            number += !alike;
            group[position[i]] = number - 1;
        }
    }
    *groups = number;
    free(position);
    return HS_OK;
}

int hs_split_groups(hs_line *memory, const double *primary_key, const double *secondary_key) {
    const hs_contact *contact = memory->contact;
    int64_t groups = 0, *group = (int64_t *)malloc((size_t)contact->count * sizeof *group);
    int status = group ? number_subgroups(contact, primary_key, secondary_key, group, &groups)
                       : (int)HS_OUT_OF_MEMORY;
    /* a curve with knots cannot be split */
    if (status == HS_OK && groups > contact->groups)
        status = contact->load ? (int)HS_FOREIGN : regroup(memory, groups, group, NULL, NULL, NULL);
    free(group);
    return status;
}

int hs_reshape(hs_line *memory, const double *gap, const double *weight, const uint8_t *fresh) {
    size_t count = (size_t)memory->contact->count;
    int64_t groups = 0, *group = (int64_t *)malloc(2 * count * sizeof *group);
    double *key = (double *)(group + count);
    if (!group) return HS_OUT_OF_MEMORY;
    /* fresh asperities of a group form one group */
    for (size_t i = 0; i < count; ++i) key[i] = fresh[i];
    int status = number_subgroups(memory->contact, key, key, group, &groups);
    if (status == HS_OK) status = regroup(memory, groups, group, gap, weight, fresh);
    free(group);
    return status;
}

int hs_unstrained(const hs_line *memory) {
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index)
        for (int64_t j = 0; j < memory->depth[index]; ++j)
            if (memory->vertices[index * memory->capacity + j].anchor != memory->displacement)
                return 0;
    return 1;
}

int hs_slides_alike(const hs_line *memory) {
    const hs_vertex *stack = memory->vertices;
    double side = memory->depth[0] == 2 ? copysign(1.0, stack[1].slope) : 0.0;
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index) {
        stack = memory->vertices + index * memory->capacity;
        if (memory->depth[index] != 2 || memory->steep[index]) return 0;
        if (stack[1].slope != side * memory->friction[index] ||
            stack[1].anchor != memory->displacement)
            return 0;
    }
    return side != 0.0;
}

int hs_join_groups(hs_line *memory, const double *gap, const double *weight, double approach,
                   int unstrained) {
    const hs_contact *contact = memory->contact;
    size_t count = (size_t)contact->count, groups = (size_t)contact->groups;
    int64_t joined_count = 0, *group = (int64_t *)malloc((count + groups) * sizeof *group + count),
            *joined_group = group + count;
    uint8_t *fresh = (uint8_t *)(joined_group + groups);
    if (!group) return HS_OUT_OF_MEMORY;
    for (size_t index = 0; index < groups; ++index) {
        size_t k = 0;
        while (k < index && memory->friction[k] != memory->friction[index]) ++k;
        joined_group[index] = k < index ? joined_group[k] : joined_count++;
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i)
            group[contact->order[i]] = joined_group[index];
    }
    memset(fresh, unstrained, count);
    memory->approach = approach;
    int status = regroup(memory, joined_count, group, gap, weight, fresh);
    free(group);
    return status;
}

int hs_line_init_single(hs_line *memory, const hs_line *from, int64_t asperity) {
    const hs_contact *contact = from->contact;
    int64_t position = 0, group = 0;
    while (contact->order[position] != asperity) ++position;
    while (contact->first[group + 1] <= position) ++group;
    hs_contact *single_contact =
        hs_contact_of(1, 1, contact->gap + position, contact->weight + position, NULL, 0,
                      &contact->units, contact->datum);
    hs_line *result =
        single_contact ? subdivide(from, single_contact, &group, &position, NULL, 0) : NULL;
    hs_contact_free(single_contact);
    if (!result) return HS_OUT_OF_MEMORY;
    *memory = *result;
    free(result);
    hs_line_forget_slides(memory);
    memory->identity = hs_digest(from->identity, &asperity, sizeof asperity);
    memory->steep[0] = from->steep[group];
    memory->normal_load = hs_load_at(hs_all_of(memory->contact), memory->approach).load;
    memory->tangential_load = hs_total_force(memory);
    return HS_OK;
}
