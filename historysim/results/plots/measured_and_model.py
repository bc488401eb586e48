"""Picture of a model beside a measurement."""

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from historysim.basics.array_types import Integers
from historysim.basics.units import prefixed
from historysim.measured.comparison import Comparison
from historysim.measured.correction import contact_displacement
from historysim.results.plots.paper import PAGE, Drawn, Page, Place, paper
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, INK

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.gridspec import SubplotSpec


MOST_POINTS = 50_000
MEASURED, CORRECTED, MODEL = "#d1603d", "#e0b73c", "#12355b"


def plot_comparison(comparison: Comparison, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw loops and time series of measurement and model over each other, energies, and what is left of both.

    Parameters
    ----------
    comparison : Comparison
    title : str
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.
    """
    with paper(plot_comparison, (PAGE, 137.0), place) as page:
        panels: dict[str, Callable[[Axes, Comparison], None]] = {
            "friction loops": _draw_loops,
            "tangential load": _draw_loads,
            "energies": _draw_energies,
            "measured less model": _draw_difference,
            "residuals": _draw_left,
        }
        figure = page.several(len(panels))
        places = _places(page)
        for draw, spot in zip(panels.values(), places, strict=False):
            draw(figure.add_subplot(spot), comparison)
        page.left_out(*list(panels)[len(places) :])
        page.legend(figure.axes[0])
        page.heading(title)
    return page.drawn


def _places(page: Page) -> "list[SubplotSpec]":
    """Return where panels stand: two above three on a page, in a column as many as fit."""
    if page.width >= 140.0:
        rows = 2 if page.height >= 95.0 else 1
        grid = page.figure.add_gridspec(rows, 6, height_ratios=(1.25, 1)[:rows])
        return [grid[0, :3], grid[0, 3:], *([grid[1, :2], grid[1, 2:4], grid[1, 4:]] if rows == 2 else [])]
    if page.height >= 105.0:
        grid = page.figure.add_gridspec(3, 2, height_ratios=(2.2, 1.1, 1.1))
        return [grid[0, :], grid[1, :], grid[2, 0], grid[2, 1]]
    return [page.figure.add_gridspec(1, 1)[0, 0]]


def _thin(comparison: Comparison) -> Integers:
    """Return the samples to draw: all turning points, and of the rest no more than a page can show."""
    observation = comparison.observation
    stride = -(-observation.time.size // MOST_POINTS)
    return np.union1d(np.arange(0, observation.time.size, stride), observation.turns)


def _draw_loops(axes: "Axes", comparison: Comparison) -> None:
    observation, response = comparison.observation, comparison.response
    shown = _thin(comparison)
    factor, prefix = prefixed(float(np.abs(observation.displacement).max()))
    force, force_prefix = _force(comparison)
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    dots: dict[str, Any] = {
        "linestyle": "",
        "marker": ".",
        "ms": 2.4,
        "markeredgewidth": 0,
        "rasterized": True,
        "zorder": 2,
    }
    load, modelled = observation.tangential_load, response.tangential_load
    axes.plot(observation.displacement[shown] * factor, load[shown] * force, color=MEASURED, label="measured", **dots)
    # along a branch the model passes the displacements in their order, not in that of time
    order = np.concatenate(
        [
            start
            + np.argsort(
                response.displacement[start:end] * np.sign(response.displacement[end] - response.displacement[start])
            )
            for start, end in zip(observation.turns[:-1], observation.turns[1:], strict=True)
        ]
        + [observation.turns[-1:]]
    )
    # of a long record no more than a page can show, and all turning points
    order = order[np.union1d(np.arange(0, order.size, -(-order.size // MOST_POINTS)), observation.turns)]
    # over the points, among whose noise it would not be seen
    line: dict[str, Any] = {"color": MODEL, "linewidth": 0.8, "rasterized": True, "zorder": 3}
    axes.plot(response.displacement[order] * factor, modelled[order] * force, label="model", **line)
    if not comparison.instrument.rigid:
        stiffness = comparison.instrument.lateral_stiffness
        contact = contact_displacement(observation.displacement, load, stiffness).values
        dots["color"] = CORRECTED
        axes.plot(contact[shown] * factor, load[shown] * force, label="measured, of the contact", **dots)
        contact = contact_displacement(response.displacement, modelled, stiffness).values
        line["linestyle"] = (0, (4, 1.5))
        axes.plot(contact[order] * factor, modelled[order] * force, label="model, of the contact", **line)
    axes.margins(0.06)
    axes.set(
        title="Friction loops",
        xlabel=f"displacement ({prefix}m)",
        ylabel=f"tangential load $T$ ({force_prefix}N)",
    )


def _draw_loads(axes: "Axes", comparison: Comparison) -> None:
    observation = comparison.observation
    shown = _thin(comparison)
    force, prefix = _force(comparison)
    time = observation.time[shown]
    axes.plot(time, observation.tangential_load[shown] * force, color=MEASURED, linewidth=0.9, rasterized=True)
    axes.plot(time, comparison.response.tangential_load[shown] * force, color=MODEL, linewidth=0.6, rasterized=True)
    axes.margins(x=0.01)
    axes.set(title="Tangential load", ylabel=f"$T$ ({prefix}N)", xlabel="time (s)")


def _draw_difference(axes: "Axes", comparison: Comparison) -> None:
    observation, off = comparison.observation, comparison.difference
    factor, prefix = prefixed(float(np.abs(off).max(initial=0.0)))
    stride = -(-off.size // MOST_POINTS)
    axes.axhline(0, color=FAINT, linewidth=0.6)
    axes.plot(
        observation.time[observation.first :][::stride],
        off[::stride] * factor,
        ".",
        color=INK,
        markersize=1.2,
        markeredgewidth=0,
        rasterized=True,
    )
    axes.set(title="Measured less model", ylabel=f"$ΔT$ ({prefix}N)", xlabel="time (s)")


def _draw_left(axes: "Axes", comparison: Comparison) -> None:
    """Draw what is left over the branches, in the mean of those that rise, and of those that fall."""
    left = comparison.left
    factor, prefix = prefixed(float(np.nanmax(np.abs(left.mean), initial=0.0)))
    axes.axhline(0, color=FAINT, linewidth=0.6)
    for place, mean, colour, label in zip(
        left.place, left.mean, (INK, CORRECTED), ("forward", "backward"), strict=True
    ):
        axes.plot(100 * place, mean * factor, color=colour, linewidth=1.0)
        if np.isfinite(mean).any():
            at = int(np.nanargmax(np.abs(mean)))
            side = "top" if mean[at] < 0 else "bottom"
            axes.annotate(f" {label}", (100 * place[at], mean[at] * factor), color=colour, fontsize=7, va=side)
    axes.margins(y=0.12)
    axes.set(title="Residuals over the branch", ylabel=f"mean $ΔT$ ({prefix}N)", xlabel="way from reversal (%)")


def _draw_energies(axes: "Axes", comparison: Comparison) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set(title="Energies", xlabel="loop")
    if comparison.measured is None or comparison.model is None:
        axes.text(0.5, 0.5, "no whole loop", transform=axes.transAxes, ha="center", va="center", color=FAINT)
        axes.set(xticks=[], yticks=[])
        return
    energies = [loops.dissipated_energy for loops in (comparison.measured, comparison.model)]
    known = np.concatenate(energies)
    # a loop in which the normal load steps has no energy
    known = known[np.isfinite(known)] if np.isfinite(known).any() else np.zeros(1)
    factor, prefix = prefixed(float(np.abs(known).max()))
    for loops, energy, colour, marker, name in zip(
        (comparison.measured, comparison.model), energies, (MEASURED, MODEL), "ox", ("measured", "model"), strict=True
    ):
        axes.plot(loops.number + 1, energy * factor, marker, color=colour, markersize=4, mfc="none", label=name)
    # from zero, so that heights compare; a record whose signs are mixed up has energies below it
    lowest, highest = (factor * float(at(known)) for at in (np.min, np.max))
    axes.set_ylim(min(0.0, 1.15 * lowest), max(0.0, 1.15 * highest) or None)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel(f"$∮T\\,dU$ ({prefix}J)")
    axes.set_title("○ measured  × model", loc="right", color=FAINT, fontsize=7, fontweight="normal")


def _force(comparison: Comparison) -> tuple[float, str]:
    largest = max(
        float(np.abs(load).max())
        for load in (comparison.observation.tangential_load, comparison.response.tangential_load)
    )
    return prefixed(largest)


@figure_of.register(Comparison)
def _of_comparison(what: Comparison, *, place: Place, **_: Any) -> Drawn:
    return plot_comparison(what, **place)
