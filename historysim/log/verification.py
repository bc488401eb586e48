"""Whether a result is what its log gives, and a log what it says it is."""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np
import numpy.typing as npt

from historysim._version import __version__
from historysim.asperities import ensemble as ensembles
from historysim.errors import InputError
from historysim.loads import schedule as scheduler
from historysim.loads.events import Event, time_text
from historysim.log.file import LogFile
from historysim.log.head import Head, made_with
from historysim.log.snapshot import packed
from historysim.memory import kernel
from historysim.recording import recorder
from historysim.scenario import run as simulation

if TYPE_CHECKING:
    import netCDF4

Array = npt.NDArray[Any]


@attrs.define
class Difference:
    """Where a variable of a result differs from the replay.

    Attributes
    ----------
    name : str
    count : int
        Values that differ in any bit.
    step, asperity : int
        The first of them; the asperity is a column, -1 where the variable has none.
    found, replayed : float
        What stands there in the result, and what the replay gives.
    largest : float
        The largest difference, and `scale` the largest value of the replay, in the units of the variable.
    """

    name: str
    count: int = 0
    step: int = -1
    asperity: int = -1
    found: float = 0.0
    replayed: float = 0.0
    largest: float = 0.0
    scale: float = 0.0

    def add(self, first: int, found: Array, replayed: Array) -> None:
        """Compare values, of which the first belong to a step."""
        if replayed.size:
            self.scale = max(self.scale, float(np.abs(replayed).max()))
        differs = np.ascontiguousarray(found).view(np.uint8) != np.ascontiguousarray(replayed).view(np.uint8)
        differs = differs.reshape(*replayed.shape, replayed.dtype.itemsize).any(axis=-1)
        if not differs.any():
            return
        where = tuple(np.argwhere(differs)[0])
        if not self.count:
            self.step, self.asperity = first + int(where[0]), int(where[1]) if len(where) > 1 else -1
            self.found, self.replayed = float(found[where]), float(replayed[where])
        self.count += int(differs.sum())
        apart = np.abs(found[differs].astype(float) - replayed[differs])
        self.largest = max(self.largest, float(np.where(np.isnan(apart), np.inf, apart).max()))

    @property
    def text(self) -> str:
        """Say it in a line."""
        column = "" if self.asperity < 0 else f", asperity column {self.asperity}"
        relative = f" ({self.largest / self.scale:.2g} of its largest value)" if self.scale else ""
        return (
            f"{self.name}: {self.count:,} values differ, first at step {self.step}{column} ({self.found!r} for "
            f"{self.replayed!r}), by {self.largest:.3g}{relative} at most"
        )


@final
@attrs.define
class _Comparer(recorder.Recorder):
    """Takes the rows of a replay, and compares them with those of a file."""

    file: "netCDF4.Dataset"
    differences: dict[str, Difference] = attrs.field(factory=dict, init=False)
    _rows: kernel.Rows = attrs.field(init=False)

    def room(self, count: int) -> kernel.Rows:
        """Return room for the next rows."""
        self._rows = ensembles.room(count, self.columns)
        return self._rows

    def record(self, times: Array) -> None:
        """Compare what stands in the room last given."""
        where = slice(self._filled, self._filled + times.size)
        self.compare("time", times, where)
        for variable, values in self._projected(self._rows):
            self.compare(variable.name, values, where)
        self._filled += times.size

    def compare(self, name: str, values: Array, where: slice = slice(None)) -> None:
        """Compare the values of one variable."""
        if name not in self.file.variables:
            raise InputError(f"has no variable {name}")
        found = self.file[name]
        if found.dtype != values.dtype or found[where].shape != values.shape:
            raise InputError(f"{name} is {found.dtype} of shape {found.shape}, other than the replay gives")
        self.differences.setdefault(name, Difference(name)).add(where.start or 0, found[where], values)


