"""From a TOML file, with some values replaced, to the sections of a scenario."""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs

from historysim.basics.files import kind_text, path_state
from historysim.basics.limits import at_most, most
from historysim.basics.units import is_unit
from historysim.basics.wording import MOST_QUOTED, printable
from historysim.errors import InputError
from historysim.scenario.schema import from_table, structure
from historysim.scenario.sections import Pictures, PictureSections, Sections
from historysim.tables.readers import list_files


def read_sections(path: Path, values: Mapping[str, Any] | None = None) -> tuple[str, Sections]:
    """Read a file and return its TOML text, with ``values`` replaced, and its sections; errors as for `load`."""
    source = _source(path)
    document = parse_toml(source)
    if not document:
        raise InputError(
            "is empty; expected at least [materials], [surface], [friction] and [loading]"
        )
    if not values:
        return source, from_table(Sections, document)
    from historysim.scenario.grid import text_with_values, with_values

    return text_with_values(source, values), from_table(Sections, with_values(document, values))


def parse_toml(source: str) -> dict[str, Any]:
    """Parse TOML into tables; InputError if it is not TOML or nested too deeply."""
    most_parts = most("KEY_PARTS")
    if match := re.search(rf"(?<!{_PART})(?:{_PART}++\s*+\.\s*+){{{most_parts}}}", source):
        line = source.count("\n", 0, match.start()) + 1
        raise InputError(
            f"line {line}: a key of more than {most_parts} parts; {at_most('KEY_PARTS')}"
        )
    try:
        document = tomllib.loads(source)
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not TOML: {_explain_toml_error(source, str(error))}") from error
    level: list[Any] = [document]
    for _ in range(most_parts):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
    if level:
        raise InputError(
            f"tables or arrays within one another, more than {most_parts} deep; {at_most('KEY_PARTS')}"
        )
    return document


_PART = r"""[^\s.=\[\]{},#]"""  # character of a key, quoted or not
_BARE_VALUE = re.compile(
    r"""(?P<key>[\w.-]+)\s*=\s*
    (?P<number>[+-]?(?:\d+(?:[.,]\d+)?\.?|\.\d+)(?:[eE][+-]?\d+)?)?  \s*(?P<word>[^,}\]\#"'\[{=]*?)
    (?=\s*(?:[,}\]\#]|$))""",
    re.VERBOSE,
)
_CURLY = str.maketrans("“”„«»‘’‚", '"""""\'\'\'')
_LONGEST = 500  # largest number of characters of a line that is searched for mistakes
# Explanations of terse messages of the parser.
_REASONS = {
    "Invalid value": 'not a value of TOML; expected one, as 2.5e-3 or "2.5 mm", and a ] after each array above',
    "Illegal character '\\n'": "the quotation mark is not closed",
    "Unclosed inline table": "expected a comma between keys, and } on the same line",
    "Invalid initial character for a key part": "expected a name, and a table in { } on one line",
    "Cannot overwrite a value": "appears for the second time; expected it once",
}


def _explain_toml_error(source: str, problem: str) -> str:
    """Describe a syntax error, given the ``problem`` of the parser: line, reason, and the fix of a common mistake."""
    reason, _, location = problem.partition(" (at ")
    match = re.match(r"line (\d+), column (\d+)", location)
    lines = source.splitlines() or [""]
    number, column = (int(match[1]), int(match[2]) - 1) if match else (len(lines), 0)
    line = lines[min(number, len(lines)) - 1]
    mend = _fix_for_line(line, column) if len(line) <= _LONGEST else ""
    excerpt = printable(line.strip()[:MOST_QUOTED])
    return (
        f"line {number}: {excerpt}: {mend or _REASONS.get(reason, reason[:1].lower() + reason[1:])}"
    )


