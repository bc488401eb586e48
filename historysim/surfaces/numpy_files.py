"""Height maps in the files of numpy: NPY with one array, NPZ with named ones."""

import zipfile
from pathlib import Path
from typing import IO

import numpy as np

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.surfaces.raw_map import MapReader, RawMap, blamed, check_size, refuse_channel
from historysim.tables.readers import READERS


def read_npy(path: Path, channel: int | str | None) -> RawMap:
    """Read the array (nx, ny), or (n,) for a profile, of an NPY file.

    Raises
    ------
    InputError
        A damaged file, something else than a map of numbers, too many points, or a channel.
    """
    refuse_channel(channel)
    with path.open("rb") as stream:
        return RawMap(_array(stream))


def read_npz(path: Path, channel: int | str | None) -> RawMap:
    """Read the array of an NPZ file that the channel names; the channel is left out where there is one alone.

    Raises
    ------
    InputError
        No such array, or as for `read_npy`.
    """
    with blamed("is damaged, or no NPZ file; save it again with numpy.savez"), zipfile.ZipFile(path) as archive:
        names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
        if channel is None and len(names) != 1:
            raise InputError(f"holds {len(names)} arrays; choose one with channel: {', '.join(names) or 'none'}")
        name = names[0] if channel is None else channel
        if name not in names:
            raise InputError(f"has no array {name!r}; expected channel to be one of {', '.join(names)}")
        with archive.open(f"{name}.npy") as stream:
            return RawMap(_array(stream))


def _array(stream: IO[bytes]) -> Floats:
    with blamed("is damaged, or no NPY file; save it again with numpy.save"):
        first = np.lib.format.read_magic(stream) == (1, 0)
        read_header = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
        shape, _, kind = read_header(stream)
        if kind.kind not in "fiu":
            raise InputError(f"holds an array of type {kind}; expected numbers: save array.astype(float)")
        if len(shape) not in {1, 2} or min(shape) < 1:
            raise InputError(f"holds an array of shape {shape}; expected (nx, ny), or (n,) for a profile")
        check_size(shape)
        stream.seek(0)
        return np.lib.format.read_array(stream, allow_pickle=False).astype(np.float64)


@READERS.register
class NpyReader(MapReader):
    """The array of an NPY file of numpy."""

    kind, endings = "npy", (".npy",)

    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read a file."""
        return read_npy(path, channel)


@READERS.register
class NpzReader(MapReader):
    """An array of an NPZ file of numpy."""

    kind, endings = "npz", (".npz",)

    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read a file."""
        return read_npz(path, channel)
