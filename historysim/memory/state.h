/* State: lifetime and regrouping of a traction memory, its clock and its sliding times (memory.c;
 * <memory.h> is a system header). */
#ifndef HISTORYSIM_STATE_H
#define HISTORYSIM_STATE_H

#include "group.h"

/* Kind of evolution: 0 none, 1 without yielding, 2 with yielding; and the number of arrays of
 * `hs_evolved` it needs. */
static inline int hs_evolves(const hs_line *memory) {
    return !memory->evolved ? 0 : memory->evolved->virgin_height ? 2 : 1;
}
static inline size_t hs_evolved_arrays(int yields) { return yields ? 11 : 6; }
/* Set the total energy of yielding to the sum over asperities. */
void hs_sum_yielded(hs_evolved *evolved, int64_t count);
/* Allocate the arrays of a zeroed memory, without filling them; returns a status. */
int hs_line_init(hs_line *memory, hs_contact *contact, int64_t capacity, int evolves);
/* Allocate a memory with arrays that are not filled; NULL if out of memory. */
hs_line *hs_line_blank(hs_contact *contact, int64_t capacity, int evolves);
/* Initialise a zeroed memory of a contact without load history. */
int hs_line_start(hs_line *memory, hs_contact *contact, const double *friction);
/* Initialise a zeroed memory as a copy. */
int hs_line_init_copy(hs_line *memory, const hs_line *from);
hs_line *hs_line_copy(const hs_line *memory);
/* Free the arrays of a memory. */
void hs_line_clear(hs_line *memory);
void hs_line_free(hs_line *memory);
int hs_line_add_evolved(hs_line *memory);
int hs_line_add_yielded(hs_line *memory);
/* True if two memories belong to the same contact, friction and laws. */
int hs_line_belongs(const hs_line *memory, const hs_line *like);
/* Initialise a zeroed memory of one existing asperity, with the history of its group. */
int hs_line_init_single(hs_line *memory, const hs_line *from, int64_t asperity);
/* Ensure that each stack can hold `capacity` vertices. */
int hs_line_reserve(hs_line *memory, int64_t capacity);
/* Copy all contents from a memory of the same contact and groups. */
int hs_line_assign(hs_line *memory, const hs_line *from);
void hs_line_swap(hs_line *memory, hs_line *counterpart);
/* Move the contents of another memory into a memory; frees the other one. */
void hs_line_take(hs_line *memory, hs_line *replacement);
/* Replace the contact by an unshared copy, which may be changed in place. */
int hs_line_unshare_contact(hs_line *memory);
/* True if a memory has the arrays for a kind of evolution, in the number of its asperities. */
int hs_can_evolve(const hs_line *memory, const hs_evolution *evolution);
/* Recompute the loads stored with the vertices. */
void hs_refresh_loads(hs_line *memory);
/* Erase the history of a group: its springs in contact are unstrained. */
void hs_touch_unstrained(hs_line *memory, int64_t index);
/* Split groups whose asperities differ in a pair of keys, given by asperity. */
int hs_split_groups(hs_line *memory, const double *primary_key, const double *secondary_key);
/* Replace gaps and weights at the present approach and displacement, in the caller's numbering;
 * loads follow. Springs that remain in contact keep their anchors, except on `fresh` asperities,
 * which lose their history. */
int hs_reshape(hs_line *memory, const double *gap, const double *weight, const uint8_t *fresh);
/* True if no spring is strained. */
int hs_unstrained(const hs_line *memory);
/* True if all springs of all groups slide in the same direction. */
int hs_slides_alike(const hs_line *memory);
/* Join groups of equal coefficient of which all springs slide, or all are unstrained. Sets gaps and
 * weights, in the caller's numbering, at an approach. */
int hs_join_groups(hs_line *memory, const double *gap, const double *weight, double approach,
                   int unstrained);
/* Line with the present tractions: the scaled one where there is one (scaled.h). */
static inline hs_line *hs_active(const hs_line *memory) {
    return memory->scaled ? memory->scaled : (hs_line *)memory;
}
/* Number of asperities in contact. */
int64_t hs_line_contact_count(const hs_line *memory);
/* Numbers of `far_energy`. */
size_t hs_far_count(const hs_contact *contact);
/* Energy dissipated by the asperities from position `start` on, `count` of them. */
void hs_dissipated_energies(const hs_line *memory, int64_t start, int64_t count, double *energy);
/* Add what is in `far_energy` to the energies of asperities. */
void hs_settle_energies(hs_line *memory);
/* Largest number of vertices of a group. */
int64_t hs_max_depth(const hs_line *memory);
int hs_has_steep(const hs_line *memory);
/* Tangential load of all groups, dimensionless. */
double hs_total_force(const hs_line *memory);

/* Sliding times [s] by asperity, in the caller's numbering, NaN if it has not slid; shared by
 * copies of a memory. */
struct hs_slides {
    int64_t references;
    double time[1];
};
/* Copy sliding times to `time`; and forget them. */
void hs_line_slide_times(const hs_line *memory, double *time);
void hs_line_forget_slides(hs_line *memory);
struct hs_slides *hs_slides_retain(struct hs_slides *slides);
void hs_slides_release(struct hs_slides *slides);
/* Make the sliding times of a memory unshared, by a copy if necessary; NULL if out of memory. */
struct hs_slides *hs_slides_unshare(hs_line *memory);
/* Number of sliding times. */
static inline int64_t hs_slide_count(const hs_contact *contact) {
    return contact->query_count ? contact->query_count : contact->count;
}
/* Set sliding times; NULL only allocates them. */
int hs_slides_assign(hs_line *memory, const double *time);

static inline int hs_has_slid(const hs_line *memory, int64_t asperity) {
    return memory->slides && !isnan(memory->slides->time[asperity]);
}
/* Advance the clock to a time [s], on a path that is straight in approach and displacement. */
static inline void hs_tick(hs_line *memory, double time) {
    memory->clock = HS_MADE(hs_clock){
        memory->clock.end, isnan(memory->clock.end) ? memory->clock.end : time, NAN, NAN};
}
/* Set the clock [s] at the start of a path; NaN switches timing off. */
static inline void hs_set_clock(hs_line *memory, double time) {
    memory->clock = HS_MADE(hs_clock){time, time, NAN, NAN};
}
static inline int hs_is_timed(const hs_line *memory) { return !isnan(memory->clock.end); }

#endif
