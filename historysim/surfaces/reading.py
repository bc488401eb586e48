"""Measured height maps → `Surface`: selects the reader of a file and resolves its lengths and units."""

import importlib
import io
import math
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from historysim.basics.arguments import Floats, per_axis
from historysim.basics.files import as_path, path_state
from historysim.basics.hdf5 import check_contained
from historysim.basics.limits import check_archive, check_unpacked
from historysim.basics.units import conversion_factor
from historysim.basics.wording import list_names
from historysim.errors import InputError, UnlikelyValueWarning
from historysim.surfaces import map_files
from historysim.surfaces.heights import Surface
from historysim.surfaces.map_files import (
    COORDINATES,
    Coordinates,
    MapReader,
    RawMap,
    library_errors_as,
)
from historysim.surfaces.plausibility import missing_code_notice, scale_notice
from historysim.tables.readers import TEXT_ENDINGS, find_reader

FEWEST_POINTS = 3

# names of channels without heights; an error signal may have nm as its unit
_NO_HEIGHTS = re.compile(
    r"phase|amplitude|deflection|friction|lateral|current|error", re.IGNORECASE
)
# formats without a signature, which match any file of a suitable length
_ONLY_BY_NAME = ("hgt", "nms")
_UNKNOWN = "is damaged, or of no format that SurfaceTopography reads; expected a height map"

_LONGEST_REASON = 200  # characters of a reason that a library gives

_POINTS = ".xyz"  # ending of lists of points
_UNEVEN = "is no even grid or profile; expected points at even distances: interpolate it"

_UTF16 = (b"\xff\xfe", b"\xfe\xff")
# relative tolerance for typed numbers, which may be rounded
_TYPED = 1e-3


def read_surface(
    path: str | PathLike[str],
    *,
    pixel_size: float | str | tuple[float | str, float | str] | None = None,
    height_unit: str | None = None,
    lateral_unit: str | None = None,
    channel: int | str | None = None,
    missing: float | str | Sequence[float | str] = (),
) -> Surface:
    """Read a measured height map or an evenly spaced profile.

    Lengths and units are taken from the file if it states them. Arguments supply missing ones and
    must not contradict the file. README.md of this folder, "Look at a map", lists the formats.

    Parameters
    ----------
    path : str or path
        A matrix of numbers as text (.txt, .csv, .tsv, .dat, .asc) or array of numpy (.npy, .npz),
        or any file that SurfaceTopography reads, such as a text with a length or a unit in its
        header.
    pixel_size : float, str, or a pair of them, optional
        Distance between neighbouring points along x and y [m], or such as ``"0.5 µm"``.
    height_unit : str, optional
        Unit of the heights, such as ``"nm"``.
    lateral_unit : str, optional
        Unit of x and y, if the file has distances without a unit, such as lists of coordinates
        (.xyz).
    channel : int or str, optional
        Index, from 0, or name of a channel of the file. Default: the first channel of its format
        that has heights.
    missing : float or sequence of floats, optional
        Numbers in the file that represent missing points, such as ``-9999``.

    Returns
    -------
    Surface
        Heights in m, missing points NaN. A profile runs along x and has shape (n, 1).

    Raises
    ------
    InputError
        If the file is missing, damaged (with line and column) or of an unknown format; a length or
        unit is missing or contradicts the file; the channel does not exist or has no heights;
        heights are infinite; fewer than three points have a height; there are more than 2²⁸ points;
        SurfaceTopography is needed and not installed.

    Warns
    -----
    UnlikelyValueWarning
        If several channels have heights and none is chosen, a few values far from all others, such
        as -9999, may represent missing points, or the spacing of points is implausible compared
        with the heights.

    Notes
    -----
    One line of a text runs along x and the next line is the next y: ``heights[i, j]`` is value i of
    line j. The first index of a NPY array is x already. The delimiter is the first of semicolon,
    tab, comma and white space that appears in the first line; ``#`` and ``%`` start a comment. A
    decimal comma is accepted between semicolons only.

    Examples
    --------
    >>> surface = hs.read_surface("data/heights_128.txt", pixel_size=1e-6, height_unit="nm")
    >>> print(f"{surface.detrended('sphere').statistics().rms_height * 1e9:.1f} nm")
    64.1 nm
    """
    path = as_path(path)
    try:
        raw = _read(path, channel, is_matrix=pixel_size is not None)
        factor = _conversion_factor("height_unit", raw.unit, height_unit, "heights")
        spacing = _spacing(raw, pixel_size, lateral_unit)
        heights = _without_missing(raw.heights, missing)
        _check_points(heights)
        with np.errstate(over="ignore"):
            surface = Surface(heights * factor, spacing, periodic=raw.periodic)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from error
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error.strerror or error}") from error
    if raw.notice:
        warnings.warn(f"{path.name}: {raw.notice}", UnlikelyValueWarning, stacklevel=2)
    for notice in (missing_code_notice(heights), scale_notice(surface)):
        if notice:
            warnings.warn(f"{path.name}: {notice}", UnlikelyValueWarning, stacklevel=2)
            break
    return surface


