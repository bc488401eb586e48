"""Lines of a text: split values, parse numbers and units, recognise rows and names."""

import csv
import math
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache

import attrs

from historysim.basics.units import is_common
from historysim.tables.columns import factor_or_none, split_unit

# notations of a missing value, in lower case
MISSING = {"", "nan", "+nan", "-nan", "na", "null", "-"}
BATCH_LINES = 2000  # lines that are parsed together: few enough for the processor cache

_QUOTED = re.compile(r'"([^"]*)"|(\S+)')


def split(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    """Split lines that are not blank into values; the delimiter ``" "`` is any white space.

    There are fewer rows than lines if a quoted value extends over several lines. Raises csv.Error:
    an open quote, or a value beyond the size limit of the csv module.
    """
    if delimiter == " ":
        return [
            [quoted or bare for quoted, bare in _QUOTED.findall(line)]
            if '"' in line
            else line.split()
            for line in lines
        ]
    return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True))


def fields(line: str, delimiter: str) -> list[str]:
    """Return the values of one line without surrounding blanks; an empty list if a quote is not closed."""
    try:
        rows = split([line], delimiter)
    except csv.Error:
        return []
    return [field.strip() for field in rows[0]] if len(rows) == 1 else []


# Typographic minus signs, hyphens and dashes that some programs write instead of "-".
_MINUS = str.maketrans(dict.fromkeys("\u2212\u2010\u2011\u2012\u2013\ufe63\uff0d", "-"))
_FORTRAN_EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")
_QUANTITY = re.compile(
    r"([+-]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([^\W\d_].*|[%°].*)", re.DOTALL
)


def plain_notation(text: str) -> str:
    """Return text with ASCII minus signs, and with ``e`` for the exponent letter ``D`` of Fortran."""
    if not text.isascii():
        text = text.translate(_MINUS)
    return _FORTRAN_EXPONENT.sub("e", text) if "D" in text or "d" in text else text


def split_quantity(text: str) -> tuple[str, str] | None:
    """Split a value with its unit, as in ``50 mN``, into number and unit; None for any other text."""
    match = _QUANTITY.fullmatch(plain_notation(text.strip()))
    return (match[1], match[2]) if match and _is_unit(match[2]) else None


@lru_cache(maxsize=1000)
def _is_unit(text: str) -> bool:
    return is_common(text)


def number_in_unit(text: str, decimal: str, unit: str) -> float | None:
    """Return the number of a value with its unit, converted to another unit; NaN if missing, None for other texts.

    A number without a unit gives None, except 0.
    """
    quantity = split_quantity(text)
    if quantity is None:
        bare = number(text, decimal)
        return None if bare else bare
    value = number(quantity[0], decimal)
    factor = factor_or_none(quantity[1], unit)
    return None if value is None or factor is None else value * factor


