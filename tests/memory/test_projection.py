"""Rows of one group, written column by column, are those of several, put in order; and rounding is as written."""

import numpy as np
import pytest

import historysim as hs
from historysim.memory.compiled import reordered, short

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
FRICTION = 0.3


def history_of(friction, record):
    """Loops within one another at three approaches, at the last of which fewer asperities touch than before."""
    rng = np.random.default_rng(4)
    ensemble = hs.Ensemble(PAIR, rng.normal(0.0, 0.01, 40), rng.uniform(0.5, 2.0, 40), friction)
    events = [hs.NormalDisplacement(0.0, -0.01)]
    for time, (approach, displacement) in enumerate(
        [(0.02, 0.0), (0.03, 0.012), (0.03, -0.008), (0.035, 0.005), (0.035, -0.002), (0.035, 0.0), (0.025, 0.001)], 1
    ):
        events += [hs.NormalDisplacement(time, approach), hs.TangentialDisplacement(time, displacement)]
    return hs.replay(ensemble, events, substeps=3, record=record)


@pytest.mark.parametrize("record", ["all", [1, 17, 30, 39]])
def test_one_group_is_recorded_as_two_that_differ_by_rounding(record):
    one = history_of(FRICTION, record)
    both = np.where(np.arange(40) % 2, FRICTION, np.nextafter(FRICTION, 1.0))
    two = history_of(both, record)
    touches = two.normal_load.values > 0
    assert touches.any()
    assert not touches.all()
    limit = FRICTION * float(two.normal_load.max())
    # some ten sums, each of which rounds by less than the limit times 1e-16, and as many of the edges' displacements
    np.testing.assert_allclose(one.tangential_load, two.tangential_load, rtol=0, atol=1e-14 * limit)
    for name in ("normal_load", "contact_radius", "slip_state"):
        np.testing.assert_array_equal(one[name], two[name], err_msg=name)
    # where slip ends is a root of what rounding changes
    radius = float(two.contact_radius.max())
    np.testing.assert_allclose(one.stick_radius**2, two.stick_radius**2, rtol=0, atol=1e-13 * radius**2)


def test_asperities_that_do_not_touch_hold_zeros_that_are_positive():
    for friction in (FRICTION, np.linspace(FRICTION, 0.4, 40)):
        history = history_of(friction, "all")
        apart = history.normal_load.values == 0
        for name in ("normal_load", "tangential_load", "contact_radius", "stick_radius", "slip_state"):
            values = history[name].values[apart]
            assert not values.any(), name
            assert not np.signbit(values).any(), name


def test_what_a_reordered_function_is_the_first_to_call_is_rounded_as_written():
    @short
    def scaled(value, unit):
        return value * unit

    @reordered
    def products(first, second, unit, found):
        for i in range(found.size):
            found[i] = scaled(first[i] * second[i], unit)

    rng = np.random.default_rng(5)
    first, second = rng.uniform(1.0, 2.0, (2, 64))
    found = np.empty(64)
    products(first, second, 1 / 3, found)
    assert (first * (second * (1 / 3)) != first * second * (1 / 3)).any()
    np.testing.assert_array_equal(found, first * second * (1 / 3))
