"""A stage of 0.5 kg on a rough contact of 1 000 asperities, placed by a PID controller at 10 kHz, for one second.

    python tests/scripts/positioning_stage.py

The controller moves the stage by 15 nm and back, as far as the contact slips but does not slide. Between its samples
the motion is integrated by the leap-frog method, whose one force per step is that of the contact after it has been
carried to the new place: each place is one that the stage was at. A method that tries places, such as an implicit one
or one with stages, has to `save` before it tries and to `restore`: a trial must not be remembered.
"""

import time
from typing import NamedTuple

import numpy as np

import historysim as hs

MASS = 0.5
NORMAL_LOAD = 2.0
SAMPLE, SUBSTEPS = 1e-4, 10
PROPORTIONAL, INTEGRAL, DERIVATIVE = 1e6, 2e10, 1e3
"""Of the controller [N/m], [N/(m s)], [N s/m]."""


class Motion(NamedTuple):
    """Place [m], force of the contact and of the motor [N] at each sample, and the energies [J] at the end."""

    place: np.ndarray
    contact_force: np.ndarray
    motor_force: np.ndarray
    work: float
    kinetic: float
    stored: float
    dissipated: float


def rough_contact(count=1000):
    """Return a ceramic contact of a rough and a flat face."""
    rng = np.random.default_rng(7)
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    return hs.Ensemble(pair, rng.normal(0.0, 50e-9, count), rng.uniform(20e-6, 60e-6, count), friction=0.2)


def wanted(seconds):
    """Return where the stage shall be [m]: 15 nm away in the second and third fifth of each second, in 20 ms."""
    phase = seconds % 1.0
    return 15e-9 * (np.clip((phase - 0.2) / 0.02, 0, 1) - np.clip((phase - 0.6) / 0.02, 0, 1))


def controlled(ensemble, duration=1.0):
    """Return the motion of the stage on a contact."""
    stepper = ensemble.stepper(ensemble.advance(ensemble.initial_state(), normal_load=NORMAL_LOAD))
    # the approach is held from now on: at a constant load it does not change
    stepper.step(normal_displacement=stepper.approach, tangential_displacement=0.0)
    samples, pause = round(duration / SAMPLE), SAMPLE / SUBSTEPS
    place = velocity = integral = work = 0.0
    before = wanted(0.0)
    record = np.empty((3, samples))
    for sample in range(samples):
        error = wanted(sample * SAMPLE) - place
        integral += error * SAMPLE
        motor = PROPORTIONAL * error + INTEGRAL * integral + DERIVATIVE * (error - before) / SAMPLE
        before = error
        for _ in range(SUBSTEPS):
            velocity += pause / MASS * (motor - stepper.tangential_load)
            step = pause * velocity
            place += step
            work += motor * step
            stepper.step(tangential_displacement=place)
        record[:, sample] = place, stepper.tangential_load, motor
    state = stepper.save()
    # the velocity is that of half a step before
    velocity += 0.5 * pause / MASS * (motor - state.tangential_load)
    return Motion(*record, work, 0.5 * MASS * velocity**2, state.stored_energy, state.dissipated_energy)


def main():
    ensemble = rough_contact()
    controlled(ensemble, 2 * SAMPLE)  # compiles, where that has not been done
    start = time.perf_counter()
    motion = controlled(ensemble)
    seconds = time.perf_counter() - start
    steps = motion.place.size * SUBSTEPS
    at = np.arange(motion.place.size) * SAMPLE
    error = np.abs(motion.place - wanted(at))
    kept = motion.kinetic + motion.stored + motion.dissipated
    print(f"{steps} steps of {len(ensemble)} asperities in {seconds:.2f} s: {seconds / steps * 1e6:.1f} µs each")
    print(f"largest error {error.max() * 1e9:.2f} nm, at the end {error[-1] * 1e9:.3f} nm")
    print(f"largest force of the contact {np.abs(motion.contact_force).max():.3f} N, of {0.2 * NORMAL_LOAD:.1f} N")
    print(f"work of the motor {motion.work:.6e} J, kinetic, stored and dissipated {kept:.6e} J")


if __name__ == "__main__":
    main()
