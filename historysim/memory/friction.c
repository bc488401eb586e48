/* Friction: a change of the coefficients of a stationary contact, from the old values and the new
 * ones (README.md, theory 2 and 7).
 *
 * Where a coefficient falls, springs beyond the new limit slip. Under a tangential load, or behind
 * an instrument, the displacement follows while it falls, so that a jump is what many small falls
 * are: the coefficients go straight from the old values to the new ones. Where friction no longer
 * holds the load, everything slides and the displacement stays. */

#include "line.h"
#include "adaptive.h"
#include "move.h"

/* Change the coefficients, and the displacement to where it aims, straight together. */
static int fall(hs_line *memory, const double *friction, hs_target target) {
    int64_t groups = memory->contact->groups, touching = 0,
            room = hs_room_to_clip(hs_max_depth(memory));
    double d = memory->approach, v0 = memory->displacement, v1 = target.value;
    hs_point from = {d, v0};
    hs_tick(memory, memory->clock.end);
    hs_vertex *scratch = (hs_vertex *)malloc(2 * (size_t)room * sizeof *scratch);
    double *before = (double *)malloc(2 * (size_t)groups * sizeof *before);
    int status = scratch && before ? hs_line_reserve(memory, room) : HS_OUT_OF_MEMORY;
    if (status == HS_OK) {
        /* the very loads that the edges have */
        hs_group_loads loads;
        loads.load = before + groups;
        loads.from = NULL;
        while (touching < groups && memory->depth[touching] > 0) ++touching;
        loads.count = touching;
        for (int64_t index = 0; index < touching; ++index)
            loads.load[index] =
                memory->vertices[index * memory->capacity + memory->depth[index] - 1].normal;
        memcpy(before, memory->friction, (size_t)groups * sizeof *before);
        memcpy(memory->friction, friction, (size_t)groups * sizeof *before);
        if (target.compliance > 0.0) {
            hs_fronts fronts;
            /* any cone may cut any polyline */
            memset(memory->steep, 1, (size_t)groups);
            status = hs_init_fronts(&fronts, touching);
            if (status == HS_OK) {
                status = hs_search_displacement(memory, &loads, &fronts, d, target, &v1);
                hs_free_fronts(&fronts);
            }
        }
        hs_point to = {d, v1};
        hs_losses losses;
        hs_init_losses(&losses, groups);
        for (int64_t index = 0; index < touching && status == HS_OK; ++index) {
            if (v1 == v0 && friction[index] >= before[index]) continue;
            hs_group group = hs_group_of(memory, index);
            status = hs_move_group(memory, &group, &losses, index, before[index], from, to,
                                   loads.load[index], hs_to_displacement(v1), scratch, &v1);
        }
        hs_commit_losses(&losses, memory);
        memory->displacement = v1;
        memory->tangential_load = hs_total_force(memory);
    }
    free(scratch);
    free(before);
    return status;
}

static void mix(const double *first, const double *last, double share, double *target,
                int64_t count) {
    for (int64_t i = 0; i < count; ++i) target[i] = first[i] + share * (last[i] - first[i]);
}

/* A fall of the coefficients that the displacement follows. */
typedef struct friction_fall {
    hs_line *memory, *fine; /* at the start, and at the end by the last number of parts */
    const double *first, *last;
    double *between; /* (group) scratch */
    hs_target target;
    double stored;        /* elastic energy at the start */
    double reach;         /* displacement at which all springs slide */
    double reached;       /* displacement at the end by the number of parts before */
    double lost, balance; /* energy dissipated by the springs, and by the balance of work and stored
                             energy */
} friction_fall;

static const hs_adaptive fall_settings = {
    0.0,               /* the tolerance is set from the drive's */
    1.0,               /* accepted at once: the balance of energy is a second estimate */
    4,        1 << 10, /* bounds the time of a fall */
    HUGE_VAL,          /* never shortened: the coefficients change in equal parts */
    1.0,      0.0,     0.0, 1.0, 1.0, INT_MAX, 1.0, 1.0,
};
/* tolerated difference of both energies, over the energy: the balance is exact, and the parts only
 * say how asperities share it */
#define ENERGY_OF_PARTS 1e-3

/* Change the coefficients in equal parts. */
static int integrate_fall(hs_integrand *integrand, const hs_interval *step, int parts,
                          double *error) {
    friction_fall *f = (friction_fall *)integrand->context;
    const hs_line *memory = f->memory;
    const double tolerance = integrand->settings->tolerance;
    (void)step;
    hs_line_free(f->fine);
    f->fine = hs_line_copy(memory);
    int status = f->fine ? HS_OK : HS_OUT_OF_MEMORY;
    for (int k = 1; k <= parts && status == HS_OK; ++k) {
        mix(f->first, f->last, (double)k / parts, f->between, memory->contact->groups);
        status = fall(f->fine, f->between, f->target);
    }
    if (status != HS_OK) return status;
    double work = 0.5 * (memory->tangential_load + hs_total_force(f->fine)) *
                  (f->fine->displacement - memory->displacement);
    f->balance = work + f->stored - hs_elastic_energy(f->fine, NULL);
    f->lost = f->fine->dissipated - memory->dissipated;
    *error = hs_max(hs_error(f->fine->displacement - f->reached, 0.0, tolerance * f->reach),
                    hs_error(f->lost - f->balance, 0.0,
                             ENERGY_OF_PARTS * f->lost + tolerance * tolerance * f->stored));
    f->reached = f->fine->displacement;
    return HS_OK;
}

