import time

import h5py
import hostile
import numpy as np
import pytest

from historysim.basics import system
from historysim.basics.hdf5 import check_contained, check_named
from historysim.errors import InputError

pytestmark = pytest.mark.usefixtures("alone")


def made(folder, fill):
    (folder / "secret").write_bytes(bytes(80))
    with h5py.File(folder / "m.h5", "w") as file:
        fill(file, folder)
    return folder / "m.h5"


@pytest.mark.parametrize(
    ("fill", "by_h5py", "message"),
    [
        (hostile._external, True, "'/F' lies in other files"),
        (hostile._virtual, True, "'/F' lies in other files"),
        (hostile._fifo, True, "'/F' lies in other files"),
        (hostile._fifo, False, "a process that reads it ends by a signal, or not within"),
        (hostile._nested, True, "HISTORYSIM_MOST_HDF5_DEPTH"),
        (hostile._nested, False, "HISTORYSIM_MOST_HDF5_DEPTH"),
        (hostile._circle, False, "a process that reads it ends by a signal, or not within"),
        (hostile._claims, False, "'F' claims 8,000,000,000,000 bytes in a file of"),
        (lambda file, _: file.create_group(b"\xff"), True, "expected names in UTF-8: it is damaged"),
    ],
)
def test_a_file_that_cannot_be_read_as_it_is_is_refused(tmp_path, monkeypatch, fill, by_h5py, message):
    monkeypatch.setenv("HISTORYSIM_MOST_HDF5_SECONDS", "1")
    with pytest.raises(InputError, match=message):
        check_contained(made(tmp_path, fill), by_h5py=by_h5py)
    if not by_h5py:
        with pytest.raises(InputError, match=r"m\.h5: "):
            check_named(tmp_path / "m.h5")


@pytest.mark.parametrize("fill", [hostile._linked, hostile._circle, hostile._claims])
def test_h5py_bears_more(tmp_path, fill):
    check_contained(made(tmp_path, fill), by_h5py=True)


def test_what_stands_for_itself_is_taken(tmp_path):
    def fill(file, _):
        file["a/b/x"] = np.zeros(10)
        file["a/again"] = file["a/b"]
        file["soft"] = h5py.SoftLink("/nowhere")
        file.create_dataset("small and empty", (1000,), "<f8", chunks=(10,))
        file.create_dataset("packed", data=np.zeros(10**7), compression="gzip", chunks=(10**6,))

    check_contained(made(tmp_path, fill))
    (tmp_path / "text").write_text("no HDF5", encoding="utf-8")
    check_contained(tmp_path / "text")
    check_contained(tmp_path / "none")


@pytest.mark.parametrize(("by_h5py", "copies"), [(True, system.COPIES_PROCESSES), (False, False)])
def test_what_the_library_reads_without_end_is_refused_in_time(tmp_path, monkeypatch, by_h5py, copies):
    monkeypatch.setenv("HISTORYSIM_MOST_HDF5_SECONDS", "1")
    monkeypatch.setattr(system, "COPIES_PROCESSES", copies)
    path = made(tmp_path, lambda file, _: file.create_dataset("x", data=np.zeros(3)).dims[0].attach_scale(scale(file)))
    check_contained(path, by_h5py=by_h5py)
    hostile.zeroed(path, b"GCOL", 16)
    before = time.monotonic()
    with pytest.raises(InputError, match=r"not within 1 s .*HISTORYSIM_MOST_HDF5_SECONDS"):
        check_contained(path, by_h5py=by_h5py)
    assert time.monotonic() - before < 20


def scale(file):
    file["t"] = np.arange(3.0)
    file["t"].make_scale()
    return file["t"]


@pytest.mark.skipif(not system.COPIES_PROCESSES, reason="copies no processes")
@pytest.mark.parametrize(("task", "well"), [(bool, True), (lambda: time.sleep(60), False), (lambda: 1 / 0, False)])
def test_how_a_copy_ends(task, well):
    assert system.copy_ends_well(lambda: (task(), system.os._exit(0)), 0.5) == well
