"""Fields of classes that are selected in scenarios: units and limits, declared in the class."""

import functools
import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

import attrs

from historysim.basics.limits import LARGEST, SMALLEST, is_workable
from historysim.basics.units import as_float, convert_each, is_number, to_si
from historysim.basics.wording import format_value
from historysim.errors import InputError, field_error


@attrs.frozen
class Quantity:
    """Marks a field as a number in this SI unit, or a string with a compatible unit.

    For an array, ``alone`` allows one number in place of an array with one element; ``components``
    are the keys of a table that may replace an array, with a number for some of them.
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
    """Validator of a finite number: at least, or above, a bound."""

    least: float
    above: bool = attrs.field(default=False, kw_only=True)

    def __call__(self, of: object, attribute: "attrs.Attribute[float]", value: Any) -> None:
        """Check a value."""
        smallest = SMALLEST if self.above and self.least == 0 else 0.0
        fits = is_number(value) and is_workable(value, smallest)
        if not (fits and (value > self.least if self.above else value >= self.least)):
            bound = "finite" if self.least == -math.inf else f"of {self.least:g} or more"
            raise InputError(
                f"{type(of).__name__}: {attribute.name} is {value!r}; expected a number "
                f"{f'above {self.least:g}' if self.above else bound}, and of at most {LARGEST:g} in size"
            )

    @property
    def text(self) -> str:
        """Short form of the limit."""
        return "" if self.least == -math.inf else f"{'>' if self.above else '≥'} {self.least:g}"


@attrs.frozen
class OneOf:
    """Validator of one of several words."""

    words: tuple[str, ...]

    def __call__(self, of: object, attribute: "attrs.Attribute[str]", value: Any) -> None:
        """Check a value."""
        if value not in self.words:
            expected = " or ".join(map(repr, self.words))
            raise InputError(
                f"{type(of).__name__}: {attribute.name} is {value!r}; expected {expected}"
            )

    @property
    def text(self) -> str:
        """Short form of the limit."""
        return " or ".join(f'"{word}"' for word in self.words)


@attrs.frozen
class Key:
    """Validator of a key of a scenario, whose errors name the key; None is valid."""

    fits: Callable[[Any], bool]
    expected: str

    def __call__(self, _: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        """Check a value."""
        if value is not None and not self.fits(value):
            value_text = f"{value:g}" if isinstance(value, float) else format_value(value)
            raise field_error(f"{value_text}; expected {self.expected}", attribute.name)


@attrs.frozen
class KeyLimit:
    """Validator of a key with one or several numbers that are ≥ 0, or > 0; None is valid."""

    text: str

    def __call__(self, _: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        """Check a value."""
        unit = field_unit(attribute.type).replace("m2", "m²").removeprefix("1")
        of_unit = f" {unit}" if unit else ""
        above = self.text == "> 0"
        for number in value if isinstance(value, tuple) else (value,):
            if number is not None and not (number > 0 if above else number >= 0):
                expected = f"more than 0{of_unit}" if above else f"0{of_unit} or more"
                raise field_error(f"{number:g}{of_unit}; expected {expected}", attribute.name)


at_least = AtLeast
NOT_NEGATIVE, POSITIVE = KeyLimit("≥ 0"), KeyLimit("> 0")


def choice(*words: str) -> OneOf:
    """Return a validator of one of several words."""
    return OneOf(words)


@attrs.frozen
class Field:
    """Field of a class, as documented to users."""

    name: str
    unit: str  #: SI unit; "1" for a plain number, empty for other types
    needed: bool
    default: Any
    limits: str  #: condition of valid values, as ``"> 0"``

    @property
    def text(self) -> str:
        """Short description: ``"reference_load [N] > 0"``."""
        unit = f" [{self.unit}]" if self.unit not in {"", "1"} else ""
        words = ":" if self.limits.startswith('"') else ""
        limits = f"{words} {self.limits}" if self.limits else ""
        default = (
            ""
            if self.needed or self.default in {None, "", ()}
            else f" (default {_toml(self.default)})"
        )
        return f"{self.name}{unit}{limits}{default}"


class QuantityFields:
    """Base of attrs classes whose constructors accept strings with units for the fields annotated with a `Quantity`.

    Only for type checkers a field needs a converter from `historysim.basics.units` in addition.
    """

    __slots__ = ()

    @classmethod
    def __attrs_init_subclass__(cls) -> None:
        """Let the constructor convert the fields with a unit and without a converter; attrs calls this."""
        if "__init__" not in vars(cls) or "__attrs_init__" in vars(cls):
            # the class has a constructor of its own
            return
        kind: Any = cls
        if any(isinstance(field.type, str) for field in attrs.fields(kind)):
            with suppress(NameError):
                attrs.resolve_types(kind)
        fields = [field for field in attrs.fields(kind) if field.init and field.converter is None]
        units = {field.alias: unit for field in fields if (unit := field_unit(field.type))}
        construct = cls.__init__
        # a signature takes longer than the class, and most classes have no instance in a run
        read_signature = functools.cache(lambda: inspect.signature(construct))

        @functools.wraps(construct)
        def convert_and_construct(*arguments: Any, **options: Any) -> None:
            bound = read_signature().bind(*arguments, **options)
            bound.apply_defaults()
            for name, unit in units.items():
                if (value := bound.arguments[name]) is not attrs.NOTHING:
                    bound.arguments[name] = _convert(value, unit, f"{cls.__name__}: {name}")
            construct(*bound.args, **bound.kwargs)

        if units:
            cls.__init__ = convert_and_construct  # type: ignore[method-assign]


def _convert(value: Any, unit: str, name: str) -> Any:
    try:
        return convert_each(as_float, to_si(value, unit))
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def list_fields(kind: type) -> Iterator[Field]:
    """Yield the fields of an attrs class, required ones first; nothing for other classes."""
    if not attrs.has(kind):
        return
    attrs.resolve_types(kind)
    fields = [
        Field(
            attribute.name,
            field_unit(attribute.type),
            attribute.default is attrs.NOTHING,
            None if isinstance(attribute.default, attrs.Factory) else attribute.default,  # type: ignore[arg-type]
            _limits(attribute.validator),
        )
        for attribute in attrs.fields(kind)
        if attribute.init
    ]
    yield from sorted(fields, key=lambda field: not field.needed)


def about(kind: type) -> str:
    """Return the first paragraph of the docstring of a class as one line."""
    return " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split())


def markdown(kinds: Mapping[str, type], heading: str) -> str:
    """Return the Markdown table of classes and their keys for the documentation."""
    rows = [f"| {heading} | keys | |", "| --- | --- | --- |"]
    for name, kind in kinds.items():
        keys = "; ".join(
            f"`{field.name}`{field.text.removeprefix(field.name)}" for field in list_fields(kind)
        )
        rows.append(f'| `"{name}"` | {keys} | {about(kind).replace("|", chr(92) + "|")} |')
    return "\n".join(rows)


def field_unit(kind: Any) -> str:
    """Return the declared unit of a field, empty if it has none."""
    if get_origin(kind) is Annotated:
        return next(
            (argument.unit for argument in get_args(kind)[1:] if isinstance(argument, Quantity)), ""
        )
    return next(
        (
            unit
            for argument in get_args(kind)
            if argument is not NoneType and (unit := field_unit(argument))
        ),
        "",
    )


def _limits(validator: Any) -> str:
    inner = getattr(validator, "validator", validator)
    return str(getattr(inner, "text", ""))


def _toml(value: Any) -> str:
    return (
        f'"{value}"'
        if isinstance(value, str)
        else str(value).lower()
        if isinstance(value, bool)
        else f"{value}"
    )
