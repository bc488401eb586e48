/* Laws: friction coefficients from load, radius and slid distance; worn volumes from load and slip;
 * summits that yield, from the largest approach (README.md, a further law). */

#include "laws.h"
#include "bracket.h"

#define PI 3.141592653589793

/* a³ of JKR's stable contact, of Hertz's where nothing adheres. */
static double cubed_radius(double load, double radius, double modulus, double work) {
    double pull = 3.0 * PI * work * radius;
    return 0.75 * radius / modulus * (load + pull + sqrt(2.0 * pull * load + pull * pull));
}

/* Straight between the rows of a table; beyond its ends it stays. */
static double in_table(const hs_law *law, double distance) {
    const double *x = law->distance, *y = law->coefficients;
    int64_t low = 0, high = law->rows - 1;
    if (distance <= x[0]) return y[0];
    if (distance >= x[high]) return y[high];
    while (high - low > 1) {
        int64_t middle = (low + high) / 2;
        if (x[middle] <= distance)
            low = middle;
        else
            high = middle;
    }
    return y[low] + (y[high] - y[low]) / (x[high] - x[low]) * (distance - x[low]);
}

int hs_coefficients(const hs_law *law, double modulus, const hs_loaded *loaded, double *friction) {
    const double *load = loaded->normal_load, *radius = loaded->summit_radius;
    double total = law->coefficient;
    if (law->kind == HS_CALLERS_LAW && law->function(law->user, loaded, friction))
        return HS_LAW_FAILED;
    if (law->kind == HS_POWER_LAW && law->depends_on == HS_ON_TOTAL_LOAD)
        total *= pow(loaded->total_normal_load / law->reference_load, law->exponent);
    for (int64_t i = 0; i < loaded->count; ++i) {
        if (law->kind == HS_CALLERS_LAW) {
            /* filled in already */
        } else if (law->kind == HS_SHEAR_STRENGTH) {
            /* T_max = τ0 π a² */
            double a =
                hs_cube_root(cubed_radius(load[i], radius[i], modulus, law->work_of_adhesion));
            friction[i] = law->shear_strength * PI * (a * a) / load[i];
        } else if (law->kind == HS_SLID_TABLE) {
            friction[i] = in_table(law, loaded->slid_distance[i]);
        } else if (law->kind == HS_POWER_LAW && law->depends_on == HS_ON_OWN_LOAD) {
            friction[i] = law->coefficient * pow(load[i] / law->reference_load, law->exponent);
        } else {
            friction[i] = total;
        }
        friction[i] = hs_bound_friction(friction[i]);
    }
    return HS_OK;
}

int hs_lost_volumes(const hs_wear *wear, int64_t count, const double *load, const double *slid,
                    const double *energy, double *volume) {
    if (wear->kind == HS_CALLERS_WEAR)
        return wear->function(wear->user, count, load, slid, energy, volume) ? HS_LAW_FAILED
                                                                             : HS_OK;
    for (int64_t i = 0; i < count; ++i)
        volume[i] = wear->kind == HS_ARCHARD ? wear->rate * load[i] * slid[i]
                                             : wear->rate * hs_max(energy[i], 0.0);
    return HS_OK;
}

/* Approaches δ and with them a² = R δ go straight with the distance slid, so that the load goes
 * with a³:
 *
 *     ∫ a³ ds / s = 2/5 (q⁴ + q³p + q²p² + qp³ + p⁴)/(q + p)    with √a² from p to q. */
static double quartic(double p, double q) {
    double pp = p * p, qq = q * q, pq = p * q;
    return (qq * qq + pp * pp) + pq * (qq + pq + pp);
}

double hs_mean_load(double first, double last, double weight) {
    double p = sqrt(hs_max(first, 0.0)), q = sqrt(hs_max(last, 0.0));
    return p + q > 0.0 ? weight * 0.4 * quartic(p, q) / (p + q) : 0.0;
}

