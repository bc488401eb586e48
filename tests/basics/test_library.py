import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from pytest import mark, raises

from historysim.basics import _declarations, library
from historysim.basics.library import ffi, lib, pointer
from historysim.errors import InstallationError

PACKAGE = Path(library.__file__).parents[1]
FILE = Path(library.__file__).with_name(_declarations.LIBRARY)
# what is exported as source to other programs is no part of it
SOURCES = [
    path for path in sorted(PACKAGE.rglob("*.[ch]")) if PACKAGE / "exchange" not in path.parents
]
NM = shutil.which("nm")
nm = mark.skipif(not NM or sys.platform != "linux", reason="asks nm of an ELF file")


def symbols(which):
    listed = subprocess.run(
        [NM, "-D", which, FILE], capture_output=True, text=True, check=True
    ).stdout
    return {line.split()[-1].partition("@")[0] for line in listed.splitlines()}


@nm
def test_the_library_shows_what_its_headers_declare_and_nothing_else():
    functions = {name for name in dir(lib) if not name.startswith("HS_")}
    assert symbols("--defined-only") == functions
    assert all(name.startswith("hs_") for name in functions)


@nm
def test_the_library_knows_nothing_of_python():
    assert not [name for name in symbols("--undefined-only") if re.match(r"_?Py", name)]
    assert not [path for path in SOURCES if "Python.h" in path.read_text(encoding="utf-8")]


@mark.skipif(
    not (PACKAGE.parent / "pyproject.toml").exists(), reason="installed without its sources"
)
def test_the_library_is_not_older_than_its_sources():
    edited = [path.name for path in SOURCES if path.stat().st_mtime > FILE.stat().st_mtime]
    assert edited == [], "run `python hatch_build.py`"


def test_loading_it_parses_and_generates_nothing():
    code = "import sys, historysim.basics.library; print(*sorted({'cffi', 'pycparser'} & sys.modules.keys()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_a_pointer_is_the_memory_of_its_array():
    array = np.arange(3.0)
    pointer(array)[1] = 7.0
    assert array.tolist() == [0.0, 7.0, 2.0]
    assert ffi.typeof(pointer(np.zeros(2, dtype=np.int64))) is ffi.typeof("int64_t[]")
    assert ffi.typeof(pointer(np.zeros(2, dtype=np.bool_))) is ffi.typeof("bool[]")


@mark.parametrize(
    "array, error",
    [
        (np.zeros((4, 4))[:, 0], ValueError),
        (np.zeros(3, dtype=np.float32), KeyError),
        (np.zeros(3, dtype=np.dtype(np.float64).newbyteorder()), KeyError),
    ],
)
def test_what_c_would_misread_has_no_pointer(array, error):
    with raises(error):
        pointer(array)


def loaded_from(folder):
    copy = shutil.copy(library.__file__, folder)
    spec = importlib.util.spec_from_file_location("library_elsewhere", copy)
    spec.loader.exec_module(importlib.util.module_from_spec(spec))


def test_a_clone_that_is_not_installed_says_how_to_mend_it(tmp_path, monkeypatch):
    with raises(
        InstallationError, match=rf"expected it in {re.escape(str(tmp_path))}.* `pip install -e \.`"
    ):
        loaded_from(tmp_path)
    (tmp_path / FILE.name).write_text("no library")
    with raises(InstallationError, match=r"cannot be loaded.* `pip install -e \.`"):
        loaded_from(tmp_path)
    monkeypatch.setitem(sys.modules, _declarations.__name__, None)
    with raises(InstallationError, match=r"cannot be loaded.* `pip install -e \.`"):
        loaded_from(tmp_path)
