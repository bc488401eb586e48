"""Corrections of measured channels: what is taken away is what was put on."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import historysim as hs
from historysim.measured.correction import (
    contact_displacement,
    drift_of_cycles,
    offset_of_cycles,
    remove_backlash,
    remove_drift,
    remove_free_play,
    remove_offset,
    rescale,
)
from historysim.measured.reduction import reversals

values = st.lists(st.floats(-10, 10), min_size=1, max_size=30).map(np.array)


def triangle(time, amplitude=1.0, period=4.0):
    """Start from 0 upwards."""
    phase = (time / period + 0.25) % 1
    return amplitude * (1 - 4 * np.abs(phase - 0.5))


def played(motion, width):
    """Return what lags behind a motion by half the width, step by step."""
    follower = np.empty_like(motion)
    at = motion[0] - width / 2 * np.sign(motion[1] - motion[0])
    for i, value in enumerate(motion):
        at = min(max(at, value - width / 2), value + width / 2)
        follower[i] = at
    return follower


@given(values, st.floats(-3, 3), st.floats(0.1, 3))
def test_what_is_left_and_what_was_removed_is_what_was_there(before, first, second):
    time = np.arange(before.size, dtype=float)
    for found in (
        rescale(before, second, first),
        remove_offset(before, first),
        remove_drift(time, before, first),
        remove_backlash(time, before, second, dead_band=0.5),
        remove_free_play(before, time - 3, second),
        contact_displacement(before, time, second),
    ):
        assert found.values + found.removed == pytest.approx(before, abs=1e-13 * 30 * 100)
        assert found.largest == np.abs(found.removed).max()


def test_scale_offset_and_sign():
    assert rescale([1, 2, -3], 2.0, 0.5).values.tolist() == [2.5, 4.5, -5.5]
    assert rescale([1, 2, -3], -1).values.tolist() == [-1, -2, 3]
    assert rescale([1, 2, -3], -1).removed.tolist() == [2, 4, -6]
    assert remove_offset([1, 2], 0.25).values.tolist() == [0.75, 1.75]


def test_drift_starts_from_the_first_sample_or_a_given_time():
    found = remove_drift([1, 2, 4], [10, 10, 10], 0.5)
    assert found.values.tolist() == [10, 9.5, 8.5]
    assert found.removed.tolist() == [0, 0.5, 1.5]
    assert remove_drift([1, 2, 4], [10, 10, 10], 0.5, reference=2).values.tolist() == [10.5, 10, 9]


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_offset_and_drift_are_found_within_their_errors(noise):
    generator = np.random.default_rng(7)
    time = np.linspace(0, 80.5, 8051)
    swing = triangle(time)
    channel = swing + 0.3 + generator.normal(0, 1, time.size) * noise
    offset = offset_of_cycles(channel, dead_band=0.5)
    assert offset.count == 20
    # extremes of noise are a little farther out on both sides alike
    assert offset.value == pytest.approx(0.3, abs=4 * offset.standard_error + 1e-12)
    assert offset.standard_error <= noise + 1e-15
    rate = drift_of_cycles(time, channel + 0.02 * time, dead_band=0.5)
    assert rate.count == 20
    assert rate.value == pytest.approx(0.02, abs=4 * rate.standard_error + 1e-12)
    back = remove_drift(time, channel + 0.02 * time, rate.value).values
    assert np.abs(back - channel).max() <= 80.5 * (4 * rate.standard_error + 1e-12)


def test_the_standard_error_of_the_drift_is_that_of_a_straight_fit():
    generator = np.random.default_rng(2)
    time = np.arange(0.0, 40.5, 0.5)
    channel = triangle(time) + generator.normal(0, 0.05, time.size) + 0.01 * time
    found = drift_of_cycles(time, channel, dead_band=1.0, skip=2)
    cycles = reversals(channel, 1.0)[4:]
    cycles = cycles[: cycles.size // 2 * 2].reshape(-1, 2)
    slope, covariance = np.polyfit(time[cycles].mean(axis=1), channel[cycles].mean(axis=1), 1, cov=True)
    assert found.value == pytest.approx(slope[0], rel=1e-9)
    assert found.standard_error == pytest.approx(math.sqrt(covariance[0, 0]), rel=1e-9)
    assert found.count == len(cycles)


def test_the_standard_error_of_the_offset_is_that_of_a_mean():
    found = offset_of_cycles([0, 3, -1, 5, 1, 4, -2, 0], dead_band=1)
    middle = np.array([1, 3, 1])
    assert (found.value, found.count) == (middle.mean(), 3)
    assert found.standard_error == pytest.approx(middle.std(ddof=1) / math.sqrt(3))
    one = offset_of_cycles([0, 3, -1, 5, 1, 4, -2, 0], dead_band=1, skip=2)
    assert (one.value, one.count) == (1, 1)
    assert math.isnan(one.standard_error)


@pytest.mark.parametrize("width", [0.0, 0.05, 0.3])
def test_backlash_of_an_even_motion_is_taken_out_exactly(width):
    time = np.arange(0, 16.6, 0.01)
    motion = triangle(time)
    reading = played(motion, width)
    found = remove_backlash(time, reading, width)
    # how long the reading rests is known to a sample at either end
    assert found.values == pytest.approx(motion, abs=0.02 + 1e-12)
    moving = np.abs(found.removed) == width / 2
    moving[1:-1] &= moving[2:] & moving[:-2]
    assert moving.sum() > 1_000
    assert found.values[moving] == pytest.approx(motion[moving], abs=1e-12)
    assert found.largest == width / 2


def test_backlash_under_noise_is_taken_out_within_the_dead_band():
    time = np.arange(0, 16.6, 0.01)
    motion = triangle(time)
    noisy = played(motion, 0.3) + np.random.default_rng(4).uniform(-0.01, 0.01, time.size)
    found = remove_backlash(time, noisy, 0.3, dead_band=0.04)
    assert np.abs(found.values - motion).max() < 0.01 + 0.04 + 0.02
    assert np.abs(noisy - motion).max() > 0.14


def test_backlash_of_what_does_not_move_is_unknown_and_left():
    assert remove_backlash([0, 1, 2], [5, 5, 5], 1.0).removed.tolist() == [0, 0, 0]
    assert remove_backlash([0, 1, 2], [5, 6, 7], 1.0).values.tolist() == [5.5, 6.5, 7.5]
    assert remove_backlash([0], [5], 1.0).values.tolist() == [5]


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=30).map(np.array), st.floats(0, 3), st.floats(0.01, 0.5))
def test_free_play_in_series_is_taken_out(load, width, closing_load):
    contact = np.linspace(-5, 5, load.size)
    spring = width / (2 * closing_load)
    clearance = [min(max(force * spring, -width / 2), width / 2) for force in load]
    found = remove_free_play(contact + clearance, load, width, closing_load=closing_load)
    assert found.values == pytest.approx(contact, abs=1e-13)
    sharp = remove_free_play(contact + width / 2 * np.sign(load), load, width)
    assert sharp.values == pytest.approx(contact, abs=1e-13)


def test_an_instrument_in_series_is_taken_out():
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    ensemble = hs.Ensemble(pair, 0.0, 2.5e-3, 0.12)
    events = [hs.NormalLoad(0.0, 10e-3), hs.TangentialLoad(1.0, 1e-3), hs.TangentialLoad(2.0, -1e-3)]
    history = hs.replay(ensemble, events, substeps=20)
    displacement, load = history.tangential_displacement.values, history.total_tangential_load.values
    measured = displacement + load / 334e3
    found = contact_displacement(measured, load, 334e3)
    assert found.values == pytest.approx(displacement, abs=1e-22)
    assert found.removed == pytest.approx(load / 334e3, rel=1e-15)
    rigid = contact_displacement(measured, load, math.inf)
    assert rigid.values.tolist() == measured.tolist()
    assert rigid.largest == 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rescale([1, 2], 0), "scale is 0; expected another number"),
        (lambda: rescale([1, math.nan], 2), "values misses 1 of 2 samples"),
        (lambda: remove_offset([1, 2], math.nan), "offset is nan"),
        (lambda: remove_drift([0, 1], [1, 2, 3], 1), "time has 2 samples; expected 3"),
        (lambda: remove_drift([0, 0], [1, 2], 1), r"time\[1\]: the time 0 s comes after 0 s"),
        (lambda: remove_backlash([0, 1], [1, 2], -1), "width is -1; expected a finite number of 0 or more"),
        (lambda: remove_free_play([0, 1], [1, 2], -1), "width is -1"),
        (lambda: remove_free_play([0, 1], [1, 2], 1, closing_load=-1), "closing_load is -1"),
        (lambda: remove_free_play([0, 1], [1], 1), "tangential_load has 1 samples; expected 2"),
        (lambda: contact_displacement([0, 1], [1, 2], 0), "stiffness is 0; expected a finite number greater than 0"),
        (lambda: contact_displacement([0, 1], [1, 2], -math.inf), "stiffness is -inf"),
        (lambda: offset_of_cycles([0, 1, 0], dead_band=0.1), "has 0 cycles at a dead band of 0.1, of which 0 are left"),
        (lambda: offset_of_cycles([0, 1, 0, 1], dead_band=0.1, skip=-1), "expected 1 or more to be left"),
        (lambda: drift_of_cycles(range(6), [0, 1, 0, 1, 0, 1], dead_band=0.1), "2 cycles .* expected 3 or more"),
    ],
)
def test_bad_input_is_explained(call, message):
    with pytest.raises(hs.InputError, match=message):
        call()
