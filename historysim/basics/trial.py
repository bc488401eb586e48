"""A file is read by a process of its own first, where a library may read it without end, or end the process."""

import contextlib
import faulthandler
import functools
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from historysim.basics import system

_SLOWER = 3
"""Seconds on the wall for each of a processor, which others use, too."""
_STARTED = """
import importlib, json, sys
sys.path[:], module, name, path, seconds = json.loads(sys.argv[1])
from historysim.basics import trial
trial.carry_out(getattr(importlib.import_module(module), name), path, seconds)
"""


def ends_well(read: Callable[[Path], None], path: Path, seconds: int) -> bool:
    """Return whether a process that reads a file with a function of a module ends by itself, in this processor time."""
    # a copy of this process has all libraries, but never gets what other threads hold
    copied = system.COPIES_PROCESSES
    if copied and system.copy_ends_well(functools.partial(carry_out, read, path, seconds), _SLOWER * seconds):
        return True
    return not (copied and threading.active_count() == 1) and _started_ends_well(read, path, seconds)


def carry_out(read: Callable[[Path], None], path: str | Path, seconds: int) -> None:
    """Read a file in this process, which has nothing else to do, prints nothing, and ends here."""
    with contextlib.suppress(BaseException):
        faulthandler.disable()
        null = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(null, stream)
        system.limit_processor_time(seconds)
        read(Path(path))
    os._exit(0)


def _started_ends_well(read: Callable[[Path], None], path: Path, seconds: int) -> bool:
    task = json.dumps([sys.path, read.__module__, read.__name__, str(path.absolute()), seconds])
    try:
        done = subprocess.run(  # noqa: S603 - this Python, as it is
            [sys.executable, "-c", _STARTED, task], check=False, timeout=_SLOWER * seconds, stdin=subprocess.DEVNULL
        )
    except subprocess.TimeoutExpired:
        return False
    except OSError:
        # a program that embeds Python has no interpreter to start
        return True
    return done.returncode == 0
