"""What a misfit looks like: each fault is put into a record, below what its loops show, and found with its size."""

import re
from itertools import pairwise

import attrs
import numpy as np
import pytest
import synthetic

from historysim.basics.units import quantity
from historysim.measured.comparison import Comparison, observe, passed

SOUND = attrs.evolve(synthetic.measured("ball", 0, loads=(0.05,), loops=6, rate=20), dead_band={})
LOAD, MOVED = SOUND["tangential_load"], SOUND["tangential_displacement"]


def notes(load=LOAD, moved=MOVED, record=SOUND, **others):
    changed = attrs.evolve(
        record,
        channels={**record.channels, "tangential_displacement": moved},
        response={"tangential_load": load},
    )
    observation = observe(changed)
    model = synthetic.model("ball")({**synthetic.TRUTHS["ball"], **others})
    return Comparison.of(observation, passed(*model, observation)).notes


def rising(slope, *, with_position):
    """Let friction rise along each stroke, by its place in it, or by the position."""
    load = LOAD.copy()
    turns = observe(SOUND).turns
    for first, last in pairwise(turns.tolist()):
        sign = np.sign(MOVED[last] - MOVED[first])
        away = MOVED[first:last] if with_position else np.abs(MOVED[first:last] - MOVED[first])
        load[first:last] += sign * slope * (away - away.mean())
    return load


@pytest.mark.parametrize(
    ("found", "message", "unit", "size", "within"),
    [
        (lambda: notes(moved=MOVED + 5e-9 * np.sign(LOAD)), r'free_play = "(.*?)"', "m", 10e-9, 0.1),
        (lambda: notes(np.roll(LOAD, 6)), r'shift = "-(.*?)" at the tangential load', "s", 0.3, 0.1),
        (lambda: notes(rising(2e3, with_position=False)), r"both directions.*beside the contact", "", 0, 0),
        (lambda: notes(rising(2e3, with_position=False)), r"each stroke by (.*?),", "N/m", 2e3, 0.05),
        (lambda: notes(rising(2e3, with_position=True)), r"with the position, by (.*?), up", "N/m", 2e3, 0.05),
    ],
)
def test_a_fault_is_found_with_its_size(found, message, unit, size, within):
    (note,) = (note for note in found() if "of what the model leaves" in note)
    match = re.search(message, note)
    assert match
    if unit:
        assert quantity(match[1], unit) == pytest.approx(size, rel=within)


@pytest.mark.parametrize("others", [{"friction": 0.15}, {"friction": 0.26}, {"lateral_stiffness": 5e5}])
def test_another_parameter_is_no_fault(others):
    assert notes(**others) == ()


@pytest.mark.parametrize("kind", ["ball", "rough"])
def test_noise_and_another_shape_get_no_advice(kind):
    """None of 500 clean records of five kinds has a note: see tests/README.md."""
    record = synthetic.measured(kind, 1, loads=(0.05,), loops=6, rate=10.03)
    load, moved = record["tangential_load"], record["tangential_displacement"]
    assert notes(load, moved, record) == ()
