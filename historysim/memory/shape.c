/* Shape: summits that change on a path, from worn volumes or from the approach: worn ones lose
 * their cap or are blunted; those that yield are lowered and flattened, and their springs
 * relabelled (README.md, theory 1). */

#include "shape.h"
#include "contact.h"
#include "laws.h"

static void turn(uint64_t *low, uint64_t *high) {
    for (; low < high; ++low, --high) {
        uint64_t kept = *low;
        *low = *high;
        *high = kept;
    }
}

/* Swap two adjacent runs of numbers. */
static void exchange(void *numbers, int64_t first, int64_t second, int64_t end) {
    uint64_t *run = (uint64_t *)numbers;
    turn(run + first, run + second - 1);
    turn(run + second, run + end - 1);
    turn(run + first, run + end - 1);
}

/* Swap a group and the next one, with so many vertices: also those of a group that does not touch
 * for a while. */
static void exchange_groups(hs_line *memory, int64_t index, int64_t deepest) {
    const hs_contact *contact = memory->contact;
    int64_t *first = (int64_t *)contact->first + index, middle = first[0] + (first[2] - first[1]);
    void *arrays[] = {(void *)contact->gap, (void *)contact->weight, (void *)contact->order,
                      memory->dissipated_each};
    for (size_t k = 0; k < 4; ++k) exchange(arrays[k], first[0], first[1], first[2]);
    first[1] = middle;
    exchange(memory->friction, index, index + 1, index + 2);
    exchange(memory->depth, index, index + 1, index + 2);
    uint8_t steep = memory->steep[index];
    memory->steep[index] = memory->steep[index + 1];
    memory->steep[index + 1] = steep;
    hs_vertex *one = memory->vertices + index * memory->capacity, *other = one + memory->capacity;
    for (int64_t j = 0; j < deepest; ++j) {
        hs_vertex kept = one[j];
        one[j] = other[j];
        other[j] = kept;
    }
}

/* True if the group at `index` precedes the one before it: by smallest gap, then by number of its
 * first asperity, as in a contact that is made anew. */
static int is_before_previous(const hs_contact *contact, int64_t index) {
    int64_t previous = contact->first[index - 1], own = contact->first[index];
    if (contact->gap[previous] != contact->gap[own])
        return contact->gap[own] < contact->gap[previous];
    return contact->order[own] < contact->order[previous];
}

/* Sort groups whose smallest gaps have changed by insertion; what is nearly in order takes little.
 */
static void put_in_order(hs_line *memory, const int64_t *depth) {
    const hs_contact *contact = memory->contact;
    const int64_t *order = contact->order, *first = contact->first;
    for (int64_t index = 1; index < contact->groups; ++index)
        for (int64_t k = index; k > 0 && is_before_previous(contact, k); --k) {
            int64_t low = depth[order[first[k - 1]]], high = depth[order[first[k]]];
            exchange_groups(memory, k - 1, low > high ? low : high);
        }
}

void hs_set_shape(hs_line *memory, const double *height, const double *radius,
                  const int64_t *depth) {
    const hs_contact *contact = memory->contact;
    const int64_t *order = contact->order, *first = contact->first;
    double *gap = (double *)contact->gap, *weight = (double *)contact->weight;
    double per_length = 1.0 / contact->units.length, datum = contact->datum;
    for (int64_t i = 0; i < contact->count; ++i) {
        gap[i] = (datum - height[order[i]]) * per_length;
        weight[i] = sqrt(radius[order[i]] * per_length);
    }
    for (int64_t index = 0; index < contact->groups; ++index)
        memory->depth[index] =
            gap[first[index]] < memory->approach ? depth[order[first[index]]] : 0;
    put_in_order(memory, depth);
    if (contact->groups > 1) {
        memcpy((double *)contact->sorted_gap, gap, (size_t)contact->count * sizeof *gap);
        memcpy((double *)contact->sorted_weight, weight, (size_t)contact->count * sizeof *weight);
    }
    hs_contact_changed(memory->contact);
    memory->normal_load = hs_load_at(hs_all_of(contact), memory->approach).load;
}

