"""Readers of HDF5, netCDF, MATLAB, TDMS (LabVIEW), JSON and Excel files."""

import importlib
import json
import logging
import math
import struct
import threading
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.basics.hdf5 import check_contained
from historysim.basics.limits import check_archive, check_unpacked, most
from historysim.basics.system import ends_well, limit_memory
from historysim.basics.wording import list_names, quote
from historysim.errors import InputError
from historysim.tables.arrays import Array, Contents, Selection, reading_errors
from historysim.tables.columns import Format
from historysim.tables.from_text import decode_file
from historysim.tables.readers import READERS, LineReader, TableReader
from historysim.tables.time_bases import NAMES, TimeBase

if TYPE_CHECKING:
    import h5py


def _library(module: str, name: str, extra: str) -> Any:
    """Import an optional library; InputError if it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f'is read by {name}, which is not installed; pip install "historysim[{extra}]"'
        ) from error


# -- HDF5, through h5py ----------------------------------------------------------------------------
# not through netCDF4, which refuses a file for one dangling link or one dataset without a
# dataspace, and ends the process at a group that contains itself


@contextmanager
def _datasets(path: Path, kind: str) -> "Iterator[dict[str, h5py.Dataset]]":
    """Yield all datasets of a file by their paths; InputError if it is damaged or has another format."""
    h5py = _library("h5py", "h5py", "hdf5")
    check_contained(path, by_h5py=True)
    with reading_errors(kind), h5py.File(path, "r") as file:
        by_path: dict[str, Any] = {}

        def add(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset):
                by_path[name] = item

        file.visititems(add)
        yield by_path


def _attribute(dataset: "h5py.Dataset", name: str) -> str:
    """Return a string attribute, empty if it does not exist."""
    value = _scalar(dataset.attrs.get(name, ""))
    return value if isinstance(value, str) else ""


def _scalar(value: object) -> object:
    """Return the value of an attribute; empty if it is an array of several."""
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size == 1 else ""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


def _arrays_of_dataset(name: str, dataset: "h5py.Dataset") -> Iterator[Array]:
    if dataset.shape is None:
        return
    unit = _attribute(dataset, "units") or _attribute(dataset, "unit")
    settings = _settings(dataset)
    if dataset.dtype.names is None:
        yield Array(
            name, dataset.shape, lambda selection: _read(dataset, selection), unit, settings
        )
    for field in dataset.dtype.names or ():
        of_field = dataset.fields(field)
        yield Array(f"{name}/{field}", dataset.shape, of_field.__getitem__, "", settings)


def _settings(dataset: "h5py.Dataset") -> dict[str, object]:
    """Return the attributes of a dataset and its group that may state start and interval of its samples."""
    return {
        name: _scalar(attributes[name])
        for attributes in (dataset.parent.attrs, dataset.attrs)
        for name in attributes
        if name.lower() in NAMES
    }


def _read(dataset: "h5py.Dataset", selection: Selection) -> Any:
    for name in ("scale_factor", "add_offset"):
        if name in dataset.attrs:
            raise InputError(
                f"{quote(dataset.name)} has the attribute {name}; name the file .nc, so that it is read as netCDF"
            )
    values = dataset[selection]
    fill = dataset.attrs.get("_FillValue")
    return values if fill is None else np.ma.masked_equal(values, np.ravel(fill)[0])


@READERS.register
class Hdf5Reader(TableReader):
    """HDF5."""

    kind, endings = "hdf5", (".h5", ".hdf5", ".hdf")

    @contextmanager
    def open(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Open an HDF5 file; InputError if it is damaged or has another format."""
        with _datasets(path, "HDF5") as by_path, reading_errors("HDF5"):
            yield Contents(
                [
                    array
                    for name, dataset in by_path.items()
                    for array in _arrays_of_dataset(name, dataset)
                ]
            )


# -- netCDF ----------------------------------------------------------------------------------------


def _variables(group: Any, above: str) -> Iterator[Array]:
    for name, variable in group.variables.items():
        if isinstance(variable.dtype, np.dtype):
            settings = {
                key: variable.getncattr(key) for key in variable.ncattrs() if key.lower() in NAMES
            }
            unit = _unit(getattr(variable, "units", ""))
            yield Array(above + name, variable.shape, variable.__getitem__, unit, settings)
    for name, inner in group.groups.items():
        yield from _variables(inner, f"{above}{name}/")


