/* The traction memory of rough frictional contacts: exact for any load history, without time steps.
 *
 * A contact is made of its summits (`hs_contact_new`), a state of a contact and its friction
 * (`hs_state_new`). A state is advanced along straight paths (`hs_step`, `hs_advance`,
 * `hs_integrate`), read (`hs_read`, `hs_slopes_of`, …), copied
 * (`hs_state_copy`), and written to bytes (`hs_state_write`). It holds the memory of motion along
 * one line, what evolving asperities have become, and the rings of a contact that moves in a plane;
 * each function chooses among them.
 *
 * README.md in this folder has the theory, and how a memory is laid out. Structs show numbers
 * without dimension: lengths over the largest summit radius R0, loads over (4/3) E* R0², tangential
 * displacements over θ R0, θ = E* / (4 G*). Functions take and give SI units, unless they say
 * otherwise. Nothing is global: different states may be used by different threads at the same time;
 * a state that is only read may be read by several.
 */
#ifndef HISTORYSIM_H
#define HISTORYSIM_H

#include <stddef.h>
#include <stdint.h>

#ifndef HS_API
#if defined(_WIN32)
#define HS_API __declspec(dllexport)
#elif defined(__GNUC__)
#define HS_API __attribute__((visibility("default")))
#else
#define HS_API
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Status of functions that may fail. */
enum hs_status {
    HS_OK = 0,
    HS_BEYOND_LIMIT =
        1, /* a tangential load asks for more than friction holds: nothing was changed */
    HS_OUT_OF_MEMORY = 2, /* the object that was to be changed is unusable */
    HS_LAW_FAILED = 3,  /* a law of the caller returned an error; the object that was to be changed
                           is unusable */
    HS_NOT_A_STATE = 4, /* bytes that are not a state of this version, or damaged ones */
    HS_FOREIGN = 5,     /* a state, asperities or coefficients of another contact, or a plane for
                           asperities that evolve */
    HS_INTERRUPTED =
        6 /* interrupted by the caller's function; the object that was to be changed is unusable */
};

/* Control of a channel. */
enum hs_control {
    HS_LOAD = 0,
    HS_DISPLACED = 1,
    HS_HELD = 2 /* of a tangential component of a path alone: as it was controlled last */
};

/* Slip state of an asperity. */
enum hs_slip_state { HS_SEPARATED = 0, HS_FULL_STICK = 1, HS_PARTIAL_SLIP = 2, HS_GROSS_SLIP = 3 };

/* Physical size of one dimensionless unit. */
typedef struct hs_units {
    double load;         /* [N] */
    double length;       /* of approaches, gaps and labels [m] */
    double displacement; /* tangential [m] */
    double energy;       /* [J] */
    double radius;       /* of circles [m] */
    double area;         /* [m²] */
    double stiffness;    /* tangential [N/m] */
} hs_units;

/* The largest coefficient of friction. The slip zone of a displacement U at an approach δ is U/(μδ)
 * of it wide; below some 1e-9 doubles do not resolve it. A larger coefficient is taken for this
 * one, with which a contact sticks as with any larger one. */
#define HS_MOST_FRICTION 1e4

/* ---- contact: summits and their groups, which share one history; constant ---- */

/* Asperities stand by their groups, and in a group by ascending gap; groups by ascending smallest
 * gap.
 *
 * A normal curve of any shape is a contact of one group, too: its asperities are knots, their gaps
 * the approaches of the knots, their weights the stiffness dP/da there, which goes straight in
 * between. The springs of a knot are those that first touch from its approach up to that of the
 * next one. */
