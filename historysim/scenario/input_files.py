"""The files that a scenario reads."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs


def files_of(section: Any, folder: Path) -> Iterator[Path]:  # noqa: ANN401 - a section, or what TOML holds
    """Yield the files that a section of a scenario names, or its document, in it and in what stands within it.

    Parameters
    ----------
    section : object
        A section, or tables and arrays of TOML.
    folder : Path
        Where the scenario stands, to which paths are relative.
    """
    within: Iterable[tuple[Any, Any]] = ()
    if attrs.has(type(section)):
        within = attrs.asdict(section, recurse=False).items()
    elif isinstance(section, Mapping):
        within = section.items()
    elif isinstance(section, tuple | list):
        within = enumerate(section)
    for key, value in within:
        # a sweep names keys with dots
        if isinstance(key, str) and key.rpartition(".")[2] == "file" and value is not None:
            yield from (folder / name for name in _names(value))
        elif not isinstance(value, str | int | float):
            yield from files_of(value, folder)


def _names(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, tuple | list):
        for each in value:
            yield from _names(each)
