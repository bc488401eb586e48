"""Detect the header of a text table: its first row, its delimiter, and the names and units of its columns."""

import json
import re
from collections import Counter
from collections.abc import Sequence

import attrs

from historysim.basics.units import is_common
from historysim.basics.wording import count_text, list_names, nearest, quote
from historysim.errors import InputError
from historysim.tables.columns import Column, Format, field_unit, split_unit
from historysim.tables.lines import (
    Line,
    brief,
    find_name,
    like_a_number,
    like_a_value,
    longest_run,
    number,
    similar_rows,
    split_names,
    split_quantity,
    table_width,
    units_in_line,
    without_blank_end,
)

SEARCHED = 1000  # number of lines that are searched for a header

_DELIMITERS = ("\t", ";", "|", ",", " ")  # in the order of preference
_BRACKETED_LINE = re.compile(r"\s*[\[(]")
_TWO_NUMBERS = re.compile(r"\d([;,\t| ])\s*(?=[+-]?[.\d])")


@attrs.frozen
class Heading:
    """Header of a table in a text."""

    delimiter: str  #: the character between two values
    lines_above: int  #: the number of lines above the first row
    width: int  #: the number of values in a row
    names: tuple[str, ...] = ()  #: the names of the columns, empty without a header
    #: the units in a line below the names, in brackets, empty without one
    brackets: tuple[str, ...] = ()
    #: message if the number of names differs from the number of columns, else empty
    mismatch: str = ""

    def find(self, column: Column) -> int:
        """Return the index of a column.

        InputError if it does not exist, is ambiguous, or names and columns may not correspond.
        """
        if column.index is not None:
            raise InputError(
                f"index = {column.index} counts the columns of a matrix, but this is a text file; expected the name of "
                "the column, or its position as in { column = 3 }"
            )
        name = column.column
        if isinstance(name, int):
            if name > self.width:
                raise InputError(f"there is no column {name}; the rows have {self.width} values")
            if self.mismatch and column.unit is None and any(map(field_unit, self.names)):
                raise InputError(
                    f'{self.mismatch}; and set the unit of column {name}, as in unit = "N"'
                )
            return name - 1
        indices = find_name(name, self.names, self.brackets)
        if len(indices) < (column.occurrence or 1):
            raise no_such_column_error(column, self.names, self.brackets)
        if self.mismatch:
            raise InputError(self.mismatch)
        if column.occurrence is None and len(indices) > 1:
            names = list_names([self.names[index] for index in indices])
            full = f"{names} at positions {', '.join(str(index + 1) for index in indices)}"
            raise InputError(
                f"{name!r} may be any of the columns {full}; expected the whole name of one, or its position, as in "
                f"{{ column = {indices[-1] + 1} }}"
            )
        return indices[(column.occurrence or 1) - 1]

    def label(self, index: int) -> str:
        """Return the label of a column in messages."""
        name = "" if self.mismatch or index >= len(self.names) else self.names[index]
        return quote(name) if name else str(index + 1)

    def units(self, index: int) -> tuple[str, ...]:
        """Return the units of a column in the header: none, one, or one in each of two lines."""
        if self.mismatch:
            return ()
        texts = [line[index] for line in (self.names, self.brackets) if index < len(line)]
        return tuple(unit for unit in map(field_unit, texts) if unit)

    def title(self, index: int) -> str:
        """Return name and unit of a column for messages that list the columns."""
        name = self.names[index] if index < len(self.names) and not self.mismatch else ""
        below = self.brackets[index] if index < len(self.brackets) and not self.mismatch else ""
        return f"{name} {below}".strip() or f"column {index + 1}"

    def references(self) -> list[str]:
        """Return the TOML references of all columns."""
        totals = Counter(self.names)
        counts = Counter[str]()
        references = []
        for index in range(self.width):
            name = self.names[index] if index < len(self.names) else ""
            counts[name] += 1
            quoted = json.dumps(name, ensure_ascii=False)
            if self.mismatch or not name:
                under = f" # under {name!r}" if name else ""
                references.append(f"{{ column = {index + 1} }}{under}")
            elif totals[name] == 1:
                references.append(quoted)
            else:
                references.append(f"{{ column = {quoted}, occurrence = {counts[name]} }}")
        return references


def _is_named(column: Column, names: Sequence[str], brackets: Sequence[str] = ()) -> bool:
    return len(find_name(str(column.column), names, brackets)) >= (column.occurrence or 1)


