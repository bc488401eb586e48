"""Reports of histories, of loops or sliding of a record, of sweeps, and of comparisons with measurements."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from historysim._version import __version__
from historysim.basics.wording import shell_word
from historysim.errors import InputError
from historysim.measured.comparison import Comparison
from historysim.measured.fretting import CONTENT_OF_FRETTING
from historysim.measured.loop_table import CONTENT_OF_TABLE, LoopTable
from historysim.measured.loop_values import CONTENT as LOOPS
from historysim.measured.loops import Loops
from historysim.measured.sliding import UNITS, Sliding
from historysim.results import analysis
from historysim.results.analysis.along_time import CONTENT as TIME_SERIES
from historysim.results.analysis.history_summary import readable_attributes
from historysim.results.layout import report_missing_variables, standard_layout
from historysim.results.plots.loop_pictures import (
    FrettingPicture,
    LoopLevelsPicture,
    LoopTrendsPicture,
)
from historysim.results.plots.pictures import PICTURES, draw
from historysim.results.plots.record_pictures import ComparisonPicture, SlidingPicture, TablePicture
from historysim.results.plots.style import choose_scale
from historysim.results.plots.swept import CurvePicture
from historysim.results.report.browser import interactive_part
from historysim.results.report.page import (
    EXPECTED,
    Section,
    add_values,
    code,
    collapsible,
    page,
    paragraph,
    picture,
    render_page,
    table,
)
from historysim.results.tables import (
    SWEEP,
    TABLE,
    flat_columns,
    loop_summary,
    sweep_rows,
    sweep_summary,
    table_summary,
    with_unit,
)

SEVERAL_LINES = ("scenario", "validity")
# a release, with what a build adds to it
_VERSION = re.compile(
    r"\d+(\.\d+)*((a|b|rc)\d+)?(\.post\d+)?(\.dev\d+)?(\+[a-z0-9]+([._][a-z0-9]+)*)?", re.ASCII
)
TIME = "Through time"  # the heading of the interactive part


def _title(dataset: xr.Dataset, otherwise: str) -> str:
    return str(dataset.attrs.get("title") or otherwise)


def _without_warnings(lines: Iterable[tuple[str, str]]) -> Section:
    # they have a separate section
    return Section("Summary", (table(line for line in lines if line[0] != "warning"),))


def history_page(history: xr.Dataset, figures: Sequence[str] = ()) -> str:
    """Render a history as one self-contained HTML page; ``figures`` are its pictures, as HTML."""
    try:
        script, interactive = _interactive_section(history)
    except InputError as error:
        script = ""
        interactive = Section(TIME, (paragraph(f"Not available: {error}", "note"),))
    sections = [
        _without_warnings(analysis.summary(history)),
        validity_section(history),
        interactive,
    ]
    return page(
        _title(history, "Load history"),
        [*sections, _figures(history, figures), *provenance_sections(history)],
        head=script,
    )


def interactive_page(history: xr.Dataset) -> str:
    """Render the interactive part of a history as one HTML page; InputError if a page cannot compute the history."""
    history = standard_layout(history)
    script, section = _interactive_section(history)
    return page(_title(history, "Load history"), [section], head=script)


def _interactive_section(history: xr.Dataset) -> tuple[str, Section]:
    """Render the script of the interactive part, and its section."""
    if "slip_state" not in history:
        raise InputError(
            "the history is of totals alone; expected one with asperities, to move through"
        )
    with report_missing_variables(history):
        script, body, notes = interactive_part(history)
    return script, Section(TIME, (*(paragraph(note, "note") for note in notes), body))


def validity_section(history: xr.Dataset) -> Section:
    """Return the assumptions of the model that do not hold, each with its numbers and the remedy."""
    findings = analysis.validity(history)
    if not findings:
        text = "All assumptions that are checked hold where the asperities are pressed most."
        return Section("Validity", (paragraph(text),))
    intro = paragraph(
        "Where the asperities are pressed most, the model is used beyond its assumptions:"
    )
    rows = [(finding.name, f"{finding.value:.3g}", f"{finding.limit:.3g}") for finding in findings]
    warnings = (paragraph(finding.text, "warning") for finding in findings)
    return Section("Validity", (intro, *warnings, table(rows, ("assumption", "found", "limit"))))


def history_pictures(history: xr.Dataset, names: Sequence[str] | None = None) -> list[str]:
    """Render pictures of a history by their names, with captions, as HTML.

    By default loop, loads and slip states, and the contact at its representative step, or the
    traction of a single asperity, whose map is a point; yielding and wear, if there are any.
    """
    if names is None:
        names = ["history"]
        if "slip_state" in history:
            names.append("traction" if history.sizes["asperity"] == 1 else "contact-map")
            names += [name for name in ("yielding", "wear") if PICTURES[name].is_reported(history)]
    blocks = []
    lines = analysis.summary(history)
    for name in names:
        kind = PICTURES[name]
        try:
            blocks.append(
                picture(
                    draw(history, name, **kind.report_options),
                    add_values(kind.report_caption(history), lines, kind.caption_lines),
                )
            )
        except InputError as error:
            blocks.append(paragraph(f"No picture {name}: {error}", "note"))
    return blocks


def _figures(history: xr.Dataset, figures: Sequence[str]) -> Section:
    names = [name for name, kind in PICTURES.items() if kind.is_reported(history)]
    names.sort(key=lambda name: PICTURES[name].order)
    blocks = [*figures, *history_pictures(history, names)]
    if history.sizes.get("asperity") == 1:
        blocks.append(paragraph("No contact map: one asperity is a point in it.", "note"))
    return Section("Pictures", tuple(blocks))


def provenance_sections(history: xr.Dataset) -> list[Section]:
    """Return the provenance of a history, and the commands that reproduce it."""
    rows = [
        (name, text)
        for name, text in readable_attributes(history).items()
        if name not in SEVERAL_LINES
    ]
    blocks = [table(rows)]
    if scenario := history.attrs.get("scenario"):
        blocks.append(collapsible("the scenario, as stored in the result", str(scenario)))
    name = shell_word(Path(history.encoding.get("source") or "result.nc").name)
    if "log_digest" in history.attrs:
        where = "The result holds its events, from which it is made again and compared bit for bit:"
        again = f"historysim run {name} -o again.nc\nhistorysim verify {name}"
    elif scenario:
        where = "The scenario above, saved as scenario.toml, makes the result again:"
        again = f"historysim run scenario.toml -o {name}"
    else:
        where = (
            "The history was made from Python, from an ensemble and events that it does not hold:"
        )
        again = "history = historysim.replay(ensemble, events)"
    version = str(history.attrs.get("historysim_version", __version__))
    made_with = [
        paragraph(f"It was made with version {version}:"),
        code(f"pip install historysim=={version}"),
    ]
    if not _VERSION.fullmatch(version):
        made_with = [
            paragraph("The result does not name the version of historysim that it was made with.")
        ]
    reproduce = Section("How to reproduce", (paragraph(where), code(again), *made_with))
    return [Section("Provenance", tuple(blocks)), reproduce]


render_page.register(Loops, lambda loops: loops_page(loops.to_dataset()))
render_page.register(LoopTable, lambda levels: loops_page(levels.to_dataset()))

LABELS = {"critical_asperity"}  # variables of a sweep that are labels, not quantities
MOST_ROWS = 500  # cells of a sweep that a page lists


def loops_page(loops: xr.Dataset) -> str:
    """Render loops (`Loops.to_dataset`), or their means by load (`LoopTable.to_dataset`), as a page."""
    lines = loop_summary(loops)
    pictures: tuple[str, ...] = ()
    split = next((number for number, (label, _) in enumerate(lines) if not label), len(lines))
    if loops.attrs["content"] == LOOPS:
        means = "Mean ± standard deviation over the loops."
        rows = table(lines[:split])
        caption = "How the loops change from one to the next; lines are their means."
        caption = add_values(
            caption, lines, ("friction force", "preliminary displacement", "stiffness at reversal")
        )
        figure = LoopTrendsPicture().figure(loops)
        if "energy_ratio" in loops and np.isfinite(loops["energy_ratio"]).any():
            text = "Fretting: energy friction coefficient, slip amplitude, and energy ratios of each loop."
            pictures = (picture(FrettingPicture().figure(loops), text),)
    else:
        along = "normal load" if "level" in loops.dims else "amplitude"
        means = (
            f"Mean ± standard deviation of one loop, both directions, of the loops of each {along}."
        )
        rows = table(*_by_group(lines[:split]))
        caption = f"Over the {along}; bars are the standard deviation of one loop."
        if "friction_line_slope" in loops.attrs:
            slope, low, high = (
                loops.attrs[f"friction_line_slope{end}"] for end in ("", "_low", "_high")
            )
            caption += f" The friction force rises by {slope:.3g} of the load (95 %: {low:.3g} to {high:.3g})."
        figure = LoopLevelsPicture().figure(loops)
    return page(
        _title(loops, "Friction loops"),
        [
            Section("Summary", (paragraph(means), rows)),
            Section("Pictures", (picture(figure, caption), *pictures)),
            Section("How they were found", (table(lines[split + 1 :]),)),
        ],
    )


def _by_group(lines: Sequence[tuple[str, str]]) -> tuple[list[list[str]], list[str]]:
    """Return the lines of loads or amplitudes as table rows, with a column for each load or amplitude."""
    heading = [""]
    rows = dict[str, list[str]]()
    for label, text in lines:
        if label.startswith(" "):
            rows.setdefault(label.strip(), []).append(text)
        else:
            heading.append(f"{label}, {text}")
    return [[label, *texts] for label, texts in rows.items()], heading


@render_page.register(Sliding)
def sliding_page(sliding: Sliding) -> str:
    """Render friction over time or distance as one self-contained HTML page."""
    windows = (
        sliding.window_place,
        sliding.window_mean,
        sliding.window_deviation,
        sliding.window_count,
    )
    rows = [
        (f"{middle:.6g}", f"{mean:.4g}", f"{deviation:.2g}", f"{count:,}")
        for middle, mean, deviation, count in zip(*windows, strict=True)
    ]
    heading = (
        f"middle of the window [{UNITS[sliding.over]}]",
        "mean T/N",
        "standard deviation of a sample",
        "samples",
    )
    caption = "The friction coefficient, its windows and the approach to the steady value."
    lines = sliding.summary()
    caption = add_values(caption, lines, ("friction coefficient", "static peak", "steady value"))
    return page(
        f"Friction over {sliding.over}",
        [
            Section("Summary", (table(lines),)),
            Section("Pictures", (picture(SlidingPicture().figure(sliding), caption),)),
            Section("Windows", _first_rows(rows, heading, "windows.")),
        ],
    )


def _first_rows(
    rows: Sequence[Sequence[str]], heading: Sequence[str], noun: str
) -> tuple[str, ...]:
    """Return a table limited to the rows that a page can show, and their total number."""
    first_rows = table(rows[:MOST_ROWS], heading)
    if len(rows) <= MOST_ROWS:
        return (first_rows,)
    return first_rows, paragraph(f"The first {MOST_ROWS:,} of {len(rows):,} {noun}", "note")


def table_page(table_data: xr.Dataset) -> str:
    """Render a table of a query or a fretting report as one self-contained HTML page."""
    columns = flat_columns(table_data)
    rows = [
        [_cell(value) for value in row]
        for row in zip(*(column.values for column in columns.values()), strict=True)
    ]
    heading = [with_unit(name, column.attrs) for name, column in columns.items()]
    try:
        figure = TablePicture().figure(table_data)
        shown_picture = picture(figure, "Its columns over the first one.")
    except InputError as error:
        shown_picture = paragraph(str(error), "note")
    return page(
        columns.title,
        [
            Section("Summary", (table(table_summary(table_data)),)),
            Section("Picture", (shown_picture,)),
            Section("Rows", _first_rows(rows, heading, "rows.")),
        ],
    )


def _cell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def sweep_page(sweep: xr.Dataset, figures: Sequence[str] = ()) -> str:
    """Render a sweep of `historysim.sweep` as one self-contained HTML page; ``figures`` come first."""
    lines = sweep_summary(sweep)
    warnings = [paragraph(text, "warning") for label, text in lines if label == "warning"]
    held = paragraph("All assumptions that are checked hold in every cell.")
    heading, *rows = ([_cell(value) for value in row] for row in sweep_rows(sweep, steps=False))
    listed = _first_rows(rows, heading, "cells; historysim sweep -o sweep.csv lists all.")
    pictures = [*figures, *sweep_pictures(sweep)] or [
        paragraph("No number changes from cell to cell.")
    ]
    attributes = {str(name): str(value) for name, value in sweep.attrs.items()}
    provenance = [
        table([(name, text) for name, text in attributes.items() if "\n" not in text.strip()])
    ]
    if "scenario" in attributes:
        provenance.append(
            collapsible("the scenario, as stored in the file", attributes["scenario"])
        )
    return page(
        _title(sweep, "Sweep"),
        [
            _without_warnings(lines),
            Section("Validity", tuple(warnings or [held])),
            Section("Pictures", tuple(pictures)),
            Section("Cells", listed),
            Section("Provenance", tuple(provenance)),
            _again("historysim sweep scenario.toml -o sweep.nc"),
        ],
    )


def sweep_pictures(sweep: xr.Dataset) -> list[str]:
    """Render pictures of the numbers that vary between the cells of a sweep."""
    pictures = []
    swept = {dim for name in sweep.coords for dim in sweep[name].dims}
    for name, values in sweep.data_vars.items():
        # a label is not a number
        is_quantity = values.dtype.kind == "f" and name not in LABELS
        if (
            is_quantity
            and values.dims
            and set(values.dims) <= swept
            and float(values.min()) < float(values.max())
        ):
            factor, unit = choose_scale(str(values.attrs.get("units", "")), values.values)
            ends = " to ".join(f"{float(end) * factor:.3g}" for end in (values.min(), values.max()))
            label = f"{values.attrs.get('long_name', name)}: {ends} {unit}".rstrip()
            pictures.append(picture(CurvePicture(quantity=str(name)).figure(sweep), label))
    return pictures


def comparison_page(
    comparison: Comparison,
    title: str,
    scenario: str,
    *,
    fitted: Iterable[tuple[str, str]] = (),
    result: str = "",
) -> str:
    """Render a comparison of a model with a measurement as one self-contained HTML page.

    `scenario` and `result` are the strings of the scenario without and with fitted values; `fitted`
    are lines (label, value) of the fitted parameters and their uncertainty.
    """
    fitted = list(fitted)
    fit_section = [Section("What was fitted", (table(fitted),))] if fitted else []
    rows: Sequence[tuple[str, str, str]] = comparison.rows()
    means = table(rows[1:], rows[0]) if rows else paragraph("There is no whole loop to compare.")
    caption = add_values(
        "Measured loops and loads, and those of the model.",
        comparison.summary(),
        ("rms difference",),
    )
    texts = [collapsible("the scenario", scenario)]
    if result:
        texts.append(collapsible("the scenario with the fitted values", result))
    return page(
        title,
        [
            *fit_section,
            Section("Summary", (table(comparison.summary()),)),
            Section("Loops", (means,)),
            Section(
                "Pictures", (picture(ComparisonPicture(title=title).figure(comparison), caption),)
            ),
            Section("Provenance", tuple(texts)),
            _again(f"historysim {'fit' if fitted else 'compare'} scenario.toml"),
        ],
    )


def _again(command: str) -> Section:
    text = "The scenario above, saved as scenario.toml where its files are, recomputes it:"
    return Section("How to reproduce", (paragraph(text), code(command)))


def dataset_page(dataset: xr.Dataset, figures: Sequence[str] = ()) -> str:
    """Render the page of a Dataset of this program, by its content; ``figures`` are its pictures, as HTML.

    Raises
    ------
    InputError
        Another Dataset.
    """
    if dataset.attrs.get("content") == SWEEP:
        return sweep_page(dataset, figures)
    content = dataset.attrs.get("content")
    if content in {LOOPS, CONTENT_OF_TABLE}:
        return loops_page(dataset)
    if content in {TABLE, TIME_SERIES, CONTENT_OF_FRETTING}:
        return table_page(dataset)
    if "total_normal_load" in dataset:
        return history_page(standard_layout(dataset), figures)
    raise InputError(f"this Dataset has no report; {EXPECTED}")
