"""`NormalCurves`: a contact given by how its load and area rise with the approach, patch by patch.

Of a table follows what the memory replays: knots, between which the stiffness dP/da goes straight. The load P is then a
parabola between two knots, and convex wherever the stiffness rises: a flat punch is one knot, with its stiffness there
at once. A table that is convex is met exactly at its rows. One that noise makes otherwise gets the convex curve that is
nearest to it (a monotone regression of the stiffness).
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Array, Booleans, Floats, Integers, checked
from historysim.basics.library import ffi, lib, pointer
from historysim.errors import CurveEndError, InputError, distinct_texts
from historysim.memory.binding import LOAD, check, fill
from historysim.memory.paths import Paths, Rows

FEWEST = 4  # rows that make a table
# Root mean square misfit of the total, over its largest load, from which it is no noise that could be smoothed.
NOT_CONVEX = 0.05
# Largest misfit from which it is compared with the noise, and its median over the noise from which it is none: of
# Gaussian noise that is .67.
BENDS, MOST_DEVIATIONS = 0.005, 1.5
HALVINGS = 12  # rows below the first one of a table, each at half the approach of the next one
ROUNDING = 1e-9  # what is taken for rounding, relatively: a fall of the stiffness, a path beyond the table
MOST_ROWS = 600  # rows of a table that is met exactly; a longer one is a measurement
MOST_NODES = 120  # places where the stiffness of a measured curve may change its slope
# Tables with other noise that the uncertainty of a measured curve is taken from: the worst of them.
REPLICAS, SEED = 40, 1
LEFT_OUT = 3  # one of so many rows is kept to see what the others say of the error between rows
UNKNOWN = 0.25  # part of the triangle before the first row that a power of the approach may be off by there
# Misfit over the noise from which it is none, but a bend that the nodes of a measured curve cannot follow.
DEVIATIONS = 4.0


class Knots(NamedTuple):
    """A curve P(a) that rises and is convex: knots [m], and the stiffness there [N/m]."""

    label: Floats
    stiffness: Floats

    def loads(self, approach: Floats) -> Floats:
        """Return P at approaches [N]."""
        rise = np.append(0.0, np.cumsum(np.diff(self.label) * 0.5 * (self.stiffness[1:] + self.stiffness[:-1])))
        # a jump of the stiffness is two knots at one place
        bend = np.append(np.diff(self.stiffness) / np.maximum(np.diff(self.label), 1e-300), 0.0)
        index = np.clip(np.searchsorted(self.label, approach, side="left") - 1, 0, self.label.size - 1)
        x = np.clip(approach - self.label[index], 0.0, None)
        found: Floats = rise[index] + x * (self.stiffness[index] + 0.5 * bend[index] * x)
        return found


def hertzian(approach: Floats, load: Floats) -> float | None:
    """Return k of P = k a^(3/2) [N/m^1.5], which a table is to rounding; None where it is not."""
    constant = load / approach**1.5
    return float(constant[-1]) if np.ptp(constant) < ROUNDING * constant[-1] else None


def is_convex(approach: Floats, load: Floats) -> bool:
    """Return whether a table, which begins at first touch, is convex to rounding."""
    secant = np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0)
    return bool((np.diff(secant) >= -ROUNDING * secant[1:]).all())


def through(approach: Floats, load: Floats, stiffness: Floats | None = None) -> Knots:
    """Return the curve that meets a convex table at its rows, with one knot more between two rows (Schumaker 1983).

    Stiffnesses dP/da just before rows [N/m] are NaN where they are not known; P is then straight up to the first row.
    By default they follow from three rows each, and below the first row the load is a power of the approach.
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
        slope = np.where(unknown, _slopes(approach, load), stiffness) if unknown.any() else stiffness
    secant = np.diff(loads, prepend=0.0) / np.diff(nodes, prepend=0.0)
    # to rounding, or to what solutions leave, it rises
    secant = isotonic_regression(secant, weights=np.diff(nodes, prepend=0.0)).x
    above = np.append(secant[1:], np.inf)
    slope = np.append(max(2 * secant[0] - min(slope[0], above[0]), 0.0), np.clip(slope, secant, above))
    return _joined(np.append(0.0, nodes), secant, slope)


