"""Snapshots: the state at one moment of a log, as bytes, with what it depends on. A shortcut, never a truth."""

import hashlib
import io
import json
import zipfile
from typing import Any, Self

import attrs
import numpy as np

from historysim._version import __version__
from historysim.asperities.ensemble import Ensemble, EnsembleState
from historysim.errors import InputError
from historysim.loads.schedule import Standing
from historysim.memory.layout import EXCESS, Memory
from historysim.recording.provenance import made_with


@attrs.frozen
class Snapshot:
    """A state and where in the log it stands.

    Attributes
    ----------
    standing : Standing
        Events that are done, rows that are recorded, and what the channels are on their way to.
    batches : int
        Batches of the log that the state depends on, the one with the events ahead included.
    link : bytes
        Link of the last of them.
    program : str
        Versions that computed the state.
    state : bytes
        See `packed`.
    """

    standing: Standing
    batches: int
    link: bytes
    program: str
    state: bytes = attrs.field(repr=False)

    @classmethod
    def of(cls, standing: Standing, batches: int, link: bytes, state: EnsembleState) -> Self:
        """Take a snapshot of a state."""
        return cls(standing, batches, link, program(), packed(state))

    @property
    def text(self) -> str:
        """What stands beside the state, as JSON."""
        return json.dumps({**attrs.asdict(self.standing), "batches": self.batches, "program": self.program})

    @property
    def digest(self) -> bytes:
        """SHA-256 of all of it."""
        return hashlib.sha256(self.link + hashlib.sha256(self.text.encode()).digest() + self.state).digest()


def snapshot_from(text: str, link: bytes, state: bytes) -> Snapshot:
    """Take a snapshot from a file."""
    told: dict[str, Any] = json.loads(text)
    batches, made_by = told.pop("batches"), told.pop("program")
    standing: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in told.items()}
    return Snapshot(Standing(**standing), batches, link, made_by, state)


def program() -> str:
    """Say what computes states here: another version may give other bits."""
    return f"historysim {__version__}, {made_with()}"


def packed(state: EnsembleState) -> bytes:
    """Return a state as bytes (NPZ).

    Of the vertex stacks only what is filled is kept: the room above is not part of the state. The geometry
    is that of the ensemble, in the order that is kept.
    """
    memory, depth = state.memory, state.memory.depth
    filled = np.arange(memory.vertices.shape[1]) < depth[:, np.newaxis]
    buffer = io.BytesIO()
    np.savez(
        buffer,
        order=state.order,
        first=state.contact.first,
        friction=state.contact.friction,
        vertices=memory.vertices[filled],
        depth=depth,
        steep=memory.steep,
        dissipated=memory.dissipated,
        now=memory.now,
        control=np.array([state.normal_control, state.tangential_control]),
    )
    return buffer.getvalue()


def unpacked(ensemble: Ensemble, content: bytes) -> EnsembleState:
    """Return the state of an ensemble that `packed` has made bytes of.

    Raises
    ------
    InputError
        Bytes that are no state of this ensemble.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            kept = {name: file[name] for name in file.files}
        return _state(ensemble, kept)
    except (KeyError, ValueError, IndexError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"is no state of these asperities ({error})") from error


def _state(ensemble: Ensemble, kept: dict[str, Any]) -> EnsembleState:
    beginning = ensemble.initial_state()
    gap, weight = np.empty(ensemble.elements), np.empty(ensemble.elements)
    gap[beginning.order], weight[beginning.order] = beginning.contact.gap, beginning.contact.weight
    order, depth = kept["order"], kept["depth"]
    vertices = np.zeros((depth.size, max(int(depth.max(initial=0)), 1) + 2, beginning.memory.vertices.shape[2]))
    vertices[np.arange(vertices.shape[1]) < depth[:, np.newaxis]] = kept["vertices"]
    contact = beginning.contact._replace(
        gap=gap[order], weight=weight[order], first=kept["first"], friction=kept["friction"]
    )
    now = beginning.memory.now.copy()
    # in snapshots of earlier versions, which are longer, what follows is no part of the state
    told = now.size if kept["now"].size == now.size else EXCESS
    now[:told] = kept["now"][:told]
    memory = Memory(vertices=vertices, depth=depth, steep=kept["steep"], dissipated=kept["dissipated"], now=now)
    normal, tangential = kept["control"].tolist()
    return attrs.evolve(
        beginning, contact=contact, order=order, memory=memory, normal_control=normal, tangential_control=tangential
    )
