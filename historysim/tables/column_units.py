"""The unit of a column, as it is given beside the file, and as the file itself has it."""

import math
import re
from collections.abc import Sequence

from historysim.basics.units import conversion_factor
from historysim.errors import InputError

# "Force.(kN)", "Force [kN] filtered", "Force / kN"; a number in brackets counts something, and is no unit
_BRACKETS = re.compile(r"\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\]")
_MARKS = frozenset("([/")
"""One of them stands in a name that has a unit."""
_SLASH = re.compile(r"\s/\s+([^\s/]+)\s*$")
# factors of one unit, reached in different ways
_ROUNDING = 1e-12


def unit_in(name: str) -> str | None:
    """Return the unit in a name: in the last brackets, or at its end after a slash between spaces."""
    return split_unit(name)[1]


def split_unit(name: str) -> tuple[str, str | None]:
    """Return a name without its unit, and the unit: ``("Force", "kN")`` for ``"Force [kN]"``; None without one."""
    # the header is looked for in all values of many lines
    if _MARKS.isdisjoint(name):
        return name, None
    matches = [*_BRACKETS.finditer(name)] or [*_SLASH.finditer(name)]
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
    known = [unit for unit in units if _is_known(unit)]
    if explicit is not None:
        return fitting(explicit, wanted)
    if not units:
        return wanted[0], 1.0
    if len(known) < len(units):
        unknown = next(unit for unit in units if unit not in known)
        raise InputError(f'{column}: {unknown!r} is not a known unit; give it one, as in unit = "{wanted[0]}"')
    try:
        si, factor = fitting(known[0], wanted)
    except InputError as error:
        weight = f'; what a balance tells in {known[0]} is a force in {known[0]}f: say unit = "{known[0]}f"'
        hint = weight if "N" in wanted and factor_or_none(known[0], "kg") else ""
        raise InputError(f"{column}: {error}{hint}") from error
    for unit in known[1:]:
        if not _is_same(unit, si, factor):
            raise InputError(f"{column} has two units in the file, {known[0]!r} and {unit!r}; expected one")
    return si, factor


def overridden(explicit: str, units: Sequence[str], wanted: Sequence[str]) -> str | None:
    """Return the first unit in a file that says something else than the one that is given, or None."""
    si, factor = fitting(explicit, wanted)
    return next((unit for unit in units if _is_known(unit) and not _is_same(unit, si, factor)), None)


def factor_or_none(unit: str, si: str) -> float | None:
    """Return the factor that takes numbers in a unit to SI; None where there is none."""
    try:
        return conversion_factor(unit, si)
    except InputError:
        return None


def _is_same(unit: str, si: str, factor: float) -> bool:
    own = factor_or_none(unit, si)
    return own is not None and math.isclose(own, factor, rel_tol=_ROUNDING)


def _is_known(unit: str) -> bool:
    return factor_or_none(unit, unit) is not None
