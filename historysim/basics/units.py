"""Quantities with units, at the boundary only, as they come and as people read them: inside, all is floats in SI."""

import math
import re
import warnings
from decimal import Decimal
from numbers import Real
from typing import Any, Protocol

from historysim.errors import InputError, UnlikelyValueWarning

# what a message calls a quantity of this SI unit, and a unit that it may come in
_KINDS = {
    "N": ("a force", "mN"),
    "m": ("a length", "nm"),
    "s": ("a time", "ms"),
    "Hz": ("a frequency", "kHz"),
    "Pa": ("a pressure or modulus", "GPa"),
    "Pa m0.5": ("a fracture toughness", "MPa √m"),
    "J m-2": ("an energy per area", "mJ m-2"),
    "N m-1": ("a stiffness", "mN/µm"),
    "rad": ("an angle", "degree"),
    "m2": ("an area", "mm2"),
    "m3 J-1": ("a volume per energy", "mm3 J-1"),
    "m-2": ("a number per area", "mm-2"),
    "kg": ("a mass", "g"),
    "1": ("a plain number", "%"),
}

_NAMES = {
    "N": "normal_load tangential_load reversal_load load noise",
    "m": (
        "summit_height summit_radius radius contact_radius approach normal_displacement tangential_displacement "
        "displacement pixel_size rms_height autocorrelation_length highest_summit sliding_distance largest_approach "
        "height x y r pitch cutoff height_deviation mean_height height_scatter separation shift distance dead_band"
    ),
    "s": "sample_time duration dt until at t_span",
    "Pa": "contact_modulus shear_modulus",
    "N m-1": "lateral_stiffness",
    "J m-2": "work_of_adhesion",
    "m2": "nominal_area area",
    "m-2": "summit_density",
    "kg": "mass",
    "rad": "rotation",
}
UNIT_OF = {name: unit for unit, names in _NAMES.items() for name in names.split()}
"""The SI unit of arguments of functions, which take texts with units, too: a name means one thing in all of them."""

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
# "10 500 N" and "1,5 N" must not pass as the unit 500 N or a product with 5 N
_STRAY_NUMBER = re.compile(r"(?:^|[\s*/.,·(@])[+-]?[\d.,]")


def is_number(value: object) -> bool:
    """Return whether a value is a real number: of Python or numpy, but neither a bool nor a text."""
    # a long record makes events of a hundred thousand floats
    return type(value) is float or (isinstance(value, Real) and not isinstance(value, bool))


def as_float(value: float) -> float:
    """Return any kind of number as a float, one too large for it as infinite; anything else as it came.

    For attrs converters: the validator behind it knows the name of the field, and says what is wrong. The types are
    those of the field, as help and type checkers show them.
    """
    if type(value) is float:
        return value
    came: Any = value
    number = came.item() if getattr(came, "ndim", None) == 0 else came
    try:
        return float(number) if is_number(number) else value
    except OverflowError:
        return math.inf if number > 0 else -math.inf


class PhysicalQuantity(Protocol):
    """A number or an array with its unit, as pint's ``Quantity``."""

    @property
    def magnitude(self) -> Any:
        """The number."""

    def to(self, unit: str, /) -> Any:
        """Return the same in another unit."""


def in_si(value: Any, unit: str) -> Any:
    """Return texts with units and quantities of pint as numbers in SI; anything else as it came.

    Parameters
    ----------
    value : object
        A number, a text such as ``"50 mN"``, a `PhysicalQuantity`, or a list of them; or an array.
    unit : str
        The SI unit, as in `quantity`.

    Raises
    ------
    InputError
        A text or a quantity that cannot be had in this unit.
    """
    if type(value) is float:
        return value
    if isinstance(value, str):
        return quantity(value, unit)
    if has_unit(value):
        return _magnitude(value, unit)
    several = value.tolist() if getattr(getattr(value, "dtype", None), "kind", "") == "U" else value
    if isinstance(several, list | tuple) and not all(map(is_number, several)):
        return [in_si(one, unit) for one in several]
    return several


def has_unit(value: object) -> bool:
    """Return whether a value is a `PhysicalQuantity`."""
    return hasattr(value, "magnitude") and hasattr(value, "to")


def _magnitude(value: PhysicalQuantity, unit: str) -> Any:
    # "J m-2" in the notation of pint: it has powers after two asterisks
    notation = "dimensionless" if unit == "1" else re.sub(r"([A-Za-z])(-?\d)", r"\1**\2", unit).replace(" ", "*")
    try:
        number = value.to(notation).magnitude
    # what pint raises derives from one of these, by what is wrong
    except (TypeError, ValueError, AttributeError):
        kind, sample = _kind(unit)
        how = "" if unit == "1" else f" in {unit}, or in a unit such as {sample}"
        raise InputError(f"{_shown(str(value))} has another unit; expected {kind}{how}") from None
    # a quantity may hold a decimal or a fraction
    return as_float(number)


# Converters of attrs fields, named for the unit, since type checkers want a function.


def newtons(value: float | str | PhysicalQuantity) -> float:
    """Return a force in N; what is neither a number, a text nor a quantity as it came, as `as_float` does."""
    return as_float(in_si(value, "N"))


