"""The package's C, compiled at installation: one library for all rooms, and what one caller at a time may use of it."""

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
    """Return the memory of an array for C, which is contiguous (else a ValueError) and has to outlive the call."""
    return ffi.from_buffer(_ROWS[array.dtype], array)


class OneAtATime:
    """The one place at an object that is changed in place; ``with`` takes it, and gives it back.

    It costs a third of a lock. Where that counts, ``del place.free[0]`` takes it (an IndexError: it is taken), and
    ``place.free.append(None)`` gives it back, which no thread comes between. `what` is "the stepper: how to have two".
    """

    __slots__ = ("_what", "free")

    def __init__(self, what: str) -> None:
        self._what = what
        self.free = [None]

    def taken(self) -> InputError:
        """Return the error of whoever comes second."""
        what, mend = self._what.split(": ", 1)
        return InputError(f"{what} is in use, by another thread or by a law that it asks; expected {mend}")

    def __enter__(self) -> None:
        try:
            del self.free[0]
        except IndexError:
            raise self.taken() from None

    def __exit__(self, *_: object) -> None:
        self.free.append(None)

    def another(self) -> "OneAtATime":
        """Return that of a copy of the object."""
        return OneAtATime(self._what)
