"""Pictures of a surface: its height map, its summits, and which of them stick or slip at a step of a history."""

from contextlib import suppress
from typing import TYPE_CHECKING, Any, Unpack

import attrs
import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.arguments import representable
from historysim.basics.array_types import Floats, Integers
from historysim.basics.units import prefixed, quantity_text
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.recording import surface_group
from historysim.results.analysis.recorded import shape_of
from historysim.results.analysis.shares import telling_step
from historysim.results.plots.paper import COLUMN, PAGE, Drawn, Page, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture, figure_of
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, STATES, by_factors
from historysim.surfaces.heights import Surface

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

States = npt.NDArray[np.int8]

MOST_MARKS = 20_000
"""Summits without contact that are marked; of more, so many drawn by lot."""
LONGEST = 4.0
"""Length over width of a surface up to which the axes around it are as long and wide as it is."""
SEPARATED, TOUCHING = 0, -1
NO_CONTACT = "#4aa8e0"
"""Summits without contact: a colour that neither grey heights nor the slip states have."""
MISSING = "#efdcc3"
DARKEST = 0.55
"""Darkest grey of heights under summits in contact."""
FLAT: dict[str, Any] = {"color": INK, "linewidth": 0.8, "linestyle": (0, (4, 2))}


@attrs.frozen(eq=False)
class ContactAtStep:
    """What a history says of the summits at one step.

    Attributes
    ----------
    state : array (summit)
        Slip state, or `TOUCHING` where the summit touches and was not recorded.
    height, radius : array (summit)
        Of the summits at the step, which wear and other events change [m].
    separation : float
        Height of the rigid flat [m].
    caption : str
        The step, its time and its loads.
    """

    state: States
    height: Floats
    radius: Floats
    separation: float
    caption: str


def surface_of(history: xr.Dataset) -> xr.Dataset:
    """Return the surface that a history was recorded of: from the file that it was opened from, else its summits alone.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    xarray.Dataset
        As `surface_group.dataset` gives it; with the labels of the asperities on ``summit``, where the history alone
        says what summits there are.

    Raises
    ------
    InputError
        A history of totals alone that was not opened from a file with its surface.
    """
    if source := history.encoding.get("source"):
        with suppress(OSError, KeyError):
            return xr.load_dataset(source, engine="netcdf4", group=surface_group.GROUP)
    if "summit_height" not in history:
        raise InputError("the history holds no asperities; expected one recorded with asperities, or its file")
    names = {"summit_height": "summit_height", "summit_radius": "summit_radius", "x": "summit_x", "y": "summit_y"}
    return xr.Dataset(
        {ours: ("summit", history[theirs].values) for theirs, ours in names.items() if theirs in history.coords},
        coords={"summit": history["asperity"].values},
    )


def plot_surface(
    surface: xr.Dataset | Surface,
    history: xr.Dataset | None = None,
    step: int | str = "partial",
    *,
    title: str = "",
    **place: Unpack[Place],
) -> Drawn:
    """Draw a surface with its summits, and the asperity distribution: radius against height.

    Parameters
    ----------
    surface : xarray.Dataset or Surface
        Summits, and a height map where there is one: the group ``surface`` of a result, `surface_of` a history, or a
        height map whose summits are to be found (9-point rule; of a profile, 3-point rule).
    history : xarray.Dataset, optional
        A history; the summits in contact are coloured by their slip state.
    step : int, "partial" or "peak"
        At this step of it; at that where the map shows most, half of the contact area slipping or nearest to it; or
        at that of the greatest normal load. Negative ones count from the end.
    title : str
        A heading; by default the title of the history, or else of the surface.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide. Without positions only the asperity distribution is drawn.

    Raises
    ------
    InputError
        A Dataset without summits, a history of other summits, or a step that it does not have.
    """
    if isinstance(surface, Surface):
        with representable():
            summits = surface.summits(3 if 1 in surface.shape else 9)
        surface = surface_group.dataset(summits, surface)
    check_summits(surface)
    contact = None if history is None else contact_at(surface, history, position_of(step, history))
    state = np.zeros(surface.sizes["summit"], dtype=np.int8) if contact is None else contact.state
    has_map = "height" in surface
    placed = {"summit_x", "summit_y"} <= set(surface.variables) and (has_map or state.size > 0)
    with paper(plot_surface, (PAGE, 97.0), place) as page:
        axes, beside = _axes(page, placed=placed, alone=surface.sizes["summit"] <= 1)
        if axes is not None:
            if has_map and 1 in surface["height"].shape:
                _draw_profile(axes, surface, state, contact)
            else:
                draw_map(axes, surface, state, pale=contact is not None)
        if beside is not None:
            draw_distribution(beside, surface, state, contact)
        elif surface.sizes["summit"] <= 1:
            page.foot(f"no asperity distribution: {counted(surface.sizes['summit'], 'summit', 'summits')}")
        page.legend(handles=legend_handles(surface, state, contact, flat=beside is not None))
        heading = title or str((surface if history is None else history).attrs.get("title", ""))
        page.heading(heading, contact.caption if contact else "")
    return page.drawn


