"""What a file is, and the program's own netCDF files."""

import gc
import inspect

import h5py
import netCDF4
import numpy as np
from pairs import STIFF as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.errors import InputError
from historysim.log.event_log import EventLog
from historysim.recording.netcdf import FileRecorder
from historysim.results.analysis import history_summary
from historysim.results.result_files import file_type, open_file_history, open_result, read_table

pytestmark = mark.ci

BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)
EVENTS = [
    hs.NormalLoad(0.0, 0.1),
    *(hs.TangentialDisplacement(float(time), (-1) ** time * 1e-7) for time in range(1, 5)),
]
ROUGH = hs.Ensemble(PAIR, [0.0, -5e-9, -9e-9], 1e-5, 0.2)
JOB = hs.Replay(ROUGH, [hs.NormalLoad(0.0, 1e-3), hs.TangentialDisplacement(1.0, 8e-9)], substeps=3)


@fixture(scope="module")
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


def test_file_types_are_recognised(folder):
    names = {
        "s.toml": "scenario",
        "r.nc": "result",
        "l.nc": "loops",
        "r.history": "log",
        "map.txt": "height map",
    }
    # maps are netCDF files, too
    names |= {"s.nc": "sliding", "t.nc": "table", "h.nc": "table", "stranger.nc": "height map"}
    assert {name: file_type(folder / name) for name in names} == names
    with open_result(folder / "r.nc") as history:
        assert history.sizes["step"] == 201
    assert read_table(folder / "l.nc").sizes == {"loop": 1, "direction": 2}


@mark.parametrize(
    "name, message",
    [
        ("none.nc", "there is no such file"),
        (".", "is a folder"),
        ("map.txt", "is not a netCDF file"),
        ("l.nc", "is a file of friction loops"),
        ("t.nc", "is a table"),
        ("stranger.nc", "is not a finished result of historysim run"),
        ("cut.nc", "is damaged"),
    ],
)
def test_an_error_names_the_type_of_a_file_that_is_not_a_result(folder, name, message):
    for reader in (open_result, open_file_history):
        with raises(InputError, match=message), reader(folder / name):
            pass


def test_damage_that_is_met_while_reading_is_reported(tmp_path):
    path = tmp_path / "out.nc"
    # compressed chunks have checksums
    with JOB.recorder(
        FileRecorder, path=path, attributes=JOB.attributes(), compression="zlib"
    ) as target:
        JOB.walk(target)
        target.finish()
    with h5py.File(path) as file:
        _, chunk = file["tangential_displacement"].id.read_direct_chunk((0,))
    content = bytearray(path.read_bytes())
    content[content.index(chunk)] ^= 1
    path.write_bytes(content)
    damaged = raises(hs.InputError, match=r"out\.nc: is damaged \(NetCDF: .*\); make it again")
    with damaged, open_result(path) as recorded:
        history_summary.summary(recorded)


SUMMITS = PAIR, [0.0, -5e-9, -9e-9], 1e-5, 0.2
APPROACH = np.linspace(0.0, 4e-8, 9)
CURVE = 1e4 * APPROACH[:, np.newaxis]
MOVES = [
    hs.NormalDisplacement(0.0, 3e-8),
    hs.TangentialDisplacement(1.0, 3e-8),
    hs.TangentialDisplacement(2.0, -3e-8),
]


@mark.parametrize(
    "ensemble, events, options",
    [
        (ROUGH, MOVES, {"record": "touching"}),
        (ROUGH, MOVES, {"record": "totals"}),
        (ROUGH, MOVES, {"record": [2]}),
        (
            ROUGH,
            [*MOVES, hs.FrictionChange(2.5, 0.1), hs.TangentialLoad(3.0, 0.1)],
            {"saturate": True, "hold": False},
        ),
        (ROUGH, [MOVES[0], hs.TangentialDisplacement(1.0, (3e-8, 1e-8))], {}),
        (
            hs.Ensemble(*SUMMITS, wear=hs.wear.ArchardWear(coefficient=1e-2, hardness=1e9)),
            MOVES,
            {},
        ),
        (
            hs.Ensemble(
                *SUMMITS, yielding=hs.yielding.KogutEtsion(hardness=1e8, poissons_ratio=0.25)
            ),
            MOVES,
            {},
        ),
        (hs.InclinedEnsemble(*SUMMITS, slope=[0.1, -0.2, 0.05]), MOVES, {}),
        (
            hs.Patches.from_normal_curves(PAIR, APPROACH, CURVE, area=CURVE, friction=0.2),
            MOVES,
            {},
        ),
        (hs.Patches.from_normal_curves(PAIR, APPROACH, CURVE, friction=0.2), MOVES, {}),
    ],
)
def test_a_file_and_its_dataset_have_one_summary(tmp_path, ensemble, events, options):
    path = tmp_path / "out.nc"
    job = hs.Replay(ensemble, events, **options)
    job.write(path)
    with open_file_history(path) as file:
        lines = history_summary.summary_lines(file)
    assert lines == history_summary.summary(job.dataset())
    assert [*hs.show(path)] == lines
    with hs.open(path) as history:
        assert [*hs.show(path, attributes=True)] == [*hs.show(history, attributes=True)]


@mark.parametrize("name", ["r.nc", "r.history", "t.nc"])
def test_an_open_file_is_held_by_no_suspended_generator(folder, name):
    # the garbage collector would end the generator at any allocation, also while this thread holds
    # a lock of xarray
    content = hs.open(folder / name)
    generators = [each for each in gc.get_objects() if inspect.isgenerator(each)]
    suspended = [
        each for each in generators if inspect.getgeneratorstate(each) == inspect.GEN_SUSPENDED
    ]
    assert [
        each.__qualname__ for each in suspended if "historysim/" in each.gi_code.co_filename
    ] == []
    if hasattr(content, "close"):
        content.close()


def test_a_closed_result_can_be_replaced(folder, tmp_path):
    path = tmp_path / "again.nc"
    path.write_bytes((folder / "r.nc").read_bytes())
    history = hs.open(path)
    steps = history.sizes["step"]
    history.close()
    hs.Replay(BALL, EVENTS[:2], substeps=1).write(path)
    with hs.open(path) as history:
        assert history.sizes["step"] == 2 < steps
