"""Files that are there, what they are, and files that are on the disk whole or not at all."""

import errno
import os
import sqlite3
import stat
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import h5py
import netCDF4
from pairs import UNIT
from pytest import fixture, mark, raises

import historysim as hs
from historysim.basics import system
from historysim.basics.files import (
    check_replaceable,
    is_file,
    is_log,
    is_netcdf,
    own_file,
    replacing,
)
from historysim.errors import InputError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@fixture
def older(tmp_path):
    path = tmp_path / "out.nc"
    path.write_text("older", encoding="utf-8")
    return path


def test_the_new_file_takes_the_place_of_the_old_one_at_the_end(older):
    with replacing(older, ".gif") as unfinished:
        unfinished.write_text("new", encoding="utf-8")
        assert unfinished.suffix == ".gif"
        assert unfinished.parent == older.parent
        assert unfinished.name.startswith(".out.nc.")
        assert older.read_text(encoding="utf-8") == "older"
    assert older.read_text(encoding="utf-8") == "new"
    assert names(older.parent) == ["out.nc"]


@mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_after_an_error_the_old_one_is_there_and_nothing_else(older, error):
    def fail():
        with replacing(older) as unfinished:
            unfinished.write_text("half", encoding="utf-8")
            raise error

    with raises(error):
        fail()
    assert older.read_text(encoding="utf-8") == "older"
    assert names(older.parent) == ["out.nc"]


def test_it_is_on_the_disk_before_it_has_its_name_and_the_name_is_afterwards(tmp_path, monkeypatch):
    order, fsync, replace = [], os.fsync, Path.replace
    inodes = {tmp_path.stat().st_ino: "folder"}

    def synced(handle):
        order.append(inodes.get(os.fstat(handle).st_ino))
        fsync(handle)

    def renamed(path, target):
        order.append("rename")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "replace", renamed)
    with replacing(tmp_path / "out.nc") as unfinished:
        inodes[unfinished.stat().st_ino] = "file"
    assert order == ["file", "rename", "folder"]


@mark.skipif(os.name != "posix", reason="needs the permissions of POSIX")
@mark.parametrize("mask, mode", [(0o022, 0o644), (0o077, 0o600)])
def test_it_may_be_read_by_whom_the_user_lets_read(tmp_path, mask, mode):
    before = os.umask(mask)
    try:
        with replacing(tmp_path / "out.nc") as unfinished:
            unfinished.write_bytes(b"new")
    finally:
        os.umask(before)
    assert (tmp_path / "out.nc").stat().st_mode & 0o777 == mode


@mark.parametrize("refused", ["open", "fsync"])
def test_whatever_the_system_refuses_is_reported_of_the_name_asked_for(older, refused, monkeypatch):
    called = getattr(os, refused)

    def refuse(first, *rest, **options):
        if refused == "open" and str(first).endswith("out.nc"):
            return called(first, *rest, **options)
        named = [first] if refused == "open" else []
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), *named)

    monkeypatch.setattr(os, refused, refuse)
    with raises(OSError, match="No space left on device") as caught, replacing(older):
        pass
    monkeypatch.undo()
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(older))
    assert older.read_text(encoding="utf-8") == "older"
    assert names(older.parent) == ["out.nc"]


@mark.parametrize(
    "target, refused",
    [
        ("result", "rename"),
        ("result", "fsync of the folder"),
        # SQLite syncs the bytes of a log by itself
        ("log", "rename"),
    ],
)
def test_a_failure_at_the_end_names_the_file_asked_for(tmp_path, target, refused, monkeypatch):
    ensemble = hs.Ensemble(UNIT, 0.0, 1.0, 0.2)
    events = [hs.NormalLoad(0.0, 0.01)]
    called = {"fsync": os.fsync, "replace": Path.replace}

    def refuse_sync(handle):
        if (refused == "fsync of the folder") == stat.S_ISDIR(os.fstat(handle).st_mode):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        called["fsync"](handle)

    def refuse_replace(path, other):
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(path), None, str(other))

    log = hs.EventLog.create(tmp_path / "a.history", ensemble, events)
    log.close()
    if refused == "rename":
        monkeypatch.setattr(Path, "replace", refuse_replace)
    else:
        monkeypatch.setattr(os, "fsync", refuse_sync)
    name = "b.nc" if target == "result" else "b.history"
    write = {
        "result": lambda: hs.run(tmp_path / "a.history", tmp_path / name),
        "log": lambda: hs.EventLog.create(tmp_path / name, ensemble, events),
    }
    with raises(OSError, match="Input/output error") as caught:
        write[target]()
    monkeypatch.undo()
    assert caught.value.filename == str(tmp_path / name)


