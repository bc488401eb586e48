"""The contact of a rough map whose asperities press on one another, point by point, at one time of a log."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import EnsembleState
from historysim.basics.array_types import Floats
from historysim.basics.units import prefixed, quantity_text
from historysim.errors import InputError
from historysim.log.event_log import EventLog
from historysim.replaying import Replay
from historysim.results.origin import Origin
from historysim.results.plots.paper import PAGE, Drawn, Page, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import DIVERGING, INK, STATE_COLOURS
from historysim.results.plots.surface import plot_surface, position_of, surface_of
from historysim.results.point_maps import SLIPS, SOLVED, STICKS, answered, maps_of, sides_of
from historysim.surfaces.heights import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch


Extent = tuple[float, float, float, float]
NO_CONTACT = "#d9d9d6"


@attrs.frozen(eq=False)
class Zones:
    """Where a contact sticks and slips.

    Attributes
    ----------
    maps : list of arrays (x, y)
        At each step, `STICKS`, `SLIPS`, or NaN where nothing touches.
    extent : (float, float, float, float)
        Ends of the map in x and y.
    unit : str
        Of the extent.
    """

    maps: list[Floats]
    extent: Extent
    unit: str


def plot_contact_map(log: EventLog, at: float, *, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw the stick and slip zones, the pressures and the tractions of a contact, and what independent summits give.

    Parameters
    ----------
    log : EventLog
        Of a run with ``interaction = "full"``.
    at : float
        Time [s].
    title : str
        A heading; by default that of the log.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide: the contact of the whole map; that of the summits of the same map,
        each by itself (9-point rule), under the same events up to the same normal load; pressures; tractions.

    Raises
    ------
    InputError
        A log of another surface, or a time before the first event.
    """
    origin = Origin.of_log(log)
    if SOLVED not in origin.surface:
        raise InputError(f'{log.path}: has no contact maps; expected the log of a surface with interaction = "full"')
    with paper(plot_contact_map, DEFAULT, place) as page:
        _draw(page, origin, origin.state(at), at, title)
    return page.drawn


def plot_interacting(history: xr.Dataset, step: int | str = "partial", **place: Unpack[Place]) -> Drawn:
    """Draw what `plot_contact_map` does, at a step of a history that comes from the file of a result.

    Parameters
    ----------
    history : xarray.Dataset
        Of a run with ``interaction = "full"``.
    step, size
        As for `plot_surface`.

    Raises
    ------
    InputError
        A step that the history does not have, or one that does not come from a file with its events.
    """
    at = float(history["time"].values[position_of(step, history)])
    with paper(plot_interacting, DEFAULT, place) as page:
        _draw(page, *answered(history, lambda origin: (origin, origin.state(at))), at, "")
    return page.drawn


def zones_at(history: xr.Dataset, steps: Sequence[int]) -> Zones:
    """Return where the contact sticks and slips at steps; parameters and errors as for `plot_interacting`."""
    times = [float(history["time"].values[step]) for step in steps]
    return answered(
        history,
        lambda origin: Zones([_zone(origin, origin.state(at)) for at in times], *_extent(origin)),
    )


def _zone(origin: Origin, state: EnsembleState) -> Floats:
    """Return what sticks and what slips, point by point; NaN where nothing touches."""
    return _touching(maps_of(origin, state).contact_state.astype(np.float64))


def _touching(values: Floats) -> Floats:
    """Return values with NaN in place of 0."""
    return np.where(values == 0, np.nan, values)


def _extent(origin: Origin) -> tuple[Extent, str]:
    """Return the ends of the map in a readable unit, and that unit."""
    x, y = sides_of(origin)
    factor, prefix = prefixed(max(x, y))
    return (0.0, x * factor, 0.0, y * factor), f"{prefix}m"


DEFAULT = PAGE, 163.0
TWO_ROWS = 85.0
"""Height from which on there is room for two rows of maps [mm]."""


def _draw(page: Page, origin: Origin, state: EnsembleState, at: float, title: str) -> None:
    shape = origin.settings["surface_attributes"]["shape"]
    pixel = tuple(float(side / count) for side, count in zip(sides_of(origin), shape, strict=True))
    maps = maps_of(origin, state)
    nothing = maps.pressure == 0
    extent, unit = _extent(origin)
    rows = 2 if page.height >= max(TWO_ROWS, 0.6 * page.width) else 1
    axes: Any = page.several(4).subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    whole, independent = _touching(maps.contact_state.astype(np.float64)), _independent(origin, at, shape, pixel)
    for axis, zone, name in zip(axes[0], (whole, independent), ("whole map", "independent summits"), strict=True):
        draw_zones(axis, zone, extent)
        axis.set_title(f"{name}\n{zone_shares(zone)}")
    if rows == 2:
        _draw_field(axes[1, 0], _touching(maps.pressure), extent, "pressure", signed=False)
        _draw_field(axes[1, 1], np.where(nothing, np.nan, maps.traction), extent, "traction", signed=True)
    else:
        page.left_out("pressure", "traction")
    for axis in axes[-1]:
        axis.set_xlabel(f"$x$ ({unit})")
    for axis in axes[:, 0]:
        axis.set_ylabel(f"$y$ ({unit})")
    page.legend(handles=zone_handles())
    caption = (
        f"t = {at:.6g} s:  N = {quantity_text(state.normal_load, 'N')},  "
        f"T = {quantity_text(state.tangential_load, 'N')},  U = {quantity_text(state.tangential_displacement, 'm')}"
    )
    page.heading(title or str(origin.settings["title"]), caption)


