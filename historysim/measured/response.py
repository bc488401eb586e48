"""Response of a model along an observation: loads, slopes, and what an unknown past leaves open."""

import collections
import math

import attrs
import numpy as np

from historysim.asperities.body import Body
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import ArrayLike, Floats, Integers
from historysim.loads.event_sequence import SampledLoads
from historysim.measured.observation import Observation, sort_between
from historysim.measured.reduction import (
    Measurement,
)
from historysim.recording.recorder import TotalsRecorder
from historysim.recording.unknown_past import Bounds
from historysim.replaying import Replay

# preceding samples searched for the largest stiffness within the noise of the displacement
MOST_BACK = 64
LEAST_NOISE = 1e-9  # least noise of the load that counts, over the largest load


@attrs.frozen(eq=False)
class ModelResponse:
    """Response of a model at each sample of an observation."""

    displacement: Floats  #: (sample) Displacement of the drive, close to the measured one [m]
    contact_load: Floats  #: (sample) Tangential load of the contact alone [N]
    #: (sample) Slope of the load over the displacement of the drive at the sample itself [N/m]
    slope: Floats
    friction_limit: Floats  #: (sample) [N]
    #: of a spring in parallel, whose load is part of the tangential load [N/m]
    parallel_stiffness: float
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
    def tangential_load(self) -> Floats:
        """Tangential load of contact and spring (sample) [N]."""
        if self.parallel_stiffness == 0:
            return self.contact_load
        return self.contact_load + self.parallel_stiffness * self.displacement


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
    target, order = sort_between(target, observation.nodes)
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

    return ModelResponse(
        slope=restore_order(stiffness),
        displacement=restore_order(target),
        contact_load=restore_order(load),
        parallel_stiffness=instrument.parallel_stiffness,
        friction_limit=restore_order(limit),
        order=order,
        displacement_noise=observation.displacement_noise,
    )


def find_forgotten(ensemble: Body, instrument: Instrument, observation: Observation) -> int | None:
    """Find the first sample from which on an unknown past changes the load by less than its noise; None if none."""
    target, _ = sort_between(observation.displacement, observation.nodes)
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
    moved = history.tangential_displacement.values
    load = history.total_tangential_load.values
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
