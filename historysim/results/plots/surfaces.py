"""Pictures of a surface: its height map, its summits, and which of them stick or slip at a step of a history."""

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.arguments import Floats, Integers, representable
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.recording import surface_group
from historysim.results.analysis.recorded import position_of, shape_of
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, Canvas, Size
from historysim.results.plots.pictures import PICTURES, SCENARIO, Panel, Picture, Titled
from historysim.results.plots.style import (
    FAINT,
    INK,
    LINES,
    STATE_COLOURS,
    STATES,
    Extent,
    by_factors,
    draw_image,
    patches,
    scale_of,
)
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import Summits

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

MOST_MARKS = 20_000  # summits without contact that are marked; of more, so many taken by lot
LONGEST = 4.0  # length over width of a surface up to which the axes around it are as long and wide as it is
SEPARATED, TOUCHING = 0, -1
NO_CONTACT = "#4aa8e0"  # summits without contact: a colour that neither grey heights nor the slip states have
MISSING = "#efdcc3"
DARKEST = 0.55  # darkest grey of heights under summits in contact
FLAT: dict[str, Any] = {"color": INK, "linewidth": 0.8, "linestyle": (0, (4, 2))}


@PICTURES.register
@attrs.frozen(kw_only=True)
class SurfacePicture(Titled):
    """The surface with its summits, and the asperity distribution: radius over height."""

    kind, of, size, alone = "surface", (Surface, SCENARIO), (TWO_COLUMNS, 97.0), True

    def draw(self, canvas: Canvas, data: xr.Dataset | Surface) -> None:
        """Draw the map, or the profile, and the distribution; without positions the distribution alone."""
        if isinstance(data, Surface):
            # the 9-point rule, of a profile the 3-point rule
            with representable():
                summits = data.summits(3 if 1 in data.shape else 9)
            data = surface_group.dataset(summits, data)
        draw_surface(canvas, data, contact_at(data), self.title or str(data.attrs.get("title", "")))


@PICTURES.register
@attrs.frozen(kw_only=True)
class DistributionPicture(Picture):
    """Radii of summits over their heights, coloured by their slip state.

    Attributes
    ----------
    step
        Number of a step, ``"partial"`` (nearest to half of the area slips) or ``"peak"`` (greatest normal load).
    """

    step: int | str = "partial"

    kind, size, alone = "distribution", (COLUMN, 85.0), True

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the summits, and the rigid flat."""
        surface = surface_of(data)
        contact = contact_at(surface, data, step_number(self.step, data))
        draw_distribution(canvas.axes(), contact)
        canvas.legend(handles=legend_handles(surface, contact))
        canvas.heading("", contact.caption)


@attrs.frozen(eq=False)
class ContactAtStep:
    """Summits: slip state (or `TOUCHING`, where not recorded), height and radius [m], and that of the flat, if any."""

    state: npt.NDArray[np.int8]
    height: Floats
    radius: Floats
    separation: float | None = None
    caption: str = ""

    @property
    def flat(self) -> list[float]:
        """Where the rigid flat is [m]; nothing of a surface alone."""
        return [] if self.separation is None else [self.separation]


def draw_surface(canvas: Canvas, surface: xr.Dataset, contact: ContactAtStep, title: str) -> None:
    """Draw a surface with its summits, those in contact in the colour of their state, and their distribution."""
    count = surface.sizes["summit"]
    has_map = "height" in surface
    placed = {"summit_x", "summit_y"} <= set(surface.variables) and (has_map or count > 0)
    axes: Axes | None = None
    beside: Axes | None = None
    if not placed:
        beside = canvas.axes()
    elif count <= 1 or canvas.given is not None:
        # one summit has no distribution
        axes = canvas.axes()
    else:
        axes, beside = canvas.two(("surface", "asperity distribution"), 1.25, stacked=1.6)
    if axes is not None and has_map and 1 in surface["height"].shape:
        _draw_profile(axes, surface, contact)
    elif axes is not None:
        draw_map(axes, surface, contact)
    if beside is not None:
        draw_distribution(beside, contact)
    elif count <= 1:
        canvas.notice(f"no asperity distribution: {counted(count, 'summit', 'summits')}")
    canvas.legend(handles=legend_handles(surface, contact, flat=beside is not None))
    canvas.heading(title, contact.caption)


def surface_of(history: xr.Dataset) -> xr.Dataset:
    """Return the surface that a history was recorded of: from the file that it was opened from, else its summits alone.

    Of the summits alone, ``summit`` has the labels of the asperities.
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


def step_number(step: int | str, history: xr.Dataset) -> int:
    """Return a step of a history as a number from 0."""
    if step == "partial" and "slip_state" in history:
        return representative_step(history)
    # of totals alone nothing is known of what slips
    if step in {"partial", "peak"}:
        return int(history["total_normal_load"].values.argmax())
    try:
        return position_of(step, history)
    except InputError as error:
        raise InputError(f"{error}, partial or peak") from None


