"""A scenario in a few lines."""

from historysim.basics.units import duration_text
from historysim.recording import validity
from historysim.scenario.scenario import Scenario


def summary(scenario: Scenario) -> list[tuple[str, str]]:
    """Return what a scenario asks for, in a few lines; it is checked on the way.

    Parameters
    ----------
    scenario : Scenario

    Returns
    -------
    list of (label, text)
        Title, asperities, events and how long they last, substeps, what is recorded, with ``[adhesion]`` how
        adhesive the asperities are, what is to be known about how the surface was made, and a warning for each
        assumption of the model that does not hold at the greatest load.

    Raises
    ------
    InputError
        The scenario, or a file that it names, cannot be used as it is.
    """
    ground = scenario.ground()
    notices = list(ground.notices)
    ensemble, events = scenario.checked(ground, notices.append)
    contact = scenario.adhering(ensemble, events)
    recorded = scenario.record if isinstance(scenario.record, str) else f"{len(scenario.record):,} chosen"
    return [
        ("title", " ".join(scenario.title.split()) or scenario.path.stem),
        ("asperities", f"{len(ensemble):,}"),
        ("events", f"{len(events):,} over {duration_text(events[-1].time - events[0].time)}"),
        ("substeps", str(scenario.substeps)),
        ("recorded asperities", recorded),
        *(contact.summary() if contact else []),
        *(("note", notice) for notice in notices),
        *(("warning", finding.text) for finding in validity.findings(ensemble, events, scenario.instrument)),
    ]
