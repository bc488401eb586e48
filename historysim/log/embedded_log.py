"""The log of a result as a group of the same file, so that the file alone is reproducible.

Arrays in the group of the surface are not repeated; the digest of all of them is the ``log_digest``
of the result.
"""

import errno
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Array
from historysim.basics.hdf5 import check_named
from historysim.errors import InputError
from historysim.log import canonical
from historysim.log.file import Content
from historysim.log.header import SURFACE, LogHeader, parse_head
from historysim.recording import surface_group
from historysim.recording.netcdf import put_attributes, put_variable

if TYPE_CHECKING:
    import netCDF4


GROUP = "log"
ON_SURFACE = "in_surface_group"
COLUMNS = {
    "event_kind": ("event", "<i1", "kind of the event, as in the log"),
    "event_time": ("event", "<f8", "time of the event"),
    "event_value": ("event", "<f8", "value of the event in SI, or the number of its coefficients"),
    "event_coefficient": (
        "coefficient",
        "<f8",
        "friction coefficients of events that have one for each asperity",
    ),
}
BATCH = "batch_end"


def write(file: "netCDF4.Dataset", head: LogHeader, content: Content) -> None:
    """Write head and events of a log into the group ``log`` of a file, inside the group of the surface if there is one.

    Two groups side by side are more than compliance-checker bears (6.1 looks for a time in each).
    """
    group = file.createGroup(f"{surface_group.GROUP}/{GROUP}" if head.surface else GROUP)
    shared = []
    for name, array in head.arrays.items():
        twin = head.arrays.get(_twin(name))
        if twin is not None and array.shape == twin.shape and array.tobytes() == twin.tobytes():
            shared.append(name)
        elif not name.startswith(SURFACE):
            plain = f"ensemble_{name.replace('.', '_')}"
            put_variable(
                group,
                plain,
                tuple(f"{plain}_{axis}" for axis in range(array.ndim)),
                array,
                {"array": name},
            )
    put_attributes(group, {"settings": head.text, ON_SURFACE: " ".join(shared)})
    columns = canonical.to_columns(content.events)
    for (name, (dimension, dtype, text)), column in zip(COLUMNS.items(), columns, strict=True):
        put_variable(group, name, (dimension,), np.frombuffer(column, dtype), {"long_name": text})
    ends = np.array(content.ends, dtype="<i8")
    put_variable(
        group,
        BATCH,
        ("batch",),
        ends,
        {"long_name": "number of events up to each link of the chain"},
    )


def read(path: Path) -> tuple[LogHeader, Content]:
    """Return head and events of a result; InputError if the file is not a result, is damaged, or has no log."""
    import netCDF4

    check_named(path)
    try:
        with netCDF4.Dataset(path) as file:
            file.set_auto_mask(False)
            group = find_group(file)
            if group is None:
                raise InputError(  # noqa: TRY301 - with what is open
                    f"{path}: is a netCDF or HDF5 file, and no result of historysim run with its log in it; expected a "
                    "scenario file (TOML), or the log or the result of a run"
                )
            digest = str(getattr(file, "log_digest", ""))
            head, content = _read(file, group)
    except InputError:
        raise
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError) as error:
        if isinstance(error, OSError) and error.errno in {errno.EACCES, errno.ENOENT}:
            raise
        raise InputError(
            f"{path}: is damaged ({error}); run the scenario, or its log, again"
        ) from error
    if digest != f"sha256:{content.links[-1].hex()}":
        raise InputError(
            f"{path}: what it was made from does not match its digest; run the scenario, or its log, again"
        )
    return head, content


def find_group(file: "netCDF4.Dataset") -> "netCDF4.Group | None":
    """Return the group of the log in an open result; None if there is none."""
    parent = file.groups.get(surface_group.GROUP, file)
    return parent.groups.get(GROUP)


def _read(file: "netCDF4.Dataset", group: "netCDF4.Group") -> tuple[LogHeader, Content]:
    surface = (
        file.groups[surface_group.GROUP].variables if surface_group.GROUP in file.groups else {}
    )
    arrays = {f"{SURFACE}{name}": _floats(variable[...]) for name, variable in surface.items()}
    arrays |= {name: arrays[_twin(name)] for name in getattr(group, ON_SURFACE).split()}
    for variable in group.variables.values():
        if "array" in variable.ncattrs():
            arrays[variable.getncattr("array")] = _floats(variable[...])
    head = parse_head(group.settings, arrays)
    columns = canonical.Columns(
        *(group[name][...].astype(dtype).tobytes() for name, (_, dtype, _) in COLUMNS.items())
    )
    events, ends = canonical.from_columns(columns), [int(stop) for stop in group[BATCH][...]]
    links = [head.link, *(link for *_, link in canonical.chain(head.link, events, ends))]
    return head, Content(events, links, ends)


def _twin(name: str) -> str:
    """Return the name of the array of the surface that may equal an array of the ensemble."""
    return f"{SURFACE}{name}" if name.startswith("summit_") else f"{SURFACE}summit_{name}"


def _floats(values: npt.ArrayLike) -> Array:
    return np.ascontiguousarray(values, dtype="<f8")
