"""Sliding one way: static peak, windows and running-in of records that were made with known ones."""

import re
from itertools import pairwise

import attrs
import numpy as np
from numpy.testing import assert_allclose
from pairs import STIFF as PAIR
from pytest import approx, mark, raises

import historysim as hs
from historysim.errors import InputError
from historysim.measured.sliding import Sliding, sliding_of_channels, sliding_of_history

STEADY, START, LENGTH, PEAK = 0.4, 0.5, 2e-3, 0.65


def made(
    noise=0.0, seed=0, *, peak=PEAK, steady=STEADY, start=START, length=LENGTH, size=4001, way=10e-3
):
    """Rise within 20 µm, a peak that falls within 5 µm, and an exponential approach; N = 2 N, 1 mm/s."""
    random = np.random.default_rng(seed)
    u = np.linspace(0, way, size)
    bent = 20e-6
    friction = steady + (start - steady) * np.exp(-(u - bent) / length)
    friction += (peak - start) * np.exp(-(u - bent) / 5e-6) if peak else 0.0
    friction = np.where(u < bent, (peak or start) * u / bent, friction)
    normal = np.full(size, 2.0)
    return u / 1e-3, normal * (friction + noise * random.normal(size=size)), normal, u


def test_known_parameters_are_recovered():
    found = sliding_of_channels(*made(noise=0.002))
    assert found.over == "distance"
    assert found.peak.coefficient == approx(PEAK, abs=found.peak.lifted)
    assert found.peak.place == approx(20e-6, abs=3e-6)
    approach = found.approach
    assert approach.steady_low < STEADY < approach.steady_high
    assert approach.start_low < START < approach.start_high
    assert approach.length_low < LENGTH < approach.length_high
    assert approach.length_high - approach.length_low < 0.2 * LENGTH
    assert approach.settled
    over_time = sliding_of_channels(*made(noise=0.002), over="time")
    assert over_time.approach.length == approx(LENGTH / 1e-3, rel=0.05)


def held(found, steady, start, length):
    """Return how many intervals hold the truth; of the start, at the place where each begins."""
    begins = [steady + (start - steady) * np.exp(-each.origin / length) for each in found]
    truths = {"steady": [steady] * len(found), "start": begins, "length": [length] * len(found)}
    return np.array(
        [
            sum(
                getattr(each, f"{name}_low") <= one <= getattr(each, f"{name}_high")
                for each, one in zip(found, of, strict=True)
            )
            for name, of in truths.items()
        ]
    )


def four_deviations(count):
    """Return four standard deviations of how many of so many intervals of 95 % hold the truth."""
    return 4 * np.sqrt(count * 0.95 * 0.05)


SIZE = 1001
WAY_MM = np.linspace(0, 10, SIZE)
EXPONENTIAL = STEADY + (START - STEADY) * np.exp(-WAY_MM / 2)


def white(random, deviation=0.01):
    return deviation * random.normal(size=SIZE)


def correlated(random, neighbours, deviation=0.01):
    from scipy.signal import lfilter

    return (
        deviation
        * lfilter([np.sqrt(1 - neighbours**2)], [1, -neighbours], random.normal(size=SIZE + 500))[
            500:
        ]
    )


def spiked(friction, random):
    """Give 2 % of the samples spikes of 50 %."""
    return np.where(random.random(SIZE) < 0.02, 1.5 * friction, friction)


def late(friction, rests):
    return np.concatenate([np.zeros(rests), friction[: SIZE - rests]])


def evaluated(made_of, seed, *, over_time=False):
    load = 2 * made_of(np.random.default_rng(seed))
    return sliding_of_channels(
        WAY_MM, load, np.full(SIZE, 2.0), None if over_time else 1e-3 * WAY_MM
    )


@mark.parametrize(
    "made_of, over_time",
    [
        (lambda random: spiked(EXPONENTIAL + white(random), random), False),
        (lambda random: EXPONENTIAL + correlated(random, 0.8), False),
        (lambda random: -(EXPONENTIAL + white(random)), True),
        (lambda random: late(EXPONENTIAL, 100) + white(random), True),
    ],
    ids=["spikes", "correlated noise", "negative raw sign", "rig starts late"],
)
def test_intervals_hold_the_truth_in_disturbed_records(made_of, over_time):
    count, unit = 30, 1 if over_time else 1e-3
    sliding = [evaluated(made_of, seed, over_time=over_time) for seed in range(count)]
    found = [each.approach for each in sliding if each.approach is not None]
    # spikes and correlated noise are no static peaks
    assert sum(each.peak is not None for each in sliding) <= 2
    assert len(found) >= 0.95 * count
    inside = held(found, STEADY, START, 2 * unit)
    # the rig that starts late slides from where its record begins, which noise moves by a sample
    checked = inside if not sliding[0].remarks or not over_time else inside[[0, 2]]
    assert (np.abs(checked - 0.95 * len(found)) <= four_deviations(len(found))).all()


