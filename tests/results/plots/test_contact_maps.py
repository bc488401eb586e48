"""Contact maps of interacting asperities."""

import re
import shutil

import h5py
import pytest
import xarray as xr
from golden import refused
from pytest import approx, fixture

import historysim as hs

SCENARIO = """
title = "pressed $"
[materials]
contact_modulus = "40 GPa"
shear_modulus = "10 GPa"
[surface]
kind = "random"
interaction = "full"
shape = [32, 32]
pixel_size = "1 µm"
rms_height = "0.1 µm"
autocorrelation_length = "10 µm"
autocorrelation = "gaussian"
seed = 1
[friction]
coefficient = 0.2
[loading]
waypoints = [{ time = 0, normal_load = "20 mN" }, { time = 1, tangential_load = "2 mN" }]
"""


@fixture(scope="module")
def solved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("solved")
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("HISTORYSIM_CACHE", str(folder / "cache"))
        (folder / "a.toml").write_text(SCENARIO, encoding="utf-8")
        hs.run(folder / "a.toml", folder / "a.nc").close()
        yield folder


@fixture
def result(solved, tmp_path):
    for path in solved.glob("a.*"):
        shutil.copy(path, tmp_path)
    return tmp_path / "a.nc"


def shares(axes):
    """Shares that touch and stick, as the title of a map says them."""
    return percentages(axes.get_title(loc="left"))


def percentages(text):
    return [float(number) for number in re.findall(r"([\d.]+) %", text)]


def test_zones_agree_with_the_recorded_areas(result):
    figure = hs.plot(result, step=1)
    whole, independent, pressure, traction = figure.axes[:4]
    with xr.open_dataset(result, decode_times=False) as history:
        row = history.isel(step=1)
        touches, sticks = (
            float(row[name].sum()) / 32e-6**2 for name in ("contact_area", "stick_area")
        )
    assert shares(whole) == approx([100 * touches, 100 * sticks], abs=0.2)
    assert shares(independent)[0] > 0
    assert pressure.images[0].get_array().max() > 0
    assert abs(traction.images[0].get_array()).max() > 0
    assert "pressed" in figure.get_suptitle()
    assert "T = 2 mN" in figure.get_suptitle()


def map_of(result):
    with hs.open(result) as history:
        return history.contact.point_maps(1).load()


def test_without_its_log_the_maps_come_from_the_result(result):
    before = map_of(result)
    with hs.EventLog(result.with_suffix(".history")) as log:
        # it is the log of something else now
        log.append([hs.NormalLoad(2.0, 1e-3)])
    xr.testing.assert_identical(map_of(result), before)
    result.with_suffix(".history").unlink()
    xr.testing.assert_identical(map_of(result), before)


def test_without_its_events_it_is_refused(result):
    result.with_suffix(".history").unlink()
    with h5py.File(result, "a") as file:
        del file["surface/log"]
    with refused("contact maps need the event log"):
        hs.plot(result, step=1)


def test_maps_of_a_step_carry_its_loads(result):
    with xr.open_dataset(result, decode_times=False) as history:
        for step in (0, 1):
            maps, row = history.contact.point_maps(step), history.isel(step=step)
            cell = 1e-12
            assert float(maps["pressure"].sum()) * cell == approx(
                float(row["total_normal_load"]), rel=1e-9
            )
            assert float(maps["traction"].sum()) * cell == approx(
                float(row["total_tangential_load"]), rel=1e-9, abs=1e-15
            )
            assert bool((abs(maps["traction"]) <= 0.2 * maps["pressure"] * (1 + 1e-9)).all())
            assert maps["x"].values[[0, -1]].tolist() == approx([0.0, 31e-6])
        assert set(maps["contact_state"].values.ravel().tolist()) == {0, 1, 2}
        with refused("step 2: the history has 2 steps"):
            history.contact.point_maps(2)
