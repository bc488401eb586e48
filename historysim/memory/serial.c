/* Serial: the bytes of a state, and the checks of bytes that are read.
 *
 * The bytes are: a head, the arrays of the contact, of the memory along the line, its vertices without room above them, what
 * asperities have become, when they first slid; in a plane how it moves there, and classes with their nodes; and a checksum
 * (`hs_digest`) of all of that. */

#include "contact.h"
#include "plane.h"

#define FORMAT 4
/* what a state has, in the head */
#define EVOLVES 1
#define KNOTS 2
#define YIELDS 4
#define SLIDES 8
#define PLANE 16
#define TURNED 32

static const char no_memory[] = "there is not enough memory";

/* What bytes of all versions begin with. */
typedef struct frame {
    char magic[8];
    uint32_t format;
    uint32_t order; /* 1 in the byte order of the machine that wrote */
} frame;
static const frame own_frame = {{'h', 's', 'm', 'e', 'm', 'o', 'r', 'y'}, FORMAT, 1};
/* with which earlier versions began the bytes of two directions */
static const char planar_magic[8] = {'h', 's', 'p', 'l', 'a', 'n', 'a', 'r'};

/* What is wrong with the frame of bytes, or NULL. */
static const char *check_frame(const unsigned char *bytes, size_t size) {
    frame given;
    if (size < sizeof given) return "the bytes are not a saved state";
    memcpy(&given, bytes, sizeof given);
    int is_old = memcmp(given.magic, planar_magic, sizeof planar_magic) == 0;
    if (!is_old && memcmp(given.magic, own_frame.magic, sizeof given.magic) != 0) return "the bytes are not a saved state";
    if (given.order != own_frame.order) return "the bytes were written on a machine of another byte order";
    return is_old || given.format != FORMAT ? "the state was saved in the format of another version; replay its events with this one"
                                            : NULL;
}

static const char *check_sum(const unsigned char *bytes, size_t size) {
    uint64_t sum;
    memcpy(&sum, bytes + size - sizeof sum, sizeof sum);
    return sum != hs_digest(0, bytes, size - sizeof sum) ? "the bytes are damaged: their checksum differs" : NULL;
}

static void put_sum(unsigned char *bytes, size_t size) {
    uint64_t sum = hs_digest(0, bytes, size - sizeof sum);
    memcpy(bytes + size - sizeof sum, &sum, sizeof sum);
}

/* Copy numbers to bytes, or from them; returns where the next ones stand. */
static unsigned char *pass(unsigned char *bytes, const void *numbers, size_t size, int writes) {
    if (size) memcpy(writes ? bytes : (void *)numbers, writes ? numbers : bytes, size);
    return bytes + size;
}

typedef struct head {
    frame begin;
    int64_t count, groups, vertices, what; /* a sum of EVOLVES, KNOTS, … */
    int64_t normal_control, tangential_control;
    uint64_t identity;
    hs_units units;
    double datum;
    double now[6];      /* of hs_line, from the approach on */
    double together[3]; /* of hs_evolved, from the distance slid together on */
    int64_t watched;
    int64_t classes, nodes; /* of rings */
} head;
/* A class, before its nodes. */
typedef struct class_head {
    int64_t group, start, count, nodes;
} class_head;
/* labels and deflections are written, loads follow */
#define NODE_BYTES (sizeof(double) + sizeof(hs_vector))
/* of hs_plane, all but the rings */
#define PLANE_BYTES offsetof(hs_plane, body)

static size_t size_of(const head *given) {
    size_t n = (size_t)given->count, g = (size_t)given->groups, watched = (size_t)given->watched;
    size_t evolved = given->what & EVOLVES ? hs_evolved_arrays((given->what & YIELDS) != 0) * n : 0;
    size_t slides = given->what & SLIDES ? (watched ? watched : n) : 0;
    size_t numbers = 4 * n + 3 * g + 1 + watched + 6 * (size_t)given->vertices + evolved + slides;
    size_t plane = given->what & PLANE ? PLANE_BYTES : 0;
    plane += (size_t)given->classes * sizeof(class_head) + (size_t)given->nodes * NODE_BYTES;
    /* flags of one byte follow the numbers */
    return sizeof *given + 8 * numbers + g + (given->what & EVOLVES ? n : 0) + plane + sizeof(uint64_t);
}

