"""Rows of springs whose friction, geometry and wear evolve, in small explicit steps: nothing of the program is used.

Each asperity is a row of independent springs (method of dimensionality reduction) in physical
units. One small step at a time approach and displacement move, then friction, slid distance and
wear follow from where that has led: first order in the step, so that two runs of different steps
tell the error.
"""

import copy

import numpy as np
from scipy.optimize import brentq, newton


class EvolvingSprings:
    """Springs of several asperities under one flat.

    Parameters
    ----------
    contact_modulus, shear_modulus : float
    summit_height, summit_radius : array (asperity)
    coefficient : callable
        μ (asperity) of normal loads (asperity), total load, radii and slid distances (asperity).
    reach : float
        Largest approach of the highest summit that is needed [m].
    springs : int
        On each half of each row.
    lost : callable, optional
        Volume lost (asperity) of normal loads, slid distances and dissipated energies of a step.
    """

    def __init__(
        self,
        contact_modulus,
        shear_modulus,
        summit_height,
        summit_radius,
        coefficient,
        reach,
        springs=400,
        lost=None,
    ):
        self.modulus, self.shear = contact_modulus, shear_modulus
        self.radius = np.array(summit_radius, dtype=float)
        self.lag = np.max(summit_height) - np.array(summit_height, dtype=float)
        self.coefficient, self.lost = coefficient, lost
        width = np.sqrt(self.radius * max(reach, 1e-30)) * 1.05
        self.x = width[:, None] * (np.arange(springs) + 0.5) / springs
        self.spacing = width / springs
        self.deflection = np.zeros_like(self.x)
        count = self.radius.size
        self.dissipated, self.slid, self.worn, self.shaped = (np.zeros(count) for _ in range(4))
        self.approach, self.displacement, self.friction = 0.0, 0.0, np.zeros(count)
        self.erased = 0.0

    def overlap(self, approach):
        return approach - self.lag[:, None] - self.x**2 / self.radius[:, None]

    def normal_loads(self, approach=None):
        own = np.maximum((self.approach if approach is None else approach) - self.lag, 0.0)
        return 4 / 3 * self.modulus * np.sqrt(self.radius) * own**1.5

    def approach_at(self, load):
        if load <= 0:
            return min(self.approach, self.lag.min())
        high = (
            self.lag.min()
            + (0.75 * load / self.modulus / np.sqrt(self.radius.min())) ** (2 / 3)
            + np.ptp(self.lag)
        )
        return brentq(
            lambda d: self.normal_loads(d).sum() - load,
            self.lag.min(),
            2 * high,
            xtol=1e-22,
            rtol=1e-15,
        )

    @property
    def tangential_loads(self):
        return 2 * 4 * self.shear * self.spacing * self.deflection.sum(axis=1)

    @property
    def stored(self):
        return 2 * 4 * self.shear * self.spacing * (self.deflection**2).sum(axis=1) / 2

    def _limits(self, approach, friction):
        ratio = self.modulus / (4 * self.shear)
        return ratio * friction[:, None] * np.maximum(self.overlap(approach), 0.0)

    def _moved(self, approach, displacement, friction):
        """Deflections after a small straight step, and the remainder: the slip."""
        start, end = self.overlap(self.approach), self.overlap(approach)
        came = np.divide(end, end - start, out=np.ones_like(end), where=(start < 0) & (end > 0))
        trial = np.where(end > 0, self.deflection + came * (displacement - self.displacement), 0.0)
        limit = self._limits(approach, friction)
        return np.clip(trial, -limit, limit), trial, limit

    def step(self, approach, displacement):
        loads = self.normal_loads(approach)
        friction = self.coefficient(loads, loads.sum(), self.radius, self.slid)
        before = self._limits(self.approach, self.friction)
        deflection, trial, limit = self._moved(approach, displacement, friction)
        gone = (limit == 0) & (self.deflection != 0)
        slip = np.where(gone, np.abs(self.deflection), np.abs(trial) - np.abs(deflection))
        drag = np.where(
            gone,
            np.abs(self.deflection) / 2,
            np.abs(deflection + np.clip(self.deflection, -before, before)) / 2,
        )
        energy = (
            2 * 4 * self.shear * self.spacing * (slip * np.where(slip > 0, drag, 0)).sum(axis=1)
        )
        # as a whole: after a fall of friction the innermost springs may slip while the edge sticks
        slides = np.all((slip > 1e-9 * np.abs(trial)) | (limit <= 0), axis=1) & (limit[:, 0] > 0)
        moved = np.where(slides, abs(displacement - self.displacement), 0.0)
        side = np.sign(deflection[:, :1])
        mean = (loads + self.normal_loads()) / 2
        self.deflection, self.friction = deflection, friction
        self.approach, self.displacement = approach, displacement
        self.dissipated += energy
        self.slid += moved
        if self.lost is not None:
            self.worn += self.lost(mean, moved, energy)
            shaping = np.where(slides, self.worn - self.shaped, 0.0)
            self.lag += np.sqrt((self.shaped + shaping) / (np.pi * self.radius)) - np.sqrt(
                self.shaped / (np.pi * self.radius)
            )
            self.shaped += shaping
            ends = self._limits(self.approach, self.friction)
            self.deflection = np.where(
                slides[:, None], side * ends, np.clip(self.deflection, -ends, ends)
            )

    def to_load(self, approach, load):
        """Displacement of a small step that ends at a tangential load."""
        loads = self.normal_loads(approach)
        friction = self.coefficient(loads, loads.sum(), self.radius, self.slid)
        ratio = self.modulus / (4 * self.shear)
        reach = 2.5 * ratio * friction.max() * max(approach, self.approach) + 1e-15

        def missing(displacement):
            deflection, _, _ = self._moved(approach, displacement, friction)
            return (2 * 4 * self.shear * self.spacing * deflection.sum(axis=1)).sum() - load

        low, high = self.displacement - reach, self.displacement + reach
        if missing(high) <= 0:
            return high
        return low if missing(low) >= 0 else brentq(missing, low, high, xtol=1e-20, rtol=1e-13)

    def straight_to(self, approach, load, steps):
        """Displacement at the end of a path, straight in approach and displacement, that ends at a tangential load."""
        reach = np.abs(self.to_load(approach, load) - self.displacement) + 1e-3 * max(
            approach, self.approach
        )

        def missing(displacement):
            row = copy.deepcopy(self)
            row.go(("displacement", approach), ("displacement", displacement), steps)
            return row.tangential_loads.sum() - load

        return newton(missing, self.displacement, x1=self.to_load(approach, load), tol=1e-6 * reach)

    def go(self, normal, tangential, steps):
        """Move to targets, each ("load" | "displacement", value).

        Two loads go straight; otherwise approach and displacement do.
        """
        (kind_n, value_n), (kind_t, value_t) = normal, tangential
        if kind_n == "displacement" != kind_t and value_n != self.approach:
            tangential = kind_t, value_t = "displacement", self.straight_to(value_n, value_t, steps)
        load0, load_t0, u0, d0 = (
            self.normal_loads().sum(),
            self.tangential_loads.sum(),
            self.displacement,
            self.approach,
        )
        d1 = self.approach_at(value_n) if kind_n == "load" else value_n
        lag, radius = self.lag.copy(), self.radius.copy()
        for k in range(1, steps + 1):
            share = k / steps
            if kind_n == kind_t == "load":
                approach = self.approach_at(load0 + share * (value_n - load0))
            else:
                approach = d0 + share * (d1 - d0)
                if kind_n == "load" and not np.array_equal(lag, self.lag):
                    own = np.maximum(approach - lag, 0.0)
                    approach = self.approach_at(
                        (4 / 3 * self.modulus * np.sqrt(radius) * own**1.5).sum()
                    )
            if kind_t == "load":
                displacement = self.to_load(approach, load_t0 + share * (value_t - load_t0))
            else:
                displacement = u0 + share * (value_t - u0)
            self.step(approach, displacement)

    def renew(self, chosen, height=None, radius=None, top=None):
        """Another geometry for chosen asperities: a new contact each, whose springs are not strained."""
        self.erased += self.stored[chosen].sum()
        self.deflection[chosen] = 0.0
        if radius is not None:
            self.radius[chosen] = radius
        if height is not None:
            self.lag[chosen] = top - np.asarray(height)
        self.shaped[chosen] = self.worn[chosen]
