"""The checksum of a chunk, against HDF5's own and against its definition."""

import h5py
import numpy as np
import pytest

from historysim.recording.fletcher import MODULUS, SIZE, checksum, copied


def added(content, pieces, target=None):
    """The checksum of bytes that come in pieces, each a range of them."""
    source = np.frombuffer(content, dtype=np.uint8)
    words = placed = 0
    for begin, end in pieces:
        kept = np.empty(end - begin, dtype=np.uint8)
        more, where = copied(source[np.newaxis], begin, end, begin, end - begin, kept)
        assert kept.tobytes() == content[begin:end]
        words, placed = words + more, (placed + where) % MODULUS
        if target is not None:
            target[begin:end] = kept
    return checksum(words, placed, len(content))


def of_hdf5(content, folder):
    """What HDF5 writes behind these bytes."""
    path = folder / "chunk.h5"
    with h5py.File(path, "w") as file:
        shape = (len(content),)
        made = file.create_dataset("chunk", shape, dtype="u1", chunks=shape, fletcher32=True)
        made[:] = np.frombuffer(content, dtype=np.uint8)
    with h5py.File(path) as file:
        _, stored = file["chunk"].id.read_direct_chunk((0,))
    return stored[-SIZE:]


def by_definition(content):
    padded = content + bytes(len(content) % 2)
    words = [256 * high + low for high, low in zip(padded[::2], padded[1::2], strict=True)]
    first, second = sum(words), sum((len(words) - place) * word for place, word in enumerate(words))
    return tuple(total % MODULUS or (MODULUS if total else 0) for total in (first, second))


CONTENTS = {
    "one byte": b"\x07",
    "zeros": bytes(100),
    "ones": b"\xff" * 100,
    "ones, an odd number": b"\xff" * 101,
    "a sum of 65535": b"\x80\x00\x7f\xff",
    "both sums 65535": bytes(2 * 65534) + b"\xff\xff",
    "numbers": np.random.default_rng(1).normal(size=1000).tobytes(),
    "flags": np.random.default_rng(2).integers(0, 4, 777).astype(np.int8).tobytes(),
}


@pytest.mark.parametrize("name", CONTENTS)
def test_the_checksum_is_that_of_hdf5_whatever_comes_first(name, tmp_path):
    content = CONTENTS[name]
    expected = of_hdf5(content, tmp_path)
    assert tuple(np.frombuffer(expected, dtype="<u2").tolist()) == by_definition(content)
    assert added(content, [(0, len(content))]) == expected
    generator = np.random.default_rng(3)
    for _ in range(5):
        cuts = np.sort(generator.integers(0, len(content) + 1, 6)).tolist()
        pieces = list(zip([0, *cuts], [*cuts, len(content)], strict=True))
        generator.shuffle(pieces)
        assert added(content, pieces) == expected


@pytest.mark.parametrize("width", [1, 3, 8])
def test_columns_of_rows_stand_where_they_do_in_a_chunk(width):
    rows = np.random.default_rng(4).integers(0, 256, (5, 11), dtype=np.uint8)
    begin, stride = 11 - width, width + 2
    target = np.full(5 * stride, 99, dtype=np.uint8)
    words, placed = copied(rows, begin, 11, 0, stride, target)
    expected = np.zeros((5, stride), dtype=np.uint8)
    expected[:, :width] = rows[:, begin:]
    assert target.tobytes() == expected.tobytes()
    assert checksum(words, placed, target.size) == added(expected.tobytes(), [(0, expected.size)])
