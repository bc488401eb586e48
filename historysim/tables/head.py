"""The first lines of a text: where a table begins, what stands between its values, and what its columns are called."""

import json
import re
from collections import Counter
from collections.abc import Collection, Sequence

import attrs

from historysim.basics.units import is_common
from historysim.basics.wording import counted, listed, nearest
from historysim.errors import InputError
from historysim.tables.columns import Column, Format, field_unit, split_unit
from historysim.tables.lines import (
    Line,
    brief,
    like_a_number,
    like_a_value,
    longest_run,
    namings,
    number,
    places_of,
    runs,
    split_quantity,
    units_in_line,
    width_of,
    without_blank_end,
)

SEARCHED = 1000  # lines in which a header is looked for

_DELIMITERS = ("\t", ";", "|", ",", " ")  # in the order of preference
_BRACKETED_LINE = re.compile(r"\s*[\[(]")
_TWO_NUMBERS = re.compile(r"\d([;,\t| ])\s*(?=[+-]?[.\d])")


@attrs.frozen
class Heading:
    """What is known of a table in a text."""

    delimiter: str  #: what stands between two values
    above: int  #: the number of lines above the first row
    width: int  #: the number of values in a row
    names: tuple[str, ...] = ()  #: what the header says, empty without one
    brackets: tuple[str, ...] = ()  #: the units of a line below the header, in brackets, empty without one
    mismatch: str = ""  #: why the names cannot be trusted to stand over their own columns, empty if they do

    def place(self, column: Column) -> int:
        """Return the index of a column.

        An InputError where there is none, or several, or it may not stand below its name.
        """
        if column.index is not None:
            raise InputError(
                f"index = {column.index} counts the columns of a matrix, but this is a text; expected the name of the "
                "column, or its position as in { column = 3 }"
            )
        name = column.column
        if isinstance(name, int):
            if name > self.width:
                raise InputError(f"there is no column {name}; the rows have {self.width} values")
            if self.mismatch and column.unit is None and any(map(field_unit, self.names)):
                raise InputError(f'{self.mismatch}; and say the unit of column {name}, as in unit = "N"')
            return name - 1
        places = places_of(name, self.names, self.brackets)
        if len(places) < (column.occurrence or 1):
            raise no_such_column(column, self.names, self.brackets)
        if self.mismatch:
            raise InputError(self.mismatch)
        if column.occurrence is None and len(places) > 1:
            full = ", ".join(f"{self.names[place]!r} at position {place + 1}" for place in places)
            raise InputError(
                f"{name!r} may be any of the columns {full}; expected the whole name of one, or its position, as in "
                f"{{ column = {places[-1] + 1} }}"
            )
        return places[(column.occurrence or 1) - 1]

    def label(self, place: int) -> str:
        """Return what a message calls a column."""
        name = "" if self.mismatch or place >= len(self.names) else self.names[place]
        return repr(name) if name else str(place + 1)

    def units(self, place: int) -> tuple[str, ...]:
        """Return the units that the header has for a column: none, one, or one in each of two lines."""
        if self.mismatch:
            return ()
        texts = [line[place] for line in (self.names, self.brackets) if place < len(line)]
        return tuple(unit for unit in map(field_unit, texts) if unit)

    def title(self, place: int) -> str:
        """Return name and unit of a column, as a message shows what there is."""
        name = self.names[place] if place < len(self.names) and not self.mismatch else ""
        below = self.brackets[place] if place < len(self.brackets) and not self.mismatch else ""
        return f"{name} {below}".strip() or f"column {place + 1}"

    def references(self) -> list[str]:
        """Return all columns as they are asked for, in TOML."""
        total, before = Counter(self.names), Counter[str]()
        references = []
        for place in range(self.width):
            name = self.names[place] if place < len(self.names) else ""
            before[name] += 1
            quoted = json.dumps(name, ensure_ascii=False)
            if self.mismatch or not name:
                under = f" # under {name!r}" if name else ""
                references.append(f"{{ column = {place + 1} }}{under}")
            elif total[name] == 1:
                references.append(quoted)
            else:
                references.append(f"{{ column = {quoted}, occurrence = {before[name]} }}")
        return references


def _is_named(column: Column, names: Sequence[str], brackets: Sequence[str] = ()) -> bool:
    return len(places_of(str(column.column), names, brackets)) >= (column.occurrence or 1)


