"""What was compiled in this room, kept on the disk until any file of the room changes.

Numba keeps what it compiled beside the source (in ``__pycache__``), or, where that cannot be written, in the user's
cache folder; ``NUMBA_CACHE_DIR`` names another place. Of itself it would not do here for three reasons.

It takes machine code as good while the one file is unchanged that the function stands in. The functions of this room
call one another across files, so that all files count.

Machine code of a function calls others by name, and holds copies of short ones, optimised once more, whose sums may
come out otherwise in the last bits (see `linking`). Of several copies in a process the one that came first is used.
Whoever compiles has compiled what is called before; so whoever loads has to load it before, too.

What lies beside the source came with the package, or is its owner's: it is loaded also where it cannot be added to.
"""

import contextlib
import hashlib
from pathlib import Path
from typing import Any, Self
from weakref import WeakValueDictionary

from numba.core import config
from numba.core.caching import CompileResultCacheImpl, IndexDataCacheFile, _CacheLocator

from historysim.basics.kept_code import KeptCode
from historysim.memory import linking


def digest(folder: Path) -> str:
    """Return a digest of the names and contents of all Python files of a folder."""
    files = sorted(folder.glob("*.py"))
    if not files:
        raise OSError(f"{folder} holds no source files")
    told = hashlib.sha256()
    for file in files:
        told.update(f"{file.name} {hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return told.hexdigest()


def beside(source: Path) -> Path:
    """Return the folder for what is compiled of a source file, beside it."""
    return source.parent / "__pycache__"


STAMP = digest(Path(__file__).parent)

_functions: dict[str, Any] = {}
"""The functions of the room, by name."""

_present: dict[str, tuple[str, Any]] = {}
"""Machine code in this process, in the order in which it came: symbol → function and signature."""

_libraries: WeakValueDictionary[str, Any] = WeakValueDictionary()
"""The same: symbol → machine code."""


class _Nowhere(_CacheLocator):
    """For where nothing can be written: neither beside the source, nor in a folder of the user."""

    def __init__(self, function: Any, source: str) -> None:
        self._function, self._source = function, Path(source)

    @classmethod
    def from_function(cls, function: Any, source: str) -> Self:
        return cls(function, source)

    def ensure_cache_path(self) -> None:
        raise OSError(f"{self.get_cache_path()} cannot be written")

    def get_cache_path(self) -> str:
        return str(beside(self._source))

    def get_source_stamp(self) -> str:
        return STAMP

    def get_disambiguator(self) -> str:
        return str(self._function.__code__.co_firstlineno)


class _InOrder(CompileResultCacheImpl):
    """Machine code together with what had come before it where it was compiled."""

    _locator_classes = [*CompileResultCacheImpl._locator_classes, _Nowhere]  # noqa: RUF012, SLF001 - numba has it so

    def reduce(self, compiled: Any) -> Any:
        code, *rest = super().reduce(compiled)
        return dict(_present), (linking.with_symbols(compiled.library, code), *rest)

    def rebuild(self, target_context: Any, kept: Any) -> Any:
        before, code = kept
        for symbol, (name, signature) in before.items():
            if name in _functions and symbol not in _present:
                _functions[name].compile(signature)
                if symbol not in _present:
                    raise LookupError(f"{name} is no longer the one that was called")
        rebuilt = super().rebuild(target_context, code)
        callees = [_libraries[symbol] for symbol in before if symbol in _libraries]
        linking.belongs(rebuilt.library, named=False, callees=callees)
        return rebuilt


class RoomCache(KeptCode):
    """Numba's cache of one function, stamped with the content of the whole room, and loaded in the order of compiling.

    It is a shortcut: where a file of it is damaged, or cannot be written, the function is compiled all the same.
    """

    _impl_class: Any = _InOrder

    def __init__(self, function: Any, *, named: bool) -> None:
        super().__init__(function.py_func)
        self._function = f"{function.__module__}.{function.__qualname__}"
        _functions[self._function] = function
        self._named = named
        _compile_as_of_the_room(function)
        places = [self.cache_path]
        if not getattr(config, "CACHE_DIR", ""):
            places.append(str(beside(Path(function.py_func.__code__.co_filename))))
        self._files = [IndexDataCacheFile(place, self._impl.filename_base, STAMP) for place in dict.fromkeys(places)]
        self._cache_file = self._files[0]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature, or None."""
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # noqa: BLE001 - unpickling damaged bytes may raise anything
            return None
        if found is not None:
            self._note(found, sig)
        return found

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        key = self._index_key(sig, target_context.codegen())
        kept = next((kept for file in self._files if (kept := file.load(key)) is not None), None)
        return None if kept is None else self._impl.rebuild(target_context, kept)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, if the disk lets it."""
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)
        self._note(data, sig)

    def _note(self, compiled: Any, sig: Any) -> None:
        symbol = compiled.fndesc.mangled_name
        _present[symbol], _libraries[symbol] = (self._function, sig), compiled.library
        linking.belongs(compiled.library, named=self._named)


def _compile_as_of_the_room(function: Any) -> None:
    """Have a function call those of the room as `linking` has it."""
    compiler = function._compiler  # noqa: SLF001 - see `compiled.kept`
    compile_it = compiler.compile

    def compile_inside(args: Any, return_type: Any) -> Any:
        with linking.of_the_room():
            return compile_it(args, return_type)

    linking.install()
    compiler.compile = compile_inside
