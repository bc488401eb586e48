"""Files that hold named arrays: JSON, MATLAB, HDF5, netCDF, TDMS."""

import json
import struct
import sys
import tracemalloc
import zlib

import attrs
import numpy as np
from number_files import write_matlab_73
from numpy.testing import assert_array_equal
from pytest import fixture, importorskip, mark, raises

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table, summarise_text

T = np.arange(6) * 0.5
F = np.array([0.0, 1.5, -2.0, 3.0, 4.0, 5.5])
M = np.column_stack([T, F, -F])


def values(path, *columns, units="s", missing=False, **layout):
    wanted = {
        str(place): column if isinstance(column, Column) else Column(column)
        for place, column in enumerate(columns)
    }
    table = read_table(
        path, wanted, dict.fromkeys(wanted, units), Format(**layout), missing=missing
    )
    assert table.lines is None
    assert table.place(2) == "row 3"
    return [column.tolist() for column in table.columns.values()]


def refusal(path, *columns, **arguments):
    with raises(InputError) as refused:
        values(path, *columns, **arguments)
    return str(refused.value)


def listed(path, **layout):
    return [attrs.astuple(listing) for listing in describe(path, Format(**layout))]


# -- JSON ------------------------------------------------------------------------------------------


@fixture
def file(tmp_path):
    return tmp_path / "f.json"


@mark.parametrize(
    "document, columns, layout",
    [
        ({"run": {"t": [0, 1, 2], "at": {"F": [3, 4.5, 5]}}}, ["run.t", "run.at.F"], {}),
        (
            {"data": [[0, 3], [1, 4.5], [2, 5]]},
            [Column("data", index=1), Column("data", index=2)],
            {},
        ),
        (
            {"data": [[0, 1, 2], [3, 4.5, 5]]},
            [Column("data", index=1), Column("data", index=2)],
            {"transposed": True},
        ),
        ([[0, 3], [1, 4.5], [2, 5]], [1, 2], {}),
        ([{"t": 0, "F": 3}, {"t": 1, "F": 4.5}, {"F": 5, "t": 2, "note": "x"}], ["t", "F"], {}),
    ],
)
def test_shapes_of_json(file, document, columns, layout):
    file.write_text(json.dumps(document), encoding="utf-8")
    assert values(file, *columns, **layout) == [[0.0, 1.0, 2.0], [3.0, 4.5, 5.0]]


def test_missing_values_of_json(file):
    file.write_text('{"t": [0, null, NaN, "NaN", "", "-"]}', encoding="utf-8")
    assert_array_equal(values(file, "t", missing=True)[0], [0.0] + [np.nan] * 5)
    assert (
        refusal(file, "t") == "f.json: row 2, column 't': missing (NaN); expected a finite number"
    )
    file.write_text('[{"t": 0}, {"F": 1}]', encoding="utf-8")
    assert_array_equal(values(file, "t", missing=True)[0], [0.0, np.nan])


@mark.parametrize("units", [{"F unit": "kN"}, {"units": {"F": "kN", "t": "s"}}, {"F.unit": "kN"}])
def test_units_next_to_arrays_of_json(file, units):
    file.write_text(json.dumps({"run": {"t": [0], "F": [1.5]} | units}), encoding="utf-8")
    assert values(file, "run.F", units="N") == [[1500.0]]
    assert values(file, Column("run.F", "1000 N"), units="N") == [[1500.0]]
    assert values(file, Column("run.F", "N"), units="N") == [[1.5]]


