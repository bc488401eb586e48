/* Memory: allocates, copies and compares states, and regroups their asperities: groups are split or joined, and summits get other
 * gaps and weights. Histories w(a) are copied unchanged; loads of their vertices follow (README.md, theory 6 and 9). Sliding times
 * are shared by copies and copied before they are changed. */

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
    if (memory->slides) memcpy(time, memory->slides->time, (size_t)count * sizeof *time);
    for (int64_t i = 0; i < count && !memory->slides; ++i) time[i] = NAN;
}

void hs_line_forget_slides(hs_line *memory) {
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

static hs_evolved *evolved_of(int64_t count, int yields) {
    size_t n = (size_t)count, arrays = hs_evolved_arrays(yields);
    hs_evolved *evolved = (hs_evolved *)calloc(1, sizeof *evolved + arrays * n * sizeof(double) + n);
    if (!evolved) return NULL;
    double *numbers = (double *)(evolved + 1);
    double **each[] = {&evolved->summit_height,  &evolved->summit_radius,  &evolved->slid_distance,
                       &evolved->worn_volume,    &evolved->waiting_volume, &evolved->shaped_volume,
                       &evolved->virgin_height,  &evolved->virgin_radius,  &evolved->yielded_to,
                       &evolved->yielding_load,  &evolved->yielding_energy};
    for (size_t k = 0; k < arrays; ++k) *each[k] = numbers + k * n;
    evolved->friction_overridden = (uint8_t *)(numbers + arrays * n);
    return evolved;
}

/* Copy what asperities have become; the target may also follow how they yield, where the source does not. */
static void copy_evolved(hs_evolved *target, const hs_evolved *source, int64_t count) {
    size_t n = (size_t)count, arrays = hs_evolved_arrays(source->virgin_height != NULL);
    memcpy(target->summit_height, source->summit_height, arrays * n * sizeof(double));
    memcpy(target->friction_overridden, source->friction_overridden, n);
    target->slid_together = source->slid_together;
    target->erased_memories = source->erased_memories;
    target->erased_energy = source->erased_energy;
    target->yielded_energy = source->yielded_energy;
}

/* friction, what each has dissipated, depths and whether steep stand in one block */
static size_t size_of_numbers(const hs_contact *contact) {
    return (size_t)contact->groups * 17 + (size_t)contact->count * 8;
}

/* Set up the memory of a contact that does not touch; its arrays are not filled in. */
int hs_line_init(hs_line *memory, hs_contact *contact, int64_t capacity, int evolves) {
    size_t groups = (size_t)contact->groups, count = (size_t)contact->count;
    memory->contact = hs_contact_retain(contact);
    memory->friction = (double *)malloc(size_of_numbers(contact));
    memory->vertices = (hs_vertex *)malloc(groups * (size_t)capacity * sizeof *memory->vertices);
    memory->evolved = evolves ? evolved_of(contact->count, evolves > 1) : NULL;
    if (!memory->friction || !memory->vertices || (evolves && !memory->evolved)) {
        hs_line_clear(memory);
        return HS_OUT_OF_MEMORY;
    }
    memory->dissipated_each = memory->friction + groups;
    memory->depth = (int64_t *)(memory->dissipated_each + count);
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

/* FNV-1a of words in place of bytes, each of which is spread over all bits. */
uint64_t hs_digest(uint64_t before, const void *bytes, size_t size) {
    const unsigned char *at = (const unsigned char *)bytes;
    for (size_t done = 0; done < size; done += 8) {
        uint64_t word = 0;
        memcpy(&word, at + done, size - done < 8 ? size - done : 8);
        before = (before ^ word) * 1099511628211u;
        before ^= before >> 32;
    }
    return before;
}

/* All that a contact is made of, and its coefficients at the start. */
static uint64_t identity_of(const hs_contact *contact, const double *friction) {
    size_t size = (size_t)contact->count * sizeof(double);
    uint64_t found = hs_digest((uint64_t)contact->count, &contact->units, sizeof contact->units);
    found = hs_digest(found, &contact->datum, sizeof contact->datum);
    const void *arrays[] = {contact->gap, contact->weight, contact->order, friction};
    for (int k = 0; k < 4; ++k) found = hs_digest(found, arrays[k], size);
    return hs_digest(found, contact->first, (size_t)(contact->groups + 1) * sizeof *contact->first);
}

int hs_line_belongs(const hs_line *memory, const hs_line *like) {
    const hs_contact *one = memory->contact, *other = like->contact;
    /* all but the first are so where nobody has forged it */
    return memory->identity == like->identity && one->count == other->count && !one->load == !other->load &&
           memcmp(&one->units, &other->units, sizeof one->units) == 0 && one->datum == other->datum &&
           (hs_evolves(memory) > 1) == (hs_evolves(like) > 1);
}

int hs_can_evolve(const hs_line *memory, const hs_evolution *evolution) {
    int yields = evolution->yielding.kind != HS_NO_YIELDING;
    return hs_evolves(memory) > yields && ((!yields && !evolution->goal) || evolution->count == memory->contact->count);
}

int hs_line_start(hs_line *memory, hs_contact *contact, const double *friction) {
    if (hs_line_init(memory, contact, 4, 0) != HS_OK) return HS_OUT_OF_MEMORY;
    memory->identity = identity_of(contact, friction);
    memset(memory->friction, 0, size_of_numbers(contact));
    for (int64_t index = 0; index < contact->groups; ++index)
        memory->friction[index] = hs_bound_friction(friction[contact->order[contact->first[index]]]);
    return HS_OK;
}

int hs_line_add_evolved(hs_line *memory) {
    const hs_contact *contact = memory->contact;
    if (memory->evolved) return HS_OK;
    memory->evolved = evolved_of(contact->count, 0);
    if (!memory->evolved) return HS_OUT_OF_MEMORY;
    for (int64_t i = 0; i < contact->count; ++i) {
        double weight = contact->weight[i];
        memory->evolved->summit_height[contact->order[i]] = contact->datum - contact->gap[i] * contact->units.length;
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
    hs_evolved *evolved = status == HS_OK ? evolved_of(memory->contact->count, 1) : NULL;
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
}

void hs_line_free(hs_line *memory) {
    if (!memory) return;
    hs_line_clear(memory);
    free(memory);
}

void hs_line_swap(hs_line *one, hs_line *other) {
    hs_line kept = *one;
    *one = *other;
    *other = kept;
}

void hs_line_take(hs_line *memory, hs_line *other) {
    hs_line_swap(memory, other);
    hs_line_free(other);
}

static void copy_now(hs_line *target, const hs_line *source) {
    if (target->slides != source->slides) {
        hs_slides_release(target->slides);
        target->slides = hs_slides_retain(source->slides);
    }
    memcpy(&target->approach, &source->approach, sizeof *target - offsetof(hs_line, approach));
}

static void copy_numbers(hs_line *target, const hs_line *source) {
    copy_now(target, source);
    memcpy(target->friction, source->friction, size_of_numbers(source->contact));
    if (target->evolved) copy_evolved(target->evolved, source->evolved, source->contact->count);
}

static void copy_stacks(hs_line *target, const hs_line *source) {
    for (int64_t index = 0; index < source->contact->groups; ++index)
        memcpy(target->vertices + index * target->capacity, source->vertices + index * source->capacity,
               (size_t)source->depth[index] * sizeof *target->vertices);
}

int64_t hs_max_depth(const hs_line *memory) {
    int64_t most = 0;
    /* amid a chord summits that yield stand after some that touch on it, and have no vertices yet */
    for (int64_t index = 0; index < memory->contact->groups; ++index)
        if (memory->depth[index] > most) most = memory->depth[index];
    return most;
}

int hs_has_steep(const hs_line *memory) {
    return memchr(memory->steep, 1, (size_t)memory->contact->groups) != NULL;
}

int hs_line_init_copy(hs_line *memory, const hs_line *from) {
    if (hs_line_init(memory, from->contact, hs_max_depth(from) + 4, hs_evolves(from)) != HS_OK) return HS_OUT_OF_MEMORY;
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
    grown.vertices = (hs_vertex *)malloc((size_t)memory->contact->groups * (size_t)capacity * sizeof *grown.vertices);
    if (!grown.vertices) return HS_OUT_OF_MEMORY;
    grown.capacity = capacity;
    copy_stacks(&grown, memory);
    free(memory->vertices);
    memory->vertices = grown.vertices;
    memory->capacity = capacity;
    return HS_OK;
}

int hs_line_assign(hs_line *memory, const hs_line *from) {
    if (memory->contact->groups != from->contact->groups || !hs_line_belongs(memory, from)) return HS_FOREIGN;
    if (hs_line_reserve(memory, hs_max_depth(from) + 2) != HS_OK) return HS_OUT_OF_MEMORY;
    copy_numbers(memory, from);
    copy_stacks(memory, from);
    return HS_OK;
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
                j ? vertex[-1].tangential + vertex->slope * (vertex->normal - vertex[-1].normal) : 0.0;
        }
    }
}

void hs_touch_unstrained(hs_line *memory, int64_t index) {
    hs_vertex *stack = memory->vertices + index * memory->capacity;
    double gap = memory->contact->gap[memory->contact->first[index]], v = memory->displacement;
    stack[0] = HS_MADE(hs_vertex){gap, v, 0.0, v, 0.0, 0.0};
    stack[1] = HS_MADE(hs_vertex){memory->approach, v, 0.0, v, hs_load_at(hs_group_of(memory, index).curve, memory->approach).load, 0.0};
    memory->depth[index] = gap < memory->approach ? 2 : 0;
    memory->steep[index] = 0;
}

/* The memory of a contact whose groups are parts of those of another: each part keeps what its group (`parent`) remembers,
 * unless its asperities are fresh: then springs are not strained. `place` has the earlier positions. Arrays are in the
 * caller's numbering. */
static hs_line *of_parts(const hs_line *memory, hs_contact *contact, const int64_t *parent, const int64_t *place,
                           const uint8_t *fresh, int evolves) {
    hs_line *parts = hs_line_blank(contact, hs_max_depth(memory) + 2, evolves);
    if (!parts) return NULL;
    copy_now(parts, memory);
    parts->slid_labels[0] = parts->slid_labels[1] = 0.0;
    if (parts->evolved) copy_evolved(parts->evolved, memory->evolved, contact->count);
    for (int64_t i = 0; i < contact->count; ++i) parts->dissipated_each[i] = memory->dissipated_each[place[contact->order[i]]];
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t leader = contact->order[contact->first[index]], from = parent[leader];
        int touches = contact->gap[contact->first[index]] < memory->approach;
        parts->friction[index] = memory->friction[from];
        parts->depth[index] = touches ? memory->depth[from] : 0;
        parts->steep[index] = touches && memory->steep[from];
        if ((fresh && fresh[leader]) || parts->depth[index] == 0)
            hs_touch_unstrained(parts, index);
        else
            memcpy(parts->vertices + index * parts->capacity, memory->vertices + from * memory->capacity,
                   (size_t)parts->depth[index] * sizeof *parts->vertices);
    }
    hs_refresh_loads(parts);
    return parts;
}

