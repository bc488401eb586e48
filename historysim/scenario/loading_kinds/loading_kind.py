"""What every kind of ``[loading]`` has."""

import abc
from pathlib import Path
from typing import Any, ClassVar

import attrs

from historysim.basics.limits import at_most, most
from historysim.basics.notices import Teller, silent
from historysim.basics.places import misfit
from historysim.basics.registry import Registry
from historysim.basics.wording import shown
from historysim.errors import InputError
from historysim.loads.events import Event


def one_of_each(self: object) -> None:
    """Check that a section controls each channel in one way.

    Raises InputError: a load and a displacement of one channel.
    """
    for channel in ("normal", "tangential"):
        if all(getattr(self, f"{channel}_{kind}") is not None for kind in ("load", "displacement")):
            raise InputError(
                f"{channel}_load and {channel}_displacement together; expected one of them: the other follows from it"
            )


LOADINGS: Registry[type["Loading"]] = Registry(
    "historysim.loadings",
    "historysim.scenario.loading_kinds.loading_kind:Loading",
    "kind of loading",
    "historysim.scenario.loading_kinds",
)
"""The kinds of ``[loading]`` by their names."""


@attrs.frozen(kw_only=True)
class Loading(abc.ABC):
    """What every kind of loading has.

    Attributes
    ----------
    substeps
        Steps that are recorded from one event to the next; they do not change the result.
    saturate
        ``true`` holds a tangential load beyond the friction limit at the limit, and flags the step; else it is
        an error.
    """

    registry: ClassVar[Registry[Any]] = LOADINGS
    kind: ClassVar[str]

    substeps: int = 1
    saturate: bool = False

    def __attrs_post_init__(self) -> None:
        """Check the substeps."""
        if not 1 <= self.substeps <= most("STEPS"):
            raise misfit(f"{shown(self.substeps)}; expected an integer from 1 on, {at_most('STEPS')}", "substeps")

    @abc.abstractmethod
    def events(self, folder: Path, tell: Teller = silent) -> list[Event]:
        """Return the events, in time order; paths are relative to the folder, and what the user should know is told."""

    @property
    def names(self) -> dict[str, float]:
        """The times [s] of waypoints that have a name."""
        return {}
