"""Filters against their closed forms, and hum that is found where there is some and nowhere else."""

import numpy as np
import synthetic
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, mark

from historysim.measured.correction import find_hum, low_pass, notch, running_median

RATE = 500.0
TIME = np.arange(4000) / RATE
INSIDE = slice(1000, -1000)


def sine(frequency, amplitude=1.0):
    return amplitude * np.sin(2 * np.pi * frequency * TIME + 0.4)


def triangle(speed=1.0):
    return speed * np.abs((TIME - 0.7) % 4 - 2)


def test_a_notch_takes_its_frequency_off_and_leaves_the_rest():
    found = notch(TIME, triangle() + sine(50) + sine(20, 0.1), 50.0)
    # a turn has v/(2π f)² of its speed's change at a frequency, over its width of f/Q
    ringing = 2 * 2 / (2 * np.pi * 50) / 30
    assert np.abs(found - triangle() - sine(20, 0.1))[INSIDE].max() < ringing


@mark.parametrize("frequency", [5.0, 20.0, 60.0])
def test_a_low_pass_has_the_gain_of_butterworth_twice_and_no_phase(frequency):
    """|H|² of order 2 is 1/(1 + r⁴), with the frequencies of the bilinear transform."""
    ratio = np.tan(np.pi * frequency / RATE) / np.tan(np.pi * 20 / RATE)
    assert_allclose(
        low_pass(TIME, sine(frequency), 20.0)[INSIDE],
        sine(frequency)[INSIDE] / (1 + ratio**4),
        atol=1e-6,
    )


def test_a_median_takes_spikes_off_and_leaves_turns():
    spoilt = triangle()
    spoilt[[100, 101, 900, 3999]] += [3, -4, 5, 2]
    found = running_median(spoilt, 5)
    step = 1 / RATE
    assert np.abs(found - triangle()).max() <= 2 * step
    assert_array_equal(running_median(np.sign(sine(1)), 5), np.sign(sine(1)))


def noise(seed, size=0.1):
    return np.random.default_rng(seed).normal(0, size, TIME.size)


def test_hum_is_found_with_its_frequency_and_amplitude():
    (found,) = find_hum(TIME, triangle() + noise(0) + sine(50.1, 0.1), dead_band=1.0)
    # between the turns 800 samples each: the amplitude of a line is known to √(2/n) of the noise,
    # its frequency better than to a tenth of a bin of the pieces
    assert found.amplitude == approx(0.1, abs=4 * 0.1 * np.sqrt(2 / 3200))
    assert found.frequency == approx(50.1, abs=0.1 * RATE / 800)
    both = find_hum(TIME, triangle() + noise(0) + sine(50, 0.1) + sine(150, 0.2), dead_band=1.0)
    assert [round(each.frequency) for each in both] == [150, 50]
    # beyond half of the sampling rate it is seen folded back
    (folded,) = find_hum(TIME, triangle() + noise(1) + sine(450, 0.2), dead_band=1.0)
    assert round(folded.frequency) == 50


def test_noise_and_turns_are_not_hum():
    assert not any(find_hum(TIME, triangle() + noise(seed), dead_band=1.0) for seed in range(40))
    for seed, size in ((0, 0.0), (1, 1.0)):
        record = synthetic.measured("ball", seed, rate=100.0, loads=(0.05,), noise=size)
        for name in ("tangential_displacement", "tangential_load"):
            assert find_hum(record.time, record[name], dead_band=0.2 * np.ptp(record[name])) == ()
    # an uneven clock, and branches too short to say
    assert find_hum(np.sqrt(TIME), sine(50), dead_band=3.0) == ()
    assert find_hum(TIME[:50], sine(50)[:50], dead_band=3.0) == ()