def _fix_for_line(line: str, column: int) -> str:
    """Suggest a fix of a common mistake in the line at which the parser stopped; empty if none is found."""
    if (plain := line.translate(_CURLY)) != line:
        return f"curly quotation marks; expected straight ones: {printable(plain.strip()[:MOST_QUOTED])}"
    if "\\" in line and '"' in line:
        return "a backslash in quotes starts an escape sequence; expected / between folders"
    if re.match(r"\s*\[", line) and not re.match(r"\s*\[+[^\[\]\s]+\]+\s*(#|$)", line):
        return "expected the name of a section in brackets, with a point between its parts, as [loading.columns]"
    values = sorted(
        _BARE_VALUE.finditer(line), key=lambda value: not value.start() <= column <= value.end() + 1
    )
    return next((mend for value in values if (mend := _fix_for_value(**value.groupdict()))), "")


def _fix_for_value(key: str, number: str | None, word: str) -> str:
    """Suggest how to write a value without quotes; empty if it is valid TOML."""
    if number is None:
        return _fix_for_word(key, word)
    point = number.replace(",", ".")
    if word == "%":
        return f"a fraction is a plain number; expected {key} = {float(point) / 100:g}"
    if word and word[0].isalpha() and is_unit(word):
        return f'a value with a unit needs quotes; expected {key} = "{point} {word}"'
    if not word and point != number:
        return f"the decimal sign is a point; expected {key} = {point}"
    if not word and (point.lstrip("+-").startswith(".") or point.endswith(".")):
        return f"a decimal point needs digits on both sides; expected {key} = {float(point)!r}"
    return ""


def _fix_for_word(key: str, word: str) -> str:
    if word.lower() in {"none", "null", "nil"}:
        return f"TOML has no {word}; leave the key out"
    if word in {"True", "False", "TRUE", "FALSE"}:
        return f"{word} is not a value of TOML; expected {key} = {word.lower()}"
    toml_words = {"", "inf", "nan", "true", "false"}
    return (
        ""
        if word in toml_words
        else f'a string needs quotes; expected {key[:MOST_QUOTED]} = "{word[:MOST_QUOTED]}"'
    )


def structure_pictures(document: Mapping[str, Any]) -> Pictures:
    """Structure only ``[picture]`` of a scenario; errors as for `structure`."""
    pictures: Pictures = structure(document.get("picture", []), PictureSections)
    return pictures


def _source(path: Path) -> str:
    expected = "expected a scenario file (TOML)"
    kind = path_state(path)
    if kind.startswith("is "):
        raise InputError(f"{kind}; {expected}")
    if not kind and (size := path.stat().st_size) > most("SCENARIO_BYTES"):
        raise InputError(
            f"has {size:,} bytes; {at_most('SCENARIO_BYTES')}; put long tables into a separate file"
        )
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"there is no such file in {path.absolute().parent}; {expected}") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        file_type = "" if path.suffix == ".toml" else kind_text(path)
        problem = file_type or f"is not UTF-8 text ({error.reason} at byte {error.start})"
        raise InputError(f"{problem}; {expected}") from error
    except ValueError as error:
        raise InputError(f"cannot be a path: {error}") from error


def find_named_files(section: Any, folder: Path) -> Iterator[Path]:  # noqa: ANN401 - a section, or a TOML value
    """Yield the files named in a section, or in tables and arrays of TOML; relative to a folder."""
    within: Iterable[tuple[Any, Any]] = ()
    if attrs.has(type(section)):
        within = attrs.asdict(section, recurse=False).items()
    elif isinstance(section, Mapping):
        within = section.items()
    elif isinstance(section, tuple | list):
        within = enumerate(section)
    for key, value in within:
        # keys of a sweep contain dots
        if isinstance(key, str) and key.rpartition(".")[2] == "file" and value is not None:
            for name in _names(value):
                yield from named_paths(folder / name)
        elif not isinstance(value, str | int | float):
            yield from find_named_files(value, folder)


def named_paths(path: Path) -> list[Path]:
    """Return the files of a path, or of a folder or pattern; the path itself if it has none."""
    with suppress(InputError):
        return list_files(path)
    return [path]


def _names(value: object) -> Iterator[str]:
    for name in (
        (value,) if isinstance(value, str) else value if isinstance(value, tuple | list) else ()
    ):
        yield from (name,) if isinstance(name, str) else _names(name)
