"""What a file is, by its first bytes."""

from pathlib import Path

from historysim.basics.files import is_file, what_is_there

_SQLITE = b"SQLite format 3\x00"
_NETCDF = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02", b"CDF\x05")

_TOLD = {
    _SQLITE: "is the log of a run, or another SQLite database",
    **dict.fromkeys(_NETCDF, "is a netCDF or HDF5 file, such as a result"),
    **dict.fromkeys((b"\x89PNG", b"%PDF", b"\xff\xd8\xff", b"GIF8"), "is a picture"),
    b"PK\x03\x04": "is a ZIP archive, such as a workbook or NPZ",
}


def is_log(path: Path) -> bool:
    """Return whether a file is a SQLite database, as the log of a run is; False where it cannot be read."""
    return beginning(path).startswith(_SQLITE)


def is_netcdf(path: Path) -> bool:
    """Return whether a file is netCDF, as a result is, or other HDF5; False where it cannot be read."""
    return beginning(path).startswith(_NETCDF)


def told_kind(path: Path) -> str:
    """Return what stands under a name, to be said before what was expected: ``"is a folder"``.

    It is ``""`` where this cannot be told: a text, a damaged file, one that may not be read.
    """
    if came := what_is_there(path):
        return came
    first = beginning(path)
    for known, told in _TOLD.items():
        if first.startswith(known):
            return told
    return "is a scenario" if path.suffix == ".toml" else ""


def beginning(path: Path, size: int = 16) -> bytes:
    """Return the first bytes of a regular file; none of what is none, or cannot be read."""
    if not is_file(path):
        # a FIFO would wait for somebody to write
        return b""
    try:
        with path.open("rb") as stream:
            return stream.read(size)
    except (OSError, ValueError):
        return b""
