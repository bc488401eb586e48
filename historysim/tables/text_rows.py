"""Parse the rows of a text table: plain numbers in C, other cells one by one, with line and column of an error."""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from typing import Self

import numpy as np
from attrs import evolve, frozen

from historysim.basics.arguments import Floats, Integers
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.tables.clock import clock_seconds, seconds_since_first
from historysim.tables.columns import Column, FileColumn, Format, MissingValueError
from historysim.tables.head import Head, Heading, ragged_row_message
from historysim.tables.lines import (
    BATCH_LINES,
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

# the start of a line that is not a row, in a table whose rows begin with numbers
_WORD = re.compile(r"\s*(?!nan\b|null\b)[^\W\d_]{3}", re.IGNORECASE)
_LIKE_A_CLOCK = re.compile(r"\d+(?=.*[/:])[\d/:. -]+\s*(?:[AaPp][Mm])?")
# number of blocks, or broken rows, that a message lists; more rows than that are not dropped on
# advice
MOST_NAMED = 5


class BadRowError(InputError):
    """A line that is not a valid row."""

    line = 0  #: counted from 1
    cell = ""  #: the invalid cell, empty if the whole line is invalid


class _MissingError(BadRowError, MissingValueError):
    """A row with a missing value."""


def _dropped_text(dropped: Sequence[BadRowError], rows_read: int) -> str:
    """Return number, lines and common property of rows that are left out, for a message."""
    which = ", ".join(str(error.line) for error in dropped[:MOST_NAMED]) + (
        ", …" if dropped[MOST_NAMED:] else ""
    )
    shared = _common_fault(dropped)
    rows = (
        f"{len(dropped):,} of {count_text(len(dropped) + rows_read, 'row', 'rows')} (line {which})"
    )
    return f"{rows}, {shared}" if shared else rows


def _common_fault(dropped: Sequence[BadRowError]) -> str:
    """Return the common property of several broken rows, for a message; empty without one."""
    cells = {plain_notation(error.cell.strip()) for error in dropped}
    if len(dropped) < 2 or "" in cells:
        return ""
    if all(cell[:1] in "-(" or cell[-1:] == "-" for cell in cells):
        return "all of them negative"
    if len(cells) == 1:
        return f"all of them {brief(dropped[0].cell)}"
    return (
        "in one piece"
        if len(dropped) > 2 and dropped[-1].line - dropped[0].line < len(dropped)
        else ""
    )


def plain_numbers(texts: list[str], decimal: str) -> Floats | None:
    """Parse finite numbers; None if a text is anything else."""
    joined = plain_notation("\n".join(texts))
    if not is_plain(joined, decimal):
        return None
    numbers = joined.replace(decimal, ".").split("\n")
    if len(numbers) != len(texts):
        return None
    try:
        values = np.fromiter(map(float, numbers), dtype=np.float64, count=len(texts))
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _quantities(texts: Sequence[str], decimal: str, unit: str) -> Floats | None:
    """Parse values with units, converted to one unit; None if a text is anything else."""
    values = [number_in_unit(text, decimal, unit) for text in texts]
    finite = [value for value in values if value is not None and math.isfinite(value)]
    return np.array(finite, dtype=np.float64) if len(finite) == len(texts) else None


def _clock_times(texts: Sequence[str]) -> Floats | None:
    """Parse clock times [s]; None if a text is anything else."""
    times = [clock_seconds(text) for text in texts]
    return None if None in times else np.array(times, dtype=np.float64)


def _row_numbers(text: Sequence[str], heading: Heading, layout: Format, lines: range) -> list[int]:
    """Return the line numbers of rows, without comments and blank lines, in a range of lines from 0."""
    # a line of tabs alone is a row if tabs are the delimiter
    blank = None if heading.delimiter == " " else " \t\n".replace(heading.delimiter, "")
    return [
        line_number
        for line_number, line in enumerate(text[lines.start : lines.stop], lines.start + 1)
        if line.strip(blank) and not (layout.comment and line.lstrip().startswith(layout.comment))
    ]


def _split_row(line_number: int, text: str, heading: Heading) -> list[str]:
    """Split a line into values; an error if it is not a row of the table."""
    try:
        row = split([text], heading.delimiter)[0]
    except csv.Error as error:
        reason = "a quoted value is not closed" if "end of data" in str(error) else error
        raise BadRowError(f"line {line_number} is not a CSV table: {reason}") from error
    if not _has_width(row, heading):
        named = heading.names and not heading.mismatch
        wide = (
            f"the header names {heading.width} columns"
            if named
            else f"other lines have {heading.width}"
        )
        raise BadRowError(ragged_row_message(line_number, len(row), wide))
    return row


def _has_width(row: Sequence[str], heading: Heading) -> bool:
    """Return True if a row has the width of the table, or more with blank values at its end."""
    return len(row) >= heading.width and not any(field.strip() for field in row[heading.width :])


def _unit_in_cells(lines: Sequence[str], heading: Heading, index: int, decimal: str) -> str:
    """Return the unit in the first value of a column that is not missing or 0; empty without one."""
    for line in lines:
        row = fields(line, heading.delimiter)
        value = number(row[index], decimal) if index < len(row) else 0.0
        if value == 0 or (value is not None and math.isnan(value)):
            continue
        quantity = split_quantity(row[index]) if value is None else None
        return quantity[1] if quantity else ""
    return ""


@frozen
class RowParser:
    """Parser of the requested columns of a table."""

    text: Sequence[str]
    stop: int  #: line number of the last row
    heading: Heading
    layout: Format
    missing: bool  #: True if missing values are NaN, not errors
    indices: dict[str, int]  #: indices of the columns by their keys
    clocks: set[int]  #: indices of columns of clock times
    #: unit of the first value, by the indices of columns whose values have units
    cell_units: dict[int, str]
    #: Index of the first number in the first row: a line with a word there is not a row. -1 if that
    #: column is requested or does not exist.
    guard: int

    @classmethod
    def from_head(
        cls,
        text: Sequence[str],
        head: Head,
        columns: Mapping[str, Column],
        *,
        missing: bool,
        stop: int | None = None,
    ) -> Self:
        """Make the parser of the rows below a head that has these columns, up to a line."""
        heading = head.heading(list(columns.values()))
        stop = len(text) if stop is None else stop
        indices = {key: heading.find(column) for key, column in columns.items()}
        batches = (
            _row_numbers(text, heading, head.layout, range(start, min(start + BATCH_LINES, stop)))
            for start in range(heading.lines_above, stop, BATCH_LINES)
        )
        lines = [text[line_number - 1] for line_number in next(filter(None, batches), [])]
        first_row = fields(lines[0], heading.delimiter) if lines else []
        units = {
            index: _unit_in_cells(lines, heading, index, head.layout.decimal)
            for index in indices.values()
        }
        cell_units = {index: unit for index, unit in units.items() if unit}
        values = [
            number((split_quantity(field) or [field])[0], head.layout.decimal)
            for field in first_row
        ]
        guard = next(
            (
                index
                for index, value in enumerate(values)
                if value is not None and math.isfinite(value)
            ),
            -1,
        )
        clocks = {
            index
            for index in indices.values()
            if index < len(first_row) and clock_seconds(first_row[index]) is not None
        }
        guard = -1 if guard in indices.values() else guard
        return cls(text, stop, heading, head.layout, missing, indices, clocks, cell_units, guard)

    def read_or_advise(self, most_rows: int) -> tuple[dict[str, FileColumn], Integers, list[str]]:
        """Read the columns; the error for a broken row states how many rows ``broken = "drop"`` would leave out."""
        try:
            return self.read(most_rows)
        except _MissingError:
            raise
        except BadRowError as error:
            raise BadRowError(f"{error}; {self._drop_advice(most_rows)}") from error

    def _drop_advice(self, most_rows: int) -> str:
        """Return the remedy for a broken row, with the rows that ``broken = "drop"`` would leave out."""
        dropping = evolve(self, layout=evolve(self.layout, broken="drop"))
        try:
            _, lines, dropped = dropping.read_columns(most_rows)
        except InputError:
            # other rows cannot be read even if broken ones are dropped
            return "correct it in the file"
        text = _dropped_text(dropped, lines.size)
        if len(dropped) > max(MOST_NAMED, lines.size // 100):
            return f"export the file again with plain numbers; not readable: {text}"
        if _common_fault(dropped):
            return f'correct it in the file; broken = "drop" would leave out {text}, and the rest is another record'
        return f'correct it in the file, or broken = "drop" leaves out {text}'

    def read(self, most_rows: int) -> tuple[dict[str, FileColumn], Integers, list[str]]:
        """Return the columns, the line numbers of the rows, and a notice of broken rows that are left out."""
        columns, lines, dropped = self.read_columns(most_rows)
        notices = [f"broken rows left out: {_dropped_text(dropped, lines.size)}"] if dropped else []
        return columns, lines, notices

    def read_columns(
        self, most_rows: int
    ) -> tuple[dict[str, FileColumn], Integers, list[BadRowError]]:
        """Return the columns, the line numbers of the rows, and the errors of rows that are left out."""
        batches: list[list[Floats]] = []
        line_numbers: list[Integers] = []
        count = 0
        dropped = list[BadRowError]()
        for start in range(self.heading.lines_above, self.stop, BATCH_LINES):
            stop = min(start + BATCH_LINES, self.stop)
            values, rows = self._read_lines(start, stop, dropped)
            batches.append(values)
            line_numbers.append(np.asarray(rows, dtype=np.int64))
            count += len(rows)
            if count > most_rows:
                raise InputError(f"has more than {most_rows:,} rows; thin or split it")
        if not count:
            raise InputError("has a header but no rows; expected one line for each sample")
        columns = {}
        for (key, index), *values in zip(self.indices.items(), *batches, strict=True):
            column = np.concatenate(values)
            units = self.heading.units(index)
            if index in self.clocks:
                column = seconds_since_first(column)
                units = ("s",)
            elif index in self.cell_units:
                units = (*units, self.cell_units[index])
            columns[key] = FileColumn(self.heading.label(index), column, units)
        return columns, np.concatenate(line_numbers), dropped

    def _read_lines(
        self, start: int, stop: int, dropped: list[BadRowError]
    ) -> tuple[list[Floats], Sequence[int]]:
        """Return the columns and the line numbers of the rows in a range of lines.

        The fastest of three parsers that understands the lines is used; the last one knows the line
        and the column of an error.
        """
        values = self._parse_plain(self.text[start:stop])
        if values is not None:
            return values, range(start + 1, stop + 1)
        numbers = _row_numbers(self.text, self.heading, self.layout, range(start, stop))
        texts = [self.text[line_number - 1] for line_number in numbers]
        values = self._parse_block(texts)
        if values is not None:
            return values, numbers
        return self._parse_lines(numbers, texts, dropped)

    def _parse_plain(self, lines: Sequence[str]) -> list[Floats] | None:
        """Parse lines by numpy's parser in C; None if a line may be anything but a row of finite numbers."""
        delimiter = self.heading.delimiter
        decimal = self.layout.decimal
        block = "".join(lines)
        is_commented = self.layout.comment and self.layout.comment in block
        if is_commented or '"' in block or self.clocks or self.cell_units:
            return None
        # a word in the column of the guard is not a number
        used = [*self.indices.values(), *([self.guard] if self.guard >= 0 else [])]
        last = self.heading.width - 1
        if delimiter == " ":
            is_even = {len(line.split()) for line in lines} == {last + 1}
        elif last in used:
            # numpy refuses a line without the last column
            is_even = block.count(delimiter) == last * len(lines)
        else:
            is_even = {line.count(delimiter) for line in lines} == {last}
        if not is_even or not is_plain(block, decimal):
            return None
        if decimal != ".":
            lines = [line.replace(decimal, ".") for line in lines]
        try:
            rows = np.loadtxt(
                lines,
                delimiter=None if delimiter == " " else delimiter,
                comments=None,
                usecols=used,
                ndmin=2,
            )
        except ValueError:
            return None
        if len(rows) != len(lines) or not np.isfinite(rows).all():
            return None
        return [*rows.T[: len(self.indices)].copy()]

    def _parse_block(self, lines: Sequence[str]) -> list[Floats] | None:
        """Parse a batch of rows of finite numbers and times; None if it has anything else."""
        try:
            rows = split(lines, self.heading.delimiter)
        except csv.Error:
            return None
        is_even = set(map(len, rows)) == {self.heading.width}
        if len(rows) != len(lines) or not (
            is_even or all(_has_width(row, self.heading) for row in rows)
        ):
            return None
        if self.guard >= 0 and any(_WORD.match(row[self.guard]) for row in rows):
            return None
        values = []
        for index in self.indices.values():
            texts = [row[index] for row in rows]
            if index in self.clocks:
                column = _clock_times(texts)
            elif index in self.cell_units:
                column = _quantities(texts, self.layout.decimal, self.cell_units[index])
            else:
                column = plain_numbers(texts, self.layout.decimal)
            if column is None:
                return None
            values.append(column)
        return values

    def _parse_lines(
        self, numbers: Sequence[int], texts: Sequence[str], dropped: list[BadRowError]
    ) -> tuple[list[Floats], list[int]]:
        """Parse rows line by line; return columns and line numbers, and add the errors of dropped rows to a list."""
        line_numbers: list[int] = []
        rows: list[list[float]] = []
        for line_number, text in zip(numbers, texts, strict=True):
            try:
                rows.append(self._parse_row(line_number, text))
                line_numbers.append(line_number)
            except _MissingError:
                raise
            except BadRowError as error:
                if self.layout.broken == "refuse":
                    raise
                error.line = line_number
                dropped.append(error)
        return [
            *np.array(rows, dtype=np.float64).reshape(len(line_numbers), len(self.indices)).T.copy()
        ], line_numbers

    def _parse_row(self, line_number: int, text: str) -> list[float]:
        """Parse the requested values of a line."""
        row = _split_row(line_number, text, self.heading)
        values = []
        for index in self.indices.values():
            value = number(row[index], self.layout.decimal)
            expected = "a finite number"
            if unit := self.cell_units.get(index):
                value = number_in_unit(row[index], self.layout.decimal, unit)
                expected = f"a value with its unit, as in the other rows ({unit})"
            elif quantity := split_quantity(row[index]):
                expected = f"a finite number, or a unit such as {quantity[1]} in all rows"
            if index in self.clocks and not (value is not None and math.isnan(value)):
                value = clock_seconds(row[index])
                expected = "a time as in the rows above"
            if value is None and _LIKE_A_CLOCK.fullmatch(row[index]):
                expected += ", or a clock: hh:mm:ss, with or without AM or PM, alone or behind yyyy-mm-dd or dd.mm.yyyy"
            problem = f"{self._cell_text(line_number, index, row)}; expected {expected}"
            if value is None:
                decimal = decimal_hint(row[index], self.layout.decimal)
                # not a broken row: dropping all rows with a decimal comma would leave another
                # record
                if decimal:
                    raise InputError(problem + decimal)
                error = BadRowError(problem + fault_hint(row[index]))
                error.cell = row[index]
                raise error
            if math.isnan(value) and not self.missing:
                raise _MissingError(problem)
            values.append(value)
        if self.guard >= 0 and _WORD.match(row[self.guard]):
            raise BadRowError(
                f"{self._cell_text(line_number, self.guard, row)} where the rows begin with numbers"
            )
        return values

    def _cell_text(self, line_number: int, index: int, row: Sequence[str]) -> str:
        return f"line {line_number}, column {self.heading.label(index)}: {brief(row[index])}"
