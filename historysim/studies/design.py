"""The inverse of a sweep: the value of a key at which a history has a wanted output, and its spread over seeds."""

import functools
import math
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats, scalar
from historysim.basics.units import quantity, quantity_text
from historysim.basics.wording import Lines, Notify, count_text, nearest, progress_bar, silent
from historysim.errors import HistorySimError, InputError, UnlikelyValueWarning, error_path
from historysim.scenario.grid import Grid, Point, variable_name
from historysim.scenario.optional_sections import DesignSection
from historysim.scenario.scenario import Scenario, as_scenario
from historysim.scenario.schema import located_errors
from historysim.studies.cell import SUMMARIES, cell
from historysim.studies.sweep import describe_point, notify_first
from historysim.studies.sweep_table import (
    FAILURE,
    failures,
    find_unit,
    swept_coordinates,
    table_attributes,
)
from historysim.studies.workers import map_in_order, open_executor

# values from one end to the other at which the output is computed before a root is sought
SCANNED_VALUES = 9
ROOT_TOLERANCE = 1e-9  # relative accuracy of the value that is found
# difference of the output at a root from the target, over the target, beyond which it jumps there
LARGEST_JUMP = 1e-3
DEFAULT_QUANTILE = 0.95  # fraction of the points at which an output is below, or above, a limit
Limit = Literal["below", "above"]
T = TypeVar("T")


@attrs.frozen
class Problem:
    """The value of a key, between low and high, at which an output is a target, in SI.

    With a limit it is the value at which the output is below or above the target in a fraction of
    the points.
    """

    scenario: Scenario
    key: str
    low: float
    high: float
    output: str
    target: float
    limit: Limit | None = None
    quantile: float = DEFAULT_QUANTILE

    @property
    def unit(self) -> str:
        """Unit of the output."""
        return SUMMARIES[self.output].units

    def compute_output(self, point: Point, value: float) -> float:
        """Return the output at a point, for a value of the key."""
        with warnings.catch_warnings():
            # a trial may be implausible; the answer is the user's to judge
            warnings.simplefilter("ignore", UnlikelyValueWarning)
            return float(
                cell(self.scenario, {**point, self.key: value}, (self.output,))[self.output]
            )


@attrs.frozen
class Root:
    """A root, or the reason why none was found."""

    value: float = math.nan  #: value of the key
    output: float = math.nan  #: output of the scenario there
    reason: str = ""  #: reason why none was found
    #: further values in the range at which the output crosses the target
    further_crossings: int = 0
    #: whether the output is larger at the largest value of the key than at the smallest
    rises: bool = False
    #: side of the limit on which the output is at all values of the key
    throughout: Limit | None = None