def metres(value: float | str | PhysicalQuantity) -> float:
    """Return a length in m, as `newtons`."""
    return as_float(in_si(value, "m"))


def seconds(value: float | str | PhysicalQuantity) -> float:
    """Return a time in s, as `newtons`."""
    return as_float(in_si(value, "s"))


def pascals(value: float | str | PhysicalQuantity) -> float:
    """Return a pressure or modulus in Pa, as `newtons`."""
    return as_float(in_si(value, "Pa"))


def newtons_per_metre(value: float | str | PhysicalQuantity) -> float:
    """Return a stiffness in N/m, as `newtons`."""
    return as_float(in_si(value, "N m-1"))


def pascals_root_metre(value: float | str | PhysicalQuantity) -> float:
    """Return a fracture toughness in Pa √m, as `newtons`."""
    return as_float(in_si(value, "Pa m0.5"))


def joules_per_area(value: float | str | PhysicalQuantity) -> float:
    """Return a surface energy in J/m², as `newtons`."""
    return as_float(in_si(value, "J m-2"))


def cubic_metres_per_joule(value: float | str | PhysicalQuantity) -> float:
    """Return a volume per energy in m³/J, as `newtons`."""
    return as_float(in_si(value, "m3 J-1"))


def warn_unlikely(what: str, unit: str, *, stacklevel: int) -> None:
    """Warn of a number that cannot be meant in SI, as where it was thought in another unit.

    Parameters
    ----------
    what : str
        The argument and its value, and why it cannot be.
    unit : str
        Its SI unit.
    stacklevel : int
        Of `warnings.warn`, as seen from the caller: 2 is who called him.
    """
    warnings.warn(
        f"{what}, which is implausible: numbers are in {unit}; give another unit with the number, such as "
        f"'50 {_kind(unit)[1]}'",
        UnlikelyValueWarning,
        stacklevel=stacklevel + 1,
    )


def quantity(value: float | str, unit: str) -> float:
    """Return a quantity in SI.

    Parameters
    ----------
    value : float or str
        A number, taken as SI, or a text of one number and a unit, such as ``"50 mN"``,
        ``"-2.5e-3 mm"``, ``"20 gf"`` or ``"100 µm"``. The sign is kept.
    unit : str
        The SI unit expected: ``"N"``, ``"m"``, ``"s"``, ``"Pa"``, ``"J m-2"``, ``"N m-1"``, or ``"1"`` for a
        plain number, which takes no text. Any other coherent SI unit that UDUNITS-2 reads will do too.

    Returns
    -------
    float
        The value in `unit`. A decimal text gives the float nearest to its SI value: ``"70 mN"`` is ``0.07``.

    Raises
    ------
    InputError
        Neither a number nor a text, a text without a unit or with an unknown one, a unit of another dimension
        or with an offset, a number that is not finite.

    Notes
    -----
    Units are those of UDUNITS-2, through cf-units.
    """
    if is_number(value):
        return _finite(value, value)
    kind, sample = _kind(unit)
    if unit == "1" or not isinstance(value, str):
        how = (
            "such as 0.2, without quotes or a unit"
            if unit == "1"
            else f"in {unit}, or as a string such as '50 {sample}'"
        )
        given = "string" if isinstance(value, str) else type(value).__name__
        raise InputError(f"{_shown(value)} is a {given}; expected {kind} {how}")
    text = value.strip()
    match = _NUMBER.match(text)
    unit_text = text[match.end() :].strip() if match else ""
    if match is None or _STRAY_NUMBER.search(unit_text):
        raise InputError(
            f"{_shown(value)} is not one number and its unit; expected {kind} such as '50 {sample}', with a decimal "
            "point and no separators between thousands"
        )
    number = match.group()
    as_float = _finite(number, value)
    if not unit_text:
        raise InputError(
            f"{_shown(value)} has no unit; expected {kind}: write the plain number {as_float!r} for SI, or "
            f"'{as_float!r} {unit}'"
        )
    try:
        factor = conversion_factor(unit_text, unit)
    except InputError as error:
        raise InputError(f"{_shown(value)}: {error}") from None
    if as_float == 0:
        return 0.0
    # the product of the decimals, rounded once, is the very float of the same quantity written in SI
    return _finite(Decimal(number) * Decimal(repr(factor)), value)