def zone_handles() -> "list[Patch]":
    """Return what a legend shows of the colours of zones."""
    from matplotlib.patches import Patch

    states = zip((STATE_COLOURS[1], STATE_COLOURS[3]), ("sticks", "slips"), strict=True)
    return [Patch(facecolor=colour, edgecolor=INK, linewidth=0.4, label=label) for colour, label in states]


def _independent(origin: Origin, at: float, shape: tuple[int, int], pixel: tuple[float, ...]) -> Floats:
    """Stick and slip of the summits of the map, each a circle, where they carry the same loads by themselves."""
    arrays, found = origin.surface, np.full(shape, np.nan)
    if arrays["height"].shape != tuple(shape):
        return found
    periodic = bool(origin.settings["surface_attributes"]["periodic"])
    summits = Surface(arrays["height"], pixel, periodic=periodic).summits(9)
    ensemble = Ensemble.from_summits(origin.ensemble.pair, summits, float(origin.ensemble.friction[0]))
    job = Replay(ensemble, origin.events, saturate=True, record="all")
    row = job.dataset(until=at).isel(step=-1)
    x, y = (np.arange(count) * size for count, size in zip(shape, pixel, strict=True))
    for index in np.flatnonzero(row["contact_radius"].values > 0):
        beside = [np.abs(each - ensemble.coordinates[name][index]) for name, each in (("x", x), ("y", y))]
        if periodic:
            beside = [np.minimum(each, side - each) for each, side in zip(beside, sides_of(origin), strict=True)]
        far = np.hypot(beside[0][:, None], beside[1])
        # one smaller than a point is drawn as one
        found[far <= max(float(row["contact_radius"][index]), 0.5 * max(pixel))] = SLIPS
        found[far <= float(row["stick_radius"][index])] = STICKS
    return found


def draw_zones(axes: "Axes", zone: Floats, extent: Extent) -> None:
    """Draw what sticks and what slips."""
    from matplotlib.colors import ListedColormap

    colours = ListedColormap([STATE_COLOURS[1], STATE_COLOURS[3]])
    axes.imshow(zone.T, origin="lower", extent=extent, cmap=colours, vmin=0.5, vmax=2.5, interpolation="nearest")


def zone_shares(zone: Floats) -> str:
    """Return which shares of the map touch and stick, as a text."""
    shares = [float((zone == kind).mean()) for kind in (STICKS, SLIPS)]
    return f"{sum(shares):.2%} touches, {shares[0]:.2%} sticks"


def _draw_field(axes: "Axes", values: Floats, extent: Extent, name: str, *, signed: bool) -> None:
    """Draw a quantity point by point; of one with a sign zero is white, and what does not touch is grey."""
    import matplotlib as mpl

    largest = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    factor, prefix = prefixed(largest)
    image = axes.imshow(
        values.T * factor,
        origin="lower",
        extent=extent,
        cmap=mpl.colormaps[DIVERGING].with_extremes(bad=NO_CONTACT) if signed else "viridis",
        vmin=-largest * factor if signed else 0.0,
        vmax=largest * factor,
        interpolation="nearest",
    )
    if signed:
        # 0 is white, which nothing that touches should be taken for
        axes.set_facecolor("0.85")
    axes.set_title(name)
    axes.figure.colorbar(image, ax=axes, shrink=0.8, label=f"{name} ({prefix}Pa)")


@PICTURES.register
@attrs.frozen(kw_only=True)
class ContactMapPicture(Picture):
    """The contact at a step: the surface, and its summits in contact by their slip state.

    Attributes
    ----------
    step
        Number of a step, ``"partial"`` (about half of the contact area slips) or ``"peak"`` (greatest normal load).
    """

    step: int | str = "partial"

    kind = "contact-map"
    caption = "The contact where about half of its area slips."
    place = 2

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether a report shows it: a map of one point tells nothing."""
        return super().reported(history) and history.sizes["asperity"] != 1

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        surface = surface_of(what)
        # asperities that press on one another have no summits, but maps of their own
        if SOLVED in surface:
            return plot_interacting(what, self.step, **place)
        return plot_surface(surface, what, self.step, **place)
