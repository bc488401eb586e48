"""Texts: one row of values on each line, between commas, semicolons, tabs, bars or white space."""

import codecs
import csv
import math
import re
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from itertools import chain, islice, repeat
from pathlib import Path
from typing import IO, Self

import numpy as np
from attrs import Factory, define, evolve, frozen

from historysim.basics.arguments import Floats, Integers
from historysim.basics.limits import at_most, most
from historysim.basics.units import is_unit
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.tables.blocks import Block, Survey, clock, from_the_first, survey
from historysim.tables.columns import Column, FileColumn, Format, Listing, MissingValueError, Part, Piece
from historysim.tables.head import Head, Heading, ragged
from historysim.tables.lines import AT_ONCE, brief, decimal_hint, fields, is_plain, number, split

Lines = Integers

Opened = Callable[[], AbstractContextManager[Iterator[str]]]

# where the rows begin with numbers, no row begins with a word
_STATED = re.compile(
    r"\W*(?P<of>[^:=\t,;]*?)\s*\b(units?|einheit(en)?)\b[^:=\t,;]*[:=\t,;]+(?P<units>.+)", re.IGNORECASE
)
_WORD = re.compile(r"\s*(?!nan\b|null\b)[^\W\d_]{3}", re.IGNORECASE)
_LIKE_A_CLOCK = re.compile(r"\d+(?=.*[/:])[\d/:. -]+\s*(?:[AaPp][Mm])?")
MOST_TOLD = 5
MOST_LINES = 1 << 62  # more lines than any text has

WINDOWS = "cp1252"  # the encoding of most texts that are not UTF-8


def read(
    lines_of: Opened, columns: Mapping[str, Column], layout: Format, *, missing: bool, most_rows: int
) -> tuple[list[Piece], list[str]]:
    """Return columns of the tables in lines that can be opened again, and notices.

    Errors as in `historysim.tables.read_table`.
    """
    reading = _Reading(columns, layout, missing, most_rows)
    if layout.block is None and layout.broken == "refuse":
        try:
            with lines_of() as stream:
                return [reading.piece(stream, Head.of(stream, layout), "the table")], []
        except _BadRowError as error:
            # either there is more than one table, or the row is broken
            bad = error
    else:
        bad = None
    with lines_of() as stream:
        try:
            tables = survey(stream, layout)
        except InputError as error:
            raise bad or error from None
    chosen = _chosen_blocks(tables, reading, bad)
    pieces = []
    # the text is passed once, as long as blocks are asked for in their order
    with ExitStack() as opened_text:
        passed = MOST_LINES
        for index, heading in chosen:
            block = tables.blocks[index]
            if block.begin <= passed:
                opened_text.close()
                stream, passed = opened_text.enter_context(lines_of()), 0
            above = passed + sum(1 for _ in islice(stream, block.begin - 1 - passed))
            lines = islice(stream, block.last - above)
            head = Head.of(lines, layout if heading is None else evolve(layout, header=heading), above)
            pieces.append(reading.piece(lines, head, f"block {index + 1}", block.start))
            deque(lines, maxlen=0)
            passed = block.last
    return pieces, [*_left_out(tables, chosen), *reading.notices]


def _chosen_blocks(tables: Survey, reading: "_Reading", bad: "_BadRowError | None") -> list[tuple[int, int | None]]:
    """Return which blocks are read, and the line of the header of each where it is given.

    An InputError where it is not clear which, or there is no such block.
    """
    layout, count = reading.layout, len(tables.blocks)
    if layout.header and (layout.block is None or count == 1):
        # whoever gives the header has chosen the table below it
        below = [index for index, block in enumerate(tables.blocks) if block.first > layout.header]
        return [(below[0], layout.header)] if below else [(count - 1, layout.header)]
    none = 0 if layout.header == 0 else None
    if layout.block == "all":
        return [(index, none) for index in range(count)]
    if layout.block is not None:
        numbers = layout.block if isinstance(layout.block, tuple) else (layout.block,)
        for number in numbers:
            if not isinstance(number, int) or number > count:
                raise InputError(f"there is no block {number}; {seen(tables)}")
        return [(int(number) - 1, none) for number in numbers]
    fitting = [index for index, block in enumerate(tables.blocks) if reading.fits(block)]
    if count > 1 and len(fitting) != 1:
        raise InputError(
            f'has {count} blocks; say which, as in block = 2, block = [1, 2], or block = "all" to join them; '
            f"{seen(tables)}"
        ) from bad
    return [((fitting or [0])[0], none)]


