"""What is recorded: each variable's name, dimensions, units, text, and when it is there, declared once."""

import functools
import importlib
import math
import pkgutil
from collections.abc import Callable
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Self

import attrs
import numpy as np

from historysim.basics.arguments import DIRECTION, Array

if TYPE_CHECKING:
    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.instrument import Instrument
    from historysim.memory.rows import Rows


COMPONENTS = ("x", "y")  # labels of the dimension of vectors in two tangential directions
OF_DIRECTION = "component of a vector"


@attrs.frozen
class Changes:
    """What there is along a history beside loads and displacements, which decides what is recorded of it."""

    friction: bool = False  #: whether the friction of any asperity changes
    #: Whether asperities have different friction at any time; patches share one coefficient.
    friction_differs: bool = False
    sliding: bool = False  #: whether the sliding distance of asperities is followed
    wear: bool = False
    yielding: bool = False
    #: wear, yielding and geometry: whether asperities wear, whether they yield, and whether heights or radii change
    #: otherwise.
    geometry: bool = False
    spring: bool = False  #: whether there is an instrument in series
    patches: bool = False  #: whether the asperities are patches of normal curves
    areas: bool = True  #: whether contact areas are known, which normal curves may leave open
    planar: bool = False  #: whether there are two tangential directions

    @property
    def evolve(self) -> bool:
        """Whether asperities evolve beside their friction."""
        return self.sliding or self.wear or self.yielding or self.geometry

    @property
    def steady(self) -> bool:
        """Whether nothing changes but loads and displacements."""
        return not (self.friction or self.evolve)


def _always(_: Changes) -> bool:
    return True


