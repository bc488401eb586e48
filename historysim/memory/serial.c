/* Serial: the binary format of a state, and the validation of bytes that are read.
 *
 * Layout: header, arrays of the contact, arrays of the memory along the line with the vertices in
 * use (if it is scaled, those of the scaled line, and energies in its order), evolved summits,
 * sliding times; for motion in a plane its scalars and the classes with their
 * nodes; last a checksum (`hs_digest`) of all bytes before. */

#include "contact.h"
#include "plane.h"
#include "scaled.h"

/* Version of the format; a state is read by the version that wrote it only. */
#define FORMAT 4
/* Features of a state: bits of `head.features`. */
#define EVOLVES 1
#define KNOTS 2
#define YIELDS 4
#define SLIDES 8
#define PLANE 16
#define TURNED 32
#define SCALED 64
#define FAR 128

static const char no_memory[] = "there is not enough memory";

/* Preamble of the bytes of all versions. */
typedef struct frame {
    char magic[8];
    uint32_t format;
    uint32_t order; /* 1 in the byte order of the machine that wrote */
} frame;
static const frame current_frame = {{'h', 's', 'm', 'e', 'm', 'o', 'r', 'y'}, FORMAT, 1};
/* Magic of earlier versions for states in two directions. */
static const char planar_magic[8] = {'h', 's', 'p', 'l', 'a', 'n', 'a', 'r'};

/* Error of the preamble of bytes, or NULL. */
static const char *check_frame(const unsigned char *bytes, size_t size) {
    frame actual;
    if (size < sizeof actual) return "the bytes are not a saved state";
    memcpy(&actual, bytes, sizeof actual);
    int is_old = memcmp(actual.magic, planar_magic, sizeof planar_magic) == 0;
    if (!is_old && memcmp(actual.magic, current_frame.magic, sizeof actual.magic) != 0)
        return "the bytes are not a saved state";
    if (actual.order != current_frame.order)
        return "the bytes were written on a machine of another byte order";
    return is_old || actual.format != FORMAT ? "the state was saved in the format of another "
                                               "version; replay its events with this one"
                                             : NULL;
}

static const char *check_sum(const unsigned char *bytes, size_t size) {
    uint64_t sum;
    memcpy(&sum, bytes + size - sizeof sum, sizeof sum);
    return sum != hs_digest(0, bytes, size - sizeof sum)
               ? "the bytes are damaged: their checksum differs"
               : NULL;
}

static void put_sum(unsigned char *bytes, size_t size) {
    uint64_t sum = hs_digest(0, bytes, size - sizeof sum);
    memcpy(bytes + size - sizeof sum, &sum, sizeof sum);
}

/* Copy numbers to bytes, or from bytes to numbers; returns the address after them. */
static unsigned char *transfer(unsigned char *bytes, const void *numbers, size_t size, int writes) {
    if (size) memcpy(writes ? bytes : (void *)numbers, writes ? numbers : bytes, size);
    return bytes + size;
}

typedef struct head {
    frame preamble;
    int64_t count, groups, vertices, features; /* a sum of EVOLVES, KNOTS, … */
    int64_t normal_control, tangential_control;
    uint64_t identity;
    hs_units units;
    double datum;
    double scalars[6]; /* of hs_line, from the approach on */
    double totals[3];  /* of hs_evolved, from the distance slid together on */
    int64_t watched;
    int64_t classes, nodes; /* of rings */
} head;
/* Header of a class, followed by its nodes. */
typedef struct class_head {
    int64_t group, start, count, nodes;
} class_head;
/* Label and deflection of a node; its loads are recomputed. */
#define NODE_BYTES (sizeof(double) + sizeof(hs_vector))
/* Members of hs_plane before the rings. */
#define PLANE_BYTES offsetof(hs_plane, body)

/* Numbers of `far_energy`. */
static size_t far_numbers(const head *header) {
    return header->features & FAR ? (size_t)hs_count_clusters(header->count) * HS_PROXIES : 0;
}

