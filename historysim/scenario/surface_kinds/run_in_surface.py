"""``surface.passes``: a height map that is run in before it is loaded."""

import attrs

from historysim.basics.fields import Force, Length
from historysim.basics.places import at, misfit
from historysim.contact.materials import MaterialPair
from historysim.scenario.law_sections import WearSection
from historysim.scenario.surface_kinds.surface_kind import BuiltSurface

MOST_PASSES = 1000


@attrs.frozen
class PassEntry:
    """Passes of one kind.

    Attributes
    ----------
    normal_load
        Of each pass.
    sliding_distance
        How far the flat slides in each pass.
    repeat
        How many passes, up to 1000.
    """

    normal_load: Force
    sliding_distance: Length = 0.0
    repeat: int = 1

    def __attrs_post_init__(self) -> None:
        """Check that there are some, and not too many."""
        if not 1 <= self.repeat <= MOST_PASSES:
            raise misfit(f"{self.repeat}; expected a number from 1 to {MOST_PASSES}", "repeat")


@attrs.frozen
class PassesSection:
    """Passes of a flat over a map, which run it in before it is loaded.

    Attributes
    ----------
    steps
        The passes, one after the other.
    wear
        A law of wear with its keys, as in ``[wear]``; without it summits yield only.
    volume
        What becomes of what is cut off: ``"lost"``, or ``"conserved"``, which raises all other points alike.

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

    steps: tuple[PassEntry, ...]
    wear: WearSection | None = None
    volume: str = "lost"

    def done(self, built: BuiltSurface, pair: MaterialPair, friction: object) -> BuiltSurface:
        """Return a surface after the passes.

        Raises InputError: see `run_in`, or more than one coefficient of friction.
        """
        from historysim.asperities.running_in import Pass, run_in

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
                wear=self.wear.of if self.wear else None,
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
