"""What is recorded, and the file that it is streamed to."""

import errno
import os
import shutil
from contextlib import contextmanager
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from conventions import conventions, discovery
from golden import refused
from pairs import UNIT as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.basics.files import replacing
from historysim.loads import schedule
from historysim.recording import netcdf, recorder
from historysim.recording.netcdf import FileRecorder
from historysim.recording.recorder import DatasetRecorder, chosen_asperities
from historysim.recording.variables import SLIDE_TIME, Changes, recorded_variables

HEIGHTS = [-0.03, 0.0, -0.5, -0.01, -0.04]
EVENTS = [
    hs.NormalLoad(0.0, 0.03),
    hs.TangentialLoad(0.0, 0.0),
    hs.TangentialLoad(1.0, 0.006),
    hs.FrictionChange(1.5, 0.45),
    hs.NormalLoad(2.0, 0.002),
    hs.TangentialLoad(2.0, -0.0002),
    hs.NormalDisplacement(3.0, 0.05),
    hs.TangentialDisplacement(3.0, 0.01),
    hs.NormalLoad(4.0, 0.0),
]
GEOMETRY = ("normal_load", "tangential_load", "contact_radius", "stick_radius")
TOTALS, PER_ASPERITY = recorded_variables(Changes())

SCENARIO = """
title = "five summits"
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "summits"
height = [-0.03, 0.0, -0.5, -0.01, -0.04]
radius = 1.0
{positions}
[friction]
coefficient = 0.5
[loading]
substeps = 3
waypoints = [
    {{ time = 0, normal_load = 0.03, tangential_load = 0 }},
    {{ time = 1, tangential_load = 0.006 }},
    {{ time = 1.5, friction = 0.45 }},
    {{ time = 2, normal_load = 0.002, tangential_load = -0.0002 }},
    {{ time = 3, normal_displacement = 0.05, tangential_displacement = 0.01 }},
    {{ time = 4, normal_load = 0 }},
]
[record]
asperities = {record}
"""
POSITIONS = "x = [0, 1, 2, 3, 4]\ny = [0, 0, 0, 0, 0]"


@fixture
def ensemble():
    return hs.Ensemble(PAIR, HEIGHTS, 1.0, 0.5)


@fixture
def scenario(tmp_path):
    def write(record='"touching"', positions=POSITIONS):
        path = tmp_path / "five.toml"
        path.write_text(SCENARIO.format(record=record, positions=positions), encoding="utf-8")
        return path

    return write


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def fill(target, plan):
    """Replay into a recorder; return the last state."""
    state = target.ensemble.initial_state()
    asperities = () if target.asperities is None else target.asperities
    for stretch in plan:
        rows = target.blank(stretch.row_time.size)
        state = target.ensemble.advance_along(
            state, stretch.paths, rows=rows, asperities=asperities
        )
        if stretch.change is not None:
            state = target.ensemble.with_friction(state, stretch.change.friction)
        target.record(stretch.row_time)
    target.conclude(state)
    return state


def steps(plan):
    return sum(stretch.row_time.size for stretch in plan)


@contextmanager
def into(path, ensemble, asperities, count, attributes):
    with (
        replacing(path) as unfinished,
        FileRecorder(ensemble, asperities, count, unfinished, attributes) as target,
    ):
        yield target
        target.finish()


def stream(path, ensemble, events=EVENTS, record="touching", most_rows=None):
    plan = list(schedule.paths(events, 2, most_rows))
    asperities = chosen_asperities(ensemble, events, record)
    with into(path, ensemble, asperities, steps(plan), {"Conventions": "CF-1.11"}) as file:
        fill(file, plan)


def in_memory(ensemble, events=EVENTS, record="touching"):
    plan = list(schedule.paths(events, 2))
    target = DatasetRecorder(ensemble, chosen_asperities(ensemble, events, record), steps(plan))
    fill(target, plan)
    return target.dataset({"Conventions": "CF-1.11"})


