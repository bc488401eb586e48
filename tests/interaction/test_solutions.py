import numpy as np
import pytest
from half_space import HalfSpace as BruteForce

import historysim as hs
from historysim.interaction.solutions import NormalSolutions

pytest.importorskip("tamaas", reason='needs pip install "historysim[interaction]"')

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)  # ν = 0: θ = 1
MU = 0.2


@pytest.fixture(autouse=True)
def nothing_is_left_behind(monkeypatch, tmp_path):
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path / "cache"))


def balls(distance, *, points=96, side=96.0, radius=400.0, periodic=False):
    """Two balls of one height, their centres at a distance along x."""
    x = (np.arange(points) + 0.5) * side / points - side / 2
    first, second = ((x + sign * distance / 2) ** 2 / (2 * radius) for sign in (-1, 1))
    heights = -np.minimum(first, second)[:, None] - x**2 / (2 * radius)
    return hs.Surface(heights, side / points, periodic=periodic)


def rough(seed, points=64):
    return hs.random_surface((points, points), 64 / points, 0.3, 14.0, seed=seed, autocorrelation="gaussian")


def compared(surface, moves, parts):
    """Largest differences from the brute force over all moves: of T over μN, and of the traction map (L1) over μN."""
    brute = BruteForce(surface.heights, surface.size[0])
    solutions = NormalSolutions.of(surface, largest_approach=max(a for a, _ in moves))
    ensemble = hs.Ensemble.from_solutions(PAIR, solutions, MU)
    state, forces, maps = ensemble.initial_state(), [], []
    for (a, u), (p, q) in zip(moves, brute.history(moves, MU, parts), strict=True):
        state = ensemble.advance(state, normal_displacement=a, tangential_displacement=u)
        limit = MU * p.sum() * brute.cell
        traction = np.zeros(q.size)
        traction[solutions.point] = ensemble.superposition(state).tangential @ solutions.pressure
        forces.append((state.tangential_load - q.sum() * brute.cell) / limit)
        maps.append(np.abs(traction - q.ravel()).sum() * brute.cell / limit)
    return np.array(forces), np.array(maps)


def random_moves(rng, surface, count):
    reach = 0.55 * surface.heights.max()
    return [(reach * rng.uniform(0.25, 1.0), reach * rng.uniform(-0.12, 0.12)) for _ in range(count)]


def test_any_history_agrees_with_a_brute_force_of_all_points():
    surface = rough(1)
    moves = random_moves(np.random.default_rng(1), surface, 4)
    coarse, coarse_maps = compared(surface, moves, 6)
    fine, fine_maps = compared(surface, moves, 12)
    # the brute force walks in steps, whose error is halved with them
    assert np.abs(2 * fine - coarse).max() < 4e-3
    assert np.abs(fine).max() < 0.8 * np.abs(coarse).max()
    assert fine_maps.max() < 0.8 * coarse_maps.max()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_twenty_random_moves_agree_with_a_brute_force_of_all_points(seed):
    surface = rough(seed)
    moves = random_moves(np.random.default_rng(seed), surface, 20)
    (coarse, _), (fine, _) = compared(surface, moves, 24), compared(surface, moves, 48)
    settled = np.abs(2 * fine - coarse)
    assert np.median(settled) < 1e-3
    # where a handful of points touches, a load lies between the rows of the table
    assert settled.max() < 0.02


