"""Run a scenario, or the log of an earlier run: into memory, or into a result with its log beside it."""

import itertools
from pathlib import Path
from typing import TYPE_CHECKING

from historysim.basics.file_kinds import is_log, is_netcdf
from historysim.basics.notices import Teller, silent
from historysim.basics.processors import threads_of
from historysim.basics.targets import LOG, RESULT, Output, check_outputs
from historysim.errors import InputError
from historysim.loads.events import Event
from historysim.log import embedded_log
from historysim.log.file import LogFile, links_of
from historysim.log.header import LogHeader
from historysim.log.result import digest_attribute, log_beside, write_result
from historysim.recording import surface_group
from historysim.recording.compression import check_compression
from historysim.scenario import scenario

if TYPE_CHECKING:
    import xarray as xr


def run(
    path: str | Path | scenario.Scenario,
    output: str | Path | None = None,
    *,
    progress: bool = False,
    resume: bool = False,
    snapshot_every: int | None = None,
    compression: str = "none",
    threads: int | None = None,
    force: bool = False,
    tell: Teller = silent,
) -> "xr.Dataset":
    """Replay a scenario, or what an earlier run has left: its log, or its result.

    Parameters
    ----------
    path : path or Scenario
        The file of a scenario (TOML), of a log (``NAME.history``), or of a result, which is made again from itself
        alone; or what `load` has made of a scenario.
    output : path, optional
        A netCDF file (.nc) to write the history to, with the surface in the group ``surface``; an earlier result is
        replaced when the new one is complete. The log of a scenario stands beside it, as ``NAME.history``, from the
        beginning.
    progress : bool
        Show a progress bar on standard error where that is a terminal and the run is long.
    resume : bool
        Go on where an earlier run of the same scenario to the same output was ended: from the last snapshot of its
        log that can be used. What comes out is the same, bit for bit.
    snapshot_every : int, optional
        Rows between snapshots of the state in the log; by default some seconds of replay.
    compression : {"none", "zlib", "zstd"}
        Of the output.
    threads : int, optional
        Threads that record many asperities, and write them; one for each processor up to 4 by default. What comes out
        is the same, bit for bit.
    force : bool
        Replace files of these names that are no earlier result or log, too; never one that the scenario reads.
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
        scenario than the one to resume; or ``output`` is read, or is something else than an earlier result.
    LoadError
        A load that the contact cannot carry; the message names the event.
    OSError
        ``output`` or the log cannot be written, or another process is writing it.
    """
    if output is None:
        _check_interval(snapshot_every)
        check_compression(compression)
        return _in_memory(_source(path), progress=progress, threads=threads_of(threads), tell=tell)
    write(
        path,
        output,
        progress=progress,
        resume=resume,
        snapshot_every=snapshot_every,
        compression=compression,
        threads=threads,
        force=force,
        tell=tell,
    )
    import xarray as xr

    return xr.open_dataset(output, decode_times=False)


def write(
    path: "str | Path | scenario.Scenario",
    output: str | Path,
    *,
    progress: bool = False,
    resume: bool = False,
    snapshot_every: int | None = None,
    compression: str = "none",
    threads: int | None = None,
    force: bool = False,
    tell: Teller = silent,
) -> None:
    """Replay a scenario, or the log of an earlier run, into a file, without opening it; all as for `run`."""
    _check_interval(snapshot_every)
    check_compression(compression)
    threads = threads_of(threads)
    output, source = Path(output), _source(path)
    check_outputs(
        outputs_of(source, output),
        source.files if isinstance(source, scenario.Scenario) else [source],
        force=force,
    )
    with _log_of_run(source, output, resume=resume, tell=tell) as file:
        write_result(
            file,
            output,
            progress=progress,
            resume=resume,
            snapshot_every=snapshot_every,
            compression=compression,
            threads=threads,
            tell=tell,
        )


