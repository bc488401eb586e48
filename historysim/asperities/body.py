"""`Body`: base class of the contacts that are replayed, and the features that a type of body does not support."""

import abc
import math
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal, TypedDict, Unpack

import attrs
import numpy as np

from historysim.asperities.instrument import Instrument
from historysim.asperities.law import FrictionGoal, Law
from historysim.asperities.stepper import Totals, make_paths
from historysim.basics.arguments import ArrayLike, Booleans, Floats
from historysim.basics.units import quantity_text, range_text, warn_large_radius
from historysim.basics.wording import brief, count_text, html_table
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError, UnlikelyValueWarning
from historysim.memory.paths import Paths, Rows, blank_rows

#: Features that some types of body do not support: keys of scenarios, events, and uses of a body.
Feature = Literal[
    "wear",
    "yielding",
    "attraction",
    "sliding",
    "friction law",
    "friction change",
    "friction change of some",
    "friction ramp",
    "geometry change",
    "asperities",
    "step in place",
    "fit",
]


class Drive(TypedDict, total=False):
    """Options of a path: tangential loads are held at the limit; instrument in series with the contact."""

    saturate: bool
    instrument: Instrument


class PathOptions(Drive, total=False):
    """Options of `Body.advance_along`."""

    rows: Rows | None  #: rows to fill, in SI (see `blank_rows`)
    asperities: ArrayLike  #: asperities of the columns of ``rows``, by index
    until: float  #: fraction of each path to follow
    friction: FrictionGoal | None  #: friction that varies linearly along the path
    threads: (
        int  #: threads that share the work on many asperities, with the same bits for any number
    )


def check_pair(pair: MaterialPair) -> MaterialPair:
    """Return the argument if it is a pair of materials, else raise InputError."""
    if not isinstance(pair, MaterialPair):
        raise InputError(f"pair is {pair!r}; expected a MaterialPair")
    return pair


LARGEST_FRICTION = 2.0  # a larger coefficient is implausible


def warn_if_unlikely(
    pair: MaterialPair, friction: Floats, radius: Floats | None = None, *, stacklevel: int
) -> None:
    """Warn of an implausible coefficient, and of radii [m] that are all implausible.

    Models without dimensions are pairs `MaterialPair.from_moduli`, of which nothing is implausible.
    """
    if pair.first is None:
        return
    if (largest := float(friction.max(initial=0.0))) > LARGEST_FRICTION:
        warnings.warn(
            f"friction is {largest:g}, which is implausible: a coefficient is a plain number such as 0.2, not in %",
            UnlikelyValueWarning,
            stacklevel=stacklevel + 1,
        )
    if radius is not None:
        warn_large_radius("summit_radius", float(radius.min()), stacklevel=stacklevel + 1)


