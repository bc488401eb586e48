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
/* Recompute clusters after gaps or weights have changed in place. */
static inline void hs_contact_refresh_clusters(hs_contact *contact) {
    hs_fill_clusters(contact->clusters);
    if (contact->sorted_clusters != contact->clusters) hs_fill_clusters(contact->sorted_clusters);
}
void hs_contact_assign(hs_contact *contact, const hs_contact *from);
hs_contact *hs_contact_copy(const hs_contact *contact);
int hs_contact_alike(const hs_contact *one, const hs_contact *other);

#endif
