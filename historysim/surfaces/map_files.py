"""Contents of height-map files, and readers of matrices of numbers: text, NPY and NPZ."""

import abc
import csv
import math
import re
import warnings
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from historysim.basics.arguments import Array, Floats
from historysim.basics.hdf5 import check_contained
from historysim.basics.limits import check_unpacked
from historysim.basics.units import conversion_factor
from historysim.basics.wording import list_names, quote
from historysim.errors import InputError
from historysim.surfaces.heights import MOST_POINTS
from historysim.tables.lines import brief, decimal_hint, number, split
from historysim.tables.readers import READERS, Reader
from historysim.tables.text_rows import plain_numbers

COORDINATES = (
    "name it .xyz if its columns are x and z, or x, y and z; save it as .npy if it is a narrow map"
)

_DELIMITERS = ";\t,"
# codes of missing heights that instruments write, in addition to the general ones
_MISSING = re.compile(r"n/a|bad|[+-]?1\.#(?:qnan|snan|ind)|\*+|-+", re.IGNORECASE)
# only after white space, since some programs write NaN as 1.#QNAN
_COMMENT = re.compile(r"(?:^|(?<=\s))[#%]")
# a comment that states a length or a unit, as "# Width: 10 µm" in any language, or the header of a
# known program
_STATES_UNIT = re.compile(
    r"[:=：]\s*(?:[+-]?[\d.]+(?:e[+-]?\d+)?\s*)?(?:[pnuµμmck]?m|Å)\s*$|\bFile Format\b|\bBit2nm\b|\b[xy]-length\b"
)


@attrs.frozen(eq=False)
class RawMap:
    """Raw content of a height-map file, in the units of the file; None where the file does not state a field."""

    heights: Floats  #: (nx, ny) or (n,), NaN where missing
    unit: str | None = None  #: of the heights
    #: distance between neighbouring points along x and y
    spacing: tuple[float, float] | None = None
    lateral_unit: str | None = None  #: of the spacing
    periodic: bool = False  #: whether the surface repeats
    notice: str | None = None  #: for the user, on the choice of a channel


class MapReader(Reader):
    """Base class of height-map readers."""

    @abc.abstractmethod
    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read a channel of a file; InputError if the file is damaged or has no such channel."""


def check_size(shape: Iterable[int]) -> None:
    """Raise InputError if a map has more points than `MOST_POINTS`."""
    points = math.prod(shape)
    if points > MOST_POINTS:
        raise InputError(
            f"has {points:,} points; expected {MOST_POINTS:,} or fewer: thin or cut it"
        )


@contextmanager
def library_errors_as(problem: str) -> Iterator[None]:
    """Report exceptions of a library as an InputError with this problem, and silence its warnings."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:  # readers of damaged files raise any type of exception
        raise InputError(problem) from error


def refuse_channel(channel: int | str | None) -> None:
    """Raise InputError if a channel is given for a file without channels."""
    if channel is not None:
        raise InputError(f"channel is {channel!r}, but a matrix has no channels; leave it out")


def find_foreign_header(path: Path) -> str:
    """Return the first header line that only a reader of its format understands; an empty string if there is none."""
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for line_number, line in enumerate(stream, 1):
            excerpt = f"line {line_number}: {quote(line.strip())}"
            values, comment = _split_comment(line)
            if _STATES_UNIT.search(comment):
                return excerpt
            if values.strip():
                return "" if are_mostly_heights(re.findall(r'[^\s,;"]+', values)) else excerpt
    return ""


def are_mostly_heights(cells: list[str]) -> bool:
    """Return True if at least half of some strings are numbers or codes of missing heights."""
    return 2 * sum(_parse_height(cell, ".") is not None for cell in cells) >= len(cells)