# -- selections ------------------------------------------------------------------------------------


def touched(history):
    return history.asperity.values[(history.slip_state != 0).any("step").values].tolist()


def test_by_default_those_that_ever_touch_are_recorded(ensemble):
    everything = hs.replay(ensemble, EVENTS, record="all", hold=False)
    history = hs.replay(ensemble, EVENTS, hold=False)
    assert history.asperity.values.tolist() == touched(everything) == [0, 1, 3, 4]
    assert int(everything.contact_count.max()) == 4
    xr.testing.assert_identical(history, everything.sel(asperity=[0, 1, 3, 4]))


@mark.parametrize("seed", range(2))
def test_touching_are_exactly_those_that_touch_in_random_histories(seed):
    generator = np.random.default_rng(seed)
    ensemble = hs.Ensemble(
        PAIR, generator.normal(0.0, 0.1, 40), generator.uniform(0.5, 2.0, 40), 0.5
    )
    events = []
    for time in range(8):
        kind = generator.choice([hs.NormalLoad, hs.NormalDisplacement])
        value = (
            generator.uniform(0.0, 0.3) if kind is hs.NormalLoad else generator.uniform(-0.1, 0.2)
        )
        events += [kind(time, value), hs.TangentialDisplacement(time, generator.uniform(-0.1, 0.1))]
    everything = hs.replay(ensemble, events, record="all")
    assert chosen_asperities(ensemble, events, "touching").tolist() == touched(everything)
    assert ((everything.slip_state != 0).sum("asperity") == everything.contact_count).all()


def test_those_that_touch_between_two_rows_are_recorded(ensemble):
    events = [
        hs.NormalDisplacement(0.0, 0.005),
        hs.NormalDisplacement(0.0, 0.04),
        hs.NormalDisplacement(0.0, 0.005),
    ]
    assert chosen_asperities(ensemble, events, "touching").tolist() == [0, 1, 3]


@mark.parametrize(
    "record, expected",
    [
        ("all", [0, 1, 2, 3, 4]),
        ([3], [3]),
        (np.array([1, 4]), [1, 4]),
    ],
)
def test_all_or_a_chosen_few_are_recorded(ensemble, record, expected):
    everything = hs.replay(ensemble, EVENTS, record="all", hold=False)
    history = hs.replay(ensemble, EVENTS, record=record, hold=False)
    assert history.asperity.values.tolist() == expected
    xr.testing.assert_identical(history, everything.isel(asperity=expected))


def test_totals_alone_have_no_asperities(ensemble):
    history = hs.replay(ensemble, EVENTS, record="totals", hold=False)
    assert set(history.dims) == {"step"}
    expected = recorded_variables(Changes(friction=True))[0]
    assert set(history.data_vars) == {variable.name for variable in expected}
    assert set(history.coords) == {"time"}
    assert not DatasetRecorder(ensemble, None, 10).blank(10).each


@mark.parametrize(
    "record",
    ["some", "", b"all", None, 0, [], [0.5], [True], np.array([True, False]), [[0]], [2**70]],
)
def test_other_selections_are_refused(ensemble, record):
    with refused(r"record is .*; expected 'touching', 'all', 'totals' or a list of asp"):
        chosen_asperities(ensemble, EVENTS, record)


@mark.parametrize(
    "record, message",
    [
        ([0, 5], r"record names asperity 5; expected indices from 0 to 4"),
        ([-1], r"record names asperity -1; expected indices from 0 to 4"),
        ([0, 1, 0], r"record names an asperity twice; expected indices from 0 to 4, each once"),
    ],
)
def test_indices_that_cannot_be_recorded_are_named(ensemble, record, message):
    with refused(message):
        chosen_asperities(ensemble, EVENTS, record)


# -- contents -----------------------------------------------------------------------------


