"""Pictures of surfaces: height map and summits, also at a step of a history, and wear between two maps."""

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import attrs
import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.arguments import Floats, Integers, representable
from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.recording import surface_group
from historysim.results.analysis.recorded import shape_in_step
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, Size
from historysim.results.plots.chart import Chart, Curve, Item, Map, Note, Shape, Sheet
from historysim.results.plots.pictures import PICTURES, SCENARIO, Panel, Titled
from historysim.results.plots.style import (
    DASHED,
    DIVERGING,
    FAINT,
    INK,
    LINES,
    MARK,
    STATE_COLOURS,
    STATES,
    Look,
    choose_scale,
)
from historysim.results.steps import resolve_step
from historysim.surfaces.heights import Surface
from historysim.surfaces.registration import LOST, LOWERED, Registration
from historysim.surfaces.summits import Summits

MOST_MARKS = 20_000  # summits without contact that are marked; of more, a random sample
LONGEST = 4.0  # length over width of a surface up to which the axes have its shape
SEPARATED, TOUCHING = 0, -1
# summits without contact: a colour different from grey heights and from the slip states
NO_CONTACT = "#4aa8e0"
MISSING = "#efdcc3"
DARKEST = 0.55  # darkest grey of heights under summits in contact
FLAT: Look = {
    "color": INK,
    "linewidth": 0.8,
    "linestyle": (0, (4, 2)),
    "label": "rigid flat",
}
HEIGHT, RADIUS = "summit height $z$ (m)", "summit radius $R$ (m)"
PLANE: Look = {"x": "$x$ (m)", "y": "$y$ (m)"}


@PICTURES.register
@attrs.frozen(kw_only=True)
class SurfacePicture(Titled):
    """The surface with its summits, and the asperity distribution: radius over height."""

    kind, of, size, own_figure, headed = (
        "surface",
        (Surface, SCENARIO),
        (TWO_COLUMNS, 97.0),
        True,
        True,
    )

    def sheet(self, data: xr.Dataset | Surface) -> Sheet:
        """Return the map, or the profile, and the distribution; without positions the distribution alone."""
        if isinstance(data, Surface):
            # the 9-point rule, of a profile the 3-point rule
            with representable():
                summits = data.summits(3 if 1 in data.shape else 9)
            data = surface_group.dataset(summits, data)
        return surface_sheet(data, read_contact(data))


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


def surface_sheet(surface: xr.Dataset, contact: ContactAtStep) -> Sheet:
    """Return a surface with its summits, those in contact in the colour of their state, and their distribution."""
    count = surface.sizes["summit"]
    charts = {}
    if has_positions(surface):
        is_profile = "height" in surface and 1 in surface["height"].shape
        charts["M"] = (_profile if is_profile else _summit_map)(surface, contact)
    if count > 1 or not charts:
        charts["D"] = _distribution(contact)
    notices = (
        ()
        if "D" in charts
        else (f"no asperity distribution: {count_text(count, 'summit', 'summits')}",)
    )
    wide = "MMMMMDDDD" if len(charts) > 1 else ""
    return Sheet(charts, wide=wide, subtitle=contact.caption, notices=notices, first_alone=True)


def has_positions(surface: xr.Dataset) -> bool:
    """Return whether the positions of the summits, or the heights, are known."""
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
        raise InputError(
            "the history holds no asperities; expected one recorded with asperities, or its file"
        )
    names = {
        "summit_height": "summit_height",
        "summit_radius": "summit_radius",
        "x": "summit_x",
        "y": "summit_y",
    }
    return xr.Dataset(
        {
            ours: ("summit", history[theirs].values)
            for theirs, ours in names.items()
            if theirs in history.coords
        },
        coords={"summit": history["asperity"].values},
    )


def step_number(step: int | str, history: xr.Dataset) -> int:
    """Return a step of a history as a number from 0."""
    if step == "partial" and "slip_state" in history:
        return representative_step(history)
    # totals do not show what slips
    if step in {"partial", "peak"}:
        return int(history["total_normal_load"].values.argmax())
    try:
        return resolve_step(step, history)
    except InputError as error:
        raise InputError(f"{error}, partial or peak") from None


