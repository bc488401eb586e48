import math

import numpy as np
import pytest
from adhesive import ELASTIC, EPS, PULL, R, W, contact, moduli, powers, radii, works
from hypothesis import given

from historysim.contact.adhesion import load_parameter, maugis_parameter, tabor_parameter, work_of_adhesion
from historysim.errors import InputError


def test_parameters_of_a_tip():
    # by hand: R W²/E² = 2e-6 (0.08/5e9)² = 5.12e-28, its cube root 8e-10; over z0 = 0.4 nm
    arguments = {**ELASTIC, "equilibrium_separation": 0.4e-9}
    assert tabor_parameter(**arguments) == pytest.approx(2.0, rel=8 * EPS)
    assert maugis_parameter(**arguments) == pytest.approx(2.0 * 1.15701, rel=1e-5)
    assert load_parameter(-3e-7, summit_radius=R, work_of_adhesion=W) == pytest.approx(-3e-7 / PULL, rel=4 * EPS)


@given(powers, radii, moduli, works)
def test_maugis_parameter_follows_its_definition(power, radius, modulus, work):
    assert maugis_parameter(**contact(10**power, radius, modulus, work)) == pytest.approx(10**power, rel=32 * EPS)


def test_work_of_adhesion():
    # silicon on float glass
    assert work_of_adhesion(44.1e-3, 83.4e-3) == pytest.approx(2e-3 * math.sqrt(44.1 * 83.4), rel=4 * EPS)
    assert work_of_adhesion(44.1e-3, 83.4e-3, 20e-3) == pytest.approx(107.5e-3, rel=4 * EPS)
    assert work_of_adhesion(0.05, 0.05) == pytest.approx(0.1, rel=4 * EPS)
    assert work_of_adhesion(0.05, 0.05, 0) == pytest.approx(0.1, rel=4 * EPS)
    np.testing.assert_allclose(work_of_adhesion([1, 4], 9), [6, 12], rtol=4 * EPS)
    with pytest.raises(InputError, match="which do not adhere; expected an interfacial energy less than"):
        work_of_adhesion(0.02, 0.03, 0.06)
