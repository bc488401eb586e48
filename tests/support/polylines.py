"""Oracle at the friction limit: memory polylines in plain Python, carried in many small steps, held loads and all.

Every friction group remembers a list of vertices (label, anchor), from the deepest spring to the
contact edge; the label of a spring is the approach at which it first touches. A small step,
straight in approach and displacement, appends or cuts the edge and clips every spring to the cone
of Coulomb's law, whatever the polyline looks like. Nothing is known of fronts, of vertices that are
wiped out, or of where a load meets the limit: a held load is found step by step as the theory
defines it. At every moment the tangential load is the request, or the limit where that is less, and
the displacement takes the value nearest to its present one at which it is.

All lengths and loads are in units in which θ = E*/(4 G*) = 1.
"""

from itertools import pairwise

import numpy as np

TIE = 1e-12  # by how much, relatively, a load may miss the friction limit and is still at it


class Group:
    """Asperities with one coefficient: ascending gaps below the highest summit, and factors of N = k (a - h)^1.5."""

    def __init__(self, friction, gap, factor):
        order = np.argsort(gap)
        self.friction = friction
        self.gap, self.factor = (
            np.asarray(gap, dtype=float)[order],
            np.asarray(factor, dtype=float)[order],
        )

    def load(self, label):
        return float(self.factor @ np.clip(label - self.gap, 0, None) ** 1.5)

    def slope(self, label):
        return 1.5 * float(self.factor @ np.sqrt(np.clip(label - self.gap, 0, None)))


class Polylines:
    """Asperities in a state that `to` and `change_friction` move on.

    Parameters
    ----------
    height, radius, friction : array_like (asperity)
    contact_modulus : float
        E* of the units.

    Attributes
    ----------
    approach, displacement, dissipated : float
    request : float
        The tangential load asked for; beyond the friction limit it is held at the limit.
    """

    def __init__(self, height, radius, friction, contact_modulus=1.0):
        height, radius, friction = np.broadcast_arrays(
            np.atleast_1d(height), np.atleast_1d(radius), np.atleast_1d(friction)
        )
        gap, factor = height.max() - height, 4 / 3 * contact_modulus * np.sqrt(radius)
        self.groups = [
            Group(mu, gap[friction == mu], factor[friction == mu]) for mu in np.unique(friction)
        ]
        self.lines = [[] for _ in self.groups]
        self.approach = self.displacement = self.dissipated = self.request = 0.0

    @property
    def normal_load(self):
        return sum(group.load(self.approach) for group in self.groups)

    @property
    def limit(self):
        return self.limit_at(self.approach)

    @property
    def tangential_load(self):
        return self._force(self.lines)

    @property
    def stored(self):
        return self._stored(self.lines, self.displacement)

    def limit_at(self, approach):
        return sum(group.friction * group.load(approach) for group in self.groups)

    def approach_at(self, load):
        if load <= 0:
            return min(self.approach, 0.0)
        low, high = 0.0, 1.0
        while sum(group.load(high) for group in self.groups) < load:
            high *= 2
        while True:
            middle = (low + high) / 2
            if middle in (low, high):
                return high
            if sum(group.load(middle) for group in self.groups) < load:
                low = middle
            else:
                high = middle

    def to(self, normal, tangential, steps=400):
        """Go to targets of both channels, each ("load" | "displacement", value), or of two loads straight in both.

        A tangential load in company of an approach varies in proportion to the approach where it is
        held, and is otherwise the end of a path that is straight in approach and displacement.
        """
        both = normal[0] == tangential[0] == "load"
        d0, v0 = self.approach, self.displacement
        n0, t0 = self.normal_load, self.request
        d1 = normal[1] if normal[0] == "displacement" else self.approach_at(normal[1])
        if tangential[0] == "displacement":
            for k in range(1, steps + 1):
                self._step(d0 + (d1 - d0) * k / steps, v0 + (tangential[1] - v0) * k / steps)
            self.request = self.tangential_load
            return
        if both and d0 < 0 < d1:
            self._step(0.0, v0)
            d0 = 0.0
        within = abs(tangential[1]) < self.limit_at(d1) * (1 - TIE) and abs(t0) <= self.limit * (
            1 + TIE
        )
        if not both and within:
            # straight in approach and displacement: the end in one step, then the way there
            end = self._nearest(d1, tangential[1])
            for k in range(1, steps + 1):
                self._step(d0 + (d1 - d0) * k / steps, v0 + (end - v0) * k / steps)
        else:
            for share in self._shares(normal, both, steps):
                d = (
                    self.approach_at(n0 + (normal[1] - n0) * share)
                    if both
                    else d0 + (d1 - d0) * share
                )
                limit = self.limit_at(d)
                asked = t0 + (tangential[1] - t0) * share
                self._step(d, self._nearest(d, min(max(asked, -limit), limit)))
        self.request = tangential[1]

    def change_friction(self, factors, steps=400, hold=True):
        """Multiply the groups' coefficients, in small parts; with ``hold`` the displacement keeps the load."""
        first = [group.friction for group in self.groups]
        for k in range(1, steps + 1):
            for group, mu, factor in zip(self.groups, first, factors, strict=True):
                group.friction = mu * (1 + (factor - 1) * k / steps)
            target = min(max(self.request, -self.limit), self.limit)
            self._step(
                self.approach, self._nearest(self.approach, target) if hold else self.displacement
            )
        if not hold:
            self.request = self.tangential_load

    def vertices(self):
        """Polylines of all groups as arrays (vertex, 2) of label and anchor."""
        return [np.array(line) for line in self.lines]

    def _shares(self, normal, both, steps):
        """Ends of the steps of a path, as shares of it; where summits touch or leave, one ends."""
        gaps = np.unique(np.concatenate([group.gap for group in self.groups]))
        first = self.normal_load if both else self.approach
        reached = np.array([self._load_at(gap) for gap in gaps]) if both else gaps
        shares = (reached - first) / (normal[1] - first) if normal[1] != first else np.array([])
        return np.union1d(shares[(shares > 0) & (shares < 1)], np.arange(1, steps + 1) / steps)

    def _load_at(self, approach):
        return sum(group.load(approach) for group in self.groups)

    def _step(self, d, v):
        lines = self._carried(d, v)
        before, force = self._stored(self.lines, self.displacement), self.tangential_load
        # the moved springs before they slip tell nothing: the work of the mean load does
        work = 0.5 * (force + self._force(lines)) * (v - self.displacement)
        self.dissipated += work + before - self._stored(lines, v)
        self.lines, self.approach, self.displacement = lines, d, v

    def _carried(self, d, v):
        d0, v0 = self.approach, self.displacement
        return [
            _clipped(_extended(line, group.gap[0], d0, v0, d, v), d, v, group.friction)
            for group, line in zip(self.groups, self.lines, strict=True)
        ]

    def _force(self, lines):
        return sum(
            (w1 - w0) / (a1 - a0) * (group.load(a1) - group.load(a0))
            for group, line in zip(self.groups, lines, strict=True)
            for (a0, w0), (a1, w1) in pairwise(line)
        )

    def _stored(self, lines, v):
        nodes, weights = np.polynomial.legendre.leggauss(5)
        total = 0.0
        for group, line in zip(self.groups, lines, strict=True):
            for (a0, w0), (a1, w1) in pairwise(line):
                for h, k in zip(group.gap, group.factor, strict=True):
                    low, high = np.sqrt(max(a0 - h, 0)), np.sqrt(max(a1 - h, 0))
                    x = (low + high) / 2 + (high - low) / 2 * nodes
                    deflection = v - w0 - (w1 - w0) / (a1 - a0) * (h + x**2 - a0)
                    total += 0.75 * k * (high - low) * float(weights @ deflection**2) / 2
        return total

    def _nearest(self, d, target):
        """Displacement nearest to the present one at which a step to approach d ends at a tangential load."""
        slack = 1e-13 * self.limit_at(d)

        def missing(v):
            return target - self._force(self._carried(d, v))

        present = self.displacement
        if abs(missing(present)) <= slack:
            return present
        side = 1.0 if missing(present) > 0 else -1.0
        stride = 1e-3 * max(d, self.approach)
        far = present + side * stride
        while side * missing(far) > slack:
            stride *= 2
            far = present + side * stride
            if stride > 1e6:
                return present
        near = present
        while True:
            middle = (near + far) / 2
            if middle in (near, far):
                return far
            if side * missing(middle) > slack:
                near = middle
            else:
                far = middle


