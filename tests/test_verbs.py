"""What can be asked of anything, or of its file: it is opened, shown and drawn."""

import numpy as np
import pytest
import xarray as xr
from golden import refused
from pairs import STIFF as PAIR
from records import BALL

import historysim as hs

ROUGH = hs.Ensemble(PAIR, [0.0, -1e-8], 1e-3, 0.2)
EVENTS = [
    hs.NormalLoad(0.0, 0.1),
    *(hs.TangentialDisplacement(float(time), (-1) ** time * 1e-7) for time in range(1, 5)),
]
LOADING = """
[loading]
waypoints = [{ time = 0, normal_load = "50 mN" }, { after = 1, tangential_load = "8 mN" }]
"""


def test_a_history_in_memory_and_in_a_file_have_one_summary(tmp_path):
    job = hs.Replay(ROUGH, EVENTS, substeps=50)
    job.write(tmp_path / "r.nc")
    found, there = dict(hs.show(job.dataset())), dict(hs.show(tmp_path / "r.nc"))
    assert found["steps"] == there["steps"] == "201 over 4 s"
    assert "number_of_asperities" not in there
    assert dict(hs.show(tmp_path / "r.nc", attributes=True))["number_of_asperities"] == "2"
    assert repr(hs.show(tmp_path / "r.nc")).startswith("steps                     201 over 4 s\n")


def test_a_scenario_a_log_a_map_and_loops_are_shown(tmp_path):
    (tmp_path / "s.toml").write_text(BALL + LOADING, encoding="utf-8")
    assert dict(hs.show(tmp_path / "s.toml")) == dict(hs.show(hs.load(tmp_path / "s.toml")))
    assert dict(hs.show(str(tmp_path / "s.toml")))["title"] == "a ball"
    with hs.EventLog.create(tmp_path / "r.history", ROUGH, EVENTS) as log:
        assert dict(hs.show(log))["events"] == "5 over 4 s"
    assert dict(hs.show(tmp_path / "r.history"))["asperities"] == "2"
    np.savetxt(tmp_path / "map.txt", np.pad([[4.0]], 2))
    lines = dict(hs.show(tmp_path / "map.txt", pixel_size="1 µm", height_unit="nm", form="mean"))
    assert (lines["points"], lines["form removed"]) == ("5 × 5, 1 µm apart", "mean")
    assert dict(hs.show(hs.Surface(np.eye(4), 1e-6)))["points"] == "4 × 4, 1 µm apart"
    loops = hs.loops(hs.replay(ROUGH, EVENTS, substeps=50))
    assert dict(hs.show(loops))["dead band"] == "10 nm, 5 % of the range of the displacement"
    loops.to_dataset().to_netcdf(tmp_path / "l.nc")
    assert dict(hs.show(tmp_path / "l.nc"))["loops"] == "1"


def test_two_maps_of_one_area_show_the_worn_volume(tmp_path):
    pytest.importorskip("skimage", reason="needs scikit-image: pip install historysim[surfaces]")
    before = hs.random_surface(
        (64, 64), pixel_size=1e-6, rms_height=1e-6, autocorrelation_length=20e-6, seed=1
    )
    after = np.minimum(before.heights, 1e-6)
    for name, heights in (("before", before.heights), ("after", after)):
        np.save(tmp_path / f"{name}.npy", heights)
    paths = [tmp_path / "before.npy", tmp_path / "after.npy"]
    reading = {"pixel_size": "1 µm", "height_unit": "m"}
    lines = dict(hs.show(paths, **reading))
    assert float(lines["worn volume"].split()[0]) == pytest.approx(
        (before.heights - after).sum() * 1e6, rel=0.05
    )
    drawn = hs.plot(paths, **reading)
    assert drawn.axes[0].get_title(loc="left") == "Height lost"
    assert lines["worn volume"] in drawn.texts[-1].get_text()
    alone = "; expected one, or two height maps of one area"
    with refused(f"3 files or maps are given{alone}"):
        hs.show([before] * 3)
    with refused(f"2 files or maps are given; 5 is not a height map{alone}"):
        hs.show([before, 5])


def test_a_map_in_coarse_steps_is_reported_though_a_plane_was_taken_off(tmp_path):
    heights = np.random.default_rng(1).normal(size=(64, 64))
    reading = {"pixel_size": "1 µm", "height_unit": "nm"}
    np.savetxt(tmp_path / "fine.txt", heights)
    assert "warning" not in dict(hs.show(tmp_path / "fine.txt", **reading))
    np.savetxt(tmp_path / "coarse.txt", np.round(heights))
    lines = dict(hs.show(tmp_path / "coarse.txt", **reading))
    assert lines["form removed"] == "plane"
    assert lines["warning"].startswith(
        "heights come in steps of 1 nm, and the median summit rises "
    )


def test_unsupported_objects_are_refused(tmp_path):
    with refused("3 cannot be shown; expected a history"):
        hs.show(3)
    with refused("only apply to the path of a height map"):
        hs.show(hs.Surface(np.eye(4), 1.0), pixel_size=1.0)
    (tmp_path / "s.toml").write_text(BALL + LOADING, encoding="utf-8")
    with refused(r"form: .*s.toml is a scenario; expected a height map"):
        hs.show(tmp_path / "s.toml", form="plane")


SWINGS = [
    hs.NormalLoad(0.0, 0.1),
    *(hs.TangentialDisplacement(float(t), (-1) ** t * 1e-6) for t in (1, 2, 3)),
]


@pytest.fixture
def history():
    return hs.replay(ROUGH, SWINGS, substeps=4)


def test_a_history_written_by_python_is_a_result(history, tmp_path):
    path = tmp_path / "h.nc"
    hs.write_netcdf(history, path)
    with hs.open(path) as found:
        xr.testing.assert_equal(found, history)
        assert found.contact.slip_shares().equals(history.contact.slip_shares())
    # closed once, and closed again without ado
    found.close()
    assert dict(hs.show(path))["steps"] == "13 over 3 s"
    assert len(hs.plot(path).axes) > 1


def test_the_table_of_a_query_is_opened_shown_and_drawn(history, tmp_path):
    path = tmp_path / "f.nc"
    table = history.contact.slip_onset()
    hs.write_netcdf(table, path)
    xr.testing.assert_equal(hs.open(path), table)
    lines = dict(hs.show(path))
    assert lines["size"] == "2 along asperity"
    assert lines["slip_time"] == "250 ms; when the asperity first slips"
    assert hs.plot(path).axes


def test_a_unit_with_a_power_gets_no_prefix(history, tmp_path):
    hs.write_netcdf(history.contact.time_series(), tmp_path / "t.nc")
    area = history.real_contact_area.values
    assert dict(hs.show(tmp_path / "t.nc"))["real_contact_area"].startswith(f"{area.max():.4g} m2;")
