"""`NormalCurves`: a contact given by its load and area against approach, patch by patch.

The memory replays knots derived from the table, between which the stiffness dP/da is linear. The
load P is a parabola between two knots, and convex where the stiffness rises; a flat punch is one
knot, with its full stiffness from first touch. A convex table is met exactly at its rows. A noisy
table is replaced by the nearest convex curve (a monotone regression of the stiffness).
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Array, Booleans, Floats, Integers, as_floats
from historysim.basics.library import ffi, lib, pointer
from historysim.errors import CurveEndError, InputError, distinct_texts
from historysim.memory.binding import LOAD, check, fill
from historysim.memory.paths import Paths, Rows

FEWEST = 4  # minimum number of rows of a table
# Largest root mean square residual of the total, relative to its largest load, that is accepted as
# noise.
NOT_CONVEX = 0.05
# A residual above the first limit, relative to the largest load, is compared with the noise; it is
# not noise if its median over the standard deviation exceeds the second (0.67 for Gaussian noise).
BENDS, MOST_DEVIATIONS = 0.005, 1.5
HALVINGS = 12  # rows added before the first row of a table, each at half the approach of the next
# relative rounding error: of a decrease of the stiffness, of a path beyond the table
ROUNDING = 1e-9
# largest number of rows that are met exactly; a longer table is treated as a measurement
MOST_ROWS = 600
# largest number of approaches at which the stiffness of a measured curve may change its slope
MOST_NODES = 120
# Number of tables with simulated noise, the worst of which gives the uncertainty of a measured
# curve.
REPLICAS, SEED = 40, 1
# one of this number of rows is retained when the error between rows is estimated by
# cross-validation
LEFT_OUT = 3
UNKNOWN = 0.25  # error of a power law before the first row, relative to the triangle that bounds it
# Residual over the noise above which it is a bend that the nodes of a measured curve cannot follow.
DEVIATIONS = 4.0


class Knots(NamedTuple):
    """A rising convex curve P(a): knots [m], and the stiffness there [N/m]."""

    label: Floats
    stiffness: Floats

    def loads(self, approach: Floats) -> Floats:
        """Return P at approaches [N]."""
        rise = np.append(
            0.0, np.cumsum(np.diff(self.label) * 0.5 * (self.stiffness[1:] + self.stiffness[:-1]))
        )
        # a jump of the stiffness is two knots at one approach
        bend = np.append(np.diff(self.stiffness) / np.maximum(np.diff(self.label), 1e-300), 0.0)
        index = np.clip(
            np.searchsorted(self.label, approach, side="left") - 1, 0, self.label.size - 1
        )
        x = np.clip(approach - self.label[index], 0.0, None)
        load: Floats = rise[index] + x * (self.stiffness[index] + 0.5 * bend[index] * x)
        return load


def hertz_constant(approach: Floats, load: Floats) -> float | None:
    """Return k of P = k a^(3/2) [N/m^1.5] if a table follows it to rounding, else None."""
    constant = load / approach**1.5
    return float(constant[-1]) if np.ptp(constant) < ROUNDING * constant[-1] else None


def is_convex(approach: Floats, load: Floats) -> bool:
    """Return True if a table, which begins at first touch, is convex to rounding."""
    secant = np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0)
    return bool((np.diff(secant) >= -ROUNDING * secant[1:]).all())


def interpolate_convex(approach: Floats, load: Floats, stiffness: Floats | None = None) -> Knots:
    """Interpolate a convex table exactly, with one additional knot between two rows (Schumaker 1983).

    Stiffnesses dP/da just before rows [N/m] are NaN where unknown; P is then straight up to the
    first row. By default they are estimated from three rows each, and the load is a power of the
    approach before the first row.
    """
    from scipy.optimize import isotonic_regression

    if stiffness is None:
        below = 0.5 ** np.arange(HALVINGS, 0, -1)
        exponent = _first_exponent(approach, load)
        nodes = np.concatenate([approach[0] * below, approach])
        loads = np.concatenate([load[0] * below**exponent, load])
        slope = _slopes(nodes, loads)
    else:
        nodes, loads = approach, load
        unknown = np.isnan(stiffness)
        slope = (
            np.where(unknown, _slopes(approach, load), stiffness) if unknown.any() else stiffness
        )
    secant = np.diff(loads, prepend=0.0) / np.diff(nodes, prepend=0.0)
    # it rises, apart from rounding or the residual of a numerical solution
    secant = isotonic_regression(secant, weights=np.diff(nodes, prepend=0.0)).x
    above = np.append(secant[1:], np.inf)
    slope = np.append(
        max(2 * secant[0] - min(slope[0], above[0]), 0.0), np.clip(slope, secant, above)
    )
    return _insert_knots(np.append(0.0, nodes), secant, slope)


def _first_exponent(approach: Floats, load: Floats) -> float:
    """Estimate the exponent of P ∝ a^n before the first row from the three rows that follow."""
    x, y = np.log(approach[:3]), np.log(load[:3])
    slopes = np.diff(y) / np.diff(x)
    at_first = slopes[0] - (slopes[1] - slopes[0]) * (x[1] - x[0]) / (x[2] - x[0])
    steepest = (load[1] - load[0]) / (approach[1] - approach[0]) * approach[0] / load[0]
    return float(np.clip(at_first, 1.0, max(steepest, 1.0)))


def _slopes(approach: Floats, load: Floats) -> Floats:
    """Estimate dP/da at rows, by power laws through three neighbouring rows."""
    x, y = np.log(approach), np.log(load)
    width, rise = np.diff(x), np.diff(y) / np.diff(x)
    inner = (rise[:-1] * width[1:] + rise[1:] * width[:-1]) / (width[:-1] + width[1:])
    ends = rise[0] - (inner[0] - rise[0]), rise[-1] + (rise[-1] - inner[-1])
    exponent = np.concatenate([ends[:1], inner, ends[1:]])
    slope: Floats = exponent * load / approach
    return slope


def _insert_knots(nodes: Floats, secant: Floats, slope: Floats) -> Knots:
    """Insert a knot between each two nodes so that stiffnesses at nodes and secants between them are met."""
    low, high, width = slope[:-1], slope[1:], np.diff(nodes)
    middle = 2 * secant - 0.5 * (low + high)
    # where a knot in the middle is impossible: the stiffness at the knot equals that at one end
    is_late, is_early = middle < low, middle > high
    position = np.full(width.size, 0.5)
    rise = np.where(high > low, high - low, 1.0)
    position[is_late] = 1 - 2 * ((secant - low) / rise)[is_late]
    position[is_early] = 2 * ((high - secant) / rise)[is_early]
    # snap a jump to one approach, to the bit
    position = np.where(position < ROUNDING, 0.0, np.where(position > 1 - ROUNDING, 1.0, position))
    middle = np.clip(np.where(is_late, low, np.where(is_early, high, middle)), low, high)
    inner = np.where(position == 1.0, nodes[1:], nodes[:-1] + position * width)
    label = np.column_stack([nodes[:-1], inner]).ravel()
    stiffness = np.column_stack([low, middle]).ravel()
    label, stiffness = np.append(label, nodes[-1]), np.append(stiffness, slope[-1])
    # drop knots that duplicate the previous one
    distinct = np.append(True, (np.diff(label) > 0) | (np.diff(stiffness) > 0))
    return Knots(label[distinct], np.maximum.accumulate(stiffness[distinct]))


def estimate_noise(approach: Floats, load: Floats) -> Floats:
    """Estimate the standard deviation of the noise of each row [N] from differences of neighbouring rows.

    One part of it is constant, the other proportional to the load (Gasser, Sroka and
    Jennen-Steinmetz 1986).
    """
    from scipy.optimize import nnls

    a, p = np.append(0.0, approach), np.append(0.0, load)
    weight = (a[2:] - a[1:-1]) / (a[2:] - a[:-2])
    square = (p[1:-1] - weight * p[:-2] - (1 - weight) * p[2:]) ** 2 / (
        1 + weight**2 + (1 - weight) ** 2
    )
    terms = np.column_stack([np.ones(square.size), (p[1:-1] / p.max()) ** 2])
    variance = np.full(square.size, square.mean() or 1e-300)
    for _ in range(5):
        coefficients = nnls(terms / variance[:, None], square / variance)[0]
        variance = np.maximum(terms @ coefficients, 1e-6 * square.mean() + 1e-300)
    noise: Floats = np.sqrt(
        np.maximum(coefficients[0] + coefficients[1] * (load / p.max()) ** 2, 1e-6 * square.mean())
    )
    return noise


class Regression:
    """Nearest convex curves to noisy tables with rows at the same approaches [m]; ``noise`` > 0 in N (row)."""

    def __init__(self, approach: Floats, noise: Floats) -> None:
        count = min(MOST_NODES, 2 * approach.size)
        even = np.quantile(approach, np.linspace(0, 1, count - count // 4))
        refined = even[0] * 0.5 ** np.arange(count // 4, -1, -1)
        self.nodes = np.unique(np.concatenate([[0.0], refined, even]))
        width = np.diff(self.nodes)
        x = np.clip(approach[:, None] - self.nodes[:-1], 0.0, None)
        # loads of stiffnesses that rise from 0 to 1 between two nodes, and of a constant stiffness
        # from first touch
        ramps = np.where(x < width, 0.5 * x**2 / width, x - 0.5 * width)
        self._basis = np.column_stack([approach, ramps])
        self._approach, self._noise = approach, noise
        self._columns, self._triangle = np.linalg.qr(self._basis / noise[:, None])
        self._size = np.linalg.norm(self._triangle, axis=0)

    def fit(self, load: Floats) -> Knots:
        """Fit the nearest convex curve to loads (row) [N]."""
        from scipy.optimize import nnls

        projected = self._columns.T @ (load / self._noise)
        steps = (
            nnls(self._triangle / self._size, projected, maxiter=100 * self._size.size)[0]
            / self._size
        )
        return Knots(self.nodes, np.cumsum(steps))

    def error(self, load: Floats) -> float:
        """Estimate the error of the curve fitted to loads (row) [N].

        It is the largest deviation in `REPLICAS` tables with simulated noise, plus the error
        between rows, plus the residual beyond the noise.
        """
        curve = self.fit(load)
        at_nodes, at_rows, rng = (
            curve.loads(self.nodes),
            curve.loads(self._approach),
            np.random.default_rng(SEED),
        )
        tables = at_rows + self._noise * rng.normal(size=(REPLICAS, load.size))
        deviations = [
            float(np.abs(self.fit(table).loads(self.nodes) - at_nodes).max()) for table in tables
        ]
        beyond = float(np.max(np.abs(at_rows - load) - DEVIATIONS * self._noise, initial=0.0))
        # the noise estimated from few rows is itself uncertain
        spread = max(deviations) * (1.0 + 2.0 / math.sqrt(load.size))
        return spread + float(_triangle_heights(self._approach, at_rows).max()) + beyond


def error_between_rows(approach: Floats, load: Floats, *, straight: bool = False) -> float:
    """Estimate the largest error between the rows of a convex table [N].

    ``straight``: the load is known to be straight up to the first row.
    """
    # cross-validation: every third row is retained, in turn, and the differences at the other rows
    # are an upper estimate; no convex curve through the rows differs by more than the triangles
    # between their secants
    height = _triangle_heights(approach, load)
    height[0] *= not straight
    if approach.size < LEFT_OUT * LEFT_OUT:
        return float(height.max())
    # only one row constrains the curve at first touch
    largest = float(height[0]) * UNKNOWN
    for start in range(LEFT_OUT):
        retained = np.zeros(approach.size, dtype=bool)
        retained[start::LEFT_OUT] = retained[-1] = True
        left_out = interpolate_convex(approach[retained], load[retained]).loads(approach[~retained])
        largest = max(largest, float(np.abs(left_out - load[~retained]).max()))
    return min(largest, float(height.max()))


def _triangle_heights(approach: Floats, load: Floats) -> Floats:
    """Return the heights of the triangles that bound a convex curve through rows, one before each row [N]."""
    width, secant = (
        np.diff(approach, prepend=0.0),
        np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0),
    )
    previous, following = np.append(0.0, secant[:-1]), np.append(secant[1:], np.inf)
    below = (secant - previous) * width
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.where(
            following > previous, below * (following - secant) / (following - previous), 0.0
        )
    height[-1] = below[-1]
    return height


class Superposition(NamedTuple):
    """State of a contact as sums over the rows of its normal curves.

    At every point the pressure is the sum of the rows' pressures with weights ``normal``, and the
    traction the sum with weights ``tangential``. Points that first touched at ``stick_approach``
    [m] or before stick.
    """

    approach: float
    stick_approach: float
    normal: Floats
    tangential: Floats


@attrs.frozen(eq=False)
class NormalCurves:
    """Normal curves of patches of one contact, and the total curve on which the memory is replayed.

    The total curve rises and is convex: it has knots with a stiffness, or is a Hertz curve if the
    table has one patch and follows Hertz to rounding. Each patch, and each point of the surface,
    carries its fraction of the load increment from row to row. Pressures grow with the approach
    everywhere, so that the traction is within the friction limit at every point (Jäger; Ciavarella:
    tangential loads are superpositions of normal loads, for any contact).
    """

    approach: Floats  #: of the table: approaches of the whole contact from first touch (row) [m]
    load: Floats = attrs.field(repr=False)  #: loads (row, patch) [N]
    #: Of the curve: approaches of its knots (element) [m]; 0 of a Hertzian contact.
    label: Floats = attrs.field(repr=False)
    #: dP/da at the knots (element) [N/m]
    stiffness: Floats | None = attrs.field(default=None, repr=False)
    #: Of a Hertzian contact: k of P(a) = k a^(3/2) (element) [N/m^1.5].
    weight: Floats | None = attrs.field(default=None, repr=False)
    area: Floats | None = attrs.field(default=None, repr=False)  #: contact areas (row, patch) [m²]
    #: Standard deviations of the noise of the total (row) [N], where there is any.
    noise: Floats | None = attrs.field(default=None, repr=False)
    x: Floats | None = attrs.field(default=None, repr=False)
    y: Floats | None = attrs.field(default=None, repr=False)  #: positions (patch) [m]

    @classmethod
    def from_table(
        cls,
        approach: npt.ArrayLike,
        load: npt.ArrayLike,
        area: npt.ArrayLike | None = None,
        *,
        noise: npt.ArrayLike | None = None,
        x: npt.ArrayLike | None = None,
        y: npt.ArrayLike | None = None,
    ) -> Self:
        """Build the curves from a table; see `Patches.from_normal_curves`."""
        rows, loads, areas = _table(approach, load, area)
        deviation = None if noise is None else _noise(noise, rows.size)
        optional: dict[str, Any] = {"area": areas}
        positions = ("x", x), ("y", y)
        optional |= {
            name: np.atleast_1d(as_floats(name, position))
            for name, position in positions
            if position is not None
        }
        total = loads.sum(axis=1)
        exact = deviation is None and rows.size <= MOST_ROWS and is_convex(rows, total)
        if exact and loads.shape[1] == 1 and (constant := hertz_constant(rows, total)):
            return cls(rows, loads, np.zeros(1), weight=np.array([constant]), **optional)
        if exact:
            curve = interpolate_convex(rows, total)
        else:
            deviation = estimate_noise(rows, total) if deviation is None else deviation
            curve = Regression(rows, deviation).fit(total)
            _check_convex(rows, total, curve, deviation)
        return cls(rows, loads, *curve, noise=deviation, **optional)

    @classmethod
    def from_exact(
        cls, approach: Floats, load: Floats, area: Floats, stiffness: Floats, **positions: Floats
    ) -> Self:
        """Build the curves from solutions with known stiffnesses; the load is straight up to the first row."""
        return cls(
            approach,
            load,
            *interpolate_convex(approach, load.sum(axis=1), stiffness),
            area=area,
            **positions,
        )

    def __len__(self) -> int:
        """Return the number of patches."""
        return int(self.load.shape[1])

    @property
    def arrays(self) -> Mapping[str, Floats]:
        """Arrays that are stored in a log, by name."""
        values = attrs.asdict(self, recurse=False)
        return {name: array for name, array in values.items() if array is not None}

    @property
    def first_touch(self) -> Floats:
        """Approach up to which each patch has no load in the table [m] (patch)."""
        touch: Floats = np.append(0.0, self.approach)[(self.load > 0).argmax(axis=0)]
        return touch

    def total(self, approach: Floats) -> Floats:
        """Return the replayed total load at approaches [N]."""
        if self.weight is not None:
            return np.asarray(self.weight * np.clip(approach, 0.0, None) ** 1.5)
        return Knots(self.label, np.asarray(self.stiffness)).loads(approach)

    @property
    def is_extrapolated_to_touch(self) -> bool:
        """True if the load before the first row is extrapolated from the rows after it."""
        # a straight piece has at most one knot, in its middle
        return self.stiffness is not None and bool(self.label[1] < 0.1 * self.approach[0])

    @property
    def residual(self) -> float:
        """Largest difference between the replayed and the tabulated total load, relative to the largest load."""
        total = self.load.sum(axis=1)
        return float(np.abs(self.total(self.approach) - total).max() / total[-1])

    def error(self) -> float:
        """Estimate the error of the replayed total load, relative to the largest load.

        Without noise it estimates the error between the rows by cross-validation: every third row
        is retained, in turn, and the differences at the other rows are taken; for fewer than nine
        rows, it is the largest difference between convex curves through them. With noise, 95 of 100
        such tables give a curve with a smaller error. The error at a kink in a long noisy table may
        be larger, if the kink is between two of the at most `MOST_NODES` nodes at which the
        stiffness can change its slope.
        """
        total = self.load.sum(axis=1)
        if self.weight is not None:
            return self.residual
        if self.noise is not None:
            return Regression(self.approach, self.noise).error(total) / float(total[-1])
        straight = not self.is_extrapolated_to_touch
        return error_between_rows(self.approach, total, straight=straight) / float(total[-1])

    def superpose(self, vertices: Array, units: Any, stick_approach: float) -> Superposition:
        """Return the weights of the rows of the table in a state, from the vertices of its memory.

        The weights are the same for every patch and every point of the surface: its load is the
        weighted sum of its tabulated loads.
        """
        # fraction of the load increment of each row that is reached at the label of each vertex
        rise = np.append(0.0, self.total(self.approach))
        load = self.total(vertices["label"] * units.length)[:, None]
        fraction = np.clip((load - rise[:-1]) / np.diff(rise), 0.0, 1.0)
        normal = fraction[-1] if len(fraction) else np.zeros(self.approach.size)
        tangential = vertices["slope"][1:] @ np.diff(fraction, axis=0) if len(fraction) else normal
        approach = float(vertices["label"][-1] * units.length) if len(fraction) else 0.0
        weights = (profile - np.append(profile[1:], 0.0) for profile in (normal, tangential))
        return Superposition(approach, stick_approach, *weights)

    def stick_approach(self, elements: Rows) -> Floats:
        """Return the approach at which the edge of the stick zone first touched (row) [m], 0 in gross slip."""
        # on the first element, which touches at 0, areas are proportional to approaches
        radius, stick = elements.contact_radius[:, 0], elements.stick_radius[:, 0]
        ratio = np.divide(stick, radius, out=np.zeros_like(radius), where=radius > 0)
        inner: Floats = np.clip(elements.totals["approach"], 0.0, None) * ratio**2
        return inner

    def project(self, elements: Rows, friction: float, patches: Integers, rows: Rows) -> None:
        """Fill rows of patches (column) from rows of all elements; radii are those of circles of equal area."""
        rows.totals[...] = elements.totals
        for name, values in elements.vectors.items():
            rows.vectors[name][...] = values
        approach, stick = elements.totals["approach"], self.stick_approach(elements)
        touch = self.first_touch
        rows.totals["contact_count"] = np.searchsorted(np.sort(touch), approach, side="left")
        table = np.append(0.0, self.approach)
        area = np.zeros_like(self.load) if self.area is None else self.area
        rows.totals["real_contact_area"] = np.interp(
            approach, table, np.append(0.0, area.sum(axis=1))
        )
        if not patches.size:
            return
        # fraction of the total load increment of each row that each patch carries, and the row of
        # each element
        gain = np.diff(self.load[:, patches].T, prepend=0.0) / np.diff(
            self.load.sum(axis=1), prepend=0.0
        )
        row = np.searchsorted(self.approach, self.label, side="right").clip(
            max=self.approach.size - 1
        )
        if self.weight is not None:
            # a Hertzian contact is one patch and carries the total in all rows
            row, gain = np.zeros_like(row), np.ones((patches.size, self.approach.size))
        struct = ffi.new("hs_patches *", {"count": patches.size, "rows": self.approach.size})
        areas = np.vstack([np.zeros(patches.size), area[:, patches]])
        arrays = {"gain": gain, "approach": table, "area": areas, "first_touch": touch[patches]}
        # arrays that the struct points to must outlive it
        owners = fill(struct, arrays), row.astype(np.int64)
        struct.row = pointer(owners[1])
        edges = pointer(np.ascontiguousarray(approach)), pointer(stick)
        knots = np.arange(self.label.size)
        # loads are sums over elements, so that in two directions each component is projected
        # separately
        for component in [(..., 0), (..., 1)] if rows.vectors else [(...,)]:
            source, target = (
                Rows(
                    block.totals,
                    block.each
                    | {"tangential_load": np.ascontiguousarray(block.tangential_load[component])},
                )
                for block in (elements, rows)
            )
            written = source.as_struct(knots), target.as_struct(patches)
            check(
                lib.hs_record_patches(
                    struct, written[0], approach.size, *edges, friction, written[1]
                )
            )
            rows.tangential_load[component] = target.tangential_load

    def check_reach(self, paths: Paths) -> None:
        """Check that paths, with targets in N and m, stay within the table; CurveEndError with the path's index."""
        load, approach = float(self.load[-1].sum()), float(self.approach[-1])
        by_load = paths["normal_control"] == LOAD
        limit = np.where(by_load, load, approach) * (1.0 + ROUNDING)
        beyond = (paths["normal_fraction"] > 0) & (paths["normal_target"] > limit)
        if beyond.any():
            path = int(beyond.argmax())
            name, unit = ("a normal load", "N") if by_load[path] else ("an approach", "m")
            target_text, end_text = distinct_texts(
                float(paths["normal_target"][path]), load if by_load[path] else approach
            )
            ends = (
                f"{end_text} N and {approach:.6g} m"
                if by_load[path]
                else f"{load:.6g} N and {end_text} m"
            )
            raise CurveEndError(f"{name} of {target_text} {unit}", ends, path)


