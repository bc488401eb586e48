"""``loading.file``: a measured load sequence as the loading of a scenario."""

from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from historysim.basics.notices import Teller, silent
from historysim.basics.places import at
from historysim.errors import InputError
from historysim.loads.events import Event
from historysim.scenario.loading_kinds.channels import FILE_REMARK, HUM_REMARK, MeasuredFile
from historysim.scenario.loading_kinds.loading_kind import LOADINGS, Loading

if TYPE_CHECKING:
    from historysim.measured.measurement import Measurement


@LOADINGS.register
@attrs.frozen(kw_only=True)
class MeasuredLoading(MeasuredFile, Loading):
    """``loading.file``: a record, of which every sample, or with ``reduce`` every turning point, is a waypoint."""

    kind = "file"

    def __attrs_post_init__(self) -> None:
        """Check what the types leave open."""
        MeasuredFile.__attrs_post_init__(self)
        Loading.__attrs_post_init__(self)

    def measurement(self, folder: Path) -> "Measurement":
        """Return what was measured, read from the file and made ready.

        Raises InputError: a file that cannot be read, missing samples or gaps that are refused, or a correction that
        cannot be made.
        """
        from historysim.scenario.loading_kinds.assembly import assembled

        with at("loading"):
            return assembled(folder, self)

    def events(self, folder: Path, tell: Teller = silent) -> list[Event]:
        """Return the events of the file, and tell how it was read where that is not what it says."""
        measurement = self.measurement(folder)
        for label, notice in measurement.remarks:
            if label in {FILE_REMARK, HUM_REMARK}:
                tell(f"{self.name}: {notice}")
        if noise := measurement.false_reversals():
            tell(f"{self.name}: {noise}")
        with at("loading", "file"):
            try:
                return measurement.events()
            except InputError as error:
                raise InputError(f"{self.name}: {error}") from error
