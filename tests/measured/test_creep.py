"""Creep in holds in addition to the contact's memory: records of the engine, whose contact creeps by a known law."""

import re

import attrs
import numpy as np
from click.testing import CliRunner
from held import STIFF, Holds, contact
from pytest import approx, mark, param, raises

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError
from historysim.measured.creep import separate_creep

pytestmark = mark.ci

RECORDS = {
    "plain": {},
    "noise of the displacement": {"displacement_noise": 3e-9, "load_noise": 2e-5},
    "sensor that drifts": {"sensor": 5e-8, "load_noise": 2e-5},
    "load that falls a little": {"fall": 0.03},
    "load that falls much": {"fall": 0.1},
    "early onset": {"onset": 0.05},
    "late onset": {"onset": 5.0},
}
FIRST = ("sensor that drifts", "load that falls a little")  # at a third of the samples


def creep(seed=0, **shape):
    return separate_creep(Holds(**shape).record(seed), contact(), STIFF)


@mark.parametrize(
    "name, rate",
    [
        *((name, 3.0) for name in FIRST),
        *(param(name, 10.0, marks=mark.slow) for name in RECORDS),
    ],
)
def test_creep_is_found_within_five_percent(name, rate):
    record = Holds(**RECORDS[name], rate=rate)
    found = creep(**RECORDS[name], rate=rate)
    assert not found.unknown
    assert found.per_decade.value == approx(record.creep, rel=0.05)
    assert found.onset == approx(record.onset, rel=0.2)
    assert found.sensor_drift.low < record.sensor < found.sensor_drift.high
    # the parts add up to what was measured, but for noise
    assert all(abs(hold.rest) < 6e-5 for hold in found.holds)
    # once the contact is below its limit, a load that falls on lets little of it slide
    if record.fall == 0.03:
        assert max(abs(hold.memory) for hold in found.holds) < 0.01 * abs(found.holds[0].relaxation)


def test_the_memory_part_is_the_slip_under_a_falling_load():
    """Where nothing creeps, the contact slides on as the load falls: T = μN."""
    found = creep(creep=0.0, fall=0.1, rate=3.0)
    assert "slip as the normal load falls hides it" in found.unknown
    for hold in found.holds:
        assert hold.memory == approx(-0.1 * hold.tangential_load, rel=0.02)
        assert hold.change == approx(hold.memory, abs=2e-5)


@mark.parametrize(
    "shape, reason",
    [
        ({"creep": 0.0, "load_noise": 2e-5, "rate": 3.0}, "noise decides|too noisy"),
        ({"length": 3.0, "load_noise": 5e-5}, "too short, or too noisy|noise decides"),
        ({"count": 2}, "it has 2 holds"),
    ],
)
def test_records_that_do_not_determine_creep_give_the_reason(shape, reason):
    found = creep(**shape)
    assert found.unknown
    assert re.search(reason, found.unknown)
    assert np.isnan([hold.relaxation for hold in found.holds]).all()
    assert dict(found.summary())["relaxation"] == f"the record does not say: {found.unknown}"


SCENARIO = """
title = "Holds at reversals"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "summits"
file = "summits.csv"
columns = { height = { column = "z", unit = "m" }, radius = { column = "R", unit = "m" } }
[friction]
coefficient = 0.2
[instrument]
lateral_stiffness = "334 mN/µm"
[loading]
file = "record.csv"
[loading.columns]
time = { column = "t", unit = "s" }
normal_load = { column = "N", unit = "N" }
tangential_displacement = { column = "U", unit = "m" }
[loading.response]
tangential_load = { column = "T", unit = "N" }
"""


def test_the_command_and_the_function_agree(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record = Holds(length=50.0, count=4, rate=3.0).record(0)
    names = ("normal_load", "tangential_displacement", "tangential_load")
    columns = np.column_stack([record.time, *(record[name] for name in names)])
    np.savetxt("record.csv", columns, "%.12g", ",", header="t,N,U,T", comments="")
    summits = np.column_stack([contact().summit_height, contact().summit_radius])
    np.savetxt("summits.csv", summits, "%.17g", ",", header="z,R", comments="")
    (tmp_path / "s.toml").write_text(SCENARIO, encoding="utf-8")
    done = CliRunner().invoke(main, ["creep", "s.toml", "-o", "c.png"])
    assert done.exit_code == 0, done.output
    found = hs.creep("s.toml")
    assert all(text in done.output for _, text in found.summary())
    assert len(found.rows()) == 5
    figure = hs.plot(found)
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "Relaxation",
        "Parts of the change",
    ]
    assert (tmp_path / "c.png").stat().st_size > 1e4
    again = CliRunner().invoke(main, ["creep", "s.toml", "-o", "record.csv"])
    assert again.exit_code == 2
    flat = attrs.evolve(record, response={"tangential_load": np.zeros(record.time.size)})
    with raises(InputError, match="tangential load is 0 in all holds"):
        separate_creep(flat, contact(), STIFF)