def no_such_column(column: Column, names: Sequence[str], brackets: Sequence[str] = ()) -> InputError:
    """Return the error that a header does not name a column."""
    name = str(column.column)
    if count := len(places_of(name, names, brackets)):
        times = "once" if count == 1 else f"{count} times"
        return InputError(f"there is no occurrence {column.occurrence} of column {name!r}; the header names it {times}")
    known = [known for known in dict.fromkeys(names) if known]
    # a name in other letters, or without its unit, is near
    plain = {split_unit(each)[0].casefold(): each for each in reversed(known)}
    meant = plain.get(split_unit(name)[0].casefold())
    near = nearest(name, known) if meant is None else f"did you mean {meant!r}?"
    return InputError(f"there is no column {name!r}; {_no_names(name, known) or near}")


def _no_names(name: str, known: Sequence[str]) -> str:
    """Return why words of a header name no columns, or a name is none; empty where they may."""
    numbers = sum(map(like_a_number, known))
    if known and numbers == len(known):
        return (
            f"the line of names has the numbers {', '.join(known[:3])}{', …' if numbers > 3 else ''}: without a header "
            "say header = 0, and name columns by position, as { column = 1 }"
        )
    if numbers > len(known) / 2:
        return f"{known[0]!r} has numbers behind it in its line; expected one line for each sample: transpose the file"
    if len(known) == 1 and (other := next((each for each in ",;\t|" if known[0].count(each) > 1), None)):
        return f"expected the delimiter {other!r}, which stands in the header: {brief(known[0])}"
    if name.isdecimal():
        return f"a position has no quotes, as {{ column = {name} }}; the names are {listed(known)}"
    value, _, unit = name.partition(" ")
    if like_a_number(value) and is_common(unit):
        return f'a value that does not change is {{ constant = "{name}" }}; the names are {listed(known)}'
    return ""


