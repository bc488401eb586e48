"""Verify results against their logs, and logs against their digests and snapshots."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np

from historysim.asperities.law import FrictionLaw
from historysim.basics.arguments import Array
from historysim.basics.files import as_path, is_log, is_netcdf, is_zarr, kind_text
from historysim.basics.hdf5 import check_named
from historysim.basics.wording import Notify, quote, shell_word, silent
from historysim.errors import InputError
from historysim.loads.event_sequence import time_text
from historysim.loads.events import Event
from historysim.loads.schedule import Start
from historysim.log import embedded_log
from historysim.log.file import LogFile
from historysim.log.header import LogHeader
from historysim.log.result import log_path_for, program, snapshots
from historysim.recording.provenance import find_bounds, made_with
from historysim.recording.recorder import FORGOTTEN, Recorder, asperity_coordinates
from historysim.recording.stored_units import declared_units, is_as_recorded
from historysim.recording.variables import SLIDE_TIME

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr


# largest difference, over the largest value of a variable, that is taken for rounding
ROUNDING = 1e-9


@attrs.define
class Difference:
    """Differences of a variable of a result from the replay."""

    name: str
    count: int = 0  #: values that differ
    first: str = ""  #: the first of them: where, and both values
    largest: float = 0.0  #: largest difference
    scale: float = 0.0  #: largest value of the replay
    real: bool = True  #: whether the values are real numbers, not flags or counts

    def add(self, names: Sequence[str], start: int, recorded: Array, replayed: Array) -> None:
        """Compare values along named dimensions, of which the first begins at an index."""
        self.real = replayed.dtype.kind == "f"
        self.scale = max(self.scale, float(np.abs(replayed).max(initial=0)))
        differs = np.ascontiguousarray(recorded).view(np.uint8) != np.ascontiguousarray(
            replayed
        ).view(np.uint8)
        differs = differs.reshape(*replayed.shape, replayed.dtype.itemsize).any(axis=-1)
        if not differs.any():
            return
        if not self.count:
            where = tuple(np.argwhere(differs)[0])
            indices = zip(names, (start + where[0], *where[1:]), strict=True)
            position = ", ".join(f"{name} {index}" for name, index in indices)
            self.first = f"{position} ({float(recorded[where])!r} for {float(replayed[where])!r})"
        self.count += int(differs.sum())
        apart = np.abs(recorded[differs].astype(float) - replayed[differs])
        self.largest = max(self.largest, float(np.where(np.isnan(apart), np.inf, apart).max()))

    @property
    def rounding(self) -> bool:
        """True if the values are real numbers and differ by rounding only."""
        return self.real and self.largest <= ROUNDING * self.scale

    @property
    def text(self) -> str:
        """The difference in a line."""
        relative = f" ({self.largest / self.scale:.2g} of its largest value)" if self.scale else ""
        return (
            f"{self.name}: {self.count:,} values differ, first at {self.first}, "
            f"by {self.largest:.3g}{relative} at most"
        )


@attrs.frozen
class Verification:
    """Outcome of the replay of the ``events`` of a result or a log; true if it agrees.

    ``digest`` is that of the log (SHA-256), ``snapshots`` how many of a log agree with the replay,
    and ``differences`` are the variables of a result that differ in any bit. ``made_elsewhere`` is
    what made the result where that is not what replays here: the last bits may then differ.
    """

    path: Path
    events: int
    digest: str
    snapshots: int = 0
    differences: tuple[Difference, ...] = ()
    made_elsewhere: str = ""

    def __bool__(self) -> bool:
        """Return whether all bits agree, or differ by no more than other versions or processors round."""
        return all(self.made_elsewhere and difference.rounding for difference in self.differences)


def verify(
    path: str | Path,
    log: str | Path | None = None,
    *,
    progress: bool = False,
    notify: Notify = silent,
) -> Verification:
    """Replay the log of a result and compare every bit, or check a log and its snapshots.

    Parameters
    ----------
    path : path
        The result (netCDF or zarr), or a log (``NAME.history``).
    log : path, optional
        The log of the result; by default the log next to it.
    progress : bool
        Show a progress bar, as `historysim.run` does.
    notify : callable, optional
        Called with where versions differ, and which snapshots are passed over.

    Raises
    ------
    InputError
        The result or the log is damaged, unfinished, or they do not belong together.
    LoadError
        A load that the contact cannot carry.
    """
    path = as_path(path)
    if is_log(path):
        return _verify_log(path, notify=notify)
    if not is_netcdf(path) and not is_zarr(path):
        kind = kind_text(path) or "is no result, and no log"
        raise InputError(
            f"{path}: {kind}; expected a result of historysim run, or a log (NAME.history)"
        )
    log_path = log_path_for(path) if log is None else Path(log)
    # a file that is not a result has no log, so that it is opened in any case
    with (
        LogFile(log_path) if log is not None or log_path.is_file() else nullcontext() as file,
        _open_result(path) as result,
    ):
        if file is None:
            raise InputError(
                f"{path}: its log {log_path} is not there; put it there, or say where it is with --log, or make the "
                f"result again from the log inside it: historysim run {shell_word(path)} -o again.nc"
            )
        return _compare_result(path, result, file, progress=progress, notify=notify)


def _compare_result(
    output: Path,
    result: "netCDF4.Dataset | _StoredResult",
    file: LogFile,
    *,
    progress: bool,
    notify: Notify,
) -> Verification:
    # the embedded log, from which it can be recomputed, has a separate checksum
    # a store has no groups
    if embedded_log.find_group(result) is not None:  # type: ignore[arg-type]
        embedded_log.read(output)
    events, digest = _events_of_result(file, output, result)
    version, maker = (
        str(getattr(result, name, "?")) for name in ("historysim_version", "made_with")
    )
    if elsewhere := _elsewhere(file.head, version, maker):
        this_program = program(file.head.ensemble.packages)
        notify(
            f"{output}: was made by {elsewhere}; this is {this_program}, so the last digits may differ"
        )
    job = file.head.replay(events)
    if "asperity" not in result.dimensions:
        job = attrs.evolve(job, record="totals")
    if (recorded_steps := len(result.dimensions["step"])) != (steps := job.steps()):
        raise InputError(f"{output}: has {recorded_steps:,} steps; its log makes {steps:,}")
    for name, unit in declared_units().items():
        if name in result.variables and not is_as_recorded(result[name].__dict__, unit):
            raise InputError(
                f"{output}: {name} was saved again, packed or in {quote(getattr(result[name], 'units', ''))}, and is "
                f"recorded in {unit or 'no unit'}; expected the file that historysim run wrote"
            )
    target = job.recorder(_Comparer, file=result)
    for variable, values in asperity_coordinates(job.ensemble, job.asperities):
        target.compare(variable.name, values)
    job.walk(target, progress=progress)
    if target.slide_time is not None:
        target.compare(SLIDE_TIME.name, target.slide_time)
    if (bounds := find_bounds(job)) is not None:
        for where, compared in bounds.blocks(progress=progress):
            for variable, values in compared:
                target.compare(variable.name, values, where)
        stored, replayed = getattr(result, FORGOTTEN, math.inf), bounds.forgotten_time
        difference = target.differences.setdefault(FORGOTTEN, Difference(FORGOTTEN))
        difference.add(["attribute"], 0, *(np.array([float(time)]) for time in (stored, replayed)))
    differences = tuple(
        difference for difference in target.differences.values() if difference.count
    )
    return Verification(
        output, len(events), digest, differences=differences, made_elsewhere=elsewhere
    )


def _elsewhere(head: LogHeader, version: str, maker: str) -> str:
    """Return the software of a log if its last bits may differ here: another version, or other power functions.

    Everything else that computed it, such as the processor, Python and numpy, does not matter to
    the bits.
    """
    by, law = (
        ", ".join((f"historysim {version}", *head.packages)),
        head.ensemble.laws.get("friction"),
    )
    if by != program(head.ensemble.packages):
        return by
    same_bits = not isinstance(law, FrictionLaw) or law.same_bits
    return "" if same_bits or maker == made_with() else f"{by} with {maker}"


def _verify_log(path: Path, *, notify: Notify) -> Verification:
    with LogFile(path) as file:
        head, content = file.head, file.sound()
        elsewhere = _elsewhere(
            head, head.settings["historysim_version"], head.settings["made_with"]
        )
        if content.events and elsewhere:
            this_program = program(head.ensemble.packages)
            notify(
                f"{path}: was made by {elsewhere}; this is {this_program}, so the last digits of its states may differ"
            )
        good, start, job = 0, None, head.replay(content.events)
        for snapshot in reversed([*snapshots(file, content, notify)]):
            if snapshot.cursor is None:
                continue
            until = snapshot.cursor.time
            start = Start(job.state(until, start=start), snapshot.cursor)
            if start.state.to_bytes() == snapshot.state.to_bytes():
                good += 1
            else:
                notify(
                    f"{path}: the snapshot at t = {time_text(until)} differs from the replay; run it again"
                )
        if content.events:
            job.state(start=start)
        return Verification(path, len(content.events), content.links[-1].hex(), snapshots=good)


@final
@attrs.define
class _Comparer(Recorder):
    """Recorder that compares the rows of a replay with the rows of a file."""

    file: "netCDF4.Dataset | _StoredResult"
    differences: dict[str, Difference] = attrs.field(factory=dict, init=False)

    def record(self, times: Array) -> None:
        """Compare the filled rows with the rows of the file."""
        where = slice(self._filled, self._filled + times.size)
        self.compare("time", times, where)
        for variable, values in self.project(self.rows):
            self.compare(variable.name, values, where)
        self._filled += times.size

    def compare(self, name: str, values: Array, where: slice = slice(None)) -> None:
        """Compare the values of one variable."""
        if name not in self.file.variables:
            raise InputError(f"{self.file.filepath()}: has no variable {name}")
        names, recorded = [*map(str, self.file[name].dimensions)], self.file[name][where]
        if recorded.dtype != values.dtype or recorded.shape != values.shape:
            recorded_type, replayed_type = (
                f"{array.dtype} of shape {array.shape}" for array in (recorded, values)
            )
            raise InputError(
                f"{self.file.filepath()}: {name} is {recorded_type}; its log makes {replayed_type}"
            )
        self.differences.setdefault(name, Difference(name)).add(
            names, where.start or 0, recorded, values
        )


def _events_of_result(
    file: LogFile, output: Path, result: "netCDF4.Dataset | _StoredResult"
) -> tuple[Sequence[Event], str]:
    """Return the events from which a result was made, and their digest; the log may have grown since."""
    content = file.sound()
    digest = str(getattr(result, "log_digest", "")).removeprefix("sha256:")
    if getattr(result, "scenario", "") != file.head.settings["scenario"]:
        raise InputError(
            f"{output}: holds another scenario than {file.path}: one of the two was changed or swapped"
        )
    if (made_of := content.content_at_digest(digest)) is not None:
        return made_of.events, digest
    raise InputError(
        f"{output}: is not the result of {file.path}: it names the digest {digest[:12] or 'none'}…, and the log has "
        f"{content.links[-1].hex()[:12]}…; one of the two was swapped; historysim run "
        f"{shell_word(file.path)} makes the result again"
    )


class _StoredVariable:
    """Variable of a zarr store, with the interface of `netCDF4.Variable`."""

    def __init__(self, variable: "xr.Variable") -> None:
        self._variable, self.dimensions, self.units = (
            variable,
            variable.dims,
            variable.attrs.get("units", ""),
        )
        self.__dict__ |= variable.attrs

    def __getitem__(self, key: slice) -> Array:
        values: Array = self._variable[key].values
        return values


class _StoredResult:
    """History in a zarr store, with the interface of `netCDF4.Dataset` that a comparison uses."""

    def __init__(self, path: Path, history: "xr.Dataset") -> None:
        self.variables = {
            str(name): _StoredVariable(variable) for name, variable in history.variables.items()
        }
        self.dimensions = {name: range(size) for name, size in history.sizes.items()}
        self.groups: dict[str, Any] = {}
        self.filepath = path.__str__
        self.__dict__ |= history.attrs

    def __getitem__(self, name: str) -> _StoredVariable:
        return self.variables[name]


@contextmanager
def _open_result(output: Path) -> Iterator["netCDF4.Dataset | _StoredResult"]:
    """Open a finished result; errors of netCDF4 in the block are reported as damage."""
    import netCDF4

    if is_zarr(output):
        from historysim.log.zarr_result import open_store

        with open_store(output) as history:
            if not history.attrs.get("complete") or "step" not in history.sizes:
                raise InputError(f"{output}: is not a finished result of historysim run")
            yield _StoredResult(output, history)
        return
    check_named(output)
    try:
        with netCDF4.Dataset(output) as result:
            result.set_auto_maskandscale(False)
            if not getattr(result, "complete", 0) or "step" not in result.dimensions:
                raise InputError(f"{output}: is not a finished result of historysim run")
            yield result
    except (OSError, RuntimeError, AttributeError) as error:
        if isinstance(error, AttributeError) and not str(error).startswith("NetCDF: "):
            raise
        raise InputError(f"{output}: is damaged ({error}); run the scenario again") from error
