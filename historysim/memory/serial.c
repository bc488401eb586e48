/* Memories as bytes, and whether what was read is one.
 *
 * The bytes are: a head, the arrays of the contact, of the memory, its vertices without room above them, what asperities
 * have become, when they first slid, and a checksum (`hs_digest`) of all of that. */

#include "internal.h"

#define FORMAT 3
#define EVOLVES 1
#define KNOTS 2
#define YIELDS 4
#define SLIDES 8
static const char magic[8] = {'h', 's', 'm', 'e', 'm', 'o', 'r', 'y'};

typedef struct head {
    char magic[8];
    uint32_t format;
    uint32_t order; /* 1 in the byte order of the machine that wrote */
    int64_t count, groups, vertices, what; /* a sum of EVOLVES, KNOTS, YIELDS and SLIDES */
    int64_t normal_control, tangential_control;
    uint64_t identity;
    hs_units units;
    double datum;
    double now[6];      /* of hs_memory, from the approach on */
    double together[3]; /* of hs_evolved, from the distance slid together on */
    int64_t watched;
} head;

/* numbers of 8 bytes behind the head; flags of one byte follow them */
static uint64_t numbers_of(const head *given) {
    uint64_t n = (uint64_t)given->count, g = (uint64_t)given->groups;
    uint64_t evolved = given->what & EVOLVES ? hs_evolved_arrays((given->what & YIELDS) != 0) * n : 0;
    uint64_t watched = (uint64_t)given->watched, slides = given->what & SLIDES ? (watched ? watched : n) : 0;
    return 4 * n + 3 * g + 1 + watched + 6 * (uint64_t)given->vertices + evolved + slides;
}
static uint64_t flags_of(const head *given) {
    return (uint64_t)given->groups + (given->what & EVOLVES ? (uint64_t)given->count : 0);
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
    found.watched = contact->watched;
    found.vertices = vertices_of(memory);
    found.what = (memory->evolved ? EVOLVES : 0) + (contact->load ? KNOTS : 0) + (hs_evolves(memory) > 1 ? YIELDS : 0) +
                 (memory->slides ? SLIDES : 0);
    found.normal_control = memory->normal_control;
    found.tangential_control = memory->tangential_control;
    found.identity = memory->identity;
    found.units = contact->units;
    found.datum = contact->datum;
    memcpy(found.now, &memory->approach, sizeof found.now);
    if (memory->evolved) memcpy(found.together, &memory->evolved->slid_together, sizeof found.together);
    return found;
}

static size_t size_of(const head *given) {
    return sizeof *given + 8 * (size_t)numbers_of(given) + (size_t)flags_of(given) + sizeof(uint64_t);
}

size_t hs_memory_size(const hs_memory *memory) {
    head given = head_of(memory);
    return size_of(&given);
}

/* Copy numbers to bytes, or from them; returns where the next ones stand. */
static unsigned char *pass(unsigned char *bytes, const void *numbers, size_t size, int writes) {
    if (size) memcpy(writes ? bytes : (void *)numbers, writes ? numbers : bytes, size);
    return bytes + size;
}

/* Copy the arrays of a memory to bytes behind those of its contact, or from them. */
static unsigned char *pass_arrays(const hs_memory *memory, unsigned char *at, int writes) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    size_t n = (size_t)contact->count, g = (size_t)contact->groups;
    at = pass(at, memory->friction, 8 * g, writes);
    at = pass(at, memory->each, 8 * n, writes);
    at = pass(at, memory->depth, 8 * g, writes);
    for (size_t index = 0; index < g; ++index)
        at = pass(at, memory->vertices + index * (size_t)memory->capacity, (size_t)memory->depth[index] * sizeof(hs_vertex),
                  writes);
    if (evolved) at = pass(at, evolved->summit_height, hs_evolved_arrays(hs_evolves(memory) > 1) * 8 * n, writes);
    if (memory->slides) at = pass(at, memory->slides->time, 8 * (size_t)hs_watched(contact), writes);
    at = pass(at, memory->steep, g, writes);
    return evolved ? pass(at, evolved->given, n, writes) : at;
}

