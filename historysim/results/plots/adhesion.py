"""Pictures of adhesion: the zones in which its theories hold, with contacts in them, and equilibria of one contact."""

import itertools
import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.adhering import AdheringAsperities
from historysim.basics.units import prefixed
from historysim.contact.adhesion import DMT_BELOW, JKR_ABOVE, Branch, Regime, hertz_boundary, regime, rigid_boundary
from historysim.errors import InputError, LoadError
from historysim.results.plots.canvas import Canvas, beside_title
from historysim.results.plots.pictures import PICTURES, SCENARIO, Picture
from historysim.results.plots.style import FAINT, INK, MARK, plain, zero_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import BboxBase

Contacts = Mapping[str, tuple[float, float]]
"""By label, the Maugis parameter λ and the load parameter N/(πWR) of contacts."""

PARAMETERS = 1e-3, 1e2
LOADS = 1e-2, 1e4
FINE, COARSE = 2_000, 60
DISTANCES = 6, 14, 24, 36, 50, 66

NAMES = {
    Regime.HERTZ: "Hertz",
    Regime.DMT: "DMT",
    Regime.MAUGIS: "Maugis",
    Regime.JKR: "JKR",
    Regime.RIGID: "rigid\n(Bradley)",
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
class AdhesionMapPicture(Picture):
    """The zones in which the theories of adhesion hold, after Johnson and Greenwood (1997), with contacts in them.

    In Python it is of a dict of contacts, too: by label, the Maugis parameter λ and the load parameter N/(πWR). The map
    grows to hold them. One that is unloaded or pulled has no place on a logarithmic axis: an arrow at the lower edge
    marks it, where the zones hardly change with the load.
    """

    kind, of, size, alone = "adhesion-map", (AdheringAsperities, SCENARIO), (130.0, 107.0), True

    def draw(self, canvas: Canvas, data: AdheringAsperities | Contacts | None) -> None:
        """Draw zones, contacts, and names where there is room for them."""
        marked = _checked(data.examples() if isinstance(data, AdheringAsperities) else data or {})
        axes = canvas.axes()
        axes.set(
            xscale="log",
            yscale="log",
            xlim=_limits(PARAMETERS, (parameter for parameter, _ in marked.values())),
            ylim=_limits(LOADS, (load for _, load in marked.values() if load > 0)),
            title="Adhesion map",
            xlabel=r"Maugis parameter $\lambda$",
            ylabel=r"load parameter $N/(\pi W R)$",
        )
        axes.minorticks_off()
        axes.spines[["top", "right"]].set_visible(True)
        _draw_zones(axes)
        # the layout must be settled before labels can be kept apart
        canvas.settle()
        taken = _draw_marks(axes, marked)
        taken += _label_marks(axes, marked, taken)
        _name_zones(axes, taken)


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
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    x = np.union1d(np.geomspace(left, right, FINE), [DMT_BELOW, JKR_ABOVE])
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
        axes.fill_between(x, lower, upper, where=where, color=FILLS[zone], linewidth=0, zorder=0, label=zone)
    line: dict[str, Any] = {"color": FAINT, "linewidth": 0.8, "zorder": 1}
    axes.plot(x, hertz, **line)
    between = dmt & (below_rigid < hertz)
    # on a logarithmic axis the line must leave the picture through its lower edge, not end above it
    axes.plot(x[between], np.maximum(below_rigid, bottom / 10)[between], **line)
    for limit in (DMT_BELOW, JKR_ABOVE):
        axes.plot([limit, limit], [bottom, float(hertz_boundary(limit))], **line)


def _draw_marks(axes: "Axes", contacts: Contacts) -> "list[BboxBase]":
    """Mark the contacts, and return the room that the marks take."""
    from matplotlib.transforms import Bbox

    half = 4 * axes.figure.dpi / 72
    rooms: list[BboxBase] = []
    for contact in contacts.values():
        x, y = _place(axes, contact)
        marker = "o" if contact[1] > 0 else "v"
        axes.plot(x, y, marker, color=MARK, mec="white", mew=0.6, ms=5.5, zorder=4, clip_on=False)
        at = axes.transData.transform((x, y))
        rooms.append(Bbox([at - half, at + half]))
    if any(load <= 0 for _, load in contacts.values()):
        beside_title(axes, "▼ unloaded or pulled")
    return rooms


def _place(axes: "Axes", contact: tuple[float, float]) -> tuple[float, float]:
    parameter, load = contact
    return parameter, load if load > 0 else axes.get_ylim()[0] * 1.12


def _label_marks(axes: "Axes", contacts: Contacts, marks: "list[BboxBase]") -> "list[BboxBase]":
    """Label each contact beside its mark, off marks and lines, and return the room that labels and leaders take."""
    from matplotlib.path import Path

    frame, points = axes.get_window_extent(), axes.figure.dpi / 72
    lines = [line.get_path().transformed(axes.transData) for line in axes.get_lines() if line.get_zorder() < 2]
    labels: list[BboxBase] = []
    leaders: list[Path] = []
    for label, contact in contacts.items():
        place: dict[str, Any] = {"xy": _place(axes, contact), "textcoords": "offset points", "annotation_clip": False}
        mark = axes.transData.transform(place["xy"])
        text = axes.annotate(plain(label), xytext=(0, 0), **place, color=INK, fontsize=7.5, zorder=5)
        text.set_in_layout(False)

        def leader(text: Any = text, mark: Any = mark) -> Path:
            return Path([mark, mark + points * np.array(text.xyann)])

        def cost(offset: tuple[float, float], text: Any = text, leader: Any = leader) -> float:
            text.set(**_beside(*offset))
            room = text.get_window_extent().padded(2)
            beyond = not all(frame.contains(*corner) for corner in room.corners())
            crossed = any(line.intersects_bbox(room, filled=False) for line in [*lines, *leaders])
            crossed |= any(leader().intersects_bbox(other, filled=False) for other in labels)
            return offset[0] + 1e2 * crossed + 1e3 * (int(room.count_overlaps([*marks, *labels])) + beyond)

        best = min(itertools.product(DISTANCES, np.arange(0, 2 * np.pi, np.pi / 8)), key=cost)
        cost(best)
        labels.append(text.get_window_extent())
        if best[0] > DISTANCES[0]:
            leaders.append(leader())
            stroke = {"arrowstyle": "-", "color": INK, "linewidth": 0.4, "shrinkA": 0, "shrinkB": 3}
            axes.annotate("", xytext=text.xyann, **place, arrowprops=stroke).set_in_layout(False)
    return [*labels, *(path.get_extents() for path in leaders)]


def _name_zones(axes: "Axes", taken: "list[BboxBase]") -> None:
    """Name each zone as near its middle as the name fits beside marks and labels."""
    (left, right), (bottom, top) = np.log(axes.get_xlim()), np.log(axes.get_ylim())
    start, span = np.array([left, bottom]), np.array([right - left, top - bottom])
    x, y = np.exp(np.linspace(left, right, COARSE)), np.exp(np.linspace(bottom, top, COARSE))
    zones = np.asarray(regime(x[:, None], y))
    for zone, name in NAMES.items():
        text = axes.text(1, 1, name, ha="center", va="center", color=INK, fontsize=9, zorder=3, in_layout=False)

        def fits(at: npt.NDArray[np.intp], text: Any = text, zone: Regime = zone) -> bool:
            text.set_position((x[at[0]], y[at[1]]))
            room = text.get_window_extent().padded(4)
            corners = np.log(axes.transData.inverted().transform(room.corners()))
            nearest = np.rint((corners - start) / span * (COARSE - 1)).astype(int)
            if nearest.min() < 0 or nearest.max() >= COARSE:
                return False
            return bool(np.all(zones[*nearest.T] == zone)) and room.count_overlaps(taken) == 0

        inside = np.argwhere(zones == zone)
        by_distance = inside[np.argsort(np.hypot(*(inside - inside.mean(axis=0)).T), kind="stable")]
        fits(next(filter(fits, by_distance), by_distance[0]))


def _beside(distance: float, angle: float) -> dict[str, Any]:
    """Return where a label stands that many points off its mark, and by which side or corner."""
    x, y = distance * math.cos(angle), distance * math.sin(angle)
    side = "center" if abs(x) < distance / 2 else "left" if x > 0 else "right"
    edge = "center" if abs(y) < distance / 2 else "bottom" if y > 0 else "top"
    return {"x": x, "y": y, "ha": side, "va": edge}


@PICTURES.register
@attrs.frozen(kw_only=True)
class AdhesionBranchPicture(Picture):
    """The load of an adhesive contact over its approach: what is stable, and where it jumps.

    Attributes
    ----------
    title
        A heading; by default the theory.
    """

    title: str = ""

    kind, of, size, alone = "adhesion-branch", (Branch,), (130.0, 102.0), True

    def draw(self, canvas: Canvas, data: Branch) -> None:
        """Draw the equilibria."""
        length, length_prefix = prefixed(float(np.abs(data.approach).max()))
        force, force_prefix = prefixed(float(np.abs(data.normal_load).max()))
        axes = canvas.axes()
        zero_lines(axes)
        for name, part, line in _parts(data):
            axes.plot(data.approach[part] * length, data.normal_load[part] * force, label=name, **line)
        for name, point, mark in _jumps(data):
            x, y = point.approach * length, point.normal_load * force
            load = f", −{-y:.3g} {force_prefix}N" if y < 0 else ""
            axes.plot(x, y, label=name + load, color=MARK, ls="none", zorder=3, clip_on=False, **mark)
        axes.margins(0.06)
        axes.set(
            title=plain(self.title or f"Equilibria after {data.model.label}"),
            xlabel=rf"approach $\delta$ ({length_prefix}m)",
            ylabel=f"normal load $N$ ({force_prefix}N)",
        )
        canvas.legend(axes)


def _parts(branch: Branch) -> "list[tuple[str, npt.NDArray[np.intp], dict[str, Any]]]":
    """Return what to call, which points to draw and how, for each part of the curve that is there."""
    size = branch.normal_load.size
    stable, held = (size - int(mask.sum()) for mask in (branch.stable_under_load, branch.stable_under_displacement))
    # neighbours share a point, so that the curve does not tear
    parts = [
        ("stable", np.arange(max(stable, held), size), {"color": INK, "linewidth": 1.2}),
        (
            "stable under displacement only",
            np.arange(held, stable + 1),
            {"color": INK, "linewidth": 1.0, "linestyle": (0, (4, 2))},
        ),
        (
            "unstable",
            np.arange(min(stable, held) + 1),
            {"color": FAINT, "linewidth": 1.0, "linestyle": (0, (1.2, 1.5))},
        ),
    ]
    return [part for part in parts if part[1].size > 1]


def _jumps(branch: Branch) -> "list[tuple[str, Any, dict[str, Any]]]":
    """Return what to call, where to draw and how, for each point at which the contact jumps."""
    load, displacement = branch.pull_off_under_load, branch.pull_off_under_displacement
    if load == branch.jump_in:
        return []
    pull_off = (
        [("pull-off", load, {"marker": "o", "ms": 5})]
        if load == displacement
        else [
            ("pull-off under load", load, {"marker": "o", "ms": 5}),
            ("pull-off under displacement", displacement, {"marker": "s", "ms": 4.5}),
        ]
    )
    # a ring, since a pull-off may lie right beside it
    return [*pull_off, ("jump-in", branch.jump_in, {"marker": "o", "ms": 9, "mfc": "none"})]
