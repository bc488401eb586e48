"""Two reference solutions of a sphere that moves in two tangential directions, for ν = 0.

`Annuli` has constant tractions on annuli of equal area, the elastic energy of a half-space by
elliptic integrals, and implicit Euler steps. `Rings` has displacements that are piecewise linear in
r², Abel's transformation, Coulomb's law at points, and SDIRK2 steps. They share no kernel, grid,
collocation or time integration; they do share `minimise`, which checks the optimality of its result.

Units: E* = R = θ = 1, approaches of at most 1, so that |u| = μ is full slip at the largest.
"""

from itertools import pairwise

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import ellipe, ellipk

GAMMA = 1 - 1 / np.sqrt(2)  # of SDIRK2
TOLERANCE = 1e-10  # of tractions, over the largest limit
ROUNDS = 200


def minimise(matrix, pull, limit, start):
    """Minimum of ½ q·A q - q·pull under |q_i| ≤ limit_i, for vectors q_i in the plane.

    Newton steps, or a sweep of projected Gauss–Seidel where one does not lower the energy, until the
    conditions of the minimum hold: no vector moves towards its own minimum.
    """
    inside = np.flatnonzero(limit > 0)
    result = np.zeros_like(pull)
    if not inside.size:
        return result
    A, p, g = matrix[np.ix_(inside, inside)], pull[inside], limit[inside]
    q = project(start[inside], g)
    diagonal = np.diag(A)[:, None]
    for _ in range(ROUNDS):
        trial = q + (p - A @ q) / diagonal
        moved = np.abs(project(trial, g) - q).max()
        if moved <= TOLERANCE * g.max():
            result[inside] = q
            return result
        following = _newton(A, p, g, q, trial)
        if _energy(A, p, following) < _energy(A, p, q):
            q = following
        else:
            _sweep(A, p, g, q)
    raise RuntimeError(f"the tractions did not converge: they still move by {moved:.1e}")


def project(q, limit):
    """Shorten vectors to their limits."""
    size = np.hypot(q[:, 0], q[:, 1])
    return q * np.where(size > limit, limit / np.where(size > 0, size, 1.0), 1.0)[:, None]


def _energy(matrix, p, q):
    return (q * (matrix @ q / 2 - p)).sum()


def _sweep(matrix, p, g, q):
    """Minimise over one vector after the other, in place."""
    y, diagonal = p - matrix @ q, np.diag(matrix)
    for i in range(g.size):
        trial = q[i] + y[i] / diagonal[i]
        size = np.hypot(*trial)
        if size > g[i]:
            trial *= g[i] / size
        y -= matrix[:, i, None] * (trial - q[i])
        q[i] = trial


def _newton(matrix, p, g, q, trial):
    """Newton step: vectors whose trial is beyond the limit turn, the others are free."""
    size = np.hypot(*trial.T)
    slips = size > g * (1 - 1e-13)
    sliding, sticking = np.flatnonzero(slips), np.flatnonzero(~slips)
    q = q.copy()
    along = trial[sliding] / size[sliding, None]
    q[sliding] = g[sliding, None] * along
    y = p - matrix @ q

    across = np.column_stack([-along[:, 1], along[:, 0]])
    basis = np.vstack([
        across, np.tile([1.0, 0.0], (sticking.size, 1)), np.tile([0.0, 1.0], (sticking.size, 1)),
    ])  # fmt: skip
    index = np.concatenate([sliding, sticking, sticking])
    count = sliding.size
    hessian = matrix[np.ix_(index, index)] * (basis @ basis.T)
    curvature = np.maximum((along * y[sliding]).sum(axis=1), 0.0) / g[sliding]
    hessian[np.arange(count), np.arange(count)] += curvature
    step = cho_solve(cho_factor(hessian), (basis * y[index]).sum(axis=1))

    angle = np.clip(step[:count] / g[sliding], -0.7, 0.7)[:, None]
    q[sliding] = g[sliding, None] * (np.cos(angle) * along + np.sin(angle) * across)
    q[sticking] += step[count:].reshape(2, -1).T
    return project(q, g)


