import numpy as np
import pytest

from historysim.errors import InputError
from historysim.memory.rows import blank_rows
from historysim.recording.parts import Parts


def bits(part):
    times, rows = part
    return [times.tobytes(), *(values.tobytes() for values in rows)]


@pytest.mark.parametrize("columns", [0, 2])
def test_a_byte_that_has_changed_in_a_part_changes_no_value_unnoticed(tmp_path, columns):
    generator = np.random.default_rng(1)
    parts = Parts(tmp_path / "out.nc", bytes(range(32)), columns)
    rows = blank_rows(3, columns)
    for values in rows:
        values[...] = generator.integers(0, 3, values.shape)
    parts.write(0, np.arange(3.0), rows)
    (path,) = parts.folder.glob("*.npz")
    whole, good = path.read_bytes(), bits(parts.read(0))
    refused = 0
    for position in range(0, len(whole), 13):
        content = bytearray(whole)
        content[position] ^= 1 << position % 8
        path.write_bytes(content)
        try:
            assert bits(parts.read(0)) == good
        except InputError:
            refused += 1
            assert parts.ends() == [0]
        else:
            assert parts.ends() == [0, 3]
    assert refused > len(whole) / 26
    parts.close(keep=False)


def test_a_part_that_is_cut_or_empty_is_none(tmp_path):
    parts = Parts(tmp_path / "out.nc", b"key", 1)
    parts.write(0, np.arange(2.0), blank_rows(2, 1))
    (path,) = parts.folder.glob("*.npz")
    whole = path.read_bytes()
    for content in (b"", whole[:-1], bytes(len(whole)), whole[:512] + bytes(len(whole) - 512)):
        path.write_bytes(content)
        assert parts.ends() == [0]
        with pytest.raises(InputError, match="is missing or damaged"):
            parts.read(0)
    parts.close(keep=False)
