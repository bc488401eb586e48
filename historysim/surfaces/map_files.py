"""What files of height maps hold, and how matrices of numbers are read: text, NPY and NPZ."""

import abc
import csv
import math
import re
import warnings
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Array, Floats
from historysim.basics.limits import check_unpacked
from historysim.errors import InputError
from historysim.surfaces.heights import MOST_POINTS
from historysim.tables.from_text import plain_numbers
from historysim.tables.lines import brief, decimal_hint, number, split
from historysim.tables.readers import READERS, Reader

COORDINATES = "name it .xyz if its columns are x and z, or x, y and z; save it as .npy if it is a narrow map"

_DELIMITERS = ";\t,"
# what instruments write beside what any file of numbers may have in place of a missing value
_MISSING = re.compile(r"n/a|bad|[+-]?1\.#(?:qnan|snan|ind)|\*+|-+", re.IGNORECASE)
# only after white space, since 1.#QNAN is how some programs write NaN
_COMMENT = re.compile(r"(?:^|(?<=\s))[#%]")
# a comment that states a length or a unit, as "# Width: 10 µm" in any language, or of a program with its own units
_STATES_UNIT = re.compile(
    r"[:=：]\s*(?:[+-]?[\d.]+(?:e[+-]?\d+)?\s*)?(?:[pnuµμmck]?m|Å)\s*$|\bFile Format\b|\bBit2nm\b|\b[xy]-length\b"
)


@attrs.frozen(eq=False)
class RawMap:
    """A height map as its file holds it, in its own units; None where the file does not say."""

    heights: Floats  #: (nx, ny) or (n,), NaN where missing
    unit: str | None = None  #: of the heights
    spacing: tuple[float, float] | None = None  #: distance between neighbouring points along x and y
    lateral_unit: str | None = None  #: of the spacing
    periodic: bool = False  #: whether the surface repeats


class MapReader(Reader):
    """What reads a format of height maps."""

    @abc.abstractmethod
    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read a file, and of it the channel that the user names; a damaged file or no such channel: InputError."""


def check_size(shape: Iterable[int]) -> None:
    """Check that a map has no more points than `MOST_POINTS`; more are an InputError."""
    points = math.prod(shape)
    if points > MOST_POINTS:
        raise InputError(f"has {points:,} points; expected {MOST_POINTS:,} or fewer: thin or cut it")


@contextmanager
def blamed(problem: str) -> Iterator[None]:
    """Turn what a library raises inside into this InputError, but pass on an InputError; silence its warnings."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:  # readers of damaged files raise whatever they stumble over
        raise InputError(problem) from error


def refuse_channel(channel: int | str | None) -> None:
    """Refuse a channel of a file that has none."""
    if channel is not None:
        raise InputError(f"channel is {channel!r}, but a matrix has no channels; leave it out")


def foreign_header(path: Path) -> str:
    """Return the line before the first heights that only a reader of its format understands, or nothing."""
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for line_number, line in enumerate(stream, 1):
            shown = f"line {line_number}: {line.strip()[:60]!r}"
            values, comment = _split_comment(line)
            if _STATES_UNIT.search(comment):
                return shown
            if values.strip():
                return "" if mostly_heights(re.findall(r'[^\s,;"]+', values)) else shown
    return ""


def mostly_heights(cells: list[str]) -> bool:
    """Return whether half of some strings, or more, are numbers or stand for a missing height."""
    return 2 * sum(_height(cell, ".") is not None for cell in cells) >= len(cells)