int hs_memory_write(const hs_memory *memory, void *bytes, size_t size) {
    const hs_contact *contact = memory->contact;
    head given = head_of(memory);
    size_t n = (size_t)contact->count, g = (size_t)contact->groups;
    int fits = size == size_of(&given);
    if (fits) {
        unsigned char *at = pass((unsigned char *)bytes, &given, sizeof given, 1);
        at = pass(at, contact->gap, 8 * n, 1);
        at = pass(at, contact->weight, 8 * n, 1);
        at = pass(at, contact->order, 8 * n, 1);
        at = pass(at, contact->first, 8 * (g + 1), 1);
        at = pass(at, contact->watch, 8 * (size_t)contact->watched, 1);
        at = pass_arrays(memory, at, 1);
        uint64_t sum = hs_digest(0, bytes, size - sizeof sum);
        pass(at, &sum, sizeof sum, 1);
    }
    return fits ? HS_OK : HS_NOT_A_STATE;
}

/* ---- whether it is one ---------------------------------------------------------------------------------------------------- */

static int is_control(int64_t control) { return control == HS_LOAD || control == HS_DISPLACED; }

static int all_finite(const double *numbers, int64_t count) {
    for (int64_t i = 0; i < count; ++i)
        if (!isfinite(numbers[i])) return 0;
    return 1;
}

/* Numbers that follow from others differ by rounding, or as far as a load is solved for. */
#define CLOSE 1e-6
static int close_to(double one, double other, double size) { return fabs(one - other) <= CLOSE * size; }

/* What a load at an approach may be off by, which is rounded itself. */
static double blur_at(hs_curve curve, double approach, double load) {
    double off = 1e-12 * (fabs(approach) + fabs(curve.gap[0]));
    return CLOSE * load + (hs_load_at(curve, approach + off).load - hs_load_at(curve, approach - off).load);
}

static const char *check_stack(const hs_memory *memory, int64_t index) {
    hs_group group = hs_group_of(memory, index);
    const hs_vertex *stack = group.stack;
    int64_t depth = memory->depth[index];
    double touch = group.curve.gap[0], approach = memory->approach, v = memory->displacement;
    if (depth == 0) return approach > touch ? "a group that touches has no vertices" : NULL;
    if (depth == 1 || approach <= touch) return "the vertices of a group do not fit its approach";
    if (!all_finite((const double *)stack, 6 * depth)) return "a vertex is not finite";
    if (stack[depth - 1].label != approach) return "the contact edge is not at the approach";
    double blur = blur_at(group.curve, approach, stack[depth - 1].normal), reach = group.friction * (approach - stack[0].label);
    for (int64_t j = 1; j < depth; ++j) {
        if (stack[j].label < stack[j - 1].label) return "labels of vertices do not rise";
        if (!memory->steep[index] && fabs(stack[j].slope) > group.friction) return "a slope is beyond the friction coefficient";
        reach = hs_most(reach, hs_most(fabs(stack[j].anchor), fabs(stack[j].slope) * (approach - stack[0].label)));
    }
    /* heights that have become gaps again are rounded; wear that was foreseen too large is taken back */
    double rounding = 1e-3 * CLOSE * (fabs(touch) + fabs(memory->contact->datum) / memory->contact->units.length);
    if ((stack[0].tangential != 0.0 || (stack[0].label > touch + rounding && hs_evolves(memory) != 1)))
        return "the deepest spring is not that which touches first";
    if (!close_to(stack[depth - 1].anchor, v, fabs(v) + reach)) return "the contact edge is not where the contact is";
    for (int64_t j = 0; j < depth; ++j) {
        const hs_vertex *here = stack + j;
        if (fabs(here->normal - hs_load_at(group.curve, here->label).load) > blur) return "a load is not that of its label";
        if (j == 0) continue;
        double rise = here->slope * (here->label - here[-1].label), gain = here->slope * (here->normal - here[-1].normal);
        /* tangential loads are as exact as the tolerance of the path that led to them */
        if (!close_to(here->anchor - here[-1].anchor, rise, fabs(v) + reach) ||
            fabs(here->tangential - here[-1].tangential - gain) > (group.friction + fabs(here->slope)) * stack[depth - 1].normal)
            return "an anchor or a tangential load is not that of the slope";
    }
    return NULL;
}

