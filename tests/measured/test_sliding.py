"""Sliding one way: static peak, windows and running-in of records that were made with known ones."""

from html import escape
from itertools import pairwise

import attrs
import numpy as np
import pytest
from numpy.testing import assert_allclose

import historysim as hs
from historysim.errors import InputError
from historysim.measured.measurement import Measurement
from historysim.measured.sliding import Sliding, sliding_of_channels, sliding_of_history, sliding_of_measurement
from historysim.results.plots.friction_trace import plot_sliding

STEADY, START, LENGTH, PEAK = 0.4, 0.5, 2e-3, 0.65
PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)


def made(noise=0.0, seed=0, *, peak=PEAK, steady=STEADY, start=START, length=LENGTH, size=4001, way=10e-3):
    """Rise within 20 µm, a peak that falls within 5 µm, and an exponential approach; N = 2 N, 1 mm/s."""
    random = np.random.default_rng(seed)
    u = np.linspace(0, way, size)
    bent = 20e-6
    friction = steady + (start - steady) * np.exp(-(u - bent) / length)
    friction += (peak - start) * np.exp(-(u - bent) / 5e-6) if peak else 0.0
    friction = np.where(u < bent, (peak or start) * u / bent, friction)
    normal = np.full(size, 2.0)
    return u / 1e-3, normal * (friction + noise * random.normal(size=size)), normal, u


def test_what_a_record_was_made_with_is_found():
    found = sliding_of_channels(*made(noise=0.002))
    assert found.over == "distance"
    assert found.peak.coefficient == pytest.approx(PEAK, abs=found.peak.lifted)
    assert found.peak.place == pytest.approx(20e-6, abs=3e-6)
    approach = found.approach
    assert approach.steady_low < STEADY < approach.steady_high
    assert approach.start_low < START < approach.start_high
    assert approach.length_low < LENGTH < approach.length_high
    assert approach.length_high - approach.length_low < 0.2 * LENGTH
    assert approach.settled
    over_time = sliding_of_channels(*made(noise=0.002), over="time")
    assert over_time.approach.length == pytest.approx(LENGTH / 1e-3, rel=0.05)


def test_intervals_hold_the_truth_in_95_of_100():
    held = np.zeros(3)
    for seed in range(200):
        found = sliding_of_channels(*made(0.01, seed, peak=None, size=1001)).approach
        held += (
            found.steady_low <= STEADY <= found.steady_high,
            found.start_low <= START <= found.start_high,
            found.length_low <= LENGTH <= found.length_high,
        )
    # four standard deviations of a binomial count
    assert (np.abs(held - 190) < 4 * np.sqrt(200 * 0.95 * 0.05)).all(), held


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


def test_what_is_not_there_is_not_found():
    plain = sliding_of_channels(*made(noise=0.002, peak=None, start=STEADY))
    assert (plain.peak, plain.approach) == (None, None)
    lines = dict(plain.summary())
    assert lines["static peak"] == "none that stands above the noise"
    assert lines["steady value"] == "no approach to one that the windows show"
    running_in = sliding_of_channels(*made(noise=0.002, peak=None))
    assert running_in.peak is None
    assert running_in.approach.start == pytest.approx(START, abs=0.003)


def test_a_steady_value_beyond_the_record_is_said_to_be():
    found = sliding_of_channels(*made(noise=1e-4, peak=None, length=8e-3))
    assert not found.approach.settled
    assert "beyond the record, which is shorter than two lengths" in dict(found.summary())["steady value"]


def test_the_other_way_and_without_a_displacement():
    time, load, normal, u = made(noise=0.002)
    there = sliding_of_channels(time, load, normal, u)
    back = sliding_of_channels(time, -load, normal, 3.0 - u)
    assert_allclose(back.window_mean, there.window_mean, rtol=1e-9)
    alone = sliding_of_channels(time, -load, normal)
    assert alone.over == "time"
    assert_allclose(alone.window_mean, there.window_mean, rtol=0.01)


def test_a_course_is_written_and_replayed(tmp_path):
    """What was found is the friction of a replay, whose friction is found again."""
    from historysim.loads.friction_course import FrictionCourse

    found = sliding_of_channels(*made(peak=None))
    course = FrictionCourse("distance", found.window_place, found.window_mean)
    events = [hs.NormalLoad(0.0, 2.0)]
    events += [hs.TangentialDisplacement(float(i), float(u)) for i, u in enumerate(np.linspace(0, 10e-3, 401)[1:], 1)]
    history = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-3, 0.5), course.along(events), record="totals")
    again = sliding_of_history(history)
    assert again.approach.steady == pytest.approx(STEADY, abs=0.005)
    assert again.approach.length == pytest.approx(LENGTH, rel=0.05)
    found.to_dataset().to_netcdf(tmp_path / "mu.nc")
    (tmp_path / "s.toml").write_text(
        '[materials]\ncontact_modulus = 1e11\nshear_modulus = 2e10\n[surface]\nkind = "sphere"\nradius = 1e-3\n'
        '[friction]\ncoefficient = 0.5\n[friction.course]\nfile = "mu.nc"\n'
        'columns = { distance = "distance", coefficient = "coefficient" }\n'
        '[loading]\nwaypoints = [{ time = 0, normal_load = 2 }, { time = 1, tangential_displacement = "9.9 mm" }]\n',
        encoding="utf-8",
    )
    changes = [event.friction for event in hs.load(tmp_path / "s.toml").events() if event.name == "friction"]
    assert_allclose(changes, found.window_mean[[0, -1]], rtol=1e-12)


