"""Loops in groups: their statistics against those by hand, and laws against those they were made with."""

from itertools import pairwise

import numpy as np
from numpy.testing import assert_allclose
from pytest import approx
from scipy import stats

from historysim.measured.loop_table import energy_law, same_amplitude, same_load, straight_line
from historysim.measured.loops import loops_of_channels


def made(loads, amplitudes=(1.0,), offset=0.0, exponent=0.0, scatter=0.0, seed=3, loops=3):
    """Loops of Coulomb friction F = 0.2 N^(1 + exponent) + offset behind a spring, some at each load."""
    random = np.random.default_rng(seed)
    pieces = []
    for load in loads:
        for amplitude in amplitudes:
            for _ in range(loops):
                force = (0.2 * load ** (1 + exponent) + offset) * (1 + scatter * random.normal())
                # one loop from -A to A and back, with sliding after a twentieth of the way
                turns = np.array([-1.0, -0.9, 1.0, 0.9, -1.0]) * amplitude
                u = np.concatenate(
                    [np.linspace(a, b, 20, endpoint=False) for a, b in pairwise(turns)]
                )
                t = np.interp(
                    np.arange(u.size), [0, 20, 40, 60, 80], force * np.array([-1, 1, 1, -1, -1])
                )
                pieces.append((u, t, np.full(u.size, load)))
    u, t, normal = (
        np.append(np.concatenate(each), each[0][0]) for each in zip(*pieces, strict=True)
    )
    return loops_of_channels(np.arange(float(u.size)), u, t, normal, dead_band=0.01)


def test_statistics_of_each_load_equal_direct_ones():
    found = made([1.0, 3.0, 2.0], scatter=0.05)
    table = found.by_load()
    assert set(table.to_dataset().friction_force.dims) == {"level", "direction"}
    # the sample at which one load ends and the next one begins is of both
    assert_allclose(table.value, [1, 2, 3], rtol=0.01)
    for group, load in enumerate(table.value):
        taken = np.abs(np.nanmean(found.normal_load, axis=1) - load) < 0.5
        for direction, values in (
            ("forward", found.friction_force[taken, 0]),
            ("backward", found.friction_force[taken, 1]),
            ("both", found.friction_force[taken].mean(axis=1)),
        ):
            known = values[np.isfinite(values)]
            one = table.statistics("friction_force", direction)[group]
            assert one.count == known.size > 1
            assert_allclose([one.mean, one.standard_deviation], [known.mean(), known.std(ddof=1)])


def test_known_laws_are_recovered():
    table = made([1.0, 2.0, 4.0, 8.0], offset=0.05).by_load()
    line = table.friction_line()
    assert_allclose([line.slope, line.intercept], [0.2, 0.05], rtol=1e-9)
    assert made([1.0, 2.0, 4.0], exponent=-1 / 3).by_load().power_law(
        "friction_coefficient"
    ).exponent == approx(-1 / 3, abs=1e-9)
    texts = dict(table.laws())
    assert texts["friction over load"].startswith(
        "F = 0.2 × load + 50 mN (95 %: 0.2 to 0.2; 50 mN to 50 mN), through"
    )
    assert made([1.0]).by_load().laws() == []
    two = made([1.0, 2.0]).by_load()
    assert two.laws()[0][1].endswith("through the means at 2 loads, which give no interval")
    assert np.isnan(two.friction_line().slope_low)


def test_a_straight_line_by_another_way():
    random = np.random.default_rng(4)
    x, y = np.linspace(1, 2, 7), random.normal(size=7)
    (slope, intercept), covariance = np.polyfit(x, y, 1, cov=True)
    reach = stats.t.ppf(0.975, 5) * np.sqrt(np.diag(covariance))
    line = straight_line(x, y)
    assert_allclose(
        [line.slope_low, line.slope_high], [slope - reach[0], slope + reach[0]], rtol=1e-9
    )
    assert_allclose(
        [line.intercept_low, line.intercept_high],
        [intercept - reach[1], intercept + reach[1]],
        rtol=1e-9,
    )


def test_small_loops_are_kept_out_of_means_and_have_a_class_of_their_own():
    found = made([1.0], amplitudes=(1.0, 0.001, 0.3), loops=2)
    assert found.large.tolist() == (found.amplitude >= 0.5).tolist()
    assert 0 < found.large.sum() < len(found)
    kept = found.friction_force[found.large].mean(axis=1)
    assert found.statistics("friction_force").mean == approx(np.nanmean(kept))
    assert found.statistics("friction_force").count == found.large.sum()
    assert dict(found.summary())["values"].startswith(
        "mean ± standard deviation of one loop, those of 0.5 of the larg"
    )
    table = found.by_amplitude()
    assert sum(members.size for members in table.members) == len(found)
    assert np.diff(table.value).min() > 0
    for members in table.members:
        assert np.ptp(np.log2(found.amplitude[members])) <= 1 + 1e-6
    assert table.laws() == []


def test_loads_and_amplitudes_are_grouped():
    assert same_load(np.array([50.0, 53.0, 70.0, np.nan, 49.9, 90.0]), 0.1).tolist() == [
        0,
        0,
        1,
        -1,
        0,
        2,
    ]
    # a slow rise is cut wherever it has gone by the share: the logarithm of 2 over that of 1/0.9 is
    # 6.6
    assert same_load(np.linspace(1, 2, 101), 0.1).max() == 6
    assert same_amplitude(np.array([1.0, 0.51, 0.5, 0.1, 0.26])).tolist() == [2, 2, 2, 0, 1]


def test_energy_is_a_power_of_the_amplitude():
    """Over amplitudes: 3 in partial slip with small amplitudes, and with the scatter of a linear regression."""
    random = np.random.default_rng(8)
    amplitude = np.repeat([1e-6, 2e-6, 4e-6, 8e-6], 3)
    energy = 5e9 * amplitude**2.6 * np.exp(0.05 * random.normal(size=amplitude.size))
    law, count = energy_law(amplitude, energy)
    means = energy.reshape(-1, 3).mean(axis=1)
    by_hand = stats.linregress(np.log(amplitude[::3]), np.log(means))
    reach = stats.t.ppf(0.975, 2) * by_hand.stderr
    assert count == 4
    assert_allclose(
        [law.exponent, law.exponent_low, law.exponent_high],
        by_hand.slope + reach * np.array([0, -1, 1]),
    )
    assert energy_law(amplitude[:6], energy[:6]) is None
    assert energy_law(amplitude * 0 + 1e-6, energy) is None


def test_summary_and_files_have_the_power_of_the_energy():
    # E = 4 F (A - elastic part), and the elastic part is a share of A: the exponent is 1
    found = made([1.0], amplitudes=(1.0, 0.5, 0.25, 0.125), loops=2)
    text = dict(found.summary())["energy over amplitude"]
    exponent = float(text.removeprefix("proportional to the power ").split()[0])
    # where the amplitude changes, a loop is not whole: the classes of energies are off by some
    # percent
    assert exponent == approx(1, abs=0.1)
    assert text.endswith("amplitudes")
    assert found.to_dataset().attrs["energy_over_amplitude_exponent"] == approx(exponent, abs=1e-3)
    assert "energy over amplitude" not in dict(
        made([1.0, 2.0], amplitudes=(1.0, 0.5, 0.25)).summary()
    )
