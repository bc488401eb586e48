"""Loops simulated with known parameters, as an instrument with the resolution and stiffness of UNAT would measure them.

`scripts/fit_intervals.py` fits many of them, and counts how often the intervals of 95 % hold the
truth.
"""

import attrs
import numpy as np

import historysim as hs
from historysim.measured import fitting
from historysim.measured.observation import observe
from historysim.measured.reduction import Measurement, turning_points
from historysim.measured.response import compute_response

# UNAT: 1 nm, 6 µN, 334 mN/µm
DISPLACEMENT_NOISE, LOAD_NOISE, STIFFNESS = 1e-9, 6e-6, 334e3
PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
TRUTHS = {
    "ball": {"friction": 0.2, "lateral_stiffness": STIFFNESS},
    "ball, shear modulus": {
        "friction": 0.2,
        "lateral_stiffness": STIFFNESS,
        "shear_modulus": PAIR.shear_modulus,
    },
    "rough": {"friction": 0.2, "lateral_stiffness": STIFFNESS, "height_scale": 1.0},
}


def model(kind):
    """Make a function of the parameters."""
    heights, radii = (np.zeros(1), 2.5e-3) if kind.startswith("ball") else (rough_heights(), 20e-6)

    def made(values):
        pair = PAIR
        if "shear_modulus" in values:
            modulus = values["shear_modulus"]
            pair = hs.MaterialPair.from_moduli(
                contact_modulus=PAIR.contact_modulus, shear_modulus=modulus
            )
        scaled = heights.mean() + values.get("height_scale", 1.0) * (heights - heights.mean())
        return hs.Ensemble(pair, scaled, radii, values["friction"]), hs.Instrument(
            values["lateral_stiffness"]
        )

    return made


def rough_heights():
    return np.random.default_rng(3).normal(0.0, 60e-9, 100)


