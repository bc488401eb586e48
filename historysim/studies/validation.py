"""A scenario checked without recording it."""

from collections.abc import Mapping
from pathlib import Path
from time import monotonic
from typing import Any

import attrs
import numpy as np

from historysim.basics.limits import most
from historysim.basics.units import quantity_text
from historysim.basics.wording import Lines, count_text
from historysim.errors import InputError, LoadError
from historysim.measured.reduction import check_moves
from historysim.scenario.loading_kinds import EACH
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.scenario_summary import replay_for, summary
from historysim.scenario.schema import explicit_fields
from historysim.scenario.sections import Coefficients


def validate(scenario: str | Path | Scenario, values: Mapping[str, Any] | None = None) -> Lines:
    """Check a scenario, the files that it names, and whether the contact can carry its loads, without recording them.

    Loads are replayed for a few seconds; where that is not enough a line says how far. Of a sweep
    the first and the last cell are replayed, too; a line of ``warning`` says why one of them would
    stay empty.

    Parameters
    ----------
    scenario : path or Scenario
    values : mapping, optional
        Values to take in place of the scenario's, as for `load`; not for a `Scenario`.

    Returns
    -------
    Lines
        What was checked: files and loads, with notes and warnings; `show` describes the scenario.

    Raises
    ------
    InputError
        What is wrong, where, and how to mend it.
    LoadError
        Loads that the contact cannot carry; the message names the waypoint, or the line of the
        file.

    Examples
    --------
    >>> print(hs.validate("scenarios/04_normal_up_tangential_up.toml"))
    keys   known and complete
    files  1 file readable
    loads  242 events over 12 s, which can be carried out
    """
    loaded = scenario if isinstance(scenario, Scenario) else load(scenario, values)
    seconds, start_time = most("SECONDS_OF_VALIDATION"), monotonic()
    ends: dict[int, dict[str, Any]] = {}
    if loaded.sections.sweep is not None:
        from historysim.studies.sweep import read_sweep

        ends = read_sweep(loaded)[0].ends()
    if loaded.sections.design is not None:
        from historysim.studies.design import read_problem

        read_problem(loaded)
    if loaded.sections.fit is not None and loaded.run != EACH:
        from historysim.scenario.fit import prepare_fit

        prepare_fit(loaded)
    if loaded.run == EACH:
        lines = _summarise_runs(loaded, start_time + seconds)
    else:
        lines = (
            _summarise_record(loaded, seconds)
            if _is_measured(loaded)
            else summary(loaded, walk=seconds)
        )
    for number, point in ends.items():
        # a cell that takes long is left to the sweep
        if (remaining := start_time + seconds - monotonic()) <= 0:
            break
        try:
            cell = loaded.at(point)
            with cell.locate_errors():
                replay_for(cell.build().replay, remaining)
        except (InputError, LoadError) as error:
            where = ", ".join(f"{key} = {value}" for key, value in point.items())
            lines.append(("warning", f"cell {number} of the sweep ({where}) stays empty: {error}"))
    return Lines([*_checks(loaded, lines), *(line for line in lines if line[0] in REPORTED)])


#: Lines of a summary that are results of the check.
REPORTED = {"runs", "sweep", "note", "warning"}
#: Beginnings of notes that not all loads were replayed.
NOT_REPLAYED = ("the loads were checked up to", "no [friction]")


def _checks(scenario: Scenario, lines: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return lines on the keys, files and loads that were checked."""
    files = len(scenario.files) - 1
    events = dict(lines)["events"]
    count, over, duration = events.partition(" over ")
    loads = f"{count} events{over}{duration}"
    notes = [text for label, text in lines if label == "note"]
    if not any(text.startswith(NOT_REPLAYED) for text in notes):
        loads += ", which can be carried out"
    readable = count_text(files, "file", "files") + " readable"
    return [
        ("keys", "known and complete"),
        ("files", readable if files else "none besides the scenario"),
        ("loads", loads),
    ]


def _is_measured(scenario: Scenario) -> bool:
    return getattr(scenario.sections.loading, "kind", "") == "file"


def _summarise_runs(scenario: Scenario, end_time: float) -> list[tuple[str, str]]:
    """Summarise the first run that can be replayed, and state the problems and the remarks of all runs once each."""
    from historysim.scenario.fit import prepare_fit
    from historysim.scenario.runs import each_run

    def find(run: Scenario) -> list[tuple[str, str]]:
        if run.sections.fit is not None:
            prepare_fit(run)
        return _summarise_record(run, max(end_time - monotonic(), 0.0))

    runs = each_run(scenario, find)
    results = [*runs.results.values()]
    lines = [*results[0]]
    lines[1:1] = [("runs", f"{len(runs):,}; below is the first one, and the remarks on all")]
    for result in results[1:]:
        lines += [line for line in result if line[0] in {"note", "warning"} and line not in lines]
    return lines + [
        ("warning", f"run {run.number} cannot be replayed: {run.problem}")
        for run in runs
        if run.problem
    ]


def _summarise_record(scenario: Scenario, seconds: float) -> list[tuple[str, str]]:
    """Check a scenario with a measured record, and state which commands need more."""
    notes = []
    if scenario.sections.friction is None and scenario.surface().friction is None:
        # the record itself needs no coefficient
        with_friction = attrs.evolve(scenario.sections, friction=Coefficients(0.0))
        lines = summary(attrs.evolve(scenario, sections=with_friction))
        notes.append(
            "no [friction]: loops and sliding need none; run, compare and fit need a coefficient"
        )
    else:
        lines = summary(scenario, walk=seconds)
    notes += _record_notes(scenario)
    return [*lines, *(("note", note) for note in notes)]


def _record_notes(run: Scenario) -> list[str]:
    """Return notes on a record in which nothing moves, and on one that ``loops`` refuses."""
    columns, measurement = explicit_fields(run.measured_loading().columns), run.measurement()
    if "tangential_displacement_y" in columns:
        return []
    if "tangential_displacement" in columns:
        try:
            check_moves(
                measurement["tangential_displacement"],
                measurement.dead_band.get("tangential_displacement"),
            )
        except InputError as error:
            return [f"nothing moves: {error}"]
        # imports xarray, which other scenarios do not need
        from historysim.studies.record_search import loops

        try:
            loops(run)
        except InputError as error:
            return [f"historysim loops refuses this record: {error}"]
    elif (channel := columns.get("tangential_load")) is not None and channel.sources:
        load = measurement["tangential_load"]
        if not np.ptp(load):
            held = quantity_text(float(load[0]), "N")
            return [
                f"nothing moves: the tangential load is {held} in all samples; is its column right?"
            ]
    return []
