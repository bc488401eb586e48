/* Handle: the public functions of a state. Each dispatches to the line, to its evolution, or to the
 * plane (README.md, "Layout"). */

#include "plane.h"
#include "scaled.h"

hs_state *hs_state_new(hs_contact *contact, const double *friction) {
    hs_state *state = (hs_state *)calloc(1, sizeof *state);
    if (state && hs_line_start(&state->line, contact, friction) == HS_OK) return state;
    free(state);
    return NULL;
}

int hs_belongs(const hs_state *state, const hs_state *like) {
    return hs_line_belongs(&state->line, &like->line);
}

int hs_restore_groups(hs_state *state) { return hs_line_restore_groups(&state->line); }

int hs_state_evolve(hs_state *state) {
    int status = state->plane ? (int)HS_FOREIGN : hs_line_restore_groups(&state->line);
    return status == HS_OK ? hs_line_add_evolved(&state->line) : status;
}

int hs_state_yield(hs_state *state) {
    int status = state->plane ? (int)HS_FOREIGN : hs_line_restore_groups(&state->line);
    return status == HS_OK ? hs_line_add_yielded(&state->line) : status;
}

hs_state *hs_state_of_one(const hs_state *state, int64_t asperity) {
    if (asperity < 0 || asperity >= state->line.contact->count) return NULL;
    hs_state *single = (hs_state *)calloc(1, sizeof *single);
    hs_line *copy = state->line.scaled ? hs_line_copy(&state->line) : NULL;
    int status = copy ? hs_line_restore_groups(copy) : (int)HS_OK;
    if (single && status == HS_OK)
        status = hs_line_init_single(&single->line, copy ? copy : &state->line, asperity);
    hs_line_free(copy);
    if (single && status == HS_OK) return single;
    free(single);
    return NULL;
}

void hs_slide_times(const hs_state *state, double *time) {
    hs_line_slide_times(&state->line, time);
}

void hs_forget_slides(hs_state *state) { hs_line_forget_slides(&state->line); }

/* ---- paths
 * ----------------------------------------------------------------------------------------------------------------
 */

int hs_integrate(hs_state *state, const hs_path *paths, int64_t count, const hs_rows *rows,
                 const hs_drive *drive, double until, const hs_evolution *evolution,
                 hs_refusal *refusal) {
    int status = HS_OK;
    for (int64_t p = 0; p < count && !state->plane && status == HS_OK; ++p)
        if (paths[p].tangential_fraction[1] > 0.0)
            status = hs_state_enter_plane(state, 8, 30, 1e-3);
    if (status != HS_OK || (evolution && state->plane))
        return status != HS_OK ? status : (int)HS_FOREIGN;
    if (state->plane) return hs_plane_integrate(state, paths, count, rows, drive, until, refusal);
    return hs_line_integrate(&state->line, paths, count, rows, drive, until, evolution, refusal);
}

hs_state *hs_advance_along(const hs_state *state, const hs_path *path, const hs_drive *drive,
                           hs_refusal *refusal) {
    hs_path direct = *path;
    hs_state *result = hs_state_copy(state);
    int status = HS_OUT_OF_MEMORY;
    direct.parts = 1;
    if (result) status = hs_integrate(result, &direct, 1, NULL, drive, 1.0, NULL, refusal);
    if (refusal) refusal->status = status;
    if (status == HS_OK) return result;
    hs_state_free(result);
    return NULL;
}

/* Path in a plane; a channel is held if its target is NaN. */
static hs_path path_in_plane(const hs_state *state, int normal_control, double normal_target,
                             const int control[2], const double target[2]) {
    hs_path path = {
        0.0, 0.0, {0.0, 0.0}, {0.0, 0.0}, 1, 0, state->line.normal_control, {HS_HELD, HS_HELD},
        0,   NAN, NAN};
    if (!isnan(normal_target)) {
        path.normal_target = normal_target;
        path.normal_fraction = 1.0;
        path.normal_control = normal_control;
    }
    for (int k = 0; k < 2; ++k) {
        if (isnan(target[k])) continue;
        path.tangential_target[k] = target[k];
        path.tangential_fraction[k] = 1.0;
        path.tangential_control[k] = control[k];
    }
    return path;
}

static int step_in_plane(hs_state *state, int normal_control, double normal_target,
                         const int control[2], const double target[2], const hs_drive *drive,
                         hs_refusal *refusal) {
    hs_path path = path_in_plane(state, normal_control, normal_target, control, target);
    hs_refusal unread;
    int sticks;
    if (!refusal) refusal = &unread;
    refusal->status = hs_plane_stick(state, &path, drive, &sticks);
    if (sticks) return (int)refusal->status;
    hs_state *result = hs_advance_along(state, &path, drive, refusal);
    if (!result) return (int)refusal->status;
    hs_state previous = *state;
    *state = *result;
    *result = previous;
    hs_state_free(result);
    return HS_OK;
}

