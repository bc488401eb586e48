"""Contacts for other programs: co-simulation units (FMU), and reduced models of few sliding springs with a bound."""

from pathlib import Path
from typing import NamedTuple

from historysim.asperities.integration import IntegratedBody
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError
from historysim.replaying import Replay
from historysim.scenario.run import Source, open_source
from historysim.scenario.scenario import Scenario

EVOLVES = "friction or summits change (a law of friction, wear, summits that yield, or events)"
CONSTANT = "expected constant coefficients and summits"

# A scenario or its file, a log, a result, or a replay
Exportable = Scenario | Source | Replay | str | Path


class Exported(NamedTuple):
    """Replay to export, with its name, its title and the files it was read from."""

    replay: Replay
    name: str
    title: str
    files: tuple[Path, ...]

    @property
    def ensemble(self) -> IntegratedBody:
        """The ensemble, which has one traction memory; InputError for inclined asperities, which have several."""
        body = self.replay.ensemble
        if not isinstance(body, IntegratedBody):
            raise InputError(
                "the asperities are inclined, which exports do not support; expected level asperities"
            )
        return body


def resolve_export(origin: Exportable, notify: Notify = silent) -> Exported:
    """Resolve a source to a replay for export; InputError if it cannot be exported."""
    if isinstance(origin, Replay):
        export = Exported(origin, "contact", "", ())
    else:
        source = open_source(origin)
        header, events, _ = source.content(notify)
        title = str(header.settings.get("title", ""))
        export = Exported(header.replay(events), source.files[0].stem, title, source.files)
    _ = export.ensemble
    return export
