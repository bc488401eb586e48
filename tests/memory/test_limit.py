"""At the friction limit: where a load meets it, how the contact slides along it, and what is told of it."""

import math

import numpy as np
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from pairs import UNIT
from polylines import TIE, Polylines
from pytest import approx, mark, raises

import historysim as hs


def ramps(targets):
    """Events of joint ramps of both loads."""
    return [
        kind(float(k), value)
        for k, pair in enumerate(targets)
        for kind, value in zip(LOADS, pair, strict=True)
    ]


LOADS = (hs.NormalLoad, hs.TangentialLoad)
KINDS = {
    ("normal", "load"): hs.NormalLoad,
    ("normal", "displacement"): hs.NormalDisplacement,
    ("tangential", "load"): hs.TangentialLoad,
    ("tangential", "displacement"): hs.TangentialDisplacement,
}


def events_of(moves):
    """Events of moves, each of the targets of both channels as (kind, value)."""
    return [
        KINDS[channel, kind](float(k), value)
        for k, move in enumerate(moves)
        for channel, (kind, value) in zip(("normal", "tangential"), move, strict=True)
    ]


def at_events(history, substeps):
    return history.isel(step=slice(None, None, substeps))


def assert_sound(history):
    """T = Σ T_i, |T| ≤ limit, and whether it is held, on every row."""
    total, limit = history.total_tangential_load.values, history.friction_limit.values
    peak = max(limit.max(), 1e-300)
    assert history.tangential_load.values.sum(axis=1) == approx(total, abs=1e-12 * peak)
    assert np.all(np.abs(total) <= limit * (1 + 1e-12))
    held = history.saturated.values == 1
    assert np.abs(total[held]) == approx(limit[held], rel=1e-12)
    assert np.all(np.diff(history.total_dissipated_energy.values) >= 0)


# -- several coefficients: the limit is straight in neither load nor approach


def test_a_request_beyond_the_limit_amid_a_ramp_is_refused_and_held():
    # within the limit at both ends, where the low asperity with the large coefficient holds more
    # and more of it
    heights, friction = [0.0, -0.5], [0.1, 1.0]
    ensemble, oracle = hs.Ensemble(UNIT, heights, 1.0, friction), Polylines(heights, 1.0, friction)
    first, last = (0.99 * oracle.limit_at(oracle.approach_at(load)) for load in (0.6, 6.0))
    targets = [(0.6, 0.0), (0.6, first), (6.0, last)]
    with raises(hs.LoadError, match=r"event 5 at t = 2 s: .*beyond the friction limit"):
        hs.replay(ensemble, ramps(targets))
    history = hs.replay(ensemble, ramps(targets), saturate=True, substeps=20, record="all")
    held = history.saturated.values
    assert held[-1] == 0
    assert held.sum() > 3
    assert_sound(history)


# -- sliding along the limit


@mark.parametrize("friction", [[0.4], [0.4, 0.4], [0.4, 0.4 + 1e-12]])
@mark.parametrize("share", [1.0, 2.0, 1.0 - 1e-15])
@mark.parametrize("substeps", [1, 10])
def test_with_the_approach_falling_while_everything_slides_the_displacement_stays(
    friction, share, substeps
):
    count = len(friction)
    ensemble = hs.Ensemble(UNIT, np.zeros(count), 1.0, friction)
    force, later = share * 0.4 * count * 4 / 3, 0.01 * count
    moves = [(("displacement", d), tangential) for d, tangential in (
        (1.0, ("displacement", 0.0)), (1.0, ("displacement", 0.5)), (0.2, ("load", force)), (0.2, ("load", later)),
        (0.2, ("load", -later)),
    )]  # fmt: skip
    history = at_events(
        hs.replay(ensemble, events_of(moves), saturate=True, substeps=substeps, record="all"),
        substeps,
    )
    assert history.tangential_displacement.values[:3] == approx([0.0, 0.5, 0.5], abs=1e-12)
    assert history.saturated.values.tolist() == [0, 0, 1, 0, 0]
    # all springs slide with V fixed, while their limits fall: the stored energy of d = 1 less that
    # of d = 0.2
    spent = history.total_dissipated_energy.values
    assert spent[2] - spent[1] == approx(count * 0.4**2 * 8 / 15 * (1 - 0.2**2.5), rel=1e-9)
    assert spent[-1] == approx(count * 0.17991449, rel=1e-7)
    assert_sound(history)


def test_a_rising_normal_load_carries_a_held_load_until_friction_holds_it():
    ensemble = hs.Ensemble(UNIT, 0.0, 1.0, 0.4)
    targets = [(1.0, 0.0), (1.0, 1.0), (4.0, 1.0), (2.0, 1.0)]
    history = hs.replay(ensemble, ramps(targets), saturate=True)
    approach = lambda load: (0.75 * load) ** (2 / 3)  # noqa: E731
    # virgin at every moment: sliding until μN = 1, then N rises at constant T
    assert history.tangential_displacement.values[1:3] == approx(
        [0.4 * approach(1.0), 0.4 * approach(2.5)]
    )
    assert history.total_tangential_load.values == approx([0.0, 0.4, 1.0, 0.8])
    assert history.saturated.values.tolist() == [0, 1, 0, 1]