def test_listing_of_json(file):
    document = {
        "t": [0.5, 1],
        "data": [[1, 2], [3, 4], [5, 6]],
        "F": [],
        "F unit": "kN",
        "dt": 0.1,
        "bad": [[1], [2, 3]],
    }
    file.write_text(json.dumps(document), encoding="utf-8")
    assert listed(file) == [
        ('"t"', "", "2", "0.5"),
        ('{ column = "data", index = 1 }', "", "3", "1"),
        ('{ column = "data", index = 2 }', "", "3", "2"),
        ('"F"', "kN", "0", ""),
        ('"dt"', "", "1", "0.1"),
        ('"bad"', "", "2", ""),
        ('"F unit"', "", "a text", "kN"),
    ]
    file.write_text("[[1, 2, 3], [4, 5, 6]]", encoding="utf-8")
    assert listed(file) == [("{ column = 1 }", "", "3", "1"), ("{ column = 2 }", "", "3", "4")]
    assert [column for column, *_ in listed(file, transposed=False)] == [
        f"{{ column = {place} }}" for place in (1, 2, 3)
    ]
    file.write_text(json.dumps({"m": np.zeros((300, 200)).tolist()}), encoding="utf-8")
    assert listed(file) == [('"m"', "", "300 × 200", "")]


# -- MATLAB ----------------------------------------------------------------------------------------


VARIABLES = {
    "t": T,
    "row": F[None],
    "column": F[:, None],
    "m": M,
    "wide": M.T,
    "single": F.astype("f4"),
    "counts": np.arange(6, dtype="u2"),
    "signed": -np.arange(6, dtype="i8"),
    "scalar": 2.5,
    "run": {"force": F, "force_unit": "kN", "deep": {"x": T}},
    "logical": np.array([True, False]),
    "complex": 1j * T,
    "cube": np.zeros((2, 3, 4)),
    "cells": np.array([1, "x"], dtype=object),
    "many": np.zeros(3, dtype=[("x", "f8")]),
    "none": np.zeros((0, 0)),
    "text": "kN",
    "texts": np.array(["a", "b"]),
}


@fixture
def matlab_73(tmp_path):
    """As MATLAB writes it: two dimensions in the other order, texts as numbers, structures as groups."""

    def fill(file):
        def put(name, value, kind="double"):
            file[name] = np.atleast_2d(value).T
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)

        put("t", T)
        put("row", F[None])
        put("column", F[:, None])
        put("m", M)
        put("wide", M.T)
        put("single", F.astype("f4"), "single")
        put("counts", np.arange(6, dtype="u2"), "uint16")
        put("signed", -np.arange(6, dtype="i8"), "int64")
        put("scalar", 2.5)
        put("run/force", F)
        put("run/force_unit", [[ord(letter) for letter in "kN"]], "char")
        put("run/deep/x", T)
        for group in ("run", "run/deep"):
            file[group].attrs["MATLAB_class"] = np.bytes_("struct")
        put("logical", np.array([1, 0], dtype="u1"), "logical")
        put("none", np.zeros(2, dtype="u8"))
        file["none"].attrs["MATLAB_empty"] = 1
        put("text", [[ord(letter) for letter in "kN"]], "char")
        put("sparse/data", F)
        file["sparse"].attrs["MATLAB_class"], file["sparse"].attrs["MATLAB_sparse"] = (
            np.bytes_("double"),
            6,
        )
        put("#refs#/a", T)

    path = tmp_path / "g.mat"
    write_matlab_73(path, fill)
    return path


def test_what_a_matlab_file_unpacks_to_has_a_bound_before_it_is_unpacked(tmp_path, monkeypatch):
    from scipy.io import savemat

    path = tmp_path / "zeros.mat"
    savemat(path, {"t": np.zeros(1 << 20), "F": np.zeros(1 << 20)}, do_compression=True)
    assert len(describe(path)) == 2
    for allowed, told in ((2e6, "8,388,"), (1e7, "16,777,")):
        monkeypatch.setenv("HISTORYSIM_MOST_UNPACKED_BYTES", str(allowed))
        tracemalloc.start()
        with raises(InputError, match=f"unpack to {told}.*UNPACKED_BYTES"):
            describe(path)
        assert tracemalloc.get_traced_memory()[1] < 2 * allowed
        tracemalloc.stop()


def test_cells_of_a_workbook_that_lie_far_apart_are_refused(tmp_path):
    openpyxl = importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active["A1"] = book.active["XFD1048576"] = 1
    book.save(tmp_path / "far.xlsx")
    with raises(InputError, match=r"cells so far apart .*; remove"):
        describe(tmp_path / "far.xlsx")


@fixture
def matlab_5(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "f.mat", VARIABLES)
    return tmp_path / "f.mat"


