"""Files that hold named arrays: which column of which array is meant."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError
from historysim.tables.columns import Column, FileColumn, Format, Listing, MissingValueError, field_unit
from historysim.tables.lines import MISSING, places_of

Selection = tuple[slice | int, ...]

_UNIT_ENDINGS = (" unit", " units", "_unit", "_units", ".unit", ".units")
MOST_LISTED = 100  # columns of a matrix up to which each is listed
_KINDS = {"b": "true and false", "c": "complex numbers", "S": "texts", "U": "texts", "M": "dates", "m": "time spans"}


@attrs.frozen(eq=False)
class Array:
    """An array in a file."""

    name: str  #: its name; empty if it is all that the file holds
    shape: tuple[int, ...]  #: its shape
    #: Gives a part of it, selected as numpy does: an array of numpy, masked or not, or a list with None where missing.
    read: Callable[[Selection], Any]
    unit: str = ""  #: the unit that the file gives it, or nothing


@attrs.frozen
class Contents:
    """What a file holds: arrays, and texts beside them."""

    arrays: list[Array]
    texts: dict[str, str] = attrs.Factory(dict)
    passed_over: list[str] = attrs.Factory(list)  #: what else is there, for messages

    def units(self, array: Array) -> tuple[str, ...]:
        """Return the units that the file has for an array: in an attribute, in the name, or in a text beside it.

        Such texts are ``force_unit``, ``units.force``, and ``unit`` where no other array stands beside it.
        """
        above, dot, name = array.name.rpartition(".")
        beside = [array.name + ending for ending in _UNIT_ENDINGS] if name else []
        beside += [f"{above}{dot}{word}.{name}" for word in ("unit", "units")]
        alone = [word for word in (f"{above}{dot}unit", f"{above}{dot}units") if word in self.texts]
        if alone and len(_long(array)) < 2 and sum(each.name.rpartition(".")[0] == above for each in self.arrays) == 1:
            beside += alone
        units = (array.unit, field_unit(array.name), *(self.texts.get(text) for text in beside))
        return tuple(unit.strip() for unit in units if unit and unit.strip())


def _long(array: Array) -> list[int]:
    """Return the axes of an array along which it has not just one value."""
    return [axis for axis, count in enumerate(array.shape) if count != 1]


@contextmanager
def readable(kind: str) -> Iterator[None]:
    """Raise whatever a library trips over in a damaged file as an InputError."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        message = (
            str(error).strip().partition("\n")[0] if isinstance(error, OSError | ValueError | RuntimeError) else ""
        )
        reason = message or type(error).__name__
        mend = "save it again, or give it the ending of what it is"
        raise InputError(f"is damaged, or no {kind} file ({reason[:200]}); {mend}") from error


def read(
    contents: Contents, columns: Mapping[str, Column], layout: Format, *, missing: bool, most_rows: int
) -> dict[str, FileColumn]:
    """Read columns out of arrays. Errors as in `historysim.tables.read_table`."""
    file_columns = {key: _column(contents, column, layout.transposed, most_rows) for key, column in columns.items()}
    lengths = {key: len(column.values) for key, column in file_columns.items()}
    if len(set(lengths.values())) > 1:
        counted = ", ".join(f"{file_columns[key].name} has {length}" for key, length in lengths.items())
        raise InputError(f"columns of different lengths: {counted}; expected one value of each for every sample")
    for column in file_columns.values():
        _check(column, missing=missing)
    return file_columns


def _check(column: FileColumn, *, missing: bool) -> None:
    wrong = np.isinf(column.values) if missing else ~np.isfinite(column.values)
    if wrong.any():
        row = int(np.argmax(wrong))
        found = "missing (NaN)" if np.isnan(column.values[row]) else f"{column.values[row]:g}"
        kind = MissingValueError if np.isnan(column.values[row]) else InputError
        raise kind(f"row {row + 1}, column {column.name}: {found}; expected a finite number")


def _column(contents: Contents, column: Column, transposed: bool | None, most_rows: int) -> FileColumn:
    array, index = _chosen(contents.arrays, column)
    selection, label = _selection(array, index, transposed)
    count = _count(array, selection)
    if count > most_rows:
        raise InputError(f"column {label} has more than {most_rows:,} values; thin or split it")
    values = _numbers(array.read(selection), label)
    if len(values) != count:
        raise InputError(f"column {label} has {len(values)} of its {count} values; the file is cut short")
    return FileColumn(label, values, contents.units(array))


def _chosen(arrays: Sequence[Array], column: Column) -> tuple[Array, int | None]:
    """Return the array that is meant, and which of its columns."""
    if column.occurrence is not None:
        raise InputError(
            f"occurrence = {column.occurrence} counts names in the header of a text; expected a name alone, or with "
            "index, as in { column = 'data', index = 2 }"
        )
    names = [array.name for array in arrays]
    if isinstance(column.column, int):
        if "" not in names:
            raise InputError(
                f"there is no column {column.column}, since the arrays in this file have names; {nearest('', names)}"
            )
        return arrays[names.index("")], column.column
    places = places_of(column.column, names)
    if not places:
        raise InputError(f"there is no column {column.column!r}; {nearest(column.column, names)}")
    if len(places) > 1:
        several = ", ".join(names[place] for place in places)
        raise InputError(f"{len(places)} arrays have the name {column.column!r}: {several}; expected the name of one")
    return arrays[places[0]], column.index


