"""Quantities with units, converted at the boundary only: internal values are floats in SI.

SI units with prefixes, and their products, are parsed here; pint parses other units.
"""

import functools
import math
import re
import warnings
from collections.abc import Callable
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from numbers import Real
from typing import Any, Protocol

from historysim.basics.wording import quote
from historysim.errors import InputError, UnlikelyValueWarning

# noun in messages for a quantity of this SI unit, and a sample unit
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
    "m3": ("a volume", "µm3"),
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
        "height x y z r pitch cutoff height_deviation mean_height height_scatter separation shift distance dead_band "
        "displacement_offset length reference_depth"
    ),
    "s": "sample_time duration dt until at t_span",
    "Pa": "contact_modulus shear_modulus hardness",
    "J": "dissipated_energy",
    "m3": "worn_volume",
    "N m-1": "lateral_stiffness parallel_stiffness",
    "J m-2": "work_of_adhesion",
    "m2": "nominal_area area",
    "m-2": "summit_density",
    "kg": "mass",
    "rad": "rotation",
}
# SI unit of function arguments, which also accept strings with units; a name has one meaning in all
# functions.
UNIT_OF = {name: unit for unit, names in _NAMES.items() for name in names.split()}

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
# "10 500 N" and "1,5 N" must not be parsed as the unit 500 N or a product with 5 N
_STRAY_NUMBER = re.compile(r"(?:^|[\s*/.,·(@])[+-]?[\d.,]")


def is_number(value: object) -> bool:
    """Return True if a value is a real number of Python or numpy, but not a bool."""
    # fast path: a long record has events with a hundred thousand floats
    return type(value) is float or (isinstance(value, Real) and not isinstance(value, bool))


def as_float(value: float) -> float:
    """Convert a number of any type to a float, infinite on overflow; return other values unchanged.

    For attrs converters: the subsequent validator knows the name of the field.
    """
    if type(value) is float:
        return value
    scalar: Any = value
    number = scalar.item() if getattr(scalar, "ndim", None) == 0 else scalar
    try:
        return float(number) if is_number(number) else value
    except OverflowError:
        return math.inf if number > 0 else -math.inf


class PhysicalQuantity(Protocol):
    """Number or array with a unit, such as ``Quantity`` of pint."""

    @property
    def magnitude(self) -> Any:
        """Numerical value."""

    def to(self, unit: str, /) -> Any:
        """Convert to another unit."""


def to_si(value: Any, unit: str) -> Any:
    """Convert strings with units and pint quantities, or lists of them, to an SI unit; keep other values."""
    if type(value) is float:
        return value
    if isinstance(value, str):
        return quantity(value, unit)
    if has_unit(value):
        # "J m-2" in the notation of pint, with ** for powers
        notation = (
            "dimensionless"
            if unit == "1"
            else re.sub(r"([A-Za-z])(-?\d)", r"\1**\2", unit).replace(" ", "*")
        )
        try:
            # the magnitude may be a decimal or a fraction
            return as_float(value.to(notation).magnitude)
        # errors of pint derive from one of these
        except (TypeError, ValueError, AttributeError):
            raise InputError(
                f"{quote(str(value))} has another unit; expected {_describe_with_unit(unit)}"
            ) from None
    values = value.tolist() if getattr(getattr(value, "dtype", None), "kind", "") == "U" else value
    if isinstance(values, list | tuple) and not all(map(is_number, values)):
        return [to_si(element, unit) for element in values]
    return values


def has_unit(value: object) -> bool:
    """Return True if a value is a `PhysicalQuantity`."""
    return hasattr(value, "magnitude") and hasattr(value, "to")


def convert_each(convert: Callable[[Any], Any], value: Any) -> Any:
    """Convert a number, or each number of a list to a tuple; for attrs converters."""
    is_list = isinstance(value, list | tuple) or getattr(value, "ndim", 0) == 1
    return tuple(map(convert, value)) if is_list else convert(value)


# Converters of attrs fields, one function per unit for type checkers. They return a number in SI,
# and values other than numbers, strings and quantities unchanged, as `as_float` does.


def newtons(value: float | str | PhysicalQuantity) -> float:
    """Return a force in N."""
    return as_float(to_si(value, "N"))


