"""A model beside a measurement: what it does along the measured displacement, and what it leaves of the load.

The measured displacement is not free of noise, and a contact remembers every reversal. So a model does not follow the
samples: from one turning point to the next it passes the measured displacements in their order along the branch.
"""

import functools
import itertools
import math
from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import ArrayLike, Floats, Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import html_table
from historysim.errors import InputError
from historysim.loads.event_sequence import SampledLoads
from historysim.measured.advice import FEWEST_OF_BRANCH, BranchSamples, advice
from historysim.measured.loop_values import BRANCH_QUANTITIES, LOOP_QUANTITIES, NoLoopError
from historysim.measured.loops import Loops, check_skip, loops_of_channels, loops_of_measurement
from historysim.measured.reduction import (
    FEWEST_SPIKES,
    USUAL_STEPS,
    Measurement,
    check_moves,
    find_spikes,
    loop_dead_band,
    noise_of,
    turning_points,
)
from historysim.recording.recorder import TotalsRecorder
from historysim.replaying import Replay

# Change of the normal load from one sample to the next, over the greatest one, up to which it is no step of it.
LEAST_STEP = 5e-3
MOST_BACK = 64  # samples that are looked back to for the stiffness that noise may have met
PLACES = 40  # places that a branch is divided into
SLIDES = 0.95  # load of the model over its friction limit from which on it is along sliding
ONE_LOAD = 0.1  # move of the normal load on a branch, over its greatest value there, up to which it is at one load
FEWEST_MEANS = 16  # samples that a branch keeps at least where neighbours are averaged: they show how it bends
# Stiffness at reversals over that of the model below which a compliance in series has a note, and the standard errors
# by which it is below.
SOFTER, CLEARLY = 0.5, 3.0


