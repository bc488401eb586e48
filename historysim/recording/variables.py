"""Declarations of all recorded variables: names, dimensions, units, descriptions and conditions."""

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
    from historysim.asperities.body import Body
    from historysim.asperities.instrument import Instrument
    from historysim.memory.paths import Rows


COMPONENTS = ("x", "y")  # labels of the dimension of vectors in two tangential directions
OF_DIRECTION = "component of a vector"


@attrs.frozen
class Changes:
    """Optional physics of a history, which selects the recorded variables."""

    friction: bool = False  #: whether the friction of any asperity changes
    #: Whether asperities have different friction at any time; patches share one coefficient.
    friction_differs: bool = False
    sliding: bool = False  #: whether the sliding distance of asperities is followed
    wear: bool = False
    yielding: bool = False
    #: wear, yielding and geometry: whether asperities wear, whether they yield, and whether heights
    #: or radii change otherwise.
    geometry: bool = False
    spring: bool = False  #: whether there is an instrument in series
    parallel: bool = False  #: whether there is a spring in parallel
    patches: bool = False  #: whether the asperities are patches of normal curves
    areas: bool = True  #: whether contact areas are known, which normal curves may leave open
    attraction: bool = False  #: whether touching asperities attract
    lines: bool = False  #: whether the asperity is a line contact
    planar: bool = False  #: whether there are two tangential directions

    @property
    def evolve(self) -> bool:
        """True if asperities evolve otherwise than by their friction."""
        return self.sliding or self.wear or self.yielding or self.geometry

    @property
    def steady(self) -> bool:
        """True if only loads and displacements change."""
        return not (self.friction or self.evolve)


def _always(_: Changes) -> bool:
    return True


