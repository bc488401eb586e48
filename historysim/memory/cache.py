"""What was compiled in this room, kept on the disk until any file of the room changes.

Numba keeps what it compiled beside the source (in ``__pycache__``), or, where that cannot be written, in the user's
cache folder; ``NUMBA_CACHE_DIR`` names another place. Of itself it would not do here for two reasons.

It takes machine code as good while the one file is unchanged that the function stands in. The functions of this room
call one another across files, so that all files count.

Machine code of a function holds copies of the functions that it calls, optimised once more, and their sums may come
out otherwise in the last bits. Of several copies in a process the one that came first is used. Whoever compiles has
compiled what is called before; so whoever loads has to load it before, too, or the first result would
differ from all later ones.
"""

import hashlib
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile


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

_functions: dict[str, Any] = {}
"""The functions of the room, by name."""

_present: dict[str, tuple[str, Any]] = {}
"""Machine code in this process, in the order in which it came: symbol → function and signature."""


class _InOrder(CompileResultCacheImpl):
    """Machine code together with what had come before it where it was compiled."""

    def reduce(self, compiled: Any) -> Any:
        return dict(_present), super().reduce(compiled)

    def rebuild(self, target_context: Any, kept: Any) -> Any:
        before, code = kept
        for symbol, (name, signature) in before.items():
            if name in _functions and symbol not in _present:
                _functions[name].compile(signature)
                if symbol not in _present:
                    raise LookupError(f"{name} is no longer the one that was called")
        return super().rebuild(target_context, code)


class RoomCache(FunctionCache):
    """Numba's cache of one function, stamped with the content of the whole room, and loaded in the order of compiling.

    It is a shortcut: where a file of it is damaged, or cannot be written, the function is compiled all the same.
    """

    _impl_class = _InOrder

    def __init__(self, function: Any) -> None:
        super().__init__(function.py_func)
        self._function = f"{function.__module__}.{function.__qualname__}"
        _functions[self._function] = function
        self._cache_file = IndexDataCacheFile(self.cache_path, self._impl.filename_base, STAMP)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature, or None."""
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # noqa: BLE001 - unpickling damaged bytes may raise anything
            return None
        if found is not None:
            _present[found.fndesc.mangled_name] = self._function, sig
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, if the disk lets it."""
        try:
            super().save_overload(sig, data)
        except OSError:
            self.disable()
        _present[data.fndesc.mangled_name] = self._function, sig
