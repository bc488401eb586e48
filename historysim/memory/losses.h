/* Losses: the elastic energy of springs, and the energy that they dissipate on a path (README.md,
 * theory 10). */
#ifndef HISTORYSIM_LOSSES_H
#define HISTORYSIM_LOSSES_H

#include "group.h"

/* Gauss's quadrature on (0, 1) with two to four nodes. */
static const double hs_gauss_node[3][4] = {
    {0.2113248654051871, 0.7886751345948129},
    {0.1127016653792583, 0.5, 0.8872983346207417},
    {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262}};
static const double hs_gauss_weight[3][4] = {
    {0.5, 0.5},
    {0.2777777777777778, 0.4444444444444444, 0.2777777777777778},
    {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269}};

/* Coefficients of the polynomial through points of a ramp, at most. */
#define HS_RAMP_TERMS 3
/* Straight ramp of both loads beside its chord, the straight path in (d, V) between its ends. In
 * lengths (friction² Δd² + ΔV²)^½, over that of the chord, the ramp is at a distance w = x (1 - x)
 * Σ c x^k from a fraction x of the chord. */
typedef struct hs_ramp_curve {
    hs_point from, to;
    double friction;
    double c[HS_RAMP_TERMS];
} hs_ramp_curve;
/* Ramp beside its chord for the springs of one coefficient that slip on one side. */
typedef struct hs_bow {
    double friction, side;
    double length;     /* of the chord in g = side·V - μ d; 0 if the ramp does not increase in it */
    double from, rise; /* approach at the start of the chord, and its change */
    double g_rate, d_rate; /* of changes of g and d, over those of the chord: x + rate·w */
    double off;            /* difference of approach, ramp less chord, at equal g, over w */
    double c[HS_RAMP_TERMS];
} hs_bow;

/* Slip of the springs between two labels, and their mean deflection while they slip; both are
 * linear in the label; and the bow of the path, NULL if it is straight in (d, V). */
typedef struct hs_slip {
    double low, high;
    double slip_low, slip_high;
    double drag_low, drag_high;
    const hs_bow *bow;
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
    double total;               /* sum of the losses that are not in the queue */
    const hs_ramp_curve *curve; /* of the path, NULL if it is straight in (d, V) */
    hs_bow bow;                 /* of the group that was last asked for */
} hs_losses;
/* Bow of the path for one coefficient and side; NULL if it has none. */
HS_APART const hs_bow *hs_find_bow(hs_losses *losses, double friction, double side);
static inline const hs_bow *hs_bow_of(hs_losses *losses, double friction, double side) {
    return losses && losses->curve ? hs_find_bow(losses, friction, side) : NULL;
}

/* ∫ slip·drag·N'' da over labels, dimensionless, added to `asperity_energy` unless NULL, and of
 * clusters far from the labels to `far_energy` unless NULL; returns the sum. */
double hs_add_energy(hs_curve curve, double *asperity_energy, double *far_energy,
                     const hs_slip *slip);
void hs_init_losses(hs_losses *losses, int64_t groups, const hs_ramp_curve *curve);
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
