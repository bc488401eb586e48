/* A contact that moves in two tangential directions: exact along one line, rings from the first turn on. */

#include "rings.h"
#include "lanes.h"
#include "move.h"
#include "readout.h"
#include "state.h"

/* halvings of a path at most */
#define MOST_HALVINGS 12
/* points of a path at which it is looked whether friction holds the load */
#define LOOKS 16

static const hs_vector nowhere = {0.0, 0.0};

static hs_vector scaled(double scale, hs_vector a) { return hs_plus(nowhere, scale, a); }

static void look_along(hs_planar *planar) {
    const hs_memory *line = planar->line;
    planar->displacement = hs_plus(planar->origin, line->displacement, planar->direction);
    planar->tangential_load = scaled(line->tangential_load, planar->direction);
    planar->excess = scaled(line->excess, planar->direction);
}

hs_planar *hs_planar_new(const hs_memory *memory, int64_t height_classes, int64_t rings, double tolerance) {
    if (memory->evolved) return NULL;
    hs_planar *planar = (hs_planar *)calloc(1, sizeof *planar);
    hs_memory *line = hs_memory_copy(memory);
    if (!planar || !line) {
        free(planar);
        hs_memory_free(line);
        return NULL;
    }
    planar->line = line;
    planar->direction.x = 1.0;
    planar->tangential_control[0] = line->tangential_control;
    planar->tangential_control[1] = HS_LOAD;
    planar->height_classes = height_classes;
    planar->rings = rings;
    planar->tolerance = tolerance;
    double settings[3] = {(double)height_classes, (double)rings, tolerance};
    planar->identity = hs_digest(line->identity, settings, sizeof settings);
    look_along(planar);
    return planar;
}

void hs_planar_free(hs_planar *planar) {
    if (!planar) return;
    hs_body_free(planar->body);
    hs_memory_free(planar->line);
    free(planar);
}

hs_planar *hs_planar_copy(const hs_planar *planar) {
    hs_planar *copy = (hs_planar *)malloc(sizeof *copy);
    if (!copy) return NULL;
    *copy = *planar;
    copy->line = hs_memory_copy(planar->line);
    copy->body = planar->body ? hs_body_copy(planar->body) : NULL;
    if (copy->line && (copy->body || !planar->body)) {
        if (copy->body) copy->body->friction = copy->line->friction;
        return copy;
    }
    hs_planar_free(copy);
    return NULL;
}

/* A path in numbers without dimension: what is asked for at its ends. */
typedef struct plan {
    const hs_planar_path *path;
    hs_vector rigid;         /* of each tangential component: 0 where a load is controlled, 1 where a displacement is */
    int by_loads;            /* whether all loads are controlled, and change in proportion; otherwise the approach does */
    hs_vector compliance;    /* of an instrument */
    double normal[2];        /* normal load or approach */
    hs_vector tangential[2]; /* loads, or displacements of the drive */
} plan;

static int is_mixed(const plan *plan) { return plan->rigid.x != plan->rigid.y; }

/* Displacement of the drive of an instrument that the contact holds with a load. */
static hs_vector drive_at(hs_vector displacement, hs_vector compliance, hs_vector load) {
    return HS_MADE(hs_vector){displacement.x + compliance.x * load.x, displacement.y + compliance.y * load.y};
}

static plan planned(const hs_planar *planar, const hs_planar_path *path, hs_vector compliance, int saturate) {
    const hs_memory *line = planar->line;
    const hs_units *units = &line->contact->units;
    int by_x = path->tangential_control[0] == HS_LOAD, by_y = path->tangential_control[1] == HS_LOAD;
    int by_normal = path->normal_control == HS_LOAD;
    hs_vector load = hs_plus(planar->tangential_load, saturate ? 1.0 : 0.0, planar->excess);
    hs_vector drive = drive_at(planar->displacement, compliance, planar->tangential_load);
    hs_vector present = {by_x ? load.x : drive.x, by_y ? load.y : drive.y}, end = present;
    double begin = by_normal ? line->normal_load : line->approach;
    double normal = path->normal_target / (by_normal ? units->load : units->length);
    double x = path->tangential_target[0] / (by_x ? units->load : units->displacement);
    double y = path->tangential_target[1] / (by_y ? units->load : units->displacement);
    if (path->tangential_fraction[0] > 0.0) end.x = hs_toward(present.x, x, path->tangential_fraction[0]);
    if (path->tangential_fraction[1] > 0.0) end.y = hs_toward(present.y, y, path->tangential_fraction[1]);
    plan found = {path, {by_x ? 0.0 : 1.0, by_y ? 0.0 : 1.0}, by_x && by_y && by_normal, compliance, {begin, begin}, {present, end}};
    if (path->normal_fraction > 0.0) found.normal[1] = hs_toward(begin, normal, path->normal_fraction);
    return found;
}

