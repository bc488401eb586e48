"""The kinds of ``[loading]`` in a scenario, and the events they make. A kind is a file here."""

import abc
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import attrs
from cattrs import Converter

from historysim.basics.limits import at_most, most
from historysim.basics.registry import Registry
from historysim.basics.wording import Notify, shown, silent
from historysim.errors import InputError, field_error
from historysim.loads.events import Event
from historysim.scenario.schema import kind_from_toml, table

NAMED_BY_A_KEY = ("waypoints", "blocks", "file")  # kinds with a key of their own name, which need no ``kind``

# The kinds of ``[loading]`` by their names.
LOADINGS: Registry[type["Loading"]] = Registry(
    "historysim.loadings", f"{__name__}:Loading", "kind of loading", __name__
)


@attrs.frozen(kw_only=True)
class Loading(abc.ABC):
    """What every kind of loading has."""

    registry: ClassVar[Registry[Any]] = LOADINGS
    kind: ClassVar[str]
    also_called: ClassVar[tuple[str, ...]] = ()

    substeps: int = 1  #: steps that are recorded from one event to the next; they do not change the result
    #: ``true`` holds a tangential load beyond the friction limit at the limit, and flags the step; else it is an error.
    saturate: bool = False

    def __attrs_post_init__(self) -> None:
        """Check the substeps."""
        if not 1 <= self.substeps <= most("STEPS"):
            raise field_error(f"{shown(self.substeps)}; expected an integer from 1 on, {at_most('STEPS')}", "substeps")

    @abc.abstractmethod
    def events(self, folder: Path, notify: Notify = silent) -> Sequence[Event]:
        """Return the events, in time order; paths are relative to the folder; ``notify`` takes notices for the user."""

    def place(self, folder: Path, index: int) -> str:  # noqa: ARG002 - for those who know more
        """Return the place of an event in the scenario; folder as for `events`."""
        return "loading"

    @property
    def names(self) -> dict[str, float]:
        """The times [s] of waypoints that have a name."""
        return {}


def loading_from_toml(converter: Converter, value: object, _: object) -> Loading:
    """Return the loading of ``[loading]``; not exactly one kind of loading is an InputError."""
    entry = table(value)
    given = [key for key in NAMED_BY_A_KEY if key in entry]
    if given == ["blocks", "file"]:
        # conditioning before the record
        given = ["file"]
    if "kind" not in entry and len(given) != 1:
        problem = " and ".join(given) or ", ".join(repr(key) for key in entry) or "nothing"
        others = ", ".join(name for name in LOADINGS if name not in NAMED_BY_A_KEY)
        more = f", or kind, one of {others}" if others else ""
        raise InputError(f"{problem} given; expected exactly one of waypoints, blocks and file{more}")
    return kind_from_toml(converter, {"kind": given[0], **entry} if given else entry, LOADINGS)
