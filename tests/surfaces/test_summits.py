import math
from itertools import product

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from numpy.testing import assert_allclose
from pytest import approx, mark
from scipy import ndimage
from scipy.optimize import minimize

import historysim as hs
from historysim.surfaces.summits import Summits, detached_summits, find_summits, prominences

EPS = np.finfo(float).eps
PX, PY = 2.0**-20, 3 * 2.0**-21  # not square, and exact in binary: about 0.95 µm and 1.43 µm


def columns(summits):
    return summits.x, summits.y, summits.height, summits.radius


def drawn(picture):
    """Give the heights of a picture: a row of digits for each x, '.' where missing."""
    rows = picture.split()
    return np.array([[math.nan if sign == "." else float(sign) for sign in row] for row in rows])


# --- a slow oracle: flood fill in plain Python over the repeated plane
# -------------------------------------------


def around(rule, shape):
    if rule == 3:
        return [(0, 1), (0, -1)] if shape[0] == 1 else [(1, 0), (-1, 0)]
    steps = [step for step in product((-1, 0, 1), repeat=2) if step != (0, 0)]
    return steps if rule == 9 else [step for step in steps if 0 in step]


class Flood:
    """One patch of equal heights: its points, at unfolded places, and whether it is a summit."""

    def __init__(self, heights, start, rule, periodic):
        self.heights, self.periodic = heights, periodic
        self.place = {start: start}
        self.is_summit, self.wraps = True, False
        level, todo = heights[start], [start]
        while todo:
            i, j = todo.pop()
            for a, b in around(rule, heights.shape):
                unfolded = (i + a, j + b)
                other = self.at(*unfolded)
                self.is_summit &= other is not None and other <= level
                if other == level:
                    cell = self.cell(*unfolded)
                    if cell not in self.place:
                        self.place[cell] = unfolded
                        todo.append(unfolded)
                    # the same point at two places of the repeated plane: the patch has no end
                    self.wraps |= self.place[cell] != unfolded
        self.is_summit &= not self.wraps

    def cell(self, i, j):
        nx, ny = self.heights.shape
        if self.periodic:
            return i % nx, j % ny
        return (i, j) if 0 <= i < nx and 0 <= j < ny else None

    def at(self, i, j):
        cell = self.cell(i, j)
        return None if cell is None or math.isnan(self.heights[cell]) else self.heights[cell]

    def row(self, pixel_size, rule):
        middle = [sum(place) / len(self.place) for place in zip(*self.place.values(), strict=True)]
        (nx, ny), (px, py) = self.heights.shape, pixel_size
        kappa_x = (
            sum(self.curvature(i, j, 1, 0) for i, j in self.place.values())
            / len(self.place)
            / px**2
        )
        kappa_y = (
            sum(self.curvature(i, j, 0, 1) for i, j in self.place.values())
            / len(self.place)
            / py**2
        )
        kappa = (kappa_x + kappa_y) / 2 if rule != 3 else kappa_y if nx == 1 else kappa_x
        level = self.heights[next(iter(self.place))]
        return middle[0] % nx * px, middle[1] % ny * py, level, 1 / kappa

    def curvature(self, i, j, a, b):
        before, here, after = (self.at(i + n * a, j + n * b) for n in (-1, 0, 1))
        return math.nan if None in {before, after} else 2 * here - before - after


def patches(heights, rule, periodic):
    found, done = [], set()
    for cell in np.ndindex(heights.shape):
        if cell not in done and not math.isnan(heights[cell]):
            found.append(Flood(heights, cell, rule, periodic))
            done |= set(found[-1].place)
    return found


def expected(heights, pixel_size, rule, periodic):
    return [
        patch.row(pixel_size, rule) for patch in patches(heights, rule, periodic) if patch.is_summit
    ]


small_maps = npst.arrays(
    float,
    st.tuples(st.integers(2, 7), st.integers(2, 7)),
    elements=st.sampled_from([0.0, 1.0, 2.0, math.nan]),
)
WINDING = drawn("0100 0110 0010 0110")


@given(small_maps, st.sampled_from([3, 5, 9]), st.booleans())
@example(drawn("000000 011110 000000"), 9, False)
@example(WINDING, 5, True)
def test_maps_full_of_ties_against_brute_force(heights, rule, periodic):
    found = find_summits(heights, (2.0, 0.5), rule, periodic=periodic)
    wanted = expected(heights, (2.0, 0.5), rule, periodic)
    assert len(found) == len(wanted)
    # in the order of their first points, as the oracle has them; integers, so only the means are
    # rounded
    assert_allclose(columns(found), np.reshape(wanted, (-1, 4)).T, rtol=8 * EPS, atol=1e-14)


