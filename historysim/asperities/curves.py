"""`NormalCurves`: a contact given by its load and area against approach, patch by patch.

The memory replays knots derived from the table, between which the stiffness dP/da is linear. The
load P is a parabola between two knots, and convex where the stiffness rises; a flat punch is one
knot, with its full stiffness from first touch. A convex table is met exactly at its rows. A noisy
table is replaced by the nearest convex curve (a monotone regression of the stiffness).
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.convex import (
    ROUNDING,
    Knots,
    Regression,
    error_between_rows,
    estimate_noise,
    hertz_constant,
    interpolate_convex,
    is_convex,
)
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
# largest number of rows that are met exactly; a longer table is treated as a measurement
MOST_ROWS = 600


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
