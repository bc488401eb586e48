"""`Replay` bundles an ensemble, its events and the recording options: events → schedule → ensemble → recorder."""

import inspect
import math
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, Unpack

import attrs

from historysim.asperities.body import Body, check_body
from historysim.asperities.instrument import RIGID, Instrument, as_instrument
from historysim.asperities.state import State
from historysim.basics.arguments import Integers
from historysim.basics.system import resolve_threads
from historysim.basics.units import seconds
from historysim.basics.wording import html_of_fields, progress_bar
from historysim.errors import CurveEndError, FrictionLimitError, InputError, LoadError, PullOffError
from historysim.loads import schedule
from historysim.loads.event_sequence import as_events, events_text, time_text
from historysim.loads.events import Event
from historysim.loads.holding import apply_hold
from historysim.recording import provenance
from historysim.recording import recorder as recorders
from historysim.recording.recorder import JobOptions, Recorder, Selection, StateOnly
from historysim.recording.variables import Changes

if TYPE_CHECKING:
    import xarray as xr

RecorderType = TypeVar("RecorderType", bound=Recorder)


@attrs.frozen(eq=False, slots=False)  # slots would leave no place for cached properties
class Replay:
    """Load events across an ensemble with the recording options; computed on request.

    Parameters
    ----------
    ensemble : Ensemble, Patches or InclinedEnsemble
    events : sequence of Event, in the order of their times
    substeps : int
        Rows recorded per interval between event times; they do not change the result.
    saturate : bool
        Hold tangential loads beyond the friction limit at it, and flag the step, instead of raising.
    record : {"touching", "all", "totals"} or sequence of int
        Asperities to record: those that ever touch, all, none (totals alone), or a few by index.
    instrument : Instrument, optional
        In series with the contact; displacements of the events are those of its drive.
    threads : int, optional
        Threads that record many asperities, with the same bits; by default one per processor, to 4.
    hold : bool, optional
        Hold load channels at events that do not set them, by waypoints in ``events``. By default
        they ramp to their next waypoint, with a RampWarning if they pass such events.
    past : {"untouched", "unknown"}
        With "unknown" a Dataset also has the bounds that all earlier histories allow.

    Carrying it out may raise InputError, and LoadError with the event that the contact cannot carry.
    """

    ensemble: Body = attrs.field(validator=check_body)
    events: Sequence[Event] = attrs.field(converter=as_events, repr=events_text)
    substeps: int = attrs.field(default=1, kw_only=True)
    saturate: bool = attrs.field(default=False, kw_only=True)
    record: Selection = attrs.field(default="touching", kw_only=True)
    instrument: Instrument = attrs.field(default=RIGID, kw_only=True, converter=as_instrument)
    threads: int = attrs.field(default=None, kw_only=True, converter=resolve_threads, repr=False)
    hold: bool | None = attrs.field(default=None, kw_only=True, repr=False)  #: False once resolved
    past: str = attrs.field(default="untouched", kw_only=True, validator=recorders.check_past)

    def __attrs_post_init__(self) -> None:
        """Resolve ``hold`` once, so that a copy of the replay neither warns nor adds waypoints again."""
        if self.hold is not False:
            object.__setattr__(self, "events", apply_hold(self.events, self.hold, stacklevel=4))
            object.__setattr__(self, "hold", False)

    _repr_html_ = html_of_fields

    @cached_property
    def asperities(self) -> Integers | None:
        """Indices of the asperities that are recorded, ascending; None for totals alone."""
        return recorders.chosen_asperities(self.ensemble, self.events, self.record)

    @cached_property
    def changes(self) -> Changes:
        """Quantities that change in addition to the loads, and are recorded at each step."""
        return recorders.find_changes(self.ensemble, self.events, self.instrument)

    def steps(self, until: float = math.inf) -> int:
        """Return the number of rows that are recorded up to a time [s]."""
        return schedule.row_count(self.events, self.substeps, seconds(until))

    def attributes(self) -> dict[str, Any]:
        """Return the provenance attributes of the history."""
        return provenance.attributes(self.ensemble, self.events, self.instrument)

    def recorder(
        self, kind: type[RecorderType], *, until: float = math.inf, **options: Any
    ) -> RecorderType:
        """Make a recorder of a class for this replay, with its further options."""
        common: dict[str, Any] = {"instrument": self.instrument, "changes": self.changes}
        return kind(self.ensemble, self.asperities, self.steps(until), **common, **options)

    def dataset(
        self,
        *,
        until: float = math.inf,
        attributes: dict[str, Any] | None = None,
        progress: bool = False,
    ) -> "xr.Dataset":
        """Compute the history up to a time [s] in memory; ``attributes`` replace those of the same name."""
        target = self.recorder(recorders.DatasetRecorder, until=until)
        self.walk(target, until=until, progress=progress)
        history = target.dataset(self.attributes() | (attributes or {}))
        history.encoding[provenance.MADE_BY] = self
        bounds = provenance.find_bounds(self, until)
        return history if bounds is None else bounds.add_to(history)

    def write(self, path: str | Path, *, progress: bool = False) -> None:
        """Write the history to a netCDF file, which appears when it is complete."""
        from historysim.recording.netcdf import write_replay

        write_replay(self, path, progress=progress)

    def state(self, until: float = math.inf, *, start: schedule.Start | None = None) -> State:
        """Return the state at a time [s]: unloaded before the first event, held after the last."""
        return self.walk(self.recorder(StateOnly, until=until), until=until, start=start)

    def walk(
        self,
        target: Recorder,
        *,
        start: schedule.Start | None = None,
        until: float = math.inf,
        most_rows: int | None = None,
        progress: bool = False,
        on_event: Callable[[schedule.Cursor, State], None] | None = None,
    ) -> State:
        """Integrate the events up to a time [s], with a row at it, and return the last state.

        A block has at most ``most_rows``; ``on_event`` gets cursor and state at the end of an event.
        """
        # a later replay starts from the state of an event, or the last one
        is_continued = start is not None or on_event is not None or isinstance(target, StateOnly)
        start = start or schedule.Start(self.ensemble.initial_state())
        state = start.state
        how: dict[str, Any] = {"threads": self.threads}
        if target.asperities is not None:
            how["asperities"] = target.asperities
        plan = schedule.paths(
            self.events,
            self.substeps,
            min(most_rows or target.rows_at_once, target.rows_at_once),
            start=start.cursor,
            until=seconds(until),
            slide_times=is_continued or target.asperities is not None,
        )
        bar: dict[str, Any] = {"desc": "replaying", "initial": start.rows, "delay": 2}
        with progress_bar(progress, "step", target.steps, **bar) as done:
            for block in plan:
                rows = target.blank(block.row_time.size)
                state = self.advance_over(block, state, rows=rows, **how)
                target.record(block.row_time)
                if on_event is not None and block.cursor is not None:
                    on_event(block.cursor, state)
                done(block.row_time.size)
        target.conclude(state)
        return state

    def advance_over(self, block: schedule.PathBlock, state: State, **recorded: Any) -> State:
        """Advance a state over a block of paths; errors name the event."""
        ensemble, event = self.ensemble, block.event[0]
        how: dict[str, Any] = {"saturate": self.saturate, "instrument": self.instrument}
        try:
            recorded |= block.friction_options(len(ensemble))
            state = ensemble.advance_along(state, block.paths, until=block.share, **how, **recorded)
            if block.change is not None:
                event = block.change_event
                state = block.change.act(ensemble, state, **how)
        except (FrictionLimitError, CurveEndError, PullOffError, InputError) as error:
            event = event if event == block.change_event else block.event[error.path]
            kind = InputError if isinstance(error, InputError) else LoadError
            raise kind.for_event(event, time_text(self.events[event].time), error) from None
        return state


def replay(ensemble: Body, events: Sequence[Event], **options: Unpack[JobOptions]) -> "xr.Dataset":
    """Replay load events across an ensemble; parameters, errors and warnings as in `Replay`.

    The Dataset has the dimensions ``step`` and ``asperity``. It warns if nothing ever touches.
    """
    events = apply_hold(as_events(events), options.get("hold"), stacklevel=3)
    history = Replay(ensemble, events, **(options | {"hold": False})).dataset()
    provenance.warn_of_no_contact(ensemble, events)
    return history


replay.__signature__ = inspect.signature(Replay)  # type: ignore[attr-defined] # with the names of the options