@given(
    st.lists(st.sampled_from([0.0, 1.0, 2.0, math.nan]), min_size=2, max_size=9),
    st.booleans(),
    st.booleans(),
)
@example([0, 1, 1, 1, 1, 0], False, False)
@example([1, 1, 1, 0], True, True)
def test_profiles_full_of_ties_against_brute_force(values, along_y, periodic):
    heights = np.array([values], float) if along_y else np.array(values, float)[:, None]
    found = find_summits(heights, (2.0, 0.5), 3, periodic=periodic)
    wanted = np.reshape(expected(heights, (2.0, 0.5), 3, periodic), (-1, 4)).T
    assert_allclose(columns(found), wanted, rtol=8 * EPS, atol=1e-14)
    assert found.nominal_area is None
    assert found.density is None


@given(st.integers(0, 10**9), st.tuples(st.integers(2, 9), st.integers(2, 9)), st.booleans())
def test_maps_of_any_heights_against_brute_force(seed, shape, periodic):
    heights = np.random.default_rng(seed).standard_normal(shape)
    for rule in (3, 5, 9):
        found = find_summits(heights, (0.25, 8.0), rule, periodic=periodic)
        wanted = np.reshape(expected(heights, (0.25, 8.0), rule, periodic), (-1, 4)).T
        # the drop is the difference of numbers of about 3, and now and then as small as 0.01
        assert_allclose(columns(found), wanted, rtol=1e-11)


# --- analytic surfaces
# ------------------------------------------------------------------------------------------