@attrs.frozen
class Head:
    """The first lines of a text, or of a part of it."""

    lines: list[Line]  #: those that are not blank
    layout: Format  #: what is known of the text

    @classmethod
    def of(cls, text: Sequence[str], layout: Format, begin: int = 0, end: int | None = None) -> "Head":
        """Return the first lines of a text, or of a part between two lines; an InputError where all are blank."""
        lines = []
        for line_number, line in enumerate(text[begin : min(begin + SEARCHED, end or len(text))], begin + 1):
            bare = line.lstrip()
            is_comment = bool(layout.comment) and bare.startswith(layout.comment)
            bare = bare.removeprefix(layout.comment) if is_comment else bare
            if bare.strip():
                lines.append(Line(line_number, bare if is_comment else line, is_comment))
        if not lines:
            raise InputError("is empty; expected a header line with the names of the columns")
        return cls(lines, layout)

    def heading(self, columns: Sequence[Column]) -> Heading:
        """Return the heading of the table that holds some columns; without any, of what looks most like a table.

        An InputError where none does, or lines can be read in two ways.
        """
        named = [column for column in columns if isinstance(column.column, str)]
        if self.layout.header == 0 and named:
            raise InputError(
                f"has no header, as header = 0 says, and so no column {named[0].column!r}; expected positions, such as "
                "{ column = 1 }"
            )
        if named:
            heading = self._below_names(named)
        elif self.layout.header:
            heading = self._below(self._header_line(), self._likely_delimiter())
        else:
            heading = self._of_numbers()
            if columns and self.layout.delimiter is None:
                self._check_that_it_is_clear(heading)
        if columns and not self.layout.header:
            self._check_that_nothing_is_left_out(heading)
        return heading

    def heading_of(self, known: Collection[str]) -> Heading:
        """Return the heading with the most of some names, whatever units stand beside them.

        An InputError where no line has any, or names may stand over other columns than their own.
        """
        most, header = 0, None
        for delimiter in self._delimiters if self.layout.header != 0 else ():
            for line in self._candidates():
                count = sum(split_unit(name)[0] in known for name in line.fields(delimiter))
                if count > most:
                    most, header = count, (line, delimiter)
        if header is None:
            raise InputError(
                f"has no header line; expected one with {', '.join(known)}, or some of them; the first line is "
                f"{brief(self.lines[0].text.strip())}"
            )
        heading = self._below(*header)
        if heading.mismatch:
            raise InputError(_ragged_below(heading, self._rows(heading.above)[0]))
        return heading

    @property
    def _delimiters(self) -> Sequence[str]:
        given = self.layout.delimiter
        return [each for each in _DELIMITERS if each != self.layout.decimal] if given is None else [given]

    def _rows(self, above: int = 0) -> list[Line]:
        return [line for line in self.lines if line.number > above and not line.is_comment]

    def _candidates(self) -> list[Line]:
        """Return the lines that may be the header; comments come last."""
        if self.layout.header:
            return [self._header_line()]
        return sorted(self.lines, key=lambda line: line.is_comment)

    def _header_line(self) -> Line:
        for line in self.lines:
            if line.number == self.layout.header:
                return line
        raise InputError(
            f"line {self.layout.header} is no header; expected the number of a line that is not blank, among the first "
            f"{SEARCHED:,}"
        )

    def _below_names(self, columns: Sequence[Column]) -> Heading:
        """Return the heading in the first line that holds all names; comments come last."""
        headings = []
        nearly: list[str] = []
        stems = {stem for column in columns for stem in (str(column.column), split_unit(str(column.column))[0])}
        # most lines are rows of numbers, which have no such letters
        letters = [{letter for letter in stem if not letter.isspace()} for stem in stems]
        candidates = [line for line in self._candidates() if any(each.issubset(line.text) for each in letters)]
        for delimiter in self._delimiters:
            for line in candidates:
                for names in namings(line.text, line.fields(delimiter), delimiter):
                    if stems.isdisjoint([*names, *filter(None, (split_unit(name)[0] for name in names))]):
                        continue
                    heading = self._below(line, delimiter, names)
                    absent = [column for column in columns if not _is_named(column, heading.names, heading.brackets)]
                    if not absent:
                        headings.append(heading)
                    elif len(absent) < len(columns):
                        nearly = nearly or names
        if not headings:
            names = nearly or self._likely_names()
            raise next(no_such_column(column, names) for column in columns if not _is_named(column, names))
        return next((heading for heading in headings if self._fits(heading, columns)), headings[0])

    def _likely_names(self) -> list[str]:
        if self.layout.header:
            return self._header_line().fields(self._likely_delimiter())
        try:
            heading = self._of_numbers()
        except InputError:
            return self.lines[0].fields(self._likely_delimiter())
        return list(heading.names) or self.lines[0].fields(heading.delimiter)

    def _fits(self, heading: Heading, columns: Sequence[Column]) -> bool:
        """Return whether there are numbers, or nothing, below the names."""
        rows = self._rows(heading.above)
        row = rows[0].fields(heading.delimiter) if rows else []
        if heading.mismatch or not row:
            return False
        places = [heading.place(attrs.evolve(column, occurrence=column.occurrence or 1)) for column in columns]
        decimal = self.layout.decimal
        return all(number((split_quantity(row[at]) or row[at:])[0], decimal) is not None for at in places)

    def _below(self, header: Line, delimiter: str, names: Sequence[str] | None = None) -> Heading:
        """Return the heading of the table below a header line, with these names or those that suit its rows."""
        above = header.number
        rows = self._rows(above)
        brackets = units_in_line(rows[0].fields(delimiter)) if rows else []
        if brackets:
            above = rows.pop(0).number
        if names is None:
            width = len(rows[0].fields(delimiter)) if rows else 0
            ways = namings(header.text, header.fields(delimiter), delimiter)
            names = next((way for way in ways if len(way) == width), ways[0])
        names = without_blank_end(list(names))
        heading = Heading(delimiter, above, len(names), tuple(names), tuple(brackets))
        first = rows[0].fields(delimiter) if rows else []
        if not first or len(without_blank_end(first)) <= len(names) <= len(first):
            return heading
        if self.layout.header and len(names) < len(first):
            # whoever gives the line has seen that the names stand over the first columns
            unnamed = ("",) * (len(first) - len(names))
            return attrs.evolve(heading, width=len(first), names=(*names, *unnamed))
        problem = (
            f"{_ragged_below(heading, rows[0])}; if the line is right, "
            "the header has a name too many or too few, and the others may stand over the wrong columns: give columns "
            f"by position, as in {{ column = 3 }}, or say header = {header.number} if its names are those of the first "
            "columns"
        )
        return attrs.evolve(heading, width=width_of(rows, delimiter, len(first)), mismatch=problem)

    def _likely_delimiter(self) -> str:
        """Return the delimiter that splits the longest run of lines into equally many values, some of them numbers."""
        rows = self._rows()
        longest = {delimiter: longest_run(rows, delimiter) for delimiter in self._delimiters}
        # the first in the order of preference wins, unless another splits more than twice as many lines
        most = max(len(run) for run in longest.values())
        return next(delimiter for delimiter, run in longest.items() if 2 * len(run) >= most)

    def _of_numbers(self) -> Heading:
        """Return the heading of the table that begins where the numbers begin."""
        delimiter = self._likely_delimiter()
        run = longest_run(self._rows(), delimiter) or longest_run(self._rows(), delimiter, least=1)
        if not run:
            raise InputError("has no rows of numbers; expected one line for each sample")
        values = [line.fields(delimiter) for line in run]
        width = len(values[0])
        # where at least half of the lines have numbers
        numeric = [i for i in range(width) if 2 * sum(like_a_value(row[i]) for row in values) >= len(values)]

        def is_first(line: Line) -> bool:
            row = line.fields(delimiter)
            return len(row) == width and numeric != [] and all(not row[i] or like_a_value(row[i]) for i in numeric)

        return self._above(next(filter(is_first, self._rows()), run[0]), delimiter, width)

    def first_table(self) -> tuple[Heading, list[str]] | None:
        """Return the heading and the first row of the first table, found by the looks of its lines; None without one.

        A table has two or more rows, or one below a header. Its rows begin with a number; where white space does not
        delimit its values, they may begin with a text if a header is above two of them. Two values, a text and a
        number, are no row: so keys and values are written.
        """
        delimiter = self._likely_delimiter()
        rows = self._rows()
        longest = len(longest_run(rows, delimiter))
        least = 2 if longest else 1
        for begin, end in runs(rows, delimiter, least):
            fields = rows[begin].fields(delimiter)
            begins_with_a_number = like_a_value(next(filter(None, fields)))
            if len(fields) == 2 and not begins_with_a_number:
                continue
            heading = self._above(rows[begin], delimiter, len(fields))
            if begins_with_a_number:
                is_table = end - begin > 1 or bool(heading.names and not heading.mismatch) or longest == 1
            else:
                is_table = delimiter != " " and end - begin > 1 and bool(heading.names and not heading.mismatch)
            if is_table:
                return heading, fields
        return None

    def _above(self, first: Line, delimiter: str, width: int) -> Heading:
        """Return the heading that stands above the first row of a table."""
        before = [line for line in self.lines if line.number < first.number]
        if before and self.layout.header != 0:
            header = before[-1]
            if len(before) > 1 and units_in_line(header.fields(delimiter)):
                above = before[-2].fields(delimiter)
                is_header = len(above) > 1 or width == 1 or _BRACKETED_LINE.match(header.text)
                header = before[-2] if is_header and not any(map(like_a_number, above)) else header
            names = header.fields(delimiter)
            if len(names) >= min(width, 2) and not any(map(like_a_number, names)):
                return self._below(header, delimiter)
        above_rows = first.number - 1
        return Heading(delimiter, above_rows, width_of(self._rows(above_rows), delimiter, width))

    def _check_that_it_is_clear(self, heading: Heading) -> None:
        """Refuse values that would be two with another delimiter, or one with another decimal sign."""
        rows = [(line.number, line.fields(heading.delimiter)) for line in self._rows(heading.above)]
        unclear = [
            (line_number, field)
            for line_number, fields in rows
            for field in fields
            if any(match.group(1) != self.layout.decimal for match in _TWO_NUMBERS.finditer(field))
        ]
        if not heading.names and heading.delimiter == "," and all(_like_a_decimal_comma(fields) for _, fields in rows):
            unclear = [(rows[0][0], ",".join(rows[0][1]))]
        for line_number, field in unclear[:1]:
            raise InputError(
                f"line {line_number}: {brief(field)} may be one value or two; say what stands between values, as in "
                'delimiter = ";", and the decimal sign if it is a comma, as in decimal = ","'
            )

    def _check_that_nothing_is_left_out(self, heading: Heading) -> None:
        """Refuse a row above the header, and where there is no header, any line of numbers above the rows."""
        for line in self._rows():
            if line.number > heading.above:
                break
            fields = line.fields(heading.delimiter)
            filled = [field for field in fields if field]
            is_wide = len(fields) == heading.width or not heading.names or bool(heading.mismatch)
            if is_wide and filled and all(map(like_a_number, filled)):
                raise InputError(
                    f"line {line.number} looks like a row of numbers, but the table begins below line {heading.above}; "
                    f"if so, say header = {heading.above}"
                )


def ragged(line_number: int, count: int, expected: str) -> str:
    """Return what to say of a row that has another number of values than expected."""
    values = counted(count, "value", "values")
    return (
        f"line {line_number}: {values} where {expected}; expected one value for each column, and the delimiter of the "
        "header"
    )


def _ragged_below(heading: Heading, row: Line) -> str:
    return ragged(row.number, len(row.fields(heading.delimiter)), f"the header names {len(heading.names)} columns")


def _like_a_decimal_comma(fields: list[str]) -> bool:
    return len(fields) == 2 and fields[0].lstrip("+-").isdigit() and fields[1].isdigit()
