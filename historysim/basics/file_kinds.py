"""What a file is, by its first bytes."""

from pathlib import Path

_SQLITE = b"SQLite format 3\x00"
_NETCDF = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02", b"CDF\x05")


def is_log(path: Path) -> bool:
    """Return whether a file is a SQLite database, as the log of a run is; False where it cannot be read."""
    return _beginning(path).startswith(_SQLITE)


def is_netcdf(path: Path) -> bool:
    """Return whether a file is netCDF, as a result is, or other HDF5; False where it cannot be read."""
    return _beginning(path).startswith(_NETCDF)


def _beginning(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return stream.read(16)
    except (OSError, ValueError):
        return b""
