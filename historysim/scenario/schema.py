"""TOML tables → frozen attrs classes with units and types at their fields; every message has the path to its field."""

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
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError, at, field_error, path_text
from historysim.tables import Column, Format, Table, join_tables, read_table

T = TypeVar("T")
Place = tuple[str | int, ...]

MOST_PROBLEMS = 10


@contextmanager
def reported(source: str) -> Iterator[None]:
    """Turn errors raised inside into one InputError: a line ``source: path: problem`` for each."""
    try:
        yield
    except (InputError, BaseValidationError, ForbiddenExtraKeysError) as error:
        problems = [f"{source}: {problem}" for problem in _problems(error)]
        more = [f"… and {len(problems) - MOST_PROBLEMS} more"] if len(problems) > MOST_PROBLEMS else []
        raise InputError("\n".join(problems[:MOST_PROBLEMS] + more)) from error


def _number(value: object, unit: str) -> float:
    from historysim.basics.units import quantity

    big = isinstance(value, int) and value.bit_length() > 1000
    if isinstance(value, bool) or big or not isinstance(value, int | float | str):
        expected = "a number" if unit == "1" else f"a number in {unit}, or a string with a unit"
        raise InputError(f"{shown(value)}; expected {expected}")
    number = quantity(value, unit)
    if not is_workable(number):
        raise InputError(f"{shown(value)}; expected {SIZE}, in SI")
    return number


def array_of(value: object, structure: Callable[[Any], T]) -> tuple[T, ...]:
    """Return the items of a TOML array, each structured; their errors are gathered in an IterableValidationError."""
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


def _components(entry: Mapping[str, object], quantity: Quantity) -> tuple[float | None, ...]:
    for key in entry:
        if key not in quantity.components:
            raise field_error(f"unknown key; {nearest(key, quantity.components)}", key)
    found = []
    for name in quantity.components:
        with noted(name):
            found.append(_number(entry[name], quantity.unit) if name in entry else None)
    return tuple(found)


def _quantity_hook(kind: object) -> Callable[[object, object], float | tuple[float | None, ...]]:
    plain, quantity = get_args(kind)
    one_or_many = isinstance(plain, UnionType) or quantity.alone

    def structure(value: object, _: object) -> float | tuple[float | None, ...]:
        if isinstance(value, dict) and quantity.components:
            return _components(value, quantity)
        if isinstance(value, list) if one_or_many else get_origin(plain) is tuple:
            return array_of(value, lambda item: _number(item, quantity.unit))
        return _number(value, quantity.unit)

    return structure


@attrs.frozen
class KindOf:
    """Marks a field with a table that names its class: a kind of a registry, which is imported then."""

    registry: str  #: as ``"module:NAME"``
    key: str = "kind"  #: the key of the name
    alone: bool = False  #: whether the name alone may stand for the table


AnyFrictionLaw = Annotated[Any, KindOf("historysim.asperities.laws:LAWS", "law")]
AnyWearLaw = Annotated[Any, KindOf("historysim.asperities.wear:WEAR_LAWS", "law")]
AnyYieldingLaw = Annotated[Any, KindOf("historysim.asperities.yielding:YIELDING_LAWS", "law", alone=True)]


def _is_marked(kind: object, mark: type) -> bool:
    return get_origin(kind) is Annotated and isinstance(get_args(kind)[1], mark)


def _kind_hook(kind: object, converter: Converter) -> Callable[[object, object], object]:
    of: KindOf = get_args(kind)[1]
    module, _, name = of.registry.partition(":")

    def structure(value: object, _: object) -> object:
        kinds = getattr(import_module(module), name)
        entry = {of.key: value} if of.alone and isinstance(value, str) else value
        return kind_from_toml(converter, entry, kinds, of.key)

    return structure


@attrs.frozen
class ColumnsOf:
    """Validator of the columns of a file: which keys they need, and which they may have."""

    needed: str
    optional: str = ""

    def __call__(self, _: object, attribute: "attrs.Attribute[Any]", value: Mapping[str, object]) -> None:
        """Check the keys."""
        needed = self.needed.split()
        known = [*needed, *self.optional.split()]
        for key in value:
            if key not in known:
                raise field_error(f"unknown key; {nearest(key, known)}", attribute.name, key)
        for key in needed:
            if key not in value:
                raise field_error("missing; expected a column", attribute.name, key)


def _table_of_hook(kind: object, converter: Converter) -> Callable[[object, object], dict[str, object]]:
    of = get_args(kind)[1]

    def structure(value: object, _: object) -> dict[str, object]:
        found = {}
        for key, each in table(value).items():
            with noted(key):
                found[key] = each if of is Any else converter.structure(each, of)
        return found

    return structure


_SCALARS = {bool: "true or false", int: "a whole number", float: "a number", str: "a string"}


def _is_one_of_several(kind: object) -> bool:
    if get_origin(kind) not in {Union, UnionType}:
        return False
    members = [each for each in get_args(kind) if each is not NoneType]
    return len(members) > 1 and all(each in _SCALARS or get_origin(each) is tuple for each in members)


