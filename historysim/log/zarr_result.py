"""Results in zarr stores: blocks of the history are computed in parallel, by threads or by a cluster of dask.

The log is replayed once for its totals and snapshots; blocks then start at the snapshots. The store is written to a
hidden folder, which gets its name when it is complete.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs

from historysim.basics.system import processors, sync_folder
from historysim.basics.wording import progress_bar
from historysim.errors import InputError
from historysim.log.file import LogFile
from historysim.log.lazy_history import open_lazily
from historysim.log.result import RunOptions, current_time_text, write_result

BLOCKS_PER_WORKER = 4  # blocks in one batch of steps, so that no worker waits long for the last one
CONNECT_SECONDS = 20.0  # to reach the scheduler of a cluster


def write_zarr(file: LogFile, output: Path, options: RunOptions) -> None:
    """Replay a log, open to write, into a zarr store, which appears under its name when it is complete.

    InputError: the cluster cannot be reached.
    """
    hidden, totals = (output.with_name(f".{output.name}.{part}") for part in ("unfinished", "totals.nc"))
    with _workers(options) as workers:
        write_result(file, totals, attrs.evolve(options, record="totals"))
        try:
            _write_store(file, hidden, totals, options, workers)
            shutil.rmtree(output, ignore_errors=True)
            hidden.rename(output)
            sync_folder(output.parent)
        except KeyboardInterrupt as error:
            raise KeyboardInterrupt(
                f"interrupted; {file.path} keeps the events and snapshots; the same run with --resume (resume=True) "
                "computes the asperities"
            ) from error
        finally:
            shutil.rmtree(hidden, ignore_errors=True)
    totals.unlink()


def check_options(output: Path, options: RunOptions) -> None:
    """Raise InputError if dask or zarr is not installed, or for an option that a store does not have."""
    if options.compression != "none":
        raise InputError(f"{output}: is compressed by zarr itself; expected no --compression")
    try:
        import dask.array  # noqa: F401 - xarray imports both
        import zarr  # noqa: F401
    except ImportError as error:
        raise InputError(
            f'a result in zarr needs packages that cannot be imported ({error}): pip install "historysim[dask,zarr]"'
        ) from error


def _write_store(file: LogFile, store: Path, totals: Path, options: RunOptions, workers: int) -> None:
    history = open_lazily(file.path, chunks="auto", totals=totals).assign_attrs(date_created=current_time_text())
    if "totals" in {options.record, str(file.head.settings["record"])}:
        history = history.drop_dims("asperity")
    # one call for the metadata and all that is in memory already
    history.to_zarr(store, mode="w", compute=False, consolidated=False)
    per_asperity = [name for name, variable in history.variables.items() if variable.chunks]
    if not per_asperity:
        return
    blocks = history[per_asperity].drop_vars([*history.coords])
    rows, across = blocks.chunks["step"], len(blocks.chunks["asperity"])
    batch = max(1, BLOCKS_PER_WORKER * workers // across) * rows[0]
    steps = history.sizes["step"]
    with progress_bar(options.progress, "step", steps, desc="asperities", delay=2) as done:
        for offset in range(0, steps, batch):
            part = slice(offset, min(offset + batch, steps))
            blocks.isel(step=part).to_zarr(store, region={"step": part}, consolidated=False)
            done(part.stop - part.start)


@contextmanager
def _workers(options: RunOptions) -> Iterator[int]:
    """Compute with threads, or with a cluster of dask; yield the number of its threads."""
    import dask

    if options.cluster is None:
        threads = options.threads or processors()
        with dask.config.set(num_workers=threads):
            yield threads
        return
    try:
        from distributed import Client, KilledWorker
    except ImportError as error:
        raise InputError(
            f'cluster needs dask.distributed, which cannot be imported ({error}): pip install "historysim[dask]"'
        ) from error
    make: Any = Client  # distributed has no types
    try:
        client = make(options.cluster, timeout=CONNECT_SECONDS)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"cluster {options.cluster}: no scheduler answers there ({error}); expected its address, such as "
            "tcp://192.168.0.1:8786, as dask scheduler prints it"
        ) from error
    with client:
        try:
            yield max(1, sum(client.ncores().values()))
        except KilledWorker as error:
            raise OSError(
                f"cluster {options.cluster}: workers were killed again and again, as when memory is short ({error}); "
                "use workers with more memory or fewer threads, then run again with --resume"
            ) from error