static head head_of(const hs_state *state) {
    const hs_line *memory = &state->line;
    const hs_contact *contact = memory->contact;
    const hs_body *body = state->plane ? state->plane->body : NULL;
    head found;
    memset(&found, 0, sizeof found);
    found.begin = own_frame;
    found.count = contact->count;
    found.groups = contact->groups;
    found.watched = contact->query_count;
    for (int64_t index = 0; index < contact->groups; ++index) found.vertices += memory->depth[index];
    found.what = (memory->evolved ? EVOLVES : 0) + (contact->load ? KNOTS : 0) + (hs_evolves(memory) > 1 ? YIELDS : 0) +
                 (memory->slides ? SLIDES : 0) + (state->plane ? PLANE : 0) + (body ? TURNED : 0);
    found.classes = body ? body->class_count : 0;
    for (int64_t c = 0; c < found.classes; ++c) found.nodes += body->classes[c].node_count;
    found.normal_control = memory->normal_control;
    found.tangential_control = memory->tangential_control;
    found.identity = memory->identity;
    found.units = contact->units;
    found.datum = contact->datum;
    memcpy(found.now, &memory->approach, sizeof found.now);
    if (memory->evolved) memcpy(found.together, &memory->evolved->slid_together, sizeof found.together);
    return found;
}

size_t hs_state_size(const hs_state *state) {
    head given = head_of(state);
    return size_of(&given);
}

/* Copy the arrays of a memory to bytes behind those of its contact, or from them. */
static unsigned char *pass_arrays(const hs_line *memory, unsigned char *at, int writes) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    size_t n = (size_t)contact->count, g = (size_t)contact->groups;
    at = pass(at, memory->friction, 8 * g, writes);
    at = pass(at, memory->dissipated_each, 8 * n, writes);
    at = pass(at, memory->depth, 8 * g, writes);
    for (size_t index = 0; index < g; ++index)
        at = pass(at, memory->vertices + index * (size_t)memory->capacity, (size_t)memory->depth[index] * sizeof(hs_vertex),
                  writes);
    if (evolved) at = pass(at, evolved->summit_height, hs_evolved_arrays(hs_evolves(memory) > 1) * 8 * n, writes);
    if (memory->slides) at = pass(at, memory->slides->time, 8 * (size_t)hs_slide_count(contact), writes);
    at = pass(at, memory->steep, g, writes);
    return evolved ? pass(at, evolved->friction_overridden, n, writes) : at;
}

static unsigned char *pass_node(unsigned char *at, const hs_node *node, int writes) {
    return pass(pass(at, &node->label, sizeof node->label, writes), &node->deflection, sizeof node->deflection, writes);
}

/* Write how a state moves in a plane. */
static void write_plane(const hs_plane *plane, unsigned char *at) {
    at = pass(at, plane, PLANE_BYTES, 1);
    for (int64_t c = 0; plane->body && c < plane->body->class_count; ++c) {
        const hs_ring_class *part = plane->body->classes + c;
        class_head own = {part->group, part->offset, part->curve.count, part->node_count};
        at = pass(at, &own, sizeof own, 1);
        for (int32_t k = 0; k < part->node_count; ++k) at = pass_node(at, part->nodes + k, 1);
    }
}

