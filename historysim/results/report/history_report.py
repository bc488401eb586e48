"""The report of a recorded history: summary, validity, pictures and provenance."""

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from historysim._version import __version__
from historysim.errors import InputError
from historysim.results import analysis
from historysim.results.analysis.history_summary import readable_attributes
from historysim.results.plots.pictures import PICTURES, draw
from historysim.results.report.page import Section, code, folded, numbered, page, paragraph, picture, table

INSTALL = 'pip install "historysim[report]"'
SEVERAL_LINES = ("scenario", "validity")
TIME = "Through time"
"""The heading of the interactive part."""


def history_page(history: xr.Dataset, figures: Sequence[str] = ()) -> str:
    """Return a history as one HTML page that fetches nothing; ``figures`` are pictures of its own, as HTML."""
    title = str(history.attrs.get("title") or "Load history")
    library, interactive = _interactive(history)
    sections = [_summary(history), validity_section(history), interactive]
    sections += [_figures(history, figures), *_provenance(history)]
    return page(title, sections, head=library)


def interactive_page(history: xr.Dataset) -> str:
    """Return the interactive part of a history as one HTML page; InputError without asperities or without Bokeh."""
    if "slip_state" not in history:
        raise InputError("the history is of totals alone; expected one with asperities, to move through")
    try:
        library, section = _explorer(history)
    except ModuleNotFoundError as error:
        raise InputError(f"the interactive picture needs Bokeh; expected {INSTALL}") from error
    return page(str(history.attrs.get("title") or "Load history"), [section], head=library)


def _explorer(history: xr.Dataset) -> tuple[str, Section]:
    """Return the library of the interactive part, and its section."""
    from historysim.results.report.explorer import explorer

    library, body, notes = explorer(history)
    return library, Section(TIME, (*(paragraph(note, "note") for note in notes), body))


def _summary(history: xr.Dataset) -> Section:
    # warnings stand in a section of their own
    return Section("Summary", (table(line for line in analysis.summary(history) if line[0] != "warning"),))


def validity_section(history: xr.Dataset) -> Section:
    """Return which assumptions of the model do not hold, each with its numbers and the remedy."""
    found = analysis.validity(history)
    if not found:
        text = "All assumptions that are checked hold where the asperities are pressed most."
        return Section("Validity", (paragraph(text),))
    rows = [(each.name, f"{each.value:.3g}", f"{each.limit:.3g}") for each in found]
    return Section(
        "Validity",
        (
            paragraph("Where the asperities are pressed most, the model is used beyond its assumptions:"),
            *(paragraph(each.text, "warning") for each in found),
            table(rows, ("assumption", "found", "limit")),
        ),
    )


def _interactive(history: xr.Dataset) -> tuple[str, Section]:
    if "slip_state" not in history:
        return "", Section(TIME, (paragraph("The history is of totals alone: there are no asperities to show."),))
    try:
        return _explorer(history)
    except ModuleNotFoundError:
        text = f"The interactive part needs Bokeh: {INSTALL}, then make this page again."
    except InputError as error:
        text = f"Not available: {error}"
    return "", Section(TIME, (paragraph(text, "note"),))


def history_pictures(history: xr.Dataset, names: Sequence[str] | None = None) -> list[str]:
    """Return pictures of a history by their names, with what stands below them, as HTML.

    By default loop, loads and slip states, and the contact where nearest to half of it slips, or of one asperity its
    traction, since its map is a point; yielding and wear, where there are any.
    """
    if names is None:
        names = ["history"]
        if "slip_state" in history:
            names.append("traction" if history.sizes["asperity"] == 1 else "contact-map")
            names += [name for name in ("yielding", "wear") if PICTURES[name].reported(history)]
    parts, lines = [], analysis.summary(history)
    for name in names:
        kind = PICTURES[name]
        try:
            parts.append(picture(draw(history, name), numbered(kind.caption_of(history), lines, kind.found)))
        except InputError as error:
            parts.append(paragraph(f"No picture {name}: {error}", "note"))
    return parts


def _figures(history: xr.Dataset, figures: Sequence[str]) -> Section:
    names = [name for name, kind in PICTURES.items() if kind.reported(history)]
    names.sort(key=lambda name: PICTURES[name].order)
    parts = [*figures, *history_pictures(history, names)]
    if history.sizes.get("asperity") == 1:
        parts.append(paragraph("No contact map: one asperity is a point in it.", "note"))
    return Section("Pictures", tuple(parts))


def _provenance(history: xr.Dataset) -> list[Section]:
    rows = [(name, text) for name, text in readable_attributes(history).items() if name not in SEVERAL_LINES]
    parts = [table(rows)]
    if scenario := history.attrs.get("scenario"):
        parts.append(folded("the scenario, as it stands in the result", str(scenario)))
    source = history.encoding.get("source")
    name = Path(source).name if source else "result.nc"
    if "log_digest" in history.attrs:
        again = f"historysim run {name} -o again.nc\nhistorysim verify {name}"
        where = paragraph("The result holds its events, from which it is made again and compared bit for bit:")
    elif scenario:
        again = f"historysim run scenario.toml -o {name}"
        where = paragraph("The scenario above, saved as scenario.toml, makes the result again:")
    else:
        again = "history = historysim.replay(ensemble, events)"
        where = paragraph("The history was made from Python, from an ensemble and events that it does not hold:")
    version = str(history.attrs.get("historysim_version", __version__))
    installed = paragraph(f"It was made with version {version}:"), code(f"pip install historysim=={version}")
    return [Section("Provenance", tuple(parts)), Section("How to reproduce", (where, code(again), *installed))]
