"""Files of numbers that are good, one of each format, and ways to break them."""

import json

import numpy as np
from hypothesis import strategies as st

from historysim.errors import InputError
from historysim.tables import Column, describe, read_table

TIME = np.arange(20) * 0.5
FORCE = np.sin(TIME)
UNITS = {"time": "s", "force": "N"}


def write_matlab_73(path, fill):
    """A MATLAB file of version 7.3: HDF5 below 512 bytes, with the dimensions in the other order."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def _text(path):
    rows = "".join(f"{time}\t{force}\n" for time, force in zip(TIME, FORCE, strict=True))
    path.write_text("run 7\ntime (s)\tforce [kN]\n" + rows, encoding="utf-8")


def _semicolons(path):
    rows = "".join(f"{time};{force};ok\n" for time, force in zip(TIME, FORCE, strict=True)).replace(
        ".", ","
    )
    path.write_text("# from elsewhere\ntime;force;remark\n" + rows, encoding="utf-8")


def _json(path):
    held = {
        "time": TIME.tolist(),
        "force": FORCE.tolist(),
        "force unit": "kN",
        "m": [[1, 2], [3, 4], [5, 6]],
    }
    path.write_text(
        json.dumps(held | {"records": [{"a": 1}, {"a": None, "b": "x"}]}), encoding="utf-8"
    )


def _matlab(path, *, compressed):
    import scipy.io

    held = {
        "time": TIME,
        "force": FORCE[:, None],
        "m": np.ones((20, 3)),
        "s": {"a": TIME, "a_unit": "kN"},
    }
    cell = np.array([1, "x"], dtype=object)
    scipy.io.savemat(path, held | {"cell": cell, "z": 1j * TIME}, do_compression=compressed)


def _matlab_73(path):
    def fill(file):
        file["time"], file["force"] = TIME[None], FORCE[:, None]
        for dataset in file.values():
            dataset.attrs["MATLAB_class"] = np.bytes_("double")

    write_matlab_73(path, fill)


def _hdf5(path, version):
    import h5py

    with h5py.File(path, "w", libver=version) as file:
        file["time"], file["force"] = TIME, FORCE
        # of a fixed length: the library may never come to an end at damaged texts of variable
        # length
        file["force"].attrs["units"] = np.bytes_("kN")
        file["force"].attrs["_FillValue"] = -9.0
        file.create_dataset("g/z", data=np.ones((20, 3)), compression="gzip")
        file["c"] = np.zeros(3, dtype=[("a", "f8"), ("b", "S3")])


def _netcdf(path, kind):
    import netCDF4

    with netCDF4.Dataset(path, "w", format=kind) as file:
        file.createDimension("t", 20)
        file.createDimension("u", None)
        time = file.createVariable("time", "f8", ("t",))
        time.units = "seconds since 2000-01-01"
        force = file.createVariable("force", "i2", ("t",), fill_value=-9)
        force.scale_factor, force.units = 0.001, "kN"
        record = file.createVariable("record", "f4", ("u",))
        time[:], force[:], record[:] = TIME, FORCE, TIME


def _tdms(path):
    from nptdms import ChannelObject, TdmsWriter

    properties = {"unit_string": "kN", "wf_start_offset": 0.0, "wf_increment": 0.5}
    with TdmsWriter(path) as writer:
        for half in (slice(0, 10), slice(10, 20)):
            force = ChannelObject("", "force", FORCE[half], properties=properties)
            writer.write_segment([ChannelObject("", "time", TIME[half]), force])


WRITERS = {
    "text.tsv": _text,
    "text.csv": _semicolons,
    "tree.json": _json,
    "plain.mat": lambda path: _matlab(path, compressed=False),
    "compressed.mat": lambda path: _matlab(path, compressed=True),
    "new.mat": _matlab_73,
    "old.h5": lambda path: _hdf5(path, "earliest"),
    "new.h5": lambda path: _hdf5(path, "latest"),
    "four.nc": lambda path: _netcdf(path, "NETCDF4"),
    "classic.nc": lambda path: _netcdf(path, "NETCDF3_CLASSIC"),
    "offset.nc": lambda path: _netcdf(path, "NETCDF3_64BIT_OFFSET"),
    "recorder.tdms": _tdms,
}


def columns_of(name):
    """What time and force are called in one of these files."""
    if name == "text.tsv":
        return {"time": Column("time (s)"), "force": Column("force [kN]")}
    above = "/" if name.endswith(".tdms") else ""
    return {"time": Column(f"{above}time"), "force": Column(f"{above}force")}


def read_or_refuse(path, columns, *, missing):
    """Read a file and list it; anything but a table of finite numbers or an InputError is raised."""
    try:
        table = read_table(path, columns, UNITS, missing=missing)
    except InputError as error:
        check_message(path, error)
    else:
        rows = {len(values) for values in table.columns.values()}
        assert len(rows) == 1
        assert rows != {0}
        for values in table.columns.values():
            assert values.dtype == np.float64
            assert (np.isfinite(values) | (missing & np.isnan(values))).all()
    try:
        for listing in describe(path):
            assert all(
                isinstance(part, str)
                for part in (listing.column, listing.unit, listing.values, listing.first_value)
            )
    except InputError as error:
        check_message(path, error)


def check_message(path, error):
    assert str(error).startswith((f"{path.name}: ", "'")), error
    assert len(str(error)) > len(path.name) + 10


def broken(content):
    """Strategy: the bytes of a file with some changed, left out, doubled, put in, or all cut off."""

    @st.composite
    def changes(draw):
        found = bytearray(content)
        for _ in range(draw(st.integers(1, 5))):
            start = draw(st.integers(0, len(found)))
            stop = draw(
                st.integers(start, min(len(found), start + draw(st.sampled_from([1, 8, 100]))))
            )
            found[start:stop] = draw(
                st.one_of(
                    st.binary(min_size=stop - start, max_size=stop - start),
                    st.binary(max_size=9),
                    st.sampled_from(
                        [
                            b"\xff" * 8,
                            b"\0" * 8,
                            b"\n",
                            b"nan",
                            b'"',
                            b"-",
                            b",",
                            b"1e400",
                            b"[",
                            b"#",
                        ]
                    ),
                    st.just(bytes(found[start:stop]) * 2),
                )
            )
        return bytes(found[: draw(st.integers(0, len(found)))] if draw(st.booleans()) else found)

    return changes()
