"""HDF5 files from anywhere: whether one stands for itself, and can be read by libraries that trust it.

Inside an HDF5 file others can be named: by links to other files, by datasets whose bytes lie elsewhere (external
storage) or are those of other files (virtual datasets). Whoever opens such a file reads whatever its maker liked, or
waits for a FIFO. The netCDF library also ends the process at a group that holds itself, and follows groups within
groups on the stack.
"""

from pathlib import Path
from typing import Any

from historysim.basics.file_kinds import beginning
from historysim.basics.limits import at_most, most
from historysim.errors import InputError

MOST_EMPTY = 1 << 26
"""Bytes that a dataset may claim while nothing of it is there."""
MOST_RATIO = 100_000
"""Bytes that a dataset may claim for each that is there; compressing numbers that are all alike gives some 10,000."""

_MAGIC = b"\x89HDF\r\n\x1a\n"


def check_contained(path: Path, *, by_h5py: bool = False) -> None:
    """Check that an HDF5 file stands for itself; any other file is left to its reader.

    Nothing of it is read but how it is laid out.

    Parameters
    ----------
    path : Path
    by_h5py : bool
        It is read by h5py, which is asked for a limited number of values, follows no link to another file, and bears a
        group that holds itself.

    Raises
    ------
    InputError
        It names other files, claims more than it holds, has groups that hold themselves or go too deep, or too many.
    """
    if not beginning(path).startswith(_MAGIC):
        return
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            _check(h5py, file, by_h5py=by_h5py)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        # damaged: its reader says so


def check_named(path: Path) -> None:
    """Check a file as `check_contained` does, and name it in the error."""
    try:
        check_contained(path)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _check(h5py: Any, file: Any, *, by_h5py: bool) -> None:
    # by hand, since the library walks on the stack, and without end where a group holds itself
    root = h5py.h5g.open(file.id, b"/")
    first = _address(h5py, root)
    waiting: list[tuple[Any, str, tuple[Any, ...]]] = [(root, "", (first,))]
    seen = {first}
    while waiting:
        group, path, above = waiting.pop()
        for raw in group:
            name = f"{path}/{raw.decode('utf-8', 'replace')}"
            kind = group.links.get_info(raw).type
            if kind == h5py.h5l.TYPE_EXTERNAL and not by_h5py:
                raise InputError(f"{name!r} is a link to another file; expected one that stands for itself: put it in")
            if kind != h5py.h5l.TYPE_HARD:
                continue
            try:
                item = h5py.h5o.open(group, raw)
            except (KeyError, RuntimeError, OSError):
                continue
            address = _address(h5py, item)
            if address in above and not by_h5py:
                raise InputError(f"{name!r} holds itself; expected groups within groups")
            if address in seen:
                continue
            seen.add(address)
            if len(seen) > most("HDF5_OBJECTS"):
                raise InputError(f"has {len(seen):,} groups and datasets or more; {at_most('HDF5_OBJECTS')}")
            if isinstance(item, h5py.h5g.GroupID):
                if len(above) > most("HDF5_DEPTH"):
                    raise InputError(f"has groups within groups, {len(above)} deep; {at_most('HDF5_DEPTH')}")
                waiting.append((item, name, (*above, address)))
            elif isinstance(item, h5py.h5d.DatasetID):
                _check_dataset(h5py, item, name, by_h5py=by_h5py)


def _address(h5py: Any, item: Any) -> Any:
    info = h5py.h5o.get_info(item)
    return info.fileno, info.addr


def _check_dataset(h5py: Any, item: Any, name: str, *, by_h5py: bool) -> None:
    layout = item.get_create_plist()
    if layout.get_layout() == h5py.h5d.VIRTUAL or layout.get_external_count():
        raise InputError(f"{name!r} lies in other files; expected one that stands for itself: h5repack copies it whole")
    space = item.get_space()
    if by_h5py or space.get_simple_extent_type() != h5py.h5s.SIMPLE:
        return
    claimed, there = space.get_simple_extent_npoints() * item.get_type().get_size(), item.get_storage_size()
    if claimed > MOST_EMPTY and claimed > MOST_RATIO * there:
        raise InputError(
            f"{name!r} claims {claimed:,} bytes and holds {there:,}; expected what it claims: it is damaged, or was "
            "never written"
        )
