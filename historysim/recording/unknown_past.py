"""An unknown past of a contact: two slid pasts bracket its tangential loads at every later time."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, final

import numpy as np

from historysim.asperities.instrument import RIGID
from historysim.basics.arguments import Array, Floats
from historysim.basics.wording import progress_bar
from historysim.errors import InputError
from historysim.loads import schedule
from historysim.loads.event_sequence import channel_values, components
from historysim.loads.events import Event, LoadEvent, TangentialDisplacement, TangentialLoad
from historysim.loads.schedule import changes_geometry, event_times, friction_changes
from historysim.memory.binding import LOAD
from historysim.recording.recorder import FORGOTTEN, UNKNOWN, UNTOUCHED, Recorder
from historysim.recording.variables import Variable, make_bounding_variables

if TYPE_CHECKING:
    import xarray as xr

    from historysim.asperities.state import State

# distance of a slide, over the displacement at which the virgin contact slides; 2 turn any memory
# round
SLIDE = 2.5
NEGLIGIBLE = 1e-12  # width of a bracket that is rounding, relative to the largest values

Rows = list[tuple[Variable, Array]]


def past_lines(past: str) -> list[tuple[str, str]]:
    """Return the line of a summary on the past of a replay; none for an untouched one."""
    text = "unknown: results have the bounds that all earlier histories allow"
    return [("past", text)] if past == UNKNOWN else []


@final
class _PastRows(Recorder):
    """Recorder of rows that are used before the next ones are filled."""

    def record(self, times: Array) -> None:
        """Leave the rows as they are."""


class Bounds:
    """Bounds that all pasts of the contact of a replay have at each step, computed block by block.

    A past is any history that ends where the contact, or its drive, is at the first event time.
    Each spring is a play, and plays keep the order of their initial strains: on a path in
    displacements no past is outside the two that slid there from either side.

    There are bounds of ``total_tangential_load``, and of ``tangential_load`` of each recorded
    asperity. Where a tangential load or the drive of an instrument is controlled, springs keep
    their order only in a contact of one coefficient, and only for the sums over all of them: then
    there are bounds of ``total_tangential_load`` and ``tangential_displacement``.
    """

    def __init__(self, job: Any, until: float = math.inf) -> None:  # noqa: ANN401 - a Replay, below
        check_bracketed(job.ensemble, job.events, job.instrument)
        self._job, self._until = job, until
        is_free = _is_displacement_free(job.events, job.instrument)
        recorder = job.recorder(_PastRows, until=until)
        recorded = {item.name: item for item in (*recorder.totals, *recorder.per_asperity)}
        follows = "tangential_displacement" if is_free else "tangential_load"
        self._bounded = [
            recorded[name] for name in ("total_tangential_load", follows) if name in recorded
        ]
        self.times = np.zeros(recorder.steps)
        self._widths = np.zeros((len(self._bounded), recorder.steps))
        self._sizes = np.zeros(len(self._bounded))

    @property
    def variables(self) -> list[Variable]:
        """Variables of the bounds."""
        return [bound for variable in self._bounded for bound in make_bounding_variables(variable)]

    def blocks(self, *, progress: bool = False) -> Iterator[tuple[slice, Rows]]:
        """Yield the bounds in blocks of rows: which rows, and the values of each variable."""
        job, until = self._job, self._until
        start = job.state(until=float(event_times(job.events)[0]))
        states = [_slid_state(job, start, direction) for direction in (1.0, -1.0)]
        pasts = [job.recorder(_PastRows, until=until) for _ in states]
        columns = () if job.asperities is None else job.asperities
        plan = schedule.paths(job.events, job.substeps, pasts[0].rows_at_once, until=until)
        filled = 0
        with progress_bar(progress, "step", self.times.size, desc="bounds", delay=2) as done:
            for block in plan:
                count = block.row_time.size
                for index, past in enumerate(pasts):
                    rows = past.blank(count)
                    states[index] = job.advance_over(
                        block, states[index], rows=rows, asperities=columns, threads=job.threads
                    )
                where = slice(filled, filled + count)
                self.times[where] = block.row_time
                if count:
                    yield where, self._bound(where, pasts)
                filled += count
                done(count)

    def _bound(self, where: slice, pasts: list[_PastRows]) -> Rows:
        """Return the bounds of some rows, and note how far apart they are."""
        bounds: Rows = []
        for index, variable in enumerate(self._bounded):
            values = [
                variable.values(past.rows, self._job.ensemble, self._job.instrument)
                for past in pasts
            ]
            lower, upper = np.minimum(*values), np.maximum(*values)
            bounds += zip(make_bounding_variables(variable), (lower, upper), strict=True)
            width = (upper - lower).reshape(lower.shape[0], -1)
            self._widths[index, where] = width.max(axis=1, initial=0.0)
            largest = float(np.abs([lower, upper]).max(initial=0.0))
            self._sizes[index] = max(self._sizes[index], largest)
        return bounds

    @property
    def load_width(self) -> Floats:
        """Distance of the bounds of the total tangential load (step) [N], after all blocks."""
        width: Floats = self._widths[0]
        return width

    @property
    def forgotten_time(self) -> float:
        """First recorded time from which on the bounds agree [s], after all blocks; NaN if none."""
        sizes = np.where(self._sizes > 0.0, self._sizes, 1.0)[:, np.newaxis]
        apart = (self._widths / sizes > NEGLIGIBLE).any(axis=0)
        known_from = int(np.flatnonzero(apart).max(initial=-1)) + 1
        return float(self.times[known_from]) if known_from < self.times.size else math.nan

    def add_to(self, history: "xr.Dataset") -> "xr.Dataset":
        """Add the bounds to a history, and return it.

        The attribute ``past_forgotten_time`` is the first recorded time from which on the bounds
        agree [s]; NaN if they do not.
        """
        for variable in self.variables:
            shape = [history.sizes[name] for name in variable.dimensions]
            empty = np.empty(shape, variable.dtype)
            history[variable.name] = variable.dimensions, empty, variable.attributes
            history[variable.name].encoding = {"_FillValue": None, "dtype": variable.dtype}
        for where, rows in self.blocks():
            for variable, values in rows:
                history[variable.name].values[where] = values
        history.attrs[FORGOTTEN] = self.forgotten_time
        return history


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


def _is_displacement_free(events: Sequence[Event], instrument: Any) -> bool:  # noqa: ANN401 - an Instrument
    """Return whether the displacement of the contact follows from a load, or from the drive of an instrument."""
    return not instrument.rigid or TangentialLoad in _kinds(events)


def _kinds(events: Sequence[Event]) -> set[type[LoadEvent]]:
    """Return the types of the tangential events."""
    kinds = TangentialLoad, TangentialDisplacement
    return {kind for kind in kinds if channel_values(events, kind).size}


def check_bracketed(ensemble: Any, events: Sequence[Event], instrument: Any) -> None:  # noqa: ANN401 - of any body
    """Check that springs keep the order of their initial strains."""
    reason = _exception(ensemble, events)
    groups = 1 if reason else int(ensemble.initial_state().memory.line.contact.groups)
    if groups > 1 and _is_displacement_free(events, instrument):
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
    if 2 in components(events):
        return "the loads have two tangential directions"
    if len(_kinds(events)) > 1:
        return "the tangential channel is controlled by loads and by displacements"
    if friction_changes(events) or changes_geometry(events):
        return "an event changes friction or geometry"
    if {*ensemble.laws} - {"attraction"} or getattr(ensemble, "follow_sliding", False):
        return "the contact evolves"
    return "the asperities are inclined" if getattr(ensemble, "slope", None) is not None else ""
