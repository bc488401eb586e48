"""The result before its rows: what HDF5 writes, and where the rows go."""

import itertools

import netCDF4
import numpy as np
import pytest

import historysim as hs
from historysim.recording.fletcher import SIZE
from historysim.recording.recorder import DatasetRecorder, StateOnly
from historysim.recording.skeleton import CHUNK_CELLS, MOST_CELLS_ACROSS, chunk_shape, skeleton

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)


def recorder(steps, count):
    ensemble = hs.Ensemble(PAIR, np.linspace(-0.1, 0.0, max(count, 1)), 1.0, 0.5)
    return DatasetRecorder(ensemble, np.arange(count), steps)


class Unfilled(DatasetRecorder):
    """Says what is recorded, and takes no room for it."""

    def __attrs_post_init__(self):
        pass


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


def written(plan, path):
    with path.open("wb") as stream:
        for address, content in plan.content.items():
            stream.seek(address)
            stream.write(content)
        stream.truncate(plan.size)


@pytest.mark.parametrize(("steps", "count"), [(11, 5), (3000, 700), (11, 0)])
def test_without_rows_it_is_a_sound_file_of_zeros(tmp_path, steps, count):
    target = recorder(steps, count)
    plan = skeleton(target, {"title": "µ", "empty": "", "number": 7})
    written(plan, tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert (file.title, file.empty, file.number, file.complete) == ("µ", "", 7, 1)
        for place in plan.places:
            variable = file[place.name]
            assert variable.shape[0] == place.steps == steps
            # the netCDF library checks what stands behind each chunk
            assert not np.any(variable[...])
            if variable.size:
                assert variable.filters()["fletcher32"]
                assert tuple(variable.chunking()) == place.chunk[: variable.ndim]
        assert file["asperity"][:].tolist() == list(range(count))


def test_the_places_of_rows_do_not_meet_one_another_or_anything_else():
    plan = skeleton(recorder(3000, 700), {})
    extents = [(int(at), int(at) + place.chunk_size + SIZE) for place in plan.places for at in place.address.flat]
    extents += [(at, at + len(content)) for at, content in plan.content.items()]
    extents.sort()
    assert extents[0][0] == 0
    assert all(end == begin for (_, end), (begin, _) in itertools.pairwise(extents))
    assert extents[-1][1] == plan.size


def test_it_is_the_same_each_time_and_small_beside_the_rows():
    target = Unfilled(hs.Ensemble(PAIR, np.linspace(-0.1, 0.0, 1000), 1.0, 0.5), np.arange(1000), 20_000)
    one, other = skeleton(target, {"a": 1}), skeleton(target, {"a": 1})
    assert one.content == other.content
    assert one.size > 20_000 * 1000 * 41
    assert sum(map(len, one.content.values())) < 1e-3 * one.size


def test_further_groups_stand_beside(tmp_path):
    def beside(file):
        group = file.create_group("more")
        group.dimensions["x"] = 3
        group.create_variable("y", ("x",), "f8", data=np.arange(3.0))

    plan = skeleton(StateOnly(recorder(2, 2).ensemble, None, 2), {}, beside)
    written(plan, tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert file["more/y"][:].tolist() == [0.0, 1.0, 2.0]
        assert file.ncattrs() == ["complete"]
