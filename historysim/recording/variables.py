"""The table of outputs: each variable's name, dimensions, units, text and CF attributes, declared once."""

import math
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from historysim.asperities.asperity import SlipState
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics.array_types import Array
from historysim.memory.rows import Rows


@attrs.frozen
class Variable:
    """One output variable."""

    name: str
    dimensions: tuple[str, ...]
    """Of ``step`` and ``asperity``; in the group of the surface ``x``, ``y`` and ``summit``."""
    units: str
    """UDUNITS text; "1" where dimensionless, empty for flags."""
    long_name: str
    dtype: str = "float64"
    """numpy's name of the type."""
    extra: dict[str, Any] = attrs.field(factory=dict)
    """Further attributes."""
    source: str = attrs.field(default=attrs.Factory(lambda self: self.name, takes_self=True), kw_only=True)
    """Field of ``hs_totals``, or of ``hs_rows`` where it is of each asperity, that it is; by default of its own
    name."""
    derived: Callable[[Rows, Ensemble, Instrument], Array] | None = attrs.field(default=None, kw_only=True, eq=False)
    """Makes it of rows, the ensemble and the instrument, where it is no such field."""

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes as they stand in the Dataset and the file."""
        units = {"units": self.units} if self.units else {}
        # what has rows comes out of the model, in the words of ACDD
        rows = "step" in self.dimensions and self.name != "time"
        content = {"coverage_content_type": "modelResult"} if rows else {}
        return {"long_name": self.long_name, **units, **content, **self.extra}

    def values(self, rows: Rows, ensemble: Ensemble, instrument: Instrument) -> Array:
        """Return what it is in recorded rows (row) or (row, column)."""
        if self.derived is not None:
            values = self.derived(rows, ensemble, instrument)
        else:
            values = rows.totals[self.source] if self.dimensions == _STEP else rows.each[self.source]
        return np.ascontiguousarray(values, dtype=self.dtype)


def _separation(rows: Rows, ensemble: Ensemble, _instrument: Instrument) -> Array:
    separation: Array = ensemble.highest_summit - rows.totals["approach"]
    return separation


def _drive(rows: Rows, _ensemble: Ensemble, instrument: Instrument) -> Array:
    return instrument.drive_displacement(rows.totals["displacement"], rows.totals["tangential_load"])


def _circle(radius: str) -> Callable[[Rows, Ensemble, Instrument], Array]:
    return lambda rows, _ensemble, _instrument: math.pi * rows.each[radius] ** 2


_STEP, _ASPERITY, _BOTH = ("step",), ("asperity",), ("step", "asperity")

_SLIP_FLAGS = {
    "flag_values": np.array([state.value for state in SlipState], dtype=np.int8),
    "flag_meanings": " ".join(state.name.lower() for state in SlipState),
}
_SATURATION_FLAGS = {
    "flag_values": np.array([0, 1], dtype=np.int8),
    "flag_meanings": "within_limit held_at_limit",
}

_DIRECTION = {
    "comment": "dT/dU where the displacement goes on as it does; where it turns round, what slides now sticks, too"
}

COORDINATES = (
    Variable("time", _STEP, "s", "elapsed time"),
    Variable("asperity", _ASPERITY, "1", "index of the asperity in the ensemble", "int64"),
    Variable("summit_height", _ASPERITY, "m", "height of the summit"),
    Variable("summit_radius", _ASPERITY, "m", "radius of the summit"),
    Variable("friction", _ASPERITY, "1", "friction coefficient at the start"),
    Variable("x", _ASPERITY, "m", "position of the summit along x"),
    Variable("y", _ASPERITY, "m", "position of the summit along y"),
)

TOTALS = (
    Variable("total_normal_load", _STEP, "N", "normal load of all asperities", source="normal_load"),
    Variable("total_tangential_load", _STEP, "N", "tangential load of all asperities", source="tangential_load"),
    Variable(
        "separation", _STEP, "m", "height of the rigid flat over the datum of the summit heights", derived=_separation
    ),
    Variable("tangential_displacement", _STEP, "m", "rigid tangential displacement", source="displacement"),
    Variable("contact_count", _STEP, "1", "number of asperities in contact", "int64"),
    Variable("real_contact_area", _STEP, "m2", "real contact area"),
    Variable("tangential_stiffness", _STEP, "N m-1", "tangential stiffness of the stick zones", extra=_DIRECTION),
    Variable(
        "total_dissipated_energy",
        _STEP,
        "J",
        "energy dissipated by friction since the start, all asperities",
        source="dissipated_energy",
    ),
    Variable("friction_limit", _STEP, "N", "largest tangential load that friction holds"),
    Variable(
        "saturated", _STEP, "", "whether a tangential load beyond the limit was held at it", "int8", _SATURATION_FLAGS
    ),
)

BEHIND_A_SPRING = (
    Variable(
        "drive_displacement", _STEP, "m", "tangential displacement of the drive of the instrument", derived=_drive
    ),
)
"""Totals that there are with an instrument in series."""

WHERE_FRICTION_CHANGES = (
    Variable(
        "largest_traction_ratio",
        _STEP,
        "1",
        "largest ratio of tangential traction to friction limit, |τ|/(μp), in the contact",
        extra={
            "comment": "1 where Coulomb's law holds at every point; more where a fall of friction has left springs "
            "strained beyond it, which is the error of the model there; of normal curves and full interaction it is "
            "that of a round contact with the same normal curve"
        },
        source="traction_ratio",
    ),
)
"""Totals that there are where an event changes friction."""

PER_ASPERITY = (
    Variable("normal_load", _BOTH, "N", "normal load of the asperity"),
    Variable("tangential_load", _BOTH, "N", "tangential load of the asperity"),
    Variable("contact_radius", _BOTH, "m", "contact radius"),
    Variable("stick_radius", _BOTH, "m", "stick radius"),
    Variable("slip_state", _BOTH, "", "slip state", "int8", _SLIP_FLAGS),
    Variable("dissipated_energy", _BOTH, "J", "energy dissipated by friction since the start"),
)

PRESENT_FRICTION = Variable(
    "present_friction", _STEP, "1", "friction coefficient of all asperities at the step", source="friction"
)
PRESENT_FRICTION_OF_EACH = Variable(
    "present_friction", _BOTH, "1", "friction coefficient of the asperity at the step", source="friction"
)
"""One of them is there where friction changes: the second where asperities have different coefficients at any time."""

WHERE_ASPERITIES_SLIDE = (
    Variable(
        "total_slid_distance",
        _STEP,
        "m",
        "displacement while all asperities in contact slid, since the start",
        source="slid_together",
    ),
)
WHERE_GEOMETRY_CHANGES = (
    Variable("erased_memories", _STEP, "1", "contacts whose memory a change of geometry has erased", "int64"),
    Variable("erased_energy", _STEP, "J", "tangential elastic energy that went with erased or worn contacts"),
)
WHERE_ASPERITIES_YIELD = (
    Variable(
        "yielded_load_share",
        _STEP,
        "1",
        "share of the normal load that stands on asperities that have yielded",
        source="yielded_share",
    ),
    Variable(
        "total_yielding_energy",
        _STEP,
        "J",
        "energy that yielding has taken since the start, all asperities",
        source="yielding_energy",
        extra={"comment": "beside what friction dissipates: work of the normal load that is not elastic"},
    ),
)
"""Totals that there are where slid distances are followed, where heights or radii change, and where summits yield."""

SLID_OF_EACH = (Variable("slid_distance", _BOTH, "m", "displacement while the asperity slid, since the start"),)
WORN_OF_EACH = (Variable("worn_volume", _BOTH, "m3", "volume that the asperity has lost since the start"),)
GEOMETRY_OF_EACH = (
    Variable("present_summit_height", _BOTH, "m", "height of the summit at the step", source="summit_height"),
    Variable("present_summit_radius", _BOTH, "m", "radius of the summit at the step", source="summit_radius"),
)
YIELDED_OF_EACH = (
    Variable("yielded_depth", _BOTH, "m", "depth by which the summit has been flattened since the start"),
    Variable(
        "yielding_load",
        _BOTH,
        "N",
        "largest load under which the asperity has yielded, up to which it is elastic now; 0 where it has not",
    ),
    Variable("yielding_energy", _BOTH, "J", "energy that yielding of the asperity has taken since the start"),
)
"""What there is of each asperity where it slides, wears, changes its geometry, or yields."""

PER_PATCH = (
    Variable("normal_load", _BOTH, "N", "normal load of the patch"),
    Variable("tangential_load", _BOTH, "N", "tangential load of the patch"),
    Variable("contact_area", _BOTH, "m2", "contact area of the patch", derived=_circle("contact_radius")),
    Variable("stick_area", _BOTH, "m2", "area of the patch that sticks", derived=_circle("stick_radius")),
    Variable("slip_state", _BOTH, "", "slip state", "int8", _SLIP_FLAGS),
)
"""What there is of the patches of a contact that is given by its normal curves, in place of `PER_ASPERITY`."""

SURFACE = (
    Variable("x", ("x",), "m", "position along x"),
    Variable("y", ("y",), "m", "position along y"),
    Variable("height", ("x", "y"), "m", "height of the surface"),
)
"""The height map, in the group ``surface`` of a result."""

_SUMMIT = ("summit",)

SUMMITS = (
    Variable("summit_height", _SUMMIT, "m", "height of the summit"),
    Variable("summit_radius", _SUMMIT, "m", "radius of the summit"),
    Variable("summit_x", _SUMMIT, "m", "position of the summit along x"),
    Variable("summit_y", _SUMMIT, "m", "position of the summit along y"),
)
"""All summits, in the same group; ``asperity`` in the history is their index."""

_POINT, _SOLUTION = ("point",), ("solution",)

SOLUTIONS = (
    Variable("point", _POINT, "1", "index of the point in the height map, along y first"),
    Variable("point_patch", _POINT, "1", "patch that the point belongs to"),
    Variable("first_touch", _POINT, "m", "approach at which the point first touches"),
    Variable("solved_approach", _SOLUTION, "m", "approach of a solution of the normal contact"),
    Variable("solved_pressure", ("solution", "point"), "1", "pressure over the contact modulus"),
)
"""The normal contact of a map whose asperities press on one another, in the same group."""
