"""Pictures of whatever has one."""

import inspect
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import attrs

from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.scenario.opening import Reading, opened
from historysim.scenario.scenario import Scenario

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.asperity import Asperity
    from historysim.contact.adhesion import Branch
    from historysim.measured.comparison import Comparison
    from historysim.measured.loop_table import LoopTable
    from historysim.measured.loops import Loops
    from historysim.measured.measurement import Measurement
    from historysim.measured.sliding import Sliding
    from historysim.results.plots.paper import Drawn, Place
    from historysim.scenario.fit import Fit
    from historysim.surfaces.heights import Surface

    Measured = Measurement | Loops | LoopTable | Sliding | Comparison | Fit
    Drawable = str | Path | xr.Dataset | Scenario | Surface | Measured | Asperity | AdheringAsperities | Branch


def plot(  # noqa: PLR0913 - one call for all that has a picture
    what: "Drawable | Sequence[str | Path | xr.Dataset]",
    *,
    picture: str | None = None,
    step: int | str | None = None,
    steps: "Sequence[int | str] | None" = None,
    across: str | None = None,
    labels: "Sequence[str]" = (),
    panels: "Sequence[str] | None" = None,
    adhesion: bool = False,
    asperity: int | None = None,
    size: tuple[float, float] | None = None,
    figure: "Figure | SubFigure | None" = None,
    ax: "Axes | None" = None,
    form: str | None = None,
    **reading: Unpack[Reading],
) -> "Drawn":
    """Draw a history, a surface, a scenario, loops, a comparison or an asperity, or a file of them.

    Each kind has a function of its own with more to choose: `plot_history`, `plot_surface`, `plot_loops`,
    `plot_comparison`, `plot_asperity`, `plot_swept`, `plot_adhesion_map`, `plot_adhesion_branch`.

    Parameters
    ----------
    what : path, xarray.Dataset, Scenario, Surface, Measurement, Loops, LoopTable, Sliding, Comparison, Fit, …
        Of a history: what ``[picture]`` of its scenario says, or else the friction loop, the loads, and the slip
        states. Of a scenario or a height map: the surface with its summits. Of a sweep: what ``[picture]`` says, or
        else a number of its cells over what was swept, or their loops over one another. Or several histories, or paths
        of them: their loops, or tractions, in one picture.
    picture : str, optional
        Of a history or a scenario: a name of `historysim.results.plots.pictures.PICTURES`, which ``historysim kinds
        plots`` lists. Of a sweep: also which number, by default the preliminary displacement.
    step : int, "partial" or "peak", optional
        Of a history, its contact map or asperity distribution at this step; at that where most can be seen, half of the
        contact area slipping; or at that of the greatest normal load. Negative ones count from the end.
    steps : sequence of int or str, optional
        Of "loops" and "traction", the states that are marked or drawn, by step or by the name of a waypoint.
    across : {"radius", "diameter"}, optional
        What a traction is drawn over.
    labels : sequence of str, optional
        Of "loops" and "traction", what the lines are called.
    panels : sequence of {"loop", "loads", "states", "energy", "wear"}, optional
        Of the picture "history", what to draw.
    adhesion : bool
        Of a scenario with ``[adhesion]``, the adhesion map with its asperities.
    asperity : int, optional
        With `adhesion`, the equilibria of this asperity in place of the map; of a history, whose traction is drawn.
    size : (float, float), optional
        Width and height of a new figure [mm].
    figure : Figure or SubFigure, optional
        Draw into this figure of matplotlib, or into this part of one.
    ax : Axes, optional
        Draw into these axes: what has one panel.
    form : str, optional
        What is taken off the height map of a file first; by default a plane.
    **reading
        What the height map of a file leaves open, as for `read_surface`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure.

    Raises
    ------
    InputError
        Something that has no picture, a file that cannot be used, or an option that does not fit what is drawn.

    Examples
    --------
    >>> figure = hs.plot("scenarios/12_textured_surface.toml")
    >>> figure.savefig("surface.png")
    """
    known = [name for name in inspect.signature(plot).parameters if name != "reading"]
    for name in reading:
        if name not in Reading.__annotations__:
            raise InputError(f"plot takes no {name!r}; {nearest(name, [*known, *Reading.__annotations__])}")
    place: Place = {"size": size, "figure": figure, "ax": ax}
    several = {"steps": steps, "across": across, "labels": tuple(labels) or None}
    lines = {name: value for name, value in several.items() if value is not None}
    options = _Options(picture, step, panels, adhesion, asperity, place, lines)
    if isinstance(what, list | tuple) and what and all(_is_result(each) for each in what):
        return _several(what, options)
    if isinstance(what, str | Path):
        with opened(what, form=form, **reading) as content:
            return _drawn(content, str(what), Path(what).name, options)
    if form is not None or reading:
        raise InputError("form, pixel_size, …: expected with the path of a height map alone, which is read with them")
    return _drawn(what, f"this {type(what).__name__}", "", options)