def centred(shape, at=(0.0, 0.0)):
    """Give x and y of a grid whose origin is `at` pixels beyond its middle point."""
    x, y = (
        (np.arange(size) - size // 2 - offset) * pixel
        for size, offset, pixel in zip(shape, at, (PX, PY), strict=True)
    )
    return x[:, None], y[None, :]


TOPS = [(0, 0), (0.5, 0), (0, 0.5), (0.5, 0.5)]


@mark.parametrize("rule", [5, 9])
@mark.parametrize("top", TOPS)
def test_a_paraboloid_on_and_between_points_is_found_once_exactly(top, rule):
    x, y = centred((9, 8), top)
    # 1/R_x = 1.5·2^10 and 1/R_y = 2^9 in 1/m: all heights are exact in binary, so the ties are ties
    heights = 2.0**-20 - 1.5 * 2**10 * x**2 / 2 - 2.0**9 * y**2 / 2
    found = find_summits(heights, (PX, PY), rule)
    assert len(found) == 1
    assert found.radius[0] == approx(1 / (2**10), rel=4 * EPS)
    assert found.height[0] == heights.max()
    assert (found.x[0], found.y[0]) == ((4 + top[0]) * PX, (4 + top[1]) * PY)
    assert found.nominal_area == 72 * PX * PY
    assert found.density == 1 / (72 * PX * PY)


def chord_curvature(radius, x, y, pixel):
    """Give the curvature that central differences along x have on a sphere: a closed form without cancellation."""

    def fall(x_to):
        roots = [math.sqrt(radius**2 - place**2 - y**2) for place in (x, x_to)]
        return (x_to**2 - x**2) / sum(roots)

    return (fall(x - pixel) + fall(x + pixel)) / pixel**2


@mark.parametrize("radius", [10e-6, 10e-3])
@mark.parametrize("top", [*TOPS, (0.25, -0.375)])
def test_a_sphere_is_found_once_with_the_radius_of_its_chords(radius, top):
    x, y = centred((9, 9), top)
    heights = np.sqrt(radius**2 - x**2 - y**2) - radius
    found = find_summits(heights, (PX, PY))
    assert len(found) == 1
    place = min(abs(top[0]), 0.5) * PX, min(abs(top[1]), 0.5) * PY
    kappa = (chord_curvature(radius, *place, PX) + chord_curvature(radius, *place[::-1], PY)) / 2
    # the root is rounded by EPS R/2, against a drop of p²/(2 R)
    assert found.radius[0] == approx(1 / kappa, rel=8 * EPS * (radius / PX) ** 2)
    # by Taylor, (1 + p²/4 R² + 3 x²/2 R² + y²/2 R²)/R with |x|, |y| ≤ p/2: chords are at most 3
    # p²/4 R² steeper
    sharper = 1 - found.radius[0] / radius
    rounding = 8 * EPS * (radius / PX) ** 2
    assert -rounding <= sharper <= 0.8 * (PY / radius) ** 2 + rounding
    if top == (0, 0):
        halves = [2 / (radius + math.sqrt(radius**2 - p**2)) for p in (PX, PY)]
        assert kappa == approx(sum(halves) / 2, rel=8 * EPS)


# --- plateaus
# ---------------------------------------------------------------------------------------------------

PICTURES = {
    "ring round a moat round a lower top": "0000000 0222220 0200020 0201020 0200020 0222220 0000000",
    "terrace below a top, linked by a corner": "00000 01100 01100 00020 00000",
    "two squares touch at a corner": "0000000 0110000 0110000 0001100 0001100 0000000 0000000",
    "next to a missing point, and with one at a corner": "0000 011. 0000 000. 0110 0000",
    "round a missing point": "00000 01110 01.10 01110 00000",
    "over both borders": "10001 00000 00000 00000 10001",
    "over both borders by its corners": "100 000 000 001",
    "a lower ridge round a periodic surface, with a top": "0100 0210 0100",
    "a straight ridge, with a bump": "010000 010000 010000 011000 010000 010000",
    "a winding ridge": "010000 011000 001000 011000 010000 010000",
    "all but one point": "111111 111111 111111 111011 111111 111111",
    "all points": "1111 1111 1111",
}


@mark.parametrize("rule", [5, 9])
@mark.parametrize("picture", PICTURES.values(), ids=PICTURES)
def test_a_plateau_is_one_summit(picture, rule):
    heights = drawn(picture)
    for periodic in (False, True):
        found = find_summits(heights, (PX, PY), rule, periodic=periodic)
        wanted = np.reshape(expected(heights, (PX, PY), rule, periodic), (-1, 4)).T
        assert_allclose(columns(found), wanted, rtol=8 * EPS, atol=1e-22)


# --- missing points, profiles, small maps
# -----------------------------------------------------------------------


# --- Gaussian surfaces
# ------------------------------------------------------------------------------------------


def hump(shape, length):
    """Give the amplitudes of waves with a Gaussian spectrum, correlation exp(-r²/2 length²), and their numbers in x.

    In pixels. Unlike a disc, it has no edge that the grid of waves could make anisotropic.
    """
    kx, ky = np.meshgrid(*(2 * np.pi * np.fft.fftfreq(n) for n in shape), indexing="ij")
    return np.exp(-((kx**2 + ky**2) * length**2) / 4), kx


def gaussian_surface(seed, amplitude):
    """Filter white noise; ⟨z²⟩ = Σ A²/N."""
    white = np.random.default_rng(seed).standard_normal(amplitude.shape)
    return np.fft.ifft2(np.fft.fft2(white) * amplitude).real


def moment(amplitude, number, order):
    """Give the spectral moment along x: ⟨(dⁿz/dxⁿ)²⟩ = Σ A² k²ⁿ/N, exact for the ensemble of these surfaces."""
    return float(np.sum(amplitude**2 * number**order) / amplitude.size)


def mean_and_error(samples):
    return np.mean(samples, axis=0), np.std(samples, axis=0, ddof=1) / math.sqrt(len(samples))


def over_nayak(rule, seeds=32, length=6.0):
    """Give density, mean height and mean curvature over Nayak's, per seed, of grids of one and of two pixels."""
    amplitude, kx = hump((512, 512), length)
    m0, m2, m4 = (moment(amplitude, kx, order) for order in (0, 2, 4))
    alpha = m0 * m4 / m2**2
    assert alpha == approx(3, rel=1e-9)
    nayak = np.array(
        [
            m4 / (6 * np.pi * math.sqrt(3) * m2),
            4 * math.sqrt(m0) / math.sqrt(np.pi * alpha),
            8 * math.sqrt(m4) / (3 * math.sqrt(np.pi)),
        ]
    )
    ratios = np.empty((seeds, 2, 3))
    for seed in range(seeds):
        heights = gaussian_surface(seed, amplitude)
        for grid, step in enumerate((1, 2)):
            found = find_summits(
                heights[::step, ::step], (float(step), float(step)), rule, periodic=True
            )
            ratios[seed, grid] = (
                np.array([found.density, found.height.mean(), (1 / found.radius).mean()]) / nayak
            )
    return ratios


def limit_over_nayak(rule, samples=200_000):
    """Give the same ratios for an infinitely fine grid, where they are not 1: the rule sees a few directions only.

    Around a point that is higher than its neighbours at p·n the surface is z + g·p n + p²/2 n·H n,
    with H of its Gaussian distribution. The slopes g/p that make it a summit fill a polygon, g/p ·
    n < -n·H n/2 for all n; all the slopes of a true summit fill |det H|. So density ∝ ⟨area⟩
    instead of ⟨|det H|, H < 0⟩, and the mean curvature is weighted with the area; the height given
    H is proportional to the curvature (Longuet-Higgins).
    """
    rng = np.random.default_rng(1)
    total, difference, hxy = rng.standard_normal((3, samples)) * np.sqrt(
        [[8 / 3], [4 / 3], [1 / 3]]
    )
    hxx, hyy = (total + difference) / 2, (total - difference) / 2
    steps = np.array(around(rule, (9, 9)), float)
    bounds = [-(i * i * hxx + 2 * i * j * hxy + j * j * hyy) / 2 for i, j in steps]
    inside = np.all(np.array(bounds) > 0, axis=0)
    area = np.zeros(samples)
    for step, bound in zip(steps, bounds, strict=True):
        length = np.hypot(*step)
        low, high = np.full(samples, -np.inf), np.full(samples, np.inf)
        for other, limit in zip(steps, bounds, strict=True):
            rate = (step[0] * other[1] - step[1] * other[0]) / length
            room = limit - bound * (step @ other) / length**2
            if rate > 0:
                high = np.minimum(high, room / rate)
            elif rate < 0:
                low = np.maximum(low, room / rate)
        area += np.where(inside, bound / length * np.maximum(high - low, 0) / 2, 0)
    true = np.where((hxx * hyy > hxy**2) & (total < 0), hxx * hyy - hxy**2, 0)
    # against the true summits of the same samples: most of the scatter drops out
    curvature = np.average(total, weights=area) / np.average(total, weights=true)
    return np.array([area.mean() / true.mean(), curvature, curvature])


# the 9-point rule counts 1.0 % too many: ridges that run askew look like several summits
def test_summits_of_a_well_resolved_gaussian_surface_after_nayak():
    rule, excess, lack = 9, 0.0103, 0.0033
    limit = limit_over_nayak(rule)
    # it scatters by 0.3 % of what is not a true summit's
    assert_allclose(limit, [1 + excess, 1 - lack, 1 - lack], atol=0.002 + 0.01 * excess)
    ratios = over_nayak(rule)
    # what a grid of finite pixels does varies as p²: a third of the change from two pixels to one,
    # on the same surfaces
    bias = (ratios[:, 1] - ratios[:, 0]).mean(axis=0) / 3
    mean, error = mean_and_error(ratios[:, 0])
    assert np.all(error < 0.007)
    assert np.all(np.abs(bias) < 0.04)
    assert np.all(np.abs(mean - bias - limit) < 4 * error)


# --- Summits
# ----------------------------------------------------------------------------------------------------


# --- prominence ---

EIGHT = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))
FOUR = ((1, 0), (-1, 0), (0, 1), (0, -1))


