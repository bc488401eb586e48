"""Cut the power at every call of small runs, resumes, appends and forks, and demand of every disk what was promised.

    PYTHONPATH=tests/support python tests/scripts/power_cuts.py --changes    # every cut, many disks of each
    PYTHONPATH=tests/support python tests/scripts/power_cuts.py --every 5 --samples 0

What the program asks of the disk is recorded (`disk_trace.c`); `disk.py` says what a disk may hold after each call. A
user opens each of these disks: the log is sound, or is not there yet; nothing is lost that was told as done; a result
is the older one or the new one, whole; and a resume goes on after the last snapshot, to the same bits. With
`--changes`, the program is changed on purpose, each time by one precaution less, and must be found out.
"""

import argparse
import ctypes
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from types import ModuleType
from unittest import mock

import attrs
import disk
import numpy as np
from kill_runs import check_start, last_snapshot, variables
from preloaded import preloaded

import historysim as hs
from historysim.basics import files
from historysim.log import file as log_file
from historysim.log import result as result_writer
from historysim.log.file import LogFile
from historysim.recording import netcdf

SCENARIO = """
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
OTHER = SCENARIO.replace("0.0005", "0.0007")
EVERY = 2  # rows between snapshots
RESULT, LOG, TOML = "out.nc", "out.history", "small.toml"

Mark = Callable[[str], None]


def nothing(_: object) -> None:
    """Do nothing."""


class Ended(BaseException):
    """The process ends here."""


@attrs.frozen
class Sample:
    """What every workload and every demand needs: the files of a run that nobody ended, and of an older one.

    Attributes
    ----------
    expected : dict
        Variables of the result.
    older : bytes
        Another result, which stands in the place of it before.
    """

    expected: dict[str, bytes]
    older: bytes
    events: list[hs.NormalLoad]


def events_of(count: int) -> list[hs.NormalLoad]:
    """Loads for a log to grow by."""
    return [hs.NormalLoad(float(number), 0.01 + 1e-5 * (number % 7)) for number in range(count)]


def sample(folder: Path) -> Sample:
    """Make the files to compare with."""
    run(written(folder, SCENARIO), folder / RESULT)
    expected = variables(folder / RESULT)
    run(written(folder, OTHER), folder / RESULT)
    return Sample(expected, (folder / RESULT).read_bytes(), events_of(6000))


def written(folder: Path, text: str) -> Path:
    """Write the scenario of a folder."""
    path = folder / TOML
    path.write_text(text, encoding="utf-8")
    return path


def run(source: Path, output: Path, *, resume: bool = False, notify: Callable[[str], None] = print) -> None:
    """Run a scenario or a log."""
    hs.run(source, output, resume=resume, snapshot_every=EVERY, notify=notify).close()


def journal_of(path: Path) -> Path:
    return path.with_name(f"{path.name}-journal")


def names(folder: Path) -> list[str]:
    """Return what stands in a folder."""
    return sorted(path.name for path in folder.iterdir())


# -- what is done -----------------------------------------------------------------------------------


@attrs.frozen
class Workload:
    """Something to do in a folder, and what it promises.

    Attributes
    ----------
    prepare : callable
        Makes the folder that it finds.
    act : callable
        Does it, and marks what it could tell the user.
    demand : callable
        Opens the folder as a user would after a cut, given the marks; raises AssertionError where a promise is broken.
    """

    prepare: Callable[[Path, Sample], None]
    act: Callable[[Path, Sample, Mark], None]
    demand: Callable[[Path, Sample, list[str]], None]


def before_a_run(folder: Path, made: Sample) -> None:
    written(folder, SCENARIO)
    (folder / RESULT).write_bytes(made.older)


def a_run(folder: Path, _: Sample, mark: Mark) -> None:
    run(folder / TOML, folder / RESULT)
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
        run(folder / TOML, folder / RESULT)


def a_resume(folder: Path, _: Sample, mark: Mark) -> None:
    run(folder / TOML, folder / RESULT, resume=True, notify=nothing)
    mark("done")


def before_a_new_run(folder: Path, made: Sample) -> None:
    """Leave what a power cut has left of an append to the log of another scenario: a journal to be rolled back."""
    run(written(folder, OTHER), folder / RESULT)
    # its very bytes, which tell when it was written
    (folder / RESULT).write_bytes(made.older)
    append, kept = log_file._put_events, folder.with_name("cut")

    def cut_before_commit(*arguments: object) -> Iterator[object]:
        connection = arguments[0]
        connection.execute("PRAGMA cache_size = 1")
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("INSERT INTO chain VALUES (9, 7, x'')")
        connection.execute("INSERT INTO batch VALUES (9, 7, zeroblob(50000), x'', x'', x'')")
        shutil.copytree(folder, kept)
        connection.execute("ROLLBACK")
        return append(*arguments)

    with mock.patch.object(log_file, "_put_events", cut_before_commit), hs.EventLog(folder / LOG) as log:
        log.append([hs.NormalLoad(10.0, 0.01)])
    shutil.rmtree(folder)
    kept.rename(folder)
    assert journal_of(folder / LOG).stat().st_size > 0
    written(folder, SCENARIO)


def before_a_run_of_a_log(folder: Path, made: Sample) -> None:
    """Leave a log without snapshots, in another folder than its result."""
    before_a_run(folder, made)
    hs.run(folder / TOML, folder / RESULT, snapshot_every=10**6).close()
    (folder / "logs").mkdir()
    (folder / LOG).rename(folder / "logs" / LOG)
    (folder / RESULT).write_bytes(made.older)


def a_run_of_a_log(folder: Path, _: Sample, mark: Mark) -> None:
    hs.run(folder / "logs" / LOG, folder / RESULT, snapshot_every=EVERY).close()
    mark("done")


def demand_of_a_run_of_a_log(folder: Path, made: Sample, marks: list[str]) -> None:
    log, result = folder / "logs" / LOG, folder / RESULT
    rows = last_snapshot(log)
    if result.read_bytes() != made.older or marks:
        assert variables(result) == made.expected, "the result is neither the older nor the new one"
    resumed(folder, log, rows)
    assert variables(result) == made.expected, "a resume has given another result"
    assert names(folder) == ["logs", RESULT, TOML]


def resumed(folder: Path, source: Path, rows: int) -> None:
    """Resume a run, and check that it goes on after so many rows."""
    told = folder / "told"
    with told.open("w", encoding="utf-8") as stream:
        run(source, folder / RESULT, resume=True, notify=lambda text: print(text, file=stream))
    check_start(told, rows)
    told.unlink()


def demand_of_a_run(folder: Path, made: Sample, marks: list[str]) -> None:
    log, result = folder / LOG, folder / RESULT
    rows = last_snapshot(log)
    if result.read_bytes() != made.older or marks:
        assert variables(result) == made.expected, "the result is neither the older nor the new one"
    if log.exists():
        with LogFile(log) as file:
            again = file.head.settings["scenario"] != SCENARIO
    else:
        again = True
    assert not (again and marks), "the log of a run that was done is not there"
    if again:
        run(folder / TOML, result)
    else:
        resumed(folder, folder / TOML, rows)
    assert variables(result) == made.expected, "a resume has given another result"
    assert names(folder) == [LOG, RESULT, TOML]


SIZES = (3, 700, 1, 2500)


def before_an_append(folder: Path, _: Sample) -> None:
    pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
    hs.EventLog.create(folder / LOG, hs.Ensemble(pair, summit_height=0.0, summit_radius=1.0, friction=0.2)).close()


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
    an_append(folder, made, lambda _: None)


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
    "run anew": Workload(before_a_new_run, a_run, demand_of_a_run),
    "run of a log": Workload(before_a_run_of_a_log, a_run_of_a_log, demand_of_a_run_of_a_log),
    "append": Workload(before_an_append, an_append, demand_of_an_append),
    "fork": Workload(before_a_fork, a_fork, demand_of_a_fork),
}

# -- one precaution less ----------------------------------------------------------------------------


def without(module: ModuleType, name: str) -> AbstractContextManager[object]:
    return mock.patch.object(module, name, nothing)


def no_sync_of_rows() -> AbstractContextManager[object]:
    return mock.patch.object(netcdf.FileRecorder, "flush", nothing)


@contextmanager
def no_sync_of_folders() -> Iterator[None]:
    with without(files, "sync_folder"), without(log_file, "sync_folder"), without(netcdf, "sync_folder"):
        yield


@contextmanager
def with_pragma(text: str) -> Iterator[None]:
    connect = log_file.connect

    def connected(*place: object) -> object:
        connection = connect(*place)
        connection.execute(f"PRAGMA {text}")
        return connection

    with mock.patch.object(log_file, "connect", connected):
        yield


def journal_removed() -> AbstractContextManager[object]:
    return mock.patch.object(log_file, "settle", lambda path: journal_of(path).unlink(missing_ok=True))


# Each with the workload that finds it out.
CHANGES = {
    "rows not synced before a snapshot": ("run", no_sync_of_rows),
    "no sync of the folder": ("run", no_sync_of_folders),
    "synchronous = OFF": ("append", lambda: with_pragma("synchronous = OFF")),
    "journal = OFF on append": ("append", lambda: with_pragma("journal_mode = OFF")),
    "the result not synced before its rename": ("run", lambda: without(netcdf, "sync_file")),
    "no sync of the folder that rows are written in": ("run of a log", lambda: without(netcdf, "sync_folder")),
    "the journal of a log that is replaced left to the new one": ("run anew", lambda: without(log_file, "settle")),
    "the journal of a log that is replaced removed at once": ("run anew", journal_removed),
}


# -- the check --------------------------------------------------------------------------------------


@attrs.frozen
class Outcome:
    """What was found: calls of the workload, disks that were opened, and on which the promise was broken."""

    calls: int
    disks: int
    broken: list[str]


def check(
    workload: Workload,
    library: ctypes.CDLL,
    folder: Path,
    made: Sample,
    *,
    every: int = 0,
    samples: int = 0,
    enough: int = 20,
) -> Outcome:
    """Cut the power during a workload, and open the disks that this may leave.

    Parameters
    ----------
    every : int
        Cut only before every so many-th call that makes changes safe or names others; 0 for every call there is.
    samples : int
        Disks by chance at every cut.
    enough : int
        Broken promises after which no more are looked for.
    """
    generator = np.random.default_rng(0)
    place = folder / "begun"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    workload.prepare(place, made)
    try:
        history = disk.recorded(library, place, lambda mark: workload.act(place, made, mark))
    except AssertionError as error:
        return Outcome(0, 0, [f"it fails without any cut: {error}"])
    seen: set[tuple[bytes, int]] = set()
    broken: list[str] = []
    # a promise is the more likely to be broken the more was promised
    cuts = history.telling_cuts[::-every] if every else range(len(history), -1, -1)
    for cut in cuts:
        marks = history.marked(cut)
        for held in history.disks(cut, samples=samples, generator=generator):
            key = disk.digest(held), len(marks)
            if key in seen:
                continue
            seen.add(key)
            opened = folder / "opened"
            shutil.rmtree(opened, ignore_errors=True)
            disk.put(held, opened)
            try:
                workload.demand(opened, made, marks)
            except (AssertionError, hs.HistorySimError, OSError) as error:
                last = history.calls[cut - 1] if cut else "nothing"
                listing = {name: None if content is None else len(content) for name, content in held.items()}
                broken.append(f"cut {cut} of {len(history)}, after {last}: {error}\n    {listing}")
                if len(broken) >= enough:
                    return Outcome(len(history), len(seen), broken)
    return Outcome(len(history), len(seen), broken)


def main() -> None:
    """Read the arguments, and say what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=0, help="a sample: cut before every so many-th telling call")
    parser.add_argument("--samples", type=int, default=16, help="disks by chance at every cut")
    parser.add_argument("--changes", action="store_true", help="also leave out the precautions, one at a time")
    arguments = parser.parse_args()
    library = preloaded("disk_trace.c")
    with tempfile.TemporaryDirectory(prefix="power_cuts.") as name:
        folder = Path(name).resolve()
        (folder / "whole").mkdir()
        made = sample(folder / "whole")
        options = {"every": arguments.every, "samples": arguments.samples}
        failed = 0
        for title, workload in WORKLOADS.items():
            began = time.perf_counter()
            found = check(workload, library, folder, made, **options)
            failed += len(found.broken)
            seconds = time.perf_counter() - began
            print(
                f"{title}: {found.calls} calls, {found.disks} disks, {len(found.broken)} broken promises, "
                f"{seconds:.0f} s",
                flush=True,
            )
            print("".join(f"  {text}\n" for text in found.broken), end="")
        for title, (found_by, change) in CHANGES.items() if arguments.changes else ():
            with change():
                found = check(WORKLOADS[found_by], library, folder, made, every=1, enough=1)
            failed += not found.broken
            print(f"{title}: {'found out' if found.broken else 'not noticed'} after {found.disks} disks", flush=True)
        sys.exit(bool(failed))


if __name__ == "__main__":
    main()
