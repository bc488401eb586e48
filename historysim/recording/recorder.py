"""Record: project the replayed rows into a Dataset, or into a netCDF file that appears only when complete."""

import abc
import contextlib
import errno
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities import ensemble as ensembles
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.errors import InputError
from historysim.loads.events import Event, NormalDisplacement, NormalLoad
from historysim.memory import kernel
from historysim.recording.variables import BEHIND_A_SPRING, COORDINATES, PER_ASPERITY, TOTALS, Variable

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

Array = npt.NDArray[Any]
Selection = str | Sequence[int]

BLOCK_CELLS = 1 << 21
"""Rows times asperities that are held in memory between writes to a file."""

CHUNK_CELLS = 1 << 17
COMPRESSIONS: dict[str, dict[str, Any]] = {
    "none": {},
    "zlib": {"compression": "zlib", "complevel": 1, "shuffle": True},
    "zstd": {"compression": "zstd", "complevel": 3, "shuffle": True},
}


def chosen_asperities(ensemble: Ensemble, events: Sequence[Event], record: Selection) -> npt.NDArray[np.int64] | None:
    """Return the indices of the asperities to record, ascending, or None for totals alone.

    Parameters
    ----------
    ensemble : Ensemble
    events : sequence of events
    record : {"touching", "all", "totals"} or sequence of int
        "touching" stands for those that touch at any time.

    Raises
    ------
    InputError
        Another word, or an index that the ensemble does not have or that comes twice.
    """
    if isinstance(record, str):
        if record == "totals":
            return None
        if record == "all":
            return np.arange(len(ensemble))
        if record == "touching":
            gap = ensemble.highest_summit - ensemble.summit_height
            return np.flatnonzero(gap < largest_approach(ensemble, events))
        raise InputError(f"record is {record!r}; expected 'touching', 'all', 'totals' or a list of asperity indices")
    try:
        given = np.asarray(record)
        indices = np.sort(given.astype(np.int64))
        whole = given.ndim == 1 and given.dtype != bool and np.array_equal(indices, np.sort(given))
    except (TypeError, ValueError, OverflowError):
        whole = False
    if not whole or indices.size == 0:
        raise InputError(f"record is {record!r}; expected 'touching', 'all', 'totals' or a list of asperity indices")
    outside = indices[(indices < 0) | (indices >= len(ensemble))]
    if outside.size or np.unique(indices).size != indices.size:
        raise InputError(
            f"record names asperity {outside[0]}; expected indices from 0 to {len(ensemble) - 1}"
            if outside.size
            else "record names an asperity twice; expected each index once"
        )
    return indices


def largest_approach(ensemble: Ensemble, events: Sequence[Event]) -> float:
    """Return the largest approach of the highest summit that events reach [m], 0 where nothing touches."""
    # channels run straight between waypoints, so the extremes are waypoints
    loads = [event.value for event in events if isinstance(event, NormalLoad)]
    approaches = [event.value for event in events if isinstance(event, NormalDisplacement)]
    return max([*approaches, ensemble.approach_at(max(loads, default=0.0)), 0.0])


@attrs.define
class Recorder(abc.ABC):
    """Where the rows of one history go: a `DatasetRecorder` or a `FileRecorder`.

    Parameters
    ----------
    ensemble : Ensemble
    asperities : array (asperity), optional
        Indices to record; None for totals alone.
    steps : int
        Rows that the whole history records.
    attributes : mapping
        Attributes of the Dataset or file.
    instrument : Instrument, optional
        In series with the contact.
    """

    ensemble: Ensemble
    asperities: npt.NDArray[np.int64] | None
    steps: int
    attributes: Mapping[str, Any]
    instrument: Instrument = attrs.field(default=RIGID, kw_only=True)
    _filled: int = attrs.field(default=0, init=False)

    @property
    def columns(self) -> int:
        """Number of recorded asperities."""
        return 0 if self.asperities is None else self.asperities.size

    @property
    def totals(self) -> tuple[Variable, ...]:
        """Variables along ``step`` alone."""
        return TOTALS if self.instrument.rigid else (*TOTALS, *BEHIND_A_SPRING)

    @abc.abstractmethod
    def room(self, count: int) -> kernel.Rows:
        """Return room for the next rows."""

    @abc.abstractmethod
    def record(self, times: Array) -> None:
        """Take what stands in the room last given as the rows at these times."""

    def _projected(self, rows: kernel.Rows) -> list[tuple[Variable, Array]]:
        """Variables along ``step``, with their values."""
        totals = rows.totals
        displacement, load = totals[:, kernel.ROW_DISPLACEMENT], totals[:, kernel.ROW_TANGENTIAL]
        values = {
            "total_normal_load": totals[:, kernel.ROW_NORMAL],
            "total_tangential_load": load,
            "separation": self.ensemble.highest_summit - totals[:, kernel.ROW_APPROACH],
            "tangential_displacement": displacement,
            "contact_count": totals[:, kernel.ROW_COUNT],
            "real_contact_area": totals[:, kernel.ROW_AREA],
            "tangential_stiffness": totals[:, kernel.ROW_STIFFNESS],
            "total_dissipated_energy": totals[:, kernel.ROW_DISSIPATED],
            "friction_limit": totals[:, kernel.ROW_LIMIT],
            "saturated": totals[:, kernel.ROW_SATURATED],
            "drive_displacement": self.instrument.drive_displacement(displacement, load),
        }
        projected = [(variable, values[variable.name].astype(variable.dtype)) for variable in self.totals]
        if self.asperities is not None:
            arrays = (rows.normal_load, rows.tangential_load, rows.contact_radius, rows.stick_radius)
            projected += zip(PER_ASPERITY, (*arrays, rows.slip_state, rows.dissipated), strict=True)
        return projected


