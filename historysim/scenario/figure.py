"""The figure of a scenario: its ``[picture]`` drawn from its result, its sweep, or its surfaces, panel by panel."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from historysim.basics import findings
from historysim.results.plots.pictures import HISTORY, SCENARIO, SWEEP, Picture
from historysim.results.sweeps import CONTENT
from historysim.scenario.document import parsed, pictures_of
from historysim.scenario.picture_kinds import Pictures
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import reported

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

PANEL, HEIGHT, TITLE = 90.0, 78.0, 8.0
"""Width and height of a panel, height of the title [mm]."""
ACROSS = 3
"""Panels in a row."""


def drawable(what: "xr.Dataset | Scenario") -> Pictures:
    """Return those pictures of a scenario that can be drawn of it, or of what came out; none where it has none."""
    if isinstance(what, Scenario):
        return tuple(each for each in what.sections.picture if SCENARIO in each.of)
    told = what.attrs.get("scenario")
    if not told:
        return ()
    content = SWEEP if what.attrs.get("content") == CONTENT else HISTORY
    # a picture of a package that is not there, say
    with reported("the scenario in the result: picture"):
        return tuple(each for each in pictures_of(parsed(str(told))) if content in each.of)


def draw_figure(
    what: "xr.Dataset | Scenario", pictures: Sequence[Picture], size: tuple[float, float] | None = None
) -> "Figure":
    """Return pictures of a result, a sweep or a scenario side by side, the title of the scenario above them.

    Raises
    ------
    InputError
        What the pictures need is not there, or their options do not fit.
    """
    from historysim.results.plots.paper import new_figure
    from historysim.results.plots.style import FAINT, plain_title

    if not pictures[0].fits_beside():
        return pictures[0].drawn(what, size)
    across = min(len(pictures), ACROSS)
    rows = -(-len(pictures) // across)
    width = PANEL * across + max(each.beside for each in pictures)
    title = what.title if isinstance(what, Scenario) else str(what.attrs.get("title", ""))
    with new_figure(size, (width, HEIGHT * rows + TITLE)) as figure:
        # also of one picture: what stands below it, and the line below all, are then told apart
        parts: Any = figure.subfigures(rows, across, squeeze=False).ravel()
        for part, picture in zip(parts, pictures, strict=False):
            picture.draw(part, what)
        figure.suptitle(plain_title(title, round(width * 0.6), 2), x=0.01, ha="left", fontsize=8.5)
        if told := "" if isinstance(what, Scenario) else _beyond(what):
            figure.supxlabel(told, x=0.99, ha="right", fontsize=6, color=FAINT)
    return figure


BEYOND = {
    "steep": "steep asperities",
    "yield": "pressures beyond yield",
    "area": "a large contact area",
    "overlap": "overlapping contacts",
    "adhesion": "adhesion",
    "outliers": "a few high summits",
}
"""What the findings of the checks are called in a line."""


def _beyond(what: "xr.Dataset") -> str:
    """Return in a line what of the model's assumptions does not hold, empty where all does."""
    names = [each.name for each in findings.read(str(what.attrs.get("validity", "[]"))) if each.name in BEYOND]
    return f"beyond the model's assumptions: {', '.join(BEYOND[name] for name in names)}" if names else ""
