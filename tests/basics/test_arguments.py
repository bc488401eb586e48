"""Arguments that are numbers in SI."""

import numpy as np
import pytest

import historysim as hs
from historysim.basics.arguments import one_per


def radii(values, count=None):
    return one_per("summit", "summits", "radius", values, count, above=0)


def test_one_number_stands_for_all():
    np.testing.assert_array_equal(radii(2, 3), [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(radii(2), [2.0])
    np.testing.assert_array_equal(radii([1, 2, 3], 3), [1.0, 2.0, 3.0])
    assert radii([]).shape == radii([], 0).shape == (0,)


def test_it_is_an_array_of_its_own_that_cannot_be_changed():
    given = np.array([1.0, 2.0])
    for array in (radii(given), radii(given, 2), radii(1, 2)):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5.0
    kept = radii(given)
    given[0] = 7.0
    assert kept[0] == 1.0


@pytest.mark.parametrize(
    ("values", "count", "message"),
    [
        ([[1, 2]], None, r"radius has shape \(1, 2\); expected one number, or a list with one per summit"),
        ([1, 2], 3, "radius has 2 values for 3 summits; expected one, or one per summit"),
        ([1, 2], 1, "radius has 2 values for 1 summit; expected one, or one per summit"),
        ([], 2, "radius has 0 values for 2 summits"),
        ([1, 0], 2, r"radius\[1\] is 0; expected a finite number greater than 0"),
        ("high", None, "radius is 'high'; expected numbers in SI"),
        ("5", None, "radius is '5'; expected numbers in SI"),
        (True, None, "radius is True; expected numbers in SI"),
        ([1, 2j], None, r"radius is \[1, 2j\]; expected numbers in SI"),
    ],
)
def test_what_does_not_fit_is_refused(values, count, message):
    with pytest.raises(hs.InputError, match=message):
        radii(values, count)