int hs_state_write(const hs_state *state, void *bytes, size_t size) {
    const hs_line *memory = &state->line;
    const hs_contact *contact = memory->contact;
    head given = head_of(state);
    size_t n = (size_t)contact->count, g = (size_t)contact->groups;
    if (size != size_of(&given)) return HS_NOT_A_STATE;
    unsigned char *at = pass((unsigned char *)bytes, &given, sizeof given, 1);
    at = pass(at, contact->gap, 8 * n, 1);
    at = pass(at, contact->weight, 8 * n, 1);
    at = pass(at, contact->order, 8 * n, 1);
    at = pass(at, contact->first, 8 * (g + 1), 1);
    at = pass(at, contact->query_label, 8 * (size_t)contact->query_count, 1);
    at = pass_arrays(memory, at, 1);
    if (state->plane) write_plane(state->plane, at);
    put_sum((unsigned char *)bytes, size);
    return HS_OK;
}

/* Sizes of what is computed with, so that powers of them are numbers; the same that input has (basics/limits.py). */
#define LARGEST_SIZE 1e60

/* Whether numbers in units of the contact are of a size that input may have. */
static int are_usable(const double *numbers, int64_t count, double unit) {
    for (int64_t i = 0; i < count; ++i)
        if (!(fabs(numbers[i]) * unit <= LARGEST_SIZE)) return 0;
    return 1;
}

static int is_control(int64_t control) { return control == HS_LOAD || control == HS_DISPLACED; }

static int are_coefficients(const double *friction, int64_t count) {
    for (int64_t i = 0; i < count; ++i)
        if (!(friction[i] >= 0.0 && friction[i] <= HS_MOST_FRICTION)) return 0;
    return 1;
}

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

/* Whether the vertices of a group go from its deepest spring to the edge, on lines of their slopes. */
static int is_stack(const hs_line *memory, int64_t index) {
    hs_group group = hs_group_of(memory, index);
    const hs_vertex *stack = group.stack;
    int64_t depth = memory->depth[index];
    double touch = group.curve.gap[0], approach = memory->approach, v = memory->displacement;
    if (depth == 0 || approach <= touch) return depth == 0 && approach <= touch;
    if (depth == 1 || !all_finite((const double *)stack, 6 * depth) || stack[depth - 1].label != approach) return 0;
    const hs_units *units = &memory->contact->units;
    for (int64_t j = 0; j < depth; ++j)
        if (!are_usable(&stack[j].label, 1, units->length) || !are_usable(&stack[j].anchor, 1, units->displacement) ||
            !are_usable(&stack[j].made_at, 1, units->displacement))
            return 0;
    double blur = blur_at(group.curve, approach, stack[depth - 1].normal), reach = group.friction * (approach - stack[0].label);
    for (int64_t j = 1; j < depth; ++j) {
        if (stack[j].label < stack[j - 1].label || (!memory->steep[index] && fabs(stack[j].slope) > group.friction)) return 0;
        reach = hs_most(reach, hs_most(fabs(stack[j].anchor), fabs(stack[j].slope) * (approach - stack[0].label)));
    }
    /* heights that have become gaps again are rounded; wear that was foreseen too large is taken back */
    double rounding = 1e-3 * CLOSE * (fabs(touch) + fabs(memory->contact->datum) / memory->contact->units.length);
    if (stack[0].tangential != 0.0 || (stack[0].label > touch + rounding && hs_evolves(memory) != 1)) return 0;
    if (!close_to(stack[depth - 1].anchor, v, fabs(v) + reach)) return 0;
    for (int64_t j = 0; j < depth; ++j) {
        const hs_vertex *here = stack + j;
        if (fabs(here->normal - hs_load_at(group.curve, here->label).load) > blur) return 0;
        if (j == 0) continue;
        double rise = here->slope * (here->label - here[-1].label), gain = here->slope * (here->normal - here[-1].normal);
        /* tangential loads are as exact as the tolerance of the path that led to them */
        double slack = (group.friction + fabs(here->slope)) * stack[depth - 1].normal;
        if (!close_to(here->anchor - here[-1].anchor, rise, fabs(v) + reach) ||
            fabs(here->tangential - here[-1].tangential - gain) > slack)
            return 0;
    }
    return 1;
}

