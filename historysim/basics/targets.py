"""What may be written where.

An output is never a file that the command reads. It is replaced only if it is of the kind that the command writes, or
with force. It is never a folder, link, device, FIFO or socket.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from historysim.basics.files import beginning, check_replaceable, is_file, is_netcdf
from historysim.errors import InputError

LOOKED_AT = 1 << 16  # bytes at either end of a file in which it says who made it
MARK = b"historysim"


class OutputFormat(NamedTuple):
    """A kind of file that is written."""

    name: str  #: as messages call it: ``"a result of historysim"``
    endings: tuple[str, ...]
    is_own: Callable[[Path], bool]  #: whether this program has written a file that is there


class Output(NamedTuple):
    """A file that is to be written; its ending decides which of the forms it has."""

    path: Path
    forms: tuple[OutputFormat, ...]

    @property
    def form(self) -> OutputFormat:
        """The form of its ending; another ending is an InputError."""
        ending = self.path.suffix
        for form in self.forms:
            if ending.lower() in form.endings:
                return form
        known = " or ".join(each for form in self.forms for each in form.endings)
        raise InputError(f"{self.path}: {ending or 'no'} ending; expected {known}, by which it is written")


def check_outputs(outputs: Iterable[Output], reads: Iterable[Path], *, force: bool = False) -> None:
    """Check that outputs break no rule, with the files that the command reads; else it is an InputError.

    ``force`` also replaces files of other kinds, never one that is read.
    """
    used = list(reads)
    for output in outputs:
        path = output.path
        check_place(path)
        if any(is_same(path, other) for other in used):
            raise InputError(f"{path}: would overwrite what it is made from; choose another name (-o)")
        form = output.form
        if not force and is_file(path) and path.stat().st_size and not form.is_own(path):
            raise InputError(
                f"{path}: is there already, and is not {form.name}, so that it is not replaced; choose another name, "
                "or give --force (in Python force=True)"
            )
        used.append(path)


def check_place(path: Path) -> None:
    """Check that a regular file may stand under a name, in a folder that is there; else it is an InputError."""
    try:
        is_folder, has_place = path.is_dir(), path.parent.is_dir()
    except (OSError, ValueError) as error:
        raise InputError(f"{str(path)!r}: cannot be the name of a file here ({error})") from error
    if is_folder:
        raise InputError(f"{path}: is a folder; expected the name of a file to write")
    check_replaceable(path)
    if not has_place:
        raise InputError(f"{path}: there is no folder {path.parent}; make it first")


def is_same(path: Path, other: Path) -> bool:
    """Return whether two names are of one file, by device and inode where it is there, else as they are written."""
    try:
        return path.absolute() == other.absolute() or path.samefile(other)
    except (OSError, ValueError):
        return False


def netcdf(name: str, *contents: str) -> OutputFormat:
    """Return the form of a netCDF file with one of these as attribute ``content``; without any, of a history."""
    return OutputFormat(name, (".nc",), lambda path: _content(path) in (contents or ("",)))


def marked(name: str, *endings: str, mark: bytes = MARK) -> OutputFormat:
    """Return the form of a file that names this program at one of its ends."""
    return OutputFormat(name, endings, lambda path: mark in _ends(path))


def csv_table(name: str, *headers: str) -> OutputFormat:
    """Return the form of a table (CSV) with a header that begins with these names of columns, without units."""

    def is_own(path: Path) -> bool:
        line, end, _ = beginning(path, LOOKED_AT).partition(b"\r\n")
        cells = line.decode("utf-8", "replace").split(",")
        names = ",".join(cell.partition(" ")[0] for cell in cells) + ","
        return bool(end) and any(names.startswith(f"{header},") for header in headers)

    return OutputFormat(name, (".csv",), is_own)


def unmarked(name: str, *endings: str) -> OutputFormat:
    """Return the form of a file without a mark of this program: an existing one is replaced by force alone."""
    return OutputFormat(name, endings, lambda _: False)


RESULT = netcdf("a result of historysim")
LOG = marked("the log of a run", ".history", mark=b"CREATE TABLE chain (number INTEGER PRIMARY KEY, events INTEGER")
PICTURE = marked("a picture of historysim", ".png", ".pdf", ".svg")
PAGE = marked("a page of historysim", ".html", ".htm")
FITTED = marked("a fitted scenario", ".toml", mark=b"# fitted")
SUGGESTED = unmarked("a scenario to start from", ".toml")


def _ends(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            first = stream.read(LOOKED_AT)
            stream.seek(max(stream.seek(0, 2) - LOOKED_AT, 0))
            return first + stream.read(LOOKED_AT)
    except OSError:
        return b""


def _content(path: Path) -> str | None:
    """Return the attribute ``content`` of a file of this program, empty where it has none; None of any other."""
    if not is_netcdf(path):
        return None
    import netCDF4

    from historysim.basics.hdf5 import check_contained

    # damaged, or of another form, where it cannot be opened
    with suppress(OSError, RuntimeError, AttributeError, InputError):
        check_contained(path)
        with netCDF4.Dataset(path) as file:
            known = {
                name: str(file.getncattr(name)) for name in ("source", "history", "content") if name in file.ncattrs()
            }
            if "historysim_version" in file.ncattrs() or any("historysim" in text for text in known.values()):
                return known.get("content", "")
    return None
