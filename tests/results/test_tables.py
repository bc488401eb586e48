"""Tables as CSV and netCDF files, their reading by other tools and catalogues, and their summaries."""

import csv

import h5py
import numpy as np
import xarray as xr
from conventions import conventions, discovery
from golden import refused
from pairs import STIFF as PAIR
from pytest import fixture, mark

import historysim as hs
from historysim.results import tables
from historysim.results.tables import flat_columns, sweep_summary, write_sweep

EVENTS = [hs.NormalLoad(0.0, 0.1)]
EVENTS += [hs.TangentialDisplacement(float(time), (-1) ** time * 2e-7) for time in range(1, 5)]
TABLE = xr.Dataset(
    {
        "energy": (("loop", "asperity"), [[1.0, 2.0], [3.0, 4.5]], {"units": "J"}),
        "ratio": ("loop", [0.25, np.nan], {"units": "1"}),
        "other": ("asperity", [1.0, 2.0]),
    },
    {"loop": [3, 4], "asperity": [7, 9], "start_time": ("loop", [0.0, 1.5], {"units": "s"})},
)
SPREAD = xr.Dataset(
    {"drift": (("load", "seed", "quantile"), np.arange(8.0).reshape(2, 2, 2), {"units": "m"})},
    {"load": ("load", [0.1, 0.2], {"units": "N"}), "quantile": [0.05, 0.95]},
)


@fixture(scope="module")
def history():
    return hs.replay(hs.Ensemble(PAIR, [0.0, -5e-9], 1e-3, 0.2), EVENTS, substeps=20)


@fixture(scope="module")
def answers(history):
    return {
        "shares": history.contact.slip_shares(),
        "series": history.contact.time_series(),
        "cycles": history.contact.energy_per_cycle(),
        "loops": history.contact.friction_loops().to_dataset(),
        "slips": history.contact.slip_onset(),
    }


def read(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.reader(stream))


@mark.parametrize("at_once", [1 << 20, 5])
def test_a_row_for_each_member_of_the_first_dimension_and_others_in_the_header(
    tmp_path, monkeypatch, at_once
):
    monkeypatch.setattr(tables, "CELLS_AT_ONCE", at_once)
    hs.write_csv(TABLE, tmp_path / "t.csv")
    header, *rows = read(tmp_path / "t.csv")
    assert header == ["loop", "start_time [s]", "energy 7 [J]", "energy 9 [J]", "ratio"]
    assert rows == [["3", "0.0", "1.0", "2.0", "0.25"], ["4", "1.5", "3.0", "4.5", "nan"]]

    hs.write_csv(SPREAD, tmp_path / "t.csv")
    header, *rows = read(tmp_path / "t.csv")
    assert header == [
        "load [N]",
        *(f"drift {seed} {quantile} [m]" for seed in (0, 1) for quantile in (0.05, 0.95)),
    ]
    assert rows == [["0.1", "0.0", "1.0", "2.0", "3.0"], ["0.2", "4.0", "5.0", "6.0", "7.0"]]

    # an array is a table, too
    hs.write_csv(SPREAD["drift"].isel(seed=0, quantile=0, drop=True), tmp_path / "t.csv")
    assert read(tmp_path / "t.csv") == [["load [N]", "drift [m]"], ["0.1", "0.0"], ["0.2", "4.0"]]


def test_no_string_is_a_formula_to_a_spreadsheet(tmp_path):
    formulas, others = ["=1+1", "+1", "-1 nm", "@SUM(A1)", "\tx", "\rx"], ["plain", "1 nm", ""]
    table = xr.Dataset(
        {
            "text": ("row", np.array([*formulas, *others], dtype=object)),
            "number": ("row", [-1.5] * 9),
        }
    )
    hs.write_csv(table, tmp_path / "t.csv")
    _, *rows = read(tmp_path / "t.csv")
    assert [text for text, _ in rows] == [*(f"'{text}" for text in formulas), *others]
    assert {number for _, number in rows} == {"-1.5"}


def test_written_tables_are_shown_drawn_and_reported_as_netcdf_only(answers, tmp_path):
    for name in ("shares", "series", "loops", "slips"):
        hs.write_netcdf(answers[name], tmp_path / f"{name}.nc")
        assert len(hs.show(tmp_path / f"{name}.nc")) > 2
    assert hs.plot(tmp_path / "shares.nc").axes
    assert "Its columns over the first one." in hs.report(tmp_path / "shares.nc")
    hs.write_csv(answers["shares"], tmp_path / "shares.csv")
    for verb in (hs.show, hs.plot, hs.report):
        with refused(r"is read as netCDF \(-o NAME\.nc\)"):
            verb(tmp_path / "shares.csv")


def test_columns_of_a_table_keep_names_units_and_numbers(answers):
    columns = flat_columns(answers["shares"])
    assert columns["time"].attrs["units"] == "s"
    own = answers["shares"]["share_of_contacts"].sel(slip_state="full_stick").values
    assert np.array_equal(columns["share_of_contacts full_stick"].values, own)


def test_a_table_without_numbers_to_draw_is_refused():
    table = xr.Dataset({"text": ("row", ["3", "one"])}, attrs={"content": "table"})
    with refused("needs at least two columns of numbers"):
        hs.plot(table)
    assert "needs at least two columns of numbers" in hs.report(table)


