"""Differences between operating systems: locks, links, syncing a folder, replacing open files, copies of processes.

Windows has no ``flock`` (a byte far beyond the end is locked instead), no ``fork`` and no limit of
processor time, and does not replace open files. All systems release locks and close files whenever
a process ends.
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

# Flags to open a file in binary mode, without inheritance by child processes.
OWN = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
NO_LINK = OWN | getattr(os, "O_NOFOLLOW", 0)  # the same flags, without following links
# True if a process can be copied (``fork``) regardless of its libraries; libraries of macOS may
# abort in the copy.
COPIES_PROCESSES = sys.platform == "linux"
NO_WAIT = getattr(os, "O_NONBLOCK", 0)  # flag to open a possible FIFO without waiting for a writer
# True if a file can be renamed and replaced while it is open
REPLACES_OPEN_FILES = os.name == "posix"

# Held while SQLite runs, which has internal locks: a fork waits for it, so that they are free in the
# copy.
fork_lock = threading.RLock()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=fork_lock.acquire,
        after_in_parent=fork_lock.release,
        after_in_child=fork_lock.release,
    )

_FAR = 1 << 43  # offset beyond the end of any file, within the addressable range of disks
_HELD = {errno.EAGAIN, errno.EACCES, errno.EDEADLK}
_NO_LOCKS = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP}


def lock_file(handle: int) -> bool:
    """Lock an open file for one writer; return False if another process holds the lock."""
    if fcntl is None:
        return _lock_on_windows(handle, _FAR, wait=False)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def lock_byte(handle: int, byte: int, *, wait: bool) -> bool:
    """Lock one byte of an open file; return False if another process holds it. Disks without locks always grant it."""
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
            # the waiting mode of msvcrt fails after ten seconds
            time.sleep(0.05)
        else:
            return True


def sync_folder(path: Path) -> None:
    """Flush the directory entries of a folder to disk, if the system does not do so itself."""
    if not hasattr(os, "O_DIRECTORY"):
        if not path.is_dir():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        return
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


_AT_FDCWD, _EXCHANGE = -100, 2  # of renameat2


def exchange_folders(folder: Path, other: Path) -> None:
    """Exchange the names of two folders; in one step on Linux, so that neither name is ever missing."""
    with contextlib.suppress(OSError, AttributeError):
        import ctypes

        rename: Any = ctypes.CDLL(None).renameat2
        if rename(_AT_FDCWD, os.fsencode(folder), _AT_FDCWD, os.fsencode(other), _EXCHANGE) == 0:
            return
    between = folder.with_name(f"{folder.name}.{os.urandom(8).hex()}")
    other.rename(between)
    try:
        folder.rename(other)
    except BaseException:
        between.rename(other)
        raise
    between.rename(folder)


def user(status: os.stat_result) -> int:
    """Return the user ID of this process; the owner of a file if the system has no user IDs."""
    return os.geteuid() if hasattr(os, "geteuid") else status.st_uid


@functools.cache
def host() -> str:
    """Return an eight-digit identifier of this machine and its process namespace, since machines may share disks."""
    import hashlib
    import platform

    name = platform.node()
    with contextlib.suppress(OSError):
        name += str(os.stat("/proc/self/ns/pid").st_ino)  # noqa: PTH116 - not a user's file
    return hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:8]


def is_running(process: int) -> bool:
    """Return True if a process with this ID is running; always False on systems that protect open files."""
    if os.name != "posix":
        # a signal would end the process there, and its open files cannot be removed anyway
        return False
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def open_standard_streams() -> None:
    """Open closed standard streams on the null device, so that no file opened later receives printed output.

    The stream objects of Python are unchanged.
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
    """Limit the processor time of this process [s], without a core dump when the system ends it."""
    if resource is not None:
        _lower_limit(resource.RLIMIT_CPU, seconds)
        _lower_limit(resource.RLIMIT_CORE, 0)


def limit_memory(more: int) -> None:
    """Limit the memory of this process to its present size plus a number of bytes, if the system supports it."""
    with contextlib.suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        _lower_limit(resource.RLIMIT_AS, pages * resource.getpagesize() + more)


def _lower_limit(kind: int, limit: int) -> None:
    """Lower a resource limit of this process, unless it is lower already or the system does not have it."""
    soft, hard = resource.getrlimit(kind)
    limits = [value for value in (limit, soft, hard) if value != resource.RLIM_INFINITY]
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(kind, (min(limits), hard))


