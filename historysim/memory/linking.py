"""How machine code of the functions of this room calls one another: by name, as programs of several files do.

Numba copies whatever a function calls into its machine code and optimises all of it once more, so that what stands
ten levels down is compiled ten times over. Here long functions are compiled once and alone, and only short ones, for
which a call would matter, are copied into what calls them. A function of another program that calls one of this room
still gets copies of all that it needs, and stands by itself.
"""

import gc
import itertools
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any
from weakref import WeakKeyDictionary, WeakSet

from llvmlite import binding
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

_callees: WeakKeyDictionary[Any, list[Any]] = WeakKeyDictionary()
"""Machine code of the room, with that which it calls."""

_named: WeakSet[Any] = WeakSet()
"""That of it which is called by name."""

_depth = [0]
"""Functions of the room that are being compiled, one within the other."""


WITH_SYMBOLS = "object with its symbols"
"""What `with_symbols` calls machine code, in the place of numba's ``"object"``."""

OBJECTS_BETWEEN_COLLECTIONS = 20_000
"""Of Python, while it compiles."""


class Library(JITCodeLibrary):
    """Machine code that calls the functions of the room by name where it is one of them itself.

    What others would copy of it is read from the disk when one does.
    """

    _to_copy: bytes | None = None

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, str, Any]) -> Any:
        name, kind, data = state
        if kind != WITH_SYMBOLS:
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        code, library._to_copy, symbols = data  # noqa: SLF001 - one of this class
        library.enable_object_caching()
        library._set_compiled_object(code)  # noqa: SLF001
        library._finalize_final_module()  # noqa: SLF001
        codegen._engine._defined_symbols |= symbols  # noqa: SLF001 - numba takes them from what is to be copied
        return library

    def _get_module_for_linking(self) -> Any:
        if self._to_copy is not None:
            self._shared_module, self._to_copy = binding.parse_bitcode(self._to_copy), None
        return super()._get_module_for_linking()

    def add_linking_library(self, library: Any) -> None:
        """Take copies of what machine code holds, unless that is called by name."""
        if library not in _callees:
            super().add_linking_library(library)
        elif not _depth[0]:
            for each in _needed(library):
                super().add_linking_library(each)
        else:
            _callees.setdefault(self, []).append(library)
            if library not in _named:
                super().add_linking_library(library)


def with_symbols(library: Any, state: tuple[str, str, Any]) -> tuple[str, str, Any]:
    """Return machine code as it is kept on the disk, with the names of what it defines beside it."""
    name, _, (code, to_copy) = state
    module = library._get_module_for_linking()  # noqa: SLF001 - see `compiled.kept`
    told = itertools.chain(module.functions, module.global_variables)
    return name, WITH_SYMBOLS, (code, to_copy, {each.name for each in told if not each.is_declaration})


def install() -> None:
    """Have numba make libraries of the kind above from now on."""
    cpu_target.target_context.codegen()._library_class = Library  # noqa: SLF001 - see `compiled.kept`


@contextmanager
def of_the_room() -> Iterator[None]:
    """Compile a function of the room inside, while no other thread compiles.

    Compiling makes millions of small objects, most of which stay: to look among them for waste every few hundred takes
    a tenth of the time.
    """
    with global_compiler_lock:
        _depth[0] += 1
        before = gc.get_threshold()
        gc.set_threshold(max(before[0], OBJECTS_BETWEEN_COLLECTIONS) if before[0] else 0, *before[1:])
        try:
            yield
        finally:
            gc.set_threshold(*before)
            _depth[0] -= 1


def belongs(library: Any, *, named: bool, callees: Iterable[Any] = ()) -> None:
    """Note that machine code is of the room, whether it is called by name, and what it may call if nobody saw it."""
    _callees.setdefault(library, []).extend(callees)
    if named:
        _named.add(library)


def _needed(library: Any) -> list[Any]:
    """Return machine code of the room with all that it calls, and what that calls: what calls before what is called.

    Of what is linked only that is taken which has been called for.
    """
    found, waiting = {library}, [library]
    while waiting:
        new = [each for each in _callees.get(waiting.pop(), ()) if each not in found]
        found.update(new)
        waiting.extend(new)
    # what came to be later is called by nothing that came before
    return [each for each in reversed(list(_callees)) if each in found]
