/* Handle: the public functions of a state. Each chooses what holds the memory: the line, the evolution of its asperities, or the
 * plane (README.md, "Layout"). */

#include "plane.h"

hs_state *hs_state_new(hs_contact *contact, const double *friction) {
    hs_state *state = (hs_state *)calloc(1, sizeof *state);
    if (state && hs_memory_start(&state->line, contact, friction) == HS_OK) return state;
    free(state);
    return NULL;
}

int hs_belongs(const hs_state *state, const hs_state *like) { return hs_memory_belongs(&state->line, &like->line); }

int hs_state_evolve(hs_state *state) { return state->plane ? (int)HS_FOREIGN : hs_memory_evolve(&state->line); }

int hs_state_yield(hs_state *state) { return state->plane ? (int)HS_FOREIGN : hs_memory_yield(&state->line); }

hs_state *hs_state_of_one(const hs_state *state, int64_t asperity) {
    if (asperity < 0 || asperity >= state->line.contact->count) return NULL;
    hs_state *one = (hs_state *)calloc(1, sizeof *one);
    if (one && hs_memory_init_one(&one->line, &state->line, asperity) == HS_OK) return one;
    free(one);
    return NULL;
}

void hs_slide_times(const hs_state *state, double *time) { hs_memory_slide_times(&state->line, time); }

void hs_forget_slides(hs_state *state) { hs_memory_forget_slides(&state->line); }

/* ---- paths ---------------------------------------------------------------------------------------------------------------- */

int hs_integrate(hs_state *state, const hs_path *paths, int64_t count, const hs_rows *rows, const hs_drive *drive, double until,
                 const hs_evolution *evolution, hs_refusal *refusal) {
    int status = HS_OK;
    for (int64_t p = 0; p < count && !state->plane && status == HS_OK; ++p)
        if (paths[p].tangential_fraction[1] > 0.0) status = hs_state_enter_plane(state, 8, 30, 1e-3);
    if (status != HS_OK || (evolution && state->plane)) return status != HS_OK ? status : (int)HS_FOREIGN;
    if (state->plane) return hs_plane_integrate(state, paths, count, rows, drive, until, refusal);
    if (evolution) return hs_line_evolve(&state->line, paths, count, rows, drive, until, evolution, refusal);
    return hs_line_integrate(&state->line, paths, count, rows, drive, until, refusal);
}

hs_state *hs_advance_along(const hs_state *state, const hs_path *path, const hs_drive *drive, hs_refusal *refusal) {
    hs_path direct = *path;
    hs_state *after = hs_state_copy(state);
    int status = HS_OUT_OF_MEMORY;
    direct.parts = 1;
    if (after) status = hs_integrate(after, &direct, 1, NULL, drive, 1.0, NULL, refusal);
    if (refusal) refusal->status = status;
    if (status == HS_OK) return after;
    hs_state_free(after);
    return NULL;
}

/* Advance along x in a plane; NaN holds a channel. */
static hs_state *advance_along_x(const hs_state *state, int normal_control, double normal_target, int tangential_control,
                                 double tangential_target, const hs_drive *drive, hs_refusal *refusal) {
    int presses = !isnan(normal_target), moves = !isnan(tangential_target);
    hs_path path = {presses ? normal_target : 0.0, (double)presses, {moves ? tangential_target : 0.0, 0.0}, {(double)moves, 0.0},
                    1, 0, normal_control, {tangential_control, HS_HELD}, 0, NAN, NAN};
    return hs_advance_along(state, &path, drive, refusal);
}

hs_state *hs_advance(const hs_state *state, int normal_control, double normal_target, int tangential_control,
                     double tangential_target, const hs_drive *drive, hs_refusal *refusal) {
    if (state->plane)
        return advance_along_x(state, normal_control, normal_target, tangential_control, tangential_target, drive, refusal);
    hs_state *copy = hs_state_copy(state);
    if (refusal) refusal->status = HS_OUT_OF_MEMORY;
    if (copy && hs_line_step(&copy->line, normal_control, normal_target, tangential_control, tangential_target, drive, refusal) == HS_OK)
        return copy;
    hs_state_free(copy);
    return NULL;
}

int hs_step(hs_state *state, int normal_control, double normal_target, int tangential_control, double tangential_target,
            const hs_drive *drive, hs_refusal *refusal) {
    if (!state->plane)
        return hs_line_step(&state->line, normal_control, normal_target, tangential_control, tangential_target, drive, refusal);
    hs_refusal unread;
    if (!refusal) refusal = &unread;
    hs_state *after = advance_along_x(state, normal_control, normal_target, tangential_control, tangential_target, drive, refusal);
    if (!after) return (int)refusal->status;
    hs_state before = *state;
    *state = *after;
    *after = before;
    hs_state_free(after);
    return HS_OK;
}

/* ---- readout -------------------------------------------------------------------------------------------------------------- */

int hs_read(const hs_state *state, const hs_rows *rows, int64_t row) {
    return state->plane ? hs_plane_read(state, rows, row) : hs_line_read(&state->line, rows, row);
}

hs_slopes hs_slopes_of(const hs_state *state, double start) {
    hs_slopes slopes = hs_line_slopes(&state->line, start);
    if (state->plane) slopes.tangential = slopes.coupling = NAN;
    return slopes;
}

double hs_stiffness(const hs_state *state, int direction) {
    return state->plane ? NAN : hs_line_stiffness(&state->line, direction);
}

double hs_normal_stiffness(const hs_state *state) { return hs_line_normal_stiffness(&state->line); }

double hs_stored_energy(const hs_state *state) {
    return state->plane ? hs_plane_stored_energy(state) : hs_line_stored_energy(&state->line);
}

int64_t hs_contact_count(const hs_state *state) { return hs_memory_contact_count(&state->line); }

/* ---- friction and summits ------------------------------------------------------------------------------------------------- */

int hs_set_friction(hs_state *state, const double *friction, const hs_drive *drive) {
    return state->plane ? hs_plane_set_friction(state, friction, drive) : hs_line_set_friction(&state->line, friction, drive);
}

int hs_set_summits(hs_state *state, const double *summit_height, const double *summit_radius, const uint8_t *fresh,
                   const hs_evolution *evolution) {
    if (state->plane) return HS_FOREIGN;
    return hs_line_set_summits(&state->line, summit_height, summit_radius, fresh, evolution);
}