def metres(value: float | str | PhysicalQuantity) -> float:
    """Return a length in m."""
    return as_float(to_si(value, "m"))


def seconds(value: float | str | PhysicalQuantity) -> float:
    """Return a time in s."""
    return as_float(to_si(value, "s"))


def pascals(value: float | str | PhysicalQuantity) -> float:
    """Return a pressure or modulus in Pa."""
    return as_float(to_si(value, "Pa"))


def newtons_per_metre(value: float | str | PhysicalQuantity) -> float:
    """Return a stiffness in N/m."""
    return as_float(to_si(value, "N m-1"))


def pascals_root_metre(value: float | str | PhysicalQuantity) -> float:
    """Return a fracture toughness in Pa √m."""
    return as_float(to_si(value, "Pa m0.5"))


def joules_per_area(value: float | str | PhysicalQuantity) -> float:
    """Return a surface energy in J/m²."""
    return as_float(to_si(value, "J m-2"))


def cubic_metres_per_joule(value: float | str | PhysicalQuantity) -> float:
    """Return a volume per energy in m³/J."""
    return as_float(to_si(value, "m3 J-1"))


def warn_unlikely(statement: str, unit: str, *, sample: float = 50, stacklevel: int) -> None:
    """Warn that an implausible value in an SI unit may have been meant in another unit, such as ``sample``."""
    meant = f"did you mean a unit, as in '{sample:g} {_kind(unit)[1]}'?"
    warnings.warn(
        f"{statement}, which is implausible: numbers are in {unit}; {meant}",
        UnlikelyValueWarning,
        stacklevel=stacklevel + 1,
    )


LARGEST_RADIUS = 0.5  # a larger radius of a ball or summit [m] is implausible


def warn_large_radius(name: str, radius: float, *, stacklevel: int) -> None:
    """Warn that the smallest radius [m] of balls or summits is implausibly large."""
    if radius > LARGEST_RADIUS:
        given, meant = quantity_text(radius, "m"), quantity_text(1e-3 * radius, "m")
        warnings.warn(
            f"{name} is {given}, which is implausible: numbers are in m; did you mean '{meant}'?",
            UnlikelyValueWarning,
            stacklevel=stacklevel + 1,
        )


def quantity(value: float | str, unit: str) -> float:
    """Convert a string with a unit, such as ``"50 mN"``, to an SI unit; a number is already in SI.

    A decimal string gives the float nearest to its SI value: ``"70 mN"`` is ``0.07``. A plain
    number (``"1"``) must not be a string. InputError for other types, another dimension, or a
    number that is not finite.
    """
    if is_number(value):
        return _finite(value, value)
    if unit == "1" or not isinstance(value, str):
        plain = " such as 0.2, without quotes or a unit" if unit == "1" else ""
        type_name = "string" if isinstance(value, str) else type(value).__name__
        raise InputError(
            f"{quote(value)} is a {type_name}; expected {_describe_with_unit(unit)}{plain}"
        )
    kind, sample = _kind(unit)
    string = value.strip()
    match = _NUMBER.match(string)
    unit_text = string[match.end() :].strip() if match else ""
    if match is None or _STRAY_NUMBER.search(unit_text):
        raise InputError(
            f"{quote(value)} is not one number and its unit; expected {kind} such as '50 {sample}', with a "
            "decimal point and no separators between thousands"
        )
    number = match.group()
    plain_number = _finite(number, value)
    if not unit_text:
        raise InputError(
            f"{quote(value)} has no unit; expected {kind}: write the plain number {plain_number!r} for SI, or "
            f"'{plain_number!r} {unit}'"
        )
    try:
        factor = conversion_factor(unit_text, unit)
    except InputError as error:
        raise InputError(f"{quote(value)}: {error}") from None
    if plain_number == 0:
        return 0.0
    # the product of decimals is rounded once, so it equals the float of the same quantity written
    # in SI
    return _finite(Decimal(number) * Decimal(repr(factor)), value)