@attrs.frozen(eq=False)
class Observation:
    """Samples of measured loops, in the order of their times."""

    time: Floats  #: (sample) [s]
    displacement: Floats  #: (sample) Measured tangential displacement: that of the drive [m]
    tangential_load: Floats  #: (sample) Measured tangential load [N]
    normal_load: Floats  #: (sample) Normal load [N], ≥ 0
    turns: Integers  #: (turn) Indices of the turning points of the displacement, with the first and the last sample
    #: (node) Indices of the samples at which the contact remembers the displacement: the turning points, and those
    #: before and after a step of the normal load.
    nodes: Integers
    #: (node) How far the true places of the nodes may be from the measured ones [m], as a standard deviation: by the
    #: noise of the displacement, and by half the way to the next sample, for a channel may turn between two samples.
    node_deviation: Floats
    #: (node) Where they are expected, less where they were measured [m]: a turn is beyond the outermost sample, in the
    #: mean by a quarter of the way to the next one where the displacement comes and goes evenly.
    node_offset: Floats
    displacement_noise: float
    #: displacement_noise and load_noise: standard deviations of displacement [m] and tangential load [N].
    load_noise: float
    reading_noise: float  #: standard deviation of a single reading of the displacement, as at the turning points [m]
    dead_band: float  #: the smallest swing of the displacement that is a reversal [m]
    loops: Loops | None  #: the measured loops; None where there is no whole one
    skip: int = 0  #: loops at the start that are not compared
    #: Whether the contact is pressed at displacement 0, and then moved to the first sample, since its zero is known.
    starts_displaced: bool = False
    first: int = 0  #: the sample that a comparison begins at: those before are walked through, and not compared
    remarks: tuple[tuple[str, str], ...] = ()  #: what was done to the samples before

    def thinned(self, most: int) -> "Observation":
        """Return an observation of all nodes, and of about so many of the samples between them, evenly."""
        stride = -(-self.time.size // most)
        if stride <= 1:
            return self
        kept = np.union1d(np.arange(0, self.time.size, stride), np.append(self.nodes, self.first))
        channels = "time", "displacement", "tangential_load", "normal_load"
        return attrs.evolve(
            self,
            **{name: getattr(self, name)[kept] for name in channels},
            turns=np.searchsorted(kept, self.turns),
            nodes=np.searchsorted(kept, self.nodes),
            first=int(np.searchsorted(kept, self.first)),
            loops=None,
        )

    def averaged(self, most: int) -> "Observation":
        """Return an observation of all nodes, and of means of neighbouring samples between them, about `most` in all.

        Each branch keeps `FEWEST_MEANS` samples or more. The noise of the means is estimated anew: it falls by the root
        of their number where it is white, and by less where it is correlated.
        """
        together = -(-self.time.size // most)
        if together <= 1:
            return self
        starts = []
        for node, end in itertools.pairwise(self.nodes.tolist()):
            count = end - node - 1
            means = min(count, max(-(-count // together), FEWEST_MEANS))
            starts += [[node], node + 1 + np.arange(means) * count // max(means, 1)]
        first_of = np.concatenate([*starts, self.nodes[-1:]])
        sizes = np.diff(first_of, append=self.time.size)
        names = "time", "displacement", "tangential_load", "normal_load"
        channels: dict[str, Any] = {name: np.add.reduceat(getattr(self, name), first_of) / sizes for name in names}
        white = 1 / math.sqrt(together)
        displacement_noise, load_noise = (
            float(np.clip(noise_of(channels[name]), white * noise, noise))
            for name, noise in (("displacement", self.displacement_noise), ("tangential_load", self.load_noise))
        )
        text = f"{self.time.size:,} samples as {first_of.size:,}: turning points, and means of {together} between them"
        return attrs.evolve(
            self,
            **channels,
            turns=np.searchsorted(first_of, self.turns),
            nodes=np.searchsorted(first_of, self.nodes),
            first=int(np.searchsorted(first_of, self.first)),
            displacement_noise=displacement_noise,
            load_noise=load_noise,
            remarks=(*self.remarks, ("averaged", text)),
        )


def observe(
    measurement: Measurement,
    *,
    skip: int = 0,
    displacement_noise: float | None = None,
    load_noise: float | None = None,
    parallel_stiffness: float = 0.0,
) -> Observation:
    """Return the samples of a measurement that a model is compared with, with turning points, loops and noise.

    Loops at the start are skipped; the noise of the displacement [m] and of the load [N] is estimated by default. Loops
    are those of the contact, without the load of a spring in parallel [N/m].
    """
    displacement, load = measurement["tangential_displacement"], measurement["tangential_load"]
    normal = measurement["normal_load"]
    measurement.check_pressed()
    displacement, spikes = _without_spikes(displacement)
    given = measurement.dead_band.get("tangential_displacement")
    check_moves(displacement, given)
    dead_band = loop_dead_band(displacement, given)
    turns = turning_points(displacement, dead_band)
    skip = check_skip(skip)
    start = 1 + 2 * skip if skip else 0
    if start >= turns.size - 1:
        raise InputError(
            f"{skip} loops are to be skipped, and the record has {max(turns.size - 2, 0) // 2}; expected fewer"
        )
    try:
        contact = measurement.without_spring(parallel_stiffness)
        loops = loops_of_measurement(contact, dead_band=dead_band, skip=skip)
    except NoLoopError:
        # without a whole loop the samples can still be compared
        loops = None
    if loops is not None and loops.trace.time.size > measurement.time.size:
        # one closed period: the cycles before it were not stored, so the model follows the record from a reversal on
        start = max(start, 1)
    noise = noise_of(displacement) if displacement_noise is None else displacement_noise
    nodes = np.union1d(turns, load_steps(normal))
    # half of the way from each sample to the farther one of its neighbours
    steps = np.abs(np.diff(displacement, prepend=displacement[:1], append=displacement[-1:]))
    half_step, offset = np.maximum(steps[:-1], steps[1:]) / 2, np.zeros(displacement.size)
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
        reading_noise=noise,
        dead_band=dead_band,
        loops=loops,
        skip=skip,
        starts_displaced=measurement.starts_displaced,
        first=int(turns[start]),
        remarks=(*measurement.remarks, *spikes),
    )


def _without_spikes(displacement: Floats) -> tuple[Floats, list[tuple[str, str]]]:
    """Return a displacement with the mean of both neighbours in place of its spikes, and a line that says so.

    A spike near a reversal would be taken for the turning point.
    """
    spikes = np.flatnonzero(find_spikes(displacement, USUAL_STEPS))
    if spikes.size < FEWEST_SPIKES:
        return displacement, []
    clean = displacement.copy()
    clean[spikes] = (displacement[spikes - 1] + displacement[spikes + 1]) / 2
    many = f"{spikes.size:,} of {displacement.size:,} readings of the displacement stand out from both neighbours"
    return clean, [("spikes", f"{many}: the mean of these stands in their place")]


@attrs.frozen(eq=False)
class ModelResponse:
    """What a model does at each sample of an observation."""

    displacement: Floats  #: (sample) Of the drive, which near a sample is that of the observation [m]
    tangential_load: Floats  #: (sample) [N]
    #: (sample) Slope of the load over the displacement of the drive [N/m]; the greatest one that the noise of the
    #: displacement may have met.
    stiffness: Floats
    slope: Floats  #: (sample) Slope of the load over the displacement of the drive at the sample itself [N/m]
    friction_limit: Floats  #: (sample) [N]
    parallel_load: Floats  #: (sample) Load of a spring in parallel, which is part of the tangential load [N]

    @property
    def contact_load(self) -> Floats:
        """Tangential load of the contact alone (sample) [N]."""
        load: Floats = self.tangential_load - self.parallel_load
        return load


def passed(
    ensemble: Ensemble,
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
    moved = np.asarray(shifts, dtype=np.float64)
    target = observation.displacement + offset
    target[observation.nodes[1 : 1 + moved.size]] += moved
    order = np.arange(target.size)
    for start, end in itertools.pairwise(observation.nodes):
        between = np.clip(target[start + 1 : end], *sorted((target[start], target[end])))
        ranks = np.argsort(between if target[end] >= target[start] else -between, kind="stable")
        target[start + 1 : end] = between[ranks]
        order[start + 1 : end] = start + 1 + ranks
    # A start that is not compared represents an unknown past, and one with a known zero was reached from there: the
    # contact was pressed before it was moved to the first displacement. Moved while pressed, more of it would stick.
    before = int((observation.first > 0 or observation.starts_displaced) and target[0] != 0)
    time, normal = (np.append(each[:before], each) for each in (observation.time, observation.normal_load))
    loads = SampledLoads(time, normal, np.append(np.zeros(before), target))
    # totals alone: the cost does not grow with the asperities
    job = Replay(ensemble, loads, record="totals", instrument=instrument)
    recorder = job.recorder(TotalsRecorder, names=("tangential_load", "tangential_stiffness", "friction_limit"))
    job.walk(recorder)
    load, stiffness, limit = (values[before:] for values in recorder.values.values())
    stiffness = stiffness / (1 + stiffness / instrument.stiffness) + instrument.parallel_stiffness

    def in_time(values: Floats) -> Floats:
        sorted_values = np.empty_like(values)
        sorted_values[order] = values
        return sorted_values

    displacement = in_time(target)
    parallel_load = instrument.parallel_stiffness * displacement
    return ModelResponse(
        slope=in_time(stiffness),
        displacement=displacement,
        tangential_load=in_time(load) + parallel_load,
        parallel_load=parallel_load,
        stiffness=in_time(_stiffest(target, stiffness, 2 * observation.displacement_noise)),
        friction_limit=in_time(limit),
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


def load_steps(normal_load: Floats) -> Integers:
    """Return the samples between which the normal load changes by much more than its noise."""
    change = np.abs(np.diff(normal_load))
    # the last step of a digitiser is none, though a load that rests on it seems to be free of noise
    least = max(10 * noise_of(normal_load), 1e-2 * float(np.ptp(normal_load)), LEAST_STEP * float(normal_load.max()))
    before = np.flatnonzero(change > least)
    steps: Integers = np.union1d(before, before + 1)
    return steps


# -- what a model leaves ---------------------------------------------------------------------------


@attrs.frozen(eq=False)
class Residuals:
    """What a model leaves of measured loops."""

    rms: float  #: root of the mean square [N]
    largest: float  #: the largest load that was measured [N]
    at_reversals: float
    #: at_reversals and along_sliding: shares of the squares that are alike in all loops, where the model sticks or
    #: slips in part, and where it slides.
    along_sliding: float
    between_branches: float  #: share that is a branch's own, all along it
    place: Floats  #: (direction, place) Share of the way from one turning point to the next [1]
    #: (direction, place) Measured less model load there, over all branches that rise and all that fall [N]; NaN where
    #: no sample is.
    mean: Floats

    def text(self) -> str:
        """Return how much is left, and where."""
        shares = {
            "the same in all loops before sliding": self.at_reversals,
            "the same in all loops during sliding": self.along_sliding,
            "offsets of branches": self.between_branches,
            "noise": 1 - self.at_reversals - self.along_sliding - self.between_branches,
        }
        parts = sorted(shares.items(), key=lambda item: -item[1])
        of = ", ".join(f"{100 * share:.0f} % {where}" for where, share in parts if share >= 0.01)
        return f"rms residual {100 * self.rms / self.largest:.2g} % of the largest load; of its square {of}"


def residuals_of(observation: Observation, response: ModelResponse, compared: Integers | None = None) -> Residuals:
    """Return what a model leaves of what was measured, at the samples compared, and where.

    Each sample is at a place of its branch, its share of the way from one turning point to the next. What is left of
    the load is split into its mean at that place over all branches of a direction, the mean of the rest over each
    branch, and what is left of both; their squares add up.
    """
    samples = np.arange(observation.first, observation.time.size) if compared is None else compared
    turns = observation.turns
    branch, cell = _branch_of(turns, samples), places_of(observation, samples)
    off = (observation.tangential_load - response.tangential_load)[samples]
    mean = _means(cell, off, 2 * PLACES)
    alike = np.nan_to_num(mean)[cell]
    own = np.nan_to_num(_means(branch, off - alike, turns.size - 1))[branch]
    limit = response.friction_limit[samples]
    slides = np.abs(response.contact_load[samples]) >= SLIDES * limit
    total = float(off @ off) or 1.0
    places = np.tile((np.arange(PLACES) + 0.5) / PLACES, (2, 1))
    return Residuals(
        rms=float(np.sqrt(np.mean(off**2))),
        largest=float(np.abs(observation.tangential_load[samples]).max(initial=0.0)) or 1.0,
        at_reversals=float(np.sum(alike[~slides] ** 2)) / total,
        along_sliding=float(np.sum(alike[slides] ** 2)) / total,
        between_branches=float(own @ own) / total,
        place=places,
        mean=mean.reshape(2, PLACES),
    )


def places_of(observation: Observation, samples: Integers) -> Integers:
    """Return the numbers of the places that samples have on their branches, those of falling branches behind."""
    turns, moved = observation.turns, observation.displacement
    branch = _branch_of(turns, samples)
    start, way = moved[turns[branch]], moved[turns[branch + 1]] - moved[turns[branch]]
    share = np.divide(moved[samples] - start, way, out=np.zeros(samples.size), where=way != 0)
    falls = (way < 0).astype(np.int64)
    places: Integers = falls * PLACES + np.clip((share * PLACES).astype(np.int64), 0, PLACES - 1)
    return places


def _branch_of(turns: Integers, samples: Integers) -> Integers:
    branch: Integers = np.clip(np.searchsorted(turns, samples, side="right") - 1, 0, turns.size - 2)
    return branch


def _means(group: Integers, values: Floats, count: int) -> Floats:
    """Return the mean of values in each group, NaN in those without."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.bincount(group, values, count) / np.bincount(group, minlength=count))


@attrs.frozen(eq=False)
class Comparison:
    """A model beside a measurement."""

    observation: Observation  #: what was measured
    response: ModelResponse  #: what the model does along it
    instrument: Instrument = RIGID  #: what the displacement was measured by
    #: What the model does between the turning points as they were measured, where the response is between fitted ones,
    #: which take up what a model lacks.
    between_turns: ModelResponse | None = None
    model: Loops | None = attrs.field(init=False)  #: loops of the model, None where it has no whole one

    @model.default
    def _model(self) -> Loops | None:
        seen = self.observation
        try:
            return loops_of_channels(
                seen.time,
                self.response.displacement,
                self.response.contact_load,
                seen.normal_load,
                dead_band=seen.dead_band,
                skip=seen.skip,
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
        """The measured loops, None where there is no whole one."""
        return self.observation.loops

    @property
    def difference(self) -> Floats:
        """Measured less model tangential load (sample) [N], from the first sample that is compared on."""
        off: Floats = self.observation.tangential_load - self.response.tangential_load
        return off[self.observation.first :]

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text) that say how far the two are apart."""
        left, loads = self.left, [] if self.measured is None else self.measured.by_load().value.tolist()
        lines = [
            *self.observation.remarks,
            ("samples compared", f"{self.difference.size:,}"),
            ("dead band", quantity_text(self.observation.dead_band, "m")),
            ("loops", "none" if self.measured is None else f"{len(self.measured):,}"),
        ]
        if len(loads) > 1:
            each = ", ".join(quantity_text(load, "N", 3) for load in loads)
            over = "means below are over all of them, those of historysim loops at each load"
            lines.append(("normal loads", f"{each}; {over}"))
        share = f"{100 * left.rms / left.largest:.3g} % of the largest tangential load"
        lines.append(("rms difference", f"{quantity_text(left.rms, 'N')}, {share}"))
        return [*lines, *(("note", text) for text in self.notes)]

    @property
    def left(self) -> Residuals:
        """What the model leaves, and where."""
        return residuals_of(self.observation, self.response)

    @functools.cached_property
    def notes(self) -> tuple[str, ...]:
        """What the record shows beside the model: faults, drift, a compliance in series, or what its misfit is like."""
        seen = (*(self.measured.faults if self.measured else ()), *self._compliance())
        # what moves the load along a branch in its own way is mended first
        if any(word in note for note in seen for word in ("look", "drift")):
            return seen
        return (*seen, *advice(list(self._branches()), float(np.median(self.observation.node_deviation))))

    def _branches(self) -> Iterator[BranchSamples]:
        """Yield the whole branches at one load that are compared, without the first and the last."""
        seen, response = self.observation, self.between_turns or self.response
        channels = (seen.time, response.displacement, seen.tangential_load, response.tangential_load, response.slope)
        for first, last in itertools.pairwise(seen.turns[1:-1].tolist()):
            normal = seen.normal_load[first : last + 1]
            if first >= seen.first and last - first >= FEWEST_OF_BRANCH and np.ptp(normal) <= ONE_LOAD * normal.max():
                yield BranchSamples.of(*(each[first : last + 1] for each in channels))

    def _compliance(self) -> list[str]:
        """Return a note on a record that is much softer than the model."""
        if self.measured is None or self.model is None or not self.measured.is_friction.all():
            return []
        # read off in one way: few samples on a steep branch make both look soft
        of_measured, of_model = (loops.statistics("tangential_stiffness") for loops in (self.measured, self.model))
        measured, whole = of_measured.mean, of_model.mean
        scatter = of_measured.standard_deviation if of_measured.count > 1 else 0.0
        error = CLEARLY * scatter / math.sqrt(of_measured.count or 1)
        if not 0 < measured + error < SOFTER * whole:
            return []
        series = quantity_text(1 / (1 / measured - 1 / whole + 1 / self.instrument.stiffness), "N/m", 3)
        start = f', with [instrument] lateral_stiffness = "{series}" to start from' if self.instrument.rigid else ""
        note = (
            f"the record is softer at reversals than the model, {quantity_text(measured, 'N/m', 3)} against "
            f"{quantity_text(whole, 'N/m', 3)}: looks like a compliance in series of {series}; fit lateral_stiffness"
        )
        return [note + start]

    def rows(self) -> list[tuple[str, str, str]]:
        """Return a table of strings: quantity, measured, model; means over the loops ± their standard deviations."""
        if self.measured is None or self.model is None:
            return []
        table = [("quantity", "measured", "model")]
        for name, (label, unit) in {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}.items():
            # what is left out here is the displacement read in another way
            if not name.endswith("_gap") and name not in {"displacement_from_zero_load", "virgin_displacement"}:
                table.append((label, self.measured.text(name, unit), self.model.text(name, unit)))
        return table