@attrs.frozen
class _Options:
    """What was chosen of a picture; see `plot`."""

    picture: str | None
    step: int | str | None
    panels: "Sequence[str] | None"
    adhesion: bool
    asperity: int | None
    place: "Place"
    lines: dict[str, Any]
    """Those of the pictures with several lines that were given: steps, across, labels."""


def _is_result(what: object) -> bool:
    import xarray as xr

    return isinstance(what, str | Path | xr.Dataset)


def _several(what: "Sequence[Any]", chosen: _Options) -> "Drawn":
    """Draw several histories in one picture."""
    import xarray as xr

    from historysim.results.plots.pictures import draw

    unused = {"step": chosen.step, "panels": chosen.panels, "adhesion": chosen.adhesion or None}
    if given := [name for name, value in unused.items() if value is not None]:
        raise InputError(f"{given[0]}: belongs to one file; expected pictures of several: loops or traction")
    with ExitStack() as open_files:
        histories = []
        for each in what:
            history = each if isinstance(each, xr.Dataset) else open_files.enter_context(opened(each))
            if not isinstance(history, xr.Dataset) or "total_normal_load" not in history:
                raise InputError(f"{each}: is no result of historysim run; expected results alone, or one other file")
            histories.append(history)
        options = chosen.lines | ({} if chosen.asperity is None else {"asperity": chosen.asperity})
        return draw(histories, chosen.picture or LOOPS, chosen.place, **options)


def _drawn(what: object, name: str, title: str, chosen: _Options) -> "Drawn":
    import xarray as xr

    from historysim.results.plots.pictures import PICTURES, SCENARIO, draw, figure_of
    from historysim.results.result_files import KINDS
    from historysim.results.written_table import WrittenTable

    if isinstance(what, xr.Dataset) and KINDS.get(str(what.attrs.get("content"))) == "table":
        what = WrittenTable.of(what, name)
    # the rows of a sweep may be loads, too
    history = isinstance(what, xr.Dataset) and "total_normal_load" in what and what.attrs.get("content") != "sweep"
    if chosen.step is not None and not history:
        raise InputError(f"step {chosen.step}: {name} has no steps; expected a result of historysim run")
    if chosen.panels is not None and not history:
        raise InputError(f"panels: {name} has none to choose; expected a result of historysim run")
    if chosen.lines and not isinstance(what, xr.Dataset):
        raise InputError(f"{next(iter(chosen.lines))}: {name} has no such lines; expected a result or a sweep")
    if chosen.picture is not None and not isinstance(what, xr.Dataset | Scenario):
        raise InputError(f"picture {chosen.picture}: {name} has one picture only; expected a result or a sweep")
    if chosen.adhesion and not isinstance(what, Scenario):
        raise InputError(f"adhesion: {name} is no scenario; expected a scenario with [adhesion]")
    if chosen.asperity is not None and not (chosen.adhesion or history):
        raise InputError(
            f"asperity {chosen.asperity}: expected with adhesion, to draw the equilibria of this asperity, or with the "
            "picture traction or slip-fronts of a result"
        )
    if isinstance(what, xr.Dataset):
        return _dataset(what, name, chosen)
    if not isinstance(what, Scenario):
        PICTURES.import_own()
        return figure_of(what, title=title, place=chosen.place, name=name)
    if chosen.adhesion:
        return _adhesion(what, chosen)
    if chosen.picture is not None:
        return draw(what, chosen.picture, chosen.place, of=SCENARIO)
    from historysim.scenario.figure import draw_figure, drawable

    pictures = drawable(what)
    return draw_figure(what, pictures, **chosen.place) if pictures else _ground(what, chosen)


def _first_quantity(sweep: "xr.Dataset") -> str:
    """Return what a sweep or its spread is mostly about, and of others, such as a design, the first number."""
    known = (name for name in ("preliminary_displacement", "preliminary_displacement_mean") if name in sweep)
    return next(known, str(next(iter(sweep.data_vars))))