def verify_result(
    output: Path, log: Path | None = None, *, progress: bool = False, tell: simulation.Teller = simulation.silent
) -> list[Difference]:
    """Replay the log of a result, and compare every value, bit by bit.

    Parameters
    ----------
    output : Path
        The result (netCDF).
    log : Path, optional
        Its log; by default the one beside it.
    progress : bool
        See `historysim.run`.
    tell : callable, optional
        Told where versions differ.

    Returns
    -------
    list of Difference
        Empty where nothing differs.

    Raises
    ------
    InputError
        The result or the log is damaged, unfinished, or they do not belong together.
    LoadError
        A load that the contact cannot carry.
    """
    if not output.is_file():
        raise InputError(f"{output}: there is no such file; expected a result of historysim run (netCDF), or a log")
    beside = log or simulation.log_beside(output)
    if not beside.is_file():
        raise InputError(f"{output}: its log {beside} is not there; put it there, or say where it is with --log")
    with LogFile(beside) as file, _opened(output) as result:
        head, events = file.head, _events_of(file, output, result)
        _tell_versions(output, result, tell)
        ensemble = head.ensemble
        asperities = recorder.chosen_asperities(ensemble, events, head.record)
        steps = scheduler.row_count(events, head.substeps)
        target = _Comparer(ensemble, asperities, steps, {}, result, instrument=head.instrument)
        if len(result.dimensions["step"]) != steps:
            raise InputError(f"{output}: has {len(result.dimensions['step']):,} steps; its log makes {steps:,}")
        for variable, values in recorder.coordinates_of(ensemble, asperities):
            target.compare(variable.name, values)
        rows = min(simulation.ROWS_BETWEEN_REPORTS, recorder.BLOCK_CELLS // max(target.columns, 1))
        plan = scheduler.stretches(events, head.substeps, max(rows, 1))
        simulation.walk(ensemble, events, plan, target, saturate=head.saturate, progress=progress)
        return [difference for difference in target.differences.values() if difference.count]


def verify_log(path: Path, *, tell: simulation.Teller = simulation.silent) -> tuple[int, int, str]:
    """Check the chain of a log, replay it, and compare the state with each snapshot.

    Parameters
    ----------
    path : Path
    tell : callable, optional
        Told which snapshots are passed over, and why.

    Returns
    -------
    events, snapshots : int
        Events that are sound, and snapshots that agree with the replay.
    digest : str
        Of the log.

    Raises
    ------
    InputError
        The log is damaged; the message says how far it is sound.
    LoadError
        A load that the contact cannot carry.
    """
    with LogFile(path) as file:
        head, content = file.head, file.sound()
        if content.events:
            _tell_log_versions(path, head, tell)
        good = 0
        starts = []
        for found in file.snapshots(content):
            start = found if isinstance(found, str) else simulation.usable(file, content, found)
            if isinstance(start, str):
                tell(f"{path}: {start}; it is passed over")
            else:
                starts.append(start)
        now = simulation.Start.of(head.ensemble)
        target = simulation.Unseen(head.ensemble, None, 0, {}, instrument=head.instrument)
        for kept in [*reversed(starts), None]:
            until = float("inf") if kept is None or kept.standing is None else kept.standing.time
            if content.events:
                rows = simulation.ROWS_BETWEEN_REPORTS
                plan = scheduler.stretches(content.events, head.substeps, rows, start=now.standing, until=until)
                state = simulation.walk(head.ensemble, content.events, plan, target, saturate=head.saturate, start=now)
                if kept is not None:
                    if _bits(state) == _bits(kept.state):
                        good += 1
                    else:
                        tell(f"{path}: the snapshot at t = {time_text(until)} differs from the replay; run it again")
                    now = simulation.Start(state, kept.standing)
        return len(content.events), good, content.links[-1].hex()


def _bits(state: ensembles.EnsembleState) -> bytes:
    with np.load(io.BytesIO(packed(state))) as kept:
        return b"".join(kept[name].tobytes() for name in kept.files)


def _events_of(file: LogFile, output: Path, result: "netCDF4.Dataset") -> Sequence[Event]:
    """Events of the log that a result was made from, which may have grown since."""
    content = file.sound()
    told = str(getattr(result, "log_digest", "")).removeprefix("sha256:")
    if getattr(result, "scenario", "") != file.head.settings["scenario"]:
        raise InputError(f"{output}: holds another scenario than {file.path}: one of the two was changed or swapped")
    for link, end in zip(content.links, content.ends, strict=True):
        if link.hex() == told and end:
            return content.events[:end]
    raise InputError(
        f"{output}: is not the result of {file.path}: it names the digest {told[:12] or 'none'}…, and the log has "
        f"{content.links[-1].hex()[:12]}…; one of the two was swapped; historysim run {file.path} makes the "
        "result again"
    )


def _tell_versions(output: Path, result: "netCDF4.Dataset", tell: simulation.Teller) -> None:
    made = f"historysim {getattr(result, 'historysim_version', '?')}, {getattr(result, 'made_with', '?')}"
    here = f"historysim {__version__}, {made_with()}"
    if made != here:
        tell(f"{output}: was made by {made}; this is {here}, so the last digits may differ")


def _tell_log_versions(path: Path, head: Head, tell: simulation.Teller) -> None:
    made = f"historysim {head.version}, {head.settings['made_with']}"
    here = f"historysim {__version__}, {made_with()}"
    if made != here:
        tell(f"{path}: was made by {made}; this is {here}, so the last digits of its states may differ")


def _check_finished(result: "netCDF4.Dataset") -> None:
    if not getattr(result, "complete", 0) or "step" not in result.dimensions:
        raise InputError("is not a finished result of historysim run")


@contextmanager
def _opened(output: Path) -> Iterator["netCDF4.Dataset"]:
    import netCDF4

    try:
        with netCDF4.Dataset(output) as result:
            result.set_auto_maskandscale(False)
            _check_finished(result)
            yield result
    except (OSError, RuntimeError) as error:
        raise InputError(f"{output}: is damaged ({error}); run the scenario again") from error
    except InputError as error:
        known = str(error).startswith(str(output)) or ".history" in str(error)
        raise InputError(str(error) if known else f"{output}: {error}") from error
