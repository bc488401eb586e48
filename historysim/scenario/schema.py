"""Structuring of TOML tables as frozen attrs classes; each message has the path to its key."""

import re
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, cast, get_args, get_origin

import attrs
from cattrs import Converter
from cattrs.errors import (
    AttributeValidationNote,
    BaseValidationError,
    ForbiddenExtraKeysError,
    IterableValidationError,
    IterableValidationNote,
)
from cattrs.gen import make_dict_structure_fn, override

from historysim.basics.fields import Key, Quantity, field_unit
from historysim.basics.files import is_file, path_state
from historysim.basics.limits import SIZE, is_workable
from historysim.basics.registry import Registry
from historysim.basics.units import describe_expected
from historysim.basics.wording import format_value, nearest
from historysim.errors import InputError, error_path, field_error, path_text
from historysim.tables import Column, Format, Table, join_tables, read_table
from historysim.tables.readers import list_files

T = TypeVar("T")
Place = tuple[str | int, ...]

MOST_PROBLEMS = 10
LONG_PROBLEM = 120  # characters of a message that is not repeated for further keys


@contextmanager
def located_errors(source: str) -> Iterator[None]:
    """Turn errors raised inside into one InputError with a line ``source: path: problem`` for each."""
    try:
        yield
    except (InputError, BaseValidationError, ForbiddenExtraKeysError) as error:
        first_keys: dict[str, str] = {}
        problems = []
        for line in _problems(error):
            key, _, problem = line.partition(": ")
            first_key = first_keys.setdefault(problem, key)
            is_repeated = first_key != key and len(problem) > LONG_PROBLEM
            problems.append(
                f"{source}: {f'{key}: the same problem as above' if is_repeated else line}"
            )
        more = (
            [f"… and {len(problems) - MOST_PROBLEMS} more"] if len(problems) > MOST_PROBLEMS else []
        )
        raise InputError("\n".join(problems[:MOST_PROBLEMS] + more)) from error


def _number(value: object, unit: str) -> float:
    from historysim.basics.units import quantity

    big = isinstance(value, int) and value.bit_length() > 1000
    if isinstance(value, bool) or big or not isinstance(value, int | float | str):
        expected = "a number" if unit == "1" else f"a number in {unit}, or a string with a unit"
        raise InputError(f"{format_value(value)}; expected {expected}")
    number = quantity(value, unit)
    if not is_workable(number):
        raise InputError(f"{format_value(value)}; expected {SIZE}, in SI")
    return number


def structure_array(value: object, structure: Callable[[Any], T]) -> tuple[T, ...]:
    """Structure each item of a TOML array; IterableValidationError with the errors of all items."""
    if not isinstance(value, list):
        raise InputError(f"{format_value(value)}; expected an array [ … ]")
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


def _components(entry: Mapping[str, object], quantity: Quantity) -> tuple[float | None, ...]:
    for key in entry:
        if key not in quantity.components:
            raise field_error(f"unknown key; {nearest(key, quantity.components)}", key)
    values = []
    for name in quantity.components:
        with cattrs_note(name):
            values.append(_number(entry[name], quantity.unit) if name in entry else None)
    return tuple(values)


def _quantity_hook(kind: object) -> Callable[[object, object], float | tuple[float | None, ...]]:
    plain, quantity = get_args(kind)
    one_or_many = isinstance(plain, UnionType) or quantity.alone

    def structure(value: object, _: object) -> float | tuple[float | None, ...]:
        if isinstance(value, dict) and quantity.components:
            return _components(value, quantity)
        if isinstance(value, list) if one_or_many else get_origin(plain) is tuple:
            return structure_array(value, lambda item: _number(item, quantity.unit))
        return _number(value, quantity.unit)

    return structure


@attrs.frozen
class KindIn:
    """Mark of a field whose table names its class, a kind of a registry that is imported on use."""

    registry: str  #: as ``"module:NAME"``
    key: str = "kind"  #: key that holds the name
    alone: bool = False  #: whether a plain name is accepted instead of a table


