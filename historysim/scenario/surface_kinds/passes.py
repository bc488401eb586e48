"""Passes of a flat over a height map, which run it in before the loading."""

from typing import TYPE_CHECKING, Any

import attrs

from historysim.asperities.running_in import Pass, run_in
from historysim.basics.fields import Force, Key, Length
from historysim.errors import error_path, field_error
from historysim.scenario.schema import AnyWearLaw
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.contact.materials import MaterialPair

MOST_PASSES = 1000


@attrs.frozen
class PassEntry:
    """Identical passes."""

    normal_load: Force  #: of each pass
    sliding_distance: Length = 0.0  #: sliding distance of the flat in each pass
    #: Number of passes, up to 1000.
    repeat: int = attrs.field(
        default=1,
        validator=Key(
            lambda number: 1 <= number <= MOST_PASSES, f"a number from 1 to {MOST_PASSES}"
        ),
    )


@attrs.frozen
class Passes:
    """Passes of a flat over a map, which run it in before the loading.

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

    steps: tuple[PassEntry, ...]  #: the passes, in sequence
    #: A law of wear with its keys, as in ``[wear]``; without it summits yield only
    wear: AnyWearLaw | None = None
    #: Material that is cut off: ``"lost"``, or ``"conserved"``, which raises all other points
    #: equally.
    volume: str = "lost"

    def apply(self, built: BuiltSurface, pair: "MaterialPair", friction: object) -> BuiltSurface:
        """Apply the passes to a surface; errors as for `run_in`."""
        if built.surface is None or built.summits is None or built.find is None:
            raise field_error(
                "given for a surface without a height map; expected a random, measured or sum",
                "passes",
            )
        if built.interacts:
            raise field_error(
                'given with interaction = "full", which has no summits; expected one of them',
                "passes",
            )
        if not isinstance(friction, int | float):
            raise field_error(
                "needs one friction coefficient; expected friction.coefficient as a number",
                "passes",
            )
        if not self.steps:
            raise field_error("is empty; expected one or more passes", "passes", "steps")
        with error_path("passes"):
            steps = [
                Pass(entry.normal_load, entry.sliding_distance)
                for entry in self.steps
                for _ in range(entry.repeat)
            ]
            laws: Any = {"friction": float(friction), "yielding": built.yielding, "wear": self.wear}
            surface, records = run_in(
                built.surface, pair, steps, volume=self.volume, find=built.find, **laws
            )
        first_record, last_record = records[0], records[-1]
        notice = (
            f"run in by {len(records)} passes: preliminary displacement "
            f"{first_record.preliminary_displacement * 1e9:.4g} nm in the first, "
            f"{last_record.preliminary_displacement * 1e9:.4g} nm in the last; "
            f"{first_record.contact_count} and {last_record.contact_count} contacts; volume {self.volume}"
        )
        return attrs.evolve(
            built, surface=surface, summits=built.find(surface), notices=(*built.notices, notice)
        )
