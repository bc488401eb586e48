"""Asperities that meet on slopes, against springs on turned axes, closed forms, and the work of the loads."""

import math
import pickle
import struct

import numpy as np
from golden import check_messages, refused
from numpy.testing import assert_allclose, assert_array_equal
from pairs import GLASS as PAIR
from pytest import approx, mark, param, raises
from scipy.integrate import quad

import historysim as hs
from historysim.asperities.inclined import InclinedState

RADIUS, FRICTION, SLOPE, LOAD = 1e-3, 0.2, 0.1, 10e-3
REACH = 200e-9


def sphere(slope=SLOPE):
    return hs.InclinedEnsemble(PAIR, 0.0, RADIUS, FRICTION, slope=slope)


def rough(count, seed, friction=0.25):
    random = np.random.default_rng(seed)
    heights, radii = -random.uniform(0, 40e-9, count), random.uniform(5e-6, 20e-6, count)
    return hs.InclinedEnsemble(PAIR, heights, radii, friction, slope=random.normal(0, 0.15, count))


def legs(seed, count):
    """Random targets: approach [m] or load [N] as a share of the greatest, and displacement [m]."""
    random = np.random.default_rng(seed)
    return np.column_stack([random.uniform(0.1, 1.0, count), random.uniform(-30e-9, 30e-9, count)])


CLOSE = 1e-4  # of loads along rows that are joined by straight lines


class Springs:
    """Rows of Coulomb springs, one for each asperity, on axes turned by its slope; moved in small steps."""

    def __init__(self, ensemble, count=1500):
        self.label = np.linspace(0.0, REACH, count)
        stiffness = 4 / 3 * PAIR.contact_modulus * np.sqrt(ensemble.summit_radius)
        gain = np.diff(self.label**1.5) / np.diff(self.label)
        self.weight = stiffness[:, None] * np.append(np.diff(gain, prepend=0.0), 0.0)
        angle = np.arctan(ensemble.slope)
        self.cosine, self.sine = np.cos(angle), np.sin(angle)
        self.gap, self.friction = ensemble.first_touch, ensemble.friction[:, None]
        self.place = np.zeros(2)
        self.bent = np.zeros_like(self.weight)

    def turned(self, place):
        depth = place[0] - self.gap
        return depth * self.cosine + place[1] * self.sine, place[
            1
        ] * self.cosine - depth * self.sine

    def moved(self, place):
        """How the springs are bent in a place next to the present one, and both loads of the body there."""
        (d0, u0), (d1, u1) = self.turned(self.place), self.turned(place)
        with np.errstate(divide="ignore", invalid="ignore"):
            touching = np.clip(
                np.nan_to_num((d1[:, None] - self.label) / (d1 - d0)[:, None], posinf=1.0), 0.0, 1.0
            )
        share = np.where(d0[:, None] > self.label, 1.0, touching)
        room = np.maximum(d1[:, None] - self.label, 0.0)
        bent = np.clip(
            self.bent + share * (u1 - u0)[:, None] / PAIR.displacement_ratio,
            *(s * self.friction * room for s in (-1, 1)),
        )
        normal, tangential = (self.weight * room).sum(axis=1), (self.weight * bent).sum(axis=1)
        along = float((tangential * self.cosine + normal * self.sine).sum())
        return bent, (float((normal * self.cosine - tangential * self.sine).sum()), along)

    def step(self, place):
        bent, loads = self.moved(place)
        self.bent, self.place = bent, place
        return loads


