"""Rows of springs under summits that yield, in small explicit steps: nothing of the program is used.

Each asperity is a row of independent springs (method of dimensionality reduction) at fixed places
x. Kogut and Etsion's law of first loading, joined as the program says it is, gives the Hertz
contact that is left; a spring at x may then hold θμ (a² - x²)/R. Springs keep what they hold while
their summit yields: first order in the step.
"""

import numpy as np


def kogut_etsion(x, most):
    """Load over the critical one, area over the critical one, with at most so much of one over the other."""
    x = np.maximum(x, 0.0)
    at_6, at_100 = ([1.4 * x**1.263, 0.94 * x**1.146] for x in (6.0, 100.0))
    ranges = [x < 1, x < 6, x < 100, x < 110]
    first, last = (
        np.log(at_6) / np.log(6),
        np.log(np.array([220 * most, 220]) / at_100) / np.log(1.1),
    )
    load = np.select(
        ranges,
        [x**1.5, x ** first[0], 1.4 * x**1.263, at_100[0] * (x / 100) ** last[0]],
        2 * x * most,
    )
    area = np.select(
        ranges, [x, x ** first[1], 0.94 * x**1.146, at_100[1] * (x / 100) ** last[1]], 2 * x
    )
    return np.minimum(load, area * most), area


class YieldingSprings:
    """Springs of several asperities under one flat, of which summits yield.

    Parameters
    ----------
    contact_modulus, shear_modulus, hardness, poissons_ratio : float
    friction : float or callable
        μ, or μ (asperity) of normal loads and present radii (asperity).
    summit_height, summit_radius : array (asperity)
    reach : float
        Largest approach of the highest summit that is needed [m].
    springs : int
        On each half of each row.
    """

    def __init__(
        self,
        contact_modulus,
        shear_modulus,
        hardness,
        poissons_ratio,
        friction,
        height,
        radius,
        reach,
        springs,
    ):
        self.modulus, self.shear, self.friction = contact_modulus, shear_modulus, friction
        self.virgin, self.virgin_radius = (
            np.array(height, dtype=float),
            np.array(radius, dtype=float),
        )
        self.top = self.virgin.max()
        peak = (0.454 + 0.41 * poissons_ratio) * hardness
        self.critical = (np.pi * peak / (2 * contact_modulus)) ** 2 * self.virgin_radius
        self.critical_load = (
            4 / 3 * contact_modulus * np.sqrt(self.virgin_radius) * self.critical**1.5
        )
        self.critical_area = np.pi * self.virgin_radius * self.critical
        self.most = hardness * 1.5 / peak
        self.height, self.radius = self.virgin.copy(), self.virgin_radius.copy()
        self.largest = self.critical.copy()
        width = np.sqrt(2.2 * self.virgin_radius * reach)
        self.x = width[:, None] * (np.arange(springs) + 0.5) / springs
        self.spacing = width / springs
        self.deflection = np.zeros_like(self.x)
        self.approach = self.displacement = 0.0
        self.dissipated, self.work = np.zeros(self.virgin.size), np.zeros(self.virgin.size)

    def own(self, approach):
        """Approaches of the present summits."""
        return approach - (self.top - self.height)

    def normal_loads(self):
        return (
            4
            / 3
            * self.modulus
            * np.sqrt(self.radius)
            * np.maximum(self.own(self.approach), 0) ** 1.5
        )

    @property
    def tangential_loads(self):
        return 2 * 4 * self.shear * self.spacing * self.deflection.sum(axis=1)

    @property
    def elastic(self):
        """Normal elastic energy."""
        return 0.4 * self.normal_loads() * np.maximum(self.own(self.approach), 0)

    @property
    def stored(self):
        """Tangential elastic energy."""
        return 2 * 4 * self.shear * self.spacing * (self.deflection**2).sum(axis=1) / 2

    def _limit(self, approach):
        ratio = self.modulus / (4 * self.shear)
        if callable(self.friction):
            load = (
                4
                / 3
                * self.modulus
                * np.sqrt(self.radius)
                * np.maximum(self.own(approach), 0) ** 1.5
            )
            ratio = ratio * self.friction(load, self.radius)[:, None]
        else:
            ratio *= self.friction
        return ratio * np.maximum(self.own(approach)[:, None] - self.x**2 / self.radius[:, None], 0)

    def step(self, approach, displacement):
        """Go a small step."""
        before, load = self._limit(self.approach), self.normal_loads()
        virgin = approach - (self.top - self.virgin)
        yields = virgin > self.largest
        if yields.any():
            f, g = kogut_etsion(virgin / self.critical, self.most)
            square = g * self.critical_area / np.pi
            left = (
                4 * self.modulus * square**1.5 / (3 * np.where(yields, f, 1) * self.critical_load)
            )
            self.radius = np.where(yields, left, self.radius)
            self.height = np.where(
                yields, self.virgin - (virgin - square / self.radius), self.height
            )
            self.largest = np.where(yields, virgin, self.largest)
        limit = self._limit(approach)
        trial = np.where(limit > 0, self.deflection + displacement - self.displacement, 0.0)
        deflection = np.clip(trial, -limit, limit)
        gone = (limit == 0) & (self.deflection != 0)
        slip = np.where(gone, np.abs(self.deflection), np.abs(trial - deflection))
        drag = (
            np.where(
                gone,
                np.abs(self.deflection),
                np.abs(deflection + np.clip(self.deflection, -before, before)),
            )
            / 2
        )
        self.dissipated += 2 * 4 * self.shear * self.spacing * (slip * drag).sum(axis=1)
        moved = approach - self.approach
        self.deflection, self.approach, self.displacement = deflection, approach, displacement
        self.work += (load + self.normal_loads()) / 2 * moved

    def go(self, approach, displacement, steps):
        """Go straight in small steps."""
        start = self.approach, self.displacement
        for k in range(1, steps + 1):
            self.step(
                start[0] + (approach - start[0]) * k / steps,
                start[1] + (displacement - start[1]) * k / steps,
            )
