"""Measured height maps → `Surface`.

Matrices of numbers, as text or NPY, are read here and need nothing else. All other formats come through
SurfaceTopography (``pip install "historysim[surfaces]"``), which knows some forty of them.
"""

import importlib
import math
import re
import warnings
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import IO, Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import per_axis
from historysim.basics.units import conversion_factor, quantity
from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.matrix_text import COORDINATES, foreign_header, mostly_heights, read_matrix

Floats = npt.NDArray[np.float64]

MOST_POINTS = 2**28
FEWEST_POINTS = 3

_TEXT_ENDINGS = (".txt", ".csv", ".tsv", ".dat", ".asc")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
# a number that someone typed may be rounded
_TYPED = 1e-3

# an error signal in nm is no height either
_NO_HEIGHTS = re.compile(r"phase|amplitude|deflection|friction|lateral|current|error", re.IGNORECASE)
# formats that any file of a fitting length passes for
_ONLY_BY_NAME = ("hgt", "nms")
_UNKNOWN = "is damaged, or of no format that SurfaceTopography reads; expected a height map"


@attrs.frozen(eq=False)
class _Map:
    """What a file holds; None where it does not say.

    Attributes
    ----------
    heights : numpy.ndarray (nx, ny) or (n,)
        Heights, NaN where missing.
    unit : str, optional
        Unit of the heights.
    spacing : tuple of float, optional
        Distance between neighbouring points along x and y.
    lateral_unit : str, optional
        Unit of the spacing.
    periodic : bool
        Whether the surface repeats.
    """

    heights: Floats
    unit: str | None = None
    spacing: tuple[float, float] | None = None
    lateral_unit: str | None = None
    periodic: bool = False


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
        everything else goes through SurfaceTopography, and so does a text whose header states a length or a unit.
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


@contextmanager
def _blamed(problem: str) -> Iterator[None]:
    """Say of whatever is raised inside that the file is to blame, and keep the warnings to the library that warns."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:  # readers of damaged files raise whatever they stumble over
        raise InputError(problem) from error


def _read(path: Path, channel: int | str | None) -> _Map:
    ending = path.suffix.lower()
    start = _start(path)
    if ending == ".npz":
        return _read_npz(path, channel)
    if ending == ".npy":
        _refuse_channel(channel)
        with path.open("rb") as stream:
            return _Map(_read_array(stream))
    if ending not in _TEXT_ENDINGS:
        return _read_foreign(path, channel)
    if start.startswith(_UTF16):
        raise InputError("is UTF-16 text; save it as UTF-8")
    header = foreign_header(path)
    if header:
        return _read_foreign(path, channel, header)
    _refuse_channel(channel)
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        return _Map(read_matrix(stream, _check_size))


def _start(path: Path) -> bytes:
    if path.is_dir():
        raise InputError("is a folder; expected a file with heights")
    if not path.is_file():
        raise InputError(f"there is no such file in {path.absolute().parent}")
    with path.open("rb") as stream:
        start = stream.read(2)
    if not start:
        raise InputError("is empty; expected heights")
    return start


def _refuse_channel(channel: int | str | None) -> None:
    if channel is not None:
        raise InputError(f"channel is {channel!r}, but a matrix has no channels; leave it out")


# lengths and units


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


def _spacing(found: _Map, pixel_size: Any, lateral_unit: str | None) -> tuple[float, float]:
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


def _check_size(shape: Iterable[int]) -> None:
    points = math.prod(shape)
    if points > MOST_POINTS:
        raise InputError(f"has {points:,} points; expected {MOST_POINTS:,} or fewer: thin or cut it")


# NPY


def _read_array(stream: IO[bytes]) -> Floats:
    with _blamed("is damaged, or no NPY file; save it again with numpy.save"):
        first = np.lib.format.read_magic(stream) == (1, 0)
        read_header = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
        shape, _, kind = read_header(stream)
        if kind.kind not in "fiu":
            raise InputError(f"holds an array of type {kind}; expected numbers: save array.astype(float)")
        if len(shape) not in {1, 2} or min(shape) < 1:
            raise InputError(f"holds an array of shape {shape}; expected (nx, ny), or (n,) for a profile")
        _check_size(shape)
        stream.seek(0)
        return np.lib.format.read_array(stream, allow_pickle=False).astype(np.float64)


def _read_npz(path: Path, channel: int | str | None) -> _Map:
    with _blamed("is damaged, or no NPZ file; save it again with numpy.savez"), zipfile.ZipFile(path) as archive:
        names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
        if channel is None and len(names) != 1:
            raise InputError(f"holds {len(names)} arrays; choose one with channel: {', '.join(names) or 'none'}")
        name = names[0] if channel is None else channel
        if name not in names:
            raise InputError(f"has no array {name!r}; expected channel to be one of {', '.join(names)}")
        with archive.open(f"{name}.npy") as stream:
            return _Map(_read_array(stream))


# SurfaceTopography


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


def _read_foreign(path: Path, channel: int | str | None, header: str = "") -> _Map:
    library = _library(header)
    ending = path.suffix.lower().removeprefix(".")
    without = f", without {header}" if header else ""
    with (
        _blamed(f"{_UNKNOWN}: export it again, or as a matrix (.txt, .npy){without}"),
        library.open_topography(str(path), format=ending if ending in _ONLY_BY_NAME else None) as reader,
    ):
        if reader.format() in _ONLY_BY_NAME and reader.format() != ending:
            raise InputError(_UNKNOWN)
        return _read_channel(path, reader, channel, header)


def _read_channel(path: Path, reader: Any, channel: int | str | None, header: str) -> _Map:
    form = reader.format()
    chosen = _channel(reader, channel)
    if chosen.is_uniform is False:
        raise InputError("is a profile with uneven distances between its points; interpolate it to even ones")
    _check_size(chosen.nb_grid_pts or ())
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
        raise InputError("has steps too small to tell whether they are even; write its coordinates in a smaller unit")
    unit = topography.unit or None
    return _Map(
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
            "take it out, name the file .txt, and give pixel_size and height_unit"
        )


def _channel(reader: Any, wanted: int | str | None) -> Any:
    found = list(reader.channels)
    listed = ", ".join(
        f"{index} {one.name!r}{'' if _holds_heights(one) else ' (no heights)'}" for index, one in enumerate(found)
    )
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
    """Check that no line with heights was passed over, as SurfaceTopography does with those that it cannot read.

    Parameters
    ----------
    path : Path
        A text that it has read.
    coordinates : int, optional
        How many points it has read from a list of coordinates, rather than a matrix.

    Raises
    ------
    InputError
        A line as long as the others that does not consist of numbers, or another number of lines with coordinates.
    """
    width = count = 0
    doubtful: list[tuple[int, int]] = []
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for number, line in enumerate(stream, 1):
            cells = line.split() if coordinates is None else re.split(r"[\s,;]+", line.strip(" \t\r\n,;"))
            if cells and all(_is_number(cell) or cell.lower() == "bad" for cell in cells):
                width, count = len(cells), count + 1
            elif not line.startswith("#") and mostly_heights(cells):
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
