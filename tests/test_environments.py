"""Every command with the lowest versions of packages that are declared, and on the newest Python of this machine.

Packages come from PyPI by uv; nothing of the environment that runs these tests is used.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from pytest import mark, skip

import historysim

ROOT = Path(historysim.__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SMOKE = ROOT / "tests" / "scripts" / "smoke.py"
# Extras that need no other program, in one environment; `surfaces` and `zarr` need newer packages
# than historysim.
EXTRAS = ("hdf5", "tdms", "dask", "excel")

pytestmark = [
    mark.ci,
    # packages are downloaded and built; some minutes on a busy machine
    mark.timeout(3600),
    mark.skipif(
        importlib.util.find_spec("uv") is None, reason="needs uv, which installs the packages"
    ),
]


def run(*command, **variables):
    done = subprocess.run(
        list(map(str, command)),
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
        # the folder of the sources is not on the path: what is installed is tested
        # and the C is compiled in a fraction of the time: that it works at -O3 is tested in this
        # environment
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        | {"CFLAGS": "-O0"}
        | variables,
        cwd=ROOT.anchor,
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout


def uv(*arguments):
    return run(sys.executable, "-m", "uv", *arguments)


def make_environment(folder, python):
    """Make a virtual environment; return its interpreter."""
    uv("venv", "--quiet", "--python", python, folder)
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def find_lowest(requirements):
    """Lowest version by package, of requirements such as ``attrs>=24.1`` or ``ziglang==0.13.0``."""
    found = (re.fullmatch(r"([\w.-]+)[>=]=([\d.]+)", each) for each in requirements)
    return {each[1].lower(): each[2] for each in found if each}


def find_newest_python():
    """Interpreter of the newest CPython on this machine that is newer than this one; None if there is none."""
    names = [f"python3.{minor}" for minor in range(30, sys.version_info.minor, -1)]
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    for name in names:
        for command in [shutil.which(name), *sorted(versions.glob(f"*/bin/{name}"), reverse=True)]:
            if command is None:
                continue
            # a name on the path may be a stand-in that starts nothing
            if not subprocess.run([command, "-c", ""], capture_output=True, check=False).returncode:
                return command
    return None


def test_every_requirement_has_a_lower_bound():
    lists = [
        PROJECT["build-system"]["requires"],
        PROJECT["project"]["dependencies"],
        *PROJECT["project"]["optional-dependencies"].values(),
    ]
    assert [
        each for requirements in lists for each in requirements if not find_lowest([each])
    ] == []


def test_every_command_works_with_the_lowest_versions_that_are_declared(tmp_path):
    python = make_environment(tmp_path / "environment", "3.11")
    constraints = tmp_path / "build.txt"
    lowest = find_lowest([*PROJECT["build-system"]["requires"], "cffi>=1.16"])  # and the hook's
    constraints.write_text(
        "".join(f"{name}=={version}\n" for name, version in lowest.items()), encoding="utf-8"
    )
    install = ["pip", "install", "--quiet", "--python", python, "--resolution", "lowest-direct"]
    uv(*install, "--build-constraints", constraints, f"{ROOT}[{','.join(EXTRAS)}]")
    installed = dict(
        line.lower().split("==")
        for line in uv("pip", "freeze", "--python", python).splitlines()
        if "==" in line
    )
    optional = PROJECT["project"]["optional-dependencies"]
    declared = find_lowest(
        [*PROJECT["project"]["dependencies"], *(each for name in EXTRAS for each in optional[name])]
    )
    newer = {
        name: installed[name]
        for name, version in declared.items()
        if not re.match(rf"{re.escape(version)}(\.|$)", installed[name])
    }
    # a bound below the first release that other requirements allow is one that nobody installs
    assert newer == {}
    run(python, SMOKE, MPLBACKEND="agg")
    uv(*install, *optional["surfaces"], *optional["zarr"])
    run(python, SMOKE, "SurfaceTopography", "skimage", "zarr", MPLBACKEND="agg")


def test_every_command_works_on_the_newest_python(tmp_path):
    newest = find_newest_python()
    if newest is None:
        skip(f"this machine has no Python newer than {sys.version.split()[0]}")
    python = make_environment(tmp_path / "environment", newest)
    uv("pip", "install", "--quiet", "--python", python, str(ROOT))
    run(python, SMOKE, MPLBACKEND="agg")
