"""Channels with separate start and rate, in each format that states them: joined by time, or refused."""

import datetime as dt
import json

import numpy as np
from golden import refused
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, importorskip, mark
from records import scenario_text

import historysim as hs
from historysim.tables import Column, read_table

INTERVAL, COUNT = 5e-3, 401
START = dt.datetime(2026, 1, 5, 10, 0, 0)  # noqa: DTZ001 - as in the file
# start [s] and interval [s] of the load
CASES = {
    "same": (0.0, INTERVAL),
    "later": (0.05, INTERVAL),
    "between samples": (0.0125, INTERVAL),
    "earlier": (-0.05, INTERVAL),
    "slower": (0.0, 2 * INTERVAL),
    "faster and later": (0.1, INTERVAL / 2),
}


def moved(time):
    return np.sin(2 * np.pi * time)


def load(time):
    return np.cos(2 * np.pi * time)


def write_tdms(path, channels):
    nptdms = importorskip("nptdms")
    objects = []
    for name, (values, start, interval) in channels.items():
        date = np.datetime64(START) + np.timedelta64(round(start * 1e6), "us")
        objects.append(
            nptdms.ChannelObject(
                "g", name, values, {"wf_start_time": date, "wf_increment": interval}
            )
        )
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(objects)
    return "g/{}"


def write_tdms_offset(path, channels):
    nptdms = importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(
                    "g", name, values, {"wf_start_offset": start, "wf_increment": interval}
                )
                for name, (values, start, interval) in channels.items()
            ]
        )
    return "g/{}"


def write_hdf5(path, channels):
    h5py = importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, (values, start, interval) in channels.items():
            file[f"g/{name}"] = values
            file[f"g/{name}"].attrs.update({"sample_rate": 1 / interval, "t0": start})
    return "g/{}"


def write_hdf5_groups(path, channels):
    h5py = importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, (values, start, interval) in channels.items():
            file[f"{name}/data"] = values
            date = (START + dt.timedelta(seconds=start)).isoformat()
            file[name].attrs.update({"wf_start_time": date, "wf_increment": interval})
    return "{}/data"


def write_netcdf(path, channels):
    import netCDF4

    with netCDF4.Dataset(path, "w") as file:
        for name, (values, start, interval) in channels.items():
            file.createDimension(f"of {name}", values.size)
            variable = file.createVariable(name, "f8", (f"of {name}",))
            variable[:] = values
            variable.setncatts({"dt": interval, "t0": start})
    return "{}"


def write_matlab(path, channels):
    from scipy.io import savemat

    tests = {
        name: {"data": values, "dt": dt, "t0": start}
        for name, (values, start, dt) in channels.items()
    }
    savemat(path, tests)
    return "{}.data"


def write_json(path, channels):
    document = {}
    for name, (values, start, interval) in channels.items():
        document |= {
            name: values.tolist(),
            f"{name}_dt": f"{1e3 * interval} ms",
            f"{name}_t0": start,
        }
    path.write_text(json.dumps(document), encoding="utf-8")
    return "{}"


FORMATS = {
    "a.tdms": write_tdms,
    "b.tdms": write_tdms_offset,
    "a.h5": write_hdf5,
    "b.h5": write_hdf5_groups,
    "a.nc": write_netcdf,
    "a.mat": write_matlab,
    "a.json": write_json,
}


def write(path, start, interval):
    of_load = load(start + interval * np.arange(COUNT))
    channels = {
        "u": (moved(INTERVAL * np.arange(COUNT)), 0.0, INTERVAL),
        "F": (of_load, start, interval),
    }
    return FORMATS[path.name](path, channels)


@mark.parametrize("case", CASES)
@mark.parametrize("name", FORMATS)
def test_channels_are_joined_by_time(name, case, tmp_path):
    start, interval = CASES[case]
    names = write(tmp_path / name, start, interval)
    columns = {"u": Column(names.format("u")), "F": Column(names.format("F"))}
    units = {"u": "m", "F": "N"}
    table = read_table(tmp_path / name, columns, units, by_time=True)
    time = INTERVAL * np.arange(COUNT)
    assert_array_equal(table.columns["u"], moved(time))
    if case == "same":
        assert table.inside is None
        assert_array_equal(table.columns["F"], load(time))
        return
    ends = start, start + interval * (COUNT - 1)
    inside = (time >= ends[0] - 1e-9) & (time <= ends[1] + 1e-9)
    assert_array_equal(table.inside, inside)
    # a straight line between samples misses the curve by its second derivative × interval²/8
    bound = (2 * np.pi * interval) ** 2 / 8 * 1.01 + 1e-9
    assert_allclose(table.columns["F"][inside], load(time)[inside], rtol=0, atol=bound)
    with refused(r"different times: .* starts at .*expected columns of the same times"):
        read_table(tmp_path / name, columns, units)


@mark.parametrize("name", ["a.tdms", "a.json"])
def test_a_scenario_joins_replay_and_response(name, tmp_path):
    start = 0.05
    names = write(tmp_path / name, start, INTERVAL)
    columns = {
        "time": None,
        "normal_load": '{ constant = "9 N" }',
        "tangential_displacement": f'"{names.format("u")}"',
    }
    response = {"tangential_load": f'"{names.format("F")}"'}
    text = scenario_text(columns=columns, response=response, file=name)
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    measurement = hs.load(tmp_path / "s.toml").measurement()
    time = measurement.time
    assert_allclose(time, np.arange(start, INTERVAL * (COUNT - 0.5), INTERVAL), atol=1e-9)
    assert_allclose(measurement["tangential_displacement"], moved(time), atol=1e-9)
    assert_allclose(measurement["tangential_load"], load(time), atol=1e-9)
    remarks = dict(measurement.remarks)
    assert "joined by time onto" in remarks["file"]
    assert remarks["outside the clocks of all channels"] == "10 samples, left out"


def test_times_of_tdms_channels_have_one_origin(tmp_path):
    write(tmp_path / "a.tdms", 0.05, INTERVAL)
    columns = {"t": Column("g/F/time")}
    table = read_table(tmp_path / "a.tdms", columns, {"t": "s"})
    assert table.columns["t"][0] == approx(0.05)


@mark.parametrize(
    "changes, problem",
    [
        ({"F_t0": 9.0}, "without a common time: .*expected times that overlap"),
        (
            {"F_start_time": "2026-01-05T10:00:00"},
            "with different times: .*expected start and interval of each",
        ),
        ({"w": [0.0] * COUNT}, "'w' has no start and interval"),
    ],
)
def test_channels_that_cannot_be_joined_are_refused(changes, problem, tmp_path):
    path = tmp_path / "a.json"
    write(path, 0.05, INTERVAL)
    path.write_text(
        json.dumps(json.loads(path.read_text(encoding="utf-8")) | changes), encoding="utf-8"
    )
    columns = {name: Column(name) for name in ("u", "F", *({"w"} & changes.keys()))}
    with refused(f"columns {problem}|{problem}"):
        read_table(path, columns, dict.fromkeys(columns, "1"), by_time=True)
