"""Select columns from files that hold named arrays."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.wording import format_value, list_names, nearest, quote
from historysim.errors import InputError
from historysim.tables.columns import (
    Column,
    FileColumn,
    Format,
    Listing,
    MissingValueError,
    field_unit,
)
from historysim.tables.lines import MISSING, find_name
from historysim.tables.time_bases import (
    NAMES,
    JoinedColumns,
    TimeBase,
    TimedColumn,
    differing_bases,
    join_by_time,
)

Selection = tuple[slice | int, ...]

_UNIT_ENDINGS = (" unit", " units", "_unit", "_units", ".unit", ".units")
_MOST_NAMED = 10  # contents that are not read and that a message names
MOST_LISTED = 100  # columns of a matrix up to which each is listed
_KINDS = {
    "b": "true and false",
    "c": "complex numbers",
    "S": "texts",
    "U": "texts",
    "M": "dates",
    "m": "time spans",
}


@attrs.frozen(eq=False)
class Array:
    """An array in a file, read on demand."""

    name: str  #: its name; empty if the file holds a single array without a name
    shape: tuple[int, ...]
    #: Reads a selection (as in NumPy): a NumPy array, masked or not, or a list with None for
    #: missing values.
    read: Callable[[Selection], Any]
    unit: str = ""  #: the unit attribute, empty without one
    #: Attributes by name, in which start and interval of its samples are found (see
    #: `historysim.tables.time_bases`).
    settings: Mapping[str, object] = attrs.Factory(dict)


@attrs.frozen
class Contents:
    """Contents of a file: arrays and strings by name."""

    arrays: list[Array]
    texts: dict[str, str] = attrs.Factory(dict)
    #: descriptions of other contents by name, for messages
    skipped: dict[str, str] = attrs.Factory(dict)

    @property
    def skipped_text(self) -> str:
        """List of the contents that are not read; empty without any."""
        listed = [f"{quote(name)} ({description})" for name, description in self.skipped.items()]
        more = f" and {len(listed) - _MOST_NAMED} more" if len(listed) > _MOST_NAMED else ""
        return ", ".join(listed[:_MOST_NAMED]) + more

    def units(self, array: Array) -> tuple[str, ...]:
        """Return the units of an array in the file: in an attribute, in its name, or in a string with a related name.

        Such strings are ``force_unit``, ``units.force``, and ``unit`` for a single array of a
        group.
        """
        above, dot, name = array.name.rpartition(".")
        text_names = [array.name + ending for ending in _UNIT_ENDINGS] if name else []
        text_names += [f"{above}{dot}{word}.{name}" for word in ("unit", "units")]
        shared = [
            word for word in (f"{above}{dot}unit", f"{above}{dot}units") if word in self.texts
        ]
        if (
            shared
            and len(_long_axes(array)) < 2
            and sum(item.name.rpartition(".")[0] == above for item in self.arrays) == 1
        ):
            text_names += shared
        units = (array.unit, field_unit(array.name), *(self.texts.get(text) for text in text_names))
        return tuple(unit.strip() for unit in units if unit and unit.strip())

    def time_base(self, array: Array) -> TimeBase | None:
        """Return start and interval of an array: in its attributes, or in scalars and strings with a related name.

        Such names are ``force_dt``, and ``force.dt`` for an array of the group ``force``. None if
        they are unknown.
        """
        above = array.name[: max(map(array.name.rfind, "./")) + 1]
        settings: dict[str, object] = {}
        # those of the group, and then those of the array itself
        for prefix in (above, f"{array.name}_") if array.name else ("",):
            settings |= self._scalars(prefix)
        settings |= {name.lower(): value for name, value in array.settings.items()}
        return TimeBase.from_settings(settings)

    def _scalars(self, prefix: str) -> dict[str, object]:
        """Return the scalars and strings with the name of a setting of a time base after a prefix."""
        scalars: dict[str, object] = {}
        for name, text in self.texts.items():
            if name.startswith(prefix) and (key := name[len(prefix) :].lower()) in NAMES:
                scalars[key] = text
        for array in self.arrays:
            key = array.name[len(prefix) :].lower() if array.name.startswith(prefix) else ""
            if key in NAMES and math.prod(array.shape) == 1:
                value = array.read((slice(None),) * len(array.shape))
                scalars[key] = np.ravel(np.asarray(value, dtype=object))[0]
        return scalars


def _long_axes(array: Array) -> list[int]:
    """Return the axes of an array whose size is not 1."""
    return [axis for axis, count in enumerate(array.shape) if count != 1]


@contextmanager
def reading_errors(kind: str) -> Iterator[None]:
    """Turn any exception of a library that reads a damaged file into an InputError."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        message = (
            str(error).strip().partition("\n")[0]
            if isinstance(error, OSError | ValueError | RuntimeError)
            else ""
        )
        reason = message or type(error).__name__
        remedy = "save it again, or give it the ending of its format"
        raise InputError(f"is damaged, or not a {kind} file ({reason[:200]}); {remedy}") from error


