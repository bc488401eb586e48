import numpy as np
import pytest
from adhesive import ELASTIC, EPS, PULL, E, R, W

from historysim.contact import hertz
from historysim.contact.adhesion import (
    dmt_approach,
    dmt_contact_radius,
    dmt_normal_load,
    dmt_pull_off_load,
    jkr_approach,
    jkr_contact_radius,
    jkr_normal_load,
)


def test_dmt_is_hertz_under_a_greater_load():
    loads = np.array([-2, -1, 0, 5]) * PULL
    a = dmt_contact_radius(loads, **ELASTIC)
    np.testing.assert_allclose(a**3, 0.75 * R * (loads + 2 * PULL) / E, rtol=16 * EPS, atol=0)
    np.testing.assert_allclose(dmt_normal_load(a, **ELASTIC), loads, atol=16 * EPS * PULL, rtol=8 * EPS)
    np.testing.assert_allclose(dmt_approach(a, summit_radius=R), a**2 / R, rtol=4 * EPS)
    assert dmt_pull_off_load(summit_radius=R, work_of_adhesion=W) == pytest.approx(-2 * PULL, rel=4 * EPS)


def test_jkr_and_dmt_without_adhesion_are_hertz():
    elastic = {**ELASTIC, "work_of_adhesion": 0}
    depth = hertz.approach(1e-6, summit_radius=R, contact_modulus=E)
    a = hertz.contact_radius(depth, summit_radius=R)
    for radius, load in ((jkr_contact_radius, jkr_normal_load), (dmt_contact_radius, dmt_normal_load)):
        assert radius(1e-6, **elastic) == pytest.approx(a, rel=8 * EPS)
        assert load(a, **elastic) == pytest.approx(1e-6, rel=16 * EPS)
        assert radius(0, **elastic) == 0
    assert jkr_approach(a, **elastic) == pytest.approx(depth, rel=16 * EPS)
