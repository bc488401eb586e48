"""Rows at their place: each byte once, and none that has changed is taken for what was written."""

import itertools
import os

import netCDF4
import numpy as np
import pytest

import historysim as hs
from historysim.recording import skeleton as skeleton_module
from historysim.recording.recorder import DatasetRecorder
from historysim.recording.row_file import RowFile
from historysim.recording.skeleton import skeleton

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
STEPS, COLUMNS = 23, 7


@pytest.fixture
def plan(monkeypatch):
    """A result of several chunks down and across, some of them not full."""
    monkeypatch.setattr(skeleton_module, "CHUNK_CELLS", 15)
    monkeypatch.setattr(skeleton_module, "ROWS_OF_A_CHUNK", 5)
    ensemble = hs.Ensemble(PAIR, np.linspace(-0.1, 0.0, COLUMNS), 1.0, 0.5)
    made = skeleton(DatasetRecorder(ensemble, np.arange(COLUMNS), STEPS), {})
    assert {place.address.shape for place in made.places} == {(2, 1), (6, 4)}
    assert {place.chunk for place in made.places} == {(12, 1), (4, 2)}
    return made


@pytest.fixture
def handle(tmp_path):
    opened = os.open(tmp_path / "out.nc", os.O_RDWR | os.O_CREAT)
    yield opened
    os.close(opened)


def values_of(plan):
    generator = np.random.default_rng(1)
    values = {}
    for place in plan.places:
        shape = (STEPS, COLUMNS) if place.columns > 1 else (STEPS,)
        whole = place.dtype.kind == "i"
        values[place.name] = (generator.integers(1, 4, shape) if whole else generator.normal(size=shape)).astype(
            place.dtype
        )
    return values


def write(file, values, begin, end):
    for strip in file.strips:
        strip.write(values[strip.place.name][begin:end])


@pytest.mark.parametrize("cuts", [[], [1], [5, 10, 15], [4, 6, 7, 22], list(range(STEPS))])
def test_rows_come_back_in_whatever_portions_they_came(plan, handle, tmp_path, cuts):
    values, file = values_of(plan), RowFile(handle, plan)
    for begin, end in zip([0, *cuts], [*cuts, STEPS], strict=True):
        write(file, values, begin, end)
    file.finish()
    with netCDF4.Dataset(tmp_path / "out.nc") as result:
        for name, expected in values.items():
            assert np.asarray(result[name][...]).tobytes() == expected.tobytes(), name


def test_each_byte_is_written_once(plan, handle, monkeypatch):
    written = []
    put = os.pwrite
    monkeypatch.setattr(
        os, "pwrite", lambda file, content, at: (written.append((at, at + len(content))), put(file, content, at))[1]
    )
    values, file = values_of(plan), RowFile(handle, plan)
    for begin in range(0, STEPS, 4):
        write(file, values, begin, begin + 4)
        file.sync()
    file.finish()
    written.sort()
    assert written[0][0] == 0
    assert all(end == begin for (_, end), (begin, _) in itertools.pairwise(written))
    assert written[-1][1] == os.fstat(handle).st_size == plan.size


def half_written(plan, handle):
    """Digests of the rows in a file, by their number."""
    values, file, known, begin = values_of(plan), RowFile(handle, plan), {}, 0
    for end in (3, 5, 12, 17):
        write(file, values, begin, end)
        known[end], begin = {file.sync()}, end
    return known


def test_rows_go_on_where_they_stand(plan, handle, tmp_path):
    known = half_written(plan, handle)
    content, values = (tmp_path / "out.nc").read_bytes(), values_of(plan)
    for rows in known:
        (tmp_path / "out.nc").write_bytes(content)
        file = RowFile(handle, plan)
        standing = file.standing(known)
        assert list(standing) == list(known)
        file.strips = standing[rows]
        write(file, values, rows, STEPS)
        file.finish()
        with netCDF4.Dataset(tmp_path / "out.nc") as result:
            for name, expected in values.items():
                assert np.asarray(result[name][...]).tobytes() == expected.tobytes(), name


def test_a_byte_that_has_changed_is_seen(plan, handle, tmp_path):
    known = half_written(plan, handle)
    path = tmp_path / "out.nc"
    whole = path.read_bytes()
    seen = 0
    for position in range(0, len(whole), 239):
        content = bytearray(whole)
        content[position] ^= 1 << position % 8
        path.write_bytes(content)
        standing = RowFile(handle, plan).standing(known)
        if len(standing) < len(known):
            seen += 1
            assert list(standing) == list(known)[: len(standing)]
        else:
            # in what HDF5 writes at the end, behind the last row, or a checksum, which is written again
            after = bytearray(path.read_bytes())
            around = any(at <= position < at + len(text) for at, text in plan.content.items())
            assert around or after == whole or not any(whole[position : position + 1]), position
    assert seen > 10


@pytest.mark.parametrize("size", [0, 1, 4096, 8000])
def test_a_file_that_is_cut_has_no_rows(plan, handle, tmp_path, size):
    known = half_written(plan, handle)
    os.truncate(tmp_path / "out.nc", size)
    assert RowFile(handle, plan).standing(known) == {}


def test_rows_of_another_history_are_not_taken_for_these(plan, handle):
    known = half_written(plan, handle)
    assert list(RowFile(handle, plan).standing({5: {b"another"}, 12: known[12]})) == []
    assert list(RowFile(handle, plan).standing({5: {b"another", *known[5]}, 1000: {b"more"}})) == [5]


def test_the_room_that_is_missing_is_what_is_not_written_yet(plan, handle):
    file = RowFile(handle, plan)
    assert file.missing == plan.size
    write(file, values_of(plan), 0, STEPS)
    file.finish()
    os.fsync(handle)
    assert file.missing == 0
