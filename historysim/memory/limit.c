/* Limit: the path fractions at which a requested tangential load crosses the friction limit Σ μ P(a), and the motion along the
 * limit (README.md, theory 2).
 *
 * A request beyond the limit is held at the limit, and the contact slides. At every moment of a path the tangential load is
 * the request, or the limit where that is less; the displacement takes the value nearest to its present one at which it is.
 * So with the normal load falling while everything slides the displacement stays, and with the normal load rising it goes
 * just so far that the new springs slide, too. That does not depend on how finely the path is divided.
 *
 * Requests go straight with the share s of a path: with both loads prescribed the normal load does, too, otherwise the
 * approach. The limit Σ μ P(a) of several groups is straight in neither, so a request may meet it more than once. */

#include "limit.h"
#include "bracket.h"
#include "state.h"

/* shares of a path below which a request that touches the limit does not meet it */
#define NARROWEST 1e-12
/* places that are looked at: a request that runs along the limit all the way would have it looked at everywhere */
#define MOST_LOOKED 4096
/* of a path, one after the other, that lead to less than that */
#define MOST_HALVINGS 64

/* A point of a request: its share, the limit, and the slopes in the approach of limit and normal load. */
typedef struct station {
    double share;
    double d;
    hs_limit at;
} station;

static double approach_on(const hs_line *memory, const hs_request *request, double share) {
    double d = hs_toward(request->d[0], request->d[1], share);
    if (!request->both_loads) return d;
    double load = hs_toward(request->load[0], request->load[1], share);
    return hs_label_at(hs_all_of(memory->contact), load, d, 0.0, 1.0);
}

static station station_at(const hs_line *memory, const hs_request *request, double share) {
    double d = approach_on(memory, request, share);
    return HS_MADE(station){share, d, hs_limit_and_slopes(memory, d)};
}

/* How far a request is beyond the limit on one side; 0 within rounding counts as beyond. */
static double excess(const hs_request *request, const station *place, double side) {
    return side * hs_toward(request->force[0], request->force[1], place->share) - (1.0 - HS_TIE) * place->at.limit;
}

/* Bounds of the limit's slope in the share between two places: the slopes in the approach rise with the approach. */
static void slopes_of_limit(const hs_line *memory, const hs_request *request, const station *low, const station *high,
                            double *flattest, double *steepest) {
    double limit_least = hs_least(low->at.limit_slope, high->at.limit_slope);
    double limit_most = hs_most(low->at.limit_slope, high->at.limit_slope);
    double rate = request->d[1] - request->d[0], least = limit_least, most = limit_most;
    if (request->both_loads) {
        double load_least = hs_least(low->at.load_slope, high->at.load_slope);
        double load_most = hs_most(low->at.load_slope, high->at.load_slope);
        hs_range friction = hs_friction_range(memory, hs_most(low->d, high->d));
        least = load_most > 0.0 ? hs_most(friction.least, limit_least / load_most) : friction.least;
        most = load_least > 0.0 ? hs_least(friction.most, limit_most / load_least) : friction.most;
        rate = request->load[1] - request->load[0];
    }
    *flattest = hs_least(rate * least, rate * most);
    *steepest = hs_most(rate * least, rate * most);
}

/* Share at which the one change of sign of `excess` between two places is, by false position (Illinois). */
static double crossing_between(const hs_line *memory, const hs_request *request, double side, const station *start,
                               const station *end) {
    hs_bracket root = {start->share, end->share, excess(request, start, side), excess(request, end, side), 0};
    for (int turn = 0; turn < 200; ++turn) {
        double share = hs_false_position(&root);
        if (share == root.low || share == root.high || root.high - root.low <= 1e-15) break;
        station place = station_at(memory, request, share);
        double here = excess(request, &place, side);
        if (here == 0.0) return share;
        hs_narrow(&root, share, here, (here > 0.0) == (root.at_high > 0.0));
    }
    return root.high;
}

/* Share between two places at which the request first comes to be beyond the limit on one side, or within it.
 *
 * Infinity where it does not; at the start it is not. Intervals are halved until bounds of the slopes say that the excess
 * is monotone or has no sign to change to. */