@mark.parametrize("at_once", [1 << 20, 7])
def test_a_history_over_time_is_read_back(history, tmp_path, monkeypatch, at_once):
    monkeypatch.setattr(tables, "CELLS_AT_ONCE", at_once)
    series = history.contact.time_series()
    assert "step" not in series.dims
    hs.write_netcdf(series, tmp_path / "t.nc")
    with xr.open_dataset(tmp_path / "t.nc", decode_times=False) as found:
        assert found.sizes == {"elapsed_time": 81, "asperity": 2}
        assert found["elapsed_time"].values.tolist() == history["time"].values.tolist()
        for name, variable in history.drop_vars("slide_time").data_vars.items():
            assert np.array_equal(found[name].values, variable.values)
    if at_once > 7:
        assert conventions(tmp_path / "t.nc") == ([], [])
    one = history.contact.time_series(1)
    assert {variable.dims for variable in one.data_vars.values()} == {("elapsed_time",)}
    assert np.array_equal(one["normal_load"].values, history["normal_load"].values[:, 1])
    with refused("asperity 7: is not recorded in the history"):
        history.contact.time_series(7)
    # what CDO takes for the axis of time: a dimension that may grow, with a coordinate in s
    with h5py.File(tmp_path / "t.nc") as file:
        assert file["elapsed_time"].maxshape == (None,)
        assert file["elapsed_time"].attrs["units"] == b"s"


@mark.ci
def test_tables_follow_the_conventions_of_catalogues(answers, tmp_path):
    for name in ("cycles", "loops"):
        before = answers[name].copy(deep=True)
        hs.write_netcdf(answers[name], tmp_path / f"{name}.nc")
        assert answers[name].identical(before)
        assert conventions(tmp_path / f"{name}.nc") == ([], [])
        assert discovery(tmp_path / f"{name}.nc", "highly recommended") == []
    # strings are characters, also where they are labels
    with h5py.File(tmp_path / "loops.nc") as file:
        assert file["direction"].dtype == "S1"
        assert not file["direction"].attrs.get_id("_Encoding").get_type().is_variable_str()
    with xr.open_dataset(tmp_path / "loops.nc", decode_times=False) as found:
        forward = answers["loops"]["friction_force"].sel(direction="forward").values
        assert np.array_equal(found["friction_force"].sel(direction="forward").values, forward)
        assert found["friction_force"].attrs["coverage_content_type"] == "modelResult"


@fixture
def sweep():
    drift = {"units": "m", "long_name": "drift, ± of it"}
    load = {"units": "N", "long_name": "load of the scenario"}
    return xr.Dataset(
        {
            "drift": (("first", "load"), [[1e-9, 2e-9, np.nan], [3e-9, 4e-9, 5e-9]], drift),
            "time": (("first", "load", "step"), np.zeros((2, 3, 4))),
            "failure": (("first", "load"), [["", "", "µ"], ["", "", ""]]),
        },
        {
            "first": ("first", ["a", "b"], {"long_name": "first of the scenario"}),
            "load": ("load", [0.01, 0.02, 0.03], load),
        },
        {
            "scenario": 'title = "µ"',
            "swept_keys": "first load",
            "content": "sweep",
            "empty": "",
            "complete": np.int8(1),
        },
    )


def test_strings_of_a_sweep_are_characters_and_the_numbers_stay(sweep, tmp_path):
    before = sweep.copy(deep=True)
    write_sweep(sweep, tmp_path / "sweep.nc")
    assert sweep.identical(before)
    with h5py.File(tmp_path / "sweep.nc") as file:
        for holder, name in (
            (file, "scenario"),
            (file, "date_created"),
            (file["drift"], "long_name"),
        ):
            assert not holder.attrs.get_id(name).get_type().is_variable_str()
    with xr.open_dataset(tmp_path / "sweep.nc", decode_times=False) as found:
        xr.testing.assert_equal(found.load().astype(sweep.dtypes), sweep)
        for name, variable in sweep.variables.items():
            assert found[name].attrs.items() >= variable.attrs.items()
        assert found.attrs.items() >= sweep.attrs.items()
        assert len(found.attrs["date_created"]) == 20


def test_a_sweep_has_a_row_for_each_step_and_asperity(sweep, tmp_path):
    """Steps that a cell does not have are left out; one that has failed keeps one row, with the reason."""
    load = np.full((2, 3, 2, 2), np.nan)
    load[0, 0] = [[1.0, 2.0], [3.0, 4.0]]
    load[0, 1, 0] = [5.0, 6.0]
    load[1] = 7.0
    own = sweep.drop_vars("time").assign(
        normal_load=(("first", "load", "step", "asperity"), load, {"units": "N"})
    )
    own = own.assign_coords(
        time=("step", [0.0, 0.5], {"units": "s"}), asperity=("asperity", [3, 8])
    )
    write_sweep(own, tmp_path / "sweep.csv")
    heading, *lines = read(tmp_path / "sweep.csv")
    names = [
        "first",
        "load [N]",
        "step",
        "asperity",
        "time [s]",
        "drift [m]",
        "failure",
        "normal_load [N]",
    ]
    assert heading == names
    assert lines[:4] == [
        ["a", "0.01", "0", "3", "0.0", "1e-09", "", "1.0"],
        ["a", "0.01", "0", "8", "0.0", "1e-09", "", "2.0"],
        ["a", "0.01", "1", "3", "0.5", "1e-09", "", "3.0"],
        ["a", "0.01", "1", "8", "0.5", "1e-09", "", "4.0"],
    ]
    assert [line[3:] for line in lines[4:7]] == [
        ["3", "0.0", "2e-09", "", "5.0"],
        ["8", "0.0", "2e-09", "", "6.0"],
        ["3", "0.0", "nan", "µ", "nan"],
    ]
    assert len(lines) == 4 + 2 + 1 + 3 * 4


def test_a_sweep_in_a_few_lines(sweep):
    assert dict(sweep_summary(sweep)) == {
        "cells": "6",
        "first of the scenario": "a, b",
        "load of the scenario": "10 mN to 30 mN",
        "drift": "1 nm to 5 nm, 1 missing",
        "failed": "1 cell; the first: µ",
    }