def design(  # noqa: PLR0913 - the keys of [design] and of a sweep
    scenario: Scenario | str | os.PathLike[str],
    key: str | None = None,
    between: Sequence[Any] | None = None,
    target: float | str | None = None,
    *,
    output: str = "drift",
    over: Mapping[str, Any] | None = None,
    below: float | str | None = None,
    above: float | str | None = None,
    quantile: float | None = None,
    workers: int = 1,
    executor: object = None,
    progress: bool = False,
    notify: Notify = silent,
) -> xr.Dataset:
    """Find the value of a key at which an output of a scenario reaches a target, such as the finish for a drift.

    Parameters
    ----------
    scenario : Scenario or path
    key : str, optional
        The free key, which has a number as its value: ``"surface.rms_height"``. By default all
        arguments from `key` to `quantile` are taken from ``[design]`` of the scenario.
    between : sequence of two
        The least and the greatest value of the key, in SI or with a unit.
    target : float or str
        The wanted output, in SI or with a unit.
    output : str
        Name of a summary value, as listed on the page on sweeps.
    over : dict, optional
        Keys with values over which the search is repeated, such as ``{"surface.seed":
        range(20)}``.
    below, above : float or str, optional
        Upper or lower limit of the output in place of a target, in SI or with a unit.
    quantile : float, optional
        Fraction of the points of `over` in which the limit holds, 0.5 or more; 0.95 by default.
    workers, executor, progress, notify
        As for `historysim.sweep`; one search is one task.

    Returns
    -------
    xarray.Dataset
        Along the keys of `over`: the value of the key, under its name with ``_`` for all but
        letters and digits; the output there; and ``OUTPUT_at_median``, the output if all had the
        median of these values. With a limit that is ``OUTPUT_at_quantile``, at the value of the
        attribute ``chosen``. Points without a value hold NaN, and ``failure``
        states the reason. If the output crosses the target several times, the smallest value is
        returned with a notice.

    Raises
    ------
    InputError
        A scenario, a key or a range that cannot be used, or no value was found at all.

    Notes
    -----
    The output is computed for nine values over the range, evenly spaced, or in their
    logarithm if both ends are positive; between two values on either side of the target the root is
    found by Brent's method (scipy).
    """
    scenario = as_scenario(scenario)
    section = None
    if key is not None:
        share = None if quantile is None else scalar("quantile", quantile)
        ends = (
            tuple(between) if np.iterable(between) and not isinstance(between, str) else (between,)
        )
        with located_errors(scenario.path.name), error_path("design"):
            keys: Any = over
            section = DesignSection(key, ends, target, below, above, share, output, keys)
    problem, grid = read_problem(scenario, section)
    points = list(grid.points())
    with open_executor(workers, executor) as (chosen, count):

        def solve_all(function: Callable[[Point], T]) -> list[T]:
            with progress_bar(
                progress, "point", len(points), desc="searching", leave=False
            ) as done:
                return map_in_order(function, points, chosen, count, done)

        roots = solve_all(functools.partial(_search, problem))
        values = np.array([root.value for root in roots])
        if not np.isfinite(values).any():
            raise InputError(
                f"{scenario.path.name}: design: no value of {problem.key} was found; {roots[0].reason}"
            )
        _notify_results(problem, points, roots, notify)
        with located_errors(scenario.path.name), error_path("design"):
            middle = (
                float(np.nanmedian(values))
                if problem.limit is None
                else _value_at_quantile(problem, roots)
            )
        # the spread over the points if all had the one value that is recommended
        outputs_at_value = solve_all(functools.partial(_compute_output_or_nan, problem, middle))
    return _dataset(problem, grid, roots, outputs_at_value, middle)


def read_problem(scenario: Scenario, section: DesignSection | None = None) -> tuple[Problem, Grid]:
    """Return the problem of a section (default: that in the scenario) and the grid over which it is solved."""
    section = section or scenario.sections.design
    with located_errors(scenario.path.name), error_path("design"):
        if section is None:
            raise InputError(
                "missing; expected [design] with key, between and target, as key = 'friction.coefficient', between = "
                "[0.05, 0.5] and target = '10 nm'"
            )
        if section.output not in SUMMARIES:
            raise InputError(f"output is {section.output!r}; {nearest(section.output, SUMMARIES)}")
        key, grid = section.key, section.grid()
    unit = find_unit(scenario.at({**next(grid.points()), key: section.between[0]}).sections, key)
    with located_errors(scenario.path.name), error_path("design"):
        if not unit:
            raise InputError(
                f"{key} is not a number or a quantity; expected a key such as surface.rms_height"
            )
        with error_path("between"):
            low, high = (quantity(value, unit) for value in section.between)
            if not low < high:
                raise InputError(
                    f"{low:g} and {high:g}; expected the least value, then the greatest"
                )
        limit: Limit | None = (
            "below" if section.below is not None else "above" if section.above is not None else None
        )
        with error_path(limit or "target"):
            target = quantity(getattr(section, limit or "target"), SUMMARIES[section.output].units)
    swept_coordinates(scenario, grid)
    fraction = DEFAULT_QUANTILE if section.quantile is None else section.quantile
    return Problem(scenario, key, low, high, section.output, target, limit, fraction), grid


def _notify_results(
    problem: Problem, points: Sequence[Point], roots: Sequence[Root], notify: Notify
) -> None:
    """Notify at which points no value was found, and why, and where it is not the only one."""
    notes = []
    for point, root in zip(points, roots, strict=True):
        where = describe_point(point) or problem.scenario.path.name
        if root.reason and not (problem.limit and root.throughout):
            notes.append(f"{where}: {root.reason}")
        if root.further_crossings:
            more = count_text(root.further_crossings, "more value", "more values")
            notes.append(f"{where}: the least value counts; {more} of {problem.key} would do, too")
    notify_first(notes, "more notes of this kind", notify)
    if problem.limit is None:
        return
    required, sure = _fewest(problem.quantile)
    if len(roots) < required and any("seed" in name for name in points[0]):
        share, further = f"{problem.quantile:.0%}", len(roots) + 1
        notify(
            f"{share} of {len(roots)} points is their extreme value, which one further point in {further} exceeds; "
            f"expected {required} points for {share}, or {sure} for a confidence of 95 %: add seeds"
        )
    limit = quantity_text(problem.target, problem.unit)
    for side in ("below", "above"):
        if count := sum(root.throughout == side for root in roots):
            points_of = f"{count:,} of {len(roots):,} points"
            notify(
                f"{problem.output} stays {side} {limit} over the whole of between at {points_of}"
            )


