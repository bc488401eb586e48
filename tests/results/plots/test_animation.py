"""The moving contact map: its frames, and the files that it is written to."""

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.animation import writers
from overlapping import on_top_of_each_other
from pictured import interacting
from PIL import Image

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError
from historysim.results.plots.style import STATE_COLOURS

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


@pytest.mark.parametrize("size", [(120, 60), (90, 120)])
@pytest.mark.parametrize("kind", ["placed", "heights", "interacting"])
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