def read_contact(
    surface: xr.Dataset, history: xr.Dataset | None = None, step: int = 0
) -> ContactAtStep:
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
    # the highest summits: compared with the rounded separation, one might be on the wrong side
    state[np.argsort(-height, kind="stable")[: int(row["contact_count"])]] = TOUCHING
    if recorded.size:
        state[recorded] = row["slip_state"].values
    return ContactAtStep(
        state, height, radius, float(row["separation"]), step_caption(history, step)
    )


def step_caption(history: xr.Dataset, step: int) -> str:
    """Return the step, its time and its loads as a line."""
    row = history.isel(step=step)
    return (
        f"step {step:,}, t = {float(row['time']):.6g} s:  "
        f"N = {quantity_text(float(row['total_normal_load']), 'N')},  "
        f"T = {quantity_text(float(row['total_tangential_load']), 'N')},  "
        f"U = {quantity_text(float(row['tangential_displacement']), 'm')},  "
        f"{count_text(int(row['contact_count']), 'asperity', 'asperities')} in contact"
    )


def _positions(surface: xr.Dataset, row: xr.Dataset) -> Integers:
    """Return the positions of the recorded asperities among the summits."""
    labels = surface.get("summit", np.arange(surface.sizes["summit"]))
    asperities = row["asperity"].values
    positions = np.searchsorted(labels, asperities)
    if asperities.size and (
        positions.max() >= labels.size
        or not np.array_equal(labels[positions], asperities)
        or not np.array_equal(
            surface["summit_height"].values[positions], row["summit_height"].values
        )
    ):
        raise InputError(
            "the history is of other summits than the surface; expected the surface in its file"
        )
    return positions


def _summit_map(surface: xr.Dataset, contact: ContactAtStep) -> Chart:
    """Return heights and summits from above, those in contact in the colour of their state."""
    x, y = (_ends(surface, axis) for axis in "xy")
    sides = (x[1] - x[0], y[1] - y[0])
    items: list[Item] = []
    # a long strip would leave no room for its labels
    axes: Look = {
        "aspect": "equal",
        "adjustable": "box" if max(sides) <= LONGEST * min(sides) else "datalim",
    }
    if "height" in surface:
        # pale under the colours of the states, which then differ from it in grey print, too
        items += _heights(surface, (*x, *y), darkest=DARKEST if contact.flat else 0.0)
    if max(sides) == 0:
        # a single summit has no sides, but a radius
        reach = float(surface["summit_radius"].values.max())
        axes |= {"xlim": (x[0] - reach, x[0] + reach), "ylim": (y[0] - reach, y[0] + reach)}
    items += _marks(surface["summit_x"].values, surface["summit_y"].values, contact)
    return Chart(
        items=items, title="Surface and summits", name="surface", height=44.0, axes=axes, **PLANE
    )


def _ends(surface: xr.Dataset, axis: str) -> tuple[float, float]:
    """Return where the pixels of the map begin and end along an axis [m], or the summits where there is none."""
    if "height" in surface:
        points = surface[axis].values
        return float(1.5 * points[0] - 0.5 * points[1]), float(1.5 * points[-1] - 0.5 * points[-2])
    positions = surface[f"summit_{axis}"].values
    return float(positions.min()), float(positions.max())


def _heights(surface: xr.Dataset, extent: Any, *, darkest: float) -> list[Item]:
    import matplotlib as mpl
    from matplotlib.colors import ListedColormap

    heights = surface["height"].values
    finite = heights[np.isfinite(heights)]
    items: list[Item] = []
    if finite.size < heights.size:
        items.append(
            Shape("scatter", ([], []), {"marker": "s", "color": MISSING, "label": "missing height"})
        )
    # a few spikes would leave the rest in one grey
    low, high = np.percentile(finite, (0.5, 99.5)) if finite.size else (0.0, 0.0)
    greys = ListedColormap(mpl.colormaps["gray"](np.linspace(darkest, 1.0, 256))).with_extremes(
        bad=MISSING
    )
    if high <= low:
        return [
            *items,
            Map(heights, extent, look={"cmap": greys, "vmin": low - 1e-9, "vmax": high + 1e-9}),
        ]
    below = finite.min() < low
    above = finite.max() > high
    extend = "both" if below and above else "min" if below else "max" if above else "neither"
    return [
        *items,
        Map(heights, extent, "height $z$ (m)", {"cmap": greys, "vmin": low, "vmax": high}, extend),
    ]


