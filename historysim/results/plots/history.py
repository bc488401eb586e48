"""Pictures of a recorded history: functions of a Dataset."""

import itertools
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.units import prefixed
from historysim.results.plots.paper import PAGE, Size, new_figure
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, STATES, plain_title, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

MOST_POINTS = 100_000
MOST_COLUMNS = 2_000
MOST_ROWS = 1_000
COLOURS = 256


def plot_history(history: xr.Dataset, *, size: Size | None = None) -> "Figure":
    """Draw the friction loop, the loads over time, and which asperities stick or slip.

    Parameters
    ----------
    history : xarray.Dataset
        A history. One without asperities gets its dissipated energy in place of the map of slip state. Long
        histories are thinned to what a page can show.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 180 mm wide.
    """
    rows = history.sizes.get("asperity", 0) if "slip_state" in history else 0
    map_height = 1.5 if rows == 0 else 0.35 + 1.65 * min(rows / 12, 1)
    with new_figure(size, (PAGE, 99.0 + 25.4 * map_height)) as figure:
        grid = figure.add_gridspec(3, 2, width_ratios=(1, 1), height_ratios=(1.1, 1.9, map_height))
        normal_axes = figure.add_subplot(grid[0, 1])
        thin = _thinned(history)
        _draw_loop(figure.add_subplot(grid[:2, 0]), thin)
        _draw_loads(normal_axes, figure.add_subplot(grid[1, 1], sharex=normal_axes), thin)
        last = figure.add_subplot(grid[2, :])
        if rows:
            _draw_states(last, history)
        else:
            _draw_energy(last, thin)
        if title := history.attrs.get("title"):
            figure.suptitle(plain_title(str(title)), x=0.01, ha="left", fontsize=9.5)
    return figure


def _draw_loop(axes: "Axes", thin: xr.Dataset) -> None:
    displacement, unit = scaled(thin["tangential_displacement"].values, "m")
    force, force_unit = scaled(thin["total_tangential_load"].values, "N")
    time = thin["time"].values
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
    _draw_coloured(axes, displacement, force, time)
    _draw_arrows(axes, displacement, force, time)
    for index, marker, name in ((0, "o", "start"), (-1, "s", "end")):
        colour = _time_colours()(0.0 if name == "start" else 1.0)
        axes.plot(
            displacement[index], force[index], marker, color=colour, mec="white", mew=0.6, ms=5, label=name, zorder=4
        )
    axes.margins(0.06)
    axes.set(
        title="Friction loop",
        xlabel=f"tangential displacement $U$ ({unit})",
        ylabel=f"tangential load $T$ ({force_unit})",
    )
    axes.set_title(
        "colour: time, as on the right\n● start  ■ end", loc="right", color=FAINT, fontsize=7, fontweight="normal"
    )


def _draw_loads(normal_axes: "Axes", tangential_axes: "Axes", thin: xr.Dataset) -> None:
    time, force, limit = (thin[name].values for name in ("time", "total_tangential_load", "friction_limit"))
    normal, normal_unit = scaled(thin["total_normal_load"].values, "N")
    normal_axes.plot(time, normal, color=INK, linewidth=1.0, rasterized=True)
    normal_axes.set(title="Loads", ylabel=f"normal load\n$N$ ({normal_unit})", ylim=(0, None))
    normal_axes.tick_params(labelbottom=False)

    factor, prefix = prefixed(max(np.abs(force).max(initial=0.0), limit.max(initial=0.0)))
    for sign, label in ((1, "friction limit"), (-1, None)):
        dashes: dict[str, Any] = {"color": FAINT, "linewidth": 0.9, "linestyle": (0, (4, 2)), "rasterized": True}
        tangential_axes.plot(time, sign * limit * factor, label=label, **dashes)
    tangential_axes.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.0)
    _draw_coloured(tangential_axes, time, force * factor, time)
    tangential_axes.margins(x=0.02)
    tangential_axes.set(xlabel="time (s)", ylabel=f"tangential load\n$T$ ({prefix}N)")


