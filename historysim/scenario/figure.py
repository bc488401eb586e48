"""The ``[picture]`` of a scenario, drawn from the scenario or its result."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from historysim.basics.wording import silent
from historysim.errors import InputError
from historysim.results.plots.pictures import (
    HISTORY,
    PICTURES,
    SCENARIO,
    SWEEP,
    draw,
    draw_figure,
    make_figure,
)
from historysim.scenario.document import parse_toml, structure_pictures
from historysim.scenario.run import run
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import from_table, located_errors
from historysim.scenario.sections import Pictures, Sections

if TYPE_CHECKING:
    from historysim.results.plots.canvas import FigureOrAxes, Place

IN_RESULT = "the scenario in the result"


def drawable(content: xr.Dataset | Scenario) -> Pictures:
    """Return the pictures of a scenario that can be drawn from the scenario or its result with its scenario."""
    if isinstance(content, Scenario):
        return tuple(picture for picture in content.sections.picture if SCENARIO in picture.of)
    text = content.attrs.get("scenario")
    if not text:
        return ()
    # e.g. a picture of a package that is not installed
    with located_errors(f"{IN_RESULT}: picture"):
        pictures = structure_pictures(parse_toml(str(text)))
    return tuple(
        picture for picture in pictures if {_content_type(content), SCENARIO} & {*picture.of}
    )


def _content_type(content: xr.Dataset) -> str:
    return SWEEP if content.attrs.get("content") == SWEEP else HISTORY


def draw_scenario_figure(
    content: xr.Dataset | Scenario,
    pictures: Pictures,
    target: "Place | None" = None,
    *,
    scenario: Scenario | None = None,
) -> "FigureOrAxes":
    """Draw the pictures of a scenario or its result, with its title.

    Pictures of the scenario itself, such as its height map, are drawn from `scenario`, by default
    the text in the result; InputError if files that it names are not found.
    """
    if isinstance(content, Scenario):
        return draw_figure([content] * len(pictures), pictures, content.title, target)
    subjects: list[xr.Dataset | Scenario] = []
    for picture in pictures:
        if _content_type(content) in picture.of:
            subjects.append(content)
        else:
            scenario = scenario or _embedded_scenario(content, picture.kind)
            subjects.append(scenario)
    return draw_figure(subjects, pictures, str(content.attrs.get("title", "")), target)


def _embedded_scenario(content: xr.Dataset, kind: str) -> Scenario:
    """Return the scenario whose text a result holds; the files that it names are expected from the result's folder."""
    text, result = str(content.attrs["scenario"]), Path(str(content.encoding.get("source", "")))
    with located_errors(IN_RESULT):
        scenario = Scenario(result.parent / IN_RESULT, text, from_table(Sections, parse_toml(text)))
    for file in scenario.files[1:]:
        if not file.exists():
            raise InputError(
                f"{IN_RESULT}: picture {kind}: {file} is not there; expected the scenario's own file: "
                "historysim plot SCENARIO.toml"
            )
    return scenario


@make_figure.register(Scenario)
def _draw_scenario(
    scenario: Scenario,
    *,
    picture: str | None = None,
    target: "Place | None" = None,
    name: str = "",  # noqa: ARG001 - a scenario knows its own path
    **options: Any,  # noqa: ANN401 - fields of pictures
) -> "FigureOrAxes":
    """Draw the ``[picture]`` of a scenario, by default its surface and summits."""
    if picture is None and not options and (pictures := drawable(scenario)):
        return draw_scenario_figure(scenario, pictures, target)
    kind = picture or "surface"
    if kind in PICTURES and HISTORY in PICTURES[kind].of and SCENARIO not in PICTURES[kind].of:
        if scenario.sections.sweep is not None:
            raise InputError(
                f"{scenario.path}: picture {kind}: has [sweep]; expected a result of historysim sweep"
            )
        # the surface is stored in the file of the history
        with (
            tempfile.TemporaryDirectory() as folder,
            run(scenario, Path(folder) / "result.nc", progress=True, notify=silent) as history,
        ):
            return draw(history, kind, target, **options)
    if kind in {"surface", "record"}:
        options.setdefault("title", scenario.title or scenario.path.stem)
    return draw(scenario, kind, target, of=SCENARIO, **options)
