"""Two tangential directions, against a half-space point by point, one direction, each asperity alone, and tables.

Numbers are over those of a sphere with E* = R = θ = 1 at approach 1.
"""

import itertools
import pickle

import numpy as np
from golden import check_messages, refused
from numpy.testing import assert_allclose
from pairs import UNIT
from pytest import approx, mark, raises

import historysim as hs
from historysim.asperities.instrument import MOST_RINGS
from historysim.basics.library import ffi, lib
from historysim.errors import FrictionLimitError, InputError, LoadError  # noqa: F401 - of the messages
from historysim.memory.binding import DISPLACED, copy_state
from historysim.memory.binding import LOAD as LOAD_CONTROL
from historysim.memory.paths import Goals, blank_rows, straight_paths
from tests.support.planar_half_space import PlanarHalfSpace
from tests.support.planar_paths import TABLES, way

PAIR = hs.MaterialPair.from_moduli(contact_modulus=4e10, shear_modulus=1e10)
LOAD = 4 / 3 * PAIR.contact_modulus  # of a sphere of radius 1 m at an approach of 1 m


def sphere(friction=1.0, **rings):
    return hs.Ensemble(PAIR, 0.0, 1.0, friction, rings=hs.Rings(**rings))


def walked(ensemble, path, approach=1.0):
    """States along a path, with approaches at its points."""
    state, found = (
        ensemble.advance(
            ensemble.initial_state(), normal_displacement=float(np.ravel(approach)[0])
        ),
        [],
    )
    for u, d in zip(path, np.broadcast_to(approach, len(path)), strict=True):
        state = ensemble.advance(
            state, normal_displacement=float(d), tangential_displacement=tuple(u)
        )
        found.append(state)
    return found


def numbers(state):
    return np.array([*state.tangential_load, state.dissipated_energy]) / LOAD


@mark.parametrize("shape", TABLES)
def test_paths_of_the_tables(shape):
    """At the default rings, within 1e-3 of μN and 2e-3 of the energy."""
    parts, amplitude, approach = 48, 0.7, 1.0
    if "rising" in shape:
        amplitude = 0.35
    path = way(shape, amplitude, parts)
    if "rising" in shape:
        lengths = np.hypot(*np.diff(np.vstack([(0, 0), path]), axis=0).T)
        past = np.cumsum(lengths) - amplitude
        approach = 0.5 + 0.5 * np.maximum(past, 0) / past[-1]
    ends = np.array(
        [numbers(state) for state in walked(sphere(), path, approach)[parts - 1 :: parts]]
    )
    expected = np.array(TABLES[shape])
    assert np.abs(ends - expected)[:, :2].max() < 1e-3
    assert np.abs(ends - expected)[:, 2].max() < 2e-3 * expected[-1, 2]


def no_table(shape, parts):
    """Displacements along a path for which there is no table, in so many steps a side or a quarter."""
    turn = np.arange(1, 5 * parts + 1) / parts * np.pi / 2
    if shape == "spiral":
        return np.linspace(0, 1, 5 * parts + 1)[1:, None] * np.column_stack(
            [np.cos(turn), np.sin(turn)]
        )
    if shape == "eight":
        return 0.75 * np.column_stack([np.sin(0.8 * turn), np.sin(1.6 * turn)])
    corners = {
        "zigzag": [(0, 0), (0.9, 0.1), (0.2, 0.3), (0.8, 0.5), (0.1, 0.7), (0.7, 0.9)],
        "triangle": [(0, 0), (0.8, 0), (-0.4, 0.7), (-0.4, -0.7), (0.8, 0), (0, 0.2)],
    }[shape]
    share = np.arange(1, parts + 1)[:, None] / parts
    return np.vstack(
        [np.array(a) + share * np.subtract(b, a) for a, b in itertools.pairwise(corners)]
    )


APPROACH = {
    "constant": np.ones_like,
    "waving": lambda s: 0.8 + 0.2 * np.cos(5 * np.pi * s),
    "rising": lambda s: 0.3 + 0.7 * s,
    "falling": lambda s: 1 - 0.6 * s,
}


def compare_with_half_space(shape, normal, poisson_ratio, cells, parts):
    """Largest error of a component over the largest μN, and error of the energy over it."""
    path = no_table(shape, parts)
    approach = APPROACH[normal](np.linspace(0, 1, len(path)))
    oracle, errors = PlanarHalfSpace(cells, poisson_ratio).to((0.0, 0.0), approach[0]), []
    states = walked(sphere(), path, approach)
    for state, u, d in zip(states, path, approach, strict=True):
        oracle.to(u, d)
        errors.append(np.abs(numbers(state)[:2] - oracle.tangential_load * 0.75).max())
    return max(errors), numbers(states[-1])[2] / (0.75 * oracle.dissipated) - 1


