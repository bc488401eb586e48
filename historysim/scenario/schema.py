"""Structuring of TOML tables as frozen attrs classes; each message has the path to its key."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, cast, get_args, get_origin

import attrs

from historysim.basics.fields import Key, Quantity, field_unit
from historysim.basics.files import is_file, path_state
from historysim.basics.limits import SIZE, is_workable
from historysim.basics.registry import Registry
from historysim.basics.units import describe_expected, quantity
from historysim.basics.wording import format_value, nearest
from historysim.errors import InputError, error_path, field_error, path_text
from historysim.tables import Column, Format, Table, join_tables, read_table
from historysim.tables.readers import list_files

T = TypeVar("T")
Place = tuple[str | int, ...]
Structure = Callable[[Any], Any]  # from a TOML value

MOST_PROBLEMS = 10
LONG_PROBLEM = 120  # characters of a message that is not repeated for further keys


# -- errors ---------------------------------------------------------------------------------------


class _MissingKeyError(InputError):
    """A key without a value; its argument is the type of the key."""


@contextmanager
def _collect(errors: list[InputError], *place: str | int) -> Iterator[None]:
    """Append the errors raised inside to a list, with their place."""
    try:
        with error_path(*place):
            yield
    except InputError as error:
        errors.append(error)
    except ExceptionGroup as group:
        errors += cast("Any", group.exceptions)


def _raise_collected(errors: list[InputError]) -> None:
    if errors:
        raise ExceptionGroup("several keys", errors)


@contextmanager
def located_errors(source: str) -> Iterator[None]:
    """Turn errors raised inside into one InputError with a line ``source: path: problem`` for each."""
    errors: list[InputError] = []
    with _collect(errors):
        yield
    if not errors:
        return
    first_keys: dict[str, str] = {}
    problems = []
    for error in errors:
        # an error of another file has its lines already
        key, problem = path_text(error.place), _problem(error)
        first_key = first_keys.setdefault(problem, key)
        is_repeated = first_key != key and len(problem) > LONG_PROBLEM
        line = "the same problem as above" if is_repeated else problem
        problems.append(f"{source}: {key}: {line}" if key else f"{source}: {line}")
    count = len(problems) - MOST_PROBLEMS
    more = [f"… and {count} more"] if count > 0 else []
    raise InputError("\n".join(problems[:MOST_PROBLEMS] + more)) from errors[0]


def _problem(error: InputError) -> str:
    """Return the message of an error without its place."""
    place = error.place
    if isinstance(error, _MissingKeyError):
        return f"missing; expected {_expected_value(error.args[0], place)}"
    problem = str(error.args[0])
    is_section = problem.endswith("; expected a table") and all(
        isinstance(step, str) for step in place
    )
    return problem + (f", such as [{path_text(place)}] with its keys below" if is_section else "")


def _expected_value(kind: Any, path: Place) -> str:  # noqa: ANN401 - a type
    """Describe the expected value of a missing key."""
    if unit := field_unit(kind):
        return describe_expected(unit)
    member = next(iter(_members(kind)), kind)
    if (len(path) == 1 and member is not str) or get_origin(member) is dict:
        return f"a section [{path_text(path)}]"
    return _SCALARS.get(member if isinstance(member, type) else object, "a value")


# -- values ---------------------------------------------------------------------------------------


def table(value: object) -> dict[str, Any]:
    """Return the value if it is a TOML table; InputError otherwise."""
    if not isinstance(value, dict):
        raise InputError(f"{format_value(value)}; expected a table")
    return value


def text(value: object) -> str:
    """Return a non-blank string; InputError for any other value."""
    if not isinstance(value, str):
        raise InputError(f"{format_value(value)}; expected a string")
    if not value.strip():
        raise InputError(f"{format_value(value)}; expected a string that is not blank")
    return value


def _integer(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{format_value(value)}; expected an integer")
    if value.bit_length() > 63:
        raise InputError(
            f"{format_value(value)}; expected an integer of 64 bits at most, as TOML has them"
        )
    return value


def _boolean(value: object) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{format_value(value)}; expected true or false")
    return value


def _number(value: object, unit: str = "1") -> float:
    big = isinstance(value, int) and value.bit_length() > 1000
    if isinstance(value, bool) or big or not isinstance(value, int | float | str):
        expected = "a number" if unit == "1" else f"a number in {unit}, or a string with a unit"
        raise InputError(f"{format_value(value)}; expected {expected}")
    number = quantity(value, unit)
    if not is_workable(number):
        raise InputError(f"{format_value(value)}; expected {SIZE}, in SI")
    return number


def structure_array(value: object, structure: Callable[[Any], T]) -> tuple[T, ...]:
    """Structure each item of a TOML array; an ExceptionGroup has the errors of all items."""
    if not isinstance(value, list):
        raise InputError(f"{format_value(value)}; expected an array [ … ]")
    items: list[T] = []
    errors: list[InputError] = []
    for index, item in enumerate(value):
        with _collect(errors, index):
            items.append(structure(item))
    _raise_collected(errors)
    return tuple(items)


def _components(entry: Mapping[str, object], quantity: Quantity) -> tuple[float | None, ...]:
    for key in entry:
        if key not in quantity.components:
            raise field_error(f"unknown key; {nearest(key, quantity.components)}", key)
    values = []
    for name in quantity.components:
        with error_path(name):
            values.append(_number(entry[name], quantity.unit) if name in entry else None)
    return tuple(values)


# -- types ----------------------------------------------------------------------------------------


@attrs.frozen
class ImportedKind:
    """Mark of a field whose class is imported on use: a class, or the kind of a registry that its table names."""

    path: str  #: of the class or the registry, as ``"module:NAME"``
    key: str = "kind"  #: key that holds the name
    alone: bool = False  #: whether a plain name is accepted instead of a table

    @property
    def imported(self) -> Any:  # noqa: ANN401 - a class or a registry
        """The class or the registry."""
        module, _, name = self.path.partition(":")
        return getattr(import_module(module), name)

    def structure(self, value: Any) -> object:  # noqa: ANN401 - of TOML
        """Structure a table as the class."""
        imported = self.imported
        if isinstance(imported, type):
            return structure(value, imported)
        entry = {self.key: value} if self.alone and isinstance(value, str) else value
        return kind_from_toml(entry, imported, self.key)


@attrs.frozen
class By:
    """Mark of a field that a function structures."""

    structure: Structure


AnyFrictionLaw = Annotated[Any, ImportedKind("historysim.asperities.law:LAWS", "law")]
AnyAttraction = Annotated[Any, ImportedKind("historysim.asperities.law:ATTRACTIONS", "law")]
AnyWearLaw = Annotated[Any, ImportedKind("historysim.asperities.law:WEAR_LAWS", "law")]
AnyYieldingLaw = Annotated[
    Any, ImportedKind("historysim.asperities.law:YIELDING_LAWS", "law", alone=True)
]

_SCALARS = {bool: "true or false", int: "a whole number", float: "a number", str: "a string"}
# functions that structure a value as a class
STRUCTURES: dict[Any, Structure] = {bool: _boolean, int: _integer, float: _number, str: text}


def structure(value: object, kind: Any) -> Any:  # noqa: ANN401 - types, and their values
    """Structure a TOML value as a type; InputError, or an ExceptionGroup of them, with paths of keys."""
    return _structure_of(kind)(value)


@cache
def _structure_of(kind: Any) -> Structure:  # noqa: ANN401 - a type
    """Return the function that structures a TOML value as a type."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        mark = arguments[1]
        return _quantity_structure(*arguments) if isinstance(mark, Quantity) else mark.structure
    if origin in {Union, UnionType}:
        return _union_structure(_members(kind))
    if origin is tuple:
        item = arguments[0]
        return lambda value: structure_array(value, _structure_of(item))
    if origin is dict:
        return lambda value: _structure_items(value, arguments[1])
    return _class_structure(kind)


