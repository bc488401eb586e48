"""Requested columns of a file of numbers, the format of the file, and the units of its columns."""

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import attrs

from historysim.basics.fields import Key
from historysim.basics.units import conversion_factor, is_common, is_unit
from historysim.basics.wording import MOST_QUOTED, format_value, quote
from historysim.errors import InputError, field_error

if TYPE_CHECKING:
    from historysim.basics.arguments import Booleans, Floats, Integers
    from historysim.tables.time_bases import TimeBase


def _is_whole(value: object, minimum: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= minimum


def _is_string(text: object) -> bool:
    return isinstance(text, str) and bool(text.strip())


_A_NAME = Key(
    lambda name: _is_string(name) or _is_whole(name, 1), "a name, or a position counted from 1"
)
_A_COUNT = Key(lambda count: _is_whole(count, 1), "an integer of 1 or more")
# Validator of keys that decide what happens to unusable samples.
REFUSE_OR_DROP = Key(lambda word: word in {"refuse", "drop"}, "'refuse' or 'drop'")


@attrs.frozen
class Column:
    """A column of a file."""

    #: Its name, or its position in a text file, counted from 1. Nested names are a path:
    #: ``"run.force"`` in JSON and MATLAB files, ``"run/force"`` in HDF5, netCDF and TDMS files.
    column: str | int = attrs.field(validator=_A_NAME)
    #: The unit of its values; by default the unit that the file names, else SI.
    unit: str | None = attrs.field(
        default=None, validator=Key(_is_string, "a string that is not blank")
    )
    #: Which one, counted from 1, of the columns with this name in the header of a text file.
    occurrence: int | None = attrs.field(default=None, validator=_A_COUNT)
    #: which column of a matrix, counted from 1
    index: int | None = attrs.field(default=None, validator=_A_COUNT)

    def __attrs_post_init__(self) -> None:
        """Check that the keys select one column."""
        if isinstance(self.column, int) and (self.occurrence, self.index) != (None, None):
            raise field_error("a position is one column already; expected it alone", "column")


def _is_delimiter(text: object) -> bool:
    return (
        isinstance(text, str)
        and len(text) == 1
        and text not in "\r\n\"'.+-\0"
        and not text.isalnum()
    )


def _check_decimal(layout: "Format", attribute: "attrs.Attribute[str]", value: str) -> None:
    if not isinstance(value, str) or value not in {".", ","}:
        raise field_error(f'{format_value(value)}; expected "." or ","', attribute.name)
    if value == layout.delimiter:
        raise field_error(
            f"{value!r} is also the delimiter; expected another character", attribute.name
        )


def _is_encoding(name: object) -> bool:
    if not isinstance(name, str):
        return False
    try:
        return "1".encode(name).decode(name) == "1"
    except (LookupError, ValueError):
        return False


def _is_comment(text: object) -> bool:
    return text == "" or (
        _is_string(text) and not str(text)[0].isalnum() and str(text)[0] not in "+-.,"
    )


# without slots: subclasses that add the file name have a second base class, and two bases with
# slots do not combine
@attrs.frozen(kw_only=True, slots=False)
class Format:
    """Format of a file of numbers.

    Attributes
    ----------
    delimiter : str, optional
        The character between two values of a text; ``" "`` is any white space. Detected by default.
    decimal : str
        The decimal sign of a text, ``"."`` or ``","``.
    header : int, optional
        The line of a text that names the columns, counted from 1; 0 if there is no header. By
        default the first line that holds all requested names. A header given by its line may have
        fewer names than there are columns; they name the first columns.
    encoding : str, optional
        The encoding of a text or of JSON. By default UTF-8, or UTF-16 if the byte order mark of a
        text indicates it; other texts are read as Windows text (cp1252).
    comment : str
        The characters that start a comment line in a text; empty if there are no comments.
    transposed : bool, optional
        True if each row of a matrix is a channel and each column a sample. By default a matrix with
        more rows than columns has one sample per row, and other matrices are refused.
    block : int, optional
        The table to read from a text with several tables, counted from 1. By default the only one
        that has the columns.
    broken : str
        ``"drop"`` leaves out broken rows of a text; ``"refuse"`` makes them errors.
    sheet : str or int, optional
        The sheet of an Excel file, by its name or its number from 1. By default the only sheet that
        is not empty.

    Raises
    ------
    InputError
        Any other value.
    """

    delimiter: str | None = attrs.field(
        default=None, validator=Key(_is_delimiter, 'one character, as in ",", ";" or "\\t"')
    )
    decimal: str = attrs.field(default=".", validator=_check_decimal)
    header: int | None = attrs.field(
        default=None,
        validator=Key(
            lambda line: _is_whole(line, 0), "the number of a line, or 0 if there is no header"
        ),
    )
    encoding: str | None = attrs.field(
        default=None,
        validator=Key(_is_encoding, 'an encoding such as "utf-8", "utf-16" or "latin-1"'),
    )
    comment: str = attrs.field(
        default="#",
        validator=Key(
            _is_comment, 'the characters that start a comment, such as "#", or "" without comments'
        ),
    )
    transposed: bool | None = attrs.field(
        default=None, validator=Key(lambda value: isinstance(value, bool), "true or false")
    )
    block: int | None = attrs.field(
        default=None,
        validator=Key(
            lambda number: _is_whole(number, 1),
            "the number of one block, counted from 1; to join blocks, remove the lines between them",
        ),
    )
    broken: str = attrs.field(default="refuse", validator=REFUSE_OR_DROP)
    sheet: str | int | None = attrs.field(default=None, validator=_A_NAME)


class MissingValueError(InputError):
    """A missing value in a column that must not have any."""


@attrs.frozen(eq=False)
class Table:
    """Columns of SI numbers."""

    columns: "dict[str, Floats]"  #: (rows,) The values in SI, NaN where missing
    units: dict[str, str]  #: the SI unit of each column
    #: (rows,) The line number of each row in a text, counted from 1
    lines: "Integers | None" = None
    file_rows: tuple[int, ...] = ()  #: the number of rows of each file
    notices: tuple[str, ...] = ()  #: remarks on the reading of the file, for the user
    #: (rows,) Times [s] of columns with different time bases, which were joined by time; None for
    #: other columns.
    time: "Floats | None" = None
    #: (rows,) Rows within the times of all joined columns; others have NaN
    inside: "Booleans | None" = None

    def place(self, row: int) -> str:
        """Return the location of a row (index from 0) in the file: ``"row 3"`` or ``"line 7"``."""
        return f"row {row + 1}" if self.lines is None else f"line {self.lines[row]}"


@attrs.frozen
class Listing:
    """Description of a column as strings: reference in TOML, unit in the file, number of values, first value."""

    column: str
    unit: str
    values: str
    first_value: str


@attrs.frozen(eq=False)
class FileColumn:
    """A column in the unit of the file."""

    name: str  #: label in messages
    values: "Floats"  #: (rows,) Values in the unit of the file, finite, or NaN where missing
    #: units that the file states: none, one, or one in each of several positions
    units: tuple[str, ...] = ()
    base: "TimeBase | None" = None  #: start and interval of its samples, if the file states them


# ---- units ----

# "Force.(kN)", "Force [kN] filtered", "Force / kN"; a number in brackets is an index, not a unit
_BRACKETS = re.compile(r"\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\]")
_FULL_WIDTH = str.maketrans("（）［］【】／", "()[][]/")  # brackets of Chinese and Japanese headers
_MARKS = frozenset("([/（［【／")  # a name with a unit contains one of them
_SLASH = re.compile(r"\s/\s+([^\s/]+)\s*$")
# tolerance between factors of one unit that are calculated from different definitions
_ROUNDING = 1e-12


def field_unit(name: str) -> str | None:
    """Return the unit in a name: in its last brackets, or after a slash between spaces at its end; None without one."""
    return split_unit(name)[1]


def unit_in_name(label: str, si: str) -> str | None:
    """Return the non-SI unit at the end of a name such as ``Fx_mN``; None without one."""
    unit = label.strip("'").rpartition("_")[2]
    return unit if is_common(unit) and factor_or_none(unit, si) not in {None, 1.0} else None


def split_unit(name: str) -> tuple[str, str | None]:
    """Return a name without its unit, and the unit: ``("Force", "kN")`` for ``"Force [kN]"``; None without one."""
    # shortcut, since all values of many lines are searched for the header
    if _MARKS.isdisjoint(name):
        return name, None
    half_width = name.translate(_FULL_WIDTH)
    matches = [*_BRACKETS.finditer(half_width)] or [*_SLASH.finditer(half_width)]
    unit = next(filter(None, matches[-1].groups()), "").strip() if matches else ""
    if not re.search(r"[^\W\d_]|[%°]", unit):
        return name, None
    start, stop = matches[-1].span()
    return (name[:start] + name[stop:]).strip(), unit


def fit_unit(unit: str, si_units: Sequence[str]) -> tuple[str, float]:
    """Return the first compatible SI unit and its conversion factor; InputError if no unit is compatible."""
    problems = []
    for si in si_units:
        try:
            return si, conversion_factor(unit, si)
        except InputError as error:
            problems.append(error)
    if len(problems) == 1:
        raise problems[0]
    raise InputError(
        f"{quote(unit)} converts to none of {', '.join(si_units)}; expected a unit that does"
    )


def resolve_unit(
    explicit: str | None, units: Sequence[str], si_units: Sequence[str], column: str
) -> tuple[str, float]:
    """Return the SI unit of a column, one of ``si_units``, and its conversion factor.

    An explicit unit takes precedence over the file. Without any unit, values are in the first of
    ``si_units``.

    Raises InputError: an incompatible unit; in the file also different or unknown units.
    """
    if explicit is not None:
        return fit_unit(explicit, si_units)
    if not units:
        return si_units[0], 1.0
    if unknown := [unit for unit in units if not is_unit(unit)]:
        # the name of the column may quote it already
        unit_text = (
            quote(unknown[0]) if len(column) + len(unknown[0]) <= MOST_QUOTED else "its unit"
        )
        raise InputError(
            f'{column}: {unit_text} is not a known unit; set one, as in unit = "{si_units[0]}"'
        )
    file_unit, *other_units = units
    try:
        si, factor = fit_unit(file_unit, si_units)
    except InputError as error:
        weight = f'; the reading of a balance in {file_unit} is a force in {file_unit}f: set unit = "{file_unit}f"'
        hint = weight if "N" in si_units and factor_or_none(file_unit, "kg") else ""
        raise InputError(f"{column}: {error}{hint}") from error
    if conflict := next((unit for unit in other_units if not _is_same(unit, si, factor)), None):
        raise InputError(
            f"{column} has two units in the file, {quote(file_unit)} and {quote(conflict)}; expected one"
        )
    return si, factor


def conflicting_unit(explicit: str, units: Sequence[str], si_units: Sequence[str]) -> str | None:
    """Return the first unit in a file that differs from the explicit one, or None."""
    si, factor = fit_unit(explicit, si_units)
    return next((unit for unit in units if is_unit(unit) and not _is_same(unit, si, factor)), None)


def factor_or_none(unit: str, si: str) -> float | None:
    """Return the factor from a unit to an SI unit; None if they are incompatible."""
    try:
        return conversion_factor(unit, si)
    except InputError:
        return None


def _is_same(unit: str, si: str, factor: float) -> bool:
    own_factor = factor_or_none(unit, si)
    return own_factor is not None and math.isclose(own_factor, factor, rel_tol=_ROUNDING)
