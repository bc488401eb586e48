"""Summary of a scenario: its sizes, laws and maps, with notes and warnings; loads replayed for a limited time."""

from time import monotonic
from typing import TYPE_CHECKING

import attrs

from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.loads.event_sequence import over_text, time_text
from historysim.recording.provenance import validity_findings
from historysim.recording.recorder import StateOnly
from historysim.recording.unknown_past import past_lines
from historysim.replaying import Replay
from historysim.scenario.optional_sections import SweepSection
from historysim.scenario.scenario import Scenario
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.loads.schedule import Cursor

WALKED_AT_ONCE = 256  # event times between two checks of the clock


class _EndedError(Exception):
    """The time limit of a trial replay is reached; its argument is the time [s] of the last event."""


def replay_for(job: Replay, seconds: float) -> float | None:
    """Replay the loads for some seconds without recording; errors as for `Replay`.

    Returns the time of the last event reached [s]; None if all events were replayed.
    """
    deadline = monotonic() + seconds

    def look(cursor: "Cursor", _: object) -> None:
        if monotonic() > deadline and cursor.events < len(job.events):
            raise _EndedError(cursor.time)

    job = attrs.evolve(job, substeps=1, record="totals")
    # with evolving asperities one event may take a second
    rows = WALKED_AT_ONCE if job.changes.steady else 1
    try:
        job.walk(job.recorder(StateOnly), most_rows=rows, on_event=look)
    except _EndedError as ended:
        return float(ended.args[0])
    return None


def summary(scenario: Scenario, *, walk: float = 0.0) -> list[tuple[str, str]]:
    """Check a scenario and summarise it in lines of (label, text), with warnings for violated assumptions of the model.

    Its loads are replayed for ``walk`` seconds; a line states how far if that is not enough.

    Raises InputError and LoadError: wrong input, and loads that the contact cannot support.
    """
    surface = scenario.surface()
    notices = list(surface.notices)
    built = scenario.build(notices.append, surface)
    ensemble, events = built.replay.ensemble, built.replay.events
    contact = scenario.adhering(built.replay)
    with scenario.locate_errors():
        reached = replay_for(built.replay, walk) if walk else None
    if reached is not None:
        notices.append(
            f"the loads were checked up to t = {time_text(reached)} within {walk:g} s; the environment "
            "variable HISTORYSIM_MOST_SECONDS_OF_VALIDATION allows more time"
        )
    raw_surface, sweep = scenario.raw_surface(), scenario.sections.sweep
    return [
        ("title", " ".join(scenario.title.split()) or scenario.path.stem),
        ("asperities", f"{len(ensemble):,}"),
        ("events", f"{len(events):,}{over_text(events)}"),
        ("substeps", str(scenario.sections.loading.substeps)),
        ("recorded asperities", scenario.sections.record.text),
        *past_lines(scenario.sections.loading.past),
        *((name, law.text) for name, law in ensemble.laws.items()),
        *([("sweep", _sweep_line(sweep))] if sweep else []),
        *(
            [
                ("map as it comes", _map_line(raw_surface)),
                ("map as prepared", _map_line(built.surface)),
            ]
            if raw_surface
            else []
        ),
        *(contact.summary() if contact else []),
        *(("note", notice) for notice in notices),
        *(
            ("warning", finding.text)
            for finding in validity_findings(ensemble, events, scenario.instrument)
        ),
    ]


def _sweep_line(sweep: SweepSection) -> str:
    grid = sweep.grid()
    axes = " × ".join(f"{len(axis.values)} of {' with '.join(axis.keys)}" for axis in grid.axes)
    return f"{count_text(len(grid), 'cell', 'cells')}: {axes}"


def _map_line(built: BuiltSurface) -> str:
    """Summarise a map and its summits in one line."""
    import numpy as np

    surface, summits = built.surface, built.summits
    if surface is None or summits is None:
        return "none"
    statistics = surface.statistics()
    heights = f"Rq {quantity_text(statistics.rms_height, 'm')}, Rz {quantity_text(statistics.height_range, 'm')}"
    points = " × ".join(map(str, surface.shape))
    radius = quantity_text(float(np.median(summits.radius)), "m")
    slope = f"rms slope {statistics.rms_slope:.3g}"
    return f"{points} points, {heights}, {slope}, {len(summits):,} summits, median radius {radius}"
