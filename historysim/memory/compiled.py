"""How the functions of this room are compiled.

There are four kinds:

- `compiled`: machine code of its own, in which each operation is rounded as it is written. All that decides, such as
  where slip ends, is of this kind. `entry` is the same for what Python calls, too, which takes a wrapper; `short` for
  what is copied into the machine code that calls it (see `linking`).
- `reordered`: long sums over asperities. They may be added in any order, and a product and a sum may share one
  rounding, so that the processor handles several asperities at once.
- `fused`: long loops over asperities without such sums. A product and a sum may share one rounding.
- `inlined`: short steps that are written out where they are used. A call between functions takes each array apart and
  counts the references to it, which for small groups costs more than the physics.

They hand lean arrays to one another (see `lean`), of which an `entry` makes those that it is given.
"""

import contextlib
from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit, types
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.registry import CPUDispatcher

from historysim.memory.lean import is_lean

Function = TypeVar("Function", bound=Callable[..., Any])

# options that the types of numba do not know
WITHOUT_C_WRAPPER: dict[str, Any] = {"no_cfunc_wrapper": True}


# passes for closures, comprehensions, branches on None, sums of arrays and the like, of which there are none here
UNNEEDED = {
    "WithLift",
    "RewriteSemanticConstants",
    "DeadBranchPrune",
    "InlineClosureLikes",
    "MakeFunctionToJitFunction",
    "FindLiterallyCalls",
    "LiteralUnroll",
    "InlineOverloads",
    "NopythonRewrites",
}


class _Compiler(CompilerBase):
    """Numba's compiler without passes that find nothing to do here, a tenth of its time."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        usual = DefaultPassBuilder.define_nopython_pipeline(self.state)
        usual.passes = [each for each in usual.passes if each[0].__name__ not in UNNEEDED]
        usual.finalize()
        return [usual]


class _OfTheRoom(CPUDispatcher):
    """A function that is compiled once for numbers of a kind, whether they are constants or not."""

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        """Return what numba calls for arguments of these types."""
        plain = {name: types.unliteral(kind) for name, kind in named.items()}
        return super().get_call_template([types.unliteral(kind) for kind in arguments], plain)


class _Inner(_OfTheRoom):
    """A function without a wrapper, which Python would take for an address."""

    def __call__(self, *_arguments: Any, **_named: Any) -> Any:
        raise TypeError(f"{self.py_func.__name__} is called by compiled functions alone; expected an `entry`")


def kept(function: Any, *, named: bool = True) -> Any:
    """Return a function of numba whose machine code is kept on the disk, where that can be had.

    It cannot where no folder can be written, or where numba no longer has the interface that `cache` builds on,
    which it does not promise; then it is compiled anew in each process.
    """
    with contextlib.suppress(ImportError, AttributeError, TypeError, RuntimeError, OSError):
        from historysim.memory.cache import RoomCache

        function._cache = RoomCache(function, named=named)  # noqa: SLF001 - see above
    return function


def _made(
    function: Any,
    kind: type[_OfTheRoom] = _OfTheRoom,
    *,
    named: bool = True,
    fastmath: Any = False,
    **options: Any,
) -> Any:
    # without a word on rounding, what a `reordered` function is the first to call would be rounded as that is
    options |= {"error_model": "numpy", "fastmath": fastmath, "pipeline_class": _Compiler}
    made: Any = njit(**WITHOUT_C_WRAPPER, **options)(function)
    made.__class__ = kind
    _with_wrapper_for_python(made)
    return kept(made, named=named)


def _with_wrapper_for_python(function: Any) -> None:
    """Have a function compiled with a wrapper where Python has such arguments, which are not lean.

    It is decided where compiling begins: to look for machine code that is kept may compile the same function before,
    for other arguments.
    """
    compiler = function._compiler  # noqa: SLF001 - see `kept`
    compile_it = compiler.compile

    def compile_for(kinds: Any, return_type: Any) -> Any:
        inside = isinstance(function, _Inner) or any(is_lean(kind) for kind in kinds)
        compiler.targetoptions["no_cpython_wrapper"] = inside
        return compile_it(kinds, return_type)

    compiler.compile = compile_for


def compiled(function: Function) -> Function:
    """Return a function compiled for compiled functions alone, each operation rounded as it is written."""
    return _made(function, _Inner)


def entry(function: Function) -> Function:
    """Return a function compiled for Python, too; other threads go on while it runs."""
    return _made(function, nogil=True)


def short(function: Function) -> Function:
    """Return a function compiled as an `entry`, and copied into compiled functions that call it."""
    return _made(function, named=False)


def reordered(function: Function) -> Function:
    """Return a function compiled as a `short` one, whose sums may be added in any order."""
    return _made(function, named=False, fastmath={"reassoc", "contract", "nsz"})


def fused(function: Function) -> Function:
    """Return a function compiled as a `short` one, in which a product and a sum may share one rounding."""
    return _made(function, named=False, fastmath={"contract"})


def inlined(function: Function) -> Function:
    """Return a function that is written out wherever a compiled one calls it."""
    written_out: Any = njit(error_model="numpy", inline="always")(function)
    return written_out
