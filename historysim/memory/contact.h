/* Contact: summits, their groups and their order; immutable when shared. */
#ifndef HISTORYSIM_CONTACT_H
#define HISTORYSIM_CONTACT_H

#include "clusters.h"

/* Sort positions by a key, stably; returns a status. */
int hs_sort_by(const double *key, int64_t *position, int64_t count);
/* Create a contact with given units, from gaps and weights of asperities or knots in the caller's
 * numbering; NULL if out of memory. */
hs_contact *hs_contact_of(int64_t count, int64_t groups, const double *gap, const double *weight,
                          const int64_t *group, int knots, const hs_units *units, double datum);
/* Add a reference. */
hs_contact *hs_contact_retain(hs_contact *contact);
/* Arrays of all asperities in the caller's numbering, the order of columns. */
typedef struct hs_columns {
    double *gap, *weight;
    int64_t *position, *group; /* position in the arrays of the contact, and group */
} hs_columns;
/* Columns of a contact, created on first use, thread-safe; NULL if out of memory. */
const hs_columns *hs_contact_columns(hs_contact *contact);
/* Recompute the data derived from gaps and weights after a change in place. */
void hs_contact_changed(hs_contact *contact);
/* Copy all arrays from a contact of equal numbers of asperities and groups. */
void hs_contact_assign(hs_contact *contact, const hs_contact *from);
hs_contact *hs_contact_copy(const hs_contact *contact);
/* True if two contacts are equal. */
int hs_contact_alike(const hs_contact *contact, const hs_contact *reference);

#endif
