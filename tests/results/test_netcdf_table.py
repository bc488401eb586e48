"""Tables as netCDF files: what any tool reads, and catalogues."""

import shutil
import subprocess

import h5py
import numpy as np
import pytest
import xarray as xr
from conventions import conventions, discovery

import historysim as hs
from historysim.results import netcdf_table

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
EVENTS = [hs.NormalLoad(0.0, 0.1)]
EVENTS += [hs.TangentialDisplacement(float(time), (-1) ** time * 2e-7) for time in range(1, 5)]


@pytest.fixture(scope="module")
def history():
    return hs.replay(hs.Ensemble(PAIR, [0.0, -5e-9], 1e-3, 0.2), EVENTS, substeps=20)


@pytest.mark.parametrize("at_once", [1 << 20, 7])
def test_a_history_over_time_comes_back(history, tmp_path, monkeypatch, at_once):
    monkeypatch.setattr(netcdf_table, "CELLS_AT_ONCE", at_once)
    series = history.contact.time_series()
    assert "step" not in series.dims
    hs.write_netcdf(series, tmp_path / "t.nc")
    with xr.open_dataset(tmp_path / "t.nc", decode_times=False) as found:
        assert found.sizes == {"elapsed_time": 81, "asperity": 2}
        assert found["elapsed_time"].values.tolist() == history["time"].values.tolist()
        for name, variable in history.data_vars.items():
            assert np.array_equal(found[name].values, variable.values)
    assert conventions(tmp_path / "t.nc") == ([], [])
    # what CDO takes for the axis of time: a dimension that may grow, with a coordinate in s
    with h5py.File(tmp_path / "t.nc") as file:
        assert file["elapsed_time"].maxshape == (None,)
        assert file["elapsed_time"].attrs["units"] == b"s"


CDO = shutil.which("cdo")


@pytest.mark.skipif(CDO is None, reason="no CDO; apt-get install cdo")
def test_cdo_takes_time_for_its_axis(history, tmp_path):
    hs.write_netcdf(history.contact.time_series(), tmp_path / "t.nc")
    told = subprocess.run(
        [CDO, "-s", "showtimestamp", "t.nc"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    # which it tells in whole seconds
    seconds = [float(text.rsplit(":", 1)[1]) for text in told.stdout.split()]
    assert np.floor(seconds).tolist() == np.floor(history["time"].values).tolist()
    one = [CDO, "-s", "outputf,%.17g", "-selname,total_tangential_load", "t.nc"]
    values = subprocess.run(one, cwd=tmp_path, capture_output=True, text=True, check=True).stdout.split()
    assert [float(value) for value in values] == history["total_tangential_load"].values.tolist()


def test_one_asperity_has_a_row_for_each_time(history):
    series = history.contact.time_series(1)
    assert {variable.dims for variable in series.data_vars.values()} == {("elapsed_time",)}
    assert np.array_equal(series["normal_load"].values, history["normal_load"].values[:, 1])
    with pytest.raises(hs.InputError, match="asperity 7: is not recorded in the history; expected one of 0, 1"):
        history.contact.time_series(7)


def test_tables_say_what_a_catalogue_asks_for(history, tmp_path):
    answers = {
        "shares": history.contact.slip_shares(),
        "cycles": history.contact.energy_per_cycle(),
        "loops": history.contact.friction_loops().to_dataset(),
    }
    for name, answer in answers.items():
        before = answer.copy(deep=True)
        hs.write_netcdf(answer, tmp_path / f"{name}.nc")
        assert answer.identical(before)
        assert conventions(tmp_path / f"{name}.nc") == ([], [])
        assert discovery(tmp_path / f"{name}.nc", "highly recommended") == []
    # texts are characters, also where they are labels
    with h5py.File(tmp_path / "loops.nc") as file:
        assert file["direction"].dtype == "S1"
        assert not file["direction"].attrs.get_id("_Encoding").get_type().is_variable_str()
    with xr.open_dataset(tmp_path / "loops.nc", decode_times=False) as found:
        forward = answers["loops"]["friction_force"].sel(direction="forward").values
        assert np.array_equal(found["friction_force"].sel(direction="forward").values, forward)
        assert found["friction_force"].attrs["coverage_content_type"] == "modelResult"


def test_what_cannot_be_written_leaves_nothing(history, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        hs.write_netcdf(history, tmp_path / "nowhere" / "t.nc")
    assert list(tmp_path.iterdir()) == []