/* Truncated: a cap of volume V has the height √(V/(πR)). Blunted: dh = 2 dV/(πa²) and d(ln R) = 4R
 * dV/(πa⁴); volumes are lost as the load goes, and so the means over them are those of a/a³ and of
 * 1/(a a³) over the distance. So a summit that comes into contact while it slides, where both rates
 * are infinite, is blunted as far in one chord as in many. What has waited takes shape at once, at
 * the load that there is: a³ goes with R, R^(1/3) with the volume. */
double hs_worn_summit(const hs_wear *wear, double first, double last, double meanwhile,
                      double shaped, double waiting, double volume, double *height,
                      double *radius) {
    if (wear->shape == HS_TRUNCATED) {
        /* predicted volumes that were too large are taken back, as far as any waits */
        double area = PI * *radius, taken = hs_max(waiting + volume, -shaped);
        *height -= sqrt((shaped + taken) / area) - sqrt(shaped / area);
        return taken;
    }
    double p = sqrt(hs_max(first, 0.0)), q = sqrt(hs_max(last, 0.0)), whole = quartic(p, q),
           grown = 1.0;
    /* a cap over the contact circle holds πa⁴/(4R); a larger volume waits for a larger contact */
    double part = p > 0.0 ? 4.0 * *radius * waiting / (PI * first * first) : HUGE_VAL;
    if (-0.5 < part && part <= 1.0) {
        *height -= 2.0 * waiting / (PI * first * (1.0 + part / 3.0));
        grown = (1.0 + part / 3.0) * (1.0 + part / 3.0) * (1.0 + part / 3.0);
    } else {
        waiting = 0.0;
    }
    *height -= 2.0 * volume / PI * (5.0 / 3.0) * (q * q + p * q + p * p) / whole;
    /* e^x to third order, for any volume of a step */
    double x = 4.0 * volume / PI * 5.0 / whole * meanwhile;
    *radius *= grown * (1.0 + x * (1.0 + x * (0.5 + x / 6.0)));
    return waiting + volume;
}

/* Asperities that yield on first loading.
 *
 * A law says which load N and contact radius a a virgin summit of radius R has at an approach δ.
 * What is left elastic there is the Hertz contact through that state (Tabor 1948): radius R' = 4E*
 * a³/(3N), approach δ' = a²/R', so that the summit is lowered by δ - δ'. Up to the largest approach
 * of all, unloading, reloading and everything tangential are those of these summits. Since all ride
 * on one rigid flat, the load at an approach beyond it does not depend on the history. */

/* between which approaches over the critical one Kogut and Etsion fit a power each, and from where
 * all is plastic; the second power is left a tenth before that */
#define FIRST_END 6.0
#define SECOND_END 100.0
#define PLASTIC 110.0
/* departure of Jackson and Green's law from Hertz's */
#define DEPARTURE 1.9
/* Ratio of approaches of adjacent nodes, between which the work of yielding is integrated with
 * three points; chosen. */
#define FINE 1.25
#define MAX_ROOT_STEPS 200

typedef struct state {
    double load; /* over the critical load */
    double area; /* over the critical area */
} state;

/* The power through two points, at a place between them. */
static double power_between(double x, double low, double high, double at_low, double at_high) {
    return at_low * pow(x / low, log(at_high / at_low) / log(high / low));
}

static state kogut_etsion(double x, double most_pressure) {
    state found;
    double load_6 = 1.40 * pow(FIRST_END, 1.263), area_6 = 0.94 * pow(FIRST_END, 1.146);
    if (x < FIRST_END) {
        found.load = power_between(x, 1.0, FIRST_END, 1.0, load_6);
        found.area = power_between(x, 1.0, FIRST_END, 1.0, area_6);
    } else if (x < SECOND_END) {
        found.load = 1.40 * pow(x, 1.263);
        found.area = 0.94 * pow(x, 1.146);
    } else if (x < PLASTIC) {
        found.area =
            power_between(x, SECOND_END, PLASTIC, 0.94 * pow(SECOND_END, 1.146), 2.0 * PLASTIC);
        found.load = power_between(x, SECOND_END, PLASTIC, 1.40 * pow(SECOND_END, 1.263),
                                   2.0 * PLASTIC * most_pressure);
    } else {
        found.area = 2.0 * x;
        found.load = found.area * most_pressure;
    }
    found.load = hs_min(found.load, found.area * most_pressure);
    return found;
}

