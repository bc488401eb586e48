/* Memories as bytes, and whether what was read is one.
 *
 * The bytes are: a head, the arrays of the contact, of the memory, its vertices without room above them, what asperities
 * have become, and a checksum (FNV-1a) of all of that. */

#include "internal.h"

#define FORMAT 1
#define EVOLVES 1
#define KNOTS 2
#define YIELDS 4
static const char magic[8] = {'h', 's', 'm', 'e', 'm', 'o', 'r', 'y'};

typedef struct head {
    char magic[8];
    uint32_t format;
    uint32_t order; /* 1 in the byte order of the machine that wrote */
    int64_t count, groups, vertices, what; /* a sum of EVOLVES, KNOTS and YIELDS */
    int64_t normal_control, tangential_control;
    hs_units units;
    double datum;
    double now[6];
    double together[3];
} head;

/* numbers of 8 bytes behind the head; flags of one byte follow them */
static uint64_t numbers_of(const head *given) {
    uint64_t n = (uint64_t)given->count, g = (uint64_t)given->groups;
    return 4 * n + 3 * g + 1 + 6 * (uint64_t)given->vertices + (given->what & EVOLVES ? hs_evolved_arrays((given->what & YIELDS) != 0) * n : 0);
}
static uint64_t flags_of(const head *given) {
    return (uint64_t)given->groups + (given->what & EVOLVES ? (uint64_t)given->count : 0);
}

static uint64_t checksum(const unsigned char *bytes, size_t size) {
    uint64_t sum = 14695981039346656037u;
    for (size_t i = 0; i < size; ++i) sum = (sum ^ bytes[i]) * 1099511628211u;
    return sum;
}

static int64_t vertices_of(const hs_memory *memory) {
    int64_t vertices = 0;
    for (int64_t index = 0; index < memory->contact->groups; ++index) vertices += memory->depth[index];
    return vertices;
}

static head head_of(const hs_memory *memory) {
    const hs_contact *contact = memory->contact;
    head found;
    memset(&found, 0, sizeof found);
    memcpy(found.magic, magic, sizeof magic);
    found.format = FORMAT;
    found.order = 1;
    found.count = contact->count;
    found.groups = contact->groups;
    found.vertices = vertices_of(memory);
    found.what = (memory->evolved ? EVOLVES : 0) + (contact->load ? KNOTS : 0) + (hs_evolves(memory) > 1 ? YIELDS : 0);
    found.normal_control = memory->normal_control;
    found.tangential_control = memory->tangential_control;
    found.units = contact->units;
    found.datum = contact->datum;
    double now[6] = {memory->approach,        memory->displacement, memory->normal_load,
                     memory->tangential_load, memory->dissipated,   memory->excess};
    memcpy(found.now, now, sizeof now);
    if (memory->evolved) {
        found.together[0] = memory->evolved->slid_together;
        found.together[1] = memory->evolved->erased_memories;
        found.together[2] = memory->evolved->erased_energy;
    }
    return found;
}

static size_t size_of(const head *given) {
    return sizeof *given + 8 * (size_t)numbers_of(given) + (size_t)flags_of(given) + sizeof(uint64_t);
}

size_t hs_memory_size(const hs_memory *memory) {
    head whole = head_of(memory);
    for (const struct hs_deep *deep = memory->deep; deep; deep = hs_below(deep)) whole.vertices += HS_BLOCK;
    return size_of(&whole);
}

static unsigned char *put(unsigned char *to, const void *from, size_t size) {
    memcpy(to, from, size);
    return to + size;
}

