"""What a file is, by its first bytes."""

import sqlite3
from contextlib import closing

import h5py
import netCDF4
import pytest

from historysim.basics.file_kinds import is_log, is_netcdf


def test_logs_are_told_from_results(tmp_path):
    with closing(sqlite3.connect(tmp_path / "log")) as connection:
        connection.execute("CREATE TABLE one (number INTEGER)")
    assert is_log(tmp_path / "log")
    assert not is_netcdf(tmp_path / "log")


@pytest.mark.parametrize("form", ["NETCDF4", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA"])
def test_every_form_of_netcdf_is_known(tmp_path, form):
    netCDF4.Dataset(tmp_path / "result", "w", format=form).close()
    assert is_netcdf(tmp_path / "result")
    assert not is_log(tmp_path / "result")


def test_other_hdf5_begins_as_netcdf_does(tmp_path):
    h5py.File(tmp_path / "map.h5", "w").close()
    assert is_netcdf(tmp_path / "map.h5")


def test_anything_else_is_neither(tmp_path):
    (tmp_path / "text").write_text("SQLite format 3", encoding="utf-8")
    (tmp_path / "empty").touch()
    for path in (tmp_path / "text", tmp_path / "empty", tmp_path / "none", tmp_path, tmp_path / "a\0b"):
        assert not is_log(path)
        assert not is_netcdf(path)
