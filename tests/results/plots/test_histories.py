"""Contents of the pictures of histories; their looks are covered by the reference pictures."""

import matplotlib as mpl
import numpy as np
from golden import check_messages
from pairs import COMPLIANT as PAIR
from pytest import approx, mark

import historysim as hs
from historysim.results.plots import histories, style, tractions

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


@mark.parametrize("record", ["totals", [0]])
def test_the_friction_limit_is_drawn_for_any_selection_of_recorded_asperities(record):
    friction = [0.1, 0.2, 0.3, 0.4]
    whole = replayed(friction=friction)
    expected = (whole.normal_load * whole.friction).sum("asperity").values
    figure, _ = drawn(replayed(friction=friction, record=record))
    (line,) = limits(figure)
    assert line.get_ydata() == approx(expected, rel=1e-9)


@mark.parametrize("record", ["touching", "totals"])
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
    assert [steps[end] for _, end in swings] == approx([1, -1, 1], abs=0.1)


def test_messages():
    check_messages(globals())
