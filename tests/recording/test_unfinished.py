import os

import pytest

from historysim.basics.lock import WriterLock
from historysim.recording.unfinished import Unfinished


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_result_has_its_name_when_it_is_published_and_readers_are_not_kept_out(tmp_path):
    output = tmp_path / "out.nc"
    output.write_bytes(b"older")
    file = Unfinished(output)
    os.pwrite(file.handle, b"newer", 0)
    assert output.read_bytes() == b"older"
    file.publish()
    assert output.read_bytes() == b"newer"
    # HDF5 locks what it reads
    WriterLock(output).release()
    file.close(keep=False)
    assert names(tmp_path) == ["out.nc"]


@pytest.mark.parametrize("keep", [True, False])
def test_what_is_kept_is_there_for_the_next_one(tmp_path, keep):
    file = Unfinished(tmp_path / "out.nc")
    os.pwrite(file.handle, b"rows", 0)
    file.close(keep=keep)
    assert names(tmp_path) == ([".out.nc.unfinished"] if keep else [])
    again = Unfinished(tmp_path / "out.nc")
    assert again.path.read_bytes() == (b"rows" if keep else b"")
    again.forget()
    assert again.path.read_bytes() == b""
    again.close(keep=False)


def test_a_second_writer_is_told(tmp_path):
    file = Unfinished(tmp_path / "out.nc")
    with pytest.raises(OSError, match="another process is writing this result") as caught:
        Unfinished(tmp_path / "out.nc")
    assert caught.value.filename == str(tmp_path / "out.nc")
    file.close(keep=False)
    Unfinished(tmp_path / "out.nc").close(keep=False)


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none/out\.nc"):
        Unfinished(tmp_path / "none" / "out.nc")