def read(
    contents: Contents,
    columns: Mapping[str, Column],
    layout: Format,
    *,
    missing: bool,
    most_rows: int,
) -> tuple[dict[str, FileColumn], JoinedColumns | None]:
    """Read columns of arrays, joined by time if their time bases differ. Errors as for `historysim.tables.read_table`.

    Joined columns are NaN outside their times.
    """
    file_columns = {
        key: _read_column(contents, column, layout.transposed, most_rows)
        for key, column in columns.items()
    }
    timed = [
        TimedColumn(column.name, column.values, column.base) for column in file_columns.values()
    ]
    if differing_bases(timed):
        for column in file_columns.values():
            _check(column, missing=missing)
        joined = join_by_time(timed)
        pairs = zip(file_columns.items(), joined.values, strict=True)
        return {key: attrs.evolve(column, values=values) for (key, column), values in pairs}, joined
    lengths = {key: len(column.values) for key, column in file_columns.items()}
    if len(set(lengths.values())) > 1:
        counted = ", ".join(
            f"{file_columns[key].name} has {length}" for key, length in lengths.items()
        )
        raise InputError(
            f"columns of different lengths: {counted}; expected one value of each for every sample"
        )
    for column in file_columns.values():
        _check(column, missing=missing)
    return file_columns, None


def _check(column: FileColumn, *, missing: bool) -> None:
    wrong = np.isinf(column.values) if missing else ~np.isfinite(column.values)
    if wrong.any():
        row = int(np.argmax(wrong))
        value_text = "missing (NaN)" if np.isnan(column.values[row]) else f"{column.values[row]:g}"
        kind = MissingValueError if np.isnan(column.values[row]) else InputError
        raise kind(f"row {row + 1}, column {column.name}: {value_text}; expected a finite number")


def _read_column(
    contents: Contents, column: Column, transposed: bool | None, most_rows: int
) -> FileColumn:
    if description := contents.skipped.get(str(column.column)):
        raise InputError(
            f"column {column.column!r} is not read ({description}); save it as an array of numbers"
        )
    array, index = _choose_array(contents.arrays, column)
    selection, label = _select_column(array, index, transposed)
    count = _count(array, selection)
    if count > most_rows:
        raise InputError(f"column {label} has more than {most_rows:,} values; thin or split it")
    values = _to_floats(array.read(selection), label)
    if len(values) != count:
        raise InputError(
            f"column {label} has {len(values)} of its {count} values; the file is cut short"
        )
    return FileColumn(label, values, contents.units(array), contents.time_base(array))


def _choose_array(arrays: Sequence[Array], column: Column) -> tuple[Array, int | None]:
    """Return the array of a column, and the index of the column in a matrix."""
    if column.occurrence is not None:
        raise InputError(
            f"occurrence = {column.occurrence} counts names in the header of a text; expected a name alone, or with "
            "index, as in { column = 'data', index = 2 }"
        )
    names = [array.name for array in arrays]
    if isinstance(column.column, int):
        if "" not in names:
            raise InputError(
                f"there is no column {column.column}, since the arrays in this file have names; "
                f"{nearest('', names, in_file=True)}"
            )
        return arrays[names.index("")], column.column
    matches = find_name(column.column, names)
    if not matches:
        raise InputError(
            f"there is no column {column.column!r}; {nearest(column.column, names, in_file=True)}"
        )
    if len(matches) > 1:
        matching_names = list_names([names[index] for index in matches])
        raise InputError(
            f"{len(matches)} arrays have the name {column.column!r}: {matching_names}; expected the name of one"
        )
    return arrays[matches[0]], column.index


