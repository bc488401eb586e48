"""A line of units below the names of a header, in brackets or bare."""

import re
from collections.abc import Sequence
from functools import lru_cache

from historysim.tables.column_units import factor_or_none
from historysim.tables.names import BRACKETED
from historysim.tables.runs import like_a_number

_LETTER = re.compile(r"[^\W\d_]|[%°]")
_NONE = {"-", "--"}
# what instruments measure; a mass stands for the gram-force of a balance
_KINDS = ("s", "N", "m", "Pa", "rad", "V", "A", "K", "Hz", "m s-1", "rad s-1", "J", "W", "N m-1", "kg", "%")
_TOO_SHORT_FOR_A_UNIT = {"t", "h", "d", "a", "u"}


def units_in_line(fields: Sequence[str]) -> list[str]:
    """Return the units of a line, one for each value, in brackets; nothing where it is no line of units.

    In brackets, any text is a unit. Bare, at least half of the values must be units that instruments measure in, and
    none a number: a line of names alone, such as ``t;F;x``, is no line of units.
    """
    filled = [field for field in fields if field]
    if filled and all(map(BRACKETED.fullmatch, filled)):
        return list(fields)
    bare = [field for field in filled if field not in _NONE and not BRACKETED.fullmatch(field)]
    if not bare or any(map(like_a_number, bare)) or 2 * sum(map(_is_measured_in, bare)) < len(bare):
        return []
    return [
        field if not field or BRACKETED.fullmatch(field) else "" if field in _NONE else f"[{field}]" for field in fields
    ]


@lru_cache(maxsize=1000)
def _is_measured_in(text: str) -> bool:
    if text in _TOO_SHORT_FOR_A_UNIT or len(text) > 12 or not _LETTER.match(text):
        return False
    return text in {"°C", "degC", "C", "°F"} or any(factor_or_none(text, kind) for kind in _KINDS)
