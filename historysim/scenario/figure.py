"""The figure of a scenario: its ``[picture]`` drawn from its result, its sweep, or its surfaces, panel by panel."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

from historysim.basics import findings
from historysim.results.plots.pictures import HISTORY, SCENARIO, SWEEP, Picture
from historysim.results.sweeps import CONTENT
from historysim.scenario.document import parsed, pictures_of
from historysim.scenario.picture_kinds import Pictures
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import reported

if TYPE_CHECKING:
    import xarray as xr

    from historysim.results.plots.paper import Drawn, Place

PANEL, HEIGHT, TITLE = 90.0, 78.0, 8.0
"""Width and height of a panel, height of the title [mm]."""
ACROSS, NARROWEST = 3, 55.0
"""Panels in a row, and the width that each has at least [mm]."""


def drawable(what: "xr.Dataset | Scenario") -> Pictures:
    """Return those pictures of a scenario that can be drawn of it, or of what came out; none where it has none."""
    if isinstance(what, Scenario):
        return tuple(each for each in what.sections.picture if SCENARIO in each.of)
    text = what.attrs.get("scenario")
    if not text:
        return ()
    content = SWEEP if what.attrs.get("content") == CONTENT else HISTORY
    # a picture of a package that is not there, say
    with reported("the scenario in the result: picture"):
        return tuple(each for each in pictures_of(parsed(str(text))) if content in each.of)


def draw_figure(what: "xr.Dataset | Scenario", pictures: Sequence[Picture], **place: "Unpack[Place]") -> "Drawn":
    """Return pictures of a result, a sweep or a scenario side by side, the title of the scenario above them.

    Parameters
    ----------
    what : xarray.Dataset or Scenario
    pictures : sequence of pictures
    **place
        ``size`` [mm], ``figure`` or, of one picture, ``ax``; see `Place`. In a narrow figure they stand below one
        another.

    Raises
    ------
    InputError
        What the pictures need is not there, or their options do not fit; or they are too many for the size.
    """
    from historysim.results.plots.paper import paper

    across = min(len(pictures), ACROSS)
    width = PANEL * across + max(each.beside for each in pictures)
    with paper(draw_figure, (width, HEIGHT * -(-len(pictures) // across) + TITLE), place) as page:
        if page.given is not None and len(pictures) == 1:
            pictures[0].draw(page, what)
            return page.drawn
        figure = page.several(len(pictures))
        across = min(across, max(int(page.width / NARROWEST), 1))
        # also of one picture: what stands below it, and the line below all, are then told apart
        parts: Any = figure.subfigures(-(-len(pictures) // across), across, squeeze=False).ravel()
        for part, picture in zip(parts, pictures, strict=False):
            picture.draw(page.part(part), what)
        page.heading(what.title if isinstance(what, Scenario) else str(what.attrs.get("title", "")))
        if note := "" if isinstance(what, Scenario) else _beyond(what):
            page.foot(note)
    return page.drawn


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
