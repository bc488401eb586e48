"""Write a history to a netCDF file, which appears under its name only when all rows stand in it."""

import contextlib
import errno
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.files import replacing
from historysim.errors import InputError
from historysim.memory.rows import Rows
from historysim.recording.changes import STEADY, Changes
from historysim.recording.recorder import Recorder, coordinates_of
from historysim.recording.variables import COORDINATES, Variable

if TYPE_CHECKING:
    import netCDF4

Array = npt.NDArray[Any]

CHUNK_CELLS = 1 << 17
COMPRESSIONS: dict[str, dict[str, Any]] = {
    "none": {},
    "zlib": {"compression": "zlib", "complevel": 1, "shuffle": True},
    "zstd": {"compression": "zstd", "complevel": 3, "shuffle": True},
}


@final
@attrs.define
class FileRecorder(Recorder):
    """Rows of one history, streamed to a netCDF file; use it through `recording`.

    Every variable has checksums (Fletcher-32), which the netCDF library checks on reading.
    """

    attributes: Mapping[str, Any]
    file: "netCDF4.Dataset"
    compression: str = "none"
    _rows: Rows = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self.file.setncatts(dict(self.attributes))
        self.file.createDimension("step", self.steps)
        if self.asperities is not None:
            self.file.createDimension("asperity", self.columns)
        fixed = coordinates_of(self.ensemble, self.asperities)
        declared = [variable for variable, _ in fixed]
        declared += [COORDINATES[0], *self.totals, *self.per_asperity]
        auxiliary = [variable.name for variable in declared if variable in COORDINATES and variable.name != "asperity"]
        for variable in declared:
            made = self.file.createVariable(
                variable.name, variable.dtype, variable.dimensions, fill_value=False, **self._storage(variable)
            )
            made.setncatts(variable.attributes)
            if variable not in COORDINATES:
                beside = [name for name in auxiliary if self.file[name].dimensions[0] in variable.dimensions]
                made.coordinates = " ".join(beside)
        for variable, values in fixed:
            self.file[variable.name][:] = values

    def _storage(self, variable: Variable) -> dict[str, Any]:
        """How a variable is cut into chunks, which checksums and compression need."""
        sizes = [len(self.file.dimensions[name]) for name in variable.dimensions]
        if 0 in sizes:
            return {}
        inner = min(sizes[-1], CHUNK_CELLS)
        outer = [max(1, min(sizes[0], CHUNK_CELLS // inner))] if len(sizes) > 1 else []
        return {"chunksizes": [*outer, inner], "fletcher32": True, **COMPRESSIONS[self.compression]}

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next."""
        self._rows = self.new_rows(count)
        return self._rows

    def record(self, times: Array) -> None:
        """Write the rows that were given last, now filled, as those at these times [s]."""
        where = slice(self._filled, self._filled + times.size)
        self.file["time"][where] = times
        for variable, values in self.projected(self._rows):
            self.file[variable.name][where] = values
        self._filled += times.size


@contextlib.contextmanager
def recording(
    path: Path,
    ensemble: Ensemble,
    asperities: npt.NDArray[np.int64] | None,
    steps: int,
    attributes: Mapping[str, Any],
    instrument: Instrument = RIGID,
    *,
    changes: Changes = STEADY,
    compression: str = "none",
    unfinished: Path | None = None,
) -> Iterator[FileRecorder]:
    """Record into a netCDF file, which appears under its name only when all rows stand in it.

    Parameters
    ----------
    path : Path
        An existing file is replaced, at the end.
    ensemble, asperities, steps, attributes, instrument, changes
        See `Recorder`.
    compression : {"none", "zlib", "zstd"}
    unfinished : Path, optional
        What the file is called until then, on the same disk; by default a name of its own beside it.

    Raises
    ------
    InputError
        Another compression.
    OSError
        The folder cannot be written to, or the disk is full.
    """
    import netCDF4

    check_compression(compression)
    place = (ensemble, asperities, steps)
    try:
        with replacing(path, unfinished) as name, netCDF4.Dataset(name, "w", format="NETCDF4") as file:
            yield FileRecorder(*place, attributes, file, compression, instrument=instrument, changes=changes)
            file.setncattr("complete", np.int8(1))
    except RuntimeError as error:
        # the only type of error that the netCDF library has for whatever the system refuses
        if not str(error).startswith("NetCDF: "):
            raise
        raise OSError(errno.EIO, f"the result cannot be written ({error}); is the disk full?", str(path)) from error


def check_compression(compression: str) -> None:
    """Check that a result can be compressed in a way.

    Raises
    ------
    InputError
        An unknown way.
    """
    if compression not in COMPRESSIONS:
        raise InputError(f"compression is {compression!r}; expected one of {', '.join(COMPRESSIONS)}")