def _without_missing(heights: Floats, missing: float | str | Sequence[float | str]) -> Floats:
    """Replace numbers that represent missing points by NaN."""
    codes = missing if isinstance(missing, Sequence) and not isinstance(missing, str) else [missing]
    for code in codes:
        try:
            value = float(code)
        except (TypeError, ValueError):
            raise InputError(
                f"missing is {code!r}; expected a number of the file, such as -9999"
            ) from None
        # the number is rounded in heights of 32 bits
        matches = np.isclose(heights, value, rtol=1e-6, atol=0)
        if not matches.any():
            raise InputError(
                f"missing is {value:g}, but no height equals it; expected a number of the file, or omit it"
            )
        heights = np.where(matches, np.nan, heights)
    return heights


def _read(path: Path, channel: int | str | None, *, is_matrix: bool) -> RawMap:
    """Read a file by the reader selected by its ending and its first lines."""
    if problem := path_state(path):
        expected = (
            "; expected a file with heights"
            if problem.startswith("is ")
            else f" in {path.absolute().parent}"
        )
        raise InputError(f"{problem}{expected}")
    with path.open("rb") as stream:
        start = stream.read(2)
    if not start:
        raise InputError("is empty; expected heights")
    reader: MapReader | None = find_reader(path, MapReader)
    if reader is not None:
        return reader.read(path, channel)
    ending = path.suffix.lower()
    if ending not in {*TEXT_ENDINGS, _POINTS}:
        return read_topography(path, channel)
    if start in _UTF16:
        raise InputError("is UTF-16 text; save it as UTF-8")
    header = map_files.find_foreign_header(path)
    # SurfaceTopography reads .xyz files, but not with an unknown heading
    is_list = header or ending != _POINTS
    if is_list and not is_matrix and (points := map_files.find_coordinates(path)):
        map_files.refuse_channel(channel)
        return read_points(points)
    if header or ending == _POINTS:
        return read_topography(path, channel, header)
    map_files.refuse_channel(channel)
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        return RawMap(map_files.read_matrix(stream))


def _conversion_factor(
    name: str, file_unit: str | None, argument: str | None, quantity: str
) -> float:
    if file_unit is None:
        if argument is None:
            raise InputError(
                f"does not name the unit of its {quantity}; give {name}='nm', in the shell "
                f"--{name.replace('_', '-')} nm"
            )
        return _metres(argument, name)
    factor = _metres(file_unit, f"the unit of its {quantity}")
    if argument is not None and not math.isclose(_metres(argument, name), factor, rel_tol=1e-9):
        raise InputError(
            f"states that its {quantity} are in {file_unit}, but {name} is {argument!r}; omit {name}"
        )
    return factor


def _metres(unit: str, source: str) -> float:
    """Convert a unit of length to m."""
    try:
        return conversion_factor(unit, "m")
    except InputError as error:
        raise InputError(f"{source}: {error}") from error


def _spacing(raw: RawMap, pixel_size: Any, lateral_unit: str | None) -> tuple[float, float]:
    stated = None if pixel_size is None else per_axis("pixel_size", pixel_size)
    if raw.spacing is None:
        if lateral_unit is not None:
            raise InputError(
                f"lateral_unit is {lateral_unit!r}, but the file has no distances; give pixel_size with its unit, as "
                "in pixel_size='0.5 µm'"
            )
        if stated is None:
            raise InputError(
                "does not state the distance between its points; give pixel_size in m, or as in pixel_size='0.5 µm'"
            )
        return stated
    factor = _conversion_factor("lateral_unit", raw.lateral_unit, lateral_unit, "distances")
    x, y = raw.spacing[0] * factor, raw.spacing[1] * factor
    if stated and not (
        math.isclose(stated[0], x, rel_tol=_TYPED) and math.isclose(stated[1], y, rel_tol=_TYPED)
    ):
        raise InputError(
            f"states that its points are {x:g} m × {y:g} m apart, but pixel_size is {pixel_size!r}; omit pixel_size"
        )
    return x, y


def _check_points(heights: Floats) -> None:
    if np.isinf(heights).any():
        raise InputError(
            "has infinite heights; expected numbers, and nan where a height is missing"
        )
    measured = np.count_nonzero(~np.isnan(heights))
    if measured < FEWEST_POINTS:
        raise InputError(
            f"has {measured} points with a height, of {heights.size:,}; expected {FEWEST_POINTS} or more"
        )


