"""The files that a scenario reads, and what tells one content of them from another."""

import functools
import hashlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs

from historysim.scenario.scenario import Scenario

Stamp = tuple[str, int, int]
"""Path, size and time of change of a file, as far as it is there."""


def files_of(section: Any, scenario: Scenario) -> Iterator[Path]:
    """Yield the files that a section of a scenario names, or its document, in it and in what stands within it."""
    within: Iterable[tuple[Any, Any]] = ()
    if attrs.has(type(section)):
        within = attrs.asdict(section, recurse=False).items()
    elif isinstance(section, Mapping):
        within = section.items()
    elif isinstance(section, tuple | list):
        within = enumerate(section)
    for key, value in within:
        if key == "file" and value is not None:
            names = (value,) if isinstance(value, str) else value
            yield from (scenario.path.parent / name for name in names)
        elif not isinstance(value, str | int | float):
            yield from files_of(value, scenario)


def stamp(path: Path) -> Stamp:
    """Return what changes when a file does."""
    try:
        found = path.stat()
    except OSError:
        return str(path), -1, -1
    return str(path), found.st_size, found.st_mtime_ns


def content_digest(path: Path) -> str:
    """Return the SHA-256 of what a file holds; a text of its own where it cannot be read."""
    return _digest(stamp(path))


@functools.lru_cache(maxsize=256)
def _digest(of: Stamp) -> str:
    try:
        with open(of[0], "rb") as stream:  # noqa: PTH123 - the stamp has the text
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return "cannot be read"