# Bytes by which a process that reads a file reports its progress. Exit codes are lost if the parent
# ignores SIGCHLD.
_BEGUN, _DONE = b"b", b"d"


def copy_ends_well(read: Callable[[], None], seconds: float) -> bool | None:
    """Return True if a copy of this process completes a task within a wall-clock time; None if it could not start."""
    receiver, sender = os.pipe()
    try:
        with warnings.catch_warnings():
            # Python 3.12 warns of other threads
            warnings.simplefilter("ignore", DeprecationWarning)
            process = os.fork()
        if not process:
            try:
                # the default action of the signal ends the process within any library
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.setitimer(signal.ITIMER_REAL, seconds)
                # the pipe may have the number of a closed standard stream
                pipe = fcntl.fcntl(sender, fcntl.F_DUPFD, 3)
                carry_out(read, lambda report: os.write(pipe, report))
            finally:
                os._exit(1)
        os.close(sender)
        sender = -1
        # another thread may have forked meanwhile and inherited the end of the pipe
        reports, deadline = b"", time.monotonic() + seconds + 1
        while (
            not reports.endswith(_DONE)
            and select.select([receiver], [], [], max(deadline - time.monotonic(), 0))[0]
        ):
            report = os.read(receiver, 1)
            if not report:
                break
            reports += report
        # the child may have been reaped already
        with contextlib.suppress(ChildProcessError):
            os.waitpid(process, 0)
    finally:
        for handle in (receiver, sender):
            if handle >= 0:
                os.close(handle)
    return _interpret_reports(reports)


def _interpret_reports(reports: bytes) -> bool | None:
    return reports.endswith(_DONE) if reports.startswith(_BEGUN) else None


# Largest default number of threads: the single thread that integrates the history needs a quarter
# of a replay.
MOST_THREADS = 4


def resolve_threads(requested: int | None) -> int:
    """Return the number of threads; by default one per processor, up to `MOST_THREADS`."""
    if requested is None:
        return min(processors(), MOST_THREADS)
    if isinstance(requested, bool) or not isinstance(requested, int) or requested < 1:
        raise InputError(f"threads is {requested!r}; expected a whole number of 1 or more")
    return requested


_SLOWER = 3  # wall-clock over processor time, since other processes use the processor as well
_STARTED = """
import functools, importlib, json, os, pathlib, sys
sys.path[:], module, name, path, seconds = json.loads(sys.argv[1])
from historysim.basics import system
sender = os.dup(1)
read = functools.partial(getattr(importlib.import_module(module), name), pathlib.Path(path))
system.carry_out(system.limit_task(read, seconds), lambda report: os.write(sender, report))
"""


def ends_well(read: Callable[[Path], None], path: Path, seconds: int) -> bool:
    """Return True if a process that reads a file by a function of a module ends normally within this processor time.

    A library may loop on a damaged file, or abort the process. Also True if the system starts no
    process: the file is then read without this precaution.
    """
    well = None
    if COPIES_PROCESSES:
        # a copy of this process has all libraries loaded, but deadlocks on locks of other threads
        with contextlib.suppress(OSError):
            well = copy_ends_well(
                limit_task(functools.partial(read, path), seconds), _SLOWER * seconds
            )
    if well is None or (not well and threading.active_count() > 1):
        well = _started_ends_well(read, path, seconds)
    return well is not False


def limit_task(read: Callable[[], None], seconds: int) -> Callable[[], None]:
    """Return a task that reads within a limit of processor time."""

    def task() -> None:
        limit_processor_time(seconds)
        read()

    return task


def carry_out(task: Callable[[], None], report: Callable[[bytes], object]) -> None:
    """Run a task in this dedicated process without output, report its start and end, and exit."""
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
    """Run the check of `copy_ends_well` in a new interpreter; also None if no interpreter can be started."""
    import json
    import subprocess

    task = json.dumps([sys.path, read.__module__, read.__name__, str(path.absolute()), seconds])
    try:
        done = subprocess.run(  # noqa: S603 - the current interpreter
            [sys.executable, "-c", _STARTED, task],
            check=False,
            timeout=_SLOWER * seconds,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired as error:
        return _interpret_reports(error.stdout or b"")
    except OSError:
        # a program that embeds Python, a full process table
        return None
    return _interpret_reports(done.stdout)


def log_message(logger: str, level: str, text: str, *arguments: object) -> None:
    """Log a message at a level, as "info"; only if the program uses `logging`, whose import takes long."""
    if (logging := sys.modules.get("logging")) is not None:
        getattr(logging.getLogger(logger), level)(text, *arguments, stacklevel=2)