static const char *check_contact(const hs_contact *contact) {
    const double *units = &contact->units.load;
    int knots = contact->load != NULL;
    for (int k = 0; k < 7; ++k)
        if (!(isfinite(units[k]) && units[k] > 0.0)) return "a unit is not a positive number";
    const hs_units *one = &contact->units;
    if (one->radius != one->length || !close_to(one->area, 3.141592653589793 * one->length * one->length, one->area) ||
        !close_to(one->stiffness * one->displacement, one->load, one->load) ||
        !close_to(one->energy, one->load * one->displacement, one->energy) || one->area < DBL_MIN || one->energy < DBL_MIN)
        return "units do not follow from one another";
    if (!isfinite(contact->datum)) return "the datum is not finite";
    if (!all_finite(contact->gap, contact->count) || !all_finite(contact->weight, contact->count))
        return "a gap or weight is not finite";
    for (int64_t i = 0; i < contact->count; ++i)
        if (knots ? contact->weight[i] < (i ? contact->weight[i - 1] : 0.0) : contact->weight[i] <= 0.0)
            return "a weight is not that of a summit, or falls from knot to knot";
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

/* An asperity has yielded to the Hertz contact of its load and radius, or not at all. */
static int is_yielded(const hs_evolved *evolved, int64_t i, const hs_units *units) {
    double virgin = evolved->virgin_radius[i], radius = evolved->summit_radius[i], load = evolved->yielding_load[i];
    double lowered = evolved->virgin_height[i] - evolved->summit_height[i], reached = evolved->yielded_to[i];
    if (!(virgin > 0.0 && load >= 0.0 && evolved->yielding_energy[i] >= 0.0)) return 0;
    if (reached == 0.0) return load == 0.0 && lowered == 0.0 && radius == virgin;
    double a = hs_cube_root(radius * load / units->load) * hs_cube_root(units->length * units->length);
    return reached > 0.0 && load > 0.0 && radius >= (1.0 - CLOSE) * virgin && radius <= virgin / CLOSE &&
           close_to(lowered + a * a / radius, reached, reached + fabs(evolved->virgin_height[i]) * 1e-3);
}

static const char *check_evolved(const hs_memory *memory) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_units *units = &contact->units;
    int yields = hs_evolves(memory) > 1;
    if (!all_finite(evolved->summit_height, (int64_t)hs_evolved_arrays(yields) * contact->count))
        return "what an asperity has become is not finite";
    if (contact->load) return "knots of a normal curve do not evolve";
    for (int64_t k = 0; k < contact->count; ++k) {
        int64_t i = contact->order[k];
        double height = evolved->summit_height[i], radius = evolved->summit_radius[i];
        double gap = contact->gap[k] * units->length, share = contact->weight[k] * contact->weight[k];
        if (!(radius > 0.0)) return "a radius is not positive";
        if (!close_to(contact->datum - height, gap, fabs(height) + fabs(contact->datum) + fabs(gap)) ||
            !close_to(radius / units->length, share, share))
            return "a summit is not that of its gap and weight";
        if (!(evolved->slid_distance[i] >= 0.0 && evolved->worn_volume[i] >= 0.0 && evolved->shaped_volume[i] >= 0.0))
            return "a slid distance or a worn volume is negative";
        if (yields && !is_yielded(evolved, i, units)) return "a summit is not what yielding has left of the earlier one";
        if (evolved->given[i] > 1) return "a flag is neither 0 nor 1";
    }
    return NULL;
}

const char *hs_memory_check(const hs_memory *memory) {
    const hs_contact *contact = memory->contact;
    const char *wrong = check_contact(contact);
    if (wrong) return wrong;
    if (!all_finite(&memory->approach, 6)) return "a load, or where the contact is, is not finite";
    if (!all_finite(memory->friction, contact->groups)) return "a friction coefficient is not finite";
    if (!all_finite(memory->each, contact->count)) return "a dissipated energy is not finite";
    if (!is_control(memory->normal_control) || !is_control(memory->tangential_control))
        return "a channel is controlled in no known way";
    hs_curve all = hs_all_of(contact);
    double load = hs_load_at(all, memory->approach).load;
    if (fabs(memory->normal_load - load) > blur_at(all, memory->approach, load))
        return "the normal load is not that of the approach";
    for (int64_t index = 0; index < contact->groups; ++index) {
        if (memory->friction[index] < 0.0) return "a friction coefficient is negative";
        if (memory->steep[index] > 1) return "a flag is neither 0 nor 1";
        wrong = check_stack(memory, index);
        if (wrong) return wrong;
    }
    for (int64_t i = 0; memory->slides && i < hs_watched(contact); ++i)
        if (isinf(memory->slides->time[i])) return "a time is not finite";
    return memory->evolved ? check_evolved(memory) : NULL;
}