def _left_out(tables: Survey, chosen: Sequence[tuple[int, int | None]]) -> list[str]:
    """Return what is not read of a text, for people."""
    notices = []
    left = [index for index in range(len(tables.blocks)) if index not in {each for each, _ in chosen}]
    if left:
        which = counted(len(left), "block", "blocks")
        rows = sum(tables.blocks[index].rows for index in left)
        notices.append(
            f"{which} of {len(tables.blocks)} left out: {', '.join(str(index + 1) for index in left)}, of "
            f'{counted(rows, "row", "rows")}; block chooses, and block = "all" joins them'
        )
    if tables.footer:
        notices.append(f"what stands below the table is no row, and left out: {brief(tables.footer[0])}")
    return notices


def seen(tables: Survey) -> str:
    """Return what stands in a text: its blocks, with names, units and first rows."""
    blocks = []
    for position, block in enumerate(tables.blocks[:MOST_TOLD], 1):
        names = ", ".join(block.heading.title(place) for place in range(block.heading.width))
        row = ", ".join(brief(field)[1:-1] for field in block.row)
        blocks.append(f"block {position} in lines {block.first} to {block.last}: {names} (first row: {row})")
    more = [f"and {len(tables.blocks) - MOST_TOLD} more"] if len(tables.blocks) > MOST_TOLD else []
    return "seen: " + "; ".join([*blocks, *more])


def picture(lines_of: Opened, layout: Format) -> tuple[list[str], int]:
    """Return lines on what stands in a text, and its number of tables. Errors as in `historysim.tables.describe`."""
    with lines_of() as stream:
        tables = survey(stream, layout)
    lines = []
    for position, block in enumerate(tables.blocks, 1):
        above = "; ".join(brief(line)[1:-1] for line in block.preamble[:3])
        start = "" if block.start is None else f", started at {block.start:g} s"
        rows = counted(block.rows, "row", "rows")
        lines.append(
            f"block {position}: {rows} in lines {block.first} to {block.last}{start}"
            + (f", below {above}" if above else "")
        )
        if position == 1 or block.heading.names != tables.blocks[position - 2].heading.names:
            lines.append("  names and units: " + ", ".join(map(block.heading.title, range(block.heading.width))))
        lines.append("  first row: " + ", ".join(brief(field)[1:-1] for field in block.row))
    if tables.footer:
        lines.append(f"below: {'; '.join(brief(line)[1:-1] for line in tables.footer[:3])}")
    return lines, len(tables.blocks)


def describe(lines_of: Opened, layout: Format) -> list[Listing]:
    """Return what columns there are in lines that can be opened again. Errors as in `historysim.tables.describe`."""
    with lines_of() as stream:
        tables = survey(stream, layout)
    block = tables.blocks[min(layout.block, len(tables.blocks)) - 1 if isinstance(layout.block, int) else 0]
    heading = block.heading
    rows, stated = str(block.rows), tuple(_stated_units(block.preamble))
    return [
        Listing(
            heading.reference(place), _unit(heading, place, block.row[place]), rows, block.row[place].strip(), stated
        )
        for place in range(heading.width)
    ]