# -- through SurfaceTopography ---------------------------------------------------------------------


def read_topography(path: Path, channel: int | str | None, header: str = "") -> RawMap:
    """Read one channel of a file by SurfaceTopography; ``header`` is the line of a text file that requires it."""
    library = _import_library(header)
    ending = path.suffix.lower().removeprefix(".")
    without = f", without {header}" if header else ""
    for by_h5py in (False, True):
        check_contained(path, by_h5py=by_h5py)
    with library_errors_as(_UNKNOWN):
        check_archive(path, trusted=False)
    with (
        _reader_reason(library, path),
        library_errors_as(f"{_UNKNOWN}: export it again, or as a matrix (.txt, .npy){without}"),
        library.open_topography(
            str(path), format=ending if ending in _ONLY_BY_NAME else None
        ) as reader,
    ):
        if reader.format() in _ONLY_BY_NAME and reader.format() != ending:
            raise InputError(_UNKNOWN)
        return _read_channel(path, reader, channel, header)


@contextmanager
def _reader_reason(library: Any, path: Path) -> Iterator[None]:
    """Add to an error the reason of the library, or of its reader for the ending if no reader fits the file."""
    try:
        yield
    except InputError as error:
        cause = error.__cause__
        if cause is None:
            raise
        ending = path.suffix.lower().removeprefix(".")
        kinds = [kind for kind in library.IO.readers if ending in (kind.file_extensions() or ())]
        for kind in kinds if type(cause).__name__ == "CannotDetectFileFormat" else ():
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    library.open_topography(str(path), format=kind.format()).close()
            except Exception as refusal:  # noqa: BLE001 - readers of damaged files raise any type of exception
                cause = refusal
        reason = " ".join(str(cause).split()).replace(str(path), path.name) or type(cause).__name__
        reader = f"the reader of .{ending} reports: " if kinds else ""
        raise InputError(f"{error.args[0]} ({reader}{reason[:_LONGEST_REASON]})") from cause


def read_points(listed: Coordinates) -> RawMap:
    """Read a list of points, x and z or x, y and z, by SurfaceTopography."""
    library = _import_library("")
    rows = io.BytesIO(
        "\n".join(" ".join(map(repr, row)) for row in listed.points.tolist()).encode()
    )
    with (
        library_errors_as(f"its list of points {_UNEVEN}"),
        library.open_topography(rows, format="xyz") as reader,
    ):
        chosen = reader.default_channel
        if chosen.is_uniform is False:
            raise InputError(
                "is a profile with uneven distances between its points; interpolate it to even distances"
            )
        topography = chosen.topography()
        heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
        if heights.size != len(listed.points):
            raise InputError(f"its list of points {_UNEVEN}")
        x, *y = (
            float(size) / points
            for size, points in zip(topography.physical_sizes, heights.shape, strict=True)
        )
    return RawMap(
        heights,
        unit=listed.height_unit,
        spacing=(x, y[0] if y else x),
        lateral_unit=listed.lateral_unit,
    )


def _import_library(header: str) -> Any:
    try:
        with warnings.catch_warnings():
            # it warns of missing packages for parallel computers
            warnings.simplefilter("ignore")
            return importlib.import_module("SurfaceTopography")
    except ImportError as error:
        otherwise = f"; or remove {header}, and give pixel_size and height_unit" if header else ""
        raise InputError(
            f"needs SurfaceTopography, which cannot be imported ({error}): "
            f'pip install "historysim[surfaces]"{otherwise}'
        ) from error


def _read_channel(path: Path, reader: Any, channel: int | str | None, header: str) -> RawMap:
    form = reader.format()
    chosen = _select_channel(reader, channel)
    if chosen.is_uniform is False:
        raise InputError(
            "is a profile with uneven distances between its points; interpolate it to even distances"
        )
    map_files.check_size(chosen.nb_grid_pts or ())
    check_unpacked(8 * math.prod(chosen.nb_grid_pts or ()), path.stat().st_size)
    has_sizes = chosen.physical_sizes is not None
    if form == "asc":
        _refuse_guess(chosen, header)
    if form == "xyz" and header and not chosen.unit:
        raise InputError(
            f"holds coordinates, or a map of few columns with a header ({header}); {COORDINATES}"
        )
    topography = chosen.topography(
        **({} if has_sizes else {"physical_sizes": tuple(map(float, chosen.nb_grid_pts))})
    )
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    if form in {"asc", "xyz"}:
        _check_lines(path, heights.size if form == "xyz" else None)
    x, *y = (
        float(size) / points
        for size, points in zip(topography.physical_sizes, heights.shape, strict=True)
    )
    # it accepts steps as even if they differ by less than 1e-6 in any unit
    if form == "xyz" and not y and x < 1e-3:
        raise InputError(
            "has steps too small to check that they are even; write its coordinates in a smaller unit"
        )
    unit = topography.unit or None
    return RawMap(
        heights,
        unit=unit,
        spacing=(x, y[0] if y else x) if has_sizes else None,
        lateral_unit=unit or (_lateral_unit(chosen) if form == "asc" else None),
        periodic=bool(topography.is_periodic),
        notice=_channel_notice(reader, chosen) if channel is None else None,
    )


