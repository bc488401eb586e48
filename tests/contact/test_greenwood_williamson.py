import itertools
import math

import attrs
import numpy as np
from golden import check_messages
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pytest import approx, mark
from scipy.integrate import quad
from scipy.stats import norm

from historysim.contact.greenwood_williamson import (
    GreenwoodWilliamson,
    height_integral,
    summit_contact,
)
from historysim.surfaces.distribution import Gaussian, quantile_summits
from historysim.surfaces.summits import Summits

EPS = np.finfo(float).eps

# E*, R, σ, D, A0 and the mean height of some ground steel [SI]
STEEL = GreenwoodWilliamson(115e9, 8e-6, 0.6e-6, 2e10, 1e-6, mean_height=3e-6)
UNIT = GreenwoodWilliamson(1.0, 1.0, 1.0, 1.0, 1.0)

# what each quantity is for one summit, up to a power of its approach
POWERS = {"contact_count": 0, "normal_stiffness": 0.5, "contact_area": 1, "normal_load": 1.5}
FACTORS = {"contact_count": 1, "normal_stiffness": 2, "contact_area": math.pi, "normal_load": 4 / 3}


def surfaces():
    return st.builds(
        GreenwoodWilliamson,
        st.floats(1e6, 1e12),
        st.floats(1e-7, 1e-2),
        st.floats(1e-9, 1e-5),
        st.floats(1e6, 1e12),
        st.floats(1e-9, 1e-2),
        mean_height=st.just(0.0),
    )


@mark.parametrize("name", POWERS)
@mark.parametrize("over_mean", [-1.5e-6, 0, 1e-6, 2.4e-6])
def test_integrals_are_hertz_over_gaussian_heights(name, over_mean):
    d = STEEL.mean_height + over_mean
    one = {
        "contact_count": lambda _: 1,
        "contact_area": lambda depth: math.pi * 8e-6 * depth,
        "normal_load": lambda depth: 4 / 3 * 115e9 * math.sqrt(8e-6) * depth**1.5,
        "normal_stiffness": lambda depth: 2 * 115e9 * math.sqrt(8e-6 * depth),
    }[name]
    top = STEEL.mean_height + 12 * 0.6e-6
    points = [d + 0.02e-6, d + 0.3e-6]
    mean = sum(
        quad(
            lambda z: one(z - d) * norm.pdf(z, 3e-6, 0.6e-6),
            low,
            high,
            epsabs=0,
            epsrel=1e-11,
            limit=400,
        )[0]
        for low, high in zip([d, *points], [*points, top], strict=True)
    )
    # quad is asked for 1e-11; what is above 12 σ is less than 1e-30 of the whole
    assert getattr(STEEL, name)(d) == approx(2e10 * 1e-6 * mean, rel=1e-9)


@given(surfaces(), st.floats(-5, 8))
def test_stiffness_is_the_slope_of_the_load(surface, h):
    step = 1e-4
    below, above = surface.normal_load(surface.height_deviation * np.array([h - step, h + step]))
    slope = (below - above) / (2 * step * surface.height_deviation)
    # truncation: step²/6 times the third over the first derivative, below (1 + h)² ≤ 81; rounding:
    # 1e-14 N over the difference of the loads, N/(2 step) dh
    assert surface.normal_stiffness(h * surface.height_deviation) == approx(slope, rel=2e-7 + 1e-9)


@given(surfaces(), st.floats(-8, 37))
def test_separation_and_load_are_inverse(surface, h):
    d = h * surface.height_deviation
    # F is good to h² roundings relative, and its logarithm falls by 1.5/|h| (h < 0) to h per unit
    # of h
    tolerance = (1e-13 + h**2 * EPS) * 2 * (1 + abs(h)) * surface.height_deviation
    load = surface.normal_load(d)
    assume(load > 1e-290)
    assert surface.separation_at(load) == approx(d, abs=tolerance)


