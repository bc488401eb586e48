"""Run, verify, show and draw a small scenario in surroundings of many kinds, and compare every bit.

    PYTHONPATH=tests/support python tests/scripts/matrix.py            # all that this machine can be made to be
    PYTHONPATH=tests/support python tests/scripts/matrix.py --cheap    # those that take seconds

What a machine lacks (another user) is reported and passed over.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import attrs
from promises import SHORT, variables

ROOT = Path(__file__).parents[2]
SCENARIO = f'title = "Gerät – µ"\n{SHORT}'
NAME = "50 % of a 'µ' – #1? a&b=c"
NOBODY = 65534


class LackingError(Exception):
    """This machine cannot be made to be so."""


@attrs.define
class Place:
    """A folder to run in, and how to start Python there."""

    folder: Path
    python: Sequence[str] = (sys.executable,)
    package: Path = ROOT
    environment: dict[str, str] = attrs.field(factory=dict)
    without: tuple[str, ...] = ()

    def start(self, *arguments: str) -> "subprocess.Popen[str]":
        """Start the program."""
        environment = {key: value for key, value in os.environ.items() if key not in self.without}
        environment |= {"PYTHONPATH": str(self.package), "PYTHONWARNINGS": "error", **self.environment}
        return subprocess.Popen(
            [*self.python, "-m", "historysim", *arguments],
            cwd=self.folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
        )

    def check(self, name: str = "a", *, several: int = 1) -> None:
        """Run a scenario, so many times at once, and ask what came out."""
        (self.folder / f"{name}.toml").write_text(SCENARIO, encoding="utf-8")
        results = [f"{name}{number}.nc" for number in range(several)]
        for run in [self.start("run", f"{name}.toml", "-o", result) for result in results]:
            _done(run)
        for arguments in (["verify"], ["show"], ["plot", "-o", f"{name}.png"]):
            _done(self.start(*arguments, results[0]))
        found = [variables(self.folder / result) for result in results]
        assert all(values == found[0] for values in found)


def _done(process: "subprocess.Popen[str]") -> None:
    printed, said = process.communicate()
    assert process.returncode == 0, said or printed
    assert "Traceback" not in said, said


# -- surroundings -----------------------------------------------------------------------------------


def c_locale(folder: Path) -> None:
    Place(folder, environment={"LC_ALL": "C"}).check(NAME)


def c_locale_to_the_letter(folder: Path) -> None:
    Place(folder, environment={"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}).check()


def odd_names_and_no_home(folder: Path) -> None:
    """Also on a terminal that does not know all signs."""
    place = folder / NAME
    place.mkdir()
    environment = {"HOME": "/nonexistent", "PYTHONIOENCODING": "latin-1"}
    Place(place, environment=environment, without=("XDG_CACHE_HOME", "MPLCONFIGDIR")).check(NAME)


def without_docstrings_and_assertions(folder: Path) -> None:
    Place(folder, environment={"PYTHONOPTIMIZE": "2"}).check()


def twenty_runs_at_once(folder: Path) -> None:
    Place(folder).check(several=20)


def read_only_installation(folder: Path) -> None:
    """Another user, without a home, who may not write to the package."""
    Place(folder, python=_as_nobody(folder), environment={"HOME": "/nonexistent"}, package=_copy(folder)).check()


def read_only_home(folder: Path) -> None:
    home = folder / "home"
    home.mkdir()
    home.chmod(0o555)
    Place(folder, python=_as_nobody(folder), environment={"HOME": str(home)}, without=("XDG_CACHE_HOME",)).check()


def _copy(folder: Path) -> Path:
    package = folder / "package"
    shutil.copytree(ROOT / "historysim", package / "historysim", ignore=shutil.ignore_patterns("__pycache__"))
    return package


def _as_nobody(folder: Path) -> Sequence[str]:
    if os.geteuid() != 0 or not shutil.which("setpriv"):
        raise LackingError("needs root and setpriv, to be another user")
    folder.chmod(0o777)
    return ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", sys.executable)


CHEAP = (odd_names_and_no_home, c_locale_to_the_letter)
COSTLY = (c_locale, read_only_home, read_only_installation, without_docstrings_and_assertions, twenty_runs_at_once)
ALL = {case.__name__: case for case in (*CHEAP, *COSTLY)}


def main() -> None:
    """Read the arguments, and say what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cheap", action="store_true")
    parser.add_argument("names", nargs="*", help="only these")
    arguments = parser.parse_args()
    failed = 0
    for name, case in ALL.items():
        if (arguments.names and name not in arguments.names) or (arguments.cheap and case not in CHEAP):
            continue
        began = time.perf_counter()
        with tempfile.TemporaryDirectory(prefix="matrix.") as folder:
            try:
                case(Path(folder))
                told = "passed"
            except LackingError as error:
                told = f"not tried: {error}"
            except AssertionError as error:
                told, failed = f"FAILED: {error}", failed + 1
        print(f"{name.replace('_', ' ')}: {told} ({time.perf_counter() - began:.0f} s)", flush=True)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