/* Whether units follow from one another, and weights are those of summits, or do not fall from knot to knot. */
static int is_contact(const hs_contact *contact) {
    const hs_units *one = &contact->units;
    for (int k = 0; k < 7; ++k)
        if (!(isfinite((&one->load)[k]) && (&one->load)[k] > 0.0)) return 0;
    if (one->radius != one->length || !close_to(one->area, 3.141592653589793 * one->length * one->length, one->area) ||
        !close_to(one->stiffness * one->displacement, one->load, one->load) ||
        !close_to(one->energy, one->load * one->displacement, one->energy) || one->area < DBL_MIN || one->energy < DBL_MIN)
        return 0;
    for (int64_t i = 0; i < contact->count; ++i)
        if (contact->load ? contact->weight[i] < (i ? contact->weight[i - 1] : 0.0) : contact->weight[i] <= 0.0) return 0;
    for (int64_t i = 1; i < contact->query_count; ++i)
        if (contact->query_label[i] < contact->query_label[i - 1]) return 0;
    return fabs(contact->datum) <= LARGEST_SIZE && are_usable(contact->gap, contact->count, one->length) &&
           all_finite(contact->weight, contact->count) && all_finite(contact->query_label, contact->query_count);
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

/* Whether what asperities have become fits their gaps and weights. */
static int is_evolved(const hs_line *memory) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_units *units = &contact->units;
    int yields = hs_evolves(memory) > 1;
    if (!all_finite(evolved->summit_height, (int64_t)hs_evolved_arrays(yields) * contact->count) || contact->load) return 0;
    for (int64_t k = 0; k < contact->count; ++k) {
        int64_t i = contact->order[k];
        double height = evolved->summit_height[i], radius = evolved->summit_radius[i];
        double gap = contact->gap[k] * units->length, share = contact->weight[k] * contact->weight[k];
        int is_summit = radius > 0.0 && close_to(radius / units->length, share, share) &&
                        close_to(contact->datum - height, gap, fabs(height) + fabs(contact->datum) + fabs(gap));
        if (!is_summit || evolved->slid_distance[i] < 0.0 || evolved->worn_volume[i] < 0.0 ||
            evolved->shaped_volume[i] < 0.0 || evolved->friction_overridden[i] > 1 || (yields && !is_yielded(evolved, i, units)))
            return 0;
    }
    return 1;
}

const char *hs_state_check(const hs_state *state) {
    const hs_line *memory = &state->line;
    const hs_contact *contact = memory->contact;
    if (!is_contact(contact)) return "the units, gaps or weights are none of a contact";
    const hs_units *units = &contact->units;
    /* an energy is a load times a displacement, each of up to the largest size */
    double energy = units->energy / LARGEST_SIZE;
    if (!are_usable(&memory->approach, 1, units->length) || !are_usable(&memory->displacement, 1, units->displacement) ||
        !are_usable(&memory->normal_load, 1, units->load) || !are_usable(&memory->tangential_load, 1, units->load) ||
        !are_usable(&memory->excess, 1, units->load) || !are_usable(&memory->dissipated, 1, energy) ||
        !are_usable(memory->dissipated_each, contact->count, energy))
        return "a load, a displacement or an energy is not finite, or beyond the largest that is computed with";
    if (!are_coefficients(memory->friction, contact->groups))
        return "a coefficient of friction is not between 0 and the largest that is computed with";
    if (!is_control(memory->normal_control) || !is_control(memory->tangential_control))
        return "a channel is controlled in no known way";
    hs_curve all = hs_all_of(contact);
    double load = hs_load_at(all, memory->approach).load;
    if (fabs(memory->normal_load - load) > blur_at(all, memory->approach, load))
        return "the normal load is not that of the approach";
    for (int64_t index = 0; index < contact->groups; ++index)
        if (memory->steep[index] > 1 || !is_stack(memory, index))
            return "the vertices of a group do not fit its friction, its loads, or where the contact is";
    for (int64_t i = 0; memory->slides && i < hs_slide_count(contact); ++i)
        if (isinf(memory->slides->time[i])) return "a time is not finite";
    return memory->evolved && !is_evolved(memory) ? "what an asperity has become does not fit its summit" : NULL;
}

