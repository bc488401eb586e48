"""What every kind of ``[loading]`` has."""

import attrs

from historysim.basics.limits import at_most, most
from historysim.basics.places import misfit
from historysim.basics.wording import shown
from historysim.errors import InputError


def one_of_each(self: object) -> None:
    """Check that a section controls each channel in one way.

    Raises
    ------
    InputError
        A load and a displacement of one channel.
    """
    for channel in ("normal", "tangential"):
        if all(getattr(self, f"{channel}_{kind}") is not None for kind in ("load", "displacement")):
            raise InputError(
                f"{channel}_load and {channel}_displacement together; expected one of them: the other is its answer"
            )


@attrs.frozen(kw_only=True)
class Loading:
    """What every kind of loading has.

    Attributes
    ----------
    substeps
        Steps that are recorded from one event to the next; they do not change the result.
    saturate
        ``true`` holds a tangential load beyond the friction limit at the limit, and flags the step; else it is
        an error.
    """

    substeps: int = 1
    saturate: bool = False

    def __attrs_post_init__(self) -> None:
        """Check the substeps."""
        if not 1 <= self.substeps <= most("STEPS"):
            raise misfit(f"{shown(self.substeps)}; expected an integer from 1 on, {at_most('STEPS')}", "substeps")

    @property
    def names(self) -> dict[str, float]:
        """The times [s] of waypoints that have a name."""
        return {}
