"""Keys that any ``[surface]`` may have beside those of its kind: stretched, interacting, yielding, run in."""

from pathlib import Path
from typing import Any

import attrs

from historysim.asperities.running_in import Pass, run_in
from historysim.basics.fields import Force, Key, Length
from historysim.basics.wording import nearest, shown
from historysim.contact.materials import MaterialPair
from historysim.errors import at, misfit
from historysim.scenario.schema import AnyWearLaw, AnyYieldingLaw
from historysim.scenario.surface_kinds import BuiltSurface, SurfaceKind

INTERACTIONS = ("none", "full")
MOST_PASSES = 1000


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

    def done(self, built: BuiltSurface, pair: MaterialPair, friction: object) -> BuiltSurface:
        """Return a surface after the passes.

        Raises InputError: see `run_in`, or more than one coefficient of friction.
        """
        if built.surface is None or built.summits is None or built.find is None:
            raise misfit("given for a surface without a height map; expected a random, measured or sum", "passes")
        if built.interacts:
            raise misfit('given with interaction = "full", which has no summits; expected one of them', "passes")
        if not isinstance(friction, int | float):
            raise misfit("given beside friction that is not one coefficient; expected one", "passes")
        if not self.steps:
            raise misfit("there are none; expected one or more", "passes", "steps")
        with at("passes"):
            steps = [Pass(one.normal_load, one.sliding_distance) for one in self.steps for _ in range(one.repeat)]
            surface, records = run_in(
                built.surface,
                pair,
                steps,
                friction=float(friction),
                yielding=built.yielding,
                wear=self.wear,
                volume=self.volume,
                find=built.find,
            )
        first, last = records[0], records[-1]
        notice = (
            f"run in by {len(records)} passes: preliminary displacement {first.preliminary_displacement * 1e9:.4g} nm "
            f"in the first, {last.preliminary_displacement * 1e9:.4g} nm in the last; {first.contact_count} and "
            f"{last.contact_count} contacts; volume {self.volume}"
        )
        return attrs.evolve(built, surface=surface, summits=built.find(surface), notices=(*built.notices, notice))


def _check_interaction(_: object, attribute: "attrs.Attribute[str | None]", value: str | None) -> None:
    if value is not None and value not in INTERACTIONS:
        raise misfit(f"{shown(value)}; {nearest(value, INTERACTIONS)}", attribute.name)


@attrs.frozen(kw_only=True)
class ChangedSurface(SurfaceKind):
    """Keys that a surface of any kind may have."""

    of: Any
    #: Of a surface with summits: stretches their heights, and those of their map, about the mean of the summits. The
    #: radii of the summits stay.
    height_scale: float | None = attrs.field(
        default=None, validator=Key(lambda scale: scale > 0, "a number greater than 0")
    )
    #: Of a height map: with ``"full"`` its asperities press on one another, and the contact of the map is solved whole;
    #: ``"none"`` is the default.
    interaction: str | None = attrs.field(default=None, validator=_check_interaction)
    yielding: AnyYieldingLaw | None = None  #: of a surface with summits: how they yield, as below
    passes: Passes | None = None  #: of a height map: how it is run in, as below

    def unprepared(self) -> SurfaceKind | None:
        """Return what is changed with its map as it comes; see `SurfaceKind.unprepared`."""
        plain: SurfaceKind | None = self.of.unprepared()
        return plain

    def build(self, folder: Path) -> BuiltSurface:
        """Return the surface as the keys change it, in their order; passes need materials and friction, too."""
        built: BuiltSurface = self.of.build(folder)
        if self.height_scale is not None:
            built = _stretched(built, self.height_scale)
        if self.interaction == "full":
            if built.surface is None:
                problem = "full, of a surface without a height map; expected a random, measured or sum"
                raise misfit(problem, "interaction")
            built = attrs.evolve(built, interacts=True)
        if self.yielding is not None:
            if built.interacts:
                raise misfit(
                    'given with interaction = "full", and the normal contact of a whole map is solved as elastic; '
                    "expected one of them",
                    "yielding",
                )
            if built.summits is None:
                raise misfit("given for a normal curve, which is the contact itself; expected none", "yielding")
            built = attrs.evolve(built, yielding=self.yielding)
        if self.passes is not None:
            # summits that are found anew would not have the radii that stay where heights are stretched
            find = getattr(self.of, "found_summits", None) if self.height_scale is None else None
            built = attrs.evolve(built, passes=self.passes, find=find)
        return built


def _stretched(built: BuiltSurface, scale: float) -> BuiltSurface:
    summits, surface = built.summits, built.surface
    if summits is None:
        raise misfit("given for a normal curve, which has no heights; expected none", "height_scale")
    mean = summits.height.mean()
    if surface is not None:
        heights = mean + scale * (surface.heights - mean)
        surface = type(surface)(heights, surface.pixel_size, surface.periodic)
    return attrs.evolve(built, summits=summits.at_heights(mean + scale * (summits.height - mean)), surface=surface)