def test_a_lone_ball_is_hertz():
    surface = balls(0.0)
    solutions = NormalSolutions.of(surface, largest_approach=1.0)
    hertz = 4 / 3 * np.sqrt(400.0) * solutions.approach**1.5
    wide = solutions.area.sum(axis=1) > 200
    np.testing.assert_allclose(solutions.load.sum(axis=1)[wide], hertz[wide], rtol=8e-3)
    np.testing.assert_allclose(solutions.area.sum(axis=1)[wide], np.pi * 400 * solutions.approach[wide], rtol=0.08)
    assert solutions.count == 1
    assert np.abs(solutions.coarse).max() < 0.05
    assert np.abs(solutions.coarse).min() > 0
    ball = hs.Ensemble(PAIR, 0.0, 400.0, friction=MU)
    ensemble = hs.Ensemble.from_solutions(PAIR, solutions, MU)
    events = [hs.NormalLoad(0, 20.0), hs.TangentialLoad(1, 3.0), hs.TangentialLoad(2, -1.0), hs.NormalLoad(3, 10.0)]
    expected, given = hs.replay(ball, events), hs.replay(ensemble, events)
    np.testing.assert_allclose(given["tangential_displacement"], expected["tangential_displacement"], rtol=0.01)


@pytest.mark.slow
def test_two_balls_go_from_independent_to_merged_without_a_jump():
    lone = NormalSolutions.of(balls(0.0), largest_approach=1.0)
    loads, counts = [], []
    for distance in (60.0, 48.0, 36.0, 30.0, 24.0, 18.0, 12.0, 6.0, 0.0):
        solutions = NormalSolutions.of(balls(distance), largest_approach=1.0)
        at_one = np.interp(1.0, solutions.approach, solutions.load.sum(axis=1))
        loads.append(at_one / np.interp(1.0, lone.approach, lone.load.sum(axis=1)))
        counts.append(solutions.count)
    assert counts[0] == 2
    assert counts[-1] == 1
    assert loads == sorted(loads, reverse=True)
    assert 1.6 < loads[0] < 2.0
    assert loads[-1] == pytest.approx(1.0)
    assert np.abs(np.diff(loads)).max() < 0.3


def test_a_periodic_array_of_balls_becomes_an_ensemble_as_their_distance_grows():
    differences = []
    for side in (48.0, 96.0, 192.0):
        surface = balls(0.0, points=int(side), side=side, periodic=True)
        solutions = NormalSolutions.of(surface, largest_load=4 / 3 * np.sqrt(400.0) * 0.3**1.5)
        approach, load = solutions.approach[-1], solutions.load[-1].sum()
        differences.append(abs(approach / (0.75 * load / np.sqrt(400.0)) ** (2 / 3) - 1))
    assert differences[0] > 1.5 * differences[1] > 2 * differences[2]
    assert differences[2] < 0.1


def test_solutions_are_found_in_the_cache(monkeypatch):
    surface = rough(2, 32)
    first = NormalSolutions.of(surface, largest_load=4.0)

    def never(*_, **__):
        raise AssertionError("solved again")

    monkeypatch.setattr("historysim.interaction.solutions._solve", never)
    again = NormalSolutions.of(surface, largest_load=4.0)
    np.testing.assert_array_equal(first.pressure, again.pressure)
    with pytest.raises(AssertionError, match="solved again"):
        NormalSolutions.of(surface, largest_load=5.0)


def test_points_touch_so_that_the_area_grows_evenly():
    solutions = NormalSolutions.of(rough(3), largest_load=2.0)
    touched = (solutions.first_touch[None] <= solutions.approach[:, None]).sum(axis=1)
    np.testing.assert_array_equal(touched, (solutions.pressure > 0).sum(axis=1))


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        (hs.Surface(np.zeros((16, 16)), 1.0), "flat; expected heights that differ"),
        (hs.Surface(np.arange(16.0), 1.0), "profile; expected a height map"),
        (hs.Surface(np.where(np.eye(16) > 0, np.nan, np.arange(16.0)), 1.0), "16 heights are missing"),
        (hs.Surface(np.random.default_rng(1).normal(size=(4, 4)), 1.0), "touch more than a few points"),
    ],
)
def test_maps_that_cannot_be_solved_are_refused(surface, message):
    with pytest.raises(hs.InputError, match=message):
        NormalSolutions.of(surface, largest_load=1e-3)


def test_nothing_to_solve_is_refused():
    with pytest.raises(hs.InputError, match="nothing touches"):
        NormalSolutions.of(rough(1), largest_load=0.0)
