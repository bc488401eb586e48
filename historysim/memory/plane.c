/* Plane: paths and rows of a contact that moves in two tangential directions.
 *
 * As long as all motion is along one line, the exact memory of one direction (polyline.c) is
 * integrated and resolved into components. At the first turn its vertices become nodes v(a) = V -
 * w(a), and from then on the rings of classes.c are integrated; the line follows their approach
 * (README.md, two directions). */

#include "plane.h"
#include "lanes.h"
#include "move.h"
#include "readout.h"
#include "scaled.h"

/* scale a. */
static hs_vector scale_vector(double scale, hs_vector a) {
    return hs_add_scaled(zero_vector, scale, a);
}

/* Set displacement and loads of the plane from its line. */
static void update_from_line(hs_state *state) {
    const hs_line *line = &state->line;
    hs_plane *plane = state->plane;
    plane->displacement = hs_add_scaled(plane->origin, line->displacement, plane->direction);
    plane->tangential_load = scale_vector(line->tangential_load, plane->direction);
    plane->excess = scale_vector(line->excess, plane->direction);
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
    update_from_line(state);
    return HS_OK;
}

void hs_plane_free(hs_plane *plane) {
    if (!plane) return;
    hs_body_free(plane->body);
    free(plane);
}

/* Copy a plane for the copy of its line; NULL if out of memory. */
static hs_plane *copy_plane(const hs_plane *plane, const hs_line *line) {
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
    copy->plane = copy_plane(state->plane, &copy->line);
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

static int is_mixed(const hs_plane_path *path) { return path->rigid.x != path->rigid.y; }

/* Plan of a path of dimensionless targets from the present state, with tangential targets only;
 * with `saturate` it starts at the load requested last. */
static hs_plane_path start_path(const hs_state *state, const hs_path *path, const hs_drive *drive,
                                int saturate) {
    const hs_plane *plane = state->plane;
    double unit = state->line.contact->units.stiffness;
    hs_vector compliance = {drive->compliance[0] * unit, drive->compliance[1] * unit};
    int by_x = path->tangential_control[0] == HS_LOAD,
        by_y = path->tangential_control[1] == HS_LOAD;
    const hs_vector *load = &plane->tangential_load;
    hs_plane_path result;
    memset(&result, 0, sizeof result);
    result.line = &state->line;
    result.plan.is_planar = 1;
    result.plan.normal_by_load = path->normal_control == HS_LOAD;
    result.plan.tangential_by_load = by_x || by_y;
    result.plan.both_loads = by_x && by_y && result.plan.normal_by_load;
    result.saturate = saturate;
    result.rigid = HS_MADE(hs_vector){by_x ? 0.0 : 1.0, by_y ? 0.0 : 1.0};
    result.compliance = HS_MADE(hs_vector){by_x ? 1.0 : compliance.x, by_y ? 1.0 : compliance.y};
    /* displacement of the drive of an instrument, or load */
    hs_vector present = {by_x ? load->x + (saturate ? plane->excess.x : 0.0)
                              : plane->displacement.x + compliance.x * load->x,
                         by_y ? load->y + (saturate ? plane->excess.y : 0.0)
                              : plane->displacement.y + compliance.y * load->y};
    hs_vector target = {
        hs_toward(present.x, path->tangential_target[0], path->tangential_fraction[0]),
        hs_toward(present.y, path->tangential_target[1], path->tangential_fraction[1])};
    hs_set_request(&result, 0, present);
    hs_set_request(&result, 1, target);
    return result;
}

/* Tangential request at fraction 1, displacements from the origin of the line. */
static hs_vector line_endpoint(const hs_state *state, const hs_plane_path *path) {
    hs_vector endpoint = path->value[1];
    if (path->rigid.x > 0.0) endpoint.x -= state->plane->origin.x;
    if (path->rigid.y > 0.0) endpoint.y -= state->plane->origin.y;
    return endpoint;
}

/* Axis of the line: 1 if it is along y, otherwise 0. */
static int line_axis(const hs_state *state) { return state->plane->direction.x == 0.0; }

/* True if no tangential motion or load determines the direction of the line yet. */
static int has_no_direction(const hs_line *line) {
    return line->displacement == 0.0 && line->tangential_load == 0.0 && hs_unstrained(line);
}

/* True if a path continues along the line; a line without direction takes the direction of the
 * path. `changes_load`: true if the normal load is prescribed to change. */
static int stays_on_line(hs_state *state, const hs_plane_path *path, int changes_load) {
    hs_vector endpoint = line_endpoint(state, path), *direction = &state->plane->direction;
    double norm = hs_norm(endpoint);
    if (is_mixed(path) && endpoint.x != 0.0 && endpoint.y != 0.0) return 0;
    if (has_no_direction(&state->line) && norm > 0.0) {
        int aligned = endpoint.x == 0.0 || endpoint.y == 0.0;
        direction->x = aligned ? endpoint.x != 0.0 : endpoint.x / norm;
        direction->y = aligned ? endpoint.y != 0.0 : endpoint.y / norm;
    }
    if (is_mixed(path)) {
        /* along one axis, the other one at rest; a line would change a load in proportion to a
         * changing normal load */
        if (changes_load && (line_axis(state) ? path->rigid.y : path->rigid.x) == 0.0) return 0;
        return line_axis(state) ? endpoint.x == 0.0 : direction->y == 0.0 && endpoint.y == 0.0;
    }
    if (direction->x != 0.0 && direction->y != 0.0 && path->compliance.x != path->compliance.y)
        return 0;
    return fabs(direction->x * endpoint.y - direction->y * endpoint.x) <= HS_TIE * norm;
}

/* Shift the arrays of rows by a number of rows; tangential loads have two components per asperity.
 */
static hs_rows shift_rows(const hs_rows *rows, int64_t row) {
    hs_rows shifted = *rows;
    double **arrays[] = {&shifted.normal_load, &shifted.contact_radius, &shifted.stick_radius,
                         &shifted.dissipated_energy, &shifted.friction};
    shifted.totals += row;
    if (shifted.tangential_load) shifted.tangential_load += 2 * row * shifted.columns;
    for (int k = 0; k < 5; ++k)
        if (*arrays[k]) *arrays[k] += row * shifted.columns;
    if (shifted.slip_state) shifted.slip_state += row * shifted.columns;
    return shifted;
}

/* Resolve tangential loads and displacements along the line into components, in `count` rows from
 * `row`. */
static void resolve_components(const hs_state *state, const hs_rows *rows, int64_t row,
                               int64_t count) {
    hs_vector direction = state->plane->direction, origin = state->plane->origin;
    double unit = state->line.contact->units.displacement;
    int64_t columns = rows->columns;
    double *load = rows->tangential_load ? rows->tangential_load + 2 * row * columns : NULL;
    /* backwards, since loads along the line occupy the first half of the array */
    for (int64_t cell = count * columns - 1; cell >= 0 && load; --cell) {
        load[2 * cell + 1] = load[cell] * direction.y;
        load[2 * cell] = load[cell] * direction.x;
    }
    for (int64_t k = row; k < row + count; ++k) {
        hs_totals *totals = rows->totals + k;
        double load = totals->tangential_load, distance = totals->displacement;
        hs_vector displacement = {origin.x * unit + distance * direction.x,
                                  origin.y * unit + distance * direction.y};
        rows->total_tangential_load[2 * k] = load * direction.x;
        rows->total_tangential_load[2 * k + 1] = load * direction.y;
        rows->total_displacement[2 * k] = displacement.x;
        rows->total_displacement[2 * k + 1] = displacement.y;
        totals->tangential_load = fabs(load);
        totals->displacement = hs_norm(displacement);
    }
}

/* Integrate a path along the line; returns a status. */
static int move_line(hs_state *state, const hs_path *path, hs_plane_path *plane_path,
                     const hs_rows *rows, const hs_drive *drive, double stop_fraction,
                     hs_refusal *refusal) {
    const hs_units *units = &state->line.contact->units;
    int axis = line_axis(state), control = path->tangential_control[axis];
    hs_vector endpoint = line_endpoint(state, plane_path);
    double target = hs_dot(endpoint, state->plane->direction) *
                    (control == HS_LOAD ? units->load : units->displacement);
    double fraction = path->tangential_fraction[0] > 0.0 || path->tangential_fraction[1] > 0.0;
    /* along an axis the requested number itself, without rounding */
    int along_axis = state->plane->direction.x == 0.0 || state->plane->direction.y == 0.0;
    if (along_axis && state->plane->origin.x == 0.0 && state->plane->origin.y == 0.0) {
        target = path->tangential_target[axis];
        fraction = path->tangential_fraction[axis];
    }
    int64_t count = rows ? path->parts - 1 + path->recorded : 0;
    hs_path line_path = {path->normal_target,
                         path->normal_fraction,
                         {target, 0.0},
                         {fraction, 0.0},
                         rows ? path->parts : 1,
                         0,
                         path->normal_control,
                         {control, HS_HELD},
                         count > 0 && path->recorded,
                         path->begin,
                         path->end};
    hs_drive line_drive = *drive;
    line_drive.compliance[0] = drive->compliance[axis];
    hs_rows line_rows;
    if (count > 0) line_rows = shift_rows(rows, path->first_row);
    int64_t path_number = refusal->path;
    int status = hs_line_integrate(&state->line, &line_path, 1, count > 0 ? &line_rows : NULL,
                                   &line_drive, stop_fraction, NULL, refusal);
    refusal->path = path_number;
    if (status == HS_OK && count > 0) resolve_components(state, rows, path->first_row, count);
    update_from_line(state);
    return status;
}

/* Create the nodes of a class from the vertices of its group; returns a status. */
static int create_nodes(const hs_state *state, hs_ring_class *ring_class) {
    const hs_line *line = &state->line;
    const hs_vertex *stack = line->vertices + ring_class->group * line->capacity;
    double deepest = ring_class->curve.gap[0];
    int64_t depth = line->depth[ring_class->group];
    if (depth == 0 || stack[depth - 1].label <= deepest) return HS_OK;
    if (hs_reserve_nodes(ring_class, depth + 1) != HS_OK) return HS_OUT_OF_MEMORY;
    double label = HUGE_VAL;
    for (int64_t j = depth - 1; label > deepest; --j) {
        double anchor = j >= 0 ? stack[j].anchor : stack[0].anchor;
        label = j >= 0 ? stack[j].label : deepest;
        if (label < deepest) {
            anchor = stack[j + 1].anchor - stack[j + 1].slope * (stack[j + 1].label - deepest);
            label = deepest;
        }
        hs_vector deflection = scale_vector(line->displacement - anchor, state->plane->direction);
        ring_class->nodes[ring_class->node_count++] = hs_node_at(ring_class, label, deflection);
    }
    return HS_OK;
}

/* Divide a group into classes of similar gaps; returns their number, `class_stop` their upper
 * positions. Bounds of gaps are quadratic in the number of the class, so that classes are narrow
 * near the edge, where asperities slide at small amplitudes. */
static int64_t divide_group(const hs_state *state, int64_t group, int64_t *class_stop) {
    const hs_contact *contact = state->line.contact;
    int64_t position = contact->first[group], stop = contact->first[group + 1], class_count = 0;
    double approach = state->line.approach,
           max_depth = hs_max(approach - contact->gap[position], 0.0);
    for (int64_t k = state->plane->height_classes - 1; k > 0 && !contact->load; --k) {
        double fraction = (double)k / (double)state->plane->height_classes,
               bound = approach - max_depth * fraction * fraction;
        int64_t upper = position;
        while (upper < stop && contact->gap[upper] < bound) ++upper;
        if (upper > position) class_stop[class_count++] = position = upper;
    }
    if (position < stop) class_stop[class_count++] = stop;
    return class_count;
}

hs_ring_class *hs_add_class(hs_state *state, int64_t group, int64_t offset, int64_t stop) {
    const hs_contact *contact = state->line.contact;
    hs_body *body = state->plane->body;
    hs_ring_class *classes =
        (hs_ring_class *)realloc(body->classes, (size_t)(body->class_count + 1) * sizeof *classes);
    if (!classes) return NULL;
    body->classes = classes;
    hs_ring_class *ring_class = classes + body->class_count++;
    memset(ring_class, 0, sizeof *ring_class);
    ring_class->group = group;
    ring_class->offset = offset;
    ring_class->curve = hs_curve_of(contact, offset, stop - offset);
    return ring_class;
}

/* Switch from the line to rings, at the first turn; returns a status. */
static int switch_to_rings(hs_state *state) {
    hs_line *line = &state->line;
    int64_t *class_stop =
        (int64_t *)malloc((size_t)state->plane->height_classes * sizeof *class_stop);
    int status = class_stop ? hs_line_restore_groups(line) : (int)HS_OUT_OF_MEMORY;
    hs_settle_energies(line);
    if (status == HS_OK &&
        !(state->plane->body = hs_body_new(line, state->plane->rings, state->plane->tolerance)))
        status = HS_OUT_OF_MEMORY;
    for (int64_t group = 0; group < line->contact->groups && status == HS_OK; ++group) {
        int64_t class_count = divide_group(state, group, class_stop),
                offset = line->contact->first[group];
        for (int64_t k = 0; k < class_count && status == HS_OK; offset = class_stop[k++]) {
            hs_ring_class *ring_class = hs_add_class(state, group, offset, class_stop[k]);
            status = ring_class ? create_nodes(state, ring_class) : HS_OUT_OF_MEMORY;
        }
    }
    free(class_stop);
    if (status != HS_OK) return status;
    state->plane->body->displacement = state->plane->displacement;
    state->plane->body->tangential_load = state->plane->tangential_load;
    line->displacement = line->tangential_load = line->excess = 0.0;
    line->is_direct = 1;
    status = hs_reserve_vertices(line);
    for (int64_t group = 0; group < line->contact->groups && status == HS_OK; ++group)
        hs_touch_unstrained(line, group);
    return status;
}

/* Update line and plane from the body; returns a status. */
static int update_line(hs_state *state) {
    hs_body *body = state->plane->body;
    hs_line *line = &state->line;
    int64_t count = line->contact->count;
    if (body->approach != line->approach) {
        hs_set_clock(line, NAN);
        int status = hs_move(line, body->approach, body->normal_load, hs_to_displacement(0.0));
        if (status != HS_OK) return status;
    }
    memcpy(line->dissipated_each, body->asperity_loss,
           (size_t)count * sizeof *line->dissipated_each);
    line->dissipated = body->dissipated;
    state->plane->displacement = body->displacement;
    state->plane->tangential_load = body->tangential_load;
    if (body->has_new_slide_times == 0) return HS_OK;
    hs_line_slide_times(line, body->scratch);
    for (int64_t i = 0; i < count; ++i) {
        double *time = body->scratch + line->contact->order[i];
        if (isnan(*time)) *time = body->slide_time[i];
    }
    body->has_new_slide_times = 0;
    return hs_slides_assign(line, body->scratch);
}

/* Add tangential loads of asperities from a jump of slope at the node `label`. */
HS_WIDE static void add_node_loads(const double *restrict gap, const double *restrict weight,
                                   int64_t count, double label, hs_vector jump, double *restrict x,
                                   double *restrict y) {
    for (int64_t i = 0; i < count; ++i) {
        double depth = label - gap[i] > 0.0 ? label - gap[i] : 0.0,
               load = weight[i] * depth * sqrt(depth);
        x[i] += jump.x * load;
        y[i] += jump.y * load;
    }
}

/* Add tangential loads of the knots of a normal curve: loads of the springs between a knot and its
 * outer neighbour. */
static void add_knot_loads(const hs_ring_class *ring_class, double *x, double *y) {
    const hs_curve *curve = &ring_class->curve;
    for (int32_t k = 0; k + 1 < ring_class->node_count; ++k) {
        const hs_node *outer = ring_class->nodes + k, *inner = outer + 1;
        hs_vector rise = hs_add_scaled(inner->deflection, -1.0, outer->deflection);
        hs_vector slope = scale_vector(1.0 / (outer->label - inner->label), rise);
        int64_t lowest = hs_count_touching(curve->gap, curve->count, inner->label) - 1;
        for (int64_t i = lowest > 0 ? lowest : 0; i < curve->count && curve->gap[i] < outer->label;
             ++i) {
            int is_outermost = i + 1 == curve->count || curve->gap[i + 1] >= outer->label;
            double high = is_outermost ? outer->normal : curve->load[i + 1],
                   low = hs_max(inner->normal, curve->load[i]);
            x[i] += slope.x * (high - low);
            y[i] += slope.y * (high - low);
        }
    }
}

/* Compute tangential loads of all asperities by position: x of all, then y of all. */
static void compute_asperity_loads(const hs_body *body, double *load) {
    int64_t count = body->contact->count;
    memset(load, 0, 2 * (size_t)count * sizeof *load);
    for (int64_t c = 0; c < body->class_count; ++c) {
        const hs_ring_class *ring_class = body->classes + c;
        hs_vector slope = zero_vector;
        if (ring_class->curve.load) {
            add_knot_loads(ring_class, load + ring_class->offset,
                           load + count + ring_class->offset);
            continue;
        }
        for (int32_t k = 0; k + 1 < ring_class->node_count; ++k) {
            const hs_node *outer = ring_class->nodes + k, *inner = outer + 1;
            hs_vector rise = hs_add_scaled(inner->deflection, -1.0, outer->deflection);
            hs_vector inner_slope = scale_vector(1.0 / (outer->label - inner->label), rise);
            int64_t touching =
                hs_count_touching(ring_class->curve.gap, ring_class->curve.count, outer->label);
            add_node_loads(ring_class->curve.gap, ring_class->curve.weight, touching, outer->label,
                           hs_add_scaled(inner_slope, -1.0, slope), load + ring_class->offset,
                           load + count + ring_class->offset);
            slope = inner_slope;
        }
    }
}

/* Write tangential load and displacement of the contact into a row. */
static void write_vectors(const hs_state *state, const hs_rows *rows, int64_t row) {
    const hs_units *units = &state->line.contact->units;
    hs_vector load = scale_vector(units->load, state->plane->tangential_load),
              displacement = scale_vector(units->displacement, state->plane->displacement);
    hs_totals *totals = rows->totals + row;
    rows->total_tangential_load[2 * row] = load.x;
    rows->total_tangential_load[2 * row + 1] = load.y;
    rows->total_displacement[2 * row] = displacement.x;
    rows->total_displacement[2 * row + 1] = displacement.y;
    totals->tangential_load = hs_norm(load);
    totals->displacement = hs_norm(displacement);
    totals->saturated = state->plane->excess.x != 0.0 || state->plane->excess.y != 0.0;
}

int hs_plane_read(const hs_state *state, const hs_rows *rows, int64_t row) {
    hs_rows shifted = shift_rows(rows, row);
    int status = hs_line_read(&state->line, &shifted, 0);
    hs_body *body = state->plane->body;
    if (status == HS_OK) resolve_components(state, rows, row, 1);
    if (status != HS_OK || !body) return status;
    const hs_contact *contact = state->line.contact;
    const hs_units *units = &contact->units;
    int64_t columns = rows->columns, count = contact->count;
    double stiffness[2][2];
    status = hs_body_stiffness(body, zero_vector, stiffness);
    write_vectors(state, rows, row);
    rows->totals[row].tangential_stiffness = stiffness[0][0] * units->stiffness;
    if (status != HS_OK || columns == 0) return status;
    double *load = (double *)malloc(3 * (size_t)count * sizeof *load), *front = load + 2 * count;
    int64_t *position = (int64_t *)malloc((size_t)count * sizeof *position);
    if (!load || !position) status = HS_OUT_OF_MEMORY;
    if (status == HS_OK) {
        compute_asperity_loads(body, load);
        for (int64_t c = 0; c < body->class_count; ++c) {
            double label = hs_slip_front(body, body->classes + c);
            for (int64_t i = 0; i < body->classes[c].curve.count; ++i)
                front[body->classes[c].offset + i] = label;
        }
        for (int64_t i = 0; i < count; ++i) position[contact->order[i]] = i;
    }
    for (int64_t c = 0; c < columns && status == HS_OK; ++c) {
        int64_t i = position[rows->asperity[c]], cell = row * columns + c;
        double gap = contact->gap[i], label = hs_min(front[i], body->approach);
        int touches = gap < body->approach;
        rows->tangential_load[2 * cell] = touches ? load[i] * units->load : 0.0;
        rows->tangential_load[2 * cell + 1] = touches ? load[count + i] * units->load : 0.0;
        /* knots have no weight; the stick radius is a measure of their label */
        double weight = contact->load ? 1.0 : contact->weight[i];
        rows->stick_radius[cell] = weight * sqrt(hs_max(label - gap, 0.0)) * units->radius;
        rows->slip_state[cell] = hs_slip_state_of(touches, front[i] != HUGE_VAL, label > gap);
    }
    free(load);
    free(position);
    return status;
}

/* Stops of the rows within a path (`hs_stops`). */
typedef struct row_stops {
    hs_stops stops;
    const hs_state *state; /* at fraction 0 of the path, except for its body */
    const hs_plane_path *path;
    const hs_path *requested;
    const hs_rows *rows;
    int64_t part_number; /* of the following row */
} row_stops;

/* Set the stop of a row, at the fraction `part_number` / parts of the path. */
static void schedule_row(row_stops *row, int64_t part_number) {
    int64_t part_count = row->requested->parts;
    row->part_number = part_number;
    row->stops.next_fraction =
        row->rows && part_number < part_count
            ? row->stops.stop_fraction * ((double)part_number / (double)part_count)
            : HUGE_VAL;
}

/* Read a row at a stop and schedule the following one; returns a status. */
static int read_row(hs_stops *stops, hs_body *body) {
    row_stops *row = (row_stops *)stops;
    hs_plane plane = *row->state->plane;
    hs_state state;
    memset(&state, 0, sizeof state);
    state.plane = &plane;
    int status = hs_line_init_copy(&state.line, &row->state->line);
    if (status == HS_OK) {
        plane.body = body;
        body->friction = state.line.friction;
        plane.excess = hs_excess_of(body, row->path);
        status = update_line(&state);
        if (status == HS_OK)
            status =
                hs_plane_read(&state, row->rows, row->requested->first_row + row->part_number - 1);
        /* work of a row [µs]; factors chosen */
        if (status == HS_OK)
            status = hs_count_work(body->watch->drive, &body->watch->work_since_poll,
                                   64 + state.line.contact->count / 16);
        hs_line_clear(&state.line);
    }
    schedule_row(row, row->part_number + 1);
    return status;
}

/* Move the body along a path, then update the line; returns a status. */
static int integrate_path(hs_state *state, hs_plane_path *path, const hs_drive *drive,
                          hs_stops *stops) {
    hs_body *body = state->plane->body;
    hs_watch watch = {drive, 0, HS_OK};
    body->time = path->plan.times[0];
    body->watch = &watch;
    int status = hs_body_integrate(body, path, stops);
    if (status == HS_OK) status = update_line(state);
    if (status == HS_OK) state->plane->excess = hs_excess_of(body, path);
    body->watch = NULL;
    return status;
}

/* Integrate a path by rings; returns a status. */
static int move_rings(hs_state *state, const hs_path *requested, hs_plane_path *path,
                      const hs_rows *rows, const hs_drive *drive, double stop_fraction,
                      hs_refusal *refusal) {
    int status = state->plane->body ? HS_OK : switch_to_rings(state);
    if (status != HS_OK) return status;
    hs_path scaled = hs_scale_path(&state->line.contact->units, requested);
    hs_set_normal_targets(&state->line, &scaled, &path->plan);
    path->plan.margin = HS_TIE;
    if (!drive->saturate && path->plan.tangential_by_load)
        status = hs_cut_at_limit(&state->line, &path->plan, 0, refusal);
    if (status != HS_OK) return status;
    row_stops row = {{HUGE_VAL, stop_fraction, read_row}, state, path, requested, rows, 0};
    schedule_row(&row, 1);
    status = integrate_path(state, path, drive, &row.stops);
    return status == HS_OK && rows && requested->recorded
               ? hs_plane_read(state, rows, requested->first_row + requested->parts - 1)
               : status;
}

/* Path with the present controls of components that are held. */
static hs_path resolve_held(const hs_state *state, const hs_path *requested) {
    hs_path path = *requested;
    for (int k = 0; k < 2; ++k) {
        if (path.tangential_control[k] != HS_HELD) continue;
        path.tangential_control[k] = state->plane->tangential_control[k];
        path.tangential_fraction[k] = 0.0;
    }
    return path;
}

static void set_controls(hs_state *state, const hs_path *path) {
    state->line.normal_control = path->normal_control;
    memcpy(state->plane->tangential_control, path->tangential_control,
           sizeof path->tangential_control);
    state->line.tangential_control = path->tangential_control[line_axis(state)];
}

/* Integrate one path, along the line or by rings; returns a status. */
static int move_plane(hs_state *state, const hs_path *requested, const hs_rows *rows,
                      const hs_drive *drive, double stop_fraction, hs_refusal *refusal) {
    hs_path path = resolve_held(state, requested),
            scaled = hs_scale_path(&state->line.contact->units, &path);
    hs_plane_path plane_path = start_path(state, &scaled, drive, drive->saturate);
    int changes_load = path.normal_control == HS_LOAD && path.normal_fraction > 0.0 &&
                       scaled.normal_target != state->line.normal_load;
    int is_on_line = !state->plane->body && stays_on_line(state, &plane_path, changes_load);
    int status = (is_on_line ? move_line : move_rings)(state, &path, &plane_path, rows, drive,
                                                       stop_fraction, refusal);
    set_controls(state, &path);
    return status;
}

int hs_plane_stick(hs_state *state, const hs_path *requested, const hs_drive *drive, int *sticks) {
    const hs_plane *plane = state->plane;
    *sticks = plane->body && plane->excess.x == 0.0 && plane->excess.y == 0.0;
    if (!*sticks) return HS_OK;
    hs_path path = resolve_held(state, requested),
            scaled = hs_scale_path(&state->line.contact->units, &path);
    hs_plane_path plane_path = start_path(state, &scaled, drive, drive->saturate);
    hs_set_normal_targets(&state->line, &scaled, &plane_path.plan);
    int status = hs_body_stick(plane->body, &plane_path, sticks);
    if (status != HS_OK || !*sticks) return status;
    set_controls(state, &path);
    return update_line(state);
}

int hs_plane_integrate(hs_state *state, const hs_path *paths, int64_t count, const hs_rows *rows,
                       const hs_drive *drive, double stop_fraction, hs_refusal *refusal) {
    hs_refusal unused;
    int status = HS_OK;
    if (!refusal) refusal = &unused;
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        refusal->path = p;
        status = move_plane(state, paths + p, rows, drive, stop_fraction, refusal);
    }
    refusal->status = status;
    return status;
}