int hs_memory_write(const hs_memory *memory, void *bytes, size_t size) {
    if (memory->deep) {
        hs_memory *joined;
        const hs_memory *whole = hs_whole(memory, &joined);
        int status = whole ? hs_memory_write(whole, bytes, size) : (int)HS_OUT_OF_MEMORY;
        hs_memory_free(joined);
        return status;
    }
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    head given = head_of(memory);
    size_t n = (size_t)contact->count, g = (size_t)contact->groups;
    if (size != size_of(&given)) return HS_NOT_A_STATE;
    unsigned char *at = put((unsigned char *)bytes, &given, sizeof given);
    at = put(at, contact->gap, 8 * n);
    at = put(at, contact->weight, 8 * n);
    at = put(at, contact->order, 8 * n);
    at = put(at, contact->first, 8 * (g + 1));
    at = put(at, memory->friction, 8 * g);
    at = put(at, memory->each, 8 * n);
    at = put(at, memory->depth, 8 * g);
    for (size_t index = 0; index < g; ++index)
        at = put(at, memory->vertices + index * (size_t)memory->capacity,
                 (size_t)memory->depth[index] * sizeof(hs_vertex));
    if (evolved) at = put(at, evolved->summit_height, hs_evolved_arrays((given.what & YIELDS) != 0) * 8 * n);
    at = put(at, memory->steep, g);
    if (evolved) at = put(at, evolved->given, n);
    uint64_t sum = checksum((const unsigned char *)bytes, size - sizeof sum);
    put(at, &sum, sizeof sum);
    return HS_OK;
}

/* ---- whether it is one ---------------------------------------------------------------------------------------------------- */

static int is_control(int64_t control) { return control == HS_LOAD || control == HS_DISPLACED; }

static int all_finite(const double *numbers, int64_t count) {
    for (int64_t i = 0; i < count; ++i)
        if (!isfinite(numbers[i])) return 0;
    return 1;
}

/* Anchors are rounded as the displacements that were reached once are; so they are not compared with slopes. */
static const char *check_stack(const hs_group *group, int64_t depth, int steep, double approach) {
    const hs_vertex *stack = group->stack;
    double touch = group->curve.gap[0];
    if (depth == 0) return approach > touch ? "a group that touches has no vertices" : NULL;
    if (depth == 1 || approach <= touch) return "the vertices of a group do not fit its approach";
    if (!all_finite((const double *)stack, 6 * depth)) return "a vertex is not finite";
    if (stack[depth - 1].label != approach) return "the contact edge is not at the approach";
    for (int64_t j = 1; j < depth; ++j) {
        if (stack[j].label < stack[j - 1].label) return "labels of vertices do not rise";
        if (!steep && fabs(stack[j].slope) > group->friction) return "a slope is beyond the friction coefficient";
    }
    return NULL;
}

static const char *check_contact(const hs_contact *contact) {
    const double *units = &contact->units.load;
    for (int k = 0; k < 7; ++k)
        if (!(isfinite(units[k]) && units[k] > 0.0)) return "a unit is not a positive number";
    if (!isfinite(contact->datum)) return "the datum is not finite";
    if (!all_finite(contact->gap, contact->count) || !all_finite(contact->weight, contact->count))
        return "a gap or weight is not finite";
    if (contact->first[0] != 0 || contact->first[contact->groups] != contact->count) return "groups do not fit";
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t begin = contact->first[index], end = contact->first[index + 1];
        if (begin < 0 || end <= begin || end > contact->count) return "groups do not fit";
        if (index > 0 && contact->gap[begin] < contact->gap[contact->first[index - 1]]) return "groups are not in order";
        for (int64_t i = begin + 1; i < end; ++i)
            if (contact->gap[i] < contact->gap[i - 1]) return "gaps of a group are not in order";
    }
    return NULL;
}

const char *hs_memory_check(const hs_memory *memory) {
    const hs_contact *contact = memory->contact;
    const char *wrong = check_contact(contact);
    if (wrong) return wrong;
    double now[6] = {memory->approach,        memory->displacement, memory->normal_load,
                     memory->tangential_load, memory->dissipated,   memory->excess};
    if (!all_finite(now, 6)) return "a load, or where the contact is, is not finite";
    if (!all_finite(memory->friction, contact->groups)) return "a friction coefficient is not finite";
    if (!all_finite(memory->each, contact->count)) return "a dissipated energy is not finite";
    if (!is_control(memory->normal_control) || !is_control(memory->tangential_control))
        return "a channel is controlled in no known way";
    for (int64_t index = 0; index < contact->groups; ++index) {
        hs_group group = hs_group_of(memory, index);
        if (memory->friction[index] < 0.0) return "a friction coefficient is negative";
        if (memory->steep[index] > 1) return "a flag is neither 0 nor 1";
        wrong = check_stack(&group, memory->depth[index], memory->steep[index], memory->approach);
        if (wrong) return wrong;
    }
    const hs_evolved *evolved = memory->evolved;
    if (!evolved) return NULL;
    int yields = hs_evolves(memory) > 1;
    if (!all_finite(evolved->summit_height, (int64_t)hs_evolved_arrays(yields) * contact->count))
        return "what an asperity has become is not finite";
    for (int64_t i = 0; i < contact->count; ++i) {
        if (!(evolved->summit_radius[i] > 0.0)) return "a radius is not positive";
        if (yields && !(evolved->virgin_radius[i] > 0.0)) return "a radius is not positive";
        if (yields && !(evolved->yielded_to[i] >= 0.0 && evolved->yielding_load[i] >= 0.0))
            return "a load under which an asperity has yielded is negative";
        if (evolved->given[i] > 1) return "a flag is neither 0 nor 1";
    }
    return NULL;
}

