"""Reduction to turning points: what is kept, and how little that changes."""

import math
from itertools import pairwise

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from pairs import UNIT as PAIR
from pytest import approx, mark

import historysim as hs
from historysim.contact import mindlin
from historysim.measured.reduction import follow_turns, kept_points, resample, turning_points

# whole numbers meet each other, and the dead band, exactly
samples = st.lists(st.integers(-20, 20), min_size=1, max_size=40).map(np.array)
dead_bands = st.integers(0, 15)


def fall(values):
    """Return by how much values fall from their running maximum."""
    return float((np.maximum.accumulate(values) - values).max())


@given(samples, dead_bands)
def test_kept_points_alternate_and_others_stay_within_the_dead_band(values, dead_band):
    kept = turning_points(values, dead_band)
    assert turning_points(7 - values, dead_band).tolist() == kept.tolist()
    assert turning_points(values[kept], dead_band).tolist() == list(range(kept.size))
    # except that an extreme, as yet unconfirmed, may stand at either end of the record
    assert set(turning_points(values, dead_band + 3)[2:-2].tolist()) <= set(kept.tolist())
    assert kept[0] == 0
    assert kept[-1] == values.size - 1
    assert (np.diff(kept) > 0).all()
    swings = np.diff(values[kept])
    assert (np.abs(swings[1:-1]) >= max(dead_band, 1)).all()
    assert (swings[1:] * swings[:-1] <= 0).all()
    for position, (start, end) in enumerate(pairwise(kept)):
        branch = values[start : end + 1]
        if abs(swings[position]) >= max(dead_band, 1):
            rising = branch * np.sign(swings[position])
            assert rising[0] == rising.min()
            assert rising[-1] == rising.max()
            assert fall(rising) < dead_band or fall(rising) == 0
            assert (rising[:-1] < rising[-1]).all() or end == values.size - 1
        else:
            assert position in {0, len(swings) - 1}
            assert np.ptp(branch) < dead_band or np.ptp(branch) == 0


@given(samples, dead_bands)
def test_the_channel_in_step_is_monotone_and_near(values, dead_band):
    kept = turning_points(values, dead_band)
    near = follow_turns(values, kept)
    assert near[kept].tolist() == values[kept].tolist()
    assert (np.abs(near - values) < max(dead_band, 1e-300)).all()
    for start, end in pairwise(kept):
        assert fall(near[start : end + 1] * np.sign(values[end] - values[start])) == 0


@mark.parametrize(
    "values, dead_band, kept",
    [
        ([3], 0, [0]),
        ([3, 3], 0, [0, 1]),
        ([3, 3, 3], 1, [0, 2]),
        ([0, 1, 2, 3], 0, [0, 3]),
        ([0, 2, 1, 3, 0], 0, [0, 1, 2, 3, 4]),
        ([0, 2, 1, 3, 0], 1, [0, 1, 2, 3, 4]),  # a swing of the dead band itself counts
        ([0, 2, 1, 3, 0], 1.01, [0, 3, 4]),
        ([0, 2, 2, 2, 0], 1, [0, 1, 4]),  # of equal extremes the first
        ([0, 0.4, -0.4, 5], 1, [0, 2, 3]),  # the wander at the start leaves one extreme
        ([0, -0.4, 0.4, 5], 1, [0, 1, 3]),
        ([0, 5, 4.5, 4.8], 1, [0, 1, 3]),  # the last amplitude is not cut off
        ([0, 0.4, -0.4, 0.1], 1, [0, 3]),
    ],
)
def test_turning_points_by_hand(values, dead_band, kept):
    assert turning_points(values, dead_band).tolist() == kept


# ---------------------------------------------------------------- what it changes


NORMAL_LOAD = 0.01
ENSEMBLES = [
    hs.Ensemble(PAIR, 0.0, 1.0, 0.5),
    hs.Ensemble(PAIR, [0.0, -0.01, -0.02, -0.03], [1.0, 0.5, 2.0, 1.0], 0.5),
    hs.Ensemble(PAIR, [0.0, -0.01, -0.02, -0.03], [1.0, 0.5, 2.0, 1.0], [0.3, 0.5, 0.3, 0.7]),
]


def replayed(ensemble, displacements):
    """Return the tangential load and the dissipated energy at each displacement, at a constant normal load."""
    events = [hs.NormalLoad(0.0, NORMAL_LOAD)]
    events += [
        hs.TangentialDisplacement(1.0 + i, float(value)) for i, value in enumerate(displacements)
    ]
    history = hs.replay(ensemble, events, record="totals")
    return history.total_tangential_load.values[1:], history.total_dissipated_energy.values[1:]


