"""Contents of the pictures of histories; their looks are covered by the reference pictures."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from golden import check_messages

import historysim as hs
from historysim.results.plots import histories, style, tractions
from historysim.results.plots.pictures import PICTURES

SCENARIOS = Path(__file__).parents[3] / "scenarios"
PAIR = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=8e9)
HEIGHTS = np.array([0.0, -20e-9, -10e-9, -500e-9])


def replayed(record="all", friction=0.2, loops=2):
    swings = [(1.0, 50e-9), (3.0, -50e-9), (4.0, 0.0)]
    events = [hs.NormalLoad(0.0, 5e-3)]
    events += [
        hs.TangentialDisplacement(4.0 * loop + after, value)
        for loop in range(loops)
        for after, value in swings
    ]
    return hs.replay(hs.Ensemble(PAIR, HEIGHTS, 1e-5, friction), events, substeps=10, record=record)


def drawn(history):
    figure = hs.plots.history(history)
    return figure, {axes.get_title(loc="left"): axes for axes in figure.axes}


def limits(figure):
    return [
        line
        for axes in figure.axes
        for line in axes.get_lines()
        if line.get_label() == "friction limit"
    ]


@pytest.mark.parametrize("record", ["totals", [0]])
def test_the_friction_limit_is_drawn_for_any_selection_of_recorded_asperities(record):
    friction = [0.1, 0.2, 0.3, 0.4]
    whole = replayed(friction=friction)
    expected = (whole.normal_load * whole.friction).sum("asperity").values
    figure, _ = drawn(replayed(friction=friction, record=record))
    (line,) = limits(figure)
    assert line.get_ydata() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("record", ["touching", "totals"])
def test_the_emptiest_histories_can_be_drawn(record):
    drawn(
        hs.replay(hs.Ensemble(PAIR, HEIGHTS, 1e-5, 0.2), [hs.NormalLoad(0.0, 0.0)], record=record)
    )


def test_long_histories_are_thinned(monkeypatch):
    monkeypatch.setattr(style, "MOST_POINTS", 30)
    monkeypatch.setattr(histories, "MOST_COLUMNS", 20)
    monkeypatch.setattr(histories, "MOST_ROWS", 2)
    history = replayed(loops=5)
    _, panels = drawn(history)
    assert history.sizes["step"] > 100
    image = panels["Slip state"].get_images()[0]
    assert image.get_array().shape[0] == 2
    assert image.get_array().shape[1] <= 20
    assert image.get_extent()[1] == history.sizes["step"] - 0.5
    points = panels["Loads"].get_lines()[0].get_xdata()
    assert len(points) <= 31
    assert points[-1] == history.time[-1]


def test_thinning_keeps_the_peaks_of_each_period():
    """A stride of the period would miss a peak of one sample in each."""
    period = np.zeros(1000)
    period[333], period[667] = 5.0, -3.0
    load = np.tile(period, 200)
    load[7] = np.nan
    kept = style.thin_samples(load.size, [load], 2_000)
    assert kept.size <= 2_000
    assert kept[[0, -1]].tolist() == [0, load.size - 1]
    # in pieces of one period each peak has its own
    assert np.count_nonzero(load[kept] == 5) == np.count_nonzero(load[kept] == -3) == 200
    assert style.thin_samples(10, [load[:10]], 10).tolist() == list(range(10))


def test_states_differ_in_lightness():
    weights = np.array([0.2126, 0.7152, 0.0722])
    lightness = [float(weights @ mpl.colors.to_rgb(colour)) for colour in style.STATE_COLOURS]
    assert np.abs(np.diff(sorted(lightness))).min() > 0.12


def test_swings_ignore_noise():
    steps = np.concatenate(
        [np.linspace(0, 1, 50), np.linspace(1, -1, 100), np.linspace(-1, 1, 100)]
    )
    noisy = steps + np.random.default_rng(0).normal(0, 0.01, steps.size)
    swings = list(tractions._swings(noisy))
    assert len(swings) == 3
    assert [steps[end] for _, end in swings] == pytest.approx([1, -1, 1], abs=0.1)


def test_the_picture_of_wear_shows_wear():
    history = hs.run(SCENARIOS / "25_wear.toml")
    left, right = hs.plot(history, picture="wear").axes
    total, *each = left.get_lines()
    assert total.get_ydata() == pytest.approx(history.worn_volume.sum("asperity").values, abs=1e-40)
    assert sum(line.get_ydata()[-1] for line in each) == pytest.approx(total.get_ydata()[-1])
    before, after = right.get_lines()
    assert (after.get_xdata() < before.get_xdata()).all()
    assert [axes.get_title(loc="left") for axes in hs.plot(history, panels=["wear"]).axes] == [
        "Wear"
    ]
    assert PICTURES["wear"].is_reported(history)
    assert not PICTURES["wear"].is_reported(replayed())


def test_the_picture_shows_first_loading_and_flattened_summits():
    history = hs.run(SCENARIOS / "26_running_in.toml")
    figure = hs.plot(history, picture="yielding")
    left, right = figure.axes
    yielding, elastic = (line.get_ydata() for line in left.get_lines())
    assert np.nanmax(yielding) == pytest.approx(90e-3, rel=1e-6)
    # 50 mN is come back to without yielding
    assert np.nanmin(elastic) == pytest.approx(50e-3, rel=1e-6)
    *_, before, after = right.get_lines()
    assert before.get_xdata().size == int((history.yielding_load.isel(step=-1) > 0).sum())
    assert (after.get_xdata() < before.get_xdata()).all()
    assert (after.get_ydata() > before.get_ydata()).all()


def test_messages():
    check_messages(globals())
