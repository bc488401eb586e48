/* Group: the asperities of one friction coefficient, which share one polyline w(a) (README.md,
 * theory 6), and the ends and targets of its straight paths in approach and displacement. */
#ifndef HISTORYSIM_GROUP_H
#define HISTORYSIM_GROUP_H

#include "normal.h"

typedef struct hs_group {
    hs_curve curve;
    double *asperity_energy; /* energy dissipated by each asperity of the group */
    double *far_energy;      /* at proxies of clusters; NULL if all is added to each asperity */
    hs_vertex *stack;
    double friction;
    int64_t start; /* position of its first asperity in the arrays of the contact */
    hs_line *memory;
    hs_line *single; /* the memory, which caches P', if it has a single group; otherwise NULL */
} hs_group;

static inline hs_group hs_group_of(const hs_line *memory, int64_t index) {
    const hs_contact *contact = memory->contact;
    int64_t start = contact->first[index];
    return HS_MADE(hs_group){hs_curve_of(contact, start, contact->first[index + 1] - start),
                             memory->dissipated_each + start,
                             memory->is_direct || memory->evolved ? NULL : memory->far_energy,
                             memory->vertices + index * memory->capacity,
                             memory->friction[index],
                             start,
                             (hs_line *)memory,
                             contact->groups == 1 ? (hs_line *)memory : NULL};
}

/* Approach d and tangential displacement v, dimensionless. */
typedef struct hs_point {
    double d;
    double v;
} hs_point;
/* Target of the tangential channel: rigid·V + compliance·T = value, with (rigid, compliance) = (1,
 * 0) for a displacement, (0, 1) for a load, and (1, c) for the displacement of a drive behind a
 * spring of compliance c. */
typedef struct hs_target {
    double value;
    double rigid;
    double compliance;
} hs_target;

static inline hs_target hs_to_displacement(double value) {
    return HS_MADE(hs_target){value, 1.0, 0.0};
}
static inline hs_target hs_to_load(double value) { return HS_MADE(hs_target){value, 0.0, 1.0}; }

#endif