/* Printed load over that at the onset, of a contact area over that there. */
static double empirical_load(double x, double area, double critical_strain, double most) {
    /* H_G over the yield stress, and four times it over what the mean pressure is at the onset */
    double hardness = 2.84 * (1.0 - exp(-0.82 * pow(sqrt(critical_strain * area), -0.7)));
    return exp(-0.25 * pow(x, 5.0 / 12.0)) * x * sqrt(x) +
           most * hardness * (1.0 - exp(-0.04 * pow(x, 5.0 / 9.0))) * x;
}

/* `jump` is the ratio of the elastic to the printed load at the departure. */
static state jackson_green(double x, double critical_strain, double exponent, double most,
                           double jump) {
    double part = x / DEPARTURE, area = x * pow(part, exponent);
    double load = empirical_load(x, area, critical_strain, most);
    return HS_MADE(state){load * (1.0 + (jump - 1.0) / part), area};
}

int hs_first_loading(const hs_yielding *law, double modulus, int64_t count, const double *approach,
                     const double *radius, double *load, double *contact_radius) {
    if (law->kind == HS_CALLERS_YIELDING)
        return law->function(law->user, count, approach, radius, load, contact_radius)
                   ? HS_LAW_FAILED
                   : HS_OK;
    double strain = law->critical_strain;
    /* N/A at the onset, of which the critical load is one on the critical area */
    double pressure = 4.0 / 3.0 * modulus * sqrt(strain) / PI, exponent = 0.0, most = 0.0,
           jump = 0.0;
    if (law->kind == HS_JACKSON_GREEN) {
        exponent = 0.14 * exp(23.0 * law->yield_strain);
        /* 4 H_G/(C S_y), with C S_y = 3/2 of that mean pressure */
        most = 8.0 / 3.0 * law->yield_strain * modulus / pressure;
        jump = DEPARTURE * sqrt(DEPARTURE) / empirical_load(DEPARTURE, DEPARTURE, strain, most);
    }
    for (int64_t i = 0; i < count; ++i) {
        double x = approach[i] / (strain * radius[i]), critical = strain * radius[i];
        double area = radius[i] * critical,
               critical_load = 4.0 / 3.0 * modulus * sqrt(area) * critical;
        state here = {x * sqrt(x), x};
        if (law->kind == HS_THORNTON && x > 1.0) here.load = 1.0 + 1.5 * (x - 1.0);
        if (law->kind == HS_KOGUT_ETSION && x > 1.0)
            here = kogut_etsion(x, law->hardness / pressure);
        if (law->kind == HS_JACKSON_GREEN && x > DEPARTURE)
            here = jackson_green(x, strain, exponent, most, jump);
        load[i] = here.load * critical_load;
        contact_radius[i] = sqrt(here.area * area);
    }
    return HS_OK;
}

/* Height of the flat at an approach [m]. */
static double flat_at(const hs_contact *contact, double d) {
    return contact->datum - d * contact->units.length;
}

/* Approach of a virgin summit beyond which it yields, or yields on [m]. */
static double elastic_to(const hs_yielding *law, const hs_evolved *evolved, int64_t i) {
    return hs_max(law->critical_approach[i], evolved->yielded_to[i]);
}

double hs_yields_at(const hs_line *memory, const hs_yielding *law, int64_t asperity) {
    const hs_evolved *evolved = memory->evolved;
    double flat = evolved->virgin_height[asperity] - elastic_to(law, evolved, asperity);
    return (memory->contact->datum - flat) / memory->contact->units.length;
}

double hs_next_yield(const hs_line *memory, const hs_yielding *law) {
    double next = HUGE_VAL;
    for (int64_t i = 0; i < memory->contact->count; ++i)
        next = hs_min(next, hs_yields_at(memory, law, i));
    return next;
}

/* Summits that yield on a path to an approach, with their approaches and states. */
typedef struct yielding_summits {
    int64_t count;
    int64_t *which;
    double *approach, *radius, *load, *contact_radius;
} yielding_summits;

