"""Messages of the table readers, compared with messages.txt, which is reviewed in diffs.

After an intended change ``python tests/tables/test_messages.py`` writes the file again.
"""

import tempfile
from pathlib import Path

import numpy as np
import pytest

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table
from historysim.tables.columns import resolve_unit

GOLDEN = Path(__file__).with_name("messages.txt")
STEP = "Step No. {}\nDuration = 1.5\nTime\tFz\ns\tmN\n0\t10\n0.5\t10.5\n1\t10\n"

WORDS = [
    "abc",
    "inf",
    "#N/A",
    "1_0",
    "٣",
    "(0.5)",
    "0.5-",
    "1.5-101",
    "<0.5",
    "1,5",
    "1,500.2",
    "1.5 mN",
]
WORDS += ["1/2/2024 10:00"]
WORDS = [
    "abc",
    "inf",
    "#N/A",
    "1_0",
    "٣",
    "(0.5)",
    "0.5-",
    "1.5-101",
    "<0.5",
    "1,5",
    "1,500.2",
    "1.5 mN",
]
WORDS += ["1/2/2024 10:00"]
# content, columns, and settings of the format ("unit" is the SI unit of all columns, "missing"
# allows missing values)
TEXTS = [
    ("", ["t"], {}),
    ("t,F\n", ["t"], {}),
    ("t,F\n0,1\n", ["time", "Force"], {}),
    ("t,F\n0,1\n", ["F"], {"delimiter": ";"}),
    ("t,F\n0,1\n", ["F"], {"header": 0}),
    ("t,F\n0,1\n", ["F"], {"header": 9}),
    ("t,F\n0,1\n", [3], {"header": 1}),
    ("t,F\n0,1\n", [Column("F", index=2)], {}),
    ("t,t,F\n0,1,2\n", [Column("t", occurrence=3)], {}),
    ("a\nt\na\n1\n", ["a", "t"], {}),
    ("t,F (kN),\n0,1,2\n", [1], {}),
    ("0,1\n1,2\n1,2,3\n", [1], {"delimiter": ","}),
    ("7,8\nt,F\n0,1\n", ["t"], {}),
    ("0,5;1\n1;2\n", [1], {}),
    ('t,F\n0,"1\n1,2\n', ["t"], {}),
    ("t,0,1,2\nF,1,2,3\n", ["t", "F"], {}),
    ("t,F\n0,1\n1,2\n", ["2"], {}),
    ("t,F\n0,1\n1,2\n", ["50 mN"], {}),
    ("Zeit [s],F\n0,1\n1,2\n", ["zeit"], {}),
    ("F [N],F [V]\n0,1\n1,2\n", ["F"], {"unit": "N"}),
    ("1 July\nt (s)\tF (kN)\tT (degC)\n0\t1.5\t20\t21\n1\t2.5\t20\t21\n", ["t (s)"], {}),
    ("t,F\n0,1\n1,\n2,3\n", ["t", "F"], {}),
    *(
        (f"t;F\n0;1\n1;{word}\n2;3\n", ["t", "F"], {"delimiter": ";", "missing": True})
        for word in WORDS
    ),
    ("t;F\n0;50 mN\n1;25\n2;1 mN\n", ["t", "F"], {"unit": "N"}),
    ("t;F\n0;50 mm\n1;25 mm\n", ["F"], {"unit": "N"}),
    ("t,F\n0,1\n1,-1x\n2,2\n3,-2x\n", ["t", "F"], {}),
    ("t,F\n0,1\n1,OVER\n2,2\n3,OVER\n", ["t", "F"], {}),
    ("t,F\n0,1\n1,a\n2,b\n3,c\n4,2\n", ["t", "F"], {}),
    ("t,F\n0,1\n1\n2,3\n3,x\n4,5\n", ["t", "F"], {}),
    ("t,F\n0,1\n1,2\nMean,5\n2,3\n", ["F"], {"header": 1}),
    ("t;F\ns;g\n0;1\n1;2\n", ["F"], {"unit": "N"}),
    (STEP.format(1) + STEP.format(2), ["Time"], {}),
    (STEP.format(1) + STEP.format(2), ["Time"], {"block": 3}),
    ("µ (µm)\n1\n".encode("cp1252"), ["µ (µm)"], {"encoding": "utf-8", "unit": "m"}),
]

ARRAYS = [
    ("", "t"),
    ("[" * 100_000, "t"),
    ('{"a": {"b": [1]}, "a.b": [2]}', "a.b"),
    ('{"t": [1]}', 1),
    ('{"t": [1]}', "F"),
    ('{"t": [1]}', Column("t", occurrence=2)),
    ('{"t": [1, 2]}', Column("t", index=2)),
    ('{"m": [[1, 2], [3, 4], [5, 6]]}', "m"),
    ('{"m": [[1, 2], [3, 4]]}', Column("m", index=1)),
    ('{"m": [[[1, 2], [3, 4]], [[5, 6], [7, 8]]]}', "m"),
    ('{"m": [[1, 2], [3]]}', "m"),
    ('{"t": [1, true]}', "t"),
    ('{"t": [1, 1e999]}', "t"),
    ('{"t": [1, null]}', "t"),
    ('{"t": [1], "t": [2]}', "t"),
    ('{"t": []}', "t"),
    (f'{{"t": [1{"0" * 400}]}}', "t"),
]

