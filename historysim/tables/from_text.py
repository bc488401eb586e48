"""Texts: one row of values on each line, between commas, semicolons, tabs, bars or white space."""

import csv
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from typing import IO, NoReturn

import numpy as np
import numpy.typing as npt

from historysim.errors import InputError
from historysim.tables.columns import Column, Format, Found, Listing
from historysim.tables.heading import Head, Heading, ragged
from historysim.tables.lines import brief, decimal_hint, is_plain, number, split

Floats = npt.NDArray[np.float64]
Lines = npt.NDArray[np.int64]

# so many rows are held as texts at once, few enough for the cache
AT_ONCE = 2000


def read(
    path: Path, columns: Mapping[str, Column], layout: Format, *, missing: bool, most_rows: int
) -> tuple[dict[str, Found], Lines]:
    """Read columns of a text, and the line that each row stands on. Errors as in `historysim.tables.read_table`."""
    with _opened(path, layout) as stream:
        head = Head.of(stream, layout)
        heading = head.heading(list(columns.values()))
        places = [heading.place(column) for column in columns.values()]
        rows = _rows(chain(head.physical[heading.above :], stream), heading, layout)
        values, lines = _values(rows, heading, places, layout.decimal, missing=missing, most_rows=most_rows)
    found = {
        key: Found(heading.label(place), column, heading.units(place))
        for key, place, column in zip(columns, places, values, strict=True)
    }
    return found, lines


def describe(path: Path, layout: Format) -> list[Listing]:
    """Return what columns a text has. Errors as in `historysim.tables.describe`."""
    with _opened(path, layout) as stream:
        head = Head.of(stream, layout)
        heading = head.heading([])
        first: Sequence[str] = ()
        count = 0
        for _, rows in _rows(chain(head.physical[heading.above :], stream), heading, layout):
            first = first or rows[0]
            count += len(rows)
    return [
        Listing(heading.reference(place), ", ".join(heading.units(place)), str(count), first[place].strip())
        for place in range(heading.width if first else 0)
    ]


@contextmanager
def opened_rows(
    path: Path, known: Collection[str], layout: Format
) -> Iterator[tuple[Heading, Iterator[tuple[int, list[str]]]]]:
    """Yield the heading of a text, and its rows. Errors as in `historysim.tables.opened_rows`."""
    with _opened(path, layout) as stream:
        head = Head.of(stream, layout)
        heading = head.heading_of(known)
        chunks = _rows(chain(head.physical[heading.above :], stream), heading, layout)
        yield heading, (row for numbers, rows in chunks for row in zip(numbers, rows, strict=True))


def decoded(path: Path, encoding: str) -> str:
    """Return a whole text, without the mark at its beginning.

    Raises
    ------
    InputError
        Another encoding, with the byte that does not fit.
    """
    content = path.read_bytes()
    try:
        return content.decode(encoding).removeprefix("\ufeff")
    except UnicodeError as error:
        raise InputError(_undecodable(content, encoding)) from error


def plain_numbers(texts: list[str], decimal: str) -> Floats | None:
    """Return finite numbers as an array; None where anything else stands among them."""
    whole = "\n".join(texts)
    if not is_plain(whole, decimal):
        return None
    if decimal != ".":
        texts = whole.replace(decimal, ".").split("\n")
    try:
        values = np.fromiter(map(float, texts), dtype=np.float64, count=len(texts))
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


@contextmanager
def _opened(path: Path, layout: Format) -> Iterator[IO[str]]:
    try:
        with path.open(encoding=layout.encoding) as stream:
            yield stream
    except UnicodeError as error:
        raise InputError(_undecodable(path.read_bytes(), layout.encoding)) from error


def _undecodable(content: bytes, encoding: str) -> str:
    where = ""
    try:
        content.decode(encoding)
    except UnicodeDecodeError as error:
        byte = f"0x{content[error.start]:02x}, " if error.start < len(content) else ""
        line = content.count(b"\n", 0, error.start) + 1
        where = f" ({byte}byte {error.start + 1} of the file, line {line}: {error.reason})"
    except UnicodeError as error:
        where = f" ({error})"
    likely = "utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "latin-1"
    name = "UTF-8" if encoding.lower() in {"utf-8", "utf8"} else encoding
    return f'is not {name} text{where}; save it as UTF-8, or say which encoding it has, such as encoding = "{likely}"'


