"""No legend lies on what is drawn."""

from itertools import pairwise

import numpy as np
import pytest

import historysim as hs
from historysim.measured.comparison import Comparison, observe, passed
from historysim.measured.measurement import Measurement

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)


@pytest.fixture(scope="module")
def history():
    events = [hs.NormalLoad(0.0, 0.1)]
    events += [hs.TangentialDisplacement(1.0 + i, (-1) ** i * 1e-7) for i in range(5)]
    return hs.replay(BALL, events, substeps=20)


@pytest.fixture(scope="module")
def compared():
    """Rectangular loops that fill their panel, of two loads, and the model of them behind an instrument."""
    turns = [0, 100, -100, 0, 100, -100, 0, 100, -100, 100]
    u = np.concatenate([[0.0], *(np.linspace(a, b, 21)[1:] for a, b in pairwise(turns))]) * 1e-9
    normal = np.where(np.arange(u.size) < 60, 0.05, 0.1)
    load = 0.2 * normal * np.sign(np.diff(u, prepend=-1e-9))
    record = Measurement(
        np.arange(float(u.size)),
        {"normal_load": normal, "tangential_displacement": u},
        {"tangential_load": load},
    )
    observed = observe(record)
    instrument = hs.Instrument(1e7)
    return Comparison.of(observed, passed(BALL, instrument, observed), instrument)


def figures(history, compared):
    yield hs.plot(history)
    yield hs.plots.measured_loops(hs.loops(history))
    yield hs.plots.measured_loops(compared.measured)
    yield hs.plots.measured_loops(compared.measured, model=compared.model)
    yield hs.plot(compared)
    state = BALL.advance(BALL.initial_state(), normal_load=0.1)
    yield hs.plot(BALL.asperity(0, BALL.advance(state, tangential_load=0.01)))


def test_no_legend_lies_in_a_panel(history, compared):
    legends = 0
    for figure in figures(history, compared):
        figure.draw_without_rendering()
        for legend in [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]:
            legends += 1
            box = legend.get_window_extent()
            # half a pixel of rounding
            assert not any(box.padded(-0.5).overlaps(axes.get_window_extent()) for axes in figure.axes)
    assert legends == 6


def test_loops_have_the_colours_of_their_loads(compared):
    figure = hs.plots.measured_loops(compared.measured, model=compared.model)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["50 mN, 1 loop", "100 mN, 2 loops", "model", "measured, on the right", "model, on the right"]
    lines = {line.get_label(): line for line in figure.axes[0].get_lines() if not line.get_label().startswith("_")}
    first, second, model = (lines[name] for name in texts[:3])
    assert first.get_color() is not second.get_color()
    assert np.abs(first.get_ydata()).max() == pytest.approx(10)
    assert np.abs(second.get_ydata()).max() == pytest.approx(20)
    assert model.get_linestyle() == "--"
