"""Histories that are computed when they are read: an xarray backend on the log and its snapshots.

A block of steps and asperities is a pure function of the log: the replay starts at the last snapshot before the block
and projects the rows and asperities of the block. Its bits are those of a run that records all variables.
"""

import functools
import itertools
import operator
import os
import platform
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
from historysim.basics.wording import shell_word, warn
from historysim.errors import InputError
from historysim.loads import schedule
from historysim.log import embedded_log
from historysim.log.file import Content, LogFile
from historysim.log.header import LogHeader
from historysim.log.result import SNAPSHOT_CELLS, digest_attribute, log_path_for, program, start_before
from historysim.memory.paths import Rows
from historysim.recording.provenance import MADE_BY
from historysim.recording.recorder import Recorder, Selection, StateOnly, asperity_coordinates, labelled_dataset
from historysim.recording.variables import COMPONENTS, COORDINATES, SLIDE_TIME, Variable, recorded
from historysim.replaying import Replay

TIME = COORDINATES[0]
BLOCK_CELLS = 1 << 21  # steps times asperities that are computed in one piece if a selection is larger
GAP_CELLS = 1 << 20  # steps times asperities between two selected steps from which a second replay is faster
CACHE_BYTES = 1 << 28  # computed blocks, and states at their ends, that are kept for the next variable or step
STATES_KEPT, STATE_BYTES = 8, 64  # at most, and of one asperity in a state, roughly
LOGS_OPEN = 4  # logs that a process keeps in memory
# Asperities of a chunk by default, as many as its replay is worth, and steps times asperities.
CHUNK_ASPERITIES, CHUNK_CELLS = 1 << 18, 1 << 21

Block = Mapping[str, Array]
Chunks = Mapping[str, int] | str


