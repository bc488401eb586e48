/* One contact as a unit of co-simulation, apart from the version of the standard by which it is
 * called (fmi2.c, fmi3.c).
 *
 * Inputs are where the next step goes: `hs_unit_step` carries the contact straight there, in one
 * exact update of the memory. Outputs are those of the end of the last step. All numbers are SI. */
#ifndef HS_UNIT_H
#define HS_UNIT_H

#include "historysim.h"
/* what is particular to the contact: controls, instrument, references of variables; written with
 * the unit */
#include "model.h"

/* at most: of the normal channel, and of each tangential direction; they have the references 0, 1,
 * … */
#define MOST_INPUTS 3

enum hs_mode { HS_INSTANTIATED, HS_INITIALIZING, HS_STEPPING, HS_TERMINATED };

/* All that a step changes. Behind the state everything has 8 bytes, and is saved as it is. */
typedef struct hs_moment {
    hs_state *state;
    double input[MOST_INPUTS]; /* where the channels go */
    double rate[MOST_INPUTS];  /* how fast the inputs change in the next step, per s */
    double factor;             /* on the friction coefficients of the start */
    double beginning;          /* approach at which the last step began [m] */
    double way[2];             /* where the contact went in it, in two directions */
    double time;               /* [s] */
    int64_t mode;              /* hs_mode */
} hs_moment;

typedef struct hs_unit {
    hs_moment now;
    hs_state *start;  /* never changed */
    int directions;   /* tangential ones */
    double *friction; /* (asperity) coefficients at the start, then room for as many */
    hs_drive drive;
    double *table; /* resources/curve.bin, NULL for independent asperities; see `hs_unit_new` */
    int64_t rows, patches;
    double *numbers;   /* what `slipping_share` reads rows into; NULL before it is asked for */
    char message[400]; /* why something was refused last */
} hs_unit;

/* Make a unit in its start state from the files in a folder of resources; NULL, with a message,
 * where they cannot be read. */
hs_unit *hs_unit_new(const char *resources, char *message, size_t size);
void hs_unit_free(hs_unit *unit);
/* Go back to the start. */
int hs_unit_reset(hs_unit *unit);

/* What functions below return: done, refused without any change, or of no use any more. */
enum hs_answer { HS_DONE = 0, HS_REFUSED = 1, HS_FAILED = 2 };

/* Go to the end of a step of a length [s]. */
int hs_unit_step(hs_unit *unit, double time, double length);
int hs_unit_set(hs_unit *unit, unsigned reference, double value);
int hs_unit_set_rate(hs_unit *unit, unsigned reference, double value);
enum hs_type { HS_REAL, HS_INTEGER, HS_BOOLEAN };
enum hs_type hs_unit_type(unsigned reference);
int hs_unit_get(hs_unit *unit, unsigned reference, double *value);
/* ∂(unknown)/∂(known) at the end of the last step, by the exact slopes. */
int hs_unit_derivative(hs_unit *unit, unsigned unknown, unsigned known, double *value);

/* Copies of moments: made in place of what `*saved` held, put back, and as bytes. */
int hs_unit_save(hs_unit *unit, hs_moment **saved);
int hs_unit_restore(hs_unit *unit, const hs_moment *saved);
void hs_moment_free(hs_moment *saved);
size_t hs_moment_size(const hs_moment *saved);
int hs_moment_write(hs_unit *unit, const hs_moment *saved, void *bytes, size_t size);
int hs_moment_read(hs_unit *unit, const void *bytes, size_t size, hs_moment **saved);

#endif
