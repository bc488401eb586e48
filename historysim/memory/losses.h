/* Losses: the elastic energy of springs, and the energy that they dissipate on a path (README.md,
 * theory 10). */
#ifndef HISTORYSIM_LOSSES_H
#define HISTORYSIM_LOSSES_H

#include "group.h"

/* Slip of the springs between two labels, and their mean deflection while they slip; both are
 * linear in the label. */
typedef struct hs_slip {
    double low, high;
    double slip_low, slip_high;
    double drag_low, drag_high;
} hs_slip;

/* Energy dissipated on a path. Losses of groups of one asperity are queued and computed together,
 * as vectors: each is a chain of dependent roots and quotients. Size of the queue: chosen. */
#define HS_QUEUE_SIZE 128
typedef struct hs_losses {
    int queues; /* true if losses of groups of one asperity are queued */
    int number;
    int64_t position[HS_QUEUE_SIZE];
    double gap[HS_QUEUE_SIZE], weight[HS_QUEUE_SIZE];
    double low[HS_QUEUE_SIZE], high[HS_QUEUE_SIZE];
    double slip_low[HS_QUEUE_SIZE], slip_high[HS_QUEUE_SIZE];
    double drag_low[HS_QUEUE_SIZE], drag_high[HS_QUEUE_SIZE];
    double energy[HS_QUEUE_SIZE];
    double total; /* sum of the losses that are not in the queue */
} hs_losses;

/* ∫ slip·drag·N'' da over labels, dimensionless, added to `asperity_energy` unless NULL, and of
 * clusters far from the labels to `far_energy` unless NULL; returns the sum. */
double hs_add_energy(hs_curve curve, double *asperity_energy, double *far_energy,
                     const hs_slip *slip);
void hs_init_losses(hs_losses *losses, int64_t groups);
/* Compute the queued energies and add them to the energies of all asperities. */
void hs_flush_losses(hs_losses *losses, double *asperity_energy);
/* Queue the loss of a group of one asperity; `position` is its index in the arrays of the contact.
 */
static inline void hs_queue_loss(hs_losses *losses, double gap, double weight, int64_t position,
                                 double *asperity_energy, const hs_slip *slip) {
    if (!(slip->low < slip->high && slip->high > gap)) return;
    if (losses->number == HS_QUEUE_SIZE) hs_flush_losses(losses, asperity_energy);
    int p = losses->number++;
    losses->position[p] = position;
    losses->gap[p] = gap;
    losses->weight[p] = weight;
    losses->low[p] = slip->low;
    losses->high[p] = slip->high;
    losses->slip_low[p] = slip->slip_low;
    losses->slip_high[p] = slip->slip_high;
    losses->drag_low[p] = slip->drag_low;
    losses->drag_high[p] = slip->drag_high;
}
/* Add the loss of a group, distributed over its asperities, unless `losses` is NULL. */
void hs_add_loss(const hs_group *group, hs_losses *losses, const hs_slip *slip);
/* Add all losses to the dissipated energies of a memory, of each asperity and of all. */
void hs_commit_losses(hs_losses *losses, hs_line *memory);
/* Add the losses of springs that separate on a straight path, down to a segment of the polyline. */
void hs_add_separation_losses(const hs_group *group, hs_losses *losses, int64_t depth,
                              int64_t segment, const hs_point *from, const hs_point *to);
/* Elastic energy ½ ∫ v² N'' da of a memory, dimensionless, added by position to `asperity_energy`
 * unless NULL. */
double hs_elastic_energy(const hs_line *memory, double *asperity_energy);
/* Add factors times P of each asperity at labels. */
void hs_add_loads(const double *gap, const double *weight, int64_t count, int labels,
                  const double *label, const double *factor, double *part);

#endif
