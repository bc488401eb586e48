"""Machine code of the room calls long functions by name; that of others gets copies of all that it needs."""

import subprocess
import sys

import numpy as np
import pytest
from numba import types

from historysim.memory.compiled import short
from historysim.memory.lean import Lean
from historysim.memory.normal import load_and_slope, touching
from historysim.memory.ramp import ramp

PROGRAM = """
from numba import njit
import historysim as hs
from historysim.memory.paths import DISPLACED
from historysim.memory.stepping import step, tangential_load

pair = hs.MaterialPair.from_moduli(contact_modulus=2.0, shear_modulus=0.3)
ensemble = hs.Ensemble(pair, [0.0, -0.01], 1.0, 0.4)


@njit(cache=True)
def carried(body, approach, displacement):
    body, _ = step(body, DISPLACED, approach, DISPLACED, displacement)
    return tangential_load(body)


# of the room nothing has run in this process yet
load = carried(ensemble.stepper().body, 0.05, 0.01)
after = ensemble.advance(ensemble.initial_state(), normal_displacement=0.05, tangential_displacement=0.01)
print(load > 0, abs(load / after.tangential_load - 1) < 1e-14)
"""


def test_python_cannot_call_what_has_no_wrapper():
    with pytest.raises(TypeError, match="ramp is called by compiled functions alone"):
        ramp(None, None, 0.0, 0.0, None)


def test_python_calls_the_others():
    gap = np.array([0.0, 0.1, 0.4])
    assert touching(gap, 0.2) == 2
    assert load_and_slope(gap, np.ones(3), 2, 0.2)[0] == pytest.approx(0.2**1.5 + 0.1**1.5, rel=1e-15)


@pytest.mark.slow
def test_functions_of_others_that_are_kept_run_in_a_process_that_loads_nothing_else(tmp_path):
    script = tmp_path / "others.py"
    script.write_text(PROGRAM, encoding="utf-8")
    for _ in range(2):
        done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout, done.stderr) == (0, "True True\n", "")


def test_python_calls_what_was_compiled_after_another_kind_of_the_same(monkeypatch):
    """What looks for kept machine code may compile the function for lean arrays, and then find that it is of no use."""

    @short
    def first(array):
        return array[0]

    for_lean_arrays = (Lean(types.float64, 1, False),)

    def of_no_use(kinds, _context):
        if kinds != for_lean_arrays:
            first.compile(for_lean_arrays)

    monkeypatch.setattr(first._cache, "load_overload", of_no_use)
    monkeypatch.setattr(first._cache, "save_overload", lambda *_: None)
    assert first(np.array([2.0])) == 2.0
