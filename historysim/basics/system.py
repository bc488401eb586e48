"""What systems do differently, in one place: locks, links, syncing a folder, replacing open files, copies of processes.

Windows has no ``flock`` (a byte far beyond the end is locked in its place), no ``fork``, no limit of processor time,
and does not replace open files. Any system releases locks and closes files however a process ends.
"""

import contextlib
import errno
import functools
import importlib
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from historysim.errors import InputError

fcntl: Any
resource: Any
try:
    import fcntl
    import resource
except ImportError:
    fcntl = resource = None

# Flags to open a file as bytes, and for this process alone.
OWN = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
NO_LINK = OWN | getattr(os, "O_NOFOLLOW", 0)  # flags to open a file so, and under its very name
# Whether a process can be copied (``fork``) whatever its libraries have done; those of macOS may refuse to go on.
COPIES_PROCESSES = sys.platform == "linux"
NO_WAIT = getattr(os, "O_NONBLOCK", 0)  # A flag to open what may be a FIFO, which would wait for a writer otherwise
REPLACES_OPEN_FILES = os.name == "posix"  # whether a file can be renamed and replaced while it is open

_FAR = 1 << 43  # A byte beyond the end of any file, within what disks can address
_HELD = {errno.EAGAIN, errno.EACCES, errno.EDEADLK}
_NO_LOCKS = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP}


def lock_file(handle: int) -> bool:
    """Lock an open file for one writer; False where another has it."""
    if fcntl is None:
        return _lock_on_windows(handle, _FAR, wait=False)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def lock_byte(handle: int, byte: int, *, wait: bool) -> bool:
    """Lock one byte of an open file; False where another process has it. Disks without locks give it to everybody."""
    try:
        if fcntl is None:
            return _lock_on_windows(handle, byte, wait=wait)
        fcntl.lockf(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB), 1, byte)
    except OSError as error:
        if error.errno not in _HELD | _NO_LOCKS:
            raise
        return error.errno in _NO_LOCKS
    return True


def _lock_on_windows(handle: int, byte: int, *, wait: bool) -> bool:
    msvcrt: Any = importlib.import_module("msvcrt")
    while True:
        os.lseek(handle, byte if byte == _FAR else byte % _FAR, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            if error.errno not in _HELD:
                raise
            if not wait:
                return False
            # its own waiting ends with an error after ten seconds
            time.sleep(0.05)
        else:
            return True


def sync_folder(path: Path) -> None:
    """Write the names in a folder to the disk, where the system does not do so by itself."""
    if not hasattr(os, "O_DIRECTORY"):
        if not path.is_dir():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        return
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def user(found: os.stat_result) -> int:
    """Return the number of the user who runs this process; of whom owns a file, where users have none."""
    return os.geteuid() if hasattr(os, "geteuid") else found.st_uid


@functools.cache
def host() -> str:
    """Return eight digits of this machine and its process namespace: others may share its disks."""
    import hashlib
    import platform

    name = platform.node()
    with contextlib.suppress(OSError):
        name += str(os.stat("/proc/self/ns/pid").st_ino)  # noqa: PTH116 - no file of anybody's
    return hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:8]


def is_running(process: int) -> bool:
    """Return whether there is a process of a number; False where the system guards open files by itself."""
    if os.name != "posix":
        # a signal would end it there, and what it holds open is not removed anyway
        return False
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def limit_processor_time(seconds: int) -> None:
    """Let the system end this process, without a picture of its memory, after so much time of a processor."""
    if resource is not None:
        for kind, wanted in ((resource.RLIMIT_CPU, seconds), (resource.RLIMIT_CORE, 0)):
            _, most = resource.getrlimit(kind)
            resource.setrlimit(kind, (wanted if most == resource.RLIM_INFINITY else min(wanted, most), most))


def limit_memory(more: int) -> None:
    """Let this process take so many bytes more, where the system counts them; it gets no others."""
    with contextlib.suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        _, most = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + more, most))


def copy_ends_well(task: Callable[[], None], seconds: float) -> bool:
    """Return whether a copy of this process, which carries out a task, ends with code 0 within a time on the wall."""
    with warnings.catch_warnings():
        # Python 3.12 warns of other threads
        warnings.simplefilter("ignore", DeprecationWarning)
        process = os.fork()
    if not process:
        try:
            # the system ends it, whatever library it is in
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.setitimer(signal.ITIMER_REAL, seconds)
            task()
        finally:
            os._exit(1)
    return os.waitpid(process, 0)[1] == 0


# Threads by default, at most: one thread, which walks the history, takes a quarter of the time of a replay.
MOST_THREADS = 4


def threads_of(given: int | None) -> int:
    """Return the number of threads; by default one for each processor, up to `MOST_THREADS`."""
    if given is None:
        return min(processors(), MOST_THREADS)
    if isinstance(given, bool) or not isinstance(given, int) or given < 1:
        raise InputError(f"threads is {given!r}; expected a whole number of 1 or more")
    return given


_SLOWER = 3  # seconds on the wall for each of a processor, which others use, too
_STARTED = """
import importlib, json, sys
sys.path[:], module, name, path, seconds = json.loads(sys.argv[1])
from historysim.basics import system
system.carry_out(getattr(importlib.import_module(module), name), path, seconds)
"""


def ends_well(read: Callable[[Path], None], path: Path, seconds: int) -> bool:
    """Return whether a process that reads a file with a function of a module ends by itself, in this processor time.

    A library may read a damaged file without end, or end the process.
    """
    if not COPIES_PROCESSES:
        return _started_ends_well(read, path, seconds)
    # a copy of this process has all libraries, but waits for ever for locks that other threads hold
    well = copy_ends_well(functools.partial(carry_out, read, path, seconds), _SLOWER * seconds)
    return well or (threading.active_count() > 1 and _started_ends_well(read, path, seconds))


def carry_out(read: Callable[[Path], None], path: str | Path, seconds: int) -> None:
    """Read a file in this process, which has nothing else to do, prints nothing, and ends here."""
    import faulthandler

    with contextlib.suppress(BaseException):
        faulthandler.disable()
        null = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(null, stream)
        limit_processor_time(seconds)
        read(Path(path))
    os._exit(0)


def _started_ends_well(read: Callable[[Path], None], path: Path, seconds: int) -> bool:
    import json
    import subprocess

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
