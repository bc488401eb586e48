import itertools
import math

import numpy as np
from golden import check_messages
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx, mark
from scipy.integrate import quad

from historysim.contact import hertz
from historysim.contact.materials import MaterialPair, material
from historysim.contact.mindlin import (
    counter_slip_radius,
    displacement_after_reversal,
    dissipated_energy_per_loop,
    preliminary_displacement,
    stick_radius,
    tangential_displacement,
    tangential_stiffness,
    traction,
    traction_after_reversal,
)

EPS = np.finfo(float).eps

PAIR = MaterialPair(material("silicon"), material("float glass"))
R, N, MU = 2.5e-3, 50e-3, 0.2
G = PAIR.shear_modulus
DEPTH = float(hertz.approach(N, summit_radius=R, contact_modulus=PAIR.contact_modulus))
A = float(hertz.contact_radius(DEPTH, summit_radius=R))
LIMIT = MU * N
SLIPPING = {"normal_load": N, "contact_radius": A, "friction": MU}
CONTACT = SLIPPING | {"shear_modulus": G}

shares = st.floats(1e-3, 1)


def signed(size):
    return st.floats(-size, size)


# -- numbers ---------------------------------------------------------------------------------------

# 1 - (1-f)^(2/3), 1 - (1-f)^(5/3) - (5f/6)(1 + (1-f)^(2/3)) and (1-f)^(1/3), literally, by mpmath
# with 100 digits for the double nearest to f
REFERENCE = [
    (1e-12, 6.6666666666677776437e-13, 3.08641975308847718e-38, 0.99999999999966666667),
    (1e-5, 6.6666777778271613273e-6, 3.0864403293621417421e-17, 0.99999666665555549383),
    (0.001, 0.00066677782718931964368, 3.0884788076520991113e-11, 0.99966655549378597802),
    (0.3, 0.21162648368947570979, 0.0010451595050019320965, 0.88790400174260071312),
    (0.9, 0.78455653099681165972, 0.066873051347289893052, 0.46415888336127785489),
    (0.999999, 0.99989999999999808296, 0.16658416664999842643, 0.010000000000095852215),
]


@mark.parametrize("f, displacement, energy, radius", REFERENCE)
def test_numbers_of_many_digits(f, displacement, energy, radius):
    unit = {"normal_load": 1, "contact_radius": 1, "friction": 1}
    # the cube in the energy takes three times the few roundings of its base
    assert stick_radius(f, **unit) == approx(radius, rel=4 * EPS)
    assert tangential_displacement(f, **unit, shear_modulus=3 / 16) == approx(
        displacement, rel=8 * EPS
    )
    assert dissipated_energy_per_loop(f, **unit, shear_modulus=0.9) == approx(energy, rel=24 * EPS)


# -- virgin loading --------------------------------------------------------------------------------


def spring_force(displacement):
    """T of a row of springs that each carry at most μ times their normal force."""
    # 4 G* U = μ E* (δ - x²/R) is where the springs begin to slip
    edge = math.sqrt(R * max(DEPTH - 4 * G * displacement / (MU * PAIR.contact_modulus), 0))
    slips = quad(lambda x: MU * PAIR.contact_modulus * (DEPTH - x**2 / R), edge, A)[0]
    return 2 * (4 * G * displacement * edge + slips)


@mark.parametrize("share", [0.01, 0.3, 0.7, 0.99])
def test_virgin_loading_agrees_with_a_row_of_springs(share):
    displacement = share * PAIR.displacement_ratio * MU * DEPTH
    load = spring_force(displacement)
    # dδ/dT = 1/(8 G* c) lifts the error of the quadrature by a/c ≤ 10
    assert tangential_displacement(load, **CONTACT) == approx(displacement, rel=1e-11)


