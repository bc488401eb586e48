"""Rows in their file: all of them, and those flushed however the process ends; the file until it is complete."""

import os
import shutil
import signal
from contextlib import suppress

import netCDF4
import numpy as np
from pairs import UNIT as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.basics.files import WriterLock, write_errors
from historysim.recording import recorder
from historysim.recording.netcdf import (
    CHUNK_CELLS,
    COMPRESSIONS,
    MOST_CELLS_ACROSS,
    FileRecorder,
    Unfinished,
    check_room,
    chunk_shape,
)

STEPS, COLUMNS = 23, 7


@fixture(autouse=True)
def _few_rows_at_once(monkeypatch):
    monkeypatch.setattr(recorder, "CELLS_AT_ONCE", 4 * 16)


@fixture
def path(tmp_path):
    return tmp_path / "out.nc"


def made(path, columns=COLUMNS, **options):
    ensemble = hs.Ensemble(PAIR, np.linspace(-0.1, 0.0, COLUMNS), 1.0, 0.5)
    return FileRecorder(
        ensemble, np.arange(columns) if columns else None, STEPS, path, {}, **options
    )


def arrays_of(rows):
    return [*(rows.totals[name] for name in rows.totals.dtype.names), *rows.each.values()]


def values_of(target):
    """Numbers for all rows of a history, by the names of their arrays."""
    generator = np.random.default_rng(1)
    rows = target.new_rows(STEPS)
    for array in arrays_of(rows):
        array[...] = (
            generator.integers(1, 4, array.shape)
            if array.dtype.kind == "i"
            else generator.normal(size=array.shape)
        )
    rows.totals["contact_count"] = np.arange(STEPS)
    return rows


def write(target, begin, end):
    for array, values in zip(
        arrays_of(target.blank(end - begin)), arrays_of(values_of(target)), strict=True
    ):
        array[...] = values[begin:end]
    target.record(np.arange(begin, end) / 8)


def check(path, columns=COLUMNS):
    """Every row is complete."""
    with netCDF4.Dataset(path) as result, made(path.with_name("blank.nc"), columns) as target:
        assert result.complete == 1
        assert result["time"][:].tolist() == (np.arange(STEPS) / 8).tolist()
        for variable, expected in target.project(values_of(target)):
            found = np.asarray(result[variable.name][...])
            assert found.dtype == expected.dtype
            assert found.tobytes() == np.ascontiguousarray(expected).tobytes(), variable.name


@mark.parametrize("columns", [0, 1, COLUMNS])
@mark.parametrize("cuts", [[], [1], [5, 10, 15], [4, 6, 7, 22], list(range(1, STEPS))])
def test_rows_come_back_in_whatever_portions_they_came(path, cuts, columns):
    with made(path, columns) as target:
        for begin, end in zip([0, *cuts], [*cuts, STEPS], strict=True):
            write(target, begin, end)
        target.finish()
    check(path, columns)


def killed(path, ends, more):
    """Write and flush rows in a process, write some more, and end it without a word."""
    child = os.fork()
    if not child:
        target, begin = made(path), 0
        for end in ends:
            write(target, begin, end)
            target.flush()
            begin = end
        for row in range(begin, begin + more):
            write(target, row, row + 1)
        os.kill(os.getpid(), signal.SIGKILL)
    assert os.WIFSIGNALED(os.waitpid(child, 0)[1])


@mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
@mark.parametrize("ends", [(3, 5, 12, 17)])
@mark.parametrize("more", [0, 6])
def test_whoever_is_killed_leaves_the_rows_that_were_flushed_in_a_file_that_opens(path, ends, more):
    killed(path, ends, more)
    with netCDF4.Dataset(path) as result:
        assert result.complete == 0
        assert result["time"][: ends[-1]].tolist() == (np.arange(ends[-1]) / 8).tolist()
    with made(path, go_on=ends[-1]) as target:
        for begin in range(ends[-1], STEPS, 3):
            write(target, begin, min(begin + 3, STEPS))
        target.finish()
    check(path)


@mark.parametrize("compression", COMPRESSIONS)
@mark.parametrize("columns", [0, COLUMNS])
def test_a_copy_has_all_rows(path, columns, compression):
    with made(path, columns) as target:
        write(target, 0, STEPS)
        target.finish()
    other = path.with_name("copy.nc")
    with made(other, columns, compression=compression) as target:
        target.copy_rows(path)
        target.finish()
    check(other, columns)


def test_what_the_library_refuses_is_an_error_of_the_system(path):
    with made(path) as target:
        write(target, 0, STEPS)
        target._file.close()
        with (
            raises(OSError, match=r"it cannot be written \(NetCDF: .*\)"),
            write_errors(path, path),
        ):
            target.flush()


def test_the_room_that_is_missing_is_reported(path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10**9, 0, 4999))
    check_room(path.parent, 4999)
    with raises(OSError, match=r"the result needs .* MB more"):
        check_room(path.parent, 5000)


@mark.parametrize("steps", [1, 7, 1000, 10_000, 1_000_000])
@mark.parametrize("columns", [1, 5, 300, 5241, 100_000, 1_000_000])
def test_chunks_suit_both_ways_of_reading(steps, columns):
    rows, across = chunk_shape(steps, columns)
    assert 1 <= rows <= steps
    assert 1 <= across <= columns
    assert rows * across <= CHUNK_CELLS
    # one step, and one asperity at all steps, cost a small share of the whole where there is much
    # of both
    if steps > 1:
        assert min(rows, steps) * columns <= max(MOST_CELLS_ACROSS, CHUNK_CELLS)
    down = -(-steps // rows)
    assert down * rows * across <= max(CHUNK_CELLS, 260 * steps, steps * columns // 20)
    # and little room is lost at the ends
    taken = down * rows * -(-columns // across) * across
    assert taken <= 1.05 * steps * columns + rows + across


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_result_has_its_name_when_it_is_published_and_readers_are_not_kept_out(tmp_path):
    output = tmp_path / "out.nc"
    output.write_bytes(b"older")
    with Unfinished(output) as file:
        file.path.write_bytes(bytes(8) + b"newer")
        assert output.read_bytes() == b"older"
        file.publish()
        assert output.read_bytes() == bytes(8) + b"newer"
        # HDF5 locks what it reads
        WriterLock(output).release()
    assert names(tmp_path) == ["out.nc"]


@mark.parametrize("kept, ends", [(3, KeyboardInterrupt), (0, KeyboardInterrupt), (3, None)])
def test_what_an_error_ends_is_there_for_the_next_one_where_rows_are_kept(tmp_path, kept, ends):
    with suppress(KeyboardInterrupt), Unfinished(tmp_path / "out.nc") as file:
        file.path.write_bytes(bytes(8) + b"rows")
        file.saved_rows = kept
        if ends:
            raise ends
    keep = bool(kept and ends)
    assert names(tmp_path) == ([".out.nc.unfinished"] if keep else [])
    with Unfinished(tmp_path / "out.nc") as again:
        assert again.path.read_bytes() == (bytes(8) + b"rows" if keep else b"")


def test_a_second_writer_is_reported(tmp_path):
    with Unfinished(tmp_path / "out.nc"):
        with raises(OSError, match="another process is writing this result") as caught:
            Unfinished(tmp_path / "out.nc")
        assert caught.value.filename == str(tmp_path / "out.nc")
    with Unfinished(tmp_path / "out.nc"):
        pass


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with raises(FileNotFoundError, match=r"none/out\.nc"):
        Unfinished(tmp_path / "none" / "out.nc")
