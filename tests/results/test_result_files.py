"""What a file is, and the program's own netCDF files, opened."""

import netCDF4
import numpy as np
import pytest

import historysim as hs
from historysim.errors import InputError
from historysim.log.event_log import EventLog
from historysim.results.result_files import kind_of, open_result, read_table

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)
EVENTS = [
    hs.NormalLoad(0.0, 0.1),
    *(hs.TangentialDisplacement(float(time), (-1) ** time * 1e-7) for time in range(1, 5)),
]


@pytest.fixture
def folder(tmp_path):
    hs.Replay(BALL, EVENTS, substeps=50).write(tmp_path / "r.nc")
    hs.loops(hs.replay(BALL, EVENTS, substeps=50)).to_dataset().to_netcdf(tmp_path / "l.nc")
    EventLog.create(tmp_path / "r.history", BALL, EVENTS).close()
    hs.sliding(hs.replay(BALL, EVENTS[:2], substeps=50)).to_dataset().to_netcdf(tmp_path / "s.nc")
    hs.write_netcdf(hs.replay(BALL, EVENTS).contact.slip_shares(), tmp_path / "t.nc")
    np.savetxt(tmp_path / "map.txt", np.eye(4))
    with netCDF4.Dataset(tmp_path / "stranger.nc", "w") as stranger:
        stranger.createDimension("x", 1)
    (tmp_path / "cut.nc").write_bytes((tmp_path / "r.nc").read_bytes()[:2000])
    return tmp_path


def test_files_are_told_apart(folder):
    names = {"s.toml": "scenario", "r.nc": "result", "l.nc": "loops", "r.history": "log", "map.txt": "height map"}
    names |= {"s.nc": "sliding", "t.nc": "table"}
    assert {name: kind_of(folder / name) for name in names} == names
    # maps come as netCDF, too
    assert kind_of(folder / "stranger.nc") == "height map"


def test_the_program_s_own_files_are_opened(folder):
    with open_result(folder / "r.nc") as history:
        assert history.sizes["step"] == 201
    assert read_table(folder / "l.nc").sizes == {"loop": 1, "direction": 2}


@pytest.mark.parametrize(
    ("name", "said"),
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
def test_what_is_no_result_is_told_as_what_it_is(folder, name, said):
    with pytest.raises(InputError, match=said), open_result(folder / name):
        pass


def test_what_is_not_there_is_nothing(tmp_path):
    with pytest.raises(InputError, match="there is no such file; expected a scenario, a result of historysim run, its"):
        kind_of(tmp_path / "none")
    with pytest.raises(InputError, match="is a folder; expected a scenario"):
        kind_of(tmp_path)