def _profile(surface: xr.Dataset, contact: ContactAtStep) -> Chart:
    axis = "x" if surface.sizes["x"] > 1 else "y"
    line = {"color": FAINT, "linewidth": 0.7, "zorder": 1}
    items: list[Item] = [Curve(surface[axis].values, surface["height"].values.ravel(), "", line)]
    items += _marks(surface[f"summit_{axis}"].values, contact.height, contact)
    items += [Shape("axhline", (separation,), FLAT) for separation in contact.flat]
    labels: Look = {
        "title": "Profile and summits",
        "x": f"${axis}$ (m)",
        "y": "height $z$ (m)",
    }
    return Chart(items=items, margins=(0.01, 0.05), name="profile", **labels)


def _distribution(contact: ContactAtStep) -> Chart:
    """Return the radius of each summit against its height."""
    radii = contact.radius
    items = [
        *_marks(contact.height, radii, contact),
        *(Shape("axvline", (at,), FLAT) for at in contact.flat),
    ]
    axes: Look = {}
    if not radii.size:
        items = [Note("no summits", (0.5, 0.5), (0, 0), {"color": FAINT})]
        axes = {"xticks": [], "yticks": []}
    elif np.ptp(radii) <= 1e-12 * radii.max():
        axes = {"ylim": (0, 2 * radii.max())}
    # radii of rough surfaces range over decades
    log = "y" if radii.size and radii.max() > 20 * radii.min() else ""
    labels: Look = {"title": "Asperity distribution", "x": HEIGHT, "y": RADIUS}
    return Chart(items=items, log=log, axes=axes, **labels)


def _marks(x: Floats, y: Floats, contact: ContactAtStep) -> list[Item]:
    """Return marks of summits by their state; a surface alone has one type of mark."""
    state = contact.state
    names = STATES if contact.flat else ("",) * 4
    separated = np.flatnonzero(state == SEPARATED)
    label = names[SEPARATED]
    count = separated.size
    if count > MOST_MARKS:
        # at random: every so many-th summit of a regular array would be another array
        separated = np.random.default_rng(0).choice(separated, MOST_MARKS, replace=False)
        label = f"{label or 'summit'} ({MOST_MARKS:,} of {count:,} drawn)"
    dots = {
        "color": NO_CONTACT,
        "markeredgewidth": 0,
        "rasterized": True,
        "marker": ".",
        "linestyle": "",
    }
    dots["ms"] = float(np.clip(120 / np.sqrt(max(separated.size, 1)), 0.9, 7.0))
    items: list[Item] = [Curve(x[separated], y[separated], label, dots)]
    marks: Look = {"edgecolors": INK, "linewidths": 0.35, "rasterized": True, "zorder": 3}
    marks["s"] = 16 if np.count_nonzero(state != SEPARATED) <= 500 else 7
    fills = [*zip((1, 2, 3), STATE_COLOURS[1:], names[1:], strict=True)]
    if (state == TOUCHING).any():
        fills.append((TOUCHING, "none", "touching, not recorded"))
    for value, fill, name in fills:
        items.append(
            Shape(
                "scatter",
                (x[state == value], y[state == value]),
                marks | {"c": fill, "label": name},
            )
        )
    return items


# percentile of the radii at the end of the axis: a few flat summits would leave all others at its
# foot
HIGHEST = 99.8
# extra width [mm] of summits side by side, and in one pair of axes
APART_WIDTH, JOINT_WIDTH = 90.0, 35.0