@final
@attrs.define
class _SelectedRows(Recorder):
    """Keep selected rows of a replay."""

    wanted: Integers  #: selected rows, ascending, from the first row of the replay
    kept: Rows = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self.kept = self.new_rows(self.wanted.size)

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next: the kept ones themselves if all of them are selected."""
        low, high = self._selected(count)
        self.rows = self.kept[low:high] if high - low == count else self.new_rows(count)
        return self.rows

    def record(self, times: Array) -> None:
        """Keep the selected rows."""
        low, high = self._selected(times.size)
        if high - low < times.size:
            chosen, kept = self.wanted[low:high] - self._filled, self.kept[low:high]
            kept.totals[...] = self.rows.totals[chosen]
            for target, source in ((kept.each, self.rows.each), (kept.vectors, self.rows.vectors)):
                for name, values in target.items():
                    values[...] = source[name][chosen]
        self._filled += times.size

    def conclude(self, state: State) -> None:
        """Leave out when asperities slid: a block may end before that."""

    def block(self) -> Block:
        """Return the values of all variables by name."""
        return {variable.name: values for variable, values in self.project(self.kept)}

    def _selected(self, count: int) -> tuple[int, int]:
        low, high = np.searchsorted(self.wanted, (self._filled, self._filled + count))
        return int(low), int(high)


class _Cache:
    """Blocks that were computed last, up to a number of bytes; each is computed by one thread only."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._blocks: OrderedDict[Any, Future[Block]] = OrderedDict()

    def get(self, key: object, compute: Callable[[], Block]) -> Block:
        """Return the block of a key, which is computed if it is not cached."""
        with self._lock:
            known = self._blocks.get(key)
            future = known or self._blocks.setdefault(key, Future())
            self._blocks.move_to_end(key)
        if known is None:
            try:
                future.set_result(compute())
            except BaseException as error:
                with self._lock:
                    self._blocks.pop(key, None)
                future.set_exception(error)
                raise
            self._evict(key)
        return future.result()

    def _evict(self, latest: object) -> None:
        with self._lock:
            sizes = {
                key: sum(values.nbytes for values in future.result().values())
                for key, future in self._blocks.items()
                if future.done() and key != latest
            }
            left = CACHE_BYTES - sum(values.nbytes for values in self._blocks[latest].result().values())
            for key, size in reversed(sizes.items()):
                left -= size
                if left < 0:
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
    _states: OrderedDict[int, schedule.Start] = attrs.field(factory=OrderedDict, init=False, repr=False)
    _lock: Any = attrs.field(factory=threading.Lock, init=False, repr=False)  #: of the states

    @functools.cached_property
    def time(self) -> Floats:
        """Time of each step [s]."""
        plan = schedule.segments(self.job.events, self.job.substeps)
        return np.concatenate([segment.row_time for segment in plan])

    @functools.cached_property
    def labels(self) -> Integers:
        """Indices of the asperities in the ensemble (asperity)."""
        labels = self.job.asperities
        return np.empty(0, dtype=np.int64) if labels is None else labels

    @functools.cached_property
    def slide_time(self) -> Floats:
        """When each asperity first slid [s], NaN for never (asperity)."""
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
        parts = [self._cached(piece, columns)[variable.name] for piece in pieces if piece.size]
        empty = np.empty((0, *(self.labels[columns].shape if columns is not None else ())), variable.dtype)
        found = np.concatenate(parts) if parts else empty
        # the last axis first, since an integer removes its axis
        for axis, order in ((1, column_order), (0, step_order)):
            found = found if order is None else np.take(found, order, axis)
        return found[..., key[-1]] if DIRECTION in variable.dimensions else found

    def _cached(self, steps: Integers, columns: Integers | None) -> Block:
        key = steps.tobytes(), None if columns is None else columns.tobytes()
        return self._cache.get(key, lambda: self.block(steps, columns))

    def block(self, steps: Integers, columns: Integers | None, threads: int | None = None) -> Block:
        """Compute all variables at ascending steps and positions of asperities; totals alone without positions.

        A replay stops at event times only, so it starts at the last one before the steps and ends at the first one
        after them.
        """
        job, first, last = self.job, int(steps[0]), int(steps[-1])
        before = 1 + (first - 1) // job.substeps * job.substeps if first else 0
        after = 1 + -(-last // job.substeps) * job.substeps
        asperities = None if columns is None else np.ascontiguousarray(self.labels[columns])
        options: dict[str, Any] = {"instrument": job.instrument, "changes": job.changes}
        target = _SelectedRows(job.ensemble, asperities, after - before, steps - before, **options)
        self._walk(target, self._start(before), after, threads)
        return target.block()

    def _start(self, rows: int) -> schedule.Start:
        """Return where a replay stands after so many rows, which end at an event time."""
        if rows == 0:
            return schedule.Start(self.job.ensemble.initial_state())
        with self._lock:
            known = [count for count in self._states if count <= rows]
            cached = self._states[max(known)] if known else None
        if cached is not None and cached.rows == rows:
            return cached
        start = self._snapshot(float(self.time[rows - 1]), cached)
        if start.rows == rows:
            return start
        target = StateOnly(self.job.ensemble, None, rows - start.rows, changes=self.job.changes)
        return self._walk(target, start, rows)

    def _walk(self, target: Recorder, start: schedule.Start, rows: int, threads: int | None = None) -> schedule.Start:
        """Replay up to so many rows, and keep the state there."""
        reached = start

        def after(cursor: schedule.Cursor, state: State) -> None:
            nonlocal reached
            reached = schedule.Start(state, cursor)

        job = self.job if threads is None else attrs.evolve(self.job, threads=threads)
        job.walk(target, start=start, until=float(self.time[rows - 1]), after=after)
        most = max(1, min(STATES_KEPT, CACHE_BYTES // (STATE_BYTES * len(self.job.ensemble))))
        with self._lock:
            self._states[rows] = reached
            while len(self._states) > most:
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
        if self.time.size * len(self.job.ensemble) <= SNAPSHOT_CELLS or self._snapshot(np.inf).cursor is not None:
            return
        found = "has no usable snapshot" if self.log.is_file() else "does not exist"
        warn(
            f"{self.path}: every block is replayed from the beginning, since its log {self.log} {found}; "
            f"historysim run {shell_word(self.path)} --record totals --snapshot-every STEPS -o totals.nc writes "
            "snapshots into the log of the run"
        )


def _ascending(key: Any, size: int) -> tuple[Integers, Any]:  # noqa: ANN401 - integer, slice or array
    """Return the positions of a key in ascending order, and the index that restores its order and dimension."""
    positions = np.atleast_1d(np.arange(size)[key])
    if isinstance(key, int | np.integer):
        return positions, 0
    return (positions, None) if (np.diff(positions) > 0).all() else np.unique(positions, return_inverse=True)


def _pieces(steps: Integers, width: int) -> Iterator[Integers]:
    """Split ascending steps into blocks of bounded size, and at gaps that are faster replayed without asperities."""
    most = max(1, BLOCK_CELLS // max(width, 1))
    for run in np.split(steps, np.flatnonzero(np.diff(steps) * width > GAP_CELLS) + 1):
        for first in range(0, run.size, most):
            yield run[first : first + most]


# -- opening ---------------------------------------------------------------------------------------

_opening = threading.RLock()


@attrs.frozen
class LogReference:
    """What other processes need to compute blocks of a history: the path of its log, not the log itself."""

    path: Path
    digest: str  #: last link of the chain, SHA-256
    record: Selection  #: asperities of the history
    program: str  #: versions that compute it

    @classmethod
    def of(cls, path: Path, record: Selection | None = None) -> "LogReference":
        """Read a log, or a result that holds one; InputError if it is damaged or has no events."""
        head, content, _ = _read(path)
        if not content.events:
            raise InputError(f"{path}: holds no events yet; expected at least one: EventLog.append adds them")
        chosen = head.settings["record"] if record is None else record
        chosen = tuple(chosen) if not isinstance(chosen, str) else "touching" if chosen == "totals" else chosen
        return cls(path, content.links[-1].hex(), chosen, program(head.ensemble.packages))

    @property
    def history(self) -> LazyHistory:
        """The history in this process, which reads the log once.

        InputError: the log is not here, was replaced, or the versions of historysim differ.
        """
        with _opening:
            return _opened(self)

    def block(self, steps: range, columns: range | None) -> Block:
        """Compute a block; see `LazyHistory.block`."""
        asperities = None if columns is None else np.array(columns, dtype=np.int64)
        # dask itself has threads
        return self.history.block(np.array(steps), asperities, threads=1)

    def __dask_tokenize__(self) -> tuple[str, ...]:
        return self.digest, str(self.record), self.program


@functools.lru_cache(maxsize=LOGS_OPEN)
def _opened(reference: LogReference) -> LazyHistory:
    path = reference.path
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file on {platform.node()}; expected the log of the history on every machine "
            "that computes it, under the same path"
        )
    head, content, log = _read(path, reference.digest)
    if (here := program(head.ensemble.packages)) != reference.program:
        raise InputError(
            f"{path}: the history was opened by {reference.program}, and {here} is installed on {platform.node()}; "
            "expected the same versions, since others may give other bits"
        )
    job = attrs.evolve(head.replay(content.events), record=reference.record)
    return LazyHistory(path, head, content, log, job)


def _read(path: Path, digest: str = "") -> tuple[LogHeader, Content, Path]:
    """Read a log, up to the batch with a digest, or that of a result; return also the path of the log."""
    if is_log(path):
        with LogFile(path) as file:
            content = file.read()
            known = content.up_to(digest) if digest else None
            head, content, log = file.head, known or file.sound(), path
    elif is_netcdf(path):
        head, content = embedded_log.read(path)
        log = log_path_for(path)
    else:
        problem = kind_text(path) or "is not a log"
        raise InputError(f"{path}: {problem}; expected the log of a run (NAME.history), or its result")
    if digest and content.links[-1].hex() != digest:
        raise InputError(
            f"{path}: is not the log that the history was opened from, with the digest {digest[:12]}…; it was "
            "replaced; open the history again"
        )
    return head, content, log


# -- as a Dataset ----------------------------------------------------------------------------------


class _LazyArray(BackendArray):
    """Values of one variable, computed where they are indexed."""

    def __init__(self, reference: LogReference, variable: Variable, shape: tuple[int, ...]) -> None:
        self.shape, self.dtype = shape, np.dtype(variable.dtype)
        self.reference, self.name, self.dimensions = reference, variable.name, variable.dimensions

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:  # noqa: ANN401 - as its base class
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._at)

    def _at(self, key: tuple[Any, ...]) -> Array:
        history = self.reference.history
        totals, per_asperity = recorded(history.job.changes)
        known = {(each.name, each.dimensions): each for each in (*totals, *per_asperity, SLIDE_TIME)}
        return history.values(known[self.name, self.dimensions], key)


class _Grid(NamedTuple):
    """Chunks of a history along the steps and along the asperities."""

    steps: Sequence[range]
    asperities: Sequence[range]

    @classmethod
    def of(cls, chunks: Chunks, steps: int, asperities: int) -> "_Grid":
        """Return the chunks of given sizes, or of default ones; -1 is all."""
        given = {} if chunks == "auto" else dict(chunks) if isinstance(chunks, Mapping) else {str(chunks): 0}
        for name, size in given.items():
            if name not in {"step", "asperity"} or not isinstance(size, int | np.integer) or size < -1 or size == 0:
                raise InputError(
                    f"chunks is {chunks!r}; expected numbers of steps and asperities, such as "
                    '{"step": 1000, "asperity": 100_000}, or "auto"'
                )
        across = _size(given.get("asperity", CHUNK_ASPERITIES), asperities)
        rows = _size(given.get("step", max(1, CHUNK_CELLS // across)), steps)
        return cls(_ranges(steps, rows), _ranges(asperities, across))


def _size(given: int, count: int) -> int:
    return max(1, count if given == -1 else min(given, count))


def _ranges(count: int, size: int) -> list[range]:
    return [range(first, min(first + size, count)) for first in range(0, max(count, 1), size)]


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
        Asperities of the history; by default those of the log, or all that touch if it records totals alone.
    chunks : mapping or "auto", optional
        Sizes along ``step`` and ``asperity`` of the chunks of dask arrays; arrays without dask by default.
    totals : path, optional
        A result (netCDF) with the variables along ``step``; by default the one next to the log, if there is one.

    Raises
    ------
    InputError
        The file cannot be used, or dask is not installed.
    """
    path = as_path(path).absolute()
    reference = LogReference.of(path, record)
    history = reference.history
    history.check_snapshots()
    job = history.job
    sizes = {"step": history.time.size, "asperity": history.labels.size, DIRECTION: len(COMPONENTS)}
    found = _known_totals(history, totals or (path if is_netcdf(path) else path.with_suffix(".nc")))
    own, per_asperity = recorded(job.changes)
    computed = [*(each for each in own if each.name not in found), *per_asperity]
    lazy = [
        (each, indexing.LazilyIndexedArray(_LazyArray(reference, each, tuple(sizes[axis] for axis in each.dimensions))))
        for each in (*computed, SLIDE_TIME)
    ]
    data = [*((each, found[each.name]) for each in own if each.name in found), *lazy]
    if chunks is not None:
        grid = _Grid.of(chunks, sizes["step"], sizes["asperity"])
        data = [*data, *_chunked(reference, computed, grid)]
    coordinates = [*asperity_coordinates(job.ensemble, history.labels), (TIME, history.time)]
    attributes = job.attributes() | history.head.attributes | digest_attribute(history.content.links[-1])
    dataset = labelled_dataset(data, coordinates, attributes, planar=job.changes.planar)
    dataset.encoding |= {"source": str(path), MADE_BY: reference}
    return dataset.set_xindex("time")


def _known_totals(history: LazyHistory, path: Path) -> Mapping[str, Array]:
    """Read the variables along ``step`` of a result; empty if it is not complete, or of another log or version."""
    import netCDF4

    expected = digest_attribute(history.content.links[-1]) | {"historysim_version": __version__, "complete": 1}
    with suppress(OSError, RuntimeError, AttributeError, InputError):
        check_contained(path)
        with netCDF4.Dataset(path) as file:
            file.set_auto_maskandscale(False)
            if all(name in file.ncattrs() and file.getncattr(name) == value for name, value in expected.items()):
                names = [each.name for each in recorded(history.job.changes)[0]]
                return {name: file[name][...] for name in names if name in file.variables}
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
    grid = _Grid.of(chunks, history.sizes["step"], history.sizes.get("asperity", 0))
    sizes = {"step": len(grid.steps[0]), "asperity": len(grid.asperities[0])}
    return history.chunk({axis: size for axis, size in sizes.items() if axis in history.sizes})


def _chunked(reference: LogReference, variables: Sequence[Variable], grid: _Grid) -> Iterator[tuple[Variable, Any]]:
    """Yield variables as dask arrays; those of one block take their values from one task."""
    with _needs_dask():
        import dask.array as da
        from dask.base import tokenize
        from dask.highlevelgraph import HighLevelGraph
    token = tokenize(reference, grid.steps, grid.asperities)
    blocks = f"historysim-blocks-{token}"
    tasks: dict[Any, Any] = {(blocks, i): (reference.block, steps, None) for i, steps in enumerate(grid.steps)}
    for (i, steps), (j, asperities) in itertools.product(enumerate(grid.steps), enumerate(grid.asperities)):
        tasks[blocks, i, j] = (reference.block, steps, asperities)
    sizes = {"step": tuple(map(len, grid.steps)), "asperity": tuple(map(len, grid.asperities))}
    sizes[DIRECTION] = (len(COMPONENTS),)
    array: Any = da.Array  # dask has no types
    for each in variables:
        name, along = f"{each.name}-{token}", tuple(sizes[axis] for axis in each.dimensions)
        of_block = len(set(each.dimensions) - {DIRECTION})
        layer: dict[Any, Any] = {
            (name, *chunk): (operator.getitem, (blocks, *chunk[:of_block]), each.name)
            for chunk in np.ndindex(*map(len, along))
        }
        graph = HighLevelGraph({blocks: tasks, name: layer}, {blocks: set(), name: {blocks}})
        yield each, array(graph, name, along, dtype=np.dtype(each.dtype))


@final
class HistoryBackend(BackendEntrypoint):
    """Engine "historysim" of xarray: histories computed from a log (``NAME.history``), or a result that holds one."""

    description = "Compute the history of a log of historysim where it is indexed"
    url = "https://github.com/historysim/historysim"
    open_dataset_parameters = ("filename_or_obj", "drop_variables", "record")

    def open_dataset(  # type: ignore[override] # with an option of its own
        self,
        filename_or_obj: Any,  # noqa: ANN401 - whatever xarray opens
        *,
        drop_variables: str | Sequence[str] | None = None,
        record: Selection | None = None,
    ) -> xr.Dataset:
        """Open a history; parameters and errors as for `open_lazily`."""
        found = open_lazily(as_path(filename_or_obj), record=record)
        dropped = [drop_variables] if isinstance(drop_variables, str) else list(drop_variables or ())
        return found.drop_vars(dropped, errors="ignore")

    def guess_can_open(self, filename_or_obj: Any) -> bool:  # noqa: ANN401 - whatever xarray opens
        """Return whether a file is a log."""
        return isinstance(filename_or_obj, str | os.PathLike) and is_log(Path(filename_or_obj))