/* Where a plan ends, from the origin of the line. */
static hs_vector goal_of(const hs_planar *planar, const plan *plan) {
    hs_vector goal = plan->tangential[1];
    if (plan->rigid.x > 0.0) goal.x -= planar->origin.x;
    if (plan->rigid.y > 0.0) goal.y -= planar->origin.y;
    return goal;
}

/* Component in which the line goes, of two that are controlled alike the first one. */
static int axis_of(const hs_planar *planar) { return planar->direction.x == 0.0; }

/* Whether nothing has happened sideways yet, so that the line may be any. */
static int has_no_line(const hs_memory *line) {
    return line->displacement == 0.0 && line->tangential_load == 0.0 && hs_unstrained(line);
}

/* Whether a path goes on along the line; one that is to begin takes the direction of the path. */
static int stays_on_line(hs_planar *planar, const plan *path) {
    hs_vector goal = goal_of(planar, path);
    double size = hs_length(goal), across;
    if (is_mixed(path) && goal.x != 0.0 && goal.y != 0.0) return 0;
    if (has_no_line(planar->line) && size > 0.0) {
        int aligned = goal.x == 0.0 || goal.y == 0.0;
        planar->direction.x = aligned ? goal.x != 0.0 : goal.x / size;
        planar->direction.y = aligned ? goal.y != 0.0 : goal.y / size;
    }
    if (is_mixed(path)) {
        /* along one axis, while nothing happens along the other; where N goes with a load, one of the line would be in proportion */
        int by_load = (axis_of(planar) ? path->rigid.y : path->rigid.x) == 0.0, presses = path->normal[1] != path->normal[0];
        if (by_load && presses && path->path->normal_control == HS_LOAD) return 0;
        return axis_of(planar) ? goal.x == 0.0 : planar->direction.y == 0.0 && goal.y == 0.0;
    }
    across = fabs(planar->direction.x * goal.y - planar->direction.y * goal.x);
    if (planar->direction.x != 0.0 && planar->direction.y != 0.0 && path->compliance.x != path->compliance.y) return 0;
    return across <= HS_TIE * size;
}

/* Rows of one direction from a row on, in the places of those of two. */
static hs_rows rows_of_line(const hs_planar_rows *rows, int64_t row) {
    hs_rows own = rows->rows;
    double **each[] = {&own.normal_load, &own.contact_radius, &own.stick_radius, &own.dissipated_energy, &own.friction};
    own.totals += row;
    if (own.tangential_load) own.tangential_load += 2 * row * own.columns;
    for (int k = 0; k < 5; ++k)
        if (*each[k]) *each[k] += row * own.columns;
    if (own.slip_state) own.slip_state += row * own.columns;
    return own;
}

/* Give what has a direction, in `count` rows from a row on, its components. */
static void give_direction(const hs_planar *planar, const hs_planar_rows *rows, int64_t row, int64_t count) {
    hs_vector direction = planar->direction, origin = planar->origin;
    double unit = planar->line->contact->units.displacement;
    int64_t columns = rows->rows.columns;
    double *load = rows->rows.tangential_load ? rows->rows.tangential_load + 2 * row * columns : NULL;
    /* from the last on, since the loads of one direction stand in the first half of their place */
    for (int64_t at = count * columns - 1; at >= 0 && load; --at) {
        load[2 * at + 1] = load[at] * direction.y;
        load[2 * at] = load[at] * direction.x;
    }
    for (int64_t k = row; k < row + count; ++k) {
        hs_totals *totals = rows->rows.totals + k;
        double load = totals->tangential_load, way = totals->displacement;
        hs_vector displacement = {origin.x * unit + way * direction.x, origin.y * unit + way * direction.y};
        rows->tangential_load[2 * k] = load * direction.x;
        rows->tangential_load[2 * k + 1] = load * direction.y;
        rows->displacement[2 * k] = displacement.x;
        rows->displacement[2 * k + 1] = displacement.y;
        totals->tangential_load = fabs(load);
        totals->displacement = hs_length(displacement);
    }
}

