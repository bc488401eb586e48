"""What a history was made from: the replay that made it, the log beside its file, or its file, which has its events."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol, Self, TypeVar

import attrs

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import EnsembleState
from historysim.errors import InputError
from historysim.loads.events import Event
from historysim.log import embedded_log
from historysim.log.event_log import EventLog
from historysim.log.result import digest_attribute, log_beside
from historysim.recording.provenance import MADE_BY
from historysim.replaying import Replay
from historysim.results.analysis.recorded import Recorded

Answer = TypeVar("Answer")


class Traceable(Recorded, Protocol):
    """A history that says which file it comes from, or which replay has made it."""

    @property
    def encoding(self) -> Mapping[Any, Any]:
        """With the file as ``source``."""


@attrs.frozen(eq=False)
class Origin:
    """Ensemble and events of a history.

    Attributes
    ----------
    ensemble : Ensemble
    events : sequence of Event
    state : callable
        Returns the state at a time [s].
    surface : mapping of str to array
        The surface, as it stands in the result.
    settings : mapping
        What the head of the log says beside.
    replay : callable
        Returns the replay of the events that the history was made by.
    """

    ensemble: Ensemble
    events: Sequence[Event]
    state: Callable[[float], EnsembleState]
    surface: Mapping[str, Any]
    settings: Mapping[str, Any]
    replay: Callable[[], Replay]

    @classmethod
    def of_replay(cls, job: Replay) -> Self:
        """Return that of a history in memory."""
        return cls(job.ensemble, job.events, lambda at: job.state(until=at), {}, {}, lambda: job)

    @classmethod
    def of_log(cls, log: EventLog) -> Self:
        """Return that of a log, which goes on from snapshots, while it is open."""
        return cls(log.ensemble, log.events(), lambda at: log.state(at=at), log.surface, log.settings, log.job)

    @classmethod
    def of_result(cls, path: Path) -> Self:
        """Return that of a result by itself.

        Raises
        ------
        InputError
            It does not hold its events, as those of earlier versions, or it is damaged.
        """
        head, content = embedded_log.read(path)
        job = head.replay(content.events)
        return cls(
            job.ensemble, content.events, lambda at: job.state(until=at), head.surface, head.settings, lambda: job
        )


def ask_origin(history: Traceable, question: Callable[[Origin], Answer]) -> Answer | None:
    """Return what the origin of a history answers; None where the history comes from no file that has it.

    Parameters
    ----------
    history : xarray.Dataset, or a result in its file
    question : callable
        Is given the origin, and raises InputError where that does not answer it.
    """
    if isinstance(job := history.encoding.get(MADE_BY), Replay):
        with suppress(InputError):
            return question(Origin.of_replay(job))
        return None
    source = history.encoding.get("source")
    if not source:
        return None
    path = Path(source)
    with suppress(InputError), EventLog(log_beside(path)) as log:
        if history.attrs.get("log_digest") == digest_attribute(bytes.fromhex(log.digest))["log_digest"]:
            return question(Origin.of_log(log))
    with suppress(InputError):
        return question(Origin.of_result(path))
    return None