@mark.slow
@mark.parametrize("poisson_ratio", [0.0, 0.3])
@mark.parametrize("normal", APPROACH)
@mark.parametrize("shape", ["spiral", "eight", "zigzag", "triangle"])
def test_against_a_half_space(shape, normal, poisson_ratio):
    load, energy = compare_with_half_space(shape, normal, poisson_ratio, 80, 24)
    assert load < 2e-3
    assert abs(energy) < 5e-3


def many(friction=0.3):
    random = np.random.default_rng(2)
    height, radius = -random.exponential(0.3, 12), random.uniform(0.5, 2, 12)
    return height - height.max(), radius, friction


def test_classes_come_to_each_asperity_alone():
    """Of twelve asperities: one class for all is within 2e-2 of μN, eight within 1e-3, each for itself within 3e-4."""
    height, radius, friction = many()
    path = 0.3 * way("circle", 0.7, 12)
    alone = 0.0
    for h, r in zip(height, radius, strict=True):
        if h > -1:
            one = hs.Ensemble(PAIR, 0.0, r, friction)
            alone = alone + np.array([numbers(state) for state in walked(one, path, 1 + h)])
    limit = friction * hs.Ensemble(PAIR, height, radius, friction).advance(
        hs.Ensemble(PAIR, height, radius, friction).initial_state(), normal_displacement=1.0
    ).normal_load / LOAD  # fmt: skip
    errors = []
    for classes in (1, 8, 1000):
        together = hs.Ensemble(
            PAIR, height, radius, friction, rings=hs.Rings(height_classes=classes)
        )
        found = np.array([numbers(state) for state in walked(together, path)])
        errors.append(np.abs(found - alone)[:, :2].max() / limit)
    assert (np.array(errors) < (2e-2, 1e-3, 3e-4)).all()


@mark.parametrize("angle", [0.0, np.pi / 2, 4.0])
def test_along_a_line_it_is_the_memory_of_one_direction(angle):
    random = np.random.default_rng(7)
    ensemble = hs.Ensemble(PAIR, *many())
    direction = np.array([np.cos(angle), np.sin(angle)]).round(15)
    plane = line = ensemble.advance(ensemble.initial_state(), normal_load=LOAD)
    for _ in range(60):
        normal, u = random.uniform(0.2, 1.5) * LOAD, random.normal() * 0.3
        line = ensemble.advance(line, normal_load=normal, tangential_displacement=u)
        plane = ensemble.advance(
            plane, normal_load=normal, tangential_displacement=tuple(u * direction)
        )
        along = line.tangential_load * direction
        assert plane.tangential_load == approx(along, rel=1e-12, abs=1e-12 * LOAD)
        assert plane.dissipated_energy == approx(line.dissipated_energy, rel=1e-12)
        if angle == 0.0:
            assert plane.tangential_load[0] == line.tangential_load
            assert plane.dissipated_energy == line.dissipated_energy
    assert not plane._turned


@mark.parametrize("share", [1e-20, 1e-14, 1e-7, 1e-4])
@mark.parametrize("rings", [10, 30])
def test_a_way_as_short_as_rounding_changes_as_little(rings, share):
    ensemble = sphere(rings=rings, height_classes=2)
    state = walked(ensemble, way("square", 0.7, 6))[20]
    for friction in (1.0, 1.3):
        state = ensemble.with_friction(state, friction)
        place = state.tangential_displacement
        after = ensemble.advance(
            state, tangential_displacement=tuple(place + share * np.array([0.6, -0.8]))
        )
        # no stiffer than all stuck, 8 G* a
        most = 2 * PAIR.contact_modulus * share + 1e-12 * LOAD
        assert np.hypot(*(after.tangential_load - state.tangential_load)) <= most
        assert 0 <= after.dissipated_energy - state.dissipated_energy <= LOAD * share + 1e-12 * LOAD


def random_walk(seed, count=40):
    random = np.random.default_rng(seed)
    return np.cumsum(random.normal(0, 0.15, (count, 2)), axis=0), random.uniform(0.3, 1.0, count)


def test_a_turned_path_turns_the_load():
    path, approach = random_walk(1)
    ensemble, angle = hs.Ensemble(PAIR, *many()), 1.234
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for one, other in zip(
        walked(ensemble, path, approach), walked(ensemble, path @ turn.T, approach), strict=True
    ):
        assert_allclose(other.tangential_load, turn @ one.tangential_load, atol=1e-12 * LOAD)
        assert other.dissipated_energy == approx(one.dissipated_energy, rel=1e-11)