def read_matrix(lines: Iterable[str]) -> Floats:
    """Parse lines of heights along x into (nx, ny), or (n,) for a single column; NaN where missing."""
    rows: list[Floats] = []
    first_line, delimiter, decimal, blank_corner, ends_blank = 0, " ", "", False, True
    for line_number, raw_line in enumerate(lines, 1):
        line = _split_comment(raw_line)[0].strip("\r\n ")
        if not line or not (line.strip() or delimiter == "\t"):
            continue
        if not rows:
            first_line, delimiter = (
                line_number,
                next((mark for mark in _DELIMITERS if mark in line), " "),
            )
            blank_corner = line[0] == delimiter
        if delimiter == ";":
            marks = decimal + "".join(mark for mark in ".," if mark in line)
            if len(set(marks)) > 1:
                raise InputError(
                    f"line {line_number}: a decimal point where another value has a comma; write them alike"
                )
            decimal = marks[:1]
        row = _parse_row(line, delimiter, decimal or ".", line_number)
        if rows and row.size != rows[0].size:
            raise InputError(
                f"line {line_number}: {row.size} values where line {first_line} has {rows[0].size}; expected as many "
                "in each line"
            )
        rows.append(row)
        check_size((len(rows), row.size))
        ends_blank = ends_blank and line[-1] == delimiter
    if not rows:
        raise InputError("has no line with heights")
    # a delimiter at the end of every line does not start a column
    matrix = np.array(rows)[:, : -1 if ends_blank else None]
    if blank_corner and _is_scale(matrix[0, 1:]) and _is_scale(matrix[1:, 0]):
        raise InputError(
            "has positions in its first line and first column; expected heights only: remove them"
        )
    lines_read, columns = matrix.shape
    if 1 < columns <= 3 < lines_read:
        raise InputError(
            f"has {columns} columns in {lines_read:,} lines, which may be coordinates; {COORDINATES}"
        )
    return matrix[:, 0] if columns == 1 else np.ascontiguousarray(matrix.T)


def _split_comment(line: str) -> tuple[str, str]:
    mark = _COMMENT.search(line) if "#" in line or "%" in line else None
    return (line[: mark.start()], line[mark.start() :]) if mark else (line, "")


def _parse_row(line: str, delimiter: str, decimal: str, line_number: int) -> Floats:
    try:
        cells = split([line], delimiter)[0]
    except csv.Error as error:
        raise InputError(f"line {line_number}: {error}; expected numbers without quotes") from error
    plain = plain_numbers(cells, decimal)
    if plain is not None:
        return plain
    heights = [_parse_height(cell, decimal) for cell in cells]
    if None in heights:
        column = heights.index(None)
        cell = cells[column].strip()
        hint = decimal_hint(cell, decimal)
        # matrices have no key for the decimal sign
        hint = (
            "; write the decimal comma as a point"
            if "it has a decimal" in hint
            else hint.partition(", and set")[0]
        )
        raise InputError(
            f"line {line_number}, column {column + 1}: {brief(cell)}; expected a finite number, or nan where the "
            f"height is missing{hint}"
        )
    return np.array(heights, dtype=np.float64)


def _parse_height(cell: str, decimal: str) -> float | None:
    """Parse a height: NaN if it is missing, None if the cell is neither."""
    value = number(cell, decimal)
    return math.nan if value is None and _MISSING.fullmatch(cell.strip()) else value


def _is_scale(values: Floats) -> bool:
    steps = np.diff(values)
    return (
        steps.size > 1 and steps[0] != 0 and bool(np.allclose(steps, steps[0], rtol=1e-6, atol=0))
    )


_CELLS = re.compile(r"[\s,;]+")
_FEWEST_ROWS = 4
_UNIT_OF_NAME = re.compile(r"[\[(]([^\])]*)[\])]\s*$|([^\s_/]+)\s*$")


@attrs.frozen(eq=False)
class Coordinates:
    """Points listed in a text file, x and z or x, y and z, with the units of its heading."""

    points: Floats  #: (points, 2) or (points, 3)
    names: tuple[str, ...]  #: of the columns; empty without a heading
    lateral_unit: str | None = None
    height_unit: str | None = None

    @property
    def evident(self) -> bool:
        """True if the columns are certainly lengths: a grid of x and y, or units or names that state it."""
        named = {name.strip().lower() for name in self.names}
        return (
            self.points.shape[1] > 2
            or self.height_unit is not None
            or named in ({"x", "z"}, {"x", "y"})
        )


