"""The pictures of a history by their names."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import xarray as xr

from historysim.errors import InputError
from historysim.results.plots.contact_map import plot_interacting
from historysim.results.plots.load_history import plot_history
from historysim.results.plots.loop import plot_loop
from historysim.results.plots.paper import Size
from historysim.results.plots.slip_map import plot_slip_map
from historysim.results.plots.stiffness_curve import plot_stiffness
from historysim.results.plots.surface import plot_distribution, plot_surface, surface_of
from historysim.results.plots.together import LoopMarks, plot_together
from historysim.results.plots.traction_profile import plot_slip_fronts, plot_traction
from historysim.results.plots.worn_summits import plot_wear
from historysim.results.point_maps import SOLVED

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _contact_map(history: xr.Dataset, **options: Any) -> "Figure":
    surface = surface_of(history)
    # asperities that press on one another have no summits, but maps of their own
    return plot_interacting(history, **options) if SOLVED in surface else plot_surface(surface, history, **options)


def _distribution(history: xr.Dataset, **options: Any) -> "Figure":
    return plot_distribution(surface_of(history), history, **options)


def _loops(history: xr.Dataset, *, steps: Sequence[int | str] | None = None, **options: Any) -> "Figure":
    return plot_together(history, marks=LoopMarks(steps=steps), **options)


@attrs.frozen
class _Picture:
    """A picture, and which options it takes beside its size."""

    draw: Callable[..., "Figure"]
    takes: tuple[str, ...] = ()


PICTURES = {
    "history": _Picture(plot_history, ("panels",)),
    "loop": _Picture(plot_loop),
    "loops": _Picture(_loops, ("steps", "labels")),
    "slip-map": _Picture(plot_slip_map),
    "contact-map": _Picture(_contact_map, ("step",)),
    "distribution": _Picture(_distribution, ("step",)),
    "traction": _Picture(plot_traction, ("asperity", "steps", "across", "labels")),
    "slip-fronts": _Picture(plot_slip_fronts, ("asperity", "steps")),
    "stiffness": _Picture(plot_stiffness),
    "wear": _Picture(plot_wear),
}


def draw(
    history: xr.Dataset,
    picture: str = "history",
    *,
    step: int | str | None = None,
    asperity: int | None = None,
    panels: Sequence[str] | None = None,
    steps: Sequence[int | str] | None = None,
    across: str | None = None,
    labels: Sequence[str] | None = None,
    size: Size | None = None,
) -> "Figure":
    """Return a picture of a history by its name.

    Parameters
    ----------
    history : xarray.Dataset
    picture : str
        A key of `PICTURES`.
    step, asperity, panels, steps, across, labels
        For the pictures that take them.
    size : (float, float), optional
        Width and height [mm].

    Raises
    ------
    InputError
        Another name, an option that the picture does not take, or as for its function.
    """
    if picture not in PICTURES:
        raise InputError(f"picture is {picture!r}; expected one of {', '.join(PICTURES)}")
    chosen = PICTURES[picture]
    options = {"step": step, "asperity": asperity, "panels": panels, "steps": steps, "across": across, "labels": labels}
    given = {name: value for name, value in options.items() if value is not None}
    for name, value in given.items():
        if name not in chosen.takes:
            others = ", ".join(known for known, each in PICTURES.items() if name in each.takes)
            raise InputError(f"{name} {value}: the picture {picture} takes none; expected with {others}")
    return chosen.draw(history, **given, size=size)


SEVERAL = ("loops", "traction")
"""Pictures that several histories can be in."""


def draw_several(
    histories: Sequence[xr.Dataset],
    picture: str | None = None,
    *,
    asperity: int | None = None,
    steps: Sequence[int | str] | None = None,
    across: str | None = None,
    labels: Sequence[str] = (),
    size: Size | None = None,
) -> "Figure":
    """Return one picture of several histories: their loops, or the tractions of an asperity of each.

    Raises
    ------
    InputError
        Another picture, an option that it does not take, or as for its function.
    """
    if (picture or SEVERAL[0]) == SEVERAL[0]:
        if across is not None or asperity is not None:
            raise InputError(f"{'asperity' if across is None else 'across'}: belongs to the picture traction")
        return plot_together(histories, labels, marks=LoopMarks(steps=steps), size=size)
    if picture != SEVERAL[1]:
        raise InputError(f"picture is {picture!r}; of several results expected one of {', '.join(SEVERAL)}")
    return plot_traction(histories, asperity, steps, across=across or "radius", labels=labels, size=size)