static int walk_line(hs_planar *planar, const plan *plan, const hs_planar_rows *rows, const hs_drive *drive, double until,
                     hs_refusal *refusal) {
    const hs_planar_path *path = plan->path;
    const hs_units *units = &planar->line->contact->units;
    int axis = axis_of(planar), control = path->tangential_control[axis];
    hs_vector goal = goal_of(planar, plan);
    double target = hs_dot(goal, planar->direction) * (control == HS_LOAD ? units->load : units->displacement);
    double fraction = path->tangential_fraction[0] > 0.0 || path->tangential_fraction[1] > 0.0;
    /* along an axis the very number that is asked for, and the very way there */
    int along_axis = planar->direction.x == 0.0 || planar->direction.y == 0.0;
    if (along_axis && planar->origin.x == 0.0 && planar->origin.y == 0.0) {
        target = path->tangential_target[axis];
        fraction = path->tangential_fraction[axis];
    }
    int64_t count = rows ? path->parts - 1 + path->recorded : 0;
    hs_path along = {path->normal_target, path->normal_fraction, target, fraction,
                     rows ? path->parts : 1, 0, path->normal_control, control,
                     count > 0 && path->recorded, 0, path->begin, path->end};
    hs_drive driven = *drive;
    driven.compliance = (axis ? plan->compliance.y : plan->compliance.x) / units->stiffness;
    hs_rows own;
    if (count > 0) own = rows_of_line(rows, path->first_row);
    int64_t number = refusal->path;
    int status = hs_integrate(planar->line, &along, 1, count > 0 ? &own : NULL, &driven, until, refusal);
    refusal->path = number;
    if (status == HS_OK && count > 0) give_direction(planar, rows, path->first_row, count);
    look_along(planar);
    return status;
}

/* The nodes of a class, from the vertices of its group. */
static int nodes_of_line(const hs_planar *planar, hs_class *part) {
    const hs_memory *line = planar->line;
    const hs_vertex *stack = line->vertices + part->group * line->capacity;
    double deepest = part->curve.gap[0];
    int64_t depth = line->depth[part->group];
    if (depth == 0 || stack[depth - 1].label <= deepest) return HS_OK;
    if (hs_class_room(part, depth + 1) != HS_OK) return HS_OUT_OF_MEMORY;
    double label = HUGE_VAL;
    for (int64_t j = depth - 1; label > deepest; --j) {
        double anchor = j >= 0 ? stack[j].anchor : stack[0].anchor;
        label = j >= 0 ? stack[j].label : deepest;
        if (label < deepest) {
            anchor = stack[j + 1].anchor - stack[j + 1].slope * (stack[j + 1].label - deepest);
            label = deepest;
        }
        hs_vector deflection = scaled(line->displacement - anchor, planar->direction);
        part->nodes[part->count++] = hs_node_at(part, label, deflection);
    }
    return HS_OK;
}

/* Where the classes of a group end. Their bounds go by squares of approaches, so that summits that hardly touch, and slide
 * at small amplitudes, are told from one another, too. Returns how many there are. */
static int64_t classes_of_group(const hs_planar *planar, int64_t group, int64_t *end) {
    const hs_contact *contact = planar->line->contact;
    int64_t at = contact->first[group], stop = contact->first[group + 1], found = 0;
    double d = planar->line->approach, most = hs_most(d - contact->gap[at], 0.0);
    for (int64_t k = planar->height_classes - 1; k > 0 && !contact->load; --k) {
        double share = (double)k / (double)planar->height_classes, bound = d - most * share * share;
        int64_t next = at;
        while (next < stop && contact->gap[next] < bound) ++next;
        if (next > at) end[found++] = at = next;
    }
    if (at < stop) end[found++] = stop;
    return found;
}

hs_class *hs_add_class(hs_planar *planar, int64_t group, int64_t start, int64_t end) {
    const hs_contact *contact = planar->line->contact;
    hs_body *body = planar->body;
    hs_class *parts = (hs_class *)realloc(body->parts, (size_t)(body->classes + 1) * sizeof *parts);
    if (!parts) return NULL;
    body->parts = parts;
    hs_class *part = parts + body->classes++;
    memset(part, 0, sizeof *part);
    part->group = group;
    part->start = start;
    part->curve.gap = contact->gap + start;
    part->curve.weight = contact->weight + start;
    part->curve.load = contact->load;
    part->curve.count = end - start;
    return part;
}

