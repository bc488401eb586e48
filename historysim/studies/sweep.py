"""Sweeps: a scenario at many points, each a cell that is computed once and kept, gathered in one Dataset."""

import logging
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import xarray as xr

from historysim.basics.wording import Notify, progress_bar, silent
from historysim.errors import HistorySimError, InputError, at
from historysim.scenario.grid import Grid, Point, grid_of
from historysim.scenario.scenario import Scenario, as_scenario
from historysim.scenario.schema import reported
from historysim.studies.cell import cell, chosen_outputs
from historysim.studies.store import Store, digest
from historysim.studies.sweep_table import gathered, swept_coordinates, unlike
from historysim.studies.workers import AHEAD, BrokenError, executor_for, outcomes

logger = logging.getLogger(__name__)

MOST_CELLS_IN_A_BATCH = 16  # a task costs some tenths of a millisecond beside its cells
FEWEST_BATCHES_OF_A_WORKER = 8  # so that all workers end at about the same time
MOST_NOTICES = 10
KILLED = "the process that computed it was killed, perhaps for lack of memory"


def sweep(  # noqa: PLR0913 - the keys of [sweep], and how it is carried out
    scenario: Scenario | str | os.PathLike[str],
    over: Mapping[str, Any] | None = None,
    *,
    together: Sequence[Sequence[str]] = (),
    outputs: Sequence[str] = (),
    store: str | os.PathLike[str] | None = None,
    workers: int = 1,
    executor: object = None,
    progress: bool = False,
    notify: Notify = silent,
) -> xr.Dataset:
    """Replay a scenario at all points of a grid, and return what comes out as one Dataset.

    Parameters
    ----------
    scenario : Scenario or path
    over : dict, optional
        The swept keys, each with its values or a range, as in ``[sweep.over]`` of a scenario:
        ``{"friction.coefficient": [0.1, 0.2], "surface.seed": range(20)}``. By default what the scenario says.
    together : sequence of sequence of str
        Keys that go through their values together, as one dimension; any other two are crossed.
    outputs : sequence of str
        Names of what is kept of each cell, see the page on sweeps; by default those of the scenario, else the numbers
        that sum a history up.
    store : path, optional
        A folder in which cells are kept as they end. A sweep that was killed goes on there and computes no cell
        again; several sweeps may share it, also at one time. Workers on another machine need it under the same name.
    workers : int
        Processes on this machine; with 1 the cells are computed in this one. They do not change a bit of the result.
        A script that asks for more needs ``if __name__ == "__main__":`` around its statements.
    executor : optional
        Computes in their place, and is not shut down: an executor of concurrent.futures or mpi4py.futures, or a client
        of dask.distributed.
    progress : bool
        Show a progress bar on standard error where that is a terminal.
    notify : callable, optional
        Callback(str) for notices: which cells have failed, and why; they are tried again the next time.

    Returns
    -------
    xarray.Dataset
        A dimension for each swept key (or group of keys), called by the key with ``_`` for all but letters and digits
        (``friction_coefficient``), with its values in SI; the outputs with these dimensions, and their own ``step`` and
        ``asperity``. Cells that have failed hold NaN; then ``failure`` says why.

    Raises
    ------
    InputError
        A scenario or a sweep that cannot be used as it is; all cells have failed.
    OSError
        A cell cannot be kept.

    Examples
    --------
    >>> found = hs.sweep("scenarios/04_normal_up_tangential_up.toml", {"friction.coefficient": [0.2, 0.3]})
    >>> print((found.preliminary_displacement * 1e9).round(2).values)
    [19.61 29.41]
    """
    scenario = as_scenario(scenario)
    section = scenario.sections.sweep
    asked = tuple(outputs) or (section.outputs if section is not None and over is None else ())
    grid, outputs = sweep_of(scenario, outputs, over, together)
    plan = _Plan(scenario, outputs, None if store is None else Path(store), list(grid.points()))
    kept = "" if store is None else f", {len(plan.cells):,} of them in {store} already"
    logger.info("%s: %s cells%s", scenario.path.name, f"{len(plan.points):,}", kept)
    try:
        plan.carry_out(executor, workers, progress=progress)
    except KeyboardInterrupt as error:
        raise KeyboardInterrupt(f"interrupted; {plan.what_is_kept()}") from error
    reasons = dict(sorted((plan.reasons | unlike(plan.cells)).items()))
    notices = [f"cell {index} ({text_of(plan.points[index])}) failed: {reason}" for index, reason in reasons.items()]
    notify_of(notices, "more cells have failed", notify)
    cells = [None if index in reasons else plan.cells[index] for index in range(len(grid))]
    # what is asked for first is what its picture shows
    return gathered(scenario, grid, cells, reasons).assign_attrs({"outputs": " ".join(asked)} if asked else {})


def text_of(point: Point) -> str:
    """Return the keys of a point with their values."""
    return ", ".join(f"{key} = {value}" for key, value in point.items())


def notify_of(notices: Sequence[str], more: str, notify: Notify) -> None:
    """Pass the first notices on, and how many more there are."""
    for notice in notices[:MOST_NOTICES]:
        notify(notice)
    if len(notices) > MOST_NOTICES:
        notify(f"… and {len(notices) - MOST_NOTICES:,} {more}")


def sweep_of(
    scenario: Scenario,
    outputs: Sequence[str] = (),
    over: Mapping[str, Any] | None = None,
    together: Sequence[Sequence[str]] = (),
) -> tuple[Grid, tuple[str, ...]]:
    """Return grid and outputs of a sweep, by default those of ``[sweep]``; InputError names file and key."""
    section = scenario.sections.sweep
    with reported(scenario.path.name):
        if over is None:
            if section is None:
                raise InputError("has no [sweep]; expected one, as [sweep.over] with friction.coefficient = [0.1, 0.2]")
            over, together, outputs = section.over, section.together, tuple(outputs) or section.outputs
        with at("sweep"):
            grid, outputs = grid_of(over, together), chosen_outputs(outputs)
    # a key or a value that is wrong is an error before anything is computed
    swept_coordinates(scenario, grid)
    return grid, outputs


