/* Plane: a contact that moves in two tangential directions. From paths in x and y it integrates the exact line as long as all motion
 * is along it, and the rings of classes.c from the first turn on; it writes rows of both (README.md, two directions). */

#include "plane.h"
#include "lanes.h"
#include "move.h"
#include "readout.h"

static const hs_vector nowhere = {0.0, 0.0};

static hs_vector scaled(double scale, hs_vector a) { return hs_plus(nowhere, scale, a); }

static void look_along(hs_state *state) {
    const hs_line *line = &state->line;
    hs_plane *plane = state->plane;
    plane->displacement = hs_plus(plane->origin, line->displacement, plane->direction);
    plane->tangential_load = scaled(line->tangential_load, plane->direction);
    plane->excess = scaled(line->excess, plane->direction);
}

int hs_state_enter_plane(hs_state *state, int64_t height_classes, int64_t rings, double tolerance) {
    if (state->line.evolved) return HS_FOREIGN;
    if (state->plane) return HS_OK;
    hs_plane *plane = (hs_plane *)calloc(1, sizeof *plane);
    if (!plane) return HS_OUT_OF_MEMORY;
    state->plane = plane;
    plane->direction.x = 1.0;
    plane->tangential_control[0] = state->line.tangential_control;
    plane->tangential_control[1] = HS_LOAD;
    plane->height_classes = height_classes;
    plane->rings = rings;
    plane->tolerance = tolerance;
    look_along(state);
    return HS_OK;
}

void hs_plane_free(hs_plane *plane) {
    if (!plane) return;
    hs_body_free(plane->body);
    free(plane);
}

/* Copy motion in a plane beside the copy of its line. */
static hs_plane *copy_of_plane(const hs_plane *plane, const hs_line *line) {
    hs_plane *copy = (hs_plane *)malloc(sizeof *copy);
    if (!copy) return NULL;
    *copy = *plane;
    if (!plane->body) return copy;
    copy->body = hs_body_copy(plane->body);
    if (!copy->body) {
        free(copy);
        return NULL;
    }
    copy->body->friction = line->friction;
    return copy;
}

hs_state *hs_state_copy(const hs_state *state) {
    hs_state *copy = (hs_state *)calloc(1, sizeof *copy);
    if (!copy || hs_line_init_copy(&copy->line, &state->line) != HS_OK) {
        free(copy);
        return NULL;
    }
    if (!state->plane) return copy;
    copy->plane = copy_of_plane(state->plane, &copy->line);
    if (copy->plane) return copy;
    hs_state_free(copy);
    return NULL;
}

void hs_state_free(hs_state *state) {
    if (!state) return;
    hs_plane_free(state->plane);
    hs_line_clear(&state->line);
    free(state);
}

