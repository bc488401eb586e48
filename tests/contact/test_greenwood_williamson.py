import itertools
import math

import attrs
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm

from historysim.contact.greenwood_williamson import GreenwoodWilliamson, height_integral, summit_contact
from historysim.errors import InputError
from historysim.surfaces.distribution import Gaussian, drawn_summits, quantile_summits
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


@pytest.mark.parametrize("name", POWERS)
@pytest.mark.parametrize("over_mean", [-1.5e-6, 0, 1e-6, 2.4e-6])
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
        quad(lambda z: one(z - d) * norm.pdf(z, 3e-6, 0.6e-6), low, high, epsabs=0, epsrel=1e-11, limit=400)[0]
        for low, high in zip([d, *points], [*points, top], strict=True)
    )
    # quad is asked for 1e-11; what is above 12 σ is less than 1e-30 of the whole
    assert getattr(STEEL, name)(d) == pytest.approx(2e10 * 1e-6 * mean, rel=1e-9)


@given(surfaces(), st.floats(-5, 8))
def test_stiffness_is_the_slope_of_the_load(surface, h):
    step = 1e-4
    below, above = surface.normal_load(surface.height_deviation * np.array([h - step, h + step]))
    slope = (below - above) / (2 * step * surface.height_deviation)
    # truncation: step²/6 times the third over the first derivative, below (1 + h)² ≤ 81; rounding: 1e-14 N over the
    # difference of the loads, N/(2 step) dh
    assert surface.normal_stiffness(h * surface.height_deviation) == pytest.approx(slope, rel=2e-7 + 1e-9)


@given(surfaces(), st.floats(-8, 37))
def test_separation_and_load_are_inverse(surface, h):
    d = h * surface.height_deviation
    # F is good to h² roundings relative, and its logarithm falls by 1.5/|h| (h < 0) to h per unit of h
    tolerance = (1e-13 + h**2 * EPS) * 2 * (1 + abs(h)) * surface.height_deviation
    load = surface.normal_load(d)
    assume(load > 1e-290)
    assert surface.separation_at(load) == pytest.approx(d, abs=tolerance)


def test_separation_at_any_load():
    loads = np.logspace(-280, 200, 49)
    d = UNIT.separation_at(loads)
    assert np.all(np.diff(d) < 0)
    # ln N is good to its own 650 roundings
    np.testing.assert_allclose(UNIT.normal_load(d), loads, rtol=2e-12)
    assert isinstance(UNIT.separation_at(1e-3), float)
    assert UNIT.separation_at(loads.reshape(7, 7)).shape == (7, 7)
    assert STEEL.separation_at(STEEL.normal_load(4e-6)) == pytest.approx(4e-6, rel=1e-13)
    assert np.isfinite(UNIT.separation_at([5e-324, 1e308])).all()


def test_parameters_of_summits():
    summits = Summits([1e-6, 3e-6, 5e-6], [1e-5, 2e-5, 6e-5], nominal_area=2e-8)
    surface = GreenwoodWilliamson.from_summits(summits, 1e11)
    assert attrs.astuple(surface) == pytest.approx(
        (1e11, 3e-5, math.sqrt(8 / 3) * 1e-6, 1.5e8, 2e-8, 3e-6), rel=8 * EPS, abs=0
    )


def test_sum_over_three_summits():
    # approaches 4, 1 and 0 over radii 9, 4 and 1, E* = 3: contact radii 6, 2, 0
    result = summit_contact([3, 7, 4], [1, 9, 4], 3, contact_modulus=3)
    assert result.contact_count == 2
    assert result.contact_area == pytest.approx(40 * math.pi, rel=4 * EPS)
    assert result.normal_load == pytest.approx(4 * (3 * 8 + 2 * 1), rel=8 * EPS)
    assert result.normal_stiffness == pytest.approx(6 * 8, rel=4 * EPS)
    assert isinstance(result.normal_load, float)


