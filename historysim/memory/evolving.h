/* Context of a path on which asperities evolve: its ends, its buffers, and the shapes and the
 * friction on one chord of it. */
#ifndef HISTORYSIM_EVOLVING_H
#define HISTORYSIM_EVOLVING_H

#include "limit.h"
#include "state.h"

/* first touches and onsets of yielding at which a path is cut, and sizes by which changes are
 * measured */
#define MOST_CUTS 15
#define SIZES 10

/* Where the channels are at the ends of one path, dimensionless. */
typedef struct route {
    int both_loads, normal_by_load, tangential_by_load; /* which channels are controlled by load */
    int ends_separated; /* whether a tangential load of 0 ends where nothing touches */
    double d[2], load[2], tangential[2];
    double apart[2]; /* then displacements are straight from the first to the second */
    /* of the present piece of a path on which the tangential load is not that requested:
     * displacements go straight from the first to the second between two shares of the path; the
     * request is met at the end alone, or the friction limit there */
    int straight, ends_at_limit;
    double piece[2], aim[2];
    double times[2]; /* [s] */
    hs_contact
        *first; /* contact at its start, where what a normal load is on the way follows from it */
} route;

/* Where the friction of a group is at a share of a chord. */
typedef struct station {
    double share;
    double amid; /* between the station before and this one */
    double friction;
} station;

/* Shapes of summits that wear on a chord, and what takes them there; arrays are by asperity, in the
 * caller's numbering. */
typedef struct worn_shapes {
    double *begun;              /* distances slid before any wear [m] */
    double *first, *last;       /* approaches at which an asperity begins and ends to slide [m] */
    double *mean_load, *energy; /* meanwhile [N], and what it dissipates [J] */
    double *lost, *taken;       /* volumes, and what of them shapes the summit [m³] */
    double *mid_height, *mid_radius; /* summits amid and at the end [m] */
    double *end_height, *end_radius;
} worn_shapes;

/* Which summits yield on a chord, and where. */
typedef struct yielding_chord {
    int now;         /* whether any does on this chord */
    int at_rest;     /* whether those of this path do where nothing is strained */
    double onset;    /* share of the path at which the first of them does */
    double next;     /* approach at which one does, NaN where it is not known */
    double *from;    /* approach at which the edge of a summit that yields starts the chord */
    double *steeper; /* R'/R of its radii, before and after */
    uint8_t *changed;
    int64_t *place; /* positions by ascending gap */
} yielding_chord;

/* A walk: what makes asperities evolve, and buffers, which are as many as asperities (in the
 * caller's numbering unless they say otherwise), or as groups. */
typedef struct walk {
    const hs_evolution *evolution;
    const hs_drive *drive;
    hs_refusal *refusal;
    hs_line *spare[2];    /* copies to walk on */
    hs_pieces *crossings; /* filled in with the pieces of a request between which it crosses the
                             friction limit, or NULL */
    int64_t work;         /* since the caller was asked whether to go on */
    int wears, yields;
    int parted; /* whether groups may have come to remember the same again */
    int alone;  /* whether asperities yield and nothing else of them is followed */
    double compliance;
    double substep_length; /* fraction of the path */
    double moved;          /* by the chord, as it was last found [m] */
    route course;
    worn_shapes shape;
    yielding_chord yield;
    double *goal[2];      /* friction at both ends of the path */
    double *slid, *ahead; /* distances on a chord, and as they were foreseen [m] */
    double *slides_from,
        *slides_to; /* shares of a chord between which asperities slide as a whole */
    double together, together_begun,
        together_ahead;      /* distance while all in contact slide [m]; before wear; as foreseen */
    double *gap;             /* at the start of a chord */
    double *before;          /* dissipated at the start of a chord */
    double *discarded;       /* dissipated on ways that are only tried */
    int64_t *depth;          /* of the stack of a group, at its first asperity */
    station *stations;       /* of all groups */
    int64_t most;            /* of them that there is room for */
    int64_t *first_station;  /* (group + 1) */
    double *asked[4];        /* loads, radii, distances, coefficients that a law is asked for */
    double *load, *friction; /* (group) at the end of a chord */
    double *edge;            /* (group) approach at which it starts the chord */
    uint8_t *steep;          /* (group) */
    int64_t cuts;            /* shares of the path at which chords end: what happens begins there */
    double cut[MOST_CUTS + HS_MAX_PIECES];
    double size[SIZES],
        whole[SIZES]; /* what changes are measured by, and what that is at least on this path */
    int64_t room, kept_room; /* vertices in `scratch` and `kept` */
    hs_vertex *scratch, *kept;
    void *memory;
} walk;

/* A straight way of one group: its ends, its coefficients at the start, amid and at the end, and
 * the side on which its springs slip. */
typedef struct way {
    hs_point from, to;
    double friction[3];
    double side;
    double share[2]; /* of the chord, at both ends */
} way;

/* The end of a chord. */
typedef struct chord_end {
    double d, load, v;
    double force;          /* tangential, where it is prescribed; otherwise NaN */
    double request, limit; /* tangential load that is requested, and the friction limit */
    double excess;         /* that is asked for beyond the friction limit */
    int64_t touching;
} chord_end;

/* Where the edge of a group starts a chord, and how much steeper a cone is than μ there. */
static inline double starts_at(const walk *w, const hs_line *memory, int64_t g) {
    return w->yield.now ? w->yield.from[memory->contact->order[memory->contact->first[g]]]
                        : memory->approach;
}
static inline double steeper(const walk *w, const hs_line *memory, int64_t g) {
    return w->yield.now ? w->yield.steeper[memory->contact->order[memory->contact->first[g]]] : 1.0;
}

#endif
