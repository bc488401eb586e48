"""Files of numbers: named columns of measured records and lists → SI numbers."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from historysim.basics.files import is_file, is_netcdf, kind_text, what_is_there
from historysim.errors import InputError, at, misfit
from historysim.tables.columns import (
    REFUSE_OR_DROP,
    Column,
    FileColumn,
    Format,
    Listing,
    MissingValueError,
    Part,
    Piece,
    Table,
    fitting,
    overridden,
    settled,
    unit_in_name,
)
from historysim.tables.readers import LineReader, TableReader, reader_of

if TYPE_CHECKING:
    from historysim.basics.arguments import Floats
    from historysim.tables.arrays import Contents
    from historysim.tables.from_text import Opened
    from historysim.tables.head import Heading

__all__ = [
    "MOST_ROWS",
    "REFUSE_OR_DROP",
    "Column",
    "Format",
    "Listing",
    "MissingValueError",
    "Part",
    "Table",
    "describe",
    "join_tables",
    "opened_rows",
    "read_table",
    "what_is_seen",
]

MOST_ROWS = 10_000_000


def read_table(
    path: str | PathLike[str],
    columns: Mapping[str, Column],
    units: Mapping[str, str | tuple[str, ...]],
    format: Format | None = None,  # noqa: A002 - the word for it
    *,
    missing: bool = False,
) -> Table:
    """Read named columns out of a file; of several SI units of one, the first is taken that its unit converts to.

    Values are in SI under the keys of ``columns``, NaN where missing, if values may be ``missing``. Raises InputError,
    with line or row and column: a file that cannot be read or is damaged, a column that is not there or not alone, a
    unit that is unknown, does not fit, or is not the one in the file, no rows or too many of them, columns of different
    lengths, a row with a superfluous value, a value that is missing, infinite or no number.
    """
    path = Path(path)
    wanted = {key: (unit,) if isinstance(unit := units[key], str) else unit for key in columns}
    for key, column in columns.items():
        _check_unit(key, column, wanted[key])
    with _file(path):
        pieces, notices = _pieces(path, columns, format or Format(), missing)
    tables = [_table(path, columns, piece, wanted) for piece in pieces]
    for key, column in columns.items():
        if column.unit is not None:
            overriding = [
                (piece.columns[key], overridden(column.unit, piece.columns[key].units, wanted[key])) for piece in pieces
            ]
            notices += dict.fromkeys(
                f"column {file_column.name}: {unit!r} in the file, taken as {column.unit!r}, as unit says"
                for file_column, unit in overriding
                if unit is not None
            )
        elif not (first := pieces[0].columns[key]).units and (meant := unit_in_name(first.name, wanted[key][0])):
            notices.append(f"column {first.name}: taken in {wanted[key][0]}; did you mean unit = {meant!r}?")
    with _file(path):
        joined = join_tables(tables)
    return attrs.evolve(joined, notices=tuple(notices))


def _table(path: Path, columns: Mapping[str, Column], piece: Piece, wanted: Mapping[str, tuple[str, ...]]) -> Table:
    table = Table({}, {}, piece.lines, (piece.part,))
    for key, measured in piece.columns.items():
        unit, factor = _settled(path, key, columns[key], measured, wanted[key])
        with _file(path):
            table.columns[key], table.units[key] = _scaled(measured, factor, table), unit
    return table


def join_tables(tables: Sequence[Table]) -> Table:
    """Return one table out of several of the same quantities; two SI units of one are an InputError."""
    first = tables[0]
    if len(tables) == 1:
        return first
    import numpy as np

    for table in tables[1:]:
        for key, unit in table.units.items():
            if unit != first.units[key]:
                one, other = first.parts[0].label, table.parts[0].label
                raise InputError(
                    f"{key} is in {first.units[key]} in {one} and in {unit} in {other}; expected one quantity in all"
                )
    return Table(
        {key: np.concatenate([table.columns[key] for table in tables]) for key in first.columns},
        first.units,
        np.concatenate([table.lines for table in tables if table.lines is not None])
        if all(table.lines is not None for table in tables)
        else None,
        tuple(part for table in tables for part in table.parts),
        tuple(dict.fromkeys(notice for table in tables for notice in table.notices)),
    )


def describe(path: str | PathLike[str], format: Format | None = None) -> list[Listing]:  # noqa: A002 - as above
    """Return what columns a file has, and the strings beside them.

    Raises InputError: a file that cannot be read or is damaged, or a text without rows of numbers.
    """
    path, layout = Path(path), format or Format()
    with _file(path):
        if lines := _lines(path, layout):
            from historysim.tables import from_text

            return from_text.describe(*lines)
        from historysim.tables import arrays

        with _opened(path, layout) as contents:
            return arrays.describe(contents, layout)


def what_is_seen(path: str | PathLike[str], format: Format | None = None) -> tuple[list[str], int]:  # noqa: A002 - as above
    """Return lines on the tables of a text, what stands above and below them, and how many tables there are.

    A file that is no text has no such lines. Errors as for `describe`.
    """
    path, layout = Path(path), format or Format()
    with _file(path):
        lines = _lines(path, layout)
        if lines is None:
            return [], 1
        from historysim.tables import from_text

        return from_text.picture(*lines)


@contextmanager
def opened_rows(
    path: str | PathLike[str],
    known: Collection[str],
    format: Format | None = None,  # noqa: A002 - as above
) -> "Iterator[tuple[Heading, Iterator[tuple[int, list[str]]]]]":
    """Yield the heading of a text of more than numbers, and the number of each line with its values.

    The header is the line that has the most of the known names; units may stand beside them. Raises InputError: a file
    that cannot be read, without such a header, or with rows of another width. Errors from inside name the file.
    """
    path = Path(path)
    with _file(path):
        from historysim.tables import from_text

        with from_text.opened_rows(path, known, format or Format()) as opened:
            yield opened


@contextmanager
def _file(path: Path) -> Iterator[None]:
    """Name a file in what is raised inside about it."""
    if not is_file(path):
        folder = path.absolute()
        problem = what_is_there(path)
        if not problem.startswith("is "):
            problem += f" in {folder.parent}"
        raise InputError(f"{folder.name}: {problem}; expected the path of a file of numbers")
    try:
        yield
    except InputError as error:
        kind = MissingValueError if isinstance(error, MissingValueError) else InputError
        named = kind(f"{path.name}: {error.args[0]}")
        named.place = error.place
        raise named from error
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error.strerror or error}") from error


def _lines(path: Path, layout: Format) -> "tuple[Opened, Format] | None":
    """Return what opens the lines of a file, and how they are written; None of a file of arrays."""
    from historysim.tables import from_text

    reader = reader_of(path, TableReader, LineReader)
    if isinstance(reader, LineReader):
        return lambda: reader.opened(path, layout), attrs.evolve(layout, delimiter="\t", decimal=".", comment="")
    if reader is not None:
        return None
    if is_netcdf(path):
        raise InputError("is a netCDF or HDF5 file, and not named so; name it .nc or .h5")
    if kind := kind_text(path):
        raise InputError(f"{kind}; expected a file of numbers")
    if layout.sheet is not None:
        raise misfit("belongs to a workbook (.xlsx, .ods); leave it out", "sheet")
    written = attrs.evolve(layout, encoding=layout.encoding or from_text.encoding_of(path))
    return lambda: from_text.opened(path, written), written


def _opened(path: Path, layout: Format) -> "AbstractContextManager[Contents]":
    opened: AbstractContextManager[Contents] = reader_of(path, TableReader).opened(path, layout)
    return opened


def _pieces(path: Path, columns: Mapping[str, Column], layout: Format, missing: bool) -> tuple[list[Piece], list[str]]:
    if lines := _lines(path, layout):
        from historysim.tables import from_text

        opened, written = lines
        pieces, notices = from_text.read(opened, columns, written, missing=missing, most_rows=MOST_ROWS)
        if layout.encoding is None and written.encoding == from_text.WINDOWS:
            notice = f"is no UTF-8 text, read as {from_text.WINDOWS}; if names or units look wrong, say encoding"
            notices = [*notices, notice]
        return pieces, notices
    from historysim.tables import arrays

    with _opened(path, layout) as contents:
        file_columns = arrays.read(contents, columns, layout, missing=missing, most_rows=MOST_ROWS)
    rows = max((len(column.values) for column in file_columns.values()), default=0)
    return [Piece(file_columns, Part("the table", rows))], []


def _check_unit(key: str, column: Column, wanted: Sequence[str]) -> None:
    if column.unit is not None:
        with at("columns", key, "unit"):
            fitting(column.unit, wanted)


def _settled(path: Path, key: str, column: Column, file_column: FileColumn, wanted: Sequence[str]) -> tuple[str, float]:
    name = f"column {file_column.name}"
    if column.unit is None:
        with _file(path):
            return settled(None, file_column.units, wanted, name)
    with at("columns", key, "unit"):
        return settled(column.unit, file_column.units, wanted, f"{path.name}: {name}")


def _scaled(column: FileColumn, factor: float, table: Table) -> "Floats":
    import numpy as np

    with np.errstate(over="ignore", invalid="ignore"):
        values = column.values * factor
    beyond = np.isinf(values)
    if beyond.any():
        row = int(np.argmax(beyond))
        raise InputError(
            f"{table.place(row)}, column {column.name}: {column.values[row]:g} is beyond the largest float in SI"
        )
    return values
