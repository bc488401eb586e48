"""Registry of file readers, selected by the ending of a file name."""

import abc
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from historysim.basics.files import is_file_set, list_file_set
from historysim.basics.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from historysim.tables.arrays import Contents
    from historysim.tables.columns import Format

# Endings of text files, which are read line by line even if a reader is registered for them.
TEXT_ENDINGS = (".txt", ".csv", ".tsv", ".dat", ".asc")


class Reader(abc.ABC):
    """Base class of readers: `TableReader`, `LineReader`, or `historysim.surfaces.map_files.MapReader`."""

    kind: ClassVar[str]  #: name of the format
    #: Endings of the file names, in lower case with their dot: ``(".tdms",)``.
    endings: ClassVar[Collection[str]]


class TableReader(Reader):
    """Base class of readers of files that hold named arrays."""

    @abc.abstractmethod
    def open(self, path: Path, layout: "Format") -> "AbstractContextManager[Contents]":
        """Open a file and close it at the end of the ``with`` block; ``layout`` holds the settings of the user.

        Raises
        ------
        InputError
            The file is damaged or has another format, or a library is missing.
        """


class LineReader(Reader):
    """Base class of readers that yield lines of text, in which names and units are found as in any text file."""

    @abc.abstractmethod
    def open(self, path: Path, layout: "Format") -> "AbstractContextManager[Iterator[str]]":
        """Open the lines of a file, with tabs between values; arguments and errors as for `TableReader.open`."""


# Readers by name.
READERS: Registry[type[Reader]] = Registry(
    "historysim.readers", "historysim.tables.readers:Reader", "reader", "historysim.tables"
)


def file_endings() -> set[str]:
    """Return the endings of text files, and of all files that a reader of numbers opens."""
    kinds = [kind for kind in READERS.values() if issubclass(kind, TableReader | LineReader)]
    return {*TEXT_ENDINGS, *(ending for kind in kinds for ending in kind.endings)}


def list_files(path: Path) -> list[Path]:
    """List the files of numbers of a path: the file, or those of a folder or a pattern in natural order.

    Raises InputError: a folder or pattern without such files.
    """
    return list_file_set(path, file_endings()) if is_file_set(path) else [path]


def find_reader(path: Path, *among: type[Reader]) -> Any:  # noqa: ANN401 - type checkers take no abstract class
    """Return the reader, of one of the classes, for the ending of a path; None for a text or an unknown ending."""
    ending = path.suffix.lower()
    for kind in READERS.values() if ending and ending not in TEXT_ENDINGS else ():
        if issubclass(kind, among) and ending in kind.endings:
            return kind()
    return None
