import subprocess
import sys

import numpy as np
import pytest
from dense_contact import DenseContact
from golden import check_messages
from half_space import HalfSpace as BruteForce
from numpy.testing import assert_allclose, assert_array_equal
from pairs import UNIT as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.interaction.half_space import HalfSpace
from historysim.interaction.solutions import NormalSolutions, label_patches

# ν = 0: θ = 1
MU = 0.2


@fixture(autouse=True)
def nothing_is_left_behind(monkeypatch, tmp_path):
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path / "cache"))


def alone(seed):
    """A rough map alone on its half-space, and moves in (approach, U): deep loops, light loads, lift-off."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(24, 40))
    kind = ["gaussian", "exponential"][seed % 2]
    heights = hs.random_surface(
        (count, count), 48 / count, 0.3, rng.uniform(8, 20), seed=seed, autocorrelation=kind
    ).heights
    reach = rng.uniform(0.3, 0.7) * heights.max()
    moves = []
    for _ in range(8):
        approach = reach * rng.choice(
            [rng.uniform(0.3, 1), rng.uniform(0.02, 0.2), -0.1], p=[0.7, 0.25, 0.05]
        )
        loop = 4 if rng.random() < 0.5 else 1
        moves += [(approach, MU * reach * rng.uniform(-0.8, 0.8)) for _ in range(loop)]
    return hs.Surface(heights, 48 / count), moves


def judged(seed, parts):
    """Errors of each move against the brute force: of T over μN, of tractions (L1), of the energy over the last."""
    surface, moves = alone(seed)
    largest = max(approach for approach, _ in moves)
    brute = DenseContact(surface.heights, surface.pixel_size[0], largest)
    walked = zip(*(brute.history(moves, MU, count) for count in (parts, 2 * parts)), strict=True)
    solutions = NormalSolutions.solve(surface, largest_approach=largest)
    ensemble = hs.Ensemble.from_solutions(PAIR, solutions, MU)
    state, found = ensemble.initial_state(), []
    for (approach, displacement), ((_, q1, e1), (p, q2, e2)) in zip(moves, walked, strict=True):
        state = ensemble.advance(
            state, normal_displacement=approach, tangential_displacement=displacement
        )
        # the error of the brute force is halved with its steps
        q, energy, limit = 2 * q2 - q1, 2 * e2 - e1, MU * p.sum() * brute.cell
        superposition, maps = ensemble.superposition(state), np.zeros((2, surface.heights.size))
        for each, weights in zip(
            maps, (superposition.normal, superposition.tangential), strict=True
        ):
            each[solutions.point] = weights @ solutions.pressure
        assert (np.abs(maps[1]) <= MU * maps[0] * (1 + 1e-9) + 1e-15).all()
        if limit == 0:
            assert state.normal_load == 0
            continue
        off = (
            np.abs(maps[1][brute.point] - q).sum() * brute.cell / limit
            if (p > 0).sum() >= 10
            else 0.0
        )
        force = abs(state.tangential_load - q.sum() * brute.cell) / limit
        load = abs(state.normal_load - p.sum() * brute.cell) * ensemble.curves.load[-1].sum() ** -1
        found.append([force, off, abs(state.dissipated_energy - energy), load])
    found = np.array(found)
    found[:, 2] /= energy
    assert found[:, 3].max() <= ensemble.curves.error()
    return found


def balls(distance, *, points=96, side=96.0, radius=400.0, periodic=False):
    """Two balls of one height, their centres at a distance along x."""
    x = (np.arange(points) + 0.5) * side / points - side / 2
    first, second = ((x + sign * distance / 2) ** 2 / (2 * radius) for sign in (-1, 1))
    heights = -np.minimum(first, second)[:, None] - x**2 / (2 * radius)
    return hs.Surface(heights, side / points, periodic=periodic)


@fixture(scope="module")
def lone(tmp_path_factory):
    """One ball, pressed to an approach of 1."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HISTORYSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        return NormalSolutions.solve(balls(0.0), largest_approach=1.0)