@fixture(params=["matlab_5", "matlab_73"])
def any_matlab(request):
    return request.getfixturevalue(request.param)


def test_variables_of_matlab(any_matlab):
    names = ("t", "row", "column", "single", "counts", "signed", "run.deep.x")
    found = values(any_matlab, *names)
    for column, expected in zip(found, (T, F, F, F, np.arange(6), -np.arange(6), T), strict=True):
        assert column == expected.tolist()
    assert values(any_matlab, "scalar") == [[2.5]]
    assert values(any_matlab, "run.force", units="N") == [(1000 * F).tolist()]
    assert values(any_matlab, Column("m", index=2)) == [F.tolist()]
    assert values(any_matlab, Column("wide", index=2), transposed=True) == [F.tolist()]


def _element(kind, content):
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def _object_5(name, class_name):
    """A string, table or datetime as MATLAB stores it: without a shape, and with contents in an unnamed array."""
    flags = _element(6, struct.pack("<II", 17, 0))
    numbers = (
        _element(6, struct.pack("<II", 13, 0))
        + _element(5, struct.pack("<ii", 6, 1))
        + _element(1, b"")
    )
    body = flags + _element(1, name) + _element(1, b"MCOS") + _element(1, class_name)
    return _element(
        14,
        body + _element(14, numbers + _element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))),
    )


@mark.parametrize("compressed", [False, True])
def test_arrays_next_to_objects_are_read_and_the_objects_named(tmp_path, compressed):
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"t": T, "s": {"F": F}}, do_compression=compressed)
    plain = (tmp_path / "a.mat").read_bytes()
    contents = (
        _element(6, struct.pack("<II", 9, 0))
        + _element(5, struct.pack("<ii", 1, 16))
        + _element(1, b"")
    )
    elements = [
        _object_5(b"names", b"string"),
        _object_5(b"log", b"table"),
        _element(14, contents + _element(2, bytes(16))),
    ]
    if compressed:
        packed = map(zlib.compress, elements)
        elements = [struct.pack("<II", 15, len(element)) + element for element in packed]
    path = tmp_path / "b.mat"
    path.write_bytes(plain[:128] + b"".join(elements) + plain[128:])
    assert values(path, "t", "s.F") == [T.tolist(), F.tolist()]
    assert [column for column, *_ in listed(path)] == ['"t"', '"s.F"']
    assert summarise_text(path)[0] == ["left out: 'names' (string), 'log' (table)"]
    assert (
        refusal(path, "log")
        == "b.mat: column 'log' is not read (table); save it as an array of numbers"
    )


def test_cells_structures_and_objects_of_version_73(tmp_path):
    import h5py

    def fill(file):
        def put(name, value, kind, **marks):
            file[name] = np.atleast_2d(value).T
            file[name].attrs.update({"MATLAB_class": np.bytes_(kind), **marks})

        put("t", T, "double")
        put("log", np.arange(6, dtype="u4"), "table", MATLAB_object_decode=3)
        put("#refs#/a", F, "double")
        put("#refs#/b/F", 2 * F, "double")
        file["#refs#/b"].attrs["MATLAB_class"] = np.bytes_("struct")
        references = [[file["#refs#/a"].ref], [file["#refs#/b"].ref]]
        file["tests"] = np.array(references, dtype=h5py.ref_dtype)
        file["tests"].attrs["MATLAB_class"] = np.bytes_("cell")
        file["runs/F"] = np.array([references[0], references[0]], dtype=h5py.ref_dtype)
        file["runs"].attrs["MATLAB_class"] = np.bytes_("struct")

    path = tmp_path / "c.mat"
    write_matlab_73(path, fill)
    assert values(path, "t", "tests{1}", "tests{2}.F", "runs(2).F") == [
        T.tolist(),
        F.tolist(),
        (2 * F).tolist(),
        F.tolist(),
    ]
    assert summarise_text(path)[0] == ["left out: 'log' (table)"]


# -- HDF5 ------------------------------------------------------------------------------------------