def test_random_loads_within_the_limit_and_beyond():
    random, ensemble = np.random.default_rng(8), hs.Ensemble(PAIR, *many())
    state = ensemble.advance(ensemble.initial_state(), normal_load=LOAD)
    for _ in range(40):
        normal, angle = random.uniform(0.5, 2) * LOAD, random.uniform(0, 2 * np.pi)
        load = 0.3 * normal * random.uniform(0, 1.2) * np.array([np.cos(angle), np.sin(angle)])
        before = state
        if np.hypot(*load) > 0.3 * normal:
            with raises(FrictionLimitError):
                ensemble.advance(state, normal_load=normal, tangential_load=tuple(load))
        state = ensemble.advance(
            state, normal_load=normal, tangential_load=tuple(load), saturate=True
        )
        held = load * min(1.0, (1 - 1e-3) * 0.3 * normal / np.hypot(*load))
        assert_allclose(state.tangential_load, held, atol=2e-6 * LOAD)
        assert state.dissipated_energy >= before.dissipated_energy


def test_falls_of_friction_after_turns_against_a_half_space():
    falls = {11: 0.6, 20: 0.7}
    ensemble, oracle, friction = sphere(), PlanarHalfSpace(32), 1.0
    oracle.to((0.0, 0.0), 1.0)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    for k, u in enumerate(way("square", 0.6, 10)):
        state = ensemble.advance(state, tangential_displacement=tuple(u))
        oracle.to(u, 1.0)
        if k in falls:
            friction *= falls[k]
            state = ensemble.with_friction(state, friction)
            oracle.to_friction(friction)
            # a mesh of 1/32, where whole annuli slip simultaneously
            assert np.abs(numbers(state)[:2] - 0.75 * oracle.tangential_load).max() < 1e-3
        assert np.abs(numbers(state)[:2] - 0.75 * oracle.tangential_load).max() < 4e-3
    assert numbers(state)[2] == approx(0.75 * oracle.dissipated, rel=1e-2)


def test_stiffness_by_differences():
    ensemble = hs.Ensemble(PAIR, *many(), rings=hs.Rings(tolerance=1e-4))
    path, approach = random_walk(9, 12)
    state = walked(ensemble, path, approach)[-1]
    for direction in ((1.0, 0.0), (0.0, 1.0), (-0.6, 0.8)):
        step = 1e-6 * np.array(direction)
        after = ensemble.advance(
            state, tangential_displacement=tuple(state.tangential_displacement + step)
        )
        slope = (after.tangential_load - state.tangential_load) / 1e-6
        assert_allclose(state.stiffness(direction) @ direction, slope, rtol=0.02, atol=0.01 * LOAD)
    assert np.linalg.eigvalsh(state.stiffness((1.0, 0.0))).min() >= -1e-9 * LOAD


def one_event(start, end, approach, turn, **rings):
    """Energy dissipated in one event after a ramp, and the load at its end; a turn of 1e-9 brings in rings."""
    ensemble = sphere(**rings)
    state = ensemble.advance(
        ensemble.initial_state(), normal_displacement=1.0, tangential_displacement=(start, 0.0)
    )
    if turn:
        state = ensemble.advance(state, tangential_displacement=(start, 1e-9))
    before = state.dissipated_energy
    target = (end, 1e-9 if turn else 0.0)
    state = ensemble.advance(state, normal_displacement=approach, tangential_displacement=target)
    assert state._turned == turn
    return (state.dissipated_energy - before) / LOAD, state.tangential_load[0] / LOAD


@mark.parametrize("approach", [1.5, 1 + 1e-9, 1.0, 0.5, 0.001, 0.0, -0.1])
@mark.parametrize("end", [-0.5, 0.6, 2.0, 300.0])
@mark.parametrize("start", [0.6, 1.2])
def test_one_event_with_motion_against_one_direction(start, end, approach):
    """At the default rings, within 4e-3 of the energy or 2.5e-4 of μN times full slip."""
    expected, load = one_event(start, end, approach, turn=False)
    found, found_load = one_event(start, end, approach, turn=True)
    assert found == approx(expected, rel=4e-3, abs=2.5e-4)
    assert found_load == approx(load, abs=6e-4)


def test_asperities_share_what_is_dissipated_at_lift_off():
    ensemble = hs.Ensemble(PAIR, *many())
    path, approach = random_walk(4, 6)
    events = []
    for time, (u, d) in enumerate(zip(path, [*approach[:-1], -0.1], strict=True)):
        events += [hs.NormalDisplacement(time, d), hs.TangentialDisplacement(time, tuple(u))]
    history = hs.replay(ensemble, events, record="all")
    total, each = history.total_dissipated_energy.values, history.dissipated_energy.values
    assert_allclose(each.sum(axis=1), total, rtol=1e-3)
    assert (np.diff(each, axis=0) >= 0).all()


