"""Chunks of a compressed result."""

import pytest

from historysim.recording.compression import CHUNK_CELLS, MOST_CELLS_ACROSS, chunk_shape


@pytest.mark.parametrize("steps", [1, 7, 1000, 10_000, 1_000_000])
@pytest.mark.parametrize("columns", [1, 5, 300, 5241, 100_000, 1_000_000])
def test_chunks_suit_both_ways_of_reading(steps, columns):
    rows, across = chunk_shape(steps, columns)
    assert 1 <= rows <= steps
    assert 1 <= across <= columns
    assert rows * across <= CHUNK_CELLS
    # one step, and one asperity at all steps, cost a small share of the whole where there is much of both
    if steps > 1:
        assert min(rows, steps) * columns <= max(MOST_CELLS_ACROSS, CHUNK_CELLS)
    down = -(-steps // rows)
    assert down * rows * across <= max(CHUNK_CELLS, 260 * steps, steps * columns // 20)
    # and little room is lost at the ends
    taken = down * rows * -(-columns // across) * across
    assert taken <= 1.05 * steps * columns + rows + across
