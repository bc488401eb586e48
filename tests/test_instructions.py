"""The C core executes no more instructions than recorded in `benchmarks/instructions.json`."""

import importlib.util
import json
import shutil
from pathlib import Path

from pytest import mark, skip

SCRIPT = Path(__file__).parent / "benchmarks" / "instructions.py"


def exceeded(counted, recorded, factor=1.1):
    """Describe the cases that execute more instructions than recorded, or are not recorded."""
    return [
        f"{name}: {count} instructions per asperity and step; expected at most {factor} times {recorded.get(name, 0.0)}"
        for name, count in counted.items()
        if count > factor * recorded.get(name, 0.0)
    ]


def test_a_case_with_more_instructions_is_named():
    recorded = {"load": 50.0, "wear": 700.0}
    assert exceeded({"load": 54.9, "wear": 500.0}, recorded) == []
    (message,) = exceeded({"load": 55.2, "wear": 500.0}, recorded)
    assert message.startswith("load: 55.2 instructions")
    assert len(exceeded({"load": 50.0, "new": 1.0}, recorded)) == 1


def test_goals_are_of_cases_that_do_not_reach_them_yet():
    table = json.loads((SCRIPT.parent / "instructions.json").read_text(encoding="utf-8"))
    counted = table["instructions"]
    assert [
        name for name, goal in table["goals"].items() if not counted.get(name, 0.0) > goal
    ] == []


def test_several_coefficients_take_at_most_four_times_one():
    counted = json.loads((SCRIPT.parent / "instructions.json").read_text("utf-8"))["instructions"]
    one = counted["1 coefficient of 20, ramps of 10 %"]
    several = {k: v for k, v in counted.items() if " coefficients, ramps" in k and "own" not in k}
    assert len(several) == 3
    assert {k: v for k, v in several.items() if v > 4 * one} == {}


@mark.ci
@mark.timeout(900)
@mark.skipif(
    not (shutil.which("valgrind") and shutil.which("gcc")), reason="needs valgrind and gcc"
)
def test_no_case_takes_more_instructions_than_recorded():
    spec = importlib.util.spec_from_file_location("instructions", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    table = json.loads(module.TABLE.read_text(encoding="utf-8"))
    if table["compiler"] != module.compiler():
        skip(
            f"instructions are recorded for {table['compiler']}: run tests/benchmarks/instructions.py"
        )
    counted = module.measure()
    assert set(counted) == set(table["instructions"])
    assert exceeded(counted, table["instructions"]) == []