def test_without_friction_all_stored_energy_is_dissipated():
    ensemble = hs.Ensemble(PAIR, *many())
    path, approach = random_walk(2, 6)
    state = walked(ensemble, path, approach)[-1]
    free = ensemble.advance(state, friction=0.0)
    assert (free.tangential_load == 0).all()
    assert free.stored_energy == 0
    assert free.dissipated_energy - state.dissipated_energy == approx(state.stored_energy, rel=1e-9)
    assert (free.stiffness((1.0, 0.0)) == 0).all()
    moved = ensemble.advance(free, tangential_displacement=(0.5, -0.5), normal_displacement=0.2)
    assert (moved.tangential_load == 0).all()
    assert moved.dissipated_energy == free.dissipated_energy
    with raises(FrictionLimitError):
        ensemble.advance(free, tangential_load=(1.0, 1.0))
    # whatever is below all scales is next to nothing, and ends
    assert np.hypot(*ensemble.advance(state, friction=1e-300).tangential_load) < 1e-200


def test_a_state_keeps_to_ensembles_of_its_rings():
    state = walked(sphere(), way("square", 0.7, 1))[-1]
    for call in (
        lambda other: other.advance(state, normal_load=LOAD),
        lambda other: other.stepper(state),
        lambda other: other.with_friction(state, 0.5),
        lambda other: other.asperity(0, state),
        lambda other: other.stepper(walked(other, way("square", 0.7, 1))[-1]).restore(state),
    ):
        with refused(r"made with Rings\(.*rings=30.*expected .*rings=60"):
            call(sphere(rings=60))
    assert sphere().advance(state, normal_load=LOAD).rings == hs.Rings()


def test_a_path_with_a_target_in_y_enters_the_plane_in_the_library():
    ensemble = sphere(0.3)
    start = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    paths = straight_paths(
        Goals(LOAD_CONTROL, LOAD, 0.0), Goals(DISPLACED, [(0.1, 0.2)]), recorded=False
    )
    paths["normal_control"] = DISPLACED
    memory, path = copy_state(start.memory), ffi.cast("hs_path *", ffi.from_buffer(paths))
    driven = ensemble._make_drive(False, hs.Instrument())
    assert lib.hs_integrate(memory, path, 1, ffi.NULL, driven, 1.0, ffi.NULL, ffi.NULL) == lib.HS_OK
    assert hs.State(memory) == ensemble.advance(start, tangential_displacement=(0.1, 0.2))


def test_a_step_in_a_plane_moves_along_x_in_the_library():
    state = walked(sphere(), way("square", 0.7, 1))[-1]
    memory, driven = (
        copy_state(state.memory),
        sphere()._make_drive(False, hs.Instrument(), directions=2),
    )
    x, _ = state.tangential_displacement
    along_x = lib.HS_DISPLACED, float("nan"), lib.HS_DISPLACED
    assert lib.hs_step(memory, *along_x, x + 0.05, driven, ffi.NULL) == lib.HS_OK
    assert hs.State(memory) == sphere().advance(state, tangential_displacement=(x + 0.05, None))
    before = hs.State(copy_state(memory))
    assert (
        lib.hs_step(memory, *along_x[:2], lib.HS_LOAD, 10 * LOAD, driven, ffi.NULL)
        == lib.HS_BEYOND_LIMIT
    )
    assert hs.State(memory) == before
    assert np.isnan(lib.hs_stiffness(memory, 1))
    assert lib.hs_state_evolve(memory) == lib.HS_FOREIGN


def test_bytes_are_the_state():
    ensemble = hs.Ensemble(PAIR, *many())
    path, approach = random_walk(6, 12)
    state = walked(ensemble, path, approach)[-1]
    again = pickle.loads(pickle.dumps(state))
    assert again == state
    assert hash(again) == hash(state)
    further = [
        ensemble.advance(each, tangential_displacement=(0.0, 0.3)) for each in (state, again)
    ]
    assert further[0] == further[1]
    content, start = state.to_bytes(), hs.State.from_bytes(state.to_bytes())
    for at in range(0, len(content), 61):
        damaged = bytearray(content)
        damaged[at] ^= 0x10
        with raises(InputError):
            hs.State.from_bytes(bytes(damaged))
    with refused("cut off"):
        hs.State.from_bytes(content[:-8])
    other = hs.Ensemble(PAIR, 0.0, 2.0, 0.3)
    with refused(r"state is of|another contact"):
        hs.State.from_bytes(
            content, other.advance(other.initial_state(), tangential_displacement=(0.0, 0.0))
        )
    with refused("expected one of this ensemble's"):
        other.advance(start, normal_load=1.0)