/* ---- read ------------------------------------------------------------------------------------------------------------------ */

static const unsigned char *take(const unsigned char *from, void *to, size_t size) {
    memcpy(to, from, size);
    return from + size;
}

/* The contact that stands in the bytes, in the order in which it was written; NULL with `why` where it is none. */
static hs_contact *read_contact(const head *given, const unsigned char *at, hs_contact *like, const char **why) {
    size_t n = (size_t)given->count, g = (size_t)given->groups;
    double *gap = (double *)malloc(2 * n * 8);
    int64_t *group = (int64_t *)malloc(n * 8), *order = (int64_t *)malloc(n * 8 + (g + 1) * 8), *first = order + n;
    hs_contact *contact = NULL;
    *why = "there is not enough memory";
    if (gap && group && order) {
        double *weight = gap + n;
        const unsigned char *gaps = at, *weights = at + 8 * n;
        take(at + 16 * n, order, 8 * (n + g + 1));
        for (size_t i = 0; i < n; ++i) group[i] = -1;
        *why = "groups do not fit";
        int fits = first[0] == 0 && first[g] == given->count;
        for (size_t index = 0; index < g && fits; ++index)
            fits = first[index] >= 0 && first[index] < first[index + 1] && first[index + 1] <= given->count;
        for (size_t index = 0; index < g && fits; ++index)
            for (int64_t i = first[index]; i < first[index + 1] && fits; ++i) {
                fits = order[i] >= 0 && order[i] < given->count && group[order[i]] < 0;
                if (!fits) break;
                group[order[i]] = (int64_t)index;
                memcpy(gap + order[i], gaps + 8 * i, 8);
                memcpy(weight + order[i], weights + 8 * i, 8);
                fits = isfinite(gap[order[i]]) && isfinite(weight[order[i]]);
            }
        if (fits) {
            contact = hs_contact_of(given->count, given->groups, gap, weight, group, (given->what & KNOTS) != 0, &given->units,
                                    given->datum);
            *why = "there is not enough memory";
        }
    }
    if (contact) {
        /* an order that is not the one that they have belongs to other numbers */
        int same = memcmp(contact->gap, at, 8 * n) == 0 && memcmp(contact->weight, at + 8 * n, 8 * n) == 0 &&
                   memcmp(contact->order, order, 8 * n) == 0 && memcmp(contact->first, first, 8 * (g + 1)) == 0;
        if (!same) {
            hs_contact_free(contact);
            contact = NULL;
            *why = "asperities are not in order";
        }
    }
    if (contact && like && !like->load == !contact->load && like->count == contact->count && like->groups == contact->groups &&
        memcmp(like->gap, contact->gap, 8 * n) == 0 && memcmp(like->weight, contact->weight, 8 * n) == 0 &&
        memcmp(like->order, contact->order, 8 * n) == 0 && memcmp(like->first, contact->first, 8 * (g + 1)) == 0 &&
        memcmp(&like->units, &contact->units, sizeof like->units) == 0 && like->datum == contact->datum) {
        hs_contact_free(contact);
        contact = hs_contact_held(like);
    }
    free(gap);
    free(group);
    free(order);
    return contact;
}