@attrs.frozen
class Batch:
    """Cells that a worker computes one after the other."""

    scenario: Scenario
    outputs: tuple[str, ...]
    store: Path | None
    cells: tuple[tuple[int, str, Point], ...]  #: the name is that in the store
    wait: bool = False  #: wait for cells that another process is computing, instead of passing them over


def computed(batch: Batch) -> list[xr.Dataset | str | None]:
    """Return the cells of a batch, or why one has failed; None where another process is computing it.

    Cells are kept as they end, and read where they are there. One that cannot be kept is an OSError.
    """
    return [_computed(batch, name, point) for _, name, point in batch.cells]


def _computed(batch: Batch, name: str, point: Point) -> xr.Dataset | str | None:
    if batch.store is None:
        return _attempt(batch, point)
    store = Store(batch.store)
    with store.claimed(name, wait=batch.wait) as mine:
        if not mine:
            return None
        # another process may have ended it meanwhile
        if (kept := store.read(name)) is not None:
            return kept
        logger.info("cell %s: %s", name, point)
        outcome = _attempt(batch, point)
        if not isinstance(outcome, str):
            store.write(name, outcome)
        return outcome


def _attempt(batch: Batch, point: Point) -> xr.Dataset | str:
    try:
        return cell(batch.scenario, point, batch.outputs)
    except HistorySimError as error:
        return str(error)
    except Exception as error:  # noqa: BLE001 - whatever it is, it shall not sink the others
        return f"{type(error).__name__}: {error}"


@attrs.define
class _Plan:
    """The cells of a sweep: those that are kept already, and those that are to be computed."""

    scenario: Scenario
    outputs: tuple[str, ...]
    folder: Path | None
    points: list[Point]
    names: list[str] = attrs.field(init=False)
    cells: dict[int, xr.Dataset] = attrs.field(factory=dict, init=False)
    reasons: dict[int, str] = attrs.field(factory=dict, init=False)
    elsewhere: set[int] = attrs.field(factory=set, init=False)  #: cells that another process is computing

    def __attrs_post_init__(self) -> None:
        self.names = [""] * len(self.points)
        if self.folder is None:
            return
        # damaged and unfinished cells count as missing, and are computed again
        self.folder.mkdir(parents=True, exist_ok=True)
        store = Store(self.folder)
        store.tidy()
        self.names = [digest(self.scenario, point, self.outputs) for point in self.points]
        kept = {index: store.read(name) for index, name in enumerate(self.names)}
        self.cells = {index: cell for index, cell in kept.items() if cell is not None}

    def carry_out(self, given: object, workers: int, *, progress: bool) -> None:
        """Compute what is not there; what another process is computing comes last."""
        there = {"desc": "sweep", "initial": len(self.cells)}
        with progress_bar(progress, "cell", len(self.points), **there) as done:
            self._run(given, workers, done, wait=False)
            self.elsewhere.clear()
            self._run(given, workers, done, wait=True)

    def what_is_kept(self) -> str:
        """Return what an interrupt leaves."""
        there = f"{len(self.cells):,} of {len(self.points):,} cells"
        if self.folder is None:
            return f"{there} are lost without a store"
        return f"{self.folder} keeps {there}, and the same sweep goes on there"

    def _run(self, given: object, workers: int, done: Callable[[int], object], *, wait: bool) -> None:
        """Compute what is left, after the end of a process cell by cell and with half as many processes."""
        apart, size = workers > 1, MOST_CELLS_IN_A_BATCH
        while left := self._left():
            try:
                with executor_for(min(workers, len(left)), given, apart=apart) as (executor, count):
                    size = max(1, min(size, len(left) // (count * FEWEST_BATCHES_OF_A_WORKER)))
                    batches = [self._batch(left[first : first + size], wait) for first in range(0, len(left), size)]
                    # one process, after others were killed, has one cell at a time
                    at_once = 1 if apart and workers == 1 else AHEAD * count
                    for index, found in outcomes(computed, batches, executor, at_once):
                        self._take(batches[index], found)
                        done(sum(cell is not None for cell in found))
            except BrokenError:
                if given is not None:
                    raise
                if workers == 1:
                    self.reasons[self._left()[0]] = KILLED
                    done(1)
                workers, size = max(1, workers // 2), 1

    def _left(self) -> list[int]:
        """Return the cells that are to be computed; those on one surface follow one another."""
        surfaces: dict[str, list[int]] = {}
        for index, point in enumerate(self.points):
            if index not in self.cells and index not in self.reasons and index not in self.elsewhere:
                keys = [item for item in point.items() if item[0].startswith("surface.")]
                surfaces.setdefault(repr(keys), []).append(index)
        return [index for indices in surfaces.values() for index in indices]

    def _batch(self, indices: Sequence[int], wait: bool) -> Batch:
        cells = tuple((index, self.names[index], self.points[index]) for index in indices)
        return Batch(self.scenario, self.outputs, self.folder, cells, wait)

    def _take(self, batch: Batch, found: Sequence[xr.Dataset | str | None]) -> None:
        for (index, _, _), outcome in zip(batch.cells, found, strict=True):
            if outcome is None:
                self.elsewhere.add(index)
            elif isinstance(outcome, str):
                self.reasons[index] = outcome
            else:
                self.cells[index] = outcome