@mark.parametrize(
    "made_of, over_time, reason",
    [
        (lambda random: 0.4 + white(random), False, "no better than a constant"),
        (
            lambda random: 0.5 - 0.01 * WAY_MM + white(random),
            False,
            "no better than a (straight line|constant)",
        ),
        (
            lambda random: 0.4 + 0.1 / (1 + WAY_MM) + white(random, 0.003),
            False,
            "stray|slower decay",
        ),
        (lambda random: 0.4 + correlated(random, 0.98), False, "no better than|stray"),
        (
            lambda random: (
                np.where(WAY_MM < 0.8, 0.4 * (1 - np.maximum(1 - WAY_MM / 0.8, 0) ** 1.5), 0.4)
                + white(random)
            ),
            False,
            "stray|comes from 0|no better than",
        ),
    ],
    ids=["constant", "line", "power law", "wander", "soft rig"],
)
def test_other_courses_are_not_reported_as_exponential(made_of, over_time, reason):
    for seed in range(2):
        found = evaluated(made_of, seed, over_time=over_time)
        assert found.approach is None
        assert re.search(reason, found.no_approach)
        assert dict(found.summary())["steady value"].startswith("no running-in of this form: ")


def test_a_rig_that_starts_late_is_left_out_until_then():
    found = evaluated(lambda random: late(EXPONENTIAL, 230) + white(random), 0, over_time=True)
    assert found.place[0] == approx(2.3, abs=0.03)
    assert ("left out", "the first 2.3 s, in which the rig rests") in found.remarks
    # over the known displacement, too, and low friction of a coating is no rest
    moved = 1e-3 * np.maximum(WAY_MM - 2.3, 0)
    load = late(EXPONENTIAL, 230)
    known = sliding_of_channels(WAY_MM, load, np.ones(SIZE), moved, over="time")
    assert known.place[0] == approx(2.3, abs=0.03)
    coated = np.where(WAY_MM < 6, 0.05, 0.6)
    assert sliding_of_channels(WAY_MM, coated, np.ones(SIZE)).remarks == ()


def test_windows_are_means_along_the_displacement():
    time, load, normal, u = made()
    # a rest in the middle, of as many samples again, at which the load creeps down
    rest = np.full(3000, u[2000])
    u = np.concatenate([u[:2000], rest, u[2000:]])
    load = np.concatenate([load[:2000], np.linspace(load[2000], 0.5, 3000), load[2000:]])
    normal, time = np.full(u.size, 2.0), np.arange(float(u.size))
    found = sliding_of_channels(time, load, normal, u, windows=10)
    clean = sliding_of_channels(*made(), windows=10)
    edges = np.linspace(0, 10e-3, 11)
    _, exact, *_ = made(size=100_001)
    way, friction = np.linspace(0, 10e-3, 100_001), exact / 2
    by_hand = [friction[(way >= a) & (way <= b)].mean() for a, b in pairwise(edges)]
    assert_allclose(clean.window_mean, by_hand, rtol=2e-3)
    # but for one step, where the rest ends
    assert_allclose(found.window_mean, clean.window_mean, rtol=2e-3)
    assert found.window_count.sum() == u.size


def test_a_course_is_written_and_replayed(tmp_path):
    """What was found is the friction of a replay, whose friction is found again."""
    from historysim.loads.friction_course import FrictionCourse

    found = sliding_of_channels(*made(peak=None))
    course = FrictionCourse(distance=found.window_place, coefficient=found.window_mean)
    events = [hs.NormalLoad(0.0, 2.0)]
    events += [
        hs.TangentialDisplacement(float(i), float(u))
        for i, u in enumerate(np.linspace(0, 10e-3, 401)[1:], 1)
    ]
    history = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-3, 0.5), course.along(events), record="totals")
    again = sliding_of_history(history)
    assert again.approach.steady == approx(STEADY, abs=0.005)
    assert again.approach.length == approx(LENGTH, rel=0.05)
    found.to_dataset().to_netcdf(tmp_path / "mu.nc")
    (tmp_path / "s.toml").write_text(
        '[materials]\ncontact_modulus = 1e11\nshear_modulus = 2e10\n[surface]\nkind = "sphere"\nradius = 1e-3\n'
        '[friction]\ncoefficient = 0.5\n[friction.course]\nfile = "mu.nc"\n'
        'columns = { distance = "distance", coefficient = "coefficient" }\n'
        '[loading]\nwaypoints = [{ time = 0, normal_load = 2 }, { time = 1, tangential_displacement = "9.9 mm" }]\n',
        encoding="utf-8",
    )
    changes = [
        event.friction
        for event in hs.load(tmp_path / "s.toml").events()
        if event.name == "friction"
    ]
    assert_allclose(changes, found.window_mean[[0, -1]], rtol=1e-12)