def contact_at(surface: xr.Dataset, history: xr.Dataset | None = None, step: int = 0) -> ContactAtStep:
    """Return the summits of a surface alone, or at a step of a history."""
    if "summit_height" not in surface or "summit_radius" not in surface:
        raise InputError("the surface holds no summits; expected the group surface of a result")
    height, radius = (surface[f"summit_{name}"].values.copy() for name in ("height", "radius"))
    state = np.full(height.size, SEPARATED, dtype=np.int8)
    if history is None:
        return ContactAtStep(state, height, radius)
    row = history.isel(step=step)
    recorded = _positions(surface, row) if "slip_state" in row else np.empty(0, dtype=np.int64)
    if recorded.size:
        height[recorded], radius[recorded] = (
            shape_of(history, f"summit_{name}", step) for name in ("height", "radius")
        )
    # the highest ones; beside the separation, which is rounded, one might be taken for the wrong side
    state[np.argsort(-height, kind="stable")[: int(row["contact_count"])]] = TOUCHING
    if recorded.size:
        state[recorded] = row["slip_state"].values
    return ContactAtStep(state, height, radius, float(row["separation"]), caption_at(history, step))


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


def _positions(surface: xr.Dataset, row: xr.Dataset) -> Integers:
    """Return the positions of the recorded asperities among the summits."""
    labels = surface.get("summit", np.arange(surface.sizes["summit"]))
    asperities = row["asperity"].values
    found = np.searchsorted(labels, asperities)
    if asperities.size and (
        found.max() >= labels.size
        or not np.array_equal(labels[found], asperities)
        or not np.array_equal(surface["summit_height"].values[found], row["summit_height"].values)
    ):
        raise InputError("the history is of other summits than the surface; expected the surface of its own file")
    return found


def draw_map(axes: "Axes", surface: xr.Dataset, contact: ContactAtStep) -> None:
    """Draw heights and summits from above, those in contact in the colour of their state."""
    x, y = (_ends(surface, axis) for axis in "xy")
    sides = (x[1] - x[0], y[1] - y[0])
    # a single summit has no sides, but a radius
    lone = max(sides) == 0
    reach = float(surface["summit_radius"].values.max()) if lone else 0.0
    factor, unit = scale_of("m", reach, sides)
    if "height" in surface:
        extent = (x[0] * factor, x[1] * factor, y[0] * factor, y[1] * factor)
        # pale where the colours of the states must differ from them, in grey print, too
        _draw_heights(axes, surface, extent, darkest=DARKEST if contact.flat else 0.0)
    _draw_marks(axes, surface["summit_x"].values * factor, surface["summit_y"].values * factor, contact.state)
    if lone:
        axes.set_xlim((x[0] - reach) * factor, (x[0] + reach) * factor)
        axes.set_ylim((y[0] - reach) * factor, (y[0] + reach) * factor)
    # a long strip would leave no room for its labels
    axes.set_aspect("equal", adjustable="box" if max(sides) <= LONGEST * min(sides) else "datalim")
    axes.spines[["top", "right"]].set_visible(True)
    axes.set(title="Surface and summits", xlabel=f"$x$ ({unit})", ylabel=f"$y$ ({unit})")


def _ends(surface: xr.Dataset, axis: str) -> tuple[float, float]:
    """Return where the pixels of the map begin and end along an axis [m], or the summits where there is none."""
    if "height" in surface:
        points = surface[axis].values
        return float(1.5 * points[0] - 0.5 * points[1]), float(1.5 * points[-1] - 0.5 * points[-2])
    positions = surface[f"summit_{axis}"].values
    return float(positions.min()), float(positions.max())


def _draw_heights(axes: "Axes", surface: xr.Dataset, extent: Extent, *, darkest: float) -> None:
    import matplotlib as mpl
    from matplotlib.colors import ListedColormap

    factor, unit = scale_of("m", surface["height"].values)
    heights = surface["height"].values * factor
    known = heights[np.isfinite(heights)]
    # a few spikes would leave all else in one grey
    low, high = np.percentile(known, (0.5, 99.5)) if known.size else (0.0, 0.0)
    greys = ListedColormap(mpl.colormaps["gray"](np.linspace(darkest, 1.0, 256))).with_extremes(bad=MISSING)
    if high <= low:
        draw_image(axes, heights, extent, cmap=greys, vmin=low - 1, vmax=high + 1)
        return
    image = draw_image(axes, heights, extent, cmap=greys, vmin=low, vmax=high)
    left, right, bottom, top = extent
    height_over_width = (top - bottom) / (right - left)
    below, above = known.min() < low, known.max() > high
    axes.figure.colorbar(
        image,
        cax=axes.inset_axes((1.03, 0, 0.045 * (height_over_width if 1 < height_over_width <= LONGEST else 1), 1)),
        extend="both" if below and above else "min" if below else "max" if above else "neither",
        label=f"height $z$ ({unit})",
    )