def _axes(page: Page, *, placed: bool, alone: bool) -> "tuple[Axes | None, Axes | None]":
    """Return the axes of the map and of the distribution: both where they are known and fit, one at least."""
    if not placed:
        return None, page.axes()
    if alone or page.given is not None:
        # one summit has no distribution
        return page.axes(), None
    grid: Any
    if page.width >= 130.0:
        grid = page.figure.subplots(1, 2, width_ratios=(1.25, 1))
    elif page.height >= 110.0:
        grid = page.figure.subplots(2, 1, height_ratios=(1.6, 1))
    else:
        page.left_out("asperity distribution")
        return page.axes(), None
    return grid[0], grid[1]


def plot_distribution(
    surface: xr.Dataset, history: xr.Dataset | None = None, step: int | str = "partial", **place: Unpack[Place]
) -> Drawn:
    """Draw the asperity distribution: the radius of each summit against its height.

    Parameters
    ----------
    surface : xarray.Dataset
        Summits: the group ``surface`` of a result, or `surface_of` a history.
    history, step
        As for `plot_surface`: the summits in contact are coloured by their slip state, and the rigid flat is drawn.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide.

    Raises
    ------
    InputError
        As for `plot_surface`.
    """
    check_summits(surface)
    contact = None if history is None else contact_at(surface, history, position_of(step, history))
    state = np.zeros(surface.sizes["summit"], dtype=np.int8) if contact is None else contact.state
    with paper(plot_distribution, (COLUMN, 85.0), place) as page:
        draw_distribution(page.axes(), surface, state, contact)
        page.legend(handles=legend_handles(surface, state, contact))
        page.heading("", contact.caption if contact else "")
    return page.drawn


def position_of(step: int | str, history: xr.Dataset) -> int:
    """Return a step of a history as a number from 0."""
    steps = history.sizes["step"]
    if step == "partial" and "slip_state" in history:
        return telling_step(history)
    # of totals alone nothing is known of what slips
    if step in {"partial", "peak"}:
        return int(history["total_normal_load"].values.argmax())
    if not isinstance(step, int | np.integer) or not -steps <= step < steps:
        raise InputError(
            f"step {step}: the history has {steps} steps; expected {-steps} to {steps - 1}, partial or peak"
        )
    return int(step) % steps


def check_summits(surface: xr.Dataset) -> None:
    """Check that a surface holds summits."""
    if "summit_height" not in surface or "summit_radius" not in surface:
        raise InputError("the surface holds no summits; expected the group surface of a result")


def contact_at(surface: xr.Dataset, history: xr.Dataset, step: int) -> ContactAtStep:
    """Return what a history says of the summits of a surface at a step."""
    row = history.isel(step=step)
    count = int(row["contact_count"])
    state = np.full(surface.sizes["summit"], SEPARATED, dtype=np.int8)
    shape = {name: surface[name].values.copy() for name in ("summit_height", "summit_radius")}
    places = _places(surface, row) if "slip_state" in row else np.empty(0, dtype=np.int64)
    for name, values in shape.items():
        if places.size:
            values[places] = shape_of(history, name, step)
    # the highest ones; beside the separation, which is rounded, one might be taken for the wrong side
    state[np.argsort(-shape["summit_height"], kind="stable")[:count]] = TOUCHING
    if places.size:
        state[places] = row["slip_state"].values
    return ContactAtStep(
        state, shape["summit_height"], shape["summit_radius"], float(row["separation"]), caption_at(history, step)
    )


def caption_at(history: xr.Dataset, step: int) -> str:
    """Return the step, its time and its loads as a line."""
    row = history.isel(step=step)
    return (
        f"step {step:,}, t = {float(row['time']):.6g} s:  "
        f"N = {quantity_text(float(row['total_normal_load']), 'N')},  "
        f"T = {quantity_text(float(row['total_tangential_load']), 'N')},  "
        f"U = {quantity_text(float(row['tangential_displacement']), 'm')},  "
        f"{counted(int(row['contact_count']), 'asperity', 'asperities')} in contact"
    )


