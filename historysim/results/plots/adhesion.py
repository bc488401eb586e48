"""Picture of the zones in which the theories of adhesion hold, with contacts in them."""

import itertools
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.adhering import AdheringAsperities
from historysim.contact.adhesion import DMT_BELOW, JKR_ABOVE, Regime, hertz_boundary, regime, rigid_boundary
from historysim.errors import InputError, LoadError
from historysim.results.plots.canvas import Canvas
from historysim.results.plots.pictures import PICTURES, SCENARIO, Panel
from historysim.results.plots.style import FAINT, INK, LINES, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# By label, the Maugis parameter λ and the load parameter N/(πWR) of contacts.
Contacts = Mapping[str, tuple[float, float]]

PARAMETERS = 1e-3, 1e2
LOADS = 1e-2, 1e4
FINE = 2_000

# Names of the zones, and where each stands.
NAMES = {
    Regime.HERTZ: ("Hertz", (0.01, 1e3)),
    Regime.DMT: ("DMT", (0.026, 15.0)),
    Regime.MAUGIS: ("Maugis", (0.7, 0.1)),
    Regime.JKR: ("JKR", (22.0, 0.06)),
    Regime.RIGID: ("rigid\n(Bradley)", (0.004, 0.06)),
}
FILLS = {
    Regime.HERTZ: "#ffffff",
    Regime.DMT: "#dde6ef",
    Regime.MAUGIS: "#eceee0",
    Regime.JKR: "#f5e3d5",
    Regime.RIGID: "#e6e6e6",
}


@PICTURES.register
@attrs.frozen(kw_only=True)
class AdhesionMapPicture(Panel):
    """The zones in which the theories of adhesion hold, after Johnson and Greenwood (1997), with contacts in them.

    In Python it is of a dict of contacts, too: by label, the Maugis parameter λ and the load parameter N/(πWR). The map
    grows to hold them. One that is unloaded or pulled has no place on a logarithmic axis: an arrow at the lower edge
    marks it, where the zones hardly change with the load.

    Attributes
    ----------
    labels
        What the contacts are called.

    Examples
    --------
    [[picture]]
    kind = "adhesion-map"
    """

    kind, of, size = "adhesion-map", (AdheringAsperities, SCENARIO), (130.0, 107.0)

    def draw(self, canvas: Canvas, data: AdheringAsperities | Contacts | None) -> None:
        """Draw zones with their names, and contacts, which are named below."""
        contacts = _checked(data.examples() if isinstance(data, AdheringAsperities) else data or {})
        contacts = dict(zip(self.called_as([*contacts], "contacts"), contacts.values(), strict=True))
        axes = canvas.axes()
        axes.set(
            xscale="log",
            yscale="log",
            xlim=_limits(PARAMETERS, (parameter for parameter, _ in contacts.values())),
            ylim=_limits(LOADS, (load for _, load in contacts.values() if load > 0)),
            title="" if canvas.beside_others else "Adhesion map",
            xlabel=r"Maugis parameter $\lambda$",
            ylabel=r"load parameter $N/(\pi W R)$",
        )
        axes.minorticks_off()
        axes.spines[["top", "right"]].set_visible(True)
        _draw_zones(axes)
        for name, (x, y) in NAMES.values():
            axes.text(x, y, name, ha="center", va="center", color=INK, fontsize=9, in_layout=False)
        for (label, (parameter, load)), (colour, _, marker) in zip(contacts.items(), itertools.cycle(LINES)):
            looks: dict[str, Any] = {"color": colour, "mec": "white", "mew": 0.6, "ms": 6, "linestyle": "none"}
            at, name = (load, plain(label)) if load > 0 else (axes.get_ylim()[0] * 1.12, f"{plain(label)} ($N$ ≤ 0)")
            looks |= {"marker": marker if load > 0 else "v", "clip_on": False, "zorder": 4}
            axes.plot(parameter, at, label=name, **looks)


def _checked(contacts: Contacts) -> dict[str, tuple[float, float]]:
    checked = {}
    for label, contact in contacts.items():
        try:
            parameter, load = map(float, contact)
        except (TypeError, ValueError):
            raise InputError(
                f"contact {label!r} is {contact!r}; expected its Maugis parameter and its load parameter, such as "
                "(0.5, 10.0)"
            ) from None
        try:
            regime(parameter, load)
        except (InputError, LoadError) as error:
            raise type(error)(f"contact {label!r}: {error}") from error
        checked[label] = parameter, load
    return checked


def _limits(usual: tuple[float, float], values: Iterable[float]) -> tuple[float, float]:
    low, high = usual
    for value in values:
        low, high = min(low, value / 3), max(high, value * 3)
    return low, high


def _draw_zones(axes: "Axes") -> None:
    left_edge, right_edge = axes.get_xlim()
    bottom, top = axes.get_ylim()
    x = np.union1d(np.geomspace(left_edge, right_edge, FINE), [DMT_BELOW, JKR_ABOVE])
    hertz, below_rigid = hertz_boundary(x), rigid_boundary(x)
    rigid = np.clip(below_rigid, bottom, hertz)
    dmt, jkr = x <= DMT_BELOW, x >= JKR_ABOVE
    zones: dict[Regime, tuple[Any, Any, Any]] = {
        Regime.HERTZ: (hertz, top, None),
        Regime.JKR: (bottom, hertz, jkr),
        Regime.MAUGIS: (bottom, hertz, (x >= DMT_BELOW) & (x <= JKR_ABOVE)),
        Regime.DMT: (rigid, hertz, dmt),
        Regime.RIGID: (bottom, rigid, dmt),
    }
    for zone, (lower, upper, where) in zones.items():
        axes.fill_between(x, lower, upper, where=where, color=FILLS[zone], linewidth=0, zorder=0, label=f"_{zone}")
    line: dict[str, Any] = {"color": FAINT, "linewidth": 0.8, "zorder": 1}
    axes.plot(x, hertz, **line)
    between = dmt & (below_rigid < hertz)
    # on a logarithmic axis the line ends at the lower edge of the picture, not above it
    visible = between & (np.maximum(below_rigid, np.roll(below_rigid, 1)) > bottom)
    axes.plot(x[visible], np.maximum(below_rigid, bottom)[visible], **line)
    for limit in (DMT_BELOW, JKR_ABOVE):
        axes.plot([limit, limit], [bottom, float(hertz_boundary(limit))], **line)
