"""Pictures of surfaces: height map and summits, also at a step of a history, and wear between two maps."""

import math
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
from historysim.results.analysis.recorded import shape_in_step
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, Canvas, Size
from historysim.results.plots.pictures import PICTURES, SCENARIO, Panel, Picture, Titled
from historysim.results.plots.style import (
    DASHED,
    DIVERGING,
    FAINT,
    INK,
    LINES,
    MARK,
    STATE_COLOURS,
    STATES,
    Extent,
    by_factors,
    draw_image,
    note_instead,
    scale_of,
)
from historysim.results.steps import resolve_step
from historysim.surfaces.heights import Surface
from historysim.surfaces.registration import LOST, LOWERED, Registration
from historysim.surfaces.summits import Summits

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_MARKS = 20_000  # summits without contact that are marked; of more, so many taken by lot
LONGEST = 4.0  # length over width of a surface up to which the axes around it are as long and wide as it is
SEPARATED, TOUCHING = 0, -1
NO_CONTACT = "#4aa8e0"  # summits without contact: a colour that neither grey heights nor the slip states have
MISSING = "#efdcc3"
DARKEST = 0.55  # darkest grey of heights under summits in contact
FLAT: dict[str, Any] = {"color": INK, "linewidth": 0.8, "linestyle": (0, (4, 2)), "label": "rigid flat"}


