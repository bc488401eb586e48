/* Readout: rows of totals and of columns (asperities) of a memory. */
#ifndef HISTORYSIM_READOUT_H
#define HISTORYSIM_READOUT_H

#include "contact.h"
#include "polyline.h"

static inline int8_t hs_slip_state_of(int touches, int slides, int sticks_inside) {
    int slip = sticks_inside ? HS_PARTIAL_SLIP : HS_GROSS_SLIP;
    slip = slides ? slip : HS_FULL_STICK;
    return (int8_t)(touches ? slip : HS_SEPARATED);
}

/* Sliding zone of a group: inner boundary of the slip annulus (label; the edge if that sticks),
 * label of the outermost spring that slides (-infinity if none does), and friction coefficient and
 * slope at the edge. */
typedef struct hs_zone {
    double boundary, outermost;
    double friction, slope;
} hs_zone;

/* Rows to write, and their buffers. */
typedef struct hs_recorder {
    const hs_rows *rows;
    hs_contact *contact; /* of the previous row; NULL if its gaps have changed */
    int all;             /* true if the columns are all asperities, in the caller's order */
    hs_columns columns;  /* gaps, weights, positions, groups in the contact of this row */
    hs_columns unscaled; /* of the contact that this one scales */
    double *chosen;      /* memory of both for a selection of asperities */
    double *inner; /* contributions of inner vertices to tangential loads: of the `summed` deepest
                      ones of a single group by column, else of all by position */
    double *friction; /* by column, of a contact that is scaled */
    double *energy;   /* dissipated by all asperities, by position; NULL if few are recorded */
    hs_vertex *stack; /* (depth) of the previous row */
    int64_t depth, summed, unchanged;
    hs_zone *zones; /* (group) of this row, allocated for as many as asperities; NULL if there are
                       no columns */
} hs_recorder;
/* Allocate the buffers for rows, which may be NULL; returns a status. */
int hs_recorder_init(hs_recorder *recorder, hs_contact *contact, const hs_rows *rows);
/* Write one row of a memory; returns a status. */
int hs_record(hs_recorder *recorder, const hs_line *memory, int64_t row, int saturated);
/* Forget the contact of the previous row. */
void hs_recorder_forget(hs_recorder *recorder);
void hs_recorder_clear(hs_recorder *recorder);

#endif
