"""An adhesive contact to test with, and a second way to solve it: a row of springs, without Maugis's equations."""

import math

import numpy as np
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

EPS = np.finfo(float).eps
R, E, W = 2e-6, 5e9, 0.08  # a fine tip on a stiff plastic [m, Pa, J/m²]
ELASTIC = {"summit_radius": R, "contact_modulus": E, "work_of_adhesion": W}
PULL = math.pi * W * R
# a³ of JKR without load, which sets the scale of all radii
UNLOADED = (4.5 * math.pi * W * R**2 / E) ** (1 / 3)

powers = st.floats(-3, 3)
radii = st.floats(1e-8, 1e-2)
moduli = st.floats(1e5, 1e12)
works = st.floats(1e-4, 1e1)


def contact(parameter, radius=R, modulus=E, work=W):
    """Keyword arguments of a contact with this Maugis parameter, from its definition by σ0."""
    stress = parameter / (9 * radius / (2 * math.pi * work * modulus**2)) ** (1 / 3)
    return {
        "summit_radius": radius,
        "contact_modulus": modulus,
        "work_of_adhesion": work,
        "equilibrium_separation": 16 * work / (9 * math.sqrt(3) * stress),
    }


class Springs:
    """A Dugdale contact from its surface displacement, by quadrature and without Maugis's equations.

    An axisymmetric half-space answers the deflection w(x) of a row of springs with u(r) = (2/π) ∫ w
    dx/√(r² - x²), the load 2E ∫ w dx and the energy E ∫ w² dx, where q = E w and the pressure p are
    a pair of Abel: a constant traction -σ0 out to c is q(x) = -2σ0 √(c² - x²). Inside the contact w
    = δ - x²/R; w is continuous at its edge.
    """

    def __init__(
        self, a, zone, *, summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation
    ):
        self.a, self.zone, self.radius, self.modulus = a, zone, summit_radius, contact_modulus
        self.work = work_of_adhesion
        self.stress = 16 * work_of_adhesion / (9 * math.sqrt(3) * equilibrium_separation)
        self.range = work_of_adhesion / self.stress
        edge = -2 * self.stress * math.sqrt(zone**2 - a**2) / contact_modulus
        self.approach = a**2 / summit_radius + edge

    @classmethod
    def of(cls, a, **arguments):
        """The contact of radius a: its zone ends where the gap is the range of the attraction."""

        def miss(power):
            springs = cls(a, a * math.sqrt(1 + 10 ** (2 * power)), **arguments)
            return springs.gap(springs.zone) / springs.range - 1

        return cls(a, a * math.sqrt(1 + 10 ** (2 * brentq(miss, -9, 9, xtol=1e-14))), **arguments)

    def spring(self, x):
        if x < self.a:
            return self.approach - x**2 / self.radius
        return -2 * self.stress / self.modulus * math.sqrt(max(self.zone**2 - x**2, 0))

    def displacement(self, r):
        touch = math.asin(min(self.a / r, 1))
        parts = ((0, touch), (touch, math.pi / 2))
        return (
            2
            / math.pi
            * sum(quad(lambda angle: self.spring(r * math.sin(angle)), *part)[0] for part in parts)
        )

    def gap(self, r):
        return r**2 / (2 * self.radius) - self.approach + self.displacement(r)

    @property
    def load(self):
        parts = ((0, self.a), (self.a, self.zone))
        return 2 * self.modulus * sum(quad(self.spring, *part, epsabs=0)[0] for part in parts)