/* A path in numbers without dimension: what is asked for at its ends. */
typedef struct plan {
    const hs_path *path;
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

static plan planned(const hs_state *state, const hs_path *path, hs_vector compliance, int saturate) {
    const hs_line *line = &state->line;
    const hs_units *units = &line->contact->units;
    int by_x = path->tangential_control[0] == HS_LOAD, by_y = path->tangential_control[1] == HS_LOAD;
    int by_normal = path->normal_control == HS_LOAD;
    hs_vector load = hs_plus(state->plane->tangential_load, saturate ? 1.0 : 0.0, state->plane->excess);
    hs_vector drive = drive_at(state->plane->displacement, compliance, state->plane->tangential_load);
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
static hs_vector goal_of(const hs_state *state, const plan *plan) {
    hs_vector goal = plan->tangential[1];
    if (plan->rigid.x > 0.0) goal.x -= state->plane->origin.x;
    if (plan->rigid.y > 0.0) goal.y -= state->plane->origin.y;
    return goal;
}

/* Component in which the line goes, of two that are controlled alike the first one. */
static int axis_of(const hs_state *state) { return state->plane->direction.x == 0.0; }

/* Whether nothing has happened sideways yet, so that the line may be any. */
static int has_no_line(const hs_line *line) {
    return line->displacement == 0.0 && line->tangential_load == 0.0 && hs_unstrained(line);
}

/* Whether a path goes on along the line; one that is to begin takes the direction of the path. */
static int stays_on_line(hs_state *state, const plan *path) {
    hs_vector goal = goal_of(state, path);
    double size = hs_length(goal), across;
    if (is_mixed(path) && goal.x != 0.0 && goal.y != 0.0) return 0;
    if (has_no_line(&state->line) && size > 0.0) {
        int aligned = goal.x == 0.0 || goal.y == 0.0;
        state->plane->direction.x = aligned ? goal.x != 0.0 : goal.x / size;
        state->plane->direction.y = aligned ? goal.y != 0.0 : goal.y / size;
    }
    if (is_mixed(path)) {
        /* along one axis, while nothing happens along the other; where N goes with a load, one of the line would be in proportion */
        int by_load = (axis_of(state) ? path->rigid.y : path->rigid.x) == 0.0, presses = path->normal[1] != path->normal[0];
        if (by_load && presses && path->path->normal_control == HS_LOAD) return 0;
        return axis_of(state) ? goal.x == 0.0 : state->plane->direction.y == 0.0 && goal.y == 0.0;
    }
    across = fabs(state->plane->direction.x * goal.y - state->plane->direction.y * goal.x);
    if (state->plane->direction.x != 0.0 && state->plane->direction.y != 0.0 && path->compliance.x != path->compliance.y) return 0;
    return across <= HS_TIE * size;
}

/* Rows of one direction from a row on, in the places of those of two. */
static hs_rows rows_of_line(const hs_rows *rows, int64_t row) {
    hs_rows own = *rows;
    double **each[] = {&own.normal_load, &own.contact_radius, &own.stick_radius, &own.dissipated_energy, &own.friction};
    own.totals += row;
    if (own.tangential_load) own.tangential_load += 2 * row * own.columns;
    for (int k = 0; k < 5; ++k)
        if (*each[k]) *each[k] += row * own.columns;
    if (own.slip_state) own.slip_state += row * own.columns;
    return own;
}

/* Give what has a direction, in `count` rows from a row on, its components. */
static void give_direction(const hs_state *state, const hs_rows *rows, int64_t row, int64_t count) {
    hs_vector direction = state->plane->direction, origin = state->plane->origin;
    double unit = state->line.contact->units.displacement;
    int64_t columns = rows->columns;
    double *load = rows->tangential_load ? rows->tangential_load + 2 * row * columns : NULL;
    /* from the last on, since the loads of one direction stand in the first half of their place */
    for (int64_t at = count * columns - 1; at >= 0 && load; --at) {
        load[2 * at + 1] = load[at] * direction.y;
        load[2 * at] = load[at] * direction.x;
    }
    for (int64_t k = row; k < row + count; ++k) {
        hs_totals *totals = rows->totals + k;
        double load = totals->tangential_load, way = totals->displacement;
        hs_vector displacement = {origin.x * unit + way * direction.x, origin.y * unit + way * direction.y};
        rows->total_tangential_load[2 * k] = load * direction.x;
        rows->total_tangential_load[2 * k + 1] = load * direction.y;
        rows->total_displacement[2 * k] = displacement.x;
        rows->total_displacement[2 * k + 1] = displacement.y;
        totals->tangential_load = fabs(load);
        totals->displacement = hs_length(displacement);
    }
}

static int walk_line(hs_state *state, const plan *plan, const hs_rows *rows, const hs_drive *drive, double until,
                     hs_refusal *refusal) {
    const hs_path *path = plan->path;
    const hs_units *units = &state->line.contact->units;
    int axis = axis_of(state), control = path->tangential_control[axis];
    hs_vector goal = goal_of(state, plan);
    double target = hs_dot(goal, state->plane->direction) * (control == HS_LOAD ? units->load : units->displacement);
    double fraction = path->tangential_fraction[0] > 0.0 || path->tangential_fraction[1] > 0.0;
    /* along an axis the very number that is asked for, and the very way there */
    int along_axis = state->plane->direction.x == 0.0 || state->plane->direction.y == 0.0;
    if (along_axis && state->plane->origin.x == 0.0 && state->plane->origin.y == 0.0) {
        target = path->tangential_target[axis];
        fraction = path->tangential_fraction[axis];
    }
    int64_t count = rows ? path->parts - 1 + path->recorded : 0;
    hs_path along = {path->normal_target, path->normal_fraction, {target, 0.0}, {fraction, 0.0},
                     rows ? path->parts : 1, 0, path->normal_control, {control, HS_HELD},
                     count > 0 && path->recorded, path->begin, path->end};
    hs_drive driven = *drive;
    driven.compliance[0] = (axis ? plan->compliance.y : plan->compliance.x) / units->stiffness;
    hs_rows own;
    if (count > 0) own = rows_of_line(rows, path->first_row);
    int64_t number = refusal->path;
    int status = hs_line_integrate(&state->line, &along, 1, count > 0 ? &own : NULL, &driven, until, refusal);
    refusal->path = number;
    if (status == HS_OK && count > 0) give_direction(state, rows, path->first_row, count);
    look_along(state);
    return status;
}

/* The nodes of a class, from the vertices of its group. */
static int nodes_of_line(const hs_state *state, hs_class *part) {
    const hs_line *line = &state->line;
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
        hs_vector deflection = scaled(line->displacement - anchor, state->plane->direction);
        part->nodes[part->count++] = hs_node_at(part, label, deflection);
    }
    return HS_OK;
}

/* Where the classes of a group end. Their bounds go by squares of approaches, so that summits that hardly touch, and slide
 * at small amplitudes, are told from one another, too. Returns how many there are. */
static int64_t classes_of_group(const hs_state *state, int64_t group, int64_t *end) {
    const hs_contact *contact = state->line.contact;
    int64_t at = contact->first[group], stop = contact->first[group + 1], found = 0;
    double d = state->line.approach, most = hs_most(d - contact->gap[at], 0.0);
    for (int64_t k = state->plane->height_classes - 1; k > 0 && !contact->load; --k) {
        double share = (double)k / (double)state->plane->height_classes, bound = d - most * share * share;
        int64_t next = at;
        while (next < stop && contact->gap[next] < bound) ++next;
        if (next > at) end[found++] = at = next;
    }
    if (at < stop) end[found++] = stop;
    return found;
}

hs_class *hs_add_class(hs_state *state, int64_t group, int64_t start, int64_t end) {
    const hs_contact *contact = state->line.contact;
    hs_body *body = state->plane->body;
    hs_class *parts = (hs_class *)realloc(body->parts, (size_t)(body->classes + 1) * sizeof *parts);
    if (!parts) return NULL;
    body->parts = parts;
    hs_class *part = parts + body->classes++;
    memset(part, 0, sizeof *part);
    part->group = group;
    part->start = start;
    part->curve = hs_curve_of(contact, start, end - start);
    return part;
}

static int turn(hs_state *state) {
    hs_line *line = &state->line;
    int64_t *end = (int64_t *)malloc((size_t)state->plane->height_classes * sizeof *end);
    int status = end ? HS_OK : HS_OUT_OF_MEMORY;
    if (status == HS_OK && !(state->plane->body = hs_body_new(line, state->plane->rings, state->plane->tolerance))) status = HS_OUT_OF_MEMORY;
    for (int64_t group = 0; group < line->contact->groups && status == HS_OK; ++group) {
        int64_t classes = classes_of_group(state, group, end), start = line->contact->first[group];
        for (int64_t k = 0; k < classes && status == HS_OK; start = end[k++]) {
            hs_class *part = hs_add_class(state, group, start, end[k]);
            status = part ? nodes_of_line(state, part) : HS_OUT_OF_MEMORY;
        }
    }
    free(end);
    if (status != HS_OK) return status;
    state->plane->body->displacement = state->plane->displacement;
    state->plane->body->tangential_load = state->plane->tangential_load;
    line->displacement = line->tangential_load = line->excess = 0.0;
    status = hs_reserve_vertices(line);
    for (int64_t group = 0; group < line->contact->groups && status == HS_OK; ++group) hs_touch_unstrained(line, group);
    return status;
}

/* Have the line, and what is seen, follow the body. */
static int follow(hs_state *state) {
    hs_body *body = state->plane->body;
    hs_line *line = &state->line;
    int64_t count = line->contact->count;
    if (body->approach != line->approach) {
        hs_set_clock(line, NAN);
        int status = hs_move(line, body->approach, body->normal_load, hs_to_displacement(0.0));
        if (status != HS_OK) return status;
    }
    memcpy(line->dissipated_each, body->each, (size_t)count * sizeof *line->dissipated_each);
    line->dissipated = body->dissipated;
    state->plane->displacement = body->displacement;
    state->plane->tangential_load = body->tangential_load;
    if (body->slid == 0) return HS_OK;
    hs_line_slide_times(line, body->scratch);
    for (int64_t i = 0; i < count; ++i) {
        double *time = body->scratch + line->contact->order[i];
        if (isnan(*time)) *time = body->slide_time[i];
    }
    body->slid = 0;
    return hs_slides_assign(line, body->scratch);
}

/* The path of a body, from the beginning of a plan. */
static hs_plane_path path_of(const hs_state *state, const plan *plan, int saturate) {
    const hs_line *line = &state->line;
    hs_plane_path path;
    memset(&path, 0, sizeof path);
    path.by_loads = plan->by_loads;
    path.saturate = saturate;
    path.approach[0] = line->approach;
    path.normal_load[0] = line->normal_load;
    path.time[0] = plan->path->begin;
    path.time[1] = plan->path->end;
    memcpy(path.value, plan->tangential, sizeof path.value);
    path.rigid = plan->rigid;
    path.compliance.x = plan->rigid.x > 0.0 ? plan->compliance.x : 1.0;
    path.compliance.y = plan->rigid.y > 0.0 ? plan->compliance.y : 1.0;
    if (plan->path->normal_control == HS_LOAD) {
        path.normal_load[1] = plan->normal[1];
        path.approach[1] = hs_approach_at_load(line, plan->normal[1]);
    } else {
        path.approach[1] = plan->normal[1];
        path.normal_load[1] = plan->normal[1] == line->approach ? line->normal_load
                                                                : hs_load_at(hs_all_of(line->contact), plan->normal[1]).load;
    }
    return path;
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
static void put_vectors(const hs_state *state, const hs_rows *rows, int64_t row) {
    const hs_units *units = &state->line.contact->units;
    hs_vector load = scaled(units->load, state->plane->tangential_load), way = scaled(units->displacement, state->plane->displacement);
    hs_totals *totals = rows->totals + row;
    rows->total_tangential_load[2 * row] = load.x;
    rows->total_tangential_load[2 * row + 1] = load.y;
    rows->total_displacement[2 * row] = way.x;
    rows->total_displacement[2 * row + 1] = way.y;
    totals->tangential_load = hs_length(load);
    totals->displacement = hs_length(way);
    totals->saturated = state->plane->excess.x != 0.0 || state->plane->excess.y != 0.0;
}

int hs_plane_read(const hs_state *state, const hs_rows *rows, int64_t row) {
    hs_rows own = rows_of_line(rows, row);
    int status = hs_line_read(&state->line, &own, 0);
    hs_body *body = state->plane->body;
    if (status == HS_OK) give_direction(state, rows, row, 1);
    if (status != HS_OK || !body) return status;
    const hs_contact *contact = state->line.contact;
    const hs_units *units = &contact->units;
    int64_t columns = rows->columns, count = contact->count;
    double slopes[2][2];
    status = hs_body_slopes(body, nowhere, slopes);
    put_vectors(state, rows, row);
    rows->totals[row].tangential_stiffness = slopes[0][0] * units->stiffness;
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
        int64_t i = position[rows->asperity[c]], at = row * columns + c;
        double gap = contact->gap[i], label = hs_least(front[i], body->approach);
        int touches = gap < body->approach;
        rows->tangential_load[2 * at] = touches ? load[i] * units->load : 0.0;
        rows->tangential_load[2 * at + 1] = touches ? load[count + i] * units->load : 0.0;
        /* radii of knots stand for labels */
        double weight = contact->load ? 1.0 : contact->weight[i];
        rows->stick_radius[at] = weight * sqrt(hs_most(label - gap, 0.0)) * units->radius;
        rows->slip_state[at] = hs_slip_state_of(touches, front[i] != HUGE_VAL, label > gap);
    }
    free(load);
    free(position);
    return status;
}

/* Rows within a path. */
typedef struct row_stops {
    hs_stops stops;
    const hs_state *state; /* at the beginning of the path, but for its body */
    const hs_plane_path *path;
    const hs_path *requested;
    const hs_rows *rows;
    int64_t part; /* of the next row */
} row_stops;

static void set_next_row(row_stops *row, int64_t part) {
    int64_t parts = row->requested->parts;
    row->part = part;
    row->stops.next = row->rows && part < parts ? row->stops.until * ((double)part / (double)parts) : HUGE_VAL;
}

static int read_row(hs_stops *stops, hs_body *there) {
    row_stops *row = (row_stops *)stops;
    hs_plane plane = *row->state->plane;
    hs_state state;
    memset(&state, 0, sizeof state);
    state.plane = &plane;
    int status = hs_line_init_copy(&state.line, &row->state->line);
    if (status == HS_OK) {
        plane.body = there;
        there->friction = state.line.friction;
        plane.excess = hs_excess_at(there, row->path, there->fraction);
        status = follow(&state);
        if (status == HS_OK) status = hs_plane_read(&state, row->rows, row->requested->first_row + row->part - 1);
        if (status == HS_OK) status = hs_count_work(there->watch->drive, &there->watch->work, 64 + state.line.contact->count / 16);
        hs_line_clear(&state.line);
    }
    set_next_row(row, row->part + 1);
    return status;
}

/* Move the body along a path and have the line follow. */
static int travel(hs_state *state, hs_plane_path *path, const hs_drive *drive, hs_stops *stops) {
    hs_body *body = state->plane->body;
    hs_watch watch = {drive, 0, HS_OK};
    body->time = path->time[0];
    body->watch = &watch;
    int status = hs_body_travel(body, path, stops);
    if (status == HS_OK) status = follow(state);
    if (status == HS_OK) state->plane->excess = hs_excess_at(body, path, body->fraction);
    body->watch = NULL;
    return status;
}

static int walk_rings(hs_state *state, const plan *plan, const hs_rows *rows, const hs_drive *drive, double until,
                      hs_refusal *refusal) {
    const hs_path *requested = plan->path;
    double request, limit;
    int status = state->plane->body ? HS_OK : turn(state);
    if (status != HS_OK) return status;
    hs_plane_path path = path_of(state, plan, drive->saturate);
    if (!drive->saturate && hs_exceeds_limit(state->plane->body, &path, &request, &limit)) {
        refusal->request = request * state->line.contact->units.load;
        refusal->limit = limit * state->line.contact->units.load;
        return HS_BEYOND_LIMIT;
    }
    row_stops row = {{HUGE_VAL, until, read_row}, state, &path, requested, rows, 0};
    set_next_row(&row, 1);
    status = travel(state, &path, drive, &row.stops);
    return status == HS_OK && rows && requested->recorded ? hs_plane_read(state, rows, requested->first_row + requested->parts - 1)
                                                           : status;
}

static int walk_path(hs_state *state, const hs_path *requested, hs_vector compliance, const hs_rows *rows,
                     const hs_drive *drive, double until, hs_refusal *refusal) {
    hs_path path = *requested;
    for (int k = 0; k < 2; ++k) {
        if (path.tangential_control[k] != HS_HELD) continue;
        path.tangential_control[k] = state->plane->tangential_control[k];
        path.tangential_fraction[k] = 0.0;
    }
    plan plan = planned(state, &path, compliance, drive->saturate);
    int along = !state->plane->body && stays_on_line(state, &plan);
    int status = (along ? walk_line : walk_rings)(state, &plan, rows, drive, until, refusal);
    state->line.normal_control = path.normal_control;
    memcpy(state->plane->tangential_control, path.tangential_control, sizeof path.tangential_control);
    state->line.tangential_control = path.tangential_control[axis_of(state)];
    return status;
}

int hs_plane_integrate(hs_state *state, const hs_path *paths, int64_t count, const hs_rows *rows, const hs_drive *drive,
                       double until, hs_refusal *refusal) {
    double unit = state->line.contact->units.stiffness;
    hs_vector yields = {drive->compliance[0] * unit, drive->compliance[1] * unit};
    hs_refusal unread;
    int status = HS_OK;
    if (!refusal) refusal = &unread;
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        refusal->path = p;
        status = walk_path(state, paths + p, yields, rows, drive, until, refusal);
    }
    refusal->status = status;
    return status;
}