def test_separated_asperities_hold_zero_and_the_flag(ensemble):
    history = hs.replay(ensemble, EVENTS, record="all", substeps=5, hold=False)
    apart = history.slip_state == 0
    below = history.separation >= history.summit_height
    assert (apart == below).all()
    assert 0 < int(apart.sum()) < apart.size
    for name in GEOMETRY:
        assert (history[name].values[apart.values] == 0.0).all()
        assert (history[name].where(~apart, 1.0) != 0.0).any()
    for name, values in history.drop_vars("slide_time").variables.items():
        assert np.isfinite(values.values.astype(float)).all(), name


def test_a_history_in_which_nothing_touches_has_all_variables(ensemble, tmp_path):
    events = [hs.NormalDisplacement(0.0, -1.0), hs.TangentialDisplacement(1.0, 0.1)]
    with pytest.warns(UserWarning, match="touch"):
        history = hs.replay(ensemble, events)
    assert dict(history.sizes) == {"step": 2, "asperity": 0}
    assert set(history.data_vars) == {
        variable.name for variable in (*TOTALS, *PER_ASPERITY, SLIDE_TIME)
    }
    stream(tmp_path / "nothing.nc", ensemble, events)
    with xr.open_dataset(tmp_path / "nothing.nc") as opened:
        assert dict(opened.sizes) == {"step": 3, "asperity": 0}
        assert set(opened.data_vars) == set(history.data_vars)


# -- states are only looked at ---------------------------------------------------------------------


# -- the file --------------------------------------------------------------------------------------


CASES = {
    "totals": ('"totals"', POSITIONS),
    "instrument": ('"all"', f"{POSITIONS}\n[instrument]\nlateral_stiffness = 3.34"),
}


@mark.parametrize("case", CASES)
def test_the_file_follows_the_cf_conventions(case, scenario, tmp_path):
    path = tmp_path / "out.nc"
    hs.run(scenario(*CASES[case]), path).close()
    assert conventions(path) == ([], [])
    with xr.open_dataset(path) as opened:
        assert opened.attrs["Conventions"] == "CF-1.11, ACDD-1.3"
        # a coordinate variable is monotonic
        assert "asperity" not in opened.coords or (np.diff(opened.asperity.values) > 0).all()
    with netCDF4.Dataset(path) as file:
        for variable in file.variables.values():
            assert not {"_FillValue", "missing_value"} & set(variable.ncattrs())
        assert "standard_name" not in file["time"].ncattrs()
        assert file["time"].units == "s"
        assert not any(dimension.isunlimited() for dimension in file.dimensions.values())
        assert set(file["separation"].coordinates.split()) == {"time"}
        flags = {name for name in file.variables if "flag_values" in file[name].ncattrs()}
        assert flags == {"saturated"} | ({"slip_state"} if case != "totals" else set())
        assert all(file[name].dtype == file[name].flag_values.dtype == np.int8 for name in flags)
        if case == "instrument":
            assert {"time", "summit_height", "friction", "x", "y"} <= set(
                file["slip_state"].coordinates.split()
            )


def test_the_file_says_what_a_catalogue_asks_for(scenario, tmp_path):
    path = tmp_path / "out.nc"
    hs.run(scenario(), path).close()
    assert discovery(path, "highly recommended") == []
    with netCDF4.Dataset(path, "a") as file:
        file.delncattr("keywords")
        file["separation"].delncattr("coverage_content_type")
    assert discovery(path, "highly recommended") == [
        "keywords not present",
        'variable "separation" missing the following attributes: coverage_content_type',
    ]


