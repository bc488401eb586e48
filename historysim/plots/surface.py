"""Pictures of a surface: its height map, its summits, and which of them stick or slip at a step of a history."""

import textwrap
from typing import TYPE_CHECKING

import attrs
import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.errors import InputError
from historysim.plots.style import FAINT, INK, STATE_COLOURS, STATES, STYLE, scaled
from historysim.units import prefixed, quantity_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

MISSING = "#e8a5a0"
"""Points of a map without a height."""
MOST_MARKS = 20_000
"""Summits without contact that are marked; of more, evenly chosen ones."""
SEPARATED, TOUCHING = 0, -1
ON_MAP = "#4aa8e0"
"""Summits without contact on grey heights."""


@attrs.frozen(eq=False)
class _Contact:
    """What a history says of the summits at one step.

    Attributes
    ----------
    state : array (summit)
        Slip state, or `TOUCHING` where the summit touches and was not recorded.
    separation : float
        Height of the rigid flat [m].
    caption : str
        The step, its time and its loads.
    """

    state: npt.NDArray[np.int8]
    separation: float
    caption: str


def surface_of(history: xr.Dataset) -> xr.Dataset:
    """Return the summits that a history was recorded of, where its file has no surface: those that it holds.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    xarray.Dataset
        As `surface_group.dataset` gives it, with the labels of the asperities on ``summit``.

    Raises
    ------
    InputError
        A history of totals alone.
    """
    if "summit_height" not in history:
        raise InputError("the history holds no asperities; expected one recorded with asperities, or its file")
    names = {"summit_height": "summit_height", "summit_radius": "summit_radius", "x": "summit_x", "y": "summit_y"}
    return xr.Dataset(
        {ours: ("summit", history[theirs].values) for theirs, ours in names.items() if theirs in history.coords},
        coords={"summit": history["asperity"].values},
    )