/* Put asperities (all arrays) into so many other groups, with other gaps and weights unless these are NULL. */
static int regroup(hs_line *memory, int64_t parts, const int64_t *group, const double *gap, const double *weight,
                   const uint8_t *fresh) {
    const hs_contact *contact = memory->contact;
    int64_t count = contact->count, *parent = (int64_t *)malloc(4 * (size_t)count * sizeof *parent), *place = parent + count;
    if (!parent) return HS_OUT_OF_MEMORY;
    double *own_gap = (double *)(place + count), *own_weight = own_gap + count;
    for (int64_t index = 0; index < contact->groups; ++index)
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i) {
            parent[contact->order[i]] = index;
            place[contact->order[i]] = i;
            own_gap[contact->order[i]] = contact->gap[i];
            own_weight[contact->order[i]] = contact->weight[i];
        }
    hs_contact *shaped = hs_contact_of(count, parts, gap ? gap : own_gap, weight ? weight : own_weight, group, 0,
                                       &contact->units, contact->datum);
    hs_line *found = shaped ? of_parts(memory, shaped, parent, place, fresh, hs_evolves(memory)) : NULL;
    if (found && fresh) {
        found->normal_load = hs_load_at(hs_all_of(shaped), found->approach).load;
        found->tangential_load = hs_total_force(found);
    }
    if (found) hs_line_take(memory, found);
    hs_contact_free(shaped);
    free(parent);
    return found ? HS_OK : HS_OUT_OF_MEMORY;
}

