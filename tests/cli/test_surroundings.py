"""Surroundings that are not those of the developer; `matrix.py` has more of them."""

import os
import subprocess
import sys

import matrix
import pytest


@pytest.mark.ci
@pytest.mark.parametrize("case", matrix.CHEAP, ids=lambda case: case.__name__)
def test_the_program_runs_wherever_it_is(tmp_path, case):
    case(tmp_path)


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux alone")
def test_a_name_that_is_no_text_is_reported(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "historysim", "run", os.fsencode("a\udcff.toml")],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 2
    assert b"is not a name in utf-8, the encoding of file names; rename it" in done.stderr