def three_patches(friction=0.3):
    """Patches that touch one after the other; their curves bend where the next one touches."""
    approach = np.linspace(0, 1, 41)[1:]
    load = np.stack(
        [LOAD * np.maximum(approach - first, 0) ** 1.5 for first in (0.0, 0.2, 0.55)], axis=1
    )
    return hs.Patches.from_normal_curves(PAIR, approach, load, load / LOAD, friction)


def test_a_table_of_a_sphere_moves_as_the_sphere():
    """The table is not straight between two rows by 1e-4, and rings know no shape of the contact but it."""
    approach = np.linspace(0, 1, 200)[1:]
    table = hs.Patches.from_normal_curves(
        PAIR, approach, LOAD * approach**1.5 * (1 + 1e-6 * approach), None, 1.0
    )
    assert table.curves.weight is None
    path = way("square", 0.7, 12)
    depth = 0.8 + 0.2 * np.cos(np.arange(len(path)))
    found, expected = (
        np.array([numbers(each) for each in walked(one, path, depth)]) for one in (table, sphere())
    )
    assert np.abs(found - expected)[:, :2].max() < 5e-4
    assert np.abs(found - expected)[:, 2].max() < 2e-3 * expected[-1, 2]


def test_patches_share_the_load_of_their_rings():
    ensemble, random = three_patches(), np.random.default_rng(5)
    events = [hs.NormalDisplacement(0.0, 0.9), hs.TangentialDisplacement(0.0, (0.0, 0.0))]
    for time in range(1, 40):
        events.append(
            hs.NormalDisplacement(
                time, random.choice([0.9, random.uniform(0.1, 1), -0.1], p=[0.6, 0.3, 0.1])
            )
        )
        events.append(hs.TangentialDisplacement(time, tuple(0.2 * random.normal(size=2))))
    history = hs.replay(ensemble, events, record="all")
    limit = 0.3 * history.normal_load.values
    total = history.total_tangential_load.values
    assert_allclose(history.tangential_load.values.sum(axis=1), total, atol=1e-9 * limit.max())
    # a component is held within the limit of its patch
    assert (np.abs(history.tangential_load.values) <= limit[..., None] * (1 + 1e-9)).all()
    assert (np.hypot(*total.T) <= limit.sum(axis=1) * (1 + 1e-6)).all()
    assert np.diff(history.total_dissipated_energy).min() >= 0
    job = hs.Replay(ensemble, events)
    state = job.state()
    assert ensemble.advance(hs.State.from_bytes(state.to_bytes())) == ensemble.advance(state)


def test_the_most_rings_agree_with_the_library():
    assert lib.HS_MOST_RINGS == MOST_RINGS


@mark.parametrize("along", [0, 1])
@mark.parametrize("soft", [0.0, 1.0])
def test_one_component_by_load_and_the_other_by_displacement_against_both_by_load(along, soft):
    """In small steps, with the loads and displacements that are found fed back as the other kind of control."""
    ensemble = sphere(0.3, rings=30, height_classes=1, tolerance=1e-4)
    start = ensemble.enter_plane(
        ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    )
    limit, slip = 0.3 * LOAD, 0.3 * PAIR.displacement_ratio
    spring = {"instrument": hs.Instrument(limit / slip / soft)} if soft else {}
    yields = soft * slip / limit
    random, mixed, by_load, by_displacement = np.random.default_rng(4), start, start, start
    ends = np.cumsum(random.uniform(-0.12, 0.12, (40, 2)), axis=0).clip(-0.6, 0.6)
    for x, y in ends:
        driven, load = x * slip * (1 + soft), y * limit
        pair = (lambda a, b: (a, b)) if along == 0 else (lambda a, b: (b, a))
        before = mixed
        mixed = ensemble.advance(
            mixed,
            tangential_displacement=pair(driven, None),
            tangential_load=pair(None, load),
            **spring,
        )
        reached = mixed.tangential_displacement + yields * mixed.tangential_load
        assert reached[along] == approx(driven, abs=1e-9 * slip)
        assert mixed.tangential_load[1 - along] == approx(load, abs=1e-9 * limit)
        by_load = ensemble.advance(by_load, tangential_load=tuple(mixed.tangential_load), **spring)
        by_displacement = ensemble.advance(
            by_displacement, tangential_displacement=tuple(reached), **spring
        )
        for other in (by_load, by_displacement):
            assert_allclose(other.tangential_load, mixed.tangential_load, atol=2e-3 * limit)
            assert_allclose(
                other.tangential_displacement, mixed.tangential_displacement, atol=1e-2 * slip
            )
        # never gains energy
        assert mixed.dissipated_energy >= before.dissipated_energy
    assert by_displacement.dissipated_energy == approx(mixed.dissipated_energy, rel=1e-2)


