"""Texts: one row of values on each line, between commas, semicolons, tabs, bars or white space."""

import codecs
import csv
import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Self

import numpy as np
from attrs import evolve, frozen

from historysim.basics.arguments import Floats, Integers
from historysim.basics.limits import at_most, most
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.tables.blocks import Block, survey
from historysim.tables.clock import clock_seconds, seconds_since_first
from historysim.tables.columns import Column, FileColumn, Format, Listing, MissingValueError
from historysim.tables.head import SEARCHED, Head, Heading, ragged
from historysim.tables.lines import (
    AT_ONCE,
    brief,
    decimal_hint,
    fault_hint,
    fields,
    is_plain,
    number,
    number_in_unit,
    plain_notation,
    split,
    split_quantity,
)

# where the rows begin with numbers, no row begins with a word
_WORD = re.compile(r"\s*(?!nan\b|null\b)[^\W\d_]{3}", re.IGNORECASE)
_LIKE_A_CLOCK = re.compile(r"\d+(?=.*[/:])[\d/:. -]+\s*(?:[AaPp][Mm])?")
_MOST_NAMED = 5  # blocks, or broken rows, that a message names

WINDOWS = "cp1252"  # the encoding of most texts that are not UTF-8


# -- lines -----------------------------------------------------------------------------------------


def lines_of(path: Path, encoding: str, most_rows: int) -> list[str]:
    """Return the lines of a text; another encoding is an InputError that names the byte."""
    _check_lines(path)
    try:
        with path.open(encoding=encoding) as stream:
            lines = list(islice(stream, most_rows + SEARCHED + 1))
    except UnicodeError as error:
        # what is taken for a text of Windows is none of UTF-8
        expected = "utf-8" if encoding == WINDOWS else encoding
        raise InputError(_undecodable(path.read_bytes(), expected)) from error
    if len(lines) > most_rows + SEARCHED:
        raise InputError(f"has more than {most_rows:,} rows; thin or split it")
    lines[:1] = [line.removeprefix("\ufeff") for line in lines[:1]]
    return lines


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
    name = "UTF-8" if encoding.lower() in {"utf-8", "utf8"} else encoding
    return f'is not {name} text{where}; save it as UTF-8, or say which encoding it has, such as encoding = "utf-16"'


# -- tables ----------------------------------------------------------------------------------------


def read(
    text: Sequence[str], columns: Mapping[str, Column], layout: Format, *, missing: bool, most_rows: int
) -> tuple[dict[str, FileColumn], Integers, list[str]]:
    """Return columns of one table of a text, the line numbers of its rows, and notices.

    Errors as in `historysim.tables.read_table`.
    """
    bad = None
    if layout.block is None and layout.broken == "refuse":
        try:
            head = Head.of(text, layout)
            return _Rows.of(text, head, columns, missing=missing).read(most_rows)
        except _BadRowError as error:
            # either there is more than one table, or the row is broken
            bad = error
    try:
        blocks, footer = survey(text, layout)
    except InputError as error:
        raise bad or error from None
    index, header = _choose_block(blocks, columns, layout, bad)
    block = blocks[index]
    head = Head.of(text, evolve(layout, header=header), block.begin, block.last)
    rows = _Rows.of(text, head, columns, missing=missing, end=block.last)
    file_columns, lines, notices = rows.read_or_advise(most_rows)
    return file_columns, lines, [*_left_out(blocks, footer, index), *notices]


def _choose_block(
    blocks: Sequence[Block], columns: Mapping[str, Column], layout: Format, bad: InputError | None
) -> tuple[int, int | None]:
    """Return the index of the block to read, and the line of its header if given.

    InputError if several blocks have the columns, or the block does not exist.
    """
    count, none = len(blocks), 0 if layout.header == 0 else None
    if layout.header and (layout.block is None or count == 1):
        # whoever gives the header has chosen the table below it
        below = [index for index, block in enumerate(blocks) if block.first > layout.header]
        return below[0] if below else count - 1, layout.header
    if layout.block is not None:
        if layout.block > count:
            raise InputError(f"there is no block {layout.block}; {_seen(blocks)}")
        return layout.block - 1, none
    fitting = [index for index, block in enumerate(blocks) if _has(block.heading, columns)]
    if count > 1 and len(fitting) != 1:
        raise InputError(f"has {count} blocks; choose one, as in block = 2; {_seen(blocks)}") from bad
    return (fitting or [0])[0], none


def _has(heading: Heading, columns: Mapping[str, Column]) -> bool:
    try:
        for column in columns.values():
            heading.place(column)
    except InputError:
        return False
    return True


