"""A height map in a few lines: what they say, and that they say something of every map."""

import math
import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx, fixture, mark

from historysim.surfaces.heights import Surface
from historysim.surfaces.inspection import summary
from historysim.surfaces.random import random_surface

PREFIXES = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
LENGTH = re.compile(r"(-?[\d.e+-]+) (f|p|n|µ|m|k|M|)m(?=\b)")


def lines_of(surface):
    lines = summary(surface)
    found = dict(lines)
    assert len(found) == len(lines)
    return found


def lengths(text):
    """Numbers in m that stand in a text with their units."""
    return [float(number) * PREFIXES[prefix] for number, prefix in LENGTH.findall(text)]


def rounded(*values):
    """Four digits are printed."""
    return approx(list(values), rel=5.1e-4)


@fixture
def surface():
    return random_surface((64, 40), (1e-6, 2e-6), 20e-9, (8e-6, 12e-6), seed=1)


def test_the_numbers_agree_with_the_heights(surface):
    found, z = lines_of(surface), surface.heights
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
        np.abs(np.roll(z, -1, axis) - 2 * z + np.roll(z, 1, axis)) / pixel**2
        for axis, pixel in enumerate((1e-6, 2e-6))
    ]
    curvature = math.sqrt(np.mean((sum(bends) / 2) ** 2))
    assert [float(found["rms curvature"].removesuffix(" 1/m"))] == rounded(curvature)
    assert [float(found["bandwidth ψ"])] == rounded((z.std() * curvature / slope**2) ** 2)


def test_the_correlation_agrees_with_the_heights(surface):
    found, z = lines_of(surface), surface.heights - surface.heights.mean()
    along = []
    for level, name in ((0.1, "0.1"), (1 / math.e, "1/e")):
        expected = []
        for axis, pixel in enumerate((1e-6, 2e-6)):
            curve = [
                np.mean(z * np.roll(z, lag, axis)) / z.var() for lag in range(z.shape[axis] // 2)
            ]
            after = next(lag for lag, value in enumerate(curve) if value <= level)
            part = (curve[after - 1] - level) / (curve[after - 1] - curve[after])
            expected.append((after - 1 + part) * pixel)
        along.append(expected)
        assert lengths(found[f"autocorrelation length at {name}"]) == rounded(*expected)
    assert [float(found["lay γ"])] == rounded(along[0][0] / along[0][1])


def test_the_summits_agree_with_the_9_point_rule(surface):
    found, summits = lines_of(surface), surface.summits(9)
    count, density = found["summits, 9-point rule"].split(", ")
    assert int(count) == len(summits)
    assert [float(density.removesuffix(" per µm²"))] == rounded(len(summits) / (64 * 80))
    assert lengths(found["mean summit height"]) == rounded(
        summits.height.mean() - surface.heights.mean()
    )
    assert lengths(found["mean summit radius"]) == rounded(
        summits.radius.mean(), np.median(summits.radius)
    )


@mark.parametrize("shape, axis", [((1, 40), "y")])
def test_a_profile_has_one_axis_and_rule_3(shape, axis):
    surface = random_surface(shape, (1e-6, 1e-6), 20e-9, 5e-6, seed=1)
    uneven = Surface(surface.heights, (1e-6, 7.0) if axis == "x" else (7.0, 1e-6), periodic=True)
    found = lines_of(uneven)
    assert found["points"] == "40, 1 µm apart"
    assert found["size"] == "40 µm"
    assert found["autocorrelation length at 0.1"].endswith(f"along {axis}")
    assert len(lengths(found["autocorrelation length at 0.1"])) == 1
    assert "lay γ" not in found
    # without an area there is no density
    assert found["summits, 3-point rule"] == str(len(surface.summits(3)))


FLAT = {
    "constant": np.full((6, 5), 3e-9),
    "one point among missing ones": [[np.nan, 1e-9], [np.nan, np.nan]],
}


@mark.parametrize("name", FLAT)
def test_what_a_flat_map_does_not_have_is_none(name):
    found = lines_of(Surface(FLAT[name], 1e-6))
    assert found["rms height Rq"] == found["height range Rz"] == "0 m"
    assert found["skewness, kurtosis"] == "none, none"
    assert found["bandwidth ψ"] == "none"
    assert found["autocorrelation length"] == "none: all heights are equal"
    assert [text for label, text in found.items() if label.startswith("summits")] == ["none"]
    assert not any(label.startswith("mean summit") for label in found)


SHAPES = st.tuples(st.integers(1, 6), st.integers(1, 6))


@given(
    data=st.data(),
    shape=SHAPES,
    scale=st.sampled_from([1e-12, 1e-9, 1e-6, 1.0, 1e6]),
    periodic=st.booleans(),
)
def test_every_map_has_lines_without_numbers_that_are_none(data, shape, scale, periodic):
    values = st.one_of(
        st.just(math.nan),
        st.integers(-3, 3).map(float),
        st.integers(-(10**6), 10**6).map(lambda n: n * 1e-6),
    )
    count = shape[0] * shape[1]
    heights = (
        np.array(data.draw(st.lists(values, min_size=count, max_size=count))).reshape(shape) * scale
    )
    if np.isnan(heights).all():
        heights[0, 0] = 0.0
    surface = Surface(heights, (scale, 2 * scale), periodic=periodic)
    found = lines_of(surface)
    for label, text in found.items():
        assert text == text.strip()
        assert text
        assert "\n" not in label + text
        assert not re.search(r"\b(nan|inf)\b", text)
