"""Run a scenario, or the log or the result of an earlier run: into memory, or into a result with its log beside it."""

import itertools
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import attrs

from historysim.basics.files import is_log, is_netcdf
from historysim.basics.targets import LOG, RESULT, STORE, Output, check_outputs, is_store_name
from historysim.basics.wording import Notify, shell_word, warn
from historysim.errors import InputError
from historysim.loads.events import Event
from historysim.log import embedded_log
from historysim.log.file import LogFile, chain_links
from historysim.log.header import LogHeader
from historysim.log.result import RunOptions, digest_attribute, log_path_for, write_result
from historysim.recording import surface_group
from historysim.scenario.scenario import Scenario, load

if TYPE_CHECKING:
    import xarray as xr


def run(  # noqa: PLR0913 - the options of the command
    path: str | Path | Scenario,
    output: str | Path | None = None,
    *,
    progress: bool = False,
    resume: bool = False,
    snapshot_every: int | None = None,
    compression: str = "none",
    threads: int | None = None,
    force: bool = False,
    record: str | None = None,
    cluster: str | None = None,
    notify: Notify | None = None,
) -> "xr.Dataset":
    """Run a scenario, a log or a result.

    Parameters
    ----------
    path : path or Scenario
        A scenario or its file (TOML), a log (``NAME.history``), or a result, which is made again from itself alone.
    output : path, optional
        A netCDF file (.nc) to write the history to, with the surface in the group ``surface``; an earlier result is
        replaced when the new one is complete. The log of a scenario stands beside it, as ``NAME.history``, from the
        beginning. Or a zarr store (.zarr), whose blocks are computed in parallel.
    progress : bool
        Show a progress bar on standard error where that is a terminal and the run is long.
    resume : bool
        Go on where an earlier run of the same scenario to the same output was ended: from the last snapshot of its
        log that can be used. What comes out is the same, bit for bit.
    snapshot_every : int, optional
        Rows between snapshots of the state in the log; by default some seconds of replay, and more if all snapshots
        would be larger than 1 GB.
    compression : {"none", "zlib", "zstd"}
        Of the output.
    threads : int, optional
        Threads that record many asperities, and write them; one for each processor up to 4 by default. What comes out
        is the same, bit for bit.
    force : bool
        Replace files of these names that are no earlier result or log, too; never one that the scenario reads.
    record : "totals", optional
        Write the log, its snapshots and the totals, and no variable of the asperities: ``hs.open("NAME.history",
        chunks=…)`` computes these where they are read. By default what the scenario records.
    cluster : str, optional
        Address of the scheduler of a dask cluster that computes the blocks of a zarr store; it reads the log under the
        same path.
    notify : callable, optional
        Called with each notice (str), such as which snapshot is not used; by default those on how a
        measured record was read are a UserWarning each.

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

    Examples
    --------
    >>> history = hs.run("scenarios/04_normal_up_tangential_up.toml")
    >>> print(f"{float(history.tangential_displacement.max()) * 1e9:.3f} nm")
    5.003 nm
    """
    notify = notify or _of_records
    options = RunOptions(
        progress, resume, snapshot_every, compression, threads, force, notify, record=record, cluster=cluster
    )
    source = source_of(path)
    if output is None:
        header, events, link = source.content(notify)
        attributes = header.attributes | digest_attribute(link)
        job = options.apply_record(header.replay(events, options.threads))
        with source.locate_errors():
            return job.dataset(attributes=attributes, progress=progress)
    write(source, Path(output), options)
    import xarray as xr

    if is_store_name(Path(output)):
        history: xr.Dataset = xr.open_zarr(output, chunks=None, decode_times=False, consolidated=False)
        return history
    return xr.open_dataset(output, decode_times=False)


def _of_records(_: str) -> None:
    """Drop a notice, except those on measured records, which are warnings."""


def write(source: "Source", output: Path, options: RunOptions, *beside: Output) -> None:
    """Replay a source into a result, without opening it; first check that it, and files beside it, can be written."""
    log = [Output(log_path_for(output), (LOG,))] if source.makes_log else []
    check_outputs([Output(output, (RESULT, STORE)), *log, *beside], source.files, force=options.force)
    in_store = is_store_name(output)
    if in_store:
        from historysim.log.zarr_result import check_options, write_zarr

        check_options(output, options)
    elif options.cluster is not None:
        raise InputError(f"cluster: {output} is written by one process; expected a zarr store (.zarr) as output")
    with source.log(log_path_for(output), options) as file, source.locate_errors():
        if in_store:
            write_zarr(file, output, options)
        else:
            write_result(file, output, options)