static int turn(hs_planar *planar) {
    hs_memory *line = planar->line;
    int64_t *end = (int64_t *)malloc((size_t)planar->height_classes * sizeof *end);
    int status = end ? HS_OK : HS_OUT_OF_MEMORY;
    if (status == HS_OK && !(planar->body = hs_body_new(line, planar->rings, planar->tolerance))) status = HS_OUT_OF_MEMORY;
    for (int64_t group = 0; group < line->contact->groups && status == HS_OK; ++group) {
        int64_t classes = classes_of_group(planar, group, end), start = line->contact->first[group];
        for (int64_t k = 0; k < classes && status == HS_OK; start = end[k++]) {
            hs_class *part = hs_add_class(planar, group, start, end[k]);
            status = part ? nodes_of_line(planar, part) : HS_OUT_OF_MEMORY;
        }
    }
    free(end);
    if (status != HS_OK) return status;
    planar->body->displacement = planar->displacement;
    planar->body->tangential_load = planar->tangential_load;
    line->displacement = line->tangential_load = line->excess = 0.0;
    status = hs_reserve_vertices(line);
    for (int64_t group = 0; group < line->contact->groups && status == HS_OK; ++group) hs_touch_unstrained(line, group);
    return status;
}

/* Have the line, and what is seen, follow the body. */
static int follow(hs_planar *planar) {
    hs_body *body = planar->body;
    hs_memory *line = planar->line;
    int64_t count = line->contact->count;
    if (body->approach != line->approach) {
        hs_set_clock(line, NAN);
        int status = hs_move(line, body->approach, body->normal_load, hs_to_displacement(0.0));
        if (status != HS_OK) return status;
    }
    memcpy(line->dissipated_each, body->each, (size_t)count * sizeof *line->dissipated_each);
    line->dissipated = body->dissipated;
    planar->displacement = body->displacement;
    planar->tangential_load = body->tangential_load;
    if (body->slid == 0) return HS_OK;
    hs_slide_times(line, body->scratch);
    for (int64_t i = 0; i < count; ++i) {
        double *time = body->scratch + line->contact->order[i];
        if (isnan(*time)) *time = body->slide_time[i];
    }
    body->slid = 0;
    return hs_slides_assign(line, body->scratch);
}

/* Whether a load is beyond the friction limit on the way to a target. */
static int is_beyond(const hs_planar *planar, const hs_planar_target *to, hs_refusal *refusal) {
    double load = planar->line->contact->units.load;
    hs_planar_aim now = to->aim;
    now.value = planar->tangential_load;
    hs_vector from = hs_loads_of(&now), way = hs_plus(hs_loads_of(&to->aim), -1.0, from);
    for (int k = 1; k <= LOOKS; ++k) {
        double share = (double)k / LOOKS, size = hs_length(hs_plus(from, share, way));
        hs_planar_target there = hs_part_of_way(planar->body, to, share);
        double limit = hs_body_limit(planar->body, there.approach);
        if (size <= limit * (1.0 + 1e-9)) continue;
        refusal->request = size * load;
        refusal->limit = limit * load;
        return 1;
    }
    return 0;
}

/* Limit the loads of an aim to what friction holds at an approach, and note what they ask for beyond the limit. */
static void hold(hs_planar *planar, double approach, hs_planar_aim *aim) {
    hs_vector asked = aim->value;
    double limit = hs_body_limit(planar->body, approach);
    int beyond = hs_length(hs_loads_of(aim)) > limit * (1.0 + HS_LIMIT_SLACK);
    aim->value = hs_held_value(planar->body, approach, aim);
    planar->excess = beyond ? hs_plus(asked, -1.0, aim->value) : nowhere;
}

