"""Contact maps of interacting asperities, and the moving contact map: its frames, and the files of it."""

import re
import shutil

import h5py
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from matplotlib.animation import writers
from overlapping import on_top_of_each_other
from pictured import interacting
from PIL import Image

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError
from historysim.results.plots.pictures import PICTURES
from historysim.results.plots.style import STATE_COLOURS

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


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("solved")
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("HISTORYSIM_CACHE", str(folder / "cache"))
        (folder / "a.toml").write_text(SCENARIO, encoding="utf-8")
        hs.run(folder / "a.toml", folder / "a.nc").close()
        yield folder


@pytest.fixture
def result(solved, tmp_path):
    for path in solved.glob("a.*"):
        shutil.copy(path, tmp_path)
    return tmp_path / "a.nc"


def shares(axes):
    """Shares that touch and stick, as the title of a map says them."""
    return percentages(axes.get_title(loc="left"))


def percentages(text):
    return [float(number) for number in re.findall(r"([\d.]+) %", text)]


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
        moving = hs.plots.animate_contact_map(history, [0, 1])
        figure = moving._fig
        for frame in (0, 1):
            moving._func(frame)
            row = history.isel(step=frame)
            touches, sticks = (float(row[name].sum()) / 32e-6**2 for name in ("contact_area", "stick_area"))
            assert percentages(figure.get_suptitle()) == pytest.approx([100 * touches, 100 * sticks], abs=0.2)
            assert f"step {frame}," in figure.get_suptitle()


def test_without_its_events_it_is_refused(result):
    result.with_suffix(".history").unlink()
    with h5py.File(result, "a") as file:
        del file["surface/log"]
    with pytest.raises(hs.InputError, match="contact maps need the event log"):
        hs.plot(result, step=1)


def test_a_report_has_the_map(result):
    text = hs.report(result)
    assert "No picture" not in text
    assert "Patches have no traction profiles" in text
    with hs.open(result) as history:
        assert PICTURES["contact-map"].caption_of(history) in text


def test_maps_of_a_step_carry_its_loads(result):
    with xr.open_dataset(result, decode_times=False) as history:
        for step in (0, 1):
            maps, row = history.contact.point_maps(step), history.isel(step=step)
            cell = 1e-12
            assert float(maps["pressure"].sum()) * cell == pytest.approx(float(row["total_normal_load"]), rel=1e-9)
            assert float(maps["traction"].sum()) * cell == pytest.approx(
                float(row["total_tangential_load"]), rel=1e-9, abs=1e-15
            )
            assert bool((abs(maps["traction"]) <= 0.2 * maps["pressure"] * (1 + 1e-9)).all())
            assert maps["x"].values[[0, -1]].tolist() == pytest.approx([0.0, 31e-6])
        assert set(maps["contact_state"].values.ravel().tolist()) == {0, 1, 2}
        with pytest.raises(hs.InputError, match="step 2: the history has 2 steps; expected -2 to 1"):
            history.contact.point_maps(2)


def test_maps_are_a_table_that_is_replaced(result, tmp_path):
    for _ in range(2):
        done = CliRunner().invoke(main, ["table", str(result), "point-maps", "-o", str(tmp_path / "maps.csv")])
        assert done.exit_code == 0, done.output
    header = (tmp_path / "maps.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.startswith("x [m],pressure")


def test_maps_are_files_for_other_programs(result, tmp_path):
    asked = ["table", str(result), "point-maps", "--step", "1", "-o"]
    done = CliRunner().invoke(main, [*asked, str(tmp_path / "maps.nc")])
    assert done.exit_code == 0, done.output
    with xr.open_dataset(tmp_path / "maps.nc", decode_times=False) as maps:
        pressure = maps["pressure"].values
        assert maps["contact_state"].attrs["flag_meanings"] == "separated sticks slips"
    meshio = pytest.importorskip("meshio", reason='needs pip install "historysim[vtk]"')
    done = CliRunner().invoke(main, [*asked, str(tmp_path / "maps.vtu")])
    assert done.exit_code == 0, done.output
    mesh = meshio.read(tmp_path / "maps.vtu")
    (squares,) = mesh.cells
    corners = mesh.points[squares.data]
    # each square lies around its point, in order
    middle = corners.mean(axis=1)[:, :2].reshape(32, 32, 2)
    assert middle[3, 5] == pytest.approx([3e-6, 5e-6])
    (given,) = mesh.cell_data["pressure"]
    assert given.reshape(32, 32) == pytest.approx(pressure)


def test_a_result_of_summits_has_no_maps(tmp_path):
    text = SCENARIO.replace('interaction = "full"\n', "")
    (tmp_path / "b.toml").write_text(text, encoding="utf-8")
    with (
        hs.run(tmp_path / "b.toml", tmp_path / "b.nc") as history,
        pytest.raises(hs.InputError, match='has no contact maps; expected a surface with interaction = "full"'),
    ):
        history.contact.point_maps()


# -- as it moves

PAIR = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=8e9)
EVENTS = [hs.NormalLoad(0.0, 4e-3)]
EVENTS += [hs.TangentialDisplacement(float(time), (-1) ** time * 30e-9) for time in range(1, 6)]
PLACES = {"x": np.array([0.0, 4e-6, 8e-6]), "y": np.array([0.0, 6e-6, 3e-6])}


