"""Columns, formats, units, and the reader of texts. The other formats are in test_arrays.py."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx, fixture, mark, raises
from records_shared import SHARED

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table, text_rows
from historysim.tables.columns import field_unit, resolve_unit

DATA = SHARED
TRIAXIAL = DATA / "triaxial" / "TM11_Pc130_Pp50_T100_loading.tsv"
measured_files = mark.skipif(not DATA.is_dir(), reason="the folder of measured data is not there")


@fixture
def file(tmp_path):
    return tmp_path / "f.txt"


@fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("tables") / "f.txt"


def given_as(columns):
    return {
        str(column): column if isinstance(column, Column) else Column(column) for column in columns
    }


def values(path, content, columns, units="s", *, missing=False, **layout):
    """Columns of a text, as lists."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    wanted = given_as(columns)
    table = read_table(
        path, wanted, dict.fromkeys(wanted, units), Format(**layout), missing=missing
    )
    return [column.tolist() for column in table.columns.values()]


def refusal(path, content, columns, units="s", **arguments):
    with raises(InputError) as refused:
        values(path, content, columns, units, **arguments)
    return str(refused.value)


# -- where the columns are -------------------------------------------------------------------------


@mark.parametrize(
    "content, layout",
    [
        ("t,F\n0,1\n1,2\n", {}),
        ("  t    F\n 0.0   1\n  1    2\n", {}),
        ("t&F\n0&1\n1&2\n", {"delimiter": "&"}),
        ("t\x1fF\n0\x1f1\n1\x1f2\n", {"delimiter": "\x1f"}),
        ("\ufefft,F\n0,1\n1,2\n", {}),
        ("# t,F of old\nt,F\n# a remark\n0,1\n  # another\n1,2\n", {}),
        ("Date: 1\nLength (mm): 7, Width (mm): 8\nt,F\n0,1\n1,2\n", {}),
        ("7,8\nt,F\n0,1\n1,2\n", {"header": 2}),
        (",t,F\na,0,1\nb,1,2\n", {}),
        ('remark,t,F\n"a, ""b""",0,1\n,1,2\n', {}),
        ("t;F\n0,0;1,0\n1;2e0\n", {"decimal": ","}),
        ("t,F\n+0,1.\n1.0E+0,.2e1\n", {}),
    ],
)
def test_tables_in_many_forms(file, content, layout):
    assert values(file, content, ["t", "F"], **layout) == [[0.0, 1.0], [1.0, 2.0]]


def test_lines_are_counted_in_the_file(file):
    file.write_text("\nx\nt,F\n\n# a remark\n0,1\n\n1,2\n", encoding="utf-8")
    table = read_table(file, given_as(["t"]), {"t": "s"})
    assert table.lines.tolist() == [6, 8]
    assert [table.place(0), table.place(1)] == ["line 6", "line 8"]


@mark.parametrize(
    "content, columns, layout, expected",
    [
        ("0,1\n1,2.5\n", [2], {}, [[1.0, 2.5]]),
        ("0,5\n1,5\n", [1], {"decimal": ","}, [[0.5, 1.5]]),
        ("0,5;1\n1;2\n", [1], {"decimal": ","}, [[0.5, 1.0]]),
        ("t,F (kN)\n0,1\n1,2\n", [2], {"header": 0, "delimiter": ","}, [[1.0, 2.0]]),
        ("t,t,t\n0,1,2\n1,2,3\n", [Column("t", occurrence=2)], {}, [[1.0, 2.0]]),
        ("1024\n0,1,2\n1,2,3\n", [3], {"header": 1}, [[2.0, 3.0]]),
        ("2020-01-01 10:00,1\n2020-01-01 11:00,2\n", [2], {"delimiter": ","}, [[1.0, 2.0]]),
    ],
)
def test_columns_by_position_and_occurrence(file, content, columns, layout, expected):
    assert values(file, content, columns, **layout) == expected


# -- what the values are ---------------------------------------------------------------------------