def test_separation_at_any_load():
    loads = np.logspace(-280, 200, 49)
    d = UNIT.separation_at(loads)
    assert np.all(np.diff(d) < 0)
    # ln N is good to its own 650 roundings
    assert_allclose(UNIT.normal_load(d), loads, rtol=2e-12)
    assert isinstance(UNIT.separation_at(1e-3), float)
    assert UNIT.separation_at(loads.reshape(7, 7)).shape == (7, 7)
    assert STEEL.separation_at(STEEL.normal_load(4e-6)) == approx(4e-6, rel=1e-13)
    assert np.isfinite(UNIT.separation_at([5e-324, 1e308])).all()


def test_parameters_of_summits():
    summits = Summits([1e-6, 3e-6, 5e-6], [1e-5, 2e-5, 6e-5], nominal_area=2e-8)
    surface = GreenwoodWilliamson.from_summits(summits, 1e11)
    assert attrs.astuple(surface) == approx(
        (1e11, 3e-5, math.sqrt(8 / 3) * 1e-6, 1.5e8, 2e-8, 3e-6), rel=8 * EPS, abs=0
    )


def test_sum_over_three_summits():
    # approaches 4, 1 and 0 over radii 9, 4 and 1, E* = 3: contact radii 6, 2, 0
    result = summit_contact([3, 7, 4], [1, 9, 4], 3, contact_modulus=3)
    assert result.contact_count == 2
    assert result.contact_area == approx(40 * math.pi, rel=4 * EPS)
    assert result.normal_load == approx(4 * (3 * 8 + 2 * 1), rel=8 * EPS)
    assert result.normal_stiffness == approx(6 * 8, rel=4 * EPS)
    assert isinstance(result.normal_load, float)


@mark.parametrize("name", POWERS)
@mark.parametrize("h", [-1, 0, 2])
def test_quantile_ensembles_converge_to_the_integrals(name, h):
    for count in (1000, 100_000):
        made = quantile_summits(Gaussian(1.0), 1.0, summit_density=count, nominal_area=1.0)
        total = getattr(summit_contact(made.height, made.radius, h, contact_modulus=1.0), name)
        # the highest summits decide: an error of the order of one of them
        assert total / count == approx(getattr(UNIT, name)(h), abs=FACTORS[name] / count)


# fmt: on


@given(st.sampled_from([0, 0.5, 1, 1.5, 2, 2.5]) | st.floats(0, 10), st.floats(-3, 10))
def test_height_integral_is_what_quadrature_gives(order, h):
    # over φ(h); t = v² takes the root at the end out of the integrand, and the range is cut where
    # it is below 1e-40
    def integrand(v):
        return 2 * v ** (2 * order + 1) * math.exp(-(v**4) / 2 - h * v**2)

    scale = math.sqrt(order + 1) + max(-h, 0)
    ends = np.sqrt(
        np.array([0, scale / 4, scale, 2 * scale, 4 * scale, 20 + 4 * scale]) / (1 + max(h, 0) / 10)
    )
    parts = [
        quad(integrand, *pair, epsabs=0, epsrel=1e-12, limit=200)[0]
        for pair in itertools.pairwise(ends)
    ]
    assert height_integral(order, h) == approx(norm.pdf(h) * sum(parts), rel=1e-10)


def test_height_integrals_far_outside():
    # by mpmath as above; the exponent of 700 carries its rounding
    assert_allclose(
        height_integral(0, [30, 37]), [4.9067139271481871e-198, 5.7255712225245768e-300], rtol=3e-13
    )
    assert_allclose(
        height_integral(1.5, [30, 37]),
        [3.9547990870299808e-200, 3.3735350268342333e-302],
        rtol=3e-13,
    )
    assert height_integral(1.5, [40, 1e3, 1e10, 1e200, 1e308]).tolist() == [0] * 5
    # F_n(-h) = h^n (1 + n(n-1)/(2 h²) + ...)
    far = np.array([1e6, 0.99e8, 1.01e8, 1e12, 1e100, 1e200])
    assert_allclose(height_integral(1.5, -far), far**1.5, rtol=1e-12)
    assert_allclose(height_integral(0, -far), 1, rtol=4 * EPS)


def test_messages():
    check_messages(globals())