def _selection(array: Array, index: int | None, transposed: bool | None) -> tuple[Selection, str]:
    """Return what selects one column of an array, and what a message calls it."""
    name = repr(array.name) if array.name else "the file"
    what = f"column {name}" if array.name else name
    size = " × ".join(map(str, array.shape))
    everything: list[slice | int] = [slice(None)] * len(array.shape)
    if 0 in array.shape:
        raise InputError(f"{what} has no values; expected one for each sample")
    long = _long(array)
    if len(long) > 2:
        raise InputError(f"{what} has {len(long)} dimensions ({size}); expected a column, or a matrix")
    if len(long) < 2:
        if index not in {None, 1}:
            raise InputError(f"there is no column {index} in {name}, which is a single column; leave the index out")
        return tuple(everything), name
    rows, columns = long
    if transposed is None and array.shape[rows] <= array.shape[columns]:
        raise InputError(
            f"{what} is a matrix of {size}, and its samples may be its rows or its columns; say transposed = false if "
            "each row is a sample, or transposed = true if each column is"
        )
    if transposed:
        rows, columns = columns, rows
    count = array.shape[columns]
    if index is None or index > count:
        absent = "" if index is None else f"there is no column {index} in it; "
        example = f"{{ column = {array.name!r}, index = {count} }}" if array.name else f"{{ column = {count} }}"
        raise InputError(f"{what} is a matrix of {size}; {absent}expected one of its columns, as in {example}")
    everything[columns] = index - 1
    return tuple(everything), f"{index} of {name}"


def _numbers(values: Any, name: str) -> Floats:
    """Return what was read as floats, NaN where missing."""
    if isinstance(values, list):
        if not set(map(type, values)) <= {int, float}:
            values = [_number(value, name, row) for row, value in enumerate(values)]
        try:
            return np.array(values, dtype=np.float64)
        except OverflowError as error:
            raise InputError(f"column {name} holds an integer beyond the largest float") from error
    # netCDF gives masked arrays, the others plain ones
    values = np.ma.asanyarray(values)
    if values.dtype.kind not in "fiu":
        kind = _KINDS.get(values.dtype.kind, "something else than numbers")
        raise InputError(f"column {name} holds {kind}; expected real numbers")
    with np.errstate(over="ignore", invalid="ignore"):
        floats = values.astype(np.float64)
    return np.asarray(np.ma.filled(floats, np.nan)).ravel()


def _number(value: object, name: str, row: int) -> float:
    # JSON has no NaN, so that some programs write it as a text
    if value is None or (isinstance(value, str) and value.strip().lower() in MISSING):
        return np.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"row {row + 1}, column {name}: {shown(value)}; expected a number")
    return value


def describe(contents: Contents, layout: Format) -> list[Listing]:
    """Return what columns arrays have."""
    if not contents.arrays:
        held = f"it holds {', '.join(contents.passed_over[:5])}" if contents.passed_over else "it is empty"
        raise InputError(f"has no arrays of numbers; expected one or more; {held}")
    listings = [listing for array in contents.arrays for listing in _listings(contents, array, layout.transposed)]
    return [*listings, *(Listing(_quoted(name), "", "a text", text) for name, text in contents.texts.items())]


def _listings(contents: Contents, array: Array, transposed: bool | None) -> Iterator[Listing]:
    long = _long(array)
    count = 1
    if len(long) == 2:
        rows, columns = (array.shape[axis] for axis in long)
        transposed = rows < columns if transposed is None else transposed
        count = rows if transposed else columns
    separate = len(long) == 2 and count <= MOST_LISTED
    units = ", ".join(contents.units(array))
    for index in range(1, count + 1) if separate else [None]:
        reference = _quoted(array.name)
        if index is not None:
            reference = f"{{ column = {reference}, index = {index} }}"
        if not array.name:
            reference = f"{{ column = {index or 1} }}"
        try:
            selection, _ = _selection(array, index, transposed)
            start = tuple(slice(0, 1) if isinstance(part, slice) else part for part in selection)
            first = _numbers(array.read(start), "")
        except InputError:
            yield Listing(reference, units, " × ".join(map(str, array.shape)), "")
        else:
            yield Listing(reference, units, str(_count(array, selection)), f"{first[0]:g}" if len(first) else "")


def _count(array: Array, selection: Selection) -> int:
    """Return how many values a selection takes."""
    return math.prod(size for size, part in zip(array.shape, selection, strict=True) if isinstance(part, slice))


def _quoted(name: str) -> str:
    return json.dumps(name, ensure_ascii=False)
