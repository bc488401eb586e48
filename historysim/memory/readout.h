/* Readout: rows of a memory. */
#ifndef HISTORYSIM_READOUT_H
#define HISTORYSIM_READOUT_H

#include "contact.h"
#include "polyline.h"

static inline int8_t hs_slip_state_of(int touches, int slides, int sticks_inside) {
    int slip = sticks_inside ? HS_PARTIAL_SLIP : HS_GROSS_SLIP;
    slip = slides ? slip : HS_FULL_STICK;
    return (int8_t)(touches ? slip : HS_SEPARATED);
}

/* Which springs of a group slide: the label at which the slip annulus ends, which is the edge if that sticks, and that of the
 * outermost spring that slides, minus infinity if none does; and coefficient and slope at the edge. */
typedef struct hs_zone {
    double boundary, outermost;
    double friction, slope;
} hs_zone;

/* Rows to write, and the buffers for them. */
typedef struct hs_recorder {
    const hs_rows *rows;
    hs_contact *contact; /* of the previous row; NULL if its gaps have changed */
    int all;             /* whether the columns are all asperities, in their order */
    hs_columns columns;  /* those of this row's contact */
    double *chosen;      /* their memory if the columns are some asperities */
    double *inner;       /* contributions of inner vertices to tangential loads: by column for a single group, else by position */
    double *kept;        /* of the `summed` deepest of them, which stay from row to row of a single group */
    hs_vertex *stack;    /* (depth) of the previous row */
    int64_t depth, summed;
    hs_zone *zones;      /* (group) of this row, allocated for as many as asperities; NULL if there are no columns */
} hs_recorder;
int hs_begin_recording(hs_recorder *recorder, hs_contact *contact, const hs_rows *rows);
int hs_record(hs_recorder *recorder, const hs_line *memory, int64_t row, int saturated);
void hs_end_recording(hs_recorder *recorder);

#endif
