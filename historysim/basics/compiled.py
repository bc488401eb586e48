"""How functions are compiled that call no others: those of the room `memory` do, and have a way of their own."""

import contextlib
import functools
import sys
from collections.abc import Callable
from threading import Lock
from typing import Any, TypeVar, cast

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Return a function compiled where it is first called, whose machine code is kept where a folder can be written.

    Other threads go on while it runs.
    """
    made: list[Any] = []
    lock = Lock()

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        if not made:
            with lock:
                if not made:
                    made.append(_made(function))
        return made[0](*arguments)

    return cast("Function", call)


def compiled_for_more_than(few: int) -> Callable[[Function], Function]:
    """Return what makes functions `compiled`, but has Python carry them out for few items of their first argument.

    To load numba takes as long as Python takes for some ten thousand items; where it is loaded it is used for all. The
    bits are the same of functions that add, compare and round as they are written.
    """

    def with_machine_code(function: Function) -> Function:
        machine_code = compiled(function)

        @functools.wraps(function)
        def call(items: Any, *arguments: Any) -> Any:
            if items.size > few or "numba" in sys.modules:
                return machine_code(items, *arguments)
            # machine code does not warn
            with np.errstate(all="ignore"):
                return function(items, *arguments)

        return cast("Function", call)

    return with_machine_code


def _made(function: Any) -> Any:
    from numba import njit

    made: Any = njit(error_model="numpy", nogil=True)(function)
    # numba refuses where neither the package nor the home can be written, and may change what it does not promise
    with contextlib.suppress(ImportError, AttributeError, TypeError, RuntimeError, OSError):
        from historysim.basics.kept_code import KeptCode

        made._cache = KeptCode(made.py_func)  # noqa: SLF001 - numba's own enable_caching does no more
    return made
