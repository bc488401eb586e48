"""Measured height maps → `Surface`: which reader a file needs, and its lengths and units.

Matrices of numbers, as text, NPY or NPZ, need nothing else. All other formats come through SurfaceTopography
(``pip install "historysim[surfaces]"``), which knows some forty of them.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from historysim.basics.arguments import per_axis
from historysim.basics.array_types import Floats
from historysim.basics.files import what_is_there
from historysim.basics.units import conversion_factor, quantity
from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.map_files import MapReader, RawMap, foreign_header, read_matrix, refuse_channel
from historysim.surfaces.topography import read_topography
from historysim.tables.readers import TEXT_ENDINGS, reader_of

FEWEST_POINTS = 3

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
) -> Surface:
    """Read a measured height map or an evenly spaced profile.

    What the file says about its lengths and units is taken from it. What it leaves open is never guessed: an argument
    has to supply it. An argument that contradicts the file is an error.

    Parameters
    ----------
    path : str or path
        The file. A matrix of numbers is a text (.txt, .csv, .tsv, .dat, .asc) or an array of numpy (.npy, .npz);
        everything else goes through SurfaceTopography, and so does a text with a length or a unit in its header.
    pixel_size : float, str, or a pair of them, optional
        Distance between neighbouring points [m], or a text such as ``"0.5 µm"``; one for both axes, or one for x and
        one for y. For files without it, as matrices are.
    height_unit : str, optional
        Unit of the heights, such as ``"nm"``, where the file names none, as matrices do.
    lateral_unit : str, optional
        Unit of x and y, where the file has distances but names no unit, as lists of coordinates (.xyz) do.
    channel : int or str, optional
        Which channel of the file, by its index from 0 or its name. By default the one that its format puts first,
        among those with heights.

    Returns
    -------
    Surface
        Heights in m, missing points NaN. A profile runs along x and has shape (n, 1).

    Raises
    ------
    InputError
        A file that is missing, damaged, or of no known format; a length or unit that is missing, or contradicts the
        file; no such channel, or one without heights; a matrix that is not rectangular or holds something else than
        numbers, with line and column; infinite heights, fewer than three points with a height, more than 2²⁸ points;
        a profile with uneven spacing; SurfaceTopography needed and not installed.

    Notes
    -----
    One line of a text runs along x and the next line is the next y, as SurfaceTopography and the programs of
    microscopes have it: ``heights[i, j]`` is value i of line j. The first index of a NPY array is x already. A text of
    one column is a profile. Values stand between semicolons, tabs, commas or white space, whichever of these the first
    line has, in this order; ``#`` and ``%`` start a comment; a height is missing where there is nan, NA, bad, dashes,
    asterisks, or nothing between two semicolons, tabs or commas (a last column of nothing is none). A decimal comma is
    read between semicolons only.

    Examples
    --------
    >>> surface = hs.read_surface("data/heights_128.txt", pixel_size=1e-6, height_unit="nm")
    >>> print(f"{surface.detrended('sphere').statistics().rms_height * 1e9:.1f} nm")
    64.1 nm
    """
    try:
        path = Path(path)
    except TypeError as error:
        raise InputError(f"path is {path!r}; expected the name of a file") from error
    with _named(path):
        found = _read(path, channel)
        factor = _factor("height_unit", found.unit, height_unit, "heights")
        spacing = _spacing(found, pixel_size, lateral_unit)
        _check_points(found.heights)
        with np.errstate(over="ignore"):
            return Surface(found.heights * factor, spacing, periodic=found.periodic)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from error
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error.strerror or error}") from error


def _read(path: Path, channel: int | str | None) -> RawMap:
    """Return what the file holds, by the reader that its ending and its first lines call for."""
    ending, start = path.suffix.lower(), _start(path)
    reader: MapReader | None = reader_of(path, MapReader)
    if reader is not None:
        return reader.read(path, channel)
    if ending not in TEXT_ENDINGS:
        return read_topography(path, channel)
    if start.startswith(_UTF16):
        raise InputError("is UTF-16 text; save it as UTF-8")
    if header := foreign_header(path):
        return read_topography(path, channel, header)
    refuse_channel(channel)
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        return RawMap(read_matrix(stream))


def _start(path: Path) -> bytes:
    if problem := what_is_there(path):
        expected = "; expected a file with heights" if problem.startswith("is ") else f" in {path.absolute().parent}"
        raise InputError(f"{problem}{expected}")
    with path.open("rb") as stream:
        start = stream.read(2)
    if not start:
        raise InputError("is empty; expected heights")
    return start


def _factor(name: str, own: str | None, given: str | None, what: str) -> float:
    if own is None and given is None:
        raise InputError(f"does not name the unit of its {what}; give {name}, as in {name}='nm'")
    if given is not None:
        try:
            stated = conversion_factor(given, "m")
        except InputError as error:
            raise InputError(f"{name}: {error}") from error
    if own is None:
        return stated
    try:
        factor = conversion_factor(own, "m")
    except InputError as error:
        raise InputError(f"the unit of its {what}: {error}") from error
    if given is not None and not math.isclose(stated, factor, rel_tol=1e-9):
        raise InputError(f"says that its {what} are in {own}, but {name} is {given!r}; leave {name} out")
    return factor


def _spacing(found: RawMap, pixel_size: Any, lateral_unit: str | None) -> tuple[float, float]:
    stated = None if pixel_size is None else _pixel_size(pixel_size)
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


def _pixel_size(given: Any) -> tuple[float, float]:
    lengths = given if isinstance(given, tuple | list | np.ndarray) else [given]
    try:
        return per_axis("pixel_size", [quantity(length, "m") for length in lengths])
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith("pixel_size") else f"pixel_size: {text}") from error


def _check_points(heights: Floats) -> None:
    infinite = np.argwhere(np.isinf(heights))
    if len(infinite):
        raise InputError(
            f"has {len(infinite):,} infinite heights, the first at {infinite[0].tolist()}; expected numbers, and nan "
            "where a height is missing"
        )
    measured = np.count_nonzero(~np.isnan(heights))
    if measured < FEWEST_POINTS:
        raise InputError(f"has {measured} points with a height, of {heights.size:,}; expected {FEWEST_POINTS} or more")