FORMATS = [
    {"delimiter": ""},
    {"delimiter": ",", "decimal": ","},
    {"decimal": []},
    {"header": True},
    {"encoding": "base64"},
    {"comment": "-"},
    {"transposed": "yes"},
    {"block": (1, 2)},
    {"broken": "mend"},
    {"sheet": 0},
]

UNITS = [
    (None, ["V"], ["N", "Pa"]),
    (None, ["kN", "N"], ["N"]),
    (None, ["kN", "1.1 kN"], ["N"]),
    (None, ["degC"], ["K"]),
    (None, ["qq"], ["N"]),
    ("mm", [], ["N"]),
]


def text(path, content, columns, options):
    """Read columns of a text."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    options = dict(options)
    unit, missing = options.pop("unit", "s"), options.pop("missing", False)
    wanted = {
        str(number): name if isinstance(name, Column) else Column(name)
        for number, name in enumerate(columns)
    }
    return read_table(path, wanted, dict.fromkeys(wanted, unit), Format(**options), missing=missing)


def binary_files(folder):
    """Files of arrays with contents that are not columns, and the names of these."""
    import h5py
    import netCDF4
    from scipy.io import savemat

    with h5py.File(folder / "f.h5", "w") as file:
        file["complex"], file["text"], file["empty"] = 1j * np.arange(3), "kN", h5py.Empty("f8")
        file["link"], file["mm"] = h5py.SoftLink("/nowhere"), np.arange(3.0)
        file["mm"].attrs["units"] = np.bytes_("mm")
        file["scaled"] = np.arange(3.0)
        file["scaled"].attrs["scale_factor"] = 2.0
    for name in ("complex", "text", "empty", "link", "mm", "scaled"):
        yield folder / "f.h5", name
    with netCDF4.Dataset(folder / "f.nc", "w") as file:
        file.createDimension("t", 2)
        file.createVariable("letters", "S1", ("t",))
        file.createVariable("lists", file.createVLType("f8", "list"), ("t",))
    yield folder / "f.nc", "letters"
    yield folder / "f.nc", "lists"
    savemat(
        folder / "f.mat",
        {"flag": np.array([True, False]), "m": np.ones((6, 3)), "wide": np.ones((3, 6))},
    )
    yield folder / "f.mat", "flag"
    yield folder / "f.mat", "m"
    yield folder / "f.mat", Column("wide", index=2)


def all_messages(folder):
    """One line for each case: the case, and its message."""

    def line(case, call):
        with pytest.raises(InputError) as refused:
            call()
        return f"{str(case)[:150]}\n    {refused.value}\n"

    yield from (
        line((c, *rest), lambda c=c, rest=rest: text(folder / "f.txt", c, *rest))
        for c, *rest in TEXTS
    )
    for content, column in ARRAYS:
        (folder / "f.json").write_text(content, encoding="utf-8")
        wanted = column if isinstance(column, Column) else Column(column)
        yield line(
            (content[:40], column),
            lambda wanted=wanted: read_table(folder / "f.json", {"t": wanted}, {"t": "s"}),
        )
    for path, column in binary_files(folder):
        wanted = column if isinstance(column, Column) else Column(column)
        yield line(
            (path.name, column),
            lambda path=path, wanted=wanted: read_table(path, {"t": wanted}, {"t": "s"}),
        )
    yield from (line(layout, lambda layout=layout: Format(**layout)) for layout in FORMATS)
    yield from (line(case, lambda case=case: resolve_unit(*case, "column 'F'")) for case in UNITS)


def test_messages_are_those_of_the_reviewed_file(tmp_path):
    assert "\n".join(all_messages(tmp_path)) == GOLDEN.read_text(encoding="utf-8")


def test_messages_of_files_of_another_type(tmp_path):
    for name in ("none.csv", "a\0b", "n" * 5000, "none.json"):
        with pytest.raises(InputError, match="there is no such file"):
            describe(tmp_path / name)
    (tmp_path / "f.h5").write_bytes(b"CDF\1" + bytes(40))
    (tmp_path / "f.h5").rename(tmp_path / "a.txt")
    for path in (tmp_path, tmp_path / "a.txt"):
        with pytest.raises(InputError, match=f"^{path.name}: is "):
            describe(path)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        GOLDEN.write_text("\n".join(all_messages(Path(folder))), encoding="utf-8")