class Body(abc.ABC):
    """A contact of asperities or patches with one approach and one tangential displacement, as a replay needs it.

    Its types are `Ensemble`, `Patches`, `LineContact` and `InclinedEnsemble`. A body does not
    change: states, which know the body that they belong to, are passed in and returned.
    """

    pair: MaterialPair
    friction: Floats  #: coefficients at the start (asperity)
    tolerance: float  #: relative change below which the refinement of a path has converged

    #: singular and plural name of its parts
    _nouns: ClassVar[tuple[str, str]] = "asperity", "asperities"
    summary_units: ClassVar[Mapping[str, str]] = {
        "summit_height": "m",
        "summit_radius": "m",
        "friction": "",
    }
    #: Message for each feature that this type does not support.
    unsupported: ClassVar[Mapping[Feature, str]] = {}
    #: True if asperities attract, so that normal loads may be negative.
    attracts: ClassVar[bool] = False
    #: True if asperities are independent paraboloids; False for patches, which share one
    #: coefficient of friction.
    has_radii: ClassVar[bool] = True
    #: Length of a line contact [m]; None of other bodies.
    line_length: float | None = None

    @abc.abstractmethod
    def __len__(self) -> int:
        """Return the number of asperities, or of patches."""

    @property
    @abc.abstractmethod
    def highest_summit(self) -> float:
        """Height of the highest summit [m]: the separation at first touch."""

    @property
    @abc.abstractmethod
    def first_touch(self) -> Floats:
        """Approach at which each asperity or patch first touches [m]."""

    @property
    @abc.abstractmethod
    def coordinates(self) -> dict[str, Floats]:
        """Properties of each asperity or patch: heights, friction at the start; if known radii, positions, slopes."""

    @property
    def arrays(self) -> dict[str, Floats]:
        """Arrays that define it, by the names under which a log stores them."""
        return self.coordinates

    @property
    def settings(self) -> dict[str, Any]:
        """Numbers that define it in addition to its arrays and laws, as a log stores them."""
        return {"tolerance": self.tolerance}

    @property
    def displacement_ratio(self) -> float:
        """Tangential over normal displacement under equal loads, θ."""
        return self.pair.displacement_ratio

    @property
    def direction_limit(self) -> str:
        """Feature that restricts it to one tangential direction, such as "wear"; empty if it may move in two."""
        return ""

    @property
    def evolves(self) -> bool:
        """True if friction depends on loads, summits wear or yield, or slid distances are tracked."""
        return False

    @property
    def slides(self) -> bool:
        """True if the distance that each asperity slides is tracked."""
        return False

    @property
    def has_areas(self) -> bool:
        """True if contact areas are known."""
        return True

    @property
    def laws(self) -> dict[str, Law]:
        """Laws of ``friction``, ``wear`` and ``yielding`` that it has, by these names."""
        return {}

    @property
    def packages(self) -> tuple[str, ...]:
        """Third-party packages that provide its laws, each with its version."""
        origins = [law.registry.provider(type(law)) for law in self.laws.values()]
        return tuple(dict.fromkeys(str(origin) for origin in origins if origin is not None))

    @abc.abstractmethod
    def initial_state(self) -> Any:
        """Return the unloaded virgin state."""

    @abc.abstractmethod
    def check_state(self, state: Any) -> None:
        """Raise an InputError if a state does not belong to this body."""

    @abc.abstractmethod
    def read_controls(self, state: Any) -> tuple[int, int]:
        """Return how the normal and tangential channels were controlled last; InputError in two directions."""

    @abc.abstractmethod
    def advance(
        self,
        state: Any,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | tuple[float | None, float | None] | None = None,
        tangential_displacement: float | tuple[float | None, float | None] | None = None,
        **drive: Unpack[Drive],
    ) -> Any:
        """Return the state after one joint straight path; ``state`` itself is not changed."""

    @abc.abstractmethod
    def advance_along(
        self,
        state: Any,
        paths: Paths,
        **options: Unpack[PathOptions],
    ) -> Any:
        """Advance a state along load paths and record rows; see `PathOptions`."""

    @abc.abstractmethod
    def slide_time(self, state: Any) -> Floats:
        """Return the time at which each asperity or patch first slid as a whole in a replay [s]; NaN if never."""

    @abc.abstractmethod
    def approach_at(self, normal_load: float) -> float:
        """Solve for the approach [m] at which the virgin contact first carries a normal load ≥ 0 [N], at U = 0."""

    def _may_touch(self, normal_load: float, approach: float, displacement: float) -> Booleans:
        """Select parts that may touch up to a normal load [N], an approach [m] and a displacement either way [m]."""
        del displacement
        touching: Booleans = self.first_touch < max(approach, self.approach_at(normal_load))
        return touching

    def advance_many(
        self,
        state: Any,
        *,
        normal_load: ArrayLike | None = None,
        normal_displacement: ArrayLike | None = None,
        tangential_load: ArrayLike | None = None,
        tangential_displacement: ArrayLike | None = None,
        **drive: Unpack[Drive],
    ) -> tuple[Any, Totals]:
        """Advance a state along straight paths in sequence; return it with the totals at the end of each path.

        The result is bit-identical to as many calls of `advance`. Arguments and errors are those of
        `advance`, with one value for each path, or one number for all paths; an error has the index
        of its path.
        """
        paths = make_paths(
            self.read_controls(state),
            normal=(normal_load, normal_displacement),
            tangential=(tangential_load, tangential_displacement),
            least=-math.inf if self.attracts else 0.0,
        )
        rows = blank_rows(paths.size, None)
        state = self.advance_along(state, paths, rows=rows, **drive)
        return state, Totals.from_row(rows.totals)

    def load_state(self, path: str | Path) -> Any:
        """Read a state of this body from a file of `save`; InputError for a state of another one."""
        try:
            return self.state_from_bytes(Path(path).read_bytes())
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def state_from_bytes(self, content: bytes) -> Any:
        """Read a state from its bytes; InputError for a state of another body."""
        start = self.initial_state()
        state = type(start).from_bytes(content, start)
        self.check_state(state)
        return state

    def __repr__(self) -> str:
        texts = [" ".join(line) for line in self._summary_lines]
        return (
            f"<{type(self).__name__}: {', '.join([count_text(len(self), *self._nouns), *texts])}>"
        )

    def _repr_html_(self) -> str:
        moduli = (
            ("contact modulus E*", self.pair.contact_modulus),
            ("shear modulus G*", self.pair.shear_modulus),
        )
        texts = [(name, quantity_text(value, "Pa")) for name, value in moduli]
        return html_table([(self._nouns[1], f"{len(self):,}"), *self._summary_lines, *texts])

    @property
    def _summary_lines(self) -> list[tuple[str, str]]:
        """Labelled lines on its summits, friction, wear and yielding."""
        texts = {
            name.replace("_", " "): _range_line(getattr(self, name), unit)
            for name, unit in self.summary_units.items()
        }
        return list((texts | {name: law.text for name, law in self.laws.items()}).items())

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without cached values, such as structures of the library."""
        body: Any = type(self)
        return {field.name: getattr(self, field.name) for field in attrs.fields(body)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        self.__dict__.update(state)


def require(body: Body | type[Body], *features: Feature) -> None:
    """Raise an InputError, with the fix, for the first feature that a body or type of body does not support."""
    for feature in features:
        if feature in body.unsupported:
            raise InputError(body.unsupported[feature])


def check_body(_: object, __: object, value: Any) -> None:
    """Raise an InputError if the value of a field is not a `Body`."""
    if not isinstance(value, Body):
        run = f"; a scenario is run by hs.run({value!r})" if isinstance(value, str | Path) else ""
        raise InputError(f"ensemble is {brief(value)}; expected an Ensemble{run}")


def _range_line(values: Floats | float, unit: str) -> str:
    low, high = np.min(values), np.max(values)
    if unit:
        return range_text(low, high, unit)
    return f"{low:.4g}" + (f" to {high:.4g}" if high > low else "")


def select_touching(
    body: Body, normal_load: float, approach: float, displacement: float
) -> Booleans:
    """Select parts that may touch up to a normal load [N], an approach [m] and a displacement either way [m]."""
    return body._may_touch(normal_load, approach, displacement)
