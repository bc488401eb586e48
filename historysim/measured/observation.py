"""Observations: samples of measured loops with noise, turning points and the samples that a contact remembers.

The measured displacement has noise, and a contact remembers every reversal. So a model does not
follow the samples in time: from one turning point to the next it takes the measured displacements
in ascending or descending order.
"""

import itertools
import math
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.measured.loop_values import NoLoopError
from historysim.measured.loops import Loops, check_skip, loops_of_measurement
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

# Change of the normal load between successive samples, over its largest value, up to which it is
# not a step.
LEAST_STEP = 5e-3
CHANNELS = "time", "displacement", "tangential_load", "normal_load"
FEWEST_MEANS = 16  # least number of means on a branch: they show its curvature


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
        return attrs.evolve(
            self,
            **{name: getattr(self, name)[samples] for name in CHANNELS},
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
        channels: dict[str, Any] = {
            name: np.add.reduceat(getattr(self, name), group_starts) / sizes for name in CHANNELS
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
    displacement = measurement["tangential_displacement"]
    load = measurement["tangential_load"]
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
    distance = displacement - sort_between(displacement, nodes)[0]
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


def sort_between(displacement: Floats, nodes: Integers) -> tuple[Floats, Integers]:
    """Return displacements that are monotone between nodes, and the sample that each of them is from."""
    target = displacement.copy()
    order = np.arange(displacement.size)
    lengths = np.diff(nodes)
    # branches of similar length are sorted as the rows of one array, filled up at their ends
    powers = np.frexp(lengths)[1]
    for power in np.unique(powers):
        rows = np.flatnonzero(powers == power)
        start = nodes[rows, None]
        place = np.arange(lengths[rows].max())
        is_sample = place < lengths[rows, None]
        samples = np.minimum(start + place, displacement.size - 1)
        ends = displacement[np.stack([start, nodes[rows + 1, None]])]
        between = np.clip(displacement[samples], ends.min(axis=0), ends.max(axis=0))
        along = np.where(ends[1] >= ends[0], between, -between)
        # a node is the first of its branch in any case
        ranks = np.argsort(np.where(is_sample, along, np.inf), axis=1, kind="stable")
        target[samples[is_sample]] = np.take_along_axis(between, ranks, axis=1)[is_sample]
        order[samples[is_sample]] = (start + ranks)[is_sample]
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
