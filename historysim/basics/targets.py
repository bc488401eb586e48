"""Rules for output files, and the formats by which existing outputs are recognised.

An output is never a file that the command reads. An existing file is replaced only if it has the
format that the command writes, or with force. An output is never a folder, link, device, FIFO or
socket. A zarr store is a folder; it replaces only an earlier store of this program, with force, if
nobody has added a member to it.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from historysim.basics.files import beginning, check_replaceable, is_file, is_netcdf, is_zarr
from historysim.basics.stores import foreign_member
from historysim.basics.wording import quote
from historysim.errors import InputError

LOOKED_AT = 1 << 16  # bytes at either end of a file that are searched for the mark of this program
MARK = b"historysim"


class OutputFormat(NamedTuple):
    """Format of an output file."""

    name: str  #: name in messages: ``"a result of historysim"``
    endings: tuple[str, ...]
    is_own: Callable[[Path], bool]  #: returns True if this program has written an existing file


class Output(NamedTuple):
    """Output file; its ending selects one of the formats."""

    path: Path
    forms: tuple[OutputFormat, ...]

    @property
    def form(self) -> OutputFormat:
        """Format selected by the ending; InputError for an unknown ending."""
        ending = self.path.suffix
        for form in self.forms:
            if ending.lower() in form.endings:
                return form
        endings = " or ".join(known_ending for form in self.forms for known_ending in form.endings)
        raise InputError(
            f"{self.path}: {ending or 'no'} ending; expected {endings}, by which it is written"
        )


def check_outputs(outputs: Iterable[Output], reads: Iterable[Path], *, force: bool = False) -> None:
    """Raise InputError if an output violates the rules, given the files that the command reads.

    ``force`` also replaces files of other formats, but never a file that is read.
    """
    used = list(reads)
    for output in outputs:
        path = output.path
        is_store = STORE in output.forms and is_store_name(path)
        check_place(path, store=is_store)
        if any(is_same(path, read_path) for read_path in used):
            raise InputError(
                f"{path}: would overwrite an input of the command; choose another name (-o)"
            )
        if is_store and path.is_dir():
            check_store_replaceable(path, force=force)
        form = output.form
        if not force and is_file(path) and path.stat().st_size and not form.is_own(path):
            raise InputError(
                f"{path}: exists already and is not {form.name}, so that it is not replaced; choose another name, "
                "or give --force (in Python force=True)"
            )
        used.append(path)


def check_place(path: Path, *, store: bool = False) -> None:
    """Raise InputError unless a regular file, or a store, can be written under a name in an existing folder."""
    try:
        is_folder, has_place = path.is_dir(), path.parent.is_dir()
    except (OSError, ValueError) as error:
        raise InputError(f"{str(path)!r}: cannot be the name of a file here ({error})") from error
    if store and (is_folder or is_file(path)) and not STORE.is_own(path):
        raise InputError(
            f"{path}: exists already and is not {STORE.name}; choose another name, or remove it"
        )
    if is_folder and not store:
        raise InputError(f"{path}: is a folder; expected the name of a file to write")
    if not is_folder:
        check_replaceable(path)
    if not has_place:
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it first")


def check_store_replaceable(path: Path, *, force: bool) -> None:
    """Raise InputError unless an existing zarr store may be replaced: by force, if it has no foreign member."""
    if not force:
        raise InputError(
            f"{path}: exists already, and a store is never replaced unrequested; choose another name, or give "
            "--force (in Python force=True)"
        )
    try:
        member = foreign_member(path)
    except (InputError, OSError, ValueError) as error:
        raise InputError(
            f"{path}: is damaged, so that it is not replaced ({error}); remove it yourself"
        ) from error
    if member:
        raise InputError(
            f"{path}: holds {quote(member)}, which this version of historysim has not written, so that it is not "
            "replaced; choose another name, or move the store away"
        )


def is_same(path: Path, other: Path) -> bool:
    """Return True if two paths denote one file: by device and inode if it exists, otherwise by name."""
    try:
        return path.absolute() == other.absolute() or path.samefile(other)
    except (OSError, ValueError):
        return False


def netcdf(name: str, *contents: str) -> OutputFormat:
    """Return the format of netCDF files with one of these values of ``content``; by default the format of a history."""
    return OutputFormat(name, (".nc",), lambda path: _content(path) in (contents or ("",)))


def signed_format(name: str, *endings: str, mark: bytes = MARK) -> OutputFormat:
    """Return the format of files that name this program near one of their ends."""
    return OutputFormat(name, endings, lambda path: mark in _read_ends(path))


def csv_table(name: str, *headers: str) -> OutputFormat:
    """Return the format of tables (CSV) whose header starts with these column names, without units."""

    def is_own(path: Path) -> bool:
        line, line_end, _ = beginning(path, LOOKED_AT).partition(b"\r\n")
        cells = line.decode("utf-8", "replace").split(",")
        names = ",".join(cell.partition(" ")[0] for cell in cells) + ","
        return bool(line_end) and any(names.startswith(f"{header},") for header in headers)

    return OutputFormat(name, (".csv",), is_own)


def format_without_mark(name: str, *endings: str) -> OutputFormat:
    """Return the format of files without a mark of this program, which are replaced by force only."""
    return OutputFormat(name, endings, lambda _: False)


RESULT = netcdf("a result of historysim")
STORE = OutputFormat(
    "a zarr store of historysim", (".zarr",), lambda path: is_zarr(path) and _is_own_store(path)
)
LOG = signed_format(
    "the log of a run",
    ".history",
    mark=b"CREATE TABLE chain (number INTEGER PRIMARY KEY, events INTEGER",
)
PICTURE = signed_format("a picture of historysim", ".png", ".pdf", ".svg")
PAGE = signed_format("a page of historysim", ".html", ".htm")
FITTED = signed_format("a fitted scenario", ".toml", mark=b"# fitted")
SUGGESTED = format_without_mark("a scenario to start from", ".toml")


def is_store_name(path: Path) -> bool:
    """Return whether a path names a zarr store by its ending."""
    return path.suffix.lower() in STORE.endings


def _is_own_store(path: Path) -> bool:
    return any(
        b'"historysim_version"' in beginning(path / name, LOOKED_AT)
        for name in ("zarr.json", ".zattrs")
    )


def _read_ends(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            head = stream.read(LOOKED_AT)
            stream.seek(max(stream.seek(0, 2) - LOOKED_AT, 0))
            return head + stream.read(LOOKED_AT)
    except OSError:
        return b""


def _content(path: Path) -> str | None:
    """Return the attribute ``content`` of a netCDF file of this program, empty if it has none; None for other files."""
    if not is_netcdf(path):
        return None
    import netCDF4

    from historysim.basics.hdf5 import check_contained

    # a file that cannot be opened is damaged or has another format
    with suppress(OSError, RuntimeError, AttributeError, InputError):
        check_contained(path)
        with netCDF4.Dataset(path) as file:
            attributes = {
                name: str(file.getncattr(name))
                for name in ("source", "history", "content")
                if name in file.ncattrs()
            }
            if "historysim_version" in file.ncattrs() or any(
                "historysim" in text for text in attributes.values()
            ):
                return attributes.get("content", "")
    return None
