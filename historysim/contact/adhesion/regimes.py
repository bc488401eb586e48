"""The adhesion map: which theory holds for a contact.

Johnson and Greenwood, *J. Colloid Interface Sci.* 192 (1997) 326-333.
"""

import enum
import math

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.contact.adhesion import dugdale
from historysim.contact.adhesion.pull_off import carried

DMT_BELOW, JKR_ABOVE = 0.1, 5.0
"""The Maugis parameters below which `regime` takes DMT, and above which it takes JKR, for Maugis."""

NEGLIGIBLE = 0.05
"""The share that `regime` neglects: of adhesion in the load, of the elastic compression in z0."""


class Regime(enum.StrEnum):
    """A zone of the adhesion map, and the theory that holds in it."""

    HERTZ = "hertz"
    DMT = "dmt"
    MAUGIS = "maugis"
    JKR = "jkr"
    RIGID = "rigid"

    @property
    def label(self) -> str:
        """The name as it is written: ``"Hertz"``, ``"JKR"``."""
        return self.value.upper() if self in {Regime.DMT, Regime.JKR} else self.value.capitalize()


def regime(maugis_parameter: npt.ArrayLike, load_parameter: npt.ArrayLike) -> Regime | npt.NDArray[np.object_]:
    """Return the zone of the adhesion map in which a contact lies.

    The map is that of Johnson and Greenwood (1997), in their coordinates and with their limit of 5 %. The zone is the
    first of these that holds:

    - Hertz, above `hertz_boundary`: adhesion is at most 5 % of the load.
    - JKR for λ > 5, and Maugis for λ ≥ 0.1. At these limits the pull-off load of Maugis differs by 0.4 % from that
      of JKR and by 2.5 % from that of DMT.
    - rigid (Bradley) below `rigid_boundary`: the elastic compression is less than 5 % of z0.
    - DMT for the rest.

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], between 1e-12 and 1e12.
    load_parameter : array_like
        N/(πWR) [1], negative where it pulls, and no less than the pull-off load: -2 for λ < 0.1, that of Maugis
        beyond.

    Returns
    -------
    Regime or array of Regime
        A member for scalars.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    LoadError
        A load beyond pull-off.

    Notes
    -----
    The limits λ = 0.1 and λ = 5, the same at every load, are those commonly quoted for DMT and JKR. They are a choice.
    So is the order: a contact that is both rigid and dominated by its load is called Hertz, which gives its contact
    radius.
    """
    parameter = dugdale.solvable(maugis_parameter)
    pull_off = np.where(parameter < DMT_BELOW, -2.0, dugdale.state_at(dugdale.load_turn(parameter), parameter).load)
    load = carried("load_parameter", load_parameter, pull_off, "πWR")
    zone = np.select(
        [
            load >= hertz_boundary(parameter),
            parameter > JKR_ABOVE,
            parameter >= DMT_BELOW,
            load < rigid_boundary(parameter),
        ],
        [0, 3, 2, 4],
        default=1,
    )
    found: Regime | npt.NDArray[np.object_] = np.array(list(Regime), dtype=object)[zone]
    return found


def hertz_boundary(maugis_parameter: npt.ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1] from which on adhesion is at most 5 % of the load.

    Adhesion is the Hertz load 4E*a³/(3R) at the contact radius, less N. The boundary, found with Maugis, is 40 for
    λ → 0 (DMT, whose adhesion is 2πWR) and 2520 for λ → ∞ (JKR).

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], between 1e-12 and 1e12.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    parameter = dugdale.solvable(maugis_parameter)

    def excess(t: Floats) -> Floats:
        state = dugdale.state_at(t, parameter)
        return (1 + NEGLIGIBLE) * state.load - state.radius**3

    return dugdale.state_at(dugdale.crossing(excess, dugdale.load_turn(parameter)), parameter).load


def rigid_boundary(maugis_parameter: npt.ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1] below which the elastic compression is less than 5 % of z0.

    The compression is the Hertz approach under N + 2πWR, with Bradley's attraction of rigid spheres. Over z0 it is
    (9√3 π/32) λ (N/(πWR) + 2)^(2/3), so that λ > 0.0206 leaves only loads that pull.

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    unit_over_separation = 9 * math.sqrt(3) * math.pi / 32 * checked("maugis_parameter", maugis_parameter, above=0)
    return (NEGLIGIBLE / unit_over_separation) ** 1.5 - 2
