"""Files of sweeps: what other tools read, and tables."""

import csv

import h5py
import numpy as np
import pytest
import xarray as xr

from historysim.results.sweeps import rows, summary, write


@pytest.fixture
def found():
    told = {"units": "m", "long_name": "drift, ± of it"}
    load = {"units": "N", "long_name": "load of the scenario"}
    first = {"long_name": "first of the scenario"}
    return xr.Dataset(
        {
            "drift": (("first", "load"), [[1e-9, 2e-9, np.nan], [3e-9, 4e-9, 5e-9]], told),
            "time": (("first", "load", "step"), np.zeros((2, 3, 4))),
            "failure": (("first", "load"), [["", "", "µ"], ["", "", ""]]),
        },
        {"first": ("first", ["a", "b"], first), "load": ("load", [0.01, 0.02, 0.03], load)},
        {
            "scenario": 'title = "µ"',
            "swept_keys": "first load",
            "content": "sweep",
            "empty": "",
            "complete": np.int8(1),
        },
    )


def test_texts_are_characters_for_any_tool_and_the_numbers_stay(found, tmp_path):
    before = found.copy(deep=True)
    write(found, tmp_path / "sweep.nc")
    assert found.identical(before)
    with h5py.File(tmp_path / "sweep.nc") as file:
        for holder, name in ((file, "scenario"), (file, "date_created"), (file["drift"], "long_name")):
            assert not holder.attrs.get_id(name).get_type().is_variable_str()
    with xr.open_dataset(tmp_path / "sweep.nc", decode_times=False) as read:
        xr.testing.assert_equal(read.load().astype(found.dtypes), found)
        for name, variable in found.variables.items():
            assert read[name].attrs.items() >= variable.attrs.items()
        assert read.attrs.items() >= found.attrs.items()
        assert len(read.attrs["date_created"]) == 20


def test_a_table_has_a_row_for_each_cell(found, tmp_path):
    write(found.drop_vars("time"), tmp_path / "sweep.csv")
    with (tmp_path / "sweep.csv").open(encoding="utf-8", newline="") as stream:
        lines = list(csv.reader(stream))
    assert lines[0] == ["first", "load [N]", "drift [m]", "failure"]
    assert lines[1:4] == [["a", "0.01", "1e-09", ""], ["a", "0.02", "2e-09", ""], ["a", "0.03", "nan", "µ"]]
    assert len(lines) == len(list(rows(found, steps=False))) == 7


def test_a_table_has_a_row_for_each_step_and_asperity(found, tmp_path):
    """Steps that a cell does not have are left out; one that has failed keeps one row, with the reason."""
    load = np.full((2, 3, 2, 2), np.nan)
    load[0, 0] = [[1.0, 2.0], [3.0, 4.0]]
    load[0, 1, 0] = [5.0, 6.0]
    load[1] = 7.0
    own = found.drop_vars("time").assign(normal_load=(("first", "load", "step", "asperity"), load, {"units": "N"}))
    own = own.assign_coords(time=("step", [0.0, 0.5], {"units": "s"}), asperity=("asperity", [3, 8]))
    write(own, tmp_path / "sweep.csv")
    with (tmp_path / "sweep.csv").open(encoding="utf-8", newline="") as stream:
        heading, *lines = list(csv.reader(stream))
    names = ["first", "load [N]", "step", "asperity", "time [s]", "drift [m]", "failure", "normal_load [N]"]
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


def test_it_is_told_in_a_few_lines(found):
    assert dict(summary(found)) == {
        "cells": "6",
        "first of the scenario": "a, b",
        "load of the scenario": "10 mN to 30 mN",
        "drift": "1 nm to 5 nm, 1 missing",
        "failed": "1 cell; the first: µ",
    }
