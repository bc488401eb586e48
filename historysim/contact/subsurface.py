"""Stresses below a Hertz contact under normal and tangential load, in closed form, for any Poisson's ratio.

The half-space is z ≥ 0, with the load on its surface. By Boussinesq and Cerruti the stress of a
surface load q is a sum of derivatives of the harmonic potentials ∬ q pₙ dξ dη, with p₀ = 1/ρ and
∂pₙ₊₁/∂z = pₙ (Johnson 1985, section 3.2). The load √(a² - r²) is a line of point loads at the
complex depths w = z + it, |t| ≤ a, so that two integrations by parts leave the potentials at w = z
+ ia (Hamilton 1983, *Proc. Inst. Mech. Eng. C* 197, 53-59; Sackfield and Hills 1983).
"""

import numpy as np

from historysim.basics.arguments import ArrayLike, Floats, as_floats, scalar
from historysim.errors import InputError

MIN_POISSONS_RATIO, MAX_POISSONS_RATIO = -1.0, 0.5  # of isotropic materials
TINY_ROOT = 1e-100  # of R over the radius, in place of 0: its inverse is finite


class _Potentials:
    """Derivatives of the potentials of the load (peak/a) √(a² - r²), over 4π.

    The horizontal derivatives follow from those by s = r², of which R = √(s + w²) and e = 1/(R + w)
    are the parts: ∂e/∂w = -e/R and ∂e/∂s = -e²/(2R).
    """

    def __init__(self, x: Floats, y: Floats, z: Floats, radius: float) -> None:
        self.x, self.y, self._radius = x, y, radius
        self._w = w = z + 1j * radius
        root = np.sqrt(x * x + y * y + w * w)
        # at the edge on the surface every term with 1/R has the factor z = 0
        self._root = root = np.where(root == 0.0, TINY_ROOT * radius, root)
        self._e = 1.0 / (root + w)

    def _load(self, inner: Floats, outer: Floats) -> Floats:
        """Combine the second and the third integral of a potential along w."""
        return -(self._radius * inner.real - outer.imag) / (2.0 * self._radius)

    def dz(self) -> Floats:
        """∂Φ₀/∂z, which is -2π q at the surface."""
        log = np.log(self._root + self._w)
        return self._load(log, self._w * log - self._root)

    def dzz(self) -> Floats:
        """∂²Φ₀/∂z²."""
        return self._load(1.0 / self._root, np.log(self._root + self._w))

    def ds_dz(self) -> Floats:
        """∂²Φ₀/∂s∂z."""
        return self._load(self._e / (2.0 * self._root), -0.5 * self._e)

    def ds(self) -> Floats:
        """∂Φ₀/∂s."""
        w, e = self._w, self._e
        return self._load(-0.5 * e, -0.25 * (np.log(self._root + w) + w * e))

    def dss(self) -> Floats:
        """∂²Φ₀/∂s²."""
        return self._load(self._e**2 / (4.0 * self._root), -(self._e**2) / 8.0)

    def ds_1(self) -> Floats:
        """∂Φ₁/∂s."""
        w, e, root = self._w, self._e, self._root
        log = np.log(root + w)
        outer = w * log - root + e * (root * root + root * w + w * w) / 3.0
        return self._load(-0.25 * (log + w * e), -0.25 * outer)

    def dss_1(self) -> Floats:
        """∂²Φ₁/∂s²."""
        w, e = self._w, self._e
        return self._load(-(e**2) / 8.0, (2.0 * e - w * e**2) / 24.0)

    def dsss_1(self) -> Floats:
        """∂³Φ₁/∂s³."""
        return self._load(self._e**3 / (8.0 * self._root), -(self._e**3) / 24.0)

    def dss_2(self) -> Floats:
        """∂²Φ₂/∂s²."""
        w, e = self._w, self._e
        outer = (3.0 * np.log(self._root + w) + 5.0 * w * e - (w * e) ** 2) / 96.0
        return self._load((2.0 * e - w * e**2) / 24.0, outer)

    def dsss_2(self) -> Floats:
        """∂³Φ₂/∂s³."""
        w, e = self._w, self._e
        return self._load(-(e**3) / 24.0, (3.0 * e**2 - 2.0 * w * e**3) / 192.0)