static size_t state_bytes(const head *header) {
    size_t n = (size_t)header->count, g = (size_t)header->groups, watched = (size_t)header->watched;
    size_t evolved =
        header->features & EVOLVES ? hs_evolved_arrays((header->features & YIELDS) != 0) * n : 0;
    size_t slides = header->features & SLIDES ? (watched ? watched : n) : 0;
    size_t numbers = 4 * n + 3 * g + 1 + watched + 6 * (size_t)header->vertices + evolved + slides +
                     far_numbers(header);
    size_t plane = header->features & PLANE ? PLANE_BYTES : 0;
    plane += (size_t)header->classes * sizeof(class_head) + (size_t)header->nodes * NODE_BYTES;
    /* flags of one byte stand after the numbers */
    return sizeof *header + 8 * numbers + g + (header->features & EVOLVES ? n : 0) + plane +
           sizeof(uint64_t);
}

static head head_of_state(const hs_state *state) {
    const hs_line *memory = &state->line;
    const hs_contact *contact = memory->contact;
    const hs_body *body = state->plane ? state->plane->body : NULL;
    head header;
    memset(&header, 0, sizeof header);
    header.preamble = current_frame;
    header.count = contact->count;
    header.groups = contact->groups;
    header.watched = contact->query_count;
    for (int64_t index = 0; index < contact->groups; ++index)
        header.vertices += memory->depth[index];
    if (memory->scaled) header.vertices = memory->scaled->depth[0];
    header.features = (memory->evolved ? EVOLVES : 0) + (contact->load ? KNOTS : 0) +
                      (hs_evolves(memory) > 1 ? YIELDS : 0) +
                      (hs_active(memory)->slides ? SLIDES : 0) + (memory->scaled ? SCALED : 0) +
                      (hs_active(memory)->far_energy ? FAR : 0) + (state->plane ? PLANE : 0) +
                      (body ? TURNED : 0);
    header.classes = body ? body->class_count : 0;
    for (int64_t c = 0; c < header.classes; ++c) header.nodes += body->classes[c].node_count;
    header.normal_control = memory->normal_control;
    header.tangential_control = memory->tangential_control;
    header.identity = memory->identity;
    header.units = contact->units;
    header.datum = contact->datum;
    memcpy(header.scalars, &memory->approach, sizeof header.scalars);
    if (memory->evolved)
        memcpy(header.totals, &memory->evolved->slid_together, sizeof header.totals);
    return header;
}

size_t hs_state_size(const hs_state *state) {
    head header = head_of_state(state);
    return state_bytes(&header);
}

/* Copy the arrays of a memory to or from bytes; returns the address after them. */
static unsigned char *transfer_arrays(const hs_line *memory, unsigned char *at, int writes) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_line *scaled = memory->scaled, *line = hs_active(memory);
    size_t n = (size_t)contact->count, g = (size_t)contact->groups;
    at = transfer(at, memory->friction, 8 * g, writes);
    at = transfer(at, line->dissipated_each, 8 * n, writes);
    if (line->far_energy)
        at = transfer(at, line->far_energy, 8 * hs_far_count(line->contact), writes);
    at = transfer(at, memory->depth, 8 * g, writes);
    if (scaled)
        at = transfer(at, scaled->vertices, (size_t)scaled->depth[0] * sizeof(hs_vertex), writes);
    for (size_t index = 0; index < g; ++index)
        at = transfer(at, memory->vertices + index * (size_t)memory->capacity,
                      (size_t)memory->depth[index] * sizeof(hs_vertex), writes);
    if (evolved)
        at = transfer(at, evolved->summit_height, hs_evolved_arrays(hs_evolves(memory) > 1) * 8 * n,
                      writes);
    if (line->slides)
        at = transfer(at, line->slides->time, 8 * (size_t)hs_slide_count(contact), writes);
    at = transfer(at, memory->steep, g, writes);
    return evolved ? transfer(at, evolved->friction_overridden, n, writes) : at;
}

static unsigned char *transfer_node(unsigned char *at, const hs_node *node, int writes) {
    return transfer(transfer(at, &node->label, sizeof node->label, writes), &node->deflection,
                    sizeof node->deflection, writes);
}

/* Write the scalars, classes and nodes of the motion in a plane. */
static void write_plane(const hs_plane *plane, unsigned char *at) {
    at = transfer(at, plane, PLANE_BYTES, 1);
    for (int64_t c = 0; plane->body && c < plane->body->class_count; ++c) {
        const hs_ring_class *ring_class = plane->body->classes + c;
        class_head header = {ring_class->group, ring_class->offset, ring_class->curve.count,
                             ring_class->node_count};
        at = transfer(at, &header, sizeof header, 1);
        for (int32_t k = 0; k < ring_class->node_count; ++k)
            at = transfer_node(at, ring_class->nodes + k, 1);
    }
}

