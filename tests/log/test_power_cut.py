"""What a power cut leaves: see `power_cuts.py`."""

import re
from pathlib import Path

import pytest
from preloaded import POSSIBLE, REASON, run_script

POWER_CUTS = Path(__file__).parents[1] / "scripts" / "power_cuts.py"

pytestmark = pytest.mark.skipif(not POSSIBLE, reason=REASON)


def power_cuts(*arguments):
    printed = run_script(POWER_CUTS, *arguments)
    found = dict(re.findall(r"^([\w ]+): \d+ calls, (\d+) disks, 0 broken promises", printed, re.MULTILINE))
    assert set(found) == {"run", "resume", "run anew", "run of a log", "append", "fork"}, printed
    return {title: int(disks) for title, disks in found.items()}


@pytest.mark.ci
def test_whatever_a_power_cut_leaves_keeps_the_promise_and_each_precaution_is_needed():
    disks = power_cuts("--every", 16, "--samples", 0, "--changes")
    assert sum(disks.values()) > 15


@pytest.mark.slow
def test_every_cut_of_the_power_keeps_the_promise():
    disks = power_cuts("--samples", 16)
    assert min(disks["run"], disks["resume"], disks["append"]) > 90