typedef struct hs_contact {
    int64_t count;        /* asperities */
    int64_t groups;       /* of asperities that share one friction coefficient, and so one memory */
    const double *gap;    /* (count) below the highest summit at the start */
    const double *weight; /* (count) k = √(R/R0), so that an asperity carries k (a - gap)^(3/2) at
                             approach a */
    const double *load;   /* (count) P at the knots of a normal curve; NULL of asperities */
    const int64_t *order; /* (count) asperity at each position, in the caller's numbering */
    const int64_t *first; /* (groups + 1) position of the first asperity of each group */
    const double *sorted_gap;     /* (count) of all asperities by ascending gap */
    const double *sorted_weight;  /* (count) */
    struct hs_clusters *clusters; /* proxies of many asperities at a time, for their sums; NULL if
                                     no group has many */
    struct hs_clusters
        *sorted_clusters; /* all asperities by ascending gap; NULL of few, or of a normal curve */
    struct hs_columns *columns; /* the above by asperity, in the caller's numbering; NULL until a
                                   row is recorded */
    hs_units units;
    int64_t query_count; /* labels in `query_label`, or 0 */
    double *query_label; /* ascending labels that are queried for sliding in place of asperities */
    double datum;        /* height of the highest summit at the start, where gaps are 0 [m] */
    int64_t references;
} hs_contact;

/* Make a contact of summits with heights and radii [m]; NULL where there is no memory.
 *
 * `contact_modulus` is E* [Pa], `displacement_ratio` θ = E* / (4 G*). Asperities with the same
 * number in `group` (from 0, all numbers up to the largest) share one friction coefficient; NULL
 * stands for one group. Where `stiffness` is given, dP/da [N/m] in ascending order, the contact is
 * a normal curve: heights say how deep its knots lie, the first of them 0 below the highest, and
 * the largest radius is the unit of length; NULL stands for summits. */
HS_API hs_contact *hs_contact_new(int64_t count, const double *summit_height,
                                  const double *summit_radius, const double *stiffness,
                                  const int64_t *group, double contact_modulus,
                                  double displacement_ratio);
HS_API void hs_contact_free(hs_contact *contact);
/* Watch ascending approaches of first touch [m] in place of asperities: `hs_slide_times` then says
 * when all springs slide that have touched from there on. For a contact of one group, before there
 * is a memory of it. */
HS_API int hs_contact_watch(hs_contact *contact, int64_t count, const double *approach);

/* Approach of the highest summit [m] at which a contact carries a normal load [N]. */
HS_API double hs_approach_at(const hs_contact *contact, double normal_load);

/* ---- memory: approach, loads and history of a contact ---- */

/* A vertex of a group's polyline of anchors. */
typedef struct hs_vertex {
    double label;      /* approach a at which the spring first touched */
    double anchor;     /* w(a), where the spring is anchored */
    double slope;      /* dw/da towards the next deeper vertex */
    double made_at;    /* tangential displacement at which the vertex was made */
    double normal;     /* load P(a) of the group at the label */
    double tangential; /* tangential load of everything deeper */
} hs_vertex;

/* State of asperities that evolve, in addition to their tractions; arrays are in the caller's
 * numbering. */
typedef struct hs_evolved {
    double *summit_height;  /* present ones [m] */
    double *summit_radius;  /* [m] */
    double *slid_distance;  /* ∫|dU| while the asperity slid as a whole [m] */
    double *worn_volume;    /* lost since the start [m³] */
    double *waiting_volume; /* of it, the volume that has not yet shaped the summit [m³] */
    double *shaped_volume;  /* the volume that has, since the summit was a whole paraboloid [m³] */
    uint8_t *friction_overridden; /* whose friction an event has given, in place of the law */
    double slid_together;         /* ∫|dU| while all asperities in contact slid [m] */
    double erased_memories;       /* contacts whose memory a change of their geometry has erased */
    double erased_energy; /* tangential elastic energy erased with it, or with worn volumes [J] */
    /* of asperities that may yield; NULL where they do not */
    double *virgin_height; /* summits before they yielded [m] */
    double *virgin_radius; /* [m] */
    double *yielded_to;    /* largest approach of the virgin summit, beyond that at which it yields;
                              else 0 [m] */
    double *yielding_load; /* that it carried there, up to which it is elastic now; else 0 [N] */
    double *yielding_energy; /* that yielding has taken since the start [J] */
    double yielded_energy;   /* of all of them [J] */
} hs_evolved;

/* When the present straight path begins and ends [s], NaN where that is not known; and which loads
 * it ends at where both go straight, NaN where approach and displacement do. */
typedef struct hs_clock {
    double begin, end;
    double load, force;
} hs_clock;