@attrs.frozen
class Variable:
    """One output variable."""

    name: str
    #: Of ``step``, ``asperity`` and ``direction``; in the group of the surface ``x``, ``y`` and
    #: ``summit``.
    dimensions: tuple[str, ...]
    units: str  #: UDUNITS string; "1" where dimensionless, empty for flags
    long_name: str
    dtype: str = "float64"  #: numpy's name of the type
    extra: dict[str, Any] = attrs.field(factory=dict, hash=False)  #: further attributes
    #: In which histories it is recorded.
    when: Callable[[Changes], bool] = attrs.field(
        default=_always, kw_only=True, eq=False, repr=False
    )
    #: Field of ``hs_totals``, or of ``hs_rows`` for a variable of each asperity; by default of the
    #: same name, without the prefix ``total_`` or ``present_``.
    source: str = attrs.field(kw_only=True)
    #: Computes it from rows, the ensemble and the instrument, if it is not such a field.
    derived: "Callable[[Rows, Body, Instrument], Array] | None" = attrs.field(
        default=None, kw_only=True, eq=False
    )
    #: Whether it has two components with two tangential directions.
    directed: bool = attrs.field(default=False, kw_only=True)

    @source.default
    def _same_name(self) -> str:
        return self.name.removeprefix("total_").removeprefix("present_")

    def along(self, changes: Changes) -> Self:
        """Return the variable with its dimensions in a history; the last may be ``direction``."""
        is_vector = self.directed and changes.planar
        return attrs.evolve(self, dimensions=(*self.dimensions, DIRECTION)) if is_vector else self

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes in the Dataset and in the file."""
        units = {"units": self.units} if self.units else {}
        # ACDD's term for output of a model
        rows = "step" in self.dimensions and self.name != "time"
        content = {"coverage_content_type": "modelResult"} if rows else {}
        return {"long_name": self.long_name, **units, **content, **self.extra}

    def values(self, rows: "Rows", ensemble: "Body", instrument: "Instrument") -> Array:
        """Return the values in recorded rows (row) or (row, column)."""
        if self.derived is not None:
            values = self.derived(rows, ensemble, instrument)
        else:
            values = (
                rows.each[self.source] if "asperity" in self.dimensions else rows.total(self.source)
            )
        return np.ascontiguousarray(values, dtype=self.dtype)


_STEP, _ASPERITY, _BOTH = ("step",), ("asperity",), ("step", "asperity")


def _flags(**meanings: int) -> dict[str, Any]:
    return {
        "flag_values": np.array([*meanings.values()], np.int8),
        "flag_meanings": " ".join(meanings),
    }


def _separation(rows: "Rows", ensemble: "Body", _: "Instrument") -> Array:
    separation: Array = ensemble.highest_summit - rows.totals["approach"]
    return separation


def _attraction(rows: "Rows", body: Any, _: "Instrument") -> Array:  # noqa: ANN401 - of an ensemble with attraction
    attraction: Array = body.pulls.compute_sum(rows.totals["approach"])
    return attraction


def _drive(rows: "Rows", _: "Body", instrument: "Instrument") -> Array:
    return instrument.drive_displacement(rows.total("displacement"), rows.total("tangential_load"))


def _drive_load(rows: "Rows", _: "Body", instrument: "Instrument") -> Array:
    return instrument.drive_load(rows.total("displacement"), rows.total("tangential_load"))


def _circle(radius: str) -> "Callable[[Rows, Body, Instrument], Array]":
    return lambda rows, *_: math.pi * rows.each[radius] ** 2


def _half_width(radius: str) -> "Callable[[Rows, Body, Instrument], Array]":
    return lambda rows, body, _: (
        math.pi * rows.each[radius] ** 2 / (2.0 * (body.line_length or 1.0))
    )


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
_AT_THE_END = {"comment": "NaN where it never does", "coverage_content_type": "modelResult"}
SLIDE_TIME = Variable(
    "slide_time",
    _ASPERITY,
    "s",
    "elapsed time at which the asperity first slides as a whole",
    extra=_AT_THE_END,
)

_SLIPS = _flags(separated=0, full_stick=1, partial_slip=2, gross_slip=3)
_HELD = _flags(within_limit=0, held_at_limit=1)
_DIRECTION = {
    "comment": "dT/dU for a displacement that continues in its direction; after a reversal sliding asperities stick"
}
_RATIO = {
    "comment": "1 where Coulomb's law holds at every point; more where a fall of friction has left springs "
    "strained beyond it, which is the error of the model there; of normal curves and full interaction it is "
    "that of a round contact with the same normal curve"
}
_YIELDING_WORK = {
    "comment": "inelastic work of the normal load, in addition to frictional dissipation"
}


def _total(name: str, units: str, long_name: str, **options: Any) -> Variable:  # noqa: ANN401 - of all its fields
    return Variable(name, _STEP, units, long_name, **options)


def _each(name: str, units: str, long_name: str, **options: Any) -> Variable:  # noqa: ANN401 - of all its fields
    return Variable(name, _BOTH, units, long_name, **options)


# In which histories something is recorded.
_SPRING, _SLIDES, _WEARS, _YIELDS = map(attrgetter, ("spring", "sliding", "wear", "yielding"))
_ATTRACTS = attrgetter("attraction")
_AREAS, _PATCHES, _LINES, _RESHAPED = map(attrgetter, ("areas", "patches", "lines", "geometry"))


def _round(changes: Changes) -> bool:
    return not changes.patches


def _patch_areas(changes: Changes) -> bool:
    return changes.patches and changes.areas


def _has_one_friction(changes: Changes) -> bool:
    return changes.friction and not changes.friction_differs


def _own_friction(changes: Changes) -> bool:
    return changes.friction and changes.friction_differs


def _is_strained(changes: Changes) -> bool:
    return changes.friction and not changes.planar


def _reshapes(changes: Changes) -> bool:
    return changes.geometry or changes.yielding


# All that is recorded of a history; `register` adds to it.
VARIABLES = (
    _total(
        "total_normal_load",
        "N",
        "normal load of all asperities; with attraction the load from outside alone",
    ),
    _total(
        "total_attraction",
        "N",
        "attraction of all touching asperities",
        when=_ATTRACTS,
        derived=_attraction,
    ),
    # in fields of yielding, which asperities that attract do not have
    _total(
        "jumps",
        "1",
        "jumps of the approach at a controlled normal load since the start",
        dtype="int64",
        when=_ATTRACTS,
        source="yielded_share",
    ),
    _total(
        "jump_energy",
        "J",
        "energy lost in jumps since the start",
        when=_ATTRACTS,
        source="yielding_energy",
    ),
    _total("total_tangential_load", "N", "tangential load of all asperities", directed=True),
    _total(
        "separation",
        "m",
        "height of the rigid flat over the datum of the summit heights",
        derived=_separation,
    ),
    _total(
        "tangential_displacement",
        "m",
        "rigid tangential displacement",
        source="displacement",
        directed=True,
    ),
    _total("contact_count", "1", "number of asperities in contact", dtype="int64"),
    _total("real_contact_area", "m2", "real contact area", when=_AREAS),
    _total(
        "tangential_stiffness", "N m-1", "tangential stiffness of the stick zones", extra=_DIRECTION
    ),
    _total(
        "total_dissipated_energy",
        "J",
        "energy dissipated by friction since the start, all asperities",
    ),
    _total("friction_limit", "N", "largest tangential load that friction holds"),
    _total(
        "saturated",
        "",
        "whether a tangential load beyond the limit was held at it",
        dtype="int8",
        extra=_HELD,
    ),
    _total(
        "drive_displacement",
        "m",
        "tangential displacement of the drive of the instrument",
        when=_SPRING,
        derived=_drive,
        directed=True,
    ),
    _total(
        "drive_load",
        "N",
        "tangential load at the drive: of the contact, and of the spring in parallel",
        when=attrgetter("parallel"),
        derived=_drive_load,
        directed=True,
    ),
    _total(
        "largest_traction_ratio",
        "1",
        "largest ratio of tangential traction to friction limit, |τ|/(μp), in the contact",
        when=_is_strained,
        source="traction_ratio",
        extra=_RATIO,
    ),
    _total(
        "present_friction",
        "1",
        "friction coefficient of all asperities at the step",
        when=_has_one_friction,
    ),
    _total(
        "total_slid_distance",
        "m",
        "displacement while all asperities in contact slid, since the start",
        when=_SLIDES,
        source="slid_together",
    ),
    _total(
        "erased_memories",
        "1",
        "contacts whose memory a change of geometry has erased",
        dtype="int64",
        when=_RESHAPED,
    ),
    _total(
        "erased_energy",
        "J",
        "tangential elastic energy that went with erased or worn contacts",
        when=_RESHAPED,
    ),
    _total(
        "yielded_load_share",
        "1",
        "fraction of the normal load on asperities that have yielded",
        when=_YIELDS,
        source="yielded_share",
    ),
    _total(
        "total_yielding_energy",
        "J",
        "energy that yielding has taken since the start, all asperities",
        when=_YIELDS,
        extra=_YIELDING_WORK,
    ),
    # round contacts; the share of a patch in the energy is not known exactly
    _each("normal_load", "N", "normal load of the asperity", when=_round),
    _each("tangential_load", "N", "tangential load of the asperity", when=_round, directed=True),
    _each("contact_radius", "m", "contact radius", when=_round),
    _each("stick_radius", "m", "stick radius", when=_round),
    _each("normal_load", "N", "normal load of the patch", when=_PATCHES),
    _each("tangential_load", "N", "tangential load of the patch", when=_PATCHES, directed=True),
    _each(
        "contact_area",
        "m2",
        "contact area of the patch",
        when=_patch_areas,
        derived=_circle("contact_radius"),
    ),
    _each(
        "stick_area",
        "m2",
        "area of the patch that sticks",
        when=_patch_areas,
        derived=_circle("stick_radius"),
    ),
    _each(
        "contact_half_width",
        "m",
        "half-width of the line contact",
        when=_LINES,
        derived=_half_width("contact_radius"),
    ),
    _each(
        "stick_half_width",
        "m",
        "half-width of the stick zone of the line contact",
        when=_LINES,
        derived=_half_width("stick_radius"),
    ),
    # of each of either
    _each("slip_state", "", "slip state", dtype="int8", extra=_SLIPS),
    _each("dissipated_energy", "J", "energy dissipated by friction since the start", when=_round),
    _each(
        "present_friction",
        "1",
        "friction coefficient of the asperity at the step",
        when=_own_friction,
    ),
    _each(
        "slid_distance", "m", "displacement while the asperity slid, since the start", when=_SLIDES
    ),
    _each("worn_volume", "m3", "volume that the asperity has lost since the start", when=_WEARS),
    _each("present_summit_height", "m", "height of the summit at the step", when=_reshapes),
    _each("present_summit_radius", "m", "radius of the summit at the step", when=_reshapes),
    _each(
        "yielded_depth",
        "m",
        "depth by which the summit has been flattened since the start",
        when=_YIELDS,
    ),
    _each(
        "yielding_load",
        "N",
        "largest load under which the asperity has yielded, up to which it is elastic now; 0 where it has not",
        when=_YIELDS,
    ),
    _each(
        "yielding_energy",
        "J",
        "energy that yielding of the asperity has taken since the start",
        when=_YIELDS,
    ),
)

# Variables that may have bounds where the past of the contact is unknown, and their suffixes.
BOUNDED = "total_tangential_load", "tangential_load", "tangential_displacement"
BOUNDS = {"lower": "least", "upper": "largest"}


def make_bounding_variables(variable: Variable) -> list[Variable]:
    """Return the variables of the least and the largest value of a variable over all pasts."""
    return [
        attrs.evolve(
            variable,
            name=f"{variable.name}_{bound}",
            long_name=f"{text} {variable.long_name} over all pasts",
            source=variable.source,
        )
        for bound, text in BOUNDS.items()
    ]


_added: list[Variable] = []
# Modules of this folder that add no variables, and need not be imported for the list of variables.
_OWN = frozenset(
    {
        "netcdf",
        "provenance",
        "recorder",
        "stored_units",
        "surface_group",
        "unknown_past",
        "variables",
    }
)


def register(variable: Variable) -> Variable:
    """Record another variable from now on, in all histories that meet its condition ``when``; return it.

    In this package it is declared in a separate file of this folder. It replaces an earlier
    variable of the same name.
    """
    _added[:] = [
        declaration
        for declaration in _added
        if (declaration.name, declaration.dimensions) != (variable.name, variable.dimensions)
    ]
    _added.append(variable)
    recorded_variables.cache_clear()
    return variable


def known_variables() -> tuple[Variable, ...]:
    """Return all variables along ``step``, including variables of modules added to this folder."""
    package = importlib.import_module("historysim.recording")
    for module in pkgutil.iter_modules(package.__path__):
        if module.name not in _OWN:
            importlib.import_module(f"historysim.recording.{module.name}")
    return (*VARIABLES, *_added)


@functools.lru_cache(maxsize=64)
def recorded_variables(changes: Changes) -> tuple[tuple[Variable, ...], tuple[Variable, ...]]:
    """Return the recorded variables of a history: totals, and variables of each asperity."""
    present = [variable for variable in known_variables() if variable.when(changes)]
    totals = tuple(variable.along(changes) for variable in present if variable.dimensions == _STEP)
    return totals, tuple(
        variable.along(changes) for variable in present if variable.dimensions == _BOTH
    )
