"""Straight paths of both channels, one after the other: where they go, and which rows are recorded on the way."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from historysim.memory.binding import PATH

Paths = npt.NDArray[Any]
"""Paths (path), one after the other, with the fields of ``hs_path``: where each channel goes, in N or m, and how many
rows are recorded on the way."""

STILL = (0.0, 0.0)
"""Target and fraction of a channel that is held."""
UNTIMED = (np.nan, np.nan)
"""Beginning and end of a path whose times are not known."""


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

    Parameters
    ----------
    normal, tangential : Goals
        A single entry of either stands for all paths.
    parts : array_like (path)
        Equal parts that are walked; the inner ends are recorded.
    recorded : array_like (path)
        Whether the end is recorded, too.
    times : pair of array_like (path)
        When paths begin and end [s]; NaN where that is not known.
    """
    entries = (*normal, *tangential, parts, recorded, *times)
    columns = np.broadcast_arrays(*(np.atleast_1d(entry) for entry in entries))
    paths = np.zeros(columns[0].size, dtype=PATH)
    names = [f"{channel}_{name}" for channel in ("normal", "tangential") for name in Goals._fields]
    for name, column in zip((*names, "parts", "recorded", "begin", "end"), columns, strict=True):
        paths[name] = column
    rows = paths["parts"] - 1 + paths["recorded"]
    paths["first_row"] = np.cumsum(rows) - rows
    return paths


def unrecorded(paths: Paths) -> Paths:
    """Return the same paths without rows on the way."""
    found = paths.copy()
    found["parts"], found["recorded"], found["first_row"] = 1, 0, 0
    return found
