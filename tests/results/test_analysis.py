"""What a history says about its contact."""

import numpy as np
from golden import refused
from pairs import COMPLIANT as PAIR
from pytest import approx, fixture

import historysim as hs
from historysim.results import analysis

RATIO = 40 / (4 * 8)

HEIGHTS = np.array([0.0, -20e-9, -10e-9, -500e-9])
RADII = np.array([10e-6, 20e-6, 15e-6, 10e-6])
FRICTION = np.array([0.1, 0.3, 0.2, 0.4])
EVENTS = [
    hs.NormalDisplacement(0.0, 60e-9),
    hs.TangentialDisplacement(1.0, 5e-9),
    hs.NormalDisplacement(2.0, 12e-9),
]


@fixture(scope="module")
def history():
    return hs.replay(hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION), EVENTS, hold=False)


def by_hand(approach):
    return RATIO * FRICTION * np.maximum(HEIGHTS + approach, 0.0)


def test_preliminary_displacement_is_the_greatest_of_all_asperities(history):
    found = analysis.preliminary_displacement(history)
    assert found.values == approx(
        [by_hand(approach).max() for approach in (60e-9, 36e-9, 12e-9)], rel=1e-12
    )
    assert found.attrs["units"] == "m"


def test_the_critical_asperity_need_not_be_the_highest(history):
    assert analysis.critical_asperity(history).values.tolist() == [1, 2, 0]


def test_nothing_is_critical_without_contact():
    history = hs.replay(
        hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION), [hs.NormalDisplacement(0.0, -1e-9)]
    )
    assert analysis.preliminary_displacement(history).values.tolist() == [0.0]
    assert analysis.critical_asperity(history).values.tolist() == [-1]
    assert dict(analysis.summary(history))["critical asperity"] == "none"


def test_drift_is_the_change_of_the_preliminary_displacement(history):
    expected = by_hand(60e-9).max() - by_hand(12e-9).max()
    assert analysis.drift(history, 0, -1) == approx(expected, rel=1e-12)
    assert analysis.drift(history, 2, 0) == analysis.drift(history, 0, -1)
    assert analysis.drift(history, 1, 1) == 0
    with refused("step 3: the history has 3 steps"):
        analysis.drift(history, 0, 3)


def test_friction_is_recorded_one_by_one_only_where_it_differs():
    later = tuple(FRICTION[::-1].tolist())
    events = [*EVENTS[:2], hs.FrictionChange(1.0, later), EVENTS[2], hs.FrictionChange(3.0, 0.5)]
    found = hs.replay(
        hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION), events, substeps=2, record="all", hold=False
    )
    assert found.present_friction.dims == ("step", "asperity")
    expected = [FRICTION] * 2 + [later] * 4 + [np.full(4, 0.5)]
    assert found.present_friction.values.tolist() == [list(row) for row in expected]
    approach = HEIGHTS.max() - found.separation.values
    capacity = RATIO * np.array(expected) * np.maximum(HEIGHTS + approach[:, np.newaxis], 0.0)
    assert analysis.preliminary_displacement(found).values == approx(
        capacity.max(axis=1), rel=1e-12
    )
    assert analysis.critical_asperity(found).values.tolist() == capacity.argmax(axis=1).tolist()
    assert "present_friction" not in hs.replay(
        hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION), events, record="totals", hold=False
    )


def test_all_asperities_that_touch_have_to_be_recorded(history):
    ensemble = hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION)
    for record in ("totals", [1], [0, 3]):
        part = hs.replay(ensemble, EVENTS, record=record, hold=False)
        with refused("does not hold all asperities that touch"):
            analysis.preliminary_displacement(part)
        assert dict(analysis.summary(part))["preliminary displacement"].startswith("not available")
    for record in ("touching", "all", [2, 0, 1]):
        other = hs.replay(ensemble, EVENTS, record=record, hold=False)
        assert (
            analysis.preliminary_displacement(other) == analysis.preliminary_displacement(history)
        ).all()


def test_the_summary_is_readable(history):
    summary = dict(analysis.summary(history))
    normal = 4 / 3 * 40e9 * np.sum(np.sqrt(RADII) * np.maximum(HEIGHTS + 60e-9, 0) ** 1.5)
    assert summary["steps"] == "3 over 2 s"
    assert summary["asperities touched"] == "3 of 4"
    assert summary["peak normal load"] == f"{normal * 1e3:.4g} mN"
    expected = f"{by_hand(60e-9).max() * 1e9:.4g} nm under {normal * 1e3:.4g} mN, loaded from rest"
    assert summary["preliminary displacement"] == expected
    assert summary["critical asperity"] == "1, the last to slide"
    assert summary["dissipated energy"].endswith("J")


def test_the_summary_reports_loads_held_at_the_limit(history):
    events = [hs.NormalLoad(0.0, 1e-3), hs.TangentialLoad(1.0, 1e-3)]
    held = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-5, 0.2), events, saturate=True)
    assert dict(analysis.summary(held))["held at the limit"] == "1 steps"
    assert "held at the limit" not in dict(analysis.summary(history))
