/* Laws of friction and wear: coefficients of loaded asperities, volumes that they lose, and the summits that are left.
 */

#include "internal.h"

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
    if (law->kind == HS_CALLERS_LAW) return law->function(law->user, loaded, friction) ? HS_LAW_FAILED : HS_OK;
    if (law->kind == HS_POWER_LAW && law->depends_on == HS_ON_TOTAL_LOAD)
        total *= pow(loaded->total_normal_load / law->reference_load, law->exponent);
    for (int64_t i = 0; i < loaded->count; ++i) {
        if (law->kind == HS_SHEAR_STRENGTH) {
            /* T_max = τ0 π a² */
            double a = hs_cube_root(cubed_radius(load[i], radius[i], modulus, law->work_of_adhesion));
            friction[i] = law->shear_strength * PI * (a * a) / load[i];
        } else if (law->kind == HS_SHIFTED_LOAD) {
            friction[i] = law->coefficient * (1.0 + 2.0 * PI * law->work_of_adhesion * radius[i] / load[i]);
        } else if (law->kind == HS_SLID_TABLE) {
            friction[i] = in_table(law, loaded->slid_distance[i]);
        } else if (law->kind == HS_POWER_LAW && law->depends_on == HS_ON_OWN_LOAD) {
            friction[i] = law->coefficient * pow(load[i] / law->reference_load, law->exponent);
        } else {
            friction[i] = total;
        }
    }
    return HS_OK;
}

int hs_lost_volumes(const hs_wear *wear, int64_t count, const double *load, const double *slid, const double *energy,
                    double *volume) {
    if (wear->kind == HS_CALLERS_WEAR)
        return wear->function(wear->user, count, load, slid, energy, volume) ? HS_LAW_FAILED : HS_OK;
    for (int64_t i = 0; i < count; ++i)
        volume[i] = wear->kind == HS_ARCHARD ? wear->rate * load[i] * slid[i] : wear->rate * hs_most(energy[i], 0.0);
    return HS_OK;
}

/* Approaches δ and with them a² = R δ go straight with the distance slid, so that the load goes with a³:
 *
 *     ∫ a³ ds / s = 2/5 (q⁴ + q³p + q²p² + qp³ + p⁴)/(q + p)    with √a² from p to q. */
static double quartic(double p, double q) {
    double pp = p * p, qq = q * q, pq = p * q;
    return (qq * qq + pp * pp) + pq * (qq + pq + pp);
}

double hs_mean_load(double first, double last, double weight) {
    double p = sqrt(hs_most(first, 0.0)), q = sqrt(hs_most(last, 0.0));
    return p + q > 0.0 ? weight * 0.4 * quartic(p, q) / (p + q) : 0.0;
}

/* Truncated: a cap of volume V has the height √(V/(πR)). Blunted: dh = 2 dV/(πa²) and d(ln R) = 4R dV/(πa⁴); volumes
 * are lost as the load goes, and so the means over them are those of a/a³ and of 1/(a a³) over the distance. So a
 * summit that comes into contact while it slides, where both rates are infinite, is blunted as far in one chord as in
 * many. What has waited takes shape at once, at the load that there is: a³ goes with R, R^(1/3) with the volume. */
double hs_worn_summit(const hs_wear *wear, double first, double last, double meanwhile, double shaped, double waiting,
                      double volume, double *height, double *radius) {
    if (wear->shape == HS_TRUNCATED) {
        /* what was foreseen too large is taken back, as far as there is any */
        double area = PI * *radius, taken = hs_most(waiting + volume, -shaped);
        *height -= sqrt((shaped + taken) / area) - sqrt(shaped / area);
        return taken;
    }
    double p = sqrt(hs_most(first, 0.0)), q = sqrt(hs_most(last, 0.0)), whole = quartic(p, q), grown = 1.0;
    /* a cap over the contact circle holds πa⁴/(4R); what is more than that waits for a larger contact */
    double part = p > 0.0 ? 4.0 * *radius * waiting / (PI * first * first) : HUGE_VAL;
    if (-0.5 < part && part <= 1.0) {
        *height -= 2.0 * waiting / (PI * first * (1.0 + part / 3.0));
        grown = (1.0 + part / 3.0) * (1.0 + part / 3.0) * (1.0 + part / 3.0);
    } else {
        waiting = 0.0;
    }
    *height -= 2.0 * volume / PI * (5.0 / 3.0) * (q * q + p * q + p * p) / whole;
    /* e^x within its third order, whatever a chord takes away */
    double x = 4.0 * volume / PI * 5.0 / whole * meanwhile;
    *radius *= grown * (1.0 + x * (1.0 + x * (0.5 + x / 6.0)));
    return waiting + volume;
}