int hs_stiffness_matrix(const hs_state *state, const double direction[2], double stiffness[4]) {
    const hs_units *units = &state->line.contact->units;
    hs_vector direction_vector = {direction[0], direction[1]};
    double slopes[2][2];
    if (!state->plane) return HS_FOREIGN;
    hs_state *copy = hs_state_copy(state);
    int status = copy ? HS_OK : HS_OUT_OF_MEMORY;
    if (status == HS_OK && !copy->plane->body) status = switch_to_rings(copy);
    if (status == HS_OK) status = hs_body_stiffness(copy->plane->body, direction_vector, slopes);
    for (int i = 0; i < 4 && status == HS_OK; ++i)
        stiffness[i] = slopes[i / 2][i % 2] * units->stiffness;
    hs_state_free(copy);
    return status;
}

int64_t hs_nodes(const hs_state *state, int64_t asperity, int64_t room, double *nodes) {
    if (!state->plane) return 0;
    hs_state *copy = hs_state_copy(state);
    int64_t node_count = copy && (copy->plane->body || switch_to_rings(copy) == HS_OK) ? 0 : -1;
    for (int64_t c = 0; node_count == 0 && c < copy->plane->body->class_count; ++c) {
        const hs_ring_class *ring_class = copy->plane->body->classes + c;
        int64_t i = ring_class->offset, stop = ring_class->offset + ring_class->curve.count;
        while (i < stop && state->line.contact->order[i] != asperity) ++i;
        for (int64_t k = 0; i < stop && k < ring_class->node_count; node_count = ++k) {
            if (k >= room) continue;
            nodes[3 * k] = ring_class->nodes[k].label;
            nodes[3 * k + 1] = ring_class->nodes[k].deflection.x;
            nodes[3 * k + 2] = ring_class->nodes[k].deflection.y;
        }
    }
    hs_state_free(copy);
    return node_count;
}

