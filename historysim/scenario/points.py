"""A scenario at a point of a sweep: with other values of some keys."""

import functools
from collections.abc import Mapping
from typing import Any

from historysim.scenario.document import parsed, sections_of
from historysim.scenario.overriding import with_values
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import reported


def at_point(scenario: Scenario, point: Mapping[str, Any]) -> Scenario:
    """Return a scenario with the values of a point; it keeps the text of the scenario as it was.

    Raises
    ------
    InputError
        Fields that cannot be used, each with its key.
    """
    with reported(scenario.path.name):
        return Scenario(scenario.path, scenario.text, sections_of(with_values(document_of(scenario), point)))


def document_of(scenario: Scenario) -> dict[str, Any]:
    """Return what stands in a scenario, to be read only."""
    return _document(scenario.text)


@functools.lru_cache(maxsize=1)
def _document(text: str) -> dict[str, Any]:
    return parsed(text)
