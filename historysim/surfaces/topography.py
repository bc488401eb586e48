"""Height maps in the formats of instruments, through SurfaceTopography."""

import importlib
import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from historysim.basics.hdf5 import check_contained
from historysim.basics.limits import check_archive, check_unpacked
from historysim.errors import InputError
from historysim.surfaces.map_files import COORDINATES, RawMap, blamed, check_size, mostly_heights

# an error signal in nm is no height either
_NO_HEIGHTS = re.compile(r"phase|amplitude|deflection|friction|lateral|current|error", re.IGNORECASE)
# formats that any file of a fitting length passes for
_ONLY_BY_NAME = ("hgt", "nms")
_UNKNOWN = "is damaged, or of no format that SurfaceTopography reads; expected a height map"


def read_topography(path: Path, channel: int | str | None, header: str = "") -> RawMap:
    """Read one channel of a file in any format that SurfaceTopography knows, by its index from 0 or its name.

    By default that is the first one with heights. ``header`` is the line of a text that made it one for
    SurfaceTopography, for messages. Raises InputError: SurfaceTopography is not installed or cannot read the file; no
    such channel, or one without heights; uneven spacing; too many points; lines that it would pass over.
    """
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
    check_size(chosen.nb_grid_pts or ())
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
    """Check that SurfaceTopography has passed over no line of heights, nor of a number of coordinates that it read."""
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
