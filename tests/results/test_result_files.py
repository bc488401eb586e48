"""What a file is, and the program's own netCDF files, opened with xarray and without."""

import h5py
import netCDF4
import numpy as np
import pytest

import historysim as hs
from historysim.asperities.wear import ArchardWear
from historysim.errors import InputError
from historysim.log.event_log import EventLog
from historysim.recording.netcdf import FileRecorder
from historysim.results.analysis import history_summary
from historysim.results.result_files import kind_of, open_result, read_table

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)
EVENTS = [
    hs.NormalLoad(0.0, 0.1),
    *(hs.TangentialDisplacement(float(time), (-1) ** time * 1e-7) for time in range(1, 5)),
]
HEIGHT = [0.0, -5e-9, -9e-9]
LOADS = [
    hs.NormalLoad(0.0, 1e-3),
    hs.TangentialDisplacement(1.0, 8e-9),
    hs.FrictionChange(2.0, [0.2, 0.1, 0.3]),
    hs.TangentialDisplacement(3.0, 1e-9),
]
APPROACH = np.linspace(0.0, 1e-7, 9)
CURVE = hs.Ensemble.from_normal_curves(PAIR, APPROACH, 1e9 * APPROACH**1.5, friction=0.2)
ROUGH = hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2)
WEARING = hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2, wear=ArchardWear(coefficient=1e-4, hardness=6e9))
JOBS = {
    "friction that changes": hs.Replay(ROUGH, LOADS, substeps=3),
    "one friction": hs.Replay(ROUGH, LOADS[:2], substeps=3),
    "shapes that change": hs.Replay(WEARING, LOADS[:2]),
    "totals alone": hs.Replay(ROUGH, LOADS[:2], record="totals"),
    "some of all": hs.Replay(ROUGH, LOADS[:2], record=[1]),
    "patches": hs.Replay(CURVE, LOADS[:2]),
    "nothing touches": hs.Replay(ROUGH, [hs.NormalDisplacement(0.0, -1e-9)]),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    hs.Replay(BALL, EVENTS, substeps=50).write(folder / "r.nc")
    history = hs.replay(BALL, EVENTS, substeps=50)
    hs.loops(history).to_dataset().to_netcdf(folder / "l.nc")
    EventLog.create(folder / "r.history", BALL, EVENTS).close()
    hs.sliding(hs.replay(BALL, EVENTS[:2], substeps=50)).to_dataset().to_netcdf(folder / "s.nc")
    hs.write_netcdf(history.contact.slip_shares(), folder / "t.nc")
    hs.write_netcdf(history.contact.time_series(), folder / "h.nc")
    np.savetxt(folder / "map.txt", np.eye(4))
    with netCDF4.Dataset(folder / "stranger.nc", "w") as stranger:
        stranger.createDimension("x", 1)
    (folder / "cut.nc").write_bytes((folder / "r.nc").read_bytes()[:2000])
    return folder


def test_files_are_told_apart(folder):
    names = {"s.toml": "scenario", "r.nc": "result", "l.nc": "loops", "r.history": "log", "map.txt": "height map"}
    # maps are netCDF files, too
    names |= {"s.nc": "sliding", "t.nc": "table", "h.nc": "table", "stranger.nc": "height map"}
    assert {name: kind_of(folder / name) for name in names} == names
    with open_result(folder / "r.nc") as history:
        assert history.sizes["step"] == 201
    assert read_table(folder / "l.nc").sizes == {"loop": 1, "direction": 2}


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.nc", "there is no such file; expected a result of historysim run"),
        (".", "is a folder; expected a result of historysim run"),
        ("map.txt", "is not a netCDF file; expected a result of historysim run"),
        ("l.nc", "is a file of friction loops; expected a result of historysim run"),
        ("t.nc", "is a table; expected a result of historysim run"),
        ("stranger.nc", "is not a finished result of historysim run"),
        ("cut.nc", "is damaged"),
    ],
)
def test_an_error_says_what_a_file_is_instead_of_a_result(folder, name, message):
    with pytest.raises(InputError, match=message), open_result(folder / name):
        pass


@pytest.mark.parametrize(("name", "message"), [("none", "there is no such file"), ("", "is a folder")])
def test_a_file_that_is_none_has_no_kind(tmp_path, name, message):
    with pytest.raises(InputError, match=f"{message}; expected a scenario, a result of historysim run, its log"):
        kind_of(tmp_path / name)


@pytest.mark.parametrize("job", JOBS.values(), ids=JOBS)
def test_the_summary_of_a_file_is_that_of_its_dataset(tmp_path, job):
    job.write(tmp_path / "out.nc")
    with open_result(tmp_path / "out.nc") as recorded:
        assert history_summary.summary(recorded) == history_summary.summary(job.dataset())


def test_damage_that_is_met_while_reading_is_reported(tmp_path):
    path = tmp_path / "out.nc"
    job = JOBS["one friction"]
    # compressed chunks have checksums
    with job.recorder(FileRecorder, path=path, attributes=job.attributes(), compression="zlib") as target:
        job.walk(target)
        target.finish()
    with h5py.File(path) as file:
        _, chunk = file["tangential_displacement"].id.read_direct_chunk((0,))
    content = bytearray(path.read_bytes())
    content[content.index(chunk)] ^= 1
    path.write_bytes(content)
    damaged = pytest.raises(hs.InputError, match=r"out\.nc: is damaged \(NetCDF: .*\); make it again")
    with damaged, open_result(path) as recorded:
        history_summary.summary(recorded)