/* Where a plan leads, a share of the way there; whether friction holds what it asks for. */
static int target_of(hs_planar *planar, const plan *plan, double share, int saturate, hs_planar_target *to, hs_refusal *refusal) {
    const hs_memory *line = planar->line;
    int by_normal = plan->path->normal_control == HS_LOAD;
    double normal = hs_toward(plan->normal[0], plan->normal[1], share);
    hs_vector asked = hs_between(plan->tangential[0], plan->tangential[1], share);
    to->by_loads = plan->by_loads;
    to->time = hs_toward(plan->path->begin, plan->path->end, share);
    if (by_normal && (plan->by_loads || share == 1.0)) {
        to->normal_load = normal;
        to->approach = hs_approach_at_load(line, normal);
    } else {
        /* the approach goes straight */
        to->approach = by_normal ? line->approach + share * (hs_approach_at_load(line, plan->normal[1]) - line->approach) : normal;
        to->normal_load = to->approach == line->approach && !by_normal
                              ? line->normal_load
                              : hs_load_at(hs_all_of(line->contact), to->approach).load;
    }
    to->aim.value = asked;
    to->aim.rigid = plan->rigid;
    to->aim.compliance.x = plan->rigid.x > 0.0 ? plan->compliance.x : 1.0;
    to->aim.compliance.y = plan->rigid.y > 0.0 ? plan->compliance.y : 1.0;
    if (!saturate && is_beyond(planar, to, refusal)) return HS_BEYOND_LIMIT;
    hold(planar, to->approach, &to->aim);
    return HS_OK;
}

/* Loads that a node gives the asperities of a class. */
HS_WIDE static void add_node(const double *restrict gap, const double *restrict weight, int64_t count, double label,
                             hs_vector jump, double *restrict x, double *restrict y) {
    for (int64_t i = 0; i < count; ++i) {
        double depth = label - gap[i] > 0.0 ? label - gap[i] : 0.0, load = weight[i] * depth * sqrt(depth);
        x[i] += jump.x * load;
        y[i] += jump.y * load;
    }
}

/* Tangential loads of knots: what the springs carry that touch from a knot up to the next one. */
static void loads_of_knots(const hs_class *part, double *x, double *y) {
    const hs_curve *curve = &part->curve;
    for (int32_t k = 0; k + 1 < part->count; ++k) {
        const hs_node *outer = part->nodes + k, *inner = outer + 1;
        hs_vector rise = hs_plus(inner->deflection, -1.0, outer->deflection);
        hs_vector slope = scaled(1.0 / (outer->label - inner->label), rise);
        int64_t first = hs_count_touching(curve->gap, curve->count, inner->label) - 1;
        for (int64_t i = first > 0 ? first : 0; i < curve->count && curve->gap[i] < outer->label; ++i) {
            int last = i + 1 == curve->count || curve->gap[i + 1] >= outer->label;
            double high = last ? outer->normal : curve->load[i + 1], low = hs_most(inner->normal, curve->load[i]);
            x[i] += slope.x * (high - low);
            y[i] += slope.y * (high - low);
        }
    }
}

/* Tangential loads of all asperities of the classes, by position: x of all, then y of all. */
static void tangential_loads(const hs_body *body, double *load) {
    int64_t count = body->contact->count;
    memset(load, 0, 2 * (size_t)count * sizeof *load);
    for (int64_t c = 0; c < body->classes; ++c) {
        const hs_class *part = body->parts + c;
        hs_vector slope = nowhere;
        if (part->curve.load) {
            loads_of_knots(part, load + part->start, load + count + part->start);
            continue;
        }
        for (int32_t k = 0; k + 1 < part->count; ++k) {
            const hs_node *outer = part->nodes + k, *inner = outer + 1;
            hs_vector rise = hs_plus(inner->deflection, -1.0, outer->deflection);
            hs_vector next = scaled(1.0 / (outer->label - inner->label), rise);
            int64_t touching = hs_count_touching(part->curve.gap, part->curve.count, outer->label);
            add_node(part->curve.gap, part->curve.weight, touching, outer->label, hs_plus(next, -1.0, slope),
                     load + part->start, load + count + part->start);
            slope = next;
        }
    }
}

/* What a row has of the whole contact that has a direction. */
static void put_vectors(const hs_planar *planar, const hs_planar_rows *rows, int64_t row) {
    const hs_units *units = &planar->line->contact->units;
    hs_vector load = scaled(units->load, planar->tangential_load), way = scaled(units->displacement, planar->displacement);
    hs_totals *totals = rows->rows.totals + row;
    rows->tangential_load[2 * row] = load.x;
    rows->tangential_load[2 * row + 1] = load.y;
    rows->displacement[2 * row] = way.x;
    rows->displacement[2 * row + 1] = way.y;
    totals->tangential_load = hs_length(load);
    totals->displacement = hs_length(way);
    totals->saturated = planar->excess.x != 0.0 || planar->excess.y != 0.0;
}

