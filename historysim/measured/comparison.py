"""Comparison of a model with a measurement: its response along the measured displacement, and the load residuals.

The measured displacement has noise, and a contact remembers every reversal. So a model does not
follow the samples in time: from one turning point to the next it takes the measured displacements
in ascending or descending order.
"""

import collections
import functools
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import attrs
import numpy as np

from historysim.asperities.body import Body
from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import ArrayLike, Floats, Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import html_table
from historysim.errors import InputError
from historysim.loads.event_sequence import SampledLoads
from historysim.measured.loop_values import BRANCH_QUANTITIES, LOOP_QUANTITIES, NoLoopError
from historysim.measured.loops import Loops, check_skip, loops_of_channels, loops_of_measurement
from historysim.measured.reduction import (
    FEWEST_SPIKES,
    REVERSAL,
    USUAL_STEPS,
    Measurement,
    check_moves,
    estimate_white_noise,
    find_spikes,
    loop_dead_band,
    noise_of_curve,
    turning_points,
)
from historysim.measured.residual_diagnosis import (
    FEWEST_OF_BRANCH,
    BranchSamples,
    diagnose_residuals,
)
from historysim.recording.recorder import TotalsRecorder
from historysim.recording.unknown_past import Bounds
from historysim.replaying import Replay

# Change of the normal load between successive samples, over its largest value, up to which it is
# not a step.
LEAST_STEP = 5e-3
# preceding samples searched for the largest stiffness within the noise of the displacement
MOST_BACK = 64
POSITION_BINS = 40  # position bins of a branch
SLIDES = 0.95  # load of the model over its friction limit above which the contact counts as sliding
# range of the normal load on a branch, over its largest value there, up to which the load is
# constant
ONE_LOAD = 0.1
LEAST_NOISE = 1e-9  # least noise of the load that counts, over the largest load
FEWEST_MEANS = 16  # least number of means on a branch: they show its curvature
# A compliance in series is reported if the measured stiffness at reversals is below this fraction
# of the model's, by this number of standard errors.
SOFTER, CLEARLY = 0.5, 3.0
# Rms difference with it, over that without, up to which it is advised; and the range of it that is
# searched.
MOST_LEFT, SERIES_RANGE = 0.5, 10.0


