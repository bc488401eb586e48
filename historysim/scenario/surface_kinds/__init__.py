"""The kinds of ``[surface]`` in a scenario: the keys of each, and the summits that it gives."""

import attrs
from cattrs import Converter

from historysim.basics.fields import Number
from historysim.basics.places import misfit
from historysim.basics.wording import shown
from historysim.errors import InputError
from historysim.scenario.schema import kind_from_toml, table
from historysim.scenario.surface_kinds.any_surface import ChangedSurface, SurfaceKeys
from historysim.scenario.surface_kinds.map_kinds import HeightMap
from historysim.scenario.surface_kinds.surface_kind import SURFACES, BuiltSurface, SurfaceKind

__all__ = [
    "SURFACES",
    "BuiltSurface",
    "ChangedSurface",
    "HeightMap",
    "SurfaceKind",
    "channel_from_toml",
    "map_from_toml",
    "prune_from_toml",
    "surface_from_toml",
]

DEEPEST = 20
"""Sums within sums that are followed."""


def surface_from_toml(converter: Converter, value: object, _: object) -> SurfaceKind:
    """Return the surface that ``[surface]`` says.

    Raises InputError: an unknown kind, keys that do not fit it, or sums within sums without end.
    """
    level, depth = _parts(value), 0
    while level:
        level, depth = [part for entry in level for part in _parts(entry)], depth + 1
        if depth > DEEPEST:
            raise InputError(f"sums within sums, more than {DEEPEST} deep; expected fewer")
    entry = dict(table(value))
    changes = {key: entry.pop(key) for key in attrs.fields_dict(SurfaceKeys) if key in entry}
    keys = converter.structure(changes, SurfaceKeys)
    surface: SurfaceKind = kind_from_toml(converter, entry, SURFACES)
    return ChangedSurface(of=surface, **attrs.asdict(keys, recurse=False)) if changes else surface


def map_from_toml(converter: Converter, value: object, _: object) -> HeightMap:
    """Return a surface that has to be a height map; errors as for `surface_from_toml`."""
    for key in ("rule", "prune", "ball_radius"):
        if key in table(value):
            raise misfit("belongs to the surface as a whole; expected it beside first and second", key)
    surface: HeightMap = kind_from_toml(converter, value, SURFACES, among=HeightMap)
    return surface


def _parts(entry: object) -> list[object]:
    """Return the two surfaces of what may be a sum."""
    return [entry[key] for key in ("first", "second") if key in entry] if isinstance(entry, dict) else []


def channel_from_toml(converter: Converter, value: object, _: object) -> int | str | None:
    """Return the number or name of a channel; anything else is an InputError."""
    if isinstance(value, bool) or not isinstance(value, int | str | None):
        raise InputError(f"{shown(value)}; expected the number of a channel, from 0, or its name")
    return converter.structure(value, int) if isinstance(value, int) else value


def prune_from_toml(converter: Converter, value: object, _: object) -> bool | float | None:
    """Return whether summits are pruned, or below which share of the height range.

    Raises InputError: anything but true, false, or a share from 0 to 1.
    """
    if value is None or isinstance(value, bool):
        return value
    share: float = converter.structure(value, Number)
    if not 0 <= share < 1:
        raise InputError(f"{share:g}; expected true, or a share of the height range, from 0 to less than 1")
    return share