int hs_state_write(const hs_state *state, void *bytes, size_t size) {
    const hs_line *memory = &state->line;
    const hs_contact *contact = memory->contact;
    head header = head_of_state(state);
    size_t n = (size_t)contact->count, g = (size_t)contact->groups;
    if (size != state_bytes(&header)) return HS_NOT_A_STATE;
    unsigned char *at = transfer((unsigned char *)bytes, &header, sizeof header, 1);
    at = transfer(at, contact->gap, 8 * n, 1);
    at = transfer(at, contact->weight, 8 * n, 1);
    at = transfer(at, contact->order, 8 * n, 1);
    at = transfer(at, contact->first, 8 * (g + 1), 1);
    at = transfer(at, contact->query_label, 8 * (size_t)contact->query_count, 1);
    at = transfer_arrays(memory, at, 1);
    if (state->plane) write_plane(state->plane, at);
    put_sum((unsigned char *)bytes, size);
    return HS_OK;
}

/* Largest magnitude of a quantity in SI units, so that its powers are finite; the limit of input
 * (basics/limits.py). */
#define LARGEST_SIZE 1e60

/* True if numbers, in multiples of a unit, are within the limit of input. */
static int are_usable(const double *numbers, int64_t count, double unit) {
    for (int64_t i = 0; i < count; ++i)
        if (!(fabs(numbers[i]) * unit <= LARGEST_SIZE)) return 0;
    return 1;
}

static int is_control(int64_t control) { return control == HS_LOAD || control == HS_DISPLACED; }

/* True if all numbers are from a lower limit to an upper one. */
static int are_between(const double *numbers, int64_t count, double low, double high) {
    for (int64_t i = 0; i < count; ++i)
        if (!(low <= numbers[i] && numbers[i] <= high)) return 0;
    return 1;
}
static int all_finite(const double *numbers, int64_t count) {
    return are_between(numbers, count, -DBL_MAX, DBL_MAX);
}

/* True if the vertices of a group are a stack to the edge, with ascending labels. All else is left
 * to the checksum. */
static int is_stack(const hs_line *memory, int64_t index) {
    const hs_vertex *stack = memory->vertices + index * memory->capacity;
    const int64_t depth = memory->depth[index];
    const double touch = memory->contact->gap[memory->contact->first[index]];
    if (depth == 0 || memory->approach <= touch) return depth == 0 && memory->approach <= touch;
    for (int64_t j = 1; j < depth; ++j)
        if (stack[j].label < stack[j - 1].label) return 0;
    return depth > 1 && all_finite((const double *)stack, 6 * depth) &&
           stack[depth - 1].label == memory->approach;
}

const char *hs_state_check(const hs_state *state) {
    const hs_line *memory = &state->line, *line = hs_active(memory);
    const hs_contact *contact = memory->contact;
    const hs_units *units = &contact->units;
    const int64_t count = contact->count,
                  arrays = (int64_t)hs_evolved_arrays(hs_evolves(memory) > 1);
    /* an energy is the product of a load and a displacement, each within the limit */
    const double energy = units->energy / LARGEST_SIZE,
                 least_weight = contact->load ? 0.0 : DBL_MIN;
    if (!are_between(&units->load, 7, DBL_MIN, DBL_MAX) || !are_usable(&contact->datum, 1, 1.0) ||
        !are_usable(contact->gap, count, units->length) ||
        !are_between(contact->weight, count, least_weight, DBL_MAX) ||
        !all_finite(contact->query_label, contact->query_count) ||
        !are_usable(&memory->approach, 1, units->length) ||
        !are_usable(&memory->displacement, 1, units->displacement) ||
        !are_usable(&memory->normal_load, 2, units->load) ||
        !are_usable(&memory->excess, 1, units->load) ||
        !are_usable(&memory->dissipated, 1, energy) ||
        !are_usable(line->dissipated_each, count + (int64_t)hs_far_count(line->contact), energy) ||
        !are_between(memory->friction, contact->groups, 0.0, HS_MOST_FRICTION) ||
        (memory->evolved && !all_finite(memory->evolved->summit_height, arrays * count)))
        return "a number is not finite, or beyond those that are computed with";
    /* flags of a scaled contact are those of its groups, which are not steep */
    for (int64_t index = 0; index < contact->groups; ++index)
        if (memory->steep[index] > !memory->scaled ||
            (index < line->contact->groups && !is_stack(line, index)))
            return "the vertices of a group do not fit the approach";
    return NULL;
}