/* The memory along one line: of motion in one direction, which is x, or in a plane up to the first
 * turn. */
typedef struct hs_line {
    hs_contact *contact;
    double *friction;        /* (group) present coefficients */
    double *dissipated_each; /* (count) energy that each asperity has dissipated, by its position;
                                of many asperities without what is in `far_energy` */
    double *far_energy;      /* (cluster, proxy) energy over weight at proxies of clusters, which is
                                interpolated where it is read; NULL without clusters */
    int64_t *depth;          /* (group) vertices of each stack, the deepest first */
    uint8_t *steep;          /* (group) true if the polyline has slopes beyond μ */
    hs_vertex *vertices;     /* (group, capacity) */
    int64_t capacity;
    hs_evolved *evolved;      /* NULL where asperities do not evolve */
    struct hs_slides *slides; /* when asperities first slid, which copies share; NULL where none has
                                 while times were known */
    struct hs_line *scaled;   /* several groups at a constant approach, as one of friction 1: it
                                 holds vertices, energies and slides, and `depth` is 0; NULL where
                                 groups hold their own (`hs_restore_groups`) */
    double approach;          /* of the highest summit; from here on, all is numbers */
    double displacement;      /* tangential */
    double normal_load;
    double tangential_load;
    double dissipated; /* by all asperities since the start */
    double excess;     /* excess of a held tangential load over the friction limit, with its sign */
    double slid_labels[2]; /* between which all asperities of a single group have */
    hs_clock clock;
    double
        known_label; /* where P' of a single group was worked out last; NaN where it is not known */
    double known_slope;     /* that P', which the next question about it need not work out again */
    uint64_t identity;      /* digest of contact and friction at the start; copies keep it */
    int32_t normal_control; /* last control of each channel, which is held */
    int32_t tangential_control;
    int32_t lost_slides; /* true if slide times were lost for want of memory */
    int32_t is_direct;   /* true while energies are added to each asperity */
} hs_line;

typedef struct hs_vector {
    double x, y;
} hs_vector;

/* Motion in two tangential directions. Along one line the memory of the line is exact; from the
 * first turn on rings hold the tractions (README.md, "Two directions"), the line follows the
 * approach, and none of its springs is strained. */
typedef struct hs_plane {
    int64_t height_classes, rings; /* see `hs_state_enter_plane` */
    double tolerance;
    hs_vector direction; /* of the line, a unit vector */
    hs_vector origin;    /* where the displacement of the line is 0 */
    hs_vector displacement, tangential_load;
    hs_vector excess;              /* excess of a held load over the friction limit */
    int32_t tangential_control[2]; /* last control of each component */
    struct hs_body *body;          /* the rings; NULL as long as all motion was along one line */
} hs_plane;

/* State of a contact: the only handle of this library. */
typedef struct hs_state {
    hs_line line;
    hs_plane *plane; /* NULL in one tangential direction */
} hs_state;

/* Make the state of a contact that nothing has happened to, with one coefficient for each asperity,
 * of which those of one group are the same. It moves in one direction. NULL if out of memory. */
HS_API hs_state *hs_state_new(hs_contact *contact, const double *friction);
/* Return an independent copy; NULL if out of memory. */
HS_API hs_state *hs_state_copy(const hs_state *state);
HS_API void hs_state_free(hs_state *state);
/* Digest of further bytes after another digest: properties such as laws are digested into the
 * `identity` of the line of a state. */
HS_API uint64_t hs_digest(uint64_t digest, const void *bytes, size_t size);
/* True if two states belong to the same contact, friction and laws, so that one may replace the
 * other. */
HS_API int hs_belongs(const hs_state *state, const hs_state *like);
/* Follow the evolution of asperities from now on. HS_FOREIGN in a plane. */
HS_API int hs_state_evolve(hs_state *state);
/* Follow yielding of asperities, too, from now on, which have not yielded yet. HS_FOREIGN in a
 * plane. */
