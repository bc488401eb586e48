"""The adaptive integration of the core, with integrals in closed form."""

import subprocess

import pytest
from c_core import SUPPORT, WARNINGS, compiled, hatch_build

CC = hatch_build.compiler()
pytestmark = pytest.mark.skipif(not CC, reason="needs a C compiler")
INTEGRAL = {"root": 2.0 / 3.0, "square": 1.0 / 3.0}


@pytest.fixture(scope="module")
def integrate(tmp_path_factory):
    """Integrate a function by a rule to a tolerance: status, value, chords, steps, end of the last step."""
    program = compiled(
        CC, SUPPORT / "adaptive.c", tmp_path_factory.mktemp("adaptive"), *WARNINGS, "-fPIC"
    )

    def run(rule, function, tolerance):
        words = [program, rule, function, str(tolerance)]
        done = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()
        assert done[4] == done[5]
        return int(done[0]), float(done[1]), int(done[2]), int(done[3]), float(done[4])

    return run


@pytest.mark.parametrize("rule", ["doubled", "halved", "predicted"])
@pytest.mark.parametrize("function", INTEGRAL)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_integrals_are_within_the_tolerance(integrate, rule, function, tolerance):
    status, value, _, steps, end = integrate(rule, function, tolerance)
    assert (status, end) == (0, 1.0)
    assert (steps == 1) == (rule == "doubled")
    assert abs(value - INTEGRAL[function]) < tolerance


def test_steps_are_short_only_where_the_function_bends(integrate):
    chords = {rule: integrate(rule, "root", 1e-7)[2] for rule in ("doubled", "halved", "predicted")}
    assert chords["halved"] < 0.3 * chords["doubled"]
    assert chords["predicted"] < 0.7 * chords["halved"]


@pytest.mark.parametrize("rule", ["halved", "predicted"])
def test_an_integration_ends_when_its_chords_are_used_up(integrate, rule):
    status, _, chords, _, end = integrate(rule, "root", 1e-13)
    assert status == -1
    assert 0.0 <= end < 1.0
    assert 100_000 <= chords < 110_000
