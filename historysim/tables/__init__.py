"""Read files of numbers: named columns of measured records and lists, converted to SI."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from historysim.basics.files import is_file, is_netcdf, kind_text, path_state
from historysim.errors import InputError, error_path, field_error
from historysim.tables.columns import (
    REFUSE_OR_DROP,
    Column,
    FileColumn,
    Format,
    Listing,
    MissingValueError,
    Table,
    conflicting_unit,
    fit_unit,
    resolve_unit,
    unit_in_name,
)
from historysim.tables.readers import LineReader, TableReader, find_reader

if TYPE_CHECKING:
    from historysim.basics.arguments import Integers
    from historysim.tables.time_bases import JoinedColumns

__all__ = [
    "MOST_ROWS",
    "REFUSE_OR_DROP",
    "Column",
    "Format",
    "Listing",
    "MissingValueError",
    "Table",
    "column_names",
    "describe",
    "header_lines",
    "join_tables",
    "read_table",
    "summarise_text",
]

MOST_ROWS = 10_000_000


def read_table(
    path: str | PathLike[str],
    columns: Mapping[str, Column],
    units: Mapping[str, str | tuple[str, ...]],
    format: Format | None = None,  # noqa: A002 - the word for it
    *,
    missing: bool = False,
    by_time: bool = False,
) -> Table:
    """Read columns of a file, converted to SI, under the keys of ``columns``.

    A key may have several SI units in ``units``: the first compatible one is used. Missing values
    are NaN if ``missing``, else an error. Columns that start at different times in the file, or
    have different intervals, are interpolated onto the times of the first one if ``by_time``, else
    an error. Raises InputError, with line or row and column: an unreadable or damaged file, a
    column that does not exist or is ambiguous, an unknown or incompatible unit, no rows or too
    many, columns of different lengths, a row with surplus values, a value that is missing, infinite
    or not a number.
    """
    path = Path(path)
    si_units = {key: (unit,) if isinstance(unit := units[key], str) else unit for key in columns}
    for key, column in columns.items():
        if column.unit is not None:
            with error_path("columns", key, "unit"):
                fit_unit(column.unit, si_units[key])
    with _named_errors(path):
        file_columns, lines, notices, joined = _file_columns(
            path, columns, format or Format(), missing
        )
        table = _table_in_si(columns, file_columns, lines, si_units)
        if joined is not None:
            if not by_time:
                raise InputError(f"{joined.notice}; expected columns of the same times")
            notices.append(joined.notice)
            table = attrs.evolve(table, time=joined.time, inside=joined.inside)
    for key, column in columns.items():
        notices += _unit_notices(column, file_columns[key], si_units[key])
    return attrs.evolve(table, notices=tuple(notices))


def _table_in_si(
    columns: Mapping[str, Column],
    file_columns: Mapping[str, FileColumn],
    lines: "Integers | None",
    si_units: Mapping[str, Sequence[str]],
) -> Table:
    """Convert the columns of a file to SI."""
    import numpy as np

    rows = (
        max((len(column.values) for column in file_columns.values()), default=0)
        if lines is None
        else len(lines)
    )
    table = Table({}, {}, lines, (rows,))
    for key, column in file_columns.items():
        name = f"column {column.name}"
        table.units[key], factor = resolve_unit(
            columns[key].unit, column.units, si_units[key], name
        )
        with np.errstate(over="ignore", invalid="ignore"):
            table.columns[key] = values = column.values * factor
        if np.isinf(values).any():
            row = int(np.argmax(np.isinf(values)))
            raise InputError(
                f"{table.place(row)}, {name}: {column.values[row]:g} is beyond the largest float in SI"
            )
    return table


def _unit_notices(column: Column, in_file: FileColumn, si_units: Sequence[str]) -> list[str]:
    """Return notices about a unit that differs from the one in the file, or that only the name of the column shows."""
    if column.unit is None:
        if in_file.units or not (meant := unit_in_name(in_file.name, si_units[0])):
            return []
        return [f"column {in_file.name}: taken in {si_units[0]}; did you mean unit = {meant!r}?"]
    unit = conflicting_unit(column.unit, in_file.units, si_units)
    if unit is None:
        return []
    return [f"column {in_file.name}: {unit!r} in the file, taken as {column.unit!r}, as unit says"]


def join_tables(files: Sequence[str], tables: Sequence[Table]) -> Table:
    """Join the tables of several files; InputError if the unit of a column is of another quantity in one of them.

    The result has no line numbers, since each file counts its own.
    """
    import numpy as np

    units = tables[0].units
    for file, table in zip(files, tables, strict=True):
        for key, unit in table.units.items():
            if unit != units[key]:
                raise InputError(
                    f"{key} is in {units[key]} in {files[0]} and in {unit} in {file}; expected one quantity in all"
                )
    inside = [
        np.ones(sum(table.file_rows), dtype=np.bool_) if table.inside is None else table.inside
        for table in tables
    ]
    return Table(
        {key: np.concatenate([table.columns[key] for table in tables]) for key in units},
        units,
        inside=np.concatenate(inside),
        file_rows=tuple(rows for table in tables for rows in table.file_rows),
        notices=tuple(
            f"{file}: {notice}"
            for file, table in zip(files, tables, strict=True)
            for notice in table.notices
        ),
    )


def describe(path: str | PathLike[str], format: Format | None = None) -> list[Listing]:  # noqa: A002 - as above
    """List the columns of a file, and the strings in a file of arrays.

    Raises InputError: an unreadable or damaged file, or a text without rows of numbers.
    """
    path = Path(path)
    layout = format or Format()
    with _named_errors(path):
        if (text := _text_lines(path, layout)) is not None:
            from historysim.tables import from_text

            return from_text.describe(*text)
        from historysim.tables import arrays

        with find_reader(path, TableReader).open(path, layout) as contents:
            return arrays.describe(contents, layout)


def column_names(
    path: str | PathLike[str],
    format: Format | None = None,  # noqa: A002 - as above
    columns: Sequence[Column] = (),
) -> list[str]:
    """Return the names of the columns of a file: in a text's table with ``columns``, or the first; or paths of arrays.

    Errors as for `describe`.
    """
    path = Path(path)
    layout = format or Format()
    with _named_errors(path):
        if (text := _text_lines(path, layout, head_only=True)) is not None:
            from historysim.tables.head import Head

            return list(Head.from_lines(*text).heading(columns).names)
        with find_reader(path, TableReader).open(path, layout) as contents:
            return [array.name for array in contents.arrays]


def summarise_text(
    path: str | PathLike[str],
    format: Format | None = None,  # noqa: A002 - as above
) -> tuple[list[str], int]:
    """Summarise the tables (blocks) of a text file in lines, and return their number.

    The lines of a file of arrays name contents that are not read. Errors as for `describe`.
    """
    path = Path(path)
    layout = format or Format()
    with _named_errors(path):
        if (text := _text_lines(path, layout)) is not None:
            from historysim.tables import from_text

            return from_text.summarise(*text)
        with find_reader(path, TableReader).open(path, layout) as contents:
            return [f"left out: {contents.skipped_text}"] if contents.skipped else [], 1


def header_lines(path: str | PathLike[str], format: Format | None = None) -> list[str]:  # noqa: A002 - as above
    """Return the lines above the rows of a text's table, of the first one by default, without comment characters.

    A file of arrays has none. Errors as for `describe`.
    """
    path = Path(path)
    with _named_errors(path):
        if (text := _text_lines(path, format or Format())) is None:
            return []
        from historysim.tables.blocks import survey

        lines, layout = text
        blocks, _ = survey(lines, layout)
        block = blocks[min(layout.block or 1, len(blocks)) - 1]
        return [
            line.lstrip(f"{layout.comment} ") for line in lines[block.start : block.first_line - 1]
        ]


@contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    """Check that a file exists, and prefix errors raised in the block with its name."""
    if not is_file(path):
        folder = path.absolute()
        problem = path_state(path)
        if not problem.startswith("is "):
            problem += f" in {folder.parent}"
        raise InputError(f"{folder.name}: {problem}; expected the path of a file of numbers")
    try:
        yield
    except InputError as error:
        kind = MissingValueError if isinstance(error, MissingValueError) else InputError
        named_error = kind(f"{path.name}: {error.args[0]}")
        named_error.place = error.place
        raise named_error from error
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error.strerror or error}") from error


def _text_lines(
    path: Path, layout: Format, *, head_only: bool = False
) -> tuple[list[str], Format] | None:
    """Return the lines of a text file or sheet, and their format; None for a file of arrays.

    Of a text file only the lines with its header if ``head_only``.
    """
    from historysim.tables import from_text

    reader = find_reader(path, TableReader, LineReader)
    if isinstance(reader, LineReader):
        with reader.open(path, layout) as lines:
            return list(lines), attrs.evolve(layout, delimiter="\t", comment="")
    if reader is not None:
        return None
    if is_netcdf(path):
        raise InputError("is a netCDF or HDF5 file with another ending; name it .nc or .h5")
    if kind := kind_text(path):
        raise InputError(f"{kind}; expected a file of numbers")
    if layout.sheet is not None:
        raise field_error("belongs to a workbook (.xlsx, .ods); leave it out", "sheet")
    layout = attrs.evolve(layout, encoding=layout.encoding or from_text.detect_encoding(path))
    encoding = str(layout.encoding)
    return from_text.read_lines(path, encoding, MOST_ROWS, head_only=head_only), layout


def _file_columns(
    path: Path, columns: Mapping[str, Column], layout: Format, missing: bool
) -> "tuple[dict[str, FileColumn], Integers | None, list[str], JoinedColumns | None]":
    """Return the columns of a file in its units, line numbers of rows in a text, notices, and a join by time."""
    if (text := _text_lines(path, layout)) is not None:
        from historysim.tables import from_text

        lines, written = text
        file_columns, numbers, notices = from_text.read(
            lines, columns, written, missing=missing, most_rows=MOST_ROWS
        )
        if layout.encoding is None and written.encoding == from_text.WINDOWS:
            notices.append(
                f"is not UTF-8, read as {from_text.WINDOWS}; if names or units look wrong, set encoding"
            )
        return file_columns, numbers, notices, None
    from historysim.tables import arrays

    with find_reader(path, TableReader).open(path, layout) as contents:
        file_columns, joined = arrays.read(
            contents, columns, layout, missing=missing, most_rows=MOST_ROWS
        )
        return file_columns, None, [], joined