@attrs.frozen(eq=False)
class Observation:
    """Samples of measured loops, in the order of their times."""

    time: Floats  #: (sample) [s]
    displacement: Floats  #: (sample) Measured tangential displacement of the drive [m]
    tangential_load: Floats  #: (sample) Measured tangential load [N]
    normal_load: Floats  #: (sample) Normal load [N], ≥ 0
    #: (turn) Indices of the turning points of the displacement, with the first and the last sample
    turns: Integers
    #: (node) Indices of the samples at which the contact remembers the displacement: the turning
    #: points, and the samples before and after a step of the normal load.
    nodes: Integers
    #: (node) Standard deviation of the true node displacements about the measured ones [m]: the
    #: noise of the displacement, and half the distance to the next sample, since a channel may turn
    #: between two samples.
    node_deviation: Floats
    #: (node) Expected less measured node displacement [m]: a turn exceeds the outermost sample, on
    #: average by a quarter of the distance to the next one if the displacement reverses evenly.
    node_offset: Floats
    displacement_noise: float
    #: displacement_noise and load_noise: standard deviations of displacement [m] and tangential
    #: load [N].
    load_noise: float
    #: standard deviation of a single reading of the displacement, as at the turning points [m]
    reading_noise: float
    #: Standard deviations of channels before any filter, by name [m or N].
    unfiltered_noise: Mapping[str, float]
    dead_band: float  #: the smallest swing of the displacement that is a reversal [m]
    loops: Loops | None  #: the measured loops; None where there is no whole one
    skip: int = 0  #: loops at the start that are not compared
    #: Whether the contact is pressed at displacement 0, and then moved to the first sample, since
    #: its zero is known.
    starts_displaced: bool = False
    start_sample: int = 0  #: first sample compared: earlier ones are replayed, and not compared
    #: whether the samples before the first one compared depend on an unknown past
    forgets: bool = False
    remarks: tuple[tuple[str, str], ...] = ()  #: earlier processing of the samples

    def thin(self, sample_count: int) -> "Observation":
        """Return an observation with all nodes and about `sample_count` evenly spaced samples."""
        stride = -(-self.time.size // sample_count)
        if stride <= 1:
            return self
        samples = np.union1d(
            np.arange(0, self.time.size, stride), np.append(self.nodes, self.start_sample)
        )
        channels = "time", "displacement", "tangential_load", "normal_load"
        return attrs.evolve(
            self,
            **{name: getattr(self, name)[samples] for name in channels},
            turns=np.searchsorted(samples, self.turns),
            nodes=np.searchsorted(samples, self.nodes),
            start_sample=int(np.searchsorted(samples, self.start_sample)),
            loops=None,
        )

    def add_noise(self, random: np.random.Generator) -> "Observation":
        """Return an observation with as much noise again on all channels, and the turning points of those."""
        noise = {
            name: random.normal(0.0, deviation, self.time.size)
            for name, deviation in self.unfiltered_noise.items()
        }
        displacement = self.displacement + noise["tangential_displacement"]
        if self.displacement[0] == 0.0:
            # the first reading is the zero of a displacement
            displacement -= displacement[0]
        load = self.tangential_load + noise["tangential_load"]
        normal = self.normal_load + noise["normal_load"]
        # a lifted contact stays lifted
        normal = np.where(self.normal_load > 0, np.maximum(normal, 0.0), 0.0)
        turns = turning_points(displacement, self.dead_band)
        nodes, _ = _find_nodes(displacement, normal, turns, self.displacement_noise)
        deviation, offset = _node_places(displacement, turns, nodes, self.displacement_noise)
        return attrs.evolve(
            self,
            displacement=displacement,
            tangential_load=load,
            normal_load=normal,
            turns=turns,
            nodes=nodes,
            node_deviation=deviation,
            node_offset=offset,
            loops=None,
        )

    def average(self, sample_count: int) -> "Observation":
        """Return an observation with all nodes and, between them, means of neighbouring samples, about `sample_count`.

        Each branch has at least `FEWEST_MEANS` means. Their noise is estimated again: averaging n
        samples reduces white noise by √n, and correlated noise by less.
        """
        group_size = -(-self.time.size // sample_count)
        if group_size <= 1:
            return self
        starts = []
        for node, next_node in itertools.pairwise(self.nodes.tolist()):
            count = next_node - node - 1
            means = min(count, max(-(-count // group_size), FEWEST_MEANS))
            starts += [[node], node + 1 + np.arange(means) * count // max(means, 1)]
        group_starts = np.concatenate([*starts, self.nodes[-1:]])
        sizes = np.diff(group_starts, append=self.time.size)
        names = "time", "displacement", "tangential_load", "normal_load"
        channels: dict[str, Any] = {
            name: np.add.reduceat(getattr(self, name), group_starts) / sizes for name in names
        }
        white = 1 / math.sqrt(group_size)
        displacement_noise, load_noise = (
            float(np.clip(estimate_white_noise(channels[name]), white * noise, noise))
            for name, noise in (
                ("displacement", self.displacement_noise),
                ("tangential_load", self.load_noise),
            )
        )
        count = f"{self.time.size:,} samples as {group_starts.size:,}"
        text = f"{count}: turning points, and means of {group_size} between them"
        return attrs.evolve(
            self,
            **channels,
            turns=np.searchsorted(group_starts, self.turns),
            nodes=np.searchsorted(group_starts, self.nodes),
            start_sample=int(np.searchsorted(group_starts, self.start_sample)),
            displacement_noise=displacement_noise,
            load_noise=load_noise,
            unfiltered_noise={name: white * value for name, value in self.unfiltered_noise.items()},
            remarks=(*self.remarks, ("averaged", text)),
        )


def observe(
    measurement: Measurement,
    *,
    skip: int = 0,
    displacement_noise: float | None = None,
    load_noise: float | None = None,
    parallel_stiffness: float = 0.0,
    forgotten: int | None = None,
) -> Observation:
    """Prepare the samples of a measurement for comparison with a model: turning points, loops and noise.

    `skip` loops at the start are replayed and not compared; the noise of the displacement [m] and
    of the load [N] is estimated by default. Loops are evaluated without the load of a spring in
    parallel [N/m]. `forgotten` is the first sample that does not depend on an unknown past.
    """
    displacement, load = measurement["tangential_displacement"], measurement["tangential_load"]
    normal = measurement["normal_load"]
    measurement.check_pressed()
    displacement, spikes = _without_spikes(displacement)
    explicit_band = measurement.dead_band.get("tangential_displacement")
    check_moves(displacement, explicit_band)
    dead_band = loop_dead_band(displacement, explicit_band)
    turns = turning_points(displacement, dead_band)
    skip = check_skip(skip)
    start = 1 + 2 * skip if skip else 0
    past: list[tuple[str, str]] = []
    if forgotten is not None:
        time = quantity_text(float(measurement.time[forgotten]), "s", 4)
        text = (
            f"unknown, and forgotten at t = {time}: {forgotten:,} samples before are not compared"
        )
        past = [("past", text)]
    if start >= turns.size - 1:
        raise InputError(
            f"{skip} loops are to be skipped, and the record has {max(turns.size - 2, 0) // 2}; expected fewer"
        )
    try:
        contact = measurement.without_spring(parallel_stiffness)
        if forgotten:
            # loops that begin before depend on the past
            skip = max(skip, int(np.searchsorted(turns[1::2], forgotten)))
        loops = loops_of_measurement(contact, dead_band=dead_band, skip=skip)
    except NoLoopError:
        # without a whole loop the samples can still be compared
        loops = None
    if loops is not None and loops.trace.time.size > measurement.time.size:
        # one closed period: the cycles before it were not stored, so the model follows the record
        # from a reversal on
        start = max(start, 1)
    noise = estimate_white_noise(displacement) if displacement_noise is None else displacement_noise
    nodes, follows = _find_nodes(displacement, normal, turns, noise)
    node_deviation, node_offset = _node_places(displacement, turns, nodes, noise)
    load_noise = estimate_white_noise(load) if load_noise is None else load_noise
    left = {
        "tangential_displacement": noise,
        "tangential_load": load_noise,
        "normal_load": min(estimate_white_noise(normal), noise_of_curve(normal)),
    }
    unfiltered_noise = {
        name: max(deviation, estimate_white_noise(measurement.removed.get(name, ())))
        for name, deviation in left.items()
    }
    return Observation(
        time=measurement.time,
        displacement=displacement,
        tangential_load=load,
        normal_load=normal,
        turns=turns,
        nodes=nodes,
        node_deviation=node_deviation,
        node_offset=node_offset,
        displacement_noise=noise,
        load_noise=load_noise,
        reading_noise=noise,
        unfiltered_noise=unfiltered_noise,
        dead_band=dead_band,
        loops=loops,
        skip=skip,
        starts_displaced=measurement.starts_displaced,
        start_sample=max(int(turns[start]), forgotten or 0),
        forgets=forgotten is not None,
        remarks=(*measurement.remarks, *spikes, *follows, *past),
    )


def _find_nodes(
    displacement: Floats, normal: Floats, turns: Integers, noise: float
) -> tuple[Integers, list[tuple[str, str]]]:
    """Find the samples between which the displacement is monotone, but for noise; return a remark as well.

    Reversals within the dead band are nodes if the path without them is farther from the record
    than the noise.
    """
    nodes = np.union1d(turns, find_load_steps(normal))
    distance = displacement - _sort_between(displacement, nodes)[0]
    farthest = float(np.abs(distance).max())
    if farthest <= REVERSAL * noise:
        return nodes, []
    smaller = turning_points(displacement, REVERSAL * noise)
    text = (
        f"reversals down to {quantity_text(REVERSAL * noise, 'm', 3)} are replayed: the path without those within the "
        f"dead band is up to {quantity_text(farthest, 'm', 3)} from the record, more than its noise"
    )
    return np.union1d(nodes, smaller), [("path", text)]


def _node_places(
    displacement: Floats, turns: Integers, nodes: Integers, noise: float
) -> tuple[Floats, Floats]:
    """Return deviation and expected offset of the nodes from where they were measured (node) [m]."""
    # half the distance from each sample to the farther one of its neighbours
    steps = np.abs(np.diff(displacement, prepend=displacement[:1], append=displacement[-1:]))
    half_step = np.maximum(steps[:-1], steps[1:]) / 2
    inner = turns[1:-1]
    offset = np.zeros(displacement.size)
    offset[inner] = np.sign(displacement[inner] - displacement[turns[:-2]]) * half_step[inner] / 2
    return np.hypot(noise, half_step[nodes]), offset[nodes]


def _sort_between(displacement: Floats, nodes: Integers) -> tuple[Floats, Integers]:
    """Return displacements that are monotone between nodes, and the sample that each of them is from."""
    target, order = displacement.copy(), np.arange(displacement.size)
    lengths = np.diff(nodes)
    # branches of one length are sorted as the rows of an array
    for length in np.unique(lengths):
        starts, stops = (ends[lengths == length] for ends in (nodes[:-1], nodes[1:]))
        samples = starts[:, None] + np.arange(length)
        start, stop = displacement[starts, None], displacement[stops, None]
        between = np.clip(displacement[samples], np.minimum(start, stop), np.maximum(start, stop))
        # a node is the first of its branch in any case
        ranks = np.argsort(np.where(stop >= start, between, -between), axis=1, kind="stable")
        target[samples] = np.take_along_axis(between, ranks, axis=1)
        order[samples] = starts[:, None] + ranks
    return target, order


def _without_spikes(displacement: Floats) -> tuple[Floats, list[tuple[str, str]]]:
    """Replace spikes of a displacement by the mean of both neighbours; return a remark as well.

    A spike near a reversal would count as the turning point.
    """
    spikes = np.flatnonzero(find_spikes(displacement, USUAL_STEPS))
    if spikes.size < FEWEST_SPIKES:
        return displacement, []
    clean = displacement.copy()
    clean[spikes] = (displacement[spikes - 1] + displacement[spikes + 1]) / 2
    many = f"{spikes.size:,} of {displacement.size:,} readings of the displacement stand out from both neighbours"
    return clean, [("spikes", f"{many}: each is replaced by their mean")]


@attrs.frozen(eq=False)
class ModelResponse:
    """Response of a model at each sample of an observation."""

    displacement: Floats  #: (sample) Displacement of the drive, close to the measured one [m]
    tangential_load: Floats  #: (sample) [N]
    #: (sample) Slope of the load over the displacement of the drive at the sample itself [N/m]
    slope: Floats
    friction_limit: Floats  #: (sample) [N]
    #: (sample) Load of a spring in parallel, which is part of the tangential load [N]
    parallel_load: Floats
    order: Integers  #: (sample) Samples in the order in which the model passes them
    displacement_noise: float  #: of the observation [m]

    @property
    def stiffness(self) -> Floats:
        """Largest slope of the load within the noise of the displacement (sample) [N/m]."""
        greatest = np.empty_like(self.slope)
        greatest[self.order] = _max_recent_stiffness(
            self.displacement[self.order], self.slope[self.order], 2 * self.displacement_noise
        )
        return greatest

    @property
    def contact_load(self) -> Floats:
        """Tangential load of the contact alone (sample) [N]."""
        load: Floats = self.tangential_load - self.parallel_load
        return load


def compute_response(
    ensemble: Body,
    instrument: Instrument,
    observation: Observation,
    shifts: ArrayLike = (),
    offset: float = 0.0,
) -> ModelResponse:
    """Replay a model along an observation.

    Parameters
    ----------
    shifts
        Distances of the nodes after the first from their measured positions (node) [m].
    offset
        Displacement added to all samples [m].
    """
    node_shifts = np.asarray(shifts, dtype=np.float64)
    target = observation.displacement + offset
    target[observation.nodes[1 : 1 + node_shifts.size]] += node_shifts
    target, order = _sort_between(target, observation.nodes)
    # A start that is not compared represents an unknown history, and one with a known zero was
    # reached from there: the contact is pressed before it moves to the first displacement. Moved
    # during pressing, more of it would stick.
    preloaded = int(
        (observation.start_sample > 0 or observation.starts_displaced) and target[0] != 0
    )
    time, normal = (
        np.append(values[:preloaded], values)
        for values in (observation.time, observation.normal_load)
    )
    loads = SampledLoads(time, normal, np.append(np.zeros(preloaded), target))
    # record totals only: the cost does not grow with the number of asperities
    job = Replay(ensemble, loads, record="totals", instrument=instrument)
    recorder = job.recorder(
        TotalsRecorder, names=("tangential_load", "tangential_stiffness", "friction_limit")
    )
    job.walk(recorder)
    load, stiffness, limit = (values[preloaded:] for values in recorder.values.values())
    stiffness = stiffness / (1 + stiffness / instrument.stiffness) + instrument.parallel_stiffness

    def restore_order(values: Floats) -> Floats:
        sorted_values = np.empty_like(values)
        sorted_values[order] = values
        return sorted_values

    displacement = restore_order(target)
    parallel_load = instrument.parallel_stiffness * displacement
    return ModelResponse(
        slope=restore_order(stiffness),
        displacement=displacement,
        tangential_load=restore_order(load) + parallel_load,
        parallel_load=parallel_load,
        friction_limit=restore_order(limit),
        order=order,
        displacement_noise=observation.displacement_noise,
    )


def find_forgotten(ensemble: Body, instrument: Instrument, observation: Observation) -> int | None:
    """Find the first sample from which on an unknown past changes the load by less than its noise; None if none."""
    target, _ = _sort_between(observation.displacement, observation.nodes)
    loads = SampledLoads(observation.time, observation.normal_load, target)
    bounds = Bounds(Replay(ensemble, loads, record="totals", instrument=instrument))
    collections.deque(bounds.blocks(), maxlen=0)
    largest = float(np.abs(observation.tangential_load).max(initial=0.0))
    is_wide = bounds.load_width > max(observation.load_noise, LEAST_NOISE * largest)
    forgotten = int(np.flatnonzero(is_wide).max(initial=-1)) + 1
    return forgotten if forgotten < is_wide.size else None


def compute_displacement(
    ensemble: Body, instrument: Instrument, measurement: Measurement
) -> Floats | None:
    """Replay the tangential load of a measurement; return the displacement of the drive (sample) [m].

    A load beyond the friction limit is held there. None if the tangential load is not replayed.
    """
    if (
        "tangential_load" not in measurement.channels
        or measurement.get("tangential_displacement") is None
    ):
        return None
    events = attrs.evolve(measurement, reduced=False).events()
    history = Replay(
        ensemble, events, record="totals", saturate=True, instrument=instrument
    ).dataset()
    moved, load = history.tangential_displacement.values, history.total_tangential_load.values
    # samples of one time are one step
    step = np.searchsorted(history.time.values, measurement.time, side="right") - 1
    return np.asarray(instrument.drive_displacement(moved, load))[step]


def _max_recent_stiffness(displacement: Floats, stiffness: Floats, reach: float) -> Floats:
    """Return the greatest stiffness of each sample, the one before it, and earlier ones within reach."""
    greatest = stiffness.copy()
    for back in range(1, min(displacement.size, MOST_BACK)):
        near = np.abs(displacement[back:] - displacement[:-back]) <= (
            math.inf if back == 1 else reach
        )
        if not near.any():
            break
        greatest[back:] = np.maximum(greatest[back:], np.where(near, stiffness[:-back], 0.0))
    return greatest


def find_load_steps(normal_load: Floats) -> Integers:
    """Return the ends of each step or ramp on which the normal load changes from sample to sample by more than noise.

    The samples inside a ramp are none: noise of the displacement would make each of them a
    reversal.
    """
    change = np.abs(np.diff(normal_load))
    # the last digit is not a step, although a load that rests on it seems free of noise
    threshold = max(
        10 * estimate_white_noise(normal_load),
        1e-2 * float(np.ptp(normal_load)),
        LEAST_STEP * float(normal_load.max()),
    )
    is_step = np.concatenate([[False], change > threshold, [False]])
    ends: Integers = np.flatnonzero(is_step[1:] != is_step[:-1])
    return ends


# -- residuals -------------------------------------------------------------------------------------


@attrs.frozen(eq=False)
class Residuals:
    """Residuals of a model along measured loops, and their distribution."""

    rms: float  #: root of the mean square [N]
    largest: float  #: the largest load that was measured [N]
    at_reversals: float
    #: at_reversals and along_sliding: fractions of the sum of squares that recur in all loops, in
    #: stick or partial slip of the model, and in sliding.
    along_sliding: float
    between_branches: float  #: fraction due to a constant offset of each branch
    #: (direction, bin) Fraction of the distance from one turning point to the next [1]
    position: Floats
    #: (direction, bin) Mean of measured less model load over all branches of a direction [N]; NaN
    #: in empty bins.
    mean: Floats

    def text(self) -> str:
        """Describe the size of the residuals and their distribution."""
        shares = {
            "the same in all loops before sliding": self.at_reversals,
            "the same in all loops during sliding": self.along_sliding,
            "offsets of branches": self.between_branches,
            "noise": 1 - self.at_reversals - self.along_sliding - self.between_branches,
        }
        ranked = sorted(shares.items(), key=lambda item: -item[1])
        breakdown = ", ".join(
            f"{100 * share:.0f} % {where}" for where, share in ranked if share >= 0.01
        )
        return f"rms residual {100 * self.rms / self.largest:.2g} % of the largest load; of its square {breakdown}"


def compute_residuals(
    observation: Observation, response: ModelResponse, compared: Integers | None = None
) -> Residuals:
    """Compute the residuals of a model at the samples compared, and their distribution.

    The position of a sample is its fraction of the distance from one turning point to the next.
    Residuals are split into their mean at a position over all branches of a direction, the mean of
    the rest over each branch, and the remainder; the three sums of squares add up.
    """
    samples = (
        np.arange(observation.start_sample, observation.time.size) if compared is None else compared
    )
    turns = observation.turns
    branch, cell = _find_branches(turns, samples), assign_position_bins(observation, samples)
    residual = (observation.tangential_load - response.tangential_load)[samples]
    mean = _means(cell, residual, 2 * POSITION_BINS)
    common = np.nan_to_num(mean)[cell]
    branch_offset = np.nan_to_num(_means(branch, residual - common, turns.size - 1))[branch]
    limit = response.friction_limit[samples]
    slides = np.abs(response.contact_load[samples]) >= SLIDES * limit
    total = float(residual @ residual) or 1.0
    positions = np.tile((np.arange(POSITION_BINS) + 0.5) / POSITION_BINS, (2, 1))
    return Residuals(
        rms=float(np.sqrt(np.mean(residual**2))),
        largest=float(np.abs(observation.tangential_load[samples]).max(initial=0.0)) or 1.0,
        at_reversals=float(np.sum(common[~slides] ** 2)) / total,
        along_sliding=float(np.sum(common[slides] ** 2)) / total,
        between_branches=float(branch_offset @ branch_offset) / total,
        position=positions,
        mean=mean.reshape(2, POSITION_BINS),
    )


def assign_position_bins(observation: Observation, samples: Integers) -> Integers:
    """Return the position bin of samples on their branches, falling branches after rising ones."""
    turns, displacement = observation.turns, observation.displacement
    branch = _find_branches(turns, samples)
    start, stroke = (
        displacement[turns[branch]],
        displacement[turns[branch + 1]] - displacement[turns[branch]],
    )
    fraction = np.divide(
        displacement[samples] - start, stroke, out=np.zeros(samples.size), where=stroke != 0
    )
    falls = (stroke < 0).astype(np.int64)
    bins: Integers = falls * POSITION_BINS + np.clip(
        (fraction * POSITION_BINS).astype(np.int64), 0, POSITION_BINS - 1
    )
    return bins


def _find_branches(turns: Integers, samples: Integers) -> Integers:
    branch: Integers = np.clip(np.searchsorted(turns, samples, side="right") - 1, 0, turns.size - 2)
    return branch


def _means(group: Integers, values: Floats, count: int) -> Floats:
    """Compute the mean of values in each group, NaN in empty ones."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.bincount(group, values, count) / np.bincount(group, minlength=count))


@attrs.frozen(eq=False)
class Comparison:
    """Comparison of a model with a measurement."""

    observation: Observation  #: the measurement
    response: ModelResponse  #: response of the model along the measurement
    instrument: Instrument = RIGID  #: instrument in series with the contact
    #: (sample) Displacement of the drive of the model with the measured tangential load [m], if the
    #: load is replayed.
    model_displacement: Floats | None = None
    #: response of the contact behind another instrument
    respond: Callable[[Instrument], ModelResponse] | None = None
    model: Loops | None = attrs.field(init=False)  #: loops of the model, None without a whole one

    @model.default
    def _model(self) -> Loops | None:
        observation = self.observation
        try:
            return loops_of_channels(
                observation.time,
                self.response.displacement,
                self.response.contact_load,
                observation.normal_load,
                dead_band=observation.dead_band,
                skip=observation.skip,
            )
        except NoLoopError:
            # without a whole loop the samples can still be compared
            return None

    def __repr__(self) -> str:
        return f"<Comparison: {', '.join(f'{label} {text}' for label, text in self.summary())}>"

    def _repr_html_(self) -> str:
        table = self.rows()
        return html_table(self.summary()) + (html_table(table[1:], table[0]) if table else "")

    @property
    def measured(self) -> Loops | None:
        """The measured loops, None without a whole one."""
        return self.observation.loops

    @property
    def difference(self) -> Floats:
        """Measured less model tangential load (sample) [N], from the first sample compared."""
        residual: Floats = self.observation.tangential_load - self.response.tangential_load
        return residual[self.observation.start_sample :]

    @property
    def displacement_difference(self) -> Floats | None:
        """Measured less model displacement (sample) [m], from the first sample compared; None unless T is replayed."""
        if self.model_displacement is None:
            return None
        residual: Floats = self.observation.displacement - self.model_displacement
        return residual[self.observation.start_sample :]

    def _rms_lines(self) -> list[tuple[str, str]]:
        """Return lines on the rms difference: of the displacement if the load is replayed, and of the load."""
        residuals, moved = self.residuals, self.displacement_difference
        share = f"{100 * residuals.rms / residuals.largest:.3g} % of the largest tangential load"
        text = f"{quantity_text(residuals.rms, 'N')}, {share}"
        if moved is None:
            return [("rms difference", text)]
        rms = float(np.sqrt(np.mean(moved**2)))
        stroke = (
            float(np.ptp(self.observation.displacement[self.observation.start_sample :])) or 1.0
        )
        of_displacement = f"{quantity_text(rms, 'm')}, {100 * rms / stroke:.3g} % of the range of the displacement"
        return [("rms difference", of_displacement), ("of the load, displacement replayed", text)]

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text) on the difference of model and measurement."""
        loads = [] if self.measured is None else self.measured.by_load().value.tolist()
        lines = [
            *self.observation.remarks,
            ("samples compared", f"{self.difference.size:,}"),
            ("dead band", quantity_text(self.observation.dead_band, "m")),
            ("loops", "none" if self.measured is None else f"{len(self.measured):,}"),
        ]
        if len(loads) > 1:
            load_list = ", ".join(quantity_text(load, "N", 3) for load in loads)
            over = "means below are over all loads; historysim loops has means at each load"
            lines.append(("normal loads", f"{load_list}; {over}"))
        return [*lines, *self._rms_lines(), *(("note", text) for text in self.notes)]

    @property
    def residuals(self) -> Residuals:
        """Residuals of the model, and their distribution."""
        return compute_residuals(self.observation, self.response)

    @functools.cached_property
    def notes(self) -> tuple[str, ...]:
        """Findings of the comparison: faults, drift, a compliance in series, or the form of the residuals."""
        findings = (*(self.measured.faults if self.measured else ()), *self._compliance())
        # these change the load along a branch, so they are corrected first
        if any(word in note for note in findings for word in ("look", "drift", "rises again")):
            return findings
        return (
            *findings,
            *diagnose_residuals(
                list(self._branches()), float(np.median(self.observation.node_deviation))
            ),
        )

    def _branches(self) -> Iterator[BranchSamples]:
        """Yield the whole branches at one load that are compared, except the first and the last."""
        observation, response = self.observation, self.response
        channels = (
            observation.time,
            response.displacement,
            observation.tangential_load,
            response.tangential_load,
            response.slope,
        )
        for start, stop in itertools.pairwise(observation.turns[1:-1].tolist()):
            normal = observation.normal_load[start : stop + 1]
            if (
                start >= observation.start_sample
                and stop - start >= FEWEST_OF_BRANCH
                and np.ptp(normal) <= ONE_LOAD * normal.max()
            ):
                yield BranchSamples.from_channels(
                    *(values[start : stop + 1] for values in channels)
                )

    def _compliance(self) -> list[str]:
        """Return a note on a record that is much softer than the model."""
        if self.measured is None or self.model is None or not self.measured.is_friction.all():
            return []
        # both by the same method: few samples on a steep branch make both look soft
        of_measured, of_model = (
            loops.statistics("tangential_stiffness") for loops in (self.measured, self.model)
        )
        measured_stiffness, model_stiffness = of_measured.mean, of_model.mean
        scatter = of_measured.standard_deviation if of_measured.count > 1 else 0.0
        error = CLEARLY * scatter / math.sqrt(of_measured.count or 1)
        if not 0 < measured_stiffness + error < SOFTER * model_stiffness:
            return []
        softer = (
            f"the record is softer at reversals than the model, {quantity_text(measured_stiffness, 'N/m', 3)} against "
            f"{quantity_text(model_stiffness, 'N/m', 3)}"
        )
        stiffness = 1 / (
            1 / measured_stiffness - 1 / model_stiffness + 1 / self.instrument.stiffness
        )
        if self.respond is not None:
            stiffness, left = self._best_in_series(stiffness)
            before = self.residuals.rms
            if left > MOST_LEFT * before:
                before_text, left_text = (quantity_text(rms, "N", 3) for rms in (before, left))
                note = (
                    f"{softer}: a compliance in series alone does not explain it, as the rms difference of "
                    f"{before_text} stays above {left_text} with any; friction, surface or materials differ as well"
                )
                return [note]
        series = quantity_text(stiffness, "N/m", 3)
        start = (
            f', with [instrument] lateral_stiffness = "{series}" to start from'
            if self.instrument.rigid
            else ""
        )
        return [
            f"{softer}: looks like a compliance in series of {series}; fit lateral_stiffness{start}"
        ]

    def _best_in_series(self, start: float) -> tuple[float, float]:
        """Return the stiffness in series that leaves the least rms difference [N/m], and that difference [N]."""
        from scipy.optimize import minimize_scalar

        assert self.respond is not None  # noqa: S101 - its caller has looked
        respond, observation = self.respond, self.observation

        def difference(logarithm: float) -> float:
            instrument = attrs.evolve(self.instrument, lateral_stiffness=math.exp(logarithm))
            return compute_residuals(observation, respond(instrument)).rms

        bounds = [math.log(start * factor) for factor in (1 / SERIES_RANGE, SERIES_RANGE)]
        best = minimize_scalar(
            difference, bounds=bounds, method="bounded", options={"xatol": 0.02, "maxiter": 16}
        )
        return math.exp(float(best.x)), float(best.fun)

    def rows(self) -> list[tuple[str, str, str]]:
        """Return a table of strings: quantity, measured, model; means over the loops ± their standard deviations."""
        if self.measured is None or self.model is None:
            return []
        table = [("quantity", "measured", "model")]
        for name, (label, unit) in {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}.items():
            # the displacements left out here are other definitions of the same length
            if not name.endswith("_gap") and name not in {
                "displacement_from_zero_load",
                "virgin_displacement",
            }:
                table.append((label, self.measured.text(name, unit), self.model.text(name, unit)))
        return table
