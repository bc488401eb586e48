"""Stresses below a contact, against point loads by quadrature (Boussinesq, Cerruti) and printed values."""

import numpy as np
from golden import check_messages
from numpy.testing import assert_allclose, assert_array_equal
from pairs import GLASS as PAIR
from pairs import UNIT
from pytest import approx, mark, raises

import historysim as hs
from historysim.contact.subsurface import (
    largest_principal,
    normal_stress,
    tangential_stress,
    von_mises,
)
from historysim.results.analysis.peak_stresses import find_peak, slip_amplitude


def unit(nu):
    return {"radius": 1.0, "peak": 1.0, "poissons_ratio": nu}


def point_stress(x, y, z, nu):
    """Stress of unit point loads along z and along x at the origin (Johnson 1985, sections 3.2 and 3.6)."""
    square, rho, c = x * x + y * y, np.sqrt(x * x + y * y + z * z), 1 - 2 * nu
    g = rho + z
    normal = {
        "xx": c / square * ((1 - z / rho) * (x * x - y * y) / square + z * y * y / rho**3)
        - 3 * z * x * x / rho**5,
        "yy": c / square * ((1 - z / rho) * (y * y - x * x) / square + z * x * x / rho**3)
        - 3 * z * y * y / rho**5,
        "zz": -3 * z**3 / rho**5,
        "xy": c / square * (2 * (1 - z / rho) * x * y / square - x * y * z / rho**3)
        - 3 * x * y * z / rho**5,
        "xz": -3 * x * z * z / rho**5,
        "yz": -3 * y * z * z / rho**5,
    }
    a, b = 1 / (rho**3 * g**2), 2 / (rho**2 * g**3)
    along_x = {
        "xx": -3 * x**3 / rho**5 + c * (x / rho**3 - 3 * x / (rho * g**2) + x**3 * (a + b)),
        "yy": -3 * x * y * y / rho**5 + c * (x / rho**3 - x / (rho * g**2) + x * y * y * (a + b)),
        "zz": -3 * x * z * z / rho**5,
        "xy": -3 * x * x * y / rho**5 + c * (-y / (rho * g**2) + x * x * y * (a + b)),
        "xz": -3 * x * x * z / rho**5,
        "yz": -3 * x * y * z / rho**5,
    }
    return [
        np.array(
            [
                [load["xx"], load["xy"], load["xz"]],
                [load["xy"], load["yy"], load["yz"]],
                [load["xz"], load["yz"], load["zz"]],
            ]
        )
        / (2 * np.pi)
        for load in (normal, along_x)
    ]


def by_quadrature(x, y, z, nu, load):
    """Stresses of loads of a radial shape on the unit disc along z and along x, by Gauss over r = sin t."""
    nodes, weights = np.polynomial.legendre.leggauss(120)
    t = (nodes + 1) * np.pi / 4
    angle = np.arange(240) * 2 * np.pi / 240
    at_x, at_y = np.outer(np.sin(t), np.cos(angle)), np.outer(np.sin(t), np.sin(angle))
    weight = (load(np.sin(t)) * np.sin(t) * np.cos(t) * weights * np.pi / 4)[:, np.newaxis] * (
        2 * np.pi / 240
    )
    return [
        (stress * weight).sum(axis=(-2, -1)) for stress in point_stress(x - at_x, y - at_y, z, nu)
    ]


@mark.parametrize("nu", [-0.5, 0.0, 0.3, 0.5])
@mark.parametrize("point", [(0.3, 0.2, 0.4), (-1.4, 0.5, 0.3), (0.0, 0.0, 1.0), (1e-9, 2.0, 0.8)])
def test_stresses_of_a_contact_are_those_of_its_point_loads(point, nu):
    expected = by_quadrature(*point, nu, lambda r: np.sqrt(1 - r * r))
    for function, stress in zip((normal_stress, tangential_stress), expected, strict=True):
        assert_allclose(function(*point, **unit(nu)), stress, atol=2e-12)


def test_the_surface_carries_the_load_and_the_edge_has_the_printed_tension():
    x = np.array([0.0, 0.5, -0.9, 1.0, -1.0, 1.7])
    load = np.sqrt(np.maximum(1 - x * x, 0))
    normal, along = normal_stress(x, 0, 0, **unit(0.3)), tangential_stress(x, 0, 0, **unit(0.3))
    assert_allclose(normal[:, 2, 2], -load, atol=1e-15)
    assert_allclose(along[:, 0, 2], -load, atol=1e-15)
    for nu, mu in ((0.3, 0.3), (0.2, 0.8), (0.5, 0.1)):
        sliding = normal_stress(-1, 0, 0, **unit(nu)) + mu * tangential_stress(-1, 0, 0, **unit(nu))
        # Hamilton 1983: the largest tension of a sliding contact, at its trailing edge
        assert largest_principal(sliding) == approx(
            (1 - 2 * nu) / 3 + (4 + nu) * np.pi * mu / 8, rel=1e-12
        )
    # below the edge the tension falls with the root of the depth: values of quadratures of point
    # loads
    below = [
        (normal_stress(-1, 0, z, **unit(0.3)) + 0.3 * tangential_stress(-1, 0, z, **unit(0.3)))[
            0, 0
        ]
        for z in (0.004, 0.002, 0.001)
    ]
    assert below == approx([0.5060, 0.5435, 0.5709], abs=6e-5)