def find_coordinates(path: Path) -> Coordinates | None:
    """Read the list of points at the end of a text file, below any header; None if it has no such list.

    The first of two columns has to increase or decrease; the first two of three columns have to
    form a full grid.
    """
    rows: list[list[float]] = []
    heading: list[str] = []
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for line in stream:
            text = _split_comment(line)[0].strip(" \t\r\n,;")
            values = [number(cell, ".") for cell in _CELLS.split(text)] if text else []
            numbers = [value for value in values if value is not None]
            if (
                len(numbers) in {2, 3}
                and len(numbers) == len(values)
                and (not rows or len(numbers) == len(rows[0]))
            ):
                rows.append(numbers)
                check_size((len(rows), len(numbers)))
            elif text and rows:
                return None
            elif text:
                heading = [cell.strip() for cell in re.split(r"[,;\t]", text)]
    if len(rows) < _FEWEST_ROWS:
        return None
    points = np.array(rows)
    if points.shape[1] == 2:
        steps = np.diff(points[:, 0])
        fits = bool((steps > 0).all() or (steps < 0).all())
    else:
        x, y = (np.unique(column).size for column in points[:, :2].T)
        fits = x * y == len(points) == len(np.unique(points[:, :2], axis=0)) and min(x, y) > 1
    if not fits:
        return None
    names = tuple(heading) if len(heading) == points.shape[1] else ()
    units = [_trailing_unit(name) for name in names] or [None]
    return Coordinates(points, names, units[0], units[-1])


def _trailing_unit(name: str) -> str | None:
    """Return the unit of length at the end of a column name, as in "Lateral um" or "z [nm]"; otherwise None."""
    match = _UNIT_OF_NAME.search(name)
    unit = (match[1] or match[2] or "").strip() if match else ""
    for candidate in (unit, unit.lower()):
        try:
            conversion_factor(candidate, "m")
        except InputError:
            continue
        return candidate
    return None