def _left_out(blocks: Sequence[Block], footer: Sequence[str], index: int) -> Iterator[str]:
    """Yield notices of the blocks and lines of a text that are not read."""
    if len(blocks) > 1:
        rows = counted(sum(block.rows for block in blocks) - blocks[index].rows, "row", "rows")
        others = counted(len(blocks) - 1, "block", "blocks")
        yield (
            f"block {index + 1} is read, {others} with {rows} left out: choose another with block = …, or remove the "
            "lines between blocks to join them"
        )
    if footer:
        yield f"the lines below the table are left out: {brief(footer[0])}"


def _seen(blocks: Sequence[Block]) -> str:
    """Return what blocks there are, with names, units and first rows."""
    texts = [
        "block {} in lines {} to {}: {} (first row: {})".format(number, block.first, block.last, *block.described())
        for number, block in enumerate(blocks[:_MOST_NAMED], 1)
    ]
    more = [f"and {len(blocks) - _MOST_NAMED} more"] if len(blocks) > _MOST_NAMED else []
    return "seen: " + "; ".join([*texts, *more])


def picture(text: Sequence[str], layout: Format) -> tuple[list[str], int]:
    """Return lines on what stands in a text, and its number of tables. Errors as in `historysim.tables.describe`."""
    blocks, footer = survey(text, layout)
    lines = []
    for index, block in enumerate(blocks):
        names, row = block.described()
        above = "; ".join(brief(line)[1:-1] for line in block.preamble[:3])
        lines.append(
            f"block {index + 1}: {counted(block.rows, 'row', 'rows')} in lines {block.first} to {block.last}"
            + (f", below {above}" if above else "")
        )
        if not index or block.heading.names != blocks[index - 1].heading.names:
            lines.append(f"  names and units: {names}")
        lines.append(f"  first row: {row}")
    if footer:
        lines.append(f"below: {'; '.join(brief(line)[1:-1] for line in footer[:3])}")
    return lines, len(blocks)


def describe(text: Sequence[str], layout: Format) -> list[Listing]:
    """Return what columns there are in the lines of a text. Errors as in `historysim.tables.describe`."""
    blocks, _ = survey(text, layout)
    block = blocks[min(layout.block or 1, len(blocks)) - 1]
    heading = block.heading
    units = [
        "s" if clock_seconds(first) is not None else ", ".join(dict.fromkeys([*heading.units(at), *in_cell]))
        for at, (first, in_cell) in enumerate((each, (split_quantity(each) or ("",))[1:]) for each in block.row)
    ]
    return [
        Listing(reference, unit, str(block.rows), first.strip())
        for reference, unit, first in zip(heading.references(), units, block.row, strict=True)
    ]


# -- rows ------------------------------------------------------------------------------------------


class _BadRowError(InputError):
    """A line that is no row."""

    line = 0  #: counted from 1
    cell = ""  #: the cell that is broken, empty if it is the whole line


class _MissingError(_BadRowError, MissingValueError):
    """A row that misses a value."""


def _dropped_text(dropped: Sequence[_BadRowError], kept: int) -> str:
    """Return how many rows are left out, of how many, where, and what they have in common."""
    which = ", ".join(str(error.line) for error in dropped[:_MOST_NAMED]) + (", …" if dropped[_MOST_NAMED:] else "")
    shared = _what_dropped_rows_share(dropped)
    rows = f"{len(dropped):,} of {counted(len(dropped) + kept, 'row', 'rows')} (line {which})"
    return f"{rows}, {shared}" if shared else rows


def _what_dropped_rows_share(dropped: Sequence[_BadRowError]) -> str:
    """Return what several broken rows have in common, for a message; empty if nothing."""
    cells = {plain_notation(error.cell.strip()) for error in dropped}
    if len(dropped) < 2 or "" in cells:
        return ""
    if all(cell[:1] in "-(" or cell[-1:] == "-" for cell in cells):
        return "all of them negative"
    if len(cells) == 1:
        return f"all of them {brief(dropped[0].cell)}"
    return "in one piece" if len(dropped) > 2 and dropped[-1].line - dropped[0].line < len(dropped) else ""


def plain_numbers(texts: list[str], decimal: str) -> Floats | None:
    """Return finite numbers as an array; None where anything else stands among them."""
    whole = plain_notation("\n".join(texts))
    if not is_plain(whole, decimal):
        return None
    numbers = whole.replace(decimal, ".").split("\n")
    if len(numbers) != len(texts):
        return None
    try:
        values = np.fromiter(map(float, numbers), dtype=np.float64, count=len(texts))
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _quantities(texts: Sequence[str], decimal: str, unit: str) -> Floats | None:
    """Return values with their units in one unit; None where anything else stands among them."""
    values = [number_in_unit(text, decimal, unit) for text in texts]
    finite = [value for value in values if value is not None and math.isfinite(value)]
    return np.array(finite, dtype=np.float64) if len(finite) == len(texts) else None