def rough(seed, points=64):
    return hs.random_surface(
        (points, points), 64 / points, 0.3, 14.0, seed=seed, autocorrelation="gaussian"
    )


def compared(surface, moves, parts):
    """Largest differences from the brute force over all moves: of T over μN, and of the traction map (L1) over μN."""
    brute = BruteForce(surface.heights, surface.size[0])
    solutions = NormalSolutions.solve(surface, largest_approach=max(a for a, _ in moves))
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
    return [
        (reach * rng.uniform(0.25, 1.0), reach * rng.uniform(-0.12, 0.12)) for _ in range(count)
    ]


def test_the_second_of_deep_loops_that_was_wrong_is_right():
    surface = hs.random_surface((40, 40), 1.6, 0.3, 14.0, seed=1, autocorrelation="gaussian")
    reach = 0.5 * surface.heights.max()
    solutions = NormalSolutions.solve(
        hs.Surface(surface.heights, 1.6), largest_approach=0.8 * reach
    )
    ensemble = hs.Ensemble.from_solutions(PAIR, solutions, MU)
    state, found = ensemble.initial_state(), []
    for share in (0.7, -0.5, 0.4, -0.2, 0.1, -0.2, 0.5):
        state = ensemble.advance(
            state, normal_displacement=0.8 * reach, tangential_displacement=share * MU * reach
        )
        found.append(state.tangential_load / (MU * state.normal_load))
    # a brute force of all points in small steps
    expected = [0.87495, -0.92535, 0.66098, -0.49696, 0.12741, -0.49696, 0.78102]
    assert_allclose(found, expected, atol=4e-4)


@mark.parametrize("seed", [3, pytest.param(8, marks=mark.slow)])
def test_deep_loops_light_loads_and_lift_off_agree_with_a_dense_brute_force(seed):
    found = judged(seed, 24)
    assert found[:, 0].max() < 5e-3
    assert np.median(found[:, 0]) < 1e-3
    assert found[:, 1].max() < 0.03
    assert found[:, 2].max() < 1e-2


@mark.slow
def test_twenty_maps_agree_with_a_dense_brute_force():
    found = np.concatenate([judged(seed, 96) for seed in range(20)])
    assert found[:, 0].max() < 5e-3
    assert np.median(found[:, 0]) < 1e-3
    assert found[:, 1].max() < 0.03
    assert found[:, 2].max() < 1e-2


def test_a_lone_ball_has_the_pressures_and_tractions_of_cattaneo(lone):
    ensemble = hs.Ensemble.from_solutions(PAIR, lone, MU)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    state = ensemble.advance(state, tangential_displacement=0.5 * MU)
    back = ensemble.advance(state, tangential_displacement=0.1 * MU)
    x, y = (index - 47.5 for index in np.unravel_index(lone.point, lone.shape))
    # a pressed disc of label h reaches to √(R h); a front recedes by U/μ, and by half of it after a
    # reversal
    rings = {
        at: np.sqrt(np.clip(400.0 * at - x**2 - y**2, 0, None)) * 2 / (np.pi * 400.0)
        for at in (1.0, 0.5, 0.8)
    }
    for reached, expected in (
        (ensemble.superposition(state).normal, rings[1.0]),
        (ensemble.superposition(state).tangential, MU * (rings[1.0] - rings[0.5])),
        (ensemble.superposition(back).tangential, MU * (-rings[1.0] + 2 * rings[0.8] - rings[0.5])),
    ):
        off = np.abs(reached @ lone.pressure - expected).sum() / np.abs(expected).sum()
        # the edge is between points that are 1/20 of the radius apart
        assert off < 0.05


def test_the_first_row_is_one_point_as_a_flat_punch():
    surface = rough(1, 32)
    alone = hs.Surface(surface.heights, surface.pixel_size)
    solutions = NormalSolutions.solve(alone, largest_approach=0.3)
    assert (solutions.pressure[0] > 0).sum() == 1
    # Love: the middle of a square of side s under a unit pressure moves by 8 s ln(1 + √2)/(2 π E*)
    per_pressure = 4 / np.pi * np.log(1 + np.sqrt(2)) * surface.pixel_size[0]
    assert_allclose(solutions.pressure[0].max(), solutions.approach[0] / per_pressure, rtol=1e-9)
    assert (np.diff(solutions.pressure, axis=0) > -1e-9).all()