def _class_structure(kind: Any) -> Structure:  # noqa: ANN401 - a class
    if kind in STRUCTURES:
        return STRUCTURES[kind]
    if hasattr(kind, "from_toml"):
        return cast("Structure", kind.from_toml)
    if isinstance(kind, type) and issubclass(kind, Column):
        return lambda value: column_from_toml(value, kind)
    if attrs.has(kind):
        return lambda value: from_table(kind, value)
    return lambda value: value


def _members(kind: Any) -> tuple[Any, ...]:  # noqa: ANN401 - a type
    """Return the types of a union besides None; the type itself if it is no union."""
    members = get_args(kind) if get_origin(kind) in {Union, UnionType} else (kind,)
    return tuple(member for member in members if member is not NoneType)


def _quantity_structure(plain: Any, quantity: Quantity) -> Structure:  # noqa: ANN401 - a type
    one_or_many = isinstance(plain, UnionType) or quantity.alone
    is_array = get_origin(plain) is tuple

    def read(value: object) -> object:
        if isinstance(value, dict) and quantity.components:
            return _components(value, quantity)
        if isinstance(value, list) if one_or_many else is_array:
            return structure_array(value, lambda item: _number(item, quantity.unit))
        return _number(value, quantity.unit)

    return read


def _union_structure(members: tuple[Any, ...]) -> Structure:
    """Return the function that structures a value as the member of a union that matches it."""
    if len(members) == 1:
        return _structure_of(members[0])
    by_type = {get_origin(member) or member: member for member in members}

    def read(value: object) -> object:
        number = int if int in by_type else float
        of = {list: tuple, int: number}.get(type(value), type(value))
        if of in by_type:
            return structure(value, by_type[of])
        descriptions = {**_SCALARS, tuple: "an array"}
        expected = " or ".join(text for member, text in descriptions.items() if member in by_type)
        raise InputError(f"{format_value(value)}; expected {expected}")

    return read


