"""Arguments that are numbers in SI."""

import numpy as np
import pytest
from golden import check_messages
from numpy.testing import assert_array_equal

from historysim.basics.arguments import as_floats, as_item_array, per_axis, scalar


def radii(values, count=None):
    return as_item_array("summit", "summits", "radius", values, count, above=0)


def test_one_number_stands_for_all():
    assert_array_equal(radii(2, 3), [2.0, 2.0, 2.0])
    assert_array_equal(radii(2), [2.0])
    assert_array_equal(radii([1, 2, 3], 3), [1.0, 2.0, 3.0])
    assert radii([]).shape == radii([], 0).shape == (0,)


def test_it_is_an_array_of_its_own_that_cannot_be_changed():
    given = np.array([1.0, 2.0])
    for array in (radii(given), radii(given, 2), radii(1, 2)):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5.0
    kept = radii(given)
    given[0] = 7.0
    assert kept[0] == 1.0


def test_texts_with_units_come_where_the_name_has_a_unit():
    assert_array_equal(as_floats("summit_height", ["1 µm", -2e-6]), [1e-6, -2e-6])
    assert scalar("normal_load", "50 mN", above=0) == 0.05
    assert per_axis("pixel_size", "1 µm") == (1e-6, 1e-6)


def test_quantities_of_pint_lose_their_unit_nowhere_unseen():
    unit = pytest.importorskip("pint").UnitRegistry()
    assert as_floats("friction", unit.Quantity(20, "percent")) == 0.2


def test_messages():
    check_messages(globals())