/* Number parts of groups by pairs of keys (asperity); those of one group that are alike in both stay together. */
static int part(const hs_contact *contact, const double *first_key, const double *second_key, int64_t *group,
                int64_t *parts) {
    int64_t *place = (int64_t *)malloc((size_t)contact->count * sizeof *place), number = 0;
    if (!place) return HS_OUT_OF_MEMORY;
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t begin = contact->first[index], size = contact->first[index + 1] - begin;
        memcpy(place, contact->order + begin, (size_t)size * sizeof *place);
        if (hs_sort_by(second_key, place, size) != HS_OK || hs_sort_by(first_key, place, size) != HS_OK) {
            free(place);
            return HS_OUT_OF_MEMORY;
        }
        for (int64_t i = 0; i < size; ++i) {
            int alike = i > 0 && first_key[place[i]] == first_key[place[i - 1]] &&
                        second_key[place[i]] == second_key[place[i - 1]];
            number += !alike;
            group[place[i]] = number - 1;
        }
    }
    *parts = number;
    free(place);
    return HS_OK;
}

/* Split groups of which asperities are not alike in a pair of keys (asperity) any more. */
int hs_split_groups(hs_line *memory, const double *first_key, const double *second_key) {
    const hs_contact *contact = memory->contact;
    int64_t parts = 0, *group = (int64_t *)malloc((size_t)contact->count * sizeof *group);
    int status = group ? part(contact, first_key, second_key, group, &parts) : (int)HS_OUT_OF_MEMORY;
    /* knots are one contact */
    if (status == HS_OK && parts > contact->groups)
        status = contact->load ? (int)HS_FOREIGN : regroup(memory, parts, group, NULL, NULL, NULL);
    free(group);
    return status;
}