/* Scale the energies of the asperities to the balance. */
static int accept_fall(hs_integrand *integrand, const hs_interval *step) {
    friction_fall *f = (friction_fall *)integrand->context;
    hs_line *memory = f->memory, *fine = f->fine;
    double factor = f->lost > 0.0 ? hs_max(f->balance, 0.0) / f->lost : 1.0;
    (void)step;
    for (int64_t i = 0; i < memory->contact->count; ++i)
        fine->dissipated_each[i] = memory->dissipated_each[i] +
                                   factor * (fine->dissipated_each[i] - memory->dissipated_each[i]);
    fine->dissipated = memory->dissipated + factor * f->lost;
    hs_line_take(memory, fine);
    f->fine = NULL;
    return HS_OK;
}

/* Change the coefficients in so many equal parts that more of them make no difference.
 *
 * The energy that is dissipated is the work of the tangential load, less what is stored, which is
 * exact; the parts tell how the asperities share it. */
static int fall_in_parts(hs_line *memory, const double *friction, hs_target target,
                         double tolerance) {
    int64_t groups = memory->contact->groups;
    double reach = hs_friction_range(memory, HUGE_VAL).max *
                   (memory->approach - memory->contact->sorted_gap[0]);
    double *first = (double *)malloc(2 * (size_t)groups * sizeof *first);
    if (!first) return HS_OUT_OF_MEMORY;
    memcpy(first, memory->friction, (size_t)groups * sizeof *first);
    friction_fall f = {
        memory, NULL,     first, friction, first + groups, target, hs_elastic_energy(memory, NULL),
        reach,  HUGE_VAL, 0.0,   0.0};
    hs_adaptive settings = fall_settings;
    settings.tolerance = tolerance;
    hs_integrand integrand = {&f, &settings, integrate_fall, accept_fall, NULL, 0, 0.0};
    int status = hs_adapt(&integrand, 0.0, 1.0);
    hs_line_free(f.fine);
    free(first);
    return status;
}

/* Replace the groups' coefficients while the tangential channel holds what it aims at. A load
 * beyond the new limit stays with the memory as what is asked for. */
static int change(hs_line *memory, const double *friction, hs_target target, double tolerance) {
    size_t groups = (size_t)memory->contact->groups;
    double held = 1.0, force = memory->tangential_load;
    int falls = 0, status = HS_OK;
    for (size_t index = 0; index < groups; ++index)
        falls |= memory->depth[index] > 0 && friction[index] < memory->friction[index];
    if (!falls) {
        memcpy(memory->friction, friction, groups * sizeof *friction);
        hs_flag_steep(memory);
        return HS_OK;
    }
    double *there = (double *)malloc(2 * groups * sizeof *there), *first = there + groups;
    if (!there) return HS_OUT_OF_MEMORY;
    memcpy(first, memory->friction, groups * sizeof *first);
    double before = hs_friction_limit(memory, memory->approach, memory->normal_load);
    memcpy(memory->friction, friction, groups * sizeof *first);
    double after = hs_friction_limit(memory, memory->approach, memory->normal_load);
    hs_flag_steep(memory);
    memcpy(memory->friction, first, groups * sizeof *first);
    if (target.rigid == 0.0 && fabs(force) > after)
        held = hs_min(hs_max((before - fabs(force)) / (before - after), 0.0), 1.0);
    if (target.compliance > 0.0 && held > 0.0) {
        mix(first, friction, held, there, (int64_t)groups);
        status = fall_in_parts(memory, there, target, tolerance);
    }
    if (status == HS_OK && (target.compliance == 0.0 || held < 1.0))
        status = fall(memory, friction, hs_to_displacement(memory->displacement));
    if (status == HS_OK) {
        memcpy(memory->friction, friction, groups * sizeof *friction);
        hs_flag_steep(memory);
        memory->tangential_load = target.rigid == 0.0 ? force : hs_total_force(memory);
    }
    free(there);
    return status;
}

int hs_line_set_friction(hs_line *memory, const double *friction, const hs_drive *drive) {
    const hs_contact *contact = memory->contact;
    double compliance = drive->compliance[0] * contact->units.stiffness;
    hs_target target = hs_to_load(memory->tangential_load);
    int status = hs_split_groups(memory, friction, friction);
    if (status != HS_OK) return status;
    contact = memory->contact;
    if (memory->tangential_control != HS_LOAD) {
        target.value = memory->displacement + compliance * memory->tangential_load;
        target.rigid = 1.0;
        target.compliance = compliance;
    }
    double *leading = (double *)malloc((size_t)contact->groups * sizeof *leading);
    if (!leading) return HS_OUT_OF_MEMORY;
    for (int64_t index = 0; index < contact->groups; ++index)
        leading[index] = hs_bound_friction(friction[contact->order[contact->first[index]]]);
    status = change(memory, leading, target, drive->tolerance);
    free(leading);
    return status;
}
