"""An unknown past of a contact: two slid pasts bracket its tangential loads at every later time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.asperities.instrument import RIGID
from historysim.basics.arguments import Floats
from historysim.errors import InputError
from historysim.loads.event_sequence import is_planar
from historysim.loads.events import Event, TangentialDisplacement, TangentialLoad
from historysim.loads.schedule import Start, changes_geometry, event_times, friction_changes
from historysim.memory.binding import LOAD
from historysim.recording.recorder import DatasetRecorder

if TYPE_CHECKING:
    import xarray as xr

    from historysim.asperities.state import State

UNTOUCHED, UNKNOWN = "untouched", "unknown"
PASTS = (UNTOUCHED, UNKNOWN)
FORGOTTEN = "past_forgotten_time"  # attribute of the history
# distance of a slide, over the displacement at which the virgin contact slides; 2 turn any memory
# round
SLIDE = 2.5
NEGLIGIBLE = 1e-12  # width of a bracket that is rounding, relative to the largest values
BOUNDS = {"lower": "least", "upper": "largest"}


def check_past(_: object, __: object, value: str) -> None:
    """Check the name of a past."""
    if value not in PASTS:
        raise InputError(f"past is {value!r}; expected one of {', '.join(PASTS)}")


def check_written(past: str) -> None:
    """Check that a history of a replay may be written row by row, which has no bounds of an unknown past."""
    if past == UNKNOWN:
        raise InputError(
            'past is "unknown", whose bounds are computed in memory; expected job.dataset().to_netcdf(path), or '
            'past = "untouched"'
        )


def add_bounds(job: Any, history: "xr.Dataset", until: float) -> "xr.Dataset":  # noqa: ANN401 - a Replay, below
    """Return the history of a replay with the bounds that all pasts of its contact have at each step.

    A past is any history that ends where the contact, or its drive, is at the first event time.
    Each spring is a play, and plays keep the order of their initial strains: on a path in
    displacements no past is outside the two that slid there from either side.

    ``total_tangential_load_lower`` and ``_upper``, and the same of ``tangential_load`` of each
    recorded asperity. Where a tangential load or the drive of an instrument is controlled, springs
    keep their order only in a contact of one coefficient, and only for the sums over all of them:
    then there are bounds of ``total_tangential_load`` and ``tangential_displacement``. The
    attribute ``past_forgotten_time`` is the first recorded time from which on the bounds agree [s];
    NaN if they do not.
    """
    _check(job)
    start = job.state(until=float(event_times(job.events)[0]))
    slid = []
    for direction in (1.0, -1.0):
        target = job.recorder(DatasetRecorder, until=until)
        job.walk(target, start=Start(_slid_state(job, start, direction)), until=until)
        slid.append(target.dataset({}))

    follows = "tangential_displacement" if _is_displacement_free(job) else "tangential_load"
    names = ["total_tangential_load", *([follows] if follows in history else [])]
    width = np.zeros(history.sizes["step"])
    for name in names:
        both = [dataset[name].values for dataset in slid]
        bounds = dict(zip(BOUNDS, (np.minimum(*both), np.maximum(*both)), strict=True))
        for bound, text in BOUNDS.items():
            variable = history[name].copy(data=bounds[bound])
            variable.attrs["long_name"] = (
                f"{text} {history[name].attrs.get('long_name', name)} of all pasts"
            )
            history[f"{name}_{bound}"] = variable
        width = np.maximum(width, _relative_width(bounds["lower"], bounds["upper"]))
    known_from = int(np.flatnonzero(width > NEGLIGIBLE).max(initial=-1)) + 1
    is_forgotten = known_from < width.size
    history.attrs[FORGOTTEN] = float(history["time"].values[known_from]) if is_forgotten else np.nan
    return history


def _relative_width(lower: Floats, upper: Floats) -> Floats:
    """Return the width of a bracket at each step, over the largest value of the history."""
    size = max(float(np.abs(lower).max(initial=0.0)), float(np.abs(upper).max(initial=0.0)))
    width = (upper - lower).reshape(lower.shape[0], -1).max(axis=1, initial=0.0)
    relative: Floats = width / size if size else width
    return relative


def _slid_state(job: Any, start: "State", direction: float) -> "State":  # noqa: ANN401 - a Replay, below
    """Return the state at the position of another one, which the contact reached by sliding in a direction."""
    ensemble = job.ensemble
    # the place of the drive is known where it is controlled, that of the contact otherwise
    instrument = RIGID if start.tangential_control == LOAD else job.instrument
    place = instrument.drive_displacement(start.tangential_displacement, start.tangential_load)
    friction = float(np.max(ensemble.friction))
    reach = ensemble.pair.displacement_ratio * friction * max(start.approach, 0.0)
    reach += friction * start.normal_load / instrument.stiffness
    before = ensemble.advance(
        ensemble.initial_state(),
        normal_displacement=start.approach,
        tangential_displacement=place - direction * SLIDE * reach,
        instrument=instrument,
    )
    slid: State = ensemble.advance(before, tangential_displacement=place, instrument=instrument)
    return slid


def _is_displacement_free(job: Any) -> bool:  # noqa: ANN401 - a Replay, below
    """Return whether the displacement of the contact follows from a load, or from the drive of an instrument."""
    return not job.instrument.rigid or any(
        isinstance(event, TangentialLoad) for event in job.events
    )


def _check(job: Any) -> None:  # noqa: ANN401 - a Replay, below
    """Check that springs keep the order of their initial strains."""
    ensemble, events = job.ensemble, job.events
    reason = _exception(ensemble, events)
    groups = 1 if reason else int(ensemble.initial_state().memory.line.contact.groups)
    if groups > 1 and _is_displacement_free(job):
        raise InputError(
            f'past is "{UNKNOWN}", and the asperities have {groups:,} different friction coefficients, which keep no '
            "order where a load or the drive of an instrument is controlled; expected one coefficient, or tangential "
            "displacements of the contact"
        )
    if reason:
        raise InputError(
            f'past is "{UNKNOWN}", and {reason}, so that two slid pasts do not bracket all others; expected level '
            "asperities with constant coefficients, without wear and yielding, and loads in one tangential direction, "
            f'or past = "{UNTOUCHED}"'
        )


def _exception(ensemble: Any, events: Sequence[Event]) -> str:  # noqa: ANN401 - of any body
    """Return the property without which two pasts bracket all others; empty if there is none."""
    if is_planar(events):
        return "the loads have two tangential directions"
    if len({type(event) for event in events} & {TangentialLoad, TangentialDisplacement}) > 1:
        return "the tangential channel is controlled by loads and by displacements"
    if friction_changes(events) or changes_geometry(events):
        return "an event changes friction or geometry"
    if ensemble.laws or getattr(ensemble, "follow_sliding", False):
        return "the contact evolves"
    return "the asperities are inclined" if getattr(ensemble, "slope", None) is not None else ""