/* What is wrong with the bytes as a whole, or NULL; the head is taken out. */
static const char *check_bytes(const unsigned char *bytes, size_t size, head *given) {
    if (size < sizeof *given + sizeof(uint64_t) || memcmp(bytes, magic, sizeof magic) != 0)
        return "the bytes are no saved memory";
    take(bytes, given, sizeof *given);
    if (given->order != 1) return "the bytes were written on a machine of another byte order";
    if (given->format != FORMAT) return "the memory was saved in a format of another version";
    int64_t most = (int64_t)(size / 8);
    if (given->count < 1 || given->count > most || given->groups < 1 || given->groups > given->count ||
        given->vertices < 0 || given->vertices > most || (given->what & ~(int64_t)YIELDS) < 0 || (given->what & ~(int64_t)YIELDS) > KNOTS || (given->what & (EVOLVES | YIELDS)) == YIELDS ||
         (given->what == KNOTS && given->groups > 1) ||
        size != size_of(given))
        return "the bytes are cut off, or too many";
    if (!is_control(given->normal_control) || !is_control(given->tangential_control))
        return "a channel is controlled in no known way";
    for (int k = 0; k < 3; ++k)
        if (!isfinite(given->together[k]) || (!(given->what & EVOLVES) && given->together[k] != 0.0))
            return "a sum over all asperities is not what they have become";
    uint64_t sum;
    take(bytes + size - sizeof sum, &sum, sizeof sum);
    return sum != checksum(bytes, size - sizeof sum) ? "the bytes are damaged: their checksum differs" : NULL;
}

int hs_memory_read(const void *bytes, size_t size, hs_contact *like, hs_memory **memory, const char **why) {
    const unsigned char *at = (const unsigned char *)bytes;
    head given;
    *why = check_bytes(at, size, &given);
    if (*why) return HS_NOT_A_STATE;
    size_t n = (size_t)given.count, g = (size_t)given.groups;
    at += sizeof given;
    hs_contact *contact = read_contact(&given, at, like, why);
    if (!contact) return HS_NOT_A_STATE;
    at += 8 * (3 * n + g + 1);
    /* depths stand behind friction and energies; they say how much room the vertices take */
    const unsigned char *depths = at + 8 * (g + n);
    int64_t deepest = 0, vertices = 0;
    for (size_t index = 0; index < g; ++index) {
        int64_t depth;
        take(depths + 8 * index, &depth, 8);
        if (depth < 0 || depth > given.vertices - vertices) deepest = -1;
        if (deepest < 0) break;
        vertices += depth;
        if (depth > deepest) deepest = depth;
    }
    hs_memory *found = NULL;
    *why = "depths of stacks do not fit";
    if (deepest >= 0 && vertices == given.vertices) {
        found = hs_memory_blank(contact, deepest + 4, !(given.what & EVOLVES) ? 0 : given.what & YIELDS ? 2 : 1);
        *why = "there is not enough memory";
    }
    hs_contact_free(contact);
    if (!found) return HS_NOT_A_STATE;
    found->approach = given.now[0];
    found->displacement = given.now[1];
    found->normal_load = given.now[2];
    found->tangential_load = given.now[3];
    found->dissipated = given.now[4];
    found->excess = given.now[5];
    found->normal_control = (int32_t)given.normal_control;
    found->tangential_control = (int32_t)given.tangential_control;
    at = take(at, found->friction, 8 * g);
    at = take(at, found->each, 8 * n);
    at = take(at, found->depth, 8 * g);
    for (size_t index = 0; index < g; ++index)
        at = take(at, found->vertices + index * (size_t)found->capacity,
                  (size_t)found->depth[index] * sizeof(hs_vertex));
    if (found->evolved) {
        at = take(at, found->evolved->summit_height, hs_evolved_arrays((given.what & YIELDS) != 0) * 8 * n);
        found->evolved->slid_together = given.together[0];
        found->evolved->erased_memories = given.together[1];
        found->evolved->erased_energy = given.together[2];
    }
    at = take(at, found->steep, g);
    if (found->evolved) take(at, found->evolved->given, n);
    if (given.what & YIELDS) hs_sum_yielded(found->evolved, given.count);
    *why = hs_memory_check(found);
    if (*why) {
        hs_memory_free(found);
        return HS_NOT_A_STATE;
    }
    *memory = found;
    return HS_OK;
}