/* Give asperities other gaps and weights at the present approach and displacement; arrays are in the caller's numbering.
 *
 * Where one is fresh, its contact is new. All others keep the anchors of their springs, as far as these are still in
 * contact. The present loads follow. */
int hs_reshape(hs_line *memory, const double *gap, const double *weight, const uint8_t *fresh) {
    size_t count = (size_t)memory->contact->count;
    int64_t parts = 0, *group = (int64_t *)malloc(2 * count * sizeof *group);
    double *key = (double *)(group + count);
    if (!group) return HS_OUT_OF_MEMORY;
    /* asperities of a group that are fresh together share what they remember from now on */
    for (size_t i = 0; i < count; ++i) key[i] = fresh[i];
    int status = part(memory->contact, key, key, group, &parts);
    if (status == HS_OK) status = regroup(memory, parts, group, gap, weight, fresh);
    free(group);
    return status;
}

int hs_unstrained(const hs_line *memory) {
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index)
        for (int64_t j = 0; j < memory->depth[index]; ++j)
            if (memory->vertices[index * memory->capacity + j].anchor != memory->displacement) return 0;
    return 1;
}

int hs_slides_alike(const hs_line *memory) {
    const hs_vertex *stack = memory->vertices;
    double side = memory->depth[0] == 2 ? copysign(1.0, stack[1].slope) : 0.0;
    for (int64_t index = 0; index < memory->contact->groups && memory->depth[index] > 0; ++index) {
        stack = memory->vertices + index * memory->capacity;
        if (memory->depth[index] != 2 || memory->steep[index]) return 0;
        if (stack[1].slope != side * memory->friction[index] || stack[1].anchor != memory->displacement) return 0;
    }
    return side != 0.0;
}

/* Have those of one coefficient of friction share what they remember from now on, which is the same: nothing where no
 * spring is strained, or that all slide. They get gaps and weights at an approach, in the caller's numbering. */
int hs_join_groups(hs_line *memory, const double *gap, const double *weight, double approach, int unstrained) {
    const hs_contact *contact = memory->contact;
    size_t count = (size_t)contact->count, groups = (size_t)contact->groups;
    int64_t parts = 0, *group = (int64_t *)malloc((count + groups) * sizeof *group + count), *part_of = group + count;
    uint8_t *fresh = (uint8_t *)(part_of + groups);
    if (!group) return HS_OUT_OF_MEMORY;
    for (size_t index = 0; index < groups; ++index) {
        size_t k = 0;
        while (k < index && memory->friction[k] != memory->friction[index]) ++k;
        part_of[index] = k < index ? part_of[k] : parts++;
        for (int64_t i = contact->first[index]; i < contact->first[index + 1]; ++i) group[contact->order[i]] = part_of[index];
    }
    memset(fresh, unstrained, count);
    memory->approach = approach;
    int status = regroup(memory, parts, group, gap, weight, fresh);
    free(group);
    return status;
}

int hs_line_init_one(hs_line *memory, const hs_line *from, int64_t asperity) {
    const hs_contact *contact = from->contact;
    int64_t position = 0, group = 0;
    while (contact->order[position] != asperity) ++position;
    while (contact->first[group + 1] <= position) ++group;
    hs_contact *one = hs_contact_of(1, 1, contact->gap + position, contact->weight + position, NULL, 0, &contact->units,
                                    contact->datum);
    hs_line *found = one ? of_parts(from, one, &group, &position, NULL, 0) : NULL;
    hs_contact_free(one);
    if (!found) return HS_OUT_OF_MEMORY;
    *memory = *found;
    free(found);
    hs_line_forget_slides(memory);
    memory->identity = hs_digest(from->identity, &asperity, sizeof asperity);
    memory->steep[0] = from->steep[group];
    memory->normal_load = hs_load_at(hs_all_of(memory->contact), memory->approach).load;
    memory->tangential_load = hs_total_force(memory);
    return HS_OK;
}