def test_preliminary_displacement_is_theta_mu_delta_and_the_end_of_virgin_loading():
    full = preliminary_displacement(**CONTACT)
    assert full == approx(PAIR.displacement_ratio * MU * DEPTH, rel=16 * EPS)
    assert tangential_displacement(LIMIT, **CONTACT) == approx(full, rel=4 * EPS)
    assert stick_radius(LIMIT, **SLIPPING) == 0
    assert stick_radius(0, **SLIPPING) == A


@mark.parametrize("f", [0.1, 0.5, 0.9])
def test_stiffness_along_virgin_loading(f):
    loads = (f + np.array([-1e-5, 1e-5])) * LIMIT
    slope = np.diff(loads) / np.diff(tangential_displacement(loads, **CONTACT))
    stiffness = tangential_stiffness(stick_radius(f * LIMIT, **SLIPPING), shear_modulus=G)
    # truncation (1e-5/(1-f))² (4/9)/6 ≤ 1e-9, rounding EPS/1e-5 = 2e-11
    assert slope[0] == approx(stiffness, rel=2e-9)


# -- after a reversal ------------------------------------------------------------------------------


@given(shares, signed(1))
def test_unloading_follows_the_printed_curve_and_reloading_mirrors_it(f, g):
    turned, load = f * LIMIT, g * f * LIMIT
    # theory section 2, with powers; its terms are of the size of δ_t,max
    bracket = 2 * (1 - (f - g * f) / 2) ** (2 / 3) - (1 - f) ** (2 / 3) - 1
    full = 3 * LIMIT / (16 * A * G)
    unloading = displacement_after_reversal(load, reversal_load=turned, **CONTACT)
    # (1-f)^(2/3) loses digits near f = 1, by no more than (2 EPS)^(2/3)
    error = 16 * EPS + min((2 * EPS) ** (2 / 3), 2 * EPS * (1 - f + EPS) ** (-1 / 3))
    assert unloading == approx(full * bracket, abs=full * error)
    assert displacement_after_reversal(-load, reversal_load=-turned, **CONTACT) == -unloading


# -- energy ----------------------------------------------------------------------------------------


@mark.parametrize("f", [1e-3, 0.2, 0.7, 1.0])
def test_energy_is_the_area_of_the_loop(f):
    turned = f * LIMIT

    def width(load):
        unloading = displacement_after_reversal(load, reversal_load=turned, **CONTACT)
        return unloading - displacement_after_reversal(load, reversal_load=-turned, **CONTACT)

    area = quad(width, -turned, turned, epsabs=0)[0]
    # the width is a difference of order f of displacements, each good to EPS
    assert dissipated_energy_per_loop(turned, **CONTACT) == approx(area, rel=1e-8 + 16 * EPS / f)


@given(st.floats(-12, -4).map(lambda exponent: 10**exponent))
def test_energy_of_small_loads_is_positive_and_follows_its_series(f):
    energy = dissipated_energy_per_loop(f * LIMIT, **CONTACT)
    # ΔW = T³/(36 a G* μN) (1 + (2/3) f + O(f²))
    assert energy == approx(
        (f * LIMIT) ** 3 / (36 * A * G * LIMIT) * (1 + 2 * f / 3), rel=f**2 + 32 * EPS
    )
    assert energy > 0


# -- tractions -------------------------------------------------------------------------------------


def check_traction(profile, kinks, load, displacement):
    """The traction carries the load, moves the centre by the displacement, and never exceeds μ p."""

    def integral(function):
        # r = start + width (1 - cos πt)/2 takes the square roots at the ends of a piece away
        def weighted(t, start, width):
            return (
                function(start + width * (1 - math.cos(math.pi * t)) / 2)
                * width
                * math.pi
                / 2
                * math.sin(math.pi * t)
            )

        pieces = itertools.pairwise([0, *sorted(kinks), A])
        return sum(
            quad(weighted, 0, 1, args=(start, end - start), epsabs=0)[0]
            for start, end in pieces
            if end > start
        )

    carried = integral(lambda r: profile(r) * 2 * math.pi * r)
    assert carried == approx(load, rel=1e-9, abs=1e-12 * LIMIT)
    # Cerruti: u_x of both surfaces at the centre adds up to Σ (2-ν)/(2G) ∫ τ dr = ∫ τ dr / (2 G*)
    moved = integral(profile) / (2 * G)
    assert moved == approx(displacement, rel=1e-9, abs=1e-12 * preliminary_displacement(**CONTACT))
    r = np.linspace(0, 1.1 * A, 1001)
    bound = MU * hertz.pressure_profile(r, normal_load=N, contact_radius=A)
    assert np.all(np.abs(profile(r)) <= bound + 16 * EPS * bound[0])


