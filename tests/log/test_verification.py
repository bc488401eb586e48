"""Whether a result is what its log gives, and what earlier versions wrote still opens."""

import shutil
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

import historysim as hs

BEFORE = Path(__file__).parent / "written_by_0_1_0"
"""Logs and results that version 0.1.0 wrote: one with steady friction, and one with a fall of it."""


@pytest.fixture
def before(tmp_path):
    for path in BEFORE.iterdir():
        shutil.copy(path, tmp_path)
    return tmp_path / "before.nc"


@pytest.fixture
def again(before):
    """The result of the old log, made by this version."""
    hs.run(before.with_suffix(".history"), before).close()
    return before


def test_what_was_written_before_opens_and_verifies(before):
    steady = before.with_name("steady.nc")
    found = hs.verify(steady)
    assert found
    # what computes has changed, and may round otherwise; it says so
    assert all(difference.rounding for difference in found.differences)
    assert found.made_elsewhere.startswith("historysim 0.1.0")
    log = hs.verify(steady.with_suffix(".history"))
    assert (bool(log), log.events, log.digest) == (True, found.events, found.digest)


# version 0.1.0 lost energy where friction fell in one jump behind an instrument, as it does in this log
ENERGIES = {"dissipated_energy", "total_dissipated_energy"}


def test_a_fall_of_friction_written_before_verifies_but_for_the_energy_that_was_lost(before):
    found = hs.verify(before)
    assert (found.events, found.path) == (8, before)
    beyond = [difference for difference in found.differences if not difference.rounding]
    assert {difference.name for difference in beyond} == ENERGIES
    assert all(difference.largest < 1e-3 * difference.scale for difference in beyond)
    log = hs.verify(before.with_suffix(".history"))
    assert (bool(log), log.events, log.digest) == (True, found.events, found.digest)


def test_a_log_written_before_makes_its_result_again(before):
    with hs.EventLog(before.with_suffix(".history")) as log, xr.open_dataset(before, decode_times=False) as result:
        again = log.replay()
        assert set(again.variables) == {*result.variables, "largest_traction_ratio", "present_friction"}
        for name, values in result.variables.items():
            scale = np.abs(values.values).max(initial=0.0)
            error = 1e-3 if name in ENERGIES else 1e-12
            assert again[name].values == pytest.approx(values.values, rel=error, abs=error * float(scale)), name
        log.append(hs.NormalLoad(4.0, 0.01))
        assert log.state().normal_load == pytest.approx(0.01)
    with hs.EventLog(before.with_suffix(".history")) as log, log.fork(1.3, before.with_name("fork.history")) as fork:
        assert len(fork) > 0


@pytest.mark.parametrize(("who", "fails"), [("historysim_version", False), ("made_with", True)])
def test_rounding_of_another_version_is_told_and_that_of_another_machine_is_a_failure(again, who, fails):
    with netCDF4.Dataset(again, "a") as result:
        result.setncattr(who, "another one")
        result["separation"][:] = np.nextafter(result["separation"][:], 1.0)
    told = []
    found = hs.verify(again, tell=told.append)
    assert bool(found) != fails
    assert [difference.name for difference in found.differences] == ["separation"]
    assert found.differences[0].largest < 1e-15
    assert any("another one" in line for line in told) != fails


@pytest.mark.parametrize(("name", "change"), [("separation", 1e-6), ("slip_state", 1), ("contact_count", 1)])
def test_more_than_rounding_is_a_failure_wherever_it_was_made(again, name, change):
    with netCDF4.Dataset(again, "a") as result:
        result.made_with = "another processor"
        result[name][3] += change
    found = hs.verify(again)
    assert not found
    assert not found.differences[0].rounding


def test_the_same_bits_are_asked_for_where_nothing_else_was_at_work(before):
    hs.run(before.with_suffix(".history"), before).close()
    assert hs.verify(before)
    with netCDF4.Dataset(before, "a") as result:
        result["separation"][2] = np.nextafter(result["separation"][2], 1.0)
    assert not hs.verify(before)


def test_snapshots_of_another_program_are_told_once(before):
    told = []
    hs.verify(before.with_suffix(".history"), tell=told.append)
    assert sum("is passed over" in line for line in told) == 1
