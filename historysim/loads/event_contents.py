"""What events hold, one number, coefficients, lengths or indices of asperities: checked, and as text in a table."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from historysim.basics.units import as_float, in_si, is_number
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.tables.lines import brief

if TYPE_CHECKING:
    import attrs

Number = Callable[[str], float]
"""What reads a number of a table, with its unit, in SI."""


def finite(event: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    """Check a number of an event."""
    if not (is_number(value) and math.isfinite(value)):
        raise InputError(f"{type(event).__name__}: {attribute.name} is {value!r}; expected a finite number, in SI")


def not_negative(event: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    """Check a normal load [N]."""
    finite(event, attribute, value)
    if value < 0:
        raise InputError(
            f"{type(event).__name__}: a normal load of {value:g} N pulls on the contact; "
            "expected a load of 0 N (lift-off) or more, since the contact does not adhere"
        )


def as_coefficients(value: float | Iterable[float]) -> float | tuple[float, ...]:
    """Return one coefficient, or one for each asperity, as floats; what is neither as it came."""
    came: Any = value
    single = isinstance(came, str | bytes | Mapping) or getattr(came, "ndim", 1) == 0
    return tuple(map(as_float, came)) if isinstance(came, Iterable) and not single else as_float(came)


def valid_coefficients(event: object, attribute: "attrs.Attribute[float]", value: float | tuple[float, ...]) -> None:
    """Check coefficients of friction."""
    coefficients = value if isinstance(value, tuple) else (value,)
    if not coefficients:
        raise InputError(f"{type(event).__name__}: {attribute.name} is empty; expected one coefficient, or one each")
    for coefficient in coefficients:
        if not (is_number(coefficient) and math.isfinite(coefficient) and coefficient >= 0):
            raise InputError(
                f"{type(event).__name__}: {attribute.name} is {coefficient!r}; expected a finite number of 0 or more"
            )


def differ(value: float | tuple[float, ...]) -> bool:
    """Return whether there are coefficients that differ."""
    return isinstance(value, tuple) and min(value) < max(value)


def as_lengths(value: float | Iterable[float] | None) -> tuple[float, ...] | None:
    """Return lengths with or without units [m]."""
    if value is None:
        return None
    lengths = as_coefficients(in_si(value, "m"))
    return lengths if isinstance(lengths, tuple) else (lengths,)


def valid_lengths(event: object, attribute: "attrs.Attribute[Any]", value: tuple[float, ...] | None) -> None:
    """Check lengths [m]."""
    if value == ():
        raise InputError(f"{type(event).__name__}: {attribute.name} is empty; expected one length, or one each, in m")
    for length in value or ():
        if not (is_number(length) and math.isfinite(length)):
            raise InputError(f"{type(event).__name__}: {attribute.name} is {length!r}; expected a finite number, in m")


def as_indices(value: int | Iterable[int] | None) -> tuple[int, ...] | None:
    """Return indices of asperities; None is all of them."""
    came: Any = value
    # what holds no indices is refused afterwards
    if came is not None and not isinstance(came, str | bytes | Mapping):
        came = tuple(came) if isinstance(came, Iterable) else (came,)
    indices: tuple[int, ...] | None = came
    return indices


def valid_indices(
    event: object,
    attribute: "attrs.Attribute[Any]",
    value: Any,  # noqa: ANN401 - whatever was given as indices
) -> None:
    """Check indices of asperities, and make whole numbers of them."""
    if value is None:
        return
    whole = isinstance(value, tuple) and all(
        is_number(index) and index == int(index) and index >= 0 and not isinstance(index, bool) for index in value
    )
    if not whole or not value or len(set(value)) < len(value):
        raise InputError(
            f"{type(event).__name__}: {attribute.name} is {value!r}; expected indices of asperities, "
            "0 or more, each once"
        )
    object.__setattr__(event, attribute.name, tuple(int(index) for index in value))


def numbers_text(numbers: float | tuple[float, ...] | None) -> str:
    """Return numbers as a cell has them, with as many digits as tell them from any other; one of a list in brackets."""
    if numbers is None:
        return ""
    if not isinstance(numbers, tuple):
        return repr(numbers)
    text = " ".join(map(repr, numbers))
    return text if len(numbers) > 1 else f"[{text}]"


def numbers_in(text: str, number: Number) -> float | tuple[float, ...] | None:
    """Return the numbers that `numbers_text` told."""
    text = text.strip()
    bare = text.removeprefix("[").removesuffix("]")
    numbers = tuple(map(number, bare.split()))
    if not numbers:
        return None
    return numbers[0] if len(numbers) == 1 and bare == text else numbers


def coefficients_in(text: str, number: Number) -> float | tuple[float, ...]:
    """Return the coefficients of a cell; none where it is empty, which the event refuses."""
    coefficients = numbers_in(text, number)
    return () if coefficients is None else coefficients


def chosen_in(text: str) -> tuple[tuple[int, ...] | None, str]:
    """Return the indices in front of a colon, and what stands behind it."""
    chosen, _, rest = text.rpartition(":")
    for each in chosen.split():
        if not each.isdecimal():
            raise InputError(f"{brief(each)}; expected the index of an asperity, 0 or more")
    return tuple(map(int, chosen.split())) or None, rest


def chosen_text(asperities: tuple[int, ...] | None) -> str:
    """Return the indices of chosen asperities, with a colon, as they stand before what is said of them."""
    return "" if asperities is None else f"{' '.join(map(str, asperities))}: "


def lists_misfit(count: int, chosen: tuple[int, ...] | None, lists: Mapping[str, Any], noun: str) -> str:
    """Return what of lists for chosen asperities, or for all, does not fit so many of them."""
    if chosen is not None and max(chosen) >= count:
        return f"asperity {max(chosen)} does not exist; expected indices from 0 to {count - 1}"
    whose = count if chosen is None else len(chosen)
    for name, values in lists.items():
        if isinstance(values, tuple) and len(values) not in {1, whose}:
            return (
                f"{name} has shape ({len(values)},); expected one {noun}, or one for each of "
                f"{counted(whose, 'asperity', 'asperities')}"
            )
    return ""