def test_missing_values_are_nan_if_they_are_allowed(file):
    for word in ["", "nan", "NaN", "NAN", "NA", "null", "-"]:
        content = f"t,F\n0,1\n1,{word}\n2,3\n"
        _, force = values(file, content, ["t", "F"], missing=True)
        np.testing.assert_array_equal(force, [1.0, np.nan, 3.0])
        assert f"line 3, column 'F': {word!r}" in refusal(file, content, ["t", "F"])


@mark.parametrize(
    "cells, expected",
    [
        (["\u22121", "\u22122.5e\u22123", "3"], [-1, -2.5e-3, 3]),
        (["1.0D-03", "-2.5d+02", "3.D0"], [1e-3, -250, 3]),
        (["0", "\u221225 ms", "1.5D1 ms"], [0, -0.025, 0.015]),
    ],
)
@mark.parametrize("rows", [1, 3000])
def test_numbers_as_other_programs_write_them(file, cells, expected, rows):
    lines = [f"{row};{cell}\n" for row, cell in enumerate(cells)] + [
        f"{row};1 s\n" for row in range(3, rows)
    ]
    if "s" not in "".join(cells):
        lines = [line.replace(" s", "") for line in lines]
    [_, force] = values(file, "t;F\n" + "".join(lines), ["t", "F"])
    assert force[:3] == approx(expected, rel=1e-15)


@given(
    numbers=st.lists(
        st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 2), min_size=1, max_size=30
    ),
    delimiter=st.sampled_from([",", ";", "\t", "|", " ", "&"]),
    decimal=st.sampled_from([".", ","]),
    form=st.sampled_from(["{!r}", "{:.17e}", "{:+.20g}"]),
    batch=st.sampled_from([1, 3, 2000]),
)
def test_numbers_are_read_exactly(scratch, numbers, delimiter, decimal, form, batch):
    if delimiter == decimal:
        delimiter = ";"
    lines = [
        delimiter.join(form.format(number).replace(".", decimal) for number in row)
        for row in numbers
    ]
    content = "\n".join([delimiter.join(["t", "F"]), *lines])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text_rows, "BATCH_LINES", batch)
        found = values(scratch, content, ["t", "F"], delimiter=delimiter, decimal=decimal)
    assert list(zip(*found, strict=True)) == numbers


_ODD_CELLS = [
    "nan",
    "",
    "-",
    "inf",
    "1e400",
    "1_0",
    "0x1p3",
    "1d5",
    "\u22121",
    "\u0661",
    "OVER",
    "1,5",
    "1.5.2",
]
_ODD_CELLS += [
    '"2"',
    '"2',
    "3 s",
    "12:00:01",
    "# 4",
    "1#",
    " 5 ",
    "\x0c6",
    "\x007",
    "\xa08",
    "9e",
    ".5",
    "+6.",
]
_ODD_LINES = [
    "",
    "   ",
    "\t\t\t",
    "# a comment",
    "#1,2,3",
    "end of test",
    "1",
    "1,2,3,",
    "1,2,3,4",
    '"1\n2",3,4',
]


@given(
    cells=st.lists(
        st.lists(st.sampled_from(_ODD_CELLS) | st.just("7.25"), min_size=3, max_size=3), max_size=6
    ),
    lines=st.lists(st.tuples(st.integers(0, 12), st.sampled_from(_ODD_LINES)), max_size=2),
    columns=st.sampled_from([["a", "b"], ["c"], ["b"], ["c", "a"]]),
    delimiter=st.sampled_from([",", ";", "\t", " "]),
    layout=st.fixed_dictionaries(
        {
            "decimal": st.sampled_from([".", ","]),
            "broken": st.sampled_from(["refuse", "drop"]),
            "comment": st.sampled_from(["#", ""]),
        }
    ),
    missing=st.booleans(),
)
def test_the_fast_reader_and_the_others_agree(
    scratch, cells, lines, columns, delimiter, layout, missing
):
    if delimiter == layout["decimal"]:
        delimiter = ";"
    rows = [["1.5", "2", "3"], *cells, ["4", "5", "6e-3"], ["7", "8", "9"]]
    text = [delimiter.join(row) for row in rows]
    for index, line in lines:
        text.insert(index, line.replace(",", delimiter))
    scratch.write_text("\n".join([delimiter.join("abc"), *text]), encoding="utf-8")

    def outcome():
        try:
            table = read_table(
                scratch,
                given_as(columns),
                dict.fromkeys(columns, "s"),
                Format(delimiter=delimiter, **layout),
                missing=missing,
            )
        except InputError as error:
            return str(error)
        values = [column.tobytes() for column in table.columns.values()]
        return values, table.units, table.lines.tolist(), table.notices

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text_rows, "BATCH_LINES", 2)
        fast = outcome()
        patch.setattr(text_rows.RowParser, "_parse_plain", lambda *_: None)
        assert fast == outcome()