static int gather(yielding_summits *found, int64_t most) {
    size_t n = (size_t)(most > 0 ? most : 1);
    found->count = 0;
    found->which = (int64_t *)malloc(5 * n * sizeof(double));
    found->approach = (double *)(found->which + n);
    found->radius = found->approach + n;
    found->load = found->radius + n;
    found->contact_radius = found->load + n;
    return found->which ? HS_OK : HS_OUT_OF_MEMORY;
}

/* Find the summits that yield on a path to an approach; adds the loads of the others there [N]. */
static void find_yielding(const hs_line *memory, const hs_evolution *evolution, double d,
                          yielding_summits *found, double *elastic) {
    const hs_evolved *evolved = memory->evolved;
    double flat = flat_at(memory->contact, d), modulus = 4.0 / 3.0 * evolution->contact_modulus;
    found->count = 0;
    for (int64_t i = 0; i < memory->contact->count; ++i) {
        double approach = evolved->virgin_height[i] - flat, own = evolved->summit_height[i] - flat;
        if (approach > elastic_to(&evolution->yielding, evolved, i)) {
            found->which[found->count] = i;
            found->approach[found->count] = approach;
            found->radius[found->count++] = evolved->virgin_radius[i];
        } else if (elastic && own > 0.0) {
            *elastic += modulus * sqrt(evolved->summit_radius[i] * own) * own;
        }
    }
}

static int on_first_loading(const hs_evolution *evolution, yielding_summits *found) {
    return found->count == 0 ? (int)HS_OK
                             : hs_first_loading(&evolution->yielding, evolution->contact_modulus,
                                                found->count, found->approach, found->radius,
                                                found->load, found->contact_radius);
}

/* Load of all asperities at an approach at which some of them may yield, dimensionless. */
static int load_at(const hs_line *memory, const hs_evolution *evolution, double d,
                   yielding_summits *place, double *load) {
    *load = 0.0;
    find_yielding(memory, evolution, d, place, load);
    int status = on_first_loading(evolution, place);
    for (int64_t k = 0; k < place->count && status == HS_OK; ++k) *load += place->load[k];
    *load /= memory->contact->units.load;
    return status;
}

int hs_yielding_load(const hs_line *memory, const hs_evolution *evolution, double d, double *load) {
    yielding_summits place;
    int status = gather(&place, memory->contact->count);
    if (status == HS_OK) status = load_at(memory, evolution, d, &place, load);
    free(place.which);
    return status;
}

int hs_yielding_approach(const hs_line *memory, const hs_evolution *evolution, double load,
                         double *approach) {
    double low = hs_max(hs_approach_at_load(memory, load), memory->approach);
    double touch = memory->contact->sorted_gap[0], step = 0.25 * (low - touch);
    hs_bracket root = {low, low, 0.0, 0.0, 0};
    yielding_summits place;
    int status = gather(&place, memory->contact->count);
    if (status == HS_OK) status = load_at(memory, evolution, low, &place, &root.at_low);
    root.at_low -= load;
    root.at_high = root.at_low;
    for (int turn = 0; turn < MAX_ROOT_STEPS && status == HS_OK && root.at_high < 0.0;
         ++turn, step *= 2.0) {
        root.low = root.high;
        root.at_low = root.at_high;
        root.high = root.low + step;
        status = load_at(memory, evolution, root.high, &place, &root.at_high);
        root.at_high -= load;
    }
    if (status == HS_OK && !(root.at_high >= 0.0)) status = HS_LAW_FAILED;
    for (int turn = 0; turn < MAX_ROOT_STEPS && status == HS_OK &&
                       root.high - root.low > 4.0 * DBL_EPSILON * root.high;
         ++turn) {
        double missing, next = root.high - root.at_high * ((root.high - root.low) /
                                                           (root.at_high - root.at_low));
        if (!(root.low < next && next < root.high)) next = 0.5 * (root.low + root.high);
        if (next == root.low || next == root.high) break;
        status = load_at(memory, evolution, next, &place, &missing);
        missing -= load;
        hs_narrow(&root, next, missing, missing >= 0.0);
        if (missing == 0.0) break;
    }
    free(place.which);
    *approach = root.high;
    return status;
}