class PlaneReference:
    """A sphere in the plane: the path in parts, and loads reached by a search for the displacement.

    A subclass has `reset`, `step`, the attributes of `STATE`, and `tangential_load`.
    """

    STATE: tuple[str, ...] = ()

    def _state(self):
        return {name: getattr(self, name) for name in self.STATE}

    def _restore(self, state):
        for name, value in state.items():
            setattr(self, name, value)

    def to(self, d, u, parts, friction=None):
        """Follow a path straight in (d, u, μ); a lift-off is reached in shorter and shorter pieces."""
        end = np.array([d, *u, self.friction if friction is None else friction], dtype=float)
        start = np.array([self.d, *self.u, self.friction])
        shares = [1.0]
        if start[0] * d < 0 or start[0] > 0 >= d:
            crossing = start[0] / (start[0] - d)
            pieces = crossing * (1 - 0.2 ** np.arange(1, 5)) if d <= 0 else []
            shares = [*pieces, crossing, 1.0] if d < 0 or start[0] < 0 else [*pieces, 1.0]
        before = start
        for share in shares:
            after = start + share * (end - start)
            if abs(after[0]) < 1e-12:
                after[0] = 0.0
            touches = max(before[0], after[0]) > 0
            for part in self.stations(before[0], after[0], parts if touches else 1):
                at = before + part * (after - before)
                self.step(at[0], at[1:3], at[3])
            before = after

    def stations(self, start, end, parts):  # noqa: ARG002 - a subclass adds stations at its edges
        """Shares of a path between two approaches at which steps end."""
        return np.arange(1, parts + 1) / parts

    def to_loads(self, d, load, parts, power=1.5):
        """Follow a path straight in d to a power, which is N for 1.5, and in the tangential load."""
        start, first = self.d, self.tangential_load
        for share in self.stations(start, d, parts):
            depth = start + share * (d - start)
            part = (
                (depth**power - start**power) / (d**power - start**power) if d != start else share
            )
            target = first + part * (np.asarray(load) - first)
            self._search(target, depth, lambda u, depth=depth: self.step(depth, u, self.friction))

    def _search(self, target, d, move):
        """Find the displacement whose path ends at a tangential load, by Broyden's rule."""
        state, u = self._state(), self.u.copy()
        inverse = np.eye(2) / (2 * np.sqrt(d))
        tolerance = 1e-9 * self.friction * 4 / 3 * d**1.5
        step = missing = None
        for _ in range(100):
            self._restore(state)
            move(u)
            found = target - self.tangential_load
            if np.abs(found).max() <= tolerance:
                return
            if step is not None:
                gained = missing - found
                seen = inverse @ gained
                inverse = inverse + np.outer(step - seen, step @ inverse) / (step @ seen)
            missing = found
            step = inverse @ missing
            longest = 0.3 * self.friction * max(d, state["d"])
            step *= min(1.0, longest / np.hypot(*step))
            u = u + step
        raise RuntimeError(f"no displacement leads to {target}; {missing} are missing")


class Annuli(PlaneReference):
    """Constant tractions on annuli; Galerkin energy of a half-space; implicit Euler.

    The annuli end at every approach where a leg of the path ends, and are of equal area between
    these; steps end where the edge of contact is that of an annulus. All refine by `level`.
    """

    STATE = ("traction", "d", "u", "friction", "dissipated")

    def __init__(self, count, approaches, level=1):
        ends = np.unique(np.round([0.0, *np.clip(approaches, 0, 1), 1.0], 9))
        squares = [0.0]
        for low, high in pairwise(ends):
            pieces = level * max(1, round(count * (high - low)))
            squares += list(low + (high - low) * np.arange(1, pieces + 1) / pieces)
        edge = np.sqrt(squares)
        self.edge, self.area = edge, np.pi * np.diff(edge**2)
        # mean displacement of annulus i under annulus j; the points crowd at the edges, where the
        # integrand is singular
        node, weight = np.polynomial.legendre.leggauss(24)
        share = (1 - np.cos(np.pi * (node + 1) / 2)) / 2
        weight = weight * np.pi / 4 * np.sin(np.pi * (node + 1) / 2)
        r = edge[:-1, None] + np.diff(edge)[:, None] * share
        ring = 2 * np.pi * r * np.diff(edge)[:, None] * weight
        discs = np.stack([(ring * _disc_displacement(r, a)).sum(axis=1) for a in edge], axis=1)
        energy = np.diff(discs, axis=1)
        self.energy = (energy + energy.T) / 2
        self.reset()

    def reset(self):
        """Begin an untouched contact."""
        self.traction = np.zeros((self.area.size, 2))
        self.d, self.u, self.friction, self.dissipated = 0.0, np.zeros(2), 1.0, 0.0

    def stations(self, start, end, parts):
        """Shares of equal parts, and those where the edge of contact is that of an annulus."""
        shares = super().stations(start, end, parts)
        if start != end:
            crossings = (self.edge**2 - start) / (end - start)
            shares = np.union1d(shares, crossings[(crossings > 0) & (crossings < 1)].round(12))
            shares = shares[np.diff(shares, prepend=0.0) > 1e-9]
        return shares

    @property
    def tangential_load(self):
        return self.area @ self.traction

    def limits(self, d):
        """Mean pressure of every annulus."""
        inside = np.maximum(d - self.edge**2, 0.0) ** 1.5
        return 4 / 3 * (inside[:-1] - inside[1:]) / self.area

    def step(self, d, u, friction):
        """Move in one implicit step; dissipated = work less stored energy."""
        shift = u - self.u
        before, load = self._stored(), self.tangential_load
        pull = self.energy @ self.traction + self.area[:, None] * shift
        self.traction = minimise(self.energy, pull, friction * self.limits(d), self.traction)
        work = (load + self.tangential_load) @ shift / 2
        self.dissipated += work - (self._stored() - before)
        self.d, self.u, self.friction = d, np.array(u), friction

    def _stored(self):
        return 0.5 * float((self.traction * (self.energy @ self.traction)).sum())

    def traction_at(self, r):
        """Traction at radii, linear in r² between the middles of annuli."""
        middle = (self.edge[:-1] ** 2 + self.edge[1:] ** 2) / 2
        return np.column_stack([np.interp(r**2, middle, column) for column in self.traction.T])


