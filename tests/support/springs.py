"""Brute-force oracle: asperities as rows of Coulomb springs, walked through a load history in many sub-steps.

By the method of dimensionality reduction a Hertz contact is a row of independent springs at
half-widths x, with normal force E* (δ - x²/R)₊ dx and tangential stiffness 4 G* dx. Each spring
here is integrated on its own: it sticks, or it slides at μ times its normal force. Nothing is kept
but its tangential deflection and the energy that it has lost.

Grid. Fixed midpoints in x, symmetric, hence a factor of two. The deflection is piecewise parabolic
in x, even, with a kink at every reversal radius, so the midpoint sum is wrong by -Σ h² B₂(phase)
Δu'/2 over the kinks: second order in the spacing h, but with a factor between -1/12 and 1/6 that
depends on where each kink falls within its cell. The bound `tangential_load_error` follows from it;
extrapolation to h = 0 does not, because the phases jump about. A grid that is uniform in the
separation of first touch would have the same order and lose the parabola's smoothness at the axis.

Sub-steps. Within one sub-step approach and displacement run straight, and a spring's touching,
onset of sliding and leaving are located inside it. A path that is straight in (approach,
displacement) therefore does not depend on the number of sub-steps; a ramp of loads does, to second
order, as far as its image in (approach, displacement) is curved.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq


class Contact(NamedTuple):
    """Asperities against a rigid flat: moduli [Pa], and per asperity height [m], radius [m] and coefficient."""

    contact_modulus: float
    shear_modulus: float
    summit_height: np.ndarray
    summit_radius: np.ndarray
    friction: np.ndarray

    @classmethod
    def build(cls, contact_modulus, shear_modulus, summit_height, summit_radius, friction):
        height = np.atleast_1d(np.asarray(summit_height, dtype=float))
        radius = np.broadcast_to(np.asarray(summit_radius, dtype=float), height.shape).copy()
        coefficients = np.broadcast_to(np.asarray(friction, dtype=float), height.shape).copy()
        return cls(float(contact_modulus), float(shear_modulus), height, radius, coefficients)

    def normal_load(self, approach):
        """Hertz load of every asperity [N]; the last axis of the result is the asperity."""
        depth = np.asarray(approach)[..., np.newaxis] - (
            self.summit_height.max() - self.summit_height
        )
        return (
            4
            / 3
            * self.contact_modulus
            * np.sqrt(self.summit_radius)
            * np.clip(depth, 0, None) ** 1.5
        )

    def approach(self, normal_load):
        """Approach of the highest summit [m] under each of the total loads; 0 without load."""
        loads = np.atleast_1d(np.asarray(normal_load, dtype=float))
        lag = self.summit_height.max() - self.summit_height
        found = _hertz_approach(
            loads, lag, 4 / 3 * self.contact_modulus * np.sqrt(self.summit_radius)
        )
        return found.reshape(np.shape(normal_load))[()]

    def limit(self, approach):
        """Largest tangential load [N] that friction holds at an approach."""
        return self.normal_load(approach) @ self.friction

    @property
    def compliance_ratio(self):
        """θ = E*/(4 G*)."""
        return self.contact_modulus / (4 * self.shear_modulus)


def _hertz_approach(loads, lag, factor):
    found = np.zeros(loads.size)
    pressed = loads > 0
    # the load is convex in the approach: from above, Newton comes down without overshoot
    approach = (loads[pressed] / factor[np.argmin(lag)]) ** (2 / 3)
    for _ in range(200):
        root = np.sqrt(np.maximum(approach[:, np.newaxis] - lag, 0.0))
        lower = approach - (root**3 @ factor - loads[pressed]) / (1.5 * root @ factor)
        if np.all(lower >= approach):
            break
        approach = np.minimum(lower, approach)
    found[pressed] = approach
    return found


def _springs(deflection, overlap, next_overlap, shift, slope):
    """Return deflections after a straight sub-step, the losses per stiffness, and d(deflection)/d(shift)."""
    apart = (overlap <= 0) & (next_overlap <= 0)
    touches, leaves = (overlap < 0) & ~apart, (next_overlap < 0) & ~apart & (overlap >= 0)
    change = np.where(touches | leaves, next_overlap - overlap, 1.0)
    share = np.where(touches, next_overlap / change, np.where(leaves, -overlap / change, 1.0))
    first, last = np.where(touches, 0.0, overlap), np.where(leaves, 0.0, next_overlap)
    trial, limit = deflection + share * shift, slope * last
    sliding = np.abs(trial) - limit
    side = np.sign(trial)
    reserve = np.maximum(slope * first - side * deflection, 0.0)
    slides = (sliding > 0) & ~apart
    onset = reserve / np.where(slides, reserve + sliding, 1.0)
    limit_at_onset = slope * (first + onset * (last - first))
    moved = np.where(slides, side * limit, trial)
    lost = np.where(slides, sliding * (limit_at_onset + limit) / 2, 0.0)
    return np.where(apart, 0.0, moved), lost, np.where(slides | apart, 0.0, share)


def _advance(deflection, lost, drop, slope, start, end, shift):
    moved, loss, _ = _springs(deflection, start - drop, end - drop, shift, slope[:, np.newaxis])
    deflection[...] = moved
    lost += loss


def _pull(deflection, drop, slope, weight, start, end, shift):
    """Return the tangential load and stiffness that a sub-step would lead to, the deflections and the losses."""
    moved, lost, share = _springs(deflection, start - drop, end - drop, shift, slope[:, np.newaxis])
    touching = drop < end
    load = weight @ np.where(touching, moved, 0.0).sum(axis=1)
    return load, weight @ np.where(touching, share, 0.0).sum(axis=1), moved, lost


def _spring_limit(drop, slope, weight, approach):
    return (weight * slope) @ np.maximum(approach - drop, 0.0).sum(axis=1)


def _step_to_load(deflection, drop, slope, weight, start, end, target, limit, shift):
    """Return the displacement of a sub-step that ends at a tangential load, the deflections there and the losses.

    Newton inside a bracket, from a guess of the displacement on.
    """
    high = slope.max() * (2 * max(start, end, 0.0) + abs(end - start)) * 1.001
    low = -high
    shift = min(max(shift, low), high)
    for _ in range(200):
        load, stiffness, moved, lost = _pull(deflection, drop, slope, weight, start, end, shift)
        excess = load - target
        if abs(excess) <= 1e-13 * limit:
            break
        if excess > 0:
            high = shift
        else:
            low = shift
        step = shift - excess / stiffness if stiffness > 0 else low
        following = step if low < step < high else (low + high) / 2
        if following == shift:
            break
        shift = following
    return shift, moved, lost


def _ramp_loads(deflection, lost, drop, slope, weight, approaches, loads):
    """Follow a ramp of both loads; return the displacement that it takes."""
    displacement = shift = 0.0
    top = np.argmin(drop[:, 0])
    for k in range(1, approaches.size):
        start, end = approaches[k - 1], approaches[k]
        limit = _spring_limit(drop, slope, weight, end)
        if limit > 0:
            target = min(max(loads[k], -limit), limit)
            shift, deflection[...], loss = _step_to_load(
                deflection, drop, slope, weight, start, end, target, limit, shift
            )
            lost += loss
        else:
            # the limit of vanishing load: the last spring, which does not slide, leaves undeflected
            shift = -deflection[top, 0]
            _advance(deflection, lost, drop, slope, start, end, shift)
        displacement += shift
    return displacement


def _kinks(profile):
    """Σ|second difference| of profiles over x: even about the axis, zero beyond the grid."""
    padded = np.concatenate([profile[:, :1], profile, np.zeros_like(profile[:, :1])], axis=1)
    return np.abs(np.diff(padded, 2, axis=1)).sum(axis=1)


class SpringRow:
    """Asperities as rows of springs, in a state that `apply` and `friction_change` move on.

    Parameters
    ----------
    contact : Contact
        Moduli and asperities.
    largest_approach : float
        Largest approach of the highest summit [m] that the history reaches; the grids end there.
    springs : int
        Springs on each half of each asperity.

    Attributes
    ----------
    approach : float
        Approach of the highest summit from first touch [m]; negative for a gap.
    tangential_displacement : float
        Rigid tangential displacement U [m].
    """

    def __init__(self, contact, largest_approach, springs=1000):
        self.contact = contact
        self.largest_approach = largest_approach
        self.approach = 0.0
        self.tangential_displacement = 0.0
        self._lag = contact.summit_height.max() - contact.summit_height
        width = np.sqrt(contact.summit_radius * np.clip(largest_approach - self._lag, 0, None))
        self._x = width[:, np.newaxis] * (np.arange(springs) + 0.5) / springs
        self._drop = self._lag[:, np.newaxis] + self._x**2 / contact.summit_radius[:, np.newaxis]
        self._weight = 2 * 4 * contact.shear_modulus * width / springs
        self._deflection = np.zeros_like(self._x)
        self._lost = np.zeros_like(self._x)

    def apply(self, normal, tangential, substeps=400):
        """Move from the present state to a target; each channel is ("load" | "displacement", value).

        Two loads: straight in (N, T), equal sub-steps. Otherwise straight in (approach, U), which
        one step does exactly: a normal load is turned into its approach first, and for a tangential
        load the end U is sought whose straight path ends at it.
        Without contact at the end of a tangential-load path U stays where it was; at the end of a
        ramp of two loads it is the limit for a vanishing load.
        """
        (normal_kind, normal_value), (tangential_kind, tangential_value) = normal, tangential
        if normal_kind == tangential_kind == "load":
            self._apply_loads(normal_value, tangential_value, substeps)
            return
        end = normal_value if normal_kind == "displacement" else self._approach_at(normal_value)
        self._check_reach(end)
        if tangential_kind == "displacement":
            shift = tangential_value - self.tangential_displacement
        else:
            shift = self._path_to_load(end, tangential_value)
        _advance(self._deflection, self._lost, self._drop, self._slope, self.approach, end, shift)
        self.approach = end
        self.tangential_displacement += shift

    def friction_change(self, friction, missing=None, parts=50):
        """Replace the coefficients at a fixed approach, going straight to the new ones in equal parts.

        U is fixed; or it follows so that ``missing``, a function of U and the tangential load,
        rising in both, stays 0.
        """
        first = self.contact.friction
        last = np.broadcast_to(friction, self._lag.shape).astype(float)
        for k in range(1, parts + 1 if missing else 2):
            limit = self._spring_limits()
            self.contact = self.contact._replace(
                friction=first + (last - first) * (k / parts if missing else 1.0)
            )
            shift = 0.0
            if missing and self.approach > 0:
                reach = 2.002 * self._slope.max() * self.approach
                shift = brentq(
                    lambda s: self._missing_after(missing, s),
                    -reach,
                    reach,
                    xtol=1e-15 * reach,
                    rtol=1e-15,
                )
            self._follow_limits(limit, shift)

    def _missing_after(self, missing, shift):
        limit = self._spring_limits()
        load = (self._weight * np.clip(self._deflection + shift, -limit, limit).sum(axis=1)).sum()
        return missing(self.tangential_displacement + shift, load)

    def _follow_limits(self, before, shift):
        """Move all springs straight by a shift while their limits go straight from those before to the present ones."""
        limit = self._spring_limits()
        trial = self._deflection + shift
        side = np.where(trial < 0, -1.0, 1.0)
        sliding = np.maximum(np.abs(trial) - limit, 0.0)
        reserve = np.maximum(before - side * self._deflection, 0.0)
        onset = np.divide(reserve, reserve + sliding, out=np.ones_like(limit), where=sliding > 0)
        self._lost += sliding * (before + onset * (limit - before) + limit) / 2
        self._deflection = trial - side * sliding
        self.tangential_displacement += shift

    @property
    def normal_load(self):
        """Hertz load of every asperity [N]."""
        return self.contact.normal_load(self.approach)

    @property
    def tangential_load(self):
        """Tangential load of every asperity [N]."""
        return self._weight * self._deflection.sum(axis=1)

    @property
    def total_normal_load(self):
        return self.normal_load.sum()

    @property
    def total_tangential_load(self):
        return self.tangential_load.sum()

    @property
    def dissipated_energy(self):
        """Energy that every asperity has dissipated so far [J]."""
        return self._weight * self._lost.sum(axis=1)

    @property
    def elastic_energy(self):
        """Tangential elastic energy of every asperity [J]."""
        return self._weight * (self._deflection**2).sum(axis=1) / 2

    @property
    def tangential_load_error(self):
        """Bound of the midpoint rule for every asperity's load, given the deflections: (h²/8) ∫|8 G* u''| dx [N]."""
        return self._weight * _kinks(self._deflection) / 8

    @property
    def dissipated_energy_error(self):
        """As `tangential_load_error`, for the dissipated energy [J]."""
        return self._weight * _kinks(self._lost) / 8

    @property
    def contact_radius(self):
        """Contact radius of every asperity [m]."""
        return np.sqrt(self.contact.summit_radius * np.clip(self.approach - self._lag, 0, None))

    @property
    def spacing(self):
        """Distance between the springs of every asperity [m]."""
        return 2 * self._x[:, 0]

    @property
    def stick_radius(self):
        """Radius inside the slip annulus of every asperity [m]."""
        return np.array([self._stick_radius(i) for i in range(self._lag.size)])

    @property
    def _slope(self):
        return self.contact.friction * self.contact.compliance_ratio

    def _spring_limits(self):
        return self._slope[:, np.newaxis] * np.clip(self.approach - self._drop, 0, None)

    def _stick_radius(self, i):
        """Walk from the edge inward to the first spring inside its limit, then find the end between two springs.

        Deflection and limit are linear in x² inside one stretch, so the two outermost sticking
        springs point at the place where the reserve vanishes; it is sought no further than the next
        spring.
        """
        reserve = self._spring_limits()[i] - np.abs(self._deflection[i])
        sticking = np.flatnonzero(
            reserve > 1e-9 * self._slope[i] * max(self.approach - self._lag[i], 0)
        )
        if sticking.size == 0:
            return 0.0
        j = sticking[-1]
        outer = min(self.contact_radius[i], self._x[i, j] + self.spacing[i])
        if j == 0 or reserve[j - 1] <= reserve[j]:
            return outer
        square, inner_square = self._x[i, j] ** 2, self._x[i, j - 1] ** 2
        end = square + (square - inner_square) * reserve[j] / (reserve[j - 1] - reserve[j])
        return min(np.sqrt(end), outer)

    def _approach_at(self, normal_load):
        return self.contact.approach(normal_load) if normal_load > 0 else min(self.approach, 0.0)

    def _check_reach(self, approach):
        if approach > self.largest_approach * (1 + 1e-12):
            raise ValueError(
                f"approach {approach:g} m is beyond the grid; expected at most {self.largest_approach:g} m"
            )

    def _check_limit(self, tangential_load, limit):
        if np.any(np.abs(tangential_load) > limit * (1 + 1e-9)):
            raise ValueError(
                f"the path to T = {np.ravel(tangential_load)[-1]:g} N leaves the friction limit"
            )

    def _apply_loads(self, normal_load, tangential_load, substeps):
        first = self.total_normal_load
        if first == normal_load == 0:
            self._check_limit(tangential_load, 0.0)
            return
        # a gap is crossed without load, before the ramp begins
        approaches = self.contact.approach(np.linspace(first, normal_load, substeps + 1))
        approaches[0] = max(self.approach, 0.0)
        self._check_reach(approaches.max())
        limits = self.contact.limit(approaches)
        start = np.clip(self.total_tangential_load, -limits[0], limits[0])
        loads = np.linspace(start, tangential_load, substeps + 1)
        self._check_limit(loads, limits)
        self.tangential_displacement += _ramp_loads(
            self._deflection, self._lost, self._drop, self._slope, self._weight, approaches, loads
        )
        self.approach = approaches[-1]

    def _path_to_load(self, end, tangential_load):
        self._check_limit(tangential_load, self.contact.limit(end))
        limit = _spring_limit(self._drop, self._slope, self._weight, end)
        if limit == 0:
            return 0.0
        target = min(max(tangential_load, -limit), limit)

        def excess(shift):
            return (
                _pull(
                    self._deflection,
                    self._drop,
                    self._slope,
                    self._weight,
                    self.approach,
                    end,
                    shift,
                )[0]
                - target
            )

        # saturates every spring: those in contact at the start, and those that touch on the way
        reach = 1.001 * self._slope.max() * (2 * max(self.approach, end) + abs(end - self.approach))
        if abs(target) == limit:
            return np.copysign(reach, target)
        return brentq(excess, -reach, reach, xtol=1e-15 * reach, rtol=1e-15)
