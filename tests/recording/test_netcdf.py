"""Rows at their places: each byte once, and none that has changed is taken for what was told."""

import contextlib
import errno
import itertools
import os
import shutil

import netCDF4
import numpy as np
import pytest

import historysim as hs
from historysim.basics.file_kinds import is_netcdf
from historysim.recording import recorder
from historysim.recording.netcdf import FileRecorder, opened

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
STEPS, COLUMNS = 23, 7
ENDS = (3, 5, 12, 17)


@pytest.fixture(autouse=True)
def _few_rows_at_once(monkeypatch):
    monkeypatch.setattr(recorder, "CELLS_AT_ONCE", 4 * 16)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "out.nc"


@contextlib.contextmanager
def recorder_of(path, columns=COLUMNS, **options):
    ensemble = hs.Ensemble(PAIR, np.linspace(-0.1, 0.0, COLUMNS), 1.0, 0.5)
    path.touch()
    with (
        opened(path) as handle,
        FileRecorder(ensemble, np.arange(columns) if columns else None, STEPS, handle, {}, **options) as target,
    ):
        yield target


def arrays_of(rows):
    return [*(rows.totals[name] for name in rows.totals.dtype.names), *rows.each.values()]


def values_of(target):
    """Numbers for all rows of a history, by the names of their arrays."""
    generator = np.random.default_rng(1)
    rows = target.new_rows(STEPS)
    for array in arrays_of(rows):
        array[...] = (
            generator.integers(1, 4, array.shape) if array.dtype.kind == "i" else generator.normal(size=array.shape)
        )
    rows.totals["contact_count"] = np.arange(STEPS)
    return rows


def write(target, begin, end):
    for array, values in zip(arrays_of(target.blank(end - begin)), arrays_of(values_of(target)), strict=True):
        array[...] = values[begin:end]
    target.record(np.arange(begin, end) / 8)


def check(path, columns=COLUMNS):
    """Every row is there, whole."""
    with netCDF4.Dataset(path) as result, recorder_of(path, columns) as target:
        assert result.complete == 1
        assert result["time"][:].tolist() == (np.arange(STEPS) / 8).tolist()
        for variable, expected in target.projected(values_of(target)):
            found = np.asarray(result[variable.name][...])
            assert found.dtype == expected.dtype
            assert found.tobytes() == np.ascontiguousarray(expected).tobytes(), variable.name


@pytest.mark.parametrize("columns", [0, 1, COLUMNS])
@pytest.mark.parametrize("cuts", [[], [1], [5, 10, 15], [4, 6, 7, 22], list(range(1, STEPS))])
def test_rows_come_back_in_whatever_portions_they_came(path, cuts, columns):
    with recorder_of(path, columns) as target:
        for begin, end in zip([0, *cuts], [*cuts, STEPS], strict=True):
            write(target, begin, end)
        target.finish()
    check(path, columns)


def half_written(path):
    """What was told of the rows in a file, by their number."""
    known, begin = {}, 0
    with recorder_of(path) as target:
        for end in ENDS:
            write(target, begin, end)
            known[end], begin = {target.flush()}, end
    return known


def test_each_byte_is_written_once(path, monkeypatch):
    written = []
    put = os.pwrite
    monkeypatch.setattr(
        os, "pwrite", lambda file, content, at: (written.append((at, at + len(content))), put(file, content, at))[1]
    )
    with recorder_of(path) as target:
        for begin in range(0, STEPS, 4):
            write(target, begin, min(begin + 4, STEPS))
            target.flush()
            assert not is_netcdf(path)
        target.finish()
        size = target.size
    written.sort()
    assert written[0][0] == 0
    assert all(end == begin for (_, end), (begin, _) in itertools.pairwise(written))
    assert written[-1][1] == path.stat().st_size == size


def test_rows_go_on_where_they_stand(path):
    known = half_written(path)
    content = path.read_bytes()
    for rows in known:
        path.write_bytes(content)
        with recorder_of(path) as target:
            standing = target.rows_kept(known)
            assert standing == {end: told for end, (told,) in known.items()}
            target.go_on(rows, standing[rows])
            for begin in range(rows, STEPS, 3):
                write(target, begin, min(begin + 3, STEPS))
                if begin + 3 in known:
                    assert target.flush() in known[begin + 3]
            target.finish()
        check(path)


def standing_in(path, known):
    with recorder_of(path) as target:
        return list(target.rows_kept(known))


def test_a_bit_that_has_changed_in_any_row_is_seen(path):
    known = half_written(path)
    whole = path.read_bytes()
    with recorder_of(path) as target:
        for place in target._layout.places:
            for row in range(ENDS[-1]):
                content = bytearray(whole)
                content[place.begin + row * place.row_size + row % place.row_size] ^= 1 << row % 8
                path.write_bytes(content)
                assert list(target.rows_kept(known)) == [end for end in ENDS if end <= row], (place, row)


def test_rows_that_cannot_be_read_do_not_stand(path, monkeypatch):
    known, read, count = half_written(path), os.pread, itertools.count()

    def failing(*place):
        if next(count) > 40:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return read(*place)

    monkeypatch.setattr(os, "pread", failing)
    assert 0 < len(standing_in(path, known)) < len(known)


@pytest.mark.parametrize("size", [0, 1, 500])
def test_a_file_that_is_cut_has_no_rows(path, size):
    known = half_written(path)
    path.write_bytes(path.read_bytes()[:size])
    assert standing_in(path, known) == []


def test_rows_of_another_history_are_not_taken_for_these(path):
    known = half_written(path)
    assert standing_in(path, {5: {b"another"}, 12: known[12]}) == []
    assert standing_in(path, {5: {b"another", *known[5]}, 1000: {b"more"}}) == [5]
    with recorder_of(path, instrument=hs.Instrument(lateral_stiffness=1.0)) as target:
        assert target.rows_kept(known) == {}


def test_the_room_that_is_missing_is_what_is_not_written_yet(path, monkeypatch):
    free = []
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10**9, 0, free[-1]))
    with recorder_of(path) as target:
        free.append(target.size - 1)
        with pytest.raises(OSError, match=r"the result needs .* MB more"):
            target.check_room(path.parent)
        write(target, 0, STEPS)
        target.flush()
        free.append(5000)
        target.check_room(path.parent)
