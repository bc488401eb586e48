import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm

from historysim.contact.height_integral import height_integral

EPS = np.finfo(float).eps

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


def test_height_integrals_as_tabulated():
    np.testing.assert_allclose(height_integral(1, range(4)), [0.398942, 0.0833155, 0.00849070, 3.82154e-4], rtol=2e-6)
    np.testing.assert_allclose(height_integral(1.5, range(4)), [0.430020, 0.0756682, 0.00664818, 2.63968e-4], rtol=2e-6)


@given(st.sampled_from([0, 0.5, 1, 1.5, 2, 2.5]) | st.floats(0, 10), st.floats(-3, 10))
def test_height_integral_is_what_quadrature_gives(order, h):
    # over φ(h); t = v² takes the root at the end out of the integrand, and the range is cut where it is below 1e-40
    def integrand(v):
        return 2 * v ** (2 * order + 1) * math.exp(-(v**4) / 2 - h * v**2)

    scale = math.sqrt(order + 1) + max(-h, 0)
    ends = np.sqrt(np.array([0, scale / 4, scale, 2 * scale, 4 * scale, 20 + 4 * scale]) / (1 + max(h, 0) / 10))
    parts = [quad(integrand, *pair, epsabs=0, epsrel=1e-12, limit=200)[0] for pair in itertools.pairwise(ends)]
    assert height_integral(order, h) == pytest.approx(norm.pdf(h) * sum(parts), rel=1e-10)


@given(st.floats(0, 8), st.floats(-30, 30))
def test_height_integrals_recur(order, h):
    # F_(n+2) = (n+1) F_n - h F_(n+1), by parts
    first, second, third = (height_integral(order + step, h) for step in range(3))
    # each is good to h²/2 roundings of its exponent and to 4e-14, and the difference as good as its larger term
    terms = (order + 1) * first + abs(h) * second
    assert third == pytest.approx((order + 1) * first - h * second, abs=(1e-13 + h**2 * EPS) * terms)


@given(st.floats(-37, 37))
def test_count_is_the_tail_of_the_normal_distribution(h):
    assert height_integral(0, h) == pytest.approx(norm.sf(h), rel=2e-14 + h**2 * EPS)


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


def test_height_integral_of_scalars_and_arrays():
    assert isinstance(height_integral(1.5, 1), float)
    h = np.array([[-1, 0, 1], [2, 3, 0.5]])
    result = height_integral(1.5, h)
    assert result.shape == h.shape
    assert all(result[place] == height_integral(1.5, h[place]) for place in np.ndindex(h.shape))
    assert height_integral(1, []).shape == (0,)
