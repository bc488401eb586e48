"""What pictures along the path of a history share: thinning, colours of lines, swings, steps with their times."""

import itertools
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from historysim.basics.array_types import Floats, Integers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection


MOST_POINTS = 100_000
COLOURS = 256


def thinned(history: xr.Dataset) -> xr.Dataset:
    """Return the totals at every n-th step and the last one: no more than a page can show."""
    totals = history[[name for name, variable in history.data_vars.items() if variable.dims == ("step",)]].load()
    return totals.isel(step=kept_steps(history.sizes["step"]))


def kept_steps(steps: int) -> Integers:
    """Return every n-th of a number of steps and the last one: no more than a page can show."""
    return np.union1d(np.arange(0, steps, -(-steps // MOST_POINTS)), steps - 1)


@cache
def line_colours() -> Any:
    """Return the colours of lines, from light to dark: told apart in grey print, too."""
    import matplotlib as mpl
    from matplotlib.colors import ListedColormap

    # the light end is left out: it is lost on white paper
    return ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.08, 1.0, COLOURS)))


def draw_coloured(axes: "Axes", x: Floats, y: Floats, values: Floats, *, pieces: int = COLOURS) -> "LineCollection":
    """Draw a line whose colour tells values along it, in no more than so many pieces of one colour."""
    from matplotlib.collections import LineCollection

    points = np.column_stack([x, y])
    # a path for each pair of points would take longer than the replay
    ends = np.unique(np.linspace(0, values.size - 1, pieces + 1).astype(int))
    parts = [points[start : end + 1] for start, end in itertools.pairwise(ends)]
    lines = LineCollection(parts, array=values[ends[1:]], cmap=line_colours(), linewidth=1.0, rasterized=True)
    lines.set_capstyle("round")
    axes.add_collection(lines)
    axes.autoscale_view()
    return lines


def swings(x: Floats) -> Iterator[tuple[int, int]]:
    """Yield the ends of each swing; a change of direction counts when it exceeds a tenth of the range."""
    threshold = np.ptp(x) / 10
    start = turn = 0
    for index, value in enumerate(x):
        if (value - x[turn]) * (x[turn] - x[start]) >= 0:
            turn = index
        elif abs(value - x[turn]) > threshold:
            yield start, turn
            start, turn = turn, index
    if threshold > 0:
        yield start, turn


TIME_TICKS = 7
"""Most ticks of the axis of time below that of the steps."""
BELOW = 13.0
"""Distance of that axis from the other [pt]."""


def mark_steps_and_times(axes: "Axes", history: xr.Dataset) -> None:
    """Label an axis of steps, and draw an axis of their times below it, with round times."""
    from matplotlib.ticker import MaxNLocator

    time = history["time"].values
    steps = np.arange(time.size)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if time.size < 2:
        axes.set_xlabel(f"step, at {time[0]:.4g} s")
        return
    below = axes.secondary_xaxis("bottom")
    below.spines["bottom"].set_position(("outward", BELOW))
    below.spines["bottom"].set_visible(False)
    below.tick_params(length=0)
    ticks = _round_times(time)
    below.set_xticks(np.interp(ticks, time, steps), [f"{tick:.6g}" for tick in ticks])
    below.set_xlabel("step, and below it time (s)")


def _round_times(time: Floats) -> Floats:
    """Return round times that are apart on an axis of steps: where the clock jumps, fewer of them."""
    from matplotlib.ticker import MaxNLocator

    found = MaxNLocator(TIME_TICKS).tick_values(time[0], time[-1])
    found = found[(found >= time[0]) & (found <= time[-1])]
    places = np.interp(found, time, np.arange(time.size))
    kept: list[int] = []
    for number, place in enumerate(places):
        if not kept or place - places[kept[-1]] >= (time.size - 1) / (TIME_TICKS + 1):
            kept.append(number)
    chosen: Floats = found[kept]
    return chosen
