"""Area laws against printed limits, ellipses against displacements of their pressure, summits against draws.

The laws on one map against its summits and its whole solution.
"""

import math

import numpy as np
from golden import check_messages
from pairs import GLASS as PAIR
from pytest import approx, fixture, mark

import historysim as hs
from historysim.contact.greenwood_williamson import summit_contact
from historysim.interaction.areas import (
    _elliptic,
    bowden_tabor_area,
    bush_gibson_thomas,
    bush_gibson_thomas_area,
    persson_area,
)
from historysim.surfaces.surface_statistics import SpectralMoments

LOADS = (0.02, 0.1)
MOMENTS = SpectralMoments(1.0, 1.0, 3.0)
SLOPE = math.sqrt(2.0)


@fixture(scope="module")
def surface():
    return hs.random_surface(
        shape=(128, 128),
        pixel_size=1e-6,
        rms_height=24e-9,
        autocorrelation_length=20e-6,
        autocorrelation="gaussian",
        seed=1,
    )


def test_summits_have_the_area_of_an_ensemble(surface):
    found = hs.area_laws(surface, PAIR, LOADS, whole_map=False).real_contact_area.sel(law="summits")
    ensemble = hs.Ensemble.from_summits(PAIR, surface.summits(), friction=0.2)
    history = hs.replay(ensemble, [hs.NormalLoad(float(k), load) for k, load in enumerate(LOADS)])
    assert found.to_numpy() == approx(history.real_contact_area.to_numpy(), rel=1e-3)


def test_laws_enclose_the_whole_map(surface):
    found = hs.area_laws(surface, PAIR, LOADS, hardness=5e9)
    area = found.real_contact_area
    assert list(found.law.values)[-1] == "whole map"
    assert (area.sel(law="Persson") < area.sel(law="whole map")).all()
    assert (area.sel(law="summits") < area.sel(law="whole map")).all()
    assert area.sel(law="Bowden–Tabor").to_numpy() == approx(np.array(LOADS) / 5e9)
    assert found.holds.sel(law="summits").all()
    assert not found.holds.sel(law="Bowden–Tabor").any()


# --- the laws ---


def displacement(x, y, ratio):
    """Of the half-space at a point inside an ellipse of axes 1 and `ratio`, for p0/E* = 1: ∫∫ p/(π r) in polar form."""
    angles = (np.arange(400) + 0.5) * 2 * np.pi / 400
    c, s = np.cos(angles), np.sin(angles)
    # along a ray the pressure is √(f - 2 g r - h r²)
    f, g, h = 1 - x**2 - (y / ratio) ** 2, x * c + y * s / ratio**2, c**2 + (s / ratio) ** 2
    end = (-g + np.sqrt(g**2 + f * h)) / h
    nodes, weights = np.polynomial.legendre.leggauss(200)
    r = end[:, np.newaxis] * (nodes + 1) / 2
    root = np.sqrt(np.maximum(f - 2 * g[:, np.newaxis] * r - h[:, np.newaxis] * r**2, 0))
    return float((root @ weights * end / 2).sum()) * 2 * np.pi / 400 / np.pi


@mark.parametrize("ratio", [1.0, 0.6, 0.2])
def test_ellipses_carry_what_the_displacements_of_their_pressure_say(ratio):
    middle = displacement(0.0, 0.0, ratio)
    along = 2 * (middle - displacement(0.5, 0.0, ratio)) / 0.5**2
    across = 2 * (middle - displacement(0.0, 0.5 * ratio, ratio)) / (0.5 * ratio) ** 2
    mean = math.sqrt(along * across)
    load, area = _elliptic(np.array([along / across]))
    assert load[0] == approx(2 / 3 * math.pi * ratio * math.sqrt(mean) / middle**1.5, rel=2e-4)
    assert area[0] == approx(math.pi * ratio * mean / middle, rel=2e-4)


def test_far_from_the_mean_plane_the_area_is_linear_by_bush_gibson_and_thomas():
    pressure, area = bush_gibson_thomas(np.array([4.0, 12.0, 30.0]), MOMENTS, 1.0)
    factor = area * SLOPE / pressure
    assert np.all(np.diff(factor) > 0)
    assert factor[-1] == approx(math.sqrt(2 * math.pi), rel=1e-3)


@mark.parametrize("alpha", [2.0, 10.0])
def test_summits_drawn_from_their_distribution_carry_the_same(alpha):
    rng = np.random.default_rng(1)
    moments = SpectralMoments(1.0, 1.0, alpha)
    count, separation = 400_000, 0.8
    # z, z_xx, z_yy and z_xy of a Gaussian surface (Nayak 1971)
    covariance = [
        [1, -1, -1, 0],
        [-1, alpha, alpha / 3, 0],
        [-1, alpha / 3, alpha, 0],
        [0, 0, 0, alpha / 3],
    ]
    z, xx, yy, xy = rng.multivariate_normal(np.zeros(4), covariance, count).T
    determinant = xx * yy - xy**2
    summit = (determinant > 0) & (xx + yy < 0) & (z > separation)
    weight = determinant[summit] / (2 * math.pi * count)
    half = np.sqrt((xx - yy) ** 2 / 4 + xy**2)[summit]
    mean = -(xx + yy)[summit] / 2
    load, area = _elliptic((mean - half) / (mean + half))
    over, curvature = z[summit] - separation, np.sqrt(determinant[summit])
    drawn = np.array(
        [weight * load * over**1.5 / np.sqrt(curvature), weight * area * over / curvature]
    )
    error = drawn.std(axis=1) * math.sqrt(summit.sum())
    expected = bush_gibson_thomas(separation, moments, 1.0)
    assert np.all(
        np.abs(drawn.sum(axis=1) - np.array(expected))
        < 4 * np.maximum(error, 1e-3 * np.array(expected))
    )


def test_round_summits_agree_with_hertz():
    load, area = _elliptic(np.array([1.0]))
    found = summit_contact([1.0], 1.0, 0.9, contact_modulus=1.0)
    assert load[0] * 0.1**1.5 == approx(found.normal_load)
    assert area[0] * 0.1 == approx(found.contact_area)


def test_area_over_pressure_inverts_the_separation():
    pressure, area = bush_gibson_thomas(np.array([0.33, 1.21, 3.07]), MOMENTS, 5e10)
    found = bush_gibson_thomas_area([*pressure, 0.0, 5e10], MOMENTS, 5e10)
    assert found == approx([*area, 0.0, np.nan], rel=1e-4, nan_ok=True)


def test_persson_has_his_limits():
    assert persson_area(1e-6, MOMENTS, 1.0) == approx(math.sqrt(8 / math.pi) * 1e-6 / SLOPE)
    assert persson_area(10.0, MOMENTS, 1.0) == approx(1.0)


def test_bowden_and_tabor_flow_until_all_touches():
    assert bowden_tabor_area([0.0, 1e9, 9e9], 5e9) == approx([0.0, 0.2, 1.0])


def test_messages():
    check_messages(globals())