@mark.parametrize("way", [2.0, 30.0, 1e4])
def test_a_driven_contact_creeps_under_a_dead_weight_and_dissipates_the_work(way):
    """In steady sliding T is the friction limit along the motion: dUy/dUx = W/√(μ²N² - W²)."""
    ensemble = sphere(0.3)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    limit, slip, weight = 0.3 * LOAD, 0.3 * PAIR.displacement_ratio, 0.3
    state = ensemble.advance(
        state, tangential_displacement=(0.0, None), tangential_load=(None, weight * limit)
    )
    assert not state._turned
    state = ensemble.advance(state, tangential_displacement=(10 * slip, None))
    after = ensemble.advance(state, tangential_displacement=((10 + way) * slip, None))
    steady = np.sqrt(1 - weight**2)
    assert_allclose(after.tangential_load, np.array([steady, weight]) * limit, rtol=1e-5)
    moved = after.tangential_displacement - state.tangential_displacement
    assert moved[1] / moved[0] == approx(weight / steady, rel=1e-3)
    assert after.dissipated_energy - state.dissipated_energy == approx(
        moved @ after.tangential_load, rel=1e-4
    )


def test_a_component_without_load_is_free_and_one_without_displacement_is_held():
    ensemble = sphere(0.3)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    limit, slip = 0.3 * LOAD, 0.3 * PAIR.displacement_ratio
    one = ensemble.advance(state, tangential_displacement=0.5 * slip)
    free = ensemble.advance(
        state, tangential_displacement=(0.5 * slip, None), tangential_load=(None, 0.0)
    )
    held = ensemble.advance(state, tangential_displacement=(0.5 * slip, 0.0))
    # both go along the line of one direction
    for other in (free, held):
        assert not other._turned
        assert other.tangential_load[0] == one.tangential_load
    # after a load in y has strained it, a free component follows, a held one keeps its displacement
    state = ensemble.advance(state, tangential_load=(0.0, 0.5 * limit))
    free = ensemble.advance(
        state, tangential_displacement=(slip, None), tangential_load=(None, 0.0)
    )
    held = ensemble.advance(state, tangential_displacement=(slip, state.tangential_displacement[1]))
    assert abs(free.tangential_load[1]) < 1e-9 * limit
    assert held.tangential_displacement[1] == state.tangential_displacement[1]
    assert held.tangential_load[1] > 0.05 * limit
    # a component that is not named stays as it was controlled last
    on = ensemble.advance(free, tangential_displacement=(-slip, None))
    assert abs(on.tangential_load[1]) < 1e-9 * limit
    assert type(on).from_bytes(on.to_bytes()).tangential_control == on.tangential_control == (1, 0)


@mark.parametrize("compliance", [1.0, 1e3, 1e6])
def test_the_drive_arrives_however_soft_the_instrument(compliance):
    """Friction that falls lets the contact go by what the spring gives way, many times as far as springs reach."""
    ensemble = sphere(0.3)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    limit, slip = 0.3 * LOAD, 0.3 * PAIR.displacement_ratio
    soft = hs.Instrument(limit / slip / compliance)
    drive = np.array([1.2, 0.5]) * slip * (compliance + 2)
    state = ensemble.advance(state, tangential_displacement=(slip, 0.0), instrument=soft)
    state = ensemble.advance(state, tangential_displacement=tuple(drive), instrument=soft)
    for each in (state, ensemble.with_friction(state, 0.03, instrument=soft)):
        reached = each.tangential_displacement + compliance * slip / limit * each.tangential_load
        assert_allclose(reached, drive, rtol=1e-9)


