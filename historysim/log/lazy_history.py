"""Histories that are computed when they are read: an xarray backend on the log and its snapshots.

A block of steps and asperities is a pure function of the log: the replay starts at the last
snapshot before the block and projects the rows and asperities of the block. Its bits are those of a
run that records all variables.
"""

import functools
import itertools
import operator
import os
import platform
import sys
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple, final

import attrs
import numpy as np
import xarray as xr
from xarray.backends import BackendArray, BackendEntrypoint
from xarray.core import indexing

from historysim._version import __version__
from historysim.asperities.state import State
from historysim.basics.arguments import DIRECTION, Array, Floats, Integers
from historysim.basics.files import as_path, is_log, is_netcdf, kind_text
from historysim.basics.hdf5 import check_contained
from historysim.basics.system import fork_lock
from historysim.basics.wording import shell_word, warn
from historysim.errors import InputError
from historysim.loads import schedule
from historysim.log import embedded_log
from historysim.log.file import Content, LogFile
from historysim.log.header import LogHeader
from historysim.log.result import (
    SNAPSHOT_CELLS,
    digest_attribute,
    log_path_for,
    program,
    start_before,
)
from historysim.memory.paths import Rows
from historysim.recording.provenance import MADE_BY
from historysim.recording.recorder import (
    Recorder,
    Selection,
    StateOnly,
    asperity_coordinates,
    labelled_dataset,
)
from historysim.recording.stored_units import is_as_recorded
from historysim.recording.variables import (
    COMPONENTS,
    COORDINATES,
    SLIDE_TIME,
    Variable,
    recorded_variables,
)
from historysim.replaying import Replay

TIME = COORDINATES[0]
# steps times asperities that are computed in one piece if a selection is larger
BLOCK_CELLS = 1 << 21
# steps times asperities between two selected steps from which a second replay is faster
GAP_CELLS = 1 << 20
# of computed blocks, and of states at their ends, that are cached for the next variable or step
CACHE_BYTES = 1 << 28
# most states in the cache; approximate bytes of one asperity in a state
STATES_CACHED, STATE_BYTES = 8, 64
LOGS_OPEN = 4  # logs that a process keeps in memory
# Default size of a chunk: asperities (enough that the replay for it pays), and steps times
# asperities.
CHUNK_ASPERITIES, CHUNK_CELLS = 1 << 18, 1 << 21

Block = Mapping[str, Array]
Chunks = Mapping[str, int] | str


@final
@attrs.define
class _SelectedRows(Recorder):
    """Recorder that retains selected rows of a replay."""

    selected_rows: Integers  #: selected rows, ascending, from the first row of the replay
    retained: Rows = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self.retained = self.new_rows(self.selected_rows.size)

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next: the retained rows themselves if all of them are selected."""
        low, high = self._selected_range(count)
        self.rows = self.retained[low:high] if high - low == count else self.new_rows(count)
        return self.rows

    def record(self, times: Array) -> None:
        """Retain the selected rows."""
        low, high = self._selected_range(times.size)
        if high - low < times.size:
            chosen, retained = self.selected_rows[low:high] - self._filled, self.retained[low:high]
            retained.totals[...] = self.rows.totals[chosen]
            for target, source in (
                (retained.each, self.rows.each),
                (retained.vectors, self.rows.vectors),
            ):
                for name, values in target.items():
                    values[...] = source[name][chosen]
        self._filled += times.size

    def conclude(self, state: State) -> None:
        """Skip slide times: a block may end before asperities slide."""

    def block(self) -> Block:
        """Return the values of all variables by name."""
        return {variable.name: values for variable, values in self.project(self.retained)}

    def _selected_range(self, count: int) -> tuple[int, int]:
        low, high = np.searchsorted(self.selected_rows, (self._filled, self._filled + count))
        return int(low), int(high)


class _Cache:
    """Cache of the blocks computed last, up to a number of bytes; one thread computes each block."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._blocks: OrderedDict[Any, Future[Block]] = OrderedDict()

    def get(self, key: object, compute: Callable[[], Block]) -> Block:
        """Return the block of a key, which is computed if it is not cached."""
        with self._lock:
            cached = self._blocks.get(key)
            future: Future[Block] = cached or Future()
            self._blocks[key] = future
            self._blocks.move_to_end(key)
        if cached is None:
            try:
                future.set_result(compute())
            except BaseException as error:
                with self._lock:
                    del self._blocks[key]
                future.set_exception(error)
                raise
            self._evict()
        return future.result()

    def _evict(self) -> None:
        """Remove the blocks used first, except the last one and those that are being computed."""
        with self._lock:
            done = [(key, future.result()) for key, future in self._blocks.items() if future.done()]
            bytes_left = CACHE_BYTES
            for position, (key, block) in enumerate(reversed(done)):
                bytes_left -= sum(values.nbytes for values in block.values())
                if position and bytes_left < 0:
                    del self._blocks[key]


