import numpy as np
import pytest

from historysim.asperities.friction import coulomb
from historysim.errors import InputError


def test_one_coefficient_serves_all():
    assert np.array_equal(coulomb(0.3, 4), [0.3, 0.3, 0.3, 0.3])
    assert np.array_equal(coulomb([0.3], 2), [0.3, 0.3])


def test_one_coefficient_per_asperity_is_kept_and_copied():
    given = np.array([0.1, 0.2, 0.0])
    coefficients = coulomb(given, 3)
    given[0] = 9.0
    assert np.array_equal(coefficients, [0.1, 0.2, 0.0])


@pytest.mark.parametrize(
    ("friction", "complaint"),
    [
        (-0.1, "friction"),
        ([0.1, -1e-300], "friction"),
        (np.nan, "friction"),
        (np.inf, "friction"),
        ("rough", "friction"),
        ([0.1, 0.2, 0.3], "one for each of 2 asperities"),
        ([], "one for each of 2 asperities"),
        ([[0.1, 0.2]], "one for each of 2 asperities"),
    ],
)
def test_bad_coefficients_are_refused(friction, complaint):
    with pytest.raises(InputError, match=complaint):
        coulomb(friction, 2)