def by_levels(heights, point, structure):
    """The prominence of one top, by cutting the map at every level below it."""
    top = heights[point]
    for level in np.unique(heights[heights <= top])[::-1]:
        labels, _ = ndimage.label(heights >= level, structure)
        if heights[labels == labels[point]].max() > top:
            return top - level
    return np.inf


@mark.parametrize("offsets", [EIGHT, FOUR])
def test_prominence_is_the_drop_to_the_level_at_which_a_higher_top_joins(offsets):
    rng = np.random.default_rng(1)
    structure = np.ones((3, 3)) if offsets == EIGHT else ndimage.generate_binary_structure(2, 1)
    for _ in range(2):
        heights = ndimage.gaussian_filter(rng.normal(size=(20, 24)), 1)
        heights[rng.random(heights.shape) < 0.1] = np.nan
        found = prominences(heights, offsets)
        filled = np.where(np.isnan(heights), -np.inf, heights)
        assert (found > 0).any()
        for point in map(tuple, np.argwhere(found > 0)):
            # a separate piece has no higher one to join
            level = np.where(np.isnan(heights), np.nan, heights)
            labels, _ = ndimage.label(np.isfinite(level), structure)
            own = np.where(labels == labels[point], filled, -np.inf)
            finite = np.where(np.isfinite(own), own, np.nan)
            expected = by_levels(np.nan_to_num(finite, nan=-1e9), point, structure)
            expected = np.inf if expected > 1e6 else expected
            assert found[point] == expected


