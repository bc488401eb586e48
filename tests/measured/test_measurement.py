"""A measurement by itself: what it says of its samples, and which of them it keeps."""

import numpy as np
import pytest

from historysim.errors import InputError
from historysim.measured.reduction import Measurement


def test_it_says_what_it_is_in_one_line():
    measurement = Measurement(
        np.linspace(0, 90, 1001),
        {"normal_load": np.full(1001, 0.05), "tangential_displacement": np.linspace(-2e-7, 3e-7, 1001)},
        {"tangential_load": np.linspace(-0.01, 0.01, 1001)},
    )
    assert repr(measurement) == (
        "<Measurement: 1,001 samples over 90 s, normal_load 50 mN, tangential_displacement -200 nm to 300 nm, "
        "tangential_load -10 mN to 10 mN>"
    )


def test_a_record_without_lines_names_the_time():
    record = Measurement(np.array([0.0, 2.0, 1.0]), {"normal_load": np.ones(3)})
    with pytest.raises(InputError, match="the sample at t = 1 s: the time 1 s comes after 2 s"):
        record.events()
    record = Measurement(np.array([0.0, 2.0]), {"normal_load": np.array([1.0, -1.0])})
    with pytest.raises(InputError, match="the sample at t = 2 s: a normal load of -1 N pulls"):
        record.events()


def test_a_record_says_what_it_does_not_have():
    record = Measurement(np.zeros(1), {"normal_load": np.ones(1)})
    with pytest.raises(InputError, match=r"no tangential_load; expected a column for it, in loading\.columns"):
        record["tangential_load"]


def test_a_reduced_record_keeps_what_both_channels_need():
    """The path turns a corner where the displacement does not turn: the normal load starts to rise there."""
    moved, load = np.array([0, 1, 2, 3, 4.0]), np.array([1, 1, 1, 2, 3.0])
    record = Measurement(np.arange(5.0), {"normal_load": load, "tangential_displacement": moved}, reduced=True)
    assert record.kept().tolist() == [0, 2, 4]
    alone = Measurement(np.arange(5.0), {"normal_load": load}, reduced=True)
    assert alone.kept().tolist() == [0, 4]
