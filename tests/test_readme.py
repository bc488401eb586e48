"""The README's blocks run as they stand, in their order, in one folder with the repository's data and scenarios."""

import contextlib
import io
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from historysim.cli import main

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"```(\w+)\n(.*?)```", re.DOTALL)
PLACE = re.compile(r"# (?P<name>\w+\.toml)(?:: (?P<base>\w+\.toml) with this.*)?\n")
INSTALLATION = ("pip install . && ", 'pip install -e ".[test]"')


def typed(text):
    """Run the lines of a block of the shell, and return what the last one printed."""
    output = ""
    for line in text.splitlines():
        if line.startswith(INSTALLATION[1]):
            continue
        words = shlex.split(line.removeprefix(INSTALLATION[0]), comments=True)
        assert words[0] == "historysim"
        done = CliRunner().invoke(main, words[1:])
        assert done.exit_code == 0, f"{line}: {done.output}"
        output = done.output
    return output


def saved(text):
    """Save a block of TOML where its first line says."""
    found = PLACE.match(text)
    assert found, f"the first line says no file: {text[:60]}"
    path = Path(found["name"])
    before = Path(found["base"]).read_text(encoding="utf-8") if found["base"] else ""
    table = re.search(r"^\[.*\]$", text, re.MULTILINE)[0]
    before = re.sub(rf"(?ms)^{re.escape(table)}\n.*?(?=^\[|\Z)", "", before)
    path.write_text(f"{before}\n{text}", encoding="utf-8")
    assert typed(f"historysim validate {path}").endswith("valid\n")


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    """Return the folder after all blocks, what each sort of block has printed, and the names of Python's."""
    folder = tmp_path_factory.mktemp("readme")
    for name in ("data", "scenarios"):
        (folder / name).symlink_to(ROOT / name)
    names, printed, last = {"__name__": "readme"}, {"text": [], "python": []}, ""
    with pytest.MonkeyPatch.context() as patch, contextlib.chdir(folder):
        # one process is enough for what is so small
        patch.setattr("historysim.cli.simulations.processors", lambda: 1)
        for kind, text in BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8")):
            if kind == "toml":
                saved(text)
            elif kind == "sh":
                last = typed(text)
            elif kind == "python":
                with contextlib.redirect_stdout(io.StringIO()) as stream:
                    exec(compile(text, "README.md", "exec"), names)  # noqa: S102 - it is what a reader would type
                printed["python"].append(stream.getvalue())
            elif kind == "text":
                printed["text"].append((text, last))
            else:
                assert kind == "bibtex"
    return folder, printed, names


def test_every_block_runs_and_writes_what_it_says(outcome):
    folder, printed, _ = outcome
    files = (
        "10_random_rough_surface.png my.png my.pdf my_report.html ball_fitted.toml ball_fitted.png sweep.nc other.nc"
    )
    assert [name for name in files.split() if not (folder / name).is_file()] == []
    assert all(printed["python"][:2])


def test_what_it_says_that_is_printed_is_printed(outcome):
    _, printed, _ = outcome
    for said, came in printed["text"]:
        assert said.strip() == came.strip()


def test_the_results_are_those_of_the_last_scenario(outcome):
    folder, _, names = outcome
    with xr.open_dataset(folder / "my.nc", decode_times=False) as history:
        assert (history.total_tangential_load <= 0.12 * history.total_normal_load * (1 + 1e-9)).all()
        assert names["first"] in history.asperity
    fitted = tomllib.loads((folder / "ball_fitted.toml").read_text(encoding="utf-8"))
    # the record is of a ball with this friction
    assert fitted["friction"]["coefficient"] == pytest.approx(0.2, rel=1e-3)
    batch = names["batch"]
    assert np.isfinite(batch.tangential_load).all()
    assert (batch.normal_load[: batch.normal_load.size // 11] == 0).all()
