"""Run a scenario, or the log of an earlier run: into memory, or into a result with its log beside it."""

from pathlib import Path
from typing import TYPE_CHECKING

from historysim.basics.notices import Notify, silent
from historysim.basics.processors import threads_of
from historysim.basics.targets import check_outputs
from historysim.errors import InputError
from historysim.log.result import digest_attribute, write_result
from historysim.recording.netcdf import check_compression
from historysim.scenario.scenario import Scenario
from historysim.scenario.sources import Source, source_of

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
    notify: Notify = silent,
) -> "xr.Dataset":
    """Run a scenario, a log or a result.

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
    notify : callable, optional
        Called with each warning or notice (str), such as which snapshot is not used.

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
    if output is None:
        _check_interval(snapshot_every)
        check_compression(compression)
        source = source_of(path)
        header, events, link = source.content(notify)
        attributes = header.attributes | digest_attribute(link)
        with source.placed():
            return header.replay(events, threads_of(threads)).dataset(attributes=attributes, progress=progress)
    write(
        path,
        output,
        progress=progress,
        resume=resume,
        snapshot_every=snapshot_every,
        compression=compression,
        threads=threads,
        force=force,
        notify=notify,
    )
    import xarray as xr

    return xr.open_dataset(output, decode_times=False)


def write(  # noqa: PLR0913 - as `run`
    path: "str | Path | Scenario | Source",
    output: str | Path,
    *,
    progress: bool = False,
    resume: bool = False,
    snapshot_every: int | None = None,
    compression: str = "none",
    threads: int | None = None,
    force: bool = False,
    notify: Notify = silent,
) -> None:
    """Replay a scenario, or the log of an earlier run, into a file, without opening it; all as for `run`."""
    _check_interval(snapshot_every)
    check_compression(compression)
    threads = threads_of(threads)
    output, source = Path(output), source_of(path)
    check_outputs(source.outputs(output), source.files, force=force)
    with source.log(output, resume=resume, notify=notify) as file, source.placed():
        write_result(
            file,
            output,
            progress=progress,
            resume=resume,
            snapshot_every=snapshot_every,
            compression=compression,
            threads=threads,
            notify=notify,
        )


def _check_interval(snapshot_every: int | None) -> None:
    if snapshot_every is not None and not (isinstance(snapshot_every, int) and snapshot_every >= 1):
        raise InputError(f"snapshot_every is {snapshot_every!r}; expected a whole number of 1 or more")
