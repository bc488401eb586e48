"""Contents of the pictures of friction loops; their looks are covered by the reference pictures."""

import numpy as np
import pytest

import historysim as hs
from historysim.measured.loops import loops_of_channels


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
