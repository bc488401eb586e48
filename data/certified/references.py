"""Reference solutions of the cases along one line: the closed form, in decimal arithmetic.

`Profile` evaluates the superposition of Jäger and Ciavarella exactly. It shares no code with
historysim; each case is confirmed by a second method.
"""

from decimal import Decimal, getcontext
from itertools import pairwise

import numpy as np

getcontext().prec = 40
GAUSS_3 = [
    (-(Decimal(3) / 5).sqrt(), Decimal(5) / 9),
    (Decimal(0), Decimal(8) / 9),
    ((Decimal(3) / 5).sqrt(), Decimal(5) / 9),
]
NODES, WEIGHTS = (
    [Decimal(float(each)) for each in column] for column in np.polynomial.legendre.leggauss(10)
)


class Profile:
    """Asperities with one friction coefficient between two rigid bodies, moved along one line.

    By the method of dimensionality reduction each asperity is a row of springs of stiffness 8 G*
    dx. The spring at half-width x of an asperity whose summit is `lag` below the highest first
    touches at the approach a = lag + x²/R, its label. Springs of one label have the same deflection
    v(a), which is piecewise linear, and |v| ≤ θ μ (d - a) by Coulomb's law. On a straight path of
    (d, u), v follows in closed form, and so do the integrals of T, of the stored and of the
    dissipated energy, which are polynomials of x between the vertices.

    Parameters
    ----------
    contact_modulus, shear_modulus : E*, G* [Pa]
    lags, radii : depths below the highest summit and radii of the asperities [m]
    friction : μ
    """

    def __init__(self, contact_modulus, shear_modulus, lags, radii, friction):
        self.contact_modulus, self.shear_modulus = Decimal(contact_modulus), Decimal(shear_modulus)
        self.asperities = [(Decimal(h), Decimal(r)) for h, r in zip(lags, radii, strict=True)]
        self.friction = Decimal(friction)
        # (label, deflection), from the centre of the highest asperity to the edge of contact
        self.vertices = []
        self.d = self.u = self.dissipated = Decimal(0)

    @property
    def slope(self):
        return self.friction * self.contact_modulus / (4 * self.shear_modulus)

    def normal_load_at(self, d):
        depths = [(max(d - h, Decimal(0)), r) for h, r in self.asperities]
        return (
            4
            * self.contact_modulus
            / 3
            * sum(r.sqrt() * depth * depth.sqrt() for depth, r in depths)
        )

    def _integral(self, breakpoints, integrand):
        """8 G* ∫ f(a) dx over all asperities, where f is a polynomial of second degree between breakpoints."""
        total = Decimal(0)
        labels = sorted(set(breakpoints))
        for h, r in self.asperities:
            for low, high in pairwise(labels):
                if high <= h:
                    continue
                x0, x1 = ((r * max(a - h, Decimal(0))).sqrt() for a in (low, high))
                middle, half = (x0 + x1) / 2, (x1 - x0) / 2
                for node, weight in GAUSS_3:
                    x = middle + node * half
                    total += weight * half * integrand(h + x * x / r)
        return 8 * self.shear_modulus * total

    def _labels(self):
        return [a for a, _ in self.vertices]

    @property
    def normal_load(self):
        return self.normal_load_at(self.d)

    @property
    def tangential_load(self):
        return self._integral(self._labels(), lambda a: interpolate(self.vertices, a))

    def load_of(self, vertices):
        """Tangential load of a polyline: its slopes times the differences of N."""
        total = sum(
            (v1 - v0) / (a1 - a0) * (self.normal_load_at(a1) - self.normal_load_at(a0))
            for (a0, v0), (a1, v1) in pairwise(vertices)
            if a1 > a0
        )
        return -total * 4 * self.shear_modulus / self.contact_modulus

    def traction(self, radius):
        """Traction at a radius of the one asperity: slopes times differences of Hertz pressures."""
        ((_, curvature),) = self.asperities
        radius = Decimal(float(radius))
        pi = Decimal("3.141592653589793238462643383279502884197")

        def pressure(a):
            root = max(a - radius * radius / curvature, Decimal(0)).sqrt()
            return 2 * self.contact_modulus / (pi * curvature.sqrt()) * root

        total = sum(
            (v1 - v0) / (a1 - a0) * (pressure(a1) - pressure(a0))
            for (a0, v0), (a1, v1) in pairwise(self.vertices)
            if a1 > a0
        )
        return -total * 4 * self.shear_modulus / self.contact_modulus

    def front_of(self, vertices, d):
        """Label where the slip that begins at the edge ends; `d` without slip."""
        front, side = d, 0
        for a, v in reversed(vertices[:-1]):
            here = (v > 0) - (v < 0)
            if abs(v) < self.slope * (d - a) * (1 - Decimal("1e-25")) or side not in {0, here}:
                return front
            front, side = a, here
        return front

    @property
    def stored(self):
        return self._integral(self._labels(), lambda a: interpolate(self.vertices, a) ** 2 / 2)

    def vertices_at(self, d, u):
        """Vertices after a straight path to (d, u)."""
        if d <= 0:
            return []
        shift = u - self.u
        if d > self.d:
            if self.vertices:
                trial = [*((a, v + shift) for a, v in self.vertices), (d, Decimal(0))]
            else:  # first touch at a fraction of the path
                trial = [(Decimal(0), shift * d / (d - self.d)), (d, Decimal(0))]
        else:
            trial = [(a, v + shift) for a, v in self.vertices if a < d]
            trial.append((d, interpolate(self.vertices, d) + shift))
        return clip(trial, d, self.slope)

    def to(self, d, u):
        """Follow a straight path to (d, u)."""
        d, u = Decimal(d), Decimal(u)
        vertices = self.vertices_at(d, u)
        self.dissipated += self._loss(d, u, vertices)
        self.vertices, self.d, self.u = vertices, d, u

    def _loss(self, d, u, vertices):
        """Energy dissipated on a straight path: for every spring its slip times its mean limit while it slips."""
        shift, rise, slope = u - self.u, d - self.d, self.slope
        old = self.vertices
        labels = [
            Decimal(0),
            max(d, Decimal(0)),
            max(self.d, Decimal(0)),
            *self._labels(),
            *(a for a, _ in vertices),
        ]
        if rise < 0:  # springs that leave: their trial deflection changes sign at a separate vertex
            lost = [(a, v + shift * (a - self.d) / rise) for a, v in old]
            labels += [a for a, _ in clip(lost, max(d, Decimal(0)), Decimal(0))]

        def loss(a):
            touches, leaves = a > self.d, a > d
            if touches and leaves:
                return Decimal(0)
            start = Decimal(0) if touches else interpolate(old, a)
            first = slope * max(self.d - a, Decimal(0))
            last = slope * max(d - a, Decimal(0))
            fraction = (d - a) / rise if touches else (a - self.d) / rise if leaves else Decimal(1)
            trial = start + shift * fraction
            slip = abs(trial) - last
            if slip <= 0:
                return Decimal(0)
            side = Decimal(1).copy_sign(trial)
            reserve = max(first - side * start, Decimal(0))
            onset = reserve / (reserve + slip)
            return slip * (first + onset * (last - first) + last) / 2

        return self._integral(labels, loss)

    def change_friction(self, friction):
        """Replace the coefficient at fixed (d, u): what is no longer stored is dissipated."""
        before, self.friction = self.stored, Decimal(friction)
        self.vertices = clip(self.vertices, self.d, self.slope)
        self.dissipated += before - self.stored

    def to_loads(self, normal_load, tangential_load):
        """Follow a path straight in (N, T) of one asperity; dissipated = ∫ T du less the energy stored."""
        start = self.normal_load, self.tangential_load
        normal_load, tangential_load = Decimal(normal_load), Decimal(tangential_load)

        def end(s):
            d = self._approach_at(start[0] + (normal_load - start[0]) * s)
            return d, self._displacement_at(d, start[1] + (tangential_load - start[1]) * s)

        d, u = end(Decimal(1))
        work = tangential_load * u - start[1] * self.u
        if abs(tangential_load - start[1]) > Decimal("1e-20") * self.friction * normal_load:
            scale = abs(tangential_load - start[1]) * max(abs(u), abs(self.u), self.slope * d)
            mean = _adaptive(lambda s: end(s)[1], Decimal(0), Decimal(1), Decimal("1e-10") * scale)
            work -= (tangential_load - start[1]) * mean
        before = self.stored
        self.vertices, self.d, self.u = self.vertices_at(d, u), d, u
        self.dissipated += work - (self.stored - before)

    def _approach_at(self, load):
        ((_, radius),) = self.asperities
        return (3 * load / (4 * self.contact_modulus * radius.sqrt())) ** (Decimal(2) / 3)

    def _displacement_at(self, d, load):
        """Displacement at the end of a straight path to approach d at which T reaches a load, by false position."""

        def excess(u):
            return self.load_of(self.vertices_at(d, u)) - load

        reach = self.slope * (2 * max(d, self.d) + abs(d - self.d))
        low, high = self.u - reach, self.u + reach
        f_low, f_high = excess(low), excess(high)
        tolerance = Decimal("1e-24") * self.friction * self.normal_load_at(d)
        side = 0
        for _ in range(400):
            u = (low * f_high - high * f_low) / (f_high - f_low)
            f = excess(u)
            if abs(f) <= tolerance or high - low <= reach * Decimal("1e-32"):
                break
            if f > 0:
                high, f_high = u, f
                f_low = f_low / 2 if side == 1 else f_low
                side = 1
            else:
                low, f_low = u, f
                f_high = f_high / 2 if side == -1 else f_high
                side = -1
        return u