int hs_planar_read(const hs_planar *planar, const hs_planar_rows *rows, int64_t row) {
    hs_rows own = rows_of_line(rows, row);
    int status = hs_read(planar->line, &own, 0);
    hs_body *body = planar->body;
    if (status == HS_OK) give_direction(planar, rows, row, 1);
    if (status != HS_OK || !body) return status;
    const hs_contact *contact = planar->line->contact;
    const hs_units *units = &contact->units;
    int64_t columns = rows->rows.columns, count = contact->count;
    double slopes[2][2];
    status = hs_body_slopes(body, nowhere, slopes);
    put_vectors(planar, rows, row);
    rows->rows.totals[row].tangential_stiffness = slopes[0][0] * units->stiffness;
    if (status != HS_OK || columns == 0) return status;
    double *load = (double *)malloc(3 * (size_t)count * sizeof *load), *front = load + 2 * count;
    int64_t *position = (int64_t *)malloc((size_t)count * sizeof *position);
    if (!load || !position) status = HS_OUT_OF_MEMORY;
    if (status == HS_OK) {
        tangential_loads(body, load);
        for (int64_t c = 0; c < body->classes; ++c) {
            double label = hs_class_front(body, body->parts + c);
            for (int64_t i = 0; i < body->parts[c].curve.count; ++i) front[body->parts[c].start + i] = label;
        }
        for (int64_t i = 0; i < count; ++i) position[contact->order[i]] = i;
    }
    for (int64_t c = 0; c < columns && status == HS_OK; ++c) {
        int64_t i = position[rows->rows.asperity[c]], at = row * columns + c;
        double gap = contact->gap[i], label = hs_least(front[i], body->approach);
        int touches = gap < body->approach;
        rows->rows.tangential_load[2 * at] = touches ? load[i] * units->load : 0.0;
        rows->rows.tangential_load[2 * at + 1] = touches ? load[count + i] * units->load : 0.0;
        /* radii of knots stand for labels */
        double weight = contact->load ? 1.0 : contact->weight[i];
        rows->rows.stick_radius[at] = weight * sqrt(hs_most(label - gap, 0.0)) * units->radius;
        rows->rows.slip_state[at] = hs_slip_state_of(touches, front[i] != HUGE_VAL, label > gap);
    }
    free(load);
    free(position);
    return status;
}

/* Walk a path with rings. */
static int travel(hs_planar *planar, const plan *plan, const hs_planar_rows *rows, const hs_drive *drive, double until,
                  hs_refusal *refusal) {
    const hs_planar_path *path = plan->path;
    hs_watch watch = {drive, 0, HS_OK};
    int status = planar->body ? HS_OK : turn(planar);
    if (status != HS_OK) return status;
    planar->body->time = path->begin;
    planar->body->watch = &watch;
    for (int64_t part = rows ? 1 : path->parts; part <= path->parts && status == HS_OK; ++part) {
        double share = until * ((double)part / (double)path->parts);
        hs_planar_target to;
        status = target_of(planar, plan, share, drive->saturate, &to, refusal);
        if (status == HS_OK) status = hs_body_travel(planar->body, &to, MOST_HALVINGS);
        if (status == HS_OK) status = follow(planar);
        if (status == HS_OK) status = hs_count_work(drive, &watch.work, 64 + planar->line->contact->count / 16);
        if (status == HS_OK && rows && (part < path->parts || path->recorded))
            status = hs_planar_read(planar, rows, path->first_row + part - 1);
    }
    planar->body->watch = NULL;
    return status;
}

static int walk_path(hs_planar *planar, const hs_planar_path *path, hs_vector compliance, const hs_planar_rows *rows,
                     const hs_drive *drive, double until, hs_refusal *refusal) {
    plan plan = planned(planar, path, compliance, drive->saturate);
    int along = !planar->body && stays_on_line(planar, &plan);
    int status = (along ? walk_line : travel)(planar, &plan, rows, drive, until, refusal);
    planar->line->normal_control = path->normal_control;
    memcpy(planar->tangential_control, path->tangential_control, sizeof planar->tangential_control);
    planar->line->tangential_control = path->tangential_control[axis_of(planar)];
    return status;
}

