"""Records of sound instruments, at random: no finding and no remedy is right for them.

One sphere or 80 summits, moved in triangles, sines, saw-teeth or ramps with holds, over a tenth to
ten times the displacement at which all of it slides, with or without noise and a last digit.
"""

import attrs
import numpy as np

import historysim as hs
from historysim.measured.reduction import Measurement

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
LOAD, FRICTION = 0.05, 0.2
BODIES = {
    "sphere": hs.Ensemble(PAIR, 0.0, 2.5e-3, FRICTION),
    "summits": hs.Ensemble(PAIR, np.random.default_rng(3).normal(0.0, 60e-9, 80), 20e-6, FRICTION),
}
WAVES = ("triangle", "sine", "saw-tooth", "holds")


@attrs.frozen
class CleanRecord:
    """A record, and what is true of it."""

    measurement: Measurement
    body: str
    wave: str
    slides: bool  #: whether branches are level at their ends
    ensemble: hs.Ensemble
    per_cycle: int  #: samples

    def cycle(self, first):
        """Give one cycle from a sample on, as it would be stored by itself."""
        part = slice(first, first + self.per_cycle)
        channels, response = (
            {name: values[part] for name, values in group.items()}
            for group in (self.measurement.channels, self.measurement.response)
        )
        return attrs.evolve(
            self.measurement, time=self.measurement.time[part], channels=channels, response=response
        )


def loaded(body):
    """Give the state of a body under the normal load."""
    return BODIES[body].advance(BODIES[body].initial_state(), normal_load=LOAD)


def slip_displacement(body):
    """Give the displacement at which all of a body slides."""
    state = BODIES[body].advance(loaded(body), tangential_displacement=1e-6)
    below = np.linspace(0, 1e-6, 4001)[1:]
    loads = (
        BODIES[body].advance_many(loaded(body), tangential_displacement=below)[1].tangential_load
    )
    return float(below[np.argmax(loads >= (1 - 1e-9) * state.tangential_load)])


SLIPS = {body: slip_displacement(body) for body in BODIES}


def wave_of(kind, phase):
    """Give a wave of amplitude 1 that begins at 0 and rises."""
    part = phase % 1
    if kind == "sine":
        return np.sin(2 * np.pi * phase)
    if kind == "saw-tooth":
        # up in nine tenths, down in one
        return np.interp(part, [0, 0.45, 0.55, 1], [0, 1, -1, 0])
    corners = [0, 0.25, 0.75, 1] if kind == "triangle" else [0, 0.15, 0.35, 0.65, 0.85, 1]
    return np.interp(part, corners, [0, 1, -1, 0] if kind == "triangle" else [0, 1, 1, -1, -1, 0])


def clean_record(seed):
    """Give a record of a sound instrument."""
    random = np.random.default_rng([seed, 7])
    body, wave = random.choice(list(BODIES)), WAVES[seed % len(WAVES)]
    amplitude = SLIPS[body] * 10 ** random.uniform(-1, 1)
    cycles, per_cycle = int(random.integers(3, 9)), int(random.choice([40, 100, 250, 400]))
    phase = np.arange(int((cycles + 0.3) * per_cycle)) / per_cycle
    moved = amplitude * wave_of(wave, phase)
    if random.random() < 0.2:
        # to one side
        moved = (moved + amplitude * wave_of(wave, np.minimum(phase, 0.2))) / 2
    load = BODIES[body].advance_many(loaded(body), tangential_displacement=moved)[1].tangential_load
    normal = np.full(moved.size, LOAD)
    noise = random.choice([0.0, 1e-3, 5e-3])
    seen, read = (
        values + share * noise * np.abs(values).max() * random.normal(size=values.size)
        for values, share in ((moved, random.choice([0.0, 0.3, 1.0])), (load, 1.0))
    )
    if random.random() < 0.25:
        digit = np.ptp(read) / 2 ** int(random.choice([9, 12]))
        read = np.round(read / digit) * digit
    channels = {"normal_load": normal, "tangential_displacement": seen}
    record = Measurement(
        phase * random.choice([0.1, 1.0, 20.0]), channels, {"tangential_load": read}
    )
    return CleanRecord(
        record, str(body), wave, bool(amplitude > 3 * SLIPS[body]), BODIES[body], per_cycle
    )