def test_few_points_and_conjugate_gradients_give_the_same(monkeypatch, tmp_path):
    from historysim.interaction import half_space

    surface = rough(2, 48)
    exact = NormalSolutions.solve(surface, largest_approach=0.3)
    monkeypatch.setattr(half_space, "MOST_POINTS", 8)
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path / "another"))
    iterated = NormalSolutions.solve(surface, largest_approach=0.3)
    assert np.isnan(iterated.stiffness).sum() > 5 > np.isnan(exact.stiffness).sum()
    curves = [hs.Ensemble.from_solutions(PAIR, each, MU).curves for each in (exact, iterated)]
    between = np.linspace(0.02, 0.3, 50)
    assert_allclose(curves[0].total(between), curves[1].total(between), rtol=2e-3)


@mark.parametrize("periodic", [True, False])
def test_conjugate_gradients_give_what_tamaas_does(periodic):
    tamaas = pytest.importorskip("tamaas")
    repeating = rough(2, 48)
    surface = hs.Surface(repeating.heights, repeating.pixel_size, periodic)
    space = HalfSpace(surface)
    sides = [side / space.unit for side in surface.size]
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, sides, list(surface.shape))
    model.E, model.nu = 1.0, 0.0
    kind = tamaas.PolonskyKeerRey
    solver = kind(model, space.heights, 1e-9, kind.pressure, kind.pressure)
    if not periodic:
        tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
        solver.setIntegralOperator("dcfft")
    for load in (1e-3, 3e-3, 1e-2):
        solver.solve(load)
        _, pressure = space.solve(load)
        # the mean gap under the pressures is 1e-7 of the rms height
        assert np.abs(pressure - model.traction).sum() < 1e-5 * pressure.sum()
        assert_array_equal(pressure > 0, np.asarray(model.traction) > 0)


def test_a_contact_of_few_points_has_a_notice(lone):
    rough_points = hs.Surface(np.random.default_rng(1).normal(size=(8, 8)), 1.0)
    solutions = NormalSolutions.solve(rough_points, largest_load=1e-2)
    (notice,) = solutions.notices
    assert "areas, patches and pressures are those of the grid" in notice
    assert lone.notices == ()


def test_time_and_memory_are_announced_and_too_much_is_refused(monkeypatch):
    from historysim.interaction import half_space, solutions

    monkeypatch.setattr(half_space, "MOST_POINTS", 8)
    notices = []
    for name, approach in (("LONG", 0.3), ("MUCH", 0.25)):
        monkeypatch.setattr(solutions, name, 0.0)
        NormalSolutions.solve(rough(3, 32), largest_approach=approach, notify=notices.append)
    assert "the normal contact of 32 × 32 points takes some 0 min for" in notices[0]
    assert "takes some 0 min and 0.1 GiB of memory for" in notices[1]
    monkeypatch.setitem(solutions.POINT_BYTES, True, 1e15)
    with raises(
        hs.InputError,
        match=r"32 × 32 points takes some .* GiB of memory, and this machine has .* GiB",
    ):
        NormalSolutions.solve(rough(3, 32), largest_approach=0.2)


PEAK = """
import resource
import historysim as hs
from historysim.interaction import solutions
surface = hs.random_surface((512, 512), 0.5e-6, 24e-9, 20e-6, seed=1, autocorrelation="gaussian")
if not {periodic}:
    surface = hs.Surface(surface.heights, surface.pixel_size)
solutions.NormalSolutions.solve(surface, largest_load={load})
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024, solutions._held(surface))
"""


@mark.slow
@mark.skipif(sys.platform != "linux", reason="memory is counted in other units")
@mark.parametrize("periodic, load", [(True, 2e-13), (False, 6e-14)])
def test_the_memory_that_is_announced_is_what_it_takes(periodic, load):
    program = PEAK.format(periodic=periodic, load=load)
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    peak, held = map(float, ran.stdout.split())
    assert 0.75 * held < peak < 1.15 * held


