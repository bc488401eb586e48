"""The file of a result while its rows are written: each byte once, to the place where readers will look for it.

Rows that are told to stand are on the disk, and a digest over the checksums of their chunks tells later whether they
still do. What HDF5 adds to make a result of them is written at the end.
"""

import copy
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from historysim.recording.fletcher import MODULUS, checksum, copied
from historysim.recording.skeleton import Place, Skeleton

Array = npt.NDArray[Any]


class Strip:
    """The rows of one variable, from the first one on.

    Parameters
    ----------
    handle : int
        Of the file.
    place : Place
    """

    def __init__(self, handle: int, place: Place) -> None:
        self.place = place
        self.rows = 0
        self._handle = handle
        # of the chunks that the next row goes to
        self._sums = np.zeros((place.address.shape[1], 2), dtype=np.int64)
        self._told = hashlib.sha256()

    def copy(self) -> Self:
        """Return another that stands where this one does."""
        other = copy.copy(self)
        other._sums, other._told = self._sums.copy(), self._told.copy()  # noqa: SLF001 - of its own kind
        return other

    def write(self, values: Array) -> None:
        """Write the next rows, an array (row, …)."""
        place = self.place
        if not place.columns or not values.shape[0]:
            return
        given = np.ascontiguousarray(values).view(np.uint8).reshape(values.shape[0], -1)
        done = 0
        for at, count in self._bands(len(given)):
            rows = given[done : done + count]
            if place.row_size == rows.shape[1]:
                # all columns in one chunk: the rows follow one another there as they do here
                rows = rows.reshape(1, -1)
            stride = len(rows) and place.row_size * count // len(rows)
            content = np.empty(place.row_size * count, dtype=np.uint8)
            for across in range(len(self._sums)):
                begin = across * stride
                end = min(begin + stride, rows.shape[1])
                self._add(across, copied(rows, begin, end, at, stride, content))
                _put(self._handle, content.data, self._address(across, at))
                self._end(across, at + content.size)
            self._go_on(count)
            done += count

    def read(self, until: int) -> None:
        """Take the rows before one as they stand in the file, and go on from there.

        Raises
        ------
        EOFError
            The file ends before.
        OSError
            It cannot be read.
        """
        for at, count in self._bands(until - self.rows):
            content = np.empty(self.place.row_size * count, dtype=np.uint8)
            for across in range(len(self._sums)):
                address = self._address(across, at)
                if os.preadv(self._handle, [content.data], address) < content.size:
                    raise EOFError
                self._add(across, copied(content[np.newaxis], 0, content.size, at, content.size, content))
                self._end(across, at + content.size)
            self._go_on(count)

    def digest(self) -> bytes:
        """Return a digest of all rows so far: of what their chunks add up to."""
        told = self._told.copy()
        told.update(self._sums.astype("<i8").tobytes())
        return told.digest()

    def _bands(self, count: int) -> Iterator[tuple[int, int]]:
        """Cut the next rows at the ends of chunks: where in its chunk each part begins, in bytes, and its rows."""
        height = self.place.chunk[0]
        while count > 0:
            inside = self.rows % height
            part = min(count, height - inside)
            yield inside * self.place.row_size, part
            count -= part

    def _address(self, across: int, at: int) -> int:
        return int(self.place.address[self.rows // self.place.chunk[0], across]) + at

    def _add(self, across: int, sums: tuple[int, int]) -> None:
        words, placed = sums
        self._sums[across, 0] += words
        self._sums[across, 1] = (self._sums[across, 1] + placed) % MODULUS

    def _end(self, across: int, end: int) -> None:
        """Write what stands behind the rows of a chunk that end there, if they are its last ones."""
        place = self.place
        band, height = self.rows // place.chunk[0], place.chunk[0]
        if end < min(height, place.steps - band * height) * place.row_size:
            return
        words, placed = self._sums[across].tolist()
        ending = bytes(place.chunk_size - end) + checksum(words, placed, place.chunk_size)
        _put(self._handle, memoryview(ending), self._address(across, end))

    def _go_on(self, count: int) -> None:
        self.rows += count
        if self.rows % self.place.chunk[0] == 0:
            self._told.update(self._sums.astype("<i8").tobytes())
            self._sums[...] = 0


class RowFile:
    """The file of a result while its rows are written.

    Parameters
    ----------
    handle : int
        Of a file that is open to read and write.
    skeleton : Skeleton
    """

    def __init__(self, handle: int, skeleton: Skeleton) -> None:
        self._handle, self._skeleton = handle, skeleton
        self._steps = skeleton.places[0].steps
        self.strips = [Strip(handle, place) for place in skeleton.places]

    @property
    def size(self) -> int:
        """Bytes of the whole result."""
        return self._skeleton.size

    @property
    def missing(self) -> int:
        """Bytes of the disk that it will need beyond those that it has."""
        return max(0, self._skeleton.size - 512 * os.fstat(self._handle).st_blocks)

    def standing(self, known: Mapping[int, Iterable[bytes]]) -> dict[int, list[Strip]]:
        """Return up to which of some numbers of rows those in the file are what they were, with the strips there.

        Parameters
        ----------
        known : dict
            Digests of rows, by their number: those that `sync` has given then.
        """
        found = {}
        strips = [strip.copy() for strip in self.strips]
        for rows in sorted(rows for rows in known if rows <= self._steps):
            try:
                for strip in strips:
                    strip.read(rows)
            except (EOFError, OSError):
                break
            if _digest(strips) not in known[rows]:
                break
            found[rows] = [strip.copy() for strip in strips]
        return found

    def sync(self) -> bytes:
        """Write all rows so far to the disk, and return a digest of them."""
        self._sync()
        return _digest(self.strips)

    def _sync(self) -> None:
        # macOS has no other call than that which also writes when the file was changed
        getattr(os, "fdatasync", os.fsync)(self._handle)

    def finish(self) -> None:
        """Make a result of the rows, which are all there."""
        for address, content in self._skeleton.content.items():
            _put(self._handle, memoryview(content), address)
        os.ftruncate(self._handle, self._skeleton.size)


def _digest(strips: Iterable[Strip]) -> bytes:
    return hashlib.sha256(b"".join(strip.digest() for strip in strips)).digest()


def _put(handle: int, content: memoryview, address: int) -> None:
    """Write all of a buffer."""
    done = 0
    while done < content.nbytes:
        done += os.pwrite(handle, content[done:], address + done)
