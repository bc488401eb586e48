/* One chord: where it ends, and all groups carried there. */

#include "chord.h"

/* Approach and normal load at a share of the path.
 *
 * Of two loads both go straight. Otherwise the approach does, as the contact at the start has it; where wear has
 * changed that, a normal load keeps the values that it had then. */
static void normal_at(const walk *w, const hs_memory *memory, double share, double *d, double *load) {
    const route *c = &w->course;
    if (c->both_loads) {
        *load = hs_toward(c->load[0], c->load[1], share);
        *d = hs_approach_for(memory, *load);
        return;
    }
    *d = hs_toward(c->d[0], c->d[1], share);
    if (c->normal_by_load) {
        *load = share == 1.0 ? c->load[1] : hs_load_at(hs_all_of(c->first ? c->first : memory->contact), *d).load;
        if (w->wears) *d = hs_approach_for(memory, *load);
    } else {
        *load = hs_load_at(hs_all_of(memory->contact), *d).load;
    }
}

/* Find the displacement at which a chord ends. */
static int find_end(walk *w, hs_memory *memory, double share, chord_end *end) {
    const route *c = &w->course;
    const hs_contact *contact = memory->contact;
    double value = hs_toward(c->tangential[0], c->tangential[1], share), limit = 0.0;
    /* where asperities wear, the loads are known when they have their shapes */
    int changes = 0, weighs = !w->wears || c->tangential_by_load || w->compliance > 0.0;
    hs_group_loads loads;
    loads.load = w->load;
    loads.from = w->yield.now ? w->edge : NULL;
    loads.count = 0;
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < end->d; ++g, ++loads.count) {
        w->edge[g] = starts_at(w, memory, g);
        changes |= w->friction[g] != memory->friction[g] || steeper(w, memory, g) != 1.0;
        if (!weighs) continue;
        w->load[g] = contact->groups == 1 ? end->load : hs_load_at(hs_group_of(memory, g).curve, end->d).load;
        limit += w->friction[g] * w->load[g];
    }
    end->touching = loads.count;
    end->excess = 0.0;
    end->force = value;
    if (c->ends_separated || (!c->tangential_by_load && w->compliance == 0.0)) {
        end->v = c->ends_separated ? hs_toward(c->apart[0], c->apart[1], share) : value;
        return HS_OK;
    }
    hs_target target = {value, 1.0, w->compliance};
    if (c->tangential_by_load) {
        if (fabs(value) - limit > HS_LIMIT_SLACK * limit) {
            if (!w->drive->saturate) {
                w->refusal->request = value * contact->units.load;
                w->refusal->limit = limit * contact->units.load;
                return HS_BEYOND_LIMIT;
            }
            end->force = copysign(limit, value);
            end->excess = value - end->force;
        }
        target = hs_to_load(end->force);
    }
    hs_fronts fronts;
    int status = hs_no_fronts(&fronts, loads.count);
    if (status != HS_OK) return status;
    if (!changes || loads.count == 0) {
        status = hs_displacement_with(memory, &loads, &fronts, end->d, target, &end->v);
    } else {
        /* any cone may cut any polyline */
        double *kept = memory->friction;
        memcpy(w->steep, memory->steep, (size_t)contact->groups);
        memset(memory->steep, 1, (size_t)contact->groups);
        memory->friction = w->friction;
        status = hs_found_displacement(memory, &loads, &fronts, end->d, target, &end->v);
        memory->friction = kept;
        memcpy(memory->steep, w->steep, (size_t)contact->groups);
    }
    hs_free_fronts(&fronts);
    /* what slides already while its limit falls stays where it is */
    double side = copysign(1.0, end->force);
    int at_limit = c->tangential_by_load && fabs(end->force) >= (1.0 - HS_TIE) * limit;
    if (loads.count == 0 && end->excess == 0.0) at_limit = 0;
    if (at_limit && (loads.count == 0 || side * end->v < side * memory->displacement)) end->v = memory->displacement;
    return status;
}

