"""A scenario in a few lines."""

import numpy as np

from historysim.basics.units import duration_text, quantity_text
from historysim.basics.wording import counted
from historysim.loads.event_sequence import time_text
from historysim.recording.provenance import validity_findings
from historysim.scenario.scenario import Scenario
from historysim.scenario.sections import SweepSection
from historysim.scenario.surface_kinds import BuiltSurface


def summary(scenario: Scenario, *, walk: float = 0.0) -> list[tuple[str, str]]:
    """Check a scenario and return it in lines of (label, text), with a warning for each broken assumption of the model.

    Parameters
    ----------
    scenario : Scenario
    walk : float
        Seconds for which its loads are walked; a line says how far, where that is not enough.

    Raises
    ------
    InputError
        The scenario, or a file that it names, cannot be used as it is.
    LoadError
        Loads that were walked, and that the contact cannot carry.
    """
    surface = scenario.surface()
    notices = list(surface.notices)
    built = scenario.build(notices.append, surface)
    ensemble, events, contact = built.ensemble, built.events, built.adhering()
    with scenario.placed():
        reached = built.walk(walk) if walk else None
    recorded = scenario.record if isinstance(scenario.record, str) else f"{len(scenario.record):,} chosen"
    before = scenario.unprepared_surface()
    return [
        ("title", " ".join(scenario.title.split()) or scenario.path.stem),
        ("asperities", f"{len(ensemble):,}"),
        ("events", f"{len(events):,} over {duration_text(events[-1].time - events[0].time)}"),
        ("substeps", str(scenario.substeps)),
        ("recorded asperities", recorded),
        *([("friction", ensemble.law.text)] if ensemble.law else []),
        *([("wear", ensemble.wear.text)] if ensemble.wear else []),
        *([("yielding", ensemble.yielding.text)] if ensemble.yielding else []),
        *([("sweep", _sweep_line(scenario.sections.sweep))] if scenario.sections.sweep else []),
        *([("map as it comes", _map_line(before)), ("map as prepared", _map_line(built.surface))] if before else []),
        *(contact.summary() if contact else []),
        *(("note", notice) for notice in notices),
        *([("note", _walked_line(reached, walk))] if reached is not None else []),
        *(("warning", finding.text) for finding in validity_findings(ensemble, events, scenario.instrument)),
    ]


def _walked_line(reached: float, seconds: float) -> str:
    return (
        f"the loads were walked up to t = {time_text(reached)} within {seconds:g} s, and not beyond; the environment "
        "variable HISTORYSIM_MOST_SECONDS_OF_VALIDATION gives more time"
    )


def _sweep_line(sweep: SweepSection) -> str:
    grid = sweep.grid()
    axes = " × ".join(f"{len(axis.values)} of {' with '.join(axis.keys)}" for axis in grid.axes)
    return f"{counted(len(grid), 'cell', 'cells')}: {axes}"


def _map_line(built: BuiltSurface) -> str:
    """Return the statistics of a map and its summits in a line."""
    surface, summits = built.surface, built.summits
    if surface is None or summits is None:
        return "none"
    statistics = surface.statistics()
    heights = f"Rq {quantity_text(statistics.rms_height, 'm')}, Rz {quantity_text(statistics.height_range, 'm')}"
    points = " × ".join(map(str, surface.shape))
    radius = quantity_text(float(np.median(summits.radius)), "m")
    slope = f"rms slope {statistics.rms_slope:.3g}"
    return f"{points} points, {heights}, {slope}, {len(summits):,} summits, median radius {radius}"
