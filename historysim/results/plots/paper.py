"""What a picture begins with: a figure of a size in millimetres, in the one style that all pictures share."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING

import numpy as np

from historysim.basics.arguments import checked
from historysim.errors import InputError
from historysim.results.plots.style import STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Size = tuple[float, float]
"""Width and height [mm]."""

COLUMN, PAGE = 90.0, 180.0
"""Widths [mm] of one column and of both in a journal."""
MILLIMETRES_PER_INCH = 25.4
LEAST, MOST = 20.0, 2000.0


@contextmanager
def new_figure(size: Size | None, default: Size) -> Iterator["Figure"]:
    """Yield an empty figure, to be drawn in the style of all pictures.

    Parameters
    ----------
    size : (float, float), optional
        Width and height [mm].
    default : (float, float)
        What stands for None.

    Raises
    ------
    InputError
        What is no width and height from 20 to 2000 mm.
    """
    from historysim.results.plots.printed import PrintedFigure

    given = default if size is None else size
    sides = checked("size", given, above=0)
    if sides.shape != (2,) or np.any((sides < LEAST) | (sides > MOST)):
        raise InputError(f"size is {size!r}; expected width and height from {LEAST:.0f} to {MOST:.0f} mm, as (90, 70)")
    with in_style():
        yield PrintedFigure(figsize=tuple(sides / MILLIMETRES_PER_INCH), layout="constrained")


def in_style() -> AbstractContextManager[None]:
    """Return a context in which what is drawn has the style of all pictures."""
    import matplotlib as mpl

    return mpl.rc_context(STYLE)
