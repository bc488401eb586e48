"""Rows that several threads project are those of one, bit for bit."""

import threading

import numpy as np
import pytest

import historysim as hs
from historysim.asperities import projectors
from historysim.asperities.projectors import Projectors

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)


@pytest.fixture(autouse=True)
def passed_on_in_small_parts(monkeypatch):
    monkeypatch.setattr(projectors, "CELLS_PASSED_ON", 30)


def ensemble_of(coefficients, count=12, seed=1):
    rng = np.random.default_rng(seed)
    friction = 0.3 + 0.05 * (np.arange(count) % coefficients)
    return hs.Ensemble(PAIR, rng.normal(0.0, 0.01, count), rng.uniform(0.5, 2.0, count), friction)


def events_of(ensemble, count=45, seed=2):
    """Swings that turn anywhere, lift off, jump at one time, and ask for more than friction holds."""
    rng = np.random.default_rng(seed)
    load = ensemble.advance(ensemble.initial_state(), normal_displacement=0.05).normal_load
    events = [hs.NormalLoad(0.0, load)]
    for time in range(1, count):
        events.append(hs.TangentialLoad(time, 0.4 * load * rng.uniform(-1, 1)))
        if time % 7 == 0:
            events.append(hs.TangentialLoad(time, 0.1 * load * rng.uniform(-1, 1)))
        if time % 11 == 0:
            events.append(hs.NormalLoad(time + 0.5, 0.0 if time % 3 == 0 else load * rng.uniform(0.2, 1.5)))
    return events


def bits(history):
    return {name: variable.values.tobytes() for name, variable in history.variables.items()}


def used_threads(monkeypatch):
    """Return the names of threads on which rows are projected from now on."""
    names = set()
    project = Projectors._project

    def noted(self, task):
        names.add(threading.current_thread().name)
        project(self, task)

    monkeypatch.setattr(Projectors, "_project", noted)
    return names


@pytest.mark.parametrize("coefficients", [1, 3, 12])
@pytest.mark.parametrize("record", ["all", [7, 2]])
def test_threads_do_not_change_a_bit(coefficients, record):
    ensemble = ensemble_of(coefficients)
    job = {"saturate": True, "record": record, "substeps": 2}
    first, *others = (bits(hs.replay(ensemble, events_of(ensemble), **job, threads=threads)) for threads in (1, 2, 3))
    assert all(other == first for other in others)


def test_rows_are_projected_by_other_threads(monkeypatch):
    names = used_threads(monkeypatch)
    ensemble = ensemble_of(1)
    expected = bits(hs.replay(ensemble, events_of(ensemble), saturate=True, threads=3))
    assert names
    assert all(name.startswith("projector") for name in names)
    names.clear()
    assert bits(hs.replay(ensemble, events_of(ensemble), saturate=True, threads=1)) == expected
    assert not names


def test_a_memory_that_is_larger_than_its_row_is_projected_at_once(monkeypatch):
    # of two asperities no more than two vertices are kept; a spiral makes one with each reversal
    ensemble = ensemble_of(1, count=2)
    load = ensemble.advance(ensemble.initial_state(), normal_displacement=0.05).normal_load
    turns = 0.25 * load * (1 - np.arange(60) / 80) * (-1.0) ** np.arange(60)
    events = [hs.NormalLoad(0, load), *(hs.TangentialLoad(time, turn) for time, turn in enumerate(turns, 1))]
    one = hs.replay(ensemble, events, threads=1)
    waiting = []
    pass_on = Projectors._pass_on
    monkeypatch.setattr(
        Projectors, "_pass_on", lambda self, *task: (waiting.append(task[0].pending.waits.copy()), pass_on(self, *task))
    )
    assert bits(hs.replay(ensemble, events, threads=2)) == bits(one)
    # of the first row there are two vertices, and the first swing adds its slip front
    assert sum(map(np.count_nonzero, waiting)) == 1


def test_the_event_that_is_refused_is_named():
    ensemble = ensemble_of(2)
    load = ensemble.advance(ensemble.initial_state(), normal_displacement=0.05).normal_load
    events = [hs.NormalLoad(0, load), *(hs.TangentialLoad(time, 0.01 * load * time) for time in range(1, 60))]
    told = []
    for threads in (1, 3):
        with pytest.raises(hs.LoadError, match=r"event \d+ at t = ") as caught:
            hs.replay(ensemble, events, threads=threads)
        told.append(str(caught.value))
    assert told[0] == told[1]


def test_a_failure_on_another_thread_is_not_lost(monkeypatch):
    def fail(*_):
        raise MemoryError("no room")

    monkeypatch.setattr(Projectors, "_project", fail)
    # so that a row is begun before the walk ends
    monkeypatch.setattr(projectors.Future, "cancel", lambda _: False)
    ensemble = ensemble_of(1)
    with pytest.raises(MemoryError, match="no room"):
        hs.replay(ensemble, events_of(ensemble), saturate=True, threads=2)


def test_threads_end_with_the_replay():
    ensemble = ensemble_of(1)
    before = threading.active_count()
    hs.replay(ensemble, events_of(ensemble), saturate=True, threads=3)
    assert threading.active_count() == before


def test_few_rows_start_no_threads(monkeypatch):
    monkeypatch.undo()
    names = used_threads(monkeypatch)
    ensemble = ensemble_of(1)
    hs.replay(ensemble, events_of(ensemble), saturate=True, threads=3)
    assert not names


def test_a_file_is_the_same_whoever_writes_it(tmp_path):
    ensemble = ensemble_of(2)
    events = events_of(ensemble)
    for threads in (1, 3):
        hs.Replay(ensemble, events, saturate=True, threads=threads).write(tmp_path / f"{threads}.nc")
    assert (tmp_path / "1.nc").read_bytes() == (tmp_path / "3.nc").read_bytes()