/* Read a contact, in the order in which it was written; retains `like` if that is equal. NULL with
 * an `error` if it is invalid. */
static hs_contact *read_contact(const head *header, const unsigned char *at, hs_contact *like,
                                const char **error) {
    const size_t n = (size_t)header->count, g = (size_t)header->groups,
                 watched = (size_t)header->watched;
    int64_t *order = (int64_t *)malloc((4 * n + g + 1) * 8), *group_start = order + n,
            *group = group_start + g + 1;
    double *gap = (double *)(group + n), *weight = gap + n;
    *error = no_memory;
    if (!order) return NULL;
    memcpy(order, at + 16 * n, 8 * (n + g + 1));
    for (size_t i = 0; i < n; ++i) group[i] = -1;
    int fits = group_start[0] == 0 && group_start[g] == header->count;
    for (size_t index = 0; index < g && fits; ++index) {
        fits =
            group_start[index] < group_start[index + 1] && group_start[index + 1] <= header->count;
        for (int64_t i = group_start[index]; fits && i < group_start[index + 1]; ++i) {
            int64_t asperity = order[i];
            fits = asperity >= 0 && asperity < header->count && group[asperity] < 0;
            if (!fits) break;
            group[asperity] = (int64_t)index;
            memcpy(gap + asperity, at + 8 * (size_t)i, 8);
            memcpy(weight + asperity, at + 8 * (n + (size_t)i), 8);
            fits = all_finite(gap + asperity, 1) && all_finite(weight + asperity, 1);
        }
    }
    hs_contact *contact =
        fits ? hs_contact_of(header->count, header->groups, gap, weight, group,
                             (header->features & KNOTS) != 0, &header->units, header->datum)
             : NULL;
    if (contact && watched) contact->query_label = (double *)malloc(8 * watched);
    if (contact && (contact->query_label || !watched)) {
        contact->query_count = header->watched;
        transfer((unsigned char *)at + 8 * (3 * n + g + 1), contact->query_label, 8 * watched, 0);
        /* an order that differs from the sorted one belongs to other gaps */
        fits = memcmp(contact->gap, at, 8 * n) == 0 &&
               memcmp(contact->weight, at + 8 * n, 8 * n) == 0 &&
               memcmp(contact->order, order, 8 * n) == 0 &&
               memcmp(contact->first, group_start, 8 * (g + 1)) == 0;
        *error = NULL;
    }
    if (!fits) *error = "groups do not fit";
    free(order);
    if (contact && (*error || (like && hs_contact_alike(like, contact)))) {
        hs_contact_free(contact);
        contact = *error ? NULL : hs_contact_retain(like);
    }
    return contact;
}

/* Check size, header and checksum of bytes and copy the header; returns an error, or NULL. */
static const char *check_bytes(const unsigned char *bytes, size_t size, head *header) {
    const char *error = check_frame(bytes, size);
    if (error) return error;
    if (size < sizeof *header + sizeof(uint64_t)) return "the bytes are cut off, or too many";
    memcpy(header, bytes, sizeof *header);
    int64_t max_count = (int64_t)(size / 8),
            kind = header->features & ~(int64_t)(SLIDES | PLANE | TURNED | SCALED | FAR);
    int scaled = (header->features & SCALED) != 0, planar = (header->features & PLANE) != 0,
        turned = (header->features & TURNED) != 0;
    int is_kind = kind == 0 || kind == EVOLVES || (kind == KNOTS && header->groups == 1) ||
                  kind == (EVOLVES | YIELDS);
    if (header->count < 1 || header->count > max_count || header->groups < 1 ||
        header->groups > header->count || header->watched < 0 ||
        header->watched > (header->groups > 1 ? 0 : max_count) || header->vertices < 0 ||
        header->vertices > max_count || !is_kind || turned > planar ||
        (planar && (kind & EVOLVES)) ||
        (scaled && (kind || turned || header->groups == 1 || header->vertices < 2)) ||
        header->classes < 0 || header->classes > (turned ? max_count : 0) || header->nodes < 0 ||
        header->nodes > (turned ? max_count : 0) || size != state_bytes(header))
        return "the bytes are cut off, or too many";
    if (!is_control(header->normal_control) || !is_control(header->tangential_control))
        return "a channel is controlled in no known way";
    const double none[3] = {0.0, 0.0, 0.0};
    if (header->features & EVOLVES ? !all_finite(header->totals, 3)
                                   : memcmp(header->totals, none, sizeof none) != 0)
        return "a sum over all asperities is not what they have become";
    return check_sum(bytes, size);
}

