"""Find loops, or sliding friction, in a history, a measurement, a scenario, or a file of them; run by run, too."""

import functools
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import attrs
import xarray as xr

from historysim.asperities.instrument import RIGID
from historysim.basics.units import quantity_text
from historysim.basics.wording import brief, shell_word
from historysim.errors import InputError, at
from historysim.measured import fretting
from historysim.measured.branches import DEFAULT, Definitions
from historysim.measured.loop_values import BRANCH_QUANTITIES, LOOP_QUANTITIES
from historysim.measured.loops import Loops, loops_of_history, loops_of_measurement
from historysim.measured.reduction import Measurement
from historysim.measured.sliding import Over, Sliding, sliding_of_history, sliding_of_measurement
from historysim.results.asking import check_direction
from historysim.results.result_files import kind_of, open_result
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.schema import given, reported

if TYPE_CHECKING:
    from historysim.scenario.fit import Fit


Record = xr.Dataset | Measurement | Scenario | str | Path


def loops(
    record: Record,
    *,
    dead_band: float | None = None,
    skip: int = 0,
    skip_per_level: int = 0,
    definitions: Definitions | None = None,
) -> Loops:
    """Return the friction loops of a record, measured or simulated.

    Parameters
    ----------
    record : xarray.Dataset, Measurement, Scenario or path
        A history; a measurement; a scenario that replays one; or the file of a scenario (TOML) or a result (netCDF).
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts as a reversal [m]; by default that of the
        measurement or its scenario, else 5 % of the range of the displacement.
    skip : int
        Loops at the start that are left out.
    skip_per_level : int
        Loops that are left out at the start of each series at one normal load.
    definitions : Definitions, optional
        What is taken for sliding, for reached, and for the beginning of a branch.

    Raises
    ------
    InputError
        Something else, a file that cannot be used, a record without a whole loop, or with loops that run the wrong way
        round.

    Examples
    --------
    >>> loops = hs.loops("scenarios/15_instrument_in_series.toml")
    >>> len(loops)
    8
    """
    options: dict[str, Any] = {"dead_band": dead_band, "skip": skip, "skip_per_level": skip_per_level}
    options["definitions"] = DEFAULT if definitions is None else definitions
    with _opened(record) as (channels, scenario):
        check_direction(channels, "a question for loops")
        if isinstance(channels, xr.Dataset):
            return loops_of_history(channels, **options)
        instrument = RIGID if scenario is None else scenario.instrument
        contact = channels.without_spring(instrument.parallel_stiffness)
        found = loops_of_measurement(contact, lateral_stiffness=instrument.stiffness, **options)
        return found if scenario is None else attrs.evolve(found, columns=_question(scenario))


def sliding(record: Record, *, over: Over | None = None, windows: int = 50) -> Sliding:
    """Return friction over time or distance of a record that slides one way, measured or simulated.

    Parameters
    ----------
    record
        As for `loops`.
    over : {"time", "distance"}, optional
        What friction is given over; by default the distance where the displacement is known.
    windows : int
        How many windows of equal length.

    Returns
    -------
    Sliding
        Means per window, the static peak, and the approach to the steady value.

    Raises
    ------
    InputError
        Something else, a file that cannot be used, or a record that turns back or never presses.
    """
    with _opened(record) as (channels, scenario):
        check_direction(channels, "a question for friction over time")
        if isinstance(channels, xr.Dataset):
            return sliding_of_history(channels, over=over, windows=windows)
        instrument = RIGID if scenario is None else scenario.instrument
        contact = channels.without_spring(instrument.parallel_stiffness)
        return sliding_of_measurement(contact, over=over, windows=windows)


@contextmanager
def _opened(record: Record) -> Iterator[tuple[xr.Dataset | Measurement, Scenario | None]]:
    """Give the history or the measurement of a record, and the scenario of a measurement."""
    if isinstance(record, str | Path):
        kind = kind_of(Path(record))
        if kind == "result":
            with open_result(Path(record)) as history:
                yield history, None
            return
        if kind != "scenario":
            again = f"historysim run {shell_word(record)} makes the result of a log" if kind == "log" else ""
            mend = again or f"of a record `historysim columns {shell_word(record)} -o my.toml` writes a scenario"
            raise InputError(f"{record}: is no scenario (.toml) and no result of historysim run; expected one; {mend}")
        record = load(record)
    if isinstance(record, Scenario):
        measurement = record.measurement()
        with reported(record.path.name), at("loading"):
            yield measurement, record
    elif isinstance(record, xr.Dataset | Measurement):
        yield record, None
    else:
        raise InputError(
            f"{brief(record)}: cannot be evaluated; expected a history (Dataset), a Measurement, a Scenario, or the "
            "path of a scenario or a result"
        )


def _question(scenario: Scenario) -> str:
    """Return the columns that were read, as a question whether they are right."""
    loading = scenario.measured_loading()
    channels = {**given(loading.columns), **given(loading.response)}
    used = [
        f"{name} = {' and '.join(repr(source.column) for source in channels[name].sources)}"
        for name in ("tangential_load", "tangential_displacement")
        if name in channels
    ]
    command = f"historysim columns {shell_word(loading.files[0])}"
    return f"are the columns right, {' and '.join(used)}? {command} shows what there is"


def _earlier(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function under its earlier name, which warns."""

    @functools.wraps(function)
    def called(*args: Any, **options: Any) -> Any:  # noqa: ANN401 - of the function
        own = function.__name__
        warnings.warn(f"hs.{name} is called hs.{own} now, as its command is", DeprecationWarning, stacklevel=2)
        return function(*args, **options)

    return called


find_loops, find_sliding = _earlier("find_loops", loops), _earlier("find_sliding", sliding)

Result = TypeVar("Result")
Rows = list[tuple[str, ...]]


@attrs.frozen
class Run(Generic[Result]):
    """One run; its result is None where it cannot be used, and ``problem`` says why."""

    number: int  #: from 1, or the value of its column
    scenario: Scenario  #: that of this run alone
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
    return _rows(
        ("loops", *(text[0] for text in labels.values())),
        runs,
        lambda loops: (str(len(loops)), *(loops.text(name, unit) for name, (_, unit, *_) in labels.items())),
    )


def fretting_rows(runs: "Sequence[Run[Loops]]") -> Rows:
    """Return a table of the fretting quantities of each run, and their means; the first row is the heading."""
    return fretting.run_rows(_evaluated(runs))


def fretting_of_runs(runs: "Sequence[Run[Loops]]") -> fretting.Fretting:
    """Return the fretting report over the runs of a record, such as the stored cycles of a fretting log."""
    return fretting.Fretting.from_runs(_evaluated(runs))


def _evaluated(runs: "Sequence[Run[Loops]]") -> dict[int, Loops]:
    return {run.number: run.result for run in runs if run.result is not None}


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
        rms = quantity_text(fitted.comparison.residuals.rms, "N", 3)
        return (*(each.text() for each in fitted.parameters), f"{fitted.estimates.misfit:.3g}", rms)

    return _rows((*names, "misfit over noise", "rms difference"), runs, row)


def _rows(heading: tuple[str, ...], runs: "Sequence[Run[Result]]", row: Callable[[Result], tuple[str, ...]]) -> Rows:
    missing = ("–",) * len(heading)
    cells = [(str(run.number), *(missing if run.result is None else row(run.result))) for run in runs]
    return [("run", *heading), *cells]