def _clock_times(texts: Sequence[str]) -> Floats | None:
    """Return the times of a clock [s]; None where anything else stands among the times."""
    times = [clock_seconds(text) for text in texts]
    return None if None in times else np.array(times, dtype=np.float64)


def _lines_of_rows(
    text: Sequence[str], heading: Heading, layout: Format, end: int
) -> Iterator[tuple[list[int], list[str]]]:
    """Yield the numbers of the lines of rows, many at once, and the lines."""
    # a line of nothing but tabs is a row, if they are the delimiters
    blank = None if heading.delimiter == " " else " \t\n".replace(heading.delimiter, "")
    for begin in range(heading.above, end, AT_ONCE):
        numbers = [
            line_number
            for line_number, line in enumerate(text[begin : min(begin + AT_ONCE, end)], begin + 1)
            if line.strip(blank) and not (layout.comment and line.lstrip().startswith(layout.comment))
        ]
        if numbers:
            yield numbers, [text[line_number - 1] for line_number in numbers]


def _row(line_number: int, text: str, heading: Heading) -> list[str]:
    """Return the values of a line; a line that is no row is an error."""
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


def _unit_in_cells(lines: Sequence[str], heading: Heading, place: int, decimal: str) -> str:
    """Return the unit in the first value of a column that is neither missing nor 0; empty without one."""
    for line in lines:
        row = fields(line, heading.delimiter)
        value = number(row[place], decimal) if place < len(row) else 0.0
        if value == 0 or (value is not None and math.isnan(value)):
            continue
        quantity = split_quantity(row[place]) if value is None else None
        return quantity[1] if quantity else ""
    return ""


