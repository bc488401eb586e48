"""CSV tables with named columns and units → lists of SI numbers."""

import csv
import itertools
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import attrs

from historysim.errors import InputError
from historysim.schema import at, misfit, nearest, shown, text

if TYPE_CHECKING:
    from _csv import Reader

MOST_ROWS = 10_000_000


@attrs.frozen
class Column:
    """A column by the name in its header, and the unit of its values (SI when not given)."""

    column: str
    unit: str | None = None


@attrs.frozen
class Table:
    """Columns of SI numbers, and the line in the file that each row stands on."""

    columns: dict[str, list[float]]
    lines: list[int]


def column_from_toml(value: object, _: object = Column) -> Column:
    """Structure ``"name"`` or ``{ column = "name", unit = "mN" }``.

    Raises
    ------
    InputError
        Anything else.
    """
    if not isinstance(value, dict):
        return Column(text(value))
    for key in value:
        if key not in {"column", "unit"}:
            raise misfit(f"unknown key; {nearest(key, ('column', 'unit'))}", key)
    if "column" not in value:
        raise misfit("missing; expected the name in the header of the file", "column")
    for key, name in value.items():
        if not isinstance(name, str) or not name.strip():
            raise misfit(f"{shown(name)}; expected a text that is not blank", key)
    return Column(**value)


def check_delimiter(_: object, attribute: "attrs.Attribute[str]", value: str) -> None:
    """Check that a delimiter is one character that cannot be part of a number (an attrs validator).

    Raises
    ------
    InputError
        Anything else.
    """
    if len(value) != 1 or value in "\r\n\"'.+-" or value.isalnum():
        raise misfit(f'{value!r}; expected one character, as in ",", ";" or "\\t"', attribute.name)


def read_table(path: Path, columns: Mapping[str, Column], units: Mapping[str, str], delimiter: str = ",") -> Table:
    """Read named columns from a CSV file with one header line.

    Parameters
    ----------
    path : Path
        The file, UTF-8.
    columns : mapping of str to Column
        What each wanted quantity is called in the file.
    units : mapping of str to str
        SI unit of each wanted quantity.
    delimiter : str
        What stands between two values.

    Returns
    -------
    Table
        The values in SI under the keys of ``columns``.

    Raises
    ------
    InputError
        A file that cannot be read, a header without one of the columns or with one of them twice, a unit
        that does not fit, no rows, or a row with a missing, superfluous or non-finite value; the message
        names line and column.
    """
    factors = {key: _factor(key, column, units[key]) for key, column in columns.items()}
    with at("file"), _named(path):
        if not _is_file(path):
            raise InputError(f"there is no such file in {path.parent}; expected a path relative to the scenario")
        try:
            with path.open(encoding="utf-8-sig", newline="") as stream:
                return _read(csv.reader(stream, delimiter=delimiter), columns, factors)
        except UnicodeDecodeError as error:
            raise InputError(f"is not UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8") from error
        except csv.Error as error:
            raise InputError(f"is not a CSV table: {error}") from error
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}") from error


@contextmanager
def _named(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from error


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _factor(key: str, column: Column, unit: str) -> float:
    if column.unit is None:
        return 1.0
    from historysim.units import conversion_factor

    with at("columns", key, "unit"):
        return conversion_factor(column.unit, unit)


def _read(reader: "Reader", columns: Mapping[str, Column], factors: Mapping[str, float]) -> Table:
    header = [name.strip() for name in next(reader, [])]
    if not any(header):
        raise InputError("is empty; expected a header line with the names of the columns")
    places = [(_place(column.column, header), factors[key]) for key, column in columns.items()]
    values: list[list[float]] = [[] for _ in places]
    targets = [(place, factor, target.append) for (place, factor), target in zip(places, values, strict=True)]
    lines: list[int] = []
    for row in itertools.islice(_full_rows(reader, header), MOST_ROWS + 1):
        for place, factor, append in targets:
            try:
                number = float(row[place])
            except ValueError:
                _refuse(row[place], header[place], reader.line_num)
            if not math.isfinite(number) or "_" in row[place]:
                _refuse(row[place], header[place], reader.line_num)
            append(number * factor)
        lines.append(reader.line_num)
    if not lines:
        raise InputError("has a header but no rows; expected one line for each sample")
    if len(lines) > MOST_ROWS:
        raise InputError(f"has more than {MOST_ROWS:,} rows; thin or split it")
    return Table(dict(zip(columns, values, strict=True)), lines)


def _full_rows(reader: "Reader", header: list[str]) -> Iterator[list[str]]:
    width = len(header)
    for row in reader:
        if len(row) == width:
            yield row
        elif row:
            raise InputError(
                f"line {reader.line_num}: {len(row)} values where the header names {width} columns; "
                "expected one value for each column, and the delimiter of the header"
            )


def _place(name: str, header: list[str]) -> int:
    if name not in header:
        raise InputError(f"there is no column {name!r}; {nearest(name, header)}")
    if header.count(name) > 1:
        raise InputError(f"the header names column {name!r} {header.count(name)} times; rename all but one")
    return header.index(name)


def _refuse(value: str, name: str, line: int) -> NoReturn:
    hint = "; write the decimal comma as a point" if "," in value else ""
    brief = value if len(value) <= 40 else value[:40] + "…"
    raise InputError(f"line {line}, column {name!r}: {brief!r}; expected a finite number{hint}")