def _draw_profile(axes: "Axes", surface: xr.Dataset, contact: ContactAtStep) -> None:
    axis = "x" if surface.sizes["x"] > 1 else "y"
    points, heights = surface[axis].values, surface["height"].values.ravel()
    (along, unit), (up, height_unit) = scale_of("m", points), scale_of("m", heights, contact.flat)
    axes.plot(points * along, heights * up, color=FAINT, linewidth=0.7, rasterized=True, zorder=1)
    _draw_marks(axes, surface[f"summit_{axis}"].values * along, contact.height * up, contact.state)
    for separation in contact.flat:
        axes.axhline(separation * up, **FLAT)
    axes.margins(x=0.01)
    axes.set(title="Profile and summits", xlabel=f"${axis}$ ({unit})", ylabel=f"height $z$ ({height_unit})")


def draw_distribution(axes: "Axes", contact: ContactAtStep) -> None:
    """Draw the radius of each summit against its height."""
    radii = contact.radius
    (along, height_unit), (up, radius_unit) = scale_of("m", contact.height, contact.flat), scale_of("m", radii)
    _draw_marks(axes, contact.height * along, radii * up, contact.state)
    for separation in contact.flat:
        axes.axvline(separation * along, **FLAT)
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


def _draw_marks(axes: "Axes", x: Floats, y: Floats, state: npt.NDArray[np.int8]) -> None:
    separated = np.flatnonzero(state == SEPARATED)
    if separated.size > MOST_MARKS:
        # by lot, since every so many-th one of a regular array would be another array
        separated = np.random.default_rng(0).choice(separated, MOST_MARKS, replace=False)
    size = float(np.clip(120 / np.sqrt(max(separated.size, 1)), 0.9, 7.0))
    axes.plot(x[separated], y[separated], ".", color=NO_CONTACT, ms=size, markeredgewidth=0, rasterized=True)
    area = 16 if np.count_nonzero(state != SEPARATED) <= 500 else 7
    for value, fill in (*enumerate(STATE_COLOURS[1:], 1), (TOUCHING, "none")):
        here = state == value
        axes.scatter(x[here], y[here], s=area, c=fill, edgecolors=INK, linewidths=0.35, rasterized=True, zorder=3)


def legend_handles(surface: xr.Dataset, contact: ContactAtStep, *, flat: bool = True) -> "list[Artist]":
    """Return what a legend shows of marks; the rigid flat only where it is drawn."""
    from matplotlib.lines import Line2D

    handles: list[Artist] = []
    count = np.count_nonzero(contact.state == SEPARATED)
    if contact.flat or count > MOST_MARKS:
        name = STATES[SEPARATED] if contact.flat else "summit"
        part = f" ({MOST_MARKS:,} of {count:,} drawn)" if count > MOST_MARKS else ""
        handles.append(Line2D([], [], marker=".", linestyle="", color=NO_CONTACT, ms=5, label=name + part))
    if contact.flat:
        entries = [*zip(STATES[1:], STATE_COLOURS[1:], strict=True)]
        entries += [("touching, not recorded", "none")] * bool((contact.state == TOUCHING).any())
        handles += [
            Line2D([], [], marker="o", linestyle="", mfc=colour, mec=INK, mew=0.4, ms=4.5, label=name)
            for name, colour in entries
        ]
        if flat:
            handles.append(Line2D([], [], label="rigid flat", **FLAT))
    if "height" in surface and 1 not in surface["height"].shape and surface["height"].isnull().any():
        handles += patches([MISSING], ["missing height"])
    return handles


# Percentile of the radii up to which the axis reaches: a few flat summits would leave all others at its foot.
HIGHEST = 99.8
BESIDE_APART, BESIDE_TOGETHER = 90.0, 35.0  # what summits add to the width, side by side and over one another [mm]