def conversion_factor(unit_text: str, unit: str) -> float:
    """Return the positive factor from a unit, such as ``"mN"`` or ``"0.1 µm"``, to an SI unit.

    InputError if the unit is unknown, has another dimension, or an offset, such as celsius.
    """
    kind, sample = _kind(unit)
    text, expected = quote(unit_text), f"expected a unit such as {sample}"
    if not (isinstance(unit_text, str) and unit_text.strip() and unit_text.isprintable()):
        raise InputError(f"{text} is not a unit; {expected}")
    try:
        size, dimension = _product(unit_text)
    except LookupError as error:
        raise InputError(f"{text} {error.args[0]}; {_suggest_unit(unit_text, unit)}") from None
    except ZeroDivisionError:
        raise InputError(f"{text} divides by 0; {expected}") from None
    si, si_dimension = _product(unit)
    if dimension != si_dimension:
        signal = any(dimension == _product(symbol)[1] for symbol in ("V", "A"))
        meant = (
            f"; for the signal of a sensor write the value of 1 {unit_text}, as '2.5 {sample}'"
            if signal
            else ""
        )
        raise InputError(f"{text} is not a unit of {kind}; {expected}{meant}")
    try:
        factor = float(size / si)
    except OverflowError:
        factor = math.inf
    if not 0 < factor < math.inf:
        raise InputError(
            f"{text} is {factor:g} {unit}; expected a positive, finite unit such as {sample}"
        )
    return factor


_Dimension = dict[str, Fraction]  # exponents of base units, by their names in pint
_Unit = tuple[Fraction, _Dimension]

# Units with prefixes, which cover most data without loading pint.
_BASES = {
    "m": "meter",
    "kg": "kilogram",
    "s": "second",
    "A": "ampere",
    "K": "kelvin",
    "rad": "radian",
}
_PREFIXED = {
    **dict.fromkeys("msAK"),
    "rad": None,
    "g": "1e-3 kg",
    "Hz": "s-1",
    "N": "kg m s-2",
    "Pa": "N m-2",
}
_PREFIXED |= {"J": "N m", "W": "J s-1", "V": "W A-1"}
# Other units of instruments, without prefixes, and units that pint defines differently: mil as an
# angle, rpm as 2 π radians a minute, and nmile as a billionth of a mile.
_DEFINED = {
    "%": "0.01",
    "min": "60 s",
    "h": "3600 s",
    "sec": "s",
    "second": "s",
    "rpm": "1 / min",
    "meter": "m",
    "metre": "m",
    "micron": "µm",
    "in": "25.4 mm",
    "inch": "25.4 mm",
    "ft": "304.8 mm",
    "mil": "0.0254 mm",
    "nmile": "1852 m",
    "newton": "N",
    "gf": "9.80665 mN",
    "kgf": "9.80665 N",
    "lbf": "4.4482216152605 N",
    "kip": "4448.2216152605 N",
    "bar": "100 kPa",
    "psi": "lbf / in^2",
    **dict.fromkeys(("°", "deg", "degree"), "0.017453292519943296 rad"),
}
_POWERS_OF_TEN = {prefix: power for power, prefix in _PREFIXES.items()} | {
    "μ": -6,
    "u": -6,
    "c": -2,
    "d": -1,
    "h": 2,
}
_TERM = re.compile(
    r"(?P<over>\s*(?:/|\bper\b)\s*)|(?P<open>\()|(?P<close>\))"
    r"|(?P<number>[0-9]{1,18}(?:\.[0-9]{1,18})?(?:[eE][+-]?[0-9]{1,3})?)"
    r"|(?P<root>√)?(?P<name>[^\W\d_]\w*?|[%°])(?P<power>(?:\^|\*\*)?[+-]?[0-9]{1,2}(?:\.[0-9])?|[⁺⁻]?[⁰¹²³⁴-⁹]{1,2})?(?!\w)"
    # a point may end an abbreviation
    r"|(?:\s+|\s*[*·×.]\s*|(?<=\w)-)(?=[\w(√%°/]|$)"
)
_RAISED = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")


def is_unit(text: str) -> bool:
    """Return True if a string is a unit, including units with an offset."""
    try:
        _product(text)
    except _OffsetError:
        return True
    except (LookupError, ZeroDivisionError):
        return False
    return bool(text.strip())