def _first_exponent(approach: Floats, load: Floats) -> float:
    """Return the power of the approach that the load is before the first row, by the three rows that follow."""
    x, y = np.log(approach[:3]), np.log(load[:3])
    slopes = np.diff(y) / np.diff(x)
    at_first = slopes[0] - (slopes[1] - slopes[0]) * (x[1] - x[0]) / (x[2] - x[0])
    steepest = (load[1] - load[0]) / (approach[1] - approach[0]) * approach[0] / load[0]
    return float(np.clip(at_first, 1.0, max(steepest, 1.0)))


def _slopes(approach: Floats, load: Floats) -> Floats:
    """Return dP/da at rows, by powers of the approach through three of them."""
    x, y = np.log(approach), np.log(load)
    width, rise = np.diff(x), np.diff(y) / np.diff(x)
    inner = (rise[:-1] * width[1:] + rise[1:] * width[:-1]) / (width[:-1] + width[1:])
    ends = rise[0] - (inner[0] - rise[0]), rise[-1] + (rise[-1] - inner[-1])
    exponent = np.concatenate([ends[:1], inner, ends[1:]])
    found: Floats = exponent * load / approach
    return found


def _joined(nodes: Floats, secant: Floats, slope: Floats) -> Knots:
    """Return knots with these stiffnesses at nodes and loads that rise as the secants say."""
    low, high, width = slope[:-1], slope[1:], np.diff(nodes)
    middle = 2 * secant - 0.5 * (low + high)
    # where the middle is no place for the knot: the stiffness there is that of one end
    late, early = middle < low, middle > high
    part = np.full(width.size, 0.5)
    rise = np.where(high > low, high - low, 1.0)
    part[late] = 1 - 2 * ((secant - low) / rise)[late]
    part[early] = 2 * ((high - secant) / rise)[early]
    # a jump is one at one place, to the bit
    part = np.where(part < ROUNDING, 0.0, np.where(part > 1 - ROUNDING, 1.0, part))
    middle = np.clip(np.where(late, low, np.where(early, high, middle)), low, high)
    inner = np.where(part == 1.0, nodes[1:], nodes[:-1] + part * width)
    label = np.column_stack([nodes[:-1], inner]).ravel()
    stiffness = np.column_stack([low, middle]).ravel()
    label, stiffness = np.append(label, nodes[-1]), np.append(stiffness, slope[-1])
    # knots that nothing happens at
    kept = np.append(True, (np.diff(label) > 0) | (np.diff(stiffness) > 0))
    return Knots(label[kept], np.maximum.accumulate(stiffness[kept]))


def estimated_noise(approach: Floats, load: Floats) -> Floats:
    """Return the standard deviation of the noise of each row [N] that differences of neighbouring rows show.

    A part of it is the same everywhere, the other in proportion to the load (Gasser, Sroka and Jennen-Steinmetz 1986).
    """
    from scipy.optimize import nnls

    a, p = np.append(0.0, approach), np.append(0.0, load)
    part = (a[2:] - a[1:-1]) / (a[2:] - a[:-2])
    square = (p[1:-1] - part * p[:-2] - (1 - part) * p[2:]) ** 2 / (1 + part**2 + (1 - part) ** 2)
    terms = np.column_stack([np.ones(square.size), (p[1:-1] / p.max()) ** 2])
    variance = np.full(square.size, square.mean() or 1e-300)
    for _ in range(5):
        found = nnls(terms / variance[:, None], square / variance)[0]
        variance = np.maximum(terms @ found, 1e-6 * square.mean() + 1e-300)
    noise: Floats = np.sqrt(np.maximum(found[0] + found[1] * (load / p.max()) ** 2, 1e-6 * square.mean()))
    return noise


