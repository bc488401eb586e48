"""Loops simulated with known parameters, as an instrument with the resolution and stiffness of UNAT would measure them.

Run as a script it fits many of them, and counts how often the intervals of 95 % hold the truth::

    python tests/synthetic.py 200
"""

import sys

import attrs
import numpy as np

import historysim as hs
from historysim.measured import fitting, observation
from historysim.measured.measurement import Measurement

# UNAT: 1 nm, 6 µN, 334 mN/µm
DISPLACEMENT_NOISE, LOAD_NOISE, STIFFNESS = 1e-9, 6e-6, 334e3
PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
TRUTHS = {
    "ball": {"friction": 0.2, "lateral_stiffness": STIFFNESS},
    "ball, shear modulus": {"friction": 0.2, "lateral_stiffness": STIFFNESS, "shear_modulus": PAIR.shear_modulus},
    "rough": {"friction": 0.2, "lateral_stiffness": STIFFNESS, "height_scale": 1.0},
}


def model(kind):
    """Make a function of the parameters."""
    heights, radii = (np.zeros(1), 2.5e-3) if kind.startswith("ball") else (rough_heights(), 20e-6)

    def made(values):
        pair = PAIR
        if "shear_modulus" in values:
            modulus = values["shear_modulus"]
            pair = hs.MaterialPair.from_moduli(contact_modulus=PAIR.contact_modulus, shear_modulus=modulus)
        scaled = heights.mean() + values.get("height_scale", 1.0) * (heights - heights.mean())
        return hs.Ensemble(pair, scaled, radii, values["friction"]), hs.Instrument(values["lateral_stiffness"])

    return made


def rough_heights():
    return np.random.default_rng(3).normal(0.0, 60e-9, 100)


def measured(kind, seed, amplitude=200e-9, loads=(50e-3, 90e-3), loops=2, rate=10.0, speed=25e-9):
    """Simulate a record: triangular loops at each load, 10 Hz, and Gaussian noise on both channels."""
    quarter = amplitude / speed
    time = np.arange(round(len(loads) * loops * 4 * quarter * rate) + 1) / rate
    phase = (time / quarter) % 4
    displacement = amplitude * np.select([phase < 1, phase < 3], [phase, 2 - phase], phase - 4)
    level = np.minimum((time // (4 * quarter * loops)).astype(int), len(loads) - 1)
    record = Measurement(
        time,
        {"normal_load": np.array(loads)[level], "tangential_displacement": displacement},
        {"tangential_load": np.zeros(time.size)},
        {"tangential_displacement": 20e-9},
    )
    exact = observation.observe(record, displacement_noise=0.0, load_noise=1.0)
    load = observation.passed(*model(kind)(TRUTHS[kind]), exact).tangential_load
    random = np.random.default_rng(seed)
    return attrs.evolve(
        record,
        channels={
            **record.channels,
            "tangential_displacement": displacement + random.normal(0.0, DISPLACEMENT_NOISE, time.size),
        },
        response={"tangential_load": load + random.normal(0.0, LOAD_NOISE, time.size)},
    )


def fitted(kind, seed):
    """Fit a simulated record, from a start 30 % off."""
    start = {name: 1.3 * value for name, value in TRUTHS[kind].items()}
    return fitting.fit_parameters(model(kind), start, observation.observe(measured(kind, seed)))


def held(kind, seed):
    """Say of each parameter whether its interval holds the truth."""
    return {
        parameter.name: parameter.low <= TRUTHS[kind][parameter.name] <= parameter.high
        for parameter in fitted(kind, seed).parameters
    }


def main(count):
    """Count how often the truth is held."""
    for kind, truth in TRUTHS.items():
        found = [held(kind, seed) for seed in range(count)]
        shares = ", ".join(f"{name} {np.mean([one[name] for one in found]):.1%}" for name in truth)
        print(f"{kind}: {shares} of {count} intervals of 95 % hold the truth", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