def _several_hook(kind: object, converter: Converter) -> Callable[[object, object], object]:
    """Structure a value that may be of several types as the one that it is of."""
    members: dict[Any, Any] = {get_origin(each) or each: each for each in get_args(kind) if each is not NoneType}
    number: Any = Annotated[float, Quantity("1")]

    def structure(value: object, _: object) -> object:
        of: Any = {list: tuple, int: int if int in members else float}.get(type(value), type(value))
        if of in members:
            return converter.structure(value, number if of is float else members[of])
        known = {**_SCALARS, tuple: "an array"}
        raise InputError(f"{shown(value)}; expected {' or '.join(known[each] for each in known if each in members)}")

    return structure


def _array_hook(kind: object, converter: Converter) -> Callable[[object, object], tuple[object, ...]]:
    of = get_args(kind)[0]
    return lambda value, _: array_of(value, lambda item: converter.structure(item, of))


@contextmanager
def noted(key: str) -> Iterator[None]:
    """Note at an error raised inside that it belongs to a key, as cattrs does."""
    try:
        yield
    except Exception as error:
        error.add_note(AttributeValidationNote("", key, None))
        raise


def from_table(cls: type[T], value: object, converter: Converter, *as_given: str) -> T:
    """Return an instance of a class of a TOML table; some of its fields are taken as they are given."""
    made: Any = _structure_of(cast("Any", cls), converter, as_given)(value, cls)
    return cast("T", made)


@cache
def _structure_of(cls: Hashable, converter: Converter, as_given: tuple[str, ...]) -> Callable[[object, object], object]:
    plainly: dict[str, Any] = {name: override(struct_hook=lambda value, _: value) for name in as_given}
    return table_hook(cast("Any", cls), converter, **plainly)


def with_kinds(cls: type[T], value: object, converter: Converter, *, in_turn: bool = False) -> T:
    """Return an instance of a class of a table with further keys that are names of kinds.

    ``cls.by_kind`` says which field takes them, and which registry has them. One value of an event becomes a tuple of
    its fields beside the time; a table becomes the event. With ``in_turn`` the value is an array.
    """
    of: Any = cls
    field, kinds = of.by_kind
    entry, found = dict(table(value)), dict[str, Any]()
    own = {each.name for each in attrs.fields(of)} - {field}
    for key in sorted(entry.keys() - own, key=[*kinds.own(), *entry].index):
        if key == field:
            raise field_error("unknown key", key)
        if key in kinds:
            with noted(key):
                found[key] = _of_kind(kinds[key], entry.pop(key), converter, in_turn=in_turn)
    return from_table(cls, {**entry, field: found}, converter, field)


def type_of_one_value(kind: Any) -> tuple[Any, bool]:  # noqa: ANN401 - classes and their annotations
    """Return the type of the one value that may stand for a kind, and whether the kind has a time before it."""
    first, *others = attrs.fields(attrs.resolve_types(kind))
    timed = first.name == "time"
    return (others[0].type if timed else first.type), timed


def _of_kind(kind: Any, value: Any, converter: Converter, *, in_turn: bool) -> object:  # noqa: ANN401 - of TOML
    of, timed = type_of_one_value(kind)
    quantity = get_args(of)[1] if _is_marked(of, Quantity) else None
    by_component = quantity is not None and quantity.components and isinstance(value, dict) and "value" not in value
    if isinstance(value, dict) and not by_component:
        return converter.structure({"time": 0.0, **value} if timed else value, kind)
    if in_turn:
        return array_of(value, lambda item: converter.structure(item, of))
    values = (converter.structure(value, of),)
    return values if timed else kind(*values)


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
    converter: Converter, value: object, kinds: Registry[type[T]], key: str = "kind", among: type = object
) -> T:
    """Structure a TOML table as the class that its ``key`` names, of ``kinds`` ``among`` the subclasses of one.

    Raises InputError: no table, no such kind, or one of a package that cannot be used.
    """
    entry = dict(table(value))
    if key not in entry:
        raise field_error(f"missing; expected one of {', '.join(kinds.names(among))}", key)
    with at(key):
        kind: Any = kinds.named(entry.pop(key), among)
    return cast("T", converter.structure(entry, kind.chosen(entry) if hasattr(kind, "chosen") else kind))


def given(section: attrs.AttrsInstance) -> dict[str, Any]:
    """Return the keys of a section that stand in the file, with their values."""
    return {key: value for key, value in attrs.asdict(section, recurse=False).items() if value is not None}


def table(value: object) -> dict[str, Any]:
    """Return a value that is a TOML table; anything else is an InputError."""
    if not isinstance(value, dict):
        raise InputError(f"{shown(value)}; expected a table")
    return value