@pytest.mark.parametrize("name", POWERS)
@pytest.mark.parametrize("h", [-1, 0, 1, 2])
def test_quantile_ensembles_converge_to_the_integrals(name, h):
    power = POWERS[name]
    for count in (100, 1000, 10_000, 100_000, 1_000_000):
        made = quantile_summits(Gaussian(1.0), 1.0, summit_density=count, nominal_area=1.0)
        total = getattr(summit_contact(made.height, made.radius, h, contact_modulus=1.0), name)
        error = (total / count - getattr(UNIT, name)(h)) / FACTORS[name]
        if power == 0:
            # a count is never more than one summit off
            assert abs(error) <= 1 / count
            continue
        # The highest summits decide. The integrand f is smooth in L = ln(1/v), v the probability to be higher, which is
        # w/count with w = 1/2, 3/2, ... So the error is (f' Σ ln(1/w) + f''/2 Σ ln(1/w)² + ...)/count at v = 1/count,
        # with the regularised sums ζ'(0, 1/2) = -ln(2)/2 and ζ''(0, 1/2) = -ln(2)²/2 - ln(2) ln(2π).
        z = norm.isf(1 / count)
        mills = 1 / count / norm.pdf(z)  # dz/dL
        slope = power * (z - h) ** (power - 1) * mills
        parts = (power - 1) * mills / (z - h), z * mills - 1  # of f''/f'
        ratio = (math.log(2) + 2 * math.log(2 * math.pi)) / 2
        expected = -math.log(2) / (2 * count) * slope * (1 + ratio * sum(parts))
        # the third term has twice the square of the second, and a root at d adds ζ(-1/2, q), |ζ| < 0.21
        third = 2 * (ratio * (abs(parts[0]) + abs(parts[1]))) ** 2
        root = 0.21 / math.sqrt(norm.pdf(h)) * count**-1.5 if power < 1 else 0
        assert error == pytest.approx(expected, rel=0, abs=third * abs(expected) + root)


def test_a_million_summits_carry_the_load_of_the_integral():
    made = drawn_summits(Gaussian(0.6e-6, mean=3e-6), 8e-6, summit_density=1e12, nominal_area=1e-6, seed=4)
    surface = GreenwoodWilliamson.from_summits(made, 115e9)
    load = 2000.0
    d = surface.separation_at(load)
    # the variance of the load of one summit over the square of its mean is below F_3/F_(3/2)²; 5 deviations of the mean
    # of 10^6 of them
    h = (d - surface.mean_height) / surface.height_deviation
    scatter = math.sqrt(height_integral(3, h) / height_integral(1.5, h) ** 2 / 1e6)
    assert scatter < 0.01
    result = summit_contact(made.height, made.radius, d, contact_modulus=115e9)
    assert result.normal_load == pytest.approx(load, rel=5 * scatter)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: height_integral(1, [0, math.inf]), r"separation over deviation\[1\] is inf"),
        (lambda: GreenwoodWilliamson(1, 1, 0, 1, 1), "height_deviation is 0; expected a finite number greater than 0"),
        (lambda: GreenwoodWilliamson.from_summits(Summits([1, 2], 1), 1), "no nominal_area"),
        (
            lambda: GreenwoodWilliamson.from_summits(Summits([0.1] * 3, 1, nominal_area=1), 1),
            "3 summits do not",
        ),
        (lambda: summit_contact([1, 2], [1, 2, 3], 0, contact_modulus=1), r"shape \(2,\) and summit_radius \(3,\)"),
    ],
)
def test_arguments_out_of_range(call, message):
    with pytest.raises(InputError, match=message):
        call()


SEPARATIONS = [-30, -3, -1, -1e-9, 0, 0.5, 1, 2, 3, 5.75, 10]

