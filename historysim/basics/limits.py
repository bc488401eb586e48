"""How much is taken: limits far beyond what is measured, below what fills the memory; the environment raises them."""

import os
from pathlib import Path
from typing import IO

from historysim.errors import InputError

# The largest size of a number that is computed with, and the smallest of what gives others their scale, in SI.
LARGEST, SMALLEST = 1e60, 1e-60
# The largest coefficient of friction: HS_MOST_FRICTION of the C library, which says why.
MOST_FRICTION = 1e4
SIZE = f"a number of at most {LARGEST:g} in size"  # what a message expects of a number that is larger

LIMITS = {
    "STEPS": 100_000_000,  # rows of a history
    "POINTS": 1_000_000,  # of a sweep
    "SCENARIO_BYTES": 50_000_000,  # some million waypoints
    "KEY_PARTS": 64,  # names with dots between them, and tables within tables
    "LINE_BYTES": 20_000_000,  # of a text
    "BLOCKS": 5_000,  # tables of a text
    "COLUMNS": 20_000,  # of a table that is listed
    "SECONDS_OF_VALIDATION": 3,  # of walking the loads
    "HDF5_DEPTH": 32,  # groups within groups
    "HDF5_SECONDS": 5,  # of a processor, and two more for each MB up to 60, to read how a file is laid out
    "UNPACKED_BYTES": 1 << 28,  # of what a file holds compressed, or 100 times its size
}


def is_workable(number: float, smallest: float = 0.0) -> bool:
    """Return whether powers of a number, and its products with others, are numbers; no NaN is."""
    return smallest <= abs(number) <= LARGEST


def most(name: str) -> int:
    """Return a limit, as the environment raises or lowers it."""
    try:
        return int(float(os.environ.get(f"HISTORYSIM_MOST_{name}", "")))
    except (ValueError, OverflowError):
        return LIMITS[name]


def at_most(name: str) -> str:
    """Return what a message says of a limit: how much is expected at most, and what raises it."""
    return f"expected {most(name):,} at most ({raised_by(name)})"


def raised_by(name: str) -> str:
    """Return what a message says of how a limit is raised."""
    return f"the environment variable HISTORYSIM_MOST_{name} raises it"


def check_unpacked(unpacked: int, packed: int) -> None:
    """Check how many bytes a file of so many unpacks to; more than the limit, or 100 times that, is an InputError."""
    limit = max(most("UNPACKED_BYTES"), 100 * packed)
    if unpacked > limit:
        raise InputError(
            f"has {packed:,} bytes, which unpack to {unpacked:,} or more; expected {limit:,} at most "
            f"({raised_by('UNPACKED_BYTES')}): export it again without compression, or thin it"
        )


def check_archive(file: Path | IO[bytes], *, trusted: bool = True) -> None:
    """Check that a ZIP archive unpacks to no more than it may; anything else is left to its reader.

    What is `trusted` has a reader that takes no more of a member than the archive says; else each is unpacked.
    """
    # most commands have no archives
    import zipfile

    if not zipfile.is_zipfile(file):
        return
    with zipfile.ZipFile(file) as archive:
        packed = file.stat().st_size if isinstance(file, Path) else file.seek(0, 2)
        members = archive.infolist()
        unpacked = sum(member.file_size for member in members)
        check_unpacked(unpacked, packed)
        for member in () if trusted else members:
            # the size that it claims may be wrong
            unpacked -= member.file_size
            member.file_size = 1 << 62
            with archive.open(member) as stream:
                while block := stream.read(1 << 20):
                    unpacked += len(block)
                    check_unpacked(unpacked, packed)