def conversion_factor(unit_text: str, unit: str) -> float:
    """Return the factor that takes numbers in one unit to SI, for whole columns of data.

    Parameters
    ----------
    unit_text : str
        The unit of the data, such as ``"mN"`` or ``"0.1 µm"``.
    unit : str
        The SI unit expected, as in `quantity`; with ``"1"``, ``"%"`` is a unit too.

    Returns
    -------
    float
        `unit` per `unit_text`, finite and positive: ``column * conversion_factor("mN", "N")`` is in N.

    Raises
    ------
    InputError
        An unknown unit, one of another dimension, or one that is not proportional to `unit`: a scale with an
        offset such as celsius, a logarithmic one, or a date.

    Notes
    -----
    Units are those of UDUNITS-2, through cf-units.
    """
    kind, sample = _kind(unit)
    if not (isinstance(unit_text, str) and unit_text.strip() and unit_text.isprintable()):
        raise InputError(f"{_shown(unit_text)} is not a unit; expected a unit such as {sample}")
    if unit == "Pa m0.5":
        # UDUNITS-2 knows no roots
        pressure, root, _ = unit_text.strip().rpartition("√m")
        if not root:
            raise InputError(f"{_shown(unit_text)} is not a unit of {kind}; expected a unit such as {sample}")
        return conversion_factor(pressure.rstrip(" *·"), "Pa")
    if (factor := _common(unit_text, unit)) is not None:
        return factor
    import cf_units

    with cf_units.suppress_errors():
        try:
            given = cf_units.Unit(unit_text)
        except ValueError:
            given = cf_units.Unit("unknown")
        if given.is_unknown() or given.is_no_unit():
            raise InputError(
                f"{_shown(unit_text)} is not a known unit; expected a unit such as {sample}, with its capitals as "
                "they are: mN is not MN"
            )
        # UDUNITS-2 also converts a unit into its reciprocal, which sends 0 to infinity
        zero = given.convert(0.0, unit) if given.is_convertible(unit) else math.inf
        if not math.isfinite(zero):
            raise InputError(f"{_shown(unit_text)} is not a unit of {kind}; expected a unit such as {sample}")
        factor = float(given.convert(1.0, unit))
    if zero != 0:
        raise InputError(
            f"{_shown(unit_text)} does not start from zero (0 {unit_text} is {zero:g} {unit}), so no factor "
            f"converts it; expected a unit such as {sample}; convert the data to {unit} first"
        )
    if not (math.isfinite(factor) and factor > 0):
        raise InputError(f"{_shown(unit_text)} is {factor:g} {unit}; expected a positive, finite unit such as {sample}")
    return factor


def _common(unit_text: str, unit: str) -> float | None:
    """Return the factor of a unit that is the SI unit with a prefix or without; None of any other."""
    if unit not in {"N", "m", "s", "Pa"} or not unit_text.endswith(unit):
        return None
    exponents = {prefix: exponent for exponent, prefix in _PREFIXES.items()} | {"μ": -6, "u": -6}
    exponent = exponents.get(unit_text.removesuffix(unit))
    return None if exponent is None else float(f"1e{exponent}")


class QuantityText(str):
    """A quantity as text, which keeps its value and its SI unit."""

    __slots__ = ("unit", "value")
    value: float
    unit: str


def quantity_text(value: float, unit: str, digits: int = 4) -> str:
    """Return a quantity as text, with the prefix that leaves one to three digits before the point: ``"90 mN"``."""
    factor, symbol = scaled(value, unit)
    text = QuantityText(f"{value * factor:.{digits}g}{symbol}")
    text.value, text.unit = float(value), unit
    return text


def range_text(low: float, high: float, unit: str) -> str:
    """Return the range of a quantity: ``"1 µm to 2.5 mm"``, or one value where there is but one."""
    first, last = quantity_text(low, unit), quantity_text(high, unit)
    return first if first == last else f"{first} to {last}"


def duration_text(seconds: float) -> str:
    """Return a time as text, in the unit in which people speak of it: ``"12.5 min"``."""
    for unit, length, least in (("h", 3600.0, 7200.0), ("min", 60.0, 600.0)):
        if seconds >= least:
            return f"{seconds / length:.4g} {unit}"
    return f"{seconds:.4g} s" if seconds >= 1 else quantity_text(seconds, "s")


def scaled(value: float, unit: str) -> tuple[float, str]:
    """Return the factor to multiply a value in SI by, and what stands behind it, as ``" mN"``."""
    if unit in {"1", ""}:
        return 1.0, ""
    # a prefix would be raised to the power of a unit such as m2, too
    factor, prefix = (1.0, "") if unit.split(maxsplit=1)[0][-1].isdigit() else prefixed(value)
    return factor, f" {prefix}{'N/m' if unit == 'N m-1' else unit}"


def prefixed(value: float) -> tuple[float, str]:
    """Return the factor to multiply a value by, and the SI prefix that goes with it."""
    magnitude = abs(value)
    if not (math.isfinite(magnitude) and magnitude > 0):
        return 1.0, ""
    exponent = 3 * math.floor(math.log10(magnitude * (1 + 1e-9)) / 3)
    exponent = min(max(exponent, min(_PREFIXES)), max(_PREFIXES))
    return 10.0**-exponent, _PREFIXES[exponent]


def _kind(unit: str) -> tuple[str, str]:
    return _KINDS.get(unit, (f"a quantity in {unit}", unit))


def _finite(number: float | Decimal | str, came: object) -> float:
    try:
        result = float(number)
    except OverflowError:
        raise InputError("an integer beyond the largest float; expected less than 1.8e308 in SI") from None
    if not math.isfinite(result):
        raise InputError(
            f"{_shown(came)} is not a finite number that a float can hold; expected less than 1.8e308 in SI"
        )
    return result


def _shown(came: object) -> str:
    text = repr(came)
    return text if len(text) <= 60 else f"{text[:60]}…"
