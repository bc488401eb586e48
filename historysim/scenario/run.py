"""Run a scenario, or the log or the result of an earlier run: in memory, or into a result file and its log."""

import itertools
from collections.abc import Callable, Mapping, Sequence
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
from historysim.recording.recorder import UNTOUCHED
from historysim.scenario.loading_kinds import EACH
from historysim.scenario.scenario import Scenario, load

if TYPE_CHECKING:
    import xarray as xr

    from historysim.scenario.runs import Runs


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
) -> "xr.Dataset | Any":  # noqa: ANN401 - Runs, for several runs
    """Run a scenario, a log or a result.

    Parameters
    ----------
    path : path or Scenario
        A scenario or its file (TOML), a log (``NAME.history``), or a result, which is recomputed
        from its own content.
    output : path, optional
        A netCDF file (.nc) to write the history to, with the surface in the group ``surface``; an
        earlier result is replaced when the new one is complete. The log of a scenario,
        ``NAME.history``, is next to it. Or a zarr store (.zarr), whose blocks are computed in
        parallel.
    progress : bool
        Show a progress bar on standard error if that is a terminal and the run is long.
    resume : bool
        Continue an earlier, interrupted run of the same scenario to the same output from the last
        valid snapshot of its log. The result is bit-identical.
    snapshot_every : int, optional
        Rows between snapshots of the state in the log; by default some seconds of replay, and more
        if all snapshots would be larger than 1 GB.
    compression : {"none", "zlib", "zstd"}
        Compression of the output.
    threads : int, optional
        Threads that record many asperities, and write them; by default one for each processor, up
        to 4. The result is bit-identical.
    force : bool
        Also replace files of these names that are not an earlier result or log; never one that the
        scenario reads.
    record : "totals", optional
        Write the log, its snapshots and the totals, but no variables of asperities. These are
        computed on access by ``hs.open("NAME.history", chunks=…)``. Unless given, the variables
        that the scenario records.
    cluster : str, optional
        Address of the scheduler of a dask cluster that computes the blocks of a zarr store; it
        reads the log under the same path.
    notify : callable, optional
        Called with each notice (str), such as an unused snapshot; by default notices on the reading
        of a measured record are issued as UserWarning.

    Returns
    -------
    xarray.Dataset, or Runs
        The history; read lazily from ``output`` if given. Of a record with ``run = "each"``, or of
        a folder or pattern of files, a sequence with the ``number`` of each run and its history as
        ``result``; each has an output with its number, as ``NAME_1.nc``.

    Raises
    ------
    InputError
        The scenario, or a file that it names, cannot be used; the log is damaged, or belongs to
        another scenario than the one to resume; ``output`` is an input, or is not an earlier
        result.
    LoadError
        The contact cannot support a load; the message names the event.
    OSError
        ``output`` or the log cannot be written, or another process is writing it.

    Examples
    --------
    >>> history = hs.run("scenarios/04_normal_up_tangential_up.toml")
    >>> print(f"{float(history.tangential_displacement.max()) * 1e9:.3f} nm")
    5.003 nm
    """
    notify = notify or _drop_notice
    options = RunOptions(
        progress,
        resume,
        snapshot_every,
        compression,
        threads,
        force,
        notify,
        record=record,
        cluster=cluster,
    )
    source = open_source(path)
    if source.each_run is not None:
        return run_each(source, output, lambda one, target: _run(one, target, options))
    return _run(source, output, options)


def run_each(
    source: "Source", output: str | Path | None, replay: "Callable[[Source, Path | None], Any]"
) -> "Runs[Any]":
    """Replay each run of a scenario, to an output with the number of the run in its name if an output is given.

    Raises InputError: a file, or all of its runs, cannot be used.
    """
    from historysim.scenario.runs import each_run

    def find(scenario: Scenario) -> Any:  # noqa: ANN401 - the result of `replay`
        scenario = scenario.with_run_in_text()
        target = None if output is None else numbered_path(Path(output), scenario.run)
        return replay(_ScenarioSource(scenario.path, scenario), target)

    scenario = source.each_run
    if scenario is None:
        raise InputError(f"{source.path}: is a single record; expected a scenario of several runs")
    return each_run(scenario, find)


def numbered_path(path: Path, run: int | str | None) -> Path:
    """Return the path of an output of one of several runs, as NAME_1.nc."""
    return path.with_stem(f"{path.stem}_{run}")


def _run(source: "Source", output: str | Path | None, options: RunOptions) -> "xr.Dataset":
    if output is None:
        header, events, link = source.content(options.notify)
        attributes = header.attributes | digest_attribute(link)
        job = options.apply_record(header.replay(events, options.threads))
        with source.locate_errors():
            return job.dataset(attributes=attributes, progress=options.progress)
    write(source, Path(output), options)
    import xarray as xr

    if is_store_name(Path(output)):
        from historysim.log.zarr_result import open_store

        return open_store(Path(output))
    return xr.open_dataset(output, decode_times=False)


def _drop_notice(_: str) -> None:
    """Drop a notice, except those on measured records, which are warnings."""


