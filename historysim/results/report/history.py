"""The report of a recorded history: what came out, what the model assumes, pictures, and where it comes from."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from historysim.errors import InputError
from historysim.results import analysis
from historysim.results.plots.history import plot_history
from historysim.results.plots.surface import plot_surface, surface_of
from historysim.results.plots.traction import plot_traction
from historysim.results.report.page import Section, code, folded, page, paragraph, picture, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INSTALL = 'pip install "historysim[report]"'
SEVERAL_LINES = ("scenario", "validity")


def history_page(history: xr.Dataset) -> str:
    """Return a history as one HTML page that fetches nothing.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    str
    """
    title = str(history.attrs.get("title") or "Load history")
    library, interactive = _interactive(history)
    sections = [_summary(history), validity_section(history), interactive]
    sections += [Section("Pictures", tuple(history_pictures(history))), *_provenance(history)]
    return page(title, sections, head=library)


def _summary(history: xr.Dataset) -> Section:
    # warnings stand in a section of their own
    return Section("Summary", (table(line for line in analysis.summary(history) if line[0] != "warning"),))


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
    left_out = [paragraph(f"To keep the page small, it holds {'; '.join(notes)}.", "note")] if notes else []
    return library, Section(title, (*left_out, body))


def history_pictures(history: xr.Dataset) -> list[str]:
    """Return the pictures of a history: loops, loads and slip states, and the contact where about half of it slips."""
    drawn = [
        picture(plot_history(history), "The friction loop, the loads over time, and the slip state of each asperity.")
    ]
    if "slip_state" in history:
        try:
            figure, caption = _contact(history)
        except InputError as error:
            drawn.append(paragraph(f"No contact map: {error}", "note"))
        else:
            drawn.append(picture(figure, caption))
    return drawn


def _contact(history: xr.Dataset) -> tuple["Figure", str]:
    """Return a picture of the contact, and its caption; of one asperity, whose map is a point, its traction."""
    surface = surface_of(history)
    if surface.sizes.get("summit") == 1:
        return plot_traction(history), "The traction of the asperity over its radius, at several steps."
    step = analysis.telling_step(history)
    return plot_surface(surface, history, step), f"The contact at step {step:,}, where about half of its area slips."


def _provenance(history: xr.Dataset) -> list[Section]:
    told: dict[str, Any] = {str(name): value for name, value in history.attrs.items()}
    rows = [(name, str(value)) for name, value in told.items() if name not in SEVERAL_LINES]
    parts = [table(rows)]
    if scenario := told.get("scenario"):
        parts.append(folded("the scenario, as it stands in the result", str(scenario)))
    source = history.encoding.get("source")
    name = Path(source).name if source else "result.nc"
    if "log_digest" in told:
        log = Path(name).with_suffix(".history")
        again = (
            f"historysim verify {name}      # replays the log beside it, and compares bit for bit\n"
            f"historysim run {log}   # makes the result again from its log"
        )
        where = paragraph("The log that stands beside the result alone makes it again, bit for bit:")
    elif told.get("scenario"):
        again = f"historysim run scenario.toml -o {name}"
        where = paragraph("The scenario above, saved as scenario.toml, makes the result again:")
    else:
        again = "history = historysim.replay(ensemble, events)"
        where = paragraph("The history was made from Python, from an ensemble and events that it does not hold:")
    version = code(f"pip install historysim=={told.get('historysim_version', '')}")
    return [
        Section("Provenance", tuple(parts)),
        Section("How to reproduce", (where, code(again), paragraph("With the same version:"), version)),
    ]
