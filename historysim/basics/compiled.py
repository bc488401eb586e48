"""How functions are compiled that call no others: those of the room `memory` do, and have a way of their own."""

import contextlib
from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Return a function compiled, whose machine code is kept on the disk where a folder can be written.

    Other threads go on while it runs.
    """
    made: Any = njit(error_model="numpy", nogil=True)(function)
    # numba refuses where neither the package nor the home can be written, and may change what it does not promise
    with contextlib.suppress(ImportError, AttributeError, TypeError, RuntimeError, OSError):
        from historysim.basics.kept_code import KeptCode

        made._cache = KeptCode(made.py_func)  # noqa: SLF001 - numba's own enable_caching does no more
    return made
