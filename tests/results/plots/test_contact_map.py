import h5py
import pytest
import xarray as xr

import historysim as hs
from historysim.results.report.history_report import CAPTIONS

pytest.importorskip("tamaas", reason='needs pip install "historysim[interaction]"')

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


@pytest.fixture
def result(tmp_path, monkeypatch):
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path / "cache"))
    (tmp_path / "a.toml").write_text(SCENARIO, encoding="utf-8")
    history = hs.run(tmp_path / "a.toml", tmp_path / "a.nc")
    history.close()
    return tmp_path / "a.nc"


def shares(axes):
    """Shares that touch and stick, as the title of a map says them."""
    return [float(part.split("%")[0]) for part in axes.get_title(loc="left").splitlines()[1].split(", ")]


def test_zones_are_those_of_the_recorded_areas(result):
    figure = hs.plot(result, step=1)
    whole, independent, pressure, traction = figure.axes[:4]
    with xr.open_dataset(result, decode_times=False) as history:
        row = history.isel(step=1)
        touches, sticks = (float(row[name].sum()) / 32e-6**2 for name in ("contact_area", "stick_area"))
    assert shares(whole) == pytest.approx([100 * touches, 100 * sticks], abs=0.2)
    assert shares(independent)[0] > 0
    assert pressure.images[0].get_array().max() > 0
    assert abs(traction.images[0].get_array()).max() > 0
    assert "pressed" in figure.get_suptitle()
    assert "T = 2 mN" in figure.get_suptitle()


def test_without_its_own_log_the_result_draws_itself(result):
    before = shares(hs.plot(result, step=1).axes[0])
    with hs.EventLog(result.with_suffix(".history")) as log:
        # it is the log of something else now
        log.append([hs.NormalLoad(2.0, 1e-3)])
    assert shares(hs.plot(result, step=1).axes[0]) == before
    result.with_suffix(".history").unlink()
    assert shares(hs.plot(result, step=1).axes[0]) == before


def test_it_moves_with_the_zones_of_each_step(result):
    with xr.open_dataset(result, decode_times=False) as history:
        moving = hs.animate_contact_map(history, [0, 1])
        figure = moving._fig
        for frame in (0, 1):
            moving._func(frame)
            row = history.isel(step=frame)
            touches, sticks = (float(row[name].sum()) / 32e-6**2 for name in ("contact_area", "stick_area"))
            assert shares(figure.axes[1]) == pytest.approx([100 * touches, 100 * sticks], abs=0.2)
            assert f"step {frame}," in figure.get_suptitle()


def test_without_its_events_it_is_refused(result):
    result.with_suffix(".history").unlink()
    with h5py.File(result, "a") as file:
        del file["surface/log"]
    with pytest.raises(hs.InputError, match="expected the file that historysim run has written"):
        hs.plot(result, step=1)


def test_a_report_has_the_map(result):
    text = hs.report(result)
    assert "No picture" not in text
    assert "Patches have no traction profiles" in text
    assert CAPTIONS["contact-map"] in text


def test_what_is_no_size_is_told_as_such(result):
    with pytest.raises(hs.InputError, match="size is"):
        hs.plot(result, step=1, size=(1, 1))


def test_a_log_without_maps_has_no_picture(tmp_path):
    ball = hs.Ensemble(hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25), 0.0, 1.0, friction=0.2)
    with (
        hs.EventLog.create(tmp_path / "b.history", ball, [hs.NormalLoad(0, 1.0)]) as log,
        pytest.raises(hs.InputError, match="has no contact maps"),
    ):
        hs.plot_contact_map(log, 0.0)
