"""Files: existence, type by their first bytes, locks, and atomic replacement."""

import errno
import glob
import os
import re
import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from historysim.basics import system
from historysim.basics.system import sync_folder
from historysim.basics.wording import brief
from historysim.errors import HistorySimError, InputError

# Suffix of the name of a file while it is written: host and process of the writer, and a random
# number.
UNFINISHED = re.compile(r"\.(?P<host>[0-9a-f]{8})-(?P<process>[0-9]+)-[0-9a-f]{16}\.part")


SQLITE = b"SQLite format 3\x00"
_NETCDF = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02", b"CDF\x05")

_KINDS = {
    SQLITE: "is the log of a run, or another SQLite database",
    **dict.fromkeys(_NETCDF, "is a netCDF or HDF5 file, such as a result"),
    **dict.fromkeys((b"\x89PNG", b"%PDF", b"\xff\xd8\xff", b"GIF8"), "is a picture"),
    b"PK\x03\x04": "is a ZIP archive, such as a workbook or NPZ",
}


_PROBE_BYTES = 1 << 20  # a library that fails may have left a few pages free
# Causes that a user can remedy.
_CAUSES = {
    errno.ENOSPC: "the disk is full",
    getattr(errno, "EDQUOT", errno.ENOSPC): "the disk is full for this user (quota)",
    errno.EFBIG: "the file is too large for this disk or a limit (ulimit -f)",
    errno.EROFS: "the disk is read-only",
}


@contextmanager
def write_errors(path: Path, partial: Path) -> Iterator[None]:
    """Turn any exception of a library that cannot write `partial` into one OSError with `path` and the reason.

    Libraries report a full disk as almost anything: "NetCDF: HDF error", "Permission denied", an
    AttributeError in their own clean-up. Errors with another cause, and those that name another
    file, are passed on.
    """
    try:
        yield
    except (HistorySimError, MemoryError):
        raise
    except Exception as error:
        # other files that are read meanwhile have errors of their own
        named = error.filename if isinstance(error, OSError) else None
        if isinstance(named, str | bytes | os.PathLike):
            named = Path(os.fsdecode(named)).absolute()
        if named not in {None, partial.absolute(), path.absolute()}:
            raise
        failure = _refused_write(partial) or _system_error(error)
        if failure is None:
            raise
        raise OSError(failure.errno, write_reason(failure), str(path)) from error


def _refused_write(partial: Path) -> OSError | None:
    """Return the error of the system for more bytes at the end of a file; None if it accepts them."""
    try:
        size = partial.stat().st_size
        with partial.open("r+b", buffering=0) as stream:
            try:
                stream.seek(size)
                written = 0
                while written < _PROBE_BYTES:
                    written += stream.write(bytes(_PROBE_BYTES - written))
            finally:
                stream.truncate(size)
    except OSError as error:
        return error if error.errno in _CAUSES else None
    return None


