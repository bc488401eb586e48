"""`Measurement`: a measured load sequence in SI on one clock, with what was measured beside it."""

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.basics.limits import LARGEST
from historysim.basics.units import duration_text, range_text
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.loads.event_sequence import KINDS, Events, Loads
from historysim.loads.events import LOAD_KINDS, Event
from historysim.measured.reduction import check_order, kept_points, loop_dead_band, reversals

TANGENTIAL = ("tangential_displacement", "tangential_load")
MANY_MORE = 5
"""Times more reversals than beyond the dead band, from which on noise is taken for their cause."""
NORMAL = ("normal_load", "normal_displacement")


@attrs.frozen(eq=False)
class Measurement:
    """A measured load sequence."""

    time: Floats
    """(sample) Times, which do not decrease [s]."""
    channels: Mapping[str, Floats]
    """(sample) What is replayed [N or m], by the names of the load channels."""
    response: Mapping[str, Floats] = attrs.field(factory=dict)
    """(sample) What was measured beside it, to compare with."""
    dead_band: Mapping[str, float] = attrs.field(factory=dict)
    """The smallest swing of a channel that is no noise [N or m]; a channel that is not named has no noise where it is
    replayed, and the dead band of its loops by default (see `reduction.loop_dead_band`)."""
    reduced: bool = False
    """Whether only the samples are replayed that the contact remembers (see `reduction.kept_points`)."""
    remarks: tuple[tuple[str, str], ...] = ()
    """Lines of (label, text): what was done to the samples on the way here."""
    removed: Mapping[str, Floats] = attrs.field(factory=dict)
    """(sample) What conditioning took off the channels that have one [N or m]; they were that plus what they are."""
    row: Integers | None = None
    """(sample) Where each sample stood in its file, for messages."""

    def __repr__(self) -> str:
        count, length = counted(self.time.size, "sample", "samples"), duration_text(float(np.ptp(self.time)))
        channels = [
            f"{name} {range_text(float(values.min()), float(values.max()), LOAD_KINDS[name].unit)}"
            for name, values in {**self.channels, **self.response}.items()
        ]
        return f"<Measurement: {', '.join([f'{count} over {length}', *channels])}>"

    def __getitem__(self, name: str) -> Floats:
        """Return a channel, replayed or measured beside; one that was not measured is an InputError."""
        if (found := self.get(name)) is None:
            raise InputError(
                f"the record has no {name}; expected a column for it, in loading.columns or loading.response"
            )
        return found

    def get(self, name: str) -> Floats | None:
        """Return a channel, or None where it was not measured."""
        return self.channels.get(name, self.response.get(name))

    def kept(self) -> Integers:
        """Return the indices of the samples that are replayed."""
        if not self.reduced:
            return np.arange(self.time.size)
        tangential = next((name for name in TANGENTIAL if name in self.channels), None)
        normal = next((name for name in NORMAL if name in self.channels), None)
        first = tangential or normal
        assert first is not None  # noqa: S101 - a measurement has a channel
        return kept_points(
            self.channels[first],
            None if normal is None or first == normal else self.channels[normal],
            dead_band=self.dead_band.get(first, 0.0),
            normal_dead_band=self.dead_band.get(normal or "", 0.0),
        )

    def false_reversals(self) -> str | None:
        """Return a note that noise makes reversals which are replayed; None where it does not."""
        name = next((name for name in TANGENTIAL if name in self.channels), None)
        if name is None or self.reduced:
            return None
        values = self.channels[name]
        dead_band = loop_dead_band(values, self.dead_band.get(name))
        true, all_of_them = (reversals(values, band).size for band in (dead_band, 0.0))
        if all_of_them < MANY_MORE * (true + 1):
            return None
        return (
            f"the {name.replace('_', ' ')} turns {all_of_them:,} times, by {dead_band:.3g} {LOAD_KINDS[name].unit} or "
            f"more {true:,} times; all of them are replayed, those of noise too, so that slip states flicker: reduce "
            "= true leaves out those within the dead band"
        )

    def events(self) -> Sequence[Event]:
        """Return the events: what each replayed channel has reached at each kept sample."""
        check_order(self.time, self.place)
        if "normal_load" in self.channels:
            self.check_pressed()
        kept = self.kept()
        kinds = [LOAD_KINDS[name] for name in self.channels]
        times = self.time[kept]
        numbers = [values[kept].astype(float) for values in self.channels.values()]
        events: list[Event] = []
        if all((np.abs(column) <= LARGEST).all() for column in (times, *numbers)):
            # what each event would check is checked of all of them
            codes = np.array([KINDS.index(kind) for kind in kinds], dtype=np.int8)
            columns = np.tile(codes, times.size), np.repeat(times, codes.size), np.column_stack(numbers).ravel()
            return Events(loads=Loads(*columns))
        lists = [column.tolist() for column in numbers]
        for index, time, *sample in zip(kept.tolist(), self.time[kept].tolist(), *lists, strict=True):
            try:
                events.extend([kind(time, value) for kind, value in zip(kinds, sample, strict=True)])
            except InputError as error:
                raise InputError(f"{self.place(index)}: {error}") from error
        return events

    def check_pressed(self) -> None:
        """Check that the normal load never pulls; the message names the first place in the file."""
        load = self["normal_load"]
        pulls = np.flatnonzero(load < 0)
        if pulls.size:
            raise InputError(
                f"{self.place(int(pulls[0]))}: a normal load of {load[pulls[0]]:.6g} N pulls on the contact; expected "
                "0 N or more: write scale = -1 where pressing counts negative, or negative_as_zero = true"
            )

    def place(self, sample: int) -> str:
        """Return where a sample stood in its file."""
        if self.row is None:
            return f"the sample at t = {self.time[sample]:.9g} s"
        return f"line {self.row[sample]}"