# Γ(n+1) exp(-h²/4)/√(2π) · D_(-n-1)(h) in 50 digits (mpmath's pcfd), rounded
# fmt: off
INTEGRALS = [
    (0, [1.0, 0.99865010196836991, 0.84134474606854295, 0.50000000039894228, 0.5, 0.3085375387259869,
         0.15865525393145705, 0.022750131948179207, 0.0013498980316300945, 4.4621724539016119e-9,
         7.6198530241605261e-24]),
    (0.5, [5.476464054531876, 1.7041320019204506, 0.9006029312703163, 0.41108947976124927, 0.41108947933122928,
           0.22533558169731161, 0.10415367530785769, 0.012480040296439067, 0.0006418504393485508, 1.6099534457550722e-9,
           2.1174792991416109e-24]),
    (1, [30.0, 3.0003821543170477, 1.0833154705876863, 0.39894228090143268, 0.39894228040143268, 0.19779655740130603,
         0.083315470587686298, 0.0084907026168296375, 0.0003821543170477236, 7.3494042577146504e-10,
         7.474560254589328e-25]),
    (1.5, [164.38524685803846, 5.4183772765116954, 1.4045974704739524, 0.43001999427889399, 0.43001999366225977,
           0.19520360374379063, 0.075668177390975071, 0.0066481776235870931, 0.00026396755426946728,
           3.9284984131662069e-10, 3.1012065086731691e-25]),
    (2.5, [4939.7721018229516, 18.811329832415762, 2.7555018673794269, 0.6166342200718939, 0.61663421899684391,
           0.24040157067407211, 0.080562335570811469, 0.0054237051974844139, 0.00017087299621442437,
           1.5604358106203941e-10, 7.5012440039247267e-26]),
    (3.7, [293598.00837520292, 91.667341509570696, 7.4909570247716944, 1.2234489245965116, 1.2234489220805739,
           0.40856561938699809, 0.11783144068879937, 0.005991077474912073, 0.00014684890960104831,
           7.7396884632553082e-11, 2.0877400761202286e-26]),
    (10, [620476325753445.0, 1112183.9979756176, 9481.88513750096, 472.50000153193836, 472.5, 87.475943683558692,
          14.114862499039979, 0.23456096932976454, 0.0020243823657402227, 9.2390962074875697e-11,
          1.5454874445975242e-27]),
]
# fmt: on


@pytest.mark.parametrize(("order", "expected"), INTEGRALS)
def test_height_integrals_in_many_digits(order, expected):
    # an exponent of up to 60 carries half a rounding in each of its terms: 60 EPS = 1.3e-14; the step of the
    # quadrature adds 4e-14 at order 10 and h = 0
    tolerance = 6e-14 if order == 10 else 2e-14
    np.testing.assert_allclose(height_integral(order, SEPARATIONS), expected, rtol=tolerance)


@given(st.sampled_from([0, 0.5, 1, 1.5, 2, 2.5]) | st.floats(0, 10), st.floats(-3, 10))
def test_height_integral_is_what_quadrature_gives(order, h):
    # over φ(h); t = v² takes the root at the end out of the integrand, and the range is cut where it is below 1e-40
    def integrand(v):
        return 2 * v ** (2 * order + 1) * math.exp(-(v**4) / 2 - h * v**2)

    scale = math.sqrt(order + 1) + max(-h, 0)
    ends = np.sqrt(np.array([0, scale / 4, scale, 2 * scale, 4 * scale, 20 + 4 * scale]) / (1 + max(h, 0) / 10))
    parts = [quad(integrand, *pair, epsabs=0, epsrel=1e-12, limit=200)[0] for pair in itertools.pairwise(ends)]
    assert height_integral(order, h) == pytest.approx(norm.pdf(h) * sum(parts), rel=1e-10)


def test_height_integrals_far_outside():
    # by mpmath as above; the exponent of 700 carries its rounding
    np.testing.assert_allclose(
        height_integral(0, [30, 37]), [4.9067139271481871e-198, 5.7255712225245768e-300], rtol=3e-13
    )
    np.testing.assert_allclose(
        height_integral(1.5, [30, 37]), [3.9547990870299808e-200, 3.3735350268342333e-302], rtol=3e-13
    )
    assert height_integral(1.5, [40, 1e3, 1e10, 1e200, 1e308]).tolist() == [0] * 5
    # F_n(-h) = h^n (1 + n(n-1)/(2 h²) + ...)
    far = np.array([1e6, 0.99e8, 1.01e8, 1e12, 1e100, 1e200])
    np.testing.assert_allclose(height_integral(1.5, -far), far**1.5, rtol=1e-12)
    np.testing.assert_allclose(height_integral(0, -far), 1, rtol=4 * EPS)


@pytest.mark.parametrize("order", [0, 0.3, 1, 1.25, 1.5, 2.7])
def test_height_integrals_hardly_off_the_mean(order):
    # F_n(0) = 2^(n/2) Γ((n+1)/2) / (2 √π); from there it changes by n F_(n-1) h, less than 10 F_n h here
    expected = 2 ** (order / 2) * math.gamma((order + 1) / 2) / (2 * math.sqrt(math.pi))
    h = np.concatenate([-np.logspace(-320, -17, 304), [0, 1e-17, 1e-200, 5e-324]])
    np.testing.assert_allclose(height_integral(order, h), expected, rtol=16 * EPS)