static double first_change(const hs_line *memory, const hs_request *request, double side, const station *start,
                           const station *end, int beyond) {
    /* the right ends of the intervals that are still to be looked at, the nearest last */
    station waiting[MOST_HALVINGS], low = *start;
    int count = 1, looked = 0;
    waiting[0] = *end;
    double rate = side * (request->force[1] - request->force[0]), wanted = beyond ? 1.0 : -1.0;
    while (count > 0) {
        station high = waiting[count - 1];
        double at_low = wanted * excess(request, &low, side), at_high = wanted * excess(request, &high, side);
        double least, most;
        slopes_of_limit(memory, request, &low, &high, &least, &most);
        double fastest = beyond ? rate - least : most - rate, slowest = beyond ? rate - most : least - rate;
        double width = high.share - low.share;
        int monotone = slowest >= 0.0 || fastest <= 0.0;
        if (monotone && at_high > 0.0)
            return at_low < 0.0 ? crossing_between(memory, request, side, &low, &high) : low.share;
        int hopeless = monotone || hs_least(at_low + fastest * width, at_high - slowest * width) <= 0.0;
        int last = width <= NARROWEST || looked == MOST_LOOKED;
        if (at_high <= 0.0 && (hopeless || last)) {
            --count;
            low = high;
        } else if (last || count == MOST_HALVINGS) {
            return high.share;
        } else {
            ++looked;
            waiting[count++] = station_at(memory, request, 0.5 * (low.share + high.share));
        }
    }
    return HUGE_VAL;
}

/* Whether a request has to be cut: it is at a limit or beyond it somewhere. */
static int meets_limit(const hs_line *memory, const hs_request *request) {
    const double held = 1.0 - HS_TIE, *force = request->force;
    if (fabs(force[1]) > held * hs_friction_limit(memory, request->d[1], request->load[1])) return 1;
    /* a straight path to an end within the limit prescribes no load before it */
    double start = held * hs_friction_limit(memory, request->d[0], request->load[0]);
    if (!request->both_loads) return fabs(force[0]) > (1.0 + HS_LIMIT_SLACK) * start;
    if (fabs(force[0]) > start) return 1;
    if (memory->contact->groups == 1 || request->d[0] == request->d[1]) return 0;
    station low = station_at(memory, request, 0.0), high = station_at(memory, request, 1.0);
    return first_change(memory, request, 1.0, &low, &high, 1) < 1.0 ||
           first_change(memory, request, -1.0, &low, &high, 1) < 1.0;
}

/* Cut a request where it meets the limit, or leaves it. */
static void cut(const hs_line *memory, const hs_request *request, hs_pieces *pieces) {
    station low = station_at(memory, request, 0.0), end = station_at(memory, request, 1.0);
    int side = excess(request, &low, 1.0) > 0.0 ? 1 : excess(request, &low, -1.0) > 0.0 ? -1 : 0;
    for (int count = 0; count < HS_MOST_PIECES_OF_REQUEST; ++count) {
        pieces->side[count] = side;
        pieces->end[count] = 1.0;
        pieces->count = count + 1;
        double share;
        int next = 0;
        if (side != 0) {
            share = first_change(memory, request, side, &low, &end, 0);
        } else {
            double above = first_change(memory, request, 1.0, &low, &end, 1);
            double below = first_change(memory, request, -1.0, &low, &end, 1);
            share = hs_least(above, below);
            next = above < below ? 1 : -1;
        }
        if (share >= 1.0 || count + 1 == HS_MOST_PIECES_OF_REQUEST) return;
        pieces->end[count] = share;
        side = next;
        low = station_at(memory, request, share);
    }
}

/* The request, and the limit there, at the end, or amid the piece that exceeds the limit most; whether it is beyond. */
static int is_overload(const hs_line *memory, const hs_request *request, const hs_pieces *pieces, double *asked,
                       double *limit) {
    double begin = 0.0;
    *asked = request->force[1];
    *limit = hs_friction_limit(memory, request->d[1], request->load[1]);
    for (int k = 0; k < pieces->count; ++k) {
        if (pieces->side[k] != 0 && fabs(*asked) <= *limit * (1.0 + HS_LIMIT_SLACK)) {
            double share = 0.5 * (begin + pieces->end[k]);
            *asked = hs_toward(request->force[0], request->force[1], share);
            *limit = hs_limit_and_slopes(memory, approach_on(memory, request, share)).limit;
        }
        begin = pieces->end[k];
    }
    return fabs(*asked) > *limit * (1.0 + HS_LIMIT_SLACK);
}

int hs_cut_at_limit(const hs_line *memory, const hs_request *request, int saturate, hs_pieces *pieces,
                    hs_refusal *refusal) {
    double asked, limit;
    pieces->count = 0;
    if (!meets_limit(memory, request)) return HS_OK;
    cut(memory, request, pieces);
    if (saturate || !is_overload(memory, request, pieces, &asked, &limit)) return HS_OK;
    refusal->request = asked * memory->contact->units.load;
    refusal->limit = limit * memory->contact->units.load;
    return HS_BEYOND_LIMIT;
}