@frozen
class _Rows:
    """The rows of a table, and the values that are wanted of them."""

    text: Sequence[str]
    end: int  #: how many lines of the text are up to the last row
    heading: Heading
    layout: Format
    missing: bool
    places: dict[str, int]  #: where the values stand, by the keys of the columns
    clocks: set[int]  #: which of these places are of clocks
    cell_units: dict[int, str]  #: the unit of the first value, by the places of columns whose values have units
    #: The place of the first number in the first row: where a word stands there, is no row. -1 where it is wanted, or
    #: there is none.
    guard: int

    @classmethod
    def of(
        cls, text: Sequence[str], head: Head, columns: Mapping[str, Column], *, missing: bool, end: int | None = None
    ) -> Self:
        """Return the rows below a head that has these columns, up to a line."""
        heading, end = head.heading(list(columns.values())), len(text) if end is None else end
        places = {key: heading.place(column) for key, column in columns.items()}
        _, lines = next(_lines_of_rows(text, heading, head.layout, end), ([], [""]))
        first = fields(lines[0], heading.delimiter)
        units = {place: _unit_in_cells(lines, heading, place, head.layout.decimal) for place in places.values()}
        cell_units = {place: unit for place, unit in units.items() if unit}
        values = [number((split_quantity(field) or [field])[0], head.layout.decimal) for field in first]
        guard = next((place for place, value in enumerate(values) if value is not None and math.isfinite(value)), -1)
        clocks = {place for place in places.values() if place < len(first) and clock_seconds(first[place]) is not None}
        guard = -1 if guard in places.values() else guard
        return cls(text, end, heading, head.layout, missing, places, clocks, cell_units, guard)

    def read_or_advise(self, most_rows: int) -> tuple[dict[str, FileColumn], Integers, list[str]]:
        """Read the columns; the error of a broken row says how many rows ``broken = "drop"`` would leave out."""
        try:
            return self.read(most_rows)
        except _MissingError:
            raise
        except _BadRowError as error:
            raise _BadRowError(f"{error}; {self._drop_advice(most_rows)}") from error

    def _drop_advice(self, most_rows: int) -> str:
        """Return the remedy of a broken row, with the rows that ``broken = "drop"`` would leave out."""
        dropping = evolve(self, layout=evolve(self.layout, broken="drop"))
        try:
            _, kept, dropped = dropping._columns(most_rows)  # noqa: SLF001 - of its own class
        except InputError:
            # other rows cannot be read either way
            return "mend it in the file"
        text = _dropped_text(dropped, kept.size)
        if _what_dropped_rows_share(dropped):
            return f'mend it in the file; broken = "drop" would leave out {text}, and the rest is another record'
        return f'mend it in the file, or broken = "drop" leaves out {text}'

    def read(self, most_rows: int) -> tuple[dict[str, FileColumn], Integers, list[str]]:
        """Return the columns, the line numbers of the rows, and a notice of broken rows that are left out."""
        columns, lines, dropped = self._columns(most_rows)
        notices = [f"broken rows left out: {_dropped_text(dropped, lines.size)}"] if dropped else []
        return columns, lines, notices

    def _columns(self, most_rows: int) -> tuple[dict[str, FileColumn], Integers, list[_BadRowError]]:
        """Return the columns, the line numbers of the rows, and the errors of rows that are left out."""
        parts: list[list[Floats]] = []
        kept: list[Integers] = []
        count, dropped = 0, list[_BadRowError]()
        for numbers, texts in _lines_of_rows(self.text, self.heading, self.layout, self.end):
            values, rows = self._plain(texts), numbers
            if values is None:
                # line by line, so that an error names the line and the column
                values, rows = self._careful(numbers, texts, dropped)
            parts.append(values)
            kept.append(np.array(rows, dtype=np.int64))
            count += len(rows)
            if count > most_rows:
                raise InputError(f"has more than {most_rows:,} rows; thin or split it")
        if not count:
            raise InputError("has a header but no rows; expected one line for each sample")
        columns = {}
        for (key, place), *values in zip(self.places.items(), *parts, strict=True):
            column, units = np.concatenate(values), self.heading.units(place)
            if place in self.clocks:
                column, units = seconds_since_first(column), ("s",)
            elif place in self.cell_units:
                units = (*units, self.cell_units[place])
            columns[key] = FileColumn(self.heading.label(place), column, units)
        return columns, np.concatenate(kept), dropped

    def _plain(self, lines: Sequence[str]) -> list[Floats] | None:
        """Return the values of lines that are rows of finite numbers and times; None where anything else is there."""
        try:
            rows = split(lines, self.heading.delimiter)
        except csv.Error:
            return None
        is_even = set(map(len, rows)) == {self.heading.width}
        if len(rows) != len(lines) or not (is_even or all(_fits(row, self.heading) for row in rows)):
            return None
        if self.guard >= 0 and any(_WORD.match(row[self.guard]) for row in rows):
            return None
        values = []
        for place in self.places.values():
            texts = [row[place] for row in rows]
            if place in self.clocks:
                column = _clock_times(texts)
            elif place in self.cell_units:
                column = _quantities(texts, self.layout.decimal, self.cell_units[place])
            else:
                column = plain_numbers(texts, self.layout.decimal)
            if column is None:
                return None
            values.append(column)
        return values

    def _careful(
        self, numbers: Sequence[int], texts: Sequence[str], dropped: list[_BadRowError]
    ) -> tuple[list[Floats], list[int]]:
        """Return the values of rows, line by line, and the numbers of their lines; broken ones may be left out."""
        kept: list[int] = []
        rows: list[list[float]] = []
        for line_number, text in zip(numbers, texts, strict=True):
            try:
                rows.append(self._values(line_number, text))
                kept.append(line_number)
            except _MissingError:
                raise
            except _BadRowError as error:
                if self.layout.broken == "refuse":
                    raise
                error.line = line_number
                dropped.append(error)
        return [*np.array(rows, dtype=np.float64).reshape(len(kept), len(self.places)).T.copy()], kept

    def _values(self, line_number: int, text: str) -> list[float]:
        """Return the values of a line."""
        row = _row(line_number, text, self.heading)
        values = []
        for place in self.places.values():
            value, expected = number(row[place], self.layout.decimal), "a finite number"
            if unit := self.cell_units.get(place):
                value = number_in_unit(row[place], self.layout.decimal, unit)
                expected = f"a value with its unit, as in the other rows ({unit})"
            elif quantity := split_quantity(row[place]):
                expected = f"a finite number, or a unit such as {quantity[1]} in all rows"
            if place in self.clocks and not (value is not None and math.isnan(value)):
                value, expected = clock_seconds(row[place]), "a time as in the rows above"
            if value is None and _LIKE_A_CLOCK.fullmatch(row[place]):
                expected += ", or a clock: hh:mm:ss, with or without AM or PM, alone or behind yyyy-mm-dd or dd.mm.yyyy"
            problem = f"{self._place(line_number, place, row)}; expected {expected}"
            if value is None:
                decimal = decimal_hint(row[place], self.layout.decimal)
                # a decimal comma in some rows is no break in them: without those, the rest would be another record
                if decimal:
                    raise InputError(problem + decimal)
                error = _BadRowError(problem + fault_hint(row[place]))
                error.cell = row[place]
                raise error
            if math.isnan(value) and not self.missing:
                raise _MissingError(problem)
            values.append(value)
        if self.guard >= 0 and _WORD.match(row[self.guard]):
            raise _BadRowError(f"{self._place(line_number, self.guard, row)} where the rows begin with numbers")
        return values

    def _place(self, line_number: int, place: int, row: Sequence[str]) -> str:
        return f"line {line_number}, column {self.heading.label(place)}: {brief(row[place])}"