HS_API int hs_state_yield(hs_state *state);
#define HS_MOST_RINGS 1000
/* Move in two directions from now on; so far all was along x. Asperities of a group share `rings`
 * rings in each of `height_classes` classes, which go by their gaps; both numbers are from 1 to
 * `HS_MOST_RINGS`. Steps are halved until loads over the friction limit, and energies, settle
 * within the `tolerance`, such as 1e-3. HS_FOREIGN if asperities evolve; without effect in a plane.
 */
HS_API int hs_state_enter_plane(hs_state *state, int64_t height_classes, int64_t rings,
                                double tolerance);
/* Write the vertices of all groups of a line where a scaled one holds them. */
HS_API int hs_restore_groups(hs_state *state);
/* State of one asperity, with the history of its group along the line; NULL if out of memory, or if
 * there is no such asperity. */
HS_API hs_state *hs_state_of_one(const hs_state *state, int64_t asperity);
/* Write times [s] at which asperities (in the caller's numbering), or watched approaches, first
 * slid as a whole; NaN if they have not, or if paths had no times. And forget them. */
HS_API void hs_slide_times(const hs_state *state, double *time);
HS_API void hs_forget_slides(hs_state *state);

/* ---- steps
 * ------------------------------------------------------------------------------------------------------------
 */

/* One straight path of all channels: the normal one, and the tangential ones in x and y. A channel
 * goes `fraction` of the way from where it is to its target, in N or m; with a fraction of 0 it is
 * held. Loads that are all controlled change in proportion; with a displacement, the approach and
 * what each tangential component is controlled by do. In one direction y is held; a path with a
 * fraction in y enters the plane, with 8 classes, 30 rings and a tolerance of 1e-3.
 *
 * `parts` equal parts are integrated, the inner ends recorded from `first_row` on; `recorded` says
 * whether the end is, too. It lasts from `begin` to `end`, so that it is known when asperities
 * first slide; NaN where nobody asks. */
typedef struct hs_path {
    double normal_target;
    double normal_fraction;
    double tangential_target[2];
    double tangential_fraction[2];
    int64_t parts;
    int64_t first_row;
    int32_t normal_control;
    int32_t tangential_control[2];
    int32_t recorded;
    double begin, end; /* [s] */
} hs_path;

/* Drive of a contact. */
typedef struct hs_drive {
    double tolerance; /* error of a ramp of both loads, over the displacement at which all springs
                         slide, such as 1e-6; relative error of energies: 10 times that */
    double compliance[2]; /* of an instrument in series with the contact, in x and y [m/N];
                             tangential displacements are its drive's */
    int32_t saturate; /* true if a tangential load beyond the friction limit is held at the limit */
    int32_t threads; /* that share the work on many asperities, 1 or more; the bits do not depend on
                        it */
    int (*interrupted)(void *user); /* called every few milliseconds; other than 0 stops the
                                       integration; may be NULL */
    void *user;
} hs_drive;

/* Why a path was not walked. */
typedef struct hs_refusal {
    int64_t status; /* hs_status */
    double request; /* tangential load that was asked for [N] */
    double limit;   /* friction limit there [N] */
    int64_t path;
} hs_refusal;

/* Advance a state along one straight path to targets in N or m; NaN holds a channel as it was
 * controlled last. In a plane the tangential target is that in x, and y is held. Of a path that is
 * refused nothing is changed. Nothing evolves on it (see `hs_integrate`). `refusal` may be NULL. */
HS_API int hs_step(hs_state *state, int normal_control, double normal_target,
                   int tangential_control, double tangential_target, const hs_drive *drive,
                   hs_refusal *refusal);
/* Where a channel goes: to a load [N] or a displacement [m], of which the other one is NaN; with
 * two NaN it is held as it was controlled last. */
typedef struct hs_goal {
    double load, displacement;
} hs_goal;
/* A state that is stepped in a tight loop. Goals and results are doubles in one block, so that a
 * program in another language converts each number once, and makes one call with one argument. */