def _structure_items(value: object, kind: Any) -> dict[str, Any]:  # noqa: ANN401 - a type
    """Structure the values of a table with any keys."""
    structured = {}
    for key, item in table(value).items():
        with error_path(key):
            structured[key] = structure(item, kind)
    return structured


# -- tables of classes ----------------------------------------------------------------------------


def from_table(cls: type[T], value: object, *as_given: str) -> T:
    """Structure a TOML table as an attrs class; the fields ``as_given`` are passed unchanged.

    An ExceptionGroup has the errors of all keys.
    """
    of: Any = cls
    entry, fields = table(value), _fields(of)
    values: dict[str, Any] = {}
    errors: list[InputError] = []
    for name, field in fields.items():
        if name not in entry:
            if field.default is attrs.NOTHING:
                error = _MissingKeyError(field.type)
                error.place = (name,)
                errors.append(error)
        elif name in as_given:
            values[name] = entry[name]
        elif name in _FORMAT and issubclass(cls, Format):
            # the class checks these itself: blanks count
            item = entry[name]
            values[name] = tuple(item) if isinstance(item, list) else item
        else:
            with _collect(errors, name):
                values[name] = structure(entry[name], field.type)
    errors += [
        field_error(f"unknown key; {_key_hint(of, key)}", key)
        for key in sorted(entry.keys() - fields.keys())
    ]
    _raise_collected(errors)
    return cls(**values)


_FORMAT = attrs.fields_dict(Format)


@cache
def _fields(cls: Any) -> "dict[str, attrs.Attribute[Any]]":  # noqa: ANN401 - a class
    if any(isinstance(field.type, str) for field in attrs.fields(cls)):
        attrs.resolve_types(cls)
    return {field.name: field for field in attrs.fields(cls) if field.init}


def _key_hint(cls: Any, key: str) -> str:  # noqa: ANN401 - a class
    """Suggest a replacement of an unknown key of a class."""
    hint = cls.hint_for_key(key) if hasattr(cls, "hint_for_key") else ""
    field, kinds = getattr(cls, "event_keys", ("", None))
    keys = [name for name in attrs.fields_dict(cls) if name != field]
    return hint or nearest(key, keys if kinds is None else [*keys, *kinds.own()])


def with_kinds(cls: type[T], value: object, *, in_turn: bool = False) -> T:
    """Structure a table as a class, with further keys that are names of registered kinds.

    ``cls.event_keys`` names the field for these keys and their registry. A single value of an event
    becomes a tuple of its fields without the time; a table becomes the event. With ``in_turn`` the
    value is an array.
    """
    of: Any = cls
    field, kinds = of.event_keys
    entry, changes = dict(table(value)), dict[str, Any]()
    own_keys = attrs.fields_dict(of).keys() - {field}
    for key in sorted(entry.keys() - own_keys, key=[*kinds.own(), *entry].index):
        if key == field:
            raise field_error("unknown key", key)
        if key in kinds:
            with error_path(key):
                changes[key] = _structure_event(kinds[key], entry.pop(key), in_turn=in_turn)
    return from_table(cls, {**entry, field: changes}, field)


def single_value_type(kind: Any) -> tuple[Any, bool]:  # noqa: ANN401 - classes and their annotations
    """Return the type of the single value that can replace a table of a kind, and whether the kind has a time field."""
    first_field, *further_fields = _fields(kind).values()
    timed = first_field.name == "time"
    return (further_fields[0].type if timed else first_field.type), timed


def _structure_event(kind: Any, value: Any, *, in_turn: bool) -> object:  # noqa: ANN401 - of TOML
    of, timed = single_value_type(kind)
    mark = get_args(of)[1] if get_origin(of) is Annotated else None
    components = getattr(mark, "components", ())
    if isinstance(value, dict) and ("value" in value or not components):
        return structure({"time": 0.0, **value} if timed else value, kind)
    if in_turn:
        return structure_array(value, _structure_of(of))
    values = (structure(value, of),)
    return values if timed else kind(*values)


def kind_from_toml(
    value: object, kinds: Registry[type[T]], key: str = "kind", among: type = object
) -> T:
    """Structure a TOML table as the class that its ``key`` names in ``kinds``, a subclass of ``among``.

    Raises InputError: not a table, an unknown kind, or a kind of a package that cannot be imported.
    """
    entry = dict(table(value))
    if key not in entry:
        raise field_error(f"missing; expected one of {', '.join(kinds.names(among))}", key)
    with error_path(key):
        kind: Any = kinds.lookup(entry.pop(key), among)
    chosen = kind.chosen(entry) if hasattr(kind, "chosen") else kind
    return cast("T", structure(entry, chosen))


def explicit_fields(section: attrs.AttrsInstance) -> dict[str, Any]:
    """Return the fields of a section that are not None, by name."""
    fields = attrs.asdict(section, recurse=False)
    return {key: value for key, value in fields.items() if value is not None}


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
