"""How the functions of this room are compiled.

There are three kinds:

- `compiled`: machine code of its own, in which each operation is rounded as it is written. All that decides, such as
  where slip ends, is of this kind.
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
from numba.extending import intrinsic

Array = TypeVar("Array", bound=npt.NDArray[Any])
Function = TypeVar("Function", bound=Callable[..., Any])


def kept(function: Any) -> Any:
    """Return a function of numba whose machine code is kept on the disk, where that can be had.

    It cannot where no folder can be written, or where numba no longer has the interface that `cache` builds on,
    which it does not promise; then it is compiled anew in each process.
    """
    with contextlib.suppress(ImportError, AttributeError, TypeError, RuntimeError, OSError):
        from historysim.memory.cache import RoomCache

        function._cache = RoomCache(function)  # noqa: SLF001 - see above
    return function


def compiled(function: Function) -> Function:
    """Return a function compiled, each operation rounded as it is written; other threads go on while it runs."""
    return kept(njit(error_model="numpy", nogil=True)(function))


def reordered(function: Function) -> Function:
    """Return a function compiled, whose sums may be added in any order."""
    return kept(njit(error_model="numpy", fastmath={"reassoc", "contract", "nsz"})(function))


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
