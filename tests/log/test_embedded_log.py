"""A result is made again from itself alone, bit for bit."""

import shutil

import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr
from golden import refused

import historysim as hs
from historysim.log import result

pytestmark = pytest.mark.ci

HEAD = """
title = "µ"
[materials]
first = "silicon"
second = "float glass"
[friction]
coefficient = {friction}
[metadata]
license = "CC-BY-4.0"
"""
SUMMITS = '[surface]\nkind = "summits"\nheight = [0, -1e-8, -3e-8]\nradius = 1e-5\n'
ROUGH = """[surface]
kind = "random"
shape = [16, 16]
pixel_size = "1 µm"
rms_height = "20 nm"
autocorrelation_length = "4 µm"
seed = 1
"""
CURVE = '[surface]\nkind = "normal_curve"\nfile = "curve.csv"\ncolumns = { approach = "d", load = "P", area = "A" }\n'
MEASURED = '[loading]\nfile = "loads.csv"\ncolumns = { time = "t", normal_load = "N", tangential_displacement = "U" }\n'
WRITTEN = """[instrument]
lateral_stiffness = 3e5
[loading]
substeps = 3
waypoints = [
    { time = 0, normal_load = 0.004 },
    { time = 1, tangential_displacement = 2e-8 },
    { time = 2, normal_load = 0.003, tangential_displacement = -1e-8, friction = [0.1, 0.2, 0.3] },
    { time = 3, tangential_displacement = 1e-8, friction = 0.15 },
]
"""
CASES = {
    "summits": HEAD.format(friction=[0.2, 0.1, 0.3]) + SUMMITS + WRITTEN,
    "map": HEAD.format(friction=0.2) + ROUGH + MEASURED + '[record]\nasperities = "totals"\n',
    "curve": HEAD.format(friction=0.2) + CURVE + MEASURED,
}


@pytest.fixture(params=CASES)
def made(request, tmp_path):
    """A result whose scenario, log and files are gone."""
    (tmp_path / "from").mkdir()
    depth = np.linspace(0, 1e-7, 40)
    columns = np.column_stack([depth, 1e9 * depth**1.5, 1e-5 * depth])
    np.savetxt(tmp_path / "from" / "curve.csv", columns, delimiter=",", header="d,P,A", comments="")
    loads = [[0, 0, 0], [1, 2e-3, 0], [2, 2e-3, 1e-8], [3, 3e-3, -1e-8], [4, 3e-3, 2e-8]]
    np.savetxt(tmp_path / "from" / "loads.csv", loads, delimiter=",", header="t,N,U", comments="")
    (tmp_path / "from" / "s.toml").write_text(CASES[request.param], encoding="utf-8")
    hs.run(tmp_path / "from" / "s.toml", tmp_path / "my.nc").close()
    (tmp_path / "my.history").unlink()
    shutil.rmtree(tmp_path / "from")
    return tmp_path / "my.nc"


def content(path):
    """Contents of a file except the date."""
    with xr.open_datatree(path, decode_times=False) as tree:
        found = {group: node.to_dataset().load() for group, node in tree.subtree_with_keys}
    found["."].attrs.pop("date_created")
    return found


def check_same(first, second):
    one, other = content(first), content(second)
    assert set(one) == set(other)
    for name, dataset in one.items():
        assert dataset.identical(other[name])


def test_a_result_is_recomputed_from_its_own_file(made, tmp_path):
    hs.run(made, tmp_path / "again.nc", compression="zlib").close()
    check_same(made, tmp_path / "again.nc")
    assert hs.verify(made, tmp_path / "again.history")
    with xr.open_dataset(made, decode_times=False) as history:
        told = {name: value for name, value in history.attrs.items() if name != "date_created"}
        again = hs.run(made)
        assert again.attrs == told
        assert again.drop_attrs().identical(history.load().drop_attrs())
    # and again from a compressed one
    for path in (made, tmp_path / "again.nc"):
        with h5py.File(path) as file:
            # a title that is not ASCII, as characters that any tool shows
            assert not file.attrs.get_id("title").get_type().is_variable_str()
    hs.run(tmp_path / "again.nc", tmp_path / "third.nc").close()
    check_same(made, tmp_path / "third.nc")


@pytest.mark.parametrize("made", ["summits"], indirect=True)
class TestOfSummits:
    def test_events_that_were_appended_come_in_their_batches(self, made, tmp_path):
        hs.run(made, tmp_path / "longer.nc").close()
        with hs.EventLog(tmp_path / "longer.history") as log:
            log.append([hs.TangentialDisplacement(4.0, 0.0)])
            log.append([hs.TangentialDisplacement(5.0, 1e-8), hs.FrictionChange(6.0, 0.4)])
        hs.run(tmp_path / "longer.history", tmp_path / "longer.nc").close()
        hs.run(tmp_path / "longer.nc", tmp_path / "again.nc").close()
        check_same(tmp_path / "longer.nc", tmp_path / "again.nc")

    def test_sources_that_do_not_match_their_digest_are_refused(self, made, tmp_path):
        with netCDF4.Dataset(made, "a") as file:
            file["surface/log/event_value"][0] *= 1.5
        with refused("what it was made from does not match its digest"):
            hs.run(made, tmp_path / "again.nc")
        assert not (tmp_path / "again.nc").exists()
        assert not (tmp_path / "again.history").exists()

    def test_a_file_without_its_sources_is_refused(self, made, tmp_path):
        xr.Dataset({"a": 1.0}).to_netcdf(tmp_path / "other.nc")
        with refused("is a netCDF or HDF5 file, and no result of historysim run"):
            hs.run(tmp_path / "other.nc", tmp_path / "again.nc")
        (tmp_path / "half.nc").write_bytes(made.read_bytes()[:2000])
        with refused(r"half\.nc: is damaged"):
            hs.run(tmp_path / "half.nc", tmp_path / "again.nc")

    def test_it_resumes_from_the_log_of_the_same_run_only(self, made, tmp_path):
        hs.run(made, tmp_path / "again.nc").close()
        hs.run(made, tmp_path / "again.nc", resume=True).close()
        other = (
            HEAD.format(friction=0.1)
            + SUMMITS
            + "[loading]\nwaypoints = [{ time = 0, normal_load = 0.004 }]\n"
        )
        (tmp_path / "o.toml").write_text(other, encoding="utf-8")
        hs.run(tmp_path / "o.toml", tmp_path / "o.nc").close()
        with refused(r"was not made from .*o\.history, so the run cannot be resumed"):
            hs.run(made, tmp_path / "o.nc", resume=True)

    def test_a_large_result_is_reported_beforehand(self, made, tmp_path, monkeypatch):
        told = []
        hs.run(made, tmp_path / "again.nc", notify=told.append).close()
        assert told == []
        monkeypatch.setattr(result, "LARGE", 1000)
        hs.run(made, tmp_path / "again.nc", notify=told.append).close()
        size = (tmp_path / "again.nc").stat().st_size
        assert told[0].endswith(
            f"again.nc: will take {size / 1e6:,.0f} MB, for 10 steps and 3 asperities; fewer asperities "
            '(record.asperities, "totals" for none), fewer substeps or --compression make it smaller'
        )