def _draw_states(axes: "Axes", history: xr.Dataset) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch
    from matplotlib.ticker import MaxNLocator

    steps, count = history.sizes["step"], history.sizes["asperity"]
    step_stride, row_stride = -(-steps // MOST_COLUMNS), -(-count // MOST_ROWS)
    by_height = np.argsort(-history["summit_height"].values, kind="stable")[::row_stride]
    states = history["slip_state"].isel(step=slice(None, None, step_stride)).values[:, by_height].T
    axes.imshow(
        states,
        cmap=ListedColormap(list(STATE_COLOURS)),
        vmin=-0.5,
        vmax=3.5,
        aspect="auto",
        interpolation="nearest",
        extent=(-0.5, steps - 0.5, count + 0.5, 0.5),
    )
    axes.spines[["top", "right"]].set_visible(True)
    if count <= 12:
        labels = history["asperity"].values[by_height]
        axes.set_yticks(range(1, count + 1, row_stride), [str(label) for label in labels])
        axes.set_ylabel("asperity")
    else:
        axes.set_ylabel("asperities by height,\nhighest on top")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(title="Slip state", xlabel="step")
    axes.legend(
        handles=[
            Patch(facecolor=colour, edgecolor=INK, linewidth=0.5, label=name)
            for colour, name in zip(STATE_COLOURS, STATES, strict=True)
        ],
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=4,
        borderaxespad=0.2,
        handlelength=1.2,
        columnspacing=1.2,
    )


def _draw_energy(axes: "Axes", thin: xr.Dataset) -> None:
    energy, unit = scaled(thin["total_dissipated_energy"].values, "J")
    axes.plot(thin["time"].values, energy, color=INK, linewidth=1.0, rasterized=True)
    axes.margins(x=0.01)
    axes.set(title="Dissipated energy", xlabel="time (s)", ylabel=f"energy ({unit})", ylim=(0, None))


def _thinned(history: xr.Dataset) -> xr.Dataset:
    """Return the totals at every n-th step and the last one: no more than a page can show."""
    totals = history[[name for name, variable in history.data_vars.items() if variable.dims == ("step",)]].load()
    steps = history.sizes["step"]
    return totals.isel(step=np.union1d(np.arange(0, steps, -(-steps // MOST_POINTS)), steps - 1))


@cache
def _time_colours() -> Any:
    import matplotlib as mpl
    from matplotlib.colors import ListedColormap

    # the light end is left out: it is lost on white paper
    return ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.08, 1.0, COLOURS)))


def _draw_coloured(axes: "Axes", x: Floats, y: Floats, time: Floats) -> None:
    from matplotlib.collections import LineCollection

    points = np.column_stack([x, y])
    # pieces of one colour: a path for each pair of points would take longer than the replay
    ends = np.unique(np.linspace(0, time.size - 1, COLOURS + 1).astype(int))
    pieces = [points[start : end + 1] for start, end in itertools.pairwise(ends)]
    lines = LineCollection(pieces, array=time[ends[1:]], cmap=_time_colours(), linewidth=1.0, rasterized=True)
    lines.set_capstyle("round")
    axes.add_collection(lines)
    axes.autoscale_view()


def _draw_arrows(axes: "Axes", x: Floats, y: Floats, time: Floats) -> None:
    """Mark the direction in the middle of the last swing each way."""
    for start, end in list(_swings(x))[-2:]:
        middle = start + int(np.abs(x[start : end + 1] - (x[start] + x[end]) / 2).argmin())
        behind = max(middle - max((end - start) // 50, 1), start)
        colour = _time_colours()((time[middle] - time[0]) / max(time[-1] - time[0], 1e-300))
        axes.annotate(
            "",
            xy=(x[middle], y[middle]),
            xytext=(x[behind], y[behind]),
            arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 11, "shrinkA": 0, "shrinkB": 0},
        )


def _swings(x: Floats) -> Iterator[tuple[int, int]]:
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
