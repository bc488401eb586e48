"""Messages of the table readers: expressions and their messages in test_messages.txt (`golden.py`)."""

import tempfile
from pathlib import Path

import numpy as np
from golden import check_messages
from pytest import raises

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table
from historysim.tables.columns import resolve_unit  # noqa: F401 - of the messages

TEMPORARY = tempfile.TemporaryDirectory()
FOLDER = Path(TEMPORARY.name)


def read(name, column, unit="s"):
    wanted = column if isinstance(column, Column) else Column(column)
    return read_table(FOLDER / name, {"t": wanted}, {"t": unit})


def text(content, columns, unit="s", missing=False, **layout):
    """Read columns of a text in one SI unit."""
    path = FOLDER / "f.txt"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    wanted = {
        str(number): name if isinstance(name, Column) else Column(name)
        for number, name in enumerate(columns)
    }
    return read_table(path, wanted, dict.fromkeys(wanted, unit), Format(**layout), missing=missing)


def array(content, column):
    """Read an array of a JSON file."""
    (FOLDER / "f.json").write_text(content, encoding="utf-8")
    return read("f.json", column)


def write_hdf5():
    import h5py

    with h5py.File(FOLDER / "f.h5", "w") as file:
        file["complex"], file["text"], file["empty"] = 1j * np.arange(3), "kN", h5py.Empty("f8")
        file["link"], file["mm"] = h5py.SoftLink("/nowhere"), np.arange(3.0)
        file["mm"].attrs["units"] = np.bytes_("mm")
        file["scaled"] = np.arange(3.0)
        file["scaled"].attrs["scale_factor"] = 2.0


def write_netcdf():
    import netCDF4

    with netCDF4.Dataset(FOLDER / "f.nc", "w") as file:
        file.createDimension("t", 2)
        file.createVariable("letters", "S1", ("t",))
        file.createVariable("lists", file.createVLType("f8", "list"), ("t",))


def write_matlab():
    from scipy.io import savemat

    flags = np.array([True, False])
    savemat(FOLDER / "f.mat", {"flag": flags, "m": np.ones((6, 3)), "wide": np.ones((3, 6))})


def test_messages():
    write_hdf5()
    write_netcdf()
    write_matlab()
    check_messages(globals())


def test_messages_of_files_of_another_type(tmp_path):
    for name in ("none.csv", "a\0b", "n" * 5000, "none.json"):
        with raises(InputError, match="there is no such file"):
            describe(tmp_path / name)
    (tmp_path / "f.h5").write_bytes(b"CDF\1" + bytes(40))
    (tmp_path / "f.h5").rename(tmp_path / "a.txt")
    for path in (tmp_path, tmp_path / "a.txt"):
        with raises(InputError, match=f"^{path.name}: is "):
            describe(path)