@attrs.frozen
class Source:
    """What a run replays: here the log of an earlier run, which the run goes on writing."""

    makes_log: ClassVar[bool] = False  #: whether the log is a new one beside the result

    path: Path

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that are read."""
        return (self.path,)

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:  # noqa: ARG002 - of a scenario
        """Return the header and the events of the log of such a run, and the last link of its chain."""
        with LogFile(self.path) as file:
            content = file.sound()
            return file.head, content.events, content.links[-1]

    def log(self, beside: Path, options: RunOptions) -> LogFile:  # noqa: ARG002 - it is there already
        """Open the log that a run writes, or make it ``beside`` the result; whoever has it is the only writer."""
        return LogFile(self.path, write=True)

    def locate_errors(self) -> AbstractContextManager[None]:
        """Say of an event that cannot be carried out where it stands in what is replayed, if it has a place there."""
        return nullcontext()


@attrs.frozen
class _ScenarioSource(Source):
    """A scenario."""

    makes_log = True
    scenario: Scenario

    @property
    def files(self) -> tuple[Path, ...]:
        return self.scenario.files

    def locate_errors(self) -> AbstractContextManager[None]:
        return self.scenario.locate_errors()

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:
        header, events = self._resolved(notify)
        return header, events, chain_links(header, events)[-1]

    def log(self, beside: Path, options: RunOptions) -> LogFile:
        if not (options.resume and beside.exists()):
            if options.resume:
                options.notify(f"{beside}: there is no log to resume from; the run starts at the beginning")
            return LogFile.create(beside, *self._resolved(options.notify))
        file = LogFile(beside, write=True)
        if file.head.settings["scenario"] != self.scenario.text:
            file.close()
            raise InputError(
                f"{self.path}: is not the scenario that {beside} was made from, so the run cannot go on from "
                "there; run it without --resume to begin again, or go on with the old one: "
                f"historysim run {shell_word(beside)} --resume"
            )
        return file

    def _resolved(self, notify: Notify) -> tuple[LogHeader, Sequence[Event]]:
        scenario = self.scenario
        if scenario.sections.sweep is not None:
            notify(f"{self.path.name}: ignoring [sweep]; use `historysim sweep` to run it")
        if notify is _of_records and scenario.sections.loading.kind == "file":
            notify = warn
        built = scenario.build(notify)
        surface = built.surface
        header = LogHeader.of(
            built.replay,
            scenario=scenario.text,
            title=scenario.title,
            metadata=scenario.metadata,
            seeds=scenario.seeds,
            surface=surface_group.contents(surface.summits, surface.surface, surface.solutions),
        )
        return header, built.events


class _ResultSource(Source):
    """The result of an earlier run, which holds its log."""

    makes_log = True

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:  # noqa: ARG002 - of a scenario
        header, content = embedded_log.read(self.path)
        return header, content.events, content.links[-1]

    def log(self, beside: Path, options: RunOptions) -> LogFile:
        header, content = embedded_log.read(self.path)
        if options.resume and beside.exists():
            file = LogFile(beside, write=True)
            if file.sound().links == content.links:
                return file
            file.close()
            raise InputError(
                f"{self.path}: was not made from {beside}, so the run cannot go on from there; run it without --resume "
                "to begin again"
            )
        # batch by batch, as it was written
        file = LogFile.create(beside, header, content.events[: content.ends[1]])
        for first, last in itertools.pairwise(content.ends[1:]):
            file.append(content.events[first:last])
        return file


def source_of(what: str | Path | Scenario | Source, values: Mapping[str, Any] | None = None) -> Source:
    """Return the source of a run: a scenario, log or result; values replace those of a scenario file, as for `load`.

    Raises InputError: a scenario that cannot be used, or values for what is no scenario.
    """
    if isinstance(what, Source):
        return what
    # `load` says what is wrong with what is no path
    path = Path(what) if isinstance(what, str | Path) else Path()
    if not (is_log(path) or is_netcdf(path)):
        scenario = what if isinstance(what, Scenario) else load(what, values)
        return _ScenarioSource(scenario.path, scenario)
    if values:
        raise InputError(f"{what}: is no scenario (.toml), so that --set has nothing to change; leave it out")
    return Source(path) if is_log(path) else _ResultSource(path)
