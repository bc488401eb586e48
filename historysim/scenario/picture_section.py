"""``[picture]``: the figure of a scenario, and the data of a scenario for each picture."""

from typing import TYPE_CHECKING, Any

from historysim.errors import InputError, field_error
from historysim.recording import surface_group
from historysim.results.plots.pictures import (
    HISTORY,
    PICTURES,
    SCENARIO,
    SWEEP,
    Picture,
    removal_text,
)
from historysim.results.plots.swept import WORDS
from historysim.scenario.schema import kind_from_toml, structure_array, table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import xarray as xr

    from historysim.asperities.adhering import AdheringAsperities
    from historysim.results.plots.first_loading import PressedMap
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits

# modules that read scenarios import this one, so the class itself is not imported here
Scenario = Any
IN_SCENARIOS = {HISTORY, SWEEP, SCENARIO}


def pictures_from_toml(value: object) -> tuple[Picture, ...]:
    """Structure ``[picture]``, or each ``[[picture]]``.

    Raises InputError: an unknown kind, or keys that do not fit it.
    """
    is_array = isinstance(value, list)
    pictures = (
        structure_array(value, _picture_from_toml) if is_array else (_picture_from_toml(value),)
    )
    for index, picture in enumerate(pictures):
        if len(pictures) > 1 and picture.own_figure:
            raise field_error(
                f"{picture.kind!r} fills a whole figure; expected it as the only picture",
                index,
                "kind",
            )
    return pictures


def _picture_from_toml(value: object) -> Picture:
    if "kind" not in table(value):
        names = [name for name, kind in PICTURES.items() if IN_SCENARIOS & {*kind.of}]
        raise field_error(f"missing; expected one of {', '.join(names)}", "kind")
    if removed := removal_text(table(value)["kind"]):
        raise field_error(removed, "kind")
    picture: Picture = kind_from_toml(value, PICTURES)
    if not IN_SCENARIOS & {*picture.of}:
        raise field_error(
            f"{picture.kind!r} is not a picture of a scenario, its result or its sweep", "kind"
        )
    return picture


def picture_data(scenario: Scenario, kind: str) -> object:
    """Return the data of a picture: surface, summits, record or adhering asperities."""
    return DATA[kind](scenario) if kind in DATA else scenario


def _surface(scenario: Scenario) -> "xr.Dataset":
    built = scenario.surface()
    return surface_group.dataset(built.summits, built.surface)


def _heights(scenario: Scenario) -> "Surface":
    surface: Surface | None = scenario.surface().surface
    if surface is None:
        raise InputError(
            f"{scenario.path.name}: picture: the surface is not a height map; expected one"
        )
    return surface


def _pressed_map(scenario: Scenario) -> "PressedMap":
    """Return the height map with loads from 1/100 of the largest normal load up to it."""
    import numpy as np

    from historysim.loads.events import NormalLoad
    from historysim.results.plots.first_loading import PressedMap

    pair = scenario.sections.materials.pair()
    loads = (float(event.value) for event in scenario.events() if isinstance(event, NormalLoad))
    if not (largest := max(loads, default=0.0)) > 0:
        raise InputError(
            f"{scenario.path.name}: picture: no normal load is given; expected one for the kind area-laws"
        )
    hardnesses = [
        material.hardness
        for material in (pair.first, pair.second)
        if material is not None and material.hardness is not None
    ]
    return PressedMap(
        _heights(scenario),
        pair,
        np.geomspace(largest / 100, largest, 13),
        min(hardnesses, default=None),
    )


def _summits(scenario: Scenario) -> "dict[str, Summits]":
    """Return the summits of the surface, or of each surface of the sweep, by label."""
    section = scenario.sections.sweep
    points: list[Mapping[str, Any]] = [{}] if section is None else list(section.grid().points())
    by_name: dict[str, Summits] = {}
    for point in points:
        summits = scenario.at(point).surface().summits
        if summits is None:
            raise InputError(
                f"{scenario.path.name}: picture: the surface has no summits; expected one with summits"
            )
        by_name[", ".join(_label(key, value) for key, value in point.items()) or "summits"] = (
            summits
        )
    return by_name


def _label(key: str, value: object) -> str:
    words, sign = WORDS.get(key.rsplit(".", 1)[-1], (key, ""))
    return f"{sign} = {value}" if sign else f"{words} {value}"


def find_adhering(scenario: Scenario) -> "AdheringAsperities":
    """Return the adhering asperities of a scenario with ``[adhesion]``."""
    contact: AdheringAsperities | None = scenario.adhering(scenario.replay())
    if contact is None:
        raise InputError(
            f"{scenario.path}: has no [adhesion], or no contact; expected both for the adhesion map"
        )
    return contact


# Data of pictures by name; other pictures, such as those of other packages, receive the scenario
# itself.
DATA: "dict[str, Callable[[Scenario], Any]]" = {
    "adhesion-map": find_adhering,
    "area-laws": _pressed_map,
    "map": _heights,
    "record": lambda scenario: scenario.measurement(),
    "summits": _summits,
    "surface": _surface,
}