@fixture
def hdf5(tmp_path):
    import h5py

    path = tmp_path / "f.h5"
    with h5py.File(path, "w") as file:
        file["t"], file["run/F"], file["m"] = T, F, M
        file["run/F"].attrs["units"] = "kN"
        file["u"] = F[None, :]
        file["u"].attrs["unit"] = np.array([b"kN"])
        file["mm"] = F
        file["mm"].attrs["units"] = np.bytes_("mm")
        file["filled"] = np.where(F == 3.0, -9.0, F)
        file["filled"].attrs["_FillValue"] = np.array([-9.0])
        file["scaled"] = F
        file["scaled"].attrs["scale_factor"] = 2.0
        file["half"], file["big"], file["small"] = (
            F.astype("f2"),
            F.astype(">f8"),
            np.arange(6, dtype="i1"),
        )
        file.create_dataset("packed", data=F, compression="gzip", shuffle=True, chunks=(2,))
        file["records"] = np.array(
            list(zip(T, F, strict=True)), dtype=[("t", "f8"), ("F (kN)", "f4")]
        )
        file["bool"], file["text"], file["complex"] = F > 0, "kN", 1j * F
        file["words"] = np.array([b"a", b"b"])
        file["empty"] = h5py.Empty("f8")
        file["broken link"], file["other file"] = (
            h5py.SoftLink("/nowhere"),
            h5py.ExternalLink("none.h5", "/x"),
        )
        file["run"]["loop"] = file["/"]
        file["infinite"] = np.array([1.0, np.inf])
        file["nan"] = np.array([1.0, np.nan])
        file["scalar"] = 2.5
    return path


def test_datasets_of_hdf5(hdf5):
    found = values(hdf5, "t", "half", "big", "packed", "records/t", Column("m", index=3), "small")
    for column, expected in zip(found, (T, F, F, F, T, -F, np.arange(6)), strict=True):
        assert column == expected.tolist()
    assert values(hdf5, "run/F", "u", "records/F (kN)", units="N") == [(1000 * F).tolist()] * 3
    assert values(hdf5, "scalar") == [[2.5]]
    assert values(hdf5.rename(hdf5.with_suffix(".HDF5")), "t") == [T.tolist()]


def test_missing_values_of_hdf5(hdf5):
    expected = np.where(F == 3.0, np.nan, F)
    assert_array_equal(values(hdf5, "filled", missing=True)[0], expected)
    assert "row 4, column 'filled': missing (NaN)" in refusal(hdf5, "filled")
    assert "row 2, column 'nan': missing (NaN)" in refusal(hdf5, "nan")
    assert "row 2, column 'infinite': inf; expected a finite number" in refusal(
        hdf5, "infinite", missing=True
    )


# -- netCDF ----------------------------------------------------------------------------------------


@fixture(params=["NETCDF4", "NETCDF3_CLASSIC"])
def netcdf(request, tmp_path):
    import netCDF4

    path = tmp_path / "f.nc"
    with netCDF4.Dataset(path, "w", format=request.param) as file:
        for name, size in {"t": 6, "c": 3, "word": 2, "u": None}.items():
            file.createDimension(name, size)

        def put(name, kind, values, dimensions=("t",), **attributes):
            variable = file.createVariable(
                name, kind, dimensions, fill_value=attributes.pop("_FillValue", None)
            )
            variable.setncatts(attributes)
            variable.set_auto_maskandscale(False)
            variable[: len(values)] = values

        put("t", "f8", T, units="seconds since 2001-01-01 00:00")
        put("m", "f8", M, ("t", "c"), units="kN")
        put("F", "f4", F, units="kN")
        put("scaled", "i2", np.arange(6), scale_factor=0.5, add_offset=1.0)
        put("filled", "i4", [1, 2, -9, 4, 5, 6], _FillValue=np.int32(-9))
        put("bytes", "i1", np.arange(6))
        put("record", "f8", T, ("u",))
        put("letters", "S1", np.array([b"a"] * 6))
        if request.param == "NETCDF4":
            group = file.createGroup("g").createGroup("h")
            group.createVariable("z", "f8", ("t",), zlib=True)[:] = F
            file.createVariable("words", str, ("t",))
            file.createVariable("lists", file.createVLType("f8", "list"), ("t",))
    return path


