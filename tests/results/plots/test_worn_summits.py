"""Pictures of wear: volumes over time, and summits before and after."""

from pathlib import Path

import pytest

import historysim as hs
from historysim.errors import InputError

SCENARIO = Path(__file__).parents[3] / "scenarios" / "25_wear.toml"


def test_the_picture_of_wear_shows_wear():
    history = hs.run(SCENARIO)
    left, right = hs.plot(history, picture="wear").axes
    total, *each = left.get_lines()
    assert total.get_ydata() == pytest.approx(history.worn_volume.sum("asperity").values * 1e27)
    assert sum(line.get_ydata()[-1] for line in each) == pytest.approx(total.get_ydata()[-1])
    before, after = right.get_lines()
    assert (after.get_xdata() < before.get_xdata()).all()
    # the usual picture has it, too, and so have chosen panels
    titles = [axes.get_title(loc="left") for axes in hs.plot(history).axes]
    assert "Wear" in titles
    assert [axes.get_title(loc="left") for axes in hs.plot(history, panels=["wear"]).axes] == ["Wear"]


def test_what_does_not_wear_has_none():
    history = hs.run(SCENARIO.with_name("05_normal_down_tangential_up.toml"))
    for options in ({"picture": "wear"}, {"panels": ["wear"]}):
        with pytest.raises(InputError, match="no worn_volume; expected one of a scenario with"):
            hs.plot(history, **options)
