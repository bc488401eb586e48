"""Straight paths of both channels, one after the other: where they go, and which rows are recorded on the way."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from historysim.memory.layout import Bytes, Floats, Integers

LOAD, DISPLACED = 0, 1

# target and fraction of a channel that is held
STILL = (0.0, 0.0)

LEAST_APPROACH, LEAST_LOAD = 1e-150, 1e-225
"""Approach over the largest radius, and load in its unit, below which there is no contact that floats could hold."""


class Paths(NamedTuple):
    """Straight paths, one after the other: where each channel goes, and how many rows are recorded on the way.

    A channel goes ``fraction`` of the way from where it is to ``target``. ``parts`` equal parts are walked, the
    inner ones recorded from ``first_row`` on; ``recorded`` says whether the end is, too.
    """

    normal_control: Bytes
    normal_target: Floats
    normal_fraction: Floats
    tangential_control: Bytes
    tangential_target: Floats
    tangential_fraction: Floats
    parts: Integers
    recorded: Bytes
    first_row: Integers


class Goals(NamedTuple):
    """Where one channel goes on each of several paths; a single entry stands for all of them.

    ``control`` is `LOAD` or `DISPLACED`, ``target`` in N or m, ``fraction`` as in `Paths`.
    """

    control: npt.ArrayLike
    target: npt.ArrayLike
    fraction: npt.ArrayLike = 1.0


def paths_to(normal: Goals, tangential: Goals, *, parts: npt.ArrayLike = 1, recorded: npt.ArrayLike = True) -> Paths:
    """Return the straight paths to the goals of both channels, whose rows follow one another from row 0 on.

    Parameters
    ----------
    normal, tangential : Goals
        A single entry of either stands for all paths.
    parts : array_like (path)
        Equal parts that are walked; the inner ends are recorded.
    recorded : array_like (path)
        Whether the end is recorded, too.
    """
    columns = np.broadcast_arrays(*(np.atleast_1d(entry) for entry in (*normal, *tangential, parts, recorded)))
    parts, recorded = columns[6].astype(np.int64), columns[7].astype(np.int8)
    rows = parts - 1 + recorded
    return Paths(
        normal_control=columns[0].astype(np.int8),
        normal_target=columns[1].astype(np.float64),
        normal_fraction=columns[2].astype(np.float64),
        tangential_control=columns[3].astype(np.int8),
        tangential_target=columns[4].astype(np.float64),
        tangential_fraction=columns[5].astype(np.float64),
        parts=parts,
        recorded=recorded,
        first_row=np.cumsum(rows) - rows,
    )
