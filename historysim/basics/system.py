"""What systems do differently, in one place: locks, links, syncing a folder, replacing open files, copies of processes.

Windows has no ``flock`` (a byte far beyond the end is locked in its place), no ``fork``, no limit of processor time,
and does not replace open files. Any system releases locks and closes files however a process ends.
"""

import contextlib
import errno
import functools
import importlib
import os
import select
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


def open_standard_streams() -> None:
    """Give standard streams that are closed to the null device, or a file opened later would get what libraries print.

    Python's own streams stay as they are.
    """
    with contextlib.suppress(OSError):
        handle = os.open(os.devnull, os.O_RDWR)
        while handle <= 2:
            handle = os.dup(handle)
        os.close(handle)


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def limit_processor_time(seconds: int) -> None:
    """Let the system end this process, without a picture of its memory, after so much time of a processor."""
    if resource is not None:
        _lower_limit(resource.RLIMIT_CPU, seconds)
        _lower_limit(resource.RLIMIT_CORE, 0)


def limit_memory(more: int) -> None:
    """Let this process take so many bytes more, where the system counts them; it gets no others."""
    with contextlib.suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        _lower_limit(resource.RLIMIT_AS, pages * resource.getpagesize() + more)


def _lower_limit(kind: int, wanted: int) -> None:
    """Lower a limit of this process, unless it is lower already; a system without this limit is left alone."""
    soft, hard = resource.getrlimit(kind)
    limits = [each for each in (wanted, soft, hard) if each != resource.RLIM_INFINITY]
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(kind, (min(limits), hard))


# Bytes by which a process that reads a file reports how far it got. Exit codes do not tell: where the signal of ended
# children is ignored, the system keeps none.
_BEGUN, _DONE = b"b", b"d"


def copy_ends_well(read: Callable[[], None], seconds: float) -> bool | None:
    """Return whether a copy of this process ends a task within a time on the wall; None if it could not begin."""
    receiver, sender = os.pipe()
    try:
        with warnings.catch_warnings():
            # Python 3.12 warns of other threads
            warnings.simplefilter("ignore", DeprecationWarning)
            process = os.fork()
        if not process:
            try:
                # the system ends it, whatever library it is in
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.setitimer(signal.ITIMER_REAL, seconds)
                # where standard streams are closed, the pipe may have their numbers
                apart = fcntl.fcntl(sender, fcntl.F_DUPFD, 3)
                carry_out(read, lambda report: os.write(apart, report))
            finally:
                os._exit(1)
        os.close(sender)
        sender = -1
        # another thread may have copied this process meanwhile, and the end of the pipe with it
        told, last = b"", time.monotonic() + seconds + 1
        while not told.endswith(_DONE) and select.select([receiver], [], [], max(last - time.monotonic(), 0))[0]:
            report = os.read(receiver, 1)
            if not report:
                break
            told += report
        # nobody may have waited for it yet, or the system itself has
        with contextlib.suppress(ChildProcessError):
            os.waitpid(process, 0)
    finally:
        for handle in (receiver, sender):
            if handle >= 0:
                os.close(handle)
    return _judged(told)


def _judged(told: bytes) -> bool | None:
    return told.endswith(_DONE) if told.startswith(_BEGUN) else None


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
import functools, importlib, json, os, pathlib, sys
sys.path[:], module, name, path, seconds = json.loads(sys.argv[1])
from historysim.basics import system
sender = os.dup(1)
read = functools.partial(getattr(importlib.import_module(module), name), pathlib.Path(path))
system.carry_out(system.limited(read, seconds), lambda report: os.write(sender, report))
"""


def ends_well(read: Callable[[Path], None], path: Path, seconds: int) -> bool:
    """Return whether a process that reads a file with a function of a module ends by itself, in this processor time.

    A library may read a damaged file without end, or end the process. True, too, where the system starts no process:
    the file is then read without this precaution.
    """
    well = None
    if COPIES_PROCESSES:
        # a copy of this process has all libraries, but waits for ever for locks that other threads hold
        with contextlib.suppress(OSError):
            well = copy_ends_well(limited(functools.partial(read, path), seconds), _SLOWER * seconds)
    if well is None or (not well and threading.active_count() > 1):
        well = _started_ends_well(read, path, seconds)
    return well is not False


def limited(read: Callable[[], None], seconds: int) -> Callable[[], None]:
    """Return a task that reads within a time of a processor."""

    def task() -> None:
        limit_processor_time(seconds)
        read()

    return task


def carry_out(task: Callable[[], None], report: Callable[[bytes], object]) -> None:
    """Carry out a task in this process, which has nothing else to do, prints nothing, reports, and ends here."""
    import faulthandler

    with contextlib.suppress(BaseException):
        faulthandler.disable()
        null = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(null, stream)
    report(_BEGUN)
    with contextlib.suppress(BaseException):
        task()
    report(_DONE)
    os._exit(0)


def _started_ends_well(read: Callable[[Path], None], path: Path, seconds: int) -> bool | None:
    """Do as `copy_ends_well` in a fresh Python; None, too, where there is no interpreter to start."""
    import json
    import subprocess

    task = json.dumps([sys.path, read.__module__, read.__name__, str(path.absolute()), seconds])
    try:
        done = subprocess.run(  # noqa: S603 - this Python, as it is
            [sys.executable, "-c", _STARTED, task],
            check=False,
            timeout=_SLOWER * seconds,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired as error:
        return _judged(error.stdout or b"")
    except OSError:
        # a program that embeds Python, a full process table
        return None
    return _judged(done.stdout)
