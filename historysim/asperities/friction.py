"""Friction laws, and which asperities share one coefficient."""

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.errors import InputError

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


def coulomb(friction: npt.ArrayLike, count: int) -> Floats:
    """Return one constant coefficient μ per asperity, as Coulomb's law has it.

    Parameters
    ----------
    friction : array_like
        One coefficient for all asperities, or one per asperity; 0 or more.
    count : int
        Number of asperities.

    Returns
    -------
    array (asperity)

    Raises
    ------
    InputError
        A coefficient that is negative or not finite, or another number of coefficients.
    """
    coefficients = checked("friction", friction, least=0)
    if coefficients.ndim > 1 or coefficients.size not in {1, count}:
        raise InputError(
            f"friction has shape {coefficients.shape}; expected one coefficient, or one for each of {count} asperities"
        )
    return np.array(np.broadcast_to(coefficients, count))


def groups(*keys: npt.NDArray[np.generic]) -> Integers:
    """Return the friction group of each asperity, a number from 0: those that are alike in every key share one.

    Asperities that have had the same coefficient ever since they touched share one traction memory.
    """
    numbers = np.zeros(len(keys[0]), dtype=np.int64)
    for key in keys:
        _, rank = np.unique(key, return_inverse=True)
        _, numbers = np.unique(numbers * (rank.max() + 1) + rank, return_inverse=True)
    return numbers
