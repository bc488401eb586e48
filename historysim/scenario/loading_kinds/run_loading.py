"""One run of a measured record of several runs, which are read together."""

from pathlib import Path
from typing import Self

import attrs

from historysim.errors import error_path
from historysim.measured.reduction import Measurement
from historysim.scenario.loading_kinds.measured_loading import MeasuredLoading
from historysim.scenario.loading_kinds.record_assembly import (
    RawRecord,
    condition_record,
    read_runs,
)


@attrs.frozen(kw_only=True)
class RunLoading(MeasuredLoading):
    """One of several runs, whose record has been read."""

    record: RawRecord = attrs.field(eq=False, repr=False)

    @property
    def name(self) -> str:
        """The names of the files of the run, for messages."""
        return self.record.section.name

    @classmethod
    def read_all(cls, folder: Path, loading: MeasuredLoading) -> dict[int, Self]:
        """Read all runs of a loading, by number; errors as for `MeasuredLoading.measurement`."""
        keys = attrs.asdict(loading, recurse=False)
        with error_path("loading"):
            runs = read_runs(folder, loading)
        return {
            number: cls(**{**keys, "run": number}, record=record) for number, record in runs.items()
        }

    def measurement(self, folder: Path) -> Measurement:  # noqa: ARG002 - the record has been read
        """Condition the record; InputError if that is not possible."""
        section = attrs.evolve(self, file=self.record.section.file)
        with error_path("loading"):
            return condition_record(attrs.evolve(self.record, section=section))
