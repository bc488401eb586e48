"""Holds of a record at reversals: where the displacement rests, and the record without noise in them."""

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.errors import InputError
from historysim.measured.observation import find_load_steps
from historysim.measured.reduction import (
    Measurement,
    estimated_noise,
    loop_dead_band,
    turning_points,
)

# Deviations of the noise within which a displacement rests, and from which on its way to rest is
# timed.
WITHIN, BEFORE = 4.0, 12.0
RESTS = 10.0  # times longer than that way, and samples, that a hold lasts
ON_THE_WAY = 10  # samples on the way to rest that are timed
LEAST_BAND = 1e-3  # least band of rest, over the swings
LEAST_CHANCE = 1e-3  # chance of noise below which a displacement, or a load, moves within a hold
SOONER = 100.0  # of a hold, over when the logarithm of its time begins to run


@attrs.frozen(eq=False)
class Rest:
    """A displacement that rests at a reversal."""

    samples: Integers
    origin: float  #: when it has come to rest [s], between samples
    near: slice  #: the samples around, on the last of the way here and the first of the way on

    def since(self, time: Floats) -> Floats:
        """Return the times of the samples since then [s]."""
        return np.maximum(time[self.samples] - self.origin, 0.0)

    def start(self, values: Floats) -> float:
        """Return the mean of the first hundredth of its samples."""
        return float(np.mean(values[self.samples][: max(self.samples.size // 100, 1)]))

    def change(self, values: Floats) -> float:
        """Return the mean of the last hundredth of the samples less the mean of the first."""
        return float(
            np.mean(values[self.samples][-max(self.samples.size // 100, 1) :])
        ) - self.start(values)


def find_rests(measurement: Measurement) -> list[Rest]:
    """Return the holds at reversals, without steps of the normal load."""
    displacement = measurement["tangential_displacement"]
    time = measurement.time
    band = loop_dead_band(displacement, measurement.dead_band.get("tangential_displacement"))
    turns = turning_points(displacement, band)
    noise = estimated_noise(displacement)
    swing = float(np.median(np.abs(np.diff(displacement[turns])))) if turns.size > 1 else 0.0
    within = max(WITHIN * noise, LEAST_BAND * swing)
    steps = find_load_steps(measurement["normal_load"])
    held = [_around(displacement, time, int(turn), within) for turn in turns[1:]]
    rests: list[Rest] = []
    for rest in (each for each in held if each is not None):
        # the longest piece without a step of the normal load
        pieces = np.split(rest.samples, np.flatnonzero(np.isin(rest.samples, steps)) + 1)
        longest = max(
            pieces,
            key=lambda piece: float(time[piece[-1]] - time[piece[0]]) if piece.size else -1.0,
        )
        if longest.size >= RESTS and not (rests and longest[0] <= rests[-1].samples[-1]):
            complete = longest[0] == rest.samples[0]
            rests.append(
                Rest(longest, rest.origin if complete else float(time[longest[0]]), rest.near)
            )
    if not rests:
        raise InputError(
            "the tangential displacement never rests at a reversal; expected holds there, of ten samples or more, and "
            "ten times longer than the displacement takes to come to rest"
        )
    return rests


def _around(displacement: Floats, time: Floats, turn: int, within: float) -> Rest | None:
    """Return the hold around a turn; None if the displacement moves on immediately."""
    near = np.abs(displacement - displacement[turn]) <= 2 * within
    level = float(np.median(displacement[_run(near, turn)]))
    # single samples of the noise are farther
    around = _run(np.abs(displacement - level) <= BEFORE / WITHIN * within, turn)
    start = around.start
    stop = around.stop
    resting = start + np.flatnonzero(np.abs(displacement[around] - level) <= within)
    if resting.size < RESTS:
        return None
    samples = np.arange(resting[0], resting[-1] + 1)
    coming = float(time[samples[0]] - time[max(start - 1, 0)])
    if time[samples[-1]] - time[samples[0]] < RESTS * coming:
        return None
    arrives = _arrival(displacement, time, start, float(time[samples[0]]), level)
    if stop == displacement.size:
        return Rest(samples, arrives, around)
    # as it leaves, the load falls fast: what the noise hides of that is left out, with a sample
    # more
    back = displacement.size - stop
    leaves = -_arrival(displacement[::-1], -time[::-1], back, -float(time[samples[-1]]), level)
    return Rest(samples[: max(int(np.searchsorted(time[samples], leaves)) - 1, 1)], arrives, around)


def _arrival(displacement: Floats, time: Floats, start: int, seen: float, level: float) -> float:
    """Return when the line through the samples on the way reaches the level [s]; noise hides the end of the way."""
    approach = slice(max(start - ON_THE_WAY, 0), start)
    if start < 3 or np.ptp(displacement[approach]) == 0:
        return seen
    origin = time[start - 1]
    slope, offset = np.polyfit(time[approach] - origin, displacement[approach], 1)
    reached = origin + (level - offset) / slope if slope else seen
    return float(np.clip(reached, origin, seen + (seen - origin)))


def _run(inside: Booleans, index: int) -> slice:
    """Return the run of true values around a place."""
    away = np.flatnonzero(~inside)
    left = away[away < index]
    right = away[away > index]
    return slice(
        int(left[-1]) + 1 if left.size else 0, int(right[0]) if right.size else inside.size
    )


def quiet(measurement: Measurement, rests: list[Rest]) -> Measurement:
    """Return a record without the noise of displacement and normal load in its holds, which memory would ratchet on."""
    channels = {name: values.copy() for name, values in measurement.channels.items()}
    response = {name: values.copy() for name, values in measurement.response.items()}
    for name in ("tangential_displacement", "normal_load"):
        values = channels[name] if name in channels else response[name]
        for rest in rests:
            values[rest.samples] = _smooth(measurement.time[rest.samples], values[rest.samples])
            if name == "tangential_displacement":
                # no sample of the noise around is farther out, so that the hold begins with the
                # reversal
                start, stop = rest.samples[[0, -1]]
                sense = 1.0 if values[max(rest.near.start - 1, 0)] <= values[start] else -1.0
                for around, edge in (
                    (slice(rest.near.start, start), start),
                    (slice(stop + 1, rest.near.stop), stop),
                ):
                    values[around] = sense * np.minimum(
                        sense * values[around], sense * values[edge]
                    )
    return attrs.evolve(measurement, channels=channels, response=response)


def _smooth(time: Floats, values: Floats) -> Floats:
    """Return the mean, or where that is less than noise explains, a line over time and over its logarithm."""
    from scipy.special import fdtrc

    mean = np.full(values.size, values.mean())
    fraction = (time - time[0]) / (time[-1] - time[0])
    design = np.column_stack([np.ones(values.size), fraction, np.log1p(SOONER * fraction)])
    curve = design @ np.linalg.lstsq(design, values, rcond=None)[0]
    squares = float(np.sum((values - curve) ** 2))
    all_of_it = float(np.sum((values - mean) ** 2))
    free = values.size - 3
    if squares <= 0 or fdtrc(2, free, (all_of_it - squares) / 2 / (squares / free)) < LEAST_CHANCE:
        return curve if all_of_it > 0 else mean
    return mean
