"""The coefficients of asperities: those at the start, given or of a friction law, and where a path goes to others."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.laws.friction_law import FrictionLaw
from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.errors import InputError


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


def at_start(friction: npt.ArrayLike | FrictionLaw, count: int) -> Floats:
    """Return one coefficient μ per asperity before anything has happened; parameters and errors as for `coulomb`.

    Of a law that depends on the load it is 0, since what carries no load has no friction.
    """
    return coulomb(friction.at_start(count) if isinstance(friction, FrictionLaw) else friction, count)


@attrs.frozen(eq=False)
class FrictionGoal:
    """Coefficients (asperity) that a path goes a fraction of the way to, from where they are."""

    coefficients: Floats
    fraction: float = 1.0
