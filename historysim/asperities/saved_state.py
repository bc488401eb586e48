"""States as bytes and as files."""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from historysim._version import __version__
from historysim.asperities.evolved import Evolved
from historysim.asperities.state import FORMAT, EnsembleState
from historysim.errors import InputError
from historysim.memory.layout import EXCESS, Memory


def packed(state: EnsembleState) -> bytes:
    """Return a state as bytes (NPZ).

    It is without the geometry, which is that of its ensemble in the order that is kept, unless asperities evolve.
    """
    content = state.content
    if state.evolved is None:
        del content["gap"], content["weight"]
    buffer = io.BytesIO()
    np.savez(buffer, **content)  # type: ignore[arg-type] # they are arrays, none of its options
    return buffer.getvalue()


def unpacked(beginning: EnsembleState, content: bytes) -> EnsembleState:
    """Return the state of an ensemble, which has a beginning, that `packed` has made bytes of.

    Raises
    ------
    InputError
        Bytes that are no state of this ensemble.
    """
    return _state(beginning, _arrays(content))


def read(beginning: EnsembleState, path: Path) -> EnsembleState:
    """Return the state of an ensemble, which has a beginning, from a file that `EnsembleState.save` has written.

    Raises
    ------
    InputError
        A file that is none of a state, one that a later version wrote, or one of other asperities.
    OSError
        The file cannot be read.
    """
    try:
        kept = _arrays(path.read_bytes())
        _check_format(kept)
        state = _state(beginning, kept)
        _check_geometry(state, kept)
    except KeyError as error:
        raise InputError(f"{path}: is no saved state ({error} is missing); expected a file of state.save") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return state


def _check_format(kept: dict[str, Any]) -> None:
    made = int(kept["format"])
    if made > FORMAT:
        raise InputError(
            f"holds a state of format {made}, written by historysim {kept['program']}; expected one of format {FORMAT} "
            f"or lower: read it with that version; this one is {__version__}"
        )


def _check_geometry(state: EnsembleState, kept: dict[str, Any]) -> None:
    if state.evolved is not None:
        return
    for name, mine in (("gap", state.contact.gap), ("weight", state.contact.weight)):
        if mine.tobytes() != kept[name].tobytes():
            raise InputError("holds the state of other asperities; expected one of this ensemble's")


def _arrays(content: bytes) -> dict[str, Any]:
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (KeyError, ValueError, IndexError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"is no state of these asperities ({error})") from error


def _state(beginning: EnsembleState, kept: dict[str, Any]) -> EnsembleState:
    try:
        return _filled(beginning, kept)
    except (ValueError, IndexError) as error:
        raise InputError(f"is no state of these asperities ({error})") from error


def _filled(beginning: EnsembleState, kept: dict[str, Any]) -> EnsembleState:
    count = beginning.order.size
    gap, weight = np.empty(count), np.empty(count)
    gap[beginning.order], weight[beginning.order] = beginning.contact.gap, beginning.contact.weight
    order, depth = kept["order"], kept["depth"]
    evolved = Evolved.of(kept)
    if evolved is not None:
        gap[order], weight[order] = kept["gap"], kept["weight"]
    vertices = np.zeros((depth.size, max(int(depth.max(initial=0)), 1) + 2, beginning.memory.vertices.shape[2]))
    vertices[np.arange(vertices.shape[1]) < depth[:, np.newaxis]] = kept["vertices"]
    contact = beginning.contact._replace(
        gap=gap[order], weight=weight[order], first=kept["first"], friction=kept["friction"]
    )
    if evolved is not None:
        by_gap = np.argsort(gap, kind="stable")
        contact = contact._replace(sorted_gap=gap[by_gap], sorted_weight=weight[by_gap])
    now = beginning.memory.now.copy()
    # in snapshots of earlier versions, which are longer, what follows is no part of the state
    told = now.size if kept["now"].size == now.size else EXCESS
    now[:told] = kept["now"][:told]
    memory = Memory(vertices=vertices, depth=depth, steep=kept["steep"], dissipated=kept["dissipated"], now=now)
    normal, tangential = kept["control"].tolist()
    return EnsembleState(contact, order, memory, beginning.units, normal, tangential, evolved=evolved)
