"""Columns that are none of friction: loops that enclose no energy, have no height, or do not close."""

import re

import numpy as np
import pytest
import synthetic
from records import scenario_text, write_columns

import historysim as hs
from historysim.measured.loops import loops_of_channels, loops_of_measurement
from historysim.results.tables import loop_summary as summary

COUNT = 3200
TIME = np.linspace(0, 8, COUNT)
MOVED = 1e-6 * np.sin(2 * np.pi * TIME)


def jenkins():
    """Give the load of one spring of 1 N/µm that slides at 0.2 N."""
    load = np.zeros(COUNT)
    for sample in range(1, COUNT):
        load[sample] = np.clip(load[sample - 1] + 1e6 * (MOVED[sample] - MOVED[sample - 1]), -0.2, 0.2)
    return load


FRICTION, NOISE = jenkins(), np.random.default_rng(0).normal(size=(3, COUNT))
MEASURED = MOVED + 2e-9 * NOISE[0]
NORMAL = 1 + 0.01 * NOISE[1]
NONE = {
    "constant": (0.3 + 0 * TIME, "not clear of 0"),
    "noise beside an offset": (0.3 + 1e-3 * NOISE[2], "not clear of 0"),
    "spring": (2e5 * MOVED + 2e-3 * NOISE[2], "no energy"),
    "spring without noise": (2e5 * MOVED, "no energy|not clear of 0"),
    "normal load that swings": (1 + 0.1 * np.sin(4 * np.pi * TIME), "not clear of 0"),
    "time": (TIME, "does not come back"),
}


@pytest.mark.parametrize("name", NONE)
def test_what_is_no_friction_has_no_coefficient(name):
    load, reason = NONE[name]
    found = loops_of_channels(TIME, MEASURED if "without" not in name else MOVED, load, 1.0)
    ((members, text),) = found.no_friction
    assert members.tolist() == list(range(len(found)))
    assert re.search(reason, text)
    assert any("is the column of the tangential load right? historysim columns FILE" in note for note in found.notes)
    rows = {row[0]: row[1:] for row in found.rows()}
    assert set(rows["friction coefficient"]) == set(rows["friction force"]) == {"–"}
    assert not any("coefficient drifts" in note or "lower bounds" in note for note in found.notes)
    assert dict(summary(found.to_dataset()))["no_friction"] == text


@pytest.mark.parametrize("offset", [0.0, 1.0])
def test_friction_is_friction_whatever_its_offset(offset):
    found = loops_of_channels(TIME, MEASURED, offset + FRICTION + 2e-3 * NOISE[2], NORMAL)
    assert found.no_friction == ()
    assert found.statistics("friction_coefficient").mean == pytest.approx(0.2, rel=5e-3)


@pytest.mark.parametrize(("material", "loops"), [("ball", 1), ("rough", 2)])
def test_good_records_are_good(material, loops):
    record = synthetic.measured(material, 1, loads=(0.02, 0.05), loops=loops)
    assert loops_of_measurement(record).no_friction == ()


def test_swapped_columns_are_refused():
    with pytest.raises(hs.InputError, match=r"wrong way round.*swapped"):
        loops_of_channels(TIME, FRICTION + 2e-3 * NOISE[2], MOVED)
    with pytest.raises(hs.InputError, match="0 whole loops"):
        loops_of_channels(TIME, TIME, FRICTION)


def test_each_load_is_judged_by_itself():
    """At the second load the sensor was off."""
    normal = np.where(TIME < 4, 1.0, 2.0)
    load = np.where(TIME < 4, FRICTION, 1e-3 * NOISE[2])
    found = loops_of_channels(TIME, MEASURED, load, normal)
    ((_, text),) = found.no_friction
    assert re.match(r"\d loops at 2 N are no friction: ", text)
    rows = [row[-1] for row in found.by_load().rows() if row[0] == "  2 N"]
    assert rows[0] == "–"
    assert found.by_load().statistics("friction_coefficient")[0].mean == pytest.approx(0.2, rel=1e-2)
    # a line through one load is none
    assert found.by_load().laws() == []


def test_the_columns_are_named(tmp_path):
    write_columns(tmp_path / "m.csv", t=TIME, N=NORMAL, u=1e9 * MEASURED, T=0.3 + 0.01 * NOISE[2])
    (tmp_path / "s.toml").write_text(scenario_text(response={"tangential_load": '"T"'}), encoding="utf-8")
    question = (
        "are the columns right, tangential_load = 'T' and tangential_displacement = 'u'? historysim columns m.csv"
    )
    assert any(question in note for note in hs.loops(tmp_path / "s.toml").notes)
