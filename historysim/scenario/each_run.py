"""Each run of a file by itself, ``loading.run = "each"``: its result, and a table with a row for each."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Generic, TypeVar

import attrs

from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.measured.loop_values import BRANCH_QUANTITIES, LOOP_QUANTITIES
from historysim.scenario.scenario import Scenario

if TYPE_CHECKING:
    from historysim.measured.loops import Loops
    from historysim.measured.sliding import Sliding
    from historysim.scenario.fit import Fit

Result = TypeVar("Result")
Rows = list[tuple[str, ...]]


@attrs.frozen
class Run(Generic[Result]):
    """One run; its result is None where it cannot be used, and ``problem`` says why."""

    number: int
    """From 1, or the value of its column."""
    scenario: Scenario
    """That of this run alone."""
    result: Result | None
    problem: str = ""


def each_run(scenario: Scenario, find: Callable[[Scenario], Result]) -> "list[Run[Result]]":
    """Return the result of ``find`` for each run of a scenario's file.

    Raises InputError: a file that cannot be used, or none of its runs.
    """
    runs: list[Run[Result]] = []
    for each in scenario.runs():
        number = each.run
        if not isinstance(number, int):
            raise InputError(f'{scenario.path.name}: loading.run: {number!r}; expected "each", for a row of each run')
        try:
            runs.append(Run(number, each, find(each)))
        except InputError as error:
            runs.append(Run(number, each, None, str(error)))
    if all(run.result is None for run in runs):
        raise InputError(f"none of {len(runs)} runs can be used; {runs[0].problem}")
    return runs


def loop_rows(runs: "Sequence[Run[Loops]]") -> Rows:
    """Return a table of the loops of each run; the first row is the heading."""
    every = {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}
    labels = {name: text for name, text in every.items() if not name.endswith(("_gap", "_zero_load"))}

    def row(loops: "Loops") -> tuple[str, ...]:
        return (str(len(loops)), *(loops.text(name, unit) for name, (_, unit, *_) in labels.items()))

    return _rows(("loops", *(text[0] for text in labels.values())), runs, row)


def sliding_rows(runs: "Sequence[Run[Sliding]]") -> Rows:
    """Return a table of the friction of each run; the first row is the heading."""
    labels = ("slides", "friction coefficient", "static peak", "steady value")

    def row(friction: "Sliding") -> tuple[str, ...]:
        lines = dict(friction.summary())
        return tuple(lines[label].partition(":")[0].partition(";")[0] for label in labels)

    return _rows(labels, runs, row)


def fit_rows(runs: "Sequence[Run[Fit]]") -> Rows:
    """Return a table of the estimates of each run; the first row is the heading."""
    names = next(list(run.result.values) for run in runs if run.result is not None)

    def row(fitted: "Fit") -> tuple[str, ...]:
        rms = quantity_text(fitted.comparison.left.rms, "N", 3)
        return (*(each.text() for each in fitted.parameters), f"{fitted.estimates.misfit:.3g}", rms)

    return _rows((*names, "misfit over noise", "rms difference"), runs, row)


def _rows(heading: tuple[str, ...], runs: "Sequence[Run[Result]]", row: Callable[[Result], tuple[str, ...]]) -> Rows:
    missing = ("–",) * len(heading)
    cells = [(str(run.number), *(missing if run.result is None else row(run.result))) for run in runs]
    return [("run", *heading), *cells]
