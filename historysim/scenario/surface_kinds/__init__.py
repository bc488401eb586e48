"""Kinds of ``[surface]`` in a scenario, and the keys common to all."""

import abc
import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import attrs

from historysim.basics.fields import Key, QuantityFields
from historysim.basics.registry import Registry
from historysim.errors import InputError, field_error
from historysim.scenario.schema import (
    AnyYieldingLaw,
    ImportedKind,
    from_table,
    kind_from_toml,
    table,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from historysim.asperities.yielding import YieldingLaw
    from historysim.interaction.solutions import NormalSolutions
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits

INTERACTIONS = ("none", "full")
AnyPasses = Annotated[Any, ImportedKind("historysim.scenario.surface_kinds.passes:Passes")]
DEEPEST = 20  # largest depth of nested sums
# Kinds of ``[surface]`` by name.
SURFACES: Registry[type["SurfaceKind"]] = Registry(
    "historysim.surfaces", f"{__name__}:SurfaceKind", "kind of surface", __name__
)


@attrs.frozen(eq=False)
class BuiltSurface:
    """Summits, height map and further results of a ``[surface]``."""

    summits: "Summits | None"  #: summits that become asperities; None with a normal curve
    surface: "Surface | None" = None  #: height map of the summits
    friction: Any = None  #: friction coefficients of the summits, if the surface defines them
    notices: tuple[str, ...] = ()  #: notices for the user
    #: whether the whole map is solved, with elastic interaction, instead of its summits
    interacts: bool = False
    solutions: "NormalSolutions | None" = None  #: normal solutions of the map, once computed
    #: A normal curve instead of summits: approaches from first touch [m], loads [N] and areas [m²]
    #: or None.
    curve: tuple[Any, Any, Any] | None = None
    #: A cylinder instead of summits: its radius, length and reference depth [m].
    cylinder: tuple[float, float, float] | None = None
    #: Radius of the ball under the map [m]: the nominal area is then the contact area of the ball.
    ball_radius: float | None = None
    yielding: "YieldingLaw | None" = None  #: yielding law of the summits
    passes: Any = None  #: running-in passes that are not yet applied
    find: "Callable[[Surface], Summits] | None" = (
        None  #: function that finds the summits of a map, as for these summits
    )


class SurfaceKind(QuantityFields, abc.ABC):
    """A kind of ``[surface]``: an attrs class with its keys as fields, registered under its name."""

    registry: ClassVar[Registry[Any]] = SURFACES
    kind: ClassVar[str]
    also_called: ClassVar[tuple[str, ...]] = ()  #: synonyms, for suggestions in messages

    @classmethod
    def from_toml(cls, value: object) -> "SurfaceKind":
        """Structure a surface of the kind that a table names; each surface of a sum has a height map."""
        if not inspect.isabstract(cls):
            return from_table(cls, value)
        entry = dict(table(value))
        if cls is not SurfaceKind:
            for key in {"rule", "prune", "ball_radius"} & entry.keys():
                raise field_error(
                    "belongs to the surface as a whole; expected it next to first and second", key
                )
            return kind_from_toml(entry, SURFACES, among=cls)
        level, depth = _summands(value), 0
        while level:
            level, depth = [summand for outer in level for summand in _summands(outer)], depth + 1
            if depth > DEEPEST:
                raise InputError(f"sums within sums, more than {DEEPEST} deep; expected fewer")
        common_keys = attrs.fields_dict(ChangedSurface).keys() - {"of"}
        keys = {key: entry.pop(key) for key in sorted(common_keys & entry.keys())}
        surface = kind_from_toml(entry, SURFACES)
        return from_table(ChangedSurface, {"of": surface, **keys}, "of") if keys else surface

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> "type[SurfaceKind]":
        """Return the class for the keys of a section, if a kind has several classes."""
        del entry
        return cls

    @abc.abstractmethod
    def build(self, folder: Path) -> BuiltSurface:
        """Build the summits and their map; paths are relative to the folder."""

    def without_preparation(self) -> "SurfaceKind | None":
        """Return the kind without preparation of its map and with all summits; None if nothing prepares it."""
        return None


def _summands(entry: object) -> list[object]:
    """Return the two surfaces of a sum; empty for another surface."""
    if not isinstance(entry, dict):
        return []
    return [entry[key] for key in ("first", "second") if key in entry]


@attrs.frozen(kw_only=True)
class ChangedSurface(SurfaceKind):
    """Keys common to all kinds of surface."""

    of: SurfaceKind
    #: Of a surface with summits: scales their heights, and the heights of their map, about the mean
    #: of the summits. The radii of the summits are unchanged.
    height_scale: float | None = attrs.field(
        default=None, validator=Key(lambda scale: scale > 0, "a number greater than 0")
    )
    #: Of a height map: ``"full"`` includes elastic interaction: the contact of the whole map is
    #: solved; ``"none"`` is the default.
    interaction: str | None = attrs.field(
        default=None,
        validator=Key(lambda word: word in INTERACTIONS, f"one of {', '.join(INTERACTIONS)}"),
    )
    yielding: AnyYieldingLaw | None = None  #: of a surface with summits: yielding law, as below
    passes: AnyPasses | None = None  #: of a height map: running-in, as below

    def without_preparation(self) -> SurfaceKind | None:
        """Return the underlying surface without preparation; see `SurfaceKind.without_preparation`."""
        return self.of.without_preparation()

    def build(self, folder: Path) -> BuiltSurface:
        """Build the surface and apply the keys in their order; passes additionally need materials and friction."""
        built = self.of.build(folder)
        if self.height_scale is not None:
            built = _stretch_heights(built, self.height_scale)
        if self.interaction == "full":
            if built.surface is None:
                problem = (
                    "full, of a surface without a height map; expected a random, measured or sum"
                )
                raise field_error(problem, "interaction")
            built = attrs.evolve(built, interacts=True)
        if self.yielding is not None:
            if built.interacts:
                raise field_error(
                    'does not apply to interaction = "full", which solves the contact of a whole map as elastic; '
                    "expected one of them",
                    "yielding",
                )
            if built.summits is None:
                raise field_error("given for a surface without summits; expected none", "yielding")
            built = attrs.evolve(built, yielding=self.yielding)
        if self.passes is not None:
            # summits found again after scaling would not have the unchanged radii
            find = getattr(self.of, "find_summits", None) if self.height_scale is None else None
            built = attrs.evolve(built, passes=self.passes, find=find)
        return built


def _stretch_heights(built: BuiltSurface, scale: float) -> BuiltSurface:
    summits, surface = built.summits, built.surface
    if summits is None:
        raise field_error(
            "given for a surface without summits, which has no heights; expected none",
            "height_scale",
        )
    mean = summits.height.mean()
    if surface is not None:
        heights = mean + scale * (surface.heights - mean)
        surface = type(surface)(heights, surface.pixel_size, surface.periodic)
    return attrs.evolve(
        built, summits=summits.at_heights(mean + scale * (summits.height - mean)), surface=surface
    )
