"""Values whose arrays cannot be changed, wherever they come from."""

from typing import Any

import numpy as np


class FrozenArrays:
    """A frozen attrs class with slots whose arrays are read-only, also where it was pickled or copied.

    numpy forgets on the way that an array is read-only. The class is made with ``getstate_setstate=False``, since attrs
    would else put its own method in the place of this one.
    """

    __slots__ = ()

    def __setstate__(self, state: tuple[None, dict[str, Any]]) -> None:
        for name, value in state[1].items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)
