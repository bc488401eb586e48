/* The loop of `positioning_stage.py` in C: a stage that steps the memory of its contact itself.
 *
 * The library's `hs_step` comes by its address, so that nothing has to be linked. */
#include <math.h>

#include "historysim.h"

#define MASS 0.5
#define SAMPLE 1e-4
#define SUBSTEPS 10
#define PROPORTIONAL 1e6
#define INTEGRAL 2e10
#define DERIVATIVE 1e3

typedef int (*step_function)(hs_state *memory, int normal_control, double normal_target,
                             int tangential_control, double tangential_target,
                             const hs_drive *drive, hs_refusal *refusal);

static double clipped(double x) { return x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x; }

static double wanted(double seconds) {
    double phase = fmod(seconds, 1.0);
    return 15e-9 * (clipped((phase - 0.2) / 0.02) - clipped((phase - 0.6) / 0.02));
}

/* Fill in place, force of the contact and of the motor (3, samples), and the work and kinetic
 * energy at the end. */
HS_API int controlled(step_function step, hs_state *memory, const hs_drive *drive, int64_t samples,
                      double *record, double *energy) {
    const hs_units *units = &memory->line.contact->units;
    double pause = SAMPLE / SUBSTEPS, place = 0.0, velocity = 0.0, integral = 0.0, work = 0.0,
           before = wanted(0.0);
    double motor = 0.0;
    int status = step(memory, HS_DISPLACED, memory->line.approach * units->length, HS_DISPLACED,
                      0.0, drive, 0);
    for (int64_t sample = 0; sample < samples && status == HS_OK; ++sample) {
        double error = wanted((double)sample * SAMPLE) - place;
        integral += error * SAMPLE;
        motor = PROPORTIONAL * error + INTEGRAL * integral + DERIVATIVE * (error - before) / SAMPLE;
        before = error;
        for (int k = 0; k < SUBSTEPS && status == HS_OK; ++k) {
            velocity += pause / MASS * (motor - memory->line.tangential_load * units->load);
            double way = pause * velocity;
            place += way;
            work += motor * way;
            status = step(memory, HS_DISPLACED, NAN, HS_DISPLACED, place, drive, 0);
        }
        record[sample] = place;
        record[samples + sample] = memory->line.tangential_load * units->load;
        record[2 * samples + sample] = motor;
    }
    velocity += 0.5 * pause / MASS * (motor - memory->line.tangential_load * units->load);
    energy[0] = work;
    energy[1] = 0.5 * MASS * (velocity * velocity);
    return status;
}
