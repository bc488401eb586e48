"""Radius over height of all summits of several surfaces, in one picture or side by side, with mean and deviation."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from historysim.basics.array_types import Floats
from historysim.basics.units import prefixed
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.results.plots.line_styles import LINES
from historysim.results.plots.paper import COLUMN, PAGE, Drawn, Page, Place, paper
from historysim.results.plots.style import INK
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import Summits

if TYPE_CHECKING:
    from matplotlib.axes import Axes


HIGHEST = 99.8
"""Percentile of the radii up to which the axis reaches: a few flat summits would leave all others at its foot."""


def plot_summit_scatter(
    summits: Sequence[Summits],
    labels: Sequence[str],
    *,
    apart: bool = False,
    title: str = "",
    **place: Unpack[Place],
) -> Drawn:
    """Draw the radius of each summit over its height, for several surfaces, with their means and deviations.

    Parameters
    ----------
    summits : sequence of Summits
        Up to 8.
    labels : sequence of str
        What the surfaces are called.
    apart : bool
        Side by side, with the same axes, in place of over one another.
    title : str, optional
        A heading.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 120 mm wide, 180 mm where they stand apart.

    Raises
    ------
    InputError
        No surfaces, too many, or another number of labels.
    """
    with paper(plot_summit_scatter, (PAGE if apart else 1.3 * COLUMN, 85.0), place) as page:
        draw_summit_scatter(page, summits, labels, apart=apart)
        page.heading(title)
    return page.drawn


def draw_summit_scatter(
    page: Page,
    summits: Sequence[Summits],
    labels: Sequence[str],
    *,
    apart: bool = False,
    title: str = "",
) -> None:
    """Draw summits on a page; parameters and errors as for `plot_summit_scatter`."""
    if not 1 <= len(summits) <= len(LINES) or len(labels) != len(summits):
        raise InputError(
            f"{counted(len(summits), 'surface', 'surfaces')} and {counted(len(labels), 'label', 'labels')}; expected 1 "
            f"to {len(LINES)} surfaces, with a label each"
        )
    up, radius_unit = prefixed(max(float(np.percentile(each.radius, HIGHEST)) for each in summits))
    along, height_unit = prefixed(max(float(np.abs(each.height).max()) for each in summits))
    grid: list[Axes]
    if apart and len(summits) > 1:
        across = min(len(summits), max(int(page.width / 28.0), 1))
        rows = -(-len(summits) // across)
        made: Any = page.several(len(summits)).subplots(rows, across, sharex=True, sharey=True, squeeze=False)
        grid = list(made.ravel()[: len(summits)])
        for empty in made.ravel()[len(summits) :]:
            empty.remove()
    else:
        grid = [page.axes()] * len(summits)
    most = max(each.height.size for each in summits)
    size = float(np.clip(120 / np.sqrt(most), 1.3, 5.0))
    for number, (each, label) in enumerate(zip(summits, labels, strict=True)):
        axes = grid[number]
        colour, _, _ = LINES[number]
        means = f"$R$ {_mean(each.radius, up)} {radius_unit}m, $z$ {_mean(each.height, along)} {height_unit}m"
        name = f"{label}: {means} ({len(each):,})"
        style: dict[str, Any] = {"marker": ".", "linestyle": "", "ms": size, "mew": 0, "rasterized": True}
        axes.plot(each.height * along, each.radius * up, color=colour, alpha=0.7, **style)
        centre = (each.height.mean() * along, each.radius.mean() * up)
        axes.errorbar(
            *centre,
            xerr=each.height.std(ddof=1) * along if len(each) > 1 else None,
            yerr=each.radius.std(ddof=1) * up if len(each) > 1 else None,
            color=colour,
            mec="white",
            marker="s",
            ms=4.5,
            mew=0.5,
            capsize=2,
            linewidth=0.8,
            label=name,
            zorder=4,
        )
        if apart:
            axes.set_title(label)
    top = max(float(np.percentile(each.radius, HIGHEST)) for each in summits) * up
    grid[0].set_ylim(0, 1.05 * top)
    grid[0].set_ylabel(f"summit radius $R$ ({radius_unit}m)")
    for axes in grid:
        spec = axes.get_subplotspec()
        if spec is None or spec.is_last_row():
            axes.set_xlabel(f"summit height $z$ ({height_unit}m)", color=INK)
    if title and not apart:
        grid[0].set_title(title)
    page.legend(*grid, extra="mean ± standard deviation (number of summits)")


def _mean(values: Floats, factor: float) -> str:
    deviation = f" ± {values.std(ddof=1) * factor:.2f}" if values.size > 1 else ""
    return f"{values.mean() * factor:.2f}{deviation}"


def draw_heights(page: Page, surface: Surface, title: str = "") -> None:
    """Draw a height map in colours, seen from above."""
    factor, prefix = prefixed(float(np.nanmax(np.abs(surface.heights))))
    along, unit = prefixed(max(surface.size))
    axes = page.axes()
    extent = (0.0, surface.size[0] * along, 0.0, surface.size[1] * along)
    image = axes.imshow(
        surface.heights.T * factor, origin="lower", extent=extent, cmap="viridis", interpolation="nearest"
    )
    # as high as the map, whatever room there is
    bar = axes.figure.colorbar(image, cax=axes.inset_axes((1.03, 0, 0.045, 1)))
    bar.set_label(f"height $z$ ({prefix}m)")
    bar.outline.set_linewidth(0.4)
    axes.spines[["top", "right"]].set_visible(True)
    axes.set(xlabel=f"$x$ ({unit}m)", ylabel=f"$y$ ({unit}m)")
    if title:
        axes.set_title(title)


def plot_heights(surface: Surface, *, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw a height map in colours, seen from above, without its summits.

    Parameters
    ----------
    surface : Surface
    title : str, optional
        A heading.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide.
    """
    with paper(plot_heights, (COLUMN, 78.0), place) as page:
        draw_heights(page, surface)
        page.heading(title)
    return page.drawn