def _fewest(share: float) -> tuple[int, int]:
    """Return the number of points for a share of all such points, and the number for a confidence of 95 %.

    A further point is within the greatest of n with the chance n/(n + 1), and the greatest is
    beyond a fraction q of all points with the confidence 1 - q^n for any distribution (Wilks,
    *Ann. Math. Stat.* 12 (1941) 91).
    """
    return math.ceil(share / (1 - share) - 1e-9), math.ceil(math.log(0.05) / math.log(share))


def _value_at_quantile(problem: Problem, roots: Sequence[Root]) -> float:
    """Return the value at which the output keeps its limit in the wanted fraction of the points."""
    solved = [root for root in roots if math.isfinite(root.value)]
    if len({root.rises for root in solved}) > 1:
        raise InputError(
            f"{problem.output} rises with {problem.key} at some points and falls at others; narrow between"
        )
    # up to its root the output keeps the limit, or from there on
    up_to = solved[0].rises == (problem.limit == "below")
    always, never = (math.inf, -math.inf) if up_to else (-math.inf, math.inf)
    bounds = [
        root.value
        if math.isfinite(root.value)
        else always
        if root.throughout == problem.limit
        else never
        for root in roots
        if math.isfinite(root.value) or root.throughout
    ]
    # of few points the one beyond, so that it is this share of them or more
    rank = math.ceil(problem.quantile * len(bounds) - 1e-9)
    value = sorted(bounds, reverse=up_to)[rank - 1]
    if value == never:
        share = np.mean([bound != never for bound in bounds])
        raise InputError(
            f"{problem.output} is {problem.limit} {quantity_text(problem.target, problem.unit)} in "
            f"{share:.0%} of the points at best; expected {problem.quantile:.0%}: lower quantile, or widen between"
        )
    return float(np.clip(value, problem.low, problem.high))


def _search(problem: Problem, point: Point) -> Root:
    """Return where the output crosses its target."""
    try:
        return _find_crossing(problem, point)
    except HistorySimError as error:
        return Root(reason=str(error))


def _find_crossing(problem: Problem, point: Point) -> Root:
    from scipy.optimize import brentq

    space = np.geomspace if problem.low > 0 else np.linspace
    values = space(problem.low, problem.high, SCANNED_VALUES)
    outputs = np.array([problem.compute_output(point, value) for value in values])
    missing = outputs - problem.target
    rises = bool(outputs[-1] > outputs[0])
    # a value that meets the target itself is a crossing of the stretch that begins there
    next_missing = np.append(missing[1:], math.nan)
    crossings = np.flatnonzero((missing == 0) | (missing * next_missing < 0))
    if not crossings.size:
        smallest, largest = (
            quantity_text(extreme, problem.unit) for extreme in (outputs.min(), outputs.max())
        )
        if np.ptp(outputs) <= 1e-12 * np.abs(outputs).max():
            expected = "expected a key that changes it, and for a drift two normal loads"
            return Root(
                reason=f"{problem.output} is {smallest} whatever {problem.key} is; {expected}"
            )
        reason = f"{problem.output} is from {smallest} to {largest} in the range of {problem.key}; widen between"
        return Root(reason=reason, rises=rises, throughout="below" if missing[0] < 0 else "above")
    index = int(crossings[0])
    if missing[index] == 0:
        return Root(
            float(values[index]),
            float(outputs[index]),
            further_crossings=crossings.size - 1,
            rises=rises,
        )

    def residual(value: float) -> float:
        return problem.compute_output(point, value) - problem.target

    low, high = values[index : index + 2]
    # a relative accuracy alone would never be reached at 0
    accuracy = ROOT_TOLERANCE * abs(low) or ROOT_TOLERANCE * abs(high)
    root = float(brentq(residual, low, high, xtol=accuracy, rtol=ROOT_TOLERANCE))
    output = problem.compute_output(point, root)
    # Brent's method also ends at a jump, where another asperity begins to decide
    if abs(output - problem.target) > LARGEST_JUMP * abs(problem.target):
        reached = quantity_text(output, problem.unit)
        return Root(
            reason=f"{problem.output} jumps past its target at {problem.key} = {root:.6g}, to {reached}"
        )
    return Root(root, output, further_crossings=crossings.size - 1, rises=rises)