@pytest.mark.parametrize(("noise", "over", "windows"), [(0.002, "distance", 50), (0.5, "time", 50), (0.002, None, 1)])
def test_its_dataset_tells_all_but_the_samples(noise, over, windows):
    found = sliding_of_channels(*made(noise=noise), over=over, windows=windows)
    found = attrs.evolve(found, remarks=(("left out", "2 rows: empty"), ("note", "clock")))
    read = Sliding.from_dataset(found.to_dataset())
    assert read.summary() == found.summary()
    assert (read.peak, read.approach, read.remarks) == (found.peak, found.approach, found.remarks)
    assert np.array_equal(read.window_mean, found.window_mean)
    # the samples are not drawn as something else
    labels = [line.get_label() for line in plot_sliding(read).axes[0].lines]
    assert "samples" not in labels
    assert "windows" in labels
    page = hs.report(read)
    for label, text in found.summary():
        assert label in page
        assert escape(text) in page


def test_what_is_no_friction_course_is_refused():
    with pytest.raises(hs.InputError, match="is no friction over time or distance"):
        Sliding.from_dataset(sliding_of_channels(*made()).to_dataset().assign_attrs(content="sweep"))


def test_the_picture_shows_samples_windows_peak_and_approach():
    found = sliding_of_channels(*made(noise=0.002))
    figure = plot_sliding(found, title="of $5")
    (axes,) = figure.axes
    lines = {line.get_label(): line for line in axes.get_lines()}
    assert_allclose(lines["windows"].get_ydata(), found.window_mean)
    assert_allclose(lines["windows"].get_xdata(), 1e3 * found.window_place)
    assert lines["static peak"].get_ydata()[0] == found.peak.coefficient
    assert lines["approach"].get_ydata()[-1] == pytest.approx(STEADY, abs=0.01)
    assert axes.get_xlabel() == "distance (mm)"
    assert figure.get_suptitle() == r"of \$5"
    assert [axes.get_title(loc="left") for axes in hs.plot(found).axes] == ["Friction coefficient"]


TIME, LOAD, NORMAL, WAY = made(size=101)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: sliding_of_channels(TIME, LOAD, NORMAL, np.abs(WAY - 5e-3)),
            r"turns back at t = 5 s; expected sliding one way: loops are what",
        ),
        (lambda: sliding_of_channels(TIME, LOAD, NORMAL, 0 * WAY), "displacement rests; expected one that slides"),
        (lambda: sliding_of_channels(TIME, LOAD, -NORMAL, WAY), "presses at no sample"),
        (lambda: sliding_of_channels(TIME, LOAD, NORMAL, over="distance"), "displacement was not measured"),
        (lambda: sliding_of_channels(TIME, LOAD, NORMAL, over="load"), "over is 'load'; expected 'time' or 'distance'"),
        (lambda: sliding_of_channels(TIME, LOAD, NORMAL, windows=2.5), "windows is 2.5; expected a whole number"),
        (lambda: sliding_of_channels(TIME, LOAD, NORMAL, windows=0), "windows"),
        (lambda: sliding_of_channels(TIME[:5], LOAD, NORMAL), "time has 5 samples; expected 101"),
        (
            lambda: sliding_of_measurement(Measurement(TIME, {"normal_load": NORMAL})),
            "the record has no tangential_load",
        ),
        (lambda: hs.sliding(3.0), "3.0: cannot be evaluated"),
    ],
)
def test_bad_input_is_explained(call, said):
    with pytest.raises(hs.InputError, match=said):
        call()


# -- a displacement that rests ---------------------------------------------------------------------


@pytest.mark.parametrize("noise", [0.0, 1e-7])
def test_over_time_a_displacement_that_rests_is_not_needed(noise):
    """A rotating disc: the position of the arm is recorded, and rests."""
    random = np.random.default_rng(0)
    time = np.arange(500.0)
    load = 0.6 + random.normal(0, 0.01, 500)
    moved = 3e-3 + random.normal(0, 1, 500) * noise
    with pytest.raises(InputError, match="the tangential displacement rests; expected one that slides, or --over time"):
        sliding_of_channels(time, load, np.ones(500), moved)
    found = sliding_of_channels(time, load, np.ones(500), moved, over="time")
    assert found.window_mean.mean() == pytest.approx(0.6, rel=0.01)
    assert sliding_of_channels(time, -load, np.ones(500), moved, over="time").window_mean.mean() > 0.5
