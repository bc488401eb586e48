/* Fields: quantities that change on a step of a path: friction of each group, and shapes of summits
 * that wear or yield; with the plan of the path and the buffers of its integration. */
#ifndef HISTORYSIM_FIELDS_H
#define HISTORYSIM_FIELDS_H

#include "path.h"
#include "state.h"

/* Cuts of a path at first touches and onsets of yielding, at most; chosen. */
#define MAX_CUTS 15
/* Scales by which changes on a path are measured (`error_of_substeps`). */
#define SCALES 10

/* Friction of a group at a fraction of a step, and halfway from the previous station. */
typedef struct hs_station {
    double fraction;
    double mid_friction;
    double friction;
} hs_station;

/* Shapes of summits that wear on a step, and their causes; arrays by asperity, in the caller's
 * numbering. */
typedef struct hs_worn_shapes {
    double *unworn_slide;                              /* distances slid before any wear [m] */
    double *slide_begin_approach, *slide_end_approach; /* of an asperity while it slides [m] */
    double *mean_load, *energy;                        /* meanwhile [N], and dissipated [J] */
    double *lost_volume, *shaped_volume;               /* lost; and removed from the summit [m³] */
    double *mid_height, *mid_radius;                   /* of summits, mean on the step [m] */
    double *end_height, *end_radius;                   /* and at the end */
} hs_worn_shapes;

/* Yielding on a step. */
typedef struct hs_yielding_step {
    int is_active;      /* true if a summit yields on this step */
    int is_at_rest;     /* true if summits yield on this path where nothing is strained */
    double onset;       /* path fraction at which the first of them does; infinity if none does */
    double next_onset;  /* approach at which one does, NaN if unknown */
    double *start_edge; /* approach of the edge of a summit that yields at the start of the step */
    double *cone_ratio; /* ratio of its radii, end to start */
    uint8_t *has_yielded;
    int64_t *positions; /* by ascending gap */
} hs_yielding_step;

/* Fields of a path, and buffers by asperity (in the caller's numbering) or by group. */
typedef struct hs_fields {
    const hs_evolution *evolution;
    const hs_drive *drive;
    hs_refusal *refusal;
    double compliance; /* of the drive, dimensionless */
    hs_line *copies[2];
    hs_segments *crossings; /* receives crossings of the friction limit, or NULL */
    int64_t work;           /* since the caller's interrupt was queried */
    int has_wear, has_yielding;
    int has_split;   /* true if groups may have come to equal histories again */
    int only_yields; /* true if nothing but yielding is followed */
    hs_plan plan;
    hs_plan constant;   /* of the part of the path on which nothing evolves */
    double elastic_end; /* path fraction at which summits begin to yield, or 1 */
    int is_constant;    /* true if nothing evolves up to there */
    int has_target;     /* true if displacements are straight up to a load or a drive */
    hs_worn_shapes shape;
    hs_yielding_step yield;
    double step_length;              /* fraction of the path */
    double displacement_change;      /* on the step, in the last iteration [m] */
    double *goals[2];                /* friction at both ends of the path */
    double *slide, *predicted_slide; /* distances on a step [m] */
    double *slide_begin, *slide_end; /* fractions of a step between which asperities slide */
    double common_slide;             /* distance while all asperities in contact slide [m] */
    double unworn_common_slide, predicted_common_slide;
    double *start_gap;
    double *start_energy; /* dissipated */
    double *trial_energy; /* dissipated on trial steps */
    int64_t *start_depth; /* of the stack of a group, at its first asperity */
    hs_station *stations; /* of all groups */
    int64_t station_capacity;
    int64_t *group_stations; /* (group + 1) */
    double *query[4];        /* of a law: loads, radii, distances, and the coefficients returned */
    double *group_load, *end_friction; /* (group) at the end of a step */
    double *start_edge;                /* (group) approach at its start */
    uint8_t *saved_steep;              /* (group) */
    int64_t
        cut_count; /* path fractions at which substeps end, since friction or shapes bend there */
    double cut[MAX_CUTS + HS_MAX_SEGMENTS];
    double scale[SCALES], min_scale[SCALES];  /* of changes; and at least, on this path */
    int64_t scratch_capacity, stack_capacity; /* vertices in `scratch` and `saved_stack` */
    hs_vertex *scratch, *saved_stack;
    void *buffer;
} hs_fields;

