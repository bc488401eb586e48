import h5py
import hostile
import numpy as np
import pytest

from historysim.basics.hdf5 import check_contained, check_named
from historysim.errors import InputError


def made(folder, fill):
    (folder / "secret").write_bytes(bytes(80))
    with h5py.File(folder / "m.h5", "w") as file:
        fill(file, folder)
    return folder / "m.h5"


@pytest.mark.parametrize(
    ("fill", "told"),
    [
        (hostile._external, "'/F' lies in other files"),
        (hostile._virtual, "'/F' lies in other files"),
        (hostile._fifo, "'/F' lies in other files"),
        (hostile._linked, "'/F' is a link to another file"),
        (hostile._nested, "HISTORYSIM_MOST_HDF5_DEPTH"),
        (hostile._circle, "'/a/again' holds itself"),
        (hostile._claims, "claims 8,000,000,000,000 bytes and holds 0"),
    ],
)
def test_a_file_that_does_not_stand_for_itself_is_refused(tmp_path, fill, told):
    with pytest.raises(InputError, match=told):
        check_contained(made(tmp_path, fill))
    with pytest.raises(InputError, match=r"m\.h5: "):
        check_named(tmp_path / "m.h5")


@pytest.mark.parametrize("fill", [hostile._linked, hostile._circle, hostile._claims])
def test_h5py_bears_more(tmp_path, fill):
    check_contained(made(tmp_path, fill), by_h5py=True)


def test_too_many_objects_are_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("HISTORYSIM_MOST_HDF5_OBJECTS", "5")

    def fill(file, _):
        for number in range(5):
            file[str(number)] = 1.0

    with pytest.raises(InputError, match="expected 5 at most"):
        check_contained(made(tmp_path, fill))


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
