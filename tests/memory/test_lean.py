"""Lean arrays do what numpy's do, live as long as they are needed, and come back as the arrays that were given."""

import sys
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from historysim.memory.lean import counted, duplicate, empty, given_back, keep, lean, uncounted


class Pair(NamedTuple):
    table: np.ndarray
    flags: np.ndarray


@njit
def read(pair):
    """An item, the sum of a row's part, the last item of a row view, sizes, and whether a view is the array itself."""
    table = lean(pair).table
    row, part, total = table[1], table[1, 1:3], 0.0
    for i in range(part.size):
        total += part[i]
    whole, below = table[0:3], table[1:3]
    same = whole is table
    other = below is table
    return table[2, 0], total, row[row.size - 1], below[0, 0], table.size, table.shape[1], len(below), same, other


@njit
def written(pair, anew):
    """The pair, written to: in place, or in new arrays of which only views are left behind."""
    result = counted(lean(pair))
    if anew:
        result = Pair(duplicate(result.table), duplicate(result.flags))
    row = uncounted(result.table)[0]
    row[0] += 1.0
    result.flags[1] = True
    return given_back(result, pair)


@njit
def view_of_new(size):
    """The last row of a table that nothing else holds."""
    table = empty((2, size), np.float64)
    for i in range(size):
        table[0, i], table[1, i] = 0.0, i
    return table[1]


@njit
def ends_of_new(size):
    """Items of an array of which but a view is left, after many others were made in the room that it might leave."""
    row, kept = view_of_new(size), empty(size, np.int64)
    unseen = uncounted(kept)
    for i in range(size):
        unseen[i] = i
    for _ in range(100):
        view_of_new(size)
    found = row[0], row[size - 1], unseen[size - 1]
    keep(kept)
    return found


def pair():
    return Pair(np.arange(12.0).reshape(3, 4), np.array([True, False]))


def test_items_and_views_are_those_of_numpy():
    assert read(pair()) == (8.0, 11.0, 7.0, 4.0, 12, 4, 2, True, False)


def test_what_was_given_comes_back_and_what_is_new_does_not_touch_it():
    given = pair()
    same = written(given, False)
    assert same.table is given.table
    assert same.flags is given.flags
    assert (given.table[0, 0], given.flags[1]) == (1.0, True)
    new = written(given, True)
    assert (new.table[0, 0], given.table[0, 0]) == (2.0, 1.0)
    np.testing.assert_array_equal(new.table[1:], given.table[1:])


def test_a_new_array_lives_as_long_as_python_holds_it():
    new = [written(pair(), True).table for _ in range(50)]
    assert all(np.array_equal(table[1:], pair().table[1:]) and table[0, 0] == 1.0 for table in new)
    given = pair()
    before = sys.getrefcount(given.table)
    for _ in range(10):
        written(given, False)
    after = sys.getrefcount(given.table)
    assert after == before


def test_a_view_keeps_its_array_alive():
    assert ends_of_new(1000) == (0.0, 999.0, 999)


def test_arrays_that_are_not_contiguous_are_read_as_well():
    wide = np.arange(24.0).reshape(3, 8)[:, ::2]
    assert read(pair()._replace(table=wide))[:4] == (16.0, 22.0, 14.0, 8.0)


def test_an_array_that_must_not_be_written_to_is_not():
    given = pair()
    given.table.flags.writeable = False
    with pytest.raises(TypingError):
        written(given, False)
    assert given.table[0, 0] == 0.0
