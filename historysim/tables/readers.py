"""What reads a format of files: readers by the endings of names."""

import abc
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from historysim.basics.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from historysim.tables.arrays import Contents
    from historysim.tables.columns import Format

# Endings of texts, which are read line by line whatever readers there are.
TEXT_ENDINGS = (".txt", ".csv", ".tsv", ".dat", ".asc")


class Reader(abc.ABC):
    """What reads a format: a `TableReader`, a `LineReader`, or a `historysim.surfaces.map_files.MapReader`."""

    kind: ClassVar[str]  #: its name
    #: Endings of the files that it reads, in lower case with their dot: ``(".tdms",)``.
    endings: ClassVar[Collection[str]]


class TableReader(Reader):
    """What reads a format of files that hold named arrays."""

    @abc.abstractmethod
    def opened(self, path: Path, layout: "Format") -> "AbstractContextManager[Contents]":
        """Open a file, and close it when the block ends; ``layout`` is what the user says of it.

        Raises
        ------
        InputError
            A damaged file, or of another kind, or a library is missing.
        """


class LineReader(Reader):
    """What reads a format of tables as lines of a text: names and units are found in them, as in any text."""

    @abc.abstractmethod
    def opened(self, path: Path, layout: "Format") -> "AbstractContextManager[Iterator[str]]":
        """Open the lines of a file, with tabs between values; arguments and errors as of a `TableReader`."""


# The readers by their names.
READERS: Registry[type[Reader]] = Registry(
    "historysim.readers", "historysim.tables.readers:Reader", "reader", "historysim.tables"
)


def reader_of(path: Path, *among: type[Reader]) -> Any:  # noqa: ANN401 - type checkers take no abstract class
    """Return what of some classes reads files of the ending of a path; None for a text, and where nothing is known."""
    ending = path.suffix.lower()
    for kind in READERS.values() if ending and ending not in TEXT_ENDINGS else ():
        if issubclass(kind, among) and ending in kind.endings:
            return kind()
    return None