def number(text: str, decimal: str) -> float | None:
    """Return a finite number; NaN if missing, None for other texts."""
    text = plain_notation(text.strip())
    if text.lower() in MISSING:
        return math.nan
    if not is_plain(text, decimal):
        return None
    try:
        value = float(text.replace(decimal, "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def is_plain(text: str, decimal: str) -> bool:
    """Return True if a text has none of the characters that only Python accepts in numbers, such as ``_``."""
    return "_" not in text and text.isascii() and (decimal == "." or "." not in text)


def brief(text: str) -> str:
    """Quote a value for a message, cut after 40 characters."""
    return repr(text if len(text) <= 40 else text[:40] + "…")


# Marks between thousands: point, comma, apostrophes and any blanks; in India between hundreds of
# thousands, too.
_MARKS = r"[.,'’´`˙٬\s]"
_GROUPED = rf"[+-]?\d{{1,3}}({_MARKS})(?:\d{{2,3}}\1)*\d{{3}}(?:([.,])\d*)?(?:[eE][+-]?\d+)?"
_UNGROUP = "export it without separators between thousands"


def decimal_hint(text: str, decimal: str) -> str:
    """Return the remedy for a number in an unsupported notation; empty for other texts."""
    grouped = re.fullmatch(_GROUPED, plain_notation(text.strip()))
    if grouped and grouped[2] and grouped[1] != grouped[2]:
        return f"; {_UNGROUP}" + (
            "" if grouped[2] == decimal else f', and set decimal = "{grouped[2]}"'
        )
    if decimal == "." and "," in text and number(text, ",") is not None:
        return '; if it has a decimal comma, set decimal = ","'
    if decimal == "," and "." in text and number(text, ".") is not None:
        either = f"; if it is a mark of thousands, {_UNGROUP}" if grouped else ""
        return f'; it has a decimal point, although decimal is ","{either}'
    if grouped:
        return f"; {_UNGROUP}"
    return next(
        (
            f"; {mend}"
            for pattern, mend in _MENDS
            if re.fullmatch(pattern, plain_notation(text.strip()))
        ),
        "",
    )


_SOME = r"\d[\d.,]*(?:[eE][+-]?\d+)?"
_MENDS = (
    (
        rf"\({_SOME}\)",
        "brackets mean a negative number to accountants alone: write it with a minus sign",
    ),
    (rf"{_SOME}-", "write the minus sign before the number"),
    (r"[+-]?\d*\.\d+[+-]\d{3}", "the exponent has no letter: write it as 1.2e-101"),
    (rf"[<>≤≥~≈±]\s*[+-]?{_SOME}", "write the number alone"),
    (rf"['\"]\s*[+-]?{_SOME}['\"]?", "write it without quotation marks"),
    (r"[+-]?(?=.*[^\x00-\x7f])\d+(?:[.,]\d*)?", "write it in the digits 0 to 9"),
    (r"[+-]?\d+_[\d_.,]+", _UNGROUP),
)
_OUT_OF_RANGE = (
    r"(?i)[+-]?(?:inf|infinity|over\w*|ovr?l?d?|o\.?l\.?|range|#+|1\.#(?:inf|ind|qnan).*)"
)
_OF_WORKSHEETS = r"#.*[!?]|#N/A|#N/V"


def fault_hint(text: str) -> str:
    """Return the meaning of a word such as ``OVER`` or ``#N/A`` in place of a number; empty for other words."""
    if re.fullmatch(_OUT_OF_RANGE, text.strip()):
        return ": the channel was out of range"
    return (
        ": a formula of the worksheet failed" if re.fullmatch(_OF_WORKSHEETS, text.strip()) else ""
    )


# -- rows ------------------------------------------------------------------------------------------

_LIKE_A_NUMBER = re.compile(
    rf"[+-]?(?:\d[\d.,]*|\d{{1,3}}(?:{_MARKS}\d{{3}})+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?|[+-]?nan|na|null",
    re.IGNORECASE,
)


@attrs.frozen
class Line:
    """A line that is not blank."""

    number: int  #: counted from 1
    text: str  #: without the comment character
    is_comment: bool

    def fields(self, delimiter: str) -> list[str]:
        """Split the line into values, see `fields`."""
        return fields(self.text, delimiter)


def like_a_number(field: str) -> bool:
    """Return True for a number with any decimal sign, or a notation of a missing value."""
    return bool(_LIKE_A_NUMBER.fullmatch(plain_notation(field)))


def like_a_value(field: str) -> bool:
    """Return True for a number with or without a unit, or a notation of a missing value."""
    return like_a_number(field) or split_quantity(field) is not None


def longest_run(rows: Sequence[Line], delimiter: str, minimum_width: int = 2) -> list[Line]:
    """Return the longest run of lines with equally many values, at least ``minimum_width``, some of them numbers."""
    longest = range(0)
    start = width = 0
    for index, line in enumerate(rows):
        values = line.fields(delimiter)
        if len(values) < minimum_width or not any(map(like_a_value, values)):
            width = 0
            continue
        if len(values) != width:
            start = index
            width = len(values)
        if index + 1 - start > len(longest):
            longest = range(start, index + 1)
    return list(rows[longest.start : longest.stop])


def similar_rows(
    rows: Sequence[Line], delimiter: str, minimum_width: int
) -> Iterable[tuple[int, int]]:
    """Yield start and stop of runs of lines with equally many values and numbers at the same positions."""
    start = 0
    previous: list[int | None] = []
    for index, line in enumerate(rows):
        values = line.fields(delimiter)
        looks = [_look(value) if value else None for value in values]
        is_row = len(values) >= minimum_width and any(looks)
        is_alike = len(looks) == len(previous) and all(
            None in pair or pair[0] == pair[1] for pair in zip(looks, previous, strict=True)
        )
        if previous and not (is_row and is_alike):
            yield start, index
            previous = []
        if is_row and not previous:
            start, previous = index, looks
    if previous:
        yield start, len(rows)


def _look(value: str) -> int:
    """Return 0 for a word, 1 for a number, 2 for a number with a unit."""
    return 1 if like_a_number(value) else 2 * (split_quantity(value) is not None)


def table_width(rows: Sequence[Line], delimiter: str, usual: int) -> int:
    """Return the number of columns, without blank ones caused by delimiters at the ends of lines."""
    values = [line.fields(delimiter) for line in rows]
    return max((len(without_blank_end(row)) for row in values if len(row) == usual), default=usual)


def without_blank_end(values: list[str]) -> list[str]:
    """Remove blank values at the end."""
    while values and not values[-1]:
        values = values[:-1]
    return values


# -- names and units -------------------------------------------------------------------------------

BRACKETED = re.compile(r"\(.*\)|\[.*\]")
# Names between white space: two blanks or a tab apart, a word with units behind it, and all words
# up to a unit.
_WIDE = re.compile(r"\S+(?: \S+)*")
_WITH_UNIT = re.compile(r"\S+(?:\s+(?:\(\S*\)|\[\S*\])(?!\S))*")
_UP_TO_UNIT = re.compile(r"\S.*?[)\]](?!\S)|\S.*\S|\S")


def split_names(line: str, fields: Sequence[str], delimiter: str) -> list[list[str]]:
    """Return possible splits of a header line into names: its values, and with white space also names with blanks.

    These are separated by tabs or two blanks, are words with a unit, or are all words up to a unit.
    """
    splits = [list(fields)]
    if delimiter == " " and len(fields) > 1:
        patterns = _WIDE, _WITH_UNIT, _UP_TO_UNIT
        splits += [
            [" ".join(name.split()) for name in pattern.findall(line)] for pattern in patterns
        ]
    return [names for index, names in enumerate(splits) if names not in splits[:index]]


def find_name(name: str, names: Sequence[str], brackets: Sequence[str] = ()) -> list[int]:
    """Return the indices of a name: of exact matches, else of names that equal it without their unit.

    The unit may be in a line below, ``brackets``.
    """
    exact = [index for index, candidate in enumerate(names) if candidate == name]
    if exact or not name:
        return exact
    stem, unit = split_unit(name)
    indices = []
    for index, candidate in enumerate(names):
        below = split_unit(brackets[index])[1] if index < len(brackets) else None
        if split_unit(candidate)[0] == name or (
            unit is not None and (candidate, below) == (stem, unit)
        ):
            indices.append(index)
    return indices


_LETTER = re.compile(r"[^\W\d_]|[%°]")
_NONE = {"-", "--"}
# in a header these letters are names: time, height, distance, approach, displacement
_TOO_SHORT_FOR_A_UNIT = {"t", "h", "d", "a", "u"}


def units_in_line(fields: Sequence[str]) -> list[str]:
    """Return the units of a line, one for each value, in brackets; an empty list if it is not a line of units.

    Any text in brackets is a unit. Without brackets, at least half of the values must be units of
    measurement and none a number, so that a line of names such as ``t;F;x`` is not a line of units.
    """
    filled = [field for field in fields if field]
    if filled and all(map(BRACKETED.fullmatch, filled)):
        return list(fields)
    bare = [field for field in filled if field not in _NONE and not BRACKETED.fullmatch(field)]
    if not bare or any(map(like_a_number, bare)) or 2 * sum(map(_is_measured_in, bare)) < len(bare):
        return []
    return [
        field if not field or BRACKETED.fullmatch(field) else "" if field in _NONE else f"[{field}]"
        for field in fields
    ]


@lru_cache(maxsize=1000)
def _is_measured_in(text: str) -> bool:
    if text in _TOO_SHORT_FOR_A_UNIT or len(text) > 12 or not _LETTER.match(text):
        return False
    return text in {"°C", "degC", "C", "°F"} or is_common(text)