def _stated_units(lines: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield what lines such as ``Displacement units: in`` say: of what, and the unit."""
    for match in filter(None, map(_STATED.match, lines)):
        units = (unit.strip(" \"'[]()") for unit in re.split(r"[,;\t]", match["units"]))
        yield from ((match["of"].lower(), unit) for unit in units if unit and is_unit(unit))


def _unit(heading: Heading, place: int, first: str) -> str:
    return "s" if clock(first) is not None else ", ".join(heading.units(place))


@contextmanager
def opened_rows(
    path: Path, known: Collection[str], layout: Format
) -> Iterator[tuple[Heading, Iterator[tuple[int, list[str]]]]]:
    """Yield the heading of a text, and its rows. Errors as in `historysim.tables.opened_rows`."""
    with opened(path, layout) as stream:
        head = Head.of(stream, layout)
        heading = head.heading_of(known)
        yield heading, _rows(chain(head.physical[heading.above :], stream), heading, layout)


def encoding_of(path: Path) -> str:
    """Return the encoding of a text: what a mark at its beginning says, else UTF-8, else that of Windows."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    with path.open("rb") as stream:
        first = stream.peek(64)[:64]
        if first[:2] in {codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE}:
            return "utf-16"
        # no text holds zeros but one of two bytes a letter, without its mark
        for encoding, zeros in (("utf-16-le", first[1::2]), ("utf-16-be", first[::2])):
            if 2 * zeros.count(0) > len(zeros) and zeros.count(0) == first.count(0):
                return encoding
        try:
            while piece := stream.read(1 << 20):
                decoder.decode(piece)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return WINDOWS
    return "utf-8"


def decoded(path: Path, encoding: str) -> str:
    """Return a whole text, without the mark at its beginning; another encoding is an InputError with the byte."""
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
def opened(path: Path, layout: Format) -> Iterator[IO[str]]:
    """Yield the lines of a text; another encoding than is given, or than any, is an error that names the byte."""
    encoding = layout.encoding or encoding_of(path)
    _check_lines(path)
    try:
        with path.open(encoding=encoding) as stream:
            yield stream
    except UnicodeError as error:
        raise InputError(_undecodable(path.read_bytes(), layout.encoding or "utf-8")) from error


def _check_lines(path: Path) -> None:
    """Check that a text has lines, before one of them fills the memory."""
    longest, line, length = most("LINE_BYTES"), 1, 0
    if path.stat().st_size <= longest:
        return
    with path.open("rb") as stream:
        while piece := stream.read(1 << 20):
            ends = piece.count(b"\n") or piece.count(b"\r")
            line, length = line + ends, 0 if ends else length + len(piece)
            if length > longest:
                raise InputError(f"line {line} has {length:,} bytes or more; {at_most('LINE_BYTES')}")


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


def _lines_of_rows(lines: Iterator[str], heading: Heading, layout: Format) -> Iterator[tuple[list[int], list[str]]]:
    """Yield the lines of rows, many at once, and their numbers."""
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
        if kept:
            yield numbers, kept


def _rows(lines: Iterator[str], heading: Heading, layout: Format) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows with the numbers of their lines; a line that is none is an error."""
    for numbers, texts in _lines_of_rows(lines, heading, layout):
        rows = _all_rows(texts, heading)
        yield from zip(numbers, map(_row, numbers, texts, repeat(heading)) if rows is None else rows, strict=True)


def _all_rows(lines: Sequence[str], heading: Heading) -> list[list[str]] | None:
    """Return the values of lines that all are rows; else None."""
    try:
        rows = split(lines, heading.delimiter)
    except csv.Error:
        return None
    is_even = set(map(len, rows)) == {heading.width}
    return rows if len(rows) == len(lines) and (is_even or all(_fits(row, heading) for row in rows)) else None


def _row(line_number: int, text: str, heading: Heading) -> list[str]:
    """Return the values of a line."""
    try:
        row = split([text], heading.delimiter)[0]
    except csv.Error as error:
        reason = "a value in quotes does not end on it" if "end of data" in str(error) else error
        raise _BadRowError(f"line {line_number} is not a CSV table: {reason}") from error
    if not _fits(row, heading):
        named = heading.names and not heading.mismatch
        wide = f"the header names {heading.width} columns" if named else f"other lines have {heading.width}"
        raise _BadRowError(ragged(line_number, len(row), wide))
    return row


def _fits(row: Sequence[str], heading: Heading) -> bool:
    """Return whether a row has as many values as it shall, but for blank ones at its end."""
    return len(row) >= heading.width and not any(field.strip() for field in row[heading.width :])


class _BadRowError(InputError):
    """A line that is no row."""


class _MissingError(_BadRowError, MissingValueError):
    """A row that misses a value."""


@frozen
class _Wanted:
    """The values that are wanted of the rows of a table."""

    heading: Heading
    places: list[int]  #: where they stand
    decimal: str
    missing: bool
    #: The place of the first number in the first row: where a word stands there, is no row. -1 where it is wanted, or
    #: there is none.
    guard: int
    clocks: set[int]  #: places of clocks

    @classmethod
    def of(cls, first: Sequence[str], heading: Heading, places: list[int], decimal: str, *, missing: bool) -> Self:
        """Return what is wanted of rows that begin with this one."""
        values = [number(field, decimal) for field in first]
        guard = next((place for place, value in enumerate(values) if value is not None and math.isfinite(value)), -1)
        clocks = {place for place in places if place < len(first) and clock(first[place]) is not None}
        return cls(heading, places, decimal, missing, -1 if guard in places else guard, clocks)

    def of_plain(self, lines: Sequence[str]) -> list[Floats] | None:
        """Return the values of lines that are rows of finite numbers and times; None where anything else is there."""
        rows = _all_rows(lines, self.heading)
        if rows is None:
            return None
        values = []
        for place in self.places:
            texts = [row[place] for row in rows]
            column = _clock_times(texts) if place in self.clocks else plain_numbers(texts, self.decimal)
            if column is None:
                return None
            values.append(column)
        return None if self.guard >= 0 and any(_WORD.match(row[self.guard]) for row in rows) else values

    def of_line(self, line_number: int, text: str) -> list[float]:
        """Return the values of a line."""
        row = _row(line_number, text, self.heading)
        values = []
        for place in self.places:
            value = number(row[place], self.decimal)
            expected = "a finite number"
            if place in self.clocks and not (value is not None and math.isnan(value)):
                value, expected = clock(row[place]), "a time as in the rows above"
            if value is None and _LIKE_A_CLOCK.fullmatch(row[place]):
                expected += ", or a clock: hh:mm:ss, alone or behind yyyy-mm-dd or dd.mm.yyyy"
            problem = f"{self._place(line_number, place, row)}; expected {expected}"
            if value is None:
                decimal = decimal_hint(row[place], self.decimal)
                # a decimal comma in some rows is no break in them: without those, the rest would be another record
                raise InputError(problem + decimal) if decimal else _BadRowError(problem)
            if math.isnan(value) and not self.missing:
                raise _MissingError(problem)
            values.append(value)
        if self.guard >= 0 and _WORD.match(row[self.guard]):
            raise _BadRowError(f"{self._place(line_number, self.guard, row)} where the rows begin with numbers")
        return values

    def _place(self, line_number: int, place: int, row: Sequence[str]) -> str:
        return f"line {line_number}, column {self.heading.label(place)}: {brief(row[place])}"


@define
class _Reading:
    """What is wanted of a text, and how its rows become arrays."""

    columns: Mapping[str, Column]
    layout: Format
    missing: bool
    most_rows: int
    count: int = 0
    notices: list[str] = Factory(list)
    # when the first row was, of columns that are clocks
    starts: dict[str, float | None] = Factory(dict)

    def fits(self, block: Block) -> bool:
        """Return whether a block has all columns."""
        try:
            for column in self.columns.values():
                block.heading.place(column)
        except InputError:
            return False
        return True

    def piece(self, stream: Iterator[str], head: Head, label: str, start: float | None = None) -> Piece:
        """Read one table."""
        heading = head.heading(list(self.columns.values()))
        places = [heading.place(column) for column in self.columns.values()]
        lines = chain(head.physical[heading.above - head.before :], stream)
        values, numbers, clocks = self._values(lines, heading, places)
        file_columns = {}
        for key, place, column in zip(self.columns, places, values, strict=True):
            if place in clocks:
                since, self.starts[key] = from_the_first(column, self.starts.get(key))
                file_columns[key] = FileColumn(heading.label(place), since, ("s",))
            else:
                file_columns[key] = FileColumn(heading.label(place), column, heading.units(place))
        return Piece(file_columns, Part(label, len(numbers), start), numbers)

    def _values(
        self, lines: Iterator[str], heading: Heading, places: list[int]
    ) -> tuple[list[Floats], Lines, set[int]]:
        """Read rows into arrays, one for each place, one of the numbers of their lines, and which places are clocks."""
        parts: list[list[Floats]] = [[] for _ in places]
        kept: list[Lines] = []
        dropped: list[int] = []
        wanted: _Wanted | None = None
        for numbers, texts in _lines_of_rows(lines, heading, self.layout):
            if wanted is None:
                first = fields(texts[0], heading.delimiter)
                wanted = _Wanted.of(first, heading, places, self.layout.decimal, missing=self.missing)
            values, kept_numbers = wanted.of_plain(texts), numbers
            if values is None:
                # line by line, so that the error names the line and the column
                values, kept_numbers = self._careful(wanted, numbers, texts, dropped)
            self.count += len(kept_numbers)
            if self.count > self.most_rows:
                raise InputError(f"has more than {self.most_rows:,} rows; thin or split it")
            for part, column in zip(parts, values, strict=True):
                part.append(column)
            kept.append(np.array(kept_numbers, dtype=np.int64))
        if wanted is None or not sum(map(len, kept)):
            raise InputError("has a header but no rows; expected one line for each sample")
        if dropped:
            which = ", ".join(map(str, dropped[:5])) + (", …" if len(dropped) > 5 else "")
            self.notices.append(f"{counted(len(dropped), 'broken row', 'broken rows')} left out (line {which})")
        return [np.concatenate(part) for part in parts], np.concatenate(kept), wanted.clocks

    def _careful(
        self, wanted: _Wanted, numbers: Sequence[int], texts: Sequence[str], dropped: list[int]
    ) -> tuple[list[Floats], list[int]]:
        """Return the values of rows, line by line, and the numbers of their lines; broken ones may be left out."""
        kept: list[int] = []
        rows: list[list[float]] = []
        for line_number, text in zip(numbers, texts, strict=True):
            try:
                rows.append(wanted.of_line(line_number, text))
                kept.append(line_number)
            except _MissingError:
                raise
            except _BadRowError as error:
                if self.layout.broken == "refuse":
                    raise _BadRowError(f'{error}; broken = "drop" leaves such rows out') from error
                dropped.append(line_number)
        columns = np.array(rows, dtype=np.float64).reshape(len(kept), len(wanted.places))
        return [columns[:, index].copy() for index in range(len(wanted.places))], kept


def _clock_times(texts: Sequence[str]) -> Floats | None:
    """Return the times of a clock [s]; None where anything else stands among the times."""
    times = [clock(text) for text in texts]
    return None if None in times else np.array(times, dtype=np.float64)