def test_variables_of_netcdf(netcdf):
    assert values(
        netcdf, "t", "record", Column("m", "kN", index=2), "bytes", units=("s", "N", "1")
    ) == [
        T.tolist(),
        T.tolist(),
        (1000 * F).tolist(),
        list(range(6)),
    ]
    assert values(netcdf, "scaled") == [[1.0, 1.5, 2.0, 2.5, 3.0, 3.5]]
    assert_array_equal(values(netcdf, "filled", missing=True), [[1, 2, np.nan, 4, 5, 6]])


# -- TDMS ------------------------------------------------------------------------------------------


@fixture
def tdms(tmp_path):
    nptdms = importorskip("nptdms")
    path = tmp_path / "f.tdms"
    evenly = {"wf_start_offset": 2.0, "wf_increment": 0.25, "unit_string": "kN"}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("run", "t", T),
                nptdms.ChannelObject("run", "F", F, properties=evenly),
                nptdms.ChannelObject(
                    "run", "counts", np.arange(6, dtype="i2"), properties={"unit_string": ""}
                ),
                nptdms.ChannelObject("run", "words", ["a", "b"]),
                nptdms.ChannelObject("run", "clock", np.array([1, 2], dtype="datetime64[s]")),
                nptdms.ChannelObject("run", "bad", np.array([1.0, np.nan, np.inf])),
                nptdms.ChannelObject("run", "nothing", np.zeros(0)),
            ]
        )
    return path


def test_channels_of_tdms(tdms):
    assert values(tdms, "run/t", "run/counts", "run/F/time") == [
        T.tolist(),
        list(range(6)),
        (2 + 0.25 * np.arange(6)).tolist(),
    ]
    assert values(tdms, "run/F", units="N") == [(1000 * F).tolist()]
    table = read_table(tdms, {"F": Column("run/F", "N")}, {"F": "N"})
    assert table.columns["F"].tolist() == F.tolist()
    assert table.notices == ("column 'run/F': 'kN' in the file, taken as 'N', as unit says",)


@mark.parametrize("cut", [1, 100])
def test_a_recording_that_was_cut_short_is_refused(tdms, cut, capfd):
    tdms.write_bytes(tdms.read_bytes()[:-cut])
    message = refusal(tdms, "run/t")
    assert "is damaged" in message or "is cut short" in message
    assert capfd.readouterr() == ("", "")


@mark.parametrize(
    "library, extra, name, content",
    [("nptdms", "tdms", "f.tdms", b"TDSm"), ("h5py", "hdf5", "f.h5", b"\x89HDF\r\n\x1a\n")],
)
def test_without_the_library_the_message_says_how_to_install_it(
    tmp_path, monkeypatch, library, extra, name, content
):
    (tmp_path / name).write_bytes(content)
    monkeypatch.setitem(sys.modules, library, None)
    assert refusal(tmp_path / name, "t").endswith(
        f'is not installed; pip install "historysim[{extra}]"'
    )


# -- measured records ------------------------------------------------------------------------------


def test_structures_and_cells_of_matlab_are_listed_by_their_numbers(tmp_path):
    from scipy.io import savemat

    tests = [{"t": np.arange(3.0) + 10 * number, "F": np.arange(3.0)} for number in range(2)]
    array = np.zeros((1, 2), dtype=[("t", object), ("F", object)])
    for number, test in enumerate(tests):
        array[0, number] = (test["t"], test["F"])
    savemat(tmp_path / "s.mat", {"tests": array, "cells": np.array(tests, dtype=object)})
    names = [listing.column for listing in describe(tmp_path / "s.mat")]
    assert names == [
        f'"{each}.{field}"'
        for each in ("tests(1)", "tests(2)", "cells{1}", "cells{2}")
        for field in ("t", "F")
    ]
    for name in ("tests(2).t", "cells{2}.t"):
        read = read_table(tmp_path / "s.mat", {"time": Column(name)}, {"time": "s"})
        assert read.columns["time"].tolist() == [10, 11, 12]
