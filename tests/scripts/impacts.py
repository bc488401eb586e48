"""Impacts of elastic spheres, integrated with `ContactBatch`: tests 1, 2 and 4 of Chung and Ooi.

    python tests/scripts/impacts.py

Y. C. Chung and J. Y. Ooi, Granular Matter 13 (2011) 643, give tests for codes of discrete elements.
Impacts along the normal have closed forms (Hertz): greatest load and duration. An oblique impact
slides throughout where the tangential velocity is at least (7 - θ) μ of the normal one, with θ =
E*/(4 G*) (N. Maw, J. R. Barber and J. N. Fawcett, Wear 38 (1976) 101); the impulse is then μ times
the normal one. Below that springs stick, and nothing but the whole history tells the rebound. The
oblique impacts are elastic here; in the paper the restitution is 0.98.
"""

import math
from typing import NamedTuple

import numpy as np

import historysim as hs

STEPS = 2000  # of one impact

SPIN = 3.5  # how much more easily the surface of a sphere is moved along than its mass: 1 + m R²/I


class Impact(NamedTuple):
    """Of a sphere on a plane, or of two like spheres on one another: what comes and what is hit."""

    pair: hs.MaterialPair
    radius: float  # effective [m]
    mass: float  # effective [kg]
    speed: float  # of approach [m/s]

    @property
    def deepest(self):
        """Greatest approach [m]: all kinetic energy is that of the Hertz contact."""
        return (
            15
            * self.mass
            * self.speed**2
            / (16 * self.pair.contact_modulus * math.sqrt(self.radius))
        ) ** 0.4

    @property
    def duration(self):
        """Time of contact [s]: 2 ∫ dδ/v up to the greatest approach."""
        return (
            2
            * self.deepest
            / self.speed
            * math.sqrt(math.pi)
            * math.gamma(0.4)
            / (2.5 * math.gamma(0.9))
        )

    @property
    def greatest_load(self):
        """Load at the greatest approach [N]."""
        return 4 / 3 * self.pair.contact_modulus * math.sqrt(self.radius) * self.deepest**1.5


class Rebound(NamedTuple):
    """After the impact, each (sphere): velocities [m/s], and the greatest load [N] and duration [s] of all."""

    normal: np.ndarray
    tangential: np.ndarray
    surface: np.ndarray
    greatest_load: float
    duration: float


def solid(young, poisson):
    return hs.Material("sphere", youngs_modulus=young, poissons_ratio=poisson)


def spheres(young, poisson, density, radius, speed):
    """Return the impact of two like spheres, each with a speed [m/s]."""
    material = solid(young, poisson)
    mass = 4 / 3 * math.pi * radius**3 * density
    return Impact(hs.MaterialPair(material, material), radius / 2, mass / 2, 2 * speed)


def sphere_on_plane(young, poisson, density, radius, speed):
    """Return the impact of a sphere on a plane that is a thousand times as stiff."""
    pair = hs.MaterialPair(solid(young, poisson), solid(1e3 * young, poisson))
    return Impact(pair, radius, 4 / 3 * math.pi * radius**3 * density, speed)


TEST_1 = {
    "glass": spheres(48e9, 0.20, 2800, 0.010, 10.0),
    "limestone": spheres(20e9, 0.25, 2500, 0.010, 10.0),
}
TEST_2 = {
    "aluminium alloy": sphere_on_plane(70e9, 0.30, 2699, 0.100, 0.2),
    "magnesium alloy": sphere_on_plane(40e9, 0.35, 1800, 0.100, 0.2),
}
TEST_4 = sphere_on_plane(380e9, 0.23, 4000, 0.0025, 3.9)
FRICTION = 0.092


def rebound(impact, friction=0.0, angle=(0.0,), contacts=None):
    """Integrate impacts with one speed under several angles to the normal [rad] by the leap-frog method.

    ``contacts`` carry the contacts; a `ContactBatch` by default.
    """
    angle = np.atleast_1d(angle).astype(float)
    contacts = contacts or hs.ContactBatch(impact.pair, impact.radius, friction, angle.size)
    # spheres whose normal velocity is lower are longer in contact
    normal, tangential = impact.speed * np.cos(angle), impact.speed * np.sin(angle)
    surface = tangential.copy()
    pause = impact._replace(speed=float(normal.max())).duration / STEPS
    approach, displacement = np.zeros(angle.size), np.zeros(angle.size)
    greatest, steps, began = 0.0, 0, False
    while not began or np.any(approach > 0):
        began = True
        normal -= 0.5 * pause / impact.mass * contacts.normal_load
        tangential -= 0.5 * pause / impact.mass * contacts.tangential_load
        surface -= 0.5 * SPIN * pause / impact.mass * contacts.tangential_load
        approach += pause * normal
        displacement += pause * surface
        contacts.step(approach, displacement)
        normal -= 0.5 * pause / impact.mass * contacts.normal_load
        tangential -= 0.5 * pause / impact.mass * contacts.tangential_load
        surface -= 0.5 * SPIN * pause / impact.mass * contacts.tangential_load
        greatest = max(greatest, float(contacts.normal_load.max()))
        steps += 1
    return Rebound(normal, tangential, surface, greatest, steps * pause)


def main():
    for name, tests in (("1, two spheres", TEST_1), ("2, sphere on a plane", TEST_2)):
        for material, impact in tests.items():
            found = rebound(impact)
            print(f"test {name}, {material}: greatest load {found.greatest_load:.6g} N", end="")
            print(
                f" (Hertz {impact.greatest_load:.6g}), {found.duration * 1e6:.4f} µs ({impact.duration * 1e6:.4f})"
            )
    angle = np.arange(5, 90, 5)
    found = rebound(TEST_4, FRICTION, np.radians(angle))
    sliding = (7 - TEST_4.pair.displacement_ratio) * FRICTION
    print(
        f"test 4, aluminium oxide; slides throughout from {math.degrees(math.atan(sliding)):.1f}° on"
    )
    print("angle [°]  tangential restitution  spin [rad/s]  angle of the surface's rebound [°]")
    for k in range(angle.size):
        restitution = found.tangential[k] / (TEST_4.speed * math.sin(math.radians(angle[k])))
        spin = (found.tangential[k] - found.surface[k]) / TEST_4.radius
        back = math.degrees(math.atan2(found.surface[k], -found.normal[k]))
        print(f"{angle[k]:>9}{restitution:>24.4f}{spin:>14.1f}{back:>36.2f}")


if __name__ == "__main__":
    main()