@PICTURES.register
@attrs.frozen(kw_only=True)
class SummitsPicture(Panel):
    """Radius over height of all summits of up to 8 surfaces, with means and standard deviations.

    Of a scenario they are those of the surface, or of the surfaces of its sweep. In Python: a dict
    of summits.

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
    def extra_width(self) -> float:
        """Extra width of several surfaces [mm]."""
        return APART_WIDTH if self.apart else JOINT_WIDTH

    def default_size(self, data: Any) -> Size:  # noqa: ARG002 - see the base class
        """Return both columns for surfaces side by side."""
        return TWO_COLUMNS if self.apart else 1.3 * COLUMN, 85.0

    def sheet(self, data: Summits | dict[str, Summits] | Sequence[Summits]) -> Sheet:
        """Return summits of one surface, or of several by their names."""
        surfaces: Any = {"summits": data} if isinstance(data, Summits) else data
        if not isinstance(surfaces, dict):
            surfaces = {f"surface {number + 1}": summits for number, summits in enumerate(surfaces)}
        summits: list[Summits] = list(surfaces.values())
        if not 1 <= len(summits) <= len(LINES):
            raise InputError(
                f"{count_text(len(summits), 'surface', 'surfaces')}; expected 1 to {len(LINES)}"
            )
        labels = self.resolve_labels([*surfaces], "surfaces")
        top = max(float(np.percentile(sample.radius, HIGHEST)) for sample in summits)
        units = choose_scale("m", top), choose_scale("m", *(sample.height for sample in summits))
        size = float(
            np.clip(120 / np.sqrt(max(sample.height.size for sample in summits)), 1.3, 5.0)
        )
        scatters = []
        for sample, label, (colour, *_) in zip(summits, labels, LINES, strict=False):
            means = f"$R$ {_mean(sample.radius, *units[0])}, $z$ {_mean(sample.height, *units[1])}"
            scatters.append(_scatter(sample, size, colour, f"{label}: {means} ({len(sample):,})"))
        axes = {"ylim": (0, 1.05 * top)}
        if self.apart:
            options: Look = {
                "share": "map",
                "axes": axes,
                "x": "height $z$ (m)",
                "y": RADIUS,
            }
            samples = zip("ABCDEFGH", scatters, labels, strict=False)
            charts = {
                letter: Chart(items=items, title=label, **options)
                for letter, items, label in samples
            }
        else:
            charts = {
                "A": Chart(
                    items=[item for items in scatters for item in items],
                    x=HEIGHT,
                    y=RADIUS,
                    axes=axes,
                )
            }
        beyond = sum(int(np.count_nonzero(sample.radius > 1.05 * top)) for sample in summits)
        notice = (
            f"{count_text(beyond, 'summit', 'summits')} with a larger radius lie above the axis"
            if beyond
            else ""
        )
        letters = "".join(charts)
        across = min(len(charts), 3)
        rows = ";".join(
            letters[k : k + across].ljust(across, ".") for k in range(0, len(letters), across)
        )
        note = "mean ± standard deviation (number of summits)"
        return Sheet(charts, narrow=rows, notices=(notice,), note=note)


def _scatter(summits: Summits, size: float, colour: str, name: str) -> list[Item]:
    height = summits.height
    radius = summits.radius
    dots = {
        "color": colour,
        "alpha": 0.7,
        "marker": ".",
        "linestyle": "",
        "ms": size,
        "mew": 0,
        "rasterized": True,
    }
    errors = (
        {"xerr": height.std(ddof=1), "yerr": radius.std(ddof=1)}
        if height.size > 1
        else {"xerr": None}
    )
    look = {
        "color": colour,
        "mec": "white",
        "mew": 0.5,
        "marker": "s",
        "ms": 4.5,
        "linewidth": 0.8,
        "zorder": 4,
    }
    return [
        Curve(height, radius, "", dots),
        Curve(height.mean(), radius.mean(), name, look, errors=errors),
    ]


def _mean(values: Floats, factor: float, unit: str) -> str:
    deviation = f" ± {values.std(ddof=1) * factor:.2f}" if values.size > 1 else ""
    return f"{values.mean() * factor:.2f}{deviation} {unit}"


@PICTURES.register
@attrs.frozen(kw_only=True)
class MapPicture(Panel):
    """The height map in colours, without its summits."""

    kind, of = "map", (SCENARIO, Surface)

    def sheet(self, data: Surface) -> Chart:
        """Return the heights, seen from above."""
        extent = (0.0, data.size[0], 0.0, data.size[1])
        return Chart(
            items=[Map(data.heights, extent, "height $z$ (m)", {"cmap": "viridis"})], **PLANE
        )


# percentile of the lost heights at the end of the colours: one spike would hide the rest
DEEPEST = 99.8
NOT_MEASURED = "#d9d9d6"
SHOWN = ("worn volume", "summits")  # lines of the summary above the picture


@PICTURES.register
@attrs.frozen(kw_only=True)
class BeforeAfterPicture(Titled):
    """Height lost between two maps of one area, with worn points and summits, and a section through both."""

    kind, of, size, own_figure = "before-after", (Registration,), (TWO_COLUMNS, 97.0), True

    def sheet(self, data: Registration) -> Sheet:
        """Return the difference of the maps, and the section along x with the greatest loss."""
        lost = np.where(data.worn, data.difference.heights, -math.inf)
        row = (
            int(np.unravel_index(np.argmax(lost), lost.shape)[1])
            if data.worn.any()
            else lost.shape[1] // 2
        )
        y = (row + 0.5) * data.difference.pixel_size[1]
        caption = "; ".join(f"{label} {text}" for label, text in data.summary() if label in SHOWN)
        return Sheet(
            {"M": _difference(data, y), "S": _section(data, row, y)},
            wide="MMMMMSSSS",
            subtitle=caption,
        )


def _difference(registration: Registration, section: float) -> Chart:
    import matplotlib as mpl

    difference = registration.difference
    lost = difference.heights
    size = difference.size
    pixel = np.array(difference.pixel_size)
    limit = max(float(np.nanpercentile(np.abs(lost), DEEPEST)), 3 * registration.noise) or 1e-9
    colours = mpl.colormaps[DIVERGING].with_extremes(bad=NOT_MEASURED)
    look = {"cmap": colours, "vmin": -limit, "vmax": limit}
    items: list[Item] = [Map(lost, (0.0, size[0], 0.0, size[1]), "height lost (m)", look, "both")]
    if registration.worn.any():
        x, y = (
            (np.arange(count) + 0.5) * side for count, side in zip(lost.shape, pixel, strict=True)
        )
        items.append(
            Shape(
                "contour",
                (x, y, registration.worn.T),
                {"levels": [0.5], "colors": INK, "linewidths": 0.5},
            )
        )
    for fate, marker, name in ((LOWERED, "v", "summit flattened"), (LOST, "x", "summit lost")):
        positions = registration.summit_place[registration.fate == fate] + 0.5 * pixel
        look = {
            "color": INK,
            "linestyle": "",
            "marker": marker,
            "ms": 3.5,
            "mfc": "none",
            "mew": 0.7,
        }
        x, y = positions.T
        items.append(Curve(x, y, name if positions.size else "", look))
    items.append(Shape("axhline", (section,), DASHED | {"linewidth": 0.7}))
    return Chart(items=items, title="Height lost", height=44.0, **PLANE)


def _section(registration: Registration, row: int, y: float) -> Chart:
    height_after = registration.after.heights[:, row]
    height_before = height_after + registration.difference.heights[:, row]
    x = (np.arange(height_after.size) + 0.5) * registration.difference.pixel_size[0]
    worn = {"where": registration.worn[:, row], "color": FAINT, "alpha": 0.35, "lw": 0}
    dashes = {"color": STATE_COLOURS[2], "linewidth": 0.9, "linestyle": (0, (4, 1.5))}
    items: list[Item] = [
        Shape("fill_between", (x, height_after, height_before), worn),
        Curve(x, height_before, "before", {"color": MARK, "linewidth": 0.9}),
        Curve(x, height_after, "after", dashes),
    ]
    title = f"Section at $y$ = {quantity_text(y, 'm', 3)}"
    return Chart(items=items, title=title, name="section", x="$x$ (m)", y="height (m)")
