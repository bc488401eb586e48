"""Fletcher's checksum of a chunk as HDF5 has it, of which every reader finds out whether the chunk is still whole.

A chunk of bytes b_0, b_1, … is read as big-endian words w_0, w_1, …, w_(m-1) of 16 bits, and the checksum is

    s1 = Σ w_k,    s2 = Σ (m - k) w_k,    both modulo 65535,

in 32 bits as s2 · 65536 + s1 (Fletcher 1982, IEEE Trans. Commun. 30, 247). Both are sums, so that rows can be added as
they come, in any order.
"""

import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from historysim.basics.compiled import compiled

Array = npt.NDArray[Any]

MODULUS = 65535
SIZE = 4
"""Bytes of a checksum, which stand behind those of its chunk."""

_CODE = struct.Struct("<HH")


@compiled
def copied(source: Array, begin: int, end: int, at: int, stride: int, target: Array) -> tuple[int, int]:
    """Copy the same columns of some rows to where they follow one another, and sum them up on the way.

    Parameters
    ----------
    source : array (row, byte) of uint8
    begin, end : int
        Bytes of each row that are copied.
    at : int
        Where the first of them stands in its chunk.
    stride : int
        Bytes that a row has there; those that are not copied are zero.
    target : array (row * stride) of uint8

    Returns
    -------
    two int
        What these bytes add to Σ w_k, and to Σ k w_k modulo 65535.
    """
    words = np.uint64(0)
    placed = np.uint64(0)
    for row in range(source.shape[0]):
        given = source[row, begin:end]
        taken = target[row * stride : row * stride + given.size]
        target[row * stride + given.size : (row + 1) * stride] = 0
        own = np.uint64(0)
        weighted = np.uint64(0)
        for index in range(given.size):
            taken[index] = given[index]
            place = np.uint64(at + index)
            # the first byte of a word is its higher one
            word = np.uint64(given[index]) << (np.uint64(8) * ((place & np.uint64(1)) ^ np.uint64(1)))
            own += word
            weighted += (place >> np.uint64(1)) * word
        words += own
        placed = (placed + weighted) % np.uint64(MODULUS)
        at += stride
    return int(words), int(placed)


def checksum(words: int, placed: int, size: int) -> bytes:
    """Return the checksum of a chunk, as it stands behind it.

    Parameters
    ----------
    words, placed : int
        Σ w_k, and Σ k w_k modulo 65535.
    size : int
        Bytes of the chunk.
    """
    if not words:
        return bytes(SIZE)
    # HDF5 takes 65535 and 0 for two numbers: only of nothing but zeros is it 0
    first = words % MODULUS
    second = (-(-size // 2) * first - placed) % MODULUS
    return _CODE.pack(first or MODULUS, second or MODULUS)
