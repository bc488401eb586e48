"""Evaluation of a record of several runs, such as stored cycles or one file for each test, run by run."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Generic, TypeVar, overload

import attrs

from historysim.basics.wording import columns, count_text
from historysim.errors import HistorySimError, InputError
from historysim.results.plots.pictures import make_figure
from historysim.results.report.page import (
    Section,
    collapsible,
    page,
    paragraph,
    picture,
    render_page,
    table,
)
from historysim.scenario.scenario import Scenario

Result = TypeVar("Result")
MOST_PICTURES = 24  # runs with a picture in a report


@attrs.frozen
class Run(Generic[Result]):
    """One run; its result is None if it cannot be evaluated, for the reason ``problem``."""

    number: int  #: from 1, or the value of its column
    scenario: Scenario  #: scenario of this run
    result: Result | None
    problem: str = ""


@attrs.frozen(repr=False)
class Runs(Sequence[Run[Result]]):
    """The results of the runs of a record, in their order."""

    scenario: Scenario  #: scenario of all runs
    items: tuple[Run[Result], ...]

    @overload
    def __getitem__(self, index: int) -> Run[Result]: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Run[Result], ...]: ...
    def __getitem__(self, index: int | slice) -> Run[Result] | tuple[Run[Result], ...]:
        """Return a run by its position."""
        return self.items[index]

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.items)

    def __iter__(self) -> Iterator[Run[Result]]:
        return iter(self.items)

    def __repr__(self) -> str:
        return columns([(f"run {run.number}", run.problem or repr(run.result)) for run in self])

    @property
    def results(self) -> dict[int, Result]:
        """The results by number of the run, without runs that cannot be evaluated."""
        return {run.number: run.result for run in self if run.result is not None}


def each_run(scenario: Scenario, find: Callable[[Scenario], Result]) -> Runs[Result]:
    """Evaluate each run of the files of a scenario with ``find``.

    Raises InputError: a file, or all of its runs, cannot be used.
    """
    runs: list[Run[Result]] = []
    for number, scenario_of_run in scenario.numbered_runs().items():
        try:
            runs.append(Run(number, scenario_of_run, find(scenario_of_run)))
        except HistorySimError as error:
            runs.append(Run(number, scenario_of_run, None, str(error)))
    if all(run.result is None for run in runs):
        raise InputError(
            f"none of {count_text(len(runs), 'run', 'runs')} can be used; {runs[0].problem}"
        )
    return Runs(scenario, tuple(runs))


@render_page.register(Runs)
def _page(runs: Runs[Any]) -> str:
    sections = []
    for index, run in enumerate(runs):
        blocks = (
            [paragraph(run.problem, "note")]
            if run.result is None
            else [table(run.result.summary())]
        )
        if run.result is not None and index < MOST_PICTURES:
            blocks.append(picture(make_figure(run.result, target=None), f"Run {run.number}."))
        sections.append(Section(f"Run {run.number}", tuple(blocks)))
    scenario = runs.scenario
    source = Section("Provenance", (collapsible("the scenario", scenario.text),))
    return page(scenario.title or scenario.path.stem, [*sections, source])
