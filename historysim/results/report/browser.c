/* The contact in a browser page, compiled to WebAssembly with the memory's library: entry points
 * that exchange numbers and arrays, so that the script knows one struct only, `hs_path`, whose
 * layout is asserted here. */

#include "../../memory/historysim.h"
#include <math.h>
#include <stdlib.h>

#define EXPORT(name) __attribute__((export_name(#name))) name

_Static_assert(sizeof(hs_path) == 96 && offsetof(hs_path, tangential_target) == 16 &&
                   offsetof(hs_path, tangential_fraction) == 32 && offsetof(hs_path, parts) == 48 &&
                   offsetof(hs_path, first_row) == 56 && offsetof(hs_path, normal_control) == 64 &&
                   offsetof(hs_path, recorded) == 76 && offsetof(hs_path, begin) == 80,
               "browser.js reads and writes paths by these offsets");

void *EXPORT(allocate)(size_t bytes) { return malloc(bytes); }
void EXPORT(release)(void *bytes) { free(bytes); }
hs_state *EXPORT(copy_state)(const hs_state *state) { return hs_state_copy(state); }
void EXPORT(free_state)(hs_state *state) { hs_state_free(state); }

/* Make the state of a contact of summits; asperities with one number in `group` share one
 * coefficient. In two directions `height_classes` is above 0. NULL if out of memory. */
hs_state *EXPORT(new_state)(int32_t count, const double *height, const double *radius,
                            const double *friction, const int32_t *group, double contact_modulus,
                            double displacement_ratio, int32_t height_classes, int32_t rings,
                            double tolerance) {
    int64_t *groups = malloc((size_t)count * sizeof *groups);
    if (!groups) return NULL;
    for (int32_t i = 0; i < count; ++i) groups[i] = group[i];
    hs_contact *contact =
        hs_contact_new(count, height, radius, NULL, groups, contact_modulus, displacement_ratio);
    free(groups);
    hs_state *state = contact ? hs_state_new(contact, friction) : NULL;
    if (contact) hs_contact_free(contact);
    if (state && height_classes > 0 &&
        hs_state_enter_plane(state, height_classes, rings, tolerance) != HS_OK) {
        hs_state_free(state);
        state = NULL;
    }
    return state;
}

/* Integrate paths up to the fraction `until` of each, and write rows: the totals (row, 17), in two
 * directions the vectors (row, 2) of load and displacement, and both loads of one asperity, none if
 * it is negative. `drive` holds tolerance, the compliances in x and y, and whether a load is held
 * at the limit; request, limit and path of a refusal go to `refused`. */
int32_t EXPORT(integrate)(hs_state *state, const hs_path *paths, int32_t count, double until,
                          const double drive[4], double *totals, double *load, double *displacement,
                          int32_t asperity, double *normal_load, double *tangential_load,
                          double refused[3]) {
    const int64_t column = asperity;
    hs_rows rows = {
        .columns = asperity < 0 ? 0 : 1, .asperity = &column, .totals = (hs_totals *)totals};
    if (asperity >= 0) rows.normal_load = normal_load, rows.tangential_load = tangential_load;
    if (state->plane) rows.total_tangential_load = load, rows.total_displacement = displacement;
    const hs_drive driven = {drive[0], {drive[1], drive[2]}, drive[3] != 0.0, 1, NULL, NULL};
    hs_refusal refusal = {0};
    int status = hs_integrate(state, paths, count, &rows, &driven, until, NULL, &refusal);
    refused[0] = refusal.request, refused[1] = refusal.limit, refused[2] = (double)refusal.path;
    return status;
}

/* Read all asperities of a state in the caller's order: arrays (asperity), tangential loads
 * (asperity, 2) in two directions. */
int32_t EXPORT(read_asperities)(const hs_state *state, double *normal_load, double *tangential_load,
                                double *contact_radius, double *stick_radius, int8_t *slip_state) {
    int64_t count = state->line.contact->count, *each = malloc((size_t)count * sizeof *each);
    double load[2], displacement[2];
    hs_totals totals;
    if (!each) return HS_OUT_OF_MEMORY;
    for (int64_t i = 0; i < count; ++i) each[i] = i;
    hs_rows rows = {.columns = count,
                    .asperity = each,
                    .totals = &totals,
                    .normal_load = normal_load,
                    .tangential_load = tangential_load,
                    .contact_radius = contact_radius,
                    .stick_radius = stick_radius,
                    .slip_state = slip_state};
    if (state->plane) rows.total_tangential_load = load, rows.total_displacement = displacement;
    int status = hs_read(state, &rows, 0);
    free(each);
    return status;
}

/* Fill in the Hertz pressures whose sum is the traction of an asperity: radius [m] and weights in x
 * and y (n, 3), the edge first, at most `room` of them. Returns their number; -1 if out of memory.
 */
int32_t EXPORT(superposition)(const hs_state *state, int32_t asperity, int32_t room,
                              double *found) {
    hs_state *one = hs_state_of_one(state, asperity);
    if (!one) return -1;
    const hs_line *line = &one->line;
    const double gap = line->contact->gap[0],
                 scale = line->contact->weight[0] * line->contact->units.radius;
    int32_t count = 0;
    if (state->plane) {
        int64_t nodes = hs_nodes(state, asperity, 0, NULL);
        double *node = malloc((size_t)(nodes > 0 ? nodes : 1) * 3 * sizeof *node),
               before[2] = {0.0, 0.0};
        if (!node || nodes < 0 || hs_nodes(state, asperity, nodes, node) != nodes) count = -1;
        for (int64_t n = 0; count >= 0 && n + 1 < nodes && count < room; ++n, ++count) {
            const double *at = node + 3 * n, width = at[0] - at[3];
            found[3 * count] = scale * sqrt(fmax(at[0] - gap, 0.0));
            for (int axis = 0; axis < 2; ++axis) {
                double slope = (at[4 + axis] - at[1 + axis]) / width;
                found[3 * count + 1 + axis] = slope - before[axis];
                before[axis] = slope;
            }
        }
        free(node);
    } else {
        double before = 0.0;
        for (int64_t n = line->depth[0] - 1;
             n >= 0 && line->vertices[n].label > gap && count < room; --n, ++count) {
            found[3 * count] = scale * sqrt(line->vertices[n].label - gap);
            found[3 * count + 1] = line->vertices[n].slope - before;
            found[3 * count + 2] = 0.0;
            before = line->vertices[n].slope;
        }
    }
    hs_state_free(one);
    return count;
}