@mark.parametrize("block", [1, 5, 1 << 21])
@mark.parametrize("record", ['"touching"', '"totals"'])
def test_a_streamed_file_is_the_dataset_bit_for_bit(scenario, tmp_path, monkeypatch, block, record):
    monkeypatch.setattr(recorder, "CELLS_AT_ONCE", block)
    sizes = []
    original = netcdf.FileRecorder.record
    monkeypatch.setattr(
        netcdf.FileRecorder,
        "record",
        lambda self, times: (sizes.append(times.size), original(self, times))[1],
    )
    path = scenario(record)
    expected = hs.run(path)
    with hs.run(path, tmp_path / "out.nc") as found:
        del found.attrs["date_created"]
        xr.testing.assert_identical(found.load(), expected)
        for name in expected.variables:
            assert found[name].values.tobytes() == expected[name].values.tobytes(), name
    assert sum(sizes) == expected.sizes["step"]
    columns = expected.sizes.get("asperity", 1)
    assert max(sizes) < max(block // columns, 1) + 3
    assert block > 5 or len(sizes) > 2


# -- finished or not there -------------------------------------------------------------------------


def test_complete_is_the_last_thing_written(ensemble, tmp_path, monkeypatch):
    path = tmp_path / "out.nc"
    plan = list(schedule.paths(EVENTS))
    moved = []
    replace = Path.replace

    def watched(self, target):
        with netCDF4.Dataset(self) as file:
            moved.append((self.parent, file.ncattrs()[-1], file.complete, file["time"][-1]))
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", watched)
    with into(path, ensemble, None, steps(plan), {"Conventions": "CF-1.11"}) as file:
        fill(file, plan)
        file.flush()
        (unfinished,) = tmp_path.iterdir()
        # rows stand in it, and it does not say that it is a result
        assert np.float64(4.0).tobytes() in unfinished.read_bytes()
        assert file._file.complete == 0
        assert not path.exists()
    assert moved == [(tmp_path, "complete", 1, 4.0)]
    with xr.open_dataset(path) as opened:
        assert opened.attrs["complete"] == 1
        assert opened.attrs["complete"].dtype == np.int8
    assert list(in_memory(ensemble).attrs)[-1] == "complete"


def test_a_disk_without_room_is_reported_before_anything_is_computed(
    ensemble, tmp_path, monkeypatch
):
    path = tmp_path / "out.nc"
    path.write_bytes(b"an older result")
    monkeypatch.setattr(
        netcdf.shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10**9, 10**9, 20_000)
    )
    job = hs.Replay(ensemble, EVENTS, record="all", substeps=2000, hold=False)
    monkeypatch.setattr(hs.Replay, "walk", lambda *_, **__: pytest.fail("it was computed"))
    with raises(
        OSError, match=r"the result needs 3\.\d MB more, and 0\.0 MB are free; make room"
    ) as caught:
        job.write(path)
    assert caught.value.errno == errno.ENOSPC
    assert caught.value.filename == str(path)
    assert path.read_bytes() == b"an older result"
    assert names(tmp_path) == ["out.nc"]


@mark.skipif(os.name != "posix", reason="needs the limit of POSIX on the size of files")
def test_a_full_disk_is_an_error_that_names_the_file(ensemble, tmp_path):
    import resource

    stream(tmp_path / "small.nc", ensemble)
    path = tmp_path / "out.nc"
    path.write_bytes(b"an older result")
    plan = list(schedule.paths(EVENTS, 20_000))
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)

    def overflow():
        with into(path, ensemble, np.arange(5), steps(plan), {}) as file:
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, limits[1]))
            fill(file, plan)

    try:
        with raises(OSError, match="the file is too large for this disk or a limit") as caught:
            overflow()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert str(path) in str(caught.value)
    assert path.read_bytes() == b"an older result"
    assert names(tmp_path) == ["out.nc", "small.nc"]


def test_two_asperities_under_a_law_of_their_loads_have_their_own_friction():
    ensemble = hs.Ensemble(PAIR, [0.0, -0.01], 1.0, hs.laws.PowerLaw(0.4, 0.01, -0.3))
    history = hs.replay(ensemble, [hs.NormalLoad(0.0, 0.02)], record="all")
    assert np.ptp(history.present_friction.values) > 0
