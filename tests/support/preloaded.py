"""Programs of the tests that meet the system's calls through a C file of their own, preloaded before the C library."""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

COMPILER = shutil.which("cc") or shutil.which("gcc")
POSSIBLE = bool(COMPILER) and sys.platform.startswith("linux")
REASON = "needs a C compiler and LD_PRELOAD to come between a program and the system"


def preloaded(source: str) -> ctypes.CDLL:
    """Start this program again with a C file of this folder preloaded, and end with it; return the library there."""
    name = Path(source).with_suffix(".so").name
    library = os.environ.get("LD_PRELOAD", "")
    if Path(library).name == name:
        return ctypes.CDLL(library)
    if not POSSIBLE:
        sys.exit(REASON)
    with tempfile.TemporaryDirectory() as folder:
        library = f"{folder}/{name}"
        compile_it = [
            COMPILER,
            "-shared",
            "-fPIC",
            "-o",
            library,
            Path(__file__).with_name(source),
            "-ldl",
        ]
        subprocess.run(compile_it, check=True)
        environment = {**os.environ, "LD_PRELOAD": library}
        sys.exit(
            subprocess.run([sys.executable, *sys.argv], env=environment, check=False).returncode
        )


def run_script(path: Path, *arguments: object) -> str:
    """Run a script of the tests in a separate process; return what it prints.

    Raises
    ------
    AssertionError
        It has failed.
    """
    command = [sys.executable, path, *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout
