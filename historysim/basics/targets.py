"""What may be written where: an output takes the place of nothing but an older output of its own kind.

Four rules hold for every file that is written, and `check_outputs` is the one place where they stand. An output is
none of the files that are read for it. Its ending says what it is. What stands under its name already is replaced
only where it is of the kind that is written, or the user insists. And it is a regular file: no folder, link, device,
FIFO or socket.
"""

import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from historysim.basics.file_kinds import beginning, is_netcdf
from historysim.basics.files import check_replaceable, is_file
from historysim.errors import InputError

LOOKED_AT = 1 << 16
"""Bytes at either end of a file in which it says who made it."""
MARK = b"historysim"


class OutputFormat(NamedTuple):
    """A kind of file that is written.

    Attributes
    ----------
    name : str
        What a message calls it: ``"a result of historysim"``.
    endings : tuple of str
    is_own : callable
        Whether a file that is there is one that this program has written.
    """

    name: str
    endings: tuple[str, ...]
    is_own: Callable[[Path], bool]


class Output(NamedTuple):
    """A file that is to be written.

    Attributes
    ----------
    path : Path
    forms : tuple of OutputFormat
        What can be written there; its ending decides.
    """

    path: Path
    forms: tuple[OutputFormat, ...]

    @property
    def form(self) -> OutputFormat:
        """What its ending says that it is.

        Raises
        ------
        InputError
            Another ending than those that can be written.
        """
        ending = self.path.suffix
        for form in self.forms:
            if ending.lower() in form.endings:
                return form
        known = " or ".join(each for form in self.forms for each in form.endings)
        raise InputError(f"{self.path}: {ending or 'no'} ending; expected {known}, by which it is written")


def check_outputs(outputs: Iterable[Output], reads: Iterable[Path], *, force: bool = False) -> None:
    """Check that files can be written, and that nothing is lost by it.

    Parameters
    ----------
    outputs : iterable of Output
    reads : iterable of Path
        Files that what is written comes from.
    force : bool
        Replace files of other kinds, too; never one that is read.

    Raises
    ------
    InputError
        An output that breaks one of the rules; the message names it, and says how to mend it.
    """
    taken = list(reads)
    for output in outputs:
        path = output.path
        check_place(path)
        if any(is_same(path, other) for other in taken):
            raise InputError(f"{path}: would overwrite what it is made from; choose another name")
        form = output.form
        if not force and is_file(path) and path.stat().st_size and not form.is_own(path):
            raise InputError(
                f"{path}: is there already, and is not {form.name}, so that it is not replaced; choose another name, "
                "or say --force (in Python force=True)"
            )
        taken.append(path)


def check_place(path: Path) -> None:
    """Check that a regular file may stand under a name.

    Raises
    ------
    InputError
        There is a folder, a link or a device, or no folder to put it into, or the system takes no such name.
    """
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder; expected the name of a file to write")
        check_replaceable(path)
        if not path.parent.is_dir():
            raise InputError(f"{path}: there is no folder {path.parent}; make it first")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{str(path)!r}: cannot be the name of a file here ({error})") from error
    if problem := refused_elsewhere(path.name):
        raise InputError(f"{path}: {problem}; choose another name")


def is_same(path: Path, other: Path) -> bool:
    """Return whether two names are of one file, by device and inode where it is there, else as they are written."""
    try:
        return path.absolute() == other.absolute() or path.samefile(other)
    except (OSError, ValueError):
        return False


_DEVICE = re.compile(r"(?i)(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])\s*(\.|$)")


def refused_elsewhere(name: str, *, windows: bool | None = None) -> str:
    """Return why Windows takes a name for something else than a file; empty where it does not, or on other systems."""
    if not (os.name == "nt" if windows is None else windows):
        return ""
    if _DEVICE.match(name):
        return "is the name of a device on Windows"
    if found := set(name) & set('<>:"|?*'):
        return f"holds {min(found)!r}, which Windows takes in no name"
    return "ends with a dot or a space, which Windows drops" if name.endswith((".", " ")) else ""


def netcdf(name: str, *contents: str) -> OutputFormat:
    """Return the form of a netCDF file whose attribute ``content`` is one of these; of none, a history."""
    return OutputFormat(name, (".nc",), lambda path: _told_content(path) in (contents or ("",)))


def marked(name: str, *endings: str, mark: bytes = MARK) -> OutputFormat:
    """Return the form of a file that names this program at one of its ends."""
    return OutputFormat(name, endings, lambda path: mark in _ends(path))


def csv_table(name: str, *headers: str) -> OutputFormat:
    """Return the form of a table (CSV) whose header begins with one of these names of columns, without their units."""

    def is_own(path: Path) -> bool:
        line, end, _ = beginning(path, LOOKED_AT).partition(b"\r\n")
        cells = line.decode("utf-8", "replace").split(",")
        names = ",".join(cell.partition(" ")[0] for cell in cells) + ","
        return bool(end) and any(names.startswith(f"{header},") for header in headers)

    return OutputFormat(name, (".csv",), is_own)


def unmarked(name: str, *endings: str) -> OutputFormat:
    """Return the form of a file that does not say who made it: one that is there is never replaced unasked."""
    return OutputFormat(name, endings, lambda _: False)


RESULT = netcdf("a result of historysim")
LOG = marked("the log of a run", ".history", mark=b"CREATE TABLE chain (number INTEGER PRIMARY KEY, events INTEGER")
PICTURE = marked("a picture of historysim", ".png", ".pdf", ".svg")
MOVING = marked("a moving picture of historysim", ".gif", ".mp4", ".webm")
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


def _told_content(path: Path) -> str | None:
    """Return the attribute ``content`` of a file of this program, empty where it has none; None of any other."""
    if not is_netcdf(path):
        return None
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            told = {name: _text(file.attrs[name]) for name in ("source", "history", "content") if name in file.attrs}
            told["historysim_version"] = "historysim" if "historysim_version" in file.attrs else ""
    except (OSError, RuntimeError, KeyError, ValueError, TypeError):
        # damaged, or of another form
        return None
    content = told.pop("content", "")
    return content if any("historysim" in text for text in told.values()) else None


def _text(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