def no_such_column_error(
    column: Column, names: Sequence[str], brackets: Sequence[str] = ()
) -> InputError:
    """Return the error for a column that the header does not name."""
    name = str(column.column)
    if count := len(find_name(name, names, brackets)):
        times = "once" if count == 1 else f"{count} times"
        return InputError(
            f"there is no occurrence {column.occurrence} of column {name!r}; the header names it {times}"
        )
    filled = [filled for filled in dict.fromkeys(names) if filled]
    # names that differ only in case or unit are suggested first
    plain = {split_unit(label)[0].casefold(): label for label in reversed(filled)}
    meant = plain.get(split_unit(name)[0].casefold())
    near = nearest(name, filled, in_file=True) if meant is None else f"did you mean {quote(meant)}?"
    return InputError(f"there is no column {name!r}; {_hint_for_name(name, filled) or near}")


def _hint_for_name(name: str, names: Sequence[str]) -> str:
    """Return a hint why a name is not found in a header, from the form of both; empty without one."""
    numbers = sum(map(like_a_number, names))
    if names and numbers == len(names):
        return (
            f"the line of names has the numbers {list_names(names)}: without a header "
            "set header = 0, and give columns by position, as { column = 1 }"
        )
    if numbers > len(names) / 2:
        mend = "expected one line for each sample: transpose the file"
        return f"{quote(names[0])} is followed by numbers in its line; {mend}"
    if len(names) == 1 and (
        delimiter := next((sign for sign in ",;\t|" if names[0].count(sign) > 1), None)
    ):
        return (
            f"expected the delimiter {delimiter!r}, which occurs in the header: {brief(names[0])}"
        )
    if name.isdecimal():
        return (
            f"a position has no quotes, as {{ column = {name} }}; the names are {list_names(names)}"
        )
    value, _, unit = name.partition(" ")
    if like_a_number(value) and is_common(unit):
        return f'a value that does not change is {{ constant = "{name}" }}; the names are {list_names(names)}'
    return ""