/* The contact that stands in the bytes, in the order in which it was written; NULL with `why` where it is none. */
static hs_contact *read_contact(const head *given, const unsigned char *at, hs_contact *like, const char **why) {
    const size_t n = (size_t)given->count, g = (size_t)given->groups, watched = (size_t)given->watched;
    int64_t *order = (int64_t *)malloc((4 * n + g + 1) * 8), *first = order + n, *group = first + g + 1;
    double *gap = (double *)(group + n), *weight = gap + n;
    *why = no_memory;
    if (!order) return NULL;
    memcpy(order, at + 16 * n, 8 * (n + g + 1));
    for (size_t i = 0; i < n; ++i) group[i] = -1;
    int fits = first[0] == 0 && first[g] == given->count;
    for (size_t index = 0; index < g && fits; ++index) {
        fits = first[index] < first[index + 1] && first[index + 1] <= given->count;
        for (int64_t i = first[index]; fits && i < first[index + 1]; ++i) {
            int64_t own = order[i];
            fits = own >= 0 && own < given->count && group[own] < 0;
            if (!fits) break;
            group[own] = (int64_t)index;
            memcpy(gap + own, at + 8 * (size_t)i, 8);
            memcpy(weight + own, at + 8 * (n + (size_t)i), 8);
            fits = isfinite(gap[own]) && isfinite(weight[own]);
        }
    }
    hs_contact *contact = fits ? hs_contact_of(given->count, given->groups, gap, weight, group, (given->what & KNOTS) != 0,
                                               &given->units, given->datum)
                               : NULL;
    if (contact && watched) contact->query_label = (double *)malloc(8 * watched);
    if (contact && (contact->query_label || !watched)) {
        contact->query_count = given->watched;
        pass((unsigned char *)at + 8 * (3 * n + g + 1), contact->query_label, 8 * watched, 0);
        /* an order that is not the one that they have belongs to other numbers */
        fits = memcmp(contact->gap, at, 8 * n) == 0 && memcmp(contact->weight, at + 8 * n, 8 * n) == 0 &&
               memcmp(contact->order, order, 8 * n) == 0 && memcmp(contact->first, first, 8 * (g + 1)) == 0;
        *why = NULL;
    }
    if (!fits) *why = "groups do not fit";
    free(order);
    if (contact && (*why || (like && hs_contact_alike(like, contact)))) {
        hs_contact_free(contact);
        contact = *why ? NULL : hs_contact_retain(like);
    }
    return contact;
}

/* Whether asperities of a memory that belongs to a contact are those that it began with, unless they evolve. */
static int has_those_of(const hs_line *memory, const hs_line *like) {
    const hs_contact *one = memory->contact, *other = like->contact;
    size_t size = (size_t)one->count * sizeof(double);
    if (memory->evolved || like->evolved) return hs_evolves(memory) >= hs_evolves(like);
    return memcmp(one->sorted_gap, other->sorted_gap, size) == 0 &&
           memcmp(one->sorted_weight, other->sorted_weight, size) == 0;
}

