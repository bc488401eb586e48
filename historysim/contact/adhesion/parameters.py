"""What says how adhesive a contact is: work of adhesion, Tabor parameter, Maugis parameter, load parameter.

Tabor, *J. Colloid Interface Sci.* 58 (1977) 2-13; Maugis, *J. Colloid Interface Sci.* 150 (1992) 243-269.
"""

import math

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.errors import InputError

MAUGIS_OVER_TABOR: float = 16 / (9 * math.sqrt(3)) * (9 / (2 * math.pi)) ** (1 / 3)
"""λ/μ_T = 1.1570…: from σ0 = 16 W/(9√3 z0) and λ = σ0 (9R/(2πWE*²))^(1/3)."""


def work_of_adhesion(first: npt.ArrayLike, second: npt.ArrayLike, interfacial: npt.ArrayLike | None = None) -> Floats:
    """Return the work of adhesion W [J/m²] of two surfaces: W = γ1 + γ2 - γ12, or 2√(γ1 γ2).

    Parameters
    ----------
    first, second : array_like
        Surface energies γ1, γ2 [J/m²], > 0.
    interfacial : array_like, optional
        Energy γ12 [J/m²] of the interface between them, ≥ 0 and less than γ1 + γ2 (Dupré). Where it is not known, the
        geometric mean of the works of cohesion 2γ1 and 2γ2 is taken, which is good for dispersion forces (Girifalco
        and Good, *J. Phys. Chem.* 61 (1957) 904-909, with Φ = 1). Both give 2γ for one material on itself.

    Raises
    ------
    InputError
        A number that is not finite or out of its range; an interface with more energy than the surfaces.
    """
    energies = checked("first", first, above=0), checked("second", second, above=0)
    if interfacial is None:
        return 2 * np.sqrt(energies[0] * energies[1])
    energy = checked("interfacial", interfacial, least=0)
    work = energies[0] + energies[1] - energy
    if np.any(work <= 0):
        raise InputError(
            f"interfacial is {interfacial!r} J/m² between surfaces of {first!r} and {second!r} J/m², which do not "
            "adhere; expected an interfacial energy less than the sum of the two"
        )
    return work


def tabor_parameter(
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Floats:
    """Return the Tabor parameter μ_T [1]: (R W²/(E*² z0³))^(1/3), the elastic neck over the range of the attraction.

    Parameters
    ----------
    summit_radius : array_like
        R [m], > 0.
    contact_modulus : array_like
        E* [Pa], > 0.
    work_of_adhesion : array_like
        W [J/m²], > 0.
    equilibrium_separation : array_like
        z0 [m], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    radius, modulus, work = elastic(summit_radius, contact_modulus, work_of_adhesion)
    separation = checked("equilibrium_separation", equilibrium_separation, above=0)
    return np.cbrt(radius * (work / modulus) ** 2) / separation


def maugis_parameter(
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Floats:
    """Return the Maugis parameter λ [1]: σ0 (9R/(2πWE*²))^(1/3) with σ0 = 16 W/(9√3 z0), which is 1.157 μ_T.

    Arguments and errors as in `tabor_parameter`.
    """
    return MAUGIS_OVER_TABOR * tabor_parameter(
        summit_radius=summit_radius,
        contact_modulus=contact_modulus,
        work_of_adhesion=work_of_adhesion,
        equilibrium_separation=equilibrium_separation,
    )


def load_parameter(
    normal_load: npt.ArrayLike, *, summit_radius: npt.ArrayLike, work_of_adhesion: npt.ArrayLike
) -> Floats:
    """Return the load parameter [1]: N/(πWR).

    Parameters
    ----------
    normal_load : array_like
        N [N], negative where it pulls.
    summit_radius : array_like
        R [m], > 0.
    work_of_adhesion : array_like
        W [J/m²], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    work = checked("work_of_adhesion", work_of_adhesion, above=0)
    return checked("normal_load", normal_load) / (np.pi * work * checked("summit_radius", summit_radius, above=0))


def elastic(
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    *,
    may_be_zero: bool = False,
) -> tuple[Floats, Floats, Floats]:
    """Return R, E* and W as floats.

    Raises
    ------
    InputError
        A number that is not finite or not positive; a work of adhesion of 0 where that may not be.
    """
    return (
        checked("summit_radius", summit_radius, above=0),
        checked("contact_modulus", contact_modulus, above=0),
        checked("work_of_adhesion", work_of_adhesion, **({"least": 0} if may_be_zero else {"above": 0})),
    )