@mark.parametrize("way", [1, -1])
@mark.parametrize("slope", [SLOPE, -0.3])
def test_sphere_that_slides_on_a_slope_under_a_load(slope, way):
    ensemble = sphere(slope)
    state = ensemble.advance(ensemble.initial_state(), normal_load=LOAD)
    state = ensemble.advance(state, tangential_displacement=way * 100e-9)
    incline, angle = math.atan(slope), math.atan(FRICTION)
    assert state.normal_load == approx(LOAD, rel=1e-12)
    assert state.tangential_load == approx(LOAD * math.tan(incline + way * angle), rel=1e-11)
    pressed = LOAD / (math.cos(incline) - way * FRICTION * math.sin(incline))
    assert state.slope_load == approx(pressed * math.sin(incline), rel=1e-11)
    depth = (3 * pressed / (4 * PAIR.contact_modulus * math.sqrt(RADIUS))) ** (2 / 3)
    lifted = (depth - way * 100e-9 * math.sin(incline)) / math.cos(incline)
    assert state.approach == approx(lifted, rel=1e-11)


@mark.parametrize("seed", [0, param(1, marks=mark.slow)])
def test_random_paths_against_springs_on_turned_axes(seed):
    ensemble, parts = rough(5, seed), 150
    springs, state = Springs(ensemble), ensemble.initial_state()
    for share, displacement in legs(seed, 6):
        target = np.array([share * 100e-9, displacement])
        for place in np.linspace(springs.place, target, parts + 1)[1:]:
            normal, tangential = springs.step(place)
        state = ensemble.advance(
            state, normal_displacement=target[0], tangential_displacement=target[1]
        )
        limit = FRICTION * max(normal, 1e-5)
        assert state.normal_load == approx(normal, abs=5e-4 * limit)
        assert state.tangential_load == approx(tangential, abs=1e-3 * limit)


@mark.parametrize(
    "channel, largest, close",
    [("normal_displacement", 80e-9, 1e-13), ("normal_load", 4e-3, 3e-5)],
)
@mark.parametrize("seed", [0, param(1, marks=mark.slow)])
def test_one_large_step_and_many_small_ones(seed, channel, largest, close):
    parts = 30 if channel == "normal_displacement" else 12
    ensemble = rough(4, seed)
    large = small = ensemble.initial_state()
    start = np.zeros(2)
    for share, displacement in legs(seed, 3):
        end = np.array([share * largest, displacement])
        large = ensemble.advance(large, **{channel: end[0]}, tangential_displacement=end[1])
        for target, place in np.linspace(start, end, parts + 1)[1:]:
            small = ensemble.advance(small, **{channel: target}, tangential_displacement=place)
        start = end
        limit = FRICTION * large.normal_load
        assert small.tangential_load == approx(large.tangential_load, abs=close * limit)
        assert small.approach == approx(large.approach, rel=close)
        assert small.dissipated_energy == approx(large.dissipated_energy, rel=close)


def elastic_energy(ensemble, state):
    """Of all asperities, normal and tangential."""
    angle = np.arctan(ensemble.slope)
    depth = (state.approach - ensemble.first_touch) * np.cos(
        angle
    ) + state.tangential_displacement * np.sin(angle)
    normal = (
        8
        / 15
        * PAIR.contact_modulus
        * np.sqrt(ensemble.summit_radius)
        * np.maximum(depth, 0) ** 2.5
    )
    return float(normal.sum()) + state.stored_energy


def test_work_of_the_loads_is_stored_or_dissipated():
    ensemble = rough(2, 1)
    state, work, begin = ensemble.initial_state(), 0.0, None
    corners = [(50e-9, 12e-9), (45e-9, -15e-9), (20e-9, 12e-9), (50e-9, 12e-9)]
    for corner in corners:
        start, here = state, np.array([state.approach, state.tangential_displacement])
        move = np.array(corner) - here

        def power(share, start=start, here=here, move=move):
            d, u = here + share * move
            there = ensemble.advance(start, normal_displacement=d, tangential_displacement=u)
            return there.normal_load * move[0] + there.tangential_load * move[1]

        work += quad(power, 0, 1, epsabs=1e-24, epsrel=1e-11, limit=60)[0]
        state = ensemble.advance(
            state, normal_displacement=corner[0], tangential_displacement=corner[1]
        )
        assert elastic_energy(ensemble, state) + state.dissipated_energy == approx(work, rel=1e-11)
        begin = begin or state
    loop = state.dissipated_energy - begin.dissipated_energy
    assert loop > 0.1 * elastic_energy(ensemble, state)


