"""A report of whatever has one: a page of HTML that opens anywhere."""

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from historysim.basics.files import replacing
from historysim.basics.targets import PAGE, Output, check_outputs
from historysim.errors import InputError
from historysim.results.report.page import EXPECTED, page_of
from historysim.scenario.opening import opened
from historysim.scenario.scenario import Scenario

if TYPE_CHECKING:
    from collections.abc import Iterable

    import xarray as xr

    from historysim.measured.loop_table import LoopTable
    from historysim.measured.loops import Loops
    from historysim.measured.sliding import Sliding
    from historysim.scenario.fit import Fit

    Reportable = str | Path | xr.Dataset | Scenario | Fit | Loops | LoopTable | Sliding


def report(what: "Reportable", output: str | Path | None = None) -> str:
    """Return a result as one self-contained HTML page: it opens without a network, and holds all that it shows.

    Parameters
    ----------
    what : path, xarray.Dataset, Scenario, Fit, Loops, LoopTable or Sliding
        A history, with a slider through time that moves loop and contact map, and asperities to click on (which needs
        Bokeh: ``pip install "historysim[report]"``); a sweep; friction loops, one by one or by their loads; friction
        over time or distance; a fit. A scenario whose loading is measured is fitted, where it has ``[fit]``, or
        compared with what was measured.
    output : path, optional
        A file to write the page to, which appears when it is complete.

    Returns
    -------
    str
        The page.

    Raises
    ------
    InputError
        Something that has no report, or a file that cannot be used.
    OSError
        ``output`` cannot be written.
    """
    if isinstance(what, str | Path):
        with opened(what) as content:
            if output is not None:
                _check_apart(Path(output), content.files if isinstance(content, Scenario) else [Path(what)])
            text = _page(content, str(what))
    else:
        if output is not None and isinstance(what, Scenario):
            _check_apart(Path(output), what.files)
        text = _page(what, f"this {type(what).__name__}")
    if output is not None:
        with replacing(Path(output)) as unfinished:
            unfinished.write_text(text, encoding="utf-8")
    return text


@attrs.frozen
class Explorer:
    """A picture to move through, which a notebook shows; see `explore`.

    Attributes
    ----------
    page : str
        It as one self-contained HTML page, to be written to a file.
    """

    page: str = attrs.field(repr=lambda page: f"<{len(page):,} characters of HTML>")

    def _repr_html_(self) -> str:
        # in a frame of its own, which no style or script of the notebook reaches
        frame = "width: 100%; height: 46rem; border: 0"
        return f'<iframe title="through time" style="{frame}" srcdoc="{escape(self.page)}"></iframe>'


def explore(history: "str | Path | xr.Dataset") -> Explorer:
    """Return friction loop, contact map, and an asperity's history and traction, to be moved through in a notebook.

    It is the interactive part of `report`: a slider through time, and asperities to click on. It needs Bokeh
    (``pip install "historysim[report]"``).

    Parameters
    ----------
    history : xarray.Dataset or path
        A history with asperities, or the file of one.

    Returns
    -------
    Explorer
        What a notebook shows as it is.

    Raises
    ------
    InputError
        No history, one without asperities, or Bokeh is not installed.
    """
    import xarray as xr

    from historysim.results.report.history_report import interactive_page

    if isinstance(history, str | Path):
        with opened(history) as content:
            return explore(content)  # type: ignore[arg-type] # what is no Dataset is told below
    if not isinstance(history, xr.Dataset) or "total_normal_load" not in history:
        raise InputError(f"explore: came a {type(history).__name__}; expected a history, such as hs.run gives")
    return Explorer(interactive_page(history))


def _check_apart(output: Path, reads: "Iterable[Path]") -> None:
    check_outputs([Output(output, (PAGE,))], reads, force=True)


def _page(what: object, name: str) -> str:
    import xarray as xr

    from historysim.log.event_log import EventLog
    from historysim.results.report.others import dataset_page

    if isinstance(what, xr.Dataset):
        return dataset_page(what, _own_pictures(what))
    if isinstance(what, EventLog):
        raise InputError(f"{name}: is a log; expected its result; historysim run {name} makes it again")
    if page_of.dispatch(type(what)) is page_of.dispatch(object):
        raise InputError(f"{name}: has no report; {EXPECTED}")
    return page_of(what)


def _own_pictures(what: "xr.Dataset") -> list[str]:
    """Return what ``[picture]`` of the scenario says, drawn of its result, as HTML."""
    from historysim.results.report.page import paragraph, picture
    from historysim.scenario.figure import draw_figure, drawable

    pictures = drawable(what)
    if not pictures:
        return []
    try:
        return [picture(draw_figure(what, pictures), "The picture of the scenario.")]
    except InputError as error:
        return [paragraph(f"No picture of the scenario: {error}", "note")]


@page_of.register(Scenario)
def _measured(scenario: Scenario) -> str:
    from historysim.results.report.others import comparison_page
    from historysim.scenario.compare import compare
    from historysim.scenario.fit import fit

    if scenario.sections.fit is not None:
        return page_of(fit(scenario))
    try:
        _ = scenario.measured_files
    except InputError as error:
        raise InputError(f"{error}, to set the model beside; the result of historysim run has a report, too") from error
    comparison = compare(scenario)
    return comparison_page(comparison, scenario.title or scenario.path.stem, scenario.text)