/* Have room for a stack to be clipped, and for what is added to it otherwise. */
static int make_room(walk *w, hs_memory *memory, int64_t depth) {
    int64_t room = 2 * hs_room_to_clip(depth);
    if (room > w->room) {
        free(w->scratch);
        w->scratch = (hs_vertex *)malloc(2 * (size_t)room * sizeof *w->scratch);
        w->room = w->scratch ? 2 * room : 0;
    }
    if (!w->scratch) return HS_OUT_OF_MEMORY;
    return depth + 2 > memory->capacity ? hs_memory_reserve(memory, 2 * (depth + 2)) : HS_OK;
}

/* Carry one group on a straight way, with its coefficient going straight, too; what it loses goes to `each`, position
 * 0. */
static int carry_group(walk *w, hs_memory *memory, int64_t index, const way *on, double load, double *each,
                       hs_losses *losses) {
    int64_t depth = memory->depth[index];
    if (make_room(w, memory, depth) != HS_OK) return HS_OUT_OF_MEMORY;
    hs_group group = hs_group_of(memory, index);
    double reached;
    group.each = each + group.start;
    group.friction = on->friction[2];
    if (on->to.d <= group.curve.gap[0]) {
        group.friction = on->friction[0];
        if (depth) hs_note_slides(&group, depth, &on->from, &on->to, group.friction, HUGE_VAL, memory->steep[index]);
        if (depth) hs_lose_withdrawn(&group, losses, depth, 1, &on->from, &on->to);
        memory->depth[index] = 0;
        memory->steep[index] = 0;
    } else if (depth > 0 && (memory->steep[index] || on->friction[0] != on->friction[2])) {
        hs_cone cone = {on->friction[2], on->to.v - on->from.v, on->friction[0] * (on->to.d - on->from.d),
                        on->friction[2] - on->friction[0]};
        depth = hs_carry_and_clip(&group, losses, depth, on->from, on->to, load, &cone, w->scratch, NULL);
        if (depth > memory->capacity && hs_memory_reserve(memory, 2 * depth) != HS_OK) return HS_OUT_OF_MEMORY;
        memcpy(memory->vertices + index * memory->capacity, w->scratch, (size_t)depth * sizeof *w->scratch);
        memory->depth[index] = depth;
        memory->steep[index] = (uint8_t)hs_is_steep(w->scratch, depth, group.friction);
    } else {
        memory->depth[index] = hs_move_group(&group, losses, depth, &on->from, on->to.d, load,
                                             hs_to_displacement(on->to.v), &reached);
    }
    return HS_OK;
}

int hs_carry_by_stations(walk *w, hs_memory *memory, int64_t g, const chord_end *end, double *each,
                             hs_losses *losses) {
    const hs_contact *contact = memory->contact;
    hs_point from = {starts_at(w, memory, g), memory->displacement}, to = {end->d, end->v};
    int64_t stations = w->first_station[g + 1] - w->first_station[g], first = contact->first[g];
    const station *at = w->stations + w->first_station[g];
    way on = {from, from, {memory->friction[g] * steeper(w, memory, g), 0.0, 0.0}, 1.0};
    const hs_clock clock = memory->clock;
    int bends = at->amid > 0.0, status = HS_OK;
    for (int64_t k = first; bends && k < contact->first[g + 1]; ++k) w->slid[contact->order[k]] = 0.0;
    memory->clock.end = clock.begin;
    for (int64_t k = 0; k < stations && status == HS_OK; ++k) {
        hs_group group = hs_group_of(memory, g);
        hs_tick(memory, hs_toward(clock.begin, clock.end, at[k].share));
        int last = k + 1 == stations;
        on.to.d = last ? to.d : hs_toward(from.d, to.d, at[k].share);
        on.to.v = last ? to.v : hs_toward(from.v, to.v, at[k].share);
        on.friction[2] = at[k].friction;
        if (memory->depth[g] == 0) on.friction[0] = on.friction[2];
        if (on.to.d <= group.curve.gap[0]) on.friction[2] = on.friction[0];
        on.friction[1] = at[k].amid > 0.0 ? at[k].amid : 0.5 * (on.friction[0] + on.friction[2]);
        double load = last && g < end->touching ? w->load[g] : hs_load_at(group.curve, on.to.d).load;
        if (bends)
            hs_slide_on(&group, memory->depth[g], w->gap, contact->order + first, on, contact->units.displacement,
                     memory->steep[g], w->slid);
        status = carry_group(w, memory, g, &on, load, each, losses);
        on.from = on.to;
        on.friction[0] = on.friction[2];
    }
    memory->clock = clock;
    return status;
}