@READERS.register
class NetcdfMapReader(MapReader):
    """Heights of a netCDF file with coordinates and units, by CF or as written by SurfaceTopography."""

    kind, endings = "netcdf map", (".nc", ".nc4", ".cdf")

    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read the heights along x and y, which are identified by the names of the dimensions."""
        import netCDF4

        check_contained(path)
        with (
            library_errors_as("is damaged, or no netCDF file with heights"),
            netCDF4.Dataset(path) as file,
        ):
            variables = file.variables
            heights = variables[_height_variable(file, channel)]
            check_size(heights.shape)
            axes = [variables.get(name) for name in heights.dimensions]
            if len(axes) == 1 and axes[0] is None and "x" in variables:
                # SurfaceTopography has x of uneven profiles along n
                axes = [variables["x"]]
            values = np.ma.filled(np.ma.asarray(heights[...]).astype(np.float64), np.nan)
            if "mask" in variables and variables["mask"].shape == values.shape:
                values[np.asarray(variables["mask"][...], dtype=bool)] = np.nan
            if (
                len(axes) == 2
                and _is_y(heights.dimensions[0], axes[0])
                and not _is_y(heights.dimensions[1], axes[1])
            ):
                values, axes = values.T, axes[::-1]
            steps = [_step(axis, points) for axis, points in zip(axes, values.shape, strict=True)]
            units = [_read_attribute(axis, "units", "unit") for axis in axes]
            backwards = tuple(
                slice(None, None, -1 if step is not None and step < 0 else 1) for step in steps
            )
            spacing, lateral_unit = _unify_units(steps, units)
            return RawMap(
                np.ascontiguousarray(values[backwards]),
                unit=_read_attribute(heights, "units", "unit"),
                spacing=spacing,
                lateral_unit=lateral_unit,
                periodic=axes[0] is not None and bool(getattr(axes[0], "periodic", 0)),
            )


def _height_variable(file: Any, channel: int | str | None) -> str:
    """Return the name of the height variable: the channel, the only candidate, or a variable named height or z."""
    auxiliary = {
        *file.dimensions,
        "mask",
        *(getattr(variable, "bounds", "") for variable in file.variables.values()),
    }
    uneven = {"x"} if "n" in file.dimensions else set()
    candidates = [
        name
        for name, variable in file.variables.items()
        if name not in auxiliary | uneven
        and variable.ndim in {1, 2}
        and getattr(variable.dtype, "kind", "") in "fiu"
    ]
    maps: list[str] = [name for name in candidates if file.variables[name].ndim == 2] or candidates
    if not maps:
        raise InputError("holds no heights; expected a variable of numbers along x and y")
    listed = list_names([f"{index} {name}" for index, name in enumerate(maps)])
    if channel is not None:
        chosen = [
            name
            for index, name in enumerate(maps)
            if channel in {name, index} and not isinstance(channel, bool)
        ]
    else:
        chosen = [name for name in maps if name.lower() in {"heights", "height", "z"}] or maps
    if len(chosen) != 1:
        request = "channel" if channel is None else f"channel {channel!r}"
        raise InputError(
            f"has {len(maps)} variables with points; give {request} as the name or index of one: {listed}"
        )
    return chosen[0]


def _is_y(dimension: str, axis: Any) -> bool:
    return dimension.lower() == "y" or str(getattr(axis, "axis", "")).upper() == "Y"


def _read_attribute(variable: Any, *attributes: str) -> str | None:
    """Return the first non-empty attribute of a variable, of those named; None if there is none."""
    texts = [str(getattr(variable, name)).strip() for name in attributes if hasattr(variable, name)]
    # SurfaceTopography writes Å in ASCII
    return next(("Å" if text == "A" else text for text in texts if text), None)


def _step(axis: Any, points: int) -> float | None:
    """Return the spacing of the points along an axis, in its unit, negative if it decreases; None if unknown."""
    if axis is None:
        return None
    positions = np.ma.filled(np.ma.asarray(axis[...]).astype(np.float64), np.nan)
    if hasattr(axis, "length"):
        even = float(axis.length) / points
    elif positions.shape != (points,) or points < 2:
        return None
    else:
        even = float(positions[-1] - positions[0]) / (points - 1)
    # positions with 32 bits are rounded
    steps = np.diff(positions) if positions.shape == (points,) else np.zeros(0)
    if steps.size and steps.any() and not np.allclose(steps, even, rtol=1e-2, atol=0):
        raise InputError(
            "is a profile with uneven distances between its points; interpolate it to even distances"
        )
    return even if np.isfinite(even) and even else None


def _unify_units(
    steps: Sequence[float | None], units: Sequence[str | None]
) -> tuple[tuple[float, float] | None, str | None]:
    """Return the spacing of the points along x and y and its unit, which is m if the axes have different units."""
    spacings = [abs(step) for step in steps if step is not None]
    if len(spacings) != len(steps):
        return None, None
    if None in units and {*units} != {None}:
        raise InputError(
            "names the unit of one of its coordinates only; add the attribute units to the other"
        )
    unit = units[0]
    if len({*units}) > 1:
        spacings = [
            step * conversion_factor(str(axis_unit), "m")
            for step, axis_unit in zip(spacings, units, strict=True)
        ]
        unit = "m"
    return (spacings[0], spacings[-1]), unit


@READERS.register
class NpyReader(MapReader):
    """The array of an NPY file of numpy."""

    kind, endings = "npy", (".npy",)

    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read the array (nx, ny), or (n,) for a profile."""
        refuse_channel(channel)
        with library_errors_as(
            "is damaged, or no NPY file of numbers; save it again with numpy.save and array.astype(float)"
        ):
            return RawMap(_check_array(np.load(path, mmap_mode="r", allow_pickle=False)))


@READERS.register
class NpzReader(MapReader):
    """An array of an NPZ file of numpy."""

    kind, endings = "npz", (".npz",)

    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read the array named by the channel, which is optional for a file with one array."""
        problem = "is damaged, or no NPZ file of numbers; save it again with numpy.savez and array.astype(float)"
        with library_errors_as(problem), zipfile.ZipFile(path) as archive:
            names = [
                name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")
            ]
            if channel is None and len(names) != 1:
                raise InputError(
                    f"holds {len(names)} arrays; choose one with channel: {list_names(names) or 'none'}"
                )
            name = names[0] if channel is None else channel
            if name not in names:
                raise InputError(
                    f"has no array {name!r}; expected channel to be one of {list_names(names)}"
                )
            check_unpacked(archive.getinfo(f"{name}.npy").file_size, path.stat().st_size)
            with archive.open(f"{name}.npy") as stream:
                return RawMap(_check_array(np.lib.format.read_array(stream, allow_pickle=False)))


def _check_array(array: Array) -> Floats:
    if array.dtype.kind not in "fiu":
        raise InputError(
            f"holds an array of type {array.dtype}; expected numbers: save array.astype(float)"
        )
    if array.ndim not in {1, 2} or not array.size:
        raise InputError(
            f"holds an array of shape {array.shape}; expected (nx, ny), or (n,) for a profile"
        )
    check_size(array.shape)
    return array.astype(np.float64)
