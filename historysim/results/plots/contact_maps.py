"""Pictures of the contact at a step: summits, or zones of a map with interacting asperities."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import State
from historysim.basics.arguments import Floats
from historysim.basics.units import quantity_text
from historysim.replaying import Replay
from historysim.results.analysis.slips import representative_step, slipping_area
from historysim.results.origin import Origin
from historysim.results.plots.canvas import TWO_COLUMNS, Canvas, Size
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import DIVERGING, INK, STATE_COLOURS, Extent, draw_image
from historysim.results.plots.surfaces import (
    draw_surface,
    load_surface,
    read_contact,
    step_number,
)
from historysim.results.rebuilt import SLIPS, SOLVED, STICKS, ask_map_origin, compute_point_maps, map_sides
from historysim.surfaces.heights import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NO_CONTACT = "#d9d9d6"
TWO_ROWS = 85.0  # height from which on there is room for two rows of maps [mm]
SMALL_TITLE: dict[str, Any] = {"fontsize": 7, "fontweight": "normal"}
FIELDS = ("whole map", "independent summits", "pressure", "traction")


@PICTURES.register
@attrs.frozen(kw_only=True)
class ContactMapPicture(Picture):
    """The contact at a step: the surface, and its summits in contact by their slip state.

    With ``interaction = "full"`` it is that of the whole map, point by point, beside that of its independent summits.

    Attributes
    ----------
    step
        Number of a step, ``"partial"`` (nearest to half of the area slips) or ``"peak"`` (greatest normal load).
    """

    step: int | str = "partial"

    kind, own_figure, headed = "contact-map", True, True
    caption = "The contact at the step where nearest to half of its area slips"
    order = 2

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
        """Return the caption with the share that slips there."""
        share = float(slipping_area(history)[representative_step(history)])
        if 0 < share < 1:
            return f"{cls.caption}: {100 * share:.0f} %."
        description = "no step shows partial slip; all of it slips" if share == 1 else "nothing of it slips"
        return f"The contact at the step of the greatest normal load: {description}."

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether a report shows it: a map of one point shows nothing."""
        return super().reported(history) and history.sizes["asperity"] != 1

    def default_size(self, data: xr.Dataset) -> Size:
        """Return the size of four maps, or of a map beside its distribution."""
        return TWO_COLUMNS, 163.0 if SOLVED in load_surface(data) else 97.0

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the zones of a map that was solved as a whole, else the summits."""
        surface, step = load_surface(data), step_number(self.step, data)
        if SOLVED in surface:
            at = float(data["time"].values[step])
            _draw_solved(canvas, *ask_map_origin(data, lambda origin: (origin, origin.state(at))), at)
            return
        draw_surface(canvas, surface, read_contact(surface, data, step))


def compute_zones(history: xr.Dataset, steps: Sequence[int]) -> tuple[list[Floats], Extent]:
    """Return maps of `STICKS`, `SLIPS` and NaN at steps, and their extent [m]; of a history from its file."""
    times = [float(history["time"].values[step]) for step in steps]
    return ask_map_origin(history, lambda origin: ([_zone(origin, origin.state(at)) for at in times], _extent(origin)))


def _zone(origin: Origin, state: State) -> Floats:
    """Return the stick and slip zones, point by point; NaN out of contact."""
    states = compute_point_maps(origin, state).contact_state
    return np.where(states == 0, np.nan, states)


def _extent(origin: Origin) -> Extent:
    x, y = map_sides(origin)
    return 0.0, x, 0.0, y


def _draw_solved(canvas: Canvas, origin: Origin, state: State, at: float) -> None:
    shape = origin.settings["surface_attributes"]["shape"]
    pixel = tuple(float(side / count) for side, count in zip(map_sides(origin), shape, strict=True))
    maps, extent = compute_point_maps(origin, state), _extent(origin)
    high = canvas.height >= max(TWO_ROWS, 0.75 * canvas.width) and canvas.most >= len(FIELDS)
    panels = canvas.fitting(FIELDS, len(FIELDS) if high else 2)
    grid = canvas.maps(len(panels), 2 if len(panels) == len(FIELDS) else 1)
    for axes, zone, name in zip(
        grid[0], (_zone(origin, state), _independent(origin, at, shape, pixel)), FIELDS, strict=False
    ):
        draw_zones(axes, zone, extent)
        axes.set_title(f"{name}\n{zone_shares(zone)}", **SMALL_TITLE)
    if len(panels) == len(FIELDS):
        pressure, traction = (np.where(maps.pressure == 0, np.nan, values) for values in (maps.pressure, maps.traction))
        _draw_field(grid[1, 0], pressure, extent, "pressure", signed=False)
        _draw_field(grid[1, 1], traction, extent, "traction", signed=True)
    loads = f"N = {quantity_text(state.normal_load, 'N')},  T = {quantity_text(state.tangential_load, 'N')}"
    canvas.caption = f"t = {at:.6g} s:  {loads},  U = {quantity_text(state.tangential_displacement, 'm')}"


def _independent(origin: Origin, at: float, shape: tuple[int, int], pixel: tuple[float, ...]) -> Floats:
    """Stick and slip of the summits of the map, each a circle, where they carry the same loads by themselves."""
    arrays, zones = origin.surface, np.full(shape, np.nan)
    if arrays["height"].shape != tuple(shape):
        return zones
    periodic = bool(origin.settings["surface_attributes"]["periodic"])
    summits = Surface(arrays["height"], pixel, periodic=periodic).summits(9)
    ensemble = Ensemble.from_summits(origin.job.ensemble.pair, summits, float(origin.job.ensemble.friction[0]))
    job = Replay(ensemble, origin.job.events, saturate=True, record="all", hold=False)
    row = job.dataset(until=at).isel(step=-1)
    x, y = (np.arange(count) * size for count, size in zip(shape, pixel, strict=True))
    for index in np.flatnonzero(row["contact_radius"].values > 0):
        distances = [np.abs(distance - ensemble.coordinates[name][index]) for name, distance in (("x", x), ("y", y))]
        if periodic:
            distances = [
                np.minimum(distance, side - distance)
                for distance, side in zip(distances, map_sides(origin), strict=True)
            ]
        far = np.hypot(distances[0][:, None], distances[1])
        # one smaller than a point is drawn as one
        zones[far <= max(float(row["contact_radius"][index]), 0.5 * max(pixel))] = SLIPS
        zones[far <= float(row["stick_radius"][index])] = STICKS
    return zones


def draw_zones(axes: "Axes", zone: Floats, extent: Extent) -> None:
    """Draw the stick and slip zones."""
    from matplotlib.colors import ListedColormap

    shades = (STATE_COLOURS[1], STATE_COLOURS[3])
    draw_image(axes, zone, extent, cmap=ListedColormap(shades), vmin=0.5, vmax=2.5)
    for colour, label in zip(shades, ("sticks", "slips"), strict=True):
        axes.scatter([], [], marker="s", color=colour, edgecolors=INK, linewidths=0.5, label=label)


def zone_shares(zone: Floats) -> str:
    """Return which shares of the map touch and stick, as a text."""
    shares = [float((zone == kind).mean()) for kind in (STICKS, SLIPS)]
    return f"{100 * sum(shares):.3g} % touches, {100 * shares[0]:.3g} % sticks"


def _draw_field(axes: "Axes", values: Floats, extent: Extent, name: str, *, signed: bool) -> None:
    """Draw a field point by point: white at zero if it has a sign, grey out of contact."""
    import matplotlib as mpl

    largest = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    colours = mpl.colormaps[DIVERGING].with_extremes(bad=NO_CONTACT) if signed else "viridis"
    low = -largest if signed else 0.0
    image = draw_image(axes, values, extent, cmap=colours, vmin=low, vmax=largest)
    axes.set_title(name, **SMALL_TITLE)
    axes.figure.colorbar(image, ax=axes, shrink=0.8, label=f"{name} (Pa)")