int hs_stiffness_matrix(const hs_state *state, const double direction[2], double stiffness[4]) {
    const hs_units *units = &state->line.contact->units;
    hs_vector towards = {direction[0], direction[1]};
    double slopes[2][2];
    if (!state->plane) return HS_FOREIGN;
    hs_state *turned = hs_state_copy(state);
    int status = turned ? HS_OK : HS_OUT_OF_MEMORY;
    if (status == HS_OK && !turned->plane->body) status = turn(turned);
    if (status == HS_OK) status = hs_body_slopes(turned->plane->body, towards, slopes);
    for (int i = 0; i < 4 && status == HS_OK; ++i) stiffness[i] = slopes[i / 2][i % 2] * units->stiffness;
    hs_state_free(turned);
    return status;
}

int64_t hs_nodes(const hs_state *state, int64_t asperity, int64_t room, double *nodes) {
    if (!state->plane) return 0;
    hs_state *turned = hs_state_copy(state);
    int64_t found = turned && (turned->plane->body || turn(turned) == HS_OK) ? 0 : -1;
    for (int64_t c = 0; found == 0 && c < turned->plane->body->classes; ++c) {
        const hs_class *part = turned->plane->body->parts + c;
        int64_t i = part->start, end = part->start + part->curve.count;
        while (i < end && state->line.contact->order[i] != asperity) ++i;
        for (int64_t k = 0; i < end && k < part->count; found = ++k) {
            if (k >= room) continue;
            nodes[3 * k] = part->nodes[k].label;
            nodes[3 * k + 1] = part->nodes[k].deflection.x;
            nodes[3 * k + 2] = part->nodes[k].deflection.y;
        }
    }
    hs_state_free(turned);
    return found;
}