/* End of a step. */
typedef struct hs_step_end {
    double d, load, v;
    double force;          /* tangential load if it is prescribed, else NaN */
    double request, limit; /* requested tangential load, and the friction limit */
    double excess;         /* of the request over the limit */
    int64_t touching;      /* groups in contact */
} hs_step_end;

/* Approach of the edge of a group at the start of a step, and the ratio of its cone to μ there. */
static inline double hs_start_edge(const hs_fields *ctx, const hs_line *memory, int64_t g) {
    return ctx->yield.is_active
               ? ctx->yield.start_edge[memory->contact->order[memory->contact->first[g]]]
               : memory->approach;
}
static inline double hs_cone_ratio(const hs_fields *ctx, const hs_line *memory, int64_t g) {
    return ctx->yield.is_active
               ? ctx->yield.cone_ratio[memory->contact->order[memory->contact->first[g]]]
               : 1.0;
}

/* Initialise fields and split the groups of a memory that evolve apart; returns a status.
 * `hs_fields_clear` frees buffers and copies. */
int hs_fields_init(hs_fields *ctx, hs_line *memory, const hs_evolution *evolution,
                   const hs_drive *drive, hs_refusal *refusal);
void hs_fields_clear(hs_fields *ctx);
/* Copy a memory; with an unshared contact if summits change. NULL if out of memory. */
hs_line *hs_copy_unshared(const hs_fields *ctx, const hs_line *memory);
/* Allocate `copies` of a memory, with the same groups. */
int hs_make_copies(hs_fields *ctx, const hs_line *memory);
/* Plan a path: targets, onset of yielding, goals of friction. */
int hs_set_fields(hs_fields *ctx, const hs_line *memory, const hs_path *path);
/* Cut a path where summits touch, separate or begin to yield (if `touches`), and near first touch
 * (if `graded`). */
int hs_cut_at_events(hs_fields *ctx, const hs_line *memory, int touches, int graded);
/* Set the stations of friction on a step to approach d with normal load `load`, which ends at a
 * path fraction; `predicted_slide` are distances slid on it, or NULL. By a law, asperities that do
 * not touch have no friction. */
int hs_set_friction_field(hs_fields *ctx, const hs_line *memory, double d, double load,
                          double fraction, const double *predicted_slide);
/* Set summits of an unshared contact, equal within groups; `depth` by asperity. */
void hs_set_summit_shapes(hs_line *memory, const double *height, const double *radius,
                          const int64_t *depth);
/* Remove the springs above worn summits. */
void hs_remove_worn_springs(hs_line *memory);
void hs_store_gaps(hs_fields *ctx, const hs_contact *contact);
void hs_store_depths(hs_fields *ctx, const hs_line *memory);
/* Set worn summits; returns the loss of elastic energy from `stored`. */
double hs_apply_wear(hs_fields *ctx, hs_line *memory, const double *height, const double *radius,
                     double stored);
/* Predict volumes lost on a step, and shapes of summits: mean and at its end. */
int hs_predict_wear(hs_fields *ctx, const hs_line *memory, const hs_step_end *step_end);
/* Approach and normal load at a fraction of a path on which summits yield; NaN for a load that
 * follows from the approach. */
int hs_yielding_end(const hs_fields *ctx, const hs_line *memory, double fraction, double *d,
                    double *load);
/* Set summits that yield on a step to approach d to their shapes at its end. */
int hs_apply_yielding(hs_fields *ctx, hs_line *memory, double d);

#endif
