"""Snapshots: states beside the events of a log, from which a replay can begin: a shortcut, never a truth."""

import hashlib
import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Self

import attrs

from historysim._version import __version__
from historysim.asperities.ensemble import Ensemble
from historysim.loads.schedule import Cursor

if TYPE_CHECKING:
    from historysim.asperities.state import EnsembleState


@attrs.frozen
class Snapshot:
    """A state and where in the log it stands."""

    cursor: Cursor
    """Events that are done, rows that are recorded, and what the channels are on their way to."""
    batches: int
    """Batches of the log that the state depends on, the one with the events ahead included."""
    link: bytes
    """Link of the last of them."""
    program: str
    """Versions that computed the state."""
    state: bytes = attrs.field(repr=False)
    """See `EnsembleState.to_bytes`."""
    written: str = ""
    """Which file has the rows before it; empty where none are written."""

    @classmethod
    def of(
        cls,
        cursor: Cursor,
        batches: int,
        link: bytes,
        state: "EnsembleState",
        written: str = "",
        *,
        packages: Iterable[str] = (),
    ) -> Self:
        """Take a snapshot of a state, which packages of others may have computed, too."""
        return cls(cursor, batches, link, program(packages), state.to_bytes(), written)

    @property
    def text(self) -> str:
        """What stands beside the state, as JSON."""
        written = {"written": self.written} if self.written else {}
        return json.dumps({**attrs.asdict(self.cursor), "batches": self.batches, "program": self.program, **written})

    @property
    def digest(self) -> bytes:
        """SHA-256 of all of it."""
        return snapshot_digest(self.text, self.link, self.state)


def snapshot_digest(text: str, link: bytes, state: bytes) -> bytes:
    """Return the SHA-256 of a snapshot."""
    return hashlib.sha256(link + hashlib.sha256(text.encode()).digest() + state).digest()


def snapshot_from(text: str, link: bytes, state: bytes) -> Snapshot:
    """Take a snapshot from a file."""
    fields: dict[str, Any] = json.loads(text)
    batches, made_by, written = fields.pop("batches"), fields.pop("program"), fields.pop("written", "")
    cursor = Cursor(fields["events"], fields["rows"], fields["time"], tuple(fields["heading"]))
    return Snapshot(cursor, batches, link, made_by, state, written)


def program(packages: Iterable[str] = ()) -> str:
    """Return what computes states here: another version may give other bits; another machine does not."""
    return ", ".join((f"historysim {__version__}", *packages))


def unpacked(ensemble: Ensemble, content: bytes) -> "EnsembleState":
    """Return the state of an ensemble that a snapshot holds; other bytes are an InputError."""
    from historysim.asperities.state import EnsembleState

    return EnsembleState.from_bytes(content, ensemble.initial_state())