/* Largest depth of the stacks in the bytes; -1 if depths are inconsistent with the number of
 * vertices, which a scaled line has. */
static int64_t max_stack_depth(const head *header, const unsigned char *depths) {
    int64_t deepest = 0, depth;
    int64_t remaining = header->features & SCALED ? 0 : header->vertices;
    for (int64_t index = 0; index < header->groups; ++index, remaining -= depth) {
        memcpy(&depth, depths + 8 * index, 8);
        if (depth < 0 || depth > remaining) return -1;
        deepest = depth > deepest ? depth : deepest;
    }
    return remaining == 0 ? deepest : -1;
}

static int has_good_numbers(const hs_plane *plane, const hs_units *units) {
    return plane->height_classes >= 1 && plane->height_classes <= HS_MOST_RINGS &&
           plane->rings >= 1 && plane->rings <= HS_MOST_RINGS && plane->tolerance > 0.0 &&
           plane->tolerance < 1.0 && are_usable(&plane->origin.x, 4, units->displacement) &&
           are_usable(&plane->tangential_load.x, 4, units->load) &&
           fabs(hs_norm(plane->direction) - 1.0) <= 1e-9 &&
           is_control(plane->tangential_control[0]) && is_control(plane->tangential_control[1]);
}

/* Read one class of asperities from position `start`; advances `at` and `start`. Returns an error,
 * or NULL. */
static const char *read_class(hs_state *state, unsigned char **at, int64_t *start,
                              int64_t *remaining) {
    const hs_contact *contact = state->line.contact;
    class_head header;
    memcpy(&header, *at, sizeof header);
    *at += sizeof header;
    int fits = header.group >= 0 && header.group < contact->groups && header.start == *start &&
               header.count > 0 && header.count <= contact->count - header.start &&
               header.nodes >= 0 && header.nodes <= *remaining && header.nodes != 1;
    if (!fits || header.start < contact->first[header.group] ||
        header.start + header.count > contact->first[header.group + 1])
        return "classes do not fit";
    hs_ring_class *ring_class =
        hs_add_class(state, header.group, header.start, header.start + header.count);
    if (!ring_class || hs_reserve_nodes(ring_class, header.nodes) != HS_OK) return no_memory;
    double deepest = ring_class->curve.gap[0], approach = state->line.approach,
           friction = state->line.friction[header.group];
    if ((header.nodes > 0) != (approach > deepest)) return "classes do not fit";
    for (int32_t k = 0; k < header.nodes; ++k) {
        hs_node *node = ring_class->nodes + k;
        *at = transfer_node(*at, node, 0);
        hs_normal normal = hs_normal_at(ring_class->curve, node->label);
        node->normal = normal.load;
        node->integral = normal.integral;
        ring_class->node_count = k + 1;
        int is_ordered = k == 0 ? node->label == approach : node->label < node[-1].label;
        if (!is_ordered || !all_finite(&node->deflection.x, 2) ||
            (k == header.nodes - 1 && node->label != deepest))
            return "nodes do not go from the edge to the deepest spring";
        /* beyond the friction limit steps do not converge */
        double limit = 1.001 * friction * sqrt(approach - node->label);
        if (k == 0 ? hs_norm(node->deflection) > 0.0
                   : hs_norm(hs_ring_traction(ring_class->nodes, k)) > limit)
            return "a traction is beyond the friction limit";
    }
    *start += header.count;
    *remaining -= header.nodes;
    return NULL;
}

