"""Exports of instruments, unedited: names, units and values are found."""

import exports
import numpy as np
import pytest
from numpy.testing import assert_allclose
from pytest import importorskip, raises

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table

UNITS = {"time": "s", "normal": "N", "friction": "N", "stroke": "m"}
FACTORS = {"time": 1.0, "normal": 1e-3, "friction": 1e-3, "stroke": 1e-6}
EXPECTED = {
    "time": exports.TIME,
    "normal": exports.NORMAL,
    "friction": exports.FRICTION,
    "stroke": exports.STROKE,
}


@pytest.fixture
def file(tmp_path):
    return tmp_path / "export.txt"


def read(file, content, columns, **layout):
    file.write_text(content, encoding="utf-8")
    wanted = {
        key: name if isinstance(name, Column) else Column(name) for key, name in columns.items()
    }
    return read_table(file, wanted, {key: UNITS[key] for key in columns}, Format(**layout))


@pytest.mark.parametrize("name", exports.EXPORTS)
def test_every_export_gives_its_numbers_and_units(file, name):
    content, columns, layout = exports.EXPORTS[name]
    table = read(file, content, columns, **layout)
    for key, factor in FACTORS.items():
        assert_allclose(table.columns[key], np.multiply(EXPECTED[key], factor), rtol=1e-15)
    block = 2 if name == "a summary table above" else None
    listings = describe(file, Format(**{"block": block, **layout}))
    assert [listing.unit for listing in listings] == ["s", "mN", "mN", "µm"]


def test_a_block_is_chosen_and_the_rest_of_the_text_is_noticed(file):
    content = (
        exports.step(1)
        + exports.step(2).replace("\n0\t10\t", "\n0\t99\t")
        + "TotalTime\n00:13:39\n"
    )
    for block, first, line in ((1, 10e-3, 5), (2, 99e-3, 13)):
        table = read(file, content, {"normal": "Fz"}, block=block)
        assert (table.columns["normal"][0], table.columns["normal"].size) == (
            pytest.approx(first),
            4,
        )
        assert table.lines[0] == line
        blocks, footer = table.notices
        assert blocks.startswith(f"block {block} is read, 1 block with 4 rows left out: ")
        assert footer == "the lines below the table are left out: 'TotalTime'"


def test_sheets_of_excel_are_read_as_texts(tmp_path):
    openpyxl = importorskip("openpyxl")
    importorskip("python_calamine")
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
    assert_allclose(table.columns["normal"], np.multiply(exports.NORMAL, 1e-3), rtol=1e-15)
    assert [listing.unit for listing in describe(path)] == ["s", "mN"]
    book.create_sheet("Other").append(["x", 1])
    book.save(path)
    assert (
        read_table(path, wanted, UNITS, Format(sheet="Sheet")).columns["time"].tolist()
        == exports.TIME
    )
    for sheet, message in (
        (None, "has 2 sheets that are not empty"),
        (3, "there is no sheet 3; seen: Sheet "),
    ):
        with raises(InputError, match=message):
            read_table(path, wanted, UNITS, Format(sheet=sheet))


def test_broken_rows_are_dropped_on_request_with_a_notice(file):
    content = "t [s],Fn [mN]\n0,1\n1\n2,3\n3,x\n4,5\n"
    table = read(file, content, {"time": "t", "normal": "Fn"}, broken="drop")
    assert_allclose(table.columns["normal"], [1e-3, 3e-3, 5e-3])
    assert table.notices == ("broken rows left out: 2 of 5 rows (line 3, 5)",)
    negative = "t [s],Fn [mN]\n0,1\n1,-1x\n2,2\n3,-2x\n"
    table = read(file, negative, {"time": "t", "normal": "Fn"}, broken="drop")
    assert table.notices == ("broken rows left out: 2 of 4 rows (line 3, 5), all of them negative",)
    with raises(InputError, match="decimal comma"):
        read(
            file,
            content.replace(",", ";").replace("x", "1,5"),
            {"time": "t", "normal": "Fn"},
            broken="drop",
        )


def test_the_reading_of_a_balance_is_a_force_in_its_unit(file):
    table = read(file, "t;F\ns;g\n0;1\n1;2\n", {"time": "t", "normal": Column("F", "gf")})
    assert_allclose(table.columns["normal"], [9.80665e-3, 2 * 9.80665e-3], rtol=1e-15)
    assert table.notices == ("column 'F': 'g' in the file, taken as 'gf', as unit says",)


@pytest.mark.parametrize(
    "cell, decimal",
    [(f"1{mark}236,07", ",") for mark in ".'’ \xa0\u202f\u2009"]
    + [("1,236.07", "."), ("1'236.07", "."), ("1.236", ",")],
)
@pytest.mark.parametrize("broken", ["refuse", "drop"])
def test_marks_of_thousands_are_named_and_no_rows_are_dropped(file, cell, decimal, broken):
    content = "t;F [mN]\n" + "".join(f"{row};{cell if row > 4 else 5}\n" for row in range(40))
    with raises(InputError, match="export it without separators between thousands") as refused:
        read(file, content, {"time": "t", "normal": "F"}, decimal=decimal, broken=broken)
    assert "broken" not in str(refused.value)


def test_dropping_is_not_advised_for_many_rows(file):
    content = "t;F [mN]\n" + "".join(f"{row};{'x' * (row % 3) or 1}\n" for row in range(40))
    with raises(InputError, match="not readable: 26 of 40 rows") as refused:
        read(file, content, {"time": "t", "normal": "F"})
    assert 'broken = "drop"' not in str(refused.value)