def _places(surface: xr.Dataset, row: xr.Dataset) -> Integers:
    """Return where the recorded asperities stand among the summits."""
    labels = surface.get("summit", np.arange(surface.sizes["summit"]))
    asperities = row["asperity"].values
    places = np.searchsorted(labels, asperities)
    if asperities.size and (
        places.max() >= labels.size
        or not np.array_equal(labels[places], asperities)
        or not np.array_equal(surface["summit_height"].values[places], row["summit_height"].values)
    ):
        raise InputError("the history is of other summits than the surface; expected the surface of its own file")
    return places


def draw_map(axes: "Axes", surface: xr.Dataset, state: States, *, pale: bool = True) -> None:
    """Draw heights and summits from above, those in contact in the colour of their state.

    Heights are pale where the colours of the states are to be told from them, in grey print, too.
    """
    x, y = (_ends(surface, axis) for axis in "xy")
    sides = (x[1] - x[0], y[1] - y[0])
    # a single summit has no sides, but a radius
    lone = max(sides) == 0
    factor, unit = _readable(surface["summit_radius"].values if lone else sides)
    if "height" in surface:
        extent = (x[0] * factor, x[1] * factor, y[0] * factor, y[1] * factor)
        _draw_heights(axes, surface, extent, greys=(DARKEST, 1.0) if pale else (0.0, 1.0))
    _draw_marks(axes, surface["summit_x"].values * factor, surface["summit_y"].values * factor, state)
    if lone:
        reach = float(surface["summit_radius"].values.max()) * factor
        axes.set(xlim=(x[0] * factor - reach, x[0] * factor + reach))
        axes.set(ylim=(y[0] * factor - reach, y[0] * factor + reach))
    # a long strip would leave no room for its labels
    axes.set_aspect("equal", adjustable="box" if max(sides) <= LONGEST * min(sides) else "datalim")
    axes.spines[["top", "right"]].set_visible(True)
    axes.set(title="Surface and summits", xlabel=f"$x$ ({unit})", ylabel=f"$y$ ({unit})")


def _ends(surface: xr.Dataset, axis: str) -> tuple[float, float]:
    """Return where the pixels of the map begin and end along an axis, or the summits where there is none."""
    if "height" in surface:
        points = surface[axis].values
        return float(1.5 * points[0] - 0.5 * points[1]), float(1.5 * points[-1] - 0.5 * points[-2])
    positions = surface[f"summit_{axis}"].values
    return float(positions.min()), float(positions.max())


def _draw_heights(
    axes: "Axes", surface: xr.Dataset, extent: tuple[float, float, float, float], *, greys: tuple[float, float]
) -> None:
    import matplotlib as mpl
    from matplotlib.colors import ListedColormap

    factor, unit = _readable(surface["height"].values)
    heights = surface["height"].values * factor
    known = heights[np.isfinite(heights)]
    # a few spikes would leave all else in one grey
    low, high = np.percentile(known, (0.5, 99.5)) if known.size else (0.0, 0.0)
    image = axes.imshow(
        heights.T,
        origin="lower",
        cmap=ListedColormap(mpl.colormaps["gray"](np.linspace(*greys, 256))).with_extremes(bad=MISSING),
        vmin=low if high > low else low - 1,
        vmax=high if high > low else low + 1,
        extent=extent,
        interpolation="nearest",
    )
    if high > low:
        left, right, bottom, top = extent
        height_over_width = (top - bottom) / (right - left)
        width = 0.045 * (height_over_width if 1 < height_over_width <= LONGEST else 1)
        below, above = known.min() < low, known.max() > high
        bar = axes.figure.colorbar(
            image,
            cax=axes.inset_axes((1.03, 0, width, 1)),
            extend="both" if below and above else "min" if below else "max" if above else "neither",
        )
        bar.set_label(f"height $z$ ({unit})")
        bar.outline.set_linewidth(0.4)


def _draw_profile(axes: "Axes", surface: xr.Dataset, state: States, contact: ContactAtStep | None) -> None:
    axis = "x" if surface.sizes["x"] > 1 else "y"
    points, heights = surface[axis].values, surface["height"].values.ravel()
    summits = surface["summit_height"].values if contact is None else contact.height
    along, unit = _readable(points)
    up, height_unit = _readable(heights, *([] if contact is None else [contact.separation]))
    axes.plot(points * along, heights * up, color=FAINT, linewidth=0.7, rasterized=True, zorder=1)
    _draw_marks(axes, surface[f"summit_{axis}"].values * along, summits * up, state)
    if contact is not None:
        axes.axhline(contact.separation * up, **FLAT)
    axes.margins(x=0.01)
    axes.set(title="Profile and summits", xlabel=f"${axis}$ ({unit})", ylabel=f"height $z$ ({height_unit})")


