"""A height map in a few lines: what they say, and that they say something of every map."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.random import random_surface
from historysim.surfaces.surface_summary import summary

PREFIXES = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
LENGTH = re.compile(r"(-?[\d.e+-]+) (f|p|n|µ|m|k|M|)m(?=\b)")
LINES = [
    "points",
    "size",
    "missing",
    "rms height Rq",
    "mean deviation Ra",
    "height range Rz",
    "skewness, kurtosis",
    "rms slope",
    "rms curvature",
    "bandwidth ψ",
    "autocorrelation length at 0.1",
    "autocorrelation length at 1/e",
    "lay γ",
    "summits, 9-point rule",
    "mean summit height",
    "mean summit radius",
]


def told(surface, rule=9):
    lines = summary(surface, rule)
    found = dict(lines)
    assert len(found) == len(lines)
    return found


def lengths(text):
    """Numbers in m that stand in a text with their units."""
    return [float(number) * PREFIXES[prefix] for number, prefix in LENGTH.findall(text)]


def rounded(*values):
    """Four digits are told."""
    return pytest.approx(list(values), rel=5.1e-4)


@pytest.fixture
def surface():
    return random_surface((64, 40), (1e-6, 2e-6), 20e-9, (8e-6, 12e-6), seed=1)


def test_a_map_is_told_in_these_lines(surface):
    assert list(told(surface)) == LINES


def test_the_numbers_are_those_of_the_heights(surface):
    found, z = told(surface), surface.heights
    deviation = z - z.mean()
    assert found["points"] == "64 × 40, 1 µm × 2 µm apart"
    assert found["size"] == "64 µm × 80 µm"
    assert found["missing"] == "none"
    assert lengths(found["rms height Rq"]) == rounded(z.std())
    assert lengths(found["mean deviation Ra"]) == rounded(np.abs(deviation).mean())
    assert lengths(found["height range Rz"]) == rounded(np.ptp(z))
    third, fourth = (np.mean((deviation / z.std()) ** power) for power in (3, 4))
    assert found["skewness, kurtosis"] == f"{third:.4g}, {fourth:.4g}"
    # of a map that repeats, the differences go round
    slopes = [np.abs(np.roll(z, -1, axis) - z) / pixel for axis, pixel in enumerate((1e-6, 2e-6))]
    slope = math.sqrt(np.mean((sum(slopes) / 2) ** 2))
    assert [float(found["rms slope"])] == rounded(slope)
    bends = [
        np.abs(np.roll(z, -1, axis) - 2 * z + np.roll(z, 1, axis)) / pixel**2 for axis, pixel in enumerate((1e-6, 2e-6))
    ]
    curvature = math.sqrt(np.mean((sum(bends) / 2) ** 2))
    assert [float(found["rms curvature"].removesuffix(" 1/m"))] == rounded(curvature)
    assert [float(found["bandwidth ψ"])] == rounded((z.std() * curvature / slope**2) ** 2)


def test_the_correlation_is_that_of_the_heights(surface):
    found, z = told(surface), surface.heights - surface.heights.mean()
    along = []
    for level, name in ((0.1, "0.1"), (1 / math.e, "1/e")):
        expected = []
        for axis, pixel in enumerate((1e-6, 2e-6)):
            curve = [np.mean(z * np.roll(z, lag, axis)) / z.var() for lag in range(z.shape[axis] // 2)]
            after = next(lag for lag, value in enumerate(curve) if value <= level)
            part = (curve[after - 1] - level) / (curve[after - 1] - curve[after])
            expected.append((after - 1 + part) * pixel)
        along.append(expected)
        assert lengths(found[f"autocorrelation length at {name}"]) == rounded(*expected)
    assert [float(found["lay γ"])] == rounded(along[0][0] / along[0][1])


@pytest.mark.parametrize("rule", [3, 5, 9])
def test_the_summits_are_those_of_the_rule(surface, rule):
    found, summits = told(surface, rule), surface.summits(rule)
    count, density = found[f"summits, {rule}-point rule"].split(", ")
    assert int(count) == len(summits)
    assert [float(density.removesuffix(" per µm²"))] == rounded(len(summits) / (64 * 80))
    assert lengths(found["mean summit height"]) == rounded(summits.height.mean() - surface.heights.mean())
    assert lengths(found["mean summit radius"]) == rounded(summits.radius.mean(), np.median(summits.radius))


def test_summits_are_over_the_mean_of_the_points_that_are_there():
    heights = np.full((5, 6), 2e-9)
    heights[2, 2] = 5e-9
    heights[4, 5] = np.nan
    found = told(Surface(heights, 1e-6))
    assert found["missing"] == "3.33 % of the points"
    mean = (28 * 2 + 5) / 29
    assert lengths(found["mean summit height"]) == rounded((5 - mean) * 1e-9)


@pytest.mark.parametrize(("shape", "axis"), [((40, 1), "x"), ((1, 40), "y")])
def test_a_profile_has_one_axis_and_rule_3(shape, axis):
    surface = random_surface(shape, (1e-6, 1e-6), 20e-9, 5e-6, seed=1)
    uneven = Surface(surface.heights, (1e-6, 7.0) if axis == "x" else (7.0, 1e-6), periodic=True)
    found = told(uneven)
    assert found == told(uneven, rule=3)
    assert found["points"] == "40, 1 µm apart"
    assert found["size"] == "40 µm"
    assert found["autocorrelation length at 0.1"].endswith(f"along {axis}")
    assert len(lengths(found["autocorrelation length at 0.1"])) == 1
    assert "lay γ" not in found
    # without an area there is no density
    assert found["summits, 3-point rule"] == str(len(surface.summits(3)))


FLAT = {
    "constant": np.full((6, 5), 3e-9),
    "constant, a third missing": np.where(np.arange(30).reshape(6, 5) % 3, 3e-9, np.nan),
    "one point": [[1e-9]],
    "one point among missing ones": [[np.nan, 1e-9], [np.nan, np.nan]],
}


@pytest.mark.parametrize("name", FLAT)
def test_what_a_flat_map_does_not_have_is_none(name):
    found = told(Surface(FLAT[name], 1e-6))
    assert found["rms height Rq"] == found["height range Rz"] == "0 m"
    assert found["skewness, kurtosis"] == "none, none"
    assert found["bandwidth ψ"] == "none"
    assert found["autocorrelation length"] == "none: all heights are equal"
    assert [text for label, text in found.items() if label.startswith("summits")] == ["none"]
    assert not any(label.startswith("mean summit") for label in found)


def test_one_point_has_a_size():
    found = told(Surface([[1e-9]], (1e-6, 2e-6)))
    assert found["points"] == "1 × 1, 1 µm × 2 µm apart"
    assert found["size"] == "1 µm × 2 µm"


SHAPES = st.tuples(st.integers(1, 6), st.integers(1, 6))


@settings(max_examples=200)
@given(data=st.data(), shape=SHAPES, scale=st.sampled_from([1e-12, 1e-9, 1e-6, 1.0, 1e6]), periodic=st.booleans())
def test_every_map_is_told_in_lines_without_numbers_that_are_none(data, shape, scale, periodic):
    values = st.one_of(
        st.just(math.nan), st.integers(-3, 3).map(float), st.integers(-(10**6), 10**6).map(lambda n: n * 1e-6)
    )
    count = shape[0] * shape[1]
    heights = np.array(data.draw(st.lists(values, min_size=count, max_size=count))).reshape(shape) * scale
    if np.isnan(heights).all():
        heights[0, 0] = 0.0
    surface = Surface(heights, (scale, 2 * scale), periodic=periodic)
    found = told(surface, data.draw(st.sampled_from([3, 5, 9])))
    for label, text in found.items():
        assert text == text.strip()
        assert text
        assert "\n" not in label + text
        assert not re.search(r"\b(nan|inf)\b", text)


def test_a_map_with_a_third_missing():
    heights = np.random.default_rng(1).normal(size=(50, 30)) * 1e-9
    heights[np.random.default_rng(2).random(heights.shape) < 0.31] = np.nan
    found = told(Surface(heights, 1e-6))
    assert list(found) == LINES
    assert found["missing"] == f"{100 * np.isnan(heights).mean():.3g} % of the points"
    assert lengths(found["rms height Rq"]) == rounded(np.nanstd(heights))


@pytest.mark.parametrize("rule", [7, 0, None, "9", 9.0])
def test_other_rules_are_refused(surface, rule):
    with pytest.raises(InputError, match=r"rule is .*; expected 3"):
        summary(surface, rule)


@pytest.mark.parametrize(("heights", "pixel"), [(1e-9, 1e-200), (1e-9, 1e200), (1e200, 1.0)])
def test_lengths_that_no_float_can_square_are_refused(surface, heights, pixel):
    with pytest.raises(InputError, match="so large or so small"):
        summary(Surface(surface.heights / 20e-9 * heights, pixel))