def normal_stress(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, *, radius: float, peak: float, poissons_ratio: float
) -> Floats:
    """Return the stress under a Hertz pressure.

    Parameters
    ----------
    x, y, z : array_like
        Distances from the middle of the contact, z ≥ 0 into the body [m]; they broadcast.
    radius : float
        Contact radius a [m], > 0.
    peak : float
        Largest pressure p₀ of p(r) = p₀ √(1 - r²/a²) [Pa].
    poissons_ratio : float
        Of the body, from -1 to 0.5.

    Returns
    -------
    array (…, 3, 3)
        Stress tensor [Pa], tension positive.

    Raises
    ------
    InputError
        A number out of range, or a point above the surface.
    """
    (x, y, z), nu = _points(x, y, z), _checked_ratio(poissons_ratio)
    scale = scalar("peak", peak)
    potential = _Potentials(x, y, z, scalar("radius", radius, above=0))
    vertical, ds = potential.dz(), potential.ds()
    # second horizontal derivatives of Φ₁ and of z Φ₀
    first = (2.0 * nu - 1.0) * potential.ds_1() - z * ds
    second = (2.0 * nu - 1.0) * potential.dss_1() - z * potential.dss()
    shear = -4.0 * z * potential.ds_dz()
    return scale * _tensor(
        xx=4.0 * nu * vertical + 4.0 * first + 8.0 * x * x * second,
        yy=4.0 * nu * vertical + 4.0 * first + 8.0 * y * y * second,
        zz=2.0 * vertical - 2.0 * z * potential.dzz(),
        xy=8.0 * x * y * second,
        xz=shear * x,
        yz=shear * y,
    )


def tangential_stress(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, *, radius: float, peak: float, poissons_ratio: float
) -> Floats:
    """Return the stress under a traction along x, q(r) = q₀ √(1 - r²/a²) with q₀ = ``peak``; see `normal_stress`."""
    (x, y, z), nu = _points(x, y, z), _checked_ratio(poissons_ratio)
    scale = scalar("peak", peak)
    potential = _Potentials(x, y, z, scalar("radius", radius, above=0))
    ds, dss = potential.ds(), potential.dss()
    # third horizontal derivatives of 2νΦ₂ - zΦ₁
    second = 2.0 * nu * potential.dss_2() - z * potential.dss_1()
    third = 2.0 * nu * potential.dsss_2() - z * potential.dsss_1()
    return scale * _tensor(
        xx=8.0 * x * ((nu + 1.0) * ds + 3.0 * second + 2.0 * x * x * third),
        yy=8.0 * x * (nu * ds + second + 2.0 * y * y * third),
        zz=-4.0 * x * z * potential.ds_dz(),
        xy=4.0 * y * (ds + 2.0 * second + 4.0 * x * x * third),
        xz=2.0 * potential.dz() - 4.0 * z * (ds + 2.0 * x * x * dss),
        yz=-8.0 * x * y * z * dss,
    )


def von_mises(stress: ArrayLike) -> Floats:
    """Return the von Mises stress (…) of stress tensors (…, 3, 3) [Pa]."""
    tensor = as_floats("stress", stress)
    mean = np.trace(tensor, axis1=-2, axis2=-1) / 3.0
    deviator = tensor - mean[..., np.newaxis, np.newaxis] * np.eye(3)
    equivalent: Floats = np.sqrt(1.5 * np.square(deviator).sum(axis=(-2, -1)))
    return equivalent


def largest_principal(stress: ArrayLike) -> Floats:
    """Return the largest principal stress (…) of stress tensors (…, 3, 3) [Pa], tension positive."""
    largest: Floats = np.linalg.eigvalsh(as_floats("stress", stress))[..., -1].astype(np.float64)
    return largest


def _points(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> tuple[Floats, Floats, Floats]:
    points = as_floats("x", x), as_floats("y", y), as_floats("z", z, least=0)
    x, y, z = np.broadcast_arrays(*points)
    return x, y, z


def _checked_ratio(poissons_ratio: float) -> float:
    ratio = scalar("poissons_ratio", poissons_ratio)
    if not MIN_POISSONS_RATIO < ratio <= MAX_POISSONS_RATIO:
        raise InputError(
            f"poissons_ratio is {ratio:g}; expected a number greater than -1 and at most 0.5"
        )
    return ratio


def _tensor(*, xx: Floats, yy: Floats, zz: Floats, xy: Floats, xz: Floats, yz: Floats) -> Floats:
    rows = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
