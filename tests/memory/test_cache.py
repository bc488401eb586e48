"""What is compiled is kept, is good as long as no file of the room changes, and gives the bits of its first run."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import historysim
from historysim.memory.cache import digest

pytestmark = pytest.mark.ci

PACKAGE = Path(historysim.__file__).parent
SCENARIO = PACKAGE.parent / "scenarios" / "01_load_steps_up.toml"

# `spread` stands in one file, and calls `touching`, which stands in another
PROGRAM = """
import json
import numpy as np
from historysim.memory.energy import spread
from historysim.memory.normal import touching
energy = np.zeros(2)
value = spread(np.array([0.0, 0.1]), np.ones(2), energy, 0.0, 1.0, 0.1, 0.2, 0.1, 0.2)
loaded = [function.__name__ for function in (touching, spread) if sum(function.stats.cache_hits.values())]
print(json.dumps([value, loaded]))
"""

UNWRITABLE_PACKAGE = """
import numba.core.caching
def nowhere(self):
    raise OSError
numba.core.caching.InTreeCacheLocator.ensure_cache_path = nowhere
"""
# nor the home
UNWRITABLE = UNWRITABLE_PACKAGE + "numba.core.caching.UserWideCacheLocator.ensure_cache_path = nowhere\n"


@pytest.fixture
def package(tmp_path):
    """A copy of the package, which keeps what it compiles beside itself."""
    return Path(
        shutil.copytree(PACKAGE, tmp_path / "site" / "historysim", ignore=shutil.ignore_patterns("__pycache__"))
    )


def environment(package, **variables):
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    return inherited | {"PYTHONPATH": str(package.parent)} | variables


def python(package, *arguments, **variables):
    """Standard output of Python with a copy of the package, in a process of its own."""
    command = [sys.executable, *map(str, arguments)]
    done = subprocess.run(
        command, cwd=package.parent, env=environment(package, **variables), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def outcome(package, before="", **variables):
    """What `spread` gives, and which of the two functions were loaded instead of compiled."""
    value, loaded = json.loads(python(package, "-c", before + PROGRAM, **variables))
    return value, loaded


def kept(package, function, suffix):
    found = list((package / "memory" / "__pycache__").glob(f"*.{function}-*.{suffix}"))
    assert found
    return found


def edited(file, old, new):
    """Replace text by text of the same length, and leave the times of the file as they were."""
    before = file.stat()
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    assert len(old) == len(new)
    file.write_text(text.replace(old, new), encoding="utf-8")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def without_bytecode(package):
    """Python itself trusts the time and size of a source file."""
    for file in package.rglob("*.pyc"):
        file.unlink()


def test_an_edit_of_what_is_called_compiles_its_callers_anew(package):
    first = outcome(package)
    assert first == (first[0], [])
    assert outcome(package) == (first[0], ["touching", "spread"])
    edited(package / "memory" / "normal.py", "return high\n    while", "return    1\n    while")
    without_bytecode(package)
    changed, loaded = outcome(package)
    assert loaded == []
    assert 0 < changed < first[0]
    assert outcome(package) == (changed, ["touching", "spread"])


def test_an_upgrade_in_place_compiles_anew(package):
    outcome(package)
    (package / "memory" / "new_in_this_version.py").write_text("", encoding="utf-8")
    assert outcome(package)[1] == []


def test_all_files_count_and_no_other_does(tmp_path):
    def stamp(**files):
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        for name, text in files.items():
            (folder / name).with_suffix(".py").write_text(text, encoding="utf-8")
        (folder / "notes.txt").write_text(folder.name, encoding="utf-8")
        return digest(folder)

    one = stamp(a="x", b="y")
    assert stamp(a="x", b="y") == one
    assert len({one, stamp(a="x", b="z"), stamp(a="x", c="y"), stamp(a="y", b="x"), stamp(a="x")}) == 5
    with pytest.raises(OSError, match="holds no source files"):
        digest(tmp_path)


def test_a_damaged_file_is_compiled_anew(package):
    value, _ = outcome(package)
    for file in kept(package, "spread", "nbc"):
        file.write_bytes(file.read_bytes()[:100])
    assert outcome(package) == (value, ["touching"])
    assert outcome(package) == (value, ["touching", "spread"])


def test_what_calls_a_function_that_is_lost_is_compiled_anew_with_it(package):
    value, _ = outcome(package)
    for file in kept(package, "touching", "nbc"):
        file.unlink()
    # after another function it gets another symbol than the one that its caller knows
    other = "from historysim.memory.clipping import crossing\ncrossing(0.0, 1.0, 0.0, 1.0, 1.0, 0.5)\n"
    assert outcome(package, other) == (value, [])
    assert outcome(package) == (value, ["touching", "spread"])


@pytest.mark.parametrize(
    "prevented",
    [
        "import numba.core.caching as c\ndel c.CompileResultCacheImpl\n",
        "import numba.core.caching as c\nc.FunctionCache.__init__ = lambda self: None\n",
    ],
)
def test_where_nothing_can_be_kept_everything_works(package, prevented):
    value, _ = outcome(package)
    assert outcome(package, prevented) == (value, [])


def test_where_nothing_can_be_written_what_lies_beside_the_source_is_loaded(package):
    """It came with the package, or its owner has used it."""
    value, loaded = outcome(package, UNWRITABLE)
    assert loaded == []
    assert not list(package.rglob("*.nb?"))
    assert outcome(package) == (value, [])
    assert outcome(package, UNWRITABLE) == (value, ["touching", "spread"])
    assert outcome(package, UNWRITABLE, NUMBA_CACHE_DIR=str(package / "else")) == (value, [])


def test_what_lies_beside_the_source_is_loaded_where_another_folder_is_written(package, tmp_path):
    value, _ = outcome(package)
    home = tmp_path / "home"
    assert outcome(package, UNWRITABLE_PACKAGE, XDG_CACHE_HOME=str(home)) == (value, ["touching", "spread"])
    assert not list(home.rglob("*.nbc"))
    for file in kept(package, "spread", "nbc"):
        file.unlink()
    assert outcome(package, UNWRITABLE_PACKAGE, XDG_CACHE_HOME=str(home)) == (value, ["touching"])
    assert list(home.rglob("*.spread-*.nbc"))


def test_a_full_disk_is_no_reason_to_stop(package):
    full = "import numba.core.caching as c\ndef no(*_): raise OSError(28, 'full')\nc.IndexDataCacheFile.save = no\n"
    value, loaded = outcome(package, full)
    assert loaded == []
    assert outcome(package) == (value, [])


def test_the_first_run_gives_the_bits_of_all_later_ones(package, tmp_path):
    results = []
    for name in ("cold.nc", "warm.nc"):
        python(package, "-m", "historysim", "run", SCENARIO, "-o", tmp_path / name)
        results.append(variables(tmp_path / name))
    assert results[0].keys() == results[1].keys()
    assert [name for name in results[0] if results[0][name] != results[1][name]] == []


def variables(path):
    import xarray as xr

    with xr.open_dataset(path, decode_times=False) as history:
        return {name: np.ascontiguousarray(values.values).tobytes() for name, values in history.variables.items()}