@attrs.define(eq=False, slots=False)
class LazyHistory:
    """The log of a history in memory, and the blocks computed from it."""

    path: Path  #: the log, or a result that holds it
    head: LogHeader
    content: Content = attrs.field(repr=False)
    log: Path  #: the log with the snapshots, which need not exist
    job: Replay
    _cache: _Cache = attrs.field(factory=_Cache, init=False, repr=False)
    #: States at the ends of the blocks computed last, by the number of rows before them.
    _states: OrderedDict[int, schedule.Start] = attrs.field(
        factory=OrderedDict, init=False, repr=False
    )
    _lock: Any = attrs.field(factory=threading.Lock, init=False, repr=False)  #: of the states

    @functools.cached_property
    def time(self) -> Floats:
        """Time of each step [s]."""
        plan = schedule.paths(self.job.events, self.job.substeps)
        return np.concatenate([block.row_time for block in plan])

    @functools.cached_property
    def labels(self) -> Integers:
        """Indices of the asperities in the ensemble (asperity)."""
        labels = self.job.asperities
        return np.empty(0, dtype=np.int64) if labels is None else labels

    @functools.cached_property
    def slide_time(self) -> Floats:
        """Time at which each asperity first slid [s], NaN for never (asperity)."""
        times: Floats = self.job.ensemble.slide_time(self.state())[self.labels]
        return times

    def state(self, time: float = np.inf) -> State:
        """Return the state at a time [s], replayed from the last snapshot before it."""
        return self.job.state(time, start=self._snapshot(time))

    def values(self, variable: Variable, key: Sequence[Any]) -> Array:
        """Return values of a variable at a key of integers, slices or arrays, one for each dimension."""
        if variable.dimensions == SLIDE_TIME.dimensions:
            selected: Array = self.slide_time[key[0]]
            return selected
        steps, step_order = _ascending(key[0], self.time.size)
        columns, column_order = None, None
        if "asperity" in variable.dimensions:
            columns, column_order = _ascending(key[1], self.labels.size)
        pieces = _pieces(steps, 1 if columns is None else columns.size)
        blocks = [
            self._cached_block(piece, columns)[variable.name] for piece in pieces if piece.size
        ]
        empty = np.empty(
            (0, *(self.labels[columns].shape if columns is not None else ())), variable.dtype
        )
        values = np.concatenate(blocks) if blocks else empty
        # last axis first: an integer index removes its axis
        for axis, order in ((1, column_order), (0, step_order)):
            values = values if order is None else np.take(values, order, axis)
        return values[..., key[-1]] if DIRECTION in variable.dimensions else values

    def _cached_block(self, steps: Integers, columns: Integers | None) -> Block:
        key = steps.tobytes(), None if columns is None else columns.tobytes()
        return self._cache.get(key, lambda: self.block(steps, columns))

    def block(self, steps: Integers, columns: Integers | None, threads: int | None = None) -> Block:
        """Compute all variables at ascending steps and positions of asperities; totals alone without positions.

        A replay stops at event times only, so it starts at the last one before the steps and ends
        at the first one after them.
        """
        job, first_step, last_step = self.job, int(steps[0]), int(steps[-1])
        start_row = 1 + (first_step - 1) // job.substeps * job.substeps if first_step else 0
        end_row = 1 + -(-last_step // job.substeps) * job.substeps
        asperities = None if columns is None else np.ascontiguousarray(self.labels[columns])
        options: dict[str, Any] = {"instrument": job.instrument, "changes": job.changes}
        target = _SelectedRows(
            job.ensemble, asperities, end_row - start_row, steps - start_row, **options
        )
        self._walk(target, self._start(start_row), end_row, threads)
        return target.block()

    def _start(self, rows: int) -> schedule.Start:
        """Return the state and cursor after a number of rows, which end at an event time."""
        if rows == 0:
            return schedule.Start(self.job.ensemble.initial_state())
        with self._lock:
            row_counts = [count for count in self._states if count <= rows]
            cached = self._states[max(row_counts)] if row_counts else None
        if cached is not None and cached.rows == rows:
            return cached
        start = self._snapshot(float(self.time[rows - 1]), cached)
        if start.rows == rows:
            return start
        target = StateOnly(self.job.ensemble, None, rows - start.rows, changes=self.job.changes)
        return self._walk(target, start, rows)

    def _walk(
        self, target: Recorder, start: schedule.Start, rows: int, threads: int | None = None
    ) -> schedule.Start:
        """Replay up to a number of rows, and cache the state there."""
        reached = start

        def keep_state(cursor: schedule.Cursor, state: State) -> None:
            nonlocal reached
            reached = schedule.Start(state, cursor)

        job = self.job if threads is None else attrs.evolve(self.job, threads=threads)
        job.walk(target, start=start, until=float(self.time[rows - 1]), on_event=keep_state)
        capacity = max(1, min(STATES_CACHED, CACHE_BYTES // (STATE_BYTES * len(self.job.ensemble))))
        with self._lock:
            self._states[rows] = reached
            while len(self._states) > capacity:
                self._states.popitem(last=False)
        return reached

    def _snapshot(self, time: float, cached: schedule.Start | None = None) -> schedule.Start:
        """Return the last snapshot up to a time [s], the cached state if that is later, or else the beginning."""
        latest = cached or schedule.Start(self.job.ensemble.initial_state())
        if not self.log.is_file():
            return latest
        try:
            with LogFile(self.log, head=self.head) as file:
                return start_before(file, self.content, time, warn, latest=latest)
        except InputError as error:
            warn(f"{self.log}: its snapshots are not used ({error}); the replay starts earlier")
            return latest

    def check_snapshots(self) -> None:
        """Warn if a long history has no snapshots."""
        if (
            self.time.size * len(self.job.ensemble) <= SNAPSHOT_CELLS
            or self._snapshot(np.inf).cursor is not None
        ):
            return
        snapshot_state = "has no usable snapshot" if self.log.is_file() else "does not exist"
        warn(
            f"{self.path}: every block is replayed from the beginning, since its log {self.log} {snapshot_state}; "
            f"historysim run {shell_word(self.path)} --record totals --snapshot-every STEPS -o totals.nc writes "
            "snapshots into the log of the run"
        )


def _ascending(key: Any, size: int) -> tuple[Integers, Any]:  # noqa: ANN401 - integer, slice or array
    """Return the positions of a key in ascending order, and the index that restores its order and dimension."""
    positions = np.atleast_1d(np.arange(size)[key])
    if isinstance(key, int | np.integer):
        return positions, 0
    return (
        (positions, None)
        if (np.diff(positions) > 0).all()
        else np.unique(positions, return_inverse=True)
    )


def _pieces(steps: Integers, width: int) -> Iterator[Integers]:
    """Split ascending steps into blocks of bounded size, and at gaps that are faster replayed without asperities."""
    most_steps = max(1, BLOCK_CELLS // max(width, 1))
    for run in np.split(steps, np.flatnonzero(np.diff(steps) * width > GAP_CELLS) + 1):
        for offset in range(0, run.size, most_steps):
            yield run[offset : offset + most_steps]


# -- opening ---------------------------------------------------------------------------------------


@attrs.frozen
class LogReference:
    """Reference to a log by path and digest, which other processes need to compute blocks of its history."""

    path: Path
    digest: str  #: last link of the chain, SHA-256
    record: Selection  #: asperities of the history
    program: str  #: versions that compute it

    @classmethod
    def from_file(cls, path: Path, record: Selection | None = None) -> "LogReference":
        """Read a log, or a result that holds one; InputError if it is damaged or has no events."""
        head, content, _ = _read(path)
        if not content.events:
            raise InputError(
                f"{path}: holds no events yet; expected at least one: EventLog.append adds them"
            )
        chosen = head.settings["record"] if record is None else record
        chosen = (
            tuple(chosen)
            if not isinstance(chosen, str)
            else "touching"
            if chosen == "totals"
            else chosen
        )
        return cls(path, content.links[-1].hex(), chosen, program(head.ensemble.packages))

    @property
    def history(self) -> LazyHistory:
        """The history in this process; its log is read once.

        InputError: the log is missing on this machine, was replaced, or the versions of historysim
        differ.
        """
        with fork_lock:
            return _open_history(self)

    def block(self, steps: range, columns: range | None) -> Block:
        """Compute a block; see `LazyHistory.block`."""
        asperities = None if columns is None else np.array(columns, dtype=np.int64)
        # dask itself has threads
        return self.history.block(np.array(steps), asperities, threads=1)

    def __dask_tokenize__(self) -> tuple[str, ...]:
        return self.digest, str(self.record), self.program


@functools.lru_cache(maxsize=LOGS_OPEN)
def _open_history(reference: LogReference) -> LazyHistory:
    path = reference.path
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file on {platform.node()}; expected the log of the history on every machine "
            "that computes it, under the same path"
        )
    head, content, log = _read(path, reference.digest)
    installed = program(head.ensemble.packages)
    if installed != reference.program:
        raise InputError(
            f"{path}: the history was opened by {reference.program}, and {installed} is installed on "
            f"{platform.node()}; expected the same versions, since others may give other bits"
        )
    job = attrs.evolve(head.replay(content.events), record=reference.record)
    return LazyHistory(path, head, content, log, job)


def _forget_threads() -> None:
    """Forget histories and dask's threads: a forked process has none of the threads that hold locks or do the work."""
    _open_history.cache_clear()
    threaded: Any = sys.modules.get("dask.threaded")
    if threaded is not None:
        threaded.default_pool, threaded.pools_lock = None, threading.Lock()
        threaded.pools.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_threads)


def _read(path: Path, digest: str = "") -> tuple[LogHeader, Content, Path]:
    """Read a log up to the batch with a digest, or the log inside a result; return the path of the log as well."""
    if is_log(path):
        with LogFile(path) as file:
            content = file.read()
            content_then = content.content_at_digest(digest) if digest else None
            head, content, log = file.head, content_then or file.sound(), path
    elif is_netcdf(path):
        head, content = embedded_log.read(path)
        log = log_path_for(path)
    else:
        problem = kind_text(path) or "is not a log"
        raise InputError(
            f"{path}: {problem}; expected the log of a run (NAME.history), or its result"
        )
    if digest and content.links[-1].hex() != digest:
        raise InputError(
            f"{path}: is not the log that the history was opened from, with the digest {digest[:12]}…; it was "
            "replaced; open the history again"
        )
    return head, content, log


# -- as a Dataset ----------------------------------------------------------------------------------


class _LazyArray(BackendArray):
    """Values of one variable, computed when indexed."""

    def __init__(self, reference: LogReference, variable: Variable, shape: tuple[int, ...]) -> None:
        self.shape, self.dtype = shape, np.dtype(variable.dtype)
        self.reference, self.name, self.dimensions = reference, variable.name, variable.dimensions

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:  # noqa: ANN401 - as its base class
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._read_key
        )

    def _read_key(self, key: tuple[Any, ...]) -> Array:
        history = self.reference.history
        totals, per_asperity = recorded_variables(history.job.changes)
        variables = {
            (variable.name, variable.dimensions): variable
            for variable in (*totals, *per_asperity, SLIDE_TIME)
        }
        return history.values(variables[self.name, self.dimensions], key)


class _Grid(NamedTuple):
    """Chunks of a history along the steps and along the asperities."""

    steps: Sequence[range]
    asperities: Sequence[range]

    @classmethod
    def from_chunks(cls, chunks: Chunks, steps: int, asperities: int) -> "_Grid":
        """Return the chunks of given sizes, or of default ones; -1 is all."""
        sizes = (
            {}
            if chunks == "auto"
            else dict(chunks)
            if isinstance(chunks, Mapping)
            else {str(chunks): 0}
        )
        for name, size in sizes.items():
            if (
                name not in {"step", "asperity"}
                or not isinstance(size, int | np.integer)
                or size < -1
                or size == 0
            ):
                raise InputError(
                    f"chunks is {chunks!r}; expected numbers of steps and asperities, such as "
                    '{"step": 1000, "asperity": 100_000}, or "auto"'
                )
        across = _size(sizes.get("asperity", CHUNK_ASPERITIES), asperities)
        rows = _size(sizes.get("step", max(1, CHUNK_CELLS // across)), steps)
        return cls(_ranges(steps, rows), _ranges(asperities, across))


def _size(size: int, count: int) -> int:
    return max(1, count if size == -1 else min(size, count))


def _ranges(count: int, size: int) -> list[range]:
    return [range(offset, min(offset + size, count)) for offset in range(0, max(count, 1), size)]


def open_lazily(
    path: Path,
    *,
    record: Selection | None = None,
    chunks: Chunks | None = None,
    totals: Path | None = None,
) -> xr.Dataset:
    """Return the history of a log, or of a result that holds one, with variables that are computed when read.

    Parameters
    ----------
    path : Path
    record : {"touching", "all"} or sequence of int, optional
        Asperities of the history; by default those of the log, or all that touch if it records
        totals alone.
    chunks : mapping or "auto", optional
        Sizes along ``step`` and ``asperity`` of the chunks of dask arrays; arrays without dask by
        default.
    totals : path, optional
        A result (netCDF) with the variables along ``step``; by default the one next to the log, if
        there is one.

    Raises
    ------
    InputError
        The file cannot be used, or dask is not installed.
    """
    path = as_path(path).absolute()
    reference = LogReference.from_file(path, record)
    history = reference.history
    history.check_snapshots()
    job = history.job
    sizes = {"step": history.time.size, "asperity": history.labels.size, DIRECTION: len(COMPONENTS)}
    known_totals = _known_totals(
        history, totals or (path if is_netcdf(path) else path.with_suffix(".nc"))
    )
    totals_variables, per_asperity = recorded_variables(job.changes)
    computed = [
        *(variable for variable in totals_variables if variable.name not in known_totals),
        *per_asperity,
    ]
    lazy = [
        (
            variable,
            indexing.LazilyIndexedArray(
                _LazyArray(reference, variable, tuple(sizes[axis] for axis in variable.dimensions))
            ),
        )
        for variable in (*computed, SLIDE_TIME)
    ]
    data = [
        *(
            (variable, known_totals[variable.name])
            for variable in totals_variables
            if variable.name in known_totals
        ),
        *lazy,
    ]
    if chunks is not None:
        grid = _Grid.from_chunks(chunks, sizes["step"], sizes["asperity"])
        data = [*data, *_dask_variables(reference, computed, grid)]
    coordinates = [*asperity_coordinates(job.ensemble, history.labels), (TIME, history.time)]
    attributes = (
        job.attributes() | history.head.attributes | digest_attribute(history.content.links[-1])
    )
    dataset = labelled_dataset(data, coordinates, attributes, planar=job.changes.planar)
    dataset.encoding |= {"source": str(path), MADE_BY: reference}
    return dataset.set_xindex("time")


def _known_totals(history: LazyHistory, path: Path) -> Mapping[str, Array]:
    """Read the variables along ``step`` of a result; empty if it is not complete, or of another log or version."""
    import netCDF4

    expected = digest_attribute(history.content.links[-1]) | {
        "historysim_version": __version__,
        "complete": 1,
    }
    with suppress(OSError, RuntimeError, AttributeError, InputError):
        check_contained(path)
        with netCDF4.Dataset(path) as file:
            file.set_auto_maskandscale(False)
            if all(
                name in file.ncattrs() and file.getncattr(name) == value
                for name, value in expected.items()
            ):
                totals = recorded_variables(history.job.changes)[0]
                return {
                    variable.name: file[variable.name][...]
                    for variable in totals
                    if variable.name in file.variables
                    and is_as_recorded(file[variable.name].__dict__, variable.units)
                }
    return {}


@contextmanager
def _needs_dask() -> Iterator[None]:
    try:
        yield
    except ImportError as error:
        raise InputError(
            f'chunks needs dask, which cannot be imported ({error}): pip install "historysim[dask]"; without chunks, '
            'xarray.open_dataset(path, engine="historysim") computes what is indexed'
        ) from error


def with_chunks(history: xr.Dataset, chunks: Chunks) -> xr.Dataset:
    """Return a history that is read from a file as dask arrays; chunks and errors as for `open_lazily`."""
    with _needs_dask():
        import dask.array  # noqa: F401 - xarray reports its absence in other words
    grid = _Grid.from_chunks(chunks, history.sizes["step"], history.sizes.get("asperity", 0))
    sizes = {"step": len(grid.steps[0]), "asperity": len(grid.asperities[0])}
    return history.chunk({axis: size for axis, size in sizes.items() if axis in history.sizes})


def _dask_variables(
    reference: LogReference, variables: Sequence[Variable], grid: _Grid
) -> Iterator[tuple[Variable, Any]]:
    """Yield variables as dask arrays; one task computes all variables of a block."""
    with _needs_dask():
        import dask.array as da
        from dask.base import tokenize
        from dask.highlevelgraph import HighLevelGraph
    token = tokenize(reference, grid.steps, grid.asperities)
    blocks = f"historysim-blocks-{token}"
    tasks: dict[Any, Any] = {
        (blocks, i): (reference.block, steps, None) for i, steps in enumerate(grid.steps)
    }
    for (i, steps), (j, asperities) in itertools.product(
        enumerate(grid.steps), enumerate(grid.asperities)
    ):
        tasks[blocks, i, j] = (reference.block, steps, asperities)
    sizes = {"step": tuple(map(len, grid.steps)), "asperity": tuple(map(len, grid.asperities))}
    sizes[DIRECTION] = (len(COMPONENTS),)
    array: Any = da.Array  # dask has no types
    for variable in variables:
        name, along = f"{variable.name}-{token}", tuple(sizes[axis] for axis in variable.dimensions)
        of_block = len(set(variable.dimensions) - {DIRECTION})
        layer: dict[Any, Any] = {
            (name, *chunk): (operator.getitem, (blocks, *chunk[:of_block]), variable.name)
            for chunk in np.ndindex(*map(len, along))
        }
        graph = HighLevelGraph({blocks: tasks, name: layer}, {blocks: set(), name: {blocks}})
        yield variable, array(graph, name, along, dtype=np.dtype(variable.dtype))


@final
class HistoryBackend(BackendEntrypoint):
    """Engine "historysim" of xarray: histories computed from a log (``NAME.history``), or a result that holds one."""

    description = "Compute the history of a historysim log when it is indexed"
    url = "https://github.com/historysim/historysim"
    open_dataset_parameters = ("filename_or_obj", "drop_variables", "record")

    def open_dataset(  # type: ignore[override] # adds an option
        self,
        filename_or_obj: Any,  # noqa: ANN401 - any object that xarray accepts
        *,
        drop_variables: str | Sequence[str] | None = None,
        record: Selection | None = None,
    ) -> xr.Dataset:
        """Open a history; parameters and errors as for `open_lazily`."""
        history = open_lazily(as_path(filename_or_obj), record=record)
        dropped = (
            [drop_variables] if isinstance(drop_variables, str) else list(drop_variables or ())
        )
        return history.drop_vars(dropped, errors="ignore")

    def guess_can_open(self, filename_or_obj: Any) -> bool:  # noqa: ANN401 - any object that xarray accepts
        """Return whether a file is a log."""
        return isinstance(filename_or_obj, str | os.PathLike) and is_log(Path(filename_or_obj))
