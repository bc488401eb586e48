"""What is known of a table in a text: what stands between its values, and what its columns are called."""

import json
from collections.abc import Sequence

import attrs

from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.tables.column_units import split_unit, unit_in
from historysim.tables.columns import Column
from historysim.tables.names import places_of


@attrs.frozen
class Heading:
    """What is known of a table in a text."""

    delimiter: str
    """What stands between two values."""
    above: int
    """The number of lines above the first row."""
    width: int
    """The number of values in a row."""
    names: tuple[str, ...] = ()
    """What the header says, empty without one."""
    brackets: tuple[str, ...] = ()
    """The units of a line below the header, in brackets, empty without one."""
    misfit: str = ""
    """Why the names cannot be trusted to stand over their own columns, empty if they do."""

    def place(self, column: Column) -> int:
        """Return the index of a column.

        An InputError where there is none, or several, or it may not stand below its name.
        """
        if column.index is not None:
            raise InputError(
                f"index = {column.index} counts the columns of a matrix, but this is a text; expected the name of the "
                "column, or its position as in { column = 3 }"
            )
        if isinstance(column.column, int):
            return self._place_of_position(column.column, column.unit)
        places = places_of(column.column, self.names, self.brackets)
        if len(places) < (column.occurrence or 1):
            raise no_such_column(column, self.names, self.brackets)
        if self.misfit:
            raise InputError(self.misfit)
        if column.occurrence is None and len(places) > 1:
            if len({self.names[place] for place in places}) > 1:
                full = ", ".join(repr(self.names[place]) for place in places)
                raise InputError(f"{column.column!r} may be any of the columns {full}; expected the whole name of one")
            raise InputError(
                f"the header names column {column.column!r} {len(places)} times, at positions "
                f"{', '.join(str(place + 1) for place in places)}; say which, as in "
                f"{_written(column.column, len(places))} or {{ column = {places[-1] + 1} }}"
            )
        return places[(column.occurrence or 1) - 1]

    def _place_of_position(self, position: int, unit: str | None) -> int:
        if position > self.width:
            raise InputError(f"there is no column {position}; the rows have {self.width} values")
        if self.misfit and unit is None and any(map(unit_in, self.names)):
            raise InputError(f'{self.misfit}; and say the unit of column {position}, as in unit = "N"')
        return position - 1

    def label(self, place: int) -> str:
        """Return what a message calls a column."""
        name = "" if self.misfit or place >= len(self.names) else self.names[place]
        return repr(name) if name else str(place + 1)

    def units(self, place: int) -> tuple[str, ...]:
        """Return the units that the header has for a column: none, one, or one in each of two lines."""
        if self.misfit:
            return ()
        texts = [line[place] for line in (self.names, self.brackets) if place < len(line)]
        return tuple(unit for unit in map(unit_in, texts) if unit)

    def title(self, place: int) -> str:
        """Return name and unit of a column, as a message shows what there is."""
        name = self.names[place] if place < len(self.names) and not self.misfit else ""
        below = self.brackets[place] if place < len(self.brackets) and not self.misfit else ""
        return f"{name} {below}".strip() or f"column {place + 1}"

    def reference(self, place: int) -> str:
        """Return a column as it is asked for, in TOML."""
        name = self.names[place] if place < len(self.names) else ""
        if self.misfit or not name:
            under = f" # under {name!r}" if name else ""
            return f"{{ column = {place + 1} }}{under}"
        several = self.names.count(name) > 1
        return _written(name, self.names[: place + 1].count(name) if several else None)


def is_named(column: Column, names: Sequence[str], brackets: Sequence[str] = ()) -> bool:
    """Return whether a header names a column, as often as it takes."""
    return len(places_of(str(column.column), names, brackets)) >= (column.occurrence or 1)


def no_such_column(column: Column, names: Sequence[str], brackets: Sequence[str] = ()) -> InputError:
    """Return the error that a header does not name a column."""
    name = str(column.column)
    count = len(places_of(name, names, brackets))
    if not count:
        known = [known for known in dict.fromkeys(names) if known]
        # a name in other letters, or without its unit, is near
        plain = {split_unit(each)[0].casefold(): each for each in reversed(known)}
        meant = plain.get(split_unit(name)[0].casefold())
        hint = f"did you mean {meant!r}?" if meant is not None else nearest(name, known)
        return InputError(f"there is no column {name!r}; {hint}")
    times = "once" if count == 1 else f"{count} times"
    return InputError(f"there is no occurrence {column.occurrence} of column {name!r}; the header names it {times}")


def _written(name: str, occurrence: int | None) -> str:
    quoted = json.dumps(name, ensure_ascii=False)
    return quoted if occurrence is None else f"{{ column = {quoted}, occurrence = {occurrence} }}"
