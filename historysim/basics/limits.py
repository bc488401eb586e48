"""Limits of inputs, far above measured data and below the memory of a computer; the environment changes them."""

import os
from pathlib import Path
from typing import IO

from historysim.errors import InputError

# Largest magnitude of numbers in computations, and smallest magnitude of numbers that scale others,
# in SI.
LARGEST, SMALLEST = 1e60, 1e-60
# Largest coefficient of friction: HS_MOST_FRICTION of the C library, which gives the reason.
MOST_FRICTION = 1e4
SIZE = f"a number of at most {LARGEST:g} in size"  # expected value in messages about larger numbers

LIMITS = {
    "STEPS": 100_000_000,  # rows of a history
    "POINTS": 1_000_000,  # of a sweep
    "SCENARIO_BYTES": 50_000_000,  # some million waypoints
    "KEY_PARTS": 64,  # names with dots between them, and tables within tables
    "LINE_BYTES": 20_000_000,  # of a text
    "BLOCKS": 5_000,  # tables of a text
    "COLUMNS": 20_000,  # of a table that is listed
    "SECONDS_OF_VALIDATION": 3,  # of replaying the loads
    "HDF5_DEPTH": 32,  # groups within groups
    # of a processor, and two more for each MB up to 60, to read how a file is laid out
    "HDF5_SECONDS": 5,
    "UNPACKED_BYTES": 1 << 28,  # unpacked size of a compressed file, or 100 times its size
}


def is_workable(number: float, smallest: float = 0.0) -> bool:
    """Return True if powers of a number and its products with others can be represented; False for NaN."""
    return smallest <= abs(number) <= LARGEST


def most(name: str) -> int:
    """Return a limit, which the environment may raise or lower."""
    try:
        return int(float(os.environ.get(f"HISTORYSIM_MOST_{name}", "")))
    except (ValueError, OverflowError):
        return LIMITS[name]


def at_most(name: str) -> str:
    """Describe a limit in a message: the largest value, and the variable that raises it."""
    return f"expected {most(name):,} at most ({describe_variable(name)})"


def describe_variable(name: str) -> str:
    """Describe the environment variable that raises a limit."""
    return f"the environment variable HISTORYSIM_MOST_{name} raises it"


def check_unpacked(unpacked: int, packed: int) -> None:
    """Raise InputError if a file unpacks to more bytes than the limit and than 100 times its size."""
    limit = max(most("UNPACKED_BYTES"), 100 * packed)
    if unpacked > limit:
        raise InputError(
            f"has {packed:,} bytes, which unpack to {unpacked:,} or more; expected {limit:,} at most "
            f"({describe_variable('UNPACKED_BYTES')}): export it again without compression, or thin it"
        )


def check_archive(file: Path | IO[bytes], *, trusted: bool = True) -> None:
    """Raise InputError if a ZIP archive unpacks to more bytes than allowed; other files are not checked.

    `trusted` if the reader of the archive reads no more of a member than the stated size; otherwise
    each is unpacked.
    """
    # imported here, since most commands do not read archives
    import zipfile

    if not zipfile.is_zipfile(file):
        return
    with zipfile.ZipFile(file) as archive:
        packed = file.stat().st_size if isinstance(file, Path) else file.seek(0, 2)
        members = archive.infolist()
        unpacked = sum(member.file_size for member in members)
        check_unpacked(unpacked, packed)
        for member in () if trusted else members:
            # the stated size may be wrong
            unpacked -= member.file_size
            member.file_size = 1 << 62
            with archive.open(member) as stream:
                while block := stream.read(1 << 20):
                    unpacked += len(block)
                    check_unpacked(unpacked, packed)
