"""The picture of yielding: which parts of the loading curve yield, and the summits before and after."""

from pathlib import Path

import numpy as np
import pytest

import historysim as hs
from historysim.errors import InputError

SCENARIO = Path(__file__).parents[3] / "scenarios" / "26_running_in.toml"


def test_the_picture_shows_first_loading_and_flattened_summits():
    history = hs.run(SCENARIO)
    figure = hs.plot(history, picture="yielding")
    figure.draw_without_rendering()
    left, right = figure.axes
    yielding, elastic = (line.get_ydata() for line in left.get_lines())
    assert np.nanmax(yielding) == pytest.approx(90, rel=1e-6)
    # 50 mN is come back to without yielding
    assert np.nanmin(elastic) == pytest.approx(50, rel=1e-6)
    *_, before, after = right.get_lines()
    assert before.get_xdata().size == int((history.yielding_load.isel(step=-1) > 0).sum())
    assert (after.get_xdata() < before.get_xdata()).all()
    assert (after.get_ydata() > before.get_ydata()).all()


def test_what_does_not_yield_has_none():
    history = hs.run(SCENARIO.with_name("05_normal_down_tangential_up.toml"))
    with pytest.raises(InputError, match="no yielded_depth; expected one of a scenario with surface"):
        hs.plot(history, picture="yielding")
