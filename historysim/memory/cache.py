"""What was compiled in this room, kept on the disk until any file of the room changes.

Numba keeps what it compiled beside the source (in ``__pycache__``), or, where that cannot be written, in the user's
cache folder; ``NUMBA_CACHE_DIR`` names another place. It takes it as good while the one file is unchanged that the
function stands in. The functions of this room call one another across files, so here all of them count.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile


def digest(folder: Path) -> str:
    """Return a digest of the names and contents of all Python files of a folder."""
    files = sorted(folder.glob("*.py"))
    if not files:
        raise OSError(f"{folder} holds no source files")
    told = hashlib.sha256()
    for file in files:
        told.update(f"{file.name} {hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return told.hexdigest()


STAMP = digest(Path(__file__).parent)


class RoomCache(FunctionCache):
    """Numba's cache of one function, stamped with the content of the whole room.

    It is a shortcut: where a file of it is damaged, or cannot be written, the function is compiled all the same.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file = IndexDataCacheFile(self.cache_path, self._impl.filename_base, STAMP)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature, or None."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # noqa: BLE001 - unpickling damaged bytes may raise anything
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, if the disk lets it."""
        try:
            super().save_overload(sig, data)
        except OSError:
            self.disable()
