"""A scenario checked without running it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from historysim.basics.display import Lines
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.scenario_summary import summary


def validate(scenario: str | Path | Scenario, values: Mapping[str, Any] | None = None) -> Lines:
    """Check a scenario and the files that it names, without running it.

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
    if loaded.sections.sweep is not None:
        from historysim.studies.sweep import sweep_of

        sweep_of(loaded)
    if loaded.sections.design is not None:
        from historysim.studies.design import problem_of

        problem_of(loaded)
    return Lines(summary(loaded))
