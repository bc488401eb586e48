import math

import numpy as np
import pytest
from adhesive import ELASTIC, EPS, PULL, UNLOADED, E, R, W, moduli, radii, works
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize, minimize_scalar

from historysim.contact.adhesion import (
    jkr_approach,
    jkr_contact_radius,
    jkr_normal_load,
    jkr_pull_off_load,
)


def jkr_energy(a, approach):
    """Elastic energy of a sphere pressed in by δ over a circle of radius a, less the energy of adhesion."""
    return E * (approach**2 * a - 2 * approach * a**3 / (3 * R) + a**5 / (5 * R**2)) - math.pi * W * a**2


def jkr_least(approach):
    # the least energy beyond its maximum at a small radius: a > 0.35 of the unloaded one
    return minimize_scalar(
        lambda a: jkr_energy(a * UNLOADED, approach) / (PULL * 1e-9), bounds=(0.5, 6), options={"xatol": 1e-12}
    )


@pytest.mark.parametrize("depth", [-0.5, 0.0, 1.0, 7.0])
def test_jkr_is_the_least_energy_at_an_approach(depth):
    approach = depth * UNLOADED**2 / (3 * R)
    a = jkr_least(approach).x * UNLOADED
    # a minimum is found to about √EPS of the radius
    assert jkr_approach(a, **ELASTIC) == pytest.approx(approach, rel=1e-6, abs=1e-6 * UNLOADED**2 / R)
    step = 1e-3 * UNLOADED**2 / R
    force = (jkr_least(approach + step).fun - jkr_least(approach - step).fun) * PULL * 1e-9 / (2 * step)
    # the slope of the energy: the difference is good to (step/δ)² and to EPS over the step
    assert jkr_normal_load(a, **ELASTIC) == pytest.approx(force, rel=1e-5, abs=1e-5 * PULL)


@pytest.mark.parametrize("share", [-1.4, -1, 0, 1, 30])
def test_jkr_is_the_least_energy_under_a_load(share):
    depth = UNLOADED**2 / R

    def potential(state):
        a, approach = state[0] * UNLOADED, state[1] * depth
        return (jkr_energy(a, approach) - share * PULL * approach) / (PULL * depth)

    # near enough: a start too far out is over the barrier, and comes apart
    start = [1.5, 2.0] if share >= 0 else [0.85, 0.2]
    least = minimize(potential, start, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15})
    a = jkr_contact_radius(share * PULL, **ELASTIC)
    # a minimum is found to about √EPS times its flatness, which grows towards pull-off
    assert a == pytest.approx(least.x[0] * UNLOADED, rel=1e-6)
    assert jkr_approach(a, **ELASTIC) == pytest.approx(least.x[1] * depth, rel=1e-5)


def test_jkr_without_load_and_at_its_pull_off_points():
    assert jkr_contact_radius(0, **ELASTIC) == pytest.approx(UNLOADED, rel=8 * EPS)
    assert jkr_approach(UNLOADED, **ELASTIC) == pytest.approx(UNLOADED**2 / (3 * R), rel=16 * EPS)
    force = jkr_pull_off_load(summit_radius=R, work_of_adhesion=W)
    assert force == pytest.approx(-1.5 * PULL, rel=4 * EPS)
    held = jkr_pull_off_load(summit_radius=R, work_of_adhesion=W, control="displacement")
    assert held == pytest.approx(-5 / 6 * PULL, rel=4 * EPS)
    scale = np.cbrt(9 * math.pi * W * R**2 / (8 * E))
    assert jkr_contact_radius(force, **ELASTIC) == pytest.approx(scale, rel=16 * EPS)
    a = np.linspace(0, 2 * UNLOADED, 200_001)
    # a grid of n points misses a minimum by (1/n)² of what stands around it
    assert jkr_normal_load(a, **ELASTIC).min() == pytest.approx(force, rel=1e-9)
    at_least_approach = a[jkr_approach(a, **ELASTIC).argmin()]
    assert jkr_normal_load(at_least_approach, **ELASTIC) == pytest.approx(held, rel=1e-4)


@given(st.floats(0, 1e6), radii, moduli, works)
def test_jkr_load_and_contact_radius_are_inverse(excess, radius, modulus, work):
    elastic = {"summit_radius": radius, "contact_modulus": modulus, "work_of_adhesion": work}
    load = (excess - 1.5) * math.pi * work * radius
    a = jkr_contact_radius(load, **elastic)
    size = abs(load) + math.pi * work * radius
    assert jkr_normal_load(a, **elastic) == pytest.approx(load, rel=0, abs=64 * EPS * size)
