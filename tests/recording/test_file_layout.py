"""The result before its rows: what HDF5 writes, and where the rows go."""

import itertools

import netCDF4
import numpy as np
import pytest

import historysim as hs
from historysim.recording.file_layout import PAGE, _Image, file_layout
from historysim.recording.recorder import DatasetRecorder, StateOnly

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)


def recorder(steps, count):
    ensemble = hs.Ensemble(PAIR, np.linspace(-0.1, 0.0, max(count, 1)), 1.0, 0.5)
    return DatasetRecorder(ensemble, np.arange(count), steps)


class Unfilled(DatasetRecorder):
    """Says what is recorded, and takes no room for it."""

    def __attrs_post_init__(self):
        pass


def written(plan, path):
    with path.open("wb") as stream:
        for address, content in plan.content.items():
            stream.seek(address)
            stream.write(content)
        stream.truncate(plan.size)


@pytest.mark.parametrize(("steps", "count"), [(11, 5), (3000, 700), (11, 0)])
def test_without_rows_it_is_a_sound_file_of_zeros(tmp_path, steps, count):
    target = recorder(steps, count)
    plan = file_layout(target, {"title": "µ", "empty": "", "number": 7})
    written(plan, tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert (file.title, file.empty, file.number, file.complete) == ("µ", "", 7, 1)
        assert file["asperity"][:].tolist() == list(range(count))
        along = [("time", "f8"), *((one.name, one.dtype) for one in (*target.totals, *target.per_asperity))]
        for (name, dtype), place in zip(along, plan.places, strict=True):
            variable = file[name]
            assert variable.shape[0] == steps
            assert not np.any(variable[...])
            assert place.row_size == variable.size // steps * np.dtype(dtype).itemsize
            assert place.end - place.begin == steps * place.row_size
            assert variable.chunking() == "contiguous" or not variable.size


def test_the_places_of_rows_do_not_meet_one_another_or_anything_else():
    plan = file_layout(recorder(3000, 700), {})
    extents = [(place.begin, place.end) for place in plan.places]
    extents += [(at, at + len(content)) for at, content in plan.content.items()]
    extents.sort()
    assert extents[0][0] == 0
    assert all(end == begin for (_, end), (begin, _) in itertools.pairwise(extents))
    assert extents[-1][1] == plan.size


def test_it_is_the_same_each_time_and_small_beside_the_rows():
    target = Unfilled(hs.Ensemble(PAIR, np.linspace(-0.1, 0.0, 1000), 1.0, 0.5), np.arange(1000), 20_000)
    one, other = file_layout(target, {"a": 1}), file_layout(target, {"a": 1})
    assert one.content == other.content
    assert one.size > 20_000 * 1000 * 41
    assert sum(map(len, one.content.values())) < 1e-3 * one.size


def test_further_groups_stand_beside(tmp_path):
    def beside(file):
        group = file.create_group("more")
        group.dimensions["x"] = 3
        group.create_variable("y", ("x",), "f8", data=np.arange(3.0))

    plan = file_layout(StateOnly(recorder(2, 2).ensemble, None, 2), {}, beside)
    written(plan, tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert file["more/y"][:].tolist() == [0.0, 1.0, 2.0]
        assert file.ncattrs() == ["complete"]


def test_a_file_in_memory_is_one_of_bytes():
    generator, image, expected = np.random.default_rng(1), _Image(), bytearray()
    for size in (1, PAGE, 3 * PAGE + 5, 100, 0):
        at, content = int(generator.integers(0, 20 * PAGE)), generator.bytes(size)
        expected.extend(bytes(max(0, at + size - len(expected))))
        expected[at : at + size] = content
        image.seek(at)
        assert image.write(content) == size
        assert image.tell() == at + size
    assert image.size == image.seek(0, 2) == len(expected)
    image.seek(0)
    assert image.read() == expected
    image.seek(-7, 2)
    assert image.read(100) == expected[-7:]
    image.truncate(10 * len(expected))
    image.seek(len(expected))
    assert image.read() == bytes(9 * len(expected))
