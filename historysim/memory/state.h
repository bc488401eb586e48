/* State: the arrays of a memory, its clock, and the times at which its asperities first slid (memory.c; <memory.h> is a header
 * of some systems). */
#ifndef HISTORYSIM_STATE_H
#define HISTORYSIM_STATE_H

#include "group.h"

/* How asperities of a memory evolve: not, 1, or 2 if they may yield; and the number of arrays that this needs. */
static inline int hs_evolves(const hs_line *memory) {
    return !memory->evolved ? 0 : memory->evolved->virgin_height ? 2 : 1;
}
static inline size_t hs_evolved_arrays(int yields) { return yields ? 11 : 6; }
/* Sum the energies of yielding. */
void hs_sum_yielded(hs_evolved *evolved, int64_t count);
/* Set up a zeroed memory, whose arrays are not filled in. */
int hs_line_init(hs_line *memory, hs_contact *contact, int64_t capacity, int evolves);
/* Allocate such a memory. */
hs_line *hs_line_blank(hs_contact *contact, int64_t capacity, int evolves);
/* Set up a zeroed memory of a contact that nothing has happened to. */
int hs_line_start(hs_line *memory, hs_contact *contact, const double *friction);
/* Set up a zeroed memory as a copy. */
int hs_line_init_copy(hs_line *memory, const hs_line *from);
hs_line *hs_line_copy(const hs_line *memory);
/* Release what a memory holds. */
void hs_line_clear(hs_line *memory);
void hs_line_free(hs_line *memory);
int hs_line_add_evolved(hs_line *memory);
int hs_line_add_yielded(hs_line *memory);
/* Whether two memories belong to the same contact, friction and laws. */
int hs_line_belongs(const hs_line *memory, const hs_line *like);
/* Set up a zeroed memory of one asperity, which exists, with what its group remembers. */
int hs_line_init_one(hs_line *memory, const hs_line *from, int64_t asperity);
/* Ensure that each stack can hold `capacity` vertices. */
int hs_line_reserve(hs_line *memory, int64_t capacity);
/* Copy everything from a memory of the same contact and groups. */
int hs_line_assign(hs_line *memory, const hs_line *from);
void hs_line_swap(hs_line *one, hs_line *other);
/* Replace a memory by another one, which is freed. */
void hs_line_take(hs_line *memory, hs_line *other);
/* Replace the contact by a copy that is not shared, so that it can be changed in place. */
int hs_line_unshare_contact(hs_line *memory);
/* Whether a memory has the arrays that a type of evolution needs, of its number of asperities. */
int hs_can_evolve(const hs_line *memory, const hs_evolution *evolution);
/* Recompute the loads stored with the vertices. */
void hs_refresh_loads(hs_line *memory);
/* Erase the history of a group: where it touches, no spring is strained. */
void hs_touch_unstrained(hs_line *memory, int64_t index);
/* Split groups whose asperities differ in a pair of keys (asperity). */
int hs_split_groups(hs_line *memory, const double *first_key, const double *second_key);
/* Replace gaps and weights at the present approach; asperities that are `fresh` lose their history. */
int hs_reshape(hs_line *memory, const double *gap, const double *weight, const uint8_t *fresh);
/* Whether no spring is strained. */
int hs_unstrained(const hs_line *memory);
/* Whether all springs slide in one direction, as far as each group remembers. */
int hs_slides_alike(const hs_line *memory);
/* Join groups of one coefficient whose histories are the same: empty, or of springs that all slide. */
int hs_join_groups(hs_line *memory, const double *gap, const double *weight, double approach, int unstrained);
/* Asperities that touch. */
int64_t hs_line_contact_count(const hs_line *memory);
/* Vertices of the deepest stack. */
int64_t hs_max_depth(const hs_line *memory);
int hs_has_steep(const hs_line *memory);
/* Sum of the groups' tangential loads. */
double hs_total_force(const hs_line *memory);

/* Times by asperity, in the caller's numbering, NaN for those that have not slid; copies of a memory share them. */
struct hs_slides {
    int64_t references;
    double time[1];
};
/* Fill in sliding times, NaN for those that have not slid; and forget them. */
void hs_line_slide_times(const hs_line *memory, double *time);
void hs_line_forget_slides(hs_line *memory);
struct hs_slides *hs_slides_retain(struct hs_slides *slides);
void hs_slides_release(struct hs_slides *slides);
/* Return sliding times that no other memory shares, as a copy if necessary; NULL if out of memory. */
struct hs_slides *hs_slides_unshare(hs_line *memory);
/* Number of sliding times. */
static inline int64_t hs_slide_count(const hs_contact *contact) { return contact->query_count ? contact->query_count : contact->count; }
/* Set sliding times; NULL only allocates them. */
int hs_slides_assign(hs_line *memory, const double *time);

static inline int hs_has_slid(const hs_line *memory, int64_t asperity) {
    return memory->slides && !isnan(memory->slides->time[asperity]);
}
/* Advance the clock to a time, on a path that is straight in approach and displacement. */
static inline void hs_tick(hs_line *memory, double time) {
    memory->clock = HS_MADE(hs_clock){memory->clock.end, isnan(memory->clock.end) ? memory->clock.end : time, NAN, NAN};
}
/* Set the clock, from which on sliding is timed; NaN switches timing off. */
static inline void hs_set_clock(hs_line *memory, double time) {
    memory->clock = HS_MADE(hs_clock){time, time, NAN, NAN};
}
static inline int hs_is_timed(const hs_line *memory) { return !isnan(memory->clock.end); }

#endif