/* Carry all groups to the end of a chord. */
static int carry(walk *w, hs_memory *memory, const chord_end *end, double share) {
    const hs_contact *contact = memory->contact;
    double deepest = hs_most(memory->approach, end->d);
    hs_losses losses;
    hs_no_losses(&losses, contact->groups);
    for (int64_t g = 0; g < contact->groups && contact->gap[contact->first[g]] < deepest; ++g) {
        int status = hs_carry_by_stations(w, memory, g, end, memory->each, &losses);
        if (status != HS_OK) return status;
    }
    /* what was foreseen has shaped the summits */
    if (w->wears) memcpy(w->slid, w->ahead, (size_t)contact->count * sizeof *w->slid);
    memcpy(memory->friction, w->friction, (size_t)contact->groups * sizeof(double));
    hs_settle(&losses, memory);
    memory->approach = end->d;
    memory->displacement = end->v;
    memory->normal_load = end->load;
    memory->excess = end->excess;
    memory->tangential_load = hs_total_force(memory);
    if (w->course.tangential_by_load && (!w->course.ends_separated || share == 1.0)) memory->tangential_load = end->force;
    return HS_OK;
}

/* Find where a chord ends, and how far asperities slide to there; where they wear, with the shapes that follow: twice. */
static int find_sliding(walk *w, hs_memory *memory, double share, chord_end *end, int *slides) {
    const hs_contact *contact = memory->contact;
    const hs_law *law = &w->evolution->law;
    const size_t size = (size_t)contact->count * sizeof(double);
    int by_distance = !w->evolution->goal && law->kind != HS_NO_LAW && law->depends_on == HS_ON_SLID_DISTANCE;
    int passes = w->wears ? 2 : by_distance, searches = w->course.tangential_by_load || w->compliance > 0.0;
    for (int pass = 0;; ++pass) {
        if (!w->yield.now) normal_at(w, memory, share, &end->d, &end->load);
        int status = hs_put_stations(w, memory, end->d, end->load, share, pass ? w->ahead : NULL);
        if (status == HS_OK) status = find_end(w, memory, share, end);
        if (status != HS_OK) return status;
        w->moved = fabs(end->v - memory->displacement) * contact->units.displacement;
        status = hs_slide_all(w, memory, end, w->wears && pass < passes);
        if (status != HS_OK) return status;
        for (int64_t i = 0; i < contact->count && !*slides; ++i) *slides = w->slid[i] > 0.0;
        if (pass == passes) return HS_OK;
        if (pass == 0) memcpy(w->shape.begun, w->slid, size);
        /* what wears may be held by it: it goes in small jerks then, and slides half the way */
        for (int64_t i = 0; i < contact->count; ++i)
            w->slid[i] = hs_most(w->slid[i], w->wears ? 0.5 * w->shape.begun[i] : 0.0);
        memcpy(w->ahead, w->slid, size);
        if (!*slides) return HS_OK;
        if (!w->wears) continue;
        status = hs_foresee_wear(w, memory, end);
        if (status != HS_OK) return status;
        hs_set_shape(memory, w->shape.end_height, w->shape.end_radius, w->depth);
        if (searches) hs_refresh_loads(memory);
    }
}