@mark.slow
@mark.parametrize("seed", [1, 2, 3])
def test_twenty_random_moves_agree_with_a_brute_force_of_all_points(seed):
    surface = rough(seed)
    moves = random_moves(np.random.default_rng(seed), surface, 20)
    (coarse, _), (fine, _) = compared(surface, moves, 24), compared(surface, moves, 48)
    settled = np.abs(2 * fine - coarse)
    assert np.median(settled) < 1e-3
    assert settled.max() < 5e-3


@mark.slow
def test_two_balls_go_from_independent_to_merged_without_a_jump(lone):
    loads, counts = [], []
    for distance in (60.0, 48.0, 36.0, 30.0, 24.0, 18.0, 12.0, 6.0, 0.0):
        solutions = NormalSolutions.solve(balls(distance), largest_approach=1.0)
        at_one = np.interp(1.0, solutions.approach, solutions.load.sum(axis=1))
        loads.append(at_one / np.interp(1.0, lone.approach, lone.load.sum(axis=1)))
        counts.append(solutions.count)
    assert counts[0] == 2
    assert counts[-1] == 1
    assert loads == sorted(loads, reverse=True)
    assert 1.6 < loads[0] < 2.0
    assert loads[-1] == pytest.approx(1.0)
    assert np.abs(np.diff(loads)).max() < 0.3


@mark.slow
@mark.parametrize("sides", [(48.0, 96.0), (96.0, 192.0)])
def test_a_periodic_array_of_balls_becomes_an_ensemble_as_their_distance_grows(sides):
    differences = []
    for side in sides:
        surface = balls(0.0, points=int(side), side=side, periodic=True)
        solutions = NormalSolutions.solve(surface, largest_load=4 / 3 * np.sqrt(400.0) * 0.3**1.5)
        approach, load = solutions.approach[-1], solutions.load[-1].sum()
        differences.append(abs(approach / (0.75 * load / np.sqrt(400.0)) ** (2 / 3) - 1))
    assert differences[0] > 1.3 * differences[1]
    assert differences[1] < (0.1 if sides[1] > 100 else 0.2)


def test_solutions_are_found_in_the_cache(monkeypatch):
    surface = rough(2, 32)
    first = NormalSolutions.solve(surface, largest_load=4.0)

    def never(*_, **__):
        raise AssertionError("solved again")

    monkeypatch.setattr("historysim.interaction.solutions._solve", never)
    again = NormalSolutions.solve(surface, largest_load=4.0)
    assert_array_equal(first.pressure, again.pressure)
    with raises(AssertionError, match="solved again"):
        NormalSolutions.solve(surface, largest_load=5.0)


def test_points_touch_so_that_the_area_grows_evenly():
    solutions = NormalSolutions.solve(rough(3), largest_load=2.0)
    touched = (solutions.first_touch[None] <= solutions.approach[:, None]).sum(axis=1)
    assert_array_equal(touched, (solutions.pressure > 0).sum(axis=1))


CONTACT = np.array(
    [
        [1, 0, 0, 0, 1],
        [0, 0, 1, 0, 0],
        [0, 0, 1, 0, 0],
        [0, 1, 0, 0, 0],
        [1, 0, 0, 0, 1],
    ],
    dtype=bool,
)


def test_points_that_meet_at_a_side_or_a_corner_are_one_patch_the_largest_first():
    found = label_patches(CONTACT)
    assert (found >= 0).tolist() == CONTACT.tolist()
    assert found[1, 2] == found[2, 2] == found[3, 1] == found[4, 0] == 0
    assert sorted({found[0, 0], found[0, 4], found[4, 4]}) == [1, 2, 3]


def test_patches_across_a_corner_of_a_surface_that_repeats_meet():
    corners = np.zeros((5, 5), dtype=bool)
    corners[0, 0] = corners[4, 4] = True
    assert label_patches(corners, periodic=True).max() == 0
    assert label_patches(corners).max() == 1


def test_messages():
    check_messages(globals())
