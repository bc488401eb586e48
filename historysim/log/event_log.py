"""`EventLog`: the log of a run, which alone reproduces it and can be queried at any time."""

import math
from collections.abc import Iterable
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, Unpack

import attrs
import numpy as np

from historysim.asperities.body import Body
from historysim.asperities.instrument import Instrument
from historysim.asperities.state import State
from historysim.basics.arguments import scalar
from historysim.basics.files import as_path, path_to_write
from historysim.basics.wording import Notify, count_text, silent
from historysim.errors import InputError
from historysim.loads import schedule
from historysim.loads.event_sequence import as_events, events_text, over_text, time_text
from historysim.loads.events import Event
from historysim.loads.forking import fork_waypoints
from historysim.loads.holding import apply_hold
from historysim.log.file import ENDING, Content, LogFile
from historysim.log.header import LogHeader
from historysim.log.result import start_before
from historysim.memory.binding import DISPLACED
from historysim.memory.paths import STILL, Goals, straight_paths
from historysim.recording.recorder import (
    DatasetRecorder,
    JobOptions,
    Selection,
    chosen_asperities,
)
from historysim.recording.unknown_past import past_lines
from historysim.replaying import Replay

if TYPE_CHECKING:
    import xarray as xr

_HELD = Goals(DISPLACED, *STILL)
HOLD = straight_paths(_HELD, _HELD)  # A path that leads nowhere and records a row


@attrs.frozen
class Verdict:
    """Result of checking a log: number of valid events from the start, their digest, and the problem after them."""

    events: int
    digest: str
    problem: str = ""

    @property
    def whole(self) -> bool:
        """True if no problem was found."""
        return not self.problem


