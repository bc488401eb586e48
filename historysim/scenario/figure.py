"""The ``[picture]`` of a scenario, drawn of it or of its result."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from historysim.basics.wording import silent
from historysim.errors import InputError
from historysim.results.plots.pictures import HISTORY, PICTURES, SCENARIO, SWEEP, draw, draw_figure, figure_of
from historysim.scenario.document import parsed, pictures_of
from historysim.scenario.run import run
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import reported
from historysim.scenario.sections import Pictures

if TYPE_CHECKING:
    from historysim.results.plots.canvas import FigureOrAxes, Place


def drawable(what: xr.Dataset | Scenario) -> Pictures:
    """Return those pictures of a scenario that can be drawn of it, or of its result; none where it has none."""
    if isinstance(what, Scenario):
        return tuple(each for each in what.sections.picture if SCENARIO in each.of)
    text = what.attrs.get("scenario")
    if not text:
        return ()
    content = SWEEP if what.attrs.get("content") == SWEEP else HISTORY
    # a picture of a package that is not there, say
    with reported("the scenario in the result: picture"):
        return tuple(each for each in pictures_of(parsed(str(text))) if content in each.of)


def draw_scenario_figure(
    what: xr.Dataset | Scenario, pictures: Pictures, target: "Place | None" = None
) -> "FigureOrAxes":
    """Return the pictures of a scenario, drawn of it or of its result, below its title."""
    title = what.title if isinstance(what, Scenario) else str(what.attrs.get("title", ""))
    return draw_figure(what, pictures, title, target)


@figure_of.register(Scenario)
def _of_scenario(
    scenario: Scenario,
    *,
    picture: str | None = None,
    target: "Place | None" = None,
    name: str = "",  # noqa: ARG001 - a scenario knows its own path
    adhesion: bool = False,
    **options: Any,  # noqa: ANN401 - fields of pictures
) -> "FigureOrAxes":
    """Draw the ``[picture]`` of a scenario, by default its surface and summits; with `adhesion` the adhesion map."""
    if picture is None and not adhesion and not options and (pictures := drawable(scenario)):
        return draw_scenario_figure(scenario, pictures, target)
    kind = picture or ("adhesion-map" if adhesion else "surface")
    if kind in PICTURES and HISTORY in PICTURES[kind].of and SCENARIO not in PICTURES[kind].of:
        if scenario.sections.sweep is not None:
            raise InputError(f"{scenario.path}: picture {kind}: has [sweep]; expected what historysim sweep writes")
        # the surface stands in a file beside the history
        with (
            tempfile.TemporaryDirectory() as folder,
            run(scenario, Path(folder) / "result.nc", progress=True, notify=silent) as history,
        ):
            return draw(history, kind, target, **options)
    if kind in {"surface", "record"}:
        options.setdefault("title", scenario.title or scenario.path.stem)
    return draw(scenario, kind, target, of=SCENARIO, **options)
