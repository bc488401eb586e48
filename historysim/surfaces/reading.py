"""Measured height maps → `Surface`: which reader a file needs, SurfaceTopography among them, its lengths and units."""

import importlib
import io
import math
import re
import warnings
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from historysim.basics.arguments import Floats, per_axis
from historysim.basics.files import as_path, what_is_there
from historysim.basics.hdf5 import check_contained
from historysim.basics.limits import check_archive, check_unpacked
from historysim.basics.units import conversion_factor
from historysim.errors import InputError, UnlikelyValueWarning
from historysim.surfaces import map_files
from historysim.surfaces.heights import Surface
from historysim.surfaces.map_files import COORDINATES, Coordinates, MapReader, RawMap, blamed
from historysim.surfaces.plausibility import placeholder_notice, scale_notice
from historysim.tables.readers import TEXT_ENDINGS, reader_of

FEWEST_POINTS = 3

# an error signal in nm is no height either
_NO_HEIGHTS = re.compile(r"phase|amplitude|deflection|friction|lateral|current|error", re.IGNORECASE)
# formats that any file of a fitting length passes for
_ONLY_BY_NAME = ("hgt", "nms")
_UNKNOWN = "is damaged, or of no format that SurfaceTopography reads; expected a height map"

_POINTS = ".xyz"  # ending of lists of points
_UNEVEN = "is no even grid or profile; expected points at even distances: interpolate it"

