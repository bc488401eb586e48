"""Files of numbers: named columns of measured records and lists → SI numbers."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path

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

__all__ = [
    "MOST_ROWS",
    "REFUSE_OR_DROP",
    "Column",
    "Format",
    "Listing",
    "MissingValueError",
    "Part",
    "Table",
    "column_names",
    "describe",
    "join_tables",
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
        if column.unit is not None:
            with at("columns", key, "unit"):
                fitting(column.unit, wanted[key])
    with _file(path):
        pieces, notices = _pieces(path, columns, format or Format(), missing)
        joined = join_tables([_table(columns, piece, wanted) for piece in pieces])
    for key, column in columns.items():
        notices += _on_unit(column, [piece.columns[key] for piece in pieces], wanted[key])
    return attrs.evolve(joined, notices=tuple(notices))


def _table(columns: Mapping[str, Column], piece: Piece, wanted: Mapping[str, Sequence[str]]) -> Table:
    """Return the columns of one table in SI."""
    import numpy as np

    table = Table({}, {}, piece.lines, (piece.part,))
    for key, column in piece.columns.items():
        name = f"column {column.name}"
        table.units[key], factor = settled(columns[key].unit, column.units, wanted[key], name)
        with np.errstate(over="ignore", invalid="ignore"):
            table.columns[key] = values = column.values * factor
        if np.isinf(values).any():
            row = int(np.argmax(np.isinf(values)))
            raise InputError(f"{table.place(row)}, {name}: {column.values[row]:g} is beyond the largest float in SI")
    return table


def _on_unit(column: Column, in_file: Sequence[FileColumn], wanted: Sequence[str]) -> list[str]:
    """Return what a user has to know of the unit of a column in one or more tables."""
    if column.unit is None:
        first = in_file[0]
        if first.units or not (meant := unit_in_name(first.name, wanted[0])):
            return []
        return [f"column {first.name}: taken in {wanted[0]}; did you mean unit = {meant!r}?"]
    notices = [
        f"column {each.name}: {unit!r} in the file, taken as {column.unit!r}, as unit says"
        for each in in_file
        if (unit := overridden(column.unit, each.units, wanted)) is not None
    ]
    return [*dict.fromkeys(notices)]


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
        if (text := _lines(path, layout)) is not None:
            from historysim.tables import from_text

            return from_text.describe(*text)
        from historysim.tables import arrays

        with reader_of(path, TableReader).opened(path, layout) as contents:
            return arrays.describe(contents, layout)


def column_names(path: str | PathLike[str], format: Format | None = None) -> list[str]:  # noqa: A002 - as above
    """Return the names of the columns of a file: those of the first table of a text, of arrays their paths.

    Errors as for `describe`.
    """
    path, layout = Path(path), format or Format()
    with _file(path):
        if (text := _lines(path, layout)) is not None:
            from historysim.tables.head import Head

            return list(Head.of(*text).heading(()).names)
        with reader_of(path, TableReader).opened(path, layout) as contents:
            return [array.name for array in contents.arrays]


def what_is_seen(path: str | PathLike[str], format: Format | None = None) -> tuple[list[str], int]:  # noqa: A002 - as above
    """Return lines on the tables of a text, what stands above and below them, and how many tables there are.

    A file that is no text has no such lines. Errors as for `describe`.
    """
    path = Path(path)
    with _file(path):
        if (text := _lines(path, format or Format())) is None:
            return [], 1
        from historysim.tables import from_text

        return from_text.picture(*text)


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


def _lines(path: Path, layout: Format) -> tuple[list[str], Format] | None:
    """Return the lines of a file, and how they are written; None of a file of arrays."""
    from historysim.tables import from_text

    reader = reader_of(path, TableReader, LineReader)
    if isinstance(reader, LineReader):
        with reader.opened(path, layout) as lines:
            return list(lines), attrs.evolve(layout, delimiter="\t", decimal=".", comment="")
    if reader is not None:
        return None
    if is_netcdf(path):
        raise InputError("is a netCDF or HDF5 file, and not named so; name it .nc or .h5")
    if kind := kind_text(path):
        raise InputError(f"{kind}; expected a file of numbers")
    if layout.sheet is not None:
        raise misfit("belongs to a workbook (.xlsx, .ods); leave it out", "sheet")
    layout = attrs.evolve(layout, encoding=layout.encoding or from_text.encoding_of(path))
    return from_text.lines_of(path, str(layout.encoding), MOST_ROWS), layout


def _pieces(path: Path, columns: Mapping[str, Column], layout: Format, missing: bool) -> tuple[list[Piece], list[str]]:
    """Return the tables of a file that are read, and notices."""
    if (text := _lines(path, layout)) is not None:
        from historysim.tables import from_text

        lines, written = text
        pieces, notices = from_text.read(lines, columns, written, missing=missing, most_rows=MOST_ROWS)
        if layout.encoding is None and written.encoding == from_text.WINDOWS:
            notice = f"is no UTF-8 text, read as {from_text.WINDOWS}; if names or units look wrong, say encoding"
            notices = [*notices, notice]
        return pieces, notices
    from historysim.tables import arrays

    with reader_of(path, TableReader).opened(path, layout) as contents:
        found = arrays.read(contents, columns, layout, missing=missing, most_rows=MOST_ROWS)
    rows = max((len(column.values) for column in found.values()), default=0)
    return [Piece(found, Part("the table", rows))], []