double hs_plane_stored_energy(const hs_state *state) {
    double total = 0.0;
    if (!state->plane->body) return hs_line_stored_energy(&state->line);
    for (int64_t c = 0; c < state->plane->body->classes; ++c) total += hs_class_stored(state->plane->body->parts + c);
    return total * state->line.contact->units.energy;
}

int hs_plane_set_friction(hs_state *state, const double *friction, const hs_drive *drive) {
    hs_line *line = &state->line;
    const hs_contact *contact = line->contact;
    double unit = contact->units.stiffness;
    if (!state->plane->body) {
        hs_drive along = *drive;
        along.compliance[0] = drive->compliance[axis_of(state)];
        int status = hs_line_set_friction(line, friction, &along);
        look_along(state);
        return status;
    }
    for (int64_t group = 0; group < contact->groups; ++group)
        for (int64_t i = contact->first[group]; i < contact->first[group + 1]; ++i)
            if (friction[contact->order[i]] != friction[contact->order[contact->first[group]]]) return HS_FOREIGN;
    double *first = (double *)malloc((size_t)contact->groups * sizeof *first);
    if (!first) return HS_OUT_OF_MEMORY;
    memcpy(first, line->friction, (size_t)contact->groups * sizeof *first);
    int falls = 0;
    for (int64_t group = 0; group < contact->groups; ++group) {
        line->friction[group] = hs_bound_friction(friction[contact->order[contact->first[group]]]);
        falls |= line->friction[group] < first[group];
    }
    const hs_plane *plane = state->plane;
    const int by_x = plane->tangential_control[0] == HS_LOAD, by_y = plane->tangential_control[1] == HS_LOAD;
    hs_vector yields = {drive->compliance[0] * unit, drive->compliance[1] * unit};
    hs_vector load = hs_plus(plane->tangential_load, 1.0, plane->excess);
    hs_vector driven = drive_at(plane->displacement, yields, plane->tangential_load);
    hs_vector held = {by_x ? load.x : driven.x, by_y ? load.y : driven.y};
    hs_plane_path path = {1, 1, {line->approach, line->approach}, {line->normal_load, line->normal_load}, {NAN, NAN}, {held, held},
                          {by_x ? 0.0 : 1.0, by_y ? 0.0 : 1.0}, {by_x ? 1.0 : yields.x, by_y ? 1.0 : yields.y},
                          0.0, HUGE_VAL, 0, 0, 0, nowhere};
    int status = HS_OK;
    if (falls || plane->excess.x != 0.0 || plane->excess.y != 0.0) {
        plane->body->first_friction = first;
        status = travel(state, &path, drive, NULL);
        plane->body->first_friction = NULL;
    }
    free(first);
    return status;
}