_UTF16 = (b"\xff\xfe", b"\xfe\xff")
# a number that someone typed may be rounded
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

    What the file says about its lengths and units is taken from it. An argument supplies what it leaves open, and must
    not contradict it. README.md of this folder, "Look at a map", has the formats.

    Parameters
    ----------
    path : str or path
        A matrix of numbers as text (.txt, .csv, .tsv, .dat, .asc) or array of numpy (.npy, .npz), or any file that
        SurfaceTopography reads, such as a text with a length or a unit in its header.
    pixel_size : float, str, or a pair of them, optional
        Distance between neighbouring points along x and y [m], or such as ``"0.5 µm"``.
    height_unit : str, optional
        Unit of the heights, such as ``"nm"``.
    lateral_unit : str, optional
        Unit of x and y, where the file has distances but names no unit, as lists of coordinates (.xyz) do.
    channel : int or str, optional
        Which channel of the file, by its index from 0 or its name. By default the one that its format puts first,
        among those with heights.
    missing : float or sequence of floats, optional
        Heights, as numbers of the file, that stand for missing points, such as ``-9999``.

    Returns
    -------
    Surface
        Heights in m, missing points NaN. A profile runs along x and has shape (n, 1).

    Raises
    ------
    InputError
        A file that is missing, damaged, or of no known format, with line and column; a length or unit that is missing,
        or contradicts the file; no such channel, or one without heights; infinite heights, or fewer than three points
        with a height; more than 2²⁸ points; SurfaceTopography needed and not installed.

    Warns
    -----
    UnlikelyValueWarning
        A few values far from all others, such as -9999, which may stand for missing points; or distances of the points
        that are implausible beside the heights.

    Notes
    -----
    One line of a text runs along x and the next line is the next y: ``heights[i, j]`` is value i of line j. The first
    index of a NPY array is x already. Values stand between semicolons, tabs, commas or white space, whichever of these
    the first line has, in this order; ``#`` and ``%`` start a comment. A decimal comma is read between semicolons only.

    Examples
    --------
    >>> surface = hs.read_surface("data/heights_128.txt", pixel_size=1e-6, height_unit="nm")
    >>> print(f"{surface.detrended('sphere').statistics().rms_height * 1e9:.1f} nm")
    64.1 nm
    """
    path = as_path(path)
    try:
        found = _read(path, channel, is_matrix=pixel_size is not None)
        factor = _factor("height_unit", found.unit, height_unit, "heights")
        spacing = _spacing(found, pixel_size, lateral_unit)
        heights = _without_missing(found.heights, missing)
        _check_points(heights)
        with np.errstate(over="ignore"):
            surface = Surface(heights * factor, spacing, periodic=found.periodic)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from error
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error.strerror or error}") from error
    for notice in (placeholder_notice(heights), scale_notice(surface)):
        if notice:
            warnings.warn(f"{path.name}: {notice}", UnlikelyValueWarning, stacklevel=2)
            break
    return surface


def _without_missing(heights: Floats, missing: float | str | Sequence[float | str]) -> Floats:
    """Return heights with NaN in place of the numbers that stand for missing points."""
    given = missing if isinstance(missing, Sequence) and not isinstance(missing, str) else [missing]
    for each in given:
        try:
            value = float(each)
        except (TypeError, ValueError):
            raise InputError(f"missing is {each!r}; expected a number of the file, such as -9999") from None
        # heights of 32 bits have a rounded one
        found = np.isclose(heights, value, rtol=1e-6, atol=0)
        if not found.any():
            raise InputError(f"missing is {value:g}, but no height is; expected a number of the file, or leave it out")
        heights = np.where(found, np.nan, heights)
    return heights


def _read(path: Path, channel: int | str | None, *, is_matrix: bool) -> RawMap:
    """Return what the file holds, by the reader that its ending and its first lines call for."""
    if problem := what_is_there(path):
        expected = "; expected a file with heights" if problem.startswith("is ") else f" in {path.absolute().parent}"
        raise InputError(f"{problem}{expected}")
    with path.open("rb") as stream:
        start = stream.read(2)
    if not start:
        raise InputError("is empty; expected heights")
    reader: MapReader | None = reader_of(path, MapReader)
    if reader is not None:
        return reader.read(path, channel)
    ending = path.suffix.lower()
    if ending not in {*TEXT_ENDINGS, _POINTS}:
        return read_topography(path, channel)
    if start in _UTF16:
        raise InputError("is UTF-16 text; save it as UTF-8")
    header = map_files.foreign_header(path)
    # the library reads a list of points in a file of its own ending, but no heading that it does not know
    is_list = header or ending != _POINTS
    if is_list and not is_matrix and (points := map_files.find_coordinates(path)):
        map_files.refuse_channel(channel)
        return read_points(points)
    if header or ending == _POINTS:
        return read_topography(path, channel, header)
    map_files.refuse_channel(channel)
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        return RawMap(map_files.read_matrix(stream))


def _factor(name: str, own: str | None, given: str | None, what: str) -> float:
    if own is None:
        if given is None:
            raise InputError(
                f"does not name the unit of its {what}; give {name}='nm', in the shell --{name.replace('_', '-')} nm"
            )
        return _metres(given, name)
    factor = _metres(own, f"the unit of its {what}")
    if given is not None and not math.isclose(_metres(given, name), factor, rel_tol=1e-9):
        raise InputError(f"says that its {what} are in {own}, but {name} is {given!r}; leave {name} out")
    return factor


def _metres(unit: str, what: str) -> float:
    """Return a unit of a length [m]."""
    try:
        return conversion_factor(unit, "m")
    except InputError as error:
        raise InputError(f"{what}: {error}") from error


def _spacing(found: RawMap, pixel_size: Any, lateral_unit: str | None) -> tuple[float, float]:
    stated = None if pixel_size is None else per_axis("pixel_size", pixel_size)
    if found.spacing is None:
        if lateral_unit is not None:
            raise InputError(
                f"lateral_unit is {lateral_unit!r}, but the file has no distances; give pixel_size with its unit, as "
                "in pixel_size='0.5 µm'"
            )
        if stated is None:
            raise InputError(
                "does not say how far apart its points are; give pixel_size in m, or as in pixel_size='0.5 µm'"
            )
        return stated
    factor = _factor("lateral_unit", found.lateral_unit, lateral_unit, "distances")
    x, y = found.spacing[0] * factor, found.spacing[1] * factor
    if stated and not (math.isclose(stated[0], x, rel_tol=_TYPED) and math.isclose(stated[1], y, rel_tol=_TYPED)):
        raise InputError(
            f"says that its points are {x:g} m × {y:g} m apart, but pixel_size is {pixel_size!r}; leave pixel_size out"
        )
    return x, y


def _check_points(heights: Floats) -> None:
    if np.isinf(heights).any():
        raise InputError("has infinite heights; expected numbers, and nan where a height is missing")
    measured = np.count_nonzero(~np.isnan(heights))
    if measured < FEWEST_POINTS:
        raise InputError(f"has {measured} points with a height, of {heights.size:,}; expected {FEWEST_POINTS} or more")


# -- through SurfaceTopography ---------------------------------------------------------------------


def read_topography(path: Path, channel: int | str | None, header: str = "") -> RawMap:
    """Read one channel of a file by SurfaceTopography; ``header`` is the line of a text that it takes to understand."""
    library = _library(header)
    ending = path.suffix.lower().removeprefix(".")
    without = f", without {header}" if header else ""
    for by_h5py in (False, True):
        check_contained(path, by_h5py=by_h5py)
    with blamed(_UNKNOWN):
        check_archive(path, trusted=False)
    with (
        blamed(f"{_UNKNOWN}: export it again, or as a matrix (.txt, .npy){without}"),
        library.open_topography(str(path), format=ending if ending in _ONLY_BY_NAME else None) as reader,
    ):
        if reader.format() in _ONLY_BY_NAME and reader.format() != ending:
            raise InputError(_UNKNOWN)
        return _read_channel(path, reader, channel, header)


def read_points(listed: Coordinates) -> RawMap:
    """Read a list of points, x and z or x, y and z, by SurfaceTopography."""
    library = _library("")
    rows = io.BytesIO("\n".join(" ".join(map(repr, row)) for row in listed.points.tolist()).encode())
    with blamed(f"its list of points {_UNEVEN}"), library.open_topography(rows, format="xyz") as reader:
        chosen = reader.default_channel
        if chosen.is_uniform is False:
            raise InputError("is a profile with uneven distances between its points; interpolate it to even ones")
        topography = chosen.topography()
        heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
        if heights.size != len(listed.points):
            raise InputError(f"its list of points {_UNEVEN}")
        x, *y = (float(size) / points for size, points in zip(topography.physical_sizes, heights.shape, strict=True))
    return RawMap(
        heights,
        unit=listed.height_unit,
        spacing=(x, y[0] if y else x),
        lateral_unit=listed.lateral_unit,
    )


def _library(header: str) -> Any:
    try:
        with warnings.catch_warnings():
            # it warns of the tools for parallel computers that it does not find
            warnings.simplefilter("ignore")
            return importlib.import_module("SurfaceTopography")
    except ImportError as error:
        otherwise = f"; or take out {header}, and give pixel_size and height_unit" if header else ""
        raise InputError(
            f"needs SurfaceTopography, which cannot be imported ({error}): "
            f'pip install "historysim[surfaces]"{otherwise}'
        ) from error


def _read_channel(path: Path, reader: Any, channel: int | str | None, header: str) -> RawMap:
    form = reader.format()
    chosen = _channel(reader, channel)
    if chosen.is_uniform is False:
        raise InputError("is a profile with uneven distances between its points; interpolate it to even ones")
    map_files.check_size(chosen.nb_grid_pts or ())
    check_unpacked(8 * math.prod(chosen.nb_grid_pts or ()), path.stat().st_size)
    has_sizes = chosen.physical_sizes is not None
    if form == "asc":
        _refuse_guess(chosen, header)
    if form == "xyz" and header and not chosen.unit:
        raise InputError(f"holds coordinates, or a map of few columns with a header ({header}); {COORDINATES}")
    topography = chosen.topography(**({} if has_sizes else {"physical_sizes": tuple(map(float, chosen.nb_grid_pts))}))
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    if form in {"asc", "xyz"}:
        _check_lines(path, heights.size if form == "xyz" else None)
    x, *y = (float(size) / points for size, points in zip(topography.physical_sizes, heights.shape, strict=True))
    # it takes steps that differ by less than 1e-6, of any unit, for even
    if form == "xyz" and not y and x < 1e-3:
        raise InputError("has steps too small to see whether they are even; write its coordinates in a smaller unit")
    unit = topography.unit or None
    return RawMap(
        heights,
        unit=unit,
        spacing=(x, y[0] if y else x) if has_sizes else None,
        lateral_unit=unit or (_lateral_unit(chosen) if form == "asc" else None),
        periodic=bool(topography.is_periodic),
    )


def _refuse_guess(channel: Any, header: str) -> None:
    """Refuse a text that SurfaceTopography takes for a matrix although nothing in it says so."""
    if channel.physical_sizes is None and channel.dim == 2 and channel.nb_grid_pts[0] <= 3:
        raise InputError(
            "is a list of coordinates with gaps, or a map of few columns; expected every point of a grid, with nan "
            "where a height is missing; save it as .npy if it is a narrow map"
        )
    if channel.physical_sizes is None and not channel.unit:
        raise InputError(
            f"has a header without a unit or size that SurfaceTopography understands{f', {header}' if header else ''}; "
            "take these lines out, in a file named .txt, and give pixel_size and height_unit"
        )


def _channel(reader: Any, wanted: int | str | None) -> Any:
    found = list(reader.channels)
    marked = [f"{one.name!r}{'' if _holds_heights(one) else ' (no heights)'}" for one in found]
    listed = ", ".join(f"{index} {name}" for index, name in enumerate(marked))
    if not found:
        raise InputError(f"holds no heights, or {_UNKNOWN}")
    if wanted is None:
        usable = [one for one in found if _holds_heights(one)]
        if not usable:
            raise InputError(f"has no channel with heights: {listed}")
        if len(usable) > 1 and not usable[0].unit:
            raise InputError(f"has {len(usable)} arrays and does not say which are heights; give channel: {listed}")
        default = reader.default_channel
        return default if _holds_heights(default) else usable[0]
    if isinstance(wanted, str):
        matches = [one for one in found if wanted in {one.name, one.channel_id}]
    else:
        matches = [one for index, one in enumerate(found) if index == wanted and not isinstance(wanted, bool)]
    if len(matches) != 1:
        raise InputError(f"has {len(matches) or 'no'} channels {wanted!r}; expected the name or index of one: {listed}")
    if not _holds_heights(matches[0]):
        raise InputError(f"channel {wanted!r} holds no heights; expected another of {listed}")
    return matches[0]


def _holds_heights(channel: Any) -> bool:
    # with two units, the second is that of values that are no lengths
    return bool(channel.is_height_channel) and not (isinstance(channel.unit, tuple) or _NO_HEIGHTS.search(channel.name))


def _lateral_unit(channel: Any) -> str | None:
    header = channel.info.get("raw_metadata", {})
    units = {header[key] for key in ("xunit", "yunit") if header.get(key)}
    if len(units) > 1:
        raise InputError(f"gives its lengths in {' and '.join(sorted(units))}; expected one unit")
    return units.pop() if units else None


def _check_lines(path: Path, coordinates: int | None) -> None:
    """Check that SurfaceTopography has passed over no line of heights, nor of a number of coordinates that it read."""
    width = count = 0
    doubtful: list[tuple[int, int]] = []
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for number, line in enumerate(stream, 1):
            cells = line.split() if coordinates is None else re.split(r"[\s,;]+", line.strip(" \t\r\n,;"))
            if cells and all(_is_number(cell) or cell.lower() == "bad" for cell in cells):
                width, count = len(cells), count + 1
            elif not line.startswith("#") and map_files.mostly_heights(cells):
                doubtful.append((number, len(cells)))
    for number, cells_there in doubtful:
        if cells_there == width:
            raise InputError(f"line {number} holds something that is no number; mend it, or take it out")
    if coordinates is not None and count != coordinates:
        raise InputError(
            f"has {count:,} lines of numbers, of which SurfaceTopography reads {coordinates:,} as coordinates; take "
            "out what stands between them"
        )


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
