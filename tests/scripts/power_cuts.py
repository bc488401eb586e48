"""Cut the power at every call of small runs, resumes, appends and forks, and demand of every disk what was promised.

    PYTHONPATH=tests/support python tests/scripts/power_cuts.py --changes    # every cut, many disks of each
    PYTHONPATH=tests/support python tests/scripts/power_cuts.py --every 5 --samples 0

What the program asks of the disk is recorded (`disk_trace.c`); `disk.py` says what a disk may hold after each call, and
`promises.py` what is demanded of it. With `--changes`, the program is changed on purpose, each time by one precaution
less, and must be found out.
"""

import argparse
import ctypes
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import ModuleType
from unittest import mock

import attrs
import disk
import numpy as np
from preloaded import preloaded
from promises import SHORT, WORKLOADS, Sample, Workload, journal_of, nothing, sample

import historysim as hs
from historysim.basics import files
from historysim.log import file as log_file
from historysim.recording import netcdf

EVERY = 2  # rows between snapshots

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
    "the result not synced before its rename": ("run", lambda: without(files, "sync_file")),
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

    Cut only before ``every`` so many-th call that makes changes safe or names others, or for 0 before each; at every
    cut take also ``samples`` disks by chance, and end after ``enough`` broken promises.
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
        made = sample(folder / "whole", SHORT, ("0.0005", "0.0007"), EVERY)
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