/* What is wrong with the bytes as a whole, or NULL; the head is taken out. */
static const char *check_bytes(const unsigned char *bytes, size_t size, head *given) {
    const char *wrong = check_frame(bytes, size);
    if (wrong) return wrong;
    if (size < sizeof *given + sizeof(uint64_t)) return "the bytes are cut off, or too many";
    memcpy(given, bytes, sizeof *given);
    int64_t most = (int64_t)(size / 8), what = given->what & ~(int64_t)(SLIDES | PLANE | TURNED);
    int planar = (given->what & PLANE) != 0, turned = (given->what & TURNED) != 0;
    int is_kind = what == 0 || what == EVOLVES || (what == KNOTS && given->groups == 1) || what == (EVOLVES | YIELDS);
    if (given->count < 1 || given->count > most || given->groups < 1 || given->groups > given->count || given->watched < 0 ||
        given->watched > (given->groups > 1 ? 0 : most) || given->vertices < 0 || given->vertices > most || !is_kind || turned > planar || (planar && (what & EVOLVES)) ||
        given->classes < 0 || given->classes > (turned ? most : 0) || given->nodes < 0 || given->nodes > (turned ? most : 0) ||
        size != size_of(given))
        return "the bytes are cut off, or too many";
    if (!is_control(given->normal_control) || !is_control(given->tangential_control))
        return "a channel is controlled in no known way";
    for (int k = 0; k < 3; ++k)
        if (!isfinite(given->together[k]) || (!(given->what & EVOLVES) && given->together[k] != 0.0))
            return "a sum over all asperities is not what they have become";
    return check_sum(bytes, size);
}

/* Vertices of the deepest of the stacks that stand in the bytes; -1 where their depths do not fit. */
static int64_t deepest_of(const head *given, const unsigned char *depths) {
    int64_t deepest = 0, left = given->vertices, depth;
    for (int64_t index = 0; index < given->groups; ++index, left -= depth) {
        memcpy(&depth, depths + 8 * index, 8);
        if (depth < 0 || depth > left) return -1;
        deepest = depth > deepest ? depth : deepest;
    }
    return left == 0 ? deepest : -1;
}

static int has_good_numbers(const hs_plane *plane, const hs_units *units) {
    return plane->height_classes >= 1 && plane->height_classes <= HS_MOST_RINGS && plane->rings >= 1 &&
           plane->rings <= HS_MOST_RINGS && plane->tolerance > 0.0 && plane->tolerance < 1.0 &&
           are_usable(&plane->origin.x, 4, units->displacement) && are_usable(&plane->tangential_load.x, 4, units->load) &&
           fabs(hs_norm(plane->direction) - 1.0) <= 1e-9 && is_control(plane->tangential_control[0]) &&
           is_control(plane->tangential_control[1]);
}

/* Read one class of asperities that begin at `start`; NULL, or what is wrong. */
static const char *read_class(hs_state *state, unsigned char **at, int64_t *start, int64_t *left) {
    const hs_contact *contact = state->line.contact;
    class_head own;
    memcpy(&own, *at, sizeof own);
    *at += sizeof own;
    int fits = own.group >= 0 && own.group < contact->groups && own.start == *start && own.count > 0 &&
               own.count <= contact->count - own.start && own.nodes >= 0 && own.nodes <= *left && own.nodes != 1;
    if (!fits || own.start < contact->first[own.group] || own.start + own.count > contact->first[own.group + 1])
        return "classes do not fit";
    hs_ring_class *part = hs_add_class(state, own.group, own.start, own.start + own.count);
    if (!part || hs_reserve_nodes(part, own.nodes) != HS_OK) return no_memory;
    double deepest = part->curve.gap[0], approach = state->line.approach, friction = state->line.friction[own.group];
    if ((own.nodes > 0) != (approach > deepest)) return "classes do not fit";
    for (int32_t k = 0; k < own.nodes; ++k) {
        hs_node *node = part->nodes + k;
        *at = pass_node(*at, node, 0);
        hs_normal there = hs_normal_at(part->curve, node->label);
        node->normal = there.load;
        node->integral = there.integral;
        part->node_count = k + 1;
        int stands = k == 0 ? node->label == approach : node->label < node[-1].label;
        if (!stands || !all_finite(&node->deflection.x, 2) || (k == own.nodes - 1 && node->label != deepest))
            return "nodes do not go from the edge to the deepest spring";
        double limit = 1.001 * friction * sqrt(approach - node->label);
        if (k == 0 ? hs_norm(node->deflection) > 0.0 : hs_norm(hs_ring_traction(part->nodes, k)) > limit)
            return "a traction is beyond the friction limit";
    }
    *start += own.count;
    *left -= own.nodes;
    return NULL;
}