@mark.parametrize("friction", [0.4, np.linspace(0.3, 0.5, 12)])
def test_a_leg_on_which_nothing_can_slip_is_exact(friction):
    """Where |ΔV| ≤ μ Δd, ΔT = ΔV ΔN/Δd, whatever has slipped before, and nothing is dissipated."""
    ensemble = hs.Ensemble(UNIT, -np.linspace(0.0, 0.3, 12), 1.0, friction)
    state = ensemble.initial_state()
    for turn in ((0.03, 0.0), (0.02, 0.04)):
        state = ensemble.advance(state, normal_displacement=0.25, tangential_displacement=turn)
    after = ensemble.advance(state, normal_displacement=0.35, tangential_displacement=(0.03, 0.06))
    rise = after.normal_load - state.normal_load
    change = np.subtract(after.tangential_load, state.tangential_load)
    assert_allclose(change, np.array([0.01, 0.02]) / 0.1 * rise, rtol=1e-13)
    assert after.dissipated_energy == state.dissipated_energy
    # the same leg by its loads
    by_load = ensemble.advance(
        state, normal_load=after.normal_load, tangential_load=tuple(after.tangential_load)
    )
    assert_allclose(by_load.tangential_displacement, (0.03, 0.06), rtol=1e-12)
    assert by_load.dissipated_energy == state.dissipated_energy
    # a stepper, which sticks in place
    stepper = ensemble.stepper()
    for reached in (after, by_load):
        stepper.restore(state)
        if reached is after:
            stepper.step(normal_displacement=0.35, tangential_displacement=(0.03, 0.06))
        else:
            stepper.step(
                normal_load=after.normal_load, tangential_load=tuple(after.tangential_load)
            )
        assert stepper.save() == reached
    # and in a hundred parts, which remember the same
    parts = state
    for k in range(1, 101):
        moved = (0.02 + 0.01 * k / 100, 0.04 + 0.02 * k / 100)
        parts = ensemble.advance(
            parts, normal_displacement=0.25 + 0.1 * k / 100, tangential_displacement=moved
        )
    limit = np.mean(friction) * after.normal_load
    assert_allclose(parts.tangential_load, after.tangential_load, rtol=0.0, atol=1e-12 * limit)
    one, many = (
        ensemble.advance(each, tangential_displacement=(-0.05, 0.02)) for each in (after, parts)
    )
    assert_allclose(one.tangential_load, many.tangential_load, rtol=0.0, atol=1e-9 * limit)
    assert one.dissipated_energy == approx(many.dissipated_energy, rel=1e-9)


# of a sphere of friction 0.3 at an approach of 1 m
LIMIT, SLIP = 0.3 * LOAD, 0.3 * PAIR.displacement_ratio
START = ((0.6, 0.0), (0.6, 0.5))  # turns over the friction limit
# (normal, tangential) at the end of a path, over load or approach, and limit or full slip; N, D:
# controls; None: held
PATHS_FROM_A_TURN = {
    "loads": ("N", 1.4, "NN", (-0.2, 0.4)),
    "displacements": ("D", 0.4, "DD", (-0.5, 1.2)),
    "N by load while U moves": ("N", 0.3, "DD", (-0.9, 0.1)),
    "N by load, one component driven": ("N", 0.6, "DN", (1.5, 0.2)),
    "approach, T by load": ("D", 0.8, "NN", (0.1, 0.5)),
    "T beyond the limit": ("N", 1.0, "NN", (0.0, 2.0)),
    "T turns at the limit while N rises": ("N", 1.6, "NN", (-2.0, 1.0)),
    "N falls under a held T": ("N", 0.5, "NN", (None, None)),
    "N falls, one component driven, the other one beyond": ("N", 0.5, "DN", (1.5, 1.5)),
    "lift-off under a held T": ("D", -0.3, "NN", (None, None)),
    "lift-off while U moves": ("N", 0.0, "DD", (0.1, 0.6)),
}


def start_from_a_turn(ensemble, turns=START):
    state = ensemble.advance(ensemble.initial_state(), normal_load=LOAD)
    for x, y in turns:
        state = ensemble.advance(state, tangential_load=(x * LIMIT, y * LIMIT))
    return state


def path_of(kind, parts):
    normal, level, controls, targets = PATHS_FROM_A_TURN[kind]
    kinds = tuple(DISPLACED if control == "D" else LOAD_CONTROL for control in controls)
    units = [SLIP if control == "D" else LIMIT for control in controls]
    values = [
        0.0 if target is None else target * unit
        for target, unit in zip(targets, units, strict=True)
    ]
    moves = np.array([target is not None for target in targets], dtype=float)
    normal_goal = Goals(DISPLACED, level) if normal == "D" else Goals(LOAD_CONTROL, level * LOAD)
    return straight_paths(
        normal_goal, Goals([kinds], [values], [moves]), parts=parts, times=(0.0, 1.0)
    )


@mark.parametrize("soft", [False, True])
@mark.parametrize("kind", PATHS_FROM_A_TURN)
def test_rows_are_read_along_a_path_and_do_not_change_its_end(kind, soft):
    """The end has the same bits with any rows, and a row those of the path that ends there."""
    ensemble = sphere(0.3)
    instrument = hs.Instrument((LIMIT / SLIP, 2 * LIMIT / SLIP)) if soft else hs.Instrument()
    options = {"saturate": True, "instrument": instrument}
    start = start_from_a_turn(ensemble)
    end = ensemble.advance_along(start, path_of(kind, 1), **options)
    found = {}
    for parts in (2, 7, 100):
        rows = blank_rows(parts, 1, planar=True)
        after = ensemble.advance_along(
            start, path_of(kind, parts), rows=rows, asperities=[0], **options
        )
        assert after.to_bytes() == end.to_bytes()
        found[parts] = rows
    assert (found[7].totals[-1] == found[100].totals[-1]).all()
    for k in (1, 3, 6):
        at = ensemble.advance_along(start, path_of(kind, 1), until=k / 7, **options)
        row = found[7].totals[k - 1]
        assert (row["normal_load"], row["approach"]) == (at.normal_load, at.approach)
        assert (found[7].vectors["tangential_load"][k - 1] == at.tangential_load).all()
        assert row["dissipated_energy"] == at.dissipated_energy
        assert row["saturated"] == (at.tangential_request != at.tangential_load).any()


