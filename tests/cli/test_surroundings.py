"""Surroundings that are not those of the developer."""

import os
import subprocess
import sys
from pathlib import Path

from promises import SHORT
from pytest import mark

ROOT = Path(__file__).parents[2]
NAME = "50 % of a 'µ' – #1? a&b=c"
SURROUNDINGS = {
    "no home, and a terminal that does not know all signs": {
        "HOME": "/nonexistent",
        "PYTHONIOENCODING": "latin-1",
    },
    "the C locale to the letter": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
}


@mark.ci
@mark.parametrize("name", SURROUNDINGS)
def test_the_program_runs_anywhere(tmp_path, name):
    own = SURROUNDINGS[name]
    stem = NAME if "HOME" in own else "a"
    folder = tmp_path / stem
    folder.mkdir()
    (folder / f"{stem}.toml").write_text(f'title = "Gerät – µ"\n{SHORT}', encoding="utf-8")
    kept = {
        key: value
        for key, value in os.environ.items()
        if key not in {"XDG_CACHE_HOME", "MPLCONFIGDIR"}
    }
    environment = {**kept, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "error", **own}
    result = f"{stem}.nc"
    for words in (
        ["run", f"{stem}.toml", "-o", result],
        ["verify", result],
        ["show", result],
        ["plot", result, "-o", f"{stem}.png"],
    ):
        done = subprocess.run(
            [sys.executable, "-m", "historysim", *words],
            cwd=folder,
            env=environment,
            capture_output=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert b"Traceback" not in done.stderr


@mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux alone")
def test_a_name_that_is_no_text_is_reported(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "historysim", "run", os.fsencode("a\udcff.toml")],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 2
    assert b"is not a name in utf-8, the encoding of file names; rename it" in done.stderr