def replayed(**places):
    return hs.replay(hs.Ensemble(PAIR, [0.0, -20e-9, -35e-9], [10e-6, 30e-6, 15e-6], 0.2, **places), EVENTS, substeps=4)


def states_on(axes):
    """How many summits each slip state has in the picture, by its colour."""
    found = [0, 0, 0, 0]
    for marks in axes.collections:
        colour = tuple(np.round(marks.get_facecolor()[0, :3] * 255).astype(int)) if len(marks.get_offsets()) else None
        for state, text in enumerate(STATE_COLOURS):
            if colour == tuple(int(text[place : place + 2], 16) for place in (1, 3, 5)):
                found[state] = len(marks.get_offsets())
    return found


@pytest.mark.parametrize("places", [PLACES, {}])
def test_loop_and_map_move_together(places, tmp_path):
    history = replayed(**places)
    steps = [9, 11, -1]
    moving = hs.plots.animate_contact_map(history, steps, size=(120, 60))
    loop, contacts = moving._fig.axes[:2]
    for frame, step in enumerate((9, 11, 20)):
        moving._func(frame)
        dot = loop.get_lines()[-1]
        assert dot.get_xdata() == pytest.approx(history.tangential_displacement.values[[step]])
        assert dot.get_ydata() == pytest.approx(history.total_tangential_load.values[[step]])
        counted = [int((history.slip_state.values[step] == state).sum()) for state in range(4)]
        assert states_on(contacts)[1:] == counted[1:]
        assert moving._fig.get_suptitle().startswith(f"step {step},")
    hs.plots.save_animation(moving, tmp_path / "m.gif")
    with Image.open(tmp_path / "m.gif") as picture:
        assert picture.n_frames == 3
        assert picture.size == pytest.approx((120 / 25.4 * 110, 60 / 25.4 * 110), abs=1)
    assert [path.name for path in tmp_path.iterdir()] == ["m.gif"]


def labels(axes):
    return [axes.get_xlabel(), axes.get_ylabel()]


@pytest.mark.parametrize(("kind", "size"), [("placed", (120, 60)), ("heights", (90, 120)), ("interacting", (90, 120))])
def test_every_frame_has_its_labels_and_its_place(kind, size):
    history = interacting() if kind == "interacting" else replayed(**(PLACES if kind == "placed" else {}))
    moving = hs.plots.animate_contact_map(history, [9, 11, -1], size=size)
    moving._draw_was_started = True
    figure, places = moving._fig, []
    for frame in range(3):
        moving._func(frame)
        loop, contacts = figure.axes[:2]
        assert on_top_of_each_other(figure) == []
        assert [text.split(" (")[0].replace("\n", " ") for text in labels(loop)] == [
            "tangential displacement $U$",
            "tangential load $T$",
        ]
        named = ["summit height", "summit radius"] if kind == "heights" else ["$x$", "$y$"]
        assert [text.replace("\n", " ").startswith(name) for text, name in zip(labels(contacts), named, strict=True)]
        legend = [text.get_text() for text in figure.legends[0].get_texts()]
        assert {"sticks", "slips"} <= set(legend) if kind == "interacting" else "partial slip" in legend
        places.append([axes.get_position(original=True).bounds for axes in (loop, contacts)])
    # nothing trembles
    assert places[0] == places[1] == places[2]


def test_by_itself_it_shows_the_last_loop():
    moving = hs.plots.animate_contact_map(replayed())
    # from the third reversal to the fifth
    assert moving._fig.get_suptitle().startswith("step 12,")
    assert moving._save_count == 9
    moving._draw_was_started = True


def test_a_command_writes_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    events = [hs.NormalLoad(0.0, 4e-3), hs.TangentialDisplacement(1.0, 1e-8)]
    hs.Replay(hs.Ensemble(PAIR, 0.0, 1e-5, 0.2), events).write("r.nc")
    done = CliRunner().invoke(main, ["plot", "r.nc", "-o", "r.gif", "--size", "90x70"])
    assert (done.exit_code, done.output) == (0, "r.gif\n")
    with Image.open("r.gif") as picture:
        assert picture.n_frames == 2
    refused = CliRunner().invoke(main, ["plot", "r.nc", "-o", "r.png", "--size", "60"])
    assert refused.exit_code == 2
    assert "--size 60: expected width and height in millimetres, as 90x70" in refused.output
    refused = CliRunner().invoke(main, ["plot", "r.nc", "-o", "m.gif", "--step", "1"])
    assert refused.exit_code == 2
    assert "m.gif: a moving picture takes no --step; expected another ending" in refused.output


def test_what_cannot_be_written_is_refused(tmp_path, monkeypatch):
    moving = hs.plots.animate_contact_map(replayed(), [3])
    moving._draw_was_started = True
    with pytest.raises(InputError, match=r"m.avi: .avi ending; expected .gif, .mp4, .webm"):
        hs.plots.save_animation(moving, tmp_path / "m.avi")
    monkeypatch.setattr(writers, "is_available", lambda name: name != "ffmpeg")
    with pytest.raises(InputError, match=r"is written by the program ffmpeg, which is not installed; expected .gif"):
        hs.plots.save_animation(moving, tmp_path / "m.mp4")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match="steps is empty"):
        hs.plots.animate_contact_map(replayed(), [])
