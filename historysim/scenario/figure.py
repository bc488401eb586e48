"""The ``[picture]`` of a scenario, drawn from the scenario or its result."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from historysim.basics.wording import silent
from historysim.errors import InputError
from historysim.results.plots.pictures import HISTORY, PICTURES, SCENARIO, SWEEP, draw, draw_figure, make_figure
from historysim.scenario.document import parse_toml, structure_pictures
from historysim.scenario.run import run
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import located_errors
from historysim.scenario.sections import Pictures

if TYPE_CHECKING:
    from historysim.results.plots.canvas import FigureOrAxes, Place


def drawable(content: xr.Dataset | Scenario) -> Pictures:
    """Return the pictures of a scenario that can be drawn from the scenario or its result."""
    if isinstance(content, Scenario):
        return tuple(picture for picture in content.sections.picture if SCENARIO in picture.of)
    text = content.attrs.get("scenario")
    if not text:
        return ()
    file_content = SWEEP if content.attrs.get("content") == SWEEP else HISTORY
    # e.g. a picture of a package that is not installed
    with located_errors("the scenario in the result: picture"):
        return tuple(picture for picture in structure_pictures(parse_toml(str(text))) if file_content in picture.of)


def draw_scenario_figure(
    content: xr.Dataset | Scenario, pictures: Pictures, target: "Place | None" = None
) -> "FigureOrAxes":
    """Draw the pictures of a scenario or its result, with its title."""
    title = content.title if isinstance(content, Scenario) else str(content.attrs.get("title", ""))
    return draw_figure(content, pictures, title, target)


@make_figure.register(Scenario)
def _draw_scenario(
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
            raise InputError(f"{scenario.path}: picture {kind}: has [sweep]; expected a result of historysim sweep")
        # the surface is stored in the file of the history
        with (
            tempfile.TemporaryDirectory() as folder,
            run(scenario, Path(folder) / "result.nc", progress=True, notify=silent) as history,
        ):
            return draw(history, kind, target, **options)
    if kind in {"surface", "record"}:
        options.setdefault("title", scenario.title or scenario.path.stem)
    return draw(scenario, kind, target, of=SCENARIO, **options)
