"""Pictures of what is found of whole height maps: what a place has lost, and its contact area by the laws in use."""

import math
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats
from historysim.basics.units import quantity_text, range_text
from historysim.contact.materials import MaterialPair
from historysim.interaction.areas import area_laws
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, Canvas
from historysim.results.plots.pictures import PICTURES, SCENARIO, Titled
from historysim.results.plots.style import DIVERGING, FAINT, INK, MARK, STATE_COLOURS, draw_image, line_style, scale_of
from historysim.surfaces.heights import Surface
from historysim.surfaces.registration import LOST, LOWERED, Registration

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEEPEST = 99.8  # percentile of the heights lost up to which colours reach: a single spike would hide the rest
NOT_THERE = "#d9d9d6"
SHOWN = ("worn volume", "summits")  # lines of the summary that stand above the picture


@PICTURES.register
@attrs.frozen(kw_only=True)
class BeforeAfterPicture(Titled):
    """What a place has lost between two height maps, with its worn points and summits, and a section through both."""

    kind, of, size, alone = "before-after", (Registration,), (TWO_COLUMNS, 97.0), True

    def draw(self, canvas: Canvas, data: Registration) -> None:
        """Draw the difference of the maps, and the section along x where the most is lost."""
        axes, beside = canvas.two(("height lost", "section"), 1.1, stacked=1.6)
        _draw_difference(axes, data)
        if beside is not None:
            _draw_section(axes, beside, data)
        canvas.legend(*(each for each in (axes, beside) if each is not None))
        canvas.heading(self.title, "; ".join(f"{label} {text}" for label, text in data.summary() if label in SHOWN))


def _draw_difference(axes: "Axes", found: Registration) -> None:
    import matplotlib as mpl

    lost = found.difference.heights
    (factor, height_unit), (along, unit) = scale_of("m", lost), scale_of("m", found.difference.size)
    most = max(float(np.nanpercentile(np.abs(lost), DEEPEST)), 3 * found.noise) * factor or 1.0
    extent = (0.0, found.difference.size[0] * along, 0.0, found.difference.size[1] * along)
    colours = mpl.colormaps[DIVERGING].with_extremes(bad=NOT_THERE)
    image = draw_image(axes, lost * factor, extent, cmap=colours, vmin=-most, vmax=most)
    axes.figure.colorbar(image, ax=axes, shrink=0.8, extend="both", label=f"height lost ({height_unit})")
    x, y = (
        (np.arange(count) + 0.5) * pixel * along
        for count, pixel in zip(lost.shape, found.difference.pixel_size, strict=True)
    )
    if found.worn.any():
        axes.contour(x, y, found.worn.T, levels=[0.5], colors=[INK], linewidths=0.5)
    for fate, marker, name in ((LOWERED, "v", "summit flattened"), (LOST, "x", "summit lost")):
        there = (found.summit_place[found.fate == fate] + 0.5 * np.array(found.difference.pixel_size)) * along
        looks: dict[str, Any] = {"color": INK, "linestyle": "", "marker": marker, "ms": 3.5, "mfc": "none", "mew": 0.7}
        axes.plot(*there.T, label=name if there.size else None, **looks)
    axes.spines[["top", "right"]].set_visible(True)
    axes.set(title="Height lost", xlabel=f"$x$ ({unit})", ylabel=f"$y$ ({unit})")


def _draw_section(map_axes: "Axes", axes: "Axes", found: Registration) -> None:
    lost = np.where(found.worn, found.difference.heights, -math.inf)
    row = int(np.unravel_index(np.argmax(lost), lost.shape)[1]) if found.worn.any() else lost.shape[1] // 2
    after = found.after.heights[:, row]
    before = after + found.difference.heights[:, row]
    (height, height_unit), (along, unit) = scale_of("m", before), scale_of("m", found.difference.size)
    pixel = found.difference.pixel_size
    x = (np.arange(after.size) + 0.5) * pixel[0] * along
    axes.fill_between(x, after * height, before * height, where=found.worn[:, row], color=FAINT, alpha=0.35, lw=0)
    axes.plot(x, before * height, color=MARK, linewidth=0.9, label="before")
    axes.plot(x, after * height, color=STATE_COLOURS[2], linewidth=0.9, linestyle=(0, (4, 1.5)), label="after")
    at = (row + 0.5) * pixel[1]
    map_axes.axhline(at * along, color=FAINT, linewidth=0.7, linestyle=(0, (4, 2)))
    title = f"Section at $y$ = {quantity_text(at, 'm', 3)}"
    axes.set(title=title, xlabel=f"$x$ ({unit})", ylabel=f"height ({height_unit})")


@attrs.frozen(eq=False)
class PressedMap:
    """A height map, the pair of materials, the loads at which its contact area is drawn [N], and a hardness [Pa]."""

    surface: Surface
    pair: MaterialPair
    normal_load: Floats
    hardness: float | None


@PICTURES.register
@attrs.frozen(kw_only=True)
class AreaLawsPicture(Titled):
    """Real contact area of a map over the normal load by the laws in use, bold where each holds, within 20 %.

    The laws stand beside the summits of the map and its fully interacting solution; `hs.area_laws` has the numbers.
    Loads go up to the greatest of the scenario.

    Attributes
    ----------
    whole_map
        Solve the whole map, which takes seconds to minutes. Without it no law is said to hold.
    """

    whole_map: bool = True

    kind, of, size, alone = "area-laws", (PressedMap, SCENARIO), (1.4 * COLUMN, 105.0), True

    def draw(self, canvas: Canvas, data: PressedMap) -> None:
        """Draw a line for each law."""
        found = area_laws(data.surface, data.pair, data.normal_load, hardness=data.hardness, whole_map=self.whole_map)
        load, area = found["normal_load"].values, found["real_contact_area"].values
        factor, unit = scale_of("N", load)
        axes = canvas.axes()
        for number, law in enumerate(str(each) for each in found["law"].values):
            looks = line_style(number, found.sizes["law"])
            if law == "whole map":
                looks |= {"color": INK, "linestyle": "-", "linewidth": 2.0}
            holds = found["holds"].values[number] if "holds" in found else np.ones(load.size, dtype=bool)
            label = law
            if "holds" in found and law != "whole map":
                label += f": {_ranges(load, holds)}"
            axes.plot(load * factor, area[number] * 1e12, **looks | {"alpha": 0.45, "linewidth": 0.8})
            bold = np.where(holds, area[number] * 1e12, math.nan)
            axes.plot(load * factor, bold, label=label, **looks)
        axes.set(xscale="log", yscale="log", xlabel=f"normal load ({unit})", ylabel="real contact area (µm²)")
        canvas.legend(axes)
        caption = "Bold and named: where within 20 % of the whole map; Bowden–Tabor: pressures beyond hardness."
        canvas.heading(self.title, caption if "holds" in found else "")


def _ranges(load: Floats, holds: Booleans) -> str:
    """Return the loads between which a law holds."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]))).reshape(-1, 2)
    return " and ".join(range_text(float(load[first]), float(load[end - 1]), "N") for first, end in ends) or "nowhere"
