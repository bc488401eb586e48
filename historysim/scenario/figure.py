"""The figure of a scenario: its ``[picture]`` drawn from its result, its sweep, or its surfaces, panel by panel."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs

from historysim.basics import findings
from historysim.results.sweeps import CONTENT
from historysim.scenario.document import parsed, pictures_of
from historysim.scenario.picture_kinds import (
    AnyPicture,
    BarsPicture,
    CurvePicture,
    LoopsPicture,
    MapPicture,
    Pictures,
    SummitsPicture,
    TractionPicture,
)
from historysim.scenario.points import at_point
from historysim.scenario.scenario import Scenario

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure, SubFigure

    from historysim.surfaces.summits import Summits

OF_A_HISTORY, OF_A_SWEEP, OF_A_SCENARIO = (
    (LoopsPicture, TractionPicture),
    (LoopsPicture, CurvePicture, BarsPicture),
    (SummitsPicture, MapPicture),
)
"""Which pictures can be drawn of a result, of a sweep, and of a scenario that was not run."""
PANEL, HEIGHT, LOADS, SUMMITS, TITLE = 90.0, 78.0, 50.0, 35.0, 8.0
"""Width and height of a panel, what loads beside a loop and summits add to its width, height of the title [mm]."""
TRACTION = ("across", "limit", "fronts", "change_from", "labels", "title")
"""Options that a picture of tractions hands on."""
ACROSS = 3
"""Panels in a row."""


def drawable(what: "xr.Dataset | Scenario") -> Pictures:
    """Return those pictures of a scenario that can be drawn of it, or of what came out; none where it has none."""
    if isinstance(what, Scenario):
        return tuple(each for each in what.sections.picture if isinstance(each, OF_A_SCENARIO))
    told = what.attrs.get("scenario")
    if not told:
        return ()
    kinds = OF_A_SWEEP if what.attrs.get("content") == CONTENT else OF_A_HISTORY
    return tuple(each for each in pictures_of(parsed(str(told))) if isinstance(each, kinds))


def draw_figure(
    what: "xr.Dataset | Scenario", pictures: Sequence[AnyPicture], size: tuple[float, float] | None = None
) -> "Figure":
    """Return pictures of a result, a sweep or a scenario side by side, the title of the scenario above them.

    Raises
    ------
    InputError
        What the pictures need is not there, or their options do not fit.
    """
    from historysim.results.plots.paper import new_figure
    from historysim.results.plots.style import FAINT, plain_title

    across = min(len(pictures), ACROSS)
    rows = -(-len(pictures) // across)
    extra = LOADS if any(isinstance(each, LoopsPicture) and each.loads for each in pictures) else 0.0
    extra += max((PANEL if each.apart else SUMMITS for each in pictures if isinstance(each, SummitsPicture)), default=0)
    width = PANEL * across + extra
    title = what.title if isinstance(what, Scenario) else str(what.attrs.get("title", ""))
    with new_figure(size, (width, HEIGHT * rows + TITLE)) as figure:
        # also of one picture: what stands below it, and the line below all, are then told apart
        parts: Any = figure.subfigures(rows, across, squeeze=False).ravel()
        for part, picture in zip(parts, pictures, strict=False):
            _draw(part, what, picture)
        figure.suptitle(plain_title(title, round(width * 0.6), 2), x=0.01, ha="left", fontsize=8.5)
        if told := "" if isinstance(what, Scenario) else _beyond(what):
            figure.supxlabel(told, x=0.99, ha="right", fontsize=6, color=FAINT)
    return figure


def _draw(figure: "Figure | SubFigure", what: Any, picture: AnyPicture) -> None:
    match picture:
        case LoopsPicture():
            from historysim.results.plots.swept_cells import cells_of
            from historysim.results.plots.together import LOOP, LoopMarks, draw_together

            own = attrs.fields_dict(LoopMarks)
            marks = LoopMarks(**{name: getattr(picture, name) for name in own})
            cells = cells_of(what, LOOP, picture.labels, picture.where)
            draw_together(figure, cells, marks, picture.title)
        case TractionPicture():
            from historysim.results.plots.traction_profile import draw_traction

            options = {name: getattr(picture, name) for name in TRACTION}
            draw_traction(figure, [what], picture.asperity, picture.steps, **options)
        case SummitsPicture():
            from historysim.results.plots.summit_scatter import draw_summit_scatter

            found = _summits(what)
            labels = picture.labels or tuple(found)
            draw_summit_scatter(figure, list(found.values()), labels, apart=picture.apart, title=picture.title)
        case MapPicture():
            from historysim.results.plots.summit_scatter import draw_heights

            draw_heights(figure, _map(what), picture.title)
        case CurvePicture():
            from historysim.results.plots.swept import draw_swept
            from historysim.results.plots.swept_cells import selected

            names = ("each", "spread", "fit", "logarithmic", "labels", "title")
            options = {name: getattr(picture, name) for name in names}
            draw_swept(figure, selected(what, picture.where), picture.quantity, picture.over, **options)
        case BarsPicture():
            from historysim.results.plots.swept import draw_bars
            from historysim.results.plots.swept_cells import selected

            chosen = selected(what, picture.where)
            draw_bars(figure, chosen, picture.quantity, picture.groups, picture.title)


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


def _map(scenario: Scenario) -> Any:
    from historysim.errors import InputError

    surface = scenario.surface().surface
    if surface is None:
        raise InputError(f"{scenario.path.name}: picture: the surface is no height map; expected one for the kind map")
    return surface


def _summits(scenario: Scenario) -> "dict[str, Summits]":
    """Return the summits of the surface, or of those of the sweep, by what each is called."""
    from historysim.errors import InputError

    section = scenario.sections.sweep
    points: list[Mapping[str, Any]] = [{}] if section is None else list(section.grid().points())
    found: dict[str, Summits] = {}
    for point in points:
        summits = at_point(scenario, point).surface().summits
        if summits is None:
            raise InputError(f"{scenario.path.name}: picture: the surface has no summits; expected one that has")
        found[", ".join(_said(key, value) for key, value in point.items()) or "summits"] = summits
    return found


def _said(key: str, value: Any) -> str:
    from historysim.results.plots.words import WORDS

    words, sign = WORDS.get(key.rsplit(".", 1)[-1], (key, ""))
    return f"{sign} = {value}" if sign else f"{words} {value}"
