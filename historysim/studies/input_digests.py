"""What tells one content of a file that a scenario reads from another."""

import functools
import hashlib
from pathlib import Path

from historysim.basics.files import is_file

Stamp = tuple[str, int, int]
"""Path, size and time of change of a file, as far as it is there."""


def stamp(path: Path) -> Stamp:
    """Return what changes when a file does."""
    try:
        status = path.stat()
    except OSError:
        return str(path), -1, -1
    return str(path), status.st_size, status.st_mtime_ns


def content_digest(path: Path) -> str:
    """Return the SHA-256 of what a file holds; a text of its own where it cannot be read."""
    return _digest(stamp(path))


@functools.lru_cache(maxsize=256)
def _digest(of: Stamp) -> str:
    if not is_file(Path(of[0])):
        return "cannot be read"
    try:
        with open(of[0], "rb") as stream:  # noqa: PTH123 - the stamp has the text
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return "cannot be read"