void hs_forget_worn(hs_line *memory) {
    for (int64_t index = 0; index < memory->contact->groups; ++index) {
        hs_vertex *stack = memory->vertices + index * memory->capacity;
        double gap = memory->contact->gap[memory->contact->first[index]];
        int64_t worn = 0, depth = memory->depth[index];
        while (worn + 2 < depth && stack[worn + 1].label <= gap) ++worn;
        /* by rounding of its shape alone */
        if (depth == 0 && gap < memory->approach) hs_touch_unstrained(memory, index);
        if (depth < 2 || stack[worn].label >= gap) continue;
        memmove(stack, stack + worn, (size_t)(depth - worn) * sizeof *stack);
        stack->anchor = stack[1].anchor - stack[1].slope * (stack[1].label - gap);
        stack->label = gap;
        stack->normal = stack->tangential = stack->slope = 0.0;
        memory->depth[index] = depth - worn;
    }
}

void hs_store_gaps(walk *w, const hs_contact *contact) {
    for (int64_t i = 0; i < contact->count; ++i) w->gap[contact->order[i]] = contact->gap[i];
}

void hs_store_depths(walk *w, const hs_line *memory) {
    const hs_contact *contact = memory->contact;
    for (int64_t g = 0; g < contact->groups; ++g)
        w->depth[contact->order[contact->first[g]]] = memory->depth[g];
}

double hs_wear_to(walk *w, hs_line *memory, const double *height, const double *radius,
                  double stored) {
    hs_set_shape(memory, height, radius, w->depth);
    hs_refresh_loads(memory);
    return stored - hs_elastic_energy(memory, NULL);
}

int hs_predict_wear(walk *w, const hs_line *memory, const chord_end *end) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_wear *wear = &w->evolution->wear;
    double unit = contact->units.length;
    double modulus = 4.0 / 3.0 * w->evolution->contact_modulus;
    for (int64_t g = 0; g < contact->groups; ++g)
        for (int64_t k = contact->first[g]; k < contact->first[g + 1]; ++k) {
            int64_t i = contact->order[k];
            if (w->shape.begun[i] + w->slid[i] == 0.0) {
                w->shape.mean_load[i] = w->shape.energy[i] = 0.0;
                continue;
            }
            double start = (memory->approach - w->gap[i]) * unit, slid = w->slid[i];
            double stop = end->d * unit - (contact->datum - w->shape.end_height[i]);
            /* an asperity slides to the end, or until it leaves */
            double leaves = stop < 0.0 && slid > 0.0 ? start / (start - stop) : 1.0;
            /* what is held may have slid farther than the contact is moved now */
            double begins = slid > 0.0 ? hs_max(leaves - slid / w->moved, 0.0) : 0.0;
            w->shape.first[i] = hs_max(start + begins * (stop - start), 0.0);
            w->shape.last[i] = hs_max(stop, 0.0);
            w->shape.mean_load[i] = 0.0;
            if (slid > 0.0)
                w->shape.mean_load[i] = hs_mean_load(
                    w->shape.first[i], w->shape.last[i],
                    modulus * sqrt(0.5 * (evolved->summit_radius[i] + w->shape.end_radius[i])));
            w->shape.energy[i] = w->friction[g] * w->shape.mean_load[i] * slid;
        }
    int status = hs_lost_volumes(wear, contact->count, w->shape.mean_load, w->slid, w->shape.energy,
                                 w->shape.lost);
    for (int64_t i = 0; i < contact->count; ++i) {
        double height = evolved->summit_height[i], radius = evolved->summit_radius[i],
               guess = w->shape.end_radius[i];
        w->shape.end_height[i] = height;
        w->shape.end_radius[i] = radius;
        w->shape.taken[i] = 0.0;
        if (w->shape.begun[i] + w->slid[i] > 0.0 && w->shape.first[i] + w->shape.last[i] > 0.0) {
            double waiting = hs_max(evolved->waiting_volume[i], -w->shape.lost[i]);
            w->shape.taken[i] =
                hs_worn_summit(wear, radius * w->shape.first[i], guess * w->shape.last[i],
                               0.5 * (radius + guess), evolved->shaped_volume[i], waiting,
                               w->shape.lost[i], w->shape.end_height + i, w->shape.end_radius + i);
        }
        w->shape.mid_height[i] = 0.5 * (height + w->shape.end_height[i]);
        w->shape.mid_radius[i] = 0.5 * (radius + w->shape.end_radius[i]);
    }
    return status;
}

