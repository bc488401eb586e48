"""Types of arrays, and values with read-only arrays."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
Booleans = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class FrozenArrays:
    """A frozen attrs class with slots and read-only arrays, also after pickling and copying.

    numpy forgets on the way that an array is read-only. The class is made with ``getstate_setstate=False``, since attrs
    would else put its own method in the place of this one.
    """

    __slots__ = ()

    def __setstate__(self, state: tuple[None, dict[str, Any]]) -> None:
        for name, value in state[1].items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)