def test_no_slope_gives_the_bits_of_level_asperities():
    whole = rough(8, 5)
    inclined = hs.InclinedEnsemble(PAIR, whole.summit_height, whole.summit_radius, 0.25, slope=0.0)
    level = hs.Ensemble(PAIR, whole.summit_height, whole.summit_radius, 0.25)
    events = [
        hs.NormalLoad(0.0, 2e-3),
        hs.TangentialDisplacement(1.0, 10e-9),
        hs.NormalLoad(2.0, 3e-3),
        hs.TangentialLoad(2.0, -0.2e-3),
        hs.NormalDisplacement(3.0, 50e-9),
    ]
    how = {"substeps": 5, "record": "all"}
    found, expected = (
        hs.replay(inclined, events, **how, hold=False),
        hs.replay(level, events, **how, hold=False),
    )
    assert found.drop_vars("slope").identical(expected.assign_attrs(found.attrs))


def test_replay_records_what_stepping_finds_whatever_the_substeps():
    ensemble = rough(6, 7)
    events = [
        hs.NormalLoad(0.0, 2e-3),
        hs.TangentialDisplacement(1.0, 20e-9),
        hs.TangentialDisplacement(2.0, -20e-9),
    ]
    coarse, fine = (hs.replay(ensemble, events, substeps=parts) for parts in (1, 7))
    touching = (fine.slip_state != 0).sum("asperity")
    assert_array_equal(touching, fine.contact_count)
    assert_allclose(fine.total_normal_load, 2e-3, rtol=1e-12)
    at = fine.isel(step=[0, 7, 14])
    for name in ("total_tangential_load", "separation", "total_dissipated_energy"):
        assert_allclose(at[name], coarse[name], rtol=1e-5)
    state = hs.Replay(ensemble, events).state()
    assert state.tangential_load == approx(float(coarse.total_tangential_load[-1]), rel=1e-12)
    angle = np.arctan(fine.slope)
    rotated = fine.tangential_load * np.cos(angle) + fine.normal_load * np.sin(angle)
    assert_allclose(rotated.sum("asperity"), fine.total_tangential_load, rtol=1e-12)
    moved = hs.Replay(ensemble, events).state(until=1.5)
    again = ensemble.advance(hs.Replay(ensemble, events[:2]).state(), tangential_displacement=0.0)
    assert moved.tangential_load == approx(again.tangential_load, rel=1e-5)


def test_tangential_stiffness_agrees_with_a_turn():
    ensemble = rough(6, 7)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=60e-9)
    there = ensemble.advance(state, tangential_displacement=1e-13, normal_displacement=60e-9)
    slope = (there.tangential_load - state.tangential_load) / 1e-13
    assert state.tangential_stiffness == approx(slope, rel=1e-3)


def test_states_go_to_bytes_and_back():
    ensemble = rough(4, 1)
    state = ensemble.advance(
        ensemble.initial_state(), normal_load=1e-3, tangential_displacement=5e-9
    )
    again = pickle.loads(pickle.dumps(state))  # its own
    assert again == state != ensemble.initial_state()
    assert hash(again) == hash(state)
    kept = pickle.loads(pickle.dumps(ensemble))  # its own
    assert kept.advance(again, normal_load=2e-3) == ensemble.advance(state, normal_load=2e-3)
    content = state.to_bytes()
    for damaged in (b"", content[:-1], content[:60], b"x" + content[1:], content + b"\0"):
        with refused("expected a state that was saved whole"):
            InclinedState.from_bytes(damaged)
    # mark, number of slopes and two controls precede the approach, the displacement, the excess
    # load and the axes of the slopes
    for place in range(32, 56 + 16 * len(state.facets), 8):
        for number in (1e300, -1e300, np.inf, np.nan):
            forged = content[:place] + struct.pack("<d", number) + content[place + 8 :]
            with refused("expected a state that was saved whole"):
                InclinedState.from_bytes(forged)
    for count in (-1, 0, 5, 1 << 62):
        forged = content[:8] + struct.pack("<q", count) + content[16:]
        with refused("expected a state that was saved whole"):
            InclinedState.from_bytes(forged)
    other = hs.InclinedEnsemble(
        PAIR, ensemble.summit_height, ensemble.summit_radius, 0.25, slope=-ensemble.slope
    )
    for foreign in (sphere(), other):
        with refused("expected one of this ensemble"):
            foreign.advance(state, normal_load=1e-3)


