"""Exports of instruments, unedited: the right numbers, or a message that names what is missing."""

import exports
import numpy as np
import pytest

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table

UNITS = {"time": "s", "normal": "N", "friction": "N", "stroke": "m"}


@pytest.fixture
def file(tmp_path):
    return tmp_path / "export.txt"


def read(file, content, columns, units=None, **layout):
    file.write_text(content, encoding="utf-8")
    wanted = {key: name if isinstance(name, Column) else Column(name) for key, name in columns.items()}
    return read_table(file, wanted, units or {key: UNITS[key] for key in columns}, Format(**layout))


@pytest.mark.parametrize("name", exports.EXPORTS)
def test_every_export_gives_its_numbers(file, name):
    content, columns, layout = exports.EXPORTS[name]
    found = read(file, content, columns, **layout).columns
    expected = {"time": exports.TIME, "normal": exports.NORMAL, "friction": exports.FRICTION, "stroke": exports.STROKE}
    for key, factor in (("time", 1.0), ("normal", 1e-3), ("friction", 1e-3), ("stroke", 1e-6)):
        np.testing.assert_allclose(found[key], np.multiply(expected[key], factor), rtol=1e-15)


@pytest.mark.parametrize("name", exports.EXPORTS)
def test_every_export_is_listed_with_its_units(file, name):
    content, _, layout = exports.EXPORTS[name]
    file.write_text(content, encoding="utf-8")
    block = 2 if name == "a summary table above" else None
    listings = describe(file, Format(block=block, **{key: value for key, value in layout.items() if key != "block"}))
    assert [listing.unit for listing in listings] == ["s", "mN", "mN", "µm"]


STEPS = exports.step(1) + exports.step(2)
COLUMNS = {"time": "Time", "normal": "Fz"}


def test_several_blocks_are_refused_with_what_they_are(file):
    with pytest.raises(InputError) as refused:
        read(file, STEPS, COLUMNS)
    message = str(refused.value)
    assert "has 2 blocks; choose one, as in block = 2; seen: block 1 in lines 5 to 8" in message
    assert "block 2 in lines 13 to 16: Time [s], Fz [mN], Fx [mN], X [µm] (first row: 0, 10, 0, 0)" in message
    with pytest.raises(InputError, match="there is no block 3; seen: block 1 in lines 5 to 8"):
        read(file, STEPS, COLUMNS, block=3)


def test_sheets_of_excel_are_read_as_texts(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    book = openpyxl.Workbook()
    for line in ("Step 1", "", "Time\tFz", "s\tmN"):
        book.active.append(line.split("\t"))
    for time, load in zip(exports.TIME, exports.NORMAL, strict=True):
        book.active.append([time, load])
    path = tmp_path / "a.xlsx"
    book.save(path)
    wanted = {"time": Column("Time"), "normal": Column("Fz")}
    table = read_table(path, wanted, UNITS)
    assert table.columns["time"].tolist() == exports.TIME
    np.testing.assert_allclose(table.columns["normal"], np.multiply(exports.NORMAL, 1e-3), rtol=1e-15)
    assert [listing.unit for listing in describe(path)] == ["s", "mN"]
    book.create_sheet("Other").append(["x", 1])
    book.save(path)
    with pytest.raises(
        InputError, match=r"has 2 sheets that are not empty; say which, as in sheet = 1 .or --sheet 1.; seen: 'Sheet'"
    ):
        read_table(path, wanted, UNITS)
    assert read_table(path, wanted, UNITS, Format(sheet="Sheet")).columns["time"].tolist() == exports.TIME
    with pytest.raises(InputError, match="there is no sheet 3; seen"):
        read_table(path, wanted, UNITS, Format(sheet=3))
    path.write_bytes(b"nothing")
    with pytest.raises(InputError, match="is damaged, or no Excel file"):
        describe(path)


def test_a_broken_row_is_named_or_left_out(file):
    content = "t [s],Fn [mN]\n0,1\n1\n2,3\n3,x\n4,5\n"
    columns = {"time": "t", "normal": "Fn"}
    with pytest.raises(
        InputError, match=r"line 3: 1 value where .*, or broken = \"drop\" leaves out 2 of 5 rows .line 3, 5."
    ):
        read(file, content, columns)
    table = read(file, content, columns, broken="drop")
    np.testing.assert_allclose(table.columns["normal"], [1e-3, 3e-3, 5e-3])
    assert table.notices == ("broken rows left out: 2 of 5 rows (line 3, 5)",)
    with pytest.raises(InputError, match="if it has a decimal comma"):
        read(file, content.replace(",", ";").replace("x", "1,5"), columns, broken="drop")


@pytest.mark.parametrize(
    ("values", "shared"),
    [
        (["1", "-1x", "2", "-2x"], "2 of 4 rows (line 3, 5), all of them negative"),
        (["1", "OVER", "2", "OVER"], "2 of 4 rows (line 3, 5), all of them 'OVER'"),
        (["1", "a", "b", "c", "2"], "3 of 5 rows (line 3, 4, 5), in one piece"),
    ],
)
def test_dropping_is_not_advised_where_the_broken_rows_have_something_in_common(file, values, shared):
    content = "t [s],Fn [mN]\n" + "".join(f"{row},{value}\n" for row, value in enumerate(values))
    columns = {"time": "t", "normal": "Fn"}
    with pytest.raises(InputError) as caught:
        read(file, content, columns)
    expected = f'; mend it in the file; broken = "drop" would leave out {shared}, and the rest is another record'
    assert str(caught.value).endswith(expected)
    assert read(file, content, columns, broken="drop").notices == (f"broken rows left out: {shared}",)


def test_what_stands_below_the_table_is_told(file):
    table = read(file, exports.step(1) + "TotalTime\n00:13:39\n", COLUMNS)
    assert table.notices == ("the lines below the table are left out: 'TotalTime'",)


def test_grams_are_forces_when_it_is_said(file):
    content = "t;F\ns;g\n0;1\n1;2\n"
    columns = {"time": "t", "normal": "F"}
    with pytest.raises(InputError, match=r"'g' is not a unit of a force.*say unit = \"gf\""):
        read(file, content, columns)
    table = read(file, content, columns | {"normal": Column("F", "gf")})
    np.testing.assert_allclose(table.columns["normal"], [9.80665e-3, 2 * 9.80665e-3], rtol=1e-15)
    assert table.notices == ("column 'F': 'g' in the file, taken as 'gf', as unit says",)


@pytest.mark.parametrize(
    ("header", "wanted", "said"),
    [
        ("Zeit [s],F", "zeit", "did you mean 'Zeit [s]'?"),
        ("Zeit [s],F", "Time", "expected one of Zeit [s], F"),
        ("F [N],F [V]", "F", "'F' may be any of the columns 'F [N]' at position 1, 'F [V]' at position 2; expected"),
    ],
)
def test_a_name_that_is_not_there_or_not_alone(file, header, wanted, said):
    with pytest.raises(InputError) as refused:
        read(file, f"{header}\n0,1\n1,2\n", {"time": wanted})
    assert said in str(refused.value)
