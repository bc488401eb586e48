"""What takes long and depends on its arguments alone is kept in a folder of the user's, by their digest."""

import hashlib
import os
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from historysim.basics.files import replacing

Floats = npt.NDArray[np.float64]

FORM = b"3"
"""Changes whenever the same arguments are to be computed anew."""
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

    A file that is damaged is computed again; where none can be written, nothing is kept.
    """
    digest = hashlib.sha256(FORM)
    for array in arguments:
        digest.update(repr((array.shape, array.dtype.str)).encode() + array.tobytes())
    path = folder() / f"{name}_{digest.hexdigest()[:32]}.npz"
    try:
        with zipfile.ZipFile(path) as file:
            whole = file.testzip() is None
        if whole:
            with np.load(path, allow_pickle=False) as arrays:
                return {key: arrays[key] for key in arrays.files}
    except DAMAGE:
        pass
    found = compute()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as unfinished, unfinished.open("wb") as stream:
            np.savez_compressed(stream, allow_pickle=False, **found)
    except OSError:
        pass
    return found
