/* The friction of each group on a chord: by a law at stations, which are graded towards touch, or on its way to a goal. */

#include "chord.h"

/* approach of one station over that of the next, which are farther apart close to touch: no root of 2, by which chords
 * half as long would have the same; a change of it that needs none; and stations that a chord may have */
#define GRADE 1.2
#define SLIGHT 1.03
#define MOST_STATIONS 16
/* stands for a coefficient that a law is asked for */
#define ASKED (-1.0)

/* Have room for so many stations more. */
static int make_stations(walk *w, int64_t count) {
    if (count <= w->most) return HS_OK;
    size_t most = 2 * (size_t)count;
    station *grown = (station *)malloc(most * (sizeof *grown + 8 * sizeof(double)));
    if (!grown) return HS_OUT_OF_MEMORY;
    double *asked[4];
    for (size_t k = 0; k < 4; ++k) asked[k] = (double *)(grown + most) + 2 * k * most;
    if (w->most) memcpy(grown, w->stations, (size_t)w->most * sizeof *grown);
    for (size_t k = 0; k < 4 && w->most; ++k) memcpy(asked[k], w->asked[k], 2 * (size_t)w->most * sizeof(double));
    free(w->stations);
    w->stations = grown;
    w->most = (int64_t)most;
    memcpy(w->asked, asked, sizeof asked);
    return HS_OK;
}

/* Ask a law for the coefficient of an asperity at an approach of its own. */
static void ask(walk *w, int64_t number, const hs_contact *contact, double weight, double own, double slid) {
    w->asked[0][number] = weight * sqrt(own) * own * contact->units.load;
    w->asked[1][number] = weight * weight * contact->units.radius;
    w->asked[2][number] = slid;
}

int hs_put_stations(walk *w, const hs_memory *memory, double d, double load, double share, const double *ahead) {
    const hs_evolution *evolution = w->evolution;
    const hs_contact *contact = memory->contact;
    const hs_evolved *evolved = memory->evolved;
    const hs_law *law = &evolution->law;
    int by_goal = evolution->goal != NULL;
    int by_law = !by_goal && law->kind != HS_NO_LAW && law->depends_on != HS_ON_NOTHING;
    int64_t count = 0, asked = 0;
    for (int64_t index = 0; index < contact->groups; ++index) {
        int64_t i = contact->first[index], whose = contact->order[i];
        double friction = memory->friction[index];
        if (make_stations(w, count + MOST_STATIONS) != HS_OK) return HS_OUT_OF_MEMORY;
        w->first_station[index] = count;
        if (by_goal) friction = hs_toward(w->goal[0][whose], w->goal[1][whose], share);
        if (by_law && !evolved->given[whose]) {
            double start = starts_at(w, memory, index) - contact->gap[i], end = d - contact->gap[i];
            double weight = contact->weight[i];
            double most = hs_most(start, end), least = hs_most(hs_least(start, end), 0.0), at[MOST_STATIONS];
            double own = start, slid = evolved->slid_distance[whose] + (ahead ? ahead[whose] : 0.0);
            int between = 0, bends = law->depends_on == HS_ON_OWN_LOAD && most > SLIGHT * least;
            for (double next = most / GRADE; bends && next > least && between < MOST_STATIONS - 1;) {
                at[between++] = next;
                next /= between < 8 ? GRADE : between < 12 ? 4.0 : 64.0;
            }
            /* what begins to slide keeps its friction until then */
            double still = ahead && start > 0.0 && end > 0.0 ? 1.0 - ahead[whose] / w->moved : 0.0;
            if (law->depends_on == HS_ON_SLID_DISTANCE && still > 0.0 && still < 1.0) {
                w->stations[count++] = (station){still, friction, friction};
            }
            for (int k = 0; k <= between; ++k) {
                station *here = w->stations + count++;
                double last = own;
                own = k == between ? end : at[end > start ? between - 1 - k : k];
                here->share = k == between ? 1.0 : (own - start) / (end - start);
                int touches = own > 0.0 && (load > 0.0 || law->depends_on != HS_ON_TOTAL_LOAD);
                here->friction = touches ? ASKED : 0.0;
                here->amid = bends && touches ? ASKED : 0.0;
                if (touches && bends) ask(w, asked++, contact, weight, 0.5 * (hs_most(last, 0.0) + own), slid);
                if (touches) ask(w, asked++, contact, weight, own, slid);
            }
        } else {
            w->stations[count++] = (station){1.0, 0.0, friction};
        }
    }
    w->first_station[contact->groups] = count;
    hs_loaded loaded = {asked, w->asked[0], w->asked[1], w->asked[2], load * contact->units.load};
    int status = asked ? hs_coefficients(law, evolution->contact_modulus, &loaded, w->asked[3]) : HS_OK;
    for (int64_t k = 0, answer = 0; k < count && asked; ++k) {
        if (w->stations[k].amid == ASKED) w->stations[k].amid = w->asked[3][answer++];
        if (w->stations[k].friction == ASKED) w->stations[k].friction = w->asked[3][answer++];
    }
    for (int64_t index = 0; index < contact->groups; ++index)
        w->friction[index] = w->stations[w->first_station[index + 1] - 1].friction;
    for (int64_t g = 0; g < contact->groups && w->yield.now; ++g)
        for (int64_t k = w->first_station[g]; k < w->first_station[g + 1]; ++k) {
            double more = (steeper(w, memory, g) - 1.0) * (1.0 - w->stations[k].share);
            w->stations[k].friction *= 1.0 + more;
            w->stations[k].amid *= 1.0 + more;
        }
    return status;
}