@attrs.frozen
class Head:
    """The first lines of a text, or of a range of its lines, which are searched for a header."""

    lines: list[Line]  #: lines that are not blank
    layout: Format  #: settings of the user

    @classmethod
    def from_lines(
        cls, text: Sequence[str], layout: Format, start: int = 0, stop: int | None = None
    ) -> "Head":
        """Take the first lines of a text, or of a range of its lines; InputError if all are blank."""
        lines = []
        for line_number, line in enumerate(
            text[start : min(start + SEARCHED, stop or len(text))], start + 1
        ):
            bare = line.lstrip()
            is_comment = bool(layout.comment) and bare.startswith(layout.comment)
            bare = bare.removeprefix(layout.comment) if is_comment else bare
            if bare.strip():
                lines.append(Line(line_number, bare if is_comment else line, is_comment))
        if not lines:
            raise InputError("is empty; expected a header line with the names of the columns")
        return cls(lines, layout)

    def heading(self, columns: Sequence[Column]) -> Heading:
        """Return the heading of the table that has the columns; without columns the most likely table.

        InputError if no table has them, or lines are ambiguous.
        """
        named = [column for column in columns if isinstance(column.column, str)]
        if self.layout.header == 0 and named:
            raise InputError(
                f"has no header, as header = 0 says, and so no column {named[0].column!r}; expected positions, such as "
                "{ column = 1 }"
            )
        if named:
            heading = self._heading_of_names(named)
        elif self.layout.header:
            heading = self._heading_below(self._header_line(), self._likely_run()[0])
        else:
            heading = self._heading_from_numbers()
            if columns and self.layout.delimiter is None:
                self._check_unambiguous(heading)
        if columns and not self.layout.header:
            self._check_no_row_above(heading)
        return heading

    @property
    def _delimiters(self) -> Sequence[str]:
        delimiter = self.layout.delimiter
        return (
            [sign for sign in _DELIMITERS if sign != self.layout.decimal]
            if delimiter is None
            else [delimiter]
        )

    def _rows(self, lines_above: int = 0) -> list[Line]:
        return [line for line in self.lines if line.number > lines_above and not line.is_comment]

    def _candidates(self) -> list[Line]:
        """Return the lines that can be the header, comments last."""
        if self.layout.header:
            return [self._header_line()]
        return sorted(self.lines, key=lambda line: line.is_comment)

    def _header_line(self) -> Line:
        for line in self.lines:
            if line.number == self.layout.header:
                return line
        raise InputError(
            f"line {self.layout.header} is not a header; expected the number of a line that is not blank, of the first "
            f"{SEARCHED:,}"
        )

    def _heading_of_names(self, columns: Sequence[Column]) -> Heading:
        """Return the heading of the first line that holds all names, comments last."""
        headings = []
        nearly: list[str] = []
        stems = {
            stem
            for column in columns
            for stem in (str(column.column), split_unit(str(column.column))[0])
        }
        # shortcut: most lines are rows of numbers, without the letters of the names
        letters = [{letter for letter in stem if not letter.isspace()} for stem in stems]
        candidates = [
            line
            for line in self._candidates()
            if any(letter_set.issubset(line.text) for letter_set in letters)
        ]
        for delimiter in self._delimiters:
            for line in candidates:
                for names in split_names(line.text, line.fields(delimiter), delimiter):
                    if stems.isdisjoint(
                        [*names, *filter(None, (split_unit(name)[0] for name in names))]
                    ):
                        continue
                    heading = self._heading_below(line, delimiter, names)
                    absent = [
                        column
                        for column in columns
                        if not _is_named(column, heading.names, heading.brackets)
                    ]
                    if not absent:
                        headings.append(heading)
                    elif len(absent) < len(columns):
                        nearly = nearly or names
        if not headings:
            names = nearly or self._likely_names()
            raise next(
                no_such_column_error(column, names)
                for column in columns
                if not _is_named(column, names)
            )
        return next(
            (heading for heading in headings if self._has_numbers(heading, columns)), headings[0]
        )

    def _likely_names(self) -> list[str]:
        if self.layout.header:
            return self._header_line().fields(self._likely_run()[0])
        try:
            heading = self._heading_from_numbers()
        except InputError:
            return self.lines[0].fields(self._likely_run()[0])
        return list(heading.names) or self.lines[0].fields(heading.delimiter)

    def _has_numbers(self, heading: Heading, columns: Sequence[Column]) -> bool:
        """Return True if the first row below a heading has a number, or a missing value, in each of the columns."""
        rows = self._rows(heading.lines_above)
        row = rows[0].fields(heading.delimiter) if rows else []
        if heading.mismatch or not row:
            return False
        indices = [
            heading.find(attrs.evolve(column, occurrence=column.occurrence or 1))
            for column in columns
        ]
        decimal = self.layout.decimal
        return all(
            number((split_quantity(row[at]) or row[at:])[0], decimal) is not None for at in indices
        )

    def _heading_below(
        self, header: Line, delimiter: str, names: Sequence[str] | None = None
    ) -> Heading:
        """Return the heading of the table below a header line; names are split to fit the width of its rows."""
        lines_above = header.number
        rows = self._rows(lines_above)
        brackets = units_in_line(rows[0].fields(delimiter)) if rows else []
        if brackets:
            lines_above = rows.pop(0).number
        if names is None:
            width = len(rows[0].fields(delimiter)) if rows else 0
            splits = split_names(header.text, header.fields(delimiter), delimiter)
            names = next((split for split in splits if len(split) == width), splits[0])
        names = without_blank_end(list(names))
        heading = Heading(delimiter, lines_above, len(names), tuple(names), tuple(brackets))
        first_row = rows[0].fields(delimiter) if rows else []
        if not first_row or len(without_blank_end(first_row)) <= len(names) <= len(first_row):
            return heading
        if self.layout.header and len(names) < len(first_row):
            # the user has set the line, so names belong to the first columns
            unnamed = ("",) * (len(first_row) - len(names))
            return attrs.evolve(heading, width=len(first_row), names=(*names, *unnamed))
        problem = (
            f"{_ragged_below(heading, rows[0])}; if the line is right, "
            "the header has a name too many or too few, and names may belong to other columns: give columns by "
            f"position, as in {{ column = 3 }}, or set header = {header.number} if its names are those of the first "
            "columns"
        )
        return attrs.evolve(
            heading, width=table_width(rows, delimiter, len(first_row)), mismatch=problem
        )

    def _likely_run(self) -> tuple[str, list[Line]]:
        """Return the delimiter that splits most consecutive lines into equally many values, and these lines.

        Some of the values are numbers.
        """
        rows = self._rows()
        text = "\n".join(line.text for line in rows)
        # most files have one of the delimiters only
        is_present = {sign: sign in text for sign in self._delimiters}
        is_present |= {" ": len(text.split()) > len(rows)}
        present = [sign for sign in self._delimiters if is_present[sign]]
        longest = {sign: longest_run(rows, sign) for sign in present or self._delimiters[:1]}
        # the first in the order of preference, unless another splits more than twice as many lines
        most_lines = max(len(run) for run in longest.values())
        return next(item for item in longest.items() if 2 * len(item[1]) >= most_lines)

    def _heading_from_numbers(self) -> Heading:
        """Return the heading of the table whose first row is the first line of numbers."""
        delimiter, run = self._likely_run()
        run = run or longest_run(self._rows(), delimiter, minimum_width=1)
        if not run:
            raise InputError("has no rows of numbers; expected one line for each sample")
        values = [line.fields(delimiter) for line in run]
        width = len(values[0])
        # columns with numbers in at least half of the lines
        numeric = [
            i
            for i in range(width)
            if 2 * sum(like_a_value(row[i]) for row in values) >= len(values)
        ]

        def is_first_row(line: Line) -> bool:
            row = line.fields(delimiter)
            return (
                len(row) == width
                and numeric != []
                and all(not row[i] or like_a_value(row[i]) for i in numeric)
            )

        return self._heading_above(
            next(filter(is_first_row, self._rows()), run[0]), delimiter, width
        )

    def first_table(self) -> tuple[Heading, list[str]] | None:
        """Return the heading and the first row of the first table, detected by the form of its lines; None without one.

        A table has two or more rows, or one row below a header. Its rows begin with a number;
        unless white space is the delimiter, they may begin with a word if two of them follow a
        header. A word and a number are a key and its value, not a row.
        """
        delimiter = self._likely_run()[0]
        rows = self._rows()
        longest = len(longest_run(rows, delimiter))
        minimum_width = 2 if longest else 1
        for start, stop in similar_rows(rows, delimiter, minimum_width):
            fields = rows[start].fields(delimiter)
            begins_with_a_number = like_a_value(next(filter(None, fields)))
            if len(fields) == 2 and not begins_with_a_number:
                continue
            heading = self._heading_above(rows[start], delimiter, len(fields))
            if begins_with_a_number:
                is_table = (
                    stop - start > 1 or bool(heading.names and not heading.mismatch) or longest == 1
                )
            else:
                is_table = (
                    delimiter != " "
                    and stop - start > 1
                    and bool(heading.names and not heading.mismatch)
                )
            if is_table:
                return heading, fields
        return None

    def _heading_above(self, first_row: Line, delimiter: str, width: int) -> Heading:
        """Return the heading above the first row of a table."""
        lines_before = [line for line in self.lines if line.number < first_row.number]
        if lines_before and self.layout.header != 0:
            header = lines_before[-1]
            if len(lines_before) > 1 and units_in_line(header.fields(delimiter)):
                lines_above = lines_before[-2].fields(delimiter)
                is_header = len(lines_above) > 1 or width == 1 or _BRACKETED_LINE.match(header.text)
                header = (
                    lines_before[-2]
                    if is_header and not any(map(like_a_number, lines_above))
                    else header
                )
            names = header.fields(delimiter)
            if len(names) >= min(width, 2) and not any(map(like_a_number, names)):
                return self._heading_below(header, delimiter)
        above_rows = first_row.number - 1
        return Heading(delimiter, above_rows, table_width(self._rows(above_rows), delimiter, width))

    def _check_unambiguous(self, heading: Heading) -> None:
        """Refuse values that another delimiter would split, or another decimal sign would join."""
        rows = [
            (line.number, line.fields(heading.delimiter))
            for line in self._rows(heading.lines_above)
        ]
        unclear = [
            (line_number, field)
            for line_number, fields in rows
            for field in fields
            if any(match.group(1) != self.layout.decimal for match in _TWO_NUMBERS.finditer(field))
        ]
        if (
            not heading.names
            and heading.delimiter == ","
            and all(_like_a_decimal_comma(fields) for _, fields in rows)
        ):
            unclear = [(rows[0][0], ",".join(rows[0][1]))]
        for line_number, field in unclear[:1]:
            raise InputError(
                f"line {line_number}: {brief(field)} may be one value or two; set the delimiter, as in "
                'delimiter = ";", and the decimal sign if it is a comma, as in decimal = ","'
            )

    def _check_no_row_above(self, heading: Heading) -> None:
        """Refuse a row of numbers above the header; without a header, any line of numbers above the rows."""
        for line in self._rows():
            if line.number > heading.lines_above:
                break
            fields = line.fields(heading.delimiter)
            filled = [field for field in fields if field]
            is_wide = len(fields) == heading.width or not heading.names or bool(heading.mismatch)
            if is_wide and filled and all(map(like_a_number, filled)):
                raise InputError(
                    f"line {line.number} looks like a row of numbers, but the table begins below line "
                    f"{heading.lines_above}; if so, set header = {heading.lines_above}"
                )


def ragged_row_message(line_number: int, count: int, expected: str) -> str:
    """Return the message for a row with an unexpected number of values."""
    values = count_text(count, "value", "values")
    return (
        f"line {line_number}: {values} where {expected}; expected one value for each column, and the delimiter of the "
        "header"
    )


def _ragged_below(heading: Heading, row: Line) -> str:
    return ragged_row_message(
        row.number,
        len(row.fields(heading.delimiter)),
        f"the header names {len(heading.names)} columns",
    )


def _like_a_decimal_comma(fields: list[str]) -> bool:
    return len(fields) == 2 and fields[0].lstrip("+-").isdigit() and fields[1].isdigit()