def write(source: "Source", output: Path, options: RunOptions, *further_outputs: Output) -> None:
    """Replay a source into a result file, after a check that it and further outputs can be written."""
    log = [Output(log_path_for(output), (LOG,))] if source.makes_log else []
    check_outputs(
        [Output(output, (RESULT, STORE)), *log, *further_outputs], source.files, force=options.force
    )
    in_store = is_store_name(output)
    if in_store:
        from historysim.log.zarr_result import check_options, check_past, write_zarr

        check_options(output, options)
        check_past(output, source.past)
    elif options.cluster is not None:
        raise InputError(
            f"cluster: {output} is written by one process; expected a zarr store (.zarr) as output"
        )
    with source.log(log_path_for(output), options) as file, source.locate_errors():
        if in_store:
            write_zarr(file, output, options)
        else:
            write_result(file, output, options)


@attrs.frozen
class Source:
    """Source of a run; this class: the log of an earlier run, which the run continues."""

    makes_log: ClassVar[bool] = False  #: whether a new log is written next to the result

    path: Path

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that are read."""
        return (self.path,)

    @property
    def past(self) -> str:
        """Past of the contact, if it is known before the log is opened."""
        return UNTOUCHED

    @property
    def each_run(self) -> Scenario | None:
        """Scenario of several runs that are replayed one by one; None for a single record."""
        return None

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:  # noqa: ARG002 - of a scenario
        """Return the header and the events of the log of a run, and the last link of its chain."""
        with LogFile(self.path) as file:
            content = file.sound()
            return file.head, content.events, content.links[-1]

    def log(self, path: Path, options: RunOptions) -> LogFile:  # noqa: ARG002 - the log exists already
        """Open the log that a run writes, or create it at ``path``; a log has one writer at a time."""
        return LogFile(self.path, write=True)

    def locate_errors(self) -> AbstractContextManager[None]:
        """Add file and line to the error of an event, if the source has them."""
        return nullcontext()


@attrs.frozen
class _ScenarioSource(Source):
    """A scenario."""

    makes_log = True
    scenario: Scenario

    @property
    def files(self) -> tuple[Path, ...]:
        return self.scenario.files

    @property
    def past(self) -> str:
        return self.scenario.sections.loading.past

    @property
    def each_run(self) -> Scenario | None:
        return self.scenario if self.scenario.run == EACH else None

    def locate_errors(self) -> AbstractContextManager[None]:
        return self.scenario.locate_errors()

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:
        header, events = self._header_and_events(notify)
        return header, events, chain_links(header, events)[-1]

    def log(self, path: Path, options: RunOptions) -> LogFile:
        if not (options.resume and path.exists()):
            if options.resume:
                options.notify(
                    f"{path}: there is no log to resume from; the run starts from the beginning"
                )
            return LogFile.create(path, *self._header_and_events(options.notify))
        file = LogFile(path, write=True)
        if file.head.settings["scenario"] != self.scenario.text:
            file.close()
            raise InputError(
                f"{self.path}: is not the scenario that {path} was made from, so the run cannot be "
                "resumed; run it without --resume to start again, or resume the old one: "
                f"historysim run {shell_word(path)} --resume"
            )
        return file

    def _header_and_events(self, notify: Notify) -> tuple[LogHeader, Sequence[Event]]:
        scenario = self.scenario
        if scenario.sections.sweep is not None:
            notify(f"{self.path.name}: ignoring [sweep]; use `historysim sweep` to run it")
        if notify is _drop_notice and scenario.sections.loading.kind == "file":
            notify = warn
        built = scenario.build(notify)
        surface = built.surface
        header = LogHeader.from_replay(
            built.replay,
            scenario=scenario.text,
            title=scenario.title,
            metadata=scenario.metadata,
            seeds=scenario.seeds,
            surface=surface_group.contents(surface.summits, surface.surface, surface.solutions),
        )
        return header, built.replay.events


class _ResultSource(Source):
    """The result of an earlier run, which contains its log."""

    makes_log = True

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:  # noqa: ARG002 - of a scenario
        header, content = embedded_log.read(self.path)
        return header, content.events, content.links[-1]

    def log(self, path: Path, options: RunOptions) -> LogFile:
        header, content = embedded_log.read(self.path)
        if options.resume and path.exists():
            file = LogFile(path, write=True)
            if file.sound().links == content.links:
                return file
            file.close()
            raise InputError(
                f"{self.path}: was not made from {path}, so the run cannot be resumed; run it without --resume "
                "to start again"
            )
        # in the original batches
        file = LogFile.create(path, header, content.events[: content.ends[1]])
        for start, stop in itertools.pairwise(content.ends[1:]):
            file.append(content.events[start:stop])
        return file


def open_source(
    target: str | Path | Scenario | Source, values: Mapping[str, Any] | None = None
) -> Source:
    """Open the source of a run: a scenario, log or result; ``values`` replace values of a scenario file, as for `load`.

    Raises InputError: a scenario that cannot be used, or ``values`` for a log or a result.
    """
    if isinstance(target, Source):
        return target
    # `load` reports a value that is not a path
    path = Path(target) if isinstance(target, str | Path) else Path()
    if not (is_log(path) or is_netcdf(path)):
        scenario = target if isinstance(target, Scenario) else load(target, values)
        return _ScenarioSource(scenario.path, scenario)
    if values:
        raise InputError(
            f"{target}: is not a scenario (.toml), so --set does not apply; leave it out"
        )
    return Source(path) if is_log(path) else _ResultSource(path)
