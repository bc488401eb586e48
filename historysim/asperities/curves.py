"""`NormalCurves`: a contact given by how its load and area rise with the approach, patch by patch."""

from collections.abc import Mapping
from typing import NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.curve_fitting import LEAST, density, fit_weights, labels, powers, shared
from historysim.basics.arguments import checked
from historysim.basics.library import ffi, lib, pointer
from historysim.errors import CurveEndError, InputError
from historysim.memory.binding import LOAD, check
from historysim.memory.paths import Paths
from historysim.memory.rows import Rows

Floats = npt.NDArray[np.float64]

FEWEST = 4
"""Rows that make a table."""
NOT_CONVEX = 0.05
"""Misfit of the total, over its largest load, from which it is not noise any more."""
ROUNDING = 1e-9
"""By how much, relatively, a path may go beyond the table before it is refused."""


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
    """Normal curves of patches of one contact, and the elements that carry the sum of them.

    The elements are Hertzian, some of them with a negative weight: their sum is the total normal curve. The memory
    is replayed on them, and a patch has a share of each (Jäger; Ciavarella: tangential loads are
    superpositions of normal ones, whatever the contact).

    Attributes
    ----------
    approach : array (row)
        Of the whole contact, from first touch [m].
    load : array (row, patch)
        Normal loads N_i [N].
    area : array (row, patch), optional
        Contact areas A_i [m²].
    label : array (element)
        Approach at which an element first touches [m].
    weight : array (element)
        W_k of the total P(a) = Σ_k W_k (a - h_k)^(3/2) [N/m^1.5].
    share : array (element, row)
        What turns the loads of a patch in the table into its share of each element [1/N].
    x, y : array (patch), optional
        Positions [m].
    """

    approach: Floats
    load: Floats = attrs.field(repr=False)
    label: Floats = attrs.field(repr=False)
    weight: Floats = attrs.field(repr=False)
    share: Floats = attrs.field(repr=False)
    area: Floats | None = attrs.field(default=None, repr=False)
    x: Floats | None = attrs.field(default=None, repr=False)
    y: Floats | None = attrs.field(default=None, repr=False)

    @classmethod
    def from_table(
        cls,
        approach: npt.ArrayLike,
        load: npt.ArrayLike,
        area: npt.ArrayLike | None = None,
        *,
        x: npt.ArrayLike | None = None,
        y: npt.ArrayLike | None = None,
    ) -> Self:
        """Return the curves of a table; see `Ensemble.from_normal_curves`."""
        rows, loads, areas = _table(approach, load, area)
        total = loads.sum(axis=1)
        label = labels(rows)
        weight = fit_weights(label, rows, total)
        fitted = powers(rows, label) @ weight
        if (worst := float(np.abs(fitted - total).max() / total[-1])) > NOT_CONVEX:
            row = int(np.abs(fitted - total).argmax())
            raise InputError(
                f"the total load is not convex: at an approach of {rows[row]:.4g} m it is {total[row]:.4g} N, and the "
                f"nearest curve that stiffens all the way has {fitted[row]:.4g} N ({worst:.0%} of the largest load); "
                "expected a load that rises ever faster, as that of an elastic contact does"
            )
        if loads.shape[1] == 1:
            label, weight = label[weight != 0.0], weight[weight != 0.0]
            share = np.zeros((label.size, rows.size))
            share[:, -1] = 1.0 / total[-1]
        else:
            weight = np.where(weight == 0.0, LEAST * density(label, rows, total), weight)
            share = shared(label, weight, rows, total)
        places = (None if place is None else np.atleast_1d(checked("x and y", place)) for place in (x, y))
        return cls(rows, loads, label, weight, share, areas, *places)

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

    @property
    def misfit(self) -> float:
        """Largest difference between the total that is replayed and that of the table, over the largest load."""
        total = self.load.sum(axis=1)
        return float(np.abs(powers(self.approach, self.label) @ self.weight - total).max() / total[-1])

    def error(self) -> float:
        """Return an estimate of the error between the rows of the table, over the largest load.

        Every second row is left out, the others are fitted again, and the largest difference at those left out is
        taken; between all rows it is smaller.
        """
        total, kept = self.load.sum(axis=1), np.zeros(self.approach.size, dtype=bool)
        kept[-1::-2] = True
        label = labels(self.approach[kept])
        weight = fit_weights(label, self.approach[kept], total[kept])
        left_out = powers(self.approach[~kept], label) @ weight
        return float(np.abs(left_out - total[~kept]).max() / total[-1])

    def superposition(self, elements: Floats) -> Floats:
        """Return the weights of the rows of the table in a load (…, row), from that of the elements (…, element).

        Every patch, and every point of the surface, has the same: its load is their sum with the table's own.
        """
        return np.asarray(elements @ self.share)

    def superposed(self, elements: Rows) -> Superposition:
        """Return the state of a single row of all elements."""
        stick = float(self.stick_approach(elements)[0])
        loads = elements.normal_load[0], elements.tangential_load[0]
        return Superposition(float(elements.totals["approach"][0]), stick, *map(self.superposition, loads))

    def stick_approach(self, elements: Rows) -> Floats:
        """Return the approach at which the edge of the stick zone first touched (row) [m], 0 where all slips."""
        # on the first element, which touches at 0, areas are proportional to approaches
        radius, stick = elements.contact_radius[:, 0], elements.stick_radius[:, 0]
        part = np.divide(stick, radius, out=np.zeros_like(radius), where=radius > 0)
        inner: Floats = np.clip(elements.totals["approach"], 0.0, None) * part**2
        return inner

    def project(self, elements: Rows, friction: float, patches: npt.NDArray[np.int64], rows: Rows) -> None:
        """Fill in rows of patches from rows of all elements.

        Parameters
        ----------
        elements : Rows
            Of all elements, in their order.
        friction : float
            Coefficient that bounds the tangential loads.
        patches : array (column)
            Indices to record, in the order of the columns of ``rows``.
        rows : Rows
            Radii are those of circles of the same area.
        """
        rows.totals[...] = elements.totals
        approach, stick = elements.totals["approach"], self.stick_approach(elements)
        first = self.first_touch
        rows.totals["contact_count"] = np.searchsorted(np.sort(first), approach, side="left")
        table = np.append(0.0, self.approach)
        known = np.zeros_like(self.load) if self.area is None else self.area
        rows.totals["real_contact_area"] = np.interp(approach, table, np.append(0.0, known.sum(axis=1)))
        if patches.size:
            arrays = {
                "share": self.share,
                "load": self.load[:, patches].T,
                "approach": table,
                "area": np.vstack([np.zeros(patches.size), known[:, patches]]),
                "first_touch": first[patches],
            }
            handed = ffi.new("hs_patches *")
            handed.count, handed.rows = patches.size, self.approach.size
            arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
            for name, array in arrays.items():
                setattr(handed, name, pointer(array))
            everything = np.arange(self.label.size)
            given = pointer(np.ascontiguousarray(approach)), pointer(stick)
            projected = elements.handed(everything), approach.size, *given, friction, rows.handed(patches)
            check(lib.hs_record_patches(handed, *projected))

    def check_reach(self, paths: Paths) -> None:
        """Check that paths stay within the table; their targets are in N and m.

        Raises
        ------
        CurveEndError
            One does not; the error has its position.
        """
        load, approach = float(self.load[-1].sum()), float(self.approach[-1])
        by_load = paths["normal_control"] == LOAD
        end = np.where(by_load, load, approach) * (1.0 + ROUNDING)
        beyond = (paths["normal_fraction"] > 0) & (paths["normal_target"] > end)
        if beyond.any():
            path = int(beyond.argmax())
            name, unit = ("a normal load", "N") if by_load[path] else ("an approach", "m")
            asked = f"{name} of {paths['normal_target'][path]:.6g} {unit}"
            raise CurveEndError(asked, f"{load:.6g} N and {approach:.6g} m", path)


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
    for name, wrong, told in (
        ("approach", np.diff(rows, prepend=0.0) <= 0, "above the one before it; the first touch is at 0"),
        ("load", loads.sum(axis=1) <= 0, "more than 0 from first touch on; take the approach from first touch"),
    ):
        if wrong.any():
            row = int(wrong.argmax())
            value = rows[row] if name == "approach" else loads[row].sum()
            raise InputError(f"{name} is {value:.6g} in row {row} of the normal curve; expected a value {told}")
    for name, values in (("load", loads), ("area", areas)):
        if values is None:
            continue
        if values.min() < 0:
            row, patch = (int(index) for index in np.unravel_index(values.argmin(), values.shape))
            raise InputError(f"{name} is {values.min():.6g} in row {row} of patch {patch}; expected 0 or more")
        falls = -np.diff(values, axis=0) / np.maximum(values.max(axis=0), 1e-300)
        if values.shape[1] > 1 and falls.max() > NOT_CONVEX:
            row, patch = (int(index) for index in np.unravel_index(falls.argmax(), falls.shape))
            raise InputError(
                f"{name} of patch {patch} falls from {values[row, patch]:.6g} to {values[row + 1, patch]:.6g} while "
                "the approach grows; expected it to rise: contact areas and pressures do everywhere"
            )
    return rows, loads, areas


def _columns(name: str, values: npt.ArrayLike, count: int) -> Floats:
    array = checked(name, values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] == 0:
        raise InputError(
            f"{name} has shape {np.shape(values)} for {count} approaches; expected one row for each approach, and one "
            "column for each patch"
        )
    return array