def read_matrix(lines: Iterable[str]) -> Floats:
    """Return the heights in lines along x, as (nx, ny), or (n,) of a text of one column; NaN where they are missing."""
    rows: list[Floats] = []
    first, delimiter, decimal, blank_corner, ends_blank = 0, " ", "", False, True
    for line_number, whole in enumerate(lines, 1):
        line = _split_comment(whole)[0].strip("\r\n ")
        if not line or not (line.strip() or delimiter == "\t"):
            continue
        if not rows:
            first, delimiter = line_number, next((mark for mark in _DELIMITERS if mark in line), " ")
            blank_corner = line[0] == delimiter
        if delimiter == ";":
            marks = decimal + "".join(mark for mark in ".," if mark in line)
            if len(set(marks)) > 1:
                raise InputError(
                    f"line {line_number}: a decimal point where another value has a comma; write them alike"
                )
            decimal = marks[:1]
        row = _row(line, delimiter, decimal or ".", line_number)
        if rows and row.size != rows[0].size:
            raise InputError(
                f"line {line_number}: {row.size} values where line {first} has {rows[0].size}; expected as many in "
                "each line"
            )
        rows.append(row)
        check_size((len(rows), row.size))
        ends_blank = ends_blank and line[-1] == delimiter
    if not rows:
        raise InputError("has no line with heights")
    # what stands behind the last delimiter of every line is no column
    matrix = np.array(rows)[:, : -1 if ends_blank else None]
    if blank_corner and _is_scale(matrix[0, 1:]) and _is_scale(matrix[1:, 0]):
        raise InputError("has positions in its first line and first column; expected heights only: take them out")
    lines_read, columns = matrix.shape
    if 1 < columns <= 3 < lines_read:
        raise InputError(f"has {columns} columns in {lines_read:,} lines, which may be coordinates; {COORDINATES}")
    return matrix[:, 0] if columns == 1 else np.ascontiguousarray(matrix.T)


def _split_comment(line: str) -> tuple[str, str]:
    mark = _COMMENT.search(line) if "#" in line or "%" in line else None
    return (line[: mark.start()], line[mark.start() :]) if mark else (line, "")


def _row(line: str, delimiter: str, decimal: str, line_number: int) -> Floats:
    try:
        cells = split([line], delimiter)[0]
    except csv.Error as error:
        raise InputError(f"line {line_number}: {error}; expected numbers without quotes") from error
    plain = plain_numbers(cells, decimal)
    if plain is not None:
        return plain
    heights = [_height(cell, decimal) for cell in cells]
    if None in heights:
        column = heights.index(None)
        cell = cells[column].strip()
        raise InputError(
            f"line {line_number}, column {column + 1}: {brief(cell)}; expected a finite number, or nan where the "
            f"height is missing{'; write the decimal comma as a point' if decimal_hint(cell, decimal) else ''}"
        )
    return np.array(heights, dtype=np.float64)


def _height(cell: str, decimal: str) -> float | None:
    """Return a height, NaN where it is missing, or None where there is something else."""
    value = number(cell, decimal)
    return math.nan if value is None and _MISSING.fullmatch(cell.strip()) else value


def _is_scale(values: Floats) -> bool:
    steps = np.diff(values)
    return steps.size > 1 and steps[0] != 0 and bool(np.allclose(steps, steps[0], rtol=1e-6, atol=0))


@READERS.register
class NpyReader(MapReader):
    """The array of an NPY file of numpy."""

    kind, endings = "npy", (".npy",)

    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read the array (nx, ny), or (n,) for a profile."""
        refuse_channel(channel)
        with blamed("is damaged, or no NPY file of numbers; save it again with numpy.save and array.astype(float)"):
            return RawMap(_heights_of(np.load(path, mmap_mode="r", allow_pickle=False)))


@READERS.register
class NpzReader(MapReader):
    """An array of an NPZ file of numpy."""

    kind, endings = "npz", (".npz",)

    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read the array that the channel names; a file of one array needs none."""
        problem = "is damaged, or no NPZ file of numbers; save it again with numpy.savez and array.astype(float)"
        with blamed(problem), zipfile.ZipFile(path) as archive:
            names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
            if channel is None and len(names) != 1:
                raise InputError(f"holds {len(names)} arrays; choose one with channel: {', '.join(names) or 'none'}")
            name = names[0] if channel is None else channel
            if name not in names:
                raise InputError(f"has no array {name!r}; expected channel to be one of {', '.join(names)}")
            check_unpacked(archive.getinfo(f"{name}.npy").file_size, path.stat().st_size)
            with archive.open(f"{name}.npy") as stream:
                return RawMap(_heights_of(np.lib.format.read_array(stream, allow_pickle=False)))


def _heights_of(array: Array) -> Floats:
    if array.dtype.kind not in "fiu":
        raise InputError(f"holds an array of type {array.dtype}; expected numbers: save array.astype(float)")
    if array.ndim not in {1, 2} or not array.size:
        raise InputError(f"holds an array of shape {array.shape}; expected (nx, ny), or (n,) for a profile")
    check_size(array.shape)
    return array.astype(np.float64)
