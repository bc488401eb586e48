"""Rows that several threads write are those of one, bit for bit."""

import numpy as np
import pytest
from golden import check_messages
from pairs import UNIT as PAIR

import historysim as hs

ASPERITIES, STEPS = 2000, 300
# what the library takes for worth a thread
assert ASPERITIES * STEPS > 1 << 19


def events_of(ensemble):
    """Swings that turn anywhere, lift off, and jump at one time."""
    rng = np.random.default_rng(2)
    events = [hs.NormalDisplacement(0.0, 0.02)]
    for time in range(1, STEPS):
        events.append(hs.TangentialDisplacement(time, 0.005 * rng.uniform(-1, 1)))
        if time % 7 == 0:
            events.append(hs.TangentialDisplacement(time, 0.002 * rng.uniform(-1, 1)))
        if time % 11 == 0:
            events.append(
                hs.NormalDisplacement(
                    time + 0.5, -0.001 if time % 3 == 0 else 0.02 * rng.uniform(0.2, 1.5)
                )
            )
    assert ensemble.approach_at(0.0) == 0.0
    return events


def bits(history):
    return {name: variable.values.tobytes() for name, variable in history.variables.items()}


@pytest.mark.parametrize("coefficients", [1, 3, ASPERITIES])
def test_threads_do_not_change_a_bit(coefficients):
    rng = np.random.default_rng(1)
    friction = 0.3 + 0.2 * (np.arange(ASPERITIES) % coefficients) / coefficients
    ensemble = hs.Ensemble(
        PAIR, rng.normal(0.0, 0.01, ASPERITIES), rng.uniform(0.5, 2.0, ASPERITIES), friction
    )
    events = events_of(ensemble)
    one = bits(hs.replay(ensemble, events, record="all", threads=1, hold=False))
    for threads in (2, 5):
        assert bits(hs.replay(ensemble, events, record="all", threads=threads, hold=False)) == one


def test_messages():
    check_messages(globals())
