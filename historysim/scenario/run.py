"""Replay: events → scheduler → ensemble → recorder. The only wiring."""

import math
import platform
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np
import numpy.typing as npt

from historysim import log
from historysim._version import __version__
from historysim.asperities import ensemble as ensembles
from historysim.asperities.ensemble import Ensemble, EnsembleState
from historysim.asperities.instrument import RIGID, Instrument, as_instrument
from historysim.errors import FrictionLimitError, InputError, LoadError
from historysim.loads import schedule as scheduler
from historysim.loads.events import Event, time_text
from historysim.log.file import ENDING, Content, LogFile, is_log, links_of
from historysim.log.head import Head
from historysim.log.snapshot import Snapshot, program, unpacked
from historysim.memory import kernel
from historysim.recording import recorder, surface_group
from historysim.recording.blocks import BlockRecorder, Blocks
from historysim.scenario import scenario

if TYPE_CHECKING:
    import xarray as xr

ROWS_BETWEEN_REPORTS = 1 << 12
"""Rows that are recorded before the progress bar moves on."""

SNAPSHOT_CELLS, MOST_SNAPSHOT_ROWS = 1 << 26, 1 << 16
"""Asperities times rows between snapshots by default, and the most rows: some seconds of replay."""

Teller = Callable[[str], None]


def silent(_: str) -> None:
    """Tell nobody."""


def replay(
    ensemble: Ensemble,
    events: Sequence[Event],
    *,
    substeps: int = 1,
    saturate: bool = False,
    record: recorder.Selection = "touching",
    instrument: Instrument = RIGID,
) -> "xr.Dataset":
    """Replay load events across an ensemble.

    Parameters
    ----------
    ensemble : Ensemble
    events : sequence of events
        In the order of their times; at one time, in the order in which they happen.
    substeps : int
        Rows recorded per interval between event times; they do not change the result.
    saturate : bool
        Hold tangential loads beyond the friction limit at the limit, and flag the step, instead of raising.
    record : {"touching", "all", "totals"} or sequence of int
        Asperities to record: those that touch at any time, all, none (totals alone), or a few by index.
    instrument : Instrument, optional
        In series with the contact: tangential displacements of the events are those of its drive, which is
        recorded beside that of the contact.

    Returns
    -------
    xarray.Dataset
        Dimensions ``step`` and ``asperity``; see `historysim.recording.variables` for what stands in it.

    Raises
    ------
    InputError
        Events, substeps, a selection or an instrument that cannot be used as they are.
    LoadError
        A load that the contact cannot carry; the message names the event.
    """
    if not isinstance(events, Iterable):
        raise InputError(f"events is {events!r}; expected a list of load events")
    events = list(events)
    asperities = recorder.chosen_asperities(ensemble, events, record)
    steps = scheduler.row_count(events, substeps)
    attributes = _attributes(ensemble, events, as_instrument(instrument))
    memory = recorder.DatasetRecorder(ensemble, asperities, steps, attributes, instrument=instrument)
    walk(ensemble, events, scheduler.stretches(events, substeps), memory, saturate=saturate)
    return memory.dataset()


def run(
    path: str | Path,
    output: str | Path | None = None,
    *,
    progress: bool = False,
    resume: bool = False,
    snapshot_every: int | None = None,
    compression: str = "none",
    tell: Teller = silent,
) -> "xr.Dataset":
    """Replay a scenario file, or the log of an earlier run.

    Parameters
    ----------
    path : path
        A scenario in TOML, or a log (``NAME.history``).
    output : path, optional
        A netCDF file to write the history to, with the surface in the group ``surface``; an existing one is replaced
        when the new one is complete. The log of a scenario stands beside it, as ``NAME.history``, from the beginning.
    progress : bool
        Show a progress bar on standard error where that is a terminal and the run is long.
    resume : bool
        Go on where an earlier run of the same scenario to the same output was ended: from the last snapshot of its
        log that can be used. What comes out is the same, bit for bit.
    snapshot_every : int, optional
        Rows between snapshots of the state in the log; by default some seconds of replay.
    compression : {"none", "zlib", "zstd"}
        Of the output.
    tell : callable, optional
        Takes notices for the user, such as which snapshot is passed over.

    Returns
    -------
    xarray.Dataset
        The history; read lazily from ``output`` where that is given.

    Raises
    ------
    InputError
        The scenario, or a file that it names, cannot be used as it is; or the log is damaged, or that of another
        scenario than the one to resume.
    LoadError
        A load that the contact cannot carry; the message names the event.
    OSError
        ``output`` or the log cannot be written, or another process is writing it.
    """
    import xarray as xr

    path = Path(path)
    if snapshot_every is not None and not (isinstance(snapshot_every, int) and snapshot_every >= 1):
        raise InputError(f"snapshot_every is {snapshot_every!r}; expected a whole number of 1 or more")
    recorder.check_compression(compression)
    if output is None:
        return _in_memory(path, progress=progress)
    output = Path(output)
    with _log_of_run(path, output, resume=resume, tell=tell) as file:
        project(
            file,
            output,
            progress=progress,
            resume=resume,
            snapshot_every=snapshot_every,
            compression=compression,
            tell=tell,
        )
    return xr.open_dataset(output, decode_times=False)