def text(value: object, _: object = str) -> str:
    """Return a string that is not blank; anything else is an InputError."""
    if not isinstance(value, str):
        raise InputError(f"{shown(value)}; expected a string")
    if not value.strip():
        raise InputError(f"{shown(value)}; expected a string that is not blank")
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
    converter.register_structure_hook_factory(attrs.has, table_hook)
    factories: tuple[tuple[Callable[[Any], bool], Any], ...] = (
        (lambda kind: hasattr(kind, "from_toml"), lambda cls, within: lambda value, _: cls.from_toml(value, within)),
        (lambda kind: get_origin(kind) is tuple, _array_hook),
        (lambda kind: get_origin(kind) is dict, _table_of_hook),
        (_is_one_of_several, _several_hook),
        (lambda kind: _is_marked(kind, Quantity), _quantity_hook),
        (lambda kind: _is_marked(kind, KindOf), _kind_hook),
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
            field, kinds = getattr(error.cl, "by_kind", ("", None))
            known = [each.name for each in attrs.fields(error.cl) if each.name != field]
            known += [] if kinds is None else kinds.own()
            for key in sorted(error.extra_fields):
                meant = getattr(error.cl, "meant", lambda _: "")(key) or nearest(key, known)
                yield f"{path_text((*above, key))}: unknown key; {meant}"
        case KeyError():
            yield _line(above, f"missing; expected {_wanted(kind, above)}")
        case InputError():
            place, problem = (*above, *error.place), str(error.args[0])
            section = problem.endswith("; expected a table") and all(isinstance(step, str) for step in place)
            yield _line(place, problem + (f", such as [{path_text(place)}] with its keys below" if section else ""))
        case _:
            raise error


def _wanted(kind: Any, place: Place) -> str:  # noqa: ANN401 - a type
    """Return what a key that is missing takes."""
    if unit := field_unit(kind):
        return describe_expected(unit)
    members = get_args(kind) if get_origin(kind) in {Union, UnionType} else (kind,)
    one = next((each for each in members if each is not NoneType), kind)
    if (len(place) == 1 and one is not str) or get_origin(one) is dict:
        return f"a section [{path_text(place)}]"
    return _SCALARS.get(one if isinstance(one, type) else object, "a value")


def _line(place: Place, problem: str) -> str:
    return f"{path_text(place)}: {problem}" if place else problem


# -- files of numbers: a section that names one, and the columns of it -----------------------------------------


# a section that names a file inherits this beside others, and two bases with slots do not mix
@attrs.frozen(kw_only=True, slots=False)
class NumbersFile(Format):
    """A file of numbers, or several that go on one after the other, and how they are written."""

    #: Path, relative to the scenario; an array of paths is one record in several files, in their order.
    file: str | tuple[str, ...] = attrs.field(
        validator=Key(lambda files: files != (), "the path of a file, or of several that follow one another")
    )

    @property
    def files(self) -> tuple[str, ...]:
        """The paths in the scenario."""
        return self.file if isinstance(self.file, tuple) else (self.file,)

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
    ) -> Table:
        """Return its columns, in their units, by `read_table`; its path is relative to the folder."""
        tables = []
        for path in (folder / file for file in self.files):
            if not is_file(path):
                problem = f"{path_state(path)} in {path.absolute().parent}; expected a path relative to the scenario"
                if re.search(r"[\\\x00-\x1f]", str(path)):
                    problem += ", with / between folders"
                raise field_error(f"{path.name}: {problem}", "file")
            try:
                tables.append(read_table(path, columns, units, self, missing=missing))
            except InputError as error:
                # an error of no key belongs to the file
                error.place = error.place or ("file",)
                raise
        if len(tables) == 1:
            return tables[0]
        with at("file"):
            return join_tables([Path(file).name for file in self.files], tables)

    def read(self, folder: Path, columns: Mapping[str, Column], units: Mapping[str, str], made: Callable[..., T]) -> T:
        """Return what a function makes of its columns, by their keys; an error of it belongs to the file."""
        values = self.table(folder, columns, units).columns
        try:
            return made(**values)
        except InputError as error:
            raise field_error(f"{self.name}: {error.args[0]}", "file") from error


def column_from_toml(value: object, kind: type[Column] = Column) -> Column:
    """Return the column that is ``"name"`` or ``{ column = "name", unit = "mN" }``; anything else is an InputError."""
    if not isinstance(value, dict):
        return kind(text(value))
    known = [field.name for field in attrs.fields(kind)]
    for key in value:
        if key not in known:
            raise field_error(f"unknown key; {nearest(key, known)}", key)
    if "column" not in value:
        raise field_error("missing; expected the name of a column in the file", "column")
    return kind(**value)


def column_hooks(converter: Converter) -> None:
    """Let a converter structure columns, and keys of a format, which the class itself checks: white space counts."""
    converter.register_structure_hook(Column, column_from_toml)
    as_given = override(struct_hook=lambda value, _: tuple(value) if isinstance(value, list) else value)
    keys = {field.name: as_given for field in attrs.fields(Format)}
    converter.register_structure_hook_factory(
        lambda kind: isinstance(kind, type) and issubclass(kind, Format),
        lambda kind, within: table_hook(kind, within, **keys),
    )
