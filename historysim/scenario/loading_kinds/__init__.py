"""Kinds of ``[loading]`` in a scenario, which build its events."""

import abc
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import attrs

from historysim.basics.fields import Key, QuantityFields
from historysim.basics.limits import at_most, most
from historysim.basics.registry import Registry
from historysim.basics.wording import Notify, format_value, silent
from historysim.errors import InputError, field_error
from historysim.loads.events import Event
from historysim.recording.recorder import PASTS, UNTOUCHED
from historysim.scenario.schema import from_table, kind_from_toml, table

EACH = "each"  # run = "each": all runs of a record, evaluated separately
# kinds identified by a key of the same name, without ``kind``
NAMED_BY_A_KEY = ("waypoints", "blocks", "file")

# Kinds of ``[loading]`` by name.
LOADINGS: Registry[type["Loading"]] = Registry(
    "historysim.loadings", f"{__name__}:Loading", "kind of loading", __name__
)


@attrs.frozen(kw_only=True)
class Loading(QuantityFields, abc.ABC):
    """Base class of the kinds of loading."""

    registry: ClassVar[Registry[Any]] = LOADINGS
    kind: ClassVar[str]
    also_called: ClassVar[tuple[str, ...]] = ()

    substeps: int = 1  #: recorded steps from one event to the next; they do not change the result
    #: ``true`` limits a tangential load to the friction limit and flags the step; otherwise it is
    #: an error.
    saturate: bool = False
    #: ``"unknown"`` also records the bounds that all earlier histories of the contact allow, by which
    #: a record that begins amid a test can be compared and fitted; otherwise it begins untouched.
    past: str = attrs.field(
        default=UNTOUCHED,
        validator=Key(lambda value: value in PASTS, '"untouched" or "unknown"'),
    )

    def __attrs_post_init__(self) -> None:
        """Check the substeps."""
        if not 1 <= self.substeps <= most("STEPS"):
            raise field_error(
                f"{format_value(self.substeps)}; expected an integer from 1 on, {at_most('STEPS')}",
                "substeps",
            )

    @classmethod
    def from_toml(cls, value: object) -> "Loading":
        """Structure ``[loading]``; InputError unless it is exactly one kind of loading."""
        if cls is not Loading:
            return from_table(cls, value)
        entry = table(value)
        kinds = [key for key in NAMED_BY_A_KEY if key in entry]
        if kinds == ["blocks", "file"]:
            # conditioning loops before the record
            kinds = ["file"]
        if "kind" not in entry and len(kinds) != 1:
            problem = " and ".join(kinds) or ", ".join(repr(key) for key in entry) or "nothing"
            registered = ", ".join(name for name in LOADINGS if name not in NAMED_BY_A_KEY)
            more = f", or kind, one of {registered}" if registered else ""
            raise InputError(
                f"{problem} given; expected exactly one of waypoints, blocks and file{more}"
            )
        return kind_from_toml({"kind": kinds[0], **entry} if kinds else entry, LOADINGS)

    @abc.abstractmethod
    def events(self, folder: Path, notify: Notify = silent) -> Sequence[Event]:
        """Build the events, in time order; paths are relative to the folder; ``notify`` receives notices."""

    def place(self, folder: Path, index: int) -> str:  # noqa: ARG002 - for subclasses
        """Return the location of an event in the scenario; folder as for `events`."""
        return "loading"

    @property
    def names(self) -> dict[str, float]:
        """Times [s] of named waypoints."""
        return {}