def test_questions_to_a_history_of_slopes():
    ensemble = rough(6, 7)
    events = [
        hs.NormalLoad(0.0, 2e-3),
        hs.TangentialDisplacement(1.0, 20e-9),
        hs.TangentialDisplacement(2.0, -20e-9),
    ]
    history = hs.replay(ensemble, events, record="all")
    state = hs.Replay(ensemble, events).state()
    assert float(history.contact.slope_load()[-1]) == approx(state.slope_load, rel=1e-12)
    for name in ("preliminary_displacement", "presliding_work"):
        with refused("the asperities are inclined"):
            getattr(history.contact, name)()
    assert (
        dict(history.contact.summary())["preliminary displacement"]
        == "not available: the asperities are inclined"
    )
    assert not history.contact.validity()
    far = hs.replay(ensemble, [*events, hs.TangentialDisplacement(3.0, 2e-6)], record="totals")
    (finding,) = far.contact.validity()
    assert finding.name == "turning"
    assert finding.value == approx(2e-6 / (4 * ensemble.summit_radius.min()), rel=0.5)


def load_events(seed, count):
    """Random normal loads and tangential loads that friction holds, with an approach among them."""
    random = np.random.default_rng(seed)
    events = [hs.NormalLoad(0.0, 2e-3), hs.TangentialLoad(0.0, 0.0)]
    for time in range(1, count + 1):
        load = random.uniform(1e-3, 4e-3)
        pressed = (
            hs.NormalDisplacement(time, random.uniform(50e-9, 60e-9))
            if time % 3 == 0
            else hs.NormalLoad(time, load)
        )
        events += [pressed, hs.TangentialLoad(time, random.uniform(-0.1, 0.1) * 1e-3)]
    return events


@mark.parametrize("seed", [0, param(1, marks=mark.slow)])
def test_paths_by_load_are_those_by_the_displacements_found(seed):
    ensemble = rough(5, seed)
    events = load_events(seed, 4)
    loads = hs.replay(ensemble, events, substeps=12, hold=False)
    state = hs.Replay(ensemble, events[:2], hold=False).state()
    approach = ensemble.highest_summit - loads.separation.values
    displacement = loads.tangential_displacement.values
    for row in range(1, loads.sizes["step"]):
        state = ensemble.advance(
            state,
            normal_displacement=approach[row],
            tangential_displacement=displacement[row],
        )
        normal, tangential = (
            float(loads[name][row]) for name in ("total_normal_load", "total_tangential_load")
        )
        assert state.normal_load == approx(normal, abs=CLOSE * 4e-3)
        assert state.tangential_load == approx(tangential, abs=CLOSE * 1e-3)
    # the requests: a load is a straight line in time between loads, where the normal load is one too
    asked = [event.value for event in events if isinstance(event, hs.TangentialLoad)]
    ends = loads.total_tangential_load.values[
        np.searchsorted(loads.time, np.arange(5), "right") - 1
    ]
    assert_allclose(ends, asked, rtol=0, atol=1e-15)
    first = loads.sel(step=loads.time <= 1.0)
    assert_allclose(first.total_tangential_load, first.time * asked[1], rtol=0, atol=1e-15)


