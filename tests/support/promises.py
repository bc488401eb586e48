"""What runs, resumes, appends and forks promise of the files that they leave, however they end.

`kill_runs.py` and `fault_runs.py` end each of them at many instants, and open the remaining files
as a user would: the log is sound, or is not there yet; nothing is lost that was done; a result is
the older one or the new one, whole; and a resume continues after the last snapshot, to the same
bits.
"""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from unittest import mock

import attrs
import netCDF4
import numpy as np
from pairs import UNIT

import historysim as hs
from historysim.log import result as result_writer
from historysim.log.file import LogFile
from historysim.log.result import snapshots

LONG = """
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "summits"
height = [-0.03, 0.0, -0.5, -0.01, -0.04]
radius = [1.0, 2.0, 1.0, 0.5, 1.5]
[friction]
coefficient = [0.5, 0.4, 0.5, 0.6, 0.45]
[record]
asperities = "all"
[loading]
substeps = 3
[[loading.blocks]]
waypoints = [{ after = 1, normal_load = 0.03 }]
[[loading.blocks]]
repeat = 20
waypoints = [
    { after = 0.5, normal_load = 0.025 },
    { after = 0.5, tangential_displacement = 0.012 },
    { after = 1, friction = 0.5 },
    { after = 1, tangential_load = -0.004, normal_load = 0.03 },
    { after = 1, friction = [0.5, 0.4, 0.5, 0.6, 0.45] },
]
"""
SHORT = """
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "summits"
height = [0.0, -0.01, -0.02]
radius = 1.0
[friction]
coefficient = 0.5
[loading]
hold = false
waypoints = [
    { time = 0, normal_load = 0.01 },
    { time = 1, tangential_load = 0.003 },
    { time = 2, tangential_load = -0.003 },
    { time = 3, tangential_load = 0.002 },
    { time = 4, tangential_load = -0.001 },
    { time = 5, tangential_load = 0.0005 },
    { time = 6, normal_load = 0.012 },
]
"""
RESULT, LOG, TOML = "out.nc", "out.history", "small.toml"
SIZES = (3, 700, 1, 2500)  # events that are appended together

Mark = Callable[[str], None]  # notes what a user knows to be done


def nothing(_: object) -> None:
    """Do nothing."""


class Ended(BaseException):
    """The process ends here."""


@attrs.frozen
class Sample:
    """What every workload and every demand needs: a scenario, its result, and an older one."""

    scenario: str
    every: int  #: rows between snapshots
    expected: dict[str, bytes]  #: variables of the result
    older: bytes  #: another result, which exists under its name before
    events: list[hs.NormalLoad]  #: for a log to grow by

    def run(self, source: Path, output: Path, **options: object) -> None:
        """Run a scenario or a log."""
        hs.run(source, output, snapshot_every=self.every, **options).close()


def sample(folder: Path, scenario: str, changed: tuple[str, str], every: int) -> Sample:
    """Make the files to compare with; the older result is of the scenario with a text changed."""
    folder.mkdir(parents=True)
    made = Sample(
        scenario,
        every,
        {},
        b"",
        [hs.NormalLoad(float(n), 0.01 + 1e-5 * (n % 7)) for n in range(6000)],
    )
    made.run(written(folder, scenario), folder / RESULT)
    expected = variables(folder / RESULT)
    made.run(written(folder, scenario.replace(*changed)), folder / RESULT)
    return attrs.evolve(made, expected=expected, older=(folder / RESULT).read_bytes())


def variables(path: Path) -> dict[str, bytes]:
    """Every bit of every variable of a result."""
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        return {
            name: np.ascontiguousarray(values[...]).tobytes()
            for name, values in file.variables.items()
        }


def written(folder: Path, text: str) -> Path:
    """Write the scenario of a folder."""
    path = folder / TOML
    path.write_text(text, encoding="utf-8")
    return path


def last_snapshot(log: Path) -> int:
    """Rows at the last snapshot of a sound log."""
    if not log.exists():
        return 0
    with LogFile(log) as file:
        return max((start.rows for start in snapshots(file, file.sound())), default=0)