hs_state *hs_advance(const hs_state *state, int normal_control, double normal_target,
                     int tangential_control, double tangential_target, const hs_drive *drive,
                     hs_refusal *refusal) {
    const int control[] = {tangential_control, HS_HELD};
    const double target[] = {tangential_target, NAN};
    if (state->plane) {
        hs_path path = path_in_plane(state, normal_control, normal_target, control, target);
        return hs_advance_along(state, &path, drive, refusal);
    }
    hs_state *copy = hs_state_copy(state);
    if (refusal) refusal->status = HS_OUT_OF_MEMORY;
    if (copy && hs_line_step(&copy->line, normal_control, normal_target, tangential_control,
                             tangential_target, drive, refusal) == HS_OK)
        return copy;
    hs_state_free(copy);
    return NULL;
}

int hs_step(hs_state *state, int normal_control, double normal_target, int tangential_control,
            double tangential_target, const hs_drive *drive, hs_refusal *refusal) {
    const int control[] = {tangential_control, HS_HELD};
    const double target[] = {tangential_target, NAN};
    if (state->plane)
        return step_in_plane(state, normal_control, normal_target, control, target, drive, refusal);
    return hs_line_step(&state->line, normal_control, normal_target, tangential_control,
                        tangential_target, drive, refusal);
}

void hs_stepper_observe(hs_stepper *stepper, double start) {
    const hs_state *state = stepper->state;
    const hs_line *line = &state->line;
    int is_ramp = line->normal_control == HS_LOAD && line->tangential_control == HS_LOAD;
    /* a ramp of both loads begins at first contact */
    stepper->start = (is_ramp && start < 0.0 ? 0.0 : start) * line->contact->units.length;
    hs_vector reached = {line->displacement, 0.0};
    if (state->plane) reached = state->plane->displacement;
    hs_vector move = {reached.x - stepper->reached.x, reached.y - stepper->reached.y};
    stepper->has_moved = move.x != 0.0 || move.y != 0.0;
    if (stepper->has_moved == 0.0) return;
    stepper->turns =
        move.x * stepper->move.x + move.y * stepper->move.y < 0.0 ? stepper->turns + 1.0 : 0.0;
    stepper->reached = reached;
    stepper->move = move;
}

/* Convert a goal to the control of a channel, which is returned, and a target; resets the goal to
 * NaN. */
static int take_goal(hs_goal *goal, double *target) {
    int by_load = isnan(goal->displacement);
    *target = by_load ? goal->load : goal->displacement;
    goal->load = goal->displacement = NAN;
    return by_load ? HS_LOAD : HS_DISPLACED;
}

int hs_stepper_step(hs_stepper *stepper) {
    hs_state *state = stepper->state;
    double start = state->line.approach, pressed, target[2];
    const int normal = take_goal(&stepper->normal, &pressed);
    const int control[] = {take_goal(stepper->tangential, target),
                           take_goal(stepper->tangential + 1, target + 1)};
    int status;
    if (state->plane)
        status = step_in_plane(state, normal, pressed, control, target, stepper->drive,
                               &stepper->refusal);
    else
        status = hs_line_step(&state->line, normal, pressed, control[0], target[0], stepper->drive,
                              &stepper->refusal);
    if (status == HS_OK) hs_stepper_observe(stepper, start);
    return status;
}

/* ---- readout
 * --------------------------------------------------------------------------------------------------------------
 */

int hs_read(const hs_state *state, const hs_rows *rows, int64_t row) {
    return state->plane ? hs_plane_read(state, rows, row) : hs_line_read(&state->line, rows, row);
}

hs_slopes hs_slopes_of(const hs_state *state, double start) {
    hs_slopes slopes = hs_line_slopes(&state->line, start);
    if (state->plane) slopes.tangential = slopes.coupling = NAN;
    return slopes;
}

double hs_stored_energy(const hs_state *state) {
    return state->plane ? hs_plane_stored_energy(state) : hs_line_stored_energy(&state->line);
}

int64_t hs_contact_count(const hs_state *state) { return hs_line_contact_count(&state->line); }

/* ---- friction and summits
 * -------------------------------------------------------------------------------------------------
 */

int hs_set_friction(hs_state *state, const double *friction, const hs_drive *drive) {
    return state->plane ? hs_plane_set_friction(state, friction, drive)
                        : hs_line_set_friction(&state->line, friction, drive);
}

int hs_set_summits(hs_state *state, const double *summit_height, const double *summit_radius,
                   const uint8_t *fresh, const hs_evolution *evolution) {
    if (state->plane) return HS_FOREIGN;
    return hs_line_set_summits(&state->line, summit_height, summit_radius, fresh, evolution);
}