int hs_planar_integrate(hs_planar *planar, const hs_planar_path *paths, int64_t count, const hs_planar_rows *rows,
                   const double compliance[2], const hs_drive *drive, double until, hs_refusal *refusal) {
    double unit = planar->line->contact->units.stiffness;
    hs_vector yields = {compliance[0] * unit, compliance[1] * unit};
    hs_refusal unread;
    int status = HS_OK;
    if (!refusal) refusal = &unread;
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        refusal->path = p;
        status = walk_path(planar, paths + p, yields, rows, drive, until, refusal);
    }
    refusal->status = status;
    return status;
}

int hs_planar_stiffness(const hs_planar *planar, const double direction[2], double stiffness[4]) {
    const hs_units *units = &planar->line->contact->units;
    hs_vector towards = {direction[0], direction[1]};
    double slopes[2][2];
    hs_planar *turned = hs_planar_copy(planar);
    int status = turned ? HS_OK : HS_OUT_OF_MEMORY;
    if (status == HS_OK && !turned->body) status = turn(turned);
    if (status == HS_OK) status = hs_body_slopes(turned->body, towards, slopes);
    for (int i = 0; i < 4 && status == HS_OK; ++i) stiffness[i] = slopes[i / 2][i % 2] * units->stiffness;
    hs_planar_free(turned);
    return status;
}

int64_t hs_planar_nodes(const hs_planar *planar, int64_t asperity, int64_t room, double *nodes) {
    hs_planar *turned = hs_planar_copy(planar);
    int64_t found = turned && (turned->body || turn(turned) == HS_OK) ? 0 : -1;
    for (int64_t c = 0; found == 0 && c < turned->body->classes; ++c) {
        const hs_class *part = turned->body->parts + c;
        int64_t i = part->start, end = part->start + part->curve.count;
        while (i < end && planar->line->contact->order[i] != asperity) ++i;
        for (int64_t k = 0; i < end && k < part->count; found = ++k) {
            if (k >= room) continue;
            nodes[3 * k] = part->nodes[k].label;
            nodes[3 * k + 1] = part->nodes[k].deflection.x;
            nodes[3 * k + 2] = part->nodes[k].deflection.y;
        }
    }
    hs_planar_free(turned);
    return found;
}

double hs_planar_stored_energy(const hs_planar *planar) {
    double total = 0.0;
    if (!planar->body) return hs_stored_energy(planar->line);
    for (int64_t c = 0; c < planar->body->classes; ++c) total += hs_class_stored(planar->body->parts + c);
    return total * planar->line->contact->units.energy;
}

int hs_planar_set_friction(hs_planar *planar, const double *friction, const double compliance[2], const hs_drive *drive) {
    hs_memory *line = planar->line;
    const hs_contact *contact = line->contact;
    double unit = contact->units.stiffness;
    if (!planar->body) {
        hs_drive along = *drive;
        along.compliance = compliance[axis_of(planar)];
        int status = hs_set_friction(line, friction, &along);
        look_along(planar);
        return status;
    }
    for (int64_t group = 0; group < contact->groups; ++group)
        for (int64_t i = contact->first[group]; i < contact->first[group + 1]; ++i)
            if (friction[contact->order[i]] != friction[contact->order[contact->first[group]]]) return HS_FOREIGN;
    for (int64_t group = 0; group < contact->groups; ++group)
        line->friction[group] = hs_bound_friction(friction[contact->order[contact->first[group]]]);
    int by_x = planar->tangential_control[0] == HS_LOAD, by_y = planar->tangential_control[1] == HS_LOAD;
    hs_vector t = hs_plus(planar->tangential_load, 1.0, planar->excess);
    hs_vector yields = {compliance[0] * unit, compliance[1] * unit}, driven = drive_at(planar->displacement, yields, t);
    hs_planar_aim aim = {
        {by_x ? t.x : driven.x, by_y ? t.y : driven.y},
        {by_x ? 0.0 : 1.0, by_y ? 0.0 : 1.0},
        {by_x ? 1.0 : yields.x, by_y ? 1.0 : yields.y},
    };
    hold(planar, planar->body->approach, &aim);
    hs_watch watch = {drive, 0, HS_OK};
    planar->body->watch = &watch;
    int status = hs_body_relax(planar->body, &aim);
    planar->body->watch = NULL;
    return status == HS_OK ? follow(planar) : status;
}