@mark.parametrize("f", [0.01, 0.5, 0.95, 1.0, -0.5])
def test_virgin_traction(f):
    load = f * LIMIT
    check_traction(
        lambda r: traction(r, tangential_load=load, **SLIPPING),
        [stick_radius(load, **SLIPPING)],
        load,
        tangential_displacement(load, **CONTACT),
    )


@mark.parametrize("turned, f", [(0.9, 0.5), (0.9, 0.0), (0.9, -0.6), (1.0, -1.0), (-0.7, 0.2)])
def test_traction_after_a_reversal(turned, f):
    loads = {"tangential_load": f * LIMIT, "reversal_load": turned * LIMIT}
    check_traction(
        lambda r: traction_after_reversal(r, **loads, **SLIPPING),
        [stick_radius(turned * LIMIT, **SLIPPING), counter_slip_radius(**loads, **SLIPPING)],
        f * LIMIT,
        displacement_after_reversal(**loads, **CONTACT),
    )


def test_traction_of_a_small_load_keeps_its_digits():
    load = 1e-10 * LIMIT
    # full stick, T/(2πa √(a²-r²)), away from the edge; its relative error is of order f
    r = np.array([0, 0.5, 0.9]) * A
    expected = load / (2 * np.pi * A * np.sqrt(A**2 - r**2))
    np.testing.assert_allclose(traction(r, tangential_load=load, **SLIPPING), expected, rtol=2e-9)


# -- arguments -------------------------------------------------------------------------------------


def test_nothing_touches_or_rubs():
    for limitless in (
        {"normal_load": 0, "contact_radius": 0, "friction": MU},
        SLIPPING | {"friction": 0},
    ):
        assert stick_radius(0, **limitless) == 0
        assert preliminary_displacement(**limitless, shear_modulus=G) == 0
        assert tangential_displacement(0, **limitless, shear_modulus=G) == 0
        assert displacement_after_reversal(0, reversal_load=0, **limitless, shear_modulus=G) == 0
        assert dissipated_energy_per_loop(0, **limitless, shear_modulus=G) == 0
        assert traction(0, tangential_load=0, **limitless) == 0


def test_scalars_give_scalars_and_arrays_broadcast():
    assert isinstance(tangential_displacement(0.1 * LIMIT, **CONTACT), float)
    assert isinstance(traction(0, tangential_load=0.1 * LIMIT, **SLIPPING), float)
    loads = np.linspace(-1, 1, 5)[:, None] * LIMIT
    both = tangential_displacement(loads, **CONTACT | {"shear_modulus": [G, 2 * G]})
    assert both.shape == (5, 2)
    np.testing.assert_allclose(both[:, 0], 2 * both[:, 1], rtol=8 * EPS)
    assert traction([0, A], tangential_load=loads, **SLIPPING).shape == (5, 2)


def test_a_rounding_above_the_limit_is_the_limit():
    assert stick_radius(LIMIT * (1 + 4 * EPS), **SLIPPING) == 0
    assert dissipated_energy_per_loop(
        LIMIT * (1 + 4 * EPS), **CONTACT
    ) == dissipated_energy_per_loop(LIMIT, **CONTACT)


def test_messages():
    check_messages(globals())