@PICTURES.register
@attrs.frozen(kw_only=True)
class SummitsPicture(Panel):
    """Radius over height of all summits of up to 8 surfaces, with means and standard deviations.

    Of a scenario they are those of the surface, or of the surfaces of its sweep. In Python: a dict of summits.

    Attributes
    ----------
    apart
        Several surfaces side by side.

    Examples
    --------
    [[picture]]
    kind = "summits"
    """

    apart: bool = False

    kind, of = "summits", (SCENARIO, Summits)

    @property
    def beside(self) -> float:
        """Width of several surfaces [mm]."""
        return BESIDE_APART if self.apart else BESIDE_TOGETHER

    def size_of(self, data: Any) -> Size:  # noqa: ARG002 - see the base class
        """Return both columns where they stand apart."""
        return TWO_COLUMNS if self.apart else 1.3 * COLUMN, 85.0

    def draw(self, canvas: Canvas, data: Summits | dict[str, Summits] | Sequence[Summits]) -> None:
        """Draw summits of one surface, or of several by their names."""
        found: Any = {"summits": data} if isinstance(data, Summits) else data
        summits: list[Summits] = list(found.values() if isinstance(found, dict) else found)
        unnamed = [f"surface {number + 1}" for number in range(len(summits))]
        labels = self.labels or tuple(found if isinstance(found, dict) else unnamed)
        if not 1 <= len(summits) <= len(LINES) or len(labels) != len(summits):
            raise InputError(
                f"{counted(len(summits), 'surface', 'surfaces')} and {counted(len(labels), 'label', 'labels')}; "
                f"expected 1 to {len(LINES)} surfaces, with a label each"
            )
        top = max(float(np.percentile(each.radius, HIGHEST)) for each in summits)
        (up, radius_unit), (along, height_unit) = scale_of("m", top), scale_of("m", *(each.height for each in summits))
        grid = _grid(canvas, len(summits), apart=self.apart)
        size = float(np.clip(120 / np.sqrt(max(each.height.size for each in summits)), 1.3, 5.0))
        for axes, each, label, (colour, *_) in zip(grid, summits, labels, LINES, strict=False):
            means = f"$R$ {_mean(each.radius, up)} {radius_unit}, $z$ {_mean(each.height, along)} {height_unit}"
            _draw_scatter(
                axes, each.height * along, each.radius * up, size, colour, f"{label}: {means} ({len(each):,})"
            )
            if self.apart:
                axes.set_title(label)
            spec = axes.get_subplotspec()
            if spec is None or spec.is_last_row():
                axes.set_xlabel(f"summit height $z$ ({height_unit})", color=INK)
        grid[0].set_ylim(0, 1.05 * top * up)
        grid[0].set_ylabel(f"summit radius $R$ ({radius_unit})")
        beyond = sum(int(np.count_nonzero(each.radius > 1.05 * top)) for each in summits)
        if beyond:
            canvas.notice(f"{counted(beyond, 'summit', 'summits')} with a larger radius lie above the axis")
        canvas.legend(*grid, extra="mean ± standard deviation (number of summits)")
        if not (self.apart and canvas.beside_others):
            canvas.title(grid[0], self.title)


def _grid(canvas: Canvas, count: int, *, apart: bool) -> "list[Axes]":
    """Return axes for each of some surfaces: all the same, or side by side."""
    if not apart or count == 1:
        return [canvas.axes()] * count
    across = min(count, max(int(canvas.width / 28.0), 1))
    grid: Any = canvas.several(count).subplots(-(-count // across), across, sharex=True, sharey=True, squeeze=False)
    for empty in grid.ravel()[count:]:
        empty.remove()
    return list(grid.ravel()[:count])


def _draw_scatter(axes: "Axes", height: Floats, radius: Floats, size: float, colour: str, name: str) -> None:
    dots: dict[str, Any] = {"marker": ".", "linestyle": "", "ms": size, "mew": 0, "rasterized": True}
    axes.plot(height, radius, color=colour, alpha=0.7, **dots)
    several = height.size > 1
    axes.errorbar(
        height.mean(),
        radius.mean(),
        xerr=height.std(ddof=1) if several else None,
        yerr=radius.std(ddof=1) if several else None,
        color=colour,
        mec="white",
        marker="s",
        ms=4.5,
        mew=0.5,
        capsize=2,
        linewidth=0.8,
        label=name,
        zorder=4,
    )


def _mean(values: Floats, factor: float) -> str:
    deviation = f" ± {values.std(ddof=1) * factor:.2f}" if values.size > 1 else ""
    return f"{values.mean() * factor:.2f}{deviation}"


@PICTURES.register
@attrs.frozen(kw_only=True)
class MapPicture(Panel):
    """The height map in colours, without its summits."""

    kind, of = "map", (SCENARIO, Surface)

    def draw(self, canvas: Canvas, data: Surface) -> None:
        """Draw the heights, seen from above."""
        (factor, height_unit), (along, unit) = scale_of("m", data.heights), scale_of("m", data.size)
        axes = canvas.axes()
        extent = (0.0, data.size[0] * along, 0.0, data.size[1] * along)
        image = draw_image(axes, data.heights * factor, extent, cmap="viridis")
        # as high as the map, whatever room there is
        axes.figure.colorbar(image, cax=axes.inset_axes((1.03, 0, 0.045, 1)), label=f"height $z$ ({height_unit})")
        axes.spines[["top", "right"]].set_visible(True)
        axes.set(xlabel=f"$x$ ({unit})", ylabel=f"$y$ ({unit})")
        canvas.title(axes, self.title)