/* Work of the load of summits between two approaches, less elastic energies at the ends; added to
 * their energies. */
static int take_energy(const hs_evolution *evolution, hs_evolved *evolved,
                       const yielding_summits *at) {
    const double node = 0.7745966692414834; /* √0.6 */
    int64_t nodes = 0, used = 0;
    yielding_summits along;
    for (int64_t k = 0; k < at->count; ++k) {
        int64_t i = at->which[k];
        nodes +=
            3 * (2 + (int64_t)(log(at->approach[k] / elastic_to(&evolution->yielding, evolved, i)) /
                               log(FINE)));
    }
    if (gather(&along, nodes) != HS_OK) return HS_OUT_OF_MEMORY;
    for (int pass = 0; pass < 2; ++pass) {
        used = 0;
        for (int64_t k = 0; k < at->count; ++k) {
            int64_t i = at->which[k];
            double start = elastic_to(&evolution->yielding, evolved, i), low = start, work = 0.0;
            while (low < at->approach[k]) {
                double high = low * FINE < at->approach[k] ? low * FINE : at->approach[k];
                double middle = 0.5 * (low + high), half = 0.5 * (high - low);
                for (int n = -1; n <= 1; ++n, ++used) {
                    along.approach[used] = middle + n * node * half;
                    along.radius[used] = at->radius[k];
                    if (pass) work += half * (n ? 5.0 : 8.0) / 9.0 * along.load[used];
                }
                low = high;
            }
            if (!pass) continue;
            /* a Hertz contact of approach δ' holds 2/5 N δ' */
            double before = evolved->yielding_load[i], radius = evolved->summit_radius[i];
            double depth = start - (evolved->virgin_height[i] - evolved->summit_height[i]);
            if (before == 0.0)
                before = 4.0 / 3.0 * evolution->contact_modulus * sqrt(radius * depth) * depth;
            double held = 0.75 * at->load[k] / (evolution->contact_modulus * at->contact_radius[k]);
            evolved->yielding_energy[i] +=
                hs_max(work - 0.4 * (at->load[k] * held - before * depth), 0.0);
        }
        along.count = used;
        int status = pass ? (int)HS_OK : on_first_loading(evolution, &along);
        if (status != HS_OK) {
            free(along.which);
            return status;
        }
    }
    free(along.which);
    return HS_OK;
}

int hs_yield_to(hs_line *memory, const hs_evolution *evolution, double d, uint8_t *changed) {
    hs_evolved *evolved = memory->evolved;
    yielding_summits at;
    int status = gather(&at, memory->contact->count);
    if (status != HS_OK) return status;
    if (changed) memset(changed, 0, (size_t)memory->contact->count);
    find_yielding(memory, evolution, d, &at, NULL);
    status = on_first_loading(evolution, &at);
    if (status == HS_OK) status = take_energy(evolution, evolved, &at);
    for (int64_t k = 0; k < at.count && status == HS_OK; ++k) {
        int64_t i = at.which[k];
        double a = at.contact_radius[k],
               radius = 4.0 / 3.0 * evolution->contact_modulus * a * a * a / at.load[k];
        if (changed) changed[i] = 1;
        evolved->yielded_to[i] = at.approach[k];
        evolved->yielding_load[i] = at.load[k];
        evolved->summit_radius[i] = radius;
        evolved->summit_height[i] = evolved->virgin_height[i] - (at.approach[k] - a * a / radius);
    }
    hs_sum_yielded(evolved, memory->contact->count);
    free(at.which);
    return status;
}

int hs_flag_yielding(const hs_line *memory, const hs_evolution *evolution, double d,
                     uint8_t *which) {
    yielding_summits at;
    int status = gather(&at, memory->contact->count);
    if (status != HS_OK) return status;
    memset(which, 0, (size_t)memory->contact->count);
    find_yielding(memory, evolution, d, &at, NULL);
    for (int64_t k = 0; k < at.count; ++k) which[at.which[k]] = 1;
    free(at.which);
    return HS_OK;
}