def contact_radii(ensemble):
    approach = ensemble.approach_at(NORMAL_LOAD)
    return np.sqrt(ensemble.summit_radius * np.maximum(ensemble.summit_height + approach, 0))


def variation(values):
    return float(np.abs(np.diff(values)).sum())


@mark.parametrize("ensemble", ENSEMBLES)
@example(values=np.array([0, 9, -7, 8, 3, 5]), dead_band=0, scale=0.1)
@given(
    values=samples.filter(lambda values: values.size > 2),
    dead_band=dead_bands,
    scale=st.floats(0.02, 0.3),
)
def test_loads_and_energies_stay_within_the_bounds(ensemble, values, dead_band, scale):
    slide = float(
        (PAIR.displacement_ratio * ensemble.friction * ensemble.approach_at(NORMAL_LOAD)).max()
    )
    values, dead_band = values * slide * scale, dead_band * slide * scale
    kept = turning_points(values, dead_band)
    reduced = follow_turns(values, kept)
    load, energy = replayed(ensemble, values)
    reduced_load, reduced_energy = replayed(ensemble, reduced)

    stiffness = 8 * PAIR.shear_modulus * contact_radii(ensemble).sum()
    rounding = 1e-12 * (ensemble.friction.max() * NORMAL_LOAD + stiffness * np.abs(values).max())
    assert replayed(ensemble, values[kept])[0] == approx(reduced_load[kept], abs=rounding)

    # two springs that slip at r differ by no more than min(ε, 2r): twice the virgin curve at half
    # the dead band
    bound = 2 * replayed(ensemble, [0.0, dead_band / 2])[0][1]
    assert bound <= stiffness * dead_band + rounding
    assert np.abs(load - reduced_load).max() <= bound + rounding

    ends = kept[1:][np.abs(np.diff(values[kept])) >= dead_band]
    assert load[ends] == approx(reduced_load[ends], abs=rounding)
    for start, end in pairwise(ends):
        lost = (energy[end] - energy[start]) - (reduced_energy[end] - reduced_energy[start])
        dropped = variation(values[start : end + 1]) - variation(reduced[start : end + 1])
        assert -rounding * slide <= lost <= stiffness * dead_band * dropped / 8 + rounding * slide


def test_the_bound_is_attained_by_one_dip_from_a_slide():
    ensemble = ENSEMBLES[0]
    (radius,) = contact_radii(ensemble)
    limit = 0.5 * NORMAL_LOAD
    contact = {
        "normal_load": NORMAL_LOAD,
        "contact_radius": radius,
        "shear_modulus": 0.25,
        "friction": 0.5,
    }
    slide = mindlin.preliminary_displacement(**contact)
    turned = 0.4 * limit
    dip = 2 * mindlin.tangential_displacement(0.3 * limit, **contact)
    values = np.array([0.0, 2 * slide, 2 * slide - dip, 3 * slide])
    load, _ = replayed(ensemble, values)
    reduced, _ = replayed(
        ensemble, follow_turns(values, turning_points(values, np.nextafter(dip, 1)))
    )
    assert reduced[2] - load[2] == approx(2 * 0.3 * limit, rel=1e-12)
    assert load[2] == approx(turned, rel=1e-12)


@example(values=np.array([10.0, 20.0, 10.0]), dead_band=11.0, share=0.5)
@given(
    values=samples.filter(lambda values: np.ptp(values) > 0),
    dead_band=dead_bands,
    share=st.floats(0.05, 0.95),
)
def test_under_load_control_displacements_stay_within_the_bound(values, dead_band, share):
    ensemble = ENSEMBLES[0]
    (radius,) = contact_radii(ensemble)
    unit = share * 0.5 * NORMAL_LOAD / max(np.abs(values).max(), dead_band / 2)
    values, dead_band = values * unit, dead_band * unit

    def displacements(loads):
        events = [hs.NormalLoad(0.0, NORMAL_LOAD)]
        events += [hs.TangentialLoad(1.0 + i, float(load)) for i, load in enumerate(loads)]
        return hs.replay(ensemble, events, record="totals").tangential_displacement.values[1:]

    kept = turning_points(values, dead_band)
    whole, reduced = displacements(values), displacements(follow_turns(values, kept))
    contact = {
        "normal_load": NORMAL_LOAD,
        "contact_radius": radius,
        "shear_modulus": 0.25,
        "friction": 0.5,
    }
    rounding = 1e-12 * mindlin.preliminary_displacement(**contact)
    bound = 2 * mindlin.tangential_displacement(dead_band / 2, **contact)
    ends = kept[1:][np.abs(np.diff(values[kept])) >= dead_band]
    swung = ends[0] if ends.size else values.size
    assert np.abs(whole - reduced)[swung:].max(initial=0) <= bound + rounding
    most = max(np.abs(values).max(), dead_band / 2)
    virgin = mindlin.tangential_displacement(np.array([most, most - dead_band]), **contact)
    assert np.abs(whole - reduced)[:swung].max(initial=0) <= virgin[0] - virgin[1] + rounding
    assert whole[ends] == approx(reduced[ends], abs=rounding)