@PICTURES.register
@attrs.frozen(kw_only=True)
class SurfacePicture(Titled):
    """The surface with its summits, and the asperity distribution: radius over height."""

    kind, of, size, own_figure, headed = "surface", (Surface, SCENARIO), (TWO_COLUMNS, 97.0), True, True

    def draw(self, canvas: Canvas, data: xr.Dataset | Surface) -> None:
        """Draw the map, or the profile, and the distribution; without positions the distribution alone."""
        if isinstance(data, Surface):
            # the 9-point rule, of a profile the 3-point rule
            with representable():
                summits = data.summits(3 if 1 in data.shape else 9)
            data = surface_group.dataset(summits, data)
        draw_surface(canvas, data, read_contact(data))


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

    kind, size, own_figure = "distribution", (COLUMN, 85.0), True

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the summits, and the rigid flat."""
        contact = read_contact(load_surface(data), data, step_number(self.step, data))
        draw_distribution(canvas.axes(), contact)
        canvas.caption = contact.caption


@attrs.frozen(eq=False)
class ContactAtStep:
    """Summits: slip state (or `TOUCHING` if not recorded), height and radius [m], and separation of the flat."""

    state: npt.NDArray[np.int8]
    height: Floats
    radius: Floats
    separation: float | None = None
    caption: str = ""

    @property
    def flat(self) -> list[float]:
        """Separation of the rigid flat [m]; empty for a surface alone."""
        return [] if self.separation is None else [self.separation]


def draw_surface(canvas: Canvas, surface: xr.Dataset, contact: ContactAtStep) -> None:
    """Draw a surface with its summits, those in contact in the colour of their state, and their distribution."""
    count = surface.sizes["summit"]
    canvas.caption = contact.caption
    if not has_positions(surface):
        draw_distribution(canvas.axes(), contact)
        return
    if count <= 1 or canvas.given is not None:
        axes, distribution_axes = canvas.axes(), None
    else:
        axes, distribution_axes = canvas.two(("surface", "asperity distribution"), 1.25, stacked=1.6)
    if "height" in surface and 1 in surface["height"].shape:
        _draw_profile(axes, surface, contact)
    else:
        draw_map(axes, surface, contact)
    if distribution_axes is not None:
        draw_distribution(distribution_axes, contact)
    elif count <= 1:
        canvas.notice(f"no asperity distribution: {counted(count, 'summit', 'summits')}")


def has_positions(surface: xr.Dataset) -> bool:
    """Return whether it is known where its summits are, or its heights."""
    positions = {"summit_x", "summit_y"} <= set(surface.variables)
    return positions and ("height" in surface or surface.sizes["summit"] > 0)


def load_surface(history: xr.Dataset) -> xr.Dataset:
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
        return resolve_step(step, history)
    except InputError as error:
        raise InputError(f"{error}, partial or peak") from None


def read_contact(surface: xr.Dataset, history: xr.Dataset | None = None, step: int = 0) -> ContactAtStep:
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
            shape_in_step(history, f"summit_{name}", step) for name in ("height", "radius")
        )
    # the highest ones; beside the separation, which is rounded, one might be taken for the wrong side
    state[np.argsort(-height, kind="stable")[: int(row["contact_count"])]] = TOUCHING
    if recorded.size:
        state[recorded] = row["slip_state"].values
    return ContactAtStep(state, height, radius, float(row["separation"]), step_caption(history, step))


def step_caption(history: xr.Dataset, step: int) -> str:
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
    positions = np.searchsorted(labels, asperities)
    if asperities.size and (
        positions.max() >= labels.size
        or not np.array_equal(labels[positions], asperities)
        or not np.array_equal(surface["summit_height"].values[positions], row["summit_height"].values)
    ):
        raise InputError("the history is of other summits than the surface; expected the surface of its own file")
    return positions


def draw_map(axes: "Axes", surface: xr.Dataset, contact: ContactAtStep) -> None:
    """Draw heights and summits from above, those in contact in the colour of their state."""
    x, y = (_ends(surface, axis) for axis in "xy")
    sides = (x[1] - x[0], y[1] - y[0])
    if "height" in surface:
        # pale where the colours of the states must differ from them, in grey print, too
        _draw_heights(axes, surface, (*x, *y), darkest=DARKEST if contact.flat else 0.0)
    _draw_marks(axes, surface["summit_x"].values, surface["summit_y"].values, contact)
    if max(sides) == 0:
        # a single summit has no sides, but a radius
        reach = float(surface["summit_radius"].values.max())
        axes.set(xlim=(x[0] - reach, x[0] + reach), ylim=(y[0] - reach, y[0] + reach))
    # a long strip would leave no room for its labels
    axes.set_aspect("equal", adjustable="box" if max(sides) <= LONGEST * min(sides) else "datalim")
    axes.spines[["top", "right"]].set_visible(True)
    axes.set(title="Surface and summits", xlabel="$x$ (m)", ylabel="$y$ (m)")


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

    heights = surface["height"].values
    finite = heights[np.isfinite(heights)]
    if finite.size < heights.size:
        axes.scatter([], [], marker="s", color=MISSING, label="missing height")
    # a few spikes would leave all else in one grey
    low, high = np.percentile(finite, (0.5, 99.5)) if finite.size else (0.0, 0.0)
    greys = ListedColormap(mpl.colormaps["gray"](np.linspace(darkest, 1.0, 256))).with_extremes(bad=MISSING)
    if high <= low:
        draw_image(axes, heights, extent, cmap=greys, vmin=low - 1e-9, vmax=high + 1e-9)
        return
    image = draw_image(axes, heights, extent, cmap=greys, vmin=low, vmax=high)
    left, right, bottom, top = extent
    height_over_width = (top - bottom) / (right - left)
    below, above = finite.min() < low, finite.max() > high
    axes.figure.colorbar(
        image,
        cax=axes.inset_axes((1.03, 0, 0.045 * (height_over_width if 1 < height_over_width <= LONGEST else 1), 1)),
        extend="both" if below and above else "min" if below else "max" if above else "neither",
        label="height $z$ (m)",
    )


def _draw_profile(axes: "Axes", surface: xr.Dataset, contact: ContactAtStep) -> None:
    axis = "x" if surface.sizes["x"] > 1 else "y"
    heights = surface["height"].values.ravel()
    axes.plot(surface[axis].values, heights, color=FAINT, linewidth=0.7, rasterized=True, zorder=1)
    _draw_marks(axes, surface[f"summit_{axis}"].values, contact.height, contact)
    for separation in contact.flat:
        axes.axhline(separation, **FLAT)
        axes.autoscale_view()
    axes.margins(x=0.01)
    axes.set(title="Profile and summits", xlabel=f"${axis}$ (m)", ylabel="height $z$ (m)")


def draw_distribution(axes: "Axes", contact: ContactAtStep) -> None:
    """Draw the radius of each summit against its height."""
    radii = contact.radius
    _draw_marks(axes, contact.height, radii, contact)
    for separation in contact.flat:
        axes.axvline(separation, **FLAT)
        axes.autoscale_view()
    axes.set(title="Asperity distribution", xlabel="summit height $z$ (m)", ylabel="summit radius $R$ (m)")
    if not radii.size:
        note_instead(axes, "no summits")
    # radii of rough surfaces reach over decades
    elif radii.max() > 20 * radii.min():
        by_factors(axes.yaxis)
    elif np.ptp(radii) <= 1e-12 * radii.max():
        axes.set_ylim(0, 2 * radii.max())


def _draw_marks(axes: "Axes", x: Floats, y: Floats, contact: ContactAtStep) -> None:
    """Mark summits by their state; of a surface alone they are all alike."""
    state, names = contact.state, STATES if contact.flat else ("",) * 4
    separated = np.flatnonzero(state == SEPARATED)
    label, count = names[SEPARATED], separated.size
    if count > MOST_MARKS:
        # by lot, since every so many-th one of a regular array would be another array
        separated = np.random.default_rng(0).choice(separated, MOST_MARKS, replace=False)
        label = f"{label or 'summit'} ({MOST_MARKS:,} of {count:,} drawn)"
    dots: dict[str, Any] = {"color": NO_CONTACT, "markeredgewidth": 0, "label": label, "rasterized": True}
    axes.plot(x[separated], y[separated], ".", ms=np.clip(120 / np.sqrt(max(separated.size, 1)), 0.9, 7.0), **dots)
    marks: dict[str, Any] = {"edgecolors": INK, "linewidths": 0.35, "rasterized": True, "zorder": 3}
    marks["s"] = 16 if np.count_nonzero(state != SEPARATED) <= 500 else 7
    for value, fill in enumerate(STATE_COLOURS[1:], 1):
        selected = state == value
        axes.scatter(x[selected], y[selected], c=fill, label=names[value], **marks)
    if (selected := state == TOUCHING).any():
        axes.scatter(x[selected], y[selected], c="none", label="touching, not recorded", **marks)


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

    def default_size(self, data: Any) -> Size:  # noqa: ARG002 - see the base class
        """Return both columns where they stand apart."""
        return TWO_COLUMNS if self.apart else 1.3 * COLUMN, 85.0

    def draw(self, canvas: Canvas, data: Summits | dict[str, Summits] | Sequence[Summits]) -> None:
        """Draw summits of one surface, or of several by their names."""
        surfaces: Any = {"summits": data} if isinstance(data, Summits) else data
        summits: list[Summits] = list(surfaces.values() if isinstance(surfaces, dict) else surfaces)
        names = surfaces if isinstance(surfaces, dict) else [f"surface {number + 1}" for number in range(len(summits))]
        if not 1 <= len(summits) <= len(LINES):
            raise InputError(f"{counted(len(summits), 'surface', 'surfaces')}; expected 1 to {len(LINES)}")
        labels = self.called_as([*names], "surfaces")
        top = max(float(np.percentile(sample.radius, HIGHEST)) for sample in summits)
        units = scale_of("m", top), scale_of("m", *(sample.height for sample in summits))
        grid = _grid(canvas, len(summits), apart=self.apart)
        size = float(np.clip(120 / np.sqrt(max(sample.height.size for sample in summits)), 1.3, 5.0))
        for axes, sample, label, (colour, *_) in zip(grid, summits, labels, LINES, strict=False):
            means = f"$R$ {_mean(sample.radius, *units[0])}, $z$ {_mean(sample.height, *units[1])}"
            _draw_scatter(axes, sample, size, colour, f"{label}: {means} ({len(sample):,})")
            if self.apart:
                axes.set_title(label)
            spec = axes.get_subplotspec()
            if spec is None or spec.is_last_row():
                axes.set_xlabel("summit height $z$ (m)")
        grid[0].set(ylim=(0, 1.05 * top), ylabel="summit radius $R$ (m)")
        beyond = sum(int(np.count_nonzero(sample.radius > 1.05 * top)) for sample in summits)
        if beyond:
            canvas.notice(f"{counted(beyond, 'summit', 'summits')} with a larger radius lie above the axis")
        canvas.legend(extra="mean ± standard deviation (number of summits)")


def _grid(canvas: Canvas, count: int, *, apart: bool) -> "list[Axes]":
    """Return axes for each of some surfaces: all the same, or side by side."""
    if not apart or count == 1:
        return [canvas.axes()] * count
    across = min(count, max(int(canvas.width / 28.0), 1))
    grid = canvas.several(count).subplots(-(-count // across), across, sharex=True, sharey=True, squeeze=False)
    for empty in grid.ravel()[count:]:
        empty.remove()
    return list(grid.ravel()[:count])


def _draw_scatter(axes: "Axes", summits: Summits, size: float, colour: str, name: str) -> None:
    height, radius = summits.height, summits.radius
    dots: dict[str, Any] = {"marker": ".", "linestyle": "", "ms": size, "mew": 0, "rasterized": True}
    axes.plot(height, radius, color=colour, alpha=0.7, **dots)
    has_deviation = height.size > 1
    deviations = {"xerr": height.std(ddof=1), "yerr": radius.std(ddof=1)} if has_deviation else {}
    looks: dict[str, Any] = {"color": colour, "mec": "white", "mew": 0.5, "marker": "s", "ms": 4.5}
    looks |= {"capsize": 2, "linewidth": 0.8, "label": name, "zorder": 4}
    axes.errorbar(height.mean(), radius.mean(), **deviations, **looks)


def _mean(values: Floats, factor: float, unit: str) -> str:
    deviation = f" ± {values.std(ddof=1) * factor:.2f}" if values.size > 1 else ""
    return f"{values.mean() * factor:.2f}{deviation} {unit}"


@PICTURES.register
@attrs.frozen(kw_only=True)
class MapPicture(Panel):
    """The height map in colours, without its summits."""

    kind, of = "map", (SCENARIO, Surface)

    def draw(self, canvas: Canvas, data: Surface) -> None:
        """Draw the heights, seen from above."""
        axes = canvas.axes()
        image = draw_image(axes, data.heights, (0.0, data.size[0], 0.0, data.size[1]), cmap="viridis")
        # as high as the map, whatever room there is
        axes.figure.colorbar(image, cax=axes.inset_axes((1.03, 0, 0.045, 1)), label="height $z$ (m)")
        axes.spines[["top", "right"]].set_visible(True)
        axes.set(xlabel="$x$ (m)", ylabel="$y$ (m)")


DEEPEST = 99.8  # percentile of the heights lost up to which colours reach: a single spike would hide the rest
NOT_THERE = "#d9d9d6"
SHOWN = ("worn volume", "summits")  # lines of the summary that stand above the picture


@PICTURES.register
@attrs.frozen(kw_only=True)
class BeforeAfterPicture(Titled):
    """Height lost between two maps of one area, with worn points and summits, and a section through both."""

    kind, of, size, own_figure = "before-after", (Registration,), (TWO_COLUMNS, 97.0), True

    def draw(self, canvas: Canvas, data: Registration) -> None:
        """Draw the difference of the maps, and the section along x where the most is lost."""
        axes, section_axes = canvas.two(("height lost", "section"), 1.1, stacked=1.6)
        _draw_difference(axes, data)
        if section_axes is not None:
            _draw_section(axes, section_axes, data)
        canvas.caption = "; ".join(f"{label} {text}" for label, text in data.summary() if label in SHOWN)


def _draw_difference(axes: "Axes", registration: Registration) -> None:
    import matplotlib as mpl

    lost, size, pixel = (
        registration.difference.heights,
        registration.difference.size,
        np.array(registration.difference.pixel_size),
    )
    limit = max(float(np.nanpercentile(np.abs(lost), DEEPEST)), 3 * registration.noise) or 1e-9
    colours = mpl.colormaps[DIVERGING].with_extremes(bad=NOT_THERE)
    image = draw_image(axes, lost, (0.0, size[0], 0.0, size[1]), cmap=colours, vmin=-limit, vmax=limit)
    axes.figure.colorbar(image, ax=axes, shrink=0.8, extend="both", label="height lost (m)")
    if registration.worn.any():
        x, y = ((np.arange(count) + 0.5) * side for count, side in zip(lost.shape, pixel, strict=True))
        axes.contour(x, y, registration.worn.T, levels=[0.5], colors=[INK], linewidths=0.5)
    for fate, marker, name in ((LOWERED, "v", "summit flattened"), (LOST, "x", "summit lost")):
        positions = registration.summit_place[registration.fate == fate] + 0.5 * pixel
        looks: dict[str, Any] = {"color": INK, "linestyle": "", "marker": marker, "ms": 3.5, "mfc": "none", "mew": 0.7}
        axes.plot(*positions.T, label=name if positions.size else None, **looks)
    axes.spines[["top", "right"]].set_visible(True)
    axes.set(title="Height lost", xlabel="$x$ (m)", ylabel="$y$ (m)")


def _draw_section(map_axes: "Axes", axes: "Axes", registration: Registration) -> None:
    lost = np.where(registration.worn, registration.difference.heights, -math.inf)
    row = int(np.unravel_index(np.argmax(lost), lost.shape)[1]) if registration.worn.any() else lost.shape[1] // 2
    height_after = registration.after.heights[:, row]
    height_before = height_after + registration.difference.heights[:, row]
    pixel = registration.difference.pixel_size
    x, y = (np.arange(height_after.size) + 0.5) * pixel[0], (row + 0.5) * pixel[1]
    axes.fill_between(x, height_after, height_before, where=registration.worn[:, row], color=FAINT, alpha=0.35, lw=0)
    axes.plot(x, height_before, color=MARK, linewidth=0.9, label="before")
    axes.plot(x, height_after, color=STATE_COLOURS[2], linewidth=0.9, linestyle=(0, (4, 1.5)), label="after")
    map_axes.axhline(y, **DASHED | {"linewidth": 0.7})
    axes.set(title=f"Section at $y$ = {quantity_text(y, 'm', 3)}", xlabel="$x$ (m)", ylabel="height (m)")
