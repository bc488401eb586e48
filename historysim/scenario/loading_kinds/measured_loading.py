"""``loading.file``: a measured record, each sample or reversal of which is a waypoint."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError, error_path, path_text
from historysim.loads.event_sequence import Events
from historysim.loads.events import Event, NormalLoad, TangentialDisplacement
from historysim.measured.reduction import Measurement
from historysim.scenario.loading_kinds import LOADINGS
from historysim.scenario.loading_kinds.channels import RecordKeys
from historysim.scenario.loading_kinds.record_assembly import (
    FILE_REMARK,
    HUM_REMARK,
    assemble_measurement,
)

if TYPE_CHECKING:
    from historysim.scenario.loading_kinds.inline import LocatedTimeline


@LOADINGS.register
class MeasuredLoading(RecordKeys):
    """``loading.file``: a record; each sample, or with ``reduce`` each reversal, is a waypoint.

    Examples
    --------
    [loading]
    file = "data/unat_loops.csv"
    reduce = true

    [loading.columns]
    time = "time_s"
    normal_load = { column = "normal_load_mN", unit = "mN" }
    tangential_displacement = { column = "displacement_nm", unit = "nm", centred = true }

    [loading.response]
    tangential_load = { column = "tangential_load_mN", unit = "mN" }

    [loading.dead_band]
    tangential_displacement = "10 nm"
    """

    kind = "file"
    also_called = ("measured", "record", "csv")

    def measurement(self, folder: Path) -> Measurement:
        """Read the record; InputError if the file cannot be read or conditioned."""
        with error_path("loading"):
            return assemble_measurement(folder, self)

    def place(self, folder: Path, index: int) -> str:
        """Return the line of the file of an event."""
        line = self._timeline()
        if index < len(line.events):
            return path_text(line.locations[index])
        measurement = self.measurement(folder)
        index -= len(line.events) or len(_events_of_start(measurement))
        sample = int(measurement.replayed_indices()[max(index, 0) // len(measurement.vectors)])
        return f"loading.file: {self.name}: {measurement.place(sample)}"

    def events(self, folder: Path, notify: Notify = silent) -> Sequence[Event]:
        """Build the events of the file; ``notify`` receives remarks on its reading, and on noise."""
        measurement = self.measurement(folder)
        for label, notice in measurement.remarks:
            if label in {FILE_REMARK, HUM_REMARK}:
                notify(f"{self.name}: {notice}")
        if noise := measurement.false_reversals():
            notify(f"{self.name}: {noise}")
        with error_path("loading", "file"):
            try:
                events = measurement.events()
            except InputError as error:
                raise InputError(f"{self.name}: {error}") from error
        earlier_events = (
            self._events_before(measurement.time) if self.blocks else _events_of_start(measurement)
        )
        if not len(earlier_events):
            return events
        return Events.join(
            [earlier_events, events if isinstance(events, Events) else Events(events)]
        )

    def _timeline(self) -> "LocatedTimeline":
        """Build the events of the blocks before the record."""
        from historysim.scenario.loading_kinds.inline import build_timeline

        return build_timeline(self.blocks)

    def _events_before(self, time: Floats) -> Events:
        """Build the events of the blocks, which end one sample before the record with all channels held."""
        line = self._timeline()
        line.hold_channels("loading", "blocks")
        steps = np.diff(time)
        interval = float(np.median(steps)) if steps.size else 0.0
        offset = float(time[0]) - (interval or 1.0) - line.now
        return Events(
            [attrs.evolve(cast("Any", event), time=event.time + offset) for event in line.events]
        )


def _events_of_start(measurement: Measurement) -> Events:
    """Return events that press the contact before its move to the first sample of a displacement with known zero."""
    channels, time = measurement.channels, float(measurement.time[0])
    if (
        not measurement.starts_displaced
        or not {"normal_load", "tangential_displacement"} <= channels.keys()
    ):
        return Events([])
    if channels["tangential_displacement"][0] == 0:
        return Events([])
    return Events(
        [NormalLoad(time, float(channels["normal_load"][0])), TangentialDisplacement(time, 0.0)]
    )
