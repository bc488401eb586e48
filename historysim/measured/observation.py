"""What a model does along a measured displacement, without the reversals that are only noise.

The measured displacement is not free of noise, and a contact remembers every reversal. So a model does not follow the
samples: from one turning point to the next it passes the measured displacements in their order along the branch.
"""

import itertools
import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics.array_types import Floats, Integers
from historysim.errors import InputError
from historysim.loads.samples import SampledLoads
from historysim.measured.loop_values import NoLoopError
from historysim.measured.loops import Loops
from historysim.measured.measurement import Measurement
from historysim.measured.noise import noise_of
from historysim.measured.reduction import check_moves, loop_dead_band, turning_points
from historysim.measured.splitting import check_skip, loops_of_measurement
from historysim.recording.recorder import DatasetRecorder
from historysim.replaying import Replay

LEAST_STEP = 5e-3
"""Change of the normal load from one sample to the next, over the greatest one, up to which it is no step of it."""
MOST_BACK = 64
"""Samples that are looked back to for the stiffness that noise may have met."""


@attrs.frozen(eq=False)
class Observation:
    """Samples of measured loops, in the order of their times."""

    time: Floats
    """(sample) [s]."""
    displacement: Floats
    """(sample) Measured tangential displacement: that of the drive [m]."""
    tangential_load: Floats
    """(sample) Measured tangential load [N]."""
    normal_load: Floats
    """(sample) Normal load [N], ≥ 0."""
    turns: Integers
    """(turn) Indices of the turning points of the displacement, with the first and the last sample."""
    nodes: Integers
    """(node) Indices of the samples whose displacement the contact remembers: the turning points, and those before and
    after a step of the normal load."""
    node_deviation: Floats
    """(node) How far the true places of the nodes may be from the measured ones [m], as a standard deviation: by the
    noise of the displacement, and by half the way to the next sample, for a channel may turn between two samples."""
    node_offset: Floats
    """(node) Where they are expected, less where they were measured [m]: a turn is beyond the outermost sample, in the
    mean by a quarter of the way to the next one where the displacement comes and goes evenly."""
    displacement_noise: float
    load_noise: float
    """displacement_noise and load_noise: standard deviations of displacement [m] and tangential load [N]."""
    dead_band: float
    """The smallest swing of the displacement that is a reversal [m]."""
    loops: Loops | None
    """The measured loops; None where there is no whole one."""
    skip: int = 0
    """Loops at the start that are not compared."""
    first: int = 0
    """The sample that a comparison begins at: those before are walked through, and not compared."""
    remarks: tuple[tuple[str, str], ...] = ()
    """What was done to the samples before."""

    def thinned(self, most: int) -> "Observation":
        """Return an observation of all nodes, and of about so many of the samples between them, evenly."""
        stride = -(-self.time.size // most)
        if stride <= 1:
            return self
        kept = np.union1d(np.arange(0, self.time.size, stride), np.append(self.nodes, self.first))
        return attrs.evolve(
            self,
            time=self.time[kept],
            displacement=self.displacement[kept],
            tangential_load=self.tangential_load[kept],
            normal_load=self.normal_load[kept],
            turns=np.searchsorted(kept, self.turns),
            nodes=np.searchsorted(kept, self.nodes),
            first=int(np.searchsorted(kept, self.first)),
            loops=None,
        )


def observe(
    measurement: Measurement,
    *,
    skip: int = 0,
    displacement_noise: float | None = None,
    load_noise: float | None = None,
) -> Observation:
    """Return what a model is held against: the samples of a measurement, its turning points, its loops, its noise.

    Parameters
    ----------
    measurement : Measurement
        With tangential displacement, tangential load and normal load, replayed or measured beside. Its dead band of
        the tangential displacement, by default that of `reduction.loop_dead_band`, tells what is a reversal.
    skip : int
        Loops at the start that are not compared.
    displacement_noise, load_noise : float, optional
        Standard deviations [m, N]; by `noise_of` where they are not given.

    Raises
    ------
    InputError
        A channel that was not measured, a displacement that rests, a normal load that pulls, times that decrease, fewer
        loops than are to be skipped, or loops that run the wrong way round.
    """
    displacement, load = measurement["tangential_displacement"], measurement["tangential_load"]
    normal = measurement["normal_load"]
    measurement.check_pressed()
    check_moves(displacement, measurement.dead_band.get("tangential_displacement"))
    dead_band = loop_dead_band(displacement, measurement.dead_band.get("tangential_displacement"))
    turns = turning_points(displacement, dead_band)
    skip = check_skip(skip)
    start = 1 + 2 * skip if skip else 0
    if start >= turns.size - 1:
        raise InputError(
            f"{skip} loops are to be skipped, and the record has {max(turns.size - 2, 0) // 2}; expected fewer"
        )
    try:
        loops = loops_of_measurement(measurement, dead_band=dead_band, skip=skip)
    except NoLoopError:
        # without a whole loop the samples can still be compared
        loops = None
    noise = noise_of(displacement) if displacement_noise is None else displacement_noise
    nodes = np.union1d(turns, _load_steps(normal))
    half_step, offset = _half_step(displacement), np.zeros(displacement.size)
    offset[turns[1:-1]] = np.sign(displacement[turns[1:-1]] - displacement[turns[:-2]]) * half_step[turns[1:-1]] / 2
    return Observation(
        time=measurement.time,
        displacement=displacement,
        tangential_load=load,
        normal_load=normal,
        turns=turns,
        nodes=nodes,
        node_deviation=np.hypot(noise, half_step[nodes]),
        node_offset=offset[nodes],
        displacement_noise=noise,
        load_noise=noise_of(load) if load_noise is None else load_noise,
        dead_band=dead_band,
        loops=loops,
        skip=skip,
        first=int(turns[start]),
        remarks=measurement.remarks,
    )


@attrs.frozen(eq=False)
class ModelResponse:
    """What a model does at each sample of an observation."""

    displacement: Floats
    """(sample) Of the drive, which near a sample is that of the observation [m]."""
    tangential_load: Floats
    """(sample) [N]."""
    stiffness: Floats
    """(sample) Slope of the load over the displacement of the drive [N/m]; the greatest one that the noise of the
    displacement may have met."""
    slope: Floats
    """(sample) Slope of the load over the displacement of the drive at the sample itself [N/m]."""
    friction_limit: Floats
    """(sample) [N]."""


def passed(
    ensemble: Ensemble, instrument: Instrument, observation: Observation, shifts: npt.ArrayLike = ()
) -> ModelResponse:
    """Return what a model does along an observation.

    Parameters
    ----------
    ensemble : Ensemble
    instrument : Instrument
        What the displacement was measured by.
    observation : Observation
    shifts : array_like (node)
        How far the nodes between the first and the last are away from where they were measured [m]; those left out are
        where they were measured.
    """
    moved = np.asarray(shifts, dtype=np.float64)
    target = observation.displacement.copy()
    target[observation.nodes[1 : 1 + moved.size]] += moved
    order = np.arange(target.size)
    for start, end in itertools.pairwise(observation.nodes):
        between = np.clip(target[start + 1 : end], *sorted((target[start], target[end])))
        ranks = np.argsort(between if target[end] >= target[start] else -between, kind="stable")
        target[start + 1 : end] = between[ranks]
        order[start + 1 : end] = start + 1 + ranks
    loads = SampledLoads(observation.time, observation.normal_load, target)
    job = Replay(ensemble, loads, record="totals", instrument=instrument)
    recorder = job.recorder(DatasetRecorder)
    job.walk(recorder)
    rows = recorder.rows
    in_time = np.empty_like(order)
    in_time[order] = np.arange(order.size)
    stiffness = rows.totals["tangential_stiffness"]
    stiffness = stiffness / (1 + stiffness / instrument.lateral_stiffness)
    totals = rows.totals[in_time]
    return ModelResponse(
        slope=stiffness[in_time],
        displacement=target[in_time],
        tangential_load=totals["tangential_load"],
        stiffness=_stiffest(target, stiffness, 2 * observation.displacement_noise)[in_time],
        friction_limit=totals["friction_limit"],
    )


def _stiffest(displacement: Floats, stiffness: Floats, reach: float) -> Floats:
    """Return the greatest stiffness at each sample, the one before it, and those before it within reach."""
    greatest = stiffness.copy()
    for back in range(1, min(displacement.size, MOST_BACK)):
        near = np.abs(displacement[back:] - displacement[:-back]) <= (math.inf if back == 1 else reach)
        if not near.any():
            break
        greatest[back:] = np.maximum(greatest[back:], np.where(near, stiffness[:-back], 0.0))
    return greatest


def _half_step(displacement: Floats) -> Floats:
    """Return half of the way from each sample to the farther one of its neighbours."""
    steps = np.abs(np.diff(displacement, prepend=displacement[:1], append=displacement[-1:]))
    half: Floats = np.maximum(steps[:-1], steps[1:]) / 2
    return half


def _load_steps(normal_load: Floats) -> Integers:
    """Return the samples between which the normal load changes by much more than its noise."""
    change = np.abs(np.diff(normal_load))
    # the last step of a digitiser is none, though a load that rests on it seems to be free of noise
    least = max(10 * noise_of(normal_load), 1e-2 * float(np.ptp(normal_load)), LEAST_STEP * float(normal_load.max()))
    before = np.flatnonzero(change > least)
    steps: Integers = np.union1d(before, before + 1)
    return steps
