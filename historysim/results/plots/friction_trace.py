"""Picture of friction over time or distance: samples, windows, the static peak, and the approach to a steady value."""

from typing import Any, Unpack

import numpy as np

from historysim.basics.units import prefixed
from historysim.measured.sliding import UNITS, Sliding
from historysim.results.plots.paper import PAGE, Drawn, Place, paper
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS

MOST_POINTS = 20_000


def plot_sliding(sliding: Sliding, *, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw the friction coefficient over time or distance.

    Parameters
    ----------
    sliding : Sliding
        From `historysim.sliding`.
    title : str
        A heading.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.
    """
    with paper(plot_sliding, (PAGE, 92.0), place) as page:
        axes = page.axes()
        factor, prefix = prefixed(float(np.abs(sliding.place).max())) if sliding.over == "distance" else (1.0, "")
        stride = -(-sliding.place.size // MOST_POINTS)
        dots: dict[str, Any] = {"linestyle": "", "marker": ".", "ms": 2.2, "mew": 0, "color": FAINT, "alpha": 0.6}
        at, friction = sliding.place[::stride] * factor, sliding.coefficient[::stride]
        if np.isfinite(friction).any():
            axes.plot(at, friction, rasterized=True, label="samples", zorder=1, **dots)
        means = sliding.window_place * factor, sliding.window_mean
        axes.plot(*means, "o", color=STATE_COLOURS[1], ms=3, label="windows", zorder=2)
        if sliding.approach is not None:
            way = np.linspace(sliding.approach.origin, sliding.place[-1], 200)
            line: dict[str, Any] = {"color": STATE_COLOURS[2], "linewidth": 1.2, "zorder": 3}
            axes.plot(way * factor, sliding.approach.at(way), label="approach", **line)
            axes.axhline(
                sliding.approach.steady, color=STATE_COLOURS[2], linewidth=0.7, linestyle=(0, (4, 2)), zorder=0
            )
        if sliding.peak is not None:
            peak = sliding.peak.place * factor, sliding.peak.coefficient
            axes.plot(*peak, "^", color=INK, ms=5, label="static peak", zorder=4)
        axes.set(
            title="Friction coefficient", xlabel=f"{sliding.over} ({prefix}{UNITS[sliding.over]})", ylabel="$μ = T/N$"
        )
        page.legend(axes)
        page.heading(title)
    return page.drawn


@figure_of.register(Sliding)
def _of_sliding(what: Sliding, *, place: Place, **_: Any) -> Drawn:
    return plot_sliding(what, **place)
