"""Verbs for any object or its file: `hs.open`, `hs.show`, `hs.plot`, `hs.report`, `hs.explore`.

A type supports them by a method ``summary`` and by implementations registered with `make_figure`
and `render_page`. Heavy packages are imported only if needed: `show` of a result does not import
xarray.
"""

import contextlib
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import attrs

from historysim.basics.files import as_path, is_netcdf, kind_text
from historysim.basics.wording import Lines, brief, list_names, shell_word
from historysim.errors import InputError
from historysim.results.history_view import History, is_dataset
from historysim.results.result_files import (
    CALLED,
    FILES,
    KINDS,
    file_type,
    open_file_history,
    open_history,
    open_zarr_history,
    read_table,
    report_damage,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from historysim.log.event_log import EventLog
    from historysim.measured.sliding import Sliding
    from historysim.results.plots.canvas import FigureOrAxes, Place, Size
    from historysim.scenario.scenario import Scenario
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.registration import Registration

    Content = Scenario | EventLog | xr.Dataset | Sliding | Surface

HISTORIES: "Mapping[str, Callable[[Path], xr.Dataset]]" = {
    "result": open_history,
    "zarr": open_zarr_history,
}
MOST_CHANNELS = 40  # columns of a record; a height map has as many as points
MAP_ALONE = "only apply to the path of a height map; expected such a path, or none of them"


class Reading(TypedDict, total=False):
    """Properties of a height map that its file may lack: arguments of `read_surface`."""

    pixel_size: float | str | tuple[float | str, float | str]
    height_unit: str
    lateral_unit: str
    channel: int | str
    missing: "float | str | Sequence[float | str]"


def open(  # noqa: A001 - as users of xarray and of files call it
    path: str | Path,
    *,
    form: str | None = None,
    chunks: "Mapping[str, int] | str | None" = None,
    **reading: Unpack[Reading],
) -> "Content":
    """Open any file that historysim knows: ``hs.open("my.nc").contact.slides_first()``.

    Parameters
    ----------
    path : path
        A scenario, a log, a result (netCDF or zarr), friction loops, friction over time or
        distance, a sweep, a table of a query (netCDF), a reduced model (JSON), or a height map.
    form : str, optional
        Form removed from a height map, as by `Surface.detrended`; by default a plane.
    chunks : mapping or "auto", optional
        Open a log or a result as a history of dask arrays, with these numbers of steps and
        asperities in a chunk, such as ``{"step": 1000, "asperity": 100_000}``. Variables of
        asperities are read from a result that contains them, and otherwise computed from the log on
        access. Requires dask (``pip install "historysim[dask]"``).
    **reading
        Properties that the file of a height map lacks, as for `read_surface`.

    Returns
    -------
    Scenario, EventLog, xarray.Dataset, Sliding, ReducedModel or Surface
        A result is read lazily; results and logs are closed by ``close()`` or at the end of a
        ``with`` block.

    Raises
    ------
    InputError
        The file does not exist or cannot be used, or options of a height map are given for another
        file.

    Examples
    --------
    >>> history = hs.run("scenarios/04_normal_up_tangential_up.toml", "up.nc")
    >>> hs.open("up.nc").sizes["step"]
    121
    """
    path = as_path(path)
    kind = file_type(path)
    if chunks is not None and kind not in {"log", "result", "zarr"}:
        called = CALLED.get(kind, f"a {kind}")
        raise InputError(
            f"chunks: {path} is {called}; expected a log or a result, whose history has chunks"
        )
    if kind == "height map":
        return _height_map(path, form or "plane", **reading)
    _check_reading(path, kind, form, reading)
    if chunks is not None:
        return _open_chunked(path, kind, chunks)
    if kind in HISTORIES:
        return HISTORIES[kind](path)
    if kind == "log":
        from historysim.log.event_log import EventLog

        return EventLog(path)
    if kind == "scenario":
        from historysim.scenario.scenario import load

        return load(path)
    content: Content = _read_whole(path, kind)
    return content


def _check_reading(path: Path, kind: str, form: str | None, reading: Reading) -> None:
    """Check that no options of a height map are given for a file of another type."""
    if unused := ([] if form is None else ["form"]) + list(reading):
        called = CALLED.get(kind, f"a {kind}")
        raise InputError(
            f"{', '.join(unused)}: {path} is {called}; expected a height map for these options"
        )


def _open_chunked(path: Path, kind: str, chunks: "Mapping[str, int] | str") -> "xr.Dataset":
    """Open a history as dask arrays: read from a result that holds asperities, and otherwise computed from its log."""
    from historysim.log.lazy_history import open_lazily, with_chunks

    if kind != "log":
        history = HISTORIES[kind](path)
        if "asperity" in history.sizes or kind == "zarr":
            return with_chunks(history, chunks)
        history.close()
    return open_lazily(path, chunks=chunks)


def _read_whole(path: Path, kind: str) -> Any:  # noqa: ANN401 - registered kinds of files have their own types
    """Read a file whose content fits into memory: loops, friction over time, a sweep, a table, or a registered kind."""
    if kind not in CALLED:
        return FILES[kind].read(path)
    if kind == "sliding":
        from historysim.measured.sliding import Sliding

        return Sliding.from_dataset(read_table(path))
    return read_table(path)


@contextlib.contextmanager
def open_content(
    path: str | Path, *, form: str | None = None, **reading: Unpack[Reading]
) -> "Iterator[Content]":
    """Open any file that historysim knows, and close it when the block ends; parameters and errors as for `open`."""
    content: Any = open(path, form=form, **reading)
    with (
        content if hasattr(content, "__exit__") else contextlib.nullcontext(),
        report_damage(Path(path)),
    ):
        yield content


def _height_map(path: Path, form: str, **reading: Unpack[Reading]) -> "Surface":
    from historysim.basics.arguments import representable
    from historysim.surfaces.reading import read_surface

    try:
        surface = read_surface(path, **reading)
    except InputError as error:
        read_so = "read as a height map: neither named .toml nor a result of historysim run"
        raise InputError(
            _no_map(path, is_described=bool(reading)) or f"{error} ({read_so})"
        ) from error
    with representable():
        return surface.detrended(form)


def _no_map(path: Path, *, is_described: bool) -> str:
    """Describe a file that is not a height map but a picture or a record; empty if it may be a height map.

    A list of points may be a map: one of x and z only if lengths or units are ``given``, or its
    columns name them.
    """
    from historysim.surfaces.map_files import find_coordinates
    from historysim.tables import describe

    if (kind := kind_text(path)) == "is a picture":
        return f"{path}: {kind}; expected a scenario, a result, a log, a sweep or a height map"
    if is_netcdf(path):
        return ""
    points = find_coordinates(path)
    if points and (is_described or points.evident or path.suffix.lower() == ".xyz"):
        return ""
    with contextlib.suppress(InputError):
        listings = describe(path)
        names = [listing.column for listing in listings]
        # a record has few columns, with names, or far more rows than columns;
        # texts and large matrices have no number of values
        count = listings[0].values.replace(",", "") if listings else ""
        long = count.isdecimal() and int(count) > MOST_CHANNELS * len(names)
        if 1 < len(names) <= MOST_CHANNELS and (long or not names[0].startswith("{")):
            seen = list_names(names)
            command = f"historysim columns {shell_word(path)}"
            record = (
                f"{path}: is a record with the columns {seen}, not a height map; expected {command}"
            )
            if path.suffix.lower() == ".csv":
                record += "; a table of historysim is read as netCDF (-o NAME.nc)"
            return (
                f"{record}, or of the points of a profile height_unit and lateral_unit"
                if points
                else record
            )
    return ""


def show(
    what: object, *, form: str | None = None, attributes: bool = False, **reading: Unpack[Reading]
) -> Lines:
    """Summarise a scenario, result, log or height map (object or path).

    Parameters
    ----------
    what : path, xarray.Dataset, Scenario, EventLog or Surface
        Two height maps of one area, or their paths, in a list: the material lost between them
        (`register_maps`).
    form : str, optional
        Form removed from the height map of a file first; by default a plane.
    attributes : bool
        Append the attributes of a result: digests, versions, conventions.
    **reading
        Properties that the file of a height map lacks, as for `read_surface`.

    Returns
    -------
    Lines
        Labels and texts, printed in two columns.

    Raises
    ------
    InputError
        An unsupported object, a file that cannot be used, or an option that does not apply.

    Examples
    --------
    >>> print(hs.show("scenarios/04_normal_up_tangential_up.toml"))
    title                Silicon ball on glass: both loads rise
    asperities           1
    events               242 over 12 s
    substeps             1
    recorded asperities  touching
    """
    if isinstance(what, list | tuple):
        return Lines(_registration(what, form=form, **reading).summary())
    if not isinstance(what, str | Path):
        if form is not None or reading:
            raise InputError(f"form, pixel_size, …: {MAP_ALONE}")
        return Lines(_lines(what, attributes=attributes))
    kind = file_type(Path(what))
    if kind == "height map":
        return Lines(_lines_of_map(Path(what), form or "plane", **reading))
    if kind == "result":
        _check_reading(Path(what), kind, form, reading)
        from historysim.results.analysis.history_summary import summary_lines

        with open_file_history(Path(what)) as history:
            return Lines(summary_lines(history) + (_attribute_lines(history) if attributes else []))
    with open_content(what, form=form, **reading) as content:
        return Lines(_lines(content, attributes=attributes))


def _registration(maps: "Sequence[object]", **reading: Any) -> "Registration":  # noqa: ANN401 - as for `open_content`
    """Register two height maps, or the maps of two files."""
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.registration import register_maps

    with contextlib.ExitStack() as files:
        surfaces = [
            files.enter_context(open_content(height_map, **reading))
            if isinstance(height_map, str | Path)
            else height_map
            for height_map in maps
        ]
    wrong = [
        str(height_map)
        for height_map, surface in zip(maps, surfaces, strict=True)
        if not isinstance(surface, Surface)
    ]
    if wrong or len(surfaces) != 2:
        which = (
            f"; {wrong[0] if len(wrong[0]) < 200 else 'one'} is not a height map" if wrong else ""
        )
        raise InputError(
            f"{len(surfaces)} files or maps are given{which}; expected one, or two height maps of one area"
        )
    return register_maps(*surfaces)  # type: ignore[arg-type] # both are surfaces


def _lines(content: Any, *, attributes: bool = False) -> list[tuple[str, str]]:  # noqa: ANN401 - any object with a summary
    if is_dataset(content):
        from historysim.results import tables

        summaries = {
            "sweep": tables.sweep_summary,
            "table": tables.table_summary,
            "loops": tables.loop_summary,
        }
        if summarise := summaries.get(KINDS.get(str(content.attrs.get("content")), "")):
            return summarise(content)
        if "total_normal_load" not in content:
            raise InputError(
                "this Dataset is not a history; expected a Dataset from historysim, with all its variables"
            )
        from historysim.results.analysis.history_summary import summary

        return [*summary(content), *(_attribute_lines(content) if attributes else [])]
    from historysim.scenario.scenario import Scenario
    from historysim.scenario.scenario_summary import summary as of_scenario

    if isinstance(content, Scenario):
        return of_scenario(content)
    from historysim.surfaces.heights import Surface

    if isinstance(content, Surface):
        from historysim.surfaces.inspection import summary as of_surface

        return of_surface(content)
    if not hasattr(content, "summary"):
        raise InputError(
            f"{brief(content)} cannot be shown; expected a history, a scenario, a log, a surface, or a file of them"
        )
    return list(content.summary())


def _lines_of_map(path: Path, form: str, **reading: Unpack[Reading]) -> list[tuple[str, str]]:
    from historysim.basics.arguments import representable
    from historysim.surfaces.inspection import quantisation_notice, summary

    # height steps are visible only before form removal
    measured = _height_map(path, "mean", **reading)
    with representable():
        lines = [*summary(measured.detrended(form)), ("form removed", form)]
        coarse = quantisation_notice(measured)
    return lines if coarse is None else [*lines, ("warning", coarse)]


def _attribute_lines(history: History) -> list[tuple[str, str]]:
    from historysim.results.analysis.history_summary import readable_attributes

    # multi-line strings, such as the scenario, would hide the other attributes
    texts = readable_attributes(history)
    return [("", ""), *((name, text) for name, text in texts.items() if "\n" not in text.strip())]


def plot(
    what: object,
    *,
    picture: str | None = None,
    size: "Size | None" = None,
    figure: "Figure | SubFigure | None" = None,
    ax: "Axes | None" = None,
    **options: object,
) -> "FigureOrAxes":
    """Draw a history, a surface, a scenario, loops, a comparison or an asperity, or a file of them.

    ``hs.plots`` has the pictures as functions; ``historysim kinds plots traction`` lists the
    options of one.

    Parameters
    ----------
    what : path, xarray.Dataset, Scenario, Surface, Measurement, Loops, LoopTable, Sliding, Comparison, Fit, …
        Of a history: the ``[picture]`` of its scenario, or else the friction loop, the loads, and
        the slip states. Of a scenario or a height map: the surface with its summits. Of a sweep:
        its ``[picture]``, or else a summary value over the swept keys, or the loops of its cells in
        one diagram. Several histories, or paths of them: their loops, or tractions, in one picture.
        Two height maps of one area: the material lost between them.
    picture : str, optional
        One of ``historysim kinds plots``. Of a sweep also a summary value of its cells.
    size : (float, float), optional
        Width and height of a new figure [mm].
    figure : Figure or SubFigure, optional
        Draw into this matplotlib figure or subfigure.
    ax : Axes, optional
        Draw into these axes: pictures with one panel.
    **options
        Options of the picture: ``step`` of "contact-map" (which it selects), ``steps`` of "loops"
        and "traction", ``panels`` of "history". Of the path of a height map ``form``,
        ``pixel_size``, …, as for `read_surface`.

    Returns
    -------
    Figure, SubFigure or Axes
        The given one, or a new figure.

    Raises
    ------
    InputError
        An object without a picture, a file that cannot be used, or an option that does not apply.

    Examples
    --------
    >>> figure = hs.plot("scenarios/12_textured_surface.toml")
    >>> figure.savefig("surface.png")
    """
    import historysim.scenario.figure  # noqa: F401 - registers the picture of a scenario
    from historysim.results.plots.pictures import make_figure
    from historysim.surfaces.heights import Surface

    fields: dict[str, Any] = options
    target: Place = {"size": size, "figure": figure, "ax": ax}
    reading = {
        name: fields.pop(name) for name in ("form", *Reading.__annotations__) if name in fields
    }
    with contextlib.ExitStack() as files:
        if isinstance(what, str | Path):
            fields, what = (
                {"name": str(what)} | fields,
                files.enter_context(open_content(what, **reading)),
            )
        elif isinstance(what, list | tuple):
            what = [
                files.enter_context(open_content(item, **reading))
                if isinstance(item, str | Path)
                else item
                for item in what
            ]
            if any(isinstance(each, Surface) for each in what):
                what = _registration(what)
        elif reading:
            raise InputError(f"{', '.join(reading)}: {MAP_ALONE}")
        # any explicit option replaces the picture of the scenario
        if (
            picture is None
            and not {*fields} - {"name"}
            and (scenario_figure := _draw_scenario_picture(what, target))
        ):
            return scenario_figure
        return make_figure(what, picture=picture, target=target, **fields)


def _draw_scenario_picture(content: object, target: "Place") -> "FigureOrAxes | None":
    """Draw the ``[picture]`` of the scenario of a result or a sweep; None if it has none."""
    import xarray as xr

    from historysim.scenario.figure import draw_scenario_figure, drawable

    if isinstance(content, xr.Dataset) and (pictures := drawable(content)):
        return draw_scenario_figure(content, pictures, target)
    return None


def report(what: object, output: str | Path | None = None) -> str:
    """Write a report of a result as one self-contained HTML page, and return it.

    Parameters
    ----------
    what : path, xarray.Dataset, Scenario, Fit, Loops, LoopTable or Sliding
        A history, which the page recomputes for any step, asperity, friction and moduli; a sweep;
        friction loops, individually or by load; friction over time or distance; a fit. A scenario
        with a measured loading is fitted if it has ``[fit]``, or else compared with its record.
    output : path, optional
        File to write the page to, complete or not at all.

    Raises
    ------
    InputError
        An object without a report, or a file that cannot be used.
    OSError
        ``output`` cannot be written.
    """
    from historysim.basics.files import replacing
    from historysim.basics.targets import PAGE, Output, check_outputs
    from historysim.scenario.scenario import Scenario

    with contextlib.ExitStack() as files:
        name, reads = f"this {type(what).__name__}", list[Path]()
        content: Any = what
        if isinstance(what, str | Path):
            name, reads = str(what), [Path(what)]
            content = files.enter_context(open_content(what))
        if isinstance(content, Scenario):
            reads = [*content.files]
        if output is not None:
            check_outputs([Output(Path(output), (PAGE,))], reads, force=True)
        text = _page(content, name)
    if output is not None:
        with replacing(Path(output)) as unfinished:
            unfinished.write_text(text, encoding="utf-8")
    return text


def _page(content: object, name: str) -> str:
    import xarray as xr

    from historysim.log.event_log import EventLog
    from historysim.measured.comparison import Comparison
    from historysim.results.report.page import EXPECTED, paragraph, picture, render_page
    from historysim.results.report.reports import comparison_page, dataset_page
    from historysim.scenario.fit import compare, fit
    from historysim.scenario.scenario import Scenario

    if isinstance(content, xr.Dataset):
        try:
            scenario_figure = _draw_scenario_picture(content, {})
            figures = (
                []
                if scenario_figure is None
                else [picture(scenario_figure, "The picture of the scenario.")]
            )
        except InputError as error:
            figures = [paragraph(f"No picture of the scenario: {error}", "note")]
        return dataset_page(content, figures)
    if isinstance(content, Scenario) and content.sections.fit is not None:
        return render_page(fit(content))
    if isinstance(content, Scenario):
        try:
            _ = content.measured_files
        except InputError as error:
            raise InputError(f"{error}, and then historysim report of its result") from error
        comparison = compare(content)
        if not isinstance(comparison, Comparison):
            return render_page(comparison)
        return comparison_page(comparison, content.title or content.path.stem, content.text)
    if isinstance(content, EventLog):
        raise InputError(
            f"{name}: is a log; expected its result; historysim run {shell_word(name)} recomputes it"
        )
    if render_page.dispatch(type(content)) is render_page.dispatch(object):
        raise InputError(f"{name}: has no report; {EXPECTED}")
    return render_page(content)


@attrs.frozen
class Explorer:
    """Interactive picture of `explore` for a notebook."""

    #: One self-contained HTML page, to be written to a file.
    page: str = attrs.field(repr=lambda page: f"<{len(page):,} characters of HTML>")

    def _repr_html_(self) -> str:
        # a frame isolates the page from styles and scripts of the notebook
        frame = "width: 100%; height: 46rem; border: 0"
        return (
            f'<iframe title="through time" style="{frame}" srcdoc="{escape(self.page)}"></iframe>'
        )


def explore(history: "str | Path | xr.Dataset") -> Explorer:
    """Return the interactive part of `report` for a notebook: time slider, selectable asperities, variable friction.

    Parameters
    ----------
    history : xarray.Dataset or path
        A history with asperities, or its file.

    Raises
    ------
    InputError
        Not a history, a history without asperities, or one that a page cannot compute.
    """
    import xarray as xr

    from historysim.results.report.reports import interactive_page

    if isinstance(history, str | Path):
        with open_content(history) as content:
            return explore(content)  # type: ignore[arg-type] # other types are rejected below
    if not isinstance(history, xr.Dataset) or "total_normal_load" not in history:
        raise InputError(
            f"explore: {type(history).__name__}; expected a history, as returned by hs.run"
        )
    return Explorer(interactive_page(history))
