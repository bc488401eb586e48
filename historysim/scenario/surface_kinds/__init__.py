"""The kinds of ``[surface]`` in a scenario, and the keys that all of them may have. A kind is a file here."""

import abc
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import attrs

from historysim.basics.fields import Force, Key, Length
from historysim.basics.registry import Registry
from historysim.errors import at, field_error
from historysim.scenario.schema import AnyWearLaw, AnyYieldingLaw

if TYPE_CHECKING:
    from collections.abc import Callable

    from historysim.asperities.yielding import YieldingLaw
    from historysim.contact.materials import MaterialPair
    from historysim.interaction.solutions import NormalSolutions
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits

INTERACTIONS = ("none", "full")
MOST_PASSES = 1000
# The kinds of ``[surface]`` by their names.
SURFACES: Registry[type["SurfaceKind"]] = Registry(
    "historysim.surfaces", f"{__name__}:SurfaceKind", "kind of surface", __name__
)


@attrs.frozen(eq=False)
class BuiltSurface:
    """What a ``[surface]`` gives."""

    summits: "Summits | None"  #: the summits that become asperities; None where a normal curve is given
    surface: "Surface | None" = None  #: the height map that they were found on
    friction: Any = None  #: their friction coefficients, where the surface has its own
    notices: tuple[str, ...] = ()  #: what the user should know about how it was made
    interacts: bool = False  #: whether the parts of the map press on one another, in place of its summits
    solutions: "NormalSolutions | None" = None  #: those of the map, once they are there
    #: A normal curve in place of summits: approaches from first touch [m], loads [N] and areas [m²] or None.
    curve: tuple[Any, Any, Any] | None = None
    #: Radius of the ball that the map lies on [m]: the nominal area is then that of its contact.
    ball_radius: float | None = None
    yielding: "YieldingLaw | None" = None  #: how the summits yield
    passes: Any = None  #: by which the map is still to be run in
    find: "Callable[[Surface], Summits] | None" = None  #: finds the summits of a map as those here were found


class SurfaceKind(abc.ABC):
    """A kind of ``[surface]``: an attrs class with its keys as fields, registered under its name."""

    registry: ClassVar[Registry[Any]] = SURFACES
    kind: ClassVar[str]
    also_called: ClassVar[tuple[str, ...]] = ()  #: other words for it, which a message takes for a slip of the pen

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> "type[SurfaceKind]":
        """Return the class that the keys of a section belong to, where a kind has several."""
        del entry
        return cls

    @abc.abstractmethod
    def build(self, folder: Path) -> BuiltSurface:
        """Return the summits, with the map that they were found on; paths are relative to the folder."""

    def unprepared(self) -> "SurfaceKind | None":
        """Return the same with its map as it comes, and all its summits; None where nothing prepares it."""
        return None


@attrs.frozen
class PassEntry:
    """Passes of one kind."""

    normal_load: Force  #: of each pass
    sliding_distance: Length = 0.0  #: how far the flat slides in each pass
    #: How many passes, up to 1000.
    repeat: int = attrs.field(
        default=1, validator=Key(lambda number: 1 <= number <= MOST_PASSES, f"a number from 1 to {MOST_PASSES}")
    )


