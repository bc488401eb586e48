"""What takes long and depends on its arguments alone is kept in a folder of the user's, by their digest."""

import hashlib
import os
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats
from historysim.basics.files import replacing
from historysim.basics.limits import check_archive

FORM = b"5"
"""Changes whenever the same arguments are to be computed anew."""
DIGEST = "digest"
"""Name of the digest of all other arrays of a file."""
DAMAGE = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, tokenize.TokenError)


def folder() -> Path:
    """Return where it is kept: historysim in the system's folder for caches, which may be emptied at any time."""
    if given := os.environ.get("HISTORYSIM_CACHE"):
        return Path(given)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "historysim"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "historysim"


def kept(name: str, arguments: Sequence[Floats], compute: Callable[[], dict[str, Floats]]) -> dict[str, Floats]:
    """Return what is computed from arguments, from the folder where it was before.

    A file that is damaged, or holds anything else than what was computed, is computed again; where none can be written,
    nothing is kept.
    """
    path = folder() / f"{name}_{_digest(enumerate(arguments))[:32]}.npz"
    try:
        check_archive(path)
        with np.load(path, allow_pickle=False) as arrays:
            found = {key: arrays[key] for key in arrays.files}
        if str(found.pop(DIGEST, "")) == _digest(found.items()):
            return found
    except DAMAGE:
        pass
    found = compute()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as unfinished, unfinished.open("wb") as stream:
            np.savez_compressed(stream, allow_pickle=False, **found, **{DIGEST: np.array(_digest(found.items()))})
    except OSError:
        pass
    return found


def _digest(arrays: Iterable[tuple[object, npt.NDArray[Any]]]) -> str:
    found = hashlib.sha256(FORM)
    for name, array in arrays:
        found.update(repr((name, array.shape, array.dtype.str)).encode() + array.tobytes())
    return found.hexdigest()