@mark.parametrize("kind", ["T beyond the limit", "N falls under a held T"])
def test_beyond_the_limit_an_event_in_several_calls_is_one(kind):
    ensemble = sphere(0.3)
    start = start_from_a_turn(ensemble)
    one = ensemble.advance_along(start, path_of(kind, 1), saturate=True)
    _, level, _, targets = PATHS_FROM_A_TURN[kind]
    begin = start.tangential_load
    end = begin if targets[0] is None else np.array(targets) * LIMIT
    for calls in (2, 7, 100):
        state = start
        for k in range(1, calls + 1):
            load = tuple(float(value) for value in begin + k / calls * (end - begin))
            normal = LOAD * (1 + k / calls * (level - 1))
            state = ensemble.advance(state, normal_load=normal, tangential_load=load, saturate=True)
        assert_allclose(state.tangential_load, one.tangential_load, atol=2e-3 * LIMIT)
        assert_allclose(
            state.tangential_displacement, one.tangential_displacement, atol=5e-3 * SLIP
        )
        assert state.dissipated_energy == approx(one.dissipated_energy, rel=1e-2)


def fall_in_steps(ensemble, state, friction, count, **options):
    for coefficient in np.linspace(state.friction[0], friction, count + 1)[1:]:
        state = ensemble.with_friction(state, coefficient, **options)
    return state


@mark.parametrize("share", [0.8, 0.5, 0.2, 0.0])
@mark.parametrize("control", ["displacement", "load", "drive", "one component"])
def test_a_fall_of_friction_after_turns_is_many_small_falls(control, share):
    ensemble, options = sphere(0.3), {}
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0)
    path = [(0.6, 0.0), (0.6, 0.5), (0.2, 0.5)]
    if control == "drive":
        options["instrument"] = hs.Instrument((LIMIT / SLIP, 3 * LIMIT / SLIP))
    for x, y in path:
        if control == "load":
            state = ensemble.advance(state, tangential_load=(x * LIMIT, y * LIMIT))
        elif control == "one component":
            aim = {
                "tangential_displacement": (x * SLIP, None),
                "tangential_load": (None, y * LIMIT),
            }
            state = ensemble.advance(state, **aim)
        else:
            state = ensemble.advance(state, tangential_displacement=(x * SLIP, y * SLIP), **options)
    once = ensemble.with_friction(state, 0.3 * share, **options)
    many = fall_in_steps(ensemble, state, 0.3 * share, 50, **options)
    # a load beyond the new limit keeps its direction within the root of the tolerance
    assert_allclose(once.tangential_load, many.tangential_load, atol=2e-3 * LIMIT)
    assert_allclose(once.tangential_displacement, many.tangential_displacement, atol=5e-3 * SLIP)
    assert once.dissipated_energy == approx(many.dissipated_energy, rel=5e-3)
    if control == "displacement" and share == 0.5:
        # annuli of an independent discretisation, 256 falls
        assert_allclose(once.tangential_load, np.array([0.1166, 0.4690]) * LIMIT, atol=5e-4 * LIMIT)


@mark.parametrize("parallel", [0.0, 1e5])
def test_a_stepper_with_a_stiffness_in_x_and_in_y_begins_in_the_plane(parallel):
    ensemble = sphere(0.3)
    instrument = hs.Instrument((LIMIT / SLIP, 2 * LIMIT / SLIP), parallel_stiffness=parallel)
    stepper = ensemble.stepper(instrument=instrument)
    state = ensemble.enter_plane(ensemble.initial_state())
    moves = [
        {"normal_load": LOAD},
        {"tangential_displacement": (SLIP, 0.0)},
        {"tangential_load": (0.1 * LIMIT, 0.3 * LIMIT)},
    ]
    for move in moves:
        stepper.step(**move)
        state = ensemble.advance(state, **move, instrument=instrument)
        assert stepper.save() == state
    stepper.restore(ensemble.initial_state())
    assert stepper.save() == ensemble.enter_plane(ensemble.initial_state())


def test_messages():
    check_messages(globals())