def _system_error(error: BaseException) -> OSError | None:
    """Return the system error behind an exception, or behind an error of the netCDF library, which hides it."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and (cause is error or cause.errno in _CAUSES):
            return cause
        cause = cause.__cause__ or cause.__context__
    # netCDF4 has no other type of error for refusals of the system
    if isinstance(error, RuntimeError) and str(error).startswith("NetCDF: "):
        return OSError(errno.EIO, f"it cannot be written ({error})")
    return None


def write_reason(error: OSError) -> str:
    """Return the cause of a system error in words, followed by the message of the system."""
    text, cause = error.strerror or str(error), _CAUSES.get(error.errno or 0, "")
    if not cause or cause in text:
        return text
    return f"{cause} ({text})"


@contextmanager
def replacing(path: Path, ending: str = "") -> Iterator[Path]:
    """Yield the path of an empty file that replaces another file when the block ends without an error.

    The file is hidden in the same folder, and on the disk before it is renamed. Files of killed
    processes for the same target are removed. InputError if `path` is a link, device or FIFO; an
    OSError names `path`, never the hidden file.
    """
    check_replaceable(path)
    tidy(path)
    token = f"{system.host()}-{os.getpid()}-{os.urandom(8).hex()}"
    temporary = path.with_name(f".{path.name}.{token}.part{ending}")
    try:
        with write_errors(path, temporary):
            os.close(
                os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY | system.NO_LINK, 0o666)
            )
            yield temporary
            publish(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def publish(hidden: Path, path: Path) -> None:
    """Rename a hidden file: first its bytes reach the disk, then its name. An OSError names `path`."""
    with write_errors(path, hidden):
        sync_file(hidden)
        hidden.replace(path)
        sync_folder(path.parent)


def tidy(path: Path) -> None:
    """Remove unfinished files of a target that dead processes of this machine have left."""
    with suppress(OSError):
        for partial in os.scandir(path.parent):
            match = UNFINISHED.match(partial.name, len(path.name) + 1)
            if (
                match is None
                or not partial.name.startswith(f".{path.name}.")
                or match["host"] != system.host()
            ):
                continue
            with suppress(OSError):
                if is_own(partial.stat(follow_symlinks=False)) and not system.is_running(
                    int(match["process"])
                ):
                    os.unlink(partial.path)  # noqa: PTH108 - of an entry


def check_replaceable(path: Path) -> None:
    """Check that a path is free, a regular file or a folder; otherwise InputError."""
    if path.is_symlink():
        raise InputError(
            f"{path}: is a link; expected the name of a file to write, such as that to which it leads"
        )
    try:
        mode = path.lstat().st_mode
    except (OSError, ValueError):
        return
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise InputError(f"{path}: is {_type(mode)}; expected the name of a file to write")


def own_file(path: Path, *, shared: bool = False, begins: tuple[bytes, ...] = ()) -> int:
    """Open a file with a predictable name for reading and writing, created if missing; return its handle.

    OSError unless it is a regular file of this user, with no other name, that is empty or begins as
    one of `begins`; a `shared` file may belong to any user and have any contents.
    """
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | system.NO_LINK | system.NO_WAIT, 0o666)
    except OSError as error:
        if path.is_symlink():
            raise OSError(
                error.errno, f"{path.name} is a link, which is not followed; remove it", str(path)
            ) from None
        if path.is_dir():
            raise OSError(
                error.errno, f"{path.name} is a folder; move it away", str(path)
            ) from None
        raise
    status, number, problem = os.fstat(handle), 0, ""
    if not (is_own(status) or (shared and stat.S_ISREG(status.st_mode))):
        number, problem = errno.EPERM, "is not a regular file of yours alone; remove it"
    elif not shared:
        signature = os.read(handle, 16)
        os.lseek(handle, 0, os.SEEK_SET)
        if signature and not signature.startswith(begins):
            number, problem = errno.EEXIST, "holds something else than historysim; move it away"
    if problem:
        os.close(handle)
        raise OSError(number, f"{path.name} {problem}", str(path))
    return handle


def is_own(status: os.stat_result) -> bool:
    """Return True if a file is regular, belongs to this user, and has no other name."""
    return (
        stat.S_ISREG(status.st_mode)
        and status.st_nlink == 1
        and status.st_uid == system.user(status)
    )


def as_path(path: "str | os.PathLike[str]") -> Path:
    """Convert an argument to a path; otherwise InputError."""
    try:
        return Path(path)
    except TypeError:
        raise InputError(f"path is {brief(path)}; expected the name of a file") from None


# Formats by the endings of their names, and what writes them.
_WRITERS = {
    ".nc": "netCDF: hs.write_netcdf(table, path), or historysim run -o NAME.nc",
    ".csv": "a table: hs.write_csv(table, path)",
    ".zarr": 'a zarr store: hs.run(scenario, "NAME.zarr"), or history.to_zarr("NAME.zarr") of xarray',
    ".history": "the log of a run: hs.EventLog.create(path, ensemble, events), or historysim run",
    ".toml": "a scenario",
    ".json": "a reduced model: hs.reduce(scenario, elements=8).write(path)",
    ".fmu": "a unit for co-simulation: hs.write_fmu(scenario, path)",
    ".html": "a page: hs.report(history, path)",
    **dict.fromkeys((".png", ".pdf", ".svg"), "a picture: hs.plot(history).savefig(path)"),
    **dict.fromkeys((".xlsx", ".npz", ".npy", ".mat", ".parquet", ".txt"), "another format"),
}


def path_to_write(path: "str | os.PathLike[str]", ending: str) -> Path:
    """Return the path of a file to write; InputError if it has the ending of another format than `ending`."""
    path = as_path(path)
    suffix = path.suffix.lower()
    if suffix != ending and (written := _WRITERS.get(suffix)) is not None:
        raise InputError(f"{path}: {suffix} is the ending of {written}; expected {ending} here")
    return path


def is_file(path: Path) -> bool:
    """Return whether there is a file of this name; False for a name that the system does not take."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_file_set(path: Path) -> bool:
    """Return whether a path is a folder or a pattern with ``*`` or ``?``, and not the name of a file."""
    return not is_file(path) and (bool(re.search(r"[*?]", str(path))) or path.is_dir())


