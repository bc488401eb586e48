/* A contact as a uniaxial material of a finite element code: trial, commit, revert, as in OpenSees'
 * UniaxialMaterial.
 *
 * A frame of stiffness K in parallel to the contact is pushed and pulled by Newton's method with
 * the exact tangent. Prints for each load step the displacement [m], the force of the contact [N],
 * and how many trials it took. */
#include <math.h>
#include <stdio.h>

#include "historysim.h"

/* Trials are made from the committed memory, however many there are: what is tried is not
 * remembered. */
typedef struct material {
    hs_state *committed;
    hs_state *trial;
    hs_drive drive;
} material;

static double stress_of(const hs_state *memory) {
    return memory->line.tangential_load * memory->line.contact->units.load;
}

static int set_trial_strain(material *its, double displacement) {
    hs_state *made =
        hs_advance(its->committed, HS_LOAD, NAN, HS_DISPLACED, displacement, &its->drive, NULL);
    if (!made) return -1;
    hs_state_free(its->trial);
    its->trial = made;
    return 0;
}
static double get_stress(const material *its) { return stress_of(its->trial); }
static double get_tangent(const material *its) {
    const hs_contact *contact = its->committed->line.contact;
    return hs_slopes_of(its->trial, its->committed->line.approach * contact->units.length)
        .tangential;
}
static int commit_state(material *its) {
    hs_state *kept = hs_state_copy(its->trial);
    if (!kept) return -1;
    hs_state_free(its->committed);
    its->committed = kept;
    return 0;
}
static int revert_to_last_commit(material *its) {
    hs_state *back = hs_state_copy(its->committed);
    if (!back) return -1;
    hs_state_free(its->trial);
    its->trial = back;
    return 0;
}

#define FRAME 2e6 /* [N/m] */
#define TRIALS 60

int main(void) {
    /* a ball of silicon of 1 mm on glass, about; pressed with 50 mN */
    const double height = 0.0, radius = 1e-3, friction = 0.2,
                 forces[] = {12e-3, 45e-3, -10e-3, 9e-3, -45e-3, 45e-3, 0.0};
    hs_contact *contact = hs_contact_new(1, &height, &radius, NULL, NULL, 50e9, 0.6);
    material its = {hs_state_new(contact, &friction), NULL, {1e-6, {0.0, 0.0}, 0, 1, NULL, NULL}};
    double place = 0.0;
    int status = hs_step(its.committed, HS_LOAD, 50e-3, HS_DISPLACED, 0.0, &its.drive, NULL);
    if (status != HS_OK || revert_to_last_commit(&its) != 0) return 2;
    for (size_t step = 0; step < sizeof forces / sizeof *forces; ++step) {
        double begin = place, off = 1.0;
        int trials = 0, turned = 0;
        for (; trials < TRIALS && fabs(off) > 1e-14; ++trials) {
            if (set_trial_strain(&its, place) != 0) return 2;
            off = forces[step] - FRAME * place - get_stress(&its);
            if (fabs(off) <= 1e-14) continue;
            place += off / (FRAME + get_tangent(&its));
            if (trials == 3 && !turned) {
                /* a step that is given up: the material goes back, as if nothing had been tried */
                if (revert_to_last_commit(&its) != 0) return 2;
                place = begin;
                turned = 1;
            }
        }
        if (fabs(off) > 1e-14 || commit_state(&its) != 0) return 1;
        printf("%.17g %.17g %d\n", place, stress_of(its.committed), trials);
    }
    hs_state_free(its.committed);
    hs_state_free(its.trial);
    hs_contact_free(contact);
    return 0;
}