def log_beside(output: Path) -> Path:
    """Return the place of the log that belongs to a result.

    Raises
    ------
    InputError
        It would be the result itself.
    """
    beside = output.with_suffix(ENDING)
    if beside == output:
        raise InputError(f"{output}: is the name of a log; expected another ending for the result, such as .nc")
    return beside


def head_of(loaded: scenario.Scenario) -> tuple[Head, list[Event]]:
    """Resolve a scenario: the head of its log, and its events."""
    ground = loaded.ground()
    shown = surface_group.dataset(ground.summits, ground.surface)
    head = Head.of(
        loaded.ensemble(ground),
        scenario=loaded.text,
        title=loaded.title,
        seed=getattr(loaded.sections.surface, "seed", None),
        substeps=loaded.substeps,
        saturate=loaded.saturate,
        record=loaded.record,
        instrument=loaded.instrument,
        surface={str(name): variable.values for name, variable in shown.variables.items()},
        surface_attributes=shown.attrs,
    )
    return head, loaded.events()


def _in_memory(path: Path, *, progress: bool) -> "xr.Dataset":
    if is_log(path):
        with LogFile(path) as file:
            head, content = file.head, file.sound()
        events, links = content.events, content.links
    else:
        head, events = head_of(scenario.load(path))
        links = links_of(head, events)
    ensemble, instrument = head.ensemble, head.instrument
    asperities = recorder.chosen_asperities(ensemble, events, head.record)
    steps = scheduler.row_count(events, head.substeps)
    attributes = attributes_of(head, events) | {"log_digest": f"sha256:{links[-1].hex()}"}
    memory = recorder.DatasetRecorder(ensemble, asperities, steps, attributes, instrument=instrument)
    plan = scheduler.stretches(events, head.substeps, _most_rows(memory.columns))
    walk(ensemble, events, plan, memory, saturate=head.saturate, progress=progress)
    return memory.dataset()


def _log_of_run(path: Path, output: Path, *, resume: bool, tell: Teller) -> LogFile:
    """Open or make the log that a run writes; whoever has it is the only writer."""
    if is_log(path):
        return LogFile(path, write=True)
    beside = log_beside(output)
    loaded = scenario.load(path)
    if not (resume and beside.exists()):
        if resume:
            tell(f"{beside}: there is no log to resume from; the run starts at the beginning")
        head, events = head_of(loaded)
        return LogFile.create(beside, head, events)
    file = LogFile(beside, write=True)
    if file.head.settings["scenario"] != loaded.text:
        file.close()
        raise InputError(
            f"{path}: is not the scenario that {beside} was made from, so the run cannot go on from there; run it "
            f"without --resume to begin again, or go on with the old one: historysim run {beside} --resume"
        )
    return file


def project(
    file: LogFile,
    output: Path,
    *,
    progress: bool = False,
    resume: bool = False,
    snapshot_every: int | None = None,
    compression: str = "none",
    tell: Teller = silent,
) -> None:
    """Replay a log into a result, which appears under its name when it is complete; parameters as for `run`."""
    head, content = file.head, file.sound()
    ensemble, events = head.ensemble, content.events
    if not events:
        raise InputError(f"{file.path}: holds no events yet; expected at least one: historysim append adds them")
    asperities = recorder.chosen_asperities(ensemble, events, head.record)
    steps = scheduler.row_count(events, head.substeps)
    tip = f"sha256:{content.links[-1].hex()}"
    attributes = attributes_of(head, events) | {"log_digest": tip}
    blocks = Blocks(output, content.links[-1], 0 if asperities is None else asperities.size)
    keep = False
    try:
        if resume and _is_result_of(output, tip):
            return
        start = _start(file, content, blocks, tell) if resume else Start.of(ensemble)
        blocks.forget(start.rows)
        target = BlockRecorder(
            ensemble, asperities, steps, {}, instrument=head.instrument, blocks=blocks, written=start.rows
        )
        every = snapshot_every or _default_interval(len(ensemble))
        last = start.rows
        keep = last > 0

        def snapshot(standing: scheduler.Standing, state: EnsembleState) -> None:
            nonlocal last, keep
            if standing.rows - last < every or standing.rows == steps:
                return
            # first the rows, then the snapshot that says that they stand
            target.flush()
            ahead = max(standing.events, *(index + 1 for index in standing.heading))
            batches = content.batches_for(ahead)
            file.add_snapshot(Snapshot.of(standing, batches, content.links[batches], state))
            last, keep = standing.rows, True

        most_rows = min(every, _most_rows(target.columns))
        plan = scheduler.stretches(events, head.substeps, most_rows, start=start.standing)
        walk(ensemble, events, plan, target, saturate=head.saturate, progress=progress, start=start, after=snapshot)
        target.flush()
        _assemble(head, output, target, attributes, compression)
        keep = False
    except (LoadError, InputError):
        keep = False
        raise
    finally:
        blocks.close(keep=keep)