def test_an_error_in_the_block_names_the_file_asked_for_or_another(older, tmp_path):
    with raises(FileNotFoundError) as caught, replacing(older) as unfinished:
        unfinished.unlink()
    assert caught.value.filename == str(older)
    with raises(FileNotFoundError) as caught, replacing(older):
        (tmp_path / "other").read_bytes()
    assert caught.value.filename == str(tmp_path / "other")


def test_only_a_file_is_a_file(tmp_path):
    (tmp_path / "file").touch()
    assert is_file(tmp_path / "file")
    assert not is_file(tmp_path)
    for name in ("none", "a\0b", "n" * 5000, "file/none"):
        assert not is_file(tmp_path / name)


def unfinished_of(process, host=None):
    return f".out.nc.{host or system.host()}-{process}-{'0' * 16}.part"


def test_what_a_killed_process_has_left_is_removed_by_the_next_one_and_nothing_else(older):
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        gone.wait()
    folder = older.parent
    left = unfinished_of(gone.pid)
    kept = [
        unfinished_of(os.getpid()),
        unfinished_of(gone.pid, "0" * 8),
        f".other{left}",
        ".out.nc.part",
        ".out.nc.unfinished",
    ]
    for name in (left, *kept):
        (folder / name).touch()
    (folder / "linked").touch()
    linked = left.replace("0" * 16, "1" * 16)
    (folder / linked).symlink_to("linked")
    with replacing(older) as unfinished:
        unfinished.write_text("new", encoding="utf-8")
    assert names(folder) == sorted(["out.nc", "linked", linked, *kept])


def test_its_name_cannot_be_guessed_and_is_not_followed(older, monkeypatch):
    found = set()
    for _ in range(3):
        with replacing(older) as unfinished:
            found.add(unfinished.name)
    assert len(found) == 3
    monkeypatch.setattr(os, "urandom", bytes)
    victim = older.parent / "victim"
    victim.write_text("whose", encoding="utf-8")
    (older.parent / unfinished_of(os.getpid())).symlink_to(victim)
    with raises(FileExistsError), replacing(older):
        pass
    assert victim.read_text(encoding="utf-8") == "whose"


@mark.parametrize("kind", ["link", "fifo"])
def test_only_a_regular_file_is_replaced(older, kind):
    path = older.parent / kind
    path.symlink_to(older) if kind == "link" else os.mkfifo(path)
    with raises(InputError, match=f"(?i)is a {kind}"), replacing(path):
        pass
    with raises(InputError, match=f"(?i)is a {kind}"):
        check_replaceable(path)
    assert older.read_text(encoding="utf-8") == "older"


def test_a_file_of_a_known_name_is_ones_own(tmp_path):
    os.close(own_file(tmp_path / "made"))
    (tmp_path / "other").hardlink_to(tmp_path / "made")
    (tmp_path / "link").symlink_to(tmp_path / "none")
    os.mkfifo(tmp_path / "fifo")
    for name in ("made", "link", "fifo"):
        with raises(OSError, match=f"{name} is .*; remove it"):
            own_file(tmp_path / name)
    os.close(own_file(tmp_path / "made", shared=True))
    assert not (tmp_path / "none").exists()


def test_a_file_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "letter").write_text("what nobody has twice", encoding="utf-8")
    for name in ("folder", "letter"):
        with raises(OSError, match=f"{name} .*; move it away"):
            own_file(tmp_path / name, begins=(b"SQLite",))
    assert (tmp_path / "letter").read_text(encoding="utf-8") == "what nobody has twice"
    os.close(own_file(tmp_path / "letter", begins=(b"rows", b"what")))


def test_files_are_known_by_their_first_bytes(tmp_path):
    with closing(sqlite3.connect(tmp_path / "log")) as connection:
        connection.execute("CREATE TABLE one (number INTEGER)")
    forms = ("NETCDF4", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA")
    for form in forms:
        netCDF4.Dataset(tmp_path / form, "w", format=form).close()
    h5py.File(tmp_path / "map.h5", "w").close()
    (tmp_path / "text").write_text("SQLite format 3", encoding="utf-8")
    (tmp_path / "empty").touch()
    for name in ("log", *forms, "map.h5", "text", "empty", "none", ".", "a\0b"):
        assert is_log(tmp_path / name) is (name == "log")
        assert is_netcdf(tmp_path / name) is (name in {*forms, "map.h5"})
