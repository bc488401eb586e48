"""From a TOML file, with values in place of some of its own, to the sections of a scenario."""

import inspect
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

import attrs
from cattrs import Converter

from historysim.basics.files import kind_text, path_state
from historysim.basics.limits import at_most, most
from historysim.basics.units import is_unit
from historysim.errors import InputError, field_error
from historysim.loads.friction_course import FrictionCourse
from historysim.scenario.grid import text_with_values, with_values
from historysim.scenario.loading_kinds import Loading, loading_from_toml
from historysim.scenario.schema import column_hooks, from_table, kind_from_toml, schema_converter, table
from historysim.scenario.sections import MaterialEntry, Pictures, Sections, course_from_toml, material_from_toml
from historysim.scenario.surface_kinds import SURFACES, ChangedSurface, SurfaceKind

DEEPEST = 20  # sums within sums that are followed


def read_sections(path: Path, values: Mapping[str, Any] | None = None) -> tuple[str, Sections]:
    """Return the TOML of a file, with ``values`` in place of its own, and its sections; errors as for `load`."""
    source = _source(path)
    document = parsed(source)
    if not document:
        raise InputError("is empty; expected at least [materials], [surface], [friction] and [loading]")
    if not values:
        return source, sections_of(document)
    return text_with_values(source, values), sections_of(with_values(document, values))


def parsed(source: str) -> dict[str, Any]:
    """Return the tables of TOML; what is none, or nested too deeply, is an InputError."""
    parts = most("KEY_PARTS")
    if match := re.search(rf"(?<!{_PART})(?:{_PART}++\s*+\.\s*+){{{parts}}}", source):
        line = source.count("\n", 0, match.start()) + 1
        raise InputError(f"line {line}: a key of more than {parts} parts; {at_most('KEY_PARTS')}")
    try:
        document = tomllib.loads(source)
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not TOML: {_explained(source, str(error))}") from error
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


_PART = r"""[^\s.=\[\]{},#]"""  # A character of a key, quoted or not
_BARE_VALUE = re.compile(
    r"""(?P<key>[\w.-]+)\s*=\s*
    (?P<number>[+-]?(?:\d+(?:[.,]\d+)?\.?|\.\d+)(?:[eE][+-]?\d+)?)?  \s*(?P<word>[^,}\]\#"'\[{=]*?)
    (?=\s*(?:[,}\]\#]|$))""",
    re.VERBOSE,
)
_CURLY = str.maketrans("“”„«»‘’‚", '"""""\'\'\'')
_LONGEST = 500  # characters of a line that is searched for slips
# What the parser says too briefly, and what it means.
_REASONS = {
    "Invalid value": 'no value of TOML; expected one, as 2.5e-3 or "2.5 mm", and a ] behind each array above',
    "Illegal character '\\n'": "the quotation mark is not closed",
    "Unclosed inline table": "expected a comma between keys, and } on the same line",
    "Invalid initial character for a key part": "expected a name, and a table in { } on one line",
    "Cannot overwrite a value": "stands here for the second time; expected it once",
}


def _explained(source: str, problem: str) -> str:
    """Return where and why a text is no TOML, which the parser says as ``problem``, with the mend of a usual slip."""
    reason, _, place = problem.partition(" (at ")
    found = re.match(r"line (\d+), column (\d+)", place)
    lines = source.splitlines() or [""]
    number, column = (int(found[1]), int(found[2]) - 1) if found else (len(lines), 0)
    line = lines[min(number, len(lines)) - 1]
    mend = _mend(line, column) if len(line) <= _LONGEST else ""
    return f"line {number}: {line.strip()[:70]}: {mend or _REASONS.get(reason, reason[:1].lower() + reason[1:])}"


def _mend(line: str, column: int) -> str:
    """Return how to mend a usual slip in a line, at which the parser has stopped; empty where there is none."""
    if (plain := line.translate(_CURLY)) != line:
        return f"curly quotation marks; expected straight ones: {plain.strip()}"
    if "\\" in line and '"' in line:
        return "a backslash in quotes begins an escape; expected / between folders"
    if re.match(r"\s*\[", line) and not re.match(r"\s*\[+[^\[\]\s]+\]+\s*(#|$)", line):
        return "the name of a section stands in brackets, with a point between its parts, as [loading.columns]"
    values = sorted(_BARE_VALUE.finditer(line), key=lambda each: not each.start() <= column <= each.end() + 1)
    return next((mend for each in values if (mend := _mended_value(**each.groupdict()))), "")


def _mended_value(key: str, number: str | None, word: str) -> str:
    """Return how to write a value that stands without quotes; empty where it is one of TOML."""
    if number is None:
        return _mended_word(key, word)
    point = number.replace(",", ".")
    if word == "%":
        return f"a share is a plain number; expected {key} = {float(point) / 100:g}"
    if word and word[0].isalpha() and is_unit(word):
        return f'a value with a unit stands in quotes; expected {key} = "{point} {word}"'
    if not word and point != number:
        return f"the decimal sign is a point; expected {key} = {point}"
    if not word and (point.lstrip("+-").startswith(".") or point.endswith(".")):
        return f"digits stand on both sides of a decimal point; expected {key} = {float(point)!r}"
    return ""


