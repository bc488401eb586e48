/* Contact: its summits, their groups and their order; it is never changed once it is shared. */
#ifndef HISTORYSIM_CONTACT_H
#define HISTORYSIM_CONTACT_H

#include "clusters.h"

/* Sort positions by a key; equal keys keep their order. */
int hs_sort_by(const double *key, int64_t *place, int64_t count);
/* Make a contact with given units; gaps and weights are in the caller's numbering, of asperities or of knots. */
hs_contact *hs_contact_of(int64_t count, int64_t groups, const double *gap, const double *weight, const int64_t *group,
                          int knots, const hs_units *units, double datum);
/* Count one more reference. */
hs_contact *hs_contact_retain(hs_contact *contact);
/* All asperities in the order of columns, which is the caller's numbering. */
typedef struct hs_columns {
    double *gap, *weight;
    int64_t *place, *group; /* position, and group there */
} hs_columns;
/* Return them, made when they are first needed; NULL if out of memory. */
const hs_columns *hs_contact_columns(hs_contact *contact);
/* Have what is derived from gaps and weights follow their change in place. */
void hs_contact_changed(hs_contact *contact);
void hs_contact_assign(hs_contact *contact, const hs_contact *from);
hs_contact *hs_contact_copy(const hs_contact *contact);
int hs_contact_alike(const hs_contact *one, const hs_contact *other);

#endif