/* Read how a state moves in a plane, of whose line all is read; NULL, or what is wrong. */
static const char *read_plane(hs_state *state, const head *given, unsigned char *at) {
    int64_t start = 0, left = given->nodes;
    hs_plane *plane = state->plane = (hs_plane *)calloc(1, sizeof *plane);
    if (!plane) return no_memory;
    at = pass(at, plane, PLANE_BYTES, 0);
    if (!has_good_numbers(plane, &state->line.contact->units)) return "a setting or a vector is out of its range";
    if (!(given->what & TURNED)) return NULL;
    plane->body = hs_body_new(&state->line, plane->rings, plane->tolerance);
    if (!plane->body) return no_memory;
    plane->body->displacement = plane->displacement;
    plane->body->tangential_load = plane->tangential_load;
    for (int64_t c = 0; c < given->classes; ++c) {
        const char *wrong = read_class(state, &at, &start, &left);
        if (wrong) return wrong;
    }
    return start != state->line.contact->count || left != 0 ? "classes do not fit" : NULL;
}

int hs_state_read(const void *bytes, size_t size, const hs_state *like, hs_state **state, const char **why) {
    unsigned char *at = (unsigned char *)bytes;
    head given;
    *why = check_bytes(at, size, &given);
    if (*why) return HS_NOT_A_STATE;
    size_t n = (size_t)given.count, g = (size_t)given.groups;
    at += sizeof given;
    hs_contact *contact = read_contact(&given, at, like ? like->line.contact : NULL, why);
    if (!contact) return HS_NOT_A_STATE;
    at += 8 * (3 * n + g + 1 + (size_t)given.watched);
    /* depths follow friction and energies; they say how much room the vertices take */
    int64_t deepest = deepest_of(&given, at + 8 * (g + n));
    int evolves = !(given.what & EVOLVES) ? 0 : given.what & YIELDS ? 2 : 1, slides = (given.what & SLIDES) != 0;
    hs_state *found = deepest < 0 ? NULL : (hs_state *)calloc(1, sizeof *found);
    *why = deepest < 0 ? "depths of stacks do not fit" : no_memory;
    if (found && hs_line_init(&found->line, contact, deepest + 4, evolves) != HS_OK) {
        free(found);
        found = NULL;
    }
    hs_contact_free(contact);
    hs_line *line = found ? &found->line : NULL;
    /* sliding times have an array of their own */
    if (!found || (slides && hs_slides_assign(line, NULL) != HS_OK)) {
        hs_state_free(found);
        return HS_NOT_A_STATE;
    }
    memcpy(&line->approach, given.now, sizeof given.now);
    line->identity = given.identity;
    line->normal_control = (int32_t)given.normal_control;
    line->tangential_control = (int32_t)given.tangential_control;
    at = pass_arrays(line, at, 0);
    if (line->evolved) memcpy(&line->evolved->slid_together, given.together, sizeof given.together);
    if (evolves > 1) hs_sum_yielded(line->evolved, given.count);
    int status = HS_NOT_A_STATE;
    *why = hs_state_check(found);
    if (!*why && like && !hs_line_belongs(line, &like->line)) {
        *why = "the state is of another contact";
        status = HS_FOREIGN;
    }
    if (!*why && like && !has_those_of(line, &like->line)) *why = "the asperities are not those of the contact";
    if (!*why && given.what & PLANE) *why = read_plane(found, &given, at);
    if (*why) {
        hs_state_free(found);
        return status;
    }
    *state = found;
    return HS_OK;
}