def _assemble(head: Head, output: Path, target: BlockRecorder, attributes: dict[str, Any], compression: str) -> None:
    """Put the blocks together."""
    blocks, settings = target.blocks, head.settings
    if compression == "none":
        blocks.check_room(output)
    with recorder.recording(
        output,
        target.ensemble,
        target.asperities,
        target.steps,
        attributes,
        target.instrument,
        compression=compression,
        unfinished=blocks.unfinished,
    ) as result:
        if head.surface:
            surface_group.write(result.file, surface_group.from_arrays(head.surface, settings["surface_attributes"]))
        for times, rows in blocks.all(target.steps):
            room = result.room(times.size)
            for name, values in rows._asdict().items():
                getattr(room, name)[...] = values
            result.record(times)


def _is_result_of(output: Path, tip: str) -> bool:
    """Tell whether a complete result of a log, as it is now, is there already."""
    import netCDF4

    try:
        with netCDF4.Dataset(output) as file:
            told = {name: file.getncattr(name) for name in ("log_digest", "complete") if name in file.ncattrs()}
    except (OSError, RuntimeError):
        return False
    return told.get("log_digest") == tip and bool(told.get("complete"))


@final
@attrs.define
class Unseen(recorder.Recorder):
    """Takes rows and keeps none of them, where only the state is asked for."""

    def room(self, count: int) -> kernel.Rows:
        """Return room for the next rows."""
        return ensembles.room(count, 0)

    def record(self, times: npt.NDArray[Any]) -> None:
        """Leave the rows."""


@attrs.frozen
class Start:
    """Where a replay begins: at the beginning, or at a snapshot."""

    state: EnsembleState
    standing: scheduler.Standing | None = None

    @classmethod
    def of(cls, ensemble: Ensemble) -> "Start":
        """Begin at the beginning."""
        return cls(ensemble.initial_state())

    @property
    def rows(self) -> int:
        """Rows that are recorded before."""
        return self.standing.rows if self.standing else 0


def usable(file: LogFile, content: Content, snapshot: Snapshot) -> Start | str:
    """Return where a snapshot lets a replay begin, or why it does not."""
    standing = snapshot.standing
    name = f"the snapshot at t = {time_text(standing.time)}"
    if snapshot.program != program():
        return f"{name} was made by {snapshot.program}; this is {program()}"
    if scheduler.standing_at(content.events, standing.events, file.head.substeps) != standing:
        return f"{name} does not reckon with events that were appended since"
    try:
        return Start(unpacked(file.head.ensemble, snapshot.state), standing)
    except InputError as error:
        return f"{name} {error}"


def start_before(
    file: LogFile, content: Content, time: float, tell: Teller = silent, *, rows: Iterable[int] | None = None
) -> Start:
    """Return the latest place up to a time where a replay of a log can begin.

    Parameters
    ----------
    file, content
        The log, and what stands in it.
    time : float
        [s].
    tell : callable
        Told which snapshots are passed over, and why.
    rows : iterable of int, optional
        Only after one of these numbers of rows.
    """
    allowed = None if rows is None else set(rows)
    for found in file.snapshots(content):
        if isinstance(found, str):
            tell(f"{file.path}: {found}; it is passed over")
            continue
        if found.standing.time > time or (allowed is not None and found.standing.rows not in allowed):
            continue
        start = usable(file, content, found)
        if isinstance(start, Start):
            return start
        tell(f"{file.path}: {start}; it is passed over")
    return Start.of(file.head.ensemble)


def _start(file: LogFile, content: Content, blocks: Blocks, tell: Teller) -> Start:
    start = start_before(file, content, math.inf, tell, rows=blocks.ends())
    if start.standing is None:
        tell(f"{file.path}: has no snapshot whose rows are there; the replay starts at the beginning")
    else:
        tell(f"{file.path}: going on from t = {time_text(start.standing.time)}, after {start.rows:,} rows")
    return start


