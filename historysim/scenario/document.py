"""From a TOML file to the sections of a scenario."""

import re
import tomllib
from collections.abc import Mapping
from functools import cache, partial
from operator import eq
from pathlib import Path
from typing import Any

from cattrs import Converter

from historysim.basics.file_kinds import told_kind
from historysim.basics.files import what_is_there
from historysim.basics.limits import at_most, most
from historysim.basics.wording import shown
from historysim.errors import InputError
from historysim.scenario.column_keys import column_hooks
from historysim.scenario.friction_course_section import AnyCourse, course_from_toml
from historysim.scenario.law_sections import (
    FrictionSection,
    WearSection,
    YieldingSection,
    friction_from_toml,
    wear_from_toml,
    yielding_from_toml,
)
from historysim.scenario.loading_kinds import Loading, channel_hooks, loading_from_toml, waypoint_hooks
from historysim.scenario.overriding import text_with_values, with_values
from historysim.scenario.picture_kinds import Pictures, pictures_from_toml
from historysim.scenario.schema import schema_converter, table, text
from historysim.scenario.sections import RECORDS, MaterialEntry, MaterialTable, Sections
from historysim.scenario.surface_kinds import (
    HeightMap,
    SurfaceKind,
    channel_from_toml,
    map_from_toml,
    prune_from_toml,
    surface_from_toml,
)


def read_sections(path: Path, values: Mapping[str, Any] | None = None) -> tuple[str, Sections]:
    """Return what stands in a file, and what that means.

    Parameters
    ----------
    path : Path
    values : dict, optional
        Values that take the place of those in the file, by key: ``{"friction.coefficient": 0.3}``.

    Raises
    ------
    InputError
        A file that cannot be read or is not TOML, or fields that cannot be used, each with its place.
    """
    source = _source(path)
    document = parsed(source)
    if not document:
        raise InputError("is empty; expected at least [materials], [surface], [friction] and [loading]")
    if not values:
        return source, sections_of(document)
    return text_with_values(source, values), sections_of(with_values(document, values))


def parsed(source: str) -> dict[str, Any]:
    """Return what a text holds.

    Raises InputError: what is not TOML, or nested too deeply.
    """
    parts = most("KEY_PARTS")
    if match := re.search(rf"(?<!{_PART})(?:{_PART}++\s*+\.\s*+){{{parts}}}", source):
        line = source.count("\n", 0, match.start()) + 1
        raise InputError(f"line {line}: a key of more than {parts} parts; {at_most('KEY_PARTS')}")
    try:
        document = tomllib.loads(source)
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not TOML: {error}") from error
    level: list[Any] = [document]
    for _ in range(parts):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
    if level:
        raise InputError(f"tables or arrays within one another, more than {parts} deep; {at_most('KEY_PARTS')}")
    return document


_PART = r"""[^\s.=\[\]{},#]"""
"""A character of a key, quoted or not."""


def pictures_of(document: Mapping[str, Any]) -> Pictures:
    """Return the pictures of a scenario alone, which a result draws; errors as for `sections_of`."""
    return _converter().structure(document.get("picture", []), Pictures)


def sections_of(document: Mapping[str, Any]) -> Sections:
    """Return what the tables of a scenario mean; fields that cannot be used are errors of cattrs, see `reported`."""
    return _converter().structure(document, Sections)


@cache
def _converter() -> Converter:
    converter = schema_converter()
    for kind, hook in (
        (MaterialEntry | None, _material_entry),
        (SurfaceKind, surface_from_toml),
        (HeightMap, map_from_toml),
        (int | str | None, channel_from_toml),
        (bool | float | None, prune_from_toml),
        (FrictionSection, friction_from_toml),
        (WearSection, wear_from_toml),
        (YieldingSection, yielding_from_toml),
        (Loading, loading_from_toml),
        (AnyCourse | None, course_from_toml),
        (str | tuple[int, ...], _record),
        (dict[str, Any], lambda _, value, __: table(value)),
        (Pictures, pictures_from_toml),
    ):
        converter.register_structure_hook_func(partial(eq, kind), partial(hook, converter))
    column_hooks(converter)
    channel_hooks(converter)
    waypoint_hooks(converter)
    return converter


def _material_entry(converter: Converter, value: object, _: object) -> MaterialEntry:
    return converter.structure(value, MaterialTable) if isinstance(value, dict) else text(value)


def _record(converter: Converter, value: object, _: object) -> str | tuple[int, ...]:
    if isinstance(value, list):
        return converter.structure(value, tuple[int, ...])
    if not isinstance(value, str) or value not in RECORDS:
        words = ", ".join(f'"{word}"' for word in RECORDS)
        raise InputError(f"{shown(value)}; expected {words} or an array of indices")
    return value


def _source(path: Path) -> str:
    expected = "expected a scenario file (TOML)"
    came = what_is_there(path)
    if came.startswith("is "):
        raise InputError(f"{came}; {expected}")
    if not came and (size := path.stat().st_size) > most("SCENARIO_BYTES"):
        raise InputError(f"has {size:,} bytes; {at_most('SCENARIO_BYTES')}; put long tables into a file beside it")
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"there is no such file in {path.absolute().parent}; {expected}") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        came = f"is not UTF-8 text ({error.reason} at byte {error.start})"
        if path.suffix != ".toml":
            came = told_kind(path) or came
        raise InputError(f"{came}; {expected}") from error
    except ValueError as error:
        raise InputError(f"cannot be a path: {error}") from error
