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
    write(found, tmp_path / "sweep.csv")
    with (tmp_path / "sweep.csv").open(encoding="utf-8", newline="") as stream:
        lines = list(csv.reader(stream))
    assert lines[0] == ["first", "load [N]", "drift [m]", "failure"]
    assert lines[1:4] == [["a", "0.01", "1e-09", ""], ["a", "0.02", "2e-09", ""], ["a", "0.03", "nan", "µ"]]
    assert len(lines) == len(list(rows(found))) == 7


def test_it_is_told_in_a_few_lines(found):
    assert dict(summary(found)) == {
        "cells": "6",
        "first of the scenario": "a, b",
        "load of the scenario": "10 mN to 30 mN",
        "drift": "1 nm to 5 nm",
        "failed": "1 cell; the first: µ",
    }
