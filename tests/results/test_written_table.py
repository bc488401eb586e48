"""Tables that commands have written: show, plot and report read what -o wrote."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import historysim as hs
from historysim.results.csv_table import write_csv
from historysim.results.written_table import WrittenTable, is_table

PAIR = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=8e9)
EVENTS = [hs.NormalLoad(0.0, 4e-3), *(hs.TangentialDisplacement(float(t), (-1) ** t * 30e-9) for t in range(1, 6))]


@pytest.fixture(scope="module")
def history():
    return hs.replay(hs.Ensemble(PAIR, [0.0, -20e-9], [10e-6, 30e-6], 0.2), EVENTS, substeps=8)


def tables(history):
    loops = hs.analysis.friction_loops(history)
    return {
        "shares": hs.analysis.slip_shares(history),
        "series": hs.analysis.time_series(history),
        "loops": loops.to_dataset(),
        "slips": hs.analysis.first_slips(history),
    }


@pytest.mark.parametrize("ending", [".csv", ".nc"])
@pytest.mark.parametrize("name", ["shares", "series", "loops", "slips"])
def test_what_was_written_is_shown_drawn_and_reported(history, tmp_path, name, ending):
    dataset, path = tables(history)[name], tmp_path / f"{name}{ending}"
    (write_csv if ending == ".csv" else hs.write_netcdf)(dataset, path)
    assert len(hs.show(path)) > 2
    assert hs.report(path).startswith("<!DOCTYPE html>")
    assert hs.plot(path).axes


def test_a_table_keeps_names_units_and_numbers(history, tmp_path):
    path = tmp_path / "shares.csv"
    dataset = tables(history)["shares"]
    write_csv(dataset, path)
    found = hs.open(path).columns
    assert found["time"].attrs["units"] == "s"
    own = dataset["share_of_contacts"].sel(slip_state="full_stick").values
    assert np.array_equal(found["share_of_contacts full_stick"].values, own)
    again = WrittenTable.of(dataset, "again").columns
    assert set(again) == set(found)
    for label, each in found.items():
        np.testing.assert_array_equal(each.values, again[label].values)


def test_ranges_have_units_and_say_what_is_missing(tmp_path):
    path = tmp_path / "t.csv"
    write_csv(xr.Dataset({"energy": ("loop", [1e-9, np.nan, 3e-9], {"units": "J"})}, {"loop": [0, 1, 2]}), path)
    assert dict(hs.show(path)) == {"table": "t.csv", "rows": "3", "loop": "0 to 2", "energy": "1 nJ to 3 nJ, 1 missing"}


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("m2", "2e-12 m2 to 3e-06 m2"), ("m-2", "2e-12 m-2 to 3e-06 m-2"), ("N m-1", "2 pN/m to 3 µN/m")],
)
@pytest.mark.parametrize("ending", [".csv", ".nc"])
def test_a_power_of_a_unit_has_no_prefix(tmp_path, ending, unit, expected):
    path = tmp_path / f"t{ending}"
    table = xr.Dataset({"value": ("loop", [2e-12, 3e-6], {"units": unit})})
    (write_csv if ending == ".csv" else hs.write_netcdf)(table, path)
    assert dict(hs.show(path))["value"] == expected


def test_a_file_of_somebody_else_is_no_table(tmp_path):
    path = tmp_path / "m.csv"
    path.write_bytes(b"1,2\r\n3,4\r\n")
    assert not is_table(path)
    path.write_bytes(b"time;load\n1;2\n")
    assert not is_table(path)


def test_a_row_of_another_length_is_told(tmp_path):
    path = tmp_path / "cut.csv"
    path.write_bytes(b"time [s],load [N]\r\n1,2\r\n3\r\n")
    with pytest.raises(hs.InputError, match=r"cut\.csv: line 3: 1 value; expected 2"):
        hs.show(path)


def test_a_table_without_numbers_has_no_picture(tmp_path):
    path = tmp_path / "texts.csv"
    path.write_bytes(b"label,text\r\nsteps,3\r\ntitle,one\r\n")
    with pytest.raises(hs.InputError, match="has no two columns of numbers"):
        hs.plot(path)
    assert "has no two columns of numbers" in hs.report(Path(path))