AnyFrictionLaw = Annotated[Any, KindIn("historysim.asperities.law:LAWS", "law")]
AnyAttraction = Annotated[Any, KindIn("historysim.asperities.law:ATTRACTIONS", "law")]
AnyWearLaw = Annotated[Any, KindIn("historysim.asperities.law:WEAR_LAWS", "law")]
AnyYieldingLaw = Annotated[
    Any, KindIn("historysim.asperities.law:YIELDING_LAWS", "law", alone=True)
]


def _is_marked(kind: object, mark: type) -> bool:
    return get_origin(kind) is Annotated and isinstance(get_args(kind)[1], mark)


def _kind_hook(kind: object, converter: Converter) -> Callable[[object, object], object]:
    mark: KindIn = get_args(kind)[1]
    module, _, name = mark.registry.partition(":")

    def structure(value: object, _: object) -> object:
        kinds = getattr(import_module(module), name)
        entry = {mark.key: value} if mark.alone and isinstance(value, str) else value
        return kind_from_toml(converter, entry, kinds, mark.key)

    return structure


@attrs.frozen
class ColumnsOf:
    """Validator of the columns of a file: required and optional keys."""

    needed: str
    optional: str = ""

    def __call__(
        self, _: object, attribute: "attrs.Attribute[Any]", value: Mapping[str, object]
    ) -> None:
        """Check the keys."""
        needed = self.needed.split()
        allowed = [*needed, *self.optional.split()]
        for key in value:
            if key not in allowed:
                raise field_error(f"unknown key; {nearest(key, allowed)}", attribute.name, key)
        for key in needed:
            if key not in value:
                raise field_error("missing; expected a column", attribute.name, key)


def _table_of_hook(
    kind: object, converter: Converter
) -> Callable[[object, object], dict[str, object]]:
    of = get_args(kind)[1]

    def structure(value: object, _: object) -> dict[str, object]:
        structured = {}
        for key, item in table(value).items():
            with cattrs_note(key):
                structured[key] = item if of is Any else converter.structure(item, of)
        return structured

    return structure


_SCALARS = {bool: "true or false", int: "a whole number", float: "a number", str: "a string"}


def _is_one_of_several(kind: object) -> bool:
    if get_origin(kind) not in {Union, UnionType}:
        return False
    members = [member for member in get_args(kind) if member is not NoneType]
    return len(members) > 1 and all(
        member in _SCALARS or get_origin(member) is tuple for member in members
    )


def _several_hook(kind: object, converter: Converter) -> Callable[[object, object], object]:
    """Structure a value of a union type as the member type that matches it."""
    members: dict[Any, Any] = {
        get_origin(member) or member: member for member in get_args(kind) if member is not NoneType
    }
    number: Any = Annotated[float, Quantity("1")]

    def structure(value: object, _: object) -> object:
        of: Any = {list: tuple, int: int if int in members else float}.get(type(value), type(value))
        if of in members:
            return converter.structure(value, number if of is float else members[of])
        descriptions = {**_SCALARS, tuple: "an array"}
        expected = " or ".join(text for member, text in descriptions.items() if member in members)
        raise InputError(f"{format_value(value)}; expected {expected}")

    return structure


def _array_hook(
    kind: object, converter: Converter
) -> Callable[[object, object], tuple[object, ...]]:
    of = get_args(kind)[0]
    return lambda value, _: structure_array(value, lambda item: converter.structure(item, of))


@contextmanager
def cattrs_note(key: str) -> Iterator[None]:
    """Add the key to an error raised inside, as a note of cattrs."""
    try:
        yield
    except Exception as error:
        error.add_note(AttributeValidationNote("", key, None))
        raise