@attrs.frozen
class Variable:
    """One output variable."""

    name: str
    #: Of ``step``, ``asperity`` and ``direction``; in the group of the surface ``x``, ``y`` and ``summit``.
    dimensions: tuple[str, ...]
    units: str  #: UDUNITS string; "1" where dimensionless, empty for flags
    long_name: str
    dtype: str = "float64"  #: numpy's name of the type
    extra: dict[str, Any] = attrs.field(factory=dict, hash=False)  #: further attributes
    #: In which histories it is recorded.
    when: Callable[[Changes], bool] = attrs.field(default=_always, kw_only=True, eq=False, repr=False)
    #: Field of ``hs_totals``, or of ``hs_rows`` where it is of each asperity; by default of the same name.
    source: str = attrs.field(default=attrs.Factory(lambda self: self.name, takes_self=True), kw_only=True)
    #: Computes it from rows, the ensemble and the instrument, where it is no such field.
    derived: "Callable[[Rows, Ensemble, Instrument], Array] | None" = attrs.field(default=None, kw_only=True, eq=False)
    #: Whether it has two components where there are two tangential directions.
    directed: bool = attrs.field(default=False, kw_only=True)

    def along(self, changes: Changes) -> Self:
        """Return it with the dimensions that it has in a history, of which the last may be ``direction``."""
        there = self.directed and changes.planar
        return attrs.evolve(self, dimensions=(*self.dimensions, DIRECTION)) if there else self

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes in the Dataset and in the file."""
        units = {"units": self.units} if self.units else {}
        # ACDD's word for what comes out of a model
        rows = "step" in self.dimensions and self.name != "time"
        content = {"coverage_content_type": "modelResult"} if rows else {}
        return {"long_name": self.long_name, **units, **content, **self.extra}

    def values(self, rows: "Rows", ensemble: "Ensemble", instrument: "Instrument") -> Array:
        """Return its values in recorded rows (row) or (row, column)."""
        if self.derived is not None:
            values = self.derived(rows, ensemble, instrument)
        else:
            values = rows.each[self.source] if "asperity" in self.dimensions else rows.total(self.source)
        return np.ascontiguousarray(values, dtype=self.dtype)


_STEP, _ASPERITY, _BOTH = ("step",), ("asperity",), ("step", "asperity")


def _flags(**meanings: int) -> dict[str, Any]:
    return {"flag_values": np.array([*meanings.values()], np.int8), "flag_meanings": " ".join(meanings)}


def _separation(rows: "Rows", ensemble: "Ensemble", _: "Instrument") -> Array:
    separation: Array = ensemble.highest_summit - rows.totals["approach"]
    return separation


def _drive(rows: "Rows", _: "Ensemble", instrument: "Instrument") -> Array:
    return instrument.drive_displacement(rows.total("displacement"), rows.total("tangential_load"))


def _circle(radius: str) -> "Callable[[Rows, Ensemble, Instrument], Array]":
    return lambda rows, *_: math.pi * rows.each[radius] ** 2


_PATCHES, _AREAS, _SPRING = attrgetter("patches"), attrgetter("areas"), attrgetter("spring")
_FRICTION, _SLIDES, _WEARS = attrgetter("friction"), attrgetter("sliding"), attrgetter("wear")
_RESHAPED, _YIELDS = attrgetter("geometry"), attrgetter("yielding")

COORDINATES = (
    Variable("time", _STEP, "s", "elapsed time"),
    Variable("asperity", _ASPERITY, "1", "index of the asperity in the ensemble", "int64"),
    Variable("summit_height", _ASPERITY, "m", "height of the summit"),
    Variable("summit_radius", _ASPERITY, "m", "radius of the summit"),
    Variable("friction", _ASPERITY, "1", "friction coefficient at the start"),
    Variable("slope", _ASPERITY, "1", "slope of the contact plane in the direction of motion"),
    Variable("x", _ASPERITY, "m", "position of the summit along x"),
    Variable("y", _ASPERITY, "m", "position of the summit along y"),
)

# What is recorded once, at the end.
SLIDE_TIME = Variable(
    "slide_time",
    _ASPERITY,
    "s",
    "elapsed time at which the asperity first slides as a whole",
    extra={"comment": "NaN where it never does", "coverage_content_type": "modelResult"},
)

_SLIP_FLAGS = _flags(separated=0, full_stick=1, partial_slip=2, gross_slip=3)
_HELD_FLAGS = _flags(within_limit=0, held_at_limit=1)
_DIRECTION = {
    "comment": "dT/dU where the displacement goes on as it does; where it turns round, what slides now sticks, too"
}
_RATIO = {
    "comment": "1 where Coulomb's law holds at every point; more where a fall of friction has left springs "
    "strained beyond it, which is the error of the model there; of normal curves and full interaction it is "
    "that of a round contact with the same normal curve"
}
_YIELDING_WORK = {"comment": "beside what friction dissipates: work of the normal load that is not elastic"}


def _one_friction(changes: Changes) -> bool:
    return changes.friction and not changes.friction_differs


def _own_friction(changes: Changes) -> bool:
    return changes.friction and changes.friction_differs


def _round(changes: Changes) -> bool:
    return not changes.patches


def _patch_areas(changes: Changes) -> bool:
    return changes.patches and changes.areas


def _reshapes(changes: Changes) -> bool:
    return changes.geometry or changes.yielding


# All that is recorded of a history; `register` adds to it.
VARIABLES = (
    Variable("total_normal_load", _STEP, "N", "normal load of all asperities", source="normal_load"),
    Variable(
        "total_tangential_load",
        _STEP,
        "N",
        "tangential load of all asperities",
        source="tangential_load",
        directed=True,
    ),
    Variable(
        "separation", _STEP, "m", "height of the rigid flat over the datum of the summit heights", derived=_separation
    ),
    Variable(
        "tangential_displacement", _STEP, "m", "rigid tangential displacement", source="displacement", directed=True
    ),
    Variable("contact_count", _STEP, "1", "number of asperities in contact", "int64"),
    Variable("real_contact_area", _STEP, "m2", "real contact area", when=_AREAS),
    Variable("tangential_stiffness", _STEP, "N m-1", "tangential stiffness of the stick zones", extra=_DIRECTION),
    Variable(
        "total_dissipated_energy",
        _STEP,
        "J",
        "energy dissipated by friction since the start, all asperities",
        source="dissipated_energy",
    ),
    Variable("friction_limit", _STEP, "N", "largest tangential load that friction holds"),
    Variable("saturated", _STEP, "", "whether a tangential load beyond the limit was held at it", "int8", _HELD_FLAGS),
    Variable(
        "drive_displacement",
        _STEP,
        "m",
        "tangential displacement of the drive of the instrument",
        when=_SPRING,
        derived=_drive,
        directed=True,
    ),
    Variable(
        "largest_traction_ratio",
        _STEP,
        "1",
        "largest ratio of tangential traction to friction limit, |τ|/(μp), in the contact",
        extra=_RATIO,
        when=lambda changes: changes.friction and not changes.planar,
        source="traction_ratio",
    ),
    Variable(
        "present_friction",
        _STEP,
        "1",
        "friction coefficient of all asperities at the step",
        when=_one_friction,
        source="friction",
    ),
    Variable(
        "total_slid_distance",
        _STEP,
        "m",
        "displacement while all asperities in contact slid, since the start",
        when=_SLIDES,
        source="slid_together",
    ),
    Variable(
        "erased_memories", _STEP, "1", "contacts whose memory a change of geometry has erased", "int64", when=_RESHAPED
    ),
    Variable(
        "erased_energy", _STEP, "J", "tangential elastic energy that went with erased or worn contacts", when=_RESHAPED
    ),
    Variable(
        "yielded_load_share",
        _STEP,
        "1",
        "share of the normal load that stands on asperities that have yielded",
        when=_YIELDS,
        source="yielded_share",
    ),
    Variable(
        "total_yielding_energy",
        _STEP,
        "J",
        "energy that yielding has taken since the start, all asperities",
        extra=_YIELDING_WORK,
        when=_YIELDS,
        source="yielding_energy",
    ),
    # round contacts; the share of a patch in the energy is not known exactly
    Variable("normal_load", _BOTH, "N", "normal load of the asperity", when=_round),
    Variable("tangential_load", _BOTH, "N", "tangential load of the asperity", when=_round, directed=True),
    Variable("contact_radius", _BOTH, "m", "contact radius", when=_round),
    Variable("stick_radius", _BOTH, "m", "stick radius", when=_round),
    Variable("normal_load", _BOTH, "N", "normal load of the patch", when=_PATCHES),
    Variable("tangential_load", _BOTH, "N", "tangential load of the patch", when=_PATCHES, directed=True),
    Variable(
        "contact_area", _BOTH, "m2", "contact area of the patch", when=_patch_areas, derived=_circle("contact_radius")
    ),
    Variable(
        "stick_area", _BOTH, "m2", "area of the patch that sticks", when=_patch_areas, derived=_circle("stick_radius")
    ),
    # of each of either
    Variable("slip_state", _BOTH, "", "slip state", "int8", _SLIP_FLAGS),
    Variable("dissipated_energy", _BOTH, "J", "energy dissipated by friction since the start", when=_round),
    Variable(
        "present_friction",
        _BOTH,
        "1",
        "friction coefficient of the asperity at the step",
        when=_own_friction,
        source="friction",
    ),
    Variable("slid_distance", _BOTH, "m", "displacement while the asperity slid, since the start", when=_SLIDES),
    Variable("worn_volume", _BOTH, "m3", "volume that the asperity has lost since the start", when=_WEARS),
    Variable(
        "present_summit_height", _BOTH, "m", "height of the summit at the step", when=_reshapes, source="summit_height"
    ),
    Variable(
        "present_summit_radius", _BOTH, "m", "radius of the summit at the step", when=_reshapes, source="summit_radius"
    ),
    Variable("yielded_depth", _BOTH, "m", "depth by which the summit has been flattened since the start", when=_YIELDS),
    Variable(
        "yielding_load",
        _BOTH,
        "N",
        "largest load under which the asperity has yielded, up to which it is elastic now; 0 where it has not",
        when=_YIELDS,
    ),
    Variable(
        "yielding_energy", _BOTH, "J", "energy that yielding of the asperity has taken since the start", when=_YIELDS
    ),
)

_added: list[Variable] = []
# Modules of this folder that add no variables; who asks what is recorded need not import them.
_OWN = frozenset({"netcdf", "provenance", "recorder", "surface_group", "variables"})


def register(variable: Variable) -> Variable:
    """Record another variable from now on, in all histories that its ``when`` takes; returns it.

    In this package it stands in a file of its own in this folder. The name of an earlier one replaces that.
    """
    _added[:] = [one for one in _added if (one.name, one.dimensions) != (variable.name, variable.dimensions)]
    _added.append(variable)
    recorded.cache_clear()
    return variable


def known() -> tuple[Variable, ...]:
    """Return all variables along ``step``, with those of modules that were added to this folder."""
    room = importlib.import_module("historysim.recording")
    for module in pkgutil.iter_modules(room.__path__):
        if module.name not in _OWN:
            importlib.import_module(f"historysim.recording.{module.name}")
    return (*VARIABLES, *_added)


@functools.lru_cache(maxsize=64)
def recorded(changes: Changes) -> tuple[tuple[Variable, ...], tuple[Variable, ...]]:
    """Return what is recorded of a history: totals, and what there is of each asperity."""
    there = [variable for variable in known() if variable.when(changes)]
    totals = tuple(variable.along(changes) for variable in there if variable.dimensions == _STEP)
    return totals, tuple(variable.along(changes) for variable in there if variable.dimensions == _BOTH)
