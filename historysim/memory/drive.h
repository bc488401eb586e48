/* Drive: interruption of long computations by the caller. */
#ifndef HISTORYSIM_DRIVE_H
#define HISTORYSIM_DRIVE_H

#include "historysim.h"

/* Count work, in units of about a microsecond, and query the caller's interrupt every few
 * milliseconds. */
static inline int hs_count_work(const hs_drive *drive, int64_t *work, int64_t more) {
    *work += more;
    if (*work < 4096 || !drive->interrupted) return HS_OK;
    *work = 0;
    return drive->interrupted(drive->user) ? HS_INTERRUPTED : HS_OK;
}

#endif