double hs_plane_stored_energy(const hs_state *state) {
    double total = 0.0;
    if (!state->plane->body) return hs_line_stored_energy(&state->line);
    for (int64_t c = 0; c < state->plane->body->class_count; ++c)
        total += hs_class_elastic_energy(state->plane->body->classes + c);
    return total * state->line.contact->units.energy;
}

int hs_plane_set_friction(hs_state *state, const double *friction, const hs_drive *drive) {
    hs_line *line = &state->line;
    const hs_contact *contact = line->contact;
    if (!state->plane->body) {
        hs_drive line_drive = *drive;
        line_drive.compliance[0] = drive->compliance[line_axis(state)];
        int status = hs_line_set_friction(line, friction, &line_drive);
        update_from_line(state);
        return status;
    }
    for (int64_t group = 0; group < contact->groups; ++group)
        for (int64_t i = contact->first[group]; i < contact->first[group + 1]; ++i)
            if (friction[contact->order[i]] != friction[contact->order[contact->first[group]]])
                return HS_FOREIGN;
    const hs_plane *plane = state->plane;
    hs_path held = {0.0,
                    0.0,
                    {0.0, 0.0},
                    {0.0, 0.0},
                    1,
                    0,
                    line->normal_control,
                    {plane->tangential_control[0], plane->tangential_control[1]},
                    0,
                    NAN,
                    NAN};
    hs_plane_path path = start_path(state, &held, drive, 1);
    hs_set_normal_targets(line, &held, &path.plan);
    double *initial_friction = (double *)malloc((size_t)contact->groups * sizeof *initial_friction);
    if (!initial_friction) return HS_OUT_OF_MEMORY;
    memcpy(initial_friction, line->friction, (size_t)contact->groups * sizeof *initial_friction);
    path.plan.limit_drop = hs_friction_limit(line, line->approach, line->normal_load);
    int changes = plane->excess.x != 0.0 || plane->excess.y != 0.0, status = HS_OK;
    if (changes) {
        /* bring the load to the request before the limit falls */
        hs_plane_path constant = path;
        constant.plan.limit_drop = 0.0;
        status = integrate_path(state, &constant, drive, NULL);
    }
    for (int64_t group = 0; group < contact->groups && status == HS_OK; ++group) {
        line->friction[group] = hs_bound_friction(friction[contact->order[contact->first[group]]]);
        changes |= line->friction[group] < initial_friction[group];
    }
    path.plan.limit_drop -= hs_friction_limit(line, line->approach, line->normal_load);
    if (changes && status == HS_OK) {
        plane->body->initial_friction = initial_friction;
        status = integrate_path(state, &path, drive, NULL);
        plane->body->initial_friction = NULL;
    }
    free(initial_friction);
    return status;
}