typedef struct hs_stepper {
    hs_state *state;
    const hs_drive *drive;
    hs_refusal refusal;
    hs_goal normal;          /* which a step sets to NaN, as the next ones */
    hs_goal tangential[2];   /* in x and y; in one direction y is not read */
    double start;            /* approach at which the last path began, for `hs_slopes_of` [m] */
    double has_moved;        /* true if the displacement changed on it */
    double turns;            /* successive moves, each of which went back on the one before */
    hs_vector reached, move; /* displacement at its end, and its last change, without dimension */
} hs_stepper;
/* Advance its state in place, as `hs_step` does; in a plane to targets in x and y. */
HS_API int hs_stepper_step(hs_stepper *stepper);
/* Note the results of a path on which the state was moved by other means, from an approach without
 * dimension on. */
HS_API void hs_stepper_observe(hs_stepper *stepper, double start);
/* Return a new state that has advanced likewise; NULL where the path was refused. */
HS_API hs_state *hs_advance(const hs_state *state, int normal_control, double normal_target,
                            int tangential_control, double tangential_target, const hs_drive *drive,
                            hs_refusal *refusal);
/* Return a new state at the end of a path, of which nothing is recorded; NULL where it was refused.
 */
HS_API hs_state *hs_advance_along(const hs_state *state, const hs_path *path, const hs_drive *drive,
                                  hs_refusal *refusal);

/* ---- rows: readings of a state along its path, in SI units ---- */

/* Of the whole contact. In a plane the tangential load and displacement are the sizes of the
 * vectors. */
typedef struct hs_totals {
    double normal_load;          /* [N] */
    double tangential_load;      /* [N] */
    double approach;             /* of the highest summit [m] */
    double displacement;         /* tangential [m] */
    double contact_count;        /* asperities that touch */
    double real_contact_area;    /* [m²] */
    double tangential_stiffness; /* of the springs that stick [N/m] */
    double dissipated_energy;    /* since the start [J] */
    double friction_limit;       /* [N] */
    double saturated;       /* 1 where a load is held at the limit, or was since the row before */
    double friction;        /* present coefficient of the highest summit at the start */
    double traction_ratio;  /* largest |τ|/(μ p): 1, or more where friction has fallen after a
                               reversal */
    double slid_together;   /* ∫|dU| while all asperities in contact slid [m] */
    double erased_memories; /* see hs_evolved */
    double erased_energy;   /* [J] */
    double yielded_share;   /* normal load on asperities that have yielded */
    double yielding_energy; /* that yielding has taken since the start [J] */
} hs_totals;

/* Where rows are written. Of each asperity an array (row, column) that is NULL is not recorded. In
 * a plane, tangential loads of asperities are (row, column, 2), in x and y, and the vectors of the
 * whole contact are recorded, too. */
typedef struct hs_rows {
    int64_t columns;               /* recorded asperities */
    const int64_t *asperity;       /* (column) */
    hs_totals *totals;             /* (row) */
    double *normal_load;           /* [N] */
    double *tangential_load;       /* [N], (row, column, 2) in a plane */
    double *contact_radius;        /* [m] */
    double *stick_radius;          /* [m] */
    int8_t *slip_state;            /* hs_slip_state */
    double *dissipated_energy;     /* since the start [J] */
    double *friction;              /* present coefficient */
    double *slid_distance;         /* [m] */
    double *worn_volume;           /* [m³] */
    double *summit_height;         /* [m] */
    double *summit_radius;         /* [m] */
    double *yielded_depth;         /* by which the summit has been flattened [m] */
    double *yielding_load;         /* [N] */
    double *yielding_energy;       /* [J] */
    double *total_tangential_load; /* (row, 2), in a plane alone [N] */
    double *total_displacement;    /* (row, 2), in a plane alone [m] */
} hs_rows;

/* Record one row of a state as it is. */
HS_API int hs_read(const hs_state *state, const hs_rows *rows, int64_t row);

/* ---- stiffness, energy, tractions
 * ------------------------------------------------------------------------------------------ */

/* Derivatives of the loads at the end of the last path with respect to its end, with the same start
 * [N/m]. */
typedef struct hs_slopes {
    double tangential; /* ∂T/∂U at a held approach */
    double coupling;   /* ∂T/∂d at a held displacement */
    double normal;     /* ∂N/∂d */
} hs_slopes;
/* Of a straight path that began at an approach [m]. In a plane the tangential ones are NaN. */
HS_API hs_slopes hs_slopes_of(const hs_state *state, double start);
/* dT/dU at a fixed approach when the displacement goes on in a direction, 1 or -1; with 0 that of
 * the springs that stick now [N/m]. NaN in a plane. */