# -- encodings -------------------------------------------------------------------------------------


@mark.parametrize("encoding", ["utf-16", "cp1252", "utf-8", "utf-8-sig"])
def test_the_encoding_is_found(file, encoding):
    file.write_bytes("x (µm)\tF\r\n1\t2\r\n".encode(encoding))
    table = read_table(file, {"x": Column("x")}, {"x": "m"})
    assert table.columns["x"] == approx([1e-6])
    told = ("is not UTF-8, read as cp1252; if names or units look wrong, set encoding",)
    assert table.notices == (told if encoding == "cp1252" else ())


# -- clocks ----------------------------------------------------------------------------------------


@mark.parametrize(
    "rows, seconds",
    [
        (["9:59:59,25", "10:00:00,75"], [0, 1.5]),
        (["23:59:59", "00:00:01", "00:00:02"], [0, 2, 3]),
        (["28.02.2023 23:59:59", "1.3.2023 0:00:00"], [0, 1]),
        (["100:00:00", "101:00:00", ""], [0, 3600, math.nan]),
        (["11:59:59 PM", "12:00:01 AM", "12:00:02.5 am"], [0, 2, 3.5]),
        (
            ["2024-01-15T10:00:00+02:00", "2024-01-15T08:00:01.5Z", "2024-01-15T02:30:02-05:30"],
            [0, 1.5, 2],
        ),
    ],
)
@mark.parametrize("name", ["t (hh:mm:ss)"])
def test_clock_times_are_seconds_since_the_first_row(file, rows, seconds, name):
    file.write_text("\n".join([f"{name};F", *(f"{row};1" for row in rows)]), encoding="utf-8")
    table = read_table(file, {"t": Column("t")}, {"t": "s"}, missing=True)
    assert table.columns["t"] == approx(seconds, abs=1e-6, nan_ok=True)


# -- units -----------------------------------------------------------------------------------------


@mark.parametrize(
    "name, unit",
    [
        ("Force [kN]", "kN"),
        ("Force / kN", "kN"),
        ("Speed / (m/s)", "m/s"),
        ("Stiffness (N/(m s))", "N/(m s)"),
        ("Force_kN", None),
        ("Force/kN", None),
        ("N/mm", None),
        ("", None),
    ],
)
def test_units_in_names(name, unit):
    assert field_unit(name) == unit


@mark.parametrize(
    "explicit, in_file, wanted, expected",
    [
        (None, [], ["N"], ("N", 1.0)),
        ("1000 N", ["kN"], ["N"], ("N", 1000.0)),
        (None, ["MPa"], ["N", "Pa"], ("Pa", 1e6)),
        (None, ["kN", "1000 N"], ["N"], ("N", 1000.0)),
        ("mN", ["kN"], ["N"], ("N", 1e-3)),
        ("%", [], ["1"], ("1", 0.01)),
    ],
)
def test_the_unit_of_a_column(explicit, in_file, wanted, expected):
    unit, factor = resolve_unit(explicit, in_file, wanted, "column 'F'")
    assert (unit, factor) == (expected[0], approx(expected[1], rel=1e-12))