def from_table(cls: type[T], value: object, converter: Converter, *as_given: str) -> T:
    """Structure a TOML table as a class; the fields ``as_given`` are passed unchanged."""
    instance: Any = _structure_hook(cast("Any", cls), converter, as_given)(value, cls)
    return cast("T", instance)


@cache
def _structure_hook(
    cls: Hashable, converter: Converter, as_given: tuple[str, ...]
) -> Callable[[object, object], object]:
    plainly: dict[str, Any] = {
        name: override(struct_hook=lambda value, _: value) for name in as_given
    }
    return make_table_hook(cast("Any", cls), converter, **plainly)


def with_kinds(cls: type[T], value: object, converter: Converter, *, in_turn: bool = False) -> T:
    """Structure a table as a class, with further keys that are names of registered kinds.

    ``cls.event_keys`` names the field for these keys and their registry. A single value of an event
    becomes a tuple of its fields without the time; a table becomes the event. With ``in_turn`` the
    value is an array.
    """
    of: Any = cls
    field, kinds = of.event_keys
    entry, changes = dict(table(value)), dict[str, Any]()
    own_keys = {field_.name for field_ in attrs.fields(of)} - {field}
    for key in sorted(entry.keys() - own_keys, key=[*kinds.own(), *entry].index):
        if key == field:
            raise field_error("unknown key", key)
        if key in kinds:
            with cattrs_note(key):
                changes[key] = _structure_event(
                    kinds[key], entry.pop(key), converter, in_turn=in_turn
                )
    return from_table(cls, {**entry, field: changes}, converter, field)


def single_value_type(kind: Any) -> tuple[Any, bool]:  # noqa: ANN401 - classes and their annotations
    """Return the type of the single value that can replace a table of a kind, and whether the kind has a time field."""
    first_field, *further_fields = attrs.fields(attrs.resolve_types(kind))
    timed = first_field.name == "time"
    return (further_fields[0].type if timed else first_field.type), timed


def _structure_event(kind: Any, value: Any, converter: Converter, *, in_turn: bool) -> object:  # noqa: ANN401 - of TOML
    of, timed = single_value_type(kind)
    quantity = get_args(of)[1] if _is_marked(of, Quantity) else None
    by_component = (
        quantity is not None
        and quantity.components
        and isinstance(value, dict)
        and "value" not in value
    )
    if isinstance(value, dict) and not by_component:
        return converter.structure({"time": 0.0, **value} if timed else value, kind)
    if in_turn:
        return structure_array(value, lambda item: converter.structure(item, of))
    values = (converter.structure(value, of),)
    return values if timed else kind(*values)


def make_table_hook(
    cls: type,
    converter: Converter,
    **fields: Any,  # noqa: ANN401 - overrides of cattrs, which does not export their type
) -> Callable[[object, object], object]:
    """Return the function that structures a TOML table as a class; fields accept overrides of cattrs."""
    from_dict: Callable[[Any, Any], object] = make_dict_structure_fn(
        cls, converter, _cattrs_forbid_extra_keys=True, **fields
    )

    def structure(value: object, kind: object) -> object:
        return from_dict(table(value), kind)

    return structure


def kind_from_toml(
    converter: Converter,
    value: object,
    kinds: Registry[type[T]],
    key: str = "kind",
    among: type = object,
) -> T:
    """Structure a TOML table as the class that its ``key`` names in ``kinds``, a subclass of ``among``.

    Raises InputError: not a table, an unknown kind, or a kind of a package that cannot be imported.
    """
    entry = dict(table(value))
    if key not in entry:
        raise field_error(f"missing; expected one of {', '.join(kinds.names(among))}", key)
    with error_path(key):
        kind: Any = kinds.lookup(entry.pop(key), among)
    return cast(
        "T", converter.structure(entry, kind.chosen(entry) if hasattr(kind, "chosen") else kind)
    )


