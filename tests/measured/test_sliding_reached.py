"""Branches that end before they slide: their friction is reported as a lower bound and excluded from the means."""

import numpy as np
import pytest
import synthetic

from historysim.errors import InputError
from historysim.measured.branches import Definitions
from historysim.measured.loops import loops_of_channels, loops_of_measurement
from historysim.results.tables import loop_summary as summary


def short(noise=1.0, **shape):
    """Give loops of ±50 nm behind the instrument: the ball slides at 2 θμδ and what the load bends, beyond ±55 nm."""
    return synthetic.measured("ball", 0, amplitude=50e-9, loads=(0.05,), loops=4, noise=noise, **shape)


def test_what_does_not_slide_is_a_lower_bound():
    found = loops_of_measurement(short())
    assert found.rising_branches.all()
    # it is 0.20, and the means say 0.18
    assert found.friction_coefficient == pytest.approx(np.full((3, 2), 0.184), abs=2e-3)
    for name in ("friction_force", "friction_coefficient", "preliminary_displacement"):
        assert found.statistics(name).count == 0
        assert np.isnan(found.statistics(name).mean)
    assert found.text("friction_coefficient", "1").startswith("≥ 0.184")
    (note,) = found.notes
    assert note.startswith(
        "6 of 6 branches do not reach sliding: the load still rises by more than 5 % where it should"
    )
    # what does not need sliding stays
    assert found.statistics("dissipated_energy").count == found.statistics("tangential_stiffness").count == 3
    assert found.by_load().laws() == []


def test_what_slides_says_nothing():
    for seed in range(3):
        found = loops_of_measurement(synthetic.measured("ball", seed, amplitude=60e-9, loads=(0.05,), loops=4))
        assert not found.rising_branches.any()
        assert found.notes == ()
        assert found.text("friction_coefficient", "1").startswith(("0.2", "0.199"))


def test_those_that_slid_make_the_mean():
    """At 20 mN they slide, at 50 mN they do not."""
    found = loops_of_measurement(
        synthetic.measured("ball", 0, amplitude=50e-9, loads=(0.02, 0.05), loops=3, noise=0.1),
    )
    slid = ~found.rising_branches & np.isfinite(found.friction_force)
    assert slid.any()
    assert found.rising_branches.any()
    assert found.statistics("friction_coefficient").mean == pytest.approx(0.2, rel=2e-3)
    assert found.statistics("friction_coefficient").count == slid.all(axis=1).sum()
    table = dict(zip(found.by_load().value.round(3), found.by_load().statistics("friction_coefficient"), strict=True))
    assert table[0.02].count > 0
    assert table[0.05].count == 0


@pytest.mark.parametrize("loads", [(0.05,), (0.02, 0.05)])
def test_a_file_of_loops_shows_the_same(loads):
    record = synthetic.measured("ball", 0, amplitude=50e-9, loads=loads, loops=4, noise=1.0)
    found = loops_of_measurement(record)
    lines = dict(summary(found.to_dataset()))
    assert lines["friction coefficient"] == found.text("friction_coefficient", "1")
    assert lines["stiffness at reversal"] == found.text("tangential_stiffness", "N m-1")


def test_scatter_is_no_rise_and_the_share_can_be_chosen():
    random, way = np.random.default_rng(0), np.concatenate([np.linspace(-1, 1, 400), np.linspace(1, -1, 400)])
    moved = np.tile(way, 4)
    force = np.where(np.tile(np.repeat([1, -1], 400), 4) > 0, 1.0, -1.0) + random.normal(0, 0.3, moved.size)
    assert not loops_of_channels(np.arange(moved.size), moved, force).rising_branches.any()
    time = np.arange(moved.size)
    # friction that rises evenly by 8 % over the last quarter, as that of a friction damper does, and by 16 %
    for tilt, rising in ((0.16, False), (0.32, True)):
        tilted = np.where(np.tile(np.repeat([1, -1], 400), 4) > 0, 1.0, -1.0) + tilt * moved
        assert (loops_of_channels(time, moved, tilted).rising_branches == rising).all()
    wide = Definitions(still_rising=0.1)
    assert not loops_of_channels(time, moved, tilted, definitions=wide).rising_branches.any()
    with pytest.raises(InputError, match="still_rising of Definitions is 2; expected a share"):
        Definitions(still_rising=2)
