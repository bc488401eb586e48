"""Random numbers of a seed."""

import numpy as np

from historysim.errors import InputError


def generator(seed: object) -> np.random.Generator:
    """Return the random numbers of a seed, by PCG64.

    Raises
    ------
    InputError
        A seed that is not a whole number of 0 or more.
    """
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise InputError(f"seed is {seed!r}; expected a whole number of 0 or more, which draws the same numbers again")
    return np.random.Generator(np.random.PCG64(int(seed)))
