"""A sweep that is killed goes on where it was; tests/scripts/kill_sweeps.py does the same at length."""

import random

import pytest
from kill_sweeps import command, kept, kill_once, write_scenario

import historysim as hs


@pytest.mark.slow
def test_a_killed_sweep_recomputes_no_finished_cell(tmp_path):
    scenario, store = write_scenario(tmp_path, cells=24, size=32), tmp_path / "cells"
    assert kill_once(command(scenario, tmp_path / "killed.nc", store, workers=1), store, random.Random(1))  # noqa: S311
    before = kept(store)
    assert 0 < len(before) < 24
    found = hs.sweep(scenario, store=store)
    after = kept(store)
    assert {name: after[name] for name in before} == before
    assert len(after) == 24
    assert found.identical(hs.sweep(scenario))