# ---------------------------------------------------------------- two channels


def farthest(points, path):
    """Return the largest distance of a point from the straight path between its kept neighbours, on a fine grid."""
    share = np.linspace(0, 1, 2001)[:, None]
    most = 0.0
    for start, end in pairwise(path):
        line = points[start] + share * (points[end] - points[start])
        most = max(
            most, *(np.abs(point - line).max(axis=1).min() for point in points[start : end + 1])
        )
    return most


two_channels = st.lists(
    st.tuples(st.integers(-20, 20), st.integers(0, 20)), min_size=1, max_size=25
).map(np.array)


@given(two_channels, st.integers(1, 8), st.integers(1, 8))
def test_the_joint_path_stays_within_the_dead_bands(points, dead_band, normal_dead_band):
    tangential, normal = points.T
    kept = kept_points(tangential, normal, dead_band=dead_band, normal_dead_band=normal_dead_band)
    own = [turning_points(tangential, dead_band), turning_points(normal, normal_dead_band)]
    assert set(np.concatenate(own).tolist()) <= set(kept.tolist())
    # a grid of 2000 steps on a straight path of up to 40 dead bands
    assert farthest(points / [dead_band, normal_dead_band], kept) <= 1 + 20 / 2000
    again = kept_points(
        tangential[kept], normal[kept], dead_band=dead_band, normal_dead_band=normal_dead_band
    )
    assert again.tolist() == list(range(kept.size))


def test_a_constant_normal_load_adds_nothing():
    values = np.sin(np.linspace(0, 40, 5_000))
    noise = np.random.default_rng(1).uniform(0.99, 1.01, values.size)
    assert kept_points(values, np.ones(values.size)).tolist() == turning_points(values).tolist()
    assert (
        kept_points(values, noise, normal_dead_band=0.03).tolist()
        == turning_points(values).tolist()
    )
    assert kept_points(values).tolist() == turning_points(values).tolist()


def test_a_normal_load_that_swings_while_the_contact_rests_is_kept():
    normal = np.array([1.0, 2.0, 1.0, 3.0, 3.0])
    assert kept_points(np.zeros(5), normal, dead_band=0.1, normal_dead_band=0.5).tolist() == [
        0,
        1,
        2,
        3,
        4,
    ]
    assert kept_points(np.zeros(5), normal, dead_band=0.1, normal_dead_band=1.5).tolist() == [
        0,
        3,
        4,
    ]


# ---------------------------------------------------------------- clocks and gaps


@given(
    st.lists(st.integers(1, 5), min_size=1, max_size=12),
    st.lists(st.one_of(st.integers(-9, 9).map(float), st.just(math.nan)), min_size=13, max_size=13),
    st.integers(1, 5),
    st.integers(-3, 3),
)
def test_resampling_by_hand(steps, values, max_gap, shift):
    time = np.cumsum([0, *steps]).astype(float)
    values = np.array(values[: time.size])
    onto = np.arange(-4, time[-1] + 5, 0.5)
    found = resample(time, values, onto, shift=shift, max_gap=max_gap)
    for wanted, value in zip(onto, found, strict=True):
        own = wanted - shift
        expected = math.nan
        for (t0, t1), (v0, v1) in zip(pairwise(time), pairwise(values), strict=True):
            if t0 < own < t1 and t1 - t0 <= max_gap:
                expected = v0 + (own - t0) / (t1 - t0) * (v1 - v0)
        if own in time:
            expected = values[time == own][0]
        assert value == approx(expected, nan_ok=True, rel=1e-12, abs=1e-12)


# ---------------------------------------------------------------- bad input