HS_API double hs_stiffness(const hs_state *state, int direction);
/* In a plane: dT/dU when the displacement goes on in a direction, of which (0, 0) stands for the
 * springs that stick now: xx, xy, yx, yy [N/m]. HS_FOREIGN in one direction. */
HS_API int hs_stiffness_matrix(const hs_state *state, const double direction[2],
                               double stiffness[4]);
/* dN/dd [N/m]. */
HS_API double hs_normal_stiffness(const hs_state *state);
/* Tangential elastic energy of all asperities [J]; NaN if out of memory. */
HS_API double hs_stored_energy(const hs_state *state);
HS_API int64_t hs_contact_count(const hs_state *state);
/* In a plane: nodes that hold the tractions of an asperity, in the caller's numbering, the edge
 * first: labels and deflections (n, 3), in numbers without dimension. Fills in at most `room` of
 * them, and returns how many there are; -1 if out of memory. */
HS_API int64_t hs_nodes(const hs_state *state, int64_t asperity, int64_t room, double *nodes);

/* ---- friction and summits that change at rest
 * --------------------------------------------------------------------------- */

/* Give each asperity (in the caller's numbering) another coefficient from now on, while a
 * controlled tangential load stays, or the displacement of an instrument's drive. Asperities that
 * are not alike in it no longer share what they remember; knots of a normal curve are alike. A load
 * that friction no longer holds is still asked for. From the first turn in a plane on, asperities
 * of one group have to stay alike: HS_FOREIGN. */
HS_API int hs_set_friction(hs_state *state, const double *friction, const hs_drive *drive);

/* ---- evolution: friction by load or slid distance, wear, other summits ---- */

/* Loads of asperities at one moment, for a law of friction. */
typedef struct hs_loaded {
    int64_t count;
    const double *normal_load;   /* (count) [N], > 0 */
    const double *summit_radius; /* (count) [m] */
    const double *slid_distance; /* (count) ∫|dU| while each slid [m] */
    double total_normal_load;    /* of all asperities together [N] */
} hs_loaded;
/* A law of the caller's: fills in coefficients (count); returns 0, or something else where it
 * failed. */
typedef int (*hs_law_function)(void *user, const hs_loaded *loaded, double *friction);

enum hs_law_kind {
    HS_NO_LAW = 0,    /* coefficients stay as they are */
    HS_POWER_LAW = 1, /* coefficient (N/reference_load)^exponent */
    HS_SHEAR_STRENGTH =
        2, /* shear_strength on the area of Hertz, or, with a work of adhesion, of JKR */
    HS_SLID_TABLE = 4, /* straight between the rows of a table over the distance slid */
    HS_CALLERS_LAW = 5
};
enum hs_dependence {
    HS_ON_NOTHING = 0,
    HS_ON_TOTAL_LOAD = 1,
    HS_ON_OWN_LOAD = 2,
    HS_ON_SLID_DISTANCE = 3
};
typedef struct hs_law {
    int32_t kind;
    int32_t depends_on;
    double coefficient;
    double reference_load; /* [N] */
    double exponent;
    double shear_strength;   /* [Pa] */
    double work_of_adhesion; /* [J/m²] */
    int64_t rows;
    const double *distance;     /* (row) [m] */
    const double *coefficients; /* (row) */
    hs_law_function function;
    void *user;
} hs_law;

/* A law of wear of the caller's: fills in the volumes that asperities lose [m³] (count) under mean
 * loads [N] while they slid [m] and dissipated [J]; returns 0, or something else where it failed.
 */
typedef int (*hs_wear_function)(void *user, int64_t count, const double *normal_load,
                                const double *slid_distance, const double *dissipated_energy,
                                double *volume);