def test_a_request_beyond_the_limit_stays_in_force():
    """A channel runs straight between its own waypoints, also while it is held at the limit."""
    ensemble = hs.Ensemble(UNIT, 0.0, 1.0, 0.4)
    whole = [
        hs.NormalLoad(0.0, 1.0),
        hs.NormalLoad(10.0, 6.0),
        hs.TangentialLoad(0.0, 0.0),
        hs.TangentialLoad(2.0, 4.0),
    ]
    whole += [hs.TangentialLoad(10.0, 0.0)]
    order = lambda event: event.time  # noqa: E731
    once = hs.replay(ensemble, sorted(whole, key=order), saturate=True, hold=False)
    split = [*whole, *(hs.NormalLoad(t, 1.0 + 0.5 * t) for t in (1.0, 3.0, 4.0, 5.5, 7.0, 9.0))]
    twice = hs.replay(ensemble, sorted(split, key=order), saturate=True, hold=False)
    common = twice.sel(step=np.isin(twice.time.values, once.time.values))
    for name in (
        "total_tangential_load",
        "tangential_displacement",
        "total_dissipated_energy",
        "saturated",
    ):
        assert common[name].values == approx(once[name].values, rel=1e-6), name


# -- histories that reach the limit often


@st.composite
def restless(draw, count):
    """Draw moves whose tangential loads are often at the limit or beyond it."""
    moves, approach = [], 0.5
    for _ in range(draw(st.integers(2, 5))):
        d = draw(st.sampled_from([approach, 0.05, 0.2, 0.35, 0.6, 1.0]))
        approach = d
        by_load = draw(st.booleans())
        gaps = np.linspace(0.0, 0.3, count)
        load = float((4 / 3 * np.clip(d - gaps, 0, None) ** 1.5).sum())
        normal = ("load", load) if by_load else ("displacement", d)
        share = draw(st.sampled_from([-3.0, -1.0, -0.6, 0.0, 0.3, 0.9, 1.0, 1.5]))
        if draw(st.integers(0, 3)):
            limit = float((FRICTION[:count] * 4 / 3 * np.clip(d - gaps, 0, None) ** 1.5).sum())
            tangential = ("load", share * limit)
        else:
            tangential = ("displacement", 0.3 * share)
        moves.append((normal, tangential))
    return moves


FRICTION = np.array([0.25, 0.6, 0.4, 0.9, 0.3, 0.55, 0.2, 0.7, 0.45, 0.35, 0.8, 0.5])


def alike(oracle, normal, tangential):
    """Tell whether a move is the same one to the oracle.

    On its way to the limit, or back from it, a path to an approach is straight in approach and
    displacement, while that of the oracle is straight in approach and load.
    """
    if (normal[0], tangential[0]) != ("displacement", "load"):
        return True
    limits = np.array([oracle.limit, oracle.limit_at(normal[1])])
    requests = np.array([oracle.request, tangential[1]])
    free = abs(requests[1]) < limits[1] * (1 - TIE) and abs(requests[0]) <= limits[0] * (1 + TIE)
    return free or any(np.all(side * requests >= limits * (1 - TIE)) for side in (1, -1))


def ensemble_of(count):
    return hs.Ensemble(UNIT, -np.linspace(0.0, 0.3, count), 1.0, FRICTION[:count])


@settings(max_examples=5, deadline=None)
@given(st.integers(1, 3).flatmap(lambda count: st.tuples(st.just(count), restless(count))))
def test_histories_at_the_limit_agree_with_the_oracle(drawn):
    count, moves = drawn
    once = hs.replay(ensemble_of(count), events_of(moves), saturate=True, record="all")
    assert_sound(once)
    oracle = Polylines(-np.linspace(0.0, 0.3, count), 1.0, FRICTION[:count])
    for step, (normal, tangential) in enumerate(moves):
        if not alike(oracle, normal, tangential):
            break
        oracle.to(normal, tangential, steps=60)
        row = once.isel(step=step)
        reach = max(0.6, abs(oracle.displacement))
        assert row.tangential_displacement == approx(oracle.displacement, abs=0.03 * reach)
        assert row.total_tangential_load == approx(oracle.tangential_load, abs=0.01)
        assert row.total_dissipated_energy == approx(oracle.dissipated, abs=5e-3)


@settings(max_examples=10, deadline=None)
@given(
    st.sampled_from([1, 2, FRICTION.size]).flatmap(
        lambda count: st.tuples(st.just(count), restless(count))
    ),
    st.sampled_from([math.inf, 30.0, 1.0, 0.02]),
    st.floats(0.05, 0.95),
)
def test_substeps_states_between_events_and_logs_agree_at_the_limit(
    tmp_path_factory, drawn, stiffness, share
):
    count, moves = drawn
    ensemble, events = ensemble_of(count), events_of(moves)
    options = {"saturate": True, "instrument": hs.Instrument(stiffness)}
    once = hs.replay(ensemble, events, record="all", **options)
    assert_sound(once)
    driven = [step for step, (_, (kind, _)) in enumerate(moves) if kind == "displacement"]
    wanted = np.array([moves[step][1][1] for step in driven])
    reached = once.tangential_displacement.values + once.total_tangential_load.values / stiffness
    # the drive is the displacement and the bend of the spring, to the rounding of either
    assert reached[driven] == approx(
        wanted, abs=1e-12 * max(1.0, np.abs(reached).max(), 1 / stiffness)
    )

    time = len(moves) - 2 + share
    path = tmp_path_factory.mktemp("limit") / "a.history"
    with hs.EventLog.create(path, ensemble, events[:3], record="all", **options) as log:
        log.append(events[3:])
        xr.testing.assert_identical(log.replay(), once)
        between, direct = log.state(time), hs.Replay(ensemble, events, **options).state(time)
        assert (
            between.tangential_load,
            between.tangential_displacement,
            between.dissipated_energy,
        ) == (
            direct.tangential_load,
            direct.tangential_displacement,
            direct.dissipated_energy,
        )
        row = hs.Replay(ensemble, events, **options).dataset(until=time).isel(step=-1)
        assert (direct.tangential_load, direct.tangential_displacement) == (
            row.total_tangential_load,
            row.tangential_displacement,
        )
        assert log.state().tangential_load == once.total_tangential_load.values[-1]
