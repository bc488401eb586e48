"""Running a scenario or a log: the same numbers as a replay, whichever way the loads come in."""

import hashlib
import os
import subprocess
import sys

import numpy as np
from pairs import UNIT as PAIR
from pytest import fixture, mark, raises

import historysim as hs

HEIGHTS = [-0.03, 0.0, -0.5, -0.01, -0.04]
RADII = [1.0, 2.0, 1.0, 0.5, 1.5]

SCENARIO = """
title = "five summits"
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "summits"
height = [-0.03, 0.0, -0.5, -0.01, -0.04]
radius = [1.0, 2.0, 1.0, 0.5, 1.5]
[friction]
coefficient = 0.5
[loading]
substeps = 4
waypoints = [
    { time = 0, normal_load = 0.03, tangential_load = 0 },
    { time = 1, tangential_load = 0.006 },
    { time = 2, normal_load = 0.02, tangential_displacement = -0.01 },
    { time = 2.5, friction = [0.2, 0.3, 0.4, 0.5, 0.6] },
    { time = 3, normal_displacement = 0.04, tangential_displacement = 0.02 },
]
"""
EVENTS = [
    hs.NormalLoad(0.0, 0.03),
    hs.TangentialLoad(0.0, 0.0),
    hs.TangentialLoad(1.0, 0.006),
    hs.NormalLoad(2.0, 0.02),
    hs.TangentialDisplacement(2.0, -0.01),
    hs.FrictionChange(2.5, [0.2, 0.3, 0.4, 0.5, 0.6]),
    hs.NormalDisplacement(3.0, 0.04),
    hs.TangentialDisplacement(3.0, 0.02),
]


@fixture
def ensemble():
    return hs.Ensemble(PAIR, HEIGHTS, RADII, 0.5)


@fixture
def scenario(tmp_path):
    path = tmp_path / "five.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


def fingerprint(history):
    total = hashlib.sha256()
    for name in sorted(history.variables):
        total.update(name.encode() + np.ascontiguousarray(history[name].values).tobytes())
    return total.hexdigest()


# -- two ways in, one result -----------------------------------------------------------------------


def test_run_and_replay_give_the_same_numbers(ensemble, scenario, tmp_path):
    replayed = hs.replay(ensemble, EVENTS, substeps=4, hold=False)
    ran = hs.run(scenario)
    assert fingerprint(ran) == fingerprint(replayed)
    with hs.run(str(scenario), tmp_path / "out.nc") as streamed:
        assert fingerprint(streamed) == fingerprint(replayed)
        # a file has a date in addition to the history
        assert streamed.attrs == ran.attrs | {"date_created": streamed.attrs["date_created"]}
    told = {key: ran.attrs[key] for key in ("title", "scenario", "log_digest", "id")}
    assert {**replayed.attrs, **told} == ran.attrs


def test_another_process_finds_the_same_bits(scenario):
    code = (
        "import hashlib, sys\nimport numpy as np\nimport historysim as hs\n"
        "history = hs.run(sys.argv[1])\ntotal = hashlib.sha256()\n"
        "for name in sorted(history.variables):\n"
        "    total.update(name.encode() + np.ascontiguousarray(history[name].values).tobytes())\n"
        "print(total.hexdigest())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    command = [sys.executable, "-c", code, str(scenario)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == fingerprint(hs.run(scenario))


# -- threads ---------------------------------------------------------------------------------------


def test_threads_do_not_change_the_result(scenario, tmp_path):
    expected = fingerprint(hs.run(scenario, threads=1))
    assert fingerprint(hs.run(scenario, threads=3)) == expected
    with hs.run(scenario, tmp_path / "five.nc", threads=3) as written:
        assert fingerprint(written) == expected


@mark.parametrize("output", [None, "five.nc"])
def test_an_invalid_number_of_threads_leaves_no_file(scenario, tmp_path, output):
    with raises(hs.InputError, match="threads is 0; expected a whole number of 1 or more"):
        hs.run(scenario, output and tmp_path / output, threads=0)
    assert list(tmp_path.iterdir()) == [scenario]