class Regression:
    """Convex curves nearest to noisy tables of the same approaches [m], with deviations of the loads > 0 [N] (row)."""

    def __init__(self, approach: Floats, noise: Floats) -> None:
        count = min(MOST_NODES, 2 * approach.size)
        even = np.quantile(approach, np.linspace(0, 1, count - count // 4))
        first = even[0] * 0.5 ** np.arange(count // 4, -1, -1)
        self.nodes = np.unique(np.concatenate([[0.0], first, even]))
        width = np.diff(self.nodes)
        x = np.clip(approach[:, None] - self.nodes[:-1], 0.0, None)
        # a stiffness that rises from 0 to 1 between two nodes, and one that is there from first touch on
        ramps = np.where(x < width, 0.5 * x**2 / width, x - 0.5 * width)
        self._basis = np.column_stack([approach, ramps])
        self._approach, self._noise = approach, noise
        self._columns, self._triangle = np.linalg.qr(self._basis / noise[:, None])
        self._size = np.linalg.norm(self._triangle, axis=0)

    def of(self, load: Floats) -> Knots:
        """Return the curve of loads (row) [N]."""
        from scipy.optimize import nnls

        wanted = self._columns.T @ (load / self._noise)
        steps = nnls(self._triangle / self._size, wanted, maxiter=100 * self._size.size)[0] / self._size
        return Knots(self.nodes, np.cumsum(steps))

    def error(self, load: Floats) -> float:
        """Return what the curve of loads (row) may be off by [N].

        That is the worst of `REPLICAS` tables with other noise, the error between rows, and what is beyond the noise.
        """
        curve = self.of(load)
        at_nodes, at_rows, rng = curve.loads(self.nodes), curve.loads(self._approach), np.random.default_rng(SEED)
        tables = at_rows + self._noise * rng.normal(size=(REPLICAS, load.size))
        drawn = [float(np.abs(self.of(table).loads(self.nodes) - at_nodes).max()) for table in tables]
        beyond = float(np.max(np.abs(at_rows - load) - DEVIATIONS * self._noise, initial=0.0))
        # the noise of few rows is not well known either
        spread = max(drawn) * (1.0 + 2.0 / math.sqrt(load.size))
        return spread + float(_triangles(self._approach, at_rows).max()) + beyond


def error_between(approach: Floats, load: Floats, *, straight: bool = False) -> float:
    """Return the largest error between the rows of a convex table [N].

    Up to the first row the load may be known to be straight.
    """
    # every third row is kept, in turn, and the differences at the others are taken; between all rows they are smaller.
    # No convex curve through the rows differs by more than the triangles between their secants let it
    height = _triangles(approach, load)
    height[0] *= not straight
    if approach.size < LEFT_OUT * LEFT_OUT:
        return float(height.max())
    # one row alone shows the first touch
    found = float(height[0]) * UNKNOWN
    for start in range(LEFT_OUT):
        kept = np.zeros(approach.size, dtype=bool)
        kept[start::LEFT_OUT] = kept[-1] = True
        left_out = through(approach[kept], load[kept]).loads(approach[~kept])
        found = max(found, float(np.abs(left_out - load[~kept]).max()))
    return min(found, float(height.max()))


def _triangles(approach: Floats, load: Floats) -> Floats:
    """Return how high the triangles are in which a convex curve through rows lies, one before each row [N]."""
    width, secant = np.diff(approach, prepend=0.0), np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0)
    before, after = np.append(0.0, secant[:-1]), np.append(secant[1:], np.inf)
    below = (secant - before) * width
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.where(after > before, below * (after - secant) / (after - before), 0.0)
    height[-1] = below[-1]
    return height


class Superposition(NamedTuple):
    """A state of a contact as sums over the rows of its normal curves.

    At every point the pressure is the sum of those of the rows with weights ``normal``, and the traction with
    weights ``tangential``. It sticks where it first touched at ``stick_approach`` [m] or before.
    """

    approach: float
    stick_approach: float
    normal: Floats
    tangential: Floats


@attrs.frozen(eq=False)
class NormalCurves:
    """Normal curves of patches of one contact, and the curve of their sum that the memory is replayed on.

    That curve rises and is convex: it has knots with a stiffness, or is Hertz' where the table of one patch is that to
    rounding. A patch, or a point of the surface, has its part of what all carry more from row to row: pressures
    grow with the approach everywhere, so that no traction is beyond the friction limit at any point (Jäger; Ciavarella:
    tangential loads are superpositions of normal ones, whatever the contact).
    """

    approach: Floats  #: of the table: approaches of the whole contact from first touch (row) [m]
    load: Floats = attrs.field(repr=False)  #: loads (row, patch) [N]
    #: Of the curve: approaches of its knots (element) [m]; 0 of a Hertzian contact.
    label: Floats = attrs.field(repr=False)
    stiffness: Floats | None = attrs.field(default=None, repr=False)  #: dP/da at the knots (element) [N/m]
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
        """Return the curves of a table; see `Ensemble.from_normal_curves`."""
        rows, loads, areas = _table(approach, load, area)
        deviation = None if noise is None else _noise(noise, rows.size)
        known: dict[str, Any] = {"area": areas}
        places = ("x", x), ("y", y)
        known |= {name: np.atleast_1d(checked(name, place)) for name, place in places if place is not None}
        total = loads.sum(axis=1)
        exact = deviation is None and rows.size <= MOST_ROWS and is_convex(rows, total)
        if exact and loads.shape[1] == 1 and (found := hertzian(rows, total)):
            return cls(rows, loads, np.zeros(1), weight=np.array([found]), **known)
        if exact:
            curve = through(rows, total)
        else:
            deviation = estimated_noise(rows, total) if deviation is None else deviation
            curve = Regression(rows, deviation).of(total)
            _check_convex(rows, total, curve, deviation)
        return cls(rows, loads, *curve, noise=deviation, **known)

    @classmethod
    def from_exact(cls, approach: Floats, load: Floats, area: Floats, stiffness: Floats, **known: Floats) -> Self:
        """Return the curves of solutions: stiffnesses are known, and the load is straight up to the first row."""
        return cls(approach, load, *through(approach, load.sum(axis=1), stiffness), area=area, **known)

    def __len__(self) -> int:
        """Return the number of patches."""
        return int(self.load.shape[1])

    @property
    def arrays(self) -> Mapping[str, Floats]:
        """What stands in a log, by its name."""
        values = attrs.asdict(self, recurse=False)
        return {name: array for name, array in values.items() if array is not None}

    @property
    def first_touch(self) -> Floats:
        """Approach up to which each patch carries nothing in the table [m] (patch)."""
        before: Floats = np.append(0.0, self.approach)[(self.load > 0).argmax(axis=0)]
        return before

    def total(self, approach: Floats) -> Floats:
        """Return the total load that is replayed at approaches [N]."""
        if self.weight is not None:
            return np.asarray(self.weight * np.clip(approach, 0.0, None) ** 1.5)
        return Knots(self.label, np.asarray(self.stiffness)).loads(approach)

    @property
    def guessed_before_rows(self) -> bool:
        """Whether what is carried below the first row follows from the rows above it."""
        # a straight piece has at most a knot in its middle
        return self.stiffness is not None and bool(self.label[1] < 0.1 * self.approach[0])

    @property
    def residual(self) -> float:
        """Largest difference between the total that is replayed and that of the table, over the largest load."""
        total = self.load.sum(axis=1)
        return float(np.abs(self.total(self.approach) - total).max() / total[-1])

    def error(self) -> float:
        """Return what the total that is replayed may be off by, over the largest load.

        Without noise it is an estimate of the error between the rows: every third one is kept, in turn, and the
        differences at the others are taken; of less than nine rows, what convex curves through them may differ by.
        With noise, 95 of 100 such tables give a curve that is nearer. A kink in a long table with noise may be off by
        more, where it lies between two of the at most `MOST_NODES` places at which the stiffness can bend.
        """
        total = self.load.sum(axis=1)
        if self.weight is not None:
            return self.residual
        if self.noise is not None:
            return Regression(self.approach, self.noise).error(total) / float(total[-1])
        straight = not self.guessed_before_rows
        return error_between(self.approach, total, straight=straight) / float(total[-1])

    def superposed(self, vertices: Array, units: Any, stick_approach: float) -> Superposition:
        """Return the weights of the rows of the table in a state, from the vertices of its memory.

        Every patch, and every point of the surface, has the same: its load is their sum with the table's own.
        """
        # what of the rise from row to row is there at the label of each vertex
        rise = np.append(0.0, self.total(self.approach))
        at = self.total(vertices["label"] * units.length)[:, None]
        part = np.clip((at - rise[:-1]) / np.diff(rise), 0.0, 1.0)
        normal = part[-1] if len(part) else np.zeros(self.approach.size)
        tangential = vertices["slope"][1:] @ np.diff(part, axis=0) if len(part) else normal
        approach = float(vertices["label"][-1] * units.length) if len(part) else 0.0
        weights = (each - np.append(each[1:], 0.0) for each in (normal, tangential))
        return Superposition(approach, stick_approach, *weights)

    def stick_approach(self, elements: Rows) -> Floats:
        """Return the approach at which the edge of the stick zone first touched (row) [m], 0 where all slips."""
        # on the first element, which touches at 0, areas are proportional to approaches
        radius, stick = elements.contact_radius[:, 0], elements.stick_radius[:, 0]
        part = np.divide(stick, radius, out=np.zeros_like(radius), where=radius > 0)
        inner: Floats = np.clip(elements.totals["approach"], 0.0, None) * part**2
        return inner

    def project(self, elements: Rows, friction: float, patches: Integers, rows: Rows) -> None:
        """Fill in rows of patches (column) from rows of all elements; radii are those of circles of the same area."""
        rows.totals[...] = elements.totals
        for name, values in elements.vectors.items():
            rows.vectors[name][...] = values
        approach, stick = elements.totals["approach"], self.stick_approach(elements)
        first = self.first_touch
        rows.totals["contact_count"] = np.searchsorted(np.sort(first), approach, side="left")
        table = np.append(0.0, self.approach)
        known = np.zeros_like(self.load) if self.area is None else self.area
        rows.totals["real_contact_area"] = np.interp(approach, table, np.append(0.0, known.sum(axis=1)))
        if not patches.size:
            return
        # part of the rise of the total from row to row that each patch carries, and the row of each element
        gain = np.diff(self.load[:, patches].T, prepend=0.0) / np.diff(self.load.sum(axis=1), prepend=0.0)
        row = np.searchsorted(self.approach, self.label, side="right").clip(max=self.approach.size - 1)
        if self.weight is not None:
            # one contact is one patch, and carries what it does over all rows
            row, gain = np.zeros_like(row), np.ones((patches.size, self.approach.size))
        struct = ffi.new("hs_patches *", {"count": patches.size, "rows": self.approach.size})
        areas = np.vstack([np.zeros(patches.size), known[:, patches]])
        arrays = {"gain": gain, "approach": table, "area": areas, "first_touch": first[patches]}
        # what the struct points to has to live as long as it does
        kept = fill(struct, arrays), row.astype(np.int64)
        struct.row = pointer(kept[1])
        given = pointer(np.ascontiguousarray(approach)), pointer(stick)
        knots = np.arange(self.label.size)
        # loads are sums over elements, so that in two directions each component has its own
        for part in [(..., 0), (..., 1)] if rows.vectors else [(...,)]:
            one, to = (
                Rows(each.totals, each.each | {"tangential_load": np.ascontiguousarray(each.tangential_load[part])})
                for each in (elements, rows)
            )
            written = one.as_struct(knots), to.as_struct(patches)
            check(lib.hs_record_patches(struct, written[0], approach.size, *given, friction, written[1]))
            rows.tangential_load[part] = to.tangential_load

    def check_reach(self, paths: Paths) -> None:
        """Check that paths, with targets in N and m, stay within the table; a CurveEndError has the path's position."""
        load, approach = float(self.load[-1].sum()), float(self.approach[-1])
        by_load = paths["normal_control"] == LOAD
        end = np.where(by_load, load, approach) * (1.0 + ROUNDING)
        beyond = (paths["normal_fraction"] > 0) & (paths["normal_target"] > end)
        if beyond.any():
            path = int(beyond.argmax())
            name, unit = ("a normal load", "N") if by_load[path] else ("an approach", "m")
            asked, end_text = distinct_texts(float(paths["normal_target"][path]), load if by_load[path] else approach)
            ends = f"{end_text} N and {approach:.6g} m" if by_load[path] else f"{load:.6g} N and {end_text} m"
            raise CurveEndError(f"{name} of {asked} {unit}", ends, path)


def _noise(noise: npt.ArrayLike, rows: int) -> Floats:
    given = checked("noise", noise, above=0)
    if given.size not in (1, rows) or given.ndim > 1:
        raise InputError(f"noise has shape {given.shape}; expected one number, or {rows}, one for each load")
    return np.broadcast_to(given, rows).astype(np.float64)


def _check_convex(rows: Floats, total: Floats, curve: Knots, noise: Floats) -> None:
    """Check that what the nearest convex curve leaves is noise."""
    off = np.abs(curve.loads(rows) - total)
    row = int(off.argmax())
    worst = float(off[row] / total.max())
    bends = worst > BENDS and np.median(off / noise) > MOST_DEVIATIONS
    if bends or np.sqrt((off**2).mean()) > NOT_CONVEX * total.max():
        raise InputError(
            f"the total load is not convex: at an approach of {rows[row]:.4g} m it is {total[row]:.4g} N, and the "
            f"nearest curve that stiffens all the way has {curve.loads(rows)[row]:.4g} N ({worst:.1%} of the largest "
            "load); expected a load that rises ever faster, as that of an elastic contact does"
        )


def _table(
    approach: npt.ArrayLike, load: npt.ArrayLike, area: npt.ArrayLike | None
) -> tuple[Floats, Floats, Floats | None]:
    """Check a table, and leave out a first row without a load."""
    rows = checked("approach", approach)
    if rows.ndim != 1:
        raise InputError(f"approach has shape {rows.shape}; expected a list with one for each row of the table")
    loads = _columns("load", load, rows.size)
    areas = None if area is None else _columns("area", area, rows.size)
    if areas is not None and areas.shape != loads.shape:
        raise InputError(f"area has {areas.shape[1]} columns and load {loads.shape[1]}; expected one for each patch")
    if rows.size and rows[0] == 0.0 and not loads[0].any():
        rows, loads, areas = rows[1:], loads[1:], None if areas is None else areas[1:]
    if rows.size < FEWEST:
        raise InputError(f"the normal curve has {rows.size} rows with a load; expected {FEWEST} or more")
    total = loads.sum(axis=1)
    _refuse("approach", rows, np.diff(rows, prepend=0.0) <= 0, "more than before; the first touch is at 0")
    _refuse("load", total, total <= 0, "more than 0 from first touch on; take the approach from first touch")
    for name, values in (("load", loads), ("area", areas)):
        if values is None:
            continue
        _refuse(name, values, values < 0, "0 or more")
        # the load of one patch is the total, and its noise is smoothed
        if name == "area" or values.shape[1] > 1:
            falls = np.maximum.accumulate(values, axis=0) - values > NOT_CONVEX * values.max(axis=0)
            _refuse(name, values, falls, "one that rises with the approach: contact areas and pressures do everywhere")
    if areas is not None:
        _refuse("area", areas, (areas == 0) & (loads > 0), "more than 0 where there is a load, or no areas")
    return rows, loads, areas


def _refuse(name: str, values: Floats, wrong: Booleans, expected: str) -> None:
    """Raise an InputError with the row, and the patch, of the first value that is wrong."""
    if wrong.any():
        place = tuple(np.argwhere(wrong)[0])
        where = f"row {place[0]} of {f'patch {place[1]}' if len(place) > 1 else 'the normal curve'}"
        raise InputError(f"{name} is {values[place]:.6g} in {where}; expected {expected}")


def _columns(name: str, values: npt.ArrayLike, count: int) -> Floats:
    array = checked(name, values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] == 0:
        raise InputError(
            f"{name} has shape {np.shape(values)} for {count} approaches; expected one row for each approach, and one "
            "column for each patch"
        )
    return array
