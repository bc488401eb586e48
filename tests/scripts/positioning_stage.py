"""A stage of 0.5 kg on a rough contact of 1 000 asperities, placed by a PID controller at 10 kHz, for one second.

    PYTHONPATH=tests/support python tests/scripts/positioning_stage.py

The controller moves the stage by 15 nm and back, as far as the contact slips but does not slide.
Between its samples the motion is integrated by the leap-frog method, whose one force per step is
that of the contact after it has been carried to the new place: each place is one that the stage was
at. A method that tries places, such as an implicit one or one with stages, has to `save` before it
tries and to `restore`: a trial must not be remembered.

`positioning_stage.c` has the same loop in C, which takes the library's step by its address: the
same bits in less time.
"""

import subprocess
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from c_core import SUPPORT, hatch_build
from cffi import FFI

import historysim as hs
from historysim.basics.compiler import SAME_BITS
from historysim.basics.library import ffi, lib

MASS = 0.5
NORMAL_LOAD = 2.0
SAMPLE, SUBSTEPS = 1e-4, 10
PROPORTIONAL, INTEGRAL, DERIVATIVE = 1e6, 2e10, 1e3  # of the controller [N/m], [N/(m s)], [N s/m]


class Motion(NamedTuple):
    """Place, force of the contact and of the motor at each sample; energies at the end [J]."""

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
    return hs.Ensemble(
        pair, rng.normal(0.0, 50e-9, count), rng.uniform(20e-6, 60e-6, count), friction=0.2
    )


def wanted(seconds):
    """Return where the stage shall be [m]: 15 nm away in the second and third fifth of each second, in 20 ms."""
    phase = seconds % 1.0
    return 15e-9 * (np.clip((phase - 0.2) / 0.02, 0, 1) - np.clip((phase - 0.6) / 0.02, 0, 1))


class Pid:
    """A controller that follows `wanted`; it remembers the error before, and the integral."""

    def __init__(self):
        self.integral, self.before = 0.0, wanted(0.0)

    def __call__(self, time, place):
        """Return the force of the motor [N]."""
        error = wanted(time) - place
        self.integral += error * SAMPLE
        force = (
            PROPORTIONAL * error
            + INTEGRAL * self.integral
            + DERIVATIVE * (error - self.before) / SAMPLE
        )
        self.before = error
        return force


def pressed(ensemble):
    """Return the contact under its load; the approach is held from now on: at a constant load it does not change."""
    state = ensemble.advance(ensemble.initial_state(), normal_load=NORMAL_LOAD)
    return ensemble.advance(state, normal_displacement=state.approach, tangential_displacement=0.0)


def controlled(ensemble, duration=1.0):
    """Return the motion of the stage on a contact: the loop of a user's own program."""
    stepper, controller = ensemble.stepper(pressed(ensemble)), Pid()
    place = velocity = work = motor = 0.0
    record, time_step = np.empty((3, round(duration / SAMPLE))), SAMPLE / SUBSTEPS
    for sample in range(record.shape[1]):
        motor = controller(sample * SAMPLE, place)
        for _ in range(SUBSTEPS):
            velocity += time_step / MASS * (motor - stepper.tangential_load)
            step = time_step * velocity
            place += step
            work += motor * step
            stepper.step(tangential_displacement=place)
        record[:, sample] = place, stepper.tangential_load, motor
    # the velocity lags by half a step
    velocity += 0.5 * time_step / MASS * (motor - stepper.tangential_load)
    state = stepper.save()
    return Motion(
        *record, work, 0.5 * MASS * velocity**2, state.stored_energy, state.dissipated_energy
    )


def controlled_in_c(ensemble, duration=1.0):
    """Return the same motion by the loop in C, and how long it took [s]."""
    own = FFI()
    own.cdef("int controlled(void *, void *, void *, int64_t, double *, double *);")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "stage.so")
        options = ["-O2", "-shared", "-fPIC", *SAME_BITS, f"-I{hs.get_include()}"]
        command = [
            *hatch_build.compiler(),
            *options,
            str(SUPPORT / "positioning_stage.c"),
            "-lm",
            "-o",
            str(library),
        ]
        subprocess.run(command, check=True)
        loop = own.dlopen(str(library)).controlled
    stepper = ensemble.stepper(ensemble.advance(ensemble.initial_state(), normal_load=NORMAL_LOAD))
    handed = ffi.addressof(lib, "hs_step"), stepper.memory, stepper.drive
    addresses = [own.cast("void *", int(ffi.cast("intptr_t", each))) for each in handed]
    record, energy = np.empty((3, round(duration / SAMPLE))), np.empty(2)
    arrays = own.from_buffer("double[]", record), own.from_buffer("double[]", energy)
    start = time.perf_counter()
    status = loop(*addresses, record.shape[1], *arrays)
    seconds = time.perf_counter() - start
    assert status == lib.HS_OK
    state = stepper.save()
    return Motion(*record, *energy.tolist(), state.stored_energy, state.dissipated_energy), seconds


def main():
    ensemble = rough_contact()
    start = time.perf_counter()
    motion = controlled(ensemble)
    seconds = time.perf_counter() - start
    steps = motion.place.size * SUBSTEPS
    print(
        f"{steps} steps of {len(ensemble)} asperities in {seconds:.2f} s: {seconds / steps * 1e6:.1f} µs each"
    )
    if hatch_build.compiler():
        same, seconds = controlled_in_c(ensemble)
        alike = all(np.array_equal(*pair) for pair in zip(motion, same, strict=True))
        print(
            f"in C {seconds / steps * 1e6:.1f} µs each: {'the same bits' if alike else 'other bits'}"
        )
    at = np.arange(motion.place.size) * SAMPLE
    error = np.abs(motion.place - wanted(at))
    kept = motion.kinetic + motion.stored + motion.dissipated
    print(f"largest error {error.max() * 1e9:.2f} nm, at the end {error[-1] * 1e9:.3f} nm")
    print(
        f"largest force of the contact {np.abs(motion.contact_force).max():.3f} N, of {0.2 * NORMAL_LOAD:.1f} N"
    )
    print(f"work of the motor {motion.work:.6e} J, kinetic, stored and dissipated {kept:.6e} J")


if __name__ == "__main__":
    main()
