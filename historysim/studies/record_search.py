"""Friction loops and sliding friction of a history, a measurement, a scenario, or their file; also run by run."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import attrs

from historysim.asperities.instrument import RIGID
from historysim.basics.units import quantity_text
from historysim.basics.wording import brief, shell_word
from historysim.errors import InputError, error_path
from historysim.measured import fretting
from historysim.measured.branches import DEFAULT, Definitions
from historysim.measured.comparison import Comparison
from historysim.measured.creep import Creep
from historysim.measured.loop_values import MEAN_QUANTITIES
from historysim.measured.loops import Loops, loops_of_history, loops_of_measurement
from historysim.measured.reduction import Measurement
from historysim.measured.sliding import Over, Sliding, sliding_of_history, sliding_of_measurement
from historysim.results.layout import is_dataset
from historysim.results.queries import check_one_direction
from historysim.results.result_files import file_type, open_result
from historysim.scenario.loading_kinds import EACH
from historysim.scenario.runs import Result, Runs, each_run
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.schema import explicit_fields, located_errors

if TYPE_CHECKING:
    import xarray as xr

    from historysim.scenario.fit import Fit


Record: TypeAlias = "xr.Dataset | Measurement | Scenario | str | Path"


def loops(
    record: Record,
    *,
    dead_band: float | None = None,
    skip: int = 0,
    skip_per_level: int = 0,
    definitions: Definitions | None = None,
) -> Loops | Any:  # noqa: ANN401 - Runs, for several runs
    """Evaluate the friction loops of a record, measured or simulated.

    Parameters
    ----------
    record : xarray.Dataset, Measurement, Scenario or path
        A history; a measurement; a scenario that replays one; or the file of a scenario (TOML) or a
        result (netCDF).
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts as a reversal [m]; by default
        the dead band of the measurement or its scenario, else 5 % of the range of the displacement.
    skip : int
        Loops at the start that are left out.
    skip_per_level : int
        Loops that are left out at the start of each series at one normal load.
    definitions : Definitions, optional
        Definitions of sliding, of the end and of the start of a branch.

    Returns
    -------
    Loops, or Runs
        With ``run = "each"``, or a folder or pattern of files, a sequence of `Run`: the ``number``
        of each run and its ``result``, None if it cannot be evaluated.

    Raises
    ------
    InputError
        An unsupported object, a file that cannot be used, a record without a complete loop, or with
        loops in the wrong sense.

    Examples
    --------
    >>> loops = hs.loops("scenarios/15_instrument_in_series.toml")
    >>> len(loops)
    8
    """
    options: dict[str, Any] = {
        "dead_band": dead_band,
        "skip": skip,
        "skip_per_level": skip_per_level,
    }
    options["definitions"] = DEFAULT if definitions is None else definitions
    record = _load_scenario(record)
    if isinstance(record, Scenario) and record.run == EACH:
        return each_run(record, lambda run: loops(run, **options))
    with _open_record(record) as (channels, scenario):
        check_one_direction(channels, "a query for loops")
        if not isinstance(channels, Measurement):
            return loops_of_history(channels, **options)
        instrument = RIGID if scenario is None else scenario.instrument
        contact = channels.without_spring(instrument.parallel_stiffness)
        evaluation = loops_of_measurement(
            contact, lateral_stiffness=instrument.stiffness, **options
        )
        return (
            evaluation
            if scenario is None
            else attrs.evolve(evaluation, columns=_columns_question(scenario))
        )


def sliding(record: Record, *, over: Over | None = None, windows: int = 50) -> Sliding | Any:  # noqa: ANN401 - Runs, for several runs
    """Evaluate friction over time or distance of a unidirectional record, measured or simulated.

    Parameters
    ----------
    record
        As for `loops`.
    over : {"time", "distance"}, optional
        Abscissa; by default the distance if the displacement is known.
    windows : int
        Number of windows of equal length.

    Returns
    -------
    Sliding, or Runs
        Means per window, static peak, and steady value; of several runs as for `loops`.

    Raises
    ------
    InputError
        An unsupported object, a file that cannot be used, or a record that reverses or is never
        pressed.
    """
    record = _load_scenario(record)
    if isinstance(record, Scenario) and record.run == EACH:
        return each_run(record, lambda run: sliding(run, over=over, windows=windows))
    with _open_record(record) as (channels, scenario):
        check_one_direction(channels, "a query for friction over time")
        if not isinstance(channels, Measurement):
            return sliding_of_history(channels, over=over, windows=windows)
        instrument = RIGID if scenario is None else scenario.instrument
        contact = channels.without_spring(instrument.parallel_stiffness)
        return sliding_of_measurement(contact, over=over, windows=windows)


def _load_scenario(record: Record) -> Record:
    """Load the scenario of a path; return other records and paths unchanged."""
    is_path = isinstance(record, str | Path)
    return load(record) if is_path and file_type(Path(record)) == "scenario" else record  # type: ignore[arg-type]


@contextmanager
def _open_record(record: Record) -> "Iterator[tuple[xr.Dataset | Measurement, Scenario | None]]":
    """Yield the history or the measurement of a record, and the scenario of a measurement."""
    if isinstance(record, str | Path):
        kind = file_type(Path(record))
        if kind in {"result", "zarr"}:
            with open_result(Path(record)) as history:
                yield history, None
            return
        if kind != "scenario":
            again = (
                f"historysim run {shell_word(record)} recomputes the result of a log"
                if kind == "log"
                else ""
            )
            mend = (
                again
                or f"of a record `historysim columns {shell_word(record)} -o my.toml` writes a scenario"
            )
            raise InputError(
                f"{record}: is neither a scenario (.toml) nor a result of historysim run; expected one of them; {mend}"
            )
    if isinstance(record, Scenario):
        measurement = record.measurement()
        with located_errors(record.path.name), error_path("loading"):
            yield measurement, record
    elif isinstance(record, Measurement) or is_dataset(record):
        yield record, None
    else:
        raise InputError(
            f"{brief(record)}: cannot be evaluated; expected a history (Dataset), a Measurement, a Scenario, or the "
            "path of a scenario or a result"
        )


def _columns_question(scenario: Scenario) -> str:
    """Ask whether the columns that were read are right."""
    loading = scenario.measured_loading()
    channels = {**explicit_fields(loading.columns), **explicit_fields(loading.response)}
    used = [
        f"{name} = {' and '.join(repr(source.column) for source in channels[name].sources)}"
        for name in ("tangential_load", "tangential_displacement")
        if name in channels
    ]
    command = f"historysim columns {shell_word(loading.files[0])}"
    return f"are the columns right, {' and '.join(used)}? {command} lists the columns"


Rows = list[tuple[str, ...]]


def loop_rows(runs: Runs[Loops]) -> Rows:
    """Return a table of the loops of each run; the first row has the headings."""
    quantities = dict(MEAN_QUANTITIES)
    del quantities["displacement_from_zero_load"]
    return _rows(
        ("loops", *(quantity.label for quantity in quantities.values())),
        runs,
        lambda loops: (str(len(loops)), *map(loops.text, quantities)),
    )


def fretting_rows(runs: Runs[Loops]) -> Rows:
    """Return a table of the fretting quantities of each run, and their means; the first row has the headings."""
    return fretting.run_rows(runs.results)


def fretting_of_runs(runs: Runs[Loops]) -> fretting.Fretting:
    """Return the fretting report over the runs of a record, such as the stored cycles of a fretting log."""
    return fretting.Fretting.from_runs(runs.results)


def sliding_rows(runs: Runs[Sliding]) -> Rows:
    """Return a table of the friction of each run; the first row has the headings."""
    labels = ("slides", "friction coefficient", "static peak", "steady value")

    def row(friction: "Sliding") -> tuple[str, ...]:
        lines = dict(friction.summary())
        return tuple(lines[label].partition(":")[0].partition(";")[0] for label in labels)

    return _rows(labels, runs, row)


def fit_rows(runs: "Runs[Fit]") -> Rows:
    """Return a table of the estimates of each run; the first row has the headings."""
    names = next(list(run.result.values) for run in runs if run.result is not None)

    def row(fitted: "Fit") -> tuple[str, ...]:
        rms = quantity_text(fitted.comparison.residuals.rms, "N", 3)
        return (
            *(parameter.text() for parameter in fitted.parameters),
            f"{fitted.estimates.misfit:.3g}",
            rms,
        )

    return _rows((*names, "misfit over noise", "rms difference"), runs, row)


def comparison_rows(runs: Runs[Comparison]) -> Rows:
    """Return a table of the comparison of each run; the first row has the headings."""
    return _summary_rows(("samples compared", "loops", "rms difference"), runs)


def creep_rows(runs: Runs[Creep]) -> Rows:
    """Return a table of the creep of each run; the first row has the headings."""
    first = next(iter(runs.results.values()))
    labels = tuple(label for label, _ in first.summary() if label not in {"note", "warning"})
    return _summary_rows(tuple(dict.fromkeys(labels)), runs)


def _summary_rows(labels: tuple[str, ...], runs: Runs[Any]) -> Rows:
    """Return a table of some lines of the summary of each run."""

    def row(result: Any) -> tuple[str, ...]:  # noqa: ANN401 - a class with a summary
        lines = dict(result.summary())
        return tuple(str(lines.get(label, "–")) for label in labels)

    return _rows(labels, runs, row)


def _rows(
    heading: tuple[str, ...], runs: Runs[Result], row: Callable[[Result], tuple[str, ...]]
) -> Rows:
    missing = ("–",) * len(heading)
    cells = [
        (str(run.number), *(missing if run.result is None else row(run.result))) for run in runs
    ]
    return [("run", *heading), *cells]
