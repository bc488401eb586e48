"""Friction over the normal load: what stands in the picture. That it looks well was seen by eye."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import historysim as hs


@pytest.fixture(scope="module")
def found():
    return hs.loops("scenarios/15_instrument_in_series.toml")


def test_each_load_has_its_means_and_their_scatter(found):
    table = found.by_load()
    force, friction, displacement, energy = hs.plots.loop_levels(table.to_dataset(), title="of $5").axes
    assert [axes.get_title(loc="left") for axes in (force, friction, displacement, energy)] == [
        "friction force (mN)",
        "friction coefficient",
        "preliminary displacement (nm)",
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
    assert_allclose(line.get_ydata(), 1e3 * table.friction_line().slope * line.get_xdata() / 1e3, atol=0.01)


def test_amplitudes_stand_in_place_of_loads(found):
    axes = hs.plot(found.by_amplitude()).axes
    assert axes[2].get_xlabel() == "amplitude (nm)"
    assert all(len(line.get_xdata()) < 60 for line in axes[0].lines)
