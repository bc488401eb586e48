"""Holds of a record at its reversals: where the displacement rests, and the record without the noise in them."""

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.errors import InputError
from historysim.measured.comparison import load_steps
from historysim.measured.reduction import Measurement, estimated_noise, loop_dead_band, turning_points

# Deviations of the noise within which a displacement rests, and from which on its way to rest is timed.
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
    origin: float  #: when it has come to rest [s], which lies between samples
    near: slice  #: the samples around, on the last of the way here and the first of the way on

    def since(self, time: Floats) -> Floats:
        """Return the times of the samples since then [s]."""
        return np.maximum(time[self.samples] - self.origin, 0.0)


def rests_of(measurement: Measurement) -> list[Rest]:
    """Return the holds at reversals, without steps of the normal load."""
    displacement, time = measurement["tangential_displacement"], measurement.time
    band = loop_dead_band(displacement, measurement.dead_band.get("tangential_displacement"))
    turns = turning_points(displacement, band)
    noise = estimated_noise(displacement)
    swing = float(np.median(np.abs(np.diff(displacement[turns])))) if turns.size > 1 else 0.0
    within = max(WITHIN * noise, LEAST_BAND * swing)
    steps = load_steps(measurement["normal_load"])
    held = [_around(displacement, time, int(turn), within) for turn in turns[1:]]
    found: list[Rest] = []
    for rest in (each for each in held if each is not None):
        # the longest piece without a step of the normal load
        pieces = np.split(rest.samples, np.flatnonzero(np.isin(rest.samples, steps)) + 1)
        longest = max(pieces, key=lambda piece: float(time[piece[-1]] - time[piece[0]]) if piece.size else -1.0)
        if longest.size >= RESTS and not (found and longest[0] <= found[-1].samples[-1]):
            whole = longest[0] == rest.samples[0]
            found.append(Rest(longest, rest.origin if whole else float(time[longest[0]]), rest.near))
    if not found:
        raise InputError(
            "the tangential displacement never rests at a reversal; expected holds there, of ten samples or more, and "
            "ten times longer than the displacement takes to come to rest"
        )
    return found


def _around(displacement: Floats, time: Floats, turn: int, within: float) -> Rest | None:
    """Return the hold around a turn; None where the displacement moves on at once."""
    near = np.abs(displacement - displacement[turn]) <= 2 * within
    level = float(np.median(displacement[_run(near, turn)]))
    # single samples of the noise are farther
    rests = np.abs(displacement - level) <= within
    far = np.flatnonzero(np.abs(displacement - level) > BEFORE / WITHIN * within)
    before, after = far[far < turn], far[far > turn]
    begin = int(before[-1]) + 1 if before.size else 0
    end = int(after[0]) if after.size else displacement.size
    resting = begin + np.flatnonzero(rests[begin:end])
    if resting.size < RESTS:
        return None
    part = np.arange(resting[0], resting[-1] + 1)
    coming = float(time[part[0]] - time[max(begin - 1, 0)])
    if time[part[-1]] - time[part[0]] < RESTS * coming:
        return None
    arrives = _arrival(displacement, time, begin, float(time[part[0]]), level)
    if end == displacement.size:
        return Rest(part, arrives, slice(begin, end))
    # as it leaves, the load falls fast: what the noise hides of that is left out, with a sample more
    back = displacement.size - end
    leaves = -_arrival(displacement[::-1], -time[::-1], back, -float(time[part[-1]]), level)
    return Rest(part[: max(int(np.searchsorted(time[part], leaves)) - 1, 1)], arrives, slice(begin, end))


def _arrival(displacement: Floats, time: Floats, begin: int, seen: float, level: float) -> float:
    """Return when the line through the samples on the way reaches the level [s]; noise hides the end of the way."""
    way = slice(max(begin - ON_THE_WAY, 0), begin)
    if begin < 3 or np.ptp(displacement[way]) == 0:
        return seen
    before = time[begin - 1]
    slope, end = np.polyfit(time[way] - before, displacement[way], 1)
    reached = before + (level - end) / slope if slope else seen
    return float(np.clip(reached, before, seen + (seen - before)))


def _run(there: Booleans, place: int) -> slice:
    """Return the run of true values around a place."""
    away = np.flatnonzero(~there)
    before, after = away[away < place], away[away > place]
    return slice(int(before[-1]) + 1 if before.size else 0, int(after[0]) if after.size else there.size)


def quiet(measurement: Measurement, parts: list[Rest]) -> Measurement:
    """Return a record without the noise of displacement and normal load in its holds, which memory would ratchet on."""
    channels = {name: values.copy() for name, values in measurement.channels.items()}
    response = {name: values.copy() for name, values in measurement.response.items()}
    for name in ("tangential_displacement", "normal_load"):
        values = channels[name] if name in channels else response[name]
        for part in parts:
            values[part.samples] = _smooth(measurement.time[part.samples], values[part.samples])
            if name == "tangential_displacement":
                # no sample of the noise around is farther out, so that the hold begins with the reversal
                first, last = part.samples[[0, -1]]
                sense = 1.0 if values[max(part.near.start - 1, 0)] <= values[first] else -1.0
                for around, end in ((slice(part.near.start, first), first), (slice(last + 1, part.near.stop), last)):
                    values[around] = sense * np.minimum(sense * values[around], sense * values[end])
    return attrs.evolve(measurement, channels=channels, response=response)


def _smooth(time: Floats, values: Floats) -> Floats:
    """Return the mean, or where that is less than noise explains, a line over time and over its logarithm."""
    from scipy import stats

    mean = np.full(values.size, values.mean())
    way = (time - time[0]) / (time[-1] - time[0])
    design = np.column_stack([np.ones(values.size), way, np.log1p(SOONER * way)])
    curve = design @ np.linalg.lstsq(design, values, rcond=None)[0]
    left, all_of_it = float(np.sum((values - curve) ** 2)), float(np.sum((values - mean) ** 2))
    free = values.size - 3
    if left <= 0 or stats.f.sf((all_of_it - left) / 2 / (left / free), 2, free) < LEAST_CHANCE:
        return curve if all_of_it > 0 else mean
    return mean


def start_of(values: Floats, part: Rest) -> float:
    """Return the mean of the first hundredth of the samples of a hold."""
    return float(np.mean(values[part.samples][: _few(part)]))


def end_of(values: Floats, part: Rest) -> float:
    """Return the mean of the last hundredth of the samples of a hold."""
    return float(np.mean(values[part.samples][-_few(part) :]))


def _few(part: Rest) -> int:
    return max(part.samples.size // 100, 1)
