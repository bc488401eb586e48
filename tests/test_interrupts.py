"""Signals in the midst of long work: they are heard soon, and what is kept is said."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
from pairs import UNIT as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.memory.binding import DISPLACED, LOAD, TOTALS
from historysim.memory.paths import Goals, Rows, straight_paths
from historysim.studies.sweep import _Plan
from historysim.studies.workers import Processes, ending

PARTS = 4_000_000

SUMMITS = [0.0, -0.03, -0.04], [1.0, 2.0, 1.5]
PLAIN = hs.Ensemble(PAIR, *SUMMITS, [0.5, 0.4, 0.5])
WEARING = hs.Ensemble(PAIR, *SUMMITS, 0.4, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=0.1))
SCENARIO = f"""
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "summits"
height = [0.0, -0.03, -0.04]
radius = [1.0, 2.0, 1.5]
[friction]
coefficient = [0.5, 0.4, 0.5]
[record]
asperities = "totals"
[loading]
substeps = {PARTS}
waypoints = [{{ time = 0, normal_load = 0.03 }}, {{ time = 1, tangential_displacement = 0.012 }}]
"""
posix = mark.skipif(not hasattr(signal, "setitimer"), reason="needs signals of POSIX")


class HeardError(Exception):
    pass


@fixture
def hears():
    """Python's own handler of the signal: what runs the tests may ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@posix
@mark.parametrize(
    "ensemble, normal, tangential",
    [
        (PLAIN, Goals(LOAD, 0.03), Goals(DISPLACED, 0.012)),
        (WEARING, Goals(LOAD, 0.03), Goals(DISPLACED, 0.012)),
        (PLAIN, Goals(LOAD, 0.01), Goals(LOAD, 0.02)),
    ],
)
def test_a_signal_is_heard_in_the_midst_of_a_segment(ensemble, normal, tangential):
    rung = []

    def ring(*_):
        rung.append(time.process_time())
        raise HeardError

    rows = Rows(np.zeros(PARTS, dtype=TOTALS), {})
    start = ensemble.advance(
        ensemble.initial_state(), normal_load=0.03, tangential_displacement=0.0
    )
    before = signal.signal(signal.SIGVTALRM, ring)
    try:
        # in processor time, in which no walk of so many parts ends
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.2)
        with raises(HeardError):
            ensemble.advance_along(
                start, straight_paths(normal, tangential, parts=PARTS), rows=rows, saturate=True
            )
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)
    assert time.process_time() - rung[0] < 1
    assert rows.totals["normal_load"][0] > 0
    assert rows.totals["normal_load"][-1] == 0
    # the state is what it was, and the next walk is as any
    assert ensemble.advance(start, tangential_displacement=1e-3).tangential_load > 0


@posix
def test_a_signal_is_heard_in_the_midst_of_a_step_of_two_directions():
    """A single path without rows on the way, whose rings take longer than anybody waits."""
    ensemble = hs.Ensemble(
        PAIR, *SUMMITS, 0.5, rings=hs.Rings(height_classes=1, rings=800, tolerance=1e-9)
    )
    start = ensemble.advance(
        ensemble.initial_state(), normal_load=0.03, tangential_displacement=(4e-3, 0.0)
    )

    def ring(*_):
        raise HeardError

    before = signal.signal(signal.SIGVTALRM, ring)
    try:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.2)
        with raises(HeardError):
            ensemble.advance(start, tangential_displacement=(4e-3, 8e-3))
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)
    assert not start._turned


# what runs the tests may ignore the signal, and those that it starts then do, too
TELLING = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from historysim.asperities.ensemble import Ensemble
from historysim.cli import main
advance_along = Ensemble.advance_along
def told(*arguments, **named):
    print("walking", flush=True)
    return advance_along(*arguments, **named)
Ensemble.advance_along = told
main(["run", "long.toml", "-q"])
"""


@posix
def test_a_run_of_a_long_segment_ends_at_an_interrupt(tmp_path):
    (tmp_path / "long.toml").write_text(SCENARIO, encoding="utf-8")
    command = [sys.executable, "-c", TELLING]
    run = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    # the first waypoint is walked with the long segment after it
    assert run.stdout.readline() == "walking\n"
    run.send_signal(signal.SIGINT)
    _, err = run.communicate(timeout=20)
    assert run.returncode == 130
    assert err.splitlines()[-1] == (
        f"Error: interrupted; long.history keeps the events and none of {PARTS + 1:,} steps yet; the same run with "
        "--resume (resume=True) continues from there"
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["long.history", "long.toml"]
    with hs.EventLog(tmp_path / "long.history") as log:
        assert len(log.events(0, 10)) == 2


@posix
@mark.usefixtures("hears")
def test_processes_end_at_an_interrupt_in_the_midst_of_their_tasks():
    main_thread = threading.main_thread().ident
    tasks = []

    def wait_for_them():
        with ending(Processes(2)) as own:
            tasks.extend(own.submit(time.sleep, 60) for _ in range(4))
            threading.Timer(1.5, signal.pthread_kill, [main_thread, signal.SIGINT]).start()
            tasks[0].result()

    with raises(KeyboardInterrupt):
        wait_for_them()
    assert tasks[0].done()


def test_an_interrupted_sweep_reports_its_finished_cells(tmp_path, monkeypatch):
    scenario = SCENARIO.replace(f"substeps = {PARTS}", "substeps = 2").replace(
        "[0.5, 0.4, 0.5]", "0.4"
    )
    (tmp_path / "s.toml").write_text(scenario, encoding="utf-8")
    original = _Plan.carry_out

    def carry_out(self, *arguments, **named):
        original(self, *arguments, **named)
        raise KeyboardInterrupt

    monkeypatch.setattr(_Plan, "carry_out", carry_out)
    over = {"friction.coefficient": [0.1, 0.2]}
    with raises(
        KeyboardInterrupt, match=r"cells keeps 2 of 2 cells, and the same sweep resumes there"
    ):
        hs.sweep(
            tmp_path / "s.toml", over, outputs=["peak_contact_count"], store=tmp_path / "cells"
        )
    with raises(KeyboardInterrupt, match="2 of 2 cells are lost without a store"):
        hs.sweep(tmp_path / "s.toml", over, outputs=["peak_contact_count"])