def _disc_displacement(r, a):
    """Displacement at radius r under unit traction on a disc of radius a, E* = 1 (Johnson, 1985, section 3.4)."""
    if a == 0:
        return np.zeros_like(r)
    k = np.minimum(r / a, 1.0) ** 2
    m = np.minimum(a / r, 1.0) ** 2
    outside = r * (ellipe(m) - (1 - m) * ellipk(np.minimum(m, 1 - 1e-16)))
    return 4 / np.pi * np.where(r < a, a * ellipe(k), outside)


class Rings(PlaneReference):
    """Deflections linear between labels (approach at first touch); Abel's transformation; SDIRK2."""

    STATE = ("labels", "deflection", "d", "u", "friction", "dissipated")

    def __init__(self, count):
        self.grid = np.linspace(0, 1, count + 1)
        self.reset()

    def reset(self):
        """Begin an untouched contact."""
        self.labels, self.deflection = np.zeros(1), np.zeros((1, 2))
        self.d, self.u, self.friction, self.dissipated = 0.0, np.zeros(2), 1.0, 0.0

    @property
    def tangential_load(self):
        return _weights(self.labels) @ self.deflection

    def step(self, d, u, friction):
        """Move in one step of two implicit stages; dissipated = tractions times slip."""
        rise, shift = d - self.d, u - self.u
        middle = self.d + GAMMA * rise
        first = self._labels(middle)
        trial = self._stuck(first, middle, GAMMA * shift, GAMMA * rise)
        moved, lost = _slide(trial, first, self.friction + GAMMA * (friction - self.friction))
        slip = _interpolate(self._labels(d), first, trial - moved)
        labels = self._labels(d)
        slip[labels > middle] = 0.0  # untouched at the first stage
        factor = (1 - GAMMA) / GAMMA
        trial = self._stuck(labels, d, shift, rise) - factor * slip
        deflection, lost_last = _slide(trial, labels, friction)
        self.dissipated += factor * lost + lost_last
        self.labels, self.deflection = labels, deflection
        self.d, self.u, self.friction = d, np.array(u), friction

    def _labels(self, d):
        """Labels from the edge of contact inwards."""
        inner = self.grid[self.grid < d - 0.02 * self.grid[1]]
        return np.append(inner, max(d, 0.0))[::-1]

    def _stuck(self, labels, d, shift, rise):
        """Deflections if no ring slips; those that touch on the path follow it from there on."""
        share = np.ones_like(labels)
        if rise > 0:
            share = np.minimum((d - labels) / rise, 1.0)
        return _interpolate(labels, self.labels, self.deflection) + share[:, None] * shift

    def traction_at(self, r):
        """Traction at radii, interpolated between the labels over the root of the depth."""
        depth = self.labels[0] - self.labels[1:]
        share = _transformation(self.labels) @ self.deflection[1:] / np.sqrt(depth)[:, None]
        found = _interpolate(r**2, self.labels[1:], share)
        return 2 / np.pi * found * np.sqrt(np.maximum(self.d - r**2, 0.0))[:, None]


def _interpolate(at, labels, values):
    """Values at labels; zero beyond the edge."""
    order = np.argsort(labels)
    return np.column_stack([
        np.interp(at, labels[order], column[order], right=0.0) for column in values.T
    ])  # fmt: skip


def _weights(labels):
    """T over the deflections at labels: divided differences of N."""
    weights = np.zeros(labels.size)
    if labels.size > 1:
        slopes = np.diff(4 / 3 * labels**1.5) / np.diff(labels)
        weights[1:] += slopes
        weights[:-1] -= slopes
    return weights


def _transformation(labels):
    """Matrix from deflections at the inner labels to tractions over 2E*/π√R there."""
    depth = labels[0] - labels
    root = np.sqrt(np.maximum(depth[:, None] - depth, 0.0))
    count = labels.size - 1
    slopes = np.diag(1 / np.diff(depth)) - np.diag(1 / np.diff(depth)[1:], -1)
    return np.tril(root[1:, :-1] - root[1:, 1:], 0) @ slopes[:count, :count]


def _slide(trial, labels, friction):
    """Deflections under Coulomb's law on each ring, nearest to a trial in energy; and tractions times slip."""
    if labels.size < 2:
        return np.zeros((1, 2)), 0.0
    transformation = _transformation(labels)
    inverse = np.linalg.inv(transformation)
    stiffness = inverse.T * _weights(labels)[1:]
    pull = stiffness @ trial[1:]
    limit = friction * np.sqrt(labels[0] - labels[1:])
    matrix = stiffness @ inverse
    traction = minimise(matrix, pull, limit, transformation @ trial[1:])
    lost = float((traction * (pull - matrix @ traction)).sum())
    return np.vstack([np.zeros((1, 2)), inverse @ traction]), lost