def test_the_largest_shear_is_below_the_surface_and_reaches_it_under_friction():
    z = np.linspace(0.3, 0.7, 401)
    shear = von_mises(normal_stress(0, 0, z, **unit(0.3))) / 2
    # Johnson 1985, section 4.2: 0.31 p0 at 0.48 a
    assert (z[shear.argmax()], shear.max()) == approx((0.48, 0.31), abs=6e-3)
    ball = hs.Asperity(PAIR, 1e-3, 1.0).advance(normal_load=1e-2)
    depths = []
    for coefficient in (0.1, 0.25, 0.35):
        sliding = hs.Asperity(PAIR, 1e-3, coefficient).advance(
            normal_load=1e-2, tangential_displacement=1e-5
        )
        depths.append(find_peak(sliding, "von_mises", 0.3)[2] / ball.contact_radius)
    assert depths[0] > 0.3
    assert depths[2] == 0.0


def test_any_memory_has_the_stress_of_its_traction():
    ball = hs.Asperity(PAIR, 1e-3, 0.3).advance(normal_load=1e-2).advance(tangential_load=2.5e-3)
    ball = ball.advance(normal_load=1.5e-2).advance(tangential_load=-1e-3)
    radius = ball.contact_radius
    _, along = by_quadrature(0.4, -0.3, 0.5, 0.2, lambda r: ball.traction(r * radius))
    normal, _ = by_quadrature(0.4, -0.3, 0.5, 0.2, lambda r: ball.pressure(r * radius))
    stress = ball.stress(0.4 * radius, -0.3 * radius, 0.5 * radius, poissons_ratio=0.2)
    # the quadrature meets kinks of the traction at the fronts
    assert_allclose(stress, normal + along, atol=2e-4 * ball.pressure(0))
    assert_array_equal(
        stress, ball.stress(*(np.array(point) * radius for point in (0.4, -0.3, 0.5)))
    )
    planar = hs.Asperity(PAIR, 1e-3, 0.3).advance(normal_load=1e-2)
    planar = planar.advance(tangential_load=(1.5e-3, 0.0)).advance(tangential_load=(1e-3, 1.5e-3))
    surface = planar.stress(0.4 * planar.contact_radius, 0.2 * planar.contact_radius, 0.0)
    traction = planar.traction(np.hypot(0.4, 0.2) * planar.contact_radius)
    assert_allclose(-surface[:2, 2], traction, rtol=1e-9)


def test_a_history_has_the_largest_stress_of_each_asperity_and_its_slip():
    ensemble = hs.Ensemble(PAIR, [0.0, -5e-9, -1e-6], 1e-3, 0.3)
    events = [hs.NormalLoad(0.0, 1e-2), hs.TangentialLoad(1.0, 2e-3), hs.TangentialLoad(2.0, -1e-3)]
    peaks = hs.replay(ensemble, events, record="all").contact.peak_stress(poissons_ratio=0.2)
    state = ensemble.initial_state()
    states = [
        state := ensemble.advance(state, normal_load=1e-2, tangential_load=load)
        for load in (0.0, 2e-3, -1e-3)
    ]
    contacts = [ensemble.asperity(1, each) for each in states]
    largest = max(find_peak(each, "tensile", 0.2)[0] for each in contacts)
    assert peaks.tensile[1] == approx(largest, rel=1e-12)
    assert peaks.tensile_step.values.tolist() == [1, 1, -1]
    assert peaks.tensile_x[0] < 0.0
    assert float(peaks.von_mises[2]) == 0.0
    # edge slip of a virgin contact (Johnson 1985, section 7.2)
    middle, full = contacts[1], contacts[1].preliminary_displacement
    q = middle.stick_radius / middle.contact_radius
    edge = (
        full
        / 2
        * ((1 - 2 / np.pi * np.arcsin(q)) * (1 - 2 * q * q) + 2 / np.pi * q * np.sqrt(1 - q * q))
    )
    assert slip_amplitude(contacts[:2]) == approx(edge / 2, rel=1e-4)
    assert peaks.slip_amplitude[1] == approx(slip_amplitude(contacts), rel=1e-9)


def test_what_has_no_stress_is_refused():
    ball = hs.Asperity(UNIT, 1.0, 0.3)
    for wrong, message in (
        ({}, "poissons_ratio is unknown, since the pair has moduli only; expected a number"),
        (
            {"poissons_ratio": 0.6},
            "poissons_ratio is 0.6; expected a number greater than -1 and at most 0.5",
        ),
    ):
        with raises(hs.InputError, match=message):
            ball.advance(normal_displacement=0.1).stress(0, 0, 0, **wrong)


def test_messages():
    check_messages(globals())
