"""A sweep that is killed continues after the cells that it finished."""

import random
import subprocess
import sys
import time

import pytest

import historysim as hs

SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [32, 32]
pixel_size = "1 µm"
rms_height = "24 nm"
autocorrelation_length = "4 µm"
seed = 1
[friction]
coefficient = 0.2
[loading]
substeps = 20
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { time = 1, tangential_displacement = "20 nm" },
    { time = 3, tangential_displacement = "-20 nm" },
    { time = 5, tangential_displacement = "20 nm" },
]
[sweep.over]
surface.seed = { from = 1, count = 24 }
"""


def finished_cells(store):
    """When each cell was written, and its file: both change where a cell is computed again."""
    return {
        path.name: (path.stat().st_mtime_ns, path.stat().st_ino) for path in store.glob("*.cell")
    }


@pytest.mark.slow
def test_a_killed_sweep_recomputes_no_finished_cell(tmp_path):
    scenario, store = tmp_path / "sweep.toml", tmp_path / "cells"
    scenario.write_text(SCENARIO, encoding="utf-8")
    words = [
        "sweep",
        str(scenario),
        "-o",
        str(tmp_path / "killed.nc"),
        "--store",
        str(store),
        "--workers",
        "1",
    ]
    aim = random.Random(1).randint(1, 12)  # noqa: S311
    with subprocess.Popen(
        [sys.executable, "-m", "historysim", *words], stderr=subprocess.DEVNULL
    ) as running:
        end = time.monotonic() + 300.0
        while (
            running.poll() is None and len(finished_cells(store)) < aim and time.monotonic() < end
        ):
            time.sleep(0.002)
        assert running.poll() is None
        running.kill()
    before = finished_cells(store)
    assert 0 < len(before) < 24
    found = hs.sweep(scenario, store=store)
    after = finished_cells(store)
    assert {name: after[name] for name in before} == before
    assert len(after) == 24
    assert found.identical(hs.sweep(scenario))