def is_common(text: str) -> bool:
    """Return True if a string is a common unit of instruments, such as ``"mN"`` or ``"lbf"``, without using pint."""
    try:
        return bool(_product(text, _common)[1]) or text == "%"
    except LookupError:
        return False


def _product(text: str, named: Callable[[str], _Unit] | None = None) -> _Unit:
    """Parse a unit such as ``"mJ m-2"`` into a factor and exponents of base units; LookupError if it is not a unit."""
    named = named or _look_up
    factor, powers = Fraction(1), _Dimension()
    # sign of the next exponent, and of each open bracket
    sign, outer, at = 1, [1], 0
    while at < len(text):
        term = _TERM.match(text, at)
        if term is None or (term["close"] and len(outer) == 1):
            raise LookupError(_UNKNOWN)
        at = term.end()
        if term["over"]:
            sign = -1
        elif term["open"]:
            outer.append(outer[-1] * sign)
            sign = 1
        elif term["close"]:
            outer.pop()
        elif term["number"]:
            factor *= Fraction(term["number"]) ** (sign * outer[-1])
            sign = 1
        elif term["name"]:
            size, dimension = named(term["name"])
            raised = Fraction((term["power"] or "1").translate(_RAISED).lstrip("^*"))
            power = raised * sign * outer[-1] / (2 if term["root"] else 1)
            # the root of a prefixed unit, such as a millimetre, is not a fraction
            factor *= (
                size ** int(power)
                if power.denominator == 1
                else Fraction(float(size) ** float(power))
            )
            for base, exponent in dimension.items():
                powers[base] = powers.get(base, 0) + exponent * power
            sign = 1
    if sign != 1 or len(outer) > 1:
        raise LookupError(_UNKNOWN)
    return factor, {base: power for base, power in powers.items() if power}


_UNKNOWN = "is not a known unit"


class _OffsetError(LookupError):
    """Unit with an offset, such as celsius, which a factor cannot convert."""


@functools.cache
def _look_up(name: str) -> _Unit:
    """Look up a unit by its name; LookupError if it is unknown."""
    with suppress(LookupError):
        return _common(name)
    pint, registry = _pint()
    # names may have any case, as "Newton"; the case of symbols is significant
    for spelling in (name, name.replace("_", ""), name.lower() if len(name) > 3 else name):
        try:
            size, zero = (
                registry.Quantity(Decimal(number), spelling).to_base_units() for number in (1, 0)
            )
        except (pint.PintError, AttributeError, TypeError, ValueError, ArithmeticError):
            continue
        if zero.magnitude != 0:
            raise _OffsetError(
                f"does not start from zero (0 {name} is {zero:~g}), so no factor converts it"
            )
        return Fraction(size.magnitude), {
            base: Fraction(exponent) for base, exponent in size.unit_items()
        }
    raise LookupError(_UNKNOWN)


def _common(name: str) -> _Unit:
    if name in _BASES:
        return Fraction(1), {_BASES[name]: Fraction(1)}
    word = name if len(name) <= 3 or name in _DEFINED else name.lower().removesuffix("s")
    if word in _DEFINED:
        return _product(_DEFINED[word], _common)
    for symbol, meaning in _PREFIXED.items():
        ten = _POWERS_OF_TEN.get(name.removesuffix(symbol)) if name.endswith(symbol) else None
        if ten is not None:
            factor, powers = _product(meaning or symbol, _common)
            return factor * Fraction(10) ** ten, powers
    raise LookupError(_UNKNOWN)


@functools.cache
def _pint() -> tuple[Any, Any]:
    import pint

    return pint, pint.UnitRegistry(non_int_type=Decimal)


def _suggest_unit(text: str, unit: str) -> str:
    """Suggest a replacement of an unknown unit: a unit that differs by capitals only, otherwise a sample."""
    near = [
        f"{prefix}{unit}"
        for prefix in _POWERS_OF_TEN
        if f"{prefix}{unit}".lower() == text.strip().lower()
    ]
    if near and unit in _PREFIXED:
        return f"did you mean {' or '.join(map(repr, near))}?"
    return f"expected a unit such as {_kind(unit)[1]}, with its exact capitals: mN is not MN"


class QuantityText(str):
    """Formatted quantity with its value and SI unit as attributes."""

    __slots__ = ("unit", "value")
    value: float
    unit: str


