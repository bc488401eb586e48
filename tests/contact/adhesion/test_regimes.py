import math

import numpy as np
import pytest
from adhesive import PULL, E, R, contact, moduli, radii, works
from hypothesis import given
from hypothesis import strategies as st

from historysim.contact import hertz
from historysim.contact.adhesion import Regime, hertz_boundary, maugis_contact_radius, regime, rigid_boundary
from historysim.errors import LoadError


def test_hertz_where_adhesion_is_a_twentieth_of_the_load():
    for parameter in (1e-3, 0.03, 0.4, 3, 100):
        arguments = contact(parameter)
        load = hertz_boundary(parameter) * PULL
        a = maugis_contact_radius(load, **arguments)
        assert 4 * E * a**3 / (3 * R) == pytest.approx(1.05 * load, rel=1e-11)
        assert regime(parameter, load / PULL * (1 + 1e-9)) is Regime.HERTZ
        assert regime(parameter, load / PULL * (1 - 1e-9)) is not Regime.HERTZ
    # DMT: 2 = 0.05 P; JKR: A³ - √6 A^(3/2) = P and A³ = 1.05 P
    np.testing.assert_allclose(hertz_boundary([1e-12, 1e12]), [40, 2520], rtol=1e-6)
    assert np.all(np.diff(hertz_boundary(np.logspace(-3, 3, 61))) > 0)


@given(st.floats(-4, -1.01), st.floats(-1.9, 39), radii, moduli, works)
def test_rigid_where_the_compression_is_a_twentieth_of_the_separation(power, share, radius, modulus, work):
    arguments = contact(10**power, radius, modulus, work)
    load = (share + 2) * math.pi * work * radius
    compression = hertz.approach(load, summit_radius=radius, contact_modulus=modulus)
    rigid = compression / (0.05 * arguments["equilibrium_separation"])
    expected = Regime.RIGID if rigid < 1 else Regime.DMT
    if abs(rigid - 1) > 1e-9:
        assert regime(10**power, share) is expected
        assert (share < rigid_boundary(10**power)) == (rigid < 1)


def test_the_rigid_boundary_is_where_the_compression_is_a_twentieth_of_the_separation():
    for parameter in (1e-4, 1e-2, 0.0999):
        load = (rigid_boundary(parameter) + 2) * PULL
        compression = hertz.approach(load, summit_radius=R, contact_modulus=E)
        # the load is a difference from 2, which costs some digits at large λ
        assert compression / contact(parameter)["equilibrium_separation"] == pytest.approx(0.05, rel=1e-12)


@pytest.mark.parametrize(
    ("parameter", "load", "expected"),
    [
        (1e-3, 1, Regime.RIGID),
        (1e-3, 41, Regime.HERTZ),
        (0.05, 1, Regime.DMT),
        (0.05, -1.9, Regime.RIGID),
        (0.05, -2, Regime.RIGID),
        (0.0999, 0, Regime.DMT),
        (0.1, 0, Regime.MAUGIS),
        (1, -1.6, Regime.MAUGIS),
        (5, 0, Regime.MAUGIS),
        (5.001, 0, Regime.JKR),
        (1e6, -1.5, Regime.JKR),
        (1e6, 2519, Regime.JKR),
        (1e6, 2521, Regime.HERTZ),
    ],
)
def test_regimes(parameter, load, expected):
    assert regime(parameter, load) is expected
    assert regime(np.array([parameter]), [load]).tolist() == [expected]


def test_regimes_of_arrays_and_names():
    zones = regime(np.array([1e-3, 0.05, 1, 10])[:, None], [1, 1e4])
    assert zones.shape == (4, 2)
    assert [str(zone) for zone in zones[:, 0]] == ["rigid", "dmt", "maugis", "jkr"]
    assert set(zones[:, 1]) == {"hertz"}


@pytest.mark.parametrize(("parameter", "load"), [(0.01, -2.01), (1, -1.61), (1e3, -1.501)])
def test_no_regime_beyond_pull_off(parameter, load):
    with pytest.raises(LoadError, match=r"load_parameter of .* πWR pulls harder .* pull-off load of -\d"):
        regime(parameter, load)
