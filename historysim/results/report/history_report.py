"""The report of a recorded history: what came out, what the model assumes, pictures, and where it comes from."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from historysim.errors import InputError
from historysim.results import analysis, sliding_order
from historysim.results.analysis.history_summary import readable_attributes
from historysim.results.plots.pictures import PICTURES, draw
from historysim.results.report.installation import installing
from historysim.results.report.page import Section, code, folded, page, paragraph, picture, table

INSTALL = 'pip install "historysim[report]"'
SEVERAL_LINES = ("scenario", "validity")


def history_page(history: xr.Dataset, figures: Sequence[str] = ()) -> str:
    """Return a history as one HTML page that fetches nothing.

    Parameters
    ----------
    history : xarray.Dataset
    figures : sequence of str
        Pictures of its own, as HTML, before those of every history.

    Returns
    -------
    str
    """
    title = str(history.attrs.get("title") or "Load history")
    library, interactive = _interactive(history)
    sections = [_summary(history), validity_section(history), interactive]
    sections += [_figures(history, figures), *_provenance(history)]
    return page(title, sections, head=library)


def interactive_page(history: xr.Dataset) -> str:
    """Return the interactive part of a history as one HTML page that fetches nothing.

    Raises
    ------
    InputError
        There is nothing to move through, or Bokeh is not installed.
    """
    if "slip_state" not in history:
        raise InputError("the history is of totals alone; expected one with asperities, to move through")
    try:
        from historysim.results.report.explorer import explorer

        library, body, notes = explorer(history)
    except ModuleNotFoundError as error:
        raise InputError(f"the interactive picture needs Bokeh; expected {INSTALL}") from error
    title = str(history.attrs.get("title") or "Load history")
    return page(title, [Section("Through time", (*(paragraph(note, "note") for note in notes), body))], head=library)


def _summary(history: xr.Dataset) -> Section:
    # warnings stand in a section of their own
    return Section("Summary", (table(line for line in sliding_order.summary(history) if line[0] != "warning"),))


def validity_section(history: xr.Dataset) -> Section:
    """Return which assumptions of the model do not hold, each with its numbers and the mend."""
    if "validity" not in history.attrs:
        return Section("Validity", (paragraph("The version that made this history did not check its assumptions."),))
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
    title = "Through time"
    if "slip_state" not in history:
        return "", Section(title, (paragraph("The history is of totals alone: there are no asperities to show."),))
    try:
        from historysim.results.report.explorer import explorer

        library, body, notes = explorer(history)
    except ModuleNotFoundError:
        text = f"The interactive part needs Bokeh: {INSTALL}, then make this page again."
        return "", Section(title, (paragraph(text, "note"),))
    except InputError as error:
        return "", Section(title, (paragraph(f"Not available: {error}", "note"),))
    return library, Section(title, (*(paragraph(note, "note") for note in notes), body))


def history_pictures(history: xr.Dataset, names: Sequence[str] | None = None) -> list[str]:
    """Return pictures of a history, with what stands below them.

    Parameters
    ----------
    history : xarray.Dataset
    names : sequence of str, optional
        Of `PICTURES`; by default loop, loads and slip states, and the contact where about half of it slips, or of one
        asperity, whose map is a point, its traction; yielding and wear, where there are any.
    """
    if names is None:
        names = ["history"]
        if "slip_state" in history:
            names.append("traction" if history.sizes["asperity"] == 1 else "contact-map")
            names += [name for name in ("yielding", "wear") if PICTURES[name].reported(history)]
    drawn = []
    for name in names:
        try:
            drawn.append(picture(draw(history, name), PICTURES[name].caption))
        except InputError as error:
            drawn.append(paragraph(f"No picture {name}: {error}", "note"))
    return drawn


def _figures(history: xr.Dataset, figures: Sequence[str]) -> Section:
    names = [name for name, kind in PICTURES.items() if kind.reported(history)]
    names.sort(key=lambda name: PICTURES[name].place)
    drawn = [*figures, *history_pictures(history, names)]
    if history.sizes.get("asperity") == 1:
        drawn.append(paragraph("No contact map: one asperity is a point in it.", "note"))
    return Section("Pictures", tuple(drawn))


def _provenance(history: xr.Dataset) -> list[Section]:
    told: dict[str, Any] = {str(name): value for name, value in history.attrs.items()}
    rows = [(name, text) for name, text in readable_attributes(history).items() if name not in SEVERAL_LINES]
    parts = [table(rows)]
    if scenario := told.get("scenario"):
        parts.append(folded("the scenario, as it stands in the result", str(scenario)))
    source = history.encoding.get("source")
    name = Path(source).name if source else "result.nc"
    if "log_digest" in told:
        again = f"historysim run {name} -o again.nc\nhistorysim verify {name}"
        where = paragraph("The result holds its events: it makes itself again, and is compared bit for bit:")
    elif told.get("scenario"):
        again = f"historysim run scenario.toml -o {name}"
        where = paragraph("The scenario above, saved as scenario.toml, makes the result again:")
    else:
        again = "history = historysim.replay(ensemble, events)"
        where = paragraph("The history was made from Python, from an ensemble and events that it does not hold:")
    return [
        Section("Provenance", tuple(parts)),
        Section("How to reproduce", (where, code(again), *same_version(str(told.get("historysim_version", ""))))),
    ]


def same_version(version: str) -> tuple[str, str]:
    """Return how the version that made a result is installed, as parts of a page."""
    text, commands = installing(version)
    return paragraph(text), code(commands)