class EventLog:
    """The log of a run: all inputs that determine its result, in one append-only file.

    Any number of programs may read a log while one writes it. The first `append` takes the writer's
    lock, which `close` gives back.

    Parameters
    ----------
    path : path
        An existing log (``NAME.history``); `create` makes one.

    Raises
    ------
    InputError
        There is no such file, or it is no log, or its head is damaged.
    OSError
        It cannot be opened.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> ensemble = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
    >>> with hs.EventLog.create("ball.history", ensemble, [hs.NormalLoad(0.0, 50e-3)]) as log:
    ...     log.append([hs.TangentialLoad(1.0, 5e-3)])
    ...     print(f"{log.state(at=0.5).tangential_load * 1e3:.2f} mN")
    2.50 mN
    """

    def __init__(self, path: str | Path | LogFile) -> None:
        self._file = path if isinstance(path, LogFile) else LogFile(as_path(path))

    @classmethod
    def create(
        cls,
        path: str | Path,
        ensemble: Body,
        events: Iterable[Event] = (),
        *,
        title: str = "",
        **options: Unpack[JobOptions],
    ) -> Self:
        """Make a log with an ensemble and the first events, in place of one of that name; options as for `replay`.

        The log has the waypoints of channels that `hold` holds. Raises InputError: what cannot be
        used. OSError: it cannot be written, or another process is writing it.
        """
        events = apply_hold(as_events(events), options.pop("hold", None), stacklevel=3)
        job = Replay(ensemble, (), **options)
        schedule.check_substeps(job.substeps)
        chosen_asperities(ensemble, (), job.record)
        return cls(
            LogFile.create(
                path_to_write(path, ENDING), LogHeader.from_replay(job, title=title), events
            )
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        """Return the number of events."""
        return len(self._file.sound().events)

    def close(self) -> None:
        """Close the file and release the writer's lock."""
        self._file.close()

    def __repr__(self) -> str:
        content = self._file.read()
        damage = ", damaged after them" if content.problem else ""
        asperities = count_text(len(self.ensemble), "asperity", "asperities")
        return f"<EventLog {self.path}: {events_text(content.events)}{damage}, {asperities}>"

    # -- contents ----------------------------------------------------------------------------------

    def summary(self) -> list[tuple[str, str]]:
        """Summarise the log in a few lines of (label, text)."""
        settings = self.settings
        return [
            ("title", settings["title"] or self.path.stem),
            ("asperities", f"{len(self.ensemble):,}"),
            ("events", f"{len(self):,}{over_text(self._file.sound().events)}"),
            ("substeps", str(settings["substeps"])),
            *past_lines(self._file.head.past),
            ("made with", f"historysim {settings['historysim_version']}, {settings['made_with']}"),
            ("digest", self.digest),
        ]

    @property
    def path(self) -> Path:
        """Path of the log."""
        return self._file.path

    @property
    def ensemble(self) -> Body:
        """The asperities stored in the log."""
        return self._file.head.ensemble

    @property
    def surface(self) -> dict[str, Any]:
        """Arrays of the group ``surface`` of the result, by name."""
        return self._file.head.surface

    @property
    def instrument(self) -> Instrument:
        """The instrument in series with the contact."""
        return self._file.head.instrument

    @property
    def settings(self) -> dict[str, Any]:
        """Settings in the head of the log: versions, scenario text, seeds, moduli, options."""
        return dict(self._file.head.settings)

    @property
    def digest(self) -> str:
        """SHA-256 of the whole log: the last link of the chain."""
        return self._file.sound().links[-1].hex()

    def events(self, start: int = 0, stop: int | None = None) -> list[Event]:
        """Return events by index, as a slice does; InputError if the log is damaged."""
        return list(self._file.sound().events[start:stop])

    def job(self) -> Replay:
        """Return the replay of the events with the settings of the head."""
        return self._file.head.replay(self._file.sound().events)

    def verify(self) -> Verdict:
        """Check the chain of digests, and return the valid part of the log."""
        content = self._file.read()
        return Verdict(len(content.events), content.links[-1].hex(), content.problem)

    # -- writing -----------------------------------------------------------------------------------

    def append(self, events: Event | Iterable[Event]) -> None:
        """Append events, in the order of their times, none before the last one: they are on the disk at the end.

        A channel runs straight between its own waypoints, so a new waypoint of a channel that was
        held since its last one also says how it got there.

        Raises
        ------
        InputError
            Events that cannot be used, or the log is damaged; nothing is appended.
        OSError
            Another process is writing it, or the disk is full; of very many events (more than
            65,536) the first may have been appended.
        """
        self._file.append([events] if not isinstance(events, Iterable) else list(events))

    def fork(self, at: float, path: str | Path, *, notify: Notify = silent) -> "EventLog":
        """Copy the past up to a time [s], with events at it, to a new log, so that another future can be appended.

        Channels that are between waypoints then, or held after their last one, get a waypoint with
        their present value; those between waypoints also get one at the last event. Without them,
        appended events would change the past. The intact part of a damaged log is copied, and
        `notify` receives the problem.

        Raises
        ------
        InputError
            A time before the first event or after the intact events of a damaged log, or the log
            itself as the new one.
        OSError
            The file cannot be written.
        """
        path, time = Path(path), scalar("at", at)
        if path.exists() and path.samefile(self.path):
            raise InputError(f"{path}: is the log itself; expected another name for the fork")
        content = self._file.read()
        events = content.events
        if content.problem:
            notify(
                f"{self.path}: is damaged: {content.problem}; the {len(events):,} events before are sound"
            )
            if events and time > (last_time := events[-1].time):
                sound, requested = time_text(last_time), time_text(time)
                raise InputError(
                    f"{self.path}: is sound up to t = {sound} only; expected a time up to there, not {requested}"
                )
        past = [event for event in events if event.time <= time]
        if not past:
            raise InputError(
                f"{self.path}: has no event up to t = {time_text(time)}; expected a time from its first event on"
                + (f", at t = {time_text(events[0].time)}" if events else "")
            )
        past += fork_waypoints(events, time, partial(self._state, content), self.instrument)
        past.sort(key=attrgetter("time"))
        return EventLog(LogFile.create(path_to_write(path, ENDING), self._file.head, past))

    # -- replaying ---------------------------------------------------------------------------------

    def replay(
        self,
        until: float = math.inf,
        *,
        record: Selection | None = None,
        substeps: int | None = None,
    ) -> "xr.Dataset":
        """Replay the log from its beginning to a time [s], of which the last row is.

        `record` and `substeps` are as for `historysim.replay`; by default as the log has them.

        Raises
        ------
        InputError
            The log is damaged or has no event by then.
        LoadError
            A load that the contact cannot carry.
        """
        time, job = _time("until", until), self.job()
        record, substeps = (
            job.record if record is None else record,
            job.substeps if substeps is None else substeps,
        )
        job = attrs.evolve(job, record=record, substeps=substeps)
        if job.steps(time) == 0:
            raise InputError(
                f"{self.path}: has no event up to t = {time_text(time)}; expected a later time"
            )
        return job.dataset(until=time, attributes=self._file.head.attributes)

    def state(self, at: float = math.inf, *, notify: Notify = silent) -> State:
        """Return the state at a time [s], from the last snapshot before it; `notify` gets why any is passed over.

        Before the first event nothing has happened; after the last, the channels are held.

        Raises
        ------
        InputError
            The log is damaged.
        LoadError
            A load before that time that the contact cannot carry.
        """
        return self._state(self._file.sound(), _time("at", at), notify)

    def _state(self, content: Content, time: float, notify: Notify = silent) -> State:
        if not content.events:
            virgin: State = self.ensemble.initial_state()
            return virgin
        # as the result was made, substeps and all, since they change the rounding of a state
        start = start_before(self._file, content, time, notify)
        return self._file.head.replay(content.events).state(until=time, start=start)

    def state_dataset(self, at: float = math.inf) -> "xr.Dataset":
        """Return the state at a time as a history of one step, with all asperities; parameters as for `state`."""
        content, job = self._file.sound(), self.job()
        end_time = content.events[-1].time if content.events else 0.0
        time, everyone = (
            end_time if at == math.inf else _time("at", at),
            np.arange(len(self.ensemble)),
        )
        target = DatasetRecorder(
            self.ensemble, everyone, 1, instrument=self.instrument, changes=job.changes
        )
        self.ensemble.advance_along(
            self._state(content, time), HOLD, rows=target.blank(1), asperities=everyone
        )
        target.record(np.array([time]))
        return target.dataset(job.attributes() | self._file.head.attributes)


def _time(name: str, value: float) -> float:
    return math.inf if value == math.inf else scalar(name, value)