def draw_distribution(axes: "Axes", surface: xr.Dataset, state: States, contact: ContactAtStep | None) -> None:
    """Draw the radius of each summit against its height."""
    heights, radii = (surface["summit_height"].values, surface["summit_radius"].values)
    if contact is not None:
        heights, radii = contact.height, contact.radius
    along, height_unit = _readable(heights, *([] if contact is None else [contact.separation]))
    up, radius_unit = _readable(radii)
    _draw_marks(axes, heights * along, radii * up, state)
    if contact is not None:
        axes.axvline(contact.separation * along, **FLAT)
    if not radii.size:
        axes.text(0.5, 0.5, "no summits", transform=axes.transAxes, ha="center", color=FAINT)
    # radii of rough surfaces reach over decades
    elif radii.max() > 20 * radii.min():
        by_factors(axes.yaxis)
    elif np.ptp(radii) <= 1e-12 * radii.max():
        axes.set_ylim(0, 2 * radii.max() * up)
    axes.set(
        title="Asperity distribution",
        xlabel=f"summit height $z$ ({height_unit})",
        ylabel=f"summit radius $R$ ({radius_unit})",
    )


def _readable(*lengths: npt.ArrayLike) -> tuple[float, str]:
    """Return the factor and the unit in which these lengths can be read, whatever of them is missing."""
    known = [np.abs(values[np.isfinite(values)]).max(initial=0.0) for values in map(np.asarray, lengths)]
    factor, prefix = prefixed(float(max(known)))
    return factor, f"{prefix}m"


def _draw_marks(axes: "Axes", x: Floats, y: Floats, state: States) -> None:
    separated = np.flatnonzero(state == SEPARATED)
    if separated.size > MOST_MARKS:
        # by lot, since every so many-th one of a regular array would be another array
        separated = np.random.default_rng(0).choice(separated, MOST_MARKS, replace=False)
    size = float(np.clip(120 / np.sqrt(max(separated.size, 1)), 0.9, 7.0))
    axes.plot(x[separated], y[separated], ".", color=NO_CONTACT, ms=size, markeredgewidth=0, rasterized=True)
    area = 16 if np.count_nonzero(state != SEPARATED) <= 500 else 7
    for value, fill in (*enumerate(STATE_COLOURS), (TOUCHING, "none")):
        if value == SEPARATED:
            continue
        here = state == value
        axes.scatter(x[here], y[here], s=area, c=fill, edgecolors=INK, linewidths=0.35, rasterized=True, zorder=3)


def legend_handles(
    surface: xr.Dataset, state: States, contact: ContactAtStep | None, *, flat: bool = True
) -> "list[Artist]":
    """Return what a legend shows of marks; the rigid flat only where it is drawn."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = []
    count = np.count_nonzero(state == SEPARATED)
    if contact is not None or count > MOST_MARKS:
        name = "summit" if contact is None else STATES[SEPARATED]
        part = f" ({MOST_MARKS:,} of {count:,} drawn)" if count > MOST_MARKS else ""
        handles.append(Line2D([], [], marker=".", linestyle="", color=NO_CONTACT, ms=5, label=name + part))
    if contact is not None:
        entries = [*zip(STATES[1:], STATE_COLOURS[1:], strict=True)]
        entries += [("touching, not recorded", "none")] * bool((state == TOUCHING).any())
        handles += [
            Line2D([], [], marker="o", linestyle="", mfc=colour, mec=INK, mew=0.4, ms=4.5, label=name)
            for name, colour in entries
        ]
        if flat:
            handles.append(Line2D([], [], label="rigid flat", **FLAT))
    if "height" in surface and 1 not in surface["height"].shape and surface["height"].isnull().any():
        handles.append(Patch(facecolor=MISSING, label="missing height"))
    return handles


@PICTURES.register
@attrs.frozen(kw_only=True)
class DistributionPicture(Picture):
    """Radii of summits over their heights, coloured by their slip state.

    Attributes
    ----------
    step
        Number of a step, ``"partial"`` (about half of the contact area slips) or ``"peak"`` (greatest normal load).
    """

    step: int | str = "partial"

    kind = "distribution"

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        return plot_distribution(surface_of(what), what, self.step, **place)


@figure_of.register(Surface)
def _of_surface(what: Surface, *, title: str = "", place: Place, **_: Any) -> Drawn:
    return plot_surface(what, title=title, **place)
