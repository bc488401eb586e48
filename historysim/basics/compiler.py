"""Which compiler of C there is, and the options by which all of them give the same bits.

The build reads this file by itself, before the package is there: it imports the standard library alone.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

SAME_BITS = ["-std=c11", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
# gcc also has a library that was linked with one of these round small numbers to 0 in the whole process
OTHER_BITS = re.compile("-Ofast|-f(fast|associative|reciprocal)-math|-funsafe-math-optimizations|-ffinite-math-only")
# by itself zig compiles for the processor that it runs on, and traps what is undefined
ZIG = [sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline", "-fno-sanitize=undefined"]


def compiler() -> list[str]:
    """Return the command that compiles C: the environment's ``CC``, or the first that can; empty where none can."""
    chosen = shlex.split(os.environ.get("CC", ""))
    return chosen or next(([name] for name in ("cc", "gcc", "clang") if _compiles(name)), [])


def _compiles(name: str) -> bool:
    """Whether a compiler is there with the headers of the C library, which come by themselves in some distributions."""
    command = shutil.which(name)
    if command is None:
        return False
    asked = [command, "-fsyntax-only", "-x", "c", "-"]
    return subprocess.run(asked, input=b"#include <math.h>\n", capture_output=True, check=False).returncode == 0


def options() -> list[str]:
    """Return the environment's ``CFLAGS`` and ``LDFLAGS``, without what would change the bits of results, and -O3."""
    given = shlex.split(os.environ.get("CFLAGS", "") + " " + os.environ.get("LDFLAGS", ""))
    level = [] if "-O0" in given else ["-O3"]
    return [option for option in given if not OTHER_BITS.fullmatch(option)] + level


def compile_shared(command: Sequence[str], sources: Sequence[str], library: Path, *, windows: bool) -> None:
    """Compile sources into one shared library, in one call of a compiler; a RuntimeError has its message."""
    shared = ["-shared", "-fvisibility=hidden", *([] if windows else ["-fPIC", "-pthread"])]
    whole = [*command, *SAME_BITS, *shared, *sources, "-lm", "-o", str(library)]
    with tempfile.TemporaryDirectory() as cache:
        kept = {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
        try:
            done = subprocess.run(whole, env=kept | os.environ, capture_output=True, text=True, check=False)
        except OSError as error:
            raise RuntimeError(f"{shlex.join(whole)}\n{error}") from error
    if done.returncode:
        raise RuntimeError(f"{shlex.join(whole)}\n{done.stderr}")
