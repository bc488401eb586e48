"""Two tangential directions."""

import itertools

import numpy as np
import pytest
from planar_half_space import PlanarHalfSpace
from planar_paths import TABLES, way

import historysim as hs

# normal load [N] of a sphere of radius 1 m at an approach of 1 m, with E* = 40 GPa
UNIT = 4 / 3 * 4e10


def test_along_a_line(page):
    """Motion along one line, in any direction

    Compared with **the memory of one direction**, which is exact: the same random moves along a
    line at 40°, with a normal load that changes.

    The model ends where the path turns: from then on it is not exact, and settled to a tolerance
    (below).
    """

    def line(moves):
        pair = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=10e9)
        rough = hs.Ensemble(pair, [0.0, -0.2, -0.5], summit_radius=1.0, friction=0.3)
        direction = np.array([np.cos(np.radians(40)), np.sin(np.radians(40))])
        one = two = rough.initial_state()
        found = []
        for normal, u in moves:
            one = rough.advance(one, normal_load=normal, tangential_displacement=u)
            two = rough.advance(
                two, normal_load=normal, tangential_displacement=tuple(u * direction)
            )
            found.append(
                (
                    one.tangential_load,
                    *two.tangential_load,
                    one.dissipated_energy,
                    two.dissipated_energy,
                )
            )
        return direction, np.array(found)

    rng = np.random.default_rng(4)
    moves = np.column_stack([rng.uniform(0.2, 1.5, 60) * UNIT, rng.normal(0, 0.2, 60)])
    direction, found = page.shows(line, moves)
    page.row(
        "tangential load [N]", found[:, :1] * direction, found[:, 1:3], 1e-12, of="the largest"
    )
    page.row("energy lost [J]", found[:, 3], found[:, 4], 1e-12, of="all of it")

    @page.picture
    def draw(axes):
        axes.plot(found[:, 1] / UNIT, found[:, 2] / UNIT, ".-", ms=3, lw=0.5)
        axes.set(xlabel="T in x, of N at approach 1", ylabel="T in y", aspect="equal")


def test_circle_and_square(page):
    """A circle and a square

    Compared with **tables of another program** with many rings and steps, at an amplitude of 0.7 of
    the preliminary displacement, in 48 steps a side.

    The model ends where Poisson's ratio is above 0: at 0.3 the load is .0015 of μN off, and the
    body may not spin.
    """

    def walks(paths):
        pair = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=10e9)
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=1.0, friction=1.0)
        found = {}
        for name, path in paths.items():
            state = ball.advance(ball.initial_state(), normal_displacement=1.0)
            states = []
            for place in path:
                state = ball.advance(state, tangential_displacement=tuple(place))
                states.append((*state.tangential_load, state.dissipated_energy))
            found[name] = np.array(states)
        return found

    paths = {shape: way(shape, 0.7, 48) for shape in ("circle", "square")}
    found = page.shows(walks, paths)
    for shape in paths:
        ends, table = found[shape][47::48] / UNIT, np.array(TABLES[shape])
        page.row(
            f"T on a {shape}, of N",
            table[:, :2],
            ends[:, :2],
            1e-3,
            "tolerance, by default",
            of="μN",
            scale=1,
        )
        page.row(
            f"energy lost on a {shape}, of N × 1 m",
            table[:, 2],
            ends[:, 2],
            2e-3,
            "tolerance",
            of="all of it",
        )

    @page.picture
    def draw(axes):
        for shape in paths:
            axes.plot(*(found[shape][:, :2] / UNIT).T, label=shape)
            axes.plot(*np.array(TABLES[shape])[:, :2].T, "k.")
        axes.set(xlabel="T in x, of μN", ylabel="T in y, of μN", aspect="equal")


@pytest.mark.slow
def test_half_space(page):
    """A zigzag under a waving load, with Poisson's ratio 0.3

    Compared with **a half-space, point by point** (`planar_half_space.py`), whose tractions on
    cells of 1/32 of the contact displace it in both directions, in steps of second order. At 80
    cells the error is below .002.

    The model ends where Poisson's ratio couples the directions more than that.
    """

    def zigzag(path, approach):
        pair = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=10e9)
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=1.0, friction=1.0)
        state = ball.advance(ball.initial_state(), normal_displacement=approach[0])
        found = []
        for place, depth in zip(path, approach, strict=True):
            state = ball.advance(
                state, normal_displacement=float(depth), tangential_displacement=tuple(place)
            )
            found.append((*state.tangential_load, state.dissipated_energy))
        return np.array(found)

    corners = np.array([(0, 0), (0.9, 0.1), (0.2, 0.3), (0.8, 0.5), (0.1, 0.7)])
    share = np.arange(1, 11)[:, None] / 10
    path = np.vstack([a + share * (b - a) for a, b in itertools.pairwise(corners)])
    approach = 0.8 + 0.2 * np.cos(5 * np.pi * np.linspace(0, 1, len(path)))
    found = page.shows(zigzag, path, approach) / UNIT
    oracle = PlanarHalfSpace(32, 0.3).to((0.0, 0.0), approach[0])
    expected = []
    for place, depth in zip(path, approach, strict=True):
        oracle.to(place, depth)
        expected.append((*(0.75 * oracle.tangential_load), 0.75 * oracle.dissipated))
    expected = np.array(expected)
    page.row(
        "T, of N at approach 1",
        expected[:, :2],
        found[:, :2],
        2.5e-3,
        "cells of 1/32",
        of="μN",
        scale=1,
    )
    page.row("energy lost", expected[-1, 2], found[-1, 2], 1e-2, "cells of 1/32", of="all of it")

    @page.picture
    def draw(axes):
        axes.plot(*found[:, :2].T, label="found")
        axes.plot(*expected[:, :2].T, "k.", ms=3, label="half-space")
        axes.set(xlabel="T in x, of N at approach 1", ylabel="T in y", aspect="equal")