/* ---- read ------------------------------------------------------------------------------------------------------------------ */

/* Have a contact watch labels that stand in the bytes; NULL, or what is wrong with them. */
static const char *read_watch(hs_contact *contact, int64_t watched, const unsigned char *at) {
    if (watched == 0) return NULL;
    double *watch = (double *)malloc((size_t)watched * 8);
    if (!watch) return "there is not enough memory";
    memcpy(watch, at, (size_t)watched * 8);
    contact->watched = watched;
    contact->watch = watch;
    for (int64_t i = 0; i < watched; ++i)
        if (!isfinite(watch[i]) || (i && watch[i] < watch[i - 1])) return "labels that are watched do not rise";
    return NULL;
}

/* Put gaps and weights that stand in the bytes into the caller's numbering, with the group of each asperity; returns whether
 * order and groups allow it. */
static int unsorted(const head *given, const unsigned char *at, const int64_t *order, double *gap, double *weight,
                    int64_t *group) {
    const int64_t *first = order + given->count;
    const size_t n = (size_t)given->count;
    if (first[0] != 0 || first[given->groups] != given->count) return 0;
    for (size_t i = 0; i < n; ++i) group[i] = -1;
    for (int64_t index = 0; index < given->groups; ++index)
        if (first[index] < 0 || first[index] >= first[index + 1] || first[index + 1] > given->count) return 0;
    for (int64_t index = 0; index < given->groups; ++index)
        for (int64_t i = first[index]; i < first[index + 1]; ++i) {
            int64_t own = order[i];
            if (own < 0 || own >= given->count || group[own] >= 0) return 0;
            group[own] = index;
            memcpy(gap + own, at + 8 * (size_t)i, 8);
            memcpy(weight + own, at + 8 * (n + (size_t)i), 8);
            if (!isfinite(gap[own]) || !isfinite(weight[own])) return 0;
        }
    return 1;
}

/* The contact that stands in the bytes, in the order in which it was written; NULL with `why` where it is none. */
static hs_contact *read_contact(const head *given, const unsigned char *at, hs_contact *like, const char **why) {
    size_t n = (size_t)given->count, g = (size_t)given->groups;
    int64_t *order = (int64_t *)malloc((4 * n + g + 1) * 8), *group = order + n + g + 1;
    double *gap = (double *)(group + n), *weight = gap + n;
    hs_contact *contact = NULL;
    *why = "there is not enough memory";
    if (!order) return NULL;
    memcpy(order, at + 16 * n, 8 * (n + g + 1));
    if (!unsorted(given, at, order, gap, weight, group))
        *why = "groups do not fit";
    else
        contact = hs_contact_of(given->count, given->groups, gap, weight, group, (given->what & KNOTS) != 0, &given->units,
                                given->datum);
    if (contact) {
        /* an order that is not the one that they have belongs to other numbers */
        int same = memcmp(contact->gap, at, 8 * n) == 0 && memcmp(contact->weight, at + 8 * n, 8 * n) == 0 &&
                   memcmp(contact->order, order, 8 * n) == 0 && memcmp(contact->first, order + n, 8 * (g + 1)) == 0;
        *why = same ? read_watch(contact, given->watched, at + 8 * (3 * n + g + 1)) : "asperities are not in order";
    }
    free(order);
    if (contact && (*why || (like && hs_contact_alike(like, contact)))) {
        hs_contact_free(contact);
        contact = *why ? NULL : hs_contact_held(like);
    }
    return contact;
}

