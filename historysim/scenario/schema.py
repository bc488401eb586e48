"""TOML tables → frozen attrs classes; every message carries the path to its field.

A section of a scenario is an attrs class. Its fields are declared with the types of this module, which
say what unit a value has; the rest (unknown keys, missing keys, wrong types) follows from the class.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import UnionType
from typing import Annotated, Any, TypeVar, get_args, get_origin

import attrs
from cattrs import Converter
from cattrs.errors import (
    AttributeValidationNote,
    BaseValidationError,
    ForbiddenExtraKeysError,
    IterableValidationError,
    IterableValidationNote,
)
from cattrs.gen import make_dict_structure_fn

from historysim.basics.fields import Quantity
from historysim.basics.places import at, misfit
from historysim.basics.registry import Registry
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError, path_text

T = TypeVar("T")
Place = tuple[str | int, ...]

MOST_PROBLEMS = 10


@contextmanager
def reported(source: str) -> Iterator[None]:
    """Turn what was raised inside into one message with the path to each field.

    Raises InputError: one line ``source: path: problem`` for each problem.
    """
    try:
        yield
    except (InputError, BaseValidationError, ForbiddenExtraKeysError) as error:
        problems = [f"{source}: {problem}" for problem in _problems(error)]
        more = [f"… and {len(problems) - MOST_PROBLEMS} more"] if len(problems) > MOST_PROBLEMS else []
        raise InputError("\n".join(problems[:MOST_PROBLEMS] + more)) from error


def _number(value: object, unit: str) -> float:
    from historysim.basics.units import quantity

    if not isinstance(value, int | float | str) or (isinstance(value, int) and value.bit_length() > 1000):
        expected = "a number" if unit == "1" else f"a number in {unit}, or a text with a unit"
        raise InputError(f"{shown(value)}; expected {expected}")
    return quantity(value, unit)


def array_of(value: object, structure: Callable[[Any], T]) -> tuple[T, ...]:
    """Return the items of a TOML array, each structured; messages carry their places.

    Raises
    ------
    InputError
        No array.
    IterableValidationError
        Items that cannot be used.
    """
    if not isinstance(value, list):
        raise InputError(f"{shown(value)}; expected an array [ … ]")
    items, errors = [], []
    for index, item in enumerate(value):
        try:
            items.append(structure(item))
        except Exception as error:  # noqa: BLE001 - gathered and raised as one below
            error.add_note(IterableValidationNote("", index, None))
            errors.append(error)
    if errors:
        raise IterableValidationError("array", errors, tuple)
    return tuple(items)


def _is_quantity(kind: object) -> bool:
    return get_origin(kind) is Annotated and isinstance(get_args(kind)[1], Quantity)


def _quantity_hook(kind: object) -> Callable[[object, object], float | tuple[float, ...]]:
    plain, quantity = get_args(kind)
    one_or_many = isinstance(plain, UnionType)

    def structure(value: object, _: object) -> float | tuple[float, ...]:
        if get_origin(plain) is tuple or (one_or_many and isinstance(value, list)):
            return array_of(value, lambda item: _number(item, quantity.unit))
        return _number(value, quantity.unit)

    return structure


def _is_array(kind: object) -> bool:
    return get_origin(kind) is tuple


def _array_hook(kind: object, converter: Converter) -> Callable[[object, object], tuple[object, ...]]:
    of = get_args(kind)[0]
    return lambda value, _: array_of(value, lambda item: converter.structure(item, of))


def table_hook(
    cls: type,
    converter: Converter,
    **fields: Any,  # noqa: ANN401 - overrides of cattrs, which does not export their type
) -> Callable[[object, object], object]:
    """Return what structures a TOML table as a class; fields take overrides of cattrs."""
    from_dict: Callable[[Any, Any], object] = make_dict_structure_fn(
        cls, converter, _cattrs_forbid_extra_keys=True, **fields
    )

    def structure(value: object, kind: object) -> object:
        return from_dict(table(value), kind)

    return structure


def kind_from_toml(
    converter: Converter, value: object, kinds: Registry[Any], key: str = "kind", among: type = object
) -> Any:  # noqa: ANN401 - of the class that is named
    """Return what a TOML table says whose ``key`` names the class that its other keys belong to.

    Of ``kinds`` those ``among`` the subclasses of a class.

    Raises InputError: no table, no such kind, or one of a package that cannot be used.
    """
    entry = dict(table(value))
    if key not in entry:
        raise misfit(f"missing; expected one of {', '.join(kinds.names(among))}", key)
    with at(key):
        kind = kinds.named(entry.pop(key), among)
    return converter.structure(entry, kind.chosen(entry) if hasattr(kind, "chosen") else kind)


def given(section: attrs.AttrsInstance) -> dict[str, Any]:
    """Return the keys of a section that stand in the file, with their values."""
    return {key: value for key, value in attrs.asdict(section, recurse=False).items() if value is not None}


def table(value: object) -> dict[str, Any]:
    """Return a value that is a TOML table; anything else is an InputError."""
    if not isinstance(value, dict):
        raise InputError(f"{shown(value)}; expected a table")
    return value


def text(value: object, _: object = str) -> str:
    """Return a value that is a text and not blank; anything else is an InputError."""
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{shown(value)}; expected a text" + (" that is not blank" if isinstance(value, str) else ""))
    return value


def _integer(value: object, _: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{shown(value)}; expected an integer")
    if value.bit_length() > 63:
        raise InputError(f"{shown(value)}; expected an integer of 64 bits at most, as TOML has them")
    return value


def _boolean(value: object, _: object) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{shown(value)}; expected true or false")
    return value


def schema_converter() -> Converter:
    """Return a converter that knows the types of this module and refuses everything else."""
    converter = Converter(forbid_extra_keys=True)
    converter.register_structure_hook(str, text)
    converter.register_structure_hook(int, _integer)
    converter.register_structure_hook(bool, _boolean)
    converter.register_structure_hook_func(
        lambda kind: kind == (int | str),
        lambda value, kind: text(value) if isinstance(value, str) else _integer(value, kind),
    )
    converter.register_structure_hook_factory(attrs.has, table_hook)
    converter.register_structure_hook_factory(_is_array, _array_hook)
    converter.register_structure_hook_factory(_is_quantity, _quantity_hook)
    return converter


def _problems(error: BaseException, above: Place = ()) -> Iterator[str]:
    for note in reversed(getattr(error, "__notes__", ())):
        if isinstance(note, IterableValidationNote):
            above = (*above, note.index)
        elif isinstance(note, AttributeValidationNote):
            above = (*above, note.name)
    match error:
        case BaseExceptionGroup():
            for inner in error.exceptions:
                yield from _problems(inner, above)
        case ForbiddenExtraKeysError():
            known = [field.name for field in attrs.fields(error.cl)]
            for key in sorted(error.extra_fields):
                yield f"{path_text((*above, key))}: unknown key; {nearest(key, known)}"
        case KeyError():
            yield _said(above, "missing; expected a value")
        case InputError():
            yield _said((*above, *error.place), str(error.args[0]))
        case _:
            raise error


def _said(place: Place, problem: str) -> str:
    return f"{path_text(place)}: {problem}" if place else problem