def _rows(lines: Iterator[str], heading: Heading, layout: Format) -> Iterator[tuple[list[int], list[list[str]]]]:
    """Yield the rows, many at once, and the numbers of their lines."""
    # a line of nothing but tabs is a row, if they are the delimiters
    blank = None if heading.delimiter == " " else " \t\n".replace(heading.delimiter, "")
    above = heading.above
    while physical := list(islice(lines, AT_ONCE)):
        numbers = [
            line_number
            for line_number, line in enumerate(physical, above + 1)
            if line.strip(blank) and not (layout.comment and line.lstrip().startswith(layout.comment))
        ]
        kept = physical if len(numbers) == len(physical) else [physical[each - above - 1] for each in numbers]
        above += len(physical)
        if not kept:
            continue
        try:
            rows = split(kept, heading.delimiter)
        except csv.Error:
            rows = []
        if len(rows) < len(kept):
            _refuse_a_line(numbers, kept, heading.delimiter)
        if set(map(len, rows)) != {heading.width}:
            _check_widths(numbers, rows, heading)
        yield numbers, rows


def _refuse_a_line(numbers: Sequence[int], lines: Sequence[str], delimiter: str) -> NoReturn:
    for line_number, line in zip(numbers, lines, strict=True):
        try:
            split([line], delimiter)
        except csv.Error as error:
            reason = "a value in quotes does not end on it" if "end of data" in str(error) else error
            raise InputError(f"line {line_number} is not a CSV table: {reason}") from error
    raise InputError("is not a CSV table: a value in quotes runs over several lines")


def _check_widths(numbers: Sequence[int], rows: Sequence[Sequence[str]], heading: Heading) -> None:
    width = heading.width
    for line_number, row in zip(numbers, rows, strict=True):
        if len(row) < width or any(field.strip() for field in row[width:]):
            named = heading.names and not heading.misfit
            expected = f"the header names {width} columns" if named else f"other lines have {width}"
            raise InputError(ragged(line_number, len(row), expected))


def _values(
    chunks: Iterator[tuple[list[int], list[list[str]]]],
    heading: Heading,
    places: Sequence[int],
    decimal: str,
    *,
    missing: bool,
    most_rows: int,
) -> tuple[list[Floats], Lines]:
    """Read rows into arrays, one for each place, and one of the numbers of their lines."""
    parts: list[list[Floats]] = [[] for _ in places]
    lines: list[Lines] = []
    count = 0
    for numbers, rows in chunks:
        count += len(rows)
        if count > most_rows:
            raise InputError(f"has more than {most_rows:,} rows; thin or split it")
        for place, part in zip(places, parts, strict=True):
            texts = [row[place] for row in rows]
            values = plain_numbers(texts, decimal)
            if values is None:
                values = _careful(texts, decimal, missing=missing)
            if values is None:
                _refuse(numbers, rows, places, heading, decimal, missing=missing)
            part.append(values)
        lines.append(np.array(numbers, dtype=np.int64))
    if not count:
        raise InputError("has a header but no rows; expected one line for each sample")
    return [np.concatenate(part) for part in parts], np.concatenate(lines)


def _careful(texts: list[str], decimal: str, *, missing: bool) -> Floats | None:
    """Return numbers and missing values as an array; None where anything else stands among them."""
    numbers = [number(text, decimal) for text in texts]
    if None in numbers:
        return None
    values = np.array(numbers, dtype=np.float64)
    return values if missing or np.isfinite(values).all() else None


def _refuse(
    numbers: Sequence[int],
    rows: Sequence[Sequence[str]],
    places: Sequence[int],
    heading: Heading,
    decimal: str,
    *,
    missing: bool,
) -> NoReturn:
    """Raise an error that names the first value that is none."""
    line_number, place, text = next(
        (line_number, place, row[place])
        for line_number, row in zip(numbers, rows, strict=True)
        for place in places
        if (value := number(row[place], decimal)) is None or (math.isnan(value) and not missing)
    )
    problem = f"{brief(text)}; expected a finite number{decimal_hint(text, decimal)}"
    raise InputError(f"line {line_number}, column {heading.label(place)}: {problem}")
