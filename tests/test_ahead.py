"""What is compiled ahead is what an ordinary run, and a step by hand, need of the memory."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import historysim
from historysim.ahead import compile_ahead
from historysim.memory import cache

ROOT = Path(historysim.__file__).parents[1]
SCENARIOS = ROOT / "scenarios"

PROGRAM = """
import json
import sys
import historysim as hs
from historysim.ahead import compile_ahead
from historysim.memory import cache

def compiled():
    return {(name, *map(str, kinds)) for name, one in cache._functions.items() for kinds in one.overloads}

compile_ahead()
before = compiled()
for scenario in sys.argv[1:]:
    hs.run(scenario, "result.nc")
contact = hs.load(sys.argv[1]).ensemble()
state = contact.advance(contact.initial_state(), normal_load=1e-3)
state = contact.advance(state, tangential_load=1e-5)
state.tangential_stiffness, state.slip_share
contact.stepper(state).step(tangential_displacement=0.0)
print(json.dumps([sorted(before), sorted(compiled() - before)]))
"""


@pytest.mark.slow
def test_ordinary_runs_compile_nothing_more(tmp_path):
    names = ["01_load_steps_up.toml", "08_mixed_control.toml", "10_random_rough_surface.toml"]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *(str(SCENARIOS / name) for name in names)],
        cwd=tmp_path,
        # what was kept before may have been compiled, and is loaded, after other functions
        env=os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    before, more = json.loads(done.stdout)
    assert {name.rpartition(".")[2] for name, *_ in before} >= {"walk_paths", "record_row", "step_arrays"}
    assert more == []


def test_the_paths_of_a_replay_and_steps_by_hand_are_compiled():
    compile_ahead()
    names = {name.rpartition(".")[2] for name, one in cache._functions.items() if one.overloads}
    assert names >= {"walk_paths", "record_row", "step_arrays", "slopes_of_arrays", "sticking_stiffness"}
