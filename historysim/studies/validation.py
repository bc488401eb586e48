"""A scenario checked without recording it."""

from collections.abc import Mapping
from pathlib import Path
from time import monotonic
from typing import Any

from historysim.basics.limits import most
from historysim.basics.wording import Lines
from historysim.errors import InputError, LoadError
from historysim.scenario.scenario import Scenario, load, summary


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
    if loaded.sections.fit is not None:
        from historysim.scenario.fit import prepare_fit

        for run in loaded.runs():
            prepare_fit(run)
    lines = summary(loaded, walk=seconds)
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
