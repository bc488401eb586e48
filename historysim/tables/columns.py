"""What is wanted of a file of numbers, how the file is written, and the units of its columns."""

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import attrs

from historysim.basics.fields import Key
from historysim.basics.units import conversion_factor, is_common, is_unit
from historysim.basics.wording import shown
from historysim.errors import InputError, misfit

if TYPE_CHECKING:
    from historysim.basics.arguments import Floats, Integers


def _is_whole(value: object, least: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


def _is_string(text: object) -> bool:
    return isinstance(text, str) and bool(text.strip())


_A_NAME = Key(lambda name: _is_string(name) or _is_whole(name, 1), "a name, or a position counted from 1")
_A_COUNT = Key(lambda count: _is_whole(count, 1), "an integer of 1 or more")
# Validator of what becomes of samples that cannot be used.
REFUSE_OR_DROP = Key(lambda word: word in {"refuse", "drop"}, "'refuse' or 'drop'")


@attrs.frozen
class Column:
    """A column of a file."""

    #: Its name, or its position in a text file, counted from 1. Nested names are a path: ``"run.force"`` in JSON and
    #: MATLAB files, ``"run/force"`` in HDF5, netCDF and TDMS files.
    column: str | int = attrs.field(validator=_A_NAME)
    #: The unit of its values; by default the unit that the file names, else SI.
    unit: str | None = attrs.field(default=None, validator=Key(_is_string, "a string that is not blank"))
    #: Which one, counted from 1, of the columns with this name in the header of a text file.
    occurrence: int | None = attrs.field(default=None, validator=_A_COUNT)
    index: int | None = attrs.field(default=None, validator=_A_COUNT)  #: which column of a matrix, counted from 1

    def __attrs_post_init__(self) -> None:
        """Check that it is one column."""
        if isinstance(self.column, int) and (self.occurrence, self.index) != (None, None):
            raise misfit("a position is one column already; expected it alone", "column")


def _is_delimiter(text: object) -> bool:
    return isinstance(text, str) and len(text) == 1 and text not in "\r\n\"'.+-\0" and not text.isalnum()


def _check_decimal(layout: "Format", attribute: "attrs.Attribute[str]", value: str) -> None:
    if not isinstance(value, str) or value not in {".", ","}:
        raise misfit(f'{shown(value)}; expected "." or ","', attribute.name)
    if value == layout.delimiter:
        raise misfit(f"{value!r}, as the delimiter; expected another sign", attribute.name)


def _is_encoding(name: object) -> bool:
    if not isinstance(name, str):
        return False
    try:
        return "1".encode(name).decode(name) == "1"
    except (LookupError, ValueError):
        return False


def _is_comment(text: object) -> bool:
    return text == "" or (_is_string(text) and not str(text)[0].isalnum() and str(text)[0] not in "+-.,")


# whoever adds the name of the file to this inherits it beside other bases, and two with slots do not mix
@attrs.frozen(kw_only=True, slots=False)
class Format:
    """How the numbers are written in a file.

    Attributes
    ----------
    delimiter : str, optional
        What stands between two values of a text; ``" "`` is any white space. Found when not given.
    decimal : str
        The decimal sign of a text, ``"."`` or ``","``.
    header : int, optional
        The line of a text that names the columns, counted from 1; 0 where there is none. When not given, it is the
        first line that holds all names asked for. When given, it may have fewer names than there are columns: they
        are those of the first ones.
    encoding : str, optional
        The encoding of a text or of JSON. When not given, UTF-8, or UTF-16 where a mark at the beginning of a text
        says so; a text that is neither is read as one of Windows, cp1252.
    comment : str
        What a line of comment in a text starts with; empty where there are none.
    transposed : bool, optional
        Whether the rows of a matrix are what is recorded, and its columns the samples. When not given, a matrix with
        more rows than columns has a sample in each row; any other is refused.
    block : int, optional
        The table to read from a text with several tables, counted from 1. When not given, exactly one of them must
        have the columns.
    broken : str
        ``"drop"`` leaves out rows of a text that are broken; ``"refuse"`` makes them errors.
    sheet : str or int, optional
        Which sheet of an Excel file, by its name or its number from 1. When not given, there must be one alone that
        is not empty.

    Raises
    ------
    InputError
        Anything else.
    """

    delimiter: str | None = attrs.field(
        default=None, validator=Key(_is_delimiter, 'one character, as in ",", ";" or "\\t"')
    )
    decimal: str = attrs.field(default=".", validator=_check_decimal)
    header: int | None = attrs.field(
        default=None,
        validator=Key(lambda line: _is_whole(line, 0), "the number of a line, or 0 where there is no header"),
    )
    encoding: str | None = attrs.field(
        default=None, validator=Key(_is_encoding, 'an encoding such as "utf-8", "utf-16" or "latin-1"')
    )
    comment: str = attrs.field(
        default="#", validator=Key(_is_comment, 'what a comment starts with, such as "#", or "" where there are none')
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
    """A value that is missing where none may be."""


@attrs.frozen(eq=False)
class Table:
    """Columns of SI numbers."""

    columns: "dict[str, Floats]"  #: (rows,) The values in SI, NaN where missing
    units: dict[str, str]  #: the SI unit of each
    lines: "Integers | None" = None  #: (rows,) The line that each row stands on, counted from 1, in a text
    file_rows: tuple[int, ...] = ()  #: the number of rows of each file
    notices: tuple[str, ...] = ()  #: what a user has to know of how the file was read

    def place(self, row: int) -> str:
        """Return where in the file a row, counted from 0, stands."""
        return f"row {row + 1}" if self.lines is None else f"line {self.lines[row]}"


@attrs.frozen
class Listing:
    """One column as texts: how TOML asks for it, the unit that the file names, how many values, and the first."""

    column: str
    unit: str
    values: str
    first: str


@attrs.frozen(eq=False)
class FileColumn:
    """A column as it stands in the file."""

    name: str  #: what a message calls it
    values: "Floats"  #: (rows,) Its values in the unit of the file, finite, or NaN where missing
    units: tuple[str, ...] = ()  #: what the file says that its unit is: nothing, once, or in several places


# ---- units ----

# "Force.(kN)", "Force [kN] filtered", "Force / kN"; a number in brackets counts something, and is no unit
_BRACKETS = re.compile(r"\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\]")
_FULL_WIDTH = str.maketrans("（）［］【】／", "()[][]/")  # brackets of Chinese and Japanese headers
_MARKS = frozenset("([/（［【／")  # one of them stands in a name that has a unit
_SLASH = re.compile(r"\s/\s+([^\s/]+)\s*$")
# factors of one unit, reached in different ways
_ROUNDING = 1e-12


def field_unit(name: str) -> str | None:
    """Return the unit in a name: in the last brackets, or at its end after a slash between spaces."""
    return split_unit(name)[1]


def unit_in_name(label: str, si: str) -> str | None:
    """Return the unit that a name such as ``Fx_mN`` ends with, other than an SI unit; None where it does not."""
    unit = label.strip("'").rpartition("_")[2]
    return unit if is_common(unit) and factor_or_none(unit, si) not in {None, 1.0} else None


def split_unit(name: str) -> tuple[str, str | None]:
    """Return a name without its unit, and the unit: ``("Force", "kN")`` for ``"Force [kN]"``; None without one."""
    # the header is looked for in all values of many lines
    if _MARKS.isdisjoint(name):
        return name, None
    half_width = name.translate(_FULL_WIDTH)
    matches = [*_BRACKETS.finditer(half_width)] or [*_SLASH.finditer(half_width)]
    unit = next(filter(None, matches[-1].groups()), "").strip() if matches else ""
    if not re.search(r"[^\W\d_]|[%°]", unit):
        return name, None
    start, end = matches[-1].span()
    return (name[:start] + name[end:]).strip(), unit


def fitting(unit: str, wanted: Sequence[str]) -> tuple[str, float]:
    """Return the first of some SI units that a unit converts to, and the factor; an InputError where there is none."""
    problems = []
    for si in wanted:
        try:
            return si, conversion_factor(unit, si)
        except InputError as error:
            problems.append(error)
    if len(problems) == 1:
        raise problems[0]
    raise InputError(f"{unit!r} converts to none of {', '.join(wanted)}; expected a unit that does")


def settled(explicit: str | None, units: Sequence[str], wanted: Sequence[str], column: str) -> tuple[str, float]:
    """Return the SI unit of a column, one of those wanted, and the factor that takes its values there.

    An explicit unit holds whatever the file says; without a unit from either, values are in the first that is wanted.

    Raises InputError: a unit that does not fit; from the file alone, also units that are not the same, or unknown.
    """
    if explicit is not None:
        return fitting(explicit, wanted)
    if not units:
        return wanted[0], 1.0
    if unknown := [unit for unit in units if not is_unit(unit)]:
        raise InputError(f'{column}: {unknown[0]!r} is not a known unit; give it one, as in unit = "{wanted[0]}"')
    first, *others = units
    try:
        si, factor = fitting(first, wanted)
    except InputError as error:
        weight = f'; the reading of a balance in {first} is a force in {first}f: say unit = "{first}f"'
        hint = weight if "N" in wanted and factor_or_none(first, "kg") else ""
        raise InputError(f"{column}: {error}{hint}") from error
    if other := next((unit for unit in others if not _is_same(unit, si, factor)), None):
        raise InputError(f"{column} has two units in the file, {first!r} and {other!r}; expected one")
    return si, factor


def overridden(explicit: str, units: Sequence[str], wanted: Sequence[str]) -> str | None:
    """Return the first unit in a file that says something else than the one that is given, or None."""
    si, factor = fitting(explicit, wanted)
    return next((unit for unit in units if is_unit(unit) and not _is_same(unit, si, factor)), None)


def factor_or_none(unit: str, si: str) -> float | None:
    """Return the factor that takes numbers in a unit to SI; None where there is none."""
    try:
        return conversion_factor(unit, si)
    except InputError:
        return None


def _is_same(unit: str, si: str, factor: float) -> bool:
    own = factor_or_none(unit, si)
    return own is not None and math.isclose(own, factor, rel_tol=_ROUNDING)