enum hs_wear_kind {
    HS_NO_WEAR = 0,
    HS_ARCHARD = 1,     /* rate [1/Pa] times load times distance slid */
    HS_ENERGY_WEAR = 2, /* rate [m³/J] times energy dissipated */
    HS_CALLERS_WEAR = 3
};
/* Shape of a worn summit: a truncated cap of constant radius, or a paraboloid blunted in the
 * contact circle. */
enum hs_wear_shape { HS_TRUNCATED = 0, HS_BLUNTED = 1 };
typedef struct hs_wear {
    int32_t kind;
    int32_t shape;
    double rate;
    hs_wear_function function;
    void *user;
} hs_wear;

/* First loading beyond the onset of yield, of the caller's: fills in normal loads [N] and contact
 * radii [m] (count) of summits of a radius [m] at an approach [m]; returns 0, or something else
 * where it failed. */
typedef int (*hs_yielding_function)(void *user, int64_t count, const double *approach,
                                    const double *summit_radius, double *normal_load,
                                    double *contact_radius);
enum hs_yielding_kind {
    HS_NO_YIELDING = 0,
    HS_KOGUT_ETSION = 1,
    HS_THORNTON = 2,
    HS_JACKSON_GREEN = 3,
    HS_CALLERS_YIELDING = 4
};
typedef struct hs_yielding {
    int32_t kind;
    int32_t unused;
    double critical_strain; /* of the library's laws: approach at which a summit begins to yield,
                               over its radius */
    double hardness;        /* [Pa] */
    double yield_strain;    /* yield stress over E* */
    const double *critical_approach; /* (asperity) at which virgin summits begin to yield [m] */
    hs_yielding_function function;
    void *user;
} hs_yielding;

typedef struct hs_evolution {
    hs_law law;
    hs_wear wear;
    hs_yielding yielding;
    double contact_modulus; /* E* [Pa] */
    const double *goal;     /* coefficients (asperity) that the path goes to, straight with the
                               channels; NULL for none */
    double goal_fraction;   /* of the way there that the path goes */
    int32_t
        follow_sliding; /* true if slid distances of asperities that only yield are followed, too */
    int32_t unused;
    int64_t count; /* asperities that `goal` and `critical_approach` are of */
} hs_evolution;

/* Fill in the coefficients (count) that a law gives asperities. */
HS_API int hs_coefficients(const hs_law *law, double contact_modulus, const hs_loaded *loaded,
                           double *friction);
/* Fill in the volumes (count) that asperities lose by a law of wear [m³]. */
HS_API int hs_lost_volumes(const hs_wear *wear, int64_t count, const double *normal_load,
                           const double *slid_distance, const double *dissipated_energy,
                           double *volume);
/* Fill in normal loads [N] and contact radii [m] (count) of summits on first loading: Hertz's up to
 * the onset of yield. */
HS_API int hs_first_loading(const hs_yielding *yielding, double contact_modulus, int64_t count,
                            const double *approach, const double *summit_radius,
                            double *normal_load, double *contact_radius);

/* Give asperities other summits [m] (asperity) at the present approach and displacement. Those that
 * are `fresh` are new contacts: nothing is remembered. Then friction is what the law says.
 * HS_FOREIGN in a plane. */
HS_API int hs_set_summits(hs_state *state, const double *summit_height, const double *summit_radius,
                          const uint8_t *fresh, const hs_evolution *evolution);

/* ---- paths
 * ----------------------------------------------------------------------------------------------------------------
 */

/* Advance a state along paths, one after the other, and record rows on the way, unless `rows` is
 * NULL. Of each path the fraction `until` is integrated. Where asperities evolve, `evolution` says
 * by what; otherwise it is NULL. The state was made so
 * (`hs_state_evolve`, `hs_state_yield`), of as many asperities, and only a single path may have a
 * goal. Where a path is refused, the state is of no use any more. `refusal` may be NULL. */
HS_API int hs_integrate(hs_state *state, const hs_path *paths, int64_t count, const hs_rows *rows,
                        const hs_drive *drive, double until, const hs_evolution *evolution,
                        hs_refusal *refusal);

/* ---- bytes
 * ----------------------------------------------------------------------------------------------------------------
 */