def _compute_output_or_nan(problem: Problem, value: float, point: Point) -> float:
    try:
        return problem.compute_output(point, value)
    except HistorySimError:
        return math.nan


def _dataset(
    problem: Problem,
    grid: Grid,
    roots: Sequence[Root],
    outputs_at_value: Sequence[float],
    middle: float,
) -> xr.Dataset:
    key, output, text = problem.key, problem.output, SUMMARIES[problem.output].long_name
    key_unit = find_unit(problem.scenario.at({**next(grid.points()), key: middle}).sections, key)
    named = "median" if problem.limit is None else "quantile"
    columns = {
        variable_name(key): (
            [root.value for root in roots],
            key_unit,
            f"{key} at which {output} is the target",
        ),
        output: ([root.output for root in roots], problem.unit, text),
        f"{output}_at_{named}": (
            outputs_at_value,
            problem.unit,
            f"{text}, with the {named} of {key}",
        ),
    }
    data = {
        name: xr.Variable(
            grid.dims, np.reshape(values, grid.shape), {"long_name": long_name, "units": unit}
        )
        for name, (values, unit, long_name) in columns.items()
    }
    if any(reasons := [root.reason for root in roots]):
        data[FAILURE] = failures(grid, reasons, "reason for a missing value, otherwise empty")
    summary_text = f"The {key} at which a frictional contact has the {output} that is wanted."
    attributes = table_attributes(problem.scenario, grid, "Design", summary_text)
    attributes |= {"design_key": key, "design_output": output, "target": problem.target}
    limited = {"limit": problem.limit, "quantile": problem.quantile, "chosen": middle}
    attributes |= {"median": middle} if problem.limit is None else limited
    return xr.Dataset(data, swept_coordinates(problem.scenario, grid), attributes)


def summary(table: xr.Dataset) -> Lines:
    """Return lines of (label, text) of a design."""
    key, output = str(table.attrs["design_key"]), str(table.attrs["design_output"])
    limit, target, size = table.attrs.get("limit"), float(table.attrs["target"]), table[output].size
    unit, output_unit = (str(table[name].attrs["units"]) for name in (variable_name(key), output))
    goal = quantity_text(target, output_unit)
    if limit is not None:
        outputs = _finite(table[f"{output}_at_quantile"])
        keeps_limit = (
            outputs <= target * (1 + ROOT_TOLERANCE)
            if limit == "below"
            else outputs >= target * (1 - ROOT_TOLERANCE)
        )
        share = "" if size == 1 else f" in {table.attrs['quantile']:.0%} of {size}"
        chosen = (key, quantity_text(table.attrs["chosen"], unit))
        output_line = (
            f"{output} there",
            f"{_inner_range(outputs, output_unit)}; {limit} in {keeps_limit.mean():.0%}",
        )
        return Lines([("wanted", f"{output} {limit} {goal}{share}"), chosen, output_line])
    values, outputs = _finite(table[variable_name(key)]), _finite(table[f"{output}_at_median"])
    lines = [("wanted", f"{output} of {goal}")]
    if values.size == 1:
        return Lines([*lines, (key, quantity_text(values[0], unit))])
    middle = f"{quantity_text(np.median(values), unit)} (median of {values.size})"
    reached = f"at or below the wanted in {(outputs <= target).mean():.0%}"
    lines.append((key, f"{middle}; {_inner_range(values, unit)}"))
    lines.append((f"{output} with the median", f"{_inner_range(outputs, output_unit)}; {reached}"))
    return Lines(
        [
            *lines,
            *([("not found", f"in {size - values.size} of {size}")] if values.size < size else []),
        ]
    )


def _finite(values: xr.DataArray) -> Floats:
    numbers: Floats = values.values[np.isfinite(values.values)]
    return numbers


def _inner_range(values: Floats, unit: str) -> str:
    low, high = (quantity_text(bound, unit) for bound in np.quantile(values, (0.05, 0.95)))
    return f"5 to 95 %: {low} to {high}"
