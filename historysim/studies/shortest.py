"""`shortest`: the waypoints of a history that its contact still remembers."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.patches import Patches
from historysim.asperities.state import State
from historysim.basics.arguments import Array, Booleans, Integers
from historysim.basics.files import replacing
from historysim.basics.wording import brief
from historysim.errors import CurveEndError, FrictionLimitError, InputError, PullOffError
from historysim.loads import schedule
from historysim.loads.event_sequence import is_planar
from historysim.loads.events import (
    Event,
    NormalDisplacement,
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
)
from historysim.loads.retracing import EVOLVES, TWO_DIRECTIONS
from historysim.memory.binding import LOAD, view, with_groups
from historysim.memory.paths import Goals, Paths, drop_rows, straight_paths
from historysim.replaying import Replay

MOST_TRIED = 300  # waypoints up to which those that made vertices are dropped for a trial, too
SAME = 1e-13  # difference of anchors of the same state, relative to approach and displacement
NOTHING = -1  # origin of what is as at the start
PAIRS_A_LINE = 4  # of time and value in an amplitude table
KINDS = {
    kind.name: kind
    for kind in (NormalLoad, NormalDisplacement, TangentialLoad, TangentialDisplacement)
}


def shortest(subject: object, events: Sequence[Event] | None = None) -> list[Event]:
    """Return the waypoints that the contact still remembers at the end of a history, in order.

    They lead an untouched contact into the same state, with the same future, and dropping any of
    them changes that state. Both channels have a waypoint at each of their times, so that channels
    that ramped through an event keep its value. A tangential displacement is that of the drive, if
    there is an instrument in series.

    Parameters
    ----------
    subject : path, Scenario, EventLog, Replay, Dataset or Ensemble
        A scenario, also of a measured record, a log, or a result, as object or file; or the
        ensemble of ``events``.
    events : sequence of events, optional
        Of an ensemble.

    Raises
    ------
    InputError
        Two tangential directions, contacts that evolve, a change of friction or geometry, inclined
        asperities, or a subject without events.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> ball = hs.Ensemble(pair, 0.0, 1e-3, friction=0.2)
    >>> turns = [hs.NormalLoad(0.0, 50e-3)]
    >>> turns += [hs.TangentialLoad(1.0 + k, load * 1e-3) for k, load in enumerate([5, -2, 3, 1, 4])]
    >>> [event.value for event in hs.shortest(ball, turns) if isinstance(event, hs.TangentialLoad)]
    [0.0, 0.005, -0.002, 0.004]
    """
    job = _make_replay(subject, events)
    _check(job)
    waypoints = _Waypoints(job)
    chosen = waypoints.find_remembered()
    return [event for index in chosen for event in waypoints.list_events(int(index))]


def _make_replay(subject: object, events: Sequence[Event] | None) -> Replay:
    """Return the replay of a subject."""
    from historysim.log.event_log import EventLog
    from historysim.results.source import query_source
    from historysim.verbs import open as open_any

    if isinstance(subject, str | Path):
        opened = open_any(subject)
        close = getattr(opened, "close", None)
        try:
            return _make_replay(opened, events)
        finally:
            if close is not None:
                close()
    if events is not None:
        ensemble: Any = subject
        return Replay(ensemble, events)
    if isinstance(subject, Replay):
        return subject
    if isinstance(subject, EventLog):
        return subject.job()
    if isinstance(subject, xr.Dataset):
        job = query_source(subject, lambda source: source.job)
        if job is None:
            raise InputError(
                "the history does not come from a file that holds its events; expected the result of hs.replay, or the "
                "file of historysim run with NAME.history next to it"
            )
        return job
    replay = getattr(subject, "replay", None)
    if replay is None:
        raise InputError(
            f"{brief(subject)} has no events; expected a scenario, a log, a history or a Replay, or an ensemble with "
            "its events: hs.shortest(ensemble, events)"
        )
    job = replay()
    if not isinstance(job, Replay):
        raise InputError(
            f"{brief(subject)} has no events; expected a scenario, a log, a history or a Replay"
        )
    return job


def _check(job: Replay) -> None:
    """Check that the memory of a replay is a list of vertices."""
    ensemble: Any = job.ensemble
    if is_planar(job.events):
        raise InputError(f"shortest: {TWO_DIRECTIONS}")
    if not isinstance(ensemble, Ensemble | Patches):
        raise InputError("shortest: the asperities are inclined; expected level ones, hs.Ensemble")
    # with attraction the memory is a function of the approach as without
    if {*ensemble.laws} - {"attraction"} or getattr(ensemble, "follow_sliding", False):
        raise InputError(f"shortest: {EVOLVES}")
    if schedule.friction_changes(job.events) or schedule.changes_geometry(job.events):
        raise InputError(
            "shortest: an event changes friction or geometry; expected load events only"
        )


@attrs.frozen(eq=False)
class Memory:
    """Vertices of all groups, and the waypoint that made each; arrays are (group, vertex)."""

    label: Array
    anchor: Array
    holds: Booleans  #: whether there is a vertex
    origin: Integers

    @classmethod
    def read(cls, state: State, origin: Integers | None = None) -> "Memory":
        """Read the vertices of a state."""
        memory = with_groups(state.memory)
        line = memory.line
        groups, capacity = line.contact.groups, line.capacity
        depth = view(line.depth, groups)
        most = int(depth.max(initial=0))
        vertices = view(line.vertices, groups * capacity).reshape(groups, capacity)[:, :most]
        holds = np.arange(most) < depth[:, np.newaxis]
        label, anchor = (np.where(holds, vertices[name], np.nan) for name in ("label", "anchor"))
        return cls(
            label, anchor, holds, np.full(holds.shape, NOTHING) if origin is None else origin
        )

    def update(self, state: State, path: int) -> "Memory":
        """Return the memory after a path, whose vertices are from its end unless they were there before."""
        now = Memory.read(state)
        common = min(now.label.shape[1], self.label.shape[1])
        same = np.zeros(now.holds.shape, dtype=bool)
        both = now.holds[:, :common] & self.holds[:, :common]
        label, anchor = now.label[:, :common], now.anchor[:, :common]
        same[:, :common] = (
            both & (label == self.label[:, :common]) & (anchor == self.anchor[:, :common])
        )
        same = np.logical_and.accumulate(same, axis=1)
        origin = np.full(now.holds.shape, path)
        origin[:, :common] = np.where(same[:, :common], self.origin[:, :common], path)
        # where a group first touches depends on the beginning of the path
        touches = _has_vertex(now.holds) & ~_has_vertex(self.holds)
        origin[touches, :1] = path - 1
        return attrs.evolve(now, origin=origin)


def _has_vertex(holds: Booleans) -> Booleans:
    """Return whether each group has a vertex."""
    touches: Booleans = np.any(holds, axis=1)
    return touches


class _Waypoints:
    """The ends of the paths of a replay."""

    def __init__(self, job: Replay) -> None:
        self.job = job
        blocks = list(schedule.paths(job.events))
        self.paths: Paths = drop_rows(np.concatenate([block.paths for block in blocks]))
        self.start = job.ensemble.initial_state()

    def _advance(self, state: State, path: Paths) -> State:
        options: dict[str, Any] = {"saturate": self.job.saturate, "instrument": self.job.instrument}
        moved: State = self.job.ensemble.advance_along(state, path, **options)
        return moved

    def find_remembered(self) -> Integers:
        """Return the indices of the paths whose ends are remembered, ascending."""
        state, memory = self.start, Memory.read(self.start)
        self.values = np.zeros((self.paths.size, 2))
        for number in range(self.paths.size):
            path = self.paths[number : number + 1]
            state = self._advance(state, path)
            memory = memory.update(state, number)
            self.values[number] = self._read_values(state, path[0])
        origins = np.unique(np.append(memory.origin[memory.holds], self.paths.size - 1))
        return self._drop_redundant(origins[origins >= 0], state)

    def _read_values(self, state: State, path: np.void) -> tuple[float, float]:
        """Return the values of both channels at the end of a path, as they are controlled."""
        instrument = self.job.instrument
        normal = state.normal_load if path["normal_control"] == LOAD else state.approach
        load, displacement = state.tangential_request, state.tangential_displacement
        if path["tangential_control"][0] == LOAD:
            return normal, instrument.drive_load(displacement, load)
        return normal, instrument.drive_displacement(displacement, state.tangential_load)

    def list_events(self, number: int) -> list[Event]:
        """Return the waypoints of both channels at the end of a path."""
        path = self.paths[number]
        normal = NormalLoad if path["normal_control"] == LOAD else NormalDisplacement
        tangential = (
            TangentialLoad if path["tangential_control"][0] == LOAD else TangentialDisplacement
        )
        time = float(path["end"])
        kinds, values = (normal, tangential), self.values[number].tolist()
        # a channel that arrives at its own waypoint has the very number of it
        for index, channel in enumerate(("normal", "tangential")):
            fraction, target = path[f"{channel}_fraction"], path[f"{channel}_target"]
            if np.ravel(fraction)[0] == 1.0:
                values[index] = float(np.ravel(target)[0])
        return [kind(time, value) for kind, value in zip(kinds, values, strict=True)]

    def _drop_redundant(self, made: Integers, end: State) -> Integers:
        """Return the waypoints that made vertices, and those without which the contact would not have slipped.

        Waypoints are dropped in runs as long as the state stays the same, so that none is left that
        can be dropped.
        """
        near = np.unique(np.concatenate([made, np.maximum(made - 1, 0)]))
        every = np.arange(self.paths.size)
        chosen = near if self._is_sufficient(near, end) else every
        run = chosen.size
        while run > 0:
            stop = chosen.size - 1  # the last waypoint is where the contact is
            dropped = False
            while stop > 0:
                start = max(stop - run, 0)
                trial = chosen[start:stop]
                trial = trial if chosen.size <= MOST_TRIED else trial[~np.isin(trial, made)]
                without = chosen[~np.isin(chosen, trial)]
                if trial.size and self._is_sufficient(without, end):
                    chosen, dropped = without, True
                stop = start
            run = run if dropped and run == 1 else run // 2
        return chosen

    def _is_sufficient(self, chosen: Integers, end: State) -> bool:
        """Return whether the straight paths between some of the waypoints lead to a state."""
        path = self.paths[chosen]
        columns = path["normal_control"], path["tangential_control"][:, 0]
        normal, tangential = (
            Goals(control, self.values[chosen, index]) for index, control in enumerate(columns)
        )
        try:
            reached = self._advance(self.start, straight_paths(normal, tangential, recorded=False))
        except (FrictionLimitError, CurveEndError, PullOffError):
            return False
        return _is_same(reached, end)


def _is_same(reached: State, expected: State) -> bool:
    """Return whether two states have the same polylines, to rounding."""
    size = abs(expected.memory.line.approach) + abs(expected.memory.line.displacement)
    for group in range(expected.memory.line.contact.groups):
        found, wanted = reached.vertices(group), expected.vertices(group)
        if (found.size == 0) != (wanted.size == 0):
            return False
        if not found.size:
            continue
        size = max(size, float(np.abs(wanted["anchor"]).max()))
        ends = (
            abs(found["label"][-1] - wanted["label"][-1]),
            abs(found["anchor"][-1] - wanted["anchor"][-1]),
        )
        if max(ends) > SAME * size:
            return False
        labels = np.concatenate([found["label"], wanted["label"]])
        first, second = (
            np.interp(labels, each["label"], each["anchor"]) for each in (found, wanted)
        )
        if np.abs(first - second).max() > SAME * size:
            return False
    approach, displacement = (
        abs(getattr(reached.memory.line, name) - getattr(expected.memory.line, name))
        for name in ("approach", "displacement")
    )
    return bool(max(approach, displacement) <= SAME * size)


# ---- files


def write_waypoints(events: Sequence[Event], path: str | Path) -> None:
    """Write the waypoints of both channels to a file, in the format of its ending.

    ``.csv`` has the columns ``time [s]`` and the channels with their units, empty where a channel
    is controlled otherwise. ``.toml`` has ``[loading]`` of a scenario. ``.inp`` has a table
    ``*AMPLITUDE`` for each channel, with lines of up to four pairs of time and value, in SI, as
    Abaqus and CalculiX read it.
    """
    target = Path(path)
    writers = {".csv": _csv, ".toml": _toml, ".inp": _amplitudes}
    if target.suffix.lower() not in writers:
        raise InputError(
            f"{target}: expected the ending {' or '.join(writers)}, by which waypoints are written"
        )
    text = writers[target.suffix.lower()](events)
    with replacing(target) as unfinished:
        unfinished.write_bytes(text.encode("utf-8"))


def _pairs(events: Sequence[Event]) -> list[dict[str, float]]:
    """Return a row for each waypoint: its time, and the channels by name."""
    rows: list[dict[str, float]] = []
    for event in events:
        starts = not rows or event.time != rows[-1]["time"] or event.channel == "normal"
        if starts:
            rows.append({"time": event.time})
        rows[-1][event.name] = float(event.value)  # type: ignore[attr-defined] # of every load event
    return rows


def _csv(events: Sequence[Event]) -> str:
    rows = _pairs(events)
    names = [name for name in KINDS if any(name in row for row in rows)]
    lines = [",".join(["time [s]", *(f"{name} [{KINDS[name].unit}]" for name in names)])]
    columns = ("time", *names)
    lines += [",".join(repr(row[name]) if name in row else "" for name in columns) for row in rows]
    return "".join(f"{line}\r\n" for line in lines)


def _toml(events: Sequence[Event]) -> str:
    lines = [
        ", ".join(f"{name} = {value!r}" for name, value in row.items()) for row in _pairs(events)
    ]
    waypoints = "".join(f"    {{ {line} }},\n" for line in lines)
    return f"# waypoints that the contact remembers, from historysim\n[loading]\nwaypoints = [\n{waypoints}]\n"


def _amplitudes(events: Sequence[Event]) -> str:
    rows = _pairs(events)
    times = [row["time"] for row in rows]
    if len({*times}) < len(times):
        raise InputError(
            "two waypoints have one time, and an amplitude table has one value at each; expected events at different "
            "times, or the ending .csv or .toml"
        )
    text = "** waypoints that the contact remembers, from historysim; N, m, s\n"
    names = [name for name in KINDS if any(name in row for row in rows)]
    for channel in ("normal", "tangential"):
        kinds = [name for name in names if KINDS[name].channel == channel]
        if len(kinds) > 1:
            raise InputError(
                f"the {channel} channel is controlled by load and by displacement, and an amplitude table has one of "
                "them; expected events of one kind for each channel, or the ending .csv or .toml"
            )
        for name in kinds:
            pairs = [f"{row['time']!r}, {row[name]!r}" for row in rows]
            blocks = [
                pairs[start : start + PAIRS_A_LINE] for start in range(0, len(pairs), PAIRS_A_LINE)
            ]
            text += f"*AMPLITUDE, NAME={name.upper()}, TIME=TOTAL TIME\n"
            text += "".join(f"{', '.join(block)}\n" for block in blocks)
    return text
