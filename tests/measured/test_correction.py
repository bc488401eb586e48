"""Corrections of measured channels: what is taken away is what was put on."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx, mark

from historysim.measured.correction import (
    drift_of_cycles,
    offset_of_cycles,
    remove_backlash,
    remove_free_play,
)
from historysim.measured.reduction import reversals


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


@mark.parametrize("noise", [0.0, 0.01])
def test_offset_and_drift_are_found_within_their_errors(noise):
    generator = np.random.default_rng(7)
    time = np.linspace(0, 80.5, 8051)
    swing = triangle(time)
    channel = swing + 0.3 + generator.normal(0, 1, time.size) * noise
    offset = offset_of_cycles(channel, dead_band=0.5)
    # extremes of noise are a little farther out on both sides alike
    assert offset.value == approx(0.3, abs=4 * offset.standard_error + 1e-12)
    assert offset.standard_error <= noise + 1e-15
    rate = drift_of_cycles(time, channel + 0.02 * time, dead_band=0.5)
    assert rate.value == approx(0.02, abs=4 * rate.standard_error + 1e-12)


def test_the_standard_error_of_the_drift_equals_that_of_a_straight_fit():
    generator = np.random.default_rng(2)
    time = np.arange(0.0, 40.5, 0.5)
    channel = triangle(time) + generator.normal(0, 0.05, time.size) + 0.01 * time
    found = drift_of_cycles(time, channel, dead_band=1.0)
    cycles = reversals(channel, 1.0)
    cycles = cycles[: cycles.size // 2 * 2].reshape(-1, 2)
    slope, covariance = np.polyfit(
        time[cycles].mean(axis=1), channel[cycles].mean(axis=1), 1, cov=True
    )
    assert found.value == approx(slope[0], rel=1e-9)
    assert found.standard_error == approx(math.sqrt(covariance[0, 0]), rel=1e-9)


@mark.parametrize("width", [0.0, 0.05, 0.3])
def test_backlash_of_an_even_motion_is_removed_exactly(width):
    time = np.arange(0, 16.6, 0.01)
    motion = triangle(time)
    reading = played(motion, width)
    found = remove_backlash(time, reading, width)
    # how long the reading rests is known to a sample at either end
    assert found == approx(motion, abs=0.02 + 1e-12)
    moving = np.abs(np.abs(found - reading) - width / 2) < 1e-12
    moving[1:-1] &= moving[2:] & moving[:-2]
    assert moving.sum() > 1_000
    assert found[moving] == approx(motion[moving], abs=1e-12)


def test_backlash_under_noise_is_removed_within_the_dead_band():
    time = np.arange(0, 16.6, 0.01)
    motion = triangle(time)
    noisy = played(motion, 0.3) + np.random.default_rng(4).uniform(-0.01, 0.01, time.size)
    found = remove_backlash(time, noisy, 0.3, dead_band=0.04)
    assert np.abs(found - motion).max() < 0.01 + 0.04 + 0.02
    assert np.abs(noisy - motion).max() > 0.14


@given(
    st.lists(st.floats(-1, 1), min_size=1, max_size=30).map(np.array),
    st.floats(0, 3),
    st.floats(0.01, 0.5),
)
def test_free_play_in_series_is_removed(load, width, closing_load):
    contact = np.linspace(-5, 5, load.size)
    spring = width / (2 * closing_load)
    clearance = [min(max(force * spring, -width / 2), width / 2) for force in load]
    found = remove_free_play(contact + clearance, load, width, closing_load=closing_load)
    assert found == approx(contact, abs=1e-13)
    assert remove_free_play(contact + width / 2 * np.sign(load), load, width) == approx(
        contact, abs=1e-13
    )
