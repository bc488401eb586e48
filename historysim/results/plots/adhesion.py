"""Picture of the zones in which the theories of adhesion hold, with contacts in them."""

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

import attrs
import numpy as np

from historysim.asperities.adhering import AdheringAsperities
from historysim.contact.adhesion import (
    DMT_BELOW,
    JKR_ABOVE,
    Regime,
    hertz_boundary,
    regime,
    rigid_boundary,
)
from historysim.errors import InputError, LoadError
from historysim.results.plots.chart import Chart, Curve, Item, Note, Shape
from historysim.results.plots.pictures import PICTURES, SCENARIO, Panel
from historysim.results.plots.style import FAINT, INK, LINES, Look, escape_math

# By label, the Maugis parameter λ and the load parameter N/(πWR) of contacts.
Contacts = Mapping[str, tuple[float, float]]

PARAMETERS = 1e-3, 1e2
LOADS = 1e-2, 1e4
FINE = 2_000

# Names of the zones and their positions.
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

    Python also accepts a dict of contacts: by label, the Maugis parameter λ and the load parameter
    N/(πWR). The map grows to include them. An unloaded or pulled contact has no position on a
    logarithmic axis: a mark at the lower edge shows it, where the zones hardly change with the
    load.

    Attributes
    ----------
    labels
        Names of the contacts.

    Examples
    --------
    [[picture]]
    kind = "adhesion-map"
    """

    kind, of, size = "adhesion-map", (AdheringAsperities, SCENARIO), (130.0, 107.0)

    def sheet(self, data: AdheringAsperities | Contacts | None) -> Chart:
        """Return the zones with their names, and contacts, which the legend names."""
        contacts = _check_contacts(
            data.examples() if isinstance(data, AdheringAsperities) else data or {}
        )
        contacts = dict(
            zip(self.resolve_labels([*contacts], "contacts"), contacts.values(), strict=True)
        )
        xlim = _limits(PARAMETERS, (parameter for parameter, _ in contacts.values()))
        ylim = _limits(LOADS, (load for _, load in contacts.values() if load > 0))
        items = _zones(*xlim, *ylim)
        for name, position in NAMES.values():
            items.append(
                Note(name, position, (0, 0), {"fontsize": 9, "color": INK, "in_layout": False})
            )
        for (label, (parameter, load)), (colour, _, marker) in zip(
            contacts.items(), itertools.cycle(LINES)
        ):
            look = {
                "color": colour,
                "mec": "white",
                "mew": 0.6,
                "ms": 6,
                "linestyle": "none",
                "zorder": 4,
            }
            at, name = (
                (load, escape_math(label))
                if load > 0
                else (ylim[0] * 1.12, f"{escape_math(label)} ($N$ ≤ 0)")
            )
            look |= {"marker": marker if load > 0 else "v", "clip_on": False}
            items.append(Curve([parameter], [at], name, look))
        axes = {"xscale": "log", "yscale": "log", "xlim": xlim, "ylim": ylim}
        labels: Look = {
            "x": r"Maugis parameter $\lambda$",
            "y": r"load parameter $N/(\pi W R)$",
        }
        return Chart(items=items, **labels, title="Adhesion map", axes=axes)


def _check_contacts(contacts: Contacts) -> dict[str, tuple[float, float]]:
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
        low = min(low, value / 3)
        high = max(high, value * 3)
    return low, high


def _zones(left: float, right: float, bottom: float, top: float) -> list[Item]:
    """Return the zones of the theories and the lines between them."""
    x = np.union1d(np.geomspace(left, right, FINE), [DMT_BELOW, JKR_ABOVE])
    hertz = hertz_boundary(x)
    below_rigid = rigid_boundary(x)
    rigid = np.clip(below_rigid, bottom, hertz)
    dmt = x <= DMT_BELOW
    jkr = x >= JKR_ABOVE
    zones: dict[Regime, tuple[Any, Any, Any]] = {
        Regime.HERTZ: (hertz, top, None),
        Regime.JKR: (bottom, hertz, jkr),
        Regime.MAUGIS: (bottom, hertz, (x >= DMT_BELOW) & (x <= JKR_ABOVE)),
        Regime.DMT: (rigid, hertz, dmt),
        Regime.RIGID: (bottom, rigid, dmt),
    }
    items: list[Item] = []
    for zone, (lower, upper, where) in zones.items():
        fill = {
            "where": where,
            "color": FILLS[zone],
            "linewidth": 0,
            "zorder": 0,
            "label": f"_{zone}",
        }
        items.append(Shape("fill_between", (x, lower, upper), fill))
    line: Look = {"color": FAINT, "linewidth": 0.8, "zorder": 1}
    between = dmt & (below_rigid < hertz)
    # on a logarithmic axis the line ends at the lower edge of the picture, not above it
    visible = between & (np.maximum(below_rigid, np.roll(below_rigid, 1)) > bottom)
    items += [
        Curve(x, hertz, "", line),
        Curve(x[visible], np.maximum(below_rigid, bottom)[visible], "", line),
    ]
    for limit in (DMT_BELOW, JKR_ABOVE):
        items.append(Curve([limit, limit], [bottom, float(hertz_boundary(limit))], "", line))
    return items