def _adaptive(function, low, high, tolerance, whole=None):
    """∫ f over an interval by Gauss' rule, halved until the tolerance is reached."""

    def rule(a, b):
        return (
            (b - a)
            / 2
            * sum(
                w * function((a + b) / 2 + (b - a) / 2 * x)
                for x, w in zip(NODES, WEIGHTS, strict=True)
            )
        )

    whole = rule(low, high) if whole is None else whole
    middle = (low + high) / 2
    left, right = rule(low, middle), rule(middle, high)
    if abs(left + right - whole) <= tolerance or high - low < Decimal("1e-6"):
        return left + right
    return _adaptive(function, low, middle, tolerance, left) + _adaptive(
        function, middle, high, tolerance, right
    )


def interpolate(vertices, a):
    for (a0, v0), (a1, v1) in pairwise(vertices):
        if a <= a1:
            return v0 + (v1 - v0) * (a - a0) / (a1 - a0) if a1 > a0 else v1
    return Decimal(0)


def clip(vertices, d, slope):
    """Clip deflections to |v| ≤ slope (d - a), with a vertex wherever the limit is crossed."""
    fine = vertices[:1]
    for (a0, v0), (a1, v1) in pairwise(vertices):
        crossings = []
        for side in (-1, 1):
            excess0, excess1 = v0 - side * slope * (d - a0), v1 - side * slope * (d - a1)
            if excess0 * excess1 < 0:
                crossings.append(excess0 / (excess0 - excess1))
        fine += [(a0 + s * (a1 - a0), v0 + s * (v1 - v0)) for s in sorted(crossings)]
        fine.append((a1, v1))
    return [(a, max(-slope * (d - a), min(slope * (d - a), v))) for a, v in fine]
