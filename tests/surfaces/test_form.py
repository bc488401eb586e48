import math

import numpy as np
from golden import check_messages
from numpy.testing import assert_allclose
from pytest import approx, mark
from scipy.optimize import curve_fit

from historysim.surfaces.filters import fit_form

EPS = np.finfo(float).eps
PIXEL = (1e-6, 2.5e-6)


def grid(shape, pixel=PIXEL):
    """Give x and y from the middle of the map."""
    x, y = ((np.arange(n) - (n - 1) / 2) * p for n, p in zip(shape, pixel, strict=True))
    return x[:, None], y[None, :]


def cap(radius, shape, centre=(0.0, 0.0), pixel=PIXEL):
    """Give the heights of a ball over its top, or below the bottom of a hollow, without cancellation."""
    x, y = grid(shape, pixel)
    square = (x - centre[0]) ** 2 + (y - centre[1]) ** 2
    return -square / (radius + math.copysign(1, radius) * np.sqrt(radius**2 - square))


def with_gaps(heights, share, seed=0):
    return np.where(np.random.default_rng(seed).random(heights.shape) < share, math.nan, heights)


def polynomial(coefficients, shape):
    """Give a + b u + c v + d u² + e v² + f u v, with u and v from -1 to 1."""
    u, v = (np.linspace(-1, 1, n) if n > 1 else np.zeros(1) for n in shape)
    u, v = u[:, None], v[None, :]
    return sum(
        c * term
        for c, term in zip(coefficients, (1 + 0 * u * v, u, v, u * u, v * v, u * v), strict=False)
    ) + np.zeros(shape)


def fitted_by_columns(heights, terms):
    """Fit with one column of numpy's least squares for each term, over the points that are there."""
    here = np.isfinite(heights)
    columns = np.stack(
        [polynomial(np.eye(6)[term], heights.shape)[here] for term in range(terms)], axis=1
    )
    coefficients = np.linalg.lstsq(columns, heights[here], rcond=None)[0]
    return polynomial(coefficients, heights.shape)


TERMS = {"mean": 1, "plane": 3, "quadratic": 6}

# --- polynomials
# ------------------------------------------------------------------------------------------------


@mark.parametrize("gaps", [0, 0.9])
@mark.parametrize("shape", [(20, 30), (3, 3)])
@mark.parametrize("kind", TERMS)
def test_a_surface_that_is_its_own_form_is_given_back_at_all_points(kind, shape, gaps):
    full = polynomial([3e-6, -2e-6, 1e-6, 5e-7, -4e-7, 3e-7][: TERMS[kind]], shape)
    heights = with_gaps(full, gaps if min(shape) > 4 or kind == "mean" else 0, seed=1)
    form = fit_form(heights, PIXEL, kind)
    assert form.kind == kind
    assert form.radius is None
    # the heights are rounded by EPS/2 of 1e-5 m; missing points may lie outside those that are
    # there
    assert_allclose(form.heights, full, rtol=0, atol=50 * EPS * 1e-5)


@mark.parametrize("offset", [-1.0])
def test_nanometres_on_a_high_and_tilted_datum(offset):
    shape = (64, 48)
    rough = with_gaps(1e-9 * np.random.default_rng(4).standard_normal(shape), 0.31)
    tilt = polynomial([offset, 1e-4, -3e-5], shape)
    left = tilt + rough
    left -= fit_form(left, PIXEL, "plane").heights
    # the sum is rounded by EPS/2 of the offset, and so is the form; nothing else is lost
    assert_allclose(
        left, rough - fitted_by_columns(rough, 3), rtol=0, atol=4 * EPS * (abs(offset) + 2e-4)
    )


# --- spheres
# ----------------------------------------------------------------------------------------------------


@mark.parametrize("offset", [0.0, 1e-3])
@mark.parametrize("gaps", [0, 0.31])
@mark.parametrize("shape", [(5, 5), (7, 300)])
@mark.parametrize("radius", [2e-3, -30.0])
def test_a_sphere_is_given_back(radius, shape, gaps, offset):
    full = offset + cap(radius, shape, centre=(3e-6, -4e-6))
    form = fit_form(with_gaps(full, gaps, seed=1), PIXEL, "sphere")
    # the sag by which it is known, over a half diagonal, against the rounding of the heights
    sag = sum((n - 1) ** 2 * p**2 for n, p in zip(shape, PIXEL, strict=True)) / 8 / abs(radius)
    rounding = EPS * (offset + sag) / sag
    assert form.radius == approx(radius, rel=40 * rounding)
    assert_allclose(form.heights, full, rtol=0, atol=40 * EPS * (offset + sag))


@mark.parametrize("along_y", [False, True])
@mark.parametrize("centre", [9e-6])
@mark.parametrize("radius", [2e-4, -2e-4])
def test_a_profile_has_a_circle(radius, centre, along_y):
    shape, at = ((1, 20), (0, centre)) if along_y else ((20, 1), (centre, 0))
    full = cap(radius, shape, at)
    heights = full.copy()
    heights.flat[[2, 11]] = math.nan
    form = fit_form(heights, PIXEL, "sphere")
    assert form.radius == approx(radius, rel=1e-10)
    assert_allclose(form.heights, full, rtol=0, atol=1e-20)


@mark.parametrize("seed", range(2))
def test_a_rough_ball_has_the_sphere_of_least_squares(seed):
    shape, radius = (11, 9), 60e-6
    x, y = np.broadcast_arrays(*grid(shape))
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-5e-6, 5e-6, 2)
    heights = with_gaps(cap(radius, shape, centre) + 1e-7 * rng.standard_normal(shape), 0.2, seed)
    here = np.isfinite(heights)

    # in µm, by another search with numerical derivatives
    def ball(_, x0, y0, z0, r):
        return z0 + np.sqrt(r**2 - (x[here] * 1e6 - x0) ** 2 - (y[here] * 1e6 - y0) ** 2) - r

    start = [*(centre * 1e6), 0, radius * 1e6]
    best, _ = curve_fit(
        ball, None, heights[here] * 1e6, start, method="trf", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    form = fit_form(heights, PIXEL, "sphere")
    # numerical derivatives leave a sum of squares that is too large by about 1e-14, so unknowns off
    # by 1e-7
    assert form.radius * 1e6 == approx(best[3], rel=1e-6)
    ours = np.sum((heights - form.heights)[here] ** 2) * 1e12
    theirs = np.sum((heights[here] * 1e6 - ball(None, *best)) ** 2)
    assert ours <= theirs * (1 + 1e-12)
    assert_allclose(form.heights[here] * 1e6, ball(None, *best), rtol=0, atol=1e-6)


# --- what has no form
# -------------------------------------------------------------------------------------------


def ramp(datum, along, across, shape):
    return datum + along * np.arange(shape[0])[:, None] + across * np.arange(shape[1])[None, :]


def test_messages():
    check_messages(globals())