def list_file_set(path: Path, endings: Collection[str]) -> list[Path]:
    """List the files of a folder with one of the endings, or of a pattern, in natural order: 2 before 10.

    Raises InputError: no file, or a folder with files of different endings.
    """
    if path.is_dir():
        files = [
            file
            for file in path.iterdir()
            if file.suffix.lower() in endings and not file.name.startswith(".")
        ]
        found = sorted({file.suffix for file in files})
        if len(found) > 1:
            expected = f"expected one of them, as in {path.name}/*{found[0]}"
            raise InputError(
                f"{path.name}: is a folder of files that end in {', '.join(found)}; {expected}"
            )
    else:
        # brackets are part of a name
        pattern = re.sub(r"\[", "[[]", str(path))
        files = [Path(name) for name in glob.glob(pattern, recursive=True) if is_file(Path(name))]  # noqa: PTH207 - absolute patterns
    if not files:
        problem = "has no file of numbers" if path.is_dir() else "no file has such a name"
        raise InputError(
            f"{path.name}: {problem}; expected one or more in {path.absolute().parent}"
        )
    return sorted(files, key=_natural_order)


def _natural_order(path: Path) -> tuple[list[tuple[int, int, str]], str]:
    """Sort key of a path, in which digits count as a number."""
    parts = re.findall(r"[0-9]{1,300}|[^0-9]+", str(path))
    return [
        (0, int(part), "") if part.isdecimal() else (1, 0, part.casefold()) for part in parts
    ], str(path)


def path_state(path: Path) -> str:
    """Return why a path is not a regular file, such as ``"is a folder"``; empty if it is one."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return "there is no such file"
    return "" if stat.S_ISREG(mode) else f"is {_type(mode)}"


def _type(mode: int) -> str:
    types = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a FIFO", stat.S_IFSOCK: "a socket"}
    return types.get(stat.S_IFMT(mode), "a device")


def sync_file(path: Path) -> None:
    """Write the contents of a file to the disk (fsync)."""
    handle = os.open(path, os.O_RDWR | system.NO_LINK)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def is_log(path: Path) -> bool:
    """Return whether a file is a SQLite database, as the log of a run is; False where it cannot be read."""
    return beginning(path).startswith(SQLITE)


def is_netcdf(path: Path) -> bool:
    """Return whether a file is netCDF, as a result is, or other HDF5; False where it cannot be read."""
    return beginning(path).startswith(_NETCDF)


def is_zarr(path: Path) -> bool:
    """Return whether a folder is a zarr store; False where it cannot be read."""
    return any(is_file(path / name) for name in ("zarr.json", ".zgroup"))


def kind_text(path: Path) -> str:
    """Describe the file type at a path, such as ``"is a folder"``; empty for a text, or an unreadable file."""
    if problem := path_state(path):
        return problem
    signature = beginning(path)
    for file_signature, text in _KINDS.items():
        if signature.startswith(file_signature):
            return text
    return "is a scenario" if path.suffix == ".toml" else ""


def beginning(path: Path, size: int = 16) -> bytes:
    """Return the first bytes of a regular file; empty for other or unreadable files."""
    if not is_file(path):
        # a FIFO would wait for somebody to write
        return b""
    try:
        with path.open("rb") as stream:
            return stream.read(size)
    except (OSError, ValueError):
        return b""


class WriterLock:
    """Advisory lock on the file itself, which remains when it is renamed; the system releases it in any case.

    SQLite locks otherwise (POSIX record locks, not ``flock``), so readers do not meet it. With
    `make`, the file is made where there is none. OSError: another writer has it, or the file cannot
    be opened to write.
    """

    def __init__(self, path: Path, *, make: bool = False, begins: tuple[bytes, ...] = ()) -> None:
        self._path = path
        self._handle: int | None = None
        free = True
        while free and self._handle is None:
            self._handle = (
                own_file(path, begins=begins) if make else os.open(path, os.O_RDWR | system.OWN)
            )
            try:
                free = system.lock_file(self._handle)
                # the file may have been renamed or replaced between the two calls
                same = (
                    free and path.exists() and os.path.samestat(os.fstat(self._handle), path.stat())
                )
            except BaseException:
                self.release()
                raise
            if not same:
                self.release()
        if not free:
            busy = "another process is writing it; wait until it is done, or end it (readers are not held up)"
            raise OSError(errno.EAGAIN, busy, str(path))

    def rename(self, path: Path) -> "WriterLock":
        """Rename the locked file, replacing another file, and return its lock."""
        if not system.REPLACES_OPEN_FILES:
            self.release()
        with write_errors(path, self._path):
            self._path.replace(path)
        return self if system.REPLACES_OPEN_FILES else WriterLock(path)

    def remove(self) -> None:
        """Remove the file and release the lock."""
        if system.REPLACES_OPEN_FILES:
            self._path.unlink(missing_ok=True)
        self.release()
        if not system.REPLACES_OPEN_FILES:
            # another process may have taken it
            with suppress(OSError):
                self._path.unlink(missing_ok=True)

    def release(self) -> None:
        """Release the lock."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
