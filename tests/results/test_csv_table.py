"""Tables as CSV files."""

import csv

import numpy as np
import pytest
import xarray as xr

import historysim as hs
from historysim.errors import InputError
from historysim.results import csv_table
from historysim.results.csv_table import write_csv

TABLE = xr.Dataset(
    {
        "energy": (("loop", "asperity"), [[1.0, 2.0], [3.0, 4.5]], {"units": "J"}),
        "ratio": ("loop", [0.25, np.nan], {"units": "1"}),
        "other": ("asperity", [1.0, 2.0]),
    },
    {"loop": [3, 4], "asperity": [7, 9], "start_time": ("loop", [0.0, 1.5], {"units": "s"})},
)


def read(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.reader(stream))


@pytest.mark.parametrize("at_once", [1 << 20, 5])
def test_a_row_for_each_member_of_the_first_dimension(tmp_path, monkeypatch, at_once):
    monkeypatch.setattr(csv_table, "CELLS_AT_ONCE", at_once)
    write_csv(TABLE, tmp_path / "t.csv")
    header, *rows = read(tmp_path / "t.csv")
    assert header == ["loop", "start_time [s]", "energy 7 [J]", "energy 9 [J]", "ratio"]
    assert rows == [["3", "0.0", "1.0", "2.0", "0.25"], ["4", "1.5", "3.0", "4.5", "nan"]]


def test_members_of_further_dimensions_stand_in_the_header(tmp_path):
    spread = xr.Dataset(
        {"drift": (("load", "seed", "quantile"), np.arange(8.0).reshape(2, 2, 2), {"units": "m"})},
        {"load": ("load", [0.1, 0.2], {"units": "N"}), "quantile": [0.05, 0.95]},
    )
    write_csv(spread, tmp_path / "t.csv")
    header, *rows = read(tmp_path / "t.csv")
    assert header == ["load [N]", *(f"drift {seed} {quantile} [m]" for seed in (0, 1) for quantile in (0.05, 0.95))]
    assert rows == [["0.1", "0.0", "1.0", "2.0", "3.0"], ["0.2", "4.0", "5.0", "6.0", "7.0"]]


def test_an_array_is_a_table_too_and_numbers_come_back(tmp_path):
    pair = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
    history = hs.replay(hs.Ensemble(pair, 0.0, 1e-3, 0.2), [hs.NormalLoad(0.0, 0.1), hs.TangentialLoad(1.0, 0.011)])
    write_csv(history.contact.stick_ratio(), tmp_path / "c.csv")
    header, *rows = read(tmp_path / "c.csv")
    assert header == ["time [s]", "stick_ratio 0"]
    assert [float(row[1]) for row in rows] == history.contact.stick_ratio().values[:, 0].tolist()


def test_a_table_without_rows_is_refused(tmp_path):
    with pytest.raises(InputError, match="has no dimension"):
        write_csv(xr.Dataset({"a": 1.0}), tmp_path / "t.csv")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1 nm", "@SUM(A1)", "\tx", "\rx", "plain", "1 nm", ""])
def test_no_text_is_a_formula_to_a_spreadsheet(tmp_path, text):
    table = xr.Dataset({"text": ("row", np.array([text], dtype=object)), "number": ("row", [-1.5])})
    write_csv(table, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as stream:
        _, (told, number) = csv.reader(stream)
    assert told == (f"'{text}" if text[:1] in {"=", "+", "-", "@", "\t", "\r"} and text else text)
    assert number == "-1.5"
