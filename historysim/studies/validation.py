"""A scenario checked without recording it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import Any

import attrs
import numpy as np

from historysim.basics.limits import most
from historysim.basics.units import quantity_text
from historysim.basics.wording import Lines
from historysim.errors import InputError, LoadError
from historysim.measured.reduction import check_moves
from historysim.scenario.record_search import loops
from historysim.scenario.scenario import Scenario, load, summary
from historysim.scenario.schema import explicit_fields
from historysim.scenario.sections import Coefficients


def validate(scenario: str | Path | Scenario, values: Mapping[str, Any] | None = None) -> Lines:
    """Check a scenario, the files that it names, and whether the contact can carry its loads, without recording them.

    Loads are replayed for a few seconds; where that is not enough a line says how far. Of a sweep the first and the
    last cell are replayed, too; a line of ``warning`` says why one of them would stay empty.

    Parameters
    ----------
    scenario : path or Scenario
    values : mapping, optional
        Values to take in place of the scenario's, as for `load`; not for a `Scenario`.

    Returns
    -------
    Lines
        The scenario in a few lines.

    Raises
    ------
    InputError
        What is wrong, where, and how to mend it.
    LoadError
        Loads that the contact cannot carry; the message names the waypoint, or the line of the file.

    Examples
    --------
    >>> print(hs.validate("scenarios/04_normal_up_tangential_up.toml"))
    title                Silicon ball on glass: both loads rise
    asperities           1
    events               242 over 12 s
    substeps             1
    recorded asperities  touching
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
    runs = loaded.runs() if loaded.run is not None else [loaded]
    if loaded.sections.fit is not None:
        from historysim.scenario.fit import prepare_fit

        for run in runs:
            prepare_fit(run)
    lines = _summary_of_record(runs, seconds) if _is_measured(loaded) else summary(loaded, walk=seconds)
    for number, point in ends.items():
        # a cell that takes long is left to the sweep
        if (remaining := start_time + seconds - monotonic()) <= 0:
            break
        try:
            cell = loaded.at(point)
            with cell.locate_errors():
                cell.build().walk(remaining)
        except (InputError, LoadError) as error:
            where = ", ".join(f"{key} = {value}" for key, value in point.items())
            lines.append(("warning", f"cell {number} of the sweep ({where}) stays empty: {error}"))
    return Lines(lines)


def _is_measured(scenario: Scenario) -> bool:
    return getattr(scenario.sections.loading, "kind", "") == "file"


def _summary_of_record(runs: Sequence[Scenario], seconds: float) -> list[tuple[str, str]]:
    """Check a scenario with a measured record, of several runs the first, and state which commands need more."""
    lines, notes = [], []
    run = runs[0]
    if len(runs) > 1:
        lines.append(("runs", f"{len(runs):,}, of which run {run.run} is checked below"))
    if run.sections.friction is None and run.surface().friction is None:
        # the record itself needs no coefficient
        with_friction = attrs.evolve(run.sections, friction=Coefficients(0.0))
        lines += summary(attrs.evolve(run, sections=with_friction))
        notes.append("no [friction]: loops and sliding need none; run, compare and fit need a coefficient")
    else:
        lines += summary(run, walk=seconds)
    notes += _record_notes(run)
    return [*lines, *(("note", note) for note in notes)]


def _record_notes(run: Scenario) -> list[str]:
    """Return notes on a record in which nothing moves, and on one that ``loops`` refuses."""
    columns, measurement = explicit_fields(run.measured_loading().columns), run.measurement()
    if "tangential_displacement_y" in columns:
        return []
    if "tangential_displacement" in columns:
        try:
            check_moves(measurement["tangential_displacement"], measurement.dead_band.get("tangential_displacement"))
        except InputError as error:
            return [f"nothing moves: {error}"]
        try:
            loops(run)
        except InputError as error:
            return [f"historysim loops refuses this record: {error}"]
    elif (channel := columns.get("tangential_load")) is not None and channel.sources:
        load = measurement["tangential_load"]
        if not np.ptp(load):
            held = quantity_text(float(load[0]), "N")
            return [f"nothing moves: the tangential load is {held} in all samples; is its column right?"]
    return []