@attrs.frozen
class Passes:
    """Passes of a flat over a map, which run it in before it is loaded.

    Examples
    --------
    [surface]
    kind = "random"
    shape = [256, 256]
    pixel_size = "1 µm"
    rms_height = "300 nm"
    autocorrelation_length = "20 µm"
    seed = 1
    yielding = "kogut-etsion"
    passes = { steps = [{ normal_load = "90 mN", repeat = 2 }], volume = "conserved" }
    """

    steps: tuple[PassEntry, ...]  #: the passes, one after the other
    wear: AnyWearLaw | None = None  #: A law of wear with its keys, as in ``[wear]``; without it summits yield only
    #: What becomes of what is cut off: ``"lost"``, or ``"conserved"``, which raises all other points alike.
    volume: str = "lost"

    def done(self, built: BuiltSurface, pair: "MaterialPair", friction: object) -> BuiltSurface:
        """Return a surface after the passes; raises what `run_in` does."""
        from historysim.asperities.running_in import Pass, run_in

        if built.surface is None or built.summits is None or built.find is None:
            raise field_error("given for a surface without a height map; expected a random, measured or sum", "passes")
        if built.interacts:
            raise field_error('given with interaction = "full", which has no summits; expected one of them', "passes")
        if not isinstance(friction, int | float):
            raise field_error("given beside friction that is not one coefficient; expected one", "passes")
        if not self.steps:
            raise field_error("there are none; expected one or more", "passes", "steps")
        with at("passes"):
            steps = [Pass(one.normal_load, one.sliding_distance) for one in self.steps for _ in range(one.repeat)]
            laws: Any = {"friction": float(friction), "yielding": built.yielding, "wear": self.wear}
            surface, records = run_in(built.surface, pair, steps, volume=self.volume, find=built.find, **laws)
        first, last = records[0], records[-1]
        notice = (
            f"run in by {len(records)} passes: preliminary displacement {first.preliminary_displacement * 1e9:.4g} nm "
            f"in the first, {last.preliminary_displacement * 1e9:.4g} nm in the last; {first.contact_count} and "
            f"{last.contact_count} contacts; volume {self.volume}"
        )
        return attrs.evolve(built, surface=surface, summits=built.find(surface), notices=(*built.notices, notice))


@attrs.frozen(kw_only=True)
class ChangedSurface(SurfaceKind):
    """Keys that a surface of any kind may have."""

    of: SurfaceKind
    #: Of a surface with summits: stretches their heights, and those of their map, about the mean of the summits. The
    #: radii of the summits stay.
    height_scale: float | None = attrs.field(
        default=None, validator=Key(lambda scale: scale > 0, "a number greater than 0")
    )
    #: Of a height map: with ``"full"`` its asperities press on one another, and the contact of the map is solved whole;
    #: ``"none"`` is the default.
    interaction: str | None = attrs.field(
        default=None, validator=Key(lambda word: word in INTERACTIONS, f"one of {', '.join(INTERACTIONS)}")
    )
    yielding: AnyYieldingLaw | None = None  #: of a surface with summits: how they yield, as below
    passes: Passes | None = None  #: of a height map: how it is run in, as below

    def unprepared(self) -> SurfaceKind | None:
        """Return what is changed with its map as it comes; see `SurfaceKind.unprepared`."""
        return self.of.unprepared()

    def build(self, folder: Path) -> BuiltSurface:
        """Return the surface as the keys change it, in their order; passes need materials and friction, too."""
        built = self.of.build(folder)
        if self.height_scale is not None:
            built = _stretched(built, self.height_scale)
        if self.interaction == "full":
            if built.surface is None:
                problem = "full, of a surface without a height map; expected a random, measured or sum"
                raise field_error(problem, "interaction")
            built = attrs.evolve(built, interacts=True)
        if self.yielding is not None:
            if built.interacts:
                raise field_error(
                    'given with interaction = "full", and the normal contact of a whole map is solved as elastic; '
                    "expected one of them",
                    "yielding",
                )
            if built.summits is None:
                raise field_error("given for a normal curve, which is the contact itself; expected none", "yielding")
            built = attrs.evolve(built, yielding=self.yielding)
        if self.passes is not None:
            # summits that are found anew would not have the radii that stay where heights are stretched
            find = getattr(self.of, "found_summits", None) if self.height_scale is None else None
            built = attrs.evolve(built, passes=self.passes, find=find)
        return built


def _stretched(built: BuiltSurface, scale: float) -> BuiltSurface:
    summits, surface = built.summits, built.surface
    if summits is None:
        raise field_error("given for a normal curve, which has no heights; expected none", "height_scale")
    mean = summits.height.mean()
    if surface is not None:
        heights = mean + scale * (surface.heights - mean)
        surface = type(surface)(heights, surface.pixel_size, surface.periodic)
    return attrs.evolve(built, summits=summits.at_heights(mean + scale * (summits.height - mean)), surface=surface)