def _check_interval(snapshot_every: int | None) -> None:
    if snapshot_every is not None and not (isinstance(snapshot_every, int) and snapshot_every >= 1):
        raise InputError(f"snapshot_every is {snapshot_every!r}; expected a whole number of 1 or more")


def outputs_of(source: Path | scenario.Scenario, output: Path) -> tuple[Output, ...]:
    """Return the files that a run writes: a result, and its log, unless it is that log which is replayed."""
    result = Output(output, (RESULT,))
    if isinstance(source, Path) and is_log(source):
        return (result,)
    return result, Output(log_beside(output), (LOG,))


def _source(path: "str | Path | scenario.Scenario") -> "Path | scenario.Scenario":
    """Return a log or a result as its file, and anything else as a scenario."""
    if isinstance(path, str | Path) and (is_log(Path(path)) or is_netcdf(Path(path))):
        return Path(path)
    return scenario.as_scenario(path)


def head_of(loaded: scenario.Scenario, tell: Teller = silent) -> tuple[LogHeader, list[Event]]:
    """Resolve a scenario: the head of its log, and its events."""
    if loaded.sections.sweep is not None:
        tell(f"{loaded.path.name}: [sweep] is left to historysim sweep; this is the scenario as it stands without it")
    built = loaded.build(tell)
    surface = built.surface
    shown, attributes = surface_group.contents(surface.summits, surface.surface, surface.solutions)
    head = LogHeader.of(
        built.ensemble,
        scenario=loaded.text,
        title=loaded.title,
        metadata=loaded.metadata,
        seeds=loaded.seeds,
        substeps=loaded.substeps,
        saturate=loaded.saturate,
        record=loaded.record,
        instrument=loaded.instrument,
        surface=shown,
        surface_attributes=attributes,
    )
    return head, built.events


def _in_memory(path: Path | scenario.Scenario, *, progress: bool, threads: int, tell: Teller) -> "xr.Dataset":
    if isinstance(path, scenario.Scenario):
        head, events = head_of(path, tell)
        links = links_of(head, events)
    else:
        if is_log(path):
            with LogFile(path) as file:
                head, content = file.head, file.sound()
        else:
            head, content = embedded_log.read(path)
        events, links = content.events, content.links
    attributes = head.attributes | digest_attribute(links[-1])
    return head.replay(events, threads).dataset(attributes=attributes, progress=progress)


def _log_again(path: Path, beside: Path, *, resume: bool) -> LogFile:
    """Make the log of a result again, batch by batch, from the result alone."""
    head, content = embedded_log.read(path)
    if resume and beside.exists():
        file = LogFile(beside, write=True)
        if file.sound().links == content.links:
            return file
        file.close()
        raise InputError(
            f"{path}: was not made from {beside}, so the run cannot go on from there; run it without --resume to begin "
            "again"
        )
    file = LogFile.create(beside, head, content.events[: content.ends[1]])
    for first, last in itertools.pairwise(content.ends[1:]):
        file.append(content.events[first:last])
    return file


def _log_of_run(path: Path | scenario.Scenario, output: Path, *, resume: bool, tell: Teller) -> LogFile:
    """Open or make the log that a run writes; whoever has it is the only writer."""
    if isinstance(path, Path) and is_log(path):
        return LogFile(path, write=True)
    beside = log_beside(output)
    if isinstance(path, Path):
        return _log_again(path, beside, resume=resume)
    loaded = path
    if not (resume and beside.exists()):
        if resume:
            tell(f"{beside}: there is no log to resume from; the run starts at the beginning")
        head, events = head_of(loaded, tell)
        return LogFile.create(beside, head, events)
    file = LogFile(beside, write=True)
    if file.head.settings["scenario"] != loaded.text:
        file.close()
        raise InputError(
            f"{loaded.path}: is not the scenario that {beside} was made from, so the run cannot go on from there; run "
            f"it without --resume to begin again, or go on with the old one: historysim run {beside} --resume"
        )
    return file