def _select_column(
    array: Array, index: int | None, transposed: bool | None
) -> tuple[Selection, str]:
    """Return the selection of one column of an array, and its label in messages."""
    name = repr(array.name) if array.name else "the file"
    array_text = f"column {name}" if array.name else name
    size = " × ".join(map(str, array.shape))
    selection: list[slice | int] = [slice(None)] * len(array.shape)
    if 0 in array.shape:
        raise InputError(f"{array_text} has no values; expected one for each sample")
    long_axes = _long_axes(array)
    if len(long_axes) > 2:
        raise InputError(
            f"{array_text} has {len(long_axes)} dimensions ({size}); expected a column, or a matrix"
        )
    if len(long_axes) < 2:
        if index not in {None, 1}:
            raise InputError(
                f"there is no column {index} in {name}, which is a single column; leave the index out"
            )
        return tuple(selection), name
    rows, columns = long_axes
    if transposed is None and array.shape[rows] <= array.shape[columns]:
        raise InputError(
            f"{array_text} is a matrix of {size}, and its samples may be its rows or its columns; set transposed = "
            "false if each row is a sample, or transposed = true if each column is"
        )
    if transposed:
        rows, columns = columns, rows
    count = array.shape[columns]
    if index is None or index > count:
        absent = "" if index is None else f"there is no column {index} in it; "
        example = (
            f"{{ column = {array.name!r}, index = {count} }}"
            if array.name
            else f"{{ column = {count} }}"
        )
        raise InputError(
            f"{array_text} is a matrix of {size}; {absent}expected one of its columns, as in {example}"
        )
    selection[columns] = index - 1
    return tuple(selection), f"{index} of {name}"


def _to_floats(values: Any, name: str) -> Floats:
    """Convert values that were read to floats, NaN where missing."""
    if isinstance(values, list):
        if not set(map(type, values)) <= {int, float}:
            values = [_to_float(value, name, row) for row, value in enumerate(values)]
        try:
            return np.array(values, dtype=np.float64)
        except OverflowError as error:
            raise InputError(f"column {name} holds an integer beyond the largest float") from error
    # netCDF returns masked arrays, other libraries plain ones
    values = np.ma.asanyarray(values)
    if values.dtype.kind not in "fiu":
        kind = _KINDS.get(values.dtype.kind, "values that are not numbers")
        raise InputError(f"column {name} holds {kind}; expected real numbers")
    with np.errstate(over="ignore", invalid="ignore"):
        floats = values.astype(np.float64)
    return np.asarray(np.ma.filled(floats, np.nan)).ravel()


def _to_float(value: object, name: str, row: int) -> float:
    # JSON has no NaN, so some programs write it as a string
    if value is None or (isinstance(value, str) and value.strip().lower() in MISSING):
        return np.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"row {row + 1}, column {name}: {format_value(value)}; expected a number")
    return value


def describe(contents: Contents, layout: Format) -> list[Listing]:
    """List the columns of arrays, and the strings."""
    if not contents.arrays:
        held = f"it holds {contents.skipped_text}" if contents.skipped else "it is empty"
        raise InputError(f"has no arrays of numbers; expected one or more; {held}")
    listings = [
        listing
        for array in contents.arrays
        for listing in _listings(contents, array, layout.transposed)
    ]
    return [
        *listings,
        *(Listing(_quote(name), "", "a text", text) for name, text in contents.texts.items()),
    ]


def _listings(contents: Contents, array: Array, transposed: bool | None) -> Iterator[Listing]:
    long_axes = _long_axes(array)
    count = 1
    if len(long_axes) == 2:
        rows, columns = (array.shape[axis] for axis in long_axes)
        transposed = rows < columns if transposed is None else transposed
        count = rows if transposed else columns
    separate = len(long_axes) == 2 and count <= MOST_LISTED
    units = ", ".join(contents.units(array))
    for index in range(1, count + 1) if separate else [None]:
        reference = _quote(array.name)
        if index is not None:
            reference = f"{{ column = {reference}, index = {index} }}"
        if not array.name:
            reference = f"{{ column = {index or 1} }}"
        try:
            selection, _ = _select_column(array, index, transposed)
            start = tuple(
                slice(0, 1) if isinstance(axis_selection, slice) else axis_selection
                for axis_selection in selection
            )
            value = _to_floats(array.read(start), "")
        except InputError:
            yield Listing(reference, units, " × ".join(map(str, array.shape)), "")
        else:
            yield Listing(
                reference,
                units,
                str(_count(array, selection)),
                f"{value[0]:g}" if len(value) else "",
            )


def _count(array: Array, selection: Selection) -> int:
    """Return the number of values in a selection."""
    return math.prod(
        size
        for size, axis_selection in zip(array.shape, selection, strict=True)
        if isinstance(axis_selection, slice)
    )


def _quote(name: str) -> str:
    return json.dumps(name, ensure_ascii=False)