/* Whether asperities of a memory that belongs to a contact are those that it began with, unless they evolve. */
static int has_those_of(const hs_memory *memory, const hs_memory *like) {
    const hs_contact *one = memory->contact, *other = like->contact;
    size_t size = (size_t)one->count * sizeof(double);
    if (memory->evolved || like->evolved) return hs_evolves(memory) >= hs_evolves(like);
    return memcmp(one->sorted_gap, other->sorted_gap, size) == 0 &&
           memcmp(one->sorted_weight, other->sorted_weight, size) == 0;
}

/* What is wrong with the bytes as a whole, or NULL; the head is taken out. */
static const char *check_bytes(const unsigned char *bytes, size_t size, head *given) {
    if (size < sizeof *given + sizeof(uint64_t) || memcmp(bytes, magic, sizeof magic) != 0)
        return "the bytes are no saved memory";
    memcpy(given, bytes, sizeof *given);
    if (given->order != 1) return "the bytes were written on a machine of another byte order";
    if (given->format != FORMAT) return "the memory was saved in a format of another version";
    int64_t most = (int64_t)(size / 8), what = given->what & ~(int64_t)SLIDES;
    int is_kind = what == 0 || what == EVOLVES || what == KNOTS || what == (EVOLVES | YIELDS);
    if (given->count < 1 || given->count > most || given->groups < 1 || given->groups > given->count ||
        given->watched < 0 || given->watched > (given->groups > 1 ? 0 : most) || given->vertices < 0 || given->vertices > most || !is_kind || (what == KNOTS && given->groups > 1) ||
        size != size_of(given))
        return "the bytes are cut off, or too many";
    if (!is_control(given->normal_control) || !is_control(given->tangential_control))
        return "a channel is controlled in no known way";
    for (int k = 0; k < 3; ++k)
        if (!isfinite(given->together[k]) || (!(given->what & EVOLVES) && given->together[k] != 0.0))
            return "a sum over all asperities is not what they have become";
    uint64_t sum;
    memcpy(&sum, bytes + size - sizeof sum, sizeof sum);
    return sum != hs_digest(0, bytes, size - sizeof sum) ? "the bytes are damaged: their checksum differs" : NULL;
}

int hs_memory_read(const void *bytes, size_t size, const hs_memory *like, hs_memory **memory, const char **why) {
    const unsigned char *at = (const unsigned char *)bytes;
    head given;
    *why = check_bytes(at, size, &given);
    if (*why) return HS_NOT_A_STATE;
    size_t n = (size_t)given.count, g = (size_t)given.groups;
    at += sizeof given;
    hs_contact *contact = read_contact(&given, at, like ? like->contact : NULL, why);
    if (!contact) return HS_NOT_A_STATE;
    at += 8 * (3 * n + g + 1 + (size_t)given.watched);
    /* depths stand behind friction and energies; they say how much room the vertices take */
    const unsigned char *depths = at + 8 * (g + n);
    int64_t deepest = 0, vertices = 0;
    for (size_t index = 0; index < g; ++index) {
        int64_t depth;
        memcpy(&depth, depths + 8 * index, 8);
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
    memcpy(&found->approach, given.now, sizeof given.now);
    found->identity = given.identity;
    found->normal_control = (int32_t)given.normal_control;
    found->tangential_control = (int32_t)given.tangential_control;
    /* times are noted in a place of their own */
    int slides = (given.what & SLIDES) != 0, status = slides ? hs_slides_assign(found, NULL) : (int)HS_OK;
    if (status == HS_OK) pass_arrays(found, (unsigned char *)at, 0);
    if (status == HS_OK && slides) status = hs_slides_assign(found, found->slides->time);
    if (status != HS_OK) {
        hs_memory_free(found);
        *why = "there is not enough memory";
        return HS_NOT_A_STATE;
    }
    if (found->evolved) memcpy(&found->evolved->slid_together, given.together, sizeof given.together);
    if (given.what & YIELDS) hs_sum_yielded(found->evolved, given.count);
    status = HS_NOT_A_STATE;
    *why = hs_memory_check(found);
    if (!*why && like && !hs_belongs(found, like)) {
        *why = "the state is of another contact";
        status = HS_FOREIGN;
    }
    if (!*why && like && !has_those_of(found, like)) *why = "the asperities are not those of the contact";
    if (*why) {
        hs_memory_free(found);
        return status;
    }
    *memory = found;
    return HS_OK;
}
