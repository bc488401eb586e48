"""Range pairs: the rainflow count against another library, and what it says about the memory of a contact."""

from itertools import pairwise

import numpy as np
import pytest
import rainflow
from hypothesis import given, settings
from hypothesis import strategies as st

import historysim as hs
from historysim.contact import mindlin
from historysim.measured.range_pairs import range_pairs
from historysim.measured.reduction import turning_points

sequences = st.lists(st.integers(-20, 20), min_size=1, max_size=60).map(np.array)
# the other library multiplies differences, which must not underflow
rough = st.lists(st.floats(-1, 1, width=16), min_size=1, max_size=60).map(np.array)


def as_rows(found, values):
    return list(zip(found.range, found.mean, found.count, values[found.start], values[found.end], strict=True))


@settings(max_examples=300)
@given(st.one_of(sequences, rough))
def test_another_library_counts_the_same_cycles(values):
    # the first sample twice, since it counts nothing in two samples; and it counts swings of zero
    doubled = [values[0], *values]
    expected = [row for row in rainflow.extract_cycles(doubled) if row[0] > 0]
    assert as_rows(range_pairs(values), values) == [
        (size, mean, count, doubled[i], doubled[j]) for size, mean, count, i, j in expected
    ]


def test_the_example_of_the_standard():
    # ASTM E1049-85, figure 6: points A to I
    found = range_pairs([-2, 1, -3, 5, -1, 3, -4, 4, -2])
    assert found.range.tolist() == [3, 4, 4, 8, 9, 8, 6]
    assert found.count.tolist() == [0.5, 0.5, 1, 0.5, 0.5, 0.5, 0.5]
    assert found.mean.tolist() == [-0.5, -1, 1, 1, 0.5, 0, 1]
    assert list(zip(found.start.tolist(), found.end.tolist(), strict=True)) == [
        (0, 1), (1, 2), (4, 5), (2, 3), (3, 6), (6, 7), (7, 8),
    ]  # fmt: skip
    assert found.residue.tolist() == [0, 1, 2, 3, 6, 7, 8]


@pytest.mark.parametrize("values", [[1.0], [1.0, 1.0], [2, 2, 2]])
def test_what_does_not_move_has_no_cycles(values):
    found = range_pairs(values)
    assert found.range.size == found.residue.size == 0


@given(sequences, st.integers(1, 10))
def test_the_dead_band_leaves_out_cycles_that_are_smaller(values, dead_band):
    kept = turning_points(values, dead_band)
    assert as_rows(range_pairs(values, dead_band=dead_band), values) == as_rows(range_pairs(values[kept]), values[kept])
    for start, end in pairwise(kept):
        if abs(values[end] - values[start]) >= dead_band:
            *dropped, swing = sorted(range_pairs(values[start : end + 1]).range)
            assert swing == abs(values[end] - values[start])
            assert max(dropped, default=0) < dead_band


def test_a_large_value_has_a_mean():
    found = range_pairs([1e308, 1.5e308, 0.0])
    assert found.mean.tolist() == [1.25e308, 0.75e308]


def test_bad_input_is_explained():
    with pytest.raises(hs.InputError, match="values misses 1 of 2 samples"):
        range_pairs([0, np.nan])
    with pytest.raises(hs.InputError, match="dead_band is -1"):
        range_pairs([0, 1], dead_band=-1)


# ---------------------------------------------------------------- memory

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
NORMAL_LOAD = 0.01
SPHERE = hs.Ensemble(PAIR, 0.0, 1.0, 0.5)
CONTACT = {
    "normal_load": NORMAL_LOAD,
    "contact_radius": float(np.sqrt(SPHERE.approach_at(NORMAL_LOAD))),
    "shear_modulus": 0.25,
    "friction": 0.5,
}
SLIDE = float(mindlin.preliminary_displacement(**CONTACT))


def replayed(displacements):
    events = [hs.NormalLoad(0.0, NORMAL_LOAD)]
    events += [hs.TangentialDisplacement(1.0 + i, float(value)) for i, value in enumerate(displacements)]
    history = hs.replay(SPHERE, events, record="totals")
    return history.total_tangential_load.values[-1], history.total_dissipated_energy.values[-1]


def loop_energy(size):
    """Return the energy of a closed loop of a range of displacement, by the closed forms."""
    limit = 0.5 * NORMAL_LOAD
    if size >= 2 * SLIDE:
        return mindlin.dissipated_energy_per_loop(limit, **CONTACT) + 2 * limit * (size - 2 * SLIDE)
    # δ_t = δ_t,max [1 - (1 - f)^(2/3)] read the other way
    amplitude = limit * (1 - (1 - size / (2 * SLIDE)) ** 1.5)
    return mindlin.dissipated_energy_per_loop(min(amplitude, limit), **CONTACT)


@settings(max_examples=100)
@given(values=sequences, scale=st.floats(0.02, 0.3))
def test_full_cycles_are_the_loops_that_close_and_wipe_out(values, scale):
    values = values * SLIDE * scale
    pairs = range_pairs(values)
    load, energy = replayed(values)
    residue = values[pairs.residue] if pairs.residue.size else values[:1]
    load_of_residue, energy_of_residue = replayed(residue)
    loops = sum(loop_energy(size) for size in pairs.range[pairs.count == 1])
    rounding = 1e-12 * NORMAL_LOAD * (SLIDE + np.abs(values).sum())
    assert load == pytest.approx(load_of_residue, abs=1e-12 * NORMAL_LOAD)
    assert energy == pytest.approx(energy_of_residue + loops, abs=rounding)