def _unit(unit: object) -> str:
    """Return a unit without the reference date of a time."""
    if isinstance(unit, bytes):
        unit = unit.decode("utf-8", "replace")
    return unit.partition(" since ")[0] if isinstance(unit, str) else ""


@READERS.register
class NetCDFReader(TableReader):
    """netCDF."""

    kind, endings = "netcdf", (".nc", ".nc4", ".cdf")

    @contextmanager
    def open(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Open a netCDF file; InputError if it is damaged or has another format."""
        with reading_errors("netCDF"):
            import netCDF4

            check_contained(path)
            with netCDF4.Dataset(path) as dataset:
                yield Contents(list(_variables(dataset, "")))


# -- MATLAB, version 5 -----------------------------------------------------------------------------
# A separate reader, since the one of SciPy ends the process at many damaged files. The format is
# described in "MAT-File Format", The MathWorks, R2023b.

_HEADER = 128
# types of elements
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
MOST_STRUCTURES = 1000  # largest number of structures or cells of an array that is read
_CLASSES = {1: "cells", 2: "structures", 3: "an object", 4: "texts", 5: "sparse", 16: "a function"}
# classes of matrices, and flags
_CELLS, _STRUCTURE, _TEXT, _NUMERIC, _OPAQUE = 1, 2, 4, range(6, 16), 17
_LOGICAL, _COMPLEX = 0x200, 0x800


def _contents_5(content: bytes, order: str) -> Contents:
    contents = Contents([])
    for kind, element in _decompress(
        _elements(memoryview(content)[_HEADER:], order), order, len(content)
    ):
        if kind == _MATRIX:
            _gather(contents, None, element, order)
    return contents


def _decompress(
    elements: Iterator[tuple[int, memoryview]], order: str, packed: int
) -> Iterator[tuple[int, memoryview]]:
    unpacked = 0
    for kind, element in elements:
        if kind == _COMPRESSED:
            stream = zlib.decompressobj()
            tag = stream.decompress(element, 8)
            (length,) = struct.unpack_from(f"{order}I", tag, 4)
            unpacked += 8 + length
            check_unpacked(unpacked, packed)
            # a few bytes more, so that the end of the stream is reached
            content = tag + stream.decompress(stream.unconsumed_tail, length + 8)
            if not stream.eof:
                raise InputError("is cut short, or damaged")
            yield from _elements(memoryview(content), order)
        else:
            yield kind, element


def _elements(content: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield the type and the bytes of each element."""
    start = 0
    while start < len(content):
        (tag,) = struct.unpack_from(f"{order}I", content, start)
        if tag >> 16:  # a small element: the tag itself holds its length and four bytes
            kind = tag & 0xFFFF
            length = min(tag >> 16, 4)
            content_start = start + 4
            following = start + 8
        else:
            kind = tag
            length = struct.unpack_from(f"{order}I", content, start + 4)[0]
            content_start = start + 8
            following = content_start + length + (0 if kind == _COMPRESSED else -length % 8)
        if content_start + length > len(content):
            raise InputError("is cut short, or damaged")
        yield kind, content[content_start : content_start + length]
        start = following


def _gather(contents: Contents, name: str | None, matrix: memoryview, order: str) -> None:
    """Add a variable, or the fields of a structure."""
    if not matrix:
        return
    (_, flags), (_, sizes), (_, variable_name), *rest = _elements(matrix, order)
    (flag,) = struct.unpack_from(f"{order}I", flags)
    if flag & 0xFF == _OPAQUE:
        # an object of a class such as string, table or datetime has no shape, but name, type system
        # and class
        class_name = bytes(rest[0][1]).decode("latin-1")
        contents.skipped[bytes(sizes).decode("latin-1") if name is None else name] = class_name
        return
    shape = tuple(int(size) for size in np.frombuffer(sizes, f"{order}i4"))
    name = bytes(variable_name).decode("latin-1") if name is None else name
    if min(shape) < 0 or len(shape) < 2:
        raise InputError(f"is damaged: {quote(name)} has the shape {shape}")
    kind = flag & 0xFF
    if not name:
        # contents of such objects, stored behind the variables
        return
    if kind == _STRUCTURE and 0 < math.prod(shape) <= MOST_STRUCTURES:
        (_, width), (_, names), *values = rest
        size = int(np.frombuffer(width, f"{order}i4")[0])
        fields = [
            bytes(names[start : start + size]).partition(b"\0")[0]
            for start in range(0, len(names), size)
        ]
        # fields of an array of structures are stored one structure after the other
        is_single = math.prod(shape) == 1
        elements = (
            [name]
            if is_single
            else [f"{name}({number})" for number in range(1, math.prod(shape) + 1)]
        )
        paths = [f"{element}.{field.decode('latin-1')}" for element in elements for field in fields]
        for path, (_, value) in zip(paths, values, strict=True):
            _gather(contents, path, value, order)
    elif kind == _CELLS and 0 < math.prod(shape) <= MOST_STRUCTURES:
        for number, (_, value) in enumerate(rest, 1):
            _gather(contents, f"{name}{{{number}}}", value, order)
    elif kind == _TEXT and shape[0] == 1:
        contents.texts[name] = _text(*rest[0], order)
    elif kind in _NUMERIC and not flag & (_LOGICAL | _COMPLEX):
        contents.arrays.append(_array(name, shape, *rest[0], order))
    else:
        numbers = "complex" if flag & _COMPLEX else "logical"
        contents.skipped[name] = f"{' × '.join(map(str, shape))}, {_CLASSES.get(kind, numbers)}"


def _text(kind: int, content: memoryview, order: str) -> str:
    encoding = _TEXTS[kind]
    if encoding.startswith(("utf-16", "utf-32")):
        encoding += "-le" if order == "<" else "-be"
    return bytes(content).decode(encoding, "replace")


def _array(name: str, shape: tuple[int, ...], kind: int, content: memoryview, order: str) -> Array:
    values = np.frombuffer(content, f"{order}{_NUMBERS[kind]}")
    if len(values) != math.prod(shape):
        raise InputError(f"is damaged: {quote(name)} of the shape {shape} has {len(values)} values")
    values = values.reshape(shape, order="F")
    return Array(name, shape, lambda selection: values[selection])


# -- MATLAB, version 7.3 ---------------------------------------------------------------------------


_NUMERIC_7 = {
    "",
    "double",
    "single",
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
}
_DEEPEST = 20  # largest depth of cells and structures


def _contents_7(by_path: "dict[str, h5py.Dataset]") -> Contents:
    contents = Contents([])
    for path, dataset in by_path.items():
        if path.startswith("#"):
            continue
        parts = path.split("/")
        groups = {
            ".".join(parts[:end]): dataset.file["/".join(parts[:end])]
            for end in range(1, len(parts))
        }
        classes = {name: _attribute(group, "MATLAB_class") for name, group in groups.items()}
        if other := next(
            (name for name, kind in classes.items() if kind not in {"", "struct"}), None
        ):
            _gather_7(contents, other, groups[other])
        else:
            _gather_7(contents, ".".join(parts), dataset)
    return contents


def _gather_7(
    contents: Contents, name: str, item: "h5py.Dataset | h5py.Group", depth: int = 0
) -> None:
    """Add a variable, the fields of a structure, or the elements that the references of cells and structures name."""
    if depth > _DEEPEST:
        raise InputError(f"is damaged: {name[:40]!r} is nested more than {_DEEPEST} deep")
    kind = _attribute(item, "MATLAB_class")
    if not hasattr(item, "shape"):
        if kind != "struct" or "MATLAB_sparse" in item.attrs:
            contents.skipped[name] = (
                "sparse" if "MATLAB_sparse" in item.attrs else kind or "another class"
            )
            return
        for field, inner in item.items():
            _gather_7(contents, f"{name}.{field}", inner, depth + 1)
    elif item.shape is None:
        return
    elif "MATLAB_empty" in item.attrs:
        contents.arrays.append(Array(name, (0,), lambda _: []))
    elif kind == "char":
        contents.texts[name] = "".join(map(chr, item[()].ravel()))
    elif item.dtype.kind == "O" and kind in {"", "cell"} and 0 < item.size <= MOST_STRUCTURES:
        above, _, field = name.rpartition(".")
        for number, reference in enumerate(item[()].ravel(), 1):
            # fields of an array of structures are arrays of references
            element = f"{name}{{{number}}}" if kind else f"{above}({number}).{field}"
            _gather_7(contents, element, item.file[reference], depth + 1)
    elif (
        item.dtype.kind in "fiu" and kind in _NUMERIC_7 and "MATLAB_object_decode" not in item.attrs
    ):
        # HDF5 stores the dimensions in reverse order
        read = partial(lambda data, selection: data[selection[::-1]], item)
        contents.arrays.append(Array(name, item.shape[::-1], read, "", _settings(item)))
    else:
        shape = " × ".join(map(str, item.shape[::-1]))
        contents.skipped[name] = (
            kind if "MATLAB_object_decode" in item.attrs else f"{shape}, {kind or 'another class'}"
        )


@READERS.register
class MatlabReader(TableReader):
    """MATLAB, version 7.3 and earlier."""

    kind, endings = "matlab", (".mat",)

    @contextmanager
    def open(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Open a MATLAB file; InputError if it is damaged or has another format."""
        with path.open("rb") as stream:
            header = stream.read(_HEADER)
        order = {b"IM": "<", b"MI": ">"}.get(header[126:])
        version = struct.unpack(f"{order}H", header[124:126])[0] if order else 0
        if version == 0x0200:
            with _datasets(path, "MATLAB") as by_path, reading_errors("MATLAB"):
                yield _contents_7(by_path)
        elif order and version == 0x0100:
            with reading_errors("MATLAB"):
                contents = _contents_5(path.read_bytes(), order)
            yield contents
        else:
            raise InputError(
                "is not a MATLAB file of version 5 or later; save it with -v7 or -v7.3"
            )


# -- TDMS ------------------------------------------------------------------------------------------


@contextmanager
def _strict() -> Iterator[None]:
    """Raise warnings of npTDMS as InputError: it would return the intact part of a damaged file."""
    from nptdms.log import log_manager

    reader = threading.get_ident()

    def refuse(record: logging.LogRecord) -> bool:
        # other threads may read other files
        if threading.get_ident() == reader:
            raise InputError(f"is damaged ({record.getMessage()[:200]})")
        return True

    log_manager.console_handler.addFilter(refuse)
    try:
        yield
    finally:
        log_manager.console_handler.removeFilter(refuse)


def _arrays_of_channel(channel: Any, origin: TimeBase | None) -> Iterator[Array]:
    """Yield a channel, and its times since the date of another one, if they are known."""
    name = f"{channel.group_name}/{channel.name}"
    length = (len(channel),)
    settings = dict(channel.properties)
    unit = str(settings.get("unit_string", ""))
    yield Array(name, length, lambda selection: channel[selection[0]], unit, settings)
    base = TimeBase.from_settings(settings)
    if base is None:
        return
    since = base if origin is None or np.isnan(base.start_after(origin)) else origin
    yield Array(
        f"{name}/time",
        length,
        lambda selection: base.times(*length, since)[selection[0]],
        "s",
        settings,
    )


@READERS.register
class TdmsReader(TableReader):
    """TDMS of LabVIEW, through npTDMS."""

    kind, endings = "tdms", (".tdms",)

    @contextmanager
    def open(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Open a TDMS file; InputError if it is damaged, has another format, or npTDMS is missing."""
        nptdms = _library("nptdms", "npTDMS", "tdms")
        with (
            reading_errors("TDMS"),
            path.open("rb") as stream,
            _strict(),
            nptdms.TdmsFile.open(stream) as file,
        ):
            if file.file_status.incomplete_final_segment:
                raise InputError(
                    "is cut short: its last segment is not complete; save the file again without it"
                )
            channels = [channel for group in file.groups() for channel in group.channels()]
            bases = [TimeBase.from_settings(channel.properties) for channel in channels]
            dated = [base for base in bases if base is not None and base.date is not None]
            origin = min(dated, key=lambda base: base.start_after(dated[0])) if dated else None
            yield Contents(
                [array for channel in channels for array in _arrays_of_channel(channel, origin)]
            )


# -- JSON ------------------------------------------------------------------------------------------


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        ((twice, _),) = Counter(key for key, _ in pairs).most_common(1)
        raise InputError(f"the key {quote(twice)} occurs twice in one object; rename one of them")
    return table


def _gather_json(contents: Contents, name: str, value: object) -> None:
    """Add the arrays and strings below a name to the contents."""
    above = f"{name}." if name else ""
    if isinstance(value, dict):
        for key, item in value.items():
            _gather_json(contents, above + key, item)
    elif isinstance(value, str):
        contents.texts[name] = value
    elif not isinstance(value, list):
        contents.arrays.append(Array(name, (), lambda _: [value]))
    elif value and all(isinstance(item, dict) for item in value):
        by_key: dict[str, dict[int, Any]] = {}
        for number, record in enumerate(value):
            for key, item in record.items():
                by_key.setdefault(key, {})[number] = item
        contents.arrays.extend(
            _array_of_records(above + key, items, len(value)) for key, items in by_key.items()
        )
    else:
        contents.arrays.append(_array_of_lists(name, value))


def _array_of_records(name: str, values: dict[int, Any], count: int) -> Array:
    """Make the array of one key from its values by record number; missing in records without the key."""
    if len(values) == count:
        return _array_of_lists(name, [*values.values()])
    # converted by selection, in a time proportional to the selection
    return Array(
        name,
        (count,),
        lambda selection: [*map(values.get, np.arange(count)[selection[0]].tolist())],
    )


def _array_of_lists(name: str, values: list[Any]) -> Array:
    # as objects, since integers may exceed the largest float
    array = np.array(values, dtype=object)
    return Array(name, array.shape, lambda selection: array[selection].ravel().tolist())


@READERS.register
class JsonReader(TableReader):
    """JSON."""

    kind, endings = "json", (".json",)

    @contextmanager
    def open(self, path: Path, layout: Format) -> Iterator[Contents]:
        """Open a JSON file; InputError if it is not JSON, has another encoding, or repeats a key."""
        text = decode_file(path, layout.encoding or "utf-8")
        contents = Contents([])
        with reading_errors("JSON"):
            try:
                _gather_json(contents, "", json.loads(text, object_pairs_hook=_object))
            except RecursionError:
                raise InputError("is nested too deeply; expected arrays by their keys") from None
        yield contents


# -- Excel: the rows of a sheet as lines with tabs between values, read as text --------------------

_MOST_MEMORY = 1 << 32  # memory limit of the sheets of a workbook [bytes]


def read_sheets(path: Path) -> None:
    """Read all sheets within a memory limit; the library stores all cells between the outermost filled ones."""
    from python_calamine import CalamineWorkbook

    limit_memory(_MOST_MEMORY)
    book = CalamineWorkbook.from_path(str(path))
    for name in book.sheet_names:
        book.get_sheet_by_name(name)


def _sheet(heights: dict[str, int], sheet: str | int | None) -> str:
    """Return the name of the sheet to read, from the numbers of rows by sheet."""
    names = [*heights]
    seen = list_names([f"{name} ({rows} rows)" for name, rows in heights.items()])
    if sheet is not None:
        chosen = (
            names[sheet - 1 : sheet]
            if isinstance(sheet, int)
            else [name for name in names if name == sheet]
        )
        if not chosen:
            raise InputError(f"there is no sheet {quote(sheet)}; seen: {seen}")
        return chosen[0]
    filled = [name for name, rows in heights.items() if rows]
    if len(filled) != 1:
        raise InputError(
            f"has {len(filled)} sheets that are not empty; choose one, as in sheet = 1 (or --sheet 1); seen: {seen}"
        )
    return filled[0]


def _cell(value: object, decimal: str) -> str:
    """Return a cell as text; numbers have the decimal sign of texts."""
    if isinstance(value, float):
        return (
            str(int(value))
            if value.is_integer() and abs(value) < 1e15
            else str(value).replace(".", decimal)
        )
    return " ".join(str(value).replace('"', "'").split())


@READERS.register
class ExcelReader(LineReader):
    """Sheets of Excel and OpenDocument, through python-calamine."""

    kind, endings = "excel", (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")

    @contextmanager
    def open(self, path: Path, layout: Format) -> Iterator[Iterator[str]]:
        """Yield the rows of a sheet as lines.

        InputError if the file is damaged, the sheet does not exist or is ambiguous, or
        python-calamine is missing.
        """
        python_calamine = _library("python_calamine", "python-calamine", "excel")
        with reading_errors("Excel"):
            check_archive(path, trusted=False)
        if not ends_well(read_sheets, path, most("HDF5_SECONDS") * 12):
            raise InputError(
                "has cells so far apart that its sheets need more than "
                f"{_MOST_MEMORY:,} bytes, or cannot be read in time; remove cells far from the columns, or export CSV"
            )
        with reading_errors("Excel"), path.open("rb") as stream:
            book = python_calamine.CalamineWorkbook.from_filelike(stream)
            heights = {name: book.get_sheet_by_name(name).height for name in book.sheet_names}
            rows = book.get_sheet_by_name(_sheet(heights, layout.sheet)).to_python(
                skip_empty_area=False
            )
        yield ("\t".join(_cell(value, layout.decimal) for value in row) + "\n" for row in rows)