def test_pruned_summits_are_those_prominent_enough():
    rule = 9
    surface = hs.random_surface((64, 64), 1e-6, 1e-6, 10e-6, seed=1)
    every = surface.summits(rule)
    assert np.array_equal(surface.summits(rule, prominence=1e-30).height, every.height)
    counts = [len(surface.summits(rule, prominence=p)) for p in (0.1e-6, 0.5e-6, 2e-6, 1.0)]
    assert len(every) > counts[0] > counts[1] > counts[2] >= counts[3] == 1
    kept = surface.summits(rule, prominence=0.5e-6)
    assert set(zip(kept.x, kept.y, strict=True)) < set(zip(every.x, every.y, strict=True))


def test_a_plateau_is_as_prominent_as_its_top():
    heights = np.zeros((9, 12))
    heights[3:5, 3:5] = 2.0
    heights[3:6, 8] = 3.0
    assert sorted(hs.Surface(heights, 1.0).summits(9, prominence=1.9).height) == [2.0, 3.0]
    assert hs.Surface(heights, 1.0).summits(9, prominence=2.1).height.tolist() == [3.0]


# --- summits that stand apart ---


@mark.parametrize("count", [1, 2, 10])
def test_summits_far_above_all_others_are_counted(count):
    height = np.random.default_rng(count).normal(0, 1, 10_000)
    height[:count] = 20 + np.arange(count)
    assert detached_summits(height) == count
    assert detached_summits(height * 1e-9 + 1e-3) == count


@mark.parametrize("draw", ["normal", "gumbel"])
def test_nothing_stands_apart_in_heights_drawn_by_chance(draw):
    rng = np.random.default_rng(1)
    # the chance of one in all is below 300 · 10 · 1e-6
    for size in (111, 1000):
        assert [detached_summits(getattr(rng, draw)(size=size)) for _ in range(100)] == [0] * 100


def test_summits_meet_where_the_sum_of_their_paraboloids_is_highest():
    random = np.random.default_rng(4)
    first, second = (
        Summits(
            random.uniform(0, 20e-9, 6),
            random.uniform(20e-6, 60e-6, 6),
            40e-6 * np.arange(6) + random.uniform(-1e-6, 1e-6, 6),
            random.uniform(-1e-6, 1e-6, 6),
        )
        for _ in range(2)
    )
    found = first.meeting(second, shift=(0.3e-6, -0.2e-6))
    assert len(found) == 6
    order = np.argsort(found.x)
    for one, other, at in zip(range(6), range(6), order, strict=True):
        centre = np.array([second.x[other] + 0.3e-6, second.y[other] - 0.2e-6])

        def gap(place, one=one, other=other, centre=centre):
            of_first = np.sum((place - (first.x[one], first.y[one])) ** 2) / (2 * first.radius[one])
            of_second = np.sum((place - centre) ** 2) / (2 * second.radius[other])
            return (of_first + of_second) * 1e9

        lowest = minimize(
            gap, centre, method="Nelder-Mead", options={"xatol": 1e-13, "fatol": 1e-12}
        )
        # paraboloids are spheres but for the square of the slope
        height = first.height[one] + second.height[other] - lowest.fun * 1e-9
        assert found.height[at] == approx(height, abs=2e-12 * lowest.fun)
        assert_allclose([found.x[at], found.y[at]], lowest.x, atol=1e-12)
        assert 1 / found.radius[at] == approx(1 / first.radius[one] + 1 / second.radius[other])
        # it rises towards the first where the second is before it
        flank = -(lowest.x[0] - first.x[one]) / first.radius[one]
        assert found.slope[at] == approx(flank, rel=2e-3)


def test_summits_meet_that_have_chosen_each_other():
    first = Summits([0.0, -5e-9, 1e-9], 10e-6, [0.0, 1e-6, 50e-6], [0.0, 0.0, 0.0])
    second = Summits([0.0, 0.0], 10e-6, [0.4e-6, 90e-6], [0.0, 0.0])
    found = first.meeting(second)
    # the second one is nearer to a higher one, which has chosen it, and the last two are beyond
    # reach of any
    assert len(found) == 1
    assert found.slope == approx(-0.4 / 20, rel=1e-3)
    assert found.x == approx(0.2e-6)
    mirrored = second.meeting(first)
    assert mirrored.slope == approx(-found.slope)
    assert mirrored.height == approx(found.height)