/* Read the motion in a plane, after the line of the state. Returns an error, or NULL. */
static const char *read_plane(hs_state *state, const head *header, unsigned char *at) {
    int64_t start = 0, remaining = header->nodes;
    hs_plane *plane = state->plane = (hs_plane *)calloc(1, sizeof *plane);
    if (!plane) return no_memory;
    at = transfer(at, plane, PLANE_BYTES, 0);
    if (!has_good_numbers(plane, &state->line.contact->units))
        return "a setting or a vector is out of its range";
    if (!(header->features & TURNED)) return NULL;
    plane->body = hs_body_new(&state->line, plane->rings, plane->tolerance);
    if (!plane->body) return no_memory;
    state->line.is_direct = 1;
    plane->body->displacement = plane->displacement;
    plane->body->tangential_load = plane->tangential_load;
    for (int64_t c = 0; c < header->classes; ++c) {
        const char *error = read_class(state, &at, &start, &remaining);
        if (error) return error;
    }
    return start != state->line.contact->count || remaining != 0 ? "classes do not fit" : NULL;
}

/* Add the scaled line of a memory whose scalars are read, for the arrays that follow, of which the
 * first are the coefficients. Returns an error, or NULL. */
static const char *read_scaled(hs_line *line, const head *header, unsigned char *at) {
    transfer(at, line->friction, 8 * (size_t)header->groups, 0);
    memset(line->dissipated_each, 0, 8 * (size_t)header->count);
    memset(line->steep, 0, (size_t)header->groups);
    if (!are_between(line->friction, header->groups, 0.0, HS_MOST_FRICTION) ||
        !are_usable(&line->approach, 1, header->units.length))
        return "a coefficient of friction or the approach is not one that is computed with";
    int status = hs_line_add_scaled(line, header->vertices);
    return status == HS_OUT_OF_MEMORY ? no_memory
           : status != HS_OK          ? "the vertices do not fit the friction or the approach"
                                      : NULL;
}

int hs_state_read(const void *bytes, size_t size, const hs_state *like, hs_state **state,
                  const char **error) {
    unsigned char *at = (unsigned char *)bytes;
    head header;
    *error = check_bytes(at, size, &header);
    if (*error) return HS_NOT_A_STATE;
    size_t n = (size_t)header.count, g = (size_t)header.groups;
    at += sizeof header;
    hs_contact *contact = read_contact(&header, at, like ? like->line.contact : NULL, error);
    if (!contact) return HS_NOT_A_STATE;
    at += 8 * (3 * n + g + 1 + (size_t)header.watched);
    /* depths stand after friction and energies, and give the number of vertices */
    size_t far = far_numbers(&header);
    int64_t deepest = max_stack_depth(&header, at + 8 * (g + n + far));
    int evolves = !(header.features & EVOLVES) ? 0
                  : header.features & YIELDS   ? 2
                                               : 1,
        slides = (header.features & SLIDES) != 0;
    hs_state *result = deepest < 0 ? NULL : (hs_state *)calloc(1, sizeof *result);
    *error = deepest < 0 ? "depths of stacks do not fit" : no_memory;
    if (result && hs_line_init(&result->line, contact, deepest + 4, evolves) != HS_OK) {
        free(result);
        result = NULL;
    }
    hs_contact_free(contact);
    hs_line *line = result ? &result->line : NULL;
    /* sliding times have an array of their own */
    if (!result || (slides && hs_slides_assign(line, NULL) != HS_OK)) {
        hs_state_free(result);
        return HS_NOT_A_STATE;
    }
    memcpy(&line->approach, header.scalars, sizeof header.scalars);
    line->identity = header.identity;
    line->normal_control = (int32_t)header.normal_control;
    line->tangential_control = (int32_t)header.tangential_control;
    *error = header.features & SCALED ? read_scaled(line, &header, at) : NULL;
    if (!*error && hs_far_count(hs_active(line)->contact) != far) *error = "clusters do not fit";
    if (*error) {
        hs_state_free(result);
        return HS_NOT_A_STATE;
    }
    at = transfer_arrays(line, at, 0);
    if (line->evolved) memcpy(&line->evolved->slid_together, header.totals, sizeof header.totals);
    if (evolves > 1) hs_sum_yielded(line->evolved, header.count);
    int status = HS_NOT_A_STATE;
    *error = hs_state_check(result);
    if (!*error && like && !hs_line_belongs(line, &like->line)) {
        *error = "the state is of another contact";
        status = HS_FOREIGN;
    }
    if (!*error && header.features & PLANE) *error = read_plane(result, &header, at);
    if (*error) {
        hs_state_free(result);
        return status;
    }
    *state = result;
    return HS_OK;
}
