"""Straight paths of both channels, one after the other: where they go, and which rows are recorded on the way."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from historysim.errors import InputError
from historysim.memory.binding import PATH, PLANAR_PATH

# Paths (path), one after the other, with the fields of ``hs_path``, or in two tangential directions of
# ``hs_planar_path``: where each channel goes, in N or m, and how many rows are recorded on the way.
Paths = npt.NDArray[Any]

STILL = (0.0, 0.0)  # target and fraction of a channel that is held
UNTIMED = (np.nan, np.nan)  # beginning and end of a path whose times are not known


class Goals(NamedTuple):
    """Where one channel goes on each of several paths; a single entry stands for all of them.

    ``control`` is `LOAD` or `DISPLACED`, ``target`` in N or m; ``fraction`` of the way there is gone.
    """

    control: npt.ArrayLike
    target: npt.ArrayLike
    fraction: npt.ArrayLike = 1.0


def paths_to(
    normal: Goals,
    tangential: Goals,
    *,
    parts: npt.ArrayLike = 1,
    recorded: npt.ArrayLike = True,
    times: tuple[npt.ArrayLike, npt.ArrayLike] = UNTIMED,
) -> Paths:
    """Return the straight paths to the goals of both channels, whose rows follow one another from row 0 on.

    A single entry stands for all paths. Tangential targets may be pairs (path, 2), in x and y. Each path is walked in
    equal ``parts``, with the inner ends ``recorded``, and its end where that says so. Times are when paths begin and
    end [s]; NaN where that is not known.
    """
    entries = [np.atleast_1d(entry) for entry in (*normal, *tangential, parts, recorded, *times)]
    (count,) = np.broadcast_shapes(*(entry.shape[:1] for entry in entries))
    paths = np.zeros(count, dtype=PATH if np.ndim(tangential.target) < 2 else PLANAR_PATH)
    names = [f"{channel}_{name}" for channel in ("normal", "tangential") for name in Goals._fields]
    for name, column in zip((*names, "parts", "recorded", "begin", "end"), entries, strict=True):
        paths[name] = column
    rows = paths["parts"] - 1 + paths["recorded"]
    paths["first_row"] = np.cumsum(rows) - rows
    return paths


def in_plane(paths: Paths) -> Paths:
    """Return paths in two tangential directions; those of one have to hold it."""
    if paths.dtype == PLANAR_PATH:
        return paths
    if paths["tangential_fraction"].any():
        raise InputError("the state is of two tangential directions; expected two numbers, in x and y, not one")
    found = np.zeros(paths.size, dtype=PLANAR_PATH)
    for name in set(PATH.names or ()) - {"tangential_target"}:
        found[name] = paths[name]
    return found


def unrecorded(paths: Paths) -> Paths:
    """Return the same paths without rows on the way."""
    found = paths.copy()
    found["parts"], found["recorded"], found["first_row"] = 1, 0, 0
    return found
