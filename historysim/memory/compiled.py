"""How the functions of this room are compiled.

There are three kinds:

- `compiled`: machine code of its own, in which each operation is rounded as it is written. All that decides, such as
  where slip ends, is of this kind. `entry` is the same for what Python calls, too, which takes a wrapper; `short` for
  what is copied into the machine code that calls it (see `linking`).
- `reordered`: long sums over asperities. They may be added in any order, and a product and a sum may share one
  rounding, so that the processor handles several asperities at once.
- `inlined`: short steps that are written out where they are used. A call between functions takes each array apart and
  counts the references to it, which for small groups costs more than the physics.
"""

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import numpy.typing as npt
from numba import njit, types
from numba.core import cgutils
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic

Array = TypeVar("Array", bound=npt.NDArray[Any])
Function = TypeVar("Function", bound=Callable[..., Any])

# options that the types of numba do not know
WITHOUT_C_WRAPPER: dict[str, Any] = {"no_cfunc_wrapper": True}
WITHOUT_WRAPPERS: dict[str, Any] = WITHOUT_C_WRAPPER | {"no_cpython_wrapper": True}


class _Inner(CPUDispatcher):
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


def compiled(function: Function) -> Function:
    """Return a function compiled for compiled functions alone, each operation rounded as it is written."""
    made: Any = njit(error_model="numpy", **WITHOUT_WRAPPERS)(function)
    made.__class__ = _Inner
    return kept(made)


def entry(function: Function) -> Function:
    """Return a function compiled for Python, too; other threads go on while it runs."""
    return kept(njit(error_model="numpy", nogil=True, **WITHOUT_C_WRAPPER)(function))


def short(function: Function) -> Function:
    """Return a function compiled as an `entry`, and copied into compiled functions that call it."""
    return kept(njit(error_model="numpy", **WITHOUT_C_WRAPPER)(function), named=False)


def reordered(function: Function) -> Function:
    """Return a function compiled as a `short` one, whose sums may be added in any order."""
    fastmath = {"reassoc", "contract", "nsz"}
    return kept(njit(error_model="numpy", fastmath=fastmath, **WITHOUT_C_WRAPPER)(function), named=False)


def inlined(function: Function) -> Function:
    """Return a function that is written out wherever a compiled one calls it."""
    written_out: Any = njit(error_model="numpy", inline="always")(function)
    return written_out


if TYPE_CHECKING:

    def uncounted(array: Array, /) -> Array:
        """See below; numba's own type for it would hide that of the array."""

else:

    @intrinsic
    def uncounted(_context: Any, array: types.Array) -> Any:
        """View of an array that numba does not count references to; something else has to keep the array alive.

        Numba counts the references that a call takes with an atomic operation per array, which for small
        groups costs more than the physics.
        """

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            view = context.make_helper(builder, signature.args[0], value=arguments[0])
            view.meminfo = cgutils.get_null_value(view.meminfo.type)
            return view._getvalue()  # noqa: SLF001 - numba's own way to take the value out

        return array(array), generate