def measured(
    kind,
    seed,
    amplitude=200e-9,
    loads=(50e-3, 90e-3),
    loops=2,
    rate=10.0,
    speed=25e-9,
    noise=1.0,
    sine=False,
):
    """Simulate triangular loops at each load, with Gaussian noise on both channels; 10 Hz hits where they turn.

    A sine has the mean speed of the triangle.
    """
    quarter = amplitude / speed
    end = len(loads) * loops * 4 * quarter
    sampled = np.arange(int(end * rate * (1 + 1e-12)) + 1) / rate
    # where it turns, and where the load has changed
    time = np.union1d(sampled, np.arange(1, 4 * loops * len(loads)) * quarter)
    phase = (time / quarter) % 4
    triangle = np.select([phase < 1, phase < 3], [phase, 2 - phase], phase - 4)
    displacement = amplitude * (np.sin(np.pi / 2 * phase) if sine else triangle)
    level = np.minimum((time // (4 * quarter * loops)).astype(int), len(loads) - 1)
    record = Measurement(
        time,
        {"normal_load": np.array(loads)[level], "tangential_displacement": displacement},
        {"tangential_load": np.zeros(time.size)},
        {"tangential_displacement": 20e-9},
    )
    exact = observe(record, displacement_noise=0.0, load_noise=1.0)
    load = compute_response(*model(kind)(TRUTHS[kind]), exact).tangential_load
    random = np.random.default_rng(seed)
    seen = np.isin(time, sampled)
    return attrs.evolve(
        record,
        time=sampled,
        channels={
            "normal_load": record["normal_load"][seen],
            "tangential_displacement": displacement[seen]
            + random.normal(0.0, noise * DISPLACEMENT_NOISE, sampled.size),
        },
        response={
            "tangential_load": load[seen] + random.normal(0.0, noise * LOAD_NOISE, sampled.size)
        },
    )


def fitted(kind, seed, **shape):
    """Fit a simulated record that turns between samples, from a start 30 % off."""
    start = {name: 1.3 * value for name, value in TRUTHS[kind].items()}
    record = measured(kind, seed, **{"rate": 10.03, **shape})
    return fitting.fit_parameters(model(kind), start, observe(record))


def fitted_both(record):
    """Fit the friction coefficient of a ball, and the stiffness in series with it."""
    start = {name: 1.3 * value for name, value in TRUTHS["ball"].items()}
    return fitting.fit_parameters(model("ball"), start, observe(record))


def fitted_friction(record):
    """Fit the friction coefficient of a ball alone."""
    return fitting.fit_parameters(
        lambda values: model("ball")({**TRUTHS["ball"], **values}),
        {"friction": 0.26},
        observe(record),
    )


def holds(parameter, low="low", high="high", kind="ball"):
    """Say whether an interval of a parameter holds the truth."""
    return getattr(parameter, low) <= TRUTHS[kind][parameter.name] <= getattr(parameter, high)


def reciprocating(
    seed,
    loops=48,
    rows=42_579,
    *,
    scatter=0.01,
    correlation=0.0,
    run_in=0.0,
    drift=0.0,
    hum=0.0,
    amplitude=200e-9,
    sliding=False,
):
    """Simulate loops of a ball at 50 mN whose friction coefficient, 0.2 in the mean, changes from branch to branch.

    Parameters
    ----------
    scatter, correlation : float
        Standard deviation of the logarithm of a branch's coefficient, and its correlation with that
        of the branch before.
    run_in : float
        How much higher the coefficient is at first, as a share; it falls by 1/e in an eighth of the
        record.
    drift : float
        How much the coefficient rises evenly along the record, as a share.
    sliding : bool
        Whether friction changes while the contact slides, near the end of a branch, and not at the
        reversal: there a fall of it lets go some of the load that the branch begins with, which one
        coefficient cannot follow.
    hum : float
        Standard deviation of noise of the load that is correlated over twenty samples [N].
    """
    random = np.random.default_rng(seed)
    sampled = np.arange(rows) / 10
    # turning points fall between samples
    quarter = (rows - 0.63) / 10 / (4 * loops)
    turns = np.arange(1, 4 * loops, 2) * quarter
    changes = turns - 0.25 * quarter if sliding else turns
    time = np.union1d(sampled, np.union1d(turns, changes))
    phase = (time / quarter) % 4
    displacement = amplitude * np.select([phase < 1, phase < 3], [phase, 2 - phase], phase - 4)
    walk = correlated(random, turns.size + 1, correlation)
    place = np.arange(walk.size) / walk.size
    middle = (walk.size - 1) / walk.size / 2
    coefficients = (
        0.2
        * np.exp(scatter * walk)
        * (1 + run_in * np.exp(-8 * place))
        * (1 + drift * (place - middle))
    )
    events = [hs.NormalLoad(0.0, 50e-3)]
    events += [
        hs.TangentialDisplacement(at, moved)
        for at, moved in zip(time.tolist(), displacement.tolist(), strict=True)
    ]
    events += [
        hs.FrictionChange(at, value)
        for at, value in zip(changes.tolist(), coefficients[1:].tolist(), strict=True)
    ]
    events.sort(key=lambda event: event.time)
    ball, instrument = model("ball")({**TRUTHS["ball"], "friction": float(coefficients[0])})
    history = hs.replay(ball, events, record="totals", instrument=instrument)
    seen = np.isin(history["time"].values, sampled)
    noise = random.normal(0.0, LOAD_NOISE, rows) + hum * correlated(random, rows, np.exp(-1 / 20))
    return Measurement(
        sampled,
        {
            "normal_load": np.full(rows, 50e-3),
            "tangential_displacement": displacement[np.isin(time, sampled)]
            + random.normal(0.0, DISPLACEMENT_NOISE, rows),
        },
        {"tangential_load": history["total_tangential_load"].values[seen] + noise},
        {"tangential_displacement": 20e-9},
    )


def correlated(random, count, correlation):
    """Draw normal numbers of variance 1, each correlated with the one before it."""
    values = random.normal(size=count)
    values[1:] *= np.sqrt(1 - correlation**2)
    for index in range(1, count):
        values[index] += correlation * values[index - 1]
    return values


def part(record, chosen):
    """Give some samples of a record, on a clock that runs through."""
    chosen = np.asarray(chosen)
    return attrs.evolve(
        record,
        time=record.time[: chosen.size],
        channels={name: values[chosen] for name, values in record.channels.items()},
        response={name: values[chosen] for name, values in record.response.items()},
    )


def random_half(record, seed, dead_band=20e-9):
    """Give the loops of a random half of a record, and those of the other half."""
    random = np.random.default_rng(seed)
    turns = turning_points(record["tangential_displacement"], dead_band)[1:-1]
    # from one forward turning point to the next
    loops = [np.arange(start, end) for start, end in zip(turns[:-2:2], turns[2::2], strict=True)]
    first = np.sort(random.permutation(len(loops))[: len(loops) // 2])
    second = np.setdiff1d(np.arange(len(loops)), first)
    return [
        part(record, np.concatenate([loops[index] for index in half])) for half in (first, second)
    ]


def with_spikes(record, seed, share=0.01, load=2e-3, displacement=15e-9):
    """Add spikes to a share of the samples of the load, upward alone, and to half as many of the displacement."""
    random = np.random.default_rng(seed)
    size = record.time.size
    up = np.where(random.random(size) < share, load * random.uniform(0.5, 2.0, size), 0.0)
    either_way = np.where(
        random.random(size) < share / 2, displacement * random.choice([-1.0, 1.0], size), 0.0
    )
    moved = record["tangential_displacement"] + either_way
    return attrs.evolve(
        record,
        channels={**record.channels, "tangential_displacement": moved},
        response={"tangential_load": record["tangential_load"] + up},
    )


_LOOPS, _ROWS = 16, 1_600
RECORDS = {
    "white_noise": lambda seed: measured("ball", seed, rate=10.03, loads=(0.05,), loops=4),
    "turns_between_samples": lambda seed: measured("ball", seed, rate=2.09, loads=(0.05,), loops=8),
    "correlated_noise": lambda seed: reciprocating(seed, _LOOPS, _ROWS, scatter=0.0, hum=5e-5),
    "scattering": lambda seed: reciprocating(seed, _LOOPS, _ROWS, scatter=0.03, sliding=True),
    "correlated_scatter": lambda seed: reciprocating(
        seed, _LOOPS, _ROWS, scatter=0.01, correlation=0.7, hum=5e-5, sliding=True
    ),
    "spikes": lambda seed: with_spikes(
        reciprocating(seed, _LOOPS, _ROWS, scatter=0.0, hum=5e-5), seed
    ),
    "drifting": lambda seed: reciprocating(
        seed, _LOOPS, _ROWS, scatter=0.01, drift=0.1, hum=5e-5, sliding=True
    ),
}


def held(part, seeds):
    """Say whether the intervals of each record hold the truth, of a fit and of loops.

    Behind that, how far fits are off and how far their intervals reach, as logarithms.
    """
    by_fit, by_loops, off, reach = [], [], [], []
    for seed in seeds:
        record = RECORDS[part](seed)
        found = fitted_both(record)
        by_fit.append([holds(each) for each in found.parameters])
        off.append([np.log(value / TRUTHS["ball"][name]) for name, value in found.values.items()])
        reach.append([np.log(each.high / each.low) / 2 for each in found.parameters])
        loops = hs.loops(record)
        wander = loops.wander("friction_coefficient")
        by_loops.append(abs(loops.statistics("friction_coefficient").mean - 0.2) <= wander.reach)
    return by_fit, by_loops, off, reach


def too_wide(off, reach):
    """Give the mean reach of intervals of 95 % over what the scatter of the estimates asks for."""
    return np.mean(reach, axis=0) / (1.96 * np.std(off, axis=0, ddof=1))