def _extended(line, gap, d0, v0, d, v):
    """Anchors of the springs that touch at approach d, before any slip."""
    if d <= gap:
        return []
    if not line:
        start = v0 + (v - v0) * (gap - d0) / (d - d0) if d > d0 else v
        return [(gap, start), (d, v)]
    if d > line[-1][0]:
        return [*line, (d, v)]
    kept = [vertex for vertex in line if vertex[0] < d]
    if not kept:
        # rounding has the first spring touch a little beyond the gap
        return []
    (a0, w0), (a1, w1) = kept[-1], line[len(kept)]
    return [*kept, (d, w0 + (w1 - w0) * (d - a0) / (a1 - a0))]


def _clipped(line, d, v, friction):
    """Clip deflections to |deflection| ≤ μ (d - a), with vertices where the sides of the cone are crossed."""
    fine = line[:1]
    for (a0, w0), (a1, w1) in pairwise(line):
        shares = []
        for side in (-1.0, 1.0):
            over0, over1 = v - w0 - side * friction * (d - a0), v - w1 - side * friction * (d - a1)
            if over0 * over1 < 0:
                shares.append(over0 / (over0 - over1))
        fine += [(a0 + s * (a1 - a0), w0 + s * (w1 - w0)) for s in sorted(shares)]
        fine.append((a1, w1))
    held = [(a, v - min(max(v - w, -friction * (d - a)), friction * (d - a))) for a, w in fine]
    tidy = []
    for vertex in held:
        if tidy and vertex[0] - tidy[-1][0] <= 1e-15 * d:
            tidy[-1] = vertex
            continue
        if len(tidy) > 1:
            (a0, w0), (a1, w1) = tidy[-2:]
            straight = w0 + (w1 - w0) * (vertex[0] - a0) / (a1 - a0)
            ahead = w0 + (vertex[1] - w0) * (a1 - a0) / (vertex[0] - a0)
            if abs(straight - vertex[1]) <= 1e-15 * d and abs(ahead - w1) <= 1e-15 * d:
                tidy.pop()
        tidy.append(vertex)
    return tidy
