"""Contacts for other programs: a unit of co-simulation (FMU), and models of few springs that slide, with a bound."""

from pathlib import Path
from typing import NamedTuple

from historysim.basics.wording import Notify, silent
from historysim.errors import InputError
from historysim.replaying import Replay
from historysim.scenario.run import Source, source_of
from historysim.scenario.scenario import Scenario

EVOLVES = "friction or summits change (a law of friction, wear, summits that yield, or events)"
CONSTANT = "expected constant coefficients and summits"

Exportable = Scenario | Source | Replay | str | Path  # A scenario or its file, a log, a result, or a replay


class Exported(NamedTuple):
    """A replay, what it is called, and the files that it was read from."""

    replay: Replay
    name: str
    title: str
    files: tuple[Path, ...]


def exported(given: Exportable, notify: Notify = silent) -> Exported:
    """Return what is exported; InputError where it cannot be used as it is."""
    if isinstance(given, Replay):
        found = Exported(given, "contact", "", ())
    else:
        source = source_of(given)
        header, events, _ = source.content(notify)
        title = str(header.settings.get("title", ""))
        found = Exported(header.replay(events), source.files[0].stem, title, source.files)
    if found.replay.ensemble.slope is not None:
        raise InputError("the asperities are inclined, which no export follows; expected level ones")
    return found