def in_a_process(action: Callable[[], object]) -> int:
    """Do something in a separate process, forked, so that it need not import and compile again."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        action()
        code = 0
    finally:
        os._exit(code)


# -- what is done ----------------------------------------------------------------------------------


@attrs.frozen
class Workload:
    """Something to do in a folder, and what it promises."""

    prepare: Callable[[Path, Sample], None]  #: makes what the folder holds before
    #: does it, and marks what a user could be shown as done
    act: Callable[[Path, Sample, Mark], None]
    #: Opens the folder as a user would after the end, given the marks; AssertionError where a
    #: promise is broken.
    demand: Callable[[Path, Sample, list[str]], None]


def before_a_run(folder: Path, made: Sample) -> None:
    written(folder, made.scenario)
    (folder / RESULT).write_bytes(made.older)


def a_run(folder: Path, made: Sample, mark: Mark) -> None:
    made.run(folder / TOML, folder / RESULT)
    mark("done")


def before_a_resume(folder: Path, made: Sample) -> None:
    before_a_run(folder, made)
    add, added = result_writer.add_snapshot, []

    def add_two(*snapshot: object) -> None:
        add(*snapshot)
        added.append(snapshot)
        if len(added) == 2:
            raise Ended

    with mock.patch.object(result_writer, "add_snapshot", add_two), suppress(Ended):
        made.run(folder / TOML, folder / RESULT)


def a_resume(folder: Path, made: Sample, mark: Mark) -> None:
    made.run(folder / TOML, folder / RESULT, resume=True)
    mark("done")


def demand_of_a_run(
    folder: Path, made: Sample, marks: list[str], log: str = LOG, *, exactly: bool = True
) -> None:
    """Demand what a run promises; ``exactly``: a resume continues after the last snapshot."""
    path, result = folder / log, folder / RESULT
    rows = last_snapshot(path)
    if result.read_bytes() != made.older or marks:
        assert variables(result) == made.expected, "the result is neither the older nor the new one"
    there = path.exists()
    if there:
        with LogFile(path) as file:
            there = file.head.settings["scenario"] == made.scenario
    assert there or not marks, "the log of a run that was done is not there"
    source = folder / TOML if log == LOG else path
    if there:
        notices: list[str] = []
        made.run(source, result, resume=True, notify=notices.append)
        found = re.search(r"after ([\d,]+) rows", "".join(notices))
        begun = int(found[1].replace(",", "")) if found else 0
        assert begun == rows or not (notices and exactly), (notices, rows)
    else:
        made.run(source, result)
    assert variables(result) == made.expected, "a resume has given another result"
    assert names(folder) == sorted([log.split("/", maxsplit=1)[0], RESULT, TOML])


def names(folder: Path) -> list[str]:
    """Return the contents of a folder."""
    return sorted(path.name for path in folder.iterdir())


def before_a_run_of_a_log(folder: Path, made: Sample) -> None:
    """Leave a log without snapshots, in another folder than its result."""
    before_a_run(folder, made)
    hs.run(folder / TOML, folder / RESULT, snapshot_every=10**6).close()
    (folder / "logs").mkdir()
    (folder / LOG).rename(folder / "logs" / LOG)
    (folder / RESULT).write_bytes(made.older)


def a_run_of_a_log(folder: Path, made: Sample, mark: Mark) -> None:
    made.run(folder / "logs" / LOG, folder / RESULT)
    mark("done")


def demand_of_a_run_of_a_log(folder: Path, made: Sample, marks: list[str]) -> None:
    demand_of_a_run(folder, made, marks, f"logs/{LOG}")


def before_an_append(folder: Path, _: Sample) -> None:
    hs.EventLog.create(
        folder / LOG, hs.Ensemble(UNIT, summit_height=0.0, summit_radius=1.0, friction=0.2)
    ).close()


def an_append(folder: Path, made: Sample, mark: Mark) -> None:
    first = 0
    with hs.EventLog(folder / LOG) as log:
        for size in SIZES:
            log.append(made.events[first : first + size])
            first += size
            mark(str(first))


def demand_of_an_append(folder: Path, made: Sample, marks: list[str]) -> None:
    ends = np.cumsum([0, *SIZES]).tolist()
    with hs.EventLog(folder / LOG) as log:
        assert len(log) in ends, "a part of what was appended together"
        assert len(log) >= int(marks[-1] if marks else 0), "events that were appended are lost"
        assert log.events() == made.events[: len(log)], "other events than were appended"
        log.append(made.events[len(log) : ends[-1] + 1])
        assert log.events() == made.events[: ends[-1] + 1], "the log does not take further events"


def before_a_fork(folder: Path, made: Sample) -> None:
    before_an_append(folder, made)
    an_append(folder, made, nothing)


def a_fork(folder: Path, _: Sample, mark: Mark) -> None:
    with hs.EventLog(folder / LOG) as log:
        log.fork(50.0, folder / "fork.history").close()
        mark("done")


def demand_of_a_fork(folder: Path, made: Sample, marks: list[str]) -> None:
    with hs.EventLog(folder / LOG) as log:
        assert log.events() == made.events[: sum(SIZES)], "the log that was forked has changed"
    fork = folder / "fork.history"
    assert fork.exists() or not marks, "the fork is lost"
    if fork.exists():
        with hs.EventLog(fork) as log:
            assert log.events() == made.events[:51], "the fork is not what was forked"
    with hs.EventLog(folder / LOG) as log:
        log.fork(50.0, fork).close()


WORKLOADS = {
    "run": Workload(before_a_run, a_run, demand_of_a_run),
    "resume": Workload(before_a_resume, a_resume, demand_of_a_run),
    "run of a log": Workload(before_a_run_of_a_log, a_run_of_a_log, demand_of_a_run_of_a_log),
    "append": Workload(before_an_append, an_append, demand_of_an_append),
    "fork": Workload(before_a_fork, a_fork, demand_of_a_fork),
}
