"""Preliminary displacement: what is read off a branch, and what each reading is in θμδ.

The preliminary displacement of theory, θμδ with θ = E*/(4 G*) and the approach δ, is that of virgin loading: how far a
contact that was never loaded tangentially goes until all of it slides. A branch of a loop does not begin there, so that
what is read off it is another length. For one sphere at a constant normal load N, which slid before the reversal, with
the share q of the way from the load at the reversal to the friction force that is covered at the displacement u,

    u = 2 θμδ z(q),  z(q) = 1 - (1 - q)^(2/3)

- ``preliminary_displacement``, from the reversal to a share p: 2 z(p) θμδ, 1.73 θμδ for p = 0.95, and 2 θμδ to slip;
- ``displacement_from_zero_load``, to the same place: 2 (z(p) - z(1/2)) θμδ, 0.99 θμδ for p = 0.95, and 2^(1/3) θμδ =
  1.26 θμδ to slip, as the source has it;
- ``virgin_displacement``: θμδ itself, by Mindlin's curve through the branch.

The first two end where the load first reaches F(p) = T_reversal + p (F - T_reversal). To slip itself, p = 1, no record
leads: the last percent of the load is on a twentieth of the way to slip, and noise hides where it ends. The third is
half the slope of the least-squares line of u over z(q), of all samples from the share 1 - p to p; u stands on the left
since it has the noise, and the line needs neither the place of the reversal nor that of slip. The reversal lies between
samples; so T_reversal is there the greater one of the loads of the outermost sample and the one before it. Behind an
instrument of lateral stiffness k, (T - T_reversal)/k is taken off u first. For a surface of many asperities it is the
θμδ of the sphere that is nearest.

With the noise of the instruments here, 1 nm and 6 µN (theory, section 10), and a sample every 2.5 nm, tests find the
first two off by less than 1 nm, since the reversal is neither on a sample nor free of noise, and the third by less than
2 % at θμδ = 9.4 and 23.2 nm (on the mean of 39 loops, which scatter by 0.6 and 0.3 nm).
"""

import math

import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats

LEAST_SAMPLES = 4
"""Of a branch up to slip, from which on Mindlin's curve is laid through it."""


def covered(share: npt.ArrayLike) -> Floats:
    """Return z(q), the way from the reversal over that to slip, on a sphere, at shares of the load."""
    way: Floats = 1 - (1 - np.asarray(share, dtype=np.float64)) ** (2 / 3)
    return way


def reversal_factor(reached: float) -> float:
    """Return the displacement from the reversal to a share of the way to the friction force, over θμδ, on a sphere."""
    return float(2 * covered(reached))


def zero_load_factor(reached: float) -> float:
    """Return the displacement from zero load to a share of the way to the friction force, over θμδ, on a sphere."""
    return float(2 * (covered(reached) - covered(0.5)))


def virgin_displacement(
    u: Floats, f: Floats, force: float, *, reversal_load: float, reached: float, lateral_stiffness: float
) -> float:
    """Return θμδ by Mindlin's curve through a branch; NaN where fewer than four samples lie on it.

    Parameters
    ----------
    u, f : array (sample)
        Displacement from the reversal [m] and tangential load [N], in the direction of the branch.
    force : float
        Friction force [N], greater than the load at the reversal.
    reversal_load : float
        The load at the reversal, in the direction of the branch [N].
    reached : float
        The share of the way to it up to which the curve is fitted, and from whose difference to 1 on; between 0 and 1.
    lateral_stiffness : float
        Of an instrument in series [N/m], or inf.
    """
    share = (f - reversal_load) / (force - reversal_load)
    beyond = share >= reached
    end = int(beyond.argmax()) if beyond.any() else 0
    # what slid before the reversal, or has not left it yet, is not on the curve
    part = np.flatnonzero(share[:end] >= 1 - reached)
    way = covered(share[part])
    moved = u[part] - (f[part] - reversal_load) / lateral_stiffness
    if moved.size < LEAST_SAMPLES:
        return math.nan
    across = way - way.mean()
    slope = float(across @ moved) / float(across @ across) if np.any(across) else math.nan
    return slope / 2 if slope > 0 else math.nan