def _mended_word(key: str, word: str) -> str:
    if word.lower() in {"none", "null", "nil"}:
        return f"TOML has no {word}; leave the key out"
    if word in {"True", "False", "TRUE", "FALSE"}:
        return f"{word} is no value of TOML; expected {key} = {word.lower()}"
    known = {"", "inf", "nan", "true", "false"}
    return "" if word in known else f'a string stands in quotes; expected {key} = "{word}"'


def pictures_of(document: Mapping[str, Any]) -> Pictures:
    """Return the pictures alone of the tables of a scenario, which a result draws; errors as for `sections_of`."""
    return _converter().structure(document.get("picture", []), Pictures)


def sections_of(document: Mapping[str, Any]) -> Sections:
    """Return the sections of the tables of a scenario; fields that cannot be used are errors of cattrs."""
    return _converter().structure(document, Sections)


@cache
def _converter() -> Converter:
    converter = schema_converter()
    for fits, hook in (
        (_is_base, _surface_from_toml),
        (lambda kind: kind == MaterialEntry, material_from_toml),
        (lambda kind: kind is FrictionCourse, course_from_toml),
        (lambda kind: kind is Loading, loading_from_toml),
        (lambda kind: kind == Pictures, _pictures_from_toml),
    ):
        converter.register_structure_hook_func(fits, partial(hook, converter))
    column_hooks(converter)
    return converter


def _is_base(kind: object) -> bool:
    """Return whether a type stands for several kinds of surface, one of which a table names."""
    return isinstance(kind, type) and issubclass(kind, SurfaceKind) and inspect.isabstract(kind)


def _surface_from_toml(converter: Converter, value: object, base: Any) -> SurfaceKind:  # noqa: ANN401 - a class
    """Return the surface of a table; a part of a sum is one of the subclasses of ``base``."""
    entry = dict(table(value))
    if base is not SurfaceKind:
        for key in {"rule", "prune", "ball_radius"} & entry.keys():
            raise field_error("belongs to the surface as a whole; expected it beside first and second", key)
        return kind_from_toml(converter, entry, SURFACES, among=base)
    level, depth = _parts(value), 0
    while level:
        level, depth = [part for each in level for part in _parts(each)], depth + 1
        if depth > DEEPEST:
            raise InputError(f"sums within sums, more than {DEEPEST} deep; expected fewer")
    own = attrs.fields_dict(ChangedSurface).keys() - {"of"}
    keys = {key: entry.pop(key) for key in sorted(own & entry.keys())}
    surface = kind_from_toml(converter, entry, SURFACES)
    return from_table(ChangedSurface, {"of": surface, **keys}, converter, "of") if keys else surface


def _parts(entry: object) -> list[object]:
    """Return the two surfaces of what may be a sum."""
    return [entry[key] for key in ("first", "second") if key in entry] if isinstance(entry, dict) else []


def _pictures_from_toml(converter: Converter, value: object, kind: object) -> Pictures:
    # what draws them is not imported where none is asked for
    from historysim.scenario.picture_section import pictures_from_toml

    return pictures_from_toml(converter, value, kind)


def _source(path: Path) -> str:
    expected = "expected a scenario file (TOML)"
    kind = path_state(path)
    if kind.startswith("is "):
        raise InputError(f"{kind}; {expected}")
    if not kind and (size := path.stat().st_size) > most("SCENARIO_BYTES"):
        raise InputError(f"has {size:,} bytes; {at_most('SCENARIO_BYTES')}; put long tables into a file beside it")
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"there is no such file in {path.absolute().parent}; {expected}") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        known = "" if path.suffix == ".toml" else kind_text(path)
        problem = known or f"is not UTF-8 text ({error.reason} at byte {error.start})"
        raise InputError(f"{problem}; {expected}") from error
    except ValueError as error:
        raise InputError(f"cannot be a path: {error}") from error


def files_of(section: Any, folder: Path) -> Iterator[Path]:  # noqa: ANN401 - a section, or what TOML holds
    """Yield the files that a section of a scenario names, or tables and arrays of TOML; relative to a folder."""
    within: Iterable[tuple[Any, Any]] = ()
    if attrs.has(type(section)):
        within = attrs.asdict(section, recurse=False).items()
    elif isinstance(section, Mapping):
        within = section.items()
    elif isinstance(section, tuple | list):
        within = enumerate(section)
    for key, value in within:
        # a sweep names keys with dots
        if isinstance(key, str) and key.rpartition(".")[2] == "file" and value is not None:
            yield from (folder / name for name in _names(value))
        elif not isinstance(value, str | int | float):
            yield from files_of(value, folder)


def _names(value: object) -> Iterator[str]:
    for each in (value,) if isinstance(value, str) else value if isinstance(value, tuple | list) else ():
        yield from (each,) if isinstance(each, str) else _names(each)