/* A state with its contact as bytes, which any machine of the same byte order reads. */
HS_API size_t hs_state_size(const hs_state *state);
HS_API int hs_state_write(const hs_state *state, void *bytes, size_t size);
/* Read a state from bytes. Damaged or foreign bytes are refused, with the reason in `error`. Unless
 * `like` is NULL, the state has to belong to its contact, which is shared if it is equal. */
HS_API int hs_state_read(const void *bytes, size_t size, const hs_state *like, hs_state **state,
                         const char **error);
/* Check a memory along one line that the caller has filled in; returns NULL, or the error. */
HS_API const char *hs_state_check(const hs_state *state);

/* ---- patches of normal curves
 * ------------------------------------------------------------------------------------------- */

/* Table of normal curves: increases of each patch from row to row, carried by the knots in between.
 */
typedef struct hs_patches {
    int64_t count;      /* patches */
    int64_t rows;       /* of the table */
    const int64_t *row; /* (knot) row of the table up to which its springs touch */
    const double *gain; /* (patch, row) increase of its load from the previous row, over that of all
                           patches */
    const double *approach;    /* (rows + 1) [m], the first touch before the rows */
    const double *area;        /* (rows + 1, patch) [m²] */
    const double *first_touch; /* (patch) [m] */
} hs_patches;
/* Fill in rows of patches from rows of all knots, at approaches and with stick zones that first
 * touched there [m]. */
HS_API int hs_record_patches(const hs_patches *patches, const hs_rows *knots, int64_t count,
                             const double *approach, const double *stick, double friction,
                             const hs_rows *rows);

/* ---- batch: many contacts of one asperity, each with a path of its own
 * --------------------------------------------------- */

typedef struct hs_batch_vertex {
    double label;  /* [m] */
    double anchor; /* over θ [m] */
    double slope;  /* towards the next deeper one */
    double force;  /* tangential load of everything deeper, over (4/3) E* √R */
} hs_batch_vertex;
typedef struct hs_batch {
    int64_t count;
    int64_t frictions, scales; /* one for all, or one for each */
    double displacement_ratio; /* θ */
    int64_t *offset;           /* (contact) index of its first vertex */
    int64_t *depth, *room;     /* (contact) vertices that it has, and has room for */
    double *friction;
    double *scale; /* (4/3) E* √R [N/m^1.5] */
    hs_batch_vertex *vertices;
    int64_t used, capacity; /* vertices that are given away, and that there are */
} hs_batch;
/* Make contacts that do not touch; NULL where there is no memory. */
HS_API hs_batch *hs_batch_new(int64_t count, int64_t frictions, const double *friction,
                              int64_t scales, const double *scale, double displacement_ratio);
HS_API hs_batch *hs_batch_copy(const hs_batch *batch);
HS_API void hs_batch_free(hs_batch *batch);
/* True if all numbers, one per contact, are finite and within the limit of size. */
HS_API int hs_batch_accepts(const hs_batch *batch, const double *approach,
                            const double *displacement, double largest);
/* Carry each contact straight to its approach and displacement [m], and tell its loads [N]. */
HS_API int hs_batch_step(hs_batch *batch, const double *approach, const double *displacement,
                         double *normal_load, double *tangential_load);
/* Functions that take the number of a contact do nothing where there is none, and return -1,
 * HS_FOREIGN or NaN. */
/* Make a contact new. */
HS_API void hs_batch_forget(hs_batch *batch, int64_t contact);
/* Shorten the history of a contact to a number of vertices (at least 3), by leaving out those of
 * least effect. Returns the largest error of any later tangential load, for all displacements [N].
 */
HS_API double hs_batch_shorten(hs_batch *batch, int64_t contact, int64_t max_vertices);
/* Copy the vertices of a contact, with room for its depth, at least 1; returns the depth, 0 if it
 * does not touch. */
HS_API int64_t hs_batch_take(const hs_batch *batch, int64_t contact, hs_batch_vertex *vertices);
/* Set the vertices of a contact of the same friction and scale; invalid ones are refused. */
HS_API int hs_batch_put(hs_batch *batch, int64_t contact, const hs_batch_vertex *vertices,
                        int64_t depth);

#ifdef __cplusplus
}
#endif
#endif