def explicit_fields(section: attrs.AttrsInstance) -> dict[str, Any]:
    """Return the fields of a section that are not None, by name."""
    return {
        key: value
        for key, value in attrs.asdict(section, recurse=False).items()
        if value is not None
    }


def table(value: object) -> dict[str, Any]:
    """Return the value if it is a TOML table; InputError otherwise."""
    if not isinstance(value, dict):
        raise InputError(f"{format_value(value)}; expected a table")
    return value


def text(value: object, _: object = str) -> str:
    """Return a non-blank string; InputError for any other value."""
    if not isinstance(value, str):
        raise InputError(f"{format_value(value)}; expected a string")
    if not value.strip():
        raise InputError(f"{format_value(value)}; expected a string that is not blank")
    return value


def _integer(value: object, _: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{format_value(value)}; expected an integer")
    if value.bit_length() > 63:
        raise InputError(
            f"{format_value(value)}; expected an integer of 64 bits at most, as TOML has them"
        )
    return value


def _boolean(value: object, _: object) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{format_value(value)}; expected true or false")
    return value


def schema_converter() -> Converter:
    """Return a converter for the types of this module; it rejects unknown keys."""
    converter = Converter(forbid_extra_keys=True)
    converter.register_structure_hook(str, text)
    converter.register_structure_hook(int, _integer)
    converter.register_structure_hook(bool, _boolean)
    converter.register_structure_hook_factory(attrs.has, make_table_hook)
    factories: tuple[tuple[Callable[[Any], bool], Any], ...] = (
        (
            lambda kind: hasattr(kind, "from_toml"),
            lambda cls, within: lambda value, _: cls.from_toml(value, within),
        ),
        (lambda kind: get_origin(kind) is tuple, _array_hook),
        (lambda kind: get_origin(kind) is dict, _table_of_hook),
        (_is_one_of_several, _several_hook),
        (lambda kind: _is_marked(kind, Quantity), _quantity_hook),
        (lambda kind: _is_marked(kind, KindIn), _kind_hook),
    )
    for fits, hook in factories:
        converter.register_structure_hook_factory(fits, hook)
    return converter


def _problems(error: BaseException, above: Place = ()) -> Iterator[str]:
    kind = None
    for note in reversed(getattr(error, "__notes__", ())):
        if isinstance(note, IterableValidationNote):
            above = (*above, note.index)
        elif isinstance(note, AttributeValidationNote):
            above, kind = (*above, note.name), note.type
    match error:
        case BaseExceptionGroup():
            for inner in error.exceptions:
                yield from _problems(inner, above)
        case ForbiddenExtraKeysError():
            field, kinds = getattr(error.cl, "event_keys", ("", None))
            keys = [
                attribute.name for attribute in attrs.fields(error.cl) if attribute.name != field
            ]
            keys += [] if kinds is None else kinds.own()
            for key in sorted(error.extra_fields):
                hint = getattr(error.cl, "hint_for_key", lambda _: "")(key) or nearest(key, keys)
                yield f"{path_text((*above, key))}: unknown key; {hint}"
        case KeyError():
            yield _line(above, f"missing; expected {_expected_value(kind, above)}")
        case InputError():
            path, problem = (*above, *error.place), str(error.args[0])
            section = problem.endswith("; expected a table") and all(
                isinstance(step, str) for step in path
            )
            yield _line(
                path,
                problem + (f", such as [{path_text(path)}] with its keys below" if section else ""),
            )
        case _:
            raise error


def _expected_value(kind: Any, path: Place) -> str:  # noqa: ANN401 - a type
    """Describe the expected value of a missing key."""
    if unit := field_unit(kind):
        return describe_expected(unit)
    members = get_args(kind) if get_origin(kind) in {Union, UnionType} else (kind,)
    member = next((candidate for candidate in members if candidate is not NoneType), kind)
    if (len(path) == 1 and member is not str) or get_origin(member) is dict:
        return f"a section [{path_text(path)}]"
    return _SCALARS.get(member if isinstance(member, type) else object, "a value")


def _line(path: Place, problem: str) -> str:
    return f"{path_text(path)}: {problem}" if path else problem


# -- files of numbers: sections that name a file, and its columns
# -----------------------------------------------


# sections that name a file inherit from a second class, and two bases with slots cannot be combined
@attrs.frozen(kw_only=True, slots=False)
class NumbersFile(Format):
    """One or several consecutive files of numbers, and their text format."""

    #: Path, relative to the scenario; an array of paths is one record in several files, in this
    #: order. A folder, or a pattern such as ``"cycles/*.csv"``, is all its files in natural order;
    #: of a record each of them is a run.
    file: str | tuple[str, ...] = attrs.field(
        validator=Key(
            lambda files: files != (), "the path of a file, or of several consecutive files"
        )
    )

    @property
    def files(self) -> tuple[str, ...]:
        """The paths in the scenario."""
        return self.file if isinstance(self.file, tuple) else (self.file,)

    def paths(self, folder: Path) -> list[Path]:
        """Return the paths of its files, with those of folders and patterns; its paths are relative to the folder."""
        with error_path("file"):
            return [path for file in self.files for path in list_files(folder / file)]

    @property
    def name(self) -> str:
        """The names of its files, for messages."""
        return ", ".join(Path(file).name for file in self.files)

    def table(
        self,
        folder: Path,
        columns: Mapping[str, Column],
        units: Mapping[str, str | tuple[str, ...]],
        *,
        missing: bool = False,
        by_time: bool = False,
    ) -> Table:
        """Read its columns in the given units; its path is relative to the folder; options as of `read_table`."""
        tables = []
        paths = self.paths(folder)
        for path in paths:
            if not is_file(path):
                problem = f"{path_state(path)} in {path.absolute().parent}; expected a path relative to the scenario"
                if re.search(r"[\\\x00-\x1f]", str(path)):
                    problem += ", with / between folders"
                raise field_error(f"{path.name}: {problem}", "file")
            try:
                tables.append(
                    read_table(path, columns, units, self, missing=missing, by_time=by_time)
                )
            except InputError as error:
                # errors without a key concern the file
                error.place = error.place or ("file",)
                raise
        if len(tables) == 1:
            return tables[0]
        with error_path("file"):
            return join_tables([path.name for path in paths], tables)

    def read(
        self,
        folder: Path,
        columns: Mapping[str, Column],
        units: Mapping[str, str],
        build: Callable[..., T],
    ) -> T:
        """Pass its columns to a function by key and return the result; errors of the function name the file."""
        values = self.table(folder, columns, units).columns
        try:
            return build(**values)
        except InputError as error:
            raise field_error(f"{self.name}: {error.args[0]}", "file") from error


def column_from_toml(value: object, kind: type[Column] = Column) -> Column:
    """Structure a column: ``"name"`` or ``{ column = "name", unit = "mN" }``; InputError for any other value."""
    if not isinstance(value, dict):
        return kind(text(value))
    keys = [field.name for field in attrs.fields(kind)]
    for key in value:
        if key not in keys:
            raise field_error(f"unknown key; {nearest(key, keys)}", key)
    if "column" not in value:
        raise field_error("missing; expected the name of a column in the file", "column")
    return kind(**value)


def register_column_hooks(converter: Converter) -> None:
    """Register hooks for columns and for keys of a text format; the classes check these themselves (blanks count)."""
    converter.register_structure_hook(Column, column_from_toml)
    as_given = override(
        struct_hook=lambda value, _: tuple(value) if isinstance(value, list) else value
    )
    keys = {field.name: as_given for field in attrs.fields(Format)}
    converter.register_structure_hook_factory(
        lambda kind: isinstance(kind, type) and issubclass(kind, Format),
        lambda kind, within: make_table_hook(kind, within, **keys),
    )
