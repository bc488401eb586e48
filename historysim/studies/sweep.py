"""Sweeps: a scenario at many points, each computed once and stored as a cell, combined in one Dataset."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import xarray as xr

from historysim.basics.system import log_message
from historysim.basics.wording import Notify, progress_bar, silent
from historysim.errors import HistorySimError, InputError, error_path
from historysim.scenario.grid import Grid, Point, build_grid
from historysim.scenario.scenario import Scenario, as_scenario
from historysim.scenario.schema import located_errors
from historysim.studies.cell import cell, chosen_outputs
from historysim.studies.store import Store, digest
from historysim.studies.sweep_table import find_mismatches, gather, swept_coordinates
from historysim.studies.workers import AHEAD, BrokenError, open_executor, outcomes

MOST_CELLS_IN_A_BATCH = 16  # overhead of a task: some tenths of a millisecond
FEWEST_BATCHES_OF_A_WORKER = 8  # so that all workers end at about the same time
MOST_NOTICES = 10
KILLED = "the process that computed it was killed, perhaps for lack of memory"


def sweep(  # noqa: PLR0913 - the keys of [sweep] and the options of its execution
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
    """Replay a scenario at all points of a grid and gather the outputs in one Dataset.

    Parameters
    ----------
    scenario : Scenario or path
    over : dict, optional
        The swept keys, each with its values or a range, as in ``[sweep.over]`` of a scenario:
        ``{"friction.coefficient": [0.1, 0.2], "surface.seed": range(20)}``. By default ``[sweep]``
        of the scenario.
    together : sequence of sequence of str
        Keys whose values vary together, as one dimension; all others are combined with each other.
    outputs : sequence of str
        Names of summary values or variables, as listed on the page on sweeps; by default those of
        the scenario, otherwise the summary values that any contact has.
    store : path, optional
        A folder that keeps completed cells. An interrupted sweep resumes there and recomputes no
        cell; several sweeps may share it, also simultaneously. Workers on another machine need it
        under the same name.
    workers : int
        Processes on this machine; with 1 the cells are computed in this one. They do not change a
        bit of the result. A script that uses several needs ``if __name__ == "__main__":`` around
        its statements.
    executor : optional
        Computes in their place, and is not shut down: an executor of concurrent.futures or
        mpi4py.futures, or a client of dask.distributed.
    progress : bool
        Show a progress bar if standard error is a terminal.
    notify : callable, optional
        Callback(str) for notices: failed cells and their reasons; the next sweep computes them
        again.

    Returns
    -------
    xarray.Dataset
        One dimension for each swept key (or group of keys), named after the key with ``_`` for all
        characters except letters and digits (``friction_coefficient``), with its values in SI; the
        outputs have these dimensions and their own ``step`` and ``asperity``. Failed cells hold
        NaN, and ``failure`` states their reasons.

    Raises
    ------
    InputError
        A scenario or a sweep that cannot be used; all cells have failed.
    OSError
        A cell cannot be stored.

    Examples
    --------
    >>> found = hs.sweep("scenarios/04_normal_up_tangential_up.toml", {"friction.coefficient": [0.2, 0.3]})
    >>> print((found.preliminary_displacement * 1e9).round(2).values)
    [19.61 29.41]
    """
    scenario = as_scenario(scenario)
    section = scenario.sections.sweep
    requested = tuple(outputs) or (section.outputs if section is not None and over is None else ())
    grid, outputs = read_sweep(scenario, outputs, over, together)
    plan = _Plan(scenario, outputs, None if store is None else Path(store), list(grid.points()))
    notices = [f"{path}: is damaged, ignored; the cell is computed again" for path in plan.damaged]
    notify_first(notices, "damaged cells are ignored", notify)
    stored = "" if store is None else f", {len(plan.cells):,} of them in {store} already"
    log_message(
        __name__, "info", "%s: %s cells%s", scenario.path.name, f"{len(plan.points):,}", stored
    )
    try:
        plan.carry_out(executor, workers, progress=progress)
    except KeyboardInterrupt as error:
        raise KeyboardInterrupt(f"interrupted; {plan.describe_stored()}") from error
    reasons = dict(sorted((plan.reasons | find_mismatches(plan.cells)).items()))
    notices = [
        f"cell {index} ({describe_point(plan.points[index])}) failed: {reason}"
        for index, reason in reasons.items()
    ]
    notify_first(notices, "more cells have failed", notify)
    cells = [None if index in reasons else plan.cells[index] for index in range(len(grid))]
    # the picture shows the first requested output
    return gather(scenario, grid, cells, reasons).assign_attrs(
        {"outputs": " ".join(requested)} if requested else {}
    )


def describe_point(point: Point) -> str:
    """Format the keys of a point with their values."""
    return ", ".join(f"{key} = {value}" for key, value in point.items())


def notify_first(notices: Sequence[str], more: str, notify: Notify) -> None:
    """Pass on the first notices, and the number of the remaining ones."""
    for notice in notices[:MOST_NOTICES]:
        notify(notice)
    if len(notices) > MOST_NOTICES:
        notify(f"… and {len(notices) - MOST_NOTICES:,} {more}")


def read_sweep(
    scenario: Scenario,
    outputs: Sequence[str] = (),
    over: Mapping[str, Any] | None = None,
    together: Sequence[Sequence[str]] = (),
) -> tuple[Grid, tuple[str, ...]]:
    """Return grid and outputs of a sweep (default: ``[sweep]``); InputError with file and key if they are wrong."""
    section = scenario.sections.sweep
    with located_errors(scenario.path.name):
        if over is None:
            if section is None:
                raise InputError(
                    "has no [sweep]; expected one, as [sweep.over] with friction.coefficient = [0.1, 0.2]"
                )
            over, together, outputs = (
                section.over,
                section.together,
                tuple(outputs) or section.outputs,
            )
        with error_path("sweep"):
            grid, outputs = build_grid(over, together), chosen_outputs(outputs)
    # a key or a value that is wrong is an error before anything is computed
    swept_coordinates(scenario, grid)
    return grid, outputs


@attrs.frozen
class Batch:
    """Cells that a worker computes in sequence."""

    scenario: Scenario
    outputs: tuple[str, ...]
    store: Path | None
    cells: tuple[tuple[int, str, Point], ...]  #: the name is that in the store
    #: wait for cells that another process is computing, instead of skipping them
    wait: bool = False


def compute_batch(batch: Batch) -> list[xr.Dataset | str | None]:
    """Return the cells of a batch; a string if one has failed, None if another process is computing it.

    Completed cells are stored, and stored cells are read. OSError if a cell cannot be stored.
    """
    return [_compute_cell(batch, name, point) for _, name, point in batch.cells]


def _compute_cell(batch: Batch, name: str, point: Point) -> xr.Dataset | str | None:
    if batch.store is None:
        return _attempt(batch, point)
    store = Store(batch.store)
    with store.claim(name, wait=batch.wait) as mine:
        if not mine:
            return None
        # another process may have ended it meanwhile
        if (stored := store.read(name)) is not None:
            return stored
        log_message(__name__, "info", "cell %s: %s", name, point)
        outcome = _attempt(batch, point)
        if not isinstance(outcome, str):
            store.write(name, outcome)
        return outcome


def _attempt(batch: Batch, point: Point) -> xr.Dataset | str:
    try:
        return cell(batch.scenario, point, batch.outputs)
    except HistorySimError as error:
        return str(error)
    except Exception as error:  # noqa: BLE001 - one failure does not stop the others
        return f"{type(error).__name__}: {error}"


@attrs.define
class _Plan:
    """The cells of a sweep: stored, computed and missing ones."""

    scenario: Scenario
    outputs: tuple[str, ...]
    folder: Path | None
    points: list[Point]
    names: list[str] = attrs.field(init=False)
    cells: dict[int, xr.Dataset] = attrs.field(factory=dict, init=False)
    reasons: dict[int, str] = attrs.field(factory=dict, init=False)
    #: files of cells that hold something else
    damaged: list[Path] = attrs.field(factory=list, init=False)
    #: cells that another process is computing
    elsewhere: set[int] = attrs.field(factory=set, init=False)

    def __attrs_post_init__(self) -> None:
        self.names = [""] * len(self.points)
        if self.folder is None:
            return
        # damaged and unfinished cells count as missing, and are computed again
        self.folder.mkdir(parents=True, exist_ok=True)
        store = Store(self.folder)
        store.tidy()
        self.names = [digest(self.scenario, point, self.outputs) for point in self.points]
        stored = {index: store.read(name) for index, name in enumerate(self.names)}
        self.cells = {index: cell for index, cell in stored.items() if cell is not None}
        self.damaged = store.find_damaged(
            name for index, name in enumerate(self.names) if index not in self.cells
        )

    def carry_out(self, executor: object, workers: int, *, progress: bool) -> None:
        """Compute the missing cells; cells that another process is computing come last."""
        bar = {"desc": "sweep", "initial": len(self.cells)}
        with progress_bar(progress, "cell", len(self.points), **bar) as done:
            self._run(executor, workers, done, wait=False)
            self.elsewhere.clear()
            self._run(executor, workers, done, wait=True)

    def describe_stored(self) -> str:
        """Describe the cells that survive an interrupt."""
        count = f"{len(self.cells):,} of {len(self.points):,} cells"
        if self.folder is None:
            return f"{count} are lost without a store"
        return f"{self.folder} keeps {count}, and the same sweep resumes there"

    def _run(
        self, user_executor: object, workers: int, done: Callable[[int], object], *, wait: bool
    ) -> None:
        """Compute the missing cells; after a killed process cell by cell, with half as many processes."""
        apart, size = workers > 1, MOST_CELLS_IN_A_BATCH
        while missing := self._missing_cells():
            try:
                with open_executor(min(workers, len(missing)), user_executor, apart=apart) as (
                    executor,
                    count,
                ):
                    size = max(1, min(size, len(missing) // (count * FEWEST_BATCHES_OF_A_WORKER)))
                    batches = [
                        self._batch(missing[start : start + size], wait)
                        for start in range(0, len(missing), size)
                    ]
                    # one process, after others were killed, has one cell at a time
                    at_once = 1 if apart and workers == 1 else AHEAD * count
                    for index, results in outcomes(compute_batch, batches, executor, at_once):
                        self._collect(batches[index], results)
                        done(sum(cell is not None for cell in results))
            except BrokenError:
                if user_executor is not None:
                    raise
                if workers == 1:
                    self.reasons[self._missing_cells()[0]] = KILLED
                    done(1)
                workers, size = max(1, workers // 2), 1

    def _missing_cells(self) -> list[int]:
        """Return the indices of the missing cells; cells of one surface are adjacent."""
        surfaces: dict[str, list[int]] = {}
        for index, point in enumerate(self.points):
            if (
                index not in self.cells
                and index not in self.reasons
                and index not in self.elsewhere
            ):
                keys = [item for item in point.items() if item[0].startswith("surface.")]
                surfaces.setdefault(repr(keys), []).append(index)
        return [index for indices in surfaces.values() for index in indices]

    def _batch(self, indices: Sequence[int], wait: bool) -> Batch:
        cells = tuple((index, self.names[index], self.points[index]) for index in indices)
        return Batch(self.scenario, self.outputs, self.folder, cells, wait)

    def _collect(self, batch: Batch, results: Sequence[xr.Dataset | str | None]) -> None:
        for (index, _, _), outcome in zip(batch.cells, results, strict=True):
            if outcome is None:
                self.elsewhere.add(index)
            elif isinstance(outcome, str):
                self.reasons[index] = outcome
            else:
                self.cells[index] = outcome
