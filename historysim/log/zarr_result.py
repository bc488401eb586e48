"""Results in zarr stores: blocks of the history are computed in parallel, by threads or by a cluster of dask.

The log is replayed once for its totals and snapshots; blocks then start at the snapshots. The store
is written to a hidden folder, which gets its name when it is complete.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from historysim.basics.arguments import Array
from historysim.basics.stores import check_store, identify, write_checksums
from historysim.basics.system import exchange_folders, processors, sync_folder
from historysim.basics.targets import check_store_replaceable
from historysim.basics.wording import progress_bar
from historysim.errors import HistorySimError, InputError
from historysim.log.file import LogFile
from historysim.log.lazy_history import open_lazily
from historysim.log.result import RunOptions, current_time_text, write_result
from historysim.recording.recorder import UNKNOWN

BLOCKS_PER_WORKER = 4  # blocks in one batch of steps, so that no worker waits long for the last one
CONNECT_SECONDS = 20.0  # to reach the scheduler of a cluster


def write_zarr(file: LogFile, output: Path, options: RunOptions) -> None:
    """Replay a log, open to write, into a zarr store, which appears under its name when it is complete.

    InputError: the cluster cannot be reached, or the past is unknown.
    """
    check_past(output, file.head.past)
    hidden, totals = (
        output.with_name(f".{output.name}.{part}") for part in ("unfinished", "totals.nc")
    )
    with _workers(options) as workers:
        write_result(file, totals, attrs.evolve(options, record="totals"))
        try:
            _write_store(file, hidden, totals, options, workers)
            if output.exists():
                check_store_replaceable(output, force=options.force)
                exchange_folders(hidden, output)
            else:
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


def check_past(output: Path, past: str) -> None:
    """Raise InputError for an unknown past, whose bounds need the whole history before each block."""
    if past == UNKNOWN:
        raise InputError(
            f'{output}: blocks of a store have no bounds of a past that is "unknown"; expected a netCDF '
            f'file (.nc) as output, or past = "untouched"'
        )


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


def _write_store(
    file: LogFile, store: Path, totals: Path, options: RunOptions, workers: int
) -> None:
    from zarr.codecs import Crc32cCodec, ZstdCodec

    history = open_lazily(file.path, chunks="auto", totals=totals).assign_attrs(
        date_created=current_time_text()
    )
    if "totals" in {options.record, str(file.head.settings["record"])}:
        history = history.drop_dims("asperity")
    # one call for the metadata and all that is in memory already
    codecs = {"compressors": (ZstdCodec(), Crc32cCodec())}
    options_of_store: Any = {"consolidated": False, "write_empty_chunks": True}
    encoding = dict.fromkeys(history.variables, codecs)
    history.to_zarr(
        store, mode="w", compute=False, encoding=encoding, zarr_format=3, **options_of_store
    )
    per_asperity = [name for name, variable in history.variables.items() if variable.chunks]
    if per_asperity:
        _write_blocks(history[per_asperity], store, options, workers, options_of_store)
    write_checksums(store)


def _write_blocks(
    history: xr.Dataset,
    store: Path,
    options: RunOptions,
    workers: int,
    options_of_store: dict[str, Any],
) -> None:
    blocks = history.drop_vars([*history.coords])
    rows, across = blocks.chunks["step"], len(blocks.chunks["asperity"])
    batch = max(1, BLOCKS_PER_WORKER * workers // across) * rows[0]
    steps = history.sizes["step"]
    with progress_bar(options.progress, "step", steps, desc="asperities", delay=2) as done:
        for offset in range(0, steps, batch):
            part = slice(offset, min(offset + batch, steps))
            blocks.isel(step=part).to_zarr(store, region={"step": part}, **options_of_store)
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


# -- reading ---------------------------------------------------------------------------------------


@attrs.frozen
class _Reading:
    """Check of each access to a store: damage, and another store under its name, are InputErrors."""

    path: Path
    identity: tuple[int, ...]

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        self._check_identity()
        try:
            yield
        except (HistorySimError, MemoryError):
            raise
        except Exception as error:
            self._check_identity()
            problem = f"{name} is damaged" if name else "is damaged, or not a result"
            raise InputError(f"{self.path}: {problem} ({error}); make it again") from error
        self._check_identity()

    def _check_identity(self) -> None:
        if identify(self.path) != self.identity:
            raise InputError(
                f"{self.path}: was replaced by another store since it was opened; open it again"
            )


class _StoredArray(BackendArray):
    """Values of one variable of a store, read when indexed."""

    def __init__(self, name: str, variable: xr.Variable, reading: _Reading) -> None:
        self.name, self.variable, self.reading = name, variable, reading
        self.shape, self.dtype = variable.shape, variable.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:  # noqa: ANN401 - as its base class
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._read
        )

    def _read(self, key: tuple[Any, ...]) -> Array:
        with self.reading(self.name):
            values: Array = self.variable[key].values
        return values


def open_store(path: Path) -> xr.Dataset:
    """Open the history in a zarr store, read lazily; its labels of asperities are read now.

    InputError: zarr is not installed, the store is damaged, or not a history. Damage that is met
    while values are read is an InputError as well, and so is the replacement of the store.
    """
    try:
        import zarr  # noqa: F401 - xarray reports its absence as an unknown engine
    except ImportError as error:
        raise InputError(
            f'{path}: is read by zarr, which is not installed; pip install "historysim[zarr]"'
        ) from error
    path = path.absolute()
    reading = _Reading(path, identify(path))
    try:
        check_store(path)
    except InputError as error:
        raise InputError(f"{path}: is damaged: {error}; make it again") from error
    with reading(""):
        stored: xr.Dataset = xr.open_zarr(path, chunks=None, decode_times=False, consolidated=False)
        arrays = {
            name: variable
            if name in stored.xindexes
            else xr.Variable(
                variable.dims,
                indexing.LazilyIndexedArray(_StoredArray(str(name), variable, reading)),
                variable.attrs,
                variable.encoding,
            )
            for name, variable in stored.variables.items()
        }
        history = stored.assign({name: arrays[name] for name in stored.data_vars})
        history = history.assign_coords(
            {name: arrays[name] for name in stored.coords if name not in stored.xindexes}
        )
        for variable in history.variables.values():
            # JSON has no types
            if "flag_values" in variable.attrs:
                variable.attrs["flag_values"] = np.asarray(
                    variable.attrs["flag_values"], dtype=variable.dtype
                )
    history.encoding = stored.encoding
    history.set_close(stored.close)
    return history