/* Put down friction and loads at the end of a chord on which summits wear: groups may stand in another order there. */
static int weigh_worn(walk *w, const hs_memory *memory, double share, chord_end *end) {
    int status = hs_put_stations(w, memory, end->d, end->load, share, w->ahead);
    for (end->touching = 0; end->touching < memory->contact->groups && status == HS_OK; ++end->touching) {
        hs_curve curve = hs_group_of(memory, end->touching).curve;
        if (curve.gap[0] >= end->d) break;
        w->load[end->touching] = hs_load_at(curve, end->d).load;
    }
    return status;
}

/* Put down the volumes that asperities have lost on a chord, on which their summits took another shape or not. */
static int lose_volumes(walk *w, hs_memory *memory, int shaped) {
    const hs_contact *contact = memory->contact;
    hs_evolved *evolved = memory->evolved;
    const size_t size = (size_t)contact->count * sizeof(double);
    for (int64_t i = 0; i < contact->count; ++i)
        w->shape.energy[contact->order[i]] = (memory->each[i] - w->before[contact->order[i]]) * contact->units.energy;
    if (!shaped) {
        memset(w->shape.mean_load, 0, size);
        memset(w->shape.taken, 0, size);
    }
    int status = hs_lost_volumes(&w->evolution->wear, contact->count, w->shape.mean_load, w->slid, w->shape.energy,
                                 w->shape.lost);
    for (int64_t i = 0; i < contact->count; ++i) {
        evolved->worn_volume[i] += w->shape.lost[i];
        evolved->waiting_volume[i] += w->shape.lost[i] - w->shape.taken[i];
        evolved->shaped_volume[i] += w->shape.taken[i];
    }
    return status;
}

int hs_chord(walk *w, hs_memory *memory, double share) {
    hs_evolved *evolved = memory->evolved;
    const hs_contact *contact = memory->contact;
    const size_t size = (size_t)contact->count * sizeof(double);
    double stored = w->wears ? hs_stored(memory, NULL) : 0.0, erased = 0.0;
    int status = HS_OK, slides = 0;
    chord_end end;
    hs_tick(memory, hs_toward(w->course.times[0], w->course.times[1], share));
    w->yield.now = w->yields && share > w->yield.onset;
    if (w->yield.now) {
        status = hs_yielding_end(w, memory, share, &end.d, &end.load);
        if (status == HS_OK) status = hs_yield_on(w, memory, end.d);
        if (status != HS_OK) return status;
        if (isnan(end.load)) end.load = hs_load_at(hs_all_of(contact), end.d).load;
    }
    hs_note_gaps(w, contact);
    if (w->wears) {
        for (int64_t i = 0; i < contact->count; ++i) w->before[contact->order[i]] = memory->each[i];
        memcpy(w->shape.end_height, evolved->summit_height, size);
        memcpy(w->shape.end_radius, evolved->summit_radius, size);
        hs_note_depths(w, memory);
    }
    status = find_sliding(w, memory, share, &end, &slides);
    if (status != HS_OK) return status;
    int shaped = w->wears && slides;
    if (shaped) erased = hs_wear_to(w, memory, w->shape.mid_height, w->shape.mid_radius, stored);
    if (w->wears) status = weigh_worn(w, memory, share, &end);
    if (status == HS_OK) status = carry(w, memory, &end, share);
    if (status != HS_OK) return status;
    if (shaped) {
        hs_note_depths(w, memory);
        erased += hs_wear_to(w, memory, w->shape.end_height, w->shape.end_radius, hs_stored(memory, NULL));
        hs_forget_worn(memory);
        memory->normal_load = end.load;
        if (!w->course.tangential_by_load) memory->tangential_load = hs_total_force(memory);
        memcpy(evolved->summit_height, w->shape.end_height, size);
        memcpy(evolved->summit_radius, w->shape.end_radius, size);
        evolved->erased_energy += erased * contact->units.energy;
    }
    if (w->wears) status = lose_volumes(w, memory, shaped);
    hs_add_slides(w, memory);
    return status;
}