@mark.parametrize(
    "content",
    [
        "t [s],F (kN)\n0,1\n",
        "t\tF\n(s)\t(kN)\n0\t1\n",
        "run\n# of 1999\nt.(s),F.(kN)\n0,1\n",
    ],
)
def test_units_of_the_header_are_used(file, content):
    file.write_text(content, encoding="utf-8")
    found = read_table(file, {"t": Column(1), "F": Column(2)}, {"t": "s", "F": ("Pa", "N")})
    assert found.columns["F"].tolist() == [1000.0]
    assert found.units == {"t": "s", "F": "N"}


def test_a_unit_that_contradicts_the_header_holds_and_is_told(file):
    content = "t,F (kN)\n0,1\n"
    assert values(file, content, [Column("F (kN)", unit="1e3 N")], "N") == [[1000.0]]
    assert values(file, content, [Column("F (kN)", unit="N")], "N") == [[1.0]]
    told = {
        unit: read_table(file, {"F": Column("F", unit)}, {"F": "N"}).notices
        for unit in ("N", "1e3 N")
    }
    assert told == {
        "N": ("column 'F (kN)': 'kN' in the file, taken as 'N', as unit says",),
        "1e3 N": (),
    }
    assert refusal(file, content, ["F (kN)"], "m").startswith(
        "f.txt: column 'F (kN)': 'kN' is not a unit of a length"
    )


# -- listings --------------------------------------------------------------------------------------


@mark.parametrize(
    "content, expected",
    [
        ("run 7\nt,F (kN)\n0,1\n1,2\n", [('"t"', "", "2", "0"), ('"F (kN)"', "kN", "2", "1")]),
        (
            't,t,"a ""b"""\n0,1,2\n',
            [
                ('{ column = "t", occurrence = 1 }', "", "1", "0"),
                ('{ column = "t", occurrence = 2 }', "", "1", "1"),
                ('"a \\"b\\""', "", "1", "2"),
            ],
        ),
        (
            "t,F (kN),\n0,1,2\n",
            [
                ("{ column = 1 } # under 't'", "", "1", "0"),
                ("{ column = 2 } # under 'F (kN)'", "", "1", "1"),
                ("{ column = 3 }", "", "1", "2"),
            ],
        ),
    ],
)
def test_listings(file, content, expected):
    file.write_text(content, encoding="utf-8")
    assert [attrs.astuple(listing) for listing in describe(file)] == expected


# -- a measured record -----------------------------------------------------------------------------


def test_a_wide_table_names_each_of_its_columns(file, monkeypatch):
    count = 5000
    names = ["t", *(f"c{index} [N]" for index in range(count)), "t"]
    file.write_text(
        "\n".join(",".join(row) for row in (names, *(["1.5"] * (count + 2) for _ in range(3))))
    )
    found = [listing.column for listing in describe(file)]
    assert found[0] == '{ column = "t", occurrence = 1 }'
    assert found[1:-1] == [f'"c{index} [N]"' for index in range(count)]
    assert found[count + 1] == '{ column = "t", occurrence = 2 }'
    monkeypatch.setenv("HISTORYSIM_MOST_COLUMNS", "5000")
    with raises(InputError, match=r"f\.txt: has 5,00\d columns; expected 5,000 at most"):
        describe(file)


@measured_files
def test_the_triaxial_record():
    columns = {
        "t": Column(1, "s"),
        "p": Column(4, "MPa"),
        "F": Column(6, "kN"),
        "x": Column(8, "mm"),
    }
    table = read_table(TRIAXIAL, columns, {"t": "s", "p": ("N", "Pa"), "F": ("N", "Pa"), "x": "m"})
    expected = np.loadtxt(TRIAXIAL, skiprows=3, delimiter="\t", usecols=(0, 3, 5, 7), unpack=True)
    assert expected.shape == (4, 8663)
    for found, values_in_file, factor in zip(
        table.columns.values(), expected, (1, 1e6, 1e3, 1e-3), strict=True
    ):
        np.testing.assert_allclose(found, values_in_file * factor, rtol=1e-15)
    assert table.units == {"t": "s", "p": "Pa", "F": "N", "x": "m"}
    assert (table.lines[0], table.lines[-1]) == (4, 8666)