def _noise(noise: npt.ArrayLike, rows: int) -> Floats:
    deviation = as_floats("noise", noise, above=0)
    if deviation.size not in (1, rows) or deviation.ndim > 1:
        raise InputError(
            f"noise has shape {deviation.shape}; expected one number, or {rows}, one for each load"
        )
    return np.broadcast_to(deviation, rows).astype(np.float64)


def _check_convex(rows: Floats, total: Floats, curve: Knots, noise: Floats) -> None:
    """Check that the residual of the nearest convex curve is noise; InputError if the table is not convex."""
    residual = np.abs(curve.loads(rows) - total)
    row = int(residual.argmax())
    worst = float(residual[row] / total.max())
    bends = worst > BENDS and np.median(residual / noise) > MOST_DEVIATIONS
    if bends or np.sqrt((residual**2).mean()) > NOT_CONVEX * total.max():
        raise InputError(
            f"the total load is not convex: at an approach of {rows[row]:.4g} m it is {total[row]:.4g} N, and the "
            f"nearest convex curve has {curve.loads(rows)[row]:.4g} N ({worst:.1%} of the largest load); expected a "
            "load that rises ever faster, as the load of an elastic contact does"
        )


def _table(
    approach: npt.ArrayLike, load: npt.ArrayLike, area: npt.ArrayLike | None
) -> tuple[Floats, Floats, Floats | None]:
    """Check a table and drop a first row without a load."""
    rows = as_floats("approach", approach)
    if rows.ndim != 1:
        raise InputError(
            f"approach has shape {rows.shape}; expected a list with one value for each row of the table"
        )
    loads = _columns("load", load, rows.size)
    areas = None if area is None else _columns("area", area, rows.size)
    if areas is not None and areas.shape != loads.shape:
        raise InputError(
            f"area has {areas.shape[1]} columns and load {loads.shape[1]}; expected one for each patch"
        )
    if rows.size and rows[0] == 0.0 and not loads[0].any():
        rows, loads, areas = rows[1:], loads[1:], None if areas is None else areas[1:]
    if rows.size < FEWEST:
        raise InputError(
            f"the normal curve has {rows.size} rows with a load; expected {FEWEST} or more"
        )
    total = loads.sum(axis=1)
    _check_values(
        "approach",
        rows,
        np.diff(rows, prepend=0.0) <= 0,
        "ascending values; the first touch is at 0",
    )
    _check_values(
        "load",
        total,
        total <= 0,
        "more than 0 from first touch on; take the approach from first touch",
    )
    for name, values in (("load", loads), ("area", areas)):
        if values is None:
            continue
        _check_values(name, values, values < 0, "0 or more")
        # the load of a single patch is the total, whose noise is smoothed
        if name == "area" or values.shape[1] > 1:
            falls = np.maximum.accumulate(values, axis=0) - values > NOT_CONVEX * values.max(axis=0)
            _check_values(
                name,
                values,
                falls,
                "a value that rises with the approach, as areas and pressures do",
            )
    if areas is not None:
        _check_values(
            "area",
            areas,
            (areas == 0) & (loads > 0),
            "more than 0 where there is a load, or no areas",
        )
    return rows, loads, areas


def _check_values(name: str, values: Floats, wrong: Booleans, expected: str) -> None:
    """Raise an InputError that names the row, and the patch, of the first invalid value."""
    if wrong.any():
        position = tuple(np.argwhere(wrong)[0])
        where = f"row {position[0]} of {f'patch {position[1]}' if len(position) > 1 else 'the normal curve'}"
        raise InputError(f"{name} is {values[position]:.6g} in {where}; expected {expected}")


def _columns(name: str, values: npt.ArrayLike, count: int) -> Floats:
    array = as_floats(name, values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] == 0:
        raise InputError(
            f"{name} has shape {np.shape(values)} for {count} approaches; expected one row for each approach, and one "
            "column for each patch"
        )
    return array
