"""The compiled C library of the package, and a guard for objects that one caller may use at a time."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from historysim.errors import InputError, InstallationError

try:
    from historysim.basics import _declarations

    ffi: Any = _declarations.ffi
    lib: Any = ffi.dlopen(str(Path(__file__).with_name(_declarations.LIBRARY)))
except (ImportError, OSError) as error:
    raise InstallationError(
        f"the compiled library of historysim cannot be loaded ({error}); expected it in {Path(__file__).parent}, where "
        "installing puts it: in a clone run `pip install -e .`, elsewhere `pip install --force-reinstall historysim`"
    ) from error

_NAMES = {"f8": "double[]", "i8": "int64_t[]", "i1": "int8_t[]", "u1": "uint8_t[]", "?": "bool[]"}
_ROWS = {np.dtype(name): pointed for name, pointed in _NAMES.items()}


def pointer(array: npt.NDArray[Any]) -> Any:
    """Return a C pointer to a contiguous array, which has to outlive the call; ValueError if it is not contiguous."""
    return ffi.from_buffer(_ROWS[array.dtype], array)


class OneAtATime:
    """Non-blocking guard of an object that is modified in place; ``with`` acquires and releases it.

    It costs a third of a lock. In tight loops ``del guard.free[0]`` acquires it (IndexError if it
    is in use), and ``guard.free.append(None)`` releases it; both are atomic. `what` is "the
    stepper: remedy".
    """

    __slots__ = ("_what", "free")

    def __init__(self, resource: str) -> None:
        self._what = resource
        self.free = [None]

    def lock_error(self) -> InputError:
        """Return the error raised for a second caller."""
        subject, mend = self._what.split(": ", 1)
        return InputError(
            f"{subject} is in use, by another thread or by a law that it calls; expected {mend}"
        )

    def __enter__(self) -> None:
        try:
            del self.free[0]
        except IndexError:
            raise self.lock_error() from None

    def __exit__(self, *_: object) -> None:
        self.free.append(None)

    def copy_guard(self) -> "OneAtATime":
        """Return the guard of a copy of the object."""
        return OneAtATime(self._what)
