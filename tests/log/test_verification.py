"""Whether a result is what its log gives, and what this version has written since it began still opens."""

import shutil
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr
from pairs import UNIT
from pytest import approx, fixture, mark

import historysim as hs

# A log with all kinds of events and a snapshot, and its result, as version 0.4.0 wrote them before
# its release.
BEFORE = Path(__file__).parent / "written_by_0_4_0"


@fixture
def before(tmp_path):
    for path in BEFORE.iterdir():
        shutil.copy(path, tmp_path)
    return tmp_path / "written.nc"


@fixture
def again(before):
    """The result of the old log, made by this version."""
    hs.run(before.with_suffix(".history"), before).close()
    return before


def test_files_of_an_earlier_version_open_and_verify(before):
    found = hs.verify(before)
    assert found
    assert all(difference.rounding for difference in found.differences)
    log = hs.verify(before.with_suffix(".history"))
    assert (bool(log), log.events, log.digest) == (True, 11, found.digest)


def test_a_log_written_before_makes_its_result_again(before):
    with (
        hs.EventLog(before.with_suffix(".history")) as log,
        xr.open_dataset(before, decode_times=False) as result,
    ):
        again = log.replay()
        assert set(result.variables) <= set(again.variables)
        for name, values in result.variables.items():
            scale = float(np.abs(np.nan_to_num(values)).max())
            assert again[name].values == approx(
                values.values, rel=1e-12, abs=1e-12 * scale, nan_ok=True
            ), name
        # a page that ran before may have added a separate event
        own = {
            name
            for name, kind in hs.events.EVENTS.items()
            if kind.__module__.startswith("historysim.")
        }
        assert {event.name for event in log.events()} == own
        log.append(hs.NormalLoad(7.0, 0.01))
        assert log.state().normal_load == approx(0.01)
        with log.fork(1.3, before.with_name("fork.history")) as fork:
            assert len(fork) > 0


def test_a_result_written_before_is_run_again_from_itself(before, tmp_path):
    hs.run(before, tmp_path / "other.nc").close()
    assert hs.verify(tmp_path / "other.nc").digest == hs.verify(before).digest


@mark.parametrize("who, fails", [("historysim_version", False), ("made_with", True)])
def test_rounding_of_another_version_is_noted_and_that_of_another_machine_is_a_failure(
    again, who, fails
):
    with netCDF4.Dataset(again, "a") as result:
        result.setncattr(who, "another one")
        result["separation"][:] = np.nextafter(result["separation"][:], 1.0)
    notices = []
    found = hs.verify(again, notify=notices.append)
    assert bool(found) != fails
    assert [difference.name for difference in found.differences] == ["separation"]
    assert found.differences[0].largest < 1e-15
    assert any("another one" in line for line in notices) != fails


def test_rounding_of_another_machine_is_noted_where_friction_has_powers_of_its_own(tmp_path):
    contact = hs.Ensemble(UNIT, 0.0, 1.0, hs.laws.PowerLaw(0.4, 0.01, -0.3))
    path = tmp_path / "a.nc"
    hs.EventLog.create(path.with_suffix(".history"), contact, [hs.NormalLoad(0.0, 0.01)]).close()
    hs.run(path.with_suffix(".history"), path).close()
    for maker, noted in ((None, False), ("another one", True)):
        with netCDF4.Dataset(path, "a") as result:
            result.made_with = maker or result.made_with
            result["separation"][0] = np.nextafter(result["separation"][0], 1.0)
        assert bool(hs.verify(path)) == noted


@mark.parametrize("name, change", [("separation", 1e-6), ("slip_state", 1)])
def test_more_than_rounding_is_a_failure_wherever_it_was_made(again, name, change):
    with netCDF4.Dataset(again, "a") as result:
        result.historysim_version = "another one"
        result[name][3] += change
    found = hs.verify(again)
    assert not found
    assert not found.differences[0].rounding


def test_the_same_bits_are_required_on_one_machine_and_version(again):
    assert hs.verify(again)
    with netCDF4.Dataset(again, "a") as result:
        result["separation"][2] = np.nextafter(result["separation"][2], 1.0)
    assert not hs.verify(again)
