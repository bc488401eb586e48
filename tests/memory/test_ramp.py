"""The energy of ramps of both loads, however much the normal load changes on them."""

import numpy as np
import scipy.optimize
from pairs import UNIT
from pytest import approx, mark, param

import historysim as hs


def surface(friction, **options):
    heights = -np.linspace(0.0, 0.3, len(friction))
    return hs.Ensemble(UNIT, heights, 1.0, friction, **options)


def pressed(ensemble, turns, load):
    """A state after turns, as shares of the friction limit at a normal load, and that limit."""
    state = ensemble.advance(ensemble.initial_state(), normal_load=load, tangential_load=0.0)
    limit = limit_of(ensemble, load)
    for turn in turns:
        state = ensemble.advance(state, tangential_load=turn * limit)
    return state, limit


def limit_of(ensemble, load):
    depth = np.clip(ensemble.approach_at(load) + ensemble.summit_height, 0, None)
    return float(ensemble.friction @ (4 / 3 * depth**1.5))


def dissipated(ensemble, state):
    return np.array([asperity.dissipated_energy for asperity in ensemble.asperities(state)])


#: coefficients of friction, and errors that are tolerated: of displacements over the one at which
#: all slides, of the energy over that of the ramp, and of energies of asperities over the largest
#: one
ONE_OR_SEVERAL = [
    param([0.5], (1e-10, 1.5e-6, 2e-5), id="one"),
    param([0.5, 0.6, 0.7], (2e-6, 1e-5, 4e-5), id="several"),
]


@mark.parametrize("frictions, tolerated", ONE_OR_SEVERAL)
@mark.parametrize("seed", range(12))
def test_one_ramp_dissipates_what_many_short_ones_do(seed, frictions, tolerated):
    """Each asperity's energy is that of hundreds of short ramps, whose chords hardly need a correction."""
    rng = np.random.default_rng(seed)
    count, swing = int(rng.choice([1, 2, 7, 40, 200])), rng.choice([1e-5, 1e-3, 0.03, 0.3, 0.9])
    heights = np.sort(rng.uniform(-0.5, 0.0, count))
    friction = np.resize(frictions, count)
    ensemble = hs.Ensemble(UNIT, heights - heights.max(), rng.uniform(0.5, 1.0, count), friction)
    start = ensemble.advance(ensemble.initial_state(), normal_load=0.3, tangential_load=0.0)
    for _ in range(rng.integers(0, 6)):
        load = 0.3 * (1.0 + swing * rng.uniform(-1.0, 1.0))
        start = ensemble.advance(
            start, normal_load=load, tangential_load=rng.uniform(-0.999, 0.999) * 0.5 * load
        )
    normal = 0.3 * (1.0 + swing * rng.uniform(-1.0, 1.0)) if seed % 8 else 0.0
    limit = 0.5 * normal
    tangential = (
        np.clip(start.tangential_load, -limit, limit)
        if seed % 5 == 0
        else rng.uniform(-0.999, 0.999) * limit
    )
    whole = ensemble.advance(start, normal_load=normal, tangential_load=tangential)
    assert dissipated(ensemble, whole).sum() == approx(
        whole.dissipated_energy, rel=1e-12, abs=1e-18
    )

    def in_parts(parts):
        state = start
        for k in range(1, parts + 1):
            loads = [
                first + (last - first) * k / parts if k < parts else last for first, last in ends
            ]
            state = ensemble.advance(state, normal_load=loads[0], tangential_load=loads[1])
        return state, dissipated(ensemble, state) - dissipated(ensemble, start)

    ends = (start.normal_load, normal), (start.tangential_load, tangential)
    (_, coarse), (state, fine) = in_parts(200), in_parts(400)
    extrapolated = fine + (fine - coarse) / 3.0
    energies = dissipated(ensemble, whole) - dissipated(ensemble, start)
    full_slip = friction.max() * max(start.approach, whole.approach)
    moved = whole.tangential_displacement - state.tangential_displacement
    assert abs(moved) <= tolerated[0] * full_slip + 1e-12
    rounding = 1e-15 * (0.3 * 0.3 + whole.dissipated_energy)
    assert energies.sum() == approx(extrapolated.sum(), rel=tolerated[1], abs=rounding)
    np.testing.assert_allclose(
        energies, extrapolated, rtol=0.0, atol=tolerated[2] * extrapolated.max() + rounding
    )


@mark.parametrize(
    "load, share", [(1.1, 0.5), (0.9, 0.5), (0.5, 0.4), (1.5, 0.9), (2.0, 0.7), (0.7, 0.99)]
)
def test_a_ramp_from_full_stick_has_the_energy_of_its_closed_form(load, share):
    """E = T V - ΔT ∫ V ds - μ² [Q(d) - Q(f) - (d - f) P(f)], with the label f of the slip front: P(f) = N - T/μ."""
    friction, count = 0.2, 200
    rng = np.random.default_rng(1)
    gaps, radii = np.sort(rng.uniform(0.0, 0.5, count)), rng.uniform(0.5, 2.0, count)
    gaps -= gaps[0]
    weights = 4.0 / 3.0 * np.sqrt(radii)
    normal = lambda a: float(weights @ np.maximum(a - gaps, 0.0) ** 1.5)  # noqa: E731
    integral = lambda a: float(weights @ np.maximum(a - gaps, 0.0) ** 2.5) / 2.5  # noqa: E731
    moment = lambda a: a * normal(a) - integral(a)  # noqa: E731
    label = lambda value: scipy.optimize.brentq(  # noqa: E731
        lambda a: normal(a) - value, 0.0, 5.0, xtol=1e-15, rtol=1e-14
    )
    ensemble = hs.Ensemble(UNIT, -gaps, radii, friction)
    start = ensemble.advance(ensemble.initial_state(), normal_displacement=0.6, tangential_load=0.0)
    first, last = start.normal_load, load * start.normal_load
    assert first == approx(normal(0.6), rel=1e-12)
    tangential = share * friction * last
    state = ensemble.advance(start, normal_load=last, tangential_load=tangential)
    front_load = last - tangential / friction
    edge, front = label(last), label(front_load)
    displacement = friction * (edge - front)
    edge_mean = (moment(edge) - moment(0.6)) / (last - first)
    front_mean = (moment(front) - moment(0.6)) / (front_load - first)
    mean = friction * (edge_mean - front_mean)
    stored = friction**2 * (integral(edge) - integral(front) - (edge - front) * front_load)
    energy = tangential * displacement - tangential * mean - stored
    assert state.tangential_displacement == approx(displacement, rel=1e-9)
    assert state.dissipated_energy == approx(energy, rel=1e-6)


@mark.parametrize("count", [2, 10])
def test_a_smaller_tolerance_gives_no_worse_results(count):
    rng = np.random.default_rng(count)
    friction = rng.uniform(0.1, 0.5, count)
    results = []
    for tolerance in (1e-9, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
        ensemble = surface(friction, tolerance=tolerance)
        state, _ = pressed(ensemble, [], 1.0)
        for load, share in ((0.6, 0.75), (1.4, -0.6), (0.5, 0.7)):
            state = ensemble.advance(
                state, normal_load=load, tangential_load=share * 0.1 * min(load, 1.0)
            )
        results.append((state.tangential_displacement, state.dissipated_energy))
    reference, *others = np.array(results)
    errors = np.abs(np.array(others) / reference - 1.0)
    assert (errors[0] < 1e-5).all()
    assert (errors[1:] < 1e-8).all()
