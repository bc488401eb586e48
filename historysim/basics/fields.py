"""Fields of classes that scenarios name: their units and limits, declared in the class."""

import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

import attrs

from historysim.basics.limits import LARGEST, SMALLEST, is_workable
from historysim.basics.units import is_number
from historysim.basics.wording import shown
from historysim.errors import InputError, misfit


@attrs.frozen
class Quantity:
    """Marks a field as a number in this SI unit, or a string with a unit that converts to it.

    Of an array, ``alone`` says that one number may stand for an array of one; ``components`` are the keys of a table
    that may stand for an array with a number for some of them.
    """

    unit: str
    alone: bool = False
    components: tuple[str, ...] = ()


Number = Annotated[float, Quantity("1")]
Numbers = Annotated[float | tuple[float, ...], Quantity("1")]
Time = Annotated[float, Quantity("s")]
Frequency = Annotated[float, Quantity("Hz")]
Frequencies = Annotated[float | tuple[float, ...], Quantity("Hz")]
Length = Annotated[float, Quantity("m")]
Lengths = Annotated[float | tuple[float, ...], Quantity("m")]
Force = Annotated[float, Quantity("N")]
Pressure = Annotated[float, Quantity("Pa")]
FractureToughness = Annotated[float, Quantity("Pa m0.5")]
Stiffness = Annotated[float, Quantity("N m-1")]
Stiffnesses = Annotated[float | tuple[float, ...], Quantity("N m-1")]
SurfaceEnergy = Annotated[float, Quantity("J m-2")]


@attrs.frozen
class AtLeast:
    """Validator of a finite number that is at least, or above, another."""

    least: float
    above: bool = attrs.field(default=False, kw_only=True)

    def __call__(self, of: object, attribute: "attrs.Attribute[float]", value: Any) -> None:
        """Check a value."""
        smallest = SMALLEST if self.above and self.least == 0 else 0.0
        fits = is_number(value) and is_workable(value, smallest)
        if not (fits and (value > self.least if self.above else value >= self.least)):
            least = "finite" if self.least == -math.inf else f"of {self.least:g} or more"
            raise InputError(
                f"{type(of).__name__}: {attribute.name} is {value!r}; expected a number "
                f"{f'above {self.least:g}' if self.above else least}, and of at most {LARGEST:g} in size"
            )

    @property
    def text(self) -> str:
        """The limit in brief."""
        return "" if self.least == -math.inf else f"{'>' if self.above else '≥'} {self.least:g}"


@attrs.frozen
class OneOf:
    """Validator of a word."""

    words: tuple[str, ...]

    def __call__(self, of: object, attribute: "attrs.Attribute[str]", value: Any) -> None:
        """Check a value."""
        if value not in self.words:
            expected = " or ".join(map(repr, self.words))
            raise InputError(f"{type(of).__name__}: {attribute.name} is {value!r}; expected {expected}")

    @property
    def text(self) -> str:
        """The limit in brief."""
        return " or ".join(f'"{word}"' for word in self.words)


@attrs.frozen
class Key:
    """Validator of a key of a scenario: its error belongs to the place of the key, and None is fine."""

    fits: Callable[[Any], bool]
    expected: str

    def __call__(self, _: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        """Check a value."""
        if value is not None and not self.fits(value):
            given = f"{value:g}" if isinstance(value, float) else shown(value)
            raise misfit(f"{given}; expected {self.expected}", attribute.name)


@attrs.frozen
class KeyLimit:
    """Validator of a key that is one number, or several, of 0 or more, or above 0; None is fine."""

    text: str

    def __call__(self, _: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        """Check a value."""
        unit = unit_in(attribute.type).replace("m2", "m²").removeprefix("1")
        of_unit = f" {unit}" if unit else ""
        above = self.text == "> 0"
        for each in value if isinstance(value, tuple) else (value,):
            if each is not None and not (each > 0 if above else each >= 0):
                expected = f"more than 0{of_unit}" if above else f"0{of_unit} or more"
                raise misfit(f"{each:g}{of_unit}; expected {expected}", attribute.name)


at_least = AtLeast
NOT_NEGATIVE, POSITIVE = KeyLimit("≥ 0"), KeyLimit("> 0")


def one_of(*words: str) -> OneOf:
    """Return a validator of a word."""
    return OneOf(words)


@attrs.frozen
class Field:
    """A field of a class, as its users see it."""

    name: str
    unit: str  #: the SI unit; "1" of a plain number, empty of what is no number
    needed: bool
    default: Any
    limits: str  #: what its values have to be, as ``"> 0"``

    @property
    def text(self) -> str:
        """Itself in a few words: ``"reference_load [N] > 0"``."""
        unit = f" [{self.unit}]" if self.unit not in {"", "1"} else ""
        words = ":" if self.limits.startswith('"') else ""
        limits = f"{words} {self.limits}" if self.limits else ""
        default = "" if self.needed or self.default in {None, "", ()} else f" (default {_toml(self.default)})"
        return f"{self.name}{unit}{limits}{default}"


def fields_of(kind: type) -> Iterator[Field]:
    """Yield the fields of a class in their order, those that are needed first; none of what is no attrs class."""
    if not attrs.has(kind):
        return
    attrs.resolve_types(kind)
    found = [
        Field(
            each.name,
            unit_in(each.type),
            each.default is attrs.NOTHING,
            None if isinstance(each.default, attrs.Factory) else each.default,  # type: ignore[arg-type]
            _limits(each.validator),
        )
        for each in attrs.fields(kind)
        if each.init
    ]
    yield from sorted(found, key=lambda field: not field.needed)


def about(kind: type) -> str:
    """Return the first paragraph of the docstring of a class, in one line."""
    return " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split())


def markdown(kinds: Mapping[str, type], heading: str) -> str:
    """Return a table of kinds with their keys, as it stands in the documentation."""
    rows = [f"| {heading} | keys | |", "| --- | --- | --- |"]
    for name, kind in kinds.items():
        keys = "; ".join(f"`{field.name}`{field.text.removeprefix(field.name)}" for field in fields_of(kind))
        rows.append(f'| `"{name}"` | {keys} | {about(kind).replace("|", chr(92) + "|")} |')
    return "\n".join(rows)


def unit_in(kind: Any) -> str:
    """Return the unit that a field is declared with, empty where it has none."""
    if get_origin(kind) is Annotated:
        return next((each.unit for each in get_args(kind)[1:] if isinstance(each, Quantity)), "")
    return next((unit for each in get_args(kind) if each is not NoneType and (unit := unit_in(each))), "")


def _limits(validator: Any) -> str:
    inner = getattr(validator, "validator", validator)
    return str(getattr(inner, "text", ""))


def _toml(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else f"{value}"
