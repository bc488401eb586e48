"""Contents of the pictures of friction loops; their looks are covered by the reference pictures."""

import numpy as np
import pictured
import pytest
from numpy.testing import assert_allclose
from pictured import levels

import historysim as hs
from historysim.measured.loops import loops_of_channels
from historysim.results import analysis
from historysim.results.plots import style

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))


@pytest.fixture(scope="module")
def model():
    events = [hs.NormalLoad(0.0, 50e-3)]
    events += [hs.TangentialDisplacement(1.0 + i, 60e-9 * (-1) ** i) for i in range(8)]
    return analysis.friction_loops(hs.replay(hs.Ensemble(PAIR, 0.0, 2.5e-3, 0.12), events, substeps=50))


@pytest.fixture(scope="module")
def measured(model):
    record = model.trace
    noise = np.random.default_rng(1).normal(size=(2, record.time.size))
    return loops_of_channels(
        record.time,
        record.displacement + 0.1e-9 * noise[0],
        1.1 * record.tangential_load + 2e-5 * noise[1],
        50e-3,
        dead_band=5e-9,
        skip=1,
    )


def drawn(loops, model=None, **options):
    figure = hs.plots.measured_loops(loops, model=model, **options)
    return figure, figure.axes


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_loops_and_their_means_are_drawn(model):
    figure, (loops, *trends) = drawn(model)
    assert figure.get_size_inches()[0] * 25.4 == pytest.approx(180)
    assert loops.get_xlabel() == "tangential displacement $U$ (nm)"
    assert loops.get_ylabel() == "tangential load $T$ (mN)"
    assert legend(figure) == ["3 loops", "means", "forward", "backward", style.MOVED]
    texts = [text.get_text() for text in loops.texts if text.get_text()]
    way = model.statistics("preliminary_displacement").mean
    stiffness = model.statistics("tangential_stiffness").mean
    assert texts == ["6 mN", "6 mN", f"{way * 1e9:.3g} nm", f"{stiffness / 1e3:.3g} kN/m"]
    forward, backward, reached = (line for line in loops.get_lines() if line.get_linestyle() == "--")
    assert forward.get_ydata() == pytest.approx([6e-3, 6e-3])
    assert backward.get_ydata() == pytest.approx([-6e-3, -6e-3])
    assert reached.get_xdata() == pytest.approx(2 * [way - 60e-9])
    assert [axes.get_title(loc="left") for axes in trends] == [
        "friction force (mN)",
        "preliminary displacement (nm)",
        "stiffness at reversal (kN/m)",
        "energy per loop (nJ)",
    ]


def test_coordinates_of_a_stage_are_drawn_from_their_middle(measured):
    trace = measured.trace
    far = loops_of_channels(trace.time, trace.displacement - 0.11, trace.tangential_load, trace.normal_load)
    axes = hs.plots.measured_loops(far).axes[0]
    low, high = axes.get_xlim()
    drawn = max(np.ptp(line.get_xdata()) for line in axes.lines)
    # what is drawn fills the axes, whatever the unit
    assert drawn > 0.8 * (high - low)
    assert axes.get_xlabel().startswith("tangential displacement $U$ (")
    assert axes.get_xlabel().endswith("(nm), from −110 mm")


def test_each_loop_is_a_mark_for_each_direction_and_one_for_its_energy():
    found = pictured.loops()
    figure = hs.plots.loop_trends(found.to_dataset())
    force, *_, energy = figure.axes
    assert force.get_title(loc="left") == "friction force (mN)"
    forward, backward, mean = force.get_lines()
    assert_allclose(forward.get_ydata(), 1e3 * found.friction_force[:, 0])
    assert_allclose(backward.get_ydata(), 1e3 * found.friction_force[:, 1])
    assert mean.get_ydata()[0] == pytest.approx(1e3 * found.statistics("friction_force").mean)
    marks, _ = energy.get_lines()
    assert_allclose(marks.get_ydata(), 1e9 * found.dissipated_energy)
    assert figure.get_suptitle() == f"{len(found)} friction loops"


def test_each_load_has_its_means_and_their_scatter():
    found = levels()
    table = found.by_load()
    force, displacement, friction, energy = hs.plots.loop_levels(table.to_dataset(), title="of $5").axes
    assert [axes.get_title(loc="left").split("\n")[0] for axes in (force, displacement, friction, energy)] == [
        "friction force (mN)",
        "preliminary displacement (nm)",
        "friction coefficient",
        "energy per loop (nJ)",
    ]
    for axes, quantity, factor in ((force, "friction_force", 1e3), (displacement, "preliminary_displacement", 1e9)):
        for bars, direction in zip(axes.containers, ("forward", "backward", "both"), strict=True):
            means = [each.mean for each in table.statistics(quantity, direction)]
            assert_allclose(bars.lines[0].get_ydata(), factor * np.array(means))
            scatter = np.array([each.standard_deviation for each in table.statistics(quantity, direction)])
            lengths = np.array([np.ptp(segment[:, 1]) for segment in bars.lines[2][0].get_segments()])
            assert_allclose(lengths, 2 * factor * np.nan_to_num(scatter), atol=1e-9)
    line = next(line for line in force.lines if len(line.get_xdata()) == 60)
    assert_allclose(line.get_ydata(), 1e3 * table.friction_line().slope * line.get_xdata(), atol=0.01)


def test_means_are_marked_at_a_loop_that_they_are_of():
    """Most loops are small and left out of the means; the one that is drawn strong is a large one."""
    time = np.arange(4000) * 5e-3
    moved = np.where(time < 5, 100e-6, 30e-6) * np.sin(2 * np.pi * time)
    load = np.zeros(time.size)
    for i in range(1, time.size):
        load[i] = np.clip(load[i - 1] + 0.5e6 * (moved[i] - moved[i - 1]), -10, 10)
    found = loops_of_channels(time, moved, load, 50.0)
    assert not found.large.all()
    figure = hs.plot(found)
    strong = max(figure.axes[0].get_lines(), key=lambda line: line.get_linewidth())
    assert np.abs(strong.get_xdata()).max() == pytest.approx(100e-6, rel=1e-3)