@mark.parametrize("noise, over, windows", [(0.002, "distance", 50), (0.5, "time", 1)])
def test_its_dataset_holds_all_but_the_samples(noise, over, windows):
    found = sliding_of_channels(*made(noise=noise), over=over, windows=windows)
    found = attrs.evolve(found, remarks=(("left out", "2 rows: empty"), ("note", "clock")))
    read = Sliding.from_dataset(found.to_dataset())
    assert read.summary() == found.summary()
    assert (read.peak, read.approach, read.remarks) == (found.peak, found.approach, found.remarks)
    assert np.array_equal(read.window_mean, found.window_mean)
    # the samples are not drawn as something else
    labels = [line.get_label() for line in hs.plots.sliding(read).axes[0].lines]
    assert "samples" not in labels
    assert "windows" in labels


# -- a displacement that rests ---------------------------------------------------------------------


@mark.parametrize("noise", [0.0, 1e-7])
def test_over_time_a_displacement_that_rests_is_not_needed(noise):
    """A rotating disc: the position of the arm is recorded, and rests."""
    random = np.random.default_rng(0)
    time = np.arange(500.0)
    load = 0.6 + random.normal(0, 0.01, 500)
    moved = 3e-3 + random.normal(0, 1, 500) * noise
    with raises(InputError, match="the tangential displacement rests"):
        sliding_of_channels(time, load, np.ones(500), moved)
    found = sliding_of_channels(time, load, np.ones(500), moved, over="time")
    assert found.window_mean.mean() == approx(0.6, rel=0.01)
    assert (
        sliding_of_channels(time, -load, np.ones(500), moved, over="time").window_mean.mean() > 0.5
    )


def test_peak_strength_is_found_anywhere():
    """Direct shear: T/N rises to 0.7 at 1.5 mm, and softens to 0.5; the normal load varies."""
    u = np.linspace(0, 6e-3, 601)
    ratio = np.where(
        u < 1.5e-3, 0.7 * np.sin(np.pi * u / 3e-3), 0.5 + 0.2 * np.exp(-(u - 1.5e-3) / 1e-3)
    )
    normal = 100 + 2e4 * u
    found = sliding_of_channels(u / 1e-5, ratio * normal, normal, u)
    # the largest load is at the end of the record
    assert (ratio * normal).argmax() != 150
    assert found.strength.coefficient == approx(0.7, abs=1e-3)
    assert found.strength.place == approx(1.5e-3, abs=1e-5)
    assert dict(found.summary())["peak strength"].startswith("T/N = 0.7 at 1.5 mm")
    assert Sliding.from_dataset(found.to_dataset()).strength == found.strength
    # a static peak is the peak strength, and is printed once
    assert "peak strength" not in dict(sliding_of_channels(*made()).summary())


@mark.parametrize(
    "rows, value", [([600], 180.0), ([0], 180.0), ([1199], -180.0), ([300, 301, 900], 50.0)]
)
def test_rows_that_are_far_off_are_named_and_left_out(rows, value):
    time = np.arange(1200.0)
    friction = (
        0.5 + 0.1 * np.exp(-time / 200) + np.random.default_rng(0).normal(0, 0.005, time.size)
    )
    sound = sliding_of_channels(time, friction, np.ones(1200))
    assert "outliers" not in dict(sound.summary())
    friction[rows] = value
    found = sliding_of_channels(time, friction, np.ones(1200))
    text = dict(found.summary())["outliers"]
    assert f"T/N = {value:g} at t = " in text
    assert float(re.search(r"median is ([\d.]+)", text)[1]) == approx(np.median(friction), rel=1e-3)
    assert_allclose(found.window_mean, sound.window_mean, atol=2e-3)
    assert found.approach.steady == approx(sound.approach.steady, abs=1e-3)
    assert found.strength.coefficient < 0.7