/* Approach and normal load at a share. */
static void place_on(const hs_line *memory, const hs_request *request, double share, double *d, double *load) {
    if (share == 1.0) {
        *d = request->d[1];
        *load = request->load[1];
    } else if (request->both_loads) {
        *load = hs_toward(request->load[0], request->load[1], share);
        *d = hs_approach_at_load(memory, *load);
    } else {
        *d = hs_toward(request->d[0], request->d[1], share);
        *load = hs_load_at(hs_all_of(memory->contact), *d).load;
    }
}

/* Tangential load at a share within the limits: where the piece ends at a limit, that limit. */
static double request_at(const hs_line *memory, const hs_request *request, const hs_pieces *pieces, int piece,
                         double share, double d, double load) {
    double limit = hs_friction_limit(memory, d, load);
    if (share == pieces->end[piece] && piece + 1 < pieces->count) return pieces->side[piece + 1] * limit;
    return hs_clamp(hs_toward(request->force[0], request->force[1], share), limit);
}

/* Let the clock go on along the limit, where a load is straight in time if both are prescribed. */
static void tick_along_limit(hs_line *memory, int both, double load, double side, double time) {
    hs_tick(memory, time);
    if (!both) return;
    memory->clock.load = load;
    memory->clock.force = side * memory->friction[0] * load;
}

/* Carry the contact along the friction limit to approach d, where it carries `load`.
 *
 * With the approach falling the displacement stays. With the approach rising it keeps pace with the springs that need most
 * to slide as soon as they touch. */
static int slide(hs_line *memory, const hs_request *request, double d, double load, double side, double time) {
    const hs_contact *contact = memory->contact;
    double limit = hs_friction_limit(memory, memory->approach, memory->normal_load), steepest = 0.0;
    if (side * memory->tangential_load < (1.0 - HS_TIE) * limit) {
        /* at once */
        hs_tick(memory, memory->clock.end);
        int status = hs_move(memory, memory->approach, memory->normal_load, hs_to_load(side * limit));
        if (status != HS_OK) return status;
    }
    const double from = memory->approach, load0 = memory->normal_load, begin = memory->clock.end;
    if (d <= from) {
        tick_along_limit(memory, request->both_loads, load, side, time);
        return hs_move(memory, d, load, hs_to_displacement(memory->displacement));
    }
    for (int64_t index = 0; index < contact->groups; ++index) {
        double touch = contact->gap[contact->first[index]];
        if (touch >= d) break;
        if (memory->friction[index] <= steepest) continue;
        if (touch > memory->approach) {
            double reached = memory->displacement + side * steepest * (touch - memory->approach);
            double there = hs_load_at(hs_all_of(contact), touch).load;
            double share = request->both_loads ? (there - load0) / (load - load0) : (touch - from) / (d - from);
            tick_along_limit(memory, request->both_loads, there, side, hs_toward(begin, time, share));
            int status = hs_move(memory, touch, there, hs_to_displacement(reached));
            if (status != HS_OK) return status;
        }
        steepest = memory->friction[index];
    }
    tick_along_limit(memory, request->both_loads, load, side, time);
    return hs_move(memory, d, load, hs_to_displacement(memory->displacement + side * steepest * (d - memory->approach)));
}

/* Walk a request, cut into pieces, from one share to another; tell which limit it follows there. */
int hs_follow_limit(hs_line *memory, const hs_request *request, const hs_pieces *pieces, double before, double share,
              const double *times, const hs_drive *drive, int *side) {
    *side = 0;
    for (int k = 0; k < pieces->count; ++k) {
        double end = pieces->end[k], stop = hs_least(end, share), d, load;
        int status;
        if (end <= before && k < pieces->count - 1) continue;
        *side = pieces->side[k];
        place_on(memory, request, stop, &d, &load);
        double time = hs_toward(times[0], times[1], stop);
        if (*side != 0) {
            status = slide(memory, request, d, load, *side, time);
        } else if (request->both_loads) {
            status = hs_ramp(memory, load, request_at(memory, request, pieces, k, stop, d, load), time, drive);
        } else {
            double d_end, load_end;
            place_on(memory, request, end, &d_end, &load_end);
            hs_target target = hs_to_load(request_at(memory, request, pieces, k, end, d_end, load_end));
            status = HS_OK;
            if (stop < end) {
                double reached = 0.0;
                status = hs_solve_displacement(memory, d_end, load_end, target, &reached);
                target = hs_to_displacement(hs_toward(memory->displacement, reached, (stop - before) / (end - before)));
            }
            hs_tick(memory, time);
            if (status == HS_OK) status = hs_move(memory, d, load, target);
        }
        if (status != HS_OK) return status;
        before = stop;
        if (stop == share) break;
    }
    return HS_OK;
}