def _with_deviation(spread: "xr.Dataset", mean: str, deviation: str, place: "Place") -> "Drawn":
    """Draw a mean that `historysim.spread` has given, with its standard deviation."""
    from historysim.results.plots.swept import plot_swept

    # under the name of what it is the mean of, which has words for its axis
    name = mean.removesuffix("_mean")
    text = str(spread[mean].attrs.get("long_name", name)).removeprefix("mean of: ")
    drawn = {
        name: spread[mean].assign_attrs(long_name=text),
        "lower": spread[mean] - spread[deviation],
        "upper": spread[mean] + spread[deviation],
    }
    title = "mean ± standard deviation"
    return plot_swept(spread.assign(drawn), name, ends={"y": ("lower", "upper")}, title=title, **place)


LOOPS = "loops"
"""The picture of loops over one another."""


def _sweep(what: "xr.Dataset", chosen: _Options) -> "Drawn":
    from historysim.results.plots.pictures import PICTURES, SWEEP, draw
    from historysim.results.plots.together import LOOP

    loops = all(name in what and "step" in what[name].dims for name in LOOP)
    numbers = [name for name in what.data_vars if not {"step", "asperity"} & set(what[name].dims)]
    picture = LOOPS if chosen.picture is None and loops and not numbers else chosen.picture
    # a number of the sweep is a picture, too
    if picture is not None and picture not in what.data_vars and picture in PICTURES:
        return draw(what, picture, chosen.place, of=SWEEP, **chosen.lines)
    if chosen.lines:
        raise InputError(f"{next(iter(chosen.lines))}: belongs to the picture {LOOPS} of a sweep; expected it")
    from historysim.results.plots.swept import plot_swept

    quantity = picture or _first_quantity(what)
    deviation = f"{quantity.removesuffix('_mean')}_standard_deviation"
    if quantity.endswith("_mean") and deviation in what:
        return _with_deviation(what, quantity, deviation, chosen.place)
    return plot_swept(what, quantity, **chosen.place)


def _dataset(what: "xr.Dataset", name: str, chosen: _Options) -> "Drawn":
    given = (chosen.picture, chosen.step, chosen.panels, chosen.asperity)
    if not chosen.lines and all(value is None for value in given):
        from historysim.scenario.figure import draw_figure, drawable

        if pictures := drawable(what):
            return draw_figure(what, pictures, **chosen.place)
    if what.attrs.get("content") == "sweep":
        return _sweep(what, chosen)
    if "total_normal_load" in what:
        return _history(what, chosen)
    if chosen.lines:
        raise InputError(f"{next(iter(chosen.lines))}: {name} has no such lines; expected a result or a sweep")
    if chosen.picture is not None:
        raise InputError(f"picture {chosen.picture}: {name} has one picture only; expected a result or a sweep")
    if "summit_height" in what:
        from historysim.results.plots.surface import plot_surface

        return plot_surface(what, **chosen.place)
    if "loop" in what.dims:
        from historysim.results.plots.loop_trends import plot_loop_trends

        return plot_loop_trends(what, **chosen.place)
    if "loops" in what.coords:
        from historysim.results.plots.loop_levels import plot_loop_levels

        return plot_loop_levels(what, **chosen.place)
    raise InputError(f"{name} is no history; expected a Dataset from historysim, with all its variables")


def _history(history: "xr.Dataset", chosen: _Options) -> "Drawn":
    from historysim.results.plots.pictures import draw

    name = chosen.picture or ("history" if chosen.step is None else "contact-map")
    one = {"step": chosen.step, "asperity": chosen.asperity, "panels": chosen.panels}
    given: dict[str, Any] = {option: value for option, value in one.items() if value is not None}
    return draw(history, name, chosen.place, **given, **chosen.lines)


def _ground(scenario: Scenario, chosen: _Options) -> "Drawn":
    from historysim.recording import surface_group
    from historysim.results.plots.surface import plot_surface

    built = scenario.surface()
    title = scenario.title or scenario.path.stem
    return plot_surface(surface_group.dataset(built.summits, built.surface), title=title, **chosen.place)


def _adhesion(scenario: Scenario, chosen: _Options) -> "Drawn":
    from historysim.results.plots.adhesion_branch import plot_adhesion_branch
    from historysim.results.plots.adhesion_map import plot_adhesion_map

    contact = scenario.build().adhering()
    if contact is None:
        raise InputError(
            f"{scenario.path}: has no [adhesion], or nothing touches; expected both to draw how adhesive it is"
        )
    if chosen.asperity is None:
        return plot_adhesion_map(contact.examples(), **chosen.place)
    branch = contact.branch(chosen.asperity)
    title = f"Equilibria of asperity {chosen.asperity} after {branch.model.label}"
    return plot_adhesion_branch(branch, title=title, **chosen.place)
