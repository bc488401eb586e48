"""Pictures of the contact at a step: summits, or zones of a map with interacting asperities."""

from functools import partial

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import State
from historysim.basics.arguments import Floats
from historysim.basics.units import quantity_text
from historysim.replaying import Replay
from historysim.results.analysis.slips import representative_step, slipping_area
from historysim.results.plots.canvas import TWO_COLUMNS, Size
from historysim.results.plots.chart import Chart, Extent, Map, Sheet, state_keys
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import DIVERGING, STATE_COLOURS, Look
from historysim.results.plots.surfaces import (
    load_surface,
    read_contact,
    step_number,
    surface_sheet,
)
from historysim.results.recompute import (
    SLIPS,
    SOLVED,
    STICKS,
    compute_point_maps,
    map_sides,
    query_map_source,
)
from historysim.results.source import ReplaySource
from historysim.surfaces.heights import Surface

NO_CONTACT = "#d9d9d6"
ZONE_COLOURS = (STATE_COLOURS[1], STATE_COLOURS[3])
ZONE_KEYS = partial(state_keys, ZONE_COLOURS, ("sticks", "slips"))


@PICTURES.register
@attrs.frozen(kw_only=True)
class ContactMapPicture(Picture):
    """The contact at a step: the surface, and its summits in contact by their slip state.

    With ``interaction = "full"`` it shows the whole map, point by point, next to that of its
    independent summits.

    Attributes
    ----------
    step
        Number of a step, ``"partial"`` (slipping fraction of the area nearest to half) or
        ``"peak"`` (greatest normal load).
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
        description = (
            "no step shows partial slip; all of it slips" if share == 1 else "nothing of it slips"
        )
        return f"The contact at the step of the greatest normal load: {description}."

    @classmethod
    def is_reported(cls, history: xr.Dataset) -> bool:
        """Return whether a report shows it: a map of one point shows nothing."""
        return super().is_reported(history) and history.sizes["asperity"] != 1

    def default_size(self, data: xr.Dataset) -> Size:
        """Return the size of four maps, or of a map next to its distribution."""
        return TWO_COLUMNS, 163.0 if SOLVED in load_surface(data) else 97.0

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return the zones of a map that was solved as a whole, else the summits."""
        surface = load_surface(data)
        step = step_number(self.step, data)
        if SOLVED in surface:
            at = float(data["time"].values[step])
            return query_map_source(
                data, lambda origin: _solved_sheet(origin, origin.state(at), at)
            )
        return surface_sheet(surface, read_contact(surface, data, step))


def _zone(origin: ReplaySource, state: State) -> Floats:
    """Return the stick and slip zones, point by point; NaN out of contact."""
    states = compute_point_maps(origin, state).contact_state
    return np.where(states == 0, np.nan, states)


def _extent(origin: ReplaySource) -> Extent:
    x, y = map_sides(origin)
    return 0.0, x, 0.0, y


def _solved_sheet(origin: ReplaySource, state: State, at: float) -> Sheet:
    """Return the maps of a contact that was solved as a whole, and of its independent summits."""
    shape = origin.settings["surface_attributes"]["shape"]
    pixel = tuple(float(side / count) for side, count in zip(map_sides(origin), shape, strict=True))
    fields = compute_point_maps(origin, state)
    extent = _extent(origin)
    options: Look = {"share": "map", "x": "$x$ (m)", "y": "$y$ (m)", "height": 38.0}
    zones = {
        "whole map": _zone(origin, state),
        "independent summits": _independent(origin, at, shape, pixel),
    }
    charts = {
        letter: Chart(
            items=[zone_map(zone, extent)],
            title=f"{name}\n{zone_fractions(zone)}".replace(", ", ",\n"),
            name=name,
            keys=ZONE_KEYS(),
            **options,
        )
        for letter, (name, zone) in zip("WI", zones.items(), strict=True)
    }
    for letter, name, values in (
        ("P", "pressure", fields.pressure),
        ("T", "traction", fields.traction),
    ):
        field = _field(
            np.where(fields.pressure == 0, np.nan, values), extent, name, signed=name == "traction"
        )
        charts[letter] = Chart(items=[field], title=name.capitalize(), name=name, **options)
    loads = f"N = {quantity_text(state.normal_load, 'N')},  T = {quantity_text(state.tangential_load, 'N')}"
    caption = f"t = {at:.6g} s:  {loads},  U = {quantity_text(state.tangential_displacement, 'm')}"
    return Sheet(charts, wide="WI;PT", narrow="WI;PT", subtitle=caption)


def _independent(
    origin: ReplaySource, at: float, shape: tuple[int, int], pixel: tuple[float, ...]
) -> Floats:
    """Stick and slip of the summits of the map, each a circle, where they carry the same loads by themselves."""
    arrays = origin.surface
    zones = np.full(shape, np.nan)
    if arrays["height"].shape != tuple(shape):
        return zones
    periodic = bool(origin.settings["surface_attributes"]["periodic"])
    summits = Surface(arrays["height"], pixel, periodic=periodic).summits(9)
    ensemble = Ensemble.from_summits(
        origin.job.ensemble.pair, summits, float(origin.job.ensemble.friction[0])
    )
    job = Replay(ensemble, origin.job.events, saturate=True, record="all", hold=False)
    row = job.dataset(until=at).isel(step=-1)
    x, y = (np.arange(count) * size for count, size in zip(shape, pixel, strict=True))
    for index in np.flatnonzero(row["contact_radius"].values > 0):
        distances = [
            np.abs(distance - ensemble.coordinates[name][index])
            for name, distance in (("x", x), ("y", y))
        ]
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


def zone_map(zone: Floats, extent: Extent) -> Map:
    """Return the map of the stick and slip zones."""
    from matplotlib.colors import ListedColormap

    return Map(zone, extent, look={"cmap": ListedColormap(ZONE_COLOURS), "vmin": 0.5, "vmax": 2.5})


def zone_fractions(zone: Floats) -> str:
    """Return the fractions of the map that touch and stick as a string."""
    fractions = [float((zone == kind).mean()) for kind in (STICKS, SLIPS)]
    return f"{100 * sum(fractions):.3g} % touches, {100 * fractions[0]:.3g} % sticks"


def _field(values: Floats, extent: Extent, name: str, *, signed: bool) -> Map:
    """Return the map of a field: white at zero if it has a sign, grey out of contact."""
    import matplotlib as mpl

    largest = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    colours = mpl.colormaps[DIVERGING].with_extremes(bad=NO_CONTACT) if signed else "viridis"
    look = {"cmap": colours, "vmin": -largest if signed else 0.0, "vmax": largest}
    return Map(values, extent, f"{name} (Pa)", look)