def _default_interval(asperities: int) -> int:
    return max(1, min(MOST_SNAPSHOT_ROWS, SNAPSHOT_CELLS // asperities))


def _most_rows(columns: int) -> int:
    return max(1, min(ROWS_BETWEEN_REPORTS, recorder.BLOCK_CELLS // max(columns, 1)))


def walk(
    ensemble: Ensemble,
    events: Sequence[Event],
    plan: Iterable[scheduler.Stretch],
    target: recorder.Recorder,
    *,
    saturate: bool,
    progress: bool = False,
    start: Start | None = None,
    after: Callable[[scheduler.Standing, EnsembleState], None] | None = None,
) -> EnsembleState:
    """Walk what is scheduled, record its rows, and return the last state.

    Parameters
    ----------
    ensemble : Ensemble
    events : sequence of events
        For messages.
    plan : iterable of Stretch
    target : Recorder
    saturate, progress
        See `run`.
    start : Start, optional
        Where the plan begins; the beginning by default.
    after : callable, optional
        Called with where the schedule stands, and the state there, whenever a time is done.
    """
    from tqdm import tqdm

    start = start or Start.of(ensemble)
    state = start.state
    asperities = () if target.asperities is None else target.asperities
    total, done = target.steps, start.rows
    with tqdm(total=total, initial=done, unit="step", delay=2, disable=None if progress else True) as bar:
        for stretch in plan:
            rows = target.room(stretch.row_time.size)
            try:
                paths, instrument = stretch.paths, target.instrument
                if stretch.share < 1.0:
                    paths, instrument = _part(ensemble, state, stretch, instrument, saturate=saturate)
                state = ensemble.walk(
                    state, paths, rows=rows, asperities=asperities, saturate=saturate, instrument=instrument
                )
            except FrictionLimitError as error:
                raise _at(events, stretch.event[error.path], error) from None
            if stretch.friction is not None:
                try:
                    friction = stretch.friction.friction
                    state = ensemble.with_friction(state, friction, instrument=target.instrument)
                except InputError as error:
                    raise _at(events, stretch.friction_event, error) from None
            target.record(stretch.row_time)
            if after is not None and stretch.standing is not None:
                after(stretch.standing, state)
            bar.update(stretch.row_time.size)
    return state


def _part(
    ensemble: Ensemble, state: EnsembleState, stretch: scheduler.Stretch, instrument: Instrument, *, saturate: bool
) -> tuple[kernel.Paths, Instrument]:
    """Return a share of the one path of a stretch, with what drives it: straight in what the whole is straight in."""
    paths, share = stretch.paths, stretch.share
    if paths.normal_control[0] == paths.tangential_control[0] == kernel.LOAD:
        fractions = {name: getattr(paths, name) * share for name in ("normal_fraction", "tangential_fraction")}
        return paths._replace(**fractions), instrument
    end = ensemble.walk(state, paths, saturate=saturate, instrument=instrument)

    def on_the_way(start: float, stop: float) -> npt.NDArray[np.float64]:
        return np.array([start + share * (stop - start)])

    part = paths._replace(
        normal_control=np.array([kernel.DISPLACED], dtype=np.int8),
        normal_target=on_the_way(state.approach, end.approach),
        normal_fraction=np.ones(1),
        tangential_control=np.array([kernel.DISPLACED], dtype=np.int8),
        tangential_target=on_the_way(state.tangential_displacement, end.tangential_displacement),
        tangential_fraction=np.ones(1),
    )
    return part, RIGID


def _at(events: Sequence[Event], index: int, error: LoadError | InputError) -> LoadError | InputError:
    """Say which event an error belongs to."""
    message = f"event {index} at t = {time_text(events[index].time)}: {error}"
    return LoadError(message) if isinstance(error, LoadError) else InputError(message)


def attributes_of(head: Head, events: Sequence[Event]) -> dict[str, Any]:
    """Return the attributes of the result of a log."""
    return _attributes(head.ensemble, events, head.instrument) | _told(head)


def _told(head: Head) -> dict[str, Any]:
    """Attributes that the scenario adds."""
    title = {"title": head.settings["title"]} if head.settings["title"] else {}
    scenario_text = {"scenario": head.settings["scenario"]} if head.settings["scenario"] else {}
    return {**scenario_text, **title}


def _attributes(ensemble: Ensemble, events: Sequence[Event], instrument: Instrument) -> dict[str, Any]:
    import numba

    in_series = {} if instrument.rigid else {"lateral_stiffness": instrument.lateral_stiffness}
    return {
        "Conventions": "CF-1.11",
        "title": f"Load history of {len(ensemble)} asperities",
        "source": f"historysim {__version__}: exact traction memory of Hertz-Mindlin asperities",
        "history": f"replayed from {len(events)} events by historysim {__version__}",
        "historysim_version": __version__,
        "made_with": f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}",
        "contact_modulus": ensemble.pair.contact_modulus,
        "shear_modulus": ensemble.pair.shear_modulus,
        **in_series,
        "number_of_asperities": len(ensemble),
        "number_of_events": len(events),
        "event_digest": f"sha256:{log.digest(events)}",
    }
