"""`NormalCurves`: a contact given by how its load and area rise with the approach, patch by patch."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.curve_fitting import (
    MOST_ROWS,
    Knots,
    Regression,
    error_between,
    estimated_noise,
    hertzian,
    is_convex,
    through,
)
from historysim.basics.arguments import Array, Booleans, Floats, Integers, checked
from historysim.basics.library import ffi, lib, pointer
from historysim.errors import CurveEndError, InputError
from historysim.memory.binding import LOAD, check, fill
from historysim.memory.paths import Paths
from historysim.memory.rows import Rows

FEWEST = 4  # rows that make a table
# Root mean square misfit of the total, over its largest load, from which it is no noise that could be smoothed.
NOT_CONVEX = 0.05
# Largest misfit from which it is compared with the noise, and its median over the noise from which it is none: of
# Gaussian noise that is .67.
BENDS, MOST_DEVIATIONS = 0.005, 1.5
ROUNDING = 1e-9  # by how much, relatively, a path may go beyond the table before it is refused


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

        Of a table without noise it is an estimate of the error between its rows: every third one is kept, in turn,
        and the differences at the others are taken; of less than nine rows, all that convex curves through them may
        differ by, which is more than it mostly is. Of one with noise, 95 of 100 such tables give a curve that is
        nearer. A kink in a long table with noise may be off by more, where it lies between two of the at most
        `MOST_NODES` places at which the stiffness can bend, and the noise hides it at the rows.
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
        if not rows.vectors:
            written = elements.as_struct(knots), rows.as_struct(patches)
            check(lib.hs_record_patches(struct, written[0], approach.size, *given, friction, written[1]))
            return
        # loads are sums over elements, so that each component has its own
        for axis in range(2):
            one, to = (
                Rows(
                    each.totals, each.each | {"tangential_load": np.ascontiguousarray(each.tangential_load[..., axis])}
                )
                for each in (elements, rows)
            )
            written = one.as_struct(knots), to.as_struct(patches)
            check(lib.hs_record_patches(struct, written[0], approach.size, *given, friction, written[1]))
            rows.tangential_load[..., axis] = to.tangential_load

    def check_reach(self, paths: Paths) -> None:
        """Check that paths, with targets in N and m, stay within the table; a CurveEndError has the path's position."""
        load, approach = float(self.load[-1].sum()), float(self.approach[-1])
        by_load = paths["normal_control"] == LOAD
        end = np.where(by_load, load, approach) * (1.0 + ROUNDING)
        beyond = (paths["normal_fraction"] > 0) & (paths["normal_target"] > end)
        if beyond.any():
            path = int(beyond.argmax())
            name, unit = ("a normal load", "N") if by_load[path] else ("an approach", "m")
            asked = f"{name} of {paths['normal_target'][path]:.6g} {unit}"
            raise CurveEndError(asked, f"{load:.6g} N and {approach:.6g} m", path)


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
    for name, wrong, expected in (
        ("approach", np.diff(rows, prepend=0.0) <= 0, "above the one before it; the first touch is at 0"),
        ("load", loads.sum(axis=1) <= 0, "more than 0 from first touch on; take the approach from first touch"),
    ):
        if wrong.any():
            row = int(wrong.argmax())
            value = rows[row] if name == "approach" else loads[row].sum()
            raise InputError(f"{name} is {value:.6g} in row {row} of the normal curve; expected a value {expected}")
    for name, values in (("load", loads), ("area", areas)):
        if values is None:
            continue
        if values.min() < 0:
            row, patch = _first(values == values.min())
            raise InputError(f"{name} is {values.min():.6g} in row {row} of patch {patch}; expected 0 or more")
        reached = np.maximum.accumulate(values, axis=0)
        falls = (reached - values)[1:] / np.maximum(values.max(axis=0), 1e-300)
        # the load of one patch is the total, and its noise is smoothed
        if (name == "area" or values.shape[1] > 1) and falls.max() > NOT_CONVEX:
            row, patch = _first(falls == falls.max())
            raise InputError(
                f"{name} of patch {patch} falls from {reached[row, patch]:.6g} to {values[row + 1, patch]:.6g} while "
                "the approach grows; expected it to rise: contact areas and pressures do everywhere"
            )
    if areas is not None and (without := (areas == 0) & (loads > 0)).any():
        row, patch = _first(without)
        raise InputError(
            f"area is 0 in row {row} of patch {patch}, which carries {loads[row, patch]:.6g} N; expected more than 0 "
            "where there is a load, or no areas"
        )
    return rows, loads, areas


def _first(where: Booleans) -> tuple[int, int]:
    """Return row and patch of the first place where something is so."""
    row, patch = np.argwhere(where)[0]
    return int(row), int(patch)


def _columns(name: str, values: npt.ArrayLike, count: int) -> Floats:
    array = checked(name, values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] == 0:
        raise InputError(
            f"{name} has shape {np.shape(values)} for {count} approaches; expected one row for each approach, and one "
            "column for each patch"
        )
    return array
