"""C compiler of the system, and the options for bit-identical results of all compilers.

The build executes this file before the package is installed, so it imports the standard library
only.
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
# a library that gcc has linked with one of these flushes subnormal numbers to 0 in the whole
# process
OTHER_BITS = re.compile(
    "-Ofast|-f(fast|associative|reciprocal)-math|-funsafe-math-optimizations|-ffinite-math-only"
)
# by default zig compiles for the processor that it runs on, and traps undefined behaviour; not all
# of its versions link functions of several vector widths (lanes.h)
ZIG = [
    sys.executable,
    *("-m", "ziglang", "cc", "-mcpu=baseline", "-fno-sanitize=undefined", "-DHS_ONE_WIDTH"),
]


def compiler() -> list[str]:
    """Return the command of the C compiler: ``CC`` of the environment, or the first that works; empty if none does."""
    chosen = shlex.split(os.environ.get("CC", ""))
    return chosen or next(([name] for name in ("cc", "gcc", "clang") if _compiles(name)), [])


def _compiles(name: str) -> bool:
    """Return True if a compiler exists and finds the headers of the C library, a separate package on some systems."""
    command = shutil.which(name)
    if command is None:
        return False
    check = [command, "-fsyntax-only", "-x", "c", "-"]
    return (
        subprocess.run(
            check, input=b"#include <math.h>\n", capture_output=True, check=False
        ).returncode
        == 0
    )


def options() -> list[str]:
    """Return ``CFLAGS`` and ``LDFLAGS`` of the environment, without options that change result bits, and -O3."""
    flags = shlex.split(os.environ.get("CFLAGS", "") + " " + os.environ.get("LDFLAGS", ""))
    level = [] if "-O0" in flags else ["-O3"]
    return [option for option in flags if not OTHER_BITS.fullmatch(option)] + level


def compile_shared(
    command: Sequence[str], sources: Sequence[str], library: Path, *, windows: bool
) -> None:
    """Compile sources into one shared library by one call of a compiler; RuntimeError with its message if it fails."""
    shared = ["-shared", "-fvisibility=hidden", *([] if windows else ["-fPIC", "-pthread"])]
    with tempfile.TemporaryDirectory() as cache:
        _compile([*command, *SAME_BITS, *shared, *sources, "-lm", "-o", str(library)], cache)


def compile_wasm(sources: Sequence[str], library: Path) -> None:
    """Compile sources to a WebAssembly module for browsers with ziglang; RuntimeError with its message if it fails."""
    target = ["-target", "wasm32-wasi", "-mexec-model=reactor", "-Os", "-s", "-DHS_ONE_THREAD"]
    # the default cache of zig keeps what has not changed
    _compile(
        [*ZIG[:4], "-fno-sanitize=undefined", *target, *SAME_BITS, *sources, "-o", str(library)]
    )


def _compile(command: Sequence[str], cache: str | None = None) -> None:
    cache_folders = (
        {} if cache is None else {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
    )
    try:
        done = subprocess.run(
            command, env=cache_folders | os.environ, capture_output=True, text=True, check=False
        )
    except OSError as error:
        raise RuntimeError(f"{shlex.join(command)}\n{error}") from error
    if done.returncode:
        raise RuntimeError(f"{shlex.join(command)}\n{done.stderr}")
