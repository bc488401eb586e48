"""Excel: the rows of a sheet as lines with tabs between values, through python-calamine; all else is as in texts."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from historysim.basics.limits import check_archive, most
from historysim.basics.system import ends_well, limit_memory
from historysim.errors import InputError
from historysim.tables.arrays import readable
from historysim.tables.columns import Format
from historysim.tables.readers import READERS, LineReader

_MOST_MEMORY = 1 << 32


def read_sheets(path: Path) -> None:
    """Read all sheets as the library does, which makes a table of all cells between those that hold something."""
    from python_calamine import CalamineWorkbook

    limit_memory(_MOST_MEMORY)
    book = CalamineWorkbook.from_path(str(path))
    for name in book.sheet_names:
        book.get_sheet_by_name(name)


def _sheet(names: list[str], heights: dict[str, int], layout: Format) -> str:
    sheets = ", ".join(f"{name!r} ({heights[name]} rows)" for name in names)
    if isinstance(layout.sheet, int):
        if layout.sheet > len(names):
            raise InputError(f"there is no sheet {layout.sheet}; seen: {sheets}")
        return names[layout.sheet - 1]
    if layout.sheet is not None:
        if layout.sheet not in names:
            raise InputError(f"there is no sheet {layout.sheet!r}; seen: {sheets}")
        return layout.sheet
    filled = [name for name in names if heights[name]]
    if len(filled) != 1:
        raise InputError(
            f"has {len(filled)} sheets that are not empty; say which, as in sheet = 1 (or --sheet 1); seen: {sheets}"
        )
    return filled[0]


def _cell(value: object) -> str:
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return " ".join(str(value).replace('"', "'").split())


@READERS.register
class ExcelReader(LineReader):
    """Sheets of Excel and OpenDocument, through python-calamine."""

    kind, endings = "excel", (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")

    @contextmanager
    def opened(self, path: Path, layout: Format) -> Iterator[Iterator[str]]:
        """Yield the rows of a sheet as lines.

        A damaged file, no such sheet, several with something in them, or no python-calamine is an InputError.
        """
        try:
            from python_calamine import CalamineWorkbook
        except ImportError as error:
            raise InputError(
                'is read by python-calamine, which is not installed; pip install "historysim[excel]"'
            ) from error
        with readable("Excel"):
            check_archive(path, trusted=False)
        if not ends_well(read_sheets, path, most("HDF5_SECONDS") * 12):
            raise InputError(
                "has cells so far apart that its sheets take more than "
                f"{_MOST_MEMORY:,} bytes, or cannot be read in time; take out what stands far from the columns, or "
                "export it as CSV"
            )
        with readable("Excel"), path.open("rb") as stream:
            book = CalamineWorkbook.from_filelike(stream)
            name = _sheet(
                book.sheet_names, {each: book.get_sheet_by_name(each).height for each in book.sheet_names}, layout
            )
            rows = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
        yield ("\t".join(map(_cell, row)) + "\n" for row in rows)