def surface_picture(surface: xr.Dataset, history: xr.Dataset | None = None, step: int = -1) -> "Figure":
    """Draw a surface with its summits, and the asperity distribution: radius against height.

    Parameters
    ----------
    surface : xarray.Dataset
        Summits, and a height map where there is one: the group ``surface`` of a result.
    history : xarray.Dataset, optional
        A history; the summits in contact are coloured by their slip state.
    step : int
        At this step of it; negative ones count from the end.

    Returns
    -------
    matplotlib.figure.Figure
        A figure 180 mm wide. Without positions only the asperity distribution is drawn.

    Raises
    ------
    InputError
        A step that the history does not have.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    contact = None if history is None else _contact(surface, history, step)
    placed = "summit_x" in surface and "summit_y" in surface
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.1, 3.6), layout="constrained")
        grid = figure.add_gridspec(1, 2, width_ratios=(1.25, 1)) if placed else figure.add_gridspec(1, 1)
        if placed:
            _draw_map(figure.add_subplot(grid[0, 0]), surface, contact)
        _draw_distribution(figure.add_subplot(grid[0, -1]), surface, contact)
        title = str(history.attrs.get("title", "")) if history is not None else str(surface.attrs.get("title", ""))
        lines = [textwrap.shorten(title, 110, placeholder=" …").replace("$", r"\$")] if title else []
        if contact is not None:
            lines.append(contact.caption)
        if lines:
            figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=9)
    return figure


def _contact(surface: xr.Dataset, history: xr.Dataset, step: int) -> _Contact:
    steps = history.sizes["step"]
    if not -steps <= step < steps:
        raise InputError(f"step {step}: the history has {steps} steps; expected {-steps} to {steps - 1}")
    row = history.isel(step=step)
    separation = float(row["separation"])
    labels = surface["summit"].values if "summit" in surface.coords else np.arange(surface.sizes["summit"])
    state = np.where(surface["summit_height"].values > separation, TOUCHING, SEPARATED).astype(np.int8)
    if "slip_state" in row:
        state[np.searchsorted(labels, row["asperity"].values)] = row["slip_state"].values
    caption = (
        f"step {step % steps:,}, t = {float(row['time']):.6g} s:  "
        f"N = {quantity_text(float(row['total_normal_load']), 'N')},  "
        f"T = {quantity_text(float(row['total_tangential_load']), 'N')},  "
        f"U = {quantity_text(float(row['tangential_displacement']), 'm')},  "
        f"{int(row['contact_count']):,} asperities in contact"
    )
    return _Contact(state, separation, caption)


def _draw_map(axes: "Axes", surface: xr.Dataset, contact: _Contact | None) -> None:
    x, y = surface["summit_x"].values, surface["summit_y"].values
    extent = max(np.ptp(x), np.ptp(y), *(np.ptp(surface[name].values) for name in ("x", "y") if name in surface), 1e-30)
    factor, prefix = prefixed(extent)
    if "height" in surface:
        _draw_heights(axes, surface, factor)
    _draw_marks(axes, x * factor, y * factor, contact, on_map="height" in surface)
    axes.set_aspect("equal")
    axes.spines[["top", "right"]].set_visible(True)
    axes.set(title="Surface and summits", xlabel=f"$x$ ({prefix}m)", ylabel=f"$y$ ({prefix}m)")


def _draw_heights(axes: "Axes", surface: xr.Dataset, factor: float) -> None:
    import matplotlib as mpl

    heights, unit = scaled(surface["height"].values, "m")
    x, y = (surface[name].values * factor for name in ("x", "y"))
    half_x, half_y = (np.diff(axis[:2]).max(initial=0.0) / 2 or 0.5 for axis in (x, y))
    # a few spikes would leave all else in one grey
    low, high = np.nanpercentile(heights, (0.5, 99.5))
    image = axes.imshow(
        heights.T,
        origin="lower",
        cmap=mpl.colormaps["gray"].with_extremes(bad=MISSING),
        vmin=low,
        vmax=high if high > low else low + 1,
        extent=(x[0] - half_x, x[-1] + half_x, y[0] - half_y, y[-1] + half_y),
        interpolation="nearest",
    )
    bar = axes.figure.colorbar(image, ax=axes, shrink=0.85, pad=0.02, extend="both")
    bar.set_label(f"height $z$ ({unit})")
    bar.outline.set_linewidth(0.4)


def _draw_distribution(axes: "Axes", surface: xr.Dataset, contact: _Contact | None) -> None:
    heights, height_unit = scaled(surface["summit_height"].values, "m")
    radii, radius_unit = scaled(surface["summit_radius"].values, "m")
    _draw_marks(axes, heights, radii, contact, on_map=False)
    if contact is not None:
        factor = prefixed(np.abs(surface["summit_height"].values).max(initial=0.0))[0]
        axes.axvline(contact.separation * factor, color=INK, linewidth=0.8, linestyle=(0, (4, 2)), zorder=1)
        axes.annotate(
            "rigid flat",
            (contact.separation * factor, 1),
            xycoords=("data", "axes fraction"),
            xytext=(-3, -2),
            textcoords="offset points",
            rotation=90,
            ha="right",
            va="top",
            fontsize=7,
        )
    # radii of rough surfaces reach over decades
    if radii.max(initial=1) > 20 * radii.min(initial=1):
        axes.set_yscale("log")
    elif np.ptp(radii) <= 1e-12 * radii.max(initial=1):
        axes.set_ylim(0, 2 * radii.max(initial=1))
    axes.set(
        title="Asperity distribution",
        xlabel=f"summit height $z$ ({height_unit})",
        ylabel=f"summit radius $R$ ({radius_unit})",
    )
    if contact is not None:
        _draw_legend(axes, unknown=bool((contact.state == TOUCHING).any()))


def _draw_marks(axes: "Axes", x: Floats, y: Floats, contact: _Contact | None, *, on_map: bool) -> None:
    state = np.zeros(x.size, dtype=np.int8) if contact is None else contact.state
    separated = np.flatnonzero(state == SEPARATED)
    separated = separated[:: max(-(-separated.size // MOST_MARKS), 1)]
    size = float(np.clip(120 / np.sqrt(max(separated.size, 1)), 0.9, 4.0))
    colour = ON_MAP if on_map else FAINT
    axes.plot(x[separated], y[separated], ".", color=colour, ms=size, markeredgewidth=0, rasterized=True)
    area = 16 if np.count_nonzero(state != SEPARATED) <= 500 else 7
    for value, fill in (*enumerate(STATE_COLOURS), (TOUCHING, "none")):
        if value == SEPARATED:
            continue
        here = state == value
        axes.scatter(x[here], y[here], s=area, c=fill, edgecolors=INK, linewidths=0.35, rasterized=True, zorder=3)


def _draw_legend(axes: "Axes", *, unknown: bool) -> None:
    from matplotlib.lines import Line2D

    entries = [*zip(STATES[1:], STATE_COLOURS[1:], strict=True), *([("touching, not recorded", "none")] * unknown)]
    handles = [
        Line2D([], [], marker="o", linestyle="", mfc=colour, mec=INK, mew=0.4, ms=4.5, label=name)
        for name, colour in entries
    ]
    handles.insert(0, Line2D([], [], marker=".", linestyle="", color=FAINT, ms=4, label=STATES[0]))
    axes.legend(handles=handles, loc="upper left", handletextpad=0.1, borderaxespad=0.2)