def _channel_notice(reader: Any, chosen: Any) -> str | None:
    """Return a notice that names the channels with heights if there are several; otherwise None."""
    channels = [
        (index, channel) for index, channel in enumerate(reader.channels) if _holds_heights(channel)
    ]
    if len(channels) < 2:
        return None
    listed = ", ".join(f"{index} {channel.name!r}" for index, channel in channels)
    return f"{chosen.name!r} is read, of {len(channels)} channels with heights; channel selects another: {listed}"


def _refuse_guess(channel: Any, header: str) -> None:
    """Raise InputError if SurfaceTopography assumes that a text is a matrix without evidence in the file."""
    if channel.physical_sizes is None and channel.dim == 2 and channel.nb_grid_pts[0] <= 3:
        raise InputError(
            "is a list of coordinates with gaps, or a map of few columns; expected every point of a grid, with nan "
            "where a height is missing; save it as .npy if it is a narrow map"
        )
    if channel.physical_sizes is None and not channel.unit:
        raise InputError(
            f"has a header without a unit or size that SurfaceTopography understands{f', {header}' if header else ''}; "
            "remove these lines, in a file named .txt, and give pixel_size and height_unit"
        )


def _select_channel(reader: Any, request: int | str | None) -> Any:
    channels = list(reader.channels)
    marked = [
        f"{channel.name}{'' if _holds_heights(channel) else ' (no heights)'}"
        for channel in channels
    ]
    listed = list_names([f"{index} {name}" for index, name in enumerate(marked)])
    if not channels:
        raise InputError(
            f"holds no heights, or {_UNKNOWN} (read as {reader.format()}, without a channel in a unit of length)"
        )
    if request is None:
        usable = [channel for channel in channels if _holds_heights(channel)]
        if not usable:
            raise InputError(f"has no channel with heights: {listed}")
        if len(usable) > 1 and not usable[0].unit:
            raise InputError(
                f"has {len(usable)} arrays and does not state which are heights; give channel: {listed}"
            )
        default = reader.default_channel
        return default if _holds_heights(default) else usable[0]
    if isinstance(request, str):
        matches = [channel for channel in channels if request in {channel.name, channel.channel_id}]
    else:
        matches = [
            channel
            for index, channel in enumerate(channels)
            if index == request and not isinstance(request, bool)
        ]
    if len(matches) != 1:
        raise InputError(
            f"has {len(matches) or 'no'} channels {request!r}; expected the name or index of one: {listed}"
        )
    if not _holds_heights(matches[0]):
        raise InputError(f"channel {request!r} holds no heights; expected another of {listed}")
    return matches[0]


def _holds_heights(channel: Any) -> bool:
    # a second unit belongs to values that are not lengths
    return bool(channel.is_height_channel) and not (
        isinstance(channel.unit, tuple) or _NO_HEIGHTS.search(channel.name)
    )


def _lateral_unit(channel: Any) -> str | None:
    header = channel.info.get("raw_metadata", {})
    units = {header[key] for key in ("xunit", "yunit") if header.get(key)}
    if len(units) > 1:
        raise InputError(f"gives its lengths in {' and '.join(sorted(units))}; expected one unit")
    return units.pop() if units else None


def _check_lines(path: Path, coordinates: int | None) -> None:
    """Raise InputError if SurfaceTopography has skipped a line of heights, or of a known number of coordinates."""
    width = count = 0
    doubtful: list[tuple[int, int]] = []
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for number, line in enumerate(stream, 1):
            cells = (
                line.split()
                if coordinates is None
                else re.split(r"[\s,;]+", line.strip(" \t\r\n,;"))
            )
            if cells and all(_is_number(cell) or cell.lower() == "bad" for cell in cells):
                width, count = len(cells), count + 1
            elif not line.startswith("#") and map_files.are_mostly_heights(cells):
                doubtful.append((number, len(cells)))
    for number, cell_count in doubtful:
        if cell_count == width:
            raise InputError(
                f"line {number} contains a value that is not a number; correct or remove it"
            )
    if coordinates is not None and count != coordinates:
        raise InputError(
            f"has {count:,} lines of numbers, of which SurfaceTopography reads {coordinates:,} as coordinates; "
            "remove the lines between them"
        )


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