@final
@attrs.define
class DatasetRecorder(Recorder):
    """Rows of one history in memory, projected onto the variables at the end."""

    _rows: kernel.Rows = attrs.field(init=False)
    _times: Array = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self._rows = ensembles.room(self.steps, self.columns)
        self._times = np.zeros(self.steps)

    def room(self, count: int) -> kernel.Rows:
        """Return room for the next rows."""
        where = slice(self._filled, self._filled + count)
        return kernel.Rows._make(array[where] for array in self._rows)

    def record(self, times: Array) -> None:
        """Take what stands in the room last given as the rows at these times."""
        self._times[self._filled : self._filled + times.size] = times
        self._filled += times.size

    def dataset(self) -> "xr.Dataset":
        """Return the recorded history."""
        import xarray as xr

        variables = {
            variable.name: xr.Variable(
                variable.dimensions, values, variable.attributes, encoding={"_FillValue": None, "dtype": variable.dtype}
            )
            for variable, values in [
                *coordinates_of(self.ensemble, self.asperities),
                (COORDINATES[0], self._times),
                *self._projected(self._rows),
            ]
        }
        names = {variable.name for variable in COORDINATES}
        coordinates = {name: value for name, value in variables.items() if name in names}
        data = {name: value for name, value in variables.items() if name not in names}
        return xr.Dataset(data, coordinates, {**self.attributes, "complete": np.int8(1)})


@final
@attrs.define
class FileRecorder(Recorder):
    """Rows of one history, streamed to a netCDF file; use it through `recording`.

    Every variable has checksums (Fletcher-32), which the netCDF library checks on reading.
    """

    file: "netCDF4.Dataset"
    compression: str = "none"
    _rows: kernel.Rows = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self.file.setncatts(dict(self.attributes))
        self.file.createDimension("step", self.steps)
        if self.asperities is not None:
            self.file.createDimension("asperity", self.columns)
        fixed = coordinates_of(self.ensemble, self.asperities)
        declared = [variable for variable, _ in fixed]
        declared += [COORDINATES[0], *self.totals, *(PER_ASPERITY if self.asperities is not None else ())]
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

    def room(self, count: int) -> kernel.Rows:
        """Return room for the next rows."""
        self._rows = ensembles.room(count, self.columns)
        return self._rows

    def record(self, times: Array) -> None:
        """Write what stands in the room last given as the rows at these times."""
        where = slice(self._filled, self._filled + times.size)
        self.file["time"][where] = times
        for variable, values in self._projected(self._rows):
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
    compression: str = "none",
    unfinished: Path | None = None,
) -> Iterator[FileRecorder]:
    """Record into a netCDF file, which appears under its name only when all rows stand in it.

    Parameters
    ----------
    path : Path
        An existing file is replaced, at the end.
    ensemble, asperities, steps, attributes, instrument
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
    # made here first, because the message of the netCDF library would not say what was wrong
    try:
        if unfinished is None:
            handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
        else:
            handle, name = os.open(unfinished, os.O_CREAT | os.O_WRONLY, 0o600), str(unfinished)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    os.close(handle)
    try:
        with netCDF4.Dataset(name, "w", format="NETCDF4") as file:
            yield FileRecorder(ensemble, asperities, steps, attributes, file, compression, instrument=instrument)
            file.setncattr("complete", np.int8(1))
        Path(name).chmod(0o666 & ~_umask())
        _sync(name)
        Path(name).replace(path)
        _sync(path.parent)
    except RuntimeError as error:
        # the only type of error that the netCDF library has for whatever the system refuses
        if not str(error).startswith("NetCDF: "):
            raise
        raise OSError(errno.EIO, f"the result cannot be written ({error}); is the disk full?", str(path)) from error
    finally:
        Path(name).unlink(missing_ok=True)


def check_compression(compression: str) -> None:
    """Check that a result can be compressed in a way.

    Raises
    ------
    InputError
        An unknown way.
    """
    if compression not in COMPRESSIONS:
        raise InputError(f"compression is {compression!r}; expected one of {', '.join(COMPRESSIONS)}")


def _sync(path: str | Path) -> None:
    """Bring a file, or what a folder names, to the disk: a rename must not come before what it names."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def coordinates_of(ensemble: Ensemble, asperities: npt.NDArray[np.int64] | None) -> list[tuple[Variable, Array]]:
    """Coordinates along ``asperity``, with their values."""
    if asperities is None:
        return []
    sources = {variable.name: getattr(ensemble, variable.name, None) for variable in COORDINATES[2:]}
    values = {"asperity": asperities}
    values |= {name: source[asperities] for name, source in sources.items() if source is not None}
    return [(variable, values[variable.name]) for variable in COORDINATES if variable.name in values]