int hs_yielding_end(const walk *w, const hs_line *memory, double share, double *d, double *load) {
    const route *c = &w->course;
    *d = hs_toward(c->d[0], c->d[1], share);
    *load = c->normal_by_load && share == 1.0 ? c->load[1] : NAN;
    if (!c->both_loads || share == 1.0) return HS_OK;
    *load = hs_toward(c->load[0], c->load[1], share);
    return hs_yielding_approach(memory, w->evolution, *load, d);
}

/* Have summits become what they are at the end of a chord to approach d, each group of those that
 * yield being alike. One that first touches on the chord does so under its virgin summit: its way
 * under the new one is told to begin where it touches at the same share. */
int hs_apply_yielding(walk *w, hs_line *memory, double d) {
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const double unit = contact->units.length;
    double *gap = (double *)contact->gap, *weight = (double *)contact->weight;
    for (int64_t i = 0; i < contact->count; ++i) {
        w->yield.from[i] = memory->approach;
        w->yield.steeper[i] = evolved->summit_radius[i];
    }
    int status = hs_yield_to(memory, w->evolution, d, w->yield.changed);
    if (status != HS_OK) return status;
    hs_store_depths(w, memory);
    for (int64_t i = 0; i < contact->count; ++i)
        w->yield.steeper[i] =
            w->yield.changed[i] ? evolved->summit_radius[i] / w->yield.steeper[i] : 1.0;
    for (int64_t g = 0; g < contact->groups; ++g) {
        int64_t first = contact->first[g], leader = contact->order[first];
        if (!w->yield.changed[leader]) continue;
        hs_vertex *stack = memory->vertices + g * memory->capacity;
        double old = gap[first], now = (contact->datum - evolved->summit_height[leader]) / unit;
        double ratio = w->yield.steeper[leader];
        for (int64_t k = first; k < contact->first[g + 1]; ++k) {
            gap[k] = now;
            weight[k] = sqrt(evolved->summit_radius[leader] / unit);
        }
        for (int64_t j = 0; j < memory->depth[g]; ++j) {
            stack[j].label = now + (stack[j].label - old) / ratio;
            stack[j].slope *= ratio;
            stack[j].normal /= ratio;
        }
        double edge = memory->depth[g] ? stack[memory->depth[g] - 1].label
                                       : d - (d - now) * ((d - memory->approach) / (d - old));
        for (int64_t k = first; k < contact->first[g + 1]; ++k) {
            w->yield.from[contact->order[k]] = edge;
            if (memory->depth[g] == 0) w->yield.steeper[contact->order[k]] = 1.0;
        }
    }
    put_in_order(memory, w->depth);
    if (contact->groups > 1) {
        for (int64_t i = 0; i < contact->count; ++i) w->yield.place[i] = i;
        if (hs_sort_by(gap, w->yield.place, contact->count) != HS_OK) return HS_OUT_OF_MEMORY;
        for (int64_t i = 0; i < contact->count; ++i) {
            ((double *)contact->sorted_gap)[i] = gap[w->yield.place[i]];
            ((double *)contact->sorted_weight)[i] = weight[w->yield.place[i]];
        }
    }
    hs_contact_changed(memory->contact);
    memory->known_label = NAN;
    return HS_OK;
}