@mark.parametrize("way", [1, -1])
@mark.parametrize("slope", [SLOPE, -0.3])
def test_the_friction_limit_of_a_slope(slope, way):
    ensemble = sphere(slope)
    limit = LOAD * math.tan(math.atan(slope) + way * math.atan(FRICTION))
    start = ensemble.advance(ensemble.initial_state(), normal_load=LOAD)
    with raises(hs.FrictionLimitError, match="with slopes") as caught:
        ensemble.advance(start, tangential_load=limit + way * 1e-6 * LOAD)
    assert caught.value.limit == approx(limit, rel=1e-10)
    for kept in (limit - way * 1e-6 * LOAD, limit):
        state = ensemble.advance(start, tangential_load=kept)
        assert state.tangential_load == approx(kept, rel=1e-10)
    held = ensemble.advance(start, tangential_load=way * LOAD, saturate=True)
    assert held.tangential_load == approx(limit, rel=1e-10)
    assert held.tangential_request == approx(way * LOAD, rel=1e-15)
    # the nearest displacement at which it slides
    assert held.tangential_displacement == approx(state.tangential_displacement, rel=1e-5)
    assert pickle.loads(pickle.dumps(held)) == held  # its own
    for load in (0.5 * LOAD, 1.5 * LOAD):
        held = ensemble.advance(held, normal_load=load, saturate=True)
        assert held.tangential_load == approx(limit * load / LOAD, rel=1e-10)
        assert held.tangential_request == approx(way * LOAD, rel=1e-15)
    free = ensemble.advance(held, tangential_displacement=held.tangential_displacement)
    assert free.tangential_request == free.tangential_load


def test_a_peak_of_the_load_before_steep_asperities_of_little_friction_carry_alone():
    ensemble = rough(5, 3, np.random.default_rng(5).uniform(0.05, 0.5, 5))
    start = ensemble.advance(ensemble.initial_state(), normal_load=4e-3)
    held = ensemble.advance(start, tangential_load=-1.0, saturate=True)
    largest = min(
        ensemble.advance(start, tangential_displacement=-displacement).tangential_load
        for displacement in np.linspace(2e-9, 100e-9, 20)
    )
    far = ensemble.advance(start, tangential_displacement=-5e-6).tangential_load
    assert held.tangential_load <= largest * (1 - 1e-12) < 1.05 * far


def test_a_displacement_is_held_before_a_load_is_given_and_a_load_after():
    ensemble = sphere()
    pressed = ensemble.advance(ensemble.initial_state(), normal_load=LOAD)
    assert ensemble.advance(pressed, normal_load=2 * LOAD).tangential_displacement == 0.0
    loaded = ensemble.advance(pressed, tangential_load=1e-3)
    later = ensemble.advance(loaded, normal_load=2 * LOAD)
    assert later.tangential_load == approx(1e-3, rel=1e-12)
    assert later.tangential_displacement != loaded.tangential_displacement
    lifted = ensemble.advance(loaded, normal_load=0.0, saturate=True)
    assert (lifted.tangential_load, lifted.tangential_request) == approx((0, 1e-3), abs=1e-9)
    with raises(hs.FrictionLimitError):
        ensemble.advance(loaded, normal_load=0.0)


def test_a_log_of_tangential_loads_makes_the_same_bits(tmp_path):
    ensemble, events = rough(4, 1), load_events(1, 3)
    events += [hs.NormalLoad(4.0, 2e-3), hs.TangentialLoad(4.0, 10e-3)]
    how = {"saturate": True, "hold": False}
    with hs.EventLog.create(tmp_path / "a.hslog", ensemble, events, **how) as log:
        assert log.replay().equals(history := hs.replay(ensemble, events, **how))
        assert log.state(at=2.5) == hs.Replay(ensemble, events, **how).state(until=2.5)
        assert log.state().to_bytes() == hs.Replay(ensemble, events, **how).state().to_bytes()
    assert history.saturated.values.tolist() == [0] * (history.sizes["step"] - 1) + [1]
    assert history.sizes["asperity"] == len(ensemble)


def test_messages():
    check_messages(globals())