def quantity_text(value: Any, unit: str, digits: int = 4) -> str:
    """Format a quantity, or a vector in parentheses, with a prefix for one to three integer digits: ``"90 mN"``."""
    if isinstance(value, tuple) or getattr(value, "ndim", 0) == 1:
        return f"({', '.join(quantity_text(component, unit, digits) for component in value)})"
    # the prefix is that of the rounded value: 999.96 mN is 1 N
    factor, symbol = choose_unit(float(f"{value:.{digits}g}"), unit)
    number = float(f"{value * factor:.{digits}g}")
    text = QuantityText(f"{number:.{max(digits, 4)}g}{symbol}")
    text.value, text.unit = float(value), unit
    return text


def uncertain_text(value: float, error: float, unit: str) -> str:
    """Format a quantity with its standard error, both to the second digit of the error: ``"3.20 ± 0.17 µm"``."""
    if not math.isfinite(error):
        return quantity_text(value, unit)
    if error <= 1e-6 * abs(value):
        return f"{quantity_text(value, unit)} ± {quantity_text(error, unit, 2)}"
    factor, symbol = choose_unit(max(abs(value), error), unit)
    decimals = max(0, 1 - math.floor(math.log10(error * factor)))
    return f"{value * factor:.{decimals}f} ± {error * factor:.{decimals}f}{symbol}"


def range_text(low: float, high: float, unit: str) -> str:
    """Format the range of a quantity: ``"1 µm to 2.5 mm"``, or one value if both are equal."""
    low_text, high_text = quantity_text(low, unit), quantity_text(high, unit)
    return low_text if low_text == high_text else f"{low_text} to {high_text}"


def duration_text(seconds: float) -> str:
    """Format a time [s] in its usual unit: ``"12.5 min"``."""
    for unit, length, threshold in (("h", 3600.0, 7200.0), ("min", 60.0, 600.0)):
        if seconds >= threshold:
            return f"{seconds / length:.4g} {unit}"
    return f"{seconds:.4g} s" if seconds >= 1 else quantity_text(seconds, "s")


def choose_unit(value: float, unit: str) -> tuple[float, str]:
    """Return the factor from SI to a prefixed unit, and that unit after a space: ``" mN"``."""
    if unit in {"1", ""}:
        return 1.0, ""
    # the exponent of a unit such as m2 would apply to a prefix as well
    factor, prefix = (1.0, "") if unit.split(maxsplit=1)[0][-1].isdigit() else choose_prefix(value)
    return factor, f" {prefix}{'N/m' if unit == 'N m-1' else unit}"


def choose_prefix(value: float) -> tuple[float, str]:
    """Return the factor for a value and the corresponding SI prefix."""
    magnitude = abs(value)
    if not (math.isfinite(magnitude) and magnitude > 0):
        return 1.0, ""
    exponent = 3 * math.floor(math.log10(magnitude * (1 + 1e-9)) / 3)
    exponent = min(max(exponent, min(_PREFIXES)), max(_PREFIXES))
    return 10.0**-exponent, _PREFIXES[exponent]


def describe_expected(unit: str) -> str:
    """Describe the expected value of a key in an SI unit: ``"a length such as '50 nm'"``."""
    kind, sample = _kind(unit)
    return f"{kind} such as 0.2" if unit == "1" else f"{kind} such as '50 {sample}'"


def _describe_with_unit(unit: str) -> str:
    """Describe the expected value where a number is accepted: ``"a force in N, or as a string such as '50 mN'"``."""
    kind, sample = _kind(unit)
    return kind if unit == "1" else f"{kind} in {unit}, or as a string such as '50 {sample}'"


def _kind(unit: str) -> tuple[str, str]:
    return _KINDS.get(unit, (f"a quantity in {unit}", unit))


def _finite(number: float | Decimal | str, original: object) -> float:
    try:
        result = float(number)
    except OverflowError:
        raise InputError(
            "an integer beyond the largest float; expected less than 1.8e308 in SI"
        ) from None
    if not math.isfinite(result):
        raise InputError(
            f"{quote(original)} is not a finite number that a float can hold; expected less than 1.8e308 in SI"
        )
    return result
